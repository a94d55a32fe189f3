//! What a diagnosis says in words.

use std::fmt::Write;

use super::altered;
use super::effect::{Effect, Phase, Place};
use super::findings::Findings;
use super::grammar::Term;
use super::misfit::is_beyond_noise;
use super::torque::MissingTorque;
use super::verdict::{self, Status};
use crate::digits::number;
use crate::experiment::LawPlace;
use crate::model::Parameter;

/// A change of a probability that is worth a sentence (judgement: a percent).
const SLIGHT_CHANGE: f64 = 0.01;
/// Times the noise that read as one (format: two digits are told).
const NEXT_TO_NOISE: f64 = 1.05;
/// The least error of a length that is worth measuring again (judgement: 0.05 mm of 250 mm).
const FINEST_PERCENT: f64 = 0.02;
/// Rivals that are named in a sentence (judgement).
const MOST_RIVALS: usize = 3;
/// Ratios of frequencies that differ by less are one: the swing is slower at large angles (physics: by so much at 80°).
const SAME_FREQUENCY: f64 = 0.12;
/// A joint that yields before this part of the bend that every joint reaches is dry (judgement).
const DRY_SHARE: f64 = 0.01;

impl Findings<'_> {
    /// What is missing, and how sure that is.
    pub fn verdict_statement(&self) -> String {
        let verdict = &self.verdict;
        let sure = self.how_sure();
        let reservation = self.reservation();
        let statement = match verdict.status {
            Status::Adequate => {
                format!("Nothing is missing that this recording could show: the base model leaves only noise ({sure}).")
            }
            // names that leave no more than noise, and one of them for which another law does better
            Status::Unknown if verdict.probability > verdict.unknown => format!(
                "Something is missing that is not in the table of effects ({sure}): effects of the table leave little more than noise, but a law outside the table, in the place of one of them, describes the recording better{}.",
                self.nearest()
            ),
            // the table cannot be excluded by sets that were never fitted
            Status::Unknown if !self.has_compared_pairs() => format!(
                "Something is missing ({sure}), and the search reached its limit of computation before it found what: not every pair of effects was fitted, so that it may well be in the table of effects{}. Diagnose a shorter stretch (--until).",
                self.nearest()
            ),
            Status::Unknown => format!(
                "Something is missing that is not in the table of effects ({sure}): no effect of the table, and no combination that was tried, leaves only noise{}.",
                self.nearest()
            ),
            Status::Identified => {
                format!("Missing: {} ({sure}).{}{}", words(&self.foremost_first()), self.remark(), self.more())
            }
            Status::Ambiguous => {
                let is_rival =
                    |effect: &Effect| !verdict.companions.contains(effect) && !verdict.effects.contains(effect);
                let rivals: Vec<Effect> = verdict.class.iter().copied().filter(is_rival).collect();
                let mut others = match (&rivals[..], &verdict.companions[..]) {
                    ([], []) => String::new(),
                    ([], companions) => format!(", perhaps together with others: {}", names(companions, "")),
                    (rivals, _) => format!(", but the recording cannot distinguish it from {}", words_of_any(rivals)),
                };
                if others.is_empty() || verdict.unknown > self.context.settings.verdict.told_apart {
                    let unknown = percent(verdict.unknown);
                    let _ = write!(others, ", or an effect outside the table that looks like this ({unknown})");
                }
                let (effects, remark, more) = (words(&self.foremost_first()), self.remark(), self.more());
                let statement = format!("Missing: most likely {effects} ({sure}){others}.{remark}{more}");
                match self.posterior.candidate(&[]).map(|base| base.probability) {
                    // the names of the class together are likelier than none of them, each set by itself is not
                    Some(alone) if alone > verdict.probability => format!(
                        "It is not certain that anything is missing: the base model alone ({}) is more probable than with any one set of effects. {}",
                        percent(alone),
                        statement.replacen("Missing: most likely", "If something is, it is most likely", 1)
                    ),
                    _ => statement,
                }
            }
        };
        statement + &self.law() + &reservation + &altered::statement(self.named(), &self.context.beliefs)
    }

    /// Whether every pair of effects that promises anything was fitted.
    fn has_compared_pairs(&self) -> bool {
        self.posterior.compared.of_any >= self.context.settings.search.main_effects
    }

    /// The names, what explains most first.
    fn foremost_first(&self) -> Vec<Effect> {
        let mut effects = self.verdict.effects.clone();
        let order = self.posterior.by_contribution(self.named());
        effects.sort_by_key(|effect| order.iter().position(|other| other == effect));
        effects
    }

    /// The probability of the answer; of names whatever else may be missing, and where that is much less, that they are all.
    fn how_sure(&self) -> String {
        let (verdict, settings) = (&self.verdict, &self.context.settings.verdict);
        let alone = percent(verdict.probability);
        let inclusions = self.inclusions();
        let named = inclusions.iter().filter(|(effect, _)| verdict.effects.contains(effect));
        let least = named.map(|(_, inclusion)| *inclusion).fold(1.0, f64::min);
        let is_known = verdict.status != Status::Unknown && least - verdict.probability >= settings.told_apart;
        match verdict.effects.len() {
            1 if is_known => format!("probability {}; {alone} that nothing else is missing", percent(least)),
            2.. if is_known => format!("probability {} each; {alone} that nothing else is missing", percent(least)),
            _ => format!("probability {alone}"),
        }
    }

    /// What further starts could change: of rivals whose fits are not certified, or of the named fit.
    fn reservation(&self) -> String {
        let [low, high] = self.probability_interval();
        let told = self.posterior.uncertified.iter().take(MOST_RIVALS);
        let mut rivals: Vec<String> = told.map(|rival| names(rival, "no effect")).collect();
        match self.posterior.uncertified.len().saturating_sub(MOST_RIVALS) {
            0 => {}
            1 => rivals.push("one other set".to_owned()),
            others => rivals.push(format!("one of {others} other sets")),
        }
        if high - low >= SLIGHT_CHANGE && !rivals.is_empty() {
            return format!(
                " The fit with {} is not certified: if it fitted as well as the best one, the probability of the answer would be {}.",
                rivals.join("; or with "),
                percent(low)
            );
        }
        let is_named = matches!(self.verdict.status, Status::Identified | Status::Ambiguous);
        let fit = self.named();
        if !is_named || fit.is_certified(&self.context.settings.certificate) {
            return String::new();
        }
        let why = match (fit.converged, fit.certificate.nested_ok, fit.certificate.starts_agreeing) {
            (false, ..) => "it has not converged".to_owned(),
            (_, false, _) => "fewer effects leave less".to_owned(),
            (.., 0 | 1) => "there was time for one start only".to_owned(),
            (.., starts) => format!("only {starts} starts led to it"),
        };
        format!(" The fit of this answer is not certified: {why}.")
    }

    /// What of the table comes nearest to something that is not in it, and what is not told from that.
    fn nearest(&self) -> String {
        let named = &self.posterior.candidates[0];
        let effects = &named.fit.hypothesis.effects;
        if effects.is_empty() {
            return "; none comes clearly closer to the recording than the base model".to_owned();
        }
        let [closest, explains, them] = match effects.len() {
            1 => ["effect of the table is", "It explains", "it"],
            _ => ["effects of the table are", "They explain", "them"],
        };
        let settings = &self.context.settings.verdict;
        let mut others = verdict::not_told_apart(&self.posterior.candidates, |w| w.if_named, settings.told_apart);
        others.retain(|effect| !effects.contains(effect));
        let likely = match 1e2 * named.if_named {
            percent if percent >= 1.0 => format!(" ({percent:.0} % if only the table is considered)"),
            _ => String::new(),
        };
        let apart = match others.len() {
            0 => String::new(),
            _ => format!("; the recording cannot distinguish {them} from {}", words_of_any(&others)),
        };
        format!(
            ". The closest {closest} {}{likely}. {explains} {} of what the base model leaves beyond the noise{apart}",
            words(effects),
            percent_of_all(self.explained())
        )
    }

    /// What remains beside the names, where that is more than noise.
    fn more(&self) -> String {
        let fit = self.named();
        let certainly = is_beyond_noise(fit, &self.context.settings.noise);
        if !(certainly || self.posterior.remains > self.context.settings.verdict.even) {
            return String::new();
        }
        let Some(left) = fit.residuals_of_first() else { return String::new() };
        let rms = |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt();
        let over_noise = fit.over_noise();
        let others = |effect: &&Effect| !self.verdict.effects.contains(effect);
        let beside: Vec<Effect> = fit.hypothesis.effects.iter().filter(others).copied().collect();
        let with = match &beside[..] {
            [] => "That".to_owned(),
            some => format!("Together with {}, less sure, that", words(some)),
        };
        let is_small = over_noise < NEXT_TO_NOISE;
        let size = if is_small {
            "as much as the noise, yet not at random".to_owned()
        } else {
            format!("{} times the noise", number(over_noise, 2))
        };
        let mut words = format!(
            " {with} takes {} of what the base model leaves beyond the noise; {} mrad remain, {size}",
            percent_of_all(self.explained()),
            number(1e3 * rms(&left.rmse_rad), 2),
        );
        if let Some(place) = self.remains_at() {
            let _ = write!(words, ", {}", in_place(place));
        }
        if let Some(hz) = self.remaining.frequency_hz {
            let _ = write!(words, ", {}", self.in_swings(hz));
        }
        words
            + match (self.is_of_table(), is_small) {
                (true, _) => ".",
                (false, true) => ": something small that is not in the table.",
                (false, false) => ": not in the table.",
            }
    }

    /// The law that was learnt of what the names leave.
    fn law(&self) -> String {
        let (Some(learnt), Some(proof)) = (&self.learnt, &self.held_out) else { return String::new() };
        let terms: Vec<String> = learnt.terms.iter().map(words_of_term).collect();
        let beside = &learnt.fit.hypothesis;
        let replaced: Vec<Effect> =
            self.named().hypothesis.effects.iter().copied().filter(|named| !beside.has(*named)).collect();
        let beside = match (beside.effects.is_empty(), &replaced[..]) {
            (true, _) if self.is_of_table() => " It is described best by".to_owned(),
            (true, _) => " It is described best without an effect of the table, by".to_owned(),
            (false, []) => " What remains is described best by".to_owned(),
            (false, replaced) => format!(" It is described best with, in the place of {},", words(replaced)),
        };
        let milli = |of: &[f64]| of.iter().map(|rad| number(1e3 * rad, 2)).collect::<Vec<_>>().join(" and ");
        format!(
            "{beside} {}. In the part that was not fitted {} mrad rms remain with it, {} mrad rms with the named effects alone.{}",
            terms.join(" and "),
            milli(&learnt.prediction.rmse_rad),
            milli(&proof.augmented.rmse_rad),
            self.law_of_table()
        )
    }

    /// The effects of the table that terms of the learnt law are nearly.
    fn law_of_table(&self) -> String {
        let Some(learnt) = &self.learnt else { return String::new() };
        let of_term = |(place, (term, effects)): (usize, (&Term, &Vec<Effect>))| {
            let which = match (learnt.terms.len(), place) {
                (1, _) => "that",
                (_, 0) => "the first of them",
                _ => "the second",
            };
            let effects = (!effects.is_empty()).then(|| words_of_any(effects))?;
            Some(if term.is_by_load() {
                format!(" Here {which} is {effects}, in proportion to the load of the bearing.")
            } else if term.acts_in_a_part() {
                format!(" Here {which} is {effects}, in a part of the swing only.")
            } else {
                format!(" In this motion {which} is nearly the same as {effects}.")
            })
        };
        learnt.terms.iter().zip(&learnt.stand_for).enumerate().filter_map(of_term).collect()
    }

    /// Whether every term of the learnt law is nearly an effect of the table.
    fn is_of_table(&self) -> bool {
        self.learnt.as_ref().is_some_and(|learnt| learnt.stand_for.iter().all(|of_term| !of_term.is_empty()))
    }

    /// A frequency, as a multiple of the swing's where it is one.
    fn in_swings(&self, hz: f64) -> String {
        let base = self.posterior.base();
        let pace =
            base.problem.model(0, &base.x[..base.problem.free.len()]).map(|(model, _)| model.characteristic_rad_s());
        let ratio = pace.map_or(0.0, |pace| hz * std::f64::consts::TAU / pace);
        match ratio.round() as usize {
            1 if (ratio - 1.0).abs() < SAME_FREQUENCY => "at the swing's frequency".to_owned(),
            2 if (ratio - 2.0).abs() < SAME_FREQUENCY => "at twice the swing's frequency".to_owned(),
            3 if (ratio - 3.0).abs() < SAME_FREQUENCY => "at three times the swing's frequency".to_owned(),
            _ => format!("at {hz:.2} Hz"),
        }
    }

    /// What a law's coefficients say beside their values.
    fn remark(&self) -> String {
        let dry_rad = DRY_SHARE * self.context.common_bend_rad();
        let mut remark = String::new();
        if self.named().value(Parameter::HysteresisYield).is_some_and(|yield_rad| yield_rad < dry_rad) {
            remark.push_str(
                " The joint yields at an angle close to zero: this hysteresis acts like dry friction in the joint.",
            );
        }
        if self.verdict.effects.contains(&Effect::DifferentialZero) {
            remark.push_str(
                " A mark beside its link, a pivot that is not where the file says, or the zero of one sensor makes such an offset.",
            );
        }
        if let Some(off) = self.length_off() {
            let (percent, long) = (1e2 * off.abs(), if off > 0.0 { "long" } else { "short" });
            let advice = if percent < FINEST_PERCENT { "no ruler tells so little" } else { "measure them again" };
            let percent = number(percent, 2);
            let _ = write!(remark, " Lengths in the file that are {percent} % too {long} would do the same: {advice}.");
        }
        remark
    }

    /// The part by which lengths that were taken at their word would have to be stated too long to do what the clock does: ω² goes with 1/L. `None` where that is
    /// more than a ruler errs.
    fn length_off(&self) -> Option<f64> {
        let at_their_word = self.context.experiment.specimen.links.is_empty();
        let off = 2.0 * self.named().value(Parameter::TimeBase).filter(|_| at_their_word)?;
        (off.abs() < 2.0 * self.context.settings.search.length_share).then_some(off)
    }

    /// Where and when it acts.
    pub fn place_statement(&self, energy_shares: [f64; 3]) -> String {
        let departure = &self.departure;
        let Some(place) = self.place() else { return String::new() };
        let acts_elsewhere = self.verdict.effects.iter().any(|effect| effect.place() != place);
        let mut statement = match place {
            Place::Hinge if acts_elsewhere => "The effect that explains most acts at the hinge",
            Place::Joint if acts_elsewhere => "The effect that explains most acts in the joint",
            Place::Air if acts_elsewhere => "The effect that explains most acts along the specimen, from outside",
            Place::Hinge => "It acts at the hinge",
            Place::Joint => "It acts in the joint",
            Place::Air => "It acts along the specimen, from outside",
            Place::Camera if acts_elsewhere => "The effect that explains most is an error of the measurement",
            // what acts on the specimen may look the same
            Place::Camera if self.verdict.class.iter().any(|effect| effect.place() != Place::Camera) => {
                "It is an error of the measurement, or a cause that the recording cannot distinguish from one"
            }
            Place::Camera if self.verdict.status == Status::Unknown => {
                "It looks like an error of what measures the angles rather than of the model"
            }
            Place::Camera if self.length_off().is_some() => {
                "It is an error of the clock, or of the lengths in the file"
            }
            Place::Camera => "It looks like an error of the measurement, not of the model",
        }
        .to_owned();
        let phase = self.phase().filter(|_| place != Place::Camera);
        if let Some(phase) = phase {
            let _ = write!(statement, ", {}", phase.words());
        }
        if let (Some([from_s, until_s]), Some([least, most])) = (departure.time_s, departure.amplitude_rad) {
            let _ = write!(
                statement,
                ". From {:.2} s to {until_s:.2} s the base model differs from the recording by more than the noise, at amplitudes of {least:.3} to {most:.3} rad ({:.1}° to {:.1}°)",
                // no stamp of next to nothing is said to be less than that
                if from_s.abs() < 5e-3 { 0.0 } else { from_s },
                least.to_degrees(),
                most.to_degrees()
            );
        }
        if let Some(torque) = self.missing_torque.as_ref().filter(|t| t.place != Place::Camera && t.place == place) {
            let _ = write!(statement, ". {}", words_of_torque(torque, phase));
        }
        // names that are not the answer, or not all of it, do not say where the energy goes
        let is_known = self.verdict.status != Status::Unknown && self.learnt.is_none();
        let shares = energy_shares;
        if is_known && shares.iter().sum::<f64>() > 0.0 {
            let [hinge, joint, air] = shares.map(|share| format!("{:.0} %", 1e2 * share));
            let in_joint = if self.context.marks() > 1 { format!(", {joint} in the joint") } else { String::new() };
            let _ = write!(
                statement,
                ". Of the dissipated energy {hinge} is lost at the hinge{in_joint} and {air} to the air"
            );
        }
        statement.push('.');
        statement
    }
}

