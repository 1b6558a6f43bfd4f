//! The arrays of a contact pair: all that the method knows of two surfaces.

use super::basis::{Carriers, PressureBasis};
use super::cover::{Cover, Left};
use super::law::{LayerLaw, Linear};
use super::pieces::Common;
use super::side::{Side, length};
use crate::error::{Error, Result};
use crate::fem::assemble::interpolate;
use crate::fem::{cross, element, pad};
use crate::linalg::Csr;
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;

/// A pair of surfaces, discretised: n points with one pressure each.
///
/// Point q stands for a function mu_q of a pressure space on side a, with sum_q mu_q = 1 on the covered surface and
/// omega_q = int mu_q. With `<v>_q = (1/omega_q) int mu_q v` over the common pieces, the compression of the layer is
/// `c = B_a u_a + B_b u_b - d`. One set of points serves both sides, so action equals reaction to rounding.
#[derive(Debug, Serialize, Deserialize)]
pub struct ContactPair {
    /// Names of the two surfaces; the first carries the points.
    pub surfaces: [String; 2],
    /// Numbers of the two bodies.
    pub bodies: [usize; 2],
    /// Node of side a that each point belongs to, n.
    pub nodes: Vec<u32>,
    /// Positions of the points on side a in the scene, n.
    pub position: Vec<[f64; 3]>,
    /// omega_q > 0, length or area (in bodies of revolution that of a ring), n.
    pub weight: Vec<f64>,
    /// Unit normals from side a to side b, n.
    pub normal: Vec<[f64; 3]>,
    /// Initial gap d_q along the normal, n: geometry and the scene's own gap.
    pub gap: Vec<f64>,
    /// What prescribed displacements contribute to the outer normal displacement of each side, n each.
    pub prescribed: [Vec<f64>; 2],
    /// B_a and B_b, n rows each, columns the dofs of the body: `B_a u_a = <n.u_a>`, `B_b u_b = -<n.u_b>`.
    pub rows: [Csr; 2],
    /// The same rows for displacements of the nodes, supported ones included: columns `D * node + component`. Nodal forces of
    /// the contact are `-sum_q omega_q p_q nodal[side][q]`.
    pub nodal: [Csr; 2],
    /// Sum of each row's entries by component, prescribed dofs included: force vectors on a side are
    /// `-sum_q omega_q p_q resultant[side][q]`.
    pub resultant: [Vec<[f64; 3]>; 2],
    /// Moments of these entries about the origin of the scene, for the moments on a side in the same way.
    pub moment: [Vec<[f64; 3]>; 2],
    /// The surfaces of both sides at the points, n each.
    pub surface: [Vec<OwnSurface>; 2],
    /// Whether the points run along curves in their order (plane problems).
    pub along_curve: bool,
    /// What the weights are: `"length"`, or in space and for bodies of revolution `"area"`.
    #[serde(deserialize_with = "measure")]
    pub measure: Measure,
    /// Law of the layer. It does not go from rank to rank: whoever receives a pair makes its law anew.
    #[serde(skip, default = "no_law")]
    pub law: Rc<dyn LayerLaw>,
    /// What the pair takes of each facet of side a.
    pub cover: Vec<Cover>,
    /// What the search for common points has lost, if anything.
    pub lost: Option<LostPieces>,
}

/// What the weights of contact points are: `"length"` or `"area"`.
pub type Measure = &'static str;

/// Return what the weights of a pair from another rank are.
fn measure<'de, R: Deserializer<'de>>(from: R) -> Result<Measure, R::Error> {
    String::deserialize(from).map(|name| if name == "length" { "length" } else { "area" })
}

/// Return what stands for the law of a pair from another rank until it is made.
fn no_law() -> Rc<dyn LayerLaw> {
    Rc::new(Linear { stiffness: 0.0 })
}

/// What the surface of one side itself is like around a point: means over its nodes with the shares that they have in the point.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct OwnSurface {
    /// Where it is, measured from the datum of the mesh.
    pub at: [f64; 3],
    /// The mean of its outer unit normals.
    pub normal: [f64; 3],
    /// How well that is known: [`Side::spread`].
    pub spread: f64,
}

