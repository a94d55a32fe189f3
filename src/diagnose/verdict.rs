//! The verdict: adequate, identified, ambiguous or unknown; what cannot be told apart; and the measurement that would tell.

use super::effect::Effect;
use super::heldout::HeldOut;
use super::learnt::Learnt;
use super::misfit::left_of_excess;
use super::posterior::{Candidate, Posterior};
use super::settings::Settings;

/// What the recordings say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Nothing is missing that could be seen.
    Adequate,
    /// One answer.
    Identified,
    /// Several answers that the recordings do not tell apart.
    Ambiguous,
    /// Something is missing that is not in the table.
    Unknown,
}

impl serde::Serialize for Status {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.id())
    }
}

impl Status {
    /// The name in files.
    pub fn id(self) -> &'static str {
        match self {
            Self::Adequate => "adequate",
            Self::Identified => "identified",
            Self::Ambiguous => "ambiguous",
            Self::Unknown => "unknown",
        }
    }
}

/// The verdict.
#[derive(Debug, Clone)]
pub struct Verdict {
    /// What kind.
    pub status: Status,
    /// The best names.
    pub effects: Vec<Effect>,
    /// Every effect that the recordings do not tell from them.
    pub class: Vec<Effect>,
    /// Those of the class that may only be at work beside the names, in the place of none.
    pub companions: Vec<Effect>,
    /// Of the answer as it is given.
    pub probability: f64,
    /// That the truth is one of the hypotheses that make up the class.
    pub class_probability: f64,
    /// Of anything outside the table.
    pub unknown: f64,
    /// The measurement that would split the class.
    pub to_decide: Option<String>,
}

impl Verdict {
    /// From the probabilities, the proof of the likeliest, and the law that was learnt beside it.
    pub fn of(
        posterior: &Posterior<'_>,
        marks: usize,
        proof: Option<&HeldOut>,
        learnt: Option<&Learnt<'_>>,
        settings: &Settings,
    ) -> Self {
        let Posterior { candidates: weighed, unknown, .. } = posterior;
        let unknown = *unknown;
        let adequate: f64 = weighed.iter().filter(|w| w.fit.hypothesis.effects.is_empty()).map(|w| w.probability).sum();
        let named = 1.0 - adequate - unknown;
        let nothing = |status, probability| Self {
            status,
            effects: Vec::new(),
            class: Vec::new(),
            companions: Vec::new(),
            probability,
            class_probability: probability,
            unknown,
            to_decide: None,
        };
        if unknown > adequate && unknown > named {
            // names stand, whatever remains beside them, where each is likelier than not, however the others are chosen, and together they leave next to nothing or
            // predict what was not fitted
            let best = posterior.best();
            let leaves_little = left_of_excess(best, posterior.base()) < settings.prior.imitated_down_to;
            // friction that fades with speed is friction, and predicts with its own law, where that does not explain more than the names do
            let of_law = |proof: &HeldOut| {
                let of_names = learnt.filter(|learnt| learnt.holds(&best.hypothesis.effects));
                let left = of_names.map_or(f64::INFINITY, |learnt| learnt.prediction.over(&proof.baseline));
                let by_names = proof.leaves().powi(2);
                let adds_less = by_names - left.powi(2) <= 1.0 - by_names;
                if adds_less { left } else { f64::INFINITY }
            };
            let predicts = proof.is_some_and(|proof| proof.leaves().min(of_law(proof)) <= settings.verdict.proven);
            let inclusions = posterior.inclusions(settings);
            let is_likely = inclusions.iter().any(|own| own.1 > settings.verdict.even);
            let stand = is_likely && replaced(posterior, settings).is_none() && (leaves_little || predicts);
            return if stand {
                Self::standing(&inclusions, posterior, marks, settings)
            } else {
                nothing(Status::Unknown, unknown)
            };
        }
        if adequate >= named {
            return nothing(Status::Adequate, adequate);
        }
        if let Some(replaced) = replaced(posterior, settings) {
            return nothing(Status::Unknown, replaced);
        }
        match with_names(weighed).next() {
            Some(best) => Self::from_best(best, weighed, |w| w.probability, unknown, marks, settings),
            None => nothing(Status::Unknown, unknown),
        }
    }

