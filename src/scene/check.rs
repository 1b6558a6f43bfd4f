//! What every scene must satisfy, whether it was read from a file or built in Rust. Each check is made once, here.
//!
//! A refusal names the key that it is about, as `--set` has it. For a scene file, [`load`](super::load) then points at the value of that
//! key; for a scene built in Rust, the refusal points at the line that named the body, surface or group.

use super::Scene;
use crate::error::{Error, Place, Result, shown};
use crate::expression::Field;
use crate::problem::body::{SPELLING, fault, is_in_name};
use crate::problem::pattern::is_pattern;
use crate::problem::{
    AutoContact, BodySpec, Constants, ContactSpec, ElasticitySpec, Gamma, LayerSpec, Load, LoadKind, MeshSource,
    MethodName, MethodSpec, Plane, RobinRule, SpringKind, SpringSpec, StopRule, Support,
};
use std::collections::HashSet;
use std::fmt::Display;

/// A refusal and the key that it is about.
pub(super) struct Refusal {
    /// Dotted path of the key.
    pub key: String,
    /// The refusal, which points at the nearest line of a Rust program.
    pub error: Error,
}

type CheckResult = Result<(), Refusal>;

/// The key whose value is being checked.
struct CheckedKey<'a> {
    /// Dotted path of the key.
    key: String,
    /// Place of the nearest name that a Rust program gives.
    near: &'a Place,
}

impl<'a> CheckedKey<'a> {
    fn new(key: impl Into<String>, near: &'a Place) -> Self {
        Self { key: key.into(), near }
    }

    /// Return a key, or the number of an item, below this key.
    fn below(&self, key: impl Display) -> Self {
        Self { key: format!("{}.{key}", self.key), near: self.near }
    }

    /// Return item `number` of the list `list` below this key; `near` is the place of the item's name.
    fn item(&self, list: &str, number: usize, near: &'a Place) -> Self {
        Self { near, ..self.below(format_args!("{list}.{number}")) }
    }

    /// Return a refusal; `label` and `help` may be empty.
    fn refuse(&self, message: impl Into<String>, label: &str, help: &str) -> CheckResult {
        let error = Error::scene(self.near, message).label(label);
        Err(Refusal { key: self.key.clone(), error: if help.is_empty() { error } else { error.help(help) } })
    }

    /// Refuse a number that is not finite and > 0.
    fn positive(&self, what: &str, value: f64) -> CheckResult {
        match value > 0.0 && value.is_finite() {
            true => Ok(()),
            false => self.refuse(format!("{what} is {}", shown(value)), "must be greater than 0", ""),
        }
    }

    /// Refuse the number of a key below if it is not finite and > 0.
    fn positive_in(&self, key: &str, what: &str, value: f64) -> CheckResult {
        self.below(key).positive(what, value)
    }

    /// Refuse what cannot be the name of a body, or a pattern of such names.
    fn name(&self, name: &str) -> CheckResult {
        let fault = match is_pattern(name) {
            true => name.chars().any(|c| !is_in_name(c) && !"*?[]!-".contains(c)).then_some(SPELLING),
            false => fault(name),
        };
        fault.map_or(Ok(()), |[label, help]| self.refuse(format!("`{name}` cannot be the name of a body"), label, help))
    }
}

impl Scene {
    /// Check what no later stage checks: numbers that are not fields, names, and keys that contradict each other.
    ///
    /// # Errors
    /// The first refusal, with the line of the program where the body, surface or group was named.
    pub fn check(&self) -> Result<()> {
        if self.adapt.is_some() {
            let message = "several meshes for one scene: only the command line makes them";
            return Err(Error::scene(&self.dimension.place, message));
        }
        self.verify().map_err(|refusal| refusal.error)
    }

    /// Check the whole scene. A new check stands in the function of its table.
    pub(super) fn verify(&self) -> CheckResult {
        let at = |key: &str| CheckedKey::new(key, &self.dimension.place);
        self.check_dimension(&at("dimension"))?;
        check_mesh(&at("mesh"), &self.mesh)?;
        self.check_bodies(&at("body"))?;
        check_pairs(&self.contacts)?;
        check_rules(&self.auto)?;
        for contact in self.contacts.iter().chain(self.auto.iter().map(|auto| &auto.contact)) {
            check_contact(&at_contact(contact), contact)?;
            self.check_rigid(&at_contact(contact), contact)?;
        }
        check_method(&at("method"), &self.method)?;
        self.check_adapt(&at("adapt"))
    }

    fn is_plane(&self) -> bool {
        self.dimension.value == 2
    }

