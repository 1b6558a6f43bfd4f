//! The step from the error of each cell to the sizes of the next mesh, as a field that a mesher can follow.
//!
//! ```text
//! limit    on curved boundaries a size is at most TURN times the radius of curvature
//! join     surfaces have one size where they touch
//! grade    sizes of nodes that an edge connects differ by at most the growth of the grading times its length
//! cover    the boundary gets a layer of cells outside, as thick as facets may lie below a curved boundary
//! ```
//!
//! The field is defined on the straight cells of the old mesh. The mesher evaluates it at points of the true boundary,
//! which lies partly outside these cells. A field gives no size where it has no cell.

use super::Estimate;
use crate::contact::ContactPair;
use crate::discretize::meshes::{BodyCells, Meshes};
use crate::fem::{cross, length, minus, unit};
use crate::linalg::{dot, interpolation_weights};
use crate::model::{Layer, Model};
use rstar::RTree;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

/// Sizes of elements at the corners of the cells of all bodies.
pub struct Sizes {
    /// Number of corners of a cell.
    pub stride: usize,
    /// Coordinates of the corners of all cells.
    pub corners: Vec<[f64; 3]>,
    /// Requested size at each corner.
    pub sizes: Vec<f64>,
    /// Approximate number of cells of a mesh with these sizes.
    pub cells: f64,
    /// Places where boundaries get vertices, since the solution is not smooth there.
    pub vertices: Vec<[f64; 3]>,
}

/// How much the sizes of the cells of a body may differ from those of the mesh before, and from each other.
#[derive(Debug)]
struct Grading {
    /// Smallest and largest ratio of a new size to the old one.
    range: [f64; 2],
    /// Largest growth of the size along a length. Neighbouring cells then differ by a factor of about 1 + growth.
    growth: f64,
    /// Whether most of the error is in few cells at singular places.
    is_steep: bool,
}

/// The grading of orders one and two. Errors of a mesh predict those of cells a few times smaller, but not of cells an
/// order of magnitude smaller. With 0.08 instead of 0.25, `groove-held` to 1e-3 and `hertz-sphere` to 2e-2 took the
/// same number of meshes, the last ones of the same size within 7 %. With a growth of 1 and 2 these had the same size
/// within 5 %; with 0.5 the worst cells of the meshes of both flanges are as good as those of the scripts' own meshes
/// (mean ratio 0.31 to 0.38 at least).
const EVEN: Grading = Grading { range: [0.25, 2.0], growth: 0.5, is_steep: false };

/// The grading of orders above two, whose cells far from singular places become larger while the others become smaller.
/// With 0.15 and 0.35 instead of 0.25, adaptations of `groove-held` to 1e-6 with orders 4 and 6 take 1.24 and 1.17
/// times the dofs, all meshes together. Between the distances r and e r from a point there are about 2 pi/g^2 cells of
/// the size g r: a growth g of 1 takes a quarter of the cells that one of 0.5 takes.
const STEEP: Grading = Grading { range: [0.25, 4.0], growth: 1.0, is_steep: true };

/// Return the grading of a body.
fn grading(meshes: &Meshes, body: usize) -> &'static Grading {
    if meshes.degree(body) > 2 { &STEEP } else { &EVEN }
}

/// The requirements on the next mesh.
#[derive(Debug, Clone, Copy)]
pub struct Aim {
    /// Share of the squared energy error that may remain.
    pub share: f64,
    /// Smallest number of cells, as a multiple of that of the present mesh.
    pub more: f64,
    /// Largest number of cells. It has priority over the other two.
    pub most: f64,
}

