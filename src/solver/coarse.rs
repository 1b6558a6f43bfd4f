//! The [coarse space](crate::model::coarse) of rigid motions around a preconditioner of the matrix of all bodies.

use crate::error::Result;
use crate::linalg::Csr;
use crate::model::Model;
use crate::model::coarse::{Coarse, Space};
use crate::petsc::Subspace;
use std::rc::Rc;

/// The coarse space, of the rows of this rank.
pub struct RigidSpace {
    space: Rc<Space>,
    /// B of the rows of A here: a row a contact point.
    rows: Csr,
}

impl RigidSpace {
    /// Of the bodies of a model, whose rows begin at `offset` in a vector here; `rows` are B of all bodies together and `first` is the number
    /// of the first row here. `None` if no two bodies in contact move freely: what moves alone is no frame.
    pub fn of(model: &Model, offset: &[usize], rows: &Csr, first: usize) -> Option<Self> {
        let mut sides = vec![0; model.pairs.len()];
        for slot in model.bodies.iter().filter(|slot| !slot.motions.is_empty()) {
            slot.segments.iter().for_each(|segment| sides[segment.pair] += 1);
        }
        if !sides.contains(&2) {
            return None;
        }
        let mut here = Csr::new(offset[offset.len() - 1]);
        let own = |(i, b): (usize, f64)| Some((i.checked_sub(first)?, b)).filter(|(i, _)| *i < here.columns);
        let own: Vec<Vec<(usize, f64)>> = (0..rows.rows()).map(|q| rows.row(q).filter_map(own).collect()).collect();
        own.into_iter().for_each(|row| here.push_row(row));
        Some(Self { space: Rc::new(Space::of(model, Some(offset))), rows: here })
    }

    /// The space for these springs, one entry a contact point.
    pub fn with(self: &Rc<Self>, springs: &[f64]) -> Box<dyn Subspace> {
        Box::new(Sprung { coarse: Coarse::new(self.space.clone(), springs), around: self.clone() })
    }
}

struct Sprung {
    coarse: Coarse,
    around: Rc<RigidSpace>,
}

impl Subspace for Sprung {
    fn start(&self, r: &mut [f64], x: &mut [f64]) -> Result<()> {
        let (y, _) = self.coarse.solve(&[&*r]);
        self.coarse.add(1.0, &y, &mut [x]);
        self.around.rows.add_transpose(-1.0, &self.coarse.forces(&y), r);
        Ok(())
    }

    fn project(&self, z: &mut [f64]) -> Result<()> {
        let mut closing = vec![0.0; self.around.rows.rows()];
        self.around.rows.multiply(z, &mut closing);
        self.coarse.add(-1.0, &self.coarse.part(&closing, true), &mut [z]);
        Ok(())
    }
}
