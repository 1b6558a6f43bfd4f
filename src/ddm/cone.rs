//! The cone of rigid motions that close no contact: what loads can do there, and which points can carry no pressure.
//!
//! With E the free rigid motions of all bodies and w the work of the loads on them, exactly one of two things is true (Farkas):
//! contact forces f >= 0 balance the loads, (B E)'f = w; or a motion m opens contacts only, B E m <= 0, and gains, w'm > 0. Then
//! F1 falls for ever along it. The least-squares problem min |(B E)'f - w| over f >= 0 finds either: its residual is m.

use super::joint::Joint;
use nalgebra::{DMatrix, DVector};

/// Share of the right-hand side below which a residual is rounding.
const ROUNDING: f64 = 1e-9;

/// Share of a motion that may close contacts by rounding, and that counts as opening one.
const CLOSES: f64 = 1e-6;

/// A column enters if the residual's part along it exceeds this share of their sizes.
const ENTERS: f64 = 1e-11;

/// Columns of a least-squares problem: entries (row, value).
type Column = Vec<(usize, f64)>;

/// The closings of motions at every point as columns, motions scaled to closings of one.
pub struct Cone {
    columns: Vec<Column>,
    scale: Vec<f64>,
}

impl Cone {
    /// Of the free motions of a model.
    pub fn new(joint: &Joint) -> Self {
        let mut scale = vec![0.0f64; joint.count()];
        let mut columns: Vec<Column> = joint.columns();
        columns.iter().flatten().for_each(|&(i, value)| scale[i] = scale[i].max(value.abs()));
        scale.iter_mut().for_each(|scale| *scale = if *scale > 0.0 { scale.recip() } else { 0.0 });
        columns.iter_mut().flatten().for_each(|(i, value)| *value *= scale[*i]);
        Self { columns, scale }
    }

    /// A motion that closes no contact and on which these works sum up to a gain; `None` if contact can balance the loads. Motions
    /// that contact does not feel are left out.
    pub fn gain(&self, work: &DVector<f64>) -> Option<DVector<f64>> {
        let target = self.scaled(work);
        let rest = least(&self.columns, &target);
        let closes = self.columns.iter().any(|column| along(column, &rest) > CLOSES * rest.amax());
        (rest.norm() > ROUNDING * target.norm() && !closes).then(|| self.scaled(&rest))
    }

    /// A motion that closes no contact and on which loads do no work; it opens all points that can carry no pressure, by one at
    /// least. `None` if every point can carry some. Loads must have a balance.
    pub fn opening(&self, work: &DVector<f64>) -> Option<DVector<f64>> {
        let mut columns = self.columns.clone();
        let load = self.scaled(work);
        columns.push((0..load.len()).filter(|&i| load[i] != 0.0).map(|i| (i, -load[i] / load.amax())).collect());
        let mut motion = DVector::zeros(self.scale.len());
        let mut pressed: Vec<usize> = (0..self.columns.len()).collect();
        // pressure at every point that may have some: what cannot be balanced opens
        loop {
            let mut target = DVector::zeros(self.scale.len());
            pressed.iter().flat_map(|&q| &self.columns[q]).for_each(|&(i, value)| target[i] -= value);
            let rest = least(&columns, &target);
            let opened = |q: &usize| along(&self.columns[*q], &rest) < -CLOSES * rest.amax();
            let before = pressed.len();
            if rest.norm() <= ROUNDING * target.norm() || pressed.is_empty() {
                break;
            }
            let least =
                pressed.iter().filter(|q| opened(q)).map(|&q| -along(&self.columns[q], &rest)).fold(f64::MAX, f64::min);
            pressed.retain(|q| !opened(q));
            if pressed.len() == before {
                break;
            }
            motion += rest / least;
        }
        (motion.amax() > 0.0).then(|| self.scaled(&motion))
    }

    fn scaled(&self, motion: &DVector<f64>) -> DVector<f64> {
        DVector::from_fn(self.scale.len(), |i, _| self.scale[i] * motion[i])
    }
}

fn along(column: &Column, vector: &DVector<f64>) -> f64 {
    column.iter().map(|&(i, value)| value * vector[i]).sum()
}