impl OwnSurface {
    fn mean<const D: usize>(side: &Side<D>, shares: &[(u32, f64)], spread: &HashMap<u32, f64>) -> Self {
        let mut mean = Self::default();
        for (node, share) in shares {
            let (x, normal) = (side.space.nodes[*node as usize], side.normals[node]);
            add(&mut mean.at, pad(x.map(|x| share * x)));
            add(&mut mean.normal, pad(normal.map(|n| share * n)));
            mean.spread += share.abs() * spread[node];
        }
        mean
    }
}

/// Pieces of a pair that are lost because the search for their points failed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LostPieces {
    /// How many, points of pieces included.
    pub pieces: usize,
    /// The share of the area (length) of side a that lacks on their facets.
    pub share: f64,
    /// The middle of the facet that lacks most (x, y, z).
    pub at: [f64; 3],
}

impl LostPieces {
    /// What facets of side a with these covers have lost; none if all was found.
    fn of<const D: usize>(a: &Side<D>, cover: &[Cover]) -> Option<Self> {
        let lacking = |&(i, cover): &(usize, &Cover)| (1.0 - cover.share) * length(a.area(i));
        let lost = || cover.iter().enumerate().filter(|(_, cover)| cover.left == Left::Lost);
        let (worst, _) = lost().max_by(|p, q| lacking(p).total_cmp(&lacking(q)))?;
        let whole = a.mean_measure() * cover.len() as f64;
        let middle = interpolate(&a.facets.coordinates(worst, a.space)[..D], &[1.0 / D as f64; D]);
        Some(Self {
            pieces: lost().map(|(_, cover)| cover.lost).sum(),
            share: lost().map(|facet| lacking(&facet)).sum::<f64>() / whole,
            at: a.space.in_scene(middle),
        })
    }
}

/// Why a pair could not be made.
#[derive(Debug)]
pub enum Fault {
    /// The surfaces do not face each other anywhere.
    NoPartner,
    /// The scene's gap is not finite at a point.
    Gap([f64; 3]),
    /// The scene's law is none at a point.
    Law(Error),
}

/// From the contact points of a pair to its law.
pub type LawMaker<'a> = dyn Fn(&[[f64; 3]]) -> Result<Rc<dyn LayerLaw>> + 'a;

/// Integrals over the common pieces of two surfaces: of some nodes of side a, and the cover of the facets of which these are the first.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Integrals {
    /// Those of each node that carries a point.
    points: BTreeMap<u32, Accumulator>,
    cover: Vec<(u32, Cover)>,
}

impl Integrals {
    /// Takes those of other nodes.
    pub fn add(&mut self, mut others: Self) {
        self.points.append(&mut others.points);
        self.cover.append(&mut others.cover);
    }
}

/// Integrates over common pieces, which hold all facets at the nodes of side a that are `asked` for.
///
/// Points: the nodes of side a with the dual basis diag(int phi) M^-1 phi of each facet's covered part, of quadratic triangles
/// the mid-edges with that of the whole triangle; a facet on which that gives means that are not steady (partly covered) takes
/// the hats of its vertices.
pub fn integrate<const D: usize>(
    a: &Side<D>,
    b: &Side<D>,
    common: &Common<D>,
    asked: &dyn Fn(&u32) -> bool,
) -> Integrals {
    let mut points: BTreeMap<u32, Accumulator> = BTreeMap::new();
    let mut carriers = vec![None; a.facets.count()];
    let group = common.points.chunk_by(|p, q| p.facet_a == q.facet_a);
    for chunk in group {
        let facet = chunk[0].facet_a;
        let nodes = a.facets.facet(facet);
        let basis = PressureBasis::on(a.facets.order, nodes.len(), chunk);
        carriers[facet] = Some(basis.carriers());
        let asked: Vec<bool> = nodes.iter().map(asked).collect();
        for point in chunk {
            let phi = element::values(a.facets.order, &point.at_a);
            let psi = element::values(b.facets.order, &point.at_b);
            let others = b.facets.facet(point.facet_b);
            for (i, &node) in nodes.iter().enumerate().filter(|(i, _)| asked[*i]) {
                let mu = point.weight * basis.value(i, &phi, &point.at_a);
                if mu == 0.0 {
                    continue;
                }
                let sum = points.entry(node).or_default();
                sum.weight += mu;
                sum.gap += mu * point.gap;
                nodes.iter().zip(phi).for_each(|(&n, phi)| *sum.sides[0].entry(n).or_default() += mu * phi);
                others.iter().zip(psi).for_each(|(&n, psi)| *sum.sides[1].entry(n).or_default() += mu * psi);
            }
        }
    }
    Integrals { points, cover: Cover::of(a, common, &carriers, |facet| asked(&a.facets.facet(facet)[0])) }
}

