//! What settings share when they are read and written by serde: the spans of values, values with several forms,
//! expressions, vectors.
//!
//! This is the first pass of reading a scene. It refuses what is wrong in itself; what depends on the rest of the scene
//! waits for the second pass ([`compile`](super::compile)) and the checks ([`Check`](super::check::Check)).

use super::check::Fault;
use super::compile::{Compile, Names};
use super::geometry::Geometry;
use crate::error::{Error, Located, Place, Result as Checked, Source};
use crate::expression::{Expression, Field};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Serialize, Serializer};
use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;
use std::ops::{Deref, Index, Range};
use std::sync::{Arc, LazyLock};
use toml::Spanned;

/// The text of places that are spans as yet.
static NOWHERE: LazyLock<Arc<Source>> = LazyLock::new(Arc::default);

/// Return a span as a place without its text.
pub fn unplaced(span: Range<usize>) -> Place {
    Place { source: NOWHERE.clone(), span }
}

/// A refusal on its way through serde, whose errors are texts.
pub struct Refusal(pub Error);

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.packed())
    }
}

impl From<Error> for Refusal {
    fn from(error: Error) -> Self {
        Self(error)
    }
}

/// Return the error of serde that stands for a refusal.
pub fn refused<E: de::Error>(error: Error) -> E {
    E::custom(Refusal(error))
}

/// Refuse a table that has several keys of which one can hold. The caret marks the later one; options come later than
/// the scene file.
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

/// A table and its place. serde would also take a list, whose items it would give to the keys in their order.
pub struct Table<T>(pub Located<T>);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Table<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Located { value, place } = Located::<Form<IgnoredAny, T>>::deserialize(deserializer)?;
        match value {
            Form::Table(table) => Ok(Self(Located::new(table, place))),
            other => Err(other.instead_of("a table", &place)),
        }
    }
}

/// Read a table, for `#[serde(deserialize_with)]`.
///
/// # Errors
/// Those of serde.
pub fn table<'de, T: Deserialize<'de>, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    Table::deserialize(deserializer).map(|table| table.0.value)
}

/// Read a table of a key that need not be there.
///
/// # Errors
/// Those of serde.
pub fn some_table<'de, T: Deserialize<'de>, D: Deserializer<'de>>(deserializer: D) -> Result<Option<T>, D::Error> {
    table(deserializer).map(Some)
}

/// Read a table and its place.
///
/// # Errors
/// Those of serde.
pub fn located<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<Located<T>>, D::Error> {
    Table::deserialize(deserializer).map(|table| Some(table.0))
}

/// Read a list of tables.
///
/// # Errors
/// Those of serde.
pub fn tables<'de, T: Deserialize<'de>, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<T>, D::Error> {
    Ok(Vec::<Table<T>>::deserialize(deserializer)?.into_iter().map(|table| table.0.value).collect())
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Located<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = Spanned::<T>::deserialize(deserializer)?;
        let place = unplaced(value.span());
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
    /// Return the refusal of a form that has no meaning; `expected` says in words what has.
    pub fn instead_of<E: de::Error>(&self, expected: &str, place: &Place) -> E {
        let found = match self {
            Self::Flag => "true or false",
            Self::Integer(_) => "a whole number",
            Self::Number(_) => "a number",
            Self::Text(_) => "a string",
            Self::List(_) => "a list",
            Self::Table(_) => "a table",
        };
        let error = Error::scene(place, format!("expected {expected}, found {found}"));
        refused(error.label(format!("not {expected}")))
    }
}

/// What belongs where a [`Field`] stands.
const FIELD: &str = "a number or an expression";

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

/// A number or an expression.
impl<'de> Deserialize<'de> for Field {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Located { value, place } = Located::<Form>::deserialize(deserializer)?;
        field(value, place)
    }
}

/// Refuse forces and moments that depend on the place.
///
/// # Errors
/// An expression in the coordinates.
pub fn check_numbers(fields: &[Field]) -> Checked<()> {
    let Some(place) = fields.iter().find_map(Field::place) else { return Ok(()) };
    let error = Error::scene(place, "a total force or moment does not depend on the place");
    Err(error.help("give numbers, or a traction with expressions"))
}

/// Return the field of a value that is no list and no table.
fn field<E: de::Error, L, T>(value: Form<L, T>, place: Place) -> Result<Field, E> {
    let number = match value {
        Form::Integer(value) => value as f64,
        Form::Number(value) => value,
        Form::Text(text) => return Ok(Field::Expression(Expression::uncompiled(&text, place))),
        other => return Err(other.instead_of(FIELD, &place)),
    };
    check_number(number, &place).map_err(refused)?;
    Ok(Field::Constant(number))
}

/// Refuse numbers with which no run computes.
fn check_number(number: f64, place: &Place) -> Checked<()> {
    let refuse = |message: String| Error::scene(place, message);
    if !number.is_finite() {
        return Err(refuse("the number is not finite".to_owned()));
    }
    if number != 0.0 && !(LEAST..=LEAST.recip()).contains(&number.abs()) {
        return Err(refuse(format!("no run computes with a number like {number:e}"))
            .label("must be 0, or of a size from 1e-110 to 1e110")
            .help("choose other units of length and force"));
    }
    Ok(())
}

