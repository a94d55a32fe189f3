//! The reader of angle tables: what `track`, `simulate` or another program wrote.
//!
//! Only `t_s` and `theta1_rad`, `theta2_rad`, … are needed, in any order among any other columns. An empty field is a missing value.

mod clock;
mod columns;
pub mod noise;
mod plausible;
mod standstill;
mod turns;

use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::hand_hold::{caught_of, released_of};
use crate::statistics::{median, median_step_s};
use columns::{Columns, Row, Table, not_a_table};

/// Fewest rows, and fewest values of each angle, from which anything can be said.
pub const FEWEST_ROWS: usize = 8;

/// A displacement is taken for the angle of a pendulum so many pixels long.
pub const PX_PER_RAD: f64 = 1000.0;

/// The column of a displacement.
const DISPLACEMENT: &str = "displacement_px";

/// A column of which more than this part of the numbers is negative holds no standard deviations, whatever its name.
const MOST_NEGATIVE: f64 = 0.25;

/// What a table holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measured {
    /// Angles of one or more links.
    Angles,
    /// The displacement of one mark of which nobody knows where it hangs, over [`PX_PER_RAD`].
    Displacement,
}

/// The angles of one recording as a table of numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct AngleSeries {
    /// Where the table came from, for messages.
    pub path: PathBuf,
    /// Time stamps, increasing.
    pub t_s: Vec<f64>,
    /// Angle of each link in each row, `[link][row]`; absent where it was not measured.
    pub theta_rad: Vec<Vec<Option<f64>>>,
    /// Its standard deviation where the table states one that is positive.
    pub sd_rad: Vec<Vec<Option<f64>>>,
    /// Whether the table also holds the marks in the picture, from which its angles were measured.
    pub tracked: bool,
    /// What of the table was passed over, and why.
    pub warnings: Vec<String>,
}

impl AngleSeries {
    /// Reads and checks a table; `-` is standard input. A byte order mark and CRLF line ends are accepted.
    ///
    /// # Errors
    /// [`Error::Unreadable`], [`Error::EmptyFile`], or [`Error::Table`] with the line: missing columns, fields that are not numbers, NaN or
    /// infinity, times that do not increase, fewer than [`FEWEST_ROWS`] rows, an angle that never changes, degrees.
    pub fn read(path: &Path) -> Result<Self> {
        let (name, bytes) = crate::input::read(path)?;
        Self::parse(&bytes, &name)
    }

    /// The same of a table that may hold the displacement of one mark instead.
    ///
    /// # Errors
    /// As [`AngleSeries::read`].
    pub fn read_motion(path: &Path) -> Result<(Self, Measured)> {
        let (name, bytes) = crate::input::read(path)?;
        Self::parsed(&bytes, &name, true)
    }

    /// Reads and checks the bytes of a table; `path` only appears in errors.
    ///
    /// # Errors
    /// As [`AngleSeries::read`].
    pub fn parse(bytes: &[u8], path: &Path) -> Result<Self> {
        Self::parsed(bytes, path, false).map(|(series, _)| series)
    }

