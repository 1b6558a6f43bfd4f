//! What is to be solved, and how, as plain data: bodies, contacts, layers, and methods and solvers by name. Each file declares the keys of its
//! structs; values with several forms and tables whose keys exclude each other are read and echoed there, too.
//!
//! Names of groups keep the place where they were written ([`Located`](crate::error::Located)): the mesh is read later, and a refusal of
//! a group that it does not have points there.

pub mod body;
pub mod contact;
pub mod elasticity;
pub mod history;
pub mod layer;
pub mod mesh;
pub mod method;
pub mod order;
pub mod pattern;
pub mod units;

pub use body::{BodySpec, Load, LoadKind, SpringKind, SpringSpec, Support};
pub use contact::{AutoContact, ContactSpec, Overlap};
pub use elasticity::{AxesSpec, Constants, ElasticitySpec, Plane, RegionSpec};
pub use history::{History, LoadStep};
pub use layer::{LawKind, LayerSpec};
pub use mesh::{GroupArrays, Guard, MeshArrays, MeshSource};
pub use method::{Gamma, Linear, MethodName, MethodSpec, Preset, RobinRule, SolverSpec, Start, StopRule, Zone};
pub use order::Order;
pub use units::{Units, force_labels, label};

use crate::error::{Error, Kind, Result};
use std::collections::BTreeMap;
use std::fmt;
use std::rc::Rc;

/// Return the name of a choice in a list of choices; empty if the list does not have it.
pub fn name_of<T: PartialEq>(choices: &[(&'static str, T)], choice: &T) -> &'static str {
    choices.iter().find(|(_, known)| known == choice).map_or("", |(name, _)| name)
}

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
