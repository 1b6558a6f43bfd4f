//! The observer of a run of `solve`: tables, checkpoints, snapshots and signals.

use super::adapt::Plan;
use super::checkpoint::Checkpoint;
use super::series;
use super::write::ResultFiles;
use crate::ddm::{Observer, Row, Status};
use crate::error::Result;
use crate::output::{Folder, HistoryWriter, IterationTable, RowFile, StepTable};
use crate::petsc::Session;
use crate::run::requests::{is_snapshot, signal};
use crate::run::{All, Clock, Done, Prepared, Recorder, Requests, measure};

/// The tables that grow while a round iterates. They are open only on the rank that writes.
#[derive(Default)]
pub struct Tables {
    /// Rows of the iterations.
    history: Option<HistoryWriter>,
    /// Rows of the load steps, if there are any.
    steps: Option<StepTable>,
}

impl Tables {
    /// Open the tables of a round. The table of load steps begins with those of another process.
    ///
    /// # Errors
    /// A table that cannot be written.
    pub fn open(folder: &Folder, ready: &Prepared) -> Result<Self> {
        let (built, history) = (&ready.built, &ready.built.scene.method.steps);
        let bodies: Vec<&str> = built.discrete.bodies.iter().map(|body| body.name.as_str()).collect();
        let rows = HistoryWriter::create(folder, &bodies, !history.is_empty())?;
        let mut tables = Self { history: Some(rows), steps: None };
        if !history.is_empty() {
            let (pairs, reactions) = (measure::pair_names(built), measure::reaction_names(built));
            let (dimension, measure) = (built.scene.dimension.value, measure::of_points(built));
            let mut steps = StepTable::create(folder, &history.names, &pairs, &reactions, dimension, measure)?;
            ready.steps.iter().for_each(|step| steps.row(&history.names, step));
            tables.steps = Some(steps);
        }
        Ok(tables)
    }

    /// Complete the files.
    ///
    /// # Errors
    /// Rows that could still not be written.
    pub fn finish(self) -> Result<()> {
        let files = [self.history.map(|history| history.rows), self.steps.map(|steps| steps.rows)];
        files.into_iter().flatten().map(RowFile::finish).fold(Ok(()), Result::and)
    }
}

/// The observer of a round: it writes iterations and load steps to the terminal and to tables, passes requests of the user on, and writes
/// checkpoints and snapshots.
pub struct Watcher<'a> {
    /// The table on the terminal.
    pub table: IterationTable,
    /// The tables in files.
    pub tables: Tables,
    /// Folder of results.
    pub folder: &'a Folder,
    /// Requests by signals and by the time between checkpoints.
    pub asking: &'a Requests,
    /// Session of this rank.
    pub session: &'a Session,
    /// Plan with the meshes before.
    pub plan: &'a Plan,
    /// Times of the phases so far.
    pub clock: Clock,
    /// Whether the folder has a checkpoint of this run.
    pub has_checkpoint: bool,
    /// Messages about files that could not be written.
    pub unwritten: Vec<String>,
}

impl Observer for Watcher<'_> {
    fn row(&mut self, row: &Row) {
        self.table.row(row);
        if let Some(history) = &mut self.tables.history {
            history.row(row);
            history.rows.complaint().iter().for_each(|text| self.table.warn(text));
        }
    }

    fn asked(&self) -> u8 {
        self.asking.bits()
    }
}

impl Watcher<'_> {
    /// Note a failure to write, each message once. The run goes on: a disk that is full now may have room later.
    fn note_failure(&mut self, what: &str, written: Result<()>) {
        if let Err(error) = written {
            let text = format!("{what} was not written: {}", error.message());
            if !self.unwritten.contains(&text) {
                self.unwritten.push(text);
            }
        }
    }
}

impl Recorder for Watcher<'_> {
    fn state(&mut self, done: &Done) {
        let Status::Paused { asked } = done.outcome.status else { return };
        let is_due = signal(asked).is_some() || !is_snapshot(asked);
        let Some(head) = is_due.then(|| self.plan.head()).flatten() else { return };
        let written = Checkpoint::write(self.folder.path(), head, done, self.session.rank() == 0);
        self.has_checkpoint |= written.is_ok();
        self.note_failure("a checkpoint", written);
    }

    fn step(&mut self, done: &Done, recovered: &All) {
        let scene = &done.built.scene;
        let history = &scene.method.steps;
        if let (Some(table), Some(step)) = (&mut self.tables.steps, done.steps.last()) {
            table.row(&history.names, step);
            table.rows.complaint().iter().for_each(|text| self.table.warn(text));
        }
        let ends = done.steps.len() == history.steps.len() || matches!(done.outcome.status, Status::Paused { .. });
        if scene.output.vtu && !ends {
            let written = series::write(done, recovered, self.folder);
            self.note_failure("a field of a load step", written);
        }
    }

    fn results(&mut self, done: &mut Done) {
        let Self { session, plan, .. } = *self;
        let path = self.folder.path();
        let files = ResultFiles { session, path, plan, done, estimate: None, fields: true, is_last: false };
        let (_, written) = files.write(&mut self.clock.clone(), |_| {});
        self.note_failure("a snapshot", written);
    }
}
