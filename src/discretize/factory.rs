//! The data of bodies that inner solvers need, and the trait that makes these solvers.

use crate::error::Result;
use crate::exchange::Plain;
use crate::fem::rigid::AtDofs;
use crate::fem::{ElasticBody, FreeMotion, Interpolation, NodeGraph};
use crate::linalg::Csr;
use crate::model::{Body, BodySlot, Distribution};
use crate::problem::order::Order;

/// What the first rank has of a body before it is assembled.
pub struct Outline<'a> {
    /// Name in the scene.
    pub name: &'a str,
    /// Space dimension, which is the number of dofs of a node.
    pub dimension: usize,
    /// Order of the elements.
    pub order: Order,
    /// All contact rows of the body, pair by pair, with its dofs as columns.
    pub rows: &'a Csr,
    /// Prescribed (dof, value), sorted by dof.
    pub prescribed: &'a [(usize, f64)],
    /// Rigid motions of the free body.
    pub motions: AtDofs<'a>,
    /// Coupling of nodes by K. It is computed when it is first requested.
    pub graph: &'a dyn Fn() -> &'a NodeGraph,
}

/// A maker of the inner solvers of bodies.
pub trait Factory {
    /// The choice of solvers of all bodies.
    type Plan: Plain;

    /// Choose the solvers of all bodies, in the order of the scene, on the first rank.
    ///
    /// # Errors
    /// PETSc refuses an option.
    fn plan(&mut self, outlines: &[Outline]) -> Result<Self::Plan>;

    /// Follow the plan of the first rank on another rank.
    ///
    /// # Errors
    /// PETSc refuses an option.
    fn adopt(&mut self, plan: Self::Plan) -> Result<()>;

    /// Return the sets of bodies whose nodes the plan distributes over the ranks. Bodies of one set share a matrix; their indices
    /// are in increasing order. Bodies that stay whole are in no set.
    fn distributed(&self) -> Vec<Vec<usize>>;

    /// Return whether the plan needs the interpolation of a body from linear displacements.
    fn wants_interpolation(&self, name: &str) -> bool;

    /// Make the solver of a body by its plan, on each rank that owns the body or a part of it.
    ///
    /// # Errors
    /// PETSc refuses a matrix or the value of an option.
    fn make(&mut self, assembled: Assembled) -> Result<Box<dyn Body>>;

    /// Return a body of this name with the same K and contact rows that an earlier scene or leg has left. It is on the rank that
    /// owns the body.
    fn kept(&mut self, name: &str) -> Option<BodySlot>;
}

/// A body that is ready for its inner solver.
pub struct Assembled<'a> {
    /// Name in the scene.
    pub name: String,
    /// Space dimension, which is the block size of the matrix.
    pub dimension: usize,
    /// K, f and supports on all dofs, or on those of this rank.
    pub body: ElasticBody,
    /// Distribution of the dofs, if the body is distributed.
    pub distribution: Option<Distribution>,
    /// All contact rows of the body, pair by pair. The columns are its dofs, or those of the nodes that this rank has.
    pub rows: Csr,
    /// Motions with hardly any strain in a few cells, for the near-null space of multigrid. They are the rigid motions of the
    /// free body, in a body of revolution those of its meridian. Each is one vector over these dofs.
    pub motions: &'a dyn Fn() -> Vec<Vec<f64>>,
    /// Rigid motions that the supports leave, on these dofs.
    pub left: Vec<FreeMotion>,
    /// Interpolation of displacements from linear ones, if it was requested. The rows are the dofs of `body`. The columns belong
    /// to this body alone, or to all bodies of the matrix if the dofs are distributed.
    pub interpolation: Option<Interpolation>,
}
