//! Time stamps that were rounded: the even clock behind them.
//!
//! Rows of a constant rate whose stamps are written with few decimals lie up to half a unit of the last one from a line, t₀ + k Δt, never further. Where all do,
//! the line's times are the better ones. The rounding of a large swing would else look like another oscillation, or like missing physics: at
//! 100 values a second, 10 ms are a whole step. Times that are uneven by more than the unit stay as they are.

/// Fewest stamps that show that they are even.
const FEWEST: usize = 20;
/// A unit finer than this part of a step is not worth it (judgement).
const FINE: f64 = 1e-4;
/// What is off the line by less than this part of the unit is even as it stands (judgement).
const EVEN: f64 = 0.01;
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
    let by_step = || {
        let step_s = crate::statistics::median_step_s(t_s).filter(|step_s| *step_s > 0.0)?;
        // from stamp to stamp: the median is rounded as well
        let steps = t_s.windows(2).map(|pair| ((pair[1] - pair[0]) / step_s).round());
        let rows = std::iter::once(0.0).chain(steps).scan(0.0, |row, step| {
            *row += step;
            Some(*row)
        });
        Some(rows.collect::<Vec<_>>())
    };
    let line = line(t_s, &by_row(), unit_s).or_else(|| line(t_s, &by_step()?, unit_s))?;
    let Line { step_s, even_s } = line;
    if t_s.iter().zip(&even_s).all(|(t, even)| (t - even).abs() < EVEN * unit_s) {
        return None;
    }
    t_s.copy_from_slice(&even_s);
    (unit_s > TOLD * step_s).then_some(step_s)
}

struct Line {
    step_s: f64,
    even_s: Vec<f64>,
}

/// The line through stamps of these rows, where none is further from it than rounding makes it.
fn line(t_s: &[f64], rows: &[f64], unit_s: f64) -> Option<Line> {
    let n = rows.len() as f64;
    let mean = |of: &[f64]| of.iter().sum::<f64>() / n;
    let (middle, middle_s) = (mean(rows), mean(t_s));
    let (mut both, mut own) = (0.0, 0.0);
    for (k, t) in rows.iter().zip(t_s) {
        both += (k - middle) * (t - middle_s);
        own += (k - middle).powi(2);
    }
    let step_s = both / own;
    let even_s: Vec<f64> = rows.iter().map(|k| middle_s + (k - middle) * step_s).collect();
    // the line itself is known to a part of the unit
    let most_s = unit_s * (0.5 + 2.0 / n.sqrt());
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
    fn uneven_stamps_stay_as_they_are() {
        let jittered = |k: u32| f64::from(k) / 30.0 + 4e-3 * f64::from(k * k % 7);
        let stamps = rounded((0..300).map(jittered), 1e-3);
        let mut own = stamps.clone();
        assert_eq!(set_even(&mut own, 3), None);
        assert_eq!(own, stamps);
    }
}
