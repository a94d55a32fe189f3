//! Short stretches: which laws the recordings ask for within a swing or two.
//!
//! The recordings are cut in stretches so short that no model falls out of step, each with the start that the recording shows. The motion of the base model through
//! each of them is linear enough in everything else: with r what it leaves and J, S its derivatives with the coefficients β of all laws and with the start s,
//!
//! ```text
//! r + J (β − β₀) + S (s − s₀) = e        over all stretches
//! ```
//!
//! and least squares, the starts projected out, give the coefficients of any set of laws at once, of the table or of the grammar. Over short stretches no error
//! of phase adds up, so that they point to sets of laws that a search beside a poor base model does not come by. What the laws do over many swings is not seen:
//! it proposes, and proves nothing.
//!
//! | file | holds |
//! |---|---|
//! | `squares` | least squares for every set of laws |

mod squares;

use nalgebra::DMatrix;

use super::context::FitContext;
use super::effect::{Acts, Cost, Effect, Place};
use super::grammar::Term;
use super::hypothesis::Hypothesis;
use super::refit::Refit;
use crate::experiment::Law;
use crate::fit::shooting::STATE_WINDOW_RAD;
use crate::fit::{Problem, Record};
use crate::model::Parameter;
use crate::series::FEWEST_ROWS;
use squares::{Column, LeastSquares, Set};

/// Swings of a stretch: a loss is told from a spring within one.
const SWINGS: f64 = 1.5;
/// Of what a model that is wrong leaves of a stretch, so many values an angle go together with no others: about its harmonics.
const VALUES_EACH: usize = 6;
/// Errors of the camera or the encoder that every set may have beside its laws, with their standard deviations: an offset (rad) and a gain.
const OF_CAMERA: [(Effect, Parameter, f64); 2] =
    [(Effect::CameraTilt, Parameter::CameraTilt, 0.01), (Effect::AngleGain, Parameter::AngleGain, 0.02)];
/// Linearised so often, each time at what the best set of laws makes of the base model's parameters.
const PASSES: usize = 2;
/// Steps of Gauss and Newton to the starts of stretches.
const START_STEPS: usize = 4;
/// Most laws of a set.
const MOST_LAWS: usize = 3;
/// The same of sets with terms of the grammar, which are many: of those of one law, and of those of two.
const MOST_WITH_TERMS: [usize; 2] = [1, 2];

/// A set of laws that the stretches ask for.
#[derive(Debug, Clone)]
pub struct Asked {
    /// The laws.
    pub hypothesis: Hypothesis,
    /// Their coefficients, and the base model's.
    pub start: Vec<(Parameter, f64)>,
}

/// The sets of laws that leave least, those of most laws first: `each` of the largest number that is worth its coefficients, and the best of every smaller one.
///
/// Empty where the frames do not resolve a swing.
pub fn asked_for(context: &FitContext<'_>, base: &Refit<'_>, effects: &[Effect], each: usize) -> Vec<Asked> {
    let laws: Vec<Effect> = effects.iter().copied().filter(|effect| is_told(*effect, effects)).collect();
    let amplitudes: Vec<Parameter> = laws.iter().map(|law| law.parameters()[0]).collect();
    let known = &context.base;
    let found = sets(context, base, known, (effects, &laws), &amplitudes, (&[MOST_LAWS], each, false));
    // corners are dear, and nothing is lost with the second best of those that have them
    let has_switching = |set: &Set| set.laws.iter().any(|law| laws[*law].has_switching());
    let mut with_corners: Vec<usize> = Vec::new();
    let is_kept = |set: &Set| {
        let count = set.laws.len();
        let is_second = has_switching(set) && with_corners.contains(&count);
        with_corners.extend(has_switching(set).then_some(count));
        !is_second
    };
    let (sets, beside) = found.unwrap_or_default();
    sets.into_iter().flatten().filter(is_kept).map(|set| asked(&set, known, &laws, beside)).collect()
}

