//! The warnings of a run: on the problem and its mesh, on surfaces without a partner, on edges and facets, on the ends
//! of layers and pairs, and on estimates that are guesses.

use super::in_words;
use super::results;
use super::stages::Done;
use super::verdict::without_shear;
use crate::contact::{Chords, Coverage, Measure};
use crate::discretize::Discrete;
use crate::estimate::{Cause, Estimate, softness};
use crate::fem::{length, minus};
use crate::linalg;
use crate::model::Mechanism;
use crate::output::closing::{DIGITS, place, readable};
use crate::output::{BalanceReport, PairResult, sci};
use crate::petsc::Session;
use crate::problem::ContactSpec;
use crate::scene::Scene;
use std::f64::consts::PI;

/// Return the warnings about a problem before it is solved.
pub fn of_problem(session: &Session, discrete: &Discrete) -> Vec<String> {
    let mut warnings = Vec::new();
    if session.blas_name() == "reference BLAS" {
        warnings.push(
            "the reference BLAS is in use: factorisations are up to ten times slower; run scripts/setup for OpenBLAS"
                .to_owned(),
        );
    }
    if session.size() > discrete.bodies.len() && !discrete.model.is_distributed() {
        warnings.push(format!(
            "{} of {} ranks have no body to solve",
            session.size() - discrete.bodies.len(),
            session.size()
        ));
    }
    warnings.extend(of_mechanisms(discrete));
    warnings.extend(discrete.bodies.iter().filter_map(|body| body.warning.clone()));
    warnings.extend(of_surfaces(discrete));
    warnings
}

/// Return the warning of layers whose memory nothing uses, if any.
pub fn without_history(scene: &Scene) -> Option<String> {
    let remembers = scene.contacts.iter().any(|contact| contact.unload.is_some());
    let is_single = scene.method.steps.is_empty();
    (remembers && is_single).then(|| {
        "`unload` without load steps: nothing takes load off a layer in one step; give method.steps".to_owned()
    })
}

/// Young's modulus of diamond along its stiffest direction, in pascals: 3/(1/(C11 + 2 C12) + 1/C44) with C11, C12 and
/// C44 of 1079, 124 and 578 GPa (McSkimin and Andreatch, 1972). No solid is stiffer.
const DIAMOND: f64 = 1.2e12;

/// Return the warning of bodies that are stiffer than any solid in the unit of stresses that the scene names, if any:
/// most often their modulus is in pascals, and the loads are not.
pub fn stiffer_than_diamond(scene: &Scene) -> Option<String> {
    let units = scene.units.as_ref()?;
    let (_, pascals) = [("Pa", 1.0), ("kPa", 1e3), ("MPa", 1e6), ("N/mm²", 1e6), ("N/mm^2", 1e6), ("GPa", 1e9)]
        .into_iter()
        .find(|(name, _)| *name == units.stress)?;
    let body =
        scene.bodies.iter().find(|body| body.young.as_ref().is_some_and(|young| young.number() * pascals > DIAMOND))?;
    let young = body.young.as_ref()?.number();
    Some(format!(
        "young = {} of `{}` is more than diamond has, {} {}: is it in the units of the scene?",
        sci(young, 1),
        body.name.value,
        sci(DIAMOND / pascals, 1),
        units.stress
    ))
}

/// Return the warning of elements that were split, if any.
pub fn in_parts(split: usize) -> Option<String> {
    let what = "quadrangles, hexahedra, prisms or pyramids of the mesh were split into triangles or tetrahedra";
    (split > 0).then(|| format!("{split} {what}"))
}

/// Return the warning of curved cells that were made straight, if any.
pub fn made_straight(cells: usize) -> Option<String> {
    let why = "were folded by the curved boundary and have straight edges now, so that gaps there are those of chords: a finer mesh follows the boundary";
    (cells > 0).then(|| format!("{cells} curved cells {why}"))
}

