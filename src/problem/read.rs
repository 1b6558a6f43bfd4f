//! What all settings share when they are read and written by serde: where the text stands, expressions, vectors, values
//! with several forms, and the checks of tables.
//!
//! serde hands a value no more than itself. What else reading needs, the [`Context`], is kept aside for the thread
//! while a scene is read ([`within`]): the texts that places point into, the folder of the scene, its dimension, and
//! its data. So expressions are compiled as they are read. A refusal that has more to say than an error of serde can
//! hold is kept aside, too, and [`refusal`] takes it back.

use super::geometry::{Geometry, Plane};
use crate::data::Library;
use crate::error::{Error, Kind, Located, Place, Result as Checked, Source, shown};
use crate::expression::{Expression, Field, KnownNames, coordinates};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, Deserializer, IgnoredAny, MapAccess, SeqAccess, Unexpected, Visitor};
use serde::{Deserialize, Serialize, Serializer};
use std::borrow::Cow;
use std::cell::RefCell;
use std::fmt;
use std::marker::PhantomData;
use std::ops::{Deref, Range};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toml::Spanned;

/// The texts that a scene is read from: its file and the options that change it. The spans of all values count through
/// one after the other.
#[derive(Debug, Clone, Default)]
pub struct Sources(Vec<(usize, Arc<Source>)>);

impl Sources {
    /// Add a text; return where its spans begin.
    pub fn add(&mut self, source: Arc<Source>) -> usize {
        let begin = self.0.last().map_or(0, |(begin, last)| begin + last.text.len() + 1);
        self.0.push((begin, source));
        begin
    }

    /// Return the place of a span, moved into its text and onto whole characters.
    pub fn place(&self, span: Range<usize>) -> Place {
        let Some((begin, source)) = self.0.iter().rev().find(|(begin, _)| *begin <= span.start) else {
            return Place::default();
        };
        let whole =
            |at: usize| (0..=(at - begin).min(source.text.len())).rev().find(|at| source.text.is_char_boundary(*at));
        let start = whole(span.start).unwrap_or(0);
        Place { source: source.clone(), span: start..whole(span.end).unwrap_or(0).max(start) }
    }
}

/// What reading and writing need to know besides the values.
#[derive(Debug, Clone)]
pub struct Context {
    /// Dimension and kind of the problem.
    pub geometry: Geometry,
    /// The texts.
    pub sources: Sources,
    /// Folder of the scene file.
    pub folder: PathBuf,
    /// Functions from files, by name.
    pub data: Library,
    /// Names of the factors of the load steps.
    pub factors: Vec<String>,
    /// The names that expressions of the key that is read may have.
    pub names: Names,
}

/// The kinds of names in an expression.
#[derive(Debug, Clone, Copy)]
pub struct Names {
    coordinates: bool,
    factors: bool,
}

impl Default for Context {
    fn default() -> Self {
        Self {
            geometry: Geometry { dimension: 3, plane: Plane::Strain },
            sources: Sources::default(),
            folder: PathBuf::new(),
            data: Library::new(),
            factors: Vec::new(),
            names: Names { coordinates: true, factors: false },
        }
    }
}

/// A refusal on its way through serde, and the span of the table that it is about, if it is known better than serde
/// knows it.
type Kept = (Flaw, Option<Range<usize>>);

thread_local! {
    static CONTEXT: RefCell<Context> = RefCell::default();
    static KEPT: RefCell<Option<Kept>> = const { RefCell::new(None) };
}

/// Read or write something in a context.
pub fn within<T>(context: Context, read: impl FnOnce() -> T) -> T {
    CONTEXT.replace(context);
    let result = read();
    CONTEXT.take();
    result
}

/// Return dimension and kind of the problem that is read or written.
pub fn geometry() -> Geometry {
    CONTEXT.with_borrow(|context| context.geometry)
}

/// Return the data of the scene that is read.
pub fn data() -> Library {
    CONTEXT.with_borrow(|context| context.data.clone())
}

/// Return the place of a span of the scene that is read.
pub fn place_of(span: Range<usize>) -> Place {
    CONTEXT.with_borrow(|context| context.sources.place(span))
}

/// Keep a refusal aside, and return the error of serde that stands for it.
pub fn kept<E: de::Error>(error: Error) -> E {
    keep(error.into(), None)
}

