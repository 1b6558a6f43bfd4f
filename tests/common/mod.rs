//! Runs the program as a user does, in a folder of its own, and reads what it wrote; or solves a scene by the library ([`here`]).

pub mod alone;
pub mod blocks;
pub mod here;
pub mod series;
pub mod shapes;
pub mod vtu;

use serde_json::Value;
use std::fs::{self, File};
use std::ops::{Deref, Index};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::RwLock;
use std::time::{Duration, Instant};
use tempfile::TempDir;
use winkler::internals::parallel::launcher;

/// The program under test.
pub const WINKLER: &str = env!("CARGO_BIN_EXE_winkler");

/// After this a run counts as hanging and is ended: two minutes, or the seconds in `WINKLER_TEST_PATIENCE` on a busy machine.
fn patience() -> Duration {
    let seconds = std::env::var("WINKLER_TEST_PATIENCE").ok().and_then(|seconds| seconds.parse().ok());
    Duration::from_secs(seconds.unwrap_or(120))
}

/// What came of a scene: `report.json`, which is null if there is none, and the contact tables.
pub struct Report {
    value: Value,
    /// All that was said, for messages of tests.
    said: String,
    tables: Tables,
}

/// Where contact tables are.
enum Tables {
    Folder(PathBuf),
    Memory(Vec<Table>),
}

impl Deref for Report {
    type Target = Value;

    fn deref(&self) -> &Value {
        &self.value
    }
}

impl Report {
    /// A number of the report, by name or path (`"times/total"`).
    pub fn number(&self, path: &str) -> f64 {
        let value = self.value.pointer(&format!("/{path}")).unwrap_or(&Value::Null);
        value.as_f64().unwrap_or_else(|| panic!("`{path}` of the report is {value}\n{}", self.said()))
    }

    /// A whole number of the report.
    pub fn count(&self, path: &str) -> usize {
        let number = self.number(path);
        assert_eq!(number, number.trunc(), "{path}");
        number as usize
    }

    /// A text of the report.
    pub fn text(&self, path: &str) -> &str {
        let value = self.value.pointer(&format!("/{path}")).unwrap_or(&Value::Null);
        value.as_str().unwrap_or_else(|| panic!("`{path}` of the report is {value}\n{}", self.said()))
    }

    /// Inner solver of each body, as the report has it.
    pub fn solvers(&self) -> Vec<&str> {
        let bodies = self.value["bodies"].as_array().unwrap_or_else(|| panic!("no bodies\n{}", self.said()));
        bodies.iter().map(|body| body["solver"].as_str().unwrap_or_default()).collect()
    }

    /// All warnings of the report, a line each.
    pub fn warnings(&self) -> String {
        let warnings = self.value["warnings"].as_array().unwrap_or_else(|| panic!("no report\n{}", self.said()));
        warnings.iter().filter_map(Value::as_str).collect::<Vec<_>>().join("\n")
    }

    /// The contact table of the first pair.
    pub fn contact(&self) -> Table {
        self.contact_of(0)
    }

    /// The contact table of a pair, which must be the only one of its two bodies.
    pub fn contact_of(&self, pair: usize) -> Table {
        match &self.tables {
            Tables::Memory(tables) => tables[pair].clone(),
            Tables::Folder(folder) => {
                let name = |side: usize| self.text(&format!("pairs/{pair}/bodies/{side}"));
                Table::read(&folder.join(format!("contact-{}-{}.csv", name(0), name(1))))
            }
        }
    }

    /// Force vectors of a pair on its two bodies, in the order of the scene.
    pub fn forces(&self, pair: usize) -> [[f64; 3]; 2] {
        let component = |side, c| self.number(&format!("pairs/{pair}/force/{side}/{c}"));
        std::array::from_fn(|side| std::array::from_fn(|c| component(side, c)))
    }

    /// The report, whose status must be `converged`.
    pub fn converged(self) -> Self {
        assert_eq!(self.value["status"].as_str(), Some("converged"), "{}", self.said());
        self
    }

    /// All that was said, for messages of tests.
    pub fn said(&self) -> String {
        if self.said.is_empty() { format!("{:#}", self.value) } else { self.said.clone() }
    }
}

