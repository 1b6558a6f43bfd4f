//! The outer iteration, its rules, and inner solvers by name.

use super::history::History;
use super::name_of;
use crate::error::Result;
use crate::expression::Field;
use crate::setting::{Context, Keys, Node, Setting, TableShape, Value, ValueKind, choose, keys, word, words};
use serde::{Deserialize, Serialize};
use serde_json::{Value as Json, json};

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
            /// how linear steps are solved; chosen by the program without it
            pub linear: Option<Linear> = None,
            /// start of the iteration: "auto", "zero" or { normal = 1e-4 }
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
    /// The rule of this name from a Rust program ([`Scene::rule`](crate::scene::Scene::rule)).
    Own(String),
}

impl Gamma {
    /// All rules of the program with their names in the scene.
    pub const NAMED: [(&'static str, Gamma); 2] = [("line-search", Gamma::LineSearch), ("aitken", Gamma::Aitken)];
}

/// The start of the iteration, given on the contact surfaces.
#[derive(Debug, Clone)]
pub enum Start {
    /// The solution with rigid bodies, each layer in series with a spring that stands for the surfaces of the two bodies.
    Auto,
    /// Zero normal displacement.
    Zero,
    /// Outer normal displacement on every contact surface.
    Normal(Field),
}

/// The rule for the Robin coefficient kappa on the zone. p is the law of the layer and c^k the compression at iterate k.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RobinRule {
    /// kappa = p'(c^k), as in the paper.
    Tangent,
    /// The coefficient of the start in every iteration, made safe as in `Auto`. It needs one factorisation in a run. Theorem 3 allows it.
    Frozen,
    /// kappa = max(p'(c^k), F) everywhere on the contact surfaces; F > 0 is this number.
    Floor(f64),
    /// The tangent on the zone, and more for a body that the tangent does not constrain safely.
    Auto,
}

/// The Robin zone: psi of (38), a characteristic function of a part of the contact surfaces. c is the compression of the layer.
#[derive(Debug, Clone)]
pub enum Zone {
    /// psi = 0: Neumann-Neumann.
    None,
    /// psi = 1: full Robin.
    Full,
    /// psi = chi = \[c > 0\], equation (36).
    Active,
    /// psi = 1 where the expression in x, y, z and the iteration k = 0, 1, ... is > 0 (true is 1).
    Subset(Field),
}

keys! {
    /// The rules that stop a run. At least one of `residual` and `increment` is given. The first rule that is met ends the run.
    #[derive(Debug, Clone, PartialEq)]
    pub struct StopRule "the stop rule" {
        optional {
            /// relative residual, or error of Newton's method
            ///
            /// Tolerance of the relative residual of sweeps, or of the largest relative error of Newton's method (docs/theory.md). In a
            /// scene file there is no default if `increment` is given.
            pub residual: Option<f64> = Some(1e-8),
            /// the paper's rule on the increment
            ///
            /// Tolerance of the relative increment of normal displacements, in every body.
            pub increment: Option<f64> = None,
            /// most iterations
            pub iterations: usize = 2000,
        }
    }
}

impl Default for StopRule {
    fn default() -> Self {
        Self::with_defaults()
    }
}

impl Setting for StopRule {
    fn kind() -> ValueKind {
        Self::shape().into()
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        let stop = Self::decode(&Keys::open(node, &Self::shape())?, context)?;
        let by_increment = stop.increment.is_some() && !node.has_key("residual");
        Ok(Self { residual: stop.residual.filter(|_| !by_increment), ..stop })
    }

    fn echo(&self, dimension: usize) -> Json {
        self.entries(dimension).into()
    }
}

impl StopRule {
    /// Return the tolerance that relative errors inside a run refer to. It is that of the residual, or the square root of machine epsilon
    /// where the increment alone ends the run.
    pub fn tolerance(&self) -> f64 {
        self.residual.unwrap_or(f64::EPSILON.sqrt())
    }

    /// Return whether an iterate meets a rule. `residual` and `increment` are relative; the increment is NaN before the first update.
    pub fn is_met(&self, residual: f64, increment: f64) -> bool {
        self.residual.is_some_and(|tolerance| residual <= tolerance)
            || self.increment.is_some_and(|tolerance| increment <= tolerance)
    }
}

/// The inner solver that the scene requests. PETSc options override it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SolverSpec {
    /// The preset; the program chooses if `None`.
    pub preset: Option<Preset>,
}

words! {
    /// The presets of inner solvers.
    #[derive(Serialize, Deserialize)]
    pub enum Preset "solver" {
        /// Sparse Cholesky factorisation by MUMPS.
        Mumps = "mumps",
        /// Interior dofs eliminated once by MUMPS, and a dense system on the contact in each sweep.
        Condensed = "condensed",
        /// Conjugate gradients preconditioned by hypre's BoomerAMG.
        Hypre = "hypre",
        /// Conjugate gradients preconditioned by PETSc's GAMG.
        Gamg = "gamg",
        /// Conjugate gradients preconditioned by an incomplete Cholesky factorisation.
        Icc = "icc",
    }
}

