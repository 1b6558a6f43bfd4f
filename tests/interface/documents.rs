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

/// The anchor that a heading has: its words in small letters, joined by hyphens, without other signs.
fn anchor(heading: &str) -> String {
    let bare: String =
        heading.trim().to_lowercase().chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c)).collect();
    bare.replace(' ', "-")
}

/// The lines of a document outside its blocks of code, with their numbers.
fn prose(text: &str) -> Vec<(usize, &str)> {
    let mut inside = false;
    let mut is_prose = |line: &str| {
        inside ^= line.trim_start().starts_with("```");
        !inside
    };
    text.lines().enumerate().filter(|(_, line)| is_prose(line)).map(|(at, line)| (at + 1, line)).collect()
}

/// The links of a document to other files and headings that lead nowhere.
fn lost_links(document: &Path) -> Vec<String> {
    let text = fs::read_to_string(document).expect("a document");
    // a link may go over the end of a line
    let joined: String = prose(&text).into_iter().map(|(_, line)| format!("{line}\n")).collect();
    let targets = joined.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(target, _)| target);
    let is_lost = |target: &&str| {
        let (file, heading) = target.split_once('#').unwrap_or((target, ""));
        let path = if file.is_empty() { document.to_owned() } else { document.with_file_name("").join(file) };
        if heading.is_empty() {
            return !path.exists();
        }
        let there = fs::read_to_string(&path).unwrap_or_default();
        !prose(&there).iter().any(|(_, line)| line.starts_with('#') && anchor(line.trim_start_matches('#')) == heading)
    };
    let local = targets.filter(|target| !target.contains("://"));
    local.filter(is_lost).map(|target| format!("{}: {target}", document.display())).collect()
}

#[test]
fn links_lead_somewhere() {
    let others = ["CONTRIBUTING.md", "CHANGELOG.md"].map(|name| root().join(name));
    let lost: Vec<String> = documents().iter().chain(&others).flat_map(|document| lost_links(document)).collect();
    assert!(lost.is_empty(), "links lead nowhere:\n{}", lost.join("\n"));
}

/// A page that the sources name, for readers of a message or a comment, exists.
#[test]
fn pages_that_sources_name_exist() {
    let mut folders = ["src", "examples", "scripts", "tests"].map(|name| root().join(name)).to_vec();
    let mut lost = Vec::new();
    while let Some(folder) = folders.pop() {
        for path in fs::read_dir(&folder).expect("a folder").flatten().map(|entry| entry.path()) {
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let text = fs::read_to_string(&path).unwrap_or_default();
            let pages = text.split("docs/").skip(1).filter_map(|rest| rest.split_once(".md")).map(|(page, _)| page);
            let is_name = |page: &&str| !page.is_empty() && page.chars().all(|c| c.is_ascii_lowercase() || c == '-');
            let missing = pages.filter(is_name).filter(|page| !root().join(format!("docs/{page}.md")).exists());
            lost.extend(missing.map(|page| format!("{}: docs/{page}.md", path.display())));
        }
    }
    assert!(lost.is_empty(), "pages that do not exist:\n{}", lost.join("\n"));
}

/// The tables of keys and options are those that the program prints.
#[test]
fn the_reference_is_up_to_date() {
    let mut script = Command::new(root().join("scripts/reference"));
    script.args(["--check", WINKLER]);
    let (status, _, complaint) = output(script, Duration::from_secs(60));
    assert!(status.success(), "{complaint}");
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
