//! Progress lines on standard error, if that is a terminal.

use indicatif::{HumanDuration, ProgressBar, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::time::Duration;

/// Time between two drawings of a line.
const TICK: Duration = Duration::from_millis(200);

/// Phases that end sooner show no line.
const SHORT: Duration = Duration::from_secs(1);

/// The progress line of one phase of a run, which disappears when it is dropped.
pub struct Line(ProgressBar);

impl Line {
    /// Return a line with the name `what` of the phase and the elapsed time, shown after a second. If the duration in seconds
    /// has an `estimate`, the line shows the remaining time, too.
    pub fn new(what: &str, estimate: Option<f64>) -> Self {
        let what = what.to_owned();
        let text = move |state: &ProgressState, out: &mut dyn Write| {
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

impl Drop for Line {
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
