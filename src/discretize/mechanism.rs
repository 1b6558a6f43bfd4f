//! Rigid motions of several bodies together that change no gap: an unsupported group, or blocks that slide or turn as one.
//!
//! Each body is then constrained by its neighbours, but all of them together are not. As with the motions of one body
//! ([`gauge`]), there is a solution if the loads do no work on such a motion. One node of one body is then fixed against it,
//! without reaction.

use super::gauge;
use super::info::{Balanced, Gauged};
use super::interface::{Interface, NO_WORK, Unconstrained};
use super::missed;
use super::moving::{self, Moving};
use super::part::{Candidate, Part};
use super::round::Points;
use crate::contact::ContactPair;
use crate::error::few;
use crate::fem::{Extent, RigidMotion, rigid};
use crate::linalg::{Blocks, Joined, PART, TOLERANCE, axpy, dot, fit};
use crate::mesh::Mesh;
use crate::model::{Mechanism, Motion, Motions, Segment};
use nalgebra::{DMatrix, DVector};
use std::collections::HashMap;

/// Largest share of its displacement that a rigid motion of a whole group may close, for the mesh to treat it as free. The bound
/// is not one of rounding. Chords of the arc between neighbouring nodes deviate from it by 1/8 of their angle squared, and two
/// meshes turn against each other by as much. The value 0.03 belongs to chords of 28 degrees.
const FLAWED: f64 = 0.03;

/// The motions that were fixed, and those that cannot be.
pub struct Fixed<const D: usize> {
    /// Fixed and spinning motions of each body alone.
    pub gauged: Vec<Gauged>,
    /// Motions of several bodies.
    pub mechanisms: Vec<Mechanism>,
    /// Motions left to each body.
    pub unconstrained: Vec<Unconstrained<D>>,
    /// Loads that were balanced.
    pub balanced: Vec<Balanced>,
}

/// Fix the motions that nothing resists and on which no load works. First come whole groups of bodies, then each body alone, then
/// the motions that remain.
pub fn fix<const D: usize>(
    parts: &mut [Part<D>],
    interfaces: &mut [Interface<D>],
    pairs: &[ContactPair],
    mesh: &Mesh<D>,
) -> Fixed<D> {
    let unconstrained = parts.iter().zip(&*interfaces).map(|(part, interface)| interface.unconstrained(part)).collect();
    let (found, balanced) = (Vec::new(), Vec::new());
    let mut search = Search { parts, interfaces, pairs, mesh, unconstrained, found, balanced };
    for group in groups(search.interfaces.len(), pairs) {
        if group.iter().all(|&body| !search.unconstrained[body].left.is_empty()) {
            let all = search.of_group(&group);
            search.balance(&all);
            if !search.works_on(&all) {
                search.fix(all, |search| search.of_group(&group));
            }
        }
    }
    (0..search.parts.len()).for_each(|body| search.balance(&search.of_one(body)));
    let mut fixed = Vec::new();
    for body in 0..search.parts.len() {
        let (part, interface) = (&mut search.parts[body], &search.interfaces[body]);
        fixed.push(gauge::fix(part, interface, &mut search.unconstrained[body]));
    }
    let gauged = fixed.into_iter().enumerate().map(|(body, fixed)| search.fix_round(body, fixed)).collect();
    if search.found.iter().all(|mechanism| mechanism.work == 0.0) {
        search.fix_some();
    }
    Fixed { gauged, mechanisms: search.found, unconstrained: search.unconstrained, balanced: search.balanced }
}

/// Return the groups of at least two bodies that pairs connect, in the order of their first bodies.
fn groups(bodies: usize, pairs: &[ContactPair]) -> Vec<Vec<usize>> {
    let mut joined = Joined::new(bodies);
    pairs.iter().map(|pair| pair.bodies.map(|body| body as u32)).for_each(|[a, b]| joined.join(a, b));
    let (count, group) = joined.classes();
    let mut members = vec![Vec::new(); count];
    (0..bodies).for_each(|body| members[group[body] as usize].push(body));
    members.retain(|bodies| bodies.len() > 1);
    members
}

