//! Commands and options that earlier versions had.

use crate::error::{Error, Kind};

/// The words, and what to do instead.
pub const GONE: &[(&str, &str)] = &[
    ("report", "`winkler solve` writes the page of a run: --report, or output.report = true"),
    (
        "plot",
        "`winkler solve` draws convergence, pressures and force over approach as SVG; --report shows the bodies, and ParaView opens bodies.pvd",
    ),
    ("--linear", "`winkler solve --set method.name=robin --set method.stop.iterations=1` factors and solves each body"),
    ("--budget", "--timeout bounds each run"),
    ("--resume", "every benchmark makes all of its runs"),
];

/// Return the refusal of a command or option of an earlier version; none for other words. The word of an option may have a value behind `=`.
pub fn refusal(word: &str) -> Option<Error> {
    let name = word.split('=').next().unwrap_or_default();
    let (name, advice) = GONE.iter().find(|(gone, _)| *gone == name)?;
    Some(Error::new(Kind::Usage, format!("there is no `{name}` any more")).help(*advice))
}