/// Makes the arrays of a pair from the integrals over the common pieces of its surfaces.
///
/// `bodies` are the numbers of the bodies of side a and b, `gap(x)` the scene's own gap, added to the geometric one, `law` the layer at the contact points.
///
/// # Errors
/// [`Fault`] if nothing is covered, the gap is not finite, or the law is none.
pub fn assemble<const D: usize>(
    a: &Side<D>,
    b: &Side<D>,
    bodies: [usize; 2],
    integrals: Integrals,
    gap: &dyn Fn([f64; 3]) -> f64,
    law: &LawMaker,
) -> Result<ContactPair, Fault> {
    let Integrals { points, mut cover } = integrals;
    cover.sort_unstable_by_key(|entry| entry.0);
    let tiny = 1e-12 * points.values().map(|point| point.weight).fold(0.0, f64::max);
    let order = super::order::along(a, points.iter().filter(|(_, p)| p.weight > tiny).map(|(&n, _)| n));
    if order.is_empty() {
        return Err(Fault::NoPartner);
    }
    let size = (order.len() as f64 * a.mean_measure()).powf(1.0 / (D - 1) as f64);
    let mean = |sum: &Accumulator| {
        let nodes = shares(&sum.sides[0], sum.weight);
        std::array::from_fn(|c| nodes.iter().map(|&(n, share)| share * a.space.nodes[n as usize][c]).sum())
    };
    let position: Vec<[f64; 3]> = order.iter().map(|node| a.space.in_scene(mean(&points[node]))).collect();
    let law = law(&position).map_err(Fault::Law)?;
    let cover: Vec<Cover> = cover.into_iter().map(|(_, cover)| cover).collect();
    let mut pair = ContactPair {
        surfaces: [a.name.to_owned(), b.name.to_owned()],
        bodies,
        nodes: order,
        position,
        weight: Vec::new(),
        normal: Vec::new(),
        gap: Vec::new(),
        prescribed: [Vec::new(), Vec::new()],
        rows: [Csr::new(a.space.dofs()), Csr::new(b.space.dofs())],
        nodal: [Csr::new(a.space.dofs()), Csr::new(b.space.dofs())],
        resultant: [Vec::new(), Vec::new()],
        moment: [Vec::new(), Vec::new()],
        surface: [Vec::new(), Vec::new()],
        along_curve: D == 2,
        measure: if D == 2 && !a.space.axisymmetric { "length" } else { "area" },
        law,
        lost: LostPieces::of(a, &cover),
        cover,
    };
    let spread = [a.spread(), b.spread()];
    // what lies between matching surfaces is the rounding of their coordinates: that of both, along any normal
    let rounding = (1e-12 * size).max(2.0 * (D as f64).sqrt() * a.rounding());
    for q in 0..pair.nodes.len() {
        let node = pair.nodes[q];
        let sum = &points[&node];
        let normal = a.normals[&node];
        for (side, of) in [a, b].into_iter().enumerate() {
            let shares = shares(&sum.sides[side], sum.weight);
            pair.surface[side].push(OwnSurface::mean(of, &shares, &spread[side]));
            push_rows(&mut pair, side, of, shares, normal);
        }
        let distance = sum.gap / sum.weight;
        let distance = if distance.abs() < rounding { 0.0 } else { distance };
        let own = gap(pair.position[q]);
        if !own.is_finite() {
            return Err(Fault::Gap(pair.position[q]));
        }
        pair.weight.push(sum.weight);
        pair.normal.push(pad(normal));
        pair.gap.push(distance + own);
    }
    Ok(pair)
}

