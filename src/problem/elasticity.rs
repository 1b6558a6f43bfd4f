//! What bodies are made of: elastic constants and their axes.

use crate::error::{Located, Place};
use crate::expression::Field;

/// Elastic constants of a body or of one of its regions, in axes of their own.
#[derive(Debug, Clone)]
pub struct ElasticitySpec {
    /// The constants.
    pub constants: Constants,
    /// Axes 1, 2, 3 that they belong to; x, y, z if there are none.
    pub axes: Option<AxesSpec>,
    /// Where the constants stand.
    pub place: Place,
}

/// Elastic constants, each a number or an expression.
#[derive(Debug, Clone)]
pub enum Constants {
    /// Young's modulus and Poisson's ratio.
    Isotropic {
        /// Young's modulus, > 0.
        young: Field,
        /// Poisson's ratio, in (-1, 0.5).
        poisson: Field,
    },
    /// E1 E2 E3 nu12 nu13 nu23 G12 G13 G23.
    Orthotropic(Box<[Field; 9]>),
    /// C11 C12 ... C16 C22 ... C66: upper triangle in Voigt's order 11 22 33 23 13 12.
    Anisotropic(Box<[Field; 21]>),
}

/// Directions of the material's axes.
#[derive(Debug, Clone)]
pub enum AxesSpec {
    /// Along axis 1, and towards axis 2 (in the plane by default a right angle to the left of axis 1).
    Directions {
        /// Direction of axis 1.
        first: [Field; 3],
        /// A vector in the plane of axes 1 and 2, on the side of axis 2.
        second: Option<[Field; 3]>,
    },
    /// x, y, z turned by an angle (radian) about an axis.
    Angle {
        /// The angle.
        angle: Field,
        /// The axis; z in plane problems.
        axis: [Field; 3],
    },
}

/// A part of a body with constants of its own.
#[derive(Debug, Clone)]
pub struct RegionSpec {
    /// Physical group of its cells.
    pub on: Located<String>,
    /// Its constants.
    pub elasticity: ElasticitySpec,
}

impl Constants {
    /// Names of the orthotropic constants.
    pub const ORTHOTROPIC: [&'static str; 9] = ["E1", "E2", "E3", "nu12", "nu13", "nu23", "G12", "G13", "G23"];
}

impl ElasticitySpec {
    /// All constants and directions by name.
    pub fn fields(&self) -> Vec<(&'static str, &Field)> {
        let mut fields: Vec<(&str, &Field)> = match &self.constants {
            Constants::Isotropic { young, poisson } => vec![("young", young), ("poisson", poisson)],
            Constants::Orthotropic(fields) => Constants::ORTHOTROPIC.into_iter().zip(fields.iter()).collect(),
            Constants::Anisotropic(fields) => fields.iter().map(|field| ("an elastic constant", field)).collect(),
        };
        match &self.axes {
            Some(AxesSpec::Directions { first, second }) => {
                fields.extend(first.iter().map(|field| ("`first`", field)));
                fields.extend(second.iter().flatten().map(|field| ("`second`", field)));
            }
            Some(AxesSpec::Angle { angle, axis }) => {
                fields.push(("angle", angle));
                fields.extend(axis.iter().map(|field| ("`axis`", field)));
            }
            None => {}
        }
        fields
    }

    /// Whether nothing depends on the place.
    pub fn is_constant(&self) -> bool {
        self.fields().iter().all(|(_, field)| field.is_constant())
    }
}

/// What the plane of a plane problem stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plane {
    /// No out-of-plane strain.
    Strain,
    /// No out-of-plane stress.
    Stress,
    /// A meridian of bodies of revolution: x is the radius, y runs along the axis.
    Axisymmetric,
}

impl Plane {
    /// The choices with their names in the scene.
    pub const ALL: [(&'static str, Plane); 3] =
        [("strain", Plane::Strain), ("stress", Plane::Stress), ("axisymmetric", Plane::Axisymmetric)];
}
