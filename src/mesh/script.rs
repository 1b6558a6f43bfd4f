//! The facts about a `.geo` script that matter before Gmsh runs it: which files and other inputs it reads, and which numbers can be set
//! from outside.
//!
//! This is a search through its text, not an interpreter: a file whose name the script computes is not seen. The values of environment
//! variables belong to the key of its mesh in the cache. Other inputs besides files are unknown before Gmsh runs, so a mesh that depends
//! on them cannot be cached. Scripts that follow a field of sizes are made here, too.

use super::cache::write;
use super::trust::{self, READ, ScriptToken, runs, tokens};
use crate::error::{Error, Kind, Located, Place, Result};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// A script and all files that it reads.
#[derive(Debug, Default)]
pub struct Script {
    /// Contents of the script itself and of every file that it names, in order of first appearance.
    pub files: Vec<Vec<u8>>,
    /// Other inputs that the script depends on.
    pub inputs: Inputs,
    /// Names that take a number from outside.
    settable: BTreeSet<String>,
    /// Pairs of a constant and the other name under which its number is set.
    aliases: Vec<(String, String)>,
    /// Names to which the script itself assigns a value.
    assigned: BTreeSet<String>,
    /// All names.
    mentioned: BTreeSet<String>,
    /// The file and the command for which the user must trust the script, if there is one.
    breach: Option<(PathBuf, trust::Breach)>,
}

impl Script {
    /// Read the script and the files that it includes or merges.
    ///
    /// # Errors
    /// The script cannot be read. Gmsh reports included files that do not exist.
    pub fn read(path: &Path) -> Result<Script> {
        let mut script = Script::default();
        path.canonicalize().map_err(|cause| Error::file(path, "read", &cause))?;
        let mut found: Vec<PathBuf> = located(path).into_iter().collect();
        let home = found.first().and_then(|first| first.parent()).unwrap_or(Path::new("")).to_owned();
        let mut next = 0;
        while let Some(path) = found.get(next).cloned() {
            next += 1;
            let bytes = crate::file::read(&path)?;
            // Gmsh looks for a file beside the one that names it. Every quoted name of a file counts, so that `Merge
            // "part.step"` and the like need no list of commands.
            let folder = path.parent().unwrap_or(Path::new(""));
            let text = String::from_utf8_lossy(&bytes);
            let tokens: Vec<ScriptToken> = tokens(&text).into_iter().map(|(_, token)| token).collect();
            let named =
                tokens.iter().filter_map(|token| if let ScriptToken::Text(name) = token { Some(name) } else { None });
            let named = named.map(|name| folder.join(name));
            for file in named.chain([options_of(&path)]).filter_map(|file| located(&file)) {
                if file.is_file() && !found.contains(&file) {
                    found.push(file);
                }
            }
            script.note(&tokens);
            if trust::is_script(&path, &bytes) {
                script.inputs.note(&tokens);
            }
            if script.breach.is_none() {
                script.breach = trust::breach(&path, &bytes, &home).map(|breach| (path, breach));
            }
            script.files.push(bytes);
        }
        Ok(script)
    }