    /// Whether something outside the table is at least as likely as the names that are given.
    pub fn is_open(&self) -> bool {
        let names_stand = matches!(self.status, Status::Adequate | Status::Identified);
        self.status == Status::Unknown || self.unknown >= self.class_probability && !names_stand
    }

    /// Names beside which something remains: the effects that are more probable than not, which is the median probability model (Barbieri and Berger, Annals of
    /// Statistics 32 (2004) 870), that of all sets predicts best where none takes all; and the class of what the recordings do not tell from them.
    fn standing(inclusions: &[(Effect, f64)], posterior: &Posterior<'_>, marks: usize, settings: &Settings) -> Self {
        let best = posterior.best();
        let from = |least: f64| inclusions.iter().filter(move |own| own.1 > least);
        let least = from(settings.verdict.even).map(|own| own.1).fold(1.0, f64::min);
        let is_clear = least >= settings.verdict.alone && best.is_certified(&settings.certificate);
        let effects: Vec<Effect> = from(settings.verdict.even).map(|own| own.0).collect();
        let mut class = effects.clone();
        if !is_clear {
            class.extend(from(settings.verdict.told_apart).map(|own| own.0).filter(|effect| !effects.contains(effect)));
        }
        let companions = companions(
            &posterior.candidates,
            |w| w.mixture_probability,
            (&effects, &class),
            settings.verdict.told_apart,
        );
        Self {
            status: if is_clear { Status::Identified } else { Status::Ambiguous },
            to_decide: to_decide(&effects, &without(&class, &companions), marks),
            effects,
            class,
            companions,
            probability: least,
            class_probability: least,
            unknown: 1.0 - least,
        }
    }

