//! The walls between the modules, held by reading the sources.

mod circles;
use crate::common::root;
use circles::Crate;
use std::fs;
use std::path::{Path, PathBuf};

/// The modules from the ground up; each may use those below it.
const MODULES: [&str; 29] = [
    "error",
    "exchange",
    "file",
    "interrupt",
    "linalg",
    "petsc",
    "data",
    "expression",
    "setting",
    "problem",
    "mesh",
    "fem",
    "contact",
    "model",
    "parallel",
    "solver",
    "robin",
    "ddm",
    "output",
    "report",
    "scene",
    "discretize",
    "estimate",
    "run",
    "api",
    "commands",
    "internals",
    "cli",
    "main",
];

/// Modules that may use less than what lies below them.
const NARROW: [(&str, &str); 5] = [
    ("model", "error exchange linalg contact"),
    ("robin", "error exchange linalg contact problem model"),
    ("ddm", "error exchange linalg contact problem model robin"),
    ("output", "error file ddm"),
    ("discretize", "error exchange linalg expression problem mesh fem contact model parallel output scene"),
];

/// Files that may know the space dimension: those of the first modules, and the one that picks it.
const SPATIAL: [&str; 7] = ["scene", "mesh", "fem", "contact", "discretize", "run/phases.rs", "commands/mesh.rs"];

/// Lines that a file may have.
const LONGEST: usize = 800;

/// A source file.
struct Source {
    /// Path below `src/`.
    path: String,
    /// Its text.
    text: String,
    /// Its words outside comments and texts, `::` and other signs each a word, with their lines.
    words: Vec<(usize, String)>,
}

impl Source {
    fn module(&self) -> &str {
        let first = self.path.split('/').next().unwrap_or_default();
        first.strip_suffix(".rs").unwrap_or(first)
    }

    /// Whether it lies in a module or is a file of that path.
    fn is_in(&self, place: &str) -> bool {
        self.module() == place || self.path == place
    }

    fn at(&self, line: usize) -> String {
        format!("src/{}:{line}", self.path)
    }
}

fn sources() -> Vec<Source> {
    fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).expect("a folder of sources").flatten() {
            let path = entry.path();
            if path.is_dir() {
                collect(&path, files);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                files.push(path);
            }
        }
    }
    let base = root().join("src");
    let mut files = Vec::new();
    collect(&base, &mut files);
    files.sort();
    assert!(files.len() > 50, "only {} sources", files.len());
    let read = |file: PathBuf| {
        let text = fs::read_to_string(&file).expect("a source");
        let path = file.strip_prefix(&base).expect("a file below src").display().to_string();
        Source { path, words: words(&text), text }
    };
    files.into_iter().map(read).collect()
}

/// Words and signs of Rust code with their lines, without comments, texts and characters.
fn words(text: &str) -> Vec<(usize, String)> {
    let code: Vec<char> = text.chars().collect();
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let (mut words, mut i, mut line) = (Vec::new(), 0, 1);
    while i < code.len() {
        let (c, next) = (code[i], code.get(i + 1).copied());
        let from = i;
        let raw = code[i..].iter().skip(1).position(|&c| c != '#').map(|hashes| (hashes, code[i + 1 + hashes]));
        match (c, next, raw) {
            ('/', Some('/'), _) => i = end(&code, i, &['\n']) - 1,
            ('/', Some('*'), _) => i = end(&code, i + 2, &['*', '/']),
            ('r', _, Some((hashes, '"'))) if i == 0 || !is_word(code[i - 1]) => {
                let close: Vec<char> = std::iter::once('"').chain(std::iter::repeat_n('#', hashes)).collect();
                i = end(&code, i + hashes + 2, &close);
            }
            ('"', ..) => {
                i += 1;
                while i < code.len() && code[i] != '"' {
                    i += if code[i] == '\\' { 2 } else { 1 };
                }
                i += 1;
            }
            // a character, not a lifetime
            ('\'', Some('\\'), _) => i = end(&code, i + 3, &['\'']),
            ('\'', ..) if code.get(i + 2) == Some(&'\'') => i += 3,
            (':', Some(':'), _) => {
                words.push((line, "::".to_owned()));
                i += 2;
            }
            _ if is_word(c) => {
                while i < code.len() && is_word(code[i]) {
                    i += 1;
                }
                words.push((line, code[from..i].iter().collect()));
            }
            _ => {
                if !c.is_whitespace() {
                    words.push((line, c.to_string()));
                }
                i += 1;
            }
        }
        line += code[from..i.min(code.len())].iter().filter(|&&c| c == '\n').count();
    }
    words
}

