//! Rigid motions of bodies, alone or together, that neither supports nor springs nor contact resist.
//!
//! A body may slide on a plane, halves of a ring of blocks may slide on each other, and a group of bodies without
//! supports may move as one. These motions close no point of contact ([`ClosingSquares`]), among the motions that
//! supports and springs leave to each body. Motions of a whole group come first, so that they are found and named as
//! such.
//!
//! Facets resist motions that smooth surfaces do not, such as the turn of a pin in a hub, because their normals lean
//! (docs/theory.md, "Motions that nothing holds"). Such motions count as free.
//!
//! If the loads do no work on a motion, the solution is unique only up to it. One dof is then fixed, without reaction.
//! If the loads do work on it, there is no solution, and the run reports this. Loads that balance on the true surfaces
//! may lack balance on facets, and by quadrature. A small imbalance is taken from the loads, with a warning.

use super::body_mesh::BodyMesh;
use super::scene_body::{NO_WORK, SceneBody};
use crate::contact::ContactPair;
use crate::error::{few, joined};
use crate::fem::balance::{Balance, balanced};
use crate::fem::{PointExtent, RigidMotion, length, minus, rigid, unit};
use crate::linalg::{Blocks, DisjointSets, PART, TOLERANCE, axpy, dot, fit};
use crate::model::Mechanism;
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use std::collections::BTreeSet;

/// Least value of [`MechanismSearch::lack`]: forces in equilibrium that people write have three digits or more.
const LACKING: f64 = 1e-3;

/// Find the motions that nothing resists. Fix those on which no load works. `lack` is the share that chords may take
/// from the balance of loads.
///
/// Both sides of a pair slide along each other in such a motion: the normals of the pair are turned across it.
pub fn fix<const D: usize>(bodies: &mut [SceneBody<D>], pairs: &mut [ContactPair], lack: f64) -> Vec<Mechanism> {
    let tilt = pairs.iter().map(|pair| pair.uncertainty).fold(0.0, f64::max);
    let mut search =
        MechanismSearch { bodies, pairs, tilt, lack: lack.max(LACKING), found: Vec::new(), fixed: Vec::new() };
    for group in search.groups() {
        search.settle(search.as_one(&group), |_| false);
    }
    if search.found.iter().all(|mechanism| mechanism.work == 0.0) {
        let squares = search.squares();
        let least = search.tolerance();
        let is_resisted = |motion: &DVector<f64>| squares.closing.energy(motion) > least * motion.norm_squared();
        search.settle(search.kernel(&squares), is_resisted);
        search.turn_normals();
    }
    search.found
}

/// A motion of some bodies, each of which is rigid.
#[derive(Clone)]
struct GroupMotion<const D: usize> {
    /// Indices of the bodies that it moves.
    bodies: Vec<usize>,
    /// Motions of these bodies.
    motions: Vec<RigidMotion<D>>,
    /// The amounts of the motions of all bodies, body by body.
    amounts: DVector<f64>,
}

/// The motion of several bodies that is nearest to one of them as one.
struct NearMotion {
    /// The amounts of the motions of all bodies.
    amounts: DVector<f64>,
    /// What the displacements of the corners of the boxes around the bodies lack.
    off: Vec<f64>,
}

struct MechanismSearch<'p, 's, const D: usize> {
    bodies: &'p mut [SceneBody<'s, D>],
    pairs: &'p mut [ContactPair],
    /// Angle by which errors of coordinates turn normals.
    tilt: f64,
    /// Largest work of the loads on a motion, as a share of what forces of their sizes could do, that the mesh may be
    /// blamed for.
    lack: f64,
    found: Vec<Mechanism>,
    /// The motions that contact does not resist and that are fixed.
    fixed: Vec<GroupMotion<D>>,
}

impl<const D: usize> MechanismSearch<'_, '_, D> {
    /// Return the motions that supports and springs leave to a body at present.
    fn unconstrained(&self, body: usize) -> &[RigidMotion<D>] {
        self.bodies[body].mesh.free_motions()
    }

    fn extent(&self, body: usize) -> &PointExtent {
        &self.bodies[body].mesh.extent
    }

