//! The report of a run, which becomes `report.json`, and its closing lines on the terminal.

use super::RunStatus;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

/// The report of a run. Lengths, forces and energies are in the units of the scene.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Report {
    /// Version of the program.
    pub winkler: String,
    /// Version of PETSc.
    pub petsc: String,
    /// BLAS library in use.
    pub blas: String,
    /// MPI ranks.
    pub ranks: usize,
    /// Title of the scene.
    pub title: String,
    /// Status at the end of the run: `converged`, `roundoff-limited`, `stagnated`, `iteration-limit`, `not-finite`,
    /// `out-of-range`, `underconstrained`, `unbounded`, `inner-solver`, `inaccurate`, `interrupted`, `mesh-limit`,
    /// `tolerance-unmet`.
    pub status: RunStatus,
    /// The status in words, with body and iteration where they matter.
    pub message: String,
    /// Method of the last step: `robin`, `newton-robin`, `newton`.
    pub method: String,
    /// Solver of the linear steps of all bodies together, such as `cg + hypre`; empty if each body had its own solver.
    pub linear_step: String,
    /// Updates of the iterate.
    pub iterations: usize,
    /// Sweeps, each of which solves every body once.
    pub sweeps: usize,
    /// Numeric factorisations or preconditioner set-ups, all bodies.
    pub factorizations: usize,
    /// Dense factorisations of condensed bodies, all bodies.
    pub dense_factorizations: usize,
    /// Set-ups of a local correction near the contact in place of a preconditioner set-up, all bodies.
    pub patches: usize,
    /// Symbolic factorisations, all bodies.
    pub symbolic_factorizations: usize,
    /// Meshes in space that HXT could not make, or would not make the same in every run.
    pub meshes_without_hxt: usize,
    /// Stiffness matrices assembled.
    pub assemblies: usize,
    /// Bodies condensed to their interfaces.
    pub condensations: usize,
    /// Pairs of surfaces that were searched for common pieces.
    pub pairings: usize,
    /// Solves of one body, those of the start included.
    pub body_solves: usize,
    /// Changes of a body's Robin term.
    pub robin_updates: usize,
    /// Robin terms that did not change, so that no factorisation was needed.
    pub robin_updates_skipped: usize,
    /// Krylov iterations, all bodies.
    pub inner_iterations: usize,
    /// Steps of Newton's method that were taken with smoothed laws.
    pub smoothed_steps: usize,
    /// Collective messages between ranks.
    pub messages: usize,
    /// Load steps, if requested, the full load included.
    pub steps: Vec<StepReport>,
    /// The number of the stopping test: the relative residual of sweeps, or the largest relative error of Newton's
    /// method.
    pub residual: Option<f64>,
    /// Bound of the relative error of the iteration in the energy norm, if there is one.
    pub error_bound: Option<f64>,
    /// Estimate of that error if there is no bound.
    pub error_estimate: Option<f64>,
    /// Possible error of a pressure from rounding of gaps and displacements, relative to the largest pressure. The
    /// errors above do not include it.
    pub rounding: Option<f64>,
    /// Energy norm of the forces f - K u - B' omega p of each node alone, computed with K itself, relative to the
    /// energy of bodies and layers.
    pub unbalanced: Option<f64>,
    /// Estimated errors of the discretisation, if requested.
    pub discretization_error: Option<EstimateReport>,
    /// Errors of pairs above the tolerance, if an adapted run has ended with any.
    pub unmet: Vec<UnmetReport>,
    /// Adapted meshes, one after another.
    pub rounds: Vec<RoundReport>,
    /// Interval (33) of gamma, if requested.
    pub gamma_interval: Option<IntervalReport>,
    /// Relative increment of the last update, the largest of the bodies.
    pub increment: Option<f64>,
    /// Functional F1 (25).
    #[serde(rename = "F1")]
    pub f1: Option<f64>,
    /// Arguments of the command line.
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
    /// Peak resident memory of the first rank at the end of each phase, 10^6 bytes.
    pub memory: BTreeMap<String, f64>,
    /// Peak resident memory of every rank in the same way, without the phase `output`.
    pub memory_of_ranks: Vec<BTreeMap<String, f64>>,
    /// Wall seconds of the inner solvers, summed over the bodies; they are part of the phases `set-up` and `iterate`.
    pub inner_times: InnerTimes,
    /// Warnings for the user.
    pub warnings: Vec<String>,
    /// The scene with all defaults filled in.
    pub settings: Value,
    /// A sentence on the pairs without a table and plot of their own, and how to get them; none if all pairs have them.
    pub left_out: Option<String>,
    /// Files written, relative to the folder of results.
    pub files: Vec<String>,
}

