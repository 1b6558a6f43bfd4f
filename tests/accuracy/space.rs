//! Bodies in space and curved surfaces: closed forms, and what the arrays of a pair must satisfy.

use crate::common::vtu::Grid;
use crate::common::{Scene, case, distance, solve, text_of, winkler};
use std::collections::BTreeMap;
use winkler::api::Order;
use winkler::api::load as load_scene;
use winkler::internals::Interrupt;
use winkler::internals::contact::law::{self, Law, OwnLaws};
use winkler::internals::contact::pieces::{self, Cut, Reach};
use winkler::internals::contact::{ContactPair, PressureBasis, Side, assemble};
use winkler::internals::fem::{Frame, Space, assemble as fem};
use winkler::internals::mesh::{Mesh, load};

/// Runs a case with overrides of its scene; the run must converge.
fn run(name: &str, set: &[&str]) -> crate::common::Report {
    crate::common::here::solve_here(case(name), set).converged()
}

/// The mesh of a case, with overrides.
fn mesh<const D: usize>(name: &str, set: &str, order: Order) -> Mesh<D> {
    let scene = load_scene(&case(name), &[format!("mesh.set={set}")]).expect("a scene");
    load::<D>(&scene.mesh, &[Some(order)], &Interrupt::default()).expect("a mesh").mesh
}

/// Observed order from errors on meshes, each twice as fine as the one before.
fn order(errors: &[f64]) -> f64 {
    (errors[0] / errors[errors.len() - 1]).log2() / (errors.len() - 1) as f64
}

/// The groove in a thin slice of space gives the pressures and counts of the plane problem. As the thickness goes to zero,
/// 1.5e-3 of difference stay: the triangles on the sides of the slice have other diagonals.
#[test]
fn groove_in_a_slice() {
    let plane = run("groove", &["mesh.set.n=8"]);
    let exact = run("groove", &["mesh.set.n=8", "method={}"]).contact();
    for (thickness, tolerance) in [(0.125, 0.02), (0.01, 2e-3)] {
        let set = format!("mesh.set={{n=8, thickness={thickness}}}");
        let slice = run("groove3d", &[&set]);
        for count in ["iterations", "sweeps", "factorizations"] {
            assert_eq!(slice.count(count), plane.count(count), "{count}");
        }
        let ours = run("groove3d", &[&set, "method={}"]).contact();
        assert_eq!(ours.rows(), 2 * exact.rows());
        // in space points go by x, then z
        let mean: Vec<f64> = ours["pressure"]
            .chunks(2)
            .zip(ours["weight"].chunks(2))
            .map(|(p, w)| (p[0] * w[0] + p[1] * w[1]) / (w[0] + w[1]))
            .collect();
        let apart = distance(&mean, &exact["pressure"]);
        assert!(apart < tolerance, "thickness {thickness}: {apart}");
        let force = |run: &crate::common::Report| run.number("pairs/0/force/0/1");
        assert!((force(&slice) / (thickness * force(&plane)) - 1.0).abs() < tolerance);
    }
}

/// Lame's solutions for shells and rings under outer pressure, with a linear layer between: root mean square error of the pressure.
#[test]
fn shells_and_rings_under_pressure() {
    let error = |name: &str, exact: f64, degree: usize, set: &str| {
        let orders = [0, 1].map(|body| format!("body.{body}.order={degree}"));
        let table = run(name, &[&orders[0], &orders[1], set]).contact();
        let squares = table["pressure"].iter().zip(&table["weight"]).map(|(p, w)| w * (p / exact - 1.0).powi(2));
        (squares.sum::<f64>() / table["weight"].iter().sum::<f64>()).sqrt()
    };
    for (degree, expected, last) in [(1, 1.6, 1e-3), (2, 2.6, 2e-5)] {
        let meshes = ["{ni=6, no=8}", "{ni=12, no=16}", "{ni=24, no=32}"];
        let errors = meshes.map(|set| error("rings", 8.985_959_438, degree, &format!("mesh.set={set}")));
        assert!(order(&errors) > expected && errors[2] < last, "rings P{degree}: {errors:?}");
    }
    let errors = ["{hi=0.3, ho=0.2}", "{hi=0.15, ho=0.1}"]
        .map(|set| error("shells", 8.485_601_823, 1, &format!("mesh.set={set}")));
    assert!(order(&errors) > 1.0 && errors[1] < 6e-3, "shells P1: {errors:?}");
    let quadratic = error("shells", 8.485_601_823, 2, "mesh.set={hi=0.3, ho=0.2}");
    assert!(quadratic < 4e-3, "shells P2: {quadratic}");
}

