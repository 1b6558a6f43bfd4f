//! The outer iteration: methods by name, and their settings.

use super::history::History;
use super::robin::{RobinRule, Zone};
use super::stop::StopRule;
use crate::expression::Field;
use crate::setting::{keys, words};
use serde::{Deserialize, Serialize};

keys! {
    /// The outer iteration.
    #[derive(Debug, Clone)]
    pub struct MethodSpec "[method]" {
        optional {
            /// the method
            ///
            /// A scene file without a name means [`MethodName::Robin`] if psi, gamma, robin or the increment rule is given, and
            /// [`MethodName::Auto`] otherwise.
            pub name: MethodName = MethodName::Auto,
            /// Robin zone: "none", "full", "active" or a condition
            pub psi: Zone = Zone::Active,
            /// relaxation of `robin`: a number, a list, a rule
            pub gamma: Gamma = Gamma::Stationary(0.6),
            /// Robin coefficient on the zone, "tangent" if the method is `robin`
            pub robin: RobinRule = RobinRule::Auto,
            /// whether `robin` finds the interval of gamma at the end
            ///
            /// It is the interval (33).
            pub interval: bool = false,
            /// earlier steps that `anderson` mixes
            pub depth: usize = 5,
            /// how linear steps are solved; chosen by the program without it
            pub linear: Option<Linear> = None,
            /// start of the iteration: "auto", "zero", "nested" or { normal = 1e-4 }
            pub start: Start = Start::Auto,
            /// load steps: a number, shares that end with 1, or a table
            pub steps: History = History::default(),
            /// when to stop: stop = { residual = 1e-8 }
            pub stop: StopRule = StopRule::default(),
        }
    }
}

impl MethodSpec {
    /// Return the method of this name with its defaults. Those of [`MethodName::Robin`] are the paper's.
    pub fn new(name: MethodName) -> Self {
        let robin = if name == MethodName::Robin { RobinRule::Tangent } else { RobinRule::Auto };
        Self { name, robin, ..Self::default() }
    }
}

impl Default for MethodSpec {
    fn default() -> Self {
        Self::with_defaults()
    }
}

words! {
    /// The methods.
    pub enum MethodName "method" {
        /// Newton's method, with the kind of linear step that suits the bodies, the memory and the number of ranks.
        Auto = "auto",
        /// The paper's iteration (41)-(42).
        Robin = "robin",
        /// Nonlinear conjugate gradients over the sweep.
        Ncg = "ncg",
        /// Anderson acceleration of the sweep.
        Anderson = "anderson",
        /// Newton's method with linear steps by conjugate gradients over the sweep.
        NewtonRobin = "newton-robin",
        /// Newton's method with one matrix of all bodies: dense, factorised, or solved by multigrid.
        Newton = "newton",
    }
}

words! {
    /// The ways to solve the linear steps of Newton's method.
    #[derive(Serialize, Deserialize)]
    pub enum Linear "way to solve linear steps" {
        /// One dense matrix of condensed bodies.
        Dense = "dense",
        /// One sparse factorisation of all bodies.
        Direct = "direct",
        /// Conjugate gradients with multigrid of all bodies.
        Multigrid = "multigrid",
        /// Conjugate gradients over the Robin sweep (one solve in every body).
        Sweeps = "sweeps",
    }
}

/// The relaxation gamma^k of iteration k.
#[derive(Debug, Clone, PartialEq)]
pub enum Gamma {
    /// The same number > 0 in every iteration.
    Stationary(f64),
    /// Numbers > 0 for k = 0, 1, ...; the last one is kept.
    Schedule(Vec<f64>),
    /// Exact line search on the functional F1.
    LineSearch,
    /// Aitken's rule.
    Aitken,
    /// The rule of Barzilai and Borwein.
    BarzilaiBorwein,
    /// The best stationary value for the estimated spectrum.
    Spectral,
    /// The rule of this name from a Rust program ([`Scene::rule`](crate::scene::Scene::rule)).
    Own(String),
}

impl Gamma {
    /// All rules of the program with their names in the scene.
    pub const NAMED: [(&'static str, Gamma); 4] = [
        ("line-search", Gamma::LineSearch),
        ("aitken", Gamma::Aitken),
        ("barzilai-borwein", Gamma::BarzilaiBorwein),
        ("spectral", Gamma::Spectral),
    ];
}

/// The start of the iteration, given on the contact surfaces.
#[derive(Debug, Clone)]
pub enum Start {
    /// The solution with rigid bodies, each layer in series with a spring that stands for the surfaces of the two bodies.
    Auto,
    /// Zero normal displacement.
    Zero,
    /// The solution on a mesh of elements twice as large.
    Nested,
    /// Outer normal displacement on every contact surface.
    Normal(Field),
}
