//! What several commands take from the command line.

use crate::output::Verbosity;
use clap::Args;
use std::path::PathBuf;

/// How much a command says.
#[derive(Args)]
pub struct Manner {
    /// Print errors, warnings and the folder of the results only
    #[arg(short, long, conflicts_with_all = ["verbose", "json"])]
    quiet: bool,
    /// Print what is decided and why, with the PETSc options of each body, on standard error
    #[arg(short, long)]
    verbose: bool,
}

impl Manner {
    /// The same in one word.
    pub fn verbosity(&self) -> Verbosity {
        match (self.quiet, self.verbose) {
            (true, _) => Verbosity::Quiet,
            (_, true) => Verbosity::Verbose,
            _ => Verbosity::Usual,
        }
    }
}

/// A scene, and what is to hold instead of its own words.
#[derive(Args)]
pub struct SceneArgs {
    /// Scene file (TOML)
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Replace a key of the scene, for example method.gamma=0.3 or contact.0.layer.power.a=0.3; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    /// Method: auto, robin, ncg, anderson, newton-robin or newton (short for --set method.name=NAME)
    #[arg(long, value_name = "NAME")]
    method: Option<String>,
    /// Estimate the error of the discretisation (short for --set estimate=true)
    #[arg(long)]
    estimate: bool,
    /// Adapt the mesh until the estimated error of pressures and displacements is at most this (short for --set adapt.error=E)
    #[arg(long, value_name = "E", allow_hyphen_values = true)]
    tolerance: Option<String>,
    /// Run the mesh's .geo script even if it can start programs or write files
    #[arg(long)]
    trust_geo: bool,
    /// Print the report as JSON
    #[arg(long)]
    pub json: bool,
}

impl SceneArgs {
    /// All overrides, those with names of their own last.
    pub fn overrides(&self) -> Vec<String> {
        let method = self.method.iter().map(|name| format!("--method {name}"));
        let tolerance = self.tolerance.iter().map(|error| format!("--tolerance {error}"));
        let flags = flags([(self.estimate, "--estimate"), (self.trust_geo, "--trust-geo")]);
        self.overrides.iter().cloned().chain(method).chain(tolerance).chain(flags).collect()
    }
}

/// The flags that were typed.
pub(super) fn flags<const N: usize>(all: [(bool, &str); N]) -> impl Iterator<Item = String> {
    all.into_iter().filter(|(given, _)| *given).map(|(_, flag)| flag.to_owned())
}
