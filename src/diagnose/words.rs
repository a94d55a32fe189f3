//! What a diagnosis says in words.

use std::fmt::Write;

use super::effect::{Effect, Place};
use super::findings::Findings;
use super::misfit::is_beyond_noise;
use super::torque::MissingTorque;
use super::verdict::{self, Status};
use crate::digits::number;
use crate::model::Parameter;

/// A change of a probability that is worth a sentence.
const SLIGHT_CHANGE: f64 = 0.01;
/// A joint that yields before this part of its largest bend is dry.
const DRY_SHARE: f64 = 0.01;

impl Findings<'_> {
    /// What is missing, and how sure that is.
    pub fn verdict_statement(&self) -> String {
        let verdict = &self.verdict;
        let percent = 1e2 * verdict.probability;
        let reservation = self.reservation();
        let statement = match verdict.status {
            Status::Adequate => format!(
                "Nothing is missing that this recording could show: the base model leaves only noise ({percent:.0} %)."
            ),
            Status::Unknown => format!(
                "Something is missing that is not in the table of effects ({percent:.0} %): no named law, nor several of them, leaves only noise{}.",
                self.nearest()
            ),
            Status::Identified => {
                format!("Missing: {} ({percent:.0} %).{}{}", words(&verdict.effects), self.remark(), self.more())
            }
            Status::Ambiguous => {
                let others = if verdict.class.len() > verdict.effects.len() {
                    format!(", but the recording does not tell it from others: {}", names(&verdict.class, ""))
                } else {
                    format!(", or something outside the table that it resembles ({:.0} %)", 1e2 * verdict.unknown)
                };
                let (effects, remark, more) = (words(&verdict.effects), self.remark(), self.more());
                format!("Missing: most likely {effects} ({percent:.0} %){others}.{remark}{more}")
            }
        };
        statement + &reservation
    }

    /// What rivals whose fits are not certified could change.
    fn reservation(&self) -> String {
        let [low, high] = self.probability_interval();
        let rivals: Vec<String> = self.posterior.uncertified.iter().map(|rival| names(rival, "nothing else")).collect();
        if high - low < SLIGHT_CHANGE || rivals.is_empty() {
            return String::new();
        }
        format!(
            " Too few starts of the search agree on {}: if that fitted as well, the probability would be {:.0} %.",
            rivals.join("; "),
            1e2 * low
        )
    }

    /// What of the table comes nearest to something that is not in it, and what is not told from that.
    fn nearest(&self) -> String {
        let named = &self.posterior.candidates[0];
        let effects = &named.fit.hypothesis.effects;
        if effects.is_empty() {
            return "; no law of the table comes nearer than the base model".to_owned();
        }
        let [comes, explains, them] = match effects.len() {
            1 => ["comes", "it explains", "it"],
            _ => ["come", "they explain", "them"],
        };
        let settings = &self.context.settings.verdict;
        let mut others = verdict::not_told_apart(&self.posterior.candidates, |w| w.if_named, settings.told_apart);
        others.retain(|effect| !effects.contains(effect));
        let apart = match others.len() {
            0 => String::new(),
            _ => format!("; the recording does not tell {them} from {}", names(&others, "")),
        };
        format!(
            ". Of the table {} {comes} nearest ({:.0} % among the named): {explains} {:.1} % of what the base model leaves beyond the noise{apart}",
            words(effects),
            1e2 * named.if_named,
            1e2 * self.explained()
        )
    }

    /// What names that leave far more than noise do not explain.
    fn more(&self) -> String {
        let fit = self.named();
        if !is_beyond_noise(fit, &self.context.settings.noise) {
            return String::new();
        }
        format!(
            " Of the table they come nearest and explain {:.1} % of what the base model leaves, but what is left is still {:.0} times the noise: something that is \
             not in the table is missing beside them, or in their place.",
            1e2 * self.explained(),
            fit.over_noise()
        )
    }

    /// What a law's coefficients say beside their values.
    fn remark(&self) -> &'static str {
        let dry_rad = DRY_SHARE * self.context.largest_bend_rad();
        match self.named().value(Parameter::HysteresisYield) {
            Some(yield_rad) if yield_rad < dry_rad => {
                " The joint yields at next to no angle: that is dry friction in it."
            }
            _ => "",
        }
    }

    /// Where and when it acts.
    pub fn place_statement(&self, energy_shares: [f64; 3]) -> String {
        let departure = &self.departure;
        let Some(place) = self.place() else { return String::new() };
        let mut statement = match place {
            Place::Hinge => "It acts at the hinge",
            Place::Joint => "It acts in the joint",
            Place::Air => "It acts from outside along the strip",
            Place::Camera => "It is an error of the camera, not of the model",
        }
        .to_owned();
        if let Some(phase) = self.phase().filter(|_| place != Place::Camera) {
            let _ = write!(statement, ", in phase with the {}", phase.id());
        }
        if let (Some([from_s, until_s]), Some([least, most])) = (departure.time_s, departure.amplitude_rad) {
            let _ = write!(
                statement,
                "; the base model departs from {from_s:.2} s to {until_s:.2} s, at amplitudes of {least:.3} to {most:.3} rad"
            );
        }
        if let Some(torque) = self.missing_torque.as_ref().filter(|t| t.place != Place::Camera) {
            let _ = write!(statement, ". {}", words_of_torque(torque));
        }
        let shares = energy_shares;
        if shares.iter().sum::<f64>() > 0.0 {
            let _ = write!(
                statement,
                ". Of the energy lost {:.0} % go at the hinge, {:.0} % in the joint, {:.0} % to the air",
                1e2 * shares[0],
                1e2 * shares[1],
                1e2 * shares[2]
            );
        }
        statement.push('.');
        statement
    }
}

/// What the smoothed torque says by itself.
fn words_of_torque(torque: &MissingTorque) -> String {
    let place = match torque.place {
        Place::Hinge => "at the hinge",
        Place::Joint => "in the joint",
        Place::Air | Place::Camera => "along the strip",
    };
    let mut words = format!("A torque without a law would do {place}, of {} N m rms", number(torque.rms, 2));
    if let Some(hz) = torque.frequency_hz {
        let _ = write!(words, ", strongest at {hz:.2} Hz");
    }
    if let Some(share) = torque.energy_share {
        let does = if share < 0.0 { "puts in as much as" } else { "takes" };
        // it is estimated beside the energy lost, and nothing takes more than all of it
        let _ = write!(words, ", that {does} {:.0} % of the energy lost", 1e2 * share.abs().min(1.0));
    }
    words
}

/// Identifiers, one after another.
pub fn names(effects: &[Effect], none: &str) -> String {
    if effects.is_empty() { none.to_owned() } else { effects.iter().map(|c| c.id()).collect::<Vec<_>>().join(", ") }
}

fn words(effects: &[Effect]) -> String {
    let words: Vec<String> = effects.iter().map(|c| format!("{} ({})", c.words(), c.id())).collect();
    match &words[..] {
        [first @ .., before, last] => [first, &[format!("{before} and {last}")]].concat().join(", "),
        few => few.concat(),
    }
}