/// What a pair on two surfaces of a mesh makes of a pressure of one: covered measure, gaps, and sums over both sides of the
/// forces on the nodes and of their moments about the origin.
struct Sums {
    measure: f64,
    gap: [f64; 2],
    forces: f64,
    moments: f64,
}

/// A pair on two surfaces of a mesh, the first of which carries the points, with the spaces of both bodies.
fn pair_on<const D: usize>(
    mesh: &Mesh<D>,
    order: [Order; 2],
    cut: Cut<D>,
    bodies: [&str; 2],
    groups: [&str; 2],
) -> (ContactPair, Vec<Space<D>>) {
    let (free, frame) = (BTreeMap::new(), Frame::default());
    let spaces: Vec<Space<D>> =
        (0..2).map(|k| Space::new(mesh, mesh.group(bodies[k]).expect("a body"), order[k])).collect();
    let side = |k: usize| {
        let facets = spaces[k].facets(mesh.group(groups[k]).expect("a surface"));
        Side::new(groups[k], &spaces[k], facets, &free, &frame, 40.0)
    };
    let (a, b) = (side(0), side(1));
    let shared = cut(&a, &b, &Reach::between(&a, &b, 60.0, None));
    let layer = load_scene(&case("patch"), &[]).expect("a scene").contacts.remove(0).layer;
    let pair =
        assemble(&a, &b, [0, 1], &shared, &|_| 0.0, &|at| law::make(&layer, &OwnLaws::default(), at).map(Law::from))
            .expect("a pair");
    (pair, spaces)
}

fn sums<const D: usize>(mesh: &Mesh<D>, order: [Order; 2], cut: Cut<D>, bodies: [&str; 2], groups: [&str; 2]) -> Sums {
    let (pair, spaces) = pair_on(mesh, order, cut, bodies, groups);
    let (mut force, mut moment) = ([0.0; 3], [0.0; 3]);
    for (side, space) in spaces.iter().enumerate() {
        for q in 0..pair.len() {
            for (dof, entry) in pair.rows[side].row(q) {
                let mut f = [0.0; 3];
                f[dof % D] = entry * pair.area[q];
                let x = winkler::internals::fem::pad(space.nodes[dof / D]);
                for c in 0..3 {
                    force[c] += f[c];
                    moment[c] += x[(c + 1) % 3] * f[(c + 2) % 3] - x[(c + 2) % 3] * f[(c + 1) % 3];
                }
            }
        }
    }
    let largest = |v: [f64; 3]| v.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let gaps = pair.gap.iter().copied();
    Sums {
        measure: pair.area.iter().sum(),
        gap: [gaps.clone().fold(f64::MAX, f64::min), gaps.fold(f64::MIN, f64::max)],
        forces: largest(force),
        moments: largest(moment),
    }
}

const INNER: [[&str; 2]; 2] = [["outer", "inner"], ["outer_contact", "inner_contact"]];

/// Gaps of concentric surfaces come at the order of the mesh, forces on both sides are opposite to rounding. The covered
/// measure is one order worse where the surface ends: the normal there is that of one facet.
fn concentric<const D: usize>(name: &str, meshes: &[&str], cut: Cut<D>, exact: f64, gap_orders: [f64; 2]) {
    for (degree, expected) in [Order::P1, Order::P2].into_iter().zip(gap_orders) {
        let (mut measures, mut gaps) = (Vec::new(), Vec::new());
        for set in meshes {
            let mesh = mesh::<D>(name, set, degree);
            let sums = sums(&mesh, [degree; 2], cut, INNER[0], INNER[1]);
            assert!(sums.forces < 1e-13, "{name} {degree:?} {set}: forces {}", sums.forces);
            // normals that are means of facets, times the distance of the surfaces
            assert!(
                sums.moments < 0.1 * (sums.gap[1] - sums.gap[0]) + 1e-12,
                "{name} {degree:?} {set}: {}",
                sums.moments
            );
            measures.push((sums.measure / exact - 1.0).abs());
            gaps.push((sums.gap[0] - 0.1).abs().max((sums.gap[1] - 0.1).abs()));
        }
        assert!(order(&measures) > 0.9 * (expected - 0.8), "{name} {degree:?}: measures {measures:?}");
        assert!(order(&gaps) > expected, "{name} {degree:?}: gaps {gaps:?}");
    }
}

