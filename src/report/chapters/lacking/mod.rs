//! What the model lacks: names, proof, the law, and where it acts.

mod places;
mod prediction;

pub use places::places;

use std::fmt::Write;

use super::{Chapter, times};
use crate::diagnose::{Effect, Phase};
use crate::report::html::{escaped, milli, paragraph, table, value, verbatim, verbatim_copyable, with_half};
use crate::report::left::{Candidate, Diagnosed, Law, Left, Remainder};
use crate::report::plot::{Axis, Ink, Plot, Series, Style};
use prediction::{before_and_after, swing};

/// Explanations in the table.
const LISTED: usize = 6;
/// Effects in the figure.
const FEWEST_NAMES: usize = 3;
const MOST_NAMES: usize = 12;
/// Less probable ones are not worth a row.
const LIKELY: f64 = 1e-3;

/// The chapter.
pub fn chapter(left: &Left) -> Chapter {
    let mut chapter = Chapter::new("missing", "What the model lacks");
    let Some(found) = &left.diagnosis else { return chapter };
    let verdict = &found.verdict;
    chapter.words(format!("<p class=\"verdict\">{}</p>\n", escaped(&verdict.statement)));
    if let Some(advice) = verdict.to_decide.as_ref().filter(|advice| !advice.is_empty()) {
        let class: Vec<String> = verdict.class.iter().map(|id| words(id)).collect();
        let class = if class.len() > 1 {
            format!("The recording cannot distinguish these: {}.", class.join("; "))
        } else {
            String::new()
        };
        chapter.words(format!(
            "<h3>What the recording cannot distinguish, and the measurement that would</h3>\n{}<p class=\"decide\">{}</p>\n",
            if class.is_empty() { class } else { paragraph(&class) },
            escaped(advice)
        ));
    }
    chapter.plot(inclusion(found));
    chapter.words(candidates(found));
    chapter.words(proof(found));
    if let Some(first) = left.together().first() {
        chapter.words(paragraph(&format!("The figures show the first recording, {first}, fitted as a whole.")));
    }
    if let Some(curves) = &left.diagnosis_curves {
        for link in 1..=curves.links() {
            chapter.plot(swing(left, found, curves, link));
        }
        for link in 1..=curves.links() {
            chapter.plot(before_and_after(found, curves, link));
        }
    }
    if let Some(remainder) = &verdict.remainder {
        chapter.words(remains(remainder));
    }
    if let Some(law) = &verdict.law {
        chapter.words(learnt(law));
    }
    chapter.words(limits(found));
    chapter
}

/// An effect in words, with its name in files.
fn words(id: &str) -> String {
    let known = Effect::ALL.into_iter().find(|effect| effect.id() == id);
    known.map_or_else(|| id.to_owned(), |effect| format!("{} ({id})", effect.words()))
}

fn inclusion(found: &Diagnosed) -> Plot {
    let mut names: Vec<(&String, f64)> =
        found.verdict.inclusion.iter().filter_map(|(id, p)| Some((id, (*p)?))).collect();
    names.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(b.0)));
    let likely = names.iter().filter(|(_, p)| *p >= LIKELY).count();
    names.truncate(likely.clamp(FEWEST_NAMES, MOST_NAMES));
    let said = names.iter().take(4).map(|(id, p)| format!("{id} {p:.3}")).collect::<Vec<_>>().join(", ");
    let rows: Vec<String> = names.iter().map(|(id, _)| (*id).clone()).collect();
    // bars are drawn in the order of their length
    let ordered: Vec<(f64, usize)> = names.iter().enumerate().map(|(row, (_, p))| (*p, row + 1)).rev().collect();
    Plot {
        id: "inclusion".into(),
        title: "Probability of each effect".into(),
        alternative: format!("Probability that each effect is at work, the largest: {said}"),
        caption: "The sum over all explanations that hold the effect, whatever else remains. Effects that are not shown are less probable.".into(),
        x: Axis { range: Some([0.0, 1.0]), ..Axis::of("probability", "") },
        y: Axis { label: "effect".into(), rows, ..Axis::default() },
        at: ordered.iter().map(|p| p.0).collect(),
        series: vec![Series {
            name: "probability".into(),
            ink: Ink::Blue,
            style: Style::Bars,
            values: ordered.iter().map(|p| Some(p.1 as f64)).collect(),
            ..Series::default()
        }],
        ..Plot::default()
    }
}

fn candidates(found: &Diagnosed) -> String {
    let among = found.verdict.among_themselves;
    let probability = |c: &Candidate| if among { c.probability_if_named } else { c.probability };
    let listed = found.candidates.iter().take(LISTED).enumerate();
    let listed = listed.filter(|(k, c)| *k < 2 || probability(c).is_some_and(|p| p >= LIKELY));
    let rows = listed.map(|(_, candidate)| {
        let names = candidate.effects.iter().map(|id| escaped(&words(id))).collect::<Vec<_>>().join("<br>");
        let names = if names.is_empty() { "the base model alone".to_owned() } else { names };
        let coefficients = candidate
            .parameters
            .iter()
            .map(|(id, q)| format!("<code>{}</code> {}", escaped(id), with_half(q.value, q.sd, &q.unit)));
        let coefficients = coefficients.collect::<Vec<_>>().join("<br>");
        let left = (0..candidate.rmse_rad.len())
            .map(|link| milli(&candidate.rmse_rad, link, "mrad"))
            .collect::<Vec<_>>()
            .join(", ");
        vec![names, value(probability(candidate), 3, ""), coefficients, left]
    });
    let unknown = vec!["something not in the table".to_owned(), value(found.verdict.unknown_probability, 3, "")];
    let unknown = (!among || found.verdict.status == "unknown").then_some(unknown);
    let heading = if among { "probability among these" } else { "probability" };
    let rows: Vec<Vec<String>> = rows.chain(unknown).collect();
    "<h3>Explanations compared</h3>\n".to_owned()
        + &table(&["the base model and", heading, "coefficient ± 1 sd", "residual of the angles (rms)"], rows)
}

