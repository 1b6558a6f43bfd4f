//! The start: rigid bodies on their own surfaces.
//!
//! The same problem in the rigid motions E that supports leave free, where K is that of springs to the ground alone, and each layer in series with a spring rho0 that
//! stands for the surfaces of the two bodies: pressure p at the approach s of the rigid surfaces is the place with c + p/rho0 = s on
//! the law. With w the work of the loads on E, the energy
//!
//! ```text
//! sum omega Pi(s) - w'a,      s = B E a - d,    Pi' = p,    0 <= Pi'' <= rho0
//! ```
//!
//! is convex in a few unknowns a body, and its slopes are bounded whatever the law. Its places begin the iteration.
//!
//! It has no minimum exactly when loads push bodies away from all that could stop them: a motion a that closes no contact,
//! B E a <= 0, and gains, w'a > 0 (Farkas). Elastic bodies then have no equilibrium either.
//!
//! What is less than [`PART`] of what it could be counts as zero here: forces out of balance, as the start needs no more digits than the
//! elastic bodies leave of it; and what a motion closes, by rounding and proximal springs. One that is felt at a meshed circle of
//! 1000 edges closes 1e-5 of itself.

use crate::linalg::{Blocks, axpy, dot};
use crate::model::Model;
use crate::model::layer::Layer;
use crate::model::line::{self, Unbounded};
use crate::model::rigid::{Motions, Moved, PART, TOLERANCE};
use crate::model::surface::{contact_slopes, in_series, surface_slopes};
use nalgebra::DVector;

/// Where a run begins.
#[derive(Debug, Clone)]
pub struct RigidStart {
    /// Amounts of the free motions of all bodies.
    pub amounts: DVector<f64>,
    /// Places on the laws.
    pub places: Layer,
    /// Traces of E a, less what the surfaces give way: B u - d is the compression of the places.
    pub trace: Vec<f64>,
}

/// Share of the springs rho0 that resists every motion: of one that no closed contact resists, a step goes as far as the line
/// search finds contact. A step then closes pressed contacts by this share of what it opens others.
const PROXIMAL: f64 = 1e-9;

/// Newton steps at most; random scenes and walls of 4096 bricks take 2 to 20.
const STEPS: usize = 200;

/// The start of a model, or the motion along which its energy falls for ever. The surfaces of the rigid bodies have the shapes that
/// displacements with the trace `given` (2n) give them; no motion is theirs.
///
/// # Errors
/// Which bodies move how, if loads push them away for ever.
pub fn find(model: &Model, given: Option<&[f64]>) -> Result<RigidStart, Vec<Moved>> {
    let motions = Motions::with_springs(model);
    let mut gap = model.gap.clone();
    if let Some(given) = given {
        gap = model.compression(given).into_iter().map(|c| -c).collect();
    }
    let (work, slope) = (motions.loads(), surface_slopes(model));
    let mut ground = motions.blocks();
    let sprung = model.bodies.iter().enumerate().filter_map(|(body, slot)| Some((body, slot.sprung.as_ref()?)));
    sprung.for_each(|(body, sprung)| ground.add(body, body, &sprung.stiffness));
    let mut rigid = Rigid { model, motions: &motions, work, slope, gap, ground, balanced: PART };
    let mut amounts = DVector::zeros(motions.count());
    if !amounts.is_empty() {
        // with rho0 of whole surfaces, then with that of the contact found
        amounts = rigid.descend(amounts).map_err(|motion| motions.names(&motion))?;
        let approach = rigid.approach(&amounts);
        rigid.slope = contact_slopes(model, |q| approach[q] > 0.0);
        amounts = rigid.descend(amounts).map_err(|motion| motions.names(&motion))?;
    }
    let layer = rigid.places(&amounts);
    let mut trace = motions.trace(model, &amounts);
    given.into_iter().for_each(|given| axpy(1.0, given, &mut trace));
    let (points, rows) = (model.points(), model.row_stiffness());
    for q in 0..points {
        // side a carries the points: it can give way at each by itself
        let side = if rows[q] > 0.0 { q } else { points + q };
        if rows[side] > 0.0 {
            trace[side] -= layer.pressure[q] / rigid.slope[q];
        }
    }
    Ok(RigidStart { amounts, places: layer, trace })
}

/// The places of surfaces that approach each other by B u - d without giving way, for a trace of rigid surfaces.
pub fn at(model: &Model, trace: &[f64]) -> Layer {
    met(model, &model.compression(trace), &surface_slopes(model))
}

