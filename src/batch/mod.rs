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
//! | [`summary`] | one row per recording, as CSV and Parquet |
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
use crate::experiment::Experiment;
use crate::output;
use crew::{Crew, Job, Watch};
use find::{Contents, Found};
use layers::Layered;
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
    /// To be run; what is to be known of it beforehand.
    Run(Vec<String>),
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

/// What is to be done with a folder.
#[derive(Debug)]
pub struct Plans {
    /// Every recording below it, sorted by path.
    pub recordings: Vec<Planned>,
    /// What might have been meant as one: the line that says why it is none.
    pub passed_over: Vec<String>,
}

/// What is to be done with every recording below the input folder.
///
/// # Errors
/// [`Error::Unreadable`] for the input folder, [`Error::NothingToDo`] where it holds no recording, [`Error::Option`] where none matches.
pub fn plan(options: &Options) -> Result<Plans> {
    Ok(options.planned(options.contents()?))
}

impl Options {
    /// What the input folder holds; something that is asked for is among it.
    fn contents(&self) -> Result<Contents> {
        let contents = find::recordings(&self.input, &self.output)?;
        let found = &contents.found;
        if found.is_empty() {
            return Err(Error::NothingToDo { path: self.input.clone() });
        }
        if let Some(only) = self.only.as_ref().filter(|only| !found.iter().any(|found| only.is_match(&found.name))) {
            let message = format!(
                "'{}' matches none of the {} recordings below {}; their paths begin there, such as {}",
                only.glob(),
                found.len(),
                self.input.display(),
                found[0].name
            );
            return Err(Error::Option { option: "--only".to_owned(), message });
        }
        Ok(contents)
    }

    fn planned(&self, contents: Contents) -> Plans {
        let Contents { found, passed_over } = contents;
        let names: Vec<PathBuf> = found.iter().map(|found| found.path().to_owned()).collect();
        let planned = |(index, found): (usize, Found)| {
            let plan = self.plan_of(index, &found, &names);
            Planned { found, plan }
        };
        // what was finished is read whole, to see whether it is still the same
        Plans { recordings: found.into_par_iter().enumerate().map(planned).collect(), passed_over }
    }

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
        self.anew_or_left(found)
    }

    /// A recording, or a specimen, that is asked for: left if what was finished is what would be done now.
    fn anew_or_left(&self, found: &Found) -> Plan {
        let changed = match state::read(&self.folder_of(found)) {
            None => None,
            Some(finished) if finished.status == Status::Failed && self.retry_failed => {
                Some("again: it failed (--retry-failed)".to_owned())
            }
            Some(finished) => match Fingerprint::of(found, &self.words) {
                Ok(now) if now == finished.fingerprint => return Plan::Finished(finished),
                Ok(now) => Some(format!("again: {}", finished.fingerprint.changed_to(&now))),
                Err(_) => None,
            },
        };
        let fails = self.fails(found).map(|error| format!("fails: {error}"));
        let left_out = self.left_out(found).map(str::to_owned);
        Plan::Run([changed, fails, left_out].into_iter().flatten().collect())
    }

    /// What its experiment files make it fail with, as far as they tell by themselves.
    fn fails(&self, found: &Found) -> Option<Error> {
        let layered = match layers::together(&found.configs) {
            Ok(Layered::None) => return None,
            Ok(layered) => layered,
            Err(error) => return Some(error),
        };
        // several are put together there
        let path = match &layered {
            Layered::One(path) => path.clone(),
            _ => self.folder_of(found).join("experiment.toml"),
        };
        let text = layered.contents().map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        let checked = text.and_then(|text| {
            Experiment::parse_rig(&text, &path)?;
            if self.fits { Experiment::parse_with_specimen(&text, &path).map(drop) } else { Ok(()) }
        });
        checked.err()
    }

    /// What is not done though it is asked for.
    fn left_out(&self, found: &Found) -> Option<&'static str> {
        (self.fits && found.configs.is_empty()).then_some("no experiment file: not fitted, not diagnosed")
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
    /// What might have been meant as a recording: the line that says why it is none.
    passed_over: Vec<String>,
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