/// The intervals of gamma by theorem 3 on the level set of the start. They begin at zero, which is excluded.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
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

/// The wall seconds of the inner solvers.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct InnerTimes {
    /// Factorisations and preconditioner set-ups.
    pub factor: f64,
    /// The part of `factor` for the first set-up of each body, with its symbolic factorisation.
    pub first: f64,
    /// Solves.
    pub solve: f64,
}

/// Estimated relative errors of the discretisation.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct EstimateReport {
    /// Error in the energy norm of bodies and layers.
    #[serde(deserialize_with = "numbers")]
    pub energy: f64,
    /// Error of the nodal values in the same norm.
    #[serde(deserialize_with = "numbers")]
    pub nodal: f64,
    /// Error of the normal displacements at the contact points, root of mean squares.
    #[serde(deserialize_with = "numbers")]
    pub displacement: f64,
    /// Error of the pressures at the contact points of each pair, root of mean squares.
    #[serde(deserialize_with = "numbers")]
    pub pressure: Vec<f64>,
    /// Error of the sum of the pressures of each pair.
    #[serde(deserialize_with = "numbers")]
    pub force: Vec<f64>,
    /// Fraction of the squared energy error in each body, in the order of the scene.
    #[serde(deserialize_with = "numbers")]
    pub bodies: Vec<f64>,
}

/// An estimated error above the tolerance at the end of an adapted run.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct UnmetReport {
    /// Names of the surfaces of the pair, in the order of the scene.
    pub surfaces: [String; 2],
    /// What has the error: `pressure` or `force`.
    pub of: String,
    /// Relative error.
    pub error: f64,
    /// Place of the largest part of the error of the pressures (x, y, z).
    pub place: [f64; 3],
}

/// The result on one mesh of an adaptation. Errors are relative estimates.
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
    /// Error of the sums of pressures, the largest of the pairs.
    #[serde(default)]
    pub force: f64,
    /// Error in the energy norm.
    pub energy: f64,
    /// Iterations.
    pub iterations: usize,
    /// Wall seconds, mesh generation included.
    pub seconds: f64,
}

/// The report of a body.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct BodyReport {
    /// Name.
    pub name: String,
    /// Nodes.
    pub nodes: usize,
    /// Cells.
    pub cells: usize,
    /// Facets between two cells that lie on opposite sides of it.
    pub inner_facets: usize,
    /// Facets of the boundary, which does not intersect itself.
    pub boundary_facets: usize,
    /// Order of its elements.
    pub order: usize,
    /// Degrees of freedom.
    pub dofs: usize,
    /// Inner solver in words; empty if nothing was solved.
    pub solver: String,
    /// Rank that owned the body.
    pub rank: usize,
    /// Largest von Mises stress at the nodes.
    pub max_von_mises: Option<f64>,
    /// Point of the largest von Mises stress (x, y, z).
    pub max_von_mises_at: Option<[f64; 3]>,
    /// Relative change of the stress from this point to the middles of the cells around it, the largest.
    pub max_von_mises_change: Option<f64>,
    /// Largest displacement at the nodes.
    pub max_displacement: Option<f64>,
    /// Largest and least principal stress at the nodes.
    pub principal_range: Option<[f64; 2]>,
    /// Largest principal strain in absolute value, at the centres of cells.
    pub max_strain: Option<f64>,
    /// Point of the largest strain (x, y, z).
    pub max_strain_at: Option<[f64; 3]>,
    /// Relative error of displacements against the scene's `exact` in the L2 norm.
    pub error_l2: Option<f64>,
    /// Relative error of displacements in the H1 seminorm.
    pub error_h1: Option<f64>,
    /// Relative error of displacements in the energy norm.
    pub error_energy: Option<f64>,
    /// Forces on the body.
    pub balance: BalanceReport,
}

