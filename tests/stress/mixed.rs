//! Random scenes with obstacles, bonds and forces mixed in: those of [`scenes`] with further keys and contacts.

#![allow(dead_code)] // the example and the test each use their own part

use super::random::Random;
use super::scenes::{self, Case, Expect};
use std::fmt::Write;
use std::path::Path;

/// Scene `index` of the series `seed`; `root` is the folder of the program.
pub fn scene(seed: u64, index: usize, root: &Path) -> Case {
    let mut case = scenes::scene(seed, index, root);
    let mut random = Random::new(seed + 7919, index);
    case.text = with_bonds(&case.text, case.hanging, &mut random, &mut case.line);
    with_obstacle(&mut case, &mut random);
    // a bond may hold what was free, and an obstacle may carry what contacts carried
    (case.expect, case.carried) = (Expect::Gauge, None);
    case
}

/// Give contacts bonds and other laws in tension, and forces where supports hold all bodies: a body that contact alone holds would follow the offset.
fn with_bonds(text: &str, hanging: bool, random: &mut Random, line: &mut String) -> String {
    let mut parts = text.split("\n[[contact]]\n");
    let mut new = parts.next().unwrap_or_default().to_owned();
    for contact in parts {
        new.push_str("\n[[contact]]\n");
        // surfaces that never touch are no bond
        let gap =
            contact.lines().find_map(|line| line.strip_prefix("gap = \"")?.strip_suffix('"')?.parse::<f64>().ok());
        if random.chance(0.4) && gap.is_none_or(|gap| gap < 0.0) {
            new.push_str("bond = true\n");
            line.push_str(" bond");
            if random.chance(0.4) {
                // the law of compression in other units
                let law = contact.lines().find_map(|line| line.strip_prefix("layer = ")).unwrap_or_default();
                let _ = writeln!(new, "tension = {law}");
            }
        }
        if !hanging && random.chance(0.4) {
            let force = random.power_of_ten(-2.0, 1.0) * level(text);
            let _ = writeln!(new, "force = {force:e}");
            let _ = write!(line, " force {force:.1e}");
        }
        new.push_str(contact);
    }
    new
}

/// Put an obstacle before the lowest block, in place of its support or beside it.
fn with_obstacle(case: &mut Case, random: &mut Random) {
    if !random.chance(0.6) {
        return;
    }
    let level = level(&case.text);
    let depth = random.power_of_ten(-7.0, -3.0);
    let stiffness = level / depth;
    let gap = random.pick(&["0", "x^2", "abs(x - 0.3)", "1 - cos(2*x)"]);
    let moves = match random.pick(&[0, 1, 2, 3, 4]) {
        0 => String::new(),
        1 => format!("approach = {:e}\ntilt = {:e}", depth, 0.1 * depth),
        2 => format!("force = {:e}", level),
        3 => format!("force = {level:e}\nmoment = {:e}", 0.05 * level),
        _ => format!("force = {level:e}\nmoment = 0"),
    };
    if !moves.contains("force") && random.chance(0.7) {
        case.text = case.text.replacen("{ on = \"b1_bottom\", y = 0 }, ", "", 1);
    }
    let bond = if random.chance(0.3) { "bond = true\n" } else { "" };
    let _ = write!(case.line, " | obstacle {gap} {} {}", moves.replace('\n', " "), bond.trim_end());
    let _ = writeln!(
        case.text,
        "\n[[contact]]\non = \"b1_bottom\"\nobstacle = true\ngap = \"{depth:e} * ({gap})\"\n{bond}{moves}\nlayer = {{ linear = {{ stiffness = {stiffness:e} }} }}"
    );
}

/// Return a pressure of the size of the loads of a scene, from its first modulus.
fn level(text: &str) -> f64 {
    let young = text.lines().find_map(|line| line.strip_prefix("young = ")).and_then(|young| young.parse::<f64>().ok());
    1e-5 * young.unwrap_or(1.0)
}
