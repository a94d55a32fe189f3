//! A disc, swept along a line while the shutter is open, blurred by lens, codec and subsampling.
//!
//! ```text
//! α(p) = (1/K) Σ_k S((r − |p − c − t_k s|)/σ),   t_k = (k + ½)/K − ½
//! S(z) = ½ + (15/16) (u − ⅔ u³ + ⅕ u⁵),   u = z/√7 in −1..1
//! ```
//! with centre c, radius r, sweep s (the way of the mark during the exposure) and the standard deviation σ of the
//! blur, whose kernel is the biweight: near the normal distribution, and a polynomial. Every parameter but the centre
//! changes α alike on opposite sides, so none of them can pull it.

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

/// Pixels that are evaluated together, so that the compiler can use vector instructions.
pub const LANES: usize = 8;
/// One number for each of them.
pub type Lanes = [f32; LANES];

/// α of some pixels with its derivatives by centre (x, y), radius and relative length of the sweep.
#[derive(Debug, Clone, Copy, Default)]
pub struct Values {
    /// α.
    pub share: Lanes,
    /// ∂α/∂(x, y, r, λ) where the sweep is λ s.
    pub slope: [Lanes; 4],
}

/// Most sub-positions of a sweep.
const MOST_POSITIONS: f32 = 32.0;
/// Standard deviations of the blur from one position to the next. The midpoint rule on what is blurred so much errs by
/// exp(−2π² σ²/h²) = 2·10⁻⁴.
const SPACING: f32 = 1.5;
/// Half-width of the biweight kernel over its standard deviation: √7.
const HALF_WIDTH: f32 = 2.645_751_3;

/// Evaluates one disc at many pixels.
pub struct Evaluator {
    disc: Disc,
    /// Position along the sweep, x, y, and t.
    positions: Vec<[f32; 3]>,
}

impl Disc {
    /// The same, swept across.
    pub const fn turned(&self) -> Self {
        let [x, y] = self.sweep_px;
        Self { sweep_px: [-y, x], ..*self }
    }

    /// Length of the sweep.
    pub fn sweep_length_px(&self) -> f32 {
        self.sweep_px[0].hypot(self.sweep_px[1])
    }

    /// Positions along the sweep that blend into one, and enough to see its length.
    pub fn positions(&self) -> usize {
        (self.sweep_length_px() / (SPACING * self.blur_px.max(0.3))).ceil().clamp(3.0, MOST_POSITIONS) as usize
    }

    /// Ready to be evaluated as a sum over `count` positions.
    pub fn evaluator(&self, count: usize) -> Evaluator {
        let position = |k: usize| {
            let t = (k as f32 + 0.5) / count as f32 - 0.5;
            [self.centre_px[0] + t * self.sweep_px[0], self.centre_px[1] + t * self.sweep_px[1], t]
        };
        Evaluator { disc: *self, positions: (0..count).map(position).collect() }
    }
}

impl Evaluator {
    /// At pixels, from the outline's centre.
    #[inline]
    pub fn at(&self, x: &Lanes, y: &Lanes) -> Values {
        let mut sum = Values::default();
        let radius = self.disc.radius_px;
        let [along_x, along_y] = self.disc.sweep_px;
        let sharpness = 1.0 / (HALF_WIDTH * self.disc.blur_px);
        for [px, py, t] in &self.positions {
            for i in 0..LANES {
                let (dx, dy) = (x[i] - px, y[i] - py);
                let distance = (dx * dx + dy * dy).sqrt().max(1e-3);
                let u = ((radius - distance) * sharpness).clamp(-1.0, 1.0);
                let square = u * u;
                sum.share[i] += u * (1.0 - square * (2.0 / 3.0 - 0.2 * square));
                let density = (1.0 - square) * (1.0 - square);
                let outward = density / distance;
                sum.slope[0][i] += outward * dx;
                sum.slope[1][i] += outward * dy;
                sum.slope[2][i] += density;
                sum.slope[3][i] += t * outward * (dx * along_x + dy * along_y);
            }
        }
        let mean = 0.9375 / self.positions.len() as f32;
        let steepness = mean * sharpness;
        for i in 0..LANES {
            sum.share[i] = 0.5 + mean * sum.share[i];
            (0..4).for_each(|k| sum.slope[k][i] *= steepness);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_the_share() {
        let disc = Disc { centre_px: [0.3, -0.2], radius_px: 8.0, sweep_px: [6.0, 2.0], blur_px: 1.1 };
        let at = |d: &Disc| d.evaluator(9).at(&[9.4; LANES], &[3.1; LANES]);
        let h = 0.05;
        let moved = |change: &dyn Fn(&mut Disc, f32)| {
            let (mut up, mut down) = (disc, disc);
            change(&mut up, h);
            change(&mut down, -h);
            (at(&up).share[3] - at(&down).share[3]) / (2.0 * h)
        };
        let slopes = [
            moved(&|d, h| d.centre_px[0] += h),
            moved(&|d, h| d.centre_px[1] += h),
            moved(&|d, h| d.radius_px += h),
            moved(&|d, h| d.sweep_px = d.sweep_px.map(|s| s * (1.0 + h))),
        ];
        let value = at(&disc);
        for (a, b) in value.slope.iter().zip(slopes) {
            assert!((a[3] - b).abs() < 2e-3, "{:?} {slopes:?}", value.slope);
        }
    }

    #[test]
    fn the_area_of_a_swept_disc_is_that_of_the_disc() {
        for sweep_px in [[0.0, 0.0], [12.0, 0.0], [9.0, 14.0]] {
            let disc = Disc { centre_px: [0.0, 0.0], radius_px: 9.0, sweep_px, blur_px: 1.0 };
            let shape = disc.evaluator(disc.positions());
            let pixels = (-30..=30).flat_map(|y| (-30..=30).map(move |x| (x as f32, y as f32)));
            let area: f32 = pixels.map(|(x, y)| shape.at(&[x; LANES], &[y; LANES]).share[0]).sum();
            let exact = std::f32::consts::PI * (81.0 + 1.0);
            assert!((area / exact - 1.0).abs() < 0.005, "{area} {exact}");
        }
    }
}
