//! What is known beforehand of a single link: gravity alone may bring it back, which makes κ = 1/16, or a spring as well.
//!
//! A record gives k = κA₀² with a normal error. Under either assumption Bayes' theorem gives it another mean and variance, and to each assumption, as likely as the other beforehand,
//! a probability. The mean and variance of both together are what is known of k; what is correlated with k goes with it,
//!
//! ```text
//! p ← p + C_pk (k' − k) / C_kk,   C ← C − c cᵀ (C_kk − C'_kk) / C_kk²,   c = C_·k
//! ```

use nalgebra::DMatrix;

use super::envelope::PENDULUM;

/// Standard deviation of the scale of an angle (judgement): of an arc's centre from a few degrees of swing, or of a camera turned aside by ten degrees.
pub const SCALE: f64 = 0.02;

/// Mean and standard deviation of k by gravity alone. It goes with the square of the angle.
pub fn by_gravity(amplitude_rad: f64) -> [f64; 2] {
    let k = PENDULUM * amplitude_rad.powi(2);
    [k, 2.0 * SCALE * k]
}

/// Mean and variance of k under both assumptions, from those under the first alone, by noise whose power is that many times what it was taken for, and the two priors.
fn mixture(k: f64, variance: f64, power: f64, [spring, gravity]: [[f64; 2]; 2]) -> [f64; 2] {
    // what the record alone says
    let precision = (1.0 / variance - spring[1].powi(-2)).max(0.0) / power;
    let information = if precision > 0.0 { (k / variance - spring[0] / spring[1].powi(2)) / power } else { 0.0 };
    let under = |[mean, sd]: [f64; 2]| {
        let own = 1.0 / (precision + sd.powi(-2));
        let posterior = own * (information + mean / sd.powi(2));
        // of the record, up to what both share: how far it is off the prior, and how much of the prior it leaves
        let off =
            if precision > 0.0 { (information / precision - mean).powi(2) / (1.0 / precision + sd * sd) } else { 0.0 };
        ((own.sqrt() / sd).ln() - 0.5 * off, posterior, own)
    };
    let (a, b) = (under(spring), under(gravity));
    let share = |(ln_weight, ..): (f64, f64, f64)| 1.0 / ((a.0 - ln_weight).exp() + (b.0 - ln_weight).exp());
    let mean = share(a) * a.1 + share(b) * b.1;
    let spread = |own: (f64, f64, f64)| share(own) * (own.2 + (own.1 - mean).powi(2));
    [mean, spread(a) + spread(b)]
}

/// Values and their covariance under both assumptions, from those under the first; the second value is k. `power`: of the noise, over what the covariance takes it for; `spring`: the prior of k
/// with which the values were found.
pub fn average_over_models(
    values: &mut [f64],
    covariance: &mut DMatrix<f64>,
    power: f64,
    [spring, gravity]: [[f64; 2]; 2],
) {
    let own = covariance[(1, 1)];
    if !(own > 0.0) {
        return;
    }
    let [k, variance] = mixture(values[1], own, power, [spring, gravity]);
    let with_k = covariance.column(1) / own;
    let change = k - values[1];
    values.iter_mut().zip(&with_k).for_each(|(value, slope)| *value += slope * change);
    *covariance *= power;
    *covariance -= &with_k * with_k.transpose() * (power * own - variance);
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPRING: [f64; 2] = [0.5, 2.0 / 3.0];
    const GRAVITY: [f64; 2] = [1.0, 0.04];

    /// As a record alone of this mean and variance gives it, in noise of so much more power.
    fn known(mean: f64, variance: f64, power: f64) -> [f64; 2] {
        let own = 1.0 / (1.0 / variance + SPRING[1].powi(-2));
        mixture(own * (mean / variance + SPRING[0] / SPRING[1].powi(2)), own, power, [SPRING, GRAVITY])
    }

    #[test]
    fn a_record_near_a_pendulum_s_k_is_drawn_to_it_and_one_far_off_is_not() {
        let [near, variance] = known(0.9, 0.1 * 0.1, 1.0);
        assert!(near > 0.95 && near < 1.0 && variance.sqrt() < 0.07, "{near} {variance}");
        let [far, variance] = known(0.3, 0.1 * 0.1, 1.0);
        assert!((far - 0.3).abs() < 0.02 && (variance.sqrt() - 0.1).abs() < 0.01, "{far} {variance}");
    }

    #[test]
    fn without_a_record_both_assumptions_are_left() {
        let [mean, variance] = mixture(SPRING[0], SPRING[1].powi(2), 1.0, [SPRING, GRAVITY]);
        assert!((mean - 0.75).abs() < 1e-9, "{mean}");
        let expected = 0.5 * (SPRING[1].powi(2) + GRAVITY[1].powi(2)) + 0.25 * 0.25;
        assert!((variance - expected).abs() < 1e-9, "{variance}");
    }

    #[test]
    fn noise_of_more_power_says_less_of_k_and_leaves_the_priors_as_they_are() {
        // four times the power is twice the standard deviation of the record, whatever the priors
        let (weak, same) = (known(0.9, 0.01, 4.0), known(0.9, 0.04, 1.0));
        assert!((weak[0] - same[0]).abs() < 1e-9 && (weak[1] - same[1]).abs() < 1e-9, "{weak:?} {same:?}");
        // a record far from both is believed
        let [far, variance] = known(30.0, 1e-4, 1.0);
        assert!((far - 30.0).abs() < 0.1 && variance > 0.0, "{far} {variance}");
    }

    #[test]
    fn what_goes_with_k_goes_with_it() {
        let mut values = [5.0, 0.9];
        let mut covariance = DMatrix::from_row_slice(2, 2, &[0.05, 0.02, 0.02, 0.01]);
        average_over_models(&mut values, &mut covariance, 1.0, [SPRING, GRAVITY]);
        assert!((values[0] - 5.0 - 2.0 * (values[1] - 0.9)).abs() < 1e-12);
        // what is left of the first where k is known
        assert!((covariance[(0, 0)] - (0.01 + 4.0 * covariance[(1, 1)])).abs() < 1e-12);
        assert!(covariance[(1, 1)] < 0.005);
    }
}
