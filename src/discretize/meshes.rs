//! The meshes without their space dimension, as an estimate of the error uses them.

use super::body_mesh::BodyMesh;
use super::post::FemBody;
use crate::contact::{Fine, FinePoints};
use crate::fem::{Errors, Recovery, Split, element};
use crate::linalg::{Csr, axpy, dot};
use std::rc::Rc;

/// The meshes of all bodies and pairs, kept for an estimate of the error.
#[derive(Clone)]
pub enum Meshes {
    /// A scene in the plane, or of bodies of revolution.
    Plane(Rc<KeptMeshes<2>>),
    /// A scene in space.
    Space(Rc<KeptMeshes<3>>),
}

/// Evaluate an expression with the meshes in their dimension.
macro_rules! in_dimension {
    ($meshes:expr, $kept:ident => $value:expr) => {
        match $meshes {
            Meshes::Plane($kept) => $value,
            Meshes::Space($kept) => $value,
        }
    };
}
pub(crate) use in_dimension;

impl Meshes {
    /// Return the integration points of a pair.
    pub fn points(&self, pair: usize) -> &FinePoints {
        in_dimension!(self, kept => kept.points(pair))
    }

    /// Return the vertices of the facet at an integration point of a side of a pair, with the barycentric coordinates
    /// of the point.
    pub fn vertices(&self, pair: usize, side: usize, point: usize) -> Vec<(u32, f64)> {
        in_dimension!(self, kept => kept.vertices(pair, side, point))
    }

    /// Return the cells of a body.
    pub fn cells(&self, body: usize) -> BodyCells {
        in_dimension!(self, kept => kept.cells(body))
    }

    /// Return the order of convergence of the energy error of a body, which is the degree of its elements.
    pub fn degree(&self, body: usize) -> usize {
        in_dimension!(self, kept => kept.degree(body))
    }
}

/// The cells of a body by their corners.
pub struct BodyCells {
    /// Coordinates of the nodes in the scene.
    pub nodes: Vec<[f64; 3]>,
    /// Number of corners of a cell.
    pub stride: usize,
    /// Node numbers of the corners, `stride` per cell.
    pub corners: Vec<u32>,
    /// Node numbers of the corners of the boundary facets, `stride - 1` per facet, oriented outwards. Facets on an axis
    /// of revolution are excluded.
    pub facets: Vec<u32>,
    /// Size of each cell: the edge of the regular simplex with the measure of the cell.
    pub sizes: Vec<f64>,
}

/// The meshes in `D` dimensions.
pub struct KeptMeshes<const D: usize> {
    /// Bodies in the order of the scene.
    pub shapes: Vec<Rc<FemBody<D>>>,
    /// Integration points of each pair.
    pub fine: Vec<Rc<Fine<D>>>,
}

impl<const D: usize> KeptMeshes<D> {
    /// Return the displacements of all nodes of a body for a state of all its dofs.
    pub fn displacements(&self, body: usize, state: &[f64]) -> Vec<f64> {
        self.shapes[body].mesh.held.frame.displacements(state)
    }

    /// Turn forces at the nodes of a body into forces at its dofs.
    pub fn forces(&self, body: usize, load: &mut [f64]) {
        self.shapes[body].mesh.held.frame.forces(load);
    }

    /// Recover smoother fields from the displacements `u` of all nodes of a body.
    pub fn recover<'a>(&'a self, body: usize, u: &'a [f64]) -> RecoveredBody<'a, D> {
        let shape = &self.shapes[body];
        let split = shape.split();
        let recovery = Recovery::new(&split.space, &shape.elasticity, split.values(u));
        RecoveredBody { kept: self, shape, split, u, recovery }
    }

    /// Return the displacements of all nodes of a body in the rigid motions that its supports leave, with these
    /// amounts.
    pub fn moved(&self, body: usize, amounts: &[f64]) -> Vec<f64> {
        let BodyMesh { space, motions, .. } = &self.shapes[body].mesh;
        let mut moved = vec![0.0; space.dofs()];
        for (motion, amount) in motions.iter().zip(amounts) {
            axpy(*amount, &motion.nodal(space.nodes.iter().copied()), &mut moved);
        }
        moved
    }

