//! Does the model reproduce the recording? The question the paper asks by eye (its Fig. 19), answered with numbers.

use super::noise_beside_swing::noise_beside_swing;
use super::{Ending, Fit, Residuals};
use crate::digits::fixed;
use crate::model::Parameter;

/// A window whose mean square exceeds the noise's by chance less often than this, all windows taken together, is a misfit (statistics: 0.1 %).
const CHANCE: f64 = 1e-3;

/// The noise itself is known to about this share (judgement).
const NOISE_SHARE: f64 = 0.1;

/// A model that reproduces a recording explains this part of each angle's variance; where the noise is more than the rest, nobody can tell (judgement).
const EXPLAINED: f64 = 0.9;
/// Fewer swings than this are told by their start alone (judgement).
const FEWEST_SWINGS: f64 = 2.0;
/// A swing is seen where it crosses the middle by this many times the noise to either side (statistics: 3 σ).
const CROSSING: f64 = 3.0;

/// Errors of a clock and of a scale that a camera may have (judgement).
const CLOCK: f64 = 0.05;
const GAIN: f64 = 0.3;
/// A camera set up by eye before a swing looks no further askew than half a right angle: a stretch or a shear of about as much as this (judgement: half
/// the square of that angle).
const VIEW: f64 = 0.3;

/// Why a residual without a misfit is no proof that the model reproduces the recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Doubt {
    /// The recording holds only so many swings.
    TooShort { swings: f64 },
    /// The noise of an angle is this part of its variance.
    TooNoisy { link: usize, share: f64 },
    /// The model explains only this part of an angle's variance.
    LittleExplained { link: usize, share: f64 },
    /// The fit was given up before it had converged.
    NotConverged,
    /// A clock or a gain so far off is none.
    Implausible { id: &'static str, value: f64 },
}

impl Doubt {
    /// Whether it is about the recording, whatever the model makes of it.
    fn is_of_recording(self) -> bool {
        matches!(self, Self::TooShort { .. } | Self::TooNoisy { .. })
    }

    fn statement(self) -> String {
        match self {
            Self::TooShort { swings } => format!(
                "not judged: the recording holds {swings:.1} swings; with fewer than {FEWEST_SWINGS:.0} the initial state alone can explain it. Record longer."
            ),
            Self::TooNoisy { link, share } => format!(
                "not judged: {:.0} % of the variance of θ{} is noise, so that a misfit could not be seen. Use an earlier or a better stretch.",
                1e2 * share,
                link + 1
            ),
            Self::LittleExplained { link, share } => format!(
                "not reproduced: the model explains {:.0} % of the variance of θ{}, and does not follow the motion.",
                1e2 * share.max(0.0),
                link + 1
            ),
            Self::NotConverged => "not reproduced: the fit has not converged within its budget.".to_owned(),
            Self::Implausible { id, value } => format!(
                "not reproduced: the residual is at the level of the noise, but only with {id} = {value:.3}, which is too large for an error of a camera. Check lengths, time stamps and units."
            ),
        }
    }
}

/// The model beside the recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// One window after another.
    pub windows: Vec<Window>,
    /// The first window from which on, or within which, the model does not reproduce the recording.
    pub departs: Option<Departure>,
    /// Measured and simulated turning points of each angle, `[link]`.
    pub peaks: Vec<Vec<Peak>>,
    /// rms over noise of each angle over the whole recording.
    pub ratio: Vec<f64>,
    /// Part of each angle's variance that the model explains; negative where it adds to it.
    pub explained: Vec<f64>,
    /// Mean of each angle's residual where that is most of it.
    pub offset_rad: Vec<Option<f64>>,
    /// Why even a residual at the noise is no proof.
    pub doubt: Option<Doubt>,
}

/// Where the model leaves the recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Departure {
    /// Which angle shows it first.
    pub link: usize,
    /// Start of the window.
    pub from_s: f64,
    /// Amplitude of the angle there.
    pub amplitude_rad: f64,
    /// rms of the residual there.
    pub rms_rad: f64,
    /// Share of the windows from there on that are misfits.
    pub share: f64,
}

/// A window of about one swing.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    /// From here.
    pub from_s: f64,
    /// To here.
    pub until_s: f64,
    /// One entry an angle.
    pub links: Vec<WindowLink>,
}

/// One angle in a window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindowLink {
    /// Largest measured departure from the middle.
    pub amplitude_rad: f64,
    /// rms of the residual.
    pub rms_rad: f64,
    /// How much later the recording is than the model.
    pub lag_s: f64,
    /// Measured amplitude over simulated, less one.
    pub gain: f64,
    /// Whether the residual exceeds the noise.
    pub misfit: bool,
}

