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

use std::f64::consts::TAU;

use super::component::HueAxis;
use crate::video::Picture;

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

/// Luma and component of the pixels around a mark, at luma resolution.
struct Patch {
    left: i64,
    top: i64,
    width: usize,
    height: usize,
    luma: Vec<f32>,
    component: Vec<f32>,
}

/// What a sector holds.
#[derive(Clone, Copy, Default)]
struct Sector {
    radius_px: f32,
    /// Luma and component where the ring is read.
    background: [f32; 2],
    /// The middle of the ring in this sector, from the polar centre.
    ring: [f32; 2],
    known: bool,
}

/// How the background changes across the mark, per pixel: ∂/∂x, ∂/∂y of luma and of the component.
type Slope = [[f32; 2]; 2];

impl Sector {
    /// The background continued from the ring to a pixel.
    fn background_at(&self, slope: &Slope, dx: f32, dy: f32) -> [f32; 2] {
        let (ex, ey) = (dx - self.ring[0], dy - self.ring[1]);
        [0, 1].map(|k| self.background[k] + slope[k][0] * ex + slope[k][1] * ey)
    }
}

/// Width of the ring from which the background is read.
const RING_PX: f64 = 3.0;
/// The narrowest half width of the boundary band: codecs and chroma interpolation soften every edge this much.
const LEAST_BAND_PX: f64 = 2.5;
/// Widest half width of the boundary band: motion blur.
const MOST_BAND_PX: f64 = 14.0;
/// Error of a coded sample at an edge, as a share of the edge's height.
const EDGE_ERROR: f32 = 0.04;
/// A luma sample's rounding error, 8-bit codes (1/√12), and a little more for the codec.
const LEAST_NOISE: f32 = 0.5;
/// Luma pixels that share one independent chroma error, as a variance factor (4 samples and interpolation).
const COMPONENT_SHARING: f32 = 4.0;

/// Measures the mark under `silhouette`. `None` where the mark has no contrast or fills the picture.
pub fn measure(picture: &Picture<'_>, axis: HueAxis, silhouette: &Silhouette) -> Option<Centroid> {
    let centre = silhouette.centre_px.map(f64::round);
    let count = sector_count(silhouette);
    let radii = sector_radii(silhouette, centre, count);
    let reach = radii.iter().copied().fold(0.0, f64::max);
    let band = band_half_width(picture, axis, silhouette, centre, &radii);
    let patch = Patch::read(picture, axis, centre, reach + band + RING_PX + 1.0);
    let polar = Polar { centre, band_px: band as f32, count };
    let mut sectors: Vec<Sector> = radii.iter().map(|r| Sector { radius_px: *r as f32, ..Sector::default() }).collect();
    let levels = polar.survey(&patch, &mut sectors)?;
    // the mask's outline is a staircase of chroma samples: the shares of mark give a finer one
    polar.refine(&patch, &mut sectors, &levels);
    polar.integrate(&patch, &sectors, &levels, picture)
}

/// What the survey of a mark's surroundings finds.
struct Levels {
    /// Luma and component of the mark.
    mark: [f32; 2],
    /// Their noise.
    noise: [f32; 2],
    /// How the background changes across the mark.
    slope: Slope,
}

fn sector_count(silhouette: &Silhouette) -> usize {
    let area = silhouette.points_px.len() as f64 * 4.0 * silhouette.half_sample_px[0] * silhouette.half_sample_px[1];
    let radius = (area / std::f64::consts::PI).sqrt();
    // a sector is about two pixels wide at the ring
    ((TAU * (radius + LEAST_BAND_PX + 1.0) / 2.0) as usize).clamp(16, 96)
}

