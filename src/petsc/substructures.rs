//! A factor by substructures: two processes eliminate one half each, and all processes factor the interface.
//!
//! Let I be the interior dofs of each half, and B the interface dofs between the halves. The sums run over the halves:
//!
//! ```text
//! S = A_BB - sum A_BI A_II^-1 A_IB,   x_B = S^-1 (b_B - sum A_BI A_II^-1 b_I),   x_I = A_II^-1 (b_I - A_IB x_B)
//! ```
//!
//! S is dense and the same on all processes. A solve needs one sum over the processes, with a number for each interface dof. It also exchanges
//! the entries of b and x that are not owned where their half is. One process has one half and no interface.
//!
//! More than two parts do not pay. Elimination of n dofs in space takes c n^2 operations. The interface of p parts has about p^(1/3) n^(2/3)
//! dofs and takes c' p n^2, so that the best p does not depend on n. The size of S grows as p^(2/3). For two spheres with 99 900 dofs and
//! n = 8166, two, three and four parts on four processes take the same time, and 152, 158, and 176 MB.

use super::halves::{SEPARATOR, halves};
use super::indices::{Indices, row};
use super::scatter::Scatter;
use super::{Int, Matrix, Schur, Scope, Session, cholesky, cholesky_solve};
use crate::error::Result;
use std::cell::RefCell;
use std::ops::Range;

/// The factor of P'AP, where P are some dofs of a matrix A.
pub(super) struct Substructures {
    session: Session,
    scope: Scope,
    /// The exchange between the dofs P that processes own and the interior dofs of this process.
    interior: Scatter,
    /// The factored interior with the interface dofs `near` retained, if this process has an interior.
    schur: Option<RefCell<Schur>>,
    /// The indices in the interface of the dofs that are coupled with the interior of this process.
    near: Vec<usize>,
    /// The interface dofs that this process owns.
    owned: Vec<InterfaceDof>,
    /// The Cholesky factor of S, `border` rows.
    interface: Vec<f64>,
    /// The number of interface dofs.
    border: usize,
}

/// An interface dof that this process owns.
struct InterfaceDof {
    /// Its index among the dofs P that this process owns.
    local: usize,
    /// Its index in the interface.
    index: usize,
}

impl Substructures {
    /// Factor P'AP. Collective. Return `None` if it is not positive definite to rounding.
    ///
    /// `dofs` are all dofs P, the same on all processes: whole nodes in increasing order.
    ///
    /// # Errors
    /// Lack of memory, and other failures of MUMPS.
    pub fn new(matrix: &Matrix, dofs: &[usize]) -> Result<Option<Self>> {
        let (session, scope) = (matrix.session().clone(), matrix.scope());
        let layout = Layout::new(matrix, dofs)?;
        let Interior { near, mut schur } = layout.eliminate_interior()?;
        let mut failed = [0.0];
        if let Some(schur) = &mut schur {
            match schur.factor() {
                Err(_) if schur.is_singular() => failed[0] = 1.0,
                done => done?,
            }
        }
        let complement = schur.as_mut().map_or_else(Vec::new, Schur::take_complement);
        let owned = layout.owned_interface();
        let mut interface = layout.interface_part(&owned, &near, &complement)?;
        drop(complement);
        scope.sum(&session, &mut failed);
        scope.sum(&session, &mut interface);
        let border = layout.border;
        if failed[0] > 0.0 || border > 0 && !cholesky(&mut interface, border)? {
            return Ok(None);
        }
        let interior = Scatter::new(&session, scope, layout.owned().len(), &layout.interior)?;
        Ok(Some(Self { session, scope, interior, schur: schur.map(RefCell::new), near, owned, interface, border }))
    }

    /// Compute x = (P'AP)^-1 b; the slices have one entry for each dof P that this process owns. Collective.
    ///
    /// # Errors
    /// Failures of MUMPS.
    pub fn solve(&self, b: &[f64], x: &mut [f64]) -> Result<()> {
        let interior = self.interior.len();
        let mut inside = vec![0.0; interior + self.near.len()];
        self.interior.gather(b, &mut inside[..interior])?;
        let mut schur = self.schur.as_ref().map(RefCell::borrow_mut);
        let mut interface = vec![0.0; self.border];
        if let Some(schur) = &mut schur {
            let condensed = schur.condense(&inside)?;
            self.near.iter().zip(condensed).for_each(|(&index, value)| interface[index] = value);
        }
        if self.border > 0 {
            self.owned.iter().for_each(|dof| interface[dof.index] += b[dof.local]);
            self.scope.sum(&self.session, &mut interface);
            cholesky_solve(&self.interface, self.border, &mut interface)?;
        }
        if let Some(schur) = &mut schur {
            let near: Vec<f64> = self.near.iter().map(|&index| interface[index]).collect();
            inside = schur.expand_condensed(&inside, &near)?;
        }
        x.fill(0.0);
        self.interior.scatter_add(&inside[..interior], x)?;
        self.owned.iter().for_each(|dof| x[dof.local] = interface[dof.index]);
        Ok(())
    }
}

/// The interior of this process, planned for elimination.
struct Interior {
    /// The indices in the interface of the dofs that are coupled with it, whole nodes in increasing order.
    near: Vec<usize>,
    /// The elimination with the dofs `near` retained, if there is an interior.
    schur: Option<Schur>,
}