/// A turning point, measured and simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// When it was measured.
    pub t_s: f64,
    /// The angle.
    pub measured_rad: f64,
    /// The model's angle at its own turning point.
    pub simulated_rad: f64,
    /// How much later the recording turns.
    pub lag_s: f64,
}

impl Verdict {
    /// Judges the residuals of one recording in windows of `window_s`.
    ///
    /// In each window the residual is split by least squares into a delay and a gain of the simulated swing:
    ///
    /// ```text
    /// θ_measured − θ_model ≈ −lag·θ̇_model + gain·(θ_model − mean)
    /// ```
    pub fn of(residuals: &Residuals, window_s: f64) -> Self {
        let links = residuals.values.len();
        let stamps = residuals.values.iter().flatten().map(|r| r.t_s);
        let (first_s, last_s) = stamps.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)));
        let count = (((last_s - first_s) / window_s).floor() as usize).max(1);
        let length_s = (last_s - first_s) / count as f64;
        let of_link = residuals.values.iter().zip(&residuals.noise_rad);
        let noise_rad: Vec<f64> = of_link.map(|(values, own)| noise_beside_swing(values, *own, length_s)).collect();
        let windows: Vec<Window> = (0..count)
            .map(|k| {
                let (from_s, until_s) = (first_s + k as f64 * length_s, first_s + (k + 1) as f64 * length_s);
                let link = |link: usize| {
                    let inside = |r: &&super::Residual| r.t_s >= from_s && (r.t_s < until_s || k + 1 == count);
                    let values: Vec<super::Residual> = residuals.values[link].iter().filter(inside).copied().collect();
                    judge(&values, noise_rad[link], CHANCE / (count * links) as f64)
                };
                Window { from_s, until_s, links: (0..links).map(link).collect() }
            })
            .collect();
        let departs = departure(&windows);
        let ratio = (0..links).map(|l| residuals.rmse_rad[l] / residuals.noise_rad[l].max(1e-300)).collect();
        let explained: Vec<f64> = residuals.values.iter().map(|values| explained(values)).collect();
        let peaks = residuals.values.iter().map(|values| peaks(values)).collect();
        let doubt = doubt(residuals, &explained);
        let offset_rad = residuals.values.iter().map(|values| offset_rad(values)).collect();
        Self { departs, peaks, windows, ratio, explained, offset_rad, doubt }
    }

    /// The same of a fit, which may have been given up, or have bent what nobody may bend.
    #[must_use]
    pub fn of_fit(fit: &Fit, record: usize, window_s: f64) -> Self {
        let verdict = Self::of(&fit.residuals[record], window_s);
        let of_fit = (fit.ending != Ending::Converged).then_some(Doubt::NotConverged);
        let implausible = || {
            let far = |parameter: Parameter, most: f64| {
                let value = fit.estimate(parameter)?.value;
                (value.abs() > most).then_some(Doubt::Implausible { id: parameter.id(), value })
            };
            let likely = [
                (Parameter::TimeBase, CLOCK),
                (Parameter::AngleGain, GAIN),
                (Parameter::ViewStretch, VIEW),
                (Parameter::ViewShear, VIEW),
            ];
            likely.into_iter().find_map(|(parameter, most)| far(parameter, most))
        };
        Self { doubt: verdict.doubt.or(of_fit).or_else(implausible), ..verdict }
    }

    /// In words: reproduced or not, from which second on, at which amplitude, how far the phase drifts.
    pub fn statement(&self) -> String {
        if let Some(doubt) = self.doubt.filter(|doubt| self.departs.is_none() || doubt.is_of_recording()) {
            return doubt.statement();
        }
        let Some(departure) = self.departs else {
            let least = self.explained.iter().copied().fold(1.0, f64::min);
            return format!(
                "reproduced: in no window does the residual exceed the noise, and {} of the variance is explained.",
                share(least)
            );
        };
        let Departure { link, from_s, amplitude_rad, rms_rad, share } = departure;
        // of a model that does not follow the motion neither means anything
        let follows = self.explained[link] >= EXPLAINED;
        let last = self.windows.iter().rev().find_map(|w| Some((w, *w.links.get(link)?)));
        // of what rests neither does either
        let swings =
            |(w, l): &(&Window, WindowLink)| l.lag_s.abs() < 0.5 * (w.until_s - w.from_s) && l.gain.abs() < 1.0;
        let last = last.filter(|_| follows).filter(swings).map(|(_, l)| l);
        let drift = last.map_or(String::new(), |l| {
            let when = if l.lag_s < 0.0 { "ahead of" } else { "behind" };
            let size = if l.gain < 0.0 { "smaller" } else { "larger" };
            let (lag_ms, percent) = (1e3 * l.lag_s.abs(), 1e2 * l.gain.abs());
            format!(" At the end the recording is {lag_ms:.1} ms {when} the model and {percent:.1} % {size}.")
        });
        let little = match self.explained[link] {
            explained if explained < EXPLAINED => {
                format!(" The model explains {:.0} % of the variance of θ{}.", 1e2 * explained.max(0.0), link + 1)
            }
            _ => String::new(),
        };
        let offset = self.offset_rad[link].map_or(String::new(), |offset_rad| {
            format!(
                " Most of it is a constant offset of {:.1} mrad: a tilted camera (camera_tilt), a side force (side_force), or angles that are not counted from the vertical.",
                1e3 * offset_rad
            )
        });
        format!(
            "not reproduced: from {} s on, at an amplitude of {amplitude_rad:.3} rad, θ{} differs by {:.2} mrad rms; {:.0} % of the windows from there on exceed the noise.{drift}{little}{offset}",
            fixed(from_s, 2),
            link + 1,
            1e3 * rms_rad,
            1e2 * share,
        )
    }

    /// Whether no window is a misfit and nothing speaks against it.
    pub fn is_reproduced(&self) -> bool {
        self.departs.is_none() && self.doubt.is_none()
    }
}

