//! The report of a run: `report.json`.

use super::format::sci;
use super::largest::largest;
use super::look::LookReport;
use super::steps::{Extent, StepReport};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

/// What a run did and found. Lengths, forces and energies are in the units of the scene.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Report {
    /// Version of the program.
    pub winkler: String,
    /// Version of PETSc; `None` for a run that made no object of it, and did not load it.
    pub petsc: Option<String>,
    /// BLAS library in use.
    pub blas: String,
    /// MPI ranks.
    pub ranks: usize,
    /// Title of the scene.
    pub title: String,
    /// How the run ended: `converged`, `roundoff-limited`, `iteration-limit`, `not-finite`, `out-of-range`, `cycle`, `underconstrained`,
    /// `unbounded`, `inner-solver`, `inaccurate`, `interrupted`; `running` in a snapshot.
    pub status: String,
    /// The status in words, with body and iteration where they matter.
    pub message: String,
    /// Method that made the last step: `robin`, `ncg`, `anderson`, `newton-robin`, `newton`.
    pub method: String,
    /// What solved the linear steps of all bodies together, such as `cg + hypre`; empty if each body had its own solver.
    pub linear_step: String,
    /// Updates of the iterate.
    pub iterations: usize,
    /// Times that every body was solved.
    pub sweeps: usize,
    /// Numeric factorisations or preconditioner set-ups, all bodies.
    pub factorizations: usize,
    /// Dense factorisations of condensed bodies, all bodies.
    pub dense_factorizations: usize,
    /// Exact solves near the contact made instead of preconditioner set-ups, all bodies.
    pub patches: usize,
    /// Symbolic factorisations, all bodies.
    pub symbolic_factorizations: usize,
    /// Stiffness matrices assembled.
    pub assemblies: usize,
    /// Stiffness matrices that an earlier run of a sweep has left.
    pub assemblies_avoided: usize,
    /// Numeric factorisations of stiffness matrices that an earlier run of a sweep has left.
    pub factorizations_avoided: usize,
    /// Solves of one body, those of the start included.
    pub body_solves: usize,
    /// Solves of one body that were not needed because its data did not change.
    pub body_solves_skipped: usize,
    /// Changes of a body's Robin term.
    pub robin_updates: usize,
    /// Robin terms that did not change, so that nothing was refactored.
    pub robin_updates_skipped: usize,
    /// Krylov iterations, all bodies.
    pub inner_iterations: usize,
    /// Steps of Newton's method that were taken with smoothed laws.
    pub smoothed_steps: usize,
    /// Collective messages between ranks.
    pub messages: usize,
    /// Load steps, if they were asked for, the full load included.
    pub steps: Vec<StepReport>,
    /// The number by which the run ended: of sweeps the relative residual, of Newton's method the largest of its relative errors.
    pub residual: Option<f64>,
    /// Bound of the relative error of the iteration in the energy norm, where it is one.
    pub error_bound: Option<f64>,
    /// Estimate of that error where there is no bound.
    pub error_estimate: Option<f64>,
    /// What rounding of gaps and displacements can make of a pressure, as a share of the largest one; the errors above do not count it.
    pub rounding: Option<f64>,
    /// What the last look at the result found; none where a run has no result.
    pub last_look: Option<LookReport>,
    /// Estimated errors of the discretisation, if they were asked for.
    pub discretization_error: Option<EstimateReport>,
    /// Meshes that were adapted to an error, one after another.
    pub rounds: Vec<RoundReport>,
    /// Estimated bounds of the spectrum of G^-1 F1''.
    pub spectrum: Option<[f64; 2]>,
    /// What more iterations would bring.
    pub forecast: Option<ForecastReport>,
    /// Interval (33) of gamma, if it was asked for.
    pub gamma_interval: Option<IntervalReport>,
    /// Relative increment of the last update, the largest of the bodies.
    pub increment: Option<f64>,
    /// Functional F1 (25).
    #[serde(rename = "F1")]
    pub f1: Option<f64>,
    /// Words of the command line.
    pub command: Vec<String>,
    /// The folder in which the command was typed.
    pub directory: String,
    /// PETSc options, as typed.
    pub petsc_options: Vec<String>,
    /// Degrees of freedom of all bodies.
    pub dofs: usize,
    /// Bodies in the order of the scene.
    pub bodies: Vec<BodyReport>,
    /// Pairs in the order of the scene.
    pub pairs: Vec<PairReport>,
    /// Wall seconds of each phase.
    pub times: BTreeMap<String, f64>,
    /// Largest resident memory of the first rank at the end of each phase, 10^6 bytes.
    pub memory: BTreeMap<String, f64>,
    /// The same of every rank, but for the phase `output`.
    pub memory_of_ranks: Vec<BTreeMap<String, f64>>,
    /// Wall seconds of the inner solvers, summed over the bodies; they lie within the phases `set-up` and `iterate`.
    pub inner_times: InnerTimes,
    /// What a user should know.
    pub warnings: Vec<String>,
    /// The scene with all defaults filled in.
    pub settings: Value,
    /// Which pairs have no table and plot of their own, and how to get them, in words; none if all have.
    pub left_out: Option<String>,
    /// Files written, relative to the folder of results.
    pub files: Vec<String>,
}