#[test]
fn concentric_surfaces() {
    let pi = std::f64::consts::PI;
    let rings = ["{ni=6, no=8, gap=0.1}", "{ni=12, no=16, gap=0.1}", "{ni=24, no=32, gap=0.1}"];
    concentric::<2>("rings", &rings, pieces::in_plane, 0.5 * pi * 1.1, [1.8, 2.7]);
    let shells = ["{hi=0.4, ho=0.3, gap=0.1}", "{hi=0.2, ho=0.15, gap=0.1}"];
    concentric::<3>("shells", &shells, pieces::in_space, 0.5 * pi * 1.1 * 1.1, [1.5, 1.5]);
}

/// Plane surfaces that do not match: forces of both sides are opposite to rounding and moments to the share of a node
/// (1e-9) that counts as noise of the mesh, with any orders.
#[test]
fn moments_on_plane_surfaces() {
    for (first, second) in
        [(Order::P1, Order::P1), (Order::P2, Order::P2), (Order::P2, Order::P1), (Order::P1, Order::P2)]
    {
        let mesh = mesh::<3>("patch-3d", "{nl=3, nu=2, structured=0}", first.max(second));
        for bodies in [["lower", "upper"], ["upper", "lower"]] {
            let group = |body: &str| format!("{body}_{}", if body == "lower" { "top" } else { "bottom" });
            let groups = bodies.map(group);
            let sums = sums(&mesh, [first, second], pieces::in_space, bodies, groups.each_ref().map(String::as_str));
            assert!((sums.measure - 1.0).abs() < 1e-13, "{}", sums.measure);
            assert!(sums.forces < 1e-14 && sums.moments < 1e-10, "{} {}", sums.forces, sums.moments);
            assert_eq!(sums.gap, [0.0; 2]);
        }
    }
}

