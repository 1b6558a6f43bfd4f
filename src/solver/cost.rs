//! What inner solvers cost: the choice between a factorisation and multigrid for bodies in space.
//!
//! The dense operations of a factorisation are counted before it is made (`factorisation`). All other work is
//! proportional to the entries of K. It is expressed in products of K with a vector, whose speed is that of the machine's memory ([`products`]).
//! docs/solvers.md compares both ways and the choice on thirty scenes, which are called the table below.

use super::InterfaceDofs;
use crate::error::Result;
use crate::linalg::portable::{log2, pow};
use crate::petsc::{Graph, nested_dissection};
use crate::problem::order::Order;
use serde::{Deserialize, Serialize};
use std::hint::black_box;
use std::sync::OnceLock;
use std::time::Instant;

/// Dense operations a second, of two cores with AVX2 or one with AVX-512 (docs/solvers.md, "The choice").
const RATE: f64 = 2.8e10;

/// Time of a factorisation besides its dense operations, in products with K: finding an order, assembly of fronts, small fronts. Most scenes of the
/// table took 100 to 400, thin slices less.
const FACTORED: f64 = 320.0;

/// Time of multigrid from its set-up to the last step of Newton's method, in products with K. The scenes of the table took 690 to 1290 with linear elements
/// and 380 to 1260 with quadratic ones. Most of that range is the number of iterations, which neither dofs nor shapes of cells predict.
const MULTIGRID: f64 = 900.0;

/// The speed of this machine is measured if the cheaper way would take more than so many seconds on the machine of the table: ten times what the
/// measurement takes.
const WORTH: f64 = 0.5;

/// Steps of Newton's method in a scene; those of the table take 3 to 7. Each has a dense factorisation of all contacts together.
const STEPS: f64 = 5.0;

/// Bytes of multigrid for an entry of K: 12 for G, which is stored in place of K, 12 for hypre's copy, and half a copy for its levels. For two
/// cubes of 48^3 this gives 922 MB. The run took 1153 MB, with 50 for the process and 180 for mesh, spaces and vectors.
const LEVELS: f64 = 30.0;

/// Bytes of multigrid for an entry of K with quadratic elements: one copy, and a fifth of it for the linear elements with their levels and for the blocks
/// of Gauss-Seidel. For `flange` with 65 004 dofs this gives 72 MB. The run took 143 MB, with 50 for the process and 18 for mesh, spaces and vectors.
const LEVELS_P2: f64 = 15.0;

/// Memory of MUMPS over that of the entries of its factor; the rest is for fronts that wait and for pivots. Two bodies with 31 million entries
/// each (two cubes of 24^3) took 754 MB, beside 150 MB for all else.
const FRONTS: f64 = 1.2;

/// How a linear step is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepSolver {
    /// With one matrix of all bodies.
    Joined,
    /// By conjugate gradients with Robin sweeps, each with one application of the multigrid of every body.
    Swept,
    /// There is no linear step: the method makes Robin sweeps, which solve for each body.
    Sweeps,
}

impl StepSolver {
    /// Return how many times as long multigrid takes as with one matrix of all bodies. On the first scenes of the table `newton-robin` took 1.0 to 1.9 times
    /// as long, and `robin` 5.4 to 12 times.
    fn times(self) -> f64 {
        match self {
            StepSolver::Joined => 1.0,
            StepSolver::Swept => 1.2,
            StepSolver::Sweeps => 7.0,
        }
    }
}

/// A body in space that is not assembled yet.
pub struct BodySize<'a> {
    /// Number of its dofs.
    pub dofs: usize,
    /// Order of its elements.
    pub order: Order,
    /// The dofs that the body retains if it is condensed; `None` if every factorisation is one of the whole body.
    pub interface: Option<&'a InterfaceDofs>,
    /// Number of the blocks of K: pairs of nodes that K couples, each in both orders, and each node with itself.
    pub couplings: usize,
}

