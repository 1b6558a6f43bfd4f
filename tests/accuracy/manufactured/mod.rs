//! V7: problems made from their solutions. Displacements of both bodies and the compression c of the layer are chosen; the gap
//! is d = u_an + u_bn - c, the body force -div C:eps(u), and loads on all surfaces make up what is missing: the stress where
//! there is no support, and sigma n + p(c) n on the contact surfaces.

mod solid;
mod symbolic;

use crate::common::here::solve_here;
use crate::common::{Scene, case, root};
use solid::Solid;
use symbolic::{Expr, cosine, number, sine, x};

/// A body with its displacement and surfaces; it has the known displacement on `held`.
struct Body {
    name: &'static str,
    held: Vec<&'static str>,
    solid: Solid,
    u: Vec<Expr>,
    /// Loaded surfaces, plane, and their outer normals.
    free: Vec<(&'static str, Vec<f64>)>,
    /// The contact surface and its outer normal as texts.
    contact: (&'static str, Vec<String>),
}

/// p(c) = (c/B)^(1/a), which is also the paper's law.
struct Power {
    b: f64,
    a: f64,
}

/// Two bodies and the compression between them.
struct Problem {
    mesh: String,
    bodies: [Body; 2],
    law: Power,
    compression: Expr,
}

impl Body {
    fn stress(&self, i: usize, j: usize) -> Expr {
        let dimension = self.u.len();
        let mut sum = number(0.0);
        for k in 0..dimension {
            for l in 0..dimension {
                sum = sum + number(self.solid.c[i][j][k][l]) * self.u[k].along(l);
            }
        }
        self.solid.scale.clone() * sum
    }

    fn traction(&self, i: usize, normal: &[String]) -> String {
        let parts = normal.iter().enumerate().filter(|(_, n)| *n != "0");
        let parts: Vec<String> = parts.map(|(j, n)| format!("{} * {n}", self.stress(i, j))).collect();
        parts.join(" + ")
    }

    fn normal_displacement(&self) -> String {
        let parts: Vec<String> = self.u.iter().zip(&self.contact.1).map(|(u, n)| format!("{u} * {n}")).collect();
        parts.join(" + ")
    }

    /// `[[body]]` of the scene; `pressure` is the text of p.
    fn scene(&self, order: usize, pressure: &str) -> String {
        let dimension = self.u.len();
        let list = |component: &dyn Fn(usize) -> String| {
            let texts: Vec<String> = (0..dimension).map(|i| format!("\"{}\"", component(i))).collect();
            format!("[{}]", texts.join(", "))
        };
        let mut loads: Vec<String> = self
            .free
            .iter()
            .map(|(on, normal)| {
                let normal: Vec<String> = normal.iter().map(f64::to_string).collect();
                format!("{{ on = \"{on}\", traction = {} }}", list(&|i| self.traction(i, &normal)))
            })
            .collect();
        let (on, normal) = &self.contact;
        let traction = list(&|i| format!("{} + {pressure} * {}", self.traction(i, normal), normal[i]));
        loads.push(format!("{{ on = \"{on}\", traction = {traction} }}"));
        let divergence = |i: usize| (0..dimension).fold(number(0.0), |sum, j| sum + self.stress(i, j).along(j));
        let values: Vec<String> = ["x", "y", "z"].iter().zip(&self.u).map(|(c, u)| format!("{c} = \"{u}\"")).collect();
        let held: Vec<String> =
            self.held.iter().map(|on| format!("{{ on = \"{on}\", {} }}", values.join(", "))).collect();
        format!(
            "[[body]]\nname = \"{}\"\norder = {order}\n{}\nfix = [{}]\nload = [{}]\nforce = {}\n\
             exact = {}\n",
            self.name,
            self.solid.scene(),
            held.join(",\n"),
            loads.join(",\n"),
            list(&|i| (-divergence(i)).to_string()),
            list(&|i| self.u[i].to_string()),
        )
    }
}

impl Problem {
    fn scene(&self, order: usize) -> String {
        let Power { b, a } = self.law;
        let pressure = format!("(max(0, {})/{b})^(1/{a})", self.compression);
        let [first, second] = &self.bodies;
        let (of_first, of_second) = (first.normal_displacement(), second.normal_displacement());
        let gap = format!("{of_first} + {of_second} - {}", self.compression);
        format!(
            "dimension = {}\nmesh = {}\n{}{}[[contact]]\nbetween = [\"{}\", \"{}\"]\ngap = \"{gap}\"\n\
             layer = {{ power = {{ B = {b}, a = {a} }} }}\n[method]\nstop = {{ residual = 1e-10 }}\n\
             [output]\nvtu = false\nplots = false\n",
            first.u.len(),
            self.mesh,
            first.scene(order, &pressure),
            second.scene(order, &pressure),
            first.contact.0,
            second.contact.0
        )
    }

    /// Asserts the orders of its errors.
    fn converges(&self, label: &str, order: usize, sizes: [usize; 3], least: [f64; 2], last: f64) {
        check_orders(label, &Scene::new(self.scene(order)), order, sizes, least, last);
    }
}

/// Asserts that the relative errors (L2, H1) of the worse body fall with at least these orders, by a fit over all meshes, and
/// that the last one in H1 is below a bound.
fn check_orders(
    label: &str,
    scene: &impl AsRef<std::path::Path>,
    order: usize,
    sizes: [usize; 3],
    least: [f64; 2],
    last: f64,
) {
    let errors = sizes.map(|n| {
        let sets = [format!("mesh.set.n={n}"), format!("body.0.order={order}"), format!("body.1.order={order}")];
        let run = solve_here(scene, &sets.each_ref().map(String::as_str)).converged();
        ["error_l2", "error_h1"].map(|norm| {
            let of = |body: usize| run.number(&format!("bodies/{body}/{norm}"));
            of(0).max(of(1))
        })
    });
    let orders = [0, 1].map(|norm| slope(sizes.map(|n| -(n as f64).ln()), errors.map(|error| error[norm].ln())));
    let label = format!("{label} P{order}: orders {orders:.2?}, {errors:?}");
    println!("{label}");
    assert!(orders[0] > least[0] && orders[1] > least[1] && errors[2][1] < last, "{label}");
}

/// Slope of the straight line nearest to some points.
fn slope(x: [f64; 3], y: [f64; 3]) -> f64 {
    let [mx, my] = [x, y].map(|values| values.iter().sum::<f64>() / 3.0);
    let sum = |f: &dyn Fn(usize) -> f64| (0..3).map(f).sum::<f64>();
    sum(&|i| (x[i] - mx) * (y[i] - my)) / sum(&|i| (x[i] - mx).powi(2))
}

fn mesh(name: &str) -> String {
    format!("{{ geo = \"{}/meshes/{name}.geo\" }}", root().display())
}

/// Texts of a constant normal.
fn constant(normal: &[f64]) -> Vec<String> {
    normal.iter().map(f64::to_string).collect()
}

fn wave(a: f64, b: f64) -> Expr {
    sine([a, b, 0.0])
}

/// Squares over each other; contact is open on a part.
fn flat(lower: Solid, upper: Solid) -> Problem {
    let down = || number(2.0) - x(1);
    Problem {
        mesh: mesh("manufactured/manufactured"),
        bodies: [
            Body {
                name: "lower",
                held: vec!["lower_face"],
                solid: lower,
                u: vec![x(1) * wave(2.0, 1.0), x(1) * (number(0.4) + wave(-1.0, 2.0))],
                free: vec![("lower_right", vec![1.0, 0.0]), ("lower_left", vec![-1.0, 0.0])],
                contact: ("lower_top", constant(&[0.0, 1.0])),
            },
            Body {
                name: "upper",
                held: vec!["upper_face"],
                solid: upper,
                u: vec![down() * wave(1.0, -1.5), down() * (number(-0.3) + x(0) * wave(1.5, 0.5))],
                free: vec![("upper_right", vec![1.0, 0.0]), ("upper_left", vec![-1.0, 0.0])],
                contact: ("upper_bottom", constant(&[0.0, -1.0])),
            },
        ],
        law: Power { b: 0.4, a: 0.5 },
        compression: number(0.2) + number(0.5) * cosine([std::f64::consts::PI, 0.0, 0.0]),
    }
}

/// Quarters of rings in each other.
fn curved(inner: Solid, outer: Solid) -> Problem {
    let square = || x(0) * x(0) + x(1) * x(1);
    let radial = |sign: f64| ["x", "y"].map(|x| format!("{sign}*{x}/sqrt(x^2 + y^2)")).to_vec();
    let within = || square() - number(0.25);
    let beyond = || number(2.25) - square();
    Problem {
        mesh: mesh("manufactured/curved"),
        bodies: [
            Body {
                name: "inner",
                held: vec!["inner_face"],
                solid: inner,
                u: vec![within() * wave(2.0, 1.0), within() * (number(0.4) + wave(-1.0, 2.0))],
                free: vec![("inner_x", vec![0.0, -1.0]), ("inner_y", vec![-1.0, 0.0])],
                contact: ("inner_top", radial(1.0)),
            },
            Body {
                name: "outer",
                held: vec!["outer_face"],
                solid: outer,
                u: vec![beyond() * wave(1.0, -1.5), beyond() * (number(-0.3) + x(0) * wave(1.5, 0.5))],
                free: vec![("outer_x", vec![0.0, -1.0]), ("outer_y", vec![-1.0, 0.0])],
                contact: ("outer_bottom", radial(-1.0)),
            },
        ],
        law: Power { b: 0.4, a: 0.5 },
        compression: number(0.2) + number(0.3) * x(0) - number(0.4) * x(1) * x(1),
    }
}

/// Cubes over each other, held on all sides but the contact.
fn cubes(lower: Solid, upper: Solid) -> Problem {
    let down = || number(2.0) - x(2);
    Problem {
        mesh: mesh("manufactured-3d/manufactured-3d"),
        bodies: [
            Body {
                name: "lower",
                held: vec!["lower_bottom", "lower_x0", "lower_x1", "lower_y0", "lower_y1"],
                solid: lower,
                u: vec![
                    x(2) * sine([1.0, 0.5, 0.3]),
                    x(2) * (number(0.4) + sine([-1.0, 1.0, 0.5])),
                    x(2) * sine([0.5, 1.0, -1.0]),
                ],
                free: Vec::new(),
                contact: ("lower_top", constant(&[0.0, 0.0, 1.0])),
            },
            Body {
                name: "upper",
                held: vec!["upper_top", "upper_x0", "upper_x1", "upper_y0", "upper_y1"],
                solid: upper,
                u: vec![
                    down() * sine([1.0, -0.5, 0.3]),
                    down() * sine([0.3, 1.0, -0.7]),
                    down() * (number(-0.3) + sine([0.5, 0.8, 0.5])),
                ],
                free: Vec::new(),
                contact: ("upper_bottom", constant(&[0.0, 0.0, -1.0])),
            },
        ],
        law: Power { b: 0.4, a: 0.5 },
        compression: number(0.2) + number(0.3) * x(0) - number(0.4) * x(1) * x(1),
    }
}

fn steel() -> Solid {
    Solid::isotropic(2.0, 0.3)
}

fn fibres(angle: f64) -> Solid {
    Solid::orthotropic([5.0, 1.2, 0.9, 0.31, 0.27, 0.35, 0.7, 0.6, 0.4], angle)
}

fn graded(solid: Solid) -> Solid {
    solid.times(number(1.0) + number(0.4) * x(0) - number(0.2) * x(1) * x(0))
}

#[test]
fn graded_and_anisotropic() {
    flat(graded(steel()), fibres(-1.1)).converges("steel", 1, [16, 24, 32], [1.9, 0.95], 0.15);
    flat(graded(steel()), fibres(-1.1)).converges("steel", 2, [4, 8, 16], [2.9, 1.95], 0.01);
    flat(graded(fibres(0.5)), Solid::isotropic(3.0, 0.2)).converges("fibres", 1, [16, 24, 32], [1.9, 0.95], 0.15);
    flat(graded(fibres(0.5)), Solid::isotropic(3.0, 0.2)).converges("fibres", 2, [4, 8, 16], [2.9, 1.95], 0.01);
}

/// Orders k + 1 and k up to 8 where the solution is smooth: contact is closed everywhere. Errors below 1e-11 are those of rounding.
#[test]
fn high_orders() {
    let compression = || number(0.7) + number(0.5) * cosine([1.0, 0.0, 0.0]);
    let problem = || Problem { compression: compression(), ..flat(steel(), graded(fibres(-1.1))) };
    let finest = [(3, 8), (4, 8), (5, 6), (6, 6), (7, 6)];
    for (order, n) in finest {
        let k = order as f64;
        problem().converges("smooth", order, [n - 4, n - 2, n], [k + 0.85, k - 0.15], 2e-4);
    }
    problem().converges("smooth", 8, [2, 2, 4], [8.3, 7.85], 1e-10);
}

/// Orders k + 1 and k on circles, too, which the edges of a mesh of order k follow. The compression is positive
/// everywhere.
#[test]
fn high_orders_on_curves() {
    let compression = || number(0.9) + number(0.3) * x(0) - number(0.4) * x(1) * x(1);
    let problem = || Problem { compression: compression(), ..curved(steel(), fibres(0.5)) };
    for order in 3..=6 {
        let k = order as f64;
        problem().converges("curved", order, [4, 8, 12], [k + 0.85, k - 0.15], 2e-4);
    }
}

#[test]
fn curved_surfaces() {
    curved(steel(), fibres(0.5)).converges("curved", 1, [16, 24, 32], [1.9, 0.95], 0.15);
    curved(steel(), fibres(0.5)).converges("curved", 2, [4, 8, 16], [2.9, 1.95], 0.01);
}

#[test]
fn in_space() {
    cubes(graded(steel()), fibres(0.5)).converges("cubes", 1, [4, 6, 8], [1.9, 0.95], 0.15);
    cubes(graded(steel()), fibres(0.5)).converges("cubes", 2, [2, 4, 6], [2.9, 1.9], 0.01);
}

/// The stored problems, which a user can run. Where the contact reaches free edges of bodies, orders in space are lower.
#[test]
fn stored() {
    check_orders("plane", &case("manufactured"), 1, [8, 16, 24], [1.9, 0.95], 0.06);
    check_orders("plane", &case("manufactured"), 2, [4, 8, 16], [2.9, 1.95], 0.01);
    check_orders("space", &case("manufactured-3d"), 1, [4, 6, 10], [1.45, 0.95], 0.1);
    check_orders("space", &case("manufactured-3d"), 2, [2, 4, 6], [2.9, 1.95], 0.004);
}
