//! Warnings of contacts that reach the end of a pair which the key `distance` has cut short.

use super::stages::Done;
use crate::contact::End;

/// Add the warnings of this result to those of the run. A pair has one warning, that of the first load step.
pub fn note(done: &mut Done) {
    if !done.outcome.status.is_solved() {
        return;
    }
    for i in 0..done.model().pairs.len() {
        let reached = reached(done, i);
        if reached == 0 {
            continue;
        }
        let spec = &done.built.discrete.contacts[i].spec;
        let [a, b] = spec.between.each_ref().map(|name| &name.value);
        let title = format!("{a} - {b}: the contact reaches places");
        if done.warnings.iter().any(|warning| warning.starts_with(&title)) {
            continue;
        }
        let distance = spec.distance.unwrap_or_default();
        let step = if done.steps.is_empty() { String::new() } else { format!(" in load step {}", done.steps.len()) };
        done.warnings.push(format!(
            "{title}{step} where the surfaces are farther apart than {distance} (key `distance`), and the pair ends: {reached} contact points \
             there are under pressure, and facets beyond them carry none; give a larger distance"
        ));
    }
}

/// Return the number of contact points under pressure from which the contact probably goes on beyond the end of pair `i`.
fn reached(done: &Done, i: usize) -> usize {
    let (layer, first) = (&done.outcome.layer, done.model().range(i).start);
    let goes_on = |end: &&End| {
        let q = first + end.point;
        layer.pressure[q] > 0.0 && layer.compression[q] >= end.compression
    };
    done.built.discrete.contacts[i].ends.iter().filter(goes_on).count()
}
