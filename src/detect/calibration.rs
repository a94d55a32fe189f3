//! How marks are best found in a recording, tried on pictures spread over it.
//!
//! A colour's name stands for a family of hues. Which of them the marks have, at which scale they are looked for and
//! above which threshold is what shows most round, moving spots, as many as there are marks.

use rayon::iter::{IndexedParallelIterator, IntoParallelRefIterator, ParallelIterator};

use super::component::{HueAxis, from_255, hue_angle_rad, to_255};
use super::mask::{Mask, Part};
use super::plane::Plane;
use super::samples::{Album, Samples, turn};
use super::threshold::{self, LEAST_COMPONENT, LEAST_CONTRAST, Relief, Summit};
use super::{Hue, LEAST_AREA_PX2, blobs::LEAST_ROUNDNESS};
use crate::error::Result;
use crate::experiment::{Look, MarkColour};
use crate::statistics::median;

/// Half width of a family of hues, rad: of a name, and of a measured colour.
const FAMILY_RAD: [f64; 2] = [0.75, 0.35];
/// Hues of a family that are tried.
const MOST_HUES: usize = 3;
/// What the far end of the family counts less than the named hue.
const OFF_NAME: f64 = 0.3;
/// A mark more samples wide than this is looked for at a coarser scale.
const MOST_SAMPLES_WIDE: f64 = 40.0;
/// A mark this many samples wide shows its shape.
const WIDE_ENOUGH: f64 = 6.0;
/// Coarsest scale: 2^4 chroma samples.
const LAST_LEVEL: u32 = 4;
/// Contrast at which a spot counts half, 0 to 255.
const HALF_CONTRAST: f64 = 40.0;
/// Numbers of marks for which threshold and scale are chosen where it is not known what the pictures show.
pub const COUNTS: [usize; 3] = [1, 2, 3];
/// Where between a threshold and the tops of the marks higher ones are tried.
const HIGHER: [f64; 3] = [0.25, 0.5, 0.75];
/// Where between the least contrast and a threshold lower ones are tried for black and white targets.
const LOWER: [f64; 2] = [0.5, 0.25];
/// What a spot that stands still counts where others move.
const STILL_COUNTS: f64 = 0.3;

/// One spot above the threshold in one picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Spot {
    /// Its samples at the trial's level.
    pub part: Part,
    /// Shape; see [`Part::shape`].
    pub roundness: f64,
    /// Something in it moves.
    pub moves: bool,
    /// Highest component, 0 to 255.
    pub top: f64,
}

/// One way to look for marks, and what it shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Hue, for marks that have one.
    pub angle_rad: Option<f64>,
    /// Without a hue: dark, or light.
    pub dark: bool,
    /// Scale.
    pub level: u32,
    /// 0 to 255.
    pub threshold: f64,
    /// Lines are not filtered out.
    pub thin: bool,
    /// Marks that were asked for.
    pub marks: usize,
    /// By picture.
    pub spots: Vec<Vec<Spot>>,
    /// 1: as many round moving spots as there are marks, in every picture.
    pub quality: f64,
}

impl Album {
    /// Learns hue, scale and threshold of every hue; `fixed` is a threshold that the user gave. Returns what each
    /// trial showed.
    ///
    /// # Errors
    /// [`crate::Error::OpenCv`].
    pub fn calibrate(&self, hues: &mut [Hue], fixed: Option<f64>) -> Result<Vec<Option<Trial>>> {
        let angles: Vec<Option<f64>> = hues
            .iter()
            .map(|h| (h.colour.look() == Look::Hue).then(|| hue_angle_rad(&h.colour, self.matrix)))
            .collect();
        let mut trials = Vec::new();
        for (index, hue) in hues.iter_mut().enumerate() {
            let others: Vec<f64> = (0..angles.len()).filter(|i| *i != index).filter_map(|i| angles[i]).collect();
            let trial = self.best_trial(hue, angles[index], &others, fixed)?;
            if let Some(trial) = &trial {
                hue.adopt(trial, self.sample_px2());
            }
            hue.threshold = fixed.unwrap_or(hue.threshold);
            trials.push(trial);
        }
        Ok(trials)
    }