    /// The likeliest names and their class.
    fn from_best(
        best: &Candidate<'_>,
        weighed: &[Candidate<'_>],
        probability: impl Fn(&Candidate<'_>) -> f64,
        unknown: f64,
        marks: usize,
        settings: &Settings,
    ) -> Self {
        let mut class = not_told_apart(weighed, &probability, settings.verdict.told_apart);
        let effects = best.fit.hypothesis.effects.clone();
        let status = if probability(best) >= settings.verdict.alone { Status::Identified } else { Status::Ambiguous };
        if status == Status::Identified {
            class.clone_from(&effects);
        }
        let companions = companions(weighed, &probability, (&effects, &class), settings.verdict.told_apart);
        let to_decide = to_decide(&effects, &without(&class, &companions), marks);
        let within = |w: &&Candidate<'_>| w.fit.hypothesis.effects.iter().all(|c| class.contains(c));
        let class_probability = with_names(weighed).filter(within).map(&probability).sum();
        let probability = probability(best);
        Self { status, effects, class, companions, probability, class_probability, unknown, to_decide }
    }
}

/// Where a law of no table takes the place of the name that explains most, how likely that is: the other names may complete what is not there.
fn replaced(posterior: &Posterior<'_>, settings: &Settings) -> Option<f64> {
    let leading = posterior.by_contribution(posterior.best()).first().copied()?;
    let needed = posterior.needed.iter().find(|own| own.effect == leading)?;
    (needed.replaced > settings.verdict.even).then_some(needed.replaced)
}

/// Those of a class that no likely hypothesis has in the place of one of the names.
fn companions(
    weighed: &[Candidate<'_>],
    probability: impl Fn(&Candidate<'_>) -> f64,
    (names, class): (&[Effect], &[Effect]),
    told_apart: f64,
) -> Vec<Effect> {
    let best = with_names(weighed).map(&probability).fold(0.0, f64::max);
    let has_all = |w: &Candidate<'_>| names.iter().all(|name| w.fit.hypothesis.has(*name));
    let instead = |effect: Effect| {
        let mut likely = with_names(weighed).filter(|w| probability(w) > told_apart * best && !has_all(w));
        likely.any(|w| w.fit.hypothesis.has(effect))
    };
    class.iter().copied().filter(|effect| !names.contains(effect) && !instead(*effect)).collect()
}

fn without(class: &[Effect], some: &[Effect]) -> Vec<Effect> {
    class.iter().copied().filter(|effect| !some.contains(effect)).collect()
}

/// The hypotheses that have effects, likeliest first.
fn with_names<'w, 'a>(weighed: &'w [Candidate<'a>]) -> impl Iterator<Item = &'w Candidate<'a>> {
    weighed.iter().filter(|w| !w.fit.hypothesis.effects.is_empty())
}

/// The effects of the likeliest names, then all that the recordings do not tell from them.
pub fn not_told_apart(
    weighed: &[Candidate<'_>],
    probability: impl Fn(&Candidate<'_>) -> f64,
    told_apart: f64,
) -> Vec<Effect> {
    let mut class = Vec::new();
    let least = with_names(weighed).next().map_or(0.0, |best| told_apart * probability(best));
    for effect in with_names(weighed).filter(|w| probability(w) > least).flat_map(|w| &w.fit.hypothesis.effects) {
        if !class.contains(effect) {
            class.push(*effect);
        }
    }
    class
}

/// What to measure to split a class.
fn to_decide(effects: &[Effect], class: &[Effect], marks: usize) -> Option<String> {
    if class.len() <= effects.len() {
        return None;
    }
    let has = |of: &[Effect]| of.iter().filter(|c| class.contains(c)).count() > 1;
    let mut advice: Vec<&str> = Vec::new();
    if has(&[Effect::CameraTilt, Effect::DifferentialZero, Effect::SideForce, Effect::RestCurl]) {
        advice.push(
            "film a plumb line beside the specimen, and film the specimen again turned by 180° about its long axis",
        );
    }
    let of_pace = has(&[Effect::TimeBase, Effect::HingeStiffness, Effect::AddedMass, Effect::DistributedFlexibility]);
    if of_pace {
        advice.push(
            "film a clock beside the specimen, and release the specimen at a much larger angle: gravity's restoring torque falls behind the angle there, so that a spring's share in the frequency grows with amplitude; a wrong clock and added mass change the frequency by the same factor at every amplitude",
        );
    }
    if has(&[Effect::HingeViscous, Effect::AirLinear, Effect::JointHysteretic]) {
        advice.push(if marks > 1 {
            "release it in the second mode (θ2 opposite to θ1), and again with a card on the tip: only the loss to the air grows with the area"
        } else {
            "repeat it with a card on the tip: only the loss to the air grows with the area"
        });
    }
    if has(&[
        Effect::HingeViscous,
        Effect::HingeCoulomb,
        Effect::AirQuadratic,
        Effect::AirLinear,
        Effect::JointHysteretic,
    ]) {
        advice.push("release it at twice the angle and record until it is at rest: the dampers depend on amplitude in different ways");
    }
    if has(&[
        Effect::AngleGain,
        Effect::CameraOblique,
        Effect::JointCubicStiffness,
        Effect::RestCurl,
        Effect::AddedMass,
    ]) {
        advice.push(
            "film a grid in the plane of the swing: it gives the scale of the angles and the direction of the camera",
        );
    }
    // one clock is enough
    if has(&[Effect::DifferentialLag, Effect::DroppedFrames, Effect::TimeBase]) && !of_pace {
        advice.push("film a running clock beside the specimen");
    }
    if advice.is_empty() {
        advice.push("a longer recording with less noise, from a larger release and from another shape of release");
    }
    Some(advice.join("; "))
}
