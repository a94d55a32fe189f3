//! `freeswing run`: every stage for one recording, each as its own command would do it.

use std::fs::{self, File, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::bar::Shown;
use super::{Cli, Console, arguments};
use crate::batch::state;
use crate::error::{Error, Result};
use crate::experiment::Experiment;
use crate::output;
use crate::report;
use crate::series::AngleSeries;
use crate::video::{Recording, StillTimes};

/// Track, identify, fit, diagnose and report one recording into a folder.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  freeswing run videos/kapton.mp4 --config videos/kapton.base.toml --out kapton
  freeswing run swing.mp4 --config experiment.toml --out swing --until identify
  freeswing run angles.csv --config experiment.toml --out swing
  freeswing run small/angles.csv large/angles.csv --config experiment.toml --out both

Leaves in the folder: angles.csv, angles.json, overlay.mp4, identify.json, fit.json, diagnosis.json, figures/, report.html, and
log.txt with every command, as it could be typed alone, and what it printed. Where a stage fails, what was done before it is kept,
the page shows it, and the exit code is 2. Without --config it ends with identify. What an earlier run left there is removed, and nothing
else: a folder that holds files of these names and no log of a run is refused.")]
pub struct RunArgs {
    /// The recording, or a table of angles; several tables of one specimen are fitted and diagnosed together.
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// The experiment: marks, specimen, rig and base model.
    #[arg(long, value_name = "TOML")]
    config: Option<PathBuf>,
    /// The folder for all of it.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    extent: Extent,
    /// Cores to use; all by default.
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// No progress, nothing on standard output.
    #[arg(long)]
    quiet: bool,
    /// Progress as lines of JSON on standard output, for a program that watches.
    #[arg(long, hide = true)]
    watched: bool,
}

/// How far a run goes, and with what.
#[derive(Debug, clap::Args)]
pub struct Extent {
    /// The last stage of a run.
    #[arg(long, value_name = "STAGE", default_value = "report")]
    pub until: Stage,
    /// No overlay.mp4, which takes up to four times as long as the tracking.
    #[arg(long)]
    pub no_overlay: bool,
}

impl Extent {
    /// The same as words of a command.
    pub fn words(&self) -> Vec<String> {
        let until = self.until.to_possible_value().map_or(String::new(), |own| own.get_name().to_owned());
        let no_overlay = self.no_overlay.then(|| "--no-overlay".to_owned());
        ["--until".to_owned(), until].into_iter().chain(no_overlay).collect()
    }
}

/// A stage of a run, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub enum Stage {
    /// Recording → angles.
    Track,
    /// Frequencies and damping.
    Identify,
    /// The forward model's parameters.
    Fit,
    /// What the model lacks.
    Diagnose,
    /// The page.
    Report,
}

impl Stage {
    const ALL: [Self; 5] = [Self::Track, Self::Identify, Self::Fit, Self::Diagnose, Self::Report];
}

/// What a run leaves in its folder.
const OUTPUTS: [&str; 10] = [
    "angles.csv",
    "angles.json",
    "overlay.mp4",
    "identify.json",
    "fit.json",
    "diagnosis.json",
    "experiment.toml",
    FIGURES,
    "report.html",
    LOG,
];
/// Every command, and what it printed.
const LOG: &str = "log.txt";
/// Its first line, before the version.
const LOG_BEGINS: &str = "freeswing ";
/// The folder of pictures and their curves.
const FIGURES: &str = "figures";
/// What a run leaves there besides the figures of the page.
const DRAWN: [&str; 4] = ["fit.csv", "diagnosis.svg", "diagnosis.csv", "where.csv"];

impl RunArgs {
    /// Runs the stages.
    ///
    /// # Errors
    /// That of the stage that failed; what was done before is kept.
    pub fn run(&self, _console: &Console) -> Result<()> {
        if self.watched {
            end_with_standard_input();
        }
        self.check()?;
        let log = self.begin()?;
        let console = Console::of_run(log, self.shown());
        let outcome = self.stages(&console);
        if let Err(error) = &outcome {
            console.log(&format!("error: {error}"));
        }
        // the page shows how far it came, and why not further
        let page = if self.extent.until == Stage::Report { self.stage(Stage::Report, &console) } else { Ok(()) };
        outcome.and(page)?;
        if self.shown() == Shown::OnTerminal {
            Console::default().print(&self.done()?)?;
        }
        Ok(())
    }

    /// Every stage before the page.
    fn stages(&self, console: &Console) -> Result<()> {
        let wanted = Stage::ALL.into_iter().filter(|stage| *stage <= self.extent.until && *stage != Stage::Report);
        for stage in wanted {
            if self.config.is_none() && stage > Stage::Identify {
                console.warning("fit and diagnose need the specimen: give --config");
                break;
            }
            self.stage(stage, console)?;
        }
        Ok(())
    }

