//! What a person reads: the words, the candidates, the proof.

use std::fmt::Write;

use super::rmse_rad;
use super::words::{Statements, names};
use crate::cli::table::{Table, number, paragraph};
use crate::diagnose::{Detectable, Diagnosis, Refit, Status, verdict};
use crate::model::Parameter;

/// Candidates listed.
const LISTED: usize = 6;

/// The page of a diagnosis.
pub(super) fn page(diagnosis: &Diagnosis<'_>, specimen: &str) -> String {
    let statements = Statements { diagnosis };
    let mut text = format!("{specimen}\n\n");
    text.push_str(&paragraph("", &statements.verdict()));
    text.push_str(&paragraph("", &statements.place()));
    if let Some(advice) = &diagnosis.verdict.to_decide {
        text.push_str(&paragraph("", &format!("To decide: {advice}.")));
    }
    text.push('\n');
    // where the names stand although more is missing, they are weighed among themselves
    let among = verdict::is_beyond_noise(diagnosis.named());
    let probability = if among { "among these" } else { "probability" };
    let mut table = Table::new(["the base model and", probability, "left mrad", "coefficient", "sd", "unit"]);
    for weighed in diagnosis.weighed.iter().take(LISTED) {
        let left = rmse_rad(&weighed.fit).iter().map(|r| number(1e3 * r, 3)).collect::<Vec<_>>().join(" ");
        let probability = if among { weighed.if_named } else { weighed.probability };
        let mut first = [names(&weighed.fit.hypothesis.causes, "nothing else"), number(probability.max(0.0), 3), left];
        for (parameter, value, sd) in coefficients(&weighed.fit) {
            let [name, probability, left] = std::mem::take(&mut first);
            table.row([name, probability, left, number(value, 4), number(sd, 2), parameter.unit().to_owned()]);
        }
        if !first[0].is_empty() {
            let [name, probability, left] = first;
            table.row([name, probability, left]);
        }
    }
    table.row(["something not in the table".to_owned(), number(diagnosis.verdict.unknown, 3)]);
    text.push_str(&table.text());
    proof(diagnosis, &mut text);
    limits(diagnosis, &mut text);
    text
}

/// What was not fitted.
fn proof(diagnosis: &Diagnosis<'_>, text: &mut String) {
    let Some(held_out) = &diagnosis.held_out else { return };
    let noise_rad = &diagnosis.ground.noise[held_out.record].sd_rad;
    let _ = writeln!(text, "\nFitted before {:.2} s, predicted from there on:", held_out.from_s);
    let mut table = Table::new(["", "noise mrad", "base model leaves", "with the effects named"]);
    for link in 0..noise_rad.len() {
        let milli = |rad: f64| number(1e3 * rad, 3);
        table.row([
            format!("θ{}", link + 1),
            milli(noise_rad[link]),
            milli(held_out.baseline_rad[link]),
            milli(held_out.augmented_rad[link]),
        ]);
    }
    text.push_str(&table.text());
}

/// What could have been seen, where nothing was.
fn limits(diagnosis: &Diagnosis<'_>, text: &mut String) {
    if diagnosis.verdict.status != Status::Adequate || diagnosis.detectable.is_empty() {
        return;
    }
    text.push_str("\nThis recording would have shown\n");
    text.push_str(&limits_table(&diagnosis.detectable));
}

/// From which amounts on each effect is seen and named.
pub(super) fn limits_table(limits: &[Detectable]) -> String {
    let mut table = Table::new(["effect", "from", "named from", "unit", "not told from"]);
    for limit in limits {
        let amount = |value: f64| if value.is_finite() { number(value, 2) } else { "never".to_owned() };
        table.row([
            limit.cause.id().to_owned(),
            amount(limit.smallest),
            amount(limit.named),
            limit.parameter.unit().to_owned(),
            names(&limit.confused_with, ""),
        ]);
    }
    table.text()
}

/// Coefficients of the added effects with their standard deviations.
fn coefficients(fit: &Refit<'_>) -> Vec<(Parameter, f64, f64)> {
    let added = fit.added();
    let covariance = fit.covariance(&added);
    let of = |(i, p): (usize, &Parameter)| (*p, fit.value(*p).unwrap_or(0.0), covariance[(i, i)].sqrt());
    added.iter().enumerate().map(of).collect()
}
