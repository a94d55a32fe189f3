//! One instant of the motion, with what every law needs of it.

/// Position, rates and accelerations of all links at one instant.
///
/// The rates are ω = θ̇ of the n links, followed by what a law keeps in mind between instants (the Bouc–Wen variable of each joint, where a stand is that yields);
/// the accelerations are their derivatives. The pivot may move sideways.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Time.
    pub t_s: f64,
    /// θ, top to bottom.
    pub theta_rad: Vec<f64>,
    /// θ̇ (rad/s), then the laws' own variables.
    pub rate: Vec<f64>,
    /// θ̈ (rad/s²), then the derivatives of the laws' own variables (1/s).
    pub acceleration: Vec<f64>,
    /// sin θ.
    pub sin: Vec<f64>,
    /// cos θ.
    pub cos: Vec<f64>,
    /// Sideways velocity of the pivot.
    pub pivot_m_s: f64,
    /// Sideways acceleration of the pivot.
    pub pivot_m_s2: f64,
    /// What weighs on all masses.
    pub gravity_m_s2: f64,
    /// What a dry hinge does.
    pub hinge: Hinge,
    /// On which side of its corners a law is (±1 for each of [`ForwardModel::corners`](super::ForwardModel::corners)), while a step is sought that
    /// ends at the next corner; empty where the laws go by the instant itself.
    pub sides: Vec<f64>,
}

/// The state of dry friction at the hinge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hinge {
    /// θ₁ grows, or is about to.
    SlidesForward,
    /// θ₁ falls, or is about to.
    SlidesBack,
    /// Friction holds the first link.
    Sticks,
}

impl Hinge {
    /// sgn θ̇₁.
    pub fn sign(self) -> f64 {
        match self {
            Self::SlidesForward => 1.0,
            Self::SlidesBack => -1.0,
            Self::Sticks => 0.0,
        }
    }

    /// Sliding in the direction of `rate`; forward where it is zero.
    pub fn sliding(rate: f64) -> Self {
        if rate < 0.0 { Self::SlidesBack } else { Self::SlidesForward }
    }
}

impl Motion {
    /// An instant of `links` links and `hidden` variables of laws, everything zero.
    pub fn zero(links: usize, hidden: usize) -> Self {
        Self {
            t_s: 0.0,
            theta_rad: vec![0.0; links],
            rate: vec![0.0; links + hidden],
            acceleration: vec![0.0; links + hidden],
            sin: vec![0.0; links],
            cos: vec![1.0; links],
            pivot_m_s: 0.0,
            pivot_m_s2: 0.0,
            gravity_m_s2: 0.0,
            hinge: Hinge::SlidesForward,
            sides: Vec::new(),
        }
    }

    /// Number of links.
    pub fn links(&self) -> usize {
        self.theta_rad.len()
    }

    /// Sets θ, with its sines and cosines.
    pub fn place(&mut self, theta_rad: &[f64]) {
        for (i, angle) in theta_rad.iter().enumerate() {
            self.theta_rad[i] = *angle;
            (self.sin[i], self.cos[i]) = angle.sin_cos();
        }
    }

    /// cos(θᵢ−θⱼ).
    pub fn cos_difference(&self, i: usize, j: usize) -> f64 {
        self.cos[i] * self.cos[j] + self.sin[i] * self.sin[j]
    }

    /// sin(θᵢ−θⱼ).
    pub fn sin_difference(&self, i: usize, j: usize) -> f64 {
        self.sin[i] * self.cos[j] - self.cos[i] * self.sin[j]
    }
}
