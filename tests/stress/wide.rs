//! Random scenes of the wider box: bodies in space, many bodies, curved contacts, small bodies, walls, springs, all laws, given starts.

use super::builder::{Holds, SceneBuilder, on};
use super::random::Random;
use super::scenes::{Case, Expect};
use std::path::Path;

/// What a scene is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Blocks beside and on each other, in the plane.
    Grid,
    /// The same as bodies of revolution.
    Rings,
    /// The same in space.
    Blocks,
    /// A cylinder on a block, or a lens between two, in the plane.
    Round,
    /// The same as bodies of revolution.
    Cap,
    /// The same in space: cylinders.
    Roll,
    /// A sphere on a block.
    Ball,
    /// A small body on a large one, or between two.
    Small,
    /// A wall of bricks.
    Bricks,
}

const KINDS: [Kind; 13] = [
    Kind::Grid,
    Kind::Grid,
    Kind::Grid,
    Kind::Rings,
    Kind::Blocks,
    Kind::Blocks,
    Kind::Round,
    Kind::Round,
    Kind::Cap,
    Kind::Roll,
    Kind::Ball,
    Kind::Small,
    Kind::Bricks,
];

/// How the bodies are held and driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Hold {
    /// Contact alone holds bodies against the load; supports keep the rest.
    Roller,
    /// Bodies may turn, too.
    Pinned,
    /// The last body may slide.
    Unconstrained,
    /// A load makes it slide.
    Sliding,
    /// The loads pull.
    Pulled,
}

const HOLDS: [Hold; 12] = [
    Hold::Roller,
    Hold::Roller,
    Hold::Roller,
    Hold::Roller,
    Hold::Pinned,
    Hold::Pinned,
    Hold::Pinned,
    Hold::Pinned,
    Hold::Pinned,
    Hold::Unconstrained,
    Hold::Sliding,
    Hold::Pulled,
];

/// Springs to the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Springs {
    None,
    /// Instead of the support from below.
    Below,
    /// At every body that contact holds, in every direction.
    All,
}

/// What a kind of scene leaves to be said.
struct Made {
    builder: SceneBuilder,
    expect: Expect,
    hanging: bool,
}

/// Scene `index` of the series `seed`; `root` is the folder of the program.
pub fn scene(seed: u64, index: usize, root: &Path) -> Case {
    let mut random = Random::new(seed, index);
    let scripts = root.join("tests/stress/meshes");
    let kind = random.pick(&KINDS);
    let made = match kind {
        Kind::Grid | Kind::Rings | Kind::Blocks => grid(random, kind, root),
        Kind::Round | Kind::Cap | Kind::Roll => round(random, kind, &scripts),
        Kind::Ball => ball(random, &scripts),
        Kind::Small => small(random, &scripts),
        Kind::Bricks => bricks(random, &scripts),
    };
    let Made { mut builder, expect, hanging } = made;
    let start = given(&mut builder.random);
    if let Some(start) = &start {
        builder.line += &format!(" | start {start}");
    }
    Case {
        index,
        text: builder.text,
        line: builder.line,
        expect,
        hanging,
        pressure: builder.pressure,
        carried: None,
        gamma: builder.random.power_of_ten(-2.0, 0.08),
        start,
        steps: None,
    }
}

/// The key `start` of the method, for some.
fn given(random: &mut Random) -> Option<String> {
    let size = random.power_of_ten(-9.0, -1.0);
    match random.uniform(0.0, 1.0) {
        u if u < 0.07 => Some(format!("{{ normal = {size:e} }}")),
        u if u < 0.10 => Some(format!("{{ normal = {:e} }}", -size)),
        u if u < 0.13 => Some(format!("{{ normal = \"{size:e}*(1 + 0.5*x)\" }}")),
        u if u < 0.16 => Some("\"zero\"".to_owned()),
        _ => None,
    }
}

/// Springs, for one scene in four that they keep what it is to be, and their stiffness over the modulus of the body that they are on. In
/// the body's matrix double precision leaves 1e-16 of its modulus: a spring of 1e-6 keeps ten digits.
fn springs(builder: &mut SceneBuilder, hold: Hold) -> (Springs, f64) {
    let stiffness = builder.random.power_of_ten(-6.0, 0.0);
    let may = matches!(hold, Hold::Roller | Hold::Pinned | Hold::Pulled) && builder.random.chance(0.25);
    let springs = match (may, hold) {
        (false, _) => Springs::None,
        (true, Hold::Pulled) => Springs::All,
        _ => builder.random.pick(&[Springs::Below, Springs::All]),
    };
    if springs != Springs::None {
        builder.line += &format!(" springs {springs:?} {stiffness:.1e}");
    }
    (springs, stiffness)
}

