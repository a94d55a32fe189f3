//! The threshold between mark and background, chosen from pictures of the recording.
//!
//! Each summit of the colour component is followed down to the level where it joins a higher one (its saddle): the
//! difference is its persistence. The marks are the most persistent summits, and the threshold lies between the
//! saddle and the summit of the weakest of them, so an amber film or a bright background shifts it where it must be.

use super::component::{HueAxis, from_255, to_255};
use super::morphology::{dilate, erode};
use crate::video::Picture;

/// Below this, on the scale to 255, nothing is taken for a mark: the chroma noise of cameras and codecs.
pub const LEAST_COMPONENT: f64 = 16.0;
/// Where between saddle (0) and summit (1) the threshold lies; a blurred mark keeps more than this of its summit.
const POSITION: f64 = 0.4;
/// Share of the greatest persistence below which a summit is a ripple.
const CLEAR_SHARE: f64 = 0.2;

/// One summit of the colour component.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summit {
    /// Highest component, on the scale to 255.
    pub top: f64,
    /// Component at which it joins a higher summit or the background.
    pub saddle: f64,
    /// Chroma samples above the saddle.
    pub samples: usize,
}

impl Summit {
    fn persistence(&self) -> f64 {
        self.top - self.saddle
    }

    fn threshold(&self) -> f64 {
        self.saddle + POSITION * self.persistence()
    }
}

/// The colour component as a landscape over the chroma samples.
pub struct Relief {
    width: usize,
    heights: Vec<i16>,
}

impl Relief {
    /// Of a picture.
    pub fn new(picture: &Picture<'_>, axis: HueAxis) -> Self {
        let (width, height) = picture.layout.chroma_size();
        let mut heights = Vec::with_capacity(width * height);
        (0..height).for_each(|y| axis.row(picture, y, 0..width, &mut heights));
        Self { width, heights }
    }

    /// Grey opening over 3×3 samples: ridges of up to two samples, such as burnt-in lines, are worn away.
    pub fn open(&mut self) {
        erode(&mut self.heights, self.width, 1);
        dilate(&mut self.heights, self.width, 1);
    }

    /// The summits with at least `least_samples` samples, most persistent first.
    pub fn summits(&self, least_samples: usize) -> Vec<Summit> {
        let (width, height) = (self.width, self.heights.len() / self.width);
        let floor = from_255(LEAST_COMPONENT);
        let mut order: Vec<(i16, u32)> =
            self.heights.iter().enumerate().filter(|(_, h)| **h > floor).map(|(i, h)| (*h, i as u32)).collect();
        order.sort_unstable_by(|a, b| b.cmp(a));
        let mut forest = Forest::new(width * height);
        let mut found = Vec::new();
        for &(level, at) in &order {
            forest.add(at, level);
            let (x, y) = (at as usize % width, at as usize / width);
            let neighbours = [
                (x > 0).then(|| at - 1),
                (x + 1 < width).then(|| at + 1),
                (y > 0).then(|| at - width as u32),
                (y + 1 < height).then(|| at + width as u32),
            ];
            for neighbour in neighbours.into_iter().flatten() {
                if let Some((top, samples)) = forest.join(at, neighbour) {
                    found.push((top, level, samples));
                }
            }
        }
        found.extend(forest.survivors().map(|(top, samples)| (top, floor, samples)));
        let mut summits: Vec<Summit> = found
            .into_iter()
            .filter(|(_, _, samples)| *samples >= least_samples)
            .map(|(top, saddle, samples)| Summit {
                top: to_255(f64::from(top)),
                saddle: to_255(f64::from(saddle)),
                samples,
            })
            .collect();
        summits.sort_by(|a, b| b.persistence().total_cmp(&a.persistence()));
        summits
    }
}

/// The summits that stand out like the clearest one. What is left are ripples on top of a mark, and noise: where a
/// mark is missing, a threshold between those would cut the others apart.
fn clear_ones(summits: &[Summit]) -> &[Summit] {
    let least = CLEAR_SHARE * summits.first().map_or(0.0, Summit::persistence);
    &summits[..summits.partition_point(|s| s.persistence() >= least)]
}

/// The threshold, on the scale to 255, for `marks` marks of this hue seen in several pictures; `None` where no
/// picture shows one.
pub fn choose(pictures: &[Vec<Summit>], marks: usize) -> Option<f64> {
    let clear: Vec<&[Summit]> = pictures.iter().map(|summits| clear_ones(summits)).collect();
    let full: Vec<f64> = clear.iter().filter_map(|s| s.get(marks.max(1) - 1)).map(Summit::threshold).collect();
    let any: Vec<f64> = clear.iter().filter_map(|s| s.last()).map(Summit::threshold).collect();
    let mut thresholds = if full.is_empty() { any } else { full };
    thresholds.sort_by(f64::total_cmp);
    // the lower quartile: a mark seen once through blur or shade should still be found
    thresholds.get(thresholds.len().checked_sub(1)? / 4).map(|t| t.max(LEAST_COMPONENT))
}

/// Union–find over samples, each tree knowing its summit.
struct Forest {
    parent: Vec<u32>,
    trees: std::collections::HashMap<u32, (i16, usize)>,
}

const ABSENT: u32 = u32::MAX;

impl Forest {
    fn new(samples: usize) -> Self {
        Self { parent: vec![ABSENT; samples], trees: std::collections::HashMap::new() }
    }

    fn add(&mut self, at: u32, level: i16) {
        self.parent[at as usize] = at;
        self.trees.insert(at, (level, 1));
    }

    fn root(&mut self, mut at: u32) -> u32 {
        while self.parent[at as usize] != at {
            let up = self.parent[at as usize];
            self.parent[at as usize] = self.parent[up as usize];
            at = up;
        }
        at
    }

    /// Joins two trees; returns summit and size of the lower one, which ends here.
    fn join(&mut self, a: u32, b: u32) -> Option<(i16, usize)> {
        if self.parent[b as usize] == ABSENT {
            return None;
        }
        let (ra, rb) = (self.root(a), self.root(b));
        if ra == rb {
            return None;
        }
        let (ta, tb) = (*self.trees.get(&ra)?, *self.trees.get(&rb)?);
        let (high, low) = if ta.0 >= tb.0 { (ra, rb) } else { (rb, ra) };
        let ended = self.trees.remove(&low)?;
        self.parent[low as usize] = high;
        if let Some(tree) = self.trees.get_mut(&high) {
            tree.1 += ended.1;
        }
        Some(ended)
    }

    fn survivors(&self) -> impl Iterator<Item = (i16, usize)> + '_ {
        self.trees.values().copied()
    }
}
