//! An end in which an encoder's readings stay the same.
//!
//! A thousand equal readings of one rest are one reading: they share its rounding. Counted one by one they outweigh the swing.

use super::AngleSeries;

/// Rows of it that are kept: they show when the swing stops.
const KEPT: usize = 10;
/// Fewest rows of a standstill that is worth leaving out.
const FEWEST: usize = 50;

impl AngleSeries {
    /// Since when no angle changes any more, and the series up to a few rows later, where the rest is long.
    pub fn before_standstill(&self) -> Option<(f64, Self)> {
        let moves = self.theta_rad.iter().map(|theta| last_change(theta)).max()??;
        let rows = moves + 1 + KEPT;
        (rows + FEWEST < self.len()).then(|| (self.t_s[moves + 1], self.slice(0..rows)))
    }
}

/// The last row whose angle is another one than the last angle.
fn last_change(theta: &[Option<f64>]) -> Option<usize> {
    let last = theta.iter().rev().copied().flatten().next()?;
    theta.iter().rposition(|angle| angle.is_some_and(|angle| angle != last))
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::path::Path;

    use super::*;

    fn series(angle: impl Fn(f64) -> f64) -> AngleSeries {
        let mut text = "t_s,theta1_rad,theta2_rad\n".to_owned();
        for row in 0..400 {
            let t = 0.02 * f64::from(row);
            let _ = writeln!(text, "{t:.3},{:.3},{:.3}", angle(t), 2.0 * angle(t));
        }
        AngleSeries::parse(text.as_bytes(), Path::new("a.csv")).unwrap()
    }

    #[test]
    fn equal_readings_at_the_end_are_left_out_but_for_a_few() {
        let (rest_s, swing) =
            series(|t| if t < 4.0 { 0.3 * (6.0 * t).cos() } else { 0.01 }).before_standstill().unwrap();
        assert!((rest_s - 4.0).abs() < 1e-9 && swing.len() == 210, "{rest_s} {}", swing.len());
        assert_eq!(series(|t| 0.3 * (6.0 * t).cos()).before_standstill(), None);
        // a swing that is cut off soon after it stops
        assert_eq!(series(|t| if t < 7.5 { 0.3 * (6.0 * t).cos() } else { 0.01 }).before_standstill(), None);
    }
}
