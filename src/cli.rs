//! The command line: arguments -> request -> command -> exit code.

use crate::commands::{bench, check, mesh, new, solve, sweep};
use crate::error::{Error, Kind, Result};
use crate::file;
use crate::interrupt::Interrupt;
use crate::output::say;
use crate::petsc::Session;
use crate::scene::gone;
use crate::solver::options;
use clap::error::ContextKind;
use clap::{CommandFactory, Parser, Subcommand};
use clap_complete::Shell;
use std::ffi::OsString;
use std::io::{ErrorKind, IsTerminal};
use std::path::{Path, PathBuf};

/// Frictionless contact of elastic bodies through nonlinear Winkler layers, by Newton's method or Robin-Robin domain
/// decomposition on PETSc.
///
/// PETSc options are typed as in every PETSc program, for all bodies (-ksp_type cg -pc_type hypre) or for one
/// (-upper_ksp_type cg); -help lists them.
#[derive(Parser)]
#[command(name = "winkler", version, after_help = after_help())]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXIT_CODES: &str = "Exit codes: 0 converged, 1 not converged (results are written), 2 command line, 3 scene, 4 mesh, \
5 solver or PETSc option, 6 file system, 130, 143 or 129 ended by SIGINT, SIGTERM or SIGHUP (results are written).";

/// Return the end of the program's help: exit codes, and where the examples are.
fn after_help() -> String {
    let examples =
        crate::scene::examples().map_or(String::new(), |folder| format!("\n\nExamples: {}", folder.display()));
    EXIT_CODES.to_owned() + &examples
}

const SOLVE: &str = "PETSc options follow the scene, with one dash: for all bodies (-ksp_type cg -pc_type hypre), for the body `upper` \
(-upper_ksp_type cg), or for the matrix of all bodies in Newton's method (-newton_pc_type hypre). -help lists them; with -v the run \
says which options each body has.

Examples:
  winkler solve scene.toml -o results/first
  winkler solve scene.toml --vtu --report --set mesh.set.n=64
  winkler solve scene.toml --method robin --set method.gamma=line-search -v
  winkler solve scene.toml -ksp_type cg -pc_type gamg -ksp_converged_reason
  mpiexec -n 2 winkler solve scene.toml -q";

const CHECK: &str = "Examples:
  winkler check scene.toml
  winkler check scene.toml --set mesh.set.n=64 --json";

const SWEEP: &str = "Examples:
  winkler sweep scene.toml --over method.gamma=0.3,0.6,0.9
  winkler sweep scene.toml --over contact.0.layer.power.a=0.5,1 --over mesh.set.n=16,32 -o results/sweep";

const BENCH: &str = "Examples:
  winkler bench scene.toml --over mesh.set.n=16,32,64 --solver mumps,hypre
  winkler bench scene.toml --solver \"-ksp_type cg -pc_type icc\" --order 1,2 --repeat 3
  winkler bench a.toml b.toml --method newton,robin --ranks 1,2 --timeout 600";

#[derive(Subcommand)]
enum Command {
    #[command(flatten)]
    Solving(Solving),
    /// Compare meshes, orders, inner solvers, methods and ranks: time, memory, counts and errors
    #[command(after_help = BENCH)]
    Bench(bench::BenchArgs),
    /// Make the mesh of a scene, or find it in the cache, and print what it has
    Mesh(mesh::MeshArgs),
    /// Write a small scene that works, with its script and comments, to begin from
    New {
        /// Folder for it; its last word names the scene
        #[arg(value_name = "NAME")]
        folder: PathBuf,
        /// Two blocks in space instead of the plane
        #[arg(long)]
        space: bool,
        /// Two cylinders as bodies of revolution instead of the plane
        #[arg(long, conflicts_with = "space")]
        axisymmetric: bool,
    },
    /// Print the JSON schema of scene files, by which editors complete and check them
    Schema,
    /// Print a script that completes commands and options in a shell
    Completions {
        /// bash, zsh, fish, elvish or powershell
        #[arg(value_name = "SHELL")]
        shell: Shell,
    },
}

