//! Rigid motions that nothing resists, of one body or of several bodies together.
//!
//! A body may slide on a plane, a roller may spin, and a group of bodies without supports may move as one. If the loads do no work on
//! such a motion, the solution is unique only up to it. One node is then fixed against the motion, without reaction. If the loads do
//! work on it, there is no solution, and the run reports this. Bodies of which each is constrained by its neighbours may together slide
//! or turn as one.
//!
//! Motions of a body along its own surface are resisted only by the facets of the mesh. Examples are the spin of a roller, of a ball, or
//! of a ring in a press fit, and a block that slides on rollers. If points lie on the other surface, the normals of that surface may
//! resist them, too. A normal of a meshed surface is the mean of the facets around it, so it is uncertain by the angle between them.
//! Therefore the mesh cannot show that a motion m is resisted if
//!
//! ```text
//! |n_q . m(x_q)| <= 2 s_q |m(x_q)|       at every contact point q of the body,
//! ```
//!
//! where n_q is the normal at the point x_q, and s_q is the largest difference between unit normals of facets and nodes near q
//! ([`Side::spread`](crate::contact::Side::spread)). The true normal lies between the facets. So the motion of a round body along
//! itself has a quotient |n_q . m| / |m| of at most s_q on every mesh. That motion is found from the normals, weighted by 1/s_q,
//! and its own error is as large again. On flat facets s_q is rounding, and no motion passes that contact resists.
//!
//! Loads that balance on the true surfaces may lack balance on the facets. They are changed where the mesh may miss so much of them.

use super::part::SceneBody;
use super::patterns::find_group;
use super::unassembled::{FixableDof, NO_WORK, Unassembled, Unconstrained};
use crate::contact::ContactPair;
use crate::error::few;
use crate::fem::{PointExtent, RigidMotion, rigid, surface};
use crate::linalg::{Blocks, DisjointSets, PART, TOLERANCE, axpy, dot, fit};
use crate::mesh::Mesh;
use crate::model::{Mechanism, Motion, Motions, Segment};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Largest share of its displacement that a rigid motion of a whole group may close, for the mesh to treat it as free. The bound
/// is not one of rounding. Chords of the arc between neighbouring nodes deviate from it by 1/8 of their angle squared, and two
/// meshes turn against each other by as much. The value 0.03 belongs to chords of 28 degrees.
const FLAWED: f64 = 0.03;

/// Loads that were balanced on motions, since their imbalance was no larger than what the mesh may miss of the loads.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Balanced {
    /// Indices of the bodies that the motions move.
    pub bodies: Vec<usize>,
    /// Names of the motions.
    pub motion: String,
    /// Largest work of the loads on these motions, as a share of the work that forces of their magnitudes could do.
    pub share: f64,
}

/// The motions of several bodies that were fixed or cannot be, and the loads that were balanced.
pub struct Fixed {
    /// Motions of several bodies.
    pub mechanisms: Vec<Mechanism>,
    /// Loads that were balanced.
    pub balanced: Vec<Balanced>,
}

/// Fix the motions that nothing resists and on which no load works. First come whole groups of bodies, then each body alone, then
/// the motions that remain.
pub fn fix<const D: usize>(bodies: &mut [Unassembled<D>], pairs: &[ContactPair], mesh: &Mesh<D>) -> Fixed {
    let mut search = MechanismSearch { bodies, pairs, mesh, found: Vec::new(), balanced: Vec::new() };
    for group in groups(search.bodies.len(), pairs) {
        if group.iter().all(|&body| !search.left(body).is_empty()) {
            let all = search.of_group(&group);
            search.balance(&all);
            if !search.works_on(&all) {
                search.fix(all, |search| search.of_group(&group));
            }
        }
    }
    let every = 0..search.bodies.len();
    every.clone().for_each(|body| search.balance(&search.of_one(body)));
    every.clone().for_each(|body| search.fix_one(body));
    every.for_each(|body| search.fix_round(body));
    if search.found.iter().all(|mechanism| mechanism.work == 0.0) {
        search.fix_some();
    }
    Fixed { mechanisms: search.found, balanced: search.balanced }
}

/// Return the groups of at least two bodies that pairs connect, in the order of their first bodies.
fn groups(bodies: usize, pairs: &[ContactPair]) -> Vec<Vec<usize>> {
    let mut joined = DisjointSets::new(bodies);
    pairs.iter().map(|pair| pair.bodies.map(|body| body as u32)).for_each(|[a, b]| joined.join(a, b));
    let (count, group) = joined.classes();
    let mut members = vec![Vec::new(); count];
    (0..bodies).for_each(|body| members[group[body] as usize].push(body));
    members.retain(|bodies| bodies.len() > 1);
    members
}

