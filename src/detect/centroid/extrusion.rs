//! A background that continues along one direction: a strip, a rod, a thread under or beside the mark.
//!
//! Beside a mark the strip's edge is blurred by the motion, too, so no ring around the mark shows what lies under its
//! boundary. But above and below the mark the strip looks as it does beside it: the background is a function of the
//! coordinate u across the strip, read where the mark is not, and goes over evenly from one side of the mark to the
//! other along v.

use super::disc::Disc;
use super::outline::Outline;
use super::patch::{CHANNELS, Levels, Patch};
use super::zones::Zones;

/// The background across a direction.
#[derive(Debug, Clone)]
pub struct Extrusion {
    /// Unit vector along u.
    across: [f32; 2],
    /// u of the first bin.
    from_px: f32,
    /// Background in steps of a pixel of u, on either side along v.
    sides: [Vec<Bin>; 2],
}

/// The mean of a few pixels.
#[derive(Debug, Clone, Copy, Default)]
struct Bin {
    levels: Levels,
    v_px: f32,
    pixels: f32,
}

/// How much larger the gradients along one direction must be than across it.
const LEAST_ANISOTROPY: f32 = 4.0;

impl Extrusion {
    /// From what lies outside a mark; `None` where it has no direction.
    pub fn of(patch: &Patch, zones: &Zones<'_>, outline: &Outline, disc: &Disc) -> Option<Self> {
        let across = direction(patch, zones)?;
        let reach = outline.reach_px() + 6.0;
        let count = (2.0 * reach) as usize + 2;
        let mut extrusion =
            Self { across, from_px: -reach, sides: [vec![Bin::default(); count], vec![Bin::default(); count]] };
        let middle_px = extrusion.along(disc.centre_px[0], disc.centre_px[1]);
        for sample in zones.ring.iter().chain(&zones.beyond) {
            let v = extrusion.along(sample.dx_px, sample.dy_px);
            let (i, t) = extrusion.bin(sample.dx_px, sample.dy_px);
            let side = &mut extrusion.sides[usize::from(v > middle_px)];
            for (bin, weight) in [(i, 1.0 - t), (i + 1, t)] {
                let bin = &mut side[bin];
                (0..CHANNELS).for_each(|k| bin.levels[k] += weight * sample.levels[k]);
                bin.v_px += weight * v;
                bin.pixels += weight;
            }
        }
        extrusion.sides.iter_mut().flatten().for_each(Bin::finish);
        Some(extrusion)
    }

    fn along(&self, dx: f32, dy: f32) -> f32 {
        dy * self.across[0] - dx * self.across[1]
    }

    fn bin(&self, dx: f32, dy: f32) -> (usize, f32) {
        let at = dx * self.across[0] + dy * self.across[1] - self.from_px;
        let at = at.clamp(0.0, self.sides[0].len() as f32 - 1.001);
        (at as usize, at - at.floor())
    }

    /// The background at a pixel; `None` where no pixel outside the mark has its u.
    pub fn at(&self, dx: f32, dy: f32) -> Option<Levels> {
        let (i, t) = self.bin(dx, dy);
        let side = |side: &[Bin]| {
            let (a, b) = (side[i], side[i + 1]);
            match (a.pixels > 0.5, b.pixels > 0.5) {
                (true, true) => Some((mix(a.levels, b.levels, t), a.v_px + t * (b.v_px - a.v_px))),
                (true, false) => Some((a.levels, a.v_px)),
                (false, true) => Some((b.levels, b.v_px)),
                (false, false) => None,
            }
        };
        match (side(&self.sides[0]), side(&self.sides[1])) {
            (Some((a, from)), Some((b, to))) => {
                let share = if to - from > 1.0 { (self.along(dx, dy) - from) / (to - from) } else { 0.5 };
                Some(mix(a, b, share.clamp(0.0, 1.0)))
            }
            (one, other) => one.or(other).map(|(levels, _)| levels),
        }
    }

    /// The background under the boundary of the mark at rest towards (dx, dy): while the shutter is open, the mark
    /// takes what lies under it along.
    pub fn under(&self, disc: &Disc, dx: f32, dy: f32) -> Option<Levels> {
        let [x, y] = disc.centre_px;
        let u = (dx - x) * self.across[0] + (dy - y) * self.across[1];
        let most = (disc.radius_px - 1.0).max(0.0);
        let back = u.clamp(-most, most) - u;
        self.at(dx + back * self.across[0], dy + back * self.across[1])
    }
}

impl Bin {
    fn finish(&mut self) {
        if self.pixels > 0.5 {
            self.levels = self.levels.map(|l| l / self.pixels);
            self.v_px /= self.pixels;
        }
    }
}

fn mix(a: Levels, b: Levels, share: f32) -> Levels {
    [0, 1, 2].map(|k| a[k] + share * (b[k] - a[k]))
}

/// The direction of the strongest gradients outside the mark (structure tensor), where there is one.
fn direction(patch: &Patch, zones: &Zones<'_>) -> Option<[f32; 2]> {
    let (mut xx, mut yy, mut xy) = (0.0f32, 0.0f32, 0.0f32);
    for sample in zones.ring.iter().chain(&zones.beyond) {
        for [gx, gy] in patch.gradients(sample) {
            (xx, yy, xy) = (xx + gx * gx, yy + gy * gy, xy + gx * gy);
        }
    }
    let (middle, half) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
    if middle + half < LEAST_ANISOTROPY * (middle - half) {
        return None;
    }
    let (sin, cos) = (0.5 * (2.0 * xy).atan2(xx - yy)).sin_cos();
    Some([cos, sin])
}
