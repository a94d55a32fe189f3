//! What a diagnosis says in words.

use std::fmt::Write;

use crate::cli::table::number;
use crate::diagnose::{Cause, Diagnosis, MissingTorque, Phase, Place, Status, verdict};
use crate::model::Parameter;

/// A joint that yields before this part of its largest bend is dry.
const DRY_SHARE: f64 = 0.01;

/// The statements of a diagnosis.
pub(super) struct Statements<'a> {
    /// Of which.
    pub diagnosis: &'a Diagnosis<'a>,
}

impl Statements<'_> {
    /// What is missing, and how sure that is.
    pub fn verdict(&self) -> String {
        let verdict = &self.diagnosis.verdict;
        let percent = 1e2 * verdict.probability;
        match verdict.status {
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
        }
    }

    /// What of the table comes nearest to something that is not in it, and what is not told from that.
    fn nearest(&self) -> String {
        let named = &self.diagnosis.weighed[0];
        let causes = &named.fit.hypothesis.causes;
        if causes.is_empty() {
            return "; no law of the table comes nearer than the base model".to_owned();
        }
        let [comes, explains, them] = match causes.len() {
            1 => ["comes", "it explains", "it"],
            _ => ["come", "they explain", "them"],
        };
        let mut others = verdict::not_told_apart(&self.diagnosis.weighed, |w| w.if_named);
        others.retain(|cause| !causes.contains(cause));
        let apart = match others.len() {
            0 => String::new(),
            _ => format!("; the recording does not tell {them} from {}", names(&others, "")),
        };
        format!(
            ". Of the table {} {comes} nearest ({:.0} % among the named): {explains} {:.1} % of what the base model leaves beyond the noise{apart}",
            words(causes),
            1e2 * named.if_named,
            1e2 * self.diagnosis.explained()
        )
    }

    /// What names that leave far more than noise do not explain.
    fn more(&self) -> String {
        let fit = self.diagnosis.named();
        if !verdict::is_beyond_noise(fit) {
            return String::new();
        }
        format!(
            " Of the table they come nearest and explain {:.1} % of what the base model leaves, but what is left is still {:.0} times the noise: something that is \
             not in the table is missing beside them, or in their place.",
            1e2 * self.diagnosis.explained(),
            verdict::over_noise(fit)
        )
    }

    /// What a law's coefficients say beside their values.
    fn remark(&self) -> &'static str {
        let dry_rad = DRY_SHARE * self.diagnosis.ground.largest_bend_rad();
        match self.diagnosis.named().value(Parameter::HysteresisYield) {
            Some(yield_rad) if yield_rad < dry_rad => {
                " The joint yields at next to no angle: that is dry friction in it."
            }
            _ => "",
        }
    }

    /// With what the missing torque goes.
    pub fn phase(&self) -> Option<Phase> {
        match self.diagnosis.verdict.status {
            Status::Adequate => None,
            Status::Unknown => {
                let of_torque = self.diagnosis.missing_torque.as_ref().and_then(|t| t.phase);
                of_torque.or(self.diagnosis.departure.goes_with)
            }
            _ => self.diagnosis.named_effects().first().copied().and_then(Phase::of),
        }
    }

    /// Where and when it acts.
    pub fn place(&self) -> String {
        let departure = &self.diagnosis.departure;
        let Some(place) = self.diagnosis.place() else { return String::new() };
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
        if let Some(torque) = self.diagnosis.missing_torque.as_ref().filter(|t| t.place != Place::Camera) {
            let _ = write!(statement, ". {}", words_of_torque(torque));
        }
        let shares = self.diagnosis.energy_shares;
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
pub(super) fn names(causes: &[Cause], none: &str) -> String {
    if causes.is_empty() { none.to_owned() } else { causes.iter().map(|c| c.id()).collect::<Vec<_>>().join(", ") }
}

fn words(causes: &[Cause]) -> String {
    let words: Vec<String> = causes.iter().map(|c| format!("{} ({})", c.words(), c.id())).collect();
    match &words[..] {
        [first @ .., before, last] => [first, &[format!("{before} and {last}")]].concat().join(", "),
        few => few.concat(),
    }
}
