//! Frequencies and damping: spectrum, resonance curve, decay, amplitude, every estimator, mode shapes.

use super::{Chapter, Part};
use crate::identify::half_power::resonance_curve;
use crate::identify::signal::Signal;
use crate::identify::spectrum::Spectrum;
use crate::report::html::{self, escaped, interval, list, paragraph, table, value};
use crate::report::left::{Estimator, Identified, Interval, Left, Mode};
use crate::report::plot::{Axis, Band, Ink, Line, Plot, Series, Style};

/// Modes that have plots of their own.
const MOST_MODES: usize = 2;
/// The spectrum is shown up to this many times the highest mode's frequency.
const SHOWN: f64 = 4.0;
/// Points of a resonance curve.
const CURVE_POINTS: usize = 400;

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
    let signal = left.angles.as_ref().map(|angles| Signal::of(angles).unwrapped().0);
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
            interval(&mode.frequency_hz, "Hz"),
            damping,
            shape.join(", "),
            phase.join(", "),
            escaped(&mode.basis),
        ]
    });
    let headings =
        ["mode", "frequency at small amplitude", "damping ratio ξ", "amplitude over θ1's", "phase to θ1", "from"];
    let note = "<p class=\"note\">Behind ± stands half of the 95 % interval. A click on a number copies it with its unit.</p>\n";
    table(&headings, rows) + note
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
    html + &found.floor.as_ref().map(|floor| paragraph(&floor.statement)).unwrap_or_default()
}

/// Why some method gives no number.
fn refusals(mode: &Mode) -> String {
    let notes = mode.estimators.iter().filter_map(|e| Some(format!("{}: {}", method(e), e.note.as_ref()?)));
    list("notes", notes.collect::<Vec<_>>())
}

fn method(estimator: &Estimator) -> String {
    match estimator.method.as_str() {
        "half_power" => "half-power bandwidth".to_owned(),
        "decrement" => "logarithmic decrement".to_owned(),
        "sinusoids" => "damped sinusoids".to_owned(),
        "envelope" => "windows, small amplitude".to_owned(),
        "spectrum" => "peak of the spectrum".to_owned(),
        other => other.to_owned(),
    }
}

