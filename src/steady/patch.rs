//! Patches of the reference picture, and where they are found again.

use nalgebra::{Matrix2, Vector2};

use super::luma::{HALF, Luma};
use super::smooth::Smooth;

/// Farthest that a patch is sought along each axis, px: twice the way that a camera held by hand moves, for the reference picture may be taken at an end of it.
const REACH_PX: i64 = 30;
/// Pixels of a row, and rows, of which one is compared.
const EVERY: usize = 4;
/// From one coarse shift to the next, px.
const STEP_PX: i64 = 2;
/// How far a patch lies from the edge, px, at least: as far as most shifts.
const MARGIN_PX: i64 = 10;
/// Columns and rows of cells, each with one patch.
const CELLS: [usize; 2] = [8, 6];
/// Mean square of the weaker gradient of the smoothed picture, codes²/px², below which a patch is too plain to be found
/// again: with noise of one code in its 961 pixels, of which four share an error, the patch is found to 0.2 px
/// (σ² / (n g²)), and six of them to 0.08 px. Noise alone has a fiftieth of it.
const LEAST_GRADIENT: f64 = 0.1;
/// Share of a patch's own variance that its difference from the picture has at most, where it is found again.
const MOST_DIFFERENCE: f64 = 0.5;

/// A piece of the reference picture.
#[derive(Debug, Clone)]
pub(super) struct Patch {
    pub x: i64,
    pub y: i64,
    /// Luma less its mean, and its gradients, row by row.
    values: Vec<f32>,
    gradients: Vec<[f32; 2]>,
    /// Σ ∇ ∇ᵀ, which says how well it shows a shift.
    pub information: Matrix2<f64>,
    /// Its inverse.
    pub inverse: Matrix2<f64>,
    /// Mean square of the weaker gradient.
    strength: f64,
    /// Σ of the squares of the values.
    squares: f64,
}

impl Patch {
    /// About a pixel, unless it lies too near to the edge or is plain.
    fn at(luma: &Luma, x: i64, y: i64) -> Option<Self> {
        if !luma.holds(x, y) {
            return None;
        }
        let side = (2 * HALF + 1) as usize;
        let mut values = Vec::with_capacity(side * side);
        let mut gradients = Vec::with_capacity(side * side);
        let mut sums = [0.0f64; 3];
        for j in y - HALF..=y + HALF {
            for i in x - HALF..=x + HALF {
                values.push(luma.code(i, j));
                let gradient = [
                    0.5 * (luma.code(i + 1, j) - luma.code(i - 1, j)),
                    0.5 * (luma.code(i, j + 1) - luma.code(i, j - 1)),
                ];
                let [gx, gy] = gradient.map(f64::from);
                sums.iter_mut().zip([gx * gx, gx * gy, gy * gy]).for_each(|(sum, term)| *sum += term);
                gradients.push(gradient);
            }
        }
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        values.iter_mut().for_each(|v| *v -= mean);
        let [xx, xy, yy] = sums;
        let information = Matrix2::new(xx, xy, xy, yy);
        let weaker = 0.5 * (xx + yy) - (0.25 * (xx - yy).powi(2) + xy * xy).sqrt();
        Some(Self {
            x,
            y,
            inverse: information.try_inverse()?,
            information,
            strength: weaker / values.len() as f64,
            squares: values.iter().map(|v| f64::from(*v).powi(2)).sum(),
            values,
            gradients,
        })
    }

    /// The variance of the difference at each of some shifts, over the patch's own and at most 1, one pixel in [`EVERY`]² compared; `None` where the patch would lie outside
    /// the picture.
    pub fn differences(&self, luma: &Luma, shifts: &[[i64; 2]]) -> Vec<Option<f64>> {
        let side = (2 * HALF + 1) as usize;
        let own_variance = self.squares as f32 / self.values.len() as f32;
        let rows = || (1..side).step_by(EVERY);
        let own: Vec<f32> =
            rows().flat_map(|j| self.values[j * side + 1..][..side - 1].iter().step_by(EVERY)).copied().collect();
        let difference = |&[dx, dy]: &[i64; 2]| {
            let [x, y] = [self.x + dx, self.y + dy];
            if !luma.holds(x, y) {
                return None;
            }
            let (mut sum, mut squares) = (0.0f32, 0.0f32);
            for (j, own) in rows().zip(own.chunks_exact((side - 1).div_ceil(EVERY))) {
                let row = luma.row(x + 1 - HALF, y + j as i64 - HALF);
                for (value, own) in row.iter().step_by(EVERY).zip(own) {
                    let difference = value - own;
                    (sum, squares) = (sum + difference, squares + difference * difference);
                }
            }
            let count = own.len() as f32;
            let variance = squares / count - (sum / count).powi(2);
            Some(f64::from((variance / own_variance).min(1.0)))
        };
        shifts.iter().map(difference).collect()
    }

