//! The places of a mesh that the page of a run marks.

/// What acts at a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    Support,
    Load,
    Spring,
    /// A contact surface, which is closed or open.
    Contact,
}

/// A group of the mesh with what acts on it.
#[derive(Debug, Clone)]
pub struct Mark {
    pub role: Role,
    /// Name of the group.
    pub on: String,
    /// Index of the body.
    pub body: usize,
    /// Corners of a simplex: 1 for points, 2 for lines, 3 for triangles.
    pub corners: usize,
    /// Points of the mesh of each simplex, corners first.
    pub simplices: Vec<Vec<u32>>,
}
