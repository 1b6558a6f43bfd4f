//! What inner solvers cost: the choice between a factorisation and multigrid for bodies in space.
//!
//! The dense operations of a factorisation are counted before it is made ([`linalg::factorisation`](crate::linalg::factorisation)). All else goes with the entries of K, and
//! is counted in products of K with a vector, whose speed is that of the machine's memory ([`speed`](super::speed)). docs/solvers.md has both ways on thirty
//! scenes against the choice.

use super::Retained;
use crate::error::Result;
use crate::linalg::factorisation;
use crate::linalg::portable::pow;
use crate::petsc::nested_dissection;
use crate::problem::order::Order;
use serde::{Deserialize, Serialize};

/// Dense operations in a second, of two cores with AVX2 or one with AVX-512 (docs/solvers.md, "The choice").
const RATE: f64 = 2.8e10;

/// What a factorisation takes besides dense operations, in products with K: order, assembly of fronts, small fronts. Most scenes there
/// took 100 to 400, thin slices less.
const FACTORED: f64 = 320.0;

/// What multigrid takes from its set-up to the last of Newton's steps, in products with K: the scenes there took 690 to 1290 with linear elements and
/// 380 to 1260 with quadratic ones. Most of that range is the number of iterations, which neither dofs nor shapes of cells foretell.
const MULTIGRID: f64 = 900.0;

/// Seconds that the cheaper way must take on the machine there for the speed of this one to be measured: ten times what that takes.
const WORTH: f64 = 0.5;

/// Newton's steps of a scene there, which take 3 to 7: dense factorisations of all contacts together.
const STEPS: f64 = 5.0;

/// Bytes of multigrid for an entry of K: 12 each for G, which stands for K, and hypre's copy, and half a copy for its levels. For two
/// cubes of 48^3 that is 922 MB; the run took 1153, with 50 for the process and 180 for mesh, spaces and vectors.
const LEVELS: f64 = 30.0;

/// The same of quadratic elements: one copy, and a fifth of it for the linear ones with their levels and for the blocks of Gauss-Seidel. For
/// `flange` with 65 004 dofs that is 72 MB; the run took 143, with 50 for the process and 18 for mesh, spaces and vectors.
const LEVELS_P2: f64 = 15.0;

/// What MUMPS takes over the entries of its factor, for fronts that wait and for pivots: 754 MB for two bodies with 31 million entries
/// each, beside 150 MB for all else (two cubes of 24^3).
const FRONTS: f64 = 1.2;

/// What solves a linear step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// One matrix of all bodies.
    Joined,
    /// Newton's method by sweeps, each with one application of the bodies' multigrid.
    Swept,
    /// None: every sweep solves for each body.
    Sweeps,
}

impl Step {
    /// How many times as long multigrid takes as in one matrix of all bodies: `newton-robin` and `robin` on the first scenes there took
    /// 1.0 to 1.9 and 5.4 to 12 times as long.
    fn times(self) -> f64 {
        match self {
            Step::Joined => 1.0,
            Step::Swept => 1.2,
            Step::Sweeps => 7.0,
        }
    }
}

/// A body in space, before it is assembled.
pub struct Candidate<'a> {
    /// Its dofs.
    pub dofs: usize,
    /// Order of its elements.
    pub order: Order,
    /// Those that it retains if it is condensed; none where every factorisation is of the whole body.
    pub retained: Option<&'a Retained>,
    /// Pairs of its nodes that K couples, both ways, and each node with itself.
    pub couplings: usize,
}

/// Seconds of one core and bytes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Cost {
    /// Seconds; rather a measure than a forecast, since machines differ.
    pub seconds: f64,
    /// Bytes at its peak.
    pub bytes: f64,
}

impl Cost {
    /// In words.
    pub fn words(&self) -> String {
        let megabytes = self.bytes / 1e6;
        let digits = |value: f64| if value < 10.0 { format!("{value:.1}") } else { format!("{value:.0}") };
        format!("{} s and {} MB", digits(self.seconds), digits(megabytes))
    }
}

/// A choice for some bodies in space.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub struct Comparison {
    /// Condensed, or factored where nothing can be condensed.
    pub direct: Cost,
    /// Conjugate gradients with multigrid.
    pub multigrid: Cost,
    /// The dense algebra on the contact, which `direct` has, too.
    dense: Cost,
    /// Entries of K that are multiplied with a vector in a second.
    speed: f64,
}

