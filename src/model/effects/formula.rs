//! A law that a file states by a formula (`[[model.law]]`).

use super::bearing::BearingLoad;
use super::load::{self, MovingLink};
use super::{Effect, air};
use crate::experiment::{Law, LawPlace};
use crate::model::expression::{Expression, MOST_VALUES};
use crate::model::{Chain, Motion, Parameter, Partials};

/// The law.
#[derive(Debug, Clone)]
pub struct Formula {
    place: LawPlace,
    /// The lower link of the only joint at which it acts.
    only_at: Option<usize>,
    expression: Expression,
    coefficients: Vec<Parameter>,
    /// The state where it is looked at, then the values of the coefficients; last, where it is dry friction of the hinge, the sign of the rate.
    values: Vec<f64>,
    is_dry: bool,
    /// Whether the load of the bearing stands in it.
    is_by_load: bool,
}

/// The rate among the variables of a law at the hinge.
const RATE: usize = 1;
/// The load of the bearing among those of a law at the hinge or the joints.
const LOAD: usize = 2;

/// How what a formula gives acts, where it is no force along the strip.
enum Acts {
    /// A torque on the first link.
    Hinge,
    /// A torque between a link and the next.
    Joint(usize),
    /// An acceleration of the pivot.
    Support,
}

impl Acts {
    /// The links on which a torque acts, each with its direction.
    fn of_torque(&self) -> impl Iterator<Item = (usize, f64)> + use<> {
        let (on, back) = match *self {
            Self::Hinge => (Some(0), None),
            Self::Joint(i) => (Some(i), Some(i - 1)),
            Self::Support => (None, None),
        };
        on.map(|link| (link, 1.0)).into_iter().chain(back.map(|link| (link, -1.0)))
    }
}

impl Formula {
    /// From a file's law; `None` where its formula is not sound.
    pub fn of(law: &Law) -> Option<Self> {
        let state = vec![0.0; law.place.variables().len()];
        let stated = law.expression().ok()?;
        let dry = if law.place == LawPlace::Hinge { stated.with_sign_given(RATE) } else { None };
        let is_dry = dry.is_some();
        let is_by_load = matches!(law.place, LawPlace::Hinge | LawPlace::Joint) && stated.uses(LOAD);
        let values = state.into_iter().chain(law.parameters.values().map(|own| own.start)).chain(is_dry.then_some(0.0));
        let coefficients = law.coefficients().map(|(parameter, _)| parameter).collect();
        Some(Self {
            place: law.place,
            only_at: law.joint,
            values: values.collect(),
            expression: dry.unwrap_or(stated),
            coefficients,
            is_dry,
            is_by_load,
        })
    }

    /// Evaluated in a state; the hinge moves at a rate with this sign.
    fn at<N>(&self, evaluate: impl Fn(&Expression, &[f64]) -> N, state: &[f64], sign: f64) -> N {
        let mut all = [0.0; MOST_VALUES];
        let values = &mut all[..self.values.len()];
        values.copy_from_slice(&self.values);
        values[..state.len()].copy_from_slice(state);
        if let Some(of_rate) = values.last_mut().filter(|_| self.is_dry) {
            *of_rate = sign;
        }
        evaluate(&self.expression, values)
    }

    /// Where the derivative with a coefficient stands.
    fn slope_of(&self, parameter: Parameter) -> Option<usize> {
        let index = self.coefficients.iter().position(|own| *own == parameter)?;
        Some(self.place.variables().len() + index)
    }

    /// The formula at every place of the chain where it acts, of a law that is no force along the strip, with the load there.
    fn visit<'a, N>(
        &self,
        evaluate: impl Fn(&Expression, &[f64]) -> N,
        chain: &'a Chain,
        motion: &'a Motion,
        mut each: impl FnMut(&Acts, N, Option<BearingLoad<'a>>),
    ) {
        let (theta, rate, t_s) = (&motion.theta_rad, &motion.rate, motion.t_s);
        let mut act = |acts: &Acts, angle: f64, rate: f64, link: usize| {
            let bearing = self.is_by_load.then(|| BearingLoad::of(chain, motion, link));
            let state = [angle, rate, bearing.map_or(0.0, |b| b.load_n), t_s];
            each(acts, self.at(&evaluate, &state, motion.hinge.sign()), bearing);
        };
        match self.place {
            LawPlace::Hinge => act(&Acts::Hinge, theta[0], rate[0], 0),
            LawPlace::Joint => (1..chain.count())
                .filter(|i| self.only_at.is_none_or(|only| only == *i))
                .for_each(|i| act(&Acts::Joint(i), theta[i] - theta[i - 1], rate[i] - rate[i - 1], i)),
            LawPlace::Support => each(&Acts::Support, self.at(&evaluate, &[t_s], motion.hinge.sign()), None),
            LawPlace::Strip | LawPlace::Tip => {}
        }
    }

    /// The points of a link at which it acts across the strip; none of a law that acts elsewhere.
    fn points(&self, chain: &Chain, link: &MovingLink) -> impl Iterator<Item = air::Point> + use<> {
        let along = (self.place == LawPlace::Strip).then(|| air::fine_points(link));
        let tip = (self.place == LawPlace::Tip).then(|| air::tip(chain, link));
        along.into_iter().flatten().chain(tip.into_iter().flatten())
    }

