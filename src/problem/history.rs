//! Histories of loads: factors of loads and prescribed displacements, step by step.
//!
//! A line of the scene (a load or a support) with a `path` takes the factor of that name. A leg is a series of consecutive steps whose
//! factors are positive multiples of each other. On a leg all loads have one common factor, the share, so that nothing is assembled anew.

use super::body::{BodySpec, LoadKind};
use crate::error::Located;
use crate::expression::Field;
use std::ops::Range;
use std::path::PathBuf;

/// The name of the factor of all lines without a `path`.
pub const COMMON: &str = "factor";

/// The factors of loads and prescribed displacements, step by step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct History {
    /// Names of the factors.
    pub names: Vec<String>,
    /// The steps. Without steps there is one run under the full loads.
    pub steps: Vec<Step>,
    /// The file of the table of factors, if there is one.
    pub table: Option<Located<PathBuf>>,
    /// Whether some loads have no factor and stay constant.
    pub constant: bool,
    /// Number of steps that were solved before this process started.
    pub begun: usize,
}

/// A step of a history.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Time; it increases from step to step.
    pub time: f64,
    /// One factor for each name of the history.
    pub factors: Vec<f64>,
}

impl History {
    /// Return a history in which all loads have the same factors `shares`, at times 1, 2, ...
    pub fn of_shares(shares: Vec<f64>) -> Self {
        let step = |(number, share): (usize, f64)| Step { time: (number + 1) as f64, factors: vec![share] };
        let steps = shares.into_iter().enumerate().map(step).collect();
        Self { names: vec![COMMON.to_owned()], steps, ..Self::default() }
    }

    /// Return whether there are no steps, but one run under the full loads.
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// Return whether the factors come from a table. Lines then may have factors of their own, and the last step need not be the full load.
    pub fn is_table(&self) -> bool {
        self.table.is_some()
    }

    /// Return the leg of a step: the steps around it with proportional loads.
    pub fn leg(&self, step: usize) -> Range<usize> {
        let is_proportional = |other: &usize| self.ratio(*other, step).is_some();
        let begin = (0..step).rev().take_while(is_proportional).last().unwrap_or(step);
        let end = (step..self.steps.len()).take_while(is_proportional).last().map_or(step, |last| last + 1);
        begin..end
    }

    /// Return the ratio of the loads of a step to the loads of the last step of its leg.
    pub fn share(&self, step: usize) -> f64 {
        self.leg(step).next_back().and_then(|last| self.ratio(step, last)).unwrap_or(1.0)
    }

    /// Return a history of one step: the first one with the largest sum of absolute factors.
    pub fn heaviest(&self) -> Self {
        let size = |step: &&Step| step.factors.iter().map(|factor| factor.abs()).sum::<f64>();
        let step = self.steps.iter().rev().max_by(|a, b| size(a).total_cmp(&size(b)));
        Self { steps: step.into_iter().cloned().collect(), ..self.clone() }
    }

    /// Return whether nothing acts in a step.
    pub fn is_at_rest(&self, step: usize) -> bool {
        !self.constant && self.steps[step].factors.iter().all(|factor| *factor == 0.0)
    }

    /// Return the number r > 0 with loads of `step` = r * loads of `other`, if there is one. Both steps without loads have r = 1.
    fn ratio(&self, step: usize, other: usize) -> Option<f64> {
        // constant loads have the factor 1 in every step
        let constant = self.constant.then_some(1.0);
        let factors = |step: usize| self.steps[step].factors.iter().copied().chain(constant);
        let both = || factors(step).zip(factors(other));
        let (a, b) = both().max_by(|x, y| x.1.abs().total_cmp(&y.1.abs()))?;
        let ratio = if b == 0.0 { 1.0 } else { a / b };
        // the tolerance allows for factors that are rounded decimals
        let fits = |(a, b): (f64, f64)| (a - ratio * b).abs() <= 4.0 * f64::EPSILON * a.abs();
        (ratio > 0.0 && both().all(fits)).then_some(ratio)
    }

    /// Return the factor at a step for a line with this path; 1 if the history has no such factor.
    fn factor(&self, step: usize, path: Option<&Located<String>>) -> f64 {
        let name = path.filter(|_| self.is_table()).map_or(COMMON, |path| &path.value);
        let column = self.names.iter().position(|known| known == name);
        column.map_or(1.0, |column| self.steps[step].factors[column])
    }

    /// Give all loads and prescribed displacements the factors of the last step of the leg of `step`. Without such a step, leave them.
    pub fn apply(&self, step: usize, bodies: &mut [BodySpec]) {
        let Some(last) = self.leg(step).next_back().filter(|_| step < self.steps.len()) else { return };
        for body in bodies {
            body.load.iter_mut().for_each(|load| load.factor = self.factor(last, load.path.as_ref()));
            body.fix.iter_mut().for_each(|fix| fix.factor = self.factor(last, fix.path.as_ref()));
            body.force_factor = self.factor(last, None);
        }
    }
}

/// Return the paths of the loads and supports of a body.
pub fn paths(body: &BodySpec) -> impl Iterator<Item = &Located<String>> {
    let loads = body.load.iter().filter_map(|load| load.path.as_ref());
    loads.chain(body.fix.iter().filter_map(|fix| fix.path.as_ref()))
}

/// Return whether a body has a load or a prescribed displacement without a path that is not zero.
pub fn has_common(body: &BodySpec) -> bool {
    let acts = |kind: &LoadKind| match kind {
        LoadKind::Pressure(pressure) => !pressure.is_zero(),
        LoadKind::Traction(traction) => !traction.iter().all(Field::is_zero),
        LoadKind::Force { total, .. } | LoadKind::Moment(total) => total.iter().any(|force| *force != 0.0),
        LoadKind::Turning { force, moment } => force.iter().chain(moment).any(|component| *component != 0.0),
    };
    let moves = |field: &Field| !field.is_zero();
    body.force.as_ref().is_some_and(|force| !force.iter().all(Field::is_zero))
        || body.load.iter().any(|load| load.path.is_none() && acts(&load.kind))
        || body.fix.iter().any(|fix| fix.path.is_none() && fix.value.iter().flatten().chain(&fix.normal).any(moves))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn history(rows: &[[f64; 2]], constant: bool) -> History {
        let step = |(number, row): (usize, &[f64; 2])| Step { time: number as f64, factors: row.to_vec() };
        let steps = rows.iter().enumerate().map(step).collect();
        History { names: vec!["a".into(), "b".into()], steps, constant, ..History::default() }
    }

    #[test]
    fn legs_are_steps_in_proportion() {
        let rows = [[0.0, 0.0], [0.0, 0.0], [0.1, 0.3], [0.2, 0.6], [0.7, 2.1], [-0.1, -0.3], [0.0, 1.0], [0.0, 0.5]];
        let loading = history(&rows, false);
        let legs: Vec<_> = (0..8).map(|step| loading.leg(step)).collect();
        assert_eq!(legs, [0..2, 0..2, 2..5, 2..5, 2..5, 5..6, 6..8, 6..8]);
        assert_eq!([0, 1, 4, 5, 6, 7].map(|step| loading.share(step)), [1.0, 1.0, 1.0, 1.0, 2.0, 1.0]);
        assert!((loading.share(3) - 2.0 / 7.0).abs() < 1e-15);
        // with loads that stay as they are only equal steps are in proportion
        let constant = history(&rows, true);
        assert_eq!([0, 2, 3].map(|step| constant.leg(step)), [0..2, 2..3, 3..4]);
        assert_eq!(History::of_shares(vec![0.5, 2.0, 1.0]).leg(1), 0..3);
    }
}
