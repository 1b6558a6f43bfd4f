//! Pairs of smooth faces: surfaces are split where one of them has an edge, and boundary facets of different bodies that face each other
//! within a distance are found by rules of the scene.

use super::carrier;
use super::part::SceneBody;
use super::patterns::{pattern, tie};
use crate::contact::pieces::{BoxTree, Cut, Reach};
use crate::contact::{Side, SmoothFaces};
use crate::error::{Error, Place, Result, few};
use crate::fem::{Facets, unit};
use crate::problem::contact::{AutoContact, Carrier};
use crate::problem::pattern::Rank;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet, HashSet};

/// A table of the scene.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub enum ContactEntry {
    /// Index of a contact that names its surfaces.
    Named(usize),
    /// Index of the rule by which the pair was found.
    Found(usize),
}

/// Two surfaces that form pairs.
pub struct SurfacePair<'a, const D: usize> {
    /// The table of the scene.
    pub entry: ContactEntry,
    /// Indices of the bodies.
    pub bodies: [usize; 2],
    /// Names of the surfaces; those of the bodies if the pair was found.
    pub names: [&'a str; 2],
    /// Whether the second surface carries the contact points.
    pub swapped: bool,
    /// The pairs: one, or several where surfaces have edges.
    pub pieces: Vec<PairPart<D>>,
}

/// Return the pairs of bodies that come near each other. Pairs in `named` are excluded; they are indices of bodies, the smaller
/// one first. The narrowest rule for two bodies decides alone whether they are a pair.
///
/// All facets that could have a partner are collected first, so that the nodal normals are those of smooth surfaces. Then only
/// the facets with a common piece are kept.
///
/// # Errors
/// A pattern matches no body, or two rules match a pair equally well.
pub fn find<'a, const D: usize>(
    rules: &[AutoContact],
    cut: Cut<D>,
    parts: &'a [SceneBody<D>],
    named: &HashSet<[usize; 2]>,
    carriers: &[Carrier],
) -> Result<Vec<SurfacePair<'a, D>>> {
    if rules.is_empty() {
        return Ok(Vec::new());
    }
    let whole: Vec<Side<D>> =
        parts.iter().map(|part| part.side(&part.spec.name.value, part.space.boundary(), 180.0)).collect();
    let mut all = Vec::new();
    for possible in possible(rules, parts, &whole, named)? {
        let mut found = meeting(rules, cut, &whole, &possible);
        if found.pieces.is_empty() {
            continue;
        }
        if let Some(other) = possible.other {
            let [a, b] = possible.bodies.map(|body| &parts[body].spec.name.value);
            let [(own, _), (other, place)] = [possible.rule, other].map(|number| title(&rules[number]));
            return Err(tie(&format!("{a} - {b}"), [&own, &other], place));
        }
        let table = rules[possible.rule].contact.table;
        found.swapped = carrier::is_second(parts, possible.bodies, possible.near.each_ref(), table, carriers);
        all.push(found);
    }
    Ok(all)
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
    parts: &[SceneBody<D>],
    whole: &[Side<D>],
    named: &HashSet<[usize; 2]>,
) -> Result<Vec<Possible<D>>> {
    let matches = rules.iter().map(|rule| Matches::new(rule, parts)).collect::<Result<Vec<_>>>()?;
    let farthest = rules.iter().map(distance).fold(0.0, f64::max);
    let searches: Vec<BoxTree<D>> = whole.iter().map(BoxTree::new).collect();
    let bodies = BoxTree::of_boxes(whole.iter().map(Side::extent));
    let mut all = Vec::new();
    for a in 0..parts.len() {
        let mut others: Vec<usize> = bodies.near_box(whole[a].extent(), farthest).collect();
        others.retain(|&b| b > a && !named.contains(&[a, b]));
        others.sort_unstable();
        for b in others {
            let Some((rule, other)) = narrowest(&matches, a, b) else { continue };
            let spec = &rules[rule].contact;
            let reach = Reach::between(&whole[a], &whole[b], spec.angle, spec.distance);
            let near = candidates(&whole[a], &whole[b], &searches[b], &reach);
            if near.iter().all(|facets| facets.count() > 0) {
                all.push(Possible { bodies: [a, b], near, rule, other });
            }
        }
    }
    Ok(all)
}