fn keep<E: de::Error>(flaw: Flaw, span: Option<Range<usize>>) -> E {
    let message = flaw.error.message().to_owned();
    KEPT.replace(Some((flaw, span)));
    E::custom(message)
}

/// Stands for a refusal that is kept aside, where serde has a conversion: `#[serde(try_from)]`.
pub struct Refused;

impl From<Error> for Refused {
    fn from(error: Error) -> Self {
        KEPT.replace(Some((error.into(), None)));
        Self
    }
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("refused")
    }
}

/// Return the refusal that was kept aside, if the reading ended with one. `span` is that of serde's error, and `key_in`
/// returns the span of a key in the table with a span.
pub fn refusal(
    sources: &Sources,
    span: Option<Range<usize>>,
    key_in: impl Fn(&Range<usize>, &str) -> Option<Range<usize>>,
) -> Option<Error> {
    let (Flaw { key, error }, own) = KEPT.take()?;
    let Some(span) = own.or(span) else { return Some(error) };
    let span = if key.is_empty() { None } else { key_in(&span, &key) }.unwrap_or(span);
    Some(error.or_at(&sources.place(span)))
}

/// A flaw of a table, and the key that it is about; below a key with a list its number may follow: `gamma.1`.
pub struct Flaw {
    key: String,
    error: Error,
}

impl Flaw {
    /// Return a flaw; `label` and `help` may be empty.
    pub fn new(key: impl Into<String>, message: impl Into<String>, label: &str, help: &str) -> Self {
        let error = Error::new(Kind::Scene, message).label(label);
        Self { key: key.into(), error: if help.is_empty() { error } else { error.help(help) } }
    }
}

/// A refusal with a place, or without one if it is about the whole table.
impl From<Error> for Flaw {
    fn from(error: Error) -> Self {
        Self { key: String::new(), error }
    }
}

/// A table whose values may be impossible or contradict each other. It is checked while it is read, and as a part of a
/// scene built in Rust.
pub trait Check {
    /// Find the first flaw.
    fn check(&self, geometry: Geometry) -> Result<(), Flaw>;

    /// Refuse the table for its first flaw, at `near` if there is no better place.
    ///
    /// # Errors
    /// The flaw.
    fn refuse(&self, geometry: Geometry, near: &Place) -> Checked<()> {
        self.check(geometry).map_err(|flaw| flaw.error.or_at(near))
    }
}

/// A table that need not be there.
impl<T: Check> Check for Option<T> {
    fn check(&self, geometry: Geometry) -> Result<(), Flaw> {
        self.as_ref().map_or(Ok(()), |table| table.check(geometry))
    }
}

/// Refuse a number that is not finite and > 0.
///
/// # Errors
/// The flaw of the key.
pub fn positive(key: &str, what: &str, value: f64) -> Result<(), Flaw> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(Flaw::new(key, format!("{what} is {}", shown(value)), "must be greater than 0", ""))
    }
}

/// Refuse a number that stands for a count and is zero.
///
/// # Errors
/// The flaw of the key.
pub fn at_least_one(key: &str, count: usize) -> Result<(), Flaw> {
    if count > 0 { Ok(()) } else { Err(Flaw::new(key, format!("`{key}` is 0"), "must be 1 or more", "")) }
}

/// Refuse a table that has several keys of which one can hold. The caret marks the later one; an option comes later
/// than the scene file.
///
/// # Errors
/// The two keys.
pub fn only_one(table: &str, keys: &[(&str, Option<&Place>)]) -> Checked<()> {
    let mut given = keys.iter().filter_map(|(key, place)| Some((*key, (*place)?)));
    let (Some((first, a)), Some((second, b))) = (given.next(), given.next()) else { return Ok(()) };
    let rank = |place: &Place| (place.source.name.starts_with("--"), place.span.start);
    let later = if rank(b) < rank(a) { a } else { b };
    Err(Error::scene(later, format!("{table} has both `{first}` and `{second}`"))
        .label("only one of them can hold")
        .help(format!("remove `{first}` or `{second}`")))
}

/// Return the place of a value, if it is given.
pub fn place<T>(value: &Option<Located<T>>) -> Option<&Place> {
    value.as_ref().map(|value| &value.place)
}

/// Read a table and check it, for `#[serde(deserialize_with)]`.
///
/// # Errors
/// Those of serde, and the flaws of the table.
pub fn checked<'de, T: Deserialize<'de> + Check, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    let table = Spanned::<T>::deserialize(deserializer)?;
    match table.get_ref().check(geometry()) {
        Ok(()) => Ok(table.into_inner()),
        Err(flaw) => Err(keep(flaw, Some(table.span()))),
    }
}

