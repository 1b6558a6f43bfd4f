//! Random scenes of slender bodies: leaves, plates, frames and hoops, from 1:5 to 1:200.

use super::builder::{Holds, SceneBuilder, on};
use super::random::Random;
use super::scenes::{Case, Expect};
use std::path::Path;

/// What a scene is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Leaves on each other, in the plane.
    Leaves,
    /// The same as discs of revolution.
    Discs,
    /// The same in space.
    Plates,
    /// Portal frames on a leaf and on each other.
    Frames,
    /// A hoop between plates, with or without another one in it.
    Hoops,
}

const KINDS: [Kind; 9] = [
    Kind::Leaves,
    Kind::Leaves,
    Kind::Leaves,
    Kind::Discs,
    Kind::Plates,
    Kind::Plates,
    Kind::Frames,
    Kind::Frames,
    Kind::Hoops,
];

/// How bodies above the lowest are held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Hold {
    /// At one end.
    Clamped,
    /// By contact alone; supports keep them from moving sideways.
    Carried,
}

/// A scene in the making.
struct Slender {
    builder: SceneBuilder,
    hold: Hold,
    /// The lowest body is held at both ends.
    is_bridge: bool,
    /// Thicknesses; lengths are about one.
    thickness: Vec<f64>,
}

/// Scene `index` of the series `seed`; `root` is the folder of the program.
pub fn scene(seed: u64, index: usize, root: &Path) -> Case {
    let mut random = Random::new(seed, index);
    let scripts = root.join("tests/stress/meshes");
    let kind = random.pick(&KINDS);
    let Slender { mut builder, hold, .. } = match kind {
        Kind::Leaves | Kind::Discs | Kind::Plates => leaves(random, kind, &scripts),
        Kind::Frames => frames(random, &scripts),
        Kind::Hoops => hoops(random, &scripts),
    };
    let expect = if hold == Hold::Carried && builder.load == 0.0 { Expect::Gauge } else { Expect::Solution };
    Case {
        index,
        text: builder.text,
        line: builder.line,
        expect,
        hanging: hold == Hold::Carried,
        pressure: builder.pressure,
        carried: None,
        gamma: builder.random.power_of_ten(-2.0, 0.08),
        start: None,
        steps: None,
    }
}

/// Draws materials, thicknesses and the load, under which a leaf that is clamped at one end bends by 1e-4 to ten times its thickness.
fn begin(mut random: Random, kind: Kind, bodies: usize, hold: Hold) -> Slender {
    let any = random.power_of_ten(0.7, 2.3);
    let aspect = random.pick(&[5.0, 20.0, 50.0, 200.0, any, any]);
    let thickness: Vec<f64> = (0..bodies).map(|_| random.uniform(1.0, 2.0) / aspect).collect();
    let thickness = if random.chance(0.5) { vec![1.0 / aspect; bodies] } else { thickness };
    let is_bridge = random.chance(0.4);
    let dimension = if kind == Kind::Plates { 3 } else { 2 };
    let mut builder =
        SceneBuilder::new(random, &format!("{kind:?} {hold:?} bridge {is_bridge} 1:{aspect:.0}"), dimension, bodies);
    if kind == Kind::Discs {
        builder.text += "plane = \"axisymmetric\"\n";
    } else if dimension == 2 && builder.random.chance(0.4) {
        builder.text += "plane = \"stress\"\n";
    }
    // of a cantilever w = 3/2 q L^4/(E t^3)
    let bends = builder.random.power_of_ten(-4.0, 1.0);
    builder.press(bends / 1.5 * aspect.powi(-4));
    Slender { builder, hold, is_bridge, thickness }
}

fn any_hold(random: &mut Random) -> Hold {
    random.pick(&[Hold::Clamped, Hold::Clamped, Hold::Carried])
}

