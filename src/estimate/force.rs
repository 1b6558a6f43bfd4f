//! The errors of the forces of pairs, the sums of their pressures.
//!
//! Let z be the displacements under the loads B' omega kappa 1 at the points of a pair, its *influence*: the change of
//! the force F under a load r is z'r. The pressure of the response is y = kappa (1 - B z), which is zero where the
//! bodies follow. With the error e of the displacements, the pressures p_h of the discrete problem and p(c_h) of the
//! law at the compression of the discrete displacements,
//!
//! ```text
//! F - F_h = sum over cells of a(e, z - z_h) + sum over facets of int (p(c_h) - p_h) (1 - n.z_h)
//! ```
//!
//! since a displacement of the discrete space does no work on e but for the quadrature of the layer, which is the
//! second sum. The first is of second order, as the square of an energy error.

use super::{RecoveredBodies, TOLERANCE, displacements, rigid_closing, softness, to_dofs};
use crate::contact::FinePoint;
use crate::ddm::respond;
use crate::discretize::meshes::KeptMeshes;
use crate::error::{Error, Kind, Result};
use crate::linalg::{axpy, dot};
use crate::model::{DisplacementField, Layer, LinearStep, Model};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::PI;

/// Uncertainty of each part of the sum above, as a share of it. Parts of both signs cancel, and their sum is known no
/// better than to this share of their magnitudes. For 66 forces of blocks, brackets, press fits and rollers of orders 1
/// to 4, one estimate is below a third of the error with 0.4, and three are with 0.3.
const UNCERTAIN: f64 = 0.4;

/// Number of pairs up to which each has its influence computed, by one more linear system. The error of a force among
/// more pairs is bounded by the sum of the magnitudes of the errors of its pressures, which is of first order.
const MOST: usize = 32;

/// The discrete solution with what is recovered from it.
pub(super) struct SolvedProblem<'a, const D: usize> {
    pub iterate: &'a DisplacementField,
    pub layer: &'a Layer,
    /// Displacements of all nodes of each body, on the rank that owns it.
    pub displacements: &'a [Option<Vec<f64>>],
    pub recovered: &'a RecoveredBodies<'a, D>,
}

/// Return the relative errors of the forces of all pairs. `pressure_error` is the error of the pressures, n.
/// Collective.
///
/// # Errors
/// Failures of the solver library.
pub(super) fn errors<const D: usize>(
    meshes: &KeptMeshes<D>,
    model: &mut Model,
    step: &mut dyn LinearStep,
    solution: &SolvedProblem<D>,
    pressure_error: &[f64],
) -> Result<Vec<f64>> {
    let mut errors = Vec::new();
    for index in 0..model.pairs.len() {
        let range = model.range(index);
        let sum = |values: &[f64]| range.clone().map(|q| model.area[q] * values[q].abs()).sum::<f64>();
        let (force, bound) = (sum(&solution.layer.pressure), sum(pressure_error));
        let error = if force == 0.0 || model.pairs.len() > MOST {
            bound
        } else {
            let influence = Influence::of(meshes, model, step, solution.layer, index)?;
            let mut parts = influence.of_cells(model, solution.recovered);
            parts.add(&influence.of_facets(meshes, model, solution));
            parts.signed.abs() + UNCERTAIN * parts.sizes
        };
        errors.push(if error == 0.0 { 0.0 } else { error / force });
    }
    Ok(errors)
}

/// The parts of the error of a force.
#[derive(Default)]
struct Parts {
    /// Their sum.
    signed: f64,
    /// The sum of their magnitudes.
    sizes: f64,
}

impl Parts {
    fn of(parts: impl IntoIterator<Item = f64>) -> Self {
        let mut sums = Self::default();
        parts.into_iter().for_each(|part| sums.add(&Self { signed: part, sizes: part.abs() }));
        sums
    }

    fn add(&mut self, other: &Self) {
        self.signed += other.signed;
        self.sizes += other.sizes;
    }
}

/// The influence z of the displacements on the force of a pair.
struct Influence {
    /// Number of the pair.
    pair: usize,
    /// z at all nodes of each body, on the rank that owns it.
    displacements: Vec<Option<Vec<f64>>>,
    /// 1 - B z at the points of the pair: the share of a change of the gap that the bodies do not follow.
    unfollowed: Vec<f64>,
}