    fn parsed(bytes: &[u8], path: &Path, may_be_displacement: bool) -> Result<(Self, Measured)> {
        if bytes.is_empty() {
            return Err(Error::EmptyFile { path: path.to_owned() });
        }
        let table = Table { path };
        let text = match std::str::from_utf8(bytes) {
            Ok(text) if !text.contains('\0') => text.trim_start_matches('\u{feff}'),
            _ => return Err(table.refuse(None, &not_a_table(bytes, path))),
        };
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_reader(text.as_bytes());
        let header = reader.headers().map_err(|e| table.refuse(None, &e.to_string()))?.clone();
        let columns = Columns::of(&header, &table, may_be_displacement)?;
        let links = columns.theta.len();
        let mut series = Self {
            path: path.to_owned(),
            t_s: Vec::new(),
            theta_rad: vec![Vec::new(); links],
            sd_rad: vec![Vec::new(); links],
            tracked: header.iter().any(|name| name == "m1_x_px"),
            warnings: Vec::new(),
        };
        let (mut decimals, mut without_time) = (0, 0);
        for record in reader.records() {
            let record = record.map_err(|e| table.refuse(e.position().map(csv::Position::line), &e.to_string()))?;
            decimals = decimals.max(record.get(columns.t).map_or(0, decimals_of));
            let counts = series.push(&Row { record: &record, header: &header, table: &table }, &columns)?;
            without_time += usize::from(!counts);
        }
        if without_time > 0 {
            series.warnings.push(format!(
                "{}: {without_time} frame{} with a repeated or backward time stamp: left out",
                path.display(),
                if without_time == 1 { "" } else { "s" }
            ));
        }
        series.check(&table, columns.measured)?;
        if columns.measured == Measured::Angles {
            series.take_out_turns();
        }
        series.keep_deviations();
        if columns.measured == Measured::Displacement {
            series.theta_rad.iter_mut().chain(&mut series.sd_rad).flatten().flatten().for_each(|px| *px /= PX_PER_RAD);
        }
        series.warnings.extend(series.slow_clock());
        if let Some(step_s) = clock::set_even(&mut series.t_s, decimals) {
            series.warnings.push(format!(
                "{}: t_s is rounded to {} s; rows that lie an even {:.4} ms apart explain it and are used",
                path.display(),
                10f64.powi(-(decimals as i32)),
                1e3 * step_s
            ));
        }
        Ok((series, columns.measured))
    }

    /// Adds a row; whether it counts: a frame of a video whose stamp does not rise has no time of its own.
    fn push(&mut self, row: &Row, columns: &Columns) -> Result<bool> {
        let (fields, named) = (row.record.len(), row.header.len());
        if fields != named {
            return Err(row.refuse(&format!("{fields} fields where the header names {named} columns")));
        }
        let t_s = row.number(columns.t)?.ok_or_else(|| row.refuse("t_s is empty; every row needs its time"))?;
        if let Some(before) = self.t_s.last().filter(|before| **before >= t_s) {
            if self.tracked {
                return Ok(false);
            }
            return Err(row.refuse(&if *before == t_s {
                format!("t_s = {t_s} stands twice; keep one row an instant")
            } else {
                format!("t_s = {t_s} follows {before}; sort the rows by time")
            }));
        }
        self.t_s.push(t_s);
        for (link, column) in columns.theta.iter().enumerate() {
            self.theta_rad[link].push(row.number(*column)?);
            let sd = columns.sd[link].and_then(|c| row.record[c].parse().ok());
            self.sd_rad[link].push(sd.filter(|sd: &f64| sd.is_finite()));
        }
        Ok(true)
    }

    /// Keeps the standard deviations that are positive, of the columns that hold some.
    fn keep_deviations(&mut self) {
        for (link, column) in self.sd_rad.iter_mut().enumerate() {
            let (numbers, negative) =
                column.iter().flatten().fold((0, 0), |(n, below), sd| (n + 1, below + usize::from(*sd < 0.0)));
            let is_none = negative as f64 > MOST_NEGATIVE * numbers as f64;
            if is_none {
                self.warnings.push(format!(
                    "{}: theta{}_sd_rad is negative in {negative} of {numbers} rows: no standard deviations; passed over",
                    self.path.display(),
                    link + 1
                ));
            }
            for sd in column {
                *sd = sd.filter(|sd| *sd > 0.0 && !is_none);
            }
        }
    }

    /// Times and values of each angle where it is known.
    fn paths(&self) -> impl Iterator<Item = (Vec<f64>, Vec<f64>)> {
        self.theta_rad
            .iter()
            .map(|angles| self.t_s.iter().zip(angles).filter_map(|(t, angle)| Some((*t, (*angle)?))).unzip())
    }

    /// When it is let go, where it is held still before it swings, and what follows.
    pub fn let_go(&self) -> Option<(f64, Self)> {
        let released_s = released_of(self.paths())?;
        Some((released_s, self.slice(self.rows(released_s, f64::INFINITY))))
    }

    /// The median of an angle's stated standard deviations.
    pub fn usual_sd_rad(&self, link: usize) -> Option<f64> {
        median(&mut self.sd_rad.get(link)?.iter().flatten().copied().filter(|sd| *sd > 0.0).collect::<Vec<_>>())
    }

