//! One contact surface of a body: its facets, its nodes with their normals and curvatures, its smooth faces, and the
//! order of nodes along it.

use super::law::LawMaker;
use super::mirror::Mirrors;
use crate::error::Result;
use crate::fem::{Facets, Frame, Space, area_vector, element, length, minus, unit};
use crate::linalg::{DisjointSets, axpy, bounds, dot};
use crate::mesh::datum;
use crate::problem::order::Order;
use std::collections::{BTreeMap, HashMap, HashSet};

/// One contact surface of a body.
#[derive(Debug, Clone)]
pub struct Side<'a, const D: usize> {
    /// Name of the mesh group.
    pub name: &'a str,
    /// The body's space.
    pub space: &'a Space<D>,
    /// The facets, oriented outwards.
    pub facets: Facets<D>,
    /// Values of the prescribed dofs of the body.
    pub prescribed: &'a BTreeMap<usize, f64>,
    /// Dofs of nodes with rotated axes and of tied nodes.
    pub frame: &'a Frame<D>,
    /// Planes of symmetry at the end of the surface.
    pub mirrors: Mirrors<D>,
    /// The nodes of the surface on its smooth faces, in the order of the nodes.
    pub nodes: Vec<FaceNode<D>>,
    /// Index in `nodes` of each node of each facet, in the order of `facets.nodes`.
    pub corners: Vec<u32>,
}

/// A node of a surface on one of its smooth faces. A node at an edge occurs once for each face that meets there.
#[derive(Debug, Clone, Copy)]
pub struct FaceNode<const D: usize> {
    /// The node of the body.
    pub node: u32,
    /// Outer unit normal: the mean over the facets of the face around the node, and their mirror images.
    pub normal: [f64; D],
    /// Unit vector along which compressions are measured: the own normal, or the one made of the normals of both sides
    /// ([`Side::towards`]).
    pub direction: [f64; D],
    /// Length of the sum of the own normal and that of the other side before it, zero if they are opposite.
    pub tilt: f64,
    /// Curvature (1/length): the largest difference of two nodal normals over their distance, on the facets around.
    pub curvature: f64,
    /// Mean of (n_f - n)(n_f - n)' over the unit normals n_f of the facets around, where n is `normal`; of both sides,
    /// where `direction` is.
    pub spread: Spread<D>,
}

/// The mean of products of differences of normals: a symmetric matrix.
pub type Spread<const D: usize> = [[f64; D]; D];

/// Add `weight * v v'` to a spread.
fn add_square<const D: usize>(spread: &mut Spread<D>, weight: f64, v: [f64; D]) {
    (0..D).for_each(|i| (0..D).for_each(|j| spread[i][j] += weight * v[i] * v[j]));
}

impl<'a, const D: usize> Side<'a, D> {
    /// Compute the nodal normals and curvatures of a surface. Facets around a node that turn by no more than `edge`
    /// degrees are of one face.
    pub fn new(
        name: &'a str,
        space: &'a Space<D>,
        facets: Facets<D>,
        prescribed: &'a BTreeMap<usize, f64>,
        frame: &'a Frame<D>,
        edge: f64,
    ) -> Self {
        let mirrors = Mirrors::new(space, &facets, prescribed, frame);
        let least = edge.to_radians().cos() - ROUNDING;
        let (mut nodes, mut corners) = (Vec::new(), vec![0; facets.nodes.len()]);
        for (node, around) in areas_around(space, &facets) {
            for face in smooth(&around, least) {
                let mut normal = [0.0; D];
                for &(corner, area) in &face {
                    corners[corner] = nodes.len() as u32;
                    (0..D).for_each(|c| normal[c] += area[c]);
                }
                let normal = unit(mirrors.mean(space, node, normal, least));
                let whole: f64 = face.iter().map(|(_, area)| length(*area)).sum();
                let mut spread = [[0.0; D]; D];
                for (_, area) in face {
                    add_square(&mut spread, length(area) / whole, minus(unit(area), normal));
                }
                nodes.push(FaceNode { node, normal, direction: normal, tilt: 0.0, curvature: 0.0, spread });
            }
        }
        let mut side = Self { name, space, facets, prescribed, frame, mirrors, nodes, corners };
        side.flatten();
        side.bend();
        side.spread_within();
        side
    }

