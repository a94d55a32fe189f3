//! A folder of experiments → a folder of results: every recording and every table of angles below it, one run each, and one summary of all.
//!
//! | file | holds |
//! |---|---|
//! | [`find`] | the recordings below a folder, with the experiment files that hold for each |
//! | [`layers`] | experiment files inherited downwards, put together |
//! | [`state`] | what was finished, of which contents, and by which version |
//! | [`lock`] | one batch at a time in an output folder |
//! | [`crew`] | the runs: each a process of its own, as many at once as there are cores |
//! | [`together`] | the recordings of one specimen |
//! | [`summary`] | a row a recording, as CSV and Parquet |
//! | [`index`] | the same as a page |
//!
//! Every run is a process of its own: a recording that brings a decoder down, or takes all memory, is a row with its reason and not the end of the others, and
//! what a recording leaves is by construction what the command alone leaves.

pub mod crew;
pub mod find;
pub mod index;
pub mod layers;
pub mod lock;
pub mod state;
pub mod summary;
pub mod together;

use std::path::PathBuf;

use rayon::prelude::*;
use serde::Serialize;

use crate::error::{Error, Result};
use crate::output;
use crew::{Crew, Job, Watch};
use find::Found;
use lock::Lock;
use state::{Fingerprint, Finished, Status};
use summary::Row;

/// One part of several: of the recordings in order every `of`-th, beginning with number `part`, from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Which.
    pub part: usize,
    /// Of how many.
    pub of: usize,
}

/// What a batch is asked for.
#[derive(Debug, Clone)]
pub struct Options {
    /// Recordings and tables are below it.
    pub input: PathBuf,
    /// Results go below it.
    pub output: PathBuf,
    /// Only recordings whose path below the input folder matches.
    pub only: Option<globset::GlobMatcher>,
    /// Do failed ones again.
    pub retry_failed: bool,
    /// A part of all.
    pub shard: Option<Shard>,
    /// Cores.
    pub cores: usize,
    /// What every run is asked for besides, as words of its command.
    pub words: Vec<String>,
    /// Whether the runs go as far as a fit.
    pub fits: bool,
    /// The program that runs a recording.
    pub program: PathBuf,
}

/// A recording, and what is to be done with it.
#[derive(Debug)]
pub struct Planned {
    /// The recording.
    pub found: Found,
    /// What is to be done, and why.
    pub plan: Plan,
}

/// What is to be done with a recording.
#[derive(Debug)]
pub enum Plan {
    /// To be run.
    Run,
    /// Finished before, of the same contents.
    Finished(Finished),
    /// Not to be run, for a reason.
    Skip(String),
}

/// How many of all came to what.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// Done, now or before.
    pub done: usize,
    /// Failed, now or before.
    pub failed: usize,
    /// Left out.
    pub skipped: usize,
}

/// Every recording below the input folder, sorted by path, with what is to be done.
///
/// # Errors
/// [`Error::Unreadable`] for the input folder, [`Error::NothingToDo`] where it holds no recording, [`Error::Option`] where none matches.
pub fn plan(options: &Options) -> Result<Vec<Planned>> {
    let found = find::recordings(&options.input, &options.output)?;
    if found.is_empty() {
        return Err(Error::NothingToDo { path: options.input.clone() });
    }
    if let Some(only) = options.only.as_ref().filter(|only| !found.iter().any(|found| only.is_match(&found.name))) {
        let message = format!(
            "'{}' matches none of the {} recordings below {}; their paths begin there, such as {}",
            only.glob(),
            found.len(),
            options.input.display(),
            found[0].name
        );
        return Err(Error::Option { option: "--only".to_owned(), message });
    }
    let names: Vec<PathBuf> = found.iter().map(|found| found.path().to_owned()).collect();
    let planned = |(index, found): (usize, Found)| {
        let plan = options.plan_of(index, &found, &names);
        Planned { found, plan }
    };
    // what was finished is read whole, to see whether it is still the same
    Ok(found.into_par_iter().enumerate().map(planned).collect())
}

impl Options {
    fn plan_of(&self, index: usize, found: &Found, all: &[PathBuf]) -> Plan {
        let folder = self.folder_of(found);
        if self.shard.is_some_and(|shard| index % shard.of != shard.part - 1) {
            return Plan::Skip("it belongs to another part (--shard)".to_owned());
        }
        if self.only.as_ref().is_some_and(|only| !only.is_match(&found.name)) {
            // what was finished before stays what it was
            return state::read(&folder)
                .map_or_else(|| Plan::Skip("not asked for (--only)".to_owned()), Plan::Finished);
        }
        if let Some(recording) = found.made_from(all) {
            return Plan::Skip(format!("made from {}, which is in this folder", recording.display()));
        }
        match state::read(&folder) {
            Some(finished) if self.still_holds(&finished, found) => Plan::Finished(finished),
            _ => Plan::Run,
        }
    }

