use super::expression::ExpressionLaw;
use super::forms::{CUBIC, EXPONENTIAL, LINE};
use super::*;
use crate::error::{Place, Source};
use crate::expression::{Expression, KnownNames};
use std::cell::Cell;
use std::rc::Rc;
use std::sync::Arc;

/// Return p, p' and P.
fn at(law: &Law, c: f64) -> [f64; 3] {
    let (pressure, tangent) = law.pressure_and_tangent(0, c);
    [pressure, tangent, law.energy(0, c)]
}

/// Check from far below `scale` to far beyond it that the pressure is the derivative of the energy, the tangent that of
/// the pressure, and that the pressure increases.
fn check(law: &Law, scale: f64) {
    assert_eq!([at(law, 0.0), at(law, -scale)], [[0.0; 3]; 2]);
    assert!(law.pressure(0, f64::NAN).is_nan());
    let (mut last, mut from) = ([0.0; 3], 0.0);
    for step in 0..=240 {
        let c = scale * 10f64.powf(-8.0 + step as f64 / 20.0 + 0.003);
        let h = 1e-5 * c;
        let [minus, here, plus] = [c - h, c, c + h].map(|c| at(law, c));
        let [pressure, tangent, energy] = here;
        assert_eq!(law.robin_tangent(0, -c), tangent);
        let slope = (plus[0] - minus[0]) / (2.0 * h);
        // A difference of pressures has an error of second order, and a larger one at a kink of p'.
        let rough = (slope / tangent - 1.0).abs();
        let bent = (plus[1] / minus[1] - 1.0).abs();
        let rounding = 4.0 * f64::EPSILON * pressure / (h * tangent);
        assert!(rough < 1e-8 + 1e-3 * bent + rounding, "{law:?} at {c}: p' {slope} {here:?}");
        let work = numeric::integral(&|c| law.pressure(0, c), from, c);
        let gained = energy - last[2];
        assert!((gained - work).abs() < 1e-11 * energy, "{law:?} at {c}: P gains {gained}, not {work}");
        assert!(pressure > last[0] && pressure.is_finite(), "{law:?} is not increasing at {c}");
        assert!(tangent > 0.0 && tangent.is_finite());
        (last, from) = (here, c);
    }
}

fn expression(text: &str) -> Expression {
    let source = Source { name: "scene.toml".into(), text: format!("pressure = \"{text}\"\n") };
    let place = Place { span: 11..13 + text.len(), source: Arc::new(source) };
    Expression::parse(text, &place, KnownNames::of(&["c", "x", "y"])).unwrap_or_else(|error| panic!("{error}"))
}

/// The law p0 (e^(c/c0) - 1).
fn exponential(p0: f64, c0: f64) -> ExpressionLaw {
    ExpressionLaw::known(&ExpressionLaw::text(EXPONENTIAL).expect("a law"), p0, c0, LINE * c0)
}

/// The law k1 c + k3 c^3.
fn cubic(k1: f64, k3: f64) -> ExpressionLaw {
    ExpressionLaw::known(&ExpressionLaw::text(CUBIC).expect("a law"), k1, k3, f64::INFINITY)
}

fn typed(text: &str, end: Option<f64>) -> crate::error::Result<ExpressionLaw> {
    ExpressionLaw::new(&expression(text), [0.5, 2.0, 0.0], end, 10.0)
}

#[test]
fn laws_are_consistent() {
    // the smallest pressures of the steepest power are zero in double precision
    for (law, scale) in all_laws().into_iter().filter(|(law, scale)| law.pressure(0, 1e-8 * scale) > 0.0) {
        check(&law, scale);
    }
    // In case V1 a compression of B q^a carries the pressure q.
    let (b, a, q) = (2.5e-5, 0.5, 10.0f64);
    assert!((Law::new(Power::new(b, a)).pressure(0, b * q.powf(a)) - q).abs() < 1e-13);
}

/// A constant that varies from point to point keeps the closed forms.
#[test]
fn varying_constants_are_those_of_each_point() {
    let laws = [Power::linear(3e7), Power::new(1e-6, 0.5), Power::new(1e-4, 0.2)];
    let varying = Law::new(PerPoint(laws.to_vec()));
    for (point, law) in laws.map(Law::new).iter().enumerate() {
        assert_eq!(varying.compression.as_power(point), Some(laws[point]));
        for x in [1e-7, 1e-5, 3.0] {
            let states = [(law, 0), (&varying, point)].map(|(law, point)| {
                [law.resolvent(point, x, 1e6), law.compression(point, x), law.pressure(point, x), law.energy(point, x)]
            });
            assert_eq!(states[0], states[1]);
        }
    }
}

