//! Contacts of the scene on the mesh: the body that each surface bounds, the side that carries the points, and why two
//! surfaces do not face each other.

use super::auto::{self, SurfacePair};
use super::carrier;
use super::contact_surface::{ContactSurface, corners};
use super::groups::{Owners, find_group, point};
use super::scene_body::SceneBody;
use super::seal::{self, Seal, Sealing};
use crate::contact::law::{self, OwnLaws};
use crate::contact::pieces::{Cut, Intersection, Reach};
use crate::contact::{self, Chords, ContactPair, Fine, Mirrors, PairFault, Side, Tangents, Turns};
use crate::error::{Error, Located, Result};
use crate::fem::{Facets, jumping, minus, unit};
use crate::linalg::{bounds, dot};
use crate::mesh::{Group, Mesh};
use crate::problem::contact::{Carrier, ContactSpec, Overlap};
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeSet, HashMap, HashSet};
use std::rc::Rc;

/// A pair with its origin.
pub struct Contact<const D: usize> {
    /// Arrays on which the method works.
    pub pair: ContactPair,
    pub facts: ContactFacts,
    pub inputs: PairInputs<D>,
}

/// What a pair was made of, and what it has besides its arrays and facts.
pub struct PairInputs<const D: usize> {
    /// The contact of the scene, with the names of the two surfaces.
    spec: ContactSpec,
    /// Indices of the bodies; an obstacle follows all bodies.
    bodies: [usize; 2],
    /// Planes of symmetry at the ends of both sides.
    mirrors: [Mirrors<D>; 2],
    /// Whether its surfaces look away from each other, as the faces under head and nut of a bolt.
    pub is_through: bool,
    /// Whether a rule found it.
    is_found: bool,
    /// Integration points, if they were requested.
    pub fine: Option<Rc<Fine<D>>>,
}

/// The contacts of a problem.
pub struct Contacts<const D: usize> {
    /// All pairs, and what is known of each.
    pub all: Vec<Contact<D>>,
    /// Number of pairs whose surfaces were searched for common pieces.
    pub searched: usize,
}

/// The pairs of a problem on the same mesh.
pub struct KeptPairs<'a, const D: usize> {
    pub pairs: Vec<Contact<D>>,
    /// Rules that found some of them.
    pub rules: &'a [ContactSpec],
    /// Whether the material of each body is the same.
    pub is_material_same: Vec<bool>,
    /// Whether rules find the same pairs between the bodies.
    pub are_bodies_same: bool,
}

/// Facts of a pair besides its arrays.
#[derive(Serialize, Deserialize)]
pub struct ContactFacts {
    /// Number of its table in the scene.
    table: usize,
    /// Names of the two surfaces, which are those of the bodies if the pair was found.
    names: [String; 2],
    /// The overlap of the meshes, if facets make most of it.
    pub chords: Option<Chords>,
    /// Contact points where the pair ends because the surfaces are too far apart.
    pub ends: Vec<usize>,
    /// Whether side a, which carries the points, is the second of `names`.
    pub swapped: bool,
    /// Mesh of side a, for output.
    pub surface: ContactSurface,
    /// Facets of both sides that face each other.
    pub facing: Vec<FacingFacets>,
    /// The ways of a fluid along the surface, if the scene names two ends of it.
    pub seal: Option<Seal>,
}

/// A facet of side a and one of side b that face each other.
#[derive(Serialize, Deserialize)]
pub struct FacingFacets {
    /// Corners of both facets ([`corners`]). Before an obstacle both are the facet itself.
    pub facets: [[u32; 3]; 2],
    /// Contact points on the facet of side a.
    pub points: Vec<usize>,
}

impl FacingFacets {
    /// Return the facets of both sides with a common piece, sorted.
    fn all<const D: usize>(
        parts: &[SceneBody<D>],
        sides: [&Side<D>; 2],
        common: &Intersection<D>,
        pair: &ContactPair,
    ) -> Vec<Self> {
        // an obstacle has the facets of the body before it
        let on_mesh = pair.bodies.map(|body| &parts.get(body).unwrap_or(&parts[pair.bodies[0]]).mesh.points);
        let point_of = pair.point_of(sides[0].nodes.len());
        let met: BTreeSet<[usize; 2]> = common.points.iter().map(|point| [point.facet_a, point.facet_b]).collect();
        let facing = |met: [usize; 2]| {
            let facet =
                |k: usize| corners(sides[k].facets.facet(met[k])[..D].iter().map(|&node| on_mesh[k][node as usize]));
            let points = sides[0].on_facet(met[0]).iter().filter_map(|&at| point_of[at as usize]);
            Self { facets: [facet(0), facet(1)], points: points.collect() }
        };
        met.into_iter().map(facing).collect()
    }
}