/// Terms of the grammar, alone, in pairs and beside one of the table's laws, that leave least: the set's laws of the table, and which terms with what amplitudes.
pub fn best_term_sets(
    context: &FitContext<'_>,
    base: &Refit<'_>,
    effects: &[Effect],
    terms: &[Term],
    each: usize,
) -> Vec<(Asked, Vec<(usize, f64)>)> {
    let is_cheap = |effect: &Effect| is_told(*effect, effects) && !effect.has_switching();
    let laws: Vec<Effect> = effects.iter().copied().filter(is_cheap).collect();
    let named = |(k, term): (usize, &Term)| Law { name: format!("term {k}"), ..term.law.clone() };
    let of_terms: Vec<Law> = terms.iter().enumerate().map(named).collect();
    // a term's amplitude comes first; its other coefficients stay where they are
    let amplitude = |law: &Law| law.coefficients().next().map(|(parameter, _)| parameter);
    let Some(amplitudes) = of_terms.iter().map(amplitude).collect::<Option<Vec<Parameter>>>() else {
        return Vec::new();
    };
    let known = &context.base;
    let with_terms = FitContext { laws: of_terms, base: [known.as_slice(), &amplitudes].concat(), ..context.clone() };
    let all: Vec<Parameter> = laws.iter().map(|law| law.parameters()[0]).chain(amplitudes).collect();
    let found = sets(&with_terms, base, known, (effects, &laws), &all, (&MOST_WITH_TERMS, each, true));
    let (found, beside) = found.unwrap_or_default();
    let mut kinds = Vec::new();
    let of_set = |set: Set| {
        let of_terms = |(law, value): (&usize, &f64)| Some((law.checked_sub(laws.len())?, *value));
        let own: Vec<(usize, f64)> = set.laws.iter().zip(&set.values[beside..]).filter_map(of_terms).collect();
        let asked = asked(&set, known, &laws, beside);
        // one form is asked for once, however many starts its other coefficients have
        let forms = own.iter().map(|(k, _)| terms[*k].form()).collect::<Vec<_>>();
        let kind = (asked.hypothesis.effects.clone(), forms);
        let is_new = !own.is_empty() && !kinds.contains(&kind);
        kinds.push(kind);
        is_new.then_some((asked, own))
    };
    found.into_iter().flatten().filter_map(of_set).collect()
}

/// What a set asks for of the table's laws, the first of its laws being those.
fn asked(set: &Set, known: &[Parameter], laws: &[Effect], beside: usize) -> Asked {
    let of_table: Vec<(Effect, f64)> = set
        .laws
        .iter()
        .zip(&set.values[beside..])
        .filter_map(|(law, value)| Some((*laws.get(*law)?, *value)))
        .collect();
    let of_laws = of_table.iter().map(|(effect, value)| (effect.parameters()[0], *value));
    let start = known.iter().copied().zip(set.values.iter().copied()).chain(of_laws).collect();
    let effects = of_table.iter().map(|(effect, _)| *effect).collect();
    Asked { hypothesis: Hypothesis { effects, dropped: None }, start }
}

/// For each of some numbers the sets of at most so many laws that leave least, each law in proportion to one of the `amplitudes`, and how many values of a set stand before
/// those of its laws: those of `known`, the base model's, and of the camera; `follows`: from starts that are fitted to their stretches.
fn sets(
    context: &FitContext<'_>,
    base: &Refit<'_>,
    known: &[Parameter],
    (effects, laws): (&[Effect], &[Effect]),
    amplitudes: &[Parameter],
    (most, each, follows): (&[usize], usize, bool),
) -> Option<(Vec<Vec<Set>>, usize)> {
    let (model, _) = base.problem.model(0, &base.x[..base.problem.free.len()]).ok()?;
    let stretches = cut(context.records, SWINGS * std::f64::consts::TAU / model.characteristic_rad_s())?;
    let short = context.on(&stretches);
    let of_camera = OF_CAMERA.iter().filter(|own| effects.contains(&own.0));
    let all = of_camera.clone().map(|own| own.0).chain(laws.iter().copied()).collect();
    let hypothesis = Hypothesis { effects: all, dropped: None };
    let problem = short.problem_near(&hypothesis, base).ok()?;
    let allowed = known.iter().copied().chain(of_camera.map(|own| own.1));
    let columns: Vec<Parameter> = allowed.chain(amplitudes.iter().copied()).collect();
    let reach_s = STATE_WINDOW_RAD / model.characteristic_rad_s();
    // laws of no size move nothing: the starts are those of the base model
    let plain = FitContext { laws: Vec::new(), base: known.to_vec(), ..short };
    let plain = plain.problem_near(&Hypothesis::default(), base).ok()?;
    let mut values: Vec<(Parameter, f64)> = known.iter().map(|p| (*p, base.value(*p).unwrap_or(0.0))).collect();
    let beside = columns.len() - amplitudes.len();
    let mut found = Vec::new();
    for _ in 0..PASSES {
        let mut starts: Vec<f64> = problem.records.iter().flat_map(|stretch| stretch.start_near(0, reach_s)).collect();
        if follows {
            follow(&plain, &values, &mut starts)?;
        }
        let squares = linearised(&problem, &values, &columns, &starts)?;
        found = most.iter().map(|most| squares.best_sets(beside, (*most, each))).collect();
        let Some(best) = found.iter().rev().find_map(|sets: &Vec<Set>| sets.first()) else { break };
        values.iter_mut().zip(&best.values).for_each(|(own, value)| own.1 = *value);
    }
    Some((found, beside))
}

