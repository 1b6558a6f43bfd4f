//! The kind of problem: space dimension, and what a plane problem stands for.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a plane problem stands for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Plane {
    /// No out-of-plane strain.
    #[default]
    Strain,
    /// No out-of-plane stress.
    Stress,
    /// A meridian of bodies of revolution: x is the radius, y runs along the axis.
    Axisymmetric,
}

/// Space dimension, 2 or 3, and what a plane problem stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Geometry {
    /// Space dimension.
    pub dimension: usize,
    /// What a plane problem stands for.
    pub plane: Plane,
}

impl Geometry {
    /// Return whether the problem is one in the plane.
    pub fn is_plane(self) -> bool {
        self.dimension == 2
    }
}
