//! The estimated difference of the discrete solution from the exact one: in bodies, layers and pressures.
//!
//! A smoother displacement is recovered from the discrete one. The difference of their stresses, cell by cell, is the
//! error in the energy norm; in cells of quadratic elements, that of the recovered displacement from its nodal
//! interpolant where this is smaller. The recovered displacement also shows the part of the displacement that the
//! elements cannot represent, which acts like a load on the discrete problem. The response to that load is the error of
//! nodal displacements and nodal pressures.

mod end;
mod force;
mod held;
pub mod interpolate;
mod pressure;
pub mod sizes;
pub mod transfer;

use crate::contact::FinePoints;
use crate::ddm::respond;
use crate::discretize::meshes::{KeptMeshes, Meshes, RecoveredBody, in_dimension};
use crate::error::{Error, Kind, Result};
use crate::fem::Errors;
use crate::linalg::axpy;
use crate::model::field::residual;
use crate::model::layer::meeting_slopes;
use crate::model::{DisplacementField, Layer, LinearStep, Model};
use crate::scene::Quantity;
use end::EndLoads;
use held::HoldingSprings;
pub use pressure::{Cause, Guess, softness};
use pressure::{LayerError, PressureErrors, SAFETY};

/// Estimated errors of a discrete solution.
#[derive(Debug, Clone, Default)]
pub struct Estimate {
    /// Part of each cell of each body in the error of displacements at the loads: its squared energy error, and the
    /// energy of the strip at its straight facets. Empty for a body of another rank.
    pub cells: Vec<Vec<f64>>,
    /// Power of its size with which the energy error of each of these cells falls.
    pub rates: Vec<Vec<f64>>,
    /// Squared energy error of each body.
    pub bodies: Vec<f64>,
    /// Squared energy error of each layer between its contact points.
    pub layers: Vec<f64>,
    /// Relative error in the energy norm of bodies and layers.
    pub energy: f64,
    /// Relative error of the nodal values in the same norm.
    pub nodal: f64,
    /// Error of the pressure at each contact point, exact minus discrete.
    pub pressure_error: Vec<f64>,
    /// Relative error of the pressures of each pair at its points: root mean square over the surface, with the factor
    /// `SAFETY`.
    pub pressure: Vec<f64>,
    /// The part of it on the facets at sharp ends of the contact, where the pressure may be singular.
    pub ends: Vec<f64>,
    /// Place in the scene of the largest part of it.
    pub worst: Vec<[f64; 3]>,
    /// Why the error of the pressures of each pair is a guess, if it is one.
    pub guesses: Vec<Option<Guess>>,
    /// Relative error of the normal displacements of all contact surfaces, prescribed ones included, measured likewise.
    pub displacement: f64,
    /// Relative error of the sum of the pressures of each pair.
    pub force: Vec<f64>,
}

impl Estimate {
    /// Return the largest of the errors of these quantities.
    pub fn largest(&self, of: Quantity) -> f64 {
        self.with_pressures(of, self.pressure.iter().copied())
    }

    /// Return the same with the errors of pressures beside sharp ends of contacts.
    pub fn largest_beside_ends(&self, of: Quantity) -> f64 {
        let beside = |(whole, end): (&f64, &f64)| (whole * whole - end * end).max(0.0).sqrt();
        self.with_pressures(of, self.pressure.iter().zip(&self.ends).map(beside))
    }

    fn with_pressures(&self, of: Quantity, pressures: impl Iterator<Item = f64>) -> f64 {
        match of {
            Quantity::All => pressures.fold(self.displacement, f64::max),
            Quantity::Pressures => pressures.fold(0.0, f64::max),
            Quantity::Displacements => self.displacement,
            Quantity::Forces => self.force.iter().copied().fold(0.0, f64::max),
        }
    }

    /// Return whether the errors are a guess: of pressures at the edge of the contact, or because the energy error is
    /// as large as the solution.
    pub fn is_guess(&self) -> bool {
        self.guesses.iter().any(Option::is_some) || self.energy >= 1.0 || self.energy.is_nan()
    }
}

