//! Checkpoints: files with what another process, on any number of ranks, needs to go on with a run.
//!
//! The file `checkpoint` has a line that names its format, a line of JSON (the head), numbers as `postcard` writes them, and the SHA-256 of
//! all that. It is replaced as a whole, so that there is always a good one.

use crate::ddm::{InitialGuess, Row, State};
use crate::error::{Error, Kind, Result};
use crate::exchange::{Exchange, all_gather, broadcast};
use crate::file::digest;
use crate::model::{BodySlot, Distribution, Field, Local, Model};
use crate::output::{RoundReport, StepReport, write_whole};
use crate::run::stages::{Begin, Built, Done};
use crate::scene::Scene;
use crate::setting::remove;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// The name of the file in the folder of results.
pub const FILE: &str = "checkpoint";

/// The name that a checkpoint gets when a run begins in its folder without going on from it.
pub const ASIDE: &str = "checkpoint.old";

/// The first line.
const FORMAT: &str = "winkler checkpoint 5";

/// The beginning of the first line in all versions.
const ANY_FORMAT: &[u8] = b"winkler checkpoint ";

/// Number of bytes of the digest at the end, SHA-256.
const DIGEST_BYTES: usize = 32;

/// The part of a checkpoint that is written as JSON.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct CheckpointHeader {
    /// Digest of the scene's settings.
    pub settings: String,
    /// Digest of the file of the mesh, and of the bodies and contact points that were made from it.
    pub mesh: String,
    /// Reports of the meshes of an adaptation before this one.
    pub rounds: Vec<RoundReport>,
    /// Sizes that the mesh follows, if it does.
    pub sizes: Option<String>,
    /// Reports of the load steps before this one.
    pub steps: Vec<StepReport>,
    /// Whether the run ends with this mesh of an adaptation: it makes all load steps on it, or it is the best mesh once more.
    pub on_last_mesh: bool,
    /// Why the error was not reached on the last mesh, if it was not.
    pub limit: Option<String>,
}

/// A checkpoint that was read.
pub struct Checkpoint {
    path: PathBuf,
    /// The part that is JSON.
    pub head: CheckpointHeader,
    /// Rows of the history of earlier load steps.
    earlier: Vec<Row>,
    state: State,
}

impl Checkpoint {
    /// Write the state of a paused run into a folder. Collective; the rank with `writes` writes the file.
    pub fn write(folder: &Path, head: CheckpointHeader, done: &Done, writes: bool) -> Result<()> {
        let (model, Done { built, outcome, steps, earlier, .. }) = (done.model(), done);
        let states = gather(model, &outcome.iterate);
        if !writes {
            return Ok(());
        }
        let head = CheckpointHeader { mesh: mesh_digest(built), steps: steps.clone(), ..head };
        let failed = |cause: String| Error::new(Kind::File, "the checkpoint cannot be written").because(cause);
        let json = serde_json::to_string(&head).map_err(|cause| failed(cause.to_string()))?;
        let next = outcome.next_states();
        let (rows, trace) = (&outcome.rows, &outcome.iterate.trace);
        let numbers = (earlier, rows, &next.compression, &next.smoothing, trace, states);
        let mut bytes = postcard::to_extend(&numbers, format!("{FORMAT}\n{json}\n").into_bytes())
            .map_err(|cause| failed(cause.to_string()))?;
        let sum = Sha256::digest(&bytes);
        bytes.extend(&sum[..]);
        write_whole(&folder.join(FILE), |out| out.write_all(&bytes))
    }

    /// Read the checkpoint in a folder on the first rank, and broadcast it. Collective.
    ///
    /// # Errors
    /// There is none, or it is damaged, of another version, or of another scene.
    pub fn read(exchange: &dyn Exchange, folder: &Path, scene: &Scene) -> Result<Self> {
        let path = folder.join(FILE);
        let bytes = broadcast(exchange, || {
            crate::file::read(&path).map_err(|error| {
                error.help("name the folder of results of a run that was interrupted, or had `--checkpoint`")
            })
        })?;
        let checkpoint = parse(&path, &bytes).ok_or_else(|| {
            let path = path.display();
            let wrong = match bytes.starts_with(ANY_FORMAT) && !bytes.starts_with(format!("{FORMAT}\n").as_bytes()) {
                true => format!("{path} was written by another version of winkler"),
                false => format!("{path} is damaged, or no checkpoint"),
            };
            Error::new(Kind::File, wrong).help("begin anew, without `--restart`")
        })?;
        match checkpoint.head.settings == settings_digest(scene) {
            true => Ok(checkpoint),
            false => Err(checkpoint.refuse_other("scene")),
        }
    }

