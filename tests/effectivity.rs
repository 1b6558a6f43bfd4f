//! Estimated over true errors of pressures in space, where contact ends inside a surface.

mod common;

use common::series::{Boxes, Series};
use common::{Run, Table, case, root, solve};

/// The ratio that an estimate should have.
const EFFECTIVE: std::ops::Range<f64> = 0.7..2.0;

/// One scene, its order and values to replace, and the layer's stiffness.
struct Asked<'a> {
    case: &'a str,
    order: usize,
    stiffness: f64,
    sets: &'a [&'a str],
}

impl Asked<'_> {
    fn run(&self) -> Run {
        let sets: Vec<String> = (0..2)
            .map(|body| format!("body.{body}.order={}", self.order))
            .chain([format!("contact.0.layer={{linear={{stiffness={:e}}}}}", self.stiffness)])
            .chain(["output.plots=false".to_owned()])
            .chain(self.sets.iter().map(|set| set.to_string()))
            .collect();
        let args: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).chain(["--estimate"]).collect();
        solve(root().join("meshes").join(self.case), &args).converged()
    }

    /// Estimated and true error.
    fn errors(&self, exact: impl FnOnce(&Table) -> Vec<f64>) -> (f64, f64) {
        let run = self.run();
        let table = run.contact();
        let exact = exact(&table);
        let sum = |value: &dyn Fn(usize) -> f64| -> f64 {
            (0..table.rows()).map(|q| table["weight"][q] * value(q).powi(2)).sum()
        };
        let error = sum(&|q| table["pressure"][q] - exact[q]) / sum(&|q| table["pressure"][q]);
        (run.number("discretization_error/pressure/0"), error.sqrt())
    }

    /// The line of a table, with its ratio.
    fn line(&self, exact: impl FnOnce(&Table) -> Vec<f64>) -> (String, f64) {
        let (estimated, error) = self.errors(exact);
        let Self { case, order, stiffness, sets } = self;
        let line = format!(
            "| {case} {} | P{order} | {stiffness:e} | {error:.1e} | {estimated:.1e} | {:.2} |",
            sets.join(" "),
            estimated / error
        );
        (line, estimated / error)
    }

    fn is_effective(&self, exact: impl FnOnce(&Table) -> Vec<f64>) {
        let (line, ratio) = self.line(exact);
        assert!(EFFECTIVE.contains(&ratio), "{line}");
    }
}

fn paraboloid_gap(x: f64, y: f64) -> f64 {
    4e-3 * (x * x + y * y)
}

fn paraboloid(stiffness: f64, points: usize) -> Series {
    let boxes = Boxes { side: 0.5, height: 0.5, young: 2.1e5, poisson: 0.3, stiffness, approach: 3e-4, points };
    Series::new(boxes, paraboloid_gap)
}

fn of_series(series: &Series) -> impl Fn(&Table) -> Vec<f64> {
    |table| series.at(&table["x"], &table["y"], paraboloid_gap)
}

/// Hertz: radius 1. The layers here are so stiff that they change the pressures by less than a tenth of the errors.
fn hertz(table: &Table) -> Vec<f64> {
    (0..table.rows()).map(|q| 279.83 * (1.0 - table["x"][q].powi(2) - table["y"][q].powi(2)).max(0.0).sqrt()).collect()
}

/// Linear and quadratic elements on free graded tetrahedra, under a soft and a medium layer.
#[test]
fn paraboloidal_gap() {
    for stiffness in [1e4, 1e6] {
        let series = paraboloid(stiffness, 64);
        for (order, h) in [(1, "mesh.set.h=0.03"), (2, "mesh.set.h=0.05")] {
            Asked { case: "paraboloid/scene.toml", order, stiffness, sets: &[h] }.is_effective(of_series(&series));
        }
    }
}

/// Surfaces that do not match and nearly no layer: points that open or close by the estimate are no reason for a pressure without end.
#[test]
fn stiff_layers_between_spheres() {
    for (order, stiffness, n) in [(1, 1e9, "mesh.set.n=6"), (2, 1e8, "mesh.set.n=3")] {
        let sets = [n, "mesh.set.edge=1"];
        Asked { case: "hertz-sphere/scene.toml", order, stiffness, sets: &sets }.is_effective(hertz);
    }
}

/// The table of docs/theory.md: `cargo test --release --test effectivity -- --ignored --nocapture`.
#[test]
#[ignore = "some minutes"]
fn table() {
    println!("| scene | elements | stiffness | error | estimated | ratio |\n| --- | --- | --- | --- | --- | --- |");
    let print = |line: (String, f64)| println!("{}", line.0);
    for stiffness in [1e4, 1e5, 1e6, 1e7, 1e8] {
        let series = paraboloid(stiffness, 192);
        for (order, h) in [(1, "0.03"), (1, "0.02"), (2, "0.05"), (2, "0.03"), (2, "0.02")] {
            let h = format!("mesh.set.h={h}");
            let asked = Asked { case: "paraboloid/scene.toml", order, stiffness, sets: &[&h] };
            print(asked.line(of_series(&series)));
        }
    }
    for stiffness in [1e7, 1e9] {
        for (order, n, edge) in [(1, 6, 1), (1, 12, 1), (2, 3, 1), (2, 4, 1), (2, 3, 3)] {
            let sets = [format!("mesh.set.n={n}"), format!("mesh.set.edge={edge}")];
            let sets = sets.each_ref().map(String::as_str);
            print(Asked { case: "hertz-sphere/scene.toml", order, stiffness, sets: &sets }.line(hertz));
        }
    }
    let scene = winkler::scene::load(&case("rough"), &[]).expect("the case");
    let spec =
        winkler::data::DataSpec { file: root().join("meshes/rough/rough.csv"), ..scene.data["rough"].spec.clone() };
    let data = winkler::data::Data::new(spec);
    data.load().expect("its heights");
    let gap = |x: f64, y: f64| 1e-3 - data.sample(&[x, y]).value;
    for (stiffness, approach) in [(1e5, 1.5e-3), (5e6, 5e-4), (5e6, 1.5e-3), (1e8, 1.5e-3)] {
        let boxes = Boxes { side: 1.0, height: 0.5, young: 2.1e5, poisson: 0.3, stiffness, approach, points: 128 };
        let series = Series::new(boxes, gap);
        for (order, n) in [(1, 16), (2, 8), (2, 12)] {
            let sets = [format!("mesh.set.n={n}"), format!("body.upper.fix.2.z=-{approach:e}")];
            let sets = sets.each_ref().map(String::as_str);
            let asked = Asked { case: "rough/scene.toml", order, stiffness, sets: &sets };
            print(asked.line(|table| series.at(&table["x"], &table["y"], gap)));
        }
    }
}