    /// Read the shape of another program. Gmsh reads it as data, so nothing in it is a script.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn of_shape(path: &Path) -> Result<Script> {
        Ok(Script { files: vec![crate::file::read(path)?], ..Script::default() })
    }

    /// Return whether the last line is ended. Otherwise Gmsh silently omits the last command, unless another script includes
    /// this one.
    pub fn is_ended(&self) -> bool {
        self.files.first().is_none_or(|text| text.ends_with(b"\n"))
    }

    /// Record the names in a part of the script.
    fn note(&mut self, tokens: &[ScriptToken]) {
        use ScriptToken::{Name, Sign, Text};
        // The depth counts brackets inside `DefineConstant[ ... ]` and is 0 outside. The constant is the one being defined
        // there.
        let mut depth = 0;
        let mut constant: Option<&str> = None;
        for (at, token) in tokens.iter().enumerate() {
            let after = &tokens[at + 1..];
            let before = at.checked_sub(1).map(|at| tokens[at]);
            match token {
                Name("DefineConstant") => depth = 0,
                Sign('[') if depth == 0 && before == Some(Name("DefineConstant")) => depth = 1,
                Sign('[' | '{' | '(') if depth > 0 => depth += 1,
                Sign(']' | '}' | ')') if depth > 0 => depth -= 1,
                Name("Exists") => {
                    if let [Sign('('), Name(name), ..] = after {
                        self.settable.insert((*name).to_owned());
                    }
                }
                Name("Name") if depth != 1 => {
                    if let [Text(label), ..] = after {
                        self.settable.insert((*label).to_owned());
                        if let Some(name) = constant.filter(|name| name != label) {
                            self.settable.remove(name);
                            self.aliases.push((name.to_owned(), (*label).to_owned()));
                        }
                    }
                }
                Name(name) if depth == 1 && matches!(before, Some(Sign('[' | ','))) => {
                    constant = Some(name);
                    self.settable.insert((*name).to_owned());
                }
                Name(name) if depth == 0 && matches!(after, [Sign('='), second, ..] if *second != Sign('=')) => {
                    self.assigned.insert((*name).to_owned());
                }
                _ => {}
            }
            if depth == 0 {
                constant = None;
            }
            if let Name(name) = token {
                self.mentioned.insert((*name).to_owned());
            }
        }
    }

    /// Check that the script does nothing to the machine except describe bodies.
    ///
    /// # Errors
    /// The script does more. The error says what, with the line.
    pub fn judge(&self, file: &Located<PathBuf>) -> Result<()> {
        let Some((path, breach)) = &self.breach else { return Ok(()) };
        let shown = if located(&file.value).as_ref() == Some(path) { &file.value } else { path };
        Err(Error::mesh(shown, Some(breach.line), format!("this script {}", breach.what))
            .at(&file.place)
            .help("Gmsh runs a script as a program: read it, and if you trust it give --trust-geo"))
    }

    /// Check that a number set from outside takes effect.
    ///
    /// # Errors
    /// The script never mentions the name, or it overwrites the value.
    pub fn check(&self, name: &str, file: &Path, place: &Place) -> Result<()> {
        if self.settable.contains(name) {
            return Ok(());
        }
        let error = |message: String| Error::scene(place, message);
        let shown = file.display();
        if let Some((_, label)) = self.aliases.iter().find(|(constant, _)| constant == name) {
            return Err(error(format!("Gmsh knows `{name}` of {shown} as `{label}`"))
                .help(format!("set `\"{label}\"`, or write `Name \"{name}\"` in the script")));
        }
        if self.assigned.contains(name) {
            return Err(error(format!("{shown} gives `{name}` a value itself, so setting it has no effect"))
                .help(format!("write `DefineConstant[ {name} = {{..., Name \"{name}\"}} ];` in the script")));
        }
        if self.mentioned.contains(name) {
            return Ok(());
        }
        let known: Vec<&str> = self.settable.iter().map(String::as_str).collect();
        let otherwise = || match known.is_empty() {
            true => format!("write `DefineConstant[ {name} = {{..., Name \"{name}\"}} ];` in the script"),
            false => format!("it has: {}", known.join(", ")),
        };
        Err(error(format!("{shown} has no number `{name}` to set")).suggest(name, known.iter().copied(), otherwise))
    }
}

/// Return a path as a text in a script. Gmsh has no escapes, but two kinds of quotes.
///
/// # Errors
/// The path has both kinds of quotes.
pub fn quoted(path: &Path) -> Result<String> {
    let text = path.display().to_string();
    match (text.contains('"'), text.contains('\'')) {
        (false, _) => Ok(format!("\"{text}\"")),
        (true, false) => Ok(format!("'{text}'")),
        (true, true) => Err(Error::new(Kind::File, format!("{text} has quotes of both kinds in its path"))
            .help("Gmsh cannot read it: rename the file or its folder")),
    }
}

/// Return the path of a file with the links of its folder resolved. A link to the file itself is not resolved, because Gmsh
/// looks for other files beside the link. Scripts may include each other along ever longer paths, which become equal in this
/// form.
fn located(path: &Path) -> Option<PathBuf> {
    let folder = path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
    Some(folder.canonicalize().ok()?.join(path.file_name()?))
}

/// Return the file of options beside a file. Gmsh runs it as a script after it has opened or merged the file.
fn options_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".opt");
    name.into()
}

/// Words of Gmsh whose values differ between runs or places. They stand for the clock, the memory, random numbers, whether a
/// file exists, and the paths of the script and the program.
const CHANGING: &str = "Cpu Memory TotalMemory Today Rand FileExists CurrentDirectory CurrentDir CurrentFileName AbsolutePath \
                        GmshExecutableName";

