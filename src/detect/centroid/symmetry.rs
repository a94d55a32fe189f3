//! The centre of a black and white target, of which two opposite quadrants are dark.
//!
//! However it is turned, and however its motion smears it, such a target looks the same when it is turned by half a turn
//! about its centre c:
//!
//! ```text
//! minimise over c   Σ_u (Y(c + u) − Y(c − u))²,   u over half of a disc          (Gauss–Newton)
//! cov c = s² (Σ g gᵀ)⁻¹,   g = ∇Y(c + u) − ∇Y(c − u),   s² the mean square difference
//! ```

use nalgebra::{Matrix2, Vector2};

use super::{Centroid, EXACTLY_PX, PIXELS_SHARING, Silhouette};
use crate::video::Picture;

/// Pixels beyond the target's own outline that are compared: an edge fades over as many.
const FADE_PX: f64 = 3.0;
/// Steps after which nothing is found any more.
const MOST_STEPS: usize = 20;

/// Measures the target under `silhouette`. `None` where it reaches over the picture's edge or shows no such centre.
pub fn of_target(picture: &Picture<'_>, silhouette: &Silhouette) -> Option<Centroid> {
    let [hx, hy] = silhouette.half_sample_px;
    let area_px2 = silhouette.points_px.len() as f64 * 4.0 * hx * hy;
    // the dark quadrants are half of the disc
    let radius_px = (2.0 * area_px2 / std::f64::consts::PI).sqrt();
    let window = Window::of(picture, radius_px + FADE_PX);
    let mut centre = Vector2::from(silhouette.centre_px);
    for _ in 0..MOST_STEPS {
        let (step, covariance) = window.step(centre)?;
        centre += step;
        if (centre - Vector2::from(silhouette.centre_px)).norm() > 0.5 * radius_px {
            return None;
        }
        if step.norm() < EXACTLY_PX {
            return Some(Centroid {
                x_px: centre.x,
                y_px: centre.y,
                variance_px2: [covariance.m11, covariance.m22, covariance.m12].map(|v| PIXELS_SHARING * v),
                area_px2,
                chroma_share: 0.0,
                cut: false,
                known_behind: None,
                misfit: 0.0,
            });
        }
    }
    None
}

/// The luma around a target.
struct Window<'a> {
    picture: &'a Picture<'a>,
    /// One of every two opposite places in a disc about the centre.
    half: Vec<[f64; 2]>,
    reach_px: f64,
}

impl<'a> Window<'a> {
    fn of(picture: &'a Picture<'a>, reach_px: f64) -> Self {
        let reach = reach_px.ceil() as i32;
        let places = (0..=reach).flat_map(|y| (-reach..=reach).map(move |x| [f64::from(x), f64::from(y)]));
        let half = places.filter(|[x, y]| (*y > 0.0 || *x > 0.0) && x.hypot(*y) <= reach_px).collect();
        Self { picture, half, reach_px: reach_px + 2.0 }
    }

    /// The step towards the centre of symmetry, and the covariance of that; `None` at the picture's edge, or where all
    /// is flat.
    fn step(&self, centre: Vector2<f64>) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        let layout = &self.picture.layout;
        let fits = |at: f64, size: usize| at > self.reach_px && at + self.reach_px < size as f64 - 1.0;
        if !fits(centre.x, layout.width_px) || !fits(centre.y, layout.height_px) {
            return None;
        }
        let (mut normal, mut right, mut squares) = (Matrix2::zeros(), Vector2::zeros(), 0.0);
        for [x, y] in &self.half {
            let (ahead, slope_ahead) = self.at(centre.x + x, centre.y + y);
            let (behind, slope_behind) = self.at(centre.x - x, centre.y - y);
            let (difference, slope) = (ahead - behind, slope_ahead - slope_behind);
            normal += slope * slope.transpose();
            right += slope * difference;
            squares += difference * difference;
        }
        let inverse = normal.try_inverse()?;
        Some((-inverse * right, inverse * (squares / self.half.len() as f64)))
    }

    /// Luma between pixels, and its slope.
    fn at(&self, x: f64, y: f64) -> (f64, Vector2<f64>) {
        let (left, top) = (x.floor(), y.floor());
        let (s, t) = (x - left, y - top);
        let code = |i: i64, j: i64| self.picture.y((left as i64 + i) as usize, (top as i64 + j) as usize);
        let row = |j: i64| {
            let [a, b, c, d] = [code(-1, j), code(0, j), code(1, j), code(2, j)];
            let value = b + s * (c - b);
            let slope = 0.5 * ((c - a) + s * (d - b - c + a));
            (value, slope)
        };
        let [above, upper, lower, below] = [row(-1), row(0), row(1), row(2)];
        let value = upper.0 + t * (lower.0 - upper.0);
        let across = upper.1 + t * (lower.1 - upper.1);
        let along = 0.5 * ((lower.0 - above.0) + t * (below.0 - upper.0 - lower.0 + above.0));
        (value, Vector2::new(across, along))
    }
}
