//! What a rank has of a body when it assembles: all of it, or what it knows of one that is dealt out.

use super::carried::Supported;
use super::distribute::Dealt;
use super::part::Part;
use crate::exchange::Exchange;
use crate::fem::{NodalForces, RigidMotion, place};
use crate::linalg::Csr;

/// A body on the nodes that this rank knows of it.
pub struct Here<'a, const D: usize> {
    /// Its space, supports and springs.
    pub part: Part<'a, D>,
    /// Its contact rows, pair by pair: of its dofs, and of displacements of its nodes.
    pub rows: [Csr; 2],
    /// The nodal forces of its loads: at own nodes, and at those that are tied to own ones.
    pub load: NodalForces<D>,
    /// What its supports prescribe.
    pub supported: Supported<D>,
}

impl<const D: usize> Here<'_, D> {
    /// Of a body that is dealt out, on the nodes that this rank is to know; and the work that all of the loads do on each of the motions that
    /// supports leave it, whose products `dealt` gets. Collective.
    pub fn of(self, dealt: &mut Dealt, left: &[RigidMotion<D>], exchange: &dyn Exchange) -> (Self, Vec<f64>) {
        let Self { part, rows, load, supported: Supported { carried, prescribed } } = self;
        let nodes = &dealt.nodes;
        let dof = |dof: usize| Some(D * place(nodes, (dof / D) as u32)? as usize + dof % D);
        let (part, load) = (part.on(nodes), load.on(nodes));
        let prescribed: Vec<_> = prescribed.into_iter().filter_map(|(at, u)| Some((dof(at)?, u))).collect();
        let rows = rows.map(|rows| rows.of_columns(D * nodes.len(), dof));
        let own = |node: usize| dealt.is_own::<D>(node);
        let (products, work) = part.products(left, &prescribed, (&part.load_vector(&load), &own), exchange);
        dealt.distribution.products = products;
        (Self { part, rows, load, supported: Supported { carried, prescribed } }, work)
    }
}
