//! A number with its 95 % interval.

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, StudentsT};

/// An estimate with its standard deviation and 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// Best value.
    pub value: f64,
    /// Standard deviation.
    pub sd: f64,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Estimate {
    /// A value whose standard deviation was estimated with this many degrees of freedom: value ± t₀.₉₇₅ sd.
    pub fn new(value: f64, sd: f64, degrees_of_freedom: f64) -> Self {
        let half = student_quantile(degrees_of_freedom) * sd;
        Self { value, sd, low: value - half, high: value + half }
    }

    /// The same estimate in another unit.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        let (a, b) = (self.low * factor, self.high * factor);
        Self { value: self.value * factor, sd: self.sd * factor.abs(), low: a.min(b), high: a.max(b) }
    }

    /// A monotonic function of the estimate; its slope gives the standard deviation.
    #[must_use]
    pub fn map(self, function: impl Fn(f64) -> f64, slope: f64) -> Self {
        let (a, b) = (function(self.low), function(self.high));
        Self { value: function(self.value), sd: (self.sd * slope).abs(), low: a.min(b), high: a.max(b) }
    }

    /// With another, independent standard deviation on top.
    #[must_use]
    pub fn blurred(self, sd: f64) -> Self {
        let wider = |half: f64| half.hypot(student_quantile(1e6) * sd);
        Self {
            value: self.value,
            sd: self.sd.hypot(sd),
            low: self.value - wider(self.value - self.low),
            high: self.value + wider(self.high - self.value),
        }
    }

    /// The interval stretched to hold these values, too.
    #[must_use]
    pub fn widened_to_cover(self, low: f64, high: f64) -> Self {
        let (low, high) = (self.low.min(low), self.high.max(high));
        Self { value: self.value, sd: self.sd.max((high - low) / 4.0), low, high }
    }

    /// Half of the interval's width.
    pub fn half(&self) -> f64 {
        0.5 * (self.high - self.low)
    }

    /// Whether all of the interval lies within these limits, its ends finite.
    pub fn within(&self, low: f64, high: f64) -> bool {
        low <= self.low && self.low <= self.value && self.value <= self.high && self.high <= high && self.sd.is_finite()
    }

    /// Whether the interval holds a value.
    pub fn holds(&self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }
}

/// Quantile 0.975 of the normal distribution: half a 95 % interval in standard deviations.
pub const NORMAL_QUANTILE: f64 = 1.959_963_984_540_054;
/// From here on Student's quantile differs from the normal one by less than 3·10⁻⁶ of it; the library's inversion does not end for very many.
const NEARLY_NORMAL: f64 = 5e5;

/// t₀.₉₇₅ of Student's distribution.
pub fn student_quantile(degrees_of_freedom: f64) -> f64 {
    if degrees_of_freedom >= NEARLY_NORMAL {
        return NORMAL_QUANTILE;
    }
    StudentsT::new(0.0, 1.0, degrees_of_freedom.max(1.0)).map_or(NORMAL_QUANTILE, |t| t.inverse_cdf(0.975))
}

/// Probability that χ² with so many degrees of freedom exceeds the value.
pub fn chi_squared_tail(value: f64, degrees_of_freedom: f64) -> f64 {
    ChiSquared::new(degrees_of_freedom).map_or(1.0, |d| d.sf(value.max(0.0)))
}

/// Probability that F exceeds the value.
pub fn f_tail(value: f64, numerator: f64, denominator: f64) -> f64 {
    FisherSnedecor::new(numerator, denominator).map_or(1.0, |d| d.sf(value.max(0.0)))
}

/// A probability as a person reads it: `p = 0.03`, `p < 1e-12`.
pub fn probability(p: f64) -> String {
    match p {
        p if p < 1e-12 => "p < 1e-12".to_owned(),
        p if p < 1e-2 => format!("p = {p:.0e}"),
        p => format!("p = {p:.2}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_agree_with_printed_tables() {
        assert!((student_quantile(1e6) - 1.95997).abs() < 1e-4);
        assert!((student_quantile(5.0) - 2.5706).abs() < 1e-4);
        assert!((chi_squared_tail(3.8415, 1.0) - 0.05).abs() < 1e-5);
        assert!((f_tail(4.9646, 1.0, 10.0) - 0.05).abs() < 1e-5);
    }

    #[test]
    fn an_interval_can_be_scaled_and_stretched() {
        let e = Estimate::new(2.0, 0.1, 1e9).times(-10.0);
        assert!((e.value + 20.0).abs() < 1e-12 && (e.low + 21.96).abs() < 1e-2 && (e.high + 18.04).abs() < 1e-2);
        let wide = e.widened_to_cover(-30.0, -19.0);
        assert!(wide.low == -30.0 && wide.high == e.high && wide.holds(-29.0) && !wide.holds(0.0));
    }
}
