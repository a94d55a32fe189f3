//! Frequencies and damping: spectrum, resonance curve, decay, amplitude, every estimator, mode shapes.

mod amplitude;
mod decay;
mod estimators;
mod shapes;
mod spectra;

pub use shapes::moving;

use super::{Chapter, Part};
use crate::identify::signal::Signal;
use crate::report::html::{escaped, interval, paragraph, table, value};
use crate::report::left::{Identified, Interval, Left, Mode};
use crate::series::AngleSeries;
use amplitude::{damping_against_amplitude, frequency_against_amplitude};
use decay::decay;
use estimators::{Quantity, estimators, refusals};
use shapes::shapes;
use spectra::{half_power, spectrum};

/// Modes that have plots of their own.
const MOST_MODES: usize = 2;

/// The chapter.
pub fn chapter(left: &Left) -> Chapter {
    let mut chapter = Chapter::new("frequencies", "Frequencies and damping");
    let Some(found) = &left.identified else { return chapter };
    chapter.words(paragraph(&found.summary));
    if !found.modes.is_empty() {
        chapter.words(modes(found));
        chapter.parts.push(Part::MovingModes);
        chapter.plot(shapes(left, found));
    }
    // of what was identified: a beginning that is held is no swing
    let of = |angles: &AngleSeries| {
        let signal = Signal::of(angles);
        found.used_s.map_or_else(|| signal.clone(), |[from_s, until_s]| signal.from(from_s).until(until_s))
    };
    let signal = left.angles.as_ref().map(of);
    if let Some(signal) = &signal {
        chapter.plot(spectrum(found, signal));
        for mode in found.modes.iter().take(MOST_MODES) {
            chapter.plot(half_power(mode, signal));
        }
    }
    chapter.plot(decay(found, signal.as_ref()));
    for mode in found.modes.iter().take(MOST_MODES) {
        chapter.plot(frequency_against_amplitude(mode, found.modes.len() == 1));
        chapter.plot(damping_against_amplitude(mode));
    }
    for mode in found.modes.iter().take(MOST_MODES) {
        chapter.plot(estimators(mode, Quantity::Frequency));
        chapter.plot(estimators(mode, Quantity::Damping));
        chapter.words(refusals(mode));
    }
    chapter.words(equivalents(found));
    chapter
}

fn modes(found: &Identified) -> String {
    let rows = found.modes.iter().map(|mode| {
        let damping = match (&mode.damping.identified, &mode.damping.not_identifiable) {
            (Some(xi), _) => interval(xi, ""),
            (None, Some(why)) => format!("not identifiable: {}", escaped(&why.reason)),
            (None, None) => "–".to_owned(),
        };
        let shape: Vec<String> = mode.shape.iter().skip(1).map(|link| interval(&link.ratio_to_first, "")).collect();
        let phase: Vec<String> = mode
            .shape
            .iter()
            .skip(1)
            .map(|link| {
                let degrees = |v: Option<f64>| v.map(f64::to_degrees);
                let p = &link.phase_to_first_rad;
                interval(
                    &Interval {
                        value: degrees(p.value),
                        sd: degrees(p.sd),
                        low: degrees(p.low),
                        high: degrees(p.high),
                    },
                    "°",
                )
            })
            .collect();
        vec![
            mode.number.to_string(),
            frequency(mode),
            damping,
            shape.join(", "),
            phase.join(", "),
            escaped(&mode.basis),
        ]
    });
    let headings = ["mode", "frequency", "damping ratio ξ", "amplitude over θ1's", "phase to θ1", "from"];
    let note = "<p class=\"note\">Frequencies are those at small amplitude, unless another amplitude is named. Behind ± stands half of the 95 % interval. A click on a number copies it with its unit.</p>\n";
    table(&headings, rows) + note
}

fn frequency(mode: &Mode) -> String {
    let hz = interval(&mode.frequency_hz, "Hz");
    mode.frequency_at_amplitude_rad
        .map_or(hz.clone(), |at| format!("{hz} at an amplitude of {}", value(Some(at), 3, "rad")))
}

fn equivalents(found: &Identified) -> String {
    let mut html = String::new();
    if let Some(e) = &found.equivalents {
        let absent = || "not identifiable".to_owned();
        let rows = [
            ("K_eq = ωₙ²M", interval(&e.k_eq_n_per_m, "N/m")),
            ("C_eq = 2Mωₙξ", e.c_eq_n_s_per_m.as_ref().map_or_else(absent, |c| interval(c, "N s/m"))),
            ("K_rot = ωₙ²I", interval(&e.k_rot_n_m_per_rad, "N m/rad")),
            ("C_rot = 2Iωₙξ", e.c_rot_n_m_s_per_rad.as_ref().map_or_else(absent, |c| interval(c, "N m s/rad"))),
            ("gravity's part of K_rot", value(e.k_gravity_n_m_per_rad, 4, "N m/rad")),
        ];
        html += "<h3>Equivalent single oscillator</h3>\n";
        html += &table(&["constant", "value"], rows.map(|(name, number)| vec![name.to_owned(), number]));
    }
    html + &found
        .floor
        .as_ref()
        .map(|floor| paragraph(&format!("Against the lowest frequency that is possible: {}.", floor.statement)))
        .unwrap_or_default()
}
