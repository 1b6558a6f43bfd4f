//! The Newton matrix (35) of all bodies together: K + B' diag(omega kappa) B with B = [B_a B_b], factored as one.
//!
//! The reference for methods that decompose: same functional, one big direct solve, one rank.

use super::{Krylov, SparseBody, Split};
use crate::ddm::method::Coupled;
use crate::ddm::{Body, BodyCounts, Field};
use crate::error::Result;
use crate::fem::{ElasticBody, rigid::FreeMotion};
use crate::linalg::Csr;

/// Stiffness matrices side by side and the rows that couple them.
pub struct Union {
    /// Stiffness matrix of all bodies, with the pattern of B'B.
    pub stiffness: Csr,
    /// One row a contact point: [B_a B_b].
    pub rows: Csr,
    /// First dof of each body, and the number of all.
    pub offset: Vec<usize>,
    /// The bodies.
    pub parts: Vec<Part>,
    /// For each body, where its rows stand in a trace vector.
    pub places: Vec<Vec<usize>>,
}

/// A body of the union.
pub struct Part {
    stiffness: Csr,
    rows: Csr,
    split: Split,
}

impl Part {
    /// From a body, its contact rows, and the rigid motions that its supports leave free.
    pub fn new(body: ElasticBody, rows: Csr, free: &[FreeMotion]) -> Self {
        let split = Split::new(free, &rows);
        Self { stiffness: body.stiffness, rows, split }
    }
}

/// All bodies as one.
pub struct Monolithic {
    whole: SparseBody<Krylov>,
    union: Union,
}

impl Monolithic {
    /// Joins the bodies; `make` makes the solver of a matrix.
    ///
    /// # Errors
    /// PETSc's refusal of the matrix or of an option.
    pub fn new(union: Union, make: impl FnOnce(&Csr) -> Result<Krylov>) -> Result<Self> {
        let n = union.stiffness.rows();
        let krylov = make(&union.stiffness)?;
        let body = ElasticBody {
            stiffness: union.stiffness.clone(),
            load: vec![0.0; n],
            prescribed: Vec::new(),
            lifting: Vec::new(),
            energy_constant: 0.0,
            strain_constant: 0.0,
            carried: Vec::new(),
        };
        Ok(Self { whole: SparseBody::new(body, union.rows.clone(), &[], krylov), union })
    }
}

impl Coupled for Monolithic {
    fn solve(&mut self, weight: &[f64], r: &[Vec<f64>]) -> Result<Option<Field>> {
        self.whole.robin(weight)?;
        let dofs = |(part, r): (&Part, &Vec<f64>)| r[..part.stiffness.rows()].to_vec();
        let whole = self.union.parts.iter().zip(r).flat_map(dofs).collect::<Vec<f64>>();
        let mut x = vec![0.0; whole.len()];
        if self.whole.solve(&whole, &mut x)?.failure.is_some() || x.iter().any(|x| !x.is_finite()) {
            return Ok(None);
        }
        let mut field = Field { states: Vec::new(), trace: vec![0.0; 2 * self.union.rows.rows()] };
        for (body, part) in self.union.parts.iter().enumerate() {
            let n = part.stiffness.rows();
            let mut state = x[self.union.offset[body]..self.union.offset[body + 1]].to_vec();
            state.resize(n + part.split.count(), 0.0);
            part.split.separate(&mut state);
            let mut rows = vec![0.0; part.rows.rows()];
            part.rows.multiply(&state[..n], &mut rows);
            part.split.add_trace(&state[n..], &mut rows);
            for (&place, value) in self.union.places[body].iter().zip(rows) {
                field.trace[place] = value;
            }
            field.states.push(state);
        }
        Ok(Some(field))
    }

    fn counts(&self) -> BodyCounts {
        self.whole.counts()
    }
}

impl Union {
    /// The union of bodies, with `points` giving for each contact point its two rows as (body, row of the body).
    pub fn new(parts: Vec<Part>, points: &[[(usize, usize); 2]]) -> Self {
        let mut offset = vec![0];
        for part in &parts {
            offset.push(offset[offset.len() - 1] + part.stiffness.rows());
        }
        let n = offset[parts.len()];
        let mut rows = Csr::new(n);
        let mut places: Vec<Vec<usize>> = parts.iter().map(|part| vec![0; part.rows.rows()]).collect();
        // dofs of other nodes that a dof meets through a contact row
        let mut extra: Vec<Vec<i32>> = vec![Vec::new(); n];
        for (q, sides) in points.iter().enumerate() {
            let mut entries = Vec::new();
            for (side, &(body, row)) in sides.iter().enumerate() {
                places[body][row] = side * points.len() + q;
                entries.extend(parts[body].rows.row(row).map(|(dof, value)| (offset[body] + dof, value)));
            }
            for &(i, _) in &entries {
                extra[i].extend(entries.iter().map(|&(j, _)| j as i32));
            }
            rows.push_row(entries);
        }
        let mut stiffness = Csr::new(n);
        for (body, own) in parts.iter().map(|part| &part.stiffness).enumerate() {
            for i in 0..own.rows() {
                let more = &mut extra[offset[body] + i];
                more.sort_unstable();
                more.dedup();
                let mut entries: Vec<(i32, f64)> =
                    own.row(i).map(|(j, value)| ((offset[body] + j) as i32, value)).collect();
                let known = entries.len();
                for &j in more.iter() {
                    if entries[..known].binary_search_by_key(&j, |entry| entry.0).is_err() {
                        entries.push((j, 0.0));
                    }
                }
                entries.sort_unstable_by_key(|entry| entry.0);
                for (j, value) in entries {
                    stiffness.col.push(j);
                    stiffness.values.push(value);
                }
                stiffness.ptr.push(stiffness.col.len() as i32);
            }
        }
        Self { stiffness, rows, offset, parts, places }
    }
}
