//! Random scenes whose layer saturates: a block on rollers under another, with a table law of two to four pieces whose last slope nearly vanishes,
//! and a load of 0.1 to 0.95 of what the layer can bear. All are convex, and have a solution.

use super::random::Random;
use super::scenes::{Case, Expect};
use std::path::Path;

/// Largest pressure of the layer before its last, nearly flat piece.
const PLATEAU: f64 = 5.0;

/// Return scene `index` of a series. The blocks are four wide.
pub fn scene(seed: u64, index: usize, root: &Path) -> Case {
    let mut random = Random::new(seed, index);
    let layer = table(&mut random);
    let [mesh, pressure] = [random.pick(&[4.0, 6.0, 8.0, 12.0]), PLATEAU * random.uniform(0.1, 0.95)];
    let gap = format!("{:e}*sin({:e}*x)", random.power_of_ten(-5.0, -3.0), random.uniform(2.0, 15.0));
    let rise = if random.chance(0.5) { random.power_of_ten(-5.0, -3.0) } else { 0.0 };
    let mut body = |name: &str, more: &str| {
        let (young, poisson) = (random.power_of_ten(3.0, 5.0), random.pick(&[-0.3, 0.0, 0.3, 0.45]));
        let order = random.pick(&[1, 2]);
        format!("[[body]]\nname = \"{name}\"\nyoung = {young:e}\npoisson = {poisson}\norder = {order}\n{more}\n")
    };
    let lower = body("lower", "fix = [{ on = \"lower_axis\", x = 0 }, { on = \"lower_face\", y = 0 }]");
    let load = format!("load = [{{ on = \"upper_face\", pressure = {pressure:e} }}]");
    let upper = body("upper", &format!("fix = [{{ on = \"upper_axis\", x = 0 }}]\n{load}"));
    let script = root.join("meshes/groove/groove.geo");
    let text = format!(
        "dimension = 2\nmesh = {{ geo = \"{}\", set = {{ n = {mesh} }} }}\n{lower}{upper}[[contact]]\n\
         between = [\"lower_top\", \"upper_bottom\"]\ngap = \"{gap} + {rise:e}*x^2\"\nlayer = {{ table = [{layer}] }}\n",
        script.display()
    );
    Case {
        index,
        line: format!("saturating {index}: n {mesh} q {pressure} gap {gap} + {rise:e}*x^2 table [{layer}]"),
        text,
        expect: Expect::Solution,
        hanging: true,
        pressure,
        carried: Some(4.0 * pressure),
        gamma: 0.5,
        start: None,
    }
}

/// Return the points (c, p) of a law as text.
fn table(random: &mut Random) -> String {
    let mut points = Vec::new();
    if random.chance(0.5) {
        // a toe without stiffness
        points.push([random.power_of_ten(-5.0, -4.0), 1e-6]);
    }
    let pieces = random.pick(&[1, 2, 3]);
    for piece in 1..=pieces {
        let [c, p] = points.last().copied().unwrap_or_default();
        let pressure = PLATEAU * f64::from(piece) / f64::from(pieces);
        points.push([c + (pressure - p) / random.power_of_ten(2.0, 9.0), pressure]);
    }
    let [c, p] = points.last().copied().unwrap_or_default();
    points.push([c + 1.0, p + random.power_of_ten(-9.0, -2.0)]);
    points.iter().map(|[c, p]| format!("[{c:e}, {p:e}]")).collect::<Vec<_>>().join(", ")
}