/// Return the sizes of the mesh with the fewest cells that meets an aim. Collective.
///
/// Let p be the rate of a cell, which is the degree of its elements where the solution is smooth, and D the dimension.
/// With h -> s h the squared error eta^2 of a cell becomes s^(2p) eta^2, and s^-D cells take its place. The number of
/// cells is least where s^(2p + D) eta^2 is the same everywhere. Every cell of the new mesh then has nearly the same
/// error.
pub fn wanted(meshes: &Meshes, model: &Model, layer: &Layer, estimate: &Estimate, aim: Aim) -> Sizes {
    let Aim { share, more, most } = aim;
    let bodies = model.meshed();
    let counts = counts(meshes, bodies);
    // Every rank has the meshes, and only the owner rank of a body has its errors.
    let of_all = |of_bodies: &[Vec<f64>]| {
        let (mut all, mut first) = (vec![0.0; counts.iter().sum()], 0);
        for (of_body, count) in of_bodies.iter().zip(&counts) {
            all[first..first + of_body.len()].copy_from_slice(of_body);
            first += count;
        }
        model.exchange.sum(&mut all);
        all
    };
    let errors = of_all(&estimate.cells);
    let dimension = meshes.cells(0).stride as f64 - 1.0;
    let gradings = (0..bodies).flat_map(|body| std::iter::repeat_n(grading(meshes, body), counts[body]));
    let known = errors.iter().zip(of_all(&estimate.rates)).zip(gradings.zip(distances(meshes, model)));
    let all: Vec<CellError> = known
        .map(|((&squared, rate), (grading, distance))| CellError { squared, rate, grading }.of_contact(distance))
        .collect();
    let errors: Vec<f64> = all.iter().map(|cell| cell.squared).collect();
    let goal = share * errors.iter().sum::<f64>();
    let left = |level: f64| -> f64 { all.iter().map(|cell| cell.left(cell.ratio(level, dimension))).sum() };
    let cells = |level: f64| -> f64 { all.iter().map(|cell| cell.ratio(level, dimension).powf(-dimension)).sum() };
    // Remaining error and cell sizes increase with the level, so its logarithm is bisected.
    let largest = errors.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let (mut low, mut high) = (largest.ln() - 100.0, largest.ln() + 10.0);
    for _ in 0..60 {
        let middle: f64 = 0.5 * (low + high);
        let is_enough = left(middle.exp()) <= goal && cells(middle.exp()) >= more * all.len() as f64;
        if is_enough || cells(middle.exp()) > most {
            low = middle;
        } else {
            high = middle;
        }
    }
    let level = low.exp();
    let size = |cell: usize, size: f64| size * all[cell].ratio(level, dimension);
    let sizes = gather(meshes, &counts, &touching(meshes, model, layer), size).within(most);
    Sizes { vertices: singular_places(meshes, model, layer), ..sizes }
}

/// Return where contacts end and gaps have kinks on edges of order three or more, whose polynomials converge fast only
/// beside these places.
fn singular_places(meshes: &Meshes, model: &Model, layer: &Layer) -> Vec<[f64; 3]> {
    let mut places = Vec::new();
    for (index, pair) in model.pairs.iter().enumerate() {
        let points = meshes.points(index);
        places.extend(&points.kinks);
        let (body, compression) = (pair.bodies[0], &layer.compression[model.range(index)]);
        if pair.law.is_bonded() || !grading(meshes, body).is_steep {
            continue;
        }
        let nodes = meshes.cells(body).nodes;
        let mut first = 0;
        for facet in points.each.chunk_by(|p, q| p.facet == q.facet) {
            let at: Vec<f64> = facet.iter().map(|point| point.along).collect();
            let values: Vec<f64> = (first..first + facet.len())
                .map(|g| points.interpolation.row(g).map(|(q, shape)| shape * compression[q]).sum())
                .collect();
            let ends = meshes.vertices(index, 0, first);
            if let (Some(along), [a, b]) = (zero_between(&at, &values), &ends[..]) {
                places.push(std::array::from_fn(|c| {
                    along * nodes[a.0 as usize][c] + (1.0 - along) * nodes[b.0 as usize][c]
                }));
            }
            first += facet.len();
        }
    }
    places
}

