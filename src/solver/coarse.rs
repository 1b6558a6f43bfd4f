//! The rigid motions of all bodies as a coarse space around a preconditioner of PETSc.

use crate::error::Result;
use crate::linalg::Csr;
use crate::model::Model;
use crate::model::rigid::{CoarseOperator, CoarseSpace};
use crate::petsc::Subspace;
use std::rc::Rc;

/// The [coarse space](crate::model::rigid::CoarseOperator) of rigid motions of all bodies, in the rows of the matrix that this rank owns.
pub struct RigidSpace {
    space: Rc<CoarseSpace>,
    /// The columns of B that this rank owns; one row a contact point.
    rows: Csr,
}

impl RigidSpace {
    /// Return the space for the bodies of a model, or `None` if no two bodies in contact can both move freely. Then no bodies move together, and the space
    /// would save nothing. `offset` is the first entry of each body in a vector of this rank, and its length. `rows` are B of all
    /// bodies together, and `first` is the number of the first row that this rank owns.
    pub fn of(model: &Model, offset: &[usize], rows: &Csr, first: usize) -> Option<Self> {
        let mut free_sides = vec![0; model.pairs.len()];
        for slot in model.bodies.iter().filter(|slot| !slot.motions.is_empty()) {
            slot.segments.iter().for_each(|segment| free_sides[segment.pair] += 1);
        }
        if !free_sides.contains(&2) {
            return None;
        }
        let columns = offset[offset.len() - 1];
        let owned = rows.of_columns(columns, |i| i.checked_sub(first).filter(|i| *i < columns));
        Some(Self { space: Rc::new(CoarseSpace::of(model, Some(offset))), rows: owned })
    }

    /// Return the space for these spring stiffnesses, one a contact point.
    pub fn with(self: &Rc<Self>, springs: &[f64]) -> Box<dyn Subspace> {
        Box::new(WithSprings { coarse: CoarseOperator::new(self.space.clone(), springs), rigid: self.clone() })
    }
}

/// The space of rigid motions for one set of springs.
struct WithSprings {
    coarse: CoarseOperator,
    rigid: Rc<RigidSpace>,
}

impl Subspace for WithSprings {
    fn correct(&self, r: &[f64], z: &mut [f64]) -> Result<()> {
        let mut closing = vec![0.0; self.rigid.rows.rows()];
        self.rigid.rows.multiply(z, &mut closing);
        self.coarse.add(1.0, &self.coarse.correction(r, &closing), &mut [z]);
        Ok(())
    }
}
