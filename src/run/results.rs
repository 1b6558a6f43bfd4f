//! What the displacements of a body say: fields for output, largest stresses with their places, errors against a known answer.

use super::stages::Done;
use crate::discretize::{BodyInfo, Discrete};
use crate::error::{Result, few};
use crate::output::BodyReport;
use crate::output::vtu::BodyField;
use std::cell::OnceCell;

/// The end of a run in one body that this rank speaks for.
pub struct Recovered {
    /// Displacements of all nodes.
    pub state: Vec<f64>,
    /// The same without the rigid motions that supports leave or carry the body by, which strain nothing.
    pub bent: Vec<f64>,
    field: OnceCell<BodyField>,
}

impl Recovered {
    /// Displacements and stresses at the nodes, made when they are first asked for.
    pub fn field(&self, info: &BodyInfo) -> &BodyField {
        self.field.get_or_init(|| info.post().field(&self.state, &self.bent))
    }
}

/// The end of a run in every body: none for those of other ranks, and the failure of a solver that should have found the
/// interior of a body.
pub type All = Vec<Option<Result<Recovered>>>;

/// Recovers the bodies that this rank speaks for. Collective.
pub fn recover(done: &Done) -> All {
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
            let recover = || -> Result<Option<Recovered>> {
                let mut bent = body.recover(&still)?;
                // the rigid motion is the same on all ranks, so that they agree on this
                let is_still = state[state.len() - rigid..].iter().all(|a| *a == 0.0);
                let mut state = if is_still { bent.clone() } else { body.recover(&state)? };
                if !body.leads() {
                    return Ok(None);
                }
                state.iter_mut().zip(body.carried()).for_each(|(u, carried)| *u += carried);
                bent.iter_mut().chain(&mut state).for_each(|u| *u *= done.share);
                Ok(Some(Recovered { state, bent, field: OnceCell::new() }))
            };
            recover().transpose()
        })
        .collect()
}

/// Numbers of a body in the message.
const NUMBERS: usize = 11;

/// Puts largest stresses, displacements and errors of all bodies into their reports; null where there is none. Collective.
/// Returns a warning of displacements that are too large for the theory.
pub fn fill(discrete: &Discrete, recovered: &All, reports: &mut [BodyReport]) -> Option<String> {
    let mut message = vec![0.0; NUMBERS * reports.len()];
    let bodies = discrete.bodies.iter().zip(recovered);
    for (mine, (info, recovered)) in message.chunks_exact_mut(NUMBERS).zip(bodies) {
        match recovered {
            None => {}
            Some(Err(_)) => mine.fill(f64::NAN),
            Some(Ok(recovered)) => {
                let field = recovered.field(info);
                let von_mises = &field.von_mises;
                let largest = (0..von_mises.len()).max_by(|&i, &j| von_mises[i].total_cmp(&von_mises[j])).unwrap_or(0);
                mine[0] = von_mises[largest];
                mine[1..4].copy_from_slice(&field.points[largest]);
                mine[4] = field.principal.iter().map(|s| s[0]).fold(f64::NEG_INFINITY, f64::max);
                mine[5] = field.principal.iter().map(|s| s[2]).fold(f64::INFINITY, f64::min);
                mine[6..9].copy_from_slice(&info.post().errors(&recovered.state).unwrap_or([f64::NAN; 3]));
                mine[9] =
                    field.displacement.iter().map(|u| u.iter().map(|x| x * x).sum::<f64>().sqrt()).fold(0.0, f64::max);
                mine[10] = diagonal(&field.points);
            }
        }
    }
    discrete.model.exchange.sum(&mut message);
    let finite = |value: f64| value.is_finite().then_some(value);
    for (report, numbers) in reports.iter_mut().zip(message.chunks_exact(NUMBERS)) {
        let stressed = numbers[0].is_finite();
        report.max_von_mises = finite(numbers[0]);
        report.max_von_mises_at = stressed.then_some([numbers[1], numbers[2], numbers[3]]);
        report.principal_range = stressed.then_some([numbers[4], numbers[5]]);
        report.error_l2 = finite(numbers[6]);
        report.error_h1 = finite(numbers[7]);
        report.error_energy = finite(numbers[8]);
        report.max_displacement = finite(numbers[9]).filter(|_| stressed);
    }
    let moved =
        |(report, numbers): (&BodyReport, &[f64])| (numbers[9] > SMALL * numbers[10]).then(|| report.name.clone());
    let moved: Vec<String> = reports.iter().zip(message.chunks_exact(NUMBERS)).filter_map(moved).collect();
    (!moved.is_empty()).then(|| {
        format!(
            "displacements of more than a tenth of the body's size: {}. The theory is that of small ones: look at the gaps, the units and \
             the supports",
            few(moved).join(", ")
        )
    })
}

/// Displacements up to this share of a body are small: a turn by it changes lengths along and across by half a per cent.
const SMALL: f64 = 0.1;

/// Diagonal of the box around points.
fn diagonal(points: &[[f64; 3]]) -> f64 {
    let side = |c: usize| {
        let (low, high) =
            points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x[c]), b.max(x[c])));
        (high - low) * (high - low)
    };
    (0..3).map(side).sum::<f64>().sqrt()
}
