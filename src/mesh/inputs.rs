//! The inputs that a script depends on besides the files that it reads.
//!
//! The values of environment variables belong to the key of its mesh in the cache. Other inputs are unknown before Gmsh runs,
//! so a mesh that depends on them cannot be cached.

use super::tokens::Token;
use super::trust::{READ, RUN};
use std::collections::BTreeSet;

/// Words of Gmsh whose values differ between runs or places. They stand for the clock, the memory, random numbers, whether a
/// file exists, and the paths of the script and the program.
const CHANGING: [&str; 11] = [
    "Cpu",
    "Memory",
    "TotalMemory",
    "Today",
    "Rand",
    "FileExists",
    "CurrentDirectory",
    "CurrentDir",
    "CurrentFileName",
    "AbsolutePath",
    "GmshExecutableName",
];

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
    pub fn note(&mut self, tokens: &[Token]) {
        use Token::{Name, Sign, Text};
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
                _ => CHANGING.contains(&name) || RUN.contains(&name) || READ.contains(&name),
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

#[cfg(test)]
mod tests {
    use super::super::tokens::tokens;
    use super::*;

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
}
