//! Least squares of a swept disc on the shares of mark.

use nalgebra::{Matrix4, Vector4};

use super::disc::{Disc, Evaluator, LANES, Lanes};

/// Pixels of the boundary band that are evaluated together.
#[derive(Debug, Clone, Copy, Default)]
struct Pack {
    x_px: Lanes,
    y_px: Lanes,
    share: Lanes,
    /// 1 / variance of the share; 0 where there is no pixel.
    weight: Lanes,
}

/// The pixels of the boundary band that are mixtures of mark and background.
#[derive(Debug, Clone, Default)]
pub struct Band {
    packs: Vec<Pack>,
    count: usize,
}

impl Band {
    /// Adds a pixel, from the outline's centre, with its share of mark and the share's variance.
    #[inline]
    pub fn push(&mut self, at_px: [f32; 2], share: f32, variance: f32) {
        let lane = self.count % LANES;
        if lane == 0 {
            self.packs.push(Pack::default());
        }
        self.count += 1;
        if let Some(pack) = self.packs.last_mut() {
            [pack.x_px[lane], pack.y_px[lane]] = at_px;
            (pack.share[lane], pack.weight[lane]) = (share, 1.0 / variance);
        }
    }
}

/// A disc that fits.
#[derive(Debug, Clone, Copy)]
pub struct Fit {
    /// The disc.
    pub disc: Disc,
    /// Covariance (xx, yy, xy) of its centre for independent pixels, px².
    pub covariance_px2: [f64; 3],
}

/// Most steps of Gauss and Newton.
const MOST_STEPS: usize = 12;
/// Least square of a sweep over that of its first guess.
const SHORTEST_SWEEP: f64 = 1e-3;
/// Steps after which the residuals' scale stays, so that the weights settle.
const SCALE_STEPS: usize = 4;
/// The longest step, px.
const LONGEST_STEP_PX: f64 = 2.0;
/// Standard deviation of the sweep's length as the second moments give it, px.
const SWEEP_SD_PX: f64 = 3.0;
/// Scales at which Tukey's biweight ends: 95 % efficiency for normal errors (Huber, Robust Statistics, 1981).
const TUKEY: f32 = 4.685;

/// Fits centre, radius and length of the sweep, until a step is smaller than `small_step_px`. `None` where it does not
/// settle near where it began.
pub fn fit(start: Disc, band: &Band, small_step_px: f64) -> Option<Fit> {
    let sweep_px = start.sweep_length_px();
    // the fourth is λ² where the sweep is λ s: α goes with the square of a short sweep, so that its slope by λ vanishes
    let mut parameters =
        Vector4::new(f64::from(start.centre_px[0]), f64::from(start.centre_px[1]), f64::from(start.radius_px), 1.0);
    let prior = (0.5 * f64::from(sweep_px) / SWEEP_SD_PX).powi(2).max(0.25);
    let disc_of = |p: &Vector4<f64>| Disc {
        centre_px: [p[0] as f32, p[1] as f32],
        radius_px: p[2] as f32,
        sweep_px: start.sweep_px.map(|s| s * p[3].sqrt() as f32),
        ..start
    };
    // as many throughout: with another number α would jump
    let positions = start.positions();
    let mut scale = f32::INFINITY;
    let mut squares = Vec::with_capacity(band.count);
    for step in 0..MOST_STEPS {
        squares.clear();
        let sums = Sums::of(band, &disc_of(&parameters).evaluator(positions), scale, &mut squares);
        let (mut normal, mut right) = sums.equations(0.5 / parameters[3]);
        normal[(3, 3)] += prior;
        right[3] += prior * (1.0 - parameters[3]);
        if step < SCALE_STEPS {
            scale = scale_of(&mut squares);
        }
        if parameters[3] <= SHORTEST_SWEEP && right[3] < 0.0 {
            // as short as it can be
            normal.row_mut(3).fill(0.0);
            normal.column_mut(3).fill(0.0);
            (normal[(3, 3)], right[3]) = (1.0, 0.0);
        }
        let cholesky = normal.cholesky()?;
        let mut change = cholesky.solve(&right);
        let longest = change[0].hypot(change[1]);
        if longest > LONGEST_STEP_PX {
            change *= LONGEST_STEP_PX / longest;
        }
        parameters += change;
        parameters[2] = parameters[2].max(0.5);
        parameters[3] = parameters[3].clamp(SHORTEST_SWEEP, 9.0);
        if !parameters.iter().all(|p| p.is_finite()) {
            return None;
        }
        if step >= 2 && longest < small_step_px {
            let inverse = cholesky.inverse();
            // the residuals' own scale where it is larger than the stated one
            let misfit = f64::from(scale * scale).max(1.0);
            let covariance_px2 = [inverse[(0, 0)], inverse[(1, 1)], inverse[(0, 1)]].map(|v| v * misfit);
            return Some(Fit { disc: disc_of(&parameters), covariance_px2 });
        }
    }
    None
}

/// The upper triangle of Σ w ∇α ∇αᵀ row by row, and Σ w (share − α) ∇α.
#[derive(Default)]
struct Sums {
    products: [Lanes; 10],
    right: [Lanes; 4],
}

impl Sums {
    /// Over all pixels, those beyond Tukey's bound left out; the squares of the normalised residuals go to `squares`.
    fn of(band: &Band, shape: &Evaluator, scale: f32, squares: &mut Vec<f32>) -> Self {
        let mut sums = Self::default();
        let bound = 1.0 / (TUKEY * scale).powi(2);
        for pack in &band.packs {
            let value = shape.at(&pack.x_px, &pack.y_px);
            let mut square = Lanes::default();
            let mut weight = Lanes::default();
            let mut pull = Lanes::default();
            for i in 0..LANES {
                let residual = pack.share[i] - value.share[i];
                square[i] = residual * residual * pack.weight[i];
                let inlying = (1.0 - square[i] * bound).max(0.0);
                weight[i] = inlying * inlying * pack.weight[i];
                pull[i] = weight[i] * residual;
            }
            let mut at = 0;
            for a in 0..4 {
                for i in 0..LANES {
                    sums.right[a][i] += pull[i] * value.slope[a][i];
                }
                for b in a..4 {
                    for i in 0..LANES {
                        sums.products[at][i] += weight[i] * value.slope[a][i] * value.slope[b][i];
                    }
                    at += 1;
                }
            }
            squares.extend_from_slice(&square);
        }
        squares.truncate(band.count);
        sums
    }

    /// Normal equations, the fourth parameter's slope times `factor`.
    fn equations(&self, factor: f64) -> (Matrix4<f64>, Vector4<f64>) {
        let total = |lanes: &Lanes| lanes.iter().map(|v| f64::from(*v)).sum::<f64>();
        let mut normal = Matrix4::<f64>::zeros();
        let mut right = Vector4::<f64>::zeros();
        let mut at = 0;
        for a in 0..4 {
            let of_a = if a == 3 { factor } else { 1.0 };
            right[a] = of_a * total(&self.right[a]);
            for b in a..4 {
                let of_b = if b == 3 { factor } else { 1.0 };
                normal[(a, b)] = of_a * of_b * total(&self.products[at]);
                normal[(b, a)] = normal[(a, b)];
                at += 1;
            }
        }
        (normal, right)
    }
}

/// Standard deviation of normalised residuals, from the median of their squares.
fn scale_of(squares: &mut [f32]) -> f32 {
    let middle = squares.len() / 2;
    if squares.is_empty() {
        return 1.0;
    }
    let (_, median, _) = squares.select_nth_unstable_by(middle, f32::total_cmp);
    (median.sqrt() / 0.6745).max(0.3)
}
