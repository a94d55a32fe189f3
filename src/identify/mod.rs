//! What the data say without a model: frequencies and dampings, every estimator side by side with its interval.
//!
//! | file | method |
//! |---|---|
//! | [`spectrum`] | amplitude spectrum, interpolated peaks |
//! | [`half_power`] | bandwidth at half power (paper Eq. 28) |
//! | [`decrement`] | logarithmic decrement over all peaks (Eq. 27) |
//! | [`sinusoids`], [`pencil`], [`modes`] | damped sinusoids beside a drift by least squares, started from a matrix pencil; one mode or two |
//! | `close_pair` | two modes that are one line of the spectrum |
//! | `rest` | an end in which nothing swings any more |
//! | [`tumbling`] | a motion that is no swing about rest: no modes |
//! | [`windows`], [`envelope`], [`decay_law`] | frequency and damping as functions of amplitude |
//! | [`modulated`], `slow_flow` | the same over the whole record at once, where one oscillation describes it |
//! | [`estimators`], [`damping`], [`Mode`] | all of them side by side, and which to take |
//! | [`equivalents`] | K_eq, C_eq (Eq. 29, 30) |
//! | [`mod@floor`] | the frequency below which nothing hung can swing |
//! | [`consistency`] | whether the estimators agree |

pub mod abrupt;
mod close_pair;
pub mod consistency;
pub mod damping;
pub mod decay_law;
pub mod decrement;
mod driven;
pub mod envelope;
pub mod equivalents;
pub mod estimate;
pub mod estimators;
mod excess;
pub mod floor;
pub mod half_power;
mod mode;
pub mod modes;
pub mod modulated;
pub mod pencil;
mod pendulum;
pub mod pole;
mod numerics;
mod outliers;
mod projection;
mod rest;
pub mod signal;
pub mod sinusoids;
mod slow_flow;
pub mod spectrum;
mod summary;
mod table;
pub mod tumbling;
mod unit;
pub mod windows;

use std::borrow::Cow;

use serde::Serialize;

pub use damping::{Damping, Trend};
pub use estimate::Estimate;
pub use estimators::{Estimator, Method};
pub use mode::{LinkMotion, Mode};

use crate::error::Result;
use crate::experiment::{Experiment, Rig};
use crate::model::chain::Chain;
use crate::series::{AngleSeries, Measured};
use abrupt::AbruptChange;
use envelope::PENDULUM;
use equivalents::Equivalents;
use estimators::Whole;
use floor::Floor;
use modes::{Chosen, ModeCount};
use modulated::Modulated;
use signal::{LinkSamples, Signal};
use spectrum::Spectrum;
use tumbling::Tumbling;
use windows::Windows;

/// Farthest that the angle at rest of what hangs can move, rad: it rests within a quarter turn of the vertical.
const MOST_DRIFT_RAD: f64 = std::f64::consts::FRAC_PI_2;
/// A value whose own standard deviation is so many times the usual one is left out: all values count alike here, and its weight should be a twenty-fifth.
const UNSURE: f64 = 5.0;

/// What was recorded.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Record {
    /// Where it came from.
    pub source: String,
    /// Rows of the table.
    pub rows: usize,
    /// Values of each angle that are used.
    pub values: Vec<usize>,
    /// From the first row to the last.
    pub duration_s: f64,
    /// Median step.
    pub step_s: f64,
    /// Share of steps that differ from it by more than 5 %.
    pub irregular_share: f64,
    /// Root mean square of what the modes leave of each angle, noise included; at most the noise that neighbouring values show, where a mode leaves more than noise.
    pub noise_rad: Vec<f64>,
    /// Whether the times are 0, 1, 2, … or go on so from another number.
    pub counts: bool,
    /// Angles, or a displacement.
    #[serde(skip)]
    pub measured: Measured,
}

impl Record {
    fn doubt(&self) -> Option<String> {
        self.counts.then(|| "t_s counts by ones: is it a frame number? Then divide it by the frame rate".to_owned())
    }
}

