//! The factory's plan of all bodies. It asks for facts about each body, decides on solvers, and says which bodies share a matrix.

use super::carried::Supported;
use super::couplings::Coupled;
use super::distribute::Deal;
use super::draft::Draft;
use super::factory::{Factory, Outline};
use super::free::Free;
use super::part::Part;
use crate::contact::ContactPair;
use crate::error::Result;
use crate::exchange::Exchange;
use crate::fem::rigid::AtDofs;

/// Let the factory plan the solvers of all bodies. Bodies that share a matrix are split over the ranks; return which rank gets which of their nodes.
/// Collective.
///
/// # Errors
/// Those of [`Factory::plan`].
pub fn plan<const D: usize>(
    (parts, drafts, supported): (&[Part<D>], &[Draft<D>], &[Supported<D>]),
    coupled: &Coupled<D>,
    pairs: &[ContactPair],
    factory: &mut dyn Factory,
    exchange: &dyn Exchange,
) -> Result<Vec<Deal>> {
    let motions = parts.iter().zip(drafts).map(|(part, draft)| Free::new(part, draft, exchange));
    let motions: Vec<Free<D>> = motions.collect();
    // what is asked of a body is found then
    let graphs: Vec<_> = (0..parts.len()).map(|body| move || coupled.graph(body)).collect();
    let couplings: Vec<_> = (0..parts.len()).map(|body| move || coupled.count(body)).collect();
    let at: Vec<_> = motions.iter().map(|free| |k: usize, dof: usize| free.at(k, dof)).collect();
    let largest: Vec<_> = motions.iter().map(|free| |size: &dyn Fn(usize) -> Option<f64>| free.largest(size)).collect();
    let outline = |body: usize| Outline {
        name: &parts[body].spec.name.value,
        dimension: D,
        order: parts[body].space.order,
        rows: &drafts[body].rows,
        prescribed: &supported[body].prescribed,
        motions: AtDofs { count: drafts[body].free.len(), at: &at[body], largest: &largest[body] },
        couplings: &couplings[body],
        graph: &graphs[body],
    };
    factory.plan(&(0..parts.len()).map(outline).collect::<Vec<_>>())?;
    let deal = |bodies: Vec<usize>| {
        let couplings = coupled.of(&bodies, pairs);
        Deal::new(bodies, parts, &couplings, exchange)
    };
    Ok(factory.dealt_out().into_iter().map(deal).collect())
}
