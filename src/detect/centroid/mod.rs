//! The centroid of a mark, to a small fraction of a pixel.
//!
//! The mask only says where to look. Around the mark's rough centre the picture is read in polar sectors. In each
//! sector the ring outside the mark gives the background there (a strip, its edge, the dark chamber), the core
//! gives the mark, lit as its [limb] shows, and every pixel of the boundary band its [share of mark](share) α, from luma
//! and both colour differences, so that what scatters in the surroundings does not count. Under the band the background
//! is as in the ring, or continues along an [extrusion], or is known from other pictures: as explains the band best.
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

use std::rc::Rc;

use super::component::HueAxis;
use crate::video::Picture;
use disc::Disc;
use fit::Fit;
pub use limb::Shading;
use outline::Outline;
use patch::Patch;
use profile::Profile;
use rim::{Rim, Shares};
pub use share::Mixing;
use share::{Mixture, Share};
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

/// What is known beforehand of how marks look.
#[derive(Debug, Clone, Copy)]
pub struct Conditions<'a> {
    /// Which channels they are measured by.
    pub channels: Channels,
    /// How their levels differ around their edges.
    pub shading: Shading,
    /// How they mix with what is behind them.
    pub mixing: Mixing,
    /// What stands still behind them, if that is known.
    pub scene: Option<&'a Picture<'a>>,
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
    /// What lies behind the mark is known best from pictures in which it is elsewhere; `None` where they do not show that.
    pub known_behind: Option<bool>,
    /// Mean square of what the mark's edge holds beside mark and background by the first fit, in the noise around it; 0 where that is not known.
    pub misfit: f32,
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
    conditions: &Conditions<'_>,
) -> Option<Centroid> {
    let mut outline = Outline::of(picture, axis, silhouette);
    let patch = Patch::read(picture, &outline);
    let scene = conditions.scene.map(|scene| Rc::new(Patch::planes_of(scene, &outline)));
    let zones = Zones::of(&patch, &outline);
    let mixture = Mixture::new(conditions.mixing, &picture.layout);
    let surroundings = Surroundings::survey(&zones, &outline, (conditions.channels, conditions.shading, mixture))?;
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
    let band = rim.mixtures(&Shares { by_sector: &shares, each: false }, &rim.backgrounds(&surroundings));
    let mut fitted = fit::fit(moments.disc(blur_px), &band, ROUGHLY_PX);
    let mut cut = zones.are_cut(&outline, picture);
    let samples_sharing = PIXELS_SHARING / f64::from(zones.pixels_each);
    if let Some(first) = &fitted {
        let look = |disc: &Disc| Look::at((picture, &patch, scene.as_ref()), &outline, disc, &surroundings);
        // before clutter, moments may show the sweep across its true direction
        let is_swept = first.disc.sweep_length_px() > blur_px;
        let across = (scene.is_some() && is_swept).then(|| first.disc.turned());
        let mut looks: Vec<Look> = std::iter::once(first.disc).chain(across).filter_map(|disc| look(&disc)).collect();
        if looks.len() > 1 {
            // the ring of a disc that was swept another way is not yet its own
            looks = looks.iter().filter_map(|found| look(&found.fit.disc)).collect();
        }
        if let Some(best) = looks.into_iter().min_by(|a, b| a.misfit.total_cmp(&b.misfit)) {
            (centroid.known_behind, centroid.misfit, cut) = (best.known, best.before, best.cut);
            (fitted, shares) = (Some(best.fit), best.shares);
        }
    }
    if let Some(Fit { disc, covariance_px2 }) = fitted {
        (centroid.x_px, centroid.y_px) = (f64::from(disc.centre_px[0]), f64::from(disc.centre_px[1]));
        centroid.variance_px2 = covariance_px2.map(|v| samples_sharing * v);
    }
    centroid.chroma_share = share::of_chroma(&shares);
    let reach = patch.reach_px();
    let inside = centroid.x_px.abs() < reach && centroid.y_px.abs() < reach;
    centroid.x_px += outline.centre_px[0];
    centroid.y_px += outline.centre_px[1];
    centroid.cut = cut;
    inside.then_some(centroid)
}

/// A look at the surroundings of a disc that is roughly known: mask and moments know the outline to a pixel, the disc to a tenth, so the ring is read again.
struct Look {
    /// Its band reaches over the picture's edge.
    cut: bool,
    /// Of the disc that was known, in the noise of its own ring.
    before: f32,
    /// Of the disc that is fitted, in the noise of the first look, so that looks can be compared.
    misfit: f32,
    /// The background is that of other pictures; `None` where they show none there.
    known: Option<bool>,
    shares: Vec<Share>,
    fit: Fit,
}

impl Look {
    /// With what every sector's band holds beside the disc and the background.
    fn at(
        (picture, patch, scene): (&Picture<'_>, &Patch, Option<&Rc<Patch>>),
        outline: &Outline,
        disc: &Disc,
        before: &Surroundings,
    ) -> Option<Self> {
        let outline = outline.of_disc(disc);
        let zones = &Zones::of(patch, &outline);
        let ring = before.anew(zones, &outline)?;
        let rim = Rim { samples: &zones.band };
        let of_disc = rim.of_disc(disc);
        let fitted = |surroundings: Surroundings| {
            let backgrounds = rim.backgrounds(&surroundings);
            let by_sector = surroundings.shares(&outline)?;
            let shares = Shares { by_sector: &by_sector, each: surroundings.is_known() };
            let rests = rim.rests(&of_disc, &shares, &backgrounds);
            Some((before.misfit(&rests), surroundings, rests, backgrounds))
        };
        let mut best = fitted(ring.clone())?;
        let by_scene = scene.and_then(|scene| ring.known(Rc::clone(scene), zones, &outline));
        let is_seen = by_scene.is_some();
        for other in ring.extruded(patch, zones, &outline, disc).into_iter().chain(by_scene).filter_map(fitted) {
            if other.0 < best.0 {
                best = other;
            }
        }
        let (_, mut surroundings, rests, backgrounds) = best;
        let misfit_before = ring.misfit(&rests);
        surroundings.learn_scatter(rim.samples.iter().map(|s| s.sector).zip(&rests));
        let (shares, each) = (surroundings.shares(&outline)?, surroundings.is_known());
        let by = Shares { by_sector: &shares, each };
        let fit = fit::fit(*disc, &rim.mixtures(&by, &backgrounds), EXACTLY_PX)?;
        let misfit = before.misfit(&rim.rests(&rim.of_disc(&fit.disc), &by, &backgrounds));
        let known = is_seen.then_some(each);
        Some(Self { cut: zones.are_cut(&outline, picture), before: misfit_before, misfit, known, shares, fit })
    }
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
            Some((share, variance)) => visit(sample, share, variance),
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
            known_behind: None,
            misfit: 0.0,
        })
    }
}

#[cfg(test)]
mod tests;
