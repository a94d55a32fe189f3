//! How fast the recording swings beside how fast the specimen would: a wrong length, time base or unit, in words.

use std::f64::consts::{FRAC_PI_2, PI};

use super::start_values::{slow_mode_hz, undamped};
use super::{Record, Seen};
use crate::error::{Error, Result};
use crate::experiment::Experiment;
use crate::model::modes::Mode;
use crate::statistics::median;

/// Below this share the air that swings along, a joint or a clock may be the reason: it is said beside them (judgement).
const LARGE: f64 = 0.15;
/// Below this share a difference is no news: half a millimetre in a quarter of a metre (judgement).
const SMALL: f64 = 0.001;
/// Below this share it is told to five digits (judgement).
const NEAR: f64 = 0.1;
/// Beyond this ratio no motion of the model can follow the recording at all, and its least squares mean nothing (judgement). Units differ by more: a square
/// root of 39 for inches, of 100 and of 1000 for centimetres and millimetres.
const HOPELESS: f64 = 5.0;
/// A factor is that of a unit within this share (judgement).
const UNIT: f64 = 0.05;
/// Lengths stated in these units stand in metres this many times too large.
const LENGTH_UNITS: [(f64, &str); 4] =
    [(1000.0, "millimetres"), (100.0, "centimetres"), (39.37, "inches"), (3.281, "feet")];
/// Stamps in these units stand in seconds this many times too large.
const TIME_UNITS: [(f64, &str); 3] = [(1e6, "microseconds"), (1e3, "milliseconds"), (1.0 / 60.0, "minutes")];
/// Frames per second of a slow-motion film, over those it plays at (judgement: what cameras usually offer).
const SLOW_MOTIONS: [f64; 5] = [2.0, 4.0, 8.0, 16.0, 32.0];
/// An angle whose median is nearer to 180° than this, and that is never as near to zero, swings about 180° (judgement).
const UPWARD: f64 = 0.5;
/// Ratios of amplitudes that differ by less than this share are the same (judgement).
const SHAPE: f64 = 0.1;
/// Angles swing together, or against each other, within this phase (rad; judgement).
const IN_PHASE: f64 = 0.3;

/// The frequencies of the slow mode, seen and modelled.
#[derive(Debug, Clone, PartialEq)]
pub struct Pace {
    /// As seen, at small amplitude.
    pub seen_hz: f64,
    /// Of the specimen with the joints as they are, or as stiff or as soft as they may be, whichever comes nearest.
    pub model_hz: f64,
    /// Half the 95 % interval of the ratio, as a share.
    half: f64,
    length_m: f64,
    links: usize,
    gravity_m_s2: f64,
    /// Where the angles look like degrees, in words.
    degrees: Option<String>,
    /// Where the slow mode's angles have a turned sign, stand in the wrong columns, or are from one link to the next.
    order: Option<String>,
    /// The angles reach beyond 90°: the frequency of a small swing says nothing about the specimen.
    beyond_small: bool,
}

impl Pace {
    /// Of what a recording shows and what an experiment's specimen does.
    pub fn of(seen: &Seen, experiment: &Experiment) -> Option<Self> {
        let [low_hz, high_hz] = slow_mode_hz(experiment)?;
        let seen_hz = seen.slow.frequency_hz;
        let modes = undamped(experiment);
        let slow = modes.as_ref().and_then(|modes| modes.first());
        Some(Self {
            seen_hz,
            model_hz: seen_hz.clamp(low_hz, high_hz),
            half: seen.slow.frequency_half_hz / seen_hz,
            length_m: experiment.specimen.lengths_m().iter().sum(),
            links: experiment.specimen.lengths_m().len(),
            gravity_m_s2: experiment.rig.gravity_m_s2,
            degrees: slow.and_then(|slow| degrees(seen, slow.frequency_hz)),
            order: slow.and_then(|slow| order(seen, slow, experiment)),
            beyond_small: seen.slow.amplitude_rad > FRAC_PI_2,
        })
    }

    /// How many times as fast as the specimen the recording swings.
    pub fn ratio(&self) -> f64 {
        self.seen_hz / self.model_hz
    }

    /// Whether the two differ by more than the recording leaves open.
    pub fn differs(&self) -> bool {
        !self.beyond_small && (self.ratio() - 1.0).abs() > SMALL.max(2.0 * self.half)
    }

