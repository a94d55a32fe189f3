//! The sentence on top, and the warnings.

use super::Chapter;
use crate::report::html::{escaped, list, table};
use crate::report::left::{Identified, Left};

/// What a summary says after a range of damping ratios.
const OVER_THE_RECORD: &str = " over the record, ";

/// The result in one or two short sentences: the modes, whether the model reproduces the recording or what it lacks.
pub fn results(left: &Left) -> Vec<String> {
    let verdict = left.diagnosis.as_ref().map(|d| first_sentence(&d.verdict.statement)).filter(|s| !s.is_empty());
    let lacks = left.diagnosis.as_ref().is_some_and(|d| d.verdict.status != "adequate");
    // that something is missing says that the model without it does not reproduce the recording
    let fitted = reproduced(left).filter(|_| verdict.is_none() || !lacks);
    let results = [left.identified.as_ref().map(modes), fitted, verdict];
    results.into_iter().flatten().filter(|s| !s.is_empty()).collect()
}

/// The results, and what stopped the run.
pub fn sentence(left: &Left) -> String {
    let mut sentences = results(left);
    if sentences.is_empty() {
        sentences.push("This run came to no result".to_owned());
    }
    sentences.extend(left.stopped().map(|error| format!("The run stopped: {}", error.trim_end_matches('.'))));
    sentences.join(". ") + "."
}

/// Frequency and damping of each mode, and what is doubtful. How the damping changes over the record is told in its chapter.
fn modes(found: &Identified) -> String {
    let (modes, doubts) = found.summary.split_at(found.summary.find(" — ").unwrap_or(found.summary.len()));
    let of = |mode: &'_ str| mode.split(OVER_THE_RECORD).next().unwrap_or(mode).to_owned();
    let short = modes.split("; ").map(of).collect::<Vec<_>>().join("; ");
    (short + doubts).trim_end_matches('.').to_owned()
}

/// Whether the fitted model does what was recorded.
fn reproduced(left: &Left) -> Option<String> {
    let all: Vec<bool> = left.fit.iter().flat_map(|f| &f.recordings).filter_map(|r| r.fitted.reproduced).collect();
    let not = all.iter().filter(|yes| !**yes).count();
    Some(match (all.len(), not) {
        (0, _) => return None,
        (1, 0) => "The fitted model reproduces the recording".to_owned(),
        (1, _) => "The fitted model does not reproduce the recording".to_owned(),
        (_, 0) => "The fitted model reproduces all recordings".to_owned(),
        (count, not) => format!("The fitted model does not reproduce {not} of {count} recordings"),
    })
}

/// Up to the full stop that ends it; one within a number or a name is no end.
fn first_sentence(statement: &str) -> String {
    let end = statement.match_indices(". ").next().map_or(statement.len(), |(at, _)| at);
    statement[..end].trim_end_matches('.').to_owned()
}

/// What a reader must know first: warnings, parts that are missing, notes.
pub fn warnings(left: &Left) -> Chapter {
    let mut chapter = Chapter::new("warnings", "Warnings");
    let tracked = left.track.iter().flat_map(|t| &t.warnings);
    let read = left.angles.iter().flat_map(|a| &a.warnings);
    let mut warnings: Vec<String> =
        left.stopped().map(|error| format!("the run stopped: {error}")).into_iter().collect();
    for warning in tracked.chain(left.log.iter().flat_map(|log| &log.warnings)).chain(read) {
        if !warnings.contains(warning) {
            warnings.push(warning.clone());
        }
    }
    if let Some(fit) = &left.fit {
        if fit.converged == Some(false) {
            warnings.push("the fit has not converged: its values mean little".to_owned());
        }
        warnings.extend(fit.recordings.iter().filter_map(|r| r.pace.as_ref()?.statement.clone()));
    }
    if let Some(undecided) = left.diagnosis.as_ref().map(|d| &d.undecided).filter(|u| !u.is_empty()) {
        warnings.push(format!(
            "the search of the diagnosis reached its limit of computation; not done, or not finished: {}",
            undecided.join(", ")
        ));
    }
    let none = warnings.is_empty();
    chapter.words(list("warnings", warnings));
    if none {
        chapter.words("<p>No command gave a warning.</p>\n");
    }
    let notes = left.identified.as_ref().map(|i| i.notes.clone()).unwrap_or_default();
    if !notes.is_empty() {
        chapter.words(format!("<h3>Notes on frequencies and damping</h3>\n{}", list("notes", notes)));
    }
    if !left.missing.is_empty() {
        let rows =
            left.missing.iter().map(|m| vec![escaped(m.holds), format!("<code>{}</code>", m.file), escaped(&m.why)]);
        chapter.words(format!("<h3>What is not on this page</h3>\n{}", table(&["part", "file", "because"], rows)));
    }
    chapter
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::left::{Diagnosed, FitSide, Fitted, FittedRecording, Log, Verdict};

    #[test]
    fn the_result_is_short() {
        let summary = "f₁ = 1.36 ± 0.02 Hz, ξ₁ = 0.18 to 0.42 % over the record, grows as the swing becomes small; f₂ = 6.50 ± 0.04 Hz";
        let fitted = FitSide { reproduced: Some(false), ..FitSide::default() };
        let recordings = vec![FittedRecording { fitted, ..FittedRecording::default() }];
        let fit = Fitted { recordings, ..Fitted::default() };
        let statement = "Missing: dry friction of the hinge (hinge_coulomb) (92 %). It is much.".to_owned();
        let left = Left {
            identified: Some(Identified { summary: summary.into(), ..Identified::default() }),
            fit: Some(fit),
            diagnosis: Some(Diagnosed { verdict: Verdict { statement, ..Verdict::default() }, ..Diagnosed::default() }),
            ..Left::default()
        };
        assert_eq!(
            sentence(&left),
            "f₁ = 1.36 ± 0.02 Hz, ξ₁ = 0.18 to 0.42 %; f₂ = 6.50 ± 0.04 Hz. Missing: dry friction of the hinge (hinge_coulomb) (92 %)."
        );
        let fitted_only = Left { diagnosis: None, identified: None, ..left };
        assert_eq!(sentence(&fitted_only), "The fitted model does not reproduce the recording.");
        assert_eq!(sentence(&Left::default()), "This run came to no result.");
        let log = Log { error: Some("a.mp4: no mark".into()), ..Log::default() };
        let stopped = Left { log: Some(log), ..Left::default() };
        assert_eq!(sentence(&stopped), "This run came to no result. The run stopped: a.mp4: no mark.");
    }

    #[test]
    fn a_doubt_is_kept() {
        let summary = "f₁ = 1.36 Hz, ξ₁ = 1 to 2 % over the record, grows — 60 % of the record is missing";
        let found = Identified { summary: summary.into(), ..Identified::default() };
        assert_eq!(modes(&found), "f₁ = 1.36 Hz, ξ₁ = 1 to 2 % — 60 % of the record is missing");
    }
}
