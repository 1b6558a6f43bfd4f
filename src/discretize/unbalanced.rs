//! Unbalanced forces of a body at given displacements, and displacements that show how much energy is in these forces.

use super::balance::Forces;
use crate::fem::Extent;
use crate::fem::displacement::{self, Internal};
use crate::linalg::dot;

/// The unbalanced forces on the nodes of a part of a body.
#[derive(Debug, Clone, Default)]
pub struct Unbalanced {
    /// r = f - K u - B' omega p without its rounding, one entry per dof of the nodes of the part. Entries are zero at dofs that
    /// supports prescribe, and at nodes of other ranks.
    pub force: Vec<f64>,
    /// Energy product u'Ku of owned nodes, with springs to the ground.
    pub strain: f64,
    /// Stiffness of each node: a bound of the diagonal of K here, and of what contact springs add to it in `springs`.
    diagonal: Vec<f64>,
    springs: Vec<f64>,
    /// See [`Internal::bulk`].
    bulk: Vec<f64>,
}

impl Unbalanced {
    /// Return what stands for a body whose displacements are unknown.
    pub fn unknown() -> Self {
        Self { strain: f64::NAN, ..Self::default() }
    }
}

/// Largest number of hats of a grid. Their sums are a message between ranks, which stays short beside one of all contact points.
const HATS: usize = 5000;

/// Nodes of a body per hat. Finer hats would resemble those of the elements, which the diagonal of K covers.
const NODES: usize = 4;

/// Return grids over a body, each twice as fine as the one before.
fn grids<const D: usize>(extent: &Extent, nodes: usize) -> Vec<Grid<D>> {
    let corners: Vec<[f64; D]> = extent.corners().collect();
    let (low, high) = (corners[0], corners[corners.len() - 1]);
    let of_level = |level: u32| {
        let step = extent.size() / f64::from(1u32 << level);
        let count = std::array::from_fn(|c| 1 + (((high[c] - low[c]) / step).ceil() as usize).max(1));
        Grid { low, step, count }
    };
    let fits = |grid: &Grid<D>| grid.len() == 1 << D || grid.len() <= HATS.min(nodes / NODES);
    (0..20).map(of_level).take_while(fits).collect()
}

/// A grid of cubes with multilinear hat functions.
struct Grid<const D: usize> {
    low: [f64; D],
    step: f64,
    count: [usize; D],
}

impl<const D: usize> Grid<D> {
    fn len(&self) -> usize {
        self.count.iter().product()
    }

    /// Return the hats at a point with their values.
    fn hats(&self, x: &[f64; D]) -> impl Iterator<Item = (usize, f64)> {
        let (mut first, mut share) = ([0; D], [0.0; D]);
        for c in 0..D {
            let at = ((x[c] - self.low[c]) / self.step).max(0.0);
            first[c] = (at as usize).min(self.count[c] - 2);
            share[c] = (at - first[c] as f64).min(1.0);
        }
        let count = self.count;
        (0..1 << D).map(move |corner: usize| {
            let (mut number, mut value) = (0, 1.0);
            for c in (0..D).rev() {
                let next = corner >> c & 1;
                number = number * count[c] + first[c] + next;
                value *= if next == 1 { share[c] } else { 1.0 - share[c] };
            }
            (number, value)
        })
    }
}

impl<const D: usize> Forces<D> {
    /// Return the unbalanced forces for displacements `u` of the nodes of the part without rigid motion, and for the forces omega
    /// p of the contact rows. `springs` are the stiffnesses omega kappa of these rows.
    pub fn unbalanced(&self, u: &[f64], force: &[f64], springs: &[f64]) -> Unbalanced {
        let space = &*self.part.space;
        let Internal { force: inner, rounding, mut diagonal, bulk } =
            displacement::internal_forces(space, &self.elasticity, 0..space.cell_count(), u);
        let mut sum = Sum { force: self.load.clone(), size: rounding };
        let mut resisting = vec![0.0; bulk.len()];
        for (row, (force, spring)) in force.iter().zip(springs).enumerate() {
            let whole: f64 = self.rows.row(row).map(|(_, b)| b.abs()).sum();
            for (dof, b) in self.rows.row(row) {
                sum.add(dof, -b * force, D);
                resisting[dof / D] += spring * b.abs() * whole;
            }
        }
        let mut strain = self.own_dofs().map(|dof| u[dof] * inner[dof]).sum::<f64>();
        inner.iter().enumerate().for_each(|(dof, inner)| sum.force[dof] -= inner);
        for block in self.springs.iter().flatten() {
            let [a, b] = block.nodes.map(|node| D * node as usize);
            for (i, row) in block.block.iter().enumerate() {
                let pull = dot(row, &u[b..b + D]);
                sum.add(a + i, -pull, D);
                strain += if self.part.own[a / D] { u[a + i] * pull } else { 0.0 };
                diagonal[a / D] += if a == b { row[i].abs() } else { 0.0 };
            }
        }
        for (node, total) in &self.rigid {
            (0..D).for_each(|c| sum.add(D * *node as usize + c, total[c], D));
        }
        for per_node in [&mut sum.size, &mut diagonal, &mut resisting] {
            self.held.frame.sum(per_node);
        }
        let Sum { mut force, size } = sum;
        self.held.frame.forces(&mut force);
        self.clear(&mut force);
        for (dof, force) in force.iter_mut().enumerate() {
            let counts = if self.part.own[dof / D] { (force.abs() - size[dof / D]).max(0.0) } else { 0.0 };
            *force = counts.copysign(*force);
        }
        Unbalanced { force, strain, diagonal, springs: resisting, bulk }
    }

