//! `freeswing paper`: the published numbers, recomputed.

use std::fmt::Write;
use std::path::PathBuf;

use super::table::{Table, number, paragraph};
use crate::error::Result;
use crate::output::OutputFile;
use crate::paper::{Quantity, Reproduction, Row, Section, Verdict};

/// Recompute the paper's Tables 1 to 4 and Fig. 3, and say what reproduces.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Each number of the paper stands beside the recomputed one with a verdict:
  =  reproduces
  ?  reproduces if …
  ×  cannot be, because …")]
pub struct PaperArgs {
    /// From the spotlight to the strip, which the paper does not give.
    #[arg(long, value_name = "M", default_value_t = 1.0, allow_negative_numbers = true)]
    distance_m: f64,
    /// The same as JSON, in full precision; `-` for standard output instead of the tables.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

impl PaperArgs {
    /// Recomputes and prints.
    ///
    /// # Errors
    /// One line: what, where, what to do.
    pub fn run(&self) -> Result<()> {
        let json = self.json.as_deref().map(OutputFile::create).transpose()?;
        let reproduction = Reproduction::of(self.distance_m)?;
        super::deliver(&reproduction_text(&reproduction), &reproduction, json)
    }
}

fn reproduction_text(reproduction: &Reproduction) -> String {
    let Reproduction { gravity_m_s2, distance_m, .. } = reproduction;
    let mut text = format!("The paper's numbers, recomputed with g = {gravity_m_s2} m/s² and the lamp at {distance_m} m\n");
    text.push_str("=  reproduces    ?  reproduces if …    ×  cannot be, because …\n");
    for section in &reproduction.sections {
        section_text(section, &mut text);
    }
    let [same, conditional, not] = reproduction.counts();
    let _ = writeln!(text, "\n{same} reproduce, {conditional} reproduce under a condition, {not} cannot be.");
    text
}

fn section_text(section: &Section, text: &mut String) {
    let _ = writeln!(text, "\n{}", section.title);
    let mut table = Table::with_sentences(["", "paper", "computed", ""]);
    for row in &section.rows {
        table.row(cells(row));
    }
    text.push_str(&table.text());
    for remark in &section.remarks {
        text.push_str(&paragraph(&format!("  – {remark}"), 4));
    }
}

fn cells(row: &Row) -> [String; 4] {
    let sign = match row.verdict {
        Verdict::Reproduces(_) => "=",
        Verdict::ReproducesIf(_) => "?",
        Verdict::CannotBe(_) => "×",
    };
    let verdict = format!("{sign} {}", row.verdict.because());
    [row.quantity.clone(), row.paper.as_ref().map_or_else(|| "–".to_owned(), quantity), quantity(&row.computed), verdict]
}

fn quantity(quantity: &Quantity) -> String {
    let digits = if quantity.value.abs() < 1e-9 && quantity.value != 0.0 { 1 } else { 4 };
    format!("{} {}", number(quantity.value, digits), quantity.unit).trim_end().to_owned()
}