/// A share in per cent that never rounds to all of it.
fn share(of: f64) -> String {
    if of > 0.9999 { "more than 99.99 %".to_owned() } else { format!("{:.2} %", 1e2 * of) }
}

/// Mean of the residuals, where its square is most of theirs.
fn offset_rad(values: &[super::Residual]) -> Option<f64> {
    let n = values.len().max(1) as f64;
    let mean = values.iter().map(super::Residual::left_rad).sum::<f64>() / n;
    let square = values.iter().map(|r| r.left_rad().powi(2)).sum::<f64>() / n;
    (mean * mean > 0.5 * square).then_some(mean)
}

/// Part of the variance about the mean that the model explains.
fn explained(values: &[super::Residual]) -> f64 {
    let left: f64 = values.iter().map(|r| r.left_rad().powi(2)).sum();
    1.0 - left / (variance(values) * values.len() as f64).max(1e-300)
}

fn variance(values: &[super::Residual]) -> f64 {
    let n = values.len().max(1) as f64;
    let middle = values.iter().map(|r| r.measured_rad).sum::<f64>() / n;
    values.iter().map(|r| (r.measured_rad - middle).powi(2)).sum::<f64>() / n
}

fn doubt(residuals: &Residuals, explained: &[f64]) -> Option<Doubt> {
    let swings = |(values, noise_rad): (&Vec<super::Residual>, &f64)| swings(values, CROSSING * noise_rad);
    let swings = residuals.values.iter().zip(&residuals.noise_rad).map(swings).fold(0.0, f64::max);
    let noisy = |link: usize| {
        let share = residuals.noise_rad[link].powi(2) / variance(&residuals.values[link]).max(1e-300);
        (share > 1.0 - EXPLAINED).then_some(Doubt::TooNoisy { link, share: share.min(1.0) })
    };
    let links = 0..explained.len();
    let least = links.clone().min_by(|a, b| explained[*a].total_cmp(&explained[*b]));
    let little =
        |link: usize| (explained[link] < EXPLAINED).then_some(Doubt::LittleExplained { link, share: explained[link] });
    (swings < FEWEST_SWINGS)
        .then_some(Doubt::TooShort { swings })
        .or_else(|| links.clone().find_map(noisy))
        .or_else(|| least.and_then(little))
}

/// Swings from the first to the last crossing of the middle, which is left by some angle to either side between them.
fn swings(values: &[super::Residual], beyond_rad: f64) -> f64 {
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), r| (low.min(r.measured_rad), high.max(r.measured_rad)));
    let mean = values.iter().map(|r| r.measured_rad).sum::<f64>() / values.len().max(1) as f64;
    let beyond_rad = beyond_rad.min(0.25 * (high - low));
    let (mut crossings, mut side) = (0usize, 0.0);
    for r in values {
        let off_rad = r.measured_rad - mean;
        if off_rad.abs() > beyond_rad && off_rad.signum() != side {
            crossings += usize::from(side != 0.0);
            side = off_rad.signum();
        }
    }
    0.5 * crossings as f64
}

