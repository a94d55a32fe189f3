//! The runs of a batch: each a process of its own, as many at once as there are cores.
//!
//! The largest recordings come first, so that none is left over when the others are done. A run gets twice its share of the cores: of many small ones each has
//! one, for a second thread costs a second decoder and finds no idle core.

use std::collections::VecDeque;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{ChildStderr, Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::{Instant, SystemTime};

use super::Options;
use super::find::Found;
use super::layers::{self, Layered};
use super::state::{self, Fingerprint, Finished, Status};
use crate::error::{Error, Result};
use crate::output::{self, OutputFile};
use crate::progress::ProgressEvent;

/// A recording to be run.
#[derive(Debug)]
pub struct Job<'p> {
    /// The recording.
    pub found: &'p Found,
    /// Of its results.
    pub folder: PathBuf,
    /// Its size, which tells about how long it takes.
    pub bytes: u64,
    /// What is left out of it though it was asked for.
    pub note: &'static str,
}

/// Hears how a batch goes. A lane is one of the processes that run at a time.
pub trait Watch: Sync {
    /// Something that might have been meant as a recording, and why it is none.
    fn passed_over(&self, line: &str);
    /// So many recordings, or specimens, there are, so many are to be run, and so many are left out.
    fn begin(&self, what: &'static str, all: usize, to_run: usize, left_out: usize);
    /// A run begins.
    fn begun(&self, lane: usize, name: &str);
    /// How far it is.
    fn heard(&self, lane: usize, heard: &ProgressEvent);
    /// It has ended.
    fn ended(&self, lane: usize, name: &str, finished: &Finished, seconds: f64);
    /// Whether no further one is to be begun.
    fn is_cancelled(&self) -> bool;
}

/// What runs the jobs.
pub struct Crew<'o> {
    /// What is asked for.
    pub options: &'o Options,
    /// Who hears of it.
    pub watch: &'o dyn Watch,
}