/// Quadratic triangles carry their points at the mid-edges, where B_a takes the displacement of that node alone. A block on a
/// larger one covers some facets of that in part: they carry points at their vertices, and all weights stay positive.
#[test]
fn points_of_quadratic_triangles() {
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    let script = "SetFactory(\"OpenCASCADE\");\nDefineConstant[ h = {0.3, Name \"h\"} ];\n\
        Box(1) = {0, 0, 0, 1, 1, 0.5};\nBox(2) = {0.3, 0.2, 0.5, 0.5, 0.55, 0.5};\n\
        Mesh.MeshSizeMin = h; Mesh.MeshSizeMax = h;\n\
        Physical Volume(\"large\") = {1}; Physical Surface(\"large_face\") = {6};\n\
        Physical Volume(\"small\") = {2}; Physical Surface(\"small_face\") = {11};\n";
    std::fs::write(folder.path().join("blocks.geo"), script).expect("a script");
    let text = "dimension = 3\nmesh = { geo = \"blocks.geo\", set = { h = 0.3 } }\n[[body]]\nname = \"large\"\norder = 1\nyoung = 1\npoisson = 0.3\n";
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).expect("a scene");
    let mesh = load::<3>(&load_scene(&path, &[]).expect("a scene").mesh, &[Some(Order::P2)], &Interrupt::default())
        .expect("a mesh")
        .mesh;
    // which nodes of a facet carry points: the vertices, or the mid-edges
    let kind = |basis: &PressureBasis| [0, 3].map(|node| basis.carries(node));
    let [vertices, mid_edges] = [Some([true, false]), Some([false, true])];
    for (bodies, kinds) in
        [(["small", "large"], vec![mid_edges]), (["large", "small"], vec![None, vertices, mid_edges])]
    {
        let groups = bodies.map(|body| format!("{body}_face"));
        let groups = groups.each_ref().map(String::as_str);
        let (pair, spaces) = pair_on(&mesh, [Order::P2; 2], pieces::in_space, bodies, groups);
        let carriers: Vec<_> = pair.cover.iter().map(|cover| cover.basis.as_ref().map(kind)).collect();
        assert!(kinds.iter().all(|kind| carriers.contains(kind)), "{bodies:?}: {carriers:?}");
        assert!(carriers.iter().all(|kind| kinds.contains(kind)), "{bodies:?}: {carriers:?}");
        assert!(pair.area.iter().all(|&weight| weight > 0.0), "{bodies:?}: {:?}", pair.area);
        let sums = sums(&mesh, [Order::P2; 2], pieces::in_space, bodies, groups);
        assert!((sums.measure - 0.5 * 0.55).abs() < 1e-13, "{bodies:?}: {}", sums.measure);
        assert!(sums.forces < 1e-14 && sums.moments < 1e-10, "{bodies:?}: {} {}", sums.forces, sums.moments);
        if kinds.len() > 1 {
            continue;
        }
        for q in 0..pair.len() {
            let entries: Vec<(usize, f64)> = pair.rows[0].row(q).filter(|entry| entry.1 != 0.0).collect();
            let [(dof, share)] = entries[..] else { panic!("{entries:?} at point {q}") };
            assert_eq!(dof / 3, pair.nodes[q] as usize);
            assert!((share.abs() - 1.0).abs() < 1e-12, "{share}");
            let node = spaces[0].nodes[dof / 3];
            assert!((0..3).all(|c| (pair.position[q][c] - node[c]).abs() < 1e-12), "{node:?}");
        }
    }
}

/// Isoparametric tetrahedra from OpenCASCADE: volume and surface of a ball at order 2 (P1) and at least 3.5 (P2).
#[test]
fn volume_and_area_of_a_ball() {
    let pi = std::f64::consts::PI;
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    let script = "SetFactory(\"OpenCASCADE\");\nDefineConstant[ h = {0.5, Name \"h\"} ];\nSphere(1) = {0, 0, 0, 1};\n\
        Mesh.MeshSizeMin = h; Mesh.MeshSizeMax = h;\n\
        Physical Volume(\"ball\") = {1}; Physical Surface(\"skin\") = {1};\n";
    std::fs::write(folder.path().join("ball.geo"), script).expect("a script");
    let text = "dimension = 3\nmesh = { geo = \"ball.geo\", set = { h = 0.5 } }\n[[body]]\nname = \"ball\"\norder = 1\nyoung = 1\npoisson = 0.3\n";
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).expect("a scene");
    for (degree, expected) in [(Order::P1, 1.7), (Order::P2, 3.5)] {
        let errors = [0.4, 0.2].map(|h| {
            let scene = load_scene(&path, &[format!("mesh.set.h={h}")]).expect("a scene");
            let mesh = load::<3>(&scene.mesh, &[Some(degree)], &Interrupt::default()).expect("a mesh").mesh;
            let space = Space::new(&mesh, mesh.group("ball").expect("a body"), degree);
            let volume = fem::body_force(&space, &|_| [1.0, 0.0, 0.0]).sum()[0];
            let facets = space.facets(mesh.group("skin").expect("a surface"));
            let unit = |_, _| [1.0, 0.0, 0.0];
            let area = winkler::internals::fem::surface::surface_load(&space, &facets, &unit).sum()[0];
            // the boundary found from the cells is the group, facet by facet
            let sorted = |facets: &winkler::internals::fem::Facets<3>| {
                let mut all: Vec<Vec<u32>> = (0..facets.count()).map(|i| facets.facet(i).to_vec()).collect();
                all.iter_mut().for_each(|facet| facet.sort_unstable());
                all.sort();
                all
            };
            assert_eq!(sorted(&space.boundary()), sorted(&facets));
            [(volume / (4.0 / 3.0 * pi) - 1.0).abs(), (area / (4.0 * pi) - 1.0).abs()]
        });
        for what in 0..2 {
            let found = order(&[errors[0][what], errors[1][what]]);
            assert!(found > expected, "{degree:?} {}: {errors:?}", ["volume", "area"][what]);
        }
    }
}