/// The variable that this program sets for Gmsh, to another value each time.
const HOME: &str = "GMSH_HOME";

/// The inputs of a script besides files.
#[derive(Debug, Default)]
pub struct Inputs {
    /// Names of the environment variables that the script reads.
    pub variables: BTreeSet<String>,
    /// The first word whose value is unknown before Gmsh runs, if there is one.
    pub unknown: Option<String>,
}

impl Inputs {
    /// Add the inputs of a part of the script.
    pub fn note(&mut self, tokens: &[ScriptToken]) {
        use ScriptToken::{Name, Sign, Text};
        for (at, token) in tokens.iter().enumerate() {
            let Name(name) = *token else { continue };
            let after = &tokens[at + 1..];
            let is_unknown = match (name, after) {
                ("GetEnv", [Sign('(' | '['), Text(variable), Sign(')' | ']'), ..]) if *variable != HOME => {
                    self.variables.insert((*variable).to_owned());
                    false
                }
                ("GetEnv", _) => true,
                (_, [Sign('='), ..]) => false,
                (_, [Text(_), Sign(';'), ..]) if READ.contains(&name) => false,
                _ => CHANGING.split(' ').any(|word| word == name) || runs(name) || READ.contains(&name),
            };
            if is_unknown {
                self.unknown.get_or_insert_with(|| name.to_owned());
            }
        }
    }

    /// Return the variables with their values.
    pub fn environment(&self) -> Vec<(&str, Option<Vec<u8>>)> {
        let value = |name: &str| std::env::var_os(name).map(|value| value.as_encoded_bytes().to_vec());
        self.variables.iter().map(|name| (name.as_str(), value(name))).collect()
    }
}

/// What Gmsh says of a script whose mesh is larger than its shape. Fields of sizes are evaluated on the shape, and sizes are known on the mesh.
const SCALED: &str = "Mesh.ScalingFactor must be 1 where meshes follow sizes: scale the shape (Dilate) instead";

/// Write a script into the folder `work` that meshes another script to a field of sizes, and return its path.
///
/// `field` is a view of Gmsh (`.pos`). Where a point is in none of the view's cells, Gmsh would make cells as large as the
/// part, so the script limits sizes to the largest of the view. A smallest size that the other script sets (`Mesh.MeshSizeMin`) gives way to
/// the smallest of the view, and a factor on sizes (`Mesh.MeshSizeFactor`) to one. Structured meshes cannot follow sizes, so their commands are removed in a copy.
///
/// # Errors
/// A structured script reads other files, which a copy would not find. The folder cannot be written.
pub(super) fn script(file: &Located<PathBuf>, read: &Script, field: &str, work: &Path) -> Result<PathBuf> {
    let own = read.files.first().map_or(String::new(), |bytes| String::from_utf8_lossy(bytes).into_owned());
    let free = unstructured(&own);
    let mut script = std::path::absolute(&file.value).map_err(|cause| Error::file(&file.value, "find", &cause))?;
    if free != own {
        if read.files.len() > 1 {
            let message = format!("{} makes a structured mesh and reads other files", file.value.display());
            return Err(Error::scene(&file.place, message)
                .help("take `Transfinite` and `Recombine` out of it: such a mesh cannot follow sizes"));
        }
        script = work.join("free.geo");
        write(&script, free)?;
    }
    let sizes = work.join("sizes.pos");
    write(&sizes, field)?;
    let text = format!(
        "Include {};\nIf (Mesh.ScalingFactor != 1)\nError(\"{SCALED}\");\nExit;\nEndIf\n\
         Mesh.MeshSizeExtendFromBoundary = 0;\nMesh.MeshSizeFromPoints = 0;\nMesh.MeshSizeFactor = 1;\n\
         Merge {};\nBackground Mesh View[PostProcessing.NbViews - 1];\n\
         Mesh.MeshSizeMax = View[PostProcessing.NbViews - 1].Max;\n\
         If (Mesh.MeshSizeMin > View[PostProcessing.NbViews - 1].Min)\n\
         Mesh.MeshSizeMin = View[PostProcessing.NbViews - 1].Min;\nEndIf\n",
        quoted(&script)?,
        quoted(&sizes)?
    );
    let made = work.join("sized.geo");
    write(&made, text).map(|()| made)
}