impl ContactFacts {
    /// Return the description of the pair by the `contacts` of the scene. `between` names the bodies if the pair was
    /// found.
    pub fn spec(&self, contacts: &[ContactSpec]) -> ContactSpec {
        between(&contacts[self.table], self.names.clone())
    }

    /// Return which surface carries the points of a pair with these bodies, the carrier's first.
    pub fn carrier(&self, [a, b]: [usize; 2]) -> Carrier {
        let bodies = if self.swapped { [b, a] } else { [a, b] };
        Carrier { table: self.table, bodies, is_second: self.swapped }
    }
}

/// Return a contact of the scene between surfaces or bodies with these names.
fn between(spec: &ContactSpec, names: [String; 2]) -> ContactSpec {
    let mut spec = spec.clone();
    spec.between.iter_mut().zip(names).for_each(|(name, own)| name.value = own);
    spec
}

/// Return all pairs of the scene: first the named ones in the order of the file, then those that are found. `fine`
/// requests integration points. Pairs of an earlier problem that serve get the gap, the law and the supports of this
/// one.
///
/// # Errors
/// A surface is missing, bounds no body or several, or does not face its partner. A law or a gap has no value
/// somewhere.
pub fn all<const D: usize>(
    scene: &Scene,
    mesh: &Mesh<D>,
    cut: Cut<D>,
    parts: &[SceneBody<D>],
    fine: bool,
    mut kept: KeptPairs<D>,
) -> Result<Contacts<D>> {
    let points = parts.iter().zip(0..).filter(|_| scene.pairs().next().is_some());
    let owners =
        Owners::new(points.flat_map(|(part, body)| part.mesh.space.mesh_points().map(move |p| (p, body))).collect());
    let rules: Vec<&ContactSpec> = scene.rules().collect();
    let (mut all, mut searched, mut taken) = (Vec::new(), 0, HashSet::new());
    for spec in scene.pairs() {
        let pair = named(spec, mesh, &owners, parts)?.orient(scene, mesh, parts)?;
        taken.insert([pair.bodies[0].min(pair.bodies[1]), pair.bodies[0].max(pair.bodies[1])]);
        if let Some(contact) = kept.take(&pair, fine) {
            all.push(contact.renewed(spec, &scene.laws, parts)?);
        } else {
            searched += 1;
            all.extend(pair.assemble(scene, mesh, parts, cut, fine)?);
        }
    }
    let count = all.len();
    if searched == 0 && kept.has_found(&rules, scene, fine) {
        for contact in kept.pairs {
            let spec = &scene.contacts[contact.facts.table];
            all.push(contact.renewed(spec, &scene.laws, parts)?);
        }
    } else {
        for pair in auto::find(&rules, cut, parts, &taken)? {
            searched += 1;
            all.extend(pair.orient(scene, mesh, parts)?.assemble(scene, mesh, parts, cut, fine)?);
        }
    }
    if searched > 0 {
        refuse_second_layers(scene, &all[..count])?;
    }
    auto::all_find_some(&rules, all.iter().map(|contact| contact.facts.table))?;
    Ok(Contacts { all, searched })
}

