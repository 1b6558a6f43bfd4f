//! The names that an expression can use.

use crate::data::Library;

/// The names that an expression can use besides the common functions and `pi`.
#[derive(Clone, Copy)]
pub struct Scope<'a> {
    /// Names of the variables, at most four.
    pub variables: &'a [&'static str],
    /// Functions from files.
    pub data: &'a Library,
}

impl<'a> Scope<'a> {
    /// Return a scope of variables alone.
    pub fn of(variables: &'a [&'static str]) -> Self {
        static NONE: Library = Library::new();
        Self { variables, data: &NONE }
    }
}