/// Read a list of tables and check each.
///
/// # Errors
/// Those of [`checked`].
pub fn all<'de, T: Deserialize<'de> + Check, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<T>, D::Error> {
    struct Item<T>(T);

    impl<'de, T: Deserialize<'de> + Check> Deserialize<'de> for Item<T> {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            checked(deserializer).map(Self)
        }
    }
    Ok(Vec::<Item<T>>::deserialize(deserializer)?.into_iter().map(|item| item.0).collect())
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Located<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = Spanned::<T>::deserialize(deserializer)?;
        let place = place_of(value.span());
        Ok(Self::new(value.into_inner(), place))
    }
}

impl<T: Serialize> Serialize for Located<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.value.serialize(serializer)
    }
}

impl<T: JsonSchema> JsonSchema for Located<T> {
    fn schema_name() -> Cow<'static, str> {
        T::schema_name()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        T::json_schema(generator)
    }

    fn inline_schema() -> bool {
        true
    }
}

/// Return the path of a file that is there, joined with the folder of the scene.
///
/// # Errors
/// A file that is not there, with the name of one that is; a folder.
pub fn file(name: Located<String>) -> Checked<Located<PathBuf>> {
    let path = CONTEXT.with_borrow(|context| context.folder.join(&name.value));
    match std::fs::metadata(&path) {
        Ok(found) if found.is_file() => Ok(Located::new(path, name.place)),
        Ok(_) => Err(Error::scene(&name.place, format!("{} is not a file", path.display()))),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
            let names: Vec<_> = files.map(|file| file.file_name().to_string_lossy().into_owned()).collect();
            let wanted = path.file_name().unwrap_or_default().to_string_lossy();
            let error = Error::scene(&name.place, format!("there is no file {}", path.display())).label("not there");
            Err(error.suggest(&wanted, names.iter().map(String::as_str), || {
                "paths are relative to the folder of the scene file".to_owned()
            }))
        }
        Err(error) => {
            Err(Error::scene(&name.place, format!("cannot look at {}", path.display())).because(error.to_string()))
        }
    }
}

/// A value of one of several forms. `L` is the type of the items of a list, and `T` that of a table; [`IgnoredAny`]
/// where they have no meaning.
pub enum Form<L = IgnoredAny, T = IgnoredAny> {
    Flag,
    Integer(i64),
    Number(f64),
    Text(String),
    List(Vec<L>),
    Table(T),
}

impl<L, T> Form<L, T> {
    /// Return the refusal of a form that has no meaning. The schema says which ones have.
    pub fn unexpected<E: de::Error>(&self) -> E {
        E::invalid_type(Unexpected::Other("another form"), &"a form of the schema")
    }

    /// Return the refusal of a form where a number or an expression belongs. It has a place, which serde does not know
    /// for items of lists.
    fn instead_of_field(&self, place: &Place) -> Error {
        let found = match self {
            Self::Flag => "true or false",
            Self::List(_) => "a list",
            _ => "a table",
        };
        let error = Error::scene(place, format!("expected a number or an expression, found {found}"));
        error.label("not a number or an expression")
    }
}

impl<'de, L: Deserialize<'de>, T: Deserialize<'de>> Deserialize<'de> for Form<L, T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Any<L, T>(PhantomData<(L, T)>);

        impl<'de, L: Deserialize<'de>, T: Deserialize<'de>> Visitor<'de> for Any<L, T> {
            type Value = Form<L, T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a value")
            }

            fn visit_bool<E>(self, _: bool) -> Result<Self::Value, E> {
                Ok(Form::Flag)
            }

            fn visit_i64<E>(self, value: i64) -> Result<Self::Value, E> {
                Ok(Form::Integer(value))
            }

            fn visit_f64<E>(self, value: f64) -> Result<Self::Value, E> {
                Ok(Form::Number(value))
            }

            fn visit_str<E>(self, value: &str) -> Result<Self::Value, E> {
                Ok(Form::Text(value.to_owned()))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Self::Value, A::Error> {
                let mut list = Vec::new();
                while let Some(item) = items.next_element()? {
                    list.push(item);
                }
                Ok(Form::List(list))
            }

            fn visit_map<A: MapAccess<'de>>(self, entries: A) -> Result<Self::Value, A::Error> {
                T::deserialize(MapAccessDeserializer::new(entries)).map(Form::Table)
            }
        }
        deserializer.deserialize_any(Any(PhantomData))
    }
}

