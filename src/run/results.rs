//! What the displacements of a body say: fields for output, largest stresses with their places, errors against a known answer.

use super::ended::{All, Recovered};
use super::stages::Done;
use crate::discretize::{BodyInfo, Discrete};
use crate::error::{Result, few};
use crate::exchange::share;
use crate::fem::strain::{self, Strained};
use crate::linalg::{around, bounds};
use crate::output::report::readable;
use crate::output::{BodyReport, sci};
use serde::{Deserialize, Serialize};
use std::rc::Rc;

/// The bodies that this rank has a part of: as the end of the run has left them, else recovered. Collective.
pub fn recover(done: &Done) -> Rc<All> {
    done.recovered.clone().unwrap_or_else(|| Rc::new(anew(done)))
}

fn anew(done: &Done) -> All {
    let bodies = done.model().bodies.iter().zip(&done.outcome.iterate.states);
    bodies
        .map(|(slot, state)| {
            let body = slot.local.as_ref()?;
            // what springs hold is strain, too
            let rigid = if slot.sprung.is_some() { 0 } else { body.rigid() };
            // bodies know of full loads alone
            let state: Vec<f64> = state.iter().map(|u| u / done.share).collect();
            let mut still = state.clone();
            still[state.len() - rigid..].fill(0.0);
            let recover = || -> Result<Recovered> {
                let mut bent = body.recover(&still)?;
                // the rigid motion is the same on all ranks, so that they agree on this
                let is_still = state[state.len() - rigid..].iter().all(|a| *a == 0.0);
                let mut state = if is_still { bent.clone() } else { body.recover(&state)? };
                state.iter_mut().zip(body.carried()).for_each(|(u, carried)| *u += carried);
                bent.iter_mut().chain(&mut state).for_each(|u| *u *= done.share);
                Ok(Recovered::new(state, bent))
            };
            Some(recover())
        })
        .collect()
}

/// What a rank finds in its part of a body.
#[derive(Serialize, Deserialize)]
struct Found {
    /// Largest von Mises stress; NaN where a solver failed.
    von_mises: f64,
    /// Where it is.
    at: [f64; 3],
    /// Least and largest principal stress.
    principal: [f64; 2],
    /// Largest displacement, and the box around the points: least and largest coordinates.
    displacement: f64,
    extent: [[f64; 3]; 2],
    /// Largest strain.
    strain: Strained,
    /// Norms of the error and of the known displacements.
    norms: Option<[[f64; 3]; 2]>,
}

impl Found {
    fn new(info: &BodyInfo, recovered: &Result<Recovered>) -> Self {
        let mut found = Self {
            von_mises: f64::NEG_INFINITY,
            at: [0.0; 3],
            principal: [f64::INFINITY, f64::NEG_INFINITY],
            displacement: 0.0,
            extent: bounds([]),
            strain: Strained::NONE,
            norms: None,
        };
        let Ok(recovered) = recovered else { return Self { von_mises: f64::NAN, ..found } };
        let field = recovered.field(info);
        if let Some(largest) =
            (0..field.points.len()).max_by(|&i, &j| field.von_mises[i].total_cmp(&field.von_mises[j]))
        {
            (found.von_mises, found.at) = (field.von_mises[largest], field.points[largest]);
        }
        for s in &field.principal {
            found.principal = [found.principal[0].min(s[2]), found.principal[1].max(s[0])];
        }
        let length = |u: &[f64; 3]| u.iter().map(|x| x * x).sum::<f64>().sqrt();
        found.displacement = field.displacement.iter().map(length).fold(0.0, f64::max);
        found.extent = bounds(field.points.iter().copied());
        found.strain = info.post().strain(&recovered.bent);
        found.norms = info.post().errors(&recovered.state);
        found
    }

    /// What two parts of a body come to.
    fn with(self, other: Self) -> Self {
        let ([low, high], [least, largest]) = (self.principal, other.principal);
        let norms = self
            .norms
            .zip(other.norms)
            .map(|(a, b)| std::array::from_fn(|of| std::array::from_fn(|norm| f64::hypot(a[of][norm], b[of][norm]))));
        let displacement = self.displacement.max(other.displacement);
        let extent = around(self.extent, other.extent);
        let strain = self.strain.with(other.strain);
        // NaN is above all numbers
        let larger = if other.von_mises.total_cmp(&self.von_mises).is_gt() { other } else { self };
        Self { principal: [low.min(least), high.max(largest)], displacement, extent, strain, norms, ..larger }
    }
}

/// Displacements up to this share of a body are small: a turn by it changes lengths along and across by half a per cent.
const SMALL: f64 = 0.1;

/// Puts largest stresses, displacements and errors of all bodies into their reports; null where there is none. Collective.
/// Returns warnings of displacements and of strains that are too large for the theory.
pub fn fill(discrete: &Discrete, recovered: &All, reports: &mut [BodyReport]) -> Vec<String> {
    let bodies = discrete.bodies.iter().zip(recovered).enumerate();
    let mine: Vec<(usize, Found)> =
        bodies.filter_map(|(index, (info, recovered))| Some((index, Found::new(info, recovered.as_ref()?)))).collect();
    let mut all: Vec<Option<Found>> = reports.iter().map(|_| None).collect();
    for (body, found) in share(&*discrete.model.exchange, mine).into_iter().flatten() {
        let found = match all[body].take() {
            Some(before) => before.with(found),
            None => found,
        };
        all[body] = Some(found);
    }
    let finite = |value: f64| value.is_finite().then_some(value);
    let (mut moved, mut strained) = (Vec::new(), Vec::new());
    for (report, found) in reports.iter_mut().zip(all) {
        let Some(found) = found.filter(|found| found.von_mises.is_finite()) else { continue };
        report.max_displacement = Some(found.displacement);
        let [low, high] = found.extent;
        let diagonal = (0..3).map(|c| (high[c] - low[c]).powi(2)).sum::<f64>().sqrt();
        if found.displacement > SMALL * diagonal {
            moved.push(report.name.clone());
        }
        if found.strain.most > strain::SMALL {
            strained.push(strain_in_words(&report.name, &found.strain));
        }
        (report.max_strain, report.max_strain_at) = (Some(found.strain.most), Some(found.strain.at));
        report.max_von_mises = Some(found.von_mises);
        report.max_von_mises_at = Some(found.at);
        report.principal_range = Some([found.principal[1], found.principal[0]]);
        let error = |norm: usize| found.norms.and_then(|[error, whole]| finite(error[norm] / whole[norm]));
        (report.error_l2, report.error_h1, report.error_energy) = (error(0), error(1), error(2));
    }
    let moved = (!moved.is_empty()).then(|| {
        format!(
            "displacements of more than a tenth of the body's size: {}. The theory is that of small ones: look at the gaps, the units and \
             the supports",
            few(moved).join(", ")
        )
    });
    let strained = (!strained.is_empty()).then(|| {
        format!(
            "strains of more than {} per cent: {}. Linear elasticity is the theory of small ones: look at the moduli, the loads and the units",
            100.0 * strain::SMALL,
            few(strained).join("; ")
        )
    });
    moved.into_iter().chain(strained).collect()
}

/// The largest strain of a body in words, with its place and how much of the body is strained like that: near a sharp corner it is a few cells.
fn strain_in_words(name: &str, strain: &Strained) -> String {
    let [over, all] = strain.measure;
    let [x, y, z] = strain.at.map(|x| readable(x, 4));
    let share = readable(100.0 * over / all, 1);
    format!("`{name}` up to {} at ({x}, {y}, {z}), in {share} per cent of the body", sci(strain.most, 1))
}
