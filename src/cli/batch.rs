//! `freeswing batch`: a folder of experiments.

use std::collections::HashMap;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use globset::GlobBuilder;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

use super::bar::{self, Bar};
use super::run::{Extent, Stage};
use super::table::Table;
use super::{Console, Target, arguments};
use crate::batch::crew::Watch;
use crate::batch::state::{Finished, Status};
use crate::batch::{self, Intentions, Options, Plan, Plans, Shard, Tally};
use crate::error::{Error, Result};
use crate::output::{OutputFile, is_same_file};
use crate::progress::{Progress, ProgressEvent};

/// Run every recording and every table of angles below a folder, and write a summary.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  freeswing batch experiments --out results
  freeswing batch experiments --out results --dry-run --json plan.json
  freeswing batch experiments --out results --until identify --no-overlay --only 'monday/**'
  freeswing batch experiments --out results --shard 3/8

Each recording leaves in results/ what `freeswing run` leaves, in a folder with its path below the input folder. summary.csv and
summary.parquet have one row per recording, index.html shows them. An experiment.toml holds for its folder and all below it; one that is
nearer, or NAME.toml beside NAME.mp4, overrides it key by key. Stopped at any instant and started again it goes on: a recording is done
again only if it, its experiment file, the options or the version have changed. A part of several (--shard) writes no summary: when
all are done, the same command without --shard does, and runs what is left.
Exit code 0: all done; 1: some failed, with their reasons in the summary; 2: nothing could be started, or the results cannot be written.")]
pub struct BatchArgs {
    /// The folder.
    folder: PathBuf,
    /// The folder for the results.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    extent: Extent,
    /// Only recordings whose path below the folder matches, such as '2024-*/**' or '*.mp4' ('*' does not match '/').
    #[arg(long, value_name = "GLOB")]
    only: Option<String>,
    /// Do those again that failed.
    #[arg(long)]
    retry_failed: bool,
    /// Say what would be done, and do nothing.
    #[arg(long)]
    dry_run: bool,
    /// With --dry-run: the same as JSON, for a program that shares the recordings out; `-` for standard output, instead of the table.
    #[arg(long, value_name = "FILE", requires = "dry_run")]
    json: Option<Target>,
    /// Part K of N, for several machines that share the folders.
    #[arg(long, value_name = "K/N", value_parser = shard)]
    shard: Option<Shard>,
    /// Cores to use, and recordings at a time; all cores by default.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Nothing on standard error but what went wrong.
    #[arg(long)]
    quiet: bool,
}

fn shard(text: &str) -> std::result::Result<Shard, String> {
    let numbers: Option<Vec<usize>> = text.split('/').map(|number| number.parse().ok()).collect();
    match numbers.as_deref() {
        Some([part, of]) if (1..=*of).contains(part) => Ok(Shard { part: *part, of: *of }),
        _ => Err("give K/N with K from 1 to N, such as 3/8".to_owned()),
    }
}

impl BatchArgs {
    /// Runs the batch.
    ///
    /// # Errors
    /// One line: what, where, what to do.
    pub fn run(&self, console: &Console) -> Result<ExitCode> {
        let options = self.options()?;
        if let Some(jobs) = self.jobs {
            // refused where there are threads already; there are none yet
            let _ = rayon::ThreadPoolBuilder::new().num_threads(jobs.into()).build_global();
        }
        if self.dry_run {
            let plans = batch::plan(&options)?;
            self.keep_files_of(&plans)?;
            let json = self.json.as_deref().map(OutputFile::create).transpose()?;
            let text = if self.quiet { String::new() } else { intentions(&plans, &options) };
            super::deliver(&text, &Intentions::from(&plans), json, console)?;
            return Ok(ExitCode::SUCCESS);
        }
        let display = Display::new(self.quiet);
        let tally = batch::run(&options, &display)?;
        drop(display);
        if !self.quiet {
            console.remark(self.result(tally));
        }
        Ok(if tally.failed > 0 { ExitCode::FAILURE } else { ExitCode::SUCCESS })
    }

