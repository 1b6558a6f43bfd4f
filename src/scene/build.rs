//! A scene built in Rust.

use super::Scene;
use crate::contact::law::LayerLaw;
use crate::ddm::gamma::GammaRule;
use crate::error::{Located, Place};
use crate::problem::{BodySpec, ContactSpec, MeshSource, MethodSpec};
use std::rc::Rc;

impl Scene {
    /// Return a scene without bodies, in the plane (`dimension` 2, plane strain) or in space (3), solved by Newton's method. Settings
    /// without a method of their own are fields of the scene.
    #[track_caller]
    pub fn new(dimension: usize, mesh: impl Into<MeshSource>) -> Self {
        let place = Place::here(&dimension.to_string());
        let path = place.source.name.clone().into();
        Self::with_defaults(mesh.into(), Vec::new(), path, "scene".to_owned(), Located::new(dimension, place))
    }

    /// Add a body.
    pub fn body(mut self, body: BodySpec) -> Self {
        self.bodies.push(body);
        self
    }

    /// Add a pair of contact surfaces.
    pub fn contact(mut self, contact: ContactSpec) -> Self {
        self.contacts.push(ContactSpec { table: self.contacts.len(), ..contact });
        self
    }

    /// Set the outer iteration.
    pub fn method(self, method: MethodSpec) -> Self {
        Self { method, ..self }
    }

    /// Add a law of a layer, which [`LayerSpec::Own`](crate::problem::layer::LayerSpec::Own) uses by its name. `maker` gets the contact
    /// points (x, y, z) of a pair and returns the law for all of them. The law is checked at the first point: it must increase, and have
    /// its derivative and its integral.
    pub fn law<L: LayerLaw + 'static>(mut self, name: &str, maker: impl Fn(&[[f64; 3]]) -> L + 'static) -> Self {
        self.laws.insert(name, Rc::new(move |points: &[[f64; 3]]| Box::new(maker(points)) as _));
        self
    }

    /// Add a rule for gamma, which [`Gamma::Own`](crate::problem::method::Gamma::Own) uses by its name. `maker` returns a new rule for
    /// each run.
    pub fn rule<R: GammaRule + 'static>(mut self, name: &str, maker: impl Fn() -> R + 'static) -> Self {
        self.rules.insert(name, Rc::new(move || Box::new(maker()) as _));
        self
    }
}
