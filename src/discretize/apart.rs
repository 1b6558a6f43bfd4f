//! Why two surfaces do not face each other.

use super::find::point;
use crate::contact::pieces::{Common, Cut, Reach};
use crate::contact::{ROUNDING, Side, unit};
use crate::linalg::dot;
use crate::problem::contact::ContactSpec;
use std::collections::BTreeMap;

/// Largest angle, in degrees, between the normals of facets that can have common pieces at all.
const RIGHT: f64 = 90.0;

/// Return why two surfaces do not face each other within the limits of their contact, and what to do.
pub fn why<const D: usize>(a: &Side<D>, b: &Side<D>, cut: Cut<D>, spec: &ContactSpec) -> [String; 2] {
    let ContactSpec { angle, distance, .. } = *spec;
    let [names_a, names_b] = [a.name, b.name];
    let anywhere = |angle: f64| cut(a, b, &Reach::anywhere(a, b, angle));
    if let Some(Nearest { gap, at }) = Nearest::of(a, &anywhere(angle)) {
        return match distance.filter(|_| gap > 0.0) {
            Some(distance) => [
                format!("the gap is {gap:.6} where they are nearest, at {at}, and `distance` = {distance} ends before"),
                "give a larger distance, or none: surfaces with names are found at any distance".to_owned(),
            ],
            None if gap > 0.0 => [format!("the gap is {gap:.6} where they are nearest, at {at}"), String::new()],
            None => [
                format!(
                    "at {at} `{names_b}` lies {:.6} behind `{names_a}`, deeper than an overlap can be: the surfaces look away from each other",
                    -gap
                ),
                "name the sides of the bodies that look at each other, or move a body".to_owned(),
            ],
        };
    }
    if Nearest::of(a, &anywhere(RIGHT)).is_some() {
        return [
            format!("where they lie before each other their normals stand at more than {angle} degrees (key `angle`)"),
            "give a larger angle, up to 90 degrees, or name other surfaces".to_owned(),
        ];
    }
    if closest(a, b) <= ROUNDING {
        return [
            "their outer normals nowhere point at each other".to_owned(),
            "name the sides of the bodies that look at each other; `winkler mesh` has their places".to_owned(),
        ];
    }
    [
        "no facet of one lies before a facet of the other along its normal".to_owned(),
        "move a body, or name surfaces that lie opposite each other; `winkler mesh` has their places".to_owned(),
    ]
}

/// Where two surfaces are nearest to each other.
struct Nearest {
    /// Signed distance, negative where one is behind the other.
    gap: f64,
    /// The point as a text.
    at: String,
}

impl Nearest {
    /// Return the nearest of common points, those in front first; `None` if there are none.
    fn of<const D: usize>(a: &Side<D>, common: &Common<D>) -> Option<Self> {
        let key = |gap: f64| (gap < 0.0, gap.abs());
        let less = |p: f64, q: f64| {
            let ((behind, p), (other, q)) = (key(p), key(q));
            behind.cmp(&other).then(p.total_cmp(&q))
        };
        let nearest = common.points.iter().min_by(|p, q| less(p.gap, q.gap))?;
        let at = a.facets.point(nearest.facet_a, a.space, &nearest.at_a);
        Some(Self { gap: nearest.gap, at: point(a.space.in_scene(at)) })
    }
}

/// Return the largest cosine of the angle between the normal of a facet of one side and minus that of a facet of the other.
///
/// One normal stands for all that differ from it by less than a twentieth in each component, since large curved surfaces have too many
/// to compare each two. On plane facets it is exact.
fn closest<const D: usize>(a: &Side<D>, b: &Side<D>) -> f64 {
    let normals = |side: &Side<D>| -> Vec<[f64; D]> {
        let all = (0..side.facets.count()).map(|i| unit(side.area(i)));
        let rounded = all.map(|normal| (normal.map(|n| (20.0 * n).round() as i64), normal));
        rounded.collect::<BTreeMap<_, _>>().into_values().collect()
    };
    let (ours, others) = (normals(a), normals(b));
    let facing = |n: &[f64; D]| others.iter().map(|m| -dot(n, m)).fold(-1.0, f64::max);
    ours.iter().map(facing).fold(-1.0, f64::max)
}
