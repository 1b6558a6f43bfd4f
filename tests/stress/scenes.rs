//! Random scenes of the box V9 as scene files.

#![allow(dead_code)] // the example and the test each use their own part

use super::builder::{Bodies, Holds, on};
use super::laws::Law;
use super::random::Random;
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
    /// The key `steps` of the method, if it is given.
    pub steps: Option<String>,
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
    Unconstrained,
    /// As `Unconstrained`, with a load along the contact.
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
    Hold::Unconstrained,
    Hold::Sliding,
    Hold::Pulled,
    Hold::Lifted,
];

/// A contact of two blocks, numbered from 0.
#[derive(Clone, Copy)]
struct Joint {
    blocks: [usize; 2],
    is_upright: bool,
}

const fn joint(blocks: [usize; 2], is_upright: bool) -> Joint {
    Joint { blocks, is_upright }
}

/// The contacts of a ring, in the order in which they are drawn.
const RING: [Joint; 4] = [joint([0, 2], false), joint([1, 3], false), joint([0, 1], true), joint([2, 3], true)];
/// Those of a stack of three.
const STACK: [Joint; 2] = [joint([0, 1], false), joint([1, 2], false)];

/// A scene in the making.
struct Blocks {
    random: Random,
    index: usize,
    shape: Shape,
    hold: Hold,
    bodies: Bodies,
    /// Pressure that loads could make, never zero.
    level: f64,
    /// Pressure of the loads, zero for none.
    load: f64,
    /// How much more a load presses at the end of its face than in the middle.
    lean: f64,
    /// The scene in a line.
    line: String,
    /// Pressure that would matter.
    pressure: f64,
    /// What all layers and bodies give way under the load.
    compliance: f64,
}

/// Scene `index` of the series `seed`; `root` is the folder of the program.
pub fn scene(seed: u64, index: usize, root: &Path) -> Case {
    let mut blocks = Blocks::draw(seed, index);
    let joints = if blocks.is_ring() { &RING[..] } else { &STACK[..blocks.shape.blocks - 1] };
    let contacts: String = joints.iter().map(|&joint| blocks.contact(joint)).collect();
    let mut text = blocks.mesh(root);
    for block in 0..blocks.shape.blocks {
        let holds = blocks.holds(block);
        blocks.bodies.write(&mut text, block, &holds, 2);
    }
    text.push_str(&contacts);
    let statics = !blocks.is_ring() && matches!(blocks.hold, Hold::Roller | Hold::Pinned);
    Case {
        index,
        text,
        expect: blocks.expect(),
        hanging: blocks.hangs(),
        pressure: blocks.pressure,
        carried: statics.then_some(blocks.load * blocks.shape.width),
        gamma: blocks.random.power_of_ten(-2.0, 0.08),
        start: None,
        steps: None,
        line: blocks.line,
    }
}

impl Blocks {
    /// Draws shape, hold, bodies and load.
    fn draw(seed: u64, index: usize) -> Self {
        let mut random = Random::new(seed, index);
        let shape = random.pick(&SHAPES);
        // an end that holds a tall block keeps the load away from the contact
        let hold = match random.pick(&HOLDS) {
            Hold::Ends if shape.height > shape.width => Hold::Roller,
            Hold::Lifted if shape.height > shape.width => Hold::Pressed,
            hold => hold,
        };
        let bodies = Bodies::draw(&mut random, shape.blocks);
        let level = bodies.softest() * random.power_of_ten(-8.0, -3.0);
        let load = if random.chance(0.08) { 0.0 } else { level };
        let lean = if random.chance(0.3) { random.uniform(-0.8, 0.8) } else { 0.0 };
        let line = String::new();
        let mut blocks =
            Self { random, index, shape, hold, bodies, level, load, lean, line, pressure: level, compliance: 0.0 };
        blocks.line = blocks.described();
        blocks
    }

    /// Shape, hold, bodies and load in words.
    fn described(&self) -> String {
        let Self { shape, hold, bodies, load, lean, .. } = self;
        let Shape { blocks, width, height, .. } = *shape;
        let what = if self.is_ring() { "ring".to_owned() } else { format!("{blocks} {width}x{height}") };
        let leans = if *lean == 0.0 { String::new() } else { format!(" lean {lean:.2}") };
        format!(
            "{what} n {:?} P{:?} {hold:?} E {} nu {:?} q {load:.1e}{leans}",
            &shape.along[..blocks],
            bodies.order,
            bodies.moduli(),
            bodies.poisson.iter().map(|nu| (nu * 1e4).round() / 1e4).collect::<Vec<_>>(),
        )
    }

