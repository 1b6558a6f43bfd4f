//! What an estimate of the error asks of meshes, without their dimension.

use super::supports::Constraints;
use crate::contact::Fine;
use crate::fem::{Elasticity, Recovery, RigidMotion, Space, element};
use crate::linalg::{Csr, axpy, dot};
use std::rc::Rc;

/// The meshes of all bodies and pairs, kept for an estimate of the error.
pub trait Meshes {
    /// Displacements of all nodes of a body for a state of all its dofs.
    fn displacements(&self, body: usize, state: &[f64]) -> Vec<f64>;

    /// Turns forces at the nodes of a body into those at its dofs.
    fn forces(&self, body: usize, load: &mut [f64]);

    /// Recovers from displacements of all nodes of a body.
    fn recover<'a>(&'a self, body: usize, u: &'a [f64]) -> Box<dyn Recovered + 'a>;

    /// Forces at the nodes of a body that the quadrature of its loads misses; empty for none.
    fn unloaded(&self, body: usize) -> &[f64];

    /// Displacements of all nodes of a body in the rigid motions that its supports leave, by their amounts.
    fn moved(&self, body: usize, amounts: &[f64]) -> Vec<f64>;

    /// The size of the force at the node of each entry of forces at all nodes of a body.
    fn sizes(&self, body: usize, load: &[f64]) -> Vec<f64>;

    /// The integration points of a pair.
    fn points(&self, pair: usize) -> FinePoints<'_>;

    /// The cells of a body.
    fn cells(&self, body: usize) -> Cells;

    /// Order of convergence of the energy error of a body: the degree of its elements.
    fn degree(&self, body: usize) -> usize;
}

/// The cells of a body by their corners.
pub struct Cells {
    /// Coordinates of the nodes in the scene.
    pub nodes: Vec<[f64; 3]>,
    /// Corners of a cell.
    pub stride: usize,
    /// Node numbers of the corners, `stride` per cell.
    pub corners: Vec<u32>,
    /// Node numbers of the corners of the facets of the boundary, `stride - 1` per facet, oriented outwards; none on an axis of revolution.
    pub facets: Vec<u32>,
    /// Size of each cell: edge of the regular simplex of its measure.
    pub sizes: Vec<f64>,
}

/// The integration points of a pair; see [`Fine`].
pub struct FinePoints<'a> {
    /// Length (area) of each.
    pub weight: &'a [f64],
    /// Gap of each.
    pub gap: &'a [f64],
    /// What the two bodies give way, per pressure, to one that changes its sign within a facet: between the springs of two
    /// half-spaces in a row, for a wave as long as the facet.
    pub compliance: Vec<f64>,
    /// Contact point nearest to each.
    pub nearest: &'a [usize],
    /// Whether the contact points around each are at mid-edges.
    pub at_edges: &'a [bool],
    /// Values at the contact points -> values at these.
    pub interpolation: &'a Csr,
    /// Pressures at the contact points -> those that the discrete problem has at these.
    pub pressing: &'a Csr,
}

/// A displacement of a body with what was recovered from it.
pub trait Recovered {
    /// Squared energy norm of recovered minus discrete stress, for each cell.
    fn energy_errors(&self) -> Vec<f64>;

    /// Residual at all nodes of the interpolation error, see [`Recovery::interpolation_residual`], and of what straight facets miss of a
    /// curved boundary, see [`Recovery::add_strip`].
    fn interpolation_residual(&self) -> Vec<f64>;

    /// Outer normal displacement at the integration points of a side of a pair, the interpolation error added.
    fn normal_displacement(&self, pair: usize, side: usize) -> Vec<f64>;

    /// At the contact points of a pair, of whose side b this is, with rows B_b of its nodal displacements: what the compression lacks where
    /// the mean around a point is taken for the value at the point itself.
    fn beyond_means(&self, pair: usize, rows: &Csr) -> Vec<f64>;

    /// Adds `sum force_g n.v` over the integration points of a side of a pair to `r`, for every shape function v.
    fn add_forces(&self, pair: usize, side: usize, force: &[f64], r: &mut [f64]);
}

/// A body's space, elasticity and supports.
pub struct Shape<const D: usize> {
    /// Its space.
    pub space: Rc<Space<D>>,
    /// Its elasticity.
    pub elasticity: Rc<Elasticity>,
    /// Its modulus against pressure on its contact surfaces, E/(1 - nu^2) if isotropic.
    pub modulus: f64,
    /// Its supports, which choose the dofs.
    pub held: Rc<Constraints<D>>,
    /// See [`Meshes::unloaded`].
    pub unloaded: Vec<f64>,
    /// The rigid motions that its supports leave, in the order of [`Motions::with_springs`](crate::model::Motions::with_springs).
    pub motions: Vec<RigidMotion<D>>,
}

/// [`Meshes`] in `D` dimensions.
pub struct Kept<const D: usize> {
    /// Bodies in the order of the scene.
    pub shapes: Vec<Shape<D>>,
    /// Integration points of each pair.
    pub fine: Vec<Fine<D>>,
}

impl<const D: usize> Meshes for Kept<D> {
    fn displacements(&self, body: usize, state: &[f64]) -> Vec<f64> {
        self.shapes[body].held.frame.displacements(state)
    }

    fn forces(&self, body: usize, load: &mut [f64]) {
        self.shapes[body].held.frame.forces(load);
    }

    fn recover<'a>(&'a self, body: usize, u: &'a [f64]) -> Box<dyn Recovered + 'a> {
        let shape = &self.shapes[body];
        Box::new(OnBody { kept: self, shape, u, recovery: Recovery::new(&shape.space, u) })
    }

    fn unloaded(&self, body: usize) -> &[f64] {
        &self.shapes[body].unloaded
    }

