//! The discrete problem as the method sees it: bodies that answer verbs, and arrays of contact points.
//!
//! Points of all pairs are numbered through: point q of pair i is `offset[i] + q`. A trace vector has two entries a
//! point, first all of side a, then all of side b: `trace[side * points + offset[pair] + q]`.

pub mod body;
pub mod coarse;
pub mod distribution;
pub mod field;
pub mod joint;
pub mod layer;
pub mod line;
pub mod linear;
pub mod origin;
pub mod rigid;
pub mod surface;

use serde::{Deserialize, Serialize};
pub use body::{Body, BodyCounts, Energy, Loads, Matrices, Solved};
pub use distribution::Distribution;
pub use field::Field;
pub use joint::Joint;
pub use layer::Layer;
pub use linear::{LinearStep, Solution};
pub use rigid::{Motions, Moved};

use crate::contact::ContactPair;
use crate::error::Result;
use crate::exchange::Exchange;
use nalgebra::DMatrix;
use std::cell::RefCell;
use std::ops::Range;
use std::rc::Rc;

/// Which contact rows a body has: side `side` of pair `pair`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Segment {
    /// Number of the pair.
    pub pair: usize,
    /// 0 for side a, which carries the points, 1 for side b.
    pub side: usize,
}

/// A rigid motion that a body's supports leave free.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Motion {
    /// Name for messages.
    pub name: String,
    /// Its trace on the body's contact rows; largest displacement in the body about one.
    pub trace: Vec<f64>,
    /// Work of the loads on it.
    pub work: f64,
}

/// A motion of several bodies together that changes no gap and that nothing holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mechanism {
    /// The bodies that it moves.
    pub bodies: Vec<usize>,
    /// Its name.
    pub motion: String,
    /// Work of the loads on it, as a share of what forces of their sizes could do.
    pub work: f64,
    /// The body that was fixed at one node against it; none if loads do work, or if no node outside the contact could serve.
    pub fixed: Option<usize>,
}

/// Rigid motions that springs to the ground resist, beside those that nothing holds: a start moves bodies on soft springs, too.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Sprung {
    /// The motions that supports leave.
    pub motions: Vec<Motion>,
    /// Stiffness of the springs in terms of them.
    pub stiffness: DMatrix<f64>,
}

/// A body in the model; the arrays are known on every rank, the body itself where it lives.
pub struct BodySlot {
    /// Name in the scene.
    pub name: String,
    /// The body, on the rank that owns it, or on every rank that may own a part of it.
    pub local: Option<Box<dyn Body>>,
    /// Its contact rows, in this order.
    pub segments: Vec<Segment>,
    /// Rigid motions that its supports leave free.
    pub motions: Vec<Motion>,
    /// The motions that supports leave, if springs resist some of them.
    pub sprung: Option<Sprung>,
    /// Largest diagonal entry of K.
    pub scale: f64,
    /// Elastic modulus against pressure on its contact surfaces, E/(1 - nu^2) or about that.
    pub modulus: f64,
    /// Its size across its contact surfaces.
    pub depth: f64,
    /// b diag(K) b' of each contact row b: stiffness of the nodes under a point.
    pub row_stiffness: Vec<f64>,
}

/// The discrete problem.
pub struct Model {
    /// Every body, in the order of the scene.
    pub bodies: Vec<BodySlot>,
    /// Every pair, in the order of the scene.
    pub pairs: Vec<ContactPair>,
    /// First point of each pair, and the number of all points.
    pub offset: Vec<usize>,
    /// omega of all points.
    pub weight: Vec<f64>,
    /// d of all points, less what prescribed displacements close of it.
    pub gap: Vec<f64>,
    /// Why there is no solution, where that is known beforehand.
    pub mechanism: Option<Mechanism>,
    /// K of all bodies, if they have given theirs away.
    pub joint: Option<Rc<RefCell<dyn Joint>>>,
    /// Connection to the other ranks.
    pub exchange: Rc<dyn Exchange>,
}

