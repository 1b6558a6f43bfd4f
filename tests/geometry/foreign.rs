//! Meshes and shapes of other programs: each gives the answer of the mesh that it came from.

use crate::common::{Run, Scene, distance, root, solve, solve_on, winkler};
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
        "dimension = 3\nmesh = {mesh}\n[[body]]\nname = \"{lower}\"\norder = 1\nyoung = 2.1e5\npoisson = 0\n\
         fix = [{{ on = \"{bottom}\", x = 0, y = 0, z = 0 }}]\n[[body]]\nname = \"{upper}\"\norder = 1\nyoung = 2.1e5\npoisson = 0\n\
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
    let same = |run: &Run, label: &str| {
        // coordinates in eight characters have six digits
        let size = if label == "bdf" { 1e-5 } else { 1e-9 };
        assert_eq!(run.count("dofs"), whole.count("dofs"), "{label}");
        assert!(
            (run.number("pairs/0/peak_pressure") / whole.number("pairs/0/peak_pressure") - 1.0).abs() < size,
            "{label}"
        );
        let sorted = |run: &Run| {
            let mut all = run.contact()["pressure"].to_vec();
            all.sort_by(f64::total_cmp);
            all
        };
        assert!(distance(&sorted(run), &sorted(&whole)) < size, "{label}");
        assert!(run.warnings().is_empty(), "{label}: {}", run.warnings());
    };
    // Gmsh 4.8 crashes on groups of its own universal files
    let folder = tempfile::tempdir().expect("a folder");
    let without_groups = folder.path().join("two.geo");
    let script = fs::read_to_string(patch()).expect("a script");
    let lines: Vec<&str> = script.lines().filter(|line| !line.starts_with("Physical")).collect();
    fs::write(&without_groups, lines.join("\n") + "\n").expect("a script");
    for (format, names) in [("msh22", &NAMED), ("unv", &NUMBERED), ("bdf", &NUMBERED), ("mesh", &NUMBERED)] {
        let name = format!("a.{}", if format.starts_with("msh") { "msh" } else { format });
        let script = if format == "unv" { &without_groups } else { &patch() };
        let text = made(script, &["-3", "-format", format], &name);
        let run = solved(&name, &text, &format!("\"{name}\""), names).converged();
        same(&run, format);
    }
    // in the cache now
    let text = made(&patch(), &["-3", "-format", "mesh"], "b.mesh");
    let run = solved("b.mesh", &text, "{ msh = \"b.mesh\" }", &NUMBERED).converged();
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
    // a line that has not all nodes goes on without a comma, too
    let bare = solved("a.inp", INP.replace("2, 3, 4,\n", "2, 3, 4\n").as_bytes(), "\"a.inp\"", &names).converged();
    assert_eq!(bare.number("pairs/0/force/0/2"), run.number("pairs/0/force/0/2"));
    let scene = scene("\"a.inp\"", &names);
    fs::write(scene.path.with_file_name("a.inp"), INP).expect("a file");
    let list = winkler(&["mesh", scene.path.to_str().expect("a path")]);
    assert!(list.stdout.contains("group upper_top: 4 points"), "{}", list.said());
    let refused = |from: &str, to: &str, words: &[&str]| {
        let run = solved("a.inp", INP.replace(from, to).as_bytes(), "\"a.inp\"", &names);
        assert!(run.code == 4 && words.iter().all(|word| run.stderr.contains(word)), "{words:?} {}", run.said());
    };
    refused("*HEADING", "*PART, NAME=A", &["*END PART is missing", "a.inp:"]);
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
        "dimension = 3\nmesh = { geo = \"cube.stl\", size = 0.5 }\n[[body]]\nname = \"volume_1\"\norder = 1\nyoung = 1\npoisson = 0.3\n\
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

