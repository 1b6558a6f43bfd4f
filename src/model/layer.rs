//! The state of the layers: compression and pressure of every contact point, on its law, and the stiffness per area of
//! the surfaces beside them.
//!
//! The law of a point is a curve in the plane of compression c and pressure p: p = 0 for c <= 0, p = p(c) above.
//! Newton's method keeps a state (c_q, p_q) on this curve, where c_q may differ from the compression that the traces of
//! the bodies give. Robin sweeps take the state at that compression.

use super::Model;
use crate::contact::Measure;

/// The state of the layer of every contact point, with the tangent of its law.
#[derive(Debug, Clone, Default)]
pub struct Layer {
    /// c, n: length.
    pub compression: Vec<f64>,
    /// p(c), n: force per area.
    pub pressure: Vec<f64>,
    /// kappa = p'(c), n: stiffness per area.
    pub tangent: Vec<f64>,
    /// omega p, n: force at each point.
    pub force: Vec<f64>,
    /// sum omega P(c) of each pair: energy of its layer.
    pub energy: Vec<f64>,
    /// sum omega p c over all pairs.
    pub work: f64,
    /// Number of points with c > 0, and more than the compression that stays without pressure.
    pub closed: usize,
    /// mu, n: energy per area by which the laws are smoothed ([`Law::resolve`](crate::contact::law::Law::resolve));
    /// empty for the laws themselves. With smoothed laws `energy` is zero.
    pub smoothing: Vec<f64>,
}

impl Layer {
    /// Return the states on the laws at these compressions, n.
    pub fn new(model: &Model, compression: Vec<f64>) -> Self {
        let mut layer = Layer::default();
        for (i, pair) in model.pairs.iter().enumerate() {
            let mut energy = 0.0;
            for q in model.range(i) {
                let (point, c) = (q - model.offset[i], compression[q]);
                let (pressure, tangent) = pair.law.pressure_and_tangent(point, c);
                energy += model.area[q] * pair.law.energy(point, c);
                layer.push(model.area[q], c, pressure, tangent);
                layer.closed += usize::from(c > pair.law.rest(point));
            }
            layer.energy.push(energy);
        }
        layer
    }

    /// Append the state of the next point, with this area.
    fn push(&mut self, area: f64, compression: f64, pressure: f64, tangent: f64) {
        let force = area * pressure;
        // zero force does no work, even where the gap is infinite
        self.work += if force == 0.0 { 0.0 } else { force * compression };
        self.compression.push(compression);
        self.pressure.push(pressure);
        self.tangent.push(tangent);
        self.force.push(force);
    }

    /// Return the states at the compressions of a trace vector, as Robin sweeps take them.
    pub fn at(model: &Model, trace: &[f64]) -> Self {
        Self::new(model, model.compression(trace))
    }

    /// Return the resolvents of the laws (Minty): the states (c_q, p_q) on the laws with c_q + p_q/rho_q = c + p/rho_q.
    /// Compression c and pressure p, n each, are those that the linear model of the layers gave, and `rho`, n, is a
    /// stiffness per area. There is one such state on each law, and it moves by no more than the right-hand side does,
    /// however steep or flat the law is. Laws are smoothed by `smoothing`, an energy per area at each point, n; empty
    /// for the laws themselves.
    pub fn resolve(model: &Model, compression: &[f64], pressure: &[f64], rho: &[f64], smoothing: &[f64]) -> Self {
        let sum = |q: usize| compression[q] + pressure[q] / rho[q];
        if smoothing.is_empty() {
            let all = model.each_point().map(|(q, pair, point)| pair.law.resolvent(point, sum(q), rho[q]));
            return Self::new(model, all.collect());
        }
        let mut layer = Self { smoothing: smoothing.to_vec(), energy: vec![0.0; model.pairs.len()], ..Self::default() };
        for (q, pair, point) in model.each_point() {
            let state = pair.law.resolve(point, sum(q), rho[q], smoothing[q]);
            layer.push(model.area[q], state.compression, state.pressure, state.tangent);
            layer.closed += usize::from(state.compression > pair.law.rest(point));
        }
        layer
    }

