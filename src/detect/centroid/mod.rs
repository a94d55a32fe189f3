//! The centroid of a mark, to a small fraction of a pixel.
//!
//! The mask only says where to look. Around the mark's rough centre the picture is read in polar sectors. In each
//! sector the ring outside the mark gives the background there (a strip, its edge, the dark chamber), the core
//! gives the mark, lit as its [limb] shows, and every pixel of the boundary band its [share of mark](share) α, from luma
//! and both colour differences, so that what scatters in the surroundings does not count.
//!
//! 1. The moments of α give a first centre, the radius and the sweep.
//! 2. A [swept disc](disc) is [fitted](fit) to α. All its other parameters act alike on opposite sides, so they
//!    cannot pull its centre.
//! 3. What the band holds beside disc and background is the scatter of each sector; α and the disc are made anew
//!    with it. So luma counts where one background explains it, and the strip's edge nowhere.
//!
//! A target of two dark quadrants is no disc: its centre is that of its [symmetry].
//!
//! The variance is that of least squares. Where no disc fits, the centroid is the first moment
//!
//! ```text
//! centroid = Σ α x / Σ α,   var x = Σ_band σ_α² (x − x̄)² / (Σ α)²,   α = 1 in the core, 0 beyond the band
//! ```

mod disc;
mod extrusion;
mod fit;
pub mod limb;
mod outline;
mod patch;
mod profile;
mod rim;
mod share;
mod silhouette;
mod surroundings;
mod symmetry;
mod zones;

use super::component::HueAxis;
use crate::video::Picture;
use disc::Disc;
use fit::{Band, Fit};
pub use limb::Shading;
use outline::Outline;
use patch::Patch;
use profile::Profile;
use rim::Rim;
use share::Share;
pub use silhouette::Silhouette;
use surroundings::Surroundings;
pub use symmetry::of_target;
use zones::Zones;

/// Which channels a mark is measured by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channels {
    /// All three.
    All,
    /// Luma alone.
    Luma,
    /// The colour differences alone.
    Chroma,
}

/// A mark, measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Centroid {
    /// Stored pixels, centre of the top-left one at (0, 0).
    pub x_px: f64,
    /// Downwards.
    pub y_px: f64,
    /// Variances and covariance (xx, yy, xy), px².
    pub variance_px2: [f64; 3],
    /// Σ α: the area of the mark.
    pub area_px2: f64,
    /// How much of the position comes from the colour differences rather than from luma, 0 to 1.
    pub chroma_share: f64,
    /// The boundary band reaches over the picture's edge.
    pub cut: bool,
}

/// Pixels that share one independent error: chroma samples of four pixels, and interpolation.
const PIXELS_SHARING: f64 = 4.0;
/// Standard deviation of the blur of lens, subsampling and codec, px, with and without subsampled chroma.
const BLUR_PX: [f32; 2] = [1.3, 0.9];

/// The last step of the first fit, which only says where to look, and of the second, px.
const ROUGHLY_PX: f64 = 0.05;
const EXACTLY_PX: f64 = 2e-3;

