//! Time stamps that were rounded: the even clock behind them.
//!
//! Rows of a constant rate whose stamps are written with few decimals lie up to half a unit of the last one from a line, t₀ + k Δt, never further. Where all do,
//! the line's times are the better ones. The rounding of a large swing would else look like another oscillation, or like missing physics: at
//! 100 values per second, 10 ms are a whole step. Times that are uneven by more than the unit stay as they are.

use crate::statistics::median_step_s;

/// Fewest stamps that show that they are even.
const FEWEST: usize = 20;
/// A unit finer than this part of a step is not worth it (judgement).
const FINE: f64 = 1e-4;
/// What is off the line by less than this part of the unit is even as it stands (judgement).
const EVEN: f64 = 0.01;
/// Steps tried, each a hundredth of the usual one less than the one before: the longest that serves leaves the fewest rows out.
const STEPS_TRIED: u32 = 100;
/// A unit beyond this part of a step is told (judgement).
const TOLD: f64 = 0.02;

/// Takes the times of the even clock for stamps written with so many decimals; the step, where that is worth a word.
pub(super) fn set_even(t_s: &mut [f64], decimals: usize) -> Option<f64> {
    let unit_s = 10f64.powi(-i32::try_from(decimals).ok()?);
    let (first, last) = (*t_s.first()?, *t_s.last()?);
    let rows = t_s.len();
    // whole numbers count something else
    if decimals == 0 || rows < FEWEST || unit_s < FINE * (last - first) / rows as f64 {
        return None;
    }
    let by_row = || (0..rows).map(|k| k as f64).collect::<Vec<_>>();
    // where stamps are as coarse as their steps, and rows are left out, the usual step is only nearly theirs
    let usual_s = median_step_s(t_s)?;
    let tried = |k: u32| line(t_s, &rows_of(t_s, usual_s * (1.5 - 0.01 * f64::from(k))), unit_s);
    let left_out = || (0..STEPS_TRIED).find_map(tried);
    let line = line(t_s, &by_row(), unit_s).or_else(left_out)?;
    let Line { step_s, even_s } = line;
    if t_s.iter().zip(&even_s).all(|(t, even)| (t - even).abs() < EVEN * unit_s) {
        return None;
    }
    t_s.copy_from_slice(&even_s);
    (unit_s > TOLD * step_s).then_some(step_s)
}

/// The row of each stamp where some are left out, if the first few lie so far apart: of ever more by the line through those before.
fn rows_of(t_s: &[f64], step_s: f64) -> Vec<f64> {
    let mut line = (t_s[0], step_s);
    let mut rows: Vec<f64> = Vec::new();
    let mut known = FEWEST / 4;
    while rows.len() < t_s.len() {
        known = (known + known / 2).min(t_s.len());
        rows = t_s[..known].iter().map(|t| ((t - line.0) / line.1).round()).collect();
        line = through(&t_s[..known], &rows);
    }
    rows
}

/// The line by least squares: the time of row 0 and the step.
fn through(t_s: &[f64], rows: &[f64]) -> (f64, f64) {
    let n = rows.len() as f64;
    let mean = |of: &[f64]| of.iter().sum::<f64>() / n;
    let (middle, middle_s) = (mean(rows), mean(t_s));
    let (both, own) = rows
        .iter()
        .zip(t_s)
        .fold((0.0, 0.0), |(both, own), (k, t)| (both + (k - middle) * (t - middle_s), own + (k - middle).powi(2)));
    let step_s = both / own;
    (middle_s - middle * step_s, step_s)
}

struct Line {
    step_s: f64,
    even_s: Vec<f64>,
}

/// The line through stamps of these rows, where none is further from it than rounding makes it.
fn line(t_s: &[f64], rows: &[f64], unit_s: f64) -> Option<Line> {
    let (start_s, step_s) = through(t_s, rows);
    let even_s: Vec<f64> = rows.iter().map(|k| start_s + k * step_s).collect();
    // the line itself is known to a part of the unit
    let most_s = unit_s * (0.5 + 2.0 / (rows.len() as f64).sqrt());
    let is_even = even_s.iter().zip(t_s).all(|(even, t)| (even - t).abs() <= most_s);
    let increases = even_s.windows(2).all(|pair| pair[0] < pair[1]);
    (is_even && increases).then_some(Line { step_s, even_s })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rounded(times: impl Iterator<Item = f64>, unit_s: f64) -> Vec<f64> {
        times.map(|t| (t / unit_s).round() * unit_s).collect()
    }

    #[test]
    fn rounded_stamps_are_those_of_the_even_clock() {
        let even = |k: u32| 3.0 + f64::from(k) / 97.3;
        let mut stamps = rounded((0..500).map(even), 0.01);
        let step_s = set_even(&mut stamps, 2).unwrap();
        assert!((step_s * 97.3 - 1.0).abs() < 2e-4);
        assert!((0..500).zip(&stamps).all(|(k, t)| (t - even(k)).abs() < 1e-3));
        // thirds of a hundredth, with rows left out
        let thirtieth = |k: u32| f64::from(k) / 30.0;
        let seen = || (0..300).filter(|k| k % 50 > 7);
        let mut stamps = rounded(seen().map(thirtieth), 1e-3);
        assert!((set_even(&mut stamps, 3).unwrap() * 30.0 - 1.0).abs() < 1e-5);
        assert!(seen().zip(&stamps).all(|(k, t)| (t - thirtieth(k)).abs() < 1e-4));
    }

    #[test]
    fn rows_that_are_left_out_of_stamps_as_coarse_as_their_steps_are_counted() {
        for rate_hz in [60.0, 59.94, 73.1, 47.0] {
            let seen = || (0..900u32).filter(|k| (k * 7919) % 31 > 0 && !(400..420).contains(k));
            let mut stamps = rounded(seen().map(|k| f64::from(k) / rate_hz), 0.01);
            let Some(step_s) = set_even(&mut stamps, 2) else { panic!("{rate_hz}") };
            assert!((step_s * rate_hz - 1.0).abs() < 2e-4, "{rate_hz}: {step_s}");
        }
    }

    #[test]
    fn uneven_stamps_stay_as_they_are() {
        let jittered = |k: u32| f64::from(k) / 30.0 + 4e-3 * f64::from(k * k % 7);
        let stamps = rounded((0..300).map(jittered), 1e-3);
        let mut own = stamps.clone();
        assert_eq!(set_even(&mut own, 3), None);
        assert_eq!(own, stamps);
    }
}