fn judge(values: &[super::Residual], noise_rad: f64, chance: f64) -> WindowLink {
    let n = values.len() as f64;
    if values.is_empty() {
        return WindowLink { amplitude_rad: 0.0, rms_rad: 0.0, lag_s: 0.0, gain: 0.0, misfit: false };
    }
    let mean = |of: &dyn Fn(&super::Residual) -> f64| values.iter().map(of).sum::<f64>() / n;
    let middle = mean(&|r| r.measured_rad);
    let middle_model = mean(&|r| r.predicted_rad);
    let square = mean(&|r| r.left_rad().powi(2));
    let (rr, rt, tt) = (
        mean(&|r| r.rate_rad_s.powi(2)),
        mean(&|r| r.rate_rad_s * (r.predicted_rad - middle_model)),
        mean(&|r| (r.predicted_rad - middle_model).powi(2)),
    );
    let (er, et) = (mean(&|r| r.left_rad() * r.rate_rad_s), mean(&|r| r.left_rad() * (r.predicted_rad - middle_model)));
    let determinant = (rr * tt - rt * rt).max(1e-300);
    WindowLink {
        amplitude_rad: values.iter().map(|r| (r.measured_rad - middle).abs()).fold(0.0, f64::max),
        rms_rad: square.sqrt(),
        lag_s: -(er * tt - et * rt) / determinant,
        gain: (et * rr - er * rt) / determinant,
        misfit: square > ((1.0 + NOISE_SHARE) * noise_rad).powi(2) * chi2_limit(n, chance) / n,
    }
}

/// The value that χ² of n degrees of freedom exceeds with a small chance (Wilson and Hilferty).
fn chi2_limit(n: f64, chance: f64) -> f64 {
    // the normal quantile's tail expansion, good to 1 % for chances below 10⁻²
    let t = (-2.0 * chance.ln()).sqrt();
    let z =
        t - (2.515_517 + t * (0.802_853 + t * 0.010_328)) / (1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308)));
    n * (1.0 - 2.0 / (9.0 * n) + z * (2.0 / (9.0 * n)).sqrt()).powi(3)
}

fn departure(windows: &[Window]) -> Option<Departure> {
    let wrong = |w: &Window| w.links.iter().any(|l| l.misfit);
    let first = windows.iter().position(wrong)?;
    let window = &windows[first];
    let link = window.links.iter().position(|l| l.misfit)?;
    let after = &windows[first..];
    Some(Departure {
        link,
        from_s: window.from_s,
        amplitude_rad: window.links[link].amplitude_rad,
        rms_rad: window.links[link].rms_rad,
        share: after.iter().filter(|w| wrong(w)).count() as f64 / after.len() as f64,
    })
}

/// Turning points of the measurement, each by a parabola through the values next to it, with the model's nearest.
fn peaks(values: &[super::Residual]) -> Vec<Peak> {
    let turn = |i: usize, of: &dyn Fn(&super::Residual) -> f64| -> Option<(f64, f64)> {
        let (a, b, c) = (of(&values[i - 1]), of(&values[i]), of(&values[i + 1]));
        let bend = a - 2.0 * b + c;
        let even = (values[i + 1].t_s - values[i].t_s) / (values[i].t_s - values[i - 1].t_s);
        if bend == 0.0 || !(0.7..1.4).contains(&even) {
            return None;
        }
        let shift = 0.5 * (a - c) / bend;
        let step_s = 0.5 * (values[i + 1].t_s - values[i - 1].t_s);
        Some((values[i].t_s + shift * step_s, b - 0.25 * (a - c) * shift))
    };
    let is_turn = |i: usize, of: &dyn Fn(&super::Residual) -> f64| {
        let (before, here, after) = (of(&values[i - 1]), of(&values[i]), of(&values[i + 1]));
        (here >= before && here > after) || (here <= before && here < after)
    };
    let model = |r: &super::Residual| r.predicted_rad;
    let inside = 1..values.len().saturating_sub(1);
    let simulated: Vec<(f64, f64)> =
        inside.clone().filter(|i| is_turn(*i, &model)).filter_map(|i| turn(i, &model)).collect();
    inside
        .filter(|i| is_turn(*i, &|r| r.measured_rad))
        .filter_map(|i| {
            let (t_s, measured_rad) = turn(i, &|r| r.measured_rad)?;
            let near = |p: &&(f64, f64)| (p.0 - t_s).abs() < 0.25 * spacing(&simulated);
            let (at_s, simulated_rad) =
                simulated.iter().filter(near).min_by(|a, b| (a.0 - t_s).abs().total_cmp(&(b.0 - t_s).abs()))?;
            Some(Peak { t_s, measured_rad, simulated_rad: *simulated_rad, lag_s: t_s - at_s })
        })
        .collect()
}

/// Mean distance of turning points.
fn spacing(turns: &[(f64, f64)]) -> f64 {
    match turns {
        [first, .., last] => (last.0 - first.0) / (turns.len() - 1) as f64,
        _ => f64::INFINITY,
    }
}
