//! `freeswing export`: a table of angles for another program.

use std::path::PathBuf;

use super::{Console, Target};
use crate::error::{Error, Result};
use crate::export::{self, Format};
use crate::output::is_same_target;

/// Write a table of angles as Parquet, MATLAB, SEP005 or HDF5.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  freeswing export angles.csv --out angles.mat        (MATLAB: load angles.mat)
  freeswing export angles.csv --out angles.parquet    (Python: pandas.read_parquet('angles.parquet'))
  freeswing export angles.csv --out series.json       (SEP005: time series for SDyPy)
  freeswing export angles.csv --out angles.h5         (HDF5, if built with --features hdf5)

Every column keeps its name, with the unit at its end. A missing number is NaN, in Parquet and SEP005 null.")]
pub struct ExportArgs {
    /// The table; `-` for standard input.
    angles: PathBuf,
    /// The file; its extension sets the format.
    #[arg(long, value_name = "FILE")]
    out: Target,
}

impl ExportArgs {
    /// Writes the file.
    ///
    /// # Errors
    /// One line: what, where, what to do.
    pub fn run(&self, _console: &Console) -> Result<()> {
        let format = Format::of(&self.out)?;
        if is_same_target(&self.angles.with_extension("json"), &self.out) {
            let message = format!(
                "{} is the name of the account that `track` writes beside {}; use another name, such as series.json",
                self.out.display(),
                self.angles.display()
            );
            return Err(Error::Option { option: "--out".to_owned(), message });
        }
        export::write(&export::read(&self.angles)?, &self.out, format)
    }
}
