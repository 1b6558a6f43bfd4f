//! The free rigid motions of all bodies together, as the contact points feel them: closings B E of the motions E.
//!
//! Motions are numbered through body by body. As K E = 0, what is asked of them here are sums over contact points. Which of their
//! combinations nothing holds is the kernel of [`Motions::springs`]; [`TOLERANCE`] says what is nothing.

use super::{BodySlot, Field, Model, Motion, Segment};
use crate::linalg::{Blocks, axpy, dot, fit};
pub use crate::linalg::{PART, TOLERANCE};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// The free rigid motions of all bodies.
pub struct Motions<'a> {
    /// First motion of each body, and the number of all.
    first: Vec<usize>,
    /// Motions of each body.
    bodies: Vec<&'a [Motion]>,
    /// For each pair its points among all, and the bodies at its sides.
    pairs: Vec<(Range<usize>, Vec<End<'a>>)>,
}

/// A body at one side of a pair.
struct End<'a> {
    body: usize,
    /// The trace of each of its motions there; `None` if the pair does not feel the motion.
    traces: Vec<Option<&'a [f64]>>,
}

/// A motion of one body, in the words of its motions: "translation along x with rotation".
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Moved {
    /// Number of the body.
    pub body: usize,
    /// Name of the motion.
    pub name: String,
}

impl<'a> Motions<'a> {
    /// Of bodies with these contact rows and free motions; `points` are the points of each pair.
    pub fn new(bodies: impl IntoIterator<Item = (&'a [Segment], &'a [Motion])>, points: &[usize]) -> Self {
        let (mut first, mut all) = (vec![0], Vec::new());
        let mut next = 0;
        let range = |&count: &usize| {
            next += count;
            (next - count..next, Vec::new())
        };
        let mut pairs: Vec<(Range<usize>, Vec<End>)> = points.iter().map(range).collect();
        for (body, (segments, motions)) in bodies.into_iter().enumerate() {
            let mut row = 0;
            for segment in segments {
                let (range, ends) = &mut pairs[segment.pair];
                let rows = row..row + range.len();
                row = rows.end;
                // what slides along a surface closes it by rounding errors: their squares must not pass for stiffness
                let felt = |trace: &&[f64]| trace.iter().any(|t| t * t > TOLERANCE);
                let traces = motions.iter().map(|motion| Some(&motion.trace[rows.clone()]).filter(felt)).collect();
                ends.push(End { body, traces });
            }
            first.push(first[body] + motions.len());
            all.push(motions);
        }
        Self { first, bodies: all, pairs }
    }

    /// Of the bodies of a model: motions that neither supports nor springs hold.
    pub fn of(model: &'a Model) -> Self {
        Self::of_model(model, |slot| &slot.motions)
    }

    /// Of the bodies of a model: motions that supports leave, with those that springs to the ground resist.
    pub fn with_springs(model: &'a Model) -> Self {
        Self::of_model(model, |slot| slot.sprung.as_ref().map_or(&slot.motions, |sprung| &sprung.motions))
    }