    /// Whether what was finished is what would be done now.
    fn still_holds(&self, finished: &Finished, found: &Found) -> bool {
        let wanted = finished.status == Status::Done || !self.retry_failed;
        wanted && Fingerprint::of(found, &self.words).is_ok_and(|now| now == finished.fingerprint)
    }

    /// The folder of a recording's results.
    pub fn folder_of(&self, found: &Found) -> PathBuf {
        self.output.join(&found.name)
    }
}

/// What would be done, for a program that shares the recordings out: part k of n (`--shard`) of so many recordings is the k-th of them.
#[derive(Debug, Serialize)]
pub struct Intentions {
    schema: &'static str,
    recordings: Vec<Intended>,
}

#[derive(Debug, Serialize)]
struct Intended {
    recording: String,
    /// `run`, or the status that it has or will have.
    plan: &'static str,
    reason: String,
    /// What it depends on: itself and the experiment files that hold for it.
    files: Vec<PathBuf>,
}

impl From<&[Planned]> for Intentions {
    fn from(planned: &[Planned]) -> Self {
        let intended = |planned: &Planned| {
            let (plan, reason) = match &planned.plan {
                Plan::Run => ("run", ""),
                Plan::Finished(finished) => (finished.status.id(), finished.reason.as_str()),
                Plan::Skip(reason) => (Status::Skipped.id(), reason.as_str()),
            };
            Intended {
                recording: planned.found.name.clone(),
                plan,
                reason: reason.to_owned(),
                files: planned.found.paths.iter().chain(&planned.found.configs).cloned().collect(),
            }
        };
        Self { schema: "freeswing.plan/1", recordings: planned.iter().map(intended).collect() }
    }
}

/// Runs what is to be run, and writes the summary of all: `summary.csv`, `summary.parquet`, `index.html`. A part of several writes none.
///
/// # Errors
/// [`Error::Busy`] where another batch works in the output folder, [`Error::Unwritable`] where it cannot be written, [`Error::Stopped`].
pub fn run(options: &Options, watch: &dyn Watch) -> Result<Tally> {
    output::make_folder(&options.output)?;
    let _lock = Lock::take(&options.output, options.shard)?;
    if options.shard.is_none() {
        // of a batch that was ended while it wrote its summary
        output::remove_left_temporaries(&options.output);
    }
    let planned = plan(options)?;
    let rows = options.carry_out("recordings", &planned, watch)?;
    if options.shard.is_none() {
        let specimens = options.together(planned, watch)?;
        summary::write(&options.output, &rows)?;
        index::write(&options.output, &rows, &specimens)?;
    }
    let count = |status: Status| rows.iter().filter(|row| row.status == status).count();
    Ok(Tally { done: count(Status::Done), failed: count(Status::Failed), skipped: count(Status::Skipped) })
}

impl Options {
    /// Runs what is to be run; a row each of all.
    fn carry_out(&self, what: &'static str, planned: &[Planned], watch: &dyn Watch) -> Result<Vec<Row>> {
        let to_run = planned.iter().filter(|planned| matches!(planned.plan, Plan::Run));
        let jobs: Vec<Job<'_>> = to_run.map(|planned| self.job(planned)).collect();
        watch.begin(what, planned.len(), jobs.len());
        Crew { options: self, watch }.run(jobs)?;
        Ok(planned.par_iter().map(|planned| self.row(planned)).collect())
    }

    fn job<'p>(&self, planned: &'p Planned) -> Job<'p> {
        Job { found: &planned.found, folder: self.folder_of(&planned.found), bytes: planned.found.bytes() }
    }

    /// Fits and diagnoses the recordings of each specimen together, where the runs go that far; a row each.
    fn together(&self, planned: Vec<Planned>, watch: &dyn Watch) -> Result<Vec<Row>> {
        if !self.fits {
            return Ok(Vec::new());
        }
        let found: Vec<Found> = planned.into_iter().map(|planned| planned.found).collect();
        let specimens = together::specimens(&found, |found| self.folder_of(found));
        let plan = |found: Found| {
            let finished = state::read(&self.folder_of(&found)).filter(|own| self.still_holds(own, &found));
            Planned { found, plan: finished.map_or(Plan::Run, Plan::Finished) }
        };
        let planned: Vec<Planned> = specimens.into_iter().map(plan).collect();
        self.carry_out("specimens", &planned, watch)
    }

    /// The row of a recording, from what stands in its folder.
    fn row(&self, planned: &Planned) -> Row {
        let folder = self.folder_of(&planned.found);
        match &planned.plan {
            Plan::Skip(reason) => Row::skipped(&planned.found.name, reason),
            Plan::Run | Plan::Finished(_) => state::read(&folder).map_or_else(
                || Row::skipped(&planned.found.name, "not finished; run the batch again"),
                |finished| Row::of(&planned.found.name, &folder, &finished),
            ),
        }
    }
}
