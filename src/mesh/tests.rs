//! Tests on meshes that the real Gmsh makes.

mod cases;
mod damage;
mod loading;
mod mutations;

use super::load::from_script;
use super::{Group, Loaded, Mesh, msh, simplex};
use crate::error::{Located, Place, Result, Source};
use crate::interrupt::Interrupt;
use crate::problem::{Guard, Order};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Two materials in the unit square, and an element without a group.
const SQUARE: &str = r#"
DefineConstant[ n = {2, Name "n"} ];
Point(1) = {0, 0, 0}; Point(2) = {1/4, 0, 0}; Point(3) = {1, 0, 0};
Point(4) = {1, 1, 0}; Point(5) = {1/4, 1, 0}; Point(6) = {0, 1, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 6}; Line(6) = {6, 1};
Line(7) = {2, 5};
Curve Loop(1) = {1, 7, 5, 6}; Plane Surface(1) = {1};
Curve Loop(2) = {-7, 2, 3, 4}; Plane Surface(2) = {-2};
Transfinite Curve {1:7} = n + 1;
Transfinite Surface {1, 2};
Point(9) = {7, 8, 0}; Physical Point("corner") = {3};
Physical Surface("soft rock") = {1};
Physical Surface("steel") = {2};
Physical Curve("left") = {6};
Physical Curve("outside") = {1:6};
"#;

/// Two materials in the unit cube.
const CUBE: &str = r#"
SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 1, 1, 1/4};
Box(2) = {0, 0, 1/4, 1, 1, 3/4};
Coherence;
MeshSize{ PointsOf{ Volume{1, 2}; } } = 1/2;
Physical Volume("soft") = {1};
Physical Volume("hard") = {2};
Physical Surface("bottom") = Surface In BoundingBox{-1, -1, -1e-3, 2, 2, 1e-3};
Physical Point("pin") = Point In BoundingBox{-1e-3, -1e-3, -1e-3, 1e-3, 1e-3, 1e-3};
"#;

fn located(path: PathBuf) -> Located<PathBuf> {
    let source = Source { name: "scene.toml".into(), text: "mesh = 1".into() };
    Located::new(path, Place { source: source.into(), span: 0..4 })
}

/// Return the mesh of a script with these numbers, kept in a cache.
fn meshed<const D: usize>(geo: &Path, set: &[(String, f64)], order: Order, cache: &[PathBuf]) -> Result<Loaded<D>> {
    let limits = (&Guard::default(), &Interrupt::default());
    from_script(&located(geo.to_owned()), (set, &[]), None, order, limits, cache)
}

/// Return the bytes of the mesh of a script in the form that these arguments request.
fn gmsh(script: &str, arguments: &[&str]) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let (geo, out) = (folder.path().join("a.geo"), folder.path().join("a.msh"));
    std::fs::write(&geo, script).unwrap();
    let status = Command::new("gmsh")
        .args(["-v", "0", "-format", "msh41"])
        .args(arguments)
        .arg("-o")
        .arg(&out)
        .arg(&geo)
        .status();
    assert!(status.unwrap().success());
    std::fs::read(out).unwrap()
}

fn parse<const D: usize>(bytes: &[u8]) -> Result<Mesh<D>> {
    msh::parse(Path::new("a.msh"), bytes, msh::Maker::User)
}

/// Return the sum of the measures of a group, times the factorial of its dimension.
fn extent<const D: usize>(mesh: &Mesh<D>, group: &Group) -> f64 {
    group
        .simplices()
        .map(|simplex| {
            let place =
                |point: &u32| std::array::from_fn(|k| mesh.points[*point as usize].get(k).copied().unwrap_or(0.0));
            let vertices: Vec<[f64; 3]> = simplex[..group.dimension + 1].iter().map(place).collect();
            simplex::measure(&vertices, D)
        })
        .sum()
}

/// Assert that every mid-edge point of a straight mesh lies between its two vertices.
fn assert_mid_edges<const D: usize>(mesh: &Mesh<D>) {
    const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];
    for group in mesh.groups.iter().filter(|group| group.dimension > 0) {
        for simplex in group.simplices() {
            let middles = &simplex[group.dimension + 1..];
            assert_eq!(middles.len(), [0, 1, 3, 6][group.dimension]);
            for (middle, [a, b]) in middles.iter().zip(EDGES) {
                for k in 0..D {
                    let at = |point: u32| mesh.points[point as usize][k];
                    let between = 0.5 * (at(simplex[a]) + at(simplex[b]));
                    assert!((at(*middle) - between).abs() < 1e-9, "{} of `{}`", middle, group.name);
                }
            }
        }
    }
}

