//! A run removes, replaces and follows nothing that it has not made: files of users, of other programs, and links.

use crate::common::{Run, case, solve, text_of, winkler};
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

/// All that is in a folder: contents of files, targets of links, and folders.
fn tree(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder").flatten() {
        let (path, kind) = (entry.path(), entry.file_type().expect("a kind"));
        let what = if kind.is_symlink() {
            fs::read_link(&path).expect("a link").into_os_string().into_encoded_bytes()
        } else if kind.is_dir() {
            found.extend(tree(&path));
            Vec::new()
        } else {
            fs::read(&path).expect("a file")
        };
        found.insert(path, what);
    }
    found
}

/// A run of a small scene with all kinds of results into a folder.
fn small(folder: &Path) -> Run {
    let out = folder.to_str().expect("a path");
    let scene = case("groove-held").display().to_string();
    let words = ["solve", &scene, "-o", out, "-q", "--set", "mesh.set.n=4", "--set", "method={}"];
    winkler(&[&words[..], &["--set", "method.steps=2", "--vtu", "--msh", "--report"]].concat())
}

fn refused(run: &Run, words: &[&str]) {
    assert!(run.code == 6 && words.iter().all(|word| run.stderr.contains(word)), "{words:?} {}", run.said());
}

#[test]
fn what_others_have_made_stays() {
    let scratch = tempfile::tempdir().expect("a folder");
    let path = |name: &str| scratch.path().join(name);
    let first = path("first");
    assert_eq!(small(&first).code, 0);
    let results: Vec<PathBuf> = tree(&first).into_keys().filter(|path| path.is_file()).collect();
    let names: Vec<&Path> = results.iter().map(|path| path.strip_prefix(&first).expect("a name")).collect();
    assert!(names.len() > 12 && names.contains(&Path::new("steps/lower-1.vtu")), "{names:?}");
    // each kind of result alone, as a file, as a folder and as a link to a file, which may be a result elsewhere
    let kinds =
        ["report.json", "history.csv", "contact-lower-upper.csv", "lower.msh", "steps/lower-1.vtu", "checkpoint"];
    for (number, name) in kinds.into_iter().enumerate() {
        let out = path(&format!("out{number}"));
        fs::create_dir_all(out.join("steps")).expect("a folder");
        let (file, target) = (out.join(name), first.join("history.csv"));
        match number % 3 {
            0 => fs::write(&file, r#"{"files": ["thesis.tex"]}"#).expect("a file"),
            1 => fs::create_dir(&file).expect("a folder"),
            _ => symlink(&target, &file).expect("a link"),
        }
        fs::write(out.join("thesis.tex"), "mine").expect("a file");
        let before = (tree(&out), tree(&first));
        refused(&small(&out), &[name, "winkler has not made it", "`-o`"]);
        assert_eq!((tree(&out), tree(&first)), before, "{name}");
    }
    // results are replaced, also without a report, as after a kill; others beside them stay
    fs::remove_file(first.join("report.json")).expect("the report");
    fs::write(first.join("steps/mine.vtu"), "mine").expect("a file");
    assert_eq!(small(&first).code, 0);
    assert_eq!(small(&first).code, 0);
    assert_eq!(fs::read_to_string(first.join("steps/mine.vtu")).expect("a file"), "mine");
}

#[test]
fn inputs_are_no_results() {
    let scratch = tempfile::tempdir().expect("a folder");
    let path = |name: &str| scratch.path().join(name);
    let words = |name: &str| path(name).display().to_string();
    let mesh = |scene: &str, to: &str| winkler(&["mesh", scene, "-o", to, "--set", "mesh.set.n=4"]);
    let groove = case("groove-held").display().to_string();
    // a mesh is replaced if it is one of this program, and not the input
    let part = words("lower.msh");
    assert_eq!([mesh(&groove, &part).code, mesh(&groove, &part).code], [0, 0]);
    refused(&winkler(&["mesh", &part, "-o", &part]), &["lower.msh is an input of this command"]);
    fs::write(path("other.msh"), "$MeshFormat\n").expect("a file");
    refused(&mesh(&groove, &words("other.msh")), &["other.msh", "winkler has not made it"]);
    let text = text_of("groove-held");
    let line = text.lines().find(|line| line.starts_with("mesh =")).expect("a mesh");
    symlink("lower.msh", path("link.msh")).expect("a link");
    fs::write(path("scene.toml"), text.replace(line, "mesh = \"link.msh\"")).expect("a scene");
    let steps = "method = { steps = { table = \"history.csv\" } }\nmesh =";
    let table = text.split("\n[method]").next().expect("a scene").replacen("mesh =", steps, 1);
    fs::write(path("history.toml"), table.replace("pressure = ", "path = \"a\", pressure = ")).expect("a scene");
    fs::write(path("history.csv"), "a\n0.5\n1\n").expect("a table");
    let before = tree(scratch.path());
    let run = |scene: &str, more: &[&str]| winkler(&[&["solve", &words(scene), "-o", &words("")][..], more].concat());
    refused(&run("scene.toml", &["--msh"]), &["lower.msh is an input of this run"]);
    refused(&run("history.toml", &["--set", "mesh.set.n=4"]), &["history.csv"]);
    assert_eq!(tree(scratch.path()), before);
    fs::remove_file(path("history.csv")).expect("the table");
    let without_views = run("scene.toml", &["--set", "method={}"]);
    assert_eq!(without_views.code, 0, "without a view of that name the mesh is in no danger\n{}", without_views.stderr);
}

/// Runs of `bench` replace results, and nothing else that has their folders.
#[test]
fn bench_removes_results_alone() {
    let scratch = tempfile::tempdir().expect("a folder");
    let out = scratch.path().join("out");
    let (scene, folder) = (case("groove-held").display().to_string(), out.display().to_string());
    let words =
        ["bench", &scene, "-q", "--solver", "mumps", "--set", "mesh.set.n=4", "--set", "method={}", "-o", &folder];
    assert_eq!(winkler(&words).code, 0);
    let runs = fs::read_dir(out.join("runs")).expect("runs").flatten().map(|entry| entry.path()).collect::<Vec<_>>();
    let [run] = &runs[..] else { panic!("{runs:?}") };
    fs::write(run.join("thesis.tex"), "mine").expect("a file");
    assert_eq!(winkler(&words).code, 0);
    assert!(run.join("thesis.tex").is_file() && run.join("report.json").is_file());
    refused_by_usage(&winkler(&[&words[..], &["--against", &run.display().to_string()]].concat()));
    fs::write(run.join("output.txt"), "mine").expect("a file");
    refused(&winkler(&words), &["output.txt", "winkler has not made it"]);
}

fn refused_by_usage(run: &Run) {
    assert!(run.code == 2 && run.stderr.contains("to compare with"), "{}", run.said());
}

/// Texts of a scene are texts in every file, whatever they contain.
#[test]
fn texts_of_scenes_are_texts() {
    let units = "units=mm<script>alert(1)</script>, MPa]]>";
    let words = [
        "--set",
        "mesh.set.n=4",
        "--set",
        "method={}",
        "--set",
        units,
        "--set",
        "title=\"a ]]> \\u001b b\"",
        "--report",
    ];
    let run = solve(case("groove-held"), &words).converged();
    let read = |name: &str| fs::read_to_string(run.folder.join(name)).expect("a file");
    let page = read("report.html");
    assert!(page.contains("Units: mm&lt;script&gt;alert(1)") && !page.contains("mm<script"), "units");
    for name in ["pressure.svg", "convergence.svg"] {
        let text = read(name);
        assert!(text.contains("a ]]&gt; ") && !text.contains("]]>") && !text.contains('\u{1b}'), "{name}");
    }
    for name in ["a\nb", "a\u{7}b", "a\"b"] {
        let run = winkler(&["new", name]);
        assert!(run.code == 2 && run.stderr.contains("does not end with a name"), "{}", run.said());
    }
}