impl From<&Plans> for Intentions {
    fn from(plans: &Plans) -> Self {
        let intended = |planned: &Planned| {
            let (plan, reason) = match &planned.plan {
                Plan::Run(notes) => ("run", notes.join("; ")),
                Plan::Finished(finished) => (finished.status.id(), finished.reason.clone()),
                Plan::Skip(reason) => (Status::Skipped.id(), reason.clone()),
            };
            Intended {
                recording: planned.found.name.clone(),
                plan,
                reason,
                files: planned.found.paths.iter().chain(&planned.found.configs).cloned().collect(),
            }
        };
        Self {
            schema: "freeswing.plan/1",
            recordings: plans.recordings.iter().map(intended).collect(),
            passed_over: plans.passed_over.clone(),
        }
    }
}

/// Runs what is to be run, and writes the summary of all: `summary.csv`, `summary.parquet`, `index.html`. A part of several writes none.
///
/// # Errors
/// [`Error::Busy`] where another batch works in the output folder, [`Error::Unwritable`] where it cannot be written, [`Error::Stopped`].
pub fn run(options: &Options, watch: &dyn Watch) -> Result<Tally> {
    let contents = options.contents()?;
    output::make_folder(&options.output)?;
    let _lock = Lock::take(&options.output, options.shard)?;
    if options.shard.is_none() {
        // of a batch that was ended while it wrote its summary
        output::remove_left_temporaries(&options.output);
    }
    let Plans { recordings, passed_over } = options.planned(contents);
    passed_over.iter().for_each(|line| watch.passed_over(line));
    let rows = options.carry_out("recordings", &recordings, watch)?;
    if options.shard.is_none() {
        let specimens = options.together(recordings, watch)?;
        summary::write(&options.output, &rows)?;
        index::write(&options.output, &rows, &specimens)?;
    }
    let count = |status: Status| rows.iter().filter(|row| row.status == status).count();
    Ok(Tally { done: count(Status::Done), failed: count(Status::Failed), skipped: count(Status::Skipped) })
}

impl Options {
    /// Runs what is to be run; a row each of all.
    fn carry_out(&self, what: &'static str, planned: &[Planned], watch: &dyn Watch) -> Result<Vec<Row>> {
        let to_run = planned.iter().filter(|planned| matches!(planned.plan, Plan::Run(_)));
        let jobs: Vec<Job<'_>> = to_run.map(|planned| self.job(planned)).collect();
        let left_out = planned.iter().filter(|planned| matches!(planned.plan, Plan::Skip(_))).count();
        watch.begin(what, planned.len(), jobs.len(), left_out);
        Crew { options: self, watch }.run(jobs)?;
        Ok(planned.par_iter().map(|planned| self.row(planned)).collect())
    }

    fn job<'p>(&self, planned: &'p Planned) -> Job<'p> {
        Job {
            found: &planned.found,
            folder: self.folder_of(&planned.found),
            bytes: planned.found.bytes(),
            note: self.left_out(&planned.found).unwrap_or_default(),
        }
    }

    /// Fits and diagnoses the recordings of each specimen together, where the runs go that far; a row each.
    fn together(&self, planned: Vec<Planned>, watch: &dyn Watch) -> Result<Vec<Row>> {
        if !self.fits {
            return Ok(Vec::new());
        }
        let found: Vec<Found> = planned.into_iter().map(|planned| planned.found).collect();
        let specimens = together::specimens(&found, |found| self.folder_of(found));
        let plan = |found: Found| Planned { plan: self.anew_or_left(&found), found };
        let planned: Vec<Planned> = specimens.into_iter().map(plan).collect();
        self.carry_out("specimens", &planned, watch)
    }

    /// The row of a recording, from what stands in its folder.
    fn row(&self, planned: &Planned) -> Row {
        let folder = self.folder_of(&planned.found);
        match &planned.plan {
            Plan::Skip(reason) => Row::skipped(&planned.found.name, reason),
            Plan::Run(_) | Plan::Finished(_) => state::read(&folder).map_or_else(
                || Row::skipped(&planned.found.name, "not finished; run the batch again"),
                |finished| Row::of(&planned.found.name, &folder, &finished),
            ),
        }
    }
}
