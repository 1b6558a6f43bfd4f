//! Contacts of the scene on the mesh: the body that each surface bounds, and the side that carries the points.

use super::auto;
use super::find::{find_group, point};
use super::part::Part;
use super::surface::{ContactSurface, Surface};
use crate::contact::law::{self, OwnLaws};
use crate::contact::pieces::{Cut, Reach};
use crate::contact::{self, ContactPair, Fault, Fine, Side};
use crate::error::{Error, Located, Result};
use crate::fem::Facets;
use crate::mesh::{Group, Mesh};
use crate::problem::contact::{ContactSpec, Overlap};
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeSet, HashSet};

/// A pair with its origin.
pub struct Contact<const D: usize> {
    /// Place of the pair in the scene.
    pub origin: Origin,
    /// Arrays on which the method works.
    pub pair: ContactPair,
    /// Integration points, if they were requested.
    pub fine: Option<Fine<D>>,
    /// Whether side a, which carries the points, is the second of the two surfaces that the scene names.
    pub swapped: bool,
    /// Mesh of side a, for output.
    pub surface: ContactSurface,
}

/// The entry of the scene that a pair comes from.
#[derive(Clone, Serialize, Deserialize)]
pub enum Origin {
    /// Index of a contact that names its surfaces.
    Named(usize),
    /// Index of the rule by which the pair was found, and the names of the two bodies.
    Found(usize, [String; 2]),
}

impl Origin {
    /// Return the scene's description of the pair. `between` names the bodies if the pair was found.
    pub fn spec(&self, scene: &Scene) -> ContactSpec {
        match self {
            Self::Named(number) => scene.contacts[*number].clone(),
            Self::Found(rule, names) => {
                let mut spec = scene.auto[*rule].contact.clone();
                spec.between.iter_mut().zip(names).for_each(|(name, own)| name.value.clone_from(own));
                spec
            }
        }
    }
}

/// Return all pairs of the scene: first the named ones in the order of the file, then those that are found. `fine` requests
/// integration points.
///
/// # Errors
/// A surface is missing, bounds no body or several, or does not face its partner. A law or a gap has no value somewhere.
pub fn all<const D: usize>(
    scene: &Scene,
    mesh: &Mesh<D>,
    cut: Cut<D>,
    parts: &[Part<D>],
    fine: bool,
) -> Result<Vec<Contact<D>>> {
    let mut opposite = Vec::new();
    let mut named = HashSet::new();
    let owners = if scene.contacts.is_empty() { Owners::default() } else { Owners::new(parts) };
    for (number, spec) in scene.contacts.iter().enumerate() {
        let surface = |k: usize| {
            let name = &spec.between[k];
            let group = find_group(mesh, name, &[D - 1], "contact surface")?;
            let (body, facets) = owners.of(name, group, parts)?;
            Ok(Surface { body, name: &name.value, facets })
        };
        let surfaces = [surface(0)?, surface(1)?];
        let [a, b] = surfaces.each_ref().map(|surface| surface.body);
        if a == b {
            return Err(Error::scene(
                &spec.between[1].place,
                format!("both surfaces belong to body `{}`", parts[a].spec.name.value),
            )
            .help("contact of a body with itself is out of scope; make two bodies of it"));
        }
        named.insert([a.min(b), a.max(b)]);
        opposite.push(Opposite::new(Origin::Named(number), spec.clone(), None, parts, surfaces));
    }
    for (rule, surfaces) in auto::find(&scene.auto, cut, parts, &named)? {
        let origin = Origin::Found(rule, surfaces.each_ref().map(|surface| surface.name.to_owned()));
        let spec = origin.spec(scene);
        opposite.push(Opposite::new(origin, spec, Some(scene.auto[rule].distance), parts, surfaces));
    }
    opposite.into_iter().map(|pair| pair.assemble(&scene.laws, cut, fine)).collect()
}

/// Two surfaces that are to be a pair.
struct Opposite<'a, const D: usize> {
    origin: Origin,
    spec: ContactSpec,
    bodies: [usize; 2],
    a: Side<'a, D>,
    b: Side<'a, D>,
    /// Whether side a is the second of `spec.between`.
    swapped: bool,
    reach: Reach,
}

