//! Tests on meshes that the real Gmsh makes: of scripts, of damaged files, and of the way through the cache.

mod mutations;

use super::cache::Cache;
use super::load::{Meshing, load};
use super::{Asked, Duty, Group, Loaded, Mesh, MeshOrigin, MeshProducer, msh, shape, simplex, view};
use crate::error::{Located, Place, Result, Source};
use crate::interrupt::Interrupt;
use crate::problem::mesh::{AdaptedMesh, MeshSource};
use crate::problem::{GmshSource, Guard, Order};
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
fn meshed<const D: usize>(geo: &Path, set: &[(&str, f64)], order: Order, cache: &Path) -> Result<Loaded<D>> {
    meshed_with(geo, set, order, (None, &Guard::default()), cache)
}

/// Return the mesh of a script as an adaptation asks, with settings of Gmsh.
fn meshed_with<const D: usize>(
    geo: &Path,
    set: &[(&str, f64)],
    order: Order,
    (adapted, guard): (Option<&AdaptedMesh>, &Guard),
    cache: &Path,
) -> Result<Loaded<D>> {
    let (file, guard, adapted) = (located(geo.to_owned()), *guard, adapted.cloned().map(Into::into));
    let named = |&(name, number): &(&str, f64)| (Located::new(name.to_owned(), file.place.clone()), number);
    let source = &GmshSource { set: set.iter().map(named).collect(), file, adapted, guard };
    Meshing { source, order, interrupt: &Interrupt::default() }.mesh(&Cache::at(cache.to_owned()))
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
    msh::parse(Path::new("a.msh"), bytes, MeshProducer::User)
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

/// Assert that groups have these measures, and that the points inside the edges of a straight mesh divide them into
/// equal parts.
fn assert_sizes<const D: usize>(mesh: &Mesh<D>, sizes: &[(&str, f64)]) {
    for (name, expected) in sizes {
        let size = extent(mesh, mesh.group(name).unwrap());
        assert!((size - expected).abs() < 1e-9, "{name}: {size}");
    }
    let at = |point: u32| mesh.points[point as usize];
    for group in mesh.groups.iter().filter(|group| group.dimension > 0) {
        for simplex in group.simplices() {
            assert_eq!(simplex.len(), simplex::stride(group.dimension, Some(mesh.order)));
            for (ends, inside) in shape::edges(simplex, group.dimension) {
                for (k, &point) in inside.iter().enumerate() {
                    let straight = shape::on_chord(ends.map(|end| at(simplex[end])), k, inside.len());
                    assert!((0..D).all(|c| (at(point)[c] - straight[c]).abs() < 1e-9), "{point} of `{}`", group.name);
                }
            }
        }
    }
}

#[test]
fn squares_of_both_forms_and_orders() {
    for order in ["1", "2", "3", "4", "5", "6", "7", "8"] {
        let [text, binary] = [&[][..], &["-bin"]].map(|form| {
            let mesh: Mesh<2> = parse(&gmsh(SQUARE, &[&["-2", "-order", order], form].concat())).unwrap();
            mesh
        });
        // Text has 16 digits, so coordinates may differ in the last one.
        assert_eq!(text.groups, binary.groups);
        for mesh in [&text, &binary] {
            let counts =
                ["soft rock", "steel", "left", "outside", "corner"].map(|name| mesh.group(name).unwrap().len());
            assert_eq!(counts, [8, 8, 2, 12, 1]);
            assert_eq!(mesh.group_names(2).collect::<Vec<_>>(), ["soft_rock", "steel"]);
            assert_eq!(mesh.points.len(), 15 + 30 * (mesh.order.degree() - 1));
            assert_eq!(mesh.order.degree().to_string(), order);
            // Each cell is positive, although one surface is drawn clockwise.
            assert_sizes(mesh, &[("soft rock", 0.5), ("steel", 1.5), ("left", 1.0), ("outside", 4.0)]);
            let corner = mesh.group("corner").unwrap().connectivity[0];
            assert_eq!(mesh.points[corner as usize], [1.0, 0.0]);
        }
        let lower = text.lower_order();
        assert_eq!((lower.points.len(), lower.order, lower.group("left").unwrap().stride), (15, Order::P1, 2));
        assert_sizes(&lower, &[("steel", 1.5)]);
    }
}

#[test]
fn cubes_of_both_forms_and_orders() {
    for (order, form) in [("1", &[][..]), ("1", &["-bin"]), ("2", &[]), ("2", &["-bin"])] {
        let mesh: Mesh<3> = parse(&gmsh(CUBE, &[&["-3", "-order", order], form].concat())).unwrap();
        assert_sizes(&mesh, &[("soft", 1.5), ("hard", 4.5), ("bottom", 2.0)]);
        let strides = ["pin", "soft"].map(|name| mesh.group(name).unwrap().stride);
        assert_eq!(strides, [1, if order == "1" { 4 } else { 10 }]);
        // The negative scale is a reflection through the origin.
        let scale = ["-setnumber", "Mesh.ScalingFactor", "-1"];
        let mesh: Mesh<3> = parse(&gmsh(CUBE, &[&["-3", "-order", order], form, &scale].concat())).unwrap();
        assert!(mesh.points.iter().flatten().all(|coordinate| *coordinate <= 0.0));
        assert_sizes(&mesh, &[("soft", 1.5)]);
        let script = format!("{SQUARE}\nMesh 2;\nReverseMesh Surface{{1}};");
        assert_sizes::<2>(&parse(&gmsh(&script, &["-2", "-order", order])).unwrap(), &[("soft rock", 0.5)]);
    }
}

/// A quarter of a ring, of triangles or of quadrangles that are divided: the points of both arcs lie on them, equally
/// spaced, and the cells fit.
#[test]
fn arcs_of_all_orders() {
    const RING: &str = "For i In {1:2}\n Point(i) = {i, 0, 0}; Point(i + 2) = {0, i, 0};\nEndFor\nPoint(5) = {0, 0, 0};\n\
                        Circle(1) = {1, 5, 3}; Circle(2) = {2, 5, 4}; Line(3) = {1, 2}; Line(4) = {3, 4};\n\
                        Curve Loop(1) = {3, 2, -4, -1}; Plane Surface(1) = {1};\n\
                        Transfinite Curve {1, 2} = 4; Transfinite Curve {3, 4} = 2;\n\
                        Physical Surface(\"ring\") = {1}; Physical Curve(\"bore\") = {1}; Physical Curve(\"rim\") = {2};\n";
    let quadrangles = "Transfinite Surface {1}; Recombine Surface {1};\n";
    for degree in 2..=8 {
        for (script, options) in [
            (RING.to_owned(), &[][..]),
            (format!("{RING}{quadrangles}"), &[]),
            (format!("{RING}{quadrangles}"), &["-setnumber", "Mesh.SecondOrderIncomplete", "1"]),
        ] {
            let order = degree.to_string();
            let arguments = [&["-2", "-order", &order], options].concat();
            let mut mesh: Mesh<2> = parse(&gmsh(&script, &arguments)).unwrap();
            assert_eq!((mesh.order.degree(), mesh.split > 0), (degree, script.contains("Recombine")));
            let groups = vec![("bore", Duty::Acts), ("rim", Duty::Acts)];
            mesh.check(&[Asked { name: "ring", order: mesh.order, groups }], &[], false).unwrap();
            mesh.straighten();
            assert_eq!(mesh.straightened, 0, "{degree} {options:?}");
            for (name, radius) in [("bore", 1.0), ("rim", 2.0)] {
                for edge in mesh.group(name).unwrap().simplices() {
                    let row: Vec<u32> = [&edge[..1], &edge[2..], &edge[1..2]].concat();
                    let angle = |point: &u32| {
                        let [x, y] = mesh.points[*point as usize];
                        assert!((x.hypot(y) - radius).abs() < 1e-12);
                        y.atan2(x)
                    };
                    let steps: Vec<f64> =
                        row.windows(2).map(|ends| (angle(&ends[1]) - angle(&ends[0])).abs()).collect();
                    let equal = std::f64::consts::FRAC_PI_6 / degree as f64;
                    assert!(steps.iter().all(|step| (step - equal).abs() < 1e-6), "{degree}: {steps:?}");
                }
            }
        }
    }
}

fn message(bytes: &[u8]) -> String {
    parse::<2>(bytes).map(|_| ()).expect_err("this mesh is bad").to_string()
}

#[test]
fn bad_meshes_are_refused_by_name_and_line() {
    let square = |more: &str, arguments: &[&str]| gmsh(&format!("{SQUARE}{more}"), arguments);
    for (bytes, expected) in [
        (square("", &["-2", "-format", "msh40"]), "a.msh:2: this is version 4 of the mesh format"),
        (square("", &["-2", "-format", "msh1"]), "a.msh:1: this is not a mesh file of Gmsh"),
        (square("", &["-2", "-order", "9"]), "elements of Gmsh's type 65 cannot be used"),
        (square("Physical Curve(77) = {3};", &["-2"]), "physical curve 77 has no name"),
        (square("Physical Curve(\"gone\") = {99};", &["-2"]), "the physical curve `gone` has no elements"),
        (square("Physical Curve(\"steel\") = {7};", &["-2"]), "two physical groups are named `steel`"),
        (square("Physical Volume(\"rock\") = {1};", &["-2"]), "group `rock` is made of volumes"),
        (gmsh("Point(1) = {0, 0, 0};\n", &["-2"]), "the mesh has no physical groups"),
        (gmsh("Point(1) = {0, 0, 0}; Physical Point(\"pin\") = {1};\n", &["-2"]), "no physical group holds surfaces"),
        (gmsh(CUBE, &["-3"]), "is made of volumes, but the scene has dimension = 2"),
        (
            gmsh(&SQUARE.replace("{1, 1, 0}", "{1, 1, 1e-3}"), &["-2", "-bin"]),
            "but the scene has dimension = 2 in $Elements",
        ),
        (square("", &["-2", "-part", "2"]), "the mesh is partitioned"),
        (b"solid cube".to_vec(), "a.msh:1: this is not a mesh file of Gmsh"),
        (Vec::new(), "this is not a mesh file of Gmsh"),
    ] {
        let message = message(&bytes);
        assert!(message.contains(expected), "expected {expected}\n{message}");
        assert!(message.contains("help: "), "{message}");
    }
}

const SMALL: &str =
    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n0 1 \"pin\"\n2 1 \"body\"\n$EndPhysicalNames
$Entities\n1 0 1 0\n1 0 0 0 1 1 \n1 0 0 0 1 1 0 1 1 0 \n$EndEntities
$Nodes\n1 3 1 3\n2 1 0 3\n1\n2\n3\n0 0 0\n1 0 0\n0 1 0\n$EndNodes
$Elements\n2 2 1 2\n0 1 15 1\n1 1 \n2 1 2 1\n2 1 2 3 \n$EndElements\n";

#[test]
fn small_mistakes_in_text_are_refused_at_their_line() {
    assert_eq!(parse::<2>(SMALL.as_bytes()).unwrap().points.len(), 3);
    for (from, to, expected) in [
        ("2 1 2 3 \n$EndE", "2 1 2 4 \n$EndE", "a.msh:29: element 2 of group `body` uses node 4, which does not exist"),
        ("2 1 2 3 \n$EndE", "2 1 2 2 \n$EndE", "a.msh:29: element 2 of group `body` has zero area"),
        ("2 1 2 3 \n$EndE", "2 1 2\n$EndE", "a.msh:29: this line has too few entries"),
        ("2 1 2 3 \n$EndE", "2 1 2 3 4\n$EndE", "a.msh:29: this line has more entries"),
        ("2 1 2 3 \n$EndE", "2 1 x 3\n$EndE", "a.msh:29: `x` should be a whole number"),
        ("\n1 0 0\n0 1 0\n", "\n1 0 0\n2 1e-13 0\n", "has zero area"),
        ("\n1 0 0\n0 1 0\n", "\n1 0 inf\n0 1 0\n", "a.msh:21: a coordinate is inf"),
        ("\n1 0 0\n0 1 0\n", "\n1 0 0\n0 1 1e-9\n", "a.msh:29: node 3 of group `body` has z = 0.000000001"),
        ("2 1 2 1\n", "2 7 2 1\n", "a.msh:28: elements of surface 7, which $Entities does not list"),
        ("2 1 2 1\n", "2 1 2 987654321\n", "a.msh:30: `$EndElements` should be a whole number"),
        ("1\n2\n3\n", "1\n2\n2\n", "node tag 2 stands twice"),
        ("$EndElements\n", "", "`$EndElements` should stand here"),
        ("$EndNodes\n", "$EndNodes\n$Nodes\n", "the section $Nodes stands twice"),
        ("\"body\"", "\"\"", "a.msh:7: physical surface 1 has an empty name"),
        ("2 1 \"body\"", "2 1 body", "a.msh:7: dimension, tag and \"name\""),
        ("0 1 \"pin\"", "2 1 \"pin\"", "two names for physical surface 1"),
    ] {
        let bad = SMALL.replacen(from, to, 1);
        assert_ne!(bad, SMALL, "{from}");
        let message = message(bad.as_bytes());
        assert!(message.contains(expected), "expected {expected}\n{message}");
    }
}

#[test]
fn sections_of_no_use_are_skipped() {
    let more = "$Comments\nmade by hand $End\n$EndComments\n";
    let bytes = [more, SMALL, "$Periodic\n0\n$EndPeriodic\n", more, more].concat();
    assert_eq!(parse::<2>(bytes.as_bytes()).unwrap().points, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
}

/// Work of two processes with one number, as on two hosts, and folders of a user in the cache.
#[test]
fn the_cache_removes_only_its_own_work() {
    let folder = tempfile::tempdir().unwrap();
    let old = folder.path().join("tmp-thesis");
    std::fs::create_dir(&old).unwrap();
    let day_before = std::time::SystemTime::now() - std::time::Duration::from_secs(3 * 86_400);
    std::fs::File::open(&old).unwrap().set_modified(day_before).unwrap();
    let cache = Cache::at(folder.path().to_owned());
    let write = |text: &str, to: &Path| crate::file::write(to, text);
    cache
        .make("a", |own, made| {
            cache.make("b", |other, made| {
                assert_ne!(own, other);
                write("b", made)
            })?;
            assert!(own.is_dir());
            write("a", made)
        })
        .unwrap();
    let mut names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["a", "b", "tmp-thesis"]);
}

#[test]
fn scripts_are_meshed_once_for_each_key() {
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().join("cache");
    let geo = folder.path().join("main.geo");
    let part = folder.path().join("part.geo");
    std::fs::write(&geo, "Include \"part.geo\";\n").unwrap();
    std::fs::write(&part, SQUARE).unwrap();
    let run = |n: f64, order| meshed::<2>(&geo, &[("n", n)], order, &cache).unwrap();

    let first = run(4.0, Order::P1);
    assert_eq!(first.origin, MeshOrigin::Gmsh);
    assert_eq!(first.mesh.group("left").unwrap().len(), 4);
    assert_eq!(first.mesh.path, geo);
    let again = run(4.0, Order::P1);
    assert_eq!((again.origin, &again.file), (MeshOrigin::Cache, &first.file));
    assert_eq!((again.mesh.points, &again.mesh.groups), (first.mesh.points, &first.mesh.groups));
    assert_eq!(run(3.0, Order::P1).origin, MeshOrigin::Gmsh);
    let quadratic = run(4.0, Order::P2);
    assert_eq!((quadratic.origin, quadratic.mesh.order), (MeshOrigin::Gmsh, Order::P2));

    // A damaged file is made anew.
    let whole = std::fs::read(&first.file).unwrap();
    std::fs::write(&first.file, &whole[..whole.len() / 2]).unwrap();
    assert_eq!(run(4.0, Order::P1).origin, MeshOrigin::Gmsh);
    assert_eq!(run(4.0, Order::P1).origin, MeshOrigin::Cache);
    // A change of an included file is seen, and its reversal is remembered.
    std::fs::write(&part, SQUARE.replace("1/4", "1/2")).unwrap();
    let moved = run(4.0, Order::P1);
    assert_eq!(moved.origin, MeshOrigin::Gmsh);
    assert!((extent(&moved.mesh, moved.mesh.group("steel").unwrap()) - 1.0).abs() < 1e-9);
    std::fs::write(&part, SQUARE).unwrap();
    assert_eq!(run(4.0, Order::P1).origin, MeshOrigin::Cache);
    // Only meshes are left: n = 4, n = 3, order 2, and the one of the changed file.
    assert_eq!(std::fs::read_dir(&cache).unwrap().count(), 4);
}

/// Gmsh omits the last command of a script whose last line is not ended.
#[test]
fn the_last_line_of_a_script_need_not_end() {
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().join("cache");
    let geo = folder.path().join("main.geo");
    std::fs::write(folder.path().join("part.geo"), SQUARE.trim_end()).unwrap();
    let corners = [[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 9.0, 0.0]];
    let adapted = AdaptedMesh { sizes: view(3, &corners, &[0.5; 3]), vertices: Vec::new() };
    for script in [SQUARE.trim_end(), "Include 'part.geo';"] {
        std::fs::write(&geo, script).unwrap();
        for adapted in [None, Some(&adapted)].into_iter().take(if script.contains("Include") { 1 } else { 2 }) {
            let loaded = meshed_with::<2>(&geo, &[], Order::P1, (adapted, &Guard::default()), &cache).unwrap();
            assert!(loaded.mesh.group("outside").is_some(), "{script}");
        }
    }
}

/// Vertices are in the file of the cache, which the next run reads.
#[test]
fn an_adapted_mesh_has_vertices_where_they_are_asked() {
    let folder = tempfile::tempdir().unwrap();
    let (cache, geo) = (folder.path().join("cache"), folder.path().join("square.geo"));
    std::fs::write(&geo, SQUARE).unwrap();
    let order = Order::new(4).unwrap();
    let free = meshed::<2>(&geo, &[], order, &cache).unwrap().mesh;
    let place = [0.6137, 0.0, 0.0];
    let corners = [[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 9.0, 0.0]];
    let adapted = AdaptedMesh { sizes: view(3, &corners, &[0.1; 3]), vertices: vec![place, [0.27, 0.0, 0.0]] };
    for origin in [MeshOrigin::Gmsh, MeshOrigin::Cache] {
        let loaded = meshed_with::<2>(&geo, &[], order, (Some(&adapted), &Guard::default()), &cache).unwrap();
        assert_eq!((loaded.origin, loaded.mesh.order), (origin, order));
        assert!(loaded.mesh.points.iter().any(|x| (x[0] - place[0]).abs() < 1e-12 && x[1] == 0.0));
        assert!(loaded.mesh.points.contains(&[0.25, 0.0]), "the materials meet where they did");
        let names = |mesh: &Mesh<2>| mesh.groups.iter().map(|group| group.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&loaded.mesh), names(&free));
    }
}

