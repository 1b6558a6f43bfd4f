//! Free rigid motions of the bodies as a coarse space of the matrix H = K + B'DB of all bodies together, where D are springs at the contact points.
//!
//! Many bodies on each other are a frame whose joints are layers. No smoother reduces errors in which the frame moves as a whole, and coarse levels of
//! multigrid do so only as far as they have the rigid motions of each body. A Robin sweep passes information only from a body to its neighbours. So H is
//! solved exactly in the space of all free rigid motions, which are the columns of Z (balancing: Mandel, Comm. Numer. Meth. Engng 9, 1993). Since K Z = 0,
//! HZ = B'D BZ takes only sums over contact points. Z'HZ has one block for each body and one for each two bodies in contact. Motions that no spring resists
//! are left out.

use super::rigid::Motions;
use super::{Exchange, Model, Motion, Segment};
use crate::linalg::{Factor, axpy, dot, fit};
use nalgebra::DVector;
use std::rc::Rc;

/// The matrix Z, in the vectors of an iterative solver on this rank.
pub struct Space {
    /// Contact rows and motions of each body.
    bodies: Vec<(Vec<Segment>, Vec<Motion>)>,
    /// Number of points of each pair.
    points: Vec<usize>,
    /// The columns of Z for the local bodies.
    columns: Vec<Column>,
    exchange: Rc<dyn Exchange>,
}

/// A column of Z: the entries of one rigid motion in one vector.
struct Column {
    /// Number of the motion among those of all bodies.
    motion: usize,
    /// Number of the vector.
    vector: usize,
    /// First entry in that vector.
    first: usize,
    values: Vec<f64>,
}

impl Space {
    /// Return the space for the bodies of a model. Without an `offset`, there is one vector for each body: its state, whose last entries are rigid motions.
    /// With one, there is a single vector, in which motions are displacements of nodes; `offset` is the first entry of each body, and the length.
    pub fn of(model: &Model, offset: Option<&[usize]>) -> Self {
        let (mut columns, mut first_motion) = (Vec::new(), 0);
        for (body, slot) in model.bodies.iter().enumerate() {
            let numbers = first_motion..;
            first_motion += slot.motions.len();
            let Some(local) = &slot.local else { continue };
            let Some(matrices) = local.matrices() else { continue };
            for (motion, Motion { trace, .. }) in numbers.zip(&slot.motions) {
                let amounts = fit(matrices.traces, trace);
                columns.push(match offset {
                    None => Column { motion, vector: body, first: local.len() - amounts.len(), values: amounts },
                    Some(offset) => {
                        let mut values = vec![0.0; offset[body + 1] - offset[body]];
                        amounts.iter().zip(matrices.motions).for_each(|(a, shape)| axpy(*a, shape, &mut values));
                        Column { motion, vector: 0, first: offset[body], values }
                    }
                });
            }
        }
        let bodies = model.bodies.iter().map(|slot| (slot.segments.clone(), slot.motions.clone())).collect();
        let points = (0..model.pairs.len()).map(|pair| model.range(pair).len()).collect();
        Self { bodies, points, columns, exchange: model.exchange.clone() }
    }

    /// Return the rigid motions of all bodies.
    fn motions(&self) -> Motions<'_> {
        Motions::new(self.bodies.iter().map(|(segments, motions)| (&segments[..], &motions[..])), &self.points)
    }
}

/// The coarse space for one set of springs D.
pub struct Coarse {
    space: Rc<Space>,
    springs: Vec<f64>,
    factor: Factor,
}

impl Coarse {
    /// Factor Z'HZ for `springs`, the diagonal of D, one entry a contact point.
    pub fn new(space: Rc<Space>, springs: &[f64]) -> Self {
        let factor = space.motions().springs(springs).factor();
        Self { space, springs: springs.to_vec(), factor }
    }

    /// Return the amounts y of the solution in the space, with Z'HZ y = Z'r, and its squared energy norm. One message.
    pub fn solve(&self, r: &[impl AsRef<[f64]>]) -> (DVector<f64>, f64) {
        let mut work = self.local_work(r);
        self.space.exchange.sum(work.as_mut_slice());
        let y = self.factor.solve(&work);
        let energy = y.dot(&work);
        (y, energy)
    }

    /// Return Z'r, of the vectors of this rank alone.
    fn local_work(&self, r: &[impl AsRef<[f64]>]) -> DVector<f64> {
        let motions = self.space.bodies.iter().map(|(_, motions)| motions.len()).sum();
        let mut work = DVector::zeros(motions);
        for Column { motion, vector, first, values } in &self.space.columns {
            work[*motion] += dot(values, &r[*vector].as_ref()[*first..]);
        }
        work
    }

    /// Return the work Z'H z of a vector z on the motions, from its closings B z at the points, n.
    fn work(&self, closing: &[f64]) -> DVector<f64> {
        let force: Vec<f64> = self.springs.iter().zip(closing).map(|(spring, s)| spring * s).collect();
        self.space.motions().work(&force)
    }

    /// Return the amounts y of the part that a vector z has in the space, with Z'HZ y = Z'H z, from its closings B z at the points, n.
    pub fn part(&self, closing: &[f64]) -> DVector<f64> {
        self.factor.solve(&self.work(closing))
    }

    /// Return the amounts y that correct z as a solution of H z = r, with Z'HZ y = Z'(r - H z). Each rank has one term of the sum B z over ranks,
    /// n, as `closing`. One message.
    pub fn correction(&self, r: &[f64], closing: &[f64]) -> DVector<f64> {
        let mut work = self.local_work(&[r]) - self.work(closing);
        self.space.exchange.sum(work.as_mut_slice());
        self.factor.solve(&work)
    }

    /// Return D B Z y, the forces of the springs at the points.
    pub fn forces(&self, y: &DVector<f64>) -> Vec<f64> {
        self.springs.iter().zip(self.space.motions().closing(y)).map(|(spring, s)| spring * s).collect()
    }

    /// Add s Z y to x.
    pub fn add(&self, s: f64, y: &DVector<f64>, x: &mut [impl AsMut<[f64]>]) {
        for Column { motion, vector, first, values } in &self.space.columns {
            axpy(s * y[*motion], values, &mut x[*vector].as_mut()[*first..]);
        }
    }
}
