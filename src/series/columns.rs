//! The columns of a table, its rows, and what is wrong with them in words.

use std::path::Path;

use super::{DISPLACEMENT, Measured};
use crate::error::{Error, Result};

/// Names of columns that hold thousandths of what is wanted.
const THOUSANDTHS: [&str; 5] = ["t_ms", "time_ms", "theta1_mrad", "theta2_mrad", "theta3_mrad"];

/// Where each quantity stands.
pub struct Columns {
    /// Of the time stamps.
    pub t: usize,
    /// Of each link.
    pub theta: Vec<usize>,
    /// Of its standard deviation.
    pub sd: Vec<Option<usize>>,
    /// What they hold.
    pub measured: Measured,
}

impl Columns {
    /// By the names in the header.
    pub fn of(header: &csv::StringRecord, table: &Table, may_be_displacement: bool) -> Result<Self> {
        let names: Vec<&str> = header.iter().collect();
        let position = |name: &str| names.iter().position(|n| *n == name);
        let need = |name: &str| position(name).ok_or_else(|| table.refuse(Some(1), &missing(name, &names)));
        let t = need("t_s")?;
        if let Some(column) = position(DISPLACEMENT).filter(|_| may_be_displacement) {
            let (theta, sd) = (vec![column], vec![position("displacement_sd_px")]);
            return Ok(Self { t, theta, sd, measured: Measured::Displacement });
        }
        let highest = names.iter().filter_map(|n| n.strip_prefix("theta")?.strip_suffix("_rad")?.parse::<usize>().ok());
        let links = highest.filter(|link| (1..=99).contains(link)).max().unwrap_or(1);
        let theta = (1..=links).map(|link| need(&format!("theta{link}_rad"))).collect::<Result<Vec<_>>>()?;
        let sd = (1..=links).map(|link| position(&format!("theta{link}_sd_rad"))).collect();
        let used = std::iter::once(t).chain(theta.iter().copied());
        for name in used.map(|column| names[column]) {
            if names.iter().filter(|n| **n == name).count() > 1 {
                return Err(table.refuse(Some(1), &format!("two columns are called `{name}`; rename one")));
            }
        }
        Ok(Self { t, theta, sd, measured: Measured::Angles })
    }
}

/// What to say about bytes that are no text, by the marks that files of a kind begin with.
pub fn not_a_table(bytes: &[u8], path: &Path) -> String {
    let at = |offset: usize, mark: &[u8]| bytes.get(offset..offset + mark.len()).is_some_and(|b| b == mark);
    let video = at(4, b"ftyp") // MP4, MOV
        || at(4, b"moov")
        || at(4, b"mdat")
        || at(0, &[0x1a, 0x45, 0xdf, 0xa3]) // MKV, WebM
        || (at(0, b"RIFF") && at(8, b"AVI "));
    let picture = at(0, b"\x89PNG") || at(0, &[0xff, 0xd8, 0xff]) || at(0, b"II*\0") || at(0, b"MM\0*") || at(0, b"BM");
    if video {
        return format!("is a video; run `track {} --out angles.csv` first and give angles.csv", path.display());
    }
    if picture {
        return "is a picture; give the table that `track` writes of a recording".to_owned();
    }
    if at(0, b"PK\x03\x04") || at(0, &[0xd0, 0xcf, 0x11, 0xe0]) {
        return "is a workbook or an archive; export the table as CSV".to_owned();
    }
    if at(0, &[0x1f, 0x8b]) || at(0, &[0x28, 0xb5, 0x2f, 0xfd]) {
        return "is compressed; unpack it first".to_owned();
    }
    "is not UTF-8 text; save the table as plain CSV".to_owned()
}

/// What to say about a column that is not there.
fn missing(name: &str, names: &[&str]) -> String {
    let list = names.join(", ");
    if let [only] = names
        && let Some((_, word)) = [(';', "semicolons"), ('\t', "tabs")].into_iter().find(|(c, _)| only.contains(*c))
    {
        return format!("fields are separated by {word}; separate them by commas, with a point in the numbers");
    }
    if names.iter().all(|n| n.parse::<f64>().is_ok()) {
        return format!("no header, the first row is {list}; put t_s,theta1_rad,theta2_rad above it");
    }
    if names.contains(&DISPLACEMENT) {
        return "holds the displacement of one mark and no angle, of which only `identify` can tell something; say where the mark hangs, with --pivot or pivot_px in [rig], and track again".to_owned();
    }
    let degrees = name.replace("_rad", "_deg");
    if degrees != name && names.contains(&degrees.as_str()) {
        return format!("no column `{name}` but `{degrees}`; multiply it by π/180 and rename it");
    }
    let nearest = names.iter().max_by(|a, b| strsim::jaro_winkler(name, a).total_cmp(&strsim::jaro_winkler(name, b)));
    let hint = nearest
        .filter(|n| strsim::jaro_winkler(name, n) > 0.5)
        .map(|n| match THOUSANDTHS.contains(n) {
            true => format!("; is it `{n}`? Then divide it by 1000 and rename it"),
            false => format!("; is it `{n}`? Then rename it"),
        })
        .unwrap_or_default();
    format!("no column `{name}` among {list}{hint}")
}

/// The table, for messages.
pub struct Table<'a> {
    /// Where it came from.
    pub path: &'a Path,
}

impl Table<'_> {
    /// A refusal of it, with the line.
    pub fn refuse(&self, line: Option<u64>, message: &str) -> Error {
        Error::Table { path: self.path.to_owned(), line, message: message.to_owned() }
    }
}

/// One row.
pub struct Row<'a> {
    /// Its fields.
    pub record: &'a csv::StringRecord,
    /// The names of the columns.
    pub header: &'a csv::StringRecord,
    /// The table that it stands in.
    pub table: &'a Table<'a>,
}

impl Row<'_> {
    /// A field as a number; `None` of an empty one.
    pub fn number(&self, column: usize) -> Result<Option<f64>> {
        let text = &self.record[column];
        if text.is_empty() {
            return Ok(None);
        }
        let name = &self.header[column];
        let value: f64 = text.parse().map_err(|_| self.refuse(&format!("{name} = `{text}` is not a number")))?;
        if !value.is_finite() {
            return Err(self.refuse(&format!("{name} = {text}; leave a missing value's field empty")));
        }
        Ok(Some(value))
    }

    /// A refusal of it.
    pub fn refuse(&self, message: &str) -> Error {
        self.table.refuse(self.record.position().map(csv::Position::line), message)
    }
}