    /// Nor may the plan take the place of a file below the folder.
    fn keep_files_of(&self, plans: &Plans) -> Result<()> {
        let Some(json) = &self.json else { return Ok(()) };
        let files = plans.recordings.iter().flat_map(|own| own.found.paths.iter().chain(&own.found.configs));
        let files: Vec<&Path> = files.map(PathBuf::as_path).collect();
        arguments::refuse_overwriting(&files, &[("--json".to_owned(), json)], "use another name")
    }

    fn options(&self) -> Result<Options> {
        let refused = |option: &str, message: String| Error::Option { option: option.to_owned(), message };
        if is_same_file(&self.folder, &self.out) {
            return Err(refused("--out", "must be another folder than the recordings'".to_owned()));
        }
        let glob = |text: &String| GlobBuilder::new(text).literal_separator(true).build();
        let only = self.only.as_ref().map(glob).transpose().map_err(|e| refused("--only", e.to_string()))?;
        let all = std::thread::available_parallelism().map_or(1, usize::from);
        Ok(Options {
            input: self.folder.clone(),
            output: self.out.clone(),
            only: only.map(|glob| glob.compile_matcher()),
            retry_failed: self.retry_failed,
            shard: self.shard,
            cores: self.jobs.map_or(all, usize::from),
            words: self.extent.words(),
            fits: self.extent.until >= Stage::Fit,
            program: std::env::current_exe().map_err(|e| Error::unreadable("freeswing".as_ref(), e))?,
        })
    }

    fn result(&self, tally: Tally) -> String {
        let Tally { done, failed, skipped } = tally;
        let again = if failed > 0 && !self.retry_failed { " (--retry-failed does them again)" } else { "" };
        let left_out = if skipped > 0 { format!(", {skipped} left out") } else { String::new() };
        let at = match self.shard {
            Some(shard) => {
                format!("part {} of {}; when all are done, the same without --shard sums up", shard.part, shard.of)
            }
            None => format!("see {}", self.out.join("index.html").display()),
        };
        format!("{done} done, {failed} failed{again}{left_out}; {at}")
    }
}

/// What would be done.
fn intentions(plans: &Plans, options: &Options) -> String {
    let mut table = Table::new(["recording", "would be", "experiment files"]);
    for planned in &plans.recordings {
        let what = match &planned.plan {
            Plan::Run(notes) if notes.is_empty() => "run".to_owned(),
            Plan::Run(notes) => format!("run; {}", notes.join("; ")),
            Plan::Finished(finished) if finished.status == Status::Failed => {
                "left, it failed (--retry-failed)".to_owned()
            }
            Plan::Finished(_) => "left, it is done".to_owned(),
            Plan::Skip(reason) => format!("left out: {reason}"),
        };
        let shown = |path: &PathBuf| path.strip_prefix(&options.input).unwrap_or(path).display().to_string();
        let configs: Vec<String> = planned.found.configs.iter().map(shown).collect();
        table.row([
            planned.found.name.clone(),
            what,
            if configs.is_empty() { "none".to_owned() } else { configs.join(", ") },
        ]);
    }
    let passed_over = plans.passed_over.iter().map(|line| format!("passed over: {line}\n"));
    table.text() + &passed_over.collect::<String>()
}

/// Bars on a terminal, one a run and one of all; elsewhere a line a recording.
struct Display {
    quiet: bool,
    bars: Option<MultiProgress>,
    lanes: Mutex<HashMap<usize, ProgressBar>>,
    all: Mutex<Option<ProgressBar>>,
    ended: AtomicUsize,
    to_run: AtomicUsize,
    /// While it lives Ctrl-C asks the work to stop instead of ending it.
    interrupts: Bar,
}

