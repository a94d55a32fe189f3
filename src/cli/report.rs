//! `freeswing report`: the page, again, from what a run left.

use std::path::PathBuf;

use super::Console;
use crate::error::Result;
use crate::report;

/// Write the page and its figures from what a run left in a folder.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  freeswing report results/kapton
  freeswing report .

Reads angles.csv, angles.json, identify.json, fit.json, diagnosis.json, experiment.toml, figures/fit.csv, figures/diagnosis.csv, figures/where.csv,
overlay.mp4 and log.txt, as far as they are there. Writes report.html, one file to send or to keep, and each of its figures in figures/ as SVG, PNG and CSV.
Figures of the page that stood there before and are no longer made are removed.")]
pub struct ReportArgs {
    /// The folder of a run.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Nothing on standard output.
    #[arg(long)]
    quiet: bool,
}

impl ReportArgs {
    /// Writes the page.
    ///
    /// # Errors
    /// One line: what, where, what to do.
    pub fn run(&self, console: &Console) -> Result<()> {
        report::write(&self.folder)?;
        if self.quiet { Ok(()) } else { console.print(&format!("{}\n", self.folder.join("report.html").display())) }
    }
}
