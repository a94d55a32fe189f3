//! Torques along a fit's motion: whether a term gives energy, and which effects of the table it stands for.

use nalgebra::{DVector, DVectorView};

use super::super::context::FitContext;
use super::super::effect::{Effect, Phase, Place};
use super::super::grammar::Term;
use super::super::linearisation::motion_at;
use super::super::refit::Refit;
use super::super::settings::LawSettings;
use crate::experiment::LawPlace;
use crate::model::effects::Effect as _;
use crate::model::effects::formula::Formula;
use crate::model::{ForwardModel, Hinge, Motion, Parameter, Partials};

/// Whether a term has the state and the shape of an effect's law.
pub fn is_of_kind(term: &Term, effect: Effect) -> bool {
    let entry = effect.entry();
    entry.shapes.contains(&term.shape) && (term.state == "angle") == (entry.phase == Some(Phase::Position))
}

/// Whether it has the shape that an effect's law has where nothing changes it.
fn is_law_of(term: &Term, effect: Effect) -> bool {
    term.is_unchanging() && effect.entry().shapes.first() == Some(&term.shape)
}

/// The place of the table at which a law acts.
pub fn place_of(law: LawPlace) -> Place {
    match law {
        LawPlace::Hinge | LawPlace::Support => Place::Hinge,
        LawPlace::Joint => Place::Joint,
        LawPlace::Strip | LawPlace::Tip => Place::Air,
    }
}

/// Of the angle between two columns; 0 where one of them is nothing.
pub fn cosine(a: &DVectorView<'_, f64>, b: &DVectorView<'_, f64>) -> f64 {
    a.dot(b) / (a.norm() * b.norm()).max(f64::MIN_POSITIVE)
}

/// A fit's motion through every recording, row after row.
pub struct Along {
    /// In a model that has some effects more, of no size.
    motions: Vec<(ForwardModel, Vec<Motion>)>,
    /// Those effects that a term may stand for, each with the torques of a unit of its first coefficient.
    effects: Vec<(Effect, DVector<f64>)>,
}

