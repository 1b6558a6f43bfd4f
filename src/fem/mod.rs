//! Finite elements on one body: P1 and P2 simplices, linear elasticity, assembly into sparse rows.
//!
//! Data flow: [`Mesh`](crate::mesh::Mesh) group -> [`Space`] -> [`assemble`] -> [`ElasticBody`] {K, f, supports}. Afterwards
//! [`displacement`] has the stresses of a displacement. Degrees of freedom are numbered `D * node + component`.

pub mod assemble;
pub mod displacement;
pub mod elasticity;
pub mod element;
mod facets;
mod frame;
pub mod interpolation;
mod recovery;
pub mod rigid;
pub mod space;
pub mod surface;
#[cfg(test)]
mod tests;

use crate::linalg::dot;

pub use crate::linalg::pad;
pub use assemble::{Couplings, ElasticBody, NodalBlock, NodalForces, NodeGraph, support};
pub use elasticity::{Elasticity, Material};
pub use element::{EDGES, Parts};
pub use facets::{Facets, area_vector};
pub use frame::{Frame, Levers, place};
pub use interpolation::Interpolation;
pub use recovery::{Errors, Recovery};
pub use rigid::{Extent, FreeMotion, RigidMotion};
pub use space::{Slope, Space};

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
