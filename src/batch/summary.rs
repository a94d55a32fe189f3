//! A row a recording, sorted by path, as `summary.csv` and `summary.parquet`.
//!
//! A row is read from the files that stand in the recording's folder, and from nothing else: the order in which recordings were run, on how many cores or machines,
//! and how often the work broke off do not show.

use std::path::Path;
use std::sync::Arc;

use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;
use serde_json::Value;

use super::state::{Finished, Status};
use crate::digits;
use crate::error::{Error, Result};
use crate::output::OutputFile;

/// A row of the summary. What was not found out is missing.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Path below the input folder.
    pub recording: String,
    /// How it ended.
    pub status: Status,
    /// Why it failed or was left out.
    pub reason: String,
    /// The specimen's name.
    pub specimen: Option<String>,
    /// Frames of the recording, rows of a table.
    pub frames: Option<i64>,
    /// From the first stamp to the last.
    pub duration_s: Option<f64>,
    /// Of the slowest mode: frequency…
    pub f1_hz: Option<f64>,
    /// … its standard deviation…
    pub f1_sd_hz: Option<f64>,
    /// … damping ratio…
    pub zeta1: Option<f64>,
    /// … and its standard deviation.
    pub zeta1_sd: Option<f64>,
    /// Of the next mode.
    pub f2_hz: Option<f64>,
    /// Of the next mode.
    pub zeta2: Option<f64>,
    /// Eq. 29.
    pub k_eq_n_per_m: Option<f64>,
    /// Eq. 30.
    pub c_eq_n_s_per_m: Option<f64>,
    /// The joint's spring, as fitted.
    pub k_n_m_per_rad: Option<f64>,
    /// The joint's damper, as fitted.
    pub c_n_m_s_per_rad: Option<f64>,
    /// What the diagnosis says of the base model.
    pub verdict: Option<String>,
    /// The effects it names.
    pub effects: Option<String>,
    /// Their probability.
    pub probability: Option<f64>,
    /// What the base model leaves of what was not fitted, root mean square of all angles…
    pub heldout_before_rad: Option<f64>,
    /// … and what the whole answer leaves.
    pub heldout_after_rad: Option<f64>,
    /// SHA-256 of the recording.
    pub sha256: Option<String>,
    /// The program's.
    pub version: Option<String>,
}

/// A value of a row.
enum Cell {
    Text(Option<String>),
    Count(Option<i64>),
    Number(Option<f64>),
}

impl Row {
    /// Of a recording that was not run.
    pub fn skipped(name: &str, reason: &str) -> Self {
        Self::empty(name, Status::Skipped, reason)
    }

    /// Of a run, from what it left in a folder.
    pub fn of(name: &str, folder: &Path, finished: &Finished) -> Self {
        let [angles, identified, fit, diagnosis] =
            ["angles.json", "identify.json", "fit.json", "diagnosis.json"].map(|file| Json::read(&folder.join(file)));
        let text = |text: &String| (!text.is_empty()).then(|| text.clone());
        let modes = Modes::of(&identified);
        let parameter = |id: &str| fit.number(&["parameters", id, "value"]);
        let held_out = |which: &str| diagnosis.root_mean_square(&["heldout", which]);
        Self {
            specimen: specimen_of(folder),
            frames: angles
                .number(&["time_stamps", "frames"])
                .or_else(|| identified.number(&["record", "rows"]))
                .map(|n| n as i64),
            duration_s: identified.number(&["record", "duration_s"]),
            f1_hz: modes.first(&["frequency_hz", "value"]),
            f1_sd_hz: modes.first(&["frequency_hz", "sd"]),
            zeta1: modes.first(&["damping", "identified", "value"]),
            zeta1_sd: modes.first(&["damping", "identified", "sd"]),
            f2_hz: modes.second(&["frequency_hz", "value"]),
            zeta2: modes.second(&["damping", "identified", "value"]),
            k_eq_n_per_m: identified.number(&["equivalents", "k_eq_n_per_m", "value"]),
            c_eq_n_s_per_m: identified.number(&["equivalents", "c_eq_n_s_per_m", "value"]),
            k_n_m_per_rad: parameter("k_eq_n_m_per_rad"),
            c_n_m_s_per_rad: parameter("c_eq_n_m_s_per_rad"),
            verdict: diagnosis.text(&["verdict", "status"]),
            effects: diagnosis.texts(&["verdict", "effects"]),
            probability: diagnosis.number(&["verdict", "probability"]),
            heldout_before_rad: held_out("baseline_rmse_rad"),
            heldout_after_rad: held_out("augmented_rmse_rad"),
            sha256: text(&finished.fingerprint.recording_sha256),
            version: text(&finished.fingerprint.version),
            ..Self::empty(name, finished.status, &finished.reason)
        }
    }

