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

/// A found pair: the index of its rule and its two surfaces, which are named after the bodies.
pub type Found<'a, const D: usize> = (usize, [Surface<'a, D>; 2]);

/// Return the pairs of bodies that come near each other. Pairs in `named` are excluded; they are indices of bodies, the smaller
/// one first. The narrowest rule for two bodies decides alone whether they are a pair.
///
/// All facets that could have a partner are collected first, so that the nodal normals are those of smooth surfaces. Then only
/// the facets with a common piece are kept.
///
/// # Errors
/// A rule finds nothing, a pattern matches no body, or two rules match a pair equally well.
pub fn find<'a, const D: usize>(
    rules: &[AutoContact],
    cut: Cut<D>,
    parts: &'a [Part<D>],
    named: &HashSet<[usize; 2]>,
) -> Result<Vec<Found<'a, D>>> {
    if rules.is_empty() {
        return Ok(Vec::new());
    }
    let of_part = |part: &'a Part<D>| {
        let (name, facets) = (&part.spec.name.value, part.space.boundary());
        Side::new(name, &part.space, facets, &part.held.prescribed, &part.held.frame)
    };
    let whole: Vec<Side<D>> = parts.iter().map(of_part).collect();
    let possible = possible(rules, parts, &whole, named)?;
    let meeting = meeting(rules, cut, &whole, &possible);
    let mut found = Vec::new();
    for (index, possible) in possible.into_iter().enumerate() {
        let mut used = possible.near.each_ref().map(|facets| vec![false; facets.count()]);
        for &facets in &meeting[index] {
            used.iter_mut().zip(facets).for_each(|(used, facet)| used[facet as usize] = true);
        }
        if !used[0].contains(&true) {
            continue;
        }
        if let Some(other) = possible.other {
            let [a, b] = possible.bodies.map(|body| &parts[body].spec.name.value);
            let [(own, _), (other, place)] = [possible.rule, other].map(|number| title(&rules[number]));
            return Err(tie(&format!("{a} - {b}"), [&own, &other], place));
        }
        let surface = |side: usize| {
            let body = possible.bodies[side];
            Surface { body, name: parts[body].spec.name.value.as_str(), facets: possible.near[side].only(&used[side]) }
        };
        found.push((possible.rule, [surface(0), surface(1)]));
    }
    all_find_some(rules, &found)?;
    Ok(found)
}

/// Two bodies to which a rule applies, with the facets that could have a partner.
struct Possible<const D: usize> {
    /// Indices of the bodies, the smaller one first.
    bodies: [usize; 2],
    /// Facets of each body that could have a partner.
    near: [Facets<D>; 2],
    /// Index of the narrowest rule for the bodies.
    rule: usize,
    /// Index of another rule that is as narrow.
    other: Option<usize>,
}

fn possible<const D: usize>(
    rules: &[AutoContact],
    parts: &[Part<D>],
    whole: &[Side<D>],
    named: &HashSet<[usize; 2]>,
) -> Result<Vec<Possible<D>>> {
    let matches = rules.iter().map(|rule| Matches::new(rule, parts)).collect::<Result<Vec<_>>>()?;
    let farthest = rules.iter().map(|rule| rule.distance).fold(0.0, f64::max);
    let searches: Vec<Search<D>> = whole.iter().map(Search::new).collect();
    let bodies = Search::of_boxes(whole.iter().map(Side::extent));
    let mut all = Vec::new();
    for a in 0..parts.len() {
        let mut others: Vec<usize> = bodies.near_box(whole[a].extent(), farthest).collect();
        others.retain(|&b| b > a && !named.contains(&[a, b]));
        others.sort_unstable();
        for b in others {
            let Some((rule, other)) = narrowest(&matches, a, b) else { continue };
            let reach = within(&whole[a], &whole[b], rules[rule].distance, rules[rule].contact.angle);
            let near = candidates(&whole[a], &whole[b], &searches[b], &reach);
            if near.iter().all(|facets| facets.count() > 0) {
                all.push(Possible { bodies: [a, b], near, rule, other });
            }
        }
    }
    Ok(all)
}

/// Pairs of facets with a common piece, each as indices into the near facets of both sides.
type Meeting = Vec<[u32; 2]>;

/// Return the pairs of facets with a common piece, for each two possible bodies.
fn meeting<const D: usize>(
    rules: &[AutoContact],
    cut: Cut<D>,
    whole: &[Side<D>],
    possible: &[Possible<D>],
) -> Vec<Meeting> {
    let mut all = Vec::new();
    for possible in possible {
        let side = |k: usize| {
            let Side { name, space, prescribed, frame, .. } = whole[possible.bodies[k]];
            Side::new(name, space, possible.near[k].clone(), prescribed, frame)
        };
        let (rule, side_a, side_b) = (&rules[possible.rule], side(0), side(1));
        let reach = within(&side_a, &side_b, rule.distance, rule.contact.angle);
        let pieces = cut(&side_a, &side_b, &reach).points;
        let mut facets: Meeting = pieces.iter().map(|point| [point.facet_a as u32, point.facet_b as u32]).collect();
        facets.sort_unstable();
        facets.dedup();
        all.push(facets);
    }
    all
}

/// Check that every rule found a pair.
///
/// # Errors
/// A rule found no pair; the first such rule is reported.
fn all_find_some<const D: usize>(rules: &[AutoContact], found: &[Found<D>]) -> Result<()> {
    let is_fruitless = |rule: &usize| found.iter().all(|(number, _)| number != rule);
    let Some(rule) = (0..rules.len()).find(is_fruitless) else { return Ok(()) };
    let (bodies, place) = title(&rules[rule]);
    let message = format!("no facets of {bodies} face each other within {}", rules[rule].distance);
    let help = match rules.len() {
        1 => "a larger distance may find some",
        _ => "a larger distance may find some, unless narrower rules or contacts with names have all these pairs",
    };
    Err(Error::scene(place, message).help(help))
}

/// The bodies to which a rule applies, as the first and as the second of a pair, with the rank that says how narrow the rule is.
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

/// Return the narrowest rule for two bodies, and another one that is as narrow, if any.
fn narrowest(rules: &[Matches], a: usize, b: usize) -> Option<(usize, Option<usize>)> {
    let own = || (0..rules.len()).filter(|&rule| rules[rule].are_for(a, b));
    let rank = own().map(|rule| rules[rule].rank).max()?;
    let mut best = own().filter(|&rule| rules[rule].rank == rank);
    Some((best.next()?, best.next()))
}

/// Return the name of a rule in an error, and its place in the scene.
fn title(rule: &AutoContact) -> (String, &Place) {
    match &rule.of {
        None => ("different bodies".to_owned(), &rule.contact.between[0].place),
        Some([a, b]) => (format!("{} - {}", a.value, b.value), &a.place),
    }
}

/// Return how far the surfaces of a found pair may be apart, and how inclined, with `angle` in degrees.
pub fn within<const D: usize>(a: &Side<D>, b: &Side<D>, distance: f64, angle: f64) -> Reach {
    let reach = Reach::between(a, b, angle);
    Reach { gap: distance, overlap: distance.min(reach.overlap), ..reach }
}

/// Return the facets of two bodies with opposed normals and with boxes within the distance.
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
