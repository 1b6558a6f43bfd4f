//! Random scenes of the box V9 as scene files.

#![allow(dead_code)] // the example and the test each use their own part

use crate::random::Random;
use std::fmt::Write;
use std::path::Path;

/// What a scene must lead to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expect {
    /// Pressure and displacement that are unique.
    Solution,
    /// A motion stays free that no load moves: a solution up to it, or the name of the motion.
    Gauge,
    /// Loads push a body away or along its contact: the status must name it.
    Nothing,
}

/// A scene with what is known of it.
pub struct Case {
    /// Number in its series.
    pub index: usize,
    /// Text of the scene file, without `[method]`.
    pub text: String,
    /// The scene in a line.
    pub line: String,
    /// What it must lead to.
    pub expect: Expect,
    /// Whether contact alone holds some body.
    pub hanging: bool,
    /// Size of pressures that would matter, where the solution has none.
    pub pressure: f64,
    /// Force that every contact of a stack must carry, where statics alone tell.
    pub carried: Option<f64>,
    /// A relaxation for the paper's iteration.
    pub gamma: f64,
    /// The key `start` of the method, if it is given.
    pub start: Option<String>,
}

/// Mesh of a stack of blocks or of a ring of four: blocks, columns, width, height, elements along each width.
#[derive(Clone, Copy)]
struct Shape {
    blocks: usize,
    columns: usize,
    width: f64,
    height: f64,
    along: [usize; 4],
}

const fn stack(width: f64, height: f64, along: [usize; 2]) -> Shape {
    Shape { blocks: 2, columns: 1, width, height, along: [along[0], along[1], 1, 1] }
}

const fn three(width: f64, along: [usize; 3]) -> Shape {
    Shape { blocks: 3, columns: 1, width, height: 1.0, along: [along[0], along[1], along[2], 1] }
}

const fn ring(along: [usize; 4]) -> Shape {
    Shape { blocks: 4, columns: 2, width: 1.0, height: 1.0, along }
}

/// Few enough for the mesher to be a small part of a run.
const SHAPES: [Shape; 29] = [
    stack(1.0, 1.0, [1, 1]),
    stack(1.0, 1.0, [1, 1]),
    stack(1.0, 1.0, [1, 2]),
    stack(1.0, 1.0, [2, 2]),
    stack(1.0, 1.0, [3, 2]),
    stack(1.0, 1.0, [4, 4]),
    stack(1.0, 1.0, [5, 7]),
    stack(1.0, 1.0, [1, 8]),
    stack(1.0, 1.0, [8, 8]),
    stack(1.0, 1.0, [11, 8]),
    stack(1.0, 1.0, [16, 3]),
    stack(1.0, 1.0, [16, 16]),
    stack(4.0, 1.0, [4, 4]),
    stack(4.0, 1.0, [8, 11]),
    stack(4.0, 1.0, [16, 16]),
    stack(20.0, 1.0, [8, 13]),
    stack(20.0, 1.0, [20, 20]),
    stack(20.0, 1.0, [40, 30]),
    stack(1.0, 20.0, [1, 1]),
    stack(1.0, 20.0, [2, 2]),
    stack(1.0, 20.0, [2, 3]),
    three(1.0, [1, 1, 1]),
    three(1.0, [4, 4, 4]),
    three(1.0, [3, 5, 4]),
    three(4.0, [8, 12, 8]),
    three(20.0, [20, 15, 20]),
    ring([1, 1, 1, 1]),
    ring([4, 4, 4, 4]),
    ring([5, 3, 4, 7]),
];

/// How the blocks are held and driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Hold {
    /// Every block by an end; the outer faces are loaded.
    Ends,
    /// The lowest on a roller, the others kept from moving sideways; contact alone holds them in y.
    Roller,
    /// As `Roller`, but the others are kept by one corner and may turn.
    Pinned,
    /// As `Roller`, and the highest is moved by its face.
    Pressed,
    /// As `Pinned`, but nothing keeps the highest from moving sideways.
    Loose,
    /// As `Loose`, with a load along the contact.
    Sliding,
    /// As `Roller`, with the load turned round.
    Pulled,
    /// As `Ends`, with the loads turned round.
    Lifted,
}

