//! Lines on standard error that say what goes on; nothing where that is no terminal.

use indicatif::{HumanDuration, ProgressBar, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::time::Duration;

/// How often a line is drawn.
const TICK: Duration = Duration::from_millis(200);

/// Phases that end sooner have no line.
const SHORT: Duration = Duration::from_secs(1);

/// A line for one phase of a run, which goes when it is dropped.
pub struct Line(ProgressBar);

impl Line {
    /// A line that says `what` is done and how long it has taken, from the second second on; with the seconds that it takes by an
    /// estimate those that are left.
    pub fn new(what: &str, estimate: Option<f64>) -> Self {
        let what = what.to_owned();
        let text = move |state: &ProgressState, out: &mut dyn Write| {
            // a line that cannot be written is not worth an end
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

impl Drop for Line {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

fn text(what: &str, elapsed: Duration, estimate: Option<f64>) -> String {
    if elapsed < SHORT {
        return String::new();
    }
    format!("{what}, {} s{}", elapsed.as_secs(), left(estimate.map(|all| all - elapsed.as_secs_f64())))
}

/// Seconds that are left, in words; nothing where they are not known or were too few.
pub fn left(seconds: Option<f64>) -> String {
    let known = seconds.and_then(|left| Duration::try_from_secs_f64(left.round()).ok()).filter(|left| !left.is_zero());
    known.map_or(String::new(), |left| format!(", about {:#} left", HumanDuration(left)))
}

/// A bar over many runs, with the time that is left; hidden if nothing is to be shown.
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
    // time goes on while a run is on its way
    bar.enable_steady_tick(TICK);
    bar
}

#[cfg(test)]
mod tests {
    use super::*;

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
