//! Random scenes by every method, as a Markdown table with every failure below. `scripts/stress --help`.

#[path = "../tests/stress/builder.rs"]
mod builder;
#[path = "../tests/stress/crushed.rs"]
mod crushed;
#[path = "../tests/stress/laws.rs"]
mod laws;
#[path = "../tests/stress/mixed.rs"]
mod mixed;
#[path = "../tests/stress/random.rs"]
mod random;
#[path = "../tests/stress/runs.rs"]
mod runs;
#[path = "../tests/stress/saturating.rs"]
mod saturating;
#[path = "../tests/stress/scenes.rs"]
mod scenes;
#[path = "../tests/stress/slender.rs"]
mod slender;
#[path = "../tests/stress/wide.rs"]
mod wide;

use clap::Parser;
use runs::{Answer, NAMES, Recipe, Verdict};
use scenes::{Case, Expect};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use winkler::error::{Error, Kind, Result};
use winkler::petsc::Session;

/// Runs random scenes by every method and compares the pressures with those of Newton's method.
///
/// Scenes are two or three blocks on each other or a ring of four, in the plane, with linear and power laws. With
/// --wide they are up to seventeen bodies in the plane, of revolution or in space: blocks, cylinders, spheres, lenses,
/// small bodies, walls of bricks; with laws of every form in one scene, springs to the ground, own weight, and given
/// starts. With --slender they are leaves, discs, plates, frames and hoops from 1:5 to 1:200, in the plane, of
/// revolution and in space. A seed stands for other scenes then.
///
/// With --mixed they have obstacles, bonds and forces besides, with --crushed also layers that remember, load steps, and
/// bonds that carry shear. With --saturating the layers saturate.
///
/// Exits with 1 if the default method fails on a scene that has a solution, or if any method is wrong.
#[derive(Parser)]
#[command(name = "scripts/stress")]
struct Arguments {
    /// Number of scenes
    #[arg(long, default_value_t = 500)]
    scenes: usize,
    /// First scene of the series
    #[arg(long, default_value_t = 0)]
    first: usize,
    /// Draws from the wider box
    #[arg(long, conflicts_with = "slender")]
    wide: bool,
    /// Draws slender bodies
    #[arg(long)]
    slender: bool,
    /// Draws obstacles, bonds and forces
    #[arg(long, conflicts_with_all = ["wide", "slender"])]
    mixed: bool,
    /// Draws layers that remember, and bonds that carry shear
    #[arg(long, conflicts_with_all = ["wide", "slender", "mixed"])]
    crushed: bool,
    /// Draws layers that saturate
    #[arg(long, conflicts_with_all = ["wide", "slender", "mixed", "crushed"])]
    saturating: bool,
    /// Seed of the series
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Methods, separated by commas; a number is a stationary gamma, `any` the scene's own
    #[arg(long, value_delimiter = ',', default_values_t = NAMES.map(String::from))]
    methods: Vec<String>,
    /// This scene alone
    #[arg(long, value_name = "INDEX")]
    only: Option<usize>,
    /// Writes the scene files into this folder
    #[arg(long, value_name = "FOLDER", num_args = 0..=1, default_missing_value = "stress-scenes")]
    keep: Option<PathBuf>,
}

/// Draws a scene of a series, given by its seed, its number and the folder of the program.
type Draw = fn(u64, usize, &Path) -> Case;

impl Arguments {
    /// The family of the scenes, and the option for it.
    fn family(&self) -> (Draw, &'static str) {
        let families: [(bool, Draw, &str); 5] = [
            (self.wide, wide::scene, " --wide"),
            (self.slender, slender::scene, " --slender"),
            (self.mixed, mixed::scene, " --mixed"),
            (self.crushed, crushed::scene, " --crushed"),
            (self.saturating, saturating::scene, " --saturating"),
        ];
        let asked = families.into_iter().find(|(is_asked, ..)| *is_asked);
        asked.map_or((scenes::scene, ""), |(_, draw, option)| (draw, option))
    }
}

/// What a method did on all scenes.
#[derive(Default)]
struct Tally {
    sweeps: Vec<usize>,
    iterations: Vec<usize>,
    factorizations: Vec<usize>,
    right: usize,
    solvable: usize,
    named: usize,
    unsolvable: usize,
    wrong: usize,
    failed: usize,
    roundoff: usize,
    seconds: f64,
}

