//! Newton's method is the same on any number of ranks: dofs are distributed, or every rank solves for the contacts of condensed bodies.

use crate::common::here::solve_here;
use crate::common::vtu::Grid;
use crate::common::{Report, Run, case, solve, solve_on, winkler_on};
use std::fs;
use tempfile::TempDir;

/// Small meshes of scenes of every kind: held and floating bodies, in the plane, of revolution and in space, P1 and P2, on springs, with
/// rigid surfaces and turned axes, many bodies.
const SCENES: [(&str, &[&str]); 11] = [
    ("groove", &["mesh.set.n=4"]),
    ("groove3d", &["mesh.set.n=4"]),
    ("stack", &["mesh.set.n=4"]),
    ("groove-held", &["mesh.set.n=4", "body.0.order=3", "body.1.order=6"]),
    ("bearing", &["mesh.set.n=2"]),
    ("flange", &["mesh.set.n=2", "body.0.order=2", "body.1.order=2"]),
    ("hertz-sphere", &["mesh.set.n=2", "body.0.order=1", "body.1.order=1"]),
    ("sphere-layer", &[]),
    ("wall", &["mesh.set.columns=3", "mesh.set.rows=4", "output.pairs=100"]),
    ("coating", &["mesh.set.n=4"]),
    ("blocks", &["mesh.set.k=2", "output.pairs=100"]),
];

/// Far below what is compared.
const STOP: &str = "method.stop={residual=1e-10}";

/// Pressures of all pairs.
fn pressures(report: &Report) -> Vec<f64> {
    let pairs = report["pairs"].as_array().map_or(0, Vec::len);
    (0..pairs).flat_map(|pair| report.contact_of(pair)["pressure"].to_vec()).collect()
}

/// Runs a scene with a solver on some ranks.
fn run(ranks: usize, (scene, sets): (&str, &[&str]), solver: &str) -> Run {
    let solver = format!("solver=\"{solver}\"");
    let mut args = vec!["--method", "newton", "--set", STOP, "--set", &solver, "--set", "output.plots=false"];
    sets.iter().for_each(|set| args.extend(["--set", set]));
    match ranks {
        1 => solve(case(scene), &args),
        _ => solve_on(ranks, case(scene), &args),
    }
    .converged()
}

/// The pressures of one rank on several, to 1e-8 of the peak, the approach of the first pair, and Newton's steps to one.
fn same_on(ranks: usize, scenes: &[(&str, &[&str])], solver: &str) {
    for &scene in scenes {
        let solver_here = format!("solver={solver}");
        let sets = [&["method.name=newton", STOP, &solver_here], scene.1].concat();
        let serial = solve_here(case(scene.0), &sets).converged();
        let (expected, peak) = (pressures(&serial), pressures(&serial).into_iter().fold(0.0, f64::max));
        assert!(peak > 0.0, "{}", scene.0);
        let parallel = run(ranks, scene, solver);
        let found = pressures(&parallel);
        assert_eq!(found.len(), expected.len(), "{} on {ranks}", scene.0);
        let apart = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart <= 1e-8 * peak, "{} on {ranks}: {:e} apart", scene.0, apart / peak);
        let [far, near] = [&serial, &*parallel].map(|run| run.number("pairs/0/approach"));
        assert!((far - near).abs() <= 1e-8 * far.abs(), "{} on {ranks}: {far} {near}", scene.0);
        let steps = [&*parallel, &serial].map(|run| run.count("iterations"));
        assert!(steps[0].abs_diff(steps[1]) <= 1, "{} on {ranks}: {steps:?}", scene.0);
        assert_eq!([&*parallel, &serial].map(|run| run.text("method")), ["newton"; 2]);
        assert_eq!(parallel.solvers(), serial.solvers());
        assert_eq!(parallel.count("assemblies"), serial.count("assemblies"));
    }
}

#[test]
fn condensed_bodies() {
    same_on(5, &SCENES[..4], "condensed");
}

#[test]
fn one_factorisation() {
    same_on(2, &SCENES[4..], "mumps");
}

#[test]
fn multigrid() {
    same_on(3, &SCENES, "hypre");
}

/// The matrix of all bodies has its rows on all ranks, and is not solved by each for itself.
#[test]
fn rows_are_distributed() {
    for solver in ["hypre", "mumps"] {
        let solver = format!("solver={solver}");
        let args = ["--method", "newton", "--set", "mesh.set.n=4", "--set", &solver, "-newton_ksp_view"];
        let run = solve_on(3, case("groove3d"), &args).converged();
        let view = ["KSP Object: (newton_) 3 MPI processes", "type: mpiaij", "rows=1020, cols=1020"];
        assert!(view.iter().all(|text| run.stdout.contains(text)), "{}", run.stdout);
    }
}

