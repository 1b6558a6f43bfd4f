//! Nodes of bodies: numbered as the cells of all ranks meet them, known where they are needed.

use serde::{Deserialize, Serialize};
use crate::exchange::{Exchange, gather, places, trade};
use crate::mesh::{Key, Portion};

/// The nodes of a body that a rank has: those of its cells, and those on surfaces, edges and points.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Nodes {
    /// Number of nodes of the body on all ranks.
    pub count: usize,
    /// Their numbers among these, sorted.
    pub numbers: Vec<u32>,
    /// The point of the mesh that each of them is.
    pub points: Vec<u32>,
}

/// A body: the place of its group, and how many points of a cell are nodes.
pub type Body = (usize, usize);

/// The nodes of these bodies. Collective.
pub fn number<const D: usize>(portion: &Portion<D>, bodies: &[Body], exchange: &dyn Exchange) -> Vec<Nodes> {
    let mut is_met = vec![false; portion.mesh.points.len()];
    let mut met: Vec<Vec<u32>> = Vec::with_capacity(bodies.len());
    let mut first: Vec<(u32, Key, u8)> = Vec::new();
    let mut others: Vec<Vec<u32>> = Vec::with_capacity(bodies.len());
    for (body, &(place, stride)) in (0..).zip(bodies) {
        let keys = portion.keys(place);
        let (mut own, mut other) = (Vec::new(), Vec::new());
        for (cell, corners) in portion.mesh.groups[place].simplices().enumerate() {
            for (corner, &point) in (0..).zip(&corners[..stride]) {
                if std::mem::replace(&mut is_met[point as usize], true) {
                    continue;
                }
                if portion.is_own(point) {
                    own.push(point);
                    // its first cell is here, as all are in which it is
                    first.extend(keys.get(cell).map(|&key| (body, key, corner)));
                } else {
                    other.push(point);
                }
            }
        }
        own.iter().chain(&other).for_each(|&point| is_met[point as usize] = false);
        met.push(own);
        others.push(other);
    }
    if exchange.ranks() == 1 {
        let all = |points: Vec<u32>| Nodes { count: points.len(), numbers: (0..points.len() as u32).collect(), points };
        return met.into_iter().map(all).collect();
    }
    let mut counts: Vec<f64> = met.iter().map(|own| own.len() as f64).collect();
    exchange.sum(&mut counts);
    let mut numbers = places(exchange, &first).into_iter();
    let mut before = 0;
    let mut known: Vec<Vec<(u32, u32)>> = Vec::with_capacity(bodies.len());
    for (own, &count) in met.into_iter().zip(&counts) {
        let numbers = numbers.by_ref().take(own.len()).map(|number| number - before);
        known.push(own.into_iter().zip(numbers).collect());
        before += count as u32;
    }
    ask(portion, &mut known, &others, exchange);
    let known = known.into_iter().zip(counts).map(|(mut known, count)| {
        known.sort_unstable_by_key(|&(_, number)| number);
        known.dedup();
        let (points, numbers) = known.into_iter().unzip();
        Nodes { count: count as usize, numbers, points }
    });
    known.collect()
}

/// Adds to own nodes, (point, number), of each body `others` and those on surfaces, which other ranks have numbered. Collective.
fn ask<const D: usize>(
    portion: &Portion<D>,
    known: &mut [Vec<(u32, u32)>],
    others: &[Vec<u32>],
    exchange: &dyn Exchange,
) {
    let mut on_group = vec![false; portion.mesh.points.len()];
    let low = portion.mesh.groups.iter().filter(|group| group.dimension < D);
    low.flat_map(|group| &group.connectivity).for_each(|&point| on_group[point as usize] = true);
    let mut on_groups: Vec<(u32, u32, u32)> = Vec::new();
    let mut asked: Vec<Vec<(u32, u32)>> = vec![Vec::new(); exchange.ranks()];
    for (body, (own, others)) in (0..).zip(known.iter_mut().zip(others)) {
        own.sort_unstable();
        let own = own.iter().filter(|(point, _)| on_group[*point as usize]);
        on_groups.extend(own.map(|&(point, number)| (body, portion.number(point), number)));
        others.iter().for_each(|&point| asked[portion.home(point)].push((body, portion.number(point))));
    }
    let answer = |(body, point): (u32, u32)| {
        let (own, point) = (&known[body as usize], portion.find(point)?);
        Some(own[own.binary_search_by_key(&point, |entry| entry.0).ok()?].1)
    };
    let answers = trade(exchange, asked.clone()).into_iter();
    let answers = answers.map(|asked| asked.into_iter().map(answer).collect::<Vec<_>>());
    let answers: Vec<Vec<Option<u32>>> = trade(exchange, answers.collect());
    let of_cells = asked.into_iter().flatten().zip(answers.into_iter().flatten());
    let of_cells = of_cells.filter_map(|((body, point), number)| Some((body, point, number?)));
    for (body, point, number) in of_cells.chain(gather(exchange, &on_groups)) {
        known[body as usize].extend(portion.find(point).map(|point| (point, number)));
    }
}
