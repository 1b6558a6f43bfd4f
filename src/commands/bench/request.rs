//! The command line of `winkler bench`.

use crate::error::{Error, Kind};
use std::path::PathBuf;

/// The command line of `winkler bench`.
#[derive(clap::Args)]
pub struct Request {
    /// Scene files (TOML)
    #[arg(value_name = "SCENE", required = true)]
    pub scenes: Vec<PathBuf>,
    /// Folder for the results [default: bench in that of solve]
    #[arg(short = 'o', value_name = "DIR")]
    pub folder: Option<PathBuf>,
    /// Key and its values, for example mesh.set.n=16,32,64; may be repeated
    #[arg(long, value_name = "KEY=V1,V2,...")]
    pub over: Vec<String>,
    /// Inner solvers: mumps,hypre,... or one string of PETSc options; may be repeated [default: all presets]
    #[arg(long = "solver", value_name = "LIST|OPTIONS", allow_hyphen_values = true)]
    pub solvers: Vec<String>,
    /// Methods [default: the scene's]
    #[arg(long = "method", value_name = "LIST", value_delimiter = ',')]
    pub methods: Vec<String>,
    /// Element orders of all bodies [default: the scene's]
    #[arg(long = "order", value_name = "LIST", value_delimiter = ',')]
    pub orders: Vec<usize>,
    /// Numbers of MPI ranks
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "1")]
    pub ranks: Vec<usize>,
    /// Runs of each combination; times are their medians
    #[arg(long, value_name = "N", default_value = "1")]
    pub repeat: usize,
    /// Contact table, or folder of results, that errors are measured against
    #[arg(long, value_name = "PATH")]
    pub against: Option<PathBuf>,
    /// Seconds after which a run is ended
    #[arg(long, value_name = "S", default_value = "3600", allow_negative_numbers = true)]
    pub timeout: f64,
    /// Seconds after which no further run begins
    #[arg(long, value_name = "S", default_value = "inf", allow_negative_numbers = true)]
    pub budget: f64,
    /// Also measure one linear factor-and-solve of the same bodies
    #[arg(long)]
    pub linear: bool,
    /// Keep the rows that the folder has already
    #[arg(long)]
    pub resume: bool,
    /// Replace a key of the scene in all runs; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,
    /// Run the meshes' .geo scripts even if they can start programs or write files
    #[arg(long)]
    pub trust_geo: bool,
    /// Print errors, warnings and the folder of the results only
    #[arg(short, long)]
    pub quiet: bool,
    /// PETSc options for every run.
    #[arg(skip)]
    pub petsc: Vec<String>,
}

impl Request {
    /// Return the overrides of the scenes for every run.
    pub(super) fn all_overrides(&self) -> Vec<String> {
        let trust = self.trust_geo.then(|| "trust_geo=true".to_owned());
        self.overrides.iter().cloned().chain(trust).collect()
    }
}

/// Return a refusal of the command line.
pub(super) fn usage(message: impl Into<String>) -> Error {
    Error::new(Kind::Usage, message)
}