/// Estimated time and memory of a solver.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Cost {
    /// Seconds. They serve to compare solvers rather than to predict a run, since machines differ.
    pub seconds: f64,
    /// Bytes at the peak.
    pub bytes: f64,
}

/// Seconds below which the model of cubes says little of the time. Set-up and iteration of factored bodies took 0.017 of 0.1 s (`groove3d`), 0.08
/// of 0.2 s (`sphere-layer`), 0.23 of 0.5 s (`shells`), and 3.1 of 4.5 s (`rough`).
const BRIEF: f64 = 0.5;

impl Cost {
    /// Return the cost as text. A time below `BRIEF` is not worth a number.
    pub fn words(&self) -> String {
        let megabytes = self.bytes / 1e6;
        let digits = |value: f64| if value < 10.0 { format!("{value:.1}") } else { format!("{value:.0}") };
        match self.seconds {
            seconds if seconds < BRIEF => format!("less than {BRIEF} s and {} MB", digits(megabytes)),
            seconds => format!("some {} s and {} MB", digits(seconds), digits(megabytes)),
        }
    }

    fn and(self, other: Cost) -> Cost {
        Cost { seconds: self.seconds + other.seconds, bytes: self.bytes + other.bytes }
    }
}

/// The costs of both ways to solve for some bodies in space.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct Comparison {
    /// Cost of condensed bodies, or of factored ones where nothing can be condensed.
    pub direct: Cost,
    /// Cost of conjugate gradients with multigrid.
    pub multigrid: Cost,
    /// The part of `direct` that is dense algebra on the contact.
    dense: Cost,
    /// Entries of K that the machine multiplies with a vector in a second.
    speed: f64,
}

impl Comparison {
    /// Return whether the factorisation takes no more time than multigrid and fits into `memory` bytes.
    pub fn is_direct(&self, memory: usize) -> bool {
        self.direct.seconds <= self.multigrid.seconds && self.direct.bytes <= memory as f64
    }

    /// Return whether the run is long enough for a measurement of the machine.
    pub fn is_worth_a_look(&self) -> bool {
        self.direct.seconds.min(self.multigrid.seconds) > WORTH
    }

    /// Compare both ways to solve for these bodies on a machine that multiplies `speed` entries of a sparse matrix in a second. A factorisation is
    /// assumed to take as many operations as that of a cube with as many dofs; no body needs more.
    pub fn of_cubes(bodies: &[BodySize], step: StepSolver, speed: f64) -> Self {
        let multigrid = bodies.iter().fold(Cost::default(), |sum, body| sum.and(body.multigrid(step, speed)));
        let interface = bodies.iter().map(|body| body.interface.map_or(0, |interface| interface.dofs.len()));
        let interface = if step == StepSolver::Joined { interface.sum() } else { interface.max().unwrap_or(0) } as f64;
        let dense = Cost { seconds: STEPS * interface.powi(3) / 3.0 / RATE, bytes: 36.0 * interface * interface };
        let direct = bodies.iter().fold(dense, |sum, body| sum.and(of_cube(body, speed)));
        Self { direct, multigrid, dense, speed }
    }

    /// Return whether the choice does not depend on the order of elimination. This is so if even cubes are factored sooner than multigrid solves, if the
    /// dense algebra on the contact alone takes longer than multigrid, or if a factor without any fill exceeds `memory` bytes.
    pub fn is_known(&self, bodies: &[BodySize], memory: usize) -> bool {
        let without_fill: f64 = bodies.iter().map(|body| 8.0 * FRONTS * 0.5 * 9.0 * body.couplings as f64).sum();
        self.direct.seconds <= self.multigrid.seconds
            || self.dense.seconds > self.multigrid.seconds
            || without_fill > memory as f64
    }

