//! Warnings of layers that a run has compressed beyond the end of their law.

use super::measure::peak;
use super::stages::Done;
use super::verdict::is_solved;
use crate::output::sci;

/// Return a warning for each pair whose layer is compressed beyond the end of its law, at the solution or in a load step. There the
/// law is extrapolated by a straight line from the end of a table, or of an expression with `up_to`, without measured data.
pub fn warnings(done: &Done) -> Vec<String> {
    (0..done.model().pairs.len()).filter_map(|i| warning(done, i)).collect()
}

/// Return the warning for pair `i`, if its layer is beyond the end of its law.
fn warning(done: &Done, i: usize) -> Option<String> {
    let pair = &done.model().pairs[i];
    let end = (0..pair.len()).map(|q| pair.law.end(q)).fold(f64::INFINITY, f64::min);
    let Compressed { most, pressure, step } = most_compressed(done, i)?;
    let when = step.map_or(String::new(), |step| format!(" in load step {step}"));
    let [a, b] = done.built.discrete.contacts[i].spec.between.each_ref().map(|name| &name.value);
    (most > end).then(|| {
        format!(
            "{a} - {b}: the layer is compressed by {}{when}, under a pressure of {}, and its law ends at a compression of {}: beyond, the last \
             slope goes on; give the law further points, or lower the load",
            sci(most, 2),
            sci(pressure, 2),
            sci(end, 2)
        )
    })
}

/// The largest compression of the layer of a pair.
struct Compressed {
    most: f64,
    pressure: f64,
    /// Load step, counted from 1, if there are any.
    step: Option<usize>,
}

/// Return the largest compression of a pair over all solutions of a run, none if the run has found no solution.
fn most_compressed(done: &Done, i: usize) -> Option<Compressed> {
    if done.steps.is_empty() {
        let (layer, range) = (&done.outcome.layer, done.model().range(i));
        let pressure = layer.pressure[range.clone()].iter().copied().fold(0.0, f64::max);
        let found = Compressed { most: peak(&layer.compression[range]), pressure, step: None };
        return done.outcome.status.is_solved().then_some(found);
    }
    let solved = done.steps.iter().enumerate().filter(|(_, step)| is_solved(step));
    let compressed = solved.map(|(number, step)| {
        let pair = &step.pairs[i];
        Compressed { most: pair.peak_compression, pressure: pair.peak_pressure, step: Some(number + 1) }
    });
    compressed.max_by(|a, b| a.most.total_cmp(&b.most))
}