/// Weight of a unit of the bodies, zero for most scenes.
fn weight(builder: &mut SceneBuilder) -> f64 {
    let weight = builder.level * builder.random.power_of_ten(-2.0, 0.0);
    if builder.random.chance(0.2) { weight } else { 0.0 }
}

/// What must come of it.
fn expect(builder: &SceneBuilder, hold: Hold, springs: Springs, weight: f64) -> Expect {
    let idle = builder.load == 0.0;
    match hold {
        _ if springs == Springs::All => Expect::Solution,
        Hold::Pulled if idle && weight == 0.0 => Expect::Gauge,
        // a weight may keep what the load pulls
        Hold::Pulled if weight != 0.0 => Expect::Gauge,
        Hold::Pulled => Expect::Nothing,
        Hold::Sliding if !idle => Expect::Nothing,
        Hold::Unconstrained | Hold::Sliding => Expect::Gauge,
        Hold::Roller | Hold::Pinned if idle && weight == 0.0 => Expect::Gauge,
        Hold::Roller | Hold::Pinned => Expect::Solution,
    }
}

fn numbered(n: &[usize]) -> String {
    n.iter().enumerate().map(|(i, n)| format!("n{} = {n}", i + 1)).collect::<Vec<_>>().join(", ")
}

/// Blocks beside and on each other.
struct Grid {
    kind: Kind,
    hold: Hold,
    rows: usize,
    columns: usize,
    /// Sizes of a block.
    width: f64,
    height: f64,
    springs: Springs,
    /// Stiffness of the springs over the modulus of their body.
    ratio: f64,
    /// How much more the load presses at the end of its face than in the middle.
    lean: f64,
    /// Body force.
    weight: f64,
}

fn grid(mut random: Random, kind: Kind, root: &Path) -> Made {
    let space = kind == Kind::Blocks;
    let plane = [(2, 2), (3, 2), (2, 3), (3, 3), (1, 3), (1, 2), (3, 1), (4, 1), (6, 1)];
    let solid = [(2, 1), (3, 1), (4, 1), (1, 3), (2, 2), (1, 2)];
    let (rows, columns) = random.pick(if space { &solid[..] } else { &plane[..] });
    let (width, height) = random.pick(&[(1.0, 1.0), (1.0, 1.0), (4.0, 1.0), (1.0, 0.1), (1.0, 3.0)]);
    let finest = if space { 3.99 } else { 8.99 };
    let n: Vec<usize> = (0..4).map(|_| random.uniform(1.0, finest) as usize).collect();
    let hold = match random.pick(&HOLDS) {
        Hold::Unconstrained if columns > 1 => Hold::Pinned,
        Hold::Sliding if columns > 1 || kind == Kind::Rings => Hold::Pulled,
        hold => hold,
    };
    let name = format!("{kind:?} {hold:?}");
    let mut builder = SceneBuilder::new(random, &name, if space { 3 } else { 2 }, rows * columns);
    if kind == Kind::Rings {
        builder.text += "plane = \"axisymmetric\"\n";
    } else if !space && builder.random.chance(0.2) {
        builder.text += "plane = \"stress\"\n";
    }
    let script = if space { root.join("tests/stress/meshes/blocks.geo") } else { root.join("meshes/stack/stack.geo") };
    let mut set = format!("rows = {rows}, columns = {columns}, width = {width}, height = {height}, {}", numbered(&n));
    if space {
        set += &format!(", depth = {}", builder.random.pick(&[0.5, 1.0, 3.0]));
    }
    builder.mesh(&script, &set);
    let lean = if builder.random.chance(0.3) { builder.random.uniform(-0.8, 0.8) } else { 0.0 };
    let weight = weight(&mut builder) / height / rows as f64;
    let (springs, ratio) = springs(&mut builder, hold);
    let grid = Grid { kind, hold, rows, columns, width, height, springs, ratio, lean, weight };
    for body in 0..rows * columns {
        let holds = grid.holds(&builder, body);
        builder.body(body, &holds);
    }
    for body in 0..rows * columns {
        grid.contacts(&mut builder, body);
    }
    let expect = grid.expect(&builder);
    Made { builder, expect, hanging: rows * columns > 1 }
}

