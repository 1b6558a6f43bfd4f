//! Frictionless contact of N elastic bodies through nonlinear Winkler layers, by Robin-Robin domain decomposition.
//!
//! Programs use [`api`] (a scene built in Rust, solved, read as arrays) and [`petsc`] (the binding, useful alone). All other modules are
//! public for the tests and for whoever reads on; they change without notice. The feature `cli`, which is on by default, is the command
//! line.
//!
//! Data flows one way: scene file -> [`scene::Scene`], made of the types in [`problem`] -> [`mesh::Mesh`] ->
//! [`fem`] bodies and [`contact`] pairs -> [`model::Model`] -> sweeps of [`robin`] -> [`ddm::Outcome`] -> [`run::report`].
//! The loops are those of [`ddm`].
#![deny(unsafe_code)]
// indices of tensors, rows and nodes read like the formulas
#![allow(clippy::needless_range_loop)]
#![warn(missing_docs)]

pub mod api;
#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "cli")]
pub mod commands;
pub mod contact;
pub mod data;
pub mod ddm;
pub mod discretize;
pub mod error;
pub mod estimate;
pub mod exchange;
pub mod expression;
pub mod fem;
pub mod file;
pub mod interrupt;
pub mod linalg;
pub mod mesh;
pub mod model;
pub mod output;
pub mod parallel;
#[allow(unsafe_code)]
pub mod petsc;
pub mod problem;
#[cfg(feature = "cli")]
pub mod report;
pub mod robin;
pub mod run;
pub mod scene;
mod setting;
pub mod solver;
