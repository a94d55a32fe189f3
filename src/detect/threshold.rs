//! The threshold between mark and background, chosen from pictures of the recording.
//!
//! Each summit of the colour component is followed down to the level where it joins a higher one (its saddle): the
//! difference is its persistence. The marks are the most persistent summits, and the threshold lies between the
//! saddle and the summit of the weakest of them, so an amber film or a bright background shifts it where it must be.

use super::component::{from_255, to_255};
use super::morphology::{dilate, erode};
use super::plane::Plane;
use super::region::Region;

/// Below this, on the scale to 255, nothing is taken for a mark: the chroma noise of cameras and codecs.
pub const LEAST_COMPONENT: f64 = 16.0;
/// The same for a mark without a hue: a twelfth of the range of luma, for every wall has shadows.
pub const LEAST_CONTRAST: f64 = 40.0;
/// Share of a summit's samples that move where the summit does.
const MOVING_SHARE: f64 = 0.04;
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
    /// Samples above the saddle.
    pub samples: usize,
    /// Those of them that move.
    pub moved: usize,
}

impl Summit {
    fn persistence(&self) -> f64 {
        self.top - self.saddle
    }

    /// Something in it moves.
    pub fn moves(&self) -> bool {
        moves(self.moved, self.samples)
    }

    fn threshold(&self) -> f64 {
        self.saddle + POSITION * self.persistence()
    }
}

/// So many of some samples move that what they make up does.
fn moves(moved: usize, samples: usize) -> bool {
    moved >= 2 && moved as f64 >= MOVING_SHARE * samples as f64
}

/// The component as a landscape over the samples, as far as it rises above a floor.
pub struct Relief<'a> {
    region: Region,
    heights: Vec<i16>,
    floor: i16,
    /// Where something moves in the picture, as far as that is known.
    moved: Option<&'a [bool]>,
    picture_width: usize,
}

/// Samples around what rises above the floor that [`Relief::open`] asks for.
const REACH: usize = 2;

impl<'a> Relief<'a> {
    /// Of a picture's component above `floor` (0 to 255).
    pub fn new(plane: &Plane, moved: Option<&'a [bool]>, floor: f64) -> Self {
        let floor = from_255(floor);
        let region = plane.extent(floor, REACH);
        Self { region, heights: plane.within(region), floor, moved, picture_width: plane.width }
    }

    /// Grey opening over 3×3 samples: ridges of up to two samples, such as burnt-in lines, are worn away.
    pub fn open(&mut self) {
        let width = self.region.right - self.region.left;
        erode(&mut self.heights, width, 1);
        dilate(&mut self.heights, width, 1);
    }

