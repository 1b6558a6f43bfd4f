//! Quadratic quadrangles, hexahedra, prisms and pyramids in every format that has them: constant pressure is exact, and curved
//! bodies have Lamé's pressure.

use crate::common::{Run, Scene, solve, solve_on};
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fmt::Write;
use std::fs;

/// A place in the parameters of a body: four steps are one cell.
type Key = [i32; 3];

/// A cell by its shape and its corners.
struct Cell {
    shape: Shape,
    corners: Vec<Key>,
}

#[derive(Clone, Copy, PartialEq)]
enum Shape {
    Line,
    Triangle,
    Quadrangle,
    Hexahedron,
    Prism,
    Pyramid,
}
use Shape::{Hexahedron, Line, Prism, Pyramid, Quadrangle, Triangle};

impl Shape {
    /// Corners of the faces S1, S2, ... of Abaqus; in the plane edges.
    fn faces(self) -> &'static str {
        match self {
            Quadrangle => "01 12 23 30",
            Hexahedron => "0123 4765 0451 1562 2673 3740",
            Prism => "012 354 0341 1452 2530",
            Pyramid => "0123 041 142 243 340",
            _ => "",
        }
    }

    /// The nodes of an element in a format. Each word has the corners in whose middle the node lies.
    fn nodes(self, format: &str) -> &'static str {
        match (format, self) {
            (_, Line) => "0 1 01",
            (_, Triangle) => "0 1 2 01 12 20",
            ("full", Quadrangle) => "0 1 2 3 01 12 23 30 0123",
            (_, Quadrangle) => "0 1 2 3 01 12 23 30",
            ("inp", Hexahedron) => "0 1 2 3 4 5 6 7 01 12 23 30 45 56 67 74 04 15 26 37",
            ("full", Hexahedron) => {
                "0 1 2 3 4 5 6 7 01 03 04 12 15 23 26 37 45 47 56 67 0321 0154 0473 1265 2376 4567 01234567"
            }
            (_, Hexahedron) => "0 1 2 3 4 5 6 7 01 03 04 12 15 23 26 37 45 47 56 67",
            ("inp", Prism) => "0 1 2 3 4 5 01 12 20 34 45 53 03 14 25",
            ("full", Prism) => "0 1 2 3 4 5 01 02 03 12 14 25 34 35 45 0143 0253 1254",
            (_, Prism) => "0 1 2 3 4 5 01 02 03 12 14 25 34 35 45",
            ("full", Pyramid) => "0 1 2 3 4 01 03 04 12 14 23 24 34 0123",
            (_, Pyramid) => "0 1 2 3 4 01 03 04 12 14 23 24 34",
        }
    }

    /// Type in a format: a number or a name.
    fn kind(self, format: &str) -> &'static str {
        let at = [Line, Triangle, Quadrangle, Hexahedron, Prism, Pyramid].iter().position(|shape| *shape == self);
        let kinds = match format {
            "inp" => ["", "", "CPE8R", "C3D20R", "C3D15", ""],
            "full" => ["8", "9", "10", "12", "13", "14"],
            _ => ["8", "9", "16", "17", "18", "19"],
        };
        kinds[at.expect("a shape")]
    }

    fn dimension(self) -> usize {
        match self {
            Line => 1,
            Triangle | Quadrangle => 2,
            _ => 3,
        }
    }
}

impl Cell {
    fn new(shape: Shape, corners: &[Key]) -> Self {
        Self { shape, corners: corners.to_vec() }
    }

    /// The place in the middle of the corners that a word names.
    fn at(&self, word: &str) -> Key {
        let corners: Vec<Key> = word.bytes().map(|digit| self.corners[usize::from(digit - b'0')]).collect();
        std::array::from_fn(|c| corners.iter().map(|corner| corner[c]).sum::<i32>() / corners.len() as i32)
    }

    fn nodes(&self, format: &str) -> Vec<Key> {
        self.shape.nodes(format).split(' ').map(|word| self.at(word)).collect()
    }

    /// The faces with their numbers from 1.
    fn faces(&self) -> Vec<(usize, Cell)> {
        let face = |(number, word): (usize, &str)| {
            let corners: Vec<Key> = word.bytes().map(|digit| self.corners[usize::from(digit - b'0')]).collect();
            let shape = [Line, Triangle, Quadrangle][corners.len() - 2];
            (number + 1, Cell { shape, corners })
        };
        self.shape.faces().split(' ').enumerate().map(face).collect()
    }
}

/// A block of cells of a shape, along two or three axes.
struct Block {
    cells: Vec<Cell>,
    counts: Vec<i32>,
}

