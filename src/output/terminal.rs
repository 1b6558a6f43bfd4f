//! The table of iterations on the terminal, and progress lines.
//!
//! The table goes to standard output and progress lines go to standard error, each only if that is a terminal. Piped
//! output stays free of both.

use super::{sci, seconds};
use crate::ddm::{Observer, Row};
use indicatif::{HumanDuration, ProgressBar, ProgressState, ProgressStyle};
use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::time::Duration;

/// An observer that prints one line per iteration: all up to 20, every 10th up to 200, every 100th after that, and the
/// last.
pub struct IterationTable {
    /// Output of the table; none prints no table.
    table: Option<Box<dyn Write>>,
    bar: ProgressBar,
    target: String,
    /// Residual that ends the iteration, for the remaining time.
    tolerance: Option<f64>,
    /// First row, from which the mean rate is measured.
    first: Option<Row>,
    /// Last row, until it is printed.
    waiting: Option<Row>,
}

impl IterationTable {
    /// Return a table on the terminal of this process, or one without output unless `loud`. `target` says in words when
    /// the iteration stops ("residual < 1e-8"), and `tolerance` is that residual.
    pub fn new(loud: bool, target: &str, tolerance: Option<f64>) -> Self {
        let bar = if loud { ProgressBar::new_spinner() } else { ProgressBar::hidden() };
        if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {wide_msg}") {
            bar.set_style(style);
        }
        if loud {
            bar.set_message(format!("before the first sweep, until {target}"));
            bar.enable_steady_tick(TICK);
        }
        let stdout = io::stdout();
        let table = (loud && stdout.is_terminal()).then(|| Box::new(stdout) as Box<dyn Write>);
        Self { table, bar, target: target.into(), tolerance, first: None, waiting: None }
    }

    /// Print the last row, if it is not printed yet, and remove the progress line. Dropping does the same.
    pub fn finish(&mut self) {
        if let Some(row) = self.waiting.take() {
            self.print(line(&row));
        }
        self.bar.finish_and_clear();
    }

    /// Print a line above the progress line. A closed terminal is no reason to stop the run.
    fn print(&mut self, line: String) {
        if let Some(table) = &mut self.table {
            self.bar.suspend(|| drop(writeln!(table, "{line}").and_then(|()| table.flush())));
        }
    }
}

impl Observer for IterationTable {
    fn row(&mut self, row: &Row) {
        if self.first.is_none() {
            self.first = Some(row.clone());
            self.print(HEADINGS.iter().map(|(heading, width)| format!("{heading:>width$}")).collect());
        }
        let first = self.first.as_ref().unwrap_or(row);
        let remaining = self.tolerance.map(|tolerance| time_left(row, first, tolerance));
        self.bar.set_message(format!(
            "iteration {}, residual {}, until {}{}",
            row.iteration,
            sci(row.residual, 2),
            self.target,
            left(remaining)
        ));
        self.waiting = Some(row.clone());
        let k = row.iteration;
        if k <= 20 || k <= 200 && k.is_multiple_of(10) || k.is_multiple_of(100) {
            self.waiting = None;
            self.print(line(row));
        }
    }
}

impl Drop for IterationTable {
    fn drop(&mut self) {
        self.finish();
    }
}

/// Return the seconds until the residual reaches `tolerance`, if it falls at the mean rate since the `first` row. The
/// result is not finite if the residual does not fall.
fn time_left(row: &Row, first: &Row, tolerance: f64) -> f64 {
    (row.residual / tolerance).ln() / (first.residual / row.residual).ln().max(0.0) * (row.seconds - first.seconds)
}

/// Headings of the table and widths of its columns.
const HEADINGS: [(&str, usize); 9] = [
    ("k", 5),
    ("residual", 11),
    ("increment", 11),
    ("gamma", 8),
    ("F1", 15),
    ("closed/points", 17),
    ("factored", 10),
    ("inner", 9),
    ("seconds", 9),
];

