//! `freeswing identify`: frequencies and damping without a model.

use std::path::PathBuf;

use super::table::number;
use super::{Console, Target};
use crate::error::{Error, Result};
use crate::experiment::Experiment;
use crate::identify::{identify, identify_displacement};
use crate::output::OutputFile;
use crate::series::{AngleSeries, Measured};
use crate::sidecar::Beside;

/// Find frequencies, damping and mode shapes in a table of angles, every estimator side by side.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  freeswing identify angles.csv
  freeswing identify angles.csv --config experiment.toml --json identified.json
  freeswing identify angles.csv --from 35
  track swing.mp4 --out - | freeswing identify -

The first line is the answer: frequency and damping ratio of each mode, the strongest first, or why there is none. Drift
and full rotations are not counted as modes. The table needs t_s and theta1_rad, theta2_rad, …, or displacement_px, which
`track` writes of a single mark without a known pivot: then amplitudes are in pixels. Other columns are ignored, an
empty field is a missing value. With --config come the frequency floor of the specimen and K_eq, C_eq. All intervals are 95 %.
Exit code 0: done, also when something is not identifiable, which a warning says; 2: bad input, nothing written.")]
pub struct IdentifyArgs {
    /// The table of angles; `-` for standard input.
    angles: PathBuf,
    /// The experiment: specimen and gravity.
    #[arg(long, value_name = "TOML")]
    config: Option<PathBuf>,
    /// Everything as JSON; `-` for standard output, instead of the table.
    #[arg(long, value_name = "FILE")]
    json: Option<Target>,
    /// Leave out what comes before this time.
    #[arg(long, value_name = "S")]
    from: Option<f64>,
    /// Leave out this time and what comes after it.
    #[arg(long, value_name = "S")]
    until: Option<f64>,
    /// Print nothing.
    #[arg(long)]
    quiet: bool,
}

impl IdentifyArgs {
    /// Runs the command.
    ///
    /// # Errors
    /// One line: what, where, what to do.
    pub fn run(&self, console: &Console) -> Result<()> {
        let experiment = self.config.as_deref().map(Experiment::read_as_far_as_measured).transpose()?;
        let experiment = experiment.filter(|experiment| describes_specimen(experiment, console));
        let json = self.json.as_deref().map(OutputFile::create).transpose()?;
        let (series, measured) = AngleSeries::read_motion(&self.angles)?;
        console.warnings(&series.warnings);
        if let Some(beside) = Beside::of(&self.angles) {
            let said = |warning: &String| format!("{}, when it was tracked: {warning}", self.angles.display());
            console.warnings(&beside.warnings().iter().map(said).collect::<Vec<_>>());
        }
        let series = self.stretch(series)?;
        let found = match measured {
            Measured::Angles => identify(&series, experiment.as_ref())?,
            Measured::Displacement => identify_displacement(&series),
        };
        // where the first line of the report is not read, an answer without a mode must not pass for one
        if found.modes.is_empty() && !self.quiet {
            console.warning(format!("{}: {}", series.path.display(), found.summary));
        }
        let text = if self.quiet { String::new() } else { found.to_string() };
        match measured {
            Measured::Angles => super::deliver(&text, &found, json, console),
            Measured::Displacement => super::deliver(&text, &found.json_in_px(), json, console),
        }
    }

    /// The wanted stretch of time.
    fn stretch(&self, series: AngleSeries) -> Result<AngleSeries> {
        if self.from.is_none() && self.until.is_none() {
            return Ok(series);
        }
        let (from_s, until_s) = (self.from.unwrap_or(f64::NEG_INFINITY), self.until.unwrap_or(f64::INFINITY));
        super::check_span(from_s, until_s)?;
        let stretch = series.slice(series.rows(from_s, until_s));
        let [first, last] = [0, series.len() - 1].map(|row| (1e6 * series.t_s[row]).round() / 1e6 + 0.0);
        let refused = |what: String| Error::Option {
            option: "--from, --until".to_owned(),
            message: format!("the stretch {what} (the table runs from {first} s to {last} s)"),
        };
        if stretch.is_empty() {
            return Err(refused("holds no row; widen it".to_owned()));
        }
        let stretch = stretch.checked().map_err(|error| match error {
            Error::Table { message, .. } => refused(message),
            other => other,
        })?;
        if let Some(swing_s) = series.period_s().filter(|swing_s| stretch.duration_s() < *swing_s) {
            let (long, swing) = (number(stretch.duration_s(), 3), number(swing_s, 3));
            return Err(refused(format!("of {long} s is shorter than one swing, which takes {swing} s; widen it")));
        }
        Ok(stretch)
    }
}

/// Whether a file describes a specimen; what is missing or odd is said on standard error.
fn describes_specimen(experiment: &Experiment, console: &Console) -> bool {
    console.warnings(&experiment.warnings);
    if let Some(missing) = &experiment.missing {
        console.warning(format!("{missing}; going on without the specimen"));
    }
    experiment.missing.is_none()
}