/// A force and its moment about the origin (x, y, z), with its source.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ForceReport {
    /// Source of the force: the physical group of a support, spring or rigid surface, or `loads`, or `contacts`.
    pub on: String,
    /// The force.
    #[serde(deserialize_with = "numbers")]
    pub force: [f64; 3],
    /// The moment.
    #[serde(deserialize_with = "numbers")]
    pub moment: [f64; 3],
}

/// The forces on a body. Their sum is zero in equilibrium.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct BalanceReport {
    /// Loads, except for those on rigid surfaces.
    pub loads: ForceReport,
    /// All contacts.
    pub contacts: ForceReport,
    /// Reaction of each support, in the order of the scene.
    pub supports: Vec<ForceReport>,
    /// Force of each spring.
    pub springs: Vec<ForceReport>,
    /// Force of each rigid surface, with that of the supports of its nodes. Its moment keeps the surface from turning,
    /// or is that of the loads on a surface that turns.
    pub rigid: Vec<ForceReport>,
    /// Norm of the sum of all forces, relative to the sum of the norms of all nodal forces.
    #[serde(deserialize_with = "numbers")]
    pub force_imbalance: f64,
    /// The same ratio for moments about the origin, or about a point near the mesh if the origin is far away
    /// (docs/meshes.md).
    #[serde(deserialize_with = "numbers")]
    pub moment_imbalance: f64,
}

/// The report of a pair of surfaces. Sides are in the order of the scene.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct PairReport {
    /// Names of the surfaces.
    pub surfaces: [String; 2],
    /// Names of the bodies.
    pub bodies: [String; 2],
    /// Index of the `[[contact]]` table of the scene that defines the pair, from 0, as in the settings.
    pub contact: usize,
    /// Contact points.
    pub points: usize,
    /// Surface on whose mesh the contact points lie.
    pub carrier: String,
    /// Facets of the carrier without a partner.
    pub facets_uncovered: usize,
    /// Pieces of the carrier without common points because the search failed. A warning names their position.
    pub pieces_lost: usize,
    /// Partially covered facets of the carrier, which use plain means.
    pub facets_averaged: usize,
    /// The result at the end of the run.
    #[serde(flatten)]
    pub result: PairResult,
    /// Estimated relative errors of the pressures and of their sum, if requested.
    #[serde(flatten)]
    pub estimate: Option<PairEstimate>,
    /// File of its contact points, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table: Option<String>,
    /// File of its plot, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plot: Option<String>,
}

