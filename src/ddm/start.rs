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

use crate::linalg::{axpy, dot};
use crate::model::layer::Layer;
use crate::model::line::{self, Unbounded};
use crate::model::rigid::{Motions, Moved, PART, TOLERANCE};
use crate::model::{Model, Sprung};
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
    let work: Vec<f64> = motions.bodies().iter().copied().flatten().map(|motion| motion.work).collect();
    let mut gap = model.gap.clone();
    if let Some(given) = given {
        gap = model.compression(given).into_iter().map(|c| -c).collect();
    }
    let (slope, bare) = (surface_slopes(model), vec![false; gap.len()]);
    let mut rigid = Rigid {
        model,
        motions: &motions,
        work: DVector::from_vec(work),
        slope,
        gap,
        bare,
        grounded: true,
        balanced: PART,
    };
    let mut amounts = DVector::zeros(motions.count());
    // bodies that neither loads nor contacts push stay where they are: all else would be rounding
    let at_rest = motions.count() == 0 || rigid.work == amounts && rigid.approach(&amounts).iter().all(|&s| s <= 0.0);
    if !at_rest {
        // with rho0 of whole surfaces, then with that of the contact found
        for _ in 0..2 {
            amounts = rigid.minimize().map_err(|motion| motions.names(&motion))?;
            let approach = rigid.approach(&amounts);
            let found = slopes(model, |q| approach[q] > 0.0).into_iter().zip(&mut rigid.slope);
            // a contact that opens as a whole keeps its slope
            found.filter(|(new, _)| new.is_finite()).for_each(|(new, old)| *old = new);
        }
        rigid.open_idle(&mut amounts);
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

/// Places that lines of slope `rho`, n, led to, with the bodies moved rigidly until the pressures there balance the loads to `tolerance` of the run, if a
/// motion of the bodies would else meet no resistance: a linear step from there would know nothing of the contact that stops it. They are where
/// the next step begins; the iterate that they came from has errors of its own.
pub fn balanced(model: &Model, places: &Layer, rho: &[f64], tolerance: f64) -> Layer {
    let motions = Motions::of(model);
    if motions.count() == 0 || motions.springs(&places.springs(model)).factor(TOLERANCE).kernel().is_empty() {
        return places.clone();
    }
    // where nothing stops the motion, the linear step says so
    balance(model, &motions, places, rho, tolerance).map_or_else(|| places.clone(), |(_, places)| places)
}

/// Amounts of these motions by which places that lines of slope `rho`, n, led to come to balance the loads to a tolerance, and the places then;
/// none if nothing stops a motion.
pub fn balance(
    model: &Model,
    motions: &Motions,
    places: &Layer,
    rho: &[f64],
    tolerance: f64,
) -> Option<(DVector<f64>, Layer)> {
    let work: Vec<f64> = motions.bodies().iter().copied().flatten().map(|motion| motion.work).collect();
    let gap: Vec<f64> = (0..rho.len()).map(|q| -places.compression[q] - places.pressure[q] / rho[q]).collect();
    let (work, slope, bare) = (DVector::from_vec(work), rho.to_vec(), vec![false; gap.len()]);
    let rigid = Rigid { model, motions, work, slope, gap, bare, grounded: false, balanced: tolerance };
    let amounts = rigid.descend(DVector::zeros(motions.count())).ok()?;
    let places = rigid.places(&amounts);
    Some((amounts, places))
}

fn met(model: &Model, approach: &[f64], slope: &[f64]) -> Layer {
    Layer::meet(model, approach, &vec![0.0; approach.len()], slope)
}

/// Stiffness of an elastic foundation over E*/a, with the half width or radius a of the contact, in the plane and in space: it then has
/// the contact of Hertz (Johnson, Contact Mechanics, 1985, section 4.3).
const FOUNDATION: [f64; 2] = [1.18, 1.70];

/// Share of that stiffness, for a contact of spheres that is an eighth wider than Hertz's: steps that let points open are better than
/// those that close them. Spheres and cylinders took the fewest steps at this share, of 0.3 to 1.2 (docs/methods.md).
const LARGER: f64 = 0.7;

/// rho0: stiffness per area of the two bodies of each point in series, for contact all over their surfaces.
pub fn surface_slopes(model: &Model) -> Vec<f64> {
    slopes(model, |_| true)
}

/// The same for contact at the points that are `closed`: each body gives way as over its depth, or as over its contact if that is
/// smaller.
fn slopes(model: &Model, closed: impl Fn(usize) -> bool) -> Vec<f64> {
    let (points, rows) = (model.points(), model.row_stiffness());
    let stiffness = |body: usize, per_modulus: f64| {
        let slot = &model.bodies[body];
        slot.modulus * per_modulus.max(slot.depth.recip())
    };
    let largest = (0..model.bodies.len()).map(|body| stiffness(body, 0.0)).fold(f64::MIN_POSITIVE, f64::max);
    let mut slopes = Vec::with_capacity(points);
    for (i, pair) in model.pairs.iter().enumerate() {
        let area: f64 = model.range(i).filter(|&q| closed(q)).map(|q| model.weight[q]).sum();
        let half = if pair.measure == "length" { 0.5 * area } else { (area / std::f64::consts::PI).sqrt() };
        let per_modulus = LARGER * FOUNDATION[usize::from(pair.measure != "length")] / half;
        slopes.extend(model.range(i).map(|q| {
            // a row without stiffness cannot move
            let compliance = |side: usize| match rows[side * points + q] {
                0.0 => 0.0,
                _ => stiffness(pair.bodies[side], per_modulus).recip(),
            };
            let sum = compliance(0) + compliance(1);
            if sum > 0.0 { sum.recip() } else { largest }
        }));
    }
    slopes
}

/// Stiffness of two springs in a row, either of which may be zero or infinite.
pub fn in_series(a: f64, b: f64) -> f64 {
    (a.recip() + b.recip()).recip()
}

#[derive(Clone)]
struct Rigid<'a> {
    model: &'a Model,
    motions: &'a Motions<'a>,
    /// w.
    work: DVector<f64>,
    /// rho0.
    slope: Vec<f64>,
    /// d, less what a given start closes of it.
    gap: Vec<f64>,
    /// Points where surfaces meet without a layer, n.
    bare: Vec<bool>,
    /// Whether the motions are also those that springs to the ground resist.
    grounded: bool,
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
        self.places_at(&self.approach(amounts))
    }

    fn places_at(&self, approach: &[f64]) -> Layer {
        let mut layer = met(self.model, approach, &self.slope);
        for q in (0..approach.len()).filter(|&q| self.bare[q]) {
            layer.pressure[q] = self.slope[q] * approach[q].max(0.0);
            layer.force[q] = self.model.weight[q] * layer.pressure[q];
            layer.tangent[q] = if approach[q] > 0.0 { f64::INFINITY } else { 0.0 };
        }
        layer
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
        self.grounded().for_each(|(body, sprung)| stiffness.add(body, body, &sprung.stiffness));
        stiffness.factor(TOLERANCE).solve(load)
    }

    /// Bodies on springs.
    fn grounded(&self) -> impl Iterator<Item = (usize, &Sprung)> {
        let bodies = self.model.bodies.iter().enumerate().filter(|_| self.grounded);
        bodies.filter_map(|(body, slot)| Some((body, slot.sprung.as_ref()?)))
    }

    /// Forces of the springs to the ground on each motion.
    fn pull(&self, amounts: &DVector<f64>) -> DVector<f64> {
        let mut pull = DVector::zeros(amounts.len());
        for (body, sprung) in self.grounded() {
            let own = self.motions.of_body(body);
            pull.rows_mut(own.start, own.len()).copy_from(&(&sprung.stiffness * amounts.rows(own.start, own.len())));
        }
        pull
    }

    /// Whether a motion opens contacts only.
    fn opens(&self, closing: &[f64]) -> bool {
        let most = closing.iter().fold(0.0f64, |most, s| most.max(s.abs()));
        closing.iter().all(|&s| s <= PART * most)
    }

    /// The minimum, by Newton's method with line search.
    ///
    /// # Errors
    /// A motion along which the energy falls for ever.
    fn minimize(&self) -> Result<DVector<f64>, DVector<f64>> {
        // drawn together as far as the surfaces let them, contact is found from the closed side
        let everywhere: Vec<f64> =
            self.slope.iter().zip(&self.model.weight).map(|(slope, weight)| slope * weight).collect();
        let drawn: Vec<f64> = everywhere.iter().zip(&self.gap).map(|(spring, gap)| spring * gap).collect();
        self.descend(self.solve(&everywhere, &(&self.work + self.motions.work(&drawn))))
    }

    /// The minimum from `amounts` on.
    ///
    /// # Errors
    /// A motion along which the energy falls for ever.
    fn descend(&self, mut amounts: DVector<f64>) -> Result<DVector<f64>, DVector<f64>> {
        let largest = self.work.amax();
        for _ in 0..STEPS {
            let places = self.places(&amounts);
            let push = self.motions.work(&places.force);
            let acting = self.motions.sizes(&places.force);
            let lacking = &self.work - &push - self.pull(&amounts);
            let small = |i: usize| self.balanced * (acting[i].max(self.work[i].abs()).max(PART * largest));
            if (0..lacking.len()).all(|i| lacking[i].abs() <= small(i)) {
                break;
            }
            let step = self.solve(&self.springs(&places), &lacking);
            let closing = self.motions.closing(&step);
            let (gain, resisted) = (step.dot(&self.work), step.dot(&self.pull(&step)));
            let gains = gain > PART * step.amax() * largest;
            // near rest the step and what resists it are small
            if gains && resisted <= PART * step.dot(&lacking) && self.opens(&closing) {
                return Err(step);
            }
            let start = places.force;
            let held = step.dot(&self.pull(&amounts)) - gain;
            let slope = |t: f64| {
                let approach = self.approach(&(&amounts + t * &step));
                let force = self.places_at(&approach).force;
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

    /// Opens the contacts that an overlap alone presses together, and loads do not, if bodies can move so that no such contact is left.
    /// Any part of the overlap that is left would be a pressure that vanishes slowly.
    fn open_idle(&self, amounts: &mut DVector<f64>) {
        let places = self.places(amounts);
        let force = |pair: usize| places.force[self.model.range(pair)].iter().sum::<f64>();
        let most = (0..self.model.pairs.len()).map(force).fold(0.0, f64::max);
        let unloaded = self.work.iter().all(|&work| work == 0.0);
        let idle = |pair: &usize| unloaded || force(*pair) <= PART.sqrt() * most;
        let idle: Vec<usize> =
            (0..self.model.pairs.len()).filter(idle).flat_map(|pair| self.model.range(pair)).collect();
        // bodies give way by about what they are compressed elsewhere, and by what an origin's digits leave of their way
        let deepest = places.compression.iter().copied().fold(0.0, f64::max);
        let approach = self.approach(amounts);
        let terms = |q: usize| self.gap[q].abs().max((approach[q] + self.gap[q]).abs());
        let way = idle.iter().map(|&q| terms(q)).fold(0.0, f64::max);
        let room = 2.0 * (deepest + 4.0 * super::origin::ROUNDING * way);
        if idle.iter().all(|&q| approach[q] <= -0.5 * room) {
            return;
        }
        let mut gap = self.gap.clone();
        let mut bare = vec![false; gap.len()];
        idle.iter().for_each(|&q| (gap[q], bare[q]) = (gap[q] - room, true));
        let wider = Rigid { gap, bare, ..self.clone() };
        // layers that are soft at first would open slowly
        if let Ok(moved) = wider.descend(amounts.clone()) {
            let approach = self.approach(&moved);
            if idle.iter().all(|&q| approach[q] <= -0.5 * room) {
                *amounts = moved;
            }
        }
    }
}