/// The commands that need MPI and PETSc.
#[derive(Subcommand)]
enum Solving {
    /// Solve a scene and write its results
    #[command(after_help = SOLVE)]
    Solve(solve::SolveArgs),
    /// Build the problem of a scene and print what it has, without solving it
    #[command(after_help = CHECK)]
    Check(check::CheckArgs),
    /// Solve a scene for every combination of values of its keys
    #[command(after_help = SWEEP)]
    Sweep(sweep::SweepArgs),
}

/// Return the first word among PETSc options that is an option of the program, typed with one dash instead of two. It
/// has no dashes.
fn option_with_one_dash(petsc: &[String]) -> Option<String> {
    let command = Cli::command();
    let known = command.get_subcommands().flat_map(clap::Command::get_arguments).filter_map(clap::Arg::get_long);
    let known: Vec<&str> = known.filter(|name| name.len() > 1 && *name != "help").collect();
    petsc.iter().filter_map(|word| word.strip_prefix('-')).find(|word| known.contains(word)).map(str::to_owned)
}

/// The reason why a command line leads to no command.
enum CliError {
    /// A refusal of this program.
    Ours(Error),
    /// A refusal of the parser, or help or the version if the user asked for them.
    Parser(clap::Error),
}

impl CliError {
    /// Print the refusal, and return the exit code.
    fn print(&self) -> i32 {
        match self {
            Self::Ours(error) => complain(error),
            Self::Parser(refusal) => match refusal.print() {
                // a closed pipe is no failure
                Err(cause) if cause.kind() != ErrorKind::BrokenPipe => {
                    complain(&Error::file(Path::new("standard output"), "write", &cause))
                }
                _ => refusal.exit_code(),
            },
        }
    }
}

/// Run the program with the words of its command line, the program's name first, and return the exit code.
pub fn run(words: Vec<OsString>) -> i32 {
    let (cli, petsc) = match parse(words) {
        Ok(parsed) => parsed,
        Err(refusal) => return refusal.print(),
    };
    let work = move |interrupt: &Interrupt| match cli.command {
        Command::Solving(command) => with_session(&petsc, interrupt, command),
        command => without_session(interrupt, command, petsc),
    };
    Interrupt::watch(work).unwrap_or_else(|error| complain(&error))
}

/// Parse the words of a command line into a command and the options of PETSc.
fn parse(words: Vec<OsString>) -> std::result::Result<(Cli, Vec<String>), CliError> {
    let refuse = |message: String, help: String| Err(CliError::Ours(Error::new(Kind::Usage, message).help(help)));
    let mut words = words.into_iter();
    let name = words.next().map_or("winkler".into(), |name| name.to_string_lossy().into_owned());
    let words = match words.map(OsString::into_string).collect::<std::result::Result<Vec<String>, _>>() {
        Ok(words) => words.into_iter(),
        Err(word) => {
            let message = format!("this word is not UTF-8 text: `{}`", word.display());
            return refuse(message, "type it in UTF-8, or rename the file".to_owned());
        }
    };
    let parser = Cli::command();
    let commands = parser.get_subcommands().map(clap::Command::get_name).chain(["help"]).collect::<Vec<_>>();
    let (program, petsc) = options::split(words, &commands);
    if let Some(flag) = option_with_one_dash(&petsc) {
        return refuse(format!("PETSc knows no option -{flag}"), format!("did you mean --{flag}?"));
    }
    if let Some(flag) = program.iter().chain(&petsc).find(|word| matches!(word.as_str(), "-n" | "-np")) {
        let message = format!("`{flag}`: the number of ranks is an option of mpiexec");
        return refuse(message, "mpiexec -n 2 winkler solve SCENE".to_owned());
    }
    let bare_help = program.is_empty() && petsc.iter().any(|word| word == "-help");
    let program = if bare_help { vec!["--help".to_owned()] } else { program };
    let mut refusal = match Cli::try_parse_from(std::iter::once(name).chain(program)) {
        Ok(cli) => return Ok((cli, petsc)),
        Err(refusal) => refusal,
    };
    let word = refusal.get(ContextKind::InvalidArg).map(ToString::to_string).unwrap_or_default();
    // options of PETSc have underscores, those of this program have none
    if let Some(bare) = word.strip_prefix("--").filter(|bare| bare.contains('_')) {
        return refuse(format!("`{word}`: PETSc options take one dash"), format!("did you mean -{bare}?"));
    }
    let command = refusal.get(ContextKind::InvalidSubcommand).map(ToString::to_string).unwrap_or_default();
    for name in [&word, &command] {
        if let Some(advice) = gone::advice(gone::OPTIONS, name) {
            return refuse(format!("`{name}` is gone"), advice.to_owned());
        }
    }
    if command.ends_with(".toml") {
        return refuse(format!("`{command}` is no command"), format!("did you mean `winkler solve {command}`?"));
    }
    // the parser suggests `--` before the word, but the program takes no such words
    refusal.remove(ContextKind::Suggested);
    Err(CliError::Parser(refusal))
}

