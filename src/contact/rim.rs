//! The rims of a contact: facets on which the pressure may be singular, since one of the surfaces ends there.
//!
//! Near the edge of a contact surface the pressure of bodies without a layer is K r^(lambda - 1) at the distance r from the edge, with
//! 1/2 <= lambda. The edge is no rim where the surface goes on as its mirror image: on an axis of revolution, and on a plane of symmetry.

use super::cover::{Coverage, WHOLE};
use super::pieces::Common;
use super::side::{Side, unit};
use crate::fem::minus;
use crate::linalg::dot;
use std::collections::HashMap;

/// Sine below which a direction counts as constrained, and above whose complement as free. Planes of symmetry are known to
/// rounding where facets are flat; a facet of a circle is inclined by half of its turn, which has the sine 0.26 with twelve facets.
const INCLINED: f64 = 0.3;

/// Return, for each facet of side a, whether it lies at a rim. `cover` is the coverage of these facets.
///
/// It does if an edge of side a that is no symmetry bounds it. It does, too, if side b ends on it or on a facet beside it, at such an edge of b:
/// the covered part of that facet may be a sliver.
pub(super) fn facets_at_rim<const D: usize>(
    a: &Side<D>,
    b: &Side<D>,
    common: &Common<D>,
    cover: &[Coverage],
) -> Vec<bool> {
    let (edges_a, edges_b) = (Edges::of(a), Edges::of(b));
    let mut above_rim_of_b = vec![false; a.facets.count()];
    for point in &common.points {
        above_rim_of_b[point.facet_a] |= edges_b.is_at_rim(b, point.facet_b);
    }
    let ends_on = |i: usize| cover[i].share < WHOLE;
    let ends_beside = |i: usize| edges_a.beside(a, i).any(|k| ends_on(k) && (above_rim_of_b[i] || above_rim_of_b[k]));
    let at_rim = |i: usize| {
        cover[i].share > 0.0 && (edges_a.is_at_rim(a, i) || ends_on(i) && above_rim_of_b[i] || ends_beside(i))
    };
    (0..a.facets.count()).map(at_rim).collect()
}

/// The edges of the facets of a side (in the plane: nodes), by their sorted vertices, with the facets at each.
struct Edges<const D: usize>(HashMap<[u32; D], Vec<usize>>);

impl<const D: usize> Edges<D> {
    fn of(side: &Side<D>) -> Self {
        let mut facets: HashMap<[u32; D], Vec<usize>> = HashMap::new();
        for i in 0..side.facets.count() {
            edges(side, i).for_each(|edge| facets.entry(edge).or_default().push(i));
        }
        Self(facets)
    }

    /// Return the facets that share an edge with facet `i`.
    fn beside<'a>(&'a self, side: &'a Side<D>, i: usize) -> impl Iterator<Item = usize> + 'a {
        edges(side, i).flat_map(|edge| &self.0[&edge]).copied().filter(move |&other| other != i)
    }

    /// Return whether the surface ends at facet `i`, and does not go on as its mirror image.
    fn is_at_rim(&self, side: &Side<D>, i: usize) -> bool {
        edges(side, i).any(|edge| self.0[&edge].len() == 1 && !is_mirrored(side, i, edge))
    }
}

/// Return the edges of a facet. Each is its sorted vertices with a `u32::MAX` at the end, in place of the opposite vertex.
fn edges<'a, const D: usize>(side: &'a Side<D>, i: usize) -> impl Iterator<Item = [u32; D]> + 'a {
    let vertices = &side.facets.facet(i)[..D];
    (0..D).map(move |opposite| {
        let mut edge: [u32; D] = std::array::from_fn(|k| if k == opposite { u32::MAX } else { vertices[k] });
        edge.sort_unstable();
        edge
    })
}

/// Return whether the surface goes on beyond an edge of facet `i` as its mirror image: all nodes of the edge lie on an axis of revolution, or
/// supports hold the direction that leaves the facet there, but not its normal.
fn is_mirrored<const D: usize>(side: &Side<D>, i: usize, edge: [u32; D]) -> bool {
    let nodes = || edge[..D - 1].iter().copied();
    if nodes().all(|node| side.space.on_axis(node)) {
        return true;
    }
    let normal = unit(side.area(i));
    let Some(&opposite) = side.facets.facet(i)[..D].iter().find(|node| !edge.contains(node)) else { return false };
    let at = |node: u32| side.space.nodes[node as usize];
    let mut outwards = minus(at(edge[0]), at(opposite));
    let mut remove = |axis: [f64; D]| {
        let part = dot(&outwards, &axis);
        (0..D).for_each(|c| outwards[c] -= part * axis[c]);
    };
    remove(normal);
    if D == 3 {
        remove(unit(minus(at(edge[1]), at(edge[0]))));
    }
    let outwards = unit(outwards);
    nodes().all(|node| held(side, node, outwards) >= 1.0 - INCLINED && held(side, node, normal) <= INCLINED)
}

/// Return the length of the part of a unit vector along which supports hold a node.
fn held<const D: usize>(side: &Side<D>, node: u32, direction: [f64; D]) -> f64 {
    let held = side.frame.force(node, direction).flat_map(|(node, components)| {
        let dofs = (0..D).zip(components);
        dofs.filter(move |(c, _)| side.prescribed.contains_key(&(D * node as usize + c)))
    });
    held.map(|(_, component)| component * component).sum::<f64>().sqrt()
}