/// Everything the data say without a model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Identification {
    /// `freeswing.identify/1`.
    pub schema: &'static str,
    /// The answer in one line: each mode's frequency and ξ, the strongest first, or why there is none.
    pub summary: String,
    /// What was recorded.
    pub record: Record,
    /// Its spectrum.
    pub spectrum: Spectrum,
    /// Until when it is held still at first, as by a hand; only what follows is identified.
    pub held_until_s: Option<f64>,
    /// From when on nothing swings any more, where that is a part of the record; only what precedes is identified.
    pub rests_from_s: Option<f64>,
    /// When the swing changes at once, by a touch or by frames that are missing.
    pub abrupt_changes: Vec<AbruptChange>,
    /// From when to when the record is identified: without what is held, rests or tumbles, and where the swing changes at once the longest part between such changes.
    pub used_s: [f64; 2],
    /// What keeps it from being a swing; then there are no modes.
    pub tumbling: Option<Tumbling>,
    /// How far each link's resting angle moves over the record, no part of any mode; zero where the data do not ask for a drift.
    pub drift_rad: Vec<f64>,
    /// How many modes it shows; absent when nothing oscillates.
    pub mode_count: Option<ModeCount>,
    /// The strongest first; empty when nothing oscillates.
    pub modes: Vec<Mode>,
    /// Number of the mode that `floor` and `equivalents` follow: the strongest in which all links move together, as a hanging body's slowest mode does.
    pub swing_mode: Option<usize>,
    /// Needs the experiment file.
    pub floor: Option<Floor>,
    /// Needs the experiment file.
    pub equivalents: Option<Equivalents>,
    /// Lines that only a forward model tells from harmonics of the slowest mode: a fit may begin with them.
    #[serde(skip)]
    pub may_be_harmonics: Vec<Mode>,
    /// What the reader should know.
    pub notes: Vec<String>,
}

/// Identifies a recording; the experiment file adds the floor and the equivalent constants.
///
/// # Errors
/// [`crate::Error::Simulation`] when the experiment's specimen cannot swing. What the data cannot tell is no error but says so in the result.
pub fn identify(series: &AngleSeries, experiment: Option<&Experiment>) -> Result<Identification> {
    let body = experiment.map(|e| Ok(Body { experiment: e, chain: Chain::of(&e.specimen)? })).transpose()?;
    let whole = series;
    let (series, [held_until_s, caught_s]) = free(series);
    let (series, unsure) = sure(series, Measured::Angles);
    let series = &*series;
    let signal = Signal::of(series);
    let mut found = Identification::of_record(whole, series, &signal, Measured::Angles);
    found.notes.extend(unsure);
    found.held_until_s = held_until_s;
    found.rests_from_s = caught_s;
    found.tumbling = Tumbling::of(&signal);
    Ok(found.with_modes(signal, &stated_rad(series), body.as_ref()))
}

/// The part of a series in which nothing is held, until when it is held before, and from when on after it.
fn free(series: &AngleSeries) -> (Cow<'_, AngleSeries>, [Option<f64>; 2]) {
    let (held_until_s, free) = match series.let_go() {
        Some((held_s, free)) => (Some(held_s), Cow::Owned(free)),
        None => (None, Cow::Borrowed(series)),
    };
    match free.caught() {
        Some((caught_s, swing)) => (Cow::Owned(swing), [held_until_s, Some(caught_s)]),
        None => (free, [held_until_s, None]),
    }
}

/// A series without the values of which the table itself says that they are hardly known, and what to say of that.
fn sure(series: Cow<'_, AngleSeries>, measured: Measured) -> (Cow<'_, AngleSeries>, Vec<String>) {
    let Some((sure, counts)) = series.without_unsure(UNSURE) else { return (series, Vec::new()) };
    let said = |(link, count): (usize, &usize)| {
        let values = if *count == 1 { "value has" } else { "values have" };
        let name = measured.name(link);
        format!("{name}: {count} {values} a standard deviation of more than {UNSURE:.0} times the usual one: left out")
    };
    (Cow::Owned(sure), counts.iter().enumerate().filter(|(_, count)| **count > 0).map(said).collect())
}

