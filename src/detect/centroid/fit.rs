//! Least squares of a swept disc on the shares of mark.

use nalgebra::{Matrix4, Vector4};

use super::disc::Disc;

/// One pixel of the boundary band.
#[derive(Debug, Clone, Copy)]
pub struct Pixel {
    /// From the outline's centre.
    pub x_px: f32,
    /// Downwards.
    pub y_px: f32,
    /// Share of mark.
    pub share: f32,
    /// Its variance.
    pub variance: f32,
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
/// A step this small ends it, px.
const SMALL_STEP_PX: f64 = 1e-3;
/// The longest step, px.
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

/// Fits centre, radius and length of the sweep. `None` where it does not settle near where it began.
pub fn fit(start: Disc, pixels: &[Pixel]) -> Option<Fit> {
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
    let mut residuals = Vec::with_capacity(pixels.len());
    for step in 0..MOST_STEPS {
        let shape = disc_of(&parameters).evaluator(positions);
        let mut normal = Matrix4::<f64>::zeros();
        let mut right = Vector4::<f64>::zeros();
        normal[(3, 3)] = prior;
        right[3] = prior * (1.0 - parameters[3]);
        residuals.clear();
        for pixel in pixels {
            let value = shape.at(pixel.x_px, pixel.y_px);
            let residual = pixel.share - value.share;
            let standard = residual * residual / pixel.variance;
            residuals.push(standard);
            let outlying = standard / (TUKEY * scale).powi(2);
            if outlying >= 1.0 {
                continue;
            }
            let weight = f64::from((1.0 - outlying).powi(2) / pixel.variance);
            let mut slope = Vector4::from(value.slope.map(f64::from));
            slope[3] *= 0.5 / parameters[3];
            normal += weight * slope * slope.transpose();
            right += weight * f64::from(residual) * slope;
        }
        if step < SCALE_STEPS {
            scale = scale_of(&mut residuals);
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
        if step >= 2 && longest < SMALL_STEP_PX {
            let inverse = cholesky.inverse();
            // the residuals' own scale where it is larger than the stated one
            let misfit = f64::from(scale * scale).max(1.0);
            let covariance_px2 = [inverse[(0, 0)], inverse[(1, 1)], inverse[(0, 1)]].map(|v| v * misfit);
            return Some(Fit { disc: disc_of(&parameters), covariance_px2 });
        }
    }
    None
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
