//! Checkpoints: files with the states from which another process, on any number of ranks, goes on with a run.
//!
//! The file `checkpoint` has a line that names its format, a line of JSON (the head), numbers as `postcard` writes
//! them, and the SHA-256 of all that. It is replaced as a whole, so that there is always a good one. The states are
//! compressions of the layers and traces of the bodies, in the units of the scene: Newton's method starts from the
//! former, sweeps from the latter.

use super::shortfall::Shortfall;
use crate::ddm::{InitialGuess, Solution, Status};
use crate::error::{Error, Kind, Result};
use crate::exchange::{Exchange, broadcast};
use crate::file::digest;
use crate::model::DisplacementField;
use crate::output::{RoundReport, StepReport, UnmetReport, write_whole};
use crate::problem::mesh::AdaptedMesh;
use crate::run::stages::{Begin, Built, Done};
use crate::scene::Scene;
use crate::scene::remove;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// The name of the file in the folder of results.
pub const FILE: &str = "checkpoint";

/// The name that a checkpoint gets when a run begins in its folder without going on from it.
pub const ASIDE: &str = "checkpoint.old";

/// The first line.
const FORMAT: &str = "winkler checkpoint 9";

/// The beginning of the first line in all versions.
const ANY_FORMAT: &[u8] = b"winkler checkpoint ";

/// Number of bytes of the digest at the end, SHA-256.
const DIGEST_BYTES: usize = 32;

/// The part of a checkpoint that is written as JSON.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct CheckpointHeader {
    /// Digest of the scene and the mesh: see [`problem_digest`].
    pub problem: String,
    /// Reports of the meshes of an adaptation before this one.
    pub rounds: Vec<RoundReport>,
    /// What the adaptation asked of the mesh, if there is one.
    pub adapted: Option<AdaptedMesh>,
    /// Reports of the load steps that have ended.
    pub steps: Vec<StepReport>,
    /// Whether the run ends with this mesh of an adaptation: it makes all load steps on it, or it is the best mesh once
    /// more.
    pub on_last_mesh: bool,
    /// Why the error was not reached on the last mesh, if it was not.
    pub shortfall: Option<Shortfall>,
    /// The errors of pairs that were not reached.
    pub unmet: Vec<UnmetReport>,
}

/// A checkpoint that was read.
pub struct Checkpoint {
    path: PathBuf,
    /// The part that is JSON.
    pub head: CheckpointHeader,
    /// Traces of the bodies, 2n.
    trace: Vec<f64>,
    /// Compressions of the layers' states, n.
    compression: Vec<f64>,
    /// Largest compressions so far, n; empty if no layer remembers.
    largest: Vec<f64>,
}

impl Checkpoint {
    /// Write the states of a run into a folder, on the first rank.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(folder: &Path, head: CheckpointHeader, scene: &Scene, done: &Done) -> Result<()> {
        let mut steps = done.steps.clone();
        if matches!(done.outcome.status, Status::Interrupted { .. }) {
            // a step that a signal ended is made again
            steps.pop();
        }
        let head = CheckpointHeader { problem: problem_digest(scene, &done.built), steps, ..head };
        let failed = |cause: String| Error::new(Kind::File, "the checkpoint cannot be written").because(cause);
        let json = serde_json::to_string(&head).map_err(|cause| failed(cause.to_string()))?;
        let numbers = (&done.outcome.iterate.trace, &done.outcome.layer.compression, &done.largest);
        let mut bytes = postcard::to_extend(&numbers, format!("{FORMAT}\n{json}\n").into_bytes())
            .map_err(|cause| failed(cause.to_string()))?;
        let sum = Sha256::digest(&bytes);
        bytes.extend(&sum[..]);
        write_whole(&folder.join(FILE), |out| out.write_all(&bytes))
    }

    /// Read the checkpoint in a folder on the first rank, and broadcast it. Collective.
    ///
    /// # Errors
    /// There is none, or it is damaged or of another version.
    pub fn read(exchange: &dyn Exchange, folder: &Path) -> Result<Self> {
        let path = folder.join(FILE);
        let bytes = broadcast(exchange, || {
            crate::file::read(&path).map_err(|error| {
                error.help(
                    "name the folder of results of a run that a signal ended, or that ended within its load steps",
                )
            })
        })?;
        parse(&path, &bytes).ok_or_else(|| {
            let path = path.display();
            let wrong = match bytes.starts_with(ANY_FORMAT) && !bytes.starts_with(format!("{FORMAT}\n").as_bytes()) {
                true => format!("{path} was written by another version of winkler"),
                false => format!("{path} is damaged, or no checkpoint"),
            };
            Error::new(Kind::File, wrong).help("begin anew, without `--restart`")
        })
    }

    /// Return where a problem of this scene goes on.
    ///
    /// # Errors
    /// The checkpoint is of another problem.
    pub fn resume(self, scene: &Scene, built: &Built) -> Result<Begin> {
        // only the first rank has read the mesh
        if built.file.is_some() && self.head.problem != problem_digest(scene, built) {
            let message = format!("{} is of another scene or mesh", self.path.display());
            let help = "a run goes on with the scene and the overrides that it began with; only `title`, `units`, `[output]`, `[solver]` and \
                        `[method]` without its `steps` may change. Or begin anew, without `--restart`";
            return Err(Error::new(Kind::Scene, message).help(help));
        }
        let Self { head, trace, compression, largest, .. } = self;
        let solution = Solution { field: DisplacementField { trace, ..DisplacementField::default() }, compression };
        Ok(Begin { start: Some(InitialGuess::Known(Box::new(solution))), steps: head.steps, largest })
    }
}

/// Return the checkpoint in the bytes of a file; none if they are damaged or of another version.
fn parse(path: &Path, bytes: &[u8]) -> Option<Checkpoint> {
    let (text, digest) = bytes.split_at_checked(bytes.len().checked_sub(DIGEST_BYTES)?)?;
    let mut lines = text.splitn(3, |&byte| byte == b'\n');
    let is_ours = lines.next()? == FORMAT.as_bytes() && Sha256::digest(text)[..] == *digest;
    let head: CheckpointHeader = serde_json::from_slice(lines.next()?).ok().filter(|_| is_ours)?;
    let (trace, compression, largest) = postcard::from_bytes(lines.next()?).ok()?;
    Some(Checkpoint { path: path.to_owned(), head, trace, compression, largest })
}

/// Return a digest of a scene without output, solvers and method (but for its load steps), of the file of the mesh, and
/// of the bodies and contact points made from it, on the rank that has read the mesh. The file counts because nodes,
/// cells and groups may differ where their numbers are the same.
fn problem_digest(scene: &Scene, Built { file, discrete, .. }: &Built) -> String {
    let mut problem = scene.problem();
    problem["method"] = problem["method"]["steps"].take();
    remove(&mut problem, "", &["solver", "estimate"]);
    remove(&mut problem, "/mesh", &["timeout", "threads"]);
    let bodies = discrete.bodies.iter().map(|body| (&body.name, body.nodes, body.cells, body.dofs));
    // gaps follow from these and the scene, and may change from step to step
    let pairs = discrete.model.pairs.iter().map(|pair| (&pair.position, &pair.area));
    let mesh = file.as_ref().map(|mesh| &mesh.digest);
    digest(&(problem.to_string(), mesh, bodies.collect::<Vec<_>>(), pairs.collect::<Vec<_>>()))
}
