//! `freeswing render`: a synthetic recording with known truth.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::error::Error;
use crate::experiment::Experiment;
use crate::synth::Recording;

/// Options of `freeswing render`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The experiment file: specimen, rig, model and `[render]`.
    #[arg(long, value_name = "FILE")]
    pub config: PathBuf,
    /// The video to make: .mp4, .mov, .mkv or .avi.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// A table of the true marks and angles.
    #[arg(long, value_name = "FILE")]
    pub truth: Option<PathBuf>,
    /// Seed of noise and jitter, instead of render.seed.
    #[arg(long)]
    pub seed: Option<u64>,
    /// Length in seconds, instead of render.duration_s.
    #[arg(long, value_name = "S")]
    pub duration: Option<f64>,
    /// Length in frames, instead of render.duration_s.
    #[arg(long, value_name = "N", conflicts_with = "duration")]
    pub frames: Option<u64>,
    /// No progress bar.
    #[arg(long)]
    pub quiet: bool,
}

/// Renders the recording.
///
/// # Errors
/// One line: what, where, what to do.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let mut experiment = Experiment::read(&args.config)?;
    let render = &mut experiment.render;
    render.seed = args.seed.unwrap_or(render.seed);
    render.duration_s = args.duration.unwrap_or(render.duration_s);
    if let Some(frames) = args.frames {
        render.duration_s = frames as f64 / render.fps;
    }
    if args.truth.as_ref() == Some(&args.out) {
        anyhow::bail!("{}: --out and --truth name the same file; give them different names", args.out.display());
    }
    let recording = Recording::of(&experiment)?;
    let stop = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&stop);
    ctrlc::set_handler(move || seen.store(true, Ordering::Relaxed)).context("cannot listen for Ctrl-C")?;
    let bar = progress_bar(recording.len() as u64, args.quiet);
    recording.write(&args.out, args.truth.as_deref(), &mut |done| {
        bar.set_position(done as u64);
        if stop.load(Ordering::Relaxed) { Err(Error::Interrupted) } else { Ok(()) }
    })?;
    bar.finish_and_clear();
    Ok(())
}

/// A bar on standard error, shown only on a terminal.
fn progress_bar(length: u64, quiet: bool) -> ProgressBar {
    let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr_with_hz(10) };
    let bar = ProgressBar::with_draw_target(Some(length), target);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} frames  {per_sec}  {eta} left") {
        bar.set_style(style);
    }
    bar
}
