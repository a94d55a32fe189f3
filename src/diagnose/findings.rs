//! Everything that was found about some recordings, from which the answer is written.

use super::adequacy::Adequacy;
use super::context::FitContext;
use super::effect::{Effect, Phase, Place};
use super::heldout::HeldOut;
use super::learnt::Learnt;
use super::locate::Departure;
use super::misfit::left_of_excess;
use super::posterior::Posterior;
use super::refit::Refit;
use super::search::RoundEnd;
use super::torque::MissingTorque;
use super::verdict::{Status, Verdict};

/// What was found.
pub struct Findings<'a> {
    /// What all fits shared.
    pub context: FitContext<'a>,
    /// The hypotheses with their probabilities.
    pub posterior: Posterior<'a>,
    /// The verdict.
    pub verdict: Verdict,
    /// Where and when the base model departs.
    pub departure: Departure,
    /// The same of what the names leave.
    pub remaining: Departure,
    /// Where the unknown acts, where it is at least as likely as any name.
    pub unknown_at: Option<Place>,
    /// The torque that the base model lacks, there or where it explains most.
    pub missing_torque: Option<MissingTorque>,
    /// The prediction of what was not fitted.
    pub held_out: Option<HeldOut>,
    /// The law that was learnt of what the names leave.
    pub learnt: Option<Learnt<'a>>,
    /// Whether the base model is enough, and what could have been seen.
    pub adequacy: Adequacy,
    /// What each round of the search came to.
    pub rounds: Vec<RoundEnd>,
    /// Rounds of the search that its budget did not allow.
    pub undecided: Vec<&'static str>,
}

impl<'a> Findings<'a> {
    /// The fit that the verdict names; the likeliest of the table where something else is at work; the base model where that is enough.
    pub fn named(&self) -> &Refit<'a> {
        match self.verdict.status {
            Status::Adequate => self.posterior.base(),
            _ => self.posterior.best(),
        }
    }

    /// The probability of the answer, with every rival whose fit is not certified as good as the best, and without them. Only names have such rivals.
    pub fn probability_interval(&self) -> [f64; 2] {
        let highest = self.verdict.probability;
        let best = &self.posterior.candidates[0];
        // what the fall of the best one's probability is to the answer's
        let part = if best.probability > 0.0 { (self.posterior.lowest / best.probability).min(1.0) } else { 1.0 };
        match self.verdict.status {
            Status::Unknown => [highest, highest],
            _ => [part * highest, highest],
        }
    }

    /// The part of what the base model leaves beyond the noise that the named fit explains.
    pub fn explained(&self) -> f64 {
        1.0 - left_of_excess(self.named(), self.posterior.base())
    }

    /// Where what remains beside the names acts, as far as that is told.
    pub fn remains_at(&self) -> Option<Place> {
        let likeliest = self.posterior.unknowns.first().filter(|unknown| unknown.gain > 0.0)?;
        (self.posterior.remains > self.context.settings.verdict.even).then(|| likeliest.place())
    }

    /// How probable each effect of the table is. Where the names do not stand, because another law takes the place of the leading one, or because they neither leave next
    /// to nothing nor predict what was not fitted, each of them is doubted, too.
    pub fn inclusions(&self) -> Vec<(Effect, f64)> {
        let settings = self.context.settings;
        let stand = if self.verdict.status == Status::Unknown { settings.prior.beside_no_answer } else { 1.0 };
        let of_names = self.posterior.inclusions(settings).into_iter();
        of_names.map(|(effect, probability)| (effect, stand * probability)).collect()
    }

    /// The effects named, the one that explains most first.
    pub fn named_effects(&self) -> Vec<Effect> {
        self.posterior.by_contribution(self.named())
    }

    /// Where what is missing acts.
    pub fn place(&self) -> Option<Place> {
        match self.verdict.status {
            Status::Adequate => None,
            // a law that has been proven acts where it does
            Status::Unknown if self.learnt.is_some() => self.learnt.as_ref().and_then(Learnt::place),
            _ => self.unknown_at.or_else(|| self.named_effects().first().map(|effect| effect.place())),
        }
    }

    /// With what the missing torque goes.
    pub fn phase(&self) -> Option<Phase> {
        match self.verdict.status {
            Status::Adequate => None,
            // a law that has been proven says itself whether it goes with position or velocity
            Status::Unknown if self.learnt.is_some() => self.learnt.as_ref().and_then(Learnt::phase),
            Status::Unknown => {
                let of_torque = self.missing_torque.as_ref().and_then(|torque| torque.phase);
                of_torque.or(self.departure.goes_with)
            }
            _ => self.named_effects().first().and_then(|effect| effect.entry().phase),
        }
    }
}
