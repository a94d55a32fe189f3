//! The ways to fit a hypothesis: near another fit, anew from short stretches, or on from where it stands.

use nalgebra::DVector;
use rayon::prelude::*;

use super::context::FitContext;
use super::effect::bending_n_m2;
use super::hypothesis::Hypothesis;
use super::refit::{Refit, least_chi2};
use crate::error::Result;
use crate::experiment::Experiment;
use crate::fit::descent::Descent;
use crate::fit::shooting::{STATE_WINDOW_RAD, multiple_shooting, shooting_along};
use crate::fit::whitening::RecordNoise;
use crate::fit::{Problem, Record, transformed};
use crate::model::Parameter;
use crate::model::observe::{chord_angles_rad, chord_slopes};

/// Loss terms are nearly collinear: only with little damping of the steps does a descent move along the valley between them.
const FIRST_DAMPING: f64 = 1e-8;

/// Values of some coefficients to start from.
pub type Start = [(Parameter, f64)];

impl<'a> FitContext<'a> {
    /// Fits a hypothesis from the parameters of another fit, judged by the same noise; `start` gives values of further ones.
    pub fn refit(&self, hypothesis: &Hypothesis, near: &Refit<'_>, start: &Start) -> Option<Refit<'a>> {
        self.refit_by(self.descent(self.settings.descent.few_steps), hypothesis, near, start)
    }

    /// The same, which ends after its first steps unless they lead below `bound`.
    pub fn refit_below(
        &self,
        bound: f64,
        hypothesis: &Hypothesis,
        near: &Refit<'_>,
        start: &Start,
    ) -> Option<Refit<'a>> {
        self.refit_by(self.descent_below(bound), hypothesis, near, start)
    }