    /// Give the nodes within curved facets, which have one normal, the mean spread at the vertices: the kinks there
    /// show how far normals between them err.
    fn spread_within(&mut self) {
        let (stride, mut facets_at) = (self.facets.stride, vec![0; self.nodes.len()]);
        self.corners.iter().for_each(|&at| facets_at[at as usize] += 1);
        for i in 0..self.facets.count() {
            let on = self.corners[i * stride..(i + 1) * stride].to_vec();
            let mut mean = [[0.0; D]; D];
            for vertex in &on[..D] {
                let spread = &self.nodes[*vertex as usize].spread;
                (0..D).for_each(|c| axpy(1.0 / D as f64, &spread[c], &mut mean[c]));
            }
            on[D..]
                .iter()
                .filter(|at| facets_at[**at as usize] == 1)
                .for_each(|at| self.nodes[*at as usize].spread = mean);
        }
    }

    /// Give the nodes of each flat face one normal, where coordinates have fewer digits than doubles. A face is flat if
    /// its normals differ from their mean by no more than errors of coordinates allow for.
    fn flatten(&mut self) {
        if self.space.uncertainty == 0.0 {
            return;
        }
        let (faces, tilt) = (self.faces(), self.tilt());
        let mut sums: HashMap<u32, [f64; D]> = HashMap::new();
        for i in 0..self.facets.count() {
            let (area, sum) = (self.area(i), sums.entry(faces[self.on_facet(i)[0] as usize]).or_insert([0.0; D]));
            (0..D).for_each(|c| sum[c] += area[c]);
        }
        let mut flat: HashMap<u32, [f64; D]> = sums.into_iter().map(|(face, sum)| (face, unit(sum))).collect();
        for (at, face) in self.nodes.iter().zip(&faces) {
            if flat.get(face).is_some_and(|mean| length(minus(at.normal, *mean)) > tilt) {
                flat.remove(face);
            }
        }
        for (at, face) in self.nodes.iter_mut().zip(&faces) {
            if let Some(&mean) = flat.get(face) {
                (at.normal, at.direction) = (mean, mean);
            }
        }
    }

    /// Compute the curvature of the surface at each node.
    fn bend(&mut self) {
        let flat = self.tilt().max(ROUNDING);
        for i in 0..self.facets.count() {
            let (turns, on) = (self.turns(i), self.on_facet(i).to_vec());
            let bent = turns.into_iter().filter(|(turn, _)| *turn > flat);
            let curvature = bent.map(|(turn, over)| turn / over).fold(0.0, f64::max);
            for corner in on {
                let largest = &mut self.nodes[corner as usize].curvature;
                *largest = largest.max(curvature);
            }
        }
    }

    /// Return by how much the normal of facet `i` turns, and over which lengths: between its nodes, or on an edge of an
    /// order above two by the height above its chord, which has more digits than the tangents.
    fn turns(&self, i: usize) -> Vec<(f64, f64)> {
        let (x, on) = (self.facets.coordinates(i, self.space), self.on_facet(i));
        if self.facets.order > Order::P2 {
            let [from, to, middle] = [x[0], x[1], self.facets.point(i, self.space, &[0.5; D])];
            let (chord, along, off) = (length(minus(to, from)), unit(minus(to, from)), minus(middle, from));
            let height = length::<D>(std::array::from_fn(|c| off[c] - dot(&off, &along) * along[c]));
            return vec![(8.0 * height / chord, chord)];
        }
        let normal = |k: usize| self.nodes[on[k] as usize].normal;
        let pairs = (0..on.len()).flat_map(|k| (0..k).map(move |l| (k, l)));
        pairs.map(|(k, l)| (length(minus(normal(k), normal(l))), length(minus(x[k], x[l])))).collect()
    }

    /// Return the indices in `nodes` of the nodes of facet `i`.
    pub fn on_facet(&self, i: usize) -> &[u32] {
        &self.corners[i * self.facets.stride..(i + 1) * self.facets.stride]
    }

    /// Return the vertex of facet `i` on the axis of revolution.
    pub fn axis_of(&self, i: usize) -> Option<usize> {
        self.facets.facet(i)[..D].iter().position(|&node| self.space.on_axis(node))
    }

    /// Return the nodes of facet `i`.
    pub fn facet_nodes(&self, i: usize) -> impl Iterator<Item = &FaceNode<D>> {
        self.on_facet(i).iter().map(|&corner| &self.nodes[corner as usize])
    }