    fn of_model(model: &'a Model, motions: impl Fn(&'a BodySlot) -> &'a Vec<Motion>) -> Self {
        let points: Vec<usize> = (0..model.pairs.len()).map(|pair| model.range(pair).len()).collect();
        Self::new(model.bodies.iter().map(|slot| (&slot.segments[..], &motions(slot)[..])), &points)
    }

    /// Motions of each body.
    pub fn bodies(&self) -> &[&'a [Motion]] {
        &self.bodies
    }

    /// Number of all motions.
    pub fn count(&self) -> usize {
        self.first[self.first.len() - 1]
    }

    /// Motions of a body.
    pub fn of_body(&self, body: usize) -> Range<usize> {
        self.first[body]..self.first[body + 1]
    }

    /// The body of a motion.
    pub fn body_of(&self, motion: usize) -> usize {
        self.first.partition_point(|&first| first <= motion) - 1
    }

    /// Zero, with a row of blocks a body.
    pub fn blocks(&self) -> Blocks {
        Blocks::new(&self.first.windows(2).map(|ends| ends[1] - ends[0]).collect::<Vec<usize>>())
    }

    /// (B E)' diag(`weight`) (B E), for springs at the points, one entry a point: a block a body.
    pub fn springs(&self, weight: &[f64]) -> Blocks {
        let mut springs = self.blocks();
        for (range, ends) in &self.pairs {
            let weight = &weight[range.clone()];
            let pulled = |trace: &[f64]| trace.iter().zip(weight).map(|(t, w)| t * w).collect::<Vec<f64>>();
            let pulled: Vec<Vec<Option<Vec<f64>>>> =
                ends.iter().map(|end| end.traces.iter().map(|trace| trace.map(pulled)).collect()).collect();
            let block = |s: usize, t: usize| {
                DMatrix::from_fn(ends[s].traces.len(), ends[t].traces.len(), |i, j| {
                    pulled[s][i].as_ref().zip(ends[t].traces[j]).map_or(0.0, |(pulled, trace)| dot(pulled, trace))
                })
            };
            for s in 0..ends.len() {
                for t in s..ends.len() {
                    let (i, j) = (ends[s].body, ends[t].body);
                    let block = block(s, t);
                    // a body may be at both sides
                    springs.add(i, j, &if i == j && s != t { &block + block.transpose() } else { block });
                }
            }
        }
        springs
    }

    /// B E `amounts`: what each point closes by.
    pub fn closing(&self, amounts: &DVector<f64>) -> Vec<f64> {
        let mut closing = vec![0.0; self.pairs.last().map_or(0, |(range, _)| range.end)];
        for (range, motion, trace) in self.felt() {
            if amounts[motion] != 0.0 {
                axpy(amounts[motion], trace, &mut closing[range.clone()]);
            }
        }
        closing
    }

    /// The trace of E `amounts`, for the model whose motions these are.
    pub fn trace(&self, model: &Model, amounts: &DVector<f64>) -> Vec<f64> {
        let mut trace = vec![0.0; 2 * model.points()];
        for (body, motions) in self.bodies.iter().enumerate() {
            let Some(motion) = motions.first() else { continue };
            let mut rows = vec![0.0; motion.trace.len()];
            let own = self.of_body(body).map(|i| amounts[i]);
            motions.iter().zip(own).for_each(|(motion, a)| axpy(a, &motion.trace, &mut rows));
            model.put(body, &rows, &mut trace);
        }
        trace
    }

    /// E `amounts` of the bodies that live here, for the model whose motions these are; traces of all.
    pub fn field(&self, model: &Model, amounts: &DVector<f64>) -> Field {
        let mut field = Field::zero(model);
        field.trace = self.trace(model, amounts);
        for (body, slot) in model.bodies.iter().enumerate() {
            let Some(matrices) = slot.local.as_ref().and_then(|body| body.matrices()) else { continue };
            // a state ends with its rigid motions
            let own = fit(matrices.traces, &model.of_body(body, &field.trace));
            let state = &mut field.states[body];
            let deformation = state.len() - own.len();
            state[deformation..].copy_from_slice(&own);
        }
        field
    }

    /// Work of the loads on each motion.
    pub fn loads(&self) -> DVector<f64> {
        DVector::from_iterator(self.count(), self.bodies.iter().copied().flatten().map(|motion| motion.work))
    }

    /// (B E)' `force`: work of forces at the points on each motion.
    pub fn work(&self, force: &[f64]) -> DVector<f64> {
        let mut work = DVector::zeros(self.count());
        self.felt().for_each(|(range, motion, trace)| work[motion] += dot(trace, &force[range.clone()]));
        work
    }

    /// |(B E)'| |`force`|: what forces at the points, of any signs, could do on each motion.
    pub fn sizes(&self, force: &[f64]) -> DVector<f64> {
        let mut sizes = DVector::zeros(self.count());
        let size = |trace: &[f64], range: &Range<usize>| -> f64 {
            trace.iter().zip(&force[range.clone()]).map(|(t, f)| (t * f).abs()).sum()
        };
        self.felt().for_each(|(range, motion, trace)| sizes[motion] += size(trace, range));
        sizes
    }

    /// What pairs feel: points, number of the motion, its trace there.
    fn felt(&self) -> impl Iterator<Item = (&Range<usize>, usize, &'a [f64])> {
        self.pairs.iter().flat_map(move |(range, ends)| {
            ends.iter().flat_map(move |end| {
                let numbers = self.of_body(end.body);
                numbers.zip(&end.traces).filter_map(move |(motion, trace)| trace.map(|trace| (range, motion, trace)))
            })
        })
    }

    /// The bodies that a combined motion moves, and how.
    pub fn names(&self, amounts: &DVector<f64>) -> Vec<Moved> {
        let least = PART * amounts.amax();
        let of_body = |(body, motions): (usize, &&[Motion])| {
            let own = amounts.rows(self.first[body], motions.len());
            let moves = own.amax() > least;
            let name = combined(motions.iter().map(|motion| &motion.name[..]), own.iter().copied());
            moves.then_some(Moved { body, name })
        };
        self.bodies.iter().enumerate().filter(|(_, motions)| !motions.is_empty()).filter_map(of_body).collect()
    }
}