fn proof(found: &Diagnosed) -> String {
    let Some(heldout) = &found.heldout else { return String::new() };
    let from = match heldout.from_s {
        _ if heldout.whole_recording => {
            format!("Fitted to the other recordings, predicted for {}. ", heldout.recording)
        }
        Some(s) => format!("Fitted before {s:.2} s, predicted from there on. "),
        None => String::new(),
    };
    let rows = (0..heldout.baseline_rmse_rad.len()).map(|link| {
        let mut row = vec![
            format!("θ{}", link + 1),
            milli(&found.baseline.noise_rad, link, "mrad"),
            milli(&heldout.baseline_rmse_rad, link, "mrad"),
            milli(&heldout.named_rmse_rad, link, "mrad"),
        ];
        if found.verdict.law.is_some() {
            row.push(milli(&heldout.augmented_rmse_rad, link, "mrad"));
        }
        row
    });
    let headings =
        ["angle", "noise (1 sd)", "base model leaves", "with the effects named", "with the law that was learnt"];
    let headings = if found.verdict.law.is_some() { &headings[..] } else { &headings[..4] };
    format!(
        "<h3>Check: the prediction of what was not fitted</h3>\n{}{}",
        paragraph(&format!("{from}Any fit improves with more parameters; a prediction does not.")),
        table(headings, rows)
    )
}

fn remains(remainder: &Remainder) -> String {
    let place = [remainder.place.as_ref().map(|p| at(p)), remainder.phase.as_deref().and_then(in_phase)];
    let place: Vec<String> = place.into_iter().flatten().collect();
    let mut html = "<h3>What remains beside the effects named</h3>\n".to_owned();
    let rows = (0..remainder.rms_rad.len()).map(|link| {
        vec![
            format!("θ{}", link + 1),
            milli(&remainder.rms_rad, link, "mrad"),
            value(remainder.over_noise.get(link).copied().flatten(), 3, ""),
        ]
    });
    let _ = write!(html, "<p>The probability that it is more than noise is {}", value(remainder.present, 3, ""));
    if !place.is_empty() {
        let _ = write!(html, "; it would act {}", escaped(&place.join(", ")));
    }
    if remainder.frequency_hz.is_some() {
        let _ = write!(html, ", strongest at {}", value(remainder.frequency_hz, 4, "Hz"));
    }
    let _ = writeln!(html, ".</p>");
    html + &table(&["angle", "residual (rms)", "over the noise"], rows)
}

fn in_phase(id: &str) -> Option<String> {
    let known = [Phase::Position, Phase::Velocity].into_iter().find(|phase| phase.id() == id);
    known.map(|phase| phase.words().to_owned())
}

fn at(place: &str) -> String {
    match place {
        "hinge" => "at the hinge".to_owned(),
        "joint" => "in the joint".to_owned(),
        "air" => "along the specimen, as air does".to_owned(),
        "camera" => "in the camera".to_owned(),
        other => other.to_owned(),
    }
}

fn learnt(law: &Law) -> String {
    let others = law.alternatives.iter().map(|a| format!("<code>{}</code>", escaped(&a.formula))).collect::<Vec<_>>();
    let others = if others.is_empty() {
        String::new()
    } else {
        format!("<p class=\"note\">Other formulas that fit nearly as well: {}</p>\n", others.join("; "))
    };
    format!(
        "<h3>The law that was learnt</h3>\n<p>It acts {}: {} ({})</p>\n{others}<p>For the experiment file:</p>\n{}",
        escaped(&at(&law.place)),
        verbatim_copyable(&law.formula),
        escaped(&law.unit),
        verbatim(&law.toml)
    )
}

fn limits(found: &Diagnosed) -> String {
    if found.detectable.is_empty() {
        return String::new();
    }
    let never = |v: Option<f64>, unit: &str| v.map_or_else(|| "never".to_owned(), |v| value(Some(v), 2, unit));
    let rows = found.detectable.iter().map(|(id, d)| {
        vec![
            escaped(&words(id)),
            never(d.smallest, &d.unit),
            never(d.named_from, &d.unit),
            escaped(&d.confused_with.join(", ")),
        ]
    });
    let rows = table(&["effect", "would have been seen from", "named from", "cannot be told from"], rows);
    format!("<details><summary>What this recording could have shown</summary>\n{rows}</details>\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::left::HeldOut;

    #[test]
    fn what_was_predicted_is_said() {
        let heldout = |whole_recording: bool| HeldOut {
            from_s: Some(0.0),
            recording: "large/angles.csv".into(),
            whole_recording,
            ..HeldOut::default()
        };
        let said = |heldout: HeldOut| proof(&Diagnosed { heldout: Some(heldout), ..Diagnosed::default() });
        assert!(said(heldout(true)).contains("Fitted to the other recordings, predicted for large/angles.csv."));
        assert!(said(heldout(false)).contains("Fitted before 0.00 s, predicted from there on."));
    }
}