    fn moved(&self, body: usize, amounts: &[f64]) -> Vec<f64> {
        let Shape { space, motions, .. } = &self.shapes[body];
        let mut moved = vec![0.0; space.dofs()];
        for (motion, amount) in motions.iter().zip(amounts) {
            axpy(*amount, &motion.nodal(space.nodes.iter().copied()), &mut moved);
        }
        moved
    }

    fn sizes(&self, _body: usize, load: &[f64]) -> Vec<f64> {
        load.chunks_exact(D).flat_map(|force| [dot(force, force).sqrt(); D]).collect()
    }

    fn points(&self, pair: usize) -> FinePoints<'_> {
        let Fine { weight, gap, size, bodies, nearest, at_edges, interpolation, pressing, .. } = &self.fine[pair];
        let soft: f64 = bodies.iter().map(|&body| 1.0 / self.shapes[body].modulus).sum();
        let compliance = size.iter().map(|size| size * soft / std::f64::consts::PI).collect();
        FinePoints { weight, gap, compliance, nearest, at_edges, interpolation, pressing }
    }

    fn cells(&self, body: usize) -> Cells {
        let space = &self.shapes[body].space;
        // measure of the regular simplex with edges of length one
        let regular = if D == 2 { 3f64.sqrt() / 4.0 } else { 2f64.sqrt() / 12.0 };
        let size = |index| (space.cell_measure(index) / regular).powf(1.0 / D as f64);
        let boundary = space.boundary();
        let facets = (0..boundary.count()).map(|i| &boundary.facet(i)[..D]);
        let facets = facets.filter(|facet| !facet.iter().all(|&node| space.on_axis(node))).flatten().copied();
        Cells {
            nodes: space.nodes.iter().map(|&x| space.in_scene(x)).collect(),
            stride: D + 1,
            corners: space.cells.chunks_exact(space.stride).flat_map(|cell| &cell[..=D]).copied().collect(),
            facets: facets.collect(),
            sizes: (0..space.cell_count()).map(size).collect(),
        }
    }

    fn degree(&self, body: usize) -> usize {
        self.shapes[body].space.order as usize + 1
    }
}

struct OnBody<'a, const D: usize> {
    kept: &'a Kept<D>,
    shape: &'a Shape<D>,
    u: &'a [f64],
    recovery: Recovery<'a, D>,
}

impl<const D: usize> OnBody<'_, D> {
    /// Stress of a strain at an integration point of a cell; assembly was there, so the law has a value.
    fn stress(&self, cell: usize, x: [f64; D], strain: &[f64; 6]) -> [f64; 6] {
        self.shape
            .elasticity
            .at(cell, self.shape.space.in_scene(x))
            .map_or([0.0; 6], |material| material.stress(strain))
    }
}

/// The outer normal of side b is minus that of side a.
const SIGN: [f64; 2] = [1.0, -1.0];

impl<const D: usize> OnBody<'_, D> {
    /// Displacement at barycentric coordinates of a facet, the interpolation error added.
    fn displacement(&self, nodes: &[u32], l: &[f64; D]) -> [f64; D] {
        let mut u = self.recovery.missed(nodes, l);
        for (&node, phi) in nodes.iter().zip(element::values(self.shape.space.order, l)) {
            (0..D).for_each(|c| u[c] += phi * self.u[D * node as usize + c]);
        }
        u
    }

    /// Visits the integration points of a side: number, normal, nodes and barycentric coordinates of each.
    fn visit(&self, pair: usize, side: usize, mut visitor: impl FnMut(usize, [f64; D], &[u32], &[f64; D])) {
        let fine = &self.kept.fine[pair];
        let on = &fine.sides[side];
        for g in 0..fine.weight.len() {
            visitor(g, fine.normal[g].map(|n| SIGN[side] * n), on.facets.facet(on.facet[g]), &on.at[g]);
        }
    }
}

impl<const D: usize> Recovered for OnBody<'_, D> {
    fn energy_errors(&self) -> Vec<f64> {
        self.recovery.energy_errors(&|cell, x, strain| self.stress(cell, x, strain))
    }

    fn interpolation_residual(&self) -> Vec<f64> {
        let law = |cell, x, strain: &[f64; 6]| self.stress(cell, x, strain);
        let mut residual = self.recovery.interpolation_residual(&law);
        self.recovery.add_strip(&law, &mut residual);
        residual
    }

    fn normal_displacement(&self, pair: usize, side: usize) -> Vec<f64> {
        let mut values = vec![0.0; self.kept.fine[pair].weight.len()];
        self.visit(pair, side, |g, normal, nodes, l| {
            let u = self.displacement(nodes, l);
            values[g] = (0..D).map(|c| normal[c] * u[c]).sum();
        });
        values
    }

    fn beyond_means(&self, pair: usize, rows: &Csr) -> Vec<f64> {
        let Fine { near, sides, .. } = &self.kept.fine[pair];
        let mut mean = vec![0.0; near.at.len()];
        rows.multiply(self.u, &mut mean);
        let lacks = |(q, mean): (usize, f64)| {
            let (nodes, l) = (sides[1].facets.facet(near.facet[q]), &near.at[q]);
            let u = self.displacement(nodes, l);
            let here: f64 = (0..D).map(|c| -near.normal[q][c] * u[c]).sum();
            here - mean + near.distance[q]
        };
        mean.into_iter().enumerate().map(lacks).collect()
    }

    fn add_forces(&self, pair: usize, side: usize, force: &[f64], r: &mut [f64]) {
        self.visit(pair, side, |g, normal, nodes, l| {
            for (&node, phi) in nodes.iter().zip(element::values(self.shape.space.order, l)) {
                (0..D).for_each(|c| r[D * node as usize + c] += force[g] * phi * normal[c]);
            }
        });
    }
}
