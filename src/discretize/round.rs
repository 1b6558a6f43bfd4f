//! Rigid motions along the own surface of a body, which contact cannot resist. Examples are the spin of a roller, of a ball, or
//! of a ring in a press fit, and a block that slides on rollers. Such a motion is resisted only by the facets of the mesh. If
//! points lie on the other surface, the normals of that surface may resist it, too.
//!
//! A normal of a meshed surface is the mean of the facets around it, so it is uncertain by the angle between them. Therefore the
//! mesh cannot show that a motion m is resisted if
//!
//! ```text
//! |n_q . m(x_q)| <= 2 s_q |m(x_q)|       at every contact point q of the body,
//! ```
//!
//! where n_q is the normal at the point x_q, and s_q is the largest difference between unit normals of facets and nodes near q
//! ([`Side::spread`](crate::contact::Side::spread)). The true normal lies between the facets. So the motion of a round body along
//! itself has a quotient |n_q . m| / |m| of at most s_q on every mesh. That motion is found from the normals, weighted by 1/s_q,
//! and its own error is as large again. On flat facets s_q is rounding, and no motion passes that contact resists.

use super::interface::Interface;
use crate::contact::ContactPair;
use crate::fem::{RigidMotion, rigid};
use crate::linalg::{Blocks, TOLERANCE, dot};
use crate::model::Segment;
use nalgebra::{DMatrix, DVector};

/// Multiple of the difference between facets and their mean by which a motion may close a point: once for the normal, and once
/// for the motion itself.
const UNSURE: f64 = 2.0;

/// A contact point on the own surface of a body.
struct Point<const D: usize> {
    /// Position, measured from the datum.
    at: [f64; D],
    normal: [f64; D],
    /// Uncertainty s_q of the normal.
    spread: f64,
    /// Square root of the share of its area in the area of all points.
    root: f64,
}

/// The surface of a body at its contact points.
pub struct Points<const D: usize>(Vec<Point<D>>);

impl<const D: usize> Points<D> {
    /// Collect the points of all pairs of a body.
    pub fn of(interface: &Interface<D>, pairs: &[ContactPair]) -> Self {
        let weights = |segment: &Segment| pairs[segment.pair].weight.iter();
        let all: f64 = interface.segments.iter().flat_map(weights).sum();
        let first = |x: [f64; 3]| std::array::from_fn(|c| x[c]);
        let mut points = Vec::new();
        for segment in &interface.segments {
            let surface = pairs[segment.pair].surface[segment.side].iter();
            points.extend(surface.zip(weights(segment)).map(|(point, weight)| Point {
                at: first(point.at),
                normal: first(point.normal),
                spread: point.spread,
                root: (weight / all).sqrt(),
            }));
        }
        Self(points)
    }

    /// Return the combinations of motions that only facets resist. Pure motions are returned as such.
    pub fn along_surface(&self, motions: &[RigidMotion<D>]) -> Vec<RigidMotion<D>> {
        let rows = D * self.0.len();
        let moved = DMatrix::from_fn(rows, motions.len(), |row, j| {
            let point = &self.0[row / D];
            point.root * motions[j].at(&point.at)[row % D]
        });
        let closing = DMatrix::from_fn(self.0.len(), motions.len(), |q, j| {
            let Point { at, normal, spread, root } = &self.0[q];
            root * dot(&motions[j].at(at), normal) / spread
        });
        let mut round = lowest(&closing, &(moved.transpose() * &moved), UNSURE);
        round.retain(|weights| self.passes(&rigid::sum(motions, weights)));
        pure(&round).iter().map(|weights| rigid::combine(motions, weights)).collect()
    }

    /// Return whether the motion closes no point by more than its uncertainty allows.
    fn passes(&self, motion: &RigidMotion<D>) -> bool {
        self.0.iter().all(|point| {
            let moved = motion.at(&point.at);
            dot(&moved, &point.normal).abs() <= UNSURE * point.spread * dot(&moved, &moved).sqrt()
        })
    }
}

/// Return the right singular vectors x of A with |A x|^2 <= most^2 x'B x, where B is positive semidefinite. The kernel of B is
/// excluded.
fn lowest(a: &DMatrix<f64>, b: &DMatrix<f64>, most: f64) -> Vec<DVector<f64>> {
    // Decompositions of matrices with NaN or infinite entries do not terminate.
    if b.is_empty() || a.iter().chain(b).any(|value| !value.is_finite()) {
        return Vec::new();
    }
    let of_b = b.clone().symmetric_eigen();
    let seen = (0..b.nrows()).filter(|&k| of_b.eigenvalues[k] > TOLERANCE * of_b.eigenvalues.amax());
    let basis: Vec<_> = seen.map(|k| of_b.eigenvectors.column(k) / of_b.eigenvalues[k].sqrt()).collect();
    if basis.is_empty() {
        return Vec::new();
    }
    let basis = DMatrix::from_columns(&basis);
    // The product of A with itself would lose half of the digits, and weights differ by ten orders of magnitude.
    let triangle = (a * &basis).qr().r();
    let of_a = triangle.svd(false, true);
    let Some(right) = of_a.v_t else { return Vec::new() };
    let low = (0..right.nrows()).filter(|&k| of_a.singular_values[k] <= most);
    low.map(|k| &basis * right.row(k).transpose()).collect()
}

/// Return a basis of the span of some vectors in which pure motions are separate.
fn pure(vectors: &[DVector<f64>]) -> Vec<DVector<f64>> {
    if vectors.is_empty() {
        return Vec::new();
    }
    let span = DMatrix::from_columns(vectors).qr().q();
    let off = DMatrix::identity(span.nrows(), span.nrows()) - &span * span.transpose();
    Blocks::free(&off, 1.0, TOLERANCE)
}
