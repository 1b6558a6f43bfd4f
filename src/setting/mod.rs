//! Settings of the scene file. A key is declared once, as a field of a struct with its default and its description: see [`table`].
//!
//! A type that can be the value of a key implements [`Setting`]: what it looks like in TOML (for refusals and the JSON schema), how it is
//! read, and how it is echoed in `report.json`. Structs of keys and lists of words get this from the macros [`table`] and [`words`], and plain
//! values here. Types with several forms implement the trait by hand, where they are declared in `problem`.

mod tree;

pub use tree::{Keys, Node, TableEntry, TableShape, Value, ValueKind, document, value, word};

use crate::data::Library;
use crate::error::{Error, Located, Result};
use crate::expression::{Expression, Field, KnownNames};
use serde_json::{Map, Value as Json, json};
use std::path::{Path, PathBuf};

/// A type that can be the value of a key.
pub trait Setting: Sized {
    /// Return the kind of value that the key takes.
    fn kind() -> ValueKind;

    /// Read a value that was checked to be of this kind.
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

/// Remove keys of the table at a place (a JSON pointer) of settings, if it is there.
pub fn remove(settings: &mut Json, place: &str, keys: &[&str]) {
    if let Some(table) = settings.pointer_mut(place).and_then(Json::as_object_mut) {
        keys.iter().for_each(|key| drop(table.remove(*key)));
    }
}

/// The context in which values are decoded.
pub struct Context<'a> {
    /// Space dimension: 2 or 3.
    pub dimension: usize,
    /// Folder of the scene file.
    pub folder: &'a Path,
    /// Functions from files, by name.
    pub data: Library,
}

/// The smallest absolute value of a number that is not zero; its reciprocal is the largest. Energies contain squares of loads and
/// displacements, and their rounding errors are 1e-32 times as large.
const LEAST: f64 = 1e-110;

impl Context<'_> {
    /// Return the components of a vector; there must be as many as the scene has dimensions.
    pub fn components<'n>(&self, node: &'n Node) -> Result<&'n [Node]> {
        let items = node.list()?;
        if items.len() != self.dimension {
            let place = items.get(self.dimension).map_or(&node.place, |extra| &extra.place);
            let count = format!("a vector has {} components here, not {}", self.dimension, items.len());
            return Err(Error::scene(place, count).help(format!("the dimension of the scene is {}", self.dimension)));
        }
        Ok(items)
    }
}

/// Return the path of a file, joined with the folder of the scene.
pub fn file(folder: &Path, node: &Node) -> Result<Located<PathBuf>> {
    let name = node.name()?.value;
    let path = folder.join(&name);
    match std::fs::metadata(&path) {
        Ok(found) if found.is_file() => Ok(Located::new(path, node.place.clone())),
        Ok(_) => Err(node.refuse(format!("{} is not a file", path.display()))),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
            let names: Vec<_> = files.map(|file| file.file_name().to_string_lossy().into_owned()).collect();
            let wanted = path.file_name().unwrap_or_default().to_string_lossy();
            let error = node.refuse(format!("there is no file {}", path.display())).label("not there");
            Err(error.suggest(&wanted, names.iter().map(String::as_str), || {
                "paths are relative to the folder of the scene file".to_owned()
            }))
        }
        Err(error) => Err(node.refuse(format!("cannot look at {}", path.display())).because(error.to_string())),
    }
}

/// Return the choice of this name; `what` names the key in the message.
///
/// # Errors
/// A word that is no choice, with the nearest one as advice.
pub fn choose<T: Clone>(node: &Node, what: &str, choices: &[(&str, T)]) -> Result<T> {
    let word = node.string()?;
    if let Some((_, choice)) = choices.iter().find(|(name, _)| *name == word) {
        return Ok(choice.clone());
    }
    let names: Vec<_> = choices.iter().map(|(name, _)| *name).collect();
    let otherwise = || format!("it is one of {}", names.join(", "));
    Err(node.refuse(format!("unknown {what} `{word}`")).suggest(word, names.iter().copied(), otherwise))
}

