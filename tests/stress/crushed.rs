//! Random scenes whose layers remember, under loads that grow, fall and grow again, and with bonds that carry shear: those of [`mixed`](super::mixed) with
//! further keys.

#![allow(dead_code)] // the example and the test each use their own part

use super::mixed;
use super::random::Random;
use super::scenes::Case;
use std::fmt::Write;
use std::path::Path;

/// Scene `index` of the series `seed`; `root` is the folder of the program.
pub fn scene(seed: u64, index: usize, root: &Path) -> Case {
    let mut case = mixed::scene(seed, index, root);
    let mut random = Random::new(seed + 104_729, index);
    let mut parts = case.text.split("\n[[contact]]\n");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for contact in parts {
        text.push_str("\n[[contact]]\n");
        if random.chance(0.6) {
            let law = contact.lines().find_map(|line| line.strip_prefix("layer = ")).unwrap_or_default();
            let unload = unloading(law, &mut random);
            let _ = writeln!(text, "unload = {unload}");
            let _ = write!(case.line, " | unload {unload}");
        }
        if contact.contains("bond = true") && !contact.contains("obstacle") && random.chance(0.7) {
            // blocks are about as large as one, so that this is their stiffness
            let shear = young(&case.text) * random.power_of_ten(-4.0, 4.0);
            let _ = writeln!(text, "shear = {shear:e}");
            let _ = write!(case.line, " | shear {shear:.1e}");
        }
        text.push_str(contact);
    }
    let (most, least) = (random.uniform(1.0, 3.0), random.uniform(0.02, 0.9));
    let steps = random.pick(&[0, 1, 1, 2]);
    case.steps = Some(match steps {
        0 => format!("[{most:.3}, 1]"),
        1 => format!("[{most:.3}, {least:.3}, 1]"),
        _ => format!("[0.5, {most:.3}, {least:.3}, 1]"),
    });
    let _ = write!(case.line, " | steps {}", case.steps.as_deref().unwrap_or_default());
    case.text = text;
    case
}

/// Return a law of unloading for a layer, as stiff as the layer or stiffer.
fn unloading(law: &str, random: &mut Random) -> String {
    let by = random.pick(&[1.0, 1.3, 3.0, 10.0, 30.0]);
    let number = |key: &str| {
        let rest = law.split(&format!("{key} = ")).nth(1)?;
        rest.split([' ', ',']).next()?.parse::<f64>().ok()
    };
    match (number("stiffness"), number("B"), number("a")) {
        (Some(stiffness), _, _) if random.chance(0.5) => {
            // the slope changes between the pressures 1e-6 and 1 stiffness
            let slopes = [by * stiffness, by * random.uniform(1.0, 5.0) * stiffness];
            format!(
                "{{ table = [[1e-6, {:e}, {:e}], [1, {stiffness:e}, {:e}]] }}",
                1e-6 * stiffness,
                slopes[0],
                slopes[1]
            )
        }
        (Some(stiffness), _, _) => format!("{{ linear = {{ stiffness = {:e} }} }}", by * stiffness),
        (_, Some(b), Some(a)) => format!("{{ power = {{ B = {:e}, a = {a} }} }}", b / by),
        _ => law.to_owned(),
    }
}

/// Return the first modulus of a scene.
fn young(text: &str) -> f64 {
    text.lines().find_map(|line| line.strip_prefix("young = ")?.parse().ok()).unwrap_or(1.0)
}