/// The residual b - A f of the least-squares problem over f >= 0, by the active set method of Lawson and Hanson.
fn least(columns: &[Column], target: &DVector<f64>) -> DVector<f64> {
    let rows = target.len();
    let sizes: Vec<f64> = columns.iter().map(|column| column.iter().map(|(_, v)| v * v).sum::<f64>().sqrt()).collect();
    let mut passive: Vec<usize> = Vec::new();
    let mut forces: Vec<f64> = Vec::new();
    let mut rest = target.clone();
    for _ in 0..10 * (rows + 1) {
        let small = ENTERS * target.norm();
        let pull =
            |q: usize| if passive.contains(&q) || sizes[q] == 0.0 { 0.0 } else { along(&columns[q], &rest) / sizes[q] };
        let best = (0..columns.len()).map(|q| (q, pull(q))).max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((entering, _)) = best.filter(|(_, pull)| *pull > small) else { break };
        passive.push(entering);
        forces.push(0.0);
        loop {
            let dense = DMatrix::from_fn(rows, passive.len(), |i, j| {
                let column = &columns[passive[j]];
                column.iter().find(|(row, _)| *row == i).map_or(0.0, |(_, value)| value / sizes[passive[j]])
            });
            let factors = dense.clone().qr();
            let Some(wish) = factors.r().solve_upper_triangular(&(factors.q().transpose() * target)) else {
                return rest;
            };
            // the largest step towards the solution that keeps forces from pulling
            let steps: Vec<f64> = (0..passive.len())
                .map(|j| if wish[j] > 0.0 { 1.0 } else { forces[j] / (forces[j] - wish[j]) })
                .collect();
            let way = steps.iter().copied().fold(1.0, f64::min);
            forces.iter_mut().zip(wish.iter()).for_each(|(force, wish)| *force += way * (wish - *force));
            if way >= 1.0 {
                rest = target - dense * DVector::from_column_slice(&forces);
                break;
            }
            let keep: Vec<usize> = (0..passive.len()).filter(|&j| steps[j] > way).collect();
            (passive, forces) = keep.iter().map(|&j| (passive[j], forces[j])).unzip();
        }
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ddm::{Motion, Segment};

    /// Two blocks on each other and on the ground: closings of the lower and the upper one by a motion upwards.
    fn tower(check: impl Fn(&Cone)) {
        let segment = |pair, side| Segment { pair, side };
        let up = |trace: &[f64]| vec![Motion { name: "up".into(), trace: trace.to_vec(), work: 0.0 }];
        let segments = [vec![segment(0, 0)], vec![segment(0, 1), segment(1, 0)], vec![segment(1, 1)]];
        let motions = [Vec::new(), up(&[-1.0, -1.0, 1e3, 1e3]), up(&[-1e3, -1e3])];
        let bodies = segments.iter().zip(&motions).map(|(segments, motions)| (&segments[..], &motions[..]));
        check(&Cone::new(&Joint::new(bodies, &[2, 2])));
    }

    #[test]
    fn loads_are_balanced_or_gain() {
        tower(|cone| {
            let gain = |lower: f64, upper: f64| cone.gain(&DVector::from_vec(vec![lower, upper]));
            assert!(gain(-1.0, -1e3).is_none() && gain(1.0, -1e3).is_none() && gain(0.0, 0.0).is_none());
            // the upper one alone, and both
            let upper = gain(0.0, 1.0).expect("a gain");
            assert!(upper[0].abs() < 1e-12 * upper[1] && upper[1] > 0.0, "{upper}");
            let both = gain(1.0, 0.0).expect("a gain");
            assert!((both[0] / both[1] - 1.0).abs() < 1e-12 && both[0] > 0.0, "{both}");
        });
    }

    #[test]
    fn contacts_without_load_open() {
        tower(|cone| {
            let opening = |lower: f64, upper: f64| cone.opening(&DVector::from_vec(vec![lower, upper]));
            let all = opening(0.0, 0.0).expect("nothing is pressed");
            assert!(all[0] >= 1.0 && 1e3 * (all[1] - all[0]) >= 1.0 - 1e-9, "{all}");
            // the lower one is pressed, the upper one is not
            let upper = opening(-1.0, 0.0).expect("the upper contact opens");
            assert!(upper[0].abs() < 1e-9 && 1e3 * upper[1] >= 1.0 - 1e-9, "{upper}");
            assert!(opening(0.0, -1.0).is_none() && opening(-1.0, -1.0).is_none());
        });
    }
}
