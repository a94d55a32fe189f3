//! The nodes and weights of the Radau IIA method with five stages: order 9, L-stable, stiffly accurate.
//!
//! Within a step of length h the accelerations are a polynomial through the stages, α(τ) = Σⱼ ℓⱼ(τ) αⱼ, τ = 0 … 1. Rates and angles are
//!
//! ```text
//! ω(τ) = ω₀ + h Σⱼ wⱼ(τ) αⱼ               wⱼ(τ) = ∫₀^τ ℓⱼ
//! θ(τ) = θ₀ + hτ ω₀ + h² Σⱼ uⱼ(τ) αⱼ      uⱼ(τ) = ∫₀^τ wⱼ
//! ```
//!
//! At the stages the method's own Σₖ wₖ(cᵢ) wⱼ(cₖ) stands for uⱼ(cᵢ): only so it is L-stable. The two agree at τ = 1, for the quadrature is
//! exact there.
//!
//! (E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., Sect. IV.5 and IV.8.)

use std::sync::LazyLock;

use nalgebra::{SMatrix, SVector};

/// Number of stages.
pub const STAGES: usize = 5;

type Square = SMatrix<f64, STAGES, STAGES>;
/// One number a stage.
pub type Weights = [f64; STAGES];

/// The method's constants.
#[derive(Debug, Clone)]
pub struct Collocation {
    /// cᵢ.
    pub nodes: Weights,
    /// wⱼ(cᵢ), by rows i.
    pub rate: [Weights; STAGES],
    /// Σₖ wₖ(cᵢ) wⱼ(cₖ), by rows i.
    pub angle: [Weights; STAGES],
    /// γ₀, the real eigenvalue of the method's matrix.
    pub gamma: f64,
    /// dᵢ of the error estimate h(γ₀ f₀ + Σ dᵢ fᵢ).
    pub error: Weights,
    /// ℓⱼ(τ) = Σₖ monomials[(k, j)] τᵏ.
    monomials: Square,
}

/// The constants, made once.
pub static RADAU: LazyLock<Collocation> = LazyLock::new(Collocation::new);

impl Collocation {
    fn new() -> Self {
        let nodes = radau_nodes();
        let vandermonde = Square::from_fn(|i, k| nodes[i].powi(k as i32));
        // distinct nodes: the matrix has an inverse
        let monomials = vandermonde.try_inverse().unwrap_or_else(Square::identity);
        let mut method = Self {
            nodes,
            rate: [[0.0; STAGES]; STAGES],
            angle: [[0.0; STAGES]; STAGES],
            gamma: 0.0,
            error: [0.0; STAGES],
            monomials,
        };
        method.rate = nodes.map(|c| method.rate_weights(c));
        let matrix = Square::from_fn(|i, j| method.rate[i][j]);
        let square = matrix * matrix;
        method.angle = std::array::from_fn(|i| std::array::from_fn(|j| square[(i, j)]));
        let real = matrix.complex_eigenvalues().iter().min_by(|a, b| a.im.abs().total_cmp(&b.im.abs())).map(|l| l.re);
        method.gamma = real.unwrap_or(0.0);
        // Σ dᵢ cᵢ^q = −γ₀ for q = 0, and 0 for q = 1 … 4
        let mut right = SVector::<f64, STAGES>::zeros();
        right[0] = -method.gamma;
        method.error = (monomials.transpose() * right).into();
        method
    }

    /// ℓⱼ(τ).
    pub fn basis(&self, tau: f64) -> Weights {
        std::array::from_fn(|j| (0..STAGES).rev().fold(0.0, |sum, k| sum * tau + self.monomials[(k, j)]))
    }

    /// wⱼ(τ).
    pub fn rate_weights(&self, tau: f64) -> Weights {
        std::array::from_fn(|j| {
            tau * (0..STAGES).rev().fold(0.0, |sum, k| sum * tau + self.monomials[(k, j)] / (k + 1) as f64)
        })
    }

    /// uⱼ(τ).
    pub fn angle_weights(&self, tau: f64) -> Weights {
        std::array::from_fn(|j| {
            let term = |k: usize| self.monomials[(k, j)] / ((k + 1) * (k + 2)) as f64;
            tau * tau * (0..STAGES).rev().fold(0.0, |sum, k| sum * tau + term(k))
        })
    }
}

/// The roots of P₄(x) − P₅(x), Legendre's polynomials, moved from −1 … 1 to 0 … 1.
fn radau_nodes() -> Weights {
    let legendre = |x: f64| {
        let (mut before, mut last, mut slope_before, mut slope) = (1.0, x, 0.0, 1.0);
        for k in 1..STAGES {
            let k = k as f64;
            let next = ((2.0 * k + 1.0) * x * last - k * before) / (k + 1.0);
            let slope_next = ((2.0 * k + 1.0) * (last + x * slope) - k * slope_before) / (k + 1.0);
            (before, last, slope_before, slope) = (last, next, slope, slope_next);
        }
        (before - last, slope_before - slope)
    };
    std::array::from_fn(|i| {
        if i + 1 == STAGES {
            return 1.0;
        }
        let mut x = -(std::f64::consts::PI * (2 * i + 1) as f64 / (2 * STAGES) as f64).cos();
        for _ in 0..50 {
            let (value, slope) = legendre(x);
            x -= value / slope;
        }
        0.5 * (1.0 + x)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nodes_are_those_of_radau() {
        let known = [0.057_104_196_114_518, 0.276_843_013_638_124, 0.583_590_432_368_917, 0.860_240_135_656_219, 1.0];
        for (node, known) in RADAU.nodes.iter().zip(known) {
            assert!((node - known).abs() < 1e-14, "{node} {known}");
        }
    }

    #[test]
    fn the_quadrature_is_exact_to_the_eighth_power() {
        let weights = RADAU.rate[STAGES - 1];
        for power in 0..=8 {
            let sum: f64 = weights.iter().zip(RADAU.nodes).map(|(w, c)| w * c.powi(power)).sum();
            assert!((sum - 1.0 / f64::from(power + 1)).abs() < 1e-13, "{power}: {sum}");
        }
    }

    #[test]
    fn the_polynomial_ends_where_the_method_does() {
        let ends = RADAU.angle_weights(1.0).into_iter().zip(RADAU.angle[STAGES - 1]);
        assert!(ends.into_iter().all(|(polynomial, method)| (polynomial - method).abs() < 1e-14));
    }

    #[test]
    fn gamma_is_an_eigenvalue_and_the_estimate_vanishes_on_low_powers() {
        let matrix = Square::from_fn(|i, j| RADAU.rate[i][j]);
        assert!((matrix - Square::identity() * RADAU.gamma).determinant().abs() < 1e-15);
        assert!((RADAU.gamma - 0.159_6).abs() < 1e-3, "{}", RADAU.gamma);
        let sum = |power: i32| RADAU.error.iter().zip(RADAU.nodes).map(|(d, c)| d * c.powi(power)).sum::<f64>();
        assert!((sum(0) + RADAU.gamma).abs() < 1e-13);
        assert!((1..5).all(|power| sum(power).abs() < 1e-13));
    }
}