    fn check_dimension(&self, at: &CheckedKey) -> CheckResult {
        let is_known = self.is_plane() || (self.dimension.value == 3 && self.plane == Plane::Strain);
        match is_known {
            true => Ok(()),
            false => at.refuse("the dimension is 2 or 3, and only plane problems have a `plane`", "", ""),
        }
    }

    fn check_bodies(&self, at: &CheckedKey) -> CheckResult {
        if self.bodies.is_empty() {
            return at.refuse("the scene has no body", "", "a body starts with the line [[body]]");
        }
        let mut names = HashSet::new();
        for (number, body) in self.bodies.iter().enumerate() {
            let at = CheckedKey { near: &body.name.place, ..at.below(number) };
            let name = &body.name.value;
            if !names.insert(name) {
                let help = "names of bodies are those of physical groups of cells, one for each";
                let message = format!("two bodies are called `{name}`");
                return at.below("name").refuse(message, "taken by an earlier body", help);
            }
            at.below("name").name(name)?;
            self.check_body(&at, body)?;
        }
        Ok(())
    }

    fn check_body(&self, at: &CheckedKey, body: &BodySpec) -> CheckResult {
        check_elasticity(at, &body.elasticity)?;
        for (number, region) in body.regions.iter().enumerate() {
            check_elasticity(&at.item("region", number, &region.on.place), &region.elasticity)?;
        }
        if self.is_plane() && body.force.as_ref().is_some_and(|force| !force[2].is_zero()) {
            return at.below("force").refuse("a body force in z in a plane problem", "", "");
        }
        self.check_lines(at, body)
    }

    /// Check the forces and motions of obstacles and offsets.
    fn check_rigid(&self, at: &CheckedKey, contact: &ContactSpec) -> CheckResult {
        let ContactSpec { obstacle, approach, tilt, force, moment, preload, .. } = contact;
        let turns = [("tilt", tilt), ("moment", moment)];
        let given = [
            ("approach", approach.is_some()),
            ("tilt", tilt.is_some()),
            ("moment", moment.is_some()),
            ("at", contact.at.is_some()),
        ];
        if let (false, Some((key, _))) = (obstacle, given.iter().find(|(_, given)| *given)) {
            let help = "on = \"top\", obstacle = true";
            return at.below(key).refuse(format!("`{key}` of a contact without an obstacle"), "", help);
        }
        if let (Some((key, _)), true) =
            (turns.iter().find(|(_, turn)| turn.is_some()), self.plane == Plane::Axisymmetric)
        {
            return at.below(key).refuse(
                "an obstacle that turns in an axisymmetric scene",
                "it moves along the axis alone",
                "",
            );
        }
        let numbers = [("approach", approach), ("force", force), ("preload", preload)];
        let all = numbers.into_iter().filter_map(|(key, value)| Some((key, value.as_ref().copied()?)));
        let all = all.chain(
            turns
                .into_iter()
                .flat_map(|(key, turn)| turn.iter().flat_map(move |turn| turn.0.map(|value| (key, value)))),
        );
        if let Some((key, value)) = all.clone().find(|(_, value)| !value.is_finite()) {
            return at.below(key).refuse(format!("`{key}` is {value}"), "", "");
        }
        if let Some((key, _)) =
            all.clone().find(|(key, value)| *value < 0.0 && (*key == "preload" || *key == "force" && !contact.bond))
        {
            let help = "a force > 0 presses; only a bonded pair can be pulled";
            return at.below(key).refuse(format!("a negative `{key}`"), "", help);
        }
        match &contact.path {
            Some(_) if all.count() == 0 => {
                at.below("path").refuse("`path` without a force or motion of this contact", "", "")
            }
            _ => Ok(()),
        }
    }

    fn check_adapt(&self, at: &CheckedKey) -> CheckResult {
        let Some(adapt) = &self.adapt else { return Ok(()) };
        let at = at.below("error");
        at.positive("the error", adapt.error.value)?;
        if adapt.error.value >= 1.0 {
            let message = format!("the error is {}", shown(adapt.error.value));
            return at.refuse(message, "must be less than 1", "it is a share: 0.01 is one per cent");
        }
        Ok(())
    }
}

fn check_mesh(at: &CheckedKey, mesh: &MeshSource) -> CheckResult {
    let MeshSource::Geo { guard, .. } = mesh else { return Ok(()) };
    at.positive_in("timeout", "the timeout", guard.seconds)?;
    guard.size.map_or(Ok(()), |size| at.positive_in("size", "the size", size))
}

