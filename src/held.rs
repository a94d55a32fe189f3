//! A beginning in which what swings is held still, as by a hand, until it is let go.
//!
//! What is let go at rest stays within 4 % of its range for 0.064 of a period, and passes its middle 0.186 of a period later: 0.34 times that. Let go 2° from the top it stays as long as it then takes to
//! fall (1.06). What stays half as long again was held.

use crate::statistics::median;

/// Part of the range within which a hand holds still.
const STILL: f64 = 0.04;
/// How many times as long as its way to the middle it stays there, at least.
const LONGEST_REST: f64 = 1.5;
/// Values whose median is where it is held.
const FIRST: usize = 5;
/// Fewest values, and fewest passes of the middle, that show a swing.
const FEWEST_VALUES: usize = 30;
const FEWEST_PASSES: usize = 3;

/// When the first of some paths, each of times and values, is let go.
pub fn released_of(paths: impl Iterator<Item = (Vec<f64>, Vec<f64>)>) -> Option<f64> {
    let paths: Vec<(Vec<f64>, Vec<f64>)> = paths.filter(|(t_s, values)| t_s.len() == values.len()).collect();
    // what moves less than the farthest one's noise tells nothing of when it is let go
    let range = paths.iter().filter_map(|(_, values)| range_of(values)).fold(0.0, f64::max);
    let left = paths.iter().filter_map(|(t_s, values)| Some((t_s, values, leaves_at(values, range)?)));
    let (t_s, values, leaves) = left.min_by(|(a, _, i), (b, _, k)| a[*i].total_cmp(&b[*k]))?;
    released_s(t_s, values, leaves)
}

/// From the lowest to the highest value, a fiftieth of them apart.
fn range_of(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    Some(sorted[last * 49 / 50] - sorted[last / 50])
}

/// The first value that is away from where it is held.
fn leaves_at(values: &[f64], range: f64) -> Option<usize> {
    if values.len() < FEWEST_VALUES {
        return None;
    }
    let held = median(&mut values[..FIRST].to_vec())?;
    let is_away = |value: &f64| (value - held).abs() > STILL * range;
    // one value alone may be wrong
    values.windows(2).position(|pair| pair.iter().all(is_away))
}

/// When it is let go: the time of the first value from which on it moves; `None` where it is not held at first.
fn released_s(t_s: &[f64], values: &[f64], leaves: usize) -> Option<f64> {
    let middle = median(&mut values[leaves..].to_vec())?;
    let passes: Vec<f64> = (leaves + 1..values.len())
        .filter(|k| (values[*k] > middle) != (values[k - 1] > middle))
        .map(|k| t_s[k])
        .collect();
    let way_s = passes.first().filter(|_| passes.len() >= FEWEST_PASSES)? - t_s[leaves];
    (t_s[leaves] - t_s[0] > LONGEST_REST * way_s).then_some(t_s[leaves])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swing(t: f64, released_s: f64) -> f64 {
        let noise = 0.003 * (1e5 * t * t).sin();
        if t < released_s { 0.5 + noise } else { 0.5 * (-0.03 * t).exp() * (5.0 * (t - released_s)).cos() + noise }
    }

    fn released(at_s: f64, value: impl Fn(f64) -> f64) -> Option<f64> {
        let t_s: Vec<f64> = (0..360).map(|k| at_s + f64::from(k) / 30.0).collect();
        let values = t_s.iter().map(|t| value(*t)).collect();
        released_of(std::iter::once((t_s, values)))
    }

    #[test]
    fn a_held_beginning_ends_where_it_is_let_go() {
        // the middle is a value where their number is odd
        for released_s in [0.8, 0.8 + 1.0 / 30.0] {
            let found = released(0.0, |t| swing(t, released_s)).unwrap();
            assert!((released_s..released_s + 0.15).contains(&found), "{found}");
        }
    }

    #[test]
    fn what_is_let_go_at_once_or_swings_already_is_not_held() {
        assert_eq!(released(0.0, |t| swing(t, 0.0)), None);
        assert_eq!(released(2.3, |t| swing(t, 0.0)), None);
        assert_eq!(released(0.0, |t| 0.01 * (1e5 * t * t).sin()), None);
        assert_eq!(released(0.0, |_| 0.3), None);
    }

    #[test]
    fn where_one_link_moves_nothing_is_held() {
        let t_s: Vec<f64> = (0..360).map(|k| f64::from(k) / 30.0).collect();
        let path = |value: &dyn Fn(f64) -> f64| (t_s.clone(), t_s.iter().map(|t| value(*t)).collect::<Vec<_>>());
        let [upper, lower] = [path(&|t| 0.5 * swing(t, 0.0)), path(&|t| swing(t, 0.8))];
        assert!(released_of([lower.clone()].into_iter()).is_some());
        assert_eq!(released_of([lower, upper].into_iter()), None);
    }

    #[test]
    fn what_falls_from_near_the_top_is_not_held() {
        let (mut angle, mut rate) = (178f64.to_radians(), 0.0);
        let mut angles = Vec::new();
        for _ in 0..600 {
            angles.push(angle);
            for _ in 0..100 {
                rate -= 25.0 * angle.sin() / 3000.0;
                angle += rate / 3000.0;
            }
        }
        let t_s: Vec<f64> = (0..600).map(|k| f64::from(k) / 30.0).collect();
        assert_eq!(released_of(std::iter::once((t_s, angles))), None);
    }
}
