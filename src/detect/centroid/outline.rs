//! The mark's outline in polar sectors, and the width of the band in which it fades.

use std::f32::consts::TAU;

use super::super::component::HueAxis;
use super::Silhouette;
use super::disc::Disc;
use crate::video::Picture;

/// The narrowest half width of the boundary band: codecs and chroma interpolation soften every edge this much.
const LEAST_BAND_PX: f32 = 2.5;
/// Widest half width of the boundary band: motion blur.
const MOST_BAND_PX: f32 = 14.0;

/// The outline about a whole-pixel centre.
#[derive(Debug, Clone)]
pub struct Outline {
    /// Stored pixels.
    pub centre_px: [f64; 2],
    /// Distance of the boundary in each sector.
    pub radii_px: Vec<f32>,
    /// Half width of the boundary band in each sector.
    pub bands_px: Vec<f32>,
}

/// Where a pixel lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Zone {
    /// All mark.
    Core,
    /// Where the mark fades into its surroundings.
    Band,
    /// Just outside, where the background is read.
    Ring,
    /// Farther away.
    Beyond,
}

/// Width of the ring from which the background is read.
pub const RING_PX: f32 = 3.0;
/// Standard deviations of the blur in which an edge fades to a hundredth.
pub const FADE: f32 = 2.3;

impl Outline {
    /// From the mask: around its convex hull.
    pub fn of(picture: &Picture<'_>, axis: HueAxis, silhouette: &Silhouette) -> Self {
        let hull = silhouette.convex();
        let centre_px = hull.centre_px.map(f64::round);
        let [hx, hy] = hull.half_sample_px;
        let area = hull.points_px.len() as f64 * 4.0 * hx * hy;
        let radius = (area / std::f64::consts::PI).sqrt() as f32;
        // a sector is about two pixels wide at the ring; an odd number has no sector boundaries along both axes
        let count = ((TAU * (radius + 3.5) / 2.0) as usize).clamp(16, 96) | 1;
        let mut outline = Self { centre_px, radii_px: vec![0.0; count], bands_px: vec![LEAST_BAND_PX; count] };
        outline.follow_mask(&hull);
        let band_px = outline.band_from_profile(picture, axis, silhouette);
        outline.bands_px.fill(band_px);
        outline
    }

    /// That of a disc, about the same centre.
    pub fn of_disc(&self, disc: &Disc) -> Self {
        let mut outline = self.clone();
        for sector in 0..self.count() {
            let (sin, cos) = self.direction(sector);
            let along = |v: [f32; 2]| v[0] * cos + v[1] * sin;
            outline.radii_px[sector] = (disc.radius_px + along(disc.centre_px)).max(1.0);
            outline.bands_px[sector] = FADE * disc.blur_px + 0.5 * along(disc.sweep_px).abs();
        }
        outline
    }

    /// Number of sectors.
    pub fn count(&self) -> usize {
        self.radii_px.len()
    }

    /// Largest distance of a pixel of the ring.
    pub fn reach_px(&self) -> f32 {
        self.radii_px.iter().zip(&self.bands_px).map(|(radius, band)| radius + band + RING_PX).fold(0.0, f32::max)
    }

    /// The sector of a direction.
    #[inline]
    pub fn sector(&self, dx: f32, dy: f32) -> usize {
        ((fast_atan2(dy, dx) / TAU * self.count() as f32) as i32 as usize).min(self.count() - 1)
    }

    /// Sine and cosine of the middle of a sector.
    pub fn direction(&self, sector: usize) -> (f32, f32) {
        ((sector as f32 + 0.5) / self.count() as f32 * TAU).sin_cos()
    }