/// Return the script without the commands that ask for structured meshes, from the word to the semicolon.
pub fn unstructured(text: &str) -> String {
    let mut kept = String::with_capacity(text.len());
    let mut from = 0;
    for (span, token) in tokens(text) {
        let structured = matches!(token, ScriptToken::Name("Transfinite" | "TransfQuadTri" | "Recombine"));
        if structured && span.start >= from {
            kept.push_str(&text[from..span.start]);
            from = text[span.end..].find(';').map_or(text.len(), |end| span.end + end + 1);
        }
    }
    kept + &text[from..]
}

/// Return a field of sizes on simplices as a view of Gmsh. `corners` holds the corners of all simplices, `stride` of them each,
/// and `sizes` the size at each corner.
pub fn view(stride: usize, corners: &[[f64; 3]], sizes: &[f64]) -> String {
    use std::fmt::Write;
    let mut text = String::from("View \"sizes\" {\n");
    let list = |values: &mut dyn Iterator<Item = f64>| values.map(|v| format!("{v:e}")).collect::<Vec<_>>().join(",");
    for (x, size) in corners.chunks_exact(stride).zip(sizes.chunks_exact(stride)) {
        let at = list(&mut x.iter().flatten().copied());
        let size = list(&mut size.iter().copied());
        // Writing to a String cannot fail.
        let _ = writeln!(text, "S{}({at}){{{size}}};", if stride == 3 { "T" } else { "S" });
    }
    text + "};\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::trust::tokens;

    fn verdict(text: &str, name: &str) -> Option<String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.geo");
        std::fs::write(&path, text).unwrap();
        let script = Script::read(&path).unwrap();
        script.check(name, &path, &Place::here("mesh")).err().map(|error| error.to_string())
    }

    const SCRIPT: &str = r#"
        // slip = 3;  /* not here */
        DefineConstant[ n = {32, Min 1, Name "n"}, plain = 4 ];
        DefineConstant[ h = {1e-3, Name "Sizes/h"} ];
        If(!Exists(length)) length = 4; EndIf
        fixed = 2;
        Point(1) = {free, n == fixed, 0};
    "#;

    #[test]
    fn numbers_that_arrive_pass() {
        for name in ["n", "plain", "Sizes/h", "length", "free"] {
            assert_eq!(verdict(SCRIPT, name), None, "{name}");
        }
    }

    #[test]
    fn numbers_that_would_be_lost_are_refused_with_a_way_out() {
        for (name, expected) in [
            ("slip", "has no number `slip` to set"),
            ("lenght", "did you mean `length`?"),
            ("fixed", "gives `fixed` a value itself"),
            ("h", "as `Sizes/h`"),
            ("e", "has no number `e` to set"),
            ("thickness", "it has: Sizes/h, length, n, plain"),
        ] {
            let error = verdict(SCRIPT, name).unwrap_or_default();
            assert!(error.contains(expected), "{name}: {error}");
        }
        assert!(verdict("Point(1) = {0, 0, 0};", "n").unwrap().contains("write `DefineConstant[ n"));
    }

    #[test]
    fn files_are_followed_once_and_through_folders() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("parts")).unwrap();
        std::fs::write(folder.path().join("a.geo"), "Include \"parts/b.geo\"; Merge 'parts/c.stl';").unwrap();
        std::fs::write(folder.path().join("parts/b.geo"), "n = 1; Include \"c.stl\"; Include \"../a.geo\";").unwrap();
        std::fs::write(folder.path().join("parts/c.stl"), [0xff, b'"', 0x80]).unwrap();
        let script = Script::read(&folder.path().join("a.geo")).unwrap();
        assert!(script.assigned.contains("n"));
        assert!(script.files[0].starts_with(b"Include"));
        assert_eq!(script.files.len(), 3);
    }

    #[test]
    fn paths_are_quoted_as_gmsh_reads_them() {
        let of = |text: &str| quoted(Path::new(text)).ok();
        assert_eq!(of("/a b/c.geo").as_deref(), Some("\"/a b/c.geo\""));
        assert_eq!(of("/a'b/c.geo").as_deref(), Some("\"/a'b/c.geo\""));
        assert_eq!(of("/a\"b/c.geo").as_deref(), Some("'/a\"b/c.geo'"));
        assert_eq!(of("/a\"b'/c.geo"), None);
    }

    /// The line of the breach is that of the file with it, also where that file is called like the script.
    #[test]
    fn a_breach_is_shown_in_its_own_file() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("parts")).unwrap();
        let script = folder.path().join("a.geo");
        std::fs::write(&script, "Include \"parts/a.geo\";\n").unwrap();
        std::fs::write(folder.path().join("parts/a.geo"), "SystemCall \"id\";\n").unwrap();
        let file = Located::new(script.clone(), Place::here("mesh"));
        let error = Script::read(&script).unwrap().judge(&file).unwrap_err().to_string();
        assert!(error.contains("parts/a.geo:1"), "{error}");
    }

    /// Gmsh reads `a.geo.opt` after `a.geo`. It looks for the files that a linked script names beside the link.
    #[test]
    fn files_are_found_where_gmsh_finds_them() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        let breach = |name: &str| Script::read(&folder.path().join(name)).unwrap().breach.map(|(path, _)| path);
        for part in ["sub", "real"] {
            std::fs::create_dir(folder.path().join(part)).unwrap();
        }
        write("a.geo", "n = 1;\n");
        assert_eq!(breach("a.geo"), None);
        write("a.geo.opt", "SystemCall \"id\";\n");
        assert!(breach("a.geo").is_some_and(|path| path.ends_with("a.geo.opt")));
        write("b.geo", "Merge \"c.step\";\n");
        write("c.step", "");
        write("c.step.opt", "Merge \"d.opt\";\n");
        write("d.opt", "Save \"x\";\n");
        assert!(breach("b.geo").is_some_and(|path| path.ends_with("d.opt")));
        write("real/e.geo", "Include \"f.geo\";\n");
        write("real/f.geo", "n = 1;\n");
        write("sub/f.geo", "Save \"x\";\n");
        std::os::unix::fs::symlink("../real/e.geo", folder.path().join("sub/e.geo")).unwrap();
        assert_eq!(breach("real/e.geo"), None);
        assert!(breach("sub/e.geo").is_some_and(|path| path.ends_with("sub/f.geo")));
    }

    fn of(text: &str) -> (Vec<String>, Option<String>) {
        let mut inputs = Inputs::default();
        inputs.note(&tokens(text).into_iter().map(|(_, token)| token).collect::<Vec<_>>());
        (inputs.variables.into_iter().collect(), inputs.unknown)
    }

    #[test]
    fn what_a_script_depends_on_is_seen() {
        let names = |list: &[&str]| list.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        for (text, variables, unknown) in [
            ("n = 3; Include \"a.geo\"; // Rand(1)", &[][..], None),
            ("Printf(GetEnv(\"N\")); s = Str(GetEnv[\"M\"]);", &["M", "N"], None),
            ("s = GetEnv(StrCat(\"N\", \"M\"));", &[], Some("GetEnv")),
            ("s = GetEnv(\"GMSH_HOME\");", &[], Some("GetEnv")),
            ("x = 1 + Rand(0.5);", &[], Some("Rand")),
            ("x = Cpu;", &[], Some("Cpu")),
            ("If (FileExists(\"a.step\")) n = 2; EndIf", &[], Some("FileExists")),
            ("s = Str(CurrentDirectory, \"x\");", &[], Some("CurrentDirectory")),
            ("Merge StrCat(s, \"x\");", &[], Some("Merge")),
            ("Merge \"a.step\"; Merge 'b.pos';", &[], None),
            ("SystemCall \"id\";", &[], Some("SystemCall")),
            ("System = 3; y = GetNumber(\"x\", 3);", &[], None),
        ] {
            assert_eq!(of(text), (names(variables), unknown.map(str::to_owned)), "{text}");
        }
    }

    #[test]
    fn structured_commands_go_and_nothing_else() {
        let text = "n = 3; // Transfinite;\nTransfinite Curve {1, 2} = n + 1 Using Progression 1.1;\n\
                    Recombine Surface{1};\nPhysical Surface(\"Transfinite;\") = {1};\nmyTransfinite = 2;\n";
        let expected = "n = 3; // Transfinite;\n\n\nPhysical Surface(\"Transfinite;\") = {1};\nmyTransfinite = 2;\n";
        assert_eq!(unstructured(text), expected);
        assert_eq!(unstructured("a = 'x"), "a = 'x");
    }

    #[test]
    fn a_view_has_a_line_for_each_simplex() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(
            view(3, &corners, &[0.5, 0.25, 1.0]),
            "View \"sizes\" {\nST(0e0,0e0,0e0,1e0,0e0,0e0,0e0,1e0,0e0){5e-1,2.5e-1,1e0};\n};\n"
        );
    }
}
