//! A table of angles → the file of another program: Parquet, MATLAB, SEP005, and HDF5 if built with the feature `hdf5`.
//!
//! Every column is kept under its name, with its unit at the end of it as in the table. A missing number is NaN, in Parquet null.

#[cfg(feature = "hdf5")]
mod hdf5;
mod matlab;
pub mod parquet;
mod sep005;

use std::path::Path;

use crate::error::{Error, Result};
use crate::output::OutputFile;
use parquet::Cells;

/// A column of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name, the unit at the end.
    pub name: String,
    /// Its values, a row each.
    pub values: Values,
}

/// Values of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Numbers; missing ones are NaN.
    Numbers(Vec<f64>),
    /// Words, such as flags.
    Texts(Vec<String>),
}

impl Column {
    /// Its name and its values, a missing number absent.
    fn cells(&self) -> (String, Cells) {
        let cells = match &self.values {
            Values::Numbers(numbers) => Cells::Numbers(numbers.iter().map(|v| (!v.is_nan()).then_some(*v)).collect()),
            Values::Texts(texts) => Cells::Texts(texts.iter().cloned().map(Some).collect()),
        };
        (self.name.clone(), cells)
    }
}

/// A format, by the extension of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// `.parquet`
    Parquet,
    /// `.mat`, version 5.
    Matlab,
    /// `.json`: time series as the Structural Dynamics in Python community exchanges them (SEP 005).
    Sep005,
    /// `.h5`
    Hdf5,
}

impl Format {
    /// From a file's name.
    ///
    /// # Errors
    /// [`Error::Option`] for another extension, and for HDF5 where the program was built without it.
    pub fn of(path: &Path) -> Result<Self> {
        let refused = |message: String| Err(Error::Option { option: "--out".to_owned(), message });
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        match extension.as_str() {
            "parquet" => Ok(Self::Parquet),
            "mat" => Ok(Self::Matlab),
            "json" => Ok(Self::Sep005),
            "h5" | "hdf5" if cfg!(feature = "hdf5") => Ok(Self::Hdf5),
            "h5" | "hdf5" => refused(format!(
                "{}: this program was built without HDF5; build it with `cargo install --path . --features hdf5` (needs libhdf5), or take .mat or .parquet",
                path.display()
            )),
            _ => refused(format!("{}: name it .parquet, .mat, .json (SEP005) or .h5", path.display())),
        }
    }
}

/// Reads every column of a table.
///
/// # Errors
/// [`Error::Unreadable`], [`Error::EmptyFile`], [`Error::Table`] also of one that has no time stamps, or no rows.
pub fn read(path: &Path) -> Result<Vec<Column>> {
    let (path, bytes) = &crate::input::read(path)?;
    if bytes.is_empty() {
        return Err(Error::EmptyFile { path: path.to_owned() });
    }
    let wrong = |error: csv::Error| Error::Table {
        path: path.to_owned(),
        line: error.position().map(csv::Position::line),
        message: match error.kind() {
            csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                format!("has {len} fields where the header has {expected_len}; mend or remove the row")
            }
            csv::ErrorKind::Utf8 { .. } => "is not UTF-8; give a table of angles".to_owned(),
            _ => error.to_string(),
        },
    };
    let text = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text);
    let names: Vec<String> = reader.headers().map_err(wrong)?.iter().map(str::to_owned).collect();
    let rows = reader.records().collect::<std::result::Result<Vec<_>, _>>().map_err(wrong)?;
    if !names.iter().any(|name| name == "t_s") || rows.is_empty() {
        let lacks = if rows.is_empty() { "it has no rows" } else { "it has no column `t_s`" };
        let message = format!("not a table of angles: {lacks}; give what `track` wrote");
        return Err(Error::Table { path: path.to_owned(), line: None, message });
    }
    let column = |(index, name): (usize, &String)| {
        let fields = || rows.iter().map(|row| row.get(index).unwrap_or_default());
        let number = |field: &str| if field.is_empty() { Some(f64::NAN) } else { field.parse().ok() };
        let is_empty = fields().all(str::is_empty);
        let values = match fields().map(number).collect::<Option<Vec<f64>>>() {
            Some(numbers) if !is_empty => Values::Numbers(numbers),
            _ => Values::Texts(fields().map(str::to_owned).collect()),
        };
        Column { name: name.clone(), values }
    };
    Ok(names.iter().enumerate().map(column).collect())
}

/// Writes columns as a file of another program.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn write(columns: &[Column], path: &Path, format: Format) -> Result<()> {
    let failed = |error: String| Error::unwritable(path, std::io::Error::other(error));
    let bytes = match format {
        Format::Parquet => parquet::bytes("angles", columns.iter().map(Column::cells).collect())
            .map_err(|error| failed(error.to_string()))?,
        Format::Matlab => matlab::bytes(columns),
        Format::Sep005 => sep005::bytes(columns),
        #[cfg(feature = "hdf5")]
        Format::Hdf5 => hdf5::bytes(columns).map_err(|error| failed(error.to_string()))?,
        #[cfg(not(feature = "hdf5"))]
        Format::Hdf5 => return Err(failed("built without HDF5".to_owned())),
    };
    OutputFile::create(path)?.commit(&bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_numbers_or_words() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        std::fs::write(&path, "t_s,theta1_rad,flags\n0,0.1,\n0.1,,lost:m2\n").unwrap();
        let columns = read(&path).unwrap();
        assert_eq!(columns[0].values, Values::Numbers(vec![0.0, 0.1]));
        assert!(matches!(&columns[1].values, Values::Numbers(v) if v[0] == 0.1 && v[1].is_nan()));
        assert_eq!(columns[2].values, Values::Texts(vec![String::new(), "lost:m2".to_owned()]));
        std::fs::write(&path, "t_s,theta1_rad\n0,0.1\n0.1\n").unwrap();
        assert!(
            read(&path)
                .unwrap_err()
                .to_string()
                .ends_with("a.csv:3: has 1 fields where the header has 2; mend or remove the row")
        );
    }

    #[test]
    fn an_extension_says_the_format() {
        assert_eq!(Format::of(Path::new("a.MAT")).unwrap(), Format::Matlab);
        assert!(Format::of(Path::new("a.xlsx")).is_err());
        assert_eq!(Format::of(Path::new("a.h5")).is_ok(), cfg!(feature = "hdf5"));
    }
}
