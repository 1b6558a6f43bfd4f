//! Pairs that the scene leaves to be found: boundary facets of different bodies that face each other within a distance.

use super::part::Part;
use super::surface::Surface;
use crate::contact::Side;
use crate::contact::pieces::{Cut, Reach, Search};
use crate::contact::side::unit;
use crate::error::{Error, Result};
use crate::fem::Facets;
use crate::problem::contact::AutoContact;
use std::collections::HashSet;

/// The two surfaces of each pair of bodies that come near each other, named after the bodies, but for pairs in
/// `named` (numbers of bodies, the smaller first).
///
/// First all facets that could have a partner are gathered, so that the nodal normals are those of smooth surfaces;
/// of these the ones stay that share a piece.
///
/// # Errors
/// A scene in which nothing is near anything.
pub fn find<'a, const D: usize>(
    auto: &AutoContact,
    cut: Cut<D>,
    parts: &'a [Part<D>],
    named: &HashSet<[usize; 2]>,
) -> Result<Vec<[Surface<'a, D>; 2]>> {
    let whole: Vec<Side<D>> = parts
        .iter()
        .map(|part| {
            Side::new(
                &part.spec.name.value,
                &part.space,
                part.space.boundary(),
                &part.held.prescribed,
                &part.held.frame,
            )
        })
        .collect();
    let searches: Vec<Search<D>> = whole.iter().map(Search::new).collect();
    let bodies = Search::of_boxes(whole.iter().map(Side::extent));
    let mut found = Vec::new();
    for a in 0..parts.len() {
        let mut others: Vec<usize> = bodies.near_box(whole[a].extent(), auto.distance).collect();
        others.retain(|&b| b > a && !named.contains(&[a, b]));
        others.sort_unstable();
        for b in others {
            let reach = within(&whole[a], &whole[b], auto.distance, auto.contact.angle);
            let near = candidates(&whole[a], &whole[b], &searches[b], &reach);
            if near.iter().any(|facets| facets.count() == 0) {
                continue;
            }
            let side = |body: usize, facets: &Facets<D>| {
                Side::new(
                    whole[body].name,
                    whole[body].space,
                    facets.clone(),
                    whole[body].prescribed,
                    whole[body].frame,
                )
            };
            let (side_a, side_b) = (side(a, &near[0]), side(b, &near[1]));
            let mut used = [vec![false; near[0].count()], vec![false; near[1].count()]];
            let reach = within(&side_a, &side_b, auto.distance, auto.contact.angle);
            for point in cut(&side_a, &side_b, &reach).points {
                used[0][point.facet_a] = true;
                used[1][point.facet_b] = true;
            }
            if used[0].contains(&true) {
                let surface = |side: usize, body: usize| Surface {
                    body,
                    name: parts[body].spec.name.value.as_str(),
                    facets: near[side].only(&used[side]),
                };
                found.push([surface(0, a), surface(1, b)]);
            }
        }
    }
    if found.is_empty() {
        let place = &auto.contact.between[0].place;
        let message = format!("no facets of different bodies face each other within {}", auto.distance);
        return Err(Error::scene(place, message).help("a larger distance may find some"));
    }
    Ok(found)
}

/// How far the surfaces of a found pair may be apart, and how inclined in degrees.
pub fn within<const D: usize>(a: &Side<D>, b: &Side<D>, distance: f64, angle: f64) -> Reach {
    let reach = Reach::between(a, b, angle);
    Reach { gap: distance, overlap: distance.min(reach.overlap), ..reach }
}

/// Facets of two bodies with opposed normals and boxes within the distance.
fn candidates<const D: usize>(a: &Side<D>, b: &Side<D>, search: &Search<D>, reach: &Reach) -> [Facets<D>; 2] {
    let mut keep = [vec![false; a.facets.count()], vec![false; b.facets.count()]];
    for i in 0..a.facets.count() {
        let normal = unit(a.area(i));
        for j in search.near(a, i, reach.gap) {
            if reach.faces(normal, unit(b.area(j))) {
                keep[0][i] = true;
                keep[1][j] = true;
            }
        }
    }
    [a.facets.only(&keep[0]), b.facets.only(&keep[1])]
}