/// The contact rows of some bodies. Pairs are numbered among those that touch these bodies.
struct Rows {
    segments: Vec<Vec<Segment>>,
    /// Number of points of each pair.
    points: Vec<usize>,
    /// Share of each point in the area of its pair, so that motions have equal weight wherever they are resisted.
    weight: Vec<f64>,
}

impl Rows {
    /// Collect the rows of bodies in the order of `interfaces`.
    fn new<'d, const D: usize>(interfaces: impl Iterator<Item = &'d Interface<D>>, pairs: &[ContactPair]) -> Self {
        let mut rows = Self { segments: Vec::new(), points: Vec::new(), weight: Vec::new() };
        let mut number = HashMap::new();
        for interface in interfaces {
            let own = interface.segments.iter().map(|segment| {
                let pair = *number.entry(segment.pair).or_insert_with(|| {
                    let weight = &pairs[segment.pair].weight;
                    let all: f64 = weight.iter().sum();
                    rows.weight.extend(weight.iter().map(|weight| weight / all));
                    rows.points.push(weight.len());
                    rows.points.len() - 1
                });
                Segment { pair, side: segment.side }
            });
            rows.segments.push(own.collect());
        }
        rows
    }

    /// Return how contact resists the motions of each body through these rows.
    fn feel<'a>(&'a self, motions: impl Iterator<Item = &'a [Motion]>) -> Motions<'a> {
        Motions::new(self.segments.iter().map(Vec::as_slice).zip(motions), &self.points)
    }
}

struct Search<'p, 's, const D: usize> {
    parts: &'p mut [Part<'s, D>],
    interfaces: &'p mut [Interface<D>],
    pairs: &'p [ContactPair],
    mesh: &'p Mesh<D>,
    /// Motions that supports and springs leave to each body at present.
    unconstrained: Vec<Unconstrained<D>>,
    found: Vec<Mechanism>,
    balanced: Vec<Balanced>,
}

impl<const D: usize> Search<'_, '_, D> {
    /// Return the contact rows of some bodies.
    fn rows(&self, bodies: &[usize]) -> Rows {
        Rows::new(bodies.iter().map(|&body| &self.interfaces[body]), self.pairs)
    }

    /// Return the rigid motions of some bodies as one.
    fn as_one(&self, bodies: &[usize]) -> Vec<RigidMotion<D>> {
        let parts = || bodies.iter().map(|&body| &self.parts[body]);
        let extent = parts().fold(Extent::default(), |all, part| all.join(&part.facts.extent));
        rigid::of(&extent, parts().any(|part| part.space.axisymmetric))
    }

    /// Return the rigid motions of a group as one body that its supports do not resist. Contact does not resist them either,
    /// apart from the error of meshed surfaces that are curved and apart.
    fn of_group(&self, group: &[usize]) -> Vec<Moving<D>> {
        let all = self.as_one(group);
        let count = all.len();
        let mut held = DMatrix::zeros(count, count);
        for &body in group {
            let at_corners = |motion: &RigidMotion<D>| motion.nodal(self.parts[body].facts.extent.corners());
            let left: Vec<Vec<f64>> = self.unconstrained[body].left.iter().map(at_corners).collect();
            let off: Vec<Vec<f64>> = all.iter().map(|motion| rest(&at_corners(motion), &left)).collect();
            held += DMatrix::from_fn(count, count, |i, j| dot(&off[i], &off[j]) / off[i].len() as f64);
        }
        let traces: Vec<Vec<Motion>> =
            group.iter().map(|&body| self.interfaces[body].motions(&self.parts[body], &all)).collect();
        let rows = self.rows(group);
        let resisted = rows.feel(traces.iter().map(Vec::as_slice));
        let moving = |weights: DVector<f64>| {
            // All bodies have the same motion.
            let amounts = DVector::from_fn(resisted.count(), |i, _| weights[i % count]);
            let square: f64 =
                resisted.closing(&amounts).iter().zip(&rows.weight).map(|(c, weight)| weight * c * c).sum();
            let motion = rigid::combine(&all, &weights);
            let error = square.sqrt() / weights.amax();
            Moving { bodies: group.to_vec(), name: motion.name.clone(), motions: vec![motion; group.len()], error }
        };
        let mut free = Blocks::free(&held, 1.0, TOLERANCE);
        // Translations come first.
        let first = |weights: &DVector<f64>| weights.iter().position(|weight| weight.abs() > PART);
        free.sort_by_key(first);
        free.into_iter().map(moving).filter(|moving| moving.error <= FLAWED).collect()
    }

