//! The errors of the pressures of pairs: between contact points, and at rims.

use crate::contact::law::Law;
use crate::contact::{FinePoint, FinePoints};
use crate::discretize::meshes::KeptMeshes;
use crate::linalg::axpy;
use crate::model::layer::meeting_slopes;
use crate::model::{Layer, Model};
use crate::problem::order::Order;
use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::ops::Range;

/// Factor on the errors of nodal values. Where a solution has a kink, recovery smooths it and underestimates the error.
/// The same factor is usual for errors extrapolated from three meshes (Roache 1994). With it, most estimates on machine
/// parts are 0.7 to 2 times the true errors; without it they would be 0.56 to 1.6 times.
pub(super) const SAFETY: f64 = 1.25;

/// A reason why the estimated error of a pair's pressures is a guess, since the mesh does not show how they vary, and a
/// place.
#[derive(Debug, Clone, Copy)]
pub struct Guess {
    /// The reason.
    pub cause: Cause,
    /// The place in the scene.
    pub place: [f64; 3],
}

/// The reasons for a guess.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// Most of the error is at an edge of the contact, where pressures may be singular. The place is that of the
    /// largest part.
    Rim,
    /// Contact ends within the facets that carry most of the pressure, so that they do not show how it varies. The
    /// place is that of the peak.
    FewFacets,
}

/// Relative error of the pressures below which an error at rims is no guess: a hundred times the default tolerance of
/// the iteration, at which differences within a facet are those of an unfinished iteration.
const UNFINISHED: f64 = 1e-6;

/// Least share of the squared pressure that facets in contact as a whole carry where a mesh resolves the contact. With
/// p^2 = 1 - r^2 of a contact of Hertz with the radius one, those within 1 - h carry 1 - (1 - (1 - h)^2)^2, a half for
/// a radius of 2.2 facets. On machine parts, the estimates of contacts with less were 0.6 to 4.6 times the true error.
const RESOLVED: f64 = 0.5;

/// The errors of the pressures at the contact points.
pub(super) struct PressureErrors {
    /// Error at each point, n: exact minus discrete.
    pub error: Vec<f64>,
    /// Relative error of each pair, with the factor [`SAFETY`].
    pub relative: Vec<f64>,
    /// The part of it on the facets at rims.
    pub ends: Vec<f64>,
    /// Place of the largest part of it.
    pub worst: Vec<[f64; 3]>,
    /// Why the error of each pair is a guess, if it is one.
    pub guesses: Vec<Option<Guess>>,
}

impl PressureErrors {
    /// Compute the errors from those of the compression, n.
    ///
    /// The response that gave these is that of springs at the closed points. So a point that opens or closes takes the
    /// resolvent of its law for the state in the response, as in a step of Newton's method. This allows for the bodies,
    /// which give way to the pressure of a point however stiff its layer is.
    pub fn new<const D: usize>(
        meshes: &KeptMeshes<D>,
        model: &Model,
        layer: &Layer,
        closing: &[f64],
        misfit: &[f64],
    ) -> Self {
        let compression: Vec<f64> = layer.compression.iter().zip(closing).map(|(c, more)| c + more).collect();
        let resolved = Layer::resolve(model, &compression, &layer.linear(&compression), &meeting_slopes(model), &[]);
        let mut error = resolved.pressure;
        axpy(-1.0, &layer.pressure, &mut error);
        axpy(1.0, misfit, &mut error);
        let mut errors = Self { error, relative: Vec::new(), ends: Vec::new(), worst: Vec::new(), guesses: Vec::new() };
        for pair in 0..model.pairs.len() {
            errors.add_pair(meshes.points(pair), model, layer, pair);
        }
        errors
    }