    /// Whether a colour is of the hues that are looked for around a measured one.
    pub fn is_of_family(&self, measured: &MarkColour, colour: &MarkColour) -> bool {
        let [a, b] = [measured, colour].map(|own| hue_angle_rad(own, self.matrix));
        turn(a - b).abs() < FAMILY_RAD[1]
    }

    fn best_trial(&self, hue: &Hue, angle: Option<f64>, others: &[f64], fixed: Option<f64>) -> Result<Option<Trial>> {
        let Some(named_rad) = angle else {
            let dark = hue.colour.look() == Look::Dark;
            return Ok(self.try_luma(dark, &[hue.marks], fixed)?.pop().flatten());
        };
        // two colours of marks share what lies between them
        let nearest = others.iter().map(|o| 0.5 * turn(o - named_rad).abs()).fold(f64::MAX, f64::min);
        let half_width = FAMILY_RAD[usize::from(!hue.colour.is_named())].min(nearest);
        let mut peaks = self.hues(named_rad, half_width);
        peaks.truncate(MOST_HUES);
        let mut best: Option<(f64, Trial)> = None;
        for angle_rad in peaks.iter().map(|p| p.angle_rad).chain([named_rad]) {
            let Some(trial) = self.try_hue(angle_rad, &[hue.marks], fixed)?.pop().flatten() else { continue };
            let worth = trial.quality - OFF_NAME * turn(angle_rad - named_rad).abs() / half_width;
            if best.as_ref().is_none_or(|(most, _)| worth > *most) {
                best = Some((worth, trial));
            }
        }
        Ok(best.map(|(_, trial)| trial))
    }

    /// Other ways to see what `trial` looks for: for other numbers of spots, and above higher thresholds.
    ///
    /// # Errors
    /// [`crate::Error::OpenCv`].
    pub fn others(&self, trial: &Trial) -> Result<Vec<Trial>> {
        let mut others: Vec<Trial> = Vec::new();
        let ways = |counts: &[usize], fixed: Option<f64>| match trial.angle_rad {
            Some(angle_rad) => self.try_hue(angle_rad, counts, fixed),
            None => self.try_luma(trial.dark, counts, fixed),
        };
        let mut found = ways(&COUNTS, None)?;
        for part in HIGHER {
            found.extend(ways(&[trial.marks], Some(trial.threshold + part * (trial.usual_top() - trial.threshold)))?);
        }
        for way in found.into_iter().flatten() {
            let way = Trial { marks: trial.marks, ..way };
            if !others.iter().chain([trial]).any(|known| known.is_alike(&way)) {
                others.push(way);
            }
        }
        Ok(others)
    }

    /// Tries a hue at the scale that its spots ask for, for every number of marks: the best trial of each.
    ///
    /// # Errors
    /// [`crate::Error::OpenCv`].
    pub fn try_hue(&self, angle_rad: f64, counts: &[usize], fixed: Option<f64>) -> Result<Vec<Option<Trial>>> {
        let mut best: Vec<Option<Trial>> = vec![None; counts.len()];
        for level in 0..=LAST_LEVEL {
            let scale = self.at_scale(HueAxis::at_angle(angle_rad), level)?;
            let mut widest = 0.0f64;
            for (best, marks) in best.iter_mut().zip(counts) {
                let Some(mut trial) = scale.try_for(*marks, fixed) else { continue };
                trial.angle_rad = Some(angle_rad);
                widest = widest.max(trial.diameter_samples());
                keep_better(best, trial);
            }
            if widest <= MOST_SAMPLES_WIDE {
                break;
            }
        }
        Ok(best)
    }

    /// Dark marks, or light ones, at whatever scale shows them best, for every number of marks.
    ///
    /// # Errors
    /// [`crate::Error::OpenCv`].
    pub fn try_luma(&self, dark: bool, counts: &[usize], fixed: Option<f64>) -> Result<Vec<Option<Trial>>> {
        let mut best: Vec<Option<Trial>> = vec![None; counts.len()];
        for level in 0..=LAST_LEVEL {
            let scale = self.at_scale(HueAxis::of_luma_sign(dark), level)?;
            for (best, marks) in best.iter_mut().zip(counts) {
                if let Some(trial) = scale.try_for(*marks, fixed) {
                    keep_better(best, Trial { dark, ..trial });
                }
            }
        }
        Ok(best)
    }

