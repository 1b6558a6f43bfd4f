//! Estimated errors against true ones, and the stop that they allow.

use crate::common::here::solve_here;
use crate::common::{Report, Run, Scene, Table, case, nanoseconds, root, solve, solve_on};
use std::f64::consts::PI;

/// Sets of both bodies' order and of the number of elements, with the estimate.
fn sets(order: usize, n: usize) -> Vec<String> {
    let mut sets = vec![format!("mesh.set.n={n}"), "estimate=true".to_owned()];
    sets.extend((0..2).map(|body| format!("body.{body}.order={order}")));
    sets.extend(["output.vtu=false".to_owned(), "output.plots=false".to_owned()]);
    sets
}

fn solve_with(scene: impl AsRef<std::path::Path>, sets: &[String]) -> Report {
    solve_here(scene, &sets.iter().map(String::as_str).collect::<Vec<_>>()).converged()
}

/// The same by the program, which adapts meshes.
fn adapted(scene: impl AsRef<std::path::Path>, sets: &[String]) -> Run {
    solve(scene, &sets.iter().flat_map(|set| ["--set", set]).collect::<Vec<_>>()).converged()
}

/// Relative root of mean squares of differences of the pressures from `exact`, on a uniform mesh from one end to the other.
fn pressure_error(table: &Table, order: usize, exact: impl Fn(usize) -> f64) -> f64 {
    let rows = table.rows();
    let end = |q: usize| q == 0 || q == rows - 1;
    // trapezium, or Simpson
    let weight = |q: usize| match (order, q % 2) {
        (1, _) => 2.0 - f64::from(end(q)),
        (_, 1) => 4.0,
        _ => 2.0 - f64::from(end(q)),
    };
    let sum = |value: &dyn Fn(usize) -> f64| (0..rows).map(|q| weight(q) * value(q).powi(2)).sum::<f64>();
    (sum(&|q| table["pressure"][q] - exact(q)) / sum(&|q| table["pressure"][q])).sqrt()
}

fn is_effective(estimated: f64, exact: f64, what: &str) {
    let effectivity = estimated / exact;
    assert!((0.7..2.0).contains(&effectivity), "{what}: estimated {estimated:e}, true {exact:e}: {effectivity}");
}

/// A block under a wave of pressure: its energy is known in closed form (V2), and what the discrete one lacks is the squared
/// error in the energy norm.
#[test]
fn energy_of_a_block() {
    let text = format!(
        "dimension = 2\nmesh = {{ geo = \"{}\", set = {{ n = 8 }} }}\n[[body]]\nname = \"lower\"\norder = 1\nyoung = 2.1e5\n\
         poisson = 0.3\nfix = [{{ on = \"lower_sides\", x = 0 }}, {{ on = \"lower_face\", y = 0 }}]\n\
         load = [{{ on = \"lower_top\", pressure = \"10*cos(pi*x)\" }}]\n",
        root().join("meshes/wavy/wavy.geo").display()
    );
    let scene = Scene::new(text);
    let wave = (PI.sinh().powi(2)) / (PI.sinh() * PI.cosh() + PI);
    let energy = -0.5 * 100.0 * 2.0 * (1.0 - 0.09) / (2.1e5 * PI) * wave * 0.5;
    for (order, n) in [(1, 8), (1, 16), (2, 8), (2, 16)] {
        let run =
            solve_with(&scene, &[format!("body.0.order={order}"), format!("mesh.set.n={n}"), "estimate=true".into()]);
        let exact = (1.0 - run.number("F1") / energy).sqrt();
        is_effective(run.number("discretization_error/energy"), exact, &format!("P{order}, n = {n}"));
    }
}

/// V2: the pressure under a wavy gap in full contact.
#[test]
fn pressure_of_a_wave() {
    for (order, n) in [(1, 16), (2, 16)] {
        let run = solve_with(case("wavy"), &sets(order, n));
        let table = run.contact();
        let exact = pressure_error(&table, order, |q| 40.0 + 6.350_881_4 * (PI * table["x"][q]).cos());
        let reported = run.number("discretization_error/pressure/0");
        is_effective(reported, exact, &format!("P{order}"));
        // the column has the errors that the number sums up, on the safe side by a quarter
        let summed = pressure_error(&table, order, |q| table["pressure"][q] + table["pressure_error"][q]);
        assert!((1.25 * summed / reported - 1.0).abs() < 1e-6, "{summed} {reported}");
        wave_displacements(&run, order);
        if order == 1 {
            wave_layer(&run);
        }
    }
}

/// Amplitude of the pressure, and stiffness of the layer.
const WAVE: (f64, f64) = (6.350_881_4, 1e5);