impl Block {
    fn new(shape: Shape, counts: &[i32]) -> Self {
        let box_of = |[i, j, k]: [i32; 3]| {
            [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0], [0, 0, 4], [4, 0, 4], [4, 4, 4], [0, 4, 4]]
                .map(|[a, b, c]| [4 * i + a, 4 * j + b, 4 * k + c])
        };
        let layers = counts.get(2).copied().unwrap_or(1);
        let boxes = (0..counts[0] * counts[1] * layers)
            .map(|n| box_of([n % counts[0], n / counts[0] % counts[1], n / counts[0] / counts[1]]));
        let cells = boxes.flat_map(|p| match shape {
            Quadrangle => vec![Cell::new(shape, &p[..4])],
            Prism => vec![
                Cell::new(shape, &[p[0], p[1], p[2], p[4], p[5], p[6]]),
                Cell::new(shape, &[p[0], p[2], p[3], p[4], p[6], p[7]]),
            ],
            Pyramid => {
                let apex = p[0].map(|x| x + 2);
                let bases = ["0123", "4765", "0451", "1562", "2673", "3740"];
                let base = |word: &str| word.bytes().map(|digit| p[usize::from(digit - b'0')]).collect::<Vec<_>>();
                bases.map(|word| Cell::new(shape, &[base(word), vec![apex]].concat())).into()
            }
            _ => vec![Cell::new(shape, &p)],
        });
        Self { cells: cells.collect(), counts: counts.to_vec() }
    }

    /// The faces on each side, with its name.
    fn sides(&self) -> Vec<(String, Vec<Face>)> {
        let mut sides = Vec::new();
        for (axis, count) in self.counts.iter().enumerate() {
            for end in 0..2 {
                let on = |face: &Cell| face.corners.iter().all(|x| x[axis] == 4 * count * end);
                let faces = self.cells.iter().enumerate().flat_map(|(cell, whole)| {
                    whole.faces().into_iter().map(move |(number, face)| (cell, number, face))
                });
                let faces = faces.filter(|(_, _, face)| on(face)).collect();
                sides.push((format!("{}{end}", ['a', 'b', 'c'][axis]), faces));
            }
        }
        sides
    }
}

/// A face: the number of its cell, its number in the cell, and its nodes.
type Face = (usize, usize, Cell);

/// Two blocks with their place in space, by body and by parameters between 0 and 1.
struct Two<'a> {
    blocks: [Block; 2],
    place: &'a dyn Fn(usize, [f64; 3]) -> [f64; 3],
}

/// A group as it is written.
struct Group<'a> {
    name: String,
    body: usize,
    elements: Vec<(usize, usize, &'a Cell)>,
}

const NAMES: [&str; 2] = ["lower", "upper"];

impl Two<'_> {
    /// The file in a format.
    fn text(&self, format: &str) -> String {
        let sides = self.blocks.each_ref().map(Block::sides);
        let mut groups = Vec::new();
        for body in 0..2 {
            let cells = self.blocks[body].cells.iter().enumerate().map(|(number, cell)| (number, 0, cell));
            groups.push(Group { name: NAMES[body].to_owned(), body, elements: cells.collect() });
            for (side, faces) in &sides[body] {
                let elements = faces.iter().map(|(cell, number, face)| (*cell, *number, face)).collect();
                groups.push(Group { name: format!("{}_{side}", NAMES[body]), body, elements });
            }
        }
        let mut number: BTreeMap<(usize, Key), usize> = BTreeMap::new();
        for group in groups.iter().filter(|group| !group.name.contains('_')) {
            for key in group.elements.iter().flat_map(|(_, _, cell)| cell.nodes(format)) {
                let next = number.len() + 1;
                number.entry((group.body, key)).or_insert(next);
            }
        }
        let mut nodes: Vec<(usize, [f64; 3])> = Vec::new();
        for ((body, key), number) in &number {
            let counts = &self.blocks[*body].counts;
            let share = |c: usize| f64::from(key[c]) / (4 * counts.get(c).unwrap_or(&1)) as f64;
            nodes.push((*number, (self.place)(*body, [0, 1, 2].map(share))));
        }
        nodes.sort_by_key(|(number, _)| *number);
        let of = |group: &Group, cell: &Cell| -> Vec<usize> {
            cell.nodes(format).iter().map(|key| number[&(group.body, *key)]).collect()
        };
        match format {
            "inp" => inp(&nodes, &groups, of),
            "msh2" => msh2(&nodes, &groups, of),
            _ => msh(format, &nodes, &groups, of),
        }
    }
}

