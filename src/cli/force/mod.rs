//! `freeswing force`: the strip under the spotlight.

mod figure;
mod page;

use std::fmt::Write;
use std::path::{Path, PathBuf};

use super::{Console, Target};
use crate::error::{Error, Result};
use crate::experiment::Experiment;
use crate::force::plan::Wanted;
use crate::force::{Force, Plan, Response, Schedule, Setup};
use crate::output::OutputFile;
use crate::report::figure::svg;

/// Compute how far the spotlight pushes a strip, and how far its heat curls it.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Light and film are stated under [light] and [heat] of the experiment file. Without [heat] only the push is computed.

Examples:
  freeswing force --config film.toml
  freeswing force --config film.toml --json force.json --figure force.svg
  freeswing force --config film.toml --plan --interval 0.05 --damping-ratio 0.02
  freeswing force --config film.toml --trace record.csv --duration-s 120 --damping-ratio 0.02")]
pub struct ForceArgs {
    /// The experiment file: specimen, rig, light and heat.
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// The same as JSON, in full precision; `-` for standard output instead of the tables.
    #[arg(long, value_name = "FILE")]
    json: Option<Target>,
    /// Further points of the strip, below the hinge.
    #[arg(long, value_name = "M,M,...", value_delimiter = ',', allow_hyphen_values = true)]
    at_m: Vec<f64>,
    /// Displacement over power, as SVG.
    #[arg(long, value_name = "FILE.svg")]
    figure: Option<Target>,
    /// Say what an experiment needs to see the push: power, time, and what chopping the lamp gains.
    #[arg(long, conflicts_with_all = ["figure", "trace"])]
    plan: bool,
    /// With --plan: half the 95 % interval that is wanted, over the push.
    #[arg(long, value_name = "SHARE", default_value_t = 0.05, requires = "plan")]
    interval: f64,
    /// With --plan: standard deviation of one sample of the sensor; laser.resolution_m where it is absent.
    #[arg(long, value_name = "M", requires = "plan")]
    noise_m: Option<f64>,
    /// With --plan: how long the record is.
    #[arg(long, value_name = "S", default_value_t = 600.0, requires = "plan")]
    time_s: f64,
    /// Write the motion of the sensor's point in time: the lamp as light.on_s, warm_up_s and chop_hz say.
    #[arg(long, value_name = "FILE.csv")]
    trace: Option<Target>,
    /// With --trace: how long.
    #[arg(long, value_name = "S", default_value_t = 60.0, requires = "trace")]
    duration_s: f64,
    /// Samples per second, of --plan and --trace.
    #[arg(long, value_name = "HZ", default_value_t = 100.0)]
    rate_hz: f64,
    /// Damping ratio of the modes, of --plan and --trace, as `identify` measures it.
    #[arg(long, value_name = "SHARE")]
    damping_ratio: Option<f64>,
}

impl ForceArgs {
    /// Computes and prints.
    ///
    /// # Errors
    /// One line: what, where, what to do.
    pub fn run(&self, console: &Console) -> Result<()> {
        let create = |path: &Option<Target>| path.as_deref().map(OutputFile::create).transpose();
        let (json, figure, trace) = (create(&self.json)?, create(&self.figure)?, create(&self.trace)?);
        let experiment = super::read_strip(&self.config, console)?;
        let setup = Setup::of(&experiment).map_err(|e| in_file(e, &self.config))?;
        if self.plan {
            let plan = self.planned(&setup, &experiment).map_err(|e| in_file(e, &self.config))?;
            return super::deliver(&page::plan_text(&plan), &plan, json, console);
        }
        let motion = match &trace {
            Some(_) => Some(self.trace_csv(&setup).map_err(|e| in_file(e, &self.config))?),
            None => None,
        };
        let force = Force::of(&setup, &self.at_m).map_err(|e| in_file(e, &self.config))?;
        if let Some(warning) = page::out_of_range(&setup, &force) {
            console.warning(warning);
        }
        super::deliver(&page::force_text(&setup, &force), &force, json, console)?;
        if let Some(figure) = figure {
            figure.commit(svg(&figure::of_sweep(&force)).as_bytes())?;
        }
        match (trace, motion) {
            (Some(trace), Some(motion)) => trace.commit(motion.as_bytes()),
            _ => Ok(()),
        }
    }

    fn planned(&self, setup: &Setup, experiment: &Experiment) -> Result<Plan> {
        let resolution_m = experiment.laser.as_ref().and_then(|laser| laser.resolution_m);
        let noise_m = self.noise_m.or(resolution_m).ok_or_else(|| Error::Missing {
            detail: "laser.resolution_m is missing; state it, or the noise of one sample with --noise-m".into(),
        })?;
        let wanted = Wanted {
            relative: self.interval,
            noise_m,
            rate_hz: self.rate_hz,
            time_s: self.time_s,
            damping_ratio: self.damping()?,
        };
        Plan::of(setup, wanted)
    }

    /// ξ.
    fn damping(&self) -> Result<f64> {
        let wrong = |message: String| Error::Option { option: "--damping-ratio".into(), message };
        match self.damping_ratio {
            Some(value) if value > 0.0 && value < 1.0 => Ok(value),
            Some(value) => Err(wrong(format!("{value} is not between 0 and 1"))),
            None => Err(wrong("is needed; give the one that `freeswing identify` measured, for example 0.02".into())),
        }
    }

    fn trace_csv(&self, setup: &Setup) -> Result<String> {
        /// More rows than a record of a day at a kilohertz are a slip.
        const MOST_ROWS: f64 = 1e8;
        let rows = self.duration_s * self.rate_hz;
        for (option, value) in [("--duration-s", self.duration_s), ("--rate-hz", self.rate_hz)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::Option {
                    option: option.into(),
                    message: format!("{value} is not above 0; give a positive number"),
                });
            }
        }
        if rows > MOST_ROWS {
            return Err(Error::Option {
                option: "--duration-s".into(),
                message: format!("{rows:.0} rows are too many; shorten the time or lower --rate-hz"),
            });
        }
        let light = &setup.light;
        let edges_s = if light.on_s.is_empty() { vec![0.1 * self.duration_s] } else { light.on_s.clone() };
        let schedule = Schedule { edges_s, warm_up_s: light.warm_up_s, chop_hz: light.chop_hz };
        let (power_w, distance_m) = setup.main()?;
        let response = Response::of(setup, power_w, distance_m, self.damping()?)?;
        let mut csv = String::from("t_s,light,temperature_k,push_um,heat_um,displacement_um\n");
        for instant in response.motion(&schedule, 1.0 / self.rate_hz, rows.round() as usize) {
            let kelvin = instant.kelvin.map_or(String::new(), |kelvin| format!("{kelvin:.4}"));
            let [push_um, heat_um] = [instant.push_m, instant.heat_m].map(|v| 1e6 * v);
            let _ = writeln!(
                csv,
                "{:.6},{:.6},{kelvin},{push_um:.6},{heat_um:.6},{:.6}",
                instant.t_s,
                instant.light,
                push_um + heat_um
            );
        }
        Ok(csv)
    }
}

/// What an experiment file lacks, with the file.
fn in_file(error: Error, path: &Path) -> Error {
    match error {
        Error::Missing { detail } => Error::Config { path: path.to_owned(), line: None, message: detail },
        other => other,
    }
}