/// Identifies the displacement of one mark, over [`crate::series::PX_PER_RAD`].
pub fn identify_displacement(series: &AngleSeries) -> Identification {
    let whole = series;
    let (series, [held_until_s, rests_from_s]) = free(series);
    let (series, unsure) = sure(series, Measured::Displacement);
    let series = &*series;
    let signal = Signal::of(series);
    let mut found = Identification::of_record(whole, series, &signal, Measured::Displacement);
    found.notes.extend(unsure);
    Identification { held_until_s, rests_from_s, ..found }.with_modes(signal, &stated_rad(series), None)
}

/// The usual standard deviation of each link's values, where the table has one.
fn stated_rad(series: &AngleSeries) -> Vec<Option<f64>> {
    (0..series.links()).map(|link| series.usual_sd_rad(link)).collect()
}

impl Identification {
    /// As JSON where a displacement was measured: keys that end in `_rad` end in `_px`.
    pub fn json_in_px(&self) -> serde_json::Value {
        // numbers, strings and lists of them cannot fail to serialise
        unit::in_px(serde_json::to_value(self).unwrap_or_default())
    }
}

/// What swings, where the experiment file tells it.
struct Body<'a> {
    experiment: &'a Experiment,
    chain: Chain,
}

impl Identification {
    /// What can be said of a whole recording, and of the series in it of which more is said, before anything is fitted.
    fn of_record(whole: &AngleSeries, series: &AngleSeries, signal: &Signal, measured: Measured) -> Self {
        let record = Record {
            source: series.path.display().to_string(),
            rows: whole.len(),
            values: signal.links.iter().map(|l| l.t_s.len()).collect(),
            duration_s: whole.duration_s(),
            step_s: series.step_s(),
            irregular_share: series.irregular_share(),
            noise_rad: Vec::new(),
            counts: series.t_s.windows(2).all(|pair| pair[1] - pair[0] == 1.0)
                && series.t_s.first().is_some_and(|t| t.fract() == 0.0),
            measured,
        };
        let spectrum = Spectrum::of(&signal.levelled(), record.irregular_share);
        Self {
            schema: "freeswing.identify/1",
            summary: String::new(),
            held_until_s: None,
            rests_from_s: None,
            abrupt_changes: Vec::new(),
            used_s: signal.span_s,
            tumbling: None,
            drift_rad: Vec::new(),
            swing_mode: None,
            notes: record_notes(&record, &spectrum),
            record,
            spectrum,
            mode_count: None,
            modes: Vec::new(),
            may_be_harmonics: Vec::new(),
            floor: None,
            equivalents: None,
        }
    }

    /// With what swings; `stated_rad` is the table's own standard deviation of each link's values.
    fn with_modes(mut self, signal: Signal, stated_rad: &[Option<f64>], body: Option<&Body>) -> Self {
        let rests_from_s = rest::rests_from_s(&signal, stated_rad);
        let signal = match rests_from_s {
            None => signal,
            Some(rest_s) => self.only(signal.until(rest_s)),
        };
        self.rests_from_s = rests_from_s.or(self.rests_from_s);
        match self.swing_of(signal) {
            Ok((signal, chosen)) => {
                let (signal, chosen) = self.between_changes(signal, chosen);
                self.used_s = signal.span_s;
                self.add_modes(&signal, chosen, body);
            }
            Err(reason) => self.notes.push(format!("{}{reason}", summary::NOTHING)),
        }
        self.summary = summary::summary(&self);
        self
    }

    /// A part of the record, whose spectrum is then the one that counts.
    fn only(&mut self, part: Signal) -> Signal {
        self.spectrum = Spectrum::of(&part.levelled(), self.record.irregular_share);
        part
    }

    /// The part of the record that is a swing, with its modes; or why there is none.
    fn swing_of(&mut self, signal: Signal) -> std::result::Result<(Signal, Chosen), String> {
        let signal = match &self.tumbling {
            None => signal,
            Some(tumbling) => {
                let from_s = tumbling.swings_from_s.ok_or_else(|| tumbling.statement.clone())?;
                self.notes.push(tumbling.statement.clone());
                self.only(signal.from(from_s))
            }
        };
        let signal = self.without_outliers(signal);
        let chosen = modes::choose_modes(&signal, &self.spectrum, self.record.measured)?;
        Ok((signal, chosen))
    }

