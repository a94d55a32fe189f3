//! In what the size of a motion is told: angles in degrees, or the displacement of one mark in pixels.

use serde_json::Value;

use super::estimate::Estimate;
use super::table::interval;
use crate::series::{Measured, PX_PER_RAD};

impl Measured {
    /// A size with its unit, to so many digits.
    pub(super) fn show(self, size_rad: f64, digits: usize) -> String {
        let space = if self == Self::Angles { "" } else { " " };
        format!("{:.digits$}{space}{}", self.shown(size_rad), self.symbol())
    }

    /// A size as it is printed.
    pub(super) fn shown(self, size_rad: f64) -> f64 {
        match self {
            Self::Angles => size_rad.to_degrees(),
            Self::Displacement => PX_PER_RAD * size_rad,
        }
    }

    /// Its unit.
    pub(super) const fn symbol(self) -> &'static str {
        match self {
            Self::Angles => "°",
            Self::Displacement => "px",
        }
    }

    /// The unit of coefficients.
    pub(super) const fn own(self) -> &'static str {
        match self {
            Self::Angles => "rad",
            Self::Displacement => "px",
        }
    }

    /// So many of it are a radian.
    pub(super) const fn own_per_rad(self) -> f64 {
        match self {
            Self::Angles => 1.0,
            Self::Displacement => PX_PER_RAD,
        }
    }

    /// What a link's column is called.
    pub(super) fn name(self, link: usize) -> String {
        match self {
            Self::Angles => format!("θ{}", link + 1),
            Self::Displacement => "displacement".to_owned(),
        }
    }

    /// So many columns in words.
    pub(super) fn columns(self, count: usize) -> String {
        match self {
            Self::Angles => format!("{count} angle{}", if count == 1 { "" } else { "s" }),
            Self::Displacement => "the displacement of one mark".to_owned(),
        }
    }

    /// A coefficient of the square of an amplitude, with its interval.
    pub(super) fn interval_per_square(self, coefficient: &Estimate) -> String {
        match self {
            Self::Angles => format!("{} /rad²", interval(coefficient, 4)),
            Self::Displacement => {
                let own = coefficient.times(self.own_per_rad().powi(-2));
                format!("{:.3e} [{:.3e}, {:.3e}] /px²", own.value, own.low, own.high)
            }
        }
    }

    /// The same with its standard deviation.
    pub(super) fn per_square(self, value_per_rad2: f64, sd_per_rad2: f64) -> String {
        let [value, sd] = [value_per_rad2, sd_per_rad2].map(|own| own * self.own_per_rad().powi(-2));
        match self {
            Self::Angles => format!("{value:.4} ± {sd:.4} /rad²"),
            Self::Displacement => format!("{value:.1e} ± {sd:.0e} /px²"),
        }
    }
}

/// The words by which keys tell their unit, those of pixels, and the power of a radian that they mean.
const KEYS: [(&str, &str, i32); 4] =
    [("per_rad2", "per_px2", -2), ("per_rad_s", "per_px_s", -1), ("rad_per_s", "px_per_s", 1), ("_rad", "_px", 1)];

/// A report's JSON of a displacement: what holds radians holds pixels, and is called so.
pub(super) fn in_px(json: Value) -> Value {
    match json {
        Value::Array(items) => items.into_iter().map(in_px).collect(),
        Value::Object(entries) => {
            let entry = |(key, value): (String, Value)| match KEYS.iter().find(|own| key.ends_with(own.0)) {
                // a phase is an angle in any case
                Some((rad, px, power)) if !key.starts_with("phase") => {
                    (key.replace(rad, px), times(value, PX_PER_RAD.powi(*power)))
                }
                _ => (key, in_px(value)),
            };
            Value::Object(entries.into_iter().map(entry).collect())
        }
        other => other,
    }
}

/// Every number in a value, times a factor.
fn times(json: Value, factor: f64) -> Value {
    match json {
        Value::Number(number) => number.as_f64().map_or(Value::Null, |number| Value::from(factor * number)),
        Value::Array(items) => items.into_iter().map(|item| times(item, factor)).collect(),
        Value::Object(entries) => entries.into_iter().map(|(key, value)| (key, times(value, factor))).collect(),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_holds_radians_holds_pixels_under_another_name() {
        let of = |text: &str| serde_json::from_str::<Value>(text).unwrap();
        let own = of(
            r#"{"modes": [{"amplitude_rad": 0.05, "phase_to_first_rad": 1.0, "kappa_per_rad2": {"value": 2.0}, "b2_per_rad_s": 1.0}], "noise_rad": [1e-4]}"#,
        );
        let px = of(
            r#"{"modes": [{"amplitude_px": 50.0, "phase_to_first_rad": 1.0, "kappa_per_px2": {"value": 2e-6}, "b2_per_px_s": 1e-3}], "noise_px": [0.1]}"#,
        );
        assert_eq!(in_px(own), px);
    }
}
