//! Elements of an order above two: adapted meshes, pressures under stiff layers, and contact that ends within an edge.

use crate::common::here::solve_here;
use crate::common::{Scene, Table, case, solve, winkler};
use std::fs;

/// Sets of the order of both bodies.
fn orders(order: usize) -> [String; 2] {
    [0, 1].map(|body| format!("body.{body}.order={order}"))
}

/// Return the values of a column of a table between its points in x, which are the Gauss-Lobatto points of edges of this order, all in contact as wholes.
fn at(table: &Table, column: &str, order: usize, x: f64) -> f64 {
    let mut rows: Vec<usize> = (0..table.rows()).collect();
    rows.sort_by(|&p, &q| table["x"][p].total_cmp(&table["x"][q]));
    let edges = (rows.len() - 1) / order;
    let edge = (0..edges).filter(|e| table["x"][rows[e * order]] <= x).count().max(1) - 1;
    let points = &rows[edge * order..=(edge + 1) * order];
    let factor = |p: usize, q: usize| (x - table["x"][q]) / (table["x"][p] - table["x"][q]);
    let shape = |p: usize| points.iter().filter(|&&q| q != p).map(|&q| factor(p, q)).product::<f64>();
    points.iter().map(|&p| table[column][p] * shape(p)).sum()
}

/// The groove to errors that its own mesh of linear triangles is far from: nothing says where contact ends or where the gap has its kink.
#[test]
fn adapted_meshes_of_high_order() {
    let stop = "method={stop={residual=1e-10}}";
    let of_scene = [&orders(8)[..], &["mesh.set.n=4".to_owned(), stop.to_owned()]].concat();
    let sets: Vec<&str> = of_scene.iter().map(String::as_str).collect();
    let fine = solve_here(case("groove-held").with_file_name("graded.toml"), &sets).converged().contact();
    for (order, tolerance) in [(3, "1e-3"), (4, "1e-4"), (6, "1e-6")] {
        let [lower, upper] = orders(order);
        let args = ["--tolerance", tolerance, "--set", &lower, "--set", &upper, "--set", stop];
        let run = solve(case("groove-held"), &args).converged();
        let (mut error, mut whole) = (0.0, 0.0);
        let table = run.contact();
        for q in 0..table.rows() {
            let exact = at(&fine, "pressure", 8, table["x"][q]);
            error += table["weight"][q] * (table["pressure"][q] - exact).powi(2);
            whole += table["weight"][q] * exact * exact;
        }
        let (exact, rounds) = (f64::sqrt(error / whole), run["rounds"].as_array().expect("a list").len());
        let estimated = run.number("discretization_error/pressure/0");
        let cells = run.count(&format!("rounds/{}/cells", rounds - 1));
        println!("P{order}: {estimated:.1e}, {exact:.1e}, {rounds} meshes, {cells} cells");
        assert!((0.4..2.5).contains(&(estimated / exact)), "P{order}: {estimated:e} {exact:e}");
        assert!(rounds <= 4 && cells < 500, "P{order}: {rounds} meshes, {cells} cells");
    }
}

/// Under a layer that is nearly rigid the pressures of all orders lie on a curve: those of a method that locks would alternate.
#[test]
fn pressures_under_a_rigid_layer_are_smooth() {
    for order in 3..=8 {
        let layer = "contact.0.layer={power={B=1e-12,a=1}}";
        let of_scene = [&orders(order)[..], &[layer.to_owned(), "mesh.set.n=8".to_owned(), "method={}".to_owned()]];
        let of_scene = of_scene.concat();
        let sets: Vec<&str> = of_scene.iter().map(String::as_str).collect();
        let table = solve_here(case("groove-held"), &sets).converged().contact();
        let (x, p) = (&table["x"], &table["pressure"]);
        let mut rows: Vec<usize> = (0..x.len()).filter(|&q| x[q] < 2.8).collect();
        rows.sort_by(|&a, &b| x[a].total_cmp(&x[b]));
        let beside = |rows: &[usize]| {
            let [a, b, c] = [rows[0], rows[1], rows[2]];
            p[b] - p[a] - (p[c] - p[a]) * (x[b] - x[a]) / (x[c] - x[a])
        };
        let largest = rows.windows(3).map(|rows| beside(rows).abs()).fold(0.0, f64::max);
        println!("P{order}: {largest:.1e}");
        assert!(largest < 8e-3 * 26.8, "P{order}: {largest}");
    }
}

