//! The reader of a displacement record: a table of times and displacements, with a header or without.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::experiment::Laser;

/// Fewest rows, and the shortest time, from which a push can be told.
const FEWEST_ROWS: usize = 100;
const SHORTEST_S: f64 = 5.0;
/// A record of which less than this part lies within the range of the sensor is none.
const LEAST_INSIDE: f64 = 0.5;

/// Times and displacements.
#[derive(Debug, Clone, PartialEq)]
pub struct LaserRecord {
    /// Where it came from, for messages.
    pub path: PathBuf,
    /// Rising.
    pub t_s: Vec<f64>,
    /// Displacement.
    pub y_m: Vec<f64>,
    /// The column that was taken.
    pub column: String,
    /// Rows that were passed over, and why.
    pub warnings: Vec<String>,
}

impl LaserRecord {
    /// Reads and checks a table; `-` is standard input.
    ///
    /// # Errors
    /// [`Error::Unreadable`], [`Error::EmptyFile`], or [`Error::Table`]: no such column, no unit, times that do not rise, too few rows,
    /// mostly out of the sensor's range.
    pub fn read(path: &Path, laser: &Laser) -> Result<Self> {
        let (name, bytes) = crate::input::read(path)?;
        Self::parse(&bytes, &name, laser)
    }

    /// Reads and checks the bytes of a table; `path` only appears in errors.
    ///
    /// # Errors
    /// As [`LaserRecord::read`].
    pub fn parse(bytes: &[u8], path: &Path, laser: &Laser) -> Result<Self> {
        if bytes.is_empty() {
            return Err(Error::EmptyFile { path: path.to_owned() });
        }
        let refuse = |line: Option<u64>, message: String| Error::Table { path: path.to_owned(), line, message };
        let text = decoded(bytes).ok_or_else(|| refuse(None, "is not text; export the record as CSV".to_owned()))?;
        let text = text.trim_start_matches('\u{feff}');
        let separator = separator(text);
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(separator)
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_reader(text.as_bytes());
        let comma = separator != b',';
        let (mut columns, mut names): (Option<Columns>, Option<csv::StringRecord>) = (None, None);
        let mut rows = Rows { path, t_s: Vec::new(), y_m: Vec::new(), empty: 0 };
        for record in reader.records() {
            let record = record.map_err(|e| refuse(e.position().map(csv::Position::line), e.to_string()))?;
            let line = record.position().map(csv::Position::line);
            let is_header = columns.is_none() && record.iter().all(|field| number(field, comma).is_none());
            if is_header {
                // of several lines before the numbers the last names the columns, but for the one that names the wanted
                let is_named =
                    |names: &csv::StringRecord| names.iter().any(|name| Some(name) == laser.column.as_deref());
                if !names.as_ref().is_some_and(is_named) {
                    names = Some(record);
                }
                continue;
            }
            if columns.is_none() {
                let found = Columns::of(names.as_ref(), record.len(), laser);
                columns = Some(found.map_err(|message| refuse(names.is_some().then_some(1), message))?);
            }
            if let Some(columns) = &columns {
                rows.push(&record, columns, comma, line)?;
            }
        }
        let Some(columns) = columns else {
            return Err(refuse(
                None,
                "holds no row of numbers; export the record as CSV, one row per sample: time, displacement".to_owned(),
            ));
        };
        rows.finish(columns.name, laser)
    }
}

/// Text of UTF-8, or of Latin-1, in which µ is one byte.
fn decoded(bytes: &[u8]) -> Option<String> {
    if bytes.contains(&0) {
        return None;
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => Some(text.to_owned()),
        Err(_) if bytes.iter().all(|b| *b < 0x80 || *b == 0xb5 || *b == 0xb0) => {
            Some(bytes.iter().map(|b| char::from(*b)).collect())
        }
        Err(_) => None,
    }
}

/// What stands between the fields: tab or semicolon where the first lines have them, else a comma.
fn separator(text: &str) -> u8 {
    let lines = || text.lines().filter(|line| !line.starts_with('#')).take(5);
    [b'\t', b';'].into_iter().find(|mark| lines().any(|line| line.bytes().any(|b| b == *mark))).unwrap_or(b',')
}

/// A number, with a decimal comma where the fields are not separated by commas.
fn number(field: &str, comma: bool) -> Option<f64> {
    match comma && field.contains(',') && !field.contains('.') {
        true => field.replace(',', ".").parse().ok(),
        false => field.parse().ok(),
    }
}

