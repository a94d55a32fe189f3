//! Model diagnosis: where simulation and recording differ, which missing effect explains it, and a check of that explanation by prediction.
//!
//! | step | | files |
//! |---|---|---|
//! | 1 | the recordings are prepared: outliers, noise, where the base model's descent starts | [`preparation`] |
//! | 2 | the base model is fitted | [`base_priors`], [`base`], [`context`], [`refit`], [`fitting`], [`noise`], [`residual_noise`] |
//! | 3 | what it lacks is sought: effects are proposed, fitted, kept | [`mod@search`], [`screen`], [`stretches`], [`misfit`], [`laws`] |
//! | 4 | a strip's rods are counted; where two links are found to be a strip, what it lacks is sought | [`rods`], [`mod@search`] |
//! | 5 | the hypotheses are weighed, beside something that is not in the table, and the base model by chance | [`adequacy`], [`posterior`], [`evidence`], [`bagging`], [`latent_forces`], [`rounding`], [`latent`], [`basis_law`] |
//! | 6 | in doubt the search goes on, in pieces of the recordings where these are long enough, and they are weighed again | [`mod@search`], [`preparation`], [`search::horizon`] |
//! | 7 | what was not fitted is predicted | [`heldout`] |
//! | 8 | what the names leave is learnt, as a law that no table holds | [`learnt`], [`grammar`] |
//! | 9 | the base model is judged, and what could have been seen; the verdict: the answer, its class, what would decide | [`adequacy`], [`verdict`] |
//! | 10 | place, time, amplitude and phase are found, and all of it told | [`locate`], [`torque`], [`energy`], [`findings`], [`altered`], [`statements`], [`report`], [`answer`], [`law_report`], [`quantity`] |
//!
//! The table of effects is [`effect`], every threshold stands in [`settings`], and [`plan`] asks the same before an experiment. A file imports only from files that
//! stand before it: [`settings`], [`effect`], [`hypothesis`] and [`context`] import nothing of what follows.

pub mod adequacy;
pub mod altered;
pub mod answer;
pub mod bagging;
pub mod base;
pub mod base_priors;
pub mod basis_law;
pub mod context;
pub mod effect;
pub mod energy;
pub mod evidence;
pub mod findings;
pub mod fitting;
pub mod grammar;
pub mod heldout;
pub mod hypothesis;
pub mod latent;
pub mod latent_forces;
pub mod law_report;
pub mod laws;
pub mod learnt;
pub mod linearisation;
pub mod locate;
pub mod misfit;
pub mod noise;
pub mod plan;
pub mod posterior;
pub mod preparation;
pub mod quantity;
pub mod refit;
pub mod report;
pub mod residual_noise;
pub mod rods;
pub mod rounding;
pub mod screen;
pub mod search;
pub mod settings;
pub mod statements;
pub mod stretches;
#[cfg(test)]
mod testing;
pub mod torque;
pub mod verdict;

use std::sync::OnceLock;

use crate::error::Result;
use crate::experiment::Experiment;
use crate::fit::Record;
use crate::progress::{Progress, Silent};
use findings::Findings;
use posterior::Posterior;
use preparation::Prepared;
use refit::Refit;
use search::Search;

pub use adequacy::Detectable;
pub use effect::{Effect, Phase, Place};
pub use plan::{Plan, planned};
pub use report::{Diagnosis, Drawn};
pub use settings::Settings;
pub use torque::MissingTorque;
pub use verdict::Status;

/// What may be asked of a diagnosis.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Number of parametric bootstrap recordings for the base model's p-value; with none, replicates of the residuals to first order.
    pub bootstraps: usize,
    /// The stamp from which on a single recording is predicted; two thirds through it otherwise.
    pub predict_from_s: Option<f64>,
    /// Thresholds.
    pub settings: Settings,
}

