//! `steps.csv`: one row a load step, written as it ends; and the columns of forces that other tables share.

use super::folder::Folder;
use super::format::field;
use super::rows::RowFile;
use crate::error::Result;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A load step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StepReport {
    /// Time in the history.
    pub time: f64,
    /// Factors of loads and prescribed displacements by name.
    pub factors: BTreeMap<String, f64>,
    /// How it ended, as [`Report::status`](super::Report::status).
    pub status: String,
    /// The status in words.
    pub message: String,
    /// Updates of the iterate in it.
    pub iterations: usize,
    /// Relative residual at its end.
    pub residual: Option<f64>,
    /// Its pairs in the order of the scene.
    pub pairs: Vec<StepPairReport>,
    /// Forces of supports, springs and rigid surfaces, body by body.
    pub reactions: Vec<ReactionReport>,
}

/// A pair of surfaces at the end of a load step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StepPairReport {
    /// Contact force on the side that stands first in the scene (x, y, z).
    pub force: [f64; 3],
    /// How far the bodies come nearer to each other; none where normals cancel.
    pub approach: Option<f64>,
    /// How much of it is in contact.
    #[serde(flatten)]
    pub extent: Extent,
    /// Largest pressure.
    pub peak_pressure: f64,
    /// Largest compression of the layer; negative where all of it is open.
    pub peak_compression: f64,
    /// Points with c > 0.
    pub closed: usize,
}

/// How much of what two surfaces cover is in contact, c > 0, and how much is open, c < 0: lengths in the plane; areas in space, and of bodies
/// of revolution, all around.
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
    /// Of a pair whose points have these weights, a [`measure`](crate::contact::ContactPair::measure) of them, and compressions.
    pub fn new(measure: &str, weight: &[f64], compression: &[f64]) -> Self {
        let sum = |is: fn(f64) -> bool| {
            weight.iter().zip(compression).filter(|(_, c)| is(**c)).fold(0.0, |sum, (weight, _)| sum + weight)
        };
        let (contact, open) = (sum(|c| c > 0.0), sum(|c| c < 0.0));
        match measure {
            "length" => Self::Length { contact_length: contact, open_length: open },
            _ => Self::Area { contact_area: contact, open_area: open },
        }
    }

    /// What is in contact.
    pub fn contact(&self) -> f64 {
        let (Self::Length { contact_length: contact, .. } | Self::Area { contact_area: contact, .. }) = self;
        *contact
    }

    /// What is open.
    pub fn open(&self) -> f64 {
        let (Self::Length { open_length: open, .. } | Self::Area { open_area: open, .. }) = self;
        *open
    }
}

/// Name of the column of what is in contact, by the measure of the pairs.
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

/// Names of the components of a vector: `what_x name` and so on, as many as the scene has dimensions.
pub fn vector_columns(what: &str, name: &str, dimension: usize) -> Vec<String> {
    ["x", "y", "z"][..dimension].iter().map(|axis| format!("{what}_{axis} {name}")).collect()
}

/// Its fields.
pub fn vector_fields(vector: &[f64; 3], dimension: usize) -> impl Iterator<Item = String> {
    vector[..dimension].iter().map(|&value| field(value))
}

/// Writes one line of `steps.csv` for each load step.
pub struct StepTable {
    rows: RowFile,
    dimension: usize,
    count: usize,
}

impl StepTable {
    /// Opens `steps.csv` and writes its header: names of `factors`, of `pairs`, whose contact has this `measure`, and of `reactions`, each
    /// once.
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

    /// Writes a step; `names` are those of its factors in the order of the header.
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

    /// Why rows are missing, in words, once.
    pub fn complaint(&mut self) -> Option<String> {
        self.rows.complaint()
    }

    /// Ends the file.
    ///
    /// # Errors
    /// Rows that could not be written to the end.
    pub fn finish(self) -> Result<()> {
        self.rows.finish()
    }
}