/// What more iterations would bring, from the spectrum and the method's own rate.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct ForecastReport {
    /// Factor by which an iteration reduces the residual in the long run.
    pub factor: f64,
    /// Iterations from the result to the residual that was asked for; null if it is never reached.
    pub iterations: Option<f64>,
    /// The best stationary gamma, 2/(lowest + highest of the spectrum), if there are bounds.
    pub best_gamma: Option<f64>,
    /// The factor of `robin` with that gamma.
    pub best_factor: Option<f64>,
}

/// Theorem 3 on the level set of the start; intervals of gamma begin at zero, which is not in them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct IntervalReport {
    /// End of the interval (33), 2 lower/upper^2; null where `lower` is zero.
    pub theorem: Option<f64>,
    /// End of the interval in which F1 falls in every step, 2/upper.
    pub descent: f64,
    /// B_Phi: F1'' is at least this times G.
    pub lower: f64,
    /// D_Phi: and at most this times G.
    pub upper: f64,
}

/// Wall seconds of the inner solvers.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct InnerTimes {
    /// Factorisations and preconditioner set-ups.
    pub factor: f64,
    /// Of these, the first one of each body, with its symbolic factorisation.
    pub first: f64,
    /// Solves.
    pub solve: f64,
}

/// Estimated errors of the discretisation, relative.
#[derive(Debug, Clone, Default, Serialize)]
pub struct EstimateReport {
    /// In the energy norm of bodies and layers.
    pub energy: f64,
    /// Of the nodal values, in the same norm.
    pub nodal: f64,
    /// Of the normal displacements at the contact points, root of mean squares.
    pub displacement: f64,
    /// Of the pressures at the contact points of each pair, root of mean squares.
    pub pressure: Vec<f64>,
    /// Share of each body in the squared energy error, in the order of the scene.
    pub bodies: Vec<f64>,
}

/// One mesh of an adaptation; errors are relative estimates.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct RoundReport {
    /// Cells of all bodies.
    pub cells: usize,
    /// Degrees of freedom.
    pub dofs: usize,
    /// Error of the pressures, the largest of the pairs.
    pub pressure: f64,
    /// Error of the normal displacements at the contact points.
    pub displacement: f64,
    /// Error in the energy norm.
    pub energy: f64,
    /// Iterations.
    pub iterations: usize,
    /// Wall seconds, the making of the mesh included.
    pub seconds: f64,
}

/// One body.
#[derive(Debug, Clone, Default, Serialize)]
pub struct BodyReport {
    /// Name.
    pub name: String,
    /// Nodes.
    pub nodes: usize,
    /// Cells.
    pub cells: usize,
    /// Facets between two cells, each found on opposite sides of it.
    pub inner_facets: usize,
    /// Facets of its boundary, which does not meet itself.
    pub boundary_facets: usize,
    /// Parts that no facet joins; one but for bodies in pieces.
    pub parts: usize,
    /// Degrees of freedom.
    pub dofs: usize,
    /// Inner solver in words; empty if nothing was solved.
    pub solver: String,
    /// Rank that owned it.
    pub rank: usize,
    /// Largest von Mises stress at the nodes.
    pub max_von_mises: Option<f64>,
    /// Where it is (x, y, z).
    pub max_von_mises_at: Option<[f64; 3]>,
    /// Largest displacement at the nodes.
    pub max_displacement: Option<f64>,
    /// Largest and least principal stress at the nodes.
    pub principal_range: Option<[f64; 2]>,
    /// Largest principal strain in absolute value, at the centres of cells.
    pub max_strain: Option<f64>,
    /// Where it is (x, y, z).
    pub max_strain_at: Option<[f64; 3]>,
    /// Error against the scene's `exact` over its own norm: of displacements in L2.
    pub error_l2: Option<f64>,
    /// The same of displacement gradients in L2: the H1 seminorm.
    pub error_h1: Option<f64>,
    /// The same in the energy norm.
    pub error_energy: Option<f64>,
    /// Forces on it.
    pub balance: BalanceReport,
}

