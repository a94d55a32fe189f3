//! The learnt law as it is written: its formula with numbers, its terms with their coefficients, and the lines that put it into an experiment file.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde::Serialize;

use super::effect::Effect;
use super::grammar::Term;
use super::learnt::Learnt;
use super::quantity::Quantity;

/// A law that was learnt.
#[derive(Debug, Clone, Serialize)]
pub struct LearntLaw {
    /// Where it acts; of two terms the one that comes first.
    pub place: &'static str,
    /// With its numbers.
    pub formula: String,
    /// Of what the formula gives.
    pub unit: &'static str,
    /// Term by term.
    pub terms: Vec<WrittenTerm>,
    /// Other formulas that do nearly as well.
    pub alternatives: Vec<Alternative>,
    /// What it leaves, with the names beside it, of each angle of what was not fitted.
    pub heldout_rmse_rad: Vec<f64>,
    /// Its effects beside it: none where it stands in the place of the names.
    pub beside: Vec<Effect>,
    /// For an experiment file.
    pub toml: String,
}

/// One term.
#[derive(Debug, Clone, Serialize)]
pub struct WrittenTerm {
    /// Where it acts.
    pub place: &'static str,
    /// The only joint, where it is not all of them.
    pub joint: Option<usize>,
    /// On what it depends.
    pub state: &'static str,
    /// How.
    pub shape: &'static str,
    /// How that changes.
    pub modulation: &'static str,
    /// The effects of the table that it is nearly, along the motion.
    pub stands_for: Vec<Effect>,
    /// With the names of its coefficients.
    pub formula: String,
    /// These.
    pub parameters: BTreeMap<String, Quantity>,
}

/// Another formula.
#[derive(Debug, Clone, Serialize)]
pub struct Alternative {
    /// With its numbers.
    pub formula: String,
    /// How much longer its description is.
    pub nats: f64,
}

impl LearntLaw {
    /// As it was learnt.
    pub fn of(learnt: &Learnt<'_>) -> Option<Self> {
        let first = learnt.terms.first()?;
        let alternatives = learnt.alternatives.iter();
        Some(Self {
            place: first.law.place.id(),
            formula: learnt.formula(),
            unit: first.law.place.unit(),
            terms: learnt
                .terms
                .iter()
                .zip(&learnt.stand_for)
                .map(|(term, of)| WrittenTerm::of(term, of, learnt))
                .collect(),
            alternatives: alternatives
                .map(|(formula, nats)| Alternative { formula: formula.clone(), nats: *nats })
                .collect(),
            heldout_rmse_rad: learnt.prediction.rmse_rad.clone(),
            beside: learnt.fit.hypothesis.effects.clone(),
            toml: learnt.terms.iter().map(toml_of).collect::<Vec<_>>().join("\n"),
        })
    }
}

impl WrittenTerm {
    fn of(term: &Term, stands_for: &[Effect], learnt: &Learnt<'_>) -> Self {
        let law = &term.law;
        let parameters = law.parameters.keys().zip(law.coefficients()).map(|(name, (parameter, own))| {
            let quantity = Quantity { value: Some(own.start), sd: learnt.sd(parameter), unit: parameter.unit() };
            (name.clone(), quantity)
        });
        Self {
            place: law.place.id(),
            joint: law.joint,
            state: term.state,
            shape: term.shape,
            modulation: term.modulation,
            stands_for: stands_for.to_vec(),
            formula: law.formula.clone(),
            parameters: parameters.collect(),
        }
    }
}

/// A term as an experiment file states it.
fn toml_of(term: &Term) -> String {
    let law = &term.law;
    let mut text = format!(
        "[[model.law]]\nname = \"{}\"\nplace = \"{}\"\n{}{} = \"{}\"\n",
        law.name,
        law.place.id(),
        law.joint.map_or(String::new(), |joint| format!("joint = {joint}\n")),
        law.place.key(),
        law.formula
    );
    for (name, own) in &law.parameters {
        let least = own.min.map_or(String::new(), |min| format!(", min = {min:e}"));
        _ = writeln!(text, "parameters.{name} = {{ start = {:e}{least}, unit = \"{}\" }}", own.start, own.unit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::grammar::{StateRange, terms};
    use crate::experiment::{Experiment, LawPlace};

    #[test]
    fn a_file_takes_every_term_back() {
        for place in [LawPlace::Hinge, LawPlace::Joint, LawPlace::Strip, LawPlace::Tip] {
            for term in terms(place, StateRange { angle: 0.5, rate: 4.0, time_s: 30.0 }) {
                let term = if place == LawPlace::Joint { term.at_joint(1) } else { term };
                let read = Experiment::parse(&toml_of(&term), std::path::Path::new("e.toml")).unwrap();
                assert_eq!(read.model.law, vec![term.law]);
            }
        }
    }
}
