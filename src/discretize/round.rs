//! Rigid motions along a round surface, which only the facets of its mesh resist: the spin of a roller, of a ball, of a ring in a press fit.
//!
//! A normal of a meshed surface is the mean of the facets around it, and known up to the angle between them. So a motion m is free as far as the mesh can tell if
//!
//! ```text
//! |n_q . m(x_q)| <= s_q |m(x_q)|       at every contact point q of the body,
//! ```
//!
//! where s_q is the largest difference between unit normals of facets and nodes near q ([`Side::spread`](crate::contact::Side::spread)). The true normal lies
//! between the facets, so the motion of a round body along itself passes on every mesh. On flat facets s_q is zero and nothing but rounding passes.

use super::draft::Draft;
use super::part::Part;
use crate::contact::ContactPair;
use crate::fem::{RigidMotion, rigid};
use crate::linalg::{Blocks, TOLERANCE, dot};
use nalgebra::{DMatrix, DVector};

/// The contact points of a body.
pub struct Points<const D: usize> {
    /// Where their nodes are, measured from the datum.
    at: Vec<[f64; D]>,
    normal: Vec<[f64; D]>,
    /// How well normals are known: s_q.
    spread: Vec<f64>,
    /// Shares of the points in all of them.
    share: Vec<f64>,
}

impl<const D: usize> Points<D> {
    /// Collect the points of all pairs of a body.
    pub fn of(draft: &Draft<D>, parts: &[Part<D>], pairs: &[ContactPair]) -> Self {
        let mut points = Self { at: Vec::new(), normal: Vec::new(), spread: Vec::new(), share: Vec::new() };
        for pair in draft.segments.iter().map(|segment| &pairs[segment.pair]) {
            let nodes = &parts[pair.bodies[0]].space.nodes;
            points.at.extend(pair.nodes.iter().map(|&node| nodes[node as usize]));
            points.normal.extend(pair.normal.iter().map(|normal| std::array::from_fn::<f64, D, _>(|c| normal[c])));
            points.spread.extend(&pair.spread);
            points.share.extend(&pair.weight);
        }
        let all: f64 = points.share.iter().sum();
        points.share.iter_mut().for_each(|share| *share /= all);
        points
    }

    /// Return those combinations of motions that only facets resist, pure motions as such. They close less than a share `most` of themselves
    /// (the root of the mean of |n . m|^2 over that of |m|^2).
    pub fn along_surface(&self, motions: &[RigidMotion<D>], most: f64) -> Vec<RigidMotion<D>> {
        let [closing, size] = self.products(motions);
        let mut round = lowest(&closing, &size, most * most);
        round.retain(|weights| self.passes(&rigid::sum(motions, weights)));
        pure(&round).iter().map(|weights| rigid::combine(motions, weights)).collect()
    }

    /// Mean products of n . m_i and n . m_j, and of m_i and m_j.
    fn products(&self, motions: &[RigidMotion<D>]) -> [DMatrix<f64>; 2] {
        let count = motions.len();
        let [mut closing, mut size] = [(); 2].map(|()| DMatrix::zeros(count, count));
        for (q, x) in self.at.iter().enumerate() {
            let moved: Vec<[f64; D]> = motions.iter().map(|motion| motion.at(x)).collect();
            for (i, u) in moved.iter().enumerate() {
                for (j, v) in moved.iter().enumerate() {
                    closing[(i, j)] += self.share[q] * dot(u, &self.normal[q]) * dot(v, &self.normal[q]);
                    size[(i, j)] += self.share[q] * dot(u, v);
                }
            }
        }
        [closing, size]
    }

    /// Whether a motion closes no point by more than its normal is unsure.
    fn passes(&self, motion: &RigidMotion<D>) -> bool {
        self.at.iter().zip(&self.normal).zip(&self.spread).all(|((x, normal), spread)| {
            let moved = motion.at(x);
            dot(&moved, normal).abs() <= spread * dot(&moved, &moved).sqrt()
        })
    }
}

/// Eigenvectors x of A x = lambda B x with lambda <= `most`, B positive semidefinite; what B does not see is left out.
fn lowest(a: &DMatrix<f64>, b: &DMatrix<f64>, most: f64) -> Vec<DVector<f64>> {
    if b.is_empty() {
        return Vec::new();
    }
    let of_b = b.clone().symmetric_eigen();
    let seen = (0..b.nrows()).filter(|&k| of_b.eigenvalues[k] > TOLERANCE * of_b.eigenvalues.amax());
    let basis: Vec<_> = seen.map(|k| of_b.eigenvectors.column(k) / of_b.eigenvalues[k].sqrt()).collect();
    if basis.is_empty() {
        return Vec::new();
    }
    let basis = DMatrix::from_columns(&basis);
    let reduced = (basis.transpose() * a * &basis).symmetric_eigen();
    let low = (0..basis.ncols()).filter(|&k| reduced.eigenvalues[k] <= most);
    low.map(|k| &basis * reduced.eigenvectors.column(k)).collect()
}

/// A basis of the span of some vectors in which pure motions come out pure.
fn pure(vectors: &[DVector<f64>]) -> Vec<DVector<f64>> {
    if vectors.is_empty() {
        return Vec::new();
    }
    let span = DMatrix::from_columns(vectors).qr().q();
    let off = DMatrix::identity(span.nrows(), span.nrows()) - &span * span.transpose();
    Blocks::free(&off, 1.0, TOLERANCE)
}
