//! Commands that a Gmsh script may not use unless its user trusts it, and the words of a script.
//!
//! A `.geo` file is a program. Gmsh runs shell commands for it, writes the files that it names, and reads others that may do
//! the same. The description of a body needs none of that. This module reads the words as Gmsh's own scanner does (`Gmsh.l`).
//! It refuses what reading cannot judge: names of files that the script computes, and texts that the scanner would cut.

use std::ops::Range;
use std::path::Path;

/// A forbidden action of a script, with its line.
#[derive(Debug, PartialEq)]
pub struct Breach {
    /// Line, counted from 1.
    pub line: usize,
    /// What the script does, in words.
    pub what: String,
}

/// Return whether a command runs other programs, or text that the script makes up. The last two turn a text into the name of a command.
pub fn runs(name: &str) -> bool {
    const ALL: &str = "SystemCall System NonBlockingSystemCall NonBlockingSystem OnelabRun OnelabAction ExternalProcess Parse Plugin \
                       StringToName S2N";
    ALL.split(' ').any(|known| known == name)
}

/// Commands that write a file or a folder. `Print.Background` and the like are numbers.
const WRITE: [&str; 5] = ["Save", "Print", "CreateDir", "RenameFile", "DeleteFile"];

/// Commands that read a file as a script.
pub const READ: [&str; 3] = ["Include", "Merge", "MergeWithBoundingBox"];

/// Largest length of a text in bytes. Gmsh's scanner cuts texts at 1024 bytes, and reads the rest as commands.
const LONGEST: usize = 1000;

/// Kinds of file that Gmsh hands to a reader of shapes or meshes, whatever their contents.
const DATA: [&str; 12] = ["step", "stp", "iges", "igs", "brep", "stl", "vtk", "unv", "med", "mesh", "bdf", "nas"];

/// Kinds of file that Gmsh reads as a script, or recognizes by how they begin. It starts files of other kinds as programs.
const SCRIPTS: [&str; 8] = ["geo", "pos", "msh", "opt", "inc", "dat", "txt", "par"];

/// Return the first action in a file for which its user must trust it. `home` is the folder that the file may read from.
pub fn breach(path: &Path, bytes: &[u8], home: &Path) -> Option<Breach> {
    if !is_script(path, bytes) {
        return None;
    }
    let text = String::from_utf8_lossy(bytes);
    let at = |byte: usize, what: String| Some(Breach { line: 1 + text[..byte].matches('\n').count(), what });
    if bytes.starts_with(&[0x1f, 0x8b]) {
        return at(0, "is compressed, so that nobody reads what it does".to_owned());
    }
    if let Some(zero) = text.find('\0') {
        return at(zero, "has a zero byte, at which Gmsh ends comments and texts".to_owned());
    }
    let all = tokens(&text);
    for (index, (span, token)) in all.iter().enumerate() {
        let next = all.get(index + 1).map(|(_, token)| *token);
        let what = match *token {
            ScriptToken::Text(text) if text.len() > LONGEST => Some("has a text that is too long for Gmsh".to_owned()),
            ScriptToken::Name(name) if chooses_file(name, &all[..index]) => {
                Some(format!("chooses files that Gmsh writes: `General.{name}`"))
            }
            // A variable of this name is not a command.
            ScriptToken::Name(_) if matches!(next, Some(ScriptToken::Sign('='))) => None,
            ScriptToken::Name(name) if runs(name) => Some(format!("runs other programs or made-up text: `{name}`")),
            ScriptToken::Name(name) if WRITE.contains(&name) && next != Some(ScriptToken::Sign('.')) => {
                Some(format!("writes files: `{name}`"))
            }
            ScriptToken::Name(name @ ("Printf" | "Error" | "Warning")) if redirects(&all[index + 1..]) => {
                Some(format!("writes files: `{name}(...) > ...`"))
            }
            // This includes the form `Solver[0].Executable0`.
            ScriptToken::Name("Solver") if matches!(next, Some(ScriptToken::Sign('.' | '['))) => {
                Some("sets programs: `Solver`".to_owned())
            }
            ScriptToken::Name(name) if READ.contains(&name) => reads(name, &all[index + 1..], path, home),
            _ => None,
        };
        if let Some(what) = what {
            return at(span.start, what);
        }
    }
    None
}

/// Return whether Gmsh reads a file as a script, and does not hand it to a reader of shapes or meshes.
pub fn is_script(path: &Path, bytes: &[u8]) -> bool {
    !is_kind(path, &DATA) && !bytes.starts_with(b"$MeshFormat")
}