    fn empty(name: &str, status: Status, reason: &str) -> Self {
        Self {
            recording: name.to_owned(),
            status,
            reason: reason.to_owned(),
            specimen: None,
            frames: None,
            duration_s: None,
            f1_hz: None,
            f1_sd_hz: None,
            zeta1: None,
            zeta1_sd: None,
            f2_hz: None,
            zeta2: None,
            k_eq_n_per_m: None,
            c_eq_n_s_per_m: None,
            k_n_m_per_rad: None,
            c_n_m_s_per_rad: None,
            verdict: None,
            effects: None,
            probability: None,
            heldout_before_rad: None,
            heldout_after_rad: None,
            sha256: None,
            version: None,
        }
    }

    /// The columns in order.
    fn cells(&self) -> Vec<(&'static str, Cell)> {
        let text = |text: &str| Cell::Text(Some(text.to_owned()));
        vec![
            ("recording", text(&self.recording)),
            ("status", text(self.status.id())),
            ("reason", Cell::Text((!self.reason.is_empty()).then(|| self.reason.clone()))),
            ("specimen", Cell::Text(self.specimen.clone())),
            ("frames", Cell::Count(self.frames)),
            ("duration_s", Cell::Number(self.duration_s)),
            ("f1_hz", Cell::Number(self.f1_hz)),
            ("f1_sd_hz", Cell::Number(self.f1_sd_hz)),
            ("zeta1", Cell::Number(self.zeta1)),
            ("zeta1_sd", Cell::Number(self.zeta1_sd)),
            ("f2_hz", Cell::Number(self.f2_hz)),
            ("zeta2", Cell::Number(self.zeta2)),
            ("k_eq_n_per_m", Cell::Number(self.k_eq_n_per_m)),
            ("c_eq_n_s_per_m", Cell::Number(self.c_eq_n_s_per_m)),
            ("k_n_m_per_rad", Cell::Number(self.k_n_m_per_rad)),
            ("c_n_m_s_per_rad", Cell::Number(self.c_n_m_s_per_rad)),
            ("verdict", Cell::Text(self.verdict.clone())),
            ("effects", Cell::Text(self.effects.clone())),
            ("probability", Cell::Number(self.probability)),
            ("heldout_before_rad", Cell::Number(self.heldout_before_rad)),
            ("heldout_after_rad", Cell::Number(self.heldout_after_rad)),
            ("sha256", Cell::Text(self.sha256.clone())),
            ("version", Cell::Text(self.version.clone())),
        ]
    }
}

/// A report of an earlier stage, of which single values are wanted. What is not there is missing.
struct Json(Value);

impl Json {
    fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        Self(serde_json::from_str(&text).unwrap_or_default())
    }

    fn at(&self, keys: &[&str]) -> &Value {
        at(&self.0, keys)
    }

    fn number(&self, keys: &[&str]) -> Option<f64> {
        self.at(keys).as_f64()
    }

    fn text(&self, keys: &[&str]) -> Option<String> {
        self.at(keys).as_str().map(str::to_owned)
    }

    /// Words of a list, with `+` between them.
    fn texts(&self, keys: &[&str]) -> Option<String> {
        let words: Vec<&str> = self.at(keys).as_array()?.iter().filter_map(Value::as_str).collect();
        (!words.is_empty()).then(|| words.join("+"))
    }

    fn root_mean_square(&self, keys: &[&str]) -> Option<f64> {
        let values: Vec<f64> = self.at(keys).as_array()?.iter().filter_map(Value::as_f64).collect();
        let mean = values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64;
        mean.is_finite().then(|| mean.sqrt())
    }
}

