//! The centre of the arc on which a mark swings.
//!
//! ```text
//! minimise Σ (|p_i − c| − R)²   over c and R        (Gauss–Newton, from the algebraic circle)
//! cov = s² / n_e · (Jᵀ J / n)⁻¹,   s² = mean square residual + e²
//! ```
//! On a short arc the distance of the centre hangs on the arc's sagitta alone. What pulls a centroid goes with its
//! place, not with the frame, so frames beyond n_e say nothing new, and the residual alone does not show it: e is what
//! a place pulls, for a large mark also by its shading, which is not the same wherever it hangs.

use nalgebra::{Matrix3, Vector3};

/// What a mark's place pulls its centroid, px, and the number of independent places on an arc.
const PLACE_ERROR_PX: f64 = 0.05;
/// The same of shading and highlights, as a share of the mark's radius.
const SHADING_ERROR: f64 = 0.005;
const INDEPENDENT_PLACES: f64 = 10.0;
/// What a lens that nobody has calibrated moves a point in the picture's corner, as a share of its distance from the middle: one standard deviation (judgement:
/// ordinary lenses stay below 1 to 2 %; a wide-angle one has to be calibrated).
const LENS: f64 = 0.01;
/// How far a camera that was set up by eye is turned from the plane of the swing, to either side, and up or down: one standard deviation (judgement).
const FACES_RAD: f64 = 1.5 * std::f64::consts::PI / 180.0;
/// The focal length of an ordinary camera, over the diagonal of its picture (judgement: 26 mm of a telephone's 43 mm is 0.6, 50 mm is 1.2).
const FOCAL_LENGTH: f64 = 0.8;
/// Points below which there is no arc.
const FEWEST_POINTS: usize = 8;

/// A circle through a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Displayed pixels; may lie outside the picture.
    pub centre_px: [f64; 2],
    /// Standard deviation of the centre along x and y.
    pub sd_px: [f64; 2],
    /// Radius.
    pub radius_px: f64,
    /// Root mean square distance of the path from the circle.
    pub residual_px: f64,
}

impl Arc {
    /// Its centre where columns are this many times as wide.
    #[must_use]
    pub fn widened(mut self, times: f64) -> Self {
        self.centre_px[0] *= times;
        self.sd_px[0] *= times;
        self
    }

    /// Through the path of a mark of this radius; `None` where its points lie on no circle, or on one point.
    pub fn of(points: &[[f64; 2]], mark_radius_px: f64) -> Option<Self> {
        if points.len() < FEWEST_POINTS {
            return None;
        }
        let n = points.len() as f64;
        let mean = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
        let scale =
            (points.iter().map(|p| (p[0] - mean[0]).powi(2) + (p[1] - mean[1]).powi(2)).sum::<f64>() / n).sqrt();
        if !(scale > 0.2) {
            return None;
        }
        let local: Vec<[f64; 2]> =
            points.iter().map(|p| [(p[0] - mean[0]) / scale, (p[1] - mean[1]) / scale]).collect();
        let mut state = algebraic(&local)?;
        let mut normal = Matrix3::zeros();
        for _ in 0..60 {
            let mut right = Vector3::zeros();
            normal = Matrix3::zeros();
            for p in &local {
                let (dx, dy) = (p[0] - state[0], p[1] - state[1]);
                let distance = dx.hypot(dy).max(1e-12);
                let row = Vector3::new(-dx / distance, -dy / distance, -1.0);
                normal += row * row.transpose();
                right += row * (distance - state[2]);
            }
            let step = normal.cholesky()?.solve(&right);
            state -= step;
            if step.norm() < 1e-10 * state.norm() {
                break;
            }
        }
        let squares: f64 =
            local.iter().map(|p| ((p[0] - state[0]).hypot(p[1] - state[1]) - state[2]).powi(2)).sum::<f64>() / n;
        let residual_px = scale * squares.sqrt();
        let covariance = (normal / n).try_inverse()?;
        let place_px2 = PLACE_ERROR_PX.powi(2) + (SHADING_ERROR * mark_radius_px).powi(2);
        let variance = (residual_px.powi(2) + place_px2) / INDEPENDENT_PLACES;
        let sd = |k: usize| (variance * covariance[(k, k)]).sqrt();
        let arc = Self {
            centre_px: [mean[0] + scale * state[0], mean[1] + scale * state[1]],
            sd_px: [sd(0), sd(1)],
            radius_px: scale * state[2],
            residual_px,
        };
        (arc.centre_px.iter().chain(&arc.sd_px).all(|v| v.is_finite()) && arc.radius_px > 0.0).then_some(arc)
    }
}

