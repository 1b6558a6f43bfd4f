//! What a run has at its end: displacements of its bodies, and what the last look says of them.

use crate::ddm::{Reached, Whose};
use crate::discretize::BodyInfo;
use crate::error::{Error, Result};
use crate::output::BodyField;
use std::cell::OnceCell;

/// The end of a run in one body that this rank has a part of.
pub struct Recovered {
    /// Displacements of the nodes that this rank knows.
    pub state: Vec<f64>,
    /// The same without the rigid motions that supports leave or carry the body by, which strain nothing.
    pub bent: Vec<f64>,
    field: OnceCell<BodyField>,
}

impl Recovered {
    /// From displacements of the nodes, and those without rigid motion.
    pub fn new(state: Vec<f64>, bent: Vec<f64>) -> Self {
        Self { state, bent, field: OnceCell::new() }
    }

    /// Displacements and stresses of the cells that this rank shows, made when they are first asked for.
    pub fn field(&self, info: &BodyInfo) -> &BodyField {
        self.field.get_or_init(|| info.post().field(&self.state, &self.bent))
    }
}

/// The end of a run in every body: none for those of other ranks, and the failure of a solver that should have found the
/// interior of a body.
pub type All = Vec<Option<Result<Recovered>>>;

/// A share of all of this.
pub fn scaled(all: &All, share: f64) -> All {
    let times = |v: &[f64]| v.iter().map(|u| share * u).collect();
    let of_body = |recovered: &Result<Recovered>| match recovered {
        Ok(Recovered { state, bent, .. }) => Ok(Recovered::new(times(state), times(bent))),
        Err(error) => Err(Error::new(error.kind(), error.message())),
    };
    all.iter().map(|recovered| recovered.as_ref().map(of_body)).collect()
}

/// What the last look found.
#[derive(Debug, Clone)]
pub struct Look {
    /// Relative errors.
    pub reached: Reached,
    /// Where the largest is.
    pub whose: Whose,
    /// Wall seconds that it took.
    pub seconds: f64,
}
