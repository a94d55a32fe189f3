//! The time-stamp audit: gaps, duplicates, jitter, and whether the stated rate is the real one.

use serde::{Deserialize, Serialize};

/// A step much longer than usual.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// The frame before the gap.
    pub after_frame: usize,
    /// Its time stamp.
    pub t_s: f64,
    /// Length of the step.
    pub step_s: f64,
    /// Frames that would fill it.
    pub missing_frames: u64,
}

/// What the time stamps look like.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Timing {
    /// Frames.
    pub frames: usize,
    /// First time stamp.
    pub first_s: f64,
    /// Last time stamp.
    pub last_s: f64,
    /// Rate that the file states.
    pub nominal_rate_hz: Option<f64>,
    /// Frames per second between gaps, from the stamps.
    pub real_rate_hz: Option<f64>,
    /// Median step.
    pub median_step_s: f64,
    /// Shortest step.
    pub shortest_step_s: f64,
    /// Longest step.
    pub longest_step_s: f64,
    /// Standard deviation of the steps between gaps.
    pub jitter_sd_s: f64,
    /// Steps of zero length or backwards, by the later frame.
    pub repeated_or_backward_frames: Vec<usize>,
    /// Number of steps longer than one and a half median ones.
    pub gap_count: usize,
    /// Frames missing in all gaps.
    pub missing_frames: u64,
    /// The longest gaps, in order of time.
    pub gaps: Vec<Gap>,
    /// One tick of the time stamps.
    pub tick_s: f64,
}

/// Gaps that are listed one by one.
const LISTED_GAPS: usize = 100;
/// Scatter of the steps between gaps, over the usual one, of a camera whose rate varies: one of a constant rate rounds its stamps, or repeats a picture now and then.
const VARYING_RATE: f64 = 0.1;
/// Relative difference of stated and real rate that is worth a warning.
pub const RATE_TOLERANCE: f64 = 2e-3;

impl Timing {
    /// Audits the stamps of all frames.
    pub fn audit(t_s: &[f64], nominal_rate_hz: Option<f64>, tick_s: f64) -> Self {
        let steps: Vec<f64> = t_s.windows(2).map(|w| w[1] - w[0]).collect();
        let (Some(first), Some(last), false) = (t_s.first(), t_s.last(), steps.is_empty()) else {
            let at = t_s.first().copied().unwrap_or_default();
            return Self { frames: t_s.len(), first_s: at, last_s: at, nominal_rate_hz, tick_s, ..Self::default() };
        };
        let mut sorted = steps.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted[sorted.len() / 2];
        let mut gaps: Vec<Gap> = steps
            .iter()
            .enumerate()
            .filter(|(_, s)| median > 0.0 && **s > 1.5 * median)
            .map(|(i, s)| Gap {
                after_frame: i,
                t_s: t_s[i],
                step_s: *s,
                missing_frames: ((s / median).round() as u64).saturating_sub(1),
            })
            .collect();
        let regular: Vec<f64> = steps.iter().copied().filter(|s| *s > 0.0 && *s <= 1.5 * median).collect();
        let mean = regular.iter().sum::<f64>() / regular.len().max(1) as f64;
        let variance = regular.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / regular.len().max(1) as f64;
        let (gap_count, missing_frames) = (gaps.len(), gaps.iter().map(|g| g.missing_frames).sum());
        gaps.sort_by(|a, b| b.step_s.total_cmp(&a.step_s));
        gaps.truncate(LISTED_GAPS);
        gaps.sort_by_key(|g| g.after_frame);
        Self {
            frames: t_s.len(),
            first_s: *first,
            last_s: *last,
            nominal_rate_hz,
            real_rate_hz: (mean > 0.0).then(|| 1.0 / mean),
            median_step_s: median,
            shortest_step_s: sorted[0],
            longest_step_s: sorted[sorted.len() - 1],
            jitter_sd_s: variance.sqrt(),
            repeated_or_backward_frames: (1..t_s.len()).filter(|i| steps[i - 1] <= 0.0).collect(),
            gap_count,
            missing_frames,
            gaps,
            tick_s,
        }
    }

    /// The camera takes its frames at no constant rate, so that a long step is no gap.
    pub fn varies(&self) -> bool {
        self.jitter_sd_s > VARYING_RATE * self.median_step_s
    }

    /// What a person should know.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.varies() {
            warnings.push(format!(
                "the frame rate varies, from one frame to the next it is {:.3} to {:.3} s; the time stamps are used; whether frames are missing, they do not tell",
                self.shortest_step_s, self.longest_step_s
            ));
        } else if let (Some(nominal), Some(real)) = (self.nominal_rate_hz, self.real_rate_hz)
            && (real / nominal - 1.0).abs() > RATE_TOLERANCE
        {
            warnings.push(format!(
                "the file states {nominal:.3} frames per second, its time stamps say {real:.3} between gaps; the stamps are used"
            ));
        }
        if self.gap_count > 0 && !self.varies() {
            warnings.push(format!(
                "{} gap{} in the time stamps, {} frame{} missing, the longest {:.3} s",
                self.gap_count,
                plural(self.gap_count),
                self.missing_frames,
                plural(self.missing_frames as usize),
                self.longest_step_s
            ));
        }
        if let Some(frame) = self.repeated_or_backward_frames.first() {
            let count = self.repeated_or_backward_frames.len();
            warnings.push(format!(
                "{count} frame{} with a repeated or backward time stamp, the first is frame {frame}; identify, fit and diagnose leave such frames out",
                plural(count)
            ));
        }
        warnings
    }
}

fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dropped_frame_is_a_gap_of_one() {
        let t: Vec<f64> = (0..100).filter(|i| *i != 40).map(|i| f64::from(i) / 30.0).collect();
        let timing = Timing::audit(&t, Some(30.0), 1e-3);
        assert_eq!((timing.gap_count, timing.missing_frames, timing.gaps[0].after_frame), (1, 1, 39));
        assert!((timing.real_rate_hz.unwrap() - 30.0).abs() < 1e-9);
        assert_eq!(timing.warnings().len(), 1);
    }

    #[test]
    fn a_wrong_stated_rate_is_told() {
        let t: Vec<f64> = (0..100).map(|i| f64::from(i) / 25.0).collect();
        let warnings = Timing::audit(&t, Some(30.0), 1e-3).warnings();
        assert_eq!(warnings.len(), 1);
        assert!(warnings[0].contains("states 30.000") && warnings[0].contains("25.000"), "{warnings:?}");
    }

    #[test]
    fn a_rate_that_varies_has_no_gaps() {
        let t: Vec<f64> =
            (0..100).scan(0.0, |t, i| Some(std::mem::replace(t, *t + [1.0, 2.0, 3.0][i * i % 7 % 3] / 60.0))).collect();
        let warnings = Timing::audit(&t, Some(30.0), 1e-3).warnings();
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].contains("0.017 to 0.050 s"), "{warnings:?}");
    }

    #[test]
    fn repeated_stamps_and_short_records_are_no_trouble() {
        assert_eq!(Timing::audit(&[0.0, 0.1, 0.1, 0.2], None, 1e-3).repeated_or_backward_frames, [2]);
        assert_eq!(Timing::audit(&[], None, 1e-3).frames, 0);
        assert_eq!(Timing::audit(&[3.0], None, 1e-3).last_s, 3.0);
    }
}
