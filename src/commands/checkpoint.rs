//! The state of a run in a file: what another process, on any number of ranks, needs to go on.
//!
//! The file `checkpoint` has a line that names its format, a line of JSON, numbers as `postcard` writes them, and the SHA-256 of all that.
//! It is replaced as a whole, so that there is always a good one.

use crate::ddm::{Row, Start, State};
use crate::error::{Error, Kind, Result};
use crate::exchange::{Exchange, share, tell};
use crate::file::digest;
use crate::model::{BodySlot, Distribution, Field, Model};
use crate::output::{RoundReport, StepReport, write_whole};
use crate::run::stages::{Begin, Built, Done};
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// Name of the file in the folder of results.
pub const FILE: &str = "checkpoint";

/// Name under which the next run that does not go on from it leaves it.
pub const ASIDE: &str = "checkpoint.old";

const FORMAT: &str = "winkler checkpoint 5";

/// How the first line of all versions begins.
const KIND: &[u8] = b"winkler checkpoint ";

/// Bytes of the digest at the end.
const DIGEST: usize = 32;

/// What is known besides the numbers.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Head {
    /// Digest of the scene's settings.
    pub settings: String,
    /// Digest of the file of its mesh, and of what bodies and contact points were made of it.
    pub mesh: String,
    /// Meshes of an adaptation before this one.
    pub rounds: Vec<RoundReport>,
    /// Sizes that the mesh follows, if it does.
    pub sizes: Option<String>,
    /// Load steps before this one.
    pub steps: Vec<StepReport>,
    /// Whether these are all load steps on the last mesh of an adaptation, not the largest one alone.
    pub on_last_mesh: bool,
    /// Why the error was not reached on that mesh, if it was not.
    pub limit: Option<String>,
}

/// A state that was read.
pub struct Checkpoint {
    /// The file.
    path: PathBuf,
    /// What is known besides.
    pub head: Head,
    earlier: Vec<Row>,
    state: State,
}

impl Checkpoint {
    /// Writes the state of a run that has paused into a folder; collective, one rank writes.
    ///
    /// # Errors
    /// The file cannot be written, on the rank that writes it.
    pub fn write(folder: &Path, head: Head, done: &Done, writes: bool) -> Result<()> {
        let (model, Done { built, outcome, steps, earlier, .. }) = (done.model(), done);
        let states = gather(model, &outcome.iterate);
        if !writes {
            return Ok(());
        }
        let head = Head { mesh: mesh_digest(built), steps: steps.clone(), ..head };
        let failed = |cause: String| Error::new(Kind::File, "the checkpoint cannot be written").because(cause);
        let json = serde_json::to_string(&head).map_err(|cause| failed(cause.to_string()))?;
        let next = outcome.next_states();
        let layer = (&next.compression, &next.smoothing);
        let numbers = (earlier, &outcome.rows, layer, &outcome.iterate.trace, states);
        let mut bytes = postcard::to_extend(&numbers, format!("{FORMAT}\n{json}\n").into_bytes())
            .map_err(|cause| failed(cause.to_string()))?;
        let sum = Sha256::digest(&bytes);
        bytes.extend(&sum[..]);
        write_whole(&folder.join(FILE), |out| out.write_all(&bytes))
    }

    /// Read the checkpoint in a folder, on the first rank, for all. Collective.
    ///
    /// # Errors
    /// There is none, it is damaged, of another version, or of another scene.
    pub fn read(exchange: &dyn Exchange, folder: &Path, scene: &Scene) -> Result<Self> {
        let path = folder.join(FILE);
        let bytes = tell(exchange, || {
            crate::file::read(&path).map_err(|error| {
                error.help("name the folder of results of a run that was interrupted, or had `--checkpoint`")
            })
        })?;
        let checkpoint = parse(&path, &bytes).ok_or_else(|| {
            let path = path.display();
            let wrong = match bytes.starts_with(KIND) && !bytes.starts_with(format!("{FORMAT}\n").as_bytes()) {
                true => format!("{path} was written by another version of winkler"),
                false => format!("{path} is damaged, or no checkpoint"),
            };
            Error::new(Kind::File, wrong).help("begin anew, without `--restart`")
        })?;
        match checkpoint.head.settings == settings_digest(scene) {
            true => Ok(checkpoint),
            false => Err(checkpoint.other("scene")),
        }
    }