    /// Return the groups of at least two bodies that pairs connect, in the order of their first bodies. A group before
    /// an obstacle does not move as one.
    fn groups(&self) -> Vec<Vec<usize>> {
        let count = self.bodies.len();
        let (apart, before): (Vec<_>, Vec<_>) =
            self.pairs.iter().map(|pair| pair.bodies).partition(|[_, b]| *b < count);
        let mut joined = DisjointSets::new(count);
        apart.iter().for_each(|&[a, b]| joined.join(a as u32, b as u32));
        let (count, group) = joined.classes();
        let mut members = vec![Vec::new(); count];
        (0..self.bodies.len()).for_each(|body| members[group[body] as usize].push(body));
        members.retain(|bodies| bodies.len() > 1 && before.iter().all(|[body, _]| !bodies.contains(body)));
        members
    }

    /// Return the rigid motions of some bodies as one.
    fn common(&self, bodies: &[usize]) -> Vec<RigidMotion<D>> {
        let extent = bodies.iter().fold(PointExtent::default(), |all, &body| all.join(self.extent(body)));
        rigid::of(&extent, bodies.iter().any(|&body| self.bodies[body].mesh.space.axisymmetric))
    }

    /// Return the displacements of the corners of the box around a body.
    fn at_corners(&self, body: usize, motion: &RigidMotion<D>) -> Vec<f64> {
        motion.nodal(self.extent(body).corners())
    }

    /// Return the motions of a group as one body that the supports of its bodies leave.
    fn as_one(&self, group: &[usize]) -> Vec<DVector<f64>> {
        let near: Vec<NearMotion> = self.common(group).iter().map(|motion| self.near(group, motion)).collect();
        let displacements = near.first().map_or(1, |motion| motion.off.len() / group.len());
        let held = DMatrix::from_fn(near.len(), near.len(), |i, j| dot(&near[i].off, &near[j].off));
        let free = Blocks::free(&(held / displacements as f64), 1.0, TOLERANCE);
        let sum = |weights: DVector<f64>| weights.iter().zip(&near).map(|(w, motion)| *w * &motion.amounts).sum();
        free.into_iter().map(sum).collect()
    }

    /// Return what comes nearest to a motion of several bodies as one among the motions that supports leave.
    fn near(&self, bodies: &[usize], motion: &RigidMotion<D>) -> NearMotion {
        let (mut amounts, mut off) = (DVector::zeros(self.count()), Vec::new());
        for &body in bodies {
            let left: Vec<Vec<f64>> = self.unconstrained(body).iter().map(|own| self.at_corners(body, own)).collect();
            let mut rest = self.at_corners(body, motion);
            let own = fit(&left, &rest);
            own.iter().zip(&left).for_each(|(&a, motion)| axpy(-a, motion, &mut rest));
            amounts.as_mut_slice()[self.first(body)..][..own.len()].copy_from_slice(&own);
            off.extend(rest);
        }
        NearMotion { amounts, off }
    }

    /// Return the number of all motions.
    fn count(&self) -> usize {
        self.first(self.bodies.len())
    }

    /// Return the number of the first motion of a body.
    fn first(&self, body: usize) -> usize {
        (0..body).map(|body| self.unconstrained(body).len()).sum()
    }