    /// What every picture shows along an axis at one scale.
    fn at_scale(&self, axis: HueAxis, level: u32) -> Result<Scale> {
        let floor = if axis.is_luma() { LEAST_CONTRAST } else { LEAST_COMPONENT };
        let least = ((LEAST_AREA_PX2 / self.sample_px2()) as usize >> (2 * level)).max(3);
        let moved: Vec<Vec<bool>> = self.moved.iter().map(|m| self.coarse(m, level)).collect();
        let survey = |(n, picture): (usize, &Samples)| -> Result<(Plane, [Vec<Summit>; 2])> {
            let plane = self.plane(picture, axis, level)?;
            let mut relief = Relief::new(&plane, moved.get(n).map(Vec::as_slice), floor);
            let with_lines = relief.summits(least);
            relief.open();
            let without_lines = relief.summits(least);
            Ok((plane, [without_lines, with_lines]))
        };
        let surveys = self.pictures.par_iter().enumerate().map(survey).collect::<Result<Vec<_>>>()?;
        let mut planes = Vec::new();
        let mut summits: [Vec<Vec<Summit>>; 2] = [Vec::new(), Vec::new()];
        for (plane, [without_lines, with_lines]) in surveys {
            planes.push(plane);
            summits[0].push(without_lines);
            summits[1].push(with_lines);
        }
        // what moves is a mark rather than furniture; where it moves in no picture, all is still in the running
        let moves = summits[1].iter().filter(|s| s.iter().any(Summit::moves)).count() * 2 >= planes.len();
        if moves {
            summits.iter_mut().flatten().for_each(|s| s.retain(Summit::moves));
        }
        Ok(Scale { luma: axis.is_luma(), level, floor, least, moved, planes, summits, moves })
    }

    /// What moves, at a coarser scale: where a quarter of the samples do.
    fn coarse(&self, moved: &[bool], level: u32) -> Vec<bool> {
        let Some(first) = self.pictures.first() else { return Vec::new() };
        if level == 0 {
            return moved.to_vec();
        }
        let side = 1usize << level;
        let (columns, rows) = ((first.width >> level).max(1), (first.height >> level).max(1));
        let mut coarse = Vec::with_capacity(columns * rows);
        for y in 0..rows {
            // the rows first, in a loop over bytes that the compiler turns into vector instructions
            let mut sums = vec![0u8; first.width];
            for row in moved[y * side * first.width..].chunks_exact(first.width).take(side) {
                sums.iter_mut().zip(row).for_each(|(sum, moved)| *sum += u8::from(*moved));
            }
            let count = |own: &[u8]| own.iter().map(|sum| usize::from(*sum)).sum::<usize>();
            coarse.extend(sums.chunks(side).take(columns).map(|own| 4 * count(own) >= side * side));
        }
        coarse
    }

    /// The colour of a trial's likely spots as `#rrggbb`, or `dark` or `light` where it has no hue.
    pub fn colour_name(&self, trial: &Trial) -> Option<String> {
        let moves = trial.spots.iter().flatten().any(|s| s.moves);
        let mut samples = Vec::new();
        for (n, spots) in trial.spots.iter().enumerate() {
            for spot in spots.iter().filter(|s| s.roundness >= LEAST_ROUNDNESS && (s.moves || !moves)) {
                let picture = &self.pictures[n];
                let half = (1usize << trial.level) >> 1;
                let at = |p: &[usize; 2]| {
                    let [x, y] = p.map(|v| (v << trial.level) + half);
                    (n, y.min(picture.height - 1) * picture.width + x.min(picture.width - 1))
                };
                samples.extend(spot.part.points.iter().map(at));
            }
        }
        // a spot may be one with a still thing of its hue
        let moved = |(n, at): &(usize, usize)| self.moved.get(*n).is_some_and(|moved| moved[*at]);
        if samples.iter().any(moved) {
            samples.retain(moved);
        }
        let [r, g, b] = self.colour_of(&samples)?;
        let name = format!("#{r:02x}{g:02x}{b:02x}");
        name.parse::<MarkColour>().ok().map(|_| name)
    }

