//! The angles of a recording, ready to be fitted.

use std::ops::Range;
use std::path::PathBuf;

use crate::error::{Error, Result};
use crate::series::AngleSeries;
use crate::series::noise::rounding_in_step;

/// Errors of a tracked angle in step with the swing, as a share of its noise: 0.007 px beside a noise of 0.025 to 0.035 px in the training videos of the
/// concealed benchmark (training bank).
const TRACKED_IN_STEP: f64 = 0.25;

/// A bend that is not seen: no share of it is zero (numerics).
const LEAST_BEND_RAD: f64 = 1e-6;

/// One recording of a specimen.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// For messages.
    pub path: PathBuf,
    /// Time stamps.
    pub t_s: Vec<f64>,
    /// `[link][row]`; absent where it was not measured.
    pub theta_rad: Vec<Vec<Option<f64>>>,
    /// Relative standard deviation of each value, `[link][row]`: 1 where the table says nothing.
    pub relative_sd: Vec<Vec<f64>>,
    /// Errors in step with the swing that each angle may have, as a share of its noise: none where the table holds nothing but angles.
    pub synchronous: f64,
    /// The part of an encoder's rounding that is in step with the swing, as a share of its noise ([`rounding_in_step`]). The recorded angles, rounded themselves, do
    /// not show where it is.
    pub rounding: f64,
    /// Whether it goes on where the record before it ends: a piece of the same recording, with a start of its own.
    pub continues: bool,
    /// The usual standard deviation that a tracker states of each angle: it counts errors that go on from frame to frame, which do not show between neighbours. Empty
    /// unless `track` wrote the table.
    pub stated_rad: Vec<f64>,
}

/// Refuses to fit where there is nothing to fit.
///
/// # Errors
/// [`Error::Simulation`] where there is no recording, or one without rows.
pub fn refuse_empty(records: &[Record]) -> Result<()> {
    if records.is_empty() || records.iter().any(Record::is_empty) {
        let detail = "a recording without rows, or none at all; give tables with angles".to_owned();
        return Err(Error::Simulation { detail });
    }
    Ok(())
}

impl Record {
    /// Angles that are all known equally well, with nothing but noise in them.
    pub fn uniform(path: impl Into<PathBuf>, t_s: Vec<f64>, theta_rad: Vec<Vec<Option<f64>>>) -> Self {
        Self {
            path: path.into(),
            relative_sd: vec![vec![1.0; t_s.len()]; theta_rad.len()],
            t_s,
            theta_rad,
            synchronous: 0.0,
            rounding: 0.0,
            continues: false,
            stated_rad: Vec::new(),
        }
    }

    /// The angles of a table with the given number of links; standard deviations in it count relative to each other.
    ///
    /// # Errors
    /// [`Error::Table`] when the number of angles is not the model's.
    pub fn of(series: &AngleSeries, links: usize) -> Result<Self> {
        if series.links() != links {
            let message = format!(
                "has {} angle{}, and the specimen {links} link{}; describe the specimen as it was filmed (specimen.link_lengths_m or [[specimen.links]])",
                series.links(),
                if series.links() == 1 { "" } else { "s" },
                if links == 1 { "" } else { "s" },
            );
            return Err(Error::Table { path: series.path.clone(), line: None, message });
        }
        let usual_rad: Vec<Option<f64>> = (0..links).map(|link| series.usual_sd_rad(link)).collect();
        let relative_sd = series.sd_rad.iter().zip(&usual_rad).map(|(sd, usual)| relative(sd, *usual)).collect();
        Ok(Self {
            path: series.path.clone(),
            t_s: series.t_s.clone(),
            theta_rad: series.theta_rad.clone(),
            relative_sd,
            synchronous: if series.tracked { TRACKED_IN_STEP } else { 0.0 },
            rounding: if series.tracked { 0.0 } else { rounding_in_step(&series.t_s, &series.theta_rad) },
            continues: false,
            stated_rad: if series.tracked {
                usual_rad.into_iter().map(|usual| usual.unwrap_or(0.0)).collect()
            } else {
                Vec::new()
            },
        })
    }