type Spot<'a> = (std::ops::Range<usize>, ScriptToken<'a>);

/// Return whether a name is an option of Gmsh that names a file to write. The name of its category may be computed or have an
/// index. Fields and views have a `FileName`, too, which is only read.
fn chooses_file(name: &str, before: &[Spot]) -> bool {
    let is_general = matches!(before, [.., (_, ScriptToken::Name("General")), (_, ScriptToken::Sign('.'))]);
    let is_option = matches!(before, [.., (_, ScriptToken::Sign('.'))]);
    name.ends_with("FileName") && is_option && (is_general || name != "FileName")
}

/// Return whether an argument in parentheses or brackets comes first, and then `>`.
fn redirects(after: &[Spot]) -> bool {
    let mut depth = 0;
    for (at, (_, token)) in after.iter().enumerate() {
        match token {
            ScriptToken::Sign('(' | '[') => depth += 1,
            ScriptToken::Sign(')' | ']') => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return matches!(after.get(at + 1), Some((_, ScriptToken::Sign('>'))));
        }
    }
    false
}

/// Return what is wrong with the file that a command reads. The script must write out its name, its kind must be known, and it
/// must lie below `home`.
fn reads(command: &str, after: &[Spot], path: &Path, home: &Path) -> Option<String> {
    let [(_, ScriptToken::Text(name)), (_, ScriptToken::Sign(';')), ..] = after else {
        return Some(format!("reads a file whose name it makes up: `{command}`"));
    };
    let file = path.parent().unwrap_or(Path::new("")).join(name);
    let known =
        if command == "Include" { !is_kind(&file, &DATA) } else { is_kind(&file, &DATA) || is_kind(&file, &SCRIPTS) };
    if !known {
        return Some(format!("lets Gmsh open a file of unknown kind: `{command} \"{name}\"`"));
    }
    // Gmsh itself reports a file that does not exist.
    let outside = file.canonicalize().is_ok_and(|file| !file.starts_with(home));
    outside.then(|| format!("reads a file outside its own folder: `{command} \"{name}\"`"))
}

/// Return whether the name of a file ends in one of these, in lower or upper case. Gmsh does not recognize a mixture.
pub fn is_kind(path: &Path, kinds: &[&str]) -> bool {
    let end = path.extension().unwrap_or_default();
    kinds.iter().any(|kind| end == *kind || end == kind.to_ascii_uppercase().as_str())
}

/// A word of a script, or a sign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ScriptToken<'a> {
    /// A name or a command.
    Name(&'a str),
    /// A quoted text, without its quotes.
    Text(&'a str),
    /// Any other character.
    Sign(char),
}

/// Return the names, quoted texts and other signs of a script, with the range of bytes where each stands. Comments and numbers
/// are omitted.
pub fn tokens(text: &str) -> Vec<(Range<usize>, ScriptToken<'_>)> {
    let mut tokens = Vec::new();
    let mut at = 0;
    while let Some(first) = text[at..].chars().next() {
        let rest = &text[at..];
        let mut push = |length: usize, token| {
            tokens.push((at..at + length, token));
            length
        };
        at += if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if let Some(comment) = rest.strip_prefix("/*") {
            comment.find("*/").map_or(rest.len(), |end| end + 4)
        } else if first == '"' || first == '\'' {
            let body = &rest[1..];
            let end = body.find(first).unwrap_or(body.len());
            push(rest.len().min(end + 2), ScriptToken::Text(&body[..end]))
        } else if first.is_ascii_alphabetic() || first == '_' {
            let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len());
            push(end, ScriptToken::Name(&rest[..end]))
        } else if first.is_ascii_digit() {
            number(rest)
        } else if first.is_whitespace() {
            first.len_utf8()
        } else {
            push(first.len_utf8(), ScriptToken::Sign(first))
        };
    }
    tokens
}

