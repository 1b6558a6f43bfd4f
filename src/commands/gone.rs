//! Commands and options that earlier versions knew, each with what to use instead.

/// Names that are gone: options with their dashes, and commands.
pub const GONE: &[(&str, &str)] = &[
    ("--color", "messages have colours on a terminal, and none where NO_COLOR is set"),
    (
        "--trust-geo",
        "a script is a program, as a Makefile is: scripts are run without a question, so read those of others before",
    ),
    ("man", "`winkler COMMAND --help` has all that the man pages had"),
];

/// Return the advice for a name that is gone.
pub fn advice(name: &str) -> Option<&'static str> {
    GONE.iter().find(|(gone, _)| *gone == name).map(|(_, advice)| *advice)
}