/// A term of a law, with its place and unit.
fn words_of_term(term: &Term) -> String {
    let place = match (term.law.place, term.law.joint) {
        (LawPlace::Joint, Some(joint)) => &format!("a torque in the joint below link {joint}"),
        (LawPlace::Hinge, _) => "a torque at the hinge",
        (LawPlace::Joint, None) => "a torque in the joint",
        (LawPlace::Strip, _) => "a force per length across the strip",
        (LawPlace::Tip, _) => "a force across the tip",
        (LawPlace::Support, _) => "an acceleration of the support",
    };
    format!("{place} of {} {}", term.formula_with_values(), term.law.place.unit())
}

/// A share as a percentage, with as many digits as it takes to tell it from all.
fn percent_of_all(share: f64) -> String {
    let digits = if share > 0.999 { 2 } else { 1 };
    if share > 0.9999 { "more than 99.99 %".to_owned() } else { format!("{:.digits$} %", 1e2 * share) }
}

/// A probability; none is said to be certain.
fn percent(probability: f64) -> String {
    match 1e2 * probability {
        percent if percent >= 99.5 => "more than 99 %".to_owned(),
        percent if percent < 0.5 => "less than 1 %".to_owned(),
        percent => format!("{percent:.0} %"),
    }
}

fn in_place(place: Place) -> &'static str {
    match place {
        Place::Hinge => "at the hinge",
        Place::Joint => "in the joint",
        Place::Air => "along the specimen",
        Place::Camera => "in the measured angles",
    }
}

