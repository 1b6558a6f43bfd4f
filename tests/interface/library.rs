//! The library as a program of one's own uses it: the examples, scenes built in Rust and what is wrong with some, the features.

use crate::common::here::{solve_here, with_session};
use crate::common::{case, output, root};
use std::process::Command;
use std::time::Duration;
use winkler::api::*;

#[path = "../../examples/gamma.rs"]
#[allow(dead_code)]
mod gamma;
#[path = "../../examples/gmsh.rs"]
#[allow(dead_code)]
mod gmsh;
#[path = "../../examples/law.rs"]
#[allow(dead_code)]
mod law;

/// The scene in Rust is that of the file, solved to the same digits.
#[test]
fn the_groove_built_in_rust_is_that_of_the_file() {
    let file = solve_here(case("groove"), &["mesh.set.n=16", "method={}"]).converged();
    with_session(move |session| {
        let built = gmsh::groove(session).expect("a solution");
        let report = built.report();
        assert_eq!(report.iterations, file.count("iterations"));
        assert!((report.f1.expect("an energy") / file.number("F1") - 1.0).abs() < 1e-12);
        assert_eq!(built.contact(0).pressure, file.contact()["pressure"]);
    });
}

#[test]
fn an_own_law_gives_the_closed_form() {
    with_session(|session| {
        let solution = law::pressed(session).expect("a solution");
        assert!(solution.is_converged());
        let upper = solution.body(1).expect("a body").expect("displacements");
        let top = upper.displacement.iter().map(|u| u[1]).fold(f64::INFINITY, f64::min);
        assert!((top - law::exact()).abs() < 1e-9 && (top + 0.48).abs() < 1e-9, "{top}");
        assert!(solution.contact(0).pressure.iter().all(|p| (p - law::LOAD).abs() < 1e-9));
    });
}

/// All rules reach one solution, and Chebyshev's steps in fewer sweeps than the paper's gamma.
#[test]
fn an_own_rule_for_gamma_is_one_of_them() {
    with_session(|session| {
        let solved = gamma::rules().map(|rule| gamma::by(session, rule).expect("a solution"));
        let peak = |solution: &Solution| solution.contact(0).pressure.into_iter().fold(0.0, f64::max);
        assert!(
            solved
                .iter()
                .all(|solution| solution.is_converged() && (peak(solution) / peak(&solved[0]) - 1.0).abs() < 1e-6)
        );
        let [paper, own] = [0, 1].map(|k| solved[k].report().sweeps);
        assert!(own < paper && own > 5, "{own} {paper}");
    });
}

/// Two unit squares, one on the other, each point of the upper one numbered backwards, and a point of nobody.
fn squares() -> MeshArrays {
    let square = |y: f64| [[0.0, y, 0.0], [1.0, y, 0.0], [1.0, y + 1.0, 0.0], [0.0, y + 1.0, 0.0]];
    let mut points = square(0.0).to_vec();
    points.push([7.0, 7.0, 0.0]);
    points.extend(square(1.0).iter().rev());
    MeshArrays::new(points)
        .group("lower", 2, vec![0, 1, 2, 0, 2, 3])
        .group("upper", 2, vec![8, 7, 6, 8, 6, 5])
        .group("base", 1, vec![0, 1])
        .group("below", 1, vec![3, 2])
        .group("above", 1, vec![8, 7])
        .group("top", 1, vec![6, 5])
}

/// Pressed together by 1 through p = 50 c across a gap of 0.01.
fn pressed(mesh: MeshArrays) -> Scene {
    Scene::new(2, mesh)
        .body(BodySpec::new("lower", 100.0, 0.0).fix("base", [Some(0.0), Some(0.0)]))
        .body(BodySpec::new("upper", 100.0, 0.0).fix("top", [Some(0.0), None]).pressure("top", |_| 1.0))
        .contact(ContactSpec::new("below", "above", LayerSpec::linear(|_: [f64; 3]| 50.0)).gap(0.01))
}

/// A line p = 50 c, with an energy that is not its integral.
#[derive(Debug)]
struct Lazy;

impl LayerLaw for Lazy {
    fn pressure_and_tangent(&self, _point: usize, c: f64) -> (f64, f64) {
        // it softens from a compression of one half on
        (50.0 * c * (1.0 - c), 50.0 - 100.0 * c)
    }

