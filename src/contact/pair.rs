//! The arrays of a contact pair, which are all that the solution methods know of two surfaces, and how much of them is
//! paired.

use super::basis::PressureBasis;
use super::law::{Law, LawMaker, Power};
use super::pieces::{Coverage, Intersection};
use super::side::{FaceNode, ROUNDING, Side, along};
use crate::error::{Error, Result};
use crate::fem::element::{self, Rule};
use crate::fem::{Frame, Space, area_vector, cross, length, pad};
use crate::linalg::{Csr, dot};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A discretised pair of surfaces: n contact points with one pressure each.
///
/// Contact point q stands for a function mu_q of a pressure space on side a. These functions sum to one on the covered
/// surface, and omega_q = int mu_q is the area of the point. Let `<v>_q = (1/omega_q) int mu_q v` be the mean of v over
/// the common pieces of both surfaces. The compression of the layer is `c = B_a u_a + B_b u_b - d`, where u_a and u_b
/// are the displacements, B_a and B_b the rows and d the gap. One set of points serves both sides, so action equals
/// reaction to rounding.
#[derive(Debug, Serialize, Deserialize)]
pub struct ContactPair {
    /// Names of the two surfaces; the first is side a, which carries the points.
    pub surfaces: [String; 2],
    /// Indices of the two bodies.
    pub bodies: [usize; 2],
    /// Node of side a that each point belongs to, n.
    pub nodes: Vec<u32>,
    /// Index of each point among the nodes of side a on its faces ([`Side::nodes`]), n.
    pub on_side: Vec<u32>,
    /// Smooth face of side a on which each point lies, numbered from 1, n. Faces are in the order of the middles of
    /// their points by x, then by y and z.
    pub face: Vec<u32>,
    /// Positions of the points on side a in the scene, n.
    pub position: Vec<[f64; 3]>,
    /// omega_q > 0, the length in the plane, else the area (in bodies of revolution that of a ring) across the normal,
    /// n.
    pub area: Vec<f64>,
    /// Unit normals from side a to side b, made of those of both sides, n.
    pub normal: Vec<[f64; 3]>,
    /// Length of the sum of the outer unit normals of both sides, n: zero where they are opposite.
    pub tilt: Vec<f64>,
    /// Whether the normals were turned across motions that nothing holds ([`ContactPair::turn`]).
    pub is_turned: bool,
    /// Spread of the normals of the facets around each point, n; empty where no facet of the pair leans. The first rank
    /// alone has it.
    #[serde(skip)]
    pub spread: Vec<[[f64; 3]; 3]>,
    /// Mean distance of the meshes around each point along the normal, n.
    pub distance: Vec<f64>,
    /// Initial gap d_q along the normal, n: the distance of the meshes plus the gap that the scene adds.
    pub gap: Vec<f64>,
    /// Closing of the gap (a length) that an earlier load step has found and locked.
    pub offset: f64,
    /// Contribution of prescribed displacements to the outer normal displacement of each side, n each.
    pub prescribed: [Vec<f64>; 2],
    /// B_a and B_b, n rows each with the dofs of the body as columns: `B_a u_a = <n.u_a>`, `B_b u_b = -<n.u_b>`.
    /// Prescribed dofs have no entries.
    pub rows: [Csr; 2],
    /// The same rows for the displacements of all nodes, constrained ones included, with columns `D * node +
    /// component`. The nodal forces of the contact are `-sum_q omega_q p_q nodal[side][q]`.
    pub nodal: [Csr; 2],
    /// Sum of the entries of each row by component, prescribed dofs included. The contact force on a side is
    /// `-sum_q omega_q p_q resultant[side][q]`.
    pub resultant: [Vec<[f64; 3]>; 2],
    /// Moment of the entries of each row about the origin of the scene. The contact moment on a side follows as the
    /// force does from `resultant`.
    pub moment: [Vec<[f64; 3]>; 2],
    /// Largest angle by which errors of coordinates turn the normals of a side.
    pub uncertainty: f64,
    /// What `area` measures.
    pub measure: Measure,
    /// Law of the layer. It does not go from rank to rank: whoever receives a pair makes its law anew.
    #[serde(skip, default = "no_law")]
    pub law: Law,
    /// Coverage of each facet of side a.
    pub cover: Vec<Coverage>,
}