/// Adds what a contact point has of one side: `shares` are those of the side's nodes, `normal` points out of side a.
fn push_rows<const D: usize>(
    pair: &mut ContactPair,
    side: usize,
    of: &Side<D>,
    shares: impl IntoIterator<Item = (u32, f64)>,
    normal: [f64; D],
) {
    let sign = [1.0, -1.0][side];
    let (mut nodal, mut entries) = (Vec::new(), BTreeMap::new());
    let (mut resultant, mut moment) = ([0.0; 3], [0.0; 3]);
    for (n, share) in shares {
        let entry = normal.map(|normal| sign * share * normal);
        nodal.extend((0..D).map(|c| (D * n as usize + c, entry[c])));
        add(&mut resultant, of.space.net_force(entry));
        add(&mut moment, of.space.net_moment(n, entry));
        let (node, dofs) = of.frame.force(n, entry);
        for (c, value) in dofs.into_iter().enumerate() {
            *entries.entry(D * node as usize + c).or_insert(0.0) += value;
        }
    }
    let mut known = 0.0;
    entries.retain(|dof, entry| {
        let prescribed = of.prescribed.get(dof);
        known += prescribed.map_or(0.0, |u| *entry * u);
        prescribed.is_none()
    });
    pair.rows[side].push_row(entries);
    pair.nodal[side].push_row(nodal);
    pair.resultant[side].push(resultant);
    pair.moment[side].push(moment_in_scene(&of.space.datum, resultant, moment));
    pair.prescribed[side].push(known);
}

/// Return the moment about the origin of the scene of a force whose moment about `datum` is given.
pub fn moment_in_scene<const D: usize>(datum: &[f64; D], force: [f64; 3], moment: [f64; 3]) -> [f64; 3] {
    let arm = cross(pad(*datum), force);
    std::array::from_fn(|c| moment[c] + arm[c])
}

/// sum += v.
pub fn add(sum: &mut [f64; 3], v: [f64; 3]) {
    sum.iter_mut().zip(v).for_each(|(sum, v)| *sum += v);
}

/// A side's nodal shares of a point, which sum to one. Shares that are only noise of the mesher's coordinates go to the
/// largest one: surfaces that match to nine digits have nodal rows on both sides.
fn shares(values: &BTreeMap<u32, f64>, weight: f64) -> Vec<(u32, f64)> {
    let (mut kept, noise): (Vec<_>, Vec<_>) =
        values.iter().map(|(&node, value)| (node, value / weight)).partition(|(_, share)| share.abs() > NOISE);
    let lost: f64 = noise.iter().map(|(_, share)| share).sum();
    if let Some(largest) = kept.iter_mut().max_by(|p, q| p.1.total_cmp(&q.1)) {
        largest.1 += lost;
    }
    kept
}

/// Share of a node in a point below which it is noise.
const NOISE: f64 = 1e-9;

/// Integrals of mu_q and its products with the gap and the shape functions of either side.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Accumulator {
    weight: f64,
    gap: f64,
    sides: [BTreeMap<u32, f64>; 2],
}

impl ContactPair {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.weight.len()
    }

    /// Facets of side a without a partner.
    pub fn uncovered(&self) -> usize {
        self.cover.iter().filter(|cover| cover.carriers.is_none()).count()
    }

    /// Facets of side a that are not paired as a whole for this reason.
    pub fn left(&self, reason: Left) -> usize {
        self.cover.iter().filter(|cover| cover.left == reason).count()
    }

    /// Facets of side a that are covered in part and take the hats of their vertices.
    pub fn averaged(&self) -> usize {
        let averaged = |cover: &&Cover| cover.carriers == Some(Carriers::Vertices) && cover.left != Left::Nothing;
        self.cover.iter().filter(averaged).count()
    }

    /// Whether the pair has no points; [`assemble`] makes none such.
    pub fn is_empty(&self) -> bool {
        self.weight.is_empty()
    }
}
