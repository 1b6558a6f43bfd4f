//! A body condensed to its contact: the interior is eliminated once, and the method works on the remaining dofs.
//!
//! Let R be the retained dofs and I the interior ones, in axes turned to the contact normals. Then S = K_RR - K_RI K_II^-1 K_IR is the
//! stiffness and g = f_R - K_RI K_II^-1 f_I the load of a body with the same contact rows. Its matrix G = S + B_R' diag(weight) B_R is dense and small.
//! A state stands for that of the whole body with its interior in equilibrium. So residual, energies and all output have the values of the whole body.

use super::options::Chosen;
use super::{Dense, Retained, SparseBody, memory};
use crate::error::{Error, Kind, Result};
use crate::fem::{ElasticBody, rigid::FreeMotion};
use crate::linalg::{Csr, dot};
use crate::model::{Body, BodyCounts, Energy, Loads, Matrices, Solved};
use crate::petsc::{Rows, Schur, Session};
use std::cell::RefCell;
use std::time::Instant;

/// A body whose states are its retained dofs.
pub struct CondensedBody {
    session: Session,
    chosen: Chosen,
    retained: Retained,
    dimension: usize,
    /// The body with all dofs. Its K is dropped when the body is condensed.
    whole: ElasticBody,
    /// f of all dofs, in the turned axes.
    load: Vec<f64>,
    /// Rigid motions that supports leave free, on the retained dofs.
    free: Vec<FreeMotion>,
    /// Made when something first needs G; results that need it are NaN before.
    condensed: Option<Condensed>,
}

/// The body on its retained dofs.
struct Condensed {
    /// Whether it was made in an earlier run.
    is_reused: bool,
    /// Wall seconds of the elimination.
    seconds: f64,
    schur: RefCell<Schur>,
    body: SparseBody<Dense>,
}

impl CondensedBody {
    /// Prepare a body that will be condensed when it is set up. Its PETSc options for MUMPS apply, others are not read.
    pub fn new(
        session: &Session,
        chosen: Chosen,
        dimension: usize,
        whole: ElasticBody,
        free: Vec<FreeMotion>,
        retained: Retained,
    ) -> Self {
        let free = free.into_iter().map(|motion| on_retained(&retained, motion)).collect();
        let load = retained.turn(&whole.load);
        Self { session: session.clone(), chosen, retained, dimension, whole, load, free, condensed: None }
    }

    /// Eliminate the interior, the first time that this is called.
    fn condense(&mut self) -> Result<&mut Condensed> {
        if self.condensed.is_none() {
            self.condensed = Some(self.eliminate()?);
            self.whole.stiffness = Csr::new(0);
        }
        match &mut self.condensed {
            Some(condensed) => Ok(condensed),
            None => unreachable!("it was made above"),
        }
    }

    /// Return the body on the retained dofs, with its loads and without K. None of these dofs is prescribed.
    fn with_loads(&self, schur: &mut Schur) -> Result<ElasticBody> {
        let (mut whole_lifting, mut lifting) = (Vec::new(), Vec::new());
        if !self.whole.lifting.is_empty() {
            whole_lifting = self.retained.turn(&self.whole.lifting);
            lifting = schur.condense(&whole_lifting)?;
        }
        let load = schur.condense(&self.load)?;
        // displacement of the interior under the loads alone, with the retained dofs at rest
        let interior = schur.expand_condensed(&self.load, &vec![0.0; self.retained.dofs.len()])?;
        let work = dot(&self.load, &interior);
        Ok(ElasticBody {
            load,
            lifting,
            energy_constant: self.whole.energy_constant - 0.5 * work,
            strain_constant: self.whole.strain_constant + work + 2.0 * dot(&whole_lifting, &interior),
            ..ElasticBody::default()
        })
    }

    /// Factor the interior and form S.
    fn eliminate(&self) -> Result<Condensed> {
        let began = Instant::now();
        let (dofs, retained) = (&self.retained.dofs, self.retained.dofs.len());
        let lower = self.retained.lower_triangle(&self.whole.stiffness);
        let (session, name, len) = (&self.session, self.chosen.prefix(), self.load.len());
        let mut schur =
            self.chosen.lend(session, || Schur::analyse(session, name, self.dimension, len, &lower, dofs))?;
        drop(lower);
        let (needed, free) = (schur.expected_megabytes(), memory::available() / 1_000_000);
        if needed > free {
            let message = format!("body `{name}`: its factorisation needs {needed} MB of memory, {free} MB are free");
            return Err(Error::new(Kind::Solver, message).help("take multigrid: --set solver=hypre"));
        }
        schur.factor()?;
        let with_loads = self.with_loads(&mut schur)?;
        let body = ElasticBody { stiffness: Csr::full(retained, schur.take_complement()), ..with_loads };
        let dense = |stiffness: Rows| Ok(Dense::new(stiffness));
        let body = SparseBody::new(body, self.retained.rows.clone(), &self.free, None, dense, String::new());
        Ok(Condensed { is_reused: false, seconds: began.elapsed().as_secs_f64(), schur: RefCell::new(schur), body })
    }
}

