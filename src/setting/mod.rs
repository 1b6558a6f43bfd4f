//! Settings of the scene file. A key is declared once, as a field of a struct with its default and its description: see [`table`].
//!
//! A type that can be the value of a key implements [`Setting`]: what it looks like in TOML (for refusals and the JSON schema), how it is
//! read, and how it is echoed in `report.json`. Structs of keys and lists of words get this from the macros [`table`] and [`words`].
//! Values that have several forms implement the trait by hand, in `problem/keys`.

mod context;
mod macros;
mod read;
mod shape;
mod values;

pub use context::{Context, choose, file};
pub(crate) use macros::{keys, table, words};
pub use read::{Entry, Keys, Node, Value, document, value};
pub use shape::{TableShape, ValueKind, word};

use crate::error::Result;
use serde_json::{Map, Value as Json};

/// A type that can be the value of a key.
pub trait Setting: Sized {
    /// Return the kind of value that the key takes.
    fn kind() -> ValueKind;

    /// Read a value that was checked to be of this kind.
    ///
    /// # Errors
    /// Values that have no meaning.
    fn read(node: &Node, context: &Context) -> Result<Self>;

    /// Return the value as the scene file may have it. `dimension` is that of the scene. Null stands for a key that is left out.
    ///
    /// A restart, a sweep, and runs on several ranks compare scenes by this echo.
    fn echo(&self, dimension: usize) -> Json;
}

/// A table of the echo.
pub type Entries = Map<String, Json>;

/// Return a table of the echo without the keys that are left out.
pub fn entries<const N: usize>(pairs: [(&str, Json); N]) -> Entries {
    pairs.into_iter().filter(|(_, value)| !value.is_null()).map(|(key, value)| (key.to_owned(), value)).collect()
}