/// The result of a pair of surfaces at the end of a run or of a load step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PairResult {
    /// Contact points with c > 0.
    pub closed: usize,
    /// Contact force on each side (x, y, z).
    #[serde(deserialize_with = "numbers")]
    pub force: [[f64; 3]; 2],
    /// Moment of the contact force about the origin (x, y, z).
    #[serde(deserialize_with = "numbers")]
    pub moment: [[f64; 3]; 2],
    /// Approach of the bodies along the mean normal; null where normals cancel.
    pub approach: Option<f64>,
    /// Sum of the pressures times their areas, tensions of a bond counted negative. It is not the resultant of `force`
    /// where normals differ, as around a shaft.
    #[serde(deserialize_with = "numbers")]
    pub normal_force: f64,
    /// Least pressure of the points with c > 0; zero without any.
    #[serde(deserialize_with = "numbers")]
    pub least_pressure: f64,
    /// Mean pressure of the part in contact, of a bond that of the compressed part; zero without contact.
    #[serde(deserialize_with = "numbers")]
    pub mean_pressure: f64,
    /// Largest pressure; zero where a bond only pulls.
    #[serde(deserialize_with = "numbers")]
    pub peak_pressure: f64,
    /// Point of the largest pressure (x, y, z).
    #[serde(deserialize_with = "numbers")]
    pub peak_at: [f64; 3],
    /// Largest compression of the layer; negative where all of it is open.
    #[serde(deserialize_with = "numbers")]
    pub peak_compression: f64,
    /// The largest tension, if the pair is bonded.
    #[serde(flatten)]
    pub tension: Option<TensionReport>,
    /// Size of the contact, and of the part that both surfaces cover and that is open.
    #[serde(flatten)]
    pub extent: Extent,
    /// Plane problems: points where contact begins or ends, from the pressure and the opening of the contact points on
    /// both sides (docs/theory.md).
    pub contact_ends: Vec<[f64; 3]>,
    /// Initial gap d at the points: least, mean over the area, largest.
    #[serde(deserialize_with = "numbers")]
    pub gap: [f64; 3],
    /// Distance of the surfaces after deformation, -c where that is positive: mean over the area of all points, and
    /// largest.
    #[serde(deserialize_with = "numbers")]
    pub opening: [f64; 2],
    /// Energy of the layer.
    #[serde(deserialize_with = "numbers")]
    pub layer_energy: f64,
    /// The obstacle before the surface, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub obstacle: Option<ObstacleReport>,
    /// Closing of the gap (a length) that was found for the force or preload of the pair, or that a step keeps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset: Option<f64>,
    /// What its seal holds, if the scene names the ends of one.
    #[serde(flatten)]
    pub seal: Option<SealReport>,
    /// True for the shear of a bond: pressures are sizes of tractions along the surface in one direction, and
    /// compressions sizes of slips.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub shear: bool,
}

/// Estimated relative errors of a pair: of its pressures, and of the sum of the pressures times their areas.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)] // the names are those of the report
pub struct PairEstimate {
    #[serde(deserialize_with = "numbers")]
    pub pressure_estimate: f64,
    #[serde(deserialize_with = "numbers")]
    pub force_estimate: f64,
}

/// The tension of a bonded layer.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct TensionReport {
    /// Largest tension; zero where the bond is only pressed.
    #[serde(deserialize_with = "numbers")]
    pub peak_tension: f64,
    /// Point of the largest tension (x, y, z).
    #[serde(deserialize_with = "numbers")]
    pub peak_tension_at: [f64; 3],
    /// Largest stretch of the layer; zero where all of it is compressed.
    #[serde(deserialize_with = "numbers")]
    pub peak_stretch: f64,
}

/// What the weakest way along a contact surface, from one end to the other, holds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct SealReport {
    /// Largest contact pressure on the way where this is least; zero where a way is open.
    #[serde(deserialize_with = "numbers")]
    pub sealing_pressure: f64,
    /// Point with this pressure (x, y, z).
    #[serde(deserialize_with = "numbers")]
    pub sealing_at: [f64; 3],
}

/// The report of an obstacle.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ObstacleReport {
    /// How far it has moved towards the surface, along its mean normal.
    #[serde(deserialize_with = "numbers")]
    pub approach: f64,
    /// How far it has turned, in radians (x, y, z).
    #[serde(deserialize_with = "numbers")]
    pub tilt: [f64; 3],
    /// The force with which it presses along the mean normal.
    #[serde(deserialize_with = "numbers")]
    pub force: f64,
    /// The moment about `at` that it needs beside this force (x, y, z).
    #[serde(deserialize_with = "numbers")]
    pub moment: [f64; 3],
    /// The point about which it turns (x, y, z).
    #[serde(deserialize_with = "numbers")]
    pub at: [f64; 3],
}

/// The report of a load step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StepReport {
    /// Time in the history.
    pub time: f64,
    /// Factors of loads and prescribed displacements, by name.
    pub factors: BTreeMap<String, f64>,
    /// Status at the end of the step, as [`Report::status`](super::Report::status).
    pub status: RunStatus,
    /// The status in words.
    pub message: String,
    /// Updates of the iterate in this step.
    pub iterations: usize,
    /// Relative residual at the end of the step.
    pub residual: Option<f64>,
    /// Pairs in the order of the scene.
    pub pairs: Vec<PairResult>,
    /// Forces of supports, springs and rigid surfaces, body by body.
    pub reactions: Vec<ReactionReport>,
}