/// Two blocks with nodes, elements and surfaces as they may stand in an input file, and a scene that presses them together.
/// Without Poisson's ratio the pressure is that of the load, whatever the cells.
const BLOCKS: &str = "*NODE, NSET=NALL\n1, 0., 0., 0.\n2, 1., 0., 0.\n3, 1., 1., 0.\n4, 0., 1., 0.\n5, 0., 0., 1.\n6, 1., 0., 1.\n\
7, 1., 1., 1.\n8, 0., 1., 1.\n11, 0., 0., 1.\n12, 1., 0., 1.\n13, 1., 1., 1.\n14, 0., 1., 1.\n15, 0., 0., 2.\n16, 1., 0., 2.\n\
17, 1., 1., 2.\n18, 0., 1., 2.\n*ELEMENT, TYPE=C3D8, ELSET=LOWER\n1, 1,2,3,4,5,6,7,8\n*ELEMENT, TYPE=C3D8, ELSET=UPPER\n\
2, 11,12,13,14,15,16,17,18\n*SURFACE, NAME=FLOOR\n1, S1\n*SURFACE, NAME=LTOP\n1, S2\n*SURFACE, NAME=UBOT\n2, S1\n\
*SURFACE, NAME=LID\n2, S2\n";

fn blocks(mesh: &str, load: &str, [floor, ltop, ubot, lid]: [&str; 4]) -> Scene {
    Scene::new(format!(
        "dimension = 3\nmesh = \"{mesh}\"\n[[body]]\nname = \"lower\"\norder = 1\nyoung = 1e5\npoisson = 0\n\
         fix = [{{ on = \"{floor}\", x = 0, y = 0, z = 0 }}]\n[[body]]\nname = \"upper\"\norder = 1\nyoung = 1e5\npoisson = 0\n\
         fix = [{{ on = \"{lid}\", x = 0, y = 0 }}]\nload = [{{ on = \"{lid}\", {load} }}]\n[[contact]]\n\
         between = [\"{ltop}\", \"{ubot}\"]\nlayer = {{ linear = {{ stiffness = 1e6 }} }}\n"
    ))
}

const SURFACES: [&str; 4] = ["floor", "ltop", "ubot", "lid"];

/// Solves the two blocks in a file, which may have others beside it.
fn pressed(files: &[(&str, &str)], load: &str, surfaces: [&str; 4]) -> Run {
    let scene = blocks(files[0].0, load, surfaces);
    for (file, text) in files {
        fs::write(scene.path.with_file_name(file), text).expect("a file");
    }
    solve(&scene, &[])
}

/// Checks that the pressure is 10 everywhere, and which words are warned of.
fn is_ten(run: Run, warned: &[&str], what: &str) {
    let run = run.converged();
    let far = |p: &f64| (p - 10.0).abs() > 1e-9;
    assert!(!run.contact()["pressure"].iter().any(far), "{what}: {:?}", &run.contact()["pressure"]);
    assert!(warned.iter().all(|word| run.warnings().contains(word)), "{what} {warned:?}: {}", run.warnings());
}

fn changed(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from}");
    text.replace(from, to)
}

