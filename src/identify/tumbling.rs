//! A motion that is no swing about rest: a link that turns over, or a chain that swings beyond the horizontal.
//!
//! A link that turns over moves through a full turn or more; from the last time on after which its angle stays within less than one, it swings. A
//! chain of several links whose angle from rest exceeds 90° has passed the largest torque that gravity can set against it; its motion is then in general
//! chaotic, without steady frequencies (Shinbrot et al., Am. J. Phys. 60 (1992) 491). One link alone stays periodic up to the top.

use std::f64::consts::{FRAC_PI_2, TAU};

use serde::Serialize;

use super::signal::{LinkSamples, Signal};
use crate::statistics::median;

/// Samples of the running median that keeps a single wrong one from passing for a turn.
const MEDIAN_OF: usize = 5;
/// Fewest crossings of the resting angle that are swings enough to identify: three cycles.
const FEWEST_CROSSINGS: usize = 6;

/// What keeps a recording from being a swing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tumbling {
    /// Top to bottom, from 1.
    pub link: usize,
    /// When the link turns over for the last time; absent where it only swings beyond the horizontal.
    pub turned_until_s: Option<f64>,
    /// When it does either for the last time.
    pub last_s: f64,
    /// From when on the recording is a swing; absent where too little is left.
    pub swings_from_s: Option<f64>,
    /// In words, with what to do.
    pub statement: String,
}

impl Tumbling {
    /// The motion that lasts longest, if there is one.
    pub fn of(signal: &Signal) -> Option<Self> {
        let chain = signal.links.len() > 1;
        let links = signal.links.iter().map(Smoothed::of);
        let (link, last) = links
            .enumerate()
            .filter_map(|(link, smoothed)| Some((link + 1, smoothed.last_beyond(chain)?)))
            .max_by(|a, b| a.1.last_s().total_cmp(&b.1.last_s()))?;
        let last_s = last.last_s();
        // the reader types a rounded number, which must lie behind the last moment
        let from_s = (100.0 * last_s).floor() / 100.0 + 0.02;
        let rest = signal.between(from_s, f64::INFINITY);
        let enough = rest.links.iter().all(|link| Smoothed::of(link).crossings() >= FEWEST_CROSSINGS);
        let swings_from_s = enough.then_some(from_s);
        let turns = last.turned_s.map(|t| format!("turns over until t = {t:.2} s"));
        let wide = last.wide_s.map(|t| format!("swings beyond 90° from rest until t = {t:.2} s"));
        let what = [turns, wide].into_iter().flatten().collect::<Vec<_>>().join(" and ");
        let remedy = match swings_from_s {
            Some(from_s) => format!("only what follows is used, as with `--from {from_s:.2}`"),
            None => "record on until every link only swings, or release it lower".to_owned(),
        };
        let unit = if last.turned_s.is_none() { " (if these are degrees, multiply by π/180)" } else { "" };
        let statement = format!("θ{link} {what}{unit}, and such a motion has no modes; {remedy}");
        Some(Self { link, turned_until_s: last.turned_s, last_s, swings_from_s, statement })
    }
}

/// When a link last did what is no swing.
struct Last {
    turned_s: Option<f64>,
    wide_s: Option<f64>,
}

impl Last {
    fn last_s(&self) -> f64 {
        self.wide_s.or(self.turned_s).unwrap_or(f64::NEG_INFINITY)
    }
}

/// A link's angles after a running median.
struct Smoothed {
    t_s: Vec<f64>,
    theta_rad: Vec<f64>,
}

impl Smoothed {
    fn of(link: &LinkSamples) -> Self {
        let middle = MEDIAN_OF / 2;
        let theta_rad = link.theta_rad.windows(MEDIAN_OF).filter_map(|few| median(&mut few.to_vec())).collect();
        let t_s = link.t_s.iter().skip(middle).take(link.t_s.len().saturating_sub(2 * middle)).copied().collect();
        Self { t_s, theta_rad }
    }