    /// One stage, by its own command.
    fn stage(&self, stage: Stage, console: &Console) -> Result<()> {
        let Some(words) = self.words(stage)? else { return Ok(()) };
        console.log(&format!("\n$ {}", as_typed(&words)));
        arguments::read::<Cli>(&words)?.command.run(console).map(drop)
    }

    /// The command of a stage; nothing where a table of angles needs no tracking.
    fn words(&self, stage: Stage) -> Result<Option<Vec<String>>> {
        let own = |name: &str| path_text(&self.out.join(name));
        let config = self.config.as_deref().map(path_text).transpose()?;
        let config = || config.iter().flat_map(|config| ["--config".to_owned(), config.clone()]);
        // of a table that was given messages speak by its own name
        let angles = match self.recordings.as_slice() {
            [one] if !is_table(one) => vec![own("angles.csv")?],
            tables => tables.iter().map(|table| path_text(table)).collect::<Result<Vec<_>>>()?,
        };
        let analysed = |command: &str, json: &str| -> Result<Vec<String>> {
            let of = std::iter::once(command.to_owned()).chain(angles.clone());
            Ok(of.chain(["--json".to_owned(), own(json)?]).chain(config()).collect())
        };
        let words = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect::<Vec<String>>();
        let mut all = words(&["freeswing"]);
        match stage {
            Stage::Track => {
                match self.recordings.as_slice() {
                    [one] if !is_table(one) => {}
                    // the page shows the one recording
                    [one] => return output::copy(one, &self.out.join("angles.csv")).map(|()| None),
                    _ => return Ok(None),
                }
                all.extend(words(&["track", &path_text(&self.recordings[0])?, "--out", &own("angles.csv")?]));
                all.extend(config());
                if !self.extent.no_overlay {
                    // so much fits into a page
                    all.extend(words(&["--overlay", &own("overlay.mp4")?, "--overlay-mb", "5"]));
                }
                if let Some(threads) = self.threads {
                    all.extend(words(&["--threads", &threads.to_string()]));
                }
            }
            Stage::Identify => {
                if angles.len() > 1 {
                    return Ok(None);
                }
                all.extend(analysed("identify", "identify.json")?);
            }
            Stage::Fit => {
                all.extend(analysed("fit", "fit.json")?);
                all.extend(words(&["--curves", &own("figures/fit.csv")?]));
            }
            Stage::Diagnose => {
                all.extend(analysed("diagnose", "diagnosis.json")?);
                all.extend(words(&["--figure", &own("figures/diagnosis.svg")?]));
                all.extend(words(&["--curves", &own("figures/diagnosis.csv")?, "--map", &own("figures/where.csv")?]));
            }
            Stage::Report => all.extend(words(&["report", &own("")?])),
        }
        Ok(Some(all))
    }

    /// What can be refused before anything is touched.
    fn check(&self) -> Result<()> {
        for recording in &self.recordings {
            File::open(recording).map_err(|e| Error::unreadable(recording, e))?;
            if self.recordings.len() > 1 && !is_table(recording) {
                let message = "several recordings can be run together only as tables of angles; run each alone first";
                return Err(Error::Option { option: recording.display().to_string(), message: message.to_owned() });
            }
        }
        self.config.as_deref().map(Experiment::read_rig).transpose()?;
        let inputs: Vec<&Path> = self.recordings.iter().chain(&self.config).map(PathBuf::as_path).collect();
        let kept = self.own_config();
        let outputs = OUTPUTS.map(|name| self.out.join(name));
        let outputs = outputs.iter().filter(|output| kept.as_ref() != Some(*output));
        let outputs: Vec<(String, &Path)> = outputs.map(|output| ("--out".to_owned(), output.as_path())).collect();
        arguments::refuse_overwriting(&inputs, &outputs, "give another folder")?;
        self.leave_others_alone(&outputs)?;
        // a batch's folder is its own: there what an earlier run left goes first, for it belongs to a recording that has changed
        if self.watched {
            return Ok(());
        }
        match self.recordings.as_slice() {
            [one] if !is_table(one) => Recording::open(one, &StillTimes::Beside).map(drop),
            tables => {
                // a displacement is identified, and no more
                let is_identified = self.extent.until == Stage::Identify;
                let read = |table: &PathBuf| match is_identified {
                    true => AngleSeries::read_motion(table).map(|(series, _)| series),
                    false => AngleSeries::read(table),
                };
                super::refuse_twice(&tables.iter().map(read).collect::<Result<Vec<_>>>()?)
            }
        }
    }

    /// Files that no run has left are not removed.
    fn leave_others_alone(&self, outputs: &[(String, &Path)]) -> Result<()> {
        if self.is_of_a_run() {
            return Ok(());
        }
        let there = outputs.iter().map(|(_, output)| *output).filter(|output| fs::symlink_metadata(output).is_ok());
        let names: Vec<String> = there.filter_map(Path::file_name).map(|n| n.to_string_lossy().into_owned()).collect();
        if names.is_empty() {
            return Ok(());
        }
        let message = format!(
            "{} holds {}, and no log of a run that made it; give another folder",
            self.out.display(),
            names.join(", ")
        );
        Err(Error::Option { option: "--out".to_owned(), message })
    }