    /// Return omega kappa, n: the tangent stiffness of the layer at the points.
    pub fn springs(&self, model: &Model) -> Vec<f64> {
        model.area.iter().zip(&self.tangent).map(|(area, tangent)| area * tangent).collect()
    }

    /// Return p_q + kappa_q (c - c_q), n: the pressures of the linear model at other compressions c, n.
    pub fn linear(&self, compression: &[f64]) -> Vec<f64> {
        let at = |(q, c): (usize, &f64)| match self.tangent[q] {
            0.0 => self.pressure[q],
            tangent => self.pressure[q] + tangent * (c - self.compression[q]),
        };
        compression.iter().enumerate().map(at).collect()
    }

    /// Return the largest pressure, or tension.
    pub fn peak(&self) -> f64 {
        self.pressure.iter().map(|p| p.abs()).fold(0.0, f64::max)
    }
}

/// Stiffness of an elastic foundation over E*/a, in the plane and in space. E* is the modulus of the contact, and a its
/// half width or radius. With 1.18 and 1.70 it has the contact of Hertz (Johnson, Contact Mechanics, 1985, section
/// 4.3). With 0.7 of that the contact of spheres is an eighth wider, because steps that open points are better than
/// steps that close them: spheres and cylinders took the fewest steps at this factor, among 0.3 to 1.2.
const FOUNDATION: [f64; 2] = [0.7 * 1.18, 0.7 * 1.70];

/// Return rho0, n: the stiffness per area of the two bodies in series, for contact all over their surfaces.
pub fn surface_slopes(model: &Model) -> Vec<f64> {
    contact_slopes(model, |_| true)
}

/// Return the stiffness per area of the two bodies in series, n, for contact at the points that are `closed`. Each body
/// deforms as over its depth, or as over its contact if that is smaller.
pub fn contact_slopes(model: &Model, closed: impl Fn(usize) -> bool) -> Vec<f64> {
    let (points, rows) = (model.points(), model.row_stiffness());
    // `foundation` is the stiffness per area of the contact over the modulus
    let stiffness = |body: usize, foundation: f64| {
        let slot = &model.bodies[body];
        slot.modulus * foundation.max(slot.depth.recip())
    };
    let meshed = (0..model.bodies.len()).filter(|&body| !model.bodies[body].is_rigid);
    let largest = meshed.map(|body| stiffness(body, 0.0)).fold(f64::MIN_POSITIVE, f64::max);
    let mut slopes = Vec::with_capacity(points);
    for (i, pair) in model.pairs.iter().enumerate() {
        let area: f64 = model.range(i).filter(|&q| closed(q)).map(|q| model.area[q]).sum();
        let is_plane = pair.measure == Measure::Length;
        let half = if is_plane { 0.5 * area } else { (area / std::f64::consts::PI).sqrt() };
        let foundation = FOUNDATION[usize::from(!is_plane)] / half;
        slopes.extend(model.range(i).map(|q| {
            // a row without stiffness has prescribed dofs only, which do not move
            let compliance = |side: usize| match rows[side * points + q] {
                0.0 => 0.0,
                _ => stiffness(pair.bodies[side], foundation).recip(),
            };
            let sum = compliance(0) + compliance(1);
            if sum > 0.0 { sum.recip() } else { largest }
        }));
    }
    slopes
}

/// Return the stiffness of two springs in series, either of which may be zero or infinite.
pub fn in_series(a: f64, b: f64) -> f64 {
    (a.recip() + b.recip()).recip()
}

/// Factor on the stiffness of the nodes under a point that gives the slope rho of the resolvents in Newton's method.
/// Any slope leads to the same solution. With this factor random scenes took the fewest steps; with 0.003 to 1 they
/// took three per cent more at most, and with 3 some came into cycles.
const SLOPE: f64 = 0.1;

