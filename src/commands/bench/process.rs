//! One run as a process of its own: its messages, its time and its memory.

use super::plan::usage;
use crate::commands::cases::Case;
use crate::commands::rows::CaseRow;
use crate::error::{Error, Kind, Result};
use crate::file::digest;
use crate::interrupt::{self, Interrupt};
use crate::linalg::range;
use crate::output::folder::{MARK, REPORT, is_made, refuse_link};
use crate::output::{Folder, Report, refuse_foreign, safe_name, write_whole};
use crate::parallel::launcher;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::fs::{self, File};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};
use wait4::{ResUse, Wait4};

/// The program that starts runs, and their limits.
pub(super) struct Runner {
    program: PathBuf,
    /// Folder of the results of all runs.
    folder: PathBuf,
    timeout: Duration,
    /// Number of runs of each case.
    repeat: usize,
    interrupt: Interrupt,
}

/// Name of the file with the output of a run.
const LOG: &str = "output.txt";

/// Time that a process gets to end itself.
const GRACE: Duration = Duration::from_secs(5);

/// Time between checks for a signal.
const CHECK_INTERVAL: Duration = Duration::from_millis(100);

/// Longest name of the folder of a run. Half as many characters, of at most four bytes, and 13 of the
/// digest are 253 bytes of the 255 that file systems allow.
const LONGEST_NAME: usize = 120;

impl Runner {
    /// Return a runner of this program, for runs below `folder`.
    ///
    /// # Errors
    /// A time limit that is no time, a system on which the path of the program cannot be found.
    pub fn new(interrupt: &Interrupt, timeout: f64, repeat: usize, folder: &Path) -> Result<Self> {
        let timeout = Duration::try_from_secs_f64(timeout)
            .ok()
            .filter(|timeout| !timeout.is_zero())
            .ok_or_else(|| usage(format!("`--timeout {timeout}` is no time in seconds")))?;
        let program =
            std::env::current_exe().map_err(|cause| Error::file(Path::new("this program"), "find", &cause))?;
        Ok(Self { program, folder: folder.join("runs"), timeout, repeat, interrupt: interrupt.clone() })
    }

    /// Return the folder of the results of a case.
    pub fn folder(&self, case: &Case) -> PathBuf {
        let name = safe_name(&case.key.join("_").replace(' ', "_"));
        if name.len() <= LONGEST_NAME {
            return self.folder.join(name);
        }
        let start: String = name.chars().take(LONGEST_NAME / 2).collect();
        self.folder.join(format!("{start}-{:.12}", digest(&name)))
    }

    /// Check that a case can have its folder, and that results to compare `against` are not among those that it
    /// replaces.
    ///
    /// # Errors
    /// A link or a log of another origin is in the way, or the results are those of the case.
    pub fn check(&self, case: &Case, against: Option<&Path>) -> Result<()> {
        let folder = self.folder(case);
        [&self.folder, &folder].into_iter().try_for_each(|path| refuse_link(path))?;
        if against
            .and_then(|against| against.canonicalize().ok())
            .is_some_and(|own| folder.canonicalize().ok() == Some(own))
        {
            return Err(usage(format!(
                "a run would replace the results in {}, which are to compare with",
                folder.display()
            ))
            .help("copy them, or name another folder with `-o`"));
        }
        refuse_foreign(&folder.join(LOG))
    }

    /// Make the mesh of a case with these overrides. A failure is not reported here, since the run itself fails in the
    /// same way.
    pub fn mesh(&self, case: &Case, overrides: &[String]) -> Result<()> {
        let mut command = Command::new(&self.program);
        command.arg("mesh").arg(&case.scene);
        command.args(overrides.iter().flat_map(|text| ["--set", text]));
        self.finish(command, &self.folder(case)).map(|_| ())
    }

