//! The identification as a person reads it.

use std::fmt::{self, Display, Formatter};

use super::damping::Damping;
use super::estimate::{Estimate, probability};
use super::estimators::Method;
use super::mode::Mode;
use super::{Identification, Record};

impl Display for Identification {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.summary)?;
        self.record.fmt(f)?;
        if self.drift_rad.iter().any(|d| *d > 0.0) {
            let each: Vec<String> = self.drift_rad.iter().map(|d| self.record.measured.show(*d, 3)).collect();
            writeln!(f, "  drift over the record {}, removed before the analysis", each.join(", "))?;
        }
        if let Some(count) = &self.mode_count {
            writeln!(f, "  {}", count.statement)?;
        }
        for mode in &self.modes {
            writeln!(f, "\nMode {}", mode.number)?;
            mode.fmt(f)?;
        }
        if let Some(floor) = &self.floor {
            writeln!(f, "\nFloor        {}", floor.statement)?;
        }
        if let Some(e) = &self.equivalents {
            writeln!(
                f,
                "\nEquivalent single oscillator (mode {}; M = {:.4e} kg, I about the hinge = {:.4e} kg·m²)",
                self.swing_mode.unwrap_or(1),
                e.mass_kg,
                e.inertia_kg_m2
            )?;
            writeln!(
                f,
                "  K_eq  = ωₙ²M     {} N/m        (Eq. 29; the paper's N·m/rad is a slip)",
                scientific(&e.k_eq_n_per_m)
            )?;
            let absent = || "not identifiable".to_owned();
            let c_eq = e.c_eq_n_s_per_m.as_ref().map_or_else(absent, scientific);
            writeln!(f, "  C_eq  = 2Mωₙξ    {c_eq} N·s/m      (Eq. 30; the paper's N·m·s/rad is a slip)")?;
            writeln!(
                f,
                "  K_rot = ωₙ²I     {} N·m/rad    ({})",
                scientific(&e.k_rot_n_m_per_rad),
                if e.k_gravity_n_m_per_rad > e.k_rot_n_m_per_rad.high {
                    format!(
                        "gravity alone makes {:.4e} of a straight body: it does not swing as one of this inertia",
                        e.k_gravity_n_m_per_rad
                    )
                } else {
                    format!("gravity makes {:.4e} of it", e.k_gravity_n_m_per_rad)
                }
            )?;
            let c_rot = e.c_rot_n_m_s_per_rad.as_ref().map_or_else(absent, scientific);
            writeln!(f, "  C_rot = 2Iωₙξ    {c_rot} N·m·s/rad")?;
        }
        if !self.notes.is_empty() {
            writeln!(f)?;
        }
        self.notes.iter().try_for_each(|note| writeln!(f, "note: {note}"))
    }
}

impl Display for Record {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}: {} rows, {:.2} s, {:.3} Hz, {}",
            self.source,
            self.rows,
            self.duration_s,
            1.0 / self.step_s,
            self.measured.columns(self.values.len())
        )?;
        let left: Vec<String> = self.noise_rad.iter().map(|n| self.measured.show(*n, 4)).collect();
        if left.is_empty() {
            Ok(())
        } else {
            writeln!(f, "  left beside the modes, noise included: {} (rms)", left.join(", "))
        }
    }
}

