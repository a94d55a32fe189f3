//! A disc, swept along a line while the shutter is open, blurred by lens, codec and subsampling.
//!
//! ```text
//! α(p) = (1/K) Σ_k Φ((r − |p − c − t_k s|)/σ),   t_k = (k + ½)/K − ½
//! ```
//! with centre c, radius r, sweep s (the way of the mark during the exposure) and the standard deviation σ of the
//! blur. Every parameter but the centre changes α alike on opposite sides, so none of them can pull it.

use std::sync::LazyLock;

/// The shape of a mark in one exposure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc {
    /// From the outline's centre, px.
    pub centre_px: [f32; 2],
    /// Of the mark at rest.
    pub radius_px: f32,
    /// Way of the mark during the exposure.
    pub sweep_px: [f32; 2],
    /// Standard deviation of the blur.
    pub blur_px: f32,
}

/// α of one pixel with its derivatives by centre (x, y), radius and relative length of the sweep.
#[derive(Debug, Clone, Copy, Default)]
pub struct Value {
    /// α.
    pub share: f32,
    /// ∂α/∂(x, y, r, λ) where the sweep is λ s.
    pub slope: [f32; 4],
}

/// Half-width of the table of Φ, standard deviations.
const TABLE_REACH: f32 = 4.0;
/// Steps of the table in one standard deviation.
const TABLE_STEPS: f32 = 64.0;
/// Most sub-positions of a sweep.
const MOST_POSITIONS: f32 = 32.0;

/// (Φ, φ) of the normal distribution on an even grid.
static NORMAL: LazyLock<Vec<(f32, f32)>> = LazyLock::new(|| {
    (0..=(2.0 * TABLE_REACH * TABLE_STEPS) as i32)
        .map(|i| {
            let z = f64::from(i) / f64::from(TABLE_STEPS) - f64::from(TABLE_REACH);
            let density = (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
            ((0.5 * libm::erfc(-z / std::f64::consts::SQRT_2)) as f32, density as f32)
        })
        .collect()
});

/// Evaluates one disc at many pixels.
pub struct Evaluator<'a> {
    disc: Disc,
    positions: Vec<[f32; 2]>,
    times: Vec<f32>,
    table: &'a [(f32, f32)],
}

impl Disc {
    /// Length of the sweep.
    pub fn sweep_length_px(&self) -> f32 {
        self.sweep_px[0].hypot(self.sweep_px[1])
    }

    /// Positions along the sweep that are no farther apart than the blur is wide, and enough to see its length.
    pub fn positions(&self) -> usize {
        (self.sweep_length_px() / self.blur_px.max(0.3)).ceil().clamp(3.0, MOST_POSITIONS) as usize
    }

    /// Ready to be evaluated as a sum over `count` positions.
    pub fn evaluator(&self, count: usize) -> Evaluator<'static> {
        let (positions, count) = (count, count as f32);
        let times: Vec<f32> = (0..positions).map(|k| (k as f32 + 0.5) / count - 0.5).collect();
        let positions = times.iter().map(|t| [0, 1].map(|i| self.centre_px[i] + t * self.sweep_px[i])).collect();
        Evaluator { disc: *self, positions, times, table: &NORMAL }
    }
}

impl Evaluator<'_> {
    /// At a pixel, from the outline's centre.
    #[inline]
    pub fn at(&self, x: f32, y: f32) -> Value {
        let mut value = Value::default();
        let (radius, sharpness) = (self.disc.radius_px, 1.0 / self.disc.blur_px);
        for (position, time) in self.positions.iter().zip(&self.times) {
            let (dx, dy) = (x - position[0], y - position[1]);
            let distance = (dx * dx + dy * dy).sqrt();
            let (share, density) = self.normal((radius - distance) * sharpness);
            let slope = density * sharpness;
            let outward = slope / distance.max(1e-3);
            let along = outward * (dx * self.disc.sweep_px[0] + dy * self.disc.sweep_px[1]);
            value.share += share;
            value.slope[0] += outward * dx;
            value.slope[1] += outward * dy;
            value.slope[2] += slope;
            value.slope[3] += time * along;
        }
        let mean = 1.0 / self.positions.len() as f32;
        value.share *= mean;
        value.slope.iter_mut().for_each(|s| *s *= mean);
        value
    }

    #[inline]
    fn normal(&self, z: f32) -> (f32, f32) {
        let at = ((z + TABLE_REACH) * TABLE_STEPS).clamp(0.0, 2.0 * TABLE_REACH * TABLE_STEPS - 1.0);
        let i = at as usize;
        let t = at - i as f32;
        let (a, b) = (self.table[i], self.table[i + 1]);
        (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_the_share() {
        let disc = Disc { centre_px: [0.3, -0.2], radius_px: 8.0, sweep_px: [6.0, 2.0], blur_px: 1.1 };
        let at = |d: &Disc| d.evaluator(9).at(9.4, 3.1).share;
        let value = disc.evaluator(9).at(9.4, 3.1);
        let h = 0.05;
        let moved = |change: &dyn Fn(&mut Disc, f32)| {
            let (mut up, mut down) = (disc, disc);
            change(&mut up, h);
            change(&mut down, -h);
            (at(&up) - at(&down)) / (2.0 * h)
        };
        let slopes = [
            moved(&|d, h| d.centre_px[0] += h),
            moved(&|d, h| d.centre_px[1] += h),
            moved(&|d, h| d.radius_px += h),
            moved(&|d, h| d.sweep_px = d.sweep_px.map(|s| s * (1.0 + h))),
        ];
        for (a, b) in value.slope.iter().zip(slopes) {
            assert!((a - b).abs() < 2e-3, "{:?} {slopes:?}", value.slope);
        }
    }

    #[test]
    fn the_area_of_a_swept_disc_is_that_of_the_disc() {
        for sweep_px in [[0.0, 0.0], [12.0, 0.0], [9.0, 14.0]] {
            let disc = Disc { centre_px: [0.0, 0.0], radius_px: 9.0, sweep_px, blur_px: 1.0 };
            let shape = disc.evaluator(disc.positions());
            let area: f32 = (-30..=30)
                .flat_map(|y| (-30..=30).map(move |x| (x as f32, y as f32)))
                .map(|(x, y)| shape.at(x, y).share)
                .sum();
            let exact = std::f32::consts::PI * (81.0 + 1.0);
            assert!((area / exact - 1.0).abs() < 0.005, "{area} {exact}");
        }
    }
}