    /// Return the comparison with a symbolic factorisation of each body's nodes. `graphs` has (`ptr`, `col`) of each body: K couples node i
    /// with the nodes `col[ptr[i]..ptr[i + 1]]`, which include i.
    pub fn analysed(&self, bodies: &[BodySize], graphs: &[(&[u32], &[u32])]) -> Self {
        // without METIS there is no better estimate than that of cubes
        let cost = |(body, &(ptr, col)): (&BodySize, &(&[u32], &[u32]))| {
            analysed(body, ptr, col, self.speed).unwrap_or(of_cube(body, self.speed))
        };
        let direct = bodies.iter().zip(graphs).map(cost).fold(self.dense, Cost::and);
        Self { direct, ..*self }
    }
}

impl BodySize<'_> {
    /// Return the cost of multigrid.
    fn multigrid(&self, step: StepSolver, speed: f64) -> Cost {
        let bytes = match self.order {
            Order::P1 => LEVELS,
            Order::P2 => LEVELS_P2,
        };
        let seconds = MULTIGRID * step.times() * self.entries() / speed;
        Cost { seconds, bytes: bytes * self.entries() }
    }

    /// Return the number of entries of K: a block of 3 x 3 for each coupling.
    fn entries(&self) -> f64 {
        9.0 * self.couplings as f64
    }

    /// Return the cost of a factorisation with so many dense operations and entries of its factor.
    fn factored(&self, operations: f64, entries: f64, speed: f64) -> Cost {
        let seconds = operations / RATE + FACTORED * self.entries() / speed;
        Cost { seconds: self.times() * seconds, bytes: 8.0 * FRONTS * entries }
    }

    /// Return how often the body is factored.
    fn times(&self) -> f64 {
        if self.interface.is_some() { 1.0 } else { STEPS }
    }
}

/// Return the cost of factoring a cube with as many dofs by nested dissection, measured on blocks of 32 000 to 500 000 dofs. No body costs more.
fn of_cube(body: &BodySize, speed: f64) -> Cost {
    let n = body.dofs as f64;
    Cost { bytes: 220.0 * pow(n, 4.0 / 3.0), ..body.factored(19.0 * n * n, 0.0, speed) }
}

/// Return the cost of a factorisation from the symbolic factorisation of the nodes.
fn analysed(body: &BodySize, ptr: &[u32], col: &[u32], speed: f64) -> Result<Cost> {
    let nodes = ptr.len() - 1;
    let mut neighbours = vec![0];
    let mut others = Vec::with_capacity(col.len() - nodes);
    for node in 0..nodes {
        let row = &col[ptr[node] as usize..ptr[node + 1] as usize];
        others.extend(row.iter().filter(|other| **other as usize != node).map(|&other| other as i32));
        neighbours.push(others.len() as i32);
    }
    let position = nested_dissection(Graph { ptr: neighbours, col: others })?;
    // number of dofs of each node that are eliminated
    let mut eliminated = vec![3; nodes];
    body.interface.into_iter().flat_map(|interface| &interface.dofs).for_each(|dof| eliminated[dof / 3] -= 1);
    let interface = (0..nodes).map(|node| (node, 3 - eliminated[node])).filter(|(_, count)| *count > 0);
    let work = factorisation(ptr, col, &position, &eliminated, &interface.collect::<Vec<_>>());
    Ok(body.factored(work.operations, work.entries, speed))
}

/// Return the estimated bytes of the sparse Cholesky factor of a plane body by nested dissection. They grow as n log n; the constant was
/// measured on blocks of 32 000 to 500 000 dofs.
pub fn plane_factor_bytes(dofs: usize) -> usize {
    let n = dofs as f64;
    (60.0 * n * log2(n + 2.0)) as usize
}

/// Return the bytes of a condensed body besides its sparse factor: S with its pattern, G, and the factor of G.
pub fn condensed_bytes(interface: usize) -> usize {
    36 * interface * interface
}

/// Return the estimated operations of a sparse Cholesky factorisation of a plane body by nested dissection, measured on the same blocks as [`plane_factor_bytes`].
pub fn plane_factor_work(dofs: usize) -> f64 {
    56.0 * pow(dofs as f64, 1.5)
}

