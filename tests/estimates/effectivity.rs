//! Estimated over true errors of pressures in space, where contact ends inside a surface.

#[path = "../../scripts/effectivity.rs"]
#[allow(dead_code)]
mod rows;

/// Linear and quadratic elements, free graded tetrahedra and surfaces that do not match, under soft and stiff layers.
#[test]
fn estimates_are_of_the_size_of_errors() {
    let ratios = crate::common::here::with_session(|session| rows::quick(session).expect("all rows"));
    assert!(ratios.len() == 8 && ratios.iter().all(|ratio| (0.7..2.0).contains(ratio)), "{ratios:?}");
}