/// The contact surface moves with its body, of which other ranks have parts.
#[test]
fn contact_surfaces_have_displacements() {
    let args = ["--method", "newton", "--set", "mesh.set.n=4", "--set", "solver=hypre", "--set", STOP, "--vtu"];
    let [one, three] = [1, 3].map(|ranks| solve_on(ranks, case("groove3d"), &args).converged());
    let surface = |run: &Run| Grid::read(&run.folder.join("contact-lower-upper.vtu"));
    let (alone, shared) = (surface(&one), surface(&three));
    let body = Grid::read(&one.folder.join("lower.vtu"));
    let place = |grid: &Grid, node: usize| grid.points[3 * node..3 * node + 3].to_vec();
    let largest = body.arrays["displacement"].iter().fold(0.0f64, |most, u| most.max(u.abs()));
    for node in 0..alone.points.len() / 3 {
        let other =
            (0..body.points.len() / 3).find(|&other| place(&body, other) == place(&alone, node)).expect("a node");
        for c in 0..3 {
            let moved = alone.arrays["displacement"][3 * node + c];
            assert_eq!(moved, body.arrays["displacement"][3 * other + c]);
            assert!((moved - shared.arrays["displacement"][3 * node + c]).abs() < 1e-8 * largest, "node {node}");
        }
    }
}

/// What the user should know is that of one rank, although most of five ranks have no cell of the body with linear elements at its least Poisson's
/// ratio, none of another, and parts of bodies are smaller than these.
#[test]
fn warnings_are_those_of_one_rank() {
    let near = "body.0.poisson=\"0.2 + 0.295*y\"";
    let sets = ["--set", "solver=hypre", "--method", "newton", "--set", near, "--set", "body.0.order=1"];
    let warnings = |run: Run| run.report["warnings"].clone();
    let one = warnings(solve(case("manufactured"), &sets));
    assert!(
        ["a tenth of the body's size: lower, upper", "Poisson's ratio is 0.4"]
            .iter()
            .all(|words| one.to_string().contains(words)),
        "{one}"
    );
    assert_eq!(warnings(solve_on(5, case("manufactured"), &sets)), one);
}

/// More ranks than nodes, most of which have nothing.
#[test]
fn ranks_without_nodes() {
    let scene = ("groove", &["mesh.set.n=1"][..]);
    let serial = run(1, scene, "mumps");
    let parallel = run(24, scene, "mumps");
    let apart = pressures(&serial).into_iter().zip(pressures(&parallel)).map(|(a, b)| (a - b).abs());
    assert!(apart.fold(0.0, f64::max) <= 1e-8 * serial.number("pairs/0/peak_pressure"));
    assert!(!parallel.warnings().contains("no body"), "{}", parallel.warnings());
}

/// Three discs around an axis that no group of the mesh names: ranks learn of its nodes from each other. The uppermost is pressed by p = 10, and the middle one has
/// no load and no support of its own: the contacts bear p everywhere, and the lower one approaches by p (h/E + 1/k + h/2E'), with the mean over the middle one.
#[test]
fn an_axis_without_a_name() {
    let folder = TempDir::new().expect("a temporary folder");
    let disc = |body: &str, at: usize| {
        let first = 10 * at + 1;
        let [a, b, c, d] = [first, first + 1, first + 2, first + 3];
        format!(
            "Point({a}) = {{0, {at}, 0}}; Point({b}) = {{1, {at}, 0}}; Point({c}) = {{1, {at} + 1, 0}};\n\
             Point({d}) = {{0, {at} + 1, 0}};\n\
             Line({a}) = {{{a}, {b}}}; Line({b}) = {{{b}, {c}}}; Line({c}) = {{{c}, {d}}}; Line({d}) = {{{d}, {a}}};\n\
             Transfinite Curve {{{a}:{d}}} = 13;\nCurve Loop({a}) = {{{a}:{d}}}; Plane Surface({a}) = {{{a}}};\n\
             Transfinite Surface {{{a}}};\nPhysical Surface(\"{body}\") = {{{a}}};\n\
             Physical Curve(\"{body}_bottom\") = {{{a}}}; Physical Curve(\"{body}_top\") = {{{c}}};\n"
        )
    };
    let discs = ["lower", "middle", "upper"].into_iter().zip(0..).map(|(body, at)| disc(body, at));
    fs::write(folder.path().join("discs.geo"), discs.collect::<String>()).expect("written");
    let text = "dimension = 2\nplane = \"axisymmetric\"\nmesh = { geo = \"discs.geo\" }\n\
                [[body]]\nname = \"lower\"\norder = 1\nyoung = 100\npoisson = 0.3\nfix = [{ on = \"lower_bottom\", y = 0 }]\n\
                [[body]]\nname = \"middle\"\norder = 1\nyoung = 150\npoisson = 0.25\n\
                [[body]]\nname = \"upper\"\norder = 1\nyoung = 200\npoisson = 0.2\nload = [{ on = \"upper_top\", pressure = 10 }]\n\
                [[contact]]\nbetween = [\"lower_top\", \"middle_bottom\"]\nlayer = { linear = { stiffness = 50 } }\n\
                [[contact]]\nbetween = [\"middle_top\", \"upper_bottom\"]\nlayer = { linear = { stiffness = 50 } }\n";
    let scene = folder.path().join("scene.toml");
    fs::write(&scene, text).expect("written");
    for ranks in [1, 4] {
        for solver in ["solver=mumps", "solver=hypre"] {
            let words = ["--method", "newton", "--set", STOP, "--set", solver];
            let run = if ranks == 1 { solve(&scene, &words) } else { solve_on(ranks, &scene, &words) }.converged();
            let off = pressures(&run).into_iter().map(|p| (p / 10.0 - 1.0).abs()).fold(0.0, f64::max);
            assert!(off < 1e-8, "{solver} on {ranks}: {off:e}");
            let (approach, exact) = (run.number("pairs/0/approach"), 10.0 * (1.0 / 100.0 + 1.0 / 50.0 + 0.5 / 150.0));
            assert!((approach / exact - 1.0).abs() < 1e-9, "{solver} on {ranks}: {approach} {exact}");
        }
    }
    same_check(4, &scene.display().to_string());
}