    /// The shift to a fraction of a pixel, from a first one.
    pub fn find(&self, luma: &Luma, start: [f64; 2]) -> Option<[f64; 2]> {
        let mut shift = start;
        let mut values = Vec::with_capacity(self.values.len());
        for _ in 0..20 {
            luma.read(self.x as f64 + shift[0], self.y as f64 + shift[1], &mut values)?;
            let mean = values.iter().sum::<f32>() / values.len() as f32;
            let (mut push, mut rest) = ([0.0f64; 2], 0.0);
            for ((value, own), gradient) in values.iter().zip(&self.values).zip(&self.gradients) {
                let difference = f64::from(value - mean - own);
                push[0] += f64::from(gradient[0]) * difference;
                push[1] += f64::from(gradient[1]) * difference;
                rest += difference * difference;
            }
            let step: [f64; 2] = (self.inverse * Vector2::from(push)).into();
            (0..2).for_each(|axis| shift[axis] -= step[axis].clamp(-2.0, 2.0));
            if (shift[0] - start[0]).hypot(shift[1] - start[1]) > 6.0 {
                return None;
            }
            if step[0].hypot(step[1]) < 3e-3 {
                return (rest < MOST_DIFFERENCE * self.squares).then_some(shift);
            }
        }
        None
    }
}

/// Shifts near enough to one another to go on from, row by row, [`COARSE_SIDE`] in each.
pub(super) fn coarse_shifts() -> Vec<[i64; 2]> {
    grid(REACH_PX, STEP_PX)
}

/// How many [`coarse_shifts`] lie in a row.
pub(super) const COARSE_SIDE: usize = (2 * REACH_PX / STEP_PX + 1) as usize;

/// Shifts about a coarse one, a pixel apart.
pub(super) fn fine_shifts([x, y]: [i64; 2]) -> Vec<[i64; 2]> {
    grid(STEP_PX - 1, 1).into_iter().map(|[dx, dy]| [x + dx, y + dy]).collect()
}

fn grid(reach_px: i64, step_px: i64) -> Vec<[i64; 2]> {
    let along = || (-reach_px..=reach_px).step_by(step_px as usize);
    along().flat_map(|dy| along().map(move |dx| [dx, dy])).collect()
}

/// Patches around points (px), without those that are too plain.
pub(super) fn about(points_px: &[[f64; 2]], luma: &Luma) -> Vec<Patch> {
    let smooth = Smooth::of(luma);
    let places = points_px.iter().map(|p| (p[0].round() as i64, p[1].round() as i64));
    let clear = places.filter(|(x, y)| smooth.weaker_gradient(luma, *x, *y) > LEAST_GRADIENT);
    clear.filter_map(|(x, y)| Patch::at(luma, x, y)).collect()
}

/// The best patch of every cell, the clearest first.
pub(super) fn clearest(luma: &Luma) -> Vec<Patch> {
    let smooth = Smooth::of(luma);
    let mut patches = Vec::new();
    let margin = HALF + MARGIN_PX;
    for row in 0..CELLS[1] {
        for column in 0..CELLS[0] {
            let range = |cell: usize, cells: usize, size: usize| {
                let at = |c: usize| (c * size / cells) as i64;
                (at(cell).max(margin)..at(cell + 1).min(size as i64 - margin)).step_by(9)
            };
            let places = range(row, CELLS[1], luma.height)
                .flat_map(|y| range(column, CELLS[0], luma.width).map(move |x| (x, y)));
            let clearest = places
                .map(|(x, y)| (smooth.weaker_gradient(luma, x, y), (x, y)))
                .max_by(|a, b| a.0.total_cmp(&b.0).then_with(|| [b.1.1, b.1.0].cmp(&[a.1.1, a.1.0])));
            let clear = clearest.filter(|(gradient, _)| *gradient > LEAST_GRADIENT);
            patches.extend(clear.and_then(|(_, (x, y))| Patch::at(luma, x, y)));
        }
    }
    patches.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    patches
}
