//! The outer iteration, its rules, and inner solvers by name.

use super::check::{Check, Fault, at_least_one, positive};
use super::compile::{Compile, Names};
use super::geometry::Geometry;
use super::history::History;
use super::read::{Either, Form, of_word, refused, table, word};
use crate::error::{Error, Located, Place, Result as Checked, shown};
use crate::expression::{Expression, Field, coordinates};
use schemars::JsonSchema;
use serde::de::IgnoredAny;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The outer iteration.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MethodSpec {
    /// the method
    ///
    /// A scene file without a name means [`MethodName::Robin`] if psi, gamma, robin or the increment rule is given
    /// ([`MethodSpec::complete`]).
    pub name: MethodName,
    /// Robin zone: "none", "full", "active", a condition, or a list of one for each side
    pub psi: Zone,
    /// relaxation of `robin` and `semismooth`: a number, an expression in k, a list, a rule
    pub gamma: Gamma,
    /// Robin coefficient on the zone, "tangent" if the method is `robin`
    pub robin: RobinRule,
    /// whether `robin` finds the interval of gamma at the end
    ///
    /// It is the interval (33).
    pub interval: bool,
    /// how linear steps are solved; chosen by the program without it
    pub linear: Option<Linear>,
    /// start of the iteration: "auto", "zero" or { normal = 1e-4 }
    pub start: Start,
    /// load steps: a number, shares that end with 1, or a table
    pub steps: History,
    /// when to stop: stop = { residual = 1e-8 }
    #[serde(deserialize_with = "table")]
    pub stop: StopRule,
}

impl MethodSpec {
    /// Return the method of this name with its defaults. Those of [`MethodName::Robin`] are the paper's.
    pub fn new(name: MethodName) -> Self {
        let robin = if name == MethodName::Robin { RobinRule::Tangent } else { RobinRule::Auto };
        Self { name, robin, ..Self::default() }
    }

    /// Set the defaults that depend on other keys of a scene file: the method and coefficient of the paper where its
    /// keys are used, and the tolerance of the residual where no rule is given. `find` returns the place of a key of
    /// `[method]` that is given.
    ///
    /// # Errors
    /// A key that the method does not read.
    pub fn complete(&mut self, find: impl Fn(&str) -> Option<Place>) -> Checked<()> {
        let is_given = |key: &str| find(key).is_some();
        let is_paper = self.stop.increment.is_some() || ["psi", "gamma", "robin"].into_iter().any(is_given);
        if is_paper && !is_given("name") {
            self.name = MethodName::Robin;
        }
        if self.name == MethodName::Robin && !is_given("robin") {
            self.robin = RobinRule::Tangent;
        }
        if self.stop.increment.is_none() {
            self.stop.residual.get_or_insert(TOLERANCE);
        }
        self.refuse_idle(find)
    }

    /// Refuse a key that the method does not read. A key of the file may stand there if an option of the command line
    /// has replaced the method.
    fn refuse_idle(&self, find: impl Fn(&str) -> Option<Place>) -> Checked<()> {
        let is_option = |place: &Place| place.source.name.starts_with("--");
        let is_replaced = find("name").is_some_and(|name| is_option(&name));
        let by_sweeps = self.linear == Some(Linear::Sweeps);
        let has_sweeps = match self.name {
            MethodName::Auto => self.linear.is_none() || by_sweeps,
            MethodName::Newton | MethodName::Semismooth => by_sweeps,
            MethodName::Robin | MethodName::NewtonRobin => true,
        };
        let has_gamma = matches!(self.name, MethodName::Robin | MethodName::Semismooth);
        let gamma = ("gamma", has_gamma, "`robin` and `semismooth`");
        let zone = ["psi", "robin"].map(|key| (key, has_sweeps, "`robin` and `newton-robin`"));
        for (key, _, readers) in [gamma].into_iter().chain(zone).filter(|(_, is_read, _)| !is_read) {
            let Some(place) = find(key).filter(|place| is_option(place) || !is_replaced) else { continue };
            return Err(Error::scene(&place, format!("the method `{}` does not read `{key}`", self.name.name()))
                .label("no effect")
                .help(format!("leave it out, or choose a method that reads it: {readers}")));
        }
        Ok(())
    }
}

