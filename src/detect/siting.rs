//! Where the chroma samples really lie, from the recording.
//!
//! What a file states about its chroma siting is often not what its converter did: swscale averages pairs of pixels,
//! which sites them in between, and writes "left". Luma has no siting. So marks are measured by luma alone and by the
//! colour differences alone; the difference of the two is the error of the stated site. Sites lie at a luma sample or
//! midway between two: each has a probability, and mean and standard deviation over them are what is used.

use super::Detector;
use super::centroid::Channels;
use crate::error::Result;
use crate::video::{Layout, Picture};

/// Where chroma sample (0, 0) lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Siting {
    /// As the file states it, or as its codec usually has it; luma pixels from the centre of luma sample (0, 0).
    pub stated_px: [f64; 2],
    /// As it is taken to be.
    pub used_px: [f64; 2],
    /// Standard deviation of the latter.
    pub sd_px: [f64; 2],
    /// What the marks showed along each axis, with its standard deviation; `None` where chroma has every sample.
    pub seen_px: [Option<[f64; 2]>; 2],
    /// Luma and colour differ by more than any site explains: a shaded mark before a wall as bright as its dark side ends for luma where the light does, for its colour at
    /// its edge.
    pub contradicted: bool,
}

/// Gathers differences between luma and colour.
#[derive(Debug, Default)]
pub struct SitingSurvey {
    layout: Option<Layout>,
    /// Luma's position less the colour's and its variance, along x and y.
    differences: [Vec<[f64; 2]>; 2],
}

/// Error of a coded edge that all marks share, px: luma and colour agree to this where the site is right (measured on foreign
/// renderings).
const COMMON_ERROR_PX: f64 = 0.04;
/// Prior weight of a site that is neither stated nor the middle of the pair that a converter averages.
const RARE_SITE: f64 = 0.1;
/// The same of one on the right, which no standard knows (ITU-T H.273, chroma sample locations 0 to 5): a picture was mirrored.
const MIRRORED_SITE: f64 = 0.01;
/// Luma and colour contradict each other beyond every site by so many px (judgement: more than colour alone errs by), and by so many standard deviations (statistics).
const CONTRADICTED_PX: f64 = 0.5;
const CONTRADICTED_DEVIATIONS: f64 = 3.0;
/// Fewest marks that tell a site.
const LEAST_MARKS: usize = 4;

impl SitingSurvey {
    /// Learns from a picture.
    ///
    /// # Errors
    /// As [`Detector::detect`].
    pub fn see(picture: &Picture<'_>, detector: &Detector) -> Result<Self> {
        let layout = picture.layout;
        let mut survey = Self { layout: Some(layout), ..Self::default() };
        if layout.chroma_shift_x == 0 && layout.chroma_shift_y == 0 {
            return Ok(survey);
        }
        let luma = detector.detect_by(picture, Channels::Luma)?;
        let colour = detector.detect_by(picture, Channels::Chroma)?;
        for a in &luma {
            let Some(b) = colour.iter().find(|b| b.has_mask_of(a)) else { continue };
            let (p, q) = (&a.centroid, &b.centroid);
            survey.differences[0].push([p.x_px - q.x_px, p.variance_px2[0] + q.variance_px2[0]]);
            survey.differences[1].push([p.y_px - q.y_px, p.variance_px2[1] + q.variance_px2[1]]);
        }
        Ok(survey)
    }

    /// Both together.
    pub fn with(mut self, mut other: Self) -> Self {
        self.layout = self.layout.or(other.layout);
        for (own, more) in self.differences.iter_mut().zip(&mut other.differences) {
            own.append(more);
        }
        self
    }