impl Model {
    /// Joins bodies and pairs.
    pub fn new(bodies: Vec<BodySlot>, pairs: Vec<ContactPair>, exchange: Rc<dyn Exchange>) -> Self {
        let mut offset = vec![0];
        for pair in &pairs {
            offset.push(offset[offset.len() - 1] + pair.len());
        }
        let weight = pairs.iter().flat_map(|pair| pair.weight.iter().copied()).collect();
        let (gap, mechanism, joint) = (Vec::new(), None, None);
        let mut model = Self { bodies, pairs, offset, weight, gap, mechanism, joint, exchange };
        model.scale_gaps(1.0);
        model
    }

    /// Makes all gaps 1/`factor` of what they are between the meshes: displacements are in shares `factor` of themselves.
    pub fn scale_gaps(&mut self, factor: f64) {
        let free_gap =
            |pair: &ContactPair, q: usize| pair.gap[q] / factor - pair.prescribed[0][q] - pair.prescribed[1][q];
        self.gap = self.pairs.iter().flat_map(|pair| (0..pair.len()).map(|q| free_gap(pair, q))).collect();
    }

    /// Makes a trace known: states are from now on relative to a displacement with that trace, as if supports prescribed it.
    pub fn carry(&mut self, trace: &[f64]) {
        let points = self.points();
        for pair in 0..self.pairs.len() {
            for q in self.range(pair) {
                let known = &mut self.pairs[pair].prescribed;
                let local = q - self.offset[pair];
                known[0][local] += trace[q];
                known[1][local] += trace[points + q];
                self.gap[q] = self.pairs[pair].gap[local]
                    - self.pairs[pair].prescribed[0][local]
                    - self.pairs[pair].prescribed[1][local];
            }
        }
    }

    /// c = B u - d at the points (n), for a trace vector.
    pub fn compression(&self, trace: &[f64]) -> Vec<f64> {
        let points = self.points();
        // + 0.0 turns -0.0, which depends on the order of a sum, into 0.0
        (0..points).map(|q| trace[q] + trace[points + q] - self.gap[q] + 0.0).collect()
    }

    /// omega p, for pressures p at the points (n).
    pub fn forces(&self, pressure: &[f64]) -> Vec<f64> {
        self.weight.iter().zip(pressure).map(|(weight, pressure)| weight * pressure).collect()
    }

    /// Stiffness of the nodes under every contact row (2n, layout of a trace vector).
    pub fn row_stiffness(&self) -> Vec<f64> {
        let mut all = vec![0.0; 2 * self.points()];
        (0..self.bodies.len()).for_each(|body| self.put(body, &self.bodies[body].row_stiffness, &mut all));
        all
    }

    /// Whether the dofs of the bodies are dealt out over the ranks.
    pub fn is_distributed(&self) -> bool {
        self.bodies.iter().any(|slot| slot.local.as_ref().is_some_and(|body| body.distribution().is_some()))
    }

    /// Number of contact points of all pairs.
    pub fn points(&self) -> usize {
        self.weight.len()
    }

    /// Points of pair `i` among all.
    pub fn range(&self, i: usize) -> Range<usize> {
        self.offset[i]..self.offset[i + 1]
    }