    /// Return the motions that contact does not resist, and those that facets alone resist.
    ///
    /// Motions are of size one. So a motion that closes less than the error of the normals is free, and so is one that
    /// closes less than the root of [`TOLERANCE`], the error of coordinates on curves.
    fn kernel(&self, squares: &ClosingSquares) -> Vec<DVector<f64>> {
        let ClosingSquares { closing, leaning, .. } = squares;
        let mut held = closing.clone();
        leaning.stored().for_each(|(i, j, block)| held.add(i, j, &(-DOUBT * block)));
        let held = held.factor_unscaled(self.tolerance());
        let leans = |motion: &DVector<f64>| leaning.energy(motion) > self.tolerance() * motion.norm_squared();
        let (doubtful, mut free): (Vec<_>, Vec<_>) = held.kernel().into_iter().partition(leans);
        if !doubtful.is_empty() {
            let all = DMatrix::from_columns(&doubtful);
            let products = |matrix: &Blocks| {
                let columns: Vec<_> = doubtful.iter().map(|motion| matrix.multiply(motion)).collect();
                all.tr_mul(&DMatrix::from_columns(&columns))
            };
            let doubt = DOUBT * products(leaning) + self.tolerance() * all.tr_mul(&all);
            let of_all = |weights: DVector<f64>| &all * weights;
            let found = less(&products(closing), doubt).map(|few| few.into_iter().map(of_all).collect());
            let works = |body: usize| self.unconstrained(body).iter().map(move |motion| self.bodies[body].work(motion));
            let loads = DVector::from_vec((0..self.bodies.len()).flat_map(works).collect());
            let yielding = held.solve(&loads);
            let found = squares.rounded(found.unwrap_or(doubtful));
            free.extend(found.into_iter().map(|motion| {
                let is_exact = closing.energy(&motion) <= self.tolerance() * motion.norm_squared();
                if is_exact { motion } else { squares.unloaded(motion, &loads, &yielding) }
            }));
        }
        free
    }

    /// Return the share of e'e up to which the mean square of the closings of a motion e is rounding.
    fn tolerance(&self) -> f64 {
        TOLERANCE.max(self.tilt * self.tilt)
    }

    /// Return the [`ClosingSquares`] of all pairs.
    ///
    /// The displacement between the two sides is that of both motions at the position of the point. So bodies that move
    /// as one close nothing, whatever the rows of a mesh say where curved surfaces are apart.
    fn squares(&self) -> ClosingSquares {
        let sizes: Vec<usize> = (0..self.bodies.len()).map(|body| self.unconstrained(body).len()).collect();
        let [mut closing, mut leaning, mut error] = [0; 3].map(|_| Blocks::new(&sizes));
        for pair in self.pairs.iter().filter(|pair| pair.bodies[0] != pair.bodies[1]) {
            let sides: Vec<usize> = pair.bodies.into_iter().filter(|body| *body < self.bodies.len()).collect();
            let signed = |(&body, sign): (&usize, f64)| sign * self.at_points(body, pair);
            let moves: Vec<DMatrix<f64>> = sides.iter().zip([1.0, -1.0]).map(signed).collect();
            let closings: Vec<DMatrix<f64>> = moves.iter().map(|u| closings::<D>(u, &pair.normal)).collect();
            let turned: Vec<DMatrix<f64>> = moves.iter().map(|u| turned::<D>(u, &pair.spread)).collect();
            for (s, &i) in sides.iter().enumerate() {
                for (t, &j) in sides.iter().enumerate().skip(s) {
                    closing.add(i, j, &closings[s].tr_mul(&closings[t]));
                    if !pair.spread.is_empty() {
                        let leans = moves[s].tr_mul(&turned[t]);
                        leaning.add(i, j, &leans);
                        error.add(i, j, &(leans / pair.len() as f64));
                    }
                }
            }
        }
        ClosingSquares { closing, leaning, error }
    }

    /// Turn the normals of all pairs across the motions that are fixed, so that contact does not resist them to the
    /// last digit.
    ///
    /// Let V hold the relative displacements v_j of both sides at a point, averaged as its rows do. The new normal is
    /// the direction of (I + V V' / s)^-1 n with s = [`TOLERANCE`]: the part of n along V vanishes. If two motions span
    /// all directions, as those of two discs that turn for themselves nearly do, the direction is that of least
    /// displacement.
    fn turn_normals(&mut self) {
        let leaning: Vec<usize> = (0..self.pairs.len()).filter(|&i| !self.pairs[i].spread.is_empty()).collect();
        let mut turned = BTreeSet::new();
        for number in leaning {
            let pair = &self.pairs[number];
            let motions: Vec<&GroupMotion<D>> = self.fixed.iter().filter(|moving| self.slides(moving, pair)).collect();
            if motions.is_empty() {
                continue;
            }
            let normal: Vec<[f64; D]> = (0..pair.len()).map(|q| self.across(&motions, pair, q)).collect();
            // an obstacle has the rows of the surface before it until it is a rigid part
            let [a, b] = pair.bodies;
            let meshes = [a, if b < self.bodies.len() { b } else { a }].map(|body| &self.bodies[body].mesh);
            let pair = &mut self.pairs[number];
            pair.turn(&normal, meshes.map(|mesh| &*mesh.space));
            for (side, mesh) in meshes.into_iter().enumerate() {
                pair.hold(side, &mesh.held.frame, &mesh.held.prescribed);
            }
            turned.extend([a, b]);
        }
        for (_, body) in self.bodies.iter_mut().enumerate().filter(|(number, _)| turned.contains(number)) {
            body.collect_rows(self.pairs);
            body.mesh.find_motions();
        }
    }