impl Arc {
    /// With the deviations that a lens adds of which nothing is known, and a camera that was set up by eye. With p the place of a point from the middle of the picture,
    /// R its corner's, f the camera's focal length:
    ///
    /// ```text
    /// lens               p ← p (1 + k |p|²/R²)
    /// camera turned      p ← p (1 + ψ pₓ/f),  p ← p (1 + ψ p_y/f)      to first order
    /// ```
    ///
    /// `points`, `mark_radius_px` as for [`Arc::of`].
    #[must_use]
    pub fn through_a_camera(self, points: &[[f64; 2]], mark_radius_px: f64, size_px: [f64; 2]) -> Self {
        let middle = size_px.map(|size| 0.5 * size);
        let corner_px = middle[0].hypot(middle[1]);
        let turned = FACES_RAD / (FOCAL_LENGTH * 2.0 * corner_px);
        let lens = |off: [f64; 2]| LENS * (off[0].hypot(off[1]) / corner_px).powi(2);
        let aside = |off: [f64; 2]| turned * off[0];
        let tilted = |off: [f64; 2]| turned * off[1];
        let moves: [&dyn Fn([f64; 2]) -> f64; 3] = [&lens, &aside, &tilted];
        let off = |by: &dyn Fn([f64; 2]) -> f64| {
            let straight = |p: &[f64; 2]| {
                let off = [p[0] - middle[0], p[1] - middle[1]];
                [0, 1].map(|k| middle[k] + (1.0 + by(off)) * off[k])
            };
            let points: Vec<[f64; 2]> = points.iter().map(straight).collect();
            let other = Self::of(&points, mark_radius_px)?;
            // where that centre would be seen, to first order
            let beyond = straight(&other.centre_px);
            Some([0, 1].map(|k| 2.0 * other.centre_px[k] - beyond[k] - self.centre_px[k]))
        };
        let sd_px =
            moves.into_iter().filter_map(off).fold(self.sd_px, |sd, off| [sd[0].hypot(off[0]), sd[1].hypot(off[1])]);
        Self { sd_px, ..self }
    }
}

/// Standard deviations of the centre within which a point is the centre, and what a mark there may be off, px and as a
/// share of the radius.
const CENTRE_DEVIATIONS: f64 = 4.0;
const CENTRE_OFF_PX: f64 = 4.0;
const CENTRE_OFF: f64 = 0.03;

impl Arc {
    /// How far a point lies from the centre, as a share of how far it may where a mark shows the hinge.
    pub fn off_centre(&self, place_px: [f64; 2]) -> f64 {
        self.off(place_px, CENTRE_OFF * self.radius_px)
    }

    /// The same, where it may lie so much farther than its deviations and a mark's own error allow.
    fn off(&self, place_px: [f64; 2], farther_px: f64) -> f64 {
        let part = |axis: usize| {
            let limit = CENTRE_DEVIATIONS * self.sd_px[axis] + CENTRE_OFF_PX + farther_px;
            (place_px[axis] - self.centre_px[axis]).abs() / limit
        };
        part(0).max(part(1))
    }

    /// The angle about the centre that some points span (rad), of directions all round: a turn less the widest gap between them.
    pub fn span_rad(&self, points: &[[f64; 2]]) -> f64 {
        let turn = std::f64::consts::TAU;
        let angle = |p: &[f64; 2]| (p[1] - self.centre_px[1]).atan2(p[0] - self.centre_px[0]);
        let mut angles: Vec<f64> = points.iter().map(angle).collect();
        angles.sort_unstable_by(f64::total_cmp);
        let around = angles.first().zip(angles.last()).map_or(turn, |(first, last)| first + turn - last);
        turn - angles.windows(2).map(|pair| pair[1] - pair[0]).fold(around, f64::max)
    }

    /// Standard deviation of the centre across a direction, of length 1.
    pub fn sd_across_px(&self, [x, y]: [f64; 2]) -> f64 {
        (y * self.sd_px[0]).hypot(x * self.sd_px[1])
    }

    /// Whether a point lies on the line from the middle of the path to the centre, at whatever distance: a plane of swing that is turned moves the centre along it, not aside.
    pub fn is_on_line(&self, place_px: [f64; 2], middle_px: [f64; 2]) -> bool {
        let [x, y] = [0, 1].map(|k| self.centre_px[k] - middle_px[k]);
        let length_px = x.hypot(y).max(f64::MIN_POSITIVE);
        let (x, y) = (x / length_px, y / length_px);
        let [dx, dy] = [0, 1].map(|k| place_px[k] - middle_px[k]);
        let limit_px = CENTRE_DEVIATIONS * self.sd_across_px([x, y]) + CENTRE_OFF_PX + CENTRE_OFF * self.radius_px;
        (x * dy - y * dx).abs() < limit_px && x * dx + y * dy > 0.0
    }

    /// Whether a point is not the centre, whatever is wrong with the picture: what only stands near it is beyond its deviations.
    pub fn excludes(&self, place_px: [f64; 2]) -> bool {
        self.off(place_px, 0.0) > 1.0
    }

    /// A mark there may show the hinge.
    pub fn is_near(&self, place_px: [f64; 2]) -> bool {
        self.off_centre(place_px) < 1.0
    }
}

