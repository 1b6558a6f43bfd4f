//! One contact surface of a body: facets with averaged nodal normals, its smooth faces, and the order of nodes along it.

use crate::fem::{Facets, Frame, Space, area_vector, element, length, minus, unit};
use crate::linalg::{DisjointSets, bounds, dot};
use crate::mesh::datum;
use std::collections::{HashMap, HashSet};

/// Difference between the unit normal of a facet and the mean normal beyond which the facets form an edge.
///
/// It is half of the angle between chords that leave their arc by 3 % of its radius, the worst polygon that is taken for round.
const EDGE: f64 = 0.245;

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
    pub prescribed: &'a HashMap<usize, f64>,
    /// Dofs of nodes with rotated axes and of tied nodes.
    pub frame: &'a Frame<D>,
    /// Outer unit normal at each node of the surface: the mean over the facets around it.
    pub normals: HashMap<u32, [f64; D]>,
}

impl<'a, const D: usize> Side<'a, D> {
    /// Compute the nodal normals of a surface.
    pub fn new(
        name: &'a str,
        space: &'a Space<D>,
        facets: Facets<D>,
        prescribed: &'a HashMap<usize, f64>,
        frame: &'a Frame<D>,
    ) -> Self {
        let mut normals: HashMap<u32, [f64; D]> = HashMap::new();
        let places = element::nodes::<D>(facets.order);
        for i in 0..facets.count() {
            let x = facets.coordinates(i, space);
            for (l, &node) in places.iter().zip(facets.facet(i)) {
                let area = area_vector(facets.order, &x, l);
                let sum = normals.entry(node).or_insert([0.0; D]);
                (0..D).for_each(|c| sum[c] += area[c]);
            }
        }
        for (&node, normal) in &mut normals {
            // A surface of revolution continues beyond the axis as its mirror image.
            if space.on_axis(node) && normal[1] != 0.0 {
                normal[0] = 0.0;
            }
            *normal = unit(*normal);
        }
        Self { name, space, facets, prescribed, frame, normals }
    }

    /// Return the surface of the facets that `keep` marks, with their own normals.
    pub fn only(&self, keep: &[bool]) -> Self {
        Self::new(self.name, self.space, self.facets.only(keep), self.prescribed, self.frame)
    }