/// Uniform strain under 40 between smooth walls, a wave on it; the upper surface follows by compression and gap.
fn wave_displacements(run: &Report, order: usize) {
    let table = run.contact();
    let shape = PI.sinh().powi(2) / (PI.sinh() * PI.cosh() + PI);
    let lower = |x: f64| {
        let uniform = 40.0 * 1.3 * 0.4 / (0.7 * 2.1e5);
        -uniform - 2.0 * 0.91 / (2.1e5 * PI) * shape * WAVE.0 * (PI * x).cos()
    };
    let upper = |x: f64| {
        let pressure = 40.0 + WAVE.0 * (PI * x).cos();
        pressure / WAVE.1 + 1e-4 * (1.0 - (PI * x).cos()) - lower(x)
    };
    let mut sums = (0.0, 0.0);
    for q in 0..table.rows() {
        let (w, x) = (table["weight"][q], table["x"][q]);
        for (found, exact) in [(table["u_n_lower"][q], lower(x)), (table["u_n_upper"][q], upper(x))] {
            sums.0 += w * (found - exact).powi(2);
            sums.1 += w * exact.powi(2);
        }
    }
    let exact = f64::sqrt(sums.0 / sums.1);
    is_effective(run.number("discretization_error/displacement"), exact, &format!("displacements, P{order}"));
}

/// What the layer's squared error is: that of interpolation on sixteen elements, (h k)^4 / 120 of a wave of the pressure.
fn wave_layer(run: &Report) {
    let of = |name: &str| run.number(&format!("discretization_error/{name}"));
    // u'Ku and the work of the layer
    let size = 1600.0 * (1.3 * 0.4 / (0.7 * 2.1e5) * 2.0 + 1.0 / WAVE.1);
    let estimated = (1.0 - of("bodies/0") - of("bodies/1")) * of("energy").powi(2) * size;
    let exact = WAVE.0.powi(2) / WAVE.1 * (PI / 16.0).powi(4) / 240.0;
    is_effective(estimated.sqrt(), exact.sqrt(), "layer");
}

/// V2 on meshes of another family: triangles of any shape, and nodes of the two surfaces that do not face each other.
#[test]
fn pressure_of_a_wave_on_free_meshes() {
    let script = std::fs::read_to_string(root().join("meshes/wavy/wavy.geo")).expect("the script");
    let free: String =
        script.lines().filter(|line| !line.starts_with("Transfinite S")).map(|l| l.to_owned() + "\n").collect();
    let free = free
        .replace("Curve {1, 3, 11, 13} = n + 1", "Curve {1, 3} = n + 1;\nTransfinite Curve {11, 13} = Ceil(1.3*n) + 1");
    assert!(free.contains("Ceil(1.3*n)") && !free.contains("Transfinite S"));
    let scene = Scene::new(crate::common::text_of("wavy"));
    std::fs::write(scene.path.with_file_name("wavy.geo"), free).expect("a script");
    for (order, n) in [(1, 16), (2, 12)] {
        let run = solve_with(&scene, &sets(order, n));
        let table = run.contact();
        let exact = weighted_error(&table, 0..table.rows(), |q| 40.0 + WAVE.0 * (PI * table["x"][q]).cos());
        is_effective(run.number("discretization_error/pressure/0"), exact, &format!("P{order}"));
        wave_displacements(&run, order);
    }
}

/// Rings whose facets do not face each other: chords and parabolas that miss the circle make most of the error.
#[test]
fn curved_surfaces_are_seen() {
    for (order, n) in [(1, 6), (1, 12), (2, 6), (2, 12)] {
        let mut all = sets(order, n);
        all[0] = format!("mesh.set.ni={n}");
        all.extend([format!("mesh.set.no={}", 4 * n / 3), "contact.0.touching=false".to_owned()]);
        let run = solve_with(case("rings"), &all);
        let table = run.contact();
        let exact = weighted_error(&table, 0..table.rows(), |_| 8.985_959);
        is_effective(run.number("discretization_error/pressure/0"), exact, &format!("P{order}, n = {n}"));
    }
}

/// A quarter of a ring pressed down, or a dome of revolution under pressure, on a column: quadratic elements with straight edges miss the curved boundaries, all of which are away
/// from the contact. The reference has curved ones, and twice as many.
#[test]
fn straight_edges_away_from_the_contact_are_seen() {
    let pressed = "fix = [{ on = \"arch_top\", x = 0, y = -1e-3 }]";
    let loaded = "load = [{ on = \"arch_outside\", pressure = 10 }]";
    for (plane, pushed) in [("strain", pressed), ("axisymmetric", loaded)] {
        let scene = Scene::new(format!(
            "dimension = 2\nplane = \"{plane}\"\nestimate = true\nmesh = {{ geo = \"{}\" }}\n\
             [[body]]\nname = \"arch\"\nyoung = 2e5\npoisson = 0.3\norder = 2\n{pushed}\n\
             [[body]]\nname = \"column\"\nyoung = 2e5\npoisson = 0.3\norder = 2\n\
             fix = [{{ on = \"column_bottom\", x = 0, y = 0 }}]\n\
             [[contact]]\nbetween = [\"arch_foot\", \"column_top\"]\nlayer = {{ linear = {{ stiffness = 1e6 }} }}\n\
             [output]\nvtu = false\nplots = false\n",
            root().join("tests/geometry/shapes/arch.geo").display()
        ));
        let run = |n: usize, straight: usize| {
            solve_with(&scene, &[format!("mesh.set.n={n}"), format!("mesh.set.straight={straight}")])
        };
        let better = run(12, 0);
        for n in [3, 4, 6] {
            let run = run(n, 1);
            let exact = distance_from(&run.contact(), &better.contact());
            is_effective(run.number("discretization_error/pressure/0"), exact, &format!("{plane}, n = {n}"));
        }
    }
}