#[test]
fn scripts_in_error_are_refused_with_what_gmsh_says() {
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().join("cache");
    let refuse = |script: &str, set: &[(&str, f64)], order| {
        let geo = folder.path().join("a.geo");
        std::fs::write(&geo, script).unwrap();
        meshed::<2>(&geo, set, order, &cache).unwrap_err().to_string()
    };
    let message = refuse("Line(1) = {1, 7};", &[], Order::P1);
    assert!(message.contains("a.geo: Gmsh cannot mesh this script"), "{message}");
    assert!(message.contains("Unknown control point"), "{message}");
    let message = refuse(SQUARE, &[("m", 1.0)], Order::P1);
    assert!(message.contains("did you mean `n`?") && message.contains("scene.toml"), "{message}");
    let message = refuse(&format!("{SQUARE}Mesh.ElementOrder = 1;"), &[], Order::P2);
    assert!(message.contains("remove `Mesh.ElementOrder`"), "{message}");
    // Lines and bytes of the mesh mean nothing to someone who wrote a script.
    let message = refuse(&format!("{SQUARE}Physical Curve(\"gone\") = {{99}};"), &[], Order::P1);
    assert!(message.contains("a.geo: ") && message.contains("`gone`") && !message.contains("byte"), "{message}");
    assert_eq!(std::fs::read_dir(&cache).unwrap().count(), 0);
}

