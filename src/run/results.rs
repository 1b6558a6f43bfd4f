//! Results from the displacements of the bodies: largest stresses and strains with their positions, and errors against a known
//! solution.

use super::ended::{All, Recovered};
use super::stages::Done;
use crate::discretize::{BodyInfo, Discrete};
use crate::error::{Result, few};
use crate::exchange::all_gather;
use crate::fem::displacement::{self, Strained};
use crate::linalg::{around, bounds};
use crate::model::{Body, BodySlot};
use crate::output::report::readable;
use crate::output::{BodyReport, sci};
use serde::{Deserialize, Serialize};
use std::rc::Rc;

/// Return the displacements of the bodies that this rank has nodes of. They are recovered unless the end of the run stored them.
/// Collective.
pub fn recover(done: &Done) -> Rc<All> {
    done.recovered.clone().unwrap_or_else(|| {
        let bodies = done.model().bodies.iter().zip(&done.outcome.iterate.states);
        let local = |(slot, state): (&BodySlot, &Vec<f64>)| {
            slot.local.as_ref().map(|body| recover_body(slot, &**body, state, done.share))
        };
        Rc::new(bodies.map(local).collect())
    })
}

/// Return the displacements of a body from its state at a share of the loads. Collective.
fn recover_body(slot: &BodySlot, body: &dyn Body, state: &[f64], share: f64) -> Result<Recovered> {
    // A motion that springs resist counts as deformation, too.
    let rigid = if slot.sprung.is_some() { 0 } else { body.rigid() };
    // bodies expect states at the full load
    let state: Vec<f64> = state.iter().map(|u| u / share).collect();
    let (deformation, motion) = state.split_at(state.len() - rigid);
    let mut bent = body.recover(&[deformation, &vec![0.0; rigid]].concat())?;
    // The rigid motion is the same on all ranks, so all of them take the same branch.
    let mut state = if motion.iter().all(|a| *a == 0.0) { bent.clone() } else { body.recover(&state)? };
    state.iter_mut().zip(body.carried()).for_each(|(u, imposed)| *u += imposed);
    bent.iter_mut().chain(&mut state).for_each(|u| *u *= share);
    Ok(Recovered::new(state, bent))
}

/// The results on a rank's part of a body.
#[derive(Serialize, Deserialize)]
struct Extremes {
    /// Largest von Mises stress; NaN if a solver failed.
    von_mises: f64,
    /// Point of the largest von Mises stress.
    at: [f64; 3],
    /// Least and largest principal stress.
    principal: [f64; 2],
    /// Largest displacement.
    displacement: f64,
    /// Bounding box of the points: least and largest coordinates.
    extent: [[f64; 3]; 2],
    /// Largest strain.
    strain: Strained,
    /// Norms of the error and of the known displacements: L2, H1 seminorm, energy.
    norms: Option<[[f64; 3]; 2]>,
}

impl Extremes {
    /// Evaluate the displacements of a body on this rank.
    fn new(info: &BodyInfo, recovered: &Result<Recovered>) -> Self {
        let mut extremes = Self {
            von_mises: f64::NEG_INFINITY,
            at: [0.0; 3],
            principal: [f64::INFINITY, f64::NEG_INFINITY],
            displacement: 0.0,
            extent: bounds([]),
            strain: Strained::NONE,
            norms: None,
        };
        let Ok(recovered) = recovered else { return Self { von_mises: f64::NAN, ..extremes } };
        let field = recovered.field(info);
        if let Some(largest) =
            (0..field.points.len()).max_by(|&i, &j| field.von_mises[i].total_cmp(&field.von_mises[j]))
        {
            (extremes.von_mises, extremes.at) = (field.von_mises[largest], field.points[largest]);
        }
        for s in &field.principal {
            extremes.principal = [extremes.principal[0].min(s[2]), extremes.principal[1].max(s[0])];
        }
        let length = |u: &[f64; 3]| u.iter().map(|x| x * x).sum::<f64>().sqrt();
        extremes.displacement = field.displacement.iter().map(length).fold(0.0, f64::max);
        extremes.extent = bounds(field.points.iter().copied());
        extremes.strain = info.post().strain(&recovered.bent);
        extremes.norms = info.post().errors(&recovered.state);
        extremes
    }