#[test]
fn input_files_in_all_their_forms() {
    let load = "pressure = 10";
    let same = |text: String, warned: &[&str], what: &str| {
        is_ten(pressed(&[("a.inp", &text)], load, SURFACES), warned, what);
    };
    let nodes = &BLOCKS[..BLOCKS.find("*ELEMENT").expect("elements")];
    let rest = &BLOCKS[nodes.len()..];
    same(BLOCKS.to_owned() + "*ELSET, ELSET=LOWER\n1\n*SURFACE, NAME=LID\n2, S2\nUPPER, S2\n", &[], "members twice");
    same(changed(BLOCKS, "\n2, 1., 0., 0.", "\n2, 1.0D0, 0.+1, -0.d-3"), &[], "Fortran");
    same("\u{feff}".to_owned() + BLOCKS, &[], "byte-order mark");
    same(
        changed(BLOCKS, "*ELEMENT, TYPE=C3D8, ELSET=LOWER", "*element,\n type=c3d8 ,\nelset = Lower"),
        &[],
        "parameters",
    );
    same(BLOCKS.to_owned() + "*ELSET, ELSET=OTHER, GENERATE\n1, 9\n", &[], "generated, with gaps");
    // what is no solid
    let others = "*ELEMENT, TYPE=B31, ELSET=BEAMS\n21, 1, 17\n22, 2, 18\n*ELEMENT, TYPE=SPRINGA, ELSET=S\n23, 1, 2\n\
                  *ELEMENT, TYPE=MASS, ELSET=M\n24, 1\n*ELEMENT, TYPE=C3D8, ELSET=NONE\n";
    let text =
        changed(BLOCKS, "*ELEMENT, TYPE=C3D8, ELSET=LOWER", &format!("{others}*ELEMENT, TYPE=C3D8, ELSET=LOWER"));
    same(text + "*ELSET, ELSET=EALL\nBEAMS, S, LOWER\n", &["left out: 2 B31, 1 MASS, 1 SPRINGA"], "beams and springs");
    // shells and membranes mark the surface
    let shells = BLOCKS.replace("*SURFACE, NAME=LID\n2, S2\n", "*ELEMENT, TYPE=S3, ELSET=LID\n31, 15, 17, 18\n");
    let shells = changed(&shells, "*SURFACE, NAME=LTOP\n1, S2\n", "*ELEMENT, TYPE=M3D4, ELSET=LTOP\n33, 6, 5, 8, 7\n");
    let run = pressed(&[("a.inp", &shells)], load, SURFACES);
    assert!(run.code == 3 && run.stderr.contains("`lid`"), "a triangle is no face of a hexahedron: {}", run.said());
    let shells = changed(&shells, "TYPE=S3, ELSET=LID\n31, 15, 17, 18", "TYPE=S4, ELSET=LID\n31, 18, 15, 16, 17");
    is_ten(pressed(&[("a.inp", &shells)], load, SURFACES), &["left out: 1 M3D4, 1 S4"], "shells");
    // included files
    let including = "*INCLUDE, INPUT=sub/nodes.txt\n".to_owned() + rest;
    let scene = blocks("a.inp", load, SURFACES);
    fs::create_dir(scene.path.with_file_name("sub")).expect("a folder");
    fs::write(scene.path.with_file_name("a.inp"), &including).expect("a file");
    fs::write(scene.path.with_file_name("sub/nodes.txt"), "*NODE\n*INCLUDE, INPUT=more.txt\n").expect("a file");
    let (first, more) = nodes.split_once('\n').expect("a line");
    fs::write(scene.path.with_file_name("sub/more.txt"), more).expect("a file");
    is_ten(solve(&scene, &[]), &[], first);
    // another included file is another mesh
    fs::write(scene.path.with_file_name("sub/more.txt"), more.replace("1.,", "2.,")).expect("a file");
    assert!(solve(&scene, &[]).converged().number("pairs/0/contact_area") > 3.9);
    // the later of two nodes counts
    let twice = nodes.replace("2, 1., 0., 0.", "2, 3., 0., 0.") + "2, 1., 0., 0.\n" + rest;
    same(twice, &["1 nodes stand twice", "node 2 in line 3 and line 18"], "node twice");
    same(nodes.to_owned() + "2, 1., 0., 0.\n" + rest, &[], "the same node twice");
    // sections instead of sets
    let one = changed(BLOCKS, "TYPE=C3D8, ELSET=LOWER", "TYPE=C3D8") + "*SOLID SECTION, ELSET=lower, MATERIAL=m\n";
    same(one, &[], "a section without a set");
}