/// Distance of the mask's boundary in each sector.
fn sector_radii(silhouette: &Silhouette, centre: [f64; 2], count: usize) -> Vec<f64> {
    let [hx, hy] = silhouette.half_sample_px;
    let mut radii = vec![0.0f64; count];
    for [x, y] in &silhouette.points_px {
        for (dx, dy) in [(-hx, -hy), (hx, -hy), (-hx, hy), (hx, hy)] {
            let (rx, ry) = (x + dx - centre[0], y + dy - centre[1]);
            let sector = sector_of(rx, ry, count);
            radii[sector] = radii[sector].max(rx.hypot(ry));
        }
    }
    let mean =
        radii.iter().filter(|r| **r > 0.0).sum::<f64>() / radii.iter().filter(|r| **r > 0.0).count().max(1) as f64;
    for r in &mut radii {
        if *r == 0.0 {
            *r = mean;
        }
    }
    // corners of samples stick out by a quarter sample on the average; the neighbours smooth the staircase
    let inward = 0.5 * (hx + hy) * 0.5;
    (0..count)
        .map(|s| {
            let neighbours = [radii[(s + count - 1) % count], radii[s], radii[(s + 1) % count]];
            (neighbours.iter().sum::<f64>() / 3.0 - inward).max(1.0)
        })
        .collect()
}

fn sector_of(dx: f64, dy: f64, count: usize) -> usize {
    (((dy.atan2(dx) / TAU + 1.0) * count as f64) as usize) % count
}

/// Half width of the band in which the mark fades into its surroundings, from the mark's own profile.
///
/// Seen from the boundary inwards the component climbs to its plateau. The depth at which the slowest quarter of the
/// boundary has climbed is half the band: codecs and chroma interpolation soften every edge, motion blur the edges
/// across the motion. What a thin line covers is less than a quarter.
fn band_half_width(
    picture: &Picture<'_>,
    axis: HueAxis,
    silhouette: &Silhouette,
    centre: [f64; 2],
    radii: &[f64],
) -> f64 {
    const DEPTHS: usize = MOST_BAND_PX as usize;
    let mut levels: [Vec<i16>; DEPTHS] = std::array::from_fn(|_| Vec::new());
    for [px, py] in &silhouette.points_px {
        let (dx, dy) = (px - centre[0], py - centre[1]);
        let depth = radii[sector_of(dx, dy, radii.len())] - dx.hypot(dy);
        let (x, y) = picture.layout.luma_to_chroma(*px, *py);
        let bin = (depth.max(0.0) as usize).min(DEPTHS - 1);
        levels[bin].push(axis.at(picture, x.round().max(0.0) as usize, y.round().max(0.0) as usize));
    }
    let mut all: Vec<i16> = levels.iter().flatten().copied().collect();
    all.sort_unstable();
    let plateau = f64::from(all[all.len() * 3 / 4]);
    for (depth, bin) in levels.iter_mut().enumerate().filter(|(_, b)| !b.is_empty()) {
        bin.sort_unstable();
        if f64::from(bin[bin.len() / 4]) > 0.85 * plateau {
            return (depth as f64 + 1.5).clamp(LEAST_BAND_PX, MOST_BAND_PX);
        }
    }
    MOST_BAND_PX
}

impl Patch {
    fn read(picture: &Picture<'_>, axis: HueAxis, centre: [f64; 2], reach_px: f64) -> Self {
        let layout = picture.layout;
        let reach = reach_px.ceil() as i64;
        let (cx, cy) = (centre[0] as i64, centre[1] as i64);
        let clamp = |v: i64, size: usize| v.clamp(0, size as i64);
        let (left, right) = (clamp(cx - reach, layout.width_px), clamp(cx + reach + 1, layout.width_px));
        let (top, bottom) = (clamp(cy - reach, layout.height_px), clamp(cy + reach + 1, layout.height_px));
        let (width, height) = ((right - left).max(0) as usize, (bottom - top).max(0) as usize);
        let mut patch =
            Self { left, top, width, height, luma: Vec::new(), component: Vec::with_capacity(width * height) };
        patch.read_luma(picture);
        patch.read_component(picture, axis);
        patch
    }

    fn read_luma(&mut self, picture: &Picture<'_>) {
        let wide = picture.wide();
        let scale = 1.0 / f32::from(1u16 << (picture.layout.bits - 8)) / f32::from(1u16 << picture.layout.low_bits);
        for y in self.top as usize..self.top as usize + self.height {
            for x in self.left as usize..self.left as usize + self.width {
                self.luma.push(f32::from(picture.luma.code(wide, x, y)) * scale);
            }
        }
    }

