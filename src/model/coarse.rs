//! Free rigid motions of the bodies as a coarse space of the matrix H = K + B'DB of all bodies together, D being springs at the points.
//!
//! Many bodies on each other are a frame whose joints are layers. How it moves as a whole is seen by no smoother, and by the coarse levels of
//! multigrid only as far as these have the rigid motions of each body; a sweep tells a body of its neighbours alone. So H is solved exactly in
//! the space of all free rigid motions, the columns of Z (balancing: Mandel, Comm. Numer. Meth. Engng 9, 1993). As K Z = 0, HZ = B'D BZ:
//! sums over contact points. Z'HZ has a block a body and one for two bodies in contact; motions that no spring feels are left out.

use super::rigid::{Motions, TOLERANCE};
use super::{Exchange, Model, Motion, Segment};
use crate::linalg::{Factor, axpy, dot, fit};
use nalgebra::DVector;
use std::rc::Rc;

/// Z, in the numbers that an iterative solver works with here.
pub struct Space {
    /// Contact rows and motions of each body.
    bodies: Vec<(Vec<Segment>, Vec<Motion>)>,
    /// Points of each pair.
    points: Vec<usize>,
    columns: Vec<Column>,
    exchange: Rc<dyn Exchange>,
}

/// A column of Z: numbers of one vector here.
struct Column {
    motion: usize,
    vector: usize,
    first: usize,
    values: Vec<f64>,
}

impl Space {
    /// Of the bodies of a model. Vectors are the states of the bodies, whose last numbers are rigid motions; or, with an `offset` for each body
    /// and the end, they are one, in which motions are displacements of nodes.
    pub fn of(model: &Model, offset: Option<&[usize]>) -> Self {
        let (mut columns, mut motion) = (Vec::new(), 0);
        for (body, slot) in model.bodies.iter().enumerate() {
            let local = slot.local.as_ref().and_then(|local| Some((local.len(), local.matrices()?)));
            for (own, motion) in slot.motions.iter().zip(motion..) {
                let Some((end, matrices)) = &local else { continue };
                let amounts = fit(matrices.traces, &own.trace);
                columns.push(match offset {
                    None => Column { motion, vector: body, first: end - amounts.len(), values: amounts },
                    Some(offset) => {
                        let mut values = vec![0.0; offset[body + 1] - offset[body]];
                        amounts.iter().zip(matrices.motions).for_each(|(a, motion)| axpy(*a, motion, &mut values));
                        Column { motion, vector: 0, first: offset[body], values }
                    }
                });
            }
            motion += slot.motions.len();
        }
        let bodies = model.bodies.iter().map(|slot| (slot.segments.clone(), slot.motions.clone())).collect();
        let points = (0..model.pairs.len()).map(|pair| model.range(pair).len()).collect();
        Self { bodies, points, columns, exchange: model.exchange.clone() }
    }

    fn motions(&self) -> Motions<'_> {
        Motions::new(self.bodies.iter().map(|(segments, motions)| (&segments[..], &motions[..])), &self.points)
    }
}

/// The coarse space with springs D, one entry a contact point.
pub struct Coarse {
    space: Rc<Space>,
    springs: Vec<f64>,
    factor: Factor,
}

impl Coarse {
    /// Factors Z'HZ.
    pub fn new(space: Rc<Space>, springs: &[f64]) -> Self {
        let factor = space.motions().springs(springs).factor(TOLERANCE);
        Self { space, springs: springs.to_vec(), factor }
    }

    /// The amounts y of the solution in the space, Z'HZ y = Z'r, with its squared energy norm. One message.
    pub fn solve(&self, r: &[impl AsRef<[f64]>]) -> (DVector<f64>, f64) {
        let motions = self.space.bodies.iter().map(|(_, motions)| motions.len()).sum();
        let mut work = DVector::zeros(motions);
        for Column { motion, vector, first, values } in &self.space.columns {
            work[*motion] += dot(values, &r[*vector].as_ref()[*first..]);
        }
        self.space.exchange.sum(work.as_mut_slice());
        let y = self.factor.solve(&work);
        let energy = y.dot(&work);
        (y, energy)
    }

    /// The amounts of what a vector with these closings, n, has in the space: Z'HZ y = Z'H z. A message if each rank has a share of them.
    pub fn part(&self, closing: &[f64], shared: bool) -> DVector<f64> {
        let force: Vec<f64> = self.springs.iter().zip(closing).map(|(spring, s)| spring * s).collect();
        let mut work = self.space.motions().work(&force);
        if shared {
            self.space.exchange.sum(work.as_mut_slice());
        }
        self.factor.solve(&work)
    }

    /// D B Z y: forces of the springs at the points.
    pub fn forces(&self, y: &DVector<f64>) -> Vec<f64> {
        self.springs.iter().zip(self.space.motions().closing(y)).map(|(spring, s)| spring * s).collect()
    }

    /// x += s Z y.
    pub fn add(&self, s: f64, y: &DVector<f64>, x: &mut [impl AsMut<[f64]>]) {
        for Column { motion, vector, first, values } in &self.space.columns {
            axpy(s * y[*motion], values, &mut x[*vector].as_mut()[*first..]);
        }
    }
}
