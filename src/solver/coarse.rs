//! Free rigid motions of the bodies as a coarse space of the matrix A of all bodies together.
//!
//! Many bodies on each other are a frame whose joints are layers. How it moves as a whole is seen by no smoother, and by the coarse levels of
//! multigrid only as far as these have the rigid motions of each body. So A is solved exactly in the space of all of them, the columns of Z
//! ([`Subspace`]; balancing: Mandel, Comm. Numer. Meth. Engng 9, 1993). As K Z = 0, A Z = B'D B Z: nothing here but sums over contact
//! points. Z'AZ has a block a body and one for two bodies in contact; motions that no spring feels are left to the preconditioner.

use crate::error::Result;
use crate::linalg::{Csr, Factor, axpy, dot};
use crate::model::rigid::{Motions, TOLERANCE};
use crate::model::{BodySlot, Exchange, Model, Motion, Segment};
use crate::petsc::Subspace;
use nalgebra::DVector;
use std::ops::Range;
use std::rc::Rc;

/// A body as the coarse space sees it.
struct Moving {
    /// Its contact rows.
    segments: Vec<Segment>,
    /// Its free rigid motions, as the contact rows feel them.
    motions: Vec<Motion>,
    /// The same over its rows of A here: columns of Z.
    columns: Vec<Rc<[f64]>>,
    /// Where these rows are in a vector here.
    range: Range<usize>,
}

/// The coarse space, of the rows of this rank.
pub struct Coarse {
    bodies: Vec<Moving>,
    /// Contact points of each pair.
    points: Vec<usize>,
    /// B Z: a row a contact point, a column a motion.
    closing: Csr,
    /// B of the rows of A here: a row a contact point.
    rows: Csr,
    exchange: Rc<dyn Exchange>,
}

impl Coarse {
    /// Of the bodies of a model, whose rows begin at `offset` in a vector here; `rows` are B of all bodies together and `first` is the number
    /// of the first row here. `None` if no two bodies in contact move freely: what moves alone is no frame.
    pub fn of(model: &Model, offset: &[usize], rows: &Csr, first: usize) -> Option<Self> {
        let moving = |(slot, ends): (&BodySlot, &[usize])| {
            // springs to the ground are in K
            let free = slot.local.as_ref().filter(|_| slot.sprung.is_none()).and_then(|body| body.matrices());
            let (traces, columns) = free.map_or((&[][..], &[][..]), |free| (free.traces, free.motions));
            let motion = |trace: &Vec<f64>| Motion { name: String::new(), trace: trace.clone(), work: 0.0 };
            Moving {
                segments: slot.segments.clone(),
                motions: traces.iter().map(motion).collect(),
                columns: columns.to_vec(),
                range: ends[0]..ends[1],
            }
        };
        let bodies: Vec<Moving> = model.bodies.iter().zip(offset.windows(2)).map(moving).collect();
        let mut sides = vec![0; model.pairs.len()];
        for body in bodies.iter().filter(|body| !body.motions.is_empty()) {
            body.segments.iter().for_each(|segment| sides[segment.pair] += 1);
        }
        if !sides.contains(&2) {
            return None;
        }
        let (mut entries, mut count) = (vec![Vec::new(); model.points()], 0);
        for (body, Moving { motions, .. }) in bodies.iter().enumerate() {
            for (row, place) in model.trace_ranges(body).flatten().enumerate() {
                let of_row = motions.iter().zip(count..).map(|(motion, column)| (column, motion.trace[row]));
                entries[place % model.points()].extend(of_row);
            }
            count += motions.len();
        }
        let mut closing = Csr::new(count);
        entries.into_iter().for_each(|row| closing.push_row(row));
        let mut here = Csr::new(offset[offset.len() - 1]);
        let own = |(i, b): (usize, f64)| Some((i.checked_sub(first)?, b)).filter(|(i, _)| *i < here.columns);
        let own: Vec<Vec<(usize, f64)>> = (0..rows.rows()).map(|q| rows.row(q).filter_map(own).collect()).collect();
        own.into_iter().for_each(|row| here.push_row(row));
        let points = (0..model.pairs.len()).map(|pair| model.range(pair).len()).collect();
        Some(Self { bodies, points, closing, rows: here, exchange: model.exchange.clone() })
    }

    /// The space for these springs D, one entry a contact point.
    pub fn with(self: &Rc<Self>, springs: &[f64]) -> Box<dyn Subspace> {
        let bodies = self.bodies.iter().map(|body| (&body.segments[..], &body.motions[..]));
        let factor = Motions::new(bodies, &self.points).springs(springs).factor(TOLERANCE);
        Box::new(Sprung { coarse: self.clone(), springs: springs.to_vec(), factor })
    }
}

/// The coarse space with springs.
struct Sprung {
    coarse: Rc<Coarse>,
    springs: Vec<f64>,
    factor: Factor,
}

impl Sprung {
    /// S of what the ranks have, altogether.
    fn solve(&self, mut work: Vec<f64>) -> DVector<f64> {
        self.coarse.exchange.sum(&mut work);
        self.factor.solve(&DVector::from_vec(work))
    }

    /// D times what `closing` makes of z: springs as the points close.
    fn forces(&self, closing: &Csr, z: &[f64]) -> Vec<f64> {
        let mut forces = vec![0.0; self.springs.len()];
        closing.multiply(z, &mut forces);
        forces.iter_mut().zip(&self.springs).for_each(|(force, spring)| *force *= spring);
        forces
    }

    /// x += s Z y.
    fn add(&self, s: f64, y: &DVector<f64>, x: &mut [f64]) {
        let mut amounts = y.iter();
        for Moving { columns, range, .. } in &self.coarse.bodies {
            columns.iter().zip(&mut amounts).for_each(|(column, y)| axpy(s * y, column, &mut x[range.clone()]));
        }
    }
}

impl Subspace for Sprung {
    fn start(&self, r: &mut [f64], x: &mut [f64]) -> Result<()> {
        let Coarse { bodies, closing, rows, .. } = &*self.coarse;
        let products =
            bodies.iter().flat_map(|body| body.columns.iter().map(|column| dot(column, &r[body.range.clone()])));
        let y = self.solve(products.collect());
        self.add(1.0, &y, x);
        rows.add_transpose(-1.0, &self.forces(closing, y.as_slice()), r);
        Ok(())
    }

    fn project(&self, z: &mut [f64]) -> Result<()> {
        let Coarse { closing, rows, .. } = &*self.coarse;
        let mut work = vec![0.0; closing.columns];
        closing.add_transpose(1.0, &self.forces(rows, z), &mut work);
        self.add(-1.0, &self.solve(work), z);
        Ok(())
    }
}
