//! Names that an expression can use.

use crate::data::Library;

/// What the words of an expression can mean besides the common functions.
#[derive(Clone, Copy)]
pub struct Scope<'a> {
    /// Names of the variables, at most four.
    pub variables: &'a [&'static str],
    /// Functions from files.
    pub data: &'a Library,
}

impl<'a> Scope<'a> {
    /// Variables alone.
    pub fn of(variables: &'a [&'static str]) -> Self {
        static NONE: Library = Library::new();
        Self { variables, data: &NONE }
    }
}