/// The place behind the next `sign` from `i` on.
fn end(code: &[char], i: usize, sign: &[char]) -> usize {
    let found = (i..code.len()).find(|&k| code[k..].starts_with(sign));
    found.map_or(code.len() + 1, |k| k + sign.len())
}

/// Modules that a file names in paths from the root, with the lines: `crate::a::b` and `crate::{a::b, c}`; examples and the
/// main program say `winkler` for `crate`.
fn modules_used(source: &Source) -> Vec<(usize, String)> {
    let word = |i: usize| source.words.get(i).map_or("", |(_, word)| word.as_str());
    let mut used = Vec::new();
    for i in 0..source.words.len() {
        if !matches!(word(i), "crate" | "winkler") || word(i + 1) != "::" {
            continue;
        }
        if word(i + 2) != "{" {
            used.push(source.words[i + 2].clone());
            continue;
        }
        let (mut depth, mut k, mut first) = (1, i + 3, true);
        while depth > 0 && k < source.words.len() {
            match word(k) {
                "{" => depth += 1,
                "}" => depth -= 1,
                "," if depth == 1 => first = true,
                _ if first && depth == 1 => {
                    used.push(source.words[k].clone());
                    first = false;
                }
                _ => {}
            }
            k += 1;
        }
    }
    used
}

/// Fails with all breaches, one a line.
fn none(breaches: Vec<String>) {
    assert!(breaches.is_empty(), "{} breaches:\n{}", breaches.len(), breaches.join("\n"));
}

/// The library is `api` and `petsc` with their errors; the program needs `cli`, and tests have `internals` by a feature.
#[test]
fn modules_are_private_but_for_the_library() {
    let library = fs::read_to_string(root().join("src/lib.rs")).expect("the library");
    let public: Vec<&str> = library.lines().filter_map(|line| line.strip_prefix("pub mod ")).collect();
    assert_eq!(public, ["api;", "cli;", "error;", "internals;", "petsc;"]);
    assert!(library.contains("#[cfg(feature = \"internals\")]\npub mod internals;"));
}

#[test]
fn unsafe_stays_in_petsc() {
    let mut breaches = Vec::new();
    for source in sources().iter().filter(|source| source.module() != "petsc") {
        breaches.extend(source.words.iter().filter(|(_, word)| word == "unsafe").map(|(line, _)| source.at(*line)));
        // and nobody else is let off
        let allowed = source.text.matches("allow(unsafe_code)").count();
        let expected = usize::from(source.path == "lib.rs");
        if allowed != expected {
            breaches.push(format!("src/{}: allows unsafe code {allowed} times", source.path));
        }
    }
    none(breaches);
    let library = fs::read_to_string(root().join("src/lib.rs")).expect("the library");
    assert!(library.contains("#![deny(unsafe_code)]"));
    assert!(library.contains("#[allow(unsafe_code)]\npub mod petsc;"));
    // a call of PETSc is unsafe where it stands, not inside the macro that checks its code, and clippy asks for the reason
    let binding = |file: &str| fs::read_to_string(root().join("src/petsc").join(file)).expect("the binding");
    let calls = binding("library.rs");
    let (_, body) = calls.split_once("macro_rules! petsc {").expect("the macro");
    assert!(!body.split_once("\n}").expect("its end").0.contains("unsafe"));
    assert!(binding("mod.rs").contains("#![warn(clippy::undocumented_unsafe_blocks)]"));
}

