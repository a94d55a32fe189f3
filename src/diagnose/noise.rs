//! The noise of a recording, from the frequencies at which the motion itself has no power.
//!
//! What a model lacks shows where the specimen swings: at its own frequencies and their combinations. Elsewhere the residual of even a poor fit is noise.
//! Of its power there, after a Hann window, the noise's standard deviation and how it goes on from row to row are found by Whittle's likelihood of a
//! first-order autoregression beside white noise:
//!
//! ```text
//! S(f) = σ²[1 − s + s (1 − ρ²)/(1 + ρ² − 2ρ cos 2πfΔt)]
//! ```

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::settings::NoiseSettings;
use crate::fit::whitening::Colour;
use crate::statistics::{median, median_step_s};

/// A frequency that lies this many bins from one that belongs to the motion belongs to it.
const BINS: usize = 4;
/// The first bin that an offset does not reach: after a Hann window it lies in those of zero and one. A tilt, a curl or a side force is no slow noise.
const PAST_ZERO: usize = 2;
/// Frequencies to either side with which a line is compared.
const AROUND: usize = 12;
/// Noise that goes on must be the same in so many parts of a recording.
const PARTS: usize = 3;
/// Times tried for which noise goes on, in rows: from the shortest by a factor each.
const ROWS: (f64, f64, usize) = (0.3, 1.12, 48);
/// Shares of the variance tried that go on.
const SHARES: usize = 20;

/// Noise of one angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Standard deviation.
    pub sd: f64,
    /// How it goes on from row to row.
    pub colour: Colour,
}

/// How far the noise of two angles goes together: the correlation of their residuals at frequencies at which neither swings; zero where that is no more
/// than chance, or where they swing nearly everywhere. Each is given as its residual and its motion.
pub fn across([first, second]: [(&[f64], &[f64]); 2], settings: &NoiseSettings) -> f64 {
    let (a, b) = (transform(first.0), transform(second.0));
    let between = |noise: &[Complex<f64>], motion: &[f64]| Lines::of(motion)?.between(&power(noise), settings);
    let (Some(one), Some(other)) = (between(&a, first.1), between(&b, second.1)) else { return 0.0 };
    let free: Vec<usize> = one.into_iter().filter(|k| other.binary_search(k).is_ok()).collect();
    let (mut both, mut powers) = (0.0, [0.0; 2]);
    for k in &free {
        both += (a[*k] * b[*k].conj()).re;
        powers = [powers[0] + a[*k].norm_sqr(), powers[1] + b[*k].norm_sqr()];
    }
    let together = both / (powers[0] * powers[1]).sqrt().max(1e-300);
    if together.abs() > settings.together / (free.len().max(1) as f64).sqrt() { together } else { 0.0 }
}

/// At which tick of an even clock each stamp is. Rows are missing where it skips some; where more would be missing than there are, each row is a tick.
pub fn ticks(t_s: &[f64]) -> Vec<usize> {
    let every_row = || (0..t_s.len()).collect();
    let Some(step_s) = median_step_s(t_s) else { return every_row() };
    let mut ticks: Vec<usize> = Vec::with_capacity(t_s.len());
    for t in t_s {
        let tick = ((t - t_s[0]) / step_s).round() as usize;
        ticks.push(ticks.last().map_or(tick, |last| tick.max(last + 1)));
    }
    if ticks.last().is_some_and(|last| *last > 2 * t_s.len()) { every_row() } else { ticks }
}