/// What `check` says of a scene with hypre, on several ranks.
fn same_check(ranks: usize, scene: &str) {
    let words = ["check", scene, "--set", "solver=hypre"];
    let [one, several] = [1, ranks].map(|ranks| winkler_on(ranks, &words));
    assert!(one.code == 0 && one.stdout.contains("supported"), "{}", one.said());
    assert_eq!(several.stdout, one.stdout);
}

/// Supports, loads and the coupling of pairs in words are those of one rank.
#[test]
fn check_says_what_one_rank_says() {
    ["groove", "coating", "manufactured-3d"].iter().for_each(|name| same_check(3, &case(name).display().to_string()));
}

/// The nodes of a rigid surface are assembled where their master is, and so are cells that touch one of them alone, with the weight at these nodes.
#[test]
fn tied_nodes_on_many_ranks() {
    let scene = ("coating", &["body.1.force=[0, -100]"][..]);
    let (serial, parallel) = (run(1, scene, "mumps"), run(12, scene, "mumps"));
    let apart = pressures(&serial).into_iter().zip(pressures(&parallel)).map(|(a, b)| (a - b).abs());
    assert!(apart.fold(0.0, f64::max) <= 1e-8 * serial.number("pairs/0/peak_pressure"));
}

/// What is recovered inside the bodies and their balance are those of one rank, with the cells of each rank alone; and so is the estimate of the
/// mesh's error, for which every rank has all.
#[test]
fn bodies_are_recovered_in_parts() {
    let args = ["--method", "newton", "--set", "solver=hypre", "--set", STOP, "--estimate"];
    let serial = solve(case("manufactured-3d"), &args).converged();
    for args in [&args[..], &args[..args.len() - 1]] {
        let parallel = solve_on(3, case("manufactured-3d"), args).converged();
        let close = |path: &str, to: f64| {
            let [a, b] = [&serial, &parallel].map(|run| run.number(path));
            assert!((a - b).abs() <= to * a.abs(), "{path}: {a} {b}");
        };
        let extremes = ["max_von_mises", "max_von_mises_at/0", "principal_range/0", "principal_range/1"];
        let forces = ["loads/moment/0", "contacts/force/2", "supports/0/force/2", "supports/0/moment/0"];
        for body in 0..2 {
            for key in extremes.into_iter().chain(["error_l2", "error_h1", "error_energy"]) {
                close(&format!("bodies/{body}/{key}"), 1e-9);
            }
            forces.iter().for_each(|key| close(&format!("bodies/{body}/balance/{key}"), 1e-8));
            assert!(parallel.number(&format!("bodies/{body}/balance/force_imbalance")) < 1e-10);
        }
        close("pairs/0/layer_energy", 1e-9);
        close("pairs/0/approach", 1e-8);
        if args.contains(&"--estimate") {
            close("discretization_error/energy", 1e-8);
            close("discretization_error/nodal", 1e-2);
        }
    }
}

