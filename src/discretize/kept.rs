//! What one problem leaves for another on the same mesh: what its matrices and pairs were made of. The next problem
//! makes only what differs.

use super::pairs::{Contact, ContactFacts, KeptPairs, PairInputs};
use super::partition::{BodyRanks, Partition};
use super::scene_body::SceneBody;
use crate::contact::ContactPair;
use crate::fem::{Elasticity, Frame, NodalBlock, Space};
use crate::linalg::Csr;
use crate::problem::ContactSpec;
use std::rc::Rc;

/// What the bodies and pairs of a problem were made of, on the first rank; empty before the first problem.
pub struct Kept<const D: usize> {
    /// Bodies in the order of the scene.
    pub bodies: Vec<MatrixInputs<D>>,
    /// Pairs in their order.
    pub pairs: Vec<PairInputs<D>>,
    /// Rules by which pairs were found.
    pub rules: Vec<ContactSpec>,
    /// Distributions of nodes over the ranks.
    pub partitions: Vec<Rc<Partition>>,
    /// Ranks of each body.
    pub owners: Vec<BodyRanks>,
}

impl<const D: usize> Default for Kept<D> {
    fn default() -> Self {
        Self { bodies: vec![], pairs: vec![], rules: vec![], partitions: vec![], owners: vec![] }
    }
}

impl<const D: usize> Kept<D> {
    /// Return the spaces of the bodies.
    pub fn spaces(&self) -> Vec<Rc<Space<D>>> {
        self.bodies.iter().map(|body| body.space.clone()).collect()
    }

    /// Return the pairs of the problem, with these arrays and facts, for one with other `bodies`.
    pub fn serving_pairs(
        &mut self,
        bodies: &[MatrixInputs<D>],
        pairs: Vec<(ContactPair, ContactFacts)>,
    ) -> KeptPairs<'_, D> {
        let (pairs, both) = (pairs.into_iter().zip(self.pairs.drain(..)), || bodies.iter().zip(&self.bodies));
        KeptPairs {
            pairs: pairs.map(|((pair, facts), inputs)| Contact { pair, facts, inputs }).collect(),
            rules: &self.rules,
            is_material_same: both().map(|(body, before)| body.has_material_of(before)).collect(),
            are_bodies_same: both().all(|(body, before)| body.has_pairs_of(before)),
        }
    }
}

/// What the stiffness matrix and the contact rows of a body are made of.
pub struct MatrixInputs<const D: usize> {
    space: Rc<Space<D>>,
    elasticity: Rc<Elasticity>,
    springs: Vec<Vec<NodalBlock<D>>>,
    frame: Frame<D>,
    /// Dofs that supports prescribe, sorted, and whether each moves.
    supported: Vec<(usize, bool)>,
    /// All prescribed dofs, also those that fix a motion which nothing holds.
    prescribed: Vec<usize>,
    rows: Csr,
}

impl<const D: usize> MatrixInputs<D> {
    /// Return what is known of a body before its contacts.
    pub fn of(body: &SceneBody<D>) -> Self {
        let mesh = &body.mesh;
        Self {
            space: mesh.space.clone(),
            elasticity: body.elasticity.clone(),
            springs: mesh.springs.clone(),
            frame: mesh.held.frame.clone(),
            supported: mesh.prescribed().into_iter().map(|(dof, u)| (dof, u != 0.0)).collect(),
            prescribed: Vec::new(),
            rows: Csr::default(),
        }
    }

    /// Add the contact rows, and the dofs that are fixed.
    pub fn complete(&mut self, body: &SceneBody<D>) {
        self.rows = body.mesh.rows.clone();
        self.prescribed = body.mesh.held.prescribed.keys().copied().collect();
    }

    /// Return whether both bodies have the same material.
    pub fn has_material_of(&self, other: &Self) -> bool {
        self.elasticity == other.elasticity
    }

    /// Return whether pairs that rules find between such bodies are the same: on planes of symmetry, which have no
    /// displacement, surfaces go on.
    pub fn has_pairs_of(&self, other: &Self) -> bool {
        Rc::ptr_eq(&self.space, &other.space)
            && self.has_material_of(other)
            && (&self.frame, &self.supported) == (&other.frame, &other.supported)
    }

    /// Return whether both bodies have the same matrix and the same contact rows.
    pub fn has_matrix_of(&self, other: &Self) -> bool {
        Rc::ptr_eq(&self.space, &other.space)
            && self.has_material_of(other)
            && (&self.springs, &self.frame, &self.prescribed) == (&other.springs, &other.frame, &other.prescribed)
            && self.rows == other.rows
    }
}
