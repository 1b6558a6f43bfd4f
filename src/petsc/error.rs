//! What PETSc and the libraries beside it report.

use std::fmt;

/// An error of PETSc, MUMPS, METIS or LAPACK, or a wrong argument of their functions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Error {
    /// What failed, a fragment without a full stop.
    pub message: String,
    /// PETSc's own message, and the function of PETSc that raised it.
    pub causes: Vec<String>,
    /// What to do about it.
    pub help: Option<String>,
}

/// Result with [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// Return an error with this message.
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), causes: Vec::new(), help: None }
    }

    /// Add a cause.
    pub(super) fn because(mut self, cause: impl Into<String>) -> Self {
        self.causes.push(cause.into());
        self
    }

    /// Say what to do about the error.
    pub(super) fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)?;
        self.causes.iter().try_for_each(|cause| write!(f, ": {cause}"))?;
        self.help.iter().try_for_each(|help| write!(f, " ({help})"))
    }
}

impl std::error::Error for Error {}
