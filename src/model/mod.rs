//! The discrete problem as the methods see it: bodies, and arrays over contact points.
//!
//! Contact points of all pairs are numbered consecutively: point q of pair i has the number `offset[i] + q`. An array
//! with one entry for each point is marked n. A trace vector (2n) has two entries a point, first all of side a, then
//! all of side b: `trace[side * points + offset[pair] + q]`. A body is local if it lives on this rank, wholly or in
//! part.

pub mod body;
mod coarse;
mod compliance;
pub mod dofs;
pub mod field;
pub mod joint;
pub mod layer;
pub mod linear;
pub mod motions;
pub mod rigid_parts;

pub use crate::solver::cost::{BodyFacts, slenderness};
pub use crate::solver::preset::INNER_TOLERANCE;
pub use crate::solver::{BodyCounts, interface_dofs};
pub use body::Body;
pub use compliance::ComplianceStep;
pub use dofs::{Distribution, Dofs};
pub use field::DisplacementField;
pub use joint::JointStep;
pub use layer::Layer;
pub use linear::LinearStep;
pub use motions::NamedMotion;

use crate::contact::ContactPair;
use crate::error::Result;
use crate::exchange::Exchange;
use crate::linalg::{axpy, dot};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::rc::Rc;

/// A group of contact rows of a body: those of side `side` of pair `pair`.
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
    /// Its trace on the body's contact rows. The largest displacement in the body is about one.
    pub trace: Vec<f64>,
    /// Work of the loads on it.
    pub work: f64,
}

/// A motion of one body or of several bodies together that neither supports nor springs nor contact resist.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Mechanism {
    /// The bodies that it moves.
    pub bodies: Vec<usize>,
    /// Its name, or those of all such motions of these bodies.
    pub motion: String,
    /// Work of the loads on it, as a share of the work that forces of their sizes could do; zero if the run goes on.
    pub work: f64,
    /// The part of a support that would hold the motion, if loads work on it.
    pub support: String,
    /// The work of the loads, as such a share, that was taken from them, if it is more than the digits of the mesh
    /// allow for.
    pub balanced: f64,
    /// Whether contact resists it, by no more than facets may by mistake.
    pub by_facets: bool,
    /// The body that was fixed at one node to remove the motion; `None` if loads do work on it, or if there is no
    /// suitable node outside the contact.
    pub fixed: Option<usize>,
}

/// A body in the model, or a rigid part. Every rank has the arrays; only the ranks where the body lives have the body
/// itself.
///
/// A rigid part has no mesh, and its dofs are the amounts of its free motions: an obstacle before a surface, or the
/// offset of a gap. It is at side b of its pair, alone or beside the body there, and rank 0 has it.
#[derive(Serialize, Deserialize)]
pub struct BodySlot {
    /// Name in the scene.
    pub name: String,
    /// The body, on the rank that owns it, or on every rank that may own a part of it.
    #[serde(skip)]
    pub local: Option<Body>,
    /// Whether it is a rigid part.
    pub is_rigid: bool,
    /// Its contact rows: the groups in their order.
    pub segments: Vec<Segment>,
    /// The rigid motions E that its supports leave. First come the free ones, which springs leave, too.
    pub motions: Vec<Motion>,
    /// E'KE of the springs to the ground: one row and column a motion, zero for the free ones.
    pub ground: DMatrix<f64>,
    /// Number of the free motions.
    pub free: usize,
    /// Largest diagonal entry of K.
    pub scale: f64,
    /// Elastic modulus under pressure on its contact surfaces: E/(1 - nu^2), or about that.
    pub modulus: f64,
    /// Its size normal to its contact surfaces.
    pub depth: f64,
    /// b K b' of each contact row b, without what couples different nodes: the stiffness of the nodes under a point.
    pub row_stiffness: Vec<f64>,
    /// Energy of the initial strains where the body cannot expand, int eps0 : C eps0.
    pub heat: f64,
    /// B m on the contact rows, for the rigid motion m that comes nearest to the prescribed displacements.
    pub imposed: Vec<f64>,
}

impl BodySlot {
    /// Return a rigid part with these motions at side b of pair number `pair`, which has so many points.
    pub fn rigid(name: &str, pair: usize, points: usize, motions: Vec<Motion>) -> Self {
        Self {
            name: name.to_owned(),
            local: None,
            is_rigid: true,
            segments: vec![Segment { pair, side: 1 }],
            ground: DMatrix::zeros(motions.len(), motions.len()),
            free: motions.len(),
            motions,
            scale: 0.0,
            modulus: f64::INFINITY,
            depth: 1.0,
            imposed: vec![0.0; points],
            row_stiffness: vec![0.0; points],
            heat: 0.0,
        }
    }

