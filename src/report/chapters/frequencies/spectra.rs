//! The spectrum, and the resonance curve of each mode.

use crate::identify::half_power::resonance_curve;
use crate::identify::signal::Signal;
use crate::identify::spectrum::Spectrum;
use crate::report::left::{Identified, Mode};
use crate::report::plot::{Axis, Band, Ink, Line, Plot, Series, Style};

/// The spectrum is shown up to this many times the highest mode's frequency.
const SHOWN: f64 = 4.0;
/// Points of a resonance curve.
const CURVE_POINTS: usize = 400;

pub(super) fn spectrum(found: &Identified, signal: &Signal) -> Plot {
    let spectrum = Spectrum::of(&signal.levelled(), 0.0);
    let highest_hz = found.modes.iter().filter_map(|m| m.frequency_hz.value).fold(0.0, f64::max);
    let last_hz = spectrum.step_hz * spectrum.amplitude_rad.len() as f64;
    let until_hz = if highest_hz > 0.0 { (SHOWN * highest_hz).min(last_hz) } else { last_hz };
    // the mean was taken away: below the first line there is nothing to see
    let first = (spectrum.resolution_hz / spectrum.step_hz) as usize;
    let shown: Vec<usize> =
        (first.max(1)..spectrum.amplitude_rad.len()).take_while(|k| *k as f64 * spectrum.step_hz <= until_hz).collect();
    let resolution = found.spectrum.resolution_hz.unwrap_or(spectrum.resolution_hz);
    let strongest = found.modes.first().and_then(|m| m.frequency_hz.value);
    let bands = strongest.map(|f| Band {
        name: format!("resolution 1/T = {resolution:.4} Hz"),
        ink: Ink::Orange,
        is_across: false,
        ends: [f - 0.5 * resolution, f + 0.5 * resolution],
    });
    let lines =
        found.modes.iter().filter_map(|m| Some(Line { name: format!("f{}", m.number), at: m.frequency_hz.value? }));
    let peaks: Vec<String> =
        found.spectrum.peaks.iter().take(4).filter_map(|p| Some(format!("{:.4} Hz", p.frequency_hz.value?))).collect();
    Plot {
        id: "spectrum".into(),
        title: "Amplitude spectrum".into(),
        alternative: format!("Amplitude of all angles together against frequency; highest peaks at {}", peaks.join(", ")),
        caption: "Hann window, mean taken away, all angles together. Modes that lie closer than the resolution cannot be told apart.".into(),
        x: Axis { range: Some([0.0, until_hz]), ..Axis::of("frequency", "Hz") },
        y: Axis { is_logarithmic: true, ..Axis::of("amplitude", "mrad") },
        at: shown.iter().map(|k| *k as f64 * spectrum.step_hz).collect(),
        series: vec![Series {
            name: "amplitude".into(),
            ink: Ink::Blue,
            values: shown.iter().map(|k| Some(1e3 * spectrum.amplitude_rad[*k]).filter(|a| *a > 0.0)).collect(),
            ..Series::default()
        }],
        bands: bands.into_iter().collect(),
        lines: lines.collect(),
        ..Plot::default()
    }
}

pub(super) fn half_power(mode: &Mode, signal: &Signal) -> Plot {
    let Some(f_hz) = mode.frequency_hz.value else { return Plot::default() };
    let own = mode.estimators.iter().find(|e| e.method == "half_power");
    let xi = own.and_then(|e| e.damping_ratio?.value).or_else(|| mode.damping.identified.and_then(|xi| xi.value));
    let resolution_hz = 1.0 / signal.duration_s();
    let reach_hz = (4.0 * xi.unwrap_or(0.0).abs() * f_hz).max(4.0 * resolution_hz).min(0.8 * f_hz);
    let at: Vec<f64> =
        (0..=CURVE_POINTS).map(|k| f_hz + reach_hz * (2.0 * k as f64 / CURVE_POINTS as f64 - 1.0)).collect();
    let power = resonance_curve(&signal.levelled(), &at);
    let top = (0..power.len()).max_by(|a, b| power[*a].total_cmp(&power[*b])).unwrap_or(0);
    let low = (0..top).rev().find(|k| power[*k] < 0.5);
    let high = (top..power.len()).find(|k| power[*k] < 0.5);
    let band = low.zip(high).map(|(low, high)| Band {
        name: format!("above half power: {:.4} Hz", at[high] - at[low]),
        ink: Ink::Orange,
        is_across: false,
        ends: [at[low], at[high]],
    });
    let said = match own.and_then(|e| e.damping_ratio?.value) {
        Some(xi) => format!("With the end of the record allowed for, the width gives ξ = {xi:.5}."),
        None => own
            .and_then(|e| e.note.clone())
            .map_or_else(String::new, |note| format!("No damping is read from it: {note}.")),
    };
    let half = Series {
        name: "half power".into(),
        ink: Ink::Grey,
        style: Style::Dashed,
        values: vec![Some(0.5); at.len()],
        ..Series::default()
    };
    Plot {
        id: format!("half-power-{}", mode.number),
        title: format!("Half-power bandwidth, mode {}", mode.number),
        alternative: format!("Power near {f_hz:.4} Hz as a share of its peak, with the line at one half"),
        caption: format!("Power of the whole record, without a window. {said}"),
        x: Axis::of("frequency", "Hz"),
        y: Axis { range: Some([0.0, 1.05]), ..Axis::of("power over its peak", "") },
        series: vec![
            Series {
                name: "power".into(),
                ink: Ink::Blue,
                values: power.into_iter().map(Some).collect(),
                ..Series::default()
            },
            half,
        ],
        at,
        bands: band.into_iter().collect(),
        lines: vec![Line { name: format!("f{}", mode.number), at: f_hz }],
        ..Plot::default()
    }
}