    /// The rows before one.
    #[must_use]
    pub fn until(&self, row: usize) -> Self {
        self.rows(0..row)
    }

    /// The rows from one on.
    #[must_use]
    pub fn from_row(&self, row: usize) -> Self {
        self.rows(row..self.len())
    }

    /// Some rows.
    #[must_use]
    pub fn rows(&self, rows: Range<usize>) -> Self {
        Self {
            path: self.path.clone(),
            t_s: self.t_s[rows.clone()].to_vec(),
            theta_rad: self.theta_rad.iter().map(|column| column[rows.clone()].to_vec()).collect(),
            relative_sd: self.relative_sd.iter().map(|column| column[rows.clone()].to_vec()).collect(),
            synchronous: self.synchronous,
            rounding: self.rounding,
            continues: self.continues,
            stated_rad: self.stated_rad.clone(),
        }
    }

    /// From its first stamp to its last.
    pub fn span_s(&self) -> f64 {
        self.t_s.last().zip(self.t_s.first()).map_or(0.0, |(last, first)| last - first)
    }

    /// As many pieces of some length as it holds, of about as many rows each; itself where it is shorter.
    pub fn pieces(&self, length_s: f64) -> Vec<Self> {
        self.cut((self.span_s() / length_s) as usize)
    }

    /// So many pieces of about as many rows each, at least one.
    pub fn cut(&self, count: usize) -> Vec<Self> {
        let border = |piece: usize| piece * self.len() / count.max(1);
        let piece = |k: usize| Self { continues: self.continues || k > 0, ..self.rows(border(k)..border(k + 1)) };
        (0..count.max(1)).map(piece).collect()
    }

    /// Pieces put together again; nothing of none.
    pub fn joined(pieces: &[Self]) -> Option<Self> {
        let (first, others) = pieces.split_first()?;
        let mut whole = first.clone();
        for piece in others {
            whole.t_s.extend_from_slice(&piece.t_s);
            let columns = whole.theta_rad.iter_mut().zip(&piece.theta_rad);
            columns.for_each(|(whole, piece)| whole.extend_from_slice(piece));
            let columns = whole.relative_sd.iter_mut().zip(&piece.relative_sd);
            columns.for_each(|(whole, piece)| whole.extend_from_slice(piece));
        }
        Some(whole)
    }

    /// The largest angle of any link, to either side.
    pub fn largest_angle_rad(&self) -> f64 {
        self.theta_rad.iter().flatten().flatten().fold(0.0, |most, angle| most.max(angle.abs()))
    }

    /// The bend that every joint reaches: of each the largest difference of its two angles, of these the least; of one link its largest angle. Never zero.
    pub fn common_bend_rad(&self) -> f64 {
        let of = |pair: &[Vec<Option<f64>>]| {
            let bends = pair[0].iter().zip(&pair[1]).filter_map(|(upper, lower)| Some(((*lower)? - (*upper)?).abs()));
            bends.fold(0.0, f64::max)
        };
        let least = self.theta_rad.windows(2).map(of).reduce(f64::min);
        least.unwrap_or_else(|| self.largest_angle_rad()).max(LEAST_BEND_RAD)
    }

    /// Number of angles.
    pub fn links(&self) -> usize {
        self.theta_rad.len()
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.t_s.len()
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.t_s.is_empty()
    }

    /// Number of values in some rows.
    pub fn values(&self, rows: Range<usize>) -> usize {
        self.theta_rad.iter().map(|angles| angles[rows.clone()].iter().flatten().count()).sum()
    }

    /// Angles at a row, then their rates ([`Self::state_near`]).
    pub fn start_near(&self, row: usize, reach_s: f64) -> Vec<f64> {
        let near = self.state_near(row, reach_s);
        [0, 1].iter().flat_map(|part| near.iter().map(move |state| state[*part])).collect()
    }

