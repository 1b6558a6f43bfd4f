//! Random scenes whose layer saturates: a block on another, with a table law of two to four pieces whose last slope nearly vanishes, and a load of 0.1 to
//! 0.95 of what the layer can bear. Contact alone holds the upper block along the load; in every second scene it has a wavy gap, and a load that is not
//! even, or an obstacle presses it. All are convex, and have a solution.

use super::random::Random;
use super::scenes::{Case, Expect};
use std::path::Path;

/// Largest pressure of the layer before its last, nearly flat piece.
const PLATEAU: f64 = 5.0;

/// Return scene `index` of a series.
pub fn scene(seed: u64, index: usize, root: &Path) -> Case {
    let mut random = Random::new(seed, index);
    if index % 2 == 1 { pressed(index, &mut random, root) } else { groove(index, random, root) }
}

/// Return a scene with two blocks of width one and meshes that do not match, in the plane or of revolution.
fn pressed(index: usize, random: &mut Random, root: &Path) -> Case {
    let plane = random.pick(&["strain", "stress", "axisymmetric"]);
    let steep = format!(
        "[{:e}, {PLATEAU}], [10, {:e}]",
        random.power_of_ten(-8.0, -3.0),
        PLATEAU + random.power_of_ten(-5.0, -1.0)
    );
    let layer = format!("table = [{}]", if random.chance(0.5) { steep } else { table(random) });
    let [n1, n2] = [random.pick(&[3, 6, 12]), random.pick(&[3, 6, 12])];
    let mean = PLATEAU * random.uniform(0.1, 0.95);
    let gap = format!("{:e}*sin({:e}*x)", random.power_of_ten(-4.5, -2.0), random.uniform(2.0, 18.0));
    let (taper, is_round) = (random.uniform(-0.03, 0.03), plane == "axisymmetric");
    let has_obstacle = !is_round && random.chance(0.4);
    let mut body = |name: &str, more: &str| {
        let (young, order) = (random.power_of_ten(2.5, 5.0), random.pick(&[1, 2]));
        format!("[[body]]\nname = \"{name}\"\nyoung = {young:e}\npoisson = 0.3\norder = {order}\n{more}\n")
    };
    let lower = body("b1", "fix = [{ on = \"b1_bottom\", y = 0 }, { on = \"b1_left\", x = 0 }]");
    let side = if is_round { "" } else { "fix = [{ on = \"b2_left\", x = 0 }]" };
    let load = format!("load = [{{ on = \"b2_top\", pressure = \"{mean:e}*(1 + {taper:e}*x)\" }}]");
    let upper = body("b2", &format!("{side}\n{}", if has_obstacle { "" } else { &load }));
    let press = if has_obstacle {
        let law = match random.pick(&[0, 1, 2]) {
            0 => format!("exponential = {{ p0 = {PLATEAU}, c0 = {:e} }}", random.power_of_ten(-6.0, -3.0)),
            1 => format!("linear = {{ stiffness = {:e} }}", random.power_of_ten(2.0, 7.0)),
            _ => format!("table = [{}]", table(random)),
        };
        let (rise, moment) = (random.power_of_ten(-4.0, -2.0), taper * mean);
        format!(
            "[[contact]]\non = \"b2_top\"\nobstacle = true\ngap = \"{rise:e}*(x - 0.5)^2\"\nforce = {mean:e}\nmoment = {moment:e}\n\
             layer = {{ {law} }}\n"
        )
    } else {
        String::new()
    };
    let carried = match (is_round, has_obstacle) {
        (true, _) => 2.0 * std::f64::consts::PI * mean * (0.5 + taper / 3.0),
        (_, true) => mean,
        _ => mean * (1.0 + 0.5 * taper),
    };
    let script = root.join("meshes/stack/stack.geo");
    let text = format!(
        "dimension = 2\nplane = \"{plane}\"\nmesh = {{ geo = \"{}\", set = {{ rows = 2, columns = 1, n1 = {n1}, n2 = {n2} }} }}\n{lower}{upper}\
         [[contact]]\nbetween = [\"b1_top\", \"b2_bottom\"]\ngap = \"{gap}\"\nlayer = {{ {layer} }}\n{press}",
        script.display()
    );
    Case {
        index,
        line: format!("saturating {index}: {plane} n {n1} {n2} q {mean} gap {gap} {layer} {press}").replace('\n', " "),
        text,
        expect: Expect::Solution,
        hanging: true,
        pressure: mean,
        carried: Some(carried),
        gamma: 0.5,
        start: None,
        steps: None,
    }
}

/// Return a scene with a block on rollers under another; both are four wide.
fn groove(index: usize, mut random: Random, root: &Path) -> Case {
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
        steps: None,
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
