//! Layers given by a table: the curve through any increasing points is a law, and its inverses find their way back.
#![no_main]

use libfuzzer_sys::fuzz_target;
use winkler::internals::contact::law::{LayerLaw, Table};

/// A positive number between 1e-12 and 1e12, from three bytes.
fn positive(bytes: &[u8]) -> f64 {
    let share = f64::from(u16::from_le_bytes([bytes[0], bytes[1]])) / 65536.0;
    (1.0 + 9.0 * share) * 10_f64.powi(i32::from(bytes[2]) % 24 - 12)
}

fuzz_target!(|bytes: &[u8]| {
    let mut words = bytes.chunks_exact(3).map(positive);
    let (Some(c), Some(rho)) = (words.next(), words.next()) else { return };
    let numbers: Vec<f64> = words.take(64).collect();
    let mut points: Vec<[f64; 2]> = Vec::new();
    for step in numbers.chunks_exact(2) {
        let last = points.last().copied().unwrap_or_default();
        let next = [last[0] + step[0], last[1] + step[1]];
        // as in a scene: both increase
        if next[0] > last[0] && next[1] > last[1] {
            points.push(next);
        }
    }
    if points.is_empty() {
        return;
    }
    let law = Table::new(&points);
    let response = law.response(0, c);
    assert!(response.pressure.is_finite() && response.tangent.is_finite() && response.energy.is_finite());
    assert!(response.pressure >= 0.0 && response.energy >= 0.0, "{response:?} at {c} of {points:?}");
    assert!(law.response(0, 1.5 * c).pressure >= response.pressure * (1.0 - 1e-12), "at {c} of {points:?}");
    for [c, pressure] in &points {
        let found = law.response(0, *c).pressure;
        assert!((found - pressure).abs() <= 1e-9 * pressure, "{found} at {c} of {points:?}");
    }
    let back = law.compression(0, response.pressure);
    // where points lie a rounding apart, no compression has the pressure: it lies between those of two beside each other
    let [below, above] = [1.0 - 1e-14, 1.0 + 1e-14].map(|by| law.response(0, back * by).pressure);
    let brackets = below <= response.pressure * (1.0 + 1e-6) && above >= response.pressure * (1.0 - 1e-6);
    assert!(brackets, "{c} {back} of {points:?}");
    let meet = law.meet(0, c, rho);
    assert!((0.0..=c * (1.0 + 1e-12)).contains(&meet), "{meet} of {c}, {rho} of {points:?}");
    let gap = law.duality_gap(0, c, 0.5 * response.pressure);
    assert!(gap >= 0.0, "{gap} at {c} of {points:?}");
});