/// Return the warnings of motions that nothing resists: one for all bodies that have the same one, each for itself.
fn of_mechanisms(discrete: &Discrete) -> Vec<String> {
    let mut found: Vec<(Mechanism, Vec<usize>)> = Vec::new();
    for mechanism in &discrete.mechanisms {
        let (mut kind, bodies) = (mechanism.clone(), mechanism.bodies.clone());
        if let [body] = bodies[..] {
            kind.bodies.clear();
            if let Some((other, alike)) = found.iter_mut().find(|(other, _)| is_alike(other, &kind)) {
                other.balanced = other.balanced.max(kind.balanced);
                alike.push(body);
                continue;
            }
        }
        found.push((kind, bodies));
    }
    found.iter().map(|(mechanism, bodies)| mechanism_in_words(discrete, mechanism, bodies)).collect()
}

/// Return whether two motions of one body each have the same words, but for how much balance their loads lack.
fn is_alike(a: &Mechanism, b: &Mechanism) -> bool {
    let words = |m: &Mechanism| (m.bodies.is_empty(), m.work != 0.0, m.balanced > 0.0, m.fixed.is_some());
    a.motion == b.motion && words(a) == words(b)
}

/// Return the warning of a motion that nothing resists. It is one of these bodies together if it names them, and one
/// that each of them has if not.
fn mechanism_in_words(discrete: &Discrete, mechanism: &Mechanism, bodies: &[usize]) -> String {
    let Mechanism { motion, work, balanced, fixed, .. } = mechanism;
    let name = |body: usize| &discrete.bodies[body].name;
    let names = || in_words(bodies.iter().map(|&body| name(body)));
    let (who, whose) = match bodies {
        [body] => (format!("body {}", name(*body)), "its"),
        _ if mechanism.bodies.is_empty() => (format!("bodies {}", names()), "each of them in its"),
        _ => (format!("bodies {}", names()), "them together in their"),
    };
    let loads = match *work {
        0.0 if *balanced > 0.0 => format!(
            "the loads lack balance there by {}{} of what forces of their sizes could do: they were changed by that share to balance",
            if bodies.len() > 1 && mechanism.bodies.is_empty() { "up to " } else { "" },
            sci(*balanced, 1)
        ),
        0.0 => "no load works on it".to_owned(),
        _ => "loads work on it".to_owned(),
    };
    let end = match fixed {
        Some(_) if bodies.len() == 1 => "it is fixed at one node".to_owned(),
        Some(_) if mechanism.bodies.is_empty() => "each is fixed at one node".to_owned(),
        Some(body) => format!("they are fixed at nodes of `{}`", name(*body)),
        None if *work == 0.0 => "displacements are free up to it".to_owned(),
        None => format!("there is no solution{}", without_shear(bodies, &discrete.model)),
    };
    let then = if *balanced > 0.0 { ";" } else { ":" };
    format!("{who}: nothing holds {whose} {motion}, and {loads}{then} {end}")
}

/// Return the warning of the force that a node carries at which a body is fixed, if it is more than the relative error
/// of the result.
pub fn of_fixed(name: &str, balance: &BalanceReport, error: f64) -> Option<String> {
    let others = balance.supports.iter().chain(&balance.springs).chain(&balance.rigid);
    let all = [&balance.loads, &balance.contacts].into_iter().chain(others);
    let [x, y, z] = [0, 1, 2].map(|c| readable(-all.clone().map(|part| part.force[c]).sum::<f64>(), 6));
    (balance.force_imbalance > error.max(DIGITS)).then(|| {
        format!(
            "body {name}: the nodes at which it is fixed carry a force of ({x}, {y}, {z}), {} of all forces on it: a support or a weak spring \
             should carry it",
            sci(balance.force_imbalance, 1)
        )
    })
}

