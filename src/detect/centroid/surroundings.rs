//! What lies around a mark: its background in every sector, the mark's own levels, the noise.

use super::outline::Outline;
use super::patch::{Patch, Sample};
use super::share::Share;
use crate::statistics::median;

/// Width of the ring from which the background is read.
pub const RING_PX: f32 = 3.0;
/// A luma sample's rounding error, 8-bit codes (1/√12), and a little more for the codec.
const LEAST_NOISE: f32 = 0.5;

/// The background of one sector.
#[derive(Clone, Copy, Default)]
struct Sector {
    /// Luma and component where the ring is read.
    background: [f32; 2],
    /// The middle of the ring, from the outline's centre.
    ring_px: [f32; 2],
    known: bool,
}

/// What the survey finds.
pub struct Surroundings {
    sectors: Vec<Sector>,
    /// Luma and component of the mark.
    mark: [f32; 2],
    /// Their noise.
    noise: [f32; 2],
    /// How the background changes across the mark, per pixel: ∂/∂x, ∂/∂y of luma and of the component.
    slope: [[f32; 2]; 2],
}

impl Surroundings {
    /// Reads ring and core. `None` where most of the ring lies outside the picture.
    pub fn survey(patch: &Patch, outline: &Outline) -> Option<Self> {
        let mut ring: Vec<(u16, [f32; 2])> = Vec::with_capacity(patch.samples.len() / 2);
        let mut core: [Vec<f32>; 2] = [Vec::new(), Vec::new()];
        let mut deepest = (f32::MAX, [0.0; 2]);
        for sample in &patch.samples {
            let depth = sample.distance_px - outline.radii_px[usize::from(sample.sector)];
            if depth > outline.band_px && depth <= outline.band_px + RING_PX {
                ring.push((sample.sector, sample.levels));
            } else if depth < -outline.band_px {
                core[0].push(sample.levels[0]);
                core[1].push(sample.levels[1]);
            }
            if depth < deepest.0 {
                deepest = (depth, sample.levels);
            }
        }
        // a mark narrower than its band has no core: its deepest pixel stands for it
        let mark = if core[0].len() >= 4 { core.map(|mut c| median(&mut c).unwrap_or(0.0)) } else { deepest.1 };
        let mut surroundings =
            Self { sectors: vec![Sector::default(); outline.count()], mark, noise: [0.0; 2], slope: [[0.0; 2]; 2] };
        surroundings.read_ring(ring, outline)?;
        surroundings.slope = [0, 1].map(|k| background_slope(&surroundings.sectors, k, surroundings.noise[k]));
        Some(surroundings)
    }

    fn read_ring(&mut self, mut ring: Vec<(u16, [f32; 2])>, outline: &Outline) -> Option<()> {
        ring.sort_unstable_by_key(|(sector, _)| *sector);
        let mut residuals: [Vec<f32>; 2] = [Vec::with_capacity(ring.len()), Vec::with_capacity(ring.len())];
        let mut values = Vec::with_capacity(32);
        for group in ring.chunk_by(|a, b| a.0 == b.0).filter(|g| g.len() >= 3) {
            let sector = &mut self.sectors[usize::from(group[0].0)];
            sector.known = true;
            for (k, residual) in residuals.iter_mut().enumerate() {
                values.clear();
                values.extend(group.iter().map(|(_, levels)| levels[k]));
                let level = median(&mut values).unwrap_or(0.0);
                sector.background[k] = level;
                residual.extend(values.iter().map(|v| (v - level).abs()));
            }
        }
        fill_unknown(&mut self.sectors)?;
        self.drop_lines();
        // 1.4826 × median absolute deviation; the sector medians take up a third of it
        self.noise = residuals.map(|mut r| (1.4826 * 1.2 * median(&mut r).unwrap_or(0.0)).max(LEAST_NOISE));
        for (index, sector) in self.sectors.iter_mut().enumerate() {
            let reach = outline.radii_px[index] + outline.band_px + 0.5 * RING_PX;
            let (sin, cos) = outline.direction(index);
            sector.ring_px = [reach * cos, reach * sin];
        }
        Some(())
    }