    /// Return a unit vector of the nodes at barycentric coordinates `l` of a facet, interpolated between its vertices.
    pub fn vector_at(&self, facet: usize, l: &[f64; D], of: fn(&FaceNode<D>) -> [f64; D]) -> [f64; D] {
        let mut sum = [0.0; D];
        for (at, l) in self.facet_nodes(facet).zip(l) {
            (0..D).for_each(|c| sum[c] += l * of(at)[c]);
        }
        unit(sum)
    }

    /// Return the surface of the facets that `keep` marks. Its nodes have the normals of the whole surface.
    pub fn only(&self, keep: &[bool]) -> Self {
        let kept = (0..keep.len()).filter(|&i| keep[i]).flat_map(|i| self.on_facet(i)).copied();
        Self { facets: self.facets.only(keep), corners: kept.collect(), ..self.clone() }
    }

    /// Return the face of each node in `nodes`: facets with a common node on a face are of one face.
    pub fn faces(&self) -> Vec<u32> {
        let mut joined = DisjointSets::new(self.nodes.len());
        for on in self.corners.chunks_exact(self.facets.stride) {
            on.windows(2).for_each(|ends| joined.join(ends[0], ends[1]));
        }
        joined.classes().1
    }

    /// Return the nodes of facets within which a law of the layer jumps.
    ///
    /// # Errors
    /// A law that is invalid at a point.
    pub fn layer_jumps(&self, law: &LawMaker) -> Result<HashSet<u32>> {
        let place = |at: u32| self.space.in_scene(self.space.nodes[self.nodes[at as usize].node as usize]);
        let all = law(&(0..self.nodes.len() as u32).map(place).collect::<Vec<_>>())?;
        let c = SLIGHT * self.mean_measure().powf(1.0 / (D - 1) as f64);
        let mut found = HashSet::new();
        for on in self.corners.chunks_exact(self.facets.stride) {
            for (k, &p) in on[..D].iter().enumerate() {
                for &q in on[..k].iter().filter(|q| all.pressure(p as usize, c) != all.pressure(**q as usize, c)) {
                    if has_jump([place(p), place(q)], |x| Ok(law(&[x])?.pressure(0, c)))? {
                        found.extend([p, q].map(|at| self.nodes[at as usize].node));
                    }
                }
            }
        }
        Ok(found)
    }

    /// Return the mean length (area) of a facet.
    pub fn mean_measure(&self) -> f64 {
        let total: f64 = (0..self.facets.count()).map(|i| length(self.area(i))).sum();
        total / self.facets.count().max(1) as f64
    }

    /// Return the outer normal times the length (area) at the middle of facet `i`.
    pub fn area(&self, i: usize) -> [f64; D] {
        let x = self.facets.coordinates(i, self.space);
        area_vector(self.facets.order, &x, &[1.0 / D as f64; D])
    }

    /// Return the largest error of a coordinate of the surface's nodes: that of the digits of the mesh, or rounding.
    pub fn rounding(&self) -> f64 {
        let nodes = self.facets.nodes.iter().map(|&node| &self.space.nodes[node as usize]);
        datum::rounding(&self.space.datum, nodes).max(self.space.uncertainty)
    }

    /// Return the largest angle by which errors of coordinates turn a normal.
    pub fn tilt(&self) -> f64 {
        self.facets.tilt(self.space, self.rounding())
    }

    /// Return the rounding error of a distance between this side and its partner: that of the coordinates of both
    /// sides, along any normal.
    pub fn rounding_along_normals(&self) -> f64 {
        2.0 * (D as f64).sqrt() * self.rounding()
    }

    /// Return the corners of the box around all facets.
    pub fn extent(&self) -> [[f64; D]; 2] {
        bounds(self.facets.nodes.iter().map(|&node| self.space.nodes[node as usize]))
    }

    /// Return the corners of the box around facet `i`.
    pub fn bounds(&self, i: usize) -> [[f64; D]; 2] {
        bounds(self.facets.coordinates(i, self.space))
    }
}

/// Return the facets around each node: the index of the node in `facets.nodes`, and the outer normal there times the
/// size of the facet.
fn areas_around<const D: usize>(space: &Space<D>, facets: &Facets<D>) -> BTreeMap<u32, Vec<(usize, [f64; D])>> {
    let mut around: BTreeMap<u32, Vec<(usize, [f64; D])>> = BTreeMap::new();
    let places = element::nodes::<D>(facets.order);
    for i in 0..facets.count() {
        let x = facets.coordinates(i, space);
        for (k, (l, &node)) in places.iter().zip(facets.facet(i)).enumerate() {
            around.entry(node).or_default().push((i * facets.stride + k, area_vector(facets.order, &x, l)));
        }
    }
    around
}

