//! What is written and said of a record: `freeswing.laser/1`.

use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use super::adequacy::Adequacy;
use super::analysis::Analysis;
use super::forms::Effect;
use super::heldout::Heldout;
use super::numbers::Quantity;
use super::reflectivity::{Figure, figure};
use super::verdict::{Remainder, Status};
use crate::digits::number;
use crate::experiment::Experiment;
use crate::identify::estimate::NORMAL_QUANTILE;

/// The push.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Push {
    /// The value (m).
    pub value: f64,
    /// Its standard deviation.
    pub sd: f64,
    /// Its 95 % interval.
    pub interval: [f64; 2],
    /// The smallest push that the recording could have shown.
    pub detectable: f64,
}

/// An effect of the table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Found {
    /// The effect.
    #[serde(skip)]
    pub effect: Effect,
    /// Over all candidates.
    pub probability: f64,
    /// The form of the likeliest candidate that holds it.
    pub form: Option<&'static str>,
    /// Of that form.
    #[serde(serialize_with = "by_key")]
    pub parameters: Vec<Quantity>,
}

/// A list as a map of keys.
fn by_key<S: Serializer>(list: &[Quantity], serializer: S) -> Result<S::Ok, S::Error> {
    let mut map = serializer.serialize_map(Some(list.len()))?;
    for quantity in list {
        map.serialize_entry(&quantity.key, quantity)?;
    }
    map.end()
}

fn effects_by_id<S: Serializer>(list: &[Found], serializer: S) -> Result<S::Ok, S::Error> {
    let mut map = serializer.serialize_map(Some(list.len()))?;
    for found in list {
        map.serialize_entry(found.effect.id(), found)?;
    }
    map.end()
}

/// The verdict, in the form of a diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerdictReport {
    /// Its form.
    pub status: Status,
    /// The likeliest names.
    pub effects: Vec<Effect>,
    /// All that the record does not tell from them.
    pub class: Vec<Effect>,
    /// Of the names.
    pub probability: f64,
    /// Of each effect.
    pub inclusion: std::collections::BTreeMap<&'static str, f64>,
    /// Beside the names.
    pub remainder: Remainder,
    /// In words.
    pub statement: String,
    /// The measurement that would split the class.
    pub to_decide: Option<&'static str>,
}

/// A swing of the strip.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SwingReport {
    /// Frequency.
    pub hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Whether something keeps it up: the root mean square that it is kept at (m).
    pub kept_up_m: f64,
}

/// The lamp.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LampReport {
    /// On, off, on, …
    pub edges_s: Vec<f64>,
    /// Whether they were found in the record, not given.
    pub found: bool,
    /// The push of each cycle alone.
    pub push_of_each_m: Vec<Quantity>,
}

/// Noise of the sensor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NoiseReport {
    /// Standard deviation of a sample, its resolution included.
    pub sample_m: f64,
    /// Random walk of the level in a second, where the answer has one.
    pub walk_m_per_sqrt_s: f64,
}

/// The smallest size of an effect that would have been named.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Limit {
    /// Displacement.
    pub smallest: f64,
    /// Its unit.
    pub unit: &'static str,
    /// Effects of much the same course.
    pub confused_with: Vec<Effect>,
}

/// All of it.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// `freeswing.laser/1`.
    pub schema: &'static str,
    /// The specimen's name.
    pub specimen: String,
    /// The column of the record.
    pub column: String,
    /// Length of the record.
    pub duration_s: f64,
    /// Samples.
    pub samples: usize,
    /// The push of light.
    pub push_m: Push,
    /// What else the record holds.
    #[serde(serialize_with = "effects_by_id")]
    pub effects: Vec<Found>,
    /// In one.
    pub verdict: VerdictReport,
    /// The last cycles, predicted.
    pub heldout: Option<Heldout>,
    /// What the recording could have shown.
    pub detectable: std::collections::BTreeMap<&'static str, Limit>,
    /// What the push says of the surface.
    pub reflectivity: Option<Figure>,
    /// Why there is none.
    pub reflectivity_missing: Option<String>,
    /// The lamp.
    pub lamp: LampReport,
    /// The strip's swings, slowest first.
    pub swings: Vec<SwingReport>,
    /// The sensor's noise.
    pub noise: NoiseReport,
    /// The tests of what is left.
    pub adequacy: Adequacy,
    /// What the figures assume.
    pub assumes: Vec<&'static str>,
    /// What of the input was passed over.
    pub warnings: Vec<String>,
}