/// The name of a combination of motions: of those that matter in it.
pub fn combined<'n>(names: impl Iterator<Item = &'n str>, amounts: impl Iterator<Item = f64> + Clone) -> String {
    let least = PART * amounts.clone().fold(0.0, |most: f64, amount| most.max(amount.abs()));
    let parts = names.zip(amounts).filter(|(_, amount)| amount.abs() > least);
    crate::error::joined(parts.map(|(name, _)| name))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion(name: &str, trace: &[f64]) -> Motion {
        Motion { name: name.into(), trace: trace.to_vec(), work: 0.0 }
    }

    /// Two blocks side by side on the ground, pair 0 between them; the second has a rounding error in what it slides by.
    #[test]
    fn springs_are_those_that_points_feel() {
        let segment = |pair, side| Segment { pair, side };
        let segments = [vec![], vec![segment(0, 0), segment(1, 0)], vec![segment(0, 1), segment(2, 0)]];
        let motions = [
            vec![],
            vec![motion("x", &[1.0, 1.0, 0.0, 0.0]), motion("y", &[0.0, 0.0, 1.0, 1.0])],
            vec![motion("x", &[-1.0, -1.0, 1e-9, 0.0]), motion("y", &[0.0, 0.0, 1.0, 1.0])],
        ];
        let bodies = segments.iter().zip(&motions).map(|(segments, motions)| (&segments[..], &motions[..]));
        let motions = Motions::new(bodies, &[2, 2, 2]);
        assert_eq!((motions.count(), motions.of_body(0), motions.of_body(2)), (4, 0..0, 2..4));
        let springs = motions.springs(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let amounts = DVector::from_vec(vec![1.0, 10.0, 100.0, 1000.0]);
        let forces = springs.multiply(&amounts);
        assert_eq!(forces.as_slice(), [-297.0, 70.0, 297.0, 11000.0]);
        let closing = motions.closing(&amounts);
        assert_eq!(closing, [-99.0, -99.0, 10.0, 10.0, 1000.0, 1000.0]);
        let pulled: Vec<f64> = closing.iter().zip(1..).map(|(c, w)| c * f64::from(w)).collect();
        assert_eq!(motions.work(&pulled), forces);
        // both slide along the ground together
        let kernel = springs.factor(TOLERANCE).kernel();
        assert_eq!(kernel, [DVector::from_vec(vec![1.0, 0.0, 1.0, 0.0])]);
        assert_eq!(combined(["x", "y"].into_iter(), [1.0, 1e-7].into_iter()), "x");
        assert_eq!(combined(["x", "y"].into_iter(), [-0.1, 1.0].into_iter()), "x with y");
    }
}
