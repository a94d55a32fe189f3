//! A picture without its noise, for choosing what of it can be found again.

use super::luma::{HALF, Luma};

/// Half the side of the square over which the picture is smoothed for its gradients, and half the distance between
/// the two means that make one, px: farther than the noise of one pixel reaches.
const SMOOTH_HALF: usize = 2;
const GRADIENT_HALF: usize = 3;
/// Of a picture that is smoothed so much every third pixel says what its neighbours say.
const STEP: usize = 3;
/// The picture smoothed, in which noise has hardly a gradient.
pub(super) struct Smooth {
    width: usize,
    height: usize,
    /// Means of squares of 5 × 5 pixels about each pixel, row by row; next to the edge, 0.
    means: Vec<f32>,
}

impl Smooth {
    pub fn of(luma: &Luma) -> Self {
        let (width, height, side) = (luma.width, luma.height, 2 * SMOOTH_HALF + 1);
        // whole rows at a time, in loops that the compiler can turn into vector instructions
        let add = |sums: &mut [f32], row: &[f32]| sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += value);
        let mut across = vec![0.0f32; width * height];
        let mut row = Vec::with_capacity(width);
        for (y, sums) in across.chunks_exact_mut(width).enumerate() {
            row.clear();
            row.extend((0..width).map(|x| luma.code(x as i64, y as i64)));
            let inside = &mut sums[SMOOTH_HALF..width - SMOOTH_HALF];
            (0..side).for_each(|k| add(inside, &row[k..]));
        }
        let mut means = vec![0.0f32; width * height];
        for y in SMOOTH_HALF..height.saturating_sub(SMOOTH_HALF) {
            let mean = &mut means[y * width..(y + 1) * width];
            (y - SMOOTH_HALF..=y + SMOOTH_HALF).for_each(|j| add(mean, &across[j * width..(j + 1) * width]));
            mean.iter_mut().for_each(|m| *m /= (side * side) as f32);
        }
        Self { width, height, means }
    }

    /// Mean square of the weaker gradient of the patch at (x, y), of what of it has smooth surroundings; 0 outside the
    /// picture.
    pub fn weaker_gradient(&self, luma: &Luma, x: i64, y: i64) -> f64 {
        if !luma.holds(x, y) {
            return 0.0;
        }
        let (half, reach) = (HALF as usize, GRADIENT_HALF + SMOOTH_HALF);
        let inside = |at: i64, size: usize| {
            (at as usize - half).max(reach)..(at as usize + half + 1).min(size.saturating_sub(reach))
        };
        let [mut xx, mut xy, mut yy, mut count] = [0.0f32; 4];
        let per_px = 0.5 / GRADIENT_HALF as f32;
        for j in inside(y, self.height).step_by(STEP) {
            for i in inside(x, self.width).step_by(STEP) {
                let at = j * self.width + i;
                let gx = per_px * (self.means[at + GRADIENT_HALF] - self.means[at - GRADIENT_HALF]);
                let along = GRADIENT_HALF * self.width;
                let gy = per_px * (self.means[at + along] - self.means[at - along]);
                (xx, xy, yy, count) = (xx + gx * gx, xy + gx * gy, yy + gy * gy, count + 1.0);
            }
        }
        f64::from((0.5 * (xx + yy) - (0.25 * (xx - yy).powi(2) + xy * xy).sqrt()) / count.max(1.0))
    }
}