/// What came of one run of the program.
pub struct Run {
    /// Exit code.
    pub code: i32,
    /// What it printed.
    pub stdout: String,
    /// What it complained about.
    pub stderr: String,
    /// What it reported.
    pub report: Report,
    /// Folder of results; it may not exist.
    pub folder: PathBuf,
    _scratch: TempDir,
}

impl Deref for Run {
    type Target = Report;

    fn deref(&self) -> &Report {
        &self.report
    }
}

impl Run {
    /// A table among the results.
    pub fn table(&self, name: &str) -> Table {
        Table::read(&self.folder.join(name))
    }

    /// `history.csv`.
    pub fn history(&self) -> Table {
        self.table("history.csv")
    }

    /// The run itself, which must have ended with status `converged`.
    pub fn converged(self) -> Self {
        assert_eq!((self.code, self.report["status"].as_str()), (0, Some("converged")), "{}", self.said());
        self
    }
}

/// Solves a scene with `-o` a folder of its own and further arguments.
pub fn solve(scene: impl AsRef<Path>, args: &[&str]) -> Run {
    solve_on(1, scene, args)
}

/// Solves a scene on a number of ranks; one rank starts without `mpiexec`.
pub fn solve_on(ranks: usize, scene: impl AsRef<Path>, args: &[&str]) -> Run {
    let scratch = TempDir::new().expect("a temporary folder");
    let folder = scratch.path().join("results");
    let mut command = program(ranks);
    command.arg("solve").arg(scene.as_ref()).arg("-o").arg(&folder).args(args);
    finish(command, scratch, folder)
}

/// Solves a scene with variables of the environment.
pub fn solve_where(variables: &[(&str, &str)], scene: impl AsRef<Path>, args: &[&str]) -> Run {
    let scratch = TempDir::new().expect("a temporary folder");
    let folder = scratch.path().join("results");
    let mut command = program(1);
    command.envs(variables.iter().copied());
    command.arg("solve").arg(scene.as_ref()).arg("-o").arg(&folder).args(args);
    finish(command, scratch, folder)
}

/// Runs the program with these words, in an empty folder.
pub fn winkler(args: &[&str]) -> Run {
    winkler_on(1, args)
}

/// The same on several ranks.
pub fn winkler_on(ranks: usize, args: &[&str]) -> Run {
    let scratch = TempDir::new().expect("a temporary folder");
    let folder = scratch.path().to_owned();
    let mut command = program(ranks);
    command.args(args);
    finish(command, scratch, folder)
}

/// Runs the program with these words on two ranks, each in a folder of its own and with variables for the second. Results that the words name are `results` in the folder of the run.
pub fn apart(folders: [&Path; 2], variables: &[&str], args: &[&str]) -> Run {
    let scratch = TempDir::new().expect("a temporary folder");
    let folder = scratch.path().join("results");
    let mut command = launcher();
    environment(&mut command);
    let output = ["-o", folder.to_str().expect("a path")];
    let output = if args.contains(&"solve") { &output[..] } else { &[] };
    let words = [&[WINKLER], args, output].concat();
    command.args(["-n", "1", "-wdir"]).arg(folders[0]).args(&words);
    command.args([":", "-n", "1", "-wdir"]).arg(folders[1]).arg("env").args(variables).args(&words);
    finish(command, scratch, folder)
}

/// The program, on a number of ranks, with the environment of all tests.
fn program(ranks: usize) -> Command {
    let mut command = if ranks == 1 {
        Command::new(WINKLER)
    } else {
        let mut command = launcher();
        command.args(["-n", &ranks.to_string(), WINKLER]);
        command
    };
    environment(&mut command);
    command
}

/// Held for writing while MPI starts in this process and changes the environment, and for reading where tests read it: the C library has no lock of its own.
pub static ENVIRONMENT: RwLock<()> = RwLock::new(());