    /// Without the values whose own standard deviation is more than so many times the usual one, and how many of each angle those are; `None` where there are none.
    pub fn without_unsure(&self, times: f64) -> Option<(Self, Vec<usize>)> {
        let mut sure = self.clone();
        let mut counts = vec![0; self.links()];
        for (link, count) in counts.iter_mut().enumerate() {
            let Some(usual_rad) = self.usual_sd_rad(link) else { continue };
            let values = sure.theta_rad[link].iter_mut().zip(&self.sd_rad[link]);
            for (value, _) in values.filter(|(_, sd)| sd.is_some_and(|sd| sd > times * usual_rad)) {
                *count += usize::from(value.take().is_some());
            }
        }
        counts.iter().any(|count| *count > 0).then_some((sure, counts))
    }

    /// When it is caught, where it is held still to the end, and what precedes.
    pub fn caught(&self) -> Option<(f64, Self)> {
        let caught_s = caught_of(self.paths())?;
        Some((caught_s, self.slice(self.rows(f64::NEG_INFINITY, caught_s))))
    }

    /// Number of links.
    pub fn links(&self) -> usize {
        self.theta_rad.len()
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.t_s.len()
    }

    /// Whether there is no row; never so after reading.
    pub fn is_empty(&self) -> bool {
        self.t_s.is_empty()
    }

    /// From the first time stamp to the last.
    pub fn duration_s(&self) -> f64 {
        self.t_s.last().unwrap_or(&0.0) - self.t_s.first().unwrap_or(&0.0)
    }

    /// Median step between rows.
    pub fn step_s(&self) -> f64 {
        median_step_s(&self.t_s).unwrap_or(0.0)
    }

    /// Half the rate of the median step: a motion beyond it cannot be told from a slower one.
    pub fn nyquist_hz(&self) -> f64 {
        0.5 / self.step_s()
    }

    /// Share of the steps that differ from the median step by more than 5 %.
    pub fn irregular_share(&self) -> f64 {
        let step_s = self.step_s();
        let odd = self.t_s.windows(2).filter(|pair| (pair[1] - pair[0] - step_s).abs() > 0.05 * step_s).count();
        odd as f64 / self.t_s.len().saturating_sub(1).max(1) as f64
    }

    /// Rows of a stretch of time, its end excluded.
    pub fn rows(&self, from_s: f64, until_s: f64) -> Range<usize> {
        let from = self.t_s.partition_point(|t| *t < from_s);
        from..self.t_s.partition_point(|t| *t < until_s).max(from)
    }

    /// The same series if it can be a swing.
    ///
    /// # Errors
    /// As [`AngleSeries::read`], of what a slice may lack.
    pub fn checked(self) -> Result<Self> {
        self.check(&Table { path: &self.path }, Measured::Angles)?;
        Ok(self)
    }

    /// The rows of a range, not checked again.
    #[must_use]
    pub fn slice(&self, rows: Range<usize>) -> Self {
        let part = |columns: &[Vec<Option<f64>>]| columns.iter().map(|c| c[rows.clone()].to_vec()).collect();
        Self {
            path: self.path.clone(),
            t_s: self.t_s[rows.clone()].to_vec(),
            theta_rad: part(&self.theta_rad),
            sd_rad: part(&self.sd_rad),
            tracked: self.tracked,
            warnings: self.warnings.clone(),
        }
    }
}

