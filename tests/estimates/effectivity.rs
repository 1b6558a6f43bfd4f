//! Estimated over true errors of pressures in space, where contact ends inside a surface.

/// Linear and quadratic elements, free graded tetrahedra and surfaces that do not match, under soft and stiff layers.
#[test]
fn estimates_are_of_the_size_of_errors() {
    let said = crate::common::example("effectivity", &["--quick"]);
    let rows: Vec<&str> = said.lines().skip(2).collect();
    assert_eq!(rows.len(), 8, "{said}");
    for row in rows {
        let ratio = row.split('|').nth(6).and_then(|ratio| ratio.trim().parse::<f64>().ok());
        assert!(ratio.is_some_and(|ratio| (0.7..2.0).contains(&ratio)), "{row}");
    }
}
