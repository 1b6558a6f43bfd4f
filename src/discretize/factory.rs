//! What bodies need to become solvers, and who makes them.

use crate::error::Result;
use crate::exchange::Plain;
use crate::fem::rigid::AtDofs;
use crate::fem::{ElasticBody, FreeMotion, Interpolation, NodeGraph};
use crate::linalg::Csr;
use crate::model::{Body, BodySlot, Distribution};
use crate::problem::order::Order;

/// What the first rank knows of a body before it is assembled.
pub struct Outline<'a> {
    /// Name in the scene.
    pub name: &'a str,
    /// Space dimension: dofs of a node.
    pub dimension: usize,
    /// Order of its elements.
    pub order: Order,
    /// All contact rows of the body, pair by pair; columns: its dofs.
    pub rows: &'a Csr,
    /// Prescribed (dof, value), sorted by dof.
    pub prescribed: &'a [(usize, f64)],
    /// Rigid motions of the free body.
    pub motions: AtDofs<'a>,
    /// Which of its nodes K couples, made when it is first requested.
    pub graph: &'a dyn Fn() -> &'a NodeGraph,
}

/// Gives bodies their inner solvers.
pub trait Factory {
    /// The choice of solvers of all bodies.
    type Plan: Plain;

    /// Choose the solvers of all bodies, in the order of the scene, on the first rank.
    ///
    /// # Errors
    /// Failures of PETSc's options.
    fn plan(&mut self, outlines: &[Outline]) -> Result<Self::Plan>;

    /// Follow the plan of the first rank on another one.
    ///
    /// # Errors
    /// Failures of PETSc's options.
    fn adopt(&mut self, plan: Self::Plan) -> Result<()>;

    /// Return the numbers, in increasing order, of bodies whose nodes are to be distributed over the ranks, after the plan: those that share a matrix
    /// together; none for bodies that stay whole.
    fn distributed(&self) -> Vec<Vec<usize>>;

    /// Whether the interpolation of a body from linear displacements is wanted, after the plan.
    fn wants_interpolation(&self, name: &str) -> bool;

    /// Makes a body, on the rank that owns it or a part of it, after its plan.
    ///
    /// # Errors
    /// PETSc's refusal of a matrix or an option value.
    fn make(&mut self, assembled: Assembled) -> Result<Box<dyn Body>>;

    /// A body of this name with the same K and contact rows, left by an earlier scene or leg on the rank that owns it.
    fn kept(&mut self, name: &str) -> Option<BodySlot>;
}

/// A body ready for its inner solver.
pub struct Assembled<'a> {
    /// Name in the scene.
    pub name: String,
    /// Space dimension: block size of the matrix.
    pub dimension: usize,
    /// K, f and supports: of all dofs, or of those of this rank.
    pub body: ElasticBody,
    /// How the dofs are distributed, if they are.
    pub distribution: Option<Distribution>,
    /// All contact rows of the body, pair by pair. Columns: its dofs, or those of the nodes that this rank knows.
    pub rows: Csr,
    /// Motions with hardly any strain in a few cells, for multigrid's near-null space: the rigid ones of the free body, in one of
    /// revolution those of its meridian. One vector of these dofs each.
    pub motions: &'a dyn Fn() -> Vec<Vec<f64>>,
    /// Those that its supports leave, of these dofs.
    pub left: Vec<FreeMotion>,
    /// Interpolation of its displacements from linear ones, if it was wanted. Rows: the dofs of `body`; columns: of this body alone, or of
    /// all where dofs are distributed.
    pub interpolation: Option<Interpolation>,
}