    /// Return the extremes of two parts of a body together.
    fn merged(self, other: Self) -> Self {
        let ([low, high], [least, largest]) = (self.principal, other.principal);
        let norms = self
            .norms
            .zip(other.norms)
            .map(|(a, b)| std::array::from_fn(|i| std::array::from_fn(|norm| f64::hypot(a[i][norm], b[i][norm]))));
        let displacement = self.displacement.max(other.displacement);
        let extent = around(self.extent, other.extent);
        let strain = self.strain.with(other.strain);
        // total_cmp orders NaN above all numbers, so that it survives
        let larger = if other.von_mises.total_cmp(&self.von_mises).is_gt() { other } else { self };
        Self { principal: [low.min(least), high.max(largest)], displacement, extent, strain, norms, ..larger }
    }

    /// Write the extremes to the report of their body.
    fn fill(&self, report: &mut BodyReport) {
        report.max_displacement = Some(self.displacement);
        (report.max_strain, report.max_strain_at) = (Some(self.strain.most), Some(self.strain.at));
        (report.max_von_mises, report.max_von_mises_at) = (Some(self.von_mises), Some(self.at));
        report.principal_range = Some([self.principal[1], self.principal[0]]);
        let error = |norm: usize| {
            let [error, solution] = self.norms?;
            Some(error[norm] / solution[norm]).filter(|error| error.is_finite())
        };
        (report.error_l2, report.error_h1, report.error_energy) = (error(0), error(1), error(2));
    }

    /// Whether the largest displacement exceeds [`SMALL`] times the diagonal of the body.
    fn is_moved_far(&self) -> bool {
        let [low, high] = self.extent;
        let diagonal = (0..3).map(|c| (high[c] - low[c]).powi(2)).sum::<f64>().sqrt();
        self.displacement > SMALL * diagonal
    }
}

/// Displacements up to this fraction of the size of a body are small. A rotation by this angle changes lengths along and across by
/// half a per cent.
const SMALL: f64 = 0.1;

/// Write largest stresses, displacements and errors of all bodies to their reports, null where there are none. Return warnings of
/// displacements and strains that are too large for the theory. Collective.
pub fn fill(discrete: &Discrete, recovered: &All, reports: &mut [BodyReport]) -> Vec<String> {
    let (mut moved, mut strained) = (Vec::new(), Vec::new());
    for (report, extremes) in reports.iter_mut().zip(gather(discrete, recovered)) {
        let Some(extremes) = extremes.filter(|extremes| extremes.von_mises.is_finite()) else { continue };
        extremes.fill(report);
        if extremes.is_moved_far() {
            moved.push(report.name.clone());
        }
        if extremes.strain.most > displacement::SMALL {
            strained.push(strain_in_words(&report.name, &extremes.strain));
        }
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
            100.0 * displacement::SMALL,
            few(strained).join("; ")
        )
    });
    moved.into_iter().chain(strained).collect()
}

/// Return the extremes of each body over all ranks, where a rank has any. Collective.
fn gather(discrete: &Discrete, recovered: &All) -> Vec<Option<Extremes>> {
    let mut mine = Vec::new();
    for (body, (info, recovered)) in discrete.bodies.iter().zip(recovered).enumerate() {
        mine.extend(recovered.as_ref().map(|recovered| (body, Extremes::new(info, recovered))));
    }
    let mut all: Vec<Option<Extremes>> = discrete.bodies.iter().map(|_| None).collect();
    for (body, part) in all_gather(&*discrete.model.exchange, mine).into_iter().flatten() {
        all[body] = Some(match all[body].take() {
            Some(before) => before.merged(part),
            None => part,
        });
    }
    all
}

/// Return the largest strain of a body in words, with its position and the fraction of the body with large strains. Near a sharp
/// corner these are a few cells.
fn strain_in_words(name: &str, strain: &Strained) -> String {
    let [large, all] = strain.measure;
    let [x, y, z] = strain.at.map(|x| readable(x, 4));
    let percentage = readable(100.0 * large / all, 1);
    format!("`{name}` up to {} at ({x}, {y}, {z}), in {percentage} per cent of the body", sci(strain.most, 1))
}
