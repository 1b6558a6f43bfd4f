//! The checks of settings, for scenes from files and from Rust alike.

use super::geometry::Geometry;
use crate::error::{Error, Kind, Place, Result as Checked, shown};

/// A fault of a table, and the key that it is about; keys and numbers of items may follow: `gamma.1`.
pub struct Fault {
    key: String,
    error: Error,
}

impl Fault {
    /// Return a fault; `label` and `help` may be empty.
    pub fn new(key: impl Into<String>, message: impl Into<String>, label: &str, help: &str) -> Self {
        let error = Error::new(Kind::Scene, message).label(label);
        Self { key: key.into(), error: if help.is_empty() { error } else { error.help(help) } }
    }

    /// Return the refusal. `find` returns the place of a path in a scene file: that of the key counts, else that of the
    /// `table`, else `near`.
    fn at(self, table: &str, find: &Find<'_>, near: &Place) -> Error {
        let Self { key, error } = self;
        let of_key = if key.is_empty() { None } else { find(&format!("{table}.{key}")) };
        error.or_at(&of_key.or_else(|| find(table)).unwrap_or_else(|| near.clone()))
    }
}

/// A refusal with a place, or without one if it is about the whole table.
impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        Self { key: String::new(), error }
    }
}

/// Returns the place of the value at a path such as `body.0.young`, if the scene is from a file that has it.
pub type Find<'a> = dyn Fn(&str) -> Option<Place> + 'a;

/// Settings whose values may be impossible or contradict each other.
pub trait Check {
    /// Find the first fault.
    fn check(&self, geometry: Geometry) -> Result<(), Fault>;

    /// Refuse the settings at the path `table` for their first fault, at `near` if there is no better place.
    ///
    /// # Errors
    /// The fault.
    fn refuse(&self, geometry: Geometry, table: &str, find: &Find<'_>, near: &Place) -> Checked<()> {
        self.check(geometry).map_err(|fault| fault.at(table, find, near))
    }
}

/// Settings that need not be there.
impl<T: Check> Check for Option<T> {
    fn check(&self, geometry: Geometry) -> Result<(), Fault> {
        self.as_ref().map_or(Ok(()), |table| table.check(geometry))
    }
}

/// Refuse a number that is not finite and > 0.
///
/// # Errors
/// The fault of the key.
pub fn positive(key: &str, what: &str, value: f64) -> Result<(), Fault> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(Fault::new(key, format!("{what} is {}", shown(value)), "must be greater than 0", ""))
    }
}

/// Refuse a number that stands for a count and is zero.
///
/// # Errors
/// The fault of the key.
pub fn at_least_one(key: &str, count: usize) -> Result<(), Fault> {
    if count > 0 { Ok(()) } else { Err(Fault::new(key, format!("`{key}` is 0"), "must be 1 or more", "")) }
}
