//! `freeswing diagnose`: where simulation and recording differ, and what physics was left out.

use std::fmt::Write;
use std::path::PathBuf;

use serde_json::{Map, Value, json};

use super::Bar;
use super::figure::Figure;
use super::table::{Table, number, paragraph};
use crate::diagnose::{
    self, Cause, Detectable, Diagnosis, MAIN_EFFECTS, MissingTorque, Phase, Place, Refit, Status, Weighed, locate,
    verdict,
};
use crate::error::{Error, Result};
use crate::experiment::Experiment;
use crate::model::{ForwardModel, Parameter};
use crate::output::OutputFile;

/// Longest planned recording.
const MOST_ROWS: f64 = 1e6;
/// A joint that yields before this part of its largest bend is dry.
const DRY_SHARE: f64 = 0.01;
/// Candidates listed on the page.
const LISTED: usize = 6;
/// Candidates written to the file.
const WRITTEN: usize = 25;

/// Say where the model differs from recordings, name the physics left out, and prove it.
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
    json: Option<PathBuf>,
    /// Draw before and after as SVG; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
    /// Use rows from this stamp on.
    #[arg(long, value_name = "S", default_value_t = f64::NEG_INFINITY, hide_default_value = true, allow_negative_numbers = true)]
    from: f64,
    /// Use rows before this stamp.
    #[arg(long, value_name = "S", default_value_t = f64::INFINITY, hide_default_value = true, allow_negative_numbers = true)]
    until: f64,
    /// Predict a single recording from this stamp on, fitted before it [default: two thirds through it].
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    predict_from: Option<f64>,
    /// Judge the base model by this many recordings made from it and fitted anew, not by their residuals to first order.
    #[arg(long, value_name = "N", default_value_t = 0)]
    bootstraps: usize,
    /// Before an experiment: what a recording of the file's release would show of each effect, and what it would confuse.
    #[arg(long)]
    detectable: bool,
    /// Length of the planned recording.
    #[arg(long, value_name = "S", default_value_t = 60.0, requires = "detectable")]
    duration: f64,
    /// Rows a second of the planned recording.
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
    pub fn run(&self) -> Result<()> {
        let experiment = Experiment::read(&self.config)?;
        if self.detectable {
            return self.plan(&experiment);
        }
        let marks = ForwardModel::of(&experiment)?.chain().groups().len();
        let records = super::recordings(&self.angles, marks, (self.from, self.until))?;
        let json = self.json.as_deref().map(OutputFile::create).transpose()?;
        let figure = self.figure.as_deref().map(OutputFile::create).transpose()?;
        let bar = Bar::of_fits(self.quiet);
        let prepared = diagnose::prepare(&records, &experiment)?;
        let diagnosis = diagnose::diagnose(&prepared, &experiment, &self.options(), &bar)?;
        drop(bar);
        let report = Report { diagnosis: &diagnosis, specimen: &experiment.specimen.name };
        let alone = figure.as_ref().is_some_and(OutputFile::is_standard_output);
        let text = if self.quiet || alone { String::new() } else { report.text() };
        if let Some(file) = figure {
            file.commit(Figure::of(&diagnosis, &prepared, &experiment)?.svg().as_bytes())?;
        }
        super::deliver(&text, &report.json(), json)
    }
}

impl DiagnoseArgs {
    fn options(&self) -> diagnose::Options {
        diagnose::Options { bootstraps: self.bootstraps, predict_from_s: self.predict_from }
    }

    /// What a planned recording could show.
    fn plan(&self, experiment: &Experiment) -> Result<()> {
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
        let text = if self.quiet { String::new() } else { heading + &limits_table(&limits) };
        super::deliver(&text, &json!({"schema": "freeswing.diagnosis/1", "detectable": limits_json(&limits)}), json)
    }
}

fn limits_table(limits: &[Detectable]) -> String {
    let mut table = Table::new(["effect", "from", "named from", "unit", "not told from"]);
    for limit in limits {
        let amount = |value: f64| if value.is_finite() { number(value, 2) } else { "never".to_owned() };
        table.row([
            limit.cause.id().to_owned(),
            amount(limit.smallest),
            amount(limit.named),
            limit.parameter.unit().to_owned(),
            names(&limit.confused_with, ""),
        ]);
    }
    table.text()
}

fn limits_json(limits: &[Detectable]) -> Value {
    let one = |d: &Detectable| {
        let value = json!({
            "smallest": d.smallest.is_finite().then_some(d.smallest),
            "named_from": d.named.is_finite().then_some(d.named),
            "unit": d.parameter.unit(),
            "confused_with": d.confused_with.iter().map(|c| c.id()).collect::<Vec<_>>(),
        });
        (d.cause.id().to_owned(), value)
    };
    Value::Object(limits.iter().map(one).collect())
}

