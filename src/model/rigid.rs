//! The free rigid motions E of all bodies together, as they close the contact points: B E. They are also a coarse space of the linear
//! system, and the origin of displacements.
//!
//! Motions are numbered consecutively, body by body. Since K E = 0, E'(K + B'DB) z takes only sums over contact points. Combinations that no contact
//! resists are the kernel of [`Motions::springs`], up to [`TOLERANCE`].

use super::{BodySlot, Exchange, Field, Model, Motion, Segment};
use crate::linalg::{Blocks, Factor, axpy, dot, fit};
pub use crate::linalg::{PART, TOLERANCE};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;
use std::rc::Rc;

/// The free rigid motions of all bodies.
pub struct Motions<'a> {
    /// First motion of each body, and the number of all.
    first: Vec<usize>,
    /// Motions of each body.
    bodies: Vec<&'a [Motion]>,
    pairs: Vec<Pair<'a>>,
}

/// A pair and the bodies at its sides.
struct Pair<'a> {
    /// Numbers of its points.
    points: Range<usize>,
    sides: Vec<PairSide<'a>>,
}

/// A body at one side of a pair.
struct PairSide<'a> {
    body: usize,
    /// The trace of each of its motions there; `None` if the motion only slides along the surface.
    traces: Vec<Option<&'a [f64]>>,
}

/// A combined motion of one body, named after the motions that it combines: "translation along x and rotation".
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Moved {
    /// Number of the body.
    pub body: usize,
    /// Name of the motion.
    pub name: String,
}

impl<'a> Motions<'a> {
    /// Return the motions of bodies with these contact rows and free motions. `points` are the numbers of points of the pairs.
    pub fn new(bodies: impl IntoIterator<Item = (&'a [Segment], &'a [Motion])>, points: &[usize]) -> Self {
        let (mut first, mut all, mut pairs, mut next) = (vec![0], Vec::new(), Vec::new(), 0);
        for count in points {
            pairs.push(Pair { points: next..next + count, sides: Vec::new() });
            next += count;
        }
        for (body, (segments, motions)) in bodies.into_iter().enumerate() {
            let mut row = 0;
            for segment in segments {
                let pair = &mut pairs[segment.pair];
                let rows = row..row + pair.points.len();
                row = rows.end;
                // sliding along a surface closes points by rounding errors, whose squares must not count as stiffness
                let closes = |trace: &&[f64]| trace.iter().any(|t| t * t > TOLERANCE);
                let traces = motions.iter().map(|motion| Some(&motion.trace[rows.clone()]).filter(closes)).collect();
                pair.sides.push(PairSide { body, traces });
            }
            first.push(first[body] + motions.len());
            all.push(motions);
        }
        Self { first, bodies: all, pairs }
    }

    /// Return the motions of a model's bodies that neither supports nor springs constrain.
    pub fn of(model: &'a Model) -> Self {
        Self::of_model(model, |slot| &slot.motions)
    }

    /// Return the motions of a model's bodies that supports leave free, with those that springs to the ground resist.
    pub fn with_springs(model: &'a Model) -> Self {
        Self::of_model(model, |slot| slot.sprung.as_ref().map_or(&slot.motions, |sprung| &sprung.motions))
    }