#[test]
fn local_coordinates_of_input_files() {
    let load = "pressure = 10";
    // a quarter of a ring between radii 1 and 2, of height 1, in two parts one on the other
    let ring = |z: [f64; 2], first: usize| {
        let corner =
            |(at, [r, t]): (usize, &[f64; 2])| [0, 1].map(|k| format!("{}, {r}, {t}, {}\n", first + at + 4 * k, z[k]));
        let lines: Vec<[String; 2]> =
            [[1.0, 0.0], [2.0, 0.0], [2.0, 90.0], [1.0, 90.0]].iter().enumerate().map(corner).collect();
        lines.iter().flatten().cloned().collect::<String>()
    };
    let rest = &BLOCKS[BLOCKS.find("*ELEMENT").expect("elements")..];
    let polar = ring([0.0, 1.0], 1) + &ring([1.0, 2.0], 11);
    let text = format!("*NODE, SYSTEM=C\n{polar}{rest}");
    let run = pressed(&[("a.inp", &text)], load, SURFACES);
    // the corners are (1, 0), (2, 0), (0, 2), (0, 1): a trapezium of area 1.5
    assert!((run.number("pairs/0/contact_area") - 1.5).abs() < 1e-12, "{}", run.said());
    is_ten(run, &[], "cylindrical");
    let text = format!(
        "*SYSTEM\n5., 0., 0., 5., 1., 0.\n4., 0., 0.\n*NODE, SYSTEM=C\n{polar}*SYSTEM\n*NODE\n99, 1., 2., 3.\n{rest}"
    );
    let scene = blocks("a.inp", load, SURFACES);
    fs::write(scene.path.with_file_name("a.inp"), &text).expect("a file");
    let list = winkler(&["mesh", scene.path.to_str().expect("a path")]);
    assert!(
        list.stdout
            .contains("plane, normal (0.0000, 0.0000, -1.0000), (3.0000, 0.0000, 0.0000) to (5.0000, 2.0000, 0.0000)"),
        "{}",
        list.said()
    );
    let run = pressed(&[("a.inp", &format!("*NODE, SYSTEM=S\n{polar}{rest}"))], load, SURFACES);
    assert!(run.code == 4 && run.stderr.contains("a.inp:1: nodes with SYSTEM=S are not read"), "{}", run.said());
    let run = pressed(&[("a.inp", &format!("*SYSTEM\n0., 0., 0., 1., 0., 0.\n2., 0., 0.\n{BLOCKS}"))], load, SURFACES);
    assert!(run.code == 4 && run.stderr.contains("a.inp:3: the points of *SYSTEM lie on a line"), "{}", run.said());
    let run = pressed(
        &[("a.inp", &format!("{BLOCKS}*TRANSFORM, NSET=NALL, TYPE=C\n0., 0., 0., 0., 0., 1.\n"))],
        load,
        SURFACES,
    );
    is_ten(run, &["1 *TRANSFORM are skipped"], "transform");
}

/// Surfaces, loads and supports that are sets of nodes.
#[test]
fn node_sets_are_surfaces() {
    let sets = "*NSET, NSET=N1\n1, 2, 3, 4\n*NSET, NSET=N2, GENERATE\n5, 8\n*SURFACE, NAME=N3, TYPE=NODE\n11,\n12, 1.\n13\n14\n\
                *NSET, NSET=N4, ELSET=UPPER\n*NSET, NSET=N5\n15, 16\n17, 18, 17\n*NSET, NSET=N6\n15, 16, 17, 18, 1\n*NSET, NSET=ENDS\n15, 17\n";
    let text = BLOCKS.to_owned() + sets;
    let of = |lid: &str, load: &str| pressed(&[("a.inp", &text)], load, ["n1", "n2", "n3", lid]);
    is_ten(of("n5", "pressure = 10"), &[], "pressure");
    // the file has no capitals, whatever the scene has
    is_ten(pressed(&[("a.inp", &text)], "pressure = 10", ["N1", "N2", "N3", "N5"]), &[], "capitals");
    is_ten(of("n5", "force = [0, 0, -10]"), &[], "force on a face");
    is_ten(of("n5", "force = [0, 0, -10], rigid = true"), &[], "rigid");
    // two nodes bear the whole force
    let run = of("ends", "force = [0, 0, -10]").converged();
    assert!((run.number("pairs/0/force/0/2") + 10.0).abs() < 1e-9, "{}", run.said());
    let run = of("ends", "pressure = 10");
    assert!(run.code == 3 && run.stderr.contains("group of points"), "{}", run.said());
    // node 1 is another body's, and a support would lose it
    let run = of("n6", "pressure = 10");
    assert!(run.code == 3 && run.stderr.contains("two sets"), "{}", run.said());
    let lost = changed(&text, "NSET=N2, GENERATE\n5, 8", "NSET=N2\n5, 6, 7, 8, 15");
    let run = pressed(&[("a.inp", &lost)], "pressure = 10", ["n1", "n2", "n3", "n5"]);
    is_ten(run, &["node set `n2`", "1 of its 5 nodes"], "a node too many");
}