    fn energy(&self, _point: usize, c: f64) -> f64 {
        25.0 * c * c - 50.0 / 3.0 * c.powi(3)
    }
}

struct Lost;

impl GammaRule for Lost {
    fn gamma(&mut self, _here: &mut Iterate) -> Result<f64, Unbounded> {
        Ok(f64::NAN)
    }
}

#[derive(Default)]
struct Watching(usize);

impl Observer for Watching {
    fn row(&mut self, _row: &Row) {
        self.0 += 1;
    }
}

impl Recorder for Watching {}

#[test]
fn scenes_are_solved_or_refused() {
    with_session(|session| {
        solves(session);
        refuses(session);
    });
}

/// Displacements, pressures, forces and what an observer sees.
fn solves(session: &Session) {
    let mut watching = Watching::default();
    let solution = solve_with(session, pressed(squares()), &mut watching).expect("a solution");
    assert!(solution.is_converged() && *solution.status() == Status::Converged, "{:?}", solution.status());
    assert_eq!(watching.0, solution.history().len());
    assert_eq!((solution.pairs(), solution.report().dofs), (1, 16));
    let table = solution.contact(0);
    assert!(table.pressure.iter().all(|p| (p - 1.0).abs() < 1e-9) && table.gap == [0.01; 2], "{table:?}");
    let forces = solution.report().pairs[0].result.force;
    assert!((forces[0][1] + 1.0).abs() < 1e-9 && (forces[1][1] - 1.0).abs() < 1e-9, "{forces:?}");
    // the gap of 0.01, 0.01 of each body, 0.02 of the layer
    for (body, sunk) in [(0, [0.0, 0.01]), (1, [0.04, 0.05])] {
        let field = solution.body(body).expect("all bodies are here").expect("displacements");
        assert_eq!(field.points.len(), solution.points(body).len());
        for (node, &point) in solution.points(body).iter().enumerate() {
            let x = squares().points[point as usize];
            assert_eq!(field.points[node], x);
            let expected = -sunk[usize::from(x[1] > body as f64)];
            assert!((field.displacement[node][1] - expected).abs() < 1e-9, "{x:?}: {:?}", field.displacement[node]);
        }
    }
}

/// Errors of scenes that cannot be solved, with the place in this file where there is one.
fn refuses(session: &Session) {
    let refused = |change: &dyn Fn(&mut Scene), words: &str, place: bool| {
        let mut scene = pressed(squares());
        change(&mut scene);
        let error = solve(session, scene).err().unwrap_or_else(|| panic!("not refused: {words}")).to_string();
        assert!(error.contains(words), "{words}: {error}");
        assert_eq!(error.contains(&format!("{}:", file!())), place, "{error}");
    };
    refused(
        &|s| s.bodies[1].fix.push(BodySpec::new("a", 1.0, 0.0).fix("tpo", [Some(0.0)]).fix.remove(0)),
        "`top`?",
        true,
    );
    refused(&|s| s.contacts[0].gap = (|_| f64::NAN).into(), "the gap is NaN at", false);
    refused(&|s| s.bodies[0] = BodySpec::new("lower", |x: [f64; 3]| 0.5 - x[1], 0.0), "young is -0.1666", true);
    refused(
        &|s| s.bodies[0] = BodySpec::new("lower", 1.0, 0.5).fix("base", [Some(0.0); 2]),
        "between -1 and 0.5",
        true,
    );
    refused(&|s| s.bodies[0] = BodySpec::new("lwer", 1.0, 0.3).fix("base", [Some(0.0); 2]), "`lower`?", true);
    refused(&|s| s.contacts[0].layer = LayerSpec::power(1.0, 2.0), "must not exceed 1", true);
    refused(&|s| s.contacts[0].layer = LayerSpec::Own("flim".into()), "no law of a layer is called `flim`", false);
    let own = |s: &mut Scene| {
        *s = s.clone().law("lazy", |_| Lazy);
        s.contacts[0].layer = LayerSpec::Own("lazy".into());
    };
    refused(&own, "p does not increase", false);
    let robin = |gamma| MethodSpec { gamma, ..MethodSpec::new(MethodName::Robin) };
    refused(&|s| s.method = robin(Gamma::Own("mine".into())), "no rule for gamma is called `mine`", false);
    // arrays of order 1 get straight edges for a higher order
    let mut scene = pressed(squares());
    scene.bodies[0].order = Some(Order::P2);
    assert!(solve(session, scene).expect("a solution").is_converged());
    // a rule that gives no number ends the run, and is seen in its status
    let mut scene = pressed(squares()).rule("lost", || Lost);
    scene.method = robin(Gamma::Own("lost".into()));
    let solution = solve(session, scene).expect("an end");
    assert!(!solution.is_converged() && *solution.status() != Status::Converged, "{:?}", solution.status());
}