    /// Whether the folder holds a run's log, however far the run came.
    fn is_of_a_run(&self) -> bool {
        let Ok(log) = File::open(self.out.join(LOG)) else { return false };
        let mut first = String::new();
        let is_text = log.take(LOG_BEGINS.len() as u64).read_to_string(&mut first).is_ok();
        is_text && (first.is_empty() || first == LOG_BEGINS)
    }

    /// The log of a folder without what an earlier run left, and with the configuration, which may stand there already.
    fn begin(&self) -> Result<File> {
        let figures = self.out.join(FIGURES);
        output::make_folder(&self.out)?;
        let log = self.log()?;
        state::forget(&self.out)?;
        let kept = self.own_config();
        let drawn = DRAWN.map(|name| figures.join(name)).into_iter().chain(report::figures_on_page(&self.out));
        let files = OUTPUTS.into_iter().filter(|name| ![LOG, FIGURES].contains(name)).map(|name| self.out.join(name));
        for path in drawn.chain(files).filter(|path| kept.as_ref() != Some(path)) {
            match fs::remove_file(&path) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(Error::unwritable(&path, error));
                }
                _ => {}
            }
        }
        output::make_folder(&figures)?;
        match &self.config {
            Some(config) if kept.is_none() => output::copy(config, &self.out.join("experiment.toml"))?,
            _ => {}
        }
        Ok(log)
    }

    /// The log, with its first line alone. Its lock keeps a second run out of the folder; the system frees it when this one ends, however that comes about.
    fn log(&self) -> Result<File> {
        let path = self.out.join(LOG);
        let unwritable = |e| Error::unwritable(&path, e);
        let mut log = File::options().write(true).create(true).truncate(false).open(&path).map_err(unwritable)?;
        // one that another program has begun waits for one that is just being ended
        let locked = if self.watched { log.lock().map_err(TryLockError::Error) } else { log.try_lock() };
        match locked {
            Err(TryLockError::WouldBlock) => {
                return Err(Error::Busy { path: self.out.clone(), holder: "a run of another recording".to_owned() });
            }
            Err(TryLockError::Error(error)) => return Err(unwritable(error)),
            Ok(()) => {}
        }
        // its beginning says that the folder is a run's: at no instant it is without
        let first = format!("{LOG_BEGINS}{}\n", env!("CARGO_PKG_VERSION"));
        log.write_all(first.as_bytes()).and_then(|()| log.set_len(first.len() as u64)).map_err(unwritable)?;
        output::remove_left_temporaries(&self.out);
        Ok(log)
    }

    /// The configuration in the folder itself, if it is that.
    fn own_config(&self) -> Option<PathBuf> {
        let own = self.out.join("experiment.toml");
        let is_own = output::is_same_file(self.config.as_ref()?, &own);
        is_own.then_some(own)
    }

    fn shown(&self) -> Shown {
        match (self.watched, self.quiet) {
            (true, _) => Shown::AsLines,
            (false, true) => Shown::Nowhere,
            (false, false) => Shown::OnTerminal,
        }
    }

    /// What was found, and where more of it stands.
    fn done(&self) -> Result<String> {
        let results = report::results(&self.out).ok().flatten().map_or(String::new(), |results| results + "\n");
        let last = match self.extent.until {
            Stage::Report => "report.html",
            _ => LOG,
        };
        Ok(format!("{results}{}: done; see {}\n", self.recordings[0].display(), self.out.join(last).display()))
    }
}

/// Ends the run when standard input does: the program that watches it holds the other end.
fn end_with_standard_input() {
    std::thread::spawn(|| {
        let _ = std::io::copy(&mut std::io::stdin(), &mut std::io::sink());
        let _no_more = output::remove_temporaries();
        std::process::exit(2);
    });
}

/// Whether it is a table by its name.
fn is_table(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"))
}

/// A path as a word of a command.
fn path_text(path: &Path) -> Result<String> {
    let text = path.to_str().ok_or_else(|| Error::Option {
        option: path.display().to_string(),
        message: "its name is not UTF-8; rename it".to_owned(),
    })?;
    // a name that begins with a dash would be taken for an option
    Ok(if text.starts_with('-') && text != "-" { format!("./{text}") } else { text.to_owned() })
}

/// Words as a shell takes them.
fn as_typed(words: &[String]) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=:,+@%".contains(c);
    let quoted = |word: &String| {
        if !word.is_empty() && word.chars().all(plain) {
            word.clone()
        } else {
            format!("'{}'", word.replace('\'', r"'\''"))
        }
    };
    words.iter().map(quoted).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_as_a_shell_wants_them() {
        let words = ["track", "my swing.mp4", "it's", "#ff0000"].map(str::to_owned);
        assert_eq!(as_typed(&words), r"track 'my swing.mp4' 'it'\''s' '#ff0000'");
    }
}