/// Return warnings of pressures whose estimated error is a guess.
pub fn of_pressures(discrete: &Discrete, estimate: &Estimate) -> Vec<String> {
    let mut warnings = Vec::new();
    for i in 0..discrete.model.pairs.len() {
        let [a, b] = discrete.surfaces(i);
        if let Some(guess) = estimate.guesses[i] {
            let place = place(guess.place);
            let reason = match guess.cause {
                Cause::Rim => {
                    format!(
                        "most of it is at {place}, at an edge of the contact or where a material or the layer jumps, where pressures may be singular"
                    )
                }
                Cause::FewFacets => {
                    format!(
                        "contact ends within the facets that carry most of the pressure, around {place}: make them smaller"
                    )
                }
            };
            warnings.push(format!("the estimated error of the pressures between `{a}` and `{b}` is a guess: {reason}"));
        }
    }
    warnings
}

/// Return the names of the surfaces of a pair, in the order of the scene.
fn names(spec: &ContactSpec) -> [&str; 2] {
    spec.between.each_ref().map(|name| name.value.as_str())
}

/// Return the warnings of the surfaces of all pairs.
fn of_surfaces(discrete: &Discrete) -> Vec<String> {
    let mut warnings = Vec::new();
    let all = discrete.model.pairs.iter().zip(&discrete.specs).enumerate();
    // the shear of a bond has the surfaces of the bond
    for (i, (pair, spec)) in all.filter(|(_, (_, spec))| spec.slip.is_none()) {
        warnings.extend(lost(discrete, i));
        // who types a negative gap, as for a fit, knows that bodies overlap there; that of an obstacle says how far it
        // reaches into the body
        let drawn = pair.gap.iter().zip(&pair.position).filter(|(_, x)| spec.gap.eval(**x) >= 0.0);
        let overlap = drawn.map(|(gap, _)| *gap).fold(0.0, f64::min);
        if overlap < 0.0 && !spec.obstacle {
            let [a, b] = names(spec);
            warnings.push(format!(
                "{a} - {b}: the bodies overlap by {:.3e} before loading; the layer takes it as compression",
                -overlap
            ));
        }
    }
    warnings
}

/// Return the warning of facets that `angle` or `distance` leaves without a partner, and at which the contact of pair
/// `i` ends under pressure. Where a surface turns away from the other one without pressure, or goes on beyond it, such
/// facets are usual, and `check` counts them.
pub fn cut_short(done: &Done, i: usize) -> Option<String> {
    let (pair, spec) = (&done.model().pairs[i], &done.built.discrete.specs[i]);
    if spec.slip.is_some() {
        return None;
    }
    let pressure = &done.outcome.layer.pressure[done.model().range(i)];
    let [a, b] = names(spec);
    let distance = spec.distance.map_or(String::new(), |distance| format!(" and `distance` = {distance}"));
    done.built.discrete.contacts[i].surface.beside_cut_short(&pair.cover).any(|q| pressure[q] != 0.0).then(|| {
        format!(
            "{a} - {b}: {} of {} facets of `{}` have no partner within `angle` = {}{distance}, and there is pressure beside them",
            pair.uncovered(),
            pair.cover.len(),
            pair.surfaces[0],
            spec.angle
        )
    })
}

/// Least change of the pressures by the height of curved surfaces above straight facets that is worth a warning. The
/// height is that of parabolas and the bodies yield to it about as much as to the pressures, so that the change itself
/// is known to a half of it.
const BY_CHORDS: f64 = 0.1;

