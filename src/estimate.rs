//! How far the discrete solution is from the exact one: bodies, layers, pressure.
//!
//! The displacement recovered from the discrete one tells, cell by cell, the difference of the stresses, which is the error in
//! the energy norm, and the part of the displacement that the elements cannot represent. The second one acts like a load
//! on the discrete problem; its response is what nodal displacements and nodal pressures lack.

mod field;
mod held;
mod layer;
pub mod sizes;

use crate::ddm::{Discretisation, linear};
use crate::discretize::meshes::{Meshes, Recovered};
use crate::error::{Error, Kind, Result};
use crate::model::field::residual;
use crate::model::surface::meeting_slopes;
use crate::model::{Field, Layer, LinearStep, Model};
use held::Held;
use layer::LayerError;
use std::rc::Rc;

/// Estimated errors of a discrete solution.
#[derive(Debug, Clone, Default)]
pub struct Estimate {
    /// Squared energy error of each cell of each body; empty where the body lives on another rank.
    pub cells: Vec<Vec<f64>>,
    /// Squared energy error of each body.
    pub bodies: Vec<f64>,
    /// Squared energy error of each layer between its points.
    pub layers: Vec<f64>,
    /// Relative error in the energy norm of bodies and layers.
    pub energy: f64,
    /// Relative error of the nodal values in the same norm.
    pub nodal: f64,
    /// Error of the pressure at each contact point, exact minus discrete.
    pub pressure_error: Vec<f64>,
    /// Relative error of the pressures of each pair at its points, root of mean squares over the surface, on the safe side.
    pub pressure: Vec<f64>,
    /// The same of the normal displacements of all contact surfaces; at least [`Estimate::energy`] squared.
    pub displacement: f64,
}

/// Factor on the errors of nodal values: where a solution has a kink, recovery smooths it and sees too little. The same
/// number is usual for errors extrapolated from three meshes (Roache 1994).
const SAFETY: f64 = 1.25;

/// Error of the response in the solve for the nodal errors. What conjugate gradients miss is orthogonal to what they have: the energy norm is
/// then wrong by half of the square of this, and pressures changed by at most 0.3 % from those at a hundredth.
const ROUGH: f64 = 0.1;

/// Estimates the error of an iterate; `step` solves for the response of the bodies. Collective.
///
/// # Errors
/// Failures of the solver library.
pub fn estimate(
    meshes: &dyn Meshes,
    model: &mut Model,
    step: &mut dyn LinearStep,
    iterate: &Field,
    layer: &Layer,
) -> Result<Estimate> {
    let displacements = displacements(meshes, model, iterate)?;
    let each = displacements.iter().enumerate();
    let recovered: Vec<_> = each.map(|(body, u)| Some(meshes.recover(body, u.as_ref()?))).collect();
    let mut local = Local::of_bodies(meshes, &recovered);
    for pair in 0..model.pairs.len() {
        local.add_pair(meshes, model, layer, &recovered, pair);
    }
    drop(recovered);
    let mut bodies: Vec<f64> = local.cells.iter().map(|cells| cells.iter().sum()).collect();
    model.exchange.sum(&mut bodies);
    let held = Held::of(model, layer);
    held.balance(meshes, model, &mut local.loads);
    let Local { cells, mut loads, layers, beyond } = local;
    to_dofs(meshes, model, &mut loads);

    let response = linear::respond(model, step, layer, &loads, share(model, layer, &beyond))?;
    let (nodal, mut squared) = response.map_err(|failure| Error::new(Kind::Solver, failure.reason))?;
    let closing: Vec<f64> = nodal.closing().iter().zip(&beyond).map(|(w, beyond)| w + beyond).collect();
    for (q, beyond) in beyond.iter().enumerate() {
        squared += model.weight[q] * layer.tangent[q] * beyond * (2.0 * closing[q] - beyond);
    }
    let mut strain = [residual(model, iterate, &vec![0.0; model.points()]).1.strain];
    model.exchange.sum(&mut strain);
    let reference = strain[0] - held.energy + layer.work;
    let relative = |squared: f64| match () {
        () if reference > 0.0 => (squared.max(0.0) / reference).sqrt(),
        // rounding is all that is left beside springs that only hold
        () if held.energy > 0.0 => f64::INFINITY,
        () => 0.0,
    };
    // that of the nodal values is a part of the whole
    let energy = relative(bodies.iter().chain(&layers).sum::<f64>().max(squared));
    let pressure_error = pressure_errors(model, layer, &closing);
    let mut trace = iterate.trace.clone();
    held.add_trace(model, -1.0, &mut trace);
    let at = |i: usize| (model.weight[i % model.points()], nodal.trace[i], trace[i]);
    let displacement = ratio((0..2 * model.points()).map(at));
    Ok(Estimate {
        energy,
        nodal: relative(squared),
        pressure: relative_errors(model, layer, &pressure_error),
        pressure_error,
        // the loads f work on the error e as f'e = a(u, e) = a(e, e), since a(u_h, e) = 0: so much they lack where they act
        displacement: SAFETY * displacement.max(energy * energy),
        cells,
        bodies,
        layers,
    })
}