/// Measures the mark under `silhouette`. `None` where the mark has no contrast or fills the picture.
pub fn measure(
    picture: &Picture<'_>,
    axis: HueAxis,
    silhouette: &Silhouette,
    channels: Channels,
    shading: Shading,
) -> Option<Centroid> {
    let mut outline = Outline::of(picture, axis, silhouette);
    let patch = Patch::read(picture, &outline);
    let zones = Zones::of(&patch, &outline);
    let surroundings = Surroundings::survey(&zones, &outline, channels, shading)?;
    let shares = surroundings.shares(&outline)?;
    // the mask's outline is a staircase of chroma samples: the shares of mark give a finer one
    outline.refine(&sector_areas(&zones, &outline, &surroundings, &shares));
    let zones = Zones::of(&patch, &outline);
    let mut shares = surroundings.shares(&outline)?;
    let mut moments = Moments::default();
    for_each_share(&zones, &outline, &surroundings, &shares, |sample, share, variance| {
        moments.add(zones.pixels_each, share, variance, [sample.dx_px, sample.dy_px]);
    });
    let mut centroid = moments.centroid()?;
    let blur_px = BLUR_PX[usize::from(picture.layout.chroma_shift_x == 0)];
    let rim = Rim { samples: &zones.band };
    let band = rim.mixtures(&shares, &rim.backgrounds(&surroundings));
    let mut fitted = fit::fit(moments.disc(blur_px), &band, ROUGHLY_PX);
    let reread;
    let mut last = &zones;
    if let Some(first) = &fitted {
        // mask and moments know the outline to a pixel, the disc to a tenth: the ring is read again
        outline = outline.of_disc(&first.disc);
        reread = Zones::of(&patch, &outline);
        last = &reread;
        if let Some((band, again)) = resurvey(&patch, &reread, &outline, &first.disc, &surroundings) {
            fitted = fit::fit(first.disc, &band, EXACTLY_PX).or(fitted);
            shares = again;
        }
    }
    if let Some(Fit { disc, covariance_px2, by_parts_px2 }) = fitted {
        (centroid.x_px, centroid.y_px) = (f64::from(disc.centre_px[0]), f64::from(disc.centre_px[1]));
        let samples_sharing = PIXELS_SHARING / f64::from(last.pixels_each);
        let [xx, yy, xy] = covariance_px2.map(|v| samples_sharing * v);
        let [x, y] = [(xx, 0), (yy, 1)].map(|(v, axis)| (by_parts_px2[axis] / v).max(1.0));
        centroid.variance_px2 = [x * xx, y * yy, (x * y).sqrt() * xy];
    }
    centroid.chroma_share = share::of_chroma(&shares);
    let reach = patch.reach_px();
    let inside = centroid.x_px.abs() < reach && centroid.y_px.abs() < reach;
    centroid.x_px += outline.centre_px[0];
    centroid.y_px += outline.centre_px[1];
    centroid.cut = last.are_cut(&outline, picture);
    inside.then_some(centroid)
}

/// The surroundings of a disc, with what every sector's band holds beside it and the background, and the band itself.
fn resurvey(
    patch: &Patch,
    zones: &Zones<'_>,
    outline: &Outline,
    disc: &Disc,
    before: &Surroundings,
) -> Option<(Band, Vec<Share>)> {
    let mut surroundings = before.anew(zones, outline)?;
    let rim = Rim { samples: &zones.band };
    let of_disc = rim.of_disc(disc);
    let mut backgrounds = rim.backgrounds(&surroundings);
    let mut rests = rim.rests(&of_disc, &surroundings.shares(outline)?, &backgrounds);
    for extruded in surroundings.extruded(patch, zones, outline, disc) {
        let behind = rim.backgrounds(&extruded);
        let others = rim.rests(&of_disc, &extruded.shares(outline)?, &behind);
        if extruded.misfit(&others) < surroundings.misfit(&rests) {
            (surroundings, rests, backgrounds) = (extruded, others, behind);
        }
    }
    surroundings.learn_scatter(rim.samples.iter().map(|s| s.sector).zip(&rests));
    let shares = surroundings.shares(outline)?;
    Some((rim.mixtures(&shares, &backgrounds), shares))
}

/// Area of mark in every sector.
fn sector_areas(zones: &Zones<'_>, outline: &Outline, surroundings: &Surroundings, shares: &[Share]) -> Vec<f32> {
    let mut areas = vec![0.0; outline.count()];
    for_each_share(zones, outline, surroundings, shares, |sample, share, _| {
        areas[usize::from(sample.sector)] += zones.pixels_each * share;
    });
    areas
}

