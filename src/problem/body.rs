//! Bodies: their elements, supports, springs and loads.

use super::elasticity::{ElasticitySpec, RegionSpec};
use super::order::Order;
use crate::error::Located;
use crate::expression::{Differentiable, Field};

/// A body: a named group of cells, its elasticity, supports and loads.
#[derive(Debug, Clone)]
pub struct BodySpec {
    /// Name of the physical group of cells; `[a-z][a-z0-9]*`, no PETSc family word (it is an option prefix).
    pub name: Located<String>,
    /// What it is made of.
    pub elasticity: ElasticitySpec,
    /// Parts of it that are made of something else.
    pub regions: Vec<RegionSpec>,
    /// Polynomial order.
    pub order: Order,
    /// Supports: prescribed displacement components on named groups.
    pub fix: Vec<Support>,
    /// Loads on named groups.
    pub load: Vec<Load>,
    /// Springs to the ground on named groups.
    pub spring: Vec<SpringSpec>,
    /// Body force density (x, y, z), if any.
    pub force: Option<[Field; 3]>,
    /// A known displacement to compare with, if any: as many components as the scene has dimensions, of x, y (z).
    pub exact: Option<Vec<Differentiable>>,
}

/// Prescribed displacement components on a named group (a boundary, or points).
#[derive(Debug, Clone)]
pub struct Support {
    /// The physical group.
    pub on: Located<String>,
    /// Prescribed value of each component; `None` leaves it free.
    pub value: [Option<Field>; 3],
    /// Prescribed displacement along the outer normal of a plane surface.
    pub normal: Option<Field>,
}

/// Springs to the ground on a named boundary (per area) or at points.
#[derive(Debug, Clone)]
pub struct SpringSpec {
    /// The physical group.
    pub on: Located<String>,
    /// How stiff they are.
    pub kind: SpringKind,
}

/// Kinds of springs; stiffnesses are >= 0.
#[derive(Debug, Clone)]
pub enum SpringKind {
    /// Stiffness along x, y, z.
    Vector([Field; 3]),
    /// Stiffness along the normal of the surface.
    Normal(Field),
}

/// A load on a named boundary.
#[derive(Debug, Clone)]
pub struct Load {
    /// The physical group.
    pub on: Located<String>,
    /// What acts there.
    pub kind: LoadKind,
}

/// Kinds of boundary load.
#[derive(Debug, Clone)]
pub enum LoadKind {
    /// Pressure against the outer normal, > 0 pushes.
    Pressure(Field),
    /// Traction vector (x, y, z).
    Traction([Field; 3]),
    /// Force on the whole boundary.
    Force {
        /// The force (x, y, z).
        total: [f64; 3],
        /// Whether the boundary moves as one, by a translation; else the force is spread evenly.
        rigid: bool,
    },
}
