//! What is to be solved, and how, as plain data: bodies, contacts, layers, and methods and solvers by name.
//!
//! Names of groups keep the place where they were written ([`Located`](crate::error::Located)): the mesh is read later, and a refusal of
//! a group that it does not have points there.

pub mod body;
pub mod contact;
pub mod elasticity;
pub mod history;
pub(crate) mod keys;
pub mod layer;
pub mod mesh;
pub mod method;
pub mod order;
pub mod own;
pub mod pattern;
pub mod robin;
pub mod solver;
pub mod stop;
pub mod units;

pub use body::{BodySpec, Load, LoadKind, SpringKind, SpringSpec, Support};
pub use contact::{AutoContact, ContactSpec, Overlap};
pub use elasticity::{AxesSpec, Constants, ElasticitySpec, Plane, RegionSpec};
pub use history::History;
pub use layer::{AsperitySpec, Depths, LawForm, LawKind, LayerSpec};
pub use mesh::{GroupArrays, Guard, MeshArrays, MeshSource};
pub use method::{Gamma, Linear, MethodName, MethodSpec, Start};
pub use order::Order;
pub use own::Own;
pub use robin::{RobinRule, Zone};
pub use solver::{Preset, SolverSpec};
pub use stop::StopRule;
pub use units::{Units, force_labels, label};

/// Return the name of a choice in a list of choices; empty if the list does not have it.
pub fn name_of<T: PartialEq>(choices: &[(&'static str, T)], choice: &T) -> &'static str {
    choices.iter().find(|(_, known)| known == choice).map_or("", |(name, _)| name)
}