/// Amounts of these motions by which states (c, p), n each, come to have places, on lines of slope `rho`, whose pressures balance the loads to a
/// tolerance; none if nothing stops a motion.
pub fn balance(
    model: &Model,
    motions: &Motions,
    [compression, pressure]: [&[f64]; 2],
    rho: &[f64],
    tolerance: f64,
) -> Option<DVector<f64>> {
    let gap = compression.iter().zip(pressure).zip(rho).map(|((c, p), rho)| -c - p / rho).collect();
    let (work, slope) = (motions.loads(), rho.to_vec());
    Rigid { model, motions, work, slope, gap, ground: motions.blocks(), balanced: tolerance }
        .descend(DVector::zeros(motions.count()))
        .ok()
}

fn met(model: &Model, approach: &[f64], slope: &[f64]) -> Layer {
    Layer::resolve(model, approach, &vec![0.0; approach.len()], slope, &[])
}

struct Rigid<'a> {
    model: &'a Model,
    motions: &'a Motions<'a>,
    /// w.
    work: DVector<f64>,
    /// rho0.
    slope: Vec<f64>,
    /// d, less what a given start closes of it.
    gap: Vec<f64>,
    /// Springs to the ground that resist the motions, a block a body.
    ground: Blocks,
    /// Forces out of balance that count as zero, as a share of those at work.
    balanced: f64,
}

impl Rigid<'_> {
    /// s = B E a - d.
    fn approach(&self, amounts: &DVector<f64>) -> Vec<f64> {
        let closing = self.motions.closing(amounts);
        closing.iter().zip(&self.gap).map(|(closing, gap)| closing - gap).collect()
    }

    fn places(&self, amounts: &DVector<f64>) -> Layer {
        met(self.model, &self.approach(amounts), &self.slope)
    }

    /// omega Pi'': springs of law and surfaces in series.
    fn springs(&self, places: &Layer) -> Vec<f64> {
        let series = |q: usize| self.model.weight[q] * in_series(places.tangent[q], self.slope[q]);
        (0..self.slope.len()).map(series).collect()
    }

    /// A solution of springs x = load, with [`PROXIMAL`] springs everywhere.
    fn solve(&self, springs: &[f64], load: &DVector<f64>) -> DVector<f64> {
        let all = springs.iter().zip(&self.slope).zip(&self.model.weight);
        let resisted = |((spring, slope), weight): ((&f64, &f64), &f64)| match slope.is_finite() {
            true => spring + PROXIMAL * slope * weight,
            false => *spring,
        };
        let all: Vec<f64> = all.map(resisted).collect();
        let mut stiffness = self.motions.springs(&all);
        self.ground.stored().for_each(|(i, j, block)| stiffness.add(i, j, block));
        stiffness.factor(TOLERANCE).solve(load)
    }

    /// The minimum from `amounts` on, by Newton's method with line search.
    ///
    /// # Errors
    /// A motion along which the energy falls for ever.
    fn descend(&self, mut amounts: DVector<f64>) -> Result<DVector<f64>, DVector<f64>> {
        let largest = self.work.amax();
        for _ in 0..STEPS {
            let places = self.places(&amounts);
            let push = self.motions.work(&places.force);
            let acting = self.motions.sizes(&places.force);
            let pull = self.ground.multiply(&amounts);
            let lacking = &self.work - &push - &pull;
            let small = |i: usize| self.balanced * (acting[i].max(self.work[i].abs()).max(PART * largest));
            if (0..lacking.len()).all(|i| lacking[i].abs() <= small(i)) {
                break;
            }
            let step = self.solve(&self.springs(&places), &lacking);
            let closing = self.motions.closing(&step);
            let (gain, resisted) = (step.dot(&self.work), step.dot(&self.ground.multiply(&step)));
            let gains = gain > PART * step.amax() * largest;
            let most = closing.iter().fold(0.0f64, |most, s| most.max(s.abs()));
            let opens = closing.iter().all(|&s| s <= PART * most);
            // where no contact closes, the energy falls at least as long as that of loads and ground: held t + resisted t^2 / 2
            let held = step.dot(&pull) - gain;
            if gains && resisted <= -PART * held && opens {
                return Err(step);
            }
            let start = places.force;
            let slope = |t: f64| {
                let force = self.places(&(&amounts + t * &step)).force;
                dot(&force, &closing) + held + t * resisted
            };
            let first = dot(&start, &closing) + held;
            match line::zero(slope, first, 1e-3) {
                Ok(t) => amounts += t * &step,
                Err(Unbounded) if gains => return Err(step),
                // layers push ever less, and no load works on the way: their energy is bounded below by zero
                Err(Unbounded) => break,
            }
        }
        Ok(amounts)
    }
}
