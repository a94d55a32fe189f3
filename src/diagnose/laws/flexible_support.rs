//! A stand that yields: at which frequency it swings, and how much it is damped.
//!
//! Where the stand is still, no derivative tells its frequency. So a stand of each frequency is driven by the pull of a fit's own motion,
//!
//! ```text
//! ẍ/ω² + 2ζẋ/ω + x = −s Σᵢ hᵢ (cos θᵢ θ̈ᵢ − sin θᵢ θ̇ᵢ²),
//! ```
//!
//! and what its acceleration then does to the angles is one column for the compliance s, and two for a stand that already swings at the first row.

use nalgebra::DMatrix;

use super::super::effect::{Effect, SOFTEST_M_PER_N};
use super::super::linearisation::{Linearisation, motion_at};
use super::super::refit::Refit;
use super::super::screen::{Score, Screen};
use super::super::settings::{PriorSettings, Settings};
use super::{Coefficients, Law};
use crate::model::Parameter;
use crate::model::effects::support::SupportFlexibility;

/// Lowest and highest frequency, in units of the swing's, and the factor from one to the next (judgement: below, a stand is another pendulum; above, only its stiffness and
/// damping show).
const LOWEST: f64 = 0.7;
const HIGHEST: f64 = 25.0;
const FACTOR: f64 = 1.12;
/// The highest also as a part of half the rate (judgement).
const OF_NYQUIST: f64 = 0.9;
/// Damping ratios tried at each (start values).
const DAMPING_RATIOS: [f64; 3] = [0.01, 0.05, 0.2];
/// What a stand of each does to the angles: by its compliance, and by its own swing from a unit of displacement and of speed.
const COURSES: usize = 3 * DAMPING_RATIOS.len();
/// Frequencies that are kept beside the best (cost).
const FURTHER: usize = 2;

/// The law.
pub struct FlexibleSupport;

impl Law for FlexibleSupport {
    fn scan(&self, screen: &Screen<'_, '_>) -> Option<Score> {
        // the stand goes on from piece to piece, and its own swing with it
        if screen.context.is_in_pieces() || screen.context.is_strip() {
            return None;
        }
        scanned(screen)
    }

    /// A stand has a mass, and is no softer than one that a hand would find loose.
    fn is_possible(&self, fit: &Refit<'_>, _prior: &PriorSettings) -> bool {
        let Some(compliance_m_per_n) = fit.value(Parameter::SupportCompliance) else { return true };
        let Some(hz) = fit.value(Parameter::SupportOwnFrequency) else { return true };
        let Ok((model, _)) = fit.problem.model(0, &fit.x[..fit.problem.free.len()]) else { return false };
        let specimens_part = compliance_m_per_n * model.chain().mass_from_kg(0) * (std::f64::consts::TAU * hz).powi(2);
        specimens_part < 1.0 && compliance_m_per_n < SOFTEST_M_PER_N
    }

    /// Any frequency, of no likelier size than another, any damping ratio up to one, and any swing of its own within what is believed of it.
    fn ln_multiplicity(
        &self,
        fit: &Refit<'_>,
        _effect: Effect,
        of: &Coefficients<'_>,
        settings: &PriorSettings,
    ) -> f64 {
        let (hz, sd_hz) = of(Parameter::SupportOwnFrequency);
        let (_, sd) = of(Parameter::SupportDampingRatio);
        let of_shape = (hz * settings.sizes).max(sd_hz).ln() + sd.max(1.0).ln();
        of_shape + fit.problem.ln_known_of_pairs(&fit.normal)
    }

    fn odds(&self, fit: &Refit<'_>, others: &[&Refit<'_>], settings: &Settings) -> f64 {
        super::odds_of_what_completes_a_law(fit, others, settings)
    }
}

/// One recording's motion, and the pull at its pivot.
struct Pull {
    linearisation: Linearisation,
    transitions: Vec<DMatrix<f64>>,
    /// −Σ hᵢ (cos θᵢ θ̈ᵢ − sin θᵢ θ̇ᵢ²) at each row (N).
    pull_n: Vec<f64>,
}

impl Pull {
    fn of(fit: &Refit<'_>, record: usize) -> Option<Self> {
        let (model, swing, true_s) = fit.motion(record)?;
        let linearisation = Linearisation::of(fit, record)?;
        let transitions = linearisation.transitions_of_pivot();
        let at = |t_s: &f64| Some(-SupportFlexibility::pull_n(model.chain(), &motion_at(&model, &swing, *t_s)?));
        let pull_n = true_s.iter().map(at).collect::<Option<Vec<f64>>>()?;
        Some(Self { linearisation, transitions, pull_n })
    }

