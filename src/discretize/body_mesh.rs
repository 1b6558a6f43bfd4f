//! The mesh of a body with all that is tied to its nodes: on the first rank the whole body, on every rank the part that
//! it needs, with local numbers.

use super::supports::Constraints;
use crate::contact::ENTRY_ROUNDING;
use crate::exchange::Plain;
use crate::fem::interpolation::{coarse_nodes, from_vertices};
use crate::fem::{
    Frame, NodalBlock, NodalForces, NodeGraph, PointExtent, Prolongation, RigidMotion, Space, completed, length, minus,
    rigid,
};
use crate::linalg::{Blocks, Csr, TOLERANCE, dot};
use crate::model::Distribution;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::cell::OnceCell;
use std::collections::{BTreeMap, HashSet};
use std::rc::Rc;

/// A body on its mesh, or the part of it on the nodes that a rank needs, with local numbers.
#[derive(Clone, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain, [[f64; D]; D]: Plain")]
pub struct BodyMesh<const D: usize> {
    /// Finite element space: nodes and cells.
    pub space: Rc<Space<D>>,
    /// Index of the elastic constants of each cell; empty if the body has no regions.
    pub regions: Vec<usize>,
    /// Constraints from supports and rigid surfaces.
    pub held: Constraints<D>,
    /// Springs to the ground: the stiffness blocks between nodes for each spring of the scene.
    pub springs: Vec<Vec<NodalBlock<D>>>,
    /// Point of the mesh of each node.
    pub points: Vec<u32>,
    /// Number of nodes of the whole body and their extent.
    pub extent: PointExtent,
    /// Contact rows, pair by pair, with dofs as columns.
    pub rows: Csr,
    /// The same rows with displacements of nodes as columns.
    pub nodal_rows: Csr,
    /// The displacement towards each contact surface, with displacements of nodes as columns
    /// ([`approach::rows`](super::approach::rows)).
    pub approach: Csr,
    /// Nodal forces of the loads without those on rigid surfaces. On a part they are those at owned nodes, and at nodes
    /// tied to these.
    pub load: NodalForces<D>,
    /// Rigid motions that supports leave. First come the free ones, which springs leave, too.
    pub motions: Vec<RigidMotion<D>>,
    /// Number of the free motions.
    pub free: usize,
    /// How its dofs are distributed over the ranks, if they are.
    pub distribution: Option<Distribution>,
    /// Whether this rank owns the body or nodes of it. Other ranks have it for estimates of the error.
    pub is_owned: bool,
    /// Coupling of nodes by K, once it was requested on this rank.
    #[serde(skip)]
    pub graph: OnceCell<NodeGraph>,
}

impl<const D: usize> BodyMesh<D> {
    /// Return whether this rank owns each node.
    pub fn own_nodes(&self) -> Vec<bool> {
        let first_dof = |node: u32| D * self.held.frame.node(node) as usize;
        let is_own = |dof: usize| self.distribution.as_ref().is_none_or(|owned| owned.owned_index(dof).is_some());
        (0..self.space.nodes.len() as u32).map(|node| is_own(first_dof(node))).collect()
    }

    /// Return the coupling of the nodes by K, which is computed when it is first requested.
    pub fn graph(&self) -> &NodeGraph {
        self.graph.get_or_init(|| NodeGraph::with_rows(&self.space, &self.rows, &self.held.frame))
    }