struct Report<'a> {
    diagnosis: &'a Diagnosis<'a>,
    specimen: &'a str,
}

impl Report<'_> {
    fn text(&self) -> String {
        let mut text = format!("{}\n\n", self.specimen);
        text.push_str(&paragraph("", &self.statement()));
        text.push_str(&paragraph("", &self.where_statement()));
        if let Some(advice) = &self.diagnosis.verdict.to_decide {
            text.push_str(&paragraph("", &format!("To decide: {advice}.")));
        }
        text.push('\n');
        // where the names stand although more is missing, they are weighed among themselves
        let among = verdict::is_beyond_noise(self.diagnosis.named());
        let probability = if among { "among these" } else { "probability" };
        let mut table = Table::new(["the base model and", probability, "left mrad", "coefficient", "sd", "unit"]);
        for weighed in self.diagnosis.weighed.iter().take(LISTED) {
            let left = rmse_rad(&weighed.fit).iter().map(|r| number(1e3 * r, 3)).collect::<Vec<_>>().join(" ");
            let probability = if among { weighed.if_named } else { weighed.probability };
            let mut first =
                [names(&weighed.fit.hypothesis.causes, "nothing else"), number(probability.max(0.0), 3), left];
            for (parameter, value, sd) in coefficients(&weighed.fit) {
                let [name, probability, left] = std::mem::take(&mut first);
                table.row([name, probability, left, number(value, 4), number(sd, 2), parameter.unit().to_owned()]);
            }
            if !first[0].is_empty() {
                let [name, probability, left] = first;
                table.row([name, probability, left]);
            }
        }
        table.row(["something not in the table".to_owned(), number(self.diagnosis.verdict.unknown, 3)]);
        text.push_str(&table.text());
        self.proof(&mut text);
        self.limits(&mut text);
        text
    }

    fn proof(&self, text: &mut String) {
        let Some(held_out) = &self.diagnosis.held_out else { return };
        let noise_rad = &self.diagnosis.ground.noise[held_out.record].sd_rad;
        let _ = writeln!(text, "\nFitted before {:.2} s, predicted from there on:", held_out.from_s);
        let mut table = Table::new(["", "noise mrad", "base model leaves", "with the effects named"]);
        for link in 0..noise_rad.len() {
            let milli = |rad: f64| number(1e3 * rad, 3);
            table.row([
                format!("θ{}", link + 1),
                milli(noise_rad[link]),
                milli(held_out.baseline_rad[link]),
                milli(held_out.augmented_rad[link]),
            ]);
        }
        text.push_str(&table.text());
    }

    fn limits(&self, text: &mut String) {
        if self.diagnosis.verdict.status != Status::Adequate || self.diagnosis.detectable.is_empty() {
            return;
        }
        text.push_str("\nThis recording would have shown\n");
        text.push_str(&limits_table(&self.diagnosis.detectable));
    }

    fn statement(&self) -> String {
        let verdict = &self.diagnosis.verdict;
        let percent = 1e2 * verdict.probability;
        match verdict.status {
            Status::Adequate => format!(
                "Nothing is missing that this recording could show: the base model leaves only noise ({percent:.0} %)."
            ),
            Status::Unknown => {
                let named = &self.diagnosis.weighed[0];
                let causes = &named.fit.hypothesis.causes;
                let nearest = if causes.is_empty() {
                    "; no law of the table comes nearer than the base model".to_owned()
                } else {
                    let [comes, explains] =
                        if causes.len() == 1 { ["comes", "it explains"] } else { ["come", "they explain"] };
                    format!(
                        ". Of the table {} {comes} nearest ({:.0} % among the named): {explains} {:.1} % of what the base model leaves beyond the noise",
                        words(causes),
                        1e2 * named.if_named,
                        1e2 * self.diagnosis.explained()
                    )
                };
                format!(
                    "Something is missing that is not in the table of effects ({percent:.0} %): no named law, nor several of them, leaves only noise{nearest}."
                )
            }
            Status::Identified => {
                format!("Missing: {} ({percent:.0} %).{}{}", words(&verdict.effects), self.remark(), self.more())
            }
            Status::Ambiguous => {
                let others = if verdict.class.len() > verdict.effects.len() {
                    format!(", but the recording does not tell it from others: {}", names(&verdict.class, ""))
                } else {
                    format!(", or something outside the table that it resembles ({:.0} %)", 1e2 * verdict.unknown)
                };
                let (effects, remark, more) = (words(&verdict.effects), self.remark(), self.more());
                format!("Missing: most likely {effects} ({percent:.0} %){others}.{remark}{more}")
            }
        }
    }

    /// What names that leave far more than noise do not explain.
    fn more(&self) -> String {
        let fit = self.diagnosis.named();
        if !verdict::is_beyond_noise(fit) {
            return String::new();
        }
        format!(
            " Of the table they come nearest and explain {:.1} % of what the base model leaves, but what is left is still {:.0} times the noise: something that is \
             not in the table is missing beside them, or in their place.",
            1e2 * self.diagnosis.explained(),
            verdict::over_noise(fit)
        )
    }

    /// What a law's coefficients say beside their values.
    fn remark(&self) -> &'static str {
        let dry_rad = DRY_SHARE * self.diagnosis.ground.largest_bend_rad();
        match self.diagnosis.named().value(Parameter::HysteresisYield) {
            Some(yield_rad) if yield_rad < dry_rad => {
                " The joint yields at next to no angle: that is dry friction in it."
            }
            _ => "",
        }
    }

    fn phase(&self) -> Option<Phase> {
        match self.diagnosis.verdict.status {
            Status::Adequate => None,
            Status::Unknown => {
                let of_torque = self.diagnosis.missing_torque.as_ref().and_then(|t| t.phase);
                of_torque.or(self.diagnosis.departure.goes_with)
            }
            _ => self.diagnosis.named_effects().first().copied().and_then(Phase::of),
        }
    }

    fn where_statement(&self) -> String {
        let departure = &self.diagnosis.departure;
        let Some(place) = self.diagnosis.place() else { return String::new() };
        let mut statement = match place {
            Place::Hinge => "It acts at the hinge",
            Place::Joint => "It acts in the joint",
            Place::Air => "It acts from outside along the strip",
            Place::Camera => "It is an error of the camera, not of the model",
        }
        .to_owned();
        if let Some(phase) = self.phase().filter(|_| place != Place::Camera) {
            let _ = write!(statement, ", in phase with the {}", phase.id());
        }
        if let (Some([from_s, until_s]), Some([least, most])) = (departure.time_s, departure.amplitude_rad) {
            let _ = write!(
                statement,
                "; the base model departs from {from_s:.2} s to {until_s:.2} s, at amplitudes of {least:.3} to {most:.3} rad"
            );
        }
        if let Some(torque) = self.diagnosis.missing_torque.as_ref().filter(|t| t.place != Place::Camera) {
            let _ = write!(statement, ". {}", words_of_torque(torque));
        }
        let shares = self.diagnosis.energy_shares;
        if shares.iter().sum::<f64>() > 0.0 {
            let _ = write!(
                statement,
                ". Of the energy lost {:.0} % go at the hinge, {:.0} % in the joint, {:.0} % to the air",
                1e2 * shares[0],
                1e2 * shares[1],
                1e2 * shares[2]
            );
        }
        statement.push('.');
        statement
    }

    fn json(&self) -> Value {
        let diagnosis = self.diagnosis;
        let null = diagnosis.null();
        let verdict = &diagnosis.verdict;
        let departure = &diagnosis.departure;
        // the format gives two names; what a rig has beside them stands by itself
        let explaining = diagnosis.named_effects();
        let is_main = |cause: &&Cause| explaining.iter().take(MAIN_EFFECTS).any(|main| main == *cause);
        let (effects, further): (Vec<&Cause>, Vec<&Cause>) = verdict.effects.iter().partition(is_main);
        let shares: Map<String, Value> =
            Place::OF_LOSSES.iter().zip(diagnosis.energy_shares).map(|(p, s)| (p.id().to_owned(), json!(s))).collect();
        json!({
            "schema": "freeswing.diagnosis/1",
            "specimen": self.specimen,
            "baseline": {
                "parameters": parameters_json(null, &null.problem.free),
                "rmse_rad": rmse_rad(null),
                "noise_rad": diagnosis.ground.noise[0].sd_rad,
                "noise_correlation": diagnosis.ground.noise[0].colour.iter().map(|c| c.rho).collect::<Vec<_>>(),
                "noise_share_correlated": diagnosis.ground.noise[0].colour.iter().map(|c| c.share).collect::<Vec<_>>(),
                "noise_correlation_across": diagnosis.ground.noise[0].across,
                "adequate": verdict.status == Status::Adequate,
                "p_value": diagnosis.p_value,
            },
            "where": {
                "place": self.diagnosis.place().map(Place::id),
                "energy_share": shares,
                "time_s": departure.time_s,
                "amplitude_rad": departure.amplitude_rad,
                "phase": self.phase().map(Phase::id),
                "frequency_hz": departure.frequency_hz,
                "statement": self.where_statement(),
                "missing_torque": diagnosis.missing_torque.as_ref().map(|m| json!({
                    "place": m.place.id(), "rms": m.rms, "unit": if m.place == Place::Camera { "rad" } else { "N m" }, "phase": m.phase.map(Phase::id),
                    "frequency_hz": m.frequency_hz, "energy_share": m.energy_share,
                })),
                "named_torque_n_m": diagnosis.added_torque_n_m,
                "unknown": diagnosis.unknowns.iter().map(|u| json!({"place": u.place().id(), "form": u.form.id(), "size": u.size, "log_likelihood_gain": u.gain, "tried": u.tried})).collect::<Vec<_>>(),
            },
            "candidates": diagnosis.weighed.iter().take(WRITTEN).map(candidate_json).collect::<Vec<_>>(),
            "verdict": {
                "status": verdict.status.id(),
                "effects": effects.iter().map(|c| c.id()).collect::<Vec<_>>(),
                "further_effects": further.iter().map(|c| c.id()).collect::<Vec<_>>(),
                "class": verdict.class.iter().map(|c| c.id()).collect::<Vec<_>>(),
                "probability": verdict.probability,
                "class_probability": verdict.class_probability,
                "unknown_probability": verdict.unknown,
                "statement": self.statement(),
                "to_decide": verdict.to_decide,
            },
            "heldout": diagnosis.held_out.as_ref().map(|h| {
                let recording = &null.problem.records[h.record].path;
                json!({
                    "from_s": h.from_s, "recording": recording,
                    "baseline_rmse_rad": h.baseline_rad, "augmented_rmse_rad": h.augmented_rad,
                })
            }),
            "detectable": limits_json(&diagnosis.detectable),
        })
    }
}

