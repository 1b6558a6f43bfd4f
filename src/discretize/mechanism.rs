//! Rigid motions of several bodies together that change no gap: a group that nothing holds, blocks that slide or turn as one.
//!
//! Each body is held by its neighbours then, and all of them are not. As with the motions of one body ([`gauge`]) there is a
//! solution if the loads do no work on such a motion: one node of one body is fixed against it, without reaction.

use super::gauge;
use super::part::Part;
use crate::contact::ContactPair;
use crate::ddm::{self, Motion, Motions, Segment};
use crate::fem::Space;
use crate::fem::rigid::{self, RigidMotion};
use crate::linalg::{Csr, axpy, dot, fit, kernel};
use nalgebra::{DMatrix, DVector};

/// A motion whose largest displacement is about one is free if the mean square of what it closes, and of what it moves supports by,
/// is no more than this.
const FREE: f64 = 1e-13;

/// A rigid motion of a whole group that closes more than this share of its displacement is out of reach of the mesh.
const FLAWED: f64 = 0.03;

/// Parts of a motion below this share of the largest are rounding.
const ROUNDING: f64 = 1e-6;

/// A body before it is assembled.
pub struct Draft {
    /// Its contact rows, pair by pair.
    pub segments: Vec<Segment>,
    /// These rows; columns: its dofs.
    pub rows: Csr,
    /// Rigid motions of the free body, in its dofs.
    pub free: Vec<RigidMotion>,
    /// Loads on its nodes.
    pub nodal_load: Vec<f64>,
    /// Loads on its dofs.
    pub load: Vec<f64>,
}

impl Draft {
    /// Motions as contact and loads see them.
    pub fn motions<const D: usize>(&self, all: &[RigidMotion]) -> Vec<Motion> {
        all.iter().map(|motion| super::trace_of::<D>(motion, &self.rows, &self.load)).collect()
    }
}

/// A free motion of several bodies together.
#[derive(Debug, Clone)]
pub struct Mechanism {
    /// The bodies that it moves.
    pub bodies: Vec<usize>,
    /// Its name.
    pub name: String,
    /// Work of the loads on it, as a share of what forces of their sizes could do.
    pub work: f64,
    /// The body that was fixed at one node against it; none if loads do work, or if no node outside the contact could serve.
    pub fixed: Option<usize>,
}

impl Mechanism {
    /// For a run that cannot begin.
    pub fn for_model(&self) -> ddm::Mechanism {
        ddm::Mechanism { bodies: self.bodies.clone(), motion: self.name.clone(), work: self.work }
    }
}

/// What was fixed, and what cannot be.
pub struct Fixed {
    /// Names of the motions of each body alone that are fixed.
    pub gauged: Vec<Vec<String>>,
    /// Motions of several bodies.
    pub mechanisms: Vec<Mechanism>,
}

/// Fixes the motions that nothing feels and no load works on: of whole groups of bodies, of each body alone, then what is left.
pub fn fix<const D: usize>(parts: &mut [Part<D>], drafts: &[Draft], pairs: &[ContactPair]) -> Fixed {
    // points count by their share in a pair, so that motions count alike wherever they are felt
    let share = |pair: &ContactPair| {
        let all: f64 = pair.weight.iter().sum();
        pair.weight.iter().map(|weight| weight / all).collect::<Vec<f64>>()
    };
    let points = pairs.iter().map(ContactPair::len).collect();
    let mut search =
        Search { parts, drafts, points, weight: pairs.iter().flat_map(share).collect(), found: Vec::new() };
    for group in groups(drafts.len(), pairs) {
        if group.iter().all(|&body| !search.left(body).is_empty()) {
            search.fix(|search| search.of_group(&group));
        }
    }
    let gauged = search.parts.iter_mut().zip(drafts).map(|(part, draft)| gauge::fix(part, draft)).collect();
    while search.found.iter().all(|mechanism| mechanism.work == 0.0) && search.fix(Search::of_some) {}
    Fixed { gauged, mechanisms: search.found }
}

/// Bodies that pairs connect, two at least.
fn groups(bodies: usize, pairs: &[ContactPair]) -> Vec<Vec<usize>> {
    let mut group: Vec<usize> = (0..bodies).collect();
    for pair in pairs {
        let [a, b] = pair.bodies.map(|body| group[body]);
        group.iter_mut().filter(|number| **number == a.max(b)).for_each(|number| *number = a.min(b));
    }
    let members = |number: usize| (0..bodies).filter(|&body| group[body] == number).collect::<Vec<_>>();
    (0..bodies).map(members).filter(|bodies| bodies.len() > 1).collect()
}

/// A motion of some bodies: the displacement of the dofs of each.
struct Moving {
    bodies: Vec<usize>,
    displacement: Vec<Vec<f64>>,
    name: String,
    /// Root of the mean square of what it closes.
    error: f64,
}

struct Search<'p, 's, const D: usize> {
    parts: &'p mut [Part<'s, D>],
    drafts: &'p [Draft],
    /// Points of each pair.
    points: Vec<usize>,
    weight: Vec<f64>,
    found: Vec<Mechanism>,
}

