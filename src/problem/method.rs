//! The outer iteration: methods and their settings by name.

use serde::{Deserialize, Serialize};
use super::history::History;
use super::robin::{RobinRule, Zone};
use super::stop::StopRule;
use crate::expression::Field;

/// The outer iteration.
#[derive(Debug, Clone)]
pub struct MethodSpec {
    /// How steps are made. Without a name it is [`MethodName::Robin`] where psi, gamma, robin or the increment rule are given,
    /// else [`MethodName::Auto`].
    pub name: MethodName,
    /// Robin zone psi.
    pub psi: Zone,
    /// Robin coefficient on the zone.
    pub robin: RobinRule,
    /// Relaxation of the method `robin`.
    pub gamma: Gamma,
    /// Whether `robin` finds the interval (33) of gamma at the end.
    pub interval: bool,
    /// Earlier steps that the method `anderson` mixes.
    pub depth: usize,
    /// How linear steps of Newton's method are solved, or the program's choice.
    pub linear: Option<Linear>,
    /// Start of the iteration.
    pub start: Start,
    /// Load steps.
    pub steps: History,
    /// When to stop.
    pub stop: StopRule,
}

impl MethodSpec {
    /// The method of this name with its defaults: for [`MethodName::Robin`] those of the paper.
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

/// Methods by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MethodName {
    /// Newton's method with the linear step that suits bodies, memory and ranks.
    Auto,
    /// The paper's iteration (41)-(42).
    Robin,
    /// Nonlinear conjugate gradients over the sweep.
    Ncg,
    /// Anderson acceleration of the sweep.
    Anderson,
    /// Newton's method, linear steps by conjugate gradients over the sweep.
    NewtonRobin,
    /// Newton's method, all bodies in one matrix: dense, factored, or solved by multigrid.
    Newton,
}

impl MethodName {
    /// Every method with its name in the scene.
    pub const ALL: [(&'static str, MethodName); 6] = [
        ("auto", MethodName::Auto),
        ("robin", MethodName::Robin),
        ("ncg", MethodName::Ncg),
        ("anderson", MethodName::Anderson),
        ("newton-robin", MethodName::NewtonRobin),
        ("newton", MethodName::Newton),
    ];
}

/// How the linear steps of Newton's method are solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Linear {
    /// One dense matrix of condensed bodies.
    Dense,
    /// One sparse factorisation of all bodies.
    Direct,
    /// Conjugate gradients with multigrid of all bodies.
    Multigrid,
    /// Conjugate gradients over the Robin sweep: every body by itself.
    Sweeps,
}

impl Linear {
    /// Every way with its name in the scene.
    pub const ALL: [(&'static str, Linear); 4] = [
        ("dense", Linear::Dense),
        ("direct", Linear::Direct),
        ("multigrid", Linear::Multigrid),
        ("sweeps", Linear::Sweeps),
    ];

    /// Its name in the scene.
    pub fn name(self) -> &'static str {
        super::name_of(&Self::ALL, &self)
    }
}

/// Relaxation gamma^k.
#[derive(Debug, Clone, PartialEq)]
pub enum Gamma {
    /// The same number > 0 all the way.
    Stationary(f64),
    /// Numbers > 0 for k = 0, 1, ...; the last one stays.
    Schedule(Vec<f64>),
    /// Exact line search on F1.
    LineSearch,
    /// Aitken's rule.
    Aitken,
    /// The rule of Barzilai and Borwein.
    BarzilaiBorwein,
    /// Best stationary value for the estimated spectrum.
    Spectral,
    /// The rule of this name that a Rust program gives the scene ([`Scene::rule`](crate::scene::Scene::rule)).
    Own(String),
}

impl Gamma {
    /// Rules with a name in the scene.
    pub const NAMED: [(&'static str, Gamma); 4] = [
        ("line-search", Gamma::LineSearch),
        ("aitken", Gamma::Aitken),
        ("barzilai-borwein", Gamma::BarzilaiBorwein),
        ("spectral", Gamma::Spectral),
    ];
}

/// Start of the iteration, given on the contact surfaces.
#[derive(Debug, Clone)]
pub enum Start {
    /// Rigid bodies on their own surfaces.
    Auto,
    /// Zero normal displacement.
    Zero,
    /// The solution on a mesh of elements twice as large.
    Nested,
    /// Outer normal displacement on every contact surface.
    Normal(Field),
}
