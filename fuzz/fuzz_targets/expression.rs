//! Expressions: any text has a value everywhere, NaN included, or is refused; its derivative agrees with it on the value.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::sync::Arc;
use winkler::error::{Place, Source};
use winkler::api::Library;
use winkler::internals::expression::{Expression, Field, KnownNames};

fuzz_target!(|text: &str| {
    let source = Source { name: "scene.toml".to_owned(), text: text.to_owned() };
    let place = Place { source: Arc::new(source), span: 0..text.len() };
    for iteration in [false, true] {
        match Field::parse(text, &place, 2, iteration, &Library::new()) {
            Ok(field) => drop(field.eval_finite("it", [0.5, -2.0, 0.0])),
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
    let scope = KnownNames::of(&["c", "x", "y"]);
    let Ok(plain) = Expression::parse(text, &place, scope) else { return };
    for values in [[0.0, 0.0, 0.0], [1e-3, 4.0, -1.0], [-1e300, 1e-300, 0.5]] {
        let (one, two) = (plain.eval(&values), plain.eval_by(0, &values).0);
        let same = one == two || (one.is_nan() && two.is_nan()) || (one - two).abs() <= 1e-12 * one.abs();
        assert!(same, "{one} and {two} at {values:?} of {text}");
    }
});