impl<const D: usize> KeptPairs<'_, D> {
    /// Return the pair of an earlier problem that serves as this one, if there is one.
    fn take(&mut self, pair: &SurfacePair<D>, fine: bool) -> Option<Contact<D>> {
        let serves = |contact: &Contact<D>| {
            let (PairInputs { spec, bodies, mirrors, .. }, is_swapped) = (&contact.inputs, contact.facts.swapped);
            let [a, b] = &pair.sides;
            spec.has_points_of(pair.spec)
                && !contact.pair.is_turned
                && (*bodies, is_swapped) == (pair.bodies, pair.swapped)
                && (&mirrors[0], &mirrors[1]) == (&a.mirrors, &b.mirrors)
                && (!fine || self.has_fine(contact, pair.spec))
        };
        let place = self.pairs.iter().position(serves)?;
        Some(self.pairs.remove(place))
    }

    /// Return whether the integration points of a pair serve, which know its gap, and where law or material jump.
    fn has_fine(&self, contact: &Contact<D>, spec: &ContactSpec) -> bool {
        let PairInputs { spec: earlier, bodies, fine, .. } = &contact.inputs;
        let [before, now] = [earlier, spec].map(|spec| &spec.layer);
        fine.is_some()
            && earlier.gap == spec.gap
            && (before == now || before.is_uniform() && now.is_uniform())
            && bodies.iter().all(|&body| self.is_material_same.get(body).is_none_or(|is_same| *is_same))
    }

    /// Return whether rules find the pairs that are left.
    fn has_found(&self, rules: &[&ContactSpec], scene: &Scene, fine: bool) -> bool {
        let is_same = |(a, b): (&ContactSpec, &&ContactSpec)| a.has_points_of(b);
        self.are_bodies_same
            && self.rules.len() == rules.len()
            && self.rules.iter().zip(rules).all(is_same)
            && self.pairs.iter().all(|contact| {
                let has_fine = || self.has_fine(contact, &scene.contacts[contact.facts.table]);
                contact.inputs.is_found && !contact.pair.is_turned && (!fine || has_fine())
            })
    }
}

impl<const D: usize> Contact<D> {
    /// Return the pair with the supports of these bodies, and with gap and law of `spec`.
    fn renewed(mut self, spec: &ContactSpec, laws: &OwnLaws, parts: &[SceneBody<D>]) -> Result<Self> {
        let spec = between(spec, self.facts.names.clone());
        let Self { pair, inputs, .. } = &mut self;
        pair.bodies = inputs.bodies;
        for (side, part) in inputs.bodies.iter().map(|&body| parts.get(body)).enumerate() {
            let held = part.map(|part| &part.mesh.held);
            held.iter().for_each(|held| pair.hold(side, &held.frame, &held.prescribed));
        }
        pair.offset = 0.0;
        pair.law = law::of_pair(&spec, laws, &pair.position).map_err(|error| error.because(of_pair(&spec)))?;
        pair.set_gap(&|x| spec.gap.eval(x)).map_err(|fault| refuse(&spec, fault, String::new))?;
        check(pair, &spec)?;
        inputs.spec = spec;
        Ok(self)
    }
}

/// Check the overlap of a pair, and the pressure that is known for it.
///
/// # Errors
/// The bodies overlap where the scene refuses that, or the pressure has no value at a point.
fn check(pair: &ContactPair, spec: &ContactSpec) -> Result<()> {
    let deepest = (0..pair.len()).min_by(|&q, &r| pair.gap[q].total_cmp(&pair.gap[r])).unwrap_or(0);
    if spec.overlap == Overlap::Refuse && pair.gap[deepest] < 0.0 {
        let (depth, at) = (-pair.gap[deepest], point(pair.position[deepest]));
        let message = format!("`{}` and `{}` overlap by {depth:.3e} at {at}", pair.surfaces[0], pair.surfaces[1]);
        return Err(Error::scene(&spec.between[0].place, message)
            .help("move a body, give a larger gap, or let the layer take it: overlap = \"compress\""));
    }
    if let Some(field) = &spec.reference {
        let value = |&x: &[f64; 3]| field.eval_finite("the reference", x).map(drop);
        pair.position.iter().try_for_each(value).map_err(|error| error.because(of_pair(spec)))?;
    }
    Ok(())
}

/// Refuse two layers between the same facets. A facet may face facets of several surfaces, each with a layer of its
/// own.
///
/// # Errors
/// Two of the contacts have a facet with the same partner.
fn refuse_second_layers<const D: usize>(scene: &Scene, contacts: &[Contact<D>]) -> Result<()> {
    let mut first: HashMap<[[u32; 3]; 2], usize> = HashMap::new();
    for (number, contact) in contacts.iter().enumerate().filter(|(_, contact)| contact.inputs.spec.slip.is_none()) {
        for facing in &contact.facts.facing {
            let mut facets = facing.facets;
            facets.sort_unstable();
            let before = *first.entry(facets).or_insert(number);
            if before != number {
                let [spec, other] = [contact, &contacts[before]].map(|contact| contact.facts.spec(&scene.contacts));
                let [[a, b], [c, d]] = [&spec, &other].map(|spec| spec.between.each_ref().map(|name| &name.value));
                let message = format!("`{a}` and `{b}` have facets in common with the contact of `{c}` and `{d}`");
                return Err(Error::scene(&spec.between[0].place, message)
                    .because("two layers would lie between the same facets")
                    .help("remove one of the contacts, or let their groups not overlap"));
            }
        }
    }
    Ok(())
}