    /// The longest part between changes at once, with its modes, where there are such.
    fn between_changes(&mut self, signal: Signal, chosen: Chosen) -> (Signal, Chosen) {
        let changes = abrupt::changes(&signal, &chosen.fit);
        if changes.is_empty() {
            return (signal, chosen);
        }
        let used_s = abrupt::longest_part_s(&signal, &changes, chosen.fit.poles[0].frequency_hz().recip());
        let part = signal.from(used_s[0]).until(used_s[1]);
        let spectrum = Spectrum::of(&part.levelled(), self.record.irregular_share);
        let of_part = modes::choose_modes(&part, &spectrum, self.record.measured);
        self.abrupt_changes = changes;
        match of_part {
            Ok(of_part) => {
                self.spectrum = spectrum;
                (part, of_part)
            }
            Err(_) => (signal, chosen),
        }
    }

    fn without_outliers(&mut self, signal: Signal) -> Signal {
        let Some((kept, counts)) = signal.without_outliers() else { return signal };
        for (link, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
            let stand = if *count == 1 { "value stands" } else { "values stand" };
            let name = self.record.measured.name(link);
            self.notes.push(format!("{name}: {count} {stand} apart from the neighbours: left out"));
        }
        self.only(kept)
    }

    fn add_modes(&mut self, recorded: &Signal, chosen: Chosen, body: Option<&Body>) {
        let Chosen { fit, count, third_rad } = chosen;
        let modulated = Modulated::of(recorded, &fit, self.record.measured);
        // a wide swing is no sinusoid of one frequency, and slow terms beside one make up for that
        let needs_no_drift = modulated.as_ref().is_some_and(|own| own.drift_terms == 0);
        let fit = if needs_no_drift { fit.with_drift_terms(recorded, 0) } else { fit };
        self.drift_rad = fit.drift_ranges_rad(recorded);
        self.note_impossible_drift();
        let signal = &fit.without_drift(recorded);
        let windows = Windows::of(signal, &fit);
        self.record.noise_rad = match (&windows, &modulated) {
            (_, Some(modulated)) => modulated.noise_rad.clone(),
            (Ok(windows), _) => windows.noise_rad.clone(),
            (Err(_), None) => fit.links.iter().map(|l| l.noise_rad).collect(),
        };
        let whole = Whole {
            signal,
            spectrum: &self.spectrum,
            fit: &fit,
            windows: &windows,
            modulated: modulated.as_ref(),
            noise_rad: &self.record.noise_rad,
            measured: self.record.measured,
            third_rad,
        };
        let gravity_m_s2 = body.map_or(Rig::default().gravity_m_s2, |b| b.experiment.rig.gravity_m_s2);
        let same_links = body.map(|b| &b.chain).filter(|chain| chain.count() == signal.links.len());
        let mut modes: Vec<Mode> =
            (0..fit.poles.len()).map(|m| Mode::of(&whole, m, same_links, gravity_m_s2)).collect();
        modes.sort_by(|a, b| b.rms_rad.total_cmp(&a.rms_rad));
        let modes = self.resolved_modes(modes);
        if modes.is_empty() {
            return;
        }
        self.bound_noise(&modes, signal);
        self.modes = modes.into_iter().enumerate().map(|(k, mode)| mode.numbered(k + 1)).collect();
        self.mode_count = Some(count);
        let swing = self.modes.iter().position(Mode::moves_together).unwrap_or(0);
        self.swing_mode = Some(swing + 1);
        if body.is_some() && same_links.is_none() {
            let message = "the experiment file has another number of links than the table; its own links make the floor and the equivalents";
            self.notes.push(message.to_owned());
        }
        if let Some(body) = body {
            self.add_equivalents(body, swing);
        }
        let findings = self.modes.iter().flat_map(|m| m.notes.iter().cloned());
        self.notes.extend(findings);
        if signal.links.len() == 1 {
            self.notes.extend(close_pair::of_one_link(&self.modes));
        }
    }