    fn of_model(model: &'a Model, motions: impl Fn(&'a BodySlot) -> &'a Vec<Motion>) -> Self {
        let points: Vec<usize> = (0..model.pairs.len()).map(|pair| model.range(pair).len()).collect();
        Self::new(model.bodies.iter().map(|slot| (&slot.segments[..], &motions(slot)[..])), &points)
    }

    /// Return the number of all motions.
    pub fn count(&self) -> usize {
        self.first[self.first.len() - 1]
    }

    /// Return the numbers of the motions of a body.
    pub fn of_body(&self, body: usize) -> Range<usize> {
        self.first[body]..self.first[body + 1]
    }

    /// Return a zero matrix with a row and column of blocks for each body.
    pub fn blocks(&self) -> Blocks {
        Blocks::new(&self.first.windows(2).map(|ends| ends[1] - ends[0]).collect::<Vec<usize>>())
    }

    /// Return (B E)' diag(`weight`) (B E) for springs at the points, one entry a point. The matrix has a row and column of blocks for each body.
    pub fn springs(&self, weight: &[f64]) -> Blocks {
        let mut springs = self.blocks();
        for Pair { points, sides } in &self.pairs {
            let weight = &weight[points.clone()];
            let force = |trace: &[f64]| trace.iter().zip(weight).map(|(t, w)| t * w).collect::<Vec<f64>>();
            let forces: Vec<Vec<Option<Vec<f64>>>> =
                sides.iter().map(|side| side.traces.iter().map(|trace| trace.map(force)).collect()).collect();
            let block = |s: usize, t: usize| {
                DMatrix::from_fn(sides[s].traces.len(), sides[t].traces.len(), |i, j| {
                    forces[s][i].as_ref().zip(sides[t].traces[j]).map_or(0.0, |(force, trace)| dot(force, trace))
                })
            };
            for s in 0..sides.len() {
                for t in s..sides.len() {
                    let (i, j) = (sides[s].body, sides[t].body);
                    let block = block(s, t);
                    // a body may be at both sides
                    springs.add(i, j, &if i == j && s != t { &block + block.transpose() } else { block });
                }
            }
        }
        springs
    }

    /// Return B E `amounts`, by which each point closes.
    pub fn closing(&self, amounts: &DVector<f64>) -> Vec<f64> {
        let mut closing = vec![0.0; self.pairs.last().map_or(0, |pair| pair.points.end)];
        for (points, motion, trace) in self.traces() {
            if amounts[motion] != 0.0 {
                axpy(amounts[motion], trace, &mut closing[points.clone()]);
            }
        }
        closing
    }

    /// Return the trace vector of E `amounts`, for the model whose motions these are.
    pub fn trace(&self, model: &Model, amounts: &DVector<f64>) -> Vec<f64> {
        let mut trace = vec![0.0; 2 * model.points()];
        for (body, motions) in self.bodies.iter().enumerate() {
            let Some(motion) = motions.first() else { continue };
            let mut rows = vec![0.0; motion.trace.len()];
            let own = self.of_body(body).map(|i| amounts[i]);
            motions.iter().zip(own).for_each(|(motion, a)| axpy(a, &motion.trace, &mut rows));
            model.put(body, &rows, &mut trace);
        }
        trace
    }

    /// Return E `amounts` as a field of the model whose motions these are.
    pub fn field(&self, model: &Model, amounts: &DVector<f64>) -> Field {
        let mut field = Field::zero(model);
        field.trace = self.trace(model, amounts);
        for (body, slot) in model.bodies.iter().enumerate() {
            let Some(facts) = slot.local.as_ref().map(|body| body.states()) else { continue };
            // a state ends with the amounts of its rigid motions
            let own = fit(&facts.traces, &model.of_body(body, &field.trace));
            let state = &mut field.states[body];
            state[facts.dofs..].copy_from_slice(&own);
        }
        field
    }

    /// Return the work of the loads on each motion.
    pub fn loads(&self) -> DVector<f64> {
        DVector::from_iterator(self.count(), self.bodies.iter().copied().flatten().map(|motion| motion.work))
    }

    /// Return (B E)' `force`, the work of forces at the points on each motion.
    pub fn work(&self, force: &[f64]) -> DVector<f64> {
        let mut work = DVector::zeros(self.count());
        self.traces().for_each(|(points, motion, trace)| work[motion] += dot(trace, &force[points.clone()]));
        work
    }

    /// Return |(B E)'| |`force`|, the work on each motion that forces at the points of any signs could do.
    pub fn sizes(&self, force: &[f64]) -> DVector<f64> {
        let mut sizes = DVector::zeros(self.count());
        for (points, motion, trace) in self.traces() {
            sizes[motion] += trace.iter().zip(&force[points.clone()]).map(|(t, f)| (t * f).abs()).sum::<f64>();
        }
        sizes
    }

    /// Return each trace by which a motion closes a pair: (points of the pair, number of the motion, its trace at these points).
    fn traces(&self) -> impl Iterator<Item = (&Range<usize>, usize, &'a [f64])> {
        let sides = self.pairs.iter().flat_map(|pair| pair.sides.iter().map(move |side| (&pair.points, side)));
        sides.flat_map(move |(points, side)| {
            let traces = self.of_body(side.body).zip(&side.traces);
            traces.filter_map(move |(motion, trace)| trace.map(|trace| (points, motion, trace)))
        })
    }

    /// Return the bodies that a combined motion moves, with the name of the motion of each.
    pub fn names(&self, amounts: &DVector<f64>) -> Vec<Moved> {
        let least = PART * amounts.amax();
        let of_body = |(body, motions): (usize, &&[Motion])| {
            let own = amounts.rows(self.first[body], motions.len());
            let name = || combined(motions.iter().map(|motion| &motion.name[..]), own.iter().copied());
            (own.amax() > least).then(|| Moved { body, name: name() })
        };
        self.bodies.iter().enumerate().filter(|(_, motions)| !motions.is_empty()).filter_map(of_body).collect()
    }
}

