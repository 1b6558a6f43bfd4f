//! Values of keys that are no tables: numbers, texts, expressions, vectors, lists.

use super::{Context, Node, Setting, ValueKind};
use crate::error::{Located, Result};
use crate::expression::{Expression, Field};
use serde_json::{Value as Json, json};
use std::path::PathBuf;

/// Implement [`Setting`] for types that JSON has, with the kind of value and the function that reads it.
macro_rules! plain {
    ($($Type:ty: $kind:ident, $read:expr;)*) => {$(
        impl Setting for $Type {
            fn kind() -> ValueKind {
                ValueKind::$kind
            }

            fn read(node: &Node, _: &Context) -> Result<Self> {
                $read(node)
            }

            fn echo(&self, _: usize) -> Json {
                json!(self)
            }
        }
    )*};
}

plain! {
    bool: Flag, Node::boolean;
    f64: Number, Node::number;
    // a whole number >= 1
    usize: PositiveInteger, Node::count;
    // a text that is not empty
    String: Text, |node: &Node| node.name().map(|name| name.value);
}

/// A path that is not joined with the folder of the scene, and need not exist.
impl Setting for PathBuf {
    fn kind() -> ValueKind {
        ValueKind::Text
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        String::read(node, context).map(Self::from)
    }

    fn echo(&self, _: usize) -> Json {
        json!(self.display().to_string())
    }
}

/// A number or an expression.
impl Setting for Field {
    fn kind() -> ValueKind {
        ValueKind::Field
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        context.field(node)
    }

    fn echo(&self, _: usize) -> Json {
        match self {
            Field::Constant(value) => json!(value),
            other => json!(other.text()),
        }
    }
}

/// A vector with one component for each dimension; in the plane the third one is zero.
impl Setting for [Field; 3] {
    fn kind() -> ValueKind {
        ValueKind::Field.list()
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        context.vector(node)
    }

    fn echo(&self, dimension: usize) -> Json {
        self.iter().take(dimension).map(|component| component.echo(dimension)).collect()
    }
}

/// One expression for each dimension.
impl Setting for Vec<Expression> {
    fn kind() -> ValueKind {
        ValueKind::Field.list()
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        context.expressions(node)
    }

    fn echo(&self, _: usize) -> Json {
        self.iter().map(Expression::text).collect()
    }
}

impl<T: Setting> Setting for Vec<T> {
    fn kind() -> ValueKind {
        T::kind().list()
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        node.list()?.iter().map(|item| T::read(item, context)).collect()
    }

    fn echo(&self, dimension: usize) -> Json {
        self.iter().map(|item| item.echo(dimension)).collect()
    }
}

/// A key that need not be given.
impl<T: Setting> Setting for Option<T> {
    fn kind() -> ValueKind {
        T::kind()
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        T::read(node, context).map(Some)
    }

    fn echo(&self, dimension: usize) -> Json {
        self.as_ref().map_or(Json::Null, |value| value.echo(dimension))
    }
}

/// A value with its place in the scene.
impl<T: Setting> Setting for Located<T> {
    fn kind() -> ValueKind {
        T::kind()
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        T::read(node, context).map(|value| Self::new(value, node.place.clone()))
    }

    fn echo(&self, dimension: usize) -> Json {
        self.value.echo(dimension)
    }
}
