//! The command line: parse → options → stage → write → exit code. One file a command.

pub mod render;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Measures vibration from video.
#[derive(Debug, Parser)]
#[command(name = "freeswing", version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Make a synthetic recording with known truth.
    Render(render::Args),
}

/// Runs the command that was typed: 0 when done, 2 for bad input or a failed stage, said in one line on standard error.
pub fn run() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Render(args) => render::run(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("freeswing: {error:#}");
            ExitCode::from(2)
        }
    }
}