impl Influence {
    /// Solve for the influence on the force of pair number `pair`. Collective.
    ///
    /// A rigid part under a given force has no stiffness, and its motions N are not in K. With the amounts a that leave
    /// the least of 1 - N a, measured by omega kappa, the loads B' omega kappa (1 - N a) do no work on them, and the
    /// response with the motion a is z.
    fn of<const D: usize>(
        meshes: &KeptMeshes<D>,
        model: &mut Model,
        step: &mut dyn LinearStep,
        layer: &Layer,
        pair: usize,
    ) -> Result<Self> {
        let range = model.range(pair);
        let springs = &layer.springs(model)[range.clone()];
        let mut unfollowed = without_motions(model, pair, springs);
        let forces: Vec<f64> = unfollowed.iter().zip(springs).map(|(rest, spring)| rest * spring).collect();
        let none = displacements(meshes, model, &DisplacementField::zero(model))?;
        let mut loads: Vec<Vec<f64>> =
            none.iter().map(|u| u.as_ref().map_or(Vec::new(), |u| vec![0.0; u.len()])).collect();
        for (rows, &body) in model.pairs[pair].nodal.iter().zip(&model.pairs[pair].bodies) {
            if none[body].is_some() {
                rows.add_transpose(1.0, &forces, &mut loads[body]);
            }
        }
        to_dofs(meshes, model, &mut loads);
        let response = respond(model, step, layer, &loads, TOLERANCE)?;
        let (field, _) = response.map_err(|failure| Error::new(Kind::Solver, failure.reason))?;
        axpy(-1.0, &field.closing()[range], &mut unfollowed);
        // condensed bodies add the displacements of their loads
        let mut displacements = displacements(meshes, model, &field)?;
        displacements.iter_mut().flatten().zip(none.iter().flatten()).for_each(|(z, u)| axpy(-1.0, u, z));
        Ok(Self { pair, displacements, unfollowed })
    }

    /// Return the sum over cells. Collective.
    fn of_cells<const D: usize>(&self, model: &Model, recovered: &RecoveredBodies<D>) -> Parts {
        let bodies = recovered.iter().zip(&self.displacements);
        let products = bodies.filter_map(|(recovered, z)| Some(recovered.as_ref()?.products(z.as_ref()?)));
        let Parts { signed, sizes } = Parts::of(products.flatten());
        let mut sums = [signed, sizes];
        model.exchange.sum(&mut sums);
        Parts { signed: sums[0], sizes: sums[1] }
    }

    /// Return the sum over facets. Collective.
    ///
    /// Compressions of the nodes are those of the discrete problem, and between them a stiff law answers the rest of
    /// the displacements with any pressure. The bodies give way to a pressure that varies within a facet: with their
    /// compliance s the pressure is where the law meets the line c_h - s (p - p_i) through the interpolated pressure
    /// p_i.
    fn of_facets<const D: usize>(&self, meshes: &KeptMeshes<D>, model: &Model, solution: &SolvedProblem<D>) -> Parts {
        let (pair, points) = (&model.pairs[self.pair], meshes.points(self.pair));
        let (pressure, soft) = (&solution.layer.pressure[model.range(self.pair)], softness(model, self.pair));
        let rigid = rigid_closing(model, solution.iterate, self.pair);
        let mut compression = vec![0.0; points.each.len()];
        for (side, &body) in pair.bodies.iter().enumerate() {
            if let Some(u) = &solution.displacements[body] {
                axpy(1.0, &meshes.normal_displacement(self.pair, side, u), &mut compression);
            }
        }
        model.exchange.sum(&mut compression);
        let product = |(g, point): (usize, &FinePoint)| {
            let between = |values: &[f64]| points.interpolation.row(g).map(|(q, shape)| shape * values[q]).sum::<f64>();
            let compliance = point.size * soft / PI;
            let here = compression[g] + between(&rigid) - point.gap;
            let c = pair.law.resolvent(point.nearest, here + compliance * between(pressure), 1.0 / compliance);
            let discrete: f64 = points.pressing.row(g).map(|(q, mu)| mu * pressure[q]).sum();
            let missed = pair.law.pressure(point.nearest, c) - discrete;
            point.weight * missed * between(&self.unfollowed)
        };
        let mut each = points.each.iter().enumerate();
        let facets = points.each.chunk_by(|p, q| p.facet == q.facet);
        Parts::of(facets.map(|facet| each.by_ref().take(facet.len()).map(product).sum::<f64>()))
    }
}

/// Return 1 - N a at the points of a pair, with the motions N of its rigid part and the amounts a for which it is
/// least, measured by these springs.
fn without_motions(model: &Model, pair: usize, springs: &[f64]) -> Vec<f64> {
    let of_pair = model.bodies.iter().filter(|slot| slot.is_rigid && slot.segments[0].pair == pair);
    let motions: Vec<&[f64]> = of_pair.flat_map(|slot| slot.free_motions()).map(|motion| &motion.trace[..]).collect();
    let mut rest = vec![1.0; springs.len()];
    let force = |motion: &[f64]| motion.iter().zip(springs).map(|(m, spring)| m * spring).collect::<Vec<f64>>();
    let stiffness = DMatrix::from_fn(motions.len(), motions.len(), |i, j| dot(&force(motions[i]), motions[j]));
    let works = DVector::from_fn(motions.len(), |i, _| dot(&force(motions[i]), &rest));
    // springs that do not resist a motion leave it out of the force, too
    if let Some(factor) = stiffness.cholesky() {
        let amounts = factor.solve(&works);
        motions.iter().zip(amounts.iter()).for_each(|(motion, a)| axpy(-a, motion, &mut rest));
    }
    rest
}
