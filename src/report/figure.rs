//! Single pictures of a run as SVG files.

use super::contact::failed;
use super::page::Results;
use crate::error::{Error, Kind, Result};
use crate::output::{Folder, write_whole};
use std::path::{Path, PathBuf};

/// Names of the pictures.
const WHAT: [&str; 5] = ["stress", "displacement", "pressure", "convergence", "area"];

/// Draw one of the pictures `stress`, `displacement`, `pressure`, `convergence` and `area` from a folder of results, and return the
/// paths of the files.
///
/// The file is `out`, or an SVG file of the picture's name in the folder. Each pair has a picture of its own, numbered from the
/// second one on.
///
/// # Errors
/// [`Kind::Usage`] for another word or ending; [`Kind::File`] when the folder lacks what is to be drawn.
pub fn draw(folder: &Path, what: &str, out: Option<&Path>) -> Result<Vec<PathBuf>> {
    if !WHAT.contains(&what) {
        return Err(Error::new(Kind::Usage, format!("there is no picture called `{what}`")).suggest(
            what,
            WHAT,
            || format!("there are {}", WHAT.join(", ")),
        ));
    }
    let out_path = out.map_or_else(|| folder.join(format!("{what}.svg")), Path::to_owned);
    if out_path.extension().is_none_or(|ending| ending != "svg") {
        return Err(Error::new(Kind::Usage, format!("{} does not end in .svg", out_path.display()))
            .help("pictures are SVG; rsvg-convert or Inkscape make PDF or PNG of them"));
    }
    let results = Results::read(folder)?;
    if out.is_none() {
        // a folder of another user is read, never written to
        Folder::create(folder)?;
    }
    let mut paths = Vec::new();
    for (k, svg) in pictures(&results, folder, what)?.into_iter().enumerate() {
        let path = if k == 0 { out_path.clone() } else { numbered(&out_path, k + 1) };
        write_whole(&path, |out| out.write_all(svg.as_bytes()))?;
        paths.push(path);
    }
    Ok(paths)
}

/// Return a path with a number behind the stem of its file.
fn numbered(path: &Path, number: usize) -> PathBuf {
    let [stem, ending] = [path.file_stem(), path.extension()].map(|part| part.unwrap_or_default().to_string_lossy());
    path.with_file_name(format!("{stem}-{number}.{ending}"))
}

/// Return the pictures called `what` as SVG, at least one.
///
/// # Errors
/// [`Kind::File`] when the folder lacks the data.
fn pictures(results: &Results, folder: &Path, what: &str) -> Result<Vec<String>> {
    let lacks = |lacking: &str, advice: &str| {
        Error::new(Kind::File, format!("{} has {lacking}", folder.display())).help(advice)
    };
    let pictures: Vec<String> = match what {
        "pressure" => results.pressures(true)?.into_iter().map(|picture| picture.svg).collect(),
        "convergence" => {
            results.convergence()?.map(|plot| plot.svg().map_err(failed)).transpose()?.into_iter().collect()
        }
        "area" => {
            let Some(plot) = results.area() else {
                return Err(lacks("no load steps", "give the scene `method.steps`, or a history of its loads"));
            };
            vec![plot.svg().map_err(failed)?]
        }
        _ => {
            let bodies = results.bodies()?;
            if bodies.is_empty() {
                return Err(lacks("no fields of bodies", "solve the scene again with --vtu"));
            }
            vec![results.field(&bodies, what == "stress")?]
        }
    };
    if pictures.is_empty() {
        return Err(lacks(
            &format!("nothing to draw as {what}"),
            "no pair touches or has a table, or nothing was iterated",
        ));
    }
    Ok(pictures)
}