    /// Angle and rate of each link at a row, from a cubic through the values nearby; the rms of what the cubic leaves comes third.
    /// Where nothing was measured nearby, the nearest value at rest.
    pub fn state_near(&self, row: usize, reach_s: f64) -> Vec<[f64; 3]> {
        let t0_s = self.t_s[row];
        self.theta_rad
            .iter()
            .map(|angles| {
                let nearby = |reach_s: f64| -> Vec<(f64, f64)> {
                    let inside = |i: &usize| (self.t_s[*i] - t0_s).abs() <= reach_s;
                    let (below, above) = ((0..row).rev().take_while(inside), (row..self.len()).take_while(inside));
                    below.chain(above).filter_map(|i| Some((self.t_s[i] - t0_s, angles[i]?))).collect()
                };
                let mut points = nearby(reach_s);
                if points.len() < 5 {
                    points = nearby(2.0 * reach_s);
                }
                local_cubic(&points).unwrap_or_else(|| {
                    let nearest = (0..self.len())
                        .filter_map(|i| Some(((self.t_s[i] - t0_s).abs(), angles[i]?)))
                        .min_by(|a, b| a.0.total_cmp(&b.0));
                    [nearest.map_or(0.0, |(_, angle)| angle), 0.0, 0.0]
                })
            })
            .collect()
    }
}

/// Which records are pieces of one recording, for each recording.
pub fn recordings(records: &[Record]) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    for (place, record) in records.iter().enumerate() {
        match found.last_mut() {
            Some(last) if record.continues => last.end = place + 1,
            _ => found.push(place..place + 1),
        }
    }
    found
}

/// Value, slope and residual rms at zero of the cubic (or the highest lower power) through some points.
fn local_cubic(points: &[(f64, f64)]) -> Option<[f64; 3]> {
    if points.len() < 3 {
        return None;
    }
    let columns = 4.min(points.len() - 1);
    let scale = points.iter().fold(0.0f64, |a, p| a.max(p.0.abs())).max(f64::MIN_POSITIVE);
    let basis = nalgebra::DMatrix::from_fn(points.len(), columns, |i, k| (points[i].0 / scale).powi(k as i32));
    let values = nalgebra::DVector::from_iterator(points.len(), points.iter().map(|p| p.1));
    let fitted = basis.clone().svd(true, true).solve(&values, 1e-10).ok()?;
    let left = values - basis * &fitted;
    let freedom = (points.len() - columns).max(1) as f64;
    Some([fitted[0], fitted[1] / scale, (left.norm_squared() / freedom).sqrt()])
}

/// Standard deviations over the usual one; a value without one counts like it.
fn relative(sd_rad: &[Option<f64>], usual_rad: Option<f64>) -> Vec<f64> {
    let Some(usual_rad) = usual_rad else { return vec![1.0; sd_rad.len()] };
    // a stated error of next to nothing must not outweigh everything else
    sd_rad.iter().map(|sd| sd.map_or(1.0, |sd| (sd / usual_rad).clamp(0.3, 30.0))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(rows: usize) -> Record {
        Record {
            synchronous: 0.25,
            ..Record::uniform(
                "made",
                (0..rows).map(|row| 0.1 * row as f64).collect(),
                vec![(0..rows).map(|row| (row % 7 > 0).then_some(row as f64)).collect(); 2],
            )
        }
    }

    #[test]
    fn pieces_are_the_recording_again_when_joined_and_are_counted_as_one() {
        let whole = record(103);
        let pieces = whole.cut(4);
        assert_eq!(pieces.iter().map(Record::len).collect::<Vec<_>>(), [25, 26, 26, 26]);
        assert_eq!(pieces.iter().map(|piece| piece.continues).collect::<Vec<_>>(), [false, true, true, true]);
        assert_eq!(Record::joined(&pieces), Some(whole));
        let with_another = [pieces.as_slice(), &record(20).cut(2)].concat();
        assert_eq!(recordings(&with_another), [0..4, 4..6]);
        assert_eq!(Record::joined(&[]), None);
    }
}
