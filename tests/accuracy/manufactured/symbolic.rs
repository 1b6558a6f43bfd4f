//! Just enough algebra to make a problem from its solution: sums of terms factor * x^a y^b z^c * (1, sin or cos of a linear
//! form), their products with polynomials, their derivatives, and their text for a scene.

use std::fmt;
use std::ops::{Add, Mul, Neg, Sub};

/// A sum of terms.
#[derive(Clone)]
pub struct Expr(Vec<Term>);

#[derive(Clone)]
struct Term {
    factor: f64,
    powers: [i32; 3],
    wave: Wave,
}

#[derive(Clone, Copy, PartialEq)]
enum Wave {
    One,
    Sin([f64; 3]),
    Cos([f64; 3]),
}

/// A number as an expression.
pub fn number(value: f64) -> Expr {
    Expr(vec![Term { factor: value, powers: [0; 3], wave: Wave::One }])
}

/// A coordinate.
pub fn x(i: usize) -> Expr {
    let mut powers = [0; 3];
    powers[i] = 1;
    Expr(vec![Term { factor: 1.0, powers, wave: Wave::One }])
}

/// Sine of a linear form of the coordinates.
pub fn sine(form: [f64; 3]) -> Expr {
    Expr(vec![Term { factor: 1.0, powers: [0; 3], wave: Wave::Sin(form) }])
}

/// Cosine of a linear form of the coordinates.
pub fn cosine(form: [f64; 3]) -> Expr {
    Expr(vec![Term { factor: 1.0, powers: [0; 3], wave: Wave::Cos(form) }])
}

impl Expr {
    /// Derivative along a coordinate.
    pub fn along(&self, i: usize) -> Expr {
        let mut all = Expr(Vec::new());
        for term in &self.0 {
            let mut lower = term.clone();
            lower.factor *= f64::from(term.powers[i]);
            lower.powers[i] = (lower.powers[i] - 1).max(0);
            let turned = match term.wave {
                Wave::One => Term { factor: 0.0, ..term.clone() },
                Wave::Sin(form) => Term { factor: term.factor * form[i], wave: Wave::Cos(form), ..*term },
                Wave::Cos(form) => Term { factor: -term.factor * form[i], wave: Wave::Sin(form), ..*term },
            };
            all = all + Expr(vec![lower, turned]);
        }
        all
    }
}

impl Add for Expr {
    type Output = Expr;
    fn add(mut self, other: Expr) -> Expr {
        for term in other.0 {
            match self.0.iter_mut().find(|own| own.powers == term.powers && own.wave == term.wave) {
                Some(own) => own.factor += term.factor,
                None => self.0.push(term),
            }
        }
        self.0.retain(|term| term.factor != 0.0);
        self
    }
}

impl Mul for Expr {
    type Output = Expr;
    fn mul(self, other: Expr) -> Expr {
        let mut all = Expr(Vec::new());
        for a in &self.0 {
            for b in &other.0 {
                let wave = match (a.wave, b.wave) {
                    (Wave::One, wave) | (wave, Wave::One) => wave,
                    _ => panic!("one factor is a polynomial"),
                };
                let powers = std::array::from_fn(|i| a.powers[i] + b.powers[i]);
                all = all + Expr(vec![Term { factor: a.factor * b.factor, powers, wave }]);
            }
        }
        all
    }
}

impl Neg for Expr {
    type Output = Expr;
    fn neg(self) -> Expr {
        number(-1.0) * self
    }
}

impl Sub for Expr {
    type Output = Expr;
    fn sub(self, other: Expr) -> Expr {
        self + -other
    }
}

impl fmt::Display for Expr {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const NAMES: [&str; 3] = ["x", "y", "z"];
        let form = |form: [f64; 3]| {
            let parts = NAMES.iter().zip(form).filter(|(_, a)| *a != 0.0).map(|(name, a)| format!("{a}*{name}"));
            parts.collect::<Vec<_>>().join(" + ")
        };
        let terms = self.0.iter().map(|term| {
            let mut text = format!("({})", term.factor);
            for (name, power) in NAMES.iter().zip(term.powers).filter(|(_, power)| *power > 0) {
                text += &format!("*{name}^{power}");
            }
            match term.wave {
                Wave::One => text,
                Wave::Sin(a) => format!("{text}*sin({})", form(a)),
                Wave::Cos(a) => format!("{text}*cos({})", form(a)),
            }
        });
        let terms: Vec<String> = terms.collect();
        if terms.is_empty() { write!(f, "0") } else { write!(f, "({})", terms.join(" + ")) }
    }
}

#[test]
fn derivatives_and_texts() {
    let u = x(1) * x(1) * sine([2.0, 0.0, 1.0]) + number(3.0) * x(0) - x(0);
    assert_eq!(u.to_string(), "((1)*y^2*sin(2*x + 1*z) + (2)*x^1)");
    assert_eq!(u.along(0).to_string(), "((2)*y^2*cos(2*x + 1*z) + (2))");
    assert_eq!(u.along(1).along(2).to_string(), "((2)*y^1*cos(2*x + 1*z))");
    assert_eq!(cosine([0.0, 3.0, 0.0]).along(1).to_string(), "((-3)*sin(3*y))");
    assert_eq!((u.clone() - u).to_string(), "0");
}
