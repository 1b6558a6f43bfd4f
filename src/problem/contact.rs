//! Pairs of contact surfaces.

use super::layer::LayerSpec;
use crate::error::Located;
use crate::expression::Field;

/// The default of the largest angle, in degrees, between the normals of facets that face each other. At this angle a normal meets the
/// other surface at most at twice its distance, and a facet covers at most twice its own area there. Both tend to infinity as the angle
/// grows to a right one.
pub const ANGLE: f64 = 60.0;

/// The default of the angle, in degrees, beyond which two facets meet at an edge. Twelve chords of a circle, the coarsest mesh of a round
/// part, turn by 30 degrees each. A chamfer turns by 45 degrees. This angle is in between.
pub const EDGE: f64 = 40.0;

/// A pair of contact surfaces and the layer between them.
#[derive(Debug, Clone)]
pub struct ContactSpec {
    /// The two physical groups.
    pub between: [Located<String>; 2],
    /// Gap (a length) that is added to the distance of the meshes; zero by default.
    pub gap: Field,
    /// Largest angle between the normal of one facet and minus that of the other, in degrees, > 0 and at most 90.
    pub angle: f64,
    /// Largest angle in degrees by which facets turn within a face of a surface, > 0 and at most 180. Surfaces that turn by more are split
    /// at this edge, and their faces form pairs of their own.
    pub edge: f64,
    /// Largest distance (a length, > 0) of facets that face each other; any distance if `None`.
    pub distance: Option<f64>,
    /// Law of the layer.
    pub layer: LayerSpec,
    /// Whether the surfaces are assumed to touch wherever they face each other. Then only [`ContactSpec::gap`] counts, not the distance
    /// of the meshes.
    pub touching: bool,
    /// What to do about surfaces that overlap before loading.
    pub overlap: Overlap,
    /// A known contact pressure (a stress) to draw and to compare with, if any.
    pub reference: Option<Field>,
    /// Number of the table in the scene, from 0.
    pub table: usize,
}

impl ContactSpec {
    /// Return a pair of named surfaces of different bodies, with a layer between them. The gap is the distance of the meshes.
    #[track_caller]
    pub fn new(first: &str, second: &str, layer: LayerSpec) -> Self {
        Self {
            between: [Located::here(first), Located::here(second)],
            gap: Field::Constant(0.0),
            angle: ANGLE,
            edge: EDGE,
            distance: None,
            layer,
            touching: false,
            overlap: Overlap::Compress,
            reference: None,
            table: 0,
        }
    }

    /// Set the gap (a length) that is added to the distance of the meshes, a number or a function of the coordinates.
    pub fn gap(self, gap: impl Into<Field>) -> Self {
        Self { gap: gap.into(), ..self }
    }
}

/// A rule that finds pairs: contact of all bodies that lie near each other. A [`ContactSpec`] that names surfaces of two bodies, and a
/// narrower rule, take precedence.
#[derive(Debug, Clone)]
pub struct AutoContact {
    /// Names or patterns of bodies. A body that matches the first and one that matches the second form a pair. All bodies if `None`.
    pub of: Option<[Located<String>; 2]>,
    /// The settings of each pair. Its `between` is a stand-in for the names of the two bodies.
    pub contact: ContactSpec,
}

/// What to do about surfaces that overlap before loading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Overlap {
    /// The overlap compresses the layer, and the run warns.
    Compress,
    /// The scene is refused.
    Refuse,
}

impl Overlap {
    /// All choices with their names in the scene.
    pub const ALL: [(&'static str, Overlap); 2] = [("compress", Overlap::Compress), ("error", Overlap::Refuse)];
}