    /// What the pictures show; `None` where there were none. `unshaded` is the same survey with the marks taken for evenly lit,
    /// where they are not: by as much as their shading changes the differences they may be wrong still.
    pub fn conclude(self, unshaded: Option<&Self>) -> Option<Siting> {
        let layout = self.layout?;
        let mut siting = Siting {
            stated_px: layout.chroma_site_px,
            used_px: layout.chroma_site_px,
            sd_px: [0.0; 2],
            seen_px: [None; 2],
            contradicted: false,
        };
        for (axis, shift) in [layout.chroma_shift_x, layout.chroma_shift_y].into_iter().enumerate() {
            if shift == 0 {
                continue;
            }
            let flat = unshaded.and_then(|unshaded| robust_mean(&unshaded.differences[axis]));
            let seen = robust_mean(&self.differences[axis]).map(|[d, sd]| {
                let of_shading = flat.map_or(0.0, |[flat, _]| d - flat);
                [siting.stated_px[axis] + d, sd.hypot(of_shading)]
            });
            siting.seen_px[axis] = seen;
            siting.contradicted |= seen.is_some_and(|seen| is_contradiction(shift, seen));
            [siting.used_px[axis], siting.sd_px[axis]] = posterior(axis, siting.stated_px[axis], shift, seen);
        }
        Some(siting)
    }
}

/// Whether what was seen lies beyond every site.
fn is_contradiction(shift: u32, [at, sd]: [f64; 2]) -> bool {
    let last = f64::from((1u32 << shift) - 1);
    let beyond = (-at).max(at - last);
    beyond > CONTRADICTED_PX.max(CONTRADICTED_DEVIATIONS * sd)
}

/// Mean and standard deviation over the sites that a pair (or four, with 4:1:1) of luma samples allows, each with its
/// probability after what was `seen`: position and standard deviation.
fn posterior(axis: usize, stated_px: f64, shift: u32, seen: Option<[f64; 2]>) -> [f64; 2] {
    let last = (1u32 << shift) - 1;
    let middle = 0.5 * f64::from(last);
    let places = || (0..=2 * last).map(|k| 0.5 * f64::from(k));
    // what lies far from every site is wrong by as much at least
    let seen = seen.map(|[at, sd]| [at, places().map(|site| (site - at).abs()).fold(f64::INFINITY, f64::min).max(sd)]);
    let probable = |site: f64| {
        let prior = match site {
            _ if (site - stated_px).abs() < 0.1 || (site - middle).abs() < 0.1 => 1.0,
            _ if axis == 0 && site > middle => MIRRORED_SITE,
            _ => RARE_SITE,
        };
        let misfit = seen.map_or(0.0, |[at, sd]| 0.5 * ((site - at) / sd).powi(2));
        (prior * (-misfit).exp(), site)
    };
    let sites: Vec<(f64, f64)> = places().map(probable).collect();
    let total: f64 = sites.iter().map(|(p, _)| p).sum();
    let mean = sites.iter().map(|(p, site)| p * site).sum::<f64>() / total;
    let variance = sites.iter().map(|(p, site)| p * (site - mean).powi(2)).sum::<f64>() / total;
    [mean, variance.sqrt()]
}