    /// Index from which on the angle stays within less than a full turn.
    fn settled(&self) -> usize {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let beyond = self.theta_rad.iter().rposition(|a| {
            (low, high) = (low.min(*a), high.max(*a));
            high - low >= TAU
        });
        beyond.map_or(0, |k| k + 1)
    }

    /// The last moments of what is no swing, if there are any.
    fn last_beyond(&self, chain: bool) -> Option<Last> {
        let settled = self.settled();
        let turned_s = settled.checked_sub(1).map(|k| self.t_s[k]);
        let resting_rad = median(&mut self.theta_rad.get(settled..).unwrap_or_default().to_vec());
        // what has turned over comes down from the top, where its frequency changes from swing to swing
        let wide_s = resting_rad.filter(|_| chain || turned_s.is_some()).and_then(|resting_rad| {
            let beyond = self.theta_rad[settled..].iter().rposition(|a| (a - resting_rad).abs() > FRAC_PI_2);
            beyond.map(|k| self.t_s[settled + k])
        });
        (turned_s.is_some() || wide_s.is_some()).then_some(Last { turned_s, wide_s })
    }

    /// How often the angle passes its median.
    fn crossings(&self) -> usize {
        let Some(middle) = median(&mut self.theta_rad.clone()) else { return 0 };
        self.theta_rad.windows(2).filter(|pair| (pair[0] - middle) * (pair[1] - middle) < 0.0).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signal(links: &[&dyn Fn(f64) -> f64]) -> Signal {
        let t_s: Vec<f64> = (0..900).map(|k| f64::from(k) / 30.0).collect();
        let link = |angle: &&dyn Fn(f64) -> f64| LinkSamples {
            theta_rad: t_s.iter().map(|t| angle(*t)).collect(),
            t_s: t_s.clone(),
        };
        Signal { links: links.iter().map(link).collect(), span_s: [0.0, 899.0 / 30.0], step_s: 1.0 / 30.0 }
    }

    fn whirl_then_swing(t: f64) -> f64 {
        if t < 10.0 { 3.0 * t } else { 30.0 + 0.5 * (5.0 * (t - 10.0)).sin() }
    }

    #[test]
    fn a_link_that_turns_over_is_named_with_the_time_that_ends_it() {
        let found = Tumbling::of(&signal(&[&whirl_then_swing])).unwrap();
        // a full turn before 30.5 rad, and beyond 90° from 30 rad
        assert!((7.9..8.4).contains(&found.turned_until_s.unwrap()), "{found:?}");
        assert!((9.4..9.6).contains(&found.last_s), "{found:?}");
        assert!(found.swings_from_s.unwrap() > found.last_s && found.statement.contains("--from 9.4"), "{found:?}");
    }

    #[test]
    fn one_link_may_swing_to_the_top_and_a_chain_may_not() {
        let wide = |t: f64| 2.8 * (-0.1 * t).exp() * (4.0 * t).cos();
        let small = |t: f64| 0.2 * (4.0 * t).cos();
        assert_eq!(Tumbling::of(&signal(&[&wide])), None);
        let found = Tumbling::of(&signal(&[&small, &wide])).unwrap();
        assert!(found.link == 2 && found.turned_until_s.is_none() && found.swings_from_s.is_some(), "{found:?}");
        assert_eq!(Tumbling::of(&signal(&[&small, &small])), None);
    }

    #[test]
    fn a_motion_that_never_settles_has_no_remedy_but_another_recording() {
        let found = Tumbling::of(&signal(&[&|t: f64| 5.0 * t])).unwrap();
        assert!(found.swings_from_s.is_none() && found.statement.contains("record on"), "{found:?}");
    }

    #[test]
    fn one_wrong_sample_is_no_turn() {
        let wrong = |t: f64| if (15.0..15.03).contains(&t) { 9.0 } else { 0.3 * (4.0 * t).cos() };
        assert_eq!(Tumbling::of(&signal(&[&wrong])), None);
    }
}