#[test]
fn the_method_knows_no_mesh_no_element_no_petsc() {
    let forbidden = ["petsc", "mesh", "fem", "const", "mpi", "Session", "Ksp", "element", "simplex", "dimension"];
    let mut breaches = Vec::new();
    for source in sources().iter().filter(|source| source.module() == "ddm") {
        for (k, (line, word)) in source.words.iter().enumerate() {
            // constants and const functions are no dimensions
            let generic = word == "const" && source.words.get(k + 1).is_some_and(|(_, next)| next == "D");
            if forbidden.contains(&word.as_str()) && (word != "const" || generic) {
                breaches.push(format!("{}: {word}", source.at(*line)));
            }
        }
    }
    none(breaches);
}

#[test]
fn few_rooms_know_the_dimension() {
    let mut breaches = Vec::new();
    for source in sources().iter().filter(|source| !SPATIAL.iter().any(|place| source.is_in(place))) {
        for three in source.words.windows(3) {
            let [(line, a), (_, b), (_, c)] = three else { continue };
            let generic = a == "const" && b == "D";
            let chosen = a == "<" && matches!(b.as_str(), "2" | "3" | "D") && c == ">";
            if generic || chosen {
                breaches.push(format!("{}: {a} {b} {c}", source.at(*line)));
            }
        }
    }
    none(breaches);
}

#[test]
fn modules_use_only_lower_modules() {
    let floor = |module: &str| MODULES.iter().position(|known| *known == module);
    let mut breaches = Vec::new();
    let mut uses = 0;
    for source in sources().iter().filter(|source| source.module() != "lib") {
        let module = source.module();
        let Some(own) = floor(module) else {
            breaches.push(format!("src/{}: the module `{module}` has no floor", source.path));
            continue;
        };
        for (line, other) in modules_used(source).into_iter().filter(|(_, other)| other != module) {
            uses += 1;
            let narrow = NARROW.iter().find(|(name, _)| *name == module);
            let allowed = match narrow {
                Some((_, below)) => below.split(' ').any(|below| below == other),
                None => floor(&other).is_some_and(|other| other < own),
            };
            if !allowed {
                breaches.push(format!("{}: `{module}` uses `{other}`", source.at(line)));
            }
        }
    }
    assert!(uses > 50, "only {uses} uses found");
    none(breaches);
}

/// Circles that are being taken apart elsewhere: their files. An entry whose files are on no circle any more is a breach.
const ROUND: [&[&str]; 0] = [];

/// Circles of files, each as `a -> b`, the first file being used by the last.
fn circles<'a>(files: impl IntoIterator<Item = (&'a str, &'a [(usize, String)])>) -> Vec<Vec<String>> {
    let mut all = Crate::default();
    for (place, words) in files {
        all.add(place, &words.iter().map(|(_, word)| word.as_str()).collect::<Vec<_>>());
    }
    all.circles()
}

#[test]
fn files_use_each_other_one_way() {
    let sources = sources();
    let found = circles(sources.iter().map(|source| (source.path.as_str(), &source.words[..])));
    let is_within = |circle: &[String], files: &[&str]| circle.iter().all(|file| files.contains(&file.as_str()));
    let unknown = found.iter().filter(|circle| !ROUND.iter().any(|files| is_within(circle, files)));
    let breaches = unknown.map(|circle| circle.join(" -> "));
    let gone = ROUND.iter().filter(|files| !found.iter().any(|circle| is_within(circle, files)));
    none(breaches.chain(gone.map(|files| format!("no circle any more: {}", files.join(", ")))).collect());
}

