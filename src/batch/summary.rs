//! A row a recording, sorted by path, as `summary.csv` and `summary.parquet`.
//!
//! A row is read from the files that stand in the recording's folder, and from nothing else: the order in which recordings were run, on how many cores or machines,
//! and how often the work broke off do not show.

use std::path::Path;

use super::layers::specimen_name;
use super::state::{Finished, Status};
use crate::digits;
use crate::error::{Error, Result};
use crate::export::parquet::{self as columnar, Cells};
use crate::output::OutputFile;
use crate::report::left::{Diagnosed, Fitted, Identified, Mode, Track, report_of};

/// A row of the summary. What was not found out is missing.
#[derive(Debug, Clone, Default, PartialEq)]
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
    /// … half of its 95 % interval, for the page alone…
    pub f1_half_hz: Option<f64>,
    /// … damping ratio…
    pub zeta1: Option<f64>,
    /// … its standard deviation…
    pub zeta1_sd: Option<f64>,
    /// … and half of its 95 % interval, for the page alone.
    pub zeta1_half: Option<f64>,
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

impl Cell {
    fn text(self) -> Option<String> {
        if let Self::Text(text) = self { text } else { None }
    }

    fn count(self) -> Option<i64> {
        if let Self::Count(count) = self { count } else { None }
    }

    fn number(self) -> Option<f64> {
        if let Self::Number(number) = self { number } else { None }
    }
}

impl Row {
    /// Of a recording that was not run.
    pub fn skipped(name: &str, reason: &str) -> Self {
        Self::empty(name, Status::Skipped, reason)
    }

    /// Of a run, from what it left in a folder.
    pub fn of(name: &str, folder: &Path, finished: &Finished) -> Self {
        let track: Option<Track> = report_of(&folder.join("angles.json"));
        let identified: Option<Identified> = report_of(&folder.join("identify.json"));
        let fit: Fitted = report_of(&folder.join("fit.json")).unwrap_or_default();
        let diagnosis: Diagnosed = report_of(&folder.join("diagnosis.json")).unwrap_or_default();
        let rows = identified.as_ref().map(|own| own.record.rows);
        let frames = track.map(|own| own.time_stamps.frames).or(rows).map(|count| count as i64);
        let identified = identified.unwrap_or_default();
        // the slowest mode and the strongest of the others
        let slowest = identified.swing_mode.unwrap_or(1);
        let first = identified.modes.iter().find(|mode| mode.number == slowest);
        let second = identified.modes.iter().find(|mode| mode.number != slowest);
        let frequency = |mode: Option<&Mode>| mode.map(|mode| mode.frequency_hz);
        let damping = |mode: Option<&Mode>| mode.and_then(|mode| mode.damping.identified);
        let equivalents = identified.equivalents.unwrap_or_default();
        let parameter = |id: &str| fit.parameters.get(id).and_then(|own| own.value);
        let held_out = diagnosis.heldout.unwrap_or_default();
        Self {
            specimen: std::fs::read_to_string(folder.join("experiment.toml")).ok().as_deref().and_then(specimen_name),
            frames,
            duration_s: identified.record.duration_s,
            f1_hz: frequency(first).and_then(|own| own.value),
            f1_sd_hz: frequency(first).and_then(|own| own.sd),
            f1_half_hz: frequency(first).and_then(|own| own.half()),
            zeta1: damping(first).and_then(|own| own.value),
            zeta1_sd: damping(first).and_then(|own| own.sd),
            zeta1_half: damping(first).and_then(|own| own.half()),
            f2_hz: frequency(second).and_then(|own| own.value),
            zeta2: damping(second).and_then(|own| own.value),
            k_eq_n_per_m: equivalents.k_eq_n_per_m.value,
            c_eq_n_s_per_m: equivalents.c_eq_n_s_per_m.and_then(|own| own.value),
            k_n_m_per_rad: parameter("k_eq_n_m_per_rad"),
            c_n_m_s_per_rad: parameter("c_eq_n_m_s_per_rad"),
            verdict: word(&diagnosis.verdict.status),
            effects: word(&diagnosis.verdict.effects.join("+")),
            probability: diagnosis.verdict.probability,
            heldout_before_rad: root_mean_square(&held_out.baseline_rmse_rad),
            heldout_after_rad: root_mean_square(&held_out.augmented_rmse_rad),
            sha256: word(&finished.fingerprint.recording_sha256),
            version: word(&finished.fingerprint.version),
            ..Self::empty(name, finished.status, &finished.reason)
        }
    }

    fn empty(name: &str, status: Status, reason: &str) -> Self {
        Self { recording: name.to_owned(), status, reason: reason.to_owned(), ..Self::default() }
    }

    /// The columns in order.
    fn cells(&self) -> Vec<(&'static str, Cell)> {
        let text = |text: &str| Cell::Text(Some(text.to_owned()));
        let reason = match self.status {
            // as its command alone prints it
            Status::Failed => Some(format!("error: {}", self.reason)),
            _ => (!self.reason.is_empty()).then(|| self.reason.clone()),
        };
        vec![
            ("recording", text(&self.recording)),
            ("status", text(self.status.id())),
            ("reason", Cell::Text(reason)),
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

/// Root mean square of the values that there are.
fn root_mean_square(values: &[Option<f64>]) -> Option<f64> {
    let values: Vec<f64> = values.iter().copied().flatten().collect();
    let mean = values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64;
    mean.is_finite().then(|| mean.sqrt())
}

/// What is no empty word.
fn word(text: &str) -> Option<String> {
    (!text.is_empty()).then(|| text.to_owned())
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
    let header: Vec<&str> = Row::default().cells().into_iter().map(|(name, _)| name).collect();
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
    let mut left: Vec<_> = rows.iter().map(|row| row.cells().into_iter()).collect();
    let column = |(name, kind): (&'static str, Cell)| {
        let cells = left.iter_mut().filter_map(Iterator::next).map(|(_, cell)| cell);
        let cells = match kind {
            Cell::Text(_) => Cells::Texts(cells.map(Cell::text).collect()),
            Cell::Count(_) => Cells::Counts(cells.map(Cell::count).collect()),
            Cell::Number(_) => Cells::Numbers(cells.map(Cell::number).collect()),
        };
        (name.to_owned(), cells)
    };
    columnar::bytes("summary", Row::default().cells().into_iter().map(column).collect())
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
