//! What lies around a mark: its background in every sector, the mark's own levels, the noise.

use std::rc::Rc;

use nalgebra::{Matrix3, Vector3};

use super::Channels;
use super::disc::Disc;
use super::extrusion::Extrusion;
use super::limb::Shading;
use super::outline::{Outline, RING_PX};
use super::patch::{CHANNELS, Levels, Patch, Sample};
use super::share::{Mixture, Share};
use super::zones::Zones;
use crate::statistics::median;

/// A luma sample's rounding error, 8-bit codes (1/√12), and a little more for the codec.
const LEAST_NOISE: f32 = 0.5;
/// Error of a coded sample at an edge, as a share of the edge's height: codecs spend their bits on luma, and a colour
/// difference scatters three times as much (measured on foreign renderings from crf 10 to 28).
const EDGE_ERROR: Levels = [0.04, 0.12, 0.12];

/// The background of one sector.
#[derive(Clone, Copy, Default)]
struct Sector {
    /// Where the ring is read.
    background: Levels,
    /// The middle of the ring, from the outline's centre.
    ring_px: [f32; 2],
    known: bool,
}

/// What the survey finds.
#[derive(Clone)]
pub struct Surroundings {
    sectors: Vec<Sector>,
    /// The mark's own codes.
    mark: Levels,
    /// How they differ around its edge.
    shading: Shading,
    /// Standard deviation of the channels' noise.
    noise: Levels,
    /// How the background changes across the mark, codes per pixel: ∂/∂x, ∂/∂y of every channel.
    slope: [[f32; 2]; CHANNELS],
    /// What scatters in every sector beside noise: at first the whole ring's scatter, then the sector's own.
    scatter: Vec<Matrix3<f32>>,
    /// Which channels count.
    channels: Channels,
    mixture: Mixture,
    /// How the background goes on from the ring to the mark.
    behind: Behind,
}

/// How the background goes on from the ring to the mark.
#[derive(Clone)]
enum Behind {
    /// As it is in the ring, sector by sector.
    Ring,
    /// As it continues along a direction.
    Along(Extrusion),
    /// As other pictures show it, the light of this one added.
    Known(Rc<Patch>, Levels),
}

/// Bound of a single pixel's misfit, squared standard deviations: a burnt-in line does not decide.
const MOST_MISFIT: f32 = 400.0;
/// Least information on the mark before a known background, as a share of what there is before the ring's: there is next to none where the mark itself is shown.
const LEAST_SEEN: f32 = 0.5;
/// Variance of a channel that does not count, squared codes.
const UNUSED: f32 = 1e6;

impl Surroundings {
    /// Reads ring and core. `None` where most of the ring lies outside the picture.
    pub fn survey(
        zones: &Zones<'_>,
        outline: &Outline,
        (channels, shading, mixture): (Channels, Shading, Mixture),
    ) -> Option<Self> {
        // a mark narrower than its band has no core: its deepest pixel stands for it
        let mark = if zones.core.len() >= 4 {
            [0, 1, 2].map(|k| median(&mut zones.core.iter().map(|s| s.levels[k]).collect::<Vec<_>>()).unwrap_or(0.0))
        } else {
            let inside = zones.core.iter().chain(&zones.band);
            inside.min_by(|a, b| a.depth_px(outline).total_cmp(&b.depth_px(outline)))?.levels
        };
        let scatter = vec![scatter_of(zones.ring.iter().map(|s| s.levels)); outline.count()];
        let mut surroundings = Self {
            sectors: vec![Sector::default(); outline.count()],
            mark,
            shading,
            noise: Levels::default(),
            slope: Default::default(),
            scatter,
            channels,
            mixture,
            behind: Behind::Ring,
        };
        surroundings.read_ring(&zones.ring, outline)?;
        surroundings.slope = [0, 1, 2].map(|k| background_slope(&surroundings.sectors, k, surroundings.noise[k]));
        Some(surroundings)
    }

    /// The same by another outline.
    pub fn anew(&self, zones: &Zones<'_>, outline: &Outline) -> Option<Self> {
        Self::survey(zones, outline, (self.channels, self.shading, self.mixture))
    }

    fn read_ring(&mut self, ring: &[&Sample], outline: &Outline) -> Option<()> {
        let (levels, ends) = by_sector(ring, outline.count());
        let mut residuals: [Vec<f32>; CHANNELS] = [0, 1, 2].map(|_| Vec::with_capacity(ring.len()));
        let mut from = 0;
        for (sector, end) in self.sectors.iter_mut().zip(ends) {
            let group = &levels[std::mem::replace(&mut from, end)..end];
            if group.len() < 3 {
                continue;
            }
            sector.known = true;
            sector.background = medians(group);
            for (k, residual) in residuals.iter_mut().enumerate() {
                residual.extend(group.iter().map(|levels| (levels[k] - sector.background[k]).abs()));
            }
        }
        fill_unknown(&mut self.sectors)?;
        self.drop_lines();
        // 1.4826 × median absolute deviation; the sector medians take up a third of it
        self.noise = residuals.map(|mut r| (1.4826 * 1.2 * median(&mut r).unwrap_or(0.0)).max(LEAST_NOISE));
        for (index, sector) in self.sectors.iter_mut().enumerate() {
            let reach = outline.radii_px[index] + outline.bands_px[index] + 0.5 * RING_PX;
            let (sin, cos) = outline.direction(index);
            sector.ring_px = [reach * cos, reach * sin];
        }
        Some(())
    }