/// Return the warning for pair `i`, if its pressures would be others on the curved surfaces whose chords its facets
/// are.
///
/// The heights h of the surfaces above their facets close the gap, be it drawn as a clearance, as an overlap or as
/// nothing. A point with the compression c and the pressure p then has the pressure where the law meets the line
/// c + h + s p, with the compliance s of the bodies to a wave as long as the contact, or as a facet of elements of
/// order two or more. A contact of Hertz with n facets in its radius changes by about 1/(4 n^2).
pub fn by_chords(done: &Done, i: usize) -> Option<String> {
    let (pair, layer, range) = (&done.model().pairs[i], &done.outcome.layer, done.model().range(i));
    let Chords { sagitta, height, wave } =
        done.built.discrete.contacts[i].chords.as_ref().filter(|_| done.outcome.status.is_solved())?;
    let (compression, pressure) = (&layer.compression[range.clone()], &layer.pressure[range]);
    let closed: f64 = (0..pair.len()).filter(|&q| pressure[q] > 0.0).map(|q| pair.area[q]).sum();
    let extent = if pair.measure == Measure::Length { closed } else { closed.sqrt() };
    let give = softness(done.model(), i) * if *wave > 0.0 { *wave } else { extent } / PI;
    let (mut changed, mut whole) = (0.0, 0.0);
    for q in 0..pair.len() {
        let state = compression[q] + height[q] + give * pressure[q];
        let curved = if give > 0.0 { pair.law.resolvent(q, state, 1.0 / give) } else { state };
        changed += pair.area[q] * (pair.law.pressure(q, curved) - pressure[q]).powi(2);
        whole += pair.area[q] * pressure[q].powi(2);
    }
    if changed <= BY_CHORDS.powi(2) * whole {
        return None;
    }
    let [least, most] = linalg::range(pair.gap.iter().copied());
    let drawn = if least < 0.0 {
        format!("the overlap is {} at most", sci(-least, 2))
    } else {
        format!("the gap is {} to {}", sci(least, 2), sci(most, 2))
    };
    let change = if whole > 0.0 {
        format!("would change by about {:.0} % on these", 100.0 * f64::sqrt(changed / whole))
    } else {
        "would not vanish on these".to_owned()
    };
    let [a, b] = names(&done.built.discrete.specs[i]);
    Some(format!(
        "{a} - {b}: straight facets leave their curved surfaces by up to {}, and {drawn}: pressures are those of facets, and {change}; take order = 2 \
         on a mesh of that order, or a finer mesh; if the true surfaces have one distance everywhere, write touching = true, with that distance as `gap` (negative for an overlap)",
        sci(*sagitta, 2),
    ))
}

/// Return the warning of pieces of pair `i` that the search for common points has lost, if any, with the uncovered part
/// of the facets that lost them and the middle of the facet with the largest one.
fn lost(discrete: &Discrete, i: usize) -> Option<String> {
    let (pair, surface) = (&discrete.model.pairs[i], &discrete.contacts[i].surface);
    let uncovered = |cover: &Coverage| if cover.lost > 0 { (1.0 - cover.share) * cover.measure } else { 0.0 };
    let of_facets = || pair.cover.iter().map(uncovered);
    let (worst, _) = of_facets().enumerate().max_by(|p, q| p.1.total_cmp(&q.1)).filter(|_| pair.pieces_lost() > 0)?;
    let [a, b] = names(&discrete.specs[i]);
    Some(format!(
        "{a} - {b}: the search for points has lost {} pieces of `{}`, {:.1e} of its {}, the most near {}: they \
         carry no pressure; look at the mesh there, and refine what is strongly curved",
        pair.pieces_lost(),
        pair.surfaces[0],
        of_facets().sum::<f64>() / pair.cover.iter().map(|cover| cover.measure).sum::<f64>(),
        pair.measure.name(),
        place(surface.middle(worst))
    ))
}

/// Return the warnings for pair `i`, if its layer is compressed or stretched beyond the end of its law, at the solution
/// or in a load step. There the law is extrapolated by a straight line from the end of a table, or of an expression
/// with `up_to`, without measured data.
pub fn beyond_law(done: &Done, i: usize) -> Vec<String> {
    let pair = &done.model().pairs[i];
    let least = |end: &dyn Fn(usize) -> f64| (0..pair.len()).map(end).fold(f64::INFINITY, f64::min);
    let [a, b] = names(&done.built.discrete.specs[i]);
    let ends = [
        (most_compressed(done, i), least(&|q| pair.law.end(q)), ["compressed", "pressure", "compression"]),
        (most_stretched(done, i), least(&|q| pair.law.end_in_tension(q)), ["stretched", "tension", "stretch"]),
    ];
    let mut warnings = Vec::new();
    for (found, end, [moved, stress, motion]) in ends {
        let Some(Largest { most, pressure, step }) = found.filter(|found| found.most > end) else { continue };
        let when = step.map_or(String::new(), |step| format!(" in load step {step}"));
        warnings.push(format!(
            "{a} - {b}: the layer is {moved} by {}{when}, under a {stress} of {}, and its law ends at a {motion} of {}: beyond, the last \
             slope goes on; give the law further points, or lower the load",
            sci(most, 2),
            sci(pressure, 2),
            sci(end, 2)
        ));
    }
    warnings
}