/// The specimen's name in the experiment file that a run has left.
fn specimen_of(folder: &Path) -> Option<String> {
    let text = std::fs::read_to_string(folder.join("experiment.toml")).ok()?;
    let table: toml::Table = toml::from_str(&text).ok()?;
    Some(table.get("specimen")?.get("name")?.as_str()?.to_owned())
}

fn at<'v>(value: &'v Value, keys: &[&str]) -> &'v Value {
    keys.iter().fold(value, |value, key| &value[*key])
}

/// The slowest mode and the strongest of the others.
struct Modes<'j> {
    first: Option<&'j Value>,
    second: Option<&'j Value>,
}

impl<'j> Modes<'j> {
    fn of(identified: &'j Json) -> Self {
        let all: Vec<&Value> = identified.at(&["modes"]).as_array().into_iter().flatten().collect();
        let swing = identified.number(&["swing_mode"]).unwrap_or(1.0);
        let is_first = |mode: &&&Value| mode["number"].as_f64() == Some(swing);
        let first = all.iter().find(is_first).copied();
        Self { first, second: all.iter().find(|mode| !is_first(mode)).copied() }
    }

    fn first(&self, keys: &[&str]) -> Option<f64> {
        at(self.first?, keys).as_f64()
    }

    fn second(&self, keys: &[&str]) -> Option<f64> {
        at(self.second?, keys).as_f64()
    }
}

/// Writes both tables into a folder.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn write(folder: &Path, rows: &[Row]) -> Result<()> {
    OutputFile::create(&folder.join("summary.csv"))?.commit(&csv(rows))?;
    let path = folder.join("summary.parquet");
    let bytes = parquet(rows).map_err(|error| Error::unwritable(&path, std::io::Error::other(error)))?;
    OutputFile::create(&path)?.commit(&bytes)
}

fn csv(rows: &[Row]) -> Vec<u8> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let header: Vec<&str> = Row::skipped("", "").cells().into_iter().map(|(name, _)| name).collect();
    // a vector takes all that is written
    let _ = writer.write_record(&header);
    for row in rows {
        let field = |(_, cell): (&str, Cell)| match cell {
            Cell::Text(text) => text.unwrap_or_default(),
            Cell::Count(count) => count.map_or(String::new(), |count| count.to_string()),
            Cell::Number(number) => number.map_or(String::new(), |number| digits::number(number, 8)),
        };
        let _ = writer.write_record(row.cells().into_iter().map(field));
    }
    writer.into_inner().unwrap_or_default()
}

fn parquet(rows: &[Row]) -> parquet::errors::Result<Vec<u8>> {
    let column = |(name, cell): (&str, Cell)| match cell {
        Cell::Text(_) => format!("optional binary {name} (UTF8);"),
        Cell::Count(_) => format!("optional int64 {name};"),
        Cell::Number(_) => format!("optional double {name};"),
    };
    let columns: Vec<String> = Row::skipped("", "").cells().into_iter().map(column).collect();
    let schema = parse_message_type(&format!("message summary {{ {} }}", columns.join(" ")))?;
    let mut bytes = Vec::new();
    let mut file = SerializedFileWriter::new(&mut bytes, Arc::new(schema), Arc::new(WriterProperties::default()))?;
    let mut group = file.next_row_group()?;
    let mut cells: Vec<_> = rows.iter().map(|row| row.cells().into_iter()).collect();
    for _ in 0..columns.len() {
        let column: Vec<Cell> = cells.iter_mut().filter_map(|row| row.next()).map(|(_, cell)| cell).collect();
        write_column(&mut group, column)?;
    }
    group.close()?;
    file.close()?;
    Ok(bytes)
}