/// A load that bends within an element: its quadrature misses little of it.
#[test]
fn a_load_that_bends_within_an_element() {
    let solved = |order: usize, n: usize| {
        let mut all = sets(order, n);
        all.push("contact.0.gap=0".to_owned());
        all.push("body.upper.load.0.pressure=\"20 + 80*exp(-((x - 0.56)/0.04)^2)\"".to_owned());
        solve_with(case("wavy"), &all)
    };
    let fine = solved(2, 64).contact();
    for order in [1, 2] {
        let run = solved(order, 8);
        let table = run.contact();
        let at = |q: usize| {
            let place = (0..fine.rows()).find(|&k| (fine["x"][k] - table["x"][q]).abs() < 1e-9);
            fine["pressure"][place.expect("nodes of a mesh are nodes of a finer one")]
        };
        let exact = pressure_error(&table, order, at);
        // degrees of constant loads miss a fiftieth on linear elements
        assert!(exact < 1e-3, "{exact}");
        is_effective(run.number("discretization_error/pressure/0"), exact, &format!("P{order}"));
    }
}

/// A nearly incompressible body: recovered displacements have a dilatation that its bulk modulus amplifies, and the solution has none.
#[test]
fn a_nearly_incompressible_body() {
    let solved = |n: usize| {
        let mut all = sets(2, n);
        let load = "body.upper.load.0.pressure=\"20 + 15*cos(2*pi*x)\"";
        all.extend(["contact.0.gap=0", "body.lower.poisson=0.4999", load].map(str::to_owned));
        solve_with(case("wavy"), &all)
    };
    let fine = solved(64).contact();
    for n in [4, 8] {
        let run = solved(n);
        let table = run.contact();
        let (mut error, mut whole) = (0.0, 0.0);
        for q in 0..table.rows() {
            let place = (0..fine.rows()).find(|&k| (fine["x"][k] - table["x"][q]).abs() < 1e-9);
            let place = place.expect("nodes of a mesh are nodes of a finer one");
            for column in ["u_n_lower", "u_n_upper"] {
                error += table["weight"][q] * (table[column][q] - fine[column][place]).powi(2);
                whole += table["weight"][q] * fine[column][place].powi(2);
            }
        }
        let estimated = run.number("discretization_error/displacement");
        is_effective(estimated, f64::sqrt(error / whole), &format!("n = {n}"));
    }
}

/// Relative root of mean squares of differences of the pressures from `exact` at some points, by their weights.
fn weighted_error(table: &Table, points: impl Iterator<Item = usize> + Clone, exact: impl Fn(usize) -> f64) -> f64 {
    let sum = |value: &dyn Fn(usize) -> f64| points.clone().map(|q| table["weight"][q] * value(q).powi(2)).sum::<f64>();
    (sum(&|q| table["pressure"][q] - exact(q)) / sum(&|q| table["pressure"][q])).sqrt()
}

/// V6: a wavy surface on a flat one, the wave in the mesh, under a medium layer and one that is nearly none.
#[test]
fn pressure_between_wavy_surfaces() {
    for stiffness in ["1e6", "1e8"] {
        let with = |order: usize, n: usize| {
            let mut all = sets(order, n);
            all.extend(["method={}".to_owned(), format!("contact.0.layer={{linear={{stiffness={stiffness}}}}}")]);
            solve_with(case("westergaard"), &all)
        };
        let better = with(2, 128).contact();
        for (order, n) in [(1, 32), (2, 16)] {
            let run = with(order, n);
            let table = run.contact();
            let exact = weighted_error(&table, 0..table.rows(), |q| quadratic(&better, table["x"][q]));
            let reported = run.number("discretization_error/pressure/0");
            is_effective(reported, exact, &format!("{stiffness} P{order}"));
        }
    }
}

/// V3b: the pressure of the groove with a kink and an end of contact, against a mesh three times as fine.
#[test]
fn pressure_of_a_groove() {
    let with = |order: usize, n: usize, law: &str| {
        let mut all = sets(order, n);
        all.extend(["method={}".to_owned(), format!("contact.0.layer={law}")]);
        solve_with(case("groove-held"), &all)
    };
    for law in ["{power={B=2.5e-5,a=0.5}}", "{power={B=1e-5,a=1}}"] {
        let fine = with(2, 24, law).contact();
        for order in [1, 2] {
            let run = with(order, 8, law);
            let table = run.contact();
            // nodes of the coarse mesh are nodes of the fine one
            let step = (fine.rows() - 1) / (table.rows() - 1);
            let exact = |q: usize| fine["pressure"][step * q];
            assert!((0..table.rows()).all(|q| (table["x"][q] - fine["x"][step * q]).abs() < 1e-9));
            let error = pressure_error(&table, order, exact);
            is_effective(run.number("discretization_error/pressure/0"), error, &format!("{law} P{order}"));
        }
    }
}

