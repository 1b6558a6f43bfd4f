//! What the user wrote: TOML -> checked [`Scene`]. Every refusal names file, line, and the way out.

mod build;
mod check;
mod contents;
mod decode;
mod overrides;
mod read;
mod schema;
mod settings;
mod shape;
mod spec;
#[cfg(test)]
mod tests;

pub use schema::schema;
pub use spec::{AdaptSpec, OutputSpec, Scene};

use crate::error::{Error, Kind, Result, Source};
use std::path::Path;
use std::sync::Arc;

/// Reads and checks a scene file, after replacing what `overrides` say (`KEY=VALUE`, as given to `--set`; the last
/// one wins). The mesh file is looked for, not read.
///
/// Errors point at the words in the scene or the override; a file that cannot be read is [`Kind::File`].
pub fn load(path: &Path, overrides: &[String]) -> Result<Scene> {
    parse(path, read_text(path)?, overrides)
}

/// Checks the text of a scene file like [`load`], which reads it from `path`.
///
/// # Errors
/// Those of [`load`], but for reading the file.
pub fn parse(path: &Path, text: String, overrides: &[String]) -> Result<Scene> {
    let source = Arc::new(Source { name: path.display().to_string(), text });
    let mut tree = read::document(&source)?;
    for text in overrides {
        overrides::apply(&mut tree, text)?;
    }
    let scene = decode::scene(&tree, path)?;
    scene.verify().map_err(|fault| fault.error.at(tree.place_of(&fault.key)))?;
    Ok(scene)
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
    let bytes = crate::file::with_unix_lines(crate::file::read(path)?);
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
