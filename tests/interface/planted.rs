//! Planted mistakes, which `scripts/planted` tries: each patch still applies to the sources, and names a test program.

use crate::common::root;
use std::fs;
use std::process::Command;

#[test]
fn planted_mistakes_apply() {
    let entries = fs::read_dir(root().join("tests/planted")).expect("the planted mistakes").flatten();
    let patches: Vec<_> = entries.map(|entry| entry.path()).filter(|path| path.extension().is_some()).collect();
    assert!(patches.len() >= 12, "only {} patches", patches.len());
    for patch in patches {
        let text = fs::read_to_string(&patch).expect("a patch");
        let test = text.lines().find_map(|line| line.strip_prefix("Test: ")).expect("the line of the test");
        let words: Vec<&str> = test.split(' ').collect();
        let program = match words[..] {
            ["--lib", _] => "src/lib.rs".to_owned(),
            ["--test", program, _] => format!("tests/{program}/main.rs"),
            _ => panic!("{}: `{test}` is neither --lib FILTER nor --test PROGRAM FILTER", patch.display()),
        };
        assert!(root().join(program).is_file(), "{}: no program for `{test}`", patch.display());
        let Ok(git) = Command::new("git").args(["apply", "--check"]).arg(&patch).current_dir(root()).output() else {
            eprintln!("no git: whether {} applies is not checked", patch.display());
            continue;
        };
        assert!(git.status.success(), "{}: {}", patch.display(), String::from_utf8_lossy(&git.stderr));
    }
}
