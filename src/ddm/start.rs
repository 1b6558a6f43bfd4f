//! The automatic start: rigid bodies on their own surfaces.
//!
//! The start solves the same problem with rigid bodies. The unknowns are the amounts a of the rigid motions E that
//! supports leave free, and K consists of springs to the ground alone. Each layer is in series with a spring rho0,
//! which stands for the surfaces of the two bodies: at the approach s of the rigid surfaces, the state (c, p) of the
//! layer is the point of the law with c + p/rho0 = s. Let w be the work of the loads on E, and Pi the energy of layer
//! and surfaces per area. Then the energy
//!
//! ```text
//! sum omega Pi(s) - w'a,      s = B E a - d,    Pi' = p,    0 <= Pi'' <= rho0
//! ```
//!
//! is convex in a few unknowns per body, and its second derivatives are bounded whatever the law. The layer states at
//! its minimum begin the iteration.
//!
//! The energy has no minimum exactly when loads push bodies away from everything that could stop them. Then there is a
//! motion a that closes no contact, B E a <= 0, changes no bonded layer, B E a = 0 there, and gains work, w'a > 0
//! (Farkas). Elastic bodies then have no equilibrium either.
//!
//! Two quantities count as zero below [`PART`] of what they could be. Forces out of balance: the elastic bodies change
//! the start by more. Closings of a motion: rounding and proximal springs make some. A motion that is resisted at a
//! meshed circle of 1000 edges closes 1e-5 of itself.

use crate::linalg::{Blocks, axpy, dot};
use crate::model::Model;
use crate::model::field::{self, Unbounded};
use crate::model::layer::{Layer, contact_slopes, in_series, surface_slopes};
use crate::model::motions::{Motions, NamedMotion, PART};
use nalgebra::DVector;

/// The start of a run.
#[derive(Debug, Clone)]
pub struct RigidStart {
    /// Amounts a of the free motions of all bodies.
    pub amounts: DVector<f64>,
    /// States of the layers.
    pub layer: Layer,
    /// Traces of E a minus the deflection of the surfaces (2n): B u - d is the compression of the layer states.
    pub trace: Vec<f64>,
}

/// Stiffness of the springs that resist every motion, as a share of rho0. With them, a step along a motion that no
/// closed contact resists is finite, and the line search takes it as far as the next contact. A step then closes
/// pressed contacts by this share of the opening of others, far less than [`PART`].
const PROXIMAL: f64 = 1e-9;

/// Most Newton steps; random scenes and walls of 4096 bricks take 2 to 20.
const MOST_STEPS: usize = 200;

/// Accuracy of line searches, relative to the first slope. A step is only a way to the next, and the energy falls with
/// any accuracy below one.
pub(super) const SEARCH: f64 = 1e-3;

/// Return the start of a model. The surfaces of the rigid bodies are displaced by the `given` trace (2n) or, without
/// one, as the moved supports of their bodies impose it. These displacements count as shapes, not as motions.
///
/// # Errors
/// The bodies and their motions along which the energy falls for ever, if there are such motions.
pub fn find(model: &Model, given: Option<&[f64]>) -> Result<RigidStart, Vec<NamedMotion>> {
    let motions = Motions::all(model);
    let given = given.map_or_else(|| model.imposed(), <[f64]>::to_vec);
    let gap = model.compression(&given).into_iter().map(|c| -c).collect();
    let (work, slope) = (motions.loads(), surface_slopes(model));
    let ground = motions.ground(model);
    let mut rigid = Rigid { model, motions: &motions, work, slope, gap, ground };
    let mut amounts = DVector::zeros(motions.count());
    if !amounts.is_empty() {
        // first with rho0 of whole surfaces, then with rho0 of the contact that was found
        amounts = rigid.descend(amounts).map_err(|motion| motions.names(&motion))?;
        let approach = rigid.approach(&amounts);
        rigid.slope = contact_slopes(model, |q| approach[q] > 0.0);
        amounts = rigid.descend(amounts).map_err(|motion| motions.names(&motion))?;
    }
    let layer = rigid.states(&amounts);
    let mut trace = motions.trace(model, &amounts);
    axpy(1.0, &given, &mut trace);
    let (points, rows) = (model.points(), model.row_stiffness());
    for q in 0..points {
        // the points belong to side a, so its surface can deflect at each of them independently
        let side = if rows[q] > 0.0 { q } else { points + q };
        if rows[side] > 0.0 {
            trace[side] -= layer.pressure[q] / rigid.slope[q];
        }
    }
    Ok(RigidStart { amounts, layer, trace })
}

/// Return the layer states for a trace (2n) of rigid surfaces, which approach each other by B u - d.
pub fn at(model: &Model, trace: &[f64]) -> Layer {
    at_approach(model, &model.compression(trace), &surface_slopes(model))
}

