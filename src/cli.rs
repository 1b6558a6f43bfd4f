//! The command line: arguments -> request -> command -> exit code.
//!
//! Ranks that were started with different command lines are refused, since they would wait for each other without end.

use crate::commands::{bench, check, gone, mesh, new, solve, sweep};
use crate::error::{Error, Kind, Result, few};
use crate::exchange::{all_gather, broadcast};
use crate::interrupt::Interrupt;
use crate::output::{make_folder, say};
use crate::parallel::{Ranks, collectively, differences};
use crate::petsc::Session;
use crate::report;
use crate::solver::options;
use anstream::{AutoStream, ColorChoice};
use clap::error::ContextKind;
use clap::{CommandFactory, Parser, Subcommand};
use clap_complete::Shell;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Frictionless contact of elastic bodies through nonlinear Winkler layers, by Robin-Robin domain decomposition on PETSc.
///
/// PETSc options are typed as in every PETSc program, for all bodies (-ksp_type cg -pc_type hypre) or for one
/// (-upper_ksp_type cg); -help lists them.
#[derive(Parser)]
#[command(name = "winkler", version, after_help = after_help())]
struct Cli {
    #[command(flatten)]
    color: colorchoice_clap::Color,
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
  winkler check scene.toml --set mesh.set.n=64 --json
  winkler check scene.toml -o pictures";

const SWEEP: &str = "Examples:
  winkler sweep scene.toml --over method.gamma=0.3,0.6,0.9
  winkler sweep scene.toml --over contact.0.layer.power.a=0.5,1 --over mesh.set.n=16,32 -o results/sweep";

const BENCH: &str = "Examples:
  winkler bench scene.toml --over mesh.set.n=16,32,64 --solver mumps,hypre --linear
  winkler bench scene.toml --solver \"-ksp_type cg -pc_type icc\" --order 1,2 --repeat 3
  winkler bench a.toml b.toml --method newton,robin --ranks 1,2 --budget 600";

#[derive(Subcommand)]
enum Command {
    #[command(flatten)]
    Solving(Solving),
    /// Compare meshes, orders, inner solvers, methods and ranks: time, memory, counts and errors
    #[command(after_help = BENCH)]
    Bench(bench::BenchArgs),
    /// Make the mesh of a scene, or find it in the cache, and print what it has
    Mesh(mesh::MeshArgs),
    /// Write a page with pictures and tables of a run, from its files alone: one HTML file
    Report {
        /// Folder of results
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        /// File to write [default: report.html in the folder]
        #[arg(short, value_name = "FILE")]
        output: Option<PathBuf>,
    },
    /// Draw one picture of a run as SVG
    Plot {
        /// Folder of results
        #[arg(value_name = "DIR")]
        folder: PathBuf,
        /// What to draw: stress, displacement, pressure, convergence, or over load steps area (in contact over force) or force (over approach)
        #[arg(value_name = "WHAT")]
        what: String,
        /// File to write, .svg [default: WHAT.svg in the folder]
        #[arg(short, value_name = "FILE")]
        output: Option<PathBuf>,
    },
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
    /// Write man pages, one a command
    Man {
        /// Folder for them
        #[arg(value_name = "DIR")]
        folder: PathBuf,
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

/// Return the first word among PETSc options that is an option of the program, typed with one dash instead of two. It has no dashes.
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

    fn exit_code(&self) -> i32 {
        match self {
            Self::Ours(error) => error.kind().exit_code(),
            Self::Parser(refusal) => refusal.exit_code(),
        }
    }
}

/// Run the program with the words of its command line, the program's name first, and return the exit code.
pub fn run(words: Vec<OsString>) -> i32 {
    // MPI starts first: the other ranks would wait for a rank that ended before, say after printing help
    let session = match Session::is_one_of_several().then(Session::start_mpi).transpose() {
        Ok(session) => session,
        Err(error) if error.is_silent() => return error.kind().exit_code(),
        Err(error) => return complain(&error),
    };
    let is_first = session.as_ref().is_none_or(|session| session.rank() == 0);
    let are_alike = session.as_ref().map_or(Ok(()), |session| refuse_other_words(session, &words));
    let (cli, petsc) = match are_alike.map_err(CliError::Ours).and_then(|()| parse(words)) {
        Ok(parsed) => parsed,
        Err(refusal) => return if is_first { refusal.print() } else { refusal.exit_code() },
    };
    let interrupt = match Interrupt::watch() {
        Ok(interrupt) => interrupt,
        Err(error) => return complain(&error),
    };
    cli.color.write_global();
    match (cli.command, session) {
        (Command::Solving(command), session) => with_session(session, &petsc, &interrupt, command),
        (command, None) => without_session(&interrupt, command, petsc),
        // only the first rank runs a command that is not parallel
        (command, Some(session)) => {
            broadcast(&Ranks::new(&session), || Ok(without_session(&interrupt, command, petsc))).unwrap_or(1)
        }
    }
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
    let (program, petsc) = options::split(words);
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
        if let Some(advice) = gone::advice(name) {
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
        Command::Man { folder } => manual(&folder),
        Command::Bench(mut request) => {
            request.petsc = petsc;
            bench::bench(interrupt, &request)
        }
        Command::Mesh(request) => mesh::mesh(interrupt, &request),
        Command::Report { folder, output } => {
            report::save(&folder, output.as_deref()).and_then(|path| say(path.display())).map(|()| 0)
        }
        Command::Plot { folder, what, output } => report::draw(&folder, &what, output.as_deref())
            .and_then(|paths| paths.iter().try_for_each(|path| say(path.display())))
            .map(|()| 0),
    };
    ended.unwrap_or_else(|error| complain(&error))
}

/// Write a man page of the program and one of each command.
fn manual(folder: &Path) -> Result<i32> {
    make_folder(folder)?;
    // pages are made in a folder of their own and moved: a link with the name of a page is replaced, never written through
    let made_in = folder.join(format!(".winkler-{}-man", std::process::id()));
    let move_pages = || {
        let mut pages = std::fs::read_dir(&made_in)?.flatten();
        pages.try_for_each(|page| std::fs::rename(page.path(), folder.join(page.file_name())))
    };
    let made = std::fs::create_dir(&made_in)
        .and_then(|()| clap_mangen::generate_to(Cli::command(), &made_in))
        .and_then(|()| move_pages());
    // pages that are left after a failure are of no use
    let _ = std::fs::remove_dir_all(&made_in);
    made.map_err(|cause| Error::file(folder, "write man pages to", &cause)).map(|()| 0)
}

/// Run a command that solves. With several ranks the session has started MPI already.
fn with_session(session: Option<Session>, petsc: &[String], interrupt: &Interrupt, command: Solving) -> i32 {
    let session = match session.map_or_else(Session::start_mpi, Ok) {
        Ok(session) => session,
        Err(error) => return complain(&error),
    };
    let ended = session
        .start_petsc(petsc)
        .and_then(|()| collectively(&session, options::refuse_traps(&session)))
        .and_then(|()| dispatch(&session, interrupt, command));
    match ended {
        Ok(code) => match session.finish() {
            Err(error) if code == 0 => complain(&error),
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

/// Run a command that solves, in a session with PETSc.
fn dispatch(session: &Session, interrupt: &Interrupt, command: Solving) -> Result<i32> {
    match command {
        Solving::Solve(request) => solve::solve(session, interrupt, &request),
        Solving::Check(request) => check::check(session, interrupt, &request),
        Solving::Sweep(request) => sweep::sweep(session, interrupt, &request),
    }
}

/// Print an error, and return its exit code.
fn complain(error: &Error) -> i32 {
    // colors follow NO_COLOR, CLICOLOR_FORCE and `--color`; without these a terminal has them
    let color = AutoStream::choice(&std::io::stderr()) != ColorChoice::Never;
    eprintln!("{}", error.render(color));
    if error.kind() == Kind::Usage {
        eprintln!("`winkler --help` shows the command line");
    }
    error.kind().exit_code()
}

/// Variables with options of PETSc, which uses those of the first rank on all ranks.
const VARIABLES: [&str; 2] = ["PETSC_OPTIONS", "PETSC_OPTIONS_YAML"];

/// Refuse ranks that differ in the version of the program, in the words of the command line after the program's name, or in the options of PETSc
/// in the environment. Collective.
fn refuse_other_words(session: &Session, words: &[OsString]) -> Result<()> {
    let words = words.iter().skip(1).map(shown).collect::<Vec<_>>().join(" ");
    let mut facts =
        BTreeMap::from([(PROGRAM.to_owned(), env!("CARGO_PKG_VERSION").to_owned()), (WORDS.to_owned(), words)]);
    let variables = VARIABLES.map(|name| std::env::var_os(name).map(|value| value.to_string_lossy().into_owned()));
    let first = broadcast(&Ranks::new(session), || Ok(variables.clone()))?;
    for ((name, own), first) in VARIABLES.iter().zip(variables).zip(first) {
        // a launcher need not pass variables on to other machines: a rank without a variable has that of the first rank
        facts.extend(own.or(first).map(|value| ((*name).to_owned(), value)));
    }
    let different: BTreeSet<String> = differences(session, &facts).into_iter().map(|found| found.what).collect();
    let Some(what) = [PROGRAM, WORDS].into_iter().chain(VARIABLES).find(|what| different.contains(*what)) else {
        return Ok(());
    };
    let values = all_gather(&Ranks::new(session), facts.remove(what).unwrap_or_default());
    let kind = if VARIABLES.contains(&what) { Kind::Solver } else { Kind::Usage };
    let mut error = Error::new(kind, format!("the ranks were started with different {}", plural(what)));
    for text in few(groups(&values)) {
        error = error.because(text);
    }
    Err(error.help("start all ranks alike: mpiexec -n 2 winkler solve SCENE").common())
}

const PROGRAM: &str = "version";
const WORDS: &str = "command line";

fn plural(what: &str) -> String {
    if VARIABLES.contains(&what) { format!("values of {what}") } else { format!("{what}s") }
}

/// Return a line for each different value with the ranks that have it, in the order of the first such rank.
fn groups(values: &[String]) -> Vec<String> {
    let mut groups: Vec<(&String, Vec<usize>)> = Vec::new();
    for (rank, value) in values.iter().enumerate() {
        match groups.iter_mut().find(|(known, _)| *known == value) {
            Some((_, ranks)) => ranks.push(rank),
            None => groups.push((value, vec![rank])),
        }
    }
    let line = |(value, ranks): (&String, Vec<usize>)| {
        let word = if ranks.len() == 1 { "rank" } else { "ranks" };
        format!("{word} {}: {}", few(ranks).join(", "), if value.is_empty() { "nothing" } else { value })
    };
    groups.into_iter().map(line).collect()
}

/// Return a word as it could be typed.
fn shown(word: &OsString) -> String {
    match word.to_str() {
        Some(text) if !text.is_empty() && !text.contains(|c: char| c.is_whitespace() || "\"'\\".contains(c)) => {
            text.to_owned()
        }
        _ => format!("{word:?}"),
    }
}
