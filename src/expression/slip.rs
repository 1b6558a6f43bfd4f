//! What is wrong with an expression, and where.

use crate::error::{Error, Place};
use std::ops::Range;

/// What is wrong with an expression, at a byte range of its text.
#[derive(Debug)]
pub(super) struct Slip {
    span: Range<usize>,
    message: String,
    label: String,
    help: Option<String>,
    /// An error that has its own words and place.
    whole: Option<Error>,
}

impl From<Error> for Slip {
    fn from(error: Error) -> Self {
        Self { whole: Some(error), ..Self::new(0..0, "") }
    }
}

impl Slip {
    pub fn new(span: Range<usize>, message: impl Into<String>) -> Self {
        Self { span, message: message.into(), label: String::new(), help: None, whole: None }
    }

    pub fn label(mut self, label: &str) -> Self {
        self.label = label.to_owned();
        self
    }

    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// The error, with the caret inside the string where its text is verbatim in the source (no escapes).
    pub fn into_error(self, text: &str, place: &Place) -> Error {
        if let Some(error) = self.whole {
            return error;
        }
        let written = place.source.text.get(place.span.clone()).unwrap_or_default();
        let exact = written.find(text).filter(|_| !text.is_empty()).map(|offset| {
            let start = place.span.start + offset;
            Place { source: place.source.clone(), span: start + self.span.start..start + self.span.end }
        });
        let error = Error::scene(exact.as_ref().unwrap_or(place), self.message).label(self.label);
        match self.help {
            Some(help) => error.help(help),
            None => error,
        }
    }
}
