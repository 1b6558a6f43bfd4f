//! Programs that run with limits of time and memory, and end with this program.

use crate::file::bytes_in_proc;
use crate::interrupt::Interrupt;
use crate::problem::mesh::Guard;
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};
use std::time::{Duration, Instant};

/// The way in which a guarded program ended.
pub enum End {
    /// It ended by itself.
    Itself(ExitStatus),
    /// It exceeded the limit of time.
    TimedOut,
    /// It wrote more output than anybody reads.
    Talked,
    /// This signal requested the end.
    Asked(i32),
}

/// Return the path of a program in $PATH.
pub fn find(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).map(|folder| folder.join(name)).find(|program| is_program(program))
}

/// Return whether a path is a file that somebody may execute.
fn is_program(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|data| data.is_file() && data.permissions().mode() & 0o111 != 0)
}

/// Return the bytes of memory that a guarded program may take: the user's limit, or else the memory that is available. Return
/// `None`, which is no limit, if the system does not tell.
pub fn bytes(guard: &Guard) -> Option<u64> {
    match guard.gigabytes {
        Some(gigabytes) => Some((gigabytes * 1e9) as u64),
        // This is what programs can take without swapping.
        None => bytes_in_proc("/proc/meminfo", "MemAvailable"),
    }
}

/// Return a command for a program that may take at most `bytes` of memory. The system ends the program with the thread that
/// starts it. Tools of util-linux do both, and a limit whose tool is missing is omitted.
pub fn command(program: &Path, bytes: Option<u64>) -> Command {
    let mut words: Vec<PathBuf> = Vec::new();
    if let (Some(tool), Some(bytes)) = (find("prlimit"), bytes) {
        words.extend([tool, format!("--as={bytes}").into()]);
    }
    if let Some(tool) = find("setpriv") {
        words.extend([tool, "--pdeathsig".into(), "KILL".into()]);
    }
    words.push(program.to_owned());
    let mut command = Command::new(&words[0]);
    command.args(&words[1..]);
    command
}

/// Longest pause between two checks of the program.
const PAUSE: Duration = Duration::from_millis(100);

/// Largest number of bytes of output, which is half a million lines. Gmsh repeats some errors for ever, with 25 MB of them in a
/// second.
const MOST_SAID: u64 = 1 << 25;

/// Run a command until it ends, a signal arrives, it exceeds `limit` seconds, or its output is too long. The output goes to the
/// file `said`.
///
/// # Errors
/// The program cannot be started.
pub fn run(command: &mut Command, limit: f64, said: &Path, interrupt: &Interrupt) -> io::Result<End> {
    let began = Instant::now();
    let mut child = command.spawn()?;
    let end = loop {
        if let Some(status) = child.try_wait()? {
            break End::Itself(status);
        }
        let elapsed = began.elapsed();
        let asked = interrupt.asked().map(End::Asked);
        let talked = || std::fs::metadata(said).is_ok_and(|data| data.len() > MOST_SAID).then_some(End::Talked);
        let late = || (elapsed.as_secs_f64() > limit).then_some(End::TimedOut);
        if let Some(end) = asked.or_else(talked).or_else(late) {
            child.kill()?;
            child.wait()?;
            break end;
        }
        // At most a twentieth of the time so far is lost.
        std::thread::sleep((elapsed / 20).clamp(Duration::from_millis(1), PAUSE));
    };
    Ok(end)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sleep(bytes: Option<u64>) -> Command {
        let mut sleep = command(Path::new("/bin/sleep"), bytes);
        sleep.arg("5");
        sleep
    }

    #[test]
    fn programs_can_be_executed() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        let set = |mode| std::fs::set_permissions(file.path(), std::fs::Permissions::from_mode(mode)).expect("a mode");
        set(0o644);
        assert!(!is_program(file.path()));
        set(0o755);
        assert!(is_program(file.path()) && !is_program(Path::new("/bin")));
    }

    #[test]
    fn what_takes_too_long_or_too_much_is_ended() {
        let began = Instant::now();
        let silent = Path::new("");
        let ended = |command: &mut Command, limit| run(command, limit, silent, &Interrupt::default());
        assert!(matches!(ended(&mut sleep(None), 0.1), Ok(End::TimedOut)));
        assert!(began.elapsed() < Duration::from_secs(4));
        // No program can be loaded into a hundred kilobytes.
        assert!(matches!(ended(&mut sleep(Some(100_000)), 9.0), Ok(End::Itself(status)) if !status.success()));
        assert!(began.elapsed() < Duration::from_secs(4));
    }

    #[test]
    fn what_never_stops_to_talk_is_ended() {
        let said = tempfile::NamedTempFile::new().expect("a file");
        let mut yes = command(Path::new("/usr/bin/yes"), None);
        yes.stdout(said.reopen().expect("a file"));
        assert!(matches!(run(&mut yes, 60.0, said.path(), &Interrupt::default()), Ok(End::Talked)));
    }

    /// The system ends a program with the thread that started it, as it does when the whole process is killed.
    #[test]
    fn a_program_ends_with_its_parent() {
        let parent = || {
            let child = sleep(None).spawn().expect("a child");
            let name = || std::fs::read_to_string(format!("/proc/{}/comm", child.id())).unwrap_or_default();
            // Until it has this name, the process is one of the tools that start it.
            while name() != "sleep\n" {
                std::thread::sleep(Duration::from_millis(1));
            }
            child
        };
        let child = std::thread::spawn(parent).join();
        let mut child = child.expect("a child");
        let began = Instant::now();
        assert!(child.wait().is_ok_and(|status| !status.success()));
        assert!(began.elapsed() < Duration::from_secs(4));
    }
}