    /// What differs and what would explain it; `None` where nothing does.
    pub fn statement(&self) -> Option<String> {
        let pace = self.differs().then(|| self.explained());
        let parts: Vec<String> = pace.into_iter().chain(self.degrees.clone().or_else(|| self.order.clone())).collect();
        (!parts.is_empty()).then(|| parts.join(" "))
    }

    fn explained(&self) -> String {
        let ratio = self.ratio();
        let (times, way) = if ratio > 1.0 { (ratio, "faster") } else { (1.0 / ratio, "slower") };
        let body = if self.links == 1 { "a pendulum" } else { "a specimen" };
        // a small difference needs more digits
        let digits = |value: f64| significant(value, if times - 1.0 < NEAR { 5 } else { 3 });
        let by = digits(times);
        let mut text = format!(
            "The recording swings {by} times {way} than {body} of {} m as the file describes it ({:.4} Hz, {:.4} Hz): ",
            digits(self.length_m),
            self.seen_hz,
            self.model_hz
        );
        let length = 1.0 / (ratio * ratio);
        text += &format!("{} m would", digits(self.length_m * length));
        let near = |factor: f64, of: f64| (factor / of - 1.0).abs() < UNIT;
        match LENGTH_UNITS.iter().find(|(factor, _)| near(1.0 / length, *factor)) {
            Some((_, unit)) => text += &format!(" (the lengths look like {unit})"),
            None => text += ", if the lengths are wrong or in another unit",
        }
        text += &format!("; or the time base is: true time would be {} times the stamps", digits(ratio));
        if let Some((_, unit)) = TIME_UNITS.iter().find(|(factor, _)| near(ratio, 1.0 / factor)) {
            text += &format!(" (t_s looks like {unit})");
        } else if let Some(frames) = SLOW_MOTIONS.iter().find(|frames| near(ratio, 1.0 / **frames)) {
            text += &format!(" (slow motion, played {frames} times slower?)");
        } else if let Some(frames) = SLOW_MOTIONS.iter().find(|frames| near(ratio, **frames)) {
            text += &format!(" (only one frame in {frames} kept, or a time lapse?)");
        }
        text +=
            &format!("; or gravity is {} m/s², not {}", digits(self.gravity_m_s2 * ratio * ratio), self.gravity_m_s2);
        text += "; or the masses and inertias are not as stated";
        if (ratio - 1.0).abs() < LARGE {
            text += "; or an effect is missing that changes the frequency (added_mass, hinge_stiffness)";
        }
        text + "."
    }
}

/// Before a fit: a recording whose pace no motion of the model comes near cannot be fitted.
///
/// # Errors
/// [`Error::Table`] with the factor, where nothing in the recording swings within a factor of five of the specimen; where angles are counted from the upward vertical.
pub fn check_frequency(record: &Record, seen: &Seen, experiment: &Experiment) -> Result<()> {
    if let Some(link) = (0..record.links()).find(|link| is_upward(record, *link)) {
        let message = format!(
            "cannot be fitted. θ{} swings about 180°: it is counted from the upward vertical, and freeswing wants angles from the downward one; subtract π",
            link + 1
        );
        return Err(Error::Table { path: record.path.clone(), line: None, message });
    }
    let Some(pace) = Pace::of(seen, experiment) else { return Ok(()) };
    let is_near = |hz: f64| (hz / pace.model_hz).ln().abs() < HOPELESS.ln();
    if pace.beyond_small || is_near(pace.seen_hz) || seen.peaks_hz.iter().any(|hz| is_near(*hz)) {
        return Ok(());
    }
    let message = format!("cannot be fitted. {}", pace.explained());
    Err(Error::Table { path: record.path.clone(), line: None, message: message.trim_end_matches('.').to_owned() })
}

/// Whether an angle swings about 180°, never reaching the downward vertical.
fn is_upward(record: &Record, link: usize) -> bool {
    let mut sizes: Vec<f64> = record.theta_rad[link].iter().flatten().map(|angle| angle.abs()).collect();
    let least = sizes.iter().copied().fold(f64::INFINITY, f64::min);
    median(&mut sizes).is_some_and(|middle| (middle - PI).abs() < UPWARD && least > UPWARD)
}