    fn is_ring(&self) -> bool {
        self.shape.columns == 2
    }

    /// Whether supports hold every block.
    fn are_held(&self) -> bool {
        matches!(self.hold, Hold::Ends | Hold::Lifted)
    }

    /// Whether contact alone holds some block.
    fn hangs(&self) -> bool {
        !self.are_held() && (self.is_ring() || self.shape.blocks > 2 || self.hold != Hold::Pressed)
    }

    fn mesh(&self, root: &Path) -> String {
        let Shape { blocks, columns, width, height, along } = self.shape;
        let set = along.iter().take(blocks).enumerate().map(|(i, n)| format!("n{} = {n}", i + 1));
        format!(
            "dimension = 2\nmesh = {{ geo = \"{}\", set = {{ rows = {}, columns = {columns}, width = {width}, height = {height}, {} \
             }} }}\n",
            root.join("meshes/stack/stack.geo").display(),
            blocks / columns,
            set.collect::<Vec<_>>().join(", ")
        )
    }

    /// A contact: the law at the level of pressure, then the gap by what the load closes.
    fn contact(&mut self, joint: Joint) -> String {
        let Shape { width, height, .. } = self.shape;
        let [soft, stiff] = self.bodies.soft_and_stiff(joint.blocks);
        // kappa h/E from 1e-6 to 1e6 for both bodies
        let kappa = self.random.power_of_ten(-6.0 + (stiff / soft).log10(), 6.0) * soft / height;
        let _ = write!(self.line, " | kappa {:.1e}", kappa * height / soft);
        let Law { text: law, closing } = self.law(kappa);
        let closes = self.level * height / soft + closing;
        self.compliance += closes;
        let (axis, length) = if joint.is_upright { ("y", height) } else { ("x", width) };
        // places are measured from the start of the common face
        let start = match (joint.is_upright, joint.blocks[0]) {
            (false, 1) if self.is_ring() => width,
            (true, 2) => height,
            _ => 0.0,
        };
        let gap = self.gap(&format!("({axis} - {start})/{length}"), closes);
        let [a, b] = joint.blocks.map(|block| block + 1);
        let [from, to] = if joint.is_upright { ["right", "left"] } else { ["top", "bottom"] };
        let mut text = format!("\n[[contact]]\nbetween = [\"b{a}_{from}\", \"b{b}_{to}\"]\n");
        if !gap.is_empty() {
            let _ = writeln!(text, "gap = \"{gap}\"");
            let _ = write!(self.line, " gap {gap}");
        }
        let _ = writeln!(text, "layer = {{ {law} }}");
        text
    }

    /// A linear law or a power law with p' = `kappa` at the level of pressure.
    fn law(&mut self, kappa: f64) -> Law {
        let level = self.level;
        if self.random.chance(0.3) {
            return Law { text: format!("linear = {{ stiffness = {kappa:e} }}"), closing: level / kappa };
        }
        let exponent = self.random.pick(&[0.1, 0.3, 0.5, 1.0, random_exponent(self.index)]);
        // p' = p^(1-a) / (a B) = kappa where the pressure is `level`
        let b = level.powf(1.0 - exponent) / (exponent * kappa);
        let _ = write!(self.line, " a {exponent:.2}");
        Law { text: format!("power = {{ B = {b:e}, a = {exponent} }}"), closing: level / (exponent * kappa) }
    }

    /// A gap along `s` from 0 to 1, or none; the load closes about `closes`.
    fn gap(&mut self, s: &str, closes: f64) -> String {
        let depth = closes * self.random.power_of_ten(-2.0, 1.5);
        match self.random.pick(&[0, 0, 1, 2, 3, 4, 5]) {
            0 => String::new(),
            1 => format!("{depth:e} * max(0, 1 - (({s} - 1)/0.3)^2)^1.5"),
            2 => format!("{depth:e} * (1 - cos(2*pi*{}*{s}))", self.random.pick(&[0.5, 1.0, 2.0])),
            3 => format!("{depth:e} * {s}"),
            // never touches, where a support holds the blocks; else they fall far, by what rounding leaves of it
            4 if self.are_held() || self.hold == Hold::Pressed => {
                format!("{:e}", 10.0 * self.shape.height.max(1e2 * closes))
            }
            4 => format!("{:e}", 1e3 * closes),
            _ => {
                let overlap = closes * self.random.power_of_ten(-2.0, 0.3);
                self.matters(overlap);
                format!("{:e}", -overlap)
            }
        }
    }