impl<const D: usize> Search<'_, '_, D> {
    /// The motions that supports and springs leave to a body.
    fn left(&self, body: usize) -> Vec<RigidMotion> {
        self.parts[body].left(&self.drafts[body].free)
    }

    /// What contact makes of motions of each body.
    fn felt(&self, motions: &[Vec<Motion>]) -> DMatrix<f64> {
        let bodies = self.drafts.iter().zip(motions).map(|(draft, motions)| (&draft.segments[..], &motions[..]));
        let motions = Motions::new(bodies, &self.points);
        let (springs, n) = (motions.springs(&self.weight), motions.count());
        let unit = |j: usize| DVector::from_fn(n, |i, _| f64::from(u8::from(i == j)));
        let columns: Vec<DVector<f64>> = (0..n).map(|j| springs.multiply(&unit(j))).collect();
        DMatrix::from_fn(n, n, |i, j| columns[j][i])
    }

    /// The rigid motions of some bodies as one: for each body those of its nodes.
    fn as_one(&self, bodies: &[usize]) -> Vec<Vec<RigidMotion>> {
        let spaces: Vec<&Space<D>> = bodies.iter().map(|&body| &self.parts[body].space).collect();
        let mut first = 0;
        let whole = rigid::of_all(&spaces);
        let of = |space: &&Space<D>| {
            let range = first..first + space.dofs();
            first = range.end;
            let part = |motion: &RigidMotion| RigidMotion {
                name: motion.name.clone(),
                displacement: motion.displacement[range.clone()].to_vec(),
            };
            whole.iter().map(part).collect()
        };
        spaces.iter().map(of).collect()
    }

    /// The rigid motions of a group as one body that supports do not feel. Contact does not either, but for the error of meshed
    /// surfaces that are curved and apart.
    fn of_group(&self, group: &[usize]) -> Vec<Moving> {
        let all: Vec<Vec<RigidMotion>> =
            self.as_one(group).into_iter().zip(group).map(|(nodal, &body)| self.parts[body].in_dofs(nodal)).collect();
        let count = all[0].len();
        let mut motions = vec![Vec::new(); self.drafts.len()];
        for (own, &body) in all.iter().zip(group) {
            motions[body] = self.drafts[body].motions::<D>(own);
        }
        let mut held = DMatrix::zeros(count, count);
        for (own, &body) in all.iter().zip(group) {
            let left: Vec<Vec<f64>> = self.left(body).into_iter().map(|motion| motion.displacement).collect();
            let off: Vec<Vec<f64>> = own.iter().map(|motion| rest(&motion.displacement, &left)).collect();
            held += DMatrix::from_fn(count, count, |i, j| dot(&off[i], &off[j]) / off[i].len() as f64);
        }
        // all bodies move by the same motion
        let together = DMatrix::from_fn(count * group.len(), count, |i, j| f64::from(u8::from(i % count == j)));
        let felt = together.transpose() * self.felt(&motions) * &together;
        let moving = |weights: DVector<f64>| {
            let error = weights.dot(&(&felt * &weights)).max(0.0).sqrt() / weights.amax();
            let parts = all.iter().map(|own| rigid::combine(own, &weights));
            let (mut names, displacement): (Vec<_>, Vec<_>) =
                parts.map(|motion| (motion.name, motion.displacement)).unzip();
            Moving { bodies: group.to_vec(), displacement, name: names.swap_remove(0), error }
        };
        let mut free = kernel(&held, 1.0, FREE);
        // translations come first
        let first = |weights: &DVector<f64>| weights.iter().position(|weight| weight.abs() > ROUNDING * weights.amax());
        free.sort_by_key(first);
        free.into_iter().map(moving).filter(|moving| moving.error <= FLAWED).collect()
    }

    /// Motions of some bodies that contact does not feel, where it feels those of each alone.
    fn of_some(&self) -> Vec<Moving> {
        let left: Vec<Vec<RigidMotion>> = (0..self.drafts.len()).map(|body| self.left(body)).collect();
        let motions: Vec<Vec<Motion>> =
            self.drafts.iter().zip(&left).map(|(draft, left)| draft.motions::<D>(left)).collect();
        if motions.iter().any(|own| !gauge::felt_by_none(own).is_empty()) {
            return Vec::new();
        }
        let moving = |weights: DVector<f64>| {
            let small = ROUNDING * weights.amax();
            let mut next = 0;
            let mut moving = Moving { bodies: Vec::new(), displacement: Vec::new(), name: String::new(), error: 0.0 };
            let mut each = Vec::new();
            for (body, left) in left.iter().enumerate() {
                let own = weights.rows(next, left.len());
                next += left.len();
                if own.iter().all(|weight| weight.abs() <= small) {
                    continue;
                }
                let mut displacement = vec![0.0; self.parts[body].space.dofs()];
                left.iter().zip(own.iter()).for_each(|(motion, &a)| axpy(a, &motion.displacement, &mut displacement));
                moving.bodies.push(body);
                moving.displacement.push(displacement);
                let name = rigid::combine(left, &own.into_owned()).name;
                each.push(format!("{name} of {}", self.parts[body].spec.name.value));
            }
            moving.name = self.name_as_one(&moving).unwrap_or_else(|| each.join(", "));
            moving
        };
        kernel(&self.felt(&motions), 1.0, FREE).into_iter().map(moving).collect()
    }