type Nodes = [(usize, [f64; 3])];

fn words<T: std::fmt::Display>(words: &[T], between: &str) -> String {
    words.iter().map(|word| format!("{word}")).collect::<Vec<_>>().join(between)
}

/// Format 4.1, with one entity for each group.
fn msh(format: &str, nodes: &Nodes, groups: &[Group], of: impl Fn(&Group, &Cell) -> Vec<usize>) -> String {
    let mut text = format!("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n{}\n", groups.len());
    let dimension = |group: &Group| group.elements[0].2.shape.dimension();
    for (tag, group) in (1..).zip(groups) {
        let _ = writeln!(text, "{} {tag} \"{}\"", dimension(group), group.name);
    }
    let counts = [0, 1, 2, 3].map(|d| groups.iter().filter(|group| dimension(group) == d).count());
    let _ = writeln!(text, "$EndPhysicalNames\n$Entities\n{}", words(&counts, " "));
    for d in 1..=3 {
        for (tag, _) in (1..).zip(groups).filter(|(_, group)| dimension(group) == d) {
            let _ = writeln!(text, "{tag} 0 0 0 1 1 1 1 {tag} 0");
        }
    }
    let _ = writeln!(text, "$EndEntities\n$Nodes\n1 {0} 1 {0}\n3 1 0 {0}", nodes.len());
    nodes.iter().for_each(|(number, _)| text += &format!("{number}\n"));
    nodes.iter().for_each(|(_, x)| text += &format!("{}\n", words(x, " ")));
    let total: usize = groups.iter().map(|group| group.elements.len()).sum();
    let mut blocks = String::new();
    let (mut count, mut next) = (0, 0);
    for (tag, group) in (1..).zip(groups) {
        for shape in [Line, Triangle, Quadrangle, Hexahedron, Prism, Pyramid] {
            let of_shape: Vec<_> = group.elements.iter().filter(|(_, _, cell)| cell.shape == shape).collect();
            if of_shape.is_empty() {
                continue;
            }
            count += 1;
            let _ = writeln!(blocks, "{} {tag} {} {}", shape.dimension(), shape.kind(format), of_shape.len());
            for (_, _, cell) in of_shape {
                next += 1;
                let _ = writeln!(blocks, "{next} {}", words(&of(group, cell), " "));
            }
        }
    }
    text + &format!("$EndNodes\n$Elements\n{count} {total} 1 {total}\n{blocks}$EndElements\n")
}

/// Format 2.2.
fn msh2(nodes: &Nodes, groups: &[Group], of: impl Fn(&Group, &Cell) -> Vec<usize>) -> String {
    let mut text = format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{}\n", groups.len());
    for (tag, group) in (1..).zip(groups) {
        let _ = writeln!(text, "{} {tag} \"{}\"", group.elements[0].2.shape.dimension(), group.name);
    }
    let _ = writeln!(text, "$EndPhysicalNames\n$Nodes\n{}", nodes.len());
    nodes.iter().for_each(|(number, x)| text += &format!("{number} {}\n", words(x, " ")));
    let total: usize = groups.iter().map(|group| group.elements.len()).sum();
    let _ = writeln!(text, "$EndNodes\n$Elements\n{total}");
    let mut next = 0;
    for (tag, group) in (1..).zip(groups) {
        for (_, _, cell) in &group.elements {
            next += 1;
            let _ = writeln!(text, "{next} {} 2 {tag} {tag} {}", cell.shape.kind("msh"), words(&of(group, cell), " "));
        }
    }
    text + "$EndElements\n"
}

/// Abaqus: element sets, and surfaces by the numbers of faces.
fn inp(nodes: &Nodes, groups: &[Group], of: impl Fn(&Group, &Cell) -> Vec<usize>) -> String {
    let mut text = String::from("*NODE\n");
    nodes.iter().for_each(|(number, x)| text += &format!("{number}, {}\n", words(x, ", ")));
    for group in groups {
        if group.name.contains('_') {
            let _ = writeln!(text, "*SURFACE, NAME={}", group.name);
        }
        for (cell, number, element) in &group.elements {
            let tag = 1000 * group.body + cell + 1;
            if *number > 0 {
                let _ = writeln!(text, "{tag}, S{number}");
                continue;
            }
            let _ = writeln!(text, "*ELEMENT, TYPE={}, ELSET={}", element.shape.kind("inp"), group.name);
            let all = [&[tag][..], &of(group, element)].concat();
            let lines: Vec<String> = all.chunks(16).map(|line| words(line, ", ")).collect();
            let _ = writeln!(text, "{}", lines.join(",\n"));
        }
    }
    text
}

