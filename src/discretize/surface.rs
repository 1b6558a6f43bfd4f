//! The mesh of a contact surface for output: the covered facets of side a, and where their values come from.

use crate::contact::pieces::Shared;
use crate::contact::{ContactPair, Side, pad};
use crate::output::vtu::{CellKind, Grid};
use crate::scene::Order;
use std::collections::HashMap;

/// The covered facets of the side that carries the points.
pub struct ContactSurface {
    points: Vec<[f64; 3]>,
    cell: CellKind,
    connectivity: Vec<u32>,
    /// For each point of the mesh the contact points whose mean is its value; none where nothing is known.
    sources: Vec<Vec<usize>>,
}

impl ContactSurface {
    /// The facets of side a that share an integration point with side b.
    pub fn new<const D: usize>(a: &Side<D>, shared: &[Shared<D>], pair: &ContactPair) -> Self {
        let mut covered = vec![false; a.facets.count()];
        shared.iter().for_each(|point| covered[point.facet_a] = true);
        let facets = a.facets.only(&covered);
        let of_node: HashMap<u32, usize> = pair.nodes.iter().enumerate().map(|(q, &node)| (node, q)).collect();
        let mut surface = Self {
            points: Vec::new(),
            cell: match (D, facets.order) {
                (2, Order::P1) => CellKind::Line,
                (2, Order::P2) => CellKind::QuadraticLine,
                (_, Order::P1) => CellKind::Triangle,
                (_, Order::P2) => CellKind::QuadraticTriangle,
            },
            connectivity: Vec::new(),
            sources: Vec::new(),
        };
        let mut number: HashMap<u32, u32> = HashMap::new();
        for i in 0..facets.count() {
            let nodes = facets.facet(i);
            for (local, node) in nodes.iter().enumerate() {
                let next = surface.points.len() as u32;
                let at = *number.entry(*node).or_insert(next);
                surface.connectivity.push(at);
                if at < next {
                    continue;
                }
                surface.points.push(pad(a.space.nodes[*node as usize]));
                // a mid-edge without a point of its own lies between two vertices
                let ends = match local.checked_sub(D) {
                    Some(edge) if !of_node.contains_key(node) => {
                        let (from, to) = crate::fem::element::EDGES[edge];
                        vec![nodes[from], nodes[to]]
                    }
                    _ => vec![*node],
                };
                surface.sources.push(ends.iter().filter_map(|end| of_node.get(end).copied()).collect());
            }
        }
        surface
    }

    /// The mesh with arrays of values at the contact points: name, components per point, values. Points of the mesh that no
    /// contact point serves get NaN.
    pub fn grid(&self, name: String, arrays: &[(&str, usize, Vec<f64>)]) -> Grid {
        let spread = |components: usize, values: &[f64]| {
            let mean = |sources: &Vec<usize>, c: usize| {
                sources.iter().map(|q| values[components * q + c]).sum::<f64>() / sources.len() as f64
            };
            self.sources
                .iter()
                .flat_map(|sources| (0..components).map(|c| mean(sources, c)).collect::<Vec<_>>())
                .collect()
        };
        Grid {
            title: name,
            points: self.points.clone(),
            cell: self.cell,
            connectivity: self.connectivity.clone(),
            at_points: arrays
                .iter()
                .map(|(name, components, values)| ((*name).to_owned(), *components as u32, spread(*components, values)))
                .collect(),
            at_cells: Vec::new(),
        }
    }
}