/// A coupling of an interface dof with an interior dof.
struct Coupling {
    /// The index of the one in the interface.
    index: usize,
    /// The index of the other in the interior.
    inside: usize,
    value: f64,
}

/// The distribution of the dofs P over halves, interface and processes. Positions are those in `dofs`.
struct Layout<'a> {
    matrix: &'a Matrix,
    dofs: &'a [usize],
    /// The half of each node of P.
    half: Vec<i32>,
    /// The positions of the interior dofs of this process.
    interior: Vec<usize>,
    /// The number of interface dofs.
    border: usize,
    /// The index of each dof in the interior of this process or in the interface.
    index: Vec<usize>,
}

impl<'a> Layout<'a> {
    fn new(matrix: &'a Matrix, dofs: &'a [usize]) -> Result<Self> {
        let half = halves(matrix, dofs)?;
        let this_half = if matrix.scope() == Scope::World { matrix.session().rank() as i32 } else { 0 };
        let (mut interior, mut border, mut index) = (Vec::new(), 0, vec![0; dofs.len()]);
        for (position, index) in index.iter_mut().enumerate() {
            let half = half[position / matrix.block_size()];
            if half == SEPARATOR {
                *index = border;
                border += 1;
            } else if half == this_half {
                *index = interior.len();
                interior.push(position);
            }
        }
        Ok(Self { matrix, dofs, half, interior, border, index })
    }

    /// Return the index in the interface of the dof at a position, if it is an interface dof.
    fn interface_index(&self, position: usize) -> Option<usize> {
        (self.half[position / self.matrix.block_size()] == SEPARATOR).then(|| self.index[position])
    }

    /// Return the positions of the dofs that this process owns.
    fn owned(&self) -> Range<usize> {
        let owned = self.matrix.own();
        let first = |end: usize| self.dofs.partition_point(|&dof| dof < end);
        first(owned.start)..first(owned.end)
    }

    /// Plan the elimination of the interior of this process. The interface nodes that are coupled with it follow its own dofs.
    fn eliminate_interior(&self) -> Result<Interior> {
        let (size, inside) = (self.matrix.block_size(), self.interior.len());
        let (mut lower, mut couplings) = (Vec::new(), Vec::new());
        let rows: Vec<usize> = self.interior.iter().map(|&position| self.dofs[position]).collect();
        let read = |submatrix| {
            (0..inside).try_for_each(|i| {
                row(submatrix, i, |columns, values| self.read_row(i, columns, values, &mut lower, &mut couplings))
            })
        };
        Indices::alone(&rows)?.fetch(self.matrix, &Indices::alone(self.dofs)?, read)?;
        couplings.sort_unstable_by_key(|coupling| (coupling.index, coupling.inside));
        let mut nodes: Vec<usize> = couplings.iter().map(|coupling| coupling.index / size).collect();
        nodes.dedup();
        let near: Vec<usize> = nodes.into_iter().flat_map(|node| node * size..(node + 1) * size).collect();
        if inside == 0 {
            return Ok(Interior { near, schur: None });
        }
        let row_of = |index| inside + near.partition_point(|&near| near < index);
        lower.extend(couplings.into_iter().map(|coupling| (row_of(coupling.index), coupling.inside, coupling.value)));
        let retained: Vec<usize> = (inside..inside + near.len()).collect();
        let schur = Schur::analyse(self.matrix.session(), "", size, inside + near.len(), &lower, &retained)?;
        Ok(Interior { near, schur: Some(schur) })
    }

    /// Sort the entries of the interior row `i` into the lower triangle (row, column, value) of the interior and couplings with the interface.
    fn read_row(
        &self,
        i: usize,
        columns: &[Int],
        values: &[f64],
        lower: &mut Vec<(usize, usize, f64)>,
        couplings: &mut Vec<Coupling>,
    ) {
        // open contact leaves zeros in the pattern of the matrix
        for (&column, &value) in columns.iter().zip(values).filter(|entry| *entry.1 != 0.0) {
            let position = column as usize;
            match self.interface_index(position) {
                Some(index) => couplings.push(Coupling { index, inside: i, value }),
                None if self.index[position] <= i => lower.push((i, self.index[position], value)),
                None => {}
            }
        }
    }

    /// Return the interface dofs that this process owns.
    fn owned_interface(&self) -> Vec<InterfaceDof> {
        let dof = |(local, position)| Some(InterfaceDof { local, index: self.interface_index(position)? });
        self.owned().enumerate().filter_map(dof).collect()
    }

    /// Return what this process adds to S, `border` x `border` numbers: the rows of A_BB that it owns, and the `complement` of its
    /// interior on the interface dofs `near` it.
    fn interface_part(&self, owned: &[InterfaceDof], near: &[usize], complement: &[f64]) -> Result<Vec<f64>> {
        let (first, mut part) = (self.owned().start, vec![0.0; self.border * self.border]);
        for (&i, of_row) in near.iter().zip(complement.chunks_exact(near.len().max(1))) {
            near.iter().zip(of_row).for_each(|(j, value)| part[i * self.border + j] = *value);
        }
        for dof in owned {
            row(self.matrix.raw(), self.dofs[first + dof.local], |columns, values| {
                for (&column, &value) in columns.iter().zip(values) {
                    let position = self.dofs.binary_search(&(column as usize)).ok();
                    if let Some(j) = position.and_then(|position| self.interface_index(position)) {
                        part[dof.index * self.border + j] += value;
                    }
                }
            })?;
        }
        Ok(part)
    }
}
