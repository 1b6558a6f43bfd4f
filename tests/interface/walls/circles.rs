//! Which file uses which, read from the paths in the code, and the circles among them.
//!
//! A path leads to the file that has the item: modules are followed by their names, and a name that a file imports or
//! re-exports leads on to where it came from. So a file that takes `super::X` uses the file that `X` stands in, and only that; a
//! re-export alone is no use.

use std::collections::{BTreeMap, BTreeSet};

/// A module of the crate: `["fem", "space"]`.
type Module = Vec<String>;

/// What a file says of others.
#[derive(Default)]
struct File {
    /// Where it lies, below `src/`.
    place: String,
    /// Names that `use` brings, with their paths.
    imports: BTreeMap<String, Path>,
    /// Paths of `use ...::*`.
    globs: Vec<Path>,
    /// Paths that count as uses.
    uses: Vec<Path>,
    /// Paths that are only passed on, by the name that they are passed on as.
    passed: Vec<(String, Path)>,
    /// Words outside imports.
    said: BTreeSet<String>,
    /// Functions, types, constants and macros made here.
    makes: BTreeSet<String>,
}

/// A path with the module that it is seen from, inline modules included.
#[derive(Clone)]
struct Path {
    from: Module,
    names: Vec<String>,
}

/// All files of the crate by their modules.
#[derive(Default)]
pub struct Crate(BTreeMap<Module, File>);

/// The module of a file below `src/`.
fn module(place: &str) -> Module {
    let bare = place.strip_suffix(".rs").unwrap_or(place);
    let bare = bare.strip_suffix("/mod").unwrap_or(bare);
    if bare == "lib" { Vec::new() } else { bare.split('/').map(str::to_owned).collect() }
}

impl Crate {
    /// Adds a file with its words outside comments and texts.
    pub fn add(&mut self, place: &str, words: &[&str]) {
        let module = module(place);
        let mut file = File { place: place.to_owned(), ..File::default() };
        let word = |i: usize| words.get(i).copied().unwrap_or_default();
        // inline modules that are open, with the braces around them
        let (mut inline, mut depth): (Vec<(String, usize)>, usize) = (Vec::new(), 0);
        let mut i = 0;
        while i < words.len() {
            let from: Module = module.iter().chain(inline.iter().map(|(name, _)| name)).cloned().collect();
            match word(i) {
                "{" => depth += 1,
                "}" => {
                    depth -= 1;
                    inline.retain(|(_, open)| *open < depth + 1);
                }
                "mod" => {
                    if word(i + 2) == "{" {
                        inline.push((word(i + 1).to_owned(), depth + 1));
                    }
                    i += 1;
                }
                // not the `use<'a>` of a type
                "use" if word(i + 1) != "<" => {
                    let is_passed_on = i > 0 && matches!(word(i - 1), "pub" | ")");
                    i = file.import(words, i + 1, &from, &[], is_passed_on);
                }
                "fn" | "struct" | "enum" | "trait" | "const" | "static" | "type" | "union" => {
                    file.makes.insert(word(i + 1).to_owned());
                }
                "macro_rules" => {
                    file.makes.insert(word(i + 2).to_owned());
                }
                first if is_name(first) => {
                    file.said.insert(first.to_owned());
                    let starts = i == 0 || !matches!(word(i - 1), "::" | ".");
                    if starts && word(i + 1) == "::" {
                        let mut names = vec![first.to_owned()];
                        while word(i + 1) == "::" && is_name(word(i + 2)) {
                            names.push(word(i + 2).to_owned());
                            i += 2;
                        }
                        file.uses.push(Path { from, names });
                    }
                }
                _ => {}
            }
            i += 1;
        }
        self.0.insert(module, file);
    }