/// The smallest absolute value of a number that is not zero; its reciprocal is the largest. Energies contain squares of
/// loads and displacements, 1e-220 and more, and roundoff is 1e-16 of a force and as much of a displacement: 1e-252 in
/// an energy, where the least normal double is 2e-308.
const LEAST: f64 = 1e-110;

/// A number or an expression. The data of the scene are known when it is read.
impl<'de> Deserialize<'de> for Field {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Located { value, place } = Located::<Form>::deserialize(deserializer)?;
        field(value, &place)
    }
}

/// Read something whose expressions may have the factors of the load steps, and with `coordinates` these, too.
fn stepped<T>(coordinates: bool, read: impl FnOnce() -> T) -> T {
    let set = |names| CONTEXT.with_borrow_mut(|context| std::mem::replace(&mut context.names, names));
    let before = set(Names { coordinates, factors: true });
    let result = read();
    set(before);
    result
}

/// Read a number or an expression in the coordinates and the factors of the load steps, for
/// `#[serde(deserialize_with)]`.
///
/// # Errors
/// Those of serde, and texts that are no expression.
pub fn of_steps<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Field, D::Error> {
    stepped(true, || Field::deserialize(deserializer))
}

/// Read something whose expressions have the factors of the load steps alone, for `#[serde(deserialize_with)]`.
///
/// # Errors
/// Those of serde, and texts that are no expression.
pub fn by_factors<'de, T: Deserialize<'de>, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    stepped(false, || T::deserialize(deserializer))
}

/// Return the field of a value that is no list and no table.
fn field<E: de::Error, L, T>(value: Form<L, T>, place: &Place) -> Result<Field, E> {
    let field = match value {
        Form::Integer(value) => Field::Constant(value as f64),
        Form::Number(value) => Field::Constant(value),
        Form::Text(text) => condition(&text, place, false).map_err(kept)?,
        other => return Err(kept(other.instead_of_field(place))),
    };
    let number = if let Field::Constant(value) = field { value } else { 0.0 };
    let refuse = |message: String| Error::scene(place, message);
    if !number.is_finite() {
        return Err(kept(refuse("the number is not finite".to_owned())));
    }
    if number != 0.0 && !(LEAST..=LEAST.recip()).contains(&number.abs()) {
        return Err(kept(
            refuse(format!("no run computes with a number like {number:e}"))
                .label("must be 0, or of a size from 1e-110 to 1e110")
                .help("choose other units of length and force"),
        ));
    }
    Ok(field)
}

/// Compile an expression in the coordinates, and with `iteration` in the iteration k, too; or in what else the key that
/// is read may have.
///
/// # Errors
/// A text that is no expression.
pub fn condition(text: &str, place: &Place, iteration: bool) -> Checked<Field> {
    CONTEXT.with_borrow(|Context { geometry, data, factors, names, .. }| {
        let variables = if names.coordinates { coordinates(geometry.dimension, iteration) } else { Vec::new() };
        let factors = if names.factors { &factors[..] } else { &[] };
        Field::parse(text, place, KnownNames { variables: &variables, factors, data })
    })
}

/// Compile an expression in the iteration k alone.
///
/// # Errors
/// A text that is no expression.
pub fn of_iteration(text: &str, place: &Place) -> Checked<Field> {
    Field::parse(text, place, KnownNames { variables: &["k"], factors: &[], data: &data() })
}

/// Compile an expression in the coordinates, behind `first`.
///
/// # Errors
/// A text that is no expression.
pub fn expression(text: &str, place: &Place, first: &[&'static str]) -> Checked<Expression> {
    CONTEXT.with_borrow(|Context { geometry, data, .. }| {
        let variables = [first, &["x", "y", "z"][..geometry.dimension]].concat();
        Expression::parse(text, place, KnownNames { variables: &variables, factors: &[], data })
    })
}

impl Serialize for Field {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Field::Constant(value) => serializer.serialize_f64(*value),
            other => serializer.serialize_str(&other.text()),
        }
    }
}

impl JsonSchema for Field {
    fn schema_name() -> Cow<'static, str> {
        "Field".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["number", "string"], "format": "expression" })
    }
}

/// A vector with one component for each dimension; in the plane the third one is zero.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(with = "Vec<Field>")]
pub struct Vector(pub [Field; 3]);

