//! What is proven: the law that stands, for it predicts what was not fitted clearly better than the names do.

use rayon::prelude::*;

use super::super::context::FitContext;
use super::super::grammar::Term;
use super::super::heldout::{self, HeldOut, Prediction};
use super::super::refit::Refit;
use super::described::{Described, with_laws};
use crate::model::Parameter;

/// A law that was learnt.
#[derive(Debug, Clone)]
pub struct Learnt<'a> {
    /// Its terms, with their coefficients.
    pub terms: Vec<Term>,
    /// The fit of the names that stand beside it, with it.
    pub fit: Refit<'a>,
    /// The prediction of what was not fitted.
    pub prediction: Prediction,
    /// Other formulas that do nearly as well, with how much longer their description is (nats).
    pub alternatives: Vec<(String, f64)>,
}

impl Learnt<'_> {
    /// The formula with its numbers.
    pub fn formula(&self) -> String {
        formula_of(&self.terms)
    }

    /// A coefficient's standard deviation.
    pub fn sd(&self, coefficient: Parameter) -> f64 {
        let scale = (self.fit.chi2 / self.fit.values().max(1) as f64).max(1.0).sqrt();
        let covariance = self.fit.covariance(&[coefficient]);
        scale * covariance.get((0, 0)).map_or(f64::INFINITY, |variance| variance.max(0.0).sqrt())
    }
}

/// The terms' formulas with the numbers of their coefficients, one after the other.
fn formula_of(terms: &[Term]) -> String {
    terms.iter().map(Term::with_numbers).collect::<Vec<_>>().join(" + ").replace("+ -", "- ")
}

/// Of the shortest descriptions the one that leaves least of what was not fitted, if that is clearly less than the names do.
pub fn best_proven<'a>(
    context: &FitContext<'a>,
    order: &[Described<'a>],
    proof: &HeldOut,
    from_s: Option<f64>,
) -> Option<Learnt<'a>> {
    let settings = context.settings;
    let shorter = order.iter().take_while(|own| !own.terms.is_empty()).take(settings.law.proven).collect::<Vec<_>>();
    let leaves = |prediction: &Prediction| {
        let told = Prediction { rmse_rad: prediction.rmse_rad.clone(), left: None };
        HeldOut { baseline: proof.augmented.clone(), augmented: told, ..proof.clone() }.leaves()
    };
    let predict = |own: &&Described<'a>| heldout::predicted(&with_laws(context, &own.terms), &own.fit, from_s);
    let predicted: Vec<Option<Prediction>> = shorter.par_iter().with_max_len(1).map(predict).collect();
    let proven = shorter.into_iter().zip(predicted).filter_map(|(own, prediction)| Some((own, prediction?)));
    let proven: Vec<(&Described<'a>, Prediction)> = proven.collect();
    let least = proven.iter().map(|(_, prediction)| leaves(prediction)).fold(f64::INFINITY, f64::min);
    (least < settings.verdict.borne_out).then_some(())?;
    // of those that predict alike the shortest
    let (own, prediction) =
        proven.into_iter().find(|(_, prediction)| leaves(prediction) <= settings.law.alike * least)?;
    let near = order.iter().filter(|other| !std::ptr::eq(*other, own) && !other.terms.is_empty());
    let near = near.filter(|other| other.length < own.length + settings.law.alternatives);
    Some(Learnt {
        terms: own.terms.clone(),
        fit: own.fit.clone(),
        prediction,
        alternatives: near.map(|other| (formula_of(&other.terms), other.length - own.length)).collect(),
    })
}