/// A block that ends within an edge of another one. The layer is so soft that the blocks do not deform, and p = (d - g)/B for the gap g and the approach d.
/// With hat functions on that edge, the force has an error of 1e-5 at any order.
#[test]
fn contact_that_ends_within_an_edge() {
    let script = "Point(1) = {0, 0, 0}; Point(2) = {4, 0, 0}; Point(3) = {4, 1, 0}; Point(4) = {0, 1, 0}; For i In {1 : 4}\n Line(i) = {i, i % 4 + 1};\nEndFor\n\
        Point(11) = {0, 1, 0}; Point(12) = {2.6, 1, 0}; Point(13) = {2.6, 2, 0}; Point(14) = {0, 2, 0};\n\
        For i In {11 : 14}\n Line(i) = {i, (i - 10) % 4 + 11};\nEndFor\n\
        Transfinite Curve {1, 3} = 9; Transfinite Curve {2, 4} = 3; Transfinite Curve {11, 13} = 5; Transfinite Curve {12, 14} = 3;\n\
        Curve Loop(1) = {1:4}; Plane Surface(1) = {1}; Curve Loop(2) = {11:14}; Plane Surface(2) = {2};\n\
        Physical Surface(\"below\") = {1}; Physical Surface(\"above\") = {2}; Physical Curve(\"foot\") = {1}; Physical Curve(\"face\") = {3};\n\
        Physical Curve(\"sole\") = {11}; Physical Curve(\"head\") = {13};\n";
    for (order, most) in [(3, 3e-7), (4, 5e-8), (6, 5e-8)] {
        let body = |name: &str| format!("[[body]]\nname = \"{name}\"\nyoung = 2.1e5\npoisson = 0.3\norder = {order}\n");
        let scene = Scene::new(format!(
            "dimension = 2\nmesh = {{ geo = \"ledge.geo\" }}\n{}fix = [{{ on = \"foot\", x = 0, y = 0 }}]\n\
             {}fix = [{{ on = \"head\", x = 0, y = -2e-3 }}]\n[[contact]]\nbetween = [\"face\", \"sole\"]\ngap = \"1e-3*cos(2*x)\"\n\
             layer = {{ power = {{ B = 1e3, a = 1 }} }}\n",
            body("below"),
            body("above")
        ));
        fs::write(scene.path.with_file_name("ledge.geo"), script).expect("a script");
        let run = solve_here(&scene, &["method.stop.residual=1e-10"]).converged();
        let table = run.contact();
        let force: f64 = (0..table.rows()).map(|q| table["weight"][q] * table["pressure"][q]).sum();
        let exact = (2.6 * 2e-3 - 0.5e-3 * 5.2f64.sin()) / 1e3;
        println!("P{order}: {:.1e}, {} points", force / exact - 1.0, table.rows());
        assert!((force / exact - 1.0).abs() < most, "P{order}: {force:e} {exact:e}");
        // the points of the edge lie on its covered part
        assert!(table["x"].iter().all(|&x| x < 2.6 + 1e-9) && table.rows() == 6 * order + 1, "P{order}");
    }
}

/// Two arcs over 0 < x < 3 are paired over all of it at any order, also where points of a piece have no partner at its end.
#[test]
fn the_last_pieces_of_edges_keep_their_ends() {
    let path = case("hertz-line").display().to_string();
    for order in [2, 4, 8] {
        let [one, other] = orders(order);
        let sets = ["--set", "mesh.set.n=2", "--set", &one, "--set", &other];
        let checked = winkler(&[&["check", &path, "--json"][..], &sets].concat());
        let report: serde_json::Value = serde_json::from_str(&checked.stdout).expect("a report");
        let length = report["pairs"][0]["length"].as_f64().expect("a length");
        assert!((length / 3.0 - 1.0).abs() < 1e-5, "P{order}: {length}");
    }
}
