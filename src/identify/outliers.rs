//! Values that stand out from their neighbours: a mark that was taken for another in one frame, a bit that was lost.
//!
//! Each value is held against the cubic through the two before and the two after it. A motion leaves there what is smooth in time, so that neighbours leave as much;
//! a value that leaves far more than those around it is none of the motion's.

use super::signal::{LinkSamples, Signal};
use crate::series::noise::step_rad;
use crate::statistics::median;

/// A value stands out by so many standard deviations of what its neighbours leave (statistics)…
const OUTLIER: f64 = 8.0;
/// … taken from so many to either side, near and far: what dies away fast leaves as much in the near ones.
const AROUND: [usize; 2] = [7, 30];
/// And by so many steps of an encoder, which may rest between two.
const STEPS: f64 = 3.0;
/// Where more than this part stands out, that is how the noise is.
const MOST: f64 = 0.02;
/// Values on each side through which the cubic goes.
const NEAR: usize = 2;

impl Signal {
    /// Without the values that stand out from their neighbours; how many of each link. `None` where there are none.
    #[must_use]
    pub(super) fn without_outliers(&self) -> Option<(Self, Vec<usize>)> {
        let links: Vec<LinkSamples> = self.links.iter().map(without_outliers).collect();
        let counts = self.links.iter().zip(&links).map(|(all, kept)| all.t_s.len() - kept.t_s.len());
        let counts: Vec<usize> = counts.collect();
        counts.iter().any(|count| *count > 0).then(|| (Self { links, ..self.clone() }, counts))
    }
}

/// A link's samples without those that stand out.
fn without_outliers(link: &LinkSamples) -> LinkSamples {
    let mut kept = link.clone();
    let steps = step_rad(&link.theta_rad.iter().copied().map(Some).collect::<Vec<_>>());
    let least = STEPS * steps.unwrap_or(0.0);
    let mut left: Vec<f64> = (0..kept.t_s.len()).map(|k| left_of_cubic(&kept, k)).collect();
    let scale =
        |sizes: &[f64]| 1.4826 * median(&mut sizes.iter().map(|own| own.abs()).collect::<Vec<_>>()).unwrap_or(0.0);
    let everywhere = scale(&left);
    let around = |k: usize| {
        let within = AROUND.map(|rows| scale(&left[k.saturating_sub(rows)..(k + rows + 1).min(left.len())]));
        within.into_iter().fold(everywhere, f64::max)
    };
    let mut limits: Vec<f64> = (0..left.len()).map(|k| (OUTLIER * around(k)).max(least)).collect();
    loop {
        let beyond = left.iter().zip(&limits).map(|(left, limit)| left.abs() - limit).enumerate();
        let Some((k, _)) = beyond.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, beyond)| *beyond > 0.0) else {
            return kept;
        };
        kept.t_s.remove(k);
        kept.theta_rad.remove(k);
        left.remove(k);
        limits.remove(k);
        if (link.t_s.len() - kept.t_s.len()) as f64 > MOST * link.t_s.len() as f64 {
            return link.clone();
        }
        (k.saturating_sub(NEAR)..(k + NEAR).min(left.len())).for_each(|near| left[near] = left_of_cubic(&kept, near));
    }
}

/// A value less the cubic through its neighbours; nothing at the ends.
fn left_of_cubic(link: &LinkSamples, k: usize) -> f64 {
    let (t, a) = (&link.t_s, &link.theta_rad);
    if k < NEAR || k + NEAR >= t.len() {
        return 0.0;
    }
    let near = [k - 2, k - 1, k + 1, k + 2];
    let weight = |i: usize| near.iter().filter(|j| **j != i).map(|j| (t[k] - t[*j]) / (t[i] - t[*j])).product::<f64>();
    a[k] - near.iter().map(|i| a[*i] * weight(*i)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swing(noise_rad: f64, wrong: &[(usize, f64)]) -> LinkSamples {
        let t_s: Vec<f64> = (0..900).map(|k| f64::from(k) / 30.0).collect();
        let angle = |t: &f64| 0.4 * (-0.1 * t).exp() * (5.0 * t).cos() + noise_rad * (1e5 * t * t).sin();
        let mut theta_rad: Vec<f64> = t_s.iter().map(angle).collect();
        wrong.iter().for_each(|(k, by)| theta_rad[*k] += by);
        LinkSamples { t_s, theta_rad }
    }

    #[test]
    fn a_value_that_stands_out_is_left_out_and_no_other() {
        for noise_rad in [0.0, 1e-3] {
            let wrong = [(200, 0.3), (201, -0.4), (640, 0.05)];
            let kept = without_outliers(&swing(noise_rad, &wrong));
            let all = swing(noise_rad, &[]);
            let expected: Vec<f64> =
                all.t_s.iter().enumerate().filter(|(k, _)| ![200, 201, 640].contains(k)).map(|(_, t)| *t).collect();
            assert_eq!(kept.t_s, expected, "{noise_rad}");
            assert_eq!(without_outliers(&all), all);
        }
    }

    #[test]
    fn a_fast_mode_that_dies_away_at_once_is_none() {
        let mut link = swing(3e-4, &[]);
        let fast = |t: f64| 0.05 * (-4.0 * t).exp() * (90.0 * t).cos();
        link.theta_rad.iter_mut().zip(&link.t_s).for_each(|(angle, t)| *angle += fast(*t));
        assert_eq!(without_outliers(&link), link);
    }

    #[test]
    fn an_encoder_that_rests_between_two_steps_keeps_its_values() {
        let mut link = swing(0.0, &[]);
        link.theta_rad.iter_mut().for_each(|a| *a = (*a / 0.01).round() * 0.01);
        link.theta_rad[895] += 0.01;
        assert_eq!(without_outliers(&link), link);
    }
}