/// Return the name of a combination of motions, from the names of those with an amount that matters.
pub fn combined<'n>(names: impl Iterator<Item = &'n str>, amounts: impl Iterator<Item = f64> + Clone) -> String {
    let least = PART * amounts.clone().fold(0.0, |most: f64, amount| most.max(amount.abs()));
    let parts = names.zip(amounts).filter(|(_, amount)| amount.abs() > least);
    crate::error::joined(parts.map(|(name, _)| name))
}

/// The free rigid motions of the bodies as a coarse space, in the vectors of an iterative solver on this rank. The matrix is
/// H = K + B'DB of all bodies together, where D are springs at the contact points.
///
/// Many bodies on each other are a frame whose joints are layers. No smoother reduces errors in which the frame moves as a whole, and
/// coarse levels of multigrid do so only as far as they have the rigid motions of each body. A Robin sweep passes information only from a
/// body to its neighbours. So H is solved exactly in the space of all free rigid motions, which are the columns of Z (balancing: Mandel,
/// Comm. Numer. Meth. Engng 9, 1993). Since K Z = 0, HZ = B'D BZ takes only sums over contact points. Z'HZ has one block for each body
/// and one for each two bodies in contact. Motions that no spring resists are left out.
pub struct CoarseSpace {
    /// Contact rows and motions of each body.
    bodies: Vec<(Vec<Segment>, Vec<Motion>)>,
    /// Number of points of each pair.
    points: Vec<usize>,
    /// The columns of Z for the local bodies.
    columns: Vec<MotionColumn>,
    exchange: Rc<dyn Exchange>,
}

/// A column of Z: the entries of one rigid motion in one vector.
struct MotionColumn {
    /// Number of the motion among those of all bodies.
    motion: usize,
    /// Number of the vector.
    vector: usize,
    /// First entry in that vector.
    first: usize,
    values: Vec<f64>,
}

impl CoarseSpace {
    /// Return the space for the bodies of a model. Without an `offset`, there is one vector for each body: its state, whose last entries are rigid motions.
    /// With one, there is a single vector, in which motions are displacements of nodes; `offset` is the first entry of each body, and the length.
    pub fn of(model: &Model, offset: Option<&[usize]>) -> Self {
        let (mut columns, mut first_motion) = (Vec::new(), 0);
        for (body, slot) in model.bodies.iter().enumerate() {
            let numbers = first_motion..;
            first_motion += slot.motions.len();
            let Some(states) = slot.local.as_ref().map(|local| local.states()) else { continue };
            for (motion, Motion { trace, .. }) in numbers.zip(&slot.motions) {
                let amounts = fit(&states.traces, trace);
                columns.push(match offset {
                    None => MotionColumn { motion, vector: body, first: states.dofs, values: amounts },
                    Some(offset) => {
                        let mut values = vec![0.0; offset[body + 1] - offset[body]];
                        amounts.iter().zip(&states.motions).for_each(|(a, shape)| axpy(*a, shape, &mut values));
                        MotionColumn { motion, vector: 0, first: offset[body], values }
                    }
                });
            }
        }
        let bodies = model.bodies.iter().map(|slot| (slot.segments.clone(), slot.motions.clone())).collect();
        let points = (0..model.pairs.len()).map(|pair| model.range(pair).len()).collect();
        Self { bodies, points, columns, exchange: model.exchange.clone() }
    }

    /// Return the rigid motions of all bodies.
    fn motions(&self) -> Motions<'_> {
        Motions::new(self.bodies.iter().map(|(segments, motions)| (&segments[..], &motions[..])), &self.points)
    }
}

/// The coarse space for one set of springs D.
pub struct CoarseOperator {
    space: Rc<CoarseSpace>,
    springs: Vec<f64>,
    factor: Factor,
}

impl CoarseOperator {
    /// Factor Z'HZ for `springs`, the diagonal of D, one entry a contact point.
    pub fn new(space: Rc<CoarseSpace>, springs: &[f64]) -> Self {
        let factor = space.motions().springs(springs).factor();
        Self { space, springs: springs.to_vec(), factor }
    }

    /// Return the amounts y of the solution in the space, with Z'HZ y = Z'r, and its squared energy norm. One message.
    pub fn solve(&self, r: &[impl AsRef<[f64]>]) -> (DVector<f64>, f64) {
        let mut work = self.local_work(r);
        self.space.exchange.sum(work.as_mut_slice());
        let y = self.factor.solve(&work);
        let energy = y.dot(&work);
        (y, energy)
    }

