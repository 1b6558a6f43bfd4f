//! Rigid surfaces that turn under a moment.

use crate::common::vtu::Grid;
use crate::common::{Run, Scene, case, solve, solve_on};
use nalgebra::{DMatrix, DVector};

/// A bar of length 10 with a square section of side 1, clamped at x = 0, with the end at x = 10 under a load.
fn bar(dimension: usize, load: &str) -> Scene {
    let [shape, kind, thing, zero] = match dimension {
        2 => ["Rectangle(1) = {0, -0.5, 0, 10, 1}", "Curve", "Surface", ""],
        _ => ["Box(1) = {0, -0.5, -0.5, 10, 1, 1}", "Surface", "Volume", ", z = 0"],
    };
    let faces =
        ["left", "right", "below", "above"].iter().zip(if dimension == 2 { [4, 2, 1, 3] } else { [1, 2, 3, 4] });
    let faces: String = faces.map(|(name, face)| format!("Physical {kind}(\"{name}\") = {{{face}}};\n")).collect();
    let scene = Scene::new(format!(
        "dimension = {dimension}\nmesh = {{ geo = \"bar.geo\" }}\n[[body]]\nname = \"bar\"\norder = 2\nyoung = 1e5\n\
         poisson = 0.3\nfix = [{{ on = \"left\", x = 0, y = 0{zero} }}]\nload = [{load}]\n"
    ));
    let size = if dimension == 2 { 0.5 } else { 1.0 };
    let script = format!(
        "SetFactory(\"OpenCASCADE\");\n{shape};\n{faces}Physical {thing}(\"bar\") = {{1}};\nMesh.MeshSizeMax = {size};\n"
    );
    std::fs::write(scene.path.with_file_name("bar.geo"), script).expect("a script");
    scene
}

/// Coordinates and displacements of all nodes, from the files of all ranks.
fn fields(run: &Run) -> [Vec<f64>; 2] {
    let mut fields = [Vec::new(), Vec::new()];
    for entry in std::fs::read_dir(&run.folder).expect("results") {
        let path = entry.expect("a file").path();
        if path.extension().is_none_or(|extension| extension != "vtu") {
            continue;
        }
        let grid = Grid::read(&path);
        fields[1].extend(&grid.arrays["displacement"]);
        fields[0].extend(grid.points);
    }
    fields
}

/// The displacement of the centre of the end and its turn, which move all of its nodes.
fn motion(run: &Run) -> [f64; 6] {
    let [places, moved] = fields(run);
    let nodes: Vec<usize> = (0..places.len() / 3).filter(|node| places[3 * node] > 10.0 - 1e-9).collect();
    assert!(nodes.len() > 2, "{nodes:?}");
    // u = U + theta x (x - c)
    let row = |i: usize, column: usize| {
        let (node, c) = (nodes[i / 3], i % 3);
        let arm = [0.0, places[3 * node + 1], places[3 * node + 2]];
        match column {
            0..3 => f64::from(u8::from(column == c)),
            _ if (c + 1) % 3 == column - 3 => arm[(c + 2) % 3],
            _ if (c + 2) % 3 == column - 3 => -arm[(c + 1) % 3],
            _ => 0.0,
        }
    };
    let rows = DMatrix::from_fn(3 * nodes.len(), 6, row);
    let u = DVector::from_fn(rows.nrows(), |i, _| moved[3 * nodes[i / 3] + i % 3]);
    let motion = rows.clone().svd(true, true).solve(&u, 1e-12).expect("a motion");
    let apart = (&rows * &motion - &u).amax();
    assert!(apart < 1e-13 * u.amax().max(1e-3), "the end is bent: {apart:e}\n{}", run.said());
    std::array::from_fn(|i| motion[i])
}

/// The force of an item of the balance of a body, and its moment about the origin.
fn wrench(run: &Run, path: &str) -> [f64; 6] {
    std::array::from_fn(|i| run.number(&format!("bodies/{path}/{}/{}", ["force", "moment"][i / 3], i % 3)))
}