    /// The component of a picture, nothing where nothing is looked at.
    fn plane(&self, picture: &Samples, axis: HueAxis, level: u32) -> Result<Plane> {
        let mut plane = Plane::of_samples(picture, axis, level)?;
        if self.allowed.is_some() {
            let width = plane.width;
            for (at, value) in plane.values.iter_mut().enumerate() {
                let middle = |v: usize, size: usize| ((v << level) + ((1 << level) >> 1)).min(size - 1);
                let (x, y) = (middle(at % width, picture.width), middle(at / width, picture.height));
                if !self.allows(y * picture.width + x) {
                    *value = 0;
                }
            }
        }
        Ok(plane)
    }

    /// The strongest component of a hue in any picture, 0 to 255.
    ///
    /// # Errors
    /// [`crate::Error::OpenCv`].
    pub fn strongest(&self, hue: &Hue) -> Result<f64> {
        let axis = hue.axis(self.matrix);
        let mut top = 0i16;
        for picture in &self.pictures {
            let plane = self.plane(picture, axis, hue.level)?;
            top = plane.values.iter().copied().fold(top, i16::max);
        }
        Ok(to_255(f64::from(top)))
    }
}

/// What every picture shows along one axis at one scale.
struct Scale {
    luma: bool,
    level: u32,
    floor: f64,
    least: usize,
    moved: Vec<Vec<bool>>,
    planes: Vec<Plane>,
    /// Without thin lines, and with them; by picture.
    summits: [Vec<Vec<Summit>>; 2],
    moves: bool,
}

impl Scale {
    fn try_for(&self, marks: usize, fixed: Option<f64>) -> Option<Trial> {
        let chosen = [false, true].into_iter().find_map(|thin| {
            let threshold = threshold::choose(&self.summits[usize::from(thin)], marks, self.floor);
            threshold.map(|t| (fixed.unwrap_or(t), thin))
        });
        let (threshold, thin) = chosen?;
        let trial = self.at_threshold(threshold, thin, marks);
        // where black meets white, half of the step lies nearer the background than where it meets the background: above a high threshold the dark quadrants are too small to touch
        let is_too_high = fixed.is_none() && self.luma && trial.shows_targets();
        let lower = LOWER.iter().filter(|_| is_too_high).map(|part| self.floor + part * (threshold - self.floor));
        let lower = lower.map(|threshold| self.at_threshold(threshold, thin, marks));
        Some(lower.fold(trial, |best, lower| if lower.quality > best.quality { lower } else { best }))
    }

    /// What is above a threshold.
    fn at_threshold(&self, threshold: f64, thin: bool, marks: usize) -> Trial {
        let of_picture = |(n, plane): (usize, &Plane)| {
            let mask = Mask::of_plane(plane, from_255(threshold), thin).bridged(self.luma);
            spots_of(plane, &mask, self.least, self.moved.get(n).map(Vec::as_slice))
        };
        let spots: Vec<Vec<Spot>> = self.planes.par_iter().enumerate().map(of_picture).collect();
        let quality = quality(&spots, marks, self.moves, self.luma);
        let mut trial =
            Trial { angle_rad: None, dark: false, level: self.level, threshold, thin, marks, spots, quality };
        // a spot of few samples is round by chance, and beside its surroundings by little
        let wide = trial.usual_samples().map_or(0.0, |n| (n * 4.0 / std::f64::consts::PI).sqrt());
        trial.quality *= (wide / WIDE_ENOUGH).min(1.0);
        trial
    }
}

fn keep_better(best: &mut Option<Trial>, trial: Trial) {
    if best.as_ref().is_none_or(|b| trial.quality > b.quality) {
        *best = Some(trial);
    }
}

fn spots_of(plane: &Plane, mask: &Mask, least: usize, moved: Option<&[bool]>) -> Vec<Spot> {
    let spots = mask.parts().into_iter().filter(|part| part.points.len() >= least).map(|part| {
        let at = |p: &[usize; 2]| p[1] * plane.width + p[0];
        let moving = moved.map_or(0, |m| part.points.iter().filter(|p| m[at(p)]).count());
        let top = part.points.iter().map(|p| plane.values[at(p)]).max().unwrap_or(0);
        let summit = Summit { top: 0.0, saddle: 0.0, samples: part.points.len(), moved: moving };
        Spot { roundness: part.shape(), moves: summit.moves(), top: to_255(f64::from(top)), part }
    });
    spots.collect()
}

