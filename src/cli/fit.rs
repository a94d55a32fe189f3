//! `freeswing fit`: the forward model's parameters, and whether it reproduces the recording.

use std::fmt::Write;
use std::path::PathBuf;

use serde_json::{Value, json};

use super::table::{Table, number, paragraph};
use super::{Console, Target};
use crate::digits::fixed;
use crate::error::{Error, Result};
use crate::experiment::Experiment;
use crate::fit::{self, Fit, Pace, Record, Seen, Verdict};
use crate::model::{Chain, ForwardModel, Parameter};
use crate::output::OutputFile;
use crate::progress::{Progress, Silent};

/// Fit the forward model to recordings: parameters, simulated against measured, does it reproduce the decay.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  freeswing fit angles.csv --config videos/kapton.toml
  freeswing fit small.csv large.csv --config experiment.toml --free hinge_coulomb --json fit.json

Free are the joint's spring and damper, every effect named in [model.effects] (its value is the start), and of one link the hinge's
viscous damper. A joint whose k_eq_n_m_per_rad is 0 has no spring. Several recordings share all parameters but not their release.
The fit begins with the file's values and with those that the recording's own frequencies and decay say. \"Reproduced\" means: the residual
is no more than the noise, which is taken from the table alone, and at least nine tenths of the variance are explained; docs/outputs.md
has the conditions one by one.")]
pub struct FitArgs {
    /// Tables of angles of one specimen; `-` is standard input.
    #[arg(required = true, value_name = "ANGLES")]
    angles: Vec<PathBuf>,
    /// The experiment file: specimen, rig and model.
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Write all of it as JSON; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<Target>,
    /// Write measured and simulated angles, and what is left, row by row, as CSV; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    curves: Option<Target>,
    /// Also fit this parameter or effect that the file does not name, as hinge_coulomb; or links.1.com_m where the centre of mass is not known to 0.1 %. May be
    /// repeated.
    #[arg(long, value_name = "ID")]
    free: Vec<String>,
    /// Keep a parameter at its value in the file; may be repeated.
    #[arg(long, value_name = "ID")]
    fix: Vec<String>,
    /// Use rows from this stamp on.
    #[arg(long, value_name = "S", default_value_t = f64::NEG_INFINITY, hide_default_value = true)]
    from: f64,
    /// Use rows before this stamp.
    #[arg(long, value_name = "S", default_value_t = f64::INFINITY, hide_default_value = true)]
    until: f64,
    /// Nothing on standard output.
    #[arg(long)]
    quiet: bool,
}