/// Return the pair of the two surfaces that a contact names.
///
/// # Errors
/// A surface is missing, or bounds no body or several. Both belong to one body.
fn named<'a, const D: usize>(
    spec: &'a ContactSpec,
    mesh: &Mesh<D>,
    owners: &Owners,
    parts: &'a [SceneBody<D>],
) -> Result<SurfacePair<'a, D>> {
    let surface = |k: usize| {
        let group = find_group(mesh, &spec.between[k], &[D - 1], "contact surface")?;
        bounded(&spec.between[k], group, owners, parts)
    };
    let names = spec.between.each_ref().map(|name| name.value.as_str());
    let (first, on_first) = surface(0)?;
    if spec.obstacle {
        let side = parts[first].side(names[0], on_first, spec.edge);
        let obstacle = Side { name: names[1], ..side.clone() };
        // the obstacle gets its number among the rigid parts, which follow the bodies, once all pairs are known
        return Ok(SurfacePair::new(spec, [first, parts.len()], [side, obstacle]));
    }
    let (second, on_second) = surface(1)?;
    if first == second && spec.preload.is_none() && spec.slip.is_none() {
        let message = format!("both surfaces belong to body `{}`", parts[first].spec.name.value);
        return Err(Error::scene(&spec.between[1].place, message)
            .help("contact of a body with itself is out of scope; make two bodies of it"));
    }
    let sides = [parts[first].side(names[0], on_first, spec.edge), parts[second].side(names[1], on_second, spec.edge)];
    Ok(SurfacePair::new(spec, [first, second], sides))
}