    /// Return the motions of some of these bodies that contact does not resist while all others are at rest. The result is empty
    /// if contact does not resist a motion of one of them alone.
    fn of_some(&self, bodies: &[usize]) -> Vec<Moving<D>> {
        if bodies.iter().any(|&body| !self.unconstrained[body].unresisted.is_empty()) {
            return Vec::new();
        }
        let rows = self.rows(bodies);
        let resisted = rows.feel(bodies.iter().map(|&body| &self.unconstrained[body].motions[..]));
        let factor = resisted.springs(&rows.weight).factor();
        let moving = |entries: &Vec<(usize, f64)>| {
            let mut moving = Moving { bodies: Vec::new(), motions: Vec::new(), name: String::new(), error: 0.0 };
            let mut each = Vec::new();
            let entries: Vec<(usize, f64)> = entries.iter().filter(|(_, a)| a.abs() > PART).copied().collect();
            for own in entries.chunk_by(|a, b| resisted.body_of(a.0) == resisted.body_of(b.0)) {
                let (at, body) = (resisted.body_of(own[0].0), bodies[resisted.body_of(own[0].0)]);
                let left = &self.unconstrained[body].left;
                let mut weights = DVector::zeros(left.len());
                own.iter().for_each(|&(motion, amount)| weights[motion - resisted.of_body(at).start] = amount);
                let motion = rigid::sum(left, &weights);
                each.push(format!("{} of {}", motion.name, self.parts[body].spec.name.value));
                moving.bodies.push(body);
                moving.motions.push(motion);
            }
            moving.name = self.name_as_one(&moving).unwrap_or_else(|| few(each).join(", "));
            moving
        };
        factor.kernel_entries().iter().map(moving).collect()
    }

    /// Return the name of a motion if it moves its bodies as one.
    fn name_as_one(&self, moving: &Moving<D>) -> Option<String> {
        let corners = |body: usize| self.parts[body].facts.extent.corners();
        let each = moving.bodies.iter().zip(&moving.motions);
        let each: Vec<f64> = each.flat_map(|(&body, motion)| motion.nodal(corners(body))).collect();
        let whole = self.as_one(&moving.bodies);
        let of_bodies = |motion: &RigidMotion<D>| -> Vec<f64> {
            moving.bodies.iter().flat_map(|&body| motion.nodal(corners(body))).collect()
        };
        let vectors: Vec<Vec<f64>> = whole.iter().map(of_bodies).collect();
        let off = rest(&each, &vectors);
        let is_one = dot(&off, &off) <= PART * PART * dot(&each, &each);
        is_one.then(|| rigid::combine(&whole, &DVector::from_vec(fit(&slices(&vectors), &each))).name)
    }

    /// Fix the remaining motions of some bodies, until there are none, loads work on one, or one cannot be fixed.
    fn fix_some(&mut self) {
        let every: Vec<usize> = (0..self.interfaces.len()).collect();
        loop {
            let mut all = self.of_some(&every);
            self.balance(&all);
            let mut goes_on = !self.works_on(&all) && !all.is_empty();
            if !goes_on {
                return;
            }
            // Motions of other bodies do not change when some are fixed.
            let mut touched = vec![false; every.len()];
            while let Some(first) = all.first() {
                let bodies = first.bodies.clone();
                let (same, other) = all.into_iter().partition(|moving| moving.bodies == bodies);
                all = other;
                if bodies.iter().all(|&body| !touched[body]) {
                    bodies.iter().for_each(|&body| touched[body] = true);
                    goes_on &= self.fix(same, |search| search.of_some(&bodies));
                }
            }
            if !goes_on {
                return;
            }
        }
    }