/// Before a diagnosis: angles that no specimen as described can have in its slow mode, which would be taken for missing effects.
///
/// # Errors
/// [`Error::Table`] where a sign is turned, columns are exchanged or angles are from one link to the next.
pub fn check_angles(record: &Record, seen: &Seen, experiment: &Experiment) -> Result<()> {
    let in_slow_mode = Pace::of(seen, experiment).filter(|pace| (pace.ratio() - 1.0).abs() < NEAR);
    in_slow_mode.and_then(|pace| pace.order).map_or(Ok(()), |found| {
        let message = format!("cannot be diagnosed. {found} Mend the table, or the order of the links in the file");
        Err(Error::Table { path: record.path.clone(), line: None, message })
    })
}

/// A turned sign, columns that are swapped, angles from one link to the next.
fn order(seen: &Seen, slow: &Mode, experiment: &Experiment) -> Option<String> {
    let first = slow.shape.first()?;
    let modelled: Vec<f64> =
        slow.shape.iter().map(|c| c.amplitude / first.amplitude * (c.phase_rad - first.phase_rad).cos()).collect();
    if experiment.model.effects.distributed_flexibility.is_some() || modelled.len() != seen.slow.shape.len() {
        return None;
    }
    if seen.slow.amplitude_rad > FRAC_PI_2 {
        return None;
    }
    (1..modelled.len()).find_map(|link| {
        let (measured, ratio) = (seen.slow.shape[link], modelled[link]);
        let (upper, lower) = (link, link + 1);
        let near = |value: f64| (value / ratio - 1.0).abs() < SHAPE;
        let size = measured.norm();
        let against = (PI - measured.arg().abs()).abs() < IN_PHASE;
        let together = measured.arg().abs() < IN_PHASE;
        if against && ratio > 0.0 {
            return Some(format!(
                "In the slow mode θ1 and θ{lower} swing against each other, and in the specimen as described together: the sign of one of the angles is turned."
            ));
        }
        if !together || near(size) || modelled.len() > 2 {
            return None;
        }
        if near(1.0 / size) {
            return Some(format!(
                "In the slow mode θ{lower} is {size:.2} times θ{upper}, where the described specimen has {ratio:.2} times: the columns look swapped."
            ));
        }
        near(1.0 + size).then(|| format!(
            "In the slow mode θ{lower} is {size:.2} times θ{upper}, where the described specimen has {ratio:.2} times: θ{lower} looks like the angle from link to link; freeswing wants it from the vertical."
        ))
    })
}

/// A swing of this angle in radians would be slower by T/T₀ = 1/agm(1, cos A/2). Where the frequency is seen to fall with the amplitude, and by nearer that than
/// what as many degrees do (in ratio), the angles are no degrees.
fn degrees(seen: &Seen, model_hz: f64) -> Option<String> {
    let amplitude_rad = seen.slow.amplitude_rad.min(3.0);
    let slowed = |amplitude_rad: f64| agm(1.0, (0.5 * amplitude_rad).cos());
    let (in_radians, in_degrees) = (1.0 - slowed(amplitude_rad), 1.0 - slowed(amplitude_rad.to_radians()));
    let as_small = (seen.slow.mean_frequency_hz / model_hz - 1.0).abs();
    let fall_hz = seen.slow.frequency_hz - seen.slow.mean_frequency_hz;
    let falls_as_radians =
        fall_hz > seen.slow.frequency_half_hz && (fall_hz / seen.slow.frequency_hz).powi(2) > in_radians * in_degrees;
    (in_radians > 0.03 && as_small < 0.2 * in_radians && !falls_as_radians).then(|| {
        format!(
            "The recording swings at {:.4} Hz as small angles do, although they reach {amplitude_rad:.1}: in radians it would be {:.4} Hz. The angles look like degrees, if lengths and time base are right; multiply them by π/180.",
            seen.slow.mean_frequency_hz,
            slowed(amplitude_rad) * model_hz
        )
    })
}

/// Arithmetic-geometric mean.
fn agm(mut a: f64, mut b: f64) -> f64 {
    for _ in 0..20 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    a
}

/// So many significant digits.
fn significant(value: f64, digits: i32) -> String {
    let magnitude = value.abs().max(1e-12).log10().floor() as i32;
    if !(-4..6).contains(&magnitude) {
        return format!("{value:.2e}");
    }
    let text = format!("{value:.*}", (digits - 1 - magnitude).max(0) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
