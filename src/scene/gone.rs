//! Keys and values of scenes that earlier versions knew, each with what to use instead.

use crate::error::Error;

/// Names that are gone: a key, or a word that was the value of a key.
pub const GONE: &[(&str, &str)] = &[
    ("anderson", SWEEPS),
    ("asperities", "scripts/library/asperities.py prints their law: layer = { table = [...] }"),
    ("balanced", "runs with an adapted mesh stop at a tenth of `adapt.error`"),
    ("barzilai-borwein", "gamma = \"aitken\" or \"line-search\""),
    ("checkpoint", "states are saved at the end of each load step, and when a signal ends the run"),
    (
        "compress",
        "VTU files are written as they are: `precision = \"single\"` halves them, `tar czf` compresses a folder",
    ),
    ("depth", "the method `anderson`, which had it, is gone"),
    ("fill", HEIGHTS),
    ("memory", "Gmsh has `timeout` alone; the shell limits memory: ulimit -v"),
    ("missing", HEIGHTS),
    ("ncg", SWEEPS),
    ("nested", "start = \"auto\" takes about as many steps"),
    ("options", "PETSc options follow the scene on the command line, or stand in a file: -options_file FILE"),
    ("parabola", HEIGHTS),
    ("points", HEIGHTS),
    ("spectral", "gamma = \"aitken\" or \"line-search\""),
];

/// Advice for methods over the sweep.
const SWEEPS: &str = "name = \"auto\", or \"robin\" with gamma = \"aitken\"";

/// Advice for heights that are no whole grid.
const HEIGHTS: &str =
    "data are a grid without gaps: scripts/library/heights.py makes one, with gaps filled and a form subtracted";

/// Replace the advice of a refusal of an unknown key or value if its name is gone.
pub fn explain(error: Error) -> Error {
    let words: Vec<&str> = error.message().split('`').collect();
    let name = match words[..] {
        ["unknown key " | "unknown word ", name, ..] => name,
        [start, .., name, ""] if start.starts_with("unknown ") => name,
        _ => return error,
    };
    match GONE.iter().find(|(gone, _)| *gone == name) {
        Some((_, advice)) => error.help(*advice),
        None => error,
    }
}
