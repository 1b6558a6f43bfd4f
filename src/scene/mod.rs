//! Scene files: from TOML to a checked [`Scene`]. Every refusal names file and line, and says what to do.
//!
//! [`load`] parses the file into a table with spans, puts the options of the command line into it (`overrides`), and
//! lets serde read the [`Scene`] from it. What serde refuses is put into words by `refuse`. The scene, whether it is
//! read or built in Rust, is checked by [`Scene::verify`].

pub mod gone;
mod overrides;
mod refuse;
mod spec;
#[cfg(test)]
mod tests;

pub use spec::{AdaptSpec, Most, OutputSpec, Precision, Quantity, Scene, remove, schema};

use crate::error::{Error, Kind, Located, Result, Source};
use crate::problem::data::{DataKeys, library};
use crate::problem::geometry::{Geometry, Plane};
use crate::problem::history::History;
use crate::problem::method;
use crate::problem::read::{Context, Sources, within};
use overrides::Typed;
use refuse::Reader;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Read and check a scene file, after applying `overrides` in their order: `KEY=VALUE` as given to `--set`, or options
/// that are short for it. The mesh file must exist; it is not read.
///
/// # Errors
/// Refusals point at the text of the scene or of the override. A file that cannot be read is [`Kind::File`].
pub fn load(path: &Path, overrides: &[String]) -> Result<Scene> {
    parse(path, text(path)?, overrides)
}

/// Check the [`text`] of a scene file like [`load`], which reads it from `path`.
///
/// # Errors
/// Those of [`load`], but for reading the file.
pub fn parse(path: &Path, text: String, overrides: &[String]) -> Result<Scene> {
    let source = Arc::new(Source { name: path.display().to_string(), text });
    let mut sources = Sources::default();
    sources.add(source.clone());
    let options: Vec<Typed> = overrides.iter().map(|text| Typed::new(text, &mut sources)).collect();
    let mut table = DeTable::parse(&source.text).map_err(|error| refuse::syntax(&source, 0, &error))?;
    options.iter().try_for_each(|option| option.apply(table.get_mut()))?;
    if let Some(method) = table.get_mut().get_mut("method") {
        method::complete(method);
        refuse_idle(method, &sources, source.text.len())?;
    }
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let reader = Reader { table, sources };
    reader.refuse_lists()?;
    let mut scene = read(&reader, Context { sources: reader.sources.clone(), folder, ..Context::default() })
        .map_err(gone::explain)?;
    scene.path = path.to_owned();
    if scene.title.is_empty() {
        scene.title = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    }
    for (table, contact) in scene.contacts.iter_mut().enumerate() {
        contact.table = table;
        contact.complete();
    }
    scene.method.steps.join(&scene.bodies, &scene.contacts)?;
    scene.verify()?;
    Ok(scene)
}

/// Refuse a key of `[method]` that the method does not read. `length` is that of the file, after which the options
/// begin.
fn refuse_idle(method: &Spanned<DeValue<'_>>, sources: &Sources, length: usize) -> Result<()> {
    let Some(idle) = method::idle_key(method, |span| span.start > length) else { return Ok(()) };
    let message = format!("the method `{}` does not read `{}`", idle.method, idle.name);
    Err(Error::scene(&sources.place(idle.span), message)
        .label("no effect")
        .help(format!("leave it out, or choose a method that reads it: {}", idle.readers)))
}

/// What must be known before the rest of a scene is read.
#[derive(Deserialize)]
struct Head {
    dimension: Located<usize>,
    plane: Option<Located<Plane>>,
    #[serde(default)]
    data: BTreeMap<Spanned<String>, DataKeys>,
    #[serde(default)]
    method: Stepped,
}

/// The load steps.
#[derive(Default, Deserialize)]
struct Stepped {
    #[serde(default)]
    steps: History,
}

/// Read a scene: first what expressions and vectors depend on, then all.
fn read(reader: &Reader<'_>, context: Context) -> Result<Scene> {
    let (geometry, data, factors) = within(context.clone(), || {
        let Head { dimension, plane, data, method } = reader.read()?;
        if ![2, 3].contains(&dimension.value) {
            let message = format!("`dimension` is {}", dimension.value);
            return Err(Error::scene(&dimension.place, message).label("must be 2 or 3"));
        }
        if let (3, Some(plane)) = (dimension.value, &plane) {
            return Err(Error::scene(&plane.place, "`plane` in a problem in space")
                .label("only plane problems have it")
                .help("remove it, or set dimension = 2"));
        }
        let plane = plane.map_or(Plane::Strain, |plane| plane.value);
        Ok((Geometry { dimension: dimension.value, plane }, library(data)?, method.steps.factor_names()))
    })?;
    within(Context { geometry, data, factors, ..context }, || reader.read())
}

/// Return the folder of examples, if the source that the program was built from is still there.
pub fn examples() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes");
    folder.is_dir().then_some(folder)
}

/// Read the text of a scene file.
///
/// # Errors
/// [`Kind::File`] if the file cannot be read or is no text.
pub fn text(path: &Path) -> Result<String> {
    if path.is_dir() {
        let error = Error::new(Kind::File, format!("{} is a folder, not a scene file", path.display()));
        let inside = path.join("scene.toml");
        return Err(if inside.is_file() { error.help(format!("did you mean {}?", inside.display())) } else { error });
    }
    let bytes = crate::file::read(path).map_err(|error| match path.try_exists() {
        Ok(false) => {
            let examples = examples().map_or(String::new(), |folder| format!("; examples are in {}", folder.display()));
            error.help(format!("`winkler new NAME` writes a scene to begin with{examples}"))
        }
        _ => error,
    })?;
    let bytes = crate::file::with_unix_lines(bytes);
    if let Some(other) = crate::file::other_encoding(&bytes) {
        return Err(Error::new(Kind::File, format!("{} {other}", path.display())).help("save the scene file as UTF-8"));
    }
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let line = 1 + error.as_bytes()[..valid].iter().filter(|byte| **byte == b'\n').count();
        Error::new(Kind::File, format!("{} is not UTF-8 text, see line {line}", path.display()))
            .help("save the scene file as UTF-8")
    })
}