    /// A median over five sectors: a strip's edge stays where it is, a line of one or two sectors goes.
    fn drop_lines(&mut self) {
        let n = self.sectors.len();
        let before: Vec<[f32; 2]> = self.sectors.iter().map(|s| s.background).collect();
        for (index, sector) in self.sectors.iter_mut().enumerate() {
            for (k, level) in sector.background.iter_mut().enumerate() {
                let mut near = [n - 2, n - 1, 0, 1, 2].map(|d| before[(index + d) % n][k]);
                near.sort_unstable_by(f32::total_cmp);
                *level = near[2];
            }
        }
    }

    /// The background of a sector continued from the ring to a pixel.
    #[inline]
    pub fn background_at(&self, sector: usize, sample: &Sample) -> [f32; 2] {
        self.continued(&self.sectors[sector], sample.dx_px, sample.dy_px)
    }

    #[inline]
    fn continued(&self, sector: &Sector, dx: f32, dy: f32) -> [f32; 2] {
        let (ex, ey) = (dx - sector.ring_px[0], dy - sector.ring_px[1]);
        [0, 1].map(|k| sector.background[k] + self.slope[k][0] * ex + self.slope[k][1] * ey)
    }

    /// How shares of mark are read in every sector; `None` where the mark stands out nowhere.
    pub fn shares(&self, outline: &Outline) -> Option<Vec<Share>> {
        let share = |(sector, radius): (&Sector, &f32)| {
            // the background where the mark ends, not where the ring is read
            let inward = radius / sector.ring_px[0].hypot(sector.ring_px[1]).max(1e-3);
            let background = self.continued(sector, inward * sector.ring_px[0], inward * sector.ring_px[1]);
            Share::new(self.mark, background, self.noise)
        };
        let shares: Vec<Share> = self.sectors.iter().zip(&outline.radii_px).map(share).collect();
        shares.iter().any(|s| s.variance.is_finite()).then_some(shares)
    }
}

/// The plane that the sectors' backgrounds lie in, by least squares with outlying sectors left out (a line). Flat
/// where the background has an edge, such as a strip's, or where less than two thirds of the sectors agree.
fn background_slope(sectors: &[Sector], channel: usize, noise: f32) -> [f32; 2] {
    if has_edge(sectors, channel, noise) {
        return [0.0; 2];
    }
    let mut kept: Vec<bool> = sectors.iter().map(|s| s.known).collect();
    let mut plane = [0.0f64; 3];
    for _ in 0..4 {
        let mut normal = nalgebra::Matrix3::zeros();
        let mut right = nalgebra::Vector3::zeros();
        for (sector, _) in sectors.iter().zip(&kept).filter(|(_, k)| **k) {
            let row = nalgebra::Vector3::new(1.0, f64::from(sector.ring_px[0]), f64::from(sector.ring_px[1]));
            normal += row * row.transpose();
            right += row * f64::from(sector.background[channel]);
        }
        let Some(solution) = normal.cholesky().map(|c| c.solve(&right)) else { return [0.0; 2] };
        plane = [solution[0], solution[1], solution[2]];
        let residual = |s: &Sector| {
            (f64::from(s.background[channel])
                - plane[0]
                - plane[1] * f64::from(s.ring_px[0])
                - plane[2] * f64::from(s.ring_px[1]))
            .abs() as f32
        };
        let mut sizes: Vec<f32> = sectors.iter().filter(|s| s.known).map(residual).collect();
        let limit = (3.0 * 1.4826 * median(&mut sizes).unwrap_or(0.0)).max(2.0 * noise);
        kept = sectors.iter().map(|s| s.known && residual(s) <= limit).collect();
    }
    if 3 * kept.iter().filter(|k| **k).count() < 2 * sectors.len() {
        return [0.0; 2];
    }
    [plane[1] as f32, plane[2] as f32]
}

/// Two halves of an eighth turn, side by side, differ by half of the whole range.
fn has_edge(sectors: &[Sector], channel: usize, noise: f32) -> bool {
    let n = sectors.len();
    let mut levels: Vec<f32> = sectors.iter().map(|s| s.background[channel]).collect();
    let half = (n / 16).max(1);
    let level = |i: usize| sectors[i % n].background[channel];
    let mid = |from: usize| (from..from + half).map(level).sum::<f32>() / half as f32;
    let steepest = (0..n).map(|i| (mid(i) - mid(i + half)).abs()).fold(0.0, f32::max);
    levels.sort_by(f32::total_cmp);
    let range = levels[n * 9 / 10] - levels[n / 10];
    steepest > 0.5 * range && steepest > 4.0 * noise
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
