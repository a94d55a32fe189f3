//! What acts on a strip besides gravity and its own stiffness.

/// A force per length, [along x, down] (N/m), where the strip has an angle.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LocalForce {
    /// The force.
    pub force_n_m: [f64; 2],
    /// Its derivative in the angle.
    pub slope_n_m_rad: [f64; 2],
}

/// What acts on a strip.
pub trait Load {
    /// Force per length at s, where the strip has the angle θ.
    fn force(&self, _s_m: f64, _theta_rad: f64) -> LocalForce {
        LocalForce::default()
    }

    /// Force at the free end, [along x, down] (N).
    fn tip_force_n(&self) -> [f64; 2] {
        [0.0; 2]
    }

    /// Curvature that the strip would take without any force, beside its own at rest (1/m).
    fn curl_per_m(&self, _s_m: f64) -> f64 {
        0.0
    }

    /// EI over that of the strip as described.
    fn stiffness_ratio(&self, _s_m: f64) -> f64 {
        1.0
    }

    /// Forces turn with the strip, so that [`LocalForce::slope_n_m_rad`] is not zero.
    fn follows(&self) -> bool {
        false
    }
}

/// Nothing acts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Free;

impl Load for Free {}

/// Forces that keep their direction.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Dead {
    /// Per length, [along x, down] (N/m).
    pub per_length_n_m: [f64; 2],
    /// At the free end, [along x, down] (N).
    pub tip_n: [f64; 2],
}

impl Load for Dead {
    fn force(&self, _s_m: f64, _theta_rad: f64) -> LocalForce {
        LocalForce { force_n_m: self.per_length_n_m, slope_n_m_rad: [0.0; 2] }
    }

    fn tip_force_n(&self) -> [f64; 2] {
        self.tip_n
    }
}

/// A pressure that stays across the strip: p per length (N/m) along its normal (cos θ, −sin θ).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Follower(pub f64);

impl Load for Follower {
    fn force(&self, _s_m: f64, theta_rad: f64) -> LocalForce {
        let (sin, cos) = theta_rad.sin_cos();
        LocalForce { force_n_m: [self.0 * cos, -self.0 * sin], slope_n_m_rad: [-self.0 * sin, -self.0 * cos] }
    }

    fn follows(&self) -> bool {
        true
    }
}