/// Diagnoses recordings of one specimen.
///
/// # Errors
/// [`crate::error::Error::Simulation`] where the specimen cannot swing, or no motion near the start values follows the recording.
pub fn diagnose(
    records: &[Record],
    experiment: &Experiment,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Diagnosis> {
    let (settings, counted, pieces, bending) = (&options.settings, OnceLock::new(), OnceLock::new(), OnceLock::new());
    // 1. the recordings
    progress.begin("preparation", None);
    let prepared = preparation::prepare(records, experiment, settings)?;
    // 2. the base model
    progress.begin("base model", None);
    let search =
        Search::of_base_model(&prepared, &prepared.experiment, prepared.initial_damping(), settings, progress)?;
    let mut search = search.counted(&counted)?;
    // 3. what it lacks
    search.run();
    // 4. a strip's rods
    let mut search = search.searched_with_preferred_rods(&counted)?;
    let search = match search.bending_strip_search(records, &bending) {
        Some(strip) => {
            let mut strip = strip.counted(&counted)?;
            strip.run();
            if strip.is_behind() {
                search
            } else {
                let (strip, _) = weighed(strip.searched_with_preferred_rods(&counted)?, &pieces, settings, progress);
                search.with_strip_fits(strip)
            }
        }
        None => search,
    };
    // 5. how probable each hypothesis is, and 6. in doubt, further
    let (search, posterior) = weighed(search, &pieces, settings, progress);
    let Search { context, effects, fits, rounds, undecided, .. } = search;
    // 7. what was not fitted
    progress.begin("proof", None);
    let (posterior, held_out) = heldout::borne_out(&context, posterior, fits, effects.len(), options.predict_from_s);
    // 8. what they leave
    progress.begin("law", None);
    let (needed, learnt) = learnt::beside(&context, &posterior, &effects, held_out.as_ref(), options.predict_from_s);
    let with_law = learnt.as_ref().map(|learnt| &learnt.prediction);
    let explained = |proof: &heldout::HeldOut| proof.explained(with_law, &posterior.base().noise_rad(proof.record));
    let explained = held_out.as_ref().map_or(1.0, explained);
    let posterior = Posterior { needed, explained, ..posterior };
    let (posterior, held_out) = heldout::reorder_by_inclusion(&context, posterior, held_out, options.predict_from_s);
    // 9. the base model by itself, and the verdict
    let adequacy = adequacy::adequacy(&context, posterior.base(), &effects, options.bootstraps, progress);
    let verdict = verdict::Verdict::of(&posterior, context.marks(), held_out.as_ref(), learnt.as_ref(), settings);
    // 10. where, when and how
    let unknown_at = verdict.is_open().then(|| locate::place_of_unknown(&posterior, settings)).flatten();
    let findings = Findings {
        departure: locate::departure(posterior.base()),
        remaining: locate::departure(posterior.best()),
        missing_torque: torque::missing(posterior.best(), posterior.base(), unknown_at),
        unknown_at,
        context,
        posterior,
        verdict,
        held_out,
        learnt,
        adequacy,
        rounds,
        undecided,
    };
    Ok(Diagnosis::of(&findings, &experiment.specimen.name))
}

/// Computes the posterior. Extends the search first where the residual is far above the noise, or an effect outside the table is more likely than not.
fn weighed<'a, 'p>(
    search: Search<'a, 'p>,
    pieces: &'a OnceLock<Prepared>,
    settings: &Settings,
    progress: &dyn Progress,
) -> (Search<'a, 'p>, Posterior<'a>) {
    let weigh = |search: &Search<'a, 'p>| {
        progress.begin("weighing", None);
        let posterior = posterior::weigh(search.fits.clone(), search.effects.len(), &search.compared(), settings);
        let p_value = |base: &Refit<'a>| adequacy::adequacy(&search.context, base, &search.effects, 0, &Silent).p_value;
        posterior.beside_chance(p_value, settings)
    };
    let at_once = (!search.leaves_more_than_noise()).then(|| weigh(&search));
    match at_once {
        Some(posterior) if posterior.unknown <= settings.verdict.even => (search, posterior),
        _ => {
            let search = search.doubted(pieces);
            let posterior = weigh(&search);
            (search, posterior)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};
    use std::fs;
    use std::path::Path;

    /// The modules of this folder, each with those of them that it imports. A folder and its parts are one.
    fn imports() -> BTreeMap<String, BTreeSet<String>> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/diagnose");
        let mut files = Vec::new();
        for folder in ["", "effect", "laws", "learnt", "search", "stretches"] {
            for entry in fs::read_dir(root.join(folder)).unwrap() {
                let path = entry.unwrap().path();
                let file = path.file_stem().unwrap().to_str().unwrap().to_owned();
                let name = if file == "mod" { folder.to_owned() } else { file };
                if path.is_file() && !name.is_empty() {
                    let module = if folder.is_empty() { name.clone() } else { folder.to_owned() };
                    files.push((name, module, fs::read_to_string(&path).unwrap()));
                }
            }
        }
        let mut imports: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for (_, own, text) in &files {
            let text = text.split("#[cfg(test)]").next().unwrap_or(text);
            let uses: String = text.lines().filter(|line| line.starts_with("use ") && line.contains("super")).collect();
            let words: Vec<&str> = uses.split(|c: char| !c.is_alphanumeric() && c != '_').collect();
            let imported = files.iter().filter(|(name, module, _)| words.contains(&name.as_str()) && module != own);
            imports.entry(own.clone()).or_default().extend(imported.map(|(_, module, _)| module.clone()));
        }
        imports
    }

    #[test]
    fn no_file_is_imported_by_what_it_imports() {
        let mut left = imports();
        assert!(left.len() > 20 && left["refit"].contains("hypothesis"), "{left:?}");
        loop {
            let free: Vec<String> = left
                .iter()
                .filter(|(_, imports)| imports.iter().all(|i| !left.contains_key(i)))
                .map(|f| f.0.clone())
                .collect();
            if free.is_empty() {
                break;
            }
            free.iter().for_each(|name| _ = left.remove(name));
        }
        assert!(left.is_empty(), "these import each other: {left:?}");
    }
}
