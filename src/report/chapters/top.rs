//! The sentence on top, and the warnings.

use super::Chapter;
use crate::report::html::{escaped, list, table};
use crate::report::left::Left;

/// The result in one sentence.
pub fn sentence(left: &Left) -> String {
    let identified = left.identified.as_ref().map(|i| i.summary.trim_end_matches('.').to_owned());
    let verdict = left.diagnosis.as_ref().map(|d| first_sentence(&d.verdict.statement)).filter(|s| !s.is_empty());
    let reproduced = left.fit.as_ref().and_then(|f| f.recordings.first()).and_then(|r| r.fitted.reproduced);
    let fitted = reproduced.map(|yes| {
        if yes {
            "the fitted model reproduces the recording"
        } else {
            "the fitted model does not reproduce the recording"
        }
        .to_owned()
    });
    let parts: Vec<String> =
        [identified, fitted, verdict.map(|v| lowered(&v))].into_iter().flatten().filter(|p| !p.is_empty()).collect();
    if parts.is_empty() { "This run came to no result".to_owned() + "." } else { parts.join("; ") + "." }
}

/// Up to the full stop that ends it; one within a number or a name is no end.
fn first_sentence(statement: &str) -> String {
    let end = statement.match_indices(". ").next().map_or(statement.len(), |(at, _)| at);
    statement[..end].trim_end_matches('.').to_owned()
}

fn lowered(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
}

/// What a reader must know first: warnings, parts that are missing, notes.
pub fn warnings(left: &Left) -> Chapter {
    let mut chapter = Chapter::new("warnings", "Warnings");
    let tracked = left.track.iter().flat_map(|t| &t.warnings);
    let read = left.angles.iter().flat_map(|a| &a.warnings);
    let mut warnings: Vec<String> = Vec::new();
    for warning in tracked.chain(left.log.iter().flat_map(|log| &log.warnings)).chain(read) {
        if !warnings.contains(warning) {
            warnings.push(warning.clone());
        }
    }
    if let Some(fit) = &left.fit {
        if fit.converged == Some(false) {
            warnings.push("the fit has not converged: its values mean little".to_owned());
        }
        warnings.extend(fit.recordings.first().and_then(|r| r.pace.as_ref()?.statement.clone()));
    }
    if let Some(undecided) = left.diagnosis.as_ref().map(|d| &d.undecided).filter(|u| !u.is_empty()) {
        warnings.push(format!(
            "the budget of the diagnosis did not allow these rounds of its search: {}",
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
    use crate::report::left::{Diagnosed, Identified, Verdict};

    #[test]
    fn the_result_is_one_sentence() {
        let statement = "Missing: dry friction of the hinge (hinge_coulomb) (92 %). It is much.".to_owned();
        let left = Left {
            identified: Some(Identified { summary: "f₁ = 1.36 ± 0.02 Hz".into(), ..Identified::default() }),
            diagnosis: Some(Diagnosed { verdict: Verdict { statement, ..Verdict::default() }, ..Diagnosed::default() }),
            ..Left::default()
        };
        assert_eq!(sentence(&left), "f₁ = 1.36 ± 0.02 Hz; missing: dry friction of the hinge (hinge_coulomb) (92 %).");
        assert_eq!(sentence(&Left::default()), "This run came to no result.");
    }
}