/// Relative error of the response, in the energy norm, in the solve for the nodal errors. Most of the energy is inside
/// of the bodies, and the part at the contact settles later. On slender parts with a tolerance of 0.1, multigrid gave
/// displacements that were 2.6 and 6 times smaller than those of a direct solver. With 0.01 they differ by 5 %.
const TOLERANCE: f64 = 0.01;

/// Estimate the error of an iterate with its layer state. `step` solves for the response of the bodies. Collective.
///
/// # Errors
/// Failures of the solver library.
pub fn estimate(
    meshes: &Meshes,
    model: &mut Model,
    step: &mut dyn LinearStep,
    iterate: &DisplacementField,
    layer: &Layer,
) -> Result<Estimate> {
    in_dimension!(meshes, kept => estimate_in(kept, model, step, iterate, layer))
}

fn estimate_in<const D: usize>(
    meshes: &KeptMeshes<D>,
    model: &mut Model,
    step: &mut dyn LinearStep,
    iterate: &DisplacementField,
    layer: &Layer,
) -> Result<Estimate> {
    let displacements = displacements(meshes, model, iterate)?;
    let each = displacements.iter().enumerate();
    let recovered: Vec<_> = each.map(|(body, u)| Some(meshes.recover(body, u.as_ref()?))).collect();
    let mut local = LocalErrors::of_bodies(&recovered, &work_on_missed(meshes, model, layer, &recovered));
    for pair in 0..model.pairs.len() {
        local.add_pair(meshes, model, layer, &recovered, (pair, &rigid_closing(model, iterate, pair)));
    }
    let mut bodies: Vec<f64> = local.cells.iter().take(model.meshed()).map(|cells| cells.iter().sum()).collect();
    model.exchange.sum(&mut bodies);
    local.cells.iter_mut().zip(&local.strips).for_each(|(cells, strips)| axpy(1.0, strips, cells));
    let held = HoldingSprings::of(model, layer);
    held.balance(meshes, model, &mut local.loads);
    let LocalErrors { cells, rates, mut loads, layers, mean_error, misfit, .. } = local;
    to_dofs(meshes, model, &mut loads);

    let NodalErrors { field, closing, energy: nodal } = nodal_errors(model, step, layer, &loads, &mean_error)?;
    let products = step.multiply(model, &iterate.displacements);
    let mut strain = [residual(model, products, iterate, &vec![0.0; model.points()]).1.strain];
    model.exchange.sum(&mut strain);
    let reference = strain[0] - held.energy + layer.work;
    // the error of nodal values is a part of the whole error
    let whole = bodies.iter().chain(&layers).sum::<f64>().max(nodal);
    let energy = relative_norm(whole, reference, held.energy);
    let pressures = PressureErrors::new(meshes, model, layer, &closing, &misfit);
    let solution = force::SolvedProblem { iterate, layer, displacements: &displacements, recovered: &recovered };
    let force = force::errors(meshes, model, step, &solution, &pressures.error)?;
    let mut trace = iterate.trace.clone();
    held.add_trace(model, -1.0, &mut trace);
    let both = [0, 1].into_iter().flat_map(|side| (0..model.pairs.len()).map(move |pair| (pair, side)));
    let trace: Vec<f64> = both.flat_map(|(pair, side)| model.displacement(&trace, pair, side)).collect();
    let square = |values: &[f64]| -> f64 {
        values.iter().zip(model.area.iter().cycle()).map(|(value, weight)| weight * value * value).sum()
    };
    let (error, whole) = (square(&field.trace), square(&trace));
    Ok(Estimate {
        energy,
        nodal: relative_norm(nodal, reference, held.energy),
        pressure: pressures.relative,
        force,
        ends: pressures.ends,
        worst: pressures.worst,
        guesses: pressures.guesses,
        pressure_error: pressures.error,
        displacement: if error == 0.0 { 0.0 } else { SAFETY * f64::sqrt(error / whole) },
        cells,
        rates,
        bodies,
        layers,
    })
}