/// The contact rows of some bodies. Pairs are numbered among those that touch these bodies.
struct ContactRows {
    segments: Vec<Vec<Segment>>,
    points: Vec<usize>,
    /// Share of each point in the area of its pair, so that motions have equal weight wherever they are resisted.
    weight: Vec<f64>,
}

impl ContactRows {
    /// Collect the rows of bodies.
    fn new<'d, const D: usize>(bodies: impl Iterator<Item = &'d Unassembled<'d, D>>, pairs: &[ContactPair]) -> Self {
        let mut rows = Self { segments: Vec::new(), points: Vec::new(), weight: Vec::new() };
        let mut number = HashMap::new();
        for body in bodies {
            let own = body.segments.iter().map(|segment| {
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

struct MechanismSearch<'p, 's, const D: usize> {
    bodies: &'p mut [Unassembled<'s, D>],
    pairs: &'p [ContactPair],
    mesh: &'p Mesh<D>,
    found: Vec<Mechanism>,
    balanced: Vec<Balanced>,
}

impl<const D: usize> MechanismSearch<'_, '_, D> {
    /// Return the motions that supports and springs leave to a body at present.
    fn left(&self, body: usize) -> &[RigidMotion<D>] {
        &self.bodies[body].unconstrained.left
    }

    fn extent(&self, body: usize) -> &PointExtent {
        &self.bodies[body].part.facts.extent
    }

    /// Return the contact rows of some bodies.
    fn rows(&self, bodies: &[usize]) -> ContactRows {
        ContactRows::new(bodies.iter().map(|&body| &self.bodies[body]), self.pairs)
    }

    /// Return the rigid motions of some bodies as one.
    fn as_one(&self, bodies: &[usize]) -> Vec<RigidMotion<D>> {
        let extent = bodies.iter().fold(PointExtent::default(), |all, &body| all.join(self.extent(body)));
        rigid::of(&extent, bodies.iter().any(|&body| self.bodies[body].part.space.axisymmetric))
    }

    /// Return the rigid motions of a group as one body that its supports do not resist. Contact does not resist them either,
    /// apart from the error of meshed surfaces that are curved and apart.
    fn of_group(&self, group: &[usize]) -> Vec<Moving<D>> {
        let all = self.as_one(group);
        let count = all.len();
        let mut held = DMatrix::zeros(count, count);
        for &body in group {
            let at_corners = |motion: &RigidMotion<D>| motion.nodal(self.extent(body).corners());
            let left: Vec<Vec<f64>> = self.left(body).iter().map(at_corners).collect();
            let off: Vec<Vec<f64>> = all.iter().map(|motion| rest(&at_corners(motion), &left)).collect();
            held += DMatrix::from_fn(count, count, |i, j| dot(&off[i], &off[j]) / off[i].len() as f64);
        }
        let traces: Vec<Vec<Motion>> = group.iter().map(|&body| self.bodies[body].motions(&all)).collect();
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
        if bodies.iter().any(|&body| !self.bodies[body].unconstrained.unresisted.is_empty()) {
            return Vec::new();
        }
        let rows = self.rows(bodies);
        let resisted = rows.feel(bodies.iter().map(|&body| &self.bodies[body].unconstrained.motions[..]));
        let factor = resisted.springs(&rows.weight).factor();
        let moving = |entries: &Vec<(usize, f64)>| {
            let mut moving = Moving { bodies: Vec::new(), motions: Vec::new(), name: String::new(), error: 0.0 };
            let mut each = Vec::new();
            let entries: Vec<(usize, f64)> = entries.iter().filter(|(_, a)| a.abs() > PART).copied().collect();
            for own in entries.chunk_by(|a, b| resisted.body_of(a.0) == resisted.body_of(b.0)) {
                let (at, body) = (resisted.body_of(own[0].0), bodies[resisted.body_of(own[0].0)]);
                let left = self.left(body);
                let mut weights = DVector::zeros(left.len());
                own.iter().for_each(|&(motion, amount)| weights[motion - resisted.of_body(at).start] = amount);
                let motion = rigid::sum(left, &weights);
                each.push(format!("{} of {}", motion.name, self.bodies[body].part.spec.name.value));
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
        let corners = |body: usize| self.extent(body).corners();
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
        let every: Vec<usize> = (0..self.bodies.len()).collect();
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

    /// Fix the motions of a body that contact does not resist and on which no load works.
    fn fix_one(&mut self, body: usize) {
        while let Some(moving) = self.of_one(body).into_iter().find(|moving| self.work(moving) == 0.0)
            && self.pin(&moving).is_some()
        {
            self.bodies[body].removed_modes.slides |= moving.error > 0.0;
            self.bodies[body].removed_modes.fixed.extend(moving.motions.into_iter().map(|motion| motion.name));
        }
    }

    /// Fix the motions of a body along its own surface on which no load works.
    fn fix_round(&mut self, body: usize) {
        if self.left(body).is_empty() || !self.bodies[body].unconstrained.unresisted.is_empty() {
            return;
        }
        let points = SurfacePoints::of(&self.bodies[body], self.pairs);
        loop {
            let round = points.along_surface(self.left(body));
            // The centre of a load is no more accurate than that of the meshed body.
            let moving = |motion: RigidMotion<D>| Moving {
                bodies: vec![body],
                name: motion.name.clone(),
                motions: vec![motion],
                error: FLAWED,
            };
            let (idle, worked): (Vec<_>, Vec<_>) =
                round.into_iter().map(moving).partition(|moving| self.work(moving) == 0.0);
            self.bodies[body].removed_modes.slides |= !(idle.is_empty() && worked.is_empty());
            if idle.first().and_then(|moving| self.pin(moving)).is_none() {
                self.bodies[body].removed_modes.spinning = worked.into_iter().map(|moving| moving.name).collect();
                return;
            }
            self.bodies[body].removed_modes.fixed.push(idle[0].name.clone());
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
        let [work, largest] = moving.works(self.bodies);
        if work.abs() <= largest * moving.error.max(NO_WORK) { 0.0 } else { work / largest }
    }

    /// Balance the loads on unresisted motions, if the work on each is no more than the mesh may miss of it.
    fn balance(&mut self, all: &[Moving<D>]) {
        // Bodies without loads have nothing to balance.
        let works_on = |moving: &Moving<D>| moving.works(self.bodies);
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
        if balance(&all, &lacking, self.bodies) {
            for (moving, share) in all.iter().zip(shares()).filter(|(_, share)| *share > NO_WORK) {
                self.note_balanced(moving, share);
            }
            for &body in all.iter().flat_map(|moving| &moving.bodies) {
                self.bodies[body].find_motions();
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
            let body = &self.bodies[body];
            share = share.max(missed_by_facets(body, self.pairs, self.mesh));
            quadrature += missed_by_quadrature(&body.part, motion, self.mesh);
        }
        share * largest + quadrature
    }

    /// Return the motions of a body that contact does not resist.
    fn of_one(&self, body: usize) -> Vec<Moving<D>> {
        let Unconstrained { left, unresisted, .. } = &self.bodies[body].unconstrained;
        if unresisted.is_empty() {
            return Vec::new();
        }
        let is_curved = SurfacePoints::of(&self.bodies[body], self.pairs).are_curved();
        let moving = |(name, weights): &(String, DVector<f64>)| {
            let motion = rigid::combine(left, weights);
            // the normals of a round partner may leave the spin of a round body free to the last digit, but its centre is that of a mesh
            let error = if is_curved && motion.turns() { FLAWED } else { 0.0 };
            Moving { bodies: vec![body], motions: vec![motion], name: name.clone(), error }
        };
        unresisted.iter().map(moving).collect()
    }

    /// Fix a motion at one node and return the body of the node. It is the largest body with a suitable node where the motion is
    /// not small.
    fn pin(&mut self, moving: &Moving<D>) -> Option<usize> {
        let candidate = |(&body, motion): (&usize, &RigidMotion<D>)| Some((body, self.bodies[body].candidate(motion)?));
        let mut all: Vec<(usize, FixableDof)> =
            moving.bodies.iter().zip(&moving.motions).filter_map(candidate).collect();
        let most = all.iter().map(|(_, found)| found.size).fold(0.0, f64::max);
        all.retain(|(_, found)| found.size > NEAR * most);
        let size = |body: usize| self.extent(body).size();
        let (body, found) = all.into_iter().rev().max_by(|a, b| size(a.0).total_cmp(&size(b.0)))?;
        self.bodies[body].fix(&found);
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

/// A motion of some bodies, each of which is rigid.
struct Moving<const D: usize> {
    /// Indices of the bodies that it moves.
    bodies: Vec<usize>,
    motions: Vec<RigidMotion<D>>,
    name: String,
    /// Gap change per unit of the motion: the root of the sum over pairs of its mean square.
    error: f64,
}

impl<const D: usize> Moving<D> {
    /// Return the work of the loads on the motion, and the largest work that forces of their magnitudes could do.
    fn works(&self, bodies: &[Unassembled<D>]) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (&body, motion) in self.bodies.iter().zip(&self.motions) {
            let works = bodies[body].load.works(|node| bodies[body].part.at_dofs(motion, node));
            (0..2).for_each(|k| sums[k] += works[k]);
        }
        sums
    }

    /// Return the rigid motion of a body, if the motion moves it.
    fn of(&self, body: usize) -> Option<&RigidMotion<D>> {
        let place = self.bodies.iter().position(|&moved| moved == body)?;
        Some(&self.motions[place])
    }
}

/// Change the loads so that they do no work on any of these motions m_j. `works` holds the works w_j that the loads do on them.
/// Return whether this was possible, since rigid surfaces keep their forces.
///
/// Each nodal force f changes along the motions in proportion to its magnitude, by -|f| sum_j b_j m_j at its node. The amounts
/// b_j solve
///
/// ```text
/// sum_k G_jk b_k = w_j,      G_jk = sum_nodes |f| m_j . m_k,
/// ```
///
/// so that nodes with equal loads get equal corrections.
fn balance<const D: usize>(all: &[&Moving<D>], works: &[f64], bodies: &mut [Unassembled<D>]) -> bool {
    let count = all.len();
    let mut products = DMatrix::zeros(count, count);
    for (number, body) in bodies.iter().enumerate() {
        let motions: Vec<(usize, &RigidMotion<D>)> =
            all.iter().enumerate().filter_map(|(j, moving)| Some((j, moving.of(number)?))).collect();
        for (node, force) in body.nodal_load.iter().filter(|_| !motions.is_empty()) {
            let size = dot(&force, &force).sqrt();
            let at = motions.iter().map(|(j, motion)| (*j, motion.at(&body.part.space.nodes[node as usize])));
            let at: Vec<(usize, [f64; D])> = at.collect();
            for (j, u) in &at {
                at.iter().for_each(|(k, v)| products[(*j, *k)] += size * dot(u, v));
            }
        }
    }
    let Some(factor) = products.cholesky() else { return false };
    let amounts = factor.solve(&DVector::from_column_slice(works));
    for (number, body) in bodies.iter_mut().enumerate() {
        let moved = |x: &[f64; D]| {
            let mut sum = [0.0; D];
            for (moving, amount) in all.iter().zip(amounts.iter()) {
                let at = moving.of(number).map_or([0.0; D], |motion| motion.at(x));
                (0..D).for_each(|c| sum[c] += amount * at[c]);
            }
            sum
        };
        body.change_loads(moved);
    }
    true
}

/// Ratio of the error of a quadrature to the difference between it and the same rule on halves of the elements. Where a load
/// jumps within an element, the error on halves is half as large, so the difference is half of the error. Where the load is
/// smooth, the ratio is nearly one.
const HALVES: f64 = 2.0;

/// Return the share of the loads of a body that facets may miss ([`surface::missed`]). A body force acts on the volume within all
/// surfaces, and the surfaces in contact represent them.
fn missed_by_facets<const D: usize>(body: &Unassembled<D>, pairs: &[ContactPair], mesh: &Mesh<D>) -> f64 {
    let part = &body.part;
    let groups = part.spec.load.iter().filter_map(|load| find_group(mesh, &load.on, &[D - 1], "load").ok());
    let on_groups = groups.map(|group| surface::missed(&part.space, &part.space.facets(group))).fold(0.0, f64::max);
    if part.spec.force.is_none() {
        return on_groups;
    }
    let points = body.segments.iter().flat_map(|segment| &pairs[segment.pair].surface[segment.side]);
    // Facets differ from their mean by half of the angle between them.
    points.map(|point| surface::by_chords(2.0 * point.spread)).fold(on_groups, f64::max)
}

/// Return a bound of the work on a motion of the nodal forces that the quadrature of surface loads misses.
fn missed_by_quadrature<const D: usize>(part: &SceneBody<D>, motion: &RigidMotion<D>, mesh: &Mesh<D>) -> f64 {
    let missed = part.missed_load(mesh).unwrap_or_default();
    let [_, largest] = missed.works(|node| motion.at(&part.space.nodes[node as usize]));
    HALVES * largest
}

/// Multiple of the difference between facets and their mean by which a motion may close a point: once for the normal, and once
/// for the motion itself.
const UNSURE: f64 = 2.0;

/// A contact point on the own surface of a body.
struct SurfacePoint<const D: usize> {
    /// Position, measured from the datum.
    at: [f64; D],
    normal: [f64; D],
    /// Uncertainty s_q of the normal.
    spread: f64,
    /// Square root of the share of its area in the area of all points.
    root: f64,
}

/// The surface of a body at its contact points.
struct SurfacePoints<const D: usize>(Vec<SurfacePoint<D>>);

impl<const D: usize> SurfacePoints<D> {
    /// Collect the points of all pairs of a body.
    fn of(body: &Unassembled<D>, pairs: &[ContactPair]) -> Self {
        let weights = |segment: &Segment| pairs[segment.pair].weight.iter();
        let all: f64 = body.segments.iter().flat_map(weights).sum();
        let first = |x: [f64; 3]| std::array::from_fn(|c| x[c]);
        let mut points = Vec::new();
        for segment in &body.segments {
            let surface = pairs[segment.pair].surface[segment.side].iter();
            points.extend(surface.zip(weights(segment)).map(|(point, weight)| SurfacePoint {
                at: first(point.at),
                normal: first(point.normal),
                spread: point.spread,
                root: (weight / all).sqrt(),
            }));
        }
        Self(points)
    }

    /// Return whether the surface is curved. Normals of flat facets differ by rounding, those of quadratic ones by the cube of the angle of a facet.
    fn are_curved(&self) -> bool {
        self.0.iter().any(|point| point.spread > f64::EPSILON.sqrt())
    }

    /// Return the combinations of motions that only facets resist. Pure motions are returned as such.
    fn along_surface(&self, motions: &[RigidMotion<D>]) -> Vec<RigidMotion<D>> {
        let rows = D * self.0.len();
        let moved = DMatrix::from_fn(rows, motions.len(), |row, j| {
            let point = &self.0[row / D];
            point.root * motions[j].at(&point.at)[row % D]
        });
        let closing = DMatrix::from_fn(self.0.len(), motions.len(), |q, j| {
            let SurfacePoint { at, normal, spread, root } = &self.0[q];
            root * dot(&motions[j].at(at), normal) / spread
        });
        let mut round = lowest(&closing, &(moved.transpose() * &moved), UNSURE);
        round.retain(|weights| self.passes(&rigid::sum(motions, weights)));
        pure(&round).iter().map(|weights| rigid::combine(motions, weights)).collect()
    }

    /// Return whether the motion closes no point by more than its uncertainty allows.
    fn passes(&self, motion: &RigidMotion<D>) -> bool {
        self.0.iter().all(|point| {
            let moved = motion.at(&point.at);
            dot(&moved, &point.normal).abs() <= UNSURE * point.spread * dot(&moved, &moved).sqrt()
        })
    }
}

/// Return the right singular vectors x of A with |A x|^2 <= most^2 x'B x, where B is positive semidefinite. The kernel of B is
/// excluded.
fn lowest(a: &DMatrix<f64>, b: &DMatrix<f64>, most: f64) -> Vec<DVector<f64>> {
    // Decompositions of matrices with NaN or infinite entries do not terminate.
    if b.is_empty() || a.iter().chain(b).any(|value| !value.is_finite()) {
        return Vec::new();
    }
    let of_b = b.clone().symmetric_eigen();
    let seen = (0..b.nrows()).filter(|&k| of_b.eigenvalues[k] > TOLERANCE * of_b.eigenvalues.amax());
    let basis: Vec<_> = seen.map(|k| of_b.eigenvectors.column(k) / of_b.eigenvalues[k].sqrt()).collect();
    if basis.is_empty() {
        return Vec::new();
    }
    let basis = DMatrix::from_columns(&basis);
    // The product of A with itself would lose half of the digits, and weights differ by ten orders of magnitude.
    let triangle = (a * &basis).qr().r();
    let of_a = triangle.svd(false, true);
    let Some(right) = of_a.v_t else { return Vec::new() };
    let low = (0..right.nrows()).filter(|&k| of_a.singular_values[k] <= most);
    low.map(|k| &basis * right.row(k).transpose()).collect()
}

/// Return a basis of the span of some vectors in which pure motions are separate.
fn pure(vectors: &[DVector<f64>]) -> Vec<DVector<f64>> {
    if vectors.is_empty() {
        return Vec::new();
    }
    let span = DMatrix::from_columns(vectors).qr().q();
    let off = DMatrix::identity(span.nrows(), span.nrows()) - &span * span.transpose();
    Blocks::free(&off, 1.0, TOLERANCE)
}