    fn own_dofs(&self) -> impl Iterator<Item = usize> {
        (0..self.load.len()).filter(|dof| self.part.own[dof / D])
    }

    /// Set the entries at dofs that supports prescribe to zero.
    fn clear(&self, field: &mut [f64]) {
        self.held.prescribed.keys().for_each(|&dof| field[dof] = 0.0);
    }

    /// Return the displacement of each node under its unbalanced force alone, one entry per dof. It is valid at owned nodes.
    pub fn rough(&self, unbalanced: &Unbalanced) -> Vec<f64> {
        let Unbalanced { force, diagonal, springs, .. } = unbalanced;
        let divided = |(dof, force): (usize, &f64)| match force {
            0.0 => 0.0,
            force => force / (diagonal[dof / D] + springs[dof / D]),
        };
        force.iter().enumerate().map(divided).collect()
    }

    /// Return the contribution of owned nodes to the forces on the hats of all grids over the body, and to the stiffnesses of the
    /// hats. There are D + 2 numbers per hat.
    pub fn on_hats(&self, unbalanced: &Unbalanced) -> Vec<f64> {
        let mut sums = Vec::new();
        let force = self.held.frame.displacements(&unbalanced.force);
        let nodes = (0..unbalanced.bulk.len()).filter(|&node| self.part.own[node]);
        let nodes: Vec<usize> = nodes.filter(|node| !self.held.frame.master.contains_key(&(*node as u32))).collect();
        for grid in grids::<D>(&self.extent, self.nodes) {
            let begin = sums.len();
            sums.resize(begin + (D + 2) * grid.len(), 0.0);
            for &node in &nodes {
                let (force, bulk) = (&force[D * node..][..D], unbalanced.bulk[node] / grid.step.powi(2));
                for (hat, value) in grid.hats(&self.part.space.nodes[node]) {
                    let sums = &mut sums[begin + (D + 2) * hat..][..D + 2];
                    (0..D).for_each(|c| sums[c] += value * force[c]);
                    sums[D] += value * bulk;
                    sums[D + 1] += value * value * unbalanced.springs[node];
                }
            }
        }
        sums
    }

    /// Return the displacement under the forces on all hats as if each hat were alone, one entry per dof. `sums` is the sum over
    /// ranks of [`Forces::on_hats`]; contact springs are included if `with_springs`.
    pub fn smooth(&self, sums: &[f64], with_springs: bool) -> Vec<f64> {
        let space = &*self.part.space;
        let mut field = vec![0.0; self.load.len()];
        let mut rest = sums;
        for grid in grids::<D>(&self.extent, self.nodes) {
            let of_grid;
            (of_grid, rest) = rest.split_at((D + 2) * grid.len());
            let moved: Vec<[f64; D]> = of_grid
                .chunks_exact(D + 2)
                .map(|sums| {
                    let stiffness = sums[D] + if with_springs { sums[D + 1] } else { 0.0 };
                    std::array::from_fn(|c| if sums[c] == 0.0 { 0.0 } else { sums[c] / stiffness })
                })
                .collect();
            for (u, x) in field.chunks_exact_mut(D).zip(space.nodes.iter()) {
                grid.hats(x).for_each(|(hat, value)| (0..D).for_each(|c| u[c] += value * moved[hat][c]));
            }
        }
        let mut field = self.held.frame.dofs(&field);
        self.clear(&mut field);
        field
    }

    /// Return the products v_i'K v_j over the cells that this rank writes, with springs to the ground at owned nodes. Each field
    /// has one entry per dof.
    pub fn products(&self, fields: &[Vec<f64>]) -> Vec<f64> {
        let nodal: Vec<Vec<f64>> = fields.iter().map(|field| self.held.frame.displacements(field)).collect();
        let n = fields.len();
        let mut products = displacement::energy_products(&self.part.space, &self.elasticity, self.part.owned(), &nodal);
        for block in self.springs.iter().flatten().filter(|block| self.part.own[block.nodes[0] as usize]) {
            let [a, b] = block.nodes.map(|node| D * node as usize);
            for (i, row) in block.block.iter().enumerate() {
                for (place, product) in products.iter_mut().enumerate() {
                    *product += nodal[place / n][a + i] * dot(row, &nodal[place % n][b..b + D]);
                }
            }
        }
        products
    }

    /// Return the contribution of owned nodes to B v, one entry per contact row, for a field v with one entry per dof.
    pub fn trace(&self, field: &[f64]) -> Vec<f64> {
        let nodal = self.held.frame.displacements(field);
        let own = |row: usize| self.rows.row(row).filter(|(dof, _)| self.part.own[dof / D]);
        (0..self.rows.rows()).map(|row| own(row).map(|(dof, b)| b * nodal[dof]).sum()).collect()
    }
}

/// Forces at dofs with bounds of their rounding at nodes.
struct Sum {
    force: Vec<f64>,
    size: Vec<f64>,
}

impl Sum {
    /// Add a force that is a product of two numbers. Product and sum contribute one rounding each.
    fn add(&mut self, dof: usize, force: f64, dimension: usize) {
        self.force[dof] += force;
        self.size[dof / dimension] += 2.0 * f64::EPSILON * (force.abs() + self.force[dof].abs());
    }
}
