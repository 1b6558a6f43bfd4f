//! Functions that are given by files, heights of measured surfaces and profiles, for the expressions of a scene.
//!
//! Data flow: file -> numbers in rows (`read`) -> a plane subtracted -> [`Grid`] -> value and gradient at any place
//! ([`Data::sample`]).

mod grid;
mod read;
mod rule;
#[cfg(test)]
mod tests;

pub use grid::{Grid, GridAxis};
pub use rule::{DataSpec, Detrend, Interpolation, Outside, Sample};

use crate::error::{Error, Place, Result, shown};
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

/// The data of a scene by name.
pub type Library = BTreeMap<String, Arc<Data>>;

/// A function given by a file, which is read when the function is first needed.
#[derive(Debug, PartialEq)]
pub struct Data {
    /// The settings of the scene.
    pub spec: DataSpec,
    /// The function, once the file is read.
    grid: OnceLock<Grid>,
}

impl Data {
    /// Return a function whose file is not read yet.
    pub fn new(spec: DataSpec) -> Self {
        Self { spec, grid: OnceLock::new() }
    }

    /// Read the file, unless that was done.
    ///
    /// # Errors
    /// The file cannot be read, or is no surface and no profile; the refusal names its line.
    pub fn load(&self) -> Result<()> {
        if self.grid.get().is_none() {
            let grid = Grid::new(&self.spec, read::rows(&self.spec)?)?;
            self.grid.get_or_init(|| grid);
        }
        Ok(())
    }

    /// Return the function, if the file is read.
    pub fn grid(&self) -> Option<&Grid> {
        self.grid.get()
    }

    /// Return the number of arguments: 1 for a profile, 2 for a surface.
    pub fn arguments(&self) -> usize {
        self.grid().map_or(1, |grid| if grid.axes[1].count > 1 { 2 } else { 1 })
    }

    /// Return value and gradient at a place, which has as many coordinates as there are arguments.
    pub fn sample(&self, place: &[f64]) -> Sample {
        let at = [place.first(), place.get(1)].map(|x| x.copied().unwrap_or(0.0));
        self.grid().map_or(Sample::NONE, |grid| grid.sample(at))
    }

    /// Return all its numbers in a fixed order; none if the file is not read yet.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        self.grid().into_iter().flat_map(|Grid { axes, values, .. }| {
            let counts = axes.iter().flat_map(|axis| [axis.origin, axis.spacing, axis.count as f64]);
            counts.chain(values.iter().copied())
        })
    }

    /// Return the refusal of a place without a value. `what` is the quantity whose expression, at `here`, needs the
    /// value.
    pub fn outside(&self, here: &Place, what: &str, place: &[f64]) -> Error {
        let at: Vec<String> = place.iter().map(|&x| shown(x)).collect();
        let axes = self.grid().map_or(&[][..], |grid| &grid.axes[..place.len().min(2)]);
        let range = axes.iter().map(GridAxis::range).map(|[from, to]| format!("{} to {}", shown(from), shown(to)));
        let name = &self.spec.name;
        Error::scene(here, format!("{what}: data `{name}` have no value at ({})", at.join(", ")))
            .label("asked for it")
            .because(format!("`{name}` has values for {}", range.collect::<Vec<_>>().join(" and ")))
            .help("move them by `origin` and `spacing`, or say what is beyond: outside = \"clamp\" or \"periodic\"")
    }
}
