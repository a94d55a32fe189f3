//! The numbers of an effect: sizes and shapes with their standard deviations.

use serde::Serialize;

use super::analysis::Analysis;
use super::fit::Fit;
use super::forms::{Effect, Form, Setting};

/// A value with its standard deviation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quantity {
    /// Its name where it stands in a list.
    #[serde(skip)]
    pub key: String,
    /// The value.
    pub value: f64,
    /// Its standard deviation.
    pub sd: f64,
    /// Its unit.
    pub unit: &'static str,
}

impl Form {
    /// Names of its amplitudes.
    fn sizes(self) -> &'static [&'static str] {
        match self {
            Self::Line => &["over_the_record"],
            Self::Curve => &["linear_over_the_record", "quadratic_over_the_record"],
            Self::Step => &["size", "swing_cosine", "swing_sine"],
            Self::Walk => &[],
            Self::Warmth
            | Self::Lag
            | Self::Pulse
            | Self::Train
            | Self::Warming
            | Self::Slow
            | Self::Creep
            | Self::LogCreep => &["size"],
        }
    }
}

impl Analysis {
    /// Those of an effect in a fit.
    pub fn parameters(&self, fit: &Fit, effect: Effect) -> Vec<Quantity> {
        let swings = &self.noise.swings[..];
        let with = Setting { grid: &self.grid, lamp: &self.lamp, swings, lasts_s: self.grid.duration_s() };
        let sd = |place: usize| fit.covariance[(place, place)].max(0.0).sqrt();
        let of_members: usize = fit.members.iter().map(|member| member.form.count(&with)).sum();
        let mut amplitude = fit.amplitude.len() - of_members;
        let mut coordinate = fit.amplitude.len();
        let mut all = Vec::new();
        for member in &fit.members {
            let (sizes, shapes) = (member.form.sizes(), member.form.shapes(&with));
            if member.form.effect() == effect {
                all.extend(sizes.iter().enumerate().map(|(k, key)| Quantity {
                    key: format!("{key}_m"),
                    value: fit.amplitude[amplitude + k],
                    sd: sd(amplitude + k),
                    unit: "m",
                }));
                all.extend(shapes.iter().zip(&member.shape).enumerate().map(|(k, (shape, at))| Quantity {
                    key: shape.key.to_owned(),
                    value: shape.number(*at),
                    sd: shape.sd(*at, sd(coordinate + k)),
                    unit: shape.unit,
                }));
                if member.form == Form::Walk {
                    let value = fit.walk_m2_s.sqrt();
                    // of a variance known from its likelihood to about an e-folding
                    all.push(Quantity { key: "in_a_second_m".to_owned(), value, sd: 0.3 * value, unit: "m/√s" });
                }
            }
            amplitude += member.form.count(&with);
            coordinate += shapes.len();
        }
        all
    }
}
