//! Tests on meshes with one mistake each, and on meshes without mistakes.

use super::{Asked, BodyCheck, Duty};
use crate::mesh::{Group, Mesh};
use crate::problem::order::Order;

/// Return a mesh with one body of simplices on points.
fn mesh<const D: usize>(points: Vec<[f64; D]>, cells: &[u32]) -> Mesh<D> {
    let stride = D + 1;
    let tags = (1..=(cells.len() / stride) as u64).collect();
    let body = Group { name: "body".into(), dimension: D, stride, connectivity: cells.to_vec(), tags };
    Mesh::new("a.msh".into(), points, Order::P1, vec![body].into())
}

fn with_group<const D: usize>(mesh: Mesh<D>, name: &str, dimension: usize, connectivity: Vec<u32>) -> Mesh<D> {
    let (stride, tags) = (dimension + 1, vec![90, 91, 92, 93]);
    let mut groups = mesh.groups.to_vec();
    groups.push(Group { name: name.into(), dimension, stride, connectivity, tags });
    Mesh { groups: groups.into(), ..mesh }
}

fn check<const D: usize>(mesh: &Mesh<D>, groups: &[(&str, Duty)]) -> Result<BodyCheck, String> {
    let asked = Asked { name: "body", order: mesh.order, groups: groups.to_vec() };
    mesh.check(&[asked], &[], false).map(|mut found| found.remove(0)).map_err(|error| error.to_string())
}

fn refused<const D: usize>(mesh: &Mesh<D>, words: &[&str]) {
    let message = check(mesh, &[]).expect_err(words[0]);
    assert!(words.iter().all(|words| message.contains(words)) && message.contains("help: "), "{words:?}\n{message}");
}

/// Two squares side by side, each in two triangles.
///
/// ```text
/// 3 - 4 - 5
/// | \ | \ |
/// 0 - 1 - 2
/// ```
fn squares() -> (Vec<[f64; 2]>, Vec<u32>) {
    let points = vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 1.0], [1.0, 1.0], [2.0, 1.0]];
    (points, vec![0, 1, 3, 1, 4, 3, 1, 2, 4, 2, 5, 4])
}

/// Return a unit cube with a corner at `from` as six tetrahedra around a diagonal. Corners are numbered from `first`.
fn cube(from: [f64; 3], first: u32) -> (Vec<[f64; 3]>, Vec<u32>) {
    let points = (0..8).map(|k| [0, 1, 2].map(|c| from[c] + f64::from(k >> c & 1))).collect();
    let around = [1, 3, 2, 6, 4, 5];
    let cells = (0..6).flat_map(|k| [0, around[k], around[(k + 1) % 6], 7].map(|corner| first + corner)).collect();
    (points, cells)
}

#[test]
fn good_meshes_are_counted() {
    let (points, cells) = squares();
    let plane = mesh(points, &cells);
    let (points, cells) = cube([0.0; 3], 0);
    let space = mesh(points, &cells);
    for (found, counts) in [
        (check(&plane, &[]), [3, 6, 1]),
        (check(&plane.higher_order(Order::P2), &[]), [3, 6, 1]),
        (check(&space, &[]), [6, 12, 1]),
        (check(&space.higher_order(Order::P2), &[]), [6, 12, 1]),
    ] {
        let found = found.unwrap();
        assert_eq!([found.inner, found.outer, found.parts.count], counts);
    }
}

#[test]
fn cells_that_overlap() {
    let (points, cells) = squares();
    // The first mesh repeats an inner cell, the second one repeats its only cell.
    refused(&mesh(points.clone(), &[&cells[..], &[1, 4, 3]].concat()), &["3 cells share the facet", "elements"]);
    refused(&mesh(points.clone(), &[0, 1, 3, 0, 1, 3]), &["same side", "elements 1 and 2"]);
    // Node 1 is pulled out of the cells around it. The reader would have turned the cell that is inverted by that.
    let mut folded = points.clone();
    folded[1] = [1.2, 1.4];
    let turned = [0, 1, 3, 1, 3, 4, 1, 4, 2, 2, 5, 4];
    refused(&mesh(folded, &turned), &["same side of the facet that they share"]);
}

/// A hole is not a mistake, and neither is a part in a hole.
#[test]
fn holes_and_what_is_in_them() {
    let ring: Vec<[f64; 2]> = (0..16)
        .map(|k| {
            let (angle, radius) = (f64::from(k % 8) * std::f64::consts::FRAC_PI_4, if k < 8 { 1.0 } else { 2.0 });
            [radius * angle.cos(), radius * angle.sin()]
        })
        .collect();
    let mut cells: Vec<u32> =
        (0..8).flat_map(|k| [k, 8 + k, 8 + (k + 1) % 8, k, 8 + (k + 1) % 8, (k + 1) % 8]).collect();
    assert_eq!(check(&mesh(ring.clone(), &cells), &[]).unwrap().outer, 16);
    cells.extend([16, 17, 18]);
    let core = mesh([&ring[..], &[[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]]].concat(), &cells);
    assert_eq!(check(&core, &[]).unwrap().parts.count, 2);
}