    /// The projection on the hue (8-bit codes), interpolated between the chroma sites.
    fn read_component(&mut self, picture: &Picture<'_>, axis: HueAxis) {
        let layout = picture.layout;
        let (u, v) = axis.unit();
        let (u, v) = (u as f32, v as f32);
        let (cw, ch) = layout.chroma_size();
        let scale = 1.0 / f32::from(1u16 << (layout.bits - 8)) / f32::from(1u16 << layout.low_bits);
        let (x0, y0) = layout.luma_to_chroma(self.left as f64, self.top as f64);
        let (x1, y1) =
            layout.luma_to_chroma((self.left as usize + self.width) as f64, (self.top as usize + self.height) as f64);
        let first = |v: f64| v.floor().max(0.0) as usize;
        let (cx0, cy0) = (first(x0), first(y0));
        let (cx1, cy1) = ((first(x1) + 2).min(cw), (first(y1) + 2).min(ch));
        let columns = cx1.saturating_sub(cx0);
        let mut coarse = Vec::with_capacity(columns * cy1.saturating_sub(cy0));
        for y in cy0..cy1 {
            for x in cx0..cx1 {
                let b = f32::from(picture.cb.code(picture.wide(), x, y)) * scale - 128.0;
                let r = f32::from(picture.cr.code(picture.wide(), x, y)) * scale - 128.0;
                coarse.push(u * b + v * r);
            }
        }
        let taps = |at: f64, from: usize, to: usize| {
            let at = at.clamp(from as f64, (to - 1) as f64);
            let i = (at as usize).min(to.saturating_sub(2).max(from));
            (i - from, (i + 1).min(to - 1) - from, (at - i as f64) as f32)
        };
        let across: Vec<_> = (0..self.width)
            .map(|i| taps(layout.luma_to_chroma((self.left as usize + i) as f64, 0.0).0, cx0, cx1))
            .collect();
        for j in 0..self.height {
            let (a, b, t) = taps(layout.luma_to_chroma(0.0, (self.top as usize + j) as f64).1, cy0, cy1);
            let (upper, lower) = (&coarse[a * columns..(a + 1) * columns], &coarse[b * columns..(b + 1) * columns]);
            for &(l, r, s) in &across {
                let up = upper[l] + s * (upper[r] - upper[l]);
                let down = lower[l] + s * (lower[r] - lower[l]);
                self.component.push(up + t * (down - up));
            }
        }
    }
}

/// The sectors' common frame.
struct Polar {
    centre: [f64; 2],
    band_px: f32,
    count: usize,
}

impl Polar {
    /// Visits every pixel of the patch with its index, offset from the centre, distance and sector.
    fn visit(&self, patch: &Patch, mut f: impl FnMut(usize, f32, f32, f32, usize)) {
        let turn = self.count as f32 / std::f32::consts::TAU;
        for j in 0..patch.height {
            let dy = (patch.top + j as i64) as f32 - self.centre[1] as f32;
            for i in 0..patch.width {
                let dx = (patch.left + i as i64) as f32 - self.centre[0] as f32;
                let angle = fast_atan2(dy, dx);
                let sector = ((angle * turn) as usize).min(self.count - 1);
                f(j * patch.width + i, dx, dy, (dx * dx + dy * dy).sqrt(), sector);
            }
        }
    }