/// Return the layer states at the approach s of rigid surfaces, n, whose springs have the stiffness `slope`, n: those
/// with c + p/slope = s.
fn at_approach(model: &Model, approach: &[f64], slope: &[f64]) -> Layer {
    Layer::resolve(model, approach, &vec![0.0; approach.len()], slope, &[])
}

/// The problem of rigid bodies.
struct Rigid<'a> {
    model: &'a Model,
    motions: &'a Motions<'a>,
    /// w, work of the loads on each motion.
    work: DVector<f64>,
    /// rho0, n.
    slope: Vec<f64>,
    /// d, or what a given trace leaves of it, n.
    gap: Vec<f64>,
    /// Stiffness of the springs to the ground that resist the motions, one block a body.
    ground: Blocks,
}

impl Rigid<'_> {
    /// Return s = B E a - d, n.
    fn approach(&self, amounts: &DVector<f64>) -> Vec<f64> {
        let closing = self.motions.closing(amounts);
        closing.iter().zip(&self.gap).map(|(closing, gap)| closing - gap).collect()
    }

    fn states(&self, amounts: &DVector<f64>) -> Layer {
        at_approach(self.model, &self.approach(amounts), &self.slope)
    }

    /// Return omega Pi'' (n): springs of law and surfaces in series.
    fn springs(&self, layer: &Layer) -> Vec<f64> {
        let series = |q: usize| self.model.area[q] * in_series(layer.tangent[q], self.slope[q]);
        (0..self.slope.len()).map(series).collect()
    }

    /// Return the amounts by which `load` moves the bodies on these springs (n), with [`PROXIMAL`] springs everywhere.
    fn solve(&self, springs: &[f64], load: &DVector<f64>) -> DVector<f64> {
        let mut all = springs.to_vec();
        for (q, spring) in all.iter_mut().enumerate().filter(|(q, _)| self.slope[*q].is_finite()) {
            *spring += PROXIMAL * self.slope[q] * self.model.area[q];
        }
        let mut stiffness = self.motions.springs(&all);
        self.ground.stored().for_each(|(i, j, block)| stiffness.add(i, j, block));
        stiffness.factor().solve(load)
    }

    /// Whether a motion gains work, while neither the ground nor a contact that closes, nor a bond that changes,
    /// resists it.
    fn falls_for_ever(&self, motion: &DVector<f64>) -> bool {
        let closing = self.motions.closing(motion);
        let (gain, resisted) = (motion.dot(&self.work), motion.dot(&self.ground.multiply(motion)));
        let zero = PART * closing.iter().fold(0.0f64, |most, s| most.max(s.abs()));
        let mut points = self.model.each_point();
        gain > PART * motion.amax() * self.work.amax()
            && resisted <= PART * gain
            && points.all(|(q, pair, _)| closing[q] <= zero && (!pair.law.is_bonded() || -closing[q] <= zero))
    }

    /// Find the minimum by Newton's method with line search, from these amounts.
    ///
    /// # Errors
    /// A motion along which the energy falls for ever.
    fn descend(&self, mut amounts: DVector<f64>) -> Result<DVector<f64>, DVector<f64>> {
        let largest = self.work.amax();
        for _ in 0..MOST_STEPS {
            let layer = self.states(&amounts);
            let push = self.motions.work(&layer.force);
            let acting = self.motions.sizes(&layer.force);
            let pull = self.ground.multiply(&amounts);
            let lacking = &self.work - &push - &pull;
            let zero = |i: usize| PART * (acting[i].max(self.work[i].abs()).max(PART * largest));
            if (0..lacking.len()).all(|i| lacking[i].abs() <= zero(i)) {
                break;
            }
            let step = self.solve(&self.springs(&layer), &lacking);
            let closing = self.motions.closing(&step);
            // iterates that have no limit come near such a motion where a step, which a soft bond bends, does not
            if let Some(motion) = [&step, &amounts].into_iter().find(|motion| self.falls_for_ever(motion)) {
                return Err(motion.clone());
            }
            // loads and ground have the energy first_slope t + resisted t^2 / 2
            let (gain, resisted) = (step.dot(&self.work), step.dot(&self.ground.multiply(&step)));
            let first_slope = step.dot(&pull) - gain;
            let slope = |t: f64| {
                let force = self.states(&(&amounts + t * &step)).force;
                dot(&force, &closing) + first_slope + t * resisted
            };
            let first = dot(&layer.force, &closing) + first_slope;
            match field::zero(slope, first, SEARCH) {
                Ok(t) => amounts += t * &step,
                Err(Unbounded) if gain > PART * step.amax() * largest => return Err(step),
                // no load works on this way, and the energy of layers that push less and less is bounded below by zero
                Err(Unbounded) => break,
            }
        }
        Ok(amounts)
    }
}