/// Gmsh writes the groups of surfaces as plane triangles, and those of curves as trusses. `winkler mesh` writes what it reads.
#[test]
fn input_files_of_gmsh() {
    for order in ["1", "2"] {
        let text = made(&patch(), &["-3", "-order", order, "-format", "inp"], "a.inp");
        // The nodes of a set include those in the middle of edges, of which a scene of order 1 has none.
        let text = String::from_utf8(text).expect("text") + "*NSET, NSET=HELD, ELSET=LOWER_BOTTOM\n";
        let names = Names { surfaces: ["held", "lower_top", "upper_bottom", "upper_top"], ..NAMED };
        // the same as a mesh that the program has written
        let folder = tempfile::tempdir().expect("a folder");
        let [deck, mesh] = ["a.inp", "b.msh"].map(|name| folder.path().join(name));
        fs::write(&deck, &text).expect("a file");
        let written = winkler(&["mesh", deck.to_str().expect("a path"), "-o", mesh.to_str().expect("a path")]);
        let bytes = fs::read(&mesh).unwrap_or_else(|_| panic!("{}", written.said()));
        for (name, bytes) in [("a.inp", text.as_bytes()), ("b.msh", &bytes)] {
            let run = solved(name, bytes, &format!("\"{name}\""), &names).converged();
            assert!((run.number("pairs/0/force/0/2") + 10.0).abs() < 1e-9, "{order}: {}", run.said());
            assert!(run.warnings().is_empty(), "{order}: {}", run.warnings());
        }
    }
}

/// Parts and instances as Abaqus/CAE writes them.
#[test]
fn parts_and_instances() {
    let part = "*Part, name=Block\n*Node\n1, 0., 0., 0.\n2, 1., 0., 0.\n3, 1., 1., 0.\n4, 0., 1., 0.\n5, 0., 0., 1.\n6, 1., 0., 1.\n\
                7, 1., 1., 1.\n8, 0., 1., 1.\n*Element, type=C3D8R\n1, 1, 2, 3, 4, 5, 6, 7, 8\n*Elset, elset=Set-1\n1,\n\
                *Surface, type=ELEMENT, name=Top\nSet-1, S2\n*End Part\n";
    let text = format!(
        "*Heading\n{part}*Assembly, name=A\n*Instance, name=lower, part=Block\n*End Instance\n*Instance, name=upper, part=Block\n\
         0., 0., 2.\n0., 0., 2., 1., 1., 2., 180.\n*End Instance\n*Node\n1, 9., 9., 9.\n*Nset, nset=floor, instance=lower, generate\n1, 4, 1\n\
         *Elset, elset=_lid_S1, internal, instance=upper\n1,\n*Surface, type=ELEMENT, name=lid\n_lid_S1, S1\n\
         *Nset, nset=reference\n1,\n*End Assembly\n"
    );
    // the upper block is turned about a diagonal, so that its top is below
    let run = pressed(&[("a.inp", &text)], "pressure = 10", ["floor", "lower_top", "upper_top", "lid"]);
    is_ten(run, &["1 nodes that belong to no solid"], "instances");
    let run = pressed(&[("a.inp", &changed(&text, "part=Block\n0.", "part=Blok\n0."))], "pressure = 10", SURFACES);
    assert!(run.code == 4 && run.stderr.contains("there is no part `blok`"), "{}", run.said());
}

