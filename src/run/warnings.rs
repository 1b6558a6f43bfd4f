//! The warnings of a run: on the problem and its mesh, on surfaces without a partner, on edges and facets, on the ends of layers and pairs, and on
//! estimates that are guesses.

use super::in_words;
use super::results::{coupling, peak};
use super::stages::{Built, Done};
use super::verdict::is_solved;
use crate::contact::{Chords, ContactPair, Left, LostPieces, UncoveredPoint};
use crate::discretize::{Balanced, ContactInfo, Discrete, point};
use crate::error::few;
use crate::estimate::{Cause, Estimate};
use crate::linalg::diagonal;
use crate::model::Mechanism;
use crate::output::sci;
use crate::petsc::{Schur, Session, has_metis};
use crate::problem::LayerSpec;
use std::collections::BTreeMap;

/// Return the warnings about a problem before it is solved.
pub fn of_problem(session: &Session, discrete: &Discrete, dimension: usize) -> Vec<String> {
    let mut warnings = Vec::new();
    if session.blas_name() == "reference BLAS" {
        warnings.push(
            "the reference BLAS is in use: factorisations are up to ten times slower; run scripts/setup for OpenBLAS"
                .to_owned(),
        );
    }
    if let Some(kernels) = session.faster_blas_kernels() {
        warnings.push(format!(
            "{} does not use the vector instructions of this processor: factorisations take up to three times as long; set \
             OPENBLAS_CORETYPE={kernels}",
            session.blas_name()
        ));
    }
    if discrete.bodies.iter().any(|body| Schur::is_large(dimension, body.dofs)) && !has_metis() {
        warnings.push(
            "METIS was not found: large bodies are factored in the order of minimum degree, with a fifth more memory or more; \
             `apt-get install libmetis5`, or a PETSc with METIS"
                .to_owned(),
        );
    }
    warnings.extend(session.left_out().iter().map(|file| {
        format!(
            "{file} of this folder is not read, since PETSc options can run programs; -options_file {file} reads it"
        )
    }));
    if session.size() > discrete.bodies.len() && !discrete.model.is_distributed() {
        warnings.push(format!(
            "{} of {} ranks have no body to solve",
            session.size() - discrete.bodies.len(),
            session.size()
        ));
    }
    for body in discrete.bodies.iter().filter(|body| !body.removed_modes.fixed.is_empty()) {
        let motions = body.removed_modes.fixed.join("; ");
        warnings.push(format!(
            "body {}: nothing holds its {motions}, and no load works on it: it is fixed at one node",
            body.name
        ));
    }
    for body in discrete.bodies.iter().filter(|body| !body.removed_modes.spinning.is_empty()) {
        let motions = body.removed_modes.spinning.join("; ");
        warnings.push(format!(
            "body {}: only the facets of the mesh resist its {motions}, and loads work on it: its displacements mean nothing; hold it, or load it through its centre",
            body.name
        ));
    }
    warnings.extend(discrete.balanced.iter().map(|balanced| balanced_in_words(discrete, balanced)));
    warnings.extend(discrete.mechanisms.iter().map(|mechanism| mechanism_in_words(discrete, mechanism)));
    warnings.extend(discrete.bodies.iter().filter_map(|body| body.warning.clone()));
    warnings.extend(discrete.model.pairs.iter().filter_map(|pair| resisted_by_normals(discrete, pair)));
    warnings.extend(of_surfaces(&discrete.model.pairs, &discrete.contacts));
    warnings
}

/// Return the warning of a pair whose second body can move along its own surface, while the normals are those of the first one, which resist that.
fn resisted_by_normals(discrete: &Discrete, pair: &ContactPair) -> Option<String> {
    let [a, b] = pair.bodies.map(|body| &discrete.bodies[body]);
    let way = if a.removed_modes.slides {
        "hold the motion by a support or a weak spring"
    } else {
        "make the facets there as fine as those of the other body, or take order = 2"
    };
    b.removed_modes.slides.then(|| {
        format!(
            "body {}: it can turn or slide along its surface, and the normals of `{}` resist that: pressures depend on the node at which it is fixed; {way}",
            b.name, pair.surfaces[0]
        )
    })
}

/// Return the warning of elements that were split, if any.
pub fn in_parts(split: usize) -> Option<String> {
    let what = "quadrangles, hexahedra, prisms or pyramids of the mesh were split into triangles or tetrahedra";
    (split > 0).then(|| format!("{split} {what}"))
}