    /// Return whether the two sides of a pair slide along each other in a motion. Bodies that move as one do not.
    fn slides(&self, moving: &GroupMotion<D>, pair: &ContactPair) -> bool {
        let at = |body: usize, x: &[f64; 3]| {
            let motion = moving.of(body).map(|motion| (motion, self.bodies[body].mesh.space.datum));
            motion.map_or([0.0; D], |(motion, datum)| motion.at(&std::array::from_fn(|c| x[c] - datum[c])))
        };
        let [a, b] = pair.bodies;
        a != b && pair.position.iter().any(|x| length(minus(at(a, x), at(b, x))) > PART * moving.amounts.norm())
    }

    /// Return the normal of a point of a pair, turned across motions.
    fn across(&self, motions: &[&GroupMotion<D>], pair: &ContactPair, q: usize) -> [f64; D] {
        let displacement = |moving: &&GroupMotion<D>| {
            let mut v = DVector::<f64>::zeros(D);
            for (side, (&body, sign)) in pair.bodies.iter().zip([1.0, -1.0]).enumerate() {
                let Some(motion) = moving.of(body) else { continue };
                for (node, share) in pair.shares::<D>(side, q) {
                    let u = self.bodies[body].mesh.at(motion, node);
                    v.axpy(sign * share, &DVector::from_row_slice(&u), 1.0);
                }
            }
            v / moving.amounts.norm()
        };
        let all = DMatrix::from_columns(&motions.iter().map(displacement).collect::<Vec<_>>());
        let svd = all.svd(true, false);
        let normal = DVector::from_row_slice(&pair.normal[q][..D]);
        let mut turned = normal.clone();
        for (u, sigma) in svd.u.iter().flat_map(|u| u.column_iter()).zip(&svd.singular_values) {
            turned.axpy(-u.dot(&normal) * sigma * sigma / (sigma * sigma + TOLERANCE), &u, 1.0);
        }
        unit(std::array::from_fn(|c| turned[c]))
    }

    /// Return the displacements of the points of a pair by the motions of a body, one column each, times the root of
    /// the share of each point in the area.
    fn at_points(&self, body: usize, pair: &ContactPair) -> DMatrix<f64> {
        let (motions, datum) = (self.unconstrained(body), &self.bodies[body].mesh.space.datum);
        let area: f64 = pair.area.iter().sum();
        let roots: Vec<f64> = pair.area.iter().map(|own| (own / area).sqrt()).collect();
        let points = || pair.position.iter().map(|x| std::array::from_fn(|c| x[c] - datum[c]));
        let columns = motions.iter().map(|motion| motion.nodal(points()));
        let scaled = columns.flat_map(|u| u.into_iter().enumerate().map(|(i, u)| roots[i / D] * u).collect::<Vec<_>>());
        DMatrix::from_iterator(D * pair.len(), motions.len(), scaled)
    }

    /// Return the motion with these amounts.
    fn moving(&self, amounts: DVector<f64>) -> GroupMotion<D> {
        let (mut bodies, mut motions, mut first) = (Vec::new(), Vec::new(), 0);
        let least = PART * amounts.amax();
        for body in 0..self.bodies.len() {
            let left = self.unconstrained(body);
            let own = amounts.rows(first, left.len());
            first += left.len();
            if own.amax() > least {
                bodies.push(body);
                motions.push(rigid::sum(left, &own.into_owned()));
            }
        }
        GroupMotion { bodies, motions, amounts }
    }