impl Comparison {
    /// Whether the factorisation is the better of the two, and fits into `memory` bytes.
    pub fn is_direct(&self, memory: usize) -> bool {
        self.direct.seconds <= self.multigrid.seconds && self.direct.bytes <= memory as f64
    }

    /// Whether the choice is worth a measurement of the machine.
    pub fn is_worth_a_look(&self) -> bool {
        self.direct.seconds.min(self.multigrid.seconds) > WORTH
    }

    /// Compares both ways to solve for these bodies on a machine that multiplies `speed` entries of a sparse matrix in a second, with as many operations for
    /// a factorisation as a cube of as many dofs needs: no body needs more.
    pub fn of_cubes(bodies: &[Candidate], step: Step, speed: f64) -> Self {
        let multigrid = bodies.iter().fold(Cost::default(), |sum, body| sum.and(body.multigrid(step, speed)));
        let retained = bodies.iter().map(|body| body.retained.map_or(0, |retained| retained.dofs.len()));
        let retained = if step == Step::Joined { retained.sum() } else { retained.max().unwrap_or(0) } as f64;
        let dense = Cost { seconds: STEPS * retained.powi(3) / 3.0 / RATE, bytes: 36.0 * retained * retained };
        let direct = bodies.iter().fold(dense, |sum, body| sum.and(of_cube(body, speed)));
        Self { direct, multigrid, dense, speed }
    }

    /// Whether no order of elimination changes which is better: cubes are factored sooner, the dense algebra on the contact alone takes
    /// longer, or a factor without any entry that K does not have exceeds `memory` bytes.
    pub fn is_known(&self, bodies: &[Candidate], memory: usize) -> bool {
        let least: f64 = bodies.iter().map(|body| 8.0 * FRONTS * 0.5 * 9.0 * body.couplings as f64).sum();
        self.direct.seconds <= self.multigrid.seconds
            || self.dense.seconds > self.multigrid.seconds
            || least > memory as f64
    }

    /// The same by the symbolic factorisation of each body's nodes, of which K couples i with `col[ptr[i]..ptr[i + 1]]`, i itself included:
    /// (ptr, col).
    pub fn analysed(&self, bodies: &[Candidate], graphs: &[(&[u32], &[u32])]) -> Self {
        // without METIS there is no better answer
        let of = |(body, graph): (&Candidate, &(&[u32], &[u32]))| {
            analysed(body, *graph, self.speed).unwrap_or(of_cube(body, self.speed))
        };
        let direct = bodies.iter().zip(graphs).map(of).fold(self.dense, Cost::and);
        Self { direct, ..*self }
    }
}

impl Cost {
    fn and(self, other: Cost) -> Cost {
        Cost { seconds: self.seconds + other.seconds, bytes: self.bytes + other.bytes }
    }
}

impl Candidate<'_> {
    /// By multigrid.
    fn multigrid(&self, step: Step, speed: f64) -> Cost {
        let bytes = match self.order {
            Order::P1 => LEVELS,
            Order::P2 => LEVELS_P2,
        };
        let seconds = MULTIGRID * step.times() * self.entries() / speed;
        Cost { seconds, bytes: bytes * self.entries() }
    }

    /// Entries of K.
    fn entries(&self) -> f64 {
        9.0 * self.couplings as f64
    }

    /// By a factorisation with these dense operations and entries of its factor.
    fn factored(&self, operations: f64, entries: f64, speed: f64) -> Cost {
        let seconds = operations / RATE + FACTORED * self.entries() / speed;
        Cost { seconds: self.times() * seconds, bytes: 8.0 * FRONTS * entries }
    }

    /// How often it is factored.
    fn times(&self) -> f64 {
        if self.retained.is_some() { 1.0 } else { STEPS }
    }
}

/// At most: nested dissection of a cube, measured on blocks of 32 000 to 500 000 dofs.
fn of_cube(body: &Candidate, speed: f64) -> Cost {
    let n = body.dofs as f64;
    Cost { bytes: 220.0 * pow(n, 4.0 / 3.0), ..body.factored(19.0 * n * n, 0.0, speed) }
}