impl Grid {
    /// Supports, springs and loads of a block.
    fn holds(&self, builder: &SceneBuilder, body: usize) -> Holds {
        let &Self { kind, hold, columns, springs, ratio, weight, .. } = self;
        let (row, column) = (body / columns, body % columns);
        let space = kind == Kind::Blocks;
        let mut holds = Holds { weight, ..Holds::default() };
        if row == 0 {
            match springs {
                Springs::Below => holds.spring.push(on(body, "bottom", &builder.spring("normal", body, ratio))),
                _ => holds.fix.push(on(body, "bottom", "y = 0")),
            }
        }
        if column == 0 && !self.slides(row) && kind != Kind::Rings {
            let turns = row > 0 && columns == 1 && hold != Hold::Roller;
            holds.fix.push(on(body, if turns { "pin" } else { "left" }, "x = 0"));
        }
        if space && hold == Hold::Roller {
            holds.fix.push(on(body, "front", "z = 0"));
        } else if space {
            holds.fix.push(on(body, "pin", "z = 0"));
            holds.fix.push(on(body, "spin", "z = 0"));
        }
        if springs == Springs::All && (row > 0 || column > 0) {
            holds.spring.push(on(body, "right", &builder.spring("stiffness", body, ratio)));
        }
        self.add_loads(&mut holds, builder, body);
        holds
    }

    /// Whether the blocks of a row may slide.
    fn slides(&self, row: usize) -> bool {
        row + 1 == self.rows && matches!(self.hold, Hold::Unconstrained | Hold::Sliding)
    }

    fn add_loads(&self, holds: &mut Holds, builder: &SceneBuilder, body: usize) {
        let &Self { hold, rows, columns, width, lean, .. } = self;
        let (row, column) = (body / columns, body % columns);
        let load = if hold == Hold::Pulled { -builder.load } else { builder.load };
        if row + 1 == rows && (rows > 1 || columns == 1) {
            let pressure = format!("{load:e} * (1 + {lean}*(2*x/{} - 1))", width * columns as f64);
            holds.load.push(on(body, "top", &format!("pressure = \"{pressure}\"")));
        }
        if column + 1 == columns && columns > 1 {
            holds.load.push(on(body, "right", &format!("pressure = {load:e}")));
        } else if self.slides(row) && hold == Hold::Sliding {
            holds.load.push(on(body, "right", &format!("pressure = {:e}", 0.01 * builder.load)));
        }
    }

    /// Contacts of a block with the one above and the one beside.
    fn contacts(&self, builder: &mut SceneBuilder, body: usize) {
        let &Self { rows, columns, width, height, .. } = self;
        let (row, column, level) = (body / columns, body % columns, builder.level);
        let name = |body: usize, place: &str| format!("b{}_{place}", body + 1);
        if row + 1 < rows {
            let above = body + columns;
            let s = format!("(x/{width} - {column})");
            let names = [name(body, "top"), name(above, "bottom")];
            builder.contact(names, [body, above], (height, level), Some(&s), 0.0);
        }
        if column + 1 < columns {
            let s = format!("(y/{height} - {row})");
            let names = [name(body, "right"), name(body + 1, "left")];
            builder.contact(names, [body, body + 1], (width, level), Some(&s), 0.0);
        }
    }

    fn expect(&self, builder: &SceneBuilder) -> Expect {
        let &Self { kind, hold, rows, columns, springs, weight, .. } = self;
        match kind {
            // a weight holds nothing sideways
            _ if columns > 1 && builder.load == 0.0 && springs != Springs::All => Expect::Gauge,
            // a ring that is pulled outwards holds itself
            Kind::Rings if rows == 1 => Expect::Solution,
            _ => expect(builder, hold, springs, weight),
        }
    }
}