#[test]
fn squares_of_both_forms_and_orders() {
    for order in ["1", "2"] {
        let [text, binary] = [&[][..], &["-bin"]].map(|form| {
            let mesh: Mesh<2> = parse(&gmsh(SQUARE, &[&["-2", "-order", order], form].concat())).unwrap();
            mesh
        });
        // Text has 16 digits, so coordinates may differ in the last one.
        assert_eq!(text.groups, binary.groups);
        for mesh in [&text, &binary] {
            let count = |name| mesh.group(name).unwrap().len();
            assert_eq!(
                [count("soft rock"), count("steel"), count("left"), count("outside"), count("corner")],
                [8, 8, 2, 12, 1]
            );
            assert_eq!(mesh.group_names(2).collect::<Vec<_>>(), ["soft_rock", "steel"]);
            assert_eq!(mesh.points.len(), if order == "1" { 15 } else { 45 });
            let size = |name| extent(mesh, mesh.group(name).unwrap());
            for (name, expected) in [("soft rock", 0.5), ("steel", 1.5), ("left", 1.0), ("outside", 4.0)] {
                assert!((size(name) - expected).abs() < 1e-9, "{name}: {}", size(name));
            }
            // Each cell is positive, although one surface is drawn clockwise.
            for group in mesh.groups.iter().filter(|group| group.dimension == 2) {
                for cell in group.connectivity.chunks(group.stride) {
                    let one = Group { connectivity: cell.to_vec(), ..group.clone() };
                    assert!(extent(mesh, &one) > 0.0);
                }
            }
            let corner = mesh.group("corner").unwrap().connectivity[0];
            assert_eq!(mesh.points[corner as usize], [1.0, 0.0]);
        }
        if order == "2" {
            assert_mid_edges(&text);
            let lower = text.lower_order();
            assert_eq!((lower.points.len(), lower.order), (15, Order::P1));
            assert!((extent(&lower, lower.group("steel").unwrap()) - 1.5).abs() < 1e-9);
            assert_eq!(lower.group("left").unwrap().stride, 2);
        }
    }
}

#[test]
fn cubes_of_both_forms_and_orders() {
    for order in ["1", "2"] {
        for form in [&[][..], &["-bin"]] {
            let mesh: Mesh<3> = parse(&gmsh(CUBE, &[&["-3", "-order", order], form].concat())).unwrap();
            let size = |name| extent(&mesh, mesh.group(name).unwrap());
            for (name, expected) in [("soft", 1.5), ("hard", 4.5), ("bottom", 2.0)] {
                assert!((size(name) - expected).abs() < 1e-9, "{name}: {}", size(name));
            }
            assert_eq!(mesh.group("pin").unwrap().len(), 1);
            if order == "2" {
                assert_eq!(mesh.group("soft").unwrap().stride, 10);
                assert_mid_edges(&mesh);
            }
        }
    }
}

#[test]
fn inverted_cells_are_turned_and_order_two_with_them() {
    for order in ["1", "2"] {
        let script = format!("{SQUARE}\nMesh 2;\nReverseMesh Surface{{1}};");
        let mesh: Mesh<2> = parse(&gmsh(&script, &["-2", "-order", order])).unwrap();
        assert!((extent(&mesh, mesh.group("soft rock").unwrap()) - 0.5).abs() < 1e-9);
        // The negative scale is a reflection through the origin.
        let cube: Mesh<3> =
            parse(&gmsh(CUBE, &["-3", "-order", order, "-setnumber", "Mesh.ScalingFactor", "-1"])).unwrap();
        assert!(cube.points.iter().flatten().all(|coordinate| *coordinate <= 0.0));
        assert!((extent(&cube, cube.group("soft").unwrap()) - 1.5).abs() < 1e-9);
        if order == "2" {
            assert_mid_edges(&mesh);
            assert_mid_edges(&cube);
        }
    }
}
