//! Results from the displacements of the bodies: largest stresses and strains with their positions, errors against a
//! known solution, forces, approach and contact size of each pair, and reactions and balance of each body.

use super::stages::{All, Built, Done, Recovered};
use super::{extent, numbered};
use crate::contact::{ContactPair, moment_in_scene};
use crate::discretize::{BodyInfo, ContactFacts, Discrete, ForceBalance, Obstacle, mean_normal};
use crate::error::{Result, few};
use crate::exchange::all_gather;
use crate::fem::displacement::{self, Strained};
use crate::fem::{length, minus};
use crate::linalg::{around, bounds, dot, range as range_of};
use crate::model::{Body, BodySlot, DisplacementField};
use crate::output::closing::readable;
use crate::output::{
    BalanceReport, BodyReport, Extent, ForceReport, LargestStress, ObstacleReport, PairResult, ReactionReport,
    ResultNames, RunStatus, SealReport, StepReport, TensionReport, sci,
};
use crate::problem::history::History;
use serde::{Deserialize, Serialize};
use std::rc::Rc;

/// Return the displacements of the bodies that this rank has nodes of. They are recovered unless the end of the run
/// stored them. Collective.
pub fn recover(done: &Done) -> Rc<All> {
    done.recovered.clone().unwrap_or_else(|| {
        let local = |(index, slot): (usize, &BodySlot)| {
            slot.local.as_ref().map(|body| recover_body(slot, body, &done.outcome.iterate, index))
        };
        Rc::new(done.model().bodies.iter().take(done.model().meshed()).enumerate().map(local).collect())
    })
}

/// Return the displacements of a body. Collective.
fn recover_body(slot: &BodySlot, body: &Body, iterate: &DisplacementField, index: usize) -> Result<Recovered> {
    let (bent, amounts) = (&iterate.displacements[index], &iterate.rigid[index]);
    let state = body.recover(&body.dofs().join(bent, amounts))?;
    // a motion that springs resist counts as deformation; the amounts are the same on all ranks, so all of them take
    // the same branch
    let is_whole = slot.is_sprung() || amounts.iter().all(|a| *a == 0.0);
    let bent = if is_whole { state.clone() } else { body.recover(bent)? };
    Ok(Recovered::new(state, bent))
}

/// The results on a rank's part of a body.
#[derive(Serialize, Deserialize)]
struct Extremes {
    /// Largest von Mises stress; NaN if a solver failed.
    von_mises: f64,
    /// Point of the largest von Mises stress.
    at: [f64; 3],
    /// Its change within the cells there, relative.
    change: f64,
    principal: [f64; 2],
    displacement: f64,
    /// Bounding box of the points: least and largest coordinates.
    extent: [[f64; 3]; 2],
    strain: Strained,
    /// Integral of the rotation vector over the part.
    rotation: [f64; 3],
    /// Norms of the error and of the known displacements: L2, H1 seminorm, energy.
    norms: Option<[[f64; 3]; 2]>,
}

impl Extremes {
    /// Evaluate the displacements of a body on this rank.
    fn new(info: &BodyInfo, recovered: &Result<Recovered>) -> Self {
        let mut extremes = Self {
            von_mises: f64::NEG_INFINITY,
            at: [0.0; 3],
            change: 0.0,
            principal: [f64::INFINITY, f64::NEG_INFINITY],
            displacement: 0.0,
            extent: bounds([]),
            strain: Strained::NONE,
            rotation: [0.0; 3],
            norms: None,
        };
        let Ok(recovered) = recovered else { return Self { von_mises: f64::NAN, ..extremes } };
        let field = recovered.field(info);
        if let Some(LargestStress { point, change }) = field.largest {
            (extremes.von_mises, extremes.at, extremes.change) = (field.von_mises[point], field.points[point], change);
        }
        for s in &field.principal {
            extremes.principal = [extremes.principal[0].min(s[2]), extremes.principal[1].max(s[0])];
        }
        extremes.displacement = field.displacement.iter().map(|&u| length(u)).fold(0.0, f64::max);
        extremes.extent = bounds(field.points.iter().copied());
        extremes.strain = info.post().strain(&recovered.bent);
        extremes.rotation = info.post().rotation(&recovered.state);
        extremes.norms = info.post().errors(&recovered.state);
        extremes
    }

