//! What all random scenes of the wider box share: materials, loads, layers and gaps, and the text of the scene file.

use super::laws;
use super::random::Random;
use std::fmt::Write;

/// Materials of the bodies and orders of their elements.
pub struct Bodies {
    /// Young's moduli.
    pub young: Vec<f64>,
    /// Poisson's ratios.
    pub poisson: Vec<f64>,
    /// Orders of the elements.
    pub order: Vec<usize>,
}

/// A scene in the making.
pub struct SceneBuilder {
    /// The stream of its numbers.
    pub random: Random,
    /// Text of the scene file so far.
    pub text: String,
    /// The scene in a line.
    pub line: String,
    bodies: Bodies,
    /// Number of coordinates.
    pub dimension: usize,
    /// Pressure of the loads, zero for none.
    pub load: f64,
    /// The same, never zero.
    pub level: f64,
    /// Pressure that would matter.
    pub pressure: f64,
}

/// Supports, loads and springs of a body as lists of the scene file.
#[derive(Default)]
pub struct Holds {
    /// Supports.
    pub fix: Vec<String>,
    /// Loads.
    pub load: Vec<String>,
    /// Springs.
    pub spring: Vec<String>,
    /// Body force along the axis that is up, downwards.
    pub weight: f64,
}

/// A support, load or spring on a group of a body, numbered from 0.
pub fn on(body: usize, place: &str, what: &str) -> String {
    format!("{{ on = \"b{}_{place}\", {what} }}", body + 1)
}

impl Bodies {
    /// Draws the bodies.
    pub fn draw(random: &mut Random, count: usize) -> Self {
        let unit = random.power_of_ten(0.0, 11.0);
        let equal = random.chance(0.35);
        let young = (0..count).map(|_| if equal { unit } else { unit * random.power_of_ten(-3.0, 3.0) }).collect();
        let ratio = |random: &mut Random| match random.pick(&[0, 1, 1, 2, 3]) {
            0 => 0.0,
            1 => 0.3,
            2 => random.uniform(0.0, 0.49),
            _ => 0.4999,
        };
        let poisson = (0..count).map(|_| ratio(random)).collect();
        let order = match random.pick(&[0, 0, 1, 2]) {
            0 => vec![1; count],
            1 => vec![2; count],
            _ => (0..count).map(|_| random.pick(&[1, 2])).collect(),
        };
        Self { young, poisson, order }
    }

    /// The smallest of Young's moduli.
    pub fn softest(&self) -> f64 {
        self.young.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Young's moduli of two bodies, the smaller one first.
    pub fn soft_and_stiff(&self, bodies: [usize; 2]) -> [f64; 2] {
        let [a, b] = bodies.map(|body| self.young[body]);
        [a.min(b), a.max(b)]
    }

    /// Young's moduli in words.
    pub fn moduli(&self) -> String {
        self.young.iter().map(|v| format!("{v:.1e}")).collect::<Vec<_>>().join(" ")
    }

    /// Writes a body, numbered from 0.
    pub fn write(&self, text: &mut String, body: usize, holds: &Holds, dimension: usize) {
        let (young, poisson, order) = (self.young[body], self.poisson[body], self.order[body]);
        let _ = writeln!(text, "\n[[body]]\nname = \"b{}\"\nyoung = {young:e}\npoisson = {poisson}", body + 1);
        let _ = writeln!(text, "order = {order}\nfix = [{}]", holds.fix.join(", "));
        for (key, list) in [("load", &holds.load), ("spring", &holds.spring)] {
            if !list.is_empty() {
                let _ = writeln!(text, "{key} = [{}]", list.join(", "));
            }
        }
        if holds.weight != 0.0 {
            let zero = if dimension == 3 { ", 0" } else { "" };
            let _ = writeln!(text, "force = [0, {:e}{zero}]", -holds.weight);
        }
    }
}

impl SceneBuilder {
    /// Draws bodies and loads.
    pub fn new(mut random: Random, name: &str, dimension: usize, bodies: usize) -> Self {
        let bodies = Bodies::draw(&mut random, bodies);
        let level = bodies.softest() * random.power_of_ten(-8.0, -3.0);
        let load = if random.chance(0.06) { 0.0 } else { level };
        let Bodies { poisson, order, .. } = &bodies;
        let line = format!("{name} P{order:?} E {} nu {poisson:.4?} q {load:.1e}", bodies.moduli());
        let text = format!("dimension = {dimension}\n");
        Self { random, text, line, bodies, dimension, load, level, pressure: level }
    }

