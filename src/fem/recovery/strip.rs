//! The strip of a body between straight facets and the smooth boundary through their vertices.
//!
//! Over a straight facet the boundary rises by delta = sum r_ij l_i l_j, with one rise r_ij for each edge and
//! barycentric coordinates l_i. It is the surface of second degree through the vertices of the facet that is nearest to
//! the vertices of the facets around it. Facets that meet at a corner have no influence on each other.

use super::Recovery;
use crate::fem::space::component;
use crate::fem::{EDGES, Facets, Space, area_vector, element, length, minus};
use crate::linalg::dot;
use crate::problem::order::Order;
use nalgebra::{Matrix3, Vector3};

/// Cosine of the angle, 40 degrees, at which facets meet in a corner. Gmsh uses the same angle where it makes surfaces
/// of triangles (its tutorial t13). A circle of nine edges is still smooth.
const CORNER: f64 = 0.766;

/// Smallest explained share of the sum of squared curvatures, which are heights of the vertices around a facet over
/// squared distances. It is what a surface of second degree explains. On cylinders and spheres the rest is at most
/// 0.02, with 38 degrees per facet. Beside the edge of a roof it is at least 0.23 in space and half in the plane.
const EXPLAINED: f64 = 0.9;

/// Straight facets with the rise of the boundary over their edges, in the order of [`EDGES`], positive outwards.
struct Strip<const D: usize> {
    facets: Facets<D>,
    /// Cell that each facet bounds.
    cells: Vec<usize>,
    rise: Vec<Vector3<f64>>,
}

impl<const D: usize> Strip<D> {
    fn of(space: &Space<D>) -> Self {
        let places = space.lone_facets();
        let all = space.facets_of(places.iter().copied());
        let straight = |i: &usize| element::is_straight(space.order, &all.coordinates(*i, space), D);
        // Quadratic facets represent the boundary of the mesh. If one is curved, the straight ones are exact, too.
        let is_known = space.order > Order::P1 && !(0..all.count()).all(|i| straight(&i));
        let inside = |i: usize| all.facet(i)[..D].iter().all(|&node| space.on_axis(node));
        let around = Around::new(space, &all);
        let rises: Vec<_> =
            (0..all.count()).map(|i| if is_known || inside(i) { None } else { around.rise(i) }).collect();
        let keep: Vec<bool> = rises.iter().map(Option::is_some).collect();
        let cells = places.iter().zip(&keep).filter(|(_, is_kept)| **is_kept).map(|((cell, _), _)| *cell).collect();
        Self { facets: all.only(&keep), cells, rise: rises.into_iter().flatten().collect() }
    }
}

/// Neighbouring facets.
struct Around<'a, const D: usize> {
    space: &'a Space<D>,
    facets: &'a Facets<D>,
    normal: Vec<[f64; D]>,
    /// Facets beside each one that continue it smoothly beyond an edge (in the plane: an end).
    beside: Vec<Vec<usize>>,
}

impl<'a, const D: usize> Around<'a, D> {
    fn new(space: &'a Space<D>, facets: &'a Facets<D>) -> Self {
        let normal: Vec<[f64; D]> = facets.normals(space).into_iter().step_by(D).collect();
        let mut beside = vec![Vec::new(); facets.count()];
        for around in facets.by_edge().into_values() {
            for pair in around.windows(2) {
                let (i, j) = (pair[0], pair[1]);
                if dot(&normal[i], &normal[j]) >= CORNER {
                    beside[i].push(j);
                    beside[j].push(i);
                }
            }
        }
        Self { space, facets, normal, beside }
    }

    fn vertices(&self, i: usize) -> &[u32] {
        &self.facets.facet(i)[..D]
    }

    /// Return the vertices of the facets that touch facet `i` and continue it smoothly.
    fn ring(&self, i: usize) -> Vec<[f64; D]> {
        let own = self.vertices(i);
        let (mut found, mut nodes, mut next) = (vec![i], Vec::<u32>::new(), 0);
        while next < found.len() {
            for &other in &self.beside[found[next]] {
                if !found.contains(&other) && self.vertices(other).iter().any(|node| own.contains(node)) {
                    found.push(other);
                    nodes.extend(self.vertices(other).iter().filter(|node| !own.contains(node)));
                }
            }
            next += 1;
        }
        nodes.sort_unstable();
        nodes.dedup();
        let mut ring: Vec<[f64; D]> = nodes.into_iter().map(|node| self.space.nodes[node as usize]).collect();
        // Beyond the axis, a body of revolution continues as its mirror image.
        let mirrored = |n: &[f64; D]| n[1] * n[1] - n[0] * n[0] >= CORNER;
        if own.iter().any(|&node| self.space.on_axis(node)) && mirrored(&self.normal[i]) {
            let others = own.iter().filter(|node| !self.space.on_axis(**node));
            ring.extend(others.map(|&node| {
                let mut x = self.space.nodes[node as usize];
                x[0] = -x[0];
                x
            }));
        }
        ring
    }

