//! Pairs that rules of the scene leave to be found: boundary facets of different bodies that face each other within a distance.

use super::part::Part;
use super::roster::{pattern, tie};
use super::surface::Surface;
use crate::contact::pieces::{Cut, Reach, Search};
use crate::contact::{Side, unit};
use crate::error::{Error, Place, Result, few};
use crate::fem::Facets;
use crate::problem::contact::AutoContact;
use crate::problem::pattern::Rank;
use std::collections::HashSet;

/// A pair that was found: the number of its rule, and its two surfaces, named after the bodies.
pub type Found<'a, const D: usize> = (usize, [Surface<'a, D>; 2]);

/// The pairs of bodies that come near each other, but for those in `named` (numbers of bodies, the smaller first). The narrowest
/// rule for two bodies decides alone whether they are a pair.
///
/// First all facets that could have a partner are gathered, so that the nodal normals are those of smooth surfaces;
/// of these the ones stay that share a piece.
///
/// # Errors
/// A rule that finds nothing, patterns that match no body, and two rules equally near to a pair.
pub fn find<'a, const D: usize>(
    rules: &[AutoContact],
    cut: Cut<D>,
    parts: &'a [Part<D>],
    named: &HashSet<[usize; 2]>,
) -> Result<Vec<Found<'a, D>>> {
    if rules.is_empty() {
        return Ok(Vec::new());
    }
    let matches = rules.iter().map(|rule| Matches::new(rule, parts)).collect::<Result<Vec<_>>>()?;
    let farthest = rules.iter().map(|rule| rule.distance).fold(0.0, f64::max);
    let whole: Vec<Side<D>> = parts
        .iter()
        .map(|part| {
            Side::new(
                &part.spec.name.value,
                &part.space,
                part.known.boundary(&part.space),
                &part.held.prescribed,
                &part.held.frame,
            )
        })
        .collect();
    let searches: Vec<Search<D>> = whole.iter().map(Search::new).collect();
    let bodies = Search::of_boxes(whole.iter().map(Side::extent));
    let mut found = Vec::new();
    for a in 0..parts.len() {
        let mut others: Vec<usize> = bodies.near_box(whole[a].extent(), farthest).collect();
        others.retain(|&b| b > a && !named.contains(&[a, b]));
        others.sort_unstable();
        for b in others {
            let Some((number, other)) = narrowest(&matches, a, b) else { continue };
            let rule = &rules[number];
            let reach = within(&whole[a], &whole[b], rule.distance, rule.contact.angle);
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
            let reach = within(&side_a, &side_b, rule.distance, rule.contact.angle);
            for point in cut(&side_a, &side_b, &reach).points {
                used[0][point.facet_a] = true;
                used[1][point.facet_b] = true;
            }
            if used[0].contains(&true) {
                if let Some(other) = other {
                    let pair = format!("{} - {}", parts[a].spec.name.value, parts[b].spec.name.value);
                    let [(own, _), (other, place)] = [number, other].map(|number| title(&rules[number]));
                    return Err(tie(&pair, [&own, &other], place));
                }
                let surface = |side: usize, body: usize| Surface {
                    body,
                    name: parts[body].spec.name.value.as_str(),
                    facets: near[side].only(&used[side]),
                };
                found.push((number, [surface(0, a), surface(1, b)]));
            }
        }
    }
    let mut fruitless = vec![true; rules.len()];
    found.iter().for_each(|(number, _)| fruitless[*number] = false);
    match rules.iter().zip(fruitless).find(|(_, fruitless)| *fruitless) {
        None => Ok(found),
        Some((rule, _)) => {
            let (bodies, place) = title(rule);
            let message = format!("no facets of {bodies} face each other within {}", rule.distance);
            let help = match rules.len() {
                1 => "a larger distance may find some",
                _ => {
                    "a larger distance may find some, unless narrower rules or contacts with names have all these pairs"
                }
            };
            Err(Error::scene(place, message).help(help))
        }
    }
}

/// Which bodies a rule is for, as the first and as the second of a pair, and how narrow it is.
struct Matches {
    of: Option<[Vec<bool>; 2]>,
    rank: Rank,
}

impl Matches {
    fn new<const D: usize>(rule: &AutoContact, parts: &[Part<D>]) -> Result<Self> {
        let Some(of) = &rule.of else { return Ok(Self { of: None, rank: Rank::default() }) };
        let patterns = [pattern(&of[0])?, pattern(&of[1])?];
        let names = || parts.iter().map(|part| part.spec.name.value.as_str());
        let matching = patterns.each_ref().map(|pattern| names().map(|name| pattern.matches(name)).collect::<Vec<_>>());
        if let Some((nothing, _)) = of.iter().zip(&matching).find(|(_, matching)| !matching.contains(&true)) {
            let help = format!("the bodies of the scene: {}", few(names()).join(", "));
            return Err(Error::scene(&nothing.place, format!("no body matches `{}`", nothing.value)).help(help));
        }
        let [a, b] = patterns.map(|pattern| pattern.rank());
        Ok(Self { of: Some(matching), rank: std::array::from_fn(|i| a[i] + b[i]) })
    }

    fn are_for(&self, a: usize, b: usize) -> bool {
        self.of.as_ref().is_none_or(|[first, second]| (first[a] && second[b]) || (first[b] && second[a]))
    }
}

/// The narrowest of the rules for two bodies, and another one that is as narrow.
fn narrowest(rules: &[Matches], a: usize, b: usize) -> Option<(usize, Option<usize>)> {
    let own = || (0..rules.len()).filter(|&rule| rules[rule].are_for(a, b));
    let rank = own().map(|rule| rules[rule].rank).max()?;
    let mut best = own().filter(|&rule| rules[rule].rank == rank);
    Some((best.next()?, best.next()))
}

/// A rule in a refusal, and its place.
fn title(rule: &AutoContact) -> (String, &Place) {
    match &rule.of {
        None => ("different bodies".to_owned(), &rule.contact.between[0].place),
        Some([a, b]) => (format!("{} - {}", a.value, b.value), &a.place),
    }
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
