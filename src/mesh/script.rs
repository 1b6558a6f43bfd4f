//! The facts about a `.geo` script that matter before Gmsh runs it: which files it reads, and which names a number can
//! be set for. Scripts that follow a field of sizes are made here, too.
//!
//! This is a search through its words, not an interpreter. A script is a program: it may read the clock, the
//! environment, or files whose names it computes. The mesh of a script that does so, as its words tell, is made anew in
//! each run.

use super::foreign::is_data;
use crate::error::{Error, Kind, Located, Result};
use crate::file::write;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A script and all files that it reads.
#[derive(Debug, Default)]
pub struct Script {
    /// Paths of the script itself and of every file that it names, in order of first appearance.
    pub paths: Vec<PathBuf>,
    /// Contents of these files.
    pub files: Vec<Vec<u8>>,
    /// Whether these files alone may not determine the mesh.
    pub may_change: bool,
    /// All names and quoted texts.
    words: BTreeSet<String>,
}

impl Script {
    /// Read the script and the files that it includes or merges. The shape of another program is read alike: it has no
    /// words.
    ///
    /// # Errors
    /// The script cannot be read. Gmsh reports included files that do not exist.
    pub fn read(path: &Path) -> Result<Script> {
        let mut script = Script::default();
        path.canonicalize().map_err(|cause| Error::file(path, "read", &cause))?;
        let mut found: Vec<PathBuf> = located(path).into_iter().collect();
        let mut next = 0;
        while let Some(path) = found.get(next).cloned() {
            next += 1;
            let bytes = crate::file::read(&path)?;
            let folder = path.parent().unwrap_or(Path::new(""));
            // shapes and meshes have no words of a script
            let text = if is_data(&path) { "".into() } else { String::from_utf8_lossy(&bytes) };
            let tokens: Vec<ScriptToken> = tokens(&text).into_iter().map(|(_, token)| token).collect();
            // Gmsh looks for a file beside the one that names it. Every quoted name of a file counts, so that `Merge
            // "part.step"` and the like need no list of commands.
            let named = tokens.iter().filter_map(|token| match token {
                ScriptToken::Text(name) => Some(folder.join(name)),
                _ => None,
            });
            for file in named.chain([options_of(&path)]).filter_map(|file| located(&file)) {
                if file.is_file() && !found.contains(&file) {
                    found.push(file);
                }
            }
            script.may_change |= may_change(&tokens);
            script.words.extend(tokens.iter().filter_map(|token| match token {
                ScriptToken::Name(word) | ScriptToken::Text(word) => Some((*word).to_owned()),
                ScriptToken::Sign(_) => None,
            }));
            script.files.push(bytes);
        }
        Ok(Script { paths: found, ..script })
    }

    /// Return whether the last line is ended. Otherwise Gmsh silently omits the last command, unless another script
    /// includes this one.
    pub fn is_ended(&self) -> bool {
        self.files.first().is_none_or(|text| text.ends_with(b"\n"))
    }

    /// Check that a number set from outside can take effect.
    ///
    /// # Errors
    /// No file of the script has the name.
    pub fn check(&self, name: &Located<String>, file: &Path) -> Result<()> {
        let Located { value: name, place } = name;
        if self.words.contains(name) {
            return Ok(());
        }
        let otherwise = || format!("write `DefineConstant[ {name} = {{..., Name \"{name}\"}} ];` in the script");
        let error = Error::scene(place, format!("{} has no number `{name}` to set", file.display()));
        Err(error.suggest(name, self.words.iter().map(String::as_str), otherwise))
    }
}

/// Words of Gmsh whose values are not those of the script's files: the clock, the memory, random numbers, the
/// environment, paths, and what other programs say.
const CHANGING: [&str; 19] = [
    "Cpu",
    "Memory",
    "TotalMemory",
    "Today",
    "Rand",
    "GetEnv",
    "FileExists",
    "CurrentDirectory",
    "CurrentDir",
    "CurrentFileName",
    "AbsolutePath",
    "GmshExecutableName",
    "SystemCall",
    "System",
    "NonBlockingSystemCall",
    "OnelabRun",
    "ExternalProcess",
    "Parse",
    "Plugin",
];

