//! Tables of numbers that a run leaves beside the JSON files: what the page draws and no JSON holds.
//!
//! | file | columns |
//! |---|---|
//! | `figures/fit.csv` | `recording,t_s`, then for each angle `measured`, `simulated`, `residual` |
//! | `figures/diagnosis.csv` | `t_s,predicted`, then for each angle `measured` and, of the base model, the effects named and the law that was learnt, the angle and what it leaves |
//! | `figures/where.csv` | the torque that the base model lacks: `t_s`, torque, its standard deviation, angle and rate that it works on, amplitude, phase of the swing |

use std::fmt::Write;

use crate::diagnose::{Diagnosis, Place};
use crate::fit::{Fit, Record, Residuals};

/// Measured, simulated and what is left of every angle in every row: `figures/fit.csv`. Recordings are numbered from 1.
pub fn fit_curves(fit: &Fit, records: &[Record]) -> String {
    let links = records.first().map_or(0, Record::links);
    let mut csv = "recording,t_s".to_owned();
    for link in 1..=links {
        let _ = write!(csv, ",theta{link}_measured_rad,theta{link}_simulated_rad,theta{link}_residual_rad");
    }
    csv.push('\n');
    for (number, (record, residuals)) in records.iter().zip(&fit.residuals).enumerate() {
        let mut sides = [Rows::of(residuals)];
        for (row, t_s) in record.t_s.iter().enumerate() {
            let _ = write!(csv, "{},{t_s}", number + 1);
            for link in 0..links {
                let measured = record.theta_rad.get(link).and_then(|column| column[row]);
                field(&mut csv, measured);
                let left = sides[0].at(link, *t_s);
                field(&mut csv, left.map(|(_, simulated)| simulated));
                field(&mut csv, left.map(|(measured, simulated)| measured - simulated));
            }
            csv.push('\n');
        }
    }
    csv
}

/// The base model, the effects named and the law that was learnt, beside what was measured: `figures/diagnosis.csv`. `None` where no model could be
/// integrated.
pub fn diagnosis_curves(diagnosis: &Diagnosis) -> Option<String> {
    let drawn = diagnosis.drawn.as_ref()?;
    let mut sides = vec![("base", Rows::of(&drawn.before))];
    sides.extend(drawn.after.as_ref().map(|(_, left)| ("named", Rows::of(left))));
    sides.extend(drawn.learnt.as_ref().map(|left| ("learnt", Rows::of(left))));
    let links = drawn.before.values.len();
    let mut csv = "t_s,predicted".to_owned();
    for link in 1..=links {
        let _ = write!(csv, ",theta{link}_measured_rad");
        for (side, _) in &sides {
            let _ = write!(csv, ",theta{link}_{side}_rad,theta{link}_{side}_residual_rad");
        }
    }
    csv.push('\n');
    let mut stamps: Vec<f64> = drawn.before.values.iter().flatten().map(|v| v.t_s).collect();
    stamps.sort_by(f64::total_cmp);
    stamps.dedup();
    for t_s in stamps {
        let predicted = drawn.border_s.is_some_and(|border_s| t_s >= border_s);
        let _ = write!(csv, "{t_s},{}", u8::from(predicted));
        for link in 0..links {
            let found: Vec<Option<(f64, f64)>> = sides.iter_mut().map(|(_, rows)| rows.at(link, t_s)).collect();
            field(&mut csv, found.iter().flatten().next().map(|(measured, _)| *measured));
            for side in found {
                field(&mut csv, side.map(|(_, predicted)| predicted));
                field(&mut csv, side.map(|(measured, predicted)| measured - predicted));
            }
        }
        csv.push('\n');
    }
    Some(csv)
}

/// The torque that the base model lacks, with amplitude and phase of the swing it works on: `figures/where.csv`. `None` where nothing is missing or
/// the camera is at fault.
///
/// ```text
/// A = √(θ² + (θ'/ω)²),   phase = arg(θ − iθ'/ω):   0° at the turning point on the right, 90° moving to the left through the middle
/// ```
pub fn where_curves(diagnosis: &Diagnosis) -> Option<String> {
    let drawn = diagnosis.drawn.as_ref()?;
    let torque = drawn.torque.as_ref().filter(|torque| torque.place != Place::Camera)?;
    let omega_rad_s = std::f64::consts::TAU / drawn.swing_s;
    let mut csv = "t_s,torque_n_m,torque_sd_n_m,angle_rad,rate_rad_s,amplitude_rad,phase_deg\n".to_owned();
    for ((t_s, (course, sd)), (angle, rate)) in torque.t_s.iter().zip(&torque.course).zip(&torque.works_on) {
        let across = rate / omega_rad_s;
        let (amplitude, phase_deg) = (angle.hypot(across), (-across).atan2(*angle).to_degrees().rem_euclid(360.0));
        let _ = writeln!(csv, "{t_s},{course:.6e},{sd:.3e},{angle:.7},{rate:.7},{amplitude:.7},{phase_deg:.2}");
    }
    Some(csv)
}

