//! Patches of the reference picture, and where they are found again.

use nalgebra::{Matrix2, Vector2};

use super::luma::{HALF, Luma};
use super::smooth::Smooth;

/// Farthest that a patch is sought, px.
const REACH_PX: i64 = 21;
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
    fn at(luma: &Luma<'_>, x: i64, y: i64) -> Option<Self> {
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

    /// The shift with the least difference, to two pixels, every fourth pixel compared: near enough to go on from.
    pub fn search(&self, luma: &Luma<'_>) -> Option<[f64; 2]> {
        let mut best: Option<(f32, [i64; 2])> = None;
        let side = 2 * HALF + 1;
        let mut consider = |dx: i64, dy: i64| {
            if !luma.holds(self.x + dx, self.y + dy) {
                return;
            }
            let (mut sum, mut squares, mut count) = (0.0f32, 0.0f32, 0.0f32);
            for j in (1..side).step_by(4) {
                for i in (1..side).step_by(4) {
                    let value = luma.code(self.x + dx + i - HALF, self.y + dy + j - HALF);
                    let difference = value - self.values[(j * side + i) as usize];
                    (sum, squares, count) = (sum + difference, squares + difference * difference, count + 1.0);
                }
            }
            let variance = squares / count - (sum / count).powi(2);
            if best.is_none_or(|(least, _)| variance < least) {
                best = Some((variance, [dx, dy]));
            }
        };
        for dy in (-REACH_PX..=REACH_PX).step_by(3) {
            for dx in (-REACH_PX..=REACH_PX).step_by(3) {
                consider(dx, dy);
            }
        }
        best.map(|(_, shift)| shift.map(|s| s as f64))
    }

    /// The shift to a fraction of a pixel, from a first one.
    pub fn find(&self, luma: &Luma<'_>, start: [f64; 2]) -> Option<[f64; 2]> {
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

/// Patches around points (px), without those that are too plain.
pub(super) fn about(points_px: &[[f64; 2]], luma: &Luma<'_>) -> Vec<Patch> {
    let smooth = Smooth::of(luma);
    let places = points_px.iter().map(|p| (p[0].round() as i64, p[1].round() as i64));
    let clear = places.filter(|(x, y)| smooth.weaker_gradient(luma, *x, *y) > LEAST_GRADIENT);
    clear.filter_map(|(x, y)| Patch::at(luma, x, y)).collect()
}

/// The best patch of every cell, the clearest first.
pub(super) fn clearest(luma: &Luma<'_>) -> Vec<Patch> {
    let smooth = Smooth::of(luma);
    let mut patches = Vec::new();
    let margin = HALF + REACH_PX / 2;
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