/// Adapted runs solve to the tolerance of any run; an estimate that nobody asks for is not there.
#[test]
fn adapted_runs_are_solved_like_others() {
    let run = adapted(
        case("groove-held"),
        &["mesh.set.n=4".to_owned(), "method={}".to_owned(), "adapt={error=2e-2}".to_owned()],
    );
    assert_eq!(run["settings"]["method"]["stop"]["residual"].as_f64(), Some(1e-8));
    assert!(run.number("residual") <= 1e-8, "{}", run.said());
    let plain = solve(case("patch"), &[]).converged();
    assert!(plain["discretization_error"].is_null() && !plain.stdout.contains("discretisation"));
    assert!(!plain.contact().names.iter().any(|name| name == "pressure_error"));
}

/// A solution that the elements represent has no error; ranks do not change an estimate.
#[test]
fn nothing_to_estimate_and_two_ranks() {
    let run = solve(case("patch"), &["--estimate"]).converged();
    for name in ["energy", "displacement", "pressure/0"] {
        assert!(run.number(&format!("discretization_error/{name}")) < 1e-9, "{name}");
    }
    let sets = sets(2, 8);
    let args: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
    let (one, two) = (solve(case("groove-held"), &args), solve_on(2, case("groove-held"), &args));
    for name in ["energy", "displacement", "pressure/0", "bodies/0"] {
        let [one, two] = [&one, &two].map(|run| run.number(&format!("discretization_error/{name}")));
        assert!((one / two - 1.0).abs() < 1e-9, "{name}: {one} {two}");
    }
}

/// Pressure of a table at a place, by the quadratic elements of its surface.
fn quadratic(table: &Table, place: f64) -> f64 {
    let (x, p) = (&table["x"], &table["pressure"]);
    let last = (table.rows() - 1) / 2;
    let element = (1..=last).find(|&e| x[2 * e] >= place - 1e-12).unwrap_or(last) - 1;
    let [a, m, b] = [0, 1, 2].map(|k| p[2 * element + k]);
    let s = (place - x[2 * element]) / (x[2 * element + 2] - x[2 * element]);
    a * (1.0 - s) * (1.0 - 2.0 * s) + m * 4.0 * s * (1.0 - s) + b * s * (2.0 * s - 1.0)
}

/// Relative error of the pressures against those of a much better table.
fn distance_from(table: &Table, better: &Table) -> f64 {
    let sum = |value: &dyn Fn(usize) -> f64| -> f64 {
        (0..table.rows()).map(|q| table["weight"][q] * value(q).powi(2)).sum()
    };
    let error = sum(&|q| table["pressure"][q] - quadratic(better, table["x"][q]));
    (error / sum(&|q| table["pressure"][q])).sqrt()
}

/// Adapted meshes have the error that was asked for, with far fewer cells than a uniform one.
#[test]
fn adapted_meshes() {
    let better = solve(root().join("meshes/groove-held/graded.toml"), &["--set", "mesh.set.n=4"]).converged().contact();
    // known to all digits
    for (x, p) in [(0.5, 9.35518), (2.0, 10.77811), (2.5, 13.96683), (3.0, 26.80042)] {
        assert!((quadratic(&better, x) / p - 1.0).abs() < 5e-5, "p({x}) = {}", quadratic(&better, x));
    }
    let now = nanoseconds();
    let mut sets = sets(2, 8);
    // the title is part of what an adaptation is remembered by: this one is new
    sets.extend(["method={}".to_owned(), "adapt.error=1e-3".to_owned(), format!("title={now} adapted")]);
    let run = adapted(case("groove-held"), &sets);
    let rounds = run["rounds"].as_array().expect("rounds");
    assert!(rounds.len() >= 2, "{}", run.said());
    let number = |round: usize, name: &str| rounds[round][name].as_f64().expect("a number");
    assert!(number(0, "pressure") > 1e-3 && number(rounds.len() - 1, "pressure") <= 1e-3);
    let error = distance_from(&run.contact(), &better);
    assert!(error < 1e-3 && error > 5e-5, "{error:e}\n{}", run.said());
    // a uniform mesh has this error with more than 4096 cells
    assert!(number(rounds.len() - 1, "cells") < 2500.0, "{}", run.said());
}

/// A slice of space whose solution is that of the plane: a mesh that follows sizes in space has the error that was asked for.
#[test]
fn adapted_meshes_in_space() {
    let better = solve_with(case("groove"), &[&sets(2, 64)[..], &["method={}".to_owned()]].concat()).contact();
    let now = nanoseconds();
    let mut sets = sets(1, 4);
    sets.extend(["method={}".to_owned(), "adapt.error=1e-2".to_owned(), format!("title={now} in space")]);
    let run = adapted(case("groove3d"), &sets);
    let rounds = run["rounds"].as_array().expect("rounds");
    let number = |round: usize, name: &str| rounds[round][name].as_f64().expect("a number");
    assert!(rounds.len() >= 2 && number(0, "pressure") > 1e-2, "{}", run.said());
    assert!(number(rounds.len() - 1, "pressure") <= 1e-2, "{}", run.said());
    let error = distance_from(&run.contact(), &better);
    assert!(error < 1e-2 && error > 1e-3, "{error:e}\n{}", run.said());
}