/// Return the displacements of all nodes of each body, on the rank that owns it. Collective.
fn displacements<const D: usize>(
    meshes: &KeptMeshes<D>,
    model: &Model,
    iterate: &DisplacementField,
) -> Result<Vec<Option<Vec<f64>>>> {
    let mut all = Vec::new();
    for (index, (state, rigid)) in iterate.displacements.iter().zip(&iterate.rigid).enumerate() {
        let slot = &model.bodies[index];
        let Some(body) = slot.local.as_ref().filter(|_| !slot.is_rigid) else {
            all.push(None);
            continue;
        };
        let u = body.recover(&body.dofs().join(state, rigid))?;
        all.push(body.dofs().leads().then(|| meshes.displacements(index, &u)));
    }
    Ok(all)
}

/// Return by how much an obstacle or an offset closes the points of a pair, n.
fn rigid_closing(model: &Model, iterate: &DisplacementField, index: usize) -> Vec<f64> {
    let (pair, mut closing) = (&model.pairs[index], model.rigid_closing(index, &iterate.rigid));
    closing.iter_mut().for_each(|closing| *closing += pair.offset);
    if model.bodies[pair.bodies[1]].is_rigid {
        axpy(1.0, &pair.prescribed[1], &mut closing);
    }
    closing
}

/// The errors of nodal values: the response of bodies and layers to what the elements cannot represent.
struct NodalErrors {
    /// Error of the displacements.
    field: DisplacementField,
    /// Error of the compression at each contact point, n.
    closing: Vec<f64>,
    /// Squared energy norm of the error.
    energy: f64,
}

/// Solve for the errors of nodal values. `loads` has one entry a dof of each local body, and `mean_error` is that of
/// [`LocalErrors`], n.
fn nodal_errors(
    model: &mut Model,
    step: &mut dyn LinearStep,
    layer: &Layer,
    loads: &[Vec<f64>],
    mean_error: &[f64],
) -> Result<NodalErrors> {
    let response = respond(model, step, layer, loads, tolerance(model, layer, mean_error))?;
    let (field, mut energy) = response.map_err(|failure| Error::new(Kind::Solver, failure.reason))?;
    let closing: Vec<f64> = field.closing().iter().zip(mean_error).map(|(w, mean)| w + mean).collect();
    for (q, mean) in mean_error.iter().enumerate() {
        energy += model.area[q] * layer.tangent[q] * mean * (2.0 * closing[q] - mean);
    }
    Ok(NodalErrors { field, closing, energy })
}

/// Return the relative energy norm of an error from its squared energy norm. `reference` is the energy of bodies and
/// layers, without the energy `held` of springs that only hold bodies in place.
fn relative_norm(squared: f64, reference: f64, held: f64) -> f64 {
    if reference > 0.0 {
        (squared.max(0.0) / reference).sqrt()
    } else if held > 0.0 {
        // besides the springs that only hold, the energy is nothing but rounding
        f64::INFINITY
    } else {
        0.0
    }
}

/// The recovered displacement of each body, on the rank that owns it.
type RecoveredBodies<'a, const D: usize> = [Option<RecoveredBody<'a, D>>];

/// The errors that recovered displacements show without a solve.
struct LocalErrors {
    /// Squared energy error of each cell of each body that this rank owns.
    cells: Vec<Vec<f64>>,
    /// Power of its size with which the energy error of each of these cells falls.
    rates: Vec<Vec<f64>>,
    /// Energy of the strip at the straight facets of each of these cells.
    strips: Vec<Vec<f64>>,
    /// The load on the discrete problem, at the nodes of each body that this rank owns.
    loads: Vec<Vec<f64>>,
    /// Squared energy error of each layer.
    layers: Vec<f64>,
    /// Difference of the compression at each contact point, n, from its mean around the point, which the discrete
    /// problem takes in its place.
    mean_error: Vec<f64>,
    /// Error of the pressure of each contact point, n, that is no response to loads: [`EndLoads::misfit`].
    misfit: Vec<f64>,
}