    /// Run a case as often as asked for, or until it fails, and return its row: that of the first run that failed, else
    /// of the first, with the medians of all times.
    pub fn repeat(&self, case: &Case, ranks: usize) -> Result<CaseRow> {
        let mut rows = Vec::new();
        while rows.len() < self.repeat && rows.iter().all(CaseRow::is_good) {
            rows.push(self.run(case, ranks)?);
        }
        let of = |number: fn(&CaseRow) -> Option<f64>| median(rows.iter().filter_map(number).collect());
        let times: Vec<f64> = rows.iter().filter_map(|row| row.seconds).collect();
        let seconds = of(|row| row.seconds);
        let [least, most] = range(times.iter().copied());
        let spread = seconds.map(|middle| (most - least) / middle);
        Ok(CaseRow {
            runs: rows.len(),
            seconds,
            spread: spread.filter(|_| rows.len() > 1),
            mesh_seconds: of(|row| row.mesh_seconds),
            discretize_seconds: of(|row| row.discretize_seconds),
            set_up_seconds: of(|row| row.set_up_seconds),
            iterate_seconds: of(|row| row.iterate_seconds),
            factor_seconds: of(|row| row.factor_seconds),
            solve_seconds: of(|row| row.solve_seconds),
            cpu_seconds: of(|row| row.cpu_seconds),
            memory_mb: of(|row| row.memory_mb),
            ..rows.iter().find(|row| !row.is_good()).or(rows.first()).cloned().unwrap_or_default()
        })
    }

    fn run(&self, case: &Case, ranks: usize) -> Result<CaseRow> {
        let folder = self.folder(case);
        let mut command = match ranks {
            1 => Command::new(&self.program),
            ranks => {
                let mut command = launcher();
                command.args(["-n", &ranks.to_string()]).arg(&self.program);
                command
            }
        };
        command.arg("solve").arg(&case.scene).arg("-o").arg(&folder);
        command.args(case.overrides.iter().flat_map(|text| ["--set", text])).args(&case.petsc);
        // one thread for each rank, unless the user has set another number: otherwise the threads of solvers are
        // compared
        for name in ["OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"] {
            if std::env::var_os(name).is_none() {
                command.env(name, "1");
            }
        }
        // results of an earlier run must not be taken for those of this run
        Folder::create(&folder)?.clear()?;
        let ended = self.finish(command, &folder)?;
        let report = fs::read(folder.join(REPORT)).ok().filter(|_| is_made(&folder.join(REPORT)));
        let report = report.map(|bytes| serde_json::from_slice::<Report>(&bytes));
        let row = match (ended.used.as_ref(), report) {
            (None, _) => CaseRow::unsolved("failed", &ended.output),
            _ if ended.is_late => CaseRow::unsolved("timeout", &format!("not ended after {:?}", self.timeout)),
            (_, Some(Ok(report))) => CaseRow::from(&report),
            (_, Some(Err(cause))) => CaseRow::unsolved("failed", &format!("its report cannot be read: {cause}")),
            (Some(used), None) => CaseRow::unsolved(status_of(used.status), &message(&ended.output, used.status)),
        };
        let cpu = |used: &ResUse| (used.rusage.utime + used.rusage.stime).as_secs_f64();
        Ok(CaseRow {
            seconds: Some(ended.seconds).filter(|seconds| seconds.is_finite()),
            cpu_seconds: ended.used.as_ref().map(cpu),
            memory_mb: ended.used.as_ref().map(|used| used.rusage.maxrss as f64 / 1e6),
            ..row
        })
    }

    /// Start a process, wait for it, and end it when its time is over. Its output goes to [`LOG`] in the folder, behind
    /// a line with its command.
    fn finish(&self, mut command: Command, folder: &Path) -> Result<Ended> {
        fs::create_dir_all(folder).map_err(|cause| Error::file(folder, "create the folder", &cause))?;
        let path = folder.join(LOG);
        let failed = |cause: std::io::Error| Error::file(&path, "write", &cause);
        write_whole(&path, |out| writeln!(out, "{MARK}: {command:?}"))?;
        let file = File::options().append(true).open(&path).map_err(failed)?;
        let both = file.try_clone().map_err(failed)?;
        command.stdin(Stdio::null()).stdout(file).stderr(both);
        let began = Instant::now();
        let child = match command.spawn() {
            Ok(child) => child,
            Err(cause) => {
                let output = format!("cannot start {}: {cause}", command.get_program().display());
                return Ok(Ended { used: None, is_late: false, seconds: f64::NAN, output });
            }
        };
        let (answer, is_late) = self.wait(child, began);
        if let Some(signal) = self.interrupt.asked() {
            let message = format!("ended by {}: the rows so far are kept", interrupt::name(signal));
            return Err(Error::new(Kind::Stopped(signal), message));
        }
        let seconds = began.elapsed().as_secs_f64();
        let log = String::from_utf8_lossy(&fs::read(&path).unwrap_or_default()).into_owned();
        let output = log.split_once('\n').map_or(String::new(), |(_, output)| output.to_owned());
        Ok(Ended { used: answer.ok().and_then(|used| used.ok()), is_late, seconds, output })
    }