impl Report {
    /// Of an analysis.
    pub fn of(analysis: &Analysis, record: &super::LaserRecord, experiment: &Experiment) -> Self {
        let [value, sd] = analysis.push_m;
        let (reflectivity, reflectivity_missing) = match figure(experiment, analysis.push_m) {
            Ok(figure) => (Some(figure), None),
            Err(missing) => (None, Some(missing)),
        };
        let swing_report = |swing: &super::filter::Swing| SwingReport {
            hz: swing.hz,
            damping_ratio: swing.damping,
            kept_up_m: swing.kept_up_m(),
        };
        let best = &analysis.candidates[0].fit;
        let metres =
            |(k, [value, sd]): (usize, &[f64; 2])| Quantity { key: k.to_string(), value: *value, sd: *sd, unit: "m" };
        let mut report = Self {
            schema: "freeswing.laser/1",
            specimen: experiment.specimen.name.clone(),
            column: record.column.clone(),
            duration_s: analysis.grid.duration_s(),
            samples: record.t_s.len(),
            push_m: Push {
                value,
                sd,
                interval: [value - NORMAL_QUANTILE * sd, value + NORMAL_QUANTILE * sd],
                detectable: 2.0 * NORMAL_QUANTILE * sd,
            },
            effects: analysis.found(),
            verdict: VerdictReport {
                status: analysis.verdict.status,
                effects: analysis.verdict.effects.clone(),
                class: analysis.verdict.class.clone(),
                probability: analysis.verdict.probability,
                inclusion: analysis.verdict.inclusion.iter().map(|(e, p)| (e.id(), *p)).collect(),
                remainder: analysis.verdict.remainder,
                statement: String::new(),
                to_decide: analysis.verdict.to_decide,
            },
            heldout: analysis.heldout,
            detectable: analysis
                .detectable
                .iter()
                .map(|(e, smallest, with)| {
                    (e.id(), Limit { smallest: *smallest, unit: "m", confused_with: with.clone() })
                })
                .collect(),
            reflectivity,
            reflectivity_missing,
            lamp: LampReport {
                edges_s: analysis.lamp.edges_s.clone(),
                found: analysis.lamp_found,
                push_of_each_m: analysis.cycles_m.iter().enumerate().map(metres).collect(),
            },
            swings: analysis.noise.swings.iter().map(swing_report).collect(),
            noise: NoiseReport { sample_m: analysis.noise.white_m, walk_m_per_sqrt_s: best.walk_m2_s.sqrt() },
            adequacy: analysis.adequacy.clone(),
            assumes: vec![
                "a curl that follows the lamp at once, as from a temperature difference across the film, looks like the push in any record; \
                 turn the strip's other face to the lamp to see it",
                "a force of the gas in proportion to the film's warmth looks like its curl; repeat at another pressure to see it",
            ],
            warnings: record.warnings.clone(),
        };
        report.verdict.statement = report.statement();
        report
    }

    /// The verdict in words.
    fn statement(&self) -> String {
        let VerdictReport { status, effects, class, probability, remainder, .. } = &self.verdict;
        let names = |list: &[Effect]| {
            let all: Vec<String> = list.iter().map(|e| format!("{} ({})", e.words(), e.id())).collect();
            all.join(", ")
        };
        let percent = 1e2 * probability;
        let others: Vec<Effect> = class.iter().copied().filter(|e| !effects.contains(e)).collect();
        let kept = match &self.heldout {
            Some(h) if h.augmented_rmse_m < h.baseline_rmse_m && !effects.is_empty() => format!(
                " The cycles from {:.0} s on, which were not fitted, are predicted to {:.3} µm instead of {:.3} µm.",
                h.from_s,
                1e6 * h.augmented_rmse_m,
                1e6 * h.baseline_rmse_m
            ),
            _ => String::new(),
        };
        match status {
            Status::Adequate => {
                format!("The push, the strip's swings and the sensor's noise explain the record ({percent:.0} %).")
            }
            Status::Identified => format!("Beside the push: {} ({percent:.0} %).{kept}", names(effects)),
            Status::Ambiguous if effects.is_empty() => format!(
                "Most likely nothing beside the push ({percent:.0} %), but the record does not exclude: {}.",
                names(&others)
            ),
            Status::Ambiguous if others.is_empty() => {
                format!("Beside the push most likely: {} ({percent:.0} %).{kept}", names(effects))
            }
            Status::Ambiguous => format!(
                "Beside the push most likely: {} ({percent:.0} %), which the record does not tell from: {}.{kept}",
                names(effects),
                names(&others)
            ),
            Status::Unknown => {
                let line = remainder.frequency_hz.map_or(String::new(), |hz| format!(" at {hz:.3} Hz"));
                format!(
                    "Something is in the record that is not in the table: {}{line}, {} µm rms. The push's interval is widened for it.",
                    remainder.like.unwrap_or("more than noise"),
                    number(1e6 * remainder.rms_m, 2)
                )
            }
        }
    }
}

impl Analysis {
    /// Every effect with the numbers of the likeliest candidate that holds it.
    fn found(&self) -> Vec<Found> {
        let of = |effect: Effect| {
            let probability = self.verdict.inclusion.iter().find(|(e, _)| *e == effect).map_or(0.0, |(_, p)| *p);
            let holder = self.candidates.iter().find(|c| c.fit.effects().contains(&effect));
            let parameters = holder.map_or_else(Vec::new, |c| self.parameters(&c.fit, effect));
            let form =
                holder.and_then(|c| c.fit.members.iter().find(|m| m.form.effect() == effect)).map(|m| m.form.id());
            Found { effect, probability, form, parameters }
        };
        Effect::ALL.into_iter().map(of).collect()
    }
}
