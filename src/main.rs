use std::process::ExitCode;

fn main() -> ExitCode {
    freeswing::cli::run()
}