/// The part of the common surface of a pair that is in contact, c > 0, and the part that is open, c < 0. They are
/// lengths in the plane and areas in space; for bodies of revolution, they are areas of the whole circumference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
#[allow(missing_docs)] // the names are those of the report
pub enum Extent {
    Length { contact_length: f64, open_length: f64 },
    Area { contact_area: f64, open_area: f64 },
}

impl Default for Extent {
    fn default() -> Self {
        Self::Length { contact_length: 0.0, open_length: 0.0 }
    }
}

impl Extent {
    /// Return whether the sizes are areas.
    pub fn is_area(&self) -> bool {
        matches!(self, Self::Area { .. })
    }

    /// Return the length or area in contact.
    pub fn contact(&self) -> f64 {
        let (Self::Length { contact_length: contact, .. } | Self::Area { contact_area: contact, .. }) = self;
        *contact
    }

    /// Return the length or area that is open.
    pub fn open(&self) -> f64 {
        let (Self::Length { open_length: open, .. } | Self::Area { open_area: open, .. }) = self;
        *open
    }
}

/// The force of a support, a spring or a rigid surface on its body.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ReactionReport {
    /// Name of the body.
    pub body: String,
    /// Physical group.
    pub on: String,
    /// The force (x, y, z).
    pub force: [f64; 3],
}

impl Report {
    /// Return the results of all pairs.
    pub fn results(&self) -> impl Iterator<Item = &PairResult> {
        self.pairs.iter().map(|pair| &pair.result)
    }
}

/// Numbers of a report. JSON has null for those that are not finite.
trait Numbers {
    /// What JSON has.
    type Json: DeserializeOwned;

    /// Return the numbers, NaN for null.
    fn known(json: Self::Json) -> Self;
}

impl Numbers for f64 {
    type Json = Option<f64>;

    fn known(json: Option<f64>) -> f64 {
        json.unwrap_or(f64::NAN)
    }
}

impl<T: Numbers, const N: usize> Numbers for [T; N]
where
    [T::Json; N]: DeserializeOwned,
{
    type Json = [T::Json; N];

    fn known(json: Self::Json) -> Self {
        json.map(T::known)
    }
}

impl<T: Numbers> Numbers for Vec<T> {
    type Json = Vec<T::Json>;

    fn known(json: Self::Json) -> Self {
        json.into_iter().map(T::known).collect()
    }
}

/// Read numbers that may be null.
fn numbers<'de, D: Deserializer<'de>, T: Numbers>(json: D) -> Result<T, D::Error> {
    T::Json::deserialize(json).map(T::known)
}

/// Most bodies, pairs, load steps or warnings that the terminal lists, as many as a person looks through; the report
/// has all. Unless the scene gives a number, as many pairs have files of their own.
pub const LISTED: usize = 24;

/// Return the indices of the `most` pairs with the largest forces, in the order of the scene. Among equal forces the
/// first is preferred; a force that is not finite counts as zero.
pub fn busiest<'p>(pairs: impl Iterator<Item = &'p PairResult>, most: usize) -> Vec<usize> {
    let squared = |pair: &PairResult| pair.force[0].iter().map(|f| f * f).sum();
    let sizes: Vec<f64> = pairs.map(squared).map(|size: f64| if size.is_finite() { size } else { 0.0 }).collect();
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by(|&i, &j| sizes[j].total_cmp(&sizes[i]));
    order.truncate(most);
    order.sort_unstable();
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_keep_their_order() {
        let pair = |force: f64| PairResult { force: [[0.0, force, 0.0], [0.0; 3]], ..PairResult::default() };
        let pairs = [5.0, f64::NAN, -9.0, 5.0].map(pair);
        let busiest = |most| busiest(pairs.iter(), most);
        assert_eq!([busiest(1), busiest(2), busiest(9)], [vec![2], vec![0, 2], vec![0, 1, 2, 3]]);
    }
}