#[test]
fn cracks() {
    // The node between 1 and 4 belongs to the right square only.
    let (points, _) = squares();
    let hanging = mesh([&points[..], &[[1.0, 0.5]]].concat(), &[0, 1, 3, 1, 4, 3, 1, 2, 6, 6, 5, 4, 2, 5, 6]);
    refused(&hanging, &["a node hangs on a facet", "at (1, 0.5)"]);
    // The left square has a node of its own at corner 4.
    let own = mesh([&points[..], &[[1.0, 1.0]]].concat(), &[0, 1, 3, 1, 6, 3, 1, 2, 4, 2, 5, 4]);
    refused(&own, &["nodes of their own", "at (1, 1)"]);
    refused(&own.higher_order(Order::P2), &["nodes of their own"]);
    // Both cubes have their own nodes on the common face.
    let (mut points, mut cells) = cube([0.0; 3], 0);
    let (more, others) = cube([1.0, 0.0, 0.0], 8);
    points.extend(more);
    cells.extend(others);
    refused(&mesh(points.clone(), &cells), &["nodes of their own"]);
    // The faces of these cubes do not match: the second cube is smaller along y and z.
    for x in &mut points[8..] {
        (x[1], x[2]) = (0.3 + 0.4 * x[1], 0.2 + 0.5 * x[2]);
    }
    refused(&mesh(points, &cells), &["a node hangs on a facet"]);
}

#[test]
fn cells_that_hang_by_less_than_a_facet() {
    let (points, cells) = squares();
    let by_corner = mesh([&points[..], &[[3.0, 2.0], [2.0, 2.0]]].concat(), &[&cells[..], &[5, 6, 7]].concat());
    refused(&by_corner, &["an edge or a corner alone", "(2, 1)", "elements 4 and 5"]);
    let (points, cells) = cube([0.0; 3], 0);
    let more = [[2.0, 0.5, 2.0], [2.0, 0.6, 1.5]];
    // The cells share the edge between the corners 5 and 7.
    let by_edge = mesh([&points[..], &more].concat(), &[&cells[..], &[5, 7, 9, 8]].concat());
    refused(&by_edge, &["an edge or a corner alone"]);
}

#[test]
fn mid_edge_nodes() {
    let (points, cells) = squares();
    let good = mesh(points, &cells).higher_order(Order::P2);
    let mut other = good.clone();
    // The right square alone gets a second node in the middle of 1-4.
    let middle = good.groups[0].connectivity[6 + 3];
    other.points.push(other.points[middle as usize]);
    let new = other.points.len() as u32 - 1;
    let cell = &mut other.groups[0].connectivity[12..18];
    let place = cell.iter().position(|&node| node == middle).unwrap();
    cell[place] = new;
    refused(&other, &["different mid-edge nodes", "elements 2 and 3"]);
    let mut two = good;
    two.groups[0].connectivity[3] = two.groups[0].connectivity[5];
    refused(&two, &["a node lies on two edges"]);
}

#[test]
fn groups_lie_on_their_bodies() {
    let (points, cells) = squares();
    let plane = || mesh(points.clone(), &cells);
    let bottom = with_group(plane(), "bottom", 1, vec![0, 1, 1, 2]);
    for mesh in [bottom.clone(), bottom.higher_order(Order::P2)] {
        assert!(check(&mesh, &[("bottom", Duty::Acts), ("bottom", Duty::Holds)]).is_ok());
    }
    // One facet is inside, where a support may constrain it. Others are not facets of the body.
    let inside = with_group(plane(), "bottom", 1, vec![0, 1, 1, 4]);
    assert!(check(&inside, &[("bottom", Duty::Holds)]).is_ok());
    for (mesh, duty, words) in [
        (&inside, Duty::Acts, "a facet of group `bottom` bounds no body that it serves, at (1, 0.5)"),
        (&with_group(plane(), "bottom", 1, vec![0, 1, 0, 2]), Duty::Acts, "bounds no body that it serves, at (1, 0)"),
        (&with_group(plane(), "bottom", 1, vec![0, 1, 0, 2]), Duty::Holds, "belongs to no body of the scene"),
    ] {
        let message = check(mesh, &[("bottom", duty)]).unwrap_err();
        assert!(message.contains(words) && message.contains("element 91"), "{message}");
    }
    let message = check(&with_group(plane(), "bottom", 1, vec![0, 1, 1, 0]), &[("bottom", Duty::Acts)]).unwrap_err();
    assert!(message.contains("stands twice in it") && message.contains("element 91"), "{message}");
    // The mid-edge nodes are exchanged.
    let mut wrong = bottom.higher_order(Order::P2);
    wrong.groups[1].connectivity.swap(2, 5);
    assert!(check(&wrong, &[("bottom", Duty::Acts)]).is_err());
    // A group that lies elsewhere is left to the caller, which reports the line of the scene.
    let far = Mesh { points: [&points[..], &[[5.0, 5.0], [6.0, 5.0]]].concat(), ..plane() };
    assert!(check(&with_group(far, "far", 1, vec![6, 7]), &[("far", Duty::Acts)]).is_ok());
    // These groups are edges in space.
    let (points, cells) = cube([0.0; 3], 0);
    let space = |edge: [u32; 2]| with_group(mesh(points.clone(), &cells), "edge", 1, edge.to_vec());
    assert!(check(&space([0, 1]), &[("edge", Duty::Holds)]).is_ok());
    assert!(check(&space([1, 2]), &[("edge", Duty::Holds)]).is_err());
}
