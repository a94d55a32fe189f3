//! What a fit makes of the lengths, centres of mass and inertias that the file states.

use super::refit::Refit;
use crate::digits::number;
use crate::fit::Belief;

/// Standard deviations of what is believed of the file's value beyond which it is altered (statistics).
const ALTERED: f64 = 3.0;
/// So many are told (judgement).
const MOST: usize = 3;

/// Which of them a fit alters by more than a careful measurement errs, the farthest first, in a sentence that begins with a space; empty where it alters none.
pub fn statement(fit: &Refit<'_>, beliefs: &[Belief]) -> String {
    let mut altered: Vec<(f64, &Belief, f64)> = Vec::new();
    // the zero of a sensor is no value of the file
    for belief in beliefs.iter().filter(|belief| belief.value != 0.0) {
        let Some(value) = fit.value(belief.parameter) else { continue };
        altered.push((((value - belief.value) / belief.sd).abs(), belief, value));
    }
    altered.retain(|(deviations, ..)| *deviations > ALTERED);
    altered.sort_by(|a, b| b.0.total_cmp(&a.0));
    let told = altered.iter().take(MOST);
    let told: Vec<String> = told
        .map(|(_, belief, value)| {
            format!("{} = {} ({} in the file)", belief.parameter, number(*value, 3), number(belief.value, 3))
        })
        .collect();
    if told.is_empty() {
        return String::new();
    }
    format!(
        " The fit alters the specimen by more than a careful measurement errs: {}. Measure again; if the file is right, what is missing has bent these values.",
        told.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::base_priors::DampingAssumption;
    use crate::diagnose::search::Search;
    use crate::diagnose::testing::{arm, swing};
    use crate::diagnose::{Settings, preparation};
    use crate::fit::Record;
    use crate::progress::Silent;

    /// Of a swing of the arm, held against a file whose inertia is so many times the true one.
    fn told(inertia: f64) -> String {
        let truth = arm("hinge_viscous = 2e-5\n");
        let (t_s, theta_rad) = swing(&truth, 15.0, 30.0);
        let angles = theta_rad.iter().enumerate().map(|(k, theta)| Some(theta + 1e-3 * (1.7 * (k * k) as f64).sin()));
        let record = Record::uniform("made", t_s, vec![angles.collect()]);
        let mut stated = truth.clone();
        for link in &mut stated.specimen.links {
            link.inertia_kg_m2 *= inertia;
        }
        let settings = Settings::default();
        let prepared = preparation::prepare(&[record], &stated, &settings).unwrap();
        let search =
            Search::of_base_model(&prepared, &stated, DampingAssumption::AsStated, &settings, &Silent).unwrap();
        statement(search.base(), &search.context.beliefs)
    }

    #[test]
    fn values_of_the_file_that_a_fit_alters_much_are_told() {
        assert_eq!(told(1.1), "");
        let wrong = told(2.5);
        assert!(wrong.contains("links.1.inertia_kg_m2") && wrong.contains("in the file"), "{wrong}");
    }
}
