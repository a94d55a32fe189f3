//! What the record itself tells of its noise and of the strip's swings, by maximum likelihood with a level that wanders freely, so that
//! nothing slow can pass for either.

use super::filter::{Filter, Noise, Swing};
use super::grid::Grid;
use super::lamp::{Lamp, rings_from, step_at};
use super::solve::{Solution, solve};

/// Evaluations of the likelihood: with the first swing alone, with each further swing, and again after the lamp's edges are known.
const EVALUATIONS: usize = 80;
/// The same from a noise that was learnt already.
const FEWER: usize = 40;
/// −2 ln likelihood that a further swing has to gain: three numbers at 0.1 %.
const FURTHER_SWING: f64 = 16.3;
/// Bounds of damping ratios.
const DAMPING: [f64; 2] = [2e-4, 0.15];
/// The white noise of means is not less than that of neighbouring samples tells, but may be more where a sensor's noise is not quite white.
const WHITE_FACTORS: [f64; 2] = [0.97, 2.0];
/// First step of its logarithm, and sweeps over all numbers that end a descent.
const WHITE_STEP: f64 = 0.05;
const SWEEPS: usize = 3;
/// Where the first swing's frequency stands among the numbers, and turns over the record by which each is tried beside where a descent has ended.
const FIRST_HZ: usize = 2;
const NEARBY_TURNS: [f64; 8] = [-0.6, -0.4, -0.25, -0.12, 0.12, 0.25, 0.4, 0.6];
/// The first swing's frequency is looked for at so many places to each side, and with these damping ratios.
const FREQUENCIES: i32 = 5;
const DAMPINGS: [f64; 3] = [0.0015, 0.006, 0.025];
/// So much of its root mean square is then kept up by a force.
const KEPT_UP: f64 = 0.05;
/// Time constants of what may follow the lamp slowly while the noise is learnt (s).
const SLOW_ANSWERS_S: [f64; 3] = [1.0, 4.0, 20.0];

/// What acts on the strip while its noise is learnt.
#[derive(Debug, Clone)]
pub struct Acting<'a> {
    /// The grid.
    pub grid: &'a Grid,
    /// The lamp, where its edges are known.
    pub lamp: Option<Lamp>,
    /// Jumps.
    pub jumps_s: Vec<f64>,
    /// White noise of neighbouring samples.
    pub sample_m: f64,
    /// Light, and what may follow the lamp slowly, so that it counts neither as noise nor as a late edge.
    pub slow: Vec<Vec<f64>>,
}