/// Return where on \[0, 1\] the polynomial through values at some points changes its sign, if it does, by bisection.
fn zero_between(at: &[f64], values: &[f64]) -> Option<f64> {
    let polynomial =
        |x: f64| -> f64 { interpolation_weights(at, x).zip(values).map(|(weight, value)| weight * value).sum() };
    let mut sorted: Vec<f64> = at.iter().copied().chain([0.0, 1.0]).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let is_open = |x: f64| polynomial(x) <= 0.0;
    let mut ends = sorted.windows(2).map(|ends| [ends[0], ends[1]]);
    let [mut low, mut high] = ends.find(|&[p, q]| is_open(p) != is_open(q))?;
    let open_below = is_open(low);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        *(if is_open(middle) == open_below { &mut low } else { &mut high }) = middle;
    }
    Some(0.5 * (low + high))
}

/// Return the distance of each cell from the contact points of its body, as a multiple of its size.
fn distances(meshes: &Meshes, model: &Model) -> Vec<f64> {
    let mut all = Vec::new();
    for body in 0..model.meshed() {
        let cells = meshes.cells(body);
        if !grading(meshes, body).is_steep {
            all.extend(cells.sizes.iter().map(|_| 0.0));
            continue;
        }
        let pairs = model.pairs.iter().filter(|pair| pair.bodies.contains(&body));
        let points = RTree::bulk_load(pairs.flat_map(|pair| &pair.position).copied().collect());
        for (corners, size) in cells.corners.chunks_exact(cells.stride).zip(&cells.sizes) {
            let mean = |c: usize| corners.iter().map(|&node| cells.nodes[node as usize][c]).sum::<f64>();
            let centre: [f64; 3] = std::array::from_fn(|c| mean(c) / cells.stride as f64);
            let nearest = points.nearest_neighbor(centre);
            all.push(nearest.map_or(f64::INFINITY, |point| length(minus(*point, centre)) / size));
        }
    }
    all
}

/// The error of a cell of the present mesh.
struct CellError {
    /// Squared energy error.
    squared: f64,
    /// Power of the size with which its root falls.
    rate: f64,
    grading: &'static Grading,
}

impl CellError {
    /// Return the part of the error in pressures and displacements of the contact, whose `distance` is in sizes of the
    /// cell.
    ///
    /// A cell of size h changes these by a(e, z - I z), where z is the response to a load on the contact. At the
    /// distance r from it z changes over lengths of r, so that the error z - I z of its interpolant is less by (h/r)^p
    /// than beside the contact. For order two and less the whole error counts.
    fn of_contact(self, distance: f64) -> Self {
        if !self.grading.is_steep || distance <= 1.0 {
            return self;
        }
        Self { squared: self.squared * distance.powf(-2.0 * self.rate), rate: 2.0 * self.rate, ..self }
    }

    /// Return the ratio of the new size to the old one for which s^-D new cells have the error `level` together.
    fn ratio(&self, level: f64, dimension: f64) -> f64 {
        let free = (level / self.squared.max(f64::MIN_POSITIVE)).powf(1.0 / (2.0 * self.rate + dimension));
        let [least, most] = self.grading.range;
        free.clamp(least, most)
    }

    /// Return the squared error that remains with a ratio of sizes. Elements of high order leave most of their error in
    /// the few cells at singular places, which the smallest ratio does not bring down to that of the others: the next
    /// meshes do, and smooth cells are not to make up for it.
    fn left(&self, ratio: f64) -> f64 {
        if self.grading.is_steep && ratio <= self.grading.range[0] {
            0.0
        } else {
            self.squared * ratio.powf(2.0 * self.rate)
        }
    }
}

/// Return the sizes of the meshes, but none below a smallest size. With this size everywhere the bodies together would
/// have about this number of `cells`.
pub fn coarse(meshes: &Meshes, bodies: usize, cells: usize) -> Sizes {
    let power = meshes.cells(0).stride as f64 - 1.0;
    let volume: f64 = (0..bodies).flat_map(|body| meshes.cells(body).sizes).map(|size| size.powf(power)).sum::<f64>();
    let least = (volume / cells as f64).powf(1.0 / power);
    gather(meshes, &counts(meshes, bodies), &[], |_, size| size.max(least))
}

/// Return the number of cells of each body.
fn counts(meshes: &Meshes, bodies: usize) -> Vec<usize> {
    (0..bodies).map(|body| meshes.cells(body).sizes.len()).collect()
}

