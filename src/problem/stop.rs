//! The rules that stop a run.

use crate::error::Result;
use crate::setting::{Context, Keys, Node, Setting, ValueKind, keys};
use serde_json::Value as Json;

keys! {
    /// The rules that stop a run. At least one of `residual` and `increment` is given. The first rule that is met ends the run.
    #[derive(Debug, Clone, PartialEq)]
    pub struct StopRule "the stop rule" {
        optional {
            /// relative residual, or error of Newton's method
            ///
            /// Tolerance of the relative residual of sweeps, or of the largest relative error of Newton's method (docs/theory.md). In a
            /// scene file there is no default if `increment` is given.
            pub residual: Option<f64> = Some(1e-8),
            /// the paper's rule on the increment
            ///
            /// Tolerance of the relative increment of normal displacements, in every body.
            pub increment: Option<f64> = None,
            /// whether a tenth of the mesh's error is enough
            ///
            /// The run then stops where the error of the iteration is a tenth of the error of the discretisation.
            pub balanced: bool = false,
            /// most iterations
            pub iterations: usize = 2000,
        }
    }
}

impl Default for StopRule {
    fn default() -> Self {
        Self::with_defaults()
    }
}

impl Setting for StopRule {
    fn kind() -> ValueKind {
        Self::shape().into()
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        let stop = Self::decode(&Keys::open(node, &Self::shape())?, context)?;
        let by_increment = stop.increment.is_some() && !node.has_key("residual");
        Ok(Self { residual: stop.residual.filter(|_| !by_increment), ..stop })
    }

    fn echo(&self, dimension: usize) -> Json {
        let mut entries = self.entries(dimension);
        if !self.balanced {
            entries.remove("balanced");
        }
        entries.into()
    }
}

impl StopRule {
    /// Return the tolerance that relative errors inside a run refer to. It is that of the residual, or the square root of machine epsilon
    /// where the increment alone ends the run.
    pub fn tolerance(&self) -> f64 {
        self.residual.unwrap_or(f64::EPSILON.sqrt())
    }

    /// Return whether an iterate meets a rule. `residual` and `increment` are relative; the increment is NaN before the first update.
    pub fn is_met(&self, residual: f64, increment: f64) -> bool {
        self.residual.is_some_and(|tolerance| residual <= tolerance)
            || self.increment.is_some_and(|tolerance| increment <= tolerance)
    }
}