impl Slender {
    /// A contact along s from 0 to 1: the layer and the gap are of the size of what the bodies give way through their thickness, or bend, or between.
    fn contact(&mut self, surfaces: [String; 2], bodies: [usize; 2], along: Option<&str>) {
        let thickness = self.thickness[bodies[0]].min(self.thickness[bodies[1]]);
        let between = self.builder.random.pick(&[0.0, 0.5, 1.0]);
        let size = thickness * thickness.powf(-4.0 * between);
        let level = self.builder.level * self.builder.random.power_of_ten(0.0, 2.0);
        self.builder.contact(surfaces, bodies, (size, level), along, 0.0);
    }

    /// Leaves or discs with their supports and loads. The last one is pressed along its length, or at its tip by a force or a displacement.
    fn leaves(&mut self, kind: Kind, count: usize) {
        let Self { builder, hold, is_bridge, thickness } = self;
        let space = kind == Kind::Plates;
        let drive = builder.random.pick(&["top", "top", "tip", "moved"]);
        let moved = builder.random.power_of_ten(-3.0, 0.5) * thickness[count - 1];
        // discs are clamped at their rim: the other end is the axis
        let (end, other) = if kind == Kind::Discs { ("right", "left") } else { ("left", "right") };
        let clamp = if space { "x = 0, y = 0, z = 0" } else { "x = 0, y = 0" };
        for body in 0..count {
            let mut holds = Holds::default();
            if body == 0 || *hold == Hold::Clamped {
                holds.fix.push(on(body, end, clamp));
                if body == 0 && *is_bridge && kind != Kind::Discs {
                    holds.fix.push(on(body, other, "y = 0"));
                }
            } else {
                if kind != Kind::Discs {
                    holds.fix.push(on(body, "pin", "x = 0"));
                }
                if space {
                    holds.fix.push(on(body, "pin", "z = 0"));
                    holds.fix.push(on(body, "spin", "z = 0"));
                }
            }
            if body + 1 == count {
                match (drive, *hold) {
                    ("tip", Hold::Clamped) if kind != Kind::Discs => {
                        let zero = if space { ", 0" } else { "" };
                        holds.load.push(on(body, "right", &format!("force = [0, {:e}{zero}]", -0.4 * builder.load)));
                    }
                    ("moved", Hold::Clamped) if kind != Kind::Discs && builder.load > 0.0 => {
                        holds.fix.push(on(body, "right", &format!("y = {:e}", -moved)));
                        builder.line += &format!(" moved {moved:.1e}");
                    }
                    _ => holds.load.push(on(body, "top", &format!("pressure = {:e}", builder.load))),
                }
            }
            builder.body(body, &holds);
        }
    }
}

fn leaves(mut random: Random, kind: Kind, scripts: &Path) -> Slender {
    let space = kind == Kind::Plates;
    let count = random.pick(if space { &[2, 2, 3] } else { &[2, 2, 3, 4] });
    let hold = any_hold(&mut random);
    // what is carried rests on what is longer
    let mut lengths: Vec<f64> = (0..count).map(|_| random.uniform(0.4, 1.0)).collect();
    if hold == Hold::Carried || random.chance(0.3) {
        lengths.sort_by(|a, b| b.total_cmp(a));
    }
    lengths = if random.chance(0.2) { vec![1.0; count] } else { lengths };
    let finest = if space { 12.99 } else { 60.99 };
    let n: Vec<usize> = (0..count).map(|_| random.uniform(3.0, finest) as usize).collect();
    let through = if space { 1 } else { random.pick(&[1, 2]) };
    let mut scene = begin(random, kind, count, hold);
    let mut set = format!("count = {count}, through = {through}");
    for i in 0..count {
        set += &format!(", l{0} = {1:.4}, t{0} = {2:e}, n{0} = {3}", i + 1, lengths[i], scene.thickness[i], n[i]);
    }
    if space {
        let across = scene.builder.random.pick(&[1, 2, 4]);
        set += &format!(", depth = {}, across = {across}", scene.builder.random.pick(&[0.1, 0.4, 1.0]));
    }
    scene.builder.mesh(&scripts.join("leaves.geo"), &set);
    scene.leaves(kind, count);
    for body in 0..count - 1 {
        let names = [format!("b{}_top", body + 1), format!("b{}_bottom", body + 2)];
        let s = format!("(x/{:.4})", lengths[body].min(lengths[body + 1]));
        scene.contact(names, [body, body + 1], Some(&s));
    }
    scene
}

