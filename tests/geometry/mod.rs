//! Meshes, shapes and surfaces: what is read, what is refused, and what lies opposite what.

mod chords;
mod curved;
mod digits;
mod ends;
mod fits;
mod foreign;
mod gmsh;
mod leaning;
mod meshes;
mod normals;
mod patterns;
mod pieces;
mod quadratic;
mod round;
mod segments;
mod surfaces;