/// What the areas of contact points are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Measure {
    /// Lengths along curves, in the plane.
    Length,
    /// Areas of the rings that curves make around the axis of a body of revolution.
    Ring,
    /// Areas of surfaces, in space.
    Area,
}

impl Measure {
    /// Return the word for tables: `length` or `area`.
    pub fn name(self) -> &'static str {
        if self == Self::Length { "length" } else { "area" }
    }

    /// Return whether points run along curves in their order.
    pub fn is_along_curve(self) -> bool {
        self != Self::Area
    }
}

/// Return what stands for the law of a pair from another rank until it is made.
fn no_law() -> Law {
    Law::new(Power::linear(0.0))
}

/// Why a pair could not be assembled.
#[derive(Debug)]
pub enum PairFault {
    /// The surfaces do not face each other anywhere.
    NoPartner,
    /// The scene's gap is not finite at this point.
    Gap([f64; 3]),
    /// The scene's law is invalid at a point.
    Law(Error),
}

/// Integrate over common pieces. Return the integrals of each node (on a face) that carries a point, and the coverage
/// of each facet of side a.
///
/// Contact points are the nodes of side a with the dual basis diag(int phi) M^-1 phi of the covered part of each facet,
/// where phi are the shape functions and M is their mass matrix. On quadratic triangles they are the mid-edges with the
/// dual basis of the whole triangle. A partially covered facet on which this basis has unsteady means takes the hat
/// functions of its vertices instead.
fn integrate<const D: usize>(
    a: &Side<D>,
    b: &Side<D>,
    common: &Intersection<D>,
) -> (BTreeMap<u32, Accumulator>, Vec<Coverage>) {
    let mut points: BTreeMap<u32, Accumulator> = BTreeMap::new();
    let mut all = common.cover.clone();
    let order = a.facets.order;
    let rule = element::rule_of_products(D, order);
    (0..all.len()).for_each(|i| all[i].measure = facet_measure(a, i, &rule));
    for chunk in common.points.chunk_by(|p, q| p.facet_a == q.facet_a) {
        let cover = &mut all[chunk[0].facet_a];
        cover.share = chunk.iter().map(|point| point.weight).sum::<f64>() / cover.measure;
        let basis = PressureBasis::on(order, a, &b.facets, cover.ends, chunk);
        let nodes = a.on_facet(chunk[0].facet_a);
        for point in chunk {
            let (phi, psi) = (element::values(order, &point.at_a), element::values(b.facets.order, &point.at_b));
            let others = b.on_facet(point.facet_b);
            for (&node, mu) in nodes.iter().zip(&basis.functions(&point.at_a)).filter(|(_, mu)| **mu != 0.0) {
                let mu = point.weight * mu;
                let sum = points.entry(node).or_default();
                sum.weight += mu;
                sum.gap += mu * point.gap;
                nodes.iter().zip(&phi).for_each(|(&n, phi)| *sum.sides[0].entry(n).or_default() += mu * phi);
                others.iter().zip(&psi).for_each(|(&n, psi)| *sum.sides[1].entry(n).or_default() += mu * psi);
            }
        }
        cover.basis = Some(basis);
    }
    all.iter_mut().filter(|cover| cover.is_whole()).for_each(|cover| cover.lost = 0);
    (points, all)
}