/// Beside a piece 10^35 times as steep the slope at zero is reduced to nothing, and the pressure still does not fall
/// below zero.
#[test]
fn a_table_increases_beside_a_jump() {
    let law = Law::new(Table::new(&[[10659179687.5, 1e-12], [10659179687.500042, 680819702.1484375]]));
    for c in (-300..=10).map(|exponent| 10_f64.powi(exponent)) {
        let [pressure, tangent, energy] = at(&law, c);
        assert!(pressure >= 0.0 && tangent > 0.0 && energy >= 0.0, "{pressure} {tangent} {energy} at {c}");
    }
}

#[test]
fn a_table_goes_through_its_points_and_on_with_its_last_slope() {
    let points = [[1e-5, 2.0], [1.5e-5, 2.1], [2e-5, 40.0], [1e-4, 41.0]];
    let law = Law::new(Table::new(&points));
    for [c, p] in points {
        assert!((law.pressure(0, c) - p).abs() < 1e-12 * p);
        let [below, above] = [0.999_999, 1.000_001].map(|s| law.pressure_and_tangent(0, s * c).1);
        assert!((below / above - 1.0).abs() < 1e-2, "a kink at {c}: {below} {above}");
    }
    let [_, slope, _] = at(&law, 1e-4);
    let [pressure, tangent, _] = at(&law, 3e-4);
    assert!((pressure - (41.0 + 2e-4 * slope)).abs() < 1e-10);
    assert!((tangent / slope - 1.0).abs() < 1e-12);
    // Data on a line give the line.
    let line = Law::new(Table::new(&[[1.0, 3.0], [2.0, 6.0], [5.0, 15.0]]));
    for c in [0.3, 1.7, 4.0, 9.0] {
        let [pressure, tangent, energy] = at(&line, c);
        assert!((pressure - 3.0 * c).abs() + (tangent - 3.0).abs() < 1e-13);
        assert!((energy - 1.5 * c * c).abs() < 1e-13 * energy);
    }
}

#[test]
fn expressions_that_are_no_laws() {
    let refused = |text: &str, end, words: &str| {
        let error = typed(text, end).expect_err(text);
        assert!(error.message().contains(words), "{text}: {error}");
    };
    refused("1e5*c + 1e-3", None, "p(0) is 0.001, not 0");
    refused("1/c", None, "p(0) is inf");
    refused("3", None, "p(0) is 3");
    refused("1e5*sqrt(c)", None, "p'(0) = infinity");
    refused("-1e5*c", None, "does not increase");
    refused("1e5*c*(c > 1e-5)", None, "does not increase");
    refused("1e5*c - 1e7*c^3", None, "p does not increase at c = 6");
    refused("1e5*c*sqrt(1e-3 - c)", None, "p does not increase at c = 6");
    refused("1e5*c + asin(100*c)", None, "p is 1001.570796326795 and p' inf at c = 1.000e-2");
    refused("1e-5*c/(1e-4 - c)", None, "at c = 1");
    // The advice fits the case: there is nothing to cut off where the law decreases from zero on.
    assert!(typed("-1e5*c", None).expect_err("no law").to_string().contains("wrong sign"));
    // Up to the compression where these laws increase, they are accepted.
    assert!(typed("1e5*c - 1e7*c^3", Some(0.05)).is_ok());
    assert!(typed("1e-5*c/(1e-4 - c)", Some(9e-5)).is_ok());
}

