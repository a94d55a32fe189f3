//! `track`: the command `freeswing track`, so that `track VIDEO --out angles.csv` works as typed.

fn main() -> std::process::ExitCode {
    freeswing::cli::TrackCli::run()
}
