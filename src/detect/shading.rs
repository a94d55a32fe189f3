//! From which side the marks are lit, from pictures of the recording.
//!
//! Lamps stand still, and a mark keeps its shape, so what a single picture shows of a mark's shading with its noise holds
//! in all of them, where motion blur hides it as well.

use super::Detector;
use super::centroid::Shading;
use crate::error::Result;
use crate::statistics::median;
use crate::video::Picture;

/// Gathers what single marks show, by hue.
#[derive(Debug, Default)]
pub struct ShadingSurvey(Vec<Vec<Shading>>);

/// Standard deviations beyond which a shading is one: most marks are flat.
const SURE: f32 = 3.0;
/// Fewest marks that tell.
const LEAST_MARKS: usize = 4;

impl ShadingSurvey {
    /// Learns from a picture.
    ///
    /// # Errors
    /// As [`Detector::detect`].
    pub fn see(picture: &Picture<'_>, detector: &Detector) -> Result<Self> {
        detector.limbs(picture).map(Self)
    }

    /// Both together.
    pub fn with(mut self, mut other: Self) -> Self {
        self.0.iter_mut().zip(&mut other.0).for_each(|(own, more)| own.append(more));
        self
    }

    /// The shading of the marks of every hue: the median, where it exceeds its own error.
    pub fn conclude(self) -> Vec<Shading> {
        self.0.iter().map(|seen| usual(seen).unwrap_or_default()).collect()
    }
}

fn usual(seen: &[Shading]) -> Option<Shading> {
    if seen.len() < LEAST_MARKS {
        return None;
    }
    let mut shading = Shading::default();
    for (channel, parts) in shading.iter_mut().enumerate() {
        for (part, usual) in parts.iter_mut().enumerate() {
            let mut values: Vec<f32> = seen.iter().map(|s| s[channel][part]).collect();
            let middle = median(&mut values)?;
            let mut off: Vec<f32> = values.iter().map(|v| (v - middle).abs()).collect();
            // the variance of a median is π/2 times that of a mean
            let sd = 1.4826 * median(&mut off)?;
            let error = 0.5 * std::f32::consts::PI * sd * sd / seen.len() as f32;
            if middle * middle > SURE * SURE * error {
                *usual = middle;
            }
        }
    }
    Some(shading)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shading_that_all_marks_show_is_kept_and_scatter_is_none() {
        let lit = |n: usize| [[20.0 + (n % 3) as f32 - 1.0, 8.0 * (n % 2) as f32 - 4.0], [0.0; 2], [0.0; 2]];
        let survey = ShadingSurvey(vec![(0..8).map(lit).collect(), (0..3).map(lit).collect()]);
        let shading = survey.conclude();
        assert!((shading[0][0][0] - 20.0).abs() < 1.0 && shading[0][0][1].abs() < 1e-3, "{shading:?}");
        assert_eq!(shading[1], Shading::default(), "three marks are too few");
    }
}