    /// Return Z'r, of the vectors of this rank alone.
    fn local_work(&self, r: &[impl AsRef<[f64]>]) -> DVector<f64> {
        let motions = self.space.bodies.iter().map(|(_, motions)| motions.len()).sum();
        let mut work = DVector::zeros(motions);
        for MotionColumn { motion, vector, first, values } in &self.space.columns {
            work[*motion] += dot(values, &r[*vector].as_ref()[*first..]);
        }
        work
    }

    /// Return the work Z'H z of a vector z on the motions, from its closings B z at the points, n.
    fn work(&self, closing: &[f64]) -> DVector<f64> {
        let force: Vec<f64> = self.springs.iter().zip(closing).map(|(spring, s)| spring * s).collect();
        self.space.motions().work(&force)
    }

    /// Return the amounts y of the part that a vector z has in the space, with Z'HZ y = Z'H z, from its closings B z at the points, n.
    pub fn part(&self, closing: &[f64]) -> DVector<f64> {
        self.factor.solve(&self.work(closing))
    }

    /// Return the amounts y that correct z as a solution of H z = r, with Z'HZ y = Z'(r - H z). Each rank has one term of the sum B z over ranks,
    /// n, as `closing`. One message.
    pub fn correction(&self, r: &[f64], closing: &[f64]) -> DVector<f64> {
        let mut work = self.local_work(&[r]) - self.work(closing);
        self.space.exchange.sum(work.as_mut_slice());
        self.factor.solve(&work)
    }

    /// Return D B Z y, the forces of the springs at the points.
    pub fn forces(&self, y: &DVector<f64>) -> Vec<f64> {
        self.springs.iter().zip(self.space.motions().closing(y)).map(|(spring, s)| spring * s).collect()
    }

    /// Add s Z y to x.
    pub fn add(&self, s: f64, y: &DVector<f64>, x: &mut [impl AsMut<[f64]>]) {
        for MotionColumn { motion, vector, first, values } in &self.space.columns {
            axpy(s * y[*motion], values, &mut x[*vector].as_mut()[*first..]);
        }
    }
}

/// Binary digits of the amounts of motions in an origin. Their products with coordinates of 29 digits are then exact.
const DIGITS: u32 = 24;

/// Rigid motions of the start that were subtracted from displacements and gaps: the origin of displacements.
///
/// A body that falls far onto its neighbour has traces that are huge compared with the compression of the layer. Each sum of two
/// traces, less the gap, is rounded anew, and the pressures of a stiff layer vary with these rounding errors. So the motions of the
/// start are subtracted from the gaps once, and the iteration works on displacements relative to them. The motions come from the scene
/// alone, not from a method or its start, and have few digits. So every method sees the same gaps.
pub struct DisplacementOrigin {
    motion: Field,
    /// The gaps without the motions, n.
    gap: Vec<f64>,
    /// Minus the work of the loads on the motions, which must be added to F1.
    pub energy: f64,
    /// The start relative to the origin: the part of its motions that the digits of the origin do not hold.
    pub rest: Field,
}

impl DisplacementOrigin {
    /// Subtract the motions of a start from the gaps of `model`. `amounts` has one entry for each motion of [`Motions::with_springs`]. Return `None` if all
    /// are zero. Collective.
    pub fn take(model: &mut Model, amounts: &DVector<f64>) -> Option<Self> {
        if amounts.iter().all(|&amount| amount == 0.0) {
            return None;
        }
        let mut motion = Motions::with_springs(model).field(model, amounts);
        let mut rest = Field::rest(model);
        let mut energy = [0.0];
        for (index, slot) in model.bodies.iter_mut().enumerate() {
            let state = &mut motion.states[index];
            // a motion that springs resist is not free, so it stays part of the displacements
            if slot.sprung.is_some() {
                state.fill(0.0);
                continue;
            }
            let Some(body) = slot.local.as_ref() else { continue };
            let deformation = body.states().dofs;
            for (origin, beyond) in state[deformation..].iter_mut().zip(&mut rest.states[index][deformation..]) {
                let amount = *origin;
                *origin = short(amount);
                *beyond += amount - *origin;
            }
            // at rest and without contact the residual is the load; rigid motions cause no strain, so K u = 0
            let (at_rest, product) = (body.states().rest(), vec![0.0; state.len()]);
            let mut load = product.clone();
            body.residual(&at_rest, &product, &vec![0.0; slot.row_stiffness.len()], &mut load);
            energy[0] -= dot(&load[deformation..], &state[deformation..]);
        }
        // one message has the energy and both traces
        motion.trace_here(model);
        rest.trace_here(model);
        let mut message = [&energy[..], &motion.trace, &rest.trace].concat();
        model.exchange.sum(&mut message);
        rest.trace = message.split_off(1 + motion.trace.len());
        motion.trace = message.split_off(1);
        let gap = model.gap.clone();
        model.gap.iter_mut().zip(motion.closing()).for_each(|(gap, closing)| *gap -= closing);
        Some(Self { motion, gap, energy: message[0], rest })
    }

