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
    /// B; columns: all rows of A.
    rows: Rc<Csr>,
    /// First row of A here.
    first: usize,
    exchange: Rc<dyn Exchange>,
}

impl Coarse {
    /// Of the bodies of a model, whose rows begin at `offset` in a vector here; `rows` are B of all bodies together and `first` is the number
    /// of the first row here. `None` if no two bodies in contact move freely: what moves alone is no frame.
    pub fn of(model: &Model, offset: &[usize], rows: &Rc<Csr>, first: usize) -> Option<Self> {
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
        let points = (0..model.pairs.len()).map(|pair| model.range(pair).len()).collect();
        sides.contains(&2).then(|| Self { bodies, points, rows: rows.clone(), first, exchange: model.exchange.clone() })
    }

    fn motions(&self) -> Motions<'_> {
        Motions::new(self.bodies.iter().map(|body| (&body.segments[..], &body.motions[..])), &self.points)
    }

    /// The space for these springs D, one entry a contact point.
    pub fn with(self: &Rc<Self>, springs: &[f64]) -> Box<dyn Subspace> {
        let factor = self.motions().springs(springs).factor(TOLERANCE);
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
    fn solve(&self, mut work: DVector<f64>) -> DVector<f64> {
        self.coarse.exchange.sum(work.as_mut_slice());
        self.factor.solve(&work)
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
        let Coarse { bodies, rows, first, .. } = &*self.coarse;
        let products =
            bodies.iter().flat_map(|body| body.columns.iter().map(|column| dot(column, &r[body.range.clone()])));
        let y = self.solve(DVector::from_vec(products.collect()));
        self.add(1.0, &y, x);
        let closing = self.coarse.motions().closing(&y);
        for (q, force) in closing.iter().zip(&self.springs).map(|(c, d)| c * d).enumerate().filter(|(_, f)| *f != 0.0) {
            for (i, b) in rows.row(q) {
                if let Some(r) = i.checked_sub(*first).and_then(|i| r.get_mut(i)) {
                    *r -= b * force;
                }
            }
        }
        Ok(())
    }

    fn project(&self, z: &mut [f64]) -> Result<()> {
        let Coarse { rows, first, .. } = &*self.coarse;
        let closing = |q| -> f64 { rows.row(q).filter_map(|(i, b)| Some(b * z.get(i.checked_sub(*first)?)?)).sum() };
        let force = |(q, d): (usize, &f64)| if *d == 0.0 { 0.0 } else { d * closing(q) };
        let forces: Vec<f64> = self.springs.iter().enumerate().map(force).collect();
        let y = self.solve(self.coarse.motions().work(&forces));
        self.add(-1.0, &y, z);
        Ok(())
    }
}
