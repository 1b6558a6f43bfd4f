//! A scene built in Rust: constructors, and the checks that a scene file has while it is read.

use super::{OutputSpec, Scene};
use crate::contact::law::LayerLaw;
use crate::data::Library;
use crate::ddm::gamma::GammaRule;
use crate::error::{Error, Kind, Located, Place, Result, shown};
use crate::problem::body::{BodySpec, LoadKind, SPELLING, fault, is_in_name};
use crate::problem::contact::ContactSpec;
use crate::problem::elasticity::Plane;
use crate::problem::layer::{Depths, LayerSpec};
use crate::problem::mesh::MeshSource;
use crate::problem::method::{Gamma, MethodName, MethodSpec, Start};
use crate::problem::own::Own;
use crate::problem::pattern::is_pattern;
use crate::problem::robin::RobinRule;
use crate::problem::solver::SolverSpec;
use std::collections::HashSet;
use std::rc::Rc;

impl Scene {
    /// A scene without bodies, in the plane (`dimension` 2, plane strain) or in space (3), solved by Newton's method. What has no verb
    /// here is set in the fields.
    #[track_caller]
    pub fn new(dimension: usize, mesh: impl Into<MeshSource>) -> Self {
        let place = Place::here(&dimension.to_string());
        Self {
            path: place.source.name.clone().into(),
            title: "scene".to_owned(),
            dimension: Located::new(dimension, place),
            plane: Plane::Strain,
            units: None,
            mesh: mesh.into(),
            laws: Own::default(),
            rules: Own::default(),
            data: Library::new(),
            bodies: Vec::new(),
            contacts: Vec::new(),
            auto: Vec::new(),
            method: MethodSpec::default(),
            solver: SolverSpec::default(),
            estimate: false,
            adapt: None,
            output: OutputSpec::default(),
        }
    }

    /// With one more body.
    pub fn body(mut self, body: BodySpec) -> Self {
        self.bodies.push(body);
        self
    }

    /// With one more pair of contact surfaces.
    pub fn contact(mut self, contact: ContactSpec) -> Self {
        self.contacts.push(ContactSpec { table: self.contacts.len(), ..contact });
        self
    }

    /// With this outer iteration.
    pub fn method(self, method: MethodSpec) -> Self {
        Self { method, ..self }
    }

    /// With a law for [`LayerSpec::Own`] of this name. `maker` gets the contact points of a pair (x, y, z) and gives the law of all of
    /// them, which is checked at the first: increasing, with its derivative and its integral.
    pub fn law<L: LayerLaw + 'static>(mut self, name: &str, maker: impl Fn(&[[f64; 3]]) -> L + 'static) -> Self {
        self.laws.insert(name, Rc::new(move |points: &[[f64; 3]]| Box::new(maker(points)) as _));
        self
    }

    /// With a rule for [`Gamma::Own`] of this name; `maker` gives a new one for each run.
    pub fn rule<R: GammaRule + 'static>(mut self, name: &str, maker: impl Fn() -> R + 'static) -> Self {
        self.rules.insert(name, Rc::new(move || Box::new(maker()) as _));
        self
    }

    /// Checks what no later stage checks: numbers that are not fields, names, and what contradicts itself.
    ///
    /// # Errors
    /// The first refusal, with the line of the program where the body, surface or group was named.
    pub fn check(&self) -> Result<()> {
        let of_scene = |message: &str| Err(Error::scene(&self.dimension.place, message));
        let dimension = self.dimension.value;
        if !matches!(dimension, 2 | 3) || (dimension == 3 && self.plane != Plane::Strain) {
            return of_scene("the dimension is 2 or 3, and only plane problems have a `plane`");
        }
        if self.adapt.is_some() || matches!(self.method.start, Start::Nested) {
            return of_scene("several meshes for one scene: only the command line makes them");
        }
        if self.bodies.is_empty() {
            return of_scene("the scene has no body");
        }
        let mut names = HashSet::new();
        for body in &self.bodies {
            if !names.insert(&body.name.value) {
                let message = format!("two bodies are called `{}`", body.name.value);
                return Err(Error::scene(&body.name.place, message));
            }
            self.check_body(body)?;
        }
        let mut pairs = HashSet::new();
        for contact in &self.contacts {
            let [a, b] = contact.between.each_ref().map(|name| &name.value);
            if a == b || !pairs.insert([a.min(b), a.max(b)]) {
                let message = format!("a contact of `{a}` and `{b}`: the same surface, or the same pair, twice");
                return Err(Error::scene(&contact.between[1].place, message));
            }
        }
        for contact in self.contacts.iter().chain(self.auto.iter().map(|auto| &auto.contact)) {
            let because = |error: Error| error.at(&contact.between[0].place);
            check_contact(contact).map_err(because)?;
        }
        self.auto.iter().try_for_each(|auto| positive("the distance of `auto`", auto.distance))?;
        check_method(&self.method)
    }

    fn check_body(&self, body: &BodySpec) -> Result<()> {
        let name = &body.name.value;
        let fault = match is_pattern(name) {
            true => name.chars().any(|c| !is_in_name(c) && !"*?[]!-".contains(c)).then_some(SPELLING),
            false => fault(name),
        };
        if let Some([label, help]) = fault {
            let message = format!("`{name}` cannot be the name of a body");
            return Err(Error::scene(&body.name.place, message).label(label).help(help));
        }
        let is_plane = self.dimension.value == 2;
        if is_plane && body.force.as_ref().is_some_and(|force| !force[2].is_zero()) {
            return Err(Error::scene(&body.name.place, "a body force in z in a plane problem"));
        }
        for support in &body.fix {
            let held = support.value.iter().filter(|value| value.is_some()).count();
            if held + usize::from(support.normal.is_some()) == 0 || (held > 0 && support.normal.is_some()) {
                let message = "a support holds some components, or the normal alone";
                return Err(Error::scene(&support.on.place, message));
            }
            if is_plane && support.value[2].is_some() {
                return Err(Error::scene(&support.on.place, "a support in z in a plane problem"));
            }
        }
        for load in &body.load {
            let across = match &load.kind {
                LoadKind::Pressure(_) => false,
                LoadKind::Traction(traction) => !traction[2].is_zero(),
                LoadKind::Force { total, .. } => total[2] != 0.0,
            };
            if is_plane && across {
                return Err(Error::scene(&load.on.place, "a load in z in a plane problem"));
            }
            let LoadKind::Force { total, .. } = load.kind else { continue };
            if total.iter().any(|force| !force.is_finite()) {
                return Err(Error::scene(&load.on.place, format!("the force is {total:?}")));
            }
            if self.plane == Plane::Axisymmetric && total[0] != 0.0 {
                let message = "a total force across the axis of bodies of revolution: radial forces cancel";
                return Err(Error::scene(&load.on.place, message));
            }
        }
        Ok(())
    }
}

