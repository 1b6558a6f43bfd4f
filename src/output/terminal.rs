//! The table of iterations on the terminal, and progress lines.
//!
//! The table goes to standard output and progress lines go to standard error, each only if that is a terminal. Piped output stays free of both.

use super::{sci, seconds};
use crate::ddm::{Observer, Row};
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::time::Duration;

/// An observer that prints one line per iteration: all up to 20, every 10th up to 200, every 100th after that, and the last.
pub struct IterationTable {
    /// Output of the table; `None` prints no table.
    table: Option<Box<dyn Write>>,
    bar: ProgressBar,
    target: String,
    /// Residual that ends the iteration, for the remaining time.
    tolerance: Option<f64>,
    /// First row, from which the mean rate is measured.
    first: Option<Row>,
    columns: Option<Vec<Column>>,
    /// Last row, until it is printed.
    waiting: Option<Row>,
}

impl IterationTable {
    /// Return a table on the terminal of this process, or one without output unless `loud`. `target` says in words when the
    /// iteration stops ("residual < 1e-8"), and `tolerance` is that residual.
    pub fn new(loud: bool, target: &str, tolerance: Option<f64>) -> Self {
        let bar = if loud && io::stderr().is_terminal() {
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
            if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {wide_msg}") {
                bar.set_style(style);
            }
            bar.set_message(format!("before the first sweep, until {target}"));
            bar.enable_steady_tick(Duration::from_millis(120));
            bar
        } else {
            ProgressBar::hidden()
        };
        let stdout = io::stdout();
        let table = (loud && stdout.is_terminal()).then(|| Box::new(stdout) as Box<dyn Write>);
        let mut table = Self::on(table, bar, target);
        table.tolerance = tolerance;
        table
    }

    /// Return a table with this output and progress bar.
    fn on(table: Option<Box<dyn Write>>, bar: ProgressBar, target: &str) -> Self {
        Self { table, bar, target: target.into(), tolerance: None, first: None, columns: None, waiting: None }
    }

    /// Print the last row, if it is not printed yet, and remove the progress line. Dropping does the same.
    pub fn finish(&mut self) {
        if let Some(row) = self.waiting.take() {
            self.print(&row);
        }
        self.bar.finish_and_clear();
    }

    /// Print a row, the first time after the heading.
    fn print(&mut self, row: &Row) {
        let Some(table) = &mut self.table else { return };
        let mut text = String::new();
        let columns = self.columns.get_or_insert_with(|| {
            let columns = columns(row);
            text = line(&columns, |column| column.heading.to_owned()) + "\n";
            columns
        });
        text += &line(columns, |column| (column.value)(row));
        // printed above the progress line; a closed terminal is no reason to stop the run
        self.bar.suspend(|| {
            let _ = writeln!(table, "{text}").and_then(|()| table.flush());
        });
    }
}

impl Observer for IterationTable {
    fn row(&mut self, row: &Row) {
        let first = self.first.get_or_insert_with(|| row.clone());
        let remaining = self.tolerance.map(|tolerance| time_left(row, first, tolerance));
        self.bar.set_message(format!(
            "iteration {}, residual {}, until {}{}",
            row.iteration,
            sci(row.residual, 2),
            self.target,
            left(remaining)
        ));
        if is_shown(row.iteration) {
            self.print(row);
            self.waiting = None;
        } else {
            self.waiting = Some(row.clone());
        }
    }
}

impl Drop for IterationTable {
    fn drop(&mut self) {
        self.finish();
    }
}

/// Return the seconds until the residual reaches `tolerance`, if it falls at the mean rate since the `first` row. The result is
/// not finite if the residual does not fall.
fn time_left(row: &Row, first: &Row, tolerance: f64) -> f64 {
    (row.residual / tolerance).ln() / (first.residual / row.residual).ln().max(0.0) * (row.seconds - first.seconds)
}

/// Whether iteration `k` has a line of its own in a long run.
fn is_shown(k: usize) -> bool {
    k <= 20 || k <= 200 && k.is_multiple_of(10) || k.is_multiple_of(100)
}

struct Column {
    heading: &'static str,
    width: usize,
    /// Text for a row.
    value: fn(&Row) -> String,
}

impl Column {
    fn new(heading: &'static str, width: usize, value: fn(&Row) -> String) -> Self {
        Self { heading, width, value }
    }
}