/// What the smoothed torque says by itself.
fn words_of_torque(torque: &MissingTorque) -> String {
    let place = match torque.place {
        Place::Hinge => "at the hinge",
        Place::Joint => "in the joint",
        Place::Air | Place::Camera => "along the strip",
    };
    let mut words = format!("A torque without a law would do {place}, of {} N m rms", number(torque.rms, 2));
    if let Some(hz) = torque.frequency_hz {
        let _ = write!(words, ", strongest at {hz:.2} Hz");
    }
    if let Some(share) = torque.energy_share {
        let _ = write!(words, ", that takes {:.0} % of the energy lost", 1e2 * share);
    }
    words
}

fn names(causes: &[Cause], none: &str) -> String {
    if causes.is_empty() { none.to_owned() } else { causes.iter().map(|c| c.id()).collect::<Vec<_>>().join(", ") }
}

fn words(causes: &[Cause]) -> String {
    let words: Vec<String> = causes.iter().map(|c| format!("{} ({})", c.words(), c.id())).collect();
    match &words[..] {
        [first @ .., before, last] => [first, &[format!("{before} and {last}")]].concat().join(", "),
        few => few.concat(),
    }
}

fn rmse_rad(fit: &Refit<'_>) -> Vec<f64> {
    locate::residuals(fit, 0).map(|r| r.rmse_rad).unwrap_or_default()
}