/// A point where two surfaces touch.
struct Touching {
    bodies: [usize; 2],
    /// Vertices of the facet of each surface there, with the barycentric coordinates of the point.
    vertices: [Vec<(u32, f64)>; 2],
}

/// Return the integration points of all pairs that are under pressure.
fn touching(meshes: &Meshes, model: &Model, layer: &Layer) -> Vec<Touching> {
    let mut all = Vec::new();
    let is_meshed = |pair: &ContactPair| !model.bodies[pair.bodies[1]].is_rigid;
    for (index, pair) in model.pairs.iter().enumerate().filter(|(_, pair)| is_meshed(pair)) {
        let (points, pressure) = (meshes.points(index), &layer.pressure[model.range(index)]);
        for g in 0..points.each.len() {
            if points.interpolation.row(g).any(|(q, _)| pressure[q] != 0.0) {
                let vertices = [0, 1].map(|side| meshes.vertices(index, side, g));
                all.push(Touching { bodies: pair.bodies, vertices });
            }
        }
    }
    all
}

/// Give surfaces the smaller of their two sizes where they touch.
///
/// A stiff body has hardly any error of its own. Its coarse facets would still make the gap of the surface, and the
/// means over them, inexact for a soft partner.
fn join(bodies: &[BodyCells], sizes: &mut [Vec<f64>], touching: &[Touching]) {
    let size = |point: &Touching, side: usize| -> f64 {
        point.vertices[side].iter().map(|&(node, l)| l * sizes[point.bodies[side]][node as usize]).sum()
    };
    let smaller: Vec<f64> = touching.iter().map(|point| size(point, 0).min(size(point, 1))).collect();
    for (point, smaller) in touching.iter().zip(smaller) {
        for (&body, vertices) in point.bodies.iter().zip(&point.vertices) {
            let nodes = &bodies[body].nodes;
            let at: [f64; 3] =
                std::array::from_fn(|c| vertices.iter().map(|&(node, l)| l * nodes[node as usize][c]).sum());
            for &(node, _) in vertices {
                let most = smaller + EVEN.growth * length(minus(nodes[node as usize], at));
                let size = &mut sizes[body][node as usize];
                *size = size.min(most);
            }
        }
    }
}

/// The geometric mean of the sizes of the cells around a corner.
#[derive(Clone, Default)]
struct MeanSize {
    logs: f64,
    count: f64,
}

impl MeanSize {
    fn add(&mut self, size: f64) {
        self.logs += size.ln();
        self.count += 1.0;
    }

    fn value(&self) -> f64 {
        (self.logs / self.count).exp()
    }
}

/// Return the field of the sizes that `wanted` returns for each cell. Its arguments are the index of the cell, counted
/// over all bodies, and the present size of the cell. Surfaces get one size at the points where they are `touching`.
fn gather(meshes: &Meshes, counts: &[usize], touching: &[Touching], wanted: impl Fn(usize, f64) -> f64) -> Sizes {
    let bodies: Vec<BodyCells> = (0..counts.len()).map(|body| meshes.cells(body)).collect();
    let (mut first, mut sizes) = (0, Vec::new());
    for (body, (of_body, &count)) in bodies.iter().zip(counts).enumerate() {
        let mut of_nodes = vec![MeanSize::default(); of_body.nodes.len()];
        for (index, corners) in of_body.corners.chunks_exact(of_body.stride).enumerate() {
            let size = wanted(first + index, of_body.sizes[index]);
            corners.iter().for_each(|&node| of_nodes[node as usize].add(size));
        }
        let grading = grading(meshes, body);
        let mut of_nodes: Vec<f64> = of_nodes.iter().map(MeanSize::value).collect();
        smooth(of_body, &mut of_nodes, grading.growth);
        sizes.push(of_nodes);
        first += count;
    }
    join(&bodies, &mut sizes, touching);
    let mut field =
        Sizes { stride: bodies[0].stride, corners: Vec::new(), sizes: Vec::new(), cells: 0.0, vertices: Vec::new() };
    for (body, (of_body, sizes)) in bodies.iter().zip(&mut sizes).enumerate() {
        grade(of_body, sizes, grading(meshes, body).growth);
        for (corners, old) in of_body.corners.chunks_exact(of_body.stride).zip(&of_body.sizes) {
            let power = of_body.stride as f64 - 1.0;
            let share = |&node: &u32| (old / sizes[node as usize]).powf(power) / of_body.stride as f64;
            field.cells += corners.iter().map(share).sum::<f64>();
        }
        let (corners, sizes) = simplices(of_body, sizes);
        field.corners.extend(corners);
        field.sizes.extend(sizes);
    }
    field
}

