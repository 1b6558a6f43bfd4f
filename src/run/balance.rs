//! Forces on every body, from the ranks that have parts of them to the report.

use super::ended::{All, Recovered};
use super::stages::Done;
use crate::contact::moment_in_scene;
use crate::discretize::{Balance, BodyInfo};
use crate::output::{BalanceReport, ForceReport};

/// Numbers of a resultant.
const WIDTH: usize = 6;

/// The forces on every body in the result; collective.
pub fn gather(done: &Done, recovered: &All) -> Vec<BalanceReport> {
    let discrete = &done.built.discrete;
    let model = &discrete.model;
    let names = |info: &BodyInfo| {
        let all = info.supports.iter().chain(&info.springs).chain(&info.rigid).cloned();
        ["loads", "contacts"].map(str::to_owned).into_iter().chain(all).collect::<Vec<_>>()
    };
    let mut message = Vec::new();
    for (index, info) in discrete.bodies.iter().enumerate() {
        let mut mine = vec![0.0; WIDTH * names(info).len() + 2];
        match &recovered[index] {
            None => {}
            // a solver that fails here leaves the forces unknown; the run itself is over
            Some(Err(_)) => mine.fill(f64::NAN),
            Some(Ok(Recovered { bent, .. })) => {
                // bodies know of full loads alone
                let full = |v: &[f64]| v.iter().map(|v| v / done.share).collect::<Vec<_>>();
                let force = model.at_rows(index, &done.outcome.layer.force);
                let Balance { parts, size } = info.post().balance(&full(bent), &full(&force));
                let numbers = parts.iter().flat_map(|part| [part.force, part.moment]).flatten().chain(size);
                mine.iter_mut().zip(numbers).for_each(|(place, number)| *place = done.share * number);
            }
        }
        message.extend(mine);
    }
    model.exchange.sum(&mut message);
    let (mut rest, mut reports) = (&message[..], Vec::new());
    for info in &discrete.bodies {
        let names = names(info);
        let (numbers, size);
        (numbers, rest) = rest.split_at(WIDTH * names.len());
        (size, rest) = rest.split_at(2);
        let mut parts: Vec<ForceReport> = names
            .into_iter()
            .zip(numbers.chunks_exact(WIDTH))
            .map(|(on, n)| ForceReport { on, force: [n[0], n[1], n[2]], moment: [n[3], n[4], n[5]] })
            .collect();
        let share = |pick: fn(&ForceReport) -> [f64; 3], size: f64| {
            let sum = |c: usize| parts.iter().map(|part| pick(part)[c]).sum::<f64>();
            let lacking = (0..3).map(|c| sum(c).powi(2)).sum::<f64>().sqrt();
            if size > 0.0 { lacking / size } else { 0.0 }
        };
        let (force_imbalance, moment_imbalance) =
            (share(|part| part.force, size[0]), share(|part| part.moment, size[1]));
        for part in &mut parts {
            part.moment = moment_in_scene(&info.datum, part.force, part.moment);
        }
        let rigid = parts.split_off(2 + info.supports.len() + info.springs.len());
        let springs = parts.split_off(2 + info.supports.len());
        let supports = parts.split_off(2);
        let contacts = parts.pop().unwrap_or_default();
        let loads = parts.pop().unwrap_or_default();
        reports.push(BalanceReport { loads, contacts, supports, springs, rigid, force_imbalance, moment_imbalance });
    }
    reports
}
