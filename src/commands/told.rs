//! Errors that were told of a mesh, held against the next one.

use super::carry::{self, Norms};
use crate::estimate::Estimate;
use crate::output::ContactTable;

/// The errors told of a mesh.
pub struct Told {
    /// Relative errors of the pressures, one for each pair.
    pressure: Vec<f64>,
    /// Relative error of the normal displacements.
    displacement: f64,
    /// The solution on the mesh.
    tables: Vec<ContactTable>,
}

impl Told {
    /// Those of an estimate and a solution.
    pub fn new(estimate: &Estimate, tables: Vec<ContactTable>) -> Self {
        Self { pressure: estimate.pressure.clone(), displacement: estimate.displacement, tables }
    }

    /// Hold the estimate of the next mesh, with the solution `tables`, against what that differs from the one here.
    ///
    /// Errors that were told right, e of the next mesh and e' of this one, leave a difference of e + e' at most. Where it is larger, both were told too small, and
    /// e becomes as much larger as the difference is. Surfaces that are paired by themselves may be other pairs on another mesh, which are not compared.
    pub fn hold(&self, tables: &[ContactTable], estimate: &mut Estimate) {
        if !self.tables.iter().map(bodies).eq(tables.iter().map(bodies)) {
            return;
        }
        let apart = carry::difference(&self.tables, tables);
        for (now, (before, norms)) in estimate.pressure.iter_mut().zip(self.pressure.iter().zip(&apart.pressure)) {
            *now *= excess(norms, *now, *before);
        }
        estimate.displacement *= excess(&apart.displacement, estimate.displacement, self.displacement);
    }
}

/// The bodies of a pair, whichever carries the points.
fn bodies(table: &ContactTable) -> [&str; 2] {
    let mut names = table.side_names.each_ref().map(String::as_str);
    names.sort_unstable();
    names
}

/// How many times a difference is larger than the relative errors told `now` and `before` explain, at least one.
fn excess(norms: &Norms, now: f64, before: f64) -> f64 {
    let most = now * norms.new + before * norms.old;
    if most > 0.0 && norms.apart.is_finite() { (norms.apart / most).max(1.0) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::{Norms, excess};

    #[test]
    fn a_difference_that_errors_explain_changes_none() {
        let norms = |apart| Norms { apart, old: 2.0, new: 1.0 };
        assert_eq!([0.1, 0.5, 1.0].map(|apart| excess(&norms(apart), 0.1, 0.2)), [1.0, 1.0, 2.0]);
        assert_eq!([excess(&norms(0.1), 0.0, 0.0), excess(&norms(f64::NAN), 0.1, 0.1)], [1.0, 1.0]);
    }
}
