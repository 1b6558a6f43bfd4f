//! The walls between the modules, held by reading the sources line by line. Comments are left out, texts are not.

use crate::common::root;
use std::collections::BTreeSet;
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
const NARROW: [(&str, &str); 6] = [
    ("petsc", "error"),
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

/// Words before the name of an item.
const ITEMS: [&str; 10] =
    ["fn ", "struct ", "enum ", "trait ", "type ", "const ", "static ", "mod ", "macro_rules! ", "union "];

/// A source file.
struct Source {
    /// Path below `src/`.
    path: String,
    /// Its path as a module: `fem::space::`, and nothing for the crate.
    module: String,
    /// Its lines without comments.
    code: String,
    /// Names of the items that it makes, not imports, outside tests.
    items: BTreeSet<String>,
}

impl Source {
    fn new(path: &str, text: &str) -> Self {
        let lines = text.lines().map(|line| line.split("//").next().unwrap_or_default().to_owned() + "\n");
        let code: String = lines.collect();
        let bare = path.trim_end_matches(".rs").trim_end_matches("/mod");
        let module = if bare == "lib" { String::new() } else { bare.replace('/', "::") + "::" };
        let behind = |word: &str| before_tests(&code).split(word).skip(1).map(first_word).collect::<Vec<_>>();
        let items = ITEMS.iter().flat_map(|word| behind(word)).collect();
        Self { path: path.to_owned(), module, code, items }
    }

    fn top(&self) -> &str {
        self.path.split(['/', '.']).next().unwrap_or_default()
    }

    /// Whether it lies in a module or is a file of that path.
    fn is_in(&self, place: &str) -> bool {
        self.top() == place || self.path == place
    }

    /// Return the paths behind `root::` in the code, one for each name of a list, with their lines.
    fn paths(&self, code: &str, root: &str) -> Vec<(usize, String)> {
        let starts = code.match_indices(root).filter(|(at, _)| !code[..*at].ends_with(is_word));
        let lists = starts.map(|(at, _)| (code[..at].matches('\n').count() + 1, path(&code[at + root.len()..])));
        lists.flat_map(|(line, list)| names(list).into_iter().map(move |name| (line, name))).collect()
    }
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

fn first_word(code: &str) -> String {
    code.chars().take_while(|&c| is_word(c)).collect()
}

fn before_tests(code: &str) -> &str {
    code.split("#[cfg(test)]\nmod ").next().unwrap_or_default()
}

/// Return the path at the beginning of `code`, with its list in braces.
fn path(code: &str) -> &str {
    let mut depth = 0;
    for (at, c) in code.char_indices() {
        match c {
            '{' if code[..at].is_empty() || code[..at].ends_with("::") || depth > 0 => depth += 1,
            '}' if depth > 0 => depth -= 1,
            _ if depth > 0 || is_word(c) || c == ':' => {}
            _ => return &code[..at],
        }
    }
    code
}

/// Return the paths of `a::{b, c::{d, e}}`: `a::b`, `a::c::d`, `a::c::e`.
fn names(path: &str) -> Vec<String> {
    let Some((head, list)) = path.split_once('{') else {
        return vec![path.split(" as ").next().unwrap_or_default().trim().to_owned()];
    };
    let mut depth = 0;
    let ends_name = |c: char| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        depth == 0 && c == ','
    };
    let list = list.rsplit_once('}').map_or(list, |(list, _)| list);
    let parts: Vec<&str> = list.split(ends_name).map(str::trim).filter(|part| !part.is_empty()).collect();
    parts.into_iter().flat_map(names).map(|name| head.trim().to_owned() + &name).collect()
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
    let place = |file: &PathBuf| file.strip_prefix(&base).expect("a file below src").display().to_string();
    files.iter().map(|file| Source::new(&place(file), &fs::read_to_string(file).expect("a source"))).collect()
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

/// The compiler refuses unsafe code where nothing allows it.
#[test]
fn unsafe_stays_in_petsc() {
    let allows = |source: &Source| source.code.matches("allow(unsafe_code)").count();
    let allowed = sources().into_iter().filter(|source| allows(source) > usize::from(source.path == "lib.rs"));
    none(allowed.map(|source| format!("src/{} allows unsafe code", source.path)).collect());
    let read = |file: &str| fs::read_to_string(root().join("src").join(file)).expect("a source");
    assert!(read("lib.rs").contains("#![deny(unsafe_code)]"));
    assert!(read("lib.rs").contains("#[allow(unsafe_code)]\npub mod petsc;"));
    // a call of PETSc is unsafe where it stands, not inside the macro that checks its code, and clippy asks for the reason
    let calls = read("petsc/library.rs");
    let (_, body) = calls.split_once("macro_rules! petsc {").expect("the macro");
    assert!(!body.split_once("\n}").expect("its end").0.contains("unsafe"));
    assert!(read("petsc/mod.rs").contains("#![warn(clippy::undocumented_unsafe_blocks)]"));
}

#[test]
fn few_modules_know_the_dimension() {
    let mut breaches = Vec::new();
    for source in sources().iter().filter(|source| !SPATIAL.iter().any(|place| source.is_in(place))) {
        let lines = source.code.lines().zip(1..);
        let spatial =
            lines.filter(|(line, _)| ["const D:", "<2>", "<3>", "<D>"].iter().any(|sign| line.contains(sign)));
        breaches.extend(spatial.map(|(line, number)| format!("src/{}:{number}: {}", source.path, line.trim())));
    }
    none(breaches);
}

/// Return the uses of modules that are not below the module of their file, and the number of all uses.
fn upward(sources: &[Source]) -> (Vec<String>, usize) {
    let floor = |module: &str| MODULES.iter().position(|known| *known == module);
    let (mut breaches, mut uses) = (Vec::new(), 0);
    for source in sources.iter().filter(|source| source.top() != "lib") {
        let module = source.top();
        let narrow = NARROW.iter().find(|(name, _)| *name == module);
        // the main program says `winkler` for `crate`
        let paths = ["crate::", "winkler::"].into_iter().flat_map(|root| source.paths(&source.code, root));
        for (line, path) in paths {
            let other = path.split("::").next().unwrap_or_default();
            let allowed = match narrow {
                Some((_, below)) => below.split(' ').any(|below| below == other),
                None => floor(other) < floor(module) && floor(other).is_some(),
            };
            uses += 1;
            if other != module && !allowed {
                breaches.push(format!("src/{}:{line}: `{module}` uses `{other}`", source.path));
            }
        }
    }
    (breaches, uses)
}

#[test]
fn modules_use_only_lower_modules() {
    let (breaches, uses) = upward(&sources());
    assert!(uses > 50, "only {uses} uses found");
    none(breaches);
    let planted = |text: &str| upward(&[Source::new("fem/a.rs", text)]).0;
    assert!(planted("use crate::{\n    error::{Error, Result},\n    mesh::Mesh,\n};\n// crate::run\n").is_empty());
    assert_eq!(planted("\nuse crate::{\n    mesh::{A, B},\n    run::C,\n};\n"), ["src/fem/a.rs:2: `fem` uses `run`"]);
    assert_eq!(planted("fn f() { crate::ddm::solve() }\n"), ["src/fem/a.rs:1: `fem` uses `ddm`"]);
}

/// Return the indices of the files that file `from` uses. A path leads to the module that it names. If that does not make the
/// next name, it passes on one of a module inside it.
fn used(sources: &[Source], from: usize) -> BTreeSet<usize> {
    let source = &sources[from];
    let module = &source.module;
    let parent = |module: &str| match module.trim_end_matches("::").rsplit_once("::") {
        Some((parent, _)) => parent.to_owned() + "::",
        None => String::new(),
    };
    // a re-export alone is no use
    let mut code = before_tests(&source.code).to_owned();
    for public in ["pub use ", "pub(crate) use ", "pub(super) use "] {
        while let Some(at) = code.find(public) {
            let end = code[at..].find(';').map_or(code.len(), |end| at + end);
            code.replace_range(at..end, "");
        }
    }
    let mut paths: Vec<String> = source.paths(&code, "crate::").into_iter().map(|(_, path)| path).collect();
    for (_, path) in source.paths(&code, "super::") {
        let ups = path.matches("super::").count();
        let from = (0..=ups).fold(module.clone(), |module, _| parent(&module));
        paths.push(from + &path["super::".len() * ups..]);
    }
    let children = sources
        .iter()
        .map(|source| &source.module)
        .filter(|child| child.len() > module.len() && parent(child) == *module);
    for child in children {
        let inside = source.paths(&code, &child[module.len()..]);
        paths.extend(inside.into_iter().map(|(_, path)| child.clone() + &path));
    }
    paths.iter().filter_map(|path| file_of(sources, path)).filter(|&i| i != from).collect()
}

/// Return the file that makes the item of a path.
fn file_of(sources: &[Source], path: &str) -> Option<usize> {
    let path = path.trim_end_matches("self").to_owned() + "::";
    let holders = (0..sources.len()).filter(|&i| path.starts_with(&sources[i].module));
    let holder = holders.max_by_key(|&i| sources[i].module.len())?;
    let inner = &sources[holder].module;
    let name = path[inner.len()..].split("::").next()?;
    if matches!(name, "" | "*") {
        return Some(holder);
    }
    let passed_on = |&i: &usize| sources[i].module.starts_with(inner) && sources[i].items.contains(name);
    if sources[holder].items.contains(name) { Some(holder) } else { (0..sources.len()).find(passed_on) }
}

/// Return the uses, as `a -> b`, among files that use each other directly or through others.
fn circles(sources: &[Source]) -> Vec<String> {
    let uses: Vec<BTreeSet<usize>> = (0..sources.len()).map(|i| used(sources, i)).collect();
    let mut left: BTreeSet<usize> = (0..sources.len()).collect();
    // a file on a circle uses another one on it, and is used
    while let Some(outside) = left
        .iter()
        .copied()
        .find(|&i| uses[i].is_disjoint(&left) || !left.iter().any(|&other| uses[other].contains(&i)))
    {
        left.remove(&outside);
    }
    let arrow = |from: usize, to: &usize| format!("{} -> {}", sources[from].path, sources[*to].path);
    left.iter().flat_map(|&i| uses[i].intersection(&left).map(move |to| arrow(i, to))).collect()
}

#[test]
fn files_use_each_other_one_way() {
    let sources = sources();
    let uses: usize = (0..sources.len()).map(|i| used(&sources, i).len()).sum();
    assert!(uses > 500, "only {uses} uses found");
    none(circles(&sources));
}

#[test]
fn planted_circles_are_found() {
    let found =
        |files: &[(&str, &str)]| circles(&files.iter().map(|(path, text)| Source::new(path, text)).collect::<Vec<_>>());
    let a = ("r/a.rs", "use super::b::{self, B};\npub struct A;");
    let b = ("r/b.rs", "pub struct B;\nfn f() { crate::r::a::A; }");
    let module = ("r/mod.rs", "mod a;\nmod b;\npub use a::A;\npub use b::{\n    B,\n};\npub struct Other;");
    assert_eq!(found(&[a, b, module]), ["r/a.rs -> r/b.rs", "r/b.rs -> r/a.rs"]);
    // a re-export leads on
    assert_eq!(found(&[a, ("r/b.rs", "use super::A;\npub struct B;"), module]).len(), 2);
    assert!(found(&[a, ("r/b.rs", "use super::Other;\npub struct B;"), module]).is_empty());
    // a folder and its file; tests, and what a comment says, are no uses
    let module = ("r.rs", "mod b;\nuse b::B;\npub struct Other;");
    assert_eq!(found(&[("r/b.rs", "use super::Other;\npub struct B;"), module]), ["r/b.rs -> r.rs", "r.rs -> r/b.rs"]);
    assert!(
        found(&[
            ("r/b.rs", "pub struct B; // super::Other\n#[cfg(test)]\nmod tests {\n    use super::super::Other;\n}"),
            module
        ])
        .is_empty()
    );
}

#[test]
fn no_file_is_too_long() {
    let long = sources().into_iter().filter(|source| source.code.lines().count() > LONGEST);
    none(long.map(|source| format!("src/{} has more than {LONGEST} lines", source.path)).collect());
}