impl Acting<'_> {
    /// The same with a lamp.
    #[must_use]
    pub fn with_lamp(mut self, lamp: Lamp) -> Self {
        let slow = SLOW_ANSWERS_S.iter().map(|tau_s| lamp.low_pass(self.grid, *tau_s));
        self.slow = std::iter::once(lamp.light(self.grid))
            .chain(slow)
            .chain([lamp.warm_up(self.grid, SLOW_ANSWERS_S[1])])
            .collect();
        self.lamp = Some(lamp);
        self
    }

    /// The lamp's swings; each jump with its swing.
    fn quick(&self, swings: &[Swing]) -> Vec<Vec<f64>> {
        let rings = |lamp: &Lamp| swings.iter().flat_map(|swing| lamp.rings(self.grid, swing)).collect();
        let mut columns = self.lamp.as_ref().map_or_else(Vec::new, rings);
        for jump in &self.jumps_s {
            columns.push(step_at(*jump, self.grid));
            columns.extend(swings.iter().flat_map(|swing| rings_from(&[*jump], self.grid, swing)));
        }
        columns
    }

    /// Number of the columns before the jumps'.
    pub fn before_jumps(&self, swings: usize) -> usize {
        self.slow.len() + self.lamp.as_ref().map_or(0, |_| 4 * swings)
    }

    /// Number of the columns of a jump: its step and its swings.
    pub fn of_jump(swings: usize) -> usize {
        1 + 2 * swings
    }

    /// The jumps with their swings.
    pub fn jump_columns(&self, swings: &[Swing]) -> Vec<Vec<f64>> {
        Acting { lamp: None, ..self.clone() }.quick(swings)
    }

    /// The columns' amplitudes under a noise.
    pub fn solution(&self, noise: &Noise) -> Option<(Filter, Solution)> {
        let filter = Filter::of(noise, self.grid);
        let quick = self.quick(&noise.swings);
        let columns = filter.whiten_all(&self.slow.iter().chain(&quick).collect::<Vec<_>>());
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let solution = solve(&columns, &filter.whiten(&self.grid.y_m), &[])?;
        Some((filter, solution))
    }

    /// −2 ln likelihood of a noise, but for a constant.
    pub fn minus_two_ln(&self, noise: &Noise) -> f64 {
        self.solution(noise).map_or(f64::INFINITY, |(filter, solution)| solution.chi2 + filter.ln_determinant)
    }

    /// A first guess: white noise of the samples, the strongest swing of the first band.
    pub fn begin(&self, bands_hz: &[[f64; 2]]) -> Noise {
        let white_m = self.sample_m;
        let hz = strongest_hz(self.grid, bands_hz[0]);
        let drive = (white_m * white_m * 0.1).max(f64::MIN_POSITIVE);
        Noise {
            white_m,
            walk_m2_s: 1e-4 * white_m * white_m,
            swings: vec![Swing { hz, damping: 0.01, drive_m2_s: 1e-3 * drive, sense: 1.0 }],
        }
    }

    /// The likeliest noise, from a first guess.
    pub fn learnt(&self, from: &Noise, bands_hz: &[[f64; 2]]) -> Noise {
        // the likelihood has a summit at every turn missed, so the first swing's frequency is looked for before it is led on
        let band = bands_hz[0];
        let changes = self.grid.y_m.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum::<f64>();
        let turn = std::f64::consts::TAU * from.swings[0].hz * self.grid.step_s;
        let rms_m = (changes / self.grid.len() as f64).sqrt() / turn;
        let of = |hz: f64, damping: f64| {
            let mut noise = from.clone();
            // kept up by a part of its size: what goes on by itself alone fits nowhere beside the very summit
            let swing = Swing { hz: hz.clamp(band[0], band[1]), damping, drive_m2_s: 0.0, sense: 1.0 };
            let drive_m2_s = 4.0 * swing.pole()[0] * (KEPT_UP * rms_m).powi(2);
            noise.swings[0] = Swing { drive_m2_s, ..swing };
            noise
        };
        let spacing_hz = 0.4 / self.grid.duration_s();
        let around = |hz: f64| (-FREQUENCIES..=FREQUENCIES).map(move |k| hz + k as f64 * spacing_hz);
        let strongest = strongest_hz(self.grid, band);
        let further = if (strongest - from.swings[0].hz).abs() > spacing_hz { Some(strongest) } else { None };
        let all = around(from.swings[0].hz).chain(further.into_iter().flat_map(around));
        let tried = all.flat_map(|hz| DAMPINGS.map(|damping| of(hz, damping)));
        let best = tried.map(|noise| (self.minus_two_ln(&noise), noise)).min_by(|a, b| a.0.total_cmp(&b.0));
        self.descended(&best.map_or_else(|| from.clone(), |best| best.1), bands_hz, EVALUATIONS, 1.0)
    }

    /// The likeliest noise, from one that was the likeliest with something else at work.
    pub fn learnt_again(&self, from: &Noise, bands_hz: &[[f64; 2]]) -> Noise {
        self.descended(from, bands_hz, FEWER + 5 * from.states(), 0.6)
    }

    fn descended(&self, from: &Noise, bands_hz: &[[f64; 2]], most: usize, stride: f64) -> Noise {
        // white noise by itself: it trades with nothing, and a descent in fewer directions is surer
        let coded = code(from);
        let white = coded[0];
        let mut step = vec![1.5 * stride];
        for _ in &from.swings {
            step.extend([0.3 / self.grid.duration_s() * stride, 0.6 * stride, 1.5 * stride]);
        }
        let sample_m = self.sample_m;
        let with_white = |white: f64, x: &[f64]| {
            let all: Vec<f64> = std::iter::once(white).chain(x.iter().copied()).collect();
            decode(&all, from, bands_hz, sample_m)
        };
        let (best, mut least) = descend(&coded[1..], &step, most, |x| self.minus_two_ln(&with_white(white, x)));
        let mut all: Vec<f64> = std::iter::once(white).chain(best).collect();
        // the likelihood of each swing's frequency has a summit at every turn missed
        for k in 0..from.swings.len() {
            let place = FIRST_HZ + 3 * k;
            let own_hz = all[place];
            let left = self.left_of(&with_white(all[0], &all[1..]));
            let around = strongest_hz(&left, [0.98, 1.02].map(|part| part * own_hz));
            let nearby = NEARBY_TURNS.map(|turns| own_hz + turns / self.grid.duration_s());
            for hz in nearby.into_iter().chain([around]) {
                let mut moved = all.clone();
                moved[place] = hz;
                let lower = self.minus_two_ln(&with_white(moved[0], &moved[1..]));
                if lower < least {
                    (least, all) = (lower, moved);
                }
            }
        }
        let mut step: Vec<f64> = std::iter::once(WHITE_STEP).chain(step.iter().map(|s| 0.3 * s)).collect();
        for _ in 0..SWEEPS {
            for k in 0..all.len() {
                let tried = [step[k], -step[k]].map(|shift| {
                    let mut moved = all.clone();
                    moved[k] += shift;
                    (self.minus_two_ln(&with_white(moved[0], &moved[1..])), moved)
                });
                match tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) {
                    Some((lower, moved)) if lower < least => (least, all) = (lower, moved),
                    _ => step[k] *= 0.3,
                }
            }
        }
        with_white(all[0], &all[1..])
    }

    /// The noise with those further swings of the bands that the record shows.
    pub fn with_further_swings(&self, mut noise: Noise, bands_hz: &[[f64; 2]]) -> Noise {
        for band in &bands_hz[noise.swings.len()..] {
            if 1.15 * band[1] > 0.5 / self.grid.step_s {
                break;
            }
            let before = self.minus_two_ln(&noise);
            let of = |x: &[f64], sense: f64| {
                let mut with = noise.clone();
                let damping = x[1].exp().clamp(DAMPING[0], DAMPING[1]);
                with.swings.push(Swing { hz: x[0].clamp(band[0], band[1]), damping, drive_m2_s: x[2].exp(), sense });
                with
            };
            let left = self.left_of(&noise);
            let start = [strongest_hz(&left, *band), 0.01f64.ln(), (1e-4 * noise.white_m * noise.white_m).ln()];
            let led = |sense: f64| {
                let (x, least) =
                    descend(&start, &[0.02, 0.6, 2.0], EVALUATIONS / 3, |x| self.minus_two_ln(&of(x, sense)));
                (of(&x, sense), least)
            };
            let [one, other] = [led(-1.0), led(1.0)];
            let (with, after) = if one.1 < other.1 { one } else { other };
            if before - after < FURTHER_SWING {
                continue;
            }
            noise = with;
        }
        noise
    }

    /// The grid with the innovations in place of the displacements.
    fn left_of(&self, noise: &Noise) -> Grid {
        let left = self.solution(noise).map_or_else(|| self.grid.y_m.clone(), |(_, solution)| solution.left);
        Grid { y_m: left, ..self.grid.clone() }
    }
}