    /// Fix motions that nothing resists if no load works on them, and record them.
    fn settle(&mut self, all: Vec<DVector<f64>>, is_resisted: impl Fn(&DVector<f64>) -> bool) {
        let mut sets: Vec<Vec<GroupMotion<D>>> = Vec::new();
        for moving in all.into_iter().map(|amounts| self.moving(amounts)) {
            match sets.iter_mut().find(|set| set[0].bodies == moving.bodies) {
                Some(set) => set.push(moving),
                None => sets.push(vec![moving]),
            }
        }
        let named: Vec<Vec<(String, GroupMotion<D>)>> = sets.into_iter().map(|set| self.named(set)).collect();
        let works: Vec<Vec<f64>> =
            named.iter().map(|set| set.iter().map(|(_, moving)| self.work(moving).abs()).collect()).collect();
        let worst = works.iter().flatten().copied().fold(0.0, f64::max);
        if worst <= self.lack {
            self.balance(&named.iter().flatten().map(|(_, moving)| moving).collect::<Vec<_>>());
        }
        let mut pins = Vec::new();
        for (set, works) in named.into_iter().zip(works) {
            let most = works.iter().copied().fold(0.0, f64::max);
            let by_facets = set.iter().any(|(_, moving)| is_resisted(&moving.amounts));
            let mechanism =
                |motion: String| Mechanism { bodies: set[0].1.bodies.clone(), motion, by_facets, ..Default::default() };
            if worst > self.lack {
                // The motion on which loads work most is the reason, and the others of its bodies are not of interest.
                let reason = works.iter().position(|work| *work == worst);
                self.found.extend(reason.map(|i| Mechanism {
                    work: worst,
                    support: set[i].1.motions[0].support().to_owned(),
                    ..mechanism(set[i].0.clone())
                }));
                continue;
            }
            let names = set.iter().map(|(name, _)| name.as_str());
            let balanced = if most > self.tilt.max(NO_WORK) { most } else { 0.0 };
            let mut mechanism = Mechanism { balanced, ..mechanism(joined(names)) };
            for (_, moving) in set {
                self.fixed.push(moving.clone());
                mechanism.fixed = self.pin(moving, &mut pins).or(mechanism.fixed);
            }
            self.found.push(mechanism);
        }
        self.bodies.iter_mut().for_each(|body| body.mesh.find_motions());
    }

    /// Return motions of the same bodies with their names. Where the bodies move as one, translations and rotations are
    /// apart.
    fn named(&self, set: Vec<GroupMotion<D>>) -> Vec<(String, GroupMotion<D>)> {
        let whole = self.common(&set[0].bodies);
        let at = |bodies: &[usize], motion: &dyn Fn(usize) -> RigidMotion<D>| -> Vec<f64> {
            bodies.iter().enumerate().flat_map(|(k, &body)| self.at_corners(body, &motion(k))).collect()
        };
        let vectors: Vec<Vec<f64>> = whole.iter().map(|motion| at(&set[0].bodies, &|_| motion.clone())).collect();
        let mut spans = Vec::new();
        for moving in &set {
            let mut rest = at(&moving.bodies, &|k| moving.motions[k].clone());
            let (size, amounts) = (dot(&rest, &rest), fit(&vectors, &rest));
            amounts.iter().zip(&vectors).for_each(|(&a, vector)| axpy(-a, vector, &mut rest));
            if dot(&rest, &rest) > PART * PART * size {
                let name = |moving: GroupMotion<D>| (self.name_of_each(&moving), moving);
                return set.into_iter().map(name).collect();
            }
            spans.push((rigid::sum(&whole, &DVector::from_vec(amounts)), moving.amounts.clone()));
        }
        let bodies = &set[0].bodies;
        let mut spans = rigid::apart(spans);
        let shifts = rigid::to_common_point(&spans.iter().map(|(motion, _)| motion).collect::<Vec<_>>());
        for (span, shift) in spans.iter_mut().zip(shifts) {
            let (_, amounts) = span;
            for c in (0..D).filter(|&c| shift[c] != 0.0) {
                *amounts += shift[c] * self.near(bodies, &whole[c]).amounts;
            }
        }
        spans.into_iter().map(|(motion, amounts)| (motion.in_words(), self.moving(amounts))).collect()
    }