fn check_elasticity(at: &CheckedKey, elasticity: &ElasticitySpec) -> CheckResult {
    let Constants::Isotropic { young, poisson } = &elasticity.constants else { return Ok(()) };
    if let Field::Constant(young) = young {
        at.positive_in("young", "Young's modulus", *young)?;
    }
    if let Field::Constant(value) = *poisson
        && !(value > -1.0 && value < 0.5)
    {
        let label = "must lie between -1 and 0.5";
        let help = "incompressible bodies are not possible; take 0.4999 and order = 2, say";
        let help = if value == 0.5 { help } else { "" };
        return at.below("poisson").refuse(format!("Poisson's ratio is {}", shown(value)), label, help);
    }
    match elasticity.axes {
        None => Ok(()),
        Some(_) => at.below("axes").refuse(
            "axes of an isotropic material",
            "all directions are alike",
            "remove them, or give orthotropic or anisotropic constants",
        ),
    }
}

/// Return the key of the table of a contact.
fn at_contact(contact: &ContactSpec) -> CheckedKey<'_> {
    CheckedKey::new(format!("contact.{}", contact.table), &contact.between[0].place)
}

/// Check pairs of surfaces that the scene names: two plain names each, and no pair twice.
fn check_pairs(contacts: &[ContactSpec]) -> CheckResult {
    let mut pairs = HashSet::new();
    for contact in contacts {
        let at = at_contact(contact).below("between");
        let [a, b] = contact.between.each_ref().map(|name| &name.value);
        if a == b {
            let help = "name one surface of each of two bodies";
            let second = CheckedKey { near: &contact.between[1].place, ..at.below(1) };
            return second.refuse(format!("a contact between `{b}` and itself"), "", help);
        }
        if !pairs.insert([a.min(b), a.max(b)]) {
            return at.below(0).refuse(format!("a second contact of `{a}` and `{b}`"), "", "remove one of the two");
        }
        if contact.preload.is_some() && contact.obstacle {
            return at_contact(contact).below("preload").refuse(
                "a preload of an obstacle",
                "",
                "it has a force in each load step: force = F",
            );
        }
        let is_plural = |name: &String| name.contains(['*', '?']);
        if let Some((side, name)) = [a, b].into_iter().enumerate().find(|(_, name)| is_plural(name)) {
            let help =
                "many pairs are found between bodies: between = \"auto\", of = [\"one_*\", \"other_*\"], distance = D";
            let message = format!("the pattern `{name}` for one surface");
            return at.below(side).refuse(message, "one name belongs here", help);
        }
    }
    Ok(())
}

/// Check rules that find pairs: no two are for the same names of bodies.
fn check_rules(rules: &[AutoContact]) -> CheckResult {
    let mut known = HashSet::new();
    for AutoContact { of, contact } in rules {
        let at = at_contact(contact);
        if let Some((key, _)) =
            [("force", contact.force), ("preload", contact.preload)].iter().find(|(_, value)| value.is_some())
        {
            return at.below(key).refuse(
                format!("`{key}` for pairs that are found"),
                "",
                "name the two surfaces: between = [\"one\", \"other\"]",
            );
        }
        let names = of.as_ref().map(|of| of.each_ref().map(|name| &name.value));
        for (side, name) in names.iter().flatten().enumerate() {
            at.below(format_args!("of.{side}")).name(name)?;
        }
        if known.insert(names.map(|[a, b]| [a.min(b), a.max(b)])) {
            continue;
        }
        return match names {
            None => at.refuse(
                "a second contact between \"auto\" of all bodies",
                "",
                "name the bodies of each: of = [\"one_*\", \"other_*\"]",
            ),
            Some([a, b]) => {
                let message = format!("a second contact between \"auto\" of `{a}` and `{b}`");
                at.below("of.0").refuse(message, "", "remove one of the two")
            }
        };
    }
    Ok(())
}

fn check_contact(at: &CheckedKey, contact: &ContactSpec) -> CheckResult {
    at.positive_in("angle", "the angle", contact.angle)?;
    if contact.angle > 90.0 {
        let message = format!("the angle is {} degrees", shown(contact.angle));
        return at.below("angle").refuse(message, "must be at most 90", "");
    }
    at.positive_in("edge", "the angle of edges", contact.edge)?;
    if contact.edge > 180.0 {
        let message = format!("the angle of edges is {} degrees", shown(contact.edge));
        return at.below("edge").refuse(message, "must be at most 180", "at 180 no surface is split");
    }
    if let Some(distance) = contact.distance {
        at.positive_in("distance", "the distance", distance)?;
    }
    if let (Some(tension), false) = (&contact.tension, contact.bond) {
        let help = "write bond = true, or leave `tension` away";
        check_layer(&at.below("tension"), tension)?;
        return at.below("tension").refuse("only a bonded layer has a law in tension", "", help);
    }
    contact.tension.as_ref().map_or(Ok(()), |tension| check_layer(&at.below("tension"), tension))?;
    check_layer(&at.below("layer"), &contact.layer)
}

