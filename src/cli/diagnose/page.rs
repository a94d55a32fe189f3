//! What a person reads: the words, the candidates, the proof.

use std::fmt::Write;

use crate::cli::table::{Table, number, paragraph};
use crate::diagnose::report::Pieces;
use crate::diagnose::statements::names;
use crate::diagnose::{Detectable, Diagnosis, Effect, Status};

/// Candidates listed.
const LISTED: usize = 6;
/// Smaller probabilities are not told from one another.
const LEAST: f64 = 1e-3;

/// The page of a diagnosis.
pub(super) fn page(diagnosis: &Diagnosis) -> String {
    let verdict = &diagnosis.verdict;
    let mut text = format!("{}\n\n", diagnosis.specimen);
    text.push_str(&paragraph("", &verdict.statement));
    text.push_str(&paragraph("", &diagnosis.location.statement));
    if let Some(advice) = &verdict.to_decide {
        text.push_str(&paragraph("", &format!("To decide: {advice}.")));
    }
    if !diagnosis.undecided.is_empty() {
        let rounds = diagnosis.undecided.join(", ");
        text.push_str(&paragraph(
            "",
            &format!("The search reached its limit of computation. Not done, or not finished: {rounds}."),
        ));
    }
    if let Some(Pieces { count, length_s }) = diagnosis.pieces {
        let pieces = format!(
            "The recording was cut into {count} pieces of {length_s:.1} s, each fitted with its own start, because the small errors of a model add up over a whole recording."
        );
        text.push_str(&paragraph("", &pieces));
    }
    text.push('\n');
    // where something remains beside the names, they are weighed among themselves
    let among = verdict.among_themselves;
    let heading = if among { "among these" } else { "probability" };
    let mut table = Table::new(["the base model and", heading, "residual mrad", "coefficient", "sd", "unit"]);
    for candidate in diagnosis.candidates.iter().take(LISTED) {
        let left = candidate.rmse_rad.iter().map(|r| number(1e3 * r, 3)).collect::<Vec<_>>().join(" ");
        let probability = if among { candidate.probability_if_named } else { candidate.probability };
        let mark = if candidate.fit.certified { "" } else { " *" };
        let mut effects = names(&candidate.effects, "nothing else");
        if let Some(at_s) = candidate.dropped_at_s {
            let id = Effect::DroppedFrames.id();
            effects = effects.replacen(id, &format!("{id} at {at_s:.2} s"), 1);
        }
        let mut first = [effects + mark, of_one(probability), left];
        for (parameter, quantity) in &candidate.coefficients {
            let [name, probability, left] = std::mem::take(&mut first);
            let value = number(quantity.value.unwrap_or(0.0), 4);
            // of an effect with several coefficients each is told by its own name
            let own = parameter.id().split_once('.').map(|(_, own)| without_unit(own).replace('_', " "));
            let which = own.map_or(String::new(), |own| format!(" ({own})"));
            table.row([name, probability, left, value, number(quantity.sd, 2), quantity.unit.to_owned() + &which]);
        }
        if !first[0].is_empty() {
            let [name, probability, left] = first;
            table.row([name, probability, left]);
        }
    }
    if !among || verdict.status == Status::Unknown {
        table.row(["something not in the table".to_owned(), of_one(verdict.unknown_probability)]);
    }
    text.push_str(&table.text());
    if diagnosis.candidates.iter().take(LISTED).any(|candidate| !candidate.fit.certified) {
        text.push_str(
            "  * not certified: it has not converged, too few starts led to this fit, or fewer effects leave less\n",
        );
    }
    proof(diagnosis, &mut text);
    limits(diagnosis, &mut text);
    text
}

/// A probability, as far as anybody reads it.
fn of_one(probability: f64) -> String {
    if probability < LEAST { format!("<{LEAST}") } else { number(probability, 3) }
}

/// A key without the unit at its end.
fn without_unit(key: &str) -> &str {
    ["_n_m", "_rad", "_hz", "_m"].iter().find_map(|unit| key.strip_suffix(unit)).unwrap_or(key)
}

/// What was not fitted.
fn proof(diagnosis: &Diagnosis, text: &mut String) {
    let Some(held_out) = &diagnosis.heldout else { return };
    let noise_rad = &held_out.noise_rad;
    let _ = writeln!(text, "\n{}:", held_out.words());
    let learnt = diagnosis.verdict.law.as_ref();
    let last = if learnt.is_some() { "with the law that was learnt" } else { "" };
    let mut table = Table::new(["", "noise mrad", "base model leaves", "with the effects named", last]);
    for link in 0..noise_rad.len() {
        let milli = |rad: f64| number(1e3 * rad, 3);
        let of_law = learnt.map_or(String::new(), |_| milli(held_out.augmented_rmse_rad[link]));
        table.row([
            format!("θ{}", link + 1),
            milli(noise_rad[link]),
            milli(held_out.baseline_rmse_rad[link]),
            milli(held_out.named_rmse_rad[link]),
            of_law,
        ]);
    }
    text.push_str(&table.text());
    if let Some(law) = learnt {
        text.push_str("\nFor the experiment file:\n");
        law.toml.lines().for_each(|line| _ = writeln!(text, "  {line}"));
    }
}

/// What could have been seen, where nothing was.
fn limits(diagnosis: &Diagnosis, text: &mut String) {
    if diagnosis.verdict.status != Status::Adequate || diagnosis.detectable.0.is_empty() {
        return;
    }
    text.push_str("\nThis recording would have shown\n");
    text.push_str(&limits_table(&diagnosis.detectable.0));
}

/// From which amounts on each effect is seen and named.
pub(super) fn limits_table(limits: &[Detectable]) -> String {
    let mut table = Table::new(["effect", "seen from", "named from", "unit", "cannot be told from"]);
    for limit in limits {
        let amount = |value: f64| if value.is_finite() { number(value, 2) } else { "never".to_owned() };
        table.row([
            limit.effect.id().to_owned(),
            amount(limit.smallest),
            amount(limit.named),
            limit.parameter.unit().to_owned(),
            names(&limit.confused_with, ""),
        ]);
    }
    table.text()
}