/// Return the length of the number at the start of a text. A word may follow without a space, and Gmsh reads it as a separate
/// word.
fn number(text: &str) -> usize {
    let digits = |from: usize| text[from..].bytes().take_while(u8::is_ascii_digit).count();
    let mut end = digits(0);
    if text[end..].starts_with('.') {
        end += 1 + digits(end + 1);
    }
    if text[end..].starts_with(['e', 'E']) {
        let sign = usize::from(text[end + 1..].starts_with(['+', '-']));
        match digits(end + 1 + sign) {
            0 => {}
            exponent => end += 1 + sign + exponent,
        }
    }
    end
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict(text: &str) -> Option<String> {
        breach(Path::new("a.geo"), text.as_bytes(), Path::new("/nowhere")).map(|breach| breach.what)
    }

    #[test]
    fn commands_that_run_or_write_are_refused() {
        for (text, expected) in [
            ("SystemCall \"id\";", "`SystemCall`"),
            ("x = 1;System 'id';", "`System`"),
            ("If (1)NonBlockingSystemCall \"id\";", "`NonBlockingSystemCall`"),
            ("OnelabRun(\"a\", \"id\");", "`OnelabRun`"),
            ("Field[1] = ExternalProcess;", "`ExternalProcess`"),
            ("Plugin(Distance).Run;", "`Plugin`"),
            ("Save \"../a.msh\";", "writes files: `Save`"),
            ("Save View[0] \"a\";", "writes files: `Save`"),
            ("Print StrCat(\"a\", \"b\");", "writes files: `Print`"),
            ("Printf(\"a %g\", f(1)) >> \"a.txt\";", "`Printf(...) > ...`"),
            ("CreateDir \"a\";", "`CreateDir`"),
            ("Include StrCat(\"a\", \"b\");", "a file whose name it makes up: `Include`"),
            ("Merge name;", "a file whose name it makes up: `Merge`"),
            ("Merge \"a.py\";", "unknown kind: `Merge \"a.py\"`"),
            ("Merge \"a.sTEP\";", "unknown kind"),
            ("Include \"a.step\";", "unknown kind"),
            ("Include \"/etc/passwd\";", "outside its own folder"),
            ("Solver.Executable0 = \"id\";", "`Solver`"),
            ("General.ErrorFileName = \"../a\";", "`General.ErrorFileName`"),
            ("General[0].ErrorFileName = \"../a\";", "`General.ErrorFileName`"),
            ("Solver[0].Executable0 = \"id\";", "`Solver`"),
            ("S2N[\"SystemCall\"] \"id\";", "`S2N`"),
            ("StringToName[StrCat(\"Sys\", \"tem\")] \"id\";", "`StringToName`"),
            ("// \0 SystemCall \"id\";", "zero byte"),
            ("\u{1f}", ""),
        ] {
            let found = verdict(text);
            assert_eq!(found.is_some(), !expected.is_empty(), "{text}: {found:?}");
            assert!(found.unwrap_or_default().contains(expected), "{text}: {expected}");
        }
        let long = format!("a = \"{} SystemCall 'id'; \";", "x".repeat(1100));
        assert!(verdict(&long).is_some_and(|what| what.contains("too long")));
        assert!(breach(Path::new("a.pos"), &[0x1f, 0x8b, 8], Path::new("/")).is_some());
    }

    #[test]
    fn scripts_that_describe_bodies_pass() {
        for text in [
            "// SystemCall \"id\";\nPoint(1) = {0, 0, 0}; /* Save \"a\"; */",
            "Printf(\"a > b\"); If (f(1) > f(2)) Print.Background = 1; EndIf",
            "Physical Surface(\"Save\") = {1}; Mesh.SaveAll = 1; Systematic = 3; System = 2;",
            "Merge \"part.step\"; Merge 'sizes.pos'; Include \"not there\";",
            "Error(\"n must be greater than %g\", 3);",
            "myFileName = \"a\"; Field[1] = Structured; Field[1].FileName = myFileName;",
        ] {
            assert_eq!(verdict(text), None, "{text}");
        }
        assert_eq!(breach(Path::new("a.STEP"), b"'SystemCall'Print \"x\"", Path::new("/")), None);
        assert_eq!(breach(Path::new("a.msh"), b"$MeshFormat\n\0Print \"x\"", Path::new("/")), None);
        assert!(breach(Path::new("a.msh"), b" Print \"x\"", Path::new("/")).is_some());
    }

    #[test]
    fn the_line_is_told() {
        let found = breach(Path::new("a.geo"), b"a = 1;\n\n  Save \"x\";", Path::new("/"));
        assert_eq!(found.map(|breach| breach.line), Some(3));
    }

    #[test]
    fn words_end_where_gmsh_ends_them() {
        use ScriptToken::{Name, Sign, Text};
        let of = |text: &'static str| tokens(text).into_iter().map(|(_, token)| token).collect::<Vec<_>>();
        assert_eq!(of("a1 = 3Save 'x\"y'; // Print\n"), [Name("a1"), Sign('='), Name("Save"), Text("x\"y"), Sign(';')]);
        assert_eq!(of("1e-3 2.5E+7e 4..e /* \" */ \"open"), [Name("e"), Sign('.'), Name("e"), Text("open")]);
        assert_eq!(tokens("ä_b")[1].0, 2..4);
    }
}