/// Quadratic tetrahedra, whose points are at the mid-edges of their facets: the graded slice has the pressures of the plane, with
/// fewer than 10 000 dofs, and the estimate tells how well. Under a layer some hundred times as stiff they do not waver: points at the
/// vertices would be 11 % off there, and 0.8 % under the soft one.
#[test]
fn pressures_of_quadratic_tetrahedra() {
    let stiff = ["--set", "contact.0.layer={linear={stiffness=1e8}}"];
    for (layer, last) in [(&[][..], 1.8e-3), (&stiff[..], 0.035)] {
        let graded = |name: &str, n: &str| {
            let n = format!("mesh.set.n={n}");
            let args = [&["--estimate", "--set", &n], layer].concat();
            solve(root().join(format!("meshes/{name}/graded.toml")), &args).converged()
        };
        let run = graded("groove3d", "0.8");
        let error = distance_from(&run.contact(), &graded("groove-held", "4").contact());
        assert!(error < last && run.count("dofs") < 10_000, "{error:e}\n{}", run.said());
        if layer.is_empty() {
            is_effective(run.number("discretization_error/pressure/0"), error, "pressures in space");
        }
    }
}

/// The error of displacements is relative to those of the contact tables, prescribed ones included: it does not matter for the error itself which of two
/// bodies is moved towards the other.
#[test]
fn errors_of_displacements_are_relative_to_the_tables() {
    let absolute = |lower: &str, upper: &str| {
        let sets = [format!("body.0.fix.2.z={lower}"), format!("body.1.fix.2.z={upper}")];
        let coarse =
            ["estimate=true", "mesh.set.n=4", "body.0.order=1", "body.1.order=1", "contact.0.gap=1e-4*(x^2+y^2)"];
        let sets = sets.iter().map(String::as_str).chain(coarse).map(str::to_owned);
        let run = solve_with(case("rough"), &sets.collect::<Vec<_>>()).converged();
        let table = run.contact();
        let square = |q: usize| table["weight"][q] * (table["u_n_lower"][q].powi(2) + table["u_n_upper"][q].powi(2));
        let size = (0..table.rows()).map(square).sum::<f64>().sqrt();
        run.number("discretization_error/displacement") * size
    };
    let (upper_moves, lower_moves) = (absolute("0", "-1e-3"), absolute("2e-3", "1e-3"));
    assert!((upper_moves / lower_moves - 1.0).abs() < 1e-6, "{upper_moves} {lower_moves}");
}

/// Two plates with holes and round edges: the error that was asked for is reached on meshes none of whose cells is folded. The scene's own stop rule is respected.
/// Each mesh but the second has at least 1.8 times the cells of the one before: what Gmsh does not make of the predicted cells is asked for again.
#[test]
fn adapted_meshes_of_a_flange() {
    let now = nanoseconds();
    let sets = |more: &[&str]| -> Vec<String> {
        let own = [format!("title={now} {}", more.len()), "adapt.error=3e-2".to_owned()];
        own.into_iter().chain(more.iter().map(|&set| set.to_owned())).collect()
    };
    let run = adapted(case("flange"), &sets(&[]));
    let rounds = run["rounds"].as_array().expect("rounds");
    let number = |round: &serde_json::Value, name: &str| round[name].as_f64().expect("a number");
    let last = &rounds[rounds.len() - 1];
    assert!(number(last, "pressure") <= 3e-2 && number(last, "displacement") <= 3e-2, "{}", run.said());
    assert!((3..=4).contains(&rounds.len()) && !run.warnings().contains("folded"), "{}", run.said());
    assert!(
        rounds.windows(2).skip(1).all(|two| number(&two[1], "cells") >= 1.8 * number(&two[0], "cells")),
        "{}",
        run.said()
    );
    // the loads lack the squared energy error of their work
    assert!(rounds.iter().all(|round| number(round, "displacement") >= number(round, "energy").powi(2)));
    assert!(run.number("residual") <= 1e-8, "{}", run.said());
    let own = sets(&["adapt.rounds=1", "method.stop.residual=1e-8"]);
    let args: Vec<&str> = own.iter().flat_map(|set| ["--set", set]).collect();
    let exact = solve(case("flange"), &args);
    assert!(exact.number("residual") <= 1e-8, "{}", exact.said());
    assert_eq!((exact.code, exact.text("status")), (1, "mesh-limit"), "{}", exact.said());
}

