//! The walls between the modules, held by reading the sources line by line, without comments and tests.

use crate::common::root;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// The modules from the ground up; each may use those below it.
const MODULES: &str = "petsc error exchange file interrupt linalg data expression problem mesh fem contact parallel \
    solver model robin ddm output page scene discretize estimate run api commands internals cli main";

/// Modules that may use less than what lies below them.
const NARROW: [(&str, &str); 7] = [
    ("petsc", ""),
    ("solver", "error exchange linalg petsc problem fem parallel"),
    ("model", "error exchange file linalg petsc fem contact solver"),
    ("robin", "error exchange linalg contact problem model"),
    ("ddm", "error exchange linalg contact problem model robin"),
    ("output", "error file ddm"),
    ("discretize", "error exchange linalg expression problem mesh fem contact model parallel output scene"),
];

/// Lines that a file may have.
const LONGEST: usize = 800;

/// Words before the name of an item.
const ITEMS: [&str; 9] = ["fn ", "struct ", "enum ", "trait ", "type ", "const ", "static ", "mod ", "macro_rules! "];

/// A source file.
struct Source {
    /// Path below `src/`.
    path: String,
    /// Its path as a module: `fem::space::`, and nothing for the crate.
    module: String,
    code: String,
    /// Items that the file makes.
    items: BTreeSet<String>,
}

impl Source {
    fn new(path: String, text: &str) -> Self {
        let lines = text.lines().map(|line| line.split("//").next().unwrap_or_default().to_owned() + "\n");
        let code: String = lines.collect();
        let code = code.split("#[cfg(test)]\nmod ").next().unwrap_or_default().to_owned();
        let bare = path.trim_end_matches(".rs").trim_end_matches("/mod");
        let module = if bare == "lib" { String::new() } else { bare.replace('/', "::") + "::" };
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        let name = |rest: &str| rest.split(|c| !is_word(c)).next().unwrap_or_default().to_owned();
        let items = ITEMS.iter().flat_map(|word| code.split(word).skip(1).map(name).collect::<Vec<_>>()).collect();
        Self { path, module, code, items }
    }

    /// Return the paths of the imports behind `use` and of other mentions of `crate::`, and whether they are passed on.
    fn paths(&self) -> Vec<(String, bool)> {
        let mut found = Vec::new();
        for (at, _) in self.code.match_indices("use ") {
            let line = self.code[..at].rsplit('\n').next().unwrap_or_default().trim();
            if line.is_empty() || line.starts_with("pub") {
                let list: String =
                    self.code[at + 4..].split(';').next().unwrap_or_default().split_whitespace().collect();
                found.extend(names(&list).into_iter().map(|name| (name, !line.is_empty())));
            }
        }
        let mentions = self.code.match_indices("crate::").map(|(at, _)| &self.code[at..]);
        let end = |c: char| !(c.is_alphanumeric() || c == '_' || c == ':');
        found.extend(mentions.map(|rest| (rest.split(end).next().unwrap_or_default().to_owned(), false)));
        found
    }
}

/// Return the paths of `a::{b, c::{d, e}}`, whose blanks are gone: `a::b`, `a::c::d`, `a::c::e`.
fn names(path: &str) -> Vec<String> {
    let Some((head, list)) = path.split_once('{') else { return vec![path.to_owned()] };
    let mut depth = 0;
    let ends_name = |c: char| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        depth == 0 && c == ','
    };
    let parts: Vec<&str> = list[..list.len() - 1].split(ends_name).filter(|part| !part.is_empty()).collect();
    parts.into_iter().flat_map(names).map(|name| head.to_owned() + &name).collect()
}

fn sources() -> Vec<Source> {
    fn collect(base: &Path, folder: &Path, found: &mut Vec<Source>) {
        for path in fs::read_dir(folder).expect("a folder of sources").flatten().map(|entry| entry.path()) {
            if path.is_dir() {
                collect(base, &path, found);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let name = path.strip_prefix(base).expect("a file below src").display().to_string();
                found.push(Source::new(name, &fs::read_to_string(&path).expect("a source")));
            }
        }
    }
    let (base, mut found) = (root().join("src"), Vec::new());
    collect(&base, &base, &mut found);
    assert!(found.len() > 50, "only {} sources", found.len());
    found
}

/// Fails with all breaches, one a line.
fn none(breaches: Vec<String>) {
    assert!(breaches.is_empty(), "{} breaches:\n{}", breaches.len(), breaches.join("\n"));
}