    /// Return the rises over the edges of facet `i`, or `None` if it is part of a plane or of no smooth surface.
    ///
    /// The error of a height at the distance d is the next term of Taylor's series, d^3, so squares have the weight
    /// d^-6.
    fn rise(&self, i: usize) -> Option<Vector3<f64>> {
        let x = self.facets.coordinates(i, self.space);
        let (normal, dual) = (&self.normal[i], dual(&x));
        let centre: [f64; D] = std::array::from_fn(|c| x[..D].iter().map(|x| x[c]).sum::<f64>() / D as f64);
        let size = (0..D).map(|k| length(minus(x[k], centre))).fold(0.0, f64::max);
        let (mut gram, mut right, mut heights) = (Matrix3::zeros(), Vector3::zeros(), Vec::new());
        for at in self.ring(i) {
            let from = minus(at, x[0]);
            let height = dot(normal, &from) / size;
            let mut l = [0.0; D];
            (1..D).for_each(|k| l[k] = dot(&dual[k], &from));
            l[0] = 1.0 - l[1..].iter().sum::<f64>();
            let row = products(&l);
            let near = (size / length(minus(at, centre))).powi(2);
            gram += near.powi(3) * row * row.transpose();
            right += near.powi(3) * height * row;
            heights.push((near, row, height));
        }
        // In planes heights are rounding only, as along straight edges.
        if heights.iter().all(|(_, _, height)| height.abs() <= 1e-9) {
            return None;
        }
        let of = gram.symmetric_eigen();
        let least = 1e-6 * of.eigenvalues.max();
        let inverse = of.eigenvalues.map(|value| if value > least { 1.0 / value } else { 0.0 });
        let rise = of.eigenvectors * inverse.component_mul(&(of.eigenvectors.transpose() * right));
        // Heights are compared as curvatures, so that the far side of the facet has weight. The vertices beside it
        // alone do not distinguish a roof from a cylinder.
        let sum = |of: &dyn Fn(&Vector3<f64>, f64) -> f64| -> f64 {
            heights.iter().map(|(near, row, height)| (near * of(row, *height)).powi(2)).sum()
        };
        let missed = sum(&|row, height| height - rise.dot(row));
        (missed <= (1.0 - EXPLAINED) * sum(&|_, height| height)).then_some(size * rise)
    }
}

impl<const D: usize> Recovery<'_, D> {
    /// Add the residual of the strip between straight facets and the curved boundary to `residual`, one entry per dof.
    /// It is `-int delta (sigma - sigma_nn) : grad v` along the facets for every shape function v, with the recovered
    /// stress sigma. Return the energy `int |delta| sigma : eps` of the strip along the facets of each cell.
    ///
    /// The strip is a part of the body that cells do not cover, and it carries sigma. The pressure -sigma_nn acts on
    /// the curve and not on the facet; the difference of its work is that of div v in the strip. Other loads on the
    /// boundary, and body forces, change less. The energy changes the work of the loads to first order, as does the
    /// squared energy error of a cell, so that both have the same share in the error of displacements.
    pub(super) fn add_strip(&self, residual: &mut [f64]) -> Vec<f64> {
        let (strip, space) = (Strip::of(self.space), self.space);
        let (rule, mut energies) = (element::rule(D, 5), vec![0.0; space.cell_count()]);
        for (i, rise) in strip.rise.iter().enumerate() {
            let (nodes, x, cell) = (strip.facets.facet(i), strip.facets.coordinates(i, space), strip.cells[i]);
            let area = area_vector(Order::P1, &x[..D], &[1.0 / D as f64; D]);
            let size = length(area);
            let (normal, dual) = (area.map(|a| a / size), dual(&x));
            for (l, weight) in rule.iter() {
                let (phi, slopes) = (element::values(space.order, l), element::derivatives(space.order, l));
                let at = element::interpolate(&x, &phi);
                let strain = self.elastic(cell, at, &self.recovered_slope(nodes, l, &at).strain());
                let stress = self.stress(cell, at, &strain);
                let (weight, height) = (weight * size * space.circle(&at), rise.dot(&products(l)));
                energies[cell] += weight * height.abs() * dot(&stress, &strain);
                let of = |c: usize, j: usize| stress[component(c, j)];
                let pressing: f64 = (0..D).map(|c| (0..D).map(|j| normal[c] * of(c, j) * normal[j]).sum::<f64>()).sum();
                for (a, &node) in nodes.iter().enumerate() {
                    let along = |j: usize| (1..D).map(|k| (slopes[a][k] - slopes[a][0]) * dual[k][j]).sum::<f64>();
                    for c in 0..D {
                        let work: f64 =
                            (0..D).map(|j| (of(c, j) - if c == j { pressing } else { 0.0 }) * along(j)).sum();
                        residual[D * node as usize + c] -= weight * height * work;
                    }
                    residual[D * node as usize] -= weight * height * (stress[2] - pressing) * space.hoop(&at, phi[a]);
                }
            }
        }
        energies
    }
}