/// Entries a second on the machine of the table in docs/solvers.md.
pub const REFERENCE: f64 = 5.3e8;

/// Rows of the matrix that is multiplied. With [`PER_ROW`] entries in each it takes 39 MB, more than the caches of a core hold.
const ROWS: usize = 120_000;

/// Entries in a row of the matrix.
const PER_ROW: usize = 27;

/// Number of measurements. The fastest counts, because other work of the machine only makes a product slower.
const TIMES: usize = 3;

/// Return how many entries of a sparse matrix one core multiplies in a second. The first call measures it, which takes 40 to 70 ms.
///
/// A factorisation is mostly dense algebra on numbers in the cache. Multigrid reads sparse matrices from memory. Processors differ by a factor of five
/// in the speed of memory and much less in dense algebra, so a choice between the two that was measured on one machine is wrong on another.
pub fn products() -> f64 {
    static SPEED: OnceLock<f64> = OnceLock::new();
    *SPEED.get_or_init(measured)
}

fn measured() -> f64 {
    // columns are neighbours on a lattice, as in the matrix of a mesh
    let neighbour = |row: usize, k: usize| ((row + 3000 * (k / 9) + 55 * (k / 3 % 3) + k % 3) % ROWS) as u32;
    let columns: Vec<u32> = (0..ROWS).flat_map(|row| (0..PER_ROW).map(move |k| neighbour(row, k))).collect();
    let values = vec![1.0; ROWS * PER_ROW];
    let (x, mut y) = (vec![1.0; ROWS], vec![0.0; ROWS]);
    let mut least = f64::INFINITY;
    for _ in 0..TIMES {
        let began = Instant::now();
        for (row, y) in y.iter_mut().enumerate() {
            let row = PER_ROW * row..PER_ROW * (row + 1);
            *y = columns[row.clone()].iter().zip(&values[row]).map(|(column, value)| value * x[*column as usize]).sum();
        }
        black_box(&mut y);
        least = least.min(began.elapsed().as_secs_f64());
    }
    (ROWS * PER_ROW) as f64 / least
}

/// The size of a factorisation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct FactorSize {
    /// Entries of the factor, without those among rows that stay.
    entries: f64,
    /// Multiplications and additions: the sum of the squared lengths of the columns.
    operations: f64,
}