    /// Add the relative error of a pair, and why it is a guess.
    fn add_pair(&mut self, points: &FinePoints, model: &Model, layer: &Layer, index: usize) {
        let (position, range) = (&model.pairs[index].position, model.range(index));
        let (pressure, tangent) = (&layer.pressure[range.clone()], &layer.tangent[range.clone()]);
        let square = |values: &[f64]| -> f64 { range.clone().map(|q| model.area[q] * values[q] * values[q]).sum() };
        let (squared, whole) = (square(&self.error), square(&layer.pressure));
        let rim = RimError::new(points, softness(model, index), pressure, tangent);
        let at_rims: BTreeSet<usize> = (0..points.each.len())
            .filter(|&g| points.each[g].at_rim)
            .flat_map(|g| points.interpolation.row(g).map(|(q, _)| q))
            .collect();
        let of_points: f64 =
            at_rims.iter().map(|q| range.start + q).map(|q| model.area[q] * self.error[q].powi(2)).sum();
        let relative = |squared: f64| if squared == 0.0 { 0.0 } else { SAFETY * f64::sqrt(squared / whole) };
        self.relative.push(relative(squared + rim.squared));
        self.ends.push(relative(of_points + rim.squared));
        let part = |q: usize| model.area[range.start + q] * self.error[range.start + q].powi(2);
        let most = (0..pressure.len()).max_by(|&p, &q| part(p).total_cmp(&part(q)));
        let at = if rim.squared > squared { Some(rim.worst) } else { most };
        self.worst.push(at.map_or([f64::NAN; 3], |q| position[q]));
        let peak = (0..pressure.len()).max_by(|&p, &q| pressure[p].total_cmp(&pressure[q]));
        self.guesses.push(if rim.squared > squared.max(UNFINISHED.powi(2) * whole) {
            Some(Guess { cause: Cause::Rim, place: position[rim.worst] })
        } else if !model.pairs[index].law.is_bonded() && share_of_whole_facets(points, pressure) < RESOLVED {
            peak.map(|peak| Guess { cause: Cause::FewFacets, place: position[peak] })
        } else {
            None
        });
    }
}

/// Return the sum of the compliances 1/E* of the bodies of a pair.
///
/// Times the size of a facet over pi it is their compliance to a pressure that changes its sign within the facet. It is
/// that of the springs of two half-spaces in series, for a wave as long as the facet.
pub fn softness(model: &Model, pair: usize) -> f64 {
    model.pairs[pair].bodies.iter().map(|&body| 1.0 / model.bodies[body].modulus).sum::<f64>()
}

/// Return the share of the squared pressure at integration points between contact points that are all under pressure,
/// one if there is no pressure. `pressure` has the pressures of the pair's contact points.
fn share_of_whole_facets(points: &FinePoints, pressure: &[f64]) -> f64 {
    let (mut whole, mut all) = (0.0, 0.0);
    for (g, point) in points.each.iter().enumerate() {
        let carriers = || points.interpolation.row(g);
        let value: f64 = carriers().map(|(q, share)| share * pressure[q]).sum();
        all += point.weight * value * value;
        if carriers().all(|(q, _)| pressure[q] > 0.0) {
            whole += point.weight * value * value;
        }
    }
    if all > 0.0 { whole / all } else { 1.0 }
}

/// What the pressures of a pair may lack at its rims, where no smoother solution can be recovered.
///
/// Without a layer, the pressure at the distance r from a rim is K r^(lambda - 1). Recovered polynomials are no nearer
/// to it than the discrete pressure. A facet of size h at the rim misses the order h^(lambda - 1/2) of it in the mean
/// square, whatever the degree of its polynomials. So the part of the highest degree, that is, p_h less its projection
/// p_- on polynomials of one degree less, has the order of the error. [`missed`] is the ratio of the error to this
/// part.
///
/// A layer limits the pressure. A pressure that is missed by q changes the deflection of the bodies by s q, with their
/// compliance s to a pressure that varies within the facet, and the law with the tangent stiffness kappa then changes
/// the pressure by s kappa/(1 + s kappa) q.
#[derive(Default)]
struct RimError {
    /// Integral of the squared error over all facets at rims.
    squared: f64,
    /// Contact point near the largest error, counted from the first one of the pair.
    worst: usize,
}