    /// Pressures matter that a displacement makes.
    fn matters(&mut self, displacement: f64) {
        self.pressure = self.pressure.max(self.bodies.softest() * displacement / self.shape.height);
    }

    /// Supports and loads of a block, numbered from 0.
    fn holds(&mut self, block: usize) -> Holds {
        match self.is_ring() {
            true => self.in_ring(block),
            false if self.are_held() => self.held(block),
            false if block == 0 => {
                Holds { fix: vec![on(0, "bottom", "y = 0"), on(0, "left", "x = 0")], ..Holds::default() }
            }
            false => self.carried(block),
        }
    }

    /// The load, which pulls where the hold says so.
    fn signed_load(&self) -> f64 {
        if matches!(self.hold, Hold::Pulled | Hold::Lifted) { -self.load } else { self.load }
    }

    /// The load on a face of a stack.
    fn on_face(&self, block: usize, face: &str) -> String {
        let (load, lean, width) = (self.signed_load(), self.lean, self.shape.width);
        let pressure = match lean {
            0.0 => format!("pressure = {load:e}"),
            _ => format!("pressure = \"{load:e} * (1 + {lean}*(2*x/{width} - 1))\""),
        };
        on(block, face, &pressure)
    }

    fn in_ring(&self, block: usize) -> Holds {
        let mut holds = Holds::default();
        let (is_lower, is_left) = (block < 2, block.is_multiple_of(2));
        let pressure = format!("pressure = {:e}", self.signed_load());
        if self.are_held() {
            holds.fix.push(on(block, "pin", "x = 0, y = 0"));
            holds.fix.push(on(block, if is_lower { "bottom" } else { "top" }, "y = 0"));
        } else {
            if is_lower {
                holds.fix.push(on(block, "bottom", "y = 0"));
            } else {
                holds.load.push(on(block, "top", &pressure));
            }
            if is_left {
                holds.fix.push(on(block, "left", "x = 0"));
            }
        }
        if !is_left {
            holds.load.push(on(block, "right", &pressure));
        }
        holds
    }

    /// A block of a stack that is held at its ends.
    fn held(&self, block: usize) -> Holds {
        let mut holds =
            Holds { fix: vec![on(block, "left", "x = 0, y = 0"), on(block, "right", "x = 0")], ..Holds::default() };
        if block == 0 {
            holds.load.push(self.on_face(block, "bottom"));
        }
        if block + 1 == self.shape.blocks {
            holds.load.push(self.on_face(block, "top"));
        }
        holds
    }

    /// A block above the lowest of a stack.
    fn carried(&mut self, block: usize) -> Holds {
        let mut holds = Holds::default();
        let is_top = block + 1 == self.shape.blocks;
        let is_free = is_top && matches!(self.hold, Hold::Unconstrained | Hold::Sliding);
        if !is_free {
            let turns = matches!(self.hold, Hold::Pinned | Hold::Unconstrained | Hold::Sliding);
            holds.fix.push(on(block, if turns { "pin" } else { "left" }, "x = 0"));
        }
        match self.hold {
            _ if !is_top => {}
            Hold::Pressed => {
                let depth = if self.load == 0.0 { 0.0 } else { self.compliance };
                self.matters(depth);
                holds.fix.push(on(block, "top", &format!("y = {:e}", -depth)));
            }
            _ => holds.load.push(self.on_face(block, "top")),
        }
        if is_top && self.hold == Hold::Sliding {
            holds.load.push(on(block, "right", &format!("pressure = {:e}", 0.01 * self.load)));
        }
        holds
    }

    /// What the scene must lead to.
    fn expect(&self) -> Expect {
        let is_idle = self.load == 0.0;
        match self.hold {
            Hold::Unconstrained | Hold::Sliding if self.is_ring() => self.expect_held(),
            Hold::Unconstrained => Expect::Gauge,
            Hold::Sliding | Hold::Pulled if is_idle => Expect::Gauge,
            Hold::Sliding | Hold::Pulled => Expect::Nothing,
            Hold::Ends | Hold::Pressed | Hold::Lifted | Hold::Roller | Hold::Pinned => self.expect_held(),
        }
    }

    /// A solution, unless a body that contact alone holds has no load.
    fn expect_held(&self) -> Expect {
        if self.load == 0.0 && self.hangs() { Expect::Gauge } else { Expect::Solution }
    }
}

/// An exponent of the layer's law anywhere in its range; by index, so that it does not shift the stream.
fn random_exponent(index: usize) -> f64 {
    (Random::new(7, index).uniform(0.1, 1.0) * 100.0).round() / 100.0
}
