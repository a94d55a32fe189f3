//! The lamp's edges: found in a record, or led to where the record has them.

use super::filter::{Filter, Noise, Swing};
use super::forms::FROM_ENDS_S;
use super::grid::Grid;
use super::lamp::Lamp;
use super::learn::Acting;
use super::solve::{combined, solve};

/// What a jump of the level with its swing must take from the sum of squares to be seen: three numbers anywhere among ten thousand cells, at 0.1 %.
const SEEN: f64 = 40.0;
/// Most jumps that are looked for.
const MOST_JUMPS: usize = 40;
/// Jumps of the lamp differ in size by less than this part; and once their size is known from most of them.
const ALIKE: [f64; 2] = [0.4, 0.65];
/// How far a stated edge may be from the true one, and a found one (s).
pub const STATED_S: f64 = 0.1;
const FOUND_S: f64 = 0.2;

/// A jump of the level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump {
    /// When.
    pub at_s: f64,
    /// By how much.
    pub size_m: f64,
    /// Of that amplitude.
    pub sd_m: f64,
}

/// Jumps of a record, found one after the other; the noise is learnt again as they are found.
pub fn jumps(acting: &Acting<'_>, noise: &Noise, bands_hz: &[[f64; 2]], most: usize) -> (Vec<Jump>, Noise) {
    let (mut acting, mut noise) = (acting.clone(), noise.clone());
    let before = acting.jumps_s.len();
    let mut learnt_at = 0;
    while acting.jumps_s.len() - before < most.min(MOST_JUMPS) {
        let Some((filter, solution)) = acting.solution(&noise) else { break };
        let scan = filter.jumps(&solution.left, 3);
        let near = |t_s: f64| {
            let lamp = acting.lamp.as_ref().map_or(f64::INFINITY, |lamp| lamp.nearest_s(t_s));
            acting.jumps_s.iter().map(|jump| (jump - t_s).abs()).fold(lamp, f64::min)
        };
        let grid = acting.grid;
        // level and swing must be known before and after
        let from_ends_s = |t_s: f64| (t_s - grid.start_s).min(grid.end_s() - t_s);
        let inside = |cell: &usize| {
            let t_s = grid.time_s(*cell);
            near(t_s) > 1.0 && from_ends_s(t_s) > FROM_ENDS_S
        };
        let best = (0..grid.len()).filter(inside).max_by(|a, b| scan[*a].0.total_cmp(&scan[*b].0));
        let found = best.filter(|cell| scan[*cell].0 > SEEN);
        if let Some(cell) = found {
            acting.jumps_s.push(grid.time_s(cell) - 0.5 * grid.step_s);
        }
        let count = acting.jumps_s.len() - before;
        // what was taken for a walk may have been jumps
        if count > learnt_at && (found.is_none() || count >= 2 * learnt_at.max(1)) {
            noise = acting.learnt_again(&noise, bands_hz);
            learnt_at = count;
        } else if found.is_none() {
            break;
        }
    }
    let each = Acting::of_jump(noise.swings.len());
    let first = acting.before_jumps(noise.swings.len()) + before * each;
    let Some((_, solution)) = acting.solution(&noise) else { return (Vec::new(), noise) };
    let jump = |(k, at_s): (usize, &f64)| {
        let place = first + each * k;
        Jump { at_s: *at_s, size_m: solution.amplitude[place], sd_m: solution.covariance[(place, place)].sqrt() }
    };
    let mut all: Vec<Jump> = acting.jumps_s[before..].iter().enumerate().map(jump).collect();
    all.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    (all, noise)
}

/// The jumps that are the lamp's: alike in size, to and fro in turn, the most of them.
pub fn lamp_of(jumps: &[Jump]) -> Option<Lamp> {
    let in_turn = |size_m: f64, differs: f64| {
        let is_alike = |jump: &&Jump| {
            (jump.size_m.abs() - size_m).abs() < differs * size_m + 2.0 * jump.sd_m
                && jump.size_m.abs() > 3.0 * jump.sd_m
        };
        let mut chain: Vec<Jump> = Vec::new();
        for jump in jumps.iter().filter(is_alike) {
            match chain.last_mut() {
                // two to the same side: the likelier in size stays
                Some(last) if last.size_m.signum() == jump.size_m.signum() => {
                    if (jump.size_m.abs() - size_m).abs() < (last.size_m.abs() - size_m).abs() {
                        *last = *jump;
                    }
                }
                _ => chain.push(*jump),
            }
        }
        chain
    };
    let chains = jumps.iter().map(|jump| (in_turn(jump.size_m.abs(), ALIKE[0]), jump.size_m.abs()));
    let best = chains.max_by(|a, b| a.0.len().cmp(&b.0.len()).then(a.1.total_cmp(&b.1)))?.0;
    // once the size is known from many, those that noise or heat has changed more count as well
    let size_m = crate::statistics::median(&mut best.iter().map(|jump| jump.size_m.abs()).collect::<Vec<f64>>())?;
    let wider = in_turn(size_m, ALIKE[1]);
    let best = if wider.len() > best.len() { wider } else { best };
    // the first time may be larger, with the gas of the first light
    let first = best.first()?;
    let earlier = jumps.iter().rfind(|jump| {
        jump.at_s < first.at_s && jump.size_m.signum() != first.size_m.signum() && jump.size_m.abs() > ALIKE[1] * size_m
    });
    let best: Vec<Jump> = earlier.filter(|_| best.len() % 2 == 1).into_iter().chain(&best).copied().collect();
    (best.len() >= 2).then(|| Lamp { edges_s: best.iter().map(|jump| jump.at_s).collect() })
}

