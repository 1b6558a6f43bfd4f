//! Rigid parts of a scene: obstacles before surfaces, and offsets of gaps. Their motions are fields of closings of the
//! points of a pair.
//!
//! An obstacle is given by the gap d along the normal n of the body's surface. If it moves by w against the mean normal
//! N of the surface, and turns by the small vector t about a point, the gap closes by
//!
//! ```text
//! w n.N - t.(r x n),      r from that point to the contact point
//! ```
//!
//! This is linear: as for two meshed surfaces, displacements are small beside the radii of curvature, so that the
//! normal is that of the undeformed surface, and that the obstacle's own normal differs from it by an angle whose
//! square is small.

use super::approach::mean_normal;
use super::groups::point;
use super::scene_body::NO_WORK;
use crate::contact::{ContactPair, Measure};
use crate::error::{Error, Result};
use crate::fem::cross;
use crate::linalg::{Csr, dot, length};
use crate::model::{BodySlot, Motion};
use crate::problem::{ContactSpec, Vector};
use crate::scene::Scene;

/// An obstacle before the surface of a pair, with the directions in which it moves.
pub struct Obstacle<'a> {
    pair: &'a ContactPair,
    spec: &'a ContactSpec,
    /// Mean normal N of the surface; zero where its normals cancel.
    normal: [f64; 3],
    /// The point about which it turns.
    pub at: [f64; 3],
}

impl<'a> Obstacle<'a> {
    /// Return the obstacle of a pair.
    pub fn new(pair: &'a ContactPair, spec: &'a ContactSpec) -> Self {
        let area: f64 = pair.area.iter().sum();
        let middle = |c: usize| pair.area.iter().zip(&pair.position).map(|(w, x)| w * x[c]).sum::<f64>() / area;
        let is_revolved = pair.measure == Measure::Ring;
        let middle = |c: usize| if is_revolved && c == 0 { 0.0 } else { middle(c) };
        let at = spec.at.as_ref().map_or_else(|| [0, 1, 2].map(middle), Vector::numbers);
        Self { pair, spec, normal: mean_normal(pair).unwrap_or_default(), at }
    }

    /// Return the force of a side on the other along the mean normal, from that force.
    pub fn along(&self, force: [f64; 3]) -> f64 {
        dot(&self.normal, &force)
    }

    /// Return the moment about the point of the obstacle, from a force and its moment about the origin.
    pub fn moment(&self, force: [f64; 3], moment: [f64; 3]) -> [f64; 3] {
        let arm = cross(self.at, force);
        std::array::from_fn(|c| moment[c] - arm[c])
    }

    /// Return by how much each point closes when the obstacle approaches by one, n.
    fn approaching(&self) -> Vec<f64> {
        self.pair.resultant[0].iter().map(|&n| self.along(n)).collect()
    }

    /// Return by how much each point closes when the obstacle turns by the vector `turn`, n.
    fn turning(&self, turn: [f64; 3]) -> Vec<f64> {
        let both = self.pair.resultant[0].iter().zip(&self.pair.moment[0]);
        both.map(|(&n, &moment)| -dot(&turn, &self.moment(n, moment))).collect()
    }

    /// Return the axes about which the obstacle turns: z in the plane, in space two across the mean normal. Each is a
    /// unit vector over the largest closing by a turn of one, so that a motion of one closes the points by one at most.
    fn axes(&self) -> Vec<[f64; 3]> {
        let least = (0..3).min_by(|&i, &j| self.normal[i].abs().total_cmp(&self.normal[j].abs())).unwrap_or(0);
        let across = cross(self.normal, std::array::from_fn(|c| f64::from(u8::from(c == least))));
        let first = across.map(|c| c / length(across));
        let all = if self.pair.measure.is_along_curve() {
            vec![[0.0, 0.0, 1.0]]
        } else {
            vec![first, cross(self.normal, first)]
        };
        let scaled = |axis: [f64; 3]| {
            let most = self.turning(axis).iter().fold(0.0, |most: f64, closing| most.max(closing.abs()));
            axis.map(|c| if most > 0.0 { c / most } else { c })
        };
        all.into_iter().map(scaled).collect()
    }

    /// Return the motions that the scene leaves free, with the work of its forces on each.
    fn motions(&self) -> Vec<Motion> {
        let (spec, mut motions) = (self.spec, Vec::new());
        if let Some(force) = spec.force() {
            motions.push(Motion { name: "approach".to_owned(), trace: self.approaching(), work: force });
        }
        let moment = spec.moment();
        for axis in moment.iter().flat_map(|_| self.axes()) {
            let work = moment.map_or(0.0, |moment| dot(&moment, &axis));
            motions.push(Motion { name: "tilt".to_owned(), trace: self.turning(axis), work });
        }
        motions
    }