impl Display for Mode {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let measured = self.measured;
        writeln!(f, "  f = {} Hz", interval(&self.frequency_hz, 5))?;
        match &self.damping {
            Damping::Identified(xi) => writeln!(f, "  ξ = {}", interval(xi, 6))?,
            Damping::NotIdentifiable { reason, .. } => writeln!(f, "  ξ not identifiable: {reason}")?,
        }
        writeln!(f, "  from: {}", self.basis)?;
        for (link, motion) in self.shape.iter().enumerate() {
            write!(f, "  {} amplitude {}", measured.name(link), measured.show(motion.amplitude_rad, 2))?;
            if link > 0 {
                let (ratio, phase) =
                    (&motion.ratio_to_first, motion.phase_to_first_rad.times(180.0 / std::f64::consts::PI));
                write!(
                    f,
                    ", θ{}/θ1 = {:.4} ± {:.4} at {:.2}° ± {:.2}°",
                    link + 1,
                    ratio.value,
                    ratio.half(),
                    phase.value,
                    phase.half()
                )?;
            }
            writeln!(f)?;
        }
        writeln!(f, "  {:18}{:>30}{:>33}", "estimator", "f, 95 % (Hz)", "ξ, 95 %")?;
        for e in &self.estimators {
            let cell =
                |value: &Option<Estimate>, digits| value.as_ref().map_or("–".to_owned(), |v| interval(v, digits));
            let name = match e.method {
                Method::Spectrum => "spectrum",
                Method::HalfPower => "half power",
                Method::Decrement => "decrement",
                Method::Sinusoids => "damped sinusoids",
                Method::Envelope => "envelope",
                Method::Modulated => "slow flow",
            };
            let (frequency, damping) = (cell(&e.frequency_hz, 5), cell(&e.damping_ratio, 6));
            writeln!(f, "  {name:18}{frequency:>30}{damping:>33}  {}", e.note.as_deref().unwrap_or(""))?;
        }
        let verdict = |agree: bool| if agree { "agree" } else { "disagree" };
        let tests = [("frequencies", &self.frequency_consistency), ("damping ratios", &self.damping_consistency)];
        for (what, test) in tests {
            if let Some(t) = test {
                writeln!(
                    f,
                    "  {what} {} (χ² = {:.1} of {}, {})",
                    verdict(t.agree),
                    t.chi2,
                    t.estimators - 1,
                    probability(t.p_value)
                )?;
            }
        }
        self.against_amplitude(f)
    }
}

impl Mode {
    /// Frequency and damping from window to window, a dozen lines at most.
    fn against_amplitude(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let measured = self.measured;
        if let Some(law) = self.frequency_law() {
            let expected =
                self.expected_kappa_per_rad2.map(|k| format!("; a pendulum of this shape {k:.4}")).unwrap_or_default();
            writeln!(
                f,
                "  f = f₀(1 − κA²): f₀ = {} Hz, κ = {}{expected}",
                interval(&law.f0_hz, 5),
                measured.interval_per_square(&law.kappa_per_rad2)
            )?;
        }
        let Some(envelope) = &self.envelope else { return Ok(()) };
        writeln!(f, "  {:>8}{:>12}{:>26}{:>28}", "t (s)", format!("A ({})", measured.symbol()), "f (Hz)", "ξ")?;
        let every = envelope.steps.len().div_ceil(12).max(1);
        for step in envelope.steps.iter().step_by(every) {
            let (frequency, damping) = (&step.frequency_hz, &step.damping_ratio);
            writeln!(
                f,
                "  {:8.2}{:12.3}{:>26}{:>28}",
                step.t_s,
                measured.shown(step.amplitude_rad),
                format!("{:.5} ± {:.5}", frequency.value, frequency.half()),
                format!("{:.6} ± {:.6}", damping.value, damping.half())
            )?;
        }
        if let Some(law) = envelope.decay {
            writeln!(
                f,
                "  dA/dt = −(b₀ + b₁A + b₂A²): b₀ = {} {own}/s, b₁ = {} /s, b₂ = {} /({own} s); viscous alone {} (descriptive fit only)",
                scientific(&law.b0_rad_per_s.times(measured.own_per_rad())),
                scientific(&law.b1_per_s),
                scientific(&law.b2_per_rad_s.times(1.0 / measured.own_per_rad())),
                probability(law.p_viscous),
                own = measured.own()
            )?;
        }
        Ok(())
    }
}

/// `value [low, high]`.
pub(super) fn interval(e: &Estimate, digits: usize) -> String {
    format!("{:.digits$} [{:.digits$}, {:.digits$}]", e.value, e.low, e.high)
}

fn scientific(e: &Estimate) -> String {
    format!("{:.4e} ± {:.1e}", e.value, e.half())
}