/// The zone has the iteration k as a variable, too; gamma has no other.
impl Compile for MethodSpec {
    fn compile(&mut self, names: &Names<'_>) -> Checked<()> {
        let Self { psi, gamma, start, name: _, robin: _, interval: _, linear: _, steps: _, stop: _ } = self;
        psi.compile(&names.with(&coordinates(names.dimension, true)))?;
        if let Gamma::Expression(gamma) = gamma {
            gamma.compile(&names.with(&["k"]))?;
        }
        if let Start::Normal(start) = start { start.compile(names) } else { Ok(()) }
    }
}

impl Compile for Zone {
    fn compile(&mut self, names: &Names<'_>) -> Checked<()> {
        match self {
            Self::Subset(condition) => condition.compile(names),
            Self::Sides(zones) => zones.iter_mut().try_for_each(|zone| zone.compile(names)),
            Self::None | Self::Full | Self::Active => Ok(()),
        }
    }
}

impl Check for MethodSpec {
    /// Check all but steps and stop rule, which are checked by themselves.
    fn check(&self, _: Geometry) -> Result<(), Fault> {
        match &self.gamma {
            Gamma::Stationary(gamma) => positive("gamma", "gamma", *gamma)?,
            Gamma::Schedule(list) if list.is_empty() => {
                let help = "write a number, a list of numbers, or the name of a rule";
                return Err(Fault::new("gamma", "gamma has no value", "", help));
            }
            Gamma::Schedule(list) => {
                let one = |(k, gamma): (usize, &f64)| positive(&format!("gamma.{k}"), "gamma", *gamma);
                list.iter().enumerate().try_for_each(one)?;
            }
            Gamma::Expression(gamma) => {
                let of = |k: usize| gamma.in_iteration(k);
                if let Some(k) = (0..self.stop.iterations.min(MOST)).find(|k| !(of(*k) > 0.0 && of(*k).is_finite())) {
                    let message = format!("gamma is {} in iteration k = {k}", shown(of(k)));
                    return Err(Fault::new("gamma", message, "must be greater than 0", ""));
                }
            }
            Gamma::LineSearch | Gamma::Aitken | Gamma::Own(_) => {}
        }
        if let RobinRule::Floor(floor) = self.robin {
            positive("robin.floor", "the floor", floor)?;
        }
        if self.linear.is_some() && matches!(self.name, MethodName::Robin | MethodName::NewtonRobin) {
            let help = "name = \"newton\", or leave `linear` away";
            return Err(Fault::new("linear", "only Newton's method has linear steps of all bodies", "", help));
        }
        if self.interval && self.name != MethodName::Robin {
            let help = "name = \"robin\", or leave `interval` away";
            return Err(Fault::new("interval", "only the method `robin` has an interval of gamma", "", help));
        }
        Ok(())
    }
}

/// Most iterations for which an expression for gamma is checked beforehand: a million values take 0.2 s on the
/// machine of docs/benchmarks.md.
const MOST: usize = 1_000_000;

/// The methods.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum MethodName {
    /// Newton's method, with the kind of linear step that suits the bodies, the memory and the number of ranks.
    #[default]
    Auto,
    /// The paper's iteration (41)-(42).
    Robin,
    /// Newton's method with linear steps by conjugate gradients over the sweep.
    NewtonRobin,
    /// Newton's method with one matrix of all bodies: dense, factorised, or solved by multigrid.
    Newton,
    /// The paper's iteration (34) with the form (35), one matrix of all bodies with the tangents at the iterate: for
    /// gamma = 1 the semismooth Newton method.
    Semismooth,
}

impl MethodName {
    /// Return the name in the scene.
    pub fn name(self) -> String {
        word(&self)
    }
}

/// The ways to solve the linear steps of Newton's method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
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
    /// Return the name in the scene.
    pub fn name(self) -> String {
        word(&self)
    }
}

/// The relaxation gamma^k of iteration k.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(with = "Either<Field, Either<Vec<f64>, Rule>>")]
#[serde(rename_all = "kebab-case")]
pub enum Gamma {
    /// Exact line search on the functional F1.
    LineSearch,
    /// Aitken's rule.
    Aitken,
    /// The rule of this name from a Rust program ([`Scene::rule`](crate::scene::Scene::rule)).
    Own(String),
    /// The same number > 0 in every iteration.
    #[serde(untagged)]
    Stationary(f64),
    /// Numbers > 0 for k = 0, 1, ...; the last one is kept.
    #[serde(untagged)]
    Schedule(Vec<f64>),
    /// An expression in k = 0, 1, ... with values > 0.
    #[serde(untagged)]
    Expression(Field),
}

