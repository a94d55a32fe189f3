//! A background that continues along one direction: a strip, a rod, a thread under or beside the mark.
//!
//! Beside a mark the strip's edge is blurred by the motion, too, so no ring around the mark shows what lies under its
//! boundary. But above and below the mark the strip looks as it does beside it: the background is a function of the
//! coordinate u across the strip, read where the mark is not, and goes over evenly from one side of the mark to the
//! other along v.

use nalgebra::Vector3;

use super::disc::Disc;
use super::outline::{FADE, Outline};
use super::patch::{CHANNELS, Levels, Patch, Sample};
use super::zones::Zones;

/// The background across a direction.
#[derive(Debug, Clone)]
pub struct Extrusion {
    /// Unit vector along u.
    across: [f32; 2],
    /// That of either side, where the strip is bent at the mark.
    of_side: [[f32; 2]; 2],
    /// The mark, at whose centre the sides meet.
    disc: Disc,
    /// u of the first bin.
    from_px: f32,
    /// Background in steps of a pixel of u, on either side along v.
    sides: [Vec<Bin>; 2],
    /// How far from the mark's centre the strip's edges are, towards smaller and greater u.
    edges_px: [Option<f32>; 2],
}

/// The mean of a few pixels.
#[derive(Debug, Clone, Copy, Default)]
struct Bin {
    levels: Levels,
    v_px: f32,
    pixels: f32,
    /// There are pixels of the ring.
    near: bool,
}

/// Fewest pixels of a bin that has a level.
const LEAST_PIXELS: f32 = 0.5;
/// Cosine of the greatest angle between either side and the straight direction (judgement: 30°; a shelf that a strip hangs before goes another way).
const MOST_BENT: f32 = 0.866;

/// How much larger the gradients along one direction must be than across it.
const LEAST_ANISOTROPY: f32 = 4.0;

impl Extrusion {
    /// From what lies outside a mark, straight and, where either side has a direction of its own, bent at the mark; none where it has no direction.
    pub fn of(patch: &Patch, zones: &Zones<'_>, outline: &Outline, disc: &Disc) -> Vec<Self> {
        let Some(across) = direction(patch, zones.ring.iter().copied()) else { return Vec::new() };
        let mut found = vec![Self::along_sides(across, [across; 2], zones, outline, disc)];
        let straight = &found[0];
        let of_side = [false, true].map(|below| {
            direction(patch, zones.ring.iter().copied().filter(|s| (straight.v(s.dx_px, s.dy_px) > 0.0) == below))
        });
        if let [Some(above), Some(below)] = of_side
            && [above, below].iter().all(|own| cosine(*own, across).abs() > MOST_BENT)
        {
            let alike = |own: [f32; 2]| if cosine(own, across) < 0.0 { own.map(|v| -v) } else { own };
            found.push(Self::along_sides(across, [alike(above), alike(below)], zones, outline, disc));
        }
        found
    }

    fn along_sides(
        across: [f32; 2],
        of_side: [[f32; 2]; 2],
        zones: &Zones<'_>,
        outline: &Outline,
        disc: &Disc,
    ) -> Self {
        let reach = outline.reach_px() + 6.0;
        let count = (2.0 * reach) as usize + 2;
        let sides = [vec![Bin::default(); count], vec![Bin::default(); count]];
        let mut extrusion = Self { across, of_side, disc: *disc, from_px: -reach, sides, edges_px: [None; 2] };
        zones.ring.iter().for_each(|sample| extrusion.read(sample, |_| true));
        // the strip may end not far beyond the ring
        extrusion.sides.iter_mut().flatten().for_each(|bin| bin.near = bin.pixels > LEAST_PIXELS);
        zones.beyond.iter().for_each(|sample| extrusion.read(sample, |bin| !bin.near));
        extrusion.sides.iter_mut().flatten().for_each(Bin::finish);
        extrusion.edges_px = [-1.0, 1.0].map(|sign| extrusion.edge_px(sign, outline.reach_px()));
        extrusion
    }

    /// Adds a pixel to the bins of its u that take it.
    fn read(&mut self, sample: &Sample, takes: impl Fn(&Bin) -> bool) {
        let v = self.v(sample.dx_px, sample.dy_px);
        let side = usize::from(v > 0.0);
        let (i, t) = self.bin(side, sample.dx_px, sample.dy_px);
        for (bin, weight) in [(i, 1.0 - t), (i + 1, t)] {
            let bin = &mut self.sides[side][bin];
            if takes(bin) {
                (0..CHANNELS).for_each(|k| bin.levels[k] += weight * sample.levels[k]);
                bin.v_px += weight * v;
                bin.pixels += weight;
            }
        }
    }

    /// Along the direction, from the mark's centre.
    fn v(&self, dx: f32, dy: f32) -> f32 {
        (dy - self.disc.centre_px[1]) * self.across[0] - (dx - self.disc.centre_px[0]) * self.across[1]
    }

    fn bin(&self, side: usize, dx: f32, dy: f32) -> (usize, f32) {
        let [x, y] = self.of_side[side];
        let at = (dx - self.disc.centre_px[0]) * x + (dy - self.disc.centre_px[1]) * y - self.from_px;
        let at = at.clamp(0.0, self.sides[0].len() as f32 - 1.001);
        (at as usize, at - at.floor())
    }