    /// Fix the motions of a body along its own surface on which no load works. `fixed` holds the names of the motions that are
    /// fixed already.
    fn fix_round(&mut self, body: usize, mut fixed: Vec<String>) -> Gauged {
        if self.unconstrained[body].left.is_empty() || !self.unconstrained[body].unresisted.is_empty() {
            return Gauged { fixed, spinning: Vec::new() };
        }
        let points = Points::of(&self.interfaces[body], self.pairs);
        loop {
            let round = points.along_surface(&self.unconstrained[body].left);
            // The centre of a load is no more accurate than that of the meshed body.
            let moving = |motion: RigidMotion<D>| Moving {
                bodies: vec![body],
                name: motion.name.clone(),
                motions: vec![motion],
                error: FLAWED,
            };
            let (idle, worked): (Vec<_>, Vec<_>) =
                round.into_iter().map(moving).partition(|moving| self.work(moving) == 0.0);
            if idle.first().and_then(|moving| self.pin(moving)).is_none() {
                return Gauged { fixed, spinning: worked.into_iter().map(|moving| moving.name).collect() };
            }
            fixed.push(idle[0].name.clone());
        }
    }

    /// Record the motion on which loads work most. Return whether there is one.
    fn works_on(&mut self, all: &[Moving<D>]) -> bool {
        let works: Vec<f64> = all.iter().map(|moving| self.work(moving).abs()).collect();
        let most = (0..works.len()).max_by(|&i, &j| works[i].total_cmp(&works[j])).filter(|&i| works[i] > 0.0);
        self.found.extend(most.map(|i| Mechanism {
            bodies: all[i].bodies.clone(),
            motion: all[i].name.clone(),
            work: works[i],
            fixed: None,
        }));
        most.is_some()
    }