/// A scene of a case with its contacts replaced by one that looks for pairs.
fn automatic(name: &str, distance: f64) -> Scene {
    let text = text_of(name);
    let (before, rest) = text.split_once("[[contact]]").expect("a contact");
    let after = rest.find("\n[method]").map_or("", |at| &rest[at..]);
    let contact = format!(
        "[[contact]]\nbetween = \"auto\"\ndistance = {distance}\nlayer = {{ power = {{ B = 2.5e-5, a = 0.5 }} }}\n"
    );
    Scene::new(format!("{before}{contact}{after}"))
}

#[test]
fn pairs_are_found_on_the_mesh() {
    // the same pair as the one with names
    for name in ["patch", "patch-3d", "groove3d"] {
        let found = solve(automatic(name, 0.01), &["--set", "contact.0.gap=0.0"]).converged();
        let named = run(name, &["contact.0.gap=0.0"]);
        assert_eq!(found.report["pairs"][0]["surfaces"], serde_json::json!(["lower", "upper"]));
        assert_eq!(found.count("iterations"), named.count("iterations"), "{name}");
        assert!(distance(&found.contact()["pressure"], &named.contact()["pressure"]) < 1e-12, "{name}");
    }
    // four blocks: each touches the one beside it and the one above, none its diagonal neighbour
    let quarters = automatic("stack", 0.01);
    let text = quarters
        .text
        .replace("[[contact]]", "[[body]]\nname = \"b4\"\norder = 1\nyoung = 1e5\npoisson = 0.3\n\n[[contact]]");
    let quarters = Scene::new(text);
    let path = quarters.path.to_str().expect("a path");
    let checked =
        winkler(&["check", path, "--json", "--set", "mesh.set={rows=2,columns=2}", "--set", "body.2.load=[]"]);
    let report: serde_json::Value =
        serde_json::from_str(&checked.stdout).unwrap_or_else(|_| panic!("{}", checked.said()));
    let pairs: Vec<String> =
        report["pairs"].as_array().expect("pairs").iter().map(|pair| pair["surfaces"].to_string()).collect();
    let sorted = |pair: &str| {
        let mut names: Vec<&str> =
            pair.trim_matches(['[', ']']).split(',').map(|name| name.trim_matches('"')).collect();
        names.sort();
        names.join(" ")
    };
    let pairs: Vec<String> = pairs.iter().map(|pair| sorted(pair)).collect();
    assert_eq!(pairs, ["b1 b2", "b1 b3", "b2 b4", "b3 b4"]);
    assert!(
        report["pairs"]
            .as_array()
            .expect("pairs")
            .iter()
            .all(|pair| (pair["length"].as_f64().expect("a length") - 1.0).abs() < 1e-9)
    );
}

/// Arrays of the nodes of a surface file by name; `points` are their coordinates.
fn surface_of<const N: usize>(run: &crate::common::Run, stem: &str, names: [&str; N]) -> [Vec<f64>; N] {
    let grid = Grid::read(&run.folder.join(format!("{stem}.vtu")));
    names.map(|name| if name == "points" { grid.points.clone() } else { grid.arrays[name].clone() })
}