impl RimError {
    /// Compute the error of a pair from the pressures and tangents of its contact points. `soft` is the [`softness`] of
    /// its bodies.
    fn new(points: &FinePoints, soft: f64, pressure: &[f64], tangent: &[f64]) -> Self {
        let (mut error, mut largest, mut first) = (Self::default(), 0.0, 0);
        for chunk in points.each.chunk_by(|p, q| p.facet == q.facet) {
            let on_facet = first..first + chunk.len();
            first = on_facet.end;
            if !chunk[0].at_rim {
                continue;
            }
            let missed = missed(points.order, chunk[0].degree);
            for (g, q) in on_facet.clone().zip(highest_part(points, on_facet, pressure)) {
                let point = &points.each[g];
                let stiffness = points.interpolation.row(g).map(|(q, _)| tangent[q]).fold(0.0, f64::max);
                let resisted = point.size * soft / PI * stiffness;
                let squared = point.weight * (missed * (resisted / (1.0 + resisted)) * q).powi(2);
                error.squared += squared;
                if squared > largest {
                    (largest, error.worst) = (squared, point.nearest);
                }
            }
        }
        error
    }
}

/// Return the ratio of the error to the part of the highest degree of a pressure on a facet of side a.
///
/// Stresses of elements of degree 2 have the degree 1. Let lambda be 0.774, the rim of a punch with right angles on a
/// block of the same material. By its coefficients in Legendre polynomials, r^(lambda - 1) less the nearest line is
/// 1.69 times its part of degree 2, which pressures of degree 2 show, and 0.97 times its part of degree 1, which linear
/// pressures show. For elements of degree k the ratio is the root of 1 + k/1.08 by the same rule, from k = 2 to 8
/// within one per cent. For linear elements the ratio would be 1.39 by the same rule. Their nodal pressures are means
/// over two facets, which flattens the rise: on such a punch with 3, 6 and 12 elements a unit of length under a layer
/// of 1e6 the measured ratio is 2.8, 2.5 and 2.2.
fn missed(order: Order, degree: usize) -> f64 {
    match (order, degree) {
        (Order::P1, _) => 2.8,
        (_, 1) => 0.97,
        (_, degree) => (1.0 + degree as f64 / 1.08).sqrt(),
    }
}

/// Return the part of the highest degree of the pressure at each integration point of a facet. `pressure` has the
/// pressures of the contact points.
fn highest_part(points: &FinePoints, on_facet: Range<usize>, pressure: &[f64]) -> Vec<f64> {
    let each = &points.each[on_facet.clone()];
    let mean = |p: &[f64], q: &[f64]| each.iter().zip(p.iter().zip(q)).map(|(g, (p, q))| g.weight * p * q).sum::<f64>();
    // what is left of functions at the points without their parts in polynomials of lower degrees, which are orthogonal
    let rest = |lower: &[Vec<f64>], mut values: Vec<f64>| {
        for known in lower {
            let part = mean(known, &values) / mean(known, known);
            values.iter_mut().zip(known).for_each(|(value, known)| *value -= part * known);
        }
        values
    };
    let mut lower: Vec<Vec<f64>> = Vec::new();
    for degree in 0..each[0].degree.min(each.len()) {
        let power = each.iter().map(|g| (2.0 * g.along - 1.0).powi(degree as i32)).collect();
        let next = rest(&lower, power);
        lower.push(next);
    }
    let value = |g: usize| points.interpolation.row(g).map(|(q, share)| share * pressure[q]).sum::<f64>();
    rest(&lower, on_facet.map(value).collect())
}

/// The error of the layer of a pair between its contact points.
pub(super) struct LayerError {
    /// Squared energy error of the layer.
    pub energy: f64,
    /// Estimated pressure at each integration point. It is the pressure of the discrete problem where the estimate is
    /// no better.
    pub pressure: Vec<f64>,
}