/// Light and the swings that it excites: light first.
pub fn lamp_columns(lamp: &Lamp, grid: &Grid, swings: &[Swing]) -> Vec<Vec<f64>> {
    let mut columns = vec![lamp.light(grid)];
    columns.extend(swings.iter().flat_map(|swing| lamp.rings(grid, swing)));
    columns
}

fn code(noise: &Noise) -> Vec<f64> {
    let mut x = vec![noise.white_m.ln(), noise.walk_m2_s.max(f64::MIN_POSITIVE).ln()];
    for swing in &noise.swings {
        x.extend([swing.hz, swing.damping.ln(), swing.drive_m2_s.max(f64::MIN_POSITIVE).ln()]);
    }
    x
}

/// `from` tells the senses of the swings, which no descent changes.
fn decode(x: &[f64], from: &Noise, bands_hz: &[[f64; 2]], sample_m: f64) -> Noise {
    let swing = |(k, v): (usize, &[f64])| {
        let within = |band: &[f64; 2]| band[0] <= v[0] && v[0] <= band[1];
        let band = bands_hz.iter().find(|band| within(band)).unwrap_or(&bands_hz[k.min(bands_hz.len() - 1)]);
        Swing {
            hz: v[0].clamp(band[0], band[1]),
            damping: v[1].exp().clamp(DAMPING[0], DAMPING[1]),
            drive_m2_s: v[2].exp(),
            sense: from.swings[k].sense,
        }
    };
    Noise {
        white_m: x[0].exp().clamp(sample_m * WHITE_FACTORS[0], sample_m * WHITE_FACTORS[1]),
        walk_m2_s: x[1].exp(),
        swings: x[2..].chunks(3).enumerate().map(swing).collect(),
    }
}