impl LocalErrors {
    /// Return the errors of the bodies, without those of the layers. `work_on_missed` has an entry for each body.
    fn of_bodies<const D: usize>(recovered: &RecoveredBodies<D>, work_on_missed: &[f64]) -> Self {
        let count = recovered.len();
        let none = || vec![Vec::new(); count];
        let (cells, rates, strips, loads) = (none(), none(), none(), none());
        let mut local =
            Self { cells, rates, strips, loads, layers: Vec::new(), mean_error: Vec::new(), misfit: Vec::new() };
        for (body, recovered) in recovered.iter().enumerate() {
            if let Some(recovered) = recovered {
                let Errors { cells, rates, strips, load } = recovered.errors(work_on_missed[body]);
                (local.cells[body], local.rates[body]) = (cells, rates);
                (local.strips[body], local.loads[body]) = (strips, load);
            }
        }
        local
    }

    /// Add the error of the layer of a pair, and the error of its forces on both bodies. To be called for the pairs in
    /// their order. Collective.
    fn add_pair<const D: usize>(
        &mut self,
        meshes: &KeptMeshes<D>,
        model: &Model,
        layer: &Layer,
        recovered: &RecoveredBodies<D>,
        (index, rigid): (usize, &[f64]),
    ) {
        let (pair, points, range) = (&model.pairs[index], meshes.points(index), model.range(index));
        let mut compression = vec![0.0; points.each.len()];
        for side in 0..2 {
            if let Some(recovered) = &recovered[pair.bodies[side]] {
                let normal = recovered.recovered_displacement(index, side);
                compression.iter_mut().zip(normal).for_each(|(sum, u)| *sum += u);
            }
        }
        model.exchange.sum(&mut compression);
        for (g, sum) in compression.iter_mut().enumerate() {
            *sum += points.interpolation.row(g).map(|(q, shape)| shape * rigid[q]).sum::<f64>();
        }
        let mut mean_error = vec![0.0; pair.len()];
        if let Some(recovered) = &recovered[pair.bodies[1]] {
            mean_error = recovered.beyond_means(index, &pair.nodal[1]);
        }
        model.exchange.sum(&mut mean_error);
        let ends = loads_at_ends(model, points, layer, index);
        let spring =
            |q: usize| model.area[q] * (layer.tangent[q] * mean_error[q - range.start] - ends.force[q - range.start]);
        let springs: Vec<f64> = range.clone().map(spring).collect();
        let of_layer = LayerError::new(model, points, layer, index, &compression, &mean_error, &ends.facets);
        let force: Vec<f64> = of_layer.pressure.iter().zip(&points.each).map(|(p, point)| -point.weight * p).collect();
        for side in 0..2 {
            let (body, nodal) = (pair.bodies[side], &pair.nodal[side]);
            if let Some(recovered) = &recovered[body] {
                recovered.add_forces(index, side, &force, &mut self.loads[body]);
                nodal.add_transpose(1.0, &layer.force[range.clone()], &mut self.loads[body]);
                nodal.add_transpose(-1.0, &springs, &mut self.loads[body]);
            }
        }
        self.layers.push(of_layer.energy);
        self.mean_error.extend(mean_error);
        self.misfit.extend(ends.misfit);
    }
}

/// Return the loads beside the ends of contact of a pair; a bond has none.
fn loads_at_ends(model: &Model, points: &FinePoints, layer: &Layer, index: usize) -> EndLoads {
    let (pair, range) = (&model.pairs[index], model.range(index));
    if pair.law.is_bonded() {
        return EndLoads::none(pair.len());
    }
    let values = end::LayerValues {
        position: &pair.position,
        pressure: &layer.pressure[range.clone()],
        tangent: &layer.tangent[range],
        softness: softness(model, index),
    };
    EndLoads::new(points, &values)
}