/// Assemble the arrays of a pair from the common pieces of its surfaces.
///
/// `bodies` are the indices of the bodies of side a and b. `gap(x)` is added to the distance of the meshes. `law` makes
/// the layer's law for the contact points.
///
/// # Errors
/// [`PairFault`] if nothing is covered, the gap is not finite, or the law is invalid.
pub fn assemble<const D: usize>(
    a: &Side<D>,
    b: &Side<D>,
    bodies: [usize; 2],
    common: &Intersection<D>,
    gap: &dyn Fn([f64; 3]) -> f64,
    law: &LawMaker,
) -> Result<ContactPair, PairFault> {
    let (points, cover) = integrate(a, b, common);
    let tiny = 1e-12 * points.values().map(|point| point.weight).fold(0.0, f64::max);
    let on_side = along(a, points.iter().filter(|(_, p)| p.weight > tiny).map(|(&at, _)| at));
    if on_side.is_empty() {
        return Err(PairFault::NoPartner);
    }
    let points: Vec<&Accumulator> = on_side.iter().map(|at| &points[at]).collect();
    let nodes: Vec<&FaceNode<D>> = on_side.iter().map(|&at| &a.nodes[at as usize]).collect();
    // a pressure acts on the area across its direction, on either side
    let across = |(point, at): (&&Accumulator, &&FaceNode<D>)| point.weight * dot(&at.normal, &at.direction);
    let position: Vec<[f64; 3]> = points.iter().map(|point| point.position(a)).collect();
    let law = law(&position).map_err(PairFault::Law)?;
    let mut pair = ContactPair {
        surfaces: [a.name.to_owned(), b.name.to_owned()],
        bodies,
        area: points.iter().zip(&nodes).map(across).collect(),
        normal: nodes.iter().map(|at| pad(at.direction)).collect(),
        tilt: nodes.iter().map(|at| at.tilt).collect(),
        spread: spreads(&nodes, a.tilt().max(b.tilt()).max(ROUNDING)),
        is_turned: false,
        distance: distances(a, &points),
        gap: Vec::new(),
        nodes: nodes.iter().map(|at| at.node).collect(),
        face: faces(a, &on_side, &points, &position),
        on_side,
        position,
        offset: 0.0,
        prescribed: [Vec::new(), Vec::new()],
        rows: [Csr::new(a.space.dofs()), Csr::new(b.space.dofs())],
        nodal: [Csr::new(a.space.dofs()), Csr::new(b.space.dofs())],
        resultant: [Vec::new(), Vec::new()],
        moment: [Vec::new(), Vec::new()],
        uncertainty: a.tilt().max(b.tilt()),
        measure: match D {
            2 if a.space.axisymmetric => Measure::Ring,
            2 => Measure::Length,
            _ => Measure::Area,
        },
        law,
        cover,
    };
    for (index, side) in [a, b].into_iter().enumerate() {
        for (q, point) in points.iter().enumerate() {
            let shares = point.shares(index);
            push_rows(&mut pair, index, side.space, directed(index, of_nodes(side, &shares), nodes[q].direction));
        }
        pair.hold(index, side.frame, side.prescribed);
    }
    pair.set_gap(gap)?;
    Ok(pair)
}

/// Return the spread of the normals around each contact point, nothing if none exceeds the `rounding` of normals.
fn spreads<const D: usize>(nodes: &[&FaceNode<D>], rounding: f64) -> Vec<[[f64; 3]; 3]> {
    let of = |at: &&FaceNode<D>| std::array::from_fn(|c| if c < D { pad(at.spread[c]) } else { [0.0; 3] });
    let leans = |at: &&FaceNode<D>| (0..D).any(|c| at.spread[c][c] > rounding * rounding);
    if nodes.iter().any(leans) { nodes.iter().map(of).collect() } else { Vec::new() }
}

