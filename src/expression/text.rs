//! The text of an expression, and refusals that point into it.

use crate::error::{Error, Place};
use std::ops::Range;

/// A text, and the place of the string that contains it.
#[derive(Clone, Copy)]
pub(super) struct Text<'a> {
    pub text: &'a str,
    pub place: &'a Place,
}

impl Text<'_> {
    /// Return a refusal of some of its bytes. The caret is inside the string if the source has the text verbatim, without escapes.
    pub fn refuse(&self, span: Range<usize>, message: impl Into<String>) -> Error {
        let Place { source, span: whole } = self.place;
        let written = source.text.get(whole.clone()).unwrap_or_default();
        let exact = written.find(self.text).filter(|_| !self.text.is_empty()).map(|offset| {
            let start = whole.start + offset;
            Place { source: source.clone(), span: start + span.start..start + span.end }
        });
        Error::scene(exact.as_ref().unwrap_or(self.place), message)
    }
}