/// Decimals of a number as it is written.
fn decimals_of(number: &str) -> usize {
    let (digits, power) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
    let after = digits.split_once('.').map_or(0, |(_, after)| after.len()) as i64;
    (after - power.parse::<i64>().unwrap_or(0)).clamp(0, 15) as usize
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use super::*;

    fn parse(text: &str) -> Result<AngleSeries> {
        AngleSeries::parse(text.as_bytes(), Path::new("a.csv"))
    }

    fn refusal(text: &str) -> String {
        parse(text).unwrap_err().to_string()
    }

    /// A table of one angle, a row every 0.1 s.
    fn table(angle: impl Fn(f64) -> f64, rows: usize) -> String {
        let mut text = "t_s,theta1_rad\n".to_owned();
        for row in 0..rows {
            let t = 0.1 * row as f64;
            let _ = writeln!(text, "{t:.3},{:.6}", angle(t));
        }
        text
    }

    fn swing(t: f64) -> f64 {
        0.3 * (6.0 * t).cos()
    }

    #[test]
    fn a_displacement_without_an_angle_is_refused_with_what_to_do() {
        let refused = refusal("frame,t_s,m1_x_px,m1_y_px,displacement_px,displacement_sd_px\n0,0.0,1.0,1.0,0.1,0.1\n");
        assert!(refused.contains("--pivot"), "{refused}");
    }

    #[test]
    fn values_of_a_large_standard_deviation_are_left_out() {
        let sd = |row: usize| if (20..24).contains(&row) { 0.2 } else { 0.001 + 1e-5 * row as f64 };
        let mut text = "t_s,theta1_rad,theta1_sd_rad\n".to_owned();
        (0..60).for_each(|row| {
            _ = writeln!(text, "{:.1},{:.5},{:.5}", 0.1 * row as f64, swing(0.1 * row as f64), sd(row))
        });
        let (sure, counts) = parse(&text).unwrap().without_unsure(5.0).unwrap();
        assert_eq!(counts, [4]);
        let missing: Vec<usize> = (0..60).filter(|row| sure.theta_rad[0][*row].is_none()).collect();
        assert_eq!(missing, [20, 21, 22, 23]);
        assert!(sure.without_unsure(5.0).is_none());
    }

    #[test]
    fn columns_in_any_order_with_gaps_and_strange_deviations_are_read() {
        let mut text = "flags,theta2_rad,theta1_sd_rad,t_s,frame,theta1_rad\r\n".to_owned();
        for (row, sd) in ["0.01", "-0.02", "nan", "", "0", "0.01", "x", "0.02", ""].iter().enumerate() {
            let theta2 = if row == 3 { String::new() } else { format!("0.{row}") };
            let _ = write!(text, "lost:m2,{theta2},{sd},{row},0,-0.{row}\r\n");
        }
        let series = AngleSeries::parse(format!("\u{feff}{text}").as_bytes(), Path::new("a.csv")).unwrap();
        assert_eq!((series.links(), series.len()), (2, 9));
        assert_eq!(series.theta_rad[0][2], Some(-0.2));
        assert_eq!(series.theta_rad[1][3], None);
        assert_eq!(series.sd_rad[0], [Some(0.01), None, None, None, None, Some(0.01), None, Some(0.02), None]);
        assert_eq!(series.sd_rad[1], [None; 9]);
        assert_eq!((series.step_s(), series.nyquist_hz(), series.duration_s()), (1.0, 0.5, 8.0));
        assert_eq!(series.rows(2.0, 4.0), 2..4);
        assert_eq!(series.slice(2..4).theta_rad[1], [Some(0.2), None]);
    }

    #[test]
    fn a_column_of_negative_deviations_is_passed_over_with_a_word() {
        let mut text = "t_s,theta1_rad,theta1_sd_rad\n".to_owned();
        for row in 0..40 {
            let t = 0.1 * f64::from(row);
            let _ = writeln!(text, "{t:.3},{:.6},{:.6}", swing(t), 0.2 * (6.0 * t).sin());
        }
        let series = AngleSeries::parse(text.as_bytes(), Path::new("a.csv")).unwrap();
        assert!(series.sd_rad[0].iter().all(Option::is_none));
        let expected = "a.csv: theta1_sd_rad is negative in 18 of 40 rows: no standard deviations; passed over";
        assert_eq!(series.warnings, [expected]);
    }

    #[test]
    fn times_that_do_not_increase_are_named_with_their_line() {
        let text = table(swing, 9);
        assert_eq!(
            refusal(&text.replace("\n0.400,", "\n0.300,")),
            "a.csv:6: t_s = 0.3 stands twice; keep one row an instant"
        );
        assert_eq!(
            refusal(&text.replace("\n0.400,", "\n0.250,")),
            "a.csv:6: t_s = 0.25 follows 0.3; sort the rows by time"
        );
        assert_eq!(refusal(&text.replace("\n0.400,", "\n,")), "a.csv:6: t_s is empty; every row needs its time");
        assert_eq!(
            refusal(&text.replace("\n0.400,", "\ninf,")),
            "a.csv:6: t_s = inf; leave a missing value's field empty"
        );
    }

    #[test]
    fn values_that_are_no_numbers_are_named_with_their_line() {
        let rows = ["0,0.1", "1,NaN"];
        let text = |second: &str| format!("t_s,theta1_rad\n{}\n{second}\n", rows[0]);
        assert_eq!(refusal(&text(rows[1])), "a.csv:3: theta1_rad = NaN; leave a missing value's field empty");
        assert_eq!(refusal(&text("1,-inf")), "a.csv:3: theta1_rad = -inf; leave a missing value's field empty");
        assert_eq!(refusal(&text("1,12°")), "a.csv:3: theta1_rad = `12°` is not a number");
        assert_eq!(refusal(&text("1")), "a.csv:3: 1 fields where the header names 2 columns");
        assert_eq!(refusal(&text("1,2,3")), "a.csv:3: 3 fields where the header names 2 columns");
    }

    #[test]
    fn tables_too_short_are_refused() {
        assert_eq!(refusal(""), "a.csv: the file is empty (0 bytes); record or copy it again");
        assert_eq!(refusal("t_s,theta1_rad\n"), "a.csv: holds no row of numbers; measure the recording again");
        assert_eq!(refusal(&table(swing, 1)), "a.csv: holds one row; a swing needs at least 8");
        assert_eq!(refusal(&table(swing, 7)), "a.csv: holds 7 rows; a swing needs at least 8");
        let gaps = "t_s,theta1_rad\n0,\n1,\n2,\n3,0.1\n4,\n5,\n6,\n7,\n";
        assert_eq!(refusal(gaps), "a.csv: theta1_rad has 1 value in 8 rows; at least 8 are needed");
    }

    #[test]
    fn missing_columns_are_named_with_those_that_are_there() {
        assert_eq!(
            refusal("time,theta1_rad\n"),
            "a.csv:1: no column `t_s` among time, theta1_rad; is it `time`? Then rename it"
        );
        assert_eq!(
            refusal("t_s,theta_1\n"),
            "a.csv:1: no column `theta1_rad` among t_s, theta_1; is it `theta_1`? Then rename it"
        );
        assert_eq!(refusal("x,y\n"), "a.csv:1: no column `t_s` among x, y");
        assert!(refusal("t_s,theta1_rad,theta3_rad\n").starts_with("a.csv:1: no column `theta2_rad` among t_s,"));
        assert_eq!(
            refusal("t_s,theta1_deg\n"),
            "a.csv:1: no column `theta1_rad` but `theta1_deg`; multiply it by π/180 and rename it"
        );
        assert_eq!(
            refusal("t_s;theta1_rad\n0;1\n"),
            "a.csv:1: fields are separated by semicolons; separate them by commas, with a point in the numbers"
        );
        assert_eq!(
            refusal("0.0,0.1\n0.1,0.2\n"),
            "a.csv:1: no header, the first row is 0.0, 0.1; put t_s,theta1_rad,theta2_rad above it"
        );
        assert_eq!(refusal("t_s,t_s,theta1_rad\n"), "a.csv:1: two columns are called `t_s`; rename one");
        let utf16 = AngleSeries::parse(&[0xff, 0xfe, 0x74, 0x00], Path::new("a.csv")).unwrap_err().to_string();
        assert_eq!(utf16, "a.csv: is not UTF-8 text; save the table as plain CSV");
    }

    #[test]
    fn files_of_another_kind_are_named() {
        let kinds: [(&[u8], &str); 7] = [
            (b"\0\0\0\x20ftypisom\0\0", "is a video; run `track a.csv --out angles.csv` first and give angles.csv"),
            (b"\x1a\x45\xdf\xa3\x01\0", "is a video; run `track"),
            (b"RIFF\0\0\0\0AVI LIST\0", "is a video; run `track"),
            (b"\x89PNG\r\n\x1a\n\0", "is a picture; give the table that `track` writes"),
            (b"PK\x03\x04\0", "is a workbook or an archive; export the table as CSV"),
            (b"\x1f\x8b\x08\0", "is compressed; unpack it first"),
            (b"t_s,theta1_rad\n0,\0", "is not UTF-8 text"),
        ];
        for (bytes, says) in kinds {
            let message = AngleSeries::parse(bytes, Path::new("a.csv")).unwrap_err().to_string();
            assert!(message.starts_with(&format!("a.csv: {says}")), "{message}");
        }
    }

    #[test]
    fn an_angle_that_never_changes_is_refused() {
        assert_eq!(
            refusal(&table(|_| 0.25, 20)),
            "a.csv: theta1_rad stays at 0.25: nothing swings; check the marks and the column"
        );
    }

    #[test]
    fn degrees_are_refused_and_large_swings_in_radians_are_not() {
        let degrees = table(|t| 24.0 * (-0.05 * t).exp() * (6.0 * t).cos() + 3.0, 200);
        let message = refusal(&degrees);
        assert!(message.ends_with("full turns if radians: looks like degrees; multiply by π/180"), "{message}");
        assert!(message.starts_with("a.csv: theta1_rad swings to and fro by 4"), "{message}");
        parse(&table(|t| 3.1 * (6.0 * t).cos(), 200)).unwrap();
    }

    #[test]
    fn milliseconds_and_frame_numbers_are_recognised() {
        let warnings = |step: f64| {
            let mut text = "t_s,theta1_rad\n".to_owned();
            for row in 0..300 {
                let _ = writeln!(text, "{},{:.6}", f64::from(row) * step, 0.3 * (f64::from(row) * 0.25).cos());
            }
            parse(&text).unwrap().warnings
        };
        assert!(warnings(0.0333).is_empty());
        let [milliseconds] = &warnings(33.3)[..] else { panic!("no warning") };
        assert!(milliseconds.contains("t_s looks like milliseconds: divide by 1000"), "{milliseconds}");
        let [frames] = &warnings(1.0)[..] else { panic!("no warning") };
        assert!(frames.contains("t_s looks like frame numbers"), "{frames}");
    }

    #[test]
    fn a_pendulum_that_whirls_and_then_swings_is_legal() {
        let whirl = |t: f64| if t < 10.0 { 7.0 * t } else { 70.0 + 2.5 * (5.0 * (t - 10.0)).sin() };
        parse(&table(whirl, 400)).unwrap();
        // the outer link of a chaotic pendulum: over the top one way, then the other, then it hangs
        let outer = |t: f64| if t < 9.0 { 5.0 * (2.0 * t).sin() } else { 2.0 * (5.0 * t).sin() };
        parse(&table(outer, 60)).unwrap();
    }

    #[test]
    fn real_recordings_are_read_in_radians_and_refused_in_degrees() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
        for (file, links) in [("multiarm_double.csv", 2), ("multiarm_single.csv", 1), ("video_pendulum.csv", 1)] {
            let path = folder.join(file);
            if !path.exists() {
                println!("skipped: {} is not there", path.display());
                continue;
            }
            let series = AngleSeries::read(&path).unwrap();
            assert_eq!(series.links(), links, "{file}");
            let mut text = "t_s,theta1_rad\n".to_owned();
            for (t, theta) in series.t_s.iter().zip(&series.theta_rad[0]) {
                let _ = writeln!(text, "{t},{}", theta.map(|a| a.to_degrees().to_string()).unwrap_or_default());
            }
            assert!(refusal(&text).contains("looks like degrees"), "{file}");
        }
    }

    #[test]
    fn a_real_chaotic_pendulum_in_radians_is_legal() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/chaotic_pendulum_log.csv");
        if !path.exists() {
            println!("skipped: {} is not there", path.display());
            return;
        }
        let text = std::fs::read_to_string(path).unwrap().replace("theta2_rel_rad", "theta2_rad");
        assert_eq!(parse(&text).unwrap().links(), 2);
    }
}
