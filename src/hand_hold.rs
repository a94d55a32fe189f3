//! The part of a recording in which what swings is free: after a hand has let it go, and before it is caught.
//!
//! What is let go at rest stays within 4 % of its range for 0.064 of a period, and passes its middle 0.186 of a period later: 0.34 times that. Let go 2° from the top it stays as long as it then takes to
//! fall (1.06). What stays half as long again was held. It may hang at rest first and be pulled aside then: what counts is the last hold from which it swings, of half a period or longer, as two modes together may pause for less. Caught is the same with time
//! reversed, but away from the middle, where a swing comes to rest by itself.

use crate::statistics::median;

/// Part of the range within which a hand holds still.
const STILL: f64 = 0.04;
/// How many times as long as its way to the middle it stays there, at least.
const LONGEST_REST: f64 = 1.5;
/// A hold after the beginning is at least this part of the swing that follows away from its middle: let go from there, it swings as far.
const ASIDE: f64 = 0.5;
/// And one at the end is this part of the swing before it away from it: dry friction stops a swing within a fifth of what its last passes reached.
const CAUGHT: f64 = 0.35;
/// Values whose median is where it is held.
const FIRST: usize = 5;
/// Fewest values, and fewest passes of the middle, that show a swing.
const FEWEST_VALUES: usize = 30;
const FEWEST_PASSES: usize = 3;
/// Fewest rows from one pass to the next.
const FEWEST_ROWS: usize = 4;

/// When the first of some paths, each of times and values, is let go.
pub fn released_of(paths: impl Iterator<Item = (Vec<f64>, Vec<f64>)>) -> Option<f64> {
    let paths = Paths::of(paths)?;
    let left = paths.each.iter().filter_map(|(t_s, values)| Some((t_s, values, leaves_at(values, paths.range)?)));
    let first = left.min_by(|(a, _, i), (b, _, k)| a[*i].total_cmp(&b[*k]));
    let first = first.and_then(|(t_s, values, leaves)| released_s(t_s, values, leaves));
    paths.released_late().or(first)
}

/// Until when what some paths show, each of times and values, swings freely, if it is caught and held to the end: until it passes its middle for the last time but one. A
/// hand may act on half a swing before it holds.
pub fn caught_of(paths: impl Iterator<Item = (Vec<f64>, Vec<f64>)>) -> Option<f64> {
    let reversed = |values: &[f64], sign: f64| values.iter().rev().map(|value| sign * value).collect::<Vec<f64>>();
    let paths = Paths::of(paths.map(|(t_s, values)| (reversed(&t_s, -1.0), reversed(&values, 1.0))))?;
    let (t_s, values) = paths.widest()?;
    let hold = Swing::of(t_s, values)?.hold(0, paths.range)?;
    let is_caught = hold.aside > CAUGHT * hold.farthest && paths.are_still(t_s[0]..t_s[hold.leaves]);
    is_caught.then(|| -t_s[hold.passes])
}

/// Paths of what swings.
struct Paths {
    /// Times and values.
    each: Vec<(Vec<f64>, Vec<f64>)>,
    /// The widest one's: what moves less than its noise tells nothing of when it is let go.
    range: f64,
}

impl Paths {
    fn of(paths: impl Iterator<Item = (Vec<f64>, Vec<f64>)>) -> Option<Self> {
        let each: Vec<(Vec<f64>, Vec<f64>)> = paths.filter(|(t_s, values)| t_s.len() == values.len()).collect();
        let range = each.iter().filter_map(|(_, values)| range_of(values)).fold(0.0, f64::max);
        (range > 0.0).then_some(Self { each, range })
    }

    fn widest(&self) -> Option<&(Vec<f64>, Vec<f64>)> {
        let range = |path: &&(Vec<f64>, Vec<f64>)| range_of(&path.1).unwrap_or(0.0);
        self.each.iter().max_by(|a, b| range(a).total_cmp(&range(b)))
    }