    /// Wait for a process. If its time is over or a signal has come, it is ended. Return its answer, and whether it had
    /// to be ended.
    fn wait(&self, mut child: Child, began: Instant) -> (Answer, bool) {
        let id = Pid::from_raw(child.id() as i32);
        let (send, receive) = mpsc::channel();
        // the thread reports the end of the process at once, without polling
        std::thread::spawn(move || send.send(child.wait4()));
        let is_running = |answer: &Answer| matches!(answer, Err(RecvTimeoutError::Timeout));
        let mut answer = receive.recv_timeout(CHECK_INTERVAL.min(self.timeout));
        while is_running(&answer) && began.elapsed() < self.timeout && self.interrupt.asked().is_none() {
            answer = receive.recv_timeout(CHECK_INTERVAL.min(self.timeout.saturating_sub(began.elapsed())));
        }
        let is_late = is_running(&answer);
        for signal in [Signal::SIGTERM, Signal::SIGKILL] {
            if is_running(&answer) {
                // the process may have ended meanwhile
                let _ = kill(id, signal);
                answer = receive.recv_timeout(GRACE);
            }
        }
        (answer, is_late)
    }
}

/// The answer of the thread that waits for a process.
type Answer = Result<std::io::Result<ResUse>, RecvTimeoutError>;

struct Ended {
    /// Resources that it used; `None` if it could not be started or waited for.
    used: Option<ResUse>,
    is_late: bool,
    seconds: f64,
    /// Its standard output and standard error.
    output: String,
}

/// Return the median of some numbers, which is the mean of the two middle ones if their count is even.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => None,
        count if count.is_multiple_of(2) => Some(0.5 * (values[middle - 1] + values[middle])),
        _ => Some(values[middle]),
    }
}

/// Return the status of a run without a report.
fn status_of(status: ExitStatus) -> &'static str {
    match (status.code(), status.signal()) {
        (_, Some(_)) => "killed",
        (Some(2..=6), _) => "refused",
        _ => "failed",
    }
}

/// Return the message of a process without a report: its errors with their advice, or else a line of its output.
fn message(output: &str, status: ExitStatus) -> String {
    let mut found: Vec<&str> = Vec::new();
    for line in output.lines() {
        let text = line.trim_start_matches([' ', '|', '=']).trim();
        let is_error = line.starts_with("error");
        if is_error || (!found.is_empty() && (text.starts_with("help:") || text.starts_with("note:"))) {
            found.push(text);
        }
    }
    let mut lines = output.lines().map(str::trim).filter(|line| line.contains(char::is_alphabetic));
    // messages of mpiexec begin with a rule, and their first line says what is wrong
    let line = if output.trim_start().starts_with("---") { lines.next() } else { lines.next_back() };
    match (found.is_empty(), line) {
        (false, _) => found.join("; "),
        (true, Some(line)) => format!("{status}: {line}"),
        (true, None) => status.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle() {
        assert_eq!(median(vec![5.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 2.0, 100.0]), Some(3.0));
        assert_eq!(median(Vec::new()), None);
    }

    #[test]
    fn refusals_are_reported_in_their_words() {
        let output = "-----\nmpiexec has detected an attempt to run as root.\n\nmore\n-----\n";
        assert!(
            message(output, ExitStatus::from_raw(1 << 8))
                .ends_with("1: mpiexec has detected an attempt to run as root.")
        );
        assert!(message("one\n  two\n---\n", ExitStatus::from_raw(1 << 8)).ends_with("1: two"));
        let output = "Title\nerror: PETSc knows no option -ksp_tpye\n |\n = help: did you mean -ksp_type?\n";
        let status = ExitStatus::from_raw(5 << 8);
        assert_eq!(message(output, status), "error: PETSc knows no option -ksp_tpye; help: did you mean -ksp_type?");
        assert_eq!(status_of(status), "refused");
        assert_eq!(status_of(ExitStatus::from_raw(9)), "killed");
        assert!(message("Terminated\n\n", ExitStatus::from_raw(9)).contains("Terminated"));
    }
}
