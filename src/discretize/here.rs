//! What a rank has of a body when it assembles: all of it, or what it knows of one that is dealt out.

use super::carried::Supported;
use super::distribute::Dealt;
use super::draft::NodalForces;
use super::part::Part;
use crate::fem::{RigidMotion, place};
use crate::linalg::Csr;

/// A body on the nodes that this rank knows of it.
pub struct Here<'a, const D: usize> {
    /// Its space, supports and springs.
    pub part: Part<'a, D>,
    /// Its contact rows, pair by pair: of its dofs, and of displacements of its nodes.
    pub rows: [Csr; 2],
    /// Its loads: on its dofs, and on its nodes.
    pub loads: [NodalForces<D>; 2],
    /// What its supports prescribe.
    pub supported: Supported,
}

impl<const D: usize> Here<'_, D> {
    /// Of a body that is dealt out, of which this is all, the nodes that this rank is to know, which `dealt` chooses; and the work that all of the
    /// loads do on each of the motions that supports leave it.
    pub fn of(self, dealt: &mut Dealt, left: &[RigidMotion<D>]) -> (Self, Vec<f64>) {
        let Self { part, rows, loads, supported: Supported { carried, prescribed } } = self;
        let (products, work) = part.products(left, &prescribed, &loads[0].all());
        let nodes = part.space.among(dealt.nodes_here::<D>(&part, rows.each_ref()));
        dealt.choose::<D>(&nodes, products);
        let dof = |dof: usize| Some(D * place(&nodes, (dof / D) as u32)? as usize + dof % D);
        let on_nodes = |&node: &u32| &carried[D * node as usize..][..D];
        let here = Self {
            part: part.on(&nodes),
            rows: rows.map(|rows| rows.of_columns(D * nodes.len(), dof)),
            loads: loads.map(|loads| loads.on(&nodes)),
            supported: Supported {
                carried: if carried.is_empty() { carried } else { nodes.iter().flat_map(on_nodes).copied().collect() },
                prescribed: prescribed.into_iter().filter_map(|(at, u)| Some((dof(at)?, u))).collect(),
            },
        };
        (here, work)
    }
}