/// Removes what MPI sets where this process has a session, and a launcher would take for its own.
pub fn without_session(command: &mut Command) -> &mut Command {
    let _environment = ENVIRONMENT.read();
    let is_of_mpi = |name: &str| ["OMPI_", "ORTE_", "PMIX_", "PRTE_"].iter().any(|start| name.starts_with(start));
    for (name, _) in std::env::vars().filter(|(name, _)| is_of_mpi(name)) {
        command.env_remove(name);
    }
    command
}

/// Sets what tests need: Open MPI as root, ranks that share cores, one thread a rank unless the environment asks for more, a cache of meshes for all tests, no
/// options from outside.
pub fn environment(command: &mut Command) {
    let threads = || {
        let _environment = ENVIRONMENT.read();
        std::env::var("OPENBLAS_NUM_THREADS").unwrap_or_else(|_| "1".to_owned())
    };
    without_session(command)
        .env("OMPI_MCA_rmaps_base_oversubscribe", "1")
        // bound to one core a rank would have one thread of OpenBLAS, whatever the environment asks for
        .env("OMPI_MCA_hwloc_base_binding_policy", "none")
        // a rank that waits leaves its core to the ranks of other tests; busy waiting makes the tests on ranks several times as long
        .env("OMPI_MCA_mpi_yield_when_idle", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
        .env("OPENBLAS_NUM_THREADS", threads())
        .env("WINKLER_CACHE", Path::new(env!("CARGO_TARGET_TMPDIR")).join("meshes"))
        .env_remove("PETSC_OPTIONS");
}

fn finish(mut command: Command, scratch: TempDir, folder: PathBuf) -> Run {
    command.current_dir(scratch.path());
    // launchers that start at the same moment get into each other's way in a common folder
    command.env("OMPI_MCA_orte_tmpdir_base", scratch.path());
    let (status, stdout, stderr) = output(command, patience());
    let value = match fs::read(folder.join("report.json")) {
        Ok(bytes) => serde_json::from_slice(&bytes).expect("report.json is JSON"),
        Err(_) => Value::Null,
    };
    let code = status.code().unwrap_or(-1);
    let said = format!("exit code {code}\n--- stdout\n{stdout}--- stderr\n{stderr}");
    let report = Report { value, said, tables: Tables::Folder(folder.clone()) };
    let run = Run { code, stdout, stderr, report, folder, _scratch: scratch };
    assert!(!run.stderr.contains("panicked"), "the program panicked\n{}", run.said());
    run
}

/// Runs a command to its end, which must come before `patience` is over; gives its exit status, output and complaints.
pub fn output(mut command: Command, patience: Duration) -> (ExitStatus, String, String) {
    let environment = ENVIRONMENT.read();
    // Files, unlike pipes, take all output without anybody reading.
    let texts = TempDir::new().expect("a temporary folder");
    let [out, err] = ["out", "err"].map(|name| texts.path().join(name));
    let file = |path: &Path| Stdio::from(File::create(path).expect("a temporary file"));
    command.stdin(Stdio::null()).stdout(file(&out)).stderr(file(&err));
    let began = Instant::now();
    let mut child = command.spawn().unwrap_or_else(|cause| panic!("{command:?}: {cause}"));
    drop(environment);
    let read = |path: &Path| String::from_utf8_lossy(&fs::read(path).unwrap_or_default()).into_owned();
    loop {
        if let Some(status) = child.try_wait().expect("a child can be waited for") {
            return (status, read(&out), read(&err));
        }
        if began.elapsed() > patience {
            end(&mut child);
            panic!("{command:?} does not end\n--- stdout\n{}--- stderr\n{}", read(&out), read(&err));
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Send a signal to a process, by the shell, which has `kill` everywhere. Return whether there is the process.
pub fn send(signal: &str, process: u32) -> bool {
    Command::new("sh")
        .args(["-c", &format!("kill -s {signal} {process}")])
        .status()
        .is_ok_and(|status| status.success())
}

/// Ends a process that hangs.
fn end(child: &mut Child) {
    // mpiexec ends its ranks at this signal, and would leave them at a harder one
    send("TERM", child.id());
    let began = Instant::now();
    while began.elapsed() < Duration::from_secs(3) {
        if child.try_wait().is_ok_and(|status| status.is_some()) {
            return;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let _ = child.kill();
    let _ = child.wait();
}

/// The project's folder.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The scene of a case in `meshes/`.
pub fn case(name: &str) -> PathBuf {
    root().join("meshes").join(name).join("scene.toml")
}

/// A scene file of a test, gone with this value.
pub struct Scene {
    /// The file.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
    _folder: TempDir,
}

impl Scene {
    /// Writes a scene.
    pub fn new(text: impl Into<String>) -> Self {
        let folder = TempDir::new().expect("a temporary folder");
        let (path, text) = (folder.path().join("scene.toml"), text.into());
        fs::write(&path, &text).expect("a scene can be written");
        Self { path, text, _folder: folder }
    }

    /// A case of `meshes/` with one text in it replaced by another.
    pub fn edited(name: &str, from: &str, to: &str) -> Self {
        let text = text_of(name);
        assert_eq!(text.matches(from).count(), 1, "`{from}` must stand once in the scene of {name}");
        Self::new(text.replace(from, to))
    }

    /// Number of the line where a text stands first.
    pub fn line_of(&self, text: &str) -> usize {
        let found = self.text.lines().position(|line| line.contains(text));
        1 + found.unwrap_or_else(|| panic!("`{text}` does not stand in the scene"))
    }
}

impl AsRef<Path> for Scene {
    fn as_ref(&self) -> &Path {
        &self.path
    }
}

/// The nanoseconds since 1970, for a title that no other run has: an adaptation begins with the mesh on which an earlier one of the same scene
/// has ended.
pub fn nanoseconds() -> u128 {
    std::time::UNIX_EPOCH.elapsed().expect("a clock").as_nanos()
}

/// The scene of a case, with a path of its script that holds from everywhere.
pub fn text_of(name: &str) -> String {
    let path = case(name);
    let text = fs::read_to_string(&path).unwrap_or_else(|cause| panic!("{}: {cause}", path.display()));
    let folder = root().join("meshes").join(name);
    text.replace("geo = \"", &format!("geo = \"{}/", folder.display()))
}

/// A CSV file as columns; an empty field is NaN.
#[derive(Clone)]
pub struct Table {
    /// Names of the columns, in order.
    pub names: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl Table {
    /// Reads a file.
    pub fn read(path: &Path) -> Self {
        let file = File::open(path).unwrap_or_else(|cause| panic!("{}: {cause}", path.display()));
        Self::of(file, &path.display().to_string())
    }

    /// Reads text; `name` stands in messages.
    pub fn of(text: impl std::io::Read, name: &str) -> Self {
        let mut file = csv::Reader::from_reader(text);
        let names: Vec<String> = file.headers().expect("a header").iter().map(String::from).collect();
        let mut columns = vec![Vec::new(); names.len()];
        for row in file.records() {
            for (column, field) in columns.iter_mut().zip(&row.expect("rows as long as the header")) {
                let number = if field.is_empty() { Ok(f64::NAN) } else { field.parse() };
                column.push(number.unwrap_or_else(|_| panic!("{name}: `{field}` is no number")));
            }
        }
        Self { names, columns }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns[0].len()
    }

    /// A column of whole numbers.
    pub fn counts(&self, name: &str) -> Vec<usize> {
        self[name].iter().map(|&value| value as usize).collect()
    }
}

impl Index<&str> for Table {
    type Output = [f64];

    fn index(&self, name: &str) -> &[f64] {
        let found = self.names.iter().position(|known| known == name);
        &self.columns[found.unwrap_or_else(|| panic!("no column `{name}` among {:?}", self.names))]
    }
}

/// Largest difference over the largest value of the second one.
pub fn distance(ours: &[f64], theirs: &[f64]) -> f64 {
    assert_eq!(ours.len(), theirs.len());
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |max: f64, v| if v > max { v } else { max });
    let difference: Vec<f64> = ours.iter().zip(theirs).map(|(a, b)| (a - b).abs()).collect();
    assert!(difference.iter().all(|d| d.is_finite()), "a value is not finite");
    largest(&mut difference.into_iter()) / largest(&mut theirs.iter().map(|v| v.abs()))
}