/// Visits every pixel of core and band with its share of mark and the share's variance. A foreign pixel in the band
/// takes the mean share of its depth.
fn for_each_share(
    zones: &Zones<'_>,
    outline: &Outline,
    surroundings: &Surroundings,
    shares: &[Share],
    mut visit: impl FnMut(&patch::Sample, f32, f32),
) {
    zones.core.iter().for_each(|sample| visit(sample, 1.0, 0.0));
    let mut foreign = Vec::new();
    for sample in &zones.band {
        let sector = usize::from(sample.sector);
        match shares[sector].of(sample.levels, surroundings.background_at(sector, sample)) {
            Some(share) => visit(sample, share, shares[sector].variance),
            None => foreign.push(sample),
        }
    }
    if foreign.is_empty() {
        return;
    }
    let profile = Profile::of(zones, outline, surroundings, shares);
    for sample in foreign {
        visit(sample, profile.at(sample.depth_px(outline)), shares[usize::from(sample.sector)].variance);
    }
}

/// Zeroth, first and second moments about the polar centre.
#[derive(Default)]
struct Moments {
    area: f64,
    mx: f64,
    my: f64,
    /// Σ α x², Σ α y², Σ α x y.
    second: [f64; 3],
    /// Σ v, Σ v x, Σ v y, Σ v x², Σ v y², Σ v x y with v the variance of a pixel's share.
    spread: [f64; 6],
}

impl Moments {
    /// Adds a pixel that stands for some.
    fn add(&mut self, pixels: f32, share: f32, variance: f32, at_px: [f32; 2]) {
        let [x, y] = at_px.map(f64::from);
        let (share, v) = (f64::from(pixels * share), f64::from(pixels * pixels * variance));
        self.area += share;
        self.mx += share * x;
        self.my += share * y;
        self.second.iter_mut().zip([x * x, y * y, x * y]).for_each(|(sum, term)| *sum += share * term);
        if v > 0.0 {
            for (sum, term) in self.spread.iter_mut().zip([1.0, x, y, x * x, y * y, x * y]) {
                *sum += v * term;
            }
        }
    }

    /// The disc with these moments. A sweep leaves the area π(r² + σ²) as it is and adds |s|²/12 to the second moment
    /// along it.
    fn disc(&self, blur_px: f32) -> Disc {
        let (x, y) = (self.mx / self.area, self.my / self.area);
        let [xx, yy, xy] = self.second.map(|s| s / self.area);
        let (xx, yy, xy) = (xx - x * x, yy - y * y, xy - x * y);
        let difference = 2.0 * (0.5 * (xx - yy)).hypot(xy);
        let (sin, cos) = (0.5 * (2.0 * xy).atan2(xx - yy)).sin_cos();
        let length = (12.0 * difference).sqrt();
        let radius = (self.area / std::f64::consts::PI - f64::from(blur_px).powi(2)).max(1.0).sqrt();
        Disc {
            centre_px: [x as f32, y as f32],
            radius_px: radius as f32,
            sweep_px: [(length * cos) as f32, (length * sin) as f32],
            blur_px,
        }
    }

    fn centroid(&self) -> Option<Centroid> {
        if !(self.area >= 1.0) {
            return None;
        }
        let (x, y) = (self.mx / self.area, self.my / self.area);
        let [s, sx, sy, sxx, syy, sxy] = self.spread;
        let per_area = 1.0 / (self.area * self.area);
        let variance_px2 = [
            (sxx - 2.0 * x * sx + x * x * s) * per_area,
            (syy - 2.0 * y * sy + y * y * s) * per_area,
            (sxy - x * sy - y * sx + x * y * s) * per_area,
        ];
        variance_px2.iter().all(|v| v.is_finite()).then_some(Centroid {
            x_px: x,
            y_px: y,
            variance_px2,
            area_px2: self.area,
            chroma_share: 0.0,
            cut: false,
        })
    }
}

#[cfg(test)]
mod tests;
