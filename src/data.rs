//! Functions that are given by files, heights of measured surfaces and profiles, for the expressions of a scene.
//!
//! Data flow: file -> numbers in rows (`read`) -> points without a height counted, a trend subtracted, gaps filled -> [`Grid`], knots of
//! a profile, or triangulation (`arrange`) -> value and gradient at any place ([`Data::sample`]).

mod arrange;
mod grid;
mod raster;
mod read;
mod rule;
mod scattered;
#[cfg(test)]
mod tests;

pub use arrange::Trend;
pub use grid::{Grid, Summits};
pub use raster::has_header;
pub use rule::{DataSpec, Detrend, Fill, Interpolation, NoData, Outside, Sample};

use crate::error::{Error, Place, Result, shown};
use arrange::{Arranged, PointLayout};
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

/// The data of a scene by name.
pub type Library = BTreeMap<String, Arc<Data>>;

/// A function given by a file, which is read when the function is first needed.
#[derive(Debug)]
pub struct Data {
    /// The settings of the scene.
    pub spec: DataSpec,
    /// The function, once the file is read.
    arranged: OnceLock<Arranged>,
}

impl Data {
    /// Return a function whose file is not read yet.
    pub fn new(spec: DataSpec) -> Self {
        Self { spec, arranged: OnceLock::new() }
    }

    /// Read the file, unless that was done.
    ///
    /// # Errors
    /// The file cannot be read, or is no surface and no profile; the refusal names its line.
    pub fn load(&self) -> Result<()> {
        if self.arranged.get().is_some() {
            return Ok(());
        }
        let arranged = arrange::shape(&self.spec, read::rows(&self.spec)?)?;
        self.arranged.get_or_init(|| arranged);
        Ok(())
    }

    /// Return the function, if the file is read.
    fn shape(&self) -> Option<&PointLayout> {
        self.arranged.get().map(|arranged| &arranged.shape)
    }

    /// Return the number of points of the file without a height; zero if the file is not read yet.
    pub fn missing(&self) -> usize {
        self.arranged.get().map_or(0, |arranged| arranged.missing)
    }

    /// Return the polynomial that was subtracted from the heights, if any.
    pub fn trend(&self) -> Option<Trend> {
        self.arranged.get().and_then(|arranged| arranged.trend)
    }

    /// Return the number of arguments: 1 for a profile, 2 for a surface.
    pub fn arguments(&self) -> usize {
        match self.shape() {
            Some(PointLayout::Grid(grid)) if grid.axes[1].count > 1 => 2,
            Some(PointLayout::Scattered(..)) => 2,
            _ => 1,
        }
    }

    /// Return value and gradient at a place, which has as many coordinates as there are arguments.
    pub fn sample(&self, place: &[f64]) -> Sample {
        let at = [place.first(), place.get(1)].map(|x| x.copied().unwrap_or(0.0));
        let holds = self.spec.outside == Outside::Clamp;
        match self.shape() {
            Some(PointLayout::Grid(grid)) => grid.sample(at),
            Some(PointLayout::Knots(knots)) => knots.sample(at[0], holds),
            Some(PointLayout::Scattered(scattered, _)) => scattered.sample(at, holds),
            None => Sample::NONE,
        }
    }

    /// Return all its numbers in a fixed order; none if the file is not read yet.
    pub fn numbers(&self) -> Box<dyn Iterator<Item = f64> + '_> {
        match self.shape() {
            Some(PointLayout::Grid(Grid { axes, values, .. })) => {
                let counts = axes.iter().flat_map(|axis| [axis.origin, axis.spacing, axis.count as f64]);
                Box::new(counts.chain(values.iter().copied()))
            }
            Some(PointLayout::Knots(knots)) => Box::new(knots.0.iter().flatten().copied()),
            Some(PointLayout::Scattered(scattered, _)) => Box::new(scattered.numbers()),
            None => Box::new(std::iter::empty()),
        }
    }

    /// Return the regular grid, if the file is read and has one.
    pub fn grid(&self) -> Option<&Grid> {
        match self.shape() {
            Some(PointLayout::Grid(grid)) => Some(grid),
            _ => None,
        }
    }

    /// Return the refusal of a place without a value. `what` is the quantity whose expression, at `here`, needs the value.
    pub fn outside(&self, here: &Place, what: &str, place: &[f64]) -> Error {
        let join = |coordinates: &[f64]| coordinates.iter().map(|&x| shown(x)).collect::<Vec<_>>().join(", ");
        let range = match self.shape() {
            Some(PointLayout::Grid(grid)) => grid.axes.map(|axis| axis.range()),
            Some(PointLayout::Knots(knots)) => [knots.range(); 2],
            Some(PointLayout::Scattered(_, range)) => *range,
            None => [[f64::NAN; 2]; 2],
        };
        let range: Vec<String> = range[..place.len().min(2)]
            .iter()
            .map(|[from, to]| format!("{} to {}", shown(*from), shown(*to)))
            .collect();
        let advice = match self.grid() {
            Some(_) => "\"clamp\" or \"periodic\"",
            None => "\"clamp\"",
        };
        let name = &self.spec.name;
        Error::scene(here, format!("{what}: data `{name}` have no value at ({})", join(place)))
            .label("asked for it")
            .because(format!("`{name}` has values for {}", range.join(" and ")))
            .help(format!("move them by `origin` and `spacing`, or say what is beyond: outside = {advice}"))
    }
}