fn field(csv: &mut String, value: Option<f64>) {
    csv.push(',');
    if let Some(value) = value.filter(|v| v.is_finite()) {
        let _ = write!(csv, "{value:.9}");
    }
}

/// Residuals of each angle, asked for in order of time.
struct Rows<'r> {
    of: &'r Residuals,
    next: Vec<usize>,
}

impl<'r> Rows<'r> {
    fn of(of: &'r Residuals) -> Self {
        Self { of, next: vec![0; of.values.len()] }
    }

    /// Measured and predicted at a stamp.
    fn at(&mut self, link: usize, t_s: f64) -> Option<(f64, f64)> {
        let values = self.of.values.get(link)?;
        while values.get(self.next[link])?.t_s < t_s {
            self.next[link] += 1;
        }
        let value = &values[self.next[link]];
        (value.t_s == t_s).then_some((value.measured_rad, value.predicted_rad))
    }
}

/// A table read back, by the names of its columns; what is no number is absent.
#[derive(Debug, Clone, Default)]
pub struct Curves {
    names: Vec<String>,
    columns: Vec<Vec<Option<f64>>>,
}

impl Curves {
    /// From its text; rows that are too short end in absent values.
    pub fn parse(text: &str) -> Self {
        let mut reader = csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).from_reader(text.as_bytes());
        let names: Vec<String> = reader.headers().map(|h| h.iter().map(str::to_owned).collect()).unwrap_or_default();
        let mut columns = vec![Vec::new(); names.len()];
        for record in reader.records().map_while(std::result::Result::ok) {
            for (k, column) in columns.iter_mut().enumerate() {
                column.push(record.get(k).and_then(|f| f.parse().ok()).filter(|v: &f64| v.is_finite()));
            }
        }
        Self { names, columns }
    }

    /// A column by its name.
    pub fn column(&self, name: &str) -> Option<&[Option<f64>]> {
        self.names.iter().position(|n| n == name).map(|k| self.columns[k].as_slice())
    }

    /// A column without gaps; rows in which it has none are left out of it.
    pub fn numbers(&self, name: &str) -> Vec<f64> {
        self.column(name).map(|c| c.iter().flatten().copied().collect()).unwrap_or_default()
    }

    /// The rows in which a column has this value.
    #[must_use]
    pub fn only(&self, name: &str, value: f64) -> Self {
        let Some(key) = self.column(name) else { return self.clone() };
        let keep: Vec<usize> = (0..key.len()).filter(|row| key[*row] == Some(value)).collect();
        let columns = self.columns.iter().map(|c| keep.iter().map(|row| c[*row]).collect()).collect();
        Self { names: self.names.clone(), columns }
    }

    /// Number of angles.
    pub fn links(&self) -> usize {
        (1..).take_while(|link| self.column(&format!("theta{link}_measured_rad")).is_some()).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Residual;

    #[test]
    fn rows_are_found_by_their_stamps_and_gaps_stay_gaps() {
        let value = |t_s: f64| Residual { t_s, measured_rad: t_s, predicted_rad: 0.5 * t_s, rate_rad_s: 0.0 };
        let residuals =
            Residuals { values: vec![vec![value(0.0), value(2.0)]], rmse_rad: vec![0.0], noise_rad: vec![0.0] };
        let mut rows = Rows::of(&residuals);
        assert_eq!([0.0, 1.0, 2.0, 3.0].map(|t| rows.at(0, t)), [Some((0.0, 0.0)), None, Some((2.0, 1.0)), None]);
    }

    #[test]
    fn a_table_is_read_back_by_the_names_of_its_columns() {
        let curves = Curves::parse("recording,t_s,theta1_measured_rad\n1,0,0.5\n1,1,\n2,0,7\n");
        assert_eq!(curves.only("recording", 1.0).column("theta1_measured_rad"), Some(&[Some(0.5), None][..]));
        assert_eq!((curves.links(), curves.numbers("t_s").len()), (1, 3));
        assert!(Curves::parse("").column("t_s").is_none());
    }
}
