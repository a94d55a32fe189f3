//! From a record to everything that is said about it.

use super::adequacy::{Adequacy, adequacy, push_of_each};
use super::edges::{self, Jump};
use super::filter::Noise;
use super::fit::{Bench, Fit, columns_of};
use super::forms::{Effect, Setting};
use super::grid::Grid;
use super::heldout::{Heldout, heldout};
use super::lamp::Lamp;
use super::learn::Acting;
use super::record::LaserRecord;
use super::search::{Candidate, candidates};
use super::solve::combined;
use super::verdict::{Verdict, verdict};
use crate::error::{Error, Result};
use crate::experiment::Experiment;
use crate::model::modes::{limp_frequency_hz, rigid_frequency_hz};

/// Modes that a record may show.
const MODES: usize = 3;
/// Jumps beside the lamp's for which the noise is learnt again.
const JUMPS_BESIDE: usize = 6;

/// Candidates are sought again so often at most.
const ROUNDS: usize = 2;
/// −2 ln likelihood that noise must gain to change an answer: its eight numbers at 1 %.
const GAINED: f64 = 20.0;
/// An edge that moves by less changes no answer.
const MOVED_S: f64 = 0.01;

/// All that was found.
#[derive(Debug, Clone)]
pub struct Analysis {
    /// The record on its grid.
    pub grid: Grid,
    /// Noise and swings.
    pub noise: Noise,
    /// The lamp's edges.
    pub lamp: Lamp,
    /// Whether they were found in the record.
    pub lamp_found: bool,
    /// Likeliest first.
    pub candidates: Vec<Candidate>,
    /// Of the likeliest.
    pub adequacy: Adequacy,
    /// The push with its standard deviation.
    pub push_m: [f64; 2],
    /// The push of each cycle.
    pub cycles_m: Vec<[f64; 2]>,
    /// Smallest size of each effect that would have been seen.
    pub detectable: Vec<(Effect, f64, Vec<Effect>)>,
    /// The last cycles.
    pub heldout: Option<Heldout>,
    /// What the record holds.
    pub verdict: Verdict,
    /// What a figure draws: of each cell the record, the likeliest model without swings, the push alone.
    pub curves: Curves,
}

/// Of each cell, m.
#[derive(Debug, Clone, Default)]
pub struct Curves {
    /// The whole likeliest model: level, light, effects, swings as they go on.
    pub effects_m: Vec<f64>,
    /// Level and light alone.
    pub push_m: Vec<f64>,
    /// The record less its swings.
    pub without_swings_m: Vec<f64>,
}

/// Frequencies between which each mode of the strip is sought: from limp to twice as stiff as gravity alone would have it.
fn bands_hz(experiment: &Experiment) -> Vec<[f64; 2]> {
    let (length_m, gravity_m_s2) = (experiment.specimen.length_m, experiment.rig.gravity_m_s2);
    let limp = |k: usize| limp_frequency_hz(k, length_m, gravity_m_s2);
    let rigid = rigid_frequency_hz(length_m, gravity_m_s2);
    // a clamp stiffens; the second of two rods, 2.7 times the first, is the stiffest strip's that swings below 4 Hz
    let first = [0.9 * limp(0), 1.25 * rigid];
    std::iter::once(first).chain((1..MODES).map(|k| [0.94 * limp(k), 1.35 * limp(k)])).collect()
}

