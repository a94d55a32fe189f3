//! The decay: turning points, amplitudes of the modes, and the decrement through them.

use super::MOST_MODES;
use crate::identify::signal::Signal;
use crate::report::left::{Identified, Mode};
use crate::report::plot::{Axis, Ink, Plot, Series, Style};

/// Turning points of the angle that moves most, amplitudes of the modes, and the decrement through them.
pub(super) fn decay(found: &Identified, signal: Option<&Signal>) -> Plot {
    let mut points = Scattered::default();
    let links = signal.iter().flat_map(|s| s.links.iter().enumerate());
    if let Some((link, samples)) = links.max_by(|a, b| a.1.range_rad().total_cmp(&b.1.range_rad())) {
        let turning = turning_points(&samples.t_s, &samples.theta_rad, samples.mean_rad());
        points.add(format!("turning points of θ{}", link + 1), Ink::Grey, turning);
    }
    let modes = || found.modes.iter().take(MOST_MODES);
    for mode in modes() {
        let steps =
            mode.envelope.iter().flat_map(|e| &e.steps).filter_map(|s| Some((s.t_s?, s.amplitude_rad?))).collect();
        points.add(format!("amplitude of mode {}", mode.number), Ink::number(mode.number - 1), steps);
    }
    let (at, mut series) = points.aligned();
    series.extend(modes().filter_map(|mode| decrement(mode, &at)));
    Plot {
        id: "decay".into(),
        title: "Decay: peaks, amplitudes and decrement".into(),
        alternative: "Turning points and amplitudes of the modes against time on a logarithmic scale, with the straight line of one decrement".into(),
        caption: "An exponential decay is straight here. The broken line has the decrement over all peaks and passes through the middle of the record: where the \
                  amplitudes leave it, the damping depends on the amplitude. The turning points contain all modes.".into(),
        x: Axis::of("t", "s"),
        y: Axis { is_logarithmic: true, ..Axis::of("amplitude", "mrad") },
        is_time: true,
        at,
        series,
        ..Plot::default()
    }
}

/// The decay with the decrement over all peaks, through the amplitude in the middle of the record.
fn decrement(mode: &Mode, at: &[f64]) -> Option<Series> {
    let steps = &mode.envelope.as_ref()?.steps;
    let middle = steps.get(steps.len() / 2)?;
    let (t0_s, a0_rad) = (middle.t_s?, middle.amplitude_rad?);
    let own = mode.estimators.iter().find(|e| e.method == "decrement")?;
    let rate = std::f64::consts::TAU * own.frequency_hz?.value? * own.damping_ratio?.value?;
    Some(Series {
        name: format!("decrement, mode {}", mode.number),
        ink: Ink::number(mode.number - 1),
        style: Style::Dashed,
        values: at.iter().map(|t| Some(1e3 * a0_rad * (-rate * (t - t0_s)).exp())).collect(),
        ..Series::default()
    })
}

/// Amplitudes (rad) of several series, each at stamps of its own.
#[derive(Default)]
struct Scattered {
    series: Vec<(Series, Vec<(f64, f64)>)>,
}

impl Scattered {
    fn add(&mut self, name: String, ink: Ink, points: Vec<(f64, f64)>) {
        if !points.is_empty() {
            self.series.push((Series { name, ink, style: Style::Dots, ..Series::default() }, points));
        }
    }

    /// All stamps in order, and the values (mrad) of each series at them.
    fn aligned(self) -> (Vec<f64>, Vec<Series>) {
        let mut at: Vec<f64> = self.series.iter().flat_map(|(_, points)| points.iter().map(|p| p.0)).collect();
        at.sort_by(f64::total_cmp);
        at.dedup();
        let placed = |(series, points): (Series, Vec<(f64, f64)>)| {
            let mut values = vec![None; at.len()];
            for (t_s, amplitude_rad) in points {
                let row = at.partition_point(|t| *t < t_s);
                values[row] = Some(1e3 * amplitude_rad).filter(|a| *a > 0.0);
            }
            Series { values, ..series }
        };
        let series = self.series.into_iter().map(placed).collect();
        (at, series)
    }
}

/// The farthest point of each half swing from the middle.
fn turning_points(t_s: &[f64], theta_rad: &[f64], mean_rad: f64) -> Vec<(f64, f64)> {
    let away: Vec<(f64, f64)> = t_s.iter().zip(theta_rad).map(|(t, a)| (*t, a - mean_rad)).collect();
    let halves = away.chunk_by(|a, b| (a.1 > 0.0) == (b.1 > 0.0));
    halves
        .filter(|half| half.len() > 1)
        .filter_map(|half| half.iter().map(|(t, a)| (*t, a.abs())).max_by(|a, b| a.1.total_cmp(&b.1)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turning_points_are_the_farthest_of_each_half_swing() {
        let t: Vec<f64> = (0..8).map(f64::from).collect();
        let angle = [1.1, 1.3, 1.2, 0.9, 0.5, 0.8, 1.4, 1.2];
        let found: Vec<(f64, f64)> =
            turning_points(&t, &angle, 1.0).into_iter().map(|(t, a)| (t, (10.0 * a).round())).collect();
        assert_eq!(found, [(1.0, 3.0), (4.0, 5.0), (6.0, 4.0)]);
    }
}
