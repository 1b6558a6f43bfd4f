//! Finite elements on one body: P1 and P2 simplices, linear elasticity, assembly into sparse rows.
//!
//! Data flow: [`Mesh`](crate::mesh::Mesh) group -> [`Space`] -> [`assemble`] -> [`ElasticBody`] {K, f, supports}. Afterwards
//! [`stress`] recovers nodal stresses from displacements. Degrees of freedom are numbered `D * node + component`.

pub mod assemble;
pub mod elasticity;
pub mod element;
pub mod extent;
pub mod facets;
pub mod forces;
pub mod frame;
pub mod internal;
pub mod interpolation;
pub mod lever;
pub mod material;
pub mod norms;
pub mod quadrature;
pub mod recovery;
pub mod rigid;
#[cfg(test)]
pub mod sample;
pub mod slope;
pub mod space;
pub mod strain;
pub mod stress;
mod support;
pub mod surface;
#[cfg(test)]
mod tests;
pub mod turn;

use crate::linalg::dot;

pub use crate::linalg::pad;
pub use assemble::{NodalBlock, NodeGraph};
pub use elasticity::Elasticity;
pub use element::EDGES;
pub use extent::Extent;
pub use facets::{Facets, area_vector};
pub use forces::NodalForces;
pub use frame::{Frame, place};
pub use interpolation::Interpolation;
pub use lever::Levers;
pub use material::Material;
pub use quadrature::Parts;
pub use recovery::{InterpolationError, Recovery};
pub use rigid::{FreeMotion, RigidMotion};
pub use slope::Slope;
pub use space::Space;
pub use support::{Couplings, ElasticBody, support};

/// Return the Euclidean length of a vector.
pub fn length<const D: usize>(v: [f64; D]) -> f64 {
    dot(&v, &v).sqrt()
}

/// Return the vector scaled to length one.
pub fn unit<const D: usize>(v: [f64; D]) -> [f64; D] {
    let norm = length(v);
    v.map(|v| v / norm)
}

/// Return the difference of two vectors.
pub fn minus<const D: usize>(a: [f64; D], b: [f64; D]) -> [f64; D] {
    std::array::from_fn(|c| a[c] - b[c])
}

/// Return the vector product.
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3])
}