    /// What stands of a frequency do to the angles, each of another damping ratio.
    fn columns(&self, hz: f64) -> DMatrix<f64> {
        let stands = DAMPING_RATIOS.map(|ratio| self.accelerations(hz, ratio));
        let course = |k: usize| -> [[f64; COURSES]; 1] {
            [std::array::from_fn(|c| stands[c / 3][k].map(|at| at[c % 3]).iter().sum::<f64>() * 0.5)]
        };
        let held: Vec<[[f64; COURSES]; 1]> = (0..self.pull_n.len() - 1).map(course).collect();
        self.linearisation.seen(&self.linearisation.responses(&self.transitions, &held))
    }

    /// ẍ (m/s²) at both ends of each interval between rows: of a stand of unit compliance that begins as bent as the pull bends it, and of one that is let go a metre
    /// away, and one that passes its rest. Between rows the pull is a line F + F′τ, of which x = F + F′(τ − 2ζ/ω) is one motion; what a stand differs from it by swings freely.
    fn accelerations(&self, hz: f64, damping_ratio: f64) -> Vec<[[f64; 3]; 2]> {
        let omega = std::f64::consts::TAU * hz;
        let t_s = &self.linearisation.t_s;
        let root = (1.0 - damping_ratio * damping_ratio).sqrt();
        let swung = |[x, y]: [f64; 2], length_s: f64| {
            let (sin, cos) = (root * omega * length_s).sin_cos();
            let (sin, lag, decay) = (sin / root, damping_ratio * sin / root, (-damping_ratio * omega * length_s).exp());
            [decay * ((cos + lag) * x + sin * y), decay * ((cos - lag) * y - sin * x)]
        };
        let accelerations = |states: &[[f64; 2]; 3], pull: f64| {
            let of = |which: usize| {
                let [x, y] = states[which];
                let pull = if which == 0 { pull } else { 0.0 };
                omega * omega * (pull - x - 2.0 * damping_ratio * y)
            };
            [of(0), of(1), of(2)]
        };
        let slope = |k: usize| (self.pull_n[k + 1] - self.pull_n[k]) / (t_s[k + 1] - t_s[k]);
        // x and ẋ/ω
        let mut states = [[self.pull_n[0], slope(0) / omega], [1.0, 0.0], [0.0, 1.0]];
        let step = |k: usize| {
            let (length_s, slope) = (t_s[k + 1] - t_s[k], slope(k));
            let before = accelerations(&states, self.pull_n[k]);
            let (driven, speed) = (self.pull_n[k] - 2.0 * damping_ratio * slope / omega, slope / omega);
            let [x, y] = swung([states[0][0] - driven, states[0][1] - speed], length_s);
            let driven = driven + slope * length_s;
            states = [[driven + x, speed + y], swung(states[1], length_s), swung(states[2], length_s)];
            [before, accelerations(&states, self.pull_n[k + 1])]
        };
        (0..t_s.len() - 1).map(step).collect()
    }
}

/// A stand of each frequency and damping in turn.
fn scanned(screen: &Screen<'_, '_>) -> Option<Score> {
    let problem = &screen.fit.problem;
    let records = problem.records.len();
    let pulls = (0..records).map(|record| Pull::of(screen.fit, record)).collect::<Option<Vec<_>>>()?;
    let (model, _) = problem.model(0, &screen.fit.x[..problem.free.len()]).ok()?;
    let swing_hz = model.characteristic_rad_s() / std::f64::consts::TAU;
    let rate_hz = pulls.iter().map(|pull| pull.linearisation.mean_rate_hz()).fold(0.0, f64::max);
    let highest_hz = (HIGHEST * swing_hz).min(OF_NYQUIST * 0.5 * rate_hz);
    let frequencies_hz = std::iter::successors(Some(LOWEST * swing_hz), |hz| Some(hz * FACTOR));
    let mut scores: Vec<Score> =
        frequencies_hz.take_while(|hz| *hz <= highest_hz).flat_map(|hz| at(screen, &pulls, hz)).collect();
    scores.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let mut others = scores.into_iter();
    let best = others.next()?;
    let further = others.take(FURTHER).map(|other| other.start).collect();
    Some(Score { further, ..best })
}