#[test]
fn mesh_files_serve_lower_and_higher_orders() {
    let folder = tempfile::tempdir().unwrap();
    let source = |name: &str| MeshSource::Msh { file: located(folder.path().join(name)) };
    for order in ["1", "2"] {
        std::fs::write(folder.path().join(order), gmsh(SQUARE, &["-2", "-order", order])).unwrap();
    }
    let load = |name: &str, order| load::<2>(&source(name), &[order], &Interrupt::default());
    let loaded = load("2", Some(Order::P1)).unwrap();
    assert_eq!((loaded.origin, loaded.mesh.order, loaded.mesh.points.len()), (MeshOrigin::File, Order::P1, 15));
    assert_eq!(load("2", Some(Order::P2)).unwrap().mesh.order, Order::P2);
    // the edges of the square are straight, so that both meshes of order 2 have the same points
    let sorted = |name: &str| {
        let mut points = load(name, Some(Order::P2)).unwrap().mesh.points;
        points.sort_by(|p, q| (p[0] + 2.0 * p[1]).total_cmp(&(q[0] + 2.0 * q[1])));
        points
    };
    let (raised, saved) = (sorted("1"), sorted("2"));
    assert_eq!(raised.len(), saved.len());
    assert!(raised.iter().zip(&saved).all(|(p, q)| (p[0] - q[0]).abs() + (p[1] - q[1]).abs() < 1e-12));
    assert!(
        load("1", Order::new(4)).unwrap().mesh.groups.iter().all(|group| {
            group.stride == [1, 3, 6][group.dimension] && group.connectivity.len() % group.stride == 0
        })
    );
    let message = load("3", Some(Order::P2)).unwrap_err().to_string();
    assert!(message.contains("cannot read") && message.contains("scene.toml"), "{message}");
}

