//! Which of two surfaces carries the contact points of their pairs.

use super::scene_body::SceneBody;
use crate::fem::{Facets, area_vector, length};
use crate::problem::contact::Carrier;
use crate::problem::order::Order;

/// Ratio of two moduli up to which bodies are equally stiff. One steel is given as 2.1e5 or 2.08e5, and such a
/// difference must not outweigh the meshes.
const EQUAL: f64 = 1.01;

/// Ratio of the sizes of facets above which the finer of two surfaces carries the contact points, since errors are
/// those of a mesh of its size: on rings whose facets are as 3 to 4, the error of the pressure is 0.011 if the finer
/// side carries and 0.034 if the coarser one does (`rings_of_quadrangles_have_lames_pressure`). A mesher divides a
/// length L into L/h facets, rounded to an integer, which changes their size by at most half of 1/N for N facets: two
/// surfaces of ten facets or more of one nominal size stay below the ratio.
const FINER: f64 = 1.1;

/// What decides whether a surface carries the contact points.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    /// Mean Young's modulus of the cells at the surface.
    young: f64,
    /// Mean size of its facets, a length.
    size: f64,
}

impl Candidate {
    fn of<const D: usize>(part: &SceneBody<D>, facets: &Facets<D>) -> Self {
        let (space, centre) = (&part.mesh.space, [1.0 / D as f64; D]);
        let (mut area, mut stiffness) = (0.0, 0.0);
        for (i, cell) in part.cells_at(facets).into_iter().enumerate() {
            let x = facets.coordinates(i, space);
            let own = length(area_vector::<D>(Order::P1, &x[..D], &centre));
            let at = space.in_scene(facets.point(i, space, &centre));
            area += own;
            // an invalid material is refused in the assembly
            stiffness += own * part.elasticity.young(cell, at).unwrap_or(f64::NAN);
        }
        Self { young: stiffness / area, size: (area / facets.count() as f64).powf(1.0 / (D - 1) as f64) }
    }
}

/// Return whether the second of two surfaces carries the contact points: the one of the softer body, else the finer
/// one, else the first.
///
/// The mesh of the softer body follows the pressures. A stiff body has no error that would refine its mesh: if a
/// cylinder of modulus 10 is pressed into a block of 2e5 to an error of 1e-2, the mesh has 8 200 cells with the points
/// on the cylinder. It has more than 150 000 with the points on the block, and eleven of these under pressure.
fn prefers_second([first, second]: [Candidate; 2]) -> bool {
    if first.young > EQUAL * second.young || second.young > EQUAL * first.young {
        return second.young < first.young;
    }
    FINER * second.size < first.size
}

/// Return whether the second of two surfaces of these bodies carries the contact points. `table` is the number of their
/// table in the scene, and `decided` has the choices that an earlier mesh of the same scene made.
pub fn is_second<const D: usize>(
    parts: &[SceneBody<D>],
    bodies: [usize; 2],
    facets: [&Facets<D>; 2],
    table: usize,
    decided: &[Carrier],
) -> bool {
    let earlier = decided.iter().find(|carrier| carrier.table == table && carrier.bodies == bodies);
    let candidate = |k: usize| Candidate::of(&parts[bodies[k]], facets[k]);
    earlier.map_or_else(|| prefers_second([candidate(0), candidate(1)]), |carrier| carrier.is_second)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_softer_carries_else_the_finer_else_the_first() {
        let of = |young: f64, size: f64| Candidate { young, size };
        let steel = of(2.1e5, 1.0);
        // the first of each two carries, whichever is named first
        for pair in [[of(1e5, 4.0), steel], [of(2.07e5, 4.0), steel], [of(2.11e5, 0.9), steel], [of(2.1e5, 0.5), steel]]
        {
            let [carrier, other] = pair;
            assert!(!prefers_second([carrier, other]) && prefers_second([other, carrier]), "{pair:?}");
        }
        // these are equal
        for other in [steel, of(2.1e5, 0.92), of(2.09e5, 1.05), of(f64::NAN, 1.0)] {
            assert!(!prefers_second([steel, other]) && !prefers_second([other, steel]), "{other:?}");
        }
    }
}