    /// The background at a pixel; `None` where no pixel outside the mark has its u.
    pub fn at(&self, dx: f32, dy: f32) -> Option<Levels> {
        let (i, t) = self.bin(usize::from(self.v(dx, dy) > 0.0), dx, dy);
        let of_side = |side: usize| {
            let (a, b) = (self.sides[side][i], self.sides[side][i + 1]);
            match (a.pixels > LEAST_PIXELS, b.pixels > LEAST_PIXELS) {
                (true, true) => Some((mix(a.levels, b.levels, t), a.v_px + t * (b.v_px - a.v_px))),
                (true, false) => Some((a.levels, a.v_px)),
                (false, true) => Some((b.levels, b.v_px)),
                (false, false) => None,
            }
        };
        match (of_side(0), of_side(1)) {
            (Some((a, from)), Some((b, to))) => {
                let share = if to - from > 1.0 { (self.v(dx, dy) - from) / (to - from) } else { 0.5 };
                Some(mix(a, b, share.clamp(0.0, 1.0)))
            }
            (one, other) => one.or(other).map(|(levels, _)| levels),
        }
    }

    /// The background under the boundary of the mark at rest towards (dx, dy), where the mark takes what lies under it along while the shutter is open. An edge of the
    /// strip, blurred by that, still has half of its height where the edge of the sharp strip is: what lies on the mark's side of it is as the strip is beyond the blur.
    pub fn under(&self, dx: f32, dy: f32) -> Option<Levels> {
        let across @ [x, y] = self.of_side[usize::from(self.v(dx, dy) > 0.0)];
        let at_rest = (dx - self.disc.centre_px[0]) * x + (dy - self.disc.centre_px[1]) * y;
        let size = match self.edges_px[usize::from(at_rest > 0.0)] {
            Some(edge_px) if at_rest.abs() <= edge_px => {
                at_rest.abs().min((edge_px - self.blurred_px(across)).max(0.0))
            }
            Some(edge_px) => at_rest.abs().max(edge_px + self.blurred_px(across)),
            None => at_rest.abs(),
        };
        let back = size.copysign(at_rest) - at_rest;
        self.at(dx + back * x, dy + back * y)
    }

    /// How far from an edge its blur by motion, lens and codec reaches.
    fn blurred_px(&self, [x, y]: [f32; 2]) -> f32 {
        let [sx, sy] = self.disc.sweep_px;
        0.5 * (sx * x + sy * y).abs() + FADE * self.disc.blur_px
    }

    /// How far from the mark's centre the strip has an edge to one side: where the background is midway between that under the mark and that beside it. `None`
    /// where it goes over more slowly than a blurred edge does.
    fn edge_px(&self, sign: f32, reach_px: f32) -> Option<f32> {
        let [cx, cy] = self.disc.centre_px;
        let [x, y] = self.across;
        let level = |u: usize| self.at(cx + sign * u as f32 * x, cy + sign * u as f32 * y).map(Vector3::from);
        let centre = level(0)?;
        let beside = (1..=reach_px as usize).rev().find_map(level)?;
        let change = beside - centre;
        if change.norm_squared() == 0.0 {
            return None;
        }
        let part = |u: usize| Some((level(u)? - centre).dot(&change) / change.norm_squared());
        let first_beyond = |share: f32| {
            let mut before = 0.0;
            for u in 0..self.sides[0].len() {
                let after = part(u + 1)?;
                if after >= share {
                    return Some(u as f32 + (share - before) / (after - before));
                }
                before = after;
            }
            None
        };
        let (half_px, most_px) = (first_beyond(0.5)?, first_beyond(0.9)?);
        (most_px - half_px <= self.blurred_px(self.across)).then_some(half_px)
    }
}

impl Bin {
    fn finish(&mut self) {
        if self.pixels > LEAST_PIXELS {
            self.levels = self.levels.map(|l| l / self.pixels);
            self.v_px /= self.pixels;
        }
    }
}

/// Of the angle between two unit vectors.
fn cosine(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[0] + a[1] * b[1]
}

fn mix(a: Levels, b: Levels, share: f32) -> Levels {
    [0, 1, 2].map(|k| a[k] + share * (b[k] - a[k]))
}

/// The direction of the strongest gradients outside the mark (structure tensor), where there is one.
fn direction<'a>(patch: &Patch, samples: impl Iterator<Item = &'a Sample>) -> Option<[f32; 2]> {
    let (mut xx, mut yy, mut xy) = (0.0f32, 0.0f32, 0.0f32);
    for sample in samples {
        for [gx, gy] in patch.gradients(sample) {
            (xx, yy, xy) = (xx + gx * gx, yy + gy * gy, xy + gx * gy);
        }
    }
    let (middle, half) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
    if middle + half == 0.0 || middle + half < LEAST_ANISOTROPY * (middle - half) {
        return None;
    }
    let (sin, cos) = (0.5 * (2.0 * xy).atan2(xx - yy)).sin_cos();
    Some([cos, sin])
}
