//! How the camera moves against what stands still: the background itself, or fixed reference marks.
//!
//! Small patches of one picture are found again in every other (Lucas and Kanade, IJCAI 1981; in the inverse form of
//! Baker and Matthews, IJCV 56 (2004) 221), a difference in brightness aside. The shifts of all patches give one
//! shift and one turn of the camera; patches that disagree lie on what swings, and are left out:
//!
//! ```text
//! Δx = t_x − φ (y − y_c),   Δy = t_y + φ (x − x_c)
//! Σ (Δ_k − s_k)ᵀ W_k (Δ_k − s_k) → least,     W_k = (h H_k⁻¹ + 1)⁻¹,   H_k = Σ ∇ ∇ᵀ over patch k,   h: median of ½ tr H_k
//! ```
//!
//! H_k is how well a patch shows a shift in each direction: a faint one, of which a codec keeps less than a strong one, hardly counts, nor does an edge along its own
//! length. Interpolation and parallax give each patch an error of its own, too, here as large as that of the middle one's noise.

mod smooth;

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};

use crate::statistics::median;
use crate::video::Picture;
use smooth::Smooth;

/// Half the side of a patch.
const HALF: i64 = crate::area::PATCH_HALF_PX as i64;
/// Farthest that a patch is sought, px.
const REACH_PX: i64 = 21;
/// Columns and rows of cells, each with one patch.
const CELLS: [usize; 2] = [8, 6];
/// Mean square of the weaker gradient of the smoothed picture, codes²/px², below which a patch is too plain to be found
/// again: with noise of one code in its 961 pixels, of which four share an error, the patch is found to 0.2 px
/// (σ² / (n g²)), and six of them to 0.08 px. Noise alone has a fiftieth of it.
const LEAST_GRADIENT: f64 = 0.1;
/// Fewest patches of the background that must agree, and as a share of those that are found again.
const FEWEST_AGREEING: usize = 6;
const AGREEING_SHARE: f64 = 0.5;
/// Share of the picture's width that they span, at least: what swings is a smaller thing.
const LEAST_SPAN: f64 = 0.4;
/// Share of a patch's own variance that its difference from the picture has at most, where it is found again.
const MOST_DIFFERENCE: f64 = 0.5;
/// First shifts within which two patches say the same, px.
const SAME_PX: f64 = 3.5;
/// Residual within which a patch agrees, px, at least.
const AGREEMENT_PX: f64 = 0.25;
/// Fewer patches do not tell a turn from a shift.
const FEWEST_TURNING: usize = 4;

/// Where the camera looks in one picture, against the reference picture.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CameraShift {
    /// What lay at p lies at p + shift, at the centre of the picture.
    pub shift_px: [f64; 2],
    /// Turn about the centre.
    pub turn_rad: f64,
    /// Centre of the picture.
    pub centre_px: [f64; 2],
    /// Covariance of shift (px) and turn (rad), from how far the patches disagree.
    covariance: Matrix3<f64>,
    /// Patches that agree.
    pub patches: usize,
}

impl CameraShift {
    fn at(&self, p: [f64; 2]) -> [f64; 2] {
        let [x, y] = [p[0] - self.centre_px[0], p[1] - self.centre_px[1]];
        [self.shift_px[0] - self.turn_rad * y, self.shift_px[1] + self.turn_rad * x]
    }

    /// Where a point of the reference picture lies in this one.
    pub fn apply(&self, p: [f64; 2]) -> [f64; 2] {
        let shift = self.at(p);
        [p[0] + shift[0], p[1] + shift[1]]
    }

    /// Where a point of this picture lies in the reference picture.
    pub fn undo(&self, p: [f64; 2]) -> [f64; 2] {
        let shift = self.at(p);
        [p[0] - shift[0], p[1] - shift[1]]
    }

    /// Length of the shift.
    pub fn size_px(&self) -> f64 {
        self.shift_px[0].hypot(self.shift_px[1])
    }