/// The edges where the record has them, as far as it tells, by Gauss and Newton; a stated edge is known to a tenth of a second.
///
/// `beside` is what acts on the strip beside light and its swings.
pub fn refined(grid: &Grid, beside: &[Vec<f64>], noise: &Noise, lamp: &Lamp, is_stated: bool) -> Lamp {
    let known_s = if is_stated { STATED_S } else { FOUND_S };
    let mut edges = lamp.edges_s.clone();
    let filter = Filter::of(noise, grid);
    for _ in 0..4 {
        let now = Lamp { edges_s: edges.clone() };
        let Some(shift) = shifts(&Shifting { grid, filter: &filter, noise, beside }, &now, &lamp.edges_s, known_s)
        else {
            break;
        };
        for (edge, shift) in edges.iter_mut().zip(&shift) {
            *edge += shift.clamp(-0.5 * known_s, 0.5 * known_s);
        }
        if !edges.windows(2).all(|pair| pair[0] < pair[1]) || shift.iter().all(|s| s.abs() < 1e-4) {
            break;
        }
    }
    let in_order = edges.windows(2).all(|pair| pair[0] < pair[1]);
    if in_order { Lamp { edges_s: edges } } else { lamp.clone() }
}

struct Shifting<'a> {
    grid: &'a Grid,
    filter: &'a Filter,
    noise: &'a Noise,
    beside: &'a [Vec<f64>],
}

fn shifts(with: &Shifting<'_>, lamp: &Lamp, stated_s: &[f64], known_s: f64) -> Option<Vec<f64>> {
    let Shifting { grid, filter, noise, beside } = *with;
    let raw = sharp(lamp, grid, &noise.swings);
    let white = filter.whiten_all(&raw.iter().chain(beside).collect::<Vec<_>>());
    let y = filter.whiten(&grid.y_m);
    let columns: Vec<&[f64]> = white.iter().map(Vec::as_slice).collect();
    let base = solve(&columns, &y, &[])?;
    let of = |lamp: &Lamp| combined(sharp(lamp, grid, &noise.swings).iter().zip(&base.amplitude), grid.len());
    let step_s = 0.25 * grid.step_s;
    let here = of(lamp);
    let slopes: Vec<Vec<f64>> = (0..lamp.edges_s.len())
        .map(|k| {
            let mut moved = lamp.clone();
            moved.edges_s[k] += step_s;
            of(&moved).iter().zip(&here).map(|(m, h)| (m - h) / step_s).collect()
        })
        .collect();
    let slopes = filter.whiten_all(&slopes);
    // what is known beforehand as further rows: (edge + shift − stated)/known
    let rows = slopes.len();
    let padded = |column: &[f64], row: Option<usize>| {
        let mut all = column.to_vec();
        all.extend((0..rows).map(|k| if row == Some(k) { 1.0 / known_s } else { 0.0 }));
        all
    };
    let mut all: Vec<Vec<f64>> = white.iter().map(|c| padded(c, None)).collect();
    all.extend(slopes.iter().enumerate().map(|(k, c)| padded(c, Some(k))));
    let mut y_all = y;
    y_all.extend((0..rows).map(|k| (stated_s[k] - lamp.edges_s[k]) / known_s));
    let columns: Vec<&[f64]> = all.iter().map(Vec::as_slice).collect();
    let solution = solve(&columns, &y_all, &[])?;
    Some(solution.amplitude[white.len()..].to_vec())
}

/// Light that switches at once and the swings that it then excites: 1 − cos ωt after each edge. Their phase tells an edge to a hundredth of a second.
fn sharp(lamp: &Lamp, grid: &Grid, swings: &[Swing]) -> Vec<Vec<f64>> {
    let to_and_fro = lamp.to_and_fro();
    let rings = swings.iter().map(|swing| {
        let [cos, _] = lamp.rings_of(grid, swing, &to_and_fro);
        cos
    });
    std::iter::once(lamp.light(grid)).chain(rings).collect()
}

/// What may follow the lamp slowly, richly enough that none of it is taken for a late edge.
pub fn slow_answers(lamp: &Lamp, grid: &Grid, swing: &Swing) -> Vec<Vec<f64>> {
    let heat = [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 40.0].map(|tau_s| lamp.swung_low_pass(grid, tau_s, swing));
    let lag = [1.0, 4.0, 16.0]
        .map(|tau_s| lamp.swung(grid, &lamp.warm_up(grid, tau_s), &lamp.warm_up_all_jumps(tau_s), tau_s, swing));
    heat.into_iter().chain(lag).collect()
}
