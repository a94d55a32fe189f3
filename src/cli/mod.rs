//! The command line: parse → options → stage → write → exit code. One file a command.

mod arguments;
mod bar;
mod batch;
mod console;
mod diagnose;
mod doctor;
mod export;
mod fit;
mod force;
mod identify;
mod init;
mod laser;
mod modes;
mod paper;
mod render;
mod report;
mod run;
mod shell;
mod simulate;
mod table;
mod track;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use arguments::Target;
pub use bar::Bar;
use console::Console;

use crate::experiment::Experiment;
use crate::fit::Record;
use crate::fit::predictability::foretold;
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
    Force(force::ForceArgs),
    Laser(laser::LaserArgs),
    Render(render::RenderArgs),
    Report(report::ReportArgs),
    Paper(paper::PaperArgs),
    Run(run::RunArgs),
    Batch(batch::BatchArgs),
    Export(export::ExportArgs),
    Doctor(doctor::DoctorArgs),
    Completions(shell::CompletionsArgs),
    Man(shell::ManArgs),
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
        bar::install_signal_handler();
        exit(arguments::read::<Self>(std::env::args_os()).and_then(|cli| cli.command.run(&Console::default())))
    }
}

impl Command {
    fn run(&self, console: &Console) -> crate::Result<ExitCode> {
        match self {
            // a batch of which some failed is neither a success nor a failure
            Self::Batch(args) => return args.run(console),
            Self::Init(args) => args.run(console),
            Self::Track(args) => args.run(console),
            Self::Fit(args) => args.run(console),
            Self::Diagnose(args) => args.run(console),
            Self::Simulate(args) => args.run(console),
            Self::Identify(args) => args.run(console),
            Self::Render(args) => args.run(console),
            Self::Modes(args) => args.run(console),
            Self::Force(args) => args.run(console),
            Self::Laser(args) => args.run(console),
            Self::Paper(args) => args.run(console),
            Self::Report(args) => args.run(console),
            Self::Run(args) => args.run(console),
            Self::Export(args) => args.run(console),
            Self::Doctor(args) => args.run(console),
            Self::Completions(args) => args.run(console),
            Self::Man(args) => args.run(console),
        }?;
        Ok(ExitCode::SUCCESS)
    }
}

impl TrackCli {
    /// Runs `track`.
    pub fn run() -> ExitCode {
        bar::install_signal_handler();
        let ran = arguments::read::<Self>(std::env::args_os()).and_then(|cli| cli.args.run(&Console::default()));
        exit(ran.map(|()| ExitCode::SUCCESS))
    }
}