/// Load steps that ended on three ranks go on on one and on two, from the states of the last one.
#[test]
fn states_go_from_some_ranks_to_others() {
    let sets =
        ["--method", "newton", "--set", "mesh.set.n=4", "--set", "solver=hypre", "--set", "method.steps=[0.5,1]"];
    let whole = solve(case("groove"), &[&sets[..], &["--set", STOP]].concat()).converged();
    // no step ends; the states after each are kept, and the run that begins from them tells of the first again
    let short = ["--set", "method.stop={residual=1e-16,iterations=3}"];
    let ended = solve_on(3, case("groove"), &[&sets[..], &short].concat());
    assert_eq!(ended.code, 1, "{}", ended.said());
    let path = ended.folder.display().to_string();
    for ranks in [1, 2] {
        let rest = solve_on(ranks, case("groove"), &[&sets[..], &["--set", STOP, "--restart", &path]].concat());
        assert_eq!((rest.code, rest["status"].as_str()), (1, Some("iteration-limit")), "{ranks}: {}", rest.said());
        assert_eq!(rest["steps"][1]["status"].as_str(), Some("converged"), "{ranks}: {}", rest.said());
        assert!(rest.warnings().contains("load step 1 (factor 0.5): not converged"), "{ranks}: {}", rest.said());
        assert_eq!(rest["steps"].as_array().map(Vec::len), Some(2), "{ranks}: {}", rest.said());
        let apart = pressures(&rest).into_iter().zip(pressures(&whole)).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f64::max) <= 1e-8 * whole.number("pairs/0/peak_pressure"), "{ranks}");
    }
}

/// Two cubes with a bowed gap, the lower one eight times the other, which contact alone holds.
const CUBES: [&str; 4] = ["--set", "mesh.set={nl=12,nu=6}", "--set", "contact.0.gap=\"2e-5*((x-0.5)^2+(y-0.5)^2)\""];

/// Runs a scene by sweeps on some ranks, to a residual of 1e-9 unless the words say more.
fn swept(ranks: usize, scene: &str, words: &[&str]) -> Run {
    let stop = ["--set", "method.stop={residual=1e-9}", "--set", "output.plots=false"];
    let args = [&stop, words].concat();
    match ranks {
        1 => solve(case(scene), &args),
        _ => solve_on(ranks, case(scene), &args),
    }
    .converged()
}

/// The pressures of sweeps on one rank on several, to `to` of the peak.
fn same_sweeps(ranks: &[usize], scene: &str, words: &[&str], to: f64) {
    let serial = swept(1, scene, words);
    for &ranks in ranks {
        let parallel = swept(ranks, scene, words);
        let apart = pressures(&parallel).into_iter().zip(pressures(&serial)).map(|(a, b)| (a - b).abs());
        let (apart, peak) = (apart.fold(0.0, f64::max), pressures(&serial).into_iter().fold(0.0, f64::max));
        assert!(peak > 0.0 && apart <= to * peak, "{scene} {words:?} on {ranks}: {:e} apart", apart / peak);
        assert_eq!(parallel.solvers(), serial.solvers(), "{scene} {words:?} on {ranks}");
        assert_eq!(parallel.count("assemblies"), serial.count("assemblies"));
        assert_eq!(parallel.warnings(), serial.warnings());
    }
}

/// One large body beside a small one, more ranks than bodies, one body too many, free bodies and quadratic elements, by each method: sweeps
/// distribute bodies, and find what one rank finds.
#[test]
fn bodies_of_sweeps_are_distributed() {
    let cubes = |words: &[&'static str]| [&["--set", "mesh.set={nl=10,nu=5}"], &CUBES[2..], words].concat();
    let newton = ["--method", "newton-robin", "--set", "solver=hypre"];
    same_sweeps(&[3], "patch-3d", &cubes(&newton), 1e-8);
    // many sweeps to the end; as many on both sides to any residual
    let robin = ["--method", "robin", "--set", "solver=hypre", "--set", "method.stop={residual=1e-2}"];
    same_sweeps(&[2], "patch-3d", &cubes(&robin), 1e-7);
    let aitken = ["--method", "robin", "--set", "method.gamma=aitken", "--set", "solver=mumps"];
    same_sweeps(&[3], "patch-3d", &cubes(&aitken), 1e-7);
    same_sweeps(
        &[3],
        "hertz-sphere",
        &[&newton[..], &["--set", "mesh.set={n=2,edge=1}", "--set", "body.1.order=1"]].concat(),
        1e-7,
    );
}

/// Quadratic elements have another smoother on several ranks, and keep their preconditioner for the whole run as on one: with about as many
/// iterations.
#[test]
fn quadratic_elements_keep_their_preconditioner() {
    let args = ["--method", "newton", "--set", "solver=hypre", "--set", "mesh.set.n=2", "--set", "output.plots=false"];
    let serial = solve(case("hertz-sphere"), &args).converged();
    let most = 1.3 * serial.number("inner_iterations");
    let parallel = solve_on(3, case("hertz-sphere"), &args).converged();
    for key in ["factorizations", "patches", "iterations"] {
        assert_eq!(parallel.count(key), serial.count(key), "{key}");
    }
    assert!(parallel.count("factorizations") == 1 && parallel.count("patches") > 1);
    assert!(parallel.number("inner_iterations") <= most, "{}", parallel.said());
}