/// Return the work of the elimination of the nodes of a graph in a given order, where some unknowns stay (a Schur complement).
///
/// The neighbours of node i are `col[ptr[i]..ptr[i + 1]]`, with or without i itself. Node i is the `position[i]`-th to be eliminated, with
/// `weight[i]` unknowns; `stays` are (node, number of its unknowns that stay). The entries of a row of the factor are on its paths through the
/// elimination tree (Liu, SIAM J. Matrix Anal. Appl. 11, 1990, 134). So the count takes as many steps as the factor of the graph has entries.
fn factorisation(ptr: &[u32], col: &[u32], position: &[i32], weight: &[usize], stays: &[(usize, usize)]) -> FactorSize {
    const NONE: u32 = u32::MAX;
    let nodes = ptr.len() - 1;
    let mut node_at = vec![0; nodes];
    position.iter().enumerate().for_each(|(node, &at)| node_at[at as usize] = node);
    // unknowns below the diagonal in the columns of each node, by its position
    let mut below = vec![0.0; nodes];
    let (mut parent, mut seen) = (vec![NONE; nodes], vec![NONE; nodes]);
    let rows = node_at.iter().map(|&node| (node, weight[node])).chain(stays.iter().copied());
    for (row, (node, unknowns)) in rows.enumerate() {
        let row = row as u32;
        if (row as usize) < nodes {
            seen[row as usize] = row;
        }
        for &other in &col[ptr[node] as usize..ptr[node + 1] as usize] {
            let mut at = position[other as usize] as u32;
            // a node that stays is below all nodes that are eliminated
            while at < row && seen[at as usize] != row {
                seen[at as usize] = row;
                below[at as usize] += unknowns as f64;
                if parent[at as usize] == NONE && (row as usize) < nodes {
                    parent[at as usize] = row;
                }
                at = parent[at as usize];
            }
        }
    }
    let mut work = FactorSize::default();
    for (&node, below) in node_at.iter().zip(below) {
        for unknown in 0..weight[node] {
            let length = below + (weight[node] - unknown) as f64;
            work.entries += length;
            work.operations += length * length;
        }
    }
    work
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::rigid::AtDofs;
    use crate::linalg::Csr;

    /// Return the graph (ptr, col) of the nodes of a box, each coupled to the next along its edges, with contact along z on the nodes with z = 0.
    fn body([x, y, z]: [usize; 3]) -> (Vec<u32>, Vec<u32>, InterfaceDofs) {
        let (mut ptr, mut col, mut rows) = (vec![0], Vec::new(), Csr::new(3 * x * y * z));
        let range = |i: usize, n: usize| i.saturating_sub(1)..(i + 2).min(n);
        for (i, j, k) in (0..x * y * z).map(|node| (node % x, node / x % y, node / x / y)) {
            for (c, b) in range(k, z).flat_map(|c| range(j, y).map(move |b| (c, b))) {
                let next = range(i, x).filter(|a| a.abs_diff(i) + b.abs_diff(j) + c.abs_diff(k) <= 1);
                col.extend(next.map(|a| (a + x * (b + y * c)) as u32));
            }
            ptr.push(col.len() as u32);
            if k == 0 {
                rows.push_row([(3 * (i + x * (j + y * k)) + 2, 1.0)]);
            }
        }
        (ptr, col, InterfaceDofs::new(3, &rows, &[], AtDofs::NONE))
    }

    fn of(sizes: &[[usize; 3]], step: StepSolver) -> Comparison {
        let bodies: Vec<_> = sizes.iter().map(|&size| body(size)).collect();
        let candidates = candidates(&bodies);
        let graphs: Vec<_> = bodies.iter().map(|(ptr, col, _)| (&ptr[..], &col[..])).collect();
        let comparison = Comparison::of_cubes(&candidates, step, REFERENCE);
        if comparison.is_known(&candidates, usize::MAX) {
            comparison
        } else {
            comparison.analysed(&candidates, &graphs)
        }
    }

    fn candidates(bodies: &[(Vec<u32>, Vec<u32>, InterfaceDofs)]) -> Vec<BodySize<'_>> {
        let mut candidates = Vec::new();
        for (ptr, col, interface) in bodies {
            let (dofs, couplings) = (3 * (ptr.len() - 1), col.len());
            candidates.push(BodySize { dofs, order: Order::P1, interface: Some(interface), couplings });
        }
        candidates
    }

    /// Small cubes are factored whatever order is found, a body with wide contact is not, and no factor has fewer entries than K.
    #[test]
    fn graphs_are_analysed_only_where_the_answer_depends_on_them() {
        let known = |sizes: &[[usize; 3]], memory: usize| {
            let bodies: Vec<_> = sizes.iter().map(|&size| body(size)).collect();
            let candidates = candidates(&bodies);
            Comparison::of_cubes(&candidates, StepSolver::Joined, REFERENCE).is_known(&candidates, memory)
        };
        assert!(known(&[[10, 10, 10]], usize::MAX) && known(&[[100, 100, 3]], usize::MAX));
        // 9 x 8 x 0.6 bytes for each of 7 couplings of a node; nodes at the surface have fewer
        let bar = [[6, 6, 1296]];
        assert!(!known(&bar, usize::MAX) && !known(&bar, 13_000_000) && known(&bar, 12_000_000));
    }

    /// A cube is expensive to factor and a long bar of as many nodes is not. The number of dofs alone does not show this.
    #[test]
    fn a_bar_is_factored_where_a_cube_is_not() {
        let (bar, cube) = (of(&[[6, 6, 1296]], StepSolver::Joined), of(&[[36, 36, 36]], StepSolver::Joined));
        assert!(bar.is_direct(usize::MAX) && !cube.is_direct(usize::MAX));
        assert!(!bar.is_direct(1_000_000), "{}", bar.direct.bytes);
        assert!(5.0 * bar.direct.seconds < cube.direct.seconds, "{} {}", bar.direct.words(), cube.direct.words());
        // and the count is below the upper bound of a cube
        let most = 19.0 * 139_968f64.powi(2) / RATE;
        assert!((0.3..1.2).contains(&(cube.direct.seconds / most)), "{} {most}", cube.direct.seconds);
    }

    /// The dense algebra on the contacts of two bodies counts together where Newton's method joins the bodies. Multigrid costs more where it does not.
    #[test]
    fn joined_bodies_share_their_contact() {
        let wide = [[40, 40, 2]; 2];
        let (joined, apart) = (of(&wide, StepSolver::Joined), of(&wide, StepSolver::Sweeps));
        let dense = |interface: f64| STEPS * interface.powi(3) / 3.0 / RATE;
        let more = joined.direct.seconds - apart.direct.seconds;
        assert!((more / (dense(3200.0) - dense(1600.0)) - 1.0).abs() < 1e-9, "{more}");
        assert!((apart.multigrid.seconds / (StepSolver::Sweeps.times() * joined.multigrid.seconds) - 1.0).abs() < 1e-9);
        assert!(!joined.is_direct(usize::MAX) && apart.is_direct(usize::MAX));
    }

    /// Count the work by elimination in a dense pattern, unknown by unknown.
    fn dense(pattern: &mut [Vec<bool>], order: &[usize]) -> FactorSize {
        let mut work = FactorSize::default();
        let mut gone = vec![false; pattern.len()];
        for &pivot in order {
            gone[pivot] = true;
            let below: Vec<usize> = (0..pattern.len()).filter(|&i| !gone[i] && pattern[pivot][i]).collect();
            let length = below.len() as f64 + 1.0;
            work.entries += length;
            work.operations += length * length;
            below.iter().for_each(|&i| below.iter().for_each(|&j| pattern[i][j] = true));
        }
        work
    }

    /// A grid of 4 x 3 nodes with 2 unknowns each, in an order without sense; one unknown of two nodes stays.
    #[test]
    fn it_is_that_of_an_elimination() {
        let (columns, nodes) = (4usize, 12usize);
        let near =
            |i: usize, j: usize| (i % columns).abs_diff(j % columns) <= 1 && (i / columns).abs_diff(j / columns) <= 1;
        let (mut ptr, mut col) = (vec![0], Vec::new());
        for i in 0..nodes {
            col.extend((0..nodes).filter(|&j| near(i, j)).map(|j| j as u32));
            ptr.push(col.len() as u32);
        }
        let position: Vec<i32> = (0..nodes as i32).map(|i| (5 * i + 3) % nodes as i32).collect();
        for stays in [vec![], vec![(2, 1), (7, 1)]] {
            let weight: Vec<usize> = (0..nodes).map(|i| if stays.contains(&(i, 1)) { 1 } else { 2 }).collect();
            let mut pattern: Vec<Vec<bool>> =
                (0..2 * nodes).map(|i| (0..2 * nodes).map(|j| near(i / 2, j / 2)).collect()).collect();
            let mut order: Vec<usize> = (0..nodes).collect();
            order.sort_by_key(|&i| position[i]);
            let order: Vec<usize> = order.iter().flat_map(|&i| (0..weight[i]).map(move |k| 2 * i + k)).collect();
            let work = factorisation(&ptr, &col, &position, &weight, &stays);
            assert_eq!(work, dense(&mut pattern, &order), "{stays:?}");
        }
    }
}
