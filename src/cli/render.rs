//! `freeswing render`: a synthetic recording with known truth.

use std::path::PathBuf;

use super::{Console, Target};
use crate::error::{Error, Result};
use crate::progress::Progress;
use crate::synth::Recording;

/// Make a synthetic recording with known truth.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  freeswing render --config videos/kapton.toml --out swing.mp4 --truth truth.csv")]
pub struct RenderArgs {
    /// The experiment file: specimen, rig, model and `[render]`.
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// The video to make: .mp4, .mov, .mkv or .avi.
    #[arg(long, value_name = "FILE")]
    out: Target,
    /// A table of the true marks and angles.
    #[arg(long, value_name = "FILE")]
    truth: Option<Target>,
    /// Seed of noise and jitter, instead of render.seed.
    #[arg(long)]
    seed: Option<u64>,
    /// Length in seconds, instead of render.duration_s.
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
    /// Length in frames, instead of render.duration_s.
    #[arg(long, value_name = "N", conflicts_with = "duration")]
    frames: Option<u64>,
    /// No progress bar.
    #[arg(long)]
    quiet: bool,
}

impl RenderArgs {
    /// Renders the recording.
    ///
    /// # Errors
    /// One line: what, where, what to do.
    pub fn run(&self, console: &Console) -> Result<()> {
        let mut experiment = super::read_experiment(&self.config, console)?;
        let render = &mut experiment.render;
        render.seed = self.seed.unwrap_or(render.seed);
        render.duration_s = self.duration.unwrap_or(render.duration_s);
        if let Some(frames) = self.frames {
            render.duration_s = frames as f64 / render.fps;
        }
        let recording = Recording::of(&experiment)?;
        let bar = console.bar_of_frames(self.quiet);
        bar.begin("rendering", Some(recording.len() as u64));
        recording.write(&self.out, self.truth.as_deref(), &mut |_| {
            bar.advance(1);
            if bar.is_cancelled() { Err(Error::Interrupted) } else { Ok(()) }
        })
    }
}