fn near(found: [f64; 6], expected: [f64; 6], tolerance: f64) {
    let size = expected.iter().fold(0.0f64, |size, value| size.max(value.abs()));
    assert!((0..6).all(|i| (found[i] - expected[i]).abs() < tolerance * size), "{found:?}, not {expected:?}");
}

/// The load of a turning end with a force and a moment.
fn turning(dimension: usize, force: [f64; 3], moment: [f64; 3]) -> String {
    match dimension {
        2 => format!("{{ on = \"right\", force = {:?}, moment = {}, rigid = true }}", &force[..2], moment[2]),
        _ => format!("{{ on = \"right\", force = {force:?}, moment = {moment:?}, rigid = true }}"),
    }
}

/// Bending, shear, tension and torsion of bars of all orders, by all kinds of solvers and on two ranks: the end moves as a rigid body;
/// the loads do twice the energy as work on it, arrive at the clamp, and add up.
#[test]
fn ends_move_as_rigid_bodies() {
    for (dimension, force, moment) in
        [(2, [20.0, -2.0, 0.0], [0.0, 0.0, 15.0]), (3, [20.0, -2.0, 3.0], [4.0, -7.0, 15.0])]
    {
        for order in [1, 2] {
            let set = format!("body.0.order={order}");
            let end = |force, moment, ranks: usize, sets: &[&str]| {
                let sets = [&[&set[..]], sets].concat();
                let args: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
                let scene = bar(dimension, &turning(dimension, force, moment));
                solve_on(ranks, &scene, &[&args[..], &["--vtu"]].concat()).converged()
            };
            let run = end(force, moment, 1, &[]);
            let both = motion(&run);
            let load: [f64; 6] = std::array::from_fn(|i| if i < 3 { force[i] } else { moment[i - 3] });
            let work: f64 = both.iter().zip(load).map(|(u, f)| u * f).sum();
            assert!((work / (-2.0 * run.number("F1")) - 1.0).abs() < 1e-9, "{work} {}", run.said());
            // about the origin
            let [_, y, z] = force;
            let whole = [load[0], load[1], load[2], load[3], load[4] - 10.0 * z, load[5] + 10.0 * y];
            near(wrench(&run, "0/balance/rigid/0"), whole, 1e-9);
            near(wrench(&run, "0/balance/supports/0"), whole.map(|load| -load), 1e-9);
            assert_eq!(wrench(&run, "0/balance/loads"), [0.0; 6]);
            if order == 2 {
                let alone = [(force, [0.0; 3]), ([0.0; 3], moment)];
                let alone = alone.map(|(force, moment)| motion(&end(force, moment, 1, &[])));
                near(std::array::from_fn(|i| alone[0][i] + alone[1][i]), both, 1e-9);
            }
            let others = if order == 1 { [(1, "hypre"), (2, "mumps")] } else { [(1, "mumps"), (2, "hypre")] };
            for (ranks, solver) in others {
                let run = end(force, moment, ranks, &[&format!("solver={solver}")]);
                near(motion(&run), both, 1e-7);
            }
        }
    }
}

/// A bar that is clamped above and turns with the long face below, whose nodes several ranks have: the same as on one rank.
#[test]
fn ranks_share_a_surface() {
    for (dimension, order, solver) in [(2, 2, "mumps"), (3, 1, "hypre"), (3, 2, "hypre")] {
        let (force, moment) = match dimension {
            2 => ([20.0, -2.0, 0.0], [0.0, 0.0, 15.0]),
            _ => ([20.0, -2.0, 3.0], [4.0, -7.0, 15.0]),
        };
        let scene = bar(dimension, &turning(dimension, force, moment).replace("right", "below"));
        let sets = ["body.0.fix.0.on=above", &format!("body.0.order={order}"), &format!("solver={solver}")];
        let args: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        let runs = [1, 2].map(|ranks| solve_on(ranks, &scene, &args).converged());
        let [x, y, z] = force;
        let whole = [x, y, z, moment[0] - 0.5 * z, moment[1] - 5.0 * z, moment[2] + 5.0 * y + 0.5 * x];
        for run in &runs {
            near(wrench(run, "0/balance/rigid/0"), whole, 1e-7);
            near(wrench(run, "0/balance/supports/0"), whole.map(|load| -load), 1e-7);
        }
        let energy = runs.each_ref().map(|run| run.number("F1"));
        assert!((energy[1] / energy[0] - 1.0).abs() < 1e-9, "{energy:?}");
    }
}