/// Return laws of every kind, each with a compression where it is curved.
fn all_laws() -> Vec<(Law, f64)> {
    let table = [[1e-5, 2.0], [1.5e-5, 2.1], [2e-5, 40.0], [1e-4, 41.0]];
    let mut laws = vec![
        (Law::new(Power::linear(3e7)), 1e-5),
        (Law::new(exponential(3.0, 2e-5)), 5e-5),
        (Law::new(cubic(1e5, 4e14)), 2e-5),
        (Law::new(cubic(1e5, 0.0)), 2e-5),
        (Law::new(Table::new(&table)), 2e-5),
        (Law::new(Table::new(&[[1e-5, 2.0]])), 1e-5),
        (Law::new(typed("1e5*c + 3e9*c^2", None).expect("a law")), 1e-4),
        (Law::new(PerPoint(vec![Power::new(1e-6, 0.3), Power::new(1e-4, 0.2)])), 1e-6),
    ];
    for a in [1.0, 0.5, 0.3, 0.1, 0.05, 0.02] {
        laws.push((Law::new(Power::new(1e-6, a)), 1e-6));
    }
    for (text, end) in [
        ("1e5*c + 3e9*c^2", None),
        ("1e5*c + 3e9*c^2", Some(4e-5)),
        ("20*sinh(c/4e-5)*exp(c/4e-5) + 1e5*c", None),
        ("1e5*c + max(0, c - 3e-5)*1e6", None),
        ("x*1e5*c + y*1e7*c^1.5", None),
        ("x*1e5*c + y*1e7*c^1.5", Some(5.0)),
    ] {
        laws.push((Law::new(typed(text, end).expect(text)), 3e-5));
    }
    laws
}

/// At infinite compressions or pressures only an open layer without pressure is on the graph.
#[test]
fn gaps_at_the_ends_of_numbers() {
    for (law, scale) in all_laws() {
        let inf = f64::INFINITY;
        for (c, pressure, gap) in [
            (-scale, 0.0, 0.0),
            (-inf, 0.0, 0.0),
            (inf, 0.0, inf),
            (-scale, -1.0, inf),
            (-inf, -1.0, inf),
            (scale, inf, inf),
        ] {
            assert_eq!(law.duality_gap(0, c, pressure), gap, "{law:?} {c} {pressure}");
        }
        assert!(law.duality_gap(0, f64::NAN, 0.0).is_nan() && law.duality_gap(0, 0.0, f64::NAN).is_nan());
    }
}

/// Return powers of ten from 10^low to 10^high, not at round numbers.
fn decades(low: i32, high: i32, each: i32) -> impl Iterator<Item = f64> {
    (low * each..=high * each).map(move |i| 1.137 * 10f64.powf(f64::from(i) / f64::from(each)))
}

/// Return the relative rounding error of p(c) caused by that of c.
fn rounding(law: &Law, c: f64) -> f64 {
    let (pressure, tangent) = law.pressure_and_tangent(0, c);
    let exponent = c * (tangent / pressure);
    2.0 * f64::EPSILON * (1.0 + if exponent.is_finite() { exponent } else { 0.0 })
}

#[test]
fn a_line_meets_the_graph_once() {
    for (law, _) in all_laws() {
        for rho in decades(-20, 20, 1) {
            let (mut last, mut last_s) = (0.0, 0.0);
            for s in decades(-30, 30, 3).flat_map(|s| [s, s * 1.001]) {
                let c = law.resolvent(0, s, rho);
                let pressure = law.pressure(0, c);
                let error = (c + pressure / rho - s) / s;
                let share = pressure / rho / s;
                let allowed = 4.0 * f64::EPSILON + share * rounding(&law, c);
                assert!(error.abs() <= allowed, "{law:?}: c = {c} at s = {s}, rho = {rho}: {error:e} > {allowed:e}");
                // Neither c nor p/rho grows by more than s.
                let (gained, spring) = (c - last, (pressure - law.pressure(0, last)) / rho);
                let slack = allowed * s;
                assert!(gained >= -slack && spring >= -slack, "{law:?} falls at s = {s}, rho = {rho}");
                assert!(gained <= s - last_s + slack && spring <= s - last_s + slack, "{law:?} jumps at {s}, {rho}");
                (last, last_s) = (c, s);
            }
        }
        for s in [0.0, -2.5, f64::NEG_INFINITY] {
            assert_eq!(law.resolvent(0, s, 1e5), s);
        }
        assert!(law.resolvent(0, f64::NAN, 1e5).is_nan());
        assert_eq!(law.resolvent(0, 1e-3, f64::INFINITY), 1e-3);
    }
}