/// What the smoothed torque says by itself.
fn words_of_torque(torque: &MissingTorque, phase: Option<Phase>) -> String {
    let place = in_place(torque.place);
    let mut words =
        format!("The missing torque {place}, estimated without a law, is {} N m rms", number(torque.rms, 2));
    match torque.frequency_hz {
        Some(hz) => {
            let _ = write!(words, ", strongest at {hz:.2} Hz");
        }
        None if torque.steady => words.push_str(", most of it steady"),
        None => {}
    }
    // what is steady or goes with the position takes and gives back
    let takes = phase != Some(Phase::Position) && !torque.steady;
    if let Some(share) = torque.energy_share.filter(|_| takes) {
        // it is estimated beside the energy lost, and nothing takes more than all of it
        let part = format!("{:.0} % of the dissipated energy", 1e2 * share.abs());
        let does = match share {
            ..=-1.0 => "it supplies more energy than is dissipated".to_owned(),
            1.0.. => "it takes about all of the dissipated energy".to_owned(),
            ..0.0 => format!("it supplies as much as {part}"),
            _ => format!("it takes {part}"),
        };
        let _ = write!(words, "; {does}");
    }
    words
}

/// Identifiers, one after another.
pub fn names(effects: &[Effect], none: &str) -> String {
    if effects.is_empty() { none.to_owned() } else { effects.iter().map(|c| c.id()).collect::<Vec<_>>().join(", ") }
}

