//! Tests on the geometries in `meshes/`.

use super::*;

fn case(script: &str, set: &[(&str, f64)]) -> Mesh<2> {
    let folder = tempfile::tempdir().unwrap();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes").join(script);
    let set: Vec<(String, f64)> = set.iter().map(|(name, value)| (name.to_string(), *value)).collect();
    meshed(&file, &set, Order::P1, &[folder.path().to_owned()]).unwrap().mesh
}

/// Accuracy with which Gmsh places the nodes of a transfinite line.
const PLACES: f64 = 1e-10;

/// Return the vertices of the triangles of a group on a fine grid, sorted. They are reflected about y = `reflect`, if it is
/// given.
fn triangles(mesh: &Mesh<2>, group: &str, reflect: Option<f64>) -> Vec<[[i64; 2]; 3]> {
    let place = |point: &u32| {
        let [x, y] = mesh.points[*point as usize];
        let y = reflect.map_or(y, |middle| 2.0 * middle - y);
        [x, y].map(|coordinate| (coordinate * 1e6).round() as i64)
    };
    let mut all: Vec<[[i64; 2]; 3]> = mesh
        .group(group)
        .unwrap()
        .simplices()
        .map(|simplex| {
            let mut vertices = [place(&simplex[0]), place(&simplex[1]), place(&simplex[2])];
            vertices.sort();
            vertices
        })
        .collect();
    all.sort();
    all
}

/// Assert that the upper body mirrors the lower one, and that they share no point.
fn assert_mirrored(mesh: &Mesh<2>, middle: f64) {
    let lower = mesh.group("lower").unwrap();
    let upper = mesh.group("upper").unwrap();
    assert!(triangles(mesh, "lower", None) == triangles(mesh, "upper", Some(middle)));
    assert!(triangles(mesh, "lower", None) != triangles(mesh, "upper", None));
    assert!(!lower.connectivity.iter().any(|point| upper.connectivity.contains(point)));
}

fn count(mesh: &Mesh<2>, group: &str) -> usize {
    mesh.group(group).unwrap().len()
}

fn area(mesh: &Mesh<2>, group: &str) -> f64 {
    0.5 * extent(mesh, mesh.group(group).unwrap())
}

#[test]
fn the_groove_has_the_papers_triangles() {
    let mesh = case("groove/groove.geo", &[]);
    assert_eq!([count(&mesh, "lower"), count(&mesh, "upper")], [8192, 8192]);
    let mesh = case("groove/groove.geo", &[("n", 8.0)]);
    assert_eq!(count(&mesh, "lower"), 2 * 4 * 8 * 8);
    assert_eq!([count(&mesh, "lower_top"), count(&mesh, "upper_bottom"), count(&mesh, "upper_axis")], [32, 32, 8]);
    assert!((area(&mesh, "lower") - 4.0).abs() < PLACES && (area(&mesh, "upper") - 4.0).abs() < PLACES);
    assert_mirrored(&mesh, 1.0);
    let at = |group: &str, k: usize, value: f64| {
        let points = &mesh.group(group).unwrap().connectivity;
        assert!(points.iter().all(|point| (mesh.points[*point as usize][k] - value).abs() < PLACES), "{group}");
    };
    at("lower_top", 1, 1.0);
    at("upper_bottom", 1, 1.0);
    at("lower_face", 1, 0.0);
    at("upper_face", 1, 2.0);
    for body in ["lower", "upper"] {
        at(&format!("{body}_axis"), 0, 4.0);
        at(&format!("{body}_end"), 0, 0.0);
    }
}

#[test]
fn the_patch_takes_any_two_meshes() {
    let mesh = case("patch/patch.geo", &[("nl", 2.0), ("nu", 3.0)]);
    assert_eq!([count(&mesh, "lower"), count(&mesh, "upper")], [8, 18]);
    assert_eq!([count(&mesh, "lower_top"), count(&mesh, "upper_bottom")], [2, 3]);
    let pin = |name: &str| mesh.points[mesh.group(name).unwrap().connectivity[0] as usize];
    assert_eq!([pin("lower_pin"), pin("upper_pin")], [[0.0, 0.0], [0.0, 2.0]]);
    assert_mirrored(&case("patch/patch.geo", &[]), 1.0);
}

#[test]
fn waves_of_any_length_keep_their_triangles_in_shape() {
    for (length, rows) in [(2.0, 8), (8.0, 2)] {
        let mesh = case("wavy/wavy.geo", &[("L", length), ("n", 8.0)]);
        assert_eq!([count(&mesh, "lower_top"), count(&mesh, "lower_sides")], [8, 2 * rows]);
        assert!((area(&mesh, "upper") - 0.5 * length).abs() < PLACES);
        assert_mirrored(&mesh, 1.0);
    }
}

#[test]
fn half_planes_are_fine_at_the_groove_and_coarse_far_away() {
    let mesh = case("half-planes/half-planes.geo", &[("n", 16.0)]);
    assert!((area(&mesh, "lower") - 256.0).abs() < 1e-8);
    assert_mirrored(&mesh, 16.0);
    // These are the distance from the axis and the length of each edge of the contact surface.
    let edges: Vec<(f64, f64)> = mesh
        .group("lower_top")
        .unwrap()
        .simplices()
        .map(|edge| {
            let [a, b] = [edge[0], edge[1]].map(|point| mesh.points[point as usize][0]);
            (16.0 - a.max(b), (a - b).abs())
        })
        .collect();
    assert!(edges.iter().filter(|(from, _)| *from < 1.99).all(|(_, length)| (length - 1.0 / 16.0).abs() < PLACES));
    let longest = edges.iter().map(|(_, length)| *length).fold(0.0, f64::max);
    assert!((0.9..1.1).contains(&longest), "{longest}");
    // The edge of the groove, where the pressure has a kink, is a node.
    assert!(edges.iter().any(|(from, _)| (from - 1.0).abs() < PLACES));
}