    /// Adds the torques of a value that is taken of the formula.
    fn add(&self, value: impl Fn(&Expression, &[f64]) -> f64, chain: &Chain, motion: &Motion, q: &mut [f64]) {
        if self.is_along_the_strip() {
            let force = |speed: f64| self.at(&value, &[speed, motion.t_s], 0.0);
            return load::add_torque(chain, motion, |link| air::load_of(link, self.points(chain, link), force), q);
        }
        self.visit(value, chain, motion, |acts, value, _| match acts {
            Acts::Support => {
                (0..chain.count()).for_each(|i| q[i] -= value * chain.static_moment_kg_m(i) * motion.cos[i]);
            }
            links => links.of_torque().for_each(|(link, sign)| q[link] += sign * value),
        });
    }

    fn is_along_the_strip(&self) -> bool {
        matches!(self.place, LawPlace::Strip | LawPlace::Tip)
    }
}

impl Effect for Formula {
    fn add_torque(&self, chain: &Chain, motion: &Motion, q: &mut [f64]) {
        self.add(Expression::value, chain, motion, q);
    }

    fn add_partials(&self, chain: &Chain, motion: &Motion, partials: &mut Partials) {
        if self.is_along_the_strip() {
            let force = |speed: f64| {
                let dual = self.at(|formula, values| formula.at::<1>(values, 0), &[speed, motion.t_s], 0.0);
                [dual.value, dual.slopes[0]]
            };
            return load::add_partials(
                chain,
                motion,
                |link| air::slopes_of(link, self.points(chain, link), force),
                partials,
            );
        }
        self.visit(
            |formula, values| formula.at::<3>(values, 0),
            chain,
            motion,
            |acts, dual, bearing| {
                let [with_angle, with_rate, with_load] = dual.slopes;
                if let Acts::Support = acts {
                    (0..chain.count()).for_each(|i| {
                        partials.theta[(i, i)] += dual.value * chain.static_moment_kg_m(i) * motion.sin[i];
                    });
                }
                for (own, sign) in acts.of_torque() {
                    for (other, along) in acts.of_torque() {
                        partials.theta[(own, other)] += sign * along * with_angle;
                        partials.rate[(own, other)] += sign * along * with_rate;
                    }
                    let Some(bearing) = &bearing else { continue };
                    for l in 0..chain.count() {
                        let [theta, rate, acceleration] = bearing.slopes(l);
                        partials.theta[(own, l)] += sign * with_load * theta;
                        partials.rate[(own, l)] += sign * with_load * rate;
                        partials.acceleration[(own, l)] += sign * with_load * acceleration;
                    }
                    partials.pivot_acceleration[own] += sign * with_load * bearing.with_pivot_kg();
                }
            },
        );
    }

    fn add_sensitivity_of_links(&self, parameter: Parameter, chain: &Chain, motion: &Motion, q: &mut [f64]) {
        if !self.is_by_load {
            return;
        }
        let slope = |formula: &Expression, values: &[f64]| formula.at::<1>(values, LOAD).slopes[0];
        self.visit(slope, chain, motion, |acts, with_load, bearing| {
            let with_parameter = bearing.map_or(0.0, |bearing| with_load * bearing.with_parameter(parameter));
            acts.of_torque().for_each(|(link, sign)| q[link] += sign * with_parameter);
        });
    }

    /// Of a law of angles and rates at a point.
    fn add_kinks(&self, chain: &Chain, motion: &Motion, kinks: &mut Vec<f64>) {
        if self.is_along_the_strip() || self.is_by_load {
            return;
        }
        let of_formula = |formula: &Expression, values: &[f64]| {
            let mut own = Vec::new();
            formula.add_kinks(values, &mut own);
            own
        };
        self.visit(of_formula, chain, motion, |_, own, _| kinks.extend(own));
    }

    fn is_linear_in_accelerations(&self) -> bool {
        !self.is_by_load
    }

    /// Half a unit for each operation, four points a link of a strip.
    fn work(&self, chain: &Chain) -> u64 {
        let n = chain.count() as u64;
        let (evaluations, way) = match self.place {
            LawPlace::Hinge | LawPlace::Support => (1, 0),
            LawPlace::Joint => (n - 1, 0),
            LawPlace::Strip => (4 * n, load::work(chain)),
            LawPlace::Tip => (1, load::work(chain)),
        };
        let of_load = if self.is_by_load { evaluations * n } else { 0 };
        way + of_load + evaluations * self.expression.operations() as u64 / 2
    }

    fn friction_n_m(&self, chain: &Chain, motion: &Motion) -> Option<f64> {
        let load_n = if self.is_by_load { BearingLoad::of(chain, motion, 0).load_n } else { 0.0 };
        let of_sign = |sign: f64| self.at(Expression::value, &[motion.theta_rad[0], 0.0, load_n, motion.t_s], sign);
        self.is_dry.then(|| 0.5 * (of_sign(-1.0) - of_sign(1.0)))
    }

    fn sideways_m_s2(&self, motion: &Motion) -> f64 {
        if self.place == LawPlace::Support { -self.at(Expression::value, &[motion.t_s], 0.0) } else { 0.0 }
    }

    fn parameters(&self) -> Vec<(Parameter, f64)> {
        let values = &self.values[self.place.variables().len()..];
        self.coefficients.iter().copied().zip(values.iter().copied()).collect()
    }

    fn set(&mut self, parameter: Parameter, value: f64) {
        if let Some(place) = self.slope_of(parameter) {
            self.values[place] = value;
        }
    }

    fn add_sensitivity(&self, parameter: Parameter, chain: &Chain, motion: &Motion, q: &mut [f64]) {
        if let Some(place) = self.slope_of(parameter) {
            self.add(|formula, values| formula.at::<1>(values, place).slopes[0], chain, motion, q);
        }
    }
}