/// An answer that is listed.
struct Failure {
    index: usize,
    /// What is wrong, in a line.
    line: String,
    /// The scene in a line.
    scene: String,
}

/// What came of all scenes so far.
struct Results<'a> {
    arguments: &'a Arguments,
    tallies: HashMap<&'a str, Tally>,
    failures: Vec<Failure>,
    /// Whether no method was wrong, and the default method did not fail.
    sound: bool,
}

/// Newton steps beyond which a scene is listed.
const MANY: usize = 15;

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprint!("{}", error.render(false));
            ExitCode::from(error.kind().exit_code() as u8)
        }
    }
}

fn run(arguments: &Arguments) -> Result<bool> {
    refuse_unknown(&arguments.methods)?;
    let scratch = tempfile::tempdir().map_err(|cause| Error::file(&std::env::temp_dir(), "write", &cause))?;
    let folder = arguments.keep.as_deref().unwrap_or(scratch.path());
    std::fs::create_dir_all(folder).map_err(|cause| Error::file(folder, "create", &cause))?;
    let session = Session::start(&[])?;
    let indices = match arguments.only {
        Some(index) => index..index + 1,
        None => arguments.first..arguments.first + arguments.scenes,
    };
    let mut results = Results { arguments, tallies: HashMap::new(), failures: Vec::new(), sound: true };
    for index in indices {
        let (case, path) = write(arguments, folder, index)?;
        let (reference, answers) = solve_all(&session, arguments, &case, &path)?;
        for (name, answer) in arguments.methods.iter().zip(&answers) {
            results.take(&case, &reference, name, answer);
        }
        if !reference.claims && case.expect == Expect::Solution && !reference.status.starts_with("un") {
            eprintln!("{index} reference: {} residual {:.1e}", reference.message, reference.residual);
        }
        if index % 50 == 49 {
            eprintln!("{} scenes done", index + 1);
        }
    }
    results.print();
    Ok(results.sound)
}

fn refuse_unknown(methods: &[String]) -> Result<()> {
    let is_known =
        |name: &&String| NAMES.contains(&name.as_str()) || name.parse::<f64>().is_ok_and(|gamma| gamma > 0.0);
    let Some(name) = methods.iter().find(|name| !is_known(name)) else { return Ok(()) };
    let help = format!("it is a number or one of {}", NAMES.join(", "));
    Err(Error::new(Kind::Usage, format!("unknown method `{name}`")).help(help))
}

/// Draws a scene and writes its file.
fn write(arguments: &Arguments, folder: &Path, index: usize) -> Result<(Case, PathBuf)> {
    let (draw, _) = arguments.family();
    let case = draw(arguments.seed, index, Path::new(env!("CARGO_MANIFEST_DIR")));
    let path = folder.join(format!("scene-{}-{index}.toml", arguments.seed));
    let text = format!("# {}\n{}", case.line, case.text);
    std::fs::write(&path, text).map_err(|cause| Error::file(&path, "write", &cause))?;
    if arguments.keep.is_some() {
        println!("{}", path.display());
    }
    Ok((case, path))
}

/// The reference, then every method. Without a reference that claims to be one, the best answer is.
fn solve_all(session: &Session, arguments: &Arguments, case: &Case, path: &Path) -> Result<(Answer, Vec<Answer>)> {
    let mut reference = runs::reference(session, path, case)?;
    let mut answers = Vec::new();
    for name in &arguments.methods {
        answers.push(runs::by_method(session, path, &Recipe::new(name, case))?);
    }
    if !reference.claims
        && let Some(best) =
            answers.iter().filter(|answer| answer.claims).min_by(|a, b| a.residual.total_cmp(&b.residual))
    {
        reference = best.clone();
    }
    Ok((reference, answers))
}

impl Tally {
    fn take(&mut self, answer: &Answer, verdict: &Verdict, solvable: bool) {
        self.seconds += answer.seconds;
        self.wrong += usize::from(matches!(verdict, Verdict::Wrong(_)));
        self.failed += usize::from(*verdict == Verdict::Failed);
        self.roundoff += usize::from(answer.status == "roundoff-limited");
        if !solvable {
            self.unsolvable += 1;
            self.named += usize::from(matches!(verdict, Verdict::Named | Verdict::Right));
            return;
        }
        self.solvable += 1;
        if *verdict == Verdict::Right {
            self.right += 1;
            self.sweeps.push(answer.sweeps);
            self.iterations.push(answer.iterations);
            self.factorizations.push(answer.factorizations);
        }
    }
}

