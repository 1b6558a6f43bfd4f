//! What the documents tell a reader to type works.

use crate::common::{WINKLER, output, root};
use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;
use std::time::Duration;

/// Beginnings of lines that are commands of this program.
const COMMANDS: [&str; 3] = ["winkler ", "target/release/winkler ", "scripts/run "];

/// A command in a document.
struct Typed {
    /// Line where it begins.
    line: usize,
    /// The command, its continuation lines joined.
    text: String,
}

/// The commands in the `sh` blocks of a document.
fn commands(text: &str) -> Vec<Typed> {
    let mut found: Vec<Typed> = Vec::new();
    let (mut inside, mut open) = (false, false);
    for (number, line) in text.lines().enumerate() {
        let bare = line.trim();
        if bare.starts_with("```") {
            inside = !inside && bare == "```sh";
            open = false;
            continue;
        }
        if !inside {
            continue;
        }
        let (part, more) = bare.strip_suffix('\\').map_or((bare, false), |part| (part, true));
        // `mpiexec -n 2 winkler ...` is one of ours, too
        let words = match bare.strip_prefix("mpiexec -n ") {
            Some(rest) => rest.split_once(' ').map_or("", |(_, words)| words),
            None => bare,
        };
        if open {
            if let Some(last) = found.last_mut() {
                last.text = format!("{} {}", last.text.trim_end(), part.trim());
            }
        } else if COMMANDS.iter().any(|command| words.starts_with(command)) {
            found.push(Typed { line: number + 1, text: part.trim_end().to_owned() });
        } else {
            continue;
        }
        open = more;
    }
    found
}

/// A folder like the project's, with the program under the names that readers type.
fn scratch() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let base = folder.path();
    copy(&root().join("meshes"), &base.join("meshes"));
    for name in ["bin", "scripts", "target/release"] {
        fs::create_dir_all(base.join(name)).expect("a folder");
    }
    symlink(WINKLER, base.join("bin/winkler")).expect("a link");
    symlink(WINKLER, base.join("target/release/winkler")).expect("a link");
    // what scripts/run does after set-up and build
    let run = base.join("scripts/run");
    fs::write(&run, "#!/bin/sh\nexec winkler solve \"$@\"\n").expect("a script");
    fs::set_permissions(&run, fs::Permissions::from_mode(0o755)).expect("a script that runs");
    folder
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder");
    for entry in fs::read_dir(from).expect("a folder").flatten() {
        let (from, to) = (entry.path(), to.join(entry.file_name()));
        if from.is_dir() {
            copy(&from, &to);
        } else {
            fs::copy(&from, &to).expect("a copy");
        }
    }
}

/// Runs the commands of a document in order; gives what failed.
fn failures(document: &Path, commands: &[Typed]) -> Vec<String> {
    let folder = scratch();
    let path = std::env::var("PATH").unwrap_or_default();
    let run = |typed: &Typed| {
        let mut shell = Command::new("bash");
        crate::common::environment(&mut shell);
        shell.env("PATH", format!("{}:{path}", folder.path().join("bin").display()));
        shell.current_dir(folder.path()).args(["-o", "pipefail", "-c", &typed.text]);
        let (status, _, complaint) = output(shell, Duration::from_secs(120));
        let place = format!("{}:{}", document.display(), typed.line);
        (!status.success()).then(|| format!("{place}: `{}` ended with {status}\n{complaint}", typed.text))
    };
    commands.iter().filter_map(run).collect()
}

fn documents() -> Vec<PathBuf> {
    let in_docs = fs::read_dir(root().join("docs")).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut found: Vec<PathBuf> = in_docs.filter(|path| path.extension().is_some_and(|end| end == "md")).collect();
    found.sort();
    found.insert(0, root().join("README.md"));
    found
}

#[test]
fn every_command_in_the_documents_works() {
    let mut seen: Vec<String> = Vec::new();
    let mut work = Vec::new();
    for document in documents() {
        let text = fs::read_to_string(&document).unwrap_or_else(|cause| panic!("{}: {cause}", document.display()));
        let mut typed = commands(&text);
        typed.retain(|typed| !seen.contains(&typed.text));
        seen.extend(typed.iter().map(|typed| typed.text.clone()));
        work.push((document, typed));
    }
    // documents at once, the commands of each in order
    let failed: Vec<String> = thread::scope(|scope| {
        let runs: Vec<_> = work.iter().map(|(document, typed)| scope.spawn(|| failures(document, typed))).collect();
        runs.into_iter().flat_map(|run| run.join().expect("a document was tried")).collect()
    });
    assert!(seen.iter().any(|text| text.starts_with("scripts/run ")), "the README begins with scripts/run");
    assert!(failed.is_empty(), "{} of {} commands fail:\n{}", failed.len(), seen.len(), failed.join("\n"));
}

#[test]
fn commands_are_found_in_their_blocks() {
    let text = "winkler no\n```sh\n# winkler no\nwinkler a \\\n    b  # c\ncd x\nscripts/run d\nmpiexec -n 2 winkler e\n\
                mpiexec -n 2 other\n```\nscripts/run no\n```text\nwinkler no\n```\n";
    let found: Vec<(usize, String)> = commands(text).into_iter().map(|typed| (typed.line, typed.text)).collect();
    let expected = [(4, "winkler a b  # c"), (7, "scripts/run d"), (8, "mpiexec -n 2 winkler e")];
    assert_eq!(found, expected.map(|(line, text)| (line, text.to_owned())));
}