/// What a record tells.
///
/// # Errors
/// [`Error::Table`] where the lamp's edges are not given and not found, or not within the record.
pub fn analyse(record: &LaserRecord, experiment: &Experiment) -> Result<Analysis> {
    let grid = Grid::of(record);
    let refuse = |message: String| Error::Table { path: record.path.clone(), line: None, message };
    let bands_hz = bands_hz(experiment);
    let resolution_m = experiment.laser.as_ref().and_then(|l| l.resolution_m).unwrap_or(0.0);
    let sample_m = sample_noise_m(record).max(resolution_m / 12f64.sqrt());
    let stated = experiment.light.as_ref().map_or(&[][..], |light| &light.on_s);
    let alone = Acting { grid: &grid, lamp: None, jumps_s: Vec::new(), sample_m, slow: Vec::new() };
    let mut begun = alone.begin(&bands_hz);
    let lamp = if stated.is_empty() {
        begun = alone.learnt(&begun, &bands_hz);
        let (jumps, noise) = edges::jumps(&alone, &begun, &bands_hz, usize::MAX);
        begun = noise;
        edges::lamp_of(&jumps).ok_or_else(|| refuse(nothing_switched(&jumps)))?
    } else {
        within(stated, &grid).map_err(refuse)?
    };
    let mut acting = alone.with_lamp(lamp.clone());
    let mut noise = acting.learnt(&begun, &bands_hz);
    let (beside, learnt) = edges::jumps(&acting, &noise, &bands_hz, JUMPS_BESIDE);
    acting.jumps_s = beside.iter().map(|jump| jump.at_s).collect();
    noise = acting.with_further_swings(learnt, &bands_hz);
    let first = lamp;
    let is_stated = !stated.is_empty();
    let beside: Vec<Vec<f64>> = edges::slow_answers(&first, &grid, &noise.swings[0])
        .into_iter()
        .chain(acting.jump_columns(&noise.swings))
        .collect();
    let lamp = edges::refined(&grid, &beside, &noise, &first, is_stated);
    acting = acting.with_lamp(lamp.clone());
    noise = acting.learnt(&noise, &bands_hz);
    let no_fit = || refuse("no fit of it converges; check laser.column and its unit".to_owned());
    let lasting = Lasting { acting: &acting, bands_hz: &bands_hz, first: &first, is_stated };
    let (lamp, noise, found) = lasting.searched(noise, lamp).ok_or_else(no_fit)?;
    judged(&grid, &noise, &lamp, found, !is_stated).ok_or_else(no_fit)
}

/// What stays the same while candidates, noise and edges are sought in turn.
struct Lasting<'a> {
    acting: &'a Acting<'a>,
    bands_hz: &'a [[f64; 2]],
    first: &'a Lamp,
    is_stated: bool,
}

impl Lasting<'_> {
    /// The candidates, and again with the noise and the edges that the likeliest leaves: an effect had been taken for noise, or for a late edge.
    fn searched(&self, mut noise: Noise, mut lamp: Lamp) -> Option<(Lamp, Noise, Vec<Candidate>)> {
        let grid = self.acting.grid;
        let found = |noise: &Noise, lamp: &Lamp| {
            candidates(&Bench::of(Setting { grid, lamp, swings: &noise.swings, lasts_s: grid.duration_s() }, noise))
        };
        let mut all = found(&noise, &lamp);
        for _ in 0..ROUNDS {
            let Some((moved, learnt)) = self.led_on(&noise, &lamp, &all.first()?.fit) else { break };
            let again = found(&learnt, &moved);
            if again.first()?.fit.ln_evidence < all.first()?.fit.ln_evidence {
                break;
            }
            (lamp, noise, all) = (moved, learnt, again);
        }
        Some((lamp, noise, all))
    }

    /// Edges and noise under a fit, where they differ from those that it was made with.
    fn led_on(&self, noise: &Noise, lamp: &Lamp, best: &Fit) -> Option<(Lamp, Noise)> {
        let grid = self.acting.grid;
        let of = |lamp| Setting { grid, lamp, swings: &noise.swings, lasts_s: grid.duration_s() };
        let with = of(lamp);
        let beside: Vec<Vec<f64>> = best.members.iter().flat_map(|m| m.form.swung_columns(&m.shape, &with)).collect();
        let moved = edges::refined(grid, &beside, &noise.with_walk(best.walk_m2_s), self.first, self.is_stated);
        let by_s = moved.edges_s.iter().zip(&lamp.edges_s).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let moved = if by_s < MOVED_S { lamp.clone() } else { moved };
        let mut acting = self.acting.clone();
        acting.jumps_s.clear();
        acting.slow = std::iter::once(moved.light(grid)).chain(columns_of(&best.members, &of(&moved))).collect();
        acting.lamp = Some(moved.clone());
        let learnt = acting.learnt_again(noise, self.bands_hz);
        let gained = acting.minus_two_ln(noise) - acting.minus_two_ln(&learnt);
        (by_s >= MOVED_S || gained > GAINED).then_some((moved, learnt))
    }
}

fn judged(grid: &Grid, noise: &Noise, lamp: &Lamp, candidates: Vec<Candidate>, lamp_found: bool) -> Option<Analysis> {
    let bench = Bench::of(Setting { grid, lamp, swings: &noise.swings, lasts_s: grid.duration_s() }, noise);
    let best = &candidates.first()?.fit;
    let adequacy = adequacy(&bench, best);
    let cycles_m = push_of_each(&bench, best);
    let verdict = verdict(&bench, &candidates, &adequacy);
    let push_m = verdict.push(&bench, &candidates, &cycles_m);
    let heldout = heldout(&bench, best);
    let detectable = super::verdict::detectable(&bench, best);
    let curves = curves(&bench, best);
    Some(Analysis {
        candidates,
        adequacy,
        push_m,
        cycles_m,
        detectable,
        heldout,
        verdict,
        curves,
        lamp: lamp.clone(),
        noise: noise.clone(),
        lamp_found,
        grid: grid.clone(),
    })
}