fn check_layer(at: &CheckedKey, layer: &LayerSpec) -> CheckResult {
    match layer {
        LayerSpec::Form { form, values } => {
            for (parameter, value) in form.parameters.iter().zip(values) {
                let Field::Constant(value) = *value else { continue };
                let Some(breach) = parameter.bounds.breach(value) else { continue };
                let steep = "p(c) = (c/B)^(1/a) with a > 1 is infinitely stiff at first touch, p'(0) = infinity";
                let help = if breach == "must not exceed 1" { steep } else { "" };
                let at = at.below(format_args!("{}.{}", form.name, parameter.key));
                return at.refuse(format!("{} is {}", parameter.what, shown(value)), breach, help);
            }
            Ok(())
        }
        LayerSpec::Table(points) => check_table(&at.below("table"), points),
        LayerSpec::Pressure { up_to: Some(end), .. } => at.positive_in("up_to", "the end of the law", *end),
        LayerSpec::Pressure { .. } | LayerSpec::Own(_) => Ok(()),
    }
}

/// Check that compressions and pressures (c, p) increase from (0, 0).
fn check_table(at: &CheckedKey, points: &[[f64; 2]]) -> CheckResult {
    if points.is_empty() {
        return at.refuse("the table has no point", "", "write table = [[1e-5, 2], [2e-5, 10]]");
    }
    for (before, point) in std::iter::once(&[0.0; 2]).chain(points).zip(points) {
        for (k, what) in ["compression", "pressure"].into_iter().enumerate() {
            if point[k] <= before[k] || !point[k].is_finite() {
                let values = [point[k], before[k]].map(shown).join(" of the table does not exceed ");
                let help = "a layer's law increases from p(0) = 0";
                return at.refuse(format!("the {what} {values}"), "", help);
            }
        }
    }
    Ok(())
}

fn check_method(at: &CheckedKey, method: &MethodSpec) -> CheckResult {
    check_gamma(at, &method.gamma)?;
    if let RobinRule::Floor(floor) = method.robin {
        at.positive_in("robin.floor", "the floor", floor)?;
    }
    if method.linear.is_some() && !matches!(method.name, MethodName::Auto | MethodName::Newton) {
        let help = "name = \"newton\", or leave `linear` away";
        return at.below("linear").refuse("only Newton's method has linear steps of all bodies", "", help);
    }
    if method.interval && method.name != MethodName::Robin {
        let help = "name = \"robin\", or leave `interval` away";
        return at.below("interval").refuse("only the method `robin` has an interval of gamma", "", help);
    }
    check_steps(&at.below("steps"), method)?;
    check_stop(&at.below("stop"), &method.stop)
}

/// Check gamma; `at` is the method.
fn check_gamma(at: &CheckedKey, gamma: &Gamma) -> CheckResult {
    match gamma {
        Gamma::Stationary(gamma) => at.positive_in("gamma", "gamma", *gamma),
        Gamma::Schedule(list) if list.is_empty() => {
            let help = "write a number, a list of numbers, or the name of a rule";
            at.below("gamma").refuse("gamma has no value", "", help)
        }
        Gamma::Schedule(list) => {
            let one = |(k, gamma): (usize, &f64)| at.below(format_args!("gamma.{k}")).positive("gamma", *gamma);
            list.iter().enumerate().try_for_each(one)
        }
        _ => Ok(()),
    }
}

fn check_steps(at: &CheckedKey, method: &MethodSpec) -> CheckResult {
    // the numbers of a table were checked when its file was read
    if method.steps.is_table() {
        return Ok(());
    }
    for (k, step) in method.steps.steps.iter().enumerate() {
        let at = at.below(k);
        step.factors.iter().try_for_each(|factor| at.positive("the factor", *factor))?;
    }
    if method.steps.steps.last().is_some_and(|last| last.factors != [1.0]) {
        let help = "end the list with 1; a table may end anywhere: steps = { table = \"path.csv\" }";
        return at.refuse("the last load step is not the full load", "", help);
    }
    Ok(())
}

