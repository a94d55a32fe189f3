//! A camera that looks at the plane of the swing askew.

/// What becomes of the plane of the swing in the picture. From far away a plane is mapped by four numbers. Of these the scale does not matter to angles and the
/// turn is `camera_tilt`; a stretch s and a shear b are left, which leave a plumb line where it is:
///
/// ```text
/// (x, y) ↦ ((1 + s) x, y + b x)                     x sideways, y downwards
/// tan φ = (1 + s) sin θ / (cos θ + b sin θ)         φ: angle seen, θ: true angle
/// φ ≈ (1 + s) θ − b θ² + …
/// ```
///
/// A camera level with the horizon that is turned aside by α and looks down by β has 1 + s = cos α/cos β and b = sin α tan β. Pixels that are not square are a
/// stretch alone. Assumed: the specimen is small beside its distance from the camera, and swings in one plane.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct View {
    /// s (1).
    pub stretch: f64,
    /// b (1).
    pub shear: f64,
}

/// The derivatives of an angle seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewSlopes {
    /// ∂φ/∂θ.
    pub angle: f64,
    /// ∂φ/∂s (rad).
    pub stretch: f64,
    /// ∂φ/∂b (rad).
    pub shear: f64,
}

impl View {
    /// φ of θ. What the picture turns a direction by is less than half a turn, since 1 + s > 0: so φ follows θ through any number of turns,
    ///
    /// ```text
    /// φ = θ + atan2(s sin θ cos θ − b sin² θ, 1 + s sin² θ + b sin θ cos θ)
    /// ```
    pub fn angle_rad(&self, theta_rad: f64) -> f64 {
        let (sin, cos) = theta_rad.sin_cos();
        let across = sin * (self.stretch * cos - self.shear * sin);
        let along = 1.0 + sin * (self.stretch * sin + self.shear * cos);
        theta_rad + across.atan2(along)
    }

    /// How long a piece of the plane in some direction is in the picture, over a vertical one.
    pub fn length(&self, theta_rad: f64) -> f64 {
        let [across, down] = self.picture(theta_rad);
        across.hypot(down)
    }

    /// With r the length in the picture:
    ///
    /// ```text
    /// ∂φ/∂θ = (1 + s)/r²      ∂φ/∂s = sin θ (cos θ + b sin θ)/r²      ∂φ/∂b = −(1 + s) sin² θ/r²
    /// ```
    pub fn slopes(&self, theta_rad: f64) -> ViewSlopes {
        let [across, down] = self.picture(theta_rad);
        let square = across * across + down * down;
        let sin = theta_rad.sin();
        ViewSlopes { angle: (1.0 + self.stretch) / square, stretch: sin * down / square, shear: -across * sin / square }
    }

    /// The direction θ in the picture, sideways and downwards.
    fn picture(&self, theta_rad: f64) -> [f64; 2] {
        let (sin, cos) = theta_rad.sin_cos();
        [(1.0 + self.stretch) * sin, cos + self.shear * sin]
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;

    const VIEW: View = View { stretch: -0.06, shear: 0.13 };

    #[test]
    fn the_angle_seen_is_that_of_the_mapped_direction_and_follows_through_whole_turns() {
        let mut before = VIEW.angle_rad(-7.0);
        for k in 0..=1400 {
            let theta = -7.0 + 0.01 * f64::from(k);
            let seen = VIEW.angle_rad(theta);
            let tangent = (1.0 + VIEW.stretch) * theta.sin() / (theta.cos() + VIEW.shear * theta.sin());
            assert!((seen.tan() - tangent).abs() < 1e-9 * (1.0 + tangent * tangent), "{theta}");
            assert!((seen - before).abs() < 0.02 && (seen - theta).abs() < FRAC_PI_2, "{theta}: {before} {seen}");
            before = seen;
        }
        // plumb lines stay, up and down
        for turns in -2..=2 {
            let theta = PI * f64::from(turns);
            assert!((VIEW.angle_rad(theta) - theta).abs() < 1e-12);
        }
        assert_eq!(View::default().angle_rad(1.3), 1.3);
    }

    #[test]
    fn slopes_are_those_of_differences() {
        let step = 1e-6;
        for theta in [-2.9, -1.6, -0.4, 0.0, 0.3, 1.2, FRAC_PI_2, 2.0, 4.0] {
            let own = VIEW.slopes(theta);
            let by = |plus: f64, minus: f64| (plus - minus) / (2.0 * step);
            let with = |s: f64, b: f64| View { stretch: VIEW.stretch + s, shear: VIEW.shear + b }.angle_rad(theta);
            assert!((own.angle - by(VIEW.angle_rad(theta + step), VIEW.angle_rad(theta - step))).abs() < 1e-8);
            assert!((own.stretch - by(with(step, 0.0), with(-step, 0.0))).abs() < 1e-8);
            assert!((own.shear - by(with(0.0, step), with(0.0, -step))).abs() < 1e-8);
        }
    }

    #[test]
    fn a_camera_aside_and_above_has_the_stretch_and_shear_of_its_projection() {
        let (aside, down): (f64, f64) = (0.25, 0.17);
        // the line of sight and the picture's two axes, of a level camera, in the coordinates x sideways, y downwards, z towards it
        let right = [aside.cos(), 0.0, -aside.sin()];
        let below = [aside.sin() * down.sin(), down.cos(), aside.cos() * down.sin()];
        let view = View { stretch: aside.cos() / down.cos() - 1.0, shear: aside.sin() * down.tan() };
        for theta in [-1.1f64, -0.3, 0.4, 1.7] {
            let link = [theta.sin(), theta.cos(), 0.0];
            let along = |axis: [f64; 3]| axis.iter().zip(link).map(|(a, b)| a * b).sum::<f64>();
            let seen = along(right).atan2(along(below));
            assert!((view.angle_rad(theta) - seen).abs() < 1e-12, "{theta}");
        }
    }
}