/// Return the work of the pressures of all contacts on the interpolation error of each body that this rank owns.
fn work_on_missed<const D: usize>(
    meshes: &KeptMeshes<D>,
    model: &Model,
    layer: &Layer,
    recovered: &RecoveredBodies<D>,
) -> Vec<f64> {
    let mut work = vec![0.0; recovered.len()];
    for (index, pair) in model.pairs.iter().enumerate() {
        let (points, pressure) = (meshes.points(index), &layer.pressure[model.range(index)]);
        let least = if pair.law.is_bonded() { f64::NEG_INFINITY } else { 0.0 };
        let at = |g: usize| points.interpolation.row(g).map(|(q, share)| share * pressure[q]).sum::<f64>().max(least);
        let force: Vec<f64> = points.each.iter().enumerate().map(|(g, point)| -point.weight * at(g)).collect();
        for (side, &body) in pair.bodies.iter().enumerate() {
            if let Some(recovered) = &recovered[body] {
                work[body] += recovered.work_on_missed(index, side, &force);
            }
        }
    }
    work
}

/// Turn loads at the nodes of each body into those at its dofs, on all ranks that have a part of the body. Collective.
fn to_dofs<const D: usize>(meshes: &KeptMeshes<D>, model: &Model, loads: &mut [Vec<f64>]) {
    for (body, load) in loads.iter_mut().enumerate().filter(|(_, load)| !load.is_empty()) {
        meshes.forces(body, load);
    }
    for (slot, load) in model.bodies.iter().zip(loads) {
        if let Some(distribution) = slot.distribution() {
            load.resize(distribution.dofs, 0.0);
            model.exchange.sum(load);
        }
    }
}

/// Return the body with the largest error, and the centre of its worst cell in the scene, if the estimated energy error
/// is as large as the solution. The mesh is then too coarse, or its cells are too flat, for the estimate to mean
/// anything. Collective.
pub fn lost_at(meshes: &Meshes, model: &Model, estimate: &Estimate) -> Option<(usize, [f64; 3])> {
    if estimate.energy < 1.0 {
        return None;
    }
    let body = (0..estimate.bodies.len()).max_by(|&a, &b| estimate.bodies[a].total_cmp(&estimate.bodies[b]))?;
    let of_cells = &estimate.cells[body];
    let mut centre = [0.0; 3];
    // only the rank that owns the body has the errors of its cells
    if let Some(worst) = (0..of_cells.len()).max_by(|&a, &b| of_cells[a].total_cmp(&of_cells[b])) {
        let cells = meshes.cells(body);
        let corners = &cells.corners[cells.stride * worst..][..cells.stride];
        for &node in corners {
            (0..3).for_each(|c| centre[c] += cells.nodes[node as usize][c] / cells.stride as f64);
        }
    }
    model.exchange.sum(&mut centre);
    Some((body, centre))
}

/// Return the relative tolerance of the response to loads that contain those of `mean_error`, n. Springs of a stiff
/// layer resist these means with an energy. The bodies give way to these springs, and the share rho/(rho + kappa) of
/// the energy is left in the response.
fn tolerance(model: &Model, layer: &Layer, mean_error: &[f64]) -> f64 {
    let (mut full, mut left) = (0.0, 0.0);
    for (q, rho) in meeting_slopes(model).into_iter().enumerate() {
        let energy = model.area[q] * layer.tangent[q] * mean_error[q].powi(2);
        full += energy;
        left += energy * rho / (rho + layer.tangent[q]);
    }
    if full > 0.0 { TOLERANCE * f64::sqrt(left / full) } else { TOLERANCE }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_quantity_has_its_errors() {
        let (pressure, ends, force) = (vec![1.0, 5.0], vec![0.0, 3.0], vec![3.0, 0.5]);
        let estimate = Estimate { pressure, ends, force, displacement: 2.0, ..Estimate::default() };
        let all = [Quantity::All, Quantity::Pressures, Quantity::Displacements, Quantity::Forces];
        assert_eq!(all.map(|of| estimate.largest(of)), [5.0, 5.0, 2.0, 3.0]);
        assert_eq!(all.map(|of| estimate.largest_beside_ends(of)), [4.0, 4.0, 2.0, 3.0]);
    }
}