    /// Return the traces of the motions, 2n.
    pub fn trace(&self) -> &[f64] {
        &self.motion.trace
    }

    /// Subtract the motions from displacements.
    pub fn take_from(&self, model: &Model, iterate: &mut Field) {
        iterate.add(-1.0, &self.motion);
        iterate.retrace(model);
    }

    /// Add the motions to displacements again, and restore the gaps.
    pub fn give(self, model: &mut Model, iterate: &mut Field) {
        iterate.add(1.0, &self.motion);
        model.gap = self.gap;
    }
}

/// Return `amount` rounded to its leading [`DIGITS`]. Its products with the motion of a flat surface along an axis are then exact, and rounding does not
/// depend on the start.
fn short(amount: f64) -> f64 {
    let digits = f64::MANTISSA_DIGITS - DIGITS;
    let scale = (1u64 << digits) as f64 + 1.0;
    let product = amount * scale;
    // Dekker's splitting of a number into two
    if product.is_finite() { product - (product - amount) } else { amount }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion(name: &str, trace: &[f64]) -> Motion {
        Motion { name: name.into(), trace: trace.to_vec(), work: 0.0 }
    }

    /// Two blocks lie side by side on the ground, with pair 0 between them. The trace by which the second slides on the ground has a rounding error.
    #[test]
    fn springs_are_those_of_motions_that_close_points() {
        let segment = |pair, side| Segment { pair, side };
        let segments = [vec![], vec![segment(0, 0), segment(1, 0)], vec![segment(0, 1), segment(2, 0)]];
        let motions = [
            vec![],
            vec![motion("x", &[1.0, 1.0, 0.0, 0.0]), motion("y", &[0.0, 0.0, 1.0, 1.0])],
            vec![motion("x", &[-1.0, -1.0, 1e-9, 0.0]), motion("y", &[0.0, 0.0, 1.0, 1.0])],
        ];
        let bodies = segments.iter().zip(&motions).map(|(segments, motions)| (&segments[..], &motions[..]));
        let motions = Motions::new(bodies, &[2, 2, 2]);
        assert_eq!((motions.count(), motions.of_body(0), motions.of_body(2)), (4, 0..0, 2..4));
        let springs = motions.springs(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let amounts = DVector::from_vec(vec![1.0, 10.0, 100.0, 1000.0]);
        let forces = springs.multiply(&amounts);
        assert_eq!(forces.as_slice(), [-297.0, 70.0, 297.0, 11000.0]);
        let closing = motions.closing(&amounts);
        assert_eq!(closing, [-99.0, -99.0, 10.0, 10.0, 1000.0, 1000.0]);
        let pulled: Vec<f64> = closing.iter().zip(1..).map(|(c, w)| c * f64::from(w)).collect();
        assert_eq!(motions.work(&pulled), forces);
        // both slide along the ground together
        let kernel = springs.factor().kernel();
        assert_eq!(kernel, [DVector::from_vec(vec![1.0, 0.0, 1.0, 0.0])]);
        assert_eq!(combined(["x", "y"].into_iter(), [1.0, 1e-7].into_iter()), "x");
        assert_eq!(combined(["x", "y"].into_iter(), [-0.1, 1.0].into_iter()), "x and y");
    }

    /// An amount is rounded to the nearest number of 24 binary digits, and its products with small integers are exact.
    #[test]
    fn few_digits_are_left() {
        for amount in [10.0 + 3e-9, -0.1, 1e-300, 7.0f64.sqrt() * 1e40] {
            let head = short(amount);
            assert!(((head - amount) / amount).abs() <= 2f64.powi(-24), "{head}");
            assert_eq!(short(head), head);
            assert_eq!(3.0 * head - 2.0 * head, head);
        }
        assert_eq!(short(10.0 + 3e-9), 10.0);
        assert_eq!(short(1e308), 1e308);
    }
}
