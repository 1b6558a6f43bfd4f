//! The outer iteration: methods by name, and their settings.

use super::history::History;
use super::robin::{RobinRule, Zone};
use super::stop::StopRule;
use crate::expression::Field;
use serde::{Deserialize, Serialize};

/// The outer iteration.
#[derive(Debug, Clone)]
pub struct MethodSpec {
    /// The method. A scene file without a name means [`MethodName::Robin`] if psi, gamma, robin or the increment rule is given, and
    /// [`MethodName::Auto`] otherwise.
    pub name: MethodName,
    /// Robin zone psi.
    pub psi: Zone,
    /// Robin coefficient on the zone.
    pub robin: RobinRule,
    /// Relaxation gamma of the method `robin`.
    pub gamma: Gamma,
    /// Whether `robin` determines the interval (33) of gamma at the end.
    pub interval: bool,
    /// Number of earlier steps that the method `anderson` mixes.
    pub depth: usize,
    /// How linear steps of Newton's method are solved; the program chooses if `None`.
    pub linear: Option<Linear>,
    /// Start of the iteration.
    pub start: Start,
    /// Load steps.
    pub steps: History,
    /// The rules that stop the run.
    pub stop: StopRule,
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
        Self {
            name: MethodName::Auto,
            psi: Zone::Active,
            robin: RobinRule::Auto,
            gamma: Gamma::Stationary(0.6),
            interval: false,
            depth: 5,
            linear: None,
            start: Start::Auto,
            steps: History::default(),
            stop: StopRule::default(),
        }
    }
}

/// The methods.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MethodName {
    /// Newton's method, with the kind of linear step that suits the bodies, the memory and the number of ranks.
    Auto,
    /// The paper's iteration (41)-(42).
    Robin,
    /// Nonlinear conjugate gradients over the sweep.
    Ncg,
    /// Anderson acceleration of the sweep.
    Anderson,
    /// Newton's method with linear steps by conjugate gradients over the sweep.
    NewtonRobin,
    /// Newton's method with one matrix of all bodies: dense, factorised, or solved by multigrid.
    Newton,
}

impl MethodName {
    /// All methods with their names in the scene.
    pub const ALL: [(&'static str, MethodName); 6] = [
        ("auto", MethodName::Auto),
        ("robin", MethodName::Robin),
        ("ncg", MethodName::Ncg),
        ("anderson", MethodName::Anderson),
        ("newton-robin", MethodName::NewtonRobin),
        ("newton", MethodName::Newton),
    ];
}

/// The ways to solve the linear steps of Newton's method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Linear {
    /// One dense matrix of condensed bodies.
    Dense,
    /// One sparse factorisation of all bodies.
    Direct,
    /// Conjugate gradients with multigrid of all bodies.
    Multigrid,
    /// Conjugate gradients over the Robin sweep (one solve in every body).
    Sweeps,
}

impl Linear {
    /// All ways with their names in the scene.
    pub const ALL: [(&'static str, Linear); 4] = [
        ("dense", Linear::Dense),
        ("direct", Linear::Direct),
        ("multigrid", Linear::Multigrid),
        ("sweeps", Linear::Sweeps),
    ];

    /// Return the name in the scene.
    pub fn name(self) -> &'static str {
        super::name_of(&Self::ALL, &self)
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