impl Sizes {
    /// Reduce all sizes, so that a mesh has `more` times as many cells.
    pub fn refine(&mut self, more: f64) {
        let factor = more.powf(-1.0 / (self.stride as f64 - 1.0));
        self.sizes.iter_mut().for_each(|size| *size *= factor);
        self.cells *= more;
    }

    /// Return the same field, or one with larger sizes if a mesh would have more than `most` cells.
    fn within(mut self, most: f64) -> Self {
        if self.cells > most {
            self.refine(most / self.cells);
        }
        self
    }
}

/// Largest angle in radians between neighbouring facets of a smooth boundary. It belongs to 12 facets on a circle,
/// whose chords miss 1 % of its area. Gmsh's manual uses as many for `Mesh.MeshSizeFromCurvature`. In its place, that
/// option takes Gmsh 4.8 so long on curves with a field that `hertz-sphere/axisymmetric` to 1e-2 takes 74 s for 1.6.
const TURN: f64 = std::f64::consts::PI / 6.0;

/// Angle in radians, 60 degrees, above which neighbouring facets meet at an edge of the part. The facets of a circle of
/// six chords differ by this angle. Gmsh divides a circle into seven or more by default (`Mesh.MinimumCirclePoints`).
const EDGE: f64 = std::f64::consts::FRAC_PI_3;

/// Limit the sizes at the nodes of a body, one for each node, and grade them.
fn smooth(cells: &BodyCells, sizes: &mut [f64], growth: f64) {
    for (node, limit) in limits(cells) {
        sizes[node as usize] = sizes[node as usize].min(limit);
    }
    grade(cells, sizes, growth);
}

/// Return the corners and sizes of the simplices of the field, which are the cells and the layer outside.
fn simplices(cells: &BodyCells, sizes: &[f64]) -> (Vec<[f64; 3]>, Vec<f64>) {
    let own = cells.corners.iter().map(|&node| (cells.nodes[node as usize], sizes[node as usize]));
    own.chain(layer(cells, sizes)).unzip()
}

/// Two facets of the boundary with a common edge, in the plane with a common node.
struct FacetPair {
    facets: [usize; 2],
    /// Angle between the normals, in radians.
    turn: f64,
    /// Curvature across the edge: the angle over the mean height of the facets above it.
    curvature: f64,
    /// Area (length) to which this curvature applies.
    weight: f64,
}

/// Return all pairs of neighbouring facets, and the outer unit normals of all facets.
fn pairs(cells: &BodyCells) -> (Vec<FacetPair>, Vec<[f64; 3]>) {
    let dimension = cells.stride - 1;
    let normals: Vec<[f64; 3]> = cells.facets.chunks_exact(dimension).map(|facet| normal(cells, facet)).collect();
    let mut first: HashMap<Vec<u32>, usize> = HashMap::new();
    let mut pairs = Vec::new();
    for (index, facet) in cells.facets.chunks_exact(dimension).enumerate() {
        for &apex in facet {
            let mut edge: Vec<u32> = facet.iter().copied().filter(|&node| node != apex).collect();
            edge.sort_unstable();
            let Some(other) = first.remove(&edge) else {
                first.insert(edge, index);
                continue;
            };
            let opposite = cells.facets[other * dimension..][..dimension].iter().find(|node| !edge.contains(node));
            let heights = [Some(&apex), opposite].into_iter().flatten().map(|&node| height(cells, &edge, node));
            let height = 0.5 * heights.sum::<f64>();
            let turn = dot(&normals[index], &normals[other]).clamp(-1.0, 1.0).acos();
            let along = if dimension == 3 { distance(cells, edge[0], edge[1]) } else { 1.0 };
            pairs.push(FacetPair { facets: [index, other], turn, curvature: turn / height, weight: along * height });
        }
    }
    (pairs, normals)
}