/// How well the spots of the pictures look like `marks` marks.
fn quality(pictures: &[Vec<Spot>], marks: usize, moves: bool, luma: bool) -> f64 {
    let of_picture = |spots: &Vec<Spot>| {
        let mut worth: Vec<f64> = spots
            .iter()
            .filter(|s| s.roundness >= LEAST_ROUNDNESS)
            .map(|s| {
                let still = if moves && !s.moves { STILL_COUNTS } else { 1.0 };
                let contrast = if luma { s.top / (s.top + HALF_CONTRAST) } else { 1.0 };
                still * contrast * s.roundness.min(1.0)
            })
            .collect();
        worth.sort_by(|a, b| b.total_cmp(a));
        let spare = spots.iter().filter(|s| s.moves).count().saturating_sub(marks) as f64;
        worth.iter().take(marks).sum::<f64>() / marks.max(1) as f64 / (1.0 + 0.05 * spare)
    };
    pictures.iter().map(of_picture).sum::<f64>() / pictures.len().max(1) as f64
}

impl Trial {
    /// Spots that look like marks: round, and moving where anything does.
    pub fn likely(&self) -> impl Iterator<Item = &Spot> {
        let moves = self.spots.iter().flatten().any(|s| s.moves);
        self.spots.iter().flatten().filter(move |s| s.roundness >= LEAST_ROUNDNESS && (s.moves || !moves))
    }

    /// Most of its likely spots are black and white targets.
    pub fn shows_targets(&self) -> bool {
        let likely: Vec<bool> = self.likely().map(|spot| spot.part.is_target()).collect();
        2 * likely.iter().filter(|is_target| **is_target).count() > likely.len()
    }

    /// Most pictures show more than the marks.
    pub fn is_crowded(&self) -> bool {
        let crowded = self.spots.iter().filter(|spots| spots.len() > self.marks).count();
        2 * crowded > self.spots.len()
    }

    /// Usual top of what moves and stands out most, as many as there are marks.
    fn usual_top(&self) -> f64 {
        let lowest = |spots: &Vec<Spot>| {
            let mut tops: Vec<f64> = spots.iter().filter(|s| s.moves).map(|s| s.top).collect();
            tops.sort_by(|a, b| b.total_cmp(a));
            tops.get(self.marks.min(tops.len()).checked_sub(1)?).copied()
        };
        median(&mut self.spots.iter().filter_map(lowest).collect::<Vec<_>>()).unwrap_or(self.threshold)
    }

    /// Two trials would find the same.
    pub fn is_alike(&self, other: &Self) -> bool {
        let sizes = self.usual_samples().zip(other.usual_samples());
        self.angle_rad == other.angle_rad
            && (self.level, self.thin) == (other.level, other.thin)
            && (self.threshold / other.threshold).ln().abs() < 0.2
            && sizes.is_none_or(|(a, b)| (a / b).ln().abs() < 0.4)
    }

    /// Usual number of samples of a mark, at the trial's level: of the clearest spots, as many as there are marks.
    pub fn usual_samples(&self) -> Option<f64> {
        let moves = self.spots.iter().flatten().any(|s| s.moves);
        let mut sizes = Vec::new();
        for picture in &self.spots {
            let likely = picture.iter().filter(|s| s.roundness >= LEAST_ROUNDNESS && (s.moves || !moves));
            let mut clearest: Vec<(f64, usize)> =
                likely.map(|s| (s.top * s.roundness.min(1.0), s.part.points.len())).collect();
            clearest.sort_by(|a, b| (b.0 * b.1 as f64).total_cmp(&(a.0 * a.1 as f64)));
            sizes.extend(clearest.iter().take(self.marks).map(|(_, size)| *size as f64));
        }
        median(&mut sizes)
    }

    /// Width of the largest likely spot.
    fn diameter_samples(&self) -> f64 {
        let most = self.likely().map(|s| s.part.points.len()).max().unwrap_or(0);
        let all = self.spots.iter().flatten().filter(|s| s.moves).map(|s| s.part.points.len()).max().unwrap_or(0);
        (most.max(all) as f64 * 4.0 / std::f64::consts::PI).sqrt()
    }
}