impl Vector {
    /// Return the vector with these components. There must be `count` of them.
    fn of(components: Located<Vec<Located<Field>>>, count: usize) -> Checked<Self> {
        let Located { value: items, place } = components;
        if items.len() != count {
            let place = items.get(count).map_or(&place, |extra| &extra.place);
            return Err(Error::scene(place, format!("a vector has {count} components here, not {}", items.len()))
                .help(format!("the dimension of the scene is {count}")));
        }
        let mut items = items.into_iter().map(|item| item.value);
        Ok(Self(std::array::from_fn(|_| items.next().unwrap_or(Field::Constant(0.0)))))
    }

    /// Return the numbers of a vector that does not depend on the place.
    ///
    /// # Errors
    /// An expression in the coordinates.
    pub fn numbers(&self) -> Checked<[f64; 3]> {
        let mut numbers = [0.0; 3];
        for (number, field) in numbers.iter_mut().zip(&self.0) {
            *number = constant(field)?;
        }
        Ok(numbers)
    }
}

/// Return a number that does not depend on the place.
///
/// # Errors
/// An expression in the coordinates.
fn constant(field: &Field) -> Checked<f64> {
    match field {
        Field::Constant(value) => Ok(*value),
        field => Err(Error::new(Kind::Scene, "a total force or moment does not depend on the place")
            .help("give numbers, or a traction with expressions")
            .at(field.place().unwrap_or(&Place::default()))),
    }
}

impl Deref for Vector {
    type Target = [Field; 3];

    fn deref(&self) -> &[Field; 3] {
        &self.0
    }
}

impl From<[Field; 3]> for Vector {
    fn from(components: [Field; 3]) -> Self {
        Self(components)
    }
}

impl From<[f64; 3]> for Vector {
    fn from(numbers: [f64; 3]) -> Self {
        Self(numbers.map(Field::Constant))
    }
}

impl<'de> Deserialize<'de> for Vector {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::of(Located::deserialize(deserializer)?, geometry().dimension).map_err(kept)
    }
}

impl Serialize for Vector {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0[..geometry().dimension].serialize(serializer)
    }
}

/// A number or an expression, or one for each component.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum OneOrVector {
    One(Field),
    Vector(Vector),
}

impl<'de> Deserialize<'de> for OneOrVector {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Located { value, place } = Located::<Form<Located<Field>>>::deserialize(deserializer)?;
        match value {
            Form::List(items) => {
                Vector::of(Located::new(items, place), geometry().dimension).map(Self::Vector).map_err(kept)
            }
            value => field(value, &place).map(Self::One),
        }
    }
}

/// A direction in space. In the plane the third component may be left out.
#[derive(JsonSchema)]
#[schemars(with = "Vec<Field>")]
pub struct Direction(pub [Field; 3]);

impl<'de> Deserialize<'de> for Direction {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let components = Located::<Vec<_>>::deserialize(deserializer)?;
        let count = if components.len() == 3 { 3 } else { geometry().dimension };
        Vector::of(components, count).map(|vector| Self(vector.0)).map_err(kept)
    }
}

/// A number or an expression whose text stays, with one value for each dimension where it stands in a list.
impl<'de> Deserialize<'de> for Expression {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Located { value, place } = Located::<Form>::deserialize(deserializer)?;
        let text = match value {
            Form::Integer(value) => value.to_string(),
            Form::Number(value) => value.to_string(),
            Form::Text(text) => text,
            other => return Err(kept(other.instead_of_field(&place))),
        };
        expression(&text, &place, &[]).map_err(kept)
    }
}

impl Serialize for Expression {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.text())
    }
}

/// One of two forms, in the JSON schema.
#[derive(JsonSchema)]
#[schemars(untagged)]
#[allow(dead_code)]
pub enum Either<A, B> {
    One(A),
    Other(B),
}

/// Return the word that stands for a choice in a scene.
pub fn word<T: Serialize>(choice: &T) -> String {
    let word = serde_json::to_value(choice).unwrap_or_default();
    word.as_str().unwrap_or_default().to_owned()
}

/// Return the choice for a word.
///
/// # Errors
/// A word that stands for none.
pub fn of_word<T: for<'de> Deserialize<'de>, E: serde::de::Error>(word: &str) -> Result<T, E> {
    T::deserialize(serde::de::value::StrDeserializer::new(word))
}