#[test]
fn planted_circles_are_found() {
    let found = |files: &[(&str, &str)]| {
        let files: Vec<_> = files.iter().map(|(place, text)| (*place, words(text))).collect();
        let found = circles(files.iter().map(|(place, words)| (*place, &words[..])));
        found.iter().map(|circle| circle.join(" ")).collect::<Vec<_>>()
    };
    // by `super`, and by a path in the code
    let (a, b) = (("r/a.rs", "use super::b::{self, B};"), ("r/b.rs", "fn f() { crate::r::a::g(); }"));
    assert_eq!(found(&[a, b, ("r/mod.rs", "mod a; mod b;")]), ["r/a.rs r/b.rs"]);
    // a re-export leads on, also by another name, and is no use itself
    let a = ("r/a.rs", "use super::{Other, X};");
    let b = ("r/b.rs", "use super::a; pub struct B; impl B { fn f() -> a::A {} }");
    let module = ("r/mod.rs", "mod a; mod b; pub use b::B as X; pub struct Other;");
    assert_eq!(found(&[a, b, module]), ["r/a.rs r/b.rs"]);
    assert!(found(&[a, ("r/b.rs", "use super::Other;"), module]).is_empty());
    // unless the file itself says the name
    let module = ("r/mod.rs", "mod b; pub use b::B; pub struct Other(B);");
    assert_eq!(found(&[("r/b.rs", "use super::Other; pub struct B;"), module]), ["r/b.rs r/mod.rs"]);
    // by all names at once, by the name of a module, from a module within the file, and around three
    let a = ("r/a.rs", "pub fn f() {} mod tests { use super::super::c; fn g() { c::h() } }");
    let b = ("r/b.rs", "use super::f;");
    let c = ("r/c.rs", "use crate::r; fn h() { r::b::k() }");
    assert_eq!(found(&[a, b, c, ("r/mod.rs", "mod a; mod b; mod c; pub use a::*;")]), ["r/a.rs r/c.rs r/b.rs"]);
    // a file and a folder of its name; what a comment or a text says is nothing
    let (outer, inner) =
        (("r.rs", "mod s; use s::S; pub fn f() {}"), ("r/s.rs", "fn g() { super::f() } pub struct S;"));
    assert_eq!(found(&[outer, inner]), ["r.rs r/s.rs"]);
    assert!(found(&[outer, ("r/s.rs", "// super::f()\nfn g() { say(\"super::f()\") }")]).is_empty());
}

/// The binding is a product of its own: it knows errors, and nothing else of the program.
#[test]
fn the_binding_stands_alone() {
    let binding = sources().into_iter().filter(|source| source.module() == "petsc");
    let others = binding.flat_map(|source| {
        let used = modules_used(&source).into_iter().filter(|(_, module)| module != "petsc" && module != "error");
        used.map(|(line, module)| format!("{}: {module}", source.at(line))).collect::<Vec<_>>()
    });
    none(others.collect());
}

#[test]
fn no_file_is_too_long() {
    let long = |source: &Source| (source.text.lines().count() > LONGEST).then(|| source.path.clone());
    let lines = |path: String| format!("src/{path} has more than {LONGEST} lines");
    none(sources().iter().filter_map(long).map(lines).collect());
}

#[test]
fn words_are_those_outside_comments_and_texts() {
    let code = "a::b // unsafe\n/* unsafe\n */ \"un\\\"safe\" r#\"unsafe \" \"# 'x' '\\'' &'c d";
    let found: Vec<String> = words(code).into_iter().map(|(line, word)| format!("{line}{word}")).collect();
    assert_eq!(found, ["1a", "1::", "1b", "3&", "3'", "3c", "3d"]);
    let text = "use crate::{mesh::{A, B}, fem}; crate::ddm::X".to_owned();
    let source = Source { path: "x.rs".into(), words: words(&text), text };
    let used: Vec<String> = modules_used(&source).into_iter().map(|(_, module)| module).collect();
    assert_eq!(used, ["mesh", "fem", "ddm"]);
}