impl<'a, const D: usize> SurfacePair<'a, D> {
    /// Return the pair of these surfaces.
    pub fn new(spec: &'a ContactSpec, bodies: [usize; 2], sides: [Side<'a, D>; 2]) -> Self {
        Self { spec, bodies, sides, far: Default::default(), swapped: false }
    }

    /// Let the first of the two sides be the one that carries the points.
    ///
    /// # Errors
    /// See [`seal::carrier`].
    fn orient(mut self, scene: &Scene, mesh: &Mesh<D>, parts: &[SceneBody<D>]) -> Result<Self> {
        let Self { spec, bodies, sides, .. } = &self;
        let facets = sides.each_ref().map(|side| &side.facets);
        let mut is_second = !spec.obstacle && carrier::is_second(parts, *bodies, facets, spec.table, &scene.carriers);
        if let Some(names) = &spec.seal {
            let surface = |k: usize| Some(Sealing { side: &sides[k], points: &parts.get(bodies[k])?.mesh.points });
            let surfaces: Vec<Sealing<D>> = (0..2).filter_map(surface).collect();
            is_second = seal::carrier(names, mesh, &surfaces, usize::from(is_second))? == 1;
        }
        if is_second {
            self.swapped = true;
            self.bodies.reverse();
            self.sides.reverse();
            self.far.reverse();
        }
        Ok(self)
    }

    /// Return what both surfaces have in common, the same with their distances if these do not count, and whether they
    /// look away from each other.
    fn common(&mut self, cut: Cut<D>) -> (Intersection<D>, Option<Intersection<D>>, bool) {
        let (spec, [a, b]) = (self.spec, &mut self.sides);
        let reach = Reach::between(a, b, spec.angle, spec.distance);
        let mut common = if spec.obstacle { Intersection::of_one(a) } else { cut(a, b, &reach) };
        if !spec.obstacle && a.towards(b, &common) {
            common = cut(a, b, &reach);
        }
        let mut is_through = false;
        if spec.preload.is_some() {
            let anywhere = cut(a, b, &Reach::anywhere(a, b, spec.angle));
            is_through = look_away(a, b, &anywhere);
            if is_through {
                common = anywhere;
            }
        }
        let apart = spec.slip.is_some().then(|| common.clone());
        if spec.is_touching() || is_through {
            common.close();
        }
        (common, apart, is_through)
    }

    /// Assemble the pair, and its integration points if `fine` requests them. Return none if the surfaces of a pair
    /// that was found have no common piece.
    fn assemble(
        mut self,
        scene: &Scene,
        mesh: &Mesh<D>,
        parts: &[SceneBody<D>],
        cut: Cut<D>,
        fine: bool,
    ) -> Result<Option<Contact<D>>> {
        let (common, apart, is_through) = self.common(cut);
        let is_touching = self.spec.is_touching() || is_through;
        let Self { spec, bodies, sides: [a, b], far: [far, _], swapped } = self;
        let is_found = spec.is_rule();
        let mut names = [a.name, b.name].map(str::to_owned);
        let surfaces = names.clone();
        if swapped {
            names.reverse();
        }
        let spec = between(spec, names.clone());
        let gap = |x| spec.gap.eval(x);
        let law = |position: &[[f64; 3]]| law::of_pair(&spec, &scene.laws, position);
        let mut pair = match contact::assemble(&a, &b, bodies, &common, &gap, &law) {
            Err(PairFault::NoPartner) if is_found => return Ok(None),
            assembled => assembled.map_err(|fault| refuse(&spec, fault, || why(&a, &b, cut)))?,
        };
        pair.surfaces = surfaces;
        check(&pair, &spec)?;
        let surface = ContactSurface::new(&a, &pair);
        let seal = seal::of_pair(&spec, mesh, &Sealing { side: &a, points: &parts[bodies[0]].mesh.points }, &surface)?;
        let jumps = |k: usize, side: &Side<D>| match parts.get(bodies[k]) {
            Some(part) => jumping(side.space, &part.elasticity, &side.facets.nodes),
            None => HashSet::new(),
        };
        let mut fine = if fine {
            let [mut at_a, at_b] = [jumps(0, &a), jumps(1, &b)];
            at_a.extend(a.layer_jumps(&law)?);
            Some(Fine::new(&a, &b, &common, &pair, &gap, is_touching, [&at_a, &at_b]))
        } else {
            None
        };
        if let Some(slip) = spec.slip {
            let tangents = Tangents::new(&pair.normal, slip.direction);
            let apart = apart.as_ref().unwrap_or(&common);
            let turns = Turns::new([&a, &b], apart, tangents);
            pair.slide(tangents, &turns, [&a, &b], apart);
            [&a, &b].into_iter().enumerate().for_each(|(k, side)| pair.hold(k, side.frame, side.prescribed));
            fine = fine.map(|fine| fine.slide(tangents, turns));
        }
        let chords = if is_touching { None } else { Chords::of(&a, &b, &common, &pair) };
        let ends = spec.distance.map_or(Vec::new(), |_| contact::ends(&a, &common, &pair, &far));
        let facing = FacingFacets::all(parts, [&a, &b], &common, &pair);
        let fine = fine.map(Rc::new);
        Ok(Some(Contact {
            pair,
            facts: ContactFacts { table: spec.table, names, chords, ends, swapped, surface, facing, seal },
            inputs: PairInputs { spec, bodies, mirrors: [a.mirrors, b.mirrors], is_through, is_found, fine },
        }))
    }
}

/// Overlap of two faces that look away from each other, at least, relative to the size of a facet: the plate between
/// them is thicker than a hundredth of its facets. The two faces of a cut overlap by less, since their meshes are of
/// one curve.
const THINNEST: f64 = 0.01;

/// Return whether two surfaces look away from each other, with the material of their bodies between them, as the faces
/// under head and nut of a bolt: each is behind the other, and body b does not lie before body a. Surfaces that overlap
/// are behind each other, too, but their bodies lie before each other.
fn look_away<const D: usize>(a: &Side<D>, b: &Side<D>, common: &Intersection<D>) -> bool {
    let [behind, whole] = common
        .points
        .iter()
        .fold([0.0; 2], |[behind, whole], point| [behind - point.weight * point.gap, whole + point.weight]);
    let middle = |side: &Side<D>| {
        let [low, high] = bounds(side.space.nodes.iter().copied());
        std::array::from_fn(|c| 0.5 * (low[c] + high[c]) + side.space.datum[c])
    };
    let between: [f64; D] = minus(middle(b), middle(a));
    let along: f64 = (0..a.facets.count()).map(|i| dot(&a.area(i), &between)).sum();
    behind > whole * THINNEST * a.mean_measure().powf(1.0 / (D - 1) as f64) && along <= 0.0
}