#[test]
fn input_files_are_refused_with_their_line() {
    let refused = |text: &str, code: i32, words: &[&str]| {
        let run = pressed(&[("a.inp", text)], "pressure = 10", SURFACES);
        assert!(run.code == code && words.iter().all(|word| run.stderr.contains(word)), "{words:?}\n{}", run.said());
    };
    let end = BLOCKS.lines().count();
    let line = |text: &str, number: usize, words: &[&str]| {
        let place = format!("a.inp:{}", end + number);
        refused(&(BLOCKS.to_owned() + text), 4, &[words, &[place.as_str()]].concat());
    };
    line("*ELSET, ELSET=x-y\n1\n*ELSET, ELSET=x_y\n2\n", 3, &["`x_y` and `x-y`", "rename"]);
    line("*INCLUDE, INPUT=none.txt\n", 1, &["`none.txt`", "cannot be read"]);
    refused(&(BLOCKS.to_owned() + "*INCLUDE, INPUT=a.inp\n"), 4, &["a.inp:19", "element 1 stands twice"]);
    line("*ELSET, ELSET=x\n1, 7\n", 1, &["`x` has an element 7"]);
    line("*NSET, NSET=x\n1, 77\n", 1, &["`x` has a node 77"]);
    line("*SURFACE, NAME=x, COMBINE=DIFFERENCE\nLID\n", 1, &["COMBINE=DIFFERENCE"]);
    line("*SURFACE, NAME=x, TYPE=CUTTING SURFACE\nLID\n", 1, &["TYPE=CUTTING SURFACE"]);
    line("*ELEMENT, TYPE=C3D8\n3, 1, 2\n", 2, &["8 nodes here, not 2"]);
    line("*ELEMENT, TYPE=C3D8\n3, 1,2,3,4,5,6,7,99\n", 2, &["node 99"]);
    line("*ELEMENT, TYPE=C3D8\n1, 1,2,3,4,5,6,7,8\n", 2, &["element 1 stands twice", "line 19"]);
    line("*NGEN\n1, 8\n", 1, &["*NGEN is not read"]);
    line("*NODE\n9, 1e999, 0, 0\n", 2, &["`1e999` is no number"]);
    // an element set and a surface of one name, both in use
    let both = changed(BLOCKS, "NAME=LTOP", "NAME=LOWER");
    let run = pressed(&[("a.inp", &both)], "pressure = 10", ["floor", "lower_surface", "ubot", "lid"]);
    is_ten(run, &["the surface `lower` is `lower_surface` here"], "one name");
}

/// A tetrahedron as a deck of Nastran, with cards before its grid points and the fields of the first point.
fn deck(cards: &str, first: &str) -> String {
    let others = "GRID,2,,1.,0.,0.\nGRID,3,0,0.,1.,0.\nGRID           4              0.      0.      1.\n";
    format!("SOL 101\nCEND\nBEGIN BULK\n{cards}{first}\n{others}PSOLID,1,1\nCTETRA,1,1,1,2,3,4\nENDDATA\n")
}

/// Gmsh ignores local systems of coordinates without a word: points in one are refused, and systems that no point names are none of their concern.
#[test]
fn local_coordinates_of_points_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("a.bdf");
    let listed = |text: &str| {
        fs::write(&file, text).expect("a file");
        winkler(&["mesh", file.to_str().expect("a path")])
    };
    let femap =
        "CORD2C         1       0      0.      0.      0.      0.      0.      1.+\n+             1.      0.      1.\n";
    let large = "GRID*                  1               7              0.              0.\n*                     0.";
    for (cards, first) in [
        (femap, "GRID,1,,0.,0.,0.,1"),
        (femap, "GRID           1       0      0.      0.      0.       1"),
        ("GRDSET,,,,,,,456\n", "GRID,1,,0.,0.,0."),
        ("GRDSET                 0                               1     456\n", &large.replace('7', " ")),
        ("CORD2R,7,,0.,0.,0.,0.,0.,1.\n$ GRID,9,7\n", "grid,1, 0 ,0.,0.,0."),
    ] {
        let run = listed(&deck(cards, first));
        // cards of other fields than those of numbers are read by Gmsh as it likes
        assert!(run.code == 0 || !run.stderr.contains("system of coordinates"), "{first}\n{}", run.said());
        if first.starts_with("GRID") {
            assert!(run.stdout.contains("group volume_1: 1 tetrahedra"), "{first}\n{}", run.said());
        }
    }
    for (cards, first) in [
        (femap, "GRID,1,1,0.,0.,0."),
        ("", "GRID           1       7      0.      0.      0."),
        ("", large),
        ("", "GRID*,1,7,0.,0.\n*,0."),
        ("GRDSET,,7\n", "GRID,1,0,0.,0.,0."),
        ("GRDSET*                                7\n", "GRID,1,,0.,0.,0."),
    ] {
        let run = listed(&deck(cards, first));
        assert!(run.code == 4 && run.stderr.contains("in the local system of coordinates"), "{first}\n{}", run.said());
    }
    // universal files: a system may be defined, and even named, if it is the global one
    let unv = |turn: &str| {
        let system =
            format!("         1\npart\n         1         0         8\nCS\n{turn}         0.D+00 0. 1.\n 0. 0. 0.\n");
        format!(
            "    -1\n  2420\n{system}    -1\n    -1\n  2411\n         1         1         1        11\n  0.D+00 0. 0.\n         2         1         1        11\n\
             1. 0. 0.\n         3         1         1        11\n  0. 1. 0.\n         4         1         1        11\n  0. 0. 1.\n    -1\n    -1\n  2412\n\
             \x20        1       111         1         1         7         4\n         1         2         3         4\n    -1\n"
        )
    };
    let file = folder.path().join("a.unv");
    for (turn, is_local) in [(" 1.D+00 0. 0.\n 0. 1. 0.\n", false), (" 0. 1. 0.\n -1. 0. 0.\n", true)] {
        fs::write(&file, unv(turn)).expect("a file");
        let run = winkler(&["mesh", file.to_str().expect("a path")]);
        assert_eq!(run.stderr.contains("a.unv:14: this node is in a local system"), is_local, "{}", run.said());
        assert_eq!(run.code, if is_local { 4 } else { 0 }, "{}", run.said());
    }
}