/// A block on a layer with a gap that is not uniform, under a force and a moment on its upper face or on the contact surface itself, which
/// turns freely: the contact bears both, and a block whose contact surface is rigid has no strain.
#[test]
fn contact_bears_force_and_moment() {
    for (surface, solver, order, ranks) in [
        ("upper_face", "condensed", 1, 1),
        ("upper_face", "mumps", 2, 2),
        ("upper_bottom", "condensed", 2, 1),
        ("upper_bottom", "mumps", 1, 2),
        ("upper_bottom", "hypre", 2, 2),
    ] {
        let load = format!("body.1.load=[{{on=\"{surface}\",force=[0,-10],moment=0.4,rigid=true}}]");
        let orders = [0, 1].map(|body| format!("body.{body}.order={order}"));
        let solver = format!("solver={solver}");
        let sets =
            ["mesh.set={nl=2,nu=3}", "method={stop={residual=1e-12}}", "contact.0.gap=2e-5*x^2", "body.1.fix=[]"];
        let sets = [&sets[..], &[&load, &orders[0], &orders[1], &solver]].concat();
        let args: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        let run = solve_on(ranks, case("patch"), &args).converged();
        // The centre of both surfaces is at x = 1/2.
        let whole = [0.0, -10.0, 0.0, 0.0, 0.0, 0.4 - 5.0];
        near(wrench(&run, "1/balance/contacts"), whole.map(|load| -load), 1e-9);
        near(wrench(&run, "1/balance/rigid/0"), whole, 1e-9);
        let table = run.contact();
        let mean = table["pressure"].iter().sum::<f64>() / table["pressure"].len() as f64;
        assert!(
            table["pressure"].iter().any(|pressure| (pressure - mean).abs() > 0.5),
            "the moment makes no difference"
        );
        if surface == "upper_bottom" {
            assert!(run.number("bodies/1/max_von_mises") < 1e-9, "{}", run.said());
            let (x, u) = (&table["x"], &table["u_n_upper"]);
            let slope = (u[u.len() - 1] - u[0]) / (x[x.len() - 1] - x[0]);
            assert!(slope.abs() > 1e-6, "{slope:e}");
            let bent = x.iter().zip(u).map(|(x, value)| (value - u[0] - slope * (x - table["x"][0])).abs());
            assert!(bent.fold(0.0, f64::max) < 1e-14, "not straight: {u:?}");
        }
    }
}

/// Supports of a turning surface, and moments on surfaces of bodies of revolution.
#[test]
fn refusals() {
    let load = "load = [{ on = \"upper_face\", pressure = 10 }]";
    let turning = "load = [{ on = \"upper_face\", moment = 1, rigid = true }]";
    let refused = |to: &str, at: &str, words: &[&str]| {
        let scene = Scene::edited("groove-held", load, to);
        let run = solve(&scene, &[]);
        assert_eq!(run.code, 3, "{}", run.said());
        let place = format!("{}:{}:", scene.path.display(), scene.line_of(at));
        for word in words.iter().copied().chain([&place[..]]) {
            assert!(run.stderr.contains(word), "no `{word}`\n{}", run.said());
        }
    };
    let support = "fix = [{ on = \"upper_axis\"";
    refused(
        turning,
        support,
        &["the support on `upper_axis` holds nodes of the rigid surface `upper_face`, which turns", "without a moment"],
    );
    let two = format!("{},\n  {{ on = \"upper_end\", moment = 0, rigid = true }}]", &turning[..turning.len() - 1]);
    refused(&two, "upper_end\", m", &["the rigid surfaces `upper_face` and `upper_end` meet"]);
    let scene = Scene::edited("groove-held", load, turning);
    let run = solve(&scene, &["--set", "plane=axisymmetric"]);
    assert!(run.code != 0 && run.stderr.contains("a moment in an axisymmetric scene"), "{}", run.said());
}
