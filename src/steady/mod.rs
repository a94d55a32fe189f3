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

mod camera_shift;
mod luma;
mod patch;
mod smooth;

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};

pub use camera_shift::CameraShift;

use crate::statistics::median;
use crate::video::Picture;
use luma::Luma;
use patch::Patch;

/// Fewest patches of the background that must agree, and as a share of those that are found again.
const FEWEST_AGREEING: usize = 6;
const AGREEING_SHARE: f64 = 0.5;
/// Share of the picture's width that they span, at least: what swings is a smaller thing.
const LEAST_SPAN: f64 = 0.4;
/// Coarse shifts of least difference that are looked at closer: a wall repeats itself along both directions.
const MOST_MINIMA: usize = 8;
/// Standard errors within which two shifts explain the patches equally well: 95 % of chance.
const BY_CHANCE: f64 = 2.0;
/// Residual within which a patch agrees, px, at least.
const AGREEMENT_PX: f64 = 0.25;
/// Fewer patches do not tell a turn from a shift.
const FEWEST_TURNING: usize = 4;

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
        let patches = if points_px.is_empty() { patch::clearest(&luma) } else { patch::about(points_px, &luma) };
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

    /// A first shift, to a pixel: that of the least mean difference of all patches. What swings may hold the clearest patches, and a wall repeats itself: of shifts that
    /// explain the patches equally well it is the smallest.
    fn scout(&self, luma: &Luma) -> Option<[f64; 2]> {
        let shifts = patch::coarse_shifts();
        let coarse = self.differences(luma, &shifts);
        let is_least_around =
            |at: usize| neighbours(at, patch::COARSE_SIDE).all(|other| coarse[at].mean <= coarse[other].mean);
        let mut minima: Vec<usize> =
            (0..shifts.len()).filter(|at| coarse[*at].mean < 1.0 && is_least_around(*at)).collect();
        minima.sort_by(|a, b| coarse[*a].mean.total_cmp(&coarse[*b].mean));
        // a fine texture hardly shows a pixel or two beside its place
        let finest = |at: &usize| {
            let fine = patch::fine_shifts(shifts[*at]);
            let differences = self.differences(luma, &fine).into_iter();
            differences.zip(fine).min_by(|a, b| a.0.mean.total_cmp(&b.0.mean))
        };
        let finest: Vec<(Differences, [i64; 2])> = minima.iter().take(MOST_MINIMA).filter_map(finest).collect();
        let (best, _) = finest.iter().min_by(|a, b| a.0.mean.total_cmp(&b.0.mean))?;
        let equals = finest.iter().filter(|(own, _)| own.equals(best));
        equals.map(|(_, shift)| *shift).min_by_key(|[dx, dy]| dx * dx + dy * dy).map(|shift| shift.map(|s| s as f64))
    }

    /// Of all patches at each of some shifts.
    fn differences(&self, luma: &Luma, shifts: &[[i64; 2]]) -> Vec<Differences> {
        let by_patch: Vec<_> = self.patches.iter().map(|patch| patch.differences(luma, shifts)).collect();
        (0..shifts.len()).map(|at| Differences::of(by_patch.iter().map(|own| own[at]).collect())).collect()
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

/// How much the patches differ from a picture at one shift.
struct Differences {
    each: Vec<Option<f64>>,
    /// Infinite where most patches would lie outside the picture.
    mean: f64,
}

impl Differences {
    fn of(each: Vec<Option<f64>>) -> Self {
        let count = each.iter().flatten().count();
        let is_seen = 2 * count >= each.len().max(1);
        let mean = if is_seen { each.iter().flatten().sum::<f64>() / count as f64 } else { f64::INFINITY };
        Self { each, mean }
    }

    /// No larger than another's but by chance, patch by patch.
    fn equals(&self, best: &Self) -> bool {
        let pairs = self.each.iter().zip(&best.each).filter_map(|(own, other)| Some((*own)? - (*other)?));
        let pairs: Vec<f64> = pairs.collect();
        let n = pairs.len() as f64;
        let mean = pairs.iter().sum::<f64>() / n;
        let variance = pairs.iter().map(|own| (own - mean).powi(2)).sum::<f64>() / (n - 1.0);
        std::ptr::eq(self, best) || mean <= BY_CHANCE * (variance / n).sqrt()
    }
}

/// What lies around a place of a square grid.
fn neighbours(at: usize, side: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (at % side, at / side);
    let around = move |own: usize| own.saturating_sub(1)..=(own + 1).min(side - 1);
    around(y).flat_map(move |j| around(x).map(move |i| j * side + i)).filter(move |other| *other != at)
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
    fn a_wall_that_repeats_itself_is_found_where_its_bricks_are_their_own() {
        let bricks = |shift: [i32; 2]| {
            let mut picture = OwnedPicture::black(textured([0.0; 2]).layout);
            for at in 0..320 * 240 {
                let (u, v) = (at as i32 % 320 - shift[0] + 410, at as i32 / 320 - shift[1] + 210);
                let (column, row) = (u / 41, v / 21);
                let own = 100 + (column * 7919 + row * 104_729).rem_euclid(41);
                picture.set(0, at, if u % 41 < 3 || v % 21 < 3 { 200 } else { own as u16 });
            }
            picture
        };
        let background = Background::of(&bricks([0, 0]).view(), &[]);
        // one period less along x, or along y, is nearer
        for shift in [[25, -14], [-24, 12]] {
            let camera = background.locate(&bricks(shift).view()).unwrap();
            let off = (0..2).map(|k| (camera.shift_px[k] - f64::from(shift[k])).abs()).fold(0.0, f64::max);
            assert!(off < 0.05, "{shift:?} {camera:?}");
        }
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