impl<'a> Results<'a> {
    /// Counts the answer of a method, and lists it if it is not as it should be.
    fn take(&mut self, case: &Case, reference: &Answer, name: &'a str, answer: &Answer) {
        let verdict = runs::judge(case, reference, answer);
        let solvable = case.expect == Expect::Solution && verdict != Verdict::Named;
        self.tallies.entry(name).or_default().take(answer, &verdict, solvable);
        let wrong = matches!(verdict, Verdict::Wrong(_));
        println!(
            "@ {} {name} {} {} {} {:.2e} {:.2e} {:.2e} {} {}",
            case.index,
            answer.status,
            answer.iterations,
            answer.sweeps,
            answer.residual,
            answer.rounding,
            runs::difference(case, reference, answer),
            match &verdict {
                Verdict::Right => "right",
                Verdict::Named => "named",
                Verdict::Failed => "failed",
                Verdict::Wrong(_) => "wrong",
            },
            reference.status
        );
        self.sound &= !wrong && (name != "auto" || verdict != Verdict::Failed);
        if self.arguments.only.is_some() {
            println!(
                "{name}: {verdict:?}: {} iterations, {} sweeps; {}\n  {}",
                answer.iterations,
                answer.sweeps,
                answer.message,
                answer.history.join(" ")
            );
        }
        let many = matches!(name, "auto" | "newton" | "newton-robin") && answer.iterations > MANY;
        let roundoff = answer.status == "roundoff-limited";
        if !(wrong || verdict == Verdict::Failed || many || roundoff) {
            return;
        }
        let why = match &verdict {
            Verdict::Wrong(why) => format!("WRONG ({why})"),
            Verdict::Right if many => format!("{} STEPS", answer.iterations),
            Verdict::Failed if solvable => format!("FAILED ({})", answer.status),
            Verdict::Failed => format!("NOT NAMED ({})", answer.status),
            _ => answer.status.clone(),
        };
        let (peak, off) = (runs::peak(reference) / case.pressure, runs::difference(case, reference, answer));
        let line = format!(
            "{} {name}: {why}, peak {peak:.1e}, pressure {off:.1e} off, residual {:.1e}, {} sweeps: {}",
            case.index, answer.residual, answer.sweeps, answer.message
        );
        eprintln!("{line}");
        self.failures.push(Failure { index: case.index, line, scene: case.line.clone() });
    }

    fn print(&self) {
        let Self { arguments, tallies, failures, .. } = self;
        println!(
            "| method | solved | rightly named | wrong | failed | roundoff claimed | steps: 50 %, 90 %, 99 %, worst, sum | sweeps: median, worst | factorizations | seconds |"
        );
        println!("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
        for name in &arguments.methods {
            let Some(tally) = tallies.get(name.as_str()) else { continue };
            let (steps, sweeps) = (Sorted::new(&tally.iterations), Sorted::new(&tally.sweeps));
            println!(
                "| {name} | {} of {} | {} of {} | {} | {} | {} | {}, {}, {}, {}, {} | {}, {} | {} | {:.0} |",
                tally.right,
                tally.solvable,
                tally.named,
                tally.unsolvable,
                tally.wrong,
                tally.failed,
                tally.roundoff,
                steps.share(0.5),
                steps.share(0.9),
                steps.share(0.99),
                steps.share(1.0),
                tally.iterations.iter().sum::<usize>(),
                sweeps.share(0.5),
                sweeps.share(1.0),
                Sorted::new(&tally.factorizations).share(0.5),
                tally.seconds
            );
        }
        let mut last = usize::MAX;
        for Failure { index, line, scene } in failures {
            if *index != last {
                let (_, option) = arguments.family();
                println!("\n`scripts/stress{option} --seed {} --only {index} --keep`: {scene}\n", arguments.seed);
                last = *index;
            }
            println!("- {line}");
        }
    }
}

/// Counts in order.
struct Sorted(Vec<usize>);

impl Sorted {
    fn new(values: &[usize]) -> Self {
        let mut sorted = values.to_vec();
        sorted.sort_unstable();
        Self(sorted)
    }

    /// The least count that this share of all does not exceed; 0 without any.
    fn share(&self, share: f64) -> usize {
        let place = (share * self.0.len() as f64).ceil() as usize;
        self.0.get(place.saturating_sub(1)).copied().unwrap_or(0)
    }
}
