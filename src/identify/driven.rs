//! What the slowest mode drives of a mode that swings about three times as fast.
//!
//! Gravity and the turning of the links make the slowest mode, of amplitude a and phase φ, drive every other one by its cube. Its part in the complex amplitude of a
//! faster mode of pole λ follows the slowest mode's course, while the rest decays freely:
//!
//! ```text
//! A(t) = B e^{∫λ dt} + c u/(μ − λ)      u = (a e^{iφ})³,  μ = d ln u/dt,  λ = −σ + iω (1 − κ A² − κ'a²)
//! ```
//! (the forced solution of dA/dt = λA + cu, of which μ − λ changes slowly). B and c are linear; ω, σ, κ and κ' are sought by least squares, the last two with
//! what [`Bounds`] tells of them beforehand.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{Complex, DMatrix, DVector, Dyn};

use super::envelope::{Bounds, powers, unwrapped};
use super::estimate::{chi_squared_tail, f_tail};
use super::numerics::central_differences;
use super::pole::Pole;
use super::projection::Eliminated;
use super::windows::WindowAmplitude;

/// A driven part that noise explains with a probability above this is none.
const BY_CHANCE: f64 = 0.01;
/// What is not known of the driven part, over it (judgement: a window of some cycles shows less of it the farther its frequency is from the mode's).
const UNKNOWN_SHARE: f64 = 0.1;
/// What is free and not linear: ω, σ, κ, κ'.
const FREE: usize = 4;
/// B and c, real and imaginary.
const LINEAR: usize = 4;

/// A faster mode's windows without what the slowest mode drives, where that stands out; what is not known of it is added to their noise.
pub(super) fn without_driven(
    moments: &[WindowAmplitude],
    slowest: &[WindowAmplitude],
    whole: Pole,
    bounds: Bounds,
) -> Option<Vec<WindowAmplitude>> {
    let best = Driven::starts(moments, slowest, whole, bounds)?
        .into_iter()
        .filter_map(Driven::solved)
        .min_by(|a, b| a.chi2().total_cmp(&b.chi2()))?;
    let alone = Driven { is_driven: false, ..best.clone() }.solved()?;
    let free = (2 * moments.len()).checked_sub(FREE + LINEAR).filter(|free| *free > 0)? as f64;
    let f = 0.5 * (alone.chi2() - best.chi2()) / (best.chi2() / free).max(1.0);
    (f_tail(f, 2.0, free) < BY_CHANCE).then(|| best.freed())
}

/// Whether a faster mode's windows show the slowest mode's cube alone, A = cu: within what is not known of it, noise explains the rest.
pub(super) fn is_all_driven(moments: &[WindowAmplitude], slowest: &[WindowAmplitude]) -> bool {
    let Some(beside) = followed(slowest, moments).filter(|_| moments.len() > 2) else { return false };
    let cube = cube(&beside);
    let weight = |moment: &WindowAmplitude| moment.beside(UNKNOWN_SHARE * moment.amplitude_rad()).sd_rad.powi(-2);
    let each = || moments.iter().zip(cube.iter().map(|[u, _]| u));
    let c = each().map(|(moment, u)| weight(moment) * moment.amplitude_rad * u.conj()).sum::<Complex<f64>>()
        / each().map(|(moment, u)| weight(moment) * u.norm_sqr()).sum::<f64>();
    let chi2: f64 = each().map(|(moment, u)| weight(moment) * (moment.amplitude_rad - c * u).norm_sqr()).sum();
    chi_squared_tail(chi2, (2 * moments.len() - 2) as f64) > BY_CHANCE
}

/// The least-squares problem in ω, σ, κ and κ'.
#[derive(Debug, Clone)]
struct Driven<'a> {
    moments: &'a [WindowAmplitude],
    /// u, over its largest, and μ.
    cube: Vec<[Complex<f64>; 2]>,
    /// ∫A² dt of the mode and of the slowest one.
    integrals: [Vec<f64>; 2],
    bounds: Bounds,
    /// By which ω and σ are scaled.
    span_s: f64,
    /// About which ω is sought.
    about_rad_s: f64,
    /// (ω − that) and σ times the span, κ, κ'.
    values: DVector<f64>,
    is_driven: bool,
}

