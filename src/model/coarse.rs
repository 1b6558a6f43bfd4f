//! The free rigid motions of all bodies as a coarse space around a preconditioner of PETSc.

use super::motions::Motions;
use super::{BodySlot, Model, Motion, Segment};
use crate::error::Result;
use crate::exchange::Exchange;
use crate::linalg::{Csr, Factor, axpy, dot};
use crate::petsc::{self, Subspace};
use crate::solver::MakeSubspace;
use nalgebra::DVector;
use std::rc::Rc;

/// The free rigid motions of the bodies as a coarse space of H = K + B'DB of all bodies together, where D are springs
/// at the contact points.
///
/// Many bodies on each other are a frame whose joints are layers. No smoother reduces errors in which the frame moves
/// as a whole, and coarse levels of multigrid do so only as far as they have the rigid motions of each body. So H is
/// solved exactly in the space of all free rigid motions, which are the columns of Z (balancing: Mandel, Comm. Numer.
/// Meth. Engng 9, 1993). Since K Z = 0, HZ = B'D BZ takes only sums over contact points. Z'HZ has one block for each
/// body and one for each two bodies in contact. Motions that no spring resists are left out.
pub struct RigidSpace {
    /// Contact rows and motions of each body.
    bodies: Vec<(Vec<Segment>, Vec<Motion>)>,
    /// Number of points of each pair.
    points: Vec<usize>,
    /// The columns of Z in the rows that this rank owns.
    columns: Vec<MotionColumn>,
    /// The columns of B that this rank owns; one row a contact point.
    rows: Csr,
    exchange: Rc<dyn Exchange>,
}

/// A column of Z.
struct MotionColumn {
    /// Number of the motion among those of all bodies.
    motion: usize,
    /// First entry in a vector of this rank.
    first: usize,
    values: Vec<f64>,
}

impl RigidSpace {
    /// Return a maker of the space for the bodies of a model, or `None` if no two bodies in contact can both move
    /// freely. Then no bodies move together, and the space would save nothing. `offset` is the first entry of each body
    /// in a vector of this rank, and its length. `rows` are B of all bodies together, and `first` is the number of the
    /// first row that this rank owns.
    pub fn of(model: &Model, offset: &[usize], rows: &Csr, first: usize) -> Option<MakeSubspace> {
        let mut free_sides = vec![0; model.pairs.len()];
        let bodies: Vec<(Vec<Segment>, Vec<Motion>)> = model.bodies.iter().map(of_body).collect();
        for slot in model.bodies.iter().filter(|slot| slot.free > 0 && !slot.is_rigid) {
            slot.segments.iter().for_each(|segment| free_sides[segment.pair] += 1);
        }
        if !free_sides.contains(&2) {
            return None;
        }
        let points: Vec<usize> = (0..model.pairs.len()).map(|pair| model.range(pair).len()).collect();
        let (length, motions) = (offset[offset.len() - 1], motions_of(&bodies, &points));
        let mut columns = Vec::new();
        for (body, local) in model.locals().filter(|(body, _)| !model.bodies[*body].is_rigid) {
            let column = |(motion, values): (usize, &Vec<f64>)| MotionColumn {
                motion,
                first: offset[body],
                values: values.clone(),
            };
            columns.extend(motions.of_body(body).zip(&local.dofs().unconstrained_modes).map(column));
        }
        let space = Rc::new(Self {
            bodies,
            points,
            columns,
            rows: rows.of_columns(length, |i| i.checked_sub(first).filter(|i| *i < length)),
            exchange: model.exchange.clone(),
        });
        let with = move |springs: &[f64]| {
            let factor = space.motions().springs(springs).factor();
            Box::new(WithSprings { space: space.clone(), springs: springs.to_vec(), factor }) as Box<dyn Subspace>
        };
        Some(Box::new(with))
    }

    /// Return the rigid motions of all bodies.
    fn motions(&self) -> Motions<'_> {
        motions_of(&self.bodies, &self.points)
    }
}

/// Return the contact rows and motions of a body in the matrix, which does not have those of rigid parts.
fn of_body(slot: &BodySlot) -> (Vec<Segment>, Vec<Motion>) {
    (slot.segments.clone(), if slot.is_rigid { Vec::new() } else { slot.free_motions().to_vec() })
}

fn motions_of<'m>(bodies: &'m [(Vec<Segment>, Vec<Motion>)], points: &[usize]) -> Motions<'m> {
    Motions::new(bodies.iter().map(|(segments, motions)| (&segments[..], &motions[..])), points)
}

/// The space for one set of springs D.
struct WithSprings {
    space: Rc<RigidSpace>,
    /// The diagonal of D, one entry a contact point.
    springs: Vec<f64>,
    /// Z'HZ.
    factor: Rc<Factor>,
}

impl Subspace for WithSprings {
    /// Add Z y to a solution z of H z = r, with Z'HZ y = Z'(r - H z).
    fn correct(&self, r: &[f64], z: &mut [f64]) -> Result<(), petsc::Error> {
        let space = &self.space;
        // this rank has one term of B z, and of its work
        let mut force = vec![0.0; space.rows.rows()];
        space.rows.multiply(z, &mut force);
        force.iter_mut().zip(&self.springs).for_each(|(force, spring)| *force *= spring);
        let mut work: DVector<f64> = -space.motions().work(&force);
        for MotionColumn { motion, first, values } in &space.columns {
            work[*motion] += dot(values, &r[*first..]);
        }
        space.exchange.sum(work.as_mut_slice());
        let y = self.factor.solve(&work);
        for MotionColumn { motion, first, values } in &space.columns {
            axpy(y[*motion], values, &mut z[*first..]);
        }
        Ok(())
    }
}
