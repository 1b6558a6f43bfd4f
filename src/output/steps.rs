//! `steps.csv`: one row per load step, written when the step ends. Other tables share its columns of forces.

use super::folder::Folder;
use super::format::field;
use super::rows::RowFile;
use crate::error::Result;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The report of a load step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StepReport {
    /// Time in the history.
    pub time: f64,
    /// Factors of loads and prescribed displacements, by name.
    pub factors: BTreeMap<String, f64>,
    /// Status at the end of the step, as [`Report::status`](super::Report::status).
    pub status: String,
    /// The status in words.
    pub message: String,
    /// Updates of the iterate in this step.
    pub iterations: usize,
    /// Relative residual at the end of the step.
    pub residual: Option<f64>,
    /// Pairs in the order of the scene.
    pub pairs: Vec<StepPairReport>,
    /// Forces of supports, springs and rigid surfaces, body by body.
    pub reactions: Vec<ReactionReport>,
}

/// The result of a pair of surfaces at the end of a load step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StepPairReport {
    /// Contact force on the side that stands first in the scene (x, y, z).
    pub force: [f64; 3],
    /// Approach of the two bodies; none where normals cancel.
    pub approach: Option<f64>,
    /// Size of the contact.
    #[serde(flatten)]
    pub extent: Extent,
    /// Largest pressure.
    pub peak_pressure: f64,
    /// Largest compression of the layer; negative where all of it is open.
    pub peak_compression: f64,
    /// Number of points with c > 0.
    pub closed: usize,
}

/// The part of the common surface of a pair that is in contact, c > 0, and the part that is open, c < 0. They are lengths in
/// the plane and areas in space; for bodies of revolution, they are areas of the whole circumference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
#[allow(missing_docs)] // the names are those of the report
pub enum Extent {
    Length { contact_length: f64, open_length: f64 },
    Area { contact_area: f64, open_area: f64 },
}

impl Default for Extent {
    fn default() -> Self {
        Self::Length { contact_length: 0.0, open_length: 0.0 }
    }
}

impl Extent {
    /// Sum the areas `weight` of the points by the sign of their compression. `measure` says whether these are lengths, see
    /// [`measure`](crate::contact::ContactPair::measure).
    pub fn new(measure: &str, weight: &[f64], compression: &[f64]) -> Self {
        let sum = |counts: fn(f64) -> bool| {
            weight.iter().zip(compression).filter(|(_, c)| counts(**c)).fold(0.0, |sum, (weight, _)| sum + weight)
        };
        let (contact, open) = (sum(|c| c > 0.0), sum(|c| c < 0.0));
        match measure {
            "length" => Self::Length { contact_length: contact, open_length: open },
            _ => Self::Area { contact_area: contact, open_area: open },
        }
    }

    /// Return the length or area in contact.
    pub fn contact(&self) -> f64 {
        let (Self::Length { contact_length: contact, .. } | Self::Area { contact_area: contact, .. }) = self;
        *contact
    }

    /// Return the length or area that is open.
    pub fn open(&self) -> f64 {
        let (Self::Length { open_length: open, .. } | Self::Area { open_area: open, .. }) = self;
        *open
    }
}

/// Return the name of the column of the contact size, from the measure of the pairs.
pub fn contact_column(measure: &str) -> String {
    format!("contact_{measure}")
}

/// The force of a support, a spring or a rigid surface on its body.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ReactionReport {
    /// Name of the body.
    pub body: String,
    /// Physical group.
    pub on: String,
    /// The force (x, y, z).
    pub force: [f64; 3],
}

/// Return the column names `what_x name` and so on of a vector, one per dimension of the scene.
pub fn vector_columns(what: &str, name: &str, dimension: usize) -> Vec<String> {
    ["x", "y", "z"][..dimension].iter().map(|axis| format!("{what}_{axis} {name}")).collect()
}

/// Return the fields of a vector in the columns of [`vector_columns`].
pub fn vector_fields(vector: &[f64; 3], dimension: usize) -> impl Iterator<Item = String> {
    vector[..dimension].iter().map(|&value| field(value))
}

/// The table `steps.csv`, one line per load step.
pub struct StepTable {
    /// The file.
    pub rows: RowFile,
    dimension: usize,
    count: usize,
}

impl StepTable {
    /// Open `steps.csv` and write its header from the names of `factors`, `pairs` and `reactions`, each of which occurs once. The
    /// `measure` is that of the pairs.
    ///
    /// # Errors
    /// [`Kind::File`](crate::error::Kind::File) when the file cannot be written.
    pub fn create(
        folder: &Folder,
        factors: &[String],
        pairs: &[String],
        reactions: &[String],
        dimension: usize,
        measure: &str,
    ) -> Result<Self> {
        let mut header = vec!["step".to_owned(), "time".to_owned()];
        header.extend_from_slice(factors);
        header.extend(["status", "iterations", "residual"].map(str::to_owned));
        for pair in pairs {
            header.extend(vector_columns("force", pair, dimension));
            let numbers = ["approach", &contact_column(measure), "peak_pressure", "closed"];
            header.extend(numbers.map(|what| format!("{what} {pair}")));
        }
        header.extend(reactions.iter().flat_map(|name| vector_columns("reaction", name, dimension)));
        Ok(Self { rows: RowFile::create(folder, "steps.csv", &header, &[])?, dimension, count: 0 })
    }

    /// Write a step; `names` are those of its factors in the order of the header.
    pub fn row(&mut self, names: &[String], step: &StepReport) {
        self.count += 1;
        let number = |value: Option<f64>| value.map_or(String::new(), field);
        let mut line = vec![self.count.to_string(), field(step.time)];
        line.extend(names.iter().map(|name| number(step.factors.get(name).copied())));
        line.extend([step.status.clone(), step.iterations.to_string(), number(step.residual)]);
        for pair in &step.pairs {
            line.extend(vector_fields(&pair.force, self.dimension));
            line.extend([number(pair.approach), field(pair.extent.contact()), field(pair.peak_pressure)]);
            line.push(pair.closed.to_string());
        }
        line.extend(step.reactions.iter().flat_map(|reaction| vector_fields(&reaction.force, self.dimension)));
        self.rows.push(&line);
    }
}