    /// The summits above the floor with at least `least_samples` samples, most persistent first.
    pub fn summits(&self, least_samples: usize) -> Vec<Summit> {
        let (region, floor) = (self.region, self.floor);
        let (width, height) = (region.right - region.left, region.bottom - region.top);
        let mut order: Vec<(i16, u32)> =
            self.heights.iter().enumerate().filter(|(_, h)| **h > floor).map(|(i, h)| (*h, i as u32)).collect();
        order.sort_unstable_by(|a, b| b.cmp(a));
        let mut forest = Forest::new(width * height, order.len());
        let mut found = Vec::new();
        for &(level, at) in &order {
            let (x, y) = (at as usize % width, at as usize / width);
            let in_picture = (y + region.top) * self.picture_width + x + region.left;
            let tree = forest.add(at, level, self.moved.is_some_and(|m| m[in_picture]));
            let neighbours = [
                (x > 0).then(|| at - 1),
                (x + 1 < width).then(|| at + 1),
                (y > 0).then(|| at - width as u32),
                (y + 1 < height).then(|| at + width as u32),
            ];
            for neighbour in neighbours.into_iter().flatten() {
                found.extend(forest.join(tree, neighbour).into_iter().flatten().map(|ended| (ended, level)));
            }
        }
        found.extend(forest.survivors().map(|tree| (tree, floor)));
        let mut summits: Vec<Summit> = found
            .into_iter()
            .filter(|(tree, _)| tree.samples >= least_samples)
            .map(|(tree, saddle)| Summit {
                top: to_255(f64::from(tree.top)),
                saddle: to_255(f64::from(saddle)),
                samples: tree.samples,
                moved: tree.moved,
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
pub fn choose(pictures: &[Vec<Summit>], marks: usize, floor: f64) -> Option<f64> {
    let clear: Vec<&[Summit]> = pictures.iter().map(|summits| clear_ones(summits)).collect();
    let full: Vec<f64> = clear.iter().filter_map(|s| s.get(marks.max(1) - 1)).map(Summit::threshold).collect();
    let any: Vec<f64> = clear.iter().filter_map(|s| s.last()).map(Summit::threshold).collect();
    let mut thresholds = if full.is_empty() { any } else { full };
    thresholds.sort_by(f64::total_cmp);
    // the lower quartile: a mark seen once through blur or shade should still be found
    thresholds.get(thresholds.len().checked_sub(1)? / 4).map(|t| t.max(floor))
}

/// Union–find over the samples above the floor in the order of their heights, each tree knowing its summit.
struct Forest {
    /// Place of a sample in that order.
    place: Vec<u32>,
    parent: Vec<u32>,
    trees: Vec<Tree>,
}

/// One summit while its region grows.
#[derive(Clone, Copy)]
struct Tree {
    top: i16,
    samples: usize,
    moved: usize,
}

impl Tree {
    fn moves(&self) -> bool {
        moves(self.moved, self.samples)
    }
}

const ABSENT: u32 = u32::MAX;

impl Forest {
    fn new(samples: usize, above_floor: usize) -> Self {
        Self {
            place: vec![ABSENT; samples],
            parent: Vec::with_capacity(above_floor),
            trees: Vec::with_capacity(above_floor),
        }
    }

    fn add(&mut self, at: u32, top: i16, moved: bool) -> u32 {
        let place = self.parent.len() as u32;
        self.place[at as usize] = place;
        self.parent.push(place);
        self.trees.push(Tree { top, samples: 1, moved: usize::from(moved) });
        place
    }

    fn root(&mut self, mut place: u32) -> u32 {
        while self.parent[place as usize] != place {
            let up = self.parent[place as usize];
            self.parent[place as usize] = self.parent[up as usize];
            place = up;
        }
        place
    }

    /// Joins a tree with that of a neighbouring sample; returns what ends here: the lower one, and the higher one as well
    /// where it moves and the lower one is the larger and stands still. That is a mark on a wall of its own hue.
    fn join(&mut self, tree: u32, neighbour: u32) -> [Option<Tree>; 2] {
        let other = self.place[neighbour as usize];
        if other == ABSENT {
            return [None, None];
        }
        let (ra, rb) = (self.root(tree), self.root(other));
        if ra == rb {
            return [None, None];
        }
        let (ta, tb) = (self.trees[ra as usize], self.trees[rb as usize]);
        let (high, low, ended) = if ta.top >= tb.top { (ra, rb, tb) } else { (rb, ra, ta) };
        self.parent[low as usize] = high;
        let mark = self.trees[high as usize];
        let on_wall = mark.moves() && !ended.moves() && ended.samples > mark.samples;
        let grown = &mut self.trees[high as usize];
        grown.samples += ended.samples;
        // what goes on from here is the wall, which stands still
        grown.moved = if on_wall { 0 } else { mark.moved + ended.moved };
        [Some(ended), on_wall.then_some(mark)]
    }

    fn survivors(&self) -> impl Iterator<Item = Tree> + '_ {
        let roots = self.parent.iter().enumerate().filter(|(place, parent)| *place == **parent as usize);
        roots.map(|(place, _)| self.trees[place])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_on_a_wall_of_its_own_hue_ends_where_the_wall_begins() {
        let (width, height) = (160, 120);
        let inside = |at: usize| (at % width).abs_diff(20) < 6 && (at / width).abs_diff(20) < 6;
        let code = |at: usize| {
            if inside(at) { 150.0 + 4.0 * (at % 5) as f64 } else { 70.0 + 3.0 * (0.2 * (at % width) as f64).sin() }
        };
        let values: Vec<i16> = (0..width * height).map(|at| from_255(code(at))).collect();
        let plane = Plane { width, height, level: 0, values };
        let moved: Vec<bool> = (0..width * height).map(inside).collect();
        let mut summits = Relief::new(&plane, Some(&moved), LEAST_COMPONENT).summits(3);
        summits.retain(Summit::moves);
        let threshold = choose(&[summits], 1, LEAST_COMPONENT).unwrap();
        assert!(threshold > 80.0 && threshold < 140.0, "{threshold}");
    }
}