/// All of some effects.
fn words(effects: &[Effect]) -> String {
    words_joined(effects, "and")
}

/// One of some effects.
fn words_of_any(effects: &[Effect]) -> String {
    words_joined(effects, "or")
}

fn words_joined(effects: &[Effect], by: &str) -> String {
    let words: Vec<String> = effects.iter().map(|c| format!("{} ({})", c.words(), c.id())).collect();
    match &words[..] {
        [first @ .., before, last] => [first, &[format!("{before} {by} {last}")]].concat().join(", "),
        few => few.concat(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::grammar::{StateRange, terms};

    #[test]
    fn each_term_of_a_law_is_said_with_its_own_place_and_unit() {
        let of = |place, formula: &str| {
            let largest = StateRange { angle: 0.5, rate: 4.0, time_s: 30.0 };
            let mut term = terms(place, largest).into_iter().find(|term| term.law.formula == formula).unwrap();
            term.law.parameters.get_mut("a").unwrap().start = 0.02;
            words_of_term(&term)
        };
        let drag = of(LawPlace::Strip, "-a * wind * abs(wind)");
        assert_eq!(drag, "a force per length across the strip of -2.000e-2 * wind * abs(wind) N/m");
        assert_eq!(of(LawPlace::Joint, "-a * rate"), "a torque in the joint of -2.000e-2 * rate N m");
    }

    #[test]
    fn effects_that_are_not_told_apart_are_joined_by_or() {
        let words = words_of_any(&[Effect::CameraTilt, Effect::SideForce]);
        assert!(words.contains(" (camera_tilt) or ") && words.ends_with("(side_force)"), "{words}");
    }
}
