//! `freeswing`: every command.

fn main() -> std::process::ExitCode {
    freeswing::cli::Cli::run()
}