/// Run a command that needs neither MPI nor PETSc; it may start other programs.
fn without_session(interrupt: &Interrupt, command: Command, petsc: Vec<String>) -> i32 {
    let ended = match command {
        Command::Solving(_) => unreachable!("these commands have a session"),
        Command::New { folder, space, axisymmetric } => {
            let example = match (space, axisymmetric) {
                (true, _) => new::SPACE,
                (_, true) => new::REVOLUTION,
                _ => new::PLANE,
            };
            new::new(&folder, example)
        }
        Command::Schema => say(format_args!("{:#}", crate::scene::schema())).map(|()| 0),
        Command::Completions { shell } => {
            clap_complete::generate(shell, &mut Cli::command(), "winkler", &mut std::io::stdout());
            Ok(0)
        }
        Command::Bench(mut request) => {
            request.petsc = petsc;
            bench::bench(interrupt, &request)
        }
        Command::Mesh(request) => mesh::mesh(interrupt, &request),
    };
    ended.unwrap_or_else(|error| complain(&error))
}

/// Refuse a folder, a pipe or a device as a file of options: PETSc would wait for ever at a pipe.
fn refuse_odd_files(words: &[String]) -> Result<()> {
    for pair in words.windows(2).filter(|pair| pair[0].eq_ignore_ascii_case("-options_file")) {
        // PETSc itself reports a file that does not exist.
        if Path::new(&pair[1]).exists() {
            file::open(Path::new(&pair[1]))?;
        }
    }
    Ok(())
}

/// Run a command that solves, in a session with PETSc.
fn with_session(petsc: &[String], interrupt: &Interrupt, command: Solving) -> i32 {
    let session = match refuse_odd_files(petsc).and_then(|()| Ok(Session::start(petsc)?)) {
        Ok(session) => session,
        Err(error) => return complain(&error),
    };
    match dispatch(&session, interrupt, command) {
        Ok(code) => match session.finish() {
            Err(error) if code == 0 => complain(&error.into()),
            _ => code,
        },
        Err(error) if error.is_silent() => error.kind().exit_code(),
        Err(error) if error.is_common() && session.rank() > 0 => error.kind().exit_code(),
        Err(error) => {
            let code = complain(&error);
            // other ranks may wait for this one, unless the error is collective
            if session.size() > 1 && !error.is_agreed() {
                session.abort(code);
            }
            code
        }
    }
}

/// Run a command in its session.
fn dispatch(session: &Session, interrupt: &Interrupt, command: Solving) -> Result<i32> {
    match command {
        Solving::Solve(request) => solve::solve(session, interrupt, &request),
        Solving::Check(request) => check::check(session, interrupt, &request),
        Solving::Sweep(request) => sweep::sweep(session, interrupt, &request),
    }
}

/// Print an error, and return its exit code.
fn complain(error: &Error) -> i32 {
    let is_colored =
        std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
    eprintln!("{}", error.render(is_colored));
    if error.kind() == Kind::Usage {
        eprintln!("`winkler --help` shows the command line");
    }
    error.kind().exit_code()
}
