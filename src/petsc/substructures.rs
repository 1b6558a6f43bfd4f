//! A factor by substructures: two processes eliminate a half each, and all factor what is left, the interface.
//!
//! With the interior I of each half and the interface B between them
//!
//! ```text
//! S = A_BB - sum A_BI A_II^-1 A_IB,   x_B = S^-1 (b_B - sum A_BI A_II^-1 b_I),   x_I = A_II^-1 (b_I - A_IB x_B)
//! ```
//!
//! S is dense, and the same on all processes: of a solve they share one sum, of a number for each dof of the interface, and what of the
//! right-hand side and the solution is not where its half is. One process has one half and no interface.
//!
//! More than two parts do not pay: to eliminate n dofs in space takes c n^2, and the interface of p parts has about p^(1/3) n^(2/3) dofs and
//! takes c' p n^2, so that the best p does not depend on n; and S grows as p^(2/3). Of the two spheres with 99 900 dofs, n = 8166, two, three and
//! four parts on four processes take the same time, and 152, 158, and 176 MB.

use super::halves::{BETWEEN, halves};
use super::indices::{Indices, row};
use super::scatter::Scatter;
use super::{Int, Matrix, Schur, Scope, Session, cholesky, cholesky_solve};
use crate::error::Result;
use std::cell::RefCell;

/// P'AP, factored.
pub(super) struct Substructures {
    session: Session,
    scope: Scope,
    /// From the dofs P of this process to those of the interior here.
    interior: Scatter,
    /// The interior, if there is any, with the dofs of the interface that are coupled with it.
    own: Option<RefCell<Schur>>,
    /// These dofs, as numbers in the interface.
    near: Vec<usize>,
    /// The dofs of the interface among P of this process, and their numbers in it.
    shared: Vec<(usize, usize)>,
    /// The factor of S.
    interface: Vec<f64>,
    /// Number of dofs of the interface.
    border: usize,
}

impl Substructures {
    /// Factors rows and columns of a matrix: dofs P in increasing order, whole nodes, the same on all processes; collective. `None` if they are
    /// not positive definite to rounding.
    ///
    /// # Errors
    /// Memory, and what else stops MUMPS.
    pub fn new(matrix: &Matrix, dofs: &[usize]) -> Result<Option<Self>> {
        let (session, scope) = (matrix.session().clone(), matrix.scope());
        let layout = Layout::new(matrix, dofs)?;
        let (near, mut own) = layout.interior()?;
        let mut failed = [0.0];
        if let Some(schur) = &mut own {
            match schur.factor() {
                Err(_) if schur.is_singular() => failed[0] = 1.0,
                done => done?,
            }
        }
        let complement = own.as_mut().map_or_else(Vec::new, Schur::take_complement);
        let shared = layout.shared();
        let mut interface = layout.interface(&shared, &near, &complement)?;
        drop(complement);
        scope.sum(&session, &mut failed);
        scope.sum(&session, &mut interface);
        let border = layout.border;
        if failed[0] > 0.0 || border > 0 && !cholesky(&mut interface, border)? {
            return Ok(None);
        }
        let interior = Scatter::new(&session, scope, layout.here().len(), &layout.interior)?;
        Ok(Some(Self { session, scope, interior, own: own.map(RefCell::new), near, shared, interface, border }))
    }

    /// `x = (P'AP)^-1 b` for the dofs P of this process; collective.
    ///
    /// # Errors
    /// Failures of MUMPS.
    pub fn solve(&self, b: &[f64], x: &mut [f64]) -> Result<()> {
        let interior = self.interior.len();
        let mut inside = vec![0.0; interior + self.near.len()];
        self.interior.take(b, &mut inside[..interior])?;
        let mut own = self.own.as_ref().map(RefCell::borrow_mut);
        let mut shared = vec![0.0; self.border];
        if let Some(schur) = &mut own {
            let condensed = schur.condense(&inside)?;
            self.near.iter().zip(condensed).for_each(|(&number, value)| shared[number] = value);
        }
        if self.border > 0 {
            self.shared.iter().for_each(|&(i, number)| shared[number] += b[i]);
            self.scope.sum(&self.session, &mut shared);
            cholesky_solve(&self.interface, self.border, &mut shared)?;
        }
        if let Some(schur) = &mut own {
            let near: Vec<f64> = self.near.iter().map(|&number| shared[number]).collect();
            inside = schur.expand_condensed(&inside, &near)?;
        }
        x.fill(0.0);
        self.interior.add(&inside[..interior], x)?;
        self.shared.iter().for_each(|&(i, number)| x[i] = shared[number]);
        Ok(())
    }
}