impl FitArgs {
    /// Fits and prints.
    ///
    /// # Errors
    /// One line: what, where, what to do.
    pub fn run(&self, console: &Console) -> Result<()> {
        let experiment = super::read_experiment(&self.config, console)?;
        let model = ForwardModel::of(&experiment)?;
        let marks = model.chain().groups().len();
        let records = super::recordings(&self.angles, (marks, &experiment), (self.from, self.until), console)?;
        let free = free_parameters(&experiment, marks, &self.free, &self.fix)?;
        if experiment.model.effects.dropped_frames.is_some() {
            let id = Parameter::DroppedFrames.id();
            console.warning(format!(
                "model.effects.{id} is not fitted: where frames are missing only `freeswing diagnose` finds"
            ));
        }
        let json = self.json.as_deref().map(OutputFile::create).transpose()?;
        let curves = self.curves.as_deref().map(OutputFile::create).transpose()?;
        let seen: Vec<Option<Seen>> = records.iter().map(Seen::of).collect();
        for (record, seen) in records.iter().zip(&seen) {
            seen.as_ref().map_or(Ok(()), |seen| fit::check_frequency(record, seen, &experiment))?;
        }
        let window_s = std::f64::consts::TAU / model.characteristic_rad_s();
        let bar = console.bar_of_fits(self.quiet);
        bar.begin("fitting", Some(fit::stages(&[]) + fit::stages(&free)));
        let side = |free: &[Parameter]| Ok(Side::of(fit::fit_watched(&records, &experiment, free, &bar)?, window_s));
        let of_links = Chain::of(&experiment.specimen)?.parameters();
        let given = side(&[])?;
        let fitted = side(&free)?;
        let bends = experiment.model.effects.distributed_flexibility.is_some();
        let (fitted, pieces) = if bends && !experiment.model.states_pieces && !fitted.is_reproduced() {
            let (fit, pieces) = fit::with_best_rods(fitted.fit, &records, &experiment, &free, &Silent)?;
            (Side::of(fit, window_s), pieces)
        } else {
            (fitted, experiment.model.pieces)
        };
        let report = Report {
            pieces: bends.then_some(pieces),
            usual_pieces: experiment.model.pieces,
            links_taken: !experiment.specimen.links.is_empty() && !free.iter().any(|p| of_links.contains(p)),
            given,
            fitted,
            start: free.iter().map(|p| model.value(*p).unwrap_or(0.0)).collect(),
            paces: seen.iter().map(|seen| Pace::of(seen.as_ref()?, &experiment)).collect(),
            records: &records,
            specimen: &experiment.specimen.name,
        };
        drop(bar);
        let alone = curves.as_ref().is_some_and(OutputFile::is_standard_output);
        if let Some(file) = curves {
            file.commit(crate::report::fit_curves(&report.fitted.fit, &records).as_bytes())?;
        }
        let text = if self.quiet || alone { String::new() } else { report.text() };
        super::deliver(&text, &report.json(), json, console)
    }
}

/// The parameters a fit leaves free: those of the base model, with the user's changes.
fn free_parameters(experiment: &Experiment, marks: usize, more: &[String], fix: &[String]) -> Result<Vec<Parameter>> {
    let stated = experiment.model.law.iter().flat_map(|law| law.coefficients().map(|(parameter, _)| parameter));
    let of_links = Chain::of(&experiment.specimen)?.parameters();
    let known: Vec<Parameter> = Parameter::ALL.into_iter().chain(of_links).chain(stated).collect();
    let parse = |id: &String| {
        let nearest = || {
            known
                .iter()
                .map(|p| (strsim::jaro_winkler(id, p.id()), p.id()))
                .max_by(|a, b| a.0.total_cmp(&b.0))
                .map_or("", |n| n.1)
        };
        // the name of an effect stands for all its parameters
        let is_of_effect = |p: &Parameter| p.id().split_once('.').is_some_and(|(effect, _)| effect == id);
        let exact: Vec<Parameter> = known.iter().copied().filter(|p| p.id() == id).collect();
        let named = if exact.is_empty() { Parameter::ALL.into_iter().filter(is_of_effect).collect() } else { exact };
        if named.is_empty() {
            let message = format!("no such parameter; the nearest known one is `{}`", nearest());
            return Err(Error::Option { option: id.clone(), message });
        }
        Ok(named)
    };
    if let Some(both) = more.iter().find(|id| fix.contains(id)) {
        let message = format!("{both} is to be kept as well (--fix); leave one of the two out");
        return Err(Error::Option { option: "--free".to_owned(), message });
    }
    let fix = fix.iter().map(parse).collect::<Result<Vec<_>>>()?.concat();
    let mut free = fit::base_parameters(experiment, marks);
    for id in more {
        free.extend(parse(id)?);
    }
    if free.contains(&Parameter::DroppedFrames) {
        let message = "a fit does not know where frames are missing; `freeswing diagnose` finds them".to_owned();
        return Err(Error::Option { option: Parameter::DroppedFrames.id().to_owned(), message });
    }
    free.retain(|p| !fix.contains(p));
    let mut once = Vec::new();
    free.retain(|p| {
        !once.contains(p) && {
            once.push(*p);
            true
        }
    });
    Ok(free)
}

