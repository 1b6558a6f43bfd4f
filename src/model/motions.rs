//! The free rigid motions E of all bodies together, as they close the contact points: B E.
//!
//! Motions are numbered consecutively, body by body. Since K E = 0, E'(K + B'DB) z takes only sums over contact points.
//! Combinations that no contact resists are the kernel of [`Motions::springs`], up to [`TOLERANCE`].

use super::{BodySlot, Model, Motion, Segment};
use crate::linalg::{Blocks, axpy, dot};
pub use crate::linalg::{PART, TOLERANCE};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// The free rigid motions of all bodies.
pub struct Motions<'a> {
    /// First motion of each body, and the number of all.
    first: Vec<usize>,
    /// Motions of each body.
    bodies: Vec<&'a [Motion]>,
    /// The bodies at the sides of each pair.
    pairs: Vec<Vec<PairSide<'a>>>,
    /// Number of the points of all pairs.
    points: usize,
}

/// A body at one side of a pair.
struct PairSide<'a> {
    body: usize,
    /// Numbers of the points of the pair.
    points: Range<usize>,
    /// The trace of each of its motions there; `None` if the motion only slides along the surface.
    traces: Vec<Option<&'a [f64]>>,
}

/// A combined motion of one body, named after the motions that it combines: "translation along x and rotation".
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedMotion {
    /// Number of the body.
    pub body: usize,
    /// Name of the motion.
    pub name: String,
}

impl<'a> Motions<'a> {
    /// Return the motions of bodies with these contact rows and free motions. `points` are the numbers of points of the
    /// pairs.
    pub fn new(bodies: impl IntoIterator<Item = (&'a [Segment], &'a [Motion])>, points: &[usize]) -> Self {
        let (mut first, mut all, mut next) = (vec![0], Vec::new(), 0);
        let mut pairs: Vec<Vec<PairSide>> = points.iter().map(|_| Vec::new()).collect();
        let points: Vec<Range<usize>> = points
            .iter()
            .map(|count| {
                next += count;
                next - count..next
            })
            .collect();
        for (body, (segments, motions)) in bodies.into_iter().enumerate() {
            let mut row = 0;
            for segment in segments {
                let points = points[segment.pair].clone();
                let rows = row..row + points.len();
                row = rows.end;
                // sliding along a surface closes points by rounding errors, whose squares must not count as stiffness
                let closes = |trace: &&[f64]| trace.iter().any(|t| t * t > TOLERANCE);
                let traces = motions.iter().map(|motion| Some(&motion.trace[rows.clone()]).filter(closes)).collect();
                pairs[segment.pair].push(PairSide { body, points, traces });
            }
            first.push(first[body] + motions.len());
            all.push(motions);
        }
        Self { first, bodies: all, pairs, points: next }
    }

    /// Return the motions of a model's bodies that neither supports nor springs constrain.
    pub fn of(model: &'a Model) -> Self {
        Self::of_model(model, BodySlot::free_motions)
    }

    /// Return the motions of a model's bodies that supports leave free, with those that springs to the ground resist.
    pub fn all(model: &'a Model) -> Self {
        Self::of_model(model, |slot| &slot.motions)
    }