/// The name of a group: `body` alone, or with a side.
fn name(body: usize, side: Option<&str>) -> String {
    side.map_or(NAMES[body].to_owned(), |side| format!("{}_{side}", NAMES[body]))
}

/// Replaces `{lower}`, `{upper:c1}` and the like by the names of groups, and writes the mesh beside the scene.
fn written(two: &Two, format: &str, template: &str) -> Scene {
    let dimension = two.blocks[0].counts.len();
    let mut text = template.replace("{dimension}", &dimension.to_string());
    for (body, own) in NAMES.iter().enumerate() {
        text = text.replace(&format!("{{{own}}}"), &name(body, None));
        for axis in ["a", "b", "c"].iter().take(dimension) {
            for end in 0..2 {
                let side = format!("{axis}{end}");
                text = text.replace(&format!("{{{own}:{side}}}"), &name(body, Some(&side)));
            }
        }
    }
    let ending = if ["full", "msh2"].contains(&format) { "msh" } else { format };
    let scene = Scene::new(format!("mesh = \"mesh.{ending}\"\n{text}"));
    fs::write(scene.path.with_file_name(format!("mesh.{ending}")), two.text(format)).expect("a mesh");
    scene
}

/// Blocks without lateral strain under a pressure of 10, in the plane or in space.
fn patch(two: &Two, format: &str, order: u8) -> Scene {
    let (top, fixed) = if two.blocks[0].counts.len() == 2 { ("b", "x = 0") } else { ("c", "x = 0, y = 0") };
    let bottom = if top == "b" { "x = 0, y = 0" } else { "x = 0, y = 0, z = 0" };
    let body = "young = 2.1e5\npoisson = 0";
    let text = format!(
        "dimension = {{dimension}}\n[[body]]\nname = \"{{lower}}\"\norder = {order}\n{body}\n\
         fix = [{{ on = \"{{lower:{top}0}}\", {bottom} }}]\n[[body]]\nname = \"{{upper}}\"\norder = {order}\n{body}\n\
         fix = [{{ on = \"{{upper:{top}1}}\", {fixed} }}]\nload = [{{ on = \"{{upper:{top}1}}\", pressure = 10 }}]\n\
         [[contact]]\nbetween = [\"{{lower:{top}1}}\", \"{{upper:{top}0}}\"]\nlayer = {{ linear = {{ stiffness = 1e5 }} }}\n"
    );
    written(two, format, &text)
}

/// Asserts that the pressure is 10 everywhere, on an area of 1, and that nothing but the split was said.
fn is_patch(run: &Run, what: &str, size: f64) {
    let pressures = run.contact()["pressure"].to_vec();
    let worst = pressures.iter().map(|p| (p - 10.0).abs()).fold(0.0, f64::max);
    assert!(worst < size, "{what}: {worst}");
    let warnings = run.warnings();
    assert!(warnings.contains("were split") && warnings.lines().count() == 1, "{what}: {warnings}");
}

/// The unit square or cube, the upper body above it, with curved sides.
fn sheared(body: usize, [a, b, c]: [f64; 3]) -> [f64; 3] {
    [a + 0.3 * b * (1.0 - b), b, c + body as f64]
}

/// The unit square, the upper body above it, with curved edges inside.
fn plane(body: usize, [a, b, _]: [f64; 3]) -> [f64; 3] {
    [a + 0.8 * a * (1.0 - a) * b * (1.0 - b), b + body as f64, 0.0]
}

#[test]
fn quadrangles_have_constant_pressure() {
    let two = Two { blocks: [Block::new(Quadrangle, &[2, 2]), Block::new(Quadrangle, &[3, 1])], place: &plane };
    for format in ["msh", "full", "msh2", "inp"] {
        is_patch(&solve(patch(&two, format, 2), &[]).converged(), format, 1e-8);
    }
}

#[test]
fn hexahedra_and_prisms_have_constant_pressure() {
    let two = Two { blocks: [Block::new(Hexahedron, &[2, 2, 1]), Block::new(Prism, &[1, 2, 1])], place: &sheared };
    for format in ["msh", "full", "msh2", "inp"] {
        is_patch(&solve(patch(&two, format, 2), &[]).converged(), format, 1e-8);
    }
    // Straight ones serve order 1.
    let straight = |body: usize, [a, b, c]: [f64; 3]| [a, b, c + body as f64];
    let run = solve_on(2, patch(&Two { place: &straight, ..two }, "inp", 1), &[]).converged();
    is_patch(&run, "order 1", 1e-8);
}