/// Return l_i l_j for the edges of a facet.
fn products(l: &[f64]) -> Vector3<f64> {
    let edges = l.len() * (l.len() - 1) / 2;
    Vector3::from_fn(|k, _| if k < edges { l[EDGES[k].0] * l[EDGES[k].1] } else { 0.0 })
}

/// Return the gradients of the barycentric coordinates in the plane of a facet with these corners. That of the first is
/// not computed.
fn dual<const D: usize>(x: &[[f64; D]]) -> [[f64; D]; D] {
    let mut dual = [[0.0; D]; D];
    let a = minus(x[1], x[0]);
    if D == 2 {
        let square = dot(&a, &a);
        dual[1] = a.map(|a| a / square);
        return dual;
    }
    let b = minus(x[2], x[0]);
    let (aa, ab, bb) = (dot(&a, &a), dot(&a, &b), dot(&b, &b));
    let determinant = aa * bb - ab * ab;
    dual[1] = std::array::from_fn(|c| (bb * a[c] - ab * b[c]) / determinant);
    dual[2] = std::array::from_fn(|c| (aa * b[c] - ab * a[c]) / determinant);
    dual
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::space::sample::block;

    /// Return the coordinates of a point in the cube of `sample::block` without its skew.
    fn straight<const D: usize>(x: &[f64; D]) -> [f64; D] {
        let mut a = *x;
        (0..D - 1).rev().for_each(|c| a[c] -= 0.2 * a[c + 1]);
        a
    }

    fn bent<const D: usize>(mut x: [f64; D]) -> [f64; D] {
        x[D - 1] += 0.2 * x[0] * x[0] + if D == 3 { 0.1 * x[1] * x[1] - 0.1 * x[0] * x[1] } else { 0.0 };
        x
    }

    fn flat<const D: usize>(mut x: [f64; D]) -> [f64; D] {
        let mut at = x;
        at[D - 1] = 0.0;
        x[D - 1] -= bent(at)[D - 1];
        x
    }

    /// Check a block bent into paraboloids. Its chords lie inside at one side and outside at the other.
    fn curves_are_seen<const D: usize>(order: Order) {
        let mut space = block::<D>(6, order);
        space.nodes.iter_mut().for_each(|x| *x = bent(*x));
        if order == Order::P2 {
            // The edges are straight, as in a mesh of first order.
            for cell in space.cells.chunks_exact(space.stride) {
                for (k, &(i, j)) in EDGES[..D * (D + 1) / 2].iter().enumerate() {
                    let ends = [cell[i], cell[j]].map(|node| space.nodes[node as usize]);
                    let between = &mut space.nodes[cell[D + 1 + k] as usize];
                    *between = std::array::from_fn(|c| 0.5 * (ends[0][c] + ends[1][c]));
                }
            }
        }
        let strip = Strip::of(&space);
        let (mut most, mut least) = (0.0f64, 0.0f64);
        for (i, rise) in strip.rise.iter().enumerate() {
            let x = strip.facets.coordinates(i, &space);
            let l = [1.0 / D as f64; D];
            let mean = |x: &[[f64; D]]| -> [f64; D] { element::interpolate(x, &element::values(Order::P1, &l)) };
            let (chord, curve) = (mean(&x[..D]), bent(mean(&x[..D].iter().map(|x| flat(*x)).collect::<Vec<_>>())));
            let area = area_vector(Order::P1, &x[..D], &l);
            let height: f64 = (0..D).map(|c| area[c] * (curve[c] - chord[c])).sum::<f64>() / dot(&area, &area).sqrt();
            let found = rise.dot(&products(&l));
            assert!((found - height).abs() < 0.1 * height.abs() + 1e-5, "{D} {order:?} {i}: {found} {height}");
            (most, least) = (most.max(found), least.min(found));
        }
        assert!(most > 4e-4 && least < -4e-4, "{most} {least}");
    }

    #[test]
    fn straight_facets_know_the_curve_through_their_vertices() {
        curves_are_seen::<2>(Order::P1);
        curves_are_seen::<2>(Order::P2);
        curves_are_seen::<3>(Order::P1);
        curves_are_seen::<3>(Order::P2);
    }

    /// Check planes, a roof of planes, and quadratic facets that are curved like the boundary.
    fn nothing_is_missed<const D: usize>() {
        let mut roof = block::<D>(4, Order::P1);
        assert!(Strip::of(&roof).rise.is_empty());
        // The planes meet at 33 degrees, which is less than a corner.
        roof.nodes.iter_mut().for_each(|x| x[D - 1] += 0.3 * (straight(x)[0] - 0.5).abs());
        let strip = Strip::of(&roof);
        assert!(strip.rise.is_empty(), "{D}: {} of {} facets", strip.rise.len(), roof.boundary().count());
        let mut curved = block::<D>(4, Order::P2);
        curved.nodes.iter_mut().for_each(|x| *x = bent(*x));
        assert!(Strip::of(&curved).rise.is_empty());
    }

    #[test]
    fn planes_and_corners_have_no_strip() {
        nothing_is_missed::<2>();
        nothing_is_missed::<3>();
    }
}
