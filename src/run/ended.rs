//! The end of a run: displacements of its bodies, and the errors that the last look found.

use crate::ddm::{Reached, Whose};
use crate::discretize::BodyInfo;
use crate::error::{Error, Result};
use crate::output::BodyField;
use std::cell::OnceCell;

/// The displacements of a body at the end of a run, on a rank that has nodes of it.
pub struct Recovered {
    /// Displacements of the owned and ghost nodes, one entry per dof.
    pub state: Vec<f64>,
    /// Displacements without the rigid motions that supports leave or impose, which cause no strain.
    pub bent: Vec<f64>,
    field: OnceCell<BodyField>,
}

impl Recovered {
    /// Store displacements of the nodes, and those without rigid motion.
    pub fn new(state: Vec<f64>, bent: Vec<f64>) -> Self {
        Self { state, bent, field: OnceCell::new() }
    }

    /// Return displacements and stresses on the cells that this rank writes. They are computed at the first call.
    pub fn field(&self, info: &BodyInfo) -> &BodyField {
        self.field.get_or_init(|| info.post().field(&self.state, &self.bent))
    }
}

/// The displacements of every body: none for bodies of other ranks, or the failure of the solver that recovers the interior.
pub type All = Vec<Option<Result<Recovered>>>;

/// Return the displacements of all bodies, multiplied by a factor.
pub fn scaled(all: &All, factor: f64) -> All {
    let times = |v: &[f64]| v.iter().map(|u| factor * u).collect();
    let scaled = |recovered: &Result<Recovered>| match recovered {
        Ok(Recovered { state, bent, .. }) => Ok(Recovered::new(times(state), times(bent))),
        Err(error) => Err(Error::new(error.kind(), error.message())),
    };
    all.iter().map(|recovered| recovered.as_ref().map(scaled)).collect()
}

/// The errors that the last look found.
#[derive(Debug, Clone)]
pub struct Look {
    /// Relative errors.
    pub reached: Reached,
    /// Body or pair with the largest error.
    pub whose: Whose,
    /// Wall seconds of the last look.
    pub seconds: f64,
}
