//! Scene files: from TOML to a checked [`Scene`]. Every refusal names file and line, and says what to do.
//!
//! [`load`] parses the file into a `document` and changes it by the options of the command line. The scene is made in
//! two passes: serde reads it, and [`Compile`] completes it with what is known of the whole scene. What serde refuses
//! is put into words by `refuse`. The scene, whether it is read or built in Rust, is checked by [`Scene::verify`].

mod document;
pub mod gone;
mod refuse;
mod spec;
#[cfg(test)]
mod tests;

pub use spec::{AdaptSpec, Flags, OutputSpec, Precision, Quantity, Scene, remove, schema};

use crate::error::{Error, Kind, Located, Result, Source};
use crate::expression::coordinates;
use crate::problem::compile::{Compile, Names};
use crate::problem::data::find_files;
use document::Document;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Read and check a scene file, after applying `overrides` in their order: `KEY=VALUE` as given to `--set`. The mesh
/// file must exist; it is not read.
///
/// # Errors
/// Refusals point at the text of the scene or of the override. A file that cannot be read is [`Kind::File`].
pub fn load(path: &Path, overrides: &[String]) -> Result<Scene> {
    parse(path, text(path)?, overrides, &Flags::default())
}

/// Check the [`text`] of a scene file like [`load`], which reads it from `path`. Overrides of another option than
/// `--set` begin with it: `--over KEY=VALUE`. Flags come last.
///
/// # Errors
/// Those of [`load`], but for reading the file.
pub fn parse(path: &Path, text: String, overrides: &[String], flags: &Flags) -> Result<Scene> {
    let file = Arc::new(Source { name: path.display().to_string(), text });
    let options: Vec<Arc<Source>> = overrides.iter().map(|text| option(text)).collect();
    let document = Document::new(&file, &options)?;
    let mut scene: Scene = document.read()?;
    scene.path = path.to_owned();
    if scene.title.is_empty() {
        scene.title = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    }
    scene.compile(&document, path.parent().unwrap_or(Path::new("")))?;
    let of_flags = flags.apply(&mut scene, &|path| document.find(path));
    let find = |path: &str| of_flags.get(path).cloned().or_else(|| document.find(path));
    scene.method.complete(|key| find(&format!("method.{key}")))?;
    scene.method.steps.join(&scene.bodies, &scene.contacts)?;
    scene.verify(&find)?;
    Ok(scene)
}

/// Return an option of the command line as a text with a name.
fn option(text: &str) -> Arc<Source> {
    let text = text.trim_end();
    let text = if text.starts_with("--") { text.to_owned() } else { format!("--set {text}") };
    let name = text.split(' ').next().unwrap_or_default().to_owned();
    Arc::new(Source { name, text })
}

impl Scene {
    /// Complete a scene that serde has read. What others refer to comes first: the dimension, data, load steps.
    fn compile(&mut self, document: &Document<'_>, folder: &Path) -> Result<()> {
        let Located { value: dimension, place } = &mut self.dimension;
        let mut names = Names {
            sources: &document.sources,
            folder,
            dimension: *dimension,
            data: &Default::default(),
            variables: &[],
            factors: &[],
            of_steps: &[],
        };
        place.compile(&names)?;
        if ![2, 3].contains(dimension) {
            return Err(Error::scene(place, format!("`dimension` is {dimension}")).label("must be 2 or 3"));
        }
        if let (3, Some(place)) = (*dimension, document.find("plane")) {
            return Err(Error::scene(&place, "`plane` in a problem in space")
                .label("only plane problems have it")
                .help("remove it, or set dimension = 2"));
        }
        find_files(&mut self.data, &names)?;
        self.method.steps.compile(&names)?;
        let (variables, of_steps) = (coordinates(*dimension, false), self.method.steps.factor_names());
        names = Names { data: &self.data, variables: &variables, of_steps: &of_steps, ..names };
        self.mesh.compile(&names)?;
        self.bodies.compile(&names)?;
        self.contacts.compile(&names)?;
        self.method.compile(&names)?;
        self.adapt.compile(&names)?;
        self.contacts.iter_mut().enumerate().for_each(|(table, contact)| contact.table = table);
        Ok(())
    }
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