    /// Return the outer normal displacement at the integration points of a side of a pair, for displacements `u` of all
    /// nodes of its body.
    pub fn normal_displacement(&self, pair: usize, side: usize, u: &[f64]) -> Vec<f64> {
        let fine = &self.fine[pair];
        let on = &fine.sides[side];
        let sign = if side == 0 { 1.0 } else { -1.0 };
        let at_point = |((&facet, l), normal): ((&usize, &[f64; D]), &[f64; D])| {
            let shapes = on.facets.facet(facet).iter().zip(element::values(on.facets.order, l));
            shapes.map(|(&node, phi)| sign * phi * dot(normal, &u[D * node as usize..][..D])).sum()
        };
        let mut along: Vec<f64> = on.facet.iter().zip(&on.at).zip(&fine.normal).map(at_point).collect();
        fine.add_turns(side, u, &mut along);
        along
    }

    /// See [`Meshes::points`].
    pub fn points(&self, pair: usize) -> &FinePoints {
        &self.fine[pair].points
    }

    /// See [`Meshes::vertices`].
    pub fn vertices(&self, pair: usize, side: usize, point: usize) -> Vec<(u32, f64)> {
        let on = &self.fine[pair].sides[side];
        on.facets.facet(on.facet[point]).iter().copied().zip(on.at[point]).collect()
    }

    /// See [`Meshes::cells`].
    pub fn cells(&self, body: usize) -> BodyCells {
        let space = &self.shapes[body].mesh.space;
        // This is the measure of the regular simplex with edges of length one.
        let regular = if D == 2 { 3f64.sqrt() / 4.0 } else { 2f64.sqrt() / 12.0 };
        let size = |index| (space.cell_measure(index) / regular).powf(1.0 / D as f64);
        let boundary = space.boundary();
        let facets = (0..boundary.count()).map(|i| &boundary.facet(i)[..D]);
        let facets = facets.filter(|facet| !facet.iter().all(|&node| space.on_axis(node))).flatten().copied();
        BodyCells {
            nodes: space.nodes.iter().map(|&x| space.in_scene(x)).collect(),
            stride: D + 1,
            corners: space.cells.chunks_exact(space.stride).flat_map(|cell| &cell[..=D]).copied().collect(),
            facets: facets.collect(),
            sizes: (0..space.cell_count()).map(size).collect(),
        }
    }

    /// See [`Meshes::degree`].
    pub fn degree(&self, body: usize) -> usize {
        self.shapes[body].mesh.space.order.degree()
    }
}

/// A displacement of a body with the fields recovered from it.
pub struct RecoveredBody<'a, const D: usize> {
    kept: &'a KeptMeshes<D>,
    shape: &'a FemBody<D>,
    split: &'a Split<D>,
    u: &'a [f64],
    recovery: Recovery<'a, D>,
}

impl<const D: usize> RecoveredBody<'_, D> {
    /// Return the displacement at a point of a facet, including the interpolation error.
    fn displacement(&self, at: &FacetPoint<D>) -> [f64; D] {
        let mut u = self.missed(at);
        for (&node, phi) in at.nodes.iter().zip(element::values(self.shape.mesh.space.order, at.l)) {
            (0..D).for_each(|c| u[c] += phi * self.u[D * node as usize + c]);
        }
        u
    }

    /// Return the interpolation error at a point of a facet.
    fn missed(&self, at: &FacetPoint<D>) -> [f64; D] {
        self.recovery.missed(at.split, at.l)
    }

    /// Call `visitor` for each integration point of a side, with its index, its normal, and the point in its facet.
    fn visit(&self, pair: usize, side: usize, mut visitor: impl FnMut(usize, [f64; D], FacetPoint<D>)) {
        let fine = &self.kept.fine[pair];
        let on = &fine.sides[side];
        let split = self.split.facets(&on.facets);
        for g in 0..fine.points.each.len() {
            let (nodes, split) = (on.facets.facet(on.facet[g]), split.facet(on.facet[g]));
            // the outer normal of side b is minus that of side a
            let normal = fine.normal[g].map(|n| if side == 0 { n } else { -n });
            visitor(g, normal, FacetPoint { nodes, split, l: &on.at[g] });
        }
    }
}

