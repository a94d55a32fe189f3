//! `freeswing diagnose`: where simulation and recording differ, and what physics was left out.

mod figure;
mod page;

use std::path::PathBuf;

use serde_json::json;

use super::table::number;
use super::{Console, Target};
use crate::diagnose::{self, report::Limits};
use crate::error::{Error, Result};
use crate::experiment::Experiment;
use crate::fit::Record;
use crate::model::ForwardModel;
use crate::output::OutputFile;
use crate::report::{diagnosis_curves, where_curves};
use crate::series::FEWEST_ROWS;
use figure::Figure;

/// Longest planned recording.
const MOST_ROWS: f64 = 1e6;

/// Find where the model differs from recordings and which effects are missing, and check this by prediction.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  freeswing diagnose kapton.csv --config videos/kapton.base.toml --figure diagnosis.svg
  freeswing diagnose small.csv large.csv --config experiment.toml --json diagnosis.json
  freeswing diagnose --detectable --config experiment.toml --duration 60 --rate 30 --noise-rad 3e-4

The base model is that of `fit`: the joint's spring and damper, every effect named in [model.effects], and each recording's start; of one link
the hinge's viscous damper, if the file states it or c_eq_n_m_s_per_rad. All other effects are candidates, those of the camera first.")]
pub struct DiagnoseArgs {
    /// Tables of angles of one specimen; `-` is standard input.
    #[arg(required_unless_present = "detectable", conflicts_with = "detectable", value_name = "ANGLES")]
    angles: Vec<PathBuf>,
    /// The experiment file: specimen, rig and base model.
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Write all of it as JSON; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<Target>,
    /// Draw before and after as SVG; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    figure: Option<Target>,
    /// Write the angles, measured and simulated before and after, row by row, as CSV; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    curves: Option<Target>,
    /// Write the missing torque by time, amplitude and phase as CSV; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    map: Option<Target>,
    /// Use rows from this stamp on.
    #[arg(long, value_name = "S", default_value_t = f64::NEG_INFINITY, hide_default_value = true)]
    from: f64,
    /// Use rows before this stamp.
    #[arg(long, value_name = "S", default_value_t = f64::INFINITY, hide_default_value = true)]
    until: f64,
    /// Predict a single recording from this stamp on, fitted before it [default: two thirds through it].
    #[arg(long, value_name = "S")]
    predict_from: Option<f64>,
    /// Test the base model with this many simulated recordings (parametric bootstrap), not by a linear approximation.
    #[arg(long, value_name = "N", default_value_t = 0)]
    bootstraps: usize,
    /// Before an experiment, without a recording: the smallest amount of each effect that would be seen, and what it would be confused with.
    #[arg(long)]
    detectable: bool,
    /// Length of the planned recording.
    #[arg(long, value_name = "S", default_value_t = 60.0, requires = "detectable")]
    duration: f64,
    /// Rows per second of the planned recording.
    #[arg(long, value_name = "HZ", default_value_t = 30.0, requires = "detectable")]
    rate: f64,
    /// Noise of the planned recording's angles.
    #[arg(long, value_name = "RAD", default_value_t = 1e-3, requires = "detectable")]
    noise_rad: f64,
    /// Nothing on standard output, no progress.
    #[arg(long)]
    quiet: bool,
}

impl DiagnoseArgs {
    /// Diagnoses and prints.
    ///
    /// # Errors
    /// One line: what, where, what to do.
    pub fn run(&self, console: &Console) -> Result<()> {
        let experiment = super::read_experiment(&self.config, console)?;
        if self.detectable {
            return self.plan(&experiment, console);
        }
        let marks = ForwardModel::of(&experiment)?.chain().groups().len();
        let records = super::recordings(&self.angles, (marks, &experiment), (self.from, self.until), console)?;
        self.check_border(&records)?;
        let json = self.json.as_deref().map(OutputFile::create).transpose()?;
        let [figure, curves, map] =
            [&self.figure, &self.curves, &self.map].map(|path| path.as_deref().map(OutputFile::create).transpose());
        let (figure, curves, map) = (figure?, curves?, map?);
        let bar = console.bar_of_fits(self.quiet);
        let diagnosis = diagnose::diagnose(&records, &experiment, &self.options(), &bar)?;
        drop(bar);
        let alone = [&figure, &curves, &map].into_iter().flatten().any(OutputFile::is_standard_output);
        let text = if self.quiet || alone { String::new() } else { page::page(&diagnosis) };
        if let Some(file) = figure {
            file.commit(Figure::of(&diagnosis)?.svg().as_bytes())?;
        }
        for (file, table) in [(curves, diagnosis_curves(&diagnosis)), (map, where_curves(&diagnosis))] {
            if let (Some(file), Some(table)) = (file, table) {
                file.commit(table.as_bytes())?;
            }
        }
        super::deliver(&text, &json!(diagnosis), json, console)
    }

    /// Both sides of the border hold enough to be fitted and to be predicted.
    fn check_border(&self, records: &[Record]) -> Result<()> {
        let Some(border_s) = self.predict_from else { return Ok(()) };
        let refused = |message: String| Err(Error::Option { option: "--predict-from".to_owned(), message });
        let [record] = records else {
            return refused("of several recordings the last is predicted from the others; leave it out".to_owned());
        };
        let before = record.t_s.iter().filter(|t_s| **t_s < border_s).count();
        if before.min(record.len() - before) < FEWEST_ROWS {
            return refused(format!(
                "{border_s} s leaves {before} rows to fit and {} to predict, and each needs {FEWEST_ROWS}; give a stamp well between {} s and {} s",
                record.len() - before,
                record.t_s[0],
                record.t_s[record.len() - 1]
            ));
        }
        Ok(())
    }

    fn options(&self) -> diagnose::Options {
        diagnose::Options {
            bootstraps: self.bootstraps,
            predict_from_s: self.predict_from,
            ..diagnose::Options::default()
        }
    }

    /// What a planned recording could show.
    fn plan(&self, experiment: &Experiment, console: &Console) -> Result<()> {
        for (option, value) in [("--duration", self.duration), ("--rate", self.rate), ("--noise-rad", self.noise_rad)] {
            if !(value.is_finite() && value > 0.0) {
                let message = format!("{value}: must be a positive number");
                return Err(Error::Option { option: option.to_owned(), message });
            }
        }
        let plan = diagnose::Plan { duration_s: self.duration, rate_hz: self.rate, noise_rad: self.noise_rad };
        if !(plan.duration_s * plan.rate_hz <= MOST_ROWS) {
            let message = "too many rows; give a shorter --duration or a lower --rate".to_owned();
            return Err(Error::Option { option: "--duration".to_owned(), message });
        }
        let json = self.json.as_deref().map(OutputFile::create).transpose()?;
        let limits = diagnose::planned(experiment, &plan)?;
        let heading = format!(
            "{}: {} s at {} Hz with {} mrad of noise would show\n",
            experiment.specimen.name,
            plan.duration_s,
            plan.rate_hz,
            number(1e3 * plan.noise_rad, 3)
        );
        let text = if self.quiet { String::new() } else { heading + &page::limits_table(&limits) };
        super::deliver(&text, &json!({"schema": "freeswing.diagnosis/1", "detectable": Limits(limits)}), json, console)
    }
}