/// The surface file has the pressures of the contact table at its points.
#[test]
fn surfaces_are_written() {
    for (name, set) in [("patch-2d", "body.1.order=2"), ("shells", "body.0.order=1"), ("shells", "body.0.order=2")] {
        let run = solve(case(name), &["--vtu", "--set", set]).converged();
        let side = |k: usize| run.text(&format!("pairs/0/bodies/{k}"));
        let stem = format!("contact-{}-{}", side(0), side(1));
        let collection = std::fs::read_to_string(run.folder.join("bodies.pvd")).expect("a collection");
        assert!(collection.contains(&format!("file=\"{stem}.vtu\"")), "{collection}");
        assert!(run.report["files"].to_string().contains(&format!("{stem}.vtu")));
        let [points, pressure, compression, gap, normal] =
            surface_of(&run, &stem, ["points", "pressure", "compression", "gap", "normal"]);
        assert_eq!((pressure.len(), gap.len()), (points.len() / 3, points.len() / 3));
        assert!(pressure.iter().all(|p| (8.0..11.0).contains(p)), "{name} {set}: {pressure:?}");
        assert!(compression.iter().all(|c| *c > 0.0));
        for (x, n) in points.chunks(3).zip(normal.chunks(3)) {
            let length: f64 = n.iter().map(|n| n * n).sum::<f64>().sqrt();
            assert!((length - 1.0).abs() < 0.05, "{name}: a normal of length {length}");
            if name == "shells" {
                // the outer shell carries the points: its normals look inwards
                let along: f64 = x.iter().zip(n).map(|(x, n)| x * n).sum();
                assert!(along < -0.9, "{along}");
            }
        }
        let largest = |values: &[f64]| values.iter().copied().fold(f64::MIN, f64::max);
        assert!((largest(&pressure) / largest(&run.contact()["pressure"]) - 1.0).abs() < 1e-12);
    }
}

/// The vertices of quadratic facets, which carry no points, have what the mid-edges around them make of a linear gap; the least and
/// the greatest one, at two corners, stay within the values of these.
#[test]
fn vertices_between_points_at_mid_edges() {
    let sets = ["body.0.order=2", "body.1.order=2", "contact.0.gap=1e-6*(x+y)", "output.vtu=true"];
    let run = solve(case("patch-3d"), &sets.map(|set| ["--set", set]).concat()).converged();
    let [x, gap] = surface_of(&run, "contact-lower-upper", ["points", "gap"]);
    let gap: Vec<f64> = gap.iter().map(|gap| 1e6 * gap).collect();
    for (x, gap) in x.chunks(3).zip(&gap) {
        let exact = x[0] + x[1];
        let at_corner = !(1e-9..=2.0 - 1e-9).contains(&exact);
        let apart = if at_corner { 1.0 / 6.0 } else { 0.0 };
        assert!(((gap - exact).abs() - apart).abs() < 1e-9, "{x:?} {gap}");
    }
    // three elements along each edge
    assert_eq!(gap.len(), 49);
}

#[test]
fn an_overlap_is_taken_or_refused() {
    let deep = ["--set", "contact.0.gap=-1e-5"];
    let taken = solve(case("patch-3d"), &deep).converged();
    // who types an overlap knows of it
    assert!(!taken.warnings().contains("overlap"), "{}", taken.warnings());
    // the layer closes by as much as without the overlap
    assert!((taken.contact()["compression"][0] / (2.5e-5 * 10f64.sqrt()) - 1.0).abs() < 1e-9);
    let refused = solve(case("patch-3d"), &[deep[0], deep[1], "--set", "contact.0.overlap=error"]);
    assert_eq!(refused.code, 3);
    assert!(refused.stderr.contains("overlap by 1.000e-5 at (") && refused.stderr.contains('^'), "{}", refused.said());
    solve(case("patch-3d"), &["--set", "contact.0.overlap=error"]).converged();
}

#[test]
fn contacts_that_cannot_be_found_are_refused() {
    let refused = |scene: &Scene, words: &[&str]| {
        let run = solve(scene, &[]);
        assert_eq!(run.code, 3, "{}", run.said());
        words.iter().for_each(|word| assert!(run.stderr.contains(word), "no `{word}`\n{}", run.said()));
    };
    let far = automatic("patch", 0.01);
    let text = far.text.replace("distance = 0.01\n", "");
    refused(&Scene::new(text), &["distance", "face each other"]);
    let text = far.text.replace("\"auto\"", "\"automatic\"");
    refused(&Scene::new(text), &["between `automatic` alone", "between = \"auto\""]);
    let text = far.text.replace("\"auto\"", "[\"lower_top\", \"upper_bottom\"]\nof = [\"lower\", \"upper\"]");
    refused(&Scene::new(text), &["`of` for surfaces with names"]);
    let apart = automatic("rings", 0.01);
    let text = apart.text.replace("set = { ni = 6, no = 8 }", "set = { gap = 0.1 }");
    refused(&Scene::new(text), &["no facets of different bodies face each other within 0.01", "larger distance"]);
}