    /// Standard deviation of the shift of the picture's centre, the mean of both directions.
    pub fn sd_px(&self) -> f64 {
        (0.5 * (self.covariance[(0, 0)] + self.covariance[(1, 1)])).sqrt()
    }

    /// Variances along x and y, and covariance, of the shift of a point (px²).
    pub fn variance_px2(&self, p: [f64; 2]) -> [f64; 3] {
        let [x, y] = [p[0] - self.centre_px[0], p[1] - self.centre_px[1]];
        let (along_x, along_y) = (Vector3::new(1.0, 0.0, -y), Vector3::new(0.0, 1.0, x));
        let of = |a: &Vector3<f64>, b: &Vector3<f64>| (a.transpose() * self.covariance * b)[0];
        [of(&along_x, &along_x), of(&along_y, &along_y), of(&along_x, &along_y)]
    }
}

/// A piece of the reference picture.
#[derive(Debug, Clone)]
struct Patch {
    x: i64,
    y: i64,
    /// Luma less its mean, and its gradients, row by row.
    values: Vec<f32>,
    gradients: Vec<[f32; 2]>,
    /// Σ ∇ ∇ᵀ, which says how well it shows a shift.
    information: Matrix2<f64>,
    /// Its inverse.
    inverse: Matrix2<f64>,
    /// Mean square of the weaker gradient.
    strength: f64,
    /// Σ of the squares of the values.
    squares: f64,
}

/// What stands still.
#[derive(Debug, Clone)]
pub struct Background {
    patches: Vec<Patch>,
    centre_px: [f64; 2],
    /// The user named the patches: they are believed.
    named: bool,
}

impl Background {
    /// Of a picture: patches spread over it, or around the points that are given (stored pixels).
    pub fn of(picture: &Picture<'_>, points_px: &[[f64; 2]]) -> Self {
        let luma = Luma::of(picture);
        let centre_px = [0.5 * luma.width as f64, 0.5 * luma.height as f64];
        let patches = if points_px.is_empty() {
            corners(&luma)
        } else {
            let smooth = Smooth::of(&luma);
            let places = points_px.iter().map(|p| (p[0].round() as i64, p[1].round() as i64));
            let clear = places.filter(|(x, y)| smooth.weaker_gradient(&luma, *x, *y) > LEAST_GRADIENT);
            clear.filter_map(|(x, y)| Patch::at(&luma, x, y)).collect()
        };
        Self { patches, centre_px, named: !points_px.is_empty() }
    }

    /// Where the camera looks in a picture; `None` where too little of the background is found again.
    pub fn locate(&self, picture: &Picture<'_>) -> Option<CameraShift> {
        let luma = Luma::of(picture);
        let start = self.scout(&luma)?;
        let found: Vec<Found<'_>> = self
            .patches
            .iter()
            .filter_map(|patch| Some(Found { patch, shift_px: Vector2::from(patch.find(&luma, start)?) }))
            .collect();
        self.agree(&found, start)
    }