/// Return a row as a line of the table.
fn line(row: &Row) -> String {
    let texts = [
        row.iteration.to_string(),
        sci(row.residual, 3),
        sci(row.increment, 3),
        if row.gamma.is_nan() { "-".into() } else { format!("{:.4}", row.gamma) },
        sci(row.energy, 6),
        format!("{}/{}", row.closed, row.points),
        row.factorizations.to_string(),
        row.inner_iterations.to_string(),
        seconds(row.seconds),
    ];
    HEADINGS.iter().zip(texts).map(|((_, width), text)| format!("{text:>width$}")).collect()
}

/// Time between two drawings of a line.
const TICK: Duration = Duration::from_millis(200);

/// Seconds; phases that end sooner show no line.
const SHORT: f64 = 1.0;

/// The progress line of one phase of a run, which disappears when it is dropped.
pub struct ProgressLine(ProgressBar);

impl ProgressLine {
    /// Return a line with the name `what` of the phase and the elapsed time, shown after a second. If the duration in
    /// seconds has an `estimate`, the line shows the remaining time, too.
    pub fn new(what: &str, estimate: Option<f64>) -> Self {
        let what = what.to_owned();
        let text = move |state: &ProgressState, out: &mut dyn fmt::Write| {
            let elapsed = state.elapsed().as_secs_f64();
            // a line that cannot be written is no reason to stop
            let _ = if elapsed < SHORT {
                Ok(())
            } else {
                write!(out, "{what}, {elapsed:.0} s{}", left(estimate.map(|total| total - elapsed)))
            };
        };
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{text}") {
            bar.set_style(style.with_key("text", text));
        }
        bar.enable_steady_tick(TICK);
        Self(bar)
    }
}

impl Drop for ProgressLine {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// Return the remaining seconds in words; nothing if they are unknown or an estimate was too low.
pub fn left(seconds: Option<f64>) -> String {
    let known = seconds.and_then(|left| Duration::try_from_secs_f64(left.round()).ok()).filter(|left| !left.is_zero());
    known.map_or(String::new(), |left| format!(", about {:#} left", HumanDuration(left)))
}

/// Return a bar over many runs with the remaining time, hidden unless `is_shown`.
pub fn runs(count: usize, is_shown: bool) -> ProgressBar {
    if !is_shown {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(count as u64);
    if let Ok(style) =
        ProgressStyle::with_template("{spinner} {bar:30} {pos}/{len}, {elapsed} gone, {eta} left: {wide_msg}")
    {
        bar.set_style(style);
    }
    // the elapsed time must go on during a run
    bar.enable_steady_tick(TICK);
    bar
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;
    use std::rc::Rc;

    #[derive(Clone, Default)]
    struct Screen(Rc<RefCell<Vec<u8>>>);

    impl Write for Screen {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.borrow_mut().write(bytes)
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn long_runs_are_thinned_and_end_with_the_last_row() {
        let screen = Screen::default();
        let mut table = IterationTable::new(false, "residual < 1e-8", None);
        table.table = Some(Box::new(screen.clone()));
        (0..=437).for_each(|iteration| table.row(&Row { iteration, ..Row::default() }));
        drop(table);
        let text = String::from_utf8(screen.0.take()).unwrap();
        let numbers = text.lines().skip(1).map(|line| line.split_whitespace().next().unwrap().parse().unwrap());
        let mut expected: Vec<usize> = (0..=20).collect();
        expected.extend((30..=200).step_by(10));
        expected.extend([300, 400, 437]);
        assert_eq!(numbers.collect::<Vec<usize>>(), expected);
    }

    #[test]
    fn the_time_left_is_that_of_the_mean_rate() {
        let row = |residual: f64, seconds: f64| Row { residual, seconds, ..Row::default() };
        let at = |residual: f64, seconds: f64| time_left(&row(residual, seconds), &row(1.0, 1.0), 1e-8);
        assert!((at(1e-2, 5.0) - 12.0).abs() < 1e-9, "two digits of eight in four seconds");
        assert!(!at(1.0, 5.0).is_finite() && !at(2.0, 5.0).is_finite());
        assert_eq!(left(Some(40.2)), ", about 40s left");
        assert_eq!([left(Some(f64::NAN)), left(Some(f64::INFINITY)), left(None)], [""; 3].map(str::to_owned));
    }
}