/// The noise in a residual, given the motion it is the residual of; missing rows are zero in both. `None` where the motion has power nearly everywhere.
pub fn off_the_lines(residual: &[f64], motion: &[f64], settings: &NoiseSettings) -> Option<Noise> {
    let present = residual.iter().filter(|r| **r != 0.0).count() as f64 / residual.len() as f64;
    let seen = Between::of(residual, motion, settings)?;
    let length = residual.len().div_ceil(PARTS);
    let parts: Vec<Between> =
        residual.chunks(length).zip(motion.chunks(length)).filter_map(|(r, m)| Between::of(r, m, settings)).collect();
    // what comes once, as a gust does or a jump of the clock, or fades, as a joint that settles, is no noise: without the part that says most for it the others
    // must say so, too
    let throughout = |colour: Colour| {
        let gains: Vec<f64> = parts.iter().map(|part| part.gains(colour)).collect();
        gains.len() < PARTS || gains.iter().sum::<f64>() > gains.iter().copied().fold(0.0, f64::max) + settings.beside
    };
    // there is no more noise than there is residual
    let most = settings.most * residual.iter().map(|r| r * r).sum::<f64>() / residual.len() as f64;
    let likeliest = |colours: &mut dyn Iterator<Item = Colour>| {
        let fitted = colours.map(|colour| (colour, seen.likelihood(colour))).filter(|(_, (_, v))| *v < most);
        fitted.max_by(|a, b| a.1.0.total_cmp(&b.1.0))
    };
    let (shortest, factor, steps) = ROWS;
    let rhos: Vec<f64> = (0..steps).map(|k| (-1.0 / (shortest * factor.powi(k as i32))).exp()).collect();
    let mut best = (Colour::default(), seen.likelihood(Colour::default()));
    let alone = likeliest(&mut rhos.iter().map(|rho| Colour { rho: *rho, share: 1.0 }));
    if let Some(alone) = alone.filter(|alone| alone.1.0 > best.1.0 + settings.coloured && throughout(alone.0)) {
        best = alone;
    }
    let shares = (1..SHARES).map(|k| k as f64 / SHARES as f64);
    let beside = likeliest(&mut shares.flat_map(|share| rhos.iter().map(move |rho| Colour { rho: *rho, share })));
    let more = if best.0.is_white() { settings.coloured } else { settings.beside };
    if let Some(beside) = beside.filter(|beside| beside.1.0 > best.1.0 + more && throughout(beside.0)) {
        best = beside;
    }
    Some(Noise { sd: (best.1.1 / present).sqrt(), colour: best.0 })
}

/// A residual's power at the frequencies at which there is nothing but noise.
struct Between {
    /// cos 2πfΔt and power of each.
    powers: Vec<(f64, f64)>,
}

impl Between {
    fn of(residual: &[f64], motion: &[f64], settings: &NoiseSettings) -> Option<Self> {
        let power = spectrum(residual);
        let angle_rad = |k: usize| std::f64::consts::PI * k as f64 / (power.len() - 1) as f64;
        let free = Lines::of(motion)?.between(&power, settings)?;
        Some(Self { powers: free.into_iter().map(|k| (angle_rad(k).cos(), power[k])).collect() })
    }

    /// ln-likelihood of a colour, up to a constant, with the variance that makes it likeliest.
    fn likelihood(&self, Colour { rho, share }: Colour) -> (f64, f64) {
        let shape = |cosine: f64| 1.0 - share + share * (1.0 - rho * rho) / (1.0 + rho * rho - 2.0 * rho * cosine);
        let (mut sum, mut ln) = (0.0, 0.0);
        for (cosine, power) in &self.powers {
            let shape = shape(*cosine);
            sum += power / shape;
            ln += shape.ln();
        }
        let count = self.powers.len() as f64;
        let variance = sum / count;
        (-ln - count * variance.ln(), variance)
    }

    /// How much likelier a colour is than none.
    fn gains(&self, colour: Colour) -> f64 {
        self.likelihood(colour).0 - self.likelihood(Colour::default()).0
    }
}

/// The motion's own power, and where it is strongest.
struct Lines {
    power: Vec<f64>,
    peak: usize,
}

impl Lines {
    fn of(motion: &[f64]) -> Option<Self> {
        let power = spectrum(motion);
        let peak = (1..power.len()).max_by(|a, b| power[*a].total_cmp(&power[*b]))?;
        Some(Self { power, peak })
    }

    /// The frequencies at which neither the motion has power nor the residual, of whose spectrum this is, a line of its own, in order; `None` where few are
    /// left.
    fn between(&self, noise: &[f64], settings: &NoiseSettings) -> Option<Vec<usize>> {
        let Self { power: lines, peak } = self;
        let near = |k: usize| k.saturating_sub(BINS)..(k + BINS + 1).min(lines.len());
        // as much of the motion as the residual has where that is strongest, it may have everywhere: it must stay below the noise
        let least = usual(&mut noise[1..].to_vec())?;
        let share =
            noise[near(*peak)].iter().sum::<f64>() / lines[near(*peak)].iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let bound = (settings.motion * lines[*peak]).max(settings.leaks * least / share);
        let of_motion = |k: usize| lines[near(k)].iter().any(|p| *p > bound);
        let free: Vec<usize> = (PAST_ZERO..noise.len()).filter(|k| !of_motion(*k)).collect();
        if (free.len() as f64) < settings.enough * noise.len() as f64 {
            return None;
        }
        // a line that the motion does not have, as of a moving support, must not count as noise
        let power: Vec<f64> = free.iter().map(|k| noise[*k]).collect();
        let stands_out = |i: usize| {
            let first = i.saturating_sub(AROUND).min(power.len().saturating_sub(2 * AROUND + 1));
            let around = &power[first..power.len().min(first + 2 * AROUND + 1)];
            usual(&mut around.to_vec()).is_some_and(|usual| power[i] > settings.line * usual)
        };
        Some((0..free.len()).filter(|i| !stands_out(*i)).map(|i| free[i]).collect())
    }
}