    /// Fix motions of the same bodies. `again` finds those that remain. Return whether the first was fixed.
    fn fix(&mut self, all: Vec<Moving<D>>, again: impl Fn(&Self) -> Vec<Moving<D>>) -> bool {
        let Some(bodies) = all.first().map(|moving| moving.bodies.clone()) else { return false };
        let names: Vec<&str> = all.iter().map(|moving| moving.name.as_str()).collect();
        let mut mechanism = Mechanism { motion: names.join("; "), bodies, work: 0.0, fixed: None };
        let count = all.len();
        let mut left = all;
        // A motion that remains when others are fixed is a different one, since it turns about their nodes.
        for number in 0..count {
            if number > 0 {
                left = again(self);
            }
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

    /// Return the work of the loads on a motion, as a share of the largest possible work. It is zero if it is rounding or an
    /// error of the mesh.
    fn work(&self, moving: &Moving<D>) -> f64 {
        let [work, largest] = moving.works(self.parts, self.interfaces);
        if work.abs() <= largest * moving.error.max(NO_WORK) { 0.0 } else { work / largest }
    }

    /// Balance the loads on unresisted motions, if the work on each is no more than the mesh may miss of it.
    fn balance(&mut self, all: &[Moving<D>]) {
        // Bodies without loads have nothing to balance.
        let works_on = |moving: &Moving<D>| moving.works(self.parts, self.interfaces);
        let (all, works): (Vec<&Moving<D>>, Vec<[f64; 2]>) =
            all.iter().map(|moving| (moving, works_on(moving))).filter(|(_, [_, largest])| *largest > 0.0).unzip();
        let shares = || works.iter().map(|[work, largest]| work.abs() / largest.max(f64::MIN_POSITIVE));
        let may_be_missed = |(moving, [work, largest]): (&&Moving<D>, &[f64; 2])| {
            work.abs() <= NO_WORK * largest || work.abs() <= self.missed(moving, *largest)
        };
        if shares().all(|share| share <= NO_WORK) || !all.iter().zip(&works).all(may_be_missed) {
            return;
        }
        let lacking: Vec<f64> = works.iter().map(|[work, _]| *work).collect();
        if moving::balance(&all, &lacking, self.parts, self.interfaces) {
            for (moving, share) in all.iter().zip(shares()).filter(|(_, share)| *share > NO_WORK) {
                self.note_balanced(moving, share);
            }
            for body in all.iter().flat_map(|moving| &moving.bodies) {
                self.unconstrained[*body] = self.interfaces[*body].unconstrained(&self.parts[*body]);
            }
        }
    }

    /// Record that loads were balanced on a motion, together with others of the same bodies.
    fn note_balanced(&mut self, moving: &Moving<D>, share: f64) {
        match self.balanced.iter_mut().find(|balanced| balanced.bodies == moving.bodies) {
            Some(balanced) => {
                balanced.motion = format!("{}; {}", balanced.motion, moving.name);
                balanced.share = balanced.share.max(share);
            }
            None => {
                let (bodies, motion) = (moving.bodies.clone(), moving.name.clone());
                self.balanced.push(Balanced { bodies, motion, share });
            }
        }
    }

    /// Return the work of the loads on a motion that the mesh may miss. `largest` is the largest work that the loads could do.
    fn missed(&self, moving: &Moving<D>, largest: f64) -> f64 {
        let (mut share, mut quadrature) = (moving.error, 0.0);
        for (&body, motion) in moving.bodies.iter().zip(&moving.motions) {
            let part = &self.parts[body];
            share = share.max(missed::by_facets(part, &self.interfaces[body], self.pairs, self.mesh));
            quadrature += missed::by_quadrature(part, motion, self.mesh);
        }
        share * largest + quadrature
    }

    /// Return the motions of a body that contact does not resist.
    fn of_one(&self, body: usize) -> Vec<Moving<D>> {
        let Unconstrained { left, unresisted, .. } = &self.unconstrained[body];
        let moving = |(name, weights): &(String, DVector<f64>)| {
            let motions = vec![rigid::combine(left, weights)];
            Moving { bodies: vec![body], motions, name: name.clone(), error: 0.0 }
        };
        unresisted.iter().map(moving).collect()
    }

    /// Fix a motion at one node and return the body of the node. It is the largest body with a suitable node where the motion is
    /// not small.
    fn pin(&mut self, moving: &Moving<D>) -> Option<usize> {
        let candidate = |(&body, motion): (&usize, &RigidMotion<D>)| {
            Some((body, self.interfaces[body].candidate(&self.parts[body], motion)?))
        };
        let mut all: Vec<(usize, Candidate)> =
            moving.bodies.iter().zip(&moving.motions).filter_map(candidate).collect();
        let most = all.iter().map(|(_, found)| found.size).fold(0.0, f64::max);
        all.retain(|(_, found)| found.size > NEAR * most);
        let size = |body: usize| self.parts[body].facts.extent.size();
        let (body, found) = all.into_iter().rev().max_by(|a, b| size(a.0).total_cmp(&size(b.0)))?;
        self.parts[body].fix(&found);
        self.unconstrained[body] = self.interfaces[body].unconstrained(&self.parts[body]);
        Some(body)
    }
}

/// Share of the largest displacement from which a node can fix a motion.
const NEAR: f64 = 1e-2;

/// Return the part of a displacement that is not a combination of some motions.
fn rest(displacement: &[f64], motions: &[Vec<f64>]) -> Vec<f64> {
    let mut rest = displacement.to_vec();
    let amounts = fit(&slices(motions), displacement);
    amounts.iter().zip(motions).for_each(|(&a, motion)| axpy(-a, motion, &mut rest));
    rest
}

fn slices(vectors: &[Vec<f64>]) -> Vec<&[f64]> {
    vectors.iter().map(Vec::as_slice).collect()
}