/// Which columns hold time and displacement, and their units.
struct Columns {
    t: usize,
    t_scale_s: f64,
    y: usize,
    y_scale_m: f64,
    name: String,
}

impl Columns {
    fn of(names: Option<&csv::StringRecord>, fields: usize, laser: &Laser) -> std::result::Result<Self, String> {
        if fields < 2 {
            return Err("holds one column; time and displacement are needed".to_owned());
        }
        let Some(names) = names else { return Self::unnamed(fields, laser) };
        let names: Vec<&str> = names.iter().collect();
        let list = names.join(", ");
        let is_time = |name: &str| {
            let name = name.to_lowercase();
            name == "t"
                || name == "s"
                || name == "ms"
                || name.starts_with("t_")
                || name.starts_with("time")
                || name.starts_with("zeit")
                || name.starts_with("t ")
                || name.starts_with("t[")
                || name.starts_with("t(")
        };
        let t = names.iter().position(|name| is_time(name));
        let t = t.ok_or_else(|| format!("names no column of time; the columns are {list}; name it t_s or t_ms"))?;
        // the unit stands last
        let unit = words(names[t]).filter_map(|w| TIME_UNITS.iter().find(|unit| unit.0 == w)).last();
        let t_scale_s = match unit {
            None => 1.0,
            Some((_, Some(scale_s))) => *scale_s,
            Some((unit, None)) => {
                return Err(format!("column `{}` is in {unit}; give the times in seconds or milliseconds", names[t]));
            }
        };
        let y = match &laser.column {
            Some(wanted) => names.iter().position(|name| name == wanted).ok_or_else(|| {
                let near = names
                    .iter()
                    .max_by(|a, b| strsim::jaro_winkler(a, wanted).total_cmp(&strsim::jaro_winkler(b, wanted)));
                format!(
                    "has no column `{wanted}`; the columns are {list}; set laser.column = \"{}\"",
                    near.unwrap_or(&"")
                )
            })?,
            None => {
                let known: Vec<usize> = (0..names.len())
                    .filter(|k| *k != t && unit_m(names[*k], laser).is_ok_and(|u| u.is_some()))
                    .collect();
                match (&known[..], names.len()) {
                    ([only], _) => *only,
                    ([], 2) => 1 - t,
                    _ => {
                        return Err(format!(
                            "does not say which column is the displacement; the columns are {list}; set laser.column"
                        ));
                    }
                }
            }
        };
        let name = names[y];
        let y_scale_m = unit_m(name, laser)?.ok_or_else(|| {
            format!(
                "column `{name}` has no unit in its name; end it in _um, _mm or _m, or in _v with laser.scale_m_per_v"
            )
        })?;
        Ok(Self { t, t_scale_s, y, y_scale_m, name: name.to_owned() })
    }

    /// Time, then displacement; the unit must come from the file.
    fn unnamed(fields: usize, laser: &Laser) -> std::result::Result<Self, String> {
        let by_number = laser.column.as_ref().map(|wanted| (wanted, wanted.rsplit(['_', ' ']).next()));
        let scale = match by_number {
            Some((wanted, _)) => unit_m(wanted, laser)?,
            None => laser.scale_m_per_v,
        };
        let y_scale_m = scale.ok_or_else(|| {
            "has no header, so no unit; set laser.column = \"displacement_um\" (or _mm, _m), or laser.scale_m_per_v for volts".to_owned()
        })?;
        if fields > 2 {
            return Err(format!("has {fields} columns and no header; keep time and displacement, or add a header"));
        }
        Ok(Self {
            t: 0,
            t_scale_s: 1.0,
            y: 1,
            y_scale_m,
            name: laser.column.clone().unwrap_or_else(|| "column 2".to_owned()),
        })
    }
}

/// Units of time in a column's name, and how many seconds each is, of those that are read.
const TIME_UNITS: [(&str, Option<f64>); 16] = [
    ("s", Some(1.0)),
    ("sec", Some(1.0)),
    ("seconds", Some(1.0)),
    ("ms", Some(1e-3)),
    ("us", None),
    ("µs", None),
    ("μs", None),
    ("ns", None),
    ("min", None),
    ("minutes", None),
    ("h", None),
    ("hours", None),
    ("d", None),
    ("days", None),
    ("frame", None),
    ("samples", None),
];

/// The words of a column's name.
fn words(name: &str) -> impl Iterator<Item = String> + '_ {
    name.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).map(str::to_lowercase)
}

