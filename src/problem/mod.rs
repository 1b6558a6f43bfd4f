//! What is to be solved, and how, as plain data: bodies, contacts, layers, and methods and solvers by name.
//!
//! A key of the scene is a field: its type, its default, and its doc comment, whose first paragraph is shown in
//! refusals and in the JSON schema. serde reads and writes the structs, schemars describes them. Tables whose keys
//! exclude each other have a struct of keys (`...Keys`) and become an enum. What serde has read is completed once the
//! whole scene is known ([`Compile`](compile::Compile)). Values that are impossible or contradict each other are
//! refused beside their struct ([`Check`](check::Check)), for scenes from files and from Rust alike.
//!
//! Names of groups keep the place where they were written ([`Located`](crate::error::Located)): the mesh is read later,
//! and a refusal of a group that it does not have points there.

pub mod body;
pub mod check;
pub mod compile;
pub mod contact;
pub mod data;
pub mod elasticity;
pub mod geometry;
pub mod history;
pub mod layer;
pub mod load;
pub mod mesh;
pub mod method;
pub mod order;
pub mod pattern;
pub mod read;
pub mod units;

pub use body::BodySpec;
pub use contact::{ContactSpec, Overlap};
pub use elasticity::{AxesSpec, Constants, ElasticitySpec, Orthotropic, RegionSpec};
pub use geometry::Plane;
pub use history::{History, LoadStep};
pub use layer::LayerSpec;
pub use load::{Load, LoadKind, SpringSpec, Support};
pub use mesh::{GmshSource, GroupArrays, Guard, MeshArrays, MeshSource};
pub use method::{Gamma, Linear, MethodName, MethodSpec, Preset, RobinRule, SolverSpec, Start, StopRule, Zone};
pub use order::Order;
pub use read::{OneOrVector, Vector};
pub use units::{Units, label};

use crate::error::{Error, Kind, Result};
use std::collections::BTreeMap;
use std::fmt;
use std::rc::Rc;

/// The laws or rules of a Rust program, by name.
pub struct Own<T: ?Sized>(BTreeMap<String, Rc<T>>);

impl<T: ?Sized> Own<T> {
    /// Add a law or rule; it replaces an earlier one of the same name.
    pub fn insert(&mut self, name: &str, own: Rc<T>) {
        self.0.insert(name.to_owned(), own);
    }

    /// Return the law or rule of a name; `what` says in the message which of the two it is.
    pub fn get(&self, what: &str, name: &str) -> Result<&T> {
        self.0.get(name).map(|own| &**own).ok_or_else(|| {
            let error = Error::new(Kind::Scene, format!("no {what} is called `{name}`"));
            let known = self.0.keys().map(String::as_str);
            error.suggest(name, known, || format!("give the scene a {what} of this name"))
        })
    }
}

impl<T: ?Sized> Default for Own<T> {
    fn default() -> Self {
        Self(BTreeMap::new())
    }
}

impl<T: ?Sized> Clone for Own<T> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<T: ?Sized> fmt::Debug for Own<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.0.keys()).finish()
    }
}