    /// A median over five sectors: a strip's edge stays where it is, a line of one or two sectors goes.
    fn drop_lines(&mut self) {
        let n = self.sectors.len();
        let before: Vec<Levels> = self.sectors.iter().map(|s| s.background).collect();
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
    pub fn background_at(&self, sector: usize, sample: &Sample) -> Levels {
        let levels = match &self.behind {
            Behind::Ring => None,
            Behind::Along(extrusion) => extrusion.at(sample.dx_px, sample.dy_px),
            Behind::Known(scene, light) => Some(lit(scene.levels_at(sample), *light)),
        };
        levels.unwrap_or_else(|| self.continued(&self.sectors[sector], sample.dx_px, sample.dy_px))
    }

    /// Every pixel has a background of its own.
    pub const fn is_known(&self) -> bool {
        matches!(self.behind, Behind::Known(..))
    }

    #[inline]
    fn continued(&self, sector: &Sector, dx: f32, dy: f32) -> Levels {
        let (ex, ey) = (dx - sector.ring_px[0], dy - sector.ring_px[1]);
        [0, 1, 2].map(|k| sector.background[k] + self.slope[k][0] * ex + self.slope[k][1] * ey)
    }

    /// How shares of mark are read in every sector; `None` where the mark stands out nowhere.
    pub fn shares(&self, outline: &Outline) -> Option<Vec<Share>> {
        let share = |((sector, radius), scatter): ((&Sector, &f32), &Matrix3<f32>)| {
            // the background where the mark ends, not where the ring is read
            let inward = radius / sector.ring_px[0].hypot(sector.ring_px[1]).max(1e-3);
            let [x, y] = sector.ring_px.map(|p| inward * p);
            let extruded = match &self.behind {
                Behind::Along(extrusion) => extrusion.under(x, y),
                Behind::Ring | Behind::Known(..) => None,
            };
            let background = extruded.unwrap_or_else(|| self.continued(sector, x, y));
            let reach_px = x.hypot(y).max(1e-3);
            let mark: Levels =
                [0, 1, 2].map(|k| self.mark[k] + (self.shading[k][0] * x + self.shading[k][1] * y) / reach_px);
            let variance = |k: usize| self.noise[k].powi(2) + (EDGE_ERROR[k] * (mark[k] - background[k])).powi(2);
            let [luma, chroma] = match self.channels {
                Channels::All => [0.0, 0.0],
                Channels::Luma => [0.0, UNUSED],
                Channels::Chroma => [UNUSED, 0.0],
            };
            let variances = Vector3::new(variance(0) + luma, variance(1) + chroma, variance(2) + chroma);
            let noise = Matrix3::from_diagonal(&variances);
            Share::new(mark, background, &(noise + scatter), self.mixture)
        };
        let shares: Vec<Share> = self.sectors.iter().zip(&outline.radii_px).zip(&self.scatter).map(share).collect();
        shares.iter().any(|s| s.variance.is_finite()).then_some(shares)
    }

    /// The same, with a background that continues along one direction, in the ways that it may.
    pub fn extruded(&self, patch: &Patch, zones: &Zones<'_>, outline: &Outline, disc: &Disc) -> Vec<Self> {
        let ways = Extrusion::of(patch, zones, outline, disc).into_iter();
        ways.map(|extrusion| Self { behind: Behind::Along(extrusion), ..self.clone() }).collect()
    }

    /// The same, with a background that other pictures show; `None` where they show the mark itself there, so that it would hardly stand out.
    pub fn known(&self, scene: Rc<Patch>, zones: &Zones<'_>, outline: &Outline) -> Option<Self> {
        let off = |sample: &&Sample| {
            let behind = scene.levels_at(sample);
            [0, 1, 2].map(|k| sample.levels[k] - behind[k])
        };
        let offs: Vec<Levels> = zones.ring.iter().map(off).collect();
        let over = |of: &dyn Fn(&Levels) -> f32| median(&mut offs.iter().map(of).collect::<Vec<_>>()).unwrap_or(0.0);
        let light = [0, 1, 2].map(|k: usize| over(&|off| off[k]));
        let noise = [0, 1, 2].map(|k: usize| (1.4826 * over(&|off| (off[k] - light[k]).abs())).max(LEAST_NOISE));
        let known = Self { noise, behind: Behind::Known(scene, light), ..self.clone() };
        let shares = self.shares(outline)?;
        let seen_at = |sample: &&Sample| {
            let sector = usize::from(sample.sector);
            let share = &shares[sector];
            let before = [known.background_at(sector, sample), self.background_at(sector, sample)];
            before.map(|background| share.information_before(background))
        };
        // over the mark itself, and at its edge
        let mut parts = zones.core.iter().map(seen_at).map(|[scene, ring]| scene / ring.max(1e-6)).collect::<Vec<_>>();
        let is_elsewhere = median(&mut parts).is_none_or(|part| part > LEAST_SEEN);
        let sum = |sums: [f32; 2], own: [f32; 2]| [sums[0] + own[0], sums[1] + own[1]];
        let [by_scene, by_ring] = zones.band.iter().map(seen_at).fold([0.0; 2], sum);
        (is_elsewhere && by_scene > LEAST_SEEN * by_ring).then_some(known)
    }

    /// Mean square of what the band holds beside background and mark, in the channels' noise, single pixels bounded.
    pub fn misfit(&self, rests: &[Vector3<f32>]) -> f32 {
        let size = |rest: &Vector3<f32>| (0..CHANNELS).map(|k| (rest[k] / self.noise[k]).powi(2)).sum::<f32>();
        rests.iter().map(|r| size(r).min(MOST_MISFIT)).sum::<f32>() / rests.len().max(1) as f32
    }

    /// Learns what scatters in every sector from what the pixels of its band hold beside background and mark. Five
    /// sectors together: one has too few pixels.
    pub fn learn_scatter<'a>(&mut self, rests: impl Iterator<Item = (u16, &'a Vector3<f32>)>) {
        let count = self.sectors.len();
        let mut sums = vec![(Matrix3::<f32>::zeros(), 0.0f32); count];
        for (sector, rest) in rests {
            let sum = &mut sums[usize::from(sector)];
            sum.0 += rest * rest.transpose();
            sum.1 += 1.0;
        }
        for (sector, scatter) in self.scatter.iter_mut().enumerate() {
            let near = [count - 2, count - 1, 0, 1, 2].map(|k| sums[(sector + k) % count]);
            let pixels: f32 = near.iter().map(|n| n.1).sum();
            if pixels >= 6.0 {
                *scatter = near.iter().map(|n| n.0).sum::<Matrix3<f32>>() / pixels;
            }
        }
    }
}