/// Return the number of the face of each contact point.
///
/// Middles that differ by less than a thousandth of the surface count as equal, so that numbers do not depend on the
/// mesh.
fn faces<const D: usize>(a: &Side<D>, on_side: &[u32], points: &[&Accumulator], position: &[[f64; 3]]) -> Vec<u32> {
    let (face, [low, high]) = (a.faces(), a.extent());
    let step = 1e-3 * (0..D).map(|c| high[c] - low[c]).fold(0.0, f64::max);
    let mut middles: BTreeMap<u32, (f64, [f64; 3])> = BTreeMap::new();
    for ((&at, point), x) in on_side.iter().zip(points).zip(position) {
        let (weight, sum) = middles.entry(face[at as usize]).or_default();
        *weight += point.weight;
        add(sum, x.map(|x| point.weight * x));
    }
    let place = |(weight, sum): &(f64, [f64; 3])| sum.map(|sum| (sum / weight / step).round() as i64);
    let mut order: Vec<(u32, [i64; 3])> = middles.iter().map(|(&face, middle)| (face, place(middle))).collect();
    order.sort_by_key(|(face, place)| (*place, *face));
    let number = |at: &u32| 1 + order.iter().position(|(of, _)| *of == face[*at as usize]).unwrap_or(0) as u32;
    on_side.iter().map(number).collect()
}

/// Return the mean distance of the meshes around each contact point.
fn distances<const D: usize>(a: &Side<D>, points: &[&Accumulator]) -> Vec<f64> {
    let size = (points.len() as f64 * a.mean_measure()).powf(1.0 / (D - 1) as f64);
    // Matching surfaces differ by the rounding of the coordinates of both sides, along any normal.
    let rounding = (1e-12 * size).max(a.rounding_along_normals());
    let means = points.iter().map(|point| point.gap / point.weight);
    means.map(|distance| if distance.abs() < rounding { 0.0 } else { distance }).collect()
}

/// Return the shares of the nodes of a body in a point, from those of nodes on faces.
fn of_nodes<const D: usize>(side: &Side<D>, shares: &[(u32, f64)]) -> BTreeMap<u32, f64> {
    let mut sums = BTreeMap::new();
    shares.iter().for_each(|&(at, share)| *sums.entry(side.nodes[at as usize].node).or_default() += share);
    sums
}

/// Return the entries of the displacements of nodes in the row of a contact point for one side of a pair. `index` is 0
/// for side a and 1 for side b, `shares` holds the shares of the side's nodes in the point, and `normal` points out of
/// side a.
fn directed<const D: usize>(
    index: usize,
    shares: impl IntoIterator<Item = (u32, f64)>,
    normal: [f64; D],
) -> BTreeMap<u32, [f64; D]> {
    let sign = [1.0, -1.0][index];
    shares.into_iter().map(|(n, share)| (n, normal.map(|normal| sign * share * normal))).collect()
}

/// Append the row of a contact point for one side of a pair, from its entries at the nodes of the side.
fn push_rows<const D: usize>(pair: &mut ContactPair, index: usize, space: &Space<D>, entries: BTreeMap<u32, [f64; D]>) {
    let mut nodal = Vec::new();
    let (mut resultant, mut moment) = ([0.0; 3], [0.0; 3]);
    for (n, entry) in entries {
        nodal.extend((0..D).map(|c| (D * n as usize + c, entry[c])));
        add(&mut resultant, space.net_force(entry));
        add(&mut moment, space.net_moment(n, entry));
    }
    pair.nodal[index].push_row(nodal);
    pair.resultant[index].push(resultant);
    pair.moment[index].push(moment_in_scene(&space.datum, resultant, moment));
}

/// Return the moment about the origin of the scene of a force whose moment about `datum` is given.
pub fn moment_in_scene<const D: usize>(datum: &[f64; D], force: [f64; 3], moment: [f64; 3]) -> [f64; 3] {
    let arm = cross(pad(*datum), force);
    std::array::from_fn(|c| moment[c] + arm[c])
}

/// Add `v` to `sum`.
pub fn add(sum: &mut [f64; 3], v: [f64; 3]) {
    sum.iter_mut().zip(v).for_each(|(sum, v)| *sum += v);
}