    /// Return the name of a motion of several bodies, each of which has its own.
    fn name_of_each(&self, moving: &GroupMotion<D>) -> String {
        let each = moving.bodies.iter().zip(&moving.motions);
        let name = |(&body, motion): (&usize, &RigidMotion<D>)| {
            format!("{} of {}", motion.in_words(), self.bodies[body].spec.name.value)
        };
        few(each.map(name)).join(", ")
    }

    /// Return the work of the loads on a motion, as a share of the work that forces of their sizes could do; zero if it
    /// is rounding.
    fn work(&self, moving: &GroupMotion<D>) -> f64 {
        let [work, largest] = moving.works(self.bodies);
        if work.abs() <= largest * NO_WORK { 0.0 } else { work / largest }
    }

    /// Change the loads so that they do no work on any of these motions ([`Balance`]). Forces on rigid surfaces do not
    /// change.
    fn balance(&mut self, all: &[&GroupMotion<D>]) {
        if all.iter().all(|moving| self.work(moving) == 0.0) {
            return;
        }
        let works = DVector::from_iterator(all.len(), all.iter().map(|moving| moving.works(self.bodies)[0]));
        let of_body = |number: usize| -> Vec<(usize, &RigidMotion<D>)> {
            all.iter().enumerate().filter_map(|(j, moving)| Some((j, moving.of(number)?))).collect()
        };
        let moved = |mesh: &BodyMesh<D>, motions: &[(usize, &RigidMotion<D>)], node: u32| -> Vec<(usize, [f64; D])> {
            motions.iter().map(|(j, motion)| (*j, mesh.at(motion, node))).collect()
        };
        let mut balance = Balance::new(all.len());
        for (number, body) in self.bodies.iter().enumerate() {
            let (mesh, motions) = (&body.mesh, of_body(number));
            mesh.load.iter().for_each(|(node, force)| balance.add(force, &moved(mesh, &motions, node)));
        }
        let amounts = balance.amounts(&works);
        for (number, body) in self.bodies.iter_mut().enumerate() {
            let motions = of_body(number);
            if !motions.is_empty() {
                body.change_loads(|mesh, node, force| balanced(force, &moved(mesh, &motions, node), &amounts));
            }
        }
    }

    /// Fix a dof against a motion, without the parts that earlier dofs hold. Return its body, the largest one with a
    /// suitable node where the motion is not small.
    fn pin(&mut self, moving: GroupMotion<D>, pins: &mut Vec<Pin>) -> Option<usize> {
        let mut amounts = moving.amounts;
        for pin in pins.iter() {
            let there = self.moving(amounts.clone());
            let value = there.of(pin.body).map_or(0.0, |motion| self.bodies[pin.body].mesh.dof_of(motion, pin.dof));
            amounts -= value * &pin.amounts;
        }
        let moving = self.moving(amounts);
        let candidate = |(&body, motion): (&usize, &RigidMotion<D>)| {
            let (dof, moved) = self.bodies[body].candidate(motion)?;
            Some((Pin { body, dof, amounts: &moving.amounts / moved }, moved.abs()))
        };
        let mut all: Vec<(Pin, f64)> = moving.bodies.iter().zip(&moving.motions).filter_map(candidate).collect();
        let most = all.iter().map(|(_, moved)| *moved).fold(0.0, f64::max);
        all.retain(|(_, moved)| *moved > NEAR * most);
        let size = |pin: &Pin| self.extent(pin.body).size();
        let (pin, _) = all.into_iter().rev().max_by(|a, b| size(&a.0).total_cmp(&size(&b.0)))?;
        let body = pin.body;
        self.bodies[body].fix(pin.dof);
        pins.push(pin);
        Some(body)
    }
}

/// Quadratic forms of the motions of all bodies. Let u be the displacement between the two sides at a point with the
/// normal n.
struct ClosingSquares {
    /// Mean squares of the closings n.u, summed over pairs.
    closing: Blocks,
    /// Mean squares of (n_f - n).u with the normals n_f of the facets around.
    leaning: Blocks,
    /// The same over the number of points of the pair: the square of the error that normals which lean at random leave
    /// in the mean closing.
    error: Blocks,
}