#[test]
fn compression_inverts_pressure() {
    for (law, scale) in all_laws() {
        for c in decades(-8, 4, 7).map(|c| scale * c) {
            let pressure = law.pressure(0, c);
            if pressure < f64::MIN_POSITIVE || pressure == f64::INFINITY {
                continue;
            }
            let found = law.compression(0, pressure);
            let error = law.pressure(0, found) / pressure - 1.0;
            // The second term is the error of a power with a rounded exponent.
            let allowed = rounding(&law, c) * 2.0 + 2e-16 * pressure.ln().abs();
            assert!(error.abs() <= allowed, "{law:?}: {found} for p({c}): {error:e} > {allowed:e}");
        }
        for pressure in [0.0, -1.0, f64::NEG_INFINITY] {
            assert_eq!(law.compression(0, pressure), 0.0);
        }
        assert_eq!(law.compression(0, f64::INFINITY), f64::INFINITY);
        assert!(law.compression(0, f64::NAN).is_nan());
    }
}

#[derive(Debug)]
struct Saturating;

impl LayerLaw for Saturating {
    fn pressure_and_tangent(&self, _point: usize, c: f64) -> (f64, f64) {
        (c / (1.0 + c), (1.0 + c).powi(-2))
    }

    fn energy(&self, _point: usize, c: f64) -> f64 {
        c - c.ln_1p()
    }
}

/// A law with a rigid stop at c = 1, beyond which it is NaN.
#[derive(Debug)]
struct Ending;

impl LayerLaw for Ending {
    fn pressure_and_tangent(&self, _point: usize, c: f64) -> (f64, f64) {
        let left = (1.0 - c).sqrt();
        (1.0 - left, 0.5 / left)
    }

    fn energy(&self, _point: usize, c: f64) -> f64 {
        c - (2.0 - 2.0 * (1.0 - c).sqrt().powi(3)) / 3.0
    }
}

#[test]
fn what_a_law_cannot_reach() {
    let (saturating, ending) = (Law::new(Saturating), Law::new(Ending));
    assert!((saturating.compression(0, 0.75) - 3.0).abs() < 1e-14);
    assert_eq!(saturating.compression(0, 1.5), f64::INFINITY);
    assert_eq!(saturating.duality_gap(0, 1.0, 1.5), f64::INFINITY);
    // The pressure at c = 0.5 is 1/3, and at c = 2 it is 2/3.
    let found = saturating.duality_gap(0, 2.0, 1.0 / 3.0);
    assert!((found / 0.5 - 1.0).abs() < 1e-14, "{found}");
    assert_eq!(ending.compression(0, 1.5), f64::INFINITY);
    assert!((ending.compression(0, 0.5) - 0.75).abs() < 1e-15);
    assert!((ending.resolvent(0, 30.0, 1.0) - 1.0).abs() < 1e-15);
    assert_eq!(ending.duality_gap(0, 1.5, 0.5), f64::INFINITY);
}

/// Fenchel's gap P(c) + P*(p) - c p is never above its bound, and nowhere far below it: an exponent m of the law makes
/// a ratio of 1 + 1/m or 1 + m at most, far from the graph, and 2 near it.
#[test]
fn the_bound_of_the_gap_is_above_it() {
    for (law, scale) in all_laws() {
        for c in decades(-3, 1, 2).map(|c| scale * c) {
            let [pressure, tangent, energy] = at(&law, c);
            if !(1e-200..=1e200).contains(&pressure) {
                continue;
            }
            assert!(law.duality_gap(0, c, 0.0) >= energy * (1.0 - 1e-12));
            for ratio in [1e-6, 1e-2, 0.3, 0.8, 0.999, 1.001, 1.2, 2.0, 10.0] {
                let other = ratio * pressure;
                let on_graph = law.compression(0, other);
                let conjugate = on_graph * other - law.energy(0, on_graph);
                let gap = energy + conjugate - c * other;
                let rounding = 1e-10 * (energy + conjugate.abs() + c * other);
                let bound = law.duality_gap(0, c, other);
                assert!(bound >= gap - rounding, "{law:?} at {c}, {ratio} p: {bound} {gap}");
                let open = law.duality_gap(0, -3.0 * scale, other);
                assert!((open / (other * (on_graph + 3.0 * scale)) - 1.0).abs() < 1e-12, "{law:?} at {c}, {ratio} p");
            }
            // near the graph it is the square of the difference of pressures over the tangent, down to their rounding
            for away in decades(-12, -6, 2) {
                let bound = law.duality_gap(0, c, pressure * (1.0 - away));
                let straight = pressure * away * (pressure * away / tangent);
                let within = 1e-3 + 64.0 * f64::EPSILON * (1.0 + c * tangent / pressure) / away;
                let is_smooth = !["max", "Table"].iter().any(|bent| format!("{law:?}").contains(bent));
                assert!(
                    !is_smooth || (bound / straight - 1.0).abs() < within,
                    "{law:?} at {c}, {away:e}: {bound:e} {straight:e}"
                );
            }
            assert!(law.duality_gap(0, c, pressure) <= 1e-28 * pressure * c * (1.0 + pressure / (c * tangent)));
            assert_eq!(law.duality_gap(0, c, -1e-300), f64::INFINITY);
            assert!(law.duality_gap(0, f64::NAN, pressure).is_nan() && law.duality_gap(0, c, f64::NAN).is_nan());
        }
        assert_eq!((law.duality_gap(0, -1.0, 0.0), law.duality_gap(0, 0.0, 0.0)), (0.0, 0.0));
    }
}

