//! Pairs of contact surfaces.

use super::layer::LayerSpec;
use crate::error::Located;
use crate::expression::Field;
use crate::setting::{keys, words};

keys! {
    /// A pair of contact surfaces and the layer between them.
    #[derive(Debug, Clone)]
    pub struct ContactSpec "[[contact]]" {
        required {
            /// write between = ["one", "other"], or between = "auto" with a distance
            ///
            /// The two physical groups. In a rule that finds pairs both are the word "auto".
            pub between: [Located<String>; 2],
            /// give power = { B = 2.5e-5, a = 0.5 } or linear = { stiffness = 1e5 }
            ///
            /// Law of the layer.
            pub layer: LayerSpec,
        }
        optional {
            /// how far apart facets of a pair may be; required with "auto"
            ///
            /// Largest distance (a length, > 0) of facets that face each other; any distance if `None`.
            pub distance: Option<f64> = None,
            /// gap besides the distance of the meshes
            ///
            /// Gap (a length) that is added to the distance of the meshes.
            pub gap: Field = Field::Constant(0.0),
            /// largest angle in degrees between normals that face each other
            ///
            /// Largest angle between the normal of one facet and minus that of the other, > 0 and at most 90.
            ///
            /// With the default a normal meets the other surface at most at twice its distance, and a facet covers at most twice its own
            /// area there. Both tend to infinity as the angle grows to a right one.
            pub angle: f64 = 60.0,
            /// angle in degrees beyond which facets meet at an edge that splits a surface
            ///
            /// It is > 0 and at most 180. Faces on both sides of an edge form pairs of their own.
            ///
            /// Twelve chords of a circle, the coarsest mesh of a round part, turn by 30 degrees each. A chamfer turns by 45 degrees. The
            /// default is in between.
            pub edge: f64 = 40.0,
            /// whether the distance of the meshes counts as zero
            ///
            /// Then the surfaces are assumed to touch wherever they face each other, and only [`ContactSpec::gap`] counts.
            pub touching: bool = false,
            /// what to do where bodies overlap before loading
            pub overlap: Overlap = Overlap::Compress,
            /// known contact pressure to draw and to compare with
            pub reference: Option<Field> = None,
        }
        initially {
            /// Number of the table in the scene, from 0.
            pub table: usize = 0,
        }
    }
}

impl ContactSpec {
    /// Return a pair of named surfaces of different bodies, with a layer between them. The gap is the distance of the meshes.
    #[track_caller]
    pub fn new(first: &str, second: &str, layer: LayerSpec) -> Self {
        Self::with_defaults([Located::here(first), Located::here(second)], layer)
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

words! {
    /// What to do about surfaces that overlap before loading.
    pub enum Overlap "overlap" {
        /// The overlap compresses the layer, and the run warns.
        Compress = "compress",
        /// The scene is refused.
        Refuse = "error",
    }
}
