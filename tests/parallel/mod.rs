//! Several ranks, and the binding of PETSc.

mod mpi;
mod petsc;
mod ranks;