/// Which dofs are where. Those of P are numbered as they come.
struct Layout<'a> {
    matrix: &'a Matrix,
    dofs: &'a [usize],
    /// The half of each node of P.
    half: Vec<Int>,
    /// Numbers of the interior dofs of this process.
    interior: Vec<usize>,
    /// Number of dofs of the interface.
    border: usize,
    /// Place of each dof in the interior here or in the interface.
    place: Vec<usize>,
}

impl<'a> Layout<'a> {
    fn new(matrix: &'a Matrix, dofs: &'a [usize]) -> Result<Self> {
        let half = halves(matrix, dofs)?;
        let here = if matrix.scope() == Scope::World { matrix.session().rank() as Int } else { 0 };
        let (mut interior, mut border, mut place) = (Vec::new(), 0, vec![0; dofs.len()]);
        for (number, place) in place.iter_mut().enumerate() {
            let half = half[number / matrix.block_size()];
            if half == BETWEEN {
                *place = border;
                border += 1;
            } else if half == here {
                *place = interior.len();
                interior.push(number);
            }
        }
        Ok(Self { matrix, dofs, half, interior, border, place })
    }

    /// Place in the interface of a dof.
    fn between(&self, number: usize) -> Option<usize> {
        (self.half[number / self.matrix.block_size()] == BETWEEN).then(|| self.place[number])
    }

    /// Numbers of the dofs whose rows this process has.
    fn here(&self) -> std::ops::Range<usize> {
        let own = self.matrix.own();
        let first = |end: usize| self.dofs.partition_point(|&dof| dof < end);
        first(own.start)..first(own.end)
    }

    /// The interior of this process, if there is any, with the nodes of the interface that are coupled with it behind: their places there, and
    /// what is to be factored.
    fn interior(&self) -> Result<(Vec<usize>, Option<Schur>)> {
        let (size, inside) = (self.matrix.block_size(), self.interior.len());
        let (mut lower, mut coupled) = (Vec::new(), Vec::new());
        let rows: Vec<usize> = self.interior.iter().map(|&number| self.dofs[number]).collect();
        let read = |rows| {
            for i in 0..inside {
                row(rows, i, |columns, values| {
                    // springs of open contact are zeros of the matrix
                    for (&column, &value) in columns.iter().zip(values).filter(|entry| *entry.1 != 0.0) {
                        match self.between(column as usize) {
                            Some(place) => coupled.push((place, i, value)),
                            None if self.place[column as usize] <= i => {
                                lower.push((i, self.place[column as usize], value));
                            }
                            None => {}
                        }
                    }
                })?;
            }
            Ok(())
        };
        Indices::alone(&rows)?.of_others(self.matrix, &Indices::alone(self.dofs)?, read)?;
        coupled.sort_unstable_by_key(|&(place, i, _)| (place, i));
        let mut near: Vec<usize> = coupled.iter().map(|entry| entry.0 / size).collect();
        near.dedup();
        let near: Vec<usize> = near.into_iter().flat_map(|node| node * size..(node + 1) * size).collect();
        let behind = |place| inside + near.partition_point(|&near| near < place);
        lower.extend(coupled.into_iter().map(|(place, i, value)| (behind(place), i, value)));
        if inside == 0 {
            return Ok((near, None));
        }
        let retained: Vec<usize> = (inside..inside + near.len()).collect();
        let schur = Schur::analyse(self.matrix.session(), "", size, inside + near.len(), &lower, &retained)?;
        Ok((near, Some(schur)))
    }

    /// The dofs of the interface whose rows this process has, counted from its first, with their places there.
    fn shared(&self) -> Vec<(usize, usize)> {
        self.here().enumerate().filter_map(|(i, number)| Some((i, self.between(number)?))).collect()
    }

    /// The share of this process in S: the rows that it has, and the complement of its interior on the places `near` it.
    fn interface(&self, shared: &[(usize, usize)], near: &[usize], complement: &[f64]) -> Result<Vec<f64>> {
        let (first, mut interface) = (self.here().start, vec![0.0; self.border * self.border]);
        for (&i, of_row) in near.iter().zip(complement.chunks_exact(near.len().max(1))) {
            near.iter().zip(of_row).for_each(|(j, value)| interface[i * self.border + j] = *value);
        }
        for &(of_here, i) in shared {
            row(self.matrix.raw(), self.dofs[first + of_here], |columns, values| {
                for (&column, &value) in columns.iter().zip(values) {
                    let number = self.dofs.binary_search(&(column as usize)).ok();
                    if let Some(j) = number.and_then(|number| self.between(number)) {
                        interface[i * self.border + j] += value;
                    }
                }
            })?;
        }
        Ok(interface)
    }
}