fn spectrum(found: &Identified, signal: &Signal) -> Plot {
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

fn half_power(mode: &Mode, signal: &Signal) -> Plot {
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

/// Turning points of the angle that moves most, amplitudes of the modes, and the decrement through them.
fn decay(found: &Identified, signal: Option<&Signal>) -> Plot {
    let mut points = Scattered::default();
    let links = signal.iter().flat_map(|s| s.links.iter().enumerate());
    if let Some((link, samples)) = links.max_by(|a, b| a.1.range_rad().total_cmp(&b.1.range_rad())) {
        let turning = turning_points(&samples.t_s, &samples.theta_rad, samples.mean_rad());
        points.add(format!("turning points of θ{}", link + 1), Ink::Grey, turning);
    }
    let modes = || found.modes.iter().take(MOST_MODES);
    for mode in modes() {
        let steps =
            mode.envelope.iter().flat_map(|e| &e.steps).filter_map(|s| Some((s.t_s?, s.amplitude_rad?))).collect();
        points.add(format!("amplitude of mode {}", mode.number), Ink::number(mode.number - 1), steps);
    }
    let (at, mut series) = points.aligned();
    series.extend(modes().filter_map(|mode| decrement(mode, &at)));
    Plot {
        id: "decay".into(),
        title: "Decay: peaks, amplitudes and decrement".into(),
        alternative: "Turning points and amplitudes of the modes against time on a logarithmic scale, with the straight line of one decrement".into(),
        caption: "An exponential decay is straight here. The broken line has the decrement over all peaks and passes through the middle of the record: where the \
                  amplitudes leave it, the damping depends on the amplitude. Turning points hold all modes at once.".into(),
        x: Axis::of("t", "s"),
        y: Axis { is_logarithmic: true, ..Axis::of("amplitude", "mrad") },
        is_time: true,
        at,
        series,
        ..Plot::default()
    }
}

/// The decay with the decrement over all peaks, through the amplitude in the middle of the record.
fn decrement(mode: &Mode, at: &[f64]) -> Option<Series> {
    let steps = &mode.envelope.as_ref()?.steps;
    let middle = steps.get(steps.len() / 2)?;
    let (t0_s, a0_rad) = (middle.t_s?, middle.amplitude_rad?);
    let own = mode.estimators.iter().find(|e| e.method == "decrement")?;
    let rate = std::f64::consts::TAU * own.frequency_hz?.value? * own.damping_ratio?.value?;
    Some(Series {
        name: format!("decrement, mode {}", mode.number),
        ink: Ink::number(mode.number - 1),
        style: Style::Dashed,
        values: at.iter().map(|t| Some(1e3 * a0_rad * (-rate * (t - t0_s)).exp())).collect(),
        ..Series::default()
    })
}

/// Amplitudes (rad) of several series, each at stamps of its own.
#[derive(Default)]
struct Scattered {
    series: Vec<(Series, Vec<(f64, f64)>)>,
}

impl Scattered {
    fn add(&mut self, name: String, ink: Ink, points: Vec<(f64, f64)>) {
        if !points.is_empty() {
            self.series.push((Series { name, ink, style: Style::Dots, ..Series::default() }, points));
        }
    }

    /// All stamps in order, and the values (mrad) of each series at them.
    fn aligned(self) -> (Vec<f64>, Vec<Series>) {
        let mut at: Vec<f64> = self.series.iter().flat_map(|(_, points)| points.iter().map(|p| p.0)).collect();
        at.sort_by(f64::total_cmp);
        at.dedup();
        let placed = |(series, points): (Series, Vec<(f64, f64)>)| {
            let mut values = vec![None; at.len()];
            for (t_s, amplitude_rad) in points {
                let row = at.partition_point(|t| *t < t_s);
                values[row] = Some(1e3 * amplitude_rad).filter(|a| *a > 0.0);
            }
            Series { values, ..series }
        };
        let series = self.series.into_iter().map(placed).collect();
        (at, series)
    }
}

/// The farthest point of each half swing from the middle.
fn turning_points(t_s: &[f64], theta_rad: &[f64], mean_rad: f64) -> Vec<(f64, f64)> {
    let away: Vec<(f64, f64)> = t_s.iter().zip(theta_rad).map(|(t, a)| (*t, a - mean_rad)).collect();
    let halves = away.chunk_by(|a, b| (a.1 > 0.0) == (b.1 > 0.0));
    halves
        .filter(|half| half.len() > 1)
        .filter_map(|half| half.iter().map(|(t, a)| (*t, a.abs())).max_by(|a, b| a.1.total_cmp(&b.1)))
        .collect()
}

fn frequency_against_amplitude(mode: &Mode, alone: bool) -> Plot {
    let Some(envelope) = &mode.envelope else { return Plot::default() };
    let law = envelope.frequency.as_ref().and_then(|law| Some((law.f0_hz.value?, law.kappa_per_rad2.value?)));
    let mut plot = against_amplitude(mode, |step| step.frequency_hz);
    if let Some((f0_hz, kappa)) = law {
        let values = plot.at.iter().map(|a| Some(f0_hz * (1.0 - kappa * a * a))).collect();
        plot.series.push(Series {
            name: format!("f₀(1 − κA²), κ = {kappa:.4} /rad²{}", if alone { "" } else { ", the other mode at rest" }),
            ink: Ink::Ink,
            style: Style::Dashed,
            values,
            ..Series::default()
        });
    }
    Plot {
        id: format!("frequency-amplitude-{}", mode.number),
        title: format!("Frequency against amplitude, mode {}", mode.number),
        alternative: "Frequency from window to window, with 95 % intervals, against the amplitude of the swing".into(),
        caption: format!(
            "Each point is the step between two windows of a few cycles. A pendulum is slower at large amplitude: κ is 1/16 for one rigid link.{}",
            if alone { "" } else { " The amplitude of the other mode moves the points off the line." }
        ),
        y: Axis::of("frequency", "Hz"),
        ..plot
    }
}

fn damping_against_amplitude(mode: &Mode) -> Plot {
    Plot {
        id: format!("damping-amplitude-{}", mode.number),
        title: format!("Damping against amplitude, mode {}", mode.number),
        alternative: "Damping ratio from window to window, with 95 % intervals, against the amplitude of the swing".into(),
        caption: "Level: viscous damping. Rising to the left, as the swing becomes small: dry friction. Rising to the right: drag.".into(),
        y: Axis::of("damping ratio ξ", ""),
        ..against_amplitude(mode, |step| step.damping_ratio)
    }
}

fn against_amplitude(mode: &Mode, of: fn(&crate::report::left::Step) -> Interval) -> Plot {
    let steps = mode.envelope.iter().flat_map(|e| &e.steps);
    let mut points: Vec<(f64, Interval)> = steps.filter_map(|s| Some((s.amplitude_rad?, of(s)))).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let series = Series {
        name: format!("mode {}", mode.number),
        ink: Ink::number(mode.number - 1),
        style: Style::Interval,
        values: points.iter().map(|p| p.1.value).collect(),
        ends: points.iter().map(|p| Some([p.1.low?, p.1.high?])).collect(),
    };
    Plot {
        x: Axis::of("amplitude", "rad"),
        at: points.iter().map(|p| p.0).collect(),
        series: vec![series],
        ..Plot::default()
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Quantity {
    Frequency,
    Damping,
}

/// Every method's value with its interval on one axis, the one that is taken among them.
fn estimators(mode: &Mode, quantity: Quantity) -> Plot {
    let is_frequency = quantity == Quantity::Frequency;
    let of = |e: &Estimator| if is_frequency { e.frequency_hz } else { e.damping_ratio };
    let taken = if is_frequency { Some(mode.frequency_hz) } else { mode.damping.identified };
    let taken = taken.filter(|t| t.value.is_some());
    let rows: Vec<String> = mode.estimators.iter().map(method).chain(taken.map(|_| "taken".to_owned())).collect();
    let mut points: Vec<(f64, usize, Option<[f64; 2]>)> = mode
        .estimators
        .iter()
        .map(of)
        .chain([taken])
        .enumerate()
        .filter_map(|(row, e)| {
            let e = e?;
            Some((e.value?, row + 1, e.low.zip(e.high).map(|(low, high)| [low, high])))
        })
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let agree = if is_frequency { &mode.frequency_consistency } else { &mode.damping_consistency };
    let agree = match agree.as_ref().map(|c| c.agree) {
        Some(true) => "The methods agree.",
        Some(false) => {
            "The methods disagree: no one number describes the record, as each of them weighs amplitudes in its own way."
        }
        None => "",
    };
    let (name, axis) = if is_frequency {
        ("frequency", Axis::of("frequency", "Hz"))
    } else {
        ("damping", Axis::of("damping ratio ξ", ""))
    };
    let said = points
        .iter()
        .map(|(v, row, _)| format!("{} {}", rows[row - 1], crate::digits::number(*v, 5)))
        .collect::<Vec<_>>()
        .join("; ");
    Plot {
        id: format!("estimators-{name}-{}", mode.number),
        title: format!(
            "Every estimate of the {}, mode {}",
            if is_frequency { "frequency" } else { "damping ratio" },
            mode.number
        ),
        alternative: format!("Estimates with 95 % intervals: {said}"),
        caption: format!("{agree} A row without a point gives no number."),
        x: axis,
        y: Axis { label: "method".into(), rows, ..Axis::default() },
        at: points.iter().map(|p| p.0).collect(),
        series: vec![Series {
            name: "estimate".into(),
            ink: Ink::Blue,
            style: Style::Interval,
            values: points.iter().map(|p| Some(p.1 as f64)).collect(),
            ends: points.iter().map(|p| p.2).collect(),
        }],
        ..Plot::default()
    }
}

/// Displacement along the specimen in each mode, the largest being one.
fn shapes(left: &Left, found: &Identified) -> Plot {
    let links = found.modes.iter().map(|m| m.shape.len()).max().unwrap_or(0);
    let stated = left.link_lengths_m();
    let is_stated = stated.len() == links;
    let lengths = if is_stated { stated } else { vec![1.0; links] };
    let mut at = vec![0.0];
    lengths.iter().for_each(|l| at.push(at[at.len() - 1] + l));
    let series = found.modes.iter().filter(|m| m.shape.len() == links).map(|mode| {
        let mut place = vec![0.0];
        for (link, length) in mode.shape.iter().zip(&lengths) {
            let side = link.ratio_to_first.value.unwrap_or(1.0) * link.phase_to_first_rad.value.unwrap_or(0.0).cos();
            place.push(place[place.len() - 1] + length * side);
        }
        let most = place.iter().fold(f64::MIN_POSITIVE, |most, p: &f64| most.max(p.abs()));
        Series {
            name: format!(
                "mode {}, {} Hz",
                mode.number,
                mode.frequency_hz.value.map_or_else(String::new, |f| format!("{f:.3}"))
            ),
            ink: Ink::number(mode.number - 1),
            style: if mode.number == 2 { Style::Dashed } else { Style::Line },
            values: place.iter().map(|p| Some(p / most)).collect(),
            ..Series::default()
        }
    });
    Plot {
        id: "mode-shapes".into(),
        title: "Mode shapes".into(),
        alternative: "Displacement from hinge to tip in each mode, as a share of the largest".into(),
        caption: "Small displacements; parts that lag behind are drawn by their part in phase.".into(),
        x: Axis::of(
            if is_stated { "distance from the hinge" } else { "links from the hinge" },
            if is_stated { "m" } else { "" },
        ),
        y: Axis { range: Some([-1.1, 1.1]), ..Axis::of("displacement over the largest", "") },
        at,
        series: series.collect(),
        ..Plot::default()
    }
}

/// The modes as `page.js` moves them.
pub fn moving(left: &Left) -> serde_json::Value {
    let modes = left.identified.iter().flat_map(|i| &i.modes);
    let lengths = left.link_lengths_m();
    let of = |mode: &Mode| {
        let link = |k: usize| {
            let link = &mode.shape[k];
            let length = if lengths.len() == mode.shape.len() { lengths[k] } else { 1.0 };
            serde_json::json!({"length": length, "ratio": link.ratio_to_first.value.unwrap_or(1.0), "phase": link.phase_to_first_rad.value.unwrap_or(0.0)})
        };
        serde_json::json!({
            "number": mode.number, "hz": mode.frequency_hz.value, "label": html::interval(&mode.frequency_hz, "Hz"),
            "links": (0..mode.shape.len()).map(link).collect::<Vec<_>>(),
        })
    };
    modes.map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turning_points_are_the_farthest_of_each_half_swing() {
        let t: Vec<f64> = (0..8).map(f64::from).collect();
        let angle = [1.1, 1.3, 1.2, 0.9, 0.5, 0.8, 1.4, 1.2];
        let found: Vec<(f64, f64)> =
            turning_points(&t, &angle, 1.0).into_iter().map(|(t, a)| (t, (10.0 * a).round())).collect();
        assert_eq!(found, [(1.0, 3.0), (4.0, 5.0), (6.0, 4.0)]);
    }

    #[test]
    fn the_estimates_stand_on_one_axis_in_the_order_of_the_methods() {
        let one = |value: f64| {
            Some(Interval { value: Some(value), sd: None, low: Some(value - 0.1), high: Some(value + 0.1) })
        };
        let estimator = |method: &str, f| Estimator { method: method.into(), frequency_hz: f, ..Estimator::default() };
        let mode = Mode {
            number: 1,
            frequency_hz: one(1.5).unwrap(),
            estimators: vec![estimator("spectrum", one(2.0)), estimator("half_power", None)],
            ..Mode::default()
        };
        let plot = estimators(&mode, Quantity::Frequency);
        assert_eq!(plot.y.rows, ["peak of the spectrum", "half-power bandwidth", "taken"]);
        assert_eq!((plot.at, plot.series[0].values.clone()), (vec![1.5, 2.0], vec![Some(3.0), Some(1.0)]));
    }
}
