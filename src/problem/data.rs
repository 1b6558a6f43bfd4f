//! The settings of `[data.NAME]`: functions for expressions from files.

use super::compile::{Compile, Names};
use super::read::{Either, Form, Table, refused, unplaced};
use crate::data::{Data, DataSpec, Detrend, Interpolation, Library, Outside};
use crate::error::{Error, Located, Place, Result as Checked};
use crate::expression::names;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serializer};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use toml::Spanned;

/// write [data.rough], and below it file = "surface.csv" and the other keys
///
/// The keys of `[data.NAME]`.
// the description has the name of a table in brackets, which is no link
#[allow(rustdoc::broken_intra_doc_links)]
#[derive(Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DataKeys {
    /// heights in rows: .npy, or a table of numbers
    file: Located<PathBuf>,
    /// place of the first height; 0
    #[serde(default)]
    origin: Pair,
    /// distance of the heights along a row and from row to row
    spacing: Located<Pair>,
    /// what a height of 1 in the file is; 1
    unit: Option<Located<f64>>,
    /// what is subtracted from the heights
    #[serde(default)]
    detrend: Detrend,
    /// what is between the heights
    #[serde(default)]
    interpolate: Interpolation,
    /// what is beyond them
    #[serde(default)]
    outside: Outside,
}

/// Read the data of a scene by name, for `#[serde(deserialize_with)]`.
///
/// # Errors
/// Those of serde, names that expressions cannot use, and impossible numbers.
pub fn library<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Library, D::Error> {
    let mut library = Library::new();
    for (name, Table(keys)) in BTreeMap::<Spanned<String>, Table<DataKeys>>::deserialize(deserializer)? {
        check_name(name.get_ref(), &unplaced(name.span())).map_err(refused)?;
        let spec = keys.value.spec(name.get_ref()).map_err(refused)?;
        library.insert(name.into_inner(), Arc::new(Data::new(spec)));
    }
    Ok(library)
}

/// Find the files of data that were just read from a scene. They are read when an expression needs them.
///
/// # Errors
/// Files that are not there.
pub fn find_files(library: &mut Library, names: &Names<'_>) -> Checked<()> {
    library.values_mut().filter_map(Arc::get_mut).try_for_each(|data| data.spec.file.compile(names))
}

/// Refuse names that expressions cannot use, or use for something else.
fn check_name(name: &str, place: &Place) -> Checked<()> {
    let refuse = || Error::scene(place, format!("data cannot be called `{name}`"));
    if !name.starts_with(|c: char| c.is_alphabetic()) || name.contains(|c: char| !c.is_alphanumeric() && c != '_') {
        return Err(refuse().help("a name that expressions can use has letters, digits and _, a letter first"));
    }
    if names().any(|known| known == name) {
        return Err(refuse().label("expressions have this name already"));
    }
    Ok(())
}

impl DataKeys {
    /// Return the settings, once they are checked.
    fn spec(self, name: &str) -> Checked<DataSpec> {
        let spacing = self.spacing.value.0;
        if let Some(wrong) = spacing.iter().find(|spacing| !(**spacing > 0.0 && spacing.is_finite())) {
            let error = Error::scene(&self.spacing.place, format!("the spacing is {wrong}"));
            return Err(error.label("must be greater than 0"));
        }
        if let Some(unit) = self.unit.as_ref().filter(|unit| unit.value == 0.0 || !unit.value.is_finite()) {
            return Err(
                Error::scene(&unit.place, format!("the unit is {}", unit.value)).label("must be finite and not 0")
            );
        }
        Ok(DataSpec {
            name: name.to_owned(),
            file: self.file,
            origin: self.origin.0,
            spacing,
            unit: self.unit.map_or(1.0, |unit| unit.value),
            detrend: self.detrend,
            interpolation: self.interpolate,
            outside: self.outside,
        })
    }
}

/// Write data as the keys of their tables, for `#[serde(serialize_with)]`.
///
/// # Errors
/// Those of the serializer.
pub fn write<S: Serializer>(library: &Library, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(library.iter().map(|(name, data)| (name, &data.spec)))
}

/// Two numbers; a single one stands for both.
#[derive(Clone, Copy, Default, JsonSchema)]
#[schemars(with = "Either<f64, [f64; 2]>")]
struct Pair([f64; 2]);

impl<'de> Deserialize<'de> for Pair {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Located { value, place } = Located::<Form<f64>>::deserialize(deserializer)?;
        match value {
            Form::Integer(both) => Ok(Self([both as f64; 2])),
            Form::Number(both) => Ok(Self([both; 2])),
            Form::List(numbers) => match numbers[..] {
                [a, b] => Ok(Self([a, b])),
                _ => Err(serde::de::Error::custom("must be one number, or two in a list")),
            },
            other => Err(other.instead_of("a number or two in a list", &place)),
        }
    }
}
