//! Terms in the place of one name: those that exert nearly its torque along the motion of the fit begin where that fit stands, whatever is linear of them.

use rayon::prelude::*;

use super::super::context::FitContext;
use super::super::effect::Effect;
use super::super::grammar::Term;
use super::super::refit::Refit;
use super::term_fitting::with_laws;
use super::term_screening::{Candidate, each_form_once, started};
use super::term_torques::{Along, cosine};

/// Of each name of a fit the terms that go best with its torque, each form once with the start that leaves least, and with the amplitude a of the least squares
///
/// ```text
/// a = Q·T / T·T      Q: torques of the name's law, T: of a unit of the term, along the motion
/// ```
///
/// A form without further coefficients that exerts the name's torque is the name; one with them may do so at one end of its range. One that drifts is told only by its
/// promise: in a single release every loss fades with the swing. `LawSettings::in_place_after` that promise more begin before them.
pub fn substitute_terms(
    context: &FitContext<'_>,
    best: &Refit<'_>,
    along: &Along,
    every_start: &[Term],
) -> Vec<Candidate> {
    let law = &context.settings.law;
    let of_unit = |term: &Term| along.of_term(&started(term, 1.0, 0));
    let Some(units) = every_start.iter().map(of_unit).collect::<Option<Vec<_>>>() else { return Vec::new() };
    let in_place = |name: &Effect| {
        let own = along.of_effect(*name) * best.value(name.parameters()[0]).unwrap_or(0.0);
        let goes: Vec<f64> = units.iter().map(|unit| cosine(&own.as_view(), &unit.as_view()).abs()).collect();
        let differs = |k: usize| goes[k] < law.the_same || every_start[k].law.parameters.len() > 1;
        let may_differ = |k: usize| !every_start[k].drifts && !every_start[k].acts_in_a_part() && differs(k);
        let mut near: Vec<usize> = (0..units.len()).filter(|k| goes[*k] > law.the_same_law && may_differ(*k)).collect();
        near.sort_by(|a, b| goes[*b].total_cmp(&goes[*a]));
        let mut forms = each_form_once(near.iter().copied(), every_start);
        forms.truncate(law.in_place);
        let hypothesis = best.hypothesis.without(*name);
        let of_form = |(rank, first): (usize, &usize)| {
            let form = every_start[*first].form();
            let of_start = |k: &usize| {
                let terms = vec![started(&every_start[*k], own.dot(&units[*k]) / units[*k].norm_squared(), 0)];
                (with_laws(context, &terms).cost_at(&hypothesis, best, &[]), terms)
            };
            let starts = near.iter().filter(|k| every_start[**k].form() == form).map(of_start);
            let (_, terms) = starts.min_by(|a, b| a.0.total_cmp(&b.0))?;
            let (hypothesis, step) = (hypothesis.clone(), vec![0.0; best.x.len()]);
            Some(Candidate { hypothesis, terms, step, gain: best.chi2, rank: rank + law.in_place_after })
        };
        forms.par_iter().with_max_len(1).enumerate().filter_map(of_form).collect::<Vec<_>>()
    };
    let proportional = best.hypothesis.effects.iter().filter(|name| name.parameters()[0].is_proportional());
    proportional.flat_map(in_place).collect()
}