/// A point of a facet of the boundary.
struct FacetPoint<'a, const D: usize> {
    /// Nodes of the facet.
    nodes: &'a [u32],
    /// The same nodes in the space that is cut apart where the material jumps.
    split: &'a [u32],
    /// Barycentric coordinates.
    l: &'a [f64; D],
}

impl<const D: usize> RecoveredBody<'_, D> {
    /// Return the errors of the body, see [`Recovery::errors`].
    pub fn errors(&self, work_on_missed: f64) -> Errors {
        let errors = self.recovery.errors(work_on_missed);
        Errors { load: self.split.sums(errors.load), ..errors }
    }

    /// Return the products of the errors of this displacement and of the displacements `other` of all nodes in each
    /// cell, see [`Recovery::products`].
    pub fn products(&self, other: &[f64]) -> Vec<f64> {
        let split = self.split;
        self.recovery.products(&Recovery::new(&split.space, &self.shape.elasticity, split.values(other)))
    }

    /// Return the work `sum force_g n.b` of forces at the integration points of a side of a pair on the interpolation
    /// error b.
    pub fn work_on_missed(&self, pair: usize, side: usize, force: &[f64]) -> f64 {
        let mut work = 0.0;
        self.visit(pair, side, |g, normal, at| work += force[g] * dot(&normal, &self.missed(&at)));
        work
    }

    /// Return the outer normal displacement at the integration points of a side of a pair, including the interpolation
    /// error.
    pub fn recovered_displacement(&self, pair: usize, side: usize) -> Vec<f64> {
        let mut values = vec![0.0; self.kept.fine[pair].points.each.len()];
        self.visit(pair, side, |g, normal, at| values[g] = dot(&normal, &self.displacement(&at)));
        self.kept.fine[pair].add_turns(side, self.u, &mut values);
        values
    }

    /// Return, at each contact point of a pair, how much the compression changes if the mean around the point is
    /// replaced by the value at the point itself. The body is side b of the pair, and `rows` are the rows B_b of its
    /// nodal displacements. Turns of surfaces that are apart have means alone.
    pub fn beyond_means(&self, pair: usize, rows: &Csr) -> Vec<f64> {
        let Fine { near, sides, turns, .. } = &*self.kept.fine[pair];
        if turns.as_ref().is_some_and(|turns| turns.are_apart()) {
            return vec![0.0; near.at.len()];
        }
        let (mut mean, split) = (vec![0.0; near.at.len()], self.split.facets(&sides[1].facets));
        rows.multiply(self.u, &mut mean);
        let lacks = |(q, mean): (usize, f64)| {
            let (nodes, split) = (sides[1].facets.facet(near.facet[q]), split.facet(near.facet[q]));
            let u = self.displacement(&FacetPoint { nodes, split, l: &near.at[q] });
            let here: f64 = (0..D).map(|c| -near.normal[q][c] * u[c]).sum();
            here - mean + near.distance[q]
        };
        mean.into_iter().enumerate().map(lacks).collect()
    }

    /// Add `sum force_g n.v` over the integration points of a side of a pair to `r`, for every shape function v.
    pub fn add_forces(&self, pair: usize, side: usize, force: &[f64], r: &mut [f64]) {
        self.visit(pair, side, |g, normal, at| {
            for (&node, phi) in at.nodes.iter().zip(element::values(self.shape.mesh.space.order, at.l)) {
                (0..D).for_each(|c| r[D * node as usize + c] += force[g] * phi * normal[c]);
            }
        });
        self.kept.fine[pair].turns.iter().for_each(|turns| turns.0[side].add_transpose(1.0, force, r));
    }
}
