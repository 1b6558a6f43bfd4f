//! Elastic constants of bodies, and the axes that they refer to.

use super::pattern::pattern;
use crate::error::{Located, Place};
use crate::expression::Field;
use crate::setting::{keys, words};

/// The elastic constants of a body, or of one of its regions, and their axes.
#[derive(Debug, Clone)]
pub struct ElasticitySpec {
    /// The constants.
    pub constants: Constants,
    /// Axes 1, 2, 3 of the material; x, y, z if `None`.
    pub axes: Option<AxesSpec>,
    /// Place of the constants.
    pub place: Place,
}

/// The elastic constants, each a number or an expression. Moduli are stresses; Poisson's ratios have no unit.
#[derive(Debug, Clone)]
pub enum Constants {
    /// Young's modulus and Poisson's ratio.
    Isotropic {
        /// Young's modulus, > 0.
        young: Field,
        /// Poisson's ratio, in (-1, 0.5).
        poisson: Field,
    },
    /// E1 E2 E3 nu12 nu13 nu23 G12 G13 G23: nu12 is the contraction along axis 2 under tension along axis 1.
    Orthotropic(Box<[Field; 9]>),
    /// C11 C12 ... C16 C22 ... C66: the upper triangle of C by rows, in Voigt's order 11 22 33 23 13 12.
    Anisotropic(Box<[Field; 21]>),
}

/// The directions of the material's axes.
#[derive(Debug, Clone)]
pub enum AxesSpec {
    /// A direction along axis 1, and one towards axis 2.
    Directions {
        /// Direction of axis 1.
        first: [Field; 3],
        /// A vector in the plane of axes 1 and 2, on the side of axis 2. Without it, in plane problems, axis 2 is at a right angle to the
        /// left of axis 1.
        second: Option<[Field; 3]>,
    },
    /// The axes x, y, z, turned about an axis.
    Angle {
        /// The angle, in radians.
        angle: Field,
        /// The axis; z in plane problems.
        axis: [Field; 3],
    },
}

keys! {
    /// A part of a body with constants of its own.
    #[derive(Debug, Clone)]
    pub struct RegionSpec "[[body.region]]" {
        required {
            /// group of its cells
            pub on: Located<String> => pattern,
        }
        besides {
            /// The constants of this part.
            pub elasticity: ElasticitySpec,
        }
    }
}

impl Constants {
    /// The names of the orthotropic constants.
    pub const ORTHOTROPIC: [&'static str; 9] = ["E1", "E2", "E3", "nu12", "nu13", "nu23", "G12", "G13", "G23"];
}

impl ElasticitySpec {
    /// Return all constants and directions, with their names in messages.
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

    /// Return whether no constant and no direction depends on the coordinates.
    pub fn is_constant(&self) -> bool {
        self.fields().iter().all(|(_, field)| field.is_constant())
    }
}

words! {
    /// What a plane problem stands for.
    pub enum Plane "plane" {
        /// No out-of-plane strain.
        Strain = "strain",
        /// No out-of-plane stress.
        Stress = "stress",
        /// A meridian of bodies of revolution: x is the radius, y runs along the axis.
        Axisymmetric = "axisymmetric",
    }
}