fn round(mut random: Random, kind: Kind, scripts: &Path) -> Made {
    let space = kind == Kind::Roll;
    let lens = random.chance(0.4);
    let whole = kind != Kind::Cap && random.chance(0.4);
    let bodies = if lens { 3 } else { 2 };
    let radius = random.pick(&[1.05, 1.3, 2.0, 10.0, 100.0, 1e4]);
    let finest = if space { 3.99 } else { 12.99 };
    let n: Vec<usize> = (0..bodies).map(|_| random.uniform(1.0, finest) as usize).collect();
    let hold = match random.pick(&HOLDS) {
        Hold::Unconstrained | Hold::Sliding if !whole => Hold::Pulled,
        // what is round may be held by what is curved, or roll
        Hold::Sliding => Hold::Unconstrained,
        hold => hold,
    };
    let name = format!("{kind:?} {hold:?}");
    let mut builder = SceneBuilder::new(random, &name, if space { 3 } else { 2 }, bodies);
    if kind == Kind::Cap {
        builder.text += "plane = \"axisymmetric\"\n";
    }
    let yes = |is: bool| usize::from(is);
    let mut set = format!("R = {radius}, whole = {}, lens = {}, {}", yes(whole), yes(lens), numbered(&n));
    if space {
        set += &format!(", depth = {}", builder.random.pick(&[0.5, 2.0]));
    }
    builder.mesh(&scripts.join("round.geo"), &set);
    let weight = weight(&mut builder);
    let (springs, ratio) = springs(&mut builder, hold);
    let sign = if hold == Hold::Pulled { -1.0 } else { 1.0 };
    for body in 0..bodies {
        let mut holds = Holds { weight, ..Holds::default() };
        match (body, springs) {
            (0, Springs::Below) => holds.spring.push(on(body, "bottom", &builder.spring("normal", body, ratio))),
            (0, _) => holds.fix.push(on(body, "bottom", "y = 0")),
            (_, Springs::All) => holds.spring.push(on(body, "right", &builder.spring("stiffness", body, ratio))),
            _ => {}
        }
        let free = body == 1 && hold == Hold::Unconstrained;
        if kind != Kind::Cap && !free {
            let turns = whole && body > 0 && hold == Hold::Pinned;
            holds.fix.push(on(body, if turns { "pin" } else { "left" }, "x = 0"));
        }
        if space {
            holds.fix.push(on(body, "front", "z = 0"));
        }
        if body + 1 == bodies {
            holds.load.push(on(body, "top", &format!("pressure = {:e}", sign * builder.load)));
        }
        builder.body(body, &holds);
    }
    let level = builder.level;
    for body in 0..bodies - 1 {
        let names = [format!("b{}_top", body + 1), format!("b{}_bottom", body + 2)];
        builder.contact(names, [body, body + 1], (1.0, level), None, if space { 0.01 } else { 0.0 });
    }
    let expect = expect(&builder, hold, springs, weight);
    Made { builder, expect, hanging: true }
}

fn ball(mut random: Random, scripts: &Path) -> Made {
    let radius = random.pick(&[1.5, 2.0, 10.0, 100.0]);
    let n = [random.pick(&[2, 3, 4]), random.pick(&[2, 3, 4])];
    let hold = if random.chance(0.1) { Hold::Pulled } else { Hold::Roller };
    let mut builder = SceneBuilder::new(random, &format!("Ball {hold:?}"), 3, 2);
    builder.mesh(&scripts.join("ball.geo"), &format!("R = {radius}, {}", numbered(&n)));
    let (springs, ratio) = springs(&mut builder, hold);
    let sign = if hold == Hold::Pulled { -1.0 } else { 1.0 };
    let sides = |body: usize| vec![on(body, "left", "x = 0"), on(body, "front", "y = 0")];
    let mut lower = Holds { fix: sides(0), ..Holds::default() };
    match springs {
        Springs::Below => lower.spring.push(on(0, "bottom", &builder.spring("normal", 0, ratio))),
        _ => lower.fix.push(on(0, "bottom", "z = 0")),
    }
    let mut upper = Holds { fix: sides(1), ..Holds::default() };
    if springs == Springs::All {
        upper.spring.push(on(1, "left", &builder.spring("stiffness", 1, ratio)));
    }
    upper.load.push(on(1, "top", &format!("pressure = {:e}", sign * builder.load)));
    builder.body(0, &lower);
    builder.body(1, &upper);
    let level = builder.level;
    builder.contact(["b1_top".into(), "b2_bottom".into()], [0, 1], (1.0, level), None, 0.0);
    let expect = expect(&builder, hold, springs, 0.0);
    Made { builder, expect, hanging: true }
}

fn small(mut random: Random, scripts: &Path) -> Made {
    let size = random.pick(&[1e-4, 1e-4, 1e-2]);
    let three = random.chance(0.5);
    let n = random.pick(&[1, 2, 4, 7]);
    let hold = match random.pick(&HOLDS) {
        Hold::Unconstrained | Hold::Sliding => Hold::Pinned,
        hold => hold,
    };
    let bodies = if three { 3 } else { 2 };
    let mut builder = SceneBuilder::new(random, &format!("Small {hold:?}"), 2, bodies);
    builder.mesh(&scripts.join("small.geo"), &format!("size = {size:e}, three = {}, n = {n}", usize::from(three)));
    let (springs, ratio) = springs(&mut builder, hold);
    // the pressure on the small body is that of the layers
    let load = if hold == Hold::Pulled { -builder.load } else { builder.load } * if three { size } else { 1.0 };
    for body in 0..bodies {
        let mut holds = Holds::default();
        match (body, springs) {
            (0, Springs::Below) => holds.spring.push(on(body, "bottom", &builder.spring("normal", body, ratio))),
            (0, _) => holds.fix.push(on(body, "bottom", "y = 0")),
            (_, Springs::All) => holds.spring.push(on(body, "right", &builder.spring("stiffness", body, ratio))),
            _ => {}
        }
        let turns = body == 1 && hold == Hold::Pinned;
        holds.fix.push(on(body, if turns { "pin" } else { "left" }, "x = 0"));
        if body + 1 == bodies {
            holds.load.push(on(body, "top", &format!("pressure = {load:e}")));
        }
        builder.body(body, &holds);
    }
    let (level, s) = (builder.level, format!("(x/{size:e})"));
    for body in 0..bodies - 1 {
        let names = [format!("b{}_top", body + 1), format!("b{}_bottom", body + 2)];
        builder.contact(names, [body, body + 1], (size, level), Some(&s), 0.0);
    }
    let expect = expect(&builder, hold, springs, 0.0);
    Made { builder, expect, hanging: true }
}