/// A pointer in the place of a file that was not fetched, and a shape whose faces enclose nothing.
#[test]
fn advice_fits_the_file() {
    let pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n";
    for name in ["a.msh", "a.inp", "a.bdf", "a.unv", "a.step"] {
        let run = solved(name, pointer, &format!("\"{name}\""), &NAMED);
        assert!(
            run.code == 6 && [name, "pointer of Git LFS", "git lfs pull"].iter().all(|word| run.stderr.contains(word)),
            "{}",
            run.said()
        );
    }
    let folder = tempfile::tempdir().expect("a folder");
    let script = folder.path().join("faces.geo");
    fs::write(&script, "SetFactory(\"OpenCASCADE\");\nRectangle(1) = {0,0,0,1,1};\n").expect("a script");
    let text = made(&script, &["-0", "-format", "step"], "faces.step");
    let run = solved("faces.step", &text, "{ geo = \"faces.step\", size = 0.5 }", &NUMBERED);
    assert!(run.code == 4 && run.stderr.contains("faces without a solid"), "{}", run.said());
}

/// Bodies without an order have order 2 on the mesh of a script, and the order of a mesh file, on all ranks.
#[test]
fn bodies_without_an_order_have_that_of_the_mesh() {
    let solved = |mesh: &str, file: Option<&str>, ranks: usize, sets: &[&str]| {
        let scene = Scene::new(scene(mesh, &NAMED).text.replace("order = 1\n", ""));
        if let Some(order) = file {
            let text = made(&patch(), &["-3", "-order", order, "-format", "msh41"], "a.msh");
            fs::write(scene.path.with_file_name("a.msh"), text).expect("a mesh");
        }
        let words: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        solve_on(ranks, &scene, &words).converged()
    };
    let script = format!("{{ geo = \"{}\" }}", patch().display());
    for (mesh, file, default) in [(script.as_str(), None, 2), ("\"a.msh\"", Some("1"), 1), ("\"a.msh\"", Some("2"), 2)]
    {
        let orders = |run: &Run| [0, 1].map(|body| run.count(&format!("bodies/{body}/order")));
        let of_all = |order: usize| [0, 1].map(|body| format!("body.{body}.order={order}"));
        let known = solved(mesh, file, 1, &of_all(default).each_ref().map(String::as_str));
        for ranks in [1, 2] {
            let run = solved(mesh, file, ranks, &[]);
            assert_eq!(orders(&run), [default; 2], "{mesh} {file:?}");
            assert!(run.stdout.contains(&format!("dofs of order {default}, ")), "{}", run.said());
            assert_eq!(run.count("dofs"), known.count("dofs"));
            let off = run.number("pairs/0/peak_pressure") / known.number("pairs/0/peak_pressure") - 1.0;
            assert!(off.abs() < 1e-9, "{mesh} {file:?}: {off}");
            // an order of one body leaves the default of the other
            let other = 3 - default;
            let run = solved(mesh, file, ranks, &[&format!("body.upper.order={other}")]);
            assert_eq!(orders(&run), [default, other], "{mesh} {file:?}");
        }
    }
}
