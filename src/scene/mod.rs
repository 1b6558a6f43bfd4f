//! Scene files: from TOML to a checked [`Scene`]. Every refusal names file and line, and says what to do.
//!
//! [`load`] reads the file into a tree of values, applies the overrides of the command line (`overrides`), and decodes the tree
//! (`decode`) by the keys that the structs of the scene declare (module `setting`). The scene that results (`spec`) is then checked
//! (`check`).

mod build;
mod check;
mod contents;
mod decode;
mod overrides;
mod schema;
mod spec;
#[cfg(test)]
mod tests;

pub use schema::schema;
pub use spec::{AdaptSpec, Most, OutputSpec, Precision, Scene};

use crate::error::{Error, Kind, Result, Source};
use crate::setting::document;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Read and check a scene file, after applying `overrides` in their order: `KEY=VALUE` as given to `--set`, or options that are short for
/// it. The mesh file must exist; it is not read.
///
/// # Errors
/// Refusals point at the text of the scene or of the override. A file that cannot be read is [`Kind::File`].
pub fn load(path: &Path, overrides: &[String]) -> Result<Scene> {
    parse(path, read_text(path)?, overrides)
}

/// Check the text of a scene file like [`load`], which reads it from `path`.
///
/// # Errors
/// Those of [`load`], but for reading the file.
pub fn parse(path: &Path, text: String, overrides: &[String]) -> Result<Scene> {
    let source = Arc::new(Source { name: path.display().to_string(), text });
    let mut tree = document(&source)?;
    for text in overrides {
        overrides::apply(&mut tree, text)?;
    }
    let scene = decode::scene(&tree, path)?;
    scene.verify().map_err(|refusal| refusal.error.at(tree.place_of(&refusal.key)))?;
    Ok(scene)
}

/// Return the folder of examples, if the source that the program was built from is still there.
pub fn examples() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes");
    folder.is_dir().then_some(folder)
}

fn read_text(path: &Path) -> Result<String> {
    if path.is_dir() {
        let error = Error::new(Kind::File, format!("{} is a folder, not a scene file", path.display()));
        let inside = path.join("scene.toml");
        return Err(match inside.is_file() {
            true => error.help(format!("did you mean {}?", inside.display())),
            false => error,
        });
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