    /// Return the extremes of two parts of a body together.
    fn merged(self, other: Self) -> Self {
        let ([low, high], [least, largest]) = (self.principal, other.principal);
        let norms = self
            .norms
            .zip(other.norms)
            .map(|(a, b)| std::array::from_fn(|i| std::array::from_fn(|norm| f64::hypot(a[i][norm], b[i][norm]))));
        let displacement = self.displacement.max(other.displacement);
        let extent = around(self.extent, other.extent);
        let strain = self.strain.with(other.strain);
        let rotation = [0, 1, 2].map(|c| self.rotation[c] + other.rotation[c]);
        // total_cmp orders NaN above all numbers, so that it survives
        let larger = if other.von_mises.total_cmp(&self.von_mises).is_gt() { other } else { self };
        Self { principal: [low.min(least), high.max(largest)], displacement, extent, strain, rotation, norms, ..larger }
    }

    /// Write the extremes to the report of their body.
    fn fill(&self, report: &mut BodyReport) {
        report.max_displacement = Some(self.displacement);
        (report.max_strain, report.max_strain_at) = (Some(self.strain.most), Some(self.strain.at));
        (report.max_von_mises, report.max_von_mises_at) = (Some(self.von_mises), Some(self.at));
        report.max_von_mises_change = Some(self.change).filter(|change| change.is_finite());
        report.principal_range = Some([self.principal[1], self.principal[0]]);
        let error = |norm: usize| {
            let [error, solution] = self.norms?;
            Some(error[norm] / solution[norm]).filter(|error| error.is_finite())
        };
        (report.error_l2, report.error_h1, report.error_energy) = (error(0), error(1), error(2));
    }

    /// Whether the largest displacement exceeds [`SMALL`] times the diagonal of the body.
    fn is_moved_far(&self) -> bool {
        let [low, high] = self.extent;
        self.displacement > SMALL * length(minus(high, low))
    }
}

/// Angle of the mean rotation of a body up to which displacements are small. A turn by it moves points across by a
/// thousandth of their distance, and the normal of a surface by itself.
const TURNED: f64 = 0.05;

/// Displacements up to this fraction of the size of a body are small. A rotation by this angle changes lengths along
/// and across by half a per cent.
const SMALL: f64 = 0.1;

/// Write largest stresses, displacements and errors of all bodies to their reports, null where there are none. Return
/// warnings of displacements and strains that are too large for the theory. Collective.
pub fn fill(discrete: &Discrete, recovered: &All, reports: &mut [BodyReport]) -> Vec<String> {
    let (mut moved, mut turned, mut strained) = (Vec::new(), Vec::new(), Vec::new());
    for (report, extremes) in reports.iter_mut().zip(gather(discrete, recovered)) {
        let Some(extremes) = extremes.filter(|extremes| extremes.von_mises.is_finite()) else { continue };
        extremes.fill(report);
        if extremes.is_moved_far() {
            moved.push(report.name.clone());
        }
        let angle = length(extremes.rotation) / extremes.strain.measure[1];
        if angle > TURNED {
            turned.push(format!("`{}` by {angle:.2}", report.name));
        }
        if extremes.strain.most > displacement::SMALL {
            strained.push(strain_in_words(&report.name, &extremes.strain));
        }
    }
    let moved = (!moved.is_empty()).then(|| {
        format!(
            "displacements of more than a tenth of the body's size: {}. The theory is that of small ones: look at the gaps, the units and \
             the supports",
            few(moved).join(", ")
        )
    });
    let turned = (!turned.is_empty()).then(|| {
        format!(
            "bodies turn by more than {TURNED} rad: {}. The theory is that of small turns: forces and pressures may be right, and \
             displacements are not; hold them by a support or a weak spring",
            few(turned).join(", ")
        )
    });
    let strained = (!strained.is_empty()).then(|| {
        format!(
            "strains of more than {} per cent: {}. Linear elasticity is the theory of small ones: look at the moduli, the loads and the units",
            100.0 * displacement::SMALL,
            few(strained).join("; ")
        )
    });
    moved.into_iter().chain(turned).chain(strained).collect()
}