    /// Return the motions that neither supports nor springs constrain.
    pub fn free_motions(&self) -> &[Motion] {
        &self.motions[..self.free]
    }

    /// Return whether springs to the ground resist some of its motions.
    pub fn is_sprung(&self) -> bool {
        self.free < self.motions.len()
    }

    /// Return the work of the loads and of forces at the contact rows, which push the body away, on each of its free
    /// motions.
    pub fn works(&self, force: &[f64]) -> Vec<f64> {
        self.free_motions().iter().map(|motion| motion.work - dot(&motion.trace, force)).collect()
    }

    /// Return how the dofs of the body are distributed over the ranks; `None` for a body of one rank, and for one that
    /// does not live here.
    pub fn distribution(&self) -> Option<&Distribution> {
        self.local.as_ref()?.dofs().distribution.as_deref()
    }
}

/// The discrete problem.
pub struct Model {
    /// Every body, in the order of the scene.
    pub bodies: Vec<BodySlot>,
    /// Every pair, in the order of the scene.
    pub pairs: Vec<ContactPair>,
    /// First point of each pair, and the number of all points.
    pub offset: Vec<usize>,
    /// omega of all points, n: area, or length in the plane.
    pub area: Vec<f64>,
    /// d of all points, n: the gaps, less the part that prescribed displacements close.
    pub gap: Vec<f64>,
    /// The Robin term that the bodies carry, omega psi kappa of all contact rows, 2n; empty before the first.
    pub robin: Vec<f64>,
    /// The mechanism because of which there is no solution, if one is known beforehand.
    pub mechanism: Option<Mechanism>,
    /// Connection to the other ranks.
    pub exchange: Rc<dyn Exchange>,
}

impl Model {
    /// Join bodies and pairs.
    pub fn new(bodies: Vec<BodySlot>, pairs: Vec<ContactPair>, exchange: Rc<dyn Exchange>) -> Self {
        let mut offset = vec![0];
        for pair in &pairs {
            offset.push(offset[offset.len() - 1] + pair.len());
        }
        let area = pairs.iter().flat_map(|pair| pair.area.iter().copied()).collect();
        let (gap, robin) = (Vec::new(), Vec::new());
        let mut model = Self { bodies, pairs, offset, area, gap, robin, mechanism: None, exchange };
        model.set_gaps();
        model
    }

    /// Set all gaps from those of the pairs and what prescribed displacements close.
    pub fn set_gaps(&mut self) {
        self.gap = self.pairs.iter().flat_map(|pair| (0..pair.len()).map(move |q| free_gap(pair, q))).collect();
    }

    /// Subtract the closings of a trace vector (2n) from the gaps.
    pub fn close_gap(&mut self, trace: &[f64]) {
        self.gap.iter_mut().zip(closing(trace)).for_each(|(gap, s)| *gap -= s);
    }

    /// Return c = B u - d at the points (n), for a trace vector (2n).
    pub fn compression(&self, trace: &[f64]) -> Vec<f64> {
        // adding 0.0 turns -0.0, which depends on the order of a sum, into 0.0
        closing(trace).zip(&self.gap).map(|(s, gap)| s - gap + 0.0).collect()
    }

    /// Return the forces omega p, for pressures p at the points (n).
    pub fn forces(&self, pressure: &[f64]) -> Vec<f64> {
        self.area.iter().zip(pressure).map(|(area, pressure)| area * pressure).collect()
    }

    /// Return the compressions of the layers, n, that carry these pressures, n.
    pub fn compressions_of(&self, pressure: &[f64]) -> Vec<f64> {
        self.each_point().map(|(q, pair, point)| pair.law.compression(point, pressure[q])).collect()
    }

    /// Return the stiffness of the nodes under every contact row, as a trace vector (2n).
    pub fn row_stiffness(&self) -> Vec<f64> {
        let mut all = vec![0.0; 2 * self.points()];
        (0..self.bodies.len()).for_each(|body| self.add(body, &self.bodies[body].row_stiffness, &mut all));
        all
    }

    /// Return the stiffness by which the sweeps hold bodies at every contact row, as a trace vector (2n): that of the
    /// nodes under the row, or, for a rigid part, of those before it; that of a unit spring where supports prescribe
    /// those.
    pub fn holding_stiffness(&self) -> Vec<f64> {
        let (points, mut all) = (self.points(), self.row_stiffness());
        for segment in self.bodies.iter().filter(|slot| slot.is_rigid).flat_map(|slot| &slot.segments) {
            for q in self.range(segment.pair) {
                let before = all[points + q].max(all[q]);
                all[points + q] = if before > 0.0 { before } else { self.area[q] };
            }
        }
        all
    }