/// One column: which rows have a value, and these values.
fn write_column<W: std::io::Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    cells: Vec<Cell>,
) -> parquet::errors::Result<()> {
    let Some(mut column) = group.next_column()? else { return Ok(()) };
    let (mut present, mut texts, mut counts, mut numbers) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let is_text = matches!(cells.first(), Some(Cell::Text(_)));
    let is_count = matches!(cells.first(), Some(Cell::Count(_)));
    for cell in cells {
        let has_value = match cell {
            Cell::Text(value) => value.map(|value| texts.push(ByteArray::from(value.into_bytes()))).is_some(),
            Cell::Count(value) => value.map(|value| counts.push(value)).is_some(),
            Cell::Number(value) => value.map(|value| numbers.push(value)).is_some(),
        };
        present.push(i16::from(has_value));
    }
    if is_text {
        column.typed::<ByteArrayType>().write_batch(&texts, Some(&present), None)?;
    } else if is_count {
        column.typed::<Int64Type>().write_batch(&counts, Some(&present), None)?;
    } else {
        column.typed::<DoubleType>().write_batch(&numbers, Some(&present), None)?;
    }
    column.close()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::state::Fingerprint;

    fn row() -> Row {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write(
            "identify.json",
            r#"{"record": {"rows": 750, "duration_s": 25.0}, "swing_mode": 2, "modes": [
                {"number": 1, "frequency_hz": {"value": 3.25, "sd": 0.1}},
                {"number": 2, "frequency_hz": {"value": 1.5, "sd": 0.01}, "damping": {"identified": {"value": 0.01, "sd": 0.002}}}]}"#,
        );
        write(
            "diagnosis.json",
            r#"{"verdict": {"status": "identified", "effects": ["hinge_coulomb", "air_quadratic"], "probability": 0.97},
                "heldout": {"baseline_rmse_rad": [0.03, 0.04], "augmented_rmse_rad": [0.001, 0.001]}}"#,
        );
        let fingerprint = Fingerprint {
            recording_sha256: "ab12".to_owned(),
            config_sha256: String::new(),
            words: Vec::new(),
            version: "1".to_owned(),
        };
        let finished = Finished { schema: String::new(), fingerprint, status: Status::Done, reason: String::new() };
        Row::of("a/b, c.mp4", folder.path(), &finished)
    }

    #[test]
    fn a_row_is_read_from_the_folder() {
        let row = row();
        assert_eq!((row.f1_hz, row.f2_hz, row.zeta1, row.frames), (Some(1.5), Some(3.25), Some(0.01), Some(750)));
        assert_eq!(row.effects.as_deref(), Some("hinge_coulomb+air_quadratic"));
        assert!((row.heldout_before_rad.unwrap() - (0.00125f64).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn the_header_is_the_contract_s() {
        let text = String::from_utf8(csv(&[row()])).unwrap();
        let mut lines = text.lines();
        assert_eq!(
            lines.next().unwrap(),
            "recording,status,reason,specimen,frames,duration_s,f1_hz,f1_sd_hz,zeta1,zeta1_sd,f2_hz,zeta2,k_eq_n_per_m,c_eq_n_s_per_m,\
             k_n_m_per_rad,c_n_m_s_per_rad,verdict,effects,probability,heldout_before_rad,heldout_after_rad,sha256,version"
        );
        assert!(
            lines.next().unwrap().starts_with("\"a/b, c.mp4\",done,,,750,25.000000,1.5000000,0.010000000,"),
            "{text}"
        );
    }

    #[test]
    fn the_columnar_table_holds_the_same() {
        use parquet::file::reader::{FileReader, SerializedFileReader};
        use parquet::record::RowAccessor;
        let bytes = parquet(&[row(), Row::skipped("z", "not asked for")]).unwrap();
        let path = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(path.path(), bytes).unwrap();
        let reader = SerializedFileReader::new(std::fs::File::open(path.path()).unwrap()).unwrap();
        let rows: Vec<_> = reader.get_row_iter(None).unwrap().map(|row| row.unwrap()).collect();
        assert_eq!((rows.len(), rows[0].len()), (2, 23));
        assert_eq!(rows[0].get_string(0).unwrap(), "a/b, c.mp4");
        assert_eq!((rows[0].get_long(4).unwrap(), rows[0].get_double(6).unwrap()), (750, 1.5));
        assert!(rows[1].get_double(6).is_err());
    }
}