/// Return a motion on the retained dofs, in the turned axes.
fn on_retained(retained: &Retained, motion: FreeMotion) -> FreeMotion {
    let turned = retained.turn(&motion.displacement);
    FreeMotion { displacement: retained.dofs.iter().map(|&dof| turned[dof]).collect(), work: motion.work }
}

impl Body for CondensedBody {
    fn len(&self) -> usize {
        self.retained.dofs.len() + self.free.len()
    }

    fn rest(&self) -> Vec<f64> {
        vec![0.0; self.len()]
    }

    fn trace(&self, u: &[f64], t: &mut [f64]) {
        match &self.condensed {
            Some(condensed) => condensed.body.trace(u, t),
            None => t.fill(f64::NAN),
        }
    }

    fn add_rows(&self, rows: &[f64], y: &mut [f64]) {
        match &self.condensed {
            Some(condensed) => condensed.body.add_rows(rows, y),
            None => y.fill(f64::NAN),
        }
    }

    fn residual(&self, u: &[f64], product: &[f64], force: &[f64], r: &mut [f64]) -> Energy {
        match &self.condensed {
            Some(condensed) => condensed.body.residual(u, product, force, r),
            None => {
                r.fill(f64::NAN);
                Energy { strain: f64::NAN, potential: f64::NAN }
            }
        }
    }

    fn apply_stiffness(&mut self, u: &[f64], y: &mut [f64]) {
        match &mut self.condensed {
            Some(condensed) => condensed.body.apply_stiffness(u, y),
            None => y.fill(f64::NAN),
        }
    }

    fn robin(&mut self, weight: &[f64]) -> Result<()> {
        self.condense()?.body.robin(weight)
    }

    fn set_up(&mut self) -> Result<()> {
        self.condense()?.body.set_up()
    }

    fn reveal(&mut self) -> Result<()> {
        self.condense().map(|_| ())
    }

    fn solve(&mut self, r: &[f64], z: &mut [f64]) -> Result<Solved> {
        self.condense()?.body.solve(r, z)
    }

    fn rounding(&self, u: &[f64], force: &[f64]) -> f64 {
        self.condensed.as_ref().map_or(0.0, |condensed| condensed.body.rounding(u, force))
    }

    fn reduce(&mut self, load: &[f64]) -> Result<Vec<f64>> {
        let mut load = load.to_vec();
        self.whole.prescribed.iter().for_each(|&(dof, _)| load[dof] = 0.0);
        let turned = self.retained.turn(&load);
        let condensed = self.condense()?;
        let load = condensed.schur.get_mut().condense(&turned)?;
        condensed.body.reduce(&load)
    }

    fn counts(&self) -> BodyCounts {
        let Some(condensed) = &self.condensed else { return BodyCounts::default() };
        let counts = condensed.body.counts();
        let seconds = if condensed.is_reused { 0.0 } else { condensed.seconds };
        BodyCounts {
            factorizations: usize::from(!condensed.is_reused),
            factorizations_avoided: usize::from(condensed.is_reused),
            symbolic: usize::from(!condensed.is_reused),
            first_seconds: seconds,
            factor_seconds: counts.factor_seconds + seconds,
            ..counts
        }
    }

    fn begin_anew(&mut self) {
        if let Some(condensed) = &mut self.condensed {
            condensed.is_reused = true;
            condensed.body.begin_anew();
        }
    }

    fn reload(&mut self, loads: &Loads) -> Result<bool> {
        let Some(mut condensed) = self.condensed.take() else { return Ok(false) };
        let dofs = |prescribed: &[(usize, f64)]| prescribed.iter().map(|entry| entry.0).collect::<Vec<_>>();
        let fits = dofs(&self.whole.prescribed) == dofs(&loads.prescribed) && self.free.len() == loads.work.len();
        if fits {
            self.whole.reload(loads.force.clone(), loads.prescribed.clone(), loads.carried.clone());
            self.load = self.retained.turn(&self.whole.load);
            self.free.iter_mut().zip(&loads.work).for_each(|(motion, work)| motion.work = *work);
            let with_loads = self.with_loads(condensed.schur.get_mut())?;
            condensed.body.reload(with_loads, &self.free);
        }
        self.condensed = Some(condensed);
        Ok(fits)
    }

    fn matrices(&self) -> Option<Matrices<'_>> {
        self.condensed.as_ref().and_then(|condensed| condensed.body.matrices())
    }

    fn rigid(&self) -> usize {
        self.free.len()
    }

    fn separate(&self, state: &mut [f64]) {
        if let Some(condensed) = &self.condensed {
            condensed.body.separate(state);
        }
    }

    fn recover(&self, u: &[f64]) -> Result<Vec<f64>> {
        let turned = match &self.condensed {
            Some(Condensed { schur, body, .. }) => schur.borrow_mut().expand(&self.load, &body.join(u))?,
            None => vec![0.0; self.load.len()],
        };
        Ok(self.retained.turn_back(&turned))
    }

    fn carried(&self) -> &[f64] {
        &self.whole.carried
    }

    fn describe(&self) -> String {
        format!("condensed to {} dofs by mumps", self.retained.dofs.len())
    }
}