const HOLDS: [Hold; 20] = [
    Hold::Ends,
    Hold::Ends,
    Hold::Ends,
    Hold::Ends,
    Hold::Roller,
    Hold::Roller,
    Hold::Roller,
    Hold::Roller,
    Hold::Roller,
    Hold::Pinned,
    Hold::Pinned,
    Hold::Pinned,
    Hold::Pinned,
    Hold::Pressed,
    Hold::Pressed,
    Hold::Pressed,
    Hold::Loose,
    Hold::Sliding,
    Hold::Pulled,
    Hold::Lifted,
];

/// Scene `index` of the series `seed`; `root` is the folder of the program.
pub fn scene(seed: u64, index: usize, root: &Path) -> Case {
    let mut random = Random::new(seed, index);
    let shape = random.pick(&SHAPES);
    // an end that holds a tall block keeps the load away from the contact
    let hold = match random.pick(&HOLDS) {
        Hold::Ends if shape.height > shape.width => Hold::Roller,
        Hold::Lifted if shape.height > shape.width => Hold::Pressed,
        hold => hold,
    };
    let is_ring = shape.columns == 2;

    // bodies: units, ratios, Poisson
    let unit = random.power_of_ten(0.0, 11.0);
    let equal = random.chance(0.35);
    let young: Vec<f64> =
        (0..shape.blocks).map(|_| if equal { unit } else { unit * random.power_of_ten(-3.0, 3.0) }).collect();
    let poisson: Vec<f64> = (0..shape.blocks)
        .map(|_| match random.pick(&[0, 1, 1, 2, 3]) {
            0 => 0.0,
            1 => 0.3,
            2 => random.uniform(0.0, 0.49),
            _ => 0.4999,
        })
        .collect();
    let order: Vec<usize> = match random.pick(&[0, 0, 1, 2]) {
        0 => vec![1; shape.blocks],
        1 => vec![2; shape.blocks],
        _ => (0..shape.blocks).map(|_| random.pick(&[1, 2])).collect(),
    };

    // load
    let softest = young.iter().copied().fold(f64::INFINITY, f64::min);
    let level = softest * random.power_of_ten(-8.0, -3.0);
    let load = if random.chance(0.08) { 0.0 } else { level };
    let lean = if random.chance(0.3) { random.uniform(-0.8, 0.8) } else { 0.0 };

    let mut text = String::new();
    let mut line = String::new();
    let set = shape.along.iter().take(shape.blocks).enumerate().map(|(i, n)| format!("n{} = {n}", i + 1));
    let _ = writeln!(text, "dimension = 2");
    let _ = writeln!(
        text,
        "mesh = {{ geo = \"{}\", set = {{ rows = {}, columns = {}, width = {}, height = {}, {} }} }}",
        root.join("meshes/stack/stack.geo").display(),
        shape.blocks / shape.columns,
        shape.columns,
        shape.width,
        shape.height,
        set.collect::<Vec<_>>().join(", ")
    );
    let what = if is_ring { "ring".to_owned() } else { format!("{} {}x{}", shape.blocks, shape.width, shape.height) };
    let numbers = |values: &[f64]| values.iter().map(|v| format!("{v:.1e}")).collect::<Vec<_>>().join(" ");
    let _ = write!(
        line,
        "{what} n {:?} P{order:?} {hold:?} E {} nu {:?} q {load:.1e}",
        &shape.along[..shape.blocks],
        numbers(&young),
        poisson.iter().map(|nu| (nu * 1e4).round() / 1e4).collect::<Vec<_>>(),
    );
    if lean != 0.0 {
        let _ = write!(line, " lean {lean:.2}");
    }

    // contacts: the law at the level of pressure, then the gap by what the load closes
    let mut contacts = String::new();
    let between: &[([usize; 2], bool)] = if is_ring {
        &[([1, 3], false), ([2, 4], false), ([1, 2], true), ([3, 4], true)]
    } else {
        &[([1, 2], false), ([2, 3], false)][..shape.blocks - 1]
    };
    let mut pressure_scale = level;
    let mut compliance = 0.0;
    for &([a, b], upright) in between {
        // kappa h/E from 1e-6 to 1e6 for both bodies
        let (soft, stiff) = (young[a - 1].min(young[b - 1]), young[a - 1].max(young[b - 1]));
        let kappa = random.power_of_ten(-6.0 + (stiff / soft).log10(), 6.0) * soft / shape.height;
        let (law, closing) = if random.chance(0.3) {
            let _ = write!(line, " | kappa {:.1e}", kappa * shape.height / soft);
            (format!("linear = {{ stiffness = {kappa:e} }}"), level / kappa)
        } else {
            let exponent = random.pick(&[0.1, 0.3, 0.5, 1.0, random_exponent(index)]);
            // p' = p^(1-a) / (a B) = kappa where the pressure is `level`
            let b = level.powf(1.0 - exponent) / (exponent * kappa);
            let _ = write!(line, " | kappa {:.1e} a {exponent:.2}", kappa * shape.height / soft);
            (format!("power = {{ B = {b:e}, a = {exponent} }}"), level / (exponent * kappa))
        };
        let shortening = level * shape.height / soft;
        compliance += shortening + closing;
        let (axis, length) = if upright { ("y", shape.height) } else { ("x", shape.width) };
        // places are measured from the start of the common face
        let start = match (upright, a) {
            (false, 2) if is_ring => shape.width,
            (true, 3) => shape.height,
            _ => 0.0,
        };
        let s = format!("({axis} - {start})/{length}");
        let depth = (shortening + closing) * random.power_of_ten(-2.0, 1.5);
        let gap = match random.pick(&[0, 0, 1, 2, 3, 4, 5]) {
            0 => String::new(),
            1 => format!("{depth:e} * max(0, 1 - (({s} - 1)/0.3)^2)^1.5"),
            2 => format!("{depth:e} * (1 - cos(2*pi*{}*{s}))", random.pick(&[0.5, 1.0, 2.0])),
            3 => format!("{depth:e} * {s}"),
            // never touches, where a support holds the blocks; else they fall far, by what rounding leaves of it
            4 => format!(
                "{:e}",
                if matches!(hold, Hold::Ends | Hold::Lifted | Hold::Pressed) {
                    10.0 * shape.height.max(1e2 * (shortening + closing))
                } else {
                    1e3 * (shortening + closing)
                }
            ),
            _ => {
                let overlap = (shortening + closing) * random.power_of_ten(-2.0, 0.3);
                pressure_scale = f64::max(pressure_scale, softest * overlap / shape.height);
                format!("{:e}", -overlap)
            }
        };
        let names = if upright { ["right", "left"] } else { ["top", "bottom"] };
        let _ = writeln!(contacts, "\n[[contact]]\nbetween = [\"b{a}_{}\", \"b{b}_{}\"]", names[0], names[1]);
        if !gap.is_empty() {
            let _ = writeln!(contacts, "gap = \"{gap}\"");
            let _ = write!(line, " gap {gap}");
        }
        let _ = writeln!(contacts, "layer = {{ {law} }}");
    }

    // bodies
    let sign = if matches!(hold, Hold::Pulled | Hold::Lifted) { -1.0 } else { 1.0 };
    let top = shape.blocks;
    let mut hanging = false;
    for block in 1..=shape.blocks {
        let (mut fix, mut loads) = (Vec::new(), Vec::new());
        let on = |place: &str, what: String| format!("{{ on = \"b{block}_{place}\", {what} }}");
        let pressure = |at: &str, width: f64| match lean {
            0.0 => format!("pressure = {:e}", sign * load),
            _ => format!("pressure = \"{:e} * (1 + {lean}*(2*{at}/{width} - 1))\"", sign * load),
        };
        if is_ring {
            let (lower, inner) = (block <= 2, block % 2 == 1);
            if matches!(hold, Hold::Ends | Hold::Lifted) {
                fix.push(on("pin", "x = 0, y = 0".into()));
                fix.push(on(if lower { "bottom" } else { "top" }, "y = 0".into()));
            } else {
                if lower {
                    fix.push(on("bottom", "y = 0".into()));
                }
                if inner {
                    fix.push(on("left", "x = 0".into()));
                }
                hanging |= !lower || !inner;
            }
            if !lower && !matches!(hold, Hold::Ends | Hold::Lifted) {
                loads.push(on("top", format!("pressure = {:e}", sign * load)));
            }
            if !inner {
                loads.push(on("right", format!("pressure = {:e}", sign * load)));
            }
        } else if matches!(hold, Hold::Ends | Hold::Lifted) {
            fix.push(on("left", "x = 0, y = 0".into()));
            fix.push(on("right", "x = 0".into()));
            if block == 1 {
                loads.push(on("bottom", pressure("x", shape.width)));
            }
            if block == top {
                loads.push(on("top", pressure("x", shape.width)));
            }
        } else if block == 1 {
            fix.push(on("bottom", "y = 0".into()));
            fix.push(on("left", "x = 0".into()));
        } else {
            let turns = matches!(hold, Hold::Pinned | Hold::Loose | Hold::Sliding);
            if !(block == top && matches!(hold, Hold::Loose | Hold::Sliding)) {
                fix.push(on(if turns { "pin" } else { "left" }, "x = 0".into()));
            }
            if block == top && hold == Hold::Pressed {
                let depth = if load == 0.0 { 0.0 } else { compliance };
                pressure_scale = f64::max(pressure_scale, softest * depth / shape.height);
                fix.push(on("top", format!("y = {:e}", -depth)));
                body(&mut text, block, young[block - 1], poisson[block - 1], order[block - 1], &fix, &loads);
                continue;
            }
            hanging = true;
            if block == top {
                loads.push(on("top", pressure("x", shape.width)));
                if hold == Hold::Sliding {
                    loads.push(on("right", format!("pressure = {:e}", 0.01 * load)));
                }
            }
        }
        body(&mut text, block, young[block - 1], poisson[block - 1], order[block - 1], &fix, &loads);
    }
    text.push_str(&contacts);
    let expect = match hold {
        Hold::Ends | Hold::Pressed | Hold::Lifted | Hold::Roller | Hold::Pinned => Expect::Solution,
        Hold::Loose if is_ring => Expect::Solution,
        Hold::Sliding if is_ring => Expect::Solution,
        Hold::Loose => Expect::Gauge,
        Hold::Sliding | Hold::Pulled if load == 0.0 => Expect::Gauge,
        Hold::Sliding | Hold::Pulled => Expect::Nothing,
    };
    let statics = !is_ring && matches!(hold, Hold::Roller | Hold::Pinned);
    Case {
        index,
        text,
        line,
        expect: if load == 0.0 && hanging && expect == Expect::Solution { Expect::Gauge } else { expect },
        hanging,
        pressure: pressure_scale,
        carried: statics.then_some(load * shape.width),
        gamma: random.power_of_ten(-2.0, 0.08),
        start: None,
    }
}

/// An exponent of the layer's law anywhere in its range; by index, so that it does not shift the stream.
fn random_exponent(index: usize) -> f64 {
    (Random::new(7, index).uniform(0.1, 1.0) * 100.0).round() / 100.0
}

fn body(text: &mut String, block: usize, young: f64, poisson: f64, order: usize, fix: &[String], loads: &[String]) {
    let _ = writeln!(text, "\n[[body]]\nname = \"b{block}\"\nyoung = {young:e}\npoisson = {poisson}\norder = {order}");
    let _ = writeln!(text, "fix = [{}]", fix.join(", "));
    if !loads.is_empty() {
        let _ = writeln!(text, "load = [{}]", loads.join(", "));
    }
}