    /// Return the uncertainty of the normal near each node: the largest difference between the unit normals of facets and
    /// nodes, over all nodes that share a facet with it. Edges do not count. Where the surface is flat, the result is the
    /// rounding of the normals.
    pub fn spread(&self) -> HashMap<u32, f64> {
        let (places, rounding) = (element::nodes::<D>(self.facets.order), self.rounding());
        let mut at_node: HashMap<u32, f64> = HashMap::new();
        for i in 0..self.facets.count() {
            let x = self.facets.coordinates(i, self.space);
            for (l, node) in places.iter().zip(self.facets.facet(i)) {
                let (area, mean) = (area_vector(self.facets.order, &x, l), self.normals[node]);
                let difference = length(minus(unit(area), mean));
                let least = f64::EPSILON + 2.0 * rounding / length(area).powf(1.0 / (D - 1) as f64);
                let largest = at_node.entry(*node).or_default();
                *largest = largest.max(least).max(if difference < EDGE { difference } else { 0.0 });
            }
        }
        let mut spread: HashMap<u32, f64> = HashMap::new();
        for nodes in (0..self.facets.count()).map(|i| self.facets.facet(i)) {
            let on_facet = nodes.iter().map(|node| at_node[node]).fold(0.0, f64::max);
            for node in nodes {
                let largest = spread.entry(*node).or_default();
                *largest = largest.max(on_facet);
            }
        }
        spread
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

    /// Return the rounding error of a distance between this side and its partner: that of the coordinates of both sides, along
    /// any normal.
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

/// Rounding of the cosine of the angle between two facets. A facet of a millionth of its mesh has normals to 2e-10, the rounding of
/// coordinates over its size; so a regular polygon that turns by just the angle of an edge is smooth.
pub const ROUNDING: f64 = 1e-9;

/// The smooth faces of a surface. Facets with a common vertex at which they turn by no more than the angle of an edge are of
/// one face.
#[derive(Debug, Clone)]
pub struct SmoothFaces {
    /// Face of each facet. Faces are numbered in the order of their first facets.
    pub of_facet: Vec<usize>,
    /// Number of faces.
    pub count: usize,
}

impl SmoothFaces {
    /// Find the faces of a surface between edges at which facets turn by more than `edge` degrees.
    pub fn new<const D: usize>(side: &Side<D>, edge: f64) -> Self {
        let least = edge.to_radians().cos() - ROUNDING;
        let mut joined = DisjointSets::new(side.facets.count());
        for around in normals_at_vertices(side).values() {
            for (k, (facet, normal)) in around.iter().enumerate() {
                for (other, other_normal) in &around[..k] {
                    if dot(normal, other_normal) >= least {
                        joined.join(*facet as u32, *other as u32);
                    }
                }
            }
        }
        let (count, of_facet) = joined.classes();
        Self { count, of_facet: of_facet.into_iter().map(|face| face as usize).collect() }
    }

    /// Return whether facets of different faces have a common vertex, and so meet at an edge. Only facets in `used` count.
    pub fn meet<const D: usize>(&self, side: &Side<D>, used: &[bool]) -> bool {
        let mut face_at: HashMap<u32, usize> = HashMap::new();
        let facets = (0..side.facets.count()).filter(|&i| used[i]);
        let mut vertices = facets.flat_map(|i| side.facets.facet(i)[..D].iter().map(move |&node| (node, i)));
        vertices.any(|(node, i)| *face_at.entry(node).or_insert(self.of_facet[i]) != self.of_facet[i])
    }

    /// Return the middle of a face: the mean of the middles of its facets, weighted by their lengths (areas).
    pub fn middle<const D: usize>(&self, side: &Side<D>, face: usize) -> [f64; D] {
        let (mut sum, mut total) = ([0.0; D], 0.0);
        for i in (0..self.of_facet.len()).filter(|&i| self.of_facet[i] == face) {
            let (x, size) = (side.facets.coordinates(i, side.space), length(side.area(i)));
            (0..D).for_each(|c| sum[c] += size * x[..D].iter().map(|x| x[c]).sum::<f64>() / D as f64);
            total += size;
        }
        sum.map(|sum| sum / total)
    }
}

/// Return the facets at each vertex, with their unit normals there.
fn normals_at_vertices<const D: usize>(side: &Side<D>) -> HashMap<u32, Vec<(usize, [f64; D])>> {
    let mut around: HashMap<u32, Vec<(usize, [f64; D])>> = HashMap::new();
    let vertices = &element::nodes::<D>(side.facets.order)[..D];
    for i in 0..side.facets.count() {
        let x = side.facets.coordinates(i, side.space);
        for (l, &node) in vertices.iter().zip(side.facets.facet(i)) {
            around.entry(node).or_default().push((i, unit(area_vector(side.facets.order, &x, l))));
        }
    }
    around
}

/// Sort surface nodes for plots. In the plane they follow the curve, and each chain begins at the end with the smaller
/// coordinates. In space they are sorted by coordinates.
pub fn along<const D: usize>(side: &Side<D>, nodes: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut nodes: Vec<u32> = nodes.collect();
    let at = |node: u32| side.space.nodes[node as usize];
    nodes.sort_by(|&m, &n| {
        let (x, y) = (at(m), at(n));
        (0..D).map(|c| x[c].total_cmp(&y[c])).find(|o| o.is_ne()).unwrap_or(m.cmp(&n))
    });
    if D != 2 {
        return nodes;
    }
    let mut neighbours: HashMap<u32, Vec<u32>> = HashMap::new();
    for i in 0..side.facets.count() {
        let facet = side.facets.facet(i);
        let chain = if facet.len() == 3 { vec![facet[0], facet[2], facet[1]] } else { facet.to_vec() };
        for link in chain.windows(2) {
            neighbours.entry(link[0]).or_default().push(link[1]);
            neighbours.entry(link[1]).or_default().push(link[0]);
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