impl Compile for Field {
    fn compile(&mut self, names: &Names<'_>) -> Checked<()> {
        let Self::Expression(expression) = self else { return Ok(()) };
        let mut place = expression.place().clone();
        place.compile(names)?;
        *self = Self::parse(expression.text(), &place, names.known())?;
        if let Self::Constant(number) = self { check_number(*number, &place) } else { Ok(()) }
    }
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

/// A vector: three components, the third one zero in the plane. One that was made in Rust is also written with
/// three.
#[derive(Debug, Clone, PartialEq, JsonSchema)]
#[schemars(with = "Vec<Field>")]
pub struct Vector {
    components: Box<[Field; 3]>,
    /// Number of components in the scene file.
    given: Option<usize>,
}

impl Vector {
    /// Return whether three components are given.
    pub fn is_in_space(&self) -> bool {
        self.given == Some(3)
    }

    /// Refuse another number of components than the dimension has.
    ///
    /// # Errors
    /// A fault of the key, or of its first component too many.
    pub fn check(&self, key: &str, geometry: Geometry) -> Result<(), Fault> {
        let count = geometry.dimension;
        let Some(given) = self.given.filter(|given| *given != count) else { return Ok(()) };
        let key = if given > count { format!("{key}.{count}") } else { key.to_owned() };
        let message = format!("a vector has {count} components here, not {given}");
        Err(Fault::new(key, message, "", &format!("the dimension of the scene is {count}")))
    }

    /// Return the numbers of a vector that does not depend on the place; NaN where it does.
    pub fn numbers(&self) -> [f64; 3] {
        self.components.each_ref().map(Field::number)
    }
}

impl Deref for Vector {
    type Target = [Field; 3];

    fn deref(&self) -> &[Field; 3] {
        &self.components
    }
}

/// The components that are missing are zero.
impl<T: Into<Field>, const N: usize> From<[T; N]> for Vector {
    fn from(components: [T; N]) -> Self {
        const { assert!(N <= 3, "vectors have three components at most") };
        Self { given: None, ..components.map(Into::into).to_vec().into() }
    }
}

impl From<Vec<Field>> for Vector {
    fn from(components: Vec<Field>) -> Self {
        let (given, mut components) = (Some(components.len()), components.into_iter());
        let fields = std::array::from_fn(|_| components.next().unwrap_or(Field::Constant(0.0)));
        Self { components: Box::new(fields), given }
    }
}

impl<'de> Deserialize<'de> for Vector {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Vec::<Field>::deserialize(deserializer).map(Self::from)
    }
}

impl Serialize for Vector {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self[..self.given.unwrap_or(3).min(3)].serialize(serializer)
    }
}

impl Compile for Vector {
    fn compile(&mut self, names: &Names<'_>) -> Checked<()> {
        self.components.compile(names)
    }
}

/// A number or an expression, or one for each component. A rotation or a moment is a number about z in the plane, and a
/// vector in space.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum OneOrVector {
    /// One for all components.
    One(Field),
    /// One for each.
    Vector(Vector),
}

impl OneOrVector {
    /// Return its numbers or expressions.
    pub fn fields(&self) -> &[Field] {
        match self {
            Self::One(field) => std::slice::from_ref(field),
            Self::Vector(vector) => &vector[..],
        }
    }

    /// Return its numbers or expressions.
    pub fn fields_mut(&mut self) -> &mut [Field] {
        match self {
            Self::One(field) => std::slice::from_mut(field),
            Self::Vector(vector) => &mut vector.components[..],
        }
    }

    /// Return the components (x, y, z) of a rotation or a moment, from the values of its numbers or expressions.
    pub fn axial(&self, value: impl Fn(&Field) -> f64) -> [f64; 3] {
        match self {
            Self::One(about_z) => [0.0, 0.0, value(about_z)],
            Self::Vector(vector) => vector.each_ref().map(value),
        }
    }

    /// Refuse a rotation or a moment that is a vector in the plane or a number in space.
    ///
    /// # Errors
    /// A fault of the key.
    pub fn check_axial(&self, key: &str, geometry: Geometry) -> Result<(), Fault> {
        match (self, geometry.is_plane()) {
            (Self::One(_), false) => Err(Fault::new(key, "a moment is a vector in space", "", "moment = [MX, MY, MZ]")),
            (Self::Vector(Vector { given: Some(_), .. }), true) => {
                Err(Fault::new(key, "a moment is a number in the plane", "", "moment = M, about z"))
            }
            (Self::Vector(vector), false) => vector.check(key, geometry),
            _ => Ok(()),
        }
    }
}

impl From<[f64; 3]> for OneOrVector {
    fn from(numbers: [f64; 3]) -> Self {
        Self::Vector(numbers.into())
    }
}

/// A single field stands for all components.
impl Index<usize> for OneOrVector {
    type Output = Field;

    fn index(&self, component: usize) -> &Field {
        match self {
            Self::One(field) => field,
            Self::Vector(vector) => &vector[component],
        }
    }
}

impl<'de> Deserialize<'de> for OneOrVector {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Located { value, place } = Located::<Form<Field>>::deserialize(deserializer)?;
        match value {
            Form::List(fields) => Ok(Self::Vector(fields.into())),
            value => field(value, place).map(Self::One),
        }
    }
}

impl Compile for OneOrVector {
    fn compile(&mut self, names: &Names<'_>) -> Checked<()> {
        self.fields_mut().compile(names)
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
            other => return Err(other.instead_of(FIELD, &place)),
        };
        Ok(Self::uncompiled(&text, place))
    }
}

impl Compile for Expression {
    fn compile(&mut self, names: &Names<'_>) -> Checked<()> {
        let mut place = self.place().clone();
        place.compile(names)?;
        *self = Self::parse(self.text(), &place, names.known())?;
        Ok(())
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
