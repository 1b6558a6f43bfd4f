//! The settings of `[data.NAME]`: functions for expressions from files.

use super::read::{Either, Form, file, place_of};
use crate::data::{Data, DataSpec, Detrend, Interpolation, Library, Outside};
use crate::error::{Error, Located, Place, Result as Checked};
use crate::expression::names;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serializer};
use std::collections::BTreeMap;
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
    file: Located<String>,
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

/// Return the data of a scene by name. Their files must exist; they are not read.
///
/// # Errors
/// Names that expressions cannot use, files that are not there, and impossible numbers.
pub fn library(given: BTreeMap<Spanned<String>, DataKeys>) -> Checked<Library> {
    let mut library = Library::new();
    for (name, keys) in given {
        check_name(name.get_ref(), &place_of(name.span()))?;
        let spec = keys.spec(name.get_ref())?;
        library.insert(name.into_inner(), Arc::new(Data::new(spec)));
    }
    Ok(library)
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
        let file = file(self.file)?;
        Ok(DataSpec {
            name: name.to_owned(),
            file: file.value,
            place: file.place,
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
        match Form::<f64>::deserialize(deserializer)? {
            Form::Integer(both) => Ok(Self([both as f64; 2])),
            Form::Number(both) => Ok(Self([both; 2])),
            Form::List(numbers) => match numbers[..] {
                [a, b] => Ok(Self([a, b])),
                _ => Err(serde::de::Error::custom("must be one number, or two in a list")),
            },
            other => Err(other.unexpected()),
        }
    }
}
