//! Bodies: their elements, supports, springs and loads.

use super::elasticity::{Constants, ElasticitySpec, RegionSpec};
use super::order::Order;
use crate::error::{Located, Place};
use crate::expression::{Expression, Field};
use crate::petsc::{begins_options, is_family};

/// A body: a named group of cells, its elasticity, supports and loads; or, in a scene, as many bodies as its name, a
/// [pattern](super::pattern), stands for.
#[derive(Debug, Clone)]
pub struct BodySpec {
    /// Name of the physical group of cells; `[a-z][a-z0-9_]*` without words of PETSc's own (it is an option prefix).
    pub name: Located<String>,
    /// What it is made of.
    pub elasticity: ElasticitySpec,
    /// Parts of it that are made of something else.
    pub regions: Vec<RegionSpec>,
    /// Polynomial order.
    pub order: Order,
    /// Supports: prescribed displacement components on named groups.
    pub fix: Vec<Support>,
    /// Loads on named groups.
    pub load: Vec<Load>,
    /// Springs to the ground on named groups.
    pub spring: Vec<SpringSpec>,
    /// Body force density (x, y, z), if any.
    pub force: Option<[Field; 3]>,
    /// Factor of the body force at a step of a history; 1 without one.
    pub force_factor: f64,
    /// A known displacement to compare with, if any: as many components as the scene has dimensions, of x, y (z).
    pub exact: Option<Vec<Expression>>,
}

impl BodySpec {
    /// An isotropic body of linear elements on the group of cells of this name: Young's modulus (a stress, > 0) and Poisson's ratio in
    /// (-1, 0.5), numbers or functions of the place.
    #[track_caller]
    pub fn new(name: &str, young: impl Into<Field>, poisson: impl Into<Field>) -> Self {
        let constants = Constants::Isotropic { young: young.into(), poisson: poisson.into() };
        Self {
            name: Located::here(name),
            elasticity: ElasticitySpec { constants, axes: None, place: Place::here("young, poisson") },
            regions: Vec::new(),
            order: Order::P1,
            fix: Vec::new(),
            load: Vec::new(),
            spring: Vec::new(),
            force: None,
            force_factor: 1.0,
            exact: None,
        }
    }

    /// With elements of this order, not above that of the mesh.
    pub fn order(self, order: Order) -> Self {
        Self { order, ..self }
    }

    /// Prescribes displacements (x, y in the plane, x, y, z in space; a length each) on a boundary or at points; `None` leaves a
    /// component free.
    #[track_caller]
    pub fn fix<const N: usize>(mut self, on: &str, value: [Option<f64>; N]) -> Self {
        const { assert!(N <= 3, "displacements have three components at most") };
        let value = std::array::from_fn(|c| value.get(c).copied().flatten().map(Field::Constant));
        self.fix.push(Support { on: Located::here(on), value, normal: None, path: None, factor: 1.0 });
        self
    }

    /// Lets a plane surface slide in its plane: no displacement along its normal.
    #[track_caller]
    pub fn symmetry(mut self, on: &str) -> Self {
        let (on, value, normal) = (Located::here(on), [const { None }; 3], Some(Field::Constant(0.0)));
        self.fix.push(Support { on, value, normal, path: None, factor: 1.0 });
        self
    }

    /// Adds a load on a boundary: pressure or traction (stresses), or a total force.
    #[track_caller]
    pub fn load(mut self, on: &str, kind: LoadKind) -> Self {
        self.load.push(Load { on: Located::here(on), kind, path: None, factor: 1.0 });
        self
    }

    /// Adds a traction (x, y in the plane, x, y, z in space; stresses), numbers or functions of the place.
    #[track_caller]
    pub fn traction<const N: usize>(self, on: &str, traction: [impl Into<Field>; N]) -> Self {
        const { assert!(N <= 3, "tractions have three components at most") };
        let mut given = traction.into_iter().map(Into::into);
        self.load(on, LoadKind::Traction(std::array::from_fn(|_| given.next().unwrap_or(Field::Constant(0.0)))))
    }

    /// Adds a pressure against the outer normal (a stress, > 0 pushes), a number or a function of the place.
    #[track_caller]
    pub fn pressure(self, on: &str, pressure: impl Into<Field>) -> Self {
        self.load(on, LoadKind::Pressure(pressure.into()))
    }
}

