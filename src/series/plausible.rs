//! What a table cannot hold if it is one of swings in radians and seconds.

use super::columns::Table;
use super::{AngleSeries, DISPLACEMENT, FEWEST_ROWS, Measured};
use crate::error::Result;
use crate::statistics::median;

/// An angle that varies by less than this (rad) does not swing; the best encoders resolve ten times more.
const STILL_RAD: f64 = 1e-6;

/// No thing before a camera swings more slowly: a pendulum of this period is 900 m long.
const LONGEST_PERIOD_S: f64 = 60.0;
/// The same where rows are a second apart exactly, as frame numbers are; 25 m long.
const LONGEST_BY_FRAME_S: f64 = 10.0;

/// Consecutive swings beyond a full turn that no hanging chain makes.
const IMPOSSIBLE_SWINGS: usize = 4;

/// More than any encoder counts.
const MOST_COUNTS: f64 = 1e9;

impl AngleSeries {
    /// How long a swing of the first link takes, where there are a few.
    pub fn period_s(&self) -> Option<f64> {
        let angles = self.t_s.iter().zip(self.theta_rad.first()?).filter_map(|(t, a)| Some((*t, (*a)?)));
        period_s(&angles.collect::<Vec<_>>())
    }

    /// What to say of stamps in which a swing takes longer than that of any hung thing.
    pub(super) fn slow_clock(&self) -> Option<String> {
        let counts = self.t_s.windows(2).all(|pair| pair[1] - pair[0] == 1.0);
        let longest_s = if counts { LONGEST_BY_FRAME_S } else { LONGEST_PERIOD_S };
        let period_s = self.period_s().filter(|period_s| *period_s > longest_s)?;
        let unit = if counts { "frame numbers: divide by the frame rate" } else { "milliseconds: divide by 1000" };
        Some(format!(
            "{}: a swing takes {period_s:.0} s, as of a pendulum {:.0} m long; t_s looks like {unit}",
            self.path.display(),
            9.81 * (period_s / std::f64::consts::TAU).powi(2)
        ))
    }

    pub(super) fn check(&self, table: &Table, measured: Measured) -> Result<()> {
        let rows = self.len();
        if rows == 0 {
            return Err(table.refuse(None, "holds no row of numbers; measure the recording again"));
        }
        if rows < FEWEST_ROWS {
            let only = if rows == 1 { "one row".to_owned() } else { format!("{rows} rows") };
            return Err(table.refuse(None, &format!("holds {only}; a swing needs at least {FEWEST_ROWS}")));
        }
        for (link, theta) in self.theta_rad.iter().enumerate() {
            let name = match measured {
                Measured::Angles => format!("theta{}_rad", link + 1),
                Measured::Displacement => DISPLACEMENT.to_owned(),
            };
            let values: Vec<f64> = theta.iter().copied().flatten().collect();
            if values.len() < FEWEST_ROWS {
                let message = format!(
                    "{name} has {} value{} in {rows} rows; at least {FEWEST_ROWS} are needed",
                    values.len(),
                    if values.len() == 1 { "" } else { "s" }
                );
                return Err(table.refuse(None, &message));
            }
            let (low, high) =
                values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
            if high - low <= STILL_RAD {
                let message = format!("{name} stays at {low}: nothing swings; check the marks and the column");
                return Err(table.refuse(None, &message));
            }
            let is_angle = measured == Measured::Angles;
            if let Some(swing) = impossible_swing(&values).filter(|_| is_angle) {
                let remedy = if values.iter().all(|value| value.fract() == 0.0 && value.abs() < MOST_COUNTS) {
                    "looks like an encoder's counts; multiply by 2π over its counts a turn (or by π/180 if it is whole degrees)"
                } else {
                    "looks like degrees; multiply by π/180"
                };
                let message = format!(
                    "{name} swings to and fro by {swing:.0} in one go, {:.1} full turns if radians: {remedy}",
                    swing / std::f64::consts::TAU
                );
                return Err(table.refuse(None, &message));
            }
        }
        Ok(())
    }
}

/// The size of a swing that no hanging chain makes in radians, if the values hold it.
///
/// A pendulum turns back only below its upper equilibrium, so between two turning points it covers less than a full turn; a chaotic chain may
/// whirl over the top, but not again and again to one side and as far back. Values with four consecutive swings of more than 2π each between
/// turning points are therefore not radians. Movements below one unit are left out as noise. One-way whirling of any length is legal.
fn impossible_swing(values: &[f64]) -> Option<f64> {
    let swings = swings_beyond(values, 1.0);
    swings
        .windows(IMPOSSIBLE_SWINGS)
        .map(|few| few.iter().copied().fold(f64::INFINITY, f64::min))
        .filter(|least| *least > std::f64::consts::TAU)
        .max_by(f64::total_cmp)
}

/// The usual time from one rise through the middle to the next, where there are a few.
fn period_s(angles: &[(f64, f64)]) -> Option<f64> {
    let (low, high) = angles.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), a| (l.min(a.1), h.max(a.1)));
    let (middle, beyond) = (0.5 * (low + high), 0.1 * (high - low));
    let (mut below, mut rises) = (false, Vec::new());
    for (t_s, angle) in angles {
        if below && angle - middle > beyond {
            rises.push(*t_s);
        }
        below = if below { angle - middle <= beyond } else { middle - angle > beyond };
    }
    let mut periods: Vec<f64> = rises.windows(2).map(|pair| pair[1] - pair[0]).collect();
    median(&mut periods).filter(|_| periods.len() >= 2)
}

/// The distances between consecutive turning points that are at least `least` apart.
fn swings_beyond(values: &[f64], least: f64) -> Vec<f64> {
    let Some(first) = values.first() else { return Vec::new() };
    // the values' extremes since the last turning point
    let (mut low, mut high, mut last) = (*first, *first, None);
    let mut rising: Option<bool> = None;
    let mut swings = Vec::new();
    for value in values {
        (low, high) = (low.min(*value), high.max(*value));
        let turned = match rising {
            None if high - low >= least => Some(*value == high),
            Some(true) if high - value >= least => Some(false),
            Some(false) if value - low >= least => Some(true),
            _ => None,
        };
        if let Some(now_rising) = turned {
            let turning_point = if now_rising { low } else { high };
            if let Some(before) = last.replace(turning_point) {
                swings.push(f64::abs(turning_point - before));
            }
            rising = Some(now_rising);
            (low, high) = (*value, *value);
        }
    }
    swings
}