impl ClosingSquares {
    /// Return whether a motion differs from another by no more than the error of that one.
    fn is_near(&self, motion: &DVector<f64>, other: &DVector<f64>) -> bool {
        self.closing.energy(motion) <= self.closing.energy(other) + self.error.energy(other)
    }

    /// Return motions without their small parts, if these may be errors in all of them.
    fn rounded(&self, motions: Vec<DVector<f64>>) -> Vec<DVector<f64>> {
        let round = |motion: &DVector<f64>| {
            let least = SLIGHT * motion.amax();
            motion.map(|part| if part.abs() < least { 0.0 } else { part })
        };
        let rounded: Vec<DVector<f64>> = motions.iter().map(round).collect();
        let all_near = rounded.iter().zip(&motions).all(|(rounded, motion)| self.is_near(rounded, motion));
        if all_near { rounded } else { motions }
    }

    /// Return a motion without the part on which loads work, if that may be an error. `yielding` are the motions by
    /// which contact yields to the loads.
    fn unloaded(&self, motion: DVector<f64>, loads: &DVector<f64>, yielding: &DVector<f64>) -> DVector<f64> {
        let unloaded = &motion - loads.dot(&motion) / loads.dot(yielding) * yielding;
        if self.is_near(&unloaded, &motion) { unloaded } else { motion }
    }
}

/// Share of a motion below which a part of it may be an error of the normals of facets. On the coarsest round parts,
/// with twelve facets around, normals of single facets lean by 0.15, and their mean over three dozen points by a sixth
/// of that.
const SLIGHT: f64 = 0.03;

/// Return n.u at each point for the displacements u in each column.
fn closings<const D: usize>(u: &DMatrix<f64>, normal: &[[f64; 3]]) -> DMatrix<f64> {
    DMatrix::from_fn(normal.len(), u.ncols(), |q, k| (0..D).map(|c| normal[q][c] * u[(D * q + c, k)]).sum())
}

/// Return L u at each point for the displacements u in each column.
fn turned<const D: usize>(u: &DMatrix<f64>, spread: &[[[f64; 3]; 3]]) -> DMatrix<f64> {
    let of = |i: usize, k: usize| (0..D).map(|c| spread[i / D][i % D][c] * u[(i - i % D + c, k)]).sum();
    DMatrix::from_fn(D * spread.len(), u.ncols(), of)
}

/// Return a basis of the weights x with x'Ax <= x'Bx, for a positive semidefinite A and a positive definite B; `None`
/// if these are all, or B is not definite.
fn less(a: &DMatrix<f64>, b: DMatrix<f64>) -> Option<Vec<DVector<f64>>> {
    let root = b.cholesky()?.unpack();
    let half = root.solve_lower_triangular(a)?;
    let eigen = SymmetricEigen::new(root.solve_lower_triangular(&half.transpose())?);
    let least: Vec<usize> = (0..a.nrows()).filter(|&i| eigen.eigenvalues[i] <= 1.0).collect();
    let vector = |i: usize| root.tr_solve_lower_triangular(&eigen.eigenvectors.column(i));
    (least.len() < a.nrows()).then(|| least.into_iter().filter_map(vector).collect())
}

/// Share of the mean square by which the normals of facets lean along a motion, below which the mean square of its
/// closings may be their error: the motion then closes less than half of what single facets would. A pin in a hub has
/// up to 0.12 of it (turns 0.05), a plug in a taper of 1:20 twice as much as all of it with 24 facets around.
const DOUBT: f64 = 0.25;

/// Share of the largest displacement from which a node can fix a motion; two of its digits are lost there.
const NEAR: f64 = 1e-2;

/// A dof that was fixed, with the motion that it fixes, which is one at this dof and zero at earlier ones.
struct Pin {
    body: usize,
    dof: usize,
    amounts: DVector<f64>,
}

impl<const D: usize> GroupMotion<D> {
    /// Return the work of the loads on the motion, and the largest work that forces of their magnitudes could do.
    fn works(&self, bodies: &[SceneBody<D>]) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (&body, motion) in self.bodies.iter().zip(&self.motions) {
            let works = bodies[body].works(motion);
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