/// Refuses a number that is not finite and > 0.
fn positive(what: &str, value: f64) -> Result<()> {
    let refuse = || Error::new(Kind::Scene, format!("{what} is {}, not a number > 0", shown(value)));
    if value > 0.0 && value.is_finite() { Ok(()) } else { Err(refuse()) }
}

fn check_contact(contact: &ContactSpec) -> Result<()> {
    if !(contact.angle > 0.0 && contact.angle <= 90.0) {
        let message = format!("the angle is {} degrees, not above 0 and at most 90", shown(contact.angle));
        return Err(Error::new(Kind::Scene, message));
    }
    match &contact.layer {
        LayerSpec::Table(points) => {
            positive("the number of points of the law", points.len() as f64)?;
            let from_zero = std::iter::once(&[0.0; 2]).chain(points);
            from_zero.zip(points).try_for_each(|(before, point)| {
                (0..2).try_for_each(|k| positive("an increase of the table of the law", point[k] - before[k]))
            })
        }
        LayerSpec::Asperities(spec) => {
            let numbers = [("density", spec.density), ("radius", spec.radius), ("modulus", spec.modulus)];
            let mut numbers = numbers.to_vec();
            if let Depths::Normal { deviation, highest } = spec.depths {
                numbers.extend([("deviation", deviation), ("highest summit", highest)]);
            }
            numbers.iter().try_for_each(|(what, value)| positive(what, *value))
        }
        _ => Ok(()),
    }
}

fn check_method(method: &MethodSpec) -> Result<()> {
    let refuse = |message: &str| Err(Error::new(Kind::Scene, message));
    match &method.gamma {
        Gamma::Stationary(gamma) => positive("gamma", *gamma)?,
        Gamma::Schedule(list) if list.is_empty() => return refuse("the schedule of gamma has no value"),
        Gamma::Schedule(list) => list.iter().try_for_each(|gamma| positive("gamma", *gamma))?,
        _ => {}
    }
    if let RobinRule::Floor(floor) = method.robin {
        positive("the floor of the Robin coefficient", floor)?;
    }
    if !(1..=50).contains(&method.depth) {
        return refuse("the depth must lie between 1 and 50");
    }
    if method.linear.is_some() && !matches!(method.name, MethodName::Auto | MethodName::Newton) {
        return refuse("only Newton's method has linear steps of all bodies");
    }
    if method.interval && method.name != MethodName::Robin {
        return refuse("only the method `robin` has an interval of gamma");
    }
    // tables come from files, which were checked
    let steps = if method.steps.is_table() { &[] } else { &method.steps.steps[..] };
    steps.iter().flat_map(|step| &step.factors).try_for_each(|share| positive("a share of the loads", *share))?;
    if steps.last().is_some_and(|last| last.factors != [1.0]) {
        return refuse("the last load step is not the full load");
    }
    let stop = &method.stop;
    if stop.iterations == 0 || stop.residual.or(stop.increment).is_none() {
        return refuse("a stop rule has a tolerance, and at least one iteration");
    }
    stop.residual.iter().chain(&stop.increment).try_for_each(|tolerance| positive("a tolerance of `stop`", *tolerance))
}
