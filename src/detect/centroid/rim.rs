//! The pixels of the boundary band, where the mark fades into its surroundings.

use nalgebra::Vector3;

use super::disc::{Disc, LANES};
use super::fit::Band;
use super::patch::{Levels, Sample};
use super::share::Share;
use super::surroundings::Surroundings;

/// The pixels of the band.
pub struct Rim<'a> {
    /// Where they lie and what they hold.
    pub samples: &'a [&'a Sample],
}

impl Rim<'_> {
    /// The background continued to every pixel.
    pub fn backgrounds(&self, surroundings: &Surroundings) -> Vec<Levels> {
        self.samples.iter().map(|s| surroundings.background_at(usize::from(s.sector), s)).collect()
    }

    /// The shares of a disc in every pixel.
    pub fn of_disc(&self, disc: &Disc) -> Vec<f32> {
        let shape = disc.evaluator(disc.positions());
        let mut shares = Vec::with_capacity(self.samples.len() + LANES);
        for pack in self.samples.chunks(LANES) {
            let at = |i: usize| pack.get(i).map_or([0.0; 2], |s| [s.dx_px, s.dy_px]);
            let [mut x, mut y] = [[0.0; LANES]; 2];
            (0..LANES).for_each(|i| [x[i], y[i]] = at(i));
            shares.extend_from_slice(&shape.at(&x, &y).share);
        }
        shares.truncate(self.samples.len());
        shares
    }

    /// What every pixel holds beside the disc and the background.
    pub fn rests(&self, of_disc: &[f32], shares: &Shares<'_>, backgrounds: &[Levels]) -> Vec<Vector3<f32>> {
        let each = self.samples.iter().zip(of_disc).zip(backgrounds);
        each.map(|((s, share), background)| shares.of(s, *background).rest(s.levels, *background, *share)).collect()
    }

    /// Those that are mixtures of mark and background, with the share of mark.
    pub fn mixtures(&self, shares: &Shares<'_>, backgrounds: &[Levels]) -> Band {
        let mut band = Band::default();
        for (sample, background) in self.samples.iter().zip(backgrounds) {
            let share = shares.of(sample, *background);
            if share.variance.is_finite()
                && let Some((part, variance)) = share.of(sample.levels, *background)
            {
                band.push([sample.dx_px, sample.dy_px], part, variance);
            }
        }
        band
    }
}

/// How the share of mark is read in every pixel.
pub struct Shares<'a> {
    /// By sector.
    pub by_sector: &'a [Share],
    /// Every pixel has a background of its own.
    pub each: bool,
}

impl Shares<'_> {
    #[inline]
    fn of(&self, sample: &Sample, background: Levels) -> Share {
        let share = self.by_sector[usize::from(sample.sector)];
        if self.each { share.before(background) } else { share }
    }
}