/// Change of the force along the normal, as a share, from which it is worth a warning that the normals of both sides
/// differ. A normal that is inclined by the angle t changes the force by t^2/2: one per cent belongs to 8 degrees.
const TILTED: f64 = 0.01;

/// Return the warning for pair `i`, if the normals of its sides differ under pressure by more than small displacements
/// allow.
pub fn tilted(done: &Done, i: usize) -> Option<String> {
    let (pair, pressure) = (&done.model().pairs[i], &done.outcome.layer.pressure[done.model().range(i)]);
    let force = |q: usize| pair.area[q] * pressure[q];
    let all: f64 = (0..pair.len()).map(force).sum();
    let mean = |of: &dyn Fn(f64) -> f64| (0..pair.len()).map(|q| force(q) * of(pair.tilt[q])).sum::<f64>() / all;
    let along = mean(&|tilt| 0.5 * tilt * tilt);
    let [a, b] = names(&done.built.discrete.specs[i]);
    (done.outcome.status.is_solved() && all > 0.0 && along > TILTED).then(|| {
        format!(
            "{a} - {b}: the normals of both sides differ under pressure by {:.0} degrees on the mean: the contact force depends by {:.0} % on which of \
             them counts, and forces along the surfaces by {:.0} % of it, since displacements are taken to be small",
            (2.0 * along).sqrt().to_degrees(),
            100.0 * along,
            100.0 * mean(&|tilt| tilt)
        )
    })
}

/// Return the warning for pair `i`, if the gap of an obstacle is steep under pressure. The obstacle's true normal is
/// inclined to that of the surface by the slope s of the gap, and its force s p along the surface is neglected. The
/// limit is that of [`TILTED`].
pub fn steep_gap(done: &Done, i: usize) -> Option<String> {
    let (discrete, pair) = (&done.built.discrete, &done.model().pairs[i]);
    let pressure = &done.outcome.layer.pressure[done.model().range(i)];
    let pressed = discrete.contacts[i].surface.neighbours().iter().map(|beside| beside.points);
    let pressed = pressed.filter(|points| points.iter().all(|&q| pressure[q] > 0.0));
    let slope = |[q, r]: [usize; 2]| {
        ((pair.gap[q] - pair.gap[r]) / length(minus(pair.position[q], pair.position[r])), pair.position[q])
    };
    let (slope, at) = pressed.map(slope).max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))?;
    let is_steep = discrete.specs[i].obstacle && 0.5 * slope * slope > TILTED;
    (is_steep && done.outcome.status.is_solved()).then(|| {
        format!(
            "{}: the gap to the obstacle has a slope of {:.2} under pressure at {}: the obstacle's force along the surface, that share of the pressure, \
             is neglected; let the obstacle be a body",
            names(&discrete.specs[i])[0],
            slope.abs(),
            place(at)
        )
    })
}

/// Return the warning that no pair carries a pressure, at the solution or in a load step. Then contact has no part in
/// the results.
pub fn nothing_touches(done: &Done) -> Option<String> {
    let pairs = 0..done.model().pairs.len();
    if pairs.clone().any(|i| done.model().pairs[i].law.is_bonded()) {
        return None;
    }
    let compressed: Option<Vec<Largest>> = pairs.map(|i| most_compressed(done, i)).collect();
    let compressed = compressed.filter(|all| all.iter().all(|found| found.pressure <= 0.0))?;
    let nearest = (0..compressed.len()).max_by(|&i, &j| compressed[i].most.total_cmp(&compressed[j].most))?;
    let ([a, b], gap) = (names(&done.built.discrete.specs[nearest]), -compressed[nearest].most);
    (gap > 0.0).then(|| format!(
        "nothing touches: no contact carries a pressure, and `{a}` and `{b}` come nearest, with a gap of {}; look at the loads, the supports and the gaps",
        sci(gap, 3)
    ))
}