    /// Return by how much the motions close each point that the scene prescribes, n.
    fn prescribed(&self) -> Vec<f64> {
        let (approach, tilt) = (self.spec.approach().unwrap_or(0.0), self.spec.tilt().unwrap_or_default());
        let both = self.approaching().into_iter().zip(self.turning(tilt));
        both.map(|(closing, turn)| approach * closing + turn).collect()
    }

    /// Return the approach and the turn of the obstacle, from the amounts of its free motions.
    pub fn moved(&self, amounts: &[f64]) -> (f64, [f64; 3]) {
        let mut amounts = amounts.iter();
        let approach = match self.spec.force {
            Some(_) => amounts.next().copied().unwrap_or(0.0),
            None => self.spec.approach().unwrap_or(0.0),
        };
        let mut turn = self.spec.tilt().unwrap_or_default();
        if self.spec.moment.is_some() {
            for (axis, a) in self.axes().into_iter().zip(amounts) {
                (0..3).for_each(|c| turn[c] += a * axis[c]);
            }
        }
        (approach, turn)
    }

    /// Check that the obstacle has a direction to move in, if it moves.
    ///
    /// # Errors
    /// The normals of the surface cancel, or a moment acts about them.
    fn check(&self) -> Result<()> {
        let spec = self.spec;
        let is_moved = spec.approach.is_some() || spec.force.is_some() || spec.moment.is_some();
        let (place, name) = (&spec.between[0].place, &spec.between[0].value);
        if is_moved && self.normal == [0.0; 3] {
            return Err(Error::scene(
                place,
                format!("the normals of `{name}` have no mean, so that an obstacle cannot approach it"),
            )
            .help("name a part of the surface, or let the gap change: gap = \"...\""));
        }
        let moment = spec.moment().unwrap_or_default();
        if !self.pair.measure.is_along_curve() && self.along(moment).abs() > NO_WORK * length(moment) {
            let message =
                format!("a moment on the obstacle before `{name}` about its mean normal {}", point(self.normal));
            return Err(Error::scene(place, message).help("no pressure resists it: take that part out"));
        }
        Ok(())
    }
}

/// Return the rigid parts of all pairs, obstacles and offsets, which follow the `bodies` in the model.
///
/// # Errors
/// See [`part`].
pub fn all(scene: &Scene, pairs: &mut [ContactPair], is_through: &[bool], bodies: usize) -> Result<Vec<BodySlot>> {
    let mut found = Vec::new();
    for (number, (pair, spec)) in pairs.iter_mut().zip(scene.pairs()).enumerate() {
        found.extend(part(pair, spec, is_through[number], number, bodies + found.len())?);
    }
    Ok(found)
}

/// Return the rigid part of pair `number`, if its scene has one, as slot `index` of the model. `is_through` says
/// whether its surfaces look away from each other: then pressures draw them together, and so does the preload of a
/// bond.
///
/// # Errors
/// See [`Obstacle`]: a surface without a mean normal, and a moment about it.
fn part(
    pair: &mut ContactPair,
    spec: &ContactSpec,
    is_through: bool,
    number: usize,
    index: usize,
) -> Result<Option<BodySlot>> {
    spec.check_step()?;
    if spec.obstacle {
        let obstacle = Obstacle::new(pair, spec);
        obstacle.check()?;
        let (motions, prescribed) = (obstacle.motions(), obstacle.prescribed());
        pair.bodies[1] = index;
        pair.prescribed[1] = prescribed;
        (pair.rows[1], pair.nodal[1]) = (Csr::without_columns(pair.len()), Csr::without_columns(pair.len()));
        return Ok(Some(BodySlot::rigid(&spec.between[1].value, number, pair.len(), motions)));
    }
    let Some(force) = spec.force().or(spec.preload) else { return Ok(None) };
    let pulls = spec.bond && spec.preload.is_some() && !is_through;
    let work = if pulls { -force } else { force };
    let motion = Motion { name: "offset".to_owned(), trace: vec![1.0; pair.len()], work };
    let name = format!("gap of {} - {}", spec.between[0].value, spec.between[1].value);
    Ok(Some(BodySlot::rigid(&name, number, pair.len(), vec![motion])))
}