/// Displacements of all nodes of each body, on the rank that leads it. Collective.
fn displacements(meshes: &dyn Meshes, model: &Model, iterate: &Field) -> Result<Vec<Option<Vec<f64>>>> {
    let mut all = Vec::new();
    for (index, state) in iterate.states.iter().enumerate() {
        let Some(body) = &model.bodies[index].local else {
            all.push(None);
            continue;
        };
        let mut u = body.recover(state)?;
        u.iter_mut().zip(body.carried()).for_each(|(u, carried)| *u += carried);
        all.push(body.leads().then(|| meshes.displacements(index, &u)));
    }
    Ok(all)
}

/// What was recovered of each body, on the rank that leads it.
type OfBodies<'a> = [Option<Box<dyn Recovered + 'a>>];

/// What recovered displacements tell before any solve.
struct Local {
    /// Squared energy error of each cell of each body that this rank leads.
    cells: Vec<Vec<f64>>,
    /// The load on the discrete problem, at the nodes of each body that this rank leads.
    loads: Vec<Vec<f64>>,
    /// Squared energy error of each layer.
    layers: Vec<f64>,
    /// What the compression of each contact point lacks as a mean, n.
    beyond: Vec<f64>,
}

impl Local {
    /// The bodies without their layers.
    fn of_bodies(meshes: &dyn Meshes, recovered: &OfBodies) -> Self {
        let count = recovered.len();
        let (cells, loads) = (vec![Vec::new(); count], vec![Vec::new(); count]);
        let mut local = Self { cells, loads, layers: Vec::new(), beyond: Vec::new() };
        for (body, recovered) in recovered.iter().enumerate() {
            if let Some(recovered) = recovered {
                local.cells[body] = recovered.energy_errors();
                local.loads[body] = recovered.interpolation_residual();
                local.loads[body].iter_mut().zip(meshes.unloaded(body)).for_each(|(load, missed)| *load += missed);
            }
        }
        local
    }

    /// Adds the layer of a pair, pairs in their order: its own error, and the forces that it lacks on both bodies. Collective.
    fn add_pair(&mut self, meshes: &dyn Meshes, model: &Model, layer: &Layer, recovered: &OfBodies, index: usize) {
        let (pair, points, range) = (&model.pairs[index], meshes.points(index), model.range(index));
        let mut compression = vec![0.0; points.weight.len()];
        for side in 0..2 {
            if let Some(recovered) = &recovered[pair.bodies[side]] {
                let normal = recovered.normal_displacement(index, side);
                compression.iter_mut().zip(normal).for_each(|(sum, u)| *sum += u);
            }
        }
        model.exchange.sum(&mut compression);
        let mut means = vec![0.0; pair.len()];
        if let Some(recovered) = &recovered[pair.bodies[1]] {
            means = recovered.beyond_means(index, &pair.nodal[1]);
        }
        model.exchange.sum(&mut means);
        let springs: Vec<f64> =
            range.clone().zip(&means).map(|(q, c)| model.weight[q] * layer.tangent[q] * c).collect();
        let of_layer = LayerError::new(pair, &points, layer, range.clone(), &compression, &means);
        let force: Vec<f64> = of_layer.pressure.iter().zip(points.weight).map(|(p, weight)| -weight * p).collect();
        for side in 0..2 {
            let (body, nodal) = (pair.bodies[side], &pair.nodal[side]);
            if let Some(recovered) = &recovered[body] {
                recovered.add_forces(index, side, &force, &mut self.loads[body]);
                nodal.add_transpose(1.0, &layer.force[range.clone()], &mut self.loads[body]);
                nodal.add_transpose(-1.0, &springs, &mut self.loads[body]);
            }
        }
        self.layers.push(of_layer.energy);
        self.beyond.extend(means);
    }
}