/// The largest compression of the layer of a pair, or the largest stretch, with the pressure or the tension there.
struct Largest {
    most: f64,
    pressure: f64,
    /// Load step, counted from 1, if there are any.
    step: Option<usize>,
}

/// Return the largest compression of a pair over all solutions of a run, none if the run has found no solution.
fn most_compressed(done: &Done, i: usize) -> Option<Largest> {
    largest(done, i, |pair| Some([pair.peak_compression, pair.peak_pressure]))
}

/// Return the largest stretch of a bonded pair over all solutions of a run.
fn most_stretched(done: &Done, i: usize) -> Option<Largest> {
    largest(done, i, |pair| pair.tension.map(|tension| [tension.peak_stretch, tension.peak_tension]))
}

/// Return the largest of what `of` takes from the reports of a pair over all solutions of a run: a compression and a
/// pressure.
fn largest(done: &Done, i: usize, of: fn(&PairResult) -> Option<[f64; 2]>) -> Option<Largest> {
    let found = |pair: &PairResult, step| of(pair).map(|[most, pressure]| Largest { most, pressure, step });
    if done.steps.is_empty() {
        let is_solved = done.outcome.status.is_solved();
        return is_solved.then(|| results::pair(done, i, None)).and_then(|pair| found(&pair, None));
    }
    let solved = done.steps.iter().enumerate().filter(|(_, step)| step.status.is_solved());
    let all = solved.filter_map(|(number, step)| found(&step.pairs[i], Some(number + 1)));
    all.max_by(|a, b| a.most.total_cmp(&b.most))
}

/// Add the warnings of contacts that reach the end of a pair, which the key `distance` has cut short. A pair has one
/// warning, that of the first load step.
pub fn note_ends(done: &mut Done) {
    if !done.outcome.status.is_solved() {
        return;
    }
    for i in 0..done.model().pairs.len() {
        let reached = reached(done, i);
        if reached == 0 {
            continue;
        }
        let spec = &done.built.discrete.specs[i];
        let [a, b] = names(spec);
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

/// Approach of the surfaces, as a share of the largest distance of a pair, from which a contact at the end of the pair
/// goes on beyond it.
///
/// On a curved surface the distance at an end is nearly the largest one. It grows with the square of the place r, and
/// the end is within a facet of size h from the largest distance: its share is (r/(r + h))^2 or more, which is a half
/// if r is 2.4 facets. So every contact of three facets that reaches the end counts. At a step of the surface the
/// distance at the end is less, and the surfaces have to approach by all of the step, which is more than the largest
/// distance, until what lies beyond touches. Spheres whose contact ends where they are 0.02 apart are found with
/// largest distances from 0.004 to 0.016, on elements of both orders (`tests/geometry/ends.rs`).
const NEARLY: f64 = 0.5;

/// Return the number of contact points under pressure from which the contact probably goes on beyond the end of pair
/// `i`. Surfaces that touch whatever their distance is have no approach: there every such point counts.
fn reached(done: &Done, i: usize) -> usize {
    let (layer, first) = (&done.outcome.layer, done.model().range(i).start);
    let (discrete, gap) = (&done.built.discrete, &done.model().pairs[i].gap);
    let spec = &discrete.specs[i];
    let least = spec.distance.filter(|_| !spec.is_touching()).map_or(f64::NEG_INFINITY, |d| NEARLY * d);
    let goes_on = |q: &&usize| layer.pressure[first + *q] > 0.0 && layer.compression[first + *q] + gap[**q] >= least;
    discrete.contacts[i].ends.iter().filter(goes_on).count()
}