#[test]
fn unsafe_stays_in_petsc_and_no_file_is_too_long() {
    let mut breaches = Vec::new();
    for source in sources() {
        let allowed = source.code.matches("allow(unsafe_code)").count();
        if allowed > usize::from(source.path == "lib.rs") {
            breaches.push(format!("src/{} allows unsafe code", source.path));
        }
        if source.code.lines().count() > LONGEST {
            breaches.push(format!("src/{} has more than {LONGEST} lines", source.path));
        }
    }
    none(breaches);
    let library = fs::read_to_string(root().join("src/lib.rs")).expect("the library");
    assert!(library.contains("#![deny(unsafe_code)]") && library.contains("#[allow(unsafe_code)]\npub mod petsc;"));
}

#[test]
fn modules_use_only_lower_modules() {
    let floor = |module: &str| MODULES.split(' ').position(|known| known == module);
    let (mut breaches, mut uses) = (Vec::new(), 0);
    for source in sources() {
        let module = source.path.split(['/', '.']).next().unwrap_or_default();
        let narrow = NARROW.iter().find(|(name, _)| *name == module);
        for (path, _) in source.paths().into_iter().filter(|_| module != "lib") {
            // the main program says `winkler` for `crate`
            let Some(path) = path.strip_prefix("crate::").or(path.strip_prefix("winkler::")) else { continue };
            let other = path.split("::").next().unwrap_or_default();
            let allowed = match narrow {
                Some((_, below)) => below.split(' ').any(|below| below == other),
                None => floor(other) < floor(module) && floor(other).is_some(),
            };
            uses += 1;
            if other != module && !other.is_empty() && !allowed {
                breaches.push(format!("src/{}: `{module}` uses `{other}`", source.path));
            }
        }
    }
    assert!(uses > 500, "only {uses} uses found");
    none(breaches);
}

/// Return the file that makes the item of a path: that of the deepest module in it, or the one inside from which it passes the item on.
fn file_of(sources: &[Source], path: &str) -> Option<usize> {
    let path = path.to_owned() + "::";
    let holders = (0..sources.len()).filter(|&i| path.starts_with(&sources[i].module));
    let holder = holders.max_by_key(|&i| sources[i].module.len())?;
    let inner = &sources[holder].module;
    let name = path[inner.len()..].split("::").next()?;
    if matches!(name, "" | "*" | "self") || sources[holder].items.contains(name) {
        return Some(holder);
    }
    (0..sources.len()).find(|&i| sources[i].module.starts_with(inner) && sources[i].items.contains(name))
}

/// Return the indices of the files that file `from` uses; what it passes on is no use.
fn used(sources: &[Source], from: usize) -> BTreeSet<usize> {
    let module = &sources[from].module;
    let whole = |path: &str| {
        let ups = path.matches("super::").count();
        let above =
            (0..ups).fold(module.trim_end_matches("::"), |module, _| module.rsplit_once("::").map_or("", |m| m.0));
        let rest = &path["super::".len() * ups..];
        match rest.strip_prefix("crate::") {
            Some(rest) => rest.to_owned(),
            None if above.is_empty() => rest.to_owned(),
            None => format!("{above}::{rest}"),
        }
    };
    let paths = sources[from].paths().into_iter().filter(|(_, is_passed_on)| !is_passed_on);
    paths.filter_map(|(path, _)| file_of(sources, &whole(&path))).filter(|&i| i != from).collect()
}

#[test]
fn files_use_each_other_one_way() {
    let sources = sources();
    let uses: Vec<BTreeSet<usize>> = (0..sources.len()).map(|i| used(&sources, i)).collect();
    assert!(uses.iter().map(BTreeSet::len).sum::<usize>() > 500);
    let mut left: BTreeSet<usize> = (0..sources.len()).collect();
    // a file on a circle uses another one on it, and is used
    let outside = |left: &BTreeSet<usize>| {
        let is_out = |i: &usize| uses[*i].is_disjoint(left) || !left.iter().any(|&other| uses[other].contains(i));
        left.iter().copied().find(is_out)
    };
    while let Some(file) = outside(&left) {
        left.remove(&file);
    }
    let arrow = |from: usize, to: &usize| format!("{} -> {}", sources[from].path, sources[*to].path);
    none(left.iter().flat_map(|&i| uses[i].intersection(&left).map(move |to| arrow(i, to))).collect());
}