/// Standard deviation of a sample's noise: each against the cubic through its four neighbours at their own times, which no swing below a tenth of the rate survives.
fn sample_noise_m(record: &LaserRecord) -> f64 {
    let square = |(t, y): (&[f64], &[f64])| {
        let share = |k: usize| {
            let others = [0, 1, 3, 4].into_iter().filter(|j| *j != k);
            others.map(|j| (t[2] - t[j]) / (t[k] - t[j])).product::<f64>()
        };
        let shares = [0, 1, 3, 4].map(|k| (share(k), y[k]));
        let foreseen: f64 = shares.iter().map(|(share, y)| share * y).sum();
        (y[2] - foreseen).powi(2) / (1.0 + shares.iter().map(|(share, _)| share * share).sum::<f64>())
    };
    let mut squares: Vec<f64> = record.t_s.windows(5).zip(record.y_m.windows(5)).map(square).collect();
    let usual = crate::statistics::median(&mut squares).unwrap_or(0.0);
    // a jump or a gap is no noise; of normal noise one in a million is left out
    let most = if usual > 0.0 { 50.0 * usual } else { f64::INFINITY };
    let kept: Vec<f64> = squares.into_iter().filter(|s| *s < most).collect();
    (kept.iter().sum::<f64>() / kept.len().max(1) as f64).sqrt().max(1e-12)
}

/// Stated edges within a record.
fn within(stated_s: &[f64], grid: &Grid) -> std::result::Result<Lamp, String> {
    let (first, last) = (grid.start_s, grid.end_s());
    let inside: Vec<f64> = stated_s.iter().copied().filter(|t| *t < last).collect();
    // what was switched before the record began began lit or dark
    let before = inside.iter().filter(|t| **t <= first).count();
    let mut edges_s: Vec<f64> = inside[before..].to_vec();
    if edges_s.is_empty() {
        return Err(format!(
            "the lamp is never switched within the record, {first:.1} to {last:.1} s; give light.on_s in the record's time"
        ));
    }
    if before % 2 == 1 {
        // lit from the start: an on edge just before the first cell
        edges_s.insert(0, first - grid.step_s);
    }
    if let [only] = edges_s[..] {
        return Err(format!(
            "the lamp is switched once within the record, at {only} s, and a push shows when it is switched on and off; give both times in light.on_s"
        ));
    }
    Ok(Lamp { edges_s })
}

fn nothing_switched(jumps: &[Jump]) -> String {
    let seen = match jumps.len() {
        0 => "no jump of the displacement is seen".to_owned(),
        1 => format!("only one jump of the displacement is seen, at {:.1} s", jumps[0].at_s),
        n => format!("{n} jumps of the displacement are seen, but none to and fro alike"),
    };
    format!("the lamp's edges are not found: {seen}; give the times of on, off, on, … in light.on_s")
}

fn curves(bench: &Bench<'_>, fit: &Fit) -> Curves {
    let grid = bench.with.grid;
    let mut columns: Vec<Vec<f64>> = bench.base.clone();
    columns.extend(columns_of(&fit.members, &bench.with));
    let sum = |keep: &dyn Fn(usize) -> bool| {
        let kept = columns.iter().zip(&fit.amplitude).enumerate().filter(|(k, _)| keep(*k));
        combined(kept.map(|(_, term)| term), grid.len())
    };
    let whole = sum(&|_| true);
    let left: Vec<f64> = grid.y_m.iter().zip(&whole).map(|(y, m)| y - m).collect();
    let stage = bench.stage(fit.walk_m2_s);
    let level = stage.filter.level(&left);
    let last = level.last().copied().unwrap_or(0.0);
    let level = |cell: usize| if fit.walk_m2_s > 0.0 { level[cell] } else { last };
    let base = bench.base.len();
    let effects = sum(&|k| k == 0 || k >= base);
    let light = sum(&|k| k == 0);
    Curves {
        effects_m: (0..grid.len()).map(|c| effects[c] + level(c)).collect(),
        push_m: (0..grid.len()).map(|c| light[c] + last).collect(),
        without_swings_m: bench.with.smoothed(&grid.y_m),
    }
}