impl Along {
    /// Of a fit, with those of some effects for which any of some terms may stand; `None` where the motion cannot be integrated.
    pub fn of<'t>(
        context: &FitContext<'_>,
        fit: &Refit<'_>,
        effects: &[Effect],
        terms: impl Iterator<Item = &'t Term> + Clone,
    ) -> Option<Self> {
        let is_termed = |effect: &Effect| terms.clone().any(|term| is_of_kind(term, *effect));
        let effects: Vec<Effect> = effects.iter().copied().filter(is_termed).collect();
        let further = || effects.iter().copied().filter(|effect| !fit.hypothesis.has(*effect));
        let hypothesis = further().fold(fit.hypothesis.clone(), |hypothesis, effect| hypothesis.and(effect, None));
        let of_no_size: Vec<(Parameter, f64)> = further()
            .flat_map(|effect| effect.parameters())
            .filter(|p| p.is_proportional())
            .map(|p| (*p, 0.0))
            .collect();
        let (problem, x) = context.start(&hypothesis, fit, &of_no_size)?;
        let fit = Refit { hypothesis, problem, x, ..fit.clone() };
        let of_record = |record: usize| {
            let (model, swing, true_s) = fit.motion(record)?;
            let motions = true_s.iter().map(|t_s| motion_at(&model, &swing, *t_s)).collect::<Option<_>>()?;
            Some((model, motions))
        };
        let motions = (0..fit.problem.records.len()).map(of_record).collect::<Option<_>>()?;
        let mut along = Self { motions, effects: Vec::new() };
        along.effects = effects.into_iter().map(|effect| (effect, along.of_effect(effect))).collect();
        Some(along)
    }

    /// Torques on the links, one instant after another; on a link that friction holds none does anything.
    fn torques(&self, torque: impl Fn(&ForwardModel, &Motion, &mut [f64])) -> DVector<f64> {
        let mut all = Vec::new();
        for (model, motion) in self.motions.iter().flat_map(|(model, motions)| motions.iter().map(move |m| (model, m)))
        {
            let mut q = vec![0.0; model.rates()];
            torque(model, motion, &mut q);
            if motion.hinge == Hinge::Sticks {
                q[0] = 0.0;
            }
            all.extend_from_slice(&q[..model.chain().count()]);
        }
        DVector::from_vec(all)
    }

    /// Whether a term with its coefficients gives energy, all in all.
    pub fn adds_energy(&self, term: &Term) -> bool {
        let motions = self.motions.iter().flat_map(|(_, motions)| motions);
        let rates = motions.flat_map(|motion| motion.rate[..motion.links()].iter().copied());
        self.of_term(term).is_some_and(|torques| torques.iter().zip(rates).map(|(q, rate)| q * rate).sum::<f64>() > 0.0)
    }

    /// The effects that a term stands for, with the share of each: of its kind and at its place the one with whose torques it goes best, and all that do the
    /// same as that one along this motion, wherever they act. Of a description that leaves only noise a term `is_exact`: it is an effect's law, or another one. Of one
    /// that leaves more no term is, and a neighbouring power is within its error. A term with the effect's own shape at its place is no other law, whether it lets the
    /// link stick or not.
    pub fn stands_for(&self, (term, is_exact): (&Term, bool), law: &LawSettings) -> Vec<(Effect, f64)> {
        let Some(own) = self.of_term(term) else { return Vec::new() };
        let goes_with = |(effect, other): &(Effect, DVector<f64>)| {
            let cosine = cosine(&own.as_view(), &other.as_view());
            // in the direction in which it can act
            (*effect, if effect.parameters()[0].is_not_negative() { cosine } else { cosine.abs() })
        };
        let of_kind = self.effects.iter().filter(|(effect, _)| is_of_kind(term, *effect));
        let cosines: Vec<(Effect, f64)> = of_kind.map(goes_with).collect();
        let is_it = |(effect, cosine): &&(Effect, f64)| {
            let is_near = !is_exact || is_law_of(term, *effect);
            *cosine > if is_near && self.is_at_place(term, *effect) { law.the_same_law } else { law.the_same }
        };
        let Some(best) = cosines.iter().filter(is_it).max_by(|a, b| a.1.total_cmp(&b.1)) else { return Vec::new() };
        let is_as_good = |own: &&(Effect, f64)| own.1 > law.the_same * best.1;
        let alike = cosines.iter().filter(is_as_good).count() as f64;
        cosines.iter().filter(is_as_good).map(|own| (own.0, 1.0 / alike)).collect()
    }

    /// Whether a term acts where an effect does. Along a single link hinge, strip and tip are one place.
    fn is_at_place(&self, term: &Term, effect: Effect) -> bool {
        let is_single = self.motions.iter().all(|(model, _)| model.chain().count() == 1);
        effect.place() == place_of(term.law.place) || (is_single && matches!(effect.place(), Place::Hinge | Place::Air))
    }

    /// Of a unit of an effect's first coefficient.
    pub fn of_effect(&self, effect: Effect) -> DVector<f64> {
        let parameter = effect.parameters()[0];
        self.torques(|model, motion, q| {
            let mut partials = Partials::zero(model.chain().count(), model.rates());
            model.partials(motion, &mut partials);
            model.sensitivity(parameter, motion, &partials, q);
        })
    }

    /// Of a term with its coefficients.
    pub fn of_term(&self, term: &Term) -> Option<DVector<f64>> {
        let formula = Formula::of(&term.law)?;
        Some(self.torques(|model, motion, q| formula.add_torque(model.chain(), motion, q)))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::diagnose::grammar::{StateRange, terms};
    use crate::experiment::Experiment;
    use crate::model::{Accuracy, State, Trajectory};

    /// Along the swing of one link that dry friction brings to rest, for 40 s.
    fn along_a_swing_to_rest() -> Along {
        let rig = "[[specimen.links]]\nlength_m = 0.37\nmass_kg = 0.23\ncom_m = 0.27\ninertia_kg_m2 = 1.5e-3\n\
                   [model]\nrelease_rad = [0.5]\n[model.effects]\nhinge_coulomb = 6e-3";
        let experiment = Experiment::parse_with_specimen(rig, Path::new("rig.toml")).unwrap();
        let model = ForwardModel::of(&experiment).unwrap();
        let start = State::released(&model, &[0.5]).unwrap();
        let swing = Trajectory::with(&model, &start, (0.0, 40.0), None, &Accuracy::default()).unwrap();
        let motions: Vec<Motion> =
            (0..1200).map(|row| motion_at(&model, &swing, f64::from(row) / 30.0).unwrap()).collect();
        assert!(
            motions.iter().filter(|motion| motion.hinge == Hinge::Sticks).count() > 600,
            "it does not come to rest"
        );
        let mut along = Along { motions: vec![(model, motions)], effects: Vec::new() };
        along.effects.push((Effect::HingeCoulomb, along.of_effect(Effect::HingeCoulomb)));
        along
    }

    #[test]
    fn a_swing_that_ends_at_rest_tells_friction_by_what_it_does_while_the_link_moves() {
        let along = along_a_swing_to_rest();
        let largest = StateRange { angle: 0.5, rate: 3.0, time_s: 40.0 };
        let mut term = terms(LawPlace::Strip, largest).into_iter().find(|term| term.shape == "sign").unwrap();
        term.law.parameters.get_mut("a").unwrap().start = 0.03;
        assert_eq!(along.stands_for((&term, false), &LawSettings::default()), [(Effect::HingeCoulomb, 1.0)]);
        // whatever is left: along one link it is that friction, and friction that fades with speed is not
        assert_eq!(along.stands_for((&term, true), &LawSettings::default()), [(Effect::HingeCoulomb, 1.0)]);
        let is_fading = |term: &Term| term.shape == "sign that fades with speed" && term.is_unchanging();
        let mut fading = terms(LawPlace::Hinge, largest).into_iter().find(is_fading).unwrap();
        fading.law.parameters.get_mut("a").unwrap().start = 0.03;
        assert_eq!(along.stands_for((&fading, true), &LawSettings::default()), []);
    }
}
