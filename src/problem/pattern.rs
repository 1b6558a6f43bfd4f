//! Names of bodies and groups, and patterns that stand for many names, as in shells.

use crate::error::{Error, Located, Result as Checked};
use glob::Pattern as Glob;

/// The text that stands for the name of the body in the names of its groups.
pub const BODY: &str = "{body}";

/// Return whether a name is a pattern: `*` is any text, `?` one character, `[0-9]` one of some.
pub fn is_pattern(name: &str) -> bool {
    name.contains(['*', '?']) || name.find('[').is_some_and(|open| name[open..].contains(']'))
}

/// A name, or a pattern of names.
#[derive(Debug, Clone)]
pub struct Pattern<'a> {
    text: &'a str,
    /// The pattern; `None` for a plain name.
    glob: Option<Glob>,
}

/// Check the name of a group, or a pattern of names.
///
/// # Errors
/// An empty text, and a pattern that is none.
pub fn check(name: &Located<String>) -> Checked<()> {
    if name.is_empty() {
        return Err(Error::scene(&name.place, "the name is empty"));
    }
    Pattern::new(name).map(drop).map_err(|flaw| {
        Error::scene(&name.place, format!("`{}` is no pattern: {flaw}", name.value))
            .help("`*` is any text, `?` one character, `[0-9]` one of some")
    })
}

impl<'a> Pattern<'a> {
    /// Read a name or a pattern.
    pub fn new(text: &'a str) -> Result<Self, &'static str> {
        let glob = if is_pattern(text) { Some(Glob::new(text).map_err(|error| error.msg)?) } else { None };
        Ok(Self { text, glob })
    }

    /// Return whether `name` is the same text, or matches the pattern.
    pub fn matches(&self, name: &str) -> bool {
        self.text == name || self.glob.as_ref().is_some_and(|glob| glob.matches(name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_match() {
        let pattern = |text| Pattern::new(text).unwrap();
        assert!(pattern("brick_*").matches("brick_17") && !pattern("brick_*").matches("block_17"));
        assert!(pattern("b[0-9]").matches("b7") && pattern("b?").matches("bx") && !pattern("b?").matches("b17"));
        assert!(pattern("a[b").matches("a[b") && pattern("a[b").glob.is_none(), "an open bracket is a plain character");
        assert!(pattern("a[1]").matches("a[1]") && pattern("a[1]").matches("a1"), "groups may be called so");
        assert!(Pattern::new("a**b").is_err());
    }
}