/// Return the limits of the sizes at nodes of curved boundaries.
///
/// The mean square of the curvatures across the edges of a facet is 3/8 of the squared curvature of a cylinder, and all
/// of that of a sphere. With twice the mean square, both curvatures are met within a fifth.
fn limits(cells: &BodyCells) -> Vec<(u32, f64)> {
    let dimension = cells.stride - 1;
    let mut sums = vec![[0.0; 2]; cells.facets.len() / dimension];
    for pair in pairs(cells).0.iter().filter(|pair| pair.turn < EDGE && pair.weight > 0.0) {
        for facet in pair.facets {
            sums[facet][0] += pair.weight * pair.curvature.powi(2);
            sums[facet][1] += pair.weight;
        }
    }
    let share = if dimension == 3 { 2.0 } else { 1.0 };
    let mut limits = Vec::new();
    for (facet, [squares, weight]) in cells.facets.chunks_exact(dimension).zip(sums) {
        let curvature = (share * squares / weight).sqrt();
        let limit = TURN / curvature;
        if limit.is_finite() {
            limits.extend(facet.iter().map(|&node| (node, limit)));
        }
    }
    limits
}

/// Reduce the sizes to the largest ones whose differences along edges are at most `growth` times the length. This is
/// Dijkstra's algorithm from the smallest size.
fn grade(cells: &BodyCells, sizes: &mut [f64], growth: f64) {
    let mut beside: Vec<Vec<u32>> = vec![Vec::new(); cells.nodes.len()];
    for cell in cells.corners.chunks_exact(cells.stride) {
        for &node in cell {
            beside[node as usize].extend(cell.iter().filter(|&&other| other != node));
        }
    }
    let corners = (0..).zip(&beside).filter(|(_, beside)| !beside.is_empty());
    // Positive numbers have the order of their bits.
    let front = |size: f64, node: u32| Reverse((size.to_bits(), node));
    let mut fronts: BinaryHeap<_> = corners.map(|(node, _)| front(sizes[node as usize], node)).collect();
    while let Some(Reverse((bits, node))) = fronts.pop() {
        let size = f64::from_bits(bits);
        if size > sizes[node as usize] {
            continue;
        }
        for &other in &beside[node as usize] {
            let most = size + growth * distance(cells, node, other);
            if most < sizes[other as usize] {
                sizes[other as usize] = most;
                fronts.push(front(most, other));
            }
        }
    }
}

/// Return the corners of the simplices outside of facets on a curved boundary, with their sizes.
///
/// Let h be the length of a chord, t the angle by which neighbouring facets turn, and R the radius of a sphere. A chord
/// lies h t/8 below the boundary. The centre of a triangle with edges h on the sphere lies h^2/(6 R) = 0.29 h t below
/// it, where t = h/(sqrt(3) R). The layer is h t/2 thick, since nodes beside an edge of the part move out at 45
/// degrees. Gmsh 4.8 cannot take the size of the closest node of a view (`UseClosest`), which would need no layer.
fn layer(cells: &BodyCells, sizes: &[f64]) -> Vec<([f64; 3], f64)> {
    let dimension = cells.stride - 1;
    let (pairs, normals) = pairs(cells);
    let mut turn = vec![0.0f64; normals.len()];
    for pair in pairs.iter().filter(|pair| pair.turn < EDGE) {
        pair.facets.iter().for_each(|&facet| turn[facet] = turn[facet].max(pair.turn));
    }
    // These are the outward direction and the thickness at each node.
    let mut out = vec![([0.0; 3], 0.0f64); cells.nodes.len()];
    for ((facet, normal), turn) in cells.facets.chunks_exact(dimension).zip(&normals).zip(&turn) {
        let longest = facet.iter().map(|&node| distance(cells, facet[0], node)).fold(0.0, f64::max);
        for &node in facet {
            let (sum, thickness) = &mut out[node as usize];
            (0..3).for_each(|c| sum[c] += normal[c]);
            *thickness = thickness.max(0.5 * longest * turn);
        }
    }
    let lifted = |node: u32| -> [f64; 3] {
        let (sum, thickness) = out[node as usize];
        let size = length(sum);
        let along = if size > 0.0 { thickness / size } else { 0.0 };
        std::array::from_fn(|c| cells.nodes[node as usize][c] + along * sum[c])
    };
    let mut simplices = Vec::new();
    for (facet, _) in cells.facets.chunks_exact(dimension).zip(&turn).filter(|(_, turn)| **turn > FLAT) {
        let mut nodes = facet.to_vec();
        nodes.sort_unstable();
        let prism: Vec<_> = nodes.iter().map(|&node| (cells.nodes[node as usize], sizes[node as usize])).collect();
        let roof: Vec<_> = nodes.iter().map(|&node| (lifted(node), sizes[node as usize])).collect();
        // The prism between floor and roof is divided into simplices. Each has the floor up to one node and the roof
        // from this node on.
        for at in 0..dimension {
            simplices.extend_from_slice(&prism[..=at]);
            simplices.extend_from_slice(&roof[at..]);
        }
    }
    simplices
}

