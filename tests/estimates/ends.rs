//! Estimated against true errors of pressures where contact ends on curved boundaries, orders 3 to 8.

use crate::common::{Table, case, solve};

/// Return the pressure of a table of elements of order six at a place: that of the polynomial of the edge there.
fn on_edge(table: &Table, place: f64) -> f64 {
    let (x, p) = (&table["x"], &table["pressure"]);
    let first = (6..x.len() - 1).step_by(6).take_while(|&vertex| x[vertex] <= place).last().unwrap_or(0);
    let edge = first..first + 7;
    if edge.clone().all(|q| p[q] == 0.0) {
        return 0.0;
    }
    let shape = |q: usize| edge.clone().filter(|r| *r != q).map(|r| (place - x[r]) / (x[q] - x[r])).product::<f64>();
    edge.clone().map(|q| p[q] * shape(q)).sum()
}

/// Wavy surfaces and cylinders under stiff layers, on meshes that are adapted to several tolerances, against one that is adapted to
/// 1e-6. Without the pressure that is fitted beside the end of contact, these estimates are 0.05 to 5 times the true errors.
#[test]
fn pressures_where_contact_ends() {
    let mut ratios = Vec::new();
    for name in ["westergaard", "hertz-line"] {
        let adapted = |order: usize, tolerance: &str| {
            let sets = [format!("body.lower.order={order}"), format!("body.upper.order={order}")];
            solve(case(name), &["--set", &sets[0], "--set", &sets[1], "--tolerance", tolerance]).converged()
        };
        let exact = adapted(6, "1e-6").contact();
        for (order, tolerance) in [(3, "1e-3"), (4, "1e-3"), (5, "1e-3"), (7, "1e-3"), (8, "1e-2"), (8, "1e-4")] {
            let run = adapted(order, tolerance);
            let table = run.contact();
            let sum = |value: &dyn Fn(usize) -> f64| {
                (0..table.rows()).map(|q| table["weight"][q] * value(q).powi(2)).sum::<f64>()
            };
            let error =
                sum(&|q| table["pressure"][q] - on_edge(&exact, table["x"][q])) / sum(&|q| table["pressure"][q]);
            let ratio = run.number("discretization_error/pressure/0") / error.sqrt();
            println!("{name} P{order} {tolerance}: {:.1e}, {ratio:.2}", error.sqrt());
            assert!((0.33..3.0).contains(&ratio), "{name} P{order} {tolerance}: {ratio}");
            ratios.push(ratio.ln());
        }
    }
    let mean = (ratios.iter().sum::<f64>() / ratios.len() as f64).exp();
    assert!((0.8..1.7).contains(&mean), "{mean}");
}