/// Weighted mean with outlying values left out (Tukey's biweight), and its standard deviation from the values' own
/// scatter.
fn robust_mean(values: &[[f64; 2]]) -> Option<[f64; 2]> {
    let known: Vec<[f64; 2]> = values.iter().copied().filter(|v| v[0].is_finite() && v[1] > 0.0).collect();
    if known.len() < LEAST_MARKS {
        return None;
    }
    let mut plain: Vec<f64> = known.iter().map(|v| v[0]).collect();
    let mut mean = crate::statistics::median(&mut plain)?;
    let mut sd = f64::INFINITY;
    for _ in 0..8 {
        let mut sizes: Vec<f64> = known.iter().map(|v| (v[0] - mean).abs()).collect();
        let scale = (crate::statistics::median(&mut sizes)? / 0.6745).max(1e-3);
        let weight = |v: &[f64; 2]| {
            let z = (v[0] - mean) / (4.685 * scale);
            if z.abs() < 1.0 { (1.0 - z * z).powi(2) / (v[1] + COMMON_ERROR_PX.powi(2)) } else { 0.0 }
        };
        let total: f64 = known.iter().map(weight).sum();
        if !(total > 0.0) {
            return None;
        }
        let next = known.iter().map(|v| weight(v) * v[0]).sum::<f64>() / total;
        let spread = known.iter().map(|v| weight(v) * (v[0] - next).powi(2)).sum::<f64>() / total;
        let effective = total.powi(2) / known.iter().map(|v| weight(v).powi(2)).sum::<f64>();
        (mean, sd) = (next, (spread / (effective - 1.0).max(1.0)).sqrt().hypot(COMMON_ERROR_PX));
    }
    Some([mean, sd])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn survey(differences: [&[f64]; 2], stated_px: [f64; 2]) -> Siting {
        surveyed(differences, stated_px).conclude(None).unwrap()
    }

    fn surveyed(differences: [&[f64]; 2], stated_px: [f64; 2]) -> SitingSurvey {
        let layout = Layout { chroma_site_px: stated_px, ..Layout::subsampled(64, 64, 8) };
        let with_variance = |d: &[f64]| d.iter().map(|d| [*d, 0.05f64.powi(2)]).collect();
        SitingSurvey { layout: Some(layout), differences: differences.map(with_variance) }
    }

    #[test]
    fn a_site_that_the_file_states_wrongly_is_found() {
        let x = [0.47, 0.55, 0.52, 0.44, 0.58, 0.49];
        let y = [0.03, -0.04, 0.01, 0.0, 0.05, -0.02];
        let siting = survey([&x, &y], [0.0, 0.5]);
        for axis in 0..2 {
            assert!((siting.used_px[axis] - 0.5).abs() < 1e-3 && siting.sd_px[axis] < 0.01, "{siting:?}");
        }
    }

    #[test]
    fn what_lies_between_sites_leaves_them_open() {
        let siting = survey([&[1.27, 1.25, 1.29, 1.26, 1.28], &[]], [0.0, 0.5]);
        assert!(siting.used_px[0] < 0.8 && siting.sd_px[0] > 0.15, "{siting:?}");
    }

    #[test]
    fn luma_that_is_pixels_from_the_colour_contradicts_it() {
        let x = [-2.9, -2.5, -2.7, -3.0, -2.4, -2.6];
        assert!(survey([&x, &[]], [0.0, 0.5]).contradicted);
        let scattered = [-2.9, 2.5, -0.7, 3.0, -2.4, 1.6];
        assert!(!survey([&scattered, &[]], [0.0, 0.5]).contradicted);
        assert!(!survey([&[1.27, 1.25, 1.29, 1.26, 1.28], &[]], [0.0, 0.5]).contradicted);
    }

    #[test]
    fn what_may_be_shading_is_no_site() {
        let x = [0.47, 0.55, 0.52, 0.44, 0.58, 0.49];
        let flat = x.map(|x| x + 0.6);
        let [lit, even] = [x, flat].map(|x| surveyed([&x, &[]], [0.0, 0.5]));
        let siting = lit.conclude(Some(&even)).unwrap();
        assert!(siting.used_px[0] < 0.4 && siting.sd_px[0] > 0.2, "{siting:?}");
    }

    #[test]
    fn where_the_marks_do_not_tell_the_site_stands_with_its_doubt() {
        let scattered = [0.9, -0.6, 0.3, -0.2, 0.7, -0.9];
        let siting = survey([&scattered, &[]], [0.0, 0.5]);
        assert!((0.1..0.4).contains(&siting.used_px[0]) && siting.sd_px[0] > 0.2, "{siting:?}");
        assert!((siting.used_px[1] - 0.5).abs() < 1e-3 && siting.sd_px[1] > 0.1, "{siting:?}");
    }
}