/// Return the warning of quadratic cells that were made straight, if any.
pub fn made_straight(cells: usize) -> Option<String> {
    let why = "were folded by the curved boundary and have straight edges now, so that gaps there are those of chords: a finer mesh follows the boundary";
    (cells > 0).then(|| format!("{cells} quadratic cells {why}"))
}

/// Return the warning of loads that were balanced.
fn balanced_in_words(discrete: &Discrete, Balanced { bodies, motion, share }: &Balanced) -> String {
    let names = in_words(bodies.iter().map(|&body| &discrete.bodies[body].name));
    format!(
        "{} {names}: nothing holds {} in {motion}, and loads lack balance there by {} of what forces of their sizes could do: no more than facets \
         and quadrature may miss of them, so that the loads were changed by that share to balance",
        if bodies.len() == 1 { "body" } else { "bodies" },
        if bodies.len() == 1 { "it" } else { "them" },
        sci(*share, 1)
    )
}

/// Return the warning of a free motion of several bodies.
fn mechanism_in_words(discrete: &Discrete, mechanism: &Mechanism) -> String {
    let name = |&body: &usize| &discrete.bodies[body].name;
    let bodies = in_words(mechanism.bodies.iter().map(name));
    let end = match mechanism.fixed.as_ref().map(name) {
        Some(body) => format!("and no load works on it: they are fixed at nodes of `{body}`"),
        None if mechanism.work == 0.0 => "and no load works on it: displacements are free up to it".to_owned(),
        None => "and loads work on it: there is no solution".to_owned(),
    };
    format!("bodies {bodies}: nothing holds them together in their {}, {end}", mechanism.motion)
}

/// Least change of the pressures with the side of the normals that is worth a warning: one per cent.
const ONE_SIDED: f64 = 0.01;

/// Return warnings of pressures whose estimated error is a guess, or that depend on the side that gives the normals by more than that error.
pub fn of_pressures(discrete: &Discrete, estimate: &Estimate) -> Vec<String> {
    let mut warnings = Vec::new();
    for (i, pair) in discrete.model.pairs.iter().enumerate() {
        let [a, b] = &pair.surfaces;
        if let Some(guess) = estimate.guesses[i] {
            let place = point(guess.place);
            let reason = match guess.cause {
                Cause::Rim => {
                    format!("most of it is at the edge of the contact, at {place}, where pressures may be singular")
                }
                Cause::FewFacets => {
                    format!(
                        "contact ends within the facets that carry most of the pressure, around {place}: make them smaller"
                    )
                }
            };
            warnings.push(format!("the estimated error of the pressures between `{a}` and `{b}` is a guess: {reason}"));
        }
        let change = estimate.sides[i];
        // a body that moves along its own surface stands at any place of this motion, which the normals of the other body would resist
        let is_free = discrete.bodies[pair.bodies[0]].removed_modes.slides;
        if !is_free && change > estimate.pressure[i].max(ONE_SIDED) {
            warnings.push(format!(
                "the pressures between `{a}` and `{b}` would change by about {:.0} % with the normals of `{b}` instead of those of `{a}`, more \
                 than by their estimated error: the surfaces slide or tilt too far for small displacements",
                100.0 * change
            ));
        }
    }
    warnings
}

/// Return the names of the surfaces of a pair, in the order of the scene.
fn names(contact: &ContactInfo) -> [&str; 2] {
    contact.spec.between.each_ref().map(|name| name.value.as_str())
}

/// Return the warnings of the surfaces of all pairs.
fn of_surfaces(pairs: &[ContactPair], contacts: &[ContactInfo]) -> Vec<String> {
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
    let [a, b] = names(contact);
    let (all, count) = (pair.cover.len() + contact.idle, without.len() + contact.idle);
    let mut text = format!("{a} - {b}: {count} of {all} facets have no partner");
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
    for contact in contacts.iter().filter(|contact| contact.is_split) {
        let ([a, b], spec) = (names(contact), &contact.spec);
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
         facets; take order = 2 or a finer mesh; if the true surfaces have no clearance, write touching = true, with their own overlap as a \
         negative `gap`",
        pair.surfaces[0],
        pair.surfaces[1],
        sci(sagitta, 2),
        sci(deepest, 2)
    )
}

/// Return the warning of pieces of a pair that the search for common points has lost, if any.
fn lost(pair: &ContactPair, contact: &ContactInfo) -> Option<String> {
    let [a, b] = names(contact);
    pair.lost.map(|LostPieces { pieces, share, at: [x, y, z] }| {
        format!(
            "{a} - {b}: the search for points has lost {pieces} pieces of `{}`, {:.1e} of its {}, the most near ({x}, {y}, {z}): they \
             carry no pressure; look at the mesh there, and refine what is strongly curved",
            pair.surfaces[0], share, pair.measure
        )
    })
}