/// Return the reason that names the pair in an error at an expression. The table of the expression may be for many
/// pairs.
pub fn of_pair(spec: &ContactSpec) -> String {
    let [a, b] = spec.between.each_ref().map(|name| &name.value);
    format!("it is for the contact of `{a}` and `{b}`")
}

/// Return the error of a pair. `why` says where its surfaces are nearest to each other.
fn refuse(spec: &ContactSpec, fault: PairFault, why: impl Fn() -> String) -> Error {
    match fault {
        PairFault::Law(error) => error.because(of_pair(spec)),
        PairFault::NoPartner => {
            let [a, b] = spec.between.each_ref().map(|name| &name.value);
            let message = format!("`{a}` and `{b}` do not face each other anywhere");
            Error::scene(&spec.between[0].place, message)
                .because(why())
                .help("name the sides of the bodies that look at each other (`winkler mesh` has their places), move a body, or give a larger `distance` or `angle`")
        }
        PairFault::Gap(x) => {
            spec.gap.eval_finite("the gap", x).err().map(|error| error.because(of_pair(spec))).unwrap_or_else(|| {
                let message = format!("the gap is beyond the range of numbers at {}", point(x));
                Error::scene(&spec.between[0].place, message)
            })
        }
    }
}

/// Return the body that a contact surface bounds, with its facets there.
///
/// # Errors
/// The surface bounds no body or several, or only some of its facets bound the body.
fn bounded<const D: usize>(
    name: &Located<String>,
    group: &Group,
    owners: &Owners,
    parts: &[SceneBody<D>],
) -> Result<(usize, Facets<D>)> {
    let touching: BTreeSet<usize> = group.connectivity.iter().flat_map(|&point| owners.of(point)).collect();
    let mut found: Vec<(usize, Facets<D>)> = touching
        .into_iter()
        .map(|body| (body, parts[body].mesh.space.facets(group)))
        .filter(|(_, facets)| facets.count() > 0)
        .collect();
    let all = group.connectivity.len() / group.stride;
    match (found.pop(), found.len()) {
        (Some((body, facets)), 0) if facets.count() == all => Ok((body, facets)),
        (Some((body, facets)), 0) => {
            let body = &parts[body].spec.name.value;
            let message = format!("only {} of {all} facets of `{}` bound body `{body}`", facets.count(), name.value);
            Err(Error::scene(&name.place, message)
                .help("a contact surface must lie on one body as a whole: split the physical group"))
        }
        (None, _) => Err(Error::scene(&name.place, format!("surface `{}` bounds no body of the scene", name.value))
            .help("add the body it belongs to, or name another surface")),
        (Some((last, _)), _) => {
            let bodies = [found[0].0, last].map(|body| parts[body].spec.name.value.clone());
            let message = format!("surface `{}` bounds both `{}` and `{}`", name.value, bodies[0], bodies[1]);
            Err(Error::scene(&name.place, message)
                .help("give each body a group of its own there (bodies share no nodes), or let contacts be found: between = \"auto\""))
        }
    }
}

/// Return where two surfaces are nearest to each other along their normals, with the gap and the angle there.
fn why<const D: usize>(a: &Side<D>, b: &Side<D>, cut: Cut<D>) -> String {
    let common = cut(a, b, &Reach::anywhere(a, b, 90.0));
    // those in front come before those behind
    let key = |gap: f64| (gap < 0.0, gap.abs());
    let less = |(behind, p): (bool, f64), (other, q): (bool, f64)| behind.cmp(&other).then(p.total_cmp(&q));
    let Some(nearest) = common.points.iter().min_by(|p, q| less(key(p.gap), key(q.gap))) else {
        return "no facet of one lies before a facet of the other along its normal".to_owned();
    };
    let cosine = -dot(&unit(a.area(nearest.facet_a)), &unit(b.area(nearest.facet_b)));
    let at = point(a.space.in_scene(a.facets.point(nearest.facet_a, a.space, &nearest.at_a)));
    let angle = cosine.clamp(-1.0, 1.0).acos().to_degrees();
    format!(
        "where they are nearest, at {at}, the gap is {:.6} and their normals stand at {angle:.0} degrees",
        nearest.gap
    )
}