impl Crew<'_> {
    /// Runs all jobs.
    ///
    /// # Errors
    /// [`Error::Stopped`]; what keeps any result from being written. A recording that fails is none.
    pub fn run(&self, mut jobs: Vec<Job<'_>>) -> Result<()> {
        let whole = jobs.iter().map(|job| job.bytes).sum::<u64>().max(1);
        jobs.sort_by(|a, b| b.bytes.cmp(&a.bytes).then_with(|| a.found.name.cmp(&b.found.name)));
        let queue = Mutex::new(VecDeque::from(jobs));
        let stopped = Mutex::new(None);
        let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).pop_front();
        let has_stopped =
            || stopped.lock().is_ok_and(|error: std::sync::MutexGuard<'_, Option<Error>>| error.is_some());
        let lane = |lane: usize| {
            while let Some(job) = next().filter(|_| !has_stopped()) {
                let share = job.bytes as f64 / whole as f64;
                let threads =
                    ((2.0 * share * self.options.cores as f64).ceil() as usize).clamp(1, self.options.cores.max(1));
                if let Err(error) = self.job(lane, &job, threads) {
                    // the first says what happened, the others follow from it
                    stopped.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                }
            }
        };
        std::thread::scope(|scope| {
            let lane = &lane;
            (0..self.options.cores).for_each(|own| _ = scope.spawn(move || lane(own)));
        });
        stopped.into_inner().unwrap_or_else(PoisonError::into_inner).map_or(Ok(()), Err)
    }

    /// One run, to its end and its `run.json`.
    fn job(&self, lane: usize, job: &Job<'_>, threads: usize) -> Result<()> {
        if self.watch.is_cancelled() {
            return Err(Error::Stopped);
        }
        self.watch.begun(lane, &job.found.name);
        let began = Instant::now();
        output::make_folder(&job.folder)?;
        state::forget(&job.folder)?;
        let before = seen(&job.found.paths);
        let fingerprint = Fingerprint::of(job.found, &self.options.words);
        let mut ended = self.process(lane, job, threads)?;
        let unchanged = seen(&job.found.paths) == before;
        if matches!(ended, Ended::Well) && !unchanged {
            let path = job.found.path().display();
            ended = Ended::Failed(format!("{path}: changed while it was processed; run the batch again"));
        }
        // what has no fingerprint is done again the next time
        let is_final = unchanged && !matches!(ended, Ended::Killed(_));
        let finished = Finished {
            schema: "freeswing.run/1".to_owned(),
            fingerprint: fingerprint.ok().filter(|_| is_final).unwrap_or_default(),
            status: if matches!(ended, Ended::Well) { Status::Done } else { Status::Failed },
            reason: ended.reason().unwrap_or_else(|| job.note.to_owned()),
        };
        state::write(&job.folder, &finished)?;
        self.watch.ended(lane, &job.found.name, &finished, began.elapsed().as_secs_f64());
        Ok(())
    }

    /// The process of a run.
    fn process(&self, lane: usize, job: &Job<'_>, threads: usize) -> Result<Ended> {
        let config = match layers::together(&job.found.configs) {
            Ok(Layered::None) => None,
            Ok(Layered::One(path)) => Some(path),
            Ok(Layered::Several(text)) => {
                let path = job.folder.join("experiment.toml");
                OutputFile::create(&path)?.commit(text.as_bytes())?;
                Some(path)
            }
            Err(error) => return Ok(Ended::Failed(error.to_string())),
        };
        let mut command = Command::new(&self.options.program);
        command.arg("run").args(job.found.paths.iter().map(|path| as_argument(path)));
        command.arg("--out").arg(as_argument(&job.folder));
        command.args(config.iter().flat_map(|config| ["--config".into(), as_argument(config)]));
        command.args(["--threads", &threads.to_string(), "--watched"]).args(&self.options.words);
        // a fit and a diagnosis take what is idle, but no more than the batch was given: the machine may be shared
        command.env("RAYON_NUM_THREADS", self.options.cores.to_string());
        // its standard input ends when this process does, however that comes about, and with it the run
        let child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        let mut child = child.map_err(|e| Error::unreadable(&self.options.program, e))?;
        let (told, errors) = (child.stdout.take(), child.stderr.take());
        let said = std::thread::scope(|scope| {
            let said = scope.spawn(|| errors.map(whole_text).unwrap_or_default());
            for line in told.into_iter().flat_map(|told| BufReader::new(told).lines()).map_while(std::io::Result::ok) {
                // what another version would say is passed over
                if let Ok(heard) = serde_json::from_str(&line) {
                    self.watch.heard(lane, &heard);
                }
            }
            said.join().unwrap_or_default()
        });
        let status = child.wait().map_err(|e| Error::unreadable(&self.options.program, e))?;
        if status.success() {
            return Ok(Ended::Well);
        }
        let Some(line) = said.lines().rev().find_map(|line| line.strip_prefix("error: ")) else {
            let line = ended_without_a_word(job.found.path(), &status);
            let is_killed = matches!(status.signal(), Some(libc::SIGKILL | libc::SIGTERM | libc::SIGHUP));
            return Ok(if is_killed { Ended::Killed(line) } else { Ended::Failed(line) });
        };
        self.unless_of_all(line, &job.folder)?;
        Ok(Ended::Failed(line.to_owned()))
    }

    /// What is no fault of the recording: the user has stopped it all, or nothing can be written any more.
    fn unless_of_all(&self, told: &str, folder: &Path) -> Result<()> {
        if self.watch.is_cancelled() || told == Error::Interrupted.to_string() {
            return Err(Error::Stopped);
        }
        let is_result = told.starts_with(&folder.display().to_string());
        if is_result && told.contains(": cannot be written: ") {
            return Err(Error::Results { line: told.to_owned() });
        }
        Ok(())
    }
}

/// How the process of a run ended.
enum Ended {
    /// Every stage.
    Well,
    /// With this line.
    Failed(String),
    /// By a signal that comes from others: of a machine that goes down, or that wants memory. Another time it may end well.
    Killed(String),
}

impl Ended {
    /// Why it failed.
    fn reason(self) -> Option<String> {
        match self {
            Self::Well => None,
            Self::Failed(line) | Self::Killed(line) => Some(line),
        }
    }
}

/// Size and time of the last change, by which a file that changes meanwhile is known.
fn seen(paths: &[PathBuf]) -> Vec<Option<(u64, SystemTime)>> {
    let of = |path: &PathBuf| {
        let own = fs::metadata(path).ok()?;
        Some((own.len(), own.modified().ok()?))
    };
    paths.iter().map(of).collect()
}

/// A path that cannot be taken for an option.
fn as_argument(path: &Path) -> PathBuf {
    if path.as_os_str().as_encoded_bytes().starts_with(b"-") { Path::new(".").join(path) } else { path.to_owned() }
}

fn whole_text(mut errors: ChildStderr) -> String {
    let mut bytes = Vec::new();
    // what was said before it broke off is what there is
    let _ = errors.read_to_end(&mut bytes);
    String::from_utf8_lossy(&bytes).into_owned()
}

fn ended_without_a_word(path: &Path, status: &std::process::ExitStatus) -> String {
    format!(
        "{}: the run was ended from outside ({status}), perhaps for want of memory; run it alone to see",
        path.display()
    )
}