/// 0 done, 2 bad input or a failed stage, with one line on standard error.
fn exit(outcome: crate::Result<ExitCode>) -> ExitCode {
    match outcome {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// A table of angles; what of it is passed over is said on standard error.
fn read_angles(path: &Path, console: &Console) -> crate::Result<AngleSeries> {
    let series = AngleSeries::read(path)?;
    console.warnings(&series.warnings);
    Ok(series)
}

/// An experiment file for a command that needs the specimen; what is odd in it is said on standard error.
fn read_experiment(path: &Path, console: &Console) -> crate::Result<Experiment> {
    heard(Experiment::read_with_specimen(path)?, console)
}

/// The same for a command that needs a strip, and no marks on it.
fn read_strip(path: &Path, console: &Console) -> crate::Result<Experiment> {
    heard(Experiment::read_with_strip(path)?, console)
}

fn heard(experiment: Experiment, console: &Console) -> crate::Result<Experiment> {
    console.warnings(&experiment.warnings);
    Ok(experiment)
}

/// The tables of some recordings, from one stamp until another.
fn recordings(
    paths: &[PathBuf],
    (marks, experiment): (usize, &Experiment),
    (from_s, until_s): (f64, f64),
    console: &Console,
) -> crate::Result<Vec<Record>> {
    check_span(from_s, until_s)?;
    let all = paths.iter().map(|path| read_angles(path, console)).collect::<crate::Result<Vec<_>>>()?;
    refuse_twice(&all)?;
    let record = |series: &AngleSeries| {
        let mut kept = series.slice(series.rows(from_s, until_s));
        if kept.len() < crate::series::FEWEST_ROWS {
            let message = format!("{} rows between --from and --until; widen them", kept.len());
            return Err(crate::Error::Table { path: series.path.clone(), line: None, message });
        }
        if let Some((released_s, rest)) = kept.let_go() {
            let held = format!(
                "{}: the specimen is held still until t = {released_s:.2} s, probably by a hand; that is no free motion",
                series.path.display()
            );
            // a beginning that was asked for stays
            if from_s.is_finite() {
                console.warning(format!("{held}; leave that out with --from {released_s:.2}"));
            } else {
                console.warning(format!("{held}: left out, as with --from {released_s:.2}"));
                kept = rest;
            }
        }
        // an end that was asked for stays
        if let Some((caught_s, swing)) = kept.caught().filter(|_| until_s.is_infinite()) {
            console.warning(format!(
                "{}: the specimen is caught after t = {caught_s:.2} s and held still to the end, probably by a hand; that is no free motion: left out, as with --until {caught_s:.2}",
                series.path.display()
            ));
            kept = swing;
        }
        if let Some((rest_s, swing)) = kept.before_standstill().filter(|_| until_s.is_infinite()) {
            console.warning(format!(
                "{}: no angle changes from t = {rest_s:.2} s on: constant readings at rest carry no information; left out, as with --until {:.2}",
                series.path.display(),
                swing.t_s[swing.len() - 1]
            ));
            kept = swing;
        }
        warn_of_changes(&kept, console);
        let record = Record::of(&kept, marks)?;
        let Some(rows) = foretold(&record, experiment) else { return Ok(record) };
        let [first_s, last_s] = [record.t_s[rows.start], record.t_s[rows.end - 1]];
        let (when, option) = match rows.start {
            0 => (format!("from t = {last_s:.2} s on"), format!("--until {last_s:.2}")),
            _ => (format!("before t = {first_s:.2} s"), format!("--from {first_s:.2}")),
        };
        let lost = format!(
            "{}: {when} no model can follow this motion: it is chaotic (tumbling), and the noise of a few values grows into another motion",
            series.path.display()
        );
        // what was asked for stays
        if from_s.is_finite() || until_s.is_finite() {
            console.warning(format!("{lost}; leave that out with {option}"));
            return Ok(record);
        }
        console.warning(format!("{lost}: left out, as with {option}"));
        Ok(record.rows(rows))
    };
    all.iter().map(record).collect()
}

/// A longer table is not searched for changes at once (cost: a second or two).
const MOST_ROWS_SEARCHED: usize = 20_000;

/// Says where a swing changes at once, which no free motion does.
fn warn_of_changes(series: &AngleSeries, console: &Console) {
    if series.len() > MOST_ROWS_SEARCHED {
        return;
    }
    let Ok(found) = crate::identify::identify(series, None) else { return };
    for change in &found.abrupt_changes {
        console.warning(format!(
            "{}: {}; no model of a free motion can follow that: use what lies before or after it, with --until or --from",
            series.path.display(),
            change.statement(found.record.measured)
        ));
    }
}

/// What is wrong with a key of the experiment file, told by the options that gave it: `(key, option)`.
fn by_option(message: &str, given: &[(&str, &str)]) -> crate::Error {
    let named = given.iter().fold(message.to_owned(), |text, (key, option)| text.replace(key, option));
    let (option, message) = named.split_once(": ").unwrap_or(("options", &named));
    crate::Error::Option { option: option.to_owned(), message: message.to_owned() }
}

/// `--from` comes before `--until`.
fn check_span(from_s: f64, until_s: f64) -> crate::Result<()> {
    if from_s < until_s {
        return Ok(());
    }
    let message = format!("{until_s} s does not lie after --from {from_s} s; give a later one");
    Err(crate::Error::Option { option: "--until".to_owned(), message })
}

/// The same angles twice would count as two measurements.
fn refuse_twice(all: &[AngleSeries]) -> crate::Result<()> {
    for (index, series) in all.iter().enumerate() {
        let is_same = |other: &&AngleSeries| other.t_s == series.t_s && other.theta_rad == series.theta_rad;
        if let Some(other) = all[..index].iter().find(is_same) {
            let message = format!("holds the same angles as {}; give each recording once", other.path.display());
            return Err(crate::Error::Table { path: series.path.clone(), line: None, message });
        }
    }
    Ok(())
}

/// Prints a report; with a file for JSON writes it there, and prints nothing where that file is standard output.
fn deliver(
    text: &str,
    report: &impl serde::Serialize,
    json: Option<OutputFile>,
    console: &Console,
) -> crate::Result<()> {
    if !json.as_ref().is_some_and(OutputFile::is_standard_output) {
        console.print(text)?;
    }
    let Some(json) = json else { return Ok(()) };
    // numbers, strings and lists of them cannot fail to serialise
    let contents = serde_json::to_string_pretty(report).unwrap_or_default() + "\n";
    json.commit(contents.as_bytes())
}