impl Default for Gamma {
    fn default() -> Self {
        Self::Stationary(0.6)
    }
}

/// The start of the iteration, given on the contact surfaces.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Start {
    /// The solution with rigid bodies, each layer in series with a spring that stands for the surfaces of the two
    /// bodies.
    #[default]
    Auto,
    /// Zero normal displacement.
    Zero,
    /// Outer normal displacement on every contact surface.
    Normal(
        /// outer normal displacement on every contact surface
        Field,
    ),
}

/// The rule for the Robin coefficient kappa on the zone. p is the law of the layer and c^k the compression at iterate
/// k.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum RobinRule {
    /// kappa = p'(c^k), as in the paper.
    Tangent,
    /// The coefficient of the start in every iteration, made safe as in `Auto`. It needs one factorisation in a run.
    /// Theorem 3 allows it.
    Frozen,
    /// kappa = max(p'(c^k), F) everywhere on the contact surfaces; F > 0 is this number.
    Floor(
        /// least coefficient everywhere on the contact
        f64,
    ),
    /// The tangent on the zone, and more for a body that the tangent does not constrain safely.
    #[default]
    Auto,
}

/// The Robin zone: psi of (38), a characteristic function of a part of the contact surfaces. c is the compression of
/// the layer.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
#[schemars(with = "Either<String, Vec<String>>")]
#[serde(rename_all = "lowercase")]
pub enum Zone {
    /// psi = 0: Neumann-Neumann.
    None,
    /// psi = 1: full Robin.
    Full,
    /// psi = chi = \[c > 0\], equation (36).
    #[default]
    Active,
    /// psi = 1 where the expression in x, y, z and the iteration k = 0, 1, ... is > 0 (true is 1).
    #[serde(untagged, serialize_with = "as_text")]
    Subset(Field),
    /// psi_ab and psi_ba: a zone for each side of a pair, in the order of `between`.
    #[serde(untagged)]
    Sides(Box<[Zone; 2]>),
}

/// The rules that stop a run. At least one of `residual` and `increment` is given. The first rule that is met ends the
/// run.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StopRule {
    /// relative residual, or error of Newton's method; 1e-8 if `increment` is not given
    ///
    /// Tolerance of the relative residual of sweeps, or of the largest relative error of Newton's method
    /// (docs/theory.md).
    pub residual: Option<f64>,
    /// the paper's rule on the increment
    ///
    /// Tolerance of the relative increment of normal displacements, in every body.
    pub increment: Option<f64>,
    /// most iterations
    #[serde(default = "iterations")]
    #[schemars(range(min = 1))]
    pub iterations: usize,
}

/// Tolerance of the residual without a rule: half of the digits of a double, which tables of eight digits show.
const TOLERANCE: f64 = 1e-8;

fn iterations() -> usize {
    2000
}

impl Default for StopRule {
    fn default() -> Self {
        Self { residual: Some(TOLERANCE), increment: None, iterations: iterations() }
    }
}

impl StopRule {
    /// Return the tolerance that relative errors inside a run refer to. It is that of the residual, or the square root
    /// of machine epsilon where the increment alone ends the run.
    pub fn tolerance(&self) -> f64 {
        self.residual.unwrap_or(f64::EPSILON.sqrt())
    }

    /// Return whether an iterate meets a rule. `residual` and `increment` are relative; the increment is NaN before the
    /// first update.
    pub fn is_met(&self, residual: f64, increment: f64) -> bool {
        self.residual.is_some_and(|tolerance| residual <= tolerance)
            || self.increment.is_some_and(|tolerance| increment <= tolerance)
    }
}

impl Check for StopRule {
    fn check(&self, _: Geometry) -> Result<(), Fault> {
        at_least_one("iterations", self.iterations)?;
        if self.residual.or(self.increment).is_none() {
            return Err(Fault::new("", "a stop rule has a tolerance", "", "stop = { residual = 1e-8 }"));
        }
        for (key, tolerance) in [("residual", self.residual), ("increment", self.increment)] {
            tolerance.map_or(Ok(()), |tolerance| positive(key, "the tolerance", tolerance))?;
        }
        Ok(())
    }
}