    /// The module that has what a path names, as far as it lies in the crate, and the names left behind it: none if the path is
    /// that of a module.
    fn target(&self, path: &Path, tries: usize) -> Option<(Module, Vec<String>)> {
        let (first, mut rest) = path.names.split_first()?;
        let file = self.file_of(&path.from);
        let mut module = match first.as_str() {
            "crate" | "winkler" => Module::new(),
            "self" => path.from.clone(),
            "super" => path.from[..path.from.len().checked_sub(1)?].to_vec(),
            _ => {
                rest = &path.names;
                file.clone()
            }
        };
        while let Some((name, after)) = rest.split_first() {
            if name == "super" {
                module.pop();
                rest = after;
                continue;
            }
            // inline modules belong to their file
            module = self.file_of(&module);
            let child: Module = module.iter().chain([name]).cloned().collect();
            if self.0.contains_key(&child) {
                module = child;
                rest = after;
                continue;
            }
            let file = self.0.get(&module)?;
            let with = |found: &Path| {
                let names = found.names.iter().chain(after).cloned().collect();
                self.target(&Path { from: found.from.clone(), names }, tries - 1)
            };
            if let Some(found) = file.imports.get(name).filter(|found| tries > 0 && found.names != path.names) {
                return with(found);
            }
            if !file.makes.contains(name) && tries > 0 {
                let from = file.globs.iter().filter_map(|glob| {
                    let names = glob.names.iter().chain(rest).cloned().collect();
                    self.target(&Path { from: glob.from.clone(), names }, tries - 1)
                });
                let made = from.filter(|(module, left)| {
                    let makes = |name| self.0.get(module).is_some_and(|file| file.makes.contains(name));
                    left.first().is_none_or(makes)
                });
                if let Some(found) = made.into_iter().next() {
                    return Some(found);
                }
            }
            // a bare name that nobody brought is of the language, of another crate or of this file
            let is_bare = rest.len() == path.names.len();
            let is_here = !is_bare || file.makes.contains(name);
            return is_here.then(|| (module.clone(), rest.to_vec()));
        }
        Some((self.file_of(&module), Vec::new()))
    }

    /// The innermost module around that is a file.
    fn file_of(&self, module: &[String]) -> Module {
        let lengths = (0..=module.len()).rev();
        lengths.map(|length| module[..length].to_vec()).find(|module| self.0.contains_key(module)).unwrap_or_default()
    }

    /// Files that each file uses.
    fn arrows(&self) -> BTreeMap<&str, BTreeSet<&str>> {
        let arrows = |file: &File| {
            let own = file.passed.iter().filter(|(name, _)| file.said.contains(name)).map(|(_, path)| path);
            let targets = file.uses.iter().chain(own).filter_map(|path| self.target(path, 9));
            let places = targets.filter_map(|(module, _)| self.0.get(&module).map(|file| file.place.as_str()));
            places.filter(|place| *place != file.place).collect()
        };
        self.0.values().map(|file| (file.place.as_str(), arrows(file))).collect()
    }

    /// A shortest circle through each file that lies on one, begun at its first name; each circle once.
    pub fn circles(&self) -> Vec<Vec<String>> {
        let arrows = self.arrows();
        let mut circles: BTreeSet<Vec<String>> = BTreeSet::new();
        for &start in arrows.keys() {
            let mut before: BTreeMap<&str, &str> = BTreeMap::new();
            let mut queue = vec![start];
            let mut k = 0;
            while k < queue.len() && !before.contains_key(start) {
                for &next in &arrows[queue[k]] {
                    if !before.contains_key(next) {
                        before.insert(next, queue[k]);
                        queue.push(next);
                    }
                }
                k += 1;
            }
            let Some(&last) = before.get(start) else { continue };
            let mut circle = vec![last.to_owned()];
            while circle[circle.len() - 1] != start {
                circle.push(before[circle[circle.len() - 1].as_str()].to_owned());
            }
            circle.reverse();
            let first = (0..circle.len()).min_by_key(|&k| &circle[k]).unwrap_or(0);
            circle.rotate_left(first);
            circles.insert(circle);
        }
        circles.into_iter().collect()
    }
}

impl File {
    /// Reads what follows `use` from word `i` on, or a part of it in braces behind `head`; returns the place of its end.
    fn import(&mut self, words: &[&str], mut i: usize, from: &Module, head: &[String], is_passed_on: bool) -> usize {
        let mut names = head.to_vec();
        let mut name = None;
        let word = |i: usize| words.get(i).copied().unwrap_or(";");
        loop {
            match word(i) {
                "{" => {
                    loop {
                        i = self.import(words, i + 1, from, &names, is_passed_on);
                        if word(i) != "," {
                            break;
                        }
                    }
                    names.clear();
                }
                "*" => {
                    let path = Path { from: from.clone(), names: std::mem::take(&mut names) };
                    if !is_passed_on {
                        self.uses.push(path.clone());
                    }
                    self.globs.push(path);
                }
                "as" => {
                    name = Some(word(i + 1).to_owned());
                    i += 1;
                }
                "self" if !names.is_empty() => {}
                part if is_name(part) => names.push(part.to_owned()),
                "::" => {}
                // the end of this part: a comma, a brace or the semicolon
                _ => break,
            }
            i += 1;
        }
        if names.len() > head.len() || (!names.is_empty() && words[i - 1] == "self") || name.is_some() {
            let name = name.unwrap_or_else(|| names[names.len() - 1].clone());
            let path = Path { from: from.clone(), names };
            if is_passed_on {
                self.passed.push((name.clone(), path.clone()));
            } else {
                self.uses.push(path.clone());
            }
            self.imports.insert(name, path);
        }
        i
    }
}

fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_alphabetic() || c == '_')
}