    /// When it is let go for the last time, where it is pulled aside and held after the recording has begun.
    fn released_late(&self) -> Option<f64> {
        let (t_s, values) = self.widest()?;
        let swing = Swing::of(t_s, values)?;
        let (mut first, mut released) = (1, None);
        while first + FEWEST_VALUES < values.len() {
            let hold = swing.hold(first, self.range).filter(|hold| hold.aside > ASIDE * hold.farthest);
            match hold.filter(|hold| self.are_still(t_s[first]..t_s[hold.leaves])) {
                Some(hold) => (first, released) = (hold.leaves, Some(t_s[hold.leaves])),
                None => first += 1,
            }
        }
        released
    }

    /// Whether all of them stay where they are for a time.
    fn are_still(&self, span_s: std::ops::Range<f64>) -> bool {
        self.each.iter().all(|(t_s, values)| {
            let inside = t_s.iter().zip(values).filter(|(t, _)| span_s.contains(t)).map(|(_, value)| *value);
            let Some(own) = range_of(&inside.collect::<Vec<f64>>()) else { return true };
            own < 2.0 * STILL * self.range
        })
    }
}

/// One path, and where it passes its middle.
struct Swing<'p> {
    t_s: &'p [f64],
    values: &'p [f64],
    middle: f64,
    /// The values after which it has passed it.
    passes: Vec<usize>,
}

/// A stretch in which it is held, before it swings.
struct Hold {
    /// The first value that is away from there.
    leaves: usize,
    /// The first value after its second pass of the middle after that.
    passes: usize,
    /// How far from the middle it is held.
    aside: f64,
    /// How far from it the swing that follows reaches at first.
    farthest: f64,
}

impl<'p> Swing<'p> {
    fn of(t_s: &'p [f64], values: &'p [f64]) -> Option<Self> {
        // it swings in the second half, if anywhere
        let middle = median(&mut values[values.len() / 2..].to_vec())?;
        let passes = (1..values.len()).filter(|k| (values[*k] > middle) != (values[k - 1] > middle)).collect();
        Some(Self { t_s, values, middle, passes })
    }

    /// Whether it is held from one value on, still beside the swing that follows; of all of them this is the range.
    fn hold(&self, first: usize, range: f64) -> Option<Hold> {
        let held = median(&mut self.values[first..].get(..FIRST)?.to_vec())?;
        let of = |range: f64| {
            let is_there = (self.values[first] - held).abs() < STILL * range;
            let leaves = first + leaves_at(&self.values[first..], range)?;
            let next = self.passes.partition_point(|pass| *pass <= leaves);
            let last = *self.passes.get(next + FEWEST_PASSES - 1)?;
            let away = self.values[leaves..=last].iter().map(|value| (value - self.middle).abs());
            // it may have left at any time in a gap
            let still_s = self.t_s[leaves.saturating_sub(1)];
            let way_s = self.t_s[self.passes[next]] - still_s;
            let half_period_s = self.t_s[self.passes[next + 1]] - self.t_s[self.passes[next]];
            // noise stays near a value for a few rows, and passes its middle at every other one
            let is_seen = leaves - first >= 2 * FIRST && self.passes[next + 1] - self.passes[next] >= FEWEST_ROWS;
            let is_held = is_seen && still_s - self.t_s[first] > (LONGEST_REST * way_s).max(half_period_s);
            (is_held && is_there).then(|| Hold {
                leaves,
                passes: self.passes[next + 1],
                aside: (held - self.middle).abs(),
                farthest: away.fold(0.0, f64::max),
            })
        };
        of(range.min(2.0 * of(range)?.farthest))
    }
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
    // it may have left at any time in a gap
    let still_s = t_s[leaves.saturating_sub(1)];
    let way_s = passes.first().filter(|_| passes.len() >= FEWEST_PASSES)? - still_s;
    (still_s - t_s[0] > LONGEST_REST * way_s).then_some(t_s[leaves])
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

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
    fn what_hangs_at_rest_and_is_pulled_aside_is_free_when_it_is_let_go() {
        let pulled = |t: f64| match t {
            t if t < 3.0 => 0.003 * (1e5 * t * t).sin(),
            t if t < 4.5 => 0.5 * (t - 3.0) / 1.5,
            t => swing(t, 5.5),
        };
        let found = released(0.0, pulled).unwrap();
        assert!((5.5..5.65).contains(&found), "{found}");
    }