impl Display {
    fn new(quiet: bool) -> Self {
        Self {
            quiet,
            bars: (!quiet && std::io::stderr().is_terminal()).then(MultiProgress::new),
            lanes: Mutex::new(HashMap::new()),
            all: Mutex::new(None),
            ended: AtomicUsize::new(0),
            to_run: AtomicUsize::new(0),
            interrupts: Bar::of_frames(bar::Shown::Nowhere),
        }
    }

    fn with_lane(&self, lane: usize, f: impl FnOnce(&ProgressBar)) {
        if let Ok(lanes) = self.lanes.lock()
            && let Some(bar) = lanes.get(&lane)
        {
            f(bar);
        }
    }
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

impl Watch for Display {
    fn passed_over(&self, line: &str) {
        if !self.quiet {
            eprintln!("passed over: {line}");
        }
    }

    fn begin(&self, what: &'static str, all: usize, to_run: usize, left_out: usize) {
        self.to_run.store(to_run, Ordering::SeqCst);
        self.ended.store(0, Ordering::SeqCst);
        let finished = all - to_run - left_out;
        if let (Some(bars), Ok(mut own)) = (&self.bars, self.all.lock()) {
            let bar = bars.add(ProgressBar::new(to_run as u64));
            bar.set_style(style("{prefix:>11} {wide_bar} {pos}/{len}, {elapsed}"));
            bar.set_prefix(what);
            bar.enable_steady_tick(std::time::Duration::from_millis(200));
            if let Some(before) = own.replace(bar) {
                before.finish_and_clear();
            }
        } else if !self.quiet && all > 0 {
            let what = if all == 1 { what.trim_end_matches('s') } else { what };
            eprintln!("{all} {what}: {to_run} to run, {finished} finished before, {left_out} left out");
        }
    }

    fn begun(&self, lane: usize, name: &str) {
        if let (Some(bars), Ok(mut lanes)) = (&self.bars, self.lanes.lock()) {
            let bar = lanes.entry(lane).or_insert_with(|| bars.insert_from_back(1, ProgressBar::new(0)));
            bar.reset();
            bar.set_style(style("{prefix:>11} {bar:30} {pos}/{len} {wide_msg}"));
            bar.set_message(name.to_owned());
            bar.set_prefix("");
        }
    }

    fn heard(&self, lane: usize, heard: &ProgressEvent) {
        self.with_lane(lane, |bar| match heard {
            ProgressEvent::Began { stage, total } => {
                bar.set_prefix(stage.clone());
                bar.set_length(total.unwrap_or(0));
                bar.set_position(0);
            }
            ProgressEvent::Stands { at } => bar.set_position(*at),
        });
    }

    fn ended(&self, lane: usize, name: &str, finished: &Finished, seconds: f64) {
        let number = self.ended.fetch_add(1, Ordering::SeqCst) + 1;
        if let Ok(all) = self.all.lock()
            && let Some(bar) = all.as_ref()
        {
            bar.inc(1);
        }
        self.with_lane(lane, |bar| bar.set_message(""));
        if self.quiet {
            return;
        }
        let how = match finished.status {
            Status::Done if !finished.reason.is_empty() => format!("done in {seconds:.1} s; {}", finished.reason),
            Status::Done => format!("done in {seconds:.1} s"),
            _ => format!("failed: {}", finished.reason),
        };
        match &self.bars {
            // what went well is seen in the bar of all
            Some(bars) if finished.status != Status::Done => _ = bars.println(format!("{name}: {how}")),
            Some(_) => {}
            None => eprintln!("[{number}/{}] {name}: {how}", self.to_run.load(Ordering::SeqCst)),
        }
    }

    fn is_cancelled(&self) -> bool {
        self.interrupts.is_cancelled()
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        if let Some(bars) = &self.bars {
            // the bars have no more to say; a terminal that is gone need not be cleared
            let _ = bars.clear();
        }
    }
}