fn frames(mut random: Random, scripts: &Path) -> Slender {
    let (two, leaf) = (random.chance(0.4), random.chance(0.6));
    let count = 2 + usize::from(two) + usize::from(leaf);
    let wide: f64 = random.uniform(0.4, 0.9);
    let tall: f64 = random.pick(&[0.3, 0.6, 1.0]);
    let n: Vec<usize> = (0..3).map(|_| random.uniform(3.0, 40.99) as usize).collect();
    let through = random.pick(&[1, 2]);
    let mut scene = begin(random, Kind::Frames, count, Hold::Carried);
    // frames have one thickness
    for body in 2..2 + usize::from(two) {
        scene.thickness[body] = scene.thickness[1];
    }
    // a leg has room beside the other one, and below the bar
    let most = 0.3 * tall.min(wide);
    scene.thickness[1..=1 + usize::from(two)].iter_mut().for_each(|t| *t = t.min(most));
    let t = [scene.thickness[0], scene.thickness[1], scene.thickness[count - 1]];
    let mut set = format!("two = {}, leaf = {}, tall = {tall}, wide = {wide:.3}", usize::from(two), usize::from(leaf));
    for i in 0..3 {
        set += &format!(", t{0} = {1:e}, n{0} = {2}", i + 1, t[i], n[i]);
    }
    set += &format!(", through = {through}");
    scene.builder.mesh(&scripts.join("frames.geo"), &set);
    let builder = &mut scene.builder;
    for body in 0..count {
        let mut holds = Holds::default();
        if body == 0 {
            holds.fix.push(on(body, "left", "x = 0, y = 0"));
            if scene.is_bridge {
                holds.fix.push(on(body, "right", "y = 0"));
            }
        } else {
            holds.fix.push(on(body, "pin", "x = 0"));
        }
        if body + 1 == count {
            holds.load.push(on(body, "top", &format!("pressure = {:e}", builder.load)));
        }
        builder.body(body, &holds);
    }
    for body in 0..count - 1 {
        let names = [format!("b{}_top", body + 1), format!("b{}_bottom", body + 2)];
        // feet stand at two places
        let s = if body == 0 { None } else { Some("x") };
        scene.contact(names, [body, body + 1], s);
    }
    scene
}

fn hoops(mut random: Random, scripts: &Path) -> Slender {
    let inner = random.chance(0.5);
    let count = 3 + usize::from(inner);
    let n: Vec<usize> = (0..3).map(|_| random.uniform(6.0, 60.99) as usize).collect();
    let through = random.pick(&[1, 2]);
    let mut scene = begin(random, Kind::Hoops, count, Hold::Carried);
    scene.thickness[count - 1] = scene.thickness[0];
    let t = [scene.thickness[0], scene.thickness[1], scene.thickness[2]];
    let mut set = format!("inner = {}, through = {through}", usize::from(inner));
    for i in 0..3 {
        set += &format!(", t{0} = {1:e}, n{0} = {2}", i + 1, t[i], n[i]);
    }
    scene.builder.mesh(&scripts.join("hoops.geo"), &set);
    let builder = &mut scene.builder;
    for body in 0..count {
        let mut holds = Holds::default();
        if body == 0 {
            let how = if scene.is_bridge { on(body, "right", "y = 0") } else { on(body, "bottom", "y = 0") };
            holds.fix.push(how);
        }
        holds.fix.push(on(body, "left", "x = 0"));
        if body + 1 == count {
            holds.load.push(on(body, "top", &format!("pressure = {:e}", builder.load)));
        }
        builder.body(body, &holds);
    }
    scene.contact(["b1_top".into(), "b2_bottom".into()], [0, 1], None);
    scene.contact(["b2_top".into(), format!("b{count}_bottom")], [1, count - 1], None);
    if inner {
        scene.contact(["b2_inside".into(), "b3_outside".into()], [1, 2], None);
    }
    scene
}