    /// Return the state from which a problem goes on, restricted to the bodies of this rank.
    pub fn resume(self, built: &Built) -> Result<Begin> {
        // only the first rank has read the mesh
        if built.mesh.is_some() && self.head.mesh != mesh_digest(built) {
            return Err(self.refuse_other("mesh"));
        }
        let discrete = &built.discrete;
        let Self { head, earlier, mut state, .. } = self;
        for (state, slot) in state.field.states.iter_mut().zip(&discrete.model.bodies) {
            if matches!(slot.local, Local::Elsewhere) {
                state.clear();
            }
            // a state of another length is that of another solver, for which the traces are used
            let fits = |whole: &&Distribution| state.len() == whole.dofs + whole.products.nrows();
            if let Some(distribution) = slot.distribution().filter(fits) {
                *state = distribution.scatter(state);
            }
        }
        Ok(Begin { start: Some(InitialGuess::Continue(Box::new(state))), steps: head.steps, earlier })
    }

    /// Return the refusal of a checkpoint that is of another scene or mesh.
    fn refuse_other(&self, what: &str) -> Error {
        Error::new(Kind::Scene, format!("{} is of another {what}", self.path.display())).help(
            "a run goes on with the scene and the overrides that it began with; only `title`, `units`, `[output]` and \
                   `method.stop` may change. Or begin anew, without `--restart`",
        )
    }
}

/// Return the states of all bodies on all ranks. One message, and one more for each body that is distributed over ranks.
fn gather(model: &Model, field: &Field) -> Vec<Vec<f64>> {
    let states: Vec<Vec<f64>> =
        model.bodies.iter().zip(&field.states).map(|(slot, state)| whole_state(slot, state)).collect();
    // a rank has an empty state of each body that it does not own
    let fill = |mut all: Vec<Vec<f64>>, other: Vec<Vec<f64>>| {
        all.iter_mut().zip(other).filter(|(own, _)| own.is_empty()).for_each(|(own, other)| *own = other);
        all
    };
    all_gather(&*model.exchange, states).into_iter().reduce(fill).unwrap_or_default()
}

/// Return the state of a body with all of its dofs on the rank that owns the body; on other ranks it is empty.
fn whole_state(slot: &BodySlot, state: &[f64]) -> Vec<f64> {
    let Some(distribution) = slot.distribution() else { return state.to_vec() };
    let (own, rigid) = state.split_at(distribution.own.len());
    let all = distribution.gather(own, rigid);
    if distribution.leads { all } else { Vec::new() }
}

/// Return the checkpoint in the bytes of a file; none if they are damaged or of another version.
fn parse(path: &Path, bytes: &[u8]) -> Option<Checkpoint> {
    let (text, digest) = bytes.split_at_checked(bytes.len().checked_sub(DIGEST_BYTES)?)?;
    let mut lines = text.splitn(3, |&byte| byte == b'\n');
    let is_ours = lines.next()? == FORMAT.as_bytes() && Sha256::digest(text)[..] == *digest;
    let head: CheckpointHeader = serde_json::from_slice(lines.next()?).ok().filter(|_| is_ours)?;
    let (earlier, rows, compression, smoothing, trace, states) = postcard::from_bytes(lines.next()?).ok()?;
    let state = State { field: Field { states, trace }, compression, smoothing, rows, memory: None };
    Some(Checkpoint { path: path.to_owned(), head, earlier, state })
}

/// Return a digest of the settings of a scene that change the problem or the method. Paths of files, limits of Gmsh, output and stopping rules
/// are not among them.
pub fn settings_digest(scene: &Scene) -> String {
    let mut problem = scene.problem();
    problem["method"]["stop"] = Value::Null;
    remove(&mut problem, "/mesh", &["timeout"]);
    digest(&problem.to_string())
}

/// Return a digest of the file of the mesh, of the sizes of the bodies and of all contact points, on the rank that has read the mesh.
///
/// The file counts because nodes, cells and groups may differ where their numbers are the same.
fn mesh_digest(Built { mesh, discrete, .. }: &Built) -> String {
    let bodies = discrete.bodies.iter().map(|body| (&body.name, body.nodes, body.cells, body.dofs));
    let pairs = discrete.model.pairs.iter().map(|pair| (&pair.position, &pair.weight, &pair.gap));
    digest(&(mesh, bodies.collect::<Vec<_>>(), pairs.collect::<Vec<_>>()))
}