/// Whether an effect is a law that acts at every instant by a torque in proportion to its coefficient, and that no error of the camera among some effects does as
/// well: a steady force sideways tilts the swing, as a tilted camera does, and an error of measurement is not to be blamed on physics.
fn is_told(effect: Effect, effects: &[Effect]) -> bool {
    let entry = effect.entry();
    let is_imitated = effect == Effect::SideForce && effects.contains(&Effect::CameraTilt);
    let acts_always = matches!(entry.cost, Cost::Ordinary | Cost::Corners) && entry.acts != Acts::Motion;
    acts_always && entry.place != Place::Camera && !is_imitated
}

/// The recordings in stretches of some length; `None` where the frames are too few for it.
fn cut(records: &[Record], length_s: f64) -> Option<Vec<Record>> {
    let stretches: Vec<Record> = records.iter().flat_map(|record| record.pieces(length_s)).collect();
    stretches.iter().all(|stretch| stretch.len() >= FEWEST_ROWS).then_some(stretches)
}

/// What the base model leaves of all stretches with some values, from some starts, and its derivatives, the starts projected out.
fn linearised(
    problem: &Problem<'_>,
    values: &[(Parameter, f64)],
    columns: &[Parameter],
    starts: &[f64],
) -> Option<LeastSquares> {
    let mut x = with_values(problem, values)?;
    for (value, parameter) in x.iter_mut().zip(&problem.free) {
        let is_given = values.iter().any(|(known, _)| known == parameter);
        if !is_given && parameter.is_proportional() && columns.contains(parameter) {
            *value = 0.0;
        }
    }
    x.extend_from_slice(starts);
    let places: Vec<usize> = columns.iter().map(|own| problem.place(*own)).collect::<Option<_>>()?;
    let free = problem.free.len();
    let mut rows = Vec::new();
    for block in problem.blocks(&x)?.into_iter().filter(|block| block.robust) {
        let mut own = DMatrix::zeros(block.residual.len(), columns.len() + 1);
        own.column_mut(0).copy_from(&block.residual);
        places.iter().enumerate().for_each(|(k, place)| own.column_mut(k + 1).copy_from(&block.slopes.column(*place)));
        let starts = block.slopes.columns(free, block.slopes.ncols() - free).into_owned();
        let of_starts = starts.qr().q();
        own -= &of_starts * of_starts.tr_mul(&own);
        rows.push(own);
    }
    let independent = problem.records.len() * problem.marks() * VALUES_EACH;
    let known = |p: &Parameter| {
        let of_camera = OF_CAMERA.iter().find(|own| own.1 == *p).map(|own| (0.0, own.2));
        let belief = problem.beliefs.iter().find(|belief| belief.parameter == *p);
        belief.map(|belief| (belief.value, belief.sd)).or(of_camera)
    };
    let column = |(p, place): (&Parameter, &usize)| Column {
        from: x[*place],
        is_not_negative: p.is_not_negative(),
        belief: known(p),
    };
    Some(LeastSquares::of(&rows, columns.iter().zip(&places).map(column).collect(), independent))
}

/// The start values of a problem, some of them given.
fn with_values(problem: &Problem<'_>, values: &[(Parameter, f64)]) -> Option<Vec<f64>> {
    let mut x = problem.start_values().ok()?;
    for (value, parameter) in x.iter_mut().zip(&problem.free) {
        *value = values.iter().find(|(known, _)| known == parameter).map_or(*value, |(_, given)| *given);
    }
    Some(x)
}