fn bricks(mut random: Random, scripts: &Path) -> Made {
    let (courses, bricks) = (random.pick(&[2, 3, 4, 5]), random.pick(&[1, 2, 3]));
    let n = [random.pick(&[1, 2, 4]), random.pick(&[1, 2, 3])];
    // how courses are held sideways: pressed from the right, between supports, or not at all
    let sides = random.pick(&["pressed", "pressed", "between", "free"]);
    let ends: Vec<Vec<[f64; 2]>> = (0..courses).map(|course| course_of(bricks, course % 2 == 1)).collect();
    let count = ends.iter().map(Vec::len).sum();
    let mut builder = SceneBuilder::new(random, &format!("Bricks {sides}"), 2, count);
    builder.mesh(&scripts.join("bricks.geo"), &format!("courses = {courses}, bricks = {bricks}, {}", numbered(&n)));
    let weight = weight(&mut builder);
    let side = builder.load * builder.random.power_of_ten(-2.0, 0.0);
    let mut first = 0;
    let firsts: Vec<usize> = ends.iter().map(|course| (first, first += course.len()).0).collect();
    for (course, bricks) in ends.iter().enumerate() {
        for place in 0..bricks.len() {
            let body = firsts[course] + place;
            let mut holds = Holds { weight, ..Holds::default() };
            if course == 0 {
                holds.fix.push(on(body, "bottom", "y = 0"));
            }
            if place == 0 {
                holds.fix.push(on(body, "left", "x = 0"));
            }
            if place + 1 == bricks.len() && place > 0 {
                match sides {
                    "pressed" => holds.load.push(on(body, "right", &format!("pressure = {side:e}"))),
                    "between" => holds.fix.push(on(body, "right", "x = 0")),
                    _ => {}
                }
            }
            if course + 1 == courses {
                holds.load.push(on(body, "top", &format!("pressure = {:e}", builder.load)));
            }
            builder.body(body, &holds);
        }
    }
    let level = builder.level;
    for (course, bricks) in ends.iter().enumerate() {
        for (place, [from, to]) in bricks.iter().enumerate() {
            let body = firsts[course] + place;
            if place + 1 < bricks.len() {
                let names = [format!("b{}_right", body + 1), format!("b{}_left", body + 2)];
                builder.contact(names, [body, body + 1], (1.0, level), Some(&format!("(2*y - {course})")), 0.0);
            }
            let above = ends.get(course + 1).into_iter().flatten().enumerate();
            for (over, _) in above.filter(|(_, [start, end])| start < to && end > from) {
                let over = firsts[course + 1] + over;
                let names = [format!("b{}_top", body + 1), format!("b{}_bottom", over + 1)];
                builder.contact(names, [body, over], (0.5, level), Some(&format!("(x - {from})")), 0.0);
            }
        }
    }
    let idle = builder.load == 0.0 || sides == "free";
    // head joints that nothing presses may open, and with them bricks slide
    let expect = if idle || sides == "between" { Expect::Gauge } else { Expect::Solution };
    Made { builder, expect, hanging: true }
}

/// Where the bricks of a course begin and end.
fn course_of(bricks: usize, odd: bool) -> Vec<[f64; 2]> {
    let whole = |i: usize| [i as f64, i as f64 + 1.0];
    if !odd {
        return (0..bricks).map(whole).collect();
    }
    let end = bricks as f64;
    let middle = (1..bricks).map(|i| [i as f64 - 0.5, i as f64 + 0.5]);
    [[0.0, 0.5]].into_iter().chain(middle).chain([[end - 0.5, end]]).collect()
}
