//! Keys and values of scenes that earlier versions knew, each with what to use instead.

use crate::error::Error;

/// Names that are gone: a key, or a word that was the value of a key.
pub const GONE: &[(&str, &str)] = &[
    ("asperities", "scripts/library/asperities.py prints their law: layer = { table = [...] }"),
    (
        "compress",
        "VTU files are written as they are: `precision = \"single\"` halves them, `tar czf` compresses a folder",
    ),
    ("fill", HEIGHTS),
    ("memory", "Gmsh has `timeout` alone; the shell limits memory: ulimit -v"),
    ("missing", HEIGHTS),
    ("options", "PETSc options follow the scene on the command line, or stand in a file: -options_file FILE"),
    ("parabola", HEIGHTS),
    ("points", HEIGHTS),
];

/// Advice for heights that are no whole grid.
const HEIGHTS: &str =
    "data are a grid without gaps: scripts/library/heights.py makes one, with gaps filled and a form subtracted";

/// Replace the advice of a refusal of an unknown key or value if its name is gone.
pub fn explain(error: Error) -> Error {
    let words: Vec<&str> = error.message().split('`').collect();
    let name = match words[..] {
        ["unknown key ", name, ..] => name,
        [start, .., name, ""] if start.starts_with("unknown ") => name,
        _ => return error,
    };
    match GONE.iter().find(|(gone, _)| *gone == name) {
        Some((_, advice)) => error.help(*advice),
        None => error,
    }
}