    fn of_model(model: &'a Model, motions: impl Fn(&'a BodySlot) -> &'a [Motion]) -> Self {
        let points: Vec<usize> = (0..model.pairs.len()).map(|pair| model.range(pair).len()).collect();
        Self::new(model.bodies.iter().map(|slot| (&slot.segments[..], motions(slot))), &points)
    }

    /// Return the number of all motions.
    pub fn count(&self) -> usize {
        self.first[self.first.len() - 1]
    }

    /// Return the numbers of the motions of a body.
    pub fn of_body(&self, body: usize) -> Range<usize> {
        self.first[body]..self.first[body + 1]
    }

    /// Return a zero matrix with a row and column of blocks for each body.
    pub fn blocks(&self) -> Blocks {
        Blocks::new(&self.first.windows(2).map(|ends| ends[1] - ends[0]).collect::<Vec<usize>>())
    }

    /// Return the stiffness E'KE of the springs to the ground. The matrix has a row and column of blocks for each body.
    pub fn ground(&self, model: &Model) -> Blocks {
        let mut ground = self.blocks();
        let sprung = model.bodies.iter().enumerate().filter(|(_, slot)| slot.is_sprung());
        sprung.for_each(|(body, slot)| ground.add(body, body, &slot.ground));
        ground
    }

    /// Return (B E)' diag(`stiffness`) (B E) for springs at the points, one entry a point. The matrix has a row and
    /// column of blocks for each body.
    pub fn springs(&self, stiffness: &[f64]) -> Blocks {
        let mut springs = self.blocks();
        for sides in self.pairs.iter().filter(|sides| !sides.is_empty()) {
            let stiffness = &stiffness[sides[0].points.clone()];
            let force = |trace: &[f64]| trace.iter().zip(stiffness).map(|(t, k)| t * k).collect::<Vec<f64>>();
            let forces: Vec<Vec<Option<Vec<f64>>>> =
                sides.iter().map(|side| side.traces.iter().map(|trace| trace.map(force)).collect()).collect();
            let block = |s: usize, t: usize| {
                DMatrix::from_fn(sides[s].traces.len(), sides[t].traces.len(), |i, j| {
                    forces[s][i].as_ref().zip(sides[t].traces[j]).map_or(0.0, |(force, trace)| dot(force, trace))
                })
            };
            for s in 0..sides.len() {
                for t in s..sides.len() {
                    let (i, j) = (sides[s].body, sides[t].body);
                    let block = block(s, t);
                    // a body may be at both sides
                    springs.add(i, j, &if i == j && s != t { &block + block.transpose() } else { block });
                }
            }
        }
        springs
    }

    /// Return B E `amounts`, by which each point closes.
    pub fn closing(&self, amounts: &DVector<f64>) -> Vec<f64> {
        let mut closing = vec![0.0; self.points];
        self.traces().filter(|(_, motion, _)| amounts[*motion] != 0.0).for_each(|(points, motion, trace)| {
            axpy(amounts[motion], trace, &mut closing[points.clone()]);
        });
        closing
    }

    /// Return the amounts of the motions of each body.
    pub fn of_bodies(&self, amounts: &DVector<f64>) -> Vec<Vec<f64>> {
        self.first.windows(2).map(|ends| amounts.as_slice()[ends[0]..ends[1]].to_vec()).collect()
    }

    /// Return the trace vector of E `amounts`, for the model whose motions these are.
    pub fn trace(&self, model: &Model, amounts: &DVector<f64>) -> Vec<f64> {
        let mut trace = vec![0.0; 2 * model.points()];
        for (body, motions) in self.bodies.iter().enumerate() {
            let Some(motion) = motions.first() else { continue };
            let mut rows = vec![0.0; motion.trace.len()];
            let own = self.of_body(body).map(|i| amounts[i]);
            motions.iter().zip(own).for_each(|(motion, a)| axpy(a, &motion.trace, &mut rows));
            model.add(body, &rows, &mut trace);
        }
        trace
    }

    /// Return the work of the loads on each motion.
    pub fn loads(&self) -> DVector<f64> {
        DVector::from_iterator(self.count(), self.bodies.iter().copied().flatten().map(|motion| motion.work))
    }

    /// Return (B E)' `force`, the work of forces at the points on each motion.
    pub fn work(&self, force: &[f64]) -> DVector<f64> {
        let mut work = DVector::zeros(self.count());
        self.traces().for_each(|(points, motion, trace)| work[motion] += dot(trace, &force[points.clone()]));
        work
    }

    /// Return E'r for forces r on the dofs of the local bodies of a model, whose motions these are. One message.
    pub fn work_of(&self, model: &Model, r: &[Vec<f64>]) -> DVector<f64> {
        let mut work = DVector::zeros(self.count());
        for (index, body) in model.locals() {
            let modes = &body.dofs().unconstrained_modes;
            self.of_body(index).zip(modes).for_each(|(i, mode)| work[i] = dot(mode, &r[index]));
        }
        model.exchange.sum(work.as_mut_slice());
        work
    }

    /// Return |(B E)'| |`force`|, the work on each motion that forces at the points of any signs could do.
    pub fn sizes(&self, force: &[f64]) -> DVector<f64> {
        let mut sizes = DVector::zeros(self.count());
        self.traces().for_each(|(points, motion, trace)| {
            sizes[motion] += trace.iter().zip(&force[points.clone()]).map(|(t, f)| (t * f).abs()).sum::<f64>();
        });
        sizes
    }

    /// Return each trace by which a motion closes a pair: (points of the pair, number of the motion, its trace at these
    /// points).
    fn traces(&self) -> impl Iterator<Item = (&Range<usize>, usize, &'a [f64])> {
        self.pairs.iter().flatten().flat_map(move |side| {
            let traces = self.of_body(side.body).zip(&side.traces);
            traces.filter_map(move |(motion, trace)| trace.map(|trace| (&side.points, motion, trace)))
        })
    }

    /// Return the bodies that a combined motion moves, with the name of the motion of each.
    pub fn names(&self, amounts: &DVector<f64>) -> Vec<NamedMotion> {
        let least = PART * amounts.amax();
        let of_body = |(body, motions): (usize, &&[Motion])| {
            let own = amounts.rows(self.first[body], motions.len());
            let name = || combined(motions.iter().map(|motion| &motion.name[..]), own.iter().copied());
            (own.amax() > least).then(|| NamedMotion { body, name: name() })
        };
        self.bodies.iter().enumerate().filter(|(_, motions)| !motions.is_empty()).filter_map(of_body).collect()
    }
}

/// Return the trace vector (2n) of free motions of the bodies of a model by these amounts, one list a body.
pub fn trace(model: &Model, amounts: &[Vec<f64>]) -> Vec<f64> {
    Motions::of(model).trace(model, &DVector::from_vec(amounts.concat()))
}

/// Return the name of a combination of motions, from the names of those with an amount that matters.
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

    /// Two blocks lie side by side on the ground, with pair 0 between them. The trace by which the second slides on the
    /// ground has a rounding error.
    #[test]
    fn springs_are_those_of_motions_that_close_points() {
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
        let kernel = springs.factor().kernel();
        assert_eq!(kernel, [DVector::from_vec(vec![1.0, 0.0, 1.0, 0.0])]);
        assert_eq!(combined(["x", "y"].into_iter(), [1.0, 1e-7].into_iter()), "x");
        assert_eq!(combined(["x", "y"].into_iter(), [-0.1, 1.0].into_iter()), "x and y");
    }
}