/// Return the extremes of each body over all ranks, where a rank has any. Collective.
fn gather(discrete: &Discrete, recovered: &All) -> Vec<Option<Extremes>> {
    let mut mine = Vec::new();
    for (body, (info, recovered)) in discrete.bodies.iter().zip(recovered).enumerate() {
        mine.extend(recovered.as_ref().map(|recovered| (body, Extremes::new(info, recovered))));
    }
    let mut all: Vec<Option<Extremes>> = discrete.bodies.iter().map(|_| None).collect();
    for (body, part) in all_gather(&*discrete.model.exchange, mine).into_iter().flatten() {
        all[body] = Some(match all[body].take() {
            Some(before) => before.merged(part),
            None => part,
        });
    }
    all
}

/// Return the largest strain of a body in words, with its position and the fraction of the body with large strains.
/// Near a sharp corner these are a few cells.
fn strain_in_words(name: &str, strain: &Strained) -> String {
    let [large, all] = strain.measure;
    let [x, y, z] = strain.at.map(|x| readable(x, 4));
    let percentage = readable(100.0 * large / all, 1);
    format!("`{name}` up to {} at ({x}, {y}, {z}), in {percentage} per cent of the body", sci(strain.most, 1))
}

/// Return the names of the pairs in the order of the scene, made unique.
pub fn pair_names(built: &Built) -> Vec<String> {
    let model = &built.discrete.model;
    let names = (0..model.pairs.len()).map(|i| {
        let [a, b] = built.discrete.sides(i).map(|side| &model.bodies[model.pairs[i].bodies[side]].name);
        let slip = if built.discrete.specs[i].slip.is_some() { "-shear" } else { "" };
        format!("{a}-{b}{slip}")
    });
    numbered(names)
}

/// Return the names of the pairs and of the supports, springs and rigid surfaces, body by body, made unique.
pub fn names_of_results(built: &Built) -> ResultNames {
    let reactions = built.discrete.bodies.iter().flat_map(|body| {
        let all = body.supports.iter().chain(&body.springs).chain(&body.rigid);
        all.map(|on| format!("{}:{on}", body.name))
    });
    ResultNames { pairs: pair_names(built), reactions: numbered(reactions), dimension: built.scene.dimension.value }
}

/// Return the reactions of bodies with these names and balances, in the order of [`names_of_results`].
fn reactions<'a>(bodies: impl Iterator<Item = (&'a String, BalanceReport)>) -> Vec<ReactionReport> {
    let of_body = |(name, balance): (&String, BalanceReport)| {
        let BalanceReport { supports, springs, rigid, .. } = balance;
        let all = supports.into_iter().chain(springs).chain(rigid);
        all.map(|part| ReactionReport { body: name.clone(), on: part.on, force: part.force }).collect::<Vec<_>>()
    };
    bodies.flat_map(of_body).collect()
}

/// Return the reactions from the reports of bodies, in the order of [`names_of_results`].
pub fn reported(bodies: &[BodyReport]) -> Vec<ReactionReport> {
    reactions(bodies.iter().map(|body| (&body.name, body.balance.clone())))
}

