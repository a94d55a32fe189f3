//! The command line: parse → options → stage → write → exit code. One file a command.

mod bar;
mod identify;
mod render;
mod track;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

pub use bar::Bar;

/// Measures vibration from video.
#[derive(Debug, Parser)]
#[command(name = "freeswing", version, about, arg_required_else_help = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Track(track::TrackArgs),
    Identify(identify::IdentifyArgs),
    Render(render::RenderArgs),
}

/// `track` alone, so that `track VIDEO --out angles.csv` works as typed.
#[derive(Debug, Parser)]
#[command(name = "track", version)]
pub struct TrackCli {
    #[command(flatten)]
    args: track::TrackArgs,
}

impl Cli {
    /// Runs the command.
    pub fn run() -> ExitCode {
        exit(match Self::parse().command {
            Command::Track(args) => args.run(),
            Command::Identify(args) => args.run(),
            Command::Render(args) => args.run(),
        })
    }
}

impl TrackCli {
    /// Runs `track`.
    pub fn run() -> ExitCode {
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