/// Return the warning for pair `i`, if its layer is a table that makes sense as (p, c) alone.
///
/// Numbers have no units here, so that two facts of the bodies decide. The stiffness of the layer, p/c at the end of the table, is compared
/// with that of the stiffer body against a uniform pressure, its modulus over its depth: c/p is nearer to it than p/c. And the table does not
/// fit: its largest pressure is below the mean pressure of the loads, or without loads its largest compression exceeds the contact surface.
/// A layer that is really as soft as that has a table which reaches to its loads.
pub fn swapped_table(built: &Built, i: usize) -> Option<String> {
    let (pair, contact) = (&built.discrete.model.pairs[i], &built.discrete.contacts[i]);
    let LayerSpec::Table(points) = &contact.spec.layer else { return None };
    let &[c, p] = points.last()?;
    let stiffness = pair.bodies.map(|body| built.discrete.bodies[body].stiffness).into_iter().fold(0.0, f64::max);
    let distance = |other: f64| (other / stiffness).ln().abs();
    let load = coupling(built, i).pressure;
    let fits = if load > 0.0 { load <= p } else { c <= diagonal(&pair.position) };
    if stiffness == 0.0 || fits || distance(c / p) >= distance(p / c) {
        return None;
    }
    let [a, b] = &pair.surfaces;
    let loads =
        if load > 0.0 { format!(", and the loads give a mean pressure of {}", sci(load, 2)) } else { String::new() };
    Some(format!(
        "{a} - {b}: the table of the layer ends at a compression of {} with a pressure of {}: its stiffness is {}, that of the bodies (modulus \
         over depth) {}{loads}; points are [compression, pressure]: if these are [pressure, compression], swap the columns",
        sci(c, 2),
        sci(p, 2),
        sci(p / c, 2),
        sci(stiffness, 2)
    ))
}

/// Return the warning for pair `i`, if its layer is compressed beyond the end of its law, at the solution or in a load step. There the
/// law is extrapolated by a straight line from the end of a table, or of an expression with `up_to`, without measured data.
pub fn beyond_law(done: &Done, i: usize) -> Option<String> {
    let pair = &done.model().pairs[i];
    let end = (0..pair.len()).map(|q| pair.law.end(q)).fold(f64::INFINITY, f64::min);
    let Compressed { most, pressure, step } = most_compressed(done, i)?;
    let when = step.map_or(String::new(), |step| format!(" in load step {step}"));
    let [a, b] = names(&done.built.discrete.contacts[i]);
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

/// Return the warning that no pair carries a pressure, at the solution or in a load step. Then contact has no part in the results.
pub fn nothing_touches(done: &Done) -> Option<String> {
    let pairs = 0..done.model().pairs.len();
    let compressed: Option<Vec<Compressed>> = pairs.map(|i| most_compressed(done, i)).collect();
    let compressed = compressed.filter(|all| all.iter().all(|found| found.pressure <= 0.0))?;
    let nearest = (0..compressed.len()).max_by(|&i, &j| compressed[i].most.total_cmp(&compressed[j].most))?;
    let ([a, b], gap) = (names(&done.built.discrete.contacts[nearest]), -compressed[nearest].most);
    (gap > 0.0).then(|| format!(
        "nothing touches: no contact carries a pressure, and `{a}` and `{b}` come nearest, with a gap of {}; look at the loads, the supports and the gaps",
        sci(gap, 3)
    ))
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

/// Add the warnings of contacts that reach the end of a pair, which the key `distance` has cut short. A pair has one warning, that of the first load step.
pub fn note_ends(done: &mut Done) {
    if !done.outcome.status.is_solved() {
        return;
    }
    for i in 0..done.model().pairs.len() {
        let reached = reached(done, i);
        if reached == 0 {
            continue;
        }
        let contact = &done.built.discrete.contacts[i];
        let [a, b] = names(contact);
        let title = format!("{a} - {b}: the contact reaches places");
        if done.warnings.iter().any(|warning| warning.starts_with(&title)) {
            continue;
        }
        let distance = contact.spec.distance.unwrap_or_default();
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
    let goes_on = |end: &&UncoveredPoint| {
        let q = first + end.point;
        layer.pressure[q] > 0.0 && layer.compression[q] >= end.compression
    };
    done.built.discrete.contacts[i].ends.iter().filter(goes_on).count()
}
