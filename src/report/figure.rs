//! Single pictures of a run as SVG files.

use super::contact::failed;
use super::page::Results;
use crate::error::{Error, Kind, Result, nearest};
use crate::output::write_whole;
use std::path::{Path, PathBuf};

/// What can be drawn.
const WHAT: [&str; 4] = ["stress", "displacement", "pressure", "convergence"];

/// Draws one of `WHAT` from a folder of results to `out`, or to a file of its name in the folder; returns the paths. Several pairs
/// have a picture each, numbered from the second one on.
///
/// # Errors
/// [`Kind::Usage`] for another word or ending; [`Kind::File`] when the folder lacks what is to be drawn.
pub fn draw(folder: &Path, what: &str, out: Option<&Path>) -> Result<Vec<PathBuf>> {
    if !WHAT.contains(&what) {
        let near = nearest(what, WHAT).map(|near| format!("did you mean `{near}`?"));
        return Err(Error::new(Kind::Usage, format!("there is no picture called `{what}`"))
            .help(near.unwrap_or_else(|| format!("there are {}", WHAT.join(", ")))));
    }
    let path = out.map_or_else(|| folder.join(format!("{what}.svg")), Path::to_owned);
    if path.extension().is_none_or(|ending| ending != "svg") {
        return Err(Error::new(Kind::Usage, format!("{} does not end in .svg", path.display()))
            .help("pictures are SVG; rsvg-convert or Inkscape make PNG or PDF of them"));
    }
    let results = Results::read(folder)?;
    let lacks = |lacking: &str, advice: &str| {
        Error::new(Kind::File, format!("{} has {lacking}", folder.display())).help(advice)
    };
    let pictures: Vec<String> = match what {
        "pressure" => results.pressures(true)?.into_iter().map(|picture| picture.svg).collect(),
        "convergence" => {
            results.convergence()?.map(|plot| plot.svg().map_err(failed)).transpose()?.into_iter().collect()
        }
        _ => {
            let bodies = results.bodies()?;
            if bodies.is_empty() {
                return Err(lacks("no fields of bodies", "solve the scene again with --vtu"));
            }
            if bodies.iter().any(|part| part.is_solid) {
                return Err(lacks("bodies in space", "`winkler report` shows them in a view that turns"));
            }
            vec![results.bands(&bodies, what == "stress", true)?]
        }
    };
    if pictures.is_empty() {
        return Err(lacks(
            &format!("nothing to draw as {what}"),
            "no pair touches or has a table, or nothing was iterated",
        ));
    }
    let file = |(k, svg): (usize, String)| {
        let path = match k {
            0 => path.clone(),
            _ => {
                path.with_file_name(format!("{}-{}.svg", path.file_stem().unwrap_or_default().to_string_lossy(), k + 1))
            }
        };
        write_whole(&path, |out| out.write_all(svg.as_bytes()))?;
        Ok(path)
    };
    pictures.into_iter().enumerate().map(file).collect()
}