/// Moves the starts to where the motion with these values follows its stretches best: what neighbouring rows show of a fast mode's rate is too rough to be linear in.
fn follow(problem: &Problem<'_>, values: &[(Parameter, f64)], starts: &mut [f64]) -> Option<()> {
    let of_values = with_values(problem, values)?;
    let (free, each) = (problem.free.len(), 2 * problem.shapes());
    let mut least = f64::INFINITY;
    let mut best = starts.to_vec();
    for _ in 0..START_STEPS {
        let x = [&of_values, &*starts].concat();
        let blocks: Vec<_> = problem.blocks(&x)?.into_iter().filter(|block| block.robust).collect();
        let left: f64 = blocks.iter().map(|block| block.residual.norm_squared()).sum();
        if blocks.len() != problem.records.len() || left.is_nan() || left > least {
            break;
        }
        least = left;
        best.copy_from_slice(starts);
        for (block, own) in blocks.iter().zip(starts.chunks_mut(each)) {
            let slopes = block.slopes.columns(free, each).into_owned();
            let step = slopes.svd(true, true).solve(&block.residual, 1e-12).ok()?;
            own.iter_mut().zip(step.iter()).for_each(|(start, step)| *start -= step);
        }
    }
    starts.copy_from_slice(&best);
    Some(())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use rand::SeedableRng;
    use rand::rngs::StdRng;
    use rand_distr::{Distribution, Normal};

    use super::*;
    use crate::diagnose::base_priors::DampingAssumption;
    use crate::diagnose::settings::Settings;
    use crate::diagnose::{base, preparation};
    use crate::experiment::Experiment;
    use crate::model::{ForwardModel, LinkProperty, State, Trajectory};

    fn two_arms(length_m: f64, effects: &str) -> Experiment {
        let text = format!(
            "[[specimen.links]]\nlength_m = {length_m}\nmass_kg = 0.0938\ncom_m = 0.1086\ninertia_kg_m2 = 4.375e-4\n\
             [[specimen.links]]\nlength_m = 0.23\nmass_kg = 0.1376\ncom_m = 0.1168\ninertia_kg_m2 = 1.269e-3\n\
             [model]\nk_eq_n_m_per_rad = 0.0\nc_eq_n_m_s_per_rad = 1e-5\nrelease_rad = [0.8, 0.6]\n\
             [model.effects]\nhinge_viscous = 5e-5\n{effects}"
        );
        Experiment::parse(&text, Path::new("two arms")).unwrap()
    }

    #[test]
    fn two_arms_of_which_one_is_longer_than_stated_ask_for_the_losses_hidden_in_them() {
        let truth = two_arms(0.1737, "hinge_coulomb = 6e-4\nair_quadratic = 0.017\n");
        let model = ForwardModel::of(&truth).unwrap();
        let start = State::released(&model, &truth.model.release_rad).unwrap();
        let swing = Trajectory::swing(&model, &start, 0.0, 40.0).unwrap();
        let t_s: Vec<f64> = (0..2000).map(|row| 0.02 * f64::from(row)).collect();
        let (mut random, noise) = (StdRng::seed_from_u64(1), Normal::new(0.0, 1e-4).unwrap());
        let mut angle = |link: usize, t_s: &f64| Some(swing.at(*t_s).theta_rad[link] + noise.sample(&mut random));
        let theta_rad = (0..2).map(|link| t_s.iter().map(|t| angle(link, t)).collect()).collect();
        let record = Record::uniform("made", t_s, theta_rad);
        let (settings, stated) = (Settings::default(), two_arms(0.173, ""));
        let prepared = preparation::prepare(&[record], &stated, &settings).unwrap();
        let context = base::context(&prepared, &prepared.experiment, DampingAssumption::AsStated, &settings).unwrap();
        let fit = base::fitted(&context, &prepared).unwrap();
        let asked = asked_for(&context, &fit, &base::candidates(&context), 3);
        let pair = asked.iter().find(|asked| asked.hypothesis.effects.len() == 2).unwrap();
        assert_eq!(pair.hypothesis.effects, [Effect::HingeCoulomb, Effect::AirQuadratic], "{asked:?}");
        let value = |parameter| pair.start.iter().find(|(own, _)| *own == parameter).unwrap().1;
        let [rubs, drags] = [value(Parameter::HingeCoulomb), value(Parameter::AirQuadratic)];
        assert!((rubs / 6e-4 - 1.0).abs() < 0.1 && (drags / 0.017 - 1.0).abs() < 0.1, "{rubs} {drags}");
        let length_m = value(Parameter::Link(0, LinkProperty::Length));
        assert!((length_m / 0.1737 - 1.0).abs() < 1e-3, "{length_m}");
    }
}