    /// Return the frame in which nodes have their contact normal as first axis, so that contact rows have one entry
    /// there. These are nodes without a constraint whose rows have all the same normal, which is along no axis of the
    /// scene.
    pub fn contact_frame(&self) -> Frame<D> {
        let mut normals: BTreeMap<u32, Vec<[f64; D]>> = BTreeMap::new();
        for q in 0..self.nodal_rows.rows() {
            let row: Vec<(usize, f64)> = self.nodal_rows.row(q).collect();
            for at_node in row.chunk_by(|p, q| p.0 / D == q.0 / D) {
                let mut normal = [0.0; D];
                at_node.iter().for_each(|(i, value)| normal[i % D] = *value);
                normals.entry((at_node[0].0 / D) as u32).or_default().push(normal);
            }
        }
        let mut frame = self.held.frame.clone();
        let leaders: HashSet<u32> = frame.leaders().collect();
        for (node, normals) in normals {
            let mut dofs = D * node as usize..D * (node as usize + 1);
            let is_free = dofs.all(|dof| !self.held.prescribed.contains_key(&dof))
                && frame.row(node).is_empty()
                && !leaders.contains(&node);
            let is_inclined = |normal: &[f64; D]| normal.iter().filter(|n| **n != 0.0).count() > 1;
            if let Some(normal) = common_direction(&normals).filter(|normal| is_free && is_inclined(normal)) {
                frame.turn(node, completed(vec![normal]), &[]);
            }
        }
        frame
    }

    /// Return the displacements of all dofs in a rigid motion.
    pub fn dofs_of(&self, motion: &RigidMotion<D>) -> Vec<f64> {
        (0..self.space.nodes.len() as u32).flat_map(|node| self.at_dofs(motion, node)).collect()
    }

    /// Return the rigid motions of the free body.
    pub fn rigid_modes(&self) -> Vec<RigidMotion<D>> {
        rigid::of(&self.extent, self.space.axisymmetric)
    }

    /// Return the displacements of the dofs of a node in a rigid motion.
    pub fn at_dofs(&self, motion: &RigidMotion<D>, node: u32) -> [f64; D] {
        self.held.frame.dofs(node, |node| self.at(motion, node), motion.rotation())
    }

    /// Return the displacement of a dof in a rigid motion.
    pub fn dof_of(&self, motion: &RigidMotion<D>, dof: usize) -> f64 {
        self.at_dofs(motion, (dof / D) as u32)[dof % D]
    }

    /// Return the motions that neither supports nor springs constrain.
    pub fn free_motions(&self) -> &[RigidMotion<D>] {
        &self.motions[..self.free]
    }

    /// Return the products of the free motions over all dofs without the prescribed ones.
    pub fn products(&self) -> DMatrix<f64> {
        let (count, mut held) = (self.free, self.held.prescribed.keys().copied().peekable());
        let mut products = DMatrix::zeros(count, count);
        for node in 0..self.space.nodes.len() {
            let mut at: Vec<[f64; D]> =
                self.free_motions().iter().map(|motion| self.at_dofs(motion, node as u32)).collect();
            while let Some(dof) = held.next_if(|dof| dof / D <= node) {
                at.iter_mut().filter(|_| dof / D == node).for_each(|u| u[dof % D] = 0.0);
            }
            for (i, u) in at.iter().enumerate() {
                at.iter().enumerate().for_each(|(j, v)| products[(i, j)] += dot(u, v));
            }
        }
        products
    }

    /// Return the displacement of a node in a rigid motion.
    pub fn at(&self, motion: &RigidMotion<D>, node: u32) -> [f64; D] {
        motion.at(&self.space.nodes[node as usize])
    }

    /// Return the prescribed (dof, value), sorted by dof.
    pub fn prescribed(&self) -> Vec<(usize, f64)> {
        self.held.prescribed.iter().map(|(&dof, &value)| (dof, value)).collect()
    }

    /// Return the rigid motion that comes nearest to the prescribed displacements in the sum of squares. Its part along
    /// motions that supports leave is zero.
    pub fn imposed_motion(&self) -> RigidMotion<D> {
        let rigid_modes = self.rigid_modes();
        let mut squares = DMatrix::zeros(rigid_modes.len(), rigid_modes.len());
        let mut work = DVector::zeros(rigid_modes.len());
        for (&dof, &value) in &self.held.prescribed {
            let at =
                DVector::from_iterator(rigid_modes.len(), rigid_modes.iter().map(|motion| self.dof_of(motion, dof)));
            squares.ger(1.0, &at, &at, 1.0);
            work.axpy(value, &at, 1.0);
        }
        rigid::sum(&rigid_modes, &Blocks::single(&squares).factor().solve(&work))
    }