impl<'a, const D: usize> Opposite<'a, D> {
    /// Make the sides of a pair from two surfaces. They may be no farther apart than `distance`, if it is given.
    fn new(
        origin: Origin,
        spec: ContactSpec,
        distance: Option<f64>,
        parts: &'a [Part<D>],
        surfaces: [Surface<'a, D>; 2],
    ) -> Self {
        let [first, second] = surfaces.map(|Surface { body, name, facets }| {
            let held = &parts[body].held;
            (body, Side::new(name, &parts[body].space, facets, &held.prescribed, &held.frame))
        });
        // The finer side carries the points, whatever the order in the scene.
        let (fine_a, fine_b) = (first.1.mean_measure(), second.1.mean_measure());
        let equal = (fine_a - fine_b).abs() <= 1e-6 * fine_a;
        let swapped = if equal { first.1.name >= second.1.name } else { fine_a >= fine_b };
        let ((body_a, a), (body_b, b)) = if swapped { (second, first) } else { (first, second) };
        let reach = distance
            .map_or_else(|| Reach::between(&a, &b, spec.angle), |distance| auto::within(&a, &b, distance, spec.angle));
        Self { origin, spec, bodies: [body_a, body_b], a, b, swapped, reach }
    }

    /// Assemble the pair, and its integration points if `fine` requests them.
    fn assemble(self, laws: &OwnLaws, cut: Cut<D>, fine: bool) -> Result<Contact<D>> {
        let mut common = cut(&self.a, &self.b, &self.reach);
        if self.spec.touching {
            common.points.iter_mut().for_each(|point| point.gap = 0.0);
        }
        let Self { origin, spec, bodies, a, b, swapped, .. } = self;
        let gap = |x| spec.gap.eval(x);
        let law = |position: &[[f64; 3]]| law::make(&spec.layer, laws, position);
        let pair = contact::assemble(&a, &b, bodies, &common, &gap, &law).map_err(|fault| refuse(&spec, fault))?;
        let deepest = (0..pair.len()).min_by(|&q, &r| pair.gap[q].total_cmp(&pair.gap[r])).unwrap_or(0);
        if spec.overlap == Overlap::Refuse && pair.gap[deepest] < 0.0 {
            let (depth, at) = (-pair.gap[deepest], point(pair.position[deepest]));
            let message = format!("`{}` and `{}` overlap by {depth:.3e} at {at}", a.name, b.name);
            return Err(Error::scene(&spec.between[0].place, message)
                .help("move a body, give a larger gap, or let the layer take it: overlap = \"compress\""));
        }
        if let Some(field) = &spec.reference {
            let value = |&x: &[f64; 3]| field.eval_finite("the reference", x).map(drop);
            pair.position.iter().try_for_each(value).map_err(|error| error.because(of_pair(&spec)))?;
        }
        let surface = ContactSurface::new(&a, &pair);
        let fine = fine.then(|| Fine::new(&a, &b, &common, &pair, &gap, spec.touching));
        Ok(Contact { origin, pair, fine, swapped, surface })
    }
}

/// Return the reason that names the pair in an error at an expression. The table of the expression may be for many pairs.
fn of_pair(spec: &ContactSpec) -> String {
    let [a, b] = spec.between.each_ref().map(|name| &name.value);
    format!("it is for the contact of `{a}` and `{b}`")
}

fn refuse(spec: &ContactSpec, fault: Fault) -> Error {
    match fault {
        Fault::Law(error) => error.because(of_pair(spec)),
        Fault::NoPartner => {
            let names = [&spec.between[0].value, &spec.between[1].value];
            Error::scene(
                &spec.between[0].place,
                format!("`{}` and `{}` do not face each other anywhere", names[0], names[1]),
            )
            .help("a pair needs surfaces that lie opposite each other, with outer normals that point at each other; `winkler mesh` has their places")
        }
        Fault::Gap(x) => {
            spec.gap.eval_finite("the gap", x).err().map(|error| error.because(of_pair(spec))).unwrap_or_else(|| {
                let message = format!("the gap is beyond the range of numbers at {}", point(x));
                Error::scene(&spec.between[0].place, message)
            })
        }
    }
}

/// The bodies of every point of the mesh: (point, body), sorted.
#[derive(Default)]
struct Owners(Vec<(u32, usize)>);

impl Owners {
    fn new<const D: usize>(parts: &[Part<D>]) -> Self {
        let of_body = |(body, part): (usize, &Part<D>)| {
            part.space.mesh_points().map(move |point| (point, body)).collect::<Vec<_>>()
        };
        let mut all: Vec<(u32, usize)> = parts.iter().enumerate().flat_map(of_body).collect();
        all.sort_unstable();
        Self(all)
    }

    /// Return the bodies with points of a group.
    fn touching(&self, group: &Group) -> BTreeSet<usize> {
        let at = |&point: &u32| {
            let first = self.0.partition_point(|entry| entry.0 < point);
            self.0[first..].iter().take_while(move |entry| entry.0 == point).map(|entry| entry.1)
        };
        group.connectivity.iter().flat_map(at).collect()
    }

    /// Return the body that a contact surface bounds, with its facets there.
    ///
    /// # Errors
    /// The surface bounds no body or several, or only some of its facets bound the body.
    fn of<const D: usize>(
        &self,
        name: &Located<String>,
        group: &Group,
        parts: &[Part<D>],
    ) -> Result<(usize, Facets<D>)> {
        let mut found: Vec<(usize, Facets<D>)> = self
            .touching(group)
            .into_iter()
            .map(|body| (body, parts[body].space.facets(group)))
            .filter(|(_, facets)| facets.count() > 0)
            .collect();
        let all = group.connectivity.len() / group.stride;
        match (found.pop(), found.len()) {
            (Some((body, facets)), 0) if facets.count() == all => Ok((body, facets)),
            (Some((body, facets)), 0) => {
                let body = &parts[body].spec.name.value;
                let message =
                    format!("only {} of {all} facets of `{}` bound body `{body}`", facets.count(), name.value);
                Err(Error::scene(&name.place, message)
                    .help("a contact surface must lie on one body as a whole: split the physical group"))
            }
            (None, _) => {
                Err(Error::scene(&name.place, format!("surface `{}` bounds no body of the scene", name.value))
                    .help("add the body it belongs to, or name another surface"))
            }
            (Some((last, _)), _) => {
                let bodies = [found[0].0, last].map(|body| parts[body].spec.name.value.clone());
                let message = format!("surface `{}` bounds both `{}` and `{}`", name.value, bodies[0], bodies[1]);
                Err(Error::scene(&name.place, message)
                    .help("give each body a group of its own there (bodies share no nodes), or let contacts be found: between = \"auto\""))
            }
        }
    }
}
