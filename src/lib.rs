//! Frictionless contact of elastic bodies through nonlinear Winkler layers, by Newton's method or Robin-Robin domain
//! decomposition on PETSc.
//!
//! Programs use [`api`] (a scene built in Rust, solved, read as arrays) and [`petsc`] (the binding, useful alone). The
//! errors of both are in [`error`]; [`cli`] is the command line. Other modules are private. `internals`, which rustdoc
//! does not show, has those of their items that the tests use; these items change without notice.
//!
//! Data flows one way: scene file -> `scene::Scene`, made of the types in `problem` -> `mesh::Mesh` -> `fem` bodies and
//! `contact` pairs -> `model::Model` -> sweeps of `robin` -> `ddm::Outcome` -> `run::report`. The loops are those of
//! `ddm`.
#![deny(unsafe_code)]
// indices of tensors, rows and nodes read like the formulas
#![allow(clippy::needless_range_loop)]
#![warn(missing_docs)]
// the pages of `internals` are hidden; readers of the source follow their links
#![allow(rustdoc::private_intra_doc_links)]

pub mod api;
pub mod cli;
mod commands;
mod contact;
mod data;
mod ddm;
mod discretize;
pub mod error;
mod estimate;
mod exchange;
mod expression;
mod fem;
mod file;
#[doc(hidden)]
pub mod internals;
mod interrupt;
mod linalg;
mod mesh;
mod model;
mod output;
mod page;
mod parallel;
#[allow(unsafe_code)]
pub mod petsc;
mod problem;
mod robin;
mod run;
mod scene;
mod solver;
