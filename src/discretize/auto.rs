//! Pairs that rules of the scene find: boundary facets of different bodies that face each other within a distance.

use super::patterns::pattern;
use super::scene_body::SceneBody;
use crate::contact::Side;
use crate::contact::pieces::{BoxTree, Cut, Reach};
use crate::error::{Error, Located, Place, Result, few};
use crate::fem::{Facets, unit};
use crate::problem::ContactSpec;
use std::collections::{BTreeSet, HashSet};

/// Two surfaces that form a pair.
pub struct SurfacePair<'a, const D: usize> {
    /// The contact of the scene, or the rule by which the pair was found.
    pub spec: &'a ContactSpec,
    /// Indices of the bodies.
    pub bodies: [usize; 2],
    /// The surfaces. If the pair was found, they have the names of their bodies.
    pub sides: [Side<'a, D>; 2],
    /// Nodes of the facets of both surfaces that face each other, but are too far apart, with or without pairs.
    pub far: [BTreeSet<u32>; 2],
    /// Whether the order of the scene was reversed, so that the first side carries the points.
    pub swapped: bool,
}

/// Return the pairs of bodies that come near each other. Pairs in `named` are excluded; they are indices of bodies, the
/// smaller one first. The last rule for two bodies decides alone whether they are a pair.
///
/// All facets that could have a partner are collected first, so that the nodal normals are those of smooth surfaces.
/// Then only the facets with a common piece are kept.
///
/// # Errors
/// A pattern matches no body.
pub fn find<'a, const D: usize>(
    rules: &[&'a ContactSpec],
    cut: Cut<D>,
    parts: &'a [SceneBody<D>],
    named: &HashSet<[usize; 2]>,
) -> Result<Vec<SurfacePair<'a, D>>> {
    if rules.is_empty() {
        return Ok(Vec::new());
    }
    let whole: Vec<Side<D>> =
        parts.iter().map(|part| part.side(&part.spec.name.value, part.mesh.space.boundary(), 180.0)).collect();
    let mut all: Vec<_> = possible(rules, parts, &whole, named)?.into_iter().map(|pair| meeting(cut, pair)).collect();
    all.retain(|found| found.sides[0].facets.count() > 0);
    Ok(all)
}

/// Return the pairs of bodies to which a rule applies, the body with the smaller index first, with the facets that
/// could have a partner.
fn possible<'a, const D: usize>(
    rules: &[&'a ContactSpec],
    parts: &[SceneBody<D>],
    whole: &[Side<'a, D>],
    named: &HashSet<[usize; 2]>,
) -> Result<Vec<SurfacePair<'a, D>>> {
    let matching = rules.iter().map(|rule| matching(rule, parts)).collect::<Result<Vec<_>>>()?;
    let are_for = |[first, second]: &[Vec<bool>; 2], a: usize, b: usize| first[a] && second[b] || first[b] && second[a];
    let farthest = rules.iter().copied().map(distance).fold(0.0, f64::max);
    let searches: Vec<BoxTree<D>> = whole.iter().map(BoxTree::new).collect();
    let bodies = BoxTree::of_boxes(whole.iter().map(Side::extent));
    let mut all = Vec::new();
    for a in 0..parts.len() {
        let mut others: Vec<usize> = bodies.near_box(whole[a].extent(), farthest).collect();
        others.retain(|&b| b > a && !named.contains(&[a, b]));
        others.sort_unstable();
        for b in others {
            let Some(rule) = matching.iter().rposition(|bodies| are_for(bodies, a, b)) else { continue };
            let rule = rules[rule];
            let reach = Reach::between(&whole[a], &whole[b], rule.angle, rule.distance);
            let near = candidates(&whole[a], &whole[b], &searches[b], &reach);
            if near.iter().all(|facets| facets.count() > 0) {
                let [near_a, near_b] = near;
                let side = |body: usize, facets: Facets<D>| {
                    let Side { name, space, prescribed, frame, .. } = whole[body];
                    Side::new(name, space, facets, prescribed, frame, rule.edge)
                };
                all.push(SurfacePair::new(rule, [a, b], [side(a, near_a), side(b, near_b)]));
            }
        }
    }
    Ok(all)
}

/// Return a possible pair on the facets with a common piece; there may be none.
fn meeting<'a, const D: usize>(cut: Cut<D>, possible: SurfacePair<'a, D>) -> SurfacePair<'a, D> {
    let SurfacePair { spec, bodies, sides: [a, b], .. } = possible;
    let common = cut(&a, &b, &Reach::between(&a, &b, spec.angle, spec.distance));
    let mut far = [BTreeSet::new(), BTreeSet::new()];
    for (i, j) in common.far() {
        far[0].extend(a.facets.facet(i));
        far[1].extend(b.facets.facet(j));
    }
    let mut used = [vec![false; a.facets.count()], vec![false; b.facets.count()]];
    for point in &common.points {
        (used[0][point.facet_a], used[1][point.facet_b]) = (true, true);
    }
    let sides = [a.only(&used[0]), b.only(&used[1])];
    SurfacePair { far, ..SurfacePair::new(spec, bodies, sides) }
}

/// Check that every rule found a pair. `found` are the numbers of the tables of all pairs.
///
/// # Errors
/// A rule found no pair; the first such rule is reported.
pub fn all_find_some(rules: &[&ContactSpec], found: impl Iterator<Item = usize> + Clone) -> Result<()> {
    let Some(rule) = rules.iter().find(|rule| !found.clone().any(|table| table == rule.table)) else { return Ok(()) };
    let (bodies, place) = title(rule);
    let message = format!("no facets of {bodies} face each other within {}", distance(rule));
    let help = match rules.len() {
        1 => "a larger distance may find some",
        _ => "a larger distance may find some, unless later rules or contacts with names have all these pairs",
    };
    Err(Error::scene(place, message).help(help))
}

/// Return whether a rule applies to each body, as the first and as the second of a pair.
fn matching<const D: usize>(rule: &ContactSpec, parts: &[SceneBody<D>]) -> Result<[Vec<bool>; 2]> {
    let Some(of) = &rule.of else { return Ok([vec![true; parts.len()], vec![true; parts.len()]]) };
    let names = || parts.iter().map(|part| part.spec.name.value.as_str());
    let matching = |name: &Located<String>| {
        let pattern = pattern(name)?;
        let found: Vec<bool> = names().map(|body| pattern.matches(body)).collect();
        if found.contains(&true) {
            return Ok(found);
        }
        let help = format!("the bodies of the scene: {}", few(names()).join(", "));
        Err(Error::scene(&name.place, format!("no body matches `{}`", name.value)).help(help))
    };
    Ok([matching(&of[0])?, matching(&of[1])?])
}

/// Return the name of a rule in an error, and its place in the scene.
fn title(rule: &ContactSpec) -> (String, &Place) {
    match &rule.of {
        None => ("different bodies".to_owned(), &rule.between[0].place),
        Some([a, b]) => (format!("{} - {}", a.value, b.value), &a.place),
    }
}

/// Return how far apart the facets of a pair may be.
fn distance(rule: &ContactSpec) -> f64 {
    rule.distance.unwrap_or(f64::INFINITY)
}

/// Return the facets of two bodies with opposed normals and with boxes within the distance.
fn candidates<const D: usize>(a: &Side<D>, b: &Side<D>, search: &BoxTree<D>, reach: &Reach) -> [Facets<D>; 2] {
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