    /// Where a problem goes on; it has the rank's own bodies.
    ///
    /// # Errors
    /// It has another mesh.
    pub fn resume(self, built: &Built) -> Result<Begin> {
        // the first rank has read the mesh
        if built.mesh.is_some() && self.head.mesh != mesh_digest(built) {
            return Err(self.other("mesh"));
        }
        let discrete = &built.discrete;
        let Self { head, earlier, mut state, .. } = self;
        for (state, slot) in state.field.states.iter_mut().zip(&discrete.model.bodies) {
            match &slot.local {
                None => state.clear(),
                Some(body) => {
                    // of a body that another solver worked with the traces count
                    let fits = |whole: &&Distribution| state.len() == whole.dofs + body.rigid();
                    if let Some(distribution) = body.distribution().filter(fits) {
                        *state = distribution.scatter(state);
                    }
                }
            }
        }
        Ok(Begin { start: Some(Start::Continue(Box::new(state))), steps: head.steps, earlier })
    }

    fn other(&self, what: &str) -> Error {
        Error::new(Kind::Scene, format!("{} is of another {what}", self.path.display())).help(
            "a run goes on with the scene and the overrides that it began with; only `title`, `units`, `[output]` and \
                   `method.stop` may change. Or begin anew, without `--restart`",
        )
    }
}

/// States of all bodies; one message, and one for each body that is dealt out.
fn gather(model: &Model, field: &Field) -> Vec<Vec<f64>> {
    let whole = |(slot, state): (&BodySlot, &Vec<f64>)| {
        let Some((body, distribution)) = slot.local.as_ref().and_then(|body| Some((body, body.distribution()?))) else {
            return state.clone();
        };
        let (own, rigid) = state.split_at(state.len() - body.rigid());
        let all = distribution.gather(own, rigid);
        if body.leads() { all } else { Vec::new() }
    };
    let states: Vec<Vec<f64>> = model.bodies.iter().zip(&field.states).map(whole).collect();
    // empty where the body lives elsewhere
    let fill = |mut all: Vec<Vec<f64>>, other: Vec<Vec<f64>>| {
        all.iter_mut().zip(other).filter(|(own, _)| own.is_empty()).for_each(|(own, other)| *own = other);
        all
    };
    share(&*model.exchange, states).into_iter().reduce(fill).unwrap_or_default()
}

fn parse(path: &Path, bytes: &[u8]) -> Option<Checkpoint> {
    let (text, digest) = bytes.split_at_checked(bytes.len().checked_sub(DIGEST)?)?;
    let mut lines = text.splitn(3, |&byte| byte == b'\n');
    let is_ours = lines.next()? == FORMAT.as_bytes() && Sha256::digest(text)[..] == *digest;
    let head: Head = serde_json::from_slice(lines.next()?).ok().filter(|_| is_ours)?;
    let (earlier, rows, (compression, smoothing), trace, states) = postcard::from_bytes(lines.next()?).ok()?;
    let state = State { field: Field { states, trace }, compression, smoothing, rows, memory: None };
    Some(Checkpoint { path: path.to_owned(), head, earlier, state })
}

/// Digest of what a scene asks for, without what changes neither problem nor method: where its files are, what Gmsh may take, what is written,
/// when it ends.
pub fn settings_digest(scene: &Scene) -> String {
    let mut problem = scene.problem();
    problem["method"]["stop"] = Value::Null;
    if let Some(mesh) = problem["mesh"].as_object_mut() {
        ["timeout", "memory"].iter().for_each(|key| drop(mesh.remove(*key)));
    }
    digest(&problem.to_string())
}

/// Digest of the file of the mesh, whose nodes, cells and groups may be others where the counts are the same, of the bodies' sizes and of
/// all contact points; on the rank that has read the mesh.
fn mesh_digest(Built { mesh, discrete, .. }: &Built) -> String {
    let bodies = discrete.bodies.iter().map(|body| (&body.name, body.nodes, body.cells, body.dofs));
    let pairs = discrete.model.pairs.iter().map(|pair| (&pair.position, &pair.weight, &pair.gap));
    digest(&(mesh, bodies.collect::<Vec<_>>(), pairs.collect::<Vec<_>>()))
}
