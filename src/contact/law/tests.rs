use super::*;
use crate::error::{Place, Source};
use crate::expression::Differentiable;
use std::sync::Arc;

/// Every law must be its own energy's derivative, its tangent its pressure's, and increase: from far below `scale` to far
/// beyond it.
fn check(law: &dyn LayerLaw, scale: f64) {
    assert_eq!(law.response(0, 0.0), Response::default());
    assert_eq!(law.response(0, -scale), Response::default());
    assert!(law.response(0, f64::NAN).pressure.is_nan());
    let (mut last, mut from) = (Response::default(), 0.0);
    for step in 0..=240 {
        let c = scale * 10f64.powf(-8.0 + step as f64 / 20.0 + 0.003);
        let h = 1e-5 * c;
        let (minus, here, plus) = (law.response(0, c - h), law.response(0, c), law.response(0, c + h));
        assert_eq!(law.pressure(0, c), here.pressure);
        assert_eq!(law.robin_tangent(0, -c), here.tangent);
        let slope = (plus.pressure - minus.pressure) / (2.0 * h);
        // a difference has an error of second order, and misses more at a kink of p'
        let rough = (slope / here.tangent - 1.0).abs();
        let bent = (plus.tangent / minus.tangent - 1.0).abs();
        let rounding = 4.0 * f64::EPSILON * here.pressure / (h * here.tangent);
        assert!(rough < 1e-8 + 1e-3 * bent + rounding, "{law:?} at {c}: p' {slope} {here:?}");
        let work = quadrature::integral(&|c| law.pressure(0, c), from, c);
        let gained = here.energy - last.energy;
        assert!((gained - work).abs() < 1e-11 * here.energy, "{law:?} at {c}: P gains {gained}, not {work}");
        assert!(here.pressure > last.pressure && here.pressure.is_finite(), "{law:?} is not increasing at {c}");
        assert!(here.tangent > 0.0 && here.tangent.is_finite());
        (last, from) = (here, c);
    }
}

fn expression(text: &str) -> Differentiable {
    let source = Source { name: "scene.toml".into(), text: format!("pressure = \"{text}\"\n") };
    let place = Place { span: 11..13 + text.len(), source: Arc::new(source) };
    Differentiable::parse(text, &place, &["c", "x", "y"]).unwrap_or_else(|error| panic!("{error}"))
}

fn typed(text: &str, end: Option<f64>) -> crate::error::Result<Typed> {
    Typed::new(&expression(text), [0.5, 2.0, 0.0], end, 10.0)
}

#[test]
fn laws_are_consistent() {
    for a in [0.1, 0.3, 0.5, 1.0] {
        check(&Power::new(2.5e-5, a), 5e-5);
    }
    check(&Linear { stiffness: 1e5 }, 1e-4);
    check(&Exponential::new(3.0, 2e-5), 5e-5);
    check(&Cubic { k1: 1e5, k3: 4e14 }, 2e-5);
    check(&Cubic { k1: 1e5, k3: 0.0 }, 2e-5);
    check(&Table::new(&[[1e-5, 2.0], [1.5e-5, 2.1], [2e-5, 40.0], [1e-4, 41.0]]), 2e-5);
    check(&Table::new(&[[1e-5, 2.0]]), 1e-5);
    for text in [
        "1e5*c + 3e9*c^2",
        "20*sinh(c/4e-5)*exp(c/4e-5) + 1e5*c",
        "1e5*c + max(0, c - 3e-5)*1e6",
        "x*1e5*c + y*1e7*c^1.5",
    ] {
        check(&typed(text, None).expect(text), 3e-5);
        check(&typed(text, Some(4e-5)).expect(text), 3e-5);
    }
    // V1: a closing of B q^a carries q
    let (b, a, q) = (2.5e-5, 0.5, 10.0f64);
    let p = Power::new(b, a).response(0, b * q.powf(a)).pressure;
    assert!((p - q).abs() < 1e-13);
}

#[test]
fn a_table_goes_through_its_points_and_on_with_its_last_slope() {
    let points = [[1e-5, 2.0], [1.5e-5, 2.1], [2e-5, 40.0], [1e-4, 41.0]];
    let law = Table::new(&points);
    for [c, p] in points {
        assert!((law.response(0, c).pressure - p).abs() < 1e-12 * p);
        let [below, above] = [0.999_999, 1.000_001].map(|s| law.response(0, s * c).tangent);
        assert!((below / above - 1.0).abs() < 1e-2, "a kink at {c}: {below} {above}");
    }
    let end = law.response(0, 1e-4);
    let beyond = law.response(0, 3e-4);
    assert!((beyond.pressure - (41.0 + 2e-4 * end.tangent)).abs() < 1e-10);
    assert!((beyond.tangent / end.tangent - 1.0).abs() < 1e-12);
    // data on a line give the line
    let line = Table::new(&[[1.0, 3.0], [2.0, 6.0], [5.0, 15.0]]);
    for c in [0.3, 1.7, 4.0, 9.0] {
        let expected = Response { pressure: 3.0 * c, tangent: 3.0, energy: 1.5 * c * c };
        let found = line.response(0, c);
        assert!((found.pressure - expected.pressure).abs() + (found.tangent - 3.0).abs() < 1e-13);
        assert!((found.energy - expected.energy).abs() < 1e-13 * expected.energy);
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
    // as far as they are laws, they are
    assert!(typed("1e5*c - 1e7*c^3", Some(0.05)).is_ok());
    assert!(typed("1e-5*c/(1e-4 - c)", Some(9e-5)).is_ok());
}
