//! Several ranks, and the binding of PETSc.

#[path = "../common/mod.rs"]
mod common;

mod mpi;
mod petsc;
mod ranks;