/// Return rho, n: `SLOPE` times the stiffness per area of the softer of the two surfaces, as their elements have it.
pub fn meeting_slopes(model: &Model) -> Vec<f64> {
    let points = model.points();
    let rows = model.row_stiffness();
    let slope = |q: usize| {
        // a row without stiffness has prescribed dofs only, so the other side alone moves; without stiffness on both,
        // rho is infinite and the resolvent is at c
        let sides = [rows[q], rows[points + q]].into_iter().filter(|stiffness| *stiffness > 0.0);
        let softer = sides.fold(f64::INFINITY, f64::min) / model.area[q];
        SLOPE * softer
    };
    (0..points).map(slope).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::sample::two_pairs;

    #[test]
    fn states_have_the_laws_responses_times_the_areas_of_their_points() {
        let model = two_pairs();
        let layer = Layer::new(&model, vec![-1.0, 0.5, 3.0, 0.0]);
        assert_eq!(layer.pressure, [0.0, 2.0, 9.0, 0.0]);
        assert_eq!((layer.tangent[1], layer.tangent[2]), (4.0, 6.0));
        assert_eq!(layer.force, [0.0, 4.0, 27.0, 0.0]);
        // 2 (4 c^2/2) and 3 c^3/3
        assert!((layer.energy[0] - 1.0).abs() < 1e-14 && (layer.energy[1] - 27.0).abs() < 1e-12, "{:?}", layer.energy);
        assert_eq!((layer.work, layer.closed, layer.peak()), (83.0, 2, 9.0));
        assert_eq!(layer.springs(&model)[1..3], [8.0, 18.0]);
        assert_eq!(layer.linear(&[0.0, 0.75, 2.5, 0.0]), [0.0, 3.0, 6.0, 0.0]);
        let far = Layer::new(&model, vec![f64::NEG_INFINITY; 4]);
        assert_eq!((far.work, far.closed), (0.0, 0));
        assert_eq!(far.linear(&[0.0; 4]), [0.0; 4]);
        assert_eq!(Layer::at(&model, &[0.1, 0.2, 0.3, 0.4, 1.0, 2.0, 3.0, 4.0]).compression[2], 3.3);
    }

    #[test]
    fn resolvents_lie_on_lines_through_the_linear_states() {
        let model = two_pairs();
        let (c, p, rho) = ([0.3, -0.5, 2.0, -1.0], [4.0, 1.0, 0.5, -2.0], [2.0, 0.5, 0.25, 3.0]);
        let resolved = Layer::resolve(&model, &c, &p, &rho, &[]);
        for q in 0..4 {
            let (here, there) = (resolved.compression[q] + resolved.pressure[q] / rho[q], c[q] + p[q] / rho[q]);
            assert!((here - there).abs() < 1e-12, "{q}: {here} {there}");
        }
        assert_eq!(resolved.closed, 3);
        // the same holds on smoothed laws, which press everywhere
        let mu = [0.1, 0.2, 1e-3, 4.0];
        let smoothed = Layer::resolve(&model, &c, &p, &rho, &mu);
        for q in 0..4 {
            let (here, there) = (smoothed.compression[q] + smoothed.pressure[q] / rho[q], c[q] + p[q] / rho[q]);
            assert!((here - there).abs() < 1e-12 && smoothed.pressure[q] > 0.0, "{q}: {here} {there}");
            assert!((smoothed.force[q] - model.area[q] * smoothed.pressure[q]).abs() < 1e-15 * smoothed.force[q]);
        }
        assert_eq!(smoothed.smoothing, mu);
    }

    /// A slope is a tenth of the stiffness of the softer side over the area. A row without stiffness is one of
    /// prescribed dofs.
    #[test]
    fn slopes_are_those_of_the_softer_side() {
        let slopes = meeting_slopes(&two_pairs());
        for (slope, expected) in slopes.iter().zip([0.8, 0.6, 0.5 / 3.0, 2.4]) {
            assert!((slope - expected).abs() < 1e-14, "{slopes:?}");
        }
    }
}