    /// A note of each angle at rest that moves farther than what hangs can.
    fn note_impossible_drift(&mut self) {
        let measured = self.record.measured;
        let angles = self.drift_rad.iter().enumerate().filter(|_| measured == Measured::Angles);
        let notes = angles.filter(|(_, drift_rad)| **drift_rad > MOST_DRIFT_RAD).map(|(link, drift_rad)| {
            format!(
                "{}: its angle at rest moves by {}, as that of nothing that hangs does: a mark was lost, or another taken for it; look with `track --overlay`, and leave that part out with --from or --until",
                measured.name(link),
                measured.show(*drift_rad, 0)
            )
        });
        let notes: Vec<String> = notes.collect();
        self.notes.extend(notes);
    }

    /// The modes without those that may be the harmonic of a large swing, and those without one frequency; a note says so of each.
    fn resolved_modes(&mut self, modes: Vec<Mode>) -> Vec<Mode> {
        let (harmonics, modes): (Vec<Mode>, Vec<Mode>) = modes.into_iter().partition(|mode| mode.may_be_harmonic);
        self.notes.extend(harmonics.iter().map(|mode| {
            format!(
                "the line at {:.3} Hz lies on the third harmonic of the slowest mode, and goes with it or is no stronger than that may be: only a forward model tells whether a mode is there, or a smaller swing, as with --from",
                mode.frequency_hz.value
            )
        }));
        self.may_be_harmonics = harmonics;
        let (modes, open): (Vec<Mode>, Vec<Mode>) = modes.into_iter().partition(Mode::is_resolved);
        let alone = if modes.is_empty() { summary::NOTHING } else { "" };
        self.notes.extend(open.iter().map(|mode| {
            format!(
                "{alone}a motion near {:.3} Hz has no one frequency: what it depends on, amplitude or another mode, is not separated from it",
                mode.frequency_hz.value
            )
        }));
        modes
    }

    /// Takes for noise no more than neighbouring values differ by where modes leave more: a wide swing is no sum of a few sinusoids.
    fn bound_noise(&mut self, modes: &[Mode], signal: &Signal) {
        let of_values = |link: &LinkSamples| {
            crate::series::noise::of_angle(&link.t_s, &link.theta_rad.iter().copied().map(Some).collect::<Vec<_>>())
        };
        if modes.iter().any(|mode| mode.residual_excess > 1.0) {
            let least = signal.links.iter().map(of_values);
            self.record.noise_rad.iter_mut().zip(least).for_each(|(noise, least)| *noise = noise.min(least));
        }
    }

    /// The floor of the limp strip, or of given links with free joints, and the joint's equivalents, from the mode in which all links swing together.
    fn add_equivalents(&mut self, body: &Body, swing: usize) {
        let Some(swing) = self.modes.get(swing) else { return };
        let gravity_m_s2 = body.experiment.rig.gravity_m_s2;
        let frequency_hz = swing.small_amplitude_hz(swing.expected_kappa_per_rad2.unwrap_or(PENDULUM));
        let damping_ratio = swing.damping.estimate().copied();
        let floor = Floor::of(&body.experiment.specimen, &body.chain, gravity_m_s2, frequency_hz);
        self.notes.extend(floor.below.then(|| floor.statement.clone()));
        self.floor = Some(floor);
        self.equivalents = Some(Equivalents::of(&body.chain, gravity_m_s2, frequency_hz, damping_ratio));
    }
}

fn record_notes(record: &Record, spectrum: &Spectrum) -> Vec<String> {
    let mut notes: Vec<String> = record.doubt().into_iter().collect();
    if record.irregular_share > 0.02 {
        notes.push(format!(
            "{:.0} % of the time steps are irregular: least-squares methods use the exact times, the spectrum is interpolated to an even step and its peaks refined on the exact times",
            100.0 * record.irregular_share
        ));
    }
    if spectrum.missing_share > 0.02 {
        notes.push(format!("{:.0} % of the record is missing; gaps carry no weight", 100.0 * spectrum.missing_share));
    }
    notes
}
