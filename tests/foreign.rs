//! Meshes and shapes of other programs: each gives the answer of the mesh that it came from.

mod common;

use common::{Run, Scene, distance, root, solve, winkler};
use std::fs;
use std::path::Path;
use std::process::Command;

/// Two blocks of E = 2.1e5, nu = 0 under q = 10: the pressure is q everywhere, whatever the mesh.
struct Names<'a> {
    bodies: [&'a str; 2],
    /// Bottom, top of the lower block, bottom of the upper one, top.
    surfaces: [&'a str; 4],
}

const NAMED: Names =
    Names { bodies: ["lower", "upper"], surfaces: ["lower_bottom", "lower_top", "upper_bottom", "upper_top"] };

/// Gmsh's numbers of two boxes, one on the other.
const NUMBERED: Names =
    Names { bodies: ["volume_1", "volume_2"], surfaces: ["surface_5", "surface_6", "surface_11", "surface_12"] };

fn scene(mesh: &str, names: &Names) -> Scene {
    let ([lower, upper], [bottom, low, high, top]) = (names.bodies, names.surfaces);
    Scene::new(format!(
        "dimension = 3\nmesh = {mesh}\n[[body]]\nname = \"{lower}\"\nyoung = 2.1e5\npoisson = 0\n\
         fix = [{{ on = \"{bottom}\", x = 0, y = 0, z = 0 }}]\n[[body]]\nname = \"{upper}\"\nyoung = 2.1e5\npoisson = 0\n\
         fix = [{{ on = \"{top}\", x = 0, y = 0 }}]\nload = [{{ on = \"{top}\", pressure = \"10 + 4*(x - 0.5)\" }}]\n[[contact]]\n\
         between = [\"{low}\", \"{high}\"]\nlayer = {{ linear = {{ stiffness = 1e5 }} }}\n"
    ))
}

/// Solves with a file beside the scene.
fn solved(file: &str, text: &[u8], mesh: &str, names: &Names) -> Run {
    let scene = scene(mesh, names);
    fs::write(scene.path.with_file_name(file), text).expect("a file");
    solve(&scene, &[])
}

/// A file that Gmsh makes of a script of this project or of its own, by its command line.
fn made(script: &Path, arguments: &[&str], name: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join(name);
    let mut command = Command::new("gmsh");
    command.arg(script).args(arguments).args(["-v", "1", "-o"]).arg(&file);
    assert!(command.status().expect("gmsh").success(), "{name}");
    fs::read(&file).unwrap_or_else(|cause| panic!("{name}: {cause}"))
}

fn patch() -> std::path::PathBuf {
    root().join("meshes/patch-3d/patch-3d.geo")
}

#[test]
fn meshes_of_other_formats_give_the_same_answer() {
    let whole = solved("a.msh", &made(&patch(), &["-3", "-format", "msh41"], "a.msh"), "\"a.msh\"", &NAMED).converged();
    let same = |run: &Run, told: &str| {
        // coordinates in eight characters have six digits
        let size = if told == "bdf" { 1e-5 } else { 1e-9 };
        assert_eq!(run.count("dofs"), whole.count("dofs"), "{told}");
        assert!(
            (run.number("pairs/0/peak_pressure") / whole.number("pairs/0/peak_pressure") - 1.0).abs() < size,
            "{told}"
        );
        let sorted = |run: &Run| {
            let mut all = run.contact()["pressure"].to_vec();
            all.sort_by(f64::total_cmp);
            all
        };
        assert!(distance(&sorted(run), &sorted(&whole)) < size, "{told}");
        assert!(run.warnings().is_empty(), "{told}: {}", run.warnings());
    };
    for (format, names) in
        [("msh22", &NAMED), ("unv", &NAMED), ("bdf", &NUMBERED), ("mesh", &NUMBERED), ("msh1", &NUMBERED)]
    {
        let end = if format.starts_with("msh") { "msh" } else { format };
        let name = format!("a.{end}");
        let text = made(&patch(), &["-3", "-format", format], &name);
        let names = if format == "msh1" {
            &Names { bodies: ["volume_1", "volume_6"], surfaces: ["surface_2", "surface_3", "surface_7", "surface_8"] }
        } else {
            names
        };
        let run = solved(&name, &text, &format!("\"{name}\""), names).converged();
        same(&run, format);
    }
    // universal files of others have their groups in another dataset
    let text = String::from_utf8(made(&patch(), &["-3", "-format", "unv"], "a.unv")).expect("text");
    same(&solved("a.unv", text.replace("  2477", "  2467").as_bytes(), "\"a.unv\"", &NAMED).converged(), "2467");
    // in the cache now
    let run = solved("b.unv", text.as_bytes(), "{ msh = \"b.unv\" }", &NAMED).converged();
    same(&run, "a table");
}

/// Hexahedra, prisms and pyramids agree with tetrahedra and surfaces on every face, or the check of the mesh would refuse them.
#[test]
fn hexahedra_are_split() {
    let text = fs::read_to_string(patch()).expect("a script");
    let folder = tempfile::tempdir().expect("a folder");
    let script = folder.path().join("hexahedra.geo");
    fs::write(&script, text + "Recombine Surface {1:12};\nRecombine Volume {1, 2};\n").expect("a script");
    let run = solve(scene(&format!("\"{}\"", script.display()), &NAMED), &[]).converged();
    assert!(run.warnings().contains("were split into triangles or tetrahedra"), "{}", run.warnings());
    assert_eq!(run.count("bodies/0/cells"), 6 * 27);
    assert!((run.number("pairs/0/force/0/2") + 10.0).abs() < 1e-9);
    // and in the plane
    let text = fs::read_to_string(root().join("meshes/groove/groove.geo")).expect("a script");
    fs::write(&script, text + "\nRecombine Surface {:};\n").expect("a script");
    let plane = fs::read_to_string(root().join("meshes/groove-held/scene.toml")).expect("a scene");
    let plane = plane.replace("../groove/groove.geo", &script.display().to_string());
    let run = solve(Scene::new(plane), &["--set", "mesh.set.n=8", "--method", "auto"]).converged();
    assert!(run.warnings().contains("quadrangles"), "{}", run.warnings());
    assert!((run.number("pairs/0/force/0/1") + 40.0).abs() < 1e-4);
}

/// Two blocks as CalculiX and Abaqus write them: hexahedra and prisms, sets, surfaces, continued lines, materials.
const INP: &str = "*HEADING\ntwo blocks, 100 % by hand\n** a comment\n*NODE, NSET=Nall\n 1, 0., 0., 0.\n 2, 1., 0., 0.\n\
 3, 1., 1., 0.\n 4, 0., 1., 0.\n 5, 0., 0., 1.\n 6, 1., 0., 1.\n 7, 1., 1., 1.\n 8, 0., 1., 1.\n11, 0., 0., 1.\n12, 1., 0., 1.\n\
13, 1., 1., 1.\n14, 0., 1., 1.\n15, 0., 0., 2.\n16, 1., 0., 2.\n17, 1., 1., 2.\n18, 0., 1., 2.\n\
*Element, type=C3D8R, elset=LOWER\n1, 1, 2, 3, 4,\n 5, 6, 7, 8\n*ELEMENT, TYPE=C3D6, ELSET=Upper\n2, 11, 12, 13, 15, 16, 17\n\
3, 11, 13, 14, 15, 17, 18\n*ELSET, ELSET=Eall\nUpper, LOWER\n*NSET, NSET=UPPER_TOP, GENERATE\n15, 18, 1\n*SURFACE, NAME=Lower_Bottom\n\
LOWER, S1\n*SURFACE, TYPE=ELEMENT, NAME=lower_top\n1, S2\n*SURFACE, NAME=upper_bottom, TYPE=ELEMENT\nUPPER, S1\n\
*SURFACE, NAME=pressed, TYPE=ELEMENT\n2, S2\n3, S2\n*MATERIAL, NAME=STEEL\n*ELASTIC\n210000., 0.3\n*STEP\n*STATIC\n*END STEP\n";

#[test]
fn files_of_abaqus_and_calculix() {
    let names =
        Names { bodies: ["lower", "upper"], surfaces: ["lower_bottom", "lower_top", "upper_bottom", "pressed"] };
    let run = solved("a.inp", INP.as_bytes(), "\"a.inp\"", &names).converged();
    assert!((run.number("pairs/0/force/0/2") + 10.0).abs() < 1e-9);
    assert_eq!([run.count("bodies/0/cells"), run.count("bodies/1/cells")], [6, 6]);
    assert!(run.warnings().contains("split"), "{}", run.warnings());
    let scene = scene("\"a.inp\"", &names);
    fs::write(scene.path.with_file_name("a.inp"), INP).expect("a file");
    let list = winkler(&["mesh", scene.path.to_str().expect("a path")]);
    assert!(list.stdout.contains("group upper_top: 4 points"), "{}", list.said());
    let refused = |from: &str, to: &str, words: &[&str]| {
        let run = solved("a.inp", INP.replace(from, to).as_bytes(), "\"a.inp\"", &names);
        assert!(run.code == 4 && words.iter().all(|word| run.stderr.contains(word)), "{words:?} {}", run.said());
    };
    refused("*HEADING", "*PART, NAME=A", &["*PART is not read", "a.inp:1"]);
    refused("type=C3D8R", "type=C3D27", &["elements of type `C3D27` cannot be used", "a.inp:21"]);
    refused("Upper, LOWER", "Upper, LOWR", &["there is no set `LOWR`"]);
    refused("2, 11, 12, 13, 15, 16, 17", "2, 11, 12, 13, 15, 16", &["an element has 6 nodes here, not 5"]);
    refused("17, 18\n*ELSET", "17,\n*ELSET", &["an element has 6 nodes here, not 5"]);
    refused("2, 11, 12, 13, 15, 16, 17", "2, 11, 12, 13, 15, 16, 99", &["the node 99, which is not there"]);
    refused("15, 18, 1", "1, 18446744073709551615", &["more members, from 1 to 18446744073709551615", "a.inp:"]);
    refused("LOWER, S1", "LOWER, T1", &["is no face of elements"]);
    refused("LOWER, S1", "UPPER, S6", &["has no face S6"]);
    refused("1, S2", "7, S2", &["a face of element 7, which is not there"]);
    refused(" 2, 1., 0., 0.", " 2, one, 0., 0.", &["`one` is no number", "a.inp:6"]);
}

/// Shapes of OpenCASCADE and surfaces of triangles: names by kind and number, sizes by key.
#[test]
fn shapes_are_meshed() {
    let folder = tempfile::tempdir().expect("a folder");
    let script = folder.path().join("two.geo");
    fs::write(&script, "SetFactory(\"OpenCASCADE\");\nBox(1) = {0,0,0,1,1,1};\nBox(2) = {0,0,1,1,1,1};\n")
        .expect("a script");
    for format in ["step", "brep"] {
        let name = format!("two.{format}");
        let text = made(&script, &["-0", "-format", format], &name);
        let coarse = solved(&name, &text, &format!("{{ geo = \"{name}\", size = 0.5 }}"), &NUMBERED).converged();
        let fine = solved(&name, &text, &format!("{{ geo = \"{name}\", size = 0.2 }}"), &NUMBERED).converged();
        assert!(fine.count("dofs") > 3 * coarse.count("dofs"), "{format}");
        assert!((fine.number("pairs/0/force/0/2") + 10.0).abs() < 1e-9, "{format}");
        assert!((fine.number("pairs/0/contact_area") - 1.0).abs() < 1e-9, "{format}");
    }
    // the surface of a cube, twelve triangles: its volume is 1
    let corners = |n: usize| [n & 1, n >> 1 & 1, n >> 2 & 1].map(|c| c.to_string()).join(" ");
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let facet = |t: [usize; 3]| {
        let vertices: String = t.iter().map(|&n| format!("vertex {}\n", corners(n))).collect();
        format!("facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n")
    };
    let facets: String = faces.iter().flat_map(|[a, b, c, d]| [facet([*a, *b, *c]), facet([*a, *c, *d])]).collect();
    let scene = Scene::new(
        "dimension = 3\nmesh = { geo = \"cube.stl\", size = 0.5 }\n[[body]]\nname = \"volume_1\"\nyoung = 1\npoisson = 0.3\n\
         force = [0, 0, -3]\nfix = [{ on = \"surface_*\", x = 0, y = 0, z = 0 }]\n",
    );
    fs::write(scene.path.with_file_name("cube.stl"), format!("solid cube\n{facets}endsolid cube\n")).expect("a file");
    let run = solve(&scene, &[]).converged();
    let load = run.number("bodies/0/balance/loads/force/2");
    assert!((load + 3.0).abs() < 1e-9, "{load}");
}

#[test]
fn what_is_no_mesh_and_no_shape_is_refused() {
    let refused = |file: &str, text: &str, mesh: &str, code: i32, words: &[&str]| {
        let run = solved(file, text.as_bytes(), mesh, &NAMED);
        assert!(
            run.code == code && words.iter().all(|word| run.stderr.contains(word)),
            "{file} {words:?}\n{}",
            run.said()
        );
    };
    // nothing that Gmsh could take for a script reaches it
    refused("a.inp", "SystemCall \"touch /tmp/winkler-was-here\";\n", "\"a.inp\"", 4, &["no nodes or no elements"]);
    refused("a.vtk", "# vtk DataFile Version 2.0\n", "\"a.vtk\"", 4, &["not a mesh file of Gmsh", "docs/meshes.md"]);
    refused("a.unv", "hello\n", "\"a.unv\"", 4, &["a.unv"]);
    refused("a.bdf", "hello\n", "\"a.bdf\"", 4, &["a.bdf"]);
    refused("a.step", "hello\n", "\"a.step\"", 4, &["a.step"]);
    refused("a.stl", "hello\n", "\"a.stl\"", 4, &["a.stl"]);
    refused("a.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n", "\"a.msh\"", 4, &["a.msh"]);
    refused("a.step", "hello\n", "{ msh = \"a.step\" }", 3, &["the shape of bodies, and no mesh", "geo = "]);
    refused(
        "a.step",
        "hello\n",
        "{ geo = \"a.step\", set = { n = 3 } }",
        3,
        &["a shape of another program", "size = 0.1"],
    );
    refused("a.step", "hello\n", "{ geo = \"a.step\", size = -1 }", 3, &["must be greater than 0"]);
    refused("a.geo", "n = 1;\n", "{ geo = \"a.geo\", size = 1 }", 3, &["`size` for a script"]);
    let text = String::from_utf8(made(&patch(), &["-3", "-format", "msh22"], "a.msh")).expect("text");
    // cubic tetrahedra
    let is_cell = |line: &&str| line.split_whitespace().count() == 9 && line.split_whitespace().nth(1) == Some("4");
    let line = text.lines().find(is_cell).expect("a tetrahedron");
    let words: Vec<&str> = line.split_whitespace().collect();
    let nodes: String = (1..=20).map(|node| format!(" {node}")).collect();
    let cubic = format!("{} 29 2 {} {}{nodes}", words[0], words[3], words[4]);
    refused("a.msh", &text.replace(line, &cubic), "\"a.msh\"", 4, &["tetrahedron elements of 20 nodes", "order 2"]);
    refused("a.msh", &text.replace("\"lower\"", "\"lowr\""), "\"a.msh\"", 3, &["`lower`"]);
    // names that differ by what becomes the same
    refused("a.msh", &text.replace("\"upper\"", "\"LOWER\""), "\"a.msh\"", 4, &["two groups", "`lower`", "rename"]);
}