    #[test]
    fn what_is_braked_once_is_not_held() {
        let braked = |t: f64| if t < 5.0 { swing(t, 0.0) } else { 0.3 * swing(t, 0.0) };
        assert_eq!(released(0.0, braked), None);
    }

    #[test]
    fn what_is_caught_is_free_until_then() {
        let caught = |value: &dyn Fn(f64) -> f64| {
            let t_s: Vec<f64> = (0..360).map(|k| f64::from(k) / 30.0).collect();
            let values = t_s.iter().map(|t| value(*t)).collect();
            caught_of(std::iter::once((t_s, values)))
        };
        let found = caught(&|t| if t < 9.0 { swing(t, 0.0) } else { 0.25 + 0.003 * (1e5 * t * t).sin() }).unwrap();
        // it passes its middle for the last time but one at 12.5 π/5
        assert!((7.8..7.9).contains(&found), "{found}");
        assert_eq!(caught(&|t| swing(t, 0.0)), None);
        // a swing that has become small, and one that comes to rest
        (0..40).for_each(|k| assert_eq!(caught(&|t| (-0.25 * t).exp() * swing(t + 0.05 * f64::from(k), 0.0)), None));
        assert_eq!(caught(&|t| (-0.8 * t).exp() * swing(t, 0.0)), None);
        // one that dry friction stops, beside its middle by at most δ
        for k in 0..20 {
            let (delta, omega) = (0.02 + 0.001 * f64::from(k), 6.0);
            let stopped = |t: f64| {
                let (mut amplitude, mut half) = (0.3, 0.0);
                while amplitude > delta && t > (half + 1.0) * std::f64::consts::PI / omega {
                    (amplitude, half) = (amplitude - 2.0 * delta, half + 1.0);
                }
                let side = if half % 2.0 == 0.0 { 1.0 } else { -1.0 };
                let phase = omega * t - half * std::f64::consts::PI;
                side * if amplitude > delta { (amplitude - delta) * phase.cos() + delta } else { amplitude }
            };
            assert_eq!(caught(&stopped), None, "{delta}");
        }
        assert_eq!(caught(&|t| 0.3 * (-0.1 * t).exp() * (6.0 * t).cos() * (0.3 * t).cos()), None);
    }

    #[test]
    fn a_gap_near_the_beginning_is_no_hold() {
        let rows = (0..360).filter(|k| !(4..8).contains(k)).map(|k| f64::from(k) / 30.0);
        let (t_s, values): (Vec<f64>, Vec<f64>) = rows.map(|t| (t, swing(t, 0.0))).unzip();
        assert_eq!(released_of(std::iter::once((t_s, values))), None);
    }

    #[test]
    fn what_is_let_go_at_once_or_swings_already_is_not_held() {
        assert_eq!(released(0.0, |t| swing(t, 0.0)), None);
        assert_eq!(released(2.3, |t| swing(t, 0.0)), None);
        assert_eq!(released(0.0, |t| 0.01 * (1e5 * t * t).sin()), None);
        assert_eq!(released(0.0, |_| 0.3), None);
        let mut random = rand::rngs::StdRng::seed_from_u64(1);
        for _ in 0..50 {
            let t_s: Vec<f64> = (0..3000).map(|k| f64::from(k) / 30.0).collect();
            let noise: Vec<f64> = t_s.iter().map(|_| random.random_range(-1.0..1.0)).collect();
            assert_eq!(Paths::of([(t_s.clone(), noise.clone())].into_iter()).unwrap().released_late(), None);
            assert_eq!(caught_of([(t_s, noise)].into_iter()), None);
        }
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
