//! The factory's plan of all bodies. The factory requests facts about each body, chooses solvers, and decides which bodies share
//! a matrix.

use super::carried::Supported;
use super::couplings::Coupled;
use super::distribute::Partition;
use super::factory::{Factory, Outline};
use super::interface::Interface;
use super::part::Part;
use crate::contact::ContactPair;
use crate::error::Result;
use crate::fem::rigid::AtDofs;

/// Return the factory's plan of the solvers of all bodies.
///
/// # Errors
/// See [`Factory::plan`].
pub fn plan<const D: usize, F: Factory>(
    parts: &[Part<D>],
    interfaces: &[Interface<D>],
    supported: &[Supported<D>],
    coupled: &Coupled<D>,
    factory: &mut F,
) -> Result<F::Plan> {
    // Facts of a body are computed when they are requested.
    let graphs: Vec<_> = (0..parts.len()).map(|body| move || coupled.graph(body)).collect();
    let at = |body: usize| move |k: usize, dof: usize| parts[body].dof_of(&interfaces[body].free[k], dof);
    let at: Vec<_> = (0..parts.len()).map(at).collect();
    let outline = |body: usize| Outline {
        name: &parts[body].spec.name.value,
        dimension: D,
        order: parts[body].space.order,
        rows: &interfaces[body].rows,
        prescribed: &supported[body].prescribed,
        motions: AtDofs { count: interfaces[body].free.len(), at: &at[body] },
        graph: &graphs[body],
    };
    factory.plan(&(0..parts.len()).map(outline).collect::<Vec<_>>())
}

/// Distribute the nodes of the bodies that share a matrix over the ranks, by the factory's plan.
pub fn partitions<const D: usize>(
    parts: &[Part<D>],
    coupled: &Coupled<D>,
    pairs: &[ContactPair],
    factory: &impl Factory,
    ranks: usize,
) -> Vec<Partition> {
    let wants_coarse = |body: usize| factory.wants_interpolation(&parts[body].spec.name.value);
    let partition = |bodies: Vec<usize>| {
        let couplings = coupled.of_nodes(&bodies, pairs);
        Partition::new(bodies, parts, &couplings, ranks, &wants_coarse)
    };
    factory.distributed().into_iter().map(partition).collect()
}
