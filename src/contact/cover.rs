//! How much of each facet of side a is paired, and why the rest is not.

use super::basis::Carriers;
use super::pieces::Common;
use super::side::{Side, length};
use crate::fem::{area_vector, assemble, element, quadrature};
use crate::problem::order::Order;
use serde::{Deserialize, Serialize};

/// What a pair takes of a facet of side a.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Cover {
    /// Share of its length (area) that is paired.
    pub share: f64,
    /// Why it is not paired as a whole.
    pub left: Left,
    /// Pieces, and points of pieces, that the search has lost.
    pub lost: usize,
    /// Which of its nodes carry points; `None` where it has no partner.
    pub carriers: Option<Carriers>,
}

/// Why a facet is not paired as a whole; of several reasons the first that holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Left {
    /// It is.
    Nothing,
    /// What lies before it is inclined by too large an angle.
    Steep,
    /// What lies before it is too far away.
    Far,
    /// Nothing lies before it.
    Bare,
    /// The search for points on what lies before it has failed.
    Lost,
}

/// A facet that lacks less than this share is paired as a whole: lengths of curves by quadrature differ a little between a
/// facet and its pieces.
pub(super) const WHOLE: f64 = 1.0 - 1e-3;

impl Cover {
    /// The cover of those facets that are `asked` for, from the common pieces and the nodes that carry points on them; with their numbers.
    pub(super) fn of<const D: usize>(
        a: &Side<D>,
        common: &Common<D>,
        carriers: &[Option<Carriers>],
        asked: impl Fn(usize) -> bool,
    ) -> Vec<(u32, Self)> {
        let mut covered = vec![0.0; a.facets.count()];
        common.points.iter().for_each(|point| covered[point.facet_a] += point.weight);
        let rule = quadrature::simplex(D, if a.facets.order == Order::P2 { 5 } else { 2 });
        let measure = |i: usize| -> f64 {
            let x = a.facets.coordinates(i, a.space);
            let at = |l: &[f64]| {
                let here = assemble::interpolate(&x, &element::values(a.facets.order, l));
                length(area_vector(a.facets.order, &x, l)) * a.space.circle(&here)
            };
            rule.iter().map(|(l, weight)| weight * at(l)).sum()
        };
        let of_facet = |i: usize| {
            let share = covered[i] / measure(i);
            let refused = common.refused[i];
            let left = if share > WHOLE {
                Left::Nothing
            } else if refused.lost > 0 {
                Left::Lost
            } else if refused.steep {
                Left::Steep
            } else if refused.far {
                Left::Far
            } else {
                Left::Bare
            };
            let lost = if left == Left::Lost { refused.lost } else { 0 };
            Self { share, left, lost, carriers: carriers[i] }
        };
        (0..covered.len()).filter(|&i| asked(i)).map(|i| (i as u32, of_facet(i))).collect()
    }
}
