//! The fixed-interval (Rauch–Tung–Striebel) smoother over a filtered track.
//!
//! ```text
//! G = P̂ᵢ Φᵀ P̄ᵢ₊₁⁻¹,   Xᵢ|N = X̂ᵢ + G (Xᵢ₊₁|N − X̄ᵢ₊₁),   Pᵢ|N = P̂ᵢ + G (Pᵢ₊₁|N − P̄ᵢ₊₁) Gᵀ
//! ```
//! Rauch, Tung and Striebel, AIAA Journal 3 (1965) 1445, Eq. 3.28–3.30.

use super::kalman::{Belief, Motion};
use super::{Filtered, Measured};

/// Smoothed positions with covariances, `None` before the mark was first seen.
pub fn smooth(filtered: &[Option<Filtered>], t_s: &[f64], motion: &Motion) -> Vec<Option<Measured>> {
    let mut smoothed: Vec<Option<Measured>> = vec![None; filtered.len()];
    let mut later: Option<Belief> = None;
    for i in (0..filtered.len()).rev() {
        let Some(here) = filtered[i].map(|f| f.unpack()) else {
            later = None;
            continue;
        };
        let belief = match later {
            None => here,
            Some(later) => step_back(&here, &later, motion, t_s[i + 1] - t_s[i]),
        };
        let p = belief.position_covariance_px2();
        smoothed[i] = Some(Measured {
            position_px: [belief.state[0], belief.state[1]],
            covariance_px2: [p[(0, 0)], p[(1, 1)], p[(0, 1)]],
            area_px2: 0.0,
        });
        later = Some(belief);
    }
    smoothed
}

fn step_back(here: &Belief, later: &Belief, motion: &Motion, dt_s: f64) -> Belief {
    let predicted = here.predict(motion, dt_s);
    let Some(inverse) = predicted.covariance.try_inverse() else { return *here };
    let gain = here.covariance * Motion::transition(dt_s).transpose() * inverse;
    Belief {
        state: here.state + gain * (later.state - predicted.state),
        covariance: here.covariance + gain * (later.covariance - predicted.covariance) * gain.transpose(),
    }
}