/// A law that counts its evaluations and leaves everything else to the common searches.
#[derive(Debug)]
struct Counted<L>(L, Rc<Cell<usize>>);

impl<L: LayerLaw> LayerLaw for Counted<L> {
    fn pressure_and_tangent(&self, point: usize, c: f64) -> (f64, f64) {
        self.1.set(self.1.get() + 1);
        self.0.pressure_and_tangent(point, c)
    }

    fn energy(&self, point: usize, c: f64) -> f64 {
        self.0.energy(point, c)
    }

    fn end(&self, point: usize) -> f64 {
        self.0.end(point)
    }
}

#[test]
fn searches_ask_a_law_a_few_times() {
    fn most<L: LayerLaw + Clone + 'static>(law: L, scale: f64) -> [usize; 2] {
        let count = Rc::new(Cell::new(0));
        let (plain, law) = (Law::new(law.clone()), Law::new(Counted(law, count.clone())));
        let mut most = [0; 2];
        for s in decades(-4, 4, 5).map(|s| scale * s) {
            for rho in decades(-3, 9, 1) {
                let before = count.get();
                let c = law.resolvent(0, s, rho);
                most[0] = most[0].max(count.get() - before);
                assert!((c - plain.resolvent(0, s, rho)).abs() <= 1e-14 * c);
            }
            let pressure = plain.pressure(0, s);
            if pressure > 1e-300 && pressure < 1e300 {
                let before = count.get();
                law.compression(0, pressure);
                most[1] = most[1].max(count.get() - before);
            }
        }
        most
    }
    for a in [1.0, 0.5, 0.3, 0.1, 0.05, 0.02] {
        let most = most(Power::new(1e-6, a), 1e-6);
        assert!(most[0] <= 8 && most[1] <= 8, "a = {a}: {most:?}");
    }
    let quadratic = most(typed("1e5*c + 3e9*c^2", None).expect("a law"), 1e-4);
    assert!(quadratic[0] <= 8 && quadratic[1] <= 8, "{quadratic:?}");
    // Bends and kinks mislead Newton's method.
    let bent = [
        most(exponential(3.0, 2e-5), 1e-6),
        most(typed("20*sinh(c/4e-5)*exp(c/4e-5) + 1e5*c", None).expect("a law"), 1e-5),
        most(typed("1e5*c + max(0, c - 3e-5)*1e6", None).expect("a law"), 1e-5),
        most(Table::new(&[[1e-5, 2.0], [1.5e-5, 2.1], [2e-5, 40.0], [1e-4, 41.0]]), 1e-5),
    ];
    assert!(bent.iter().flatten().all(|&count| count <= 20), "{bent:?}");
}

/// Return the pressure at which phi(p) - mu/p + p/rho is the sum, by bisection of its logarithm. Here the law is
/// inverted.
fn bisected(law: &Law, sum: f64, rho: f64, mu: f64) -> f64 {
    let excess = |pressure: f64| law.compression(0, pressure) - mu / pressure + pressure / rho - sum;
    let (mut low, mut high) = (f64::MIN_POSITIVE, 1e300);
    while high / low > 1.0 + 4.0 * f64::EPSILON {
        let middle = if high / low > 4.0 { low.sqrt() * high.sqrt() } else { 0.5 * (low + high) };
        if excess(middle) < 0.0 { low = middle } else { high = middle }
    }
    high
}

