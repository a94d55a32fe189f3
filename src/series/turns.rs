//! Angles that were wrapped to one turn.

use std::f64::consts::TAU;

use super::AngleSeries;
use crate::angles::unwrap_turns;
use crate::statistics::median;

/// Of a turn: a wrapped angle jumps by nearly all of it where it passes the end of its range (physics: no link turns so far from row to row that a swing is still seen).
const JUMP: f64 = 0.75;
/// Wrapped angles stay within a turn, but for rounding.
const ONE_TURN: f64 = 1.001;

impl AngleSeries {
    /// Takes out the jumps of angles that were wrapped to one turn, so that each goes on where it left off, and says which it was. Its median is then within half a turn of the
    /// downward vertical.
    pub(super) fn take_out_turns(&mut self) {
        for (link, theta) in self.theta_rad.iter_mut().enumerate() {
            if !is_wrapped(theta) {
                continue;
            }
            unwrap_turns(theta.iter_mut().flatten());
            let middle_rad = median(&mut theta.iter().copied().flatten().collect::<Vec<_>>()).unwrap_or(0.0);
            let whole_rad = (middle_rad / TAU).round() * TAU;
            theta.iter_mut().flatten().for_each(|angle| *angle -= whole_rad);
            self.warnings.push(format!(
                "{}: theta{}_rad jumps by full turns, as wrapped angles do: taken out",
                self.path.display(),
                link + 1
            ));
        }
    }
}

fn is_wrapped(theta: &[Option<f64>]) -> bool {
    let known: Vec<f64> = theta.iter().copied().flatten().collect();
    let (low, high) = known.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    high - low <= ONE_TURN * TAU && known.windows(2).any(|pair| (pair[1] - pair[0]).abs() > JUMP * TAU)
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;
    use std::path::Path;

    use super::*;

    fn read(angle: impl Fn(f64) -> f64) -> AngleSeries {
        let mut table = "t_s,theta1_rad\n".to_owned();
        for row in 0..900 {
            let t_s = f64::from(row) / 30.0;
            let _ = writeln!(table, "{t_s},{}", angle(t_s));
        }
        AngleSeries::parse(table.as_bytes(), Path::new("wrapped.csv")).unwrap()
    }

    #[test]
    fn angles_of_an_encoder_from_zero_to_a_turn_swing_about_zero() {
        let swing = |t_s: f64| 0.3 * (4.0 * t_s).cos();
        let found = read(|t_s| swing(t_s).rem_euclid(TAU));
        let far = found.t_s.iter().zip(&found.theta_rad[0]).map(|(t, angle)| (angle.unwrap() - swing(*t)).abs());
        assert!(far.fold(0.0, f64::max) < 1e-9 && found.warnings[0].contains("taken out"), "{:?}", found.warnings);
        assert!(read(swing).warnings.is_empty());
    }

    #[test]
    fn a_link_that_whirls_goes_on_turning() {
        let whirl = |t_s: f64| if t_s < 10.0 { 3.0 * t_s } else { 30.0 + 0.5 * (5.0 * (t_s - 10.0)).sin() };
        let found = read(|t_s| whirl(t_s).sin().atan2(whirl(t_s).cos()));
        let of = |row: usize| found.theta_rad[0][row].unwrap();
        assert!((of(899) - of(0) - (whirl(899.0 / 30.0) - whirl(0.0))).abs() < 1e-9);
        assert!(of(899).abs() < std::f64::consts::PI);
    }
}
