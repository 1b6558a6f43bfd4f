//! How much of each facet of side a is paired, and why the rest is not.

use super::basis::Carriers;
use super::pieces::{Common, Refused};
use super::side::{Side, length};
use crate::fem::area_vector;
use crate::fem::element::{self, Rule};
use crate::problem::order::Order;
use serde::{Deserialize, Serialize};

/// The coverage of a facet of side a by facets of side b.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// Share of its length (area) that is paired.
    pub share: f64,
    /// Why it is not fully paired.
    pub left: Left,
    /// Number of pieces, and of points of pieces, that the search has lost.
    pub lost: usize,
    /// Which of its nodes carry points; `None` where it has no partner.
    pub carriers: Option<Carriers>,
}

/// The reason why a facet is not fully paired. If several reasons hold, `Lost` comes before `Steep`, and `Steep` before `Far`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Left {
    /// It is fully paired.
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

/// Share from which a facet counts as fully paired: by quadrature, the length of a curve differs a little between a facet and
/// its pieces.
pub(super) const WHOLE: f64 = 1.0 - 1e-3;

impl Coverage {
    /// Return the coverage of each facet, from the common pieces and the nodes that carry points.
    pub(super) fn of<const D: usize>(a: &Side<D>, common: &Common<D>, carriers: &[Option<Carriers>]) -> Vec<Self> {
        let mut covered = vec![0.0; a.facets.count()];
        common.points.iter().for_each(|point| covered[point.facet_a] += point.weight);
        let rule = element::rule(D, if a.facets.order == Order::P2 { 5 } else { 2 });
        let of_facet = |i: usize| {
            let share = covered[i] / measure(a, i, &rule);
            let left = Left::of(share, &common.refused[i]);
            let lost = if left == Left::Lost { common.refused[i].lost } else { 0 };
            Self { share, left, lost, carriers: carriers[i] }
        };
        (0..covered.len()).map(of_facet).collect()
    }
}

/// Return the length (area) of facet `i`, in bodies of revolution the area of a ring.
fn measure<const D: usize>(a: &Side<D>, i: usize, rule: &Rule) -> f64 {
    let x = a.facets.coordinates(i, a.space);
    let density = |l: &[f64]| {
        let at = a.facets.point(i, a.space, l);
        length(area_vector(a.facets.order, &x, l)) * a.space.circle(&at)
    };
    rule.iter().map(|(l, weight)| weight * density(l)).sum()
}

impl Left {
    /// Return the reason for a facet with this paired share, from what was refused before it.
    fn of(share: f64, refused: &Refused) -> Self {
        if share > WHOLE {
            Self::Nothing
        } else if refused.lost > 0 {
            Self::Lost
        } else if refused.steep {
            Self::Steep
        } else if !refused.far.is_empty() {
            Self::Far
        } else {
            Self::Bare
        }
    }
}