/// All laws are checked from open to strongly compressed points, for soft to infinite slopes and for much to hardly any
/// smoothing.
#[test]
fn states_are_those_of_the_inverted_law() {
    for (law, scale) in all_laws() {
        let level = law.pressure(0, scale);
        for share in [-1e3, -1.0, -1e-6, 0.0, 1e-6, 0.3, 2.0] {
            for rho in [1e-3, 1.0, 1e3, f64::INFINITY].map(|times: f64| times * level / scale) {
                for mu in [1e-12, 1e-4, 1.0, 1e3].map(|times| times * level * scale) {
                    let sum = share * scale;
                    let state = law.resolve(0, sum, rho, mu);
                    let expected = bisected(&law, sum, rho, mu);
                    let error = state.pressure / expected - 1.0;
                    assert!(error.abs() < 1e-7, "{law:?} sum {sum:e} rho {rho:e} mu {mu:e}: {state:?} {expected:e}");
                    // The compression c is the difference of phi and the gap.
                    let size = sum.abs().max(mu / state.pressure).max(state.pressure / rho);
                    let off = state.compression + state.pressure / rho - sum;
                    assert!(off.abs() <= 1e-12 * size, "{law:?} sum {sum:e} rho {rho:e} mu {mu:e}: {off:e}");
                    assert!(state.tangent > 0.0 && state.tangent.is_finite(), "{law:?}: {state:?}");
                }
            }
        }
    }
}

#[test]
fn the_tangent_is_the_slope_and_no_smoothing_is_the_law() {
    for (law, scale) in all_laws() {
        let level = law.pressure(0, scale);
        let (rho, mu) = (level / scale, 0.1 * level * scale);
        for share in [-2.0, -0.5, 0.0, 0.4] {
            let at = |share: f64| law.resolve(0, share * scale, rho, mu);
            let [low, here, high] = [share - 1e-5, share, share + 1e-5].map(at);
            let slope = (high.pressure - low.pressure) / (high.compression - low.compression);
            assert!((here.tangent / slope - 1.0).abs() < 1e-2, "{law:?}: {here:?} {slope}");
            let exact = law.resolve(0, share * scale, rho, 0.0);
            assert_eq!(exact.compression, law.resolvent(0, share * scale, rho));
            assert_eq!(exact.pressure, law.pressure(0, exact.compression));
        }
        for sum in [f64::NEG_INFINITY, f64::INFINITY] {
            assert_eq!(law.resolve(0, sum, rho, mu).compression, sum);
        }
        assert!(law.resolve(0, f64::NAN, rho, mu).pressure.is_nan());
    }
}

/// A bonded layer of two laws: each side is its own law, states lie on their lines, and the bound of the gap is zero on
/// the graph alone. Smoothing changes nothing.
#[test]
fn bonded_layers_pull() {
    let power = Law::new(Power::new(2.5e-5, 0.5));
    let law = Law { tension: Some(Rc::new(Power::linear(1e5))), ..power.clone() };
    assert_eq!(at(&law, 1e-5), at(&power, 1e-5));
    assert_eq!([at(&law, -1e-5), at(&law, 0.0)], [[-1.0, 1e5, 0.5e-5], [0.0; 3]]);
    assert!(law.is_bonded() && law.pressure(0, f64::NAN).is_nan());
    for s in [-3e-4, -1e-7, 0.0, 1e-7, 3e-4] {
        let LawState { compression, pressure, tangent } = law.resolve(0, s, 1e5, 0.0);
        assert!((compression + pressure / 1e5 - s).abs() < 1e-15, "{law:?} {s}");
        assert_eq!(law.pressure_and_tangent(0, compression), (pressure, tangent));
        assert!((law.compression(0, pressure) - compression).abs() <= 1e-14 * s.abs(), "{law:?} {s}");
        assert_eq!(law.resolve(0, s, 1e5, 1.0), LawState { compression, pressure, tangent });
        assert!(law.duality_gap(0, compression, pressure) <= 1e-14 * (compression * pressure).abs());
        assert!(law.duality_gap(0, compression + 1e-5, pressure - 1.0) > 0.0);
    }
    // the tension 1 at no compression: the corner is off the graph on either side
    assert!(law.duality_gap(0, 0.0, -1.0) > 0.0 && law.duality_gap(0, 1e-5, -1.0) > 0.0);
}