    /// The farthest masked corner in every sector, smoothed.
    fn follow_mask(&mut self, silhouette: &Silhouette) {
        let [hx, hy] = silhouette.half_sample_px.map(|h| h as f32);
        let count = self.count();
        let mut farthest = vec![0.0f32; count];
        for point in &silhouette.points_px {
            let (x, y) = ((point[0] - self.centre_px[0]) as f32, (point[1] - self.centre_px[1]) as f32);
            for (dx, dy) in [(x - hx, y - hy), (x + hx, y - hy), (x - hx, y + hy), (x + hx, y + hy)] {
                let sector = self.sector(dx, dy);
                farthest[sector] = farthest[sector].max(dx * dx + dy * dy);
            }
        }
        let seen: Vec<f32> = farthest.iter().filter(|r| **r > 0.0).map(|r| r.sqrt()).collect();
        let mean = seen.iter().sum::<f32>() / seen.len().max(1) as f32;
        let at = |i: usize| if farthest[i % count] > 0.0 { farthest[i % count].sqrt() } else { mean };
        // corners of samples stick out by a quarter sample on the average; the neighbours smooth the staircase
        let inward = 0.25 * (hx + hy);
        for sector in 0..count {
            let three = at(sector + count - 1) + at(sector) + at(sector + 1);
            self.radii_px[sector] = (three / 3.0 - inward).max(1.0);
        }
    }

    /// Half width of the band in which the mark fades into its surroundings, from the mark's own profile.
    ///
    /// Seen from the boundary inwards the component climbs to its plateau. The depth at which the slowest quarter of
    /// the boundary has climbed is half the band: codecs and chroma interpolation soften every edge, motion blur the
    /// edges across the motion. What a thin line covers is less than a quarter.
    fn band_from_profile(&self, picture: &Picture<'_>, axis: HueAxis, silhouette: &Silhouette) -> f32 {
        let mut levels: Vec<(u8, i16)> = silhouette
            .points_px
            .iter()
            .map(|p| {
                let (dx, dy) = ((p[0] - self.centre_px[0]) as f32, (p[1] - self.centre_px[1]) as f32);
                let depth = self.radii_px[self.sector(dx, dy)] - (dx * dx + dy * dy).sqrt();
                let (x, y) = picture.layout.luma_to_chroma(p[0], p[1]);
                let level = axis.at(picture, x.round().max(0.0) as usize, y.round().max(0.0) as usize);
                (depth.clamp(0.0, MOST_BAND_PX) as u8, level)
            })
            .collect();
        let upper_quartile = levels.len() * 3 / 4;
        let (_, plateau, _) = levels.select_nth_unstable_by_key(upper_quartile, |l| l.1);
        let plateau = f32::from(plateau.1);
        levels.sort_unstable();
        levels
            .chunk_by(|a, b| a.0 == b.0)
            .find(|bin| f32::from(bin[bin.len() / 4].1) > 0.85 * plateau)
            .map_or(MOST_BAND_PX, |bin| (f32::from(bin[0].0) + 1.5).clamp(LEAST_BAND_PX, MOST_BAND_PX))
    }

    /// Replaces every sector's radius by that of the circle's sector with the same area of mark, smoothed.
    pub fn refine(&mut self, areas_px2: &[f32]) {
        let count = self.count();
        for sector in 0..count {
            // a pixel belongs to one sector whole, so single sectors are uneven: five together are not
            let near = [count - 2, count - 1, 0, 1, 2].map(|k| areas_px2[(sector + k) % count]);
            let area = near.iter().sum::<f32>().max(0.0) / 5.0;
            let old = self.radii_px[sector];
            self.radii_px[sector] = (2.0 * area * count as f32 / TAU)
                .sqrt()
                .clamp(old - self.bands_px[sector], old + self.bands_px[sector])
                .max(1.0);
        }
    }
}

/// Angle in 0..2π to 0.005 rad, enough to name a sector.
#[inline]
fn fast_atan2(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let t = ax.min(ay) / ax.max(ay).max(1e-12);
    let a = t * (std::f32::consts::FRAC_PI_4 + 0.273 * (1.0 - t));
    let octant = if ay > ax { std::f32::consts::FRAC_PI_2 - a } else { a };
    let half = if x < 0.0 { std::f32::consts::PI - octant } else { octant };
    if y < 0.0 { std::f32::consts::TAU - half } else { half }
}