/// Size up to which an entry of a contact row is rounding, where shares of nodes sum to one. Normals of facets in one
/// plane differ by 1e-16; four digits are left for coordinates of a mesh far from the origin.
pub const ENTRY_ROUNDING: f64 = 1e-12;

/// Share of a node in a point at or below which it is noise of the mesher's coordinates.
const NOISE: f64 = 1e-9;

/// Integrals of mu_q and of its products with the gap and with the shape functions of either side.
#[derive(Debug, Default)]
struct Accumulator {
    weight: f64,
    gap: f64,
    /// Integrals of mu_q times the shape function of each node on a face, for side a and side b.
    sides: [BTreeMap<u32, f64>; 2],
}

impl Accumulator {
    /// Return the shares of the nodes of a side in the contact point, which sum to one.
    ///
    /// The largest share takes those that are noise, so that surfaces that match to nine digits have nodal rows on both
    /// sides.
    fn shares(&self, side: usize) -> Vec<(u32, f64)> {
        let shares = self.sides[side].iter().map(|(&node, value)| (node, value / self.weight));
        let (mut kept, noise): (Vec<_>, Vec<_>) = shares.partition(|(_, share)| share.abs() > NOISE);
        let lost: f64 = noise.iter().map(|(_, share)| share).sum();
        if let Some(largest) = kept.iter_mut().max_by(|p, q| p.1.total_cmp(&q.1)) {
            largest.1 += lost;
        }
        kept
    }

    /// Return the position of the contact point on side a in the scene.
    fn position<const D: usize>(&self, a: &Side<D>) -> [f64; 3] {
        let shares = self.shares(0);
        let x = |at: u32| &a.space.nodes[a.nodes[at as usize].node as usize];
        let mean = |c: usize| shares.iter().map(|&(at, share)| share * x(at)[c]).sum();
        a.space.in_scene(std::array::from_fn(mean))
    }
}

impl ContactPair {
    /// Let the scene add `own(x)` to the distance of the meshes.
    ///
    /// # Errors
    /// [`PairFault::Gap`] if that is not finite at a point.
    pub fn set_gap(&mut self, own: &dyn Fn([f64; 3]) -> f64) -> Result<(), PairFault> {
        let gap = |(distance, &x): (&f64, &[f64; 3])| match own(x) {
            own if own.is_finite() => Ok(distance + own),
            _ => Err(PairFault::Gap(x)),
        };
        self.gap = self.distance.iter().zip(&self.position).map(gap).collect::<Result<_, _>>()?;
        Ok(())
    }

    /// Set the rows of a side from those of the displacements of its nodes, for the dofs of this frame and the values
    /// of those that supports prescribe.
    pub fn hold<const D: usize>(&mut self, side: usize, frame: &Frame<D>, prescribed: &BTreeMap<usize, f64>) {
        let nodal = &self.nodal[side];
        let mut held = Csr::new(nodal.columns);
        self.prescribed[side].clear();
        for q in 0..nodal.rows() {
            let (mut entries, mut along) = (BTreeMap::new(), 0.0);
            let row: Vec<(usize, f64)> = nodal.row(q).collect();
            for at_node in row.chunk_by(|p, q| p.0 / D == q.0 / D) {
                let mut entry = [0.0; D];
                at_node.iter().for_each(|(i, value)| entry[i % D] = *value);
                for (node, dofs) in frame.force((at_node[0].0 / D) as u32, entry) {
                    for (c, value) in dofs.into_iter().enumerate().filter(|(_, value)| value.abs() > ENTRY_ROUNDING) {
                        *entries.entry(D * node as usize + c).or_insert(0.0) += value;
                    }
                }
            }
            entries.retain(|dof, entry| {
                let value = prescribed.get(dof);
                along += value.map_or(0.0, |u| *entry * u);
                value.is_none()
            });
            held.push_row(entries);
            self.prescribed[side].push(along);
        }
        self.rows[side] = held;
    }