    /// Parts of a trace vector that belong to the rows of a body, in their order.
    pub fn trace_ranges(&self, body: usize) -> impl Iterator<Item = Range<usize>> + '_ {
        let points = self.points();
        self.bodies[body].segments.iter().map(move |segment| {
            let range = self.range(segment.pair);
            segment.side * points + range.start..segment.side * points + range.end
        })
    }

    /// Values at points, as seen by the rows of a body.
    pub fn at_rows(&self, body: usize, points: &[f64]) -> Vec<f64> {
        self.bodies[body].segments.iter().flat_map(|s| points[self.range(s.pair)].iter().copied()).collect()
    }

    /// The part of a trace vector that belongs to a body.
    pub fn of_body(&self, body: usize, trace: &[f64]) -> Vec<f64> {
        self.trace_ranges(body).flat_map(|range| trace[range].iter().copied()).collect()
    }

    /// Writes a body's rows into a trace vector.
    pub fn put(&self, body: usize, rows: &[f64], trace: &mut [f64]) {
        let mut next = 0;
        for range in self.trace_ranges(body) {
            let count = range.len();
            trace[range].copy_from_slice(&rows[next..next + count]);
            next += count;
        }
    }

    /// Tells every body how far its solves have to reduce r. Whether that matters to one of them.
    ///
    /// # Errors
    /// Failures of the solver library.
    pub fn precision(&mut self, rtol: f64) -> Result<bool> {
        let mut bodies = self.bodies.iter_mut().filter_map(|slot| slot.local.as_mut());
        bodies.try_fold(false, |matters, body| Ok(body.precision(rtol)? || matters))
    }

    /// Gives every body its Robin term `weight` = omega psi kappa of each contact row (37)-(38).
    ///
    /// # Errors
    /// Failures of the solver library.
    pub fn robin(&mut self, weight: &[f64]) -> Result<()> {
        for body in 0..self.bodies.len() {
            let rows = self.of_body(body, weight);
            if let Some(local) = &mut self.bodies[body].local {
                local.robin(&rows)?;
            }
        }
        Ok(())
    }
}

/// A model for tests of what needs points and no body.
#[cfg(test)]
pub(crate) mod sample {
    use super::*;
    use crate::contact::law::Linear;
    use crate::contact::{LayerLaw, Response};
    use crate::linalg::Csr;

    /// omega of the points.
    pub const WEIGHT: [f64; 4] = [0.5, 2.0, 3.0, 0.25];

    /// p = s c^2, with s of each point.
    #[derive(Debug)]
    struct Square([f64; 2]);

    impl LayerLaw for Square {
        fn compressed(&self, point: usize, c: f64) -> Response {
            let s = self.0[point];
            Response { pressure: s * c * c, tangent: 2.0 * s * c, energy: s * c.powi(3) / 3.0 }
        }
    }

    /// Two bodies with two pairs of two points each: p = 4 c in the first pair, p = c^2 in the second.
    pub fn two_pairs() -> Model {
        let laws: [Rc<dyn LayerLaw>; 2] = [Rc::new(Linear { stiffness: 4.0 }), Rc::new(Square([1.0; 2]))];
        let pair = |(i, law): (usize, Rc<dyn LayerLaw>)| ContactPair {
            surfaces: ["a".to_owned(), "b".to_owned()],
            bodies: [0, 1],
            nodes: vec![0, 1],
            position: vec![[0.0; 3]; 2],
            weight: WEIGHT[2 * i..2 * i + 2].to_vec(),
            normal: vec![[0.0, 1.0, 0.0]; 2],
            gap: vec![0.0; 2],
            prescribed: [vec![0.0; 2], vec![0.0; 2]],
            rows: [Csr::new(0), Csr::new(0)],
            nodal: [Csr::new(0), Csr::new(0)],
            resultant: [vec![[0.0; 3]; 2], vec![[0.0; 3]; 2]],
            moment: [vec![[0.0; 3]; 2], vec![[0.0; 3]; 2]],
            surface: [Vec::new(), Vec::new()],
            along_curve: true,
            measure: "length",
            law,
            cover: Vec::new(),
            lost: None,
        };
        let body = |side: usize, row_stiffness: [f64; 4]| BodySlot {
            name: side.to_string(),
            local: None,
            segments: (0..2).map(|pair| Segment { pair, side }).collect(),
            motions: Vec::new(),
            sprung: None,
            scale: 1.0,
            modulus: 3.0,
            depth: 1.0,
            row_stiffness: row_stiffness.to_vec(),
        };
        let bodies = vec![body(0, [8.0, 12.0, 0.0, 6.0]), body(1, [4.0, 20.0, 5.0, 7.0])];
        Model::new(bodies, laws.into_iter().enumerate().map(pair).collect(), Rc::new(crate::exchange::Serial))
    }
}
