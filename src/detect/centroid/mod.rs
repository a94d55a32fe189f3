//! The centroid of a mark, to a small fraction of a pixel.
//!
//! The mask only says where to look. Around the mark's rough centre the picture is read in polar sectors. In each
//! sector the ring outside the mark gives the background there (a strip, its edge, the dark chamber), the core
//! gives the mark, and every pixel of the boundary band its share α of mark:
//!
//! ```text
//! α = Σ_k w_k (F_k − B_k)(p_k − B_k) / Σ_k w_k (F_k − B_k)²,   w_k = 1/σ_k²,   k = luma, colour component
//! centroid = Σ α x / Σ α,   α = 1 in the core, 0 beyond the band
//! ```
//! So luma is used where the mark differs in luma from what lies beside it, and the colour where it does not. The
//! colour component is read at its own sites (chroma siting) and interpolated to luma pixels, a symmetric kernel
//! that leaves the centroid where it is. The variance follows from that of α:
//!
//! ```text
//! var x = Σ_band σ_α² (x − x̄)² / (Σ α)²,   σ_α² = 1 / Σ_k w_k (F_k − B_k)²
//! ```

mod outline;
mod patch;
mod share;
mod surroundings;

use super::component::HueAxis;
use crate::video::Picture;
use outline::Outline;
use patch::Patch;
use share::{Profile, Share};
use surroundings::Surroundings;

/// A mark's rough place and shape, from the mask.
#[derive(Debug, Clone)]
pub struct Silhouette {
    /// Mean of the mask, luma pixels.
    pub centre_px: [f64; 2],
    /// Masked samples as luma pixels, each sample with its half size.
    pub points_px: Vec<[f64; 2]>,
    /// Half a chroma sample, luma pixels.
    pub half_sample_px: [f64; 2],
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
    /// The boundary band reaches over the picture's edge.
    pub cut: bool,
}

/// Measures the mark under `silhouette`. `None` where the mark has no contrast or fills the picture.
pub fn measure(picture: &Picture<'_>, axis: HueAxis, silhouette: &Silhouette) -> Option<Centroid> {
    let mut outline = Outline::of(picture, axis, silhouette);
    let patch = Patch::read(picture, axis, &outline, surroundings::RING_PX);
    let surroundings = Surroundings::survey(&patch, &outline)?;
    let shares = surroundings.shares(&outline)?;
    // the mask's outline is a staircase of chroma samples: the shares of mark give a finer one
    outline.refine(&sector_areas(&patch, &outline, &surroundings, &shares));
    let shares = surroundings.shares(&outline)?;
    let mut moments = Moments::default();
    for_each_share(&patch, &outline, &surroundings, &shares, |sample, share, variance| {
        moments.add(share, variance, sample.dx_px, sample.dy_px);
    });
    let mut centroid = moments.centroid()?;
    let reach = patch.reach_px();
    let inside = centroid.x_px.abs() < reach && centroid.y_px.abs() < reach;
    centroid.x_px += outline.centre_px[0];
    centroid.y_px += outline.centre_px[1];
    centroid.cut = outline.is_cut(&patch, picture);
    inside.then_some(centroid)
}

/// Area of mark in every sector.
fn sector_areas(patch: &Patch, outline: &Outline, surroundings: &Surroundings, shares: &[Share]) -> Vec<f32> {
    let mut areas = vec![0.0; outline.count()];
    for_each_share(patch, outline, surroundings, shares, |sample, share, _| {
        areas[usize::from(sample.sector)] += share;
    });
    areas
}

/// Visits every pixel of core and band with its share of mark and the share's variance. A foreign pixel in the band
/// takes the mean share of its depth.
fn for_each_share(
    patch: &Patch,
    outline: &Outline,
    surroundings: &Surroundings,
    shares: &[Share],
    mut visit: impl FnMut(&patch::Sample, f32, f32),
) {
    let mut foreign = Vec::new();
    for sample in &patch.samples {
        let sector = usize::from(sample.sector);
        let depth = sample.distance_px - outline.radii_px[sector];
        if depth < -outline.band_px {
            visit(sample, 1.0, 0.0);
        } else if depth <= outline.band_px {
            match shares[sector].of(sample.levels, surroundings.background_at(sector, sample)) {
                Some(share) => visit(sample, share, shares[sector].variance),
                None => foreign.push((sample, depth)),
            }
        }
    }
    if foreign.is_empty() {
        return;
    }
    let profile = Profile::of(patch, outline, surroundings, shares);
    for (sample, depth) in foreign {
        visit(sample, profile.at(depth), shares[usize::from(sample.sector)].variance);
    }
}

/// Zeroth, first and second moments about the polar centre.
#[derive(Default)]
struct Moments {
    area: f64,
    mx: f64,
    my: f64,
    /// Σ v, Σ v x, Σ v y, Σ v x², Σ v y², Σ v x y with v the variance of a pixel's share.
    spread: [f64; 6],
}

impl Moments {
    fn add(&mut self, share: f32, variance: f32, dx: f32, dy: f32) {
        let (x, y, share, v) = (f64::from(dx), f64::from(dy), f64::from(share), f64::from(variance));
        self.area += share;
        self.mx += share * x;
        self.my += share * y;
        if v > 0.0 {
            for (sum, term) in self.spread.iter_mut().zip([1.0, x, y, x * x, y * y, x * y]) {
                *sum += v * term;
            }
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
            cut: false,
        })
    }
}

#[cfg(test)]
mod tests;