/// Return whether a part of a script has a word whose value may change, or reads a file whose name it computes.
fn may_change(tokens: &[ScriptToken]) -> bool {
    tokens.iter().zip(tokens.iter().skip(1)).any(|(token, next)| match (token, next) {
        (ScriptToken::Name("Include" | "Merge"), ScriptToken::Text(_)) => false,
        // a variable of this name
        (_, ScriptToken::Sign('=')) => false,
        (ScriptToken::Name(name), _) => CHANGING.contains(name) || ["Include", "Merge"].contains(name),
        _ => false,
    })
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

/// Return the path of a file with the links of its folder resolved. A link to the file itself is not resolved, because
/// Gmsh looks for other files beside the link. Scripts may include each other along ever longer paths, which become
/// equal in this form.
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

/// What Gmsh says of a script whose mesh is larger than its shape. Fields of sizes are evaluated on the shape, and
/// sizes are known on the mesh.
const SCALED: &str = "Mesh.ScalingFactor must be 1 where meshes follow sizes: scale the shape (Dilate) instead";

/// Write a script into the folder `work` that meshes another script to a field of sizes, and return its path.
///
/// `field` is a view of Gmsh (`.pos`). Where a point is in none of the view's cells, Gmsh would make cells as large as
/// the part, so the script limits sizes to the largest of the view. A smallest size that the other script sets
/// (`Mesh.MeshSizeMin`) gives way to the smallest of the view, and a factor on sizes (`Mesh.MeshSizeFactor`) to one.
/// Structured meshes cannot follow sizes, so their commands are removed in a copy.
///
/// # Errors
/// A structured script reads other files, which a copy would not find. The folder cannot be written.
pub fn sized(file: &Located<PathBuf>, read: &Script, field: &str, work: &Path) -> Result<PathBuf> {
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

/// Return a field of sizes on simplices as a view of Gmsh. `corners` holds the corners of all simplices, `stride` of
/// them each, and `sizes` the size at each corner.
pub fn view(stride: usize, corners: &[[f64; 3]], sizes: &[f64]) -> String {
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

/// A word of a script, or a sign.
#[derive(Debug, Clone, Copy, PartialEq)]
enum ScriptToken<'a> {
    /// A name or a command.
    Name(&'a str),
    /// A quoted text, without its quotes.
    Text(&'a str),
    /// Any other character.
    Sign(char),
}

/// Return the names, quoted texts and other signs of a script, with the range of bytes where each stands. Comments and
/// numbers are omitted.
fn tokens(text: &str) -> Vec<(Range<usize>, ScriptToken<'_>)> {
    let mut tokens = Vec::new();
    let mut at = 0;
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    while let Some(first) = text[at..].chars().next() {
        let rest = &text[at..];
        let word = rest.find(|c: char| !is_word(c)).unwrap_or(rest.len());
        let (length, token) = match first {
            '/' if rest.starts_with("//") => (rest.find('\n').unwrap_or(rest.len()), None),
            '/' if rest.starts_with("/*") => (rest[2..].find("*/").map_or(rest.len(), |end| end + 4), None),
            '"' | '\'' => {
                let body = &rest[1..];
                let end = body.find(first).unwrap_or(body.len());
                (rest.len().min(end + 2), Some(ScriptToken::Text(&body[..end])))
            }
            _ if first.is_ascii_digit() => (word, None),
            _ if is_word(first) => (word, Some(ScriptToken::Name(&rest[..word]))),
            _ if first.is_whitespace() => (first.len_utf8(), None),
            _ => (first.len_utf8(), Some(ScriptToken::Sign(first))),
        };
        tokens.extend(token.map(|token| (at..at + length, token)));
        at += length;
    }
    tokens
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_no_file_names_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.geo");
        let script = "// slip = 3;  /* not here */\nDefineConstant[ n = {32, Min 1, Name \"n\"} ];\n\
                      DefineConstant[ h = {1e-3, Name \"Sizes/h\"} ];\nIf(!Exists(length)) length = 4; EndIf\n";
        std::fs::write(&path, script).unwrap();
        let script = Script::read(&path).unwrap();
        let verdict = |name: &str| script.check(&Located::here(name), &path).err().map(|error| error.to_string());
        assert!(["n", "h", "Sizes/h", "length"].into_iter().all(|name| verdict(name).is_none()));
        for (name, expected) in [
            ("slip", "has no number `slip` to set"),
            ("lenght", "did you mean `length`?"),
            ("e", "has no number `e` to set"),
            ("thickness", "write `DefineConstant[ thickness"),
        ] {
            let error = verdict(name).unwrap_or_default();
            assert!(error.contains(expected), "{name}: {error}");
        }
    }

    /// Gmsh reads `a.geo.opt` after `a.geo`, and looks for the files that a linked script names beside the link.
    #[test]
    fn files_are_found_where_gmsh_finds_them() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &[u8]| std::fs::write(folder.path().join(name), text).unwrap();
        let files = |name: &str| Script::read(&folder.path().join(name)).unwrap().files;
        for part in ["sub", "real"] {
            std::fs::create_dir(folder.path().join(part)).unwrap();
        }
        write("a.geo", b"Include \"sub/b.geo\"; Merge 'sub/c.stl';");
        write("sub/b.geo", b"n = 1; Include \"c.stl\"; Include \"../a.geo\";");
        write("sub/c.stl", &[0xff, b'"', 0x80]);
        write("sub/c.stl.opt", b"m = 1;");
        assert_eq!(files("a.geo").len(), 4);
        write("real/e.geo", b"Include \"f.geo\";\n");
        write("real/f.geo", b"n = 1;\n");
        write("sub/f.geo", b"n = 2;\n");
        std::os::unix::fs::symlink("../real/e.geo", folder.path().join("sub/e.geo")).unwrap();
        assert_eq!(files("sub/e.geo")[1], b"n = 2;\n");
    }

    #[test]
    fn what_files_do_not_determine_is_seen() {
        let changes = |text: &str| may_change(&tokens(text).into_iter().map(|(_, token)| token).collect::<Vec<_>>());
        for text in ["x = 1 + Rand(0.5);", "s = GetEnv(\"N\");", "Merge StrCat(s, \"x\");", "SystemCall \"id\";"] {
            assert!(changes(text), "{text}");
        }
        for text in
            ["n = 3; Include \"a.geo\"; // Rand(1)", "Merge \"a.step\"; Merge 'b.pos';", "System = 3; y = 1e-3;"]
        {
            assert!(!changes(text), "{text}");
        }
    }

    #[test]
    fn paths_are_quoted_as_gmsh_reads_them() {
        let of = |text: &str| quoted(Path::new(text)).ok();
        assert_eq!(of("/a'b/c.geo").as_deref(), Some("\"/a'b/c.geo\""));
        assert_eq!(of("/a\"b/c.geo").as_deref(), Some("'/a\"b/c.geo'"));
        assert_eq!(of("/a\"b'/c.geo"), None);
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
