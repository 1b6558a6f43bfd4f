//! Commands and options that earlier versions knew, each with what to use instead.

/// Names that are gone: options with their dashes, and commands.
pub const GONE: &[(&str, &str)] = &[
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

/// Return the advice for a name that is gone.
pub fn advice(name: &str) -> Option<&'static str> {
    GONE.iter().find(|(gone, _)| *gone == name).map(|(_, advice)| *advice)
}
