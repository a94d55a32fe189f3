//! `freeswing paper`: the published numbers, recomputed.

use std::fmt::Write;

use super::table::{Table, number, paragraph};
use super::{Console, Target};
use crate::error::Result;
use crate::output::OutputFile;
use crate::paper::{Quantity, Reproduction, Row, Section, Verdict};

/// Recompute the paper's Tables 1 to 4 and Fig. 3, and say what reproduces.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Each number of the paper stands beside the recomputed one with a verdict: reproduced, reproduced under a condition, or impossible, with
the reason. (A1) to (A12) number errors in the paper.

Example:
  freeswing paper --distance-m 0.8 --json paper.json")]
pub struct PaperArgs {
    /// From the spotlight to the strip, which the paper does not give.
    #[arg(long, value_name = "M", default_value_t = 1.0)]
    distance_m: f64,
    /// The same as JSON, in full precision; `-` for standard output instead of the tables.
    #[arg(long, value_name = "FILE")]
    json: Option<Target>,
}

impl PaperArgs {
    /// Recomputes and prints.
    ///
    /// # Errors
    /// One line: what, where, what to do.
    pub fn run(&self, console: &Console) -> Result<()> {
        let json = self.json.as_deref().map(OutputFile::create).transpose()?;
        let reproduction = Reproduction::of(self.distance_m)?;
        super::deliver(&reproduction_text(&reproduction), &reproduction, json, console)
    }
}

fn reproduction_text(reproduction: &Reproduction) -> String {
    let Reproduction { gravity_m_s2, distance_m, .. } = reproduction;
    let mut text =
        format!("The paper's numbers, recomputed with g = {gravity_m_s2} m/s² and the spotlight at {distance_m} m\n");
    for section in &reproduction.sections {
        section_text(section, &mut text);
    }
    let [same, conditional, not] = reproduction.counts();
    let _ =
        writeln!(text, "\nNumbers that reproduce: {same}; under a condition: {conditional}; that cannot be: {not}.");
    text
}

fn section_text(section: &Section, text: &mut String) {
    let _ = writeln!(text, "\n{}", section.title);
    let mut table = Table::with_sentences(["", "paper", "computed", "", "verdict"]);
    for row in &section.rows {
        table.row(cells(row));
    }
    text.push_str(&table.text());
    for remark in &section.remarks {
        text.push_str(&paragraph("  – ", remark));
    }
}

fn cells(row: &Row) -> [String; 5] {
    let verdict = match (&row.verdict, row.verdict.because()) {
        (Verdict::Reproduces(_), "") => "reproduces".to_owned(),
        (Verdict::Reproduces(_), text) => format!("reproduces: {text}"),
        (Verdict::ReproducesIf(_), text) => format!("reproduces if {text}"),
        (Verdict::CannotBe(_), text) => format!("cannot be: {text}"),
    };
    let unit = match row.paper {
        Some(paper) if paper.unit != row.computed.unit => format!("{} | {}", paper.unit, row.computed.unit),
        _ => row.computed.unit.to_owned(),
    };
    let paper = row.paper.as_ref().map_or_else(|| "–".to_owned(), value);
    [row.quantity.clone(), paper, value(&row.computed), unit, verdict]
}

fn value(quantity: &Quantity) -> String {
    // what rounding leaves of nothing
    if quantity.value.abs() < 1e-12 {
        return "0".to_owned();
    }
    let (shortest, rounded) = (quantity.value.to_string(), number(quantity.value, 5));
    if shortest.len() < rounded.len() { shortest } else { rounded }
}
