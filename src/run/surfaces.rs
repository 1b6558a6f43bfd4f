//! Warnings of pairs of surfaces: what has no partner, and how edges and facets of the meshes matter.

use crate::contact::{Chords, ContactPair, Left, LostPieces};
use crate::discretize::ContactInfo;
use crate::error::few;
use crate::output::sci;
use std::collections::BTreeMap;

/// Return the warnings of all pairs.
pub fn warnings(pairs: &[ContactPair], contacts: &[ContactInfo]) -> Vec<String> {
    let mut warnings = split_pairs(contacts);
    for (pair, contact) in pairs.iter().zip(contacts) {
        warnings.extend(left_out(pair, contact));
        warnings.extend(lost(pair, contact));
        let overlap = pair.gap.iter().copied().fold(0.0, f64::min);
        if overlap < 0.0 {
            warnings.push(format!(
                "{} - {}: the bodies overlap by {:.3e} before loading; the layer takes it as compression",
                pair.surfaces[0], pair.surfaces[1], -overlap
            ));
        }
        warnings.extend(contact.chords.map(|chords| overlap_of_facets(pair, chords)));
    }
    warnings
}

/// Return the warning of facets that a pair excludes, if any.
fn left_out(pair: &ContactPair, contact: &ContactInfo) -> Option<String> {
    let without: Vec<Left> =
        pair.cover.iter().filter(|cover| cover.carriers.is_none()).map(|cover| cover.left).collect();
    if without.is_empty() && contact.idle == 0 {
        return None;
    }
    let names = contact.spec.between.each_ref().map(|name| &name.value);
    let (all, count) = (pair.cover.len() + contact.idle, without.len() + contact.idle);
    let mut text = format!("{} - {}: {count} of {all} facets have no partner", names[0], names[1]);
    if contact.idle > 0 {
        text += &format!("; {} of them lie beyond edges (key `edge`)", contact.idle);
    }
    let steep = format!("stand at more than {} degrees to the other side (key `angle`)", contact.spec.angle);
    let far = match contact.spec.distance {
        Some(distance) => format!("are farther away from it than {distance} (key `distance`)"),
        None => "are too far away from it".to_owned(),
    };
    for (reason, why) in [(Left::Steep, steep), (Left::Far, far)] {
        let count = without.iter().filter(|&&left| left == reason).count();
        if count > 0 {
            text += &format!("; {count} of `{}` {why}", pair.surfaces[0]);
        }
    }
    Some(text)
}

/// Return a line for each contact of the scene that is several pairs, since its surfaces have edges.
fn split_pairs(contacts: &[ContactInfo]) -> Vec<String> {
    let mut names_of: BTreeMap<usize, (f64, Vec<String>)> = BTreeMap::new();
    for ContactInfo { spec, .. } in contacts.iter().filter(|contact| contact.is_split) {
        let [a, b] = spec.between.each_ref().map(|name| &name.value);
        names_of.entry(spec.table).or_insert((spec.edge, Vec::new())).1.push(format!("{a} - {b}"));
    }
    let line = |(table, (edge, names)): (usize, (f64, Vec<String>))| {
        let names = few(names).join(", ");
        format!(
            "contact.{table}: surfaces have edges of more than {edge} degrees (key `edge`), and faces are pairs of their own: {names}"
        )
    };
    names_of.into_iter().map(line).collect()
}

/// Return the warning of an overlap that facets make.
fn overlap_of_facets(pair: &ContactPair, Chords { sagitta, deepest, mean }: Chords) -> String {
    let mean = mean.map_or(String::new(), |mean| format!(" and {} on the mean", sci(mean, 2)));
    format!(
        "{} - {}: straight facets leave their curved surfaces by up to {}, and the overlap is {} at most{mean}: pressures are those of \
         facets; write touching = true with the overlap as a negative `gap`, take order = 2, or a finer mesh",
        pair.surfaces[0],
        pair.surfaces[1],
        sci(sagitta, 2),
        sci(deepest, 2)
    )
}

/// Return the warning of pieces of a pair that the search for common points has lost, if any.
fn lost(pair: &ContactPair, contact: &ContactInfo) -> Option<String> {
    let names = contact.spec.between.each_ref().map(|name| &name.value);
    pair.lost.map(|LostPieces { pieces, share, at: [x, y, z] }| {
        format!(
            "{} - {}: the search for points has lost {pieces} pieces of `{}`, {:.1e} of its {}, the most near ({x}, {y}, {z}): they \
             carry no pressure; look at the mesh there, and refine what is strongly curved",
            names[0], names[1], pair.surfaces[0], share, pair.measure
        )
    })
}