impl<'a> Driven<'a> {
    /// From the pole of the whole record, and from what the windows show as they are.
    fn starts(
        moments: &'a [WindowAmplitude],
        slowest: &[WindowAmplitude],
        whole: Pole,
        bounds: Bounds,
    ) -> Option<Vec<Self>> {
        let (first, last) = (moments.first()?, moments.last()?);
        let span_s = last.t_s - first.t_s;
        let beside = followed(slowest, moments)?;
        let phases = unwrapped(moments);
        let seen = Pole {
            omega_rad_s: (phases[phases.len() - 1] - phases[0]) / span_s,
            decay_per_s: (first.amplitude_rad() / last.amplitude_rad()).ln() / span_s,
        };
        let early = (moments.len() > 2).then(|| Pole {
            omega_rad_s: (phases[1] - phases[0]) / (moments[1].t_s - first.t_s),
            decay_per_s: (first.amplitude_rad() / moments[1].amplitude_rad()).ln() / (moments[1].t_s - first.t_s),
        });
        let at = |start: Pole| Self {
            moments,
            cube: cube(&beside),
            integrals: [powers(moments, moments, 2), powers(moments, &beside, 2)],
            bounds,
            span_s,
            about_rad_s: seen.omega_rad_s,
            values: DVector::from_vec(vec![
                (start.omega_rad_s - seen.omega_rad_s) * span_s,
                start.decay_per_s * span_s,
                bounds.kappa[0],
                Bounds::OTHER.kappa[0],
            ]),
            is_driven: true,
        };
        Some([Some(whole), Some(seen), early].into_iter().flatten().map(at).collect())
    }

    fn solved(self) -> Option<Self> {
        let (solved, report) = LevenbergMarquardt::new().with_tol(1e-10).with_patience(60).minimize(self);
        report.termination.was_successful().then_some(solved)
    }

    fn chi2(&self) -> f64 {
        self.misfit(&self.values).map_or(f64::INFINITY, |misfit| misfit.norm_squared())
    }

    /// The free part of unit amplitude, and the driven one where c is 1.
    fn parts(&self, values: &DVector<f64>) -> Vec<[Complex<f64>; 2]> {
        let omega_rad_s = self.about_rad_s + values[0] / self.span_s;
        let sigma_per_s = values[1] / self.span_s;
        let [own, other] = [values[2], values[3]];
        let first = &self.moments[0];
        let at = |(k, moment): (usize, &WindowAmplitude)| {
            let tau_s = moment.t_s - first.t_s;
            let turned = omega_rad_s * (tau_s - own * self.integrals[0][k] - other * self.integrals[1][k]);
            let free = Complex::from_polar((-sigma_per_s * tau_s).exp(), turned);
            let [u, mu] = self.cube[k];
            let apart = mu - Complex::new(-sigma_per_s, omega_rad_s);
            // nothing grows faster than in proportion to the time
            let least = self.span_s.recip();
            [free, if apart.norm() < least { u / least } else { u / apart }]
        };
        self.moments.iter().enumerate().map(at).collect()
    }

    /// The linear least squares of B and c.
    fn eliminated(&self, values: &DVector<f64>) -> Eliminated {
        let parts = self.parts(values);
        let columns = if self.is_driven { LINEAR } else { LINEAR - 2 };
        let basis = DMatrix::from_fn(2 * parts.len(), columns, |row, column| {
            let part = parts[row / 2][column / 2];
            let turned = if column.is_multiple_of(2) { part } else { Complex::<f64>::i() * part };
            component(turned, row) / self.moments[row / 2].sd_rad
        });
        let measured = DVector::from_fn(2 * parts.len(), |row, _| {
            component(self.moments[row / 2].amplitude_rad, row) / self.moments[row / 2].sd_rad
        });
        Eliminated::of(basis, &measured)
    }

    fn misfit(&self, values: &DVector<f64>) -> Option<DVector<f64>> {
        let priors = [self.bounds.kappa, Bounds::OTHER.kappa];
        let beforehand = priors.iter().enumerate().map(|(k, [mean, sd])| (values[2 + k] - mean) / sd);
        let residual = self.eliminated(values).residual;
        let all: Vec<f64> = residual.iter().copied().chain(beforehand).collect();
        all.iter().all(|r| r.is_finite()).then(|| DVector::from_vec(all))
    }

    /// The moments without the driven part.
    fn freed(&self) -> Vec<WindowAmplitude> {
        let Some(linear) = self.eliminated(&self.values).coefficients else { return self.moments.to_vec() };
        let c = Complex::new(linear[2], linear[3]);
        let parts = self.parts(&self.values);
        let without = |(moment, [_, unit]): (&WindowAmplitude, [Complex<f64>; 2])| {
            let driven = c * unit;
            let rest = WindowAmplitude { amplitude_rad: moment.amplitude_rad - driven, ..*moment };
            rest.beside(UNKNOWN_SHARE * driven.norm())
        };
        self.moments.iter().zip(parts).map(without).collect()
    }
}

fn component(value: Complex<f64>, row: usize) -> f64 {
    if row.is_multiple_of(2) { value.re } else { value.im }
}

/// A mode's course at the moments of another one, its amplitude and phase between its own.
fn followed(course: &[WindowAmplitude], at: &[WindowAmplitude]) -> Option<Vec<WindowAmplitude>> {
    if course.len() < 2 {
        return None;
    }
    let phases = unwrapped(course);
    let between = |moment: &WindowAmplitude| {
        let after = course.iter().position(|own| own.t_s > moment.t_s).unwrap_or(course.len() - 1).max(1);
        let (a, b) = (&course[after - 1], &course[after]);
        let part = (moment.t_s - a.t_s) / (b.t_s - a.t_s);
        let ln_amplitude = (1.0 - part) * a.amplitude_rad().ln() + part * b.amplitude_rad().ln();
        let phase = (1.0 - part) * phases[after - 1] + part * phases[after];
        WindowAmplitude { t_s: moment.t_s, amplitude_rad: Complex::from_polar(ln_amplitude.exp(), phase), ..*a }
    };
    Some(at.iter().map(between).collect())
}

