//! Laws of layers and rules for gamma that a Rust program adds to a scene by name.

use crate::error::{Error, Kind, Result};
use std::collections::BTreeMap;
use std::fmt;
use std::rc::Rc;

/// The laws or rules of a Rust program, by name.
pub struct Own<T: ?Sized>(BTreeMap<String, Rc<T>>);

impl<T: ?Sized> Own<T> {
    /// Add a law or rule; it replaces an earlier one of the same name.
    pub fn insert(&mut self, name: &str, own: Rc<T>) {
        self.0.insert(name.to_owned(), own);
    }

    /// Return the law or rule of a name; `what` says in the message which of the two it is.
    ///
    /// # Errors
    /// An unknown name.
    pub fn get(&self, what: &str, name: &str) -> Result<&T> {
        self.0.get(name).map(|own| &**own).ok_or_else(|| {
            let error = Error::new(Kind::Scene, format!("no {what} is called `{name}`"));
            let known = self.0.keys().map(String::as_str);
            error.suggest(name, known, || format!("give the scene a {what} of this name"))
        })
    }
}

impl<T: ?Sized> Default for Own<T> {
    fn default() -> Self {
        Self(BTreeMap::new())
    }
}

impl<T: ?Sized> Clone for Own<T> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<T: ?Sized> fmt::Debug for Own<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.0.keys()).finish()
    }
}