    /// Reads the background of every sector, the mark's own levels and the noise.
    fn survey(&self, patch: &Patch, sectors: &mut [Sector]) -> Option<Levels> {
        let mut rings: Vec<[Vec<f32>; 2]> = vec![[Vec::with_capacity(12), Vec::with_capacity(12)]; self.count];
        let mut core: [Vec<f32>; 2] = [Vec::new(), Vec::new()];
        let mut deepest = (f32::MAX, [0.0; 2]);
        self.visit(patch, |at, _, _, distance, sector| {
            let depth = distance - sectors[sector].radius_px;
            let levels = [patch.luma[at], patch.component[at]];
            if depth > self.band_px && depth <= self.band_px + RING_PX as f32 {
                for (ring, level) in rings[sector].iter_mut().zip(levels) {
                    ring.push(level);
                }
            } else if depth < -self.band_px {
                for (c, level) in core.iter_mut().zip(levels) {
                    c.push(level);
                }
            }
            if depth < deepest.0 {
                deepest = (depth, levels);
            }
        });
        // a mark narrower than its band has no core: its deepest pixel stands for it
        let mark = if core[0].len() >= 4 { [median(&mut core[0]), median(&mut core[1])] } else { deepest.1 };
        let mut residuals: [Vec<f32>; 2] = [Vec::new(), Vec::new()];
        for (sector, ring) in sectors.iter_mut().zip(&mut rings) {
            if ring[0].len() >= 3 {
                sector.known = true;
                for k in 0..2 {
                    sector.background[k] = median(&mut ring[k]);
                    residuals[k].extend(ring[k].iter().map(|v| (v - sector.background[k]).abs()));
                }
            }
        }
        fill_unknown(sectors)?;
        // 1.4826 × median absolute deviation; the sector medians take up a third of it
        let noise = residuals.map(|mut r| (1.4826 * 1.2 * median(&mut r)).max(LEAST_NOISE));
        for (index, sector) in sectors.iter_mut().enumerate() {
            let reach = sector.radius_px + self.band_px + 0.5 * RING_PX as f32;
            let (sin, cos) = self.direction(index);
            sector.ring = [reach * cos, reach * sin];
        }
        let slope = [0, 1].map(|k| background_slope(sectors, k, noise[k]));
        Some(Levels { mark, noise, slope })
    }

    /// Sine and cosine of the middle of a sector.
    fn direction(&self, index: usize) -> (f32, f32) {
        ((index as f32 + 0.5) / self.count as f32 * std::f32::consts::TAU).sin_cos()
    }

    /// Replaces every sector's radius by that of the circle's sector with the same area of mark, smoothed.
    fn refine(&self, patch: &Patch, sectors: &mut [Sector], levels: &Levels) {
        let weights = shares(sectors, levels);
        let profile = self.profile(patch, sectors, &weights, levels);
        let mut areas = vec![0.0f32; self.count];
        self.visit(patch, |at, dx, dy, distance, sector| {
            let depth = distance - sectors[sector].radius_px;
            if depth < -self.band_px {
                areas[sector] += 1.0;
            } else if depth <= self.band_px {
                let background = sectors[sector].background_at(&levels.slope, dx, dy);
                let share = weights[sector].of(patch.luma[at], patch.component[at], background);
                areas[sector] += share.unwrap_or_else(|| profile.at(depth));
            }
        });
        let radius = |area: f32| (2.0 * area.max(0.0) * self.count as f32 / std::f32::consts::TAU).sqrt();
        // a pixel belongs to one sector whole, so single sectors are uneven: five together are not
        for (index, sector) in sectors.iter_mut().enumerate() {
            let near = [-2i32, -1, 0, 1, 2].map(|k| areas[(index as i32 + k).rem_euclid(self.count as i32) as usize]);
            sector.radius_px = radius(near.iter().sum::<f32>() / 5.0)
                .clamp(sector.radius_px - self.band_px, sector.radius_px + self.band_px)
                .max(1.0);
        }
    }

    /// Shares of mark, their moments, and what follows from them.
    fn integrate(&self, patch: &Patch, sectors: &[Sector], levels: &Levels, picture: &Picture<'_>) -> Option<Centroid> {
        let weights = shares(sectors, levels);
        if weights.iter().all(|w| !w.variance.is_finite()) {
            return None;
        }
        let profile = self.profile(patch, sectors, &weights, levels);
        let mut moments = Moments::default();
        let mut cut = false;
        let (right, bottom) = (picture.layout.width_px as i64 - 1, picture.layout.height_px as i64 - 1);
        self.visit(patch, |at, dx, dy, distance, sector| {
            let depth = distance - sectors[sector].radius_px;
            if depth > self.band_px {
                return;
            }
            let (column, row) = (patch.left + (at % patch.width) as i64, patch.top + (at / patch.width) as i64);
            cut |= column == 0 || row == 0 || column == right || row == bottom;
            if depth < -self.band_px {
                moments.add(1.0, 0.0, dx, dy);
            } else {
                let background = sectors[sector].background_at(&levels.slope, dx, dy);
                let share = weights[sector].of(patch.luma[at], patch.component[at], background);
                moments.add(share.unwrap_or_else(|| profile.at(depth)), weights[sector].variance, dx, dy);
            }
        });
        let mut centroid = moments.centroid()?;
        centroid.cut = cut;
        let inside = centroid.x_px.abs() < patch.width as f64 && centroid.y_px.abs() < patch.height as f64;
        centroid.x_px += self.centre[0];
        centroid.y_px += self.centre[1];
        inside.then_some(centroid)
    }