/// Angle in radians up to which neighbouring facets belong to a plane. Rounding of coordinates turns facets of a plane
/// by 1e-12 at most. A circle of 10^6 facets turns by 6e-6.
const FLAT: f64 = 1e-6;

/// Return the outer unit normal of a facet from its corners, whose order gives the orientation.
fn normal(cells: &BodyCells, facet: &[u32]) -> [f64; 3] {
    let arm = |k: usize| -> [f64; 3] { difference(cells, facet[k], facet[0]) };
    let across = match facet.len() {
        2 => {
            let along = arm(1);
            [along[1], -along[0], 0.0]
        }
        _ => cross(arm(1), arm(2)),
    };
    unit(across)
}

/// Return the height of a node above the line of an edge, in the plane its distance from the node.
fn height(cells: &BodyCells, edge: &[u32], node: u32) -> f64 {
    let from = difference(cells, node, edge[0]);
    if edge.len() == 1 {
        return length(from);
    }
    let along = difference(cells, edge[1], edge[0]);
    let area = cross(along, from);
    (dot(&area, &area) / dot(&along, &along)).sqrt()
}

fn difference(cells: &BodyCells, a: u32, b: u32) -> [f64; 3] {
    minus(cells.nodes[a as usize], cells.nodes[b as usize])
}

