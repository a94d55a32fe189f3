//! A mode's damping ratio, and how it goes with the amplitude.

use serde::Serialize;

use super::envelope::{Envelope, Step};
use super::estimate::Estimate;

/// A change of a damping ratio by less than this part is not told (judgement).
const LEAST_CHANGE: f64 = 0.1;
/// A damping ratio goes with amplitude where it changes by more than this many standard deviations (statistics).
const CHANGES: f64 = 3.0;

/// Whether one damping ratio is above another, by more than the standard deviation of their difference allows, and by enough to be told.
pub(super) fn is_above(high: f64, low: f64, sd: f64) -> bool {
    let change = high - low;
    change > CHANGES * sd && change > LEAST_CHANGE * low.abs()
}

/// ξ, or why the data do not tell it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Damping {
    /// Its interval stays clear of zero.
    Identified(Estimate),
    /// Its interval reaches zero, or holds all that ξ can be.
    NotIdentifiable {
        /// 95 % interval, where it excludes anything.
        estimate: Option<Estimate>,
        /// With the number that makes it so.
        reason: String,
    },
}

impl Damping {
    /// The whole record's ξ, without regard to amplitude, tells a decay whose ξ at small amplitude is open from none at all.
    pub(super) fn of(estimate: Estimate, whole: &Estimate, duration_s: f64) -> Self {
        if estimate.within(0.0, 1.0) && estimate.low > 0.0 {
            return Self::Identified(estimate);
        }
        let bounded = estimate.within(-1.0, 1.0);
        let reason = if bounded && estimate.high <= 0.0 {
            let percent = 100.0 * (-std::f64::consts::TAU * estimate.value).exp_m1();
            format!("the amplitude grows, by {percent:.1} % a cycle: driven, fed by another mode, or two beating")
        } else if whole.within(-1.0, 1.0) && whole.low > 0.0 {
            format!(
                "the swing decays, as with ξ = {:.4} over the record, but what its amplitude, or another mode, does to ξ is not known well enough to tell ξ at small amplitude; use --from for a later, smaller swing",
                whole.value
            )
        } else if bounded {
            format!(
                "the decay over {duration_s:.3} s is smaller than its uncertainty: only ξ ≤ {:.2e} is known, where nothing drives the swing",
                estimate.high
            )
        } else {
            format!("the motion of {duration_s:.3} s is too irregular to determine ξ")
        };
        Self::NotIdentifiable { estimate: Some(estimate).filter(|_| bounded), reason }
    }

    /// The identified value.
    pub fn estimate(&self) -> Option<&Estimate> {
        match self {
            Self::Identified(estimate) => Some(estimate),
            Self::NotIdentifiable { .. } => None,
        }
    }

    /// The interval, identified or not, where it excludes anything.
    pub fn interval(&self) -> Option<&Estimate> {
        match self {
            Self::Identified(estimate) => Some(estimate),
            Self::NotIdentifiable { estimate, .. } => estimate.as_ref(),
        }
    }
}

/// How ξ goes with the amplitude.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Trend {
    /// Drag.
    GrowsWithAmplitude,
    /// Dry friction.
    FallsWithAmplitude,
    /// Both.
    LeastBetween,
    /// No linear damper, and neither of the three.
    Uneven,
}

impl Trend {
    /// Of the steps from window to window: means over fifths of them by amplitude, three standard deviations apart. Every law goes with a power of the amplitude
    /// between that of dry friction, −1, and that of drag, 1: where ξ changes by more than the amplitude does, it is something else, as another mode.
    ///
    /// None where ξ changes by no more than what a linear damper's does.
    pub(super) fn of(envelope: &Envelope, of_linear_damper: f64) -> Option<Self> {
        let mut steps: Vec<_> = envelope.steps.iter().collect();
        steps.sort_by(|a, b| b.amplitude_rad.total_cmp(&a.amplitude_rad));
        let fifth = steps.len().div_ceil(5).max(1);
        let mean = |few: &[&Step]| {
            let (weight, sum) = few.iter().map(|s| &s.damping_ratio).fold((0.0, 0.0), |(w, sum), xi| {
                let certainty = xi.sd.powi(-2);
                (w + certainty, sum + certainty * xi.value)
            });
            [sum / weight, f64::recip(weight).sqrt()]
        };
        let means: Vec<[f64; 2]> = steps.chunks(fifth).map(mean).collect();
        let above = |a: &[f64; 2], b: &[f64; 2]| is_above(a[0], b[0], a[1].hypot(b[1]).hypot(of_linear_damper * b[0]));
        let [large, between @ .., small] = &means[..] else { return Some(Self::Uneven) };
        let amplitudes = steps.first().zip(steps.last()).map(|(a, b)| a.amplitude_rad / b.amplitude_rad);
        let most = means.iter().map(|m| m[0] - 2.0 * m[1]).fold(0.0, f64::max);
        let least = means.iter().map(|m| m[0] + 2.0 * m[1]).fold(f64::INFINITY, f64::min);
        if amplitudes.is_none_or(|ratio| most > ratio * least) {
            return Some(Self::Uneven);
        }
        if !means.iter().any(|a| means.iter().any(|b| above(a, b))) {
            return None;
        }
        Some(match between.iter().min_by(|a, b| a[0].total_cmp(&b[0])) {
            Some(least) if above(large, least) && above(small, least) => Self::LeastBetween,
            _ if above(large, small) => Self::GrowsWithAmplitude,
            _ if above(small, large) => Self::FallsWithAmplitude,
            _ => Self::Uneven,
        })
    }

    /// For a sentence about ξ.
    pub fn words(self) -> &'static str {
        match self {
            Self::GrowsWithAmplitude => "grows with amplitude, as drag does",
            Self::FallsWithAmplitude => "grows as the swing becomes small, as dry friction does",
            Self::LeastBetween => "least at a middle amplitude: dry friction below it, drag above",
            Self::Uneven => "changing in a way that neither dry friction nor drag explains",
        }
    }
}