/// Coefficients of the added effects with their standard deviations.
fn coefficients(fit: &Refit<'_>) -> Vec<(Parameter, f64, f64)> {
    let added = fit.added();
    let covariance = fit.covariance(&added);
    let of = |(i, p): (usize, &Parameter)| (*p, fit.value(*p).unwrap_or(0.0), covariance[(i, i)].sqrt());
    added.iter().enumerate().map(of).collect()
}

fn parameters_json(fit: &Refit<'_>, of: &[Parameter]) -> Value {
    let covariance = fit.covariance(of);
    let one = |(i, p): (usize, &Parameter)| {
        let value = json!({"value": fit.value(*p), "sd": covariance[(i, i)].sqrt(), "unit": p.unit()});
        (p.id().to_owned(), value)
    };
    Value::Object(of.iter().enumerate().map(one).collect())
}

fn candidate_json(weighed: &Weighed<'_>) -> Value {
    let fit = &weighed.fit;
    let values: usize = fit.problem.records.iter().map(|r| r.values(0..r.len())).sum();
    json!({
        "effects": fit.hypothesis.causes.iter().map(|c| c.id()).collect::<Vec<_>>(),
        "probability": weighed.probability,
        "probability_if_named": weighed.if_named,
        "parameters": parameters_json(fit, &fit.added()),
        "dropped_at_s": fit.hypothesis.dropped.map(|d| d.1),
        "rmse_rad": rmse_rad(fit),
        "chi2": fit.chi2,
        "bic": fit.chi2 + fit.x.len() as f64 * (values as f64).ln(),
    })
}