    /// A first shift in whole pixels: the one that most patches say. What swings may hold the clearest patches.
    fn scout(&self, luma: &Luma<'_>) -> Option<[f64; 2]> {
        let shifts: Vec<[f64; 2]> = self.patches.iter().filter_map(|p| p.search(luma)).collect();
        let near = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) < SAME_PX;
        let agreeing = |a: &[f64; 2]| shifts.iter().filter(|b| near(a, b)).count();
        let best = shifts.iter().max_by_key(|a| agreeing(a))?;
        let mean = |axis: usize| {
            let said = shifts.iter().filter(|b| near(best, b));
            said.map(|b| b[axis]).sum::<f64>() / agreeing(best) as f64
        };
        Some([mean(0), mean(1)])
    }

    /// Keeps the patches that agreed in at least half of some pictures.
    pub fn keep_steady(&mut self, pictures: &[Vec<bool>]) {
        if self.named || pictures.is_empty() {
            return;
        }
        let mut index = 0;
        self.patches.retain(|_| {
            let agreed = pictures.iter().filter(|p| p.get(index).copied().unwrap_or(false)).count();
            index += 1;
            2 * agreed >= pictures.len()
        });
    }

    /// Which patches agree with a shift of the camera in a picture.
    pub fn agreeing(&self, picture: &Picture<'_>, camera: &CameraShift) -> Vec<bool> {
        let luma = Luma::of(picture);
        let agrees = |p: &Patch| {
            let at = camera.at([p.x as f64, p.y as f64]);
            p.find(&luma, at).is_some_and(|s| (s[0] - at[0]).hypot(s[1] - at[1]) < 2.0 * AGREEMENT_PX)
        };
        self.patches.iter().map(agrees).collect()
    }

    /// Shift and turn on which most patches agree, by least squares over those that do, from a first shift.
    fn agree(&self, found: &[Found<'_>], start: [f64; 2]) -> Option<CameraShift> {
        let mut camera = CameraShift { shift_px: start, centre_px: self.centre_px, ..Default::default() };
        let share = (AGREEING_SHARE * found.len() as f64) as usize;
        let fewest = if self.named { 1 } else { FEWEST_AGREEING.max(share) };
        for round in 0..6 {
            let usual = median(&mut found.iter().map(|f| f.off(&camera).norm()).collect::<Vec<_>>()).unwrap_or(0.0);
            // a turn, and parts of a pixel, are not known yet in the first round
            let limit = if round == 0 { 3.0 } else { (3.0 * usual).clamp(AGREEMENT_PX, 1.0) };
            let kept: Vec<&Found<'_>> = found.iter().filter(|f| f.off(&camera).norm() <= limit).collect();
            if kept.len() < fewest || !(self.named || self.is_wide(&kept)) {
                return None;
            }
            // at first every patch has one vote: the clearest may lie on what swings
            let weights = if round == 0 { vec![Matrix2::identity(); kept.len()] } else { weights(&kept) };
            camera = self.least_squares(&kept.into_iter().zip(weights).collect::<Vec<_>>())?;
        }
        Some(camera)
    }

    /// The patches lie all over the picture.
    fn is_wide(&self, kept: &[&Found<'_>]) -> bool {
        let x = || kept.iter().map(|f| f.patch.x as f64);
        let span = x().fold(f64::MIN, f64::max) - x().fold(f64::MAX, f64::min);
        span > LEAST_SPAN * 2.0 * self.centre_px[0]
    }

    /// There are patches enough to say where the camera looks.
    pub fn is_usable(&self) -> bool {
        self.named && !self.patches.is_empty() || self.patches.len() >= FEWEST_AGREEING
    }

    /// Shift and turn of the camera from some patches, each with its weight.
    fn least_squares(&self, kept: &[(&Found<'_>, Matrix2<f64>)]) -> Option<CameraShift> {
        let mut normal = Matrix3::<f64>::zeros();
        let mut right = Vector3::<f64>::zeros();
        for (Found { patch, shift_px }, weight) in kept {
            let (x, y) = (patch.x as f64 - self.centre_px[0], patch.y as f64 - self.centre_px[1]);
            let slopes = Matrix2x3::new(1.0, 0.0, -y, 0.0, 1.0, x);
            normal += slopes.transpose() * weight * slopes;
            right += slopes.transpose() * weight * shift_px;
        }
        // so few cannot tell a turn from a shift
        let turns = kept.len() >= FEWEST_TURNING;
        let inverse = if turns {
            normal.try_inverse()?
        } else {
            let shifts = normal.fixed_view::<2, 2>(0, 0).into_owned().try_inverse()?;
            shifts.fixed_resize::<3, 3>(0.0)
        };
        let [x, y, turn_rad] = (inverse * right).into();
        let camera = CameraShift {
            shift_px: [x, y],
            turn_rad,
            centre_px: self.centre_px,
            patches: kept.len(),
            covariance: Matrix3::zeros(),
        };
        let square = |(found, weight): &(&Found<'_>, Matrix2<f64>)| {
            let off = found.off(&camera);
            (off.transpose() * weight * off)[0]
        };
        let freedom = 2.0 * kept.len() as f64 - if turns { 3.0 } else { 2.0 };
        let variance = kept.iter().map(square).sum::<f64>() / freedom.max(1.0);
        Some(CameraShift { covariance: inverse * variance, ..camera })
    }
}

/// A patch, and by how much it has shifted.
struct Found<'b> {
    patch: &'b Patch,
    shift_px: Vector2<f64>,
}

impl Found<'_> {
    /// How far it is from where a camera's shift puts it.
    fn off(&self, camera: &CameraShift) -> Vector2<f64> {
        self.shift_px - Vector2::from(camera.at([self.patch.x as f64, self.patch.y as f64]))
    }
}

/// W_k of some patches.
fn weights(kept: &[&Found<'_>]) -> Vec<Matrix2<f64>> {
    let usual = median(&mut kept.iter().map(|f| 0.5 * f.patch.information.trace()).collect::<Vec<_>>()).unwrap_or(1.0);
    let weight = |found: &&Found<'_>| (usual * found.patch.inverse + Matrix2::identity()).try_inverse();
    kept.iter().map(|found| weight(found).unwrap_or_default()).collect()
}

/// The best patch of every cell, the clearest first.
fn corners(luma: &Luma<'_>) -> Vec<Patch> {
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

impl Patch {
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
    fn search(&self, luma: &Luma<'_>) -> Option<[f64; 2]> {
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
    fn find(&self, luma: &Luma<'_>, start: [f64; 2]) -> Option<[f64; 2]> {
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

/// The luma of a picture as 8-bit codes.
struct Luma<'a> {
    picture: &'a Picture<'a>,
    width: usize,
    height: usize,
    scale: f32,
}

impl<'a> Luma<'a> {
    fn of(picture: &'a Picture<'a>) -> Self {
        let layout = picture.layout;
        let scale = 1.0 / f32::from(1u16 << (layout.bits - 8)) / f32::from(1u16 << layout.low_bits);
        Self { picture, width: layout.width_px, height: layout.height_px, scale }
    }

    #[inline]
    fn code(&self, x: i64, y: i64) -> f32 {
        f32::from(self.picture.luma.code(self.picture.wide(), x as usize, y as usize)) * self.scale
    }

    /// A patch about this pixel lies inside.
    fn holds(&self, x: i64, y: i64) -> bool {
        x > HALF && y > HALF && x + HALF + 2 < self.width as i64 && y + HALF + 2 < self.height as i64
    }

    /// The patch about a point between pixels.
    fn read(&self, x: f64, y: f64, values: &mut Vec<f32>) -> Option<()> {
        let (i, j) = (x.floor() as i64, y.floor() as i64);
        if !self.holds(i, j) {
            return None;
        }
        let (s, t) = ((x - i as f64) as f32, (y - j as f64) as f32);
        values.clear();
        for b in j - HALF..=j + HALF {
            for a in i - HALF..=i + HALF {
                let upper = self.code(a, b) + s * (self.code(a + 1, b) - self.code(a, b));
                let lower = self.code(a, b + 1) + s * (self.code(a + 1, b + 1) - self.code(a, b + 1));
                values.push(upper + t * (lower - upper));
            }
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::video::{Layout, Matrix, OwnedPicture};

    fn textured(shift: [f64; 2]) -> OwnedPicture {
        let layout = Layout {
            width_px: 320,
            height_px: 240,
            bits: 8,
            low_bits: 0,
            chroma_shift_x: 1,
            chroma_shift_y: 1,
            chroma_site_px: [0.5, 0.5],
            full_range: true,
            matrix: Matrix::Bt601,
        };
        let mut picture = OwnedPicture::black(layout);
        for y in 0..240 {
            for x in 0..320 {
                let (u, v) = (x as f64 - shift[0], y as f64 - shift[1]);
                let mut value = shade(u, v);
                // what swings, and must not count
                if (140..200).contains(&x) {
                    value = 120.0 + 60.0 * (0.3 * (u - 3.0 * shift[0])).sin();
                }
                picture.set(0, y * 320 + x, value.round() as u16);
            }
        }
        picture
    }

    /// Luma of a textured wall.
    fn shade(u: f64, v: f64) -> f64 {
        let value = 120.0 + 30.0 * (0.21 * u + 0.05 * v).sin() + 30.0 * (0.17 * v - 0.04 * u).cos();
        // no finer than a lens shows: 0.6 rad a pixel at the far corner
        value + 20.0 * (0.002 * u * v).sin()
    }

    /// The wall alone.
    fn plain() -> OwnedPicture {
        let mut picture = OwnedPicture::black(textured([0.0; 2]).layout);
        for at in 0..320 * 240 {
            picture.set(0, at, shade((at % 320) as f64, (at / 320) as f64).round() as u16);
        }
        picture
    }

    #[test]
    fn a_shift_of_the_camera_is_found_to_hundredths_beside_what_swings() {
        let (reference, shaken) = (textured([0.0, 0.0]), textured([6.3, -4.6]));
        let background = Background::of(&reference.view(), &[]);
        let camera = background.locate(&shaken.view()).unwrap();
        assert!((camera.shift_px[0] - 6.3).abs() < 0.05 && (camera.shift_px[1] + 4.6).abs() < 0.05, "{camera:?}");
        let still = background.locate(&reference.view()).unwrap();
        assert!(still.size_px() < 0.01, "{still:?}");
    }

    #[test]
    fn what_a_codec_keeps_of_a_faint_texture_does_not_hold_the_camera() {
        // the lower half is faint, and stays where it was
        let faint = |shift: [f64; 2]| {
            let (mut picture, still) = (textured(shift), textured([0.0, 0.0]));
            for at in 130 * 320..240 * 320 {
                let code = f64::from(still.view().luma.code(false, at % 320, at / 320));
                picture.set(0, at, (120.0 + 0.1 * (code - 120.0)).round() as u16);
            }
            picture
        };
        let background = Background::of(&faint([0.0, 0.0]).view(), &[]);
        let camera = background.locate(&faint([0.6, -0.5]).view()).unwrap();
        for (point, most_px) in [([40.0, 60.0], 0.15), ([280.0, 60.0], 0.15), ([160.0, 200.0], 0.25)] {
            let [x, y] = camera.undo(point);
            let off_px = (x - point[0] + 0.6).hypot(y - point[1] - 0.5);
            assert!(off_px < most_px, "{point:?} is off by {off_px:.3} px");
        }
    }

    #[test]
    fn a_camera_that_turns_about_its_axis_is_found_to_do_so() {
        let (layout, turn_rad) = (textured([0.0; 2]).layout, 3e-3);
        let mut turned = OwnedPicture::black(layout);
        for y in 0..240 {
            for x in 0..320 {
                let (u, v) = (f64::from(x) - 160.0, f64::from(y) - 120.0);
                let at = [f64::from(x) + turn_rad * v, f64::from(y) - turn_rad * u];
                turned.set(0, (y * 320 + x) as usize, shade(at[0], at[1]).round() as u16);
            }
        }
        let background = Background::of(&plain().view(), &[]);
        let camera = background.locate(&turned.view()).unwrap();
        assert!((camera.turn_rad - turn_rad).abs() < 2e-4 && camera.size_px() < 0.03, "{camera:?}");
    }

    #[test]
    fn one_or_two_reference_marks_show_a_shift() {
        for points in [&[[60.0, 70.0]][..], &[[60.0, 70.0], [250.0, 180.0]]] {
            let background = Background::of(&textured([0.0, 0.0]).view(), points);
            let camera = background.locate(&textured([2.3, -1.6]).view()).unwrap();
            assert!((camera.shift_px[0] - 2.3).abs() < 0.1 && (camera.shift_px[1] + 1.6).abs() < 0.1, "{camera:?}");
            assert_eq!(camera.turn_rad, 0.0);
        }
    }

    #[test]
    fn a_plain_wall_is_no_reference() {
        let layout = textured([0.0; 2]).layout;
        let black = OwnedPicture::black(layout);
        assert!(Background::of(&black.view(), &[]).locate(&black.view()).is_none());
    }
}