struct Side {
    fit: Fit,
    verdicts: Vec<Verdict>,
}

impl Side {
    fn of(fit: Fit, window_s: f64) -> Self {
        let verdicts = (0..fit.residuals.len()).map(|record| Verdict::of_fit(&fit, record, window_s)).collect();
        Self { fit, verdicts }
    }

    fn is_reproduced(&self) -> bool {
        self.verdicts.iter().all(Verdict::is_reproduced)
    }
}

struct Report<'a> {
    given: Side,
    fitted: Side,
    start: Vec<f64>,
    paces: Vec<Option<Pace>>,
    records: &'a [Record],
    specimen: &'a str,
    /// General links of which nothing is free.
    links_taken: bool,
    /// Rods between two marks of a strip that bends all along.
    pieces: Option<usize>,
    /// As many as the file, or the program by itself, takes.
    usual_pieces: usize,
}

impl Report<'_> {
    fn text(&self) -> String {
        let mut text = format!("{}\n\n", self.specimen);
        for index in 0..self.records.len() {
            if let Some(statement) = self.pace_statement(index) {
                text.push_str(&paragraph("", &format!("{}: {statement}", self.records[index].path.display())));
                text.push('\n');
            }
        }
        self.parameters(&mut text);
        for index in 0..self.records.len() {
            self.recording(index, &mut text);
        }
        text
    }

    fn parameters(&self, text: &mut String) {
        let mut table = Table::new(["parameter", "fitted", "sd", "95 % from", "to", "in the file", "unit"]);
        for (estimate, start) in self.fitted.fit.estimates.iter().zip(&self.start) {
            table.row([
                estimate.parameter.id().to_owned(),
                number(estimate.value, 5),
                number(estimate.sd, 2),
                number(estimate.low, 4),
                number(estimate.high, 4),
                number(*start, 4),
                estimate.parameter.unit().to_owned(),
            ]);
        }
        text.push_str(&table.text());
        for estimate in &self.fitted.fit.estimates {
            if !estimate.is_determined() {
                let (id, unit) = (estimate.parameter.id(), estimate.parameter.unit());
                let [low, high] = [estimate.low, estimate.high].map(|end| number(end, 3));
                let within =
                    if estimate.low < 0.0 { format!("between {low} and {high}") } else { format!("at most {high}") };
                let line = format!("{id} is not significantly different from zero: {within} {unit}");
                text.push_str(&paragraph("  ", &line));
            }
        }
        for combination in self.fitted.fit.undetermined.iter().filter(|c| c.len() > 1) {
            let names: Vec<&str> = combination.iter().map(|(p, _)| p.id()).collect();
            text.push_str(&paragraph(
                "  ",
                &format!("Only a combination of these can be determined: {}", names.join(", ")),
            ));
        }
        for (pair, correlation) in self.strong_correlations() {
            text.push_str(&paragraph("  ", &format!("{} and {} are correlated by {correlation:.3}", pair[0], pair[1])));
        }
        if self.fitted.fit.ending != fit::Ending::Converged {
            let line = "The fit has not converged within its budget: the values mean little. Free more parameters (--free), or use a \
                        shorter stretch (--from, --until).";
            text.push_str(&paragraph("  ", line));
        }
        if self.fitted.fit.coloured {
            text.push_str(&paragraph("  ", "The residuals are correlated in time; the intervals are widened for it."));
        }
        if let Some(pieces) = self.pieces.filter(|pieces| *pieces != self.usual_pieces) {
            let line = format!(
                "The strip is taken as {pieces} rods between two marks, which follow the recording better than the usual {}; the file's values are compared with the usual number. `pieces` in [model] sets it.",
                self.usual_pieces
            );
            text.push_str(&paragraph("  ", &line));
        }
        let is_reproduced = self.is_reproduced();
        let line = match is_reproduced {
            true => {
                "The intervals are valid only if nothing else acts: the fitted parameters would take up a missing force."
            }
            false => {
                "The intervals are not valid: the recording is not reproduced, and the fitted parameters take up what the model lacks."
            }
        };
        let links = match self.links_taken && !is_reproduced {
            true => {
                " Centres of mass and inertias are kept as the file has them, to all digits: free those that are known to a percent only (--free links.1.com_m)."
            }
            false => "",
        };
        let of_one_link = if is_reproduced && self.frees_half_of_one_link() {
            " One link shows only (I + mc²)/(mc): the centre of mass or the inertia that is free is right only if the other one in the file is."
        } else {
            ""
        };
        let line = &format!("{line}{links}{of_one_link} `freeswing diagnose` searches for missing effects.");
        text.push_str(&paragraph("  ", line));
    }

    /// Whether of the centre of mass and the inertia of a single link one is free.
    fn frees_half_of_one_link(&self) -> bool {
        let is_free = |id: &str| self.fitted.fit.estimates.iter().any(|own| own.parameter.id() == id);
        let [com, inertia] = ["links.1.com_m", "links.1.inertia_kg_m2"].map(is_free);
        self.records.iter().all(|record| record.links() == 1) && com != inertia
    }

    fn strong_correlations(&self) -> Vec<([&'static str; 2], f64)> {
        let fit = &self.fitted.fit;
        let mut strong = Vec::new();
        for i in 0..fit.estimates.len() {
            for j in 0..i {
                let c = fit.correlation[(i, j)];
                if c.abs() > 0.95 {
                    strong.push(([fit.estimates[j].parameter.id(), fit.estimates[i].parameter.id()], c));
                }
            }
        }
        strong
    }

    fn recording(&self, index: usize, text: &mut String) {
        let record = &self.records[index];
        let _ = writeln!(
            text,
            "\n{}: {} rows, {} s to {:.3} s",
            record.path.display(),
            record.len(),
            fixed(record.t_s[0], 3),
            record.t_s[record.len() - 1]
        );
        let mut table = Table::new(["", "noise mrad", "left by the fit", "by the file's values"]);
        for link in 0..record.links() {
            let milli = |rad: f64| number(1e3 * rad, 3);
            table.row([
                format!("θ{}", link + 1),
                milli(self.fitted.fit.residuals[index].noise_rad[link]),
                milli(self.fitted.fit.residuals[index].rmse_rad[link]),
                milli(self.given.fit.residuals[index].rmse_rad[link]),
            ]);
        }
        text.push_str(&table.text());
        for (name, side) in [("Fitted", &self.fitted), ("With the file's values", &self.given)] {
            text.push_str(&paragraph("  ", &format!("{name}: {}", side.verdicts[index].statement())));
        }
        let outliers = self.fitted.fit.outliers[index].len();
        if outliers > 0 {
            let [stand, was] = if outliers == 1 { ["value stands", "was"] } else { ["values stand", "were"] };
            let line = format!("{outliers} {stand} apart from the neighbours and {was} left out");
            text.push_str(&paragraph("  ", &line));
        }
        self.peaks(index, text);
    }

    /// What a recording that is not reproduced says of lengths, clock and units.
    fn pace_statement(&self, index: usize) -> Option<String> {
        let pace = self.paces[index].as_ref().filter(|_| !self.fitted.verdicts[index].is_reproduced())?;
        pace.statement()
    }

    /// A few turning points from the first to the last.
    fn peaks(&self, index: usize, text: &mut String) {
        for (link, peaks) in self.fitted.verdicts[index].peaks.iter().enumerate() {
            if peaks.is_empty() {
                continue;
            }
            let mut table = Table::new([
                &format!("θ{} turns at s", link + 1),
                "measured mrad",
                "simulated",
                "recording later by ms",
            ]);
            let shown = 6.min(peaks.len());
            for k in 0..shown {
                let peak = peaks[k * (peaks.len() - 1) / (shown - 1).max(1)];
                table.row([
                    format!("{:.3}", peak.t_s),
                    format!("{:.2}", 1e3 * peak.measured_rad),
                    format!("{:.2}", 1e3 * peak.simulated_rad),
                    format!("{:.2}", 1e3 * peak.lag_s),
                ]);
            }
            text.push('\n');
            text.push_str(&table.text());
        }
    }

    /// Whether every recording is: elsewhere the parameters take up what the model lacks.
    fn is_reproduced(&self) -> bool {
        self.fitted.is_reproduced()
    }

    fn json(&self) -> Value {
        json!({
            "schema": "freeswing.fit/1",
            "specimen": self.specimen,
            "parameters": self.fitted.fit.estimates.iter().zip(&self.start).map(|(e, start)| (e.parameter.id().to_owned(), json!({
                "value": e.value, "sd": e.sd, "low95": e.low, "high95": e.high, "start": start,
                "unit": e.parameter.unit(), "at_bound": e.at_bound, "determined": e.is_determined(),
            }))).collect::<serde_json::Map<_, _>>(),
            "correlation": rows(&self.fitted.fit.correlation),
            "undetermined": self.fitted.fit.undetermined.iter().map(|c| c.iter().map(|(p, share)| json!([p.id(), share])).collect()).collect::<Vec<Value>>(),
            "coloured_residuals": self.fitted.fit.coloured,
            "pieces": self.pieces,
            "intervals_valid": self.is_reproduced(),
            "converged": self.fitted.fit.ending == fit::Ending::Converged,
            "recordings": (0..self.records.len()).map(|i| self.recording_json(i)).collect::<Vec<_>>(),
        })
    }

    fn recording_json(&self, index: usize) -> Value {
        let side = |side: &Side| {
            let verdict = &side.verdicts[index];
            json!({
                "rmse_rad": side.fit.residuals[index].rmse_rad,
                "noise_rad": side.fit.residuals[index].noise_rad,
                "start_rad_and_rad_s": side.fit.starts[index],
                "reproduced": verdict.is_reproduced(),
                "statement": verdict.statement(),
                "explained": verdict.explained,
                "departs": verdict.departs.map(|d| json!({
                    "angle": d.link + 1, "from_s": d.from_s, "amplitude_rad": d.amplitude_rad, "rms_rad": d.rms_rad,
                    "share_of_windows_after": d.share,
                })),
                "windows": verdict.windows.iter().map(window_json).collect::<Vec<_>>(),
                "peaks": verdict.peaks.iter().map(|peaks| peaks.iter().map(|p| json!({
                    "t_s": p.t_s, "measured_rad": p.measured_rad, "simulated_rad": p.simulated_rad, "lag_s": p.lag_s,
                })).collect::<Vec<_>>()).collect::<Vec<_>>(),
            })
        };
        let record = &self.records[index];
        json!({
            "file": record.path,
            "rows": record.len(),
            "outliers": self.fitted.fit.outliers[index].iter().map(|o| json!({"angle": o.link + 1, "t_s": record.t_s[o.row]})).collect::<Vec<_>>(),
            "pace": self.paces[index].as_ref().map(|pace| json!({
                "seen_hz": pace.seen_hz, "model_hz": pace.model_hz, "ratio": pace.ratio(), "statement": self.pace_statement(index),
            })),
            "fitted": side(&self.fitted),
            "given": side(&self.given),
        })
    }
}

fn window_json(window: &fit::verdict::Window) -> Value {
    json!({
        "from_s": window.from_s,
        "until_s": window.until_s,
        "angles": window.links.iter().map(|l| json!({
            "amplitude_rad": l.amplitude_rad, "rms_rad": l.rms_rad, "lag_s": l.lag_s, "gain": l.gain, "misfit": l.misfit,
        })).collect::<Vec<_>>(),
    })
}

fn rows(matrix: &nalgebra::DMatrix<f64>) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}