/// Meshes that may not grow end the run with a status of its own; a finished mesh cannot be adapted.
#[test]
fn limits_of_adaptation() {
    let args = ["--tolerance", "1e-6", "--set", "adapt.cells=500", "--set", "method={}"];
    let run = solve(case("groove-held"), &args);
    assert_eq!((run.code, run.text("status")), (1, "mesh-limit"), "{}", run.said());
    assert!(run.stdout.contains("adapt.cells"), "{}", run.said());
    let scene = Scene::new(crate::common::text_of("groove-held").replace("mesh = {", "mesh = \"a.msh\" # {"));
    std::fs::write(scene.path.with_file_name("a.msh"), "").expect("a file");
    let run = solve(&scene, &["--tolerance", "1e-3"]);
    assert_eq!(run.code, 3, "{}", run.said());
    assert!(run.stderr.contains("cannot be made anew") && run.stderr.contains(".geo"), "{}", run.said());
    // two ranks agree: they say it once
    let two = solve_on(2, &scene, &["--tolerance", "1e-3"]);
    assert_eq!((two.code, two.stderr.matches("cannot be made anew").count()), (3, 1), "{}", two.said());
}

/// What a script says of sizes gives way to sizes that a mesh follows, and a script that scales its mesh is refused.
#[test]
fn adapted_meshes_of_scripts_with_sizes_of_their_own() {
    let case = crate::common::text_of("groove-held");
    let script = std::fs::read_to_string(root().join("meshes/groove/groove.geo")).expect("the script of the groove");
    let with = |line: &str| {
        let scene = Scene::new(
            case.replace(&format!("{}/../groove/groove.geo", root().join("meshes/groove-held").display()), "own.geo"),
        );
        std::fs::write(scene.path.with_file_name("own.geo"), format!("{script}\n{line}\n")).expect("a script");
        solve(&scene, &["--tolerance", "2e-3"])
    };
    for line in ["Mesh.MeshSizeMin = 0.2;", "Mesh.MeshSizeFactor = 2;"] {
        with(line).converged();
    }
    let scaled = with("Mesh.ScalingFactor = 10;");
    assert_eq!(scaled.code, 4, "{}", scaled.said());
    assert!(scaled.stderr.contains("own.geo") && scaled.stderr.contains("Mesh.ScalingFactor"), "{}", scaled.said());
}

/// The errors are those of the mesh, whatever solves for the response: condensed bodies, a factor of all bodies, or multigrid.
#[test]
fn the_linear_step_does_not_change_the_estimate() {
    let errors = |linear: &str| {
        let mut all = sets(2, 4);
        all.extend(["method.name=newton".to_owned(), format!("method.linear={linear}")]);
        let run = solve_with(case("groove-held"), &all);
        ["energy", "nodal", "displacement", "pressure/0"]
            .map(|name| run.number(&format!("discretization_error/{name}")))
    };
    let dense = errors("dense");
    for (linear, most) in [("direct", 1e-4), ("multigrid", 0.1)] {
        let other = errors(linear);
        let off = dense.iter().zip(&other).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
        assert!(off < most, "{linear}: {other:?}, dense: {dense:?}");
    }
}

/// Springs to the ground that only hold bodies whose loads balance: the estimate is the same however soft they are, while a millionth of the
/// loads, which does not balance, moves the bodies by more than all of their deformation. Springs that carry a load count.
#[test]
fn springs_that_only_hold() {
    let bump = "10*exp(-4*(x - 0.5)^2)";
    let pressed = |above: &str, stiffness: &str| {
        let script = root().join("meshes/patch/patch.geo");
        let body = |name: &str, pressure: &str| {
            format!(
                "[[body]]\nname = \"{name}\"\norder = 1\nyoung = 2.1e5\npoisson = 0.3\nload = [{{ on = \"{name}_face\", pressure = \"{pressure}\" }}]\n\
                 spring = [{{ on = \"{name}_face\", stiffness = {stiffness} }}]\n"
            )
        };
        let text = format!(
            "dimension = 2\nmesh = {{ geo = \"{}\", set = {{ nl = 8, nu = 10 }} }}\n{}{}[[contact]]\nbetween = [\"lower_top\", \"upper_bottom\"]\n\
             layer = {{ power = {{ B = 2.5e-5, a = 0.5 }} }}\n",
            script.display(),
            body("lower", bump),
            body("upper", above)
        );
        let run = solve(Scene::new(text), &["--estimate"]).converged();
        let errors = ["energy", "nodal", "displacement", "pressure/0"];
        let errors = errors.map(|name| run.number(&format!("discretization_error/{name}")));
        (run.number("bodies/0/max_displacement"), errors)
    };
    let nearly = "10.00001*exp(-4*(x - 0.5)^2)";
    let (held, stiff) = pressed(nearly, "1");
    let (moved, soft) = pressed(nearly, "1e-3");
    assert!(moved > 10.0 * held, "{moved} {held}");
    for (soft, stiff) in soft.iter().zip(stiff) {
        assert!((soft / stiff - 1.0).abs() < 1e-3, "{soft} {stiff}");
    }
    assert!(stiff[2] < 1e-2 && stiff[1] < 2e-2, "{stiff:?}");
    // a fifth more on one side, which springs carry: the body moves by it, far more than the mesh misses
    let (_, loaded) = pressed("12*exp(-4*(x - 0.5)^2)", "1");
    assert!(10.0 * loaded[0] < stiff[0] && 10.0 * loaded[2] < stiff[2], "{loaded:?} {stiff:?}");
}

