//! Keys and values of scenes, commands and options that earlier versions or other programs know, each with what to use
//! instead.

/// Names that are gone, or stand for what is not computed: a key or a word that was the value of a key: the name, what
/// its place in the scene is called, and the advice.
const KEYS: &[(&str, &str, &str)] = &[
    ("anderson", "method", SWEEPS),
    ("asperities", "layer", "scripts/library/asperities.py prints their law: layer = { table = [...] }"),
    ("balanced", "", "runs with an adapted mesh stop at a tenth of `adapt.error`"),
    ("barzilai-borwein", "method", "gamma = \"aitken\" or \"line-search\""),
    ("checkpoint", "", "states are saved at the end of each load step, and when a signal ends the run"),
    (
        "compress",
        "output",
        "VTU files are written as they are: `precision = \"single\"` halves them, `tar czf` compresses a folder",
    ),
    ("conductivity", "body", "there is no heat conduction: a temperature is a number, an expression or data"),
    ("density", "body", "give a weight as force = [0, 0, -DENSITY*GRAVITY], a force a unit of volume"),
    ("depth", "method", "the method `anderson`, which had it, is gone"),
    ("fill", "data", HEIGHTS),
    (
        "friction",
        "contact",
        "contact is without friction: surfaces slide freely, and bond = true with shear = K is glue, which resists slip",
    ),
    ("memory", "mesh", "Gmsh has `timeout` alone; the shell limits memory: ulimit -v"),
    ("missing", "data", HEIGHTS),
    ("ncg", "method", SWEEPS),
    ("nested", "method", "start = \"auto\" takes about as many steps"),
    ("options", "solver", "PETSc options follow the scene on the command line, or stand in a file: -options_file FILE"),
    ("parabola", "data", HEIGHTS),
    ("plastic", "body", "bodies are linearly elastic"),
    ("points", "data", HEIGHTS),
    ("shear", "layer", "shear = K stands beside bond = true in [[contact]]"),
    ("spectral", "method", "gamma = \"aitken\" or \"line-search\""),
    ("temperature", "contact", "temperature = T belongs to a body, with expansion = ALPHA"),
    ("thermal_expansion", "body", "expansion = ALPHA, with temperature = T"),
    ("yield", "body", "bodies are linearly elastic: compare the largest von Mises stress with the yield stress"),
];

/// Options with their dashes, and commands that are gone.
pub const OPTIONS: &[(&str, &str)] = &[
    ("--adapted", "a run that adapts its mesh writes adapted.msh into the folder of results"),
    ("--budget", "--timeout bounds each run"),
    ("--checkpoint", "states are saved at the end of each load step, and when a signal ends the run"),
    ("--color", "messages have colours on a terminal, and none where NO_COLOR is set"),
    ("--linear", "`winkler solve --method robin --set method.stop.iterations=1` factors and solves each body"),
    ("--resume", "every benchmark makes all of its runs"),
    ("--tolerance", "`winkler solve --tolerance E` adapts meshes and writes the last one as adapted.msh"),
    (
        "--trust-geo",
        "a script is a program, as a Makefile is: scripts are run without a question, so read those of others before",
    ),
    ("-o", "`check` draws nothing any more; `solve`, `sweep`, `bench` and `mesh` write to what -o names"),
    ("man", "`winkler COMMAND --help` has all that the man pages had"),
    (
        "plot",
        "`winkler solve` draws its plots as SVG, --report shows the bodies, and ParaView opens bodies.pvd of --vtu",
    ),
    ("report", "`winkler solve --report` writes the page of a run"),
];

/// Advice for methods over the sweep.
const SWEEPS: &str = "name = \"auto\", or \"robin\" with gamma = \"aitken\"";

/// Advice for heights that are no whole grid.
const HEIGHTS: &str =
    "data are a grid without gaps: scripts/library/heights.py makes one, with gaps filled and a form subtracted";

/// Return the advice for a key of a table, or a value of a key, that is gone. `place` is what the table or the key is
/// called in messages.
pub fn advice_in(name: &str, place: &str) -> Option<&'static str> {
    KEYS.iter().find(|(known, of, _)| *known == name && place.contains(of)).map(|(.., advice)| *advice)
}

/// Return the advice for a name of a list, if it is gone.
pub fn advice(gone: &[(&str, &'static str)], name: &str) -> Option<&'static str> {
    gone.iter().find(|(known, _)| *known == name).map(|(_, advice)| *advice)
}