/// What stands of one frequency promise, each of another damping ratio.
fn at(screen: &Screen<'_, '_>, pulls: &[Pull], hz: f64) -> Vec<Score> {
    let rows = screen.projection.residual.len();
    let seen: Vec<DMatrix<f64>> = pulls.iter().map(|pull| pull.columns(hz)).collect();
    let of = |(which, damping_ratio): (usize, &f64)| {
        // the compliance is one for all recordings, the stand's own swing each recording's
        let mut columns = DMatrix::zeros(rows, 1 + 2 * seen.len());
        let mut first = 0;
        for (record, own) in seen.iter().enumerate() {
            let count = own.nrows();
            columns.view_mut((first, 0), (count, 1)).copy_from(&own.columns(3 * which, 1));
            columns.view_mut((first, 1 + 2 * record), (count, 2)).copy_from(&own.columns(3 * which + 1, 2));
            first += count;
        }
        let mut score = screen.score(Effect::SupportFlexibility, columns, &[Parameter::SupportCompliance], None)?;
        score.start.push((Parameter::SupportOwnFrequency, hz));
        score.start.push((Parameter::SupportDampingRatio, *damping_ratio));
        Some(score)
    };
    DAMPING_RATIOS.iter().enumerate().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::base_priors::DampingAssumption;
    use crate::diagnose::preparation;
    use crate::diagnose::search::Search;
    use crate::diagnose::testing::{arm, swing};
    use crate::experiment::Experiment;
    use crate::fit::Record;
    use crate::progress::Silent;

    const DAMPED: &str = "hinge_viscous = 2e-4\n";

    /// What the scan finds beside an arm that swings on this stand, and a fit from there.
    fn found(stand: &str) -> (Score, Vec<f64>, f64, f64) {
        let settings = Settings::default();
        let (t_s, theta_rad) = swing(&arm(&format!("{DAMPED}{stand}")), 20.0, 50.0);
        // as good as random, of 0.2 mrad
        let noise = |row: usize| 3e-4 * ((row * row * 7 + row * 13) as f64).sin();
        let angles = theta_rad.into_iter().enumerate().map(|(row, theta)| Some(theta + noise(row))).collect();
        let record = Record::uniform("made", t_s, vec![angles]);
        let prepared = preparation::prepare(&[record], &arm(DAMPED), &settings).unwrap();
        let taken = DampingAssumption::AsStated;
        let search = Search::of_base_model(&prepared, &prepared.experiment, taken, &settings, &Silent).unwrap();
        let base = search.base();
        let score = FlexibleSupport.scan(&Screen::at(&search.context, base).unwrap()).unwrap();
        let fit = search.context.refit(&score.hypothesis(&base.hypothesis), base, &score.start).unwrap();
        let values = Effect::SupportFlexibility.parameters().iter().map(|own| fit.value(*own).unwrap()).collect();
        (score, values, base.chi2, fit.chi2)
    }

    #[test]
    fn a_stand_is_found_with_its_compliance_frequency_and_damping() {
        let stand = "support_flexibility = { compliance_m_per_n = 2e-3, frequency_hz = 5.0, damping_ratio = 0.04 }\n";
        let (score, values, before, after) = found(stand);
        let hz = score.start.iter().find(|own| own.0 == Parameter::SupportOwnFrequency).unwrap().1;
        assert!((hz / 5.0 - 1.0).abs() < 0.2, "{hz}");
        assert!(score.gain > 100.0 && after < before - 100.0, "{} {before} {after}", score.gain);
        let truth = [2e-3, 5.0, 0.04];
        assert!(values.iter().zip(truth).all(|(own, truth)| (own / truth - 1.0).abs() < 0.25), "{values:?}");
    }

    #[test]
    fn a_rigid_stand_promises_nothing() {
        let (score, values, before, after) = found("");
        assert!(score.gain < 30.0 && after > before - 30.0, "{} {before} {after} {values:?}", score.gain);
    }

    #[test]
    fn a_strip_of_a_gram_is_too_light_for_any_stand_to_yield() {
        let of = |mass_kg: f64| {
            let mut experiment = Experiment::default();
            experiment.specimen.mass_kg = mass_kg;
            Effect::SupportFlexibility.is_applicable(&experiment, &[], 2)
        };
        assert!(!of(0.4e-3) && of(0.1));
    }
}
