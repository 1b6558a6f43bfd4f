//! Histories of loads: factors of loads and prescribed displacements, step by step.
//!
//! Lines of the scene with a `path` take the factor of that name. Steps in a row whose factors are positive multiples of each other
//! make a leg: on it all loads have one common share, so that nothing is assembled anew.

use super::body::{BodySpec, LoadKind};
use crate::error::Located;
use crate::expression::Field;
use std::ops::Range;
use std::path::PathBuf;

/// Name of the factor of all lines that name no other one.
pub const COMMON: &str = "factor";

/// Factors of loads and prescribed displacements, step by step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct History {
    /// Names of the factors.
    pub names: Vec<String>,
    /// The steps; none is one run under the full loads.
    pub steps: Vec<Step>,
    /// The file that they come from, if they do.
    pub table: Option<Located<PathBuf>>,
    /// Whether some loads have no factor and stay as they are.
    pub constant: bool,
    /// Steps that another process has made.
    pub begun: usize,
}

/// A step of a history.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Time, which increases from step to step.
    pub time: f64,
    /// One factor each name.
    pub factors: Vec<f64>,
}

impl History {
    /// Shares of all loads, at times 1, 2, ...
    pub fn of_shares(shares: Vec<f64>) -> Self {
        let step = |(number, share): (usize, f64)| Step { time: (number + 1) as f64, factors: vec![share] };
        let steps = shares.into_iter().enumerate().map(step).collect();
        Self { names: vec![COMMON.to_owned()], steps, ..Self::default() }
    }

    /// Whether there is no history: one run under the full loads.
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// Whether lines have factors of their own, and the last step need not be the full load.
    pub fn is_table(&self) -> bool {
        self.table.is_some()
    }

    /// The leg of a step: steps around it with loads in proportion.
    pub fn leg(&self, step: usize) -> Range<usize> {
        let same = |other: usize| self.ratio(other, step).is_some();
        let begin = (0..step).rev().take_while(|&other| same(other)).last().unwrap_or(step);
        let end = (step..self.steps.len()).take_while(|&other| same(other)).last().map_or(step, |last| last + 1);
        begin..end
    }

    /// Loads of a step over those of the last one of its leg.
    pub fn share(&self, step: usize) -> f64 {
        self.leg(step).next_back().and_then(|last| self.ratio(step, last)).unwrap_or(1.0)
    }

    /// The first step with the largest factors, alone.
    pub fn heaviest(&self) -> Self {
        let size = |step: &&Step| step.factors.iter().map(|factor| factor.abs()).sum::<f64>();
        let step = self.steps.iter().rev().max_by(|a, b| size(a).total_cmp(&size(b)));
        Self { steps: step.into_iter().cloned().collect(), ..self.clone() }
    }

    /// Whether nothing acts in a step.
    pub fn is_at_rest(&self, step: usize) -> bool {
        !self.constant && self.steps[step].factors.iter().all(|factor| *factor == 0.0)
    }

    /// The number r > 0 by which the loads of one step are those of another, if there is one.
    fn ratio(&self, step: usize, other: usize) -> Option<f64> {
        let rest = self.constant.then_some(1.0);
        let factors = |step: usize| self.steps[step].factors.iter().copied().chain(rest);
        let both = || factors(step).zip(factors(other));
        let (a, b) = both().max_by(|x, y| x.1.abs().total_cmp(&y.1.abs()))?;
        let ratio = if b == 0.0 { 1.0 } else { a / b };
        // factors are rounded decimals
        let fits = |(a, b): (f64, f64)| (a - ratio * b).abs() <= 4.0 * f64::EPSILON * a.abs();
        (ratio > 0.0 && both().all(fits)).then_some(ratio)
    }

    /// The factor of a line at a step.
    fn factor(&self, step: usize, path: Option<&Located<String>>) -> f64 {
        let name = path.filter(|_| self.is_table()).map_or(COMMON, |path| &path.value);
        let place = self.names.iter().position(|known| known == name);
        place.map_or(1.0, |place| self.steps[step].factors[place])
    }

    /// Gives all loads and prescribed displacements the factors of the last step of a step's leg.
    pub fn apply(&self, step: usize, bodies: &mut [BodySpec]) {
        let Some(last) = self.leg(step).next_back().filter(|_| step < self.steps.len()) else { return };
        for body in bodies {
            body.load.iter_mut().for_each(|load| load.factor = self.factor(last, load.path.as_ref()));
            body.fix.iter_mut().for_each(|fix| fix.factor = self.factor(last, fix.path.as_ref()));
            body.force_factor = self.factor(last, None);
        }
    }
}

/// The paths that lines of a body name.
pub fn paths(body: &BodySpec) -> impl Iterator<Item = &Located<String>> {
    let loads = body.load.iter().filter_map(|load| load.path.as_ref());
    loads.chain(body.fix.iter().filter_map(|fix| fix.path.as_ref()))
}

/// Whether a body has a load or a prescribed displacement that names no path.
pub fn has_common(body: &BodySpec) -> bool {
    let acts = |kind: &LoadKind| match kind {
        LoadKind::Pressure(pressure) => !pressure.is_zero(),
        LoadKind::Traction(traction) => !traction.iter().all(Field::is_zero),
        LoadKind::Force { total, .. } => total.iter().any(|force| *force != 0.0),
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