/// Linear elements that lock have hardly any of the solution: the estimate is called a guess, with the body and a place under the load.
#[test]
fn an_estimate_as_large_as_the_solution_is_a_guess() {
    let scene = Scene::new(format!(
        "dimension = 2\nestimate = true\nmesh = {{ geo = \"{}\", set = {{ n = 4 }} }}\n[[body]]\nname = \"lower\"\norder = 1\nyoung = 2.1e5\n\
         poisson = 0.4999\nfix = [{{ on = \"lower_sides\", x = 0 }}, {{ on = \"lower_face\", y = 0 }}]\n\
         load = [{{ on = \"lower_top\", pressure = \"10*cos(4*pi*x)\" }}]\n",
        root().join("meshes/wavy/wavy.geo").display()
    ));
    let coarse = solve(&scene, &[]).converged();
    assert!(coarse.number("discretization_error/energy") >= 1.0);
    let said = coarse.warnings();
    assert!(
        said.contains("is a guess") && said.contains("of all bodies `lower` has most of it") && said.contains(", 0.9"),
        "{said}"
    );
    let free = solve(&scene, &["--set", "body.0.poisson=0.3"]).converged();
    assert!(!free.warnings().contains("guess"), "{}", free.warnings());
}

/// Solves `groove-held` on adapted meshes with a Gmsh that makes no mesh of sizes when the shell finds `fails` true. `$n` is the number of the mesh
/// of sizes. The cache is new, so that Gmsh makes all meshes.
fn adapted_where(fails: &str) -> Run {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().expect("a folder");
    let (count, path) = (folder.path().join("count"), std::env::var("PATH").expect("a path"));
    let real = std::env::split_paths(&path).map(|folder| folder.join("gmsh")).find(|file| file.is_file());
    let script = format!(
        "#!/bin/sh\ncase \"$*\" in *sized.geo*)\n  n=$(cat {0} 2>/dev/null || echo 0); n=$((n + 1)); echo $n > {0}\n  \
         if [ {fails} ]; then echo 'Error   : no mesh of these sizes'; exit 1; fi;;\nesac\nexec {1} \"$@\"\n",
        count.display(),
        real.expect("Gmsh").display()
    );
    let program = folder.path().join("gmsh");
    std::fs::write(&program, script).expect("a script");
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).expect("a program");
    let cache = folder.path().join("cache");
    std::fs::create_dir(&cache).expect("a cache");
    std::fs::set_permissions(&cache, std::fs::Permissions::from_mode(0o700)).expect("a cache");
    let path = format!("{}:{path}", folder.path().display());
    let variables = [("PATH", path.as_str()), ("WINKLER_CACHE", cache.to_str().expect("a path"))];
    crate::common::solve_where(&variables, case("groove-held"), &["--tolerance", "5e-3", "--set", "method={}"])
}

/// Where Gmsh makes no mesh of the sizes that a mesh leads to, the run ends with that mesh, and says why.
#[test]
fn sizes_without_a_mesh_end_the_run() {
    let run = adapted_where("$n = 2");
    assert_eq!((run.code, run.text("status")), (1, "mesh-limit"), "{}", run.said());
    assert!(run.stdout.contains("no mesh comes of the sizes after mesh 1"), "{}", run.said());
    let rounds = run.report["rounds"].as_array().expect("rounds");
    assert_eq!(rounds.len(), 2, "the last mesh once more");
    assert_eq!(rounds[0]["cells"], rounds[1]["cells"]);
}

/// A punch on a wider block, both of quadratic elements.
const PUNCH: &str = "DefineConstant[ n = {4, Name \"n\"} ]; h = 1/n;\n\
    Point(1) = {-2, -2, 0, h}; Point(2) = {2, -2, 0, h}; Point(3) = {2, 0, 0, h}; Point(4) = {1, 0, 0, h}; Point(5) = {-1, 0, 0, h};\n\
    Point(6) = {-2, 0, 0, h}; Point(7) = {-1, 0, 0, h}; Point(8) = {1, 0, 0, h}; Point(9) = {1, 1, 0, h}; Point(10) = {-1, 1, 0, h};\n\
    Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 6}; Line(6) = {6, 1};\n\
    Line(7) = {7, 8}; Line(8) = {8, 9}; Line(9) = {9, 10}; Line(10) = {10, 7}; Transfinite Curve {4, 7} = 2*n + 1;\n\
    Curve Loop(1) = {1:6}; Plane Surface(1) = {1}; Curve Loop(2) = {7:10}; Plane Surface(2) = {2};\n\
    Physical Surface(\"base\") = {1}; Physical Surface(\"punch\") = {2}; Physical Curve(\"bottom\") = {1};\n\
    Physical Curve(\"base_top\") = {3, 4, 5}; Physical Curve(\"punch_bottom\") = {7}; Physical Curve(\"punch_top\") = {9};\n\
    Physical Curve(\"punch_sides\") = {8, 10};\n";

