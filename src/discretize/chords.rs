//! How much of the balance that loads have on curved surfaces they may lack on the facets of a mesh.

use super::groups::Line;
use super::scene_body::SceneBody;
use crate::error::Result;
use crate::fem::{Facets, Space, minus, unit};
use crate::linalg::dot;
use crate::mesh::Mesh;
use crate::problem::order::Order;
use std::collections::HashMap;
use std::f64::consts::FRAC_PI_3;

/// Return the share that chords may take from the balance of all loads on surfaces, zero if these are plane with
/// straight edges.
///
/// A chord is shorter by t^2/24 than the arc on which it turns by the angle t. Facets of quadratic elements follow an
/// arc.
///
/// # Errors
/// A load on a surface that the mesh does not have.
pub fn lack<const D: usize>(parts: &[SceneBody<D>], mesh: &Mesh<D>) -> Result<f64> {
    let mut largest = 0.0f64;
    for part in parts.iter().filter(|part| part.mesh.space.order == Order::P1) {
        for load in &part.spec.load {
            let group = load.group(mesh)?;
            if group.dimension == D - 1 {
                largest = turns(&part.mesh.space, &part.mesh.space.facets(group)).fold(largest, f64::max);
            }
        }
    }
    Ok(largest * largest / 24.0)
}

/// Return the angles between neighbouring facets of a surface, and in space between neighbouring edges at its ends,
/// without those of edges and corners of the part. The facets of a circle of six chords turn by the least angle of
/// these; Gmsh divides a circle into seven or more.
fn turns<const D: usize>(space: &Space<D>, facets: &Facets<D>) -> impl Iterator<Item = f64> {
    let normals = facets.normals(space);
    let at = |node: u32| space.nodes[node as usize];
    let mut all = Vec::new();
    let mut ends: HashMap<u32, [f64; D]> = HashMap::new();
    for (edge, around) in facets.by_edge() {
        if let [i, j] = around[..] {
            all.push(dot(&normals[D * i], &normals[D * j]));
        } else if D == 3 {
            let along = unit(minus(at(edge[1]), at(edge[0])));
            for node in [edge[0], edge[1]] {
                if let Some(other) = ends.insert(node, along) {
                    // edges have no direction
                    all.push(dot(&along, &other).abs());
                }
            }
        }
    }
    all.into_iter().map(|cosine| cosine.clamp(-1.0, 1.0).acos()).filter(|angle| *angle < FRAC_PI_3 - 1e-9)
}
