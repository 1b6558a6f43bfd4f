//! Macros that declare the keys of a table, and the words of a key, once.

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