fn check_stop(at: &CheckedKey, stop: &StopRule) -> CheckResult {
    if stop.iterations == 0 || stop.residual.or(stop.increment).is_none() {
        return at.refuse("a stop rule has a tolerance, and at least one iteration", "", "");
    }
    for (key, tolerance) in [("residual", stop.residual), ("increment", stop.increment)] {
        tolerance.map_or(Ok(()), |tolerance| at.positive_in(key, "the tolerance", tolerance))?;
    }
    Ok(())
}

impl Scene {
    /// Check all lines of a body with supports, springs and loads.
    fn check_lines(&self, at: &CheckedKey, body: &BodySpec) -> CheckResult {
        for (number, support) in body.fix.iter().enumerate() {
            self.check_support(&at.item("fix", number, &support.on.place), support)?;
        }
        for (number, spring) in body.spring.iter().enumerate() {
            check_spring(&at.item("spring", number, &spring.on.place), spring)?;
        }
        for (number, load) in body.load.iter().enumerate() {
            self.check_load(&at.item("load", number, &load.on.place), load)?;
        }
        Ok(())
    }

    fn check_support(&self, at: &CheckedKey, support: &Support) -> CheckResult {
        let components = support.value.iter().flatten().count();
        if components > 0 && support.normal.is_some() {
            return at.refuse("a support holds some components, or the normal alone", "", "");
        }
        if self.is_plane() && support.value[2].is_some() {
            let help = "remove it, or set dimension = 3";
            return at.below("z").refuse("a support in `z` in a plane problem", "there is no z", help);
        }
        if components == 0 && support.normal.is_none() {
            let axes = if self.is_plane() { "x, y" } else { "x, y, z" };
            let help = format!("give the displacement in some of {axes}: x = 0; or symmetry = true");
            return at.refuse(format!("the support on `{}` holds no component", support.on.value), "", &help);
        }
        Ok(())
    }

    fn check_load(&self, at: &CheckedKey, load: &Load) -> CheckResult {
        let acts_along_z = match &load.kind {
            LoadKind::Pressure(_) | LoadKind::Moment(_) => false,
            LoadKind::Traction(traction) => !traction[2].is_zero(),
            LoadKind::Force { total, .. } | LoadKind::Turning { force: total, .. } => total[2] != 0.0,
        };
        if self.is_plane() && acts_along_z {
            return at.refuse("a load in z in a plane problem", "", "");
        }
        if let LoadKind::Moment(moment) | LoadKind::Turning { moment, .. } = load.kind {
            self.check_moment(&at.below("moment"), moment)?;
        }
        let (LoadKind::Force { total, .. } | LoadKind::Turning { force: total, .. }) = load.kind else { return Ok(()) };
        if total.iter().any(|force| !force.is_finite()) {
            return at.below("force").refuse(format!("the force is {total:?}"), "", "");
        }
        if self.plane == Plane::Axisymmetric && total[0] != 0.0 {
            return at.below("force").refuse(
                "a total force across the axis in an axisymmetric scene",
                "radial forces cancel all around: the first component must be 0",
                "for a radial load give pressure = p or traction = [tr, ta]",
            );
        }
        Ok(())
    }

    fn check_moment(&self, at: &CheckedKey, moment: [f64; 3]) -> CheckResult {
        if moment.iter().any(|component| !component.is_finite()) {
            return at.refuse(format!("the moment is {moment:?}"), "", "");
        }
        if self.is_plane() && [moment[0], moment[1]] != [0.0; 2] {
            return at.refuse("a moment about an axis in the plane", "bodies in the plane turn about z", "");
        }
        if self.plane == Plane::Axisymmetric {
            let help = "bodies of revolution do not bend; give a traction along the axis that depends on the radius";
            return at.refuse("a moment in an axisymmetric scene", "", help);
        }
        Ok(())
    }
}

fn check_spring(at: &CheckedKey, spring: &SpringSpec) -> CheckResult {
    // expressions are checked where they are evaluated; here they count as > 0
    let constant = |field: &Field| if let Field::Constant(value) = field { *value } else { f64::MIN_POSITIVE };
    match &spring.kind {
        SpringKind::Normal(k) => at.positive_in("normal", "the stiffness", constant(k)),
        SpringKind::Vector(all) if all.iter().all(Field::is_zero) => {
            let label = "some component must be greater than 0";
            at.below("stiffness").refuse("the spring has no stiffness", label, "")
        }
        SpringKind::Vector(all) => {
            let mut negative = all.iter().map(constant).filter(|value| *value < 0.0 || value.is_nan());
            negative.try_for_each(|value| at.positive_in("stiffness", "the stiffness", value))
        }
    }
}