fn lit(levels: Levels, light: Levels) -> Levels {
    [0, 1, 2].map(|k| levels[k] + light[k])
}

/// The levels of samples, those of the first sector first, and where in them each of `count` sectors ends.
fn by_sector(samples: &[&Sample], count: usize) -> (Vec<Levels>, Vec<usize>) {
    let mut ends = vec![0; count];
    samples.iter().for_each(|s| ends[usize::from(s.sector)] += 1);
    let mut before = 0;
    for end in &mut ends {
        // where the sector begins, until its samples are put there
        before += std::mem::replace(end, before);
    }
    let mut levels = vec![Levels::default(); samples.len()];
    for sample in samples {
        let at = &mut ends[usize::from(sample.sector)];
        levels[*at] = sample.levels;
        *at += 1;
    }
    (levels, ends)
}

/// Samples of a sector's ring that are sorted all at once.
const FEW: usize = 16;

/// The median of every channel.
fn medians(levels: &[Levels]) -> Levels {
    if levels.len() > FEW {
        return [0, 1, 2].map(|k| median(&mut levels.iter().map(|l| l[k]).collect::<Vec<_>>()).unwrap_or(0.0));
    }
    // sorted by exchanging neighbours, the channels side by side: no branch depends on a level
    let mut sorted = [[0.0f32; CHANNELS + 1]; FEW];
    let sorted = &mut sorted[..levels.len()];
    sorted.iter_mut().zip(levels).for_each(|(to, from)| to[..CHANNELS].copy_from_slice(from));
    for pass in 0..levels.len() {
        for pair in sorted[pass % 2..].chunks_exact_mut(2) {
            let (a, b) = (pair[0], pair[1]);
            for k in 0..=CHANNELS {
                (pair[0][k], pair[1][k]) = if b[k] < a[k] { (b[k], a[k]) } else { (a[k], b[k]) };
            }
        }
    }
    let (lower, upper) = (sorted[(levels.len() - 1) / 2], sorted[levels.len() / 2]);
    [0, 1, 2].map(|k| if levels.len().is_multiple_of(2) { (lower[k] + upper[k]) / 2.0 } else { upper[k] })
}

/// Covariance of colours about their mean.
fn scatter_of(colours: impl ExactSizeIterator<Item = Levels> + Clone) -> Matrix3<f32> {
    let share = 1.0 / colours.len().max(1) as f32;
    let mean: Vector3<f32> = colours.clone().map(Vector3::from).sum::<Vector3<f32>>() * share;
    colours.map(|c| Vector3::from(c) - mean).map(|d| d * d.transpose()).sum::<Matrix3<f32>>() * share
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