#[test]
fn loads_at_the_same_time_do_not_meet() {
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().join("cache");
    let geo = folder.path().join("a.geo");
    std::fs::write(&geo, SQUARE).unwrap();
    let load = || meshed::<2>(&geo, &[], Order::P1, &cache).unwrap();
    std::thread::scope(|scope| {
        let threads = [(); 4].map(|()| scope.spawn(load));
        for thread in threads {
            assert_eq!(thread.join().unwrap().mesh.points.len(), 15);
        }
    });
    assert_eq!(std::fs::read_dir(&cache).unwrap().count(), 1);
    assert_eq!(load().origin, MeshOrigin::Cache);
}

/// A mesh by HXT has its own file in the cache for each number of threads. A script may choose another algorithm.
#[test]
fn tetrahedra_by_hxt() {
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().join("cache");
    let run = |script: &str, threads: Option<usize>| {
        let geo = folder.path().join("cube.geo");
        std::fs::write(&geo, script).unwrap();
        let guard = Guard { threads, ..Guard::default() };
        let loaded = meshed_with::<3>(&geo, &[], Order::P1, (None, &guard), &cache).unwrap();
        (loaded.origin, loaded.without_hxt, loaded.mesh.points)
    };
    let cube = CUBE.replace("1/2;\nPhysical", "1/5;\nPhysical");
    let default = parse::<3>(&gmsh(&cube, &["-3", "-bin"])).unwrap().points;
    let (origin, without_hxt, ours) = run(&cube, Some(1));
    assert_eq!((origin, without_hxt), (MeshOrigin::Gmsh, false));
    assert!(ours != default && ours.len().abs_diff(default.len()) < default.len() / 4, "{}", ours.len());
    assert_eq!(run(&cube, Some(1)), (MeshOrigin::Cache, false, ours));
    assert_eq!(run(&cube, Some(2)).0, MeshOrigin::Gmsh);
    let chosen = run(&format!("Mesh.Algorithm3D = 1;\n{cube}"), Some(1));
    assert_eq!(chosen, (MeshOrigin::Gmsh, false, default));
    // a structured block of cells with quadrangular facets
    let beside = cube.replace(
        "MeshSize",
        "Transfinite Curve{:} = 3;\nTransfinite Surface{:};\nRecombine Surface{:};\nTransfinite Volume{1};\nMeshSize",
    );
    let (origin, without_hxt, structured) = run(&beside, Some(1));
    assert_eq!((origin, without_hxt), (MeshOrigin::Gmsh, true));
    assert_eq!(run(&beside, Some(1)), (MeshOrigin::Cache, true, structured));
}