    /// Find the motions that supports leave at present, the free ones first.
    pub fn find_motions(&mut self) {
        let all = self.rigid_modes();
        let left = rigid::left_by_supports(all.len(), |k, dof| self.dof_of(&all[k], dof), &self.prescribed());
        self.motions = left.iter().map(|weights| rigid::combine(&all, weights)).collect();
        let scale = self.ground_stiffness(&all).diagonal().max();
        self.free = self.motions.len();
        if scale > 0.0 && self.free > 0 {
            let free = Blocks::free(&self.ground_stiffness(&self.motions), scale, TOLERANCE);
            self.free = free.len();
            self.motions = rigid::basis_from(&self.motions, &free);
        }
    }

    /// Return the stiffness of the springs to the ground in terms of motions; zero without springs.
    pub fn ground_stiffness(&self, motions: &[RigidMotion<D>]) -> DMatrix<f64> {
        rigid::of_springs(motions.len(), |k, node| self.at(&motions[k], node), self.springs.iter().flatten())
    }

    /// Return the loads on rigid surfaces as forces at dofs.
    fn rigid_forces(&self) -> impl Iterator<Item = (u32, [f64; D])> + '_ {
        let forces = self.held.rigid.iter().filter_map(|surface| surface.force);
        let moments = self.held.rigid.iter().filter_map(|surface| surface.moment);
        forces.flat_map(|(master, force)| self.held.frame.force(master, force)).chain(moments)
    }

    /// Return all loads as forces at dofs.
    pub fn load_on_dofs(&self) -> NodalForces<D> {
        let at_dofs = self.load.iter().flat_map(|(node, force)| self.held.frame.force(node, force));
        at_dofs.chain(self.rigid_forces()).collect()
    }

    /// Return the load vector f at all dofs.
    pub fn load_vector(&self) -> Vec<f64> {
        let mut load = self.load.all(self.space.nodes.len());
        self.held.frame.forces(&mut load);
        for (node, total) in self.rigid_forces() {
            (0..D).for_each(|c| load[D * node as usize + c] += total[c]);
        }
        load
    }

    /// Return the nodes of linear displacements, sorted.
    pub fn coarse_nodes(&self) -> Vec<u32> {
        coarse_nodes(&self.space, &self.held.frame)
    }

    /// Return the interpolation of the dofs from those at these nodes.
    pub fn interpolation(&self, coarse: &[u32]) -> Prolongation {
        from_vertices(&self.space, &self.held.frame, |dof| self.held.prescribed.contains_key(&dof), coarse)
    }
}

/// Return the unit vector of which all vectors are multiples up to rounding, if there is one.
fn common_direction<const D: usize>(vectors: &[[f64; D]]) -> Option<[f64; D]> {
    let longest = vectors.iter().max_by(|a, b| length(**a).total_cmp(&length(**b)))?;
    let size = length(*longest);
    let unit = longest.map(|x| x / size);
    let aside = |vector: &[f64; D]| length(minus(*vector, unit.map(|n| dot(vector, &unit) * n)));
    vectors.iter().all(|vector| aside(vector) <= ENTRY_ROUNDING * size).then_some(unit)
}

#[cfg(test)]
mod tests {
    use super::common_direction;
    use crate::fem::completed;
    use crate::linalg::dot;

    #[test]
    fn a_plane_has_one_normal_and_a_corner_two() {
        let normal = [2.0 / 3.0, -2.0 / 3.0, 1.0 / 3.0];
        let shares = [0.5, 1.0, -0.1, 1e-8].map(|share| normal.map(|n| share * n));
        let found = common_direction(&shares).expect("a normal");
        let axes = completed(vec![found]);
        for (i, a) in axes.iter().enumerate() {
            let products = axes.iter().map(|b| dot(a, b)).enumerate();
            products.for_each(|(j, product)| assert!((product - f64::from(u8::from(i == j))).abs() < 1e-15));
            assert!((dot(a, &normal) - f64::from(u8::from(i == 0))).abs() < 1e-15);
        }
        assert_eq!(common_direction(&[normal, [0.0, 0.0, 0.5]]), None);
    }
}