    /// Sets the pressure of the loads, if there are any, to this share of the softest modulus.
    pub fn press(&mut self, share: f64) {
        self.level = share * self.bodies.softest();
        self.load = if self.load == 0.0 { 0.0 } else { self.level };
        self.pressure = self.level;
        let _ = write!(self.line, " pressed {:.1e}", self.load);
    }

    /// A spring of a body, numbered from 0, with this ratio of stiffness to its modulus.
    pub fn spring(&self, key: &str, body: usize, ratio: f64) -> String {
        format!("{key} = {:e}", ratio * self.bodies.young[body])
    }

    /// The mesh, a script with numbers set in it.
    pub fn mesh(&mut self, script: &std::path::Path, set: &str) {
        let _ = writeln!(self.text, "mesh = {{ geo = \"{}\", set = {{ {set} }} }}", script.display());
        let _ = write!(self.line, " [{}]", set.replace(" = ", " "));
    }

    /// A contact of two bodies, numbered from 0, of size `size` behind it, where the load makes the pressure `level`. `along` is
    /// a place on it from 0 to 1, if gaps may differ along it; meshes are `apart`.
    pub fn contact(
        &mut self,
        surfaces: [String; 2],
        bodies: [usize; 2],
        (size, level): (f64, f64),
        along: Option<&str>,
        apart: f64,
    ) {
        let [soft, stiff] = self.bodies.soft_and_stiff(bodies);
        let random = &mut self.random;
        let kappa = random.power_of_ten(-6.0 + (stiff / soft).log10(), 6.0) * soft / size;
        let _ = write!(self.line, " | kappa {:.1e}", kappa * size / soft);
        let law = laws::any(random, level, kappa, &mut self.line);
        let closes = level * size / soft + law.closing;
        let depth = closes * random.power_of_ten(-2.0, 1.5);
        let gap = match (random.pick(&[0, 0, 1, 2, 3, 4, 5, 6]), along) {
            (1, Some(s)) => format!("{depth:e} * max(0, 1 - (({s} - 1)/0.3)^2)^1.5"),
            (2, Some(s)) => format!("{depth:e} * (1 - cos(2*pi*{}*{s}))", random.pick(&[0.5, 1.0, 2.0])),
            (3, Some(s)) => format!("{depth:e} * {s}"),
            (4, _) => format!("{depth:e}"),
            (5, _) => format!("{:e}", 1e3 * closes),
            (6, _) => {
                let overlap = closes * random.power_of_ten(-2.0, 0.3);
                self.pressure = f64::max(self.pressure, soft * overlap / size);
                format!("{:e}", -overlap)
            }
            _ => String::new(),
        };
        let gap = if apart == 0.0 { gap } else { format!("{}-{apart}", if gap.is_empty() { "0" } else { &gap }) };
        let _ = writeln!(self.text, "\n[[contact]]\nbetween = [\"{}\", \"{}\"]", surfaces[0], surfaces[1]);
        if !gap.is_empty() {
            let _ = writeln!(self.text, "gap = \"{gap}\"");
            let _ = write!(self.line, " gap {gap}");
        }
        let _ = writeln!(self.text, "layer = {{ {} }}", law.text);
    }

    /// A body, numbered from 0.
    pub fn body(&mut self, body: usize, holds: &Holds) {
        self.bodies.write(&mut self.text, body, holds, self.dimension);
    }
}