/// Return the scene of the punch on the block, with the script and the displacement of the top of the punch.
fn punch(script: &str, pressed: &str) -> Scene {
    let body = |name: &str, on: &str, fixed: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nyoung = 2.1e5\npoisson = 0.3\norder = 2\nfix = [{{ on = \"{on}\", {fixed} }}]\n"
        )
    };
    let scene = Scene::new(format!(
        "dimension = 2\nestimate = true\nmesh = {{ geo = \"punch.geo\" }}\n{}{}[[contact]]\n\
         between = [\"base_top\", \"punch_bottom\"]\nlayer = {{ linear = {{ stiffness = 1e6 }} }}\n",
        body("base", "bottom", "x = 0, y = 0"),
        body("punch", "punch_top", pressed)
    ));
    std::fs::write(scene.path.with_file_name("punch.geo"), script).expect("a script");
    scene
}

/// Pressures at the rim of a flat punch are singular: their error is said to be a guess, with the pair and a place at the rim, and is not below the
/// truth. (At planes of symmetry nothing is added: see `pressure_of_a_wave`.)
#[test]
fn pressures_at_a_rim_are_a_guess() {
    let scene = punch(PUNCH, "x = 0, y = -1e-3");
    let fine = solve(&scene, &["--set", "mesh.set.n=24"]).converged().contact();
    for n in [3, 6] {
        let run = solve(&scene, &["--set", &format!("mesh.set.n={n}")]).converged();
        let table = run.contact();
        let nearest = |x: f64| {
            let far = |q: &usize| (fine["x"][*q] - x).abs();
            (0..fine.rows()).min_by(|p, q| far(p).total_cmp(&far(q))).expect("points")
        };
        let exact = weighted_error(&table, 0..table.rows(), |q| fine["pressure"][nearest(table["x"][q])]);
        let reported = run.number("discretization_error/pressure/0");
        assert!((1.0..2.0).contains(&(reported / exact)), "n = {n}: {reported} {exact}");
        let said = run.warnings();
        assert!(said.contains("is a guess") && said.contains("`punch_bottom`"), "{said}");
    }
}

/// A punch on a hard layer has a large error at its rim whatever the mesh. The adaptation ends when all other pressures have the error that was asked
/// for, with a status and an exit code of its own, and says which pair misses it, where, and what the rim costs; under a soft layer it goes on until the
/// rim has it, too.
#[test]
fn an_adaptation_ends_when_only_a_sharp_end_is_left() {
    let adapted = |stiffness: &str| {
        let layer = format!("contact.0.layer.linear.stiffness={stiffness}");
        let title = format!("title=\"{}\"", nanoseconds());
        solve(punch(PUNCH, "x = 0, y = -1e-3"), &["--tolerance", "2e-2", "--set", &layer, "--set", &title])
    };
    let (hard, soft) = (adapted("1e9"), adapted("1e4").converged());
    assert_eq!((hard.code, hard.text("status")), (7, "tolerance-unmet"), "{}", hard.said());
    assert!(hard.count("dofs") < 50_000, "{}", hard.said());
    let said = hard.text("message");
    assert!(said.contains("converged in") && said.contains("not to 2.0e-2 at sharp ends of contacts"), "{said}");
    assert!(said.contains("of the pressure between `base_top` and `punch_bottom`, most of it near ("), "{said}");
    assert_eq!(hard["unmet"].as_array().map(Vec::len), Some(1), "{}", hard.said());
    let rim = (hard.number("unmet/0/place/0").abs(), hard.number("unmet/0/place/1"));
    assert!((0.9..1.01).contains(&rim.0) && rim.1.abs() < 1e-9, "{rim:?}");
    assert_eq!(hard.number("unmet/0/error"), hard.number("discretization_error/pressure/0"));
    assert!(hard.number("unmet/0/error") > 2e-2 && hard.number("discretization_error/displacement") < 2e-2);
    assert!(soft.number("discretization_error/pressure/0") <= 2e-2, "{}", soft.said());
    assert_eq!(soft["unmet"].as_array().map(Vec::len), Some(0), "{}", soft.said());
}

/// Forces and displacements of the same punch have a small error on a mesh that leaves a large one at the rim, and the estimated error of the
/// force is the true one. Uniform meshes with n = 24 and 80 have the forces 176.903 and 176.889, whose errors fall with 1/n or faster.
#[test]
fn meshes_are_adapted_to_forces_or_displacements_alone() {
    for (of, error) in [("forces", "force/0"), ("displacements", "displacement")] {
        let (of, title) = (format!("adapt.of={of}"), format!("title=\"{}\"", nanoseconds()));
        let run = solve(punch(PUNCH, "x = 0, y = -1e-3"), &["--tolerance", "1e-3", "--set", &of, "--set", &title]);
        let estimated = |name: &str| run.number(&format!("discretization_error/{name}"));
        assert!(estimated(error) <= 1e-3 && estimated("pressure/0") > 1e-3, "{of}: {}", run.said());
        let off = (run.number("pairs/0/force/0/1").abs() / 176.885 - 1.0).abs();
        assert!((0.5..2.0).contains(&(estimated("force/0") / off)), "{of}: {off}, {}", run.said());
    }
    let refused = solve(punch(PUNCH, "x = 0, y = -1e-3"), &["--tolerance", "1e-3", "--set", "adapt.of=force"]);
    assert!(refused.code == 3 && refused.stderr.contains("forces"), "{}", refused.said());
}