/// A table without a name, but with `psi`, `gamma`, `robin` or `stop.increment`, is the method `robin`.
impl Setting for MethodSpec {
    fn kind() -> ValueKind {
        Self::shape().into()
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        let mut method = Self::decode(&Keys::open(node, &Self::shape())?, context)?;
        let is_paper_rule = method.stop.increment.is_some();
        if !node.has_key("name") && (is_paper_rule || ["psi", "gamma", "robin"].iter().any(|key| node.has_key(key))) {
            method.name = MethodName::Robin;
        }
        if !node.has_key("robin") {
            method.robin = Self::new(method.name).robin;
        }
        Ok(method)
    }

    /// Leave out keys of other methods, which change nothing.
    fn echo(&self, dimension: usize) -> Json {
        let mut entries = self.entries(dimension);
        let is_robin = self.name == MethodName::Robin;
        entries.retain(|key, _| match key.as_str() {
            "gamma" => is_robin,
            "interval" => is_robin && self.interval,
            _ => true,
        });
        entries.into()
    }
}

impl Setting for Gamma {
    fn kind() -> ValueKind {
        ValueKind::Either(vec![ValueKind::Number, ValueKind::Number.list(), word(&Self::NAMED)])
    }

    fn read(node: &Node, _: &Context) -> Result<Self> {
        match &node.value {
            Value::String(_) => choose(node, "rule for gamma", &Self::NAMED),
            Value::List(items) => items.iter().map(Node::number).collect::<Result<_>>().map(Self::Schedule),
            _ => node.number().map(Self::Stationary),
        }
    }

    fn echo(&self, _: usize) -> Json {
        match self {
            Self::Stationary(gamma) => json!(gamma),
            Self::Schedule(list) => json!(list),
            Self::Own(name) => json!({ "own": name }),
            rule => json!(name_of(&Self::NAMED, rule)),
        }
    }
}

/// Rules for the Robin coefficient by name.
const COEFFICIENTS: [(&str, RobinRule); 3] =
    [("tangent", RobinRule::Tangent), ("frozen", RobinRule::Frozen), ("auto", RobinRule::Auto)];

impl Setting for RobinRule {
    fn kind() -> ValueKind {
        ValueKind::Either(vec![word(&COEFFICIENTS), floor_shape().into()])
    }

    fn read(node: &Node, _: &Context) -> Result<Self> {
        if let Value::String(_) = node.value {
            return choose(node, "Robin coefficient", &COEFFICIENTS);
        }
        Keys::open(node, &floor_shape())?.require("floor")?.number().map(Self::Floor)
    }

    fn echo(&self, _: usize) -> Json {
        match self {
            Self::Floor(floor) => json!({ "floor": floor }),
            rule => json!(name_of(&COEFFICIENTS, rule)),
        }
    }
}

fn floor_shape() -> TableShape {
    let about = "least coefficient everywhere on the contact";
    TableShape::new("the Robin coefficient").required("floor", ValueKind::Number, about)
}

/// The echo is a text, as the key takes no number.
impl Setting for Zone {
    fn kind() -> ValueKind {
        ValueKind::Text
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        let text = node.string()?;
        match text {
            "none" => return Ok(Self::None),
            "full" => return Ok(Self::Full),
            "active" => return Ok(Self::Active),
            _ => {}
        }
        // a single word of more than two letters is a slip of one of the three, not of a variable
        if text.len() > 2 && text.chars().all(char::is_alphabetic) {
            let otherwise = || "psi is none, full, active, or a condition such as \"x > 1 && k < 5\"".to_owned();
            let error = node.refuse(format!("unknown zone `{text}`"));
            return Err(error.suggest(text, ["none", "full", "active"], otherwise));
        }
        Field::parse(text, &node.place, context.dimension, true, &context.data).map(Self::Subset)
    }

    fn echo(&self, _: usize) -> Json {
        match self {
            Self::None => json!("none"),
            Self::Full => json!("full"),
            Self::Active => json!("active"),
            Self::Subset(condition) => json!(condition.text()),
        }
    }
}

impl Setting for Start {
    fn kind() -> ValueKind {
        ValueKind::Either(vec![ValueKind::Word(vec!["auto", "zero"]), start_shape().into()])
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        if let Value::String(_) = node.value {
            let all = "it is \"auto\", \"zero\" or { normal = 1e-4 }";
            let starts = [("auto", Self::Auto), ("zero", Self::Zero)];
            return choose(node, "start", &starts).map_err(|error| error.help(all));
        }
        let keys = Keys::open(node, &start_shape())?;
        Field::read(keys.require("normal")?, context).map(Self::Normal)
    }

    fn echo(&self, dimension: usize) -> Json {
        match self {
            Self::Auto => json!("auto"),
            Self::Zero => json!("zero"),
            Self::Normal(normal) => json!({ "normal": normal.echo(dimension) }),
        }
    }
}

fn start_shape() -> TableShape {
    let about = "outer normal displacement on every contact surface";
    TableShape::new("the start").required("normal", ValueKind::Field, about)
}
