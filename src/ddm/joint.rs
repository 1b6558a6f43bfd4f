//! The free rigid motions of all bodies together, as the contact points feel them: closings B E of the motions E.
//!
//! Motions are numbered through body by body. As K E = 0, what is asked of them here are sums over contact points.

use super::model::{Model, Motion, Segment};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// The free rigid motions of all bodies.
pub struct Joint<'a> {
    /// First motion of each body, and the number of all.
    first: Vec<usize>,
    /// For each pair its points among all, and what it feels: number of a motion, its trace there.
    pairs: Vec<(Range<usize>, Vec<Felt<'a>>)>,
}

/// Number of a motion, and its trace on a pair.
type Felt<'a> = (usize, &'a [f64]);

impl<'a> Joint<'a> {
    /// Of bodies with these contact rows and free motions; `points` are the points of each pair.
    pub fn new(bodies: impl IntoIterator<Item = (&'a [Segment], &'a [Motion])>, points: &[usize]) -> Self {
        let mut first = vec![0];
        let mut next = 0;
        let range = |&count: &usize| {
            next += count;
            (next - count..next, Vec::new())
        };
        let mut pairs: Vec<(Range<usize>, Vec<Felt>)> = points.iter().map(range).collect();
        for (segments, motions) in bodies {
            let number = first[first.len() - 1];
            let mut row = 0;
            for segment in segments {
                let (range, felt) = &mut pairs[segment.pair];
                let rows = row..row + range.len();
                row = rows.end;
                felt.extend(motions.iter().enumerate().map(|(i, motion)| (number + i, &motion.trace[rows.clone()])));
            }
            first.push(number + motions.len());
        }
        Self { first, pairs }
    }

    /// Of the bodies of a model.
    pub fn of(model: &'a Model) -> Self {
        let points: Vec<usize> = (0..model.pairs.len()).map(|pair| model.range(pair).len()).collect();
        Self::new(model.bodies.iter().map(|slot| (&slot.segments[..], &slot.motions[..])), &points)
    }

    /// Number of all motions.
    pub fn count(&self) -> usize {
        self.first[self.first.len() - 1]
    }

    /// Motions of a body.
    pub fn of_body(&self, body: usize) -> Range<usize> {
        self.first[body]..self.first[body + 1]
    }

    /// (B E)' diag(`weight`) (B E), for springs at the points.
    pub fn stiffness(&self, weight: &[f64]) -> DMatrix<f64> {
        let mut stiffness = DMatrix::zeros(self.count(), self.count());
        for (range, felt) in &self.pairs {
            let weight = &weight[range.clone()];
            for &(i, u) in felt {
                for &(j, v) in felt {
                    stiffness[(i, j)] += (0..weight.len()).map(|q| weight[q] * u[q] * v[q]).sum::<f64>();
                }
            }
        }
        stiffness
    }

    /// B E `amounts`: what each point closes by.
    pub fn closing(&self, amounts: &DVector<f64>) -> Vec<f64> {
        let mut closing = vec![0.0; self.pairs.last().map_or(0, |(range, _)| range.end)];
        for (range, felt) in &self.pairs {
            for &(i, trace) in felt.iter().filter(|(i, _)| amounts[*i] != 0.0) {
                crate::linalg::axpy(amounts[i], trace, &mut closing[range.clone()]);
            }
        }
        closing
    }

    /// The trace of E `amounts`, for the model whose motions these are.
    pub fn trace(&self, model: &Model, amounts: &DVector<f64>) -> Vec<f64> {
        let mut trace = vec![0.0; 2 * model.points()];
        for (body, slot) in model.bodies.iter().enumerate() {
            let mut rows = vec![0.0; slot.row_stiffness.len()];
            let own = self.of_body(body).map(|i| amounts[i]);
            slot.motions.iter().zip(own).for_each(|(motion, a)| crate::linalg::axpy(a, &motion.trace, &mut rows));
            model.put(body, &rows, &mut trace);
        }
        trace
    }

    /// (B E)' `force`: work of forces at the points on each motion.
    pub fn work(&self, force: &[f64]) -> DVector<f64> {
        let mut work = DVector::zeros(self.count());
        for (range, felt) in &self.pairs {
            felt.iter().for_each(|&(i, trace)| work[i] += crate::linalg::dot(trace, &force[range.clone()]));
        }
        work
    }

    /// B E point by point: the motions that a point feels, and what they close there.
    pub fn columns(&self) -> Vec<Vec<(usize, f64)>> {
        let of = |(range, felt): &(Range<usize>, Vec<Felt>)| {
            let at = |q: usize| felt.iter().map(|&(i, trace)| (i, trace[q])).filter(|(_, t)| *t != 0.0).collect();
            (0..range.len()).map(at).collect::<Vec<_>>()
        };
        self.pairs.iter().flat_map(of).collect()
    }
}
