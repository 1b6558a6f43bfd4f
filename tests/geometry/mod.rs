//! Meshes, shapes and surfaces: what is read, what is refused, and what lies opposite what.

mod curved;
mod ends;
mod fits;
mod foreign;
mod gmsh;
mod meshes;
mod normals;
mod patterns;
mod pieces;
mod quadratic;
mod round;
mod surfaces;