/// u, over its largest, and μ, at each moment.
fn cube(beside: &[WindowAmplitude]) -> Vec<[Complex<f64>; 2]> {
    let largest = beside.iter().map(WindowAmplitude::amplitude_rad).fold(f64::MIN_POSITIVE, f64::max);
    let phases = unwrapped(beside);
    let ln = |k: usize| Complex::new(3.0 * (beside[k].amplitude_rad() / largest).ln(), 3.0 * phases[k]);
    let last = beside.len() - 1;
    let at = |k: usize| {
        let (from, to) = (k.saturating_sub(1), (k + 1).min(last));
        [ln(k).exp(), (ln(to) - ln(from)) / (beside[to].t_s - beside[from].t_s)]
    };
    (0..beside.len()).map(at).collect()
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Driven<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, values: &DVector<f64>) {
        self.values.copy_from(values);
    }

    fn params(&self) -> DVector<f64> {
        self.values.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        self.misfit(&self.values)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        central_differences(&self.values, |values| self.misfit(values))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::numerics::runge_kutta;

    const OMEGA: f64 = 8.5;
    const BOUNDS: Bounds = Bounds { kappa: [0.4, 0.5], lambda: [0.0, 0.5], fourth: [0.03, 0.5] };

    /// Windows of 3 s of the slowest mode and of one of ω = 3 · 8.5 · 1.02 rad/s, σ = 0.28 /s and this first amplitude, which the first drives by c a³; by integration.
    fn windows(amplitude_rad: f64, driven_per_s: f64) -> [Vec<WindowAmplitude>; 2] {
        let slowest = |t: f64| {
            let amplitude = 0.3 * (-0.006 * t).exp();
            (amplitude, OMEGA * t)
        };
        let slope = |[re, im, t]: [f64; 3]| {
            let (amplitude, phase) = slowest(t);
            let lambda = Complex::new(-0.28, 3.0 * OMEGA * 1.02);
            let driven = driven_per_s * Complex::from_polar(amplitude.powi(3), 3.0 * phase);
            let rate = lambda * Complex::new(re, im) + driven;
            [rate.re, rate.im, 1.0]
        };
        let at = |t_s: f64, amplitude_rad: Complex<f64>, omega_rad_s: f64| WindowAmplitude {
            t_s,
            amplitude_rad,
            sd_rad: 1e-4,
            omega_rad_s,
        };
        let (mut first, mut own) = (Vec::new(), Vec::new());
        let mut state = [amplitude_rad, 0.0, 0.0];
        for _ in 0..12 {
            let (amplitude, phase) = slowest(state[2]);
            let before = Complex::new(state[0], state[1]);
            first.push(at(state[2], Complex::from_polar(amplitude, phase), OMEGA));
            let t_s = state[2];
            let mut next = state;
            for _ in 0..3000 {
                next = runge_kutta(next, 1e-3, slope);
            }
            state = next;
            // what joins the phases: that of most of what is there
            let omega_rad_s = if t_s < 9.0 { 3.0 * OMEGA * 1.02 } else { 3.0 * OMEGA };
            own.push(at(t_s, before, omega_rad_s));
        }
        [first, own]
    }

    #[test]
    fn what_the_slowest_mode_drives_is_taken_from_a_faster_one() {
        let [slowest, own] = windows(0.1, 0.6);
        let pole = Pole { omega_rad_s: 3.0 * OMEGA * 1.01, decay_per_s: 0.1 };
        let free = without_driven(&own, &slowest, pole, BOUNDS).unwrap();
        // the forced part, 0.6 a³/(σ + i 0.51), is a third of the mode at first, and all that is left of it in the end
        for pair in free[..4].windows(2) {
            let decay_per_s = (pair[0].amplitude_rad() / pair[1].amplitude_rad()).ln() / 3.0;
            assert!((decay_per_s - 0.28).abs() < 0.02, "{decay_per_s}");
        }
        let last = free[free.len() - 1];
        assert!(last.amplitude_rad.norm() < 3.0 * last.sd_rad && own[11].amplitude_rad.norm() > 0.01);
    }

    #[test]
    fn a_mode_that_nothing_drives_stays_as_it_is_and_a_harmonic_is_all_driven() {
        let [slowest, free] = windows(0.1, 0.0);
        let seen = &free[..7];
        let pole = Pole { omega_rad_s: 3.0 * OMEGA * 1.02, decay_per_s: 0.28 };
        assert_eq!(without_driven(seen, &slowest, pole, BOUNDS), None);
        assert!(!is_all_driven(seen, &slowest));
        let [slowest, harmonic] = windows(0.0, 0.6);
        assert!(is_all_driven(&harmonic[6..], &slowest));
    }
}
