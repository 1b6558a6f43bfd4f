//! What a run keeps when a signal, a kill or a full disk ends it.

use crate::common::{Run, Scene, case, distance, environment, output, root, send, solve, solve_on, text_of};
use serde_json::Value;
use std::fs::{self, File};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use winkler::internals::parallel::launcher;

/// A run that would take hours: the paper's iteration with tiny steps.
const ENDLESS: [&str; 4] = ["--set", "method.gamma=1e-6", "--set", "method.stop={residual=1e-12,iterations=100000000}"];

/// A short one with steps enough to be stopped between.
const SHORT: [&str; 6] =
    ["--set", "method.gamma=0.05", "--set", "method.stop={residual=1e-8}", "--set", "mesh.set.n=8"];

/// The program at work in a folder of its own.
struct Working {
    child: Guard,
    scratch: TempDir,
}

/// A process that does not outlive its test.
struct Guard(Child);

impl Drop for Guard {
    fn drop(&mut self) {
        // one that has ended needs no end
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Working {
    /// Starts `words` with results in `results` of a new folder.
    fn start(words: &[&str], ranks: usize) -> Self {
        Self::start_in(TempDir::new().expect("a temporary folder"), words, ranks, &[])
    }

    fn start_in(scratch: TempDir, words: &[&str], ranks: usize, variables: &[(&str, &Path)]) -> Self {
        let winkler = env!("CARGO_BIN_EXE_winkler");
        // tests may run under nohup, whose signals a program leaves ignored
        let mut command = Command::new("env");
        command.arg("--default-signal=HUP,INT,TERM");
        if ranks > 1 {
            let launcher = launcher();
            command.arg(launcher.get_program()).args(launcher.get_args()).args(["-n", &ranks.to_string()]);
        }
        command.arg(winkler);
        environment(&mut command);
        command.args(words).arg("-o").arg(scratch.path().join("results")).current_dir(scratch.path());
        command.envs(variables.iter().copied()).env("OMPI_MCA_orte_tmpdir_base", scratch.path());
        let file = |name: &str| Stdio::from(File::create(scratch.path().join(name)).expect("a file"));
        command.stdin(Stdio::null()).stdout(file("out")).stderr(file("err"));
        let child = Guard(command.spawn().expect("the program"));
        Self { child, scratch }
    }

    /// Waits until something is there.
    fn until(&mut self, what: &str, is_there: impl Fn(&Path) -> bool) {
        let began = Instant::now();
        while !is_there(self.scratch.path()) {
            let ended = self.child.0.try_wait().expect("a child").map(|status| format!("ended with {status}"));
            let late = (began.elapsed() > Duration::from_secs(60)).then(|| "takes too long".to_owned());
            if let Some(why) = ended.or(late) {
                panic!("before {what} the program {why}\n{}", self.said());
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    fn until_rows(&mut self, rows: usize) {
        let count = |path: &Path| fs::read_to_string(path).map_or(0, |text| text.lines().count());
        self.until("its rows", |folder| count(&folder.join("results/history.csv")) > rows);
    }

    /// The processes that this one started, by their numbers.
    fn children(&self) -> Vec<u32> {
        let threads = fs::read_dir(format!("/proc/{}/task", self.child.0.id())).into_iter().flatten().flatten();
        let children = |thread: fs::DirEntry| fs::read_to_string(thread.path().join("children")).unwrap_or_default();
        let all: Vec<String> = threads.map(children).collect();
        all.join(" ").split_whitespace().map(|id| id.parse().expect("a number")).collect()
    }

    fn signal(&self, name: &str) {
        signal(self.child.0.id(), name);
    }

    fn said(&self) -> String {
        ["out", "err"].map(|name| fs::read_to_string(self.scratch.path().join(name)).unwrap_or_default()).concat()
    }

    /// Its exit status, which must come soon, and its folder.
    fn end(mut self) -> (ExitStatus, TempDir, String) {
        let began = Instant::now();
        loop {
            if let Some(status) = self.child.0.try_wait().expect("a child") {
                let said = self.said();
                return (status, self.scratch, said);
            }
            if began.elapsed() > Duration::from_secs(60) {
                let _ = self.child.0.kill();
                panic!("it does not end\n{}", self.said());
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

fn signal(id: u32, name: &str) {
    assert!(send(name, id), "no process {id} to send {name} to");
}

fn report(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("report.json")).expect("a report")).expect("JSON")
}

fn words<'a>(scene: &'a Path, args: &[&'a str]) -> Vec<&'a str> {
    [&["solve", scene.to_str().expect("a path")], args].concat()
}

/// Goes on in the same folder.
fn restart(scratch: &TempDir, ranks: usize, scene: &Path, args: &[&str]) -> Run {
    let from = scratch.path().join("results").display().to_string();
    solve_on(ranks, scene, &[args, &["--restart", &from]].concat())
}

#[test]
fn a_signal_ends_a_run_with_its_results() {
    let scene = case("groove");
    for (name, code) in [("INT", 130), ("TERM", 143), ("HUP", 129)] {
        let mut run = Working::start(&words(&scene, &ENDLESS), 1);
        run.until_rows(5);
        run.signal(name);
        let (status, scratch, said) = run.end();
        assert_eq!(status.code(), Some(code), "{said}");
        let folder = scratch.path().join("results");
        let report = report(&folder);
        assert_eq!(report["status"], "interrupted");
        assert!(report["message"].as_str().is_some_and(|text| text.contains(&format!("SIG{name}"))), "{report}");
        let rows = fs::read_to_string(folder.join("history.csv")).expect("a history").lines().count() - 1;
        assert_eq!(report["iterations"], rows - 1);
        // the tables are those of the last row: a run that may make as many iterations has the same
        let limit = format!("method.stop={{residual=1e-12,iterations={}}}", rows - 1);
        let same = solve(&scene, &["--set", "method.gamma=1e-6", "--set", &limit]);
        assert_eq!(same.report["status"], "iteration-limit");
        let table = |folder: &Path| fs::read_to_string(folder.join("contact-lower-upper.csv")).expect("a table");
        assert_eq!(table(&folder), table(&same.folder));
        assert_eq!(report["residual"], same.report["residual"]);
        assert_eq!(report["files"], same.report["files"]);
    }
}

/// A solve that never ends hears one signal, and ends by the second.
#[test]
fn a_second_signal_ends_at_once() {
    let stuck = ["-ksp_type", "richardson", "-pc_type", "none", "-ksp_rtol", "1e-14", "-ksp_max_it", "2000000000"];
    let scene = case("groove");
    let args = [&ENDLESS[..], &["-ksp_richardson_scale", "1e-12"], &stuck].concat();
    let mut run = Working::start(&words(&scene, &args), 1);
    // the extension of the start is the first solve; the table of rows is there before it
    run.until("the history", |folder| folder.join("results/history.csv").exists());
    std::thread::sleep(Duration::from_millis(300));
    run.signal("INT");
    std::thread::sleep(Duration::from_millis(300));
    assert!(run.child.0.try_wait().expect("a child").is_none(), "the first signal waits for the step\n{}", run.said());
    run.signal("TERM");
    let (status, scratch, said) = run.end();
    assert_eq!(status.code(), Some(143), "{said}");
    assert!(!scratch.path().join("results/report.json").exists());
}

/// METIS catches SIGTERM, and SIGABRT, which nothing else catches, while it works. SIGTERM ends the run all the same.
#[test]
fn a_library_takes_no_signal() {
    let scene = case("patch-3d");
    let mesh = ["--set", "mesh.set={nl=20,nu=19}", "--set", "solver=condensed"];
    let mut run = Working::start(&words(&scene, &mesh), 1);
    let status = format!("/proc/{}/status", run.child.0.id());
    let is_caught = || {
        let text = fs::read_to_string(&status).unwrap_or_default();
        let mask = text.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigCgt:")?.trim(), 16).ok());
        mask.is_some_and(|mask| mask >> (6 - 1) & 1 == 1)
    };
    run.until("METIS", |_| is_caught());
    run.signal("TERM");
    let (status, _, said) = run.end();
    assert_eq!(status.code(), Some(143), "{said}");
}

/// A run that was killed within its load steps goes on after the last one that ended.
#[test]
fn a_killed_run_goes_on_to_the_same_end() {
    let (groove, held) = (case("groove"), case("groove-held"));
    let newton = ["--method", "newton", "--set", "mesh.set.n=8", "--set", "method.stop={residual=1e-10}"];
    let steps = [&newton[..], &["--set", "method.steps=40"]].concat();
    let swept = [&SHORT[..], &["--set", "method.steps=[0.5,1]"]].concat();
    let high = [&steps[..], &["--set", "body.0.order=4", "--set", "body.1.order=5"]].concat();
    let cases: [(&Path, &[&str], f64); 3] = [(&groove, &swept, 1e-6), (&held, &steps, 1e-8), (&held, &high, 1e-8)];
    for (scene, args, most) in cases {
        let whole = solve(scene, args).converged();
        let rows = whole.history().rows();
        let mut run = Working::start(&words(scene, args), 1);
        run.until_rows(2 * rows / 3);
        // it may have come to its end meanwhile, and has no checkpoint then
        let _ = run.child.0.kill();
        let (_, scratch, _) = run.end();
        if !scratch.path().join("results/checkpoint").exists() {
            assert_eq!(report(&scratch.path().join("results"))["status"], "converged");
            continue;
        }
        let again = restart(&scratch, 1, scene, args).converged();
        assert!(again.history().rows() < rows, "{args:?}");
        let (ours, theirs) = (again.contact(), whole.contact());
        assert!(distance(&ours["pressure"], &theirs["pressure"]) <= most, "{args:?}");
        let steps = |run: &Run| run.report["steps"].as_array().expect("a list").len();
        assert_eq!(steps(&again), steps(&whole));
    }
}

/// A rank that is killed at any moment ends the others within seconds.
#[test]
fn a_killed_rank_ends_all() {
    let (scene, sets) = (case("groove3d"), ["--method", "newton", "--set", "solver=hypre", "--set", "mesh.set.n=20"]);
    let mut killed = 0;
    for wait in [30, 200, 500] {
        let mut run = Working::start(&words(&scene, &sets), 3);
        run.until("its ranks", |_| true);
        std::thread::sleep(Duration::from_millis(wait));
        let Some(&rank) = run.children().last() else { continue };
        // it may have come to its end meanwhile
        if !send("KILL", rank) {
            continue;
        }
        let began = Instant::now();
        let (status, _, said) = run.end();
        assert!(!status.success() && began.elapsed() < Duration::from_secs(5), "{wait}: {said}");
        killed += 1;
    }
    assert!(killed > 0);
}

/// A run that a signal ended has a checkpoint, which any number of ranks and any method can take; one that is solved has none left.
#[test]
fn an_interrupted_run_goes_on_with_other_ranks() {
    let scene = case("groove");
    for (ranks, then) in [(1, 2), (2, 1)] {
        let slow = [&["--set", "method.gamma=1e-2"], &SHORT[4..], &ENDLESS[2..]].concat();
        let mut run = Working::start(&words(&scene, &slow), ranks);
        run.until_rows(50);
        // any rank may hear it
        let heard = if ranks > 1 { *run.children().last().expect("a rank") } else { run.child.0.id() };
        signal(heard, "TERM");
        let (status, scratch, said) = run.end();
        assert_eq!(status.code(), Some(143), "{said}");
        let stopped = report(&scratch.path().join("results"));
        assert_eq!(
            (&stopped["status"], &stopped["ranks"]),
            (&Value::from("interrupted"), &Value::from(ranks)),
            "{said}"
        );
        let stop = ["--set", "method.gamma=1e-2", "--set", "mesh.set.n=8", "--set"];
        let short = [&stop[..], &["method.stop={residual=1e-12,iterations=1}"]].concat();
        let again = restart(&scratch, then, &scene, &short);
        // it begins where the other ended
        let (first, last) = (again.history()["residual"][0], stopped["residual"].as_f64().expect("a number"));
        assert!((first / last - 1.0).abs() < 1e-2, "{first} {last}");
        let solved = restart(&scratch, then, &scene, &["--method", "newton", "--set", "mesh.set.n=8"]).converged();
        assert_eq!(solved.count("ranks"), then);
        let whole = solve(&scene, &["--method", "newton", "--set", "mesh.set.n=8"]).converged();
        assert!(distance(&solved.contact()["pressure"], &whole.contact()["pressure"]) < 1e-6);
    }
}

#[test]
fn a_checkpoint_of_something_else_is_refused() {
    let scene = case("groove");
    let mut run = Working::start(&words(&scene, &[&SHORT[4..], &ENDLESS].concat()), 1);
    run.until_rows(2);
    run.signal("INT");
    let (_, scratch, _) = run.end();
    let refused = |run: Run, code: i32, words: &str| {
        assert_eq!(run.code, code, "{}", run.said());
        assert!(run.stderr.contains(words), "{}", run.said());
        assert!(run.report.is_null());
    };
    let args = |set: &'static str, n: &'static str| ["--set", set, "--set", n];
    let other = "another scene or mesh";
    refused(restart(&scratch, 1, &scene, &args("body.0.young=1e5", "mesh.set.n=8")), 3, other);
    refused(restart(&scratch, 1, &scene, &args("method.gamma=1e-6", "mesh.set.n=9")), 3, other);
    refused(restart(&scratch, 1, &scene, &args("method.steps=2", "mesh.set.n=8")), 3, other);
    // another mesh by the same settings
    let geo = fs::read_to_string(root().join("meshes/groove/groove.geo")).expect("a script");
    fs::write(scratch.path().join("groove.geo"), geo.replace("length = 4", "length = 5")).expect("a file");
    let moved = text_of("groove")
        .replace(&root().join("meshes/groove").display().to_string(), &scratch.path().display().to_string());
    refused(restart(&scratch, 1, &Scene::new(moved).path, &args("method.gamma=1e-6", "mesh.set.n=8")), 3, other);
    let file = scratch.path().join("results/checkpoint");
    let mut bytes = fs::read(&file).expect("a checkpoint");
    let before = [b"winkler checkpoint 3", &bytes[20..]].concat();
    fs::write(&file, before).expect("a file");
    refused(restart(&scratch, 1, &scene, &args("method.gamma=1e-6", "mesh.set.n=8")), 6, "another version");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&file, &bytes).expect("a file");
    refused(restart(&scratch, 1, &scene, &args("method.gamma=1e-6", "mesh.set.n=8")), 6, "is damaged");
    fs::remove_file(&file).expect("a file");
    refused(restart(&scratch, 1, &scene, &args("method.gamma=1e-6", "mesh.set.n=8")), 6, "cannot read");
}

/// A script that sleeps: while Gmsh works a signal ends it, and nothing is left in the cache.
#[test]
fn a_signal_ends_gmsh() {
    let scratch = TempDir::new().expect("a temporary folder");
    let geo = fs::read_to_string(root().join("meshes/groove/groove.geo")).expect("a script");
    let (script, cache) = (scratch.path().join("slow.geo"), scratch.path().join("cache"));
    fs::write(&script, geo + "\nSleep 60;\n").expect("a file");
    let scene = scratch.path().join("scene.toml");
    let text = text_of("groove")
        .replace(&root().join("meshes/groove/groove.geo").display().to_string(), &script.display().to_string());
    fs::write(&scene, text).expect("a file");
    let path = scene.display().to_string();
    let mut run = Working::start_in(scratch, &["solve", &path], 1, &[("WINKLER_CACHE", &cache)]);
    run.until("Gmsh", |folder| fs::read_dir(folder.join("cache")).is_ok_and(|mut all| all.next().is_some()));
    while run.children().is_empty() {
        std::thread::sleep(Duration::from_millis(2));
    }
    let gmsh = run.children()[0];
    run.signal("TERM");
    let began = Instant::now();
    let (status, scratch, text) = run.end();
    assert_eq!(status.code(), Some(143), "{text}");
    assert!(began.elapsed() < Duration::from_secs(30), "it waited for Gmsh");
    assert!(text.contains("SIGTERM"), "{text}");
    assert!(!Path::new(&format!("/proc/{gmsh}")).exists(), "Gmsh goes on");
    let left = |name: &str| fs::read_dir(scratch.path().join(name)).expect("a folder").count();
    assert_eq!([left("cache"), left("results")], [0, 0]);
}

#[test]
fn a_sweep_that_is_ended_has_its_rows() {
    let path = case("groove").display().to_string();
    let stop = "method.stop={residual=1e-9,iterations=100000000}";
    let over = ["sweep", &path, "--set", "mesh.set.n=8", "--set", stop, "--over", "method.gamma=0.6,1e-7,0.5"];
    let mut run = Working::start(&over, 1);
    let rows =
        |folder: &Path| fs::read_to_string(folder.join("results/sweep.csv")).map_or(0, |text| text.lines().count());
    run.until("the first run", |folder| rows(folder) == 2);
    std::thread::sleep(Duration::from_millis(200));
    run.signal("HUP");
    let (status, scratch, said) = run.end();
    assert_eq!(status.code(), Some(129), "{said}");
    let text = fs::read_to_string(scratch.path().join("results/sweep.csv")).expect("a table");
    let lines: Vec<&str> = text.lines().skip(1).collect();
    assert_eq!(lines.len(), 2, "{text}");
    assert!(lines[0].starts_with("0.6,converged") && lines[1].starts_with("1e-7,interrupted"), "{text}");
    assert!(scratch.path().join("results/pressure.svg").exists());
}

#[test]
fn a_standard_output_that_takes_nothing_is_told_of() {
    let path = case("groove").display().to_string();
    for args in [&["solve", &path, "--json"][..], &["check", &path], &["mesh", &path, "--json"], &["--help"]] {
        let folder = TempDir::new().expect("a temporary folder");
        let mut command = Command::new("sh");
        command.args(["-c", "exec \"$@\" > /dev/full", "sh", env!("CARGO_BIN_EXE_winkler")]).args(args);
        environment(&mut command);
        let (status, _, stderr) = output(
            {
                command.current_dir(folder.path());
                command
            },
            Duration::from_secs(60),
        );
        assert_eq!(status.code(), Some(6), "{args:?} {stderr}");
        assert!(stderr.contains("standard output"), "{stderr}");
        // what could be written is there
        assert_eq!(folder.path().join("results/groove/report.json").exists(), args[0] == "solve");
    }
}

#[test]
fn devices_and_pipes_are_no_input() {
    let scratch = TempDir::new().expect("a temporary folder");
    let pipe = scratch.path().join("pipe.msh");
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
    let name = pipe.display().to_string();
    let refused = |run: &Run, code: i32, words: [&str; 2]| {
        assert_eq!(run.code, code, "{}", run.said());
        assert!(words.iter().all(|word| run.stderr.contains(word)), "{}", run.said());
    };
    refused(&solve("/dev/zero", &[]), 6, ["/dev/zero", "a device"]);
    refused(&solve(&pipe, &[]), 6, [&name, "a pipe"]);
    refused(&solve(case("groove"), &["--set", &format!("mesh=\"{name}\"")]), 3, [&name, "not a file"]);
    refused(&solve(case("groove"), &["-options_file", &name]), 6, [&name, "a pipe"]);
    let bench = crate::common::winkler(&["bench", &case("groove").display().to_string(), "--against", &name]);
    refused(&bench, 6, [&name, "Not a directory"]);
}