#[test]
fn pyramids_have_constant_pressure() {
    let two = Two { blocks: [Block::new(Pyramid, &[1, 2, 1]), Block::new(Hexahedron, &[2, 1, 1])], place: &sheared };
    for format in ["msh", "full", "msh2"] {
        is_patch(&solve(patch(&two, format, 2), &[]).converged(), format, 1e-8);
    }
}

/// Two quarters of rings, the outer one pressed: radii 0.5, 1 and 1.6, contact pressure 8.985959 by Lamé.
fn rings(two: &Two, format: &str) -> Scene {
    let (c, axial) = if two.blocks[0].counts.len() == 2 {
        ("b", ["", ""])
    } else {
        (
            "c",
            [
                ", { on = \"{lower:b0}\", z = 0 }, { on = \"{lower:b1}\", z = 0 }",
                ", { on = \"{upper:b0}\", z = 0 }, { on = \"{upper:b1}\", z = 0 }",
            ],
        )
    };
    let fix = |body: &str, more: &str| {
        format!("fix = [{{ on = \"{{{body}:a0}}\", x = 0 }}, {{ on = \"{{{body}:a1}}\", y = 0 }}{more}]")
    };
    let text = format!(
        "dimension = {{dimension}}\n[[body]]\nname = \"{{lower}}\"\norder = 2\nyoung = 2.1e5\npoisson = 0.3\n{}\n\
         [[body]]\nname = \"{{upper}}\"\norder = 2\nyoung = 7e4\npoisson = 0.2\n{}\n\
         load = [{{ on = \"{{upper:{c}1}}\", pressure = 10 }}]\n[[contact]]\ntouching = true\n\
         between = [\"{{lower:{c}1}}\", \"{{upper:{c}0}}\"]\nlayer = {{ linear = {{ stiffness = 1e5 }} }}\n",
        fix("lower", axial[0]),
        fix("upper", axial[1])
    );
    written(two, format, &text)
}

/// A quarter of a ring: the first parameter turns from the y-axis to the x-axis.
fn polar(body: usize, a: f64, r: f64) -> [f64; 2] {
    let (inner, outer) = [(0.5, 1.0), (1.0, 1.6)][body];
    let r = inner + (outer - inner) * r;
    let (x, y) = (0.5 * PI * a).sin_cos();
    [r * x, r * y]
}

/// Largest error of the pressure.
fn error(scene: Scene, what: &str) -> f64 {
    let run = solve(scene, &[]).converged();
    let warnings = run.warnings();
    assert!(warnings.contains("were split") && warnings.lines().count() == 1, "{what}: {warnings}");
    run.contact()["pressure"].iter().map(|p| (p - 8.985959).abs()).fold(0.0, f64::max)
}

#[test]
fn rings_of_quadrangles_have_lames_pressure() {
    let place = |body: usize, [a, b, _]: [f64; 3]| {
        let [x, y] = polar(body, a, b);
        [x, y, 0.0]
    };
    let two =
        |n: i32| Two { blocks: [Block::new(Quadrangle, &[n, n]), Block::new(Quadrangle, &[n + 1, n])], place: &place };
    let coarse = ["msh", "full", "inp"].map(|format| error(rings(&two(3), format), format));
    let fine = error(rings(&two(6), "msh"), "fine");
    assert!(coarse.iter().all(|error| *error < 0.02) && fine < coarse[0] / 4.0, "{coarse:?} {fine}");
}

#[test]
fn rings_of_hexahedra_and_prisms_have_lames_pressure() {
    // The axis of the ring comes second, so that all faces of the elements are in use.
    let place = |body: usize, [a, b, c]: [f64; 3]| {
        let [x, y] = polar(body, a, c);
        [x, y, -0.5 * b]
    };
    let two = |shapes: [Shape; 2], n: i32| Two {
        blocks: [Block::new(shapes[0], &[n, 1, n]), Block::new(shapes[1], &[n + 1, 1, n])],
        place: &place,
    };
    let mut all = Vec::new();
    for format in ["msh", "inp"] {
        all.push(error(rings(&two([Hexahedron, Prism], 3), format), format));
    }
    all.push(error(rings(&two([Pyramid, Hexahedron], 3), "msh"), "pyramids"));
    let fine = error(rings(&two([Hexahedron, Prism], 8), "msh"), "fine");
    assert!(all.iter().all(|error| *error < 0.03) && fine < all[0] / 2.0, "{all:?} {fine}");
}