/// Return the pairs that two possible bodies form, which are none if their facets have no common piece.
fn meeting<'a, const D: usize>(
    rules: &[AutoContact],
    cut: Cut<D>,
    whole: &[Side<'a, D>],
    possible: &Possible<D>,
) -> SurfacePair<'a, D> {
    let near = |k: usize| {
        let Side { name, space, prescribed, frame, .. } = whole[possible.bodies[k]];
        Side::new(name, space, possible.near[k].clone(), prescribed, frame, rules[possible.rule].contact.edge)
    };
    let (spec, a, b) = (&rules[possible.rule].contact, near(0), near(1));
    let reach = Reach::between(&a, &b, spec.angle, spec.distance);
    let mut pieces = FaceSplit::new([&a, &b], spec.edge, cut, &reach).into_pieces();
    pieces.sort_by_key(|piece| piece.face);
    let names = possible.bodies.map(|body| whole[body].name);
    SurfacePair { entry: ContactEntry::Found(possible.rule), bodies: possible.bodies, names, swapped: false, pieces }
}

/// Check that every rule found a pair among the `found` ones.
///
/// # Errors
/// A rule found no pair; the first such rule is reported.
pub fn all_find_some(rules: &[AutoContact], found: impl Iterator<Item = ContactEntry>) -> Result<()> {
    let of_rule = |entry| if let ContactEntry::Found(rule) = entry { Some(rule) } else { None };
    let fruitful: BTreeSet<usize> = found.filter_map(of_rule).collect();
    let Some(rule) = (0..rules.len()).find(|rule| !fruitful.contains(rule)) else { return Ok(()) };
    let (bodies, place) = title(&rules[rule]);
    let message = format!("no facets of {bodies} face each other within {}", distance(&rules[rule]));
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
    fn new<const D: usize>(rule: &AutoContact, parts: &[SceneBody<D>]) -> Result<Self> {
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

/// Return how far apart the facets of a pair may be.
fn distance(rule: &AutoContact) -> f64 {
    rule.contact.distance.unwrap_or(f64::INFINITY)
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

/// A part of two surfaces that becomes one pair.
pub struct PairPart<const D: usize> {
    /// Facets of both surfaces.
    pub facets: [Facets<D>; 2],
    /// Number of the face of each surface, from 1; `None` if no other face of the surface is in a pair.
    pub face: [Option<usize>; 2],
    /// Number of facets of each surface that belong to no pair. One piece of two surfaces counts them.
    pub idle: [usize; 2],
    /// Nodes of the facets of both surfaces that face each other, but are too far apart, with or without pairs.
    pub far: [BTreeSet<u32>; 2],
}

impl<const D: usize> PairPart<D> {
    /// Exchange the two surfaces.
    pub fn swap(&mut self) {
        self.facets.swap(0, 1);
        self.face.swap(0, 1);
        self.idle.swap(0, 1);
        self.far.swap(0, 1);
    }
}

/// Which facets of each of two surfaces are in a pair.
type Used = [Vec<bool>; 2];

/// Faces of two surfaces that become one pair.
struct FaceGroup {
    faces: [BTreeSet<usize>; 2],
    used: Used,
}

/// Two surfaces with their faces, and the facets with common pieces for each two faces that have some.
pub struct FaceSplit<'a, const D: usize> {
    sides: [&'a Side<'a, D>; 2],
    faces: [SmoothFaces; 2],
    met: BTreeMap<[usize; 2], Used>,
    /// Nodes of the facets of both surfaces that face each other, but are too far apart.
    far: [BTreeSet<u32>; 2],
}

impl<'a, const D: usize> FaceSplit<'a, D> {
    /// Find the faces of two surfaces between edges of more than `edge` degrees, and the facets of each two faces that have common
    /// pieces. The normals of a face are those of its own facets, while all facets of the other surface take part, so that the
    /// nearest one is the partner.
    pub fn new(sides: [&'a Side<'a, D>; 2], edge: f64, cut: Cut<D>, reach: &Reach) -> Self {
        let faces = sides.map(|side| SmoothFaces::new(side, edge));
        let mut met: BTreeMap<[usize; 2], Used> = BTreeMap::new();
        let mut far = [BTreeSet::new(), BTreeSet::new()];
        for face in 0..faces[0].count {
            let is_own: Vec<bool> = faces[0].of_facet.iter().map(|&of| of == face).collect();
            let own: Vec<usize> = (0..is_own.len()).filter(|&i| is_own[i]).collect();
            let common = cut(&sides[0].only(&is_own, edge), sides[1], reach);
            for (i, j) in common.far() {
                far[0].extend(sides[0].facets.facet(own[i]));
                far[1].extend(sides[1].facets.facet(j));
            }
            for point in common.points {
                let (i, j) = (own[point.facet_a], point.facet_b);
                let none = || sides.map(|side| vec![false; side.facets.count()]);
                let used = met.entry([face, faces[1].of_facet[j]]).or_insert_with(none);
                (used[0][i], used[1][j]) = (true, true);
            }
        }
        Self { sides, faces, met, far }
    }

    /// Return the pairs with the facets that have common pieces, and no others. The list is empty if nothing has common pieces.
    pub fn into_pieces(self) -> Vec<PairPart<D>> {
        let groups = self.groups();
        groups.iter().map(|group| self.piece(group, groups.len() > 1)).collect()
    }

    /// Return the same pairs with all facets of their faces. A facet without a partner belongs to the first pair of its face.
    pub fn into_whole_pieces(self) -> Vec<PairPart<D>> {
        let mut groups = self.groups();
        let mut taken = self.all_used();
        for FaceGroup { faces, used } in &mut groups {
            for side in 0..2 {
                let of_facet = &self.faces[side].of_facet;
                for i in (0..of_facet.len()).filter(|&i| faces[side].contains(&of_facet[i])) {
                    used[side][i] |= !taken[side][i];
                    taken[side][i] = true;
                }
            }
        }
        let mut pieces: Vec<PairPart<D>> = groups.iter().map(|group| self.piece(group, groups.len() > 1)).collect();
        if let Some(first) = pieces.first_mut() {
            first.idle = taken.map(|taken| taken.iter().filter(|taken| !**taken).count());
        }
        pieces
    }

    /// Return one group of all faces that meet, or one of each two faces if faces of a surface have an edge between them.
    fn groups(&self) -> Vec<FaceGroup> {
        let all = self.all_used();
        let has_edge = |side: usize| self.faces[side].meet(self.sides[side], &all[side]);
        if has_edge(0) || has_edge(1) {
            let of_two = |(faces, used): (&[usize; 2], &Used)| FaceGroup {
                faces: faces.map(|face| BTreeSet::from([face])),
                used: used.clone(),
            };
            return self.met.iter().map(of_two).collect();
        }
        let faces = [0, 1].map(|side| self.met.keys().map(|faces| faces[side]).collect());
        if self.met.is_empty() { Vec::new() } else { vec![FaceGroup { faces, used: all }] }
    }

    /// Return the facets of both surfaces that have common pieces.
    fn all_used(&self) -> Used {
        let of_side = |side: usize| {
            let is_used = |i: usize| self.met.values().any(|used| used[side][i]);
            (0..self.sides[side].facets.count()).map(is_used).collect()
        };
        [of_side(0), of_side(1)]
    }

    fn piece(&self, group: &FaceGroup, is_one_of_several: bool) -> PairPart<D> {
        let facets = [0, 1].map(|side| self.sides[side].facets.only(&group.used[side]));
        let number = |side: usize| {
            let face = *group.faces[side].first().filter(|_| is_one_of_several)?;
            self.number(side, face)
        };
        PairPart { facets, face: [number(0), number(1)], idle: [0, 0], far: self.far.clone() }
    }

    /// Return the number of a face among the faces of its surface that are in pairs, from 1; `None` if it is the only one. Faces are
    /// in the order of their middles by x, then by y and z.
    ///
    /// Coordinates that differ by less than a thousandth of the surface count as equal, so that numbers do not depend on the mesh.
    fn number(&self, side: usize, face: usize) -> Option<usize> {
        let all: BTreeSet<usize> = self.met.keys().map(|faces| faces[side]).collect();
        let [low, high] = self.sides[side].extent();
        let size = (0..D).map(|c| high[c] - low[c]).fold(0.0, f64::max);
        let place = |face: usize| {
            let middle = self.faces[side].middle(self.sides[side], face);
            ((0..D).map(|c| (1e3 * (middle[c] - low[c]) / size).round() as i64).collect::<Vec<_>>(), face)
        };
        (all.len() > 1).then(|| 1 + all.iter().filter(|&&other| place(other) < place(face)).count())
    }
}