/// Pieces of sources in the documents: blocks whose first line names their file, and that stand there line for line.
#[test]
fn the_pieces_of_sources_in_the_documents_are_those_of_the_sources() {
    let text = fs::read_to_string(root().join("docs/extending.md")).expect("a document");
    let blocks = text.split("```rust\n").skip(1).chain(text.split("```toml\n").skip(1));
    let mut seen = 0;
    for block in blocks.filter_map(|rest| rest.split("\n```").next()) {
        let (first, piece) = block.split_once('\n').expect("a file and its lines");
        let file = first.trim_start_matches(['/', '#', ' ']);
        let source = fs::read_to_string(root().join(file)).unwrap_or_else(|cause| panic!("{file}: {cause}"));
        assert!(source.contains(piece), "{file} has no longer\n{piece}");
        seen += 1;
    }
    assert!(seen > 10, "{seen}");
}

/// The job scripts of the documents run, with `mpiexec` in the place of `srun`, and save their state before their time is over.
#[test]
fn the_job_scripts_work() {
    let text = fs::read_to_string(root().join("docs/cluster.md")).expect("a document");
    let scripts: Vec<&str> = text.split("```text\n").filter_map(|block| block.split("```").next()).collect();
    let scripts: Vec<&str> = scripts.into_iter().filter(|script| script.starts_with("#!/bin/bash\n#SBATCH")).collect();
    assert_eq!(scripts.len(), 2);
    for script in scripts {
        let option = |name: &str| script.split_once(name).and_then(|(_, rest)| rest.split_whitespace().next());
        let time: Vec<u32> = option("--time=").expect("a time").split(':').map(|n| n.parse().expect("time")).collect();
        if let Some(minutes) = option("--checkpoint ") {
            let minutes: u32 = minutes.parse().expect("minutes");
            assert!(2 * minutes <= 60 * time[0] + time[1], "checkpoints every {minutes} minutes in {time:?}");
        }
        let folder = scratch();
        let base = folder.path();
        let srun = base.join("bin/srun");
        fs::write(&srun, "#!/bin/sh\nshift\nexec mpiexec -n 2 \"$@\"\n").expect("a script");
        fs::set_permissions(&srun, fs::Permissions::from_mode(0o755)).expect("a script that runs");
        let mut job = Command::new("bash");
        crate::common::environment(&mut job);
        job.env("PATH", format!("{}:{}", base.join("bin").display(), std::env::var("PATH").unwrap_or_default()));
        job.envs([("SLURM_JOB_ID", "7"), ("SLURM_ARRAY_JOB_ID", "7"), ("SLURM_ARRAY_TASK_ID", "1")]);
        job.env("SLURM_SUBMIT_DIR", base).env("OMPI_MCA_orte_tmpdir_base", base).current_dir(base).args(["-c", script]);
        let (status, _, complaint) = output(job, Duration::from_secs(120));
        assert!(status.success(), "{script}\nended with {status}\n{complaint}");
        let reports = fs::read_dir(base.join("results")).into_iter().flatten().flatten();
        assert_eq!(reports.filter(|folder| folder.path().join("report.json").is_file()).count(), 1, "{script}");
        assert!(base.join("cache").is_dir(), "{script}");
    }
}

/// A command that fails is reported with its place.
#[test]
fn a_wrong_command_fails() {
    let typed = |text: &str| Typed { line: 3, text: text.to_owned() };
    let wrong = [typed("winkler check meshes/patch/scene.toml"), typed("scripts/run meshes/pach/scene.toml | cat")];
    let failed = failures(Path::new("README.md"), &wrong);
    assert_eq!(failed.len(), 1, "{failed:?}");
    assert!(failed[0].starts_with("README.md:3: `scripts/run") && failed[0].contains("pach"), "{failed:?}");
}

/// Where there is no apt, `scripts/setup` names what is missing, and a PETSc of the user's own counts with its MPI and MUMPS. Gmsh is not
/// required.
#[test]
fn setup_without_apt_takes_the_users_own_petsc() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    for name in ["bin", "petsc/lib/pkgconfig", "petsc/include"] {
        fs::create_dir_all(path(name)).expect("a folder");
    }
    fs::write(path("petsc/include/dmumps_c.h"), "").expect("a header");
    let usual = std::env::var("PATH").expect("a path");
    for name in ["bash", "cat", "dirname", "env", "grep", "readlink", "sed", "sort", "tail"] {
        let tool = std::env::split_paths(&usual).map(|folder| folder.join(name)).find(|file| file.is_file());
        std::os::unix::fs::symlink(tool.expect(name), path("bin").join(name)).expect("a link");
    }
    for name in ["cargo", "cc", "mpicc", "pkg-config", "rustc"] {
        let program = path("bin").join(name);
        fs::write(&program, "#!/bin/sh\necho rustc 9.9.9\n").expect("a program");
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("a program that runs");
    }
    let setup = |variables: &[(&str, &str)]| {
        let mut command = Command::new("bash");
        command.arg(root().join("scripts/setup")).env("PATH", path("bin")).env("CARGO_HOME", path("none"));
        command.env("PETSC_DIR", path("petsc")).env_remove("PETSC_ARCH").env_remove("MPICC").env_remove("MUMPS_DIR");
        command.envs(variables.iter().copied());
        let (status, said, complaint) = output(command, Duration::from_secs(20));
        assert!(!complaint.contains("apt"), "{complaint}");
        (status.success(), said + &complaint)
    };
    let (is_ready, said) = setup(&[]);
    assert!(is_ready && said.contains("no gmsh in PATH"), "{said}");
    for (name, value, words) in [
        ("MPICC", "/nowhere/mpicc", "/nowhere/mpicc: the mpicc of the MPI"),
        ("PETSC_DIR", "/nowhere", "/nowhere/ has no lib/pkgconfig"),
    ] {
        let (is_ready, said) = setup(&[(name, value)]);
        assert!(!is_ready && said.contains(words), "{name}: {said}");
    }
}
