//! `freeswing export`: a table of angles for another program.

use std::path::{Path, PathBuf};

use super::Console;
use crate::error::{Error, Result};
use crate::export::{self, Format};
use crate::output::is_same_file;

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
    /// The table.
    angles: PathBuf,
    /// The file; its extension says the format.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

impl ExportArgs {
    /// Writes the file.
    ///
    /// # Errors
    /// One line: what, where, what to do.
    pub fn run(&self, _console: &Console) -> Result<()> {
        let format = Format::of(&self.out)?;
        if is_same_file(&self.angles, &self.out) {
            let message = format!("{} is the input and would be overwritten; use another name", self.out.display());
            return Err(Error::Option { option: "--out".to_owned(), message });
        }
        if is_account_of(&self.angles, &self.out) {
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

/// Whether a path is that of the account of a table, be it there or not.
fn is_account_of(table: &Path, path: &Path) -> bool {
    let account = table.with_extension("json");
    let folder = |path: &Path| match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    };
    is_same_file(&account, path)
        || (account.file_name() == path.file_name() && is_same_file(&folder(&account), &folder(path)))
}
