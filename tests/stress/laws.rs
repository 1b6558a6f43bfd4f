//! Random laws of layers with a given tangent at a given pressure.

use super::random::Random;
use std::fmt::Write;

/// A law as a value of the key `layer`, and how far the layer closes at the pressure.
pub struct Law {
    /// The value.
    pub text: String,
    /// Compression at the pressure.
    pub closing: f64,
}

/// A law of any form with p' = `kappa` where the pressure is `level`; `line` is told which.
pub fn any(random: &mut Random, level: f64, kappa: f64, line: &mut String) -> Law {
    let linear = level / kappa;
    let (words, text, closing) = match random.pick(&[0, 1, 1, 1, 2, 3, 4, 5, 6, 7]) {
        0 => ("linear".to_owned(), format!("linear = {{ stiffness = {kappa:e} }}"), linear),
        1 => {
            let any = random.uniform(0.05, 1.0);
            let a = random.pick(&[0.1, 0.3, 0.5, 1.0, any]);
            let b = level.powf(1.0 - a) / (a * kappa);
            (format!("a {a:.2}"), format!("power = {{ B = {b:e}, a = {a} }}"), level / (a * kappa))
        }
        2 => {
            // p' = (p + p0)/c0
            let p0 = level * random.power_of_ten(-3.0, 1.0);
            let c0 = (level + p0) / kappa;
            let text = format!("exponential = {{ p0 = {p0:e}, c0 = {c0:e} }}");
            (format!("exp {:.0e}", p0 / level), text, c0 * (level / p0).ln_1p())
        }
        3 => {
            // the share of the cubic term in the pressure
            let share = random.pick(&[0.1, 0.9, 0.999]);
            let closing = (1.0 + 2.0 * share) * linear;
            let (k1, k3) = ((1.0 - share) * level / closing, share * level / closing.powi(3));
            (format!("cubic {share}"), format!("cubic = {{ k1 = {k1:e}, k3 = {k3:e} }}"), closing)
        }
        4 => {
            // slopes that jump either way, the last one kappa
            let (mut c, mut p, mut points) = (0.0, 0.0, String::new());
            for share in [0.2, 0.3, 0.5] {
                c += share * level / kappa * random.power_of_ten(-1.5, 1.5);
                p += share * level;
                let _ = write!(points, "{}[{c:e}, {p:e}]", if points.is_empty() { "" } else { ", " });
            }
            ("table".to_owned(), format!("table = [{points}]"), c)
        }
        5 => {
            // hardens to a wall that `up_to` cuts off
            let (wall, end) = (3.0 * linear, 0.9 * 3.0 * linear);
            let text = format!("pressure = \"{:e}*c/({wall:e} - c)\", up_to = {end:e}", 2.0 * level);
            ("wall".to_owned(), text, linear)
        }
        6 => {
            let text = format!("pressure = \"{level:e}*sinh(c/{linear:e})\", up_to = {:e}", 20.0 * linear);
            ("sinh".to_owned(), text, 0.88 * linear)
        }
        _ => {
            // flat at its foot
            let text = format!("pressure = \"{:e}*c^2/(c + {linear:e})\"", 4.0 * kappa / 3.0);
            ("toe".to_owned(), text, linear)
        }
    };
    let _ = write!(line, " {words}");
    Law { text, closing }
}