/// Divide the facets around a node into faces, within which neighbours turn by an angle with the cosine `least` or
/// more.
fn smooth<const D: usize>(around: &[(usize, [f64; D])], least: f64) -> Vec<Vec<(usize, [f64; D])>> {
    let normals: Vec<[f64; D]> = around.iter().map(|&(_, area)| unit(area)).collect();
    let mut joined = DisjointSets::new(around.len());
    for i in 1..around.len() {
        (0..i).filter(|&j| dot(&normals[i], &normals[j]) >= least).for_each(|j| joined.join(i as u32, j as u32));
    }
    let (count, face) = joined.classes();
    let mut faces = vec![Vec::new(); count];
    around.iter().zip(face).for_each(|(&facet, face)| faces[face as usize].push(facet));
    faces
}

/// Compression at which laws at two places are compared, as a share of the size of a facet. Laws that differ by a
/// factor differ at any compression, and the layers of the theory are thin beside facets.
const SLIGHT: f64 = 1e-3;

/// Number of halvings of a line after which the difference of a smooth function at its ends is a thousandth of what it
/// was.
const HALVINGS: usize = 10;

/// Return whether most of the difference of a function at the ends of a line is a jump: whether it stays in one half,
/// again and again.
fn has_jump(mut ends: [[f64; 3]; 2], value: impl Fn([f64; 3]) -> Result<f64>) -> Result<bool> {
    let mut values = [value(ends[0])?, value(ends[1])?];
    let whole = (values[1] - values[0]).abs();
    for _ in 0..HALVINGS {
        let middle = std::array::from_fn(|c| 0.5 * (ends[0][c] + ends[1][c]));
        let half = value(middle)?;
        let replaced = usize::from((half - values[0]).abs() > (values[1] - half).abs());
        (ends[replaced], values[replaced]) = (middle, half);
    }
    Ok((values[1] - values[0]).abs() > 0.5 * whole)
}

/// Rounding of the cosine of the angle between two facets. A facet of a millionth of its mesh has normals to 2e-10, the
/// rounding of coordinates over its size; so a regular polygon that turns by just the angle of an edge is smooth.
pub const ROUNDING: f64 = 1e-9;

/// Sort nodes of a surface for plots, given by their indices. In the plane they follow the curve, and each chain begins
/// at the end with the smaller coordinates. In space they are sorted by coordinates.
pub fn along<const D: usize>(side: &Side<D>, nodes: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut nodes: Vec<u32> = nodes.collect();
    let at = |i: u32| side.space.nodes[side.nodes[i as usize].node as usize];
    nodes.sort_by(|&i, &j| {
        let (x, y) = (at(i), at(j));
        (0..D).map(|c| x[c].total_cmp(&y[c])).find(|o| o.is_ne()).unwrap_or(i.cmp(&j))
    });
    if D != 2 {
        return nodes;
    }
    let mut neighbours: HashMap<u32, Vec<u32>> = HashMap::new();
    let mut link = |i: u32, j: u32| {
        neighbours.entry(i).or_default().push(j);
        neighbours.entry(j).or_default().push(i);
    };
    for i in 0..side.facets.count() {
        let on = side.on_facet(i);
        let chain: Vec<u32> = [&on[..1], &on[2..], &on[1..2]].concat();
        chain.windows(2).for_each(|ends| link(ends[0], ends[1]));
    }
    // the curve goes on round an edge, where a node occurs once for each face
    for (i, ends) in (0u32..).zip(side.nodes.windows(2)) {
        if ends[0].node == ends[1].node {
            link(i, i + 1);
        }
    }
    let wanted: HashSet<u32> = nodes.iter().copied().collect();
    let mut visited = HashSet::new();
    let mut order = Vec::with_capacity(nodes.len());
    // The ends of open chains come first, then the nodes of closed curves.
    let is_end = |node: &u32| neighbours.get(node).is_none_or(|n| n.len() != 2);
    let starts: Vec<u32> = nodes.iter().filter(|n| is_end(n)).chain(&nodes).copied().collect();
    for start in starts {
        let mut current = Some(start);
        while let Some(node) = current {
            if !visited.insert(node) {
                break;
            }
            if wanted.contains(&node) {
                order.push(node);
            }
            current = neighbours.get(&node).and_then(|n| n.iter().find(|n| !visited.contains(n)).copied());
        }
    }
    order
}
