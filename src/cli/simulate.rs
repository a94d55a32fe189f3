//! `freeswing simulate`: the forward model alone.

use std::fmt::Write;
use std::path::PathBuf;

use rand::SeedableRng;
use rand_distr::{Distribution, Normal};

use super::{Console, Target};
use crate::error::{Error, Result};
use crate::output::OutputFile;
use crate::synth::Swing;

/// Longest table: a day at 1 kHz is a mistake, not an experiment.
const MOST_ROWS: f64 = 1e7;

/// Simulate a swing: the forward model alone.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  freeswing simulate --config videos/kapton.toml --out angles.csv
  freeswing simulate --config experiment.toml --out - --duration 60 --rate 30 --noise-rad 3e-4

Specimen, springs, dampers, release and every effect come from the file; duration and rate from its [render] where not given.")]
pub struct SimulateArgs {
    /// The experiment file: specimen, rig and model.
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// The table to write; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    out: Target,
    /// Length in seconds, instead of render.duration_s.
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
    /// Rows per second, instead of render.fps.
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Standard deviation of normal noise on every angle.
    #[arg(long, value_name = "RAD", default_value_t = 0.0)]
    noise_rad: f64,
    /// Seed of the noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl SimulateArgs {
    /// Simulates and writes.
    ///
    /// # Errors
    /// One line: what, where, what to do.
    pub fn run(&self, console: &Console) -> Result<()> {
        let mut experiment = super::read_experiment(&self.config, console)?;
        let render = &mut experiment.render;
        render.duration_s = positive("--duration", self.duration.unwrap_or(render.duration_s))?;
        render.fps = positive("--rate", self.rate.unwrap_or(render.fps))?;
        let rows = (render.duration_s * render.fps).round();
        if !(rows <= MOST_ROWS) {
            let message = format!("{rows} rows; give a shorter --duration or a lower --rate");
            return Err(Error::Option { option: "--duration".into(), message });
        }
        let noise = Normal::new(0.0, self.noise_rad).ok().filter(|_| self.noise_rad >= 0.0);
        let noise = noise.ok_or_else(|| Error::Option {
            option: "--noise-rad".into(),
            message: format!("{} is no standard deviation; give zero or a positive number", self.noise_rad),
        })?;
        let out = OutputFile::create(&self.out)?;
        let swing = Swing::of(&experiment)?;
        let mut random = rand::rngs::StdRng::seed_from_u64(self.seed);
        let links = experiment.specimen.lengths_m().len();
        let mut text = String::from("frame,t_s");
        (1..=links).for_each(|link| {
            let _ = write!(text, ",theta{link}_rad");
        });
        text.push('\n');
        for frame in 0..rows as u64 {
            let t_s = experiment.render.start_s + frame as f64 / experiment.render.fps;
            let _ = write!(text, "{frame},{t_s:.9}");
            for angle_rad in swing.angles_rad(t_s) {
                let _ = write!(text, ",{:.10}", angle_rad + noise.sample(&mut random));
            }
            text.push('\n');
        }
        out.commit(text.as_bytes())
    }
}

fn positive(option: &str, value: f64) -> Result<f64> {
    if value.is_finite() && value > 0.0 {
        return Ok(value);
    }
    Err(Error::Option { option: option.to_owned(), message: format!("{value}: must be a positive number") })
}
