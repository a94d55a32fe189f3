//! Does the model reproduce the recording? The question the paper asks by eye (its Fig. 19), answered with numbers.

use super::Residuals;

/// A window whose mean square exceeds the noise's by chance less often than this, all windows taken together, is a misfit.
const CHANCE: f64 = 1e-3;

/// The noise itself is known to about this share.
const NOISE_SHARE: f64 = 0.1;

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
        let windows: Vec<Window> = (0..count)
            .map(|k| {
                let (from_s, until_s) = (first_s + k as f64 * length_s, first_s + (k + 1) as f64 * length_s);
                let link = |link: usize| {
                    let inside = |r: &&super::Residual| r.t_s >= from_s && (r.t_s < until_s || k + 1 == count);
                    let values: Vec<super::Residual> = residuals.values[link].iter().filter(inside).copied().collect();
                    judge(&values, residuals.noise_rad[link], CHANCE / (count * links) as f64)
                };
                Window { from_s, until_s, links: (0..links).map(link).collect() }
            })
            .collect();
        let departs = departure(&windows);
        let ratio = (0..links).map(|l| residuals.rmse_rad[l] / residuals.noise_rad[l].max(1e-300)).collect();
        Self { departs, peaks: residuals.values.iter().map(|values| peaks(values)).collect(), windows, ratio }
    }

    /// In words: reproduced or not, from which second on, at which amplitude, how far the phase drifts.
    pub fn statement(&self) -> String {
        let Some(departure) = self.departs else {
            return "reproduced: in no window does the residual exceed the noise.".to_owned();
        };
        let Departure { link, from_s, amplitude_rad, rms_rad, share } = departure;
        let last = self.windows.iter().rev().find_map(|w| w.links.get(link)).copied();
        let drift = last.map_or(String::new(), |l| {
            format!(" At the end the recording is {:+.1} ms late and {:+.1} % larger.", 1e3 * l.lag_s, 1e2 * l.gain)
        });
        format!(
            "not reproduced: from {from_s:.2} s on, at an amplitude of {amplitude_rad:.3} rad, θ{} differs by {:.2} mrad rms; {:.0} % of the windows from there on exceed the noise.{drift}",
            link + 1,
            1e3 * rms_rad,
            1e2 * share,
        )
    }

    /// Whether no window is a misfit.
    pub fn is_reproduced(&self) -> bool {
        self.departs.is_none()
    }
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
