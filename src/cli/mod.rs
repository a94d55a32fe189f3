//! The command line: parse → options → stage → write → exit code. One file a command.

mod bar;
mod diagnose;
mod fit;
mod identify;
mod init;
mod modes;
mod paper;
mod render;
mod report;
mod simulate;
mod table;
mod track;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};

pub use bar::Bar;

use crate::experiment::Experiment;
use crate::fit::Record;
use crate::output::OutputFile;
use crate::series::AngleSeries;

/// Measures vibration from video.
#[derive(Debug, Parser)]
#[command(name = "freeswing", version, about, arg_required_else_help = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Init(init::InitArgs),
    Track(Box<track::TrackArgs>),
    Identify(identify::IdentifyArgs),
    Fit(fit::FitArgs),
    Diagnose(diagnose::DiagnoseArgs),
    Simulate(simulate::SimulateArgs),
    Modes(modes::ModesArgs),
    Render(render::RenderArgs),
    Report(report::ReportArgs),
    Paper(paper::PaperArgs),
}

/// `track` alone, so that `track VIDEO --out angles.csv` works as typed.
#[derive(Debug, Parser)]
#[command(name = "track", version, about = "Follow the marks of a recording and write their angles", long_about = None)]
pub struct TrackCli {
    #[command(flatten)]
    args: track::TrackArgs,
}

impl Cli {
    /// Runs the command.
    pub fn run() -> ExitCode {
        bar::hear_interrupts();
        exit(match Self::parse().command {
            Command::Init(args) => args.run(),
            Command::Track(args) => args.run(),
            Command::Fit(args) => args.run(),
            Command::Diagnose(args) => args.run(),
            Command::Simulate(args) => args.run(),
            Command::Identify(args) => args.run(),
            Command::Render(args) => args.run(),
            Command::Modes(args) => args.run(),
            Command::Report(args) => args.run(),
            Command::Paper(args) => args.run(),
        })
    }
}

impl TrackCli {
    /// Runs `track`.
    pub fn run() -> ExitCode {
        bar::hear_interrupts();
        exit(Self::parse().args.run())
    }
}

/// 0 done, 2 bad input or a failed stage, with one line on standard error.
fn exit(outcome: crate::Result<()>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// A table of angles; what of it is passed over is said on standard error.
fn read_angles(path: &Path) -> crate::Result<AngleSeries> {
    let series = AngleSeries::read(path)?;
    for warning in &series.warnings {
        eprintln!("warning: {warning}");
    }
    Ok(series)
}

/// An experiment file for a command that needs the specimen; what is odd in it is said on standard error.
fn read_experiment(path: &Path) -> crate::Result<Experiment> {
    let experiment = Experiment::read_with_specimen(path)?;
    for warning in &experiment.warnings {
        eprintln!("warning: {warning}");
    }
    Ok(experiment)
}

/// The tables of some recordings, from one stamp until another.
fn recordings(paths: &[PathBuf], marks: usize, (from_s, until_s): (f64, f64)) -> crate::Result<Vec<Record>> {
    let read = |path: &PathBuf| {
        let series = read_angles(path)?;
        let kept = series.slice(series.rows(from_s, until_s));
        if kept.len() < crate::series::FEWEST_ROWS {
            let message = format!("{} rows between --from and --until; widen them", kept.len());
            return Err(crate::Error::Table { path: path.clone(), line: None, message });
        }
        Record::of(&kept, marks)
    };
    paths.iter().map(read).collect()
}

/// Prints a report; with a file for JSON writes it there, and prints nothing where that file is standard output.
fn deliver(text: &str, report: &impl serde::Serialize, json: Option<OutputFile>) -> crate::Result<()> {
    if !json.as_ref().is_some_and(OutputFile::is_standard_output) {
        print(text)?;
    }
    let Some(json) = json else { return Ok(()) };
    // numbers, strings and lists of them cannot fail to serialise
    let contents = serde_json::to_string_pretty(report).unwrap_or_default() + "\n";
    json.commit(contents.as_bytes())
}

/// Standard output.
fn print(text: &str) -> crate::Result<()> {
    crate::output::to_standard_output(text.as_bytes())
        .map_err(|e| crate::Error::unwritable("standard output".as_ref(), e))
}