    /// Return the bodies that live on this rank, with their numbers.
    pub fn locals(&self) -> impl Iterator<Item = (usize, &Body)> {
        self.bodies.iter().enumerate().filter_map(|(body, slot)| Some((body, slot.local.as_ref()?)))
    }

    /// Return the number of bodies with a mesh; the rigid parts follow them.
    pub fn meshed(&self) -> usize {
        self.bodies.iter().filter(|slot| !slot.is_rigid).count()
    }

    /// Return by how much rigid parts close each point of pair `i`, n, with these amounts of their motions, one list a
    /// body.
    pub fn rigid_closing(&self, i: usize, amounts: &[Vec<f64>]) -> Vec<f64> {
        let mut closing = vec![0.0; self.range(i).len()];
        for (slot, amounts) in
            self.bodies.iter().zip(amounts).filter(|(slot, _)| slot.is_rigid && slot.segments[0].pair == i)
        {
            slot.motions.iter().zip(amounts).for_each(|(motion, &a)| axpy(a, &motion.trace, &mut closing));
        }
        closing
    }

    /// Return the trace vector (2n) of the rigid motions that prescribed displacements impose on the bodies.
    pub fn imposed(&self) -> Vec<f64> {
        let mut all = vec![0.0; 2 * self.points()];
        (0..self.bodies.len()).for_each(|body| self.add(body, &self.bodies[body].imposed, &mut all));
        all
    }

    /// Return whether the dofs of some bodies are distributed over the ranks.
    pub fn is_distributed(&self) -> bool {
        self.bodies.iter().any(|slot| slot.distribution().is_some())
    }

    /// Return the number of contact points of all pairs.
    pub fn points(&self) -> usize {
        self.area.len()
    }

    /// Return the numbers of the points of pair `i`.
    pub fn range(&self, i: usize) -> Range<usize> {
        self.offset[i]..self.offset[i + 1]
    }

    /// Return the number of each point, its pair, and its number there.
    pub fn each_point(&self) -> impl Iterator<Item = (usize, &ContactPair, usize)> {
        let of_pair = |(i, pair)| self.range(i).enumerate().map(move |(point, q)| (q, pair, point));
        self.pairs.iter().enumerate().flat_map(of_pair)
    }

    /// Return the outer normal displacements of a side of pair `i`, one for each of its points: those of `trace`, and
    /// the prescribed ones.
    pub fn displacement(&self, trace: &[f64], i: usize, side: usize) -> Vec<f64> {
        let free = &trace[side * self.points()..][self.range(i)];
        free.iter().zip(&self.pairs[i].prescribed[side]).map(|(free, prescribed)| free + prescribed).collect()
    }

    /// Return the ranges of a trace vector that belong to the rows of a body, in the order of the rows.
    pub fn trace_ranges(&self, body: usize) -> impl Iterator<Item = Range<usize>> + '_ {
        let points = self.points();
        self.bodies[body].segments.iter().map(move |segment| {
            let range = self.range(segment.pair);
            segment.side * points + range.start..segment.side * points + range.end
        })
    }

    /// Return values at the rows of a body from those at the points (n).
    pub fn at_rows(&self, body: usize, values: &[f64]) -> Vec<f64> {
        let segments = self.bodies[body].segments.iter();
        segments.flat_map(|segment| values[self.range(segment.pair)].iter().copied()).collect()
    }

    /// Return the part of a trace vector that belongs to the rows of a body.
    pub fn of_body(&self, body: usize, trace: &[f64]) -> Vec<f64> {
        self.trace_ranges(body).flat_map(|range| trace[range].iter().copied()).collect()
    }

    /// Write values at the rows of a body into a trace vector.
    pub fn put(&self, body: usize, rows: &[f64], trace: &mut [f64]) {
        let mut next = 0;
        for range in self.trace_ranges(body) {
            let count = range.len();
            trace[range].copy_from_slice(&rows[next..next + count]);
            next += count;
        }
    }

    /// Add values at the rows of a body to a trace vector. Unlike other bodies, a rigid part may share rows with a
    /// body.
    pub fn add(&self, body: usize, rows: &[f64], trace: &mut [f64]) {
        let mut next = 0;
        for range in self.trace_ranges(body) {
            let count = range.len();
            axpy(1.0, &rows[next..next + count], &mut trace[range]);
            next += count;
        }
    }

    /// Condense the bodies that are to be condensed and are not yet.
    ///
    /// # Errors
    /// Failures of the solver library.
    pub fn condense(&mut self) -> Result<()> {
        self.bodies.iter_mut().filter_map(|slot| slot.local.as_mut()).try_for_each(Body::condense)
    }

    /// Return K v for the displacements v of every local body, where bodies have not given their K away.
    pub fn multiply(&mut self, v: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let product = |(slot, v): (&mut BodySlot, &Vec<f64>)| {
            let mut y = vec![0.0; v.len()];
            if let Some(body) = slot.local.as_mut() {
                body.apply_stiffness(v, &mut y);
            }
            y
        };
        self.bodies.iter_mut().zip(v).map(product).collect()
    }

    /// Set the relative tolerance of iterative solves in every body, unless the user has set one.
    ///
    /// # Errors
    /// Failures of the solver library.
    pub fn set_tolerance(&mut self, rtol: f64) -> Result<()> {
        let mut bodies = self.bodies.iter_mut().filter_map(|slot| slot.local.as_mut());
        bodies.try_for_each(|body| body.set_tolerance(rtol))
    }

    /// Set the Robin term of every body: `weight` = omega psi kappa at each contact row, as a trace vector (37)-(38).
    ///
    /// # Errors
    /// Failures of the solver library.
    pub fn robin(&mut self, weight: &[f64]) -> Result<()> {
        self.robin = weight.to_vec();
        for body in 0..self.bodies.len() {
            let rows = self.of_body(body, weight);
            if let Some(local) = self.bodies[body].local.as_mut() {
                local.robin(&rows)?;
            }
        }
        Ok(())
    }
}