fn distance(cells: &BodyCells, a: u32, b: u32) -> f64 {
    length(difference(cells, a, b))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Return triangles of size one from the centre to the chords of a circle of radius 2.
    fn disc(chords: u32) -> BodyCells {
        let angle = |k: u32| std::f64::consts::TAU * f64::from(k) / f64::from(chords);
        let mut nodes = vec![[0.0; 3]];
        nodes.extend((0..chords).map(|k| [2.0 * angle(k).cos(), 2.0 * angle(k).sin(), 0.0]));
        let chord = |k: u32| [1 + k, 1 + (k + 1) % chords];
        let corners = (0..chords).flat_map(|k| [0, chord(k)[0], chord(k)[1]]).collect();
        let facets = (0..chords).flat_map(chord).collect();
        BodyCells { nodes, stride: 3, corners, facets, sizes: vec![1.0; chords as usize] }
    }

    /// Return the faces of an octahedron, each in 16 parts, moved onto the sphere of radius 2, with cells to the
    /// centre.
    fn ball() -> BodyCells {
        let (mut nodes, mut facets) = (vec![[0.0; 3]], Vec::new());
        let mut number = HashMap::new();
        for octant in 0..8u32 {
            let sign: [f64; 3] = std::array::from_fn(|c| if octant >> c & 1 == 0 { 1.0 } else { -1.0 });
            let mut node = |i: i32, j: i32| {
                let x = [i, j, 4 - i - j].map(f64::from);
                let size = dot(&x, &x).sqrt();
                let at: [f64; 3] = std::array::from_fn(|c| 2.0 * sign[c] * x[c] / size);
                *number.entry(at.map(|x| (x * 1e6).round() as i64)).or_insert_with(|| {
                    nodes.push(at);
                    nodes.len() as u32 - 1
                })
            };
            let mut add = |mut facet: [u32; 3]| {
                if sign.iter().product::<f64>() < 0.0 {
                    facet.swap(0, 1);
                }
                facets.extend(facet);
            };
            for i in 0..4 {
                for j in 0..4 - i {
                    add([node(i, j), node(i + 1, j), node(i, j + 1)]);
                    if i + j < 3 {
                        add([node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)]);
                    }
                }
            }
        }
        let corners: Vec<u32> = facets.chunks_exact(3).flat_map(|facet| [&[0], facet].concat()).collect();
        let sizes = vec![1.0; facets.len() / 3];
        BodyCells { nodes, stride: 4, corners, facets, sizes }
    }

    #[test]
    fn sizes_on_curved_boundaries_are_a_twelfth_of_the_circle() {
        for cells in [disc(24), ball()] {
            let mut sizes = vec![100.0; cells.nodes.len()];
            smooth(&cells, &mut sizes, EVEN.growth);
            let most = TURN * 2.0;
            assert!(sizes[1..].iter().all(|size| (0.66..=1.1).contains(&(size / most))), "{sizes:?} {most}");
            // From there on the size grows towards the centre.
            let least = sizes[1..].iter().copied().fold(f64::INFINITY, f64::min);
            assert!(sizes[0] <= least + EVEN.growth * 2.0 + 1e-12 && sizes[0] > most);
        }
        // Four chords are a square and not a circle.
        let square = disc(4);
        let mut sizes = vec![100.0; square.nodes.len()];
        smooth(&square, &mut sizes, EVEN.growth);
        assert_eq!(sizes, [100.0; 5]);
    }

    #[test]
    fn a_small_size_grows_by_half_of_the_way() {
        let cells = disc(4);
        let mut sizes = vec![100.0, 1.0, 100.0, 100.0, 100.0];
        smooth(&cells, &mut sizes, EVEN.growth);
        let side = 8f64.sqrt();
        let expected = [2.0, 1.0, 1.0 + 0.5 * side, 3.0, 1.0 + 0.5 * side];
        assert!(sizes.iter().zip(expected).all(|(size, expected)| (size - expected).abs() < 1e-12), "{sizes:?}");
    }

    /// Return whether a simplex of the field contains the point.
    fn covers(corners: &[[f64; 3]], stride: usize, at: [f64; 3]) -> bool {
        let inside = |x: &[[f64; 3]]| {
            let arm = |k: usize| -> [f64; 3] { std::array::from_fn(|c| x[k][c] - x[0][c]) };
            let rows = nalgebra::DMatrix::from_fn(stride - 1, stride - 1, |c, k| arm(k + 1)[c]);
            let from = nalgebra::DVector::from_fn(stride - 1, |c, _| at[c] - x[0][c]);
            let l = rows.lu().solve(&from);
            l.is_some_and(|l| l.iter().all(|&l| l > -1e-9) && l.sum() < 1.0 + 1e-9)
        };
        corners.chunks_exact(stride).any(inside)
    }

    /// Points of the circle and the sphere that the chords miss have a size.
    #[test]
    fn the_layer_covers_the_curved_boundary() {
        for cells in [disc(12), ball()] {
            let sizes = vec![1.0; cells.nodes.len()];
            let (corners, of_field) = simplices(&cells, &sizes);
            assert_eq!(corners.len(), of_field.len());
            for facet in cells.facets.chunks_exact(cells.stride - 1) {
                let mut at = [0.0; 3];
                facet.iter().for_each(|&node| (0..3).for_each(|c| at[c] += cells.nodes[node as usize][c]));
                let size = dot(&at, &at).sqrt();
                let at = at.map(|x| 2.0 * x / size);
                assert!(covers(&corners, cells.stride, at), "{at:?}");
                let own: Vec<_> = cells.corners.iter().map(|&node| cells.nodes[node as usize]).collect();
                assert!(!covers(&own, cells.stride, at), "{at:?}");
            }
        }
    }
}