/// Return the report of the load step `number` of a history, counted from 0, which has ended with these displacements.
/// Collective.
pub fn step(
    done: &Done,
    recovered: &All,
    history: &History,
    number: usize,
    status: RunStatus,
    message: String,
) -> StepReport {
    let approaches = approaches(done, recovered);
    let balances = balances(done, recovered);
    let names = done.built.discrete.bodies.iter().map(|body| &body.name);
    let step = &history.steps[number];
    StepReport {
        time: step.time,
        factors: history.names.iter().cloned().zip(step.factors.iter().copied()).collect(),
        status,
        message,
        iterations: done.outcome.iterations,
        residual: done.outcome.rows.last().map(|row| row.residual).filter(|residual| residual.is_finite()),
        pairs: approaches.into_iter().enumerate().map(|(i, approach)| pair(done, i, approach)).collect(),
        reactions: reactions(names.zip(balances)),
    }
}

/// Return the resultant force or moment of contact forces (n) on a side: minus the sum of the forces times the `rows`
/// (n x 3) of their points.
fn resultant(force: &[f64], rows: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|k| force.iter().zip(rows).fold(0.0, |sum, (force, row)| sum - force * row[k]))
}

/// Return the largest compression of a layer, negative if all of it is open.
fn largest(compression: &[f64]) -> f64 {
    compression.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// Return the point of the largest pressure, and this pressure. It is zero where a bond only pulls.
fn largest_pressure(pressure: &[f64]) -> (usize, f64) {
    let peak = (0..pressure.len()).max_by(|&q, &r| pressure[q].total_cmp(&pressure[r])).unwrap_or(0);
    (peak, if pressure[peak] < 0.0 { 0.0 } else { pressure[peak] })
}

/// Return the mean pressure of the part in contact, from the forces of the points: those of the compressed part of a
/// bond; zero without contact.
fn mean_pressure(force: &[f64], extent: &Extent) -> f64 {
    let pressed = force.iter().fold(0.0, |sum, force| sum + force.max(0.0));
    if extent.contact() > 0.0 { pressed / extent.contact() } else { 0.0 }
}

/// Return the largest tension of a bonded pair and the largest stretch of its layer.
fn tension(pair: &ContactPair, compression: &[f64], pressure: &[f64]) -> Option<TensionReport> {
    let least = (0..pair.len()).min_by(|&q, &r| pressure[q].total_cmp(&pressure[r]))?;
    Some(TensionReport {
        peak_tension: (0.0 - pressure[least]).max(0.0),
        peak_tension_at: pair.position[least],
        peak_stretch: compression.iter().fold(0.0, |most, c| most.max(-c)),
    })
}

/// Return the result of pair `i`.
pub fn pair(done: &Done, i: usize, approach: Option<f64>) -> PairResult {
    let (model, layer) = (done.model(), &done.outcome.layer);
    let (pair, range) = (&model.pairs[i], model.range(i));
    let (shear, force) = (done.built.discrete.specs[i].slip.is_some(), &layer.force[range.clone()]);
    // slips and tractions along the surface count by their sizes, whichever way they point
    let sizes = |values: &[f64]| values.iter().map(|v| if shear { v.abs() } else { *v }).collect::<Vec<_>>();
    let [c, p] = [&layer.compression, &layer.pressure].map(|values| sizes(&values[range.clone()]));
    let sides = done.built.discrete.sides(i);
    let (extent, contact_ends) = extent::of(done, i);
    let (peak, peak_pressure) = largest_pressure(&p);
    let elastic = extent::beyond_rest(done, i);
    let closed = || (0..pair.len()).filter(|&q| elastic[q] > 0.0);
    let opening = extent::opening(done, i);
    let [least_gap, largest_gap] = range_of(pair.gap.iter().copied());
    PairResult {
        shear,
        closed: closed().count(),
        force: sides.map(|side| resultant(force, &pair.resultant[side])),
        moment: sides.map(|side| resultant(force, &pair.moment[side])),
        approach,
        normal_force: force.iter().sum(),
        least_pressure: closed().map(|q| p[q]).reduce(f64::min).unwrap_or(0.0),
        mean_pressure: mean_pressure(&sizes(force), &extent),
        peak_pressure,
        peak_at: pair.position[peak],
        peak_compression: largest(&c),
        tension: if pair.law.is_bonded() && !shear { tension(pair, &c, &p) } else { None },
        extent,
        contact_ends,
        gap: [least_gap, mean(&pair.area, &pair.gap), largest_gap],
        opening: [mean(&pair.area, &opening), opening.iter().copied().fold(0.0, f64::max)],
        layer_energy: layer.energy[i],
        obstacle: obstacle(done, i),
        offset: offset(done, i),
        seal: seal(done, i, &p),
    }
}

/// Return what the seal of pair `i` holds, from the pressures of its points; none without a seal. Tension holds
/// nothing.
fn seal(done: &Done, i: usize, pressure: &[f64]) -> Option<SealReport> {
    let ContactFacts { seal, surface, .. } = &done.built.discrete.contacts[i];
    let seal = seal.as_ref()?;
    let pressed: Vec<f64> = pressure.iter().map(|p| if *p < 0.0 { 0.0 } else { *p }).collect();
    let at_points = surface.spread(1, &pressed, 0.0);
    let weakest = seal.weakest(&at_points)?;
    Some(SealReport { sealing_pressure: at_points[weakest], sealing_at: surface.points()[weakest] })
}

/// Return the mean of values with these weights.
fn mean(weight: &[f64], values: &[f64]) -> f64 {
    dot(weight, values) / weight.iter().sum::<f64>()
}

/// Return the motion of the obstacle of pair `i` and what acts on it; none without an obstacle.
pub fn obstacle(done: &Done, i: usize) -> Option<ObstacleReport> {
    let (pair, spec) = (&done.model().pairs[i], &done.built.discrete.specs[i]);
    let found = spec.obstacle.then(|| Obstacle::new(pair, spec))?;
    let (approach, tilt) = found.moved(&done.outcome.iterate.rigid[pair.bodies[1]]);
    let force = &done.outcome.layer.force[done.model().range(i)];
    let (force, moment) = (resultant(force, &pair.resultant[1]), resultant(force, &pair.moment[1]));
    let moment = found.moment(force, moment).map(|component| 0.0 - component);
    Some(ObstacleReport { approach, tilt, force: found.along(force), moment, at: found.at })
}

/// Return the offset of the gap of pair `i` that was found for its force or preload; none without such.
pub fn offset(done: &Done, i: usize) -> Option<f64> {
    let (model, spec) = (done.model(), &done.built.discrete.specs[i]);
    let has_offset = !spec.obstacle && (spec.force.is_some() || spec.preload.is_some());
    let closing = has_offset.then(|| model.rigid_closing(i, &done.outcome.iterate.rigid))?;
    Some(model.pairs[i].offset + closing[0])
}

/// Return the approach of the bodies of each pair along its mean normal, none without a mean normal. Collective, one
/// message.
pub fn approaches(done: &Done, recovered: &All) -> Vec<Option<f64>> {
    let (discrete, model) = (&done.built.discrete, done.model());
    let mut sums = vec![0.0; model.pairs.len()];
    for (body, recovered) in recovered.iter().enumerate() {
        let segments = &model.bodies[body].segments;
        let each = match recovered {
            None => continue,
            Some(Err(_)) => vec![f64::NAN; segments.len()],
            Some(Ok(Recovered { state, .. })) => discrete.bodies[body].post().approach(state),
        };
        segments.iter().zip(each).for_each(|(segment, own)| sums[segment.pair] += own);
    }
    model.exchange.sum(&mut sums);
    for (i, sum) in sums.iter_mut().enumerate() {
        *sum += obstacle(done, i).map_or(0.0, |obstacle| obstacle.approach);
    }
    let known = |(pair, sum): (&ContactPair, f64)| mean_normal(pair).map(|_| sum).filter(|sum| sum.is_finite());
    model.pairs.iter().zip(sums).map(known).collect()
}

/// Numbers of a resultant: force and moment.
const WIDTH: usize = 6;

/// Return the forces on every body of the result. Collective.
pub fn balances(done: &Done, recovered: &All) -> Vec<BalanceReport> {
    let discrete = &done.built.discrete;
    let mut message = Vec::new();
    for (body, info) in discrete.bodies.iter().enumerate() {
        let mut mine = vec![0.0; WIDTH * names(info).len() + 2];
        match &recovered[body] {
            None => {}
            // a solver that failed leaves the forces unknown, but the run itself is over
            Some(Err(_)) => mine.fill(f64::NAN),
            Some(Ok(recovered)) => add_forces(done, body, recovered, &mut mine),
        }
        message.extend(mine);
    }
    discrete.model.exchange.sum(&mut message);
    let (mut rest, mut reports) = (&message[..], Vec::new());
    for info in &discrete.bodies {
        let numbers;
        (numbers, rest) = rest.split_at(WIDTH * names(info).len() + 2);
        reports.push(balance(info, numbers));
    }
    reports
}

/// Return the names of the resultants on a body: loads, contacts, then each support, spring and rigid surface.
fn names(info: &BodyInfo) -> Vec<String> {
    let all = info.supports.iter().chain(&info.springs).chain(&info.rigid).cloned();
    ["loads", "contacts"].map(str::to_owned).into_iter().chain(all).collect()
}

/// Write this rank's part of the resultants on a body, and of the sums of sizes of forces and moments, to `mine`.
fn add_forces(done: &Done, body: usize, recovered: &Recovered, mine: &mut [f64]) {
    let (model, info) = (done.model(), &done.built.discrete.bodies[body]);
    let force = model.at_rows(body, &done.outcome.layer.force);
    let ForceBalance { parts, size } = info.post().balance(&recovered.bent, &force);
    let numbers = parts.iter().flat_map(|part| [part.force, part.moment]).flatten().chain(size);
    mine.iter_mut().zip(numbers).for_each(|(mine, number)| *mine = number);
}

/// Return the report of the forces on a body from the numbers of its resultants, and the sums of sizes of forces and
/// moments.
fn balance(info: &BodyInfo, numbers: &[f64]) -> BalanceReport {
    let names = names(info);
    let (resultants, sizes) = numbers.split_at(WIDTH * names.len());
    let resultant =
        |(on, n): (String, &[f64])| ForceReport { on, force: [n[0], n[1], n[2]], moment: [n[3], n[4], n[5]] };
    let mut parts: Vec<ForceReport> = names.into_iter().zip(resultants.chunks_exact(WIDTH)).map(resultant).collect();
    let force_imbalance = imbalance(parts.iter().map(|part| part.force), sizes[0]);
    let moment_imbalance = imbalance(parts.iter().map(|part| part.moment), sizes[1]);
    for part in &mut parts {
        part.moment = moment_in_scene(&info.datum, part.force, part.moment);
    }
    let rigid = parts.split_off(2 + info.supports.len() + info.springs.len());
    let springs = parts.split_off(2 + info.supports.len());
    let supports = parts.split_off(2);
    let contacts = parts.pop().unwrap_or_default();
    let loads = parts.pop().unwrap_or_default();
    BalanceReport { loads, contacts, supports, springs, rigid, force_imbalance, moment_imbalance }
}

/// Return the norm of the sum of vectors, relative to the sum of the sizes of all nodal contributions; zero if that is
/// zero.
fn imbalance(vectors: impl Iterator<Item = [f64; 3]> + Clone, size: f64) -> f64 {
    let sum = |c: usize| vectors.clone().map(|vector| vector[c]).sum::<f64>();
    if size > 0.0 { length([0, 1, 2].map(sum)) / size } else { 0.0 }
}
