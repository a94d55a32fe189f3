//! `freeswing laser`: a displacement record of a strip under a lamp.

use std::fmt::Write;
use std::path::PathBuf;

use super::table::{Table, number, paragraph};
use super::{Console, Target};
use crate::error::Result;
use crate::laser::{Analysis, LaserRecord, Report, analyse, plot};
use crate::output::OutputFile;
use crate::report::figure;

/// Find the push of light in a displacement record, and what else it holds.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The record is a table of times and displacements with commas, semicolons or tabs, with a header or without. [laser] of the experiment
file says which column, the sensor's point, range and resolution; [light] the lamp and, if known, when it goes on, off, on, …

Examples:
  freeswing laser record.csv --config experiment.toml
  freeswing laser record.csv --config experiment.toml --json laser.json --figure laser.svg")]
pub struct LaserArgs {
    /// Table of times and displacements; `-` is standard input.
    #[arg(value_name = "RECORD")]
    record: PathBuf,
    /// The experiment file: specimen, [light], [laser].
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Write all of it as JSON; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<Target>,
    /// Draw record and answer as SVG; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    figure: Option<Target>,
    /// Nothing on standard output.
    #[arg(long)]
    quiet: bool,
}

impl LaserArgs {
    /// Analyses and prints.
    ///
    /// # Errors
    /// One line: what, where, what to do.
    pub fn run(&self, console: &Console) -> Result<()> {
        let experiment = super::read_strip(&self.config, console)?;
        let record = LaserRecord::read(&self.record, &experiment.laser.clone().unwrap_or_default())?;
        console.warnings(&record.warnings);
        let json = self.json.as_deref().map(OutputFile::create).transpose()?;
        let drawing = self.figure.as_deref().map(OutputFile::create).transpose()?;
        let analysis = analyse(&record, &experiment)?;
        let report = Report::of(&analysis, &record, &experiment);
        let alone = drawing.as_ref().is_some_and(OutputFile::is_standard_output);
        let text = if self.quiet || alone { String::new() } else { page(&report, &analysis) };
        if let Some(file) = drawing {
            file.commit(figure::svg(&plot(&analysis, &report)).as_bytes())?;
        }
        super::deliver(&text, &report, json, console)
    }
}

/// Micrometres.
fn um(value_m: f64, digits: usize) -> String {
    number(1e6 * value_m, digits)
}

fn page(report: &Report, analysis: &Analysis) -> String {
    let push = &report.push_m;
    let mut text = format!("{}\n\n", report.specimen);
    text.push_str(&paragraph(
        "",
        &format!(
            "Push of light: {} µm, between {} and {} µm (95 %), at the sensor's point; a push of {} µm could have been seen.",
            um(push.value, 4),
            um(push.interval[0], 4),
            um(push.interval[1], 4),
            um(push.detectable, 2)
        ),
    ));
    text.push_str(&paragraph("", &report.verdict.statement));
    if let Some(decides) = report.verdict.to_decide {
        text.push_str(&paragraph("To decide: ", &format!("{decides}.")));
    }
    let _ = writeln!(text);
    text.push_str(&effects(report));
    let _ = writeln!(text);
    text.push_str(&surroundings(report, analysis));
    text.push_str(&surface(report));
    for assumed in &report.assumes {
        text.push_str(&paragraph("Assumed: ", &format!("{assumed}.")));
    }
    text
}

fn effects(report: &Report) -> String {
    let mut table =
        Table::with_sentences(["beside the push", "probability", "would be seen from", "", "value, if present"]);
    for found in &report.effects {
        let smallest =
            report.detectable.get(found.effect.id()).map_or_else(|| "–".to_owned(), |limit| um(limit.smallest, 2));
        let numbers: Vec<String> = found
            .parameters
            .iter()
            .filter(|_| found.probability > 0.01)
            .map(|q| match q.unit {
                "m" => format!("{} {} ± {} µm", q.key.trim_end_matches("_m"), um(q.value, 3), um(q.sd, 2)),
                unit => format!("{} {} ± {} {unit}", q.key, number(q.value, 3), number(q.sd, 2)),
            })
            .collect();
        table.row([
            found.effect.id().to_owned(),
            format!("{:.3}", found.probability),
            smallest,
            "µm".to_owned(),
            numbers.join(", "),
        ]);
    }
    table.text()
}

fn surroundings(report: &Report, analysis: &Analysis) -> String {
    let mut text = String::new();
    let edges: Vec<String> = report.lamp.edges_s.iter().map(|t| format!("{t:.2}")).collect();
    let found =
        if report.lamp.found { "found in the record" } else { "the given times, adjusted to the steps in the record" };
    text.push_str(&paragraph("Lamp on, off, …: ", &format!("{} s, {found}.", edges.join(", "))));
    let each: Vec<String> =
        report.lamp.push_of_each_m.iter().map(|q| format!("{} ± {}", um(q.value, 3), um(q.sd, 2))).collect();
    text.push_str(&paragraph("Push of each cycle: ", &format!("{} µm.", each.join(", "))));
    let swings: Vec<String> =
        report.swings.iter().map(|s| format!("{:.4} Hz, damping ratio {}", s.hz, number(s.damping_ratio, 2))).collect();
    text.push_str(&paragraph("Swings: ", &format!("{}.", swings.join("; "))));
    text.push_str(&paragraph(
        "Noise of a sample: ",
        &format!(
            "{} µm; {} samples over {:.1} s.",
            um(report.noise.sample_m, 2),
            report.samples,
            analysis.grid.duration_s()
        ),
    ));
    if let Some(proof) = &report.heldout {
        text.push_str(&paragraph(
            "Cycles not fitted: ",
            &format!(
                "from {:.1} s on the push alone leaves {} µm, with the effects named {} µm.{}",
                proof.from_s,
                um(proof.baseline_rmse_m, 3),
                um(proof.augmented_rmse_m, 3),
                if proof.is_against() {
                    " The push alone predicts these cycles better than the named effects: do not rely on the names, and check laser.column and its unit."
                } else {
                    ""
                }
            ),
        ));
    }
    text
}

fn surface(report: &Report) -> String {
    if let Some(missing) = &report.reflectivity_missing {
        return paragraph("Reflectivity: ", &format!("{missing}."));
    }
    let Some(figure) = &report.reflectivity else { return String::new() };
    let [black, mirror] = figure.possible.map(|v| number(v, 3));
    let mut words = format!(
        "the push means a force of {} N, which is {} times what a black surface takes from straight light, between {} and {} (95 %)",
        number(figure.force_n, 4),
        number(figure.momentum_coefficient, 4),
        number(figure.interval[0], 4),
        number(figure.interval[1], 4)
    );
    if let Some(stated) = figure.stated {
        let _ = write!(words, "; the stated shares give {}", number(stated, 4));
    }
    words.push_str(if figure.can_be { "." } else { "; that cannot be reflectivity alone, which gives" });
    if !figure.can_be {
        let _ = write!(words, " {black} (black) to {mirror} (mirror): check power, distance, window and mass.");
    }
    paragraph("Reflectivity: ", &words)
}