    fn refit_by(
        &self,
        descent: Descent,
        hypothesis: &Hypothesis,
        near: &Refit<'_>,
        start: &Start,
    ) -> Option<Refit<'a>> {
        let (problem, x) = self.start(hypothesis, near, start)?;
        // where steps had to be damped for the fit nearby, so they have to be from there
        let descent = Descent { damping: near.damping.clamp(FIRST_DAMPING, Descent::default().damping), ..descent };
        // a score is linear: where it overshoots, start from nothing
        let mut careful = x.clone();
        let given = hypothesis.effects.iter().flat_map(|effect| effect.parameters());
        let given = given.filter(|p| p.is_proportional() && start.iter().any(|(given, _)| given == *p));
        for place in given.filter_map(|p| problem.place(*p)) {
            careful[place] = 0.0;
        }
        if careful == x {
            return self.descend_by(descent, hypothesis, problem, x);
        }
        // without what is given it is the fit nearby
        let is_near = near.is_part_of(hypothesis, &problem) && start.iter().all(|(p, _)| near.value(*p).is_none());
        let worst_start = if is_near { near.chi2 } else { problem.cost(&careful) };
        self.descend_by(Descent { worst_start, ..descent }, hypothesis, problem.clone(), x)
            .or_else(|| self.descend_by(descent, hypothesis, problem, careful))
    }

    /// The first steps of a refit.
    pub fn begin(&self, hypothesis: &Hypothesis, near: &Refit<'_>, start: &Start) -> Option<Refit<'a>> {
        let (problem, x) = self.start(hypothesis, near, start)?;
        self.descend(hypothesis, problem, x, self.settings.descent.first_steps)
    }

    /// Σr² where a refit would start.
    pub fn cost_at(&self, hypothesis: &Hypothesis, near: &Refit<'_>, start: &Start) -> f64 {
        self.start(hypothesis, near, start).map_or(f64::INFINITY, |(problem, x)| problem.cost(&x))
    }

    /// The problem of a hypothesis, and its variables from another fit and some given values.
    pub fn start(&self, hypothesis: &Hypothesis, near: &Refit<'_>, start: &Start) -> Option<(Problem<'a>, Vec<f64>)> {
        let problem = self.problem_near(hypothesis, near).ok()?;
        let mut x = problem.start_values().ok()?;
        for (value, parameter) in x.iter_mut().zip(&problem.free) {
            let given = start.iter().find(|(p, _)| p == parameter).map(|(_, v)| *v);
            let inherited = near.value(*parameter);
            *value = given.or(inherited).unwrap_or(*value);
        }
        // a strip that bends everywhere begins as stiff as the joint it replaces
        let bending = problem.place(Parameter::BendingStiffness);
        let begins = bending.filter(|_| near.value(Parameter::BendingStiffness).is_none());
        if let (Some(k), Some(place)) = (near.value(Parameter::JointStiffness), begins) {
            x[place] = bending_n_m2(k, self.experiment);
        }
        let lower = problem.lower();
        x.iter_mut().zip(&lower).for_each(|(x, low)| *x = x.max(*low));
        x.extend(problem.starts_from(&near.problem, &near.x));
        Some((problem.with_modes_at(&x), x))
    }

    /// The problem of a hypothesis near another fit: judged by the same noise, and a strip in the same shapes.
    ///
    /// # Errors
    /// As [`Problem::new`].
    pub fn problem_near(&self, hypothesis: &Hypothesis, near: &Refit<'_>) -> Result<Problem<'a>> {
        Ok(self.problem(hypothesis, &self.noise_of(near))?.with_modes_of(&near.problem))
    }

    /// The noise by which a fit was judged, of these recordings.
    pub fn noise_of(&self, fit: &Refit<'_>) -> Vec<RecordNoise> {
        let of = &fit.problem;
        let place = |record: &Record| {
            let of_same = || of.records.iter().enumerate().filter(|(_, own)| own.path == record.path);
            let same_start = of_same().find(|(_, own)| own.t_s.first() == record.t_s.first());
            same_start.or_else(|| of_same().next()).map_or(0, |(place, _)| place)
        };
        self.records.iter().map(|record| of.noise[place(record)].clone()).collect()
    }

    /// Fits a hypothesis from the start values of the experiment, by multiple shooting first: for a base model whose motion is out of step.
    /// It ends after its first steps unless they lead below a multiple of what is left without, by `beside`.
    pub fn refit_by_shooting(&self, hypothesis: &Hypothesis, start: &Start, beside: &Refit<'_>) -> Option<Refit<'a>> {
        let mut problem = self.of_descent(self.problem_near(hypothesis, beside).ok()?);
        let noise = problem.noise.clone();
        for (parameter, value) in start {
            set(&mut problem.experiment, *parameter, *value);
        }
        let accuracy = problem.accuracy;
        let x = multiple_shooting(&mut problem).ok()?.x;
        problem.noise = noise;
        problem.accuracy = accuracy;
        let bound = self.settings.descent.hopeless_ratio * beside.chi2;
        self.descend_by(self.descent_below(bound), hypothesis, problem, x)
    }

    /// Multiple shooting along another fit's motion, whatever hypothesis that is of: the initial states of the stretches are on it. It ends after its first
    /// steps unless they lead below `bound`.
    pub fn refit_along_fit(&self, hypothesis: &Hypothesis, leader: &Refit<'_>, bound: f64) -> Option<Refit<'a>> {
        let motions: Vec<Vec<Vec<f64>>> =
            (0..self.records.len()).map(|record| states_along(leader, record)).collect::<Option<_>>()?;
        self.shoot_along(bound, hypothesis, (leader, &[]), |record, row| motions[record][row].clone())
    }

    /// A fit from given coefficients and the starts that the recordings show; where that motion falls out of step, along the recorded motion.
    pub fn refit_along_recording(&self, hypothesis: &Hypothesis, near: &Refit<'_>, start: &Start) -> Option<Refit<'a>> {
        let (problem, mut x) = self.start(hypothesis, near, start)?;
        x.truncate(problem.free.len());
        let reach_s = STATE_WINDOW_RAD / problem.model(0, &x).ok()?.0.characteristic_rad_s();
        let seen = |record: usize, row: usize| self.records[record].start_near(row, reach_s);
        x.extend((0..self.records.len()).flat_map(|record| seen(record, 0)));
        let straight = self.descend(hypothesis, problem, x, self.settings.descent.few_steps);
        let in_step = straight.filter(|fit| !fit.has_lost_step(&self.settings.misfit));
        in_step.or_else(|| self.shoot_along(f64::INFINITY, hypothesis, (near, start), seen))
    }

    /// Stretches that begin in the states at given rows of the recordings, drawn together into one motion.
    fn shoot_along(
        &self,
        bound: f64,
        hypothesis: &Hypothesis,
        (near, start): (&Refit<'_>, &Start),
        state: impl Fn(usize, usize) -> Vec<f64>,
    ) -> Option<Refit<'a>> {
        let (problem, x) = self.start(hypothesis, near, start)?;
        let mut problem = self.of_descent(problem);
        let (noise, accuracy) = (problem.noise.clone(), problem.accuracy);
        let parameters = &x[..problem.free.len()];
        let x = shooting_along(&mut problem, parameters, state).ok()?.x;
        (problem.noise, problem.accuracy) = (noise, accuracy);
        let most_steps = self.settings.descent.most_steps;
        self.descend_by(Descent { most_steps, ..self.descent_below(bound) }, hypothesis, problem, x)
    }

    /// The best of some fits of one hypothesis, with the number of those that agree with it.
    pub fn best_of(&self, fits: impl IntoIterator<Item = Option<Refit<'a>>>) -> Option<Refit<'a>> {
        fits.into_iter().flatten().reduce(|mut best, other| {
            best.meet(other, self.settings.certificate.agrees);
            best
        })
    }

    /// The best of some begun fits of one hypothesis, which go on where that is worth it: one that leaves many times what another does leads nowhere.
    pub fn best_gone_on(
        &self,
        begun: Vec<Refit<'a>>,
        steps: usize,
        is_worth: impl Fn(&Refit<'a>) -> bool + Sync,
    ) -> Option<Refit<'a>> {
        let leads = self.settings.search.leads * least_chi2(&begun);
        let on = |fit: Refit<'a>| {
            if fit.converged || fit.chi2 > leads || !is_worth(&fit) {
                return Some(fit);
            }
            self.go_on(&fit, steps)
        };
        let ended: Vec<_> = begun.into_par_iter().with_max_len(1).map(on).collect();
        self.best_of(ended)
    }

    /// Further steps of a fit.
    pub fn go_on(&self, fit: &Refit<'a>, steps: usize) -> Option<Refit<'a>> {
        let descent = Descent { damping: fit.damping, ..self.descent(steps) };
        let again = self.descend_by(descent, &fit.hypothesis, fit.problem.clone(), fit.x.clone())?;
        Some(Refit { certificate: fit.certificate, ..again })
    }

    /// A fit that has come to its end, and on by steps that are hardly damped: in a narrow valley a damped step promises little up to a standard deviation from the least.
    pub fn to_the_least(&self, fit: Refit<'a>) -> Refit<'a> {
        let further =
            self.descend(&fit.hypothesis, fit.problem.clone(), fit.x.clone(), self.settings.descent.few_steps);
        further.map_or(fit.clone(), |further| Refit { certificate: fit.certificate, ..further })
    }

    /// The same judged by another noise.
    pub fn with_noise(&self, noise: &[RecordNoise], fit: &Refit<'a>, steps: usize) -> Option<Refit<'a>> {
        let mut problem = fit.problem.clone();
        problem.noise = noise.to_vec();
        let again = self.descend(&fit.hypothesis, problem, fit.x.clone(), steps)?;
        Some(Refit { certificate: fit.certificate, ..again })
    }

    /// Descends from given variables of a hypothesis.
    pub fn descend_from(
        &self,
        hypothesis: &Hypothesis,
        noise: &[RecordNoise],
        x: Vec<f64>,
        most_steps: usize,
    ) -> Option<Refit<'a>> {
        self.descend(hypothesis, self.problem(hypothesis, noise).ok()?, x, most_steps)
    }

    /// The same with a problem at hand.
    pub fn descend(
        &self,
        hypothesis: &Hypothesis,
        problem: Problem<'a>,
        x: Vec<f64>,
        most_steps: usize,
    ) -> Option<Refit<'a>> {
        self.descend_by(self.descent(most_steps), hypothesis, problem, x)
    }

    fn descend_by(
        &self,
        descent: Descent,
        hypothesis: &Hypothesis,
        problem: Problem<'a>,
        x: Vec<f64>,
    ) -> Option<Refit<'a>> {
        let problem = self.of_descent(problem);
        let (problem, outcome) = transformed::descend_updating_modes(problem, &descent, x)?;
        let problem = Problem { work: self.work.clone(), ..problem };
        Some(outcome).filter(|outcome| outcome.cost.is_finite()).map(|end| Refit::of(hypothesis.clone(), problem, end))
    }

    /// A problem whose descent ends where it has done the work that one may do.
    fn of_descent(&self, problem: Problem<'a>) -> Problem<'a> {
        Problem { work: self.work.of_descent(self.most_work), ..problem }
    }

    /// A fit whose motions start as short stretches show them to, whatever it makes of them.
    pub fn with_observed_starts<'b>(&self, fit: &Refit<'b>) -> Refit<'b> {
        let mut fit = fit.clone();
        let starts = fit.x.len() - fit.problem.free.len();
        if let Some(seen) = self.begun.len().checked_sub(starts) {
            fit.x.truncate(fit.problem.free.len());
            fit.x.extend_from_slice(&self.begun[seen..]);
        }
        fit
    }

    fn descent(&self, most_steps: usize) -> Descent {
        let enough = self.settings.descent.enough;
        Descent { most_steps, enough, damping: FIRST_DAMPING, ..Descent::default() }
    }

    /// One that ends after its first steps unless they lead below a bound.
    fn descent_below(&self, bound: f64) -> Descent {
        let settings = &self.settings.descent;
        Descent { judged: Some((settings.first_steps, bound)), ..self.descent(settings.few_steps) }
    }
}

/// Angles between marks and their rates at every row of a recording, along a fit's motion.
fn states_along(fit: &Refit<'_>, record: usize) -> Option<Vec<Vec<f64>>> {
    let (model, swing, true_s) = fit.motion(record)?;
    let of_row = |t_s: &f64| {
        let state = swing.at(*t_s);
        let mut seen = chord_angles_rad(model.chain(), &state.theta_rad);
        let rates = chord_slopes(model.chain(), &state.theta_rad) * DVector::from_column_slice(&state.omega_rad_s);
        seen.extend(rates.iter());
        seen
    };
    Some(true_s.iter().map(of_row).collect())
}

/// Sets a start value where the experiment holds it.
fn set(experiment: &mut Experiment, parameter: Parameter, value: f64) {
    let model = &mut experiment.model;
    match parameter {
        Parameter::JointStiffness => model.k_eq_n_m_per_rad = value,
        Parameter::JointDamping => model.c_eq_n_m_s_per_rad = value,
        Parameter::TimeBase => model.effects.time_base = Some(value),
        Parameter::HysteresisYield => {
            if let Some(law) = &mut model.effects.joint_hysteretic {
                law.yield_rad = value;
            }
        }
        Parameter::SupportFrequency => {
            if let Some(law) = &mut model.effects.support_motion {
                law.frequency_hz = value;
            }
        }
        Parameter::SupportOwnFrequency => {
            if let Some(stand) = &mut model.effects.support_flexibility {
                stand.frequency_hz = value;
            }
        }
        Parameter::SupportDampingRatio => {
            if let Some(stand) = &mut model.effects.support_flexibility {
                stand.damping_ratio = value;
            }
        }
        _ => {}
    }
}