/// The inner solver that the scene requests, a word or a table. PETSc options override it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(with = "Either<Preset, SolverKeys>")]
pub struct SolverSpec {
    /// The preset; the program chooses if `None`.
    pub preset: Option<Preset>,
}

/// The keys of `[solver]`.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SolverKeys {
    /// the inner solver of all bodies
    preset: Option<Preset>,
}

/// The presets of inner solvers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// Sparse Cholesky factorisation by MUMPS.
    Mumps,
    /// Interior dofs eliminated once by MUMPS, and a dense system on the contact in each sweep.
    Condensed,
    /// Conjugate gradients preconditioned by hypre's BoomerAMG.
    Hypre,
    /// Conjugate gradients preconditioned by PETSc's GAMG.
    Gamg,
    /// Conjugate gradients preconditioned by an incomplete Cholesky factorisation.
    Icc,
}

impl Preset {
    /// All presets.
    pub const ALL: [Self; 5] = [Self::Mumps, Self::Condensed, Self::Hypre, Self::Gamg, Self::Icc];

    /// Return the name in the scene.
    pub fn name(self) -> String {
        word(&self)
    }
}

impl<'de> Deserialize<'de> for SolverSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Located { value, place } = Located::<Form<IgnoredAny, SolverKeys>>::deserialize(deserializer)?;
        match value {
            Form::Text(word) => of_word(&word).map(|preset| Self { preset: Some(preset) }),
            Form::Table(SolverKeys { preset }) => Ok(Self { preset }),
            other => Err(other.instead_of("a string or a table", &place)),
        }
    }
}

/// The rules for gamma by name.
#[derive(Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Rule {
    LineSearch,
    Aitken,
}

impl<'de> Deserialize<'de> for Gamma {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Located { value, place } = Located::<Form<f64>>::deserialize(deserializer)?;
        match value {
            Form::Integer(gamma) => Ok(Self::Stationary(gamma as f64)),
            Form::Number(gamma) => Ok(Self::Stationary(gamma)),
            Form::List(list) => Ok(Self::Schedule(list)),
            Form::Text(text) if is_word(&text) => of_word(&text).map(|rule| match rule {
                Rule::LineSearch => Self::LineSearch,
                Rule::Aitken => Self::Aitken,
            }),
            Form::Text(text) => Ok(Self::Expression(Field::Expression(Expression::uncompiled(&text, place)))),
            other => Err(other.instead_of("a number, an expression, a word or a list", &place)),
        }
    }
}

/// Return whether a text is meant as one of some words: a word of more than two letters is no variable.
fn is_word(text: &str) -> bool {
    text.len() > 2 && text.chars().all(|c| c.is_alphabetic() || c == '-')
}

/// A word, a condition as a text, or a list of these for both sides.
impl<'de> Deserialize<'de> for Zone {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Located { value, place } = Located::<Form<Zone>>::deserialize(deserializer)?;
        let text = match value {
            Form::Text(text) => text,
            Form::List(zones) => match <[Zone; 2]>::try_from(zones) {
                Ok(zones) if !zones.iter().any(|zone| matches!(zone, Self::Sides(_))) => {
                    return Ok(Self::Sides(Box::new(zones)));
                }
                _ => {
                    let error = Error::scene(&place, "a list of zones has one for each of the two sides");
                    return Err(refused(
                        error.help("psi = [\"active\", \"none\"]: the first is that of the first surface of `between`"),
                    ));
                }
            },
            other => return Err(other.instead_of("a string or a list of two", &place)),
        };
        match text.as_str() {
            "none" => return Ok(Self::None),
            "full" => return Ok(Self::Full),
            "active" => return Ok(Self::Active),
            _ => {}
        }
        if is_word(&text) {
            let otherwise = || "psi is none, full, active, or a condition such as \"x > 1 && k < 5\"".to_owned();
            let error = Error::scene(&place, format!("unknown zone `{text}`"));
            return Err(refused(error.suggest(&text, ["none", "full", "active"], otherwise)));
        }
        Ok(Self::Subset(Field::Expression(Expression::uncompiled(&text, place))))
    }
}

/// Write a condition as a text, as the key takes no number.
fn as_text<S: Serializer>(condition: &Field, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&condition.text())
}