    /// The name of a motion that moves its bodies like one.
    fn name_as_one(&self, moving: &Moving) -> Option<String> {
        let nodal = moving.bodies.iter().zip(&moving.displacement);
        let nodal: Vec<f64> = nodal.flat_map(|(&body, v)| self.parts[body].held.frame.displacements(v)).collect();
        let spaces: Vec<&Space<D>> = moving.bodies.iter().map(|&body| &self.parts[body].space).collect();
        let whole = rigid::of_all(&spaces);
        let vectors: Vec<Vec<f64>> = whole.iter().map(|motion| motion.displacement.clone()).collect();
        let off = rest(&nodal, &vectors);
        let is_one = dot(&off, &off) <= ROUNDING * ROUNDING * dot(&nodal, &nodal);
        is_one.then(|| rigid::combine(&whole, &DVector::from_vec(fit(&vectors, &nodal))).name)
    }

    /// Fixes motions of the same bodies, or notes that loads do work on one. Whether there may be other ones to fix.
    fn fix(&mut self, motions: impl Fn(&Self) -> Vec<Moving>) -> bool {
        let mut all = motions(self);
        let works: Vec<f64> = all.iter().map(|moving| self.work(moving).abs()).collect();
        if let Some(most) = (0..works.len()).max_by(|&i, &j| works[i].total_cmp(&works[j])).filter(|&i| works[i] > 0.0)
        {
            let Moving { bodies, name, .. } = all.swap_remove(most);
            self.found.push(Mechanism { bodies, name, work: works[most], fixed: None });
            return false;
        }
        let Some(bodies) = all.first().map(|moving| moving.bodies.clone()) else { return false };
        all.retain(|moving| moving.bodies == bodies);
        let names: Vec<&str> = all.iter().map(|moving| moving.name.as_str()).collect();
        let mut mechanism = Mechanism { name: names.join("; "), bodies, work: 0.0, fixed: None };
        // a motion that is left when others are fixed is another one: it turns about their nodes
        for _ in 0..all.len() {
            let left = motions(self);
            let same = left.iter().find(|moving| moving.bodies == mechanism.bodies);
            let fixed = same.and_then(|moving| self.pin(moving));
            mechanism.fixed = mechanism.fixed.or(fixed);
            if fixed.is_none() {
                break;
            }
        }
        let goes_on = mechanism.fixed.is_some();
        self.found.push(mechanism);
        goes_on
    }

    /// Work of the loads on a motion, as a share of the largest possible; zero if it is rounding or an error of the mesh.
    fn work(&self, moving: &Moving) -> f64 {
        let of = |(&body, u): (&usize, &Vec<f64>)| gauge::works::<D>(u, &self.drafts[body].load);
        let each = moving.bodies.iter().zip(&moving.displacement).map(of);
        let [work, largest] = each.fold([0.0; 2], |[sum, most], [work, size]| [sum + work, most + size]);
        if work.abs() <= largest * moving.error.max(gauge::NO_WORK) { 0.0 } else { work / largest }
    }

    /// Fixes a motion at one node of the largest body that has one where the motion is not small; returns the body.
    fn pin(&mut self, moving: &Moving) -> Option<usize> {
        let candidate = |(&body, u): (&usize, &Vec<f64>)| {
            let dof = gauge::candidate(&self.parts[body], &self.drafts[body].rows, u)?;
            Some((body, dof, u[dof].abs()))
        };
        let mut all: Vec<(usize, usize, f64)> =
            moving.bodies.iter().zip(&moving.displacement).filter_map(candidate).collect();
        let most = all.iter().map(|found| found.2).fold(0.0, f64::max);
        all.retain(|found| found.2 > NEAR * most);
        let size = |found: &(usize, usize, f64)| extent(&self.parts[found.0].space);
        let &(body, dof, _) = all.iter().rev().max_by(|a, b| size(a).total_cmp(&size(b)))?;
        self.parts[body].held.prescribed.insert(dof, 0.0);
        Some(body)
    }
}

/// A node whose displacement is this share of the largest one can fix a motion.
const NEAR: f64 = 1e-2;

/// What a displacement is besides some motions.
fn rest(displacement: &[f64], motions: &[Vec<f64>]) -> Vec<f64> {
    let mut rest = displacement.to_vec();
    fit(motions, displacement).iter().zip(motions).for_each(|(&a, motion)| axpy(-a, motion, &mut rest));
    rest
}

/// Largest dimension of a body along an axis.
fn extent<const D: usize>(space: &Space<D>) -> f64 {
    let along = |c: usize| {
        let (low, high) =
            space.nodes.iter().fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x[c]), high.max(x[c])));
        high - low
    };
    (0..D).map(along).fold(0.0, f64::max)
}