/// A force and its moment about the origin (x, y, z), and where it acts.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ForceReport {
    /// What it comes from: a physical group of a support, spring or rigid surface; `loads`, `contacts`.
    pub on: String,
    /// The force.
    pub force: [f64; 3],
    /// The moment.
    pub moment: [f64; 3],
}

/// Forces on a body; all together are zero in equilibrium.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct BalanceReport {
    /// Loads, but for those on rigid surfaces.
    pub loads: ForceReport,
    /// All contacts.
    pub contacts: ForceReport,
    /// Reaction of each support, in the order of the scene.
    pub supports: Vec<ForceReport>,
    /// Force of each spring.
    pub springs: Vec<ForceReport>,
    /// Force of each rigid surface, that of supports of its nodes included; its moment keeps the surface from turning.
    pub rigid: Vec<ForceReport>,
    /// Size of the sum of all forces over the sum of the sizes of all nodal forces.
    pub force_imbalance: f64,
    /// The same for moments, about the origin, or about a point near the mesh where the origin is far away (docs/meshes.md).
    pub moment_imbalance: f64,
}

/// One pair of surfaces, sides in the order of the scene.
#[derive(Debug, Clone, Default, Serialize)]
pub struct PairReport {
    /// Names of the surfaces.
    pub surfaces: [String; 2],
    /// Names of the bodies.
    pub bodies: [String; 2],
    /// Number of the scene's `[[contact]]` that it comes from, counted from 0, as in the settings.
    pub contact: usize,
    /// Contact points.
    pub points: usize,
    /// Surface whose mesh carries the points.
    pub carrier: String,
    /// Estimated coupling theta of each side (docs/theory.md).
    pub theta: [f64; 2],
    /// Facets of the carrier without a partner.
    pub facets_uncovered: usize,
    /// Facets of the carrier that are left out, as a whole or in part, since they stand too steeply to the other side.
    pub facets_steep: usize,
    /// The same for facets that are too far away from it.
    pub facets_far: usize,
    /// Pieces of the carrier that the search for common points has lost; a warning says where.
    pub pieces_lost: usize,
    /// Facets of the carrier that are covered in part and take plain means.
    pub facets_averaged: usize,
    /// Energy of the layer, J.
    pub layer_energy: f64,
    /// Contact force on each side (x, y, z).
    pub force: [[f64; 3]; 2],
    /// Moment of that about the origin (x, y, z).
    pub moment: [[f64; 3]; 2],
    /// How far the bodies come nearer to each other along the mean normal; null where normals cancel.
    pub approach: Option<f64>,
    /// Largest pressure.
    pub peak_pressure: f64,
    /// Where it is (x, y, z).
    pub peak_at: [f64; 3],
    /// Largest compression of the layer; negative where all of it is open.
    pub peak_compression: f64,
    /// How much is in contact, and how much is covered by both surfaces and open.
    #[serde(flatten)]
    pub extent: Extent,
    /// Plane problems: where contact begins or ends, c = 0 between two points, interpolated linearly.
    pub contact_ends: Vec<[f64; 3]>,
}

/// Bodies, pairs, load steps or warnings that the terminal lists, and pairs with files of their own unless the scene says how many: as
/// many as a person looks through. More stand in the report only.
pub const LISTED: usize = 24;

/// Numbers of the pairs with the largest forces, at most `most`, in the order of the scene.
pub fn busiest(pairs: &[PairReport], most: usize) -> Vec<usize> {
    largest(pairs.iter().map(|pair| pair.force[0].iter().map(|f| f * f).sum()), most)
}

/// A number with `digits` after the point, or with an exponent where that would not show it.
pub fn readable(value: f64, digits: usize) -> String {
    let size = value.abs();
    if value == 0.0 || (1e-3..1e6).contains(&size) { format!("{value:.digits$}") } else { sci(value, digits) }
}