#[test]
fn scenes_that_contradict_themselves_are_refused() {
    let refused = |change: &dyn Fn(&mut Scene), words: &str| {
        let mut scene = pressed(squares());
        change(&mut scene);
        let error = scene.check().expect_err(words).to_string();
        assert!(error.contains(words), "{words}: {error}");
    };
    pressed(squares()).check().expect("nothing is wrong");
    refused(&|s| *s = Scene::new(4, squares()), "2 or 3");
    refused(&|s| s.bodies.clear(), "no body");
    refused(&|s| s.bodies.push(s.bodies[0].clone()), "two bodies are called `lower`");
    refused(&|s| s.bodies.push(BodySpec::new("Ksp!", 1.0, 0.0)), "cannot be the name of a body");
    refused(&|s| s.bodies[0] = BodySpec::new("lower", 1.0, 0.0).fix("base", [None; 2]), "holds no component");
    refused(&|s| s.bodies[0] = BodySpec::new("lower", 1.0, 0.0).fix("base", [Some(0.0); 3]), "`z` in a plane problem");
    refused(&|s| s.contacts.push(s.contacts[0].clone()), "a second contact of `below` and `above`");
    refused(&|s| s.contacts[0].angle = 120.0, "the angle is 120");
    refused(
        &|s| s.contacts[0].layer = LayerSpec::Table(vec![[1.0, 1.0], [2.0, 1.0]]),
        "the pressure 1 of the table does not exceed 1",
    );
    refused(&|s| s.contacts[0].layer = LayerSpec::Table(Vec::new()), "the table has no point");
    refused(&|s| s.method.gamma = Gamma::Stationary(-0.5), "gamma is -0.5");
    refused(&|s| s.method.gamma = Gamma::Schedule(Vec::new()), "has no value");
    refused(&|s| s.method.stop.residual = Some(f64::NAN), "the tolerance is NaN");
    refused(&|s| s.method.stop.residual = None, "has a tolerance");
    refused(&|s| s.method.steps = History::of_shares(vec![0.5, 0.75]), "not the full load");
    refused(&|s| s.bodies[1] = s.bodies[1].clone().traction("top", [0.0, 0.0, 1.0]), "a load in z");
    let force = |total: [f64; 3]| LoadKind::Force { total: total.into(), rigid: false };
    refused(&|s| s.bodies[1] = s.bodies[1].clone().load("top", force([0.0, f64::INFINITY, 0.0])), "the force is");
    // a refusal has the line of the program
    let scene = pressed(squares()).body(BodySpec::new("Upper", 1.0, 0.0));
    let place = format!("{}:{}:", file!(), line!() - 1);
    assert!(scene.check().expect_err("a capital").to_string().contains(&place), "{place}");
}

/// The script of docs/results.md reads the files of a run to the same numbers, where Python has numpy.
#[test]
fn python_reads_the_results() {
    let python = |words: &[&str]| {
        let mut command = Command::new("python3");
        command.args(words).current_dir(root());
        output(command, Duration::from_secs(60))
    };
    if !python(&["-c", "import numpy"]).0.success() {
        return;
    }
    let run =
        crate::common::solve(case("groove"), &["--set", "mesh.set.n=8", "--set", "method={}", "--vtu"]).converged();
    let folder = run.folder.display().to_string();
    let (status, said, complaint) = python(&["scripts/library/results.py", &folder]);
    assert!(status.success(), "{complaint}");
    let force = said.lines().find_map(|line| line.strip_prefix("pressures add up to ")).expect("a force");
    assert!((force.parse::<f64>().expect("a number") / run.forces(0)[1][1] - 1.0).abs() < 1e-12, "{said}");
    assert!(said.contains(&format!("converged in {} iterations", run.count("iterations"))), "{said}");
}