/// Prescribed displacement components on a named group (a boundary, or points).
#[derive(Debug, Clone)]
pub struct Support {
    /// The physical group.
    pub on: Located<String>,
    /// Prescribed value of each component; `None` leaves it free.
    pub value: [Option<Field>; 3],
    /// Prescribed displacement along the outer normal of a plane surface.
    pub normal: Option<Field>,
    /// Name of its factor in a history.
    pub path: Option<Located<String>>,
    /// Factor of its values at a step of a history; 1 without one.
    pub factor: f64,
}

/// Springs to the ground on a named boundary (per area) or at points.
#[derive(Debug, Clone)]
pub struct SpringSpec {
    /// The physical group.
    pub on: Located<String>,
    /// How stiff they are.
    pub kind: SpringKind,
}

/// Kinds of springs; stiffnesses are >= 0.
#[derive(Debug, Clone)]
pub enum SpringKind {
    /// Stiffness along x, y, z.
    Vector([Field; 3]),
    /// Stiffness along the normal of the surface.
    Normal(Field),
}

/// A load on a named boundary.
#[derive(Debug, Clone)]
pub struct Load {
    /// The physical group.
    pub on: Located<String>,
    /// What acts there.
    pub kind: LoadKind,
    /// Name of its factor in a history.
    pub path: Option<Located<String>>,
    /// Its factor at a step of a history; 1 without one.
    pub factor: f64,
}

/// Kinds of boundary load.
#[derive(Debug, Clone)]
pub enum LoadKind {
    /// Pressure against the outer normal, > 0 pushes.
    Pressure(Field),
    /// Traction vector (x, y, z).
    Traction([Field; 3]),
    /// Force on the whole boundary.
    Force {
        /// The force (x, y, z).
        total: [f64; 3],
        /// Whether the boundary moves as one, by a translation; else the force is spread evenly.
        rigid: bool,
    },
}

/// What is wrong with a name that is not spelt like that of a body, and what to do about it.
pub const SPELLING: [&str; 2] =
    ["", "it is a prefix of PETSc options: a small letter, then small letters, digits and _"];

/// Most numbers in the name of a body: with four a solver's options take 24 times as long to look up, with eight 40 320 times, which is 14 s.
const MOST_NUMBERS: usize = 4;

/// Whether names of bodies may have this character.
pub fn is_in_name(c: char) -> bool {
    c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_'
}

/// Why a body cannot have this name, and what to do about it. A word of PETSc's own options is none, as the body could not have options
/// of its own; one that follows another would give it those of a solver inside that body's (`-brick_sub_ksp_type`).
pub fn fault(name: &str) -> Option<[&'static str; 2]> {
    if !name.starts_with(|c: char| c.is_ascii_lowercase()) || !name.chars().all(is_in_name) {
        return Some(SPELLING);
    }
    // PETSc looks an option up anew without each number between two `_`, and so on with those that are left: k! times for k of them
    let is_number = |word: &&str| !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_digit());
    if name.split('_').filter(is_number).count() > MOST_NUMBERS {
        return Some(["a name of more than four numbers", "join numbers by a letter: brick_1x2x3"]);
    }
    // `newton` begins those of all bodies together
    (begins_options(name) || name.split('_').any(is_family) || name == "newton")
        .then_some(["a word of PETSc's own options", "choose another name, also for the physical group in the mesh"])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_of_names() {
        for name in
            ["ksp", "mg", "snes", "is", "log", "options", "help", "viewer", "mumps", "newton", "brick_sub", "a_pc_b"]
        {
            assert!(fault(name).is_some_and(|[label, _]| label.contains("PETSc")), "{name}");
        }
        for name in ["", "2up", "up-per", "üb", "a b", "Upper"] {
            assert_eq!(fault(name), Some(SPELLING), "{name}");
        }
        assert_eq!(["punch", "upper2", "brick_17", "subway_log", "b_1_22_3_4"].map(fault), [None; 5]);
        assert!(fault("b_1_2_3_4_5").is_some_and(|[label, _]| label.contains("four numbers")));
    }
}