    /// The mean share of mark against the depth, over the pixels that can be such a mixture.
    fn profile(&self, patch: &Patch, sectors: &[Sector], weights: &[Share], levels: &Levels) -> Profile {
        let mut profile = Profile::new(self.band_px);
        self.visit(patch, |at, dx, dy, distance, sector| {
            let depth = distance - sectors[sector].radius_px;
            if depth.abs() <= self.band_px {
                let background = sectors[sector].background_at(&levels.slope, dx, dy);
                if let Some(share) = weights[sector].of(patch.luma[at], patch.component[at], background) {
                    profile.add(depth, share);
                }
            }
        });
        profile.finish()
    }
}

fn shares(sectors: &[Sector], levels: &Levels) -> Vec<Share> {
    sectors.iter().map(|s| Share::new(levels.mark, s.background, levels.noise)).collect()
}

/// The plane that most sectors' backgrounds lie in, by least squares with outlying sectors left out (a strip's edge,
/// a line). Flat where less than two thirds of them agree.
fn background_slope(sectors: &[Sector], channel: usize, noise: f32) -> [f32; 2] {
    let mut kept: Vec<bool> = sectors.iter().map(|s| s.known).collect();
    let mut plane = [0.0f64; 3];
    for _ in 0..4 {
        let mut normal = nalgebra::Matrix3::zeros();
        let mut right = nalgebra::Vector3::zeros();
        for (sector, _) in sectors.iter().zip(&kept).filter(|(_, k)| **k) {
            let row = nalgebra::Vector3::new(1.0, f64::from(sector.ring[0]), f64::from(sector.ring[1]));
            normal += row * row.transpose();
            right += row * f64::from(sector.background[channel]);
        }
        let Some(solution) = normal.cholesky().map(|c| c.solve(&right)) else { return [0.0; 2] };
        plane = [solution[0], solution[1], solution[2]];
        let residual = |s: &Sector| {
            (f64::from(s.background[channel])
                - plane[0]
                - plane[1] * f64::from(s.ring[0])
                - plane[2] * f64::from(s.ring[1]))
            .abs() as f32
        };
        let mut sizes: Vec<f32> = sectors.iter().filter(|s| s.known).map(residual).collect();
        let limit = (3.0 * 1.4826 * median(&mut sizes)).max(2.0 * noise);
        kept = sectors.iter().map(|s| s.known && residual(s) <= limit).collect();
    }
    if 3 * kept.iter().filter(|k| **k).count() < 2 * sectors.len() {
        return [0.0; 2];
    }
    [plane[1] as f32, plane[2] as f32]
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

/// Mean share of mark in half-pixel steps of depth.
struct Profile {
    band_px: f32,
    bins: Vec<(f32, u32)>,
}

impl Profile {
    fn new(band_px: f32) -> Self {
        Self { band_px, bins: vec![(0.0, 0); (4.0 * band_px) as usize + 2] }
    }

    fn bin(&self, depth: f32) -> usize {
        (((depth + self.band_px) * 2.0).max(0.0) as usize).min(self.bins.len() - 1)
    }

    fn add(&mut self, depth: f32, share: f32) {
        let bin = self.bin(depth);
        self.bins[bin].0 += share;
        self.bins[bin].1 += 1;
    }

    /// Sums → means; an empty bin takes the straight fall from mark to background.
    fn finish(mut self) -> Self {
        let last = self.bins.len() as f32 - 1.0;
        for (i, bin) in self.bins.iter_mut().enumerate() {
            bin.0 = if bin.1 >= 3 { bin.0 / bin.1 as f32 } else { 1.0 - i as f32 / last };
        }
        self
    }

    fn at(&self, depth: f32) -> f32 {
        self.bins[self.bin(depth)].0
    }
}

/// How luma and component of a pixel in one sector give its share of mark.
struct Share {
    /// Factors of (luma − background) and (component − background).
    factors: [f32; 2],
    /// Contrasts of the mark against the background.
    contrasts: [f32; 2],
    /// Variance of the share.
    variance: f32,
    /// Channels with enough contrast to judge whether a pixel is a mixture at all.
    telling: [bool; 2],
}

/// A mixture of mark and background has a share in 0..1; this much beyond is noise, more is a foreign thing.
const BEYOND_MIXTURE: f32 = 0.3;
/// Shares by luma and by component differ by their different sharpness; more is a foreign thing.
const DISAGREEMENT: f32 = 0.65;

impl Share {
    fn new(mark: [f32; 2], background: [f32; 2], noise: [f32; 2]) -> Self {
        let contrasts = [mark[0] - background[0], mark[1] - background[1]];
        let sharing = [1.0, COMPONENT_SHARING];
        let weight = [0, 1].map(|k| 1.0 / ((noise[k] * noise[k] + (EDGE_ERROR * contrasts[k]).powi(2)) * sharing[k]));
        let information = weight[0] * contrasts[0] * contrasts[0] + weight[1] * contrasts[1] * contrasts[1];
        let telling = [0, 1].map(|k| contrasts[k].abs() > 8.0 * noise[k].max(1.0));
        if information <= 1e-6 {
            return Self { factors: [0.0; 2], contrasts, variance: f32::INFINITY, telling };
        }
        let factors = [0, 1].map(|k| weight[k] * contrasts[k] / information);
        Self { factors, contrasts, variance: 1.0 / information, telling }
    }

    /// The share, or `None` for a pixel that is no mixture of mark and background.
    fn of(&self, luma: f32, component: f32, background: [f32; 2]) -> Option<f32> {
        let above = [luma - background[0], component - background[1]];
        let single = [0, 1].map(|k| self.telling[k].then(|| above[k] / self.contrasts[k]));
        let foreign = |s: &f32| *s < -BEYOND_MIXTURE || *s > 1.0 + BEYOND_MIXTURE;
        let differ = matches!(single, [Some(a), Some(b)] if (a - b).abs() > DISAGREEMENT);
        if differ || single.iter().flatten().any(foreign) {
            return None;
        }
        Some(self.factors[0] * above[0] + self.factors[1] * above[1])
    }
}

/// Sectors whose ring lies outside the picture take their neighbours' background.
fn fill_unknown(sectors: &mut [Sector]) -> Option<()> {
    let known: Vec<usize> = (0..sectors.len()).filter(|i| sectors[*i].known).collect();
    if known.len() * 3 < sectors.len() {
        return None;
    }
    let n = sectors.len();
    for i in 0..n {
        if !sectors[i].known {
            let around = |k: &usize| (*k + n - i) % n;
            let distance = |k: &usize| around(k).min(n - around(k));
            let nearest = known.iter().min_by_key(|k| distance(k))?;
            sectors[i].background = sectors[*nearest].background;
        }
    }
    Some(())
}

fn median(values: &mut [f32]) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    let (below, m, _) = values.select_nth_unstable_by(middle, f32::total_cmp);
    let m = *m;
    if below.len() == middle && values.len() % 2 == 0 {
        let under = values[..middle].iter().copied().fold(f32::MIN, f32::max);
        return 0.5 * (m + under);
    }
    m
}

/// Angle in 0..2π to 0.005 rad, enough to name a sector.
fn fast_atan2(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let t = ax.min(ay) / ax.max(ay).max(1e-12);
    let a = t * (0.785_398_2 + 0.273 * (1.0 - t));
    let octant = if ay > ax { std::f32::consts::FRAC_PI_2 - a } else { a };
    let half = if x < 0.0 { std::f32::consts::PI - octant } else { octant };
    if y < 0.0 { std::f32::consts::TAU - half } else { half }
}
