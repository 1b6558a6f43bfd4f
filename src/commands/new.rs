//! `winkler new`: write a small scene that works, with its script, to begin from.

use crate::error::{Error, Kind, Result};
use crate::output::{make_folder, say};
use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;

/// A scene to begin from, and its script.
pub type Example = [&'static str; 2];

/// Two blocks in the plane.
pub const PLANE: Example = [include_str!("new/plane.toml"), include_str!("new/plane.geo")];
/// Two blocks in space.
pub const SPACE: Example = [include_str!("new/space.toml"), include_str!("new/space.geo")];
/// Two cylinders as bodies of revolution.
pub const REVOLUTION: Example = [include_str!("new/revolution.toml"), include_str!("new/revolution.geo")];

/// Write a scene and its script into `folder`, whose last word names the scene, and return the exit code. Existing
/// files are not replaced.
///
/// # Errors
/// A folder without a name or with one that is no file name, files that exist or cannot be written.
pub fn new(folder: &Path, [scene, script]: Example) -> Result<i32> {
    let name = folder
        .file_name()
        .and_then(|name| name.to_str())
        .filter(|name| !name.contains(|c: char| c.is_control() || "\"\\".contains(c)));
    let Some(name) = name else {
        let message = format!("`{}` does not end with a name for a scene", folder.display());
        return Err(Error::new(Kind::Usage, message).help("for example `winkler new blocks`"));
    };
    let files = [("scene.toml".to_owned(), scene), (format!("{name}.geo"), script)];
    make_folder(folder)?;
    if let Some((file, _)) = files.iter().find(|(file, _)| folder.join(file).symlink_metadata().is_ok()) {
        let message = format!("`{}` is there already", folder.join(file).display());
        return Err(Error::new(Kind::File, message).help("choose another name, or move it away"));
    }
    for (file, text) in &files {
        let path = folder.join(file);
        let write = || {
            let mut file = OpenOptions::new().write(true).create_new(true).open(&path)?;
            file.write_all(text.replace("NAME", name).as_bytes())
        };
        write().map_err(|cause| Error::file(&path, "write", &cause))?;
    }
    let path = folder.join("scene.toml");
    let scene = path.display();
    say(format_args!("{scene} and {name}.geo are there. Next:\n  winkler check {scene}\n  winkler solve {scene}"))?;
    if let Some(examples) = crate::scene::examples() {
        say(format_args!("More examples are in {}", examples.display()))?;
    }
    Ok(0)
}
