//! The state of a run in a file: what another process, on any number of ranks, needs to go on.
//!
//! The file `checkpoint` has a line that names its format, a line of JSON, numbers (little-endian f64), and the SHA-256 of all that.
//! It is replaced as a whole, so that there is always a good one.

use crate::ddm::{Row, Start, State};
use crate::discretize::Discrete;
use crate::error::{Error, Kind, Result};
use crate::model::{BodySlot, Distribution, Field, Model};
use crate::output::{RoundReport, StepReport, write_whole};
use crate::run::stages::{Begin, Done};
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// Name of the file in the folder of results.
pub const FILE: &str = "checkpoint";

const FORMAT: &str = "winkler checkpoint 2";

/// Bytes of the digest at the end.
const DIGEST: usize = 32;

/// What is known besides the numbers.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Head {
    /// Digest of the scene's settings.
    pub settings: String,
    /// Digest of its mesh, as far as bodies and contact points tell it.
    pub mesh: String,
    /// Meshes of an adaptation before this one.
    pub rounds: Vec<RoundReport>,
    /// Sizes that the mesh follows, if it does.
    pub sizes: Option<String>,
    /// Load steps before this one.
    pub steps: Vec<StepReport>,
    /// Rows of these steps, and of this one.
    pub rows: [usize; 2],
    /// Contact points.
    pub points: usize,
    /// Length of the state of each body.
    pub states: Vec<usize>,
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
        let (states, all) = gather(model, &outcome.iterate);
        if !writes {
            return Ok(());
        }
        let rows = [earlier.len(), outcome.rows.len()];
        let (mesh, steps) = (mesh_digest(&built.discrete), steps.clone());
        let head = Head { mesh, steps, rows, points: model.points(), states, ..head };
        let json = serde_json::to_string(&head).map_err(|cause| {
            Error::new(Kind::File, "the checkpoint cannot be written as JSON").because(cause.to_string())
        })?;
        let mut bytes = format!("{FORMAT}\n{json}\n").into_bytes();
        let numbers = earlier.iter().chain(&outcome.rows).flat_map(to_numbers);
        let numbers =
            numbers.chain(outcome.layer.compression.iter().chain(&outcome.iterate.trace).chain(&all).copied());
        numbers.for_each(|number| bytes.extend(number.to_le_bytes()));
        let digest = Sha256::digest(&bytes);
        bytes.extend(&digest[..]);
        write_whole(&folder.join(FILE), |out| out.write_all(&bytes))
    }

    /// Reads the checkpoint in a folder.
    ///
    /// # Errors
    /// There is none, it is damaged, or of another scene.
    pub fn read(folder: &Path, scene: &Scene) -> Result<Self> {
        let path = folder.join(FILE);
        let bytes = crate::file::read(&path).map_err(|error| {
            error.help("name the folder of results of a run that was interrupted, or had `--checkpoint`")
        })?;
        let checkpoint = parse(&path, &bytes).ok_or_else(|| {
            Error::new(Kind::File, format!("{} is damaged, or no checkpoint of this version", path.display()))
                .help("begin anew, without `--restart`")
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
    pub fn resume(self, discrete: &Discrete) -> Result<Begin> {
        if self.head.mesh != mesh_digest(discrete) {
            return Err(self.other("mesh"));
        }
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

/// States of all bodies one after another, and their lengths; two messages, and one for each body that is dealt out.
fn gather(model: &Model, field: &Field) -> (Vec<usize>, Vec<f64>) {
    let whole = |(slot, state): (&BodySlot, &Vec<f64>)| {
        let Some((body, distribution)) = slot.local.as_ref().and_then(|body| Some((body, body.distribution()?))) else {
            return state.clone();
        };
        let (own, rigid) = state.split_at(state.len() - body.rigid());
        let all = distribution.gather(own, rigid);
        if body.leads() { all } else { Vec::new() }
    };
    let states: Vec<Vec<f64>> = model.bodies.iter().zip(&field.states).map(whole).collect();
    let mut lengths: Vec<f64> = states.iter().map(|state| state.len() as f64).collect();
    model.exchange.sum(&mut lengths);
    let mut all = vec![0.0; lengths.iter().sum::<f64>() as usize];
    let mut rest = &mut all[..];
    for (state, length) in states.iter().zip(&lengths) {
        let (own, others) = rest.split_at_mut(*length as usize);
        // empty where the body lives elsewhere
        own.iter_mut().zip(state).for_each(|(place, number)| *place = *number);
        rest = others;
    }
    model.exchange.sum(&mut all);
    (lengths.into_iter().map(|length| length as usize).collect(), all)
}

fn parse(path: &Path, bytes: &[u8]) -> Option<Checkpoint> {
    let (text, digest) = bytes.split_at_checked(bytes.len().checked_sub(DIGEST)?)?;
    let mut lines = text.splitn(3, |&byte| byte == b'\n');
    let is_ours = lines.next()? == FORMAT.as_bytes() && Sha256::digest(text)[..] == *digest;
    let head: Head = serde_json::from_slice(lines.next()?).ok().filter(|_| is_ours)?;
    let bodies = head.states.len();
    let (numbers, odd) = lines.next()?.as_chunks::<8>();
    let mut numbers = numbers.iter().map(|bytes| f64::from_le_bytes(*bytes));
    let mut take = |count: usize| numbers.by_ref().take(count).collect::<Vec<f64>>();
    let mut rows = |count: usize| (0..count).map(|_| from_numbers(&take(ROW + bodies))).collect::<Option<Vec<Row>>>();
    let (earlier, rows) = (rows(head.rows[0])?, rows(head.rows[1])?);
    let (compression, trace) = (take(head.points), take(2 * head.points));
    let states = head.states.iter().map(|&length| take(length)).collect();
    let is_whole = odd.is_empty() && numbers.next().is_none();
    let state = State { field: Field { states, trace }, compression, rows, memory: None };
    is_whole.then(|| Checkpoint { path: path.to_owned(), head, earlier, state })
}

/// Numbers of a row before those of its bodies.
const ROW: usize = 14;

fn to_numbers(row: &Row) -> Vec<f64> {
    let counts =
        [row.step, row.iteration, row.closed, row.points, row.sweeps, row.factorizations, row.inner_iterations];
    let mut numbers: Vec<f64> = counts.iter().map(|&count| count as f64).collect();
    numbers.push(f64::from(row.is_bound));
    numbers.extend([row.residual, row.increment, row.error, row.gamma, row.energy, row.seconds]);
    numbers.extend(&row.increments);
    numbers
}

fn from_numbers(numbers: &[f64]) -> Option<Row> {
    let (counts, rest) = numbers.split_first_chunk::<8>()?;
    let [step, iteration, closed, points, sweeps, factorizations, inner_iterations, bound] =
        counts.map(|count| count as usize);
    let (&[residual, increment, error, gamma, energy, seconds], increments) = rest.split_first_chunk::<6>()?;
    let (is_bound, increments) = (bound == 1, increments.to_vec());
    Some(Row {
        step,
        iteration,
        residual,
        increment,
        error,
        is_bound,
        increments,
        gamma,
        energy,
        closed,
        points,
        sweeps,
        factorizations,
        inner_iterations,
        seconds,
    })
}

/// Digest of what a scene asks for, without what changes neither problem nor method: where its files are, what Gmsh may take, what is written,
/// when it ends.
pub fn settings_digest(scene: &Scene) -> String {
    let mut settings = scene.settings();
    ["scene", "title", "units", "output"].iter().for_each(|key| settings[*key] = Value::Null);
    settings["method"]["stop"] = Value::Null;
    if let Some(steps) = settings["method"].get_mut("steps").and_then(Value::as_object_mut) {
        steps.remove("table");
    }
    if let Some(mesh) = settings["mesh"].as_object_mut() {
        ["geo", "msh", "timeout", "memory"].iter().for_each(|key| drop(mesh.remove(*key)));
    }
    // of data the contents count, wherever they are
    for (_, data) in settings["data"].as_object_mut().into_iter().flatten() {
        data["file"] = Value::Null;
    }
    let mut digest = Sha256::new().chain_update(settings.to_string());
    scene.data.values().flat_map(|data| data.numbers()).for_each(|number| digest.update(number.to_le_bytes()));
    hex(digest)
}

/// Digest of the bodies' sizes and of all contact points.
fn mesh_digest(discrete: &Discrete) -> String {
    let mut digest = Sha256::new();
    for body in &discrete.bodies {
        digest.update(&body.name);
        [body.nodes, body.cells, body.dofs].iter().for_each(|count| digest.update(count.to_le_bytes()));
    }
    for pair in &discrete.model.pairs {
        let numbers = pair.position.as_flattened().iter().chain(&pair.weight).chain(&pair.gap);
        numbers.for_each(|number| digest.update(number.to_le_bytes()));
    }
    hex(digest)
}

fn hex(digest: Sha256) -> String {
    digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}