/// Metres a unit of a column, by its name; none where that says nothing.
fn unit_m(name: &str, laser: &Laser) -> std::result::Result<Option<f64>, String> {
    let Some(unit) = words(name).last() else { return Ok(None) };
    let unit_m = match unit.as_str() {
        "m" | "metres" | "meters" => 1.0,
        "mm" => 1e-3,
        "um" | "µm" | "μm" | "microns" | "micrometres" | "micrometers" => 1e-6,
        "nm" => 1e-9,
        "v" | "volt" | "volts" | "voltage" => {
            return laser.scale_m_per_v.map(Some).ok_or_else(|| {
                format!("column `{name}` is in volts; set laser.scale_m_per_v, the displacement a volt stands for")
            });
        }
        "mv" => {
            return laser
                .scale_m_per_v
                .map(|s| Some(1e-3 * s))
                .ok_or_else(|| format!("column `{name}` is in millivolts; set laser.scale_m_per_v"));
        }
        _ => return Ok(None),
    };
    Ok(Some(unit_m))
}

/// The rows so far.
struct Rows<'p> {
    path: &'p Path,
    t_s: Vec<f64>,
    y_m: Vec<f64>,
    empty: usize,
}

impl Rows<'_> {
    fn push(&mut self, record: &csv::StringRecord, columns: &Columns, comma: bool, line: Option<u64>) -> Result<()> {
        let refuse = |message: String| Error::Table { path: self.path.to_owned(), line, message };
        let field = |column: usize| record.get(column).unwrap_or_default();
        let [t, y] = [columns.t, columns.y].map(field);
        for (text, what) in [(t, "time"), (y, "displacement")] {
            if !text.is_empty() && number(text, comma).is_none() {
                return Err(refuse(format!("`{text}` is not a number where the {what} should stand")));
            }
        }
        let of = |text: &str| number(text, comma).filter(|v| v.is_finite());
        let (Some(t), Some(y)) = (of(t), of(y)) else {
            self.empty += 1;
            return Ok(());
        };
        let t_s = t * columns.t_scale_s;
        if let Some(before) = self.t_s.last().filter(|before| **before >= t_s) {
            return Err(refuse(format!(
                "time {t_s} s follows {before} s; times must rise: sort the rows, one an instant"
            )));
        }
        self.t_s.push(t_s);
        self.y_m.push(y * columns.y_scale_m);
        Ok(())
    }

    fn finish(mut self, column: String, laser: &Laser) -> Result<LaserRecord> {
        let refuse = |message: String| Error::Table { path: self.path.to_owned(), line: None, message };
        let rows = self.t_s.len();
        let mut warnings = Vec::new();
        let mut warn = |text: String| warnings.push(format!("{}: {text}", self.path.display()));
        if self.empty > 0 {
            warn(format!("{} rows without a finite time or displacement were passed over", self.empty));
        }
        if let Some([low, high]) = laser.range_m {
            let edge = laser.resolution_m.unwrap_or(0.0);
            let keep: Vec<bool> = self.y_m.iter().map(|y| *y > low + 0.5 * edge && *y < high - 0.5 * edge).collect();
            let inside = keep.iter().filter(|k| **k).count();
            if rows > 0 && (inside as f64) < LEAST_INSIDE * rows as f64 {
                return Err(refuse(format!(
                    "{} of {rows} samples lie at or beyond laser.range_m, {low} to {high} m; move the sensor, or check range and unit of `{column}`",
                    rows - inside
                )));
            }
            if inside < rows {
                warn(format!("{} samples at or beyond the sensor's range were left out", rows - inside));
                for values in [&mut self.t_s, &mut self.y_m] {
                    let mut place = 0;
                    values.retain(|_| {
                        place += 1;
                        keep[place - 1]
                    });
                }
            }
        }
        let rows = self.t_s.len();
        let lasts_s = self.t_s.last().unwrap_or(&0.0) - self.t_s.first().unwrap_or(&0.0);
        if rows < FEWEST_ROWS || lasts_s < SHORTEST_S {
            return Err(refuse(format!(
                "{rows} samples over {lasts_s:.1} s; at least {FEWEST_ROWS} over {SHORTEST_S} s are needed"
            )));
        }
        let first = self.y_m[0];
        if self.y_m.iter().all(|y| *y == first) {
            return Err(refuse(format!("`{column}` stays at {first} m; check the sensor and laser.column")));
        }
        Ok(LaserRecord { path: self.path.to_owned(), t_s: self.t_s, y_m: self.y_m, column, warnings })
    }
}