/// Implement [`Setting`] for types that JSON has, with the kind of value and the function that reads it.
macro_rules! plain {
    ($($Type:ty: $kind:expr, $read:expr;)*) => {$(
        impl Setting for $Type {
            fn kind() -> ValueKind {
                $kind
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
    bool: ValueKind::Flag, Node::boolean;
    f64: ValueKind::Number, Node::number;
    // a whole number >= 1
    usize: ValueKind::Integer(1), Node::count;
    // a text that is not empty
    String: ValueKind::Text, |node: &Node| node.name().map(|name| name.value);
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
        let field = match &node.value {
            Value::Integer(_) | Value::Float(_) => Field::Constant(node.number()?),
            Value::String(text) => Field::parse(text, &node.place, context.dimension, false, &context.data)?,
            _ => return Err(node.expected("a number or an expression", "")),
        };
        match field {
            Field::Constant(value) if value != 0.0 && !(LEAST..=LEAST.recip()).contains(&value.abs()) => Err(node
                .refuse(format!("no run computes with a number like {value:e}"))
                .label("must be 0, or of a size from 1e-110 to 1e110")
                .help("choose other units of length and force")),
            field => Ok(field),
        }
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
        let mut vector = [const { Field::Constant(0.0) }; 3];
        for (component, item) in vector.iter_mut().zip(context.components(node)?) {
            *component = Field::read(item, context)?;
        }
        Ok(vector)
    }

    fn echo(&self, dimension: usize) -> Json {
        self.iter().take(dimension).map(|component| component.echo(dimension)).collect()
    }
}

/// One expression for each dimension. Numbers become constant expressions.
impl Setting for Vec<Expression> {
    fn kind() -> ValueKind {
        ValueKind::Field.list()
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        let scope = KnownNames { variables: &["x", "y", "z"][..context.dimension], data: &context.data };
        let component = |item: &Node| match &item.value {
            Value::Integer(_) | Value::Float(_) => Expression::parse(&item.number()?.to_string(), &item.place, scope),
            Value::String(text) => Expression::parse(text, &item.place, scope),
            _ => Err(item.expected("a number or an expression", "")),
        };
        context.components(node)?.iter().map(component).collect()
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

/// Declare a struct whose fields are keys of a table. Each key is one entry:
///
/// ```text
/// keys! {
///     /// The files to write.
///     #[derive(Debug, Clone)]
///     pub struct OutputSpec "[output]" {             // the name of the table in messages
///         required {                                 // keys that must be given
///             /// what the key means
///             pub name: Located<String>,
///         }
///         optional {                                 // keys with a default
///             /// whether to draw the plots
///             ///
///             /// This paragraph is for readers of the source only.
///             pub plots: bool = true,
///             /// the law between the points
///             pub law as "interpolate": Law = Law::Linear => read_law,
///         }
///         besides {                                  // fields that are no keys, and that the caller gives
///             /// Path of the scene file.
///             pub path: PathBuf,
///         }
///         initially {                                // fields that are no keys, and that begin with a value
///             /// Number of the table.
///             pub table: usize = 0,
///         }
///     }
/// }
/// ```
///
/// Each of the four groups may be missing. The type of a key implements [`Setting`](super::Setting). `as` gives a key that is not called
/// like its field, `=> FUNCTION` another function that reads it. The first paragraph of the doc comment, with the default behind it, is
/// the description in the JSON schema and in refusals.
///
/// The struct gets four functions: `shape` (for schema and refusals), `with_defaults` (takes the required fields and those besides),
/// `decode` (takes the fields besides), and `entries` (the echo).
macro_rules! keys {
    (
        $(#[$about:meta])*
        pub struct $Struct:ident $table:literal {
            $(required { $(
                $(#[doc = $must_doc:literal])* pub $must:ident $(as $must_key:literal)? : $Must:ty $(=> $must_read:path)?,
            )* })?
            $(optional { $(
                $(#[doc = $may_doc:literal])* pub $may:ident $(as $may_key:literal)? : $May:ty = $default:expr $(=> $may_read:path)?,
            )* })?
            $(besides { $( $(#[$other_doc:meta])* pub $other:ident: $Other:ty, )* })?
            $(initially { $( $(#[$state_doc:meta])* pub $state:ident: $State:ty = $initial:expr, )* })?
        }
    ) => {
        $(#[$about])*
        pub struct $Struct {
            $($( $(#[doc = $must_doc])* pub $must: $Must, )*)?
            $($( $(#[doc = $may_doc])* pub $may: $May, )*)?
            $($( $(#[$other_doc])* pub $other: $Other, )*)?
            $($( $(#[$state_doc])* pub $state: $State, )*)?
        }

        impl $Struct {
            /// Return the shape of the table.
            pub(crate) fn shape() -> $crate::setting::TableShape {
                use $crate::setting::Setting;
                $crate::setting::TableShape::new($table)
                    $($( .key($crate::setting::keys!(@name $must $($must_key)?), &[$($must_doc),*], <$Must>::kind(), None) )*)?
                    // no default depends on the dimension of the scene
                    $($( .key($crate::setting::keys!(@name $may $($may_key)?), &[$($may_doc),*], <$May>::kind(),
                        Some(<$May as Setting>::echo(&$default, 2))) )*)?
            }

            /// Return the settings with the default of each key that need not be given.
            // not every table is also built in Rust
            #[allow(dead_code)]
            pub(crate) fn with_defaults($($( $must: $Must, )*)? $($( $other: $Other, )*)?) -> Self {
                Self { $($( $must, )*)? $($( $may: $default, )*)? $($( $other, )*)? $($( $state: $initial, )*)? }
            }

            /// Decode an open table.
            // the values of some tables need no context
            #[allow(unused_variables)]
            pub(crate) fn decode(
                keys: &$crate::setting::Keys,
                context: &$crate::setting::Context,
                $($( $other: $Other, )*)?
            ) -> $crate::error::Result<Self> {
                Ok(Self {
                    $($( $must: $crate::setting::keys!(@read $Must $(, $must_read)?)(
                        keys.require($crate::setting::keys!(@name $must $($must_key)?))?, context)?, )*)?
                    $($( $may: keys.read($crate::setting::keys!(@name $may $($may_key)?), |node|
                        $crate::setting::keys!(@read $May $(, $may_read)?)(node, context))?.unwrap_or($default), )*)?
                    $($( $other, )*)?
                    $($( $state: $initial, )*)?
                })
            }

            /// Return the echo of all keys.
            pub(crate) fn entries(&self, dimension: usize) -> $crate::setting::Entries {
                use $crate::setting::Setting;
                $crate::setting::entries([
                    $($( ($crate::setting::keys!(@name $must $($must_key)?), self.$must.echo(dimension)), )*)?
                    $($( ($crate::setting::keys!(@name $may $($may_key)?), self.$may.echo(dimension)), )*)?
                ])
            }
        }
    };
    (@name $field:ident) => { stringify!($field) };
    (@name $field:ident $key:literal) => { $key };
    (@read $Type:ty) => { <$Type as $crate::setting::Setting>::read };
    (@read $Type:ty, $read:path) => { $read };
}

/// Declare a struct like [`keys`], and let it be the value of a key, as a table of its own.
macro_rules! table {
    ($(#[$about:meta])* pub struct $Struct:ident $($rest:tt)*) => {
        $crate::setting::keys! { $(#[$about])* pub struct $Struct $($rest)* }

        impl $crate::setting::Setting for $Struct {
            fn kind() -> $crate::setting::ValueKind {
                Self::shape().into()
            }

            fn read(node: &$crate::setting::Node, context: &$crate::setting::Context) -> $crate::error::Result<Self> {
                Self::decode(&$crate::setting::Keys::open(node, &Self::shape())?, context)
            }

            fn echo(&self, dimension: usize) -> serde_json::Value {
                self.entries(dimension).into()
            }
        }
    };
}

/// Declare an enum whose variants are the words of a key. The text behind its name says what the key is in a refusal (unknown ...).
///
/// ```text
/// words! {
///     /// What to do about surfaces that overlap before loading.
///     pub enum Overlap "overlap" {
///         /// The overlap compresses the layer, and the run warns.
///         Compress = "compress",
///     }
/// }
/// ```
macro_rules! words {
    ($(#[$about:meta])* pub enum $Enum:ident $what:literal { $( $(#[$doc:meta])* $Variant:ident = $word:literal, )* }) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum $Enum { $( $(#[$doc])* $Variant, )* }

        impl $Enum {
            /// All choices with their names in the scene.
            pub const ALL: &'static [(&'static str, Self)] = &[$( ($word, Self::$Variant), )*];

            /// Return the name in the scene.
            pub fn name(self) -> &'static str {
                match self { $( Self::$Variant => $word, )* }
            }
        }

        impl $crate::setting::Setting for $Enum {
            fn kind() -> $crate::setting::ValueKind {
                $crate::setting::word(Self::ALL)
            }

            fn read(node: &$crate::setting::Node, _: &$crate::setting::Context) -> $crate::error::Result<Self> {
                $crate::setting::choose(node, $what, Self::ALL)
            }

            fn echo(&self, _: usize) -> serde_json::Value {
                self.name().into()
            }
        }
    };
}

pub(crate) use {keys, table, words};