/// Return the columns of a table that begins with the row `first`. Inner iterations have a column if there are any.
fn columns(first: &Row) -> Vec<Column> {
    // the column has closed points / all points
    let closed = (2 * first.points.to_string().len() + 1).max("closed".len());
    let columns = [
        Column::new("k", 5, |row| row.iteration.to_string()),
        Column::new("residual", 9, |row| sci(row.residual, 3)),
        Column::new("increment", 9, |row| sci(row.increment, 3)),
        Column::new("gamma", 6, |row| if row.gamma.is_nan() { "-".into() } else { format!("{:.4}", row.gamma) }),
        Column::new("F1", 13, |row| sci(row.energy, 6)),
        Column::new("closed", closed, |row| format!("{}/{}", row.closed, row.points)),
        Column::new("factored", 8, |row| row.factorizations.to_string()),
        Column::new("inner", 7, |row| row.inner_iterations.to_string()),
        Column::new("seconds", 7, |row| seconds(row.seconds)),
    ];
    columns.into_iter().filter(|column| column.heading != "inner" || first.inner_iterations > 0).collect()
}

/// Return a line of the table, with the texts of the columns aligned to the right.
fn line(columns: &[Column], text: impl Fn(&Column) -> String) -> String {
    columns.iter().map(|column| format!("{:>1$}", text(column), column.width)).collect::<Vec<_>>().join("  ")
}

/// Time between two drawings of a line.
const TICK: Duration = Duration::from_millis(200);

/// Phases that end sooner show no line.
const SHORT: Duration = Duration::from_secs(1);

/// The progress line of one phase of a run, which disappears when it is dropped.
pub struct ProgressLine(ProgressBar);

impl ProgressLine {
    /// Return a line with the name `what` of the phase and the elapsed time, shown after a second. If the duration in seconds
    /// has an `estimate`, the line shows the remaining time, too.
    pub fn new(what: &str, estimate: Option<f64>) -> Self {
        let what = what.to_owned();
        let text = move |state: &ProgressState, out: &mut dyn fmt::Write| {
            // a line that cannot be written is no reason to stop
            let _ = out.write_str(&text(&what, state.elapsed(), estimate));
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

/// Return the text of a progress line.
fn text(what: &str, elapsed: Duration, estimate: Option<f64>) -> String {
    if elapsed < SHORT {
        return String::new();
    }
    format!("{what}, {} s{}", elapsed.as_secs(), left(estimate.map(|total| total - elapsed.as_secs_f64())))
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

    impl Screen {
        fn lines(&self) -> Vec<String> {
            let bytes = self.0.borrow();
            String::from_utf8_lossy(&bytes).lines().map(String::from).collect()
        }
    }

    fn row(iteration: usize) -> Row {
        let first = iteration == 0;
        Row {
            iteration,
            residual: 0.5f64.powi(iteration as i32),
            increment: if first { f64::NAN } else { 0.25 },
            gamma: if first { f64::NAN } else { 0.6 },
            energy: -0.0123,
            closed: iteration,
            points: 128,
            factorizations: 2 * iteration,
            ..Row::default()
        }
    }

    fn run(iterations: usize, first_inner: usize) -> Vec<String> {
        let screen = Screen::default();
        let mut table = IterationTable::on(Some(Box::new(screen.clone())), ProgressBar::hidden(), "residual < 1e-8");
        for k in 0..=iterations {
            table.row(&Row { inner_iterations: first_inner * (k + 1), ..row(k) });
        }
        drop(table);
        screen.lines()
    }

    fn iterations(lines: &[String]) -> Vec<usize> {
        lines.iter().skip(1).map(|l| l.split_whitespace().next().unwrap().parse().unwrap()).collect()
    }

    #[test]
    fn the_time_left_is_that_of_the_mean_rate() {
        let row = |residual: f64, seconds: f64| Row { residual, seconds, ..Row::default() };
        let at = |residual: f64, seconds: f64| time_left(&row(residual, seconds), &row(1.0, 1.0), 1e-8);
        assert!((at(1e-2, 5.0) - 12.0).abs() < 1e-9, "two digits of eight in four seconds");
        assert!(!at(1.0, 5.0).is_finite() && !at(2.0, 5.0).is_finite());
    }

    #[test]
    fn long_runs_are_thinned_and_end_with_the_last_row() {
        let lines = run(437, 0);
        let mut expected: Vec<usize> = (0..=20).collect();
        expected.extend((30..=200).step_by(10));
        expected.extend([300, 400, 437]);
        assert_eq!(iterations(&lines), expected);
        assert_eq!(iterations(&run(30, 0)).last(), Some(&30));
        assert_eq!(iterations(&run(30, 0)).len(), 22);
    }

    #[test]
    fn a_line_begins_after_a_second_and_counts_down() {
        let at = |seconds: f64, estimate| text("factoring", Duration::from_secs_f64(seconds), estimate);
        assert_eq!(at(0.9, Some(50.0)), "");
        assert_eq!(at(2.3, None), "factoring, 2 s");
        assert_eq!(at(10.0, Some(50.0)), "factoring, 10 s, about 40s left");
        // an estimate that was too low is not repeated
        assert_eq!(at(60.0, Some(50.0)), "factoring, 60 s");
        assert_eq!([left(Some(f64::NAN)), left(Some(f64::INFINITY)), left(None)], [""; 3].map(str::to_owned));
    }
}
