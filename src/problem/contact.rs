//! Pairs of contact surfaces.

use super::layer::LayerSpec;
use crate::error::Located;
use crate::expression::Field;

/// Largest angle between the normals of facets that face each other, in degrees, unless a scene says otherwise. A normal then meets
/// the other surface at most twice as far away as that is, and covers at most twice its own area there; beyond, both run to
/// infinity.
pub const ANGLE: f64 = 60.0;

/// A pair of contact surfaces and the layer between them.
#[derive(Debug, Clone)]
pub struct ContactSpec {
    /// The two physical groups.
    pub between: [Located<String>; 2],
    /// The scene's own gap d(x), added to the geometric distance; zero if not given.
    pub gap: Field,
    /// Largest angle between the normal of one facet and minus that of the other, in degrees, > 0 and at most 90.
    pub angle: f64,
    /// Law of the layer.
    pub layer: LayerSpec,
    /// Whether the surfaces are taken to touch wherever they face each other: only [`ContactSpec::gap`] counts, not the
    /// distance of the meshes.
    pub touching: bool,
    /// What to do about surfaces that overlap before loading.
    pub overlap: Overlap,
    /// A known contact pressure to draw and compare with, if any.
    pub reference: Option<Field>,
    /// Number of its table in the scene.
    pub table: usize,
}

impl ContactSpec {
    /// Two named surfaces of different bodies and the layer between them; the gap is the distance of the meshes.
    #[track_caller]
    pub fn new(first: &str, second: &str, layer: LayerSpec) -> Self {
        Self {
            between: [Located::here(first), Located::here(second)],
            gap: Field::Constant(0.0),
            angle: ANGLE,
            layer,
            touching: false,
            overlap: Overlap::Compress,
            reference: None,
            table: 0,
        }
    }

    /// With a gap (a length), a number or a function of the place, besides the distance of the meshes.
    pub fn gap(self, gap: impl Into<Field>) -> Self {
        Self { gap: gap.into(), ..self }
    }
}

/// Contact of all bodies that come near each other, where no [`ContactSpec`] names surfaces of the two and no narrower rule holds.
#[derive(Debug, Clone)]
pub struct AutoContact {
    /// Largest distance of facets that form a pair, > 0.
    pub distance: f64,
    /// Names or patterns of the bodies: one of the first and one of the second form a pair. All bodies if `None`.
    pub of: Option<[Located<String>; 2]>,
    /// What holds for each pair; `between` is to be replaced by the names of the bodies.
    pub contact: ContactSpec,
}

/// What to do about surfaces that overlap before loading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Overlap {
    /// The layer takes it as compression, with a warning.
    Compress,
    /// The scene is refused.
    Refuse,
}

impl Overlap {
    /// The choices with their names in the scene.
    pub const ALL: [(&'static str, Overlap); 2] = [("compress", Overlap::Compress), ("error", Overlap::Refuse)];
}