/// The mean power of which these are chance samples, whatever the few large ones are.
fn usual(power: &mut [f64]) -> Option<f64> {
    Some(median(power)? / std::f64::consts::LN_2)
}

/// The noise in a residual that is nothing but noise; missing rows are zero.
pub fn of_all(residual: &[f64]) -> Noise {
    let present: Vec<f64> = residual.iter().copied().filter(|r| *r != 0.0).collect();
    let power: f64 = present.iter().map(|r| r * r).sum();
    let rho = present.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / power.max(1e-300);
    let told_from_none = 3.0 / (present.len().max(1) as f64).sqrt();
    let colour = if rho > told_from_none { Colour { rho, share: 1.0 } } else { Colour::default() };
    Noise { sd: (power / present.len().max(1) as f64).sqrt(), colour }
}

/// Power of each frequency from zero to half the rate, scaled so that white noise has its variance.
pub(super) fn spectrum(values: &[f64]) -> Vec<f64> {
    power(&transform(values))
}

fn power(transformed: &[Complex<f64>]) -> Vec<f64> {
    transformed.iter().map(Complex::norm_sqr).collect()
}

/// The transform of windowed values, on the scale of [`spectrum`].
fn transform(values: &[f64]) -> Vec<Complex<f64>> {
    let n = values.len();
    let window = |i: usize| 0.5 - 0.5 * (std::f64::consts::TAU * (i as f64 + 0.5) / n as f64).cos();
    let mut buffer: Vec<Complex<f64>> =
        values.iter().enumerate().map(|(i, v)| Complex::new(v * window(i), 0.0)).collect();
    FftPlanner::new().plan_fft_forward(n).process(&mut buffer);
    let scale = (0..n).map(|i| window(i) * window(i)).sum::<f64>().sqrt();
    buffer[..=n / 2].iter().map(|c| c / scale).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// A decaying swing, and a residual of noise with a misfit of the swing ten times as large.
    fn case(rho: f64, share: f64) -> Option<Noise> {
        let mut random = rand::rngs::StdRng::seed_from_u64(3);
        let swing = |i: usize, phase: f64| (-0.001 * i as f64).exp() * (0.28 * i as f64 + phase).sin();
        let mut noise = 0.0;
        let residual: Vec<f64> = (0..1800)
            .map(|i| {
                let white: f64 = StandardNormal.sample(&mut random);
                noise = rho * noise + (1.0 - rho * rho).sqrt() * white;
                let beside: f64 = StandardNormal.sample(&mut random);
                1e-3 * (share.sqrt() * noise + (1.0 - share).sqrt() * beside) + 1e-2 * swing(i, 1.0)
            })
            .collect();
        let motion: Vec<f64> = (0..1800).map(|i| 0.5 * swing(i, 0.0)).collect();
        off_the_lines(&residual, &motion, &NoiseSettings::default())
    }

    #[test]
    fn a_misfit_of_the_swing_is_not_taken_for_noise() {
        let noise = case(0.0, 1.0).unwrap();
        assert!((noise.sd / 1e-3 - 1.0).abs() < 0.06 && noise.colour.is_white(), "{noise:?}");
    }

    #[test]
    fn the_noise_of_a_mark_between_two_angles_is_found_in_both() {
        let mut random = rand::rngs::StdRng::seed_from_u64(5);
        let mut marks = || -> [f64; 3] { std::array::from_fn(|_| StandardNormal.sample(&mut random)) };
        let motion: Vec<f64> = (0..1800).map(|i| 0.5 * (0.28 * f64::from(i)).sin()).collect();
        let seen: Vec<[f64; 3]> = (0..1800).map(|_| marks()).collect();
        let left = |link: usize| -> Vec<f64> {
            (0..1800).map(|i| 1e-4 * (seen[i][link + 1] - seen[i][link]) + 0.02 * motion[i]).collect()
        };
        let (first, second) = (left(0), left(1));
        let found = across([(&first, &motion), (&second, &motion)], &NoiseSettings::default());
        assert!((found + 0.5).abs() < 0.06, "{found}");
        let other: Vec<f64> = (0..1800).map(|i| 1e-4 * seen[(i + 900) % 1800][0]).collect();
        assert_eq!(across([(&first, &motion), (&other, &motion)], &NoiseSettings::default()), 0.0);
    }

    #[test]
    fn rows_that_are_missing_leave_their_ticks() {
        let t_s = [10.0, 10.1, 10.2, 10.5, 10.61, 10.7];
        assert_eq!(ticks(&t_s), [0, 1, 2, 5, 6, 7]);
        assert_eq!(ticks(&[0.0, 0.1, 0.2, 9.0]), [0, 1, 2, 3]);
    }

    #[test]
    fn noise_that_drifts_as_slowly_as_the_swing_is_seen_below_its_line() {
        let mut random = rand::rngs::StdRng::seed_from_u64(7);
        let mut white = || -> f64 { StandardNormal.sample(&mut random) };
        let (rho, share): (f64, f64) = (0.955, 0.8);
        let mut drift = white();
        let residual: Vec<f64> = (0..3600)
            .map(|_| {
                drift = rho * drift + (1.0 - rho * rho).sqrt() * white();
                4e-3 * (share.sqrt() * drift + (1.0 - share).sqrt() * white())
            })
            .collect();
        let motion: Vec<f64> = (0..3600).map(|i| (-3e-4 * f64::from(i)).exp() * (0.08 * f64::from(i)).cos()).collect();
        let noise = off_the_lines(&residual, &motion, &NoiseSettings::default()).unwrap();
        assert!((noise.colour.rho - rho).abs() < 0.02 && (noise.colour.share - share).abs() < 0.1, "{noise:?}");
        assert!((noise.sd / 4e-3 - 1.0).abs() < 0.12, "{noise:?}");
    }

    #[test]
    fn an_offset_is_no_slow_noise() {
        let motion: Vec<f64> = (0..1800).map(|i| 0.2 * (0.4 * f64::from(i)).cos()).collect();
        let is_white = |seed: u64| {
            let mut random = rand::rngs::StdRng::seed_from_u64(seed);
            let residual: Vec<f64> = (0..1800)
                .map(|_| {
                    let white: f64 = StandardNormal.sample(&mut random);
                    2e-3 * white + 5e-4
                })
                .collect();
            off_the_lines(&residual, &motion, &NoiseSettings::default()).unwrap().colour.is_white()
        };
        let coloured = (0..50).filter(|seed| !is_white(*seed)).count();
        assert!(coloured <= 2, "{coloured} of 50");
    }

    #[test]
    fn a_gust_is_no_noise() {
        let mut random = rand::rngs::StdRng::seed_from_u64(11);
        let once = |i: usize| 5e-4 * (-((i as f64 - 430.0) / 20.0).powi(2)).exp();
        let residual: Vec<f64> = (0..600)
            .map(|i| {
                let white: f64 = StandardNormal.sample(&mut random);
                1e-4 * white + once(i)
            })
            .collect();
        let motion: Vec<f64> = (0..600).map(|i| 0.5 * (0.4 * f64::from(i)).cos()).collect();
        let noise = off_the_lines(&residual, &motion, &NoiseSettings::default()).unwrap();
        assert!(noise.colour.rho < 0.5, "{noise:?}");
    }

    #[test]
    fn a_jump_of_the_clock_is_no_noise() {
        let mut random = rand::rngs::StdRng::seed_from_u64(13);
        // a motion in the middle between the phases before and after
        let ahead = |i: usize| if i < 330 { -1.0 } else { 1.0 };
        let residual: Vec<f64> = (0..1320)
            .map(|i| {
                let white: f64 = StandardNormal.sample(&mut random);
                3e-4 * white + 0.02 * ahead(i) * (0.107 * i as f64).sin()
            })
            .collect();
        let motion: Vec<f64> = (0..1320).map(|i| 0.9 * (0.107 * f64::from(i)).cos()).collect();
        let noise = off_the_lines(&residual, &motion, &NoiseSettings::default()).unwrap();
        assert!(noise.colour.rho < 0.5, "{noise:?}");
    }

    #[test]
    fn coloured_noise_is_told_from_white() {
        let noise = case(0.6, 1.0).unwrap();
        assert!(
            (noise.colour.rho - 0.6).abs() < 0.08 && noise.colour.share > 0.7 && (noise.sd / 1e-3 - 1.0).abs() < 0.15,
            "{noise:?}"
        );
    }

    #[test]
    fn white_noise_beside_coloured_noise_is_found() {
        let noise = case(0.92, 0.6).unwrap();
        let Colour { rho, share } = noise.colour;
        assert!((rho - 0.92).abs() < 0.08 && (share - 0.6).abs() < 0.15, "{noise:?}");
        assert!((noise.sd / 1e-3 - 1.0).abs() < 0.15, "{noise:?}");
    }
}