impl LayerError {
    /// Compute the error of pair `index`. `giving` is the closing of the recovered displacements of both bodies at each
    /// integration point. `beyond` is what the compression of each contact point lacks as a mean. On the facets `at_ends`
    /// the pressure of the discrete problem stands, since loads of their own have the error there.
    pub fn new(
        model: &Model,
        points: &FinePoints,
        layer: &Layer,
        index: usize,
        giving: &[f64],
        beyond: &[f64],
        at_ends: &BTreeSet<usize>,
    ) -> Self {
        let (law, soft, range) = (&model.pairs[index].law, softness(model, index), model.range(index));
        let [compression, pressure, tangent] =
            [&layer.compression, &layer.pressure, &layer.tangent].map(|values| &values[range.clone()]);
        let least = if law.is_bonded() { f64::NEG_INFINITY } else { 0.0 };
        let mut error = Self { energy: 0.0, pressure: Vec::with_capacity(giving.len()) };
        for (g, (giving, point)) in giving.iter().zip(&points.each).enumerate() {
            let carriers: Vec<(usize, f64)> = points.interpolation.row(g).collect();
            let is_whole = law.is_bonded() || carriers.iter().all(|(q, _)| compression[*q] >= 0.0);
            let between = Between { law, point, carriers, is_whole, compliance: point.size * soft / PI };
            let (c_h, p_h) = between.meet(between.value(|q| compression[q] + between.compliance * pressure[q]));
            let recovered = giving - point.gap - between.curve(|q| beyond[q]);
            let (c, p) = between.meet(recovered + between.compliance * between.value(|q| pressure[q]).max(least));
            error.energy += point.weight * (p - p_h) * (c - c_h);
            let (mut discrete, mut amplified) = (0.0, 0.0);
            for (q, mu) in points.pressing.row(g) {
                discrete += mu * pressure[q];
                amplified += mu * mu;
            }
            let weight = if at_ends.contains(&point.facet) { 0.0 } else { between.weight_of_law(tangent, amplified) };
            error.pressure.push(discrete + weight * (p - discrete));
        }
        error
    }
}

/// The layer at an integration point, between contact points.
///
/// The recovered displacements belong to the interpolated pressure p_i of the contact points, and close the gap to the
/// compression c*. Let s be the compliance of the bodies to a pressure that varies within a facet. A pressure p then
/// leaves the compression c* - s (p - p_i), and the intersection of this line with the law is the estimate.
struct Between<'a> {
    law: &'a Law,
    point: &'a FinePoint,
    /// The contact points around it, with the values of their shape functions.
    carriers: Vec<(usize, f64)>,
    /// Whether all of them are closed, or bonded.
    is_whole: bool,
    /// s.
    compliance: f64,
}

impl Between<'_> {
    /// Return the curve through values of the contact points.
    fn curve(&self, value: impl Fn(usize) -> f64) -> f64 {
        self.carriers.iter().map(|(q, share)| share * value(*q)).sum()
    }

    /// Return the curve through values of the contact points, or the largest one where the curve is above all of them
    /// and some points are open: it rises the more the faster the gap grows, and no pressure follows from such a rise.
    fn value(&self, value: impl Fn(usize) -> f64) -> f64 {
        let curve = self.curve(&value);
        let largest = || self.carriers.iter().map(|(q, _)| value(*q)).fold(f64::NEG_INFINITY, f64::max);
        if self.is_whole { curve } else { curve.min(largest()) }
    }

    /// Return the compression and the pressure on the law with c + s p = `state`.
    fn meet(&self, state: f64) -> (f64, f64) {
        let c = self.law.resolvent(self.point.nearest, state, 1.0 / self.compliance);
        (c, self.law.pressure(self.point.nearest, c))
    }

    /// Return the weight of the law's pressure relative to that of the discrete problem, a / (a + kappa^2 s^2) where
    /// all points are closed. `tangent` has the tangents of the contact points, and kappa is the largest one around.
    ///
    /// Let e be the error of displacements. The pressure of the law has the error kappa e, since p_i is wrong together
    /// with c*, or e/(s + 1/kappa) in a facet of which some points are open. The discrete pressure is a sum of values
    /// with errors of e/s each, so its error is the root of a = `amplified` times e/s, and a is one where all points
    /// are closed. The mean of both with the least variance has weights in proportion to one over their squares.
    fn weight_of_law(&self, tangent: &[f64], amplified: f64) -> f64 {
        let stiffness = self.carriers.iter().map(|(q, _)| tangent[*q]).fold(0.0, f64::max) * self.compliance;
        let weight = |stiffness: f64, amplified: f64| amplified / (amplified + stiffness * stiffness);
        if self.is_whole {
            weight(stiffness, 1.0)
        } else if self.point.at_edges {
            // with the weight below, quadratic facets in space had 0.57 of the error under a layer of 1e8
            1.0
        } else {
            weight(stiffness / (1.0 + stiffness), amplified)
        }
    }
}