/// By the symbolic factorisation of the nodes.
fn analysed(body: &Candidate, (ptr, col): (&[u32], &[u32]), speed: f64) -> Result<Cost> {
    let nodes = ptr.len() - 1;
    let mut neighbours = vec![0];
    let mut others = Vec::with_capacity(col.len() - nodes);
    for node in 0..nodes {
        let row = &col[ptr[node] as usize..ptr[node + 1] as usize];
        others.extend(row.iter().filter(|other| **other as usize != node).map(|&other| other as i32));
        neighbours.push(others.len() as i32);
    }
    let position = nested_dissection(&mut neighbours, &mut others)?;
    let mut weight = vec![3; nodes];
    body.retained.into_iter().flat_map(|retained| &retained.dofs).for_each(|dof| weight[dof / 3] -= 1);
    let stays = (0..nodes).map(|node| (node, 3 - weight[node])).filter(|stay| stay.1 > 0);
    let work = factorisation(ptr, col, &position, &weight, &stays.collect::<Vec<_>>());
    Ok(body.factored(work.operations, work.entries, speed))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::rigid::AtDofs;
    use crate::linalg::Csr;
    use crate::solver::speed::REFERENCE;

    /// Nodes of a box, each coupled to the next along its edges, and contact along z on those with z = 0.
    fn body([x, y, z]: [usize; 3]) -> (Vec<u32>, Vec<u32>, Retained) {
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
        (ptr, col, Retained::new(3, &rows, &[], AtDofs::NONE))
    }

    fn of(sizes: &[[usize; 3]], step: Step) -> Comparison {
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

    fn candidates(bodies: &[(Vec<u32>, Vec<u32>, Retained)]) -> Vec<Candidate<'_>> {
        let mut candidates = Vec::new();
        for (ptr, col, retained) in bodies {
            let (dofs, couplings) = (3 * (ptr.len() - 1), col.len());
            candidates.push(Candidate { dofs, order: Order::P1, retained: Some(retained), couplings });
        }
        candidates
    }

    /// Small cubes are factored, whatever order is found; wide contact is not; and no factor has fewer entries than K.
    #[test]
    fn graphs_are_analysed_only_where_the_answer_depends_on_them() {
        let known = |sizes: &[[usize; 3]], memory: usize| {
            let bodies: Vec<_> = sizes.iter().map(|&size| body(size)).collect();
            let candidates = candidates(&bodies);
            Comparison::of_cubes(&candidates, Step::Joined, REFERENCE).is_known(&candidates, memory)
        };
        assert!(known(&[[10, 10, 10]], usize::MAX) && known(&[[100, 100, 3]], usize::MAX));
        // 9 x 8 x 0.6 bytes for each of 7 couplings of a node, less those at the surface
        let bar = [[6, 6, 1296]];
        assert!(!known(&bar, usize::MAX) && !known(&bar, 13_000_000) && known(&bar, 12_000_000));
    }

    /// A cube is dear to factor and a long bar of as many nodes is not, which its dofs alone do not say.
    #[test]
    fn a_bar_is_factored_where_a_cube_is_not() {
        let (bar, cube) = (of(&[[6, 6, 1296]], Step::Joined), of(&[[36, 36, 36]], Step::Joined));
        assert!(bar.is_direct(usize::MAX) && !cube.is_direct(usize::MAX));
        assert!(!bar.is_direct(1_000_000), "{}", bar.direct.bytes);
        assert!(5.0 * bar.direct.seconds < cube.direct.seconds, "{} {}", bar.direct.words(), cube.direct.words());
        // and the count is below the most of a cube
        let most = 19.0 * 139_968f64.powi(2) / RATE;
        assert!((0.3..1.2).contains(&(cube.direct.seconds / most)), "{} {most}", cube.direct.seconds);
    }

    /// Dense algebra on the contacts of two bodies counts where Newton's method joins them, and multigrid more where it does not.
    #[test]
    fn joined_bodies_share_their_contact() {
        let wide = [[40, 40, 2]; 2];
        let (joined, apart) = (of(&wide, Step::Joined), of(&wide, Step::Sweeps));
        let dense = |retained: f64| STEPS * retained.powi(3) / 3.0 / RATE;
        let more = joined.direct.seconds - apart.direct.seconds;
        assert!((more / (dense(3200.0) - dense(1600.0)) - 1.0).abs() < 1e-9, "{more}");
        assert!((apart.multigrid.seconds / (Step::Sweeps.times() * joined.multigrid.seconds) - 1.0).abs() < 1e-9);
        assert!(!joined.is_direct(usize::MAX) && apart.is_direct(usize::MAX));
    }
}
