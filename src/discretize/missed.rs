//! Bounds of the loads of a body that its mesh may miss. Loads that balance on the true surfaces may lack balance on the facets.

use super::find::find_group;
use super::interface::Interface;
use super::part::Part;
use crate::contact::ContactPair;
use crate::fem::{RigidMotion, surface};
use crate::mesh::Mesh;

/// Ratio of the error of a quadrature to the difference between it and the same rule on halves of the elements. Where a load
/// jumps within an element, the error on halves is half as large, so the difference is half of the error. Where the load is
/// smooth, the ratio is nearly one.
const HALVES: f64 = 2.0;

/// Return the share of the loads of a body that facets may miss ([`surface::missed`]). A body force acts on the volume within all
/// surfaces, and the surfaces in contact represent them.
pub fn by_facets<const D: usize>(
    part: &Part<D>,
    interface: &Interface<D>,
    pairs: &[ContactPair],
    mesh: &Mesh<D>,
) -> f64 {
    let groups = part.spec.load.iter().filter_map(|load| find_group(mesh, &load.on, &[D - 1], "load").ok());
    let on_groups = groups.map(|group| surface::missed(&part.space, &part.space.facets(group))).fold(0.0, f64::max);
    if part.spec.force.is_none() {
        return on_groups;
    }
    let points = interface.segments.iter().flat_map(|segment| &pairs[segment.pair].surface[segment.side]);
    // Facets differ from their mean by half of the angle between them.
    points.map(|point| surface::by_chords(2.0 * point.spread)).fold(on_groups, f64::max)
}

/// Return a bound of the work on a motion of the nodal forces that the quadrature of surface loads misses.
pub fn by_quadrature<const D: usize>(part: &Part<D>, motion: &RigidMotion<D>, mesh: &Mesh<D>) -> f64 {
    let missed = part.missed_load(mesh).unwrap_or_default();
    let [_, largest] = missed.works(|node| motion.at(&part.space.nodes[node as usize]));
    HALVES * largest
}
