//! The forces on every body, summed over the ranks, for the report.

use super::ended::{All, Recovered};
use super::stages::Done;
use crate::contact::moment_in_scene;
use crate::discretize::{Balance, BodyInfo};
use crate::output::{BalanceReport, ForceReport};

/// Numbers of a resultant: force and moment.
const WIDTH: usize = 6;

/// Return the forces on every body of the result. Collective.
pub fn gather(done: &Done, recovered: &All) -> Vec<BalanceReport> {
    let discrete = &done.built.discrete;
    let mut message = Vec::new();
    for (body, info) in discrete.bodies.iter().enumerate() {
        let mut mine = vec![0.0; WIDTH * names(info).len() + 2];
        match &recovered[body] {
            None => {}
            // a solver that failed leaves the forces unknown, but the run itself is over
            Some(Err(_)) => mine.fill(f64::NAN),
            Some(Ok(recovered)) => add_forces(done, body, recovered, &mut mine),
        }
        message.extend(mine);
    }
    discrete.model.exchange.sum(&mut message);
    let (mut rest, mut reports) = (&message[..], Vec::new());
    for info in &discrete.bodies {
        let numbers;
        (numbers, rest) = rest.split_at(WIDTH * names(info).len() + 2);
        reports.push(balance(info, numbers));
    }
    reports
}

/// Return the names of the resultants on a body: loads, contacts, then each support, spring and rigid surface.
fn names(info: &BodyInfo) -> Vec<String> {
    let all = info.supports.iter().chain(&info.springs).chain(&info.rigid).cloned();
    ["loads", "contacts"].map(str::to_owned).into_iter().chain(all).collect()
}

/// Write this rank's part of the resultants on a body, and of the sums of sizes of forces and moments, to `mine`.
fn add_forces(done: &Done, body: usize, recovered: &Recovered, mine: &mut [f64]) {
    let (model, info) = (done.model(), &done.built.discrete.bodies[body]);
    // bodies expect values at the full load
    let full = |values: &[f64]| values.iter().map(|v| v / done.share).collect::<Vec<_>>();
    let force = model.at_rows(body, &done.outcome.layer.force);
    let Balance { parts, size } = info.post().balance(&full(&recovered.bent), &full(&force));
    let numbers = parts.iter().flat_map(|part| [part.force, part.moment]).flatten().chain(size);
    mine.iter_mut().zip(numbers).for_each(|(mine, number)| *mine = done.share * number);
}

/// Return the report of the forces on a body from the numbers of its resultants, and the sums of sizes of forces and moments.
fn balance(info: &BodyInfo, numbers: &[f64]) -> BalanceReport {
    let names = names(info);
    let (resultants, sizes) = numbers.split_at(WIDTH * names.len());
    let resultant =
        |(on, n): (String, &[f64])| ForceReport { on, force: [n[0], n[1], n[2]], moment: [n[3], n[4], n[5]] };
    let mut parts: Vec<ForceReport> = names.into_iter().zip(resultants.chunks_exact(WIDTH)).map(resultant).collect();
    let force_imbalance = imbalance(parts.iter().map(|part| part.force), sizes[0]);
    let moment_imbalance = imbalance(parts.iter().map(|part| part.moment), sizes[1]);
    for part in &mut parts {
        part.moment = moment_in_scene(&info.datum, part.force, part.moment);
    }
    let rigid = parts.split_off(2 + info.supports.len() + info.springs.len());
    let springs = parts.split_off(2 + info.supports.len());
    let supports = parts.split_off(2);
    let contacts = parts.pop().unwrap_or_default();
    let loads = parts.pop().unwrap_or_default();
    BalanceReport { loads, contacts, supports, springs, rigid, force_imbalance, moment_imbalance }
}

/// Return the norm of the sum of vectors, relative to the sum of the sizes of all nodal contributions; zero if that is zero.
fn imbalance(vectors: impl Iterator<Item = [f64; 3]> + Clone, size: f64) -> f64 {
    let sum = |c: usize| vectors.clone().map(|vector| vector[c]).sum::<f64>();
    let norm = (0..3).map(|c| sum(c).powi(2)).sum::<f64>().sqrt();
    if size > 0.0 { norm / size } else { 0.0 }
}