/// Turns loads at the nodes of each body into those at its dofs, on all ranks that have a part of it. Collective.
fn to_dofs(meshes: &dyn Meshes, model: &Model, loads: &mut [Vec<f64>]) {
    for (body, load) in loads.iter_mut().enumerate().filter(|(_, load)| !load.is_empty()) {
        meshes.forces(body, load);
    }
    for (slot, load) in model.bodies.iter().zip(loads) {
        if let Some(distribution) = slot.local.as_ref().and_then(|body| body.distribution()) {
            load.resize(distribution.dofs, 0.0);
            model.exchange.sum(load);
        }
    }
}

/// Return the body with the largest error, and the centre of its worst cell in the scene, if the estimated energy error is as large as the solution. The mesh is then too
/// coarse, or its cells are too flat, for the estimate to mean anything. Collective.
pub fn lost_at(meshes: &dyn Meshes, model: &Model, estimate: &Estimate) -> Option<(usize, [f64; 3])> {
    if estimate.energy < 1.0 {
        return None;
    }
    let body = (0..estimate.bodies.len()).max_by(|&a, &b| estimate.bodies[a].total_cmp(&estimate.bodies[b]))?;
    let of_cells = &estimate.cells[body];
    let mut place = [0.0; 3];
    // the rank that has the body has its errors
    if let Some(worst) = (0..of_cells.len()).max_by(|&a, &b| of_cells[a].total_cmp(&of_cells[b])) {
        let cells = meshes.cells(body);
        let corners = &cells.corners[cells.stride * worst..][..cells.stride];
        for &node in corners {
            (0..3).for_each(|c| place[c] += cells.nodes[node as usize][c] / cells.stride as f64);
        }
    }
    model.exchange.sum(&mut place);
    Some((body, place))
}

/// How exact the response is to be that means `beyond` have a part in. Springs of a stiff layer resist them with an energy of which bodies that
/// give way leave the share rho/(rho + kappa).
fn share(model: &Model, layer: &Layer, beyond: &[f64]) -> f64 {
    let (mut held, mut left) = (0.0, 0.0);
    for (q, rho) in meeting_slopes(model).into_iter().enumerate() {
        let energy = model.weight[q] * layer.tangent[q] * beyond[q].powi(2);
        held += energy;
        left += energy * rho / (rho + layer.tangent[q]);
    }
    if held > 0.0 { ROUGH * f64::sqrt(left / held) } else { ROUGH }
}

/// What the pressures lack where the compression lacks what the errors close. The response is that of springs at the points that
/// are closed, so a point that opens or closes takes the place where its law meets the state that the response leaves it, as in a step of
/// Newton's method: bodies give way to what a point presses, however stiff its layer.
fn pressure_errors(model: &Model, layer: &Layer, closing: &[f64]) -> Vec<f64> {
    let compression: Vec<f64> = layer.compression.iter().zip(closing).map(|(c, more)| c + more).collect();
    let met = Layer::resolve(model, &compression, &layer.linear(&compression), &meeting_slopes(model), &[]);
    met.pressure.iter().zip(&layer.pressure).map(|(exact, found)| exact - found).collect()
}

/// Relative errors of the pressures of each pair.
fn relative_errors(model: &Model, layer: &Layer, error: &[f64]) -> Vec<f64> {
    let of_pair = |index| SAFETY * ratio(model.range(index).map(|i| (model.weight[i], error[i], layer.pressure[i])));
    (0..model.pairs.len()).map(of_pair).collect()
}

/// Root of weighted sums of squares: errors over values; zero over zero is zero.
fn ratio(all: impl Iterator<Item = (f64, f64, f64)>) -> f64 {
    let (error, size) =
        all.fold((0.0, 0.0), |(e, s), (w, error, value)| (e + w * error * error, s + w * value * value));
    if error == 0.0 { 0.0 } else { f64::sqrt(error / size) }
}

/// The estimate as the rule of a balanced stop.
pub struct Nodal(pub Rc<dyn Meshes>);

impl Discretisation for Nodal {
    fn error(&mut self, model: &mut Model, step: &mut dyn LinearStep, iterate: &Field, layer: &Layer) -> Result<f64> {
        let estimate = estimate(&*self.0, model, step, iterate, layer)?;
        Ok(estimate.nodal.min(estimate.energy))
    }
}