/// Return B u = u_a + u_b at the points (n), by which a trace vector (2n) closes them.
pub fn closing(trace: &[f64]) -> impl Iterator<Item = f64> {
    let (a, b) = trace.split_at(trace.len() / 2);
    a.iter().zip(b).map(|(a, b)| a + b)
}

/// Return the gap at local point `q` of a pair, less the part that prescribed displacements close.
fn free_gap(pair: &ContactPair, q: usize) -> f64 {
    pair.gap[q] - pair.offset - pair.prescribed[0][q] - pair.prescribed[1][q]
}

/// A model for tests that need points but no bodies.
#[cfg(test)]
pub(crate) mod sample {
    use super::*;
    use crate::contact::Measure;
    use crate::contact::law::{Law, LayerLaw, Power};
    use crate::linalg::Csr;

    /// omega of the points.
    pub const AREA: [f64; 4] = [0.5, 2.0, 3.0, 0.25];

    /// The law p = s c^2, with s of each point.
    #[derive(Debug)]
    struct Square([f64; 2]);

    impl LayerLaw for Square {
        fn pressure_and_tangent(&self, point: usize, c: f64) -> (f64, f64) {
            let s = self.0[point];
            (s * c * c, 2.0 * s * c)
        }

        fn energy(&self, point: usize, c: f64) -> f64 {
            self.0[point] * c.powi(3) / 3.0
        }
    }

    /// Return two bodies with two pairs of two points each. The law is p = 4 c in the first pair and p = c^2 in the
    /// second.
    pub fn two_pairs() -> Model {
        let laws = [Law::new(Power::linear(4.0)), Law::new(Square([1.0; 2]))];
        let pair = |(i, law): (usize, Law)| ContactPair {
            surfaces: ["a".to_owned(), "b".to_owned()],
            bodies: [0, 1],
            nodes: vec![0, 1],
            on_side: vec![0, 1],
            face: vec![1; 2],
            tilt: vec![0.0; 2],
            is_turned: false,
            spread: Vec::new(),
            uncertainty: 0.0,
            position: vec![[0.0; 3]; 2],
            area: AREA[2 * i..2 * i + 2].to_vec(),
            normal: vec![[0.0, 1.0, 0.0]; 2],
            distance: vec![0.0; 2],
            gap: vec![0.0; 2],
            offset: 0.0,
            prescribed: [vec![0.0; 2], vec![0.0; 2]],
            rows: [Csr::new(0), Csr::new(0)],
            nodal: [Csr::new(0), Csr::new(0)],
            resultant: [vec![[0.0; 3]; 2], vec![[0.0; 3]; 2]],
            moment: [vec![[0.0; 3]; 2], vec![[0.0; 3]; 2]],
            measure: Measure::Length,
            law,
            cover: Vec::new(),
        };
        let body = |side: usize, row_stiffness: [f64; 4]| BodySlot {
            name: side.to_string(),
            local: None,
            is_rigid: false,
            segments: (0..2).map(|pair| Segment { pair, side }).collect(),
            motions: Vec::new(),
            ground: DMatrix::zeros(0, 0),
            free: 0,
            scale: 1.0,
            modulus: 3.0,
            depth: 1.0,
            row_stiffness: row_stiffness.to_vec(),
            heat: 0.0,
            imposed: vec![0.0; row_stiffness.len()],
        };
        let bodies = vec![body(0, [8.0, 12.0, 0.0, 6.0]), body(1, [4.0, 20.0, 5.0, 7.0])];
        Model::new(bodies, laws.into_iter().enumerate().map(pair).collect(), Rc::new(crate::exchange::Serial))
    }
}