/// The frequency of a band at which a grid has most power.
fn strongest_hz(grid: &Grid, band_hz: [f64; 2]) -> f64 {
    let spacing_hz = 0.25 / grid.duration_s();
    let count = ((band_hz[1] - band_hz[0]) / spacing_hz).ceil().max(1.0) as usize;
    // differences take out what is slow
    let change: Vec<f64> = grid.y_m.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let power = |hz: f64| {
        let turn = std::f64::consts::TAU * hz * grid.step_s;
        let (c, s) = (turn.cos(), turn.sin());
        let (mut x, mut y, mut real, mut imaginary) = (1.0, 0.0, 0.0, 0.0);
        for v in &change {
            real += v * x;
            imaginary += v * y;
            (x, y) = (c * x - s * y, s * x + c * y);
        }
        real * real + imaginary * imaginary
    };
    let at = |k: usize| band_hz[0] + k as f64 * spacing_hz;
    let best = (0..=count).map(|k| (power(at(k)), at(k))).max_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or(band_hz[0], |best| best.1).min(band_hz[1])
}

/// Nelder and Mead's descent; the best point and its value.
fn descend(start: &[f64], step: &[f64], most: usize, mut value: impl FnMut(&[f64]) -> f64) -> (Vec<f64>, f64) {
    let count = start.len();
    let mut points: Vec<(Vec<f64>, f64)> = Vec::with_capacity(count + 1);
    points.push((start.to_vec(), value(start)));
    for k in 0..count {
        let mut x = start.to_vec();
        x[k] += step[k];
        let v = value(&x);
        points.push((x, v));
    }
    let mut used = count + 1;
    let along = |from: &[f64], to: &[f64], share: f64| -> Vec<f64> {
        from.iter().zip(to).map(|(a, b)| a + share * (b - a)).collect()
    };
    while used < most {
        points.sort_by(|a, b| a.1.total_cmp(&b.1));
        if points[count].1 - points[0].1 < 0.1 {
            break;
        }
        let centre: Vec<f64> =
            (0..count).map(|k| points[..count].iter().map(|p| p.0[k]).sum::<f64>() / count as f64).collect();
        let mut try_at = |share: f64| {
            let x = along(&centre, &points[count].0, share);
            used += 1;
            let v = value(&x);
            (x, v)
        };
        let mirrored = try_at(-1.0);
        let next = if mirrored.1 < points[0].1 {
            let further = try_at(-2.0);
            if further.1 < mirrored.1 { further } else { mirrored }
        } else if mirrored.1 < points[count - 1].1 {
            mirrored
        } else {
            let nearer = try_at(if mirrored.1 < points[count].1 { -0.5 } else { 0.5 });
            if nearer.1 < points[count].1.min(mirrored.1) {
                nearer
            } else {
                let best = points[0].0.clone();
                for point in &mut points[1..] {
                    point.0 = along(&best, &point.0, 0.5);
                    point.1 = value(&point.0);
                    used += 1;
                }
                continue;
            }
        };
        points[count] = next;
    }
    points.sort_by(|a, b| a.1.total_cmp(&b.1));
    points.swap_remove(0)
}
