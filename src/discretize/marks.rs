//! The places of a mesh that the page of a run marks: where supports, loads and springs act, and where bodies may
//! touch.

use super::groups::Line;
use crate::contact::ContactPair;
use crate::mesh::Mesh;
use crate::output::{Mark, Role};
use crate::problem::BodySpec;
use std::collections::BTreeSet;

/// Return the marks of all bodies. Surfaces that are no groups of the mesh are left out: those of obstacles, and of
/// pairs that were found.
pub fn marks<const D: usize>(mesh: &Mesh<D>, bodies: &[BodySpec], pairs: &[ContactPair]) -> Vec<Mark> {
    let of_body = |(body, spec): (usize, &BodySpec)| -> Vec<(usize, Role, String)> {
        let supports = spec.fix.iter().map(|support| (Role::Support, support.on()));
        let loads = spec.load.iter().map(|load| (Role::Load, load.on()));
        let springs = spec.spring.iter().map(|spring| (Role::Spring, spring.on()));
        supports.chain(loads).chain(springs).map(|(role, on)| (body, role, on.value.clone())).collect()
    };
    let surfaces = pairs.iter().flat_map(|pair| pair.bodies.into_iter().zip(pair.surfaces.clone()));
    let surfaces: BTreeSet<(usize, String)> = surfaces.collect();
    let all = bodies.iter().enumerate().flat_map(of_body);
    let all = all.chain(surfaces.into_iter().map(|(body, on)| (body, Role::Contact, on)));
    let mark = |(body, role, on): (usize, Role, String)| {
        let group = mesh.group(&on).filter(|group| group.dimension < D)?;
        let simplices = group.simplices().map(<[u32]>::to_vec).collect();
        Some(Mark { role, on, body, corners: group.dimension + 1, simplices })
    };
    all.filter_map(mark).collect()
}