/// The circle x² + y² + a x + b y + c = 0 by linear least squares.
fn algebraic(points: &[[f64; 2]]) -> Option<Vector3<f64>> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for [x, y] in points {
        let row = Vector3::new(*x, *y, 1.0);
        normal += row * row.transpose();
        right -= row * (x * x + y * y);
    }
    let [a, b, c] = <[f64; 3]>::from(normal.cholesky()?.solve(&right));
    let square = 0.25 * (a * a + b * b) - c;
    (square > 0.0).then(|| Vector3::new(-0.5 * a, -0.5 * b, square.sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_plane_moves_the_centre_along_the_line_of_the_swing_and_not_aside() {
        let swing = |turned: f64| -> Vec<[f64; 2]> {
            let angle = |k: usize| 0.35 * (0.2 * k as f64).sin();
            (0..200).map(|k| [640.0 + turned * 420.0 * angle(k).sin(), 80.0 + 420.0 * angle(k).cos()]).collect()
        };
        let straight = Arc::of(&swing(1.0), 18.0).unwrap();
        assert!(!straight.excludes([640.0, 83.0]) && straight.excludes([640.0, 55.0]), "{straight:?}");
        let arc = Arc::of(&swing(0.8), 18.0).unwrap();
        let middle_px = [640.0, 490.0];
        assert!(!arc.is_near([640.0, 80.0]) && arc.is_on_line([640.0, 80.0], middle_px), "{arc:?}");
        assert!(!arc.is_on_line([605.0, 122.0], middle_px) && !arc.is_on_line([640.0, 900.0], middle_px));
    }

    fn swing(amplitude_rad: f64, noise_px: f64) -> Vec<[f64; 2]> {
        (0..400)
            .map(|i| {
                let theta = amplitude_rad * (0.13 * f64::from(i)).sin();
                let jitter = noise_px * (12.9898 * f64::from(i)).sin();
                [300.0 + (250.0 + jitter) * theta.sin(), -80.0 + (250.0 + jitter) * theta.cos()]
            })
            .collect()
    }

    #[test]
    fn the_centre_of_an_arc_outside_the_picture_is_found_within_its_deviation() {
        for amplitude_rad in [0.08, 0.2, 0.5] {
            let arc = Arc::of(&swing(amplitude_rad, 0.05), 8.0).unwrap();
            let off = [arc.centre_px[0] - 300.0, arc.centre_px[1] + 80.0];
            assert!(off[0].abs() < 3.0 * arc.sd_px[0] && off[1].abs() < 3.0 * arc.sd_px[1], "{arc:?}");
        }
        let sd_px = |amplitude_rad, radius_px| Arc::of(&swing(amplitude_rad, 0.05), radius_px).unwrap().sd_px[1];
        assert!(sd_px(0.5, 8.0) < sd_px(0.1, 8.0) && sd_px(0.5, 8.0) < sd_px(0.5, 40.0));
    }

    #[test]
    fn a_lens_that_nobody_knows_adds_to_the_deviation_of_the_centre() {
        let size_px = [640.0, 480.0];
        for barrel in [-0.02, 0.02] {
            let swing = (0..400).map(|i| 0.5 * (0.13 * f64::from(i)).sin());
            let seen = |x: f64, y: f64| {
                let off = [x - 320.0, y - 240.0];
                let moved = 1.0 - barrel * (off[0].powi(2) + off[1].powi(2)) / 400.0f64.powi(2);
                [320.0 + moved * off[0], 240.0 + moved * off[1]]
            };
            let path: Vec<[f64; 2]> = swing.map(|a| seen(318.0 + 400.0 * a.sin(), 10.0 + 400.0 * a.cos())).collect();
            let (arc, pivot) = (Arc::of(&path, 15.0).unwrap(), seen(318.0, 10.0));
            let off_px = (arc.centre_px[1] - pivot[1]).abs();
            let sd_px = arc.through_a_camera(&path, 15.0, size_px).sd_px[1];
            assert!(off_px > 3.0 * arc.sd_px[1], "{off_px}, {arc:?}");
            assert!(off_px < 3.0 * sd_px && sd_px < off_px, "{off_px}, {sd_px}");
        }
    }

    #[test]
    fn a_camera_turned_by_two_degrees_leaves_the_pivot_within_its_deviation() {
        let (size_px, focal_px, turned) = ([640.0, 480.0], 700.0, 2.0f64.to_radians());
        let seen = |x: f64, y: f64| {
            let depth = 1.0 + x * turned.sin() / focal_px;
            [320.0 + x * turned.cos() / depth, 240.0 + y / depth]
        };
        let angles = (0..400).map(|i| 0.3 * (0.13 * f64::from(i)).sin());
        let path: Vec<[f64; 2]> = angles.map(|a| seen(-40.0 + 400.0 * a.sin(), -230.0 + 400.0 * a.cos())).collect();
        let (arc, pivot) = (Arc::of(&path, 8.0).unwrap(), seen(-40.0, -230.0));
        let off_px = (arc.centre_px[0] - pivot[0]).abs();
        let sd_px = arc.through_a_camera(&path, 8.0, size_px).sd_px[0];
        assert!(off_px > 3.0 * arc.sd_px[0] && off_px < 3.0 * sd_px, "{off_px}, {sd_px}, {arc:?}");
    }

    #[test]
    fn what_stands_still_has_no_arc() {
        assert!(Arc::of(&vec![[3.0, 4.0]; 50], 8.0).is_none());
    }
}