    /// Return the number of contact points.
    pub fn len(&self) -> usize {
        self.area.len()
    }

    /// Return the contact point of each of the `count` nodes of side a on its faces, if it is one.
    pub fn point_of(&self, count: usize) -> Vec<Option<usize>> {
        let mut of = vec![None; count];
        self.on_side.iter().enumerate().for_each(|(q, &at)| of[at as usize] = Some(q));
        of
    }

    /// Return the shares of the nodes of a side in a point, which sum to one.
    pub fn shares<const D: usize>(&self, side: usize, q: usize) -> Vec<(u32, f64)> {
        let (normal, sign) = (&self.normal[q][..D], [1.0, -1.0][side]);
        let entries: Vec<(usize, f64)> = self.nodal[side].row(q).collect();
        let of_node = |of: &[(usize, f64)]| {
            let along: f64 = of.iter().map(|(dof, entry)| entry * normal[dof % D]).sum();
            ((of[0].0 / D) as u32, sign * along)
        };
        entries.chunk_by(|p, q| p.0 / D == q.0 / D).map(of_node).collect()
    }

    /// Replace the unit normals at all points, and with them the rows of the displacements of nodes on both sides.
    /// [`ContactPair::hold`] then makes the rows of dofs.
    pub fn turn<const D: usize>(&mut self, normal: &[[f64; D]], spaces: [&Space<D>; 2]) {
        self.turn_with(normal, spaces, |_, _| &[]);
    }

    /// Do the same with `more` entries at nodes in the row of each side and point.
    pub(super) fn turn_with<'m, const D: usize>(
        &mut self,
        normal: &[[f64; D]],
        spaces: [&Space<D>; 2],
        more: impl Fn(usize, usize) -> &'m [(u32, [f64; D])],
    ) {
        for (index, space) in spaces.into_iter().enumerate() {
            let of_point = |q: usize| directed(index, self.shares::<D>(index, q), normal[q]);
            let rows: Vec<BTreeMap<u32, [f64; D]>> = (0..self.len()).map(of_point).collect();
            self.nodal[index] = Csr::new(space.dofs());
            self.resultant[index].clear();
            self.moment[index].clear();
            for (q, mut entries) in rows.into_iter().enumerate() {
                for (node, more) in more(index, q) {
                    let entry = entries.entry(*node).or_insert([0.0; D]);
                    (0..D).for_each(|c| entry[c] += more[c]);
                }
                push_rows(self, index, space, entries);
            }
        }
        self.normal = normal.iter().map(|&n| pad(n)).collect();
        self.is_turned = true;
    }

    /// Return the number of facets of side a without a partner.
    pub fn uncovered(&self) -> usize {
        self.cover.iter().filter(|facet| facet.share == 0.0).count()
    }

    /// Return the number of pieces, and of points of pieces, that the search for common points has lost.
    pub fn pieces_lost(&self) -> usize {
        self.cover.iter().map(|facet| facet.lost).sum()
    }

    /// Return the number of partially covered facets of side a that take the hat functions of their vertices.
    pub fn averaged(&self) -> usize {
        let partial = self.cover.iter().filter(|facet| !facet.is_whole());
        partial.filter(|facet| facet.basis.as_ref().is_some_and(|basis| basis.is_averaged)).count()
    }

    /// Return whether the pair has no points, which no pair from [`assemble`] has.
    pub fn is_empty(&self) -> bool {
        self.area.is_empty()
    }
}

/// Return the length (area) of facet `i`, in bodies of revolution the area of a ring.
fn facet_measure<const D: usize>(a: &Side<D>, i: usize, rule: &Rule) -> f64 {
    let x = a.facets.coordinates(i, a.space);
    let density = |l: &[f64]| {
        let at = a.facets.point(i, a.space, l);
        length(area_vector(a.facets.order, &x, l)) * a.space.circle(&at)
    };
    rule.iter().map(|(l, weight)| weight * density(l)).sum()
}
