//! What is usual about the marks as a whole: how far they are from each other, and where each one is.
//!
//! A link is rigid and a strip hardly shortens, so neighbours on the chain keep their distance; a mark at the hinge
//! keeps its place, and the upper marks stay above the lower ones unless the specimen turns over. None of this is
//! assumed: what varies has a large standard deviation and says little.

/// Values below which nothing is usual yet.
const LEAST_VALUES: u32 = 5;
/// Most that one distance or place counts, in squared standard deviations: a single surprise does not decide.
const MOST_MISFIT: f64 = 16.0;
/// Squared standard deviations up to which a distance or place is as usual.
const FITS: f64 = 9.0;
/// Least standard deviation as a share of the length: a lens, and a plane of swing that is not quite the picture's.
const LEAST_SPREAD: f64 = 0.03;
/// Least standard deviation, px.
const LEAST_SPREAD_PX: f64 = 1.0;

/// Mean and variance of a quantity, value by value (Welford, Technometrics 4 (1962) 419).
#[derive(Debug, Clone, Copy, Default)]
struct RunningStatistics {
    count: u32,
    mean: f64,
    squares: f64,
}

impl RunningStatistics {
    fn add(&mut self, value: f64) {
        self.count += 1;
        let before = value - self.mean;
        self.mean += before / f64::from(self.count);
        self.squares += before * (value - self.mean);
    }

    /// Squared standard deviations between a value and the mean; `None` where too little is known.
    fn misfit(&self, value: f64, least_sd: f64) -> Option<f64> {
        let variance = self.squares / f64::from(self.count.max(1));
        (self.count >= LEAST_VALUES).then(|| (value - self.mean).powi(2) / (variance + least_sd * least_sd))
    }
}

/// Distances and places of the marks, as learned so far.
#[derive(Debug, Clone)]
pub struct Chain {
    pivot_px: Option<[f64; 2]>,
    /// For each mark, its distances from the marks before it, and last from the pivot.
    distances_px: Vec<Vec<RunningStatistics>>,
    /// For each mark, x and y.
    places_px: Vec<[RunningStatistics; 2]>,
}

impl Chain {
    /// Of `marks` marks of which nothing is known yet.
    pub fn new(marks: usize, pivot_px: Option<[f64; 2]>) -> Self {
        let distances_px = (0..marks).map(|mark| vec![RunningStatistics::default(); mark + 1]).collect();
        Self { pivot_px, distances_px, places_px: vec![[RunningStatistics::default(); 2]; marks] }
    }

    /// Learns from a frame in which every mark seen is known to be that mark.
    pub fn learn(&mut self, seen_px: &[Option<[f64; 2]>]) {
        for (mark, at) in seen_px.iter().enumerate() {
            let Some(at) = at else { continue };
            for (usual, from) in self.distances_px[mark].iter_mut().zip(anchors(seen_px, mark, self.pivot_px)) {
                if let Some(from) = from {
                    usual.add(distance(at, &from));
                }
            }
            (0..2).for_each(|axis| self.places_px[mark][axis].add(at[axis]));
        }
    }

    /// How unusual the marks are at these positions: the sum over all distances and places.
    pub fn misfit(&self, seen_px: &[Option<[f64; 2]>]) -> f64 {
        let unknown = 0.5 * MOST_MISFIT;
        (0..seen_px.len())
            .flat_map(|mark| self.terms(seen_px, mark))
            .map(|t| t.unwrap_or(unknown).min(MOST_MISFIT))
            .sum()
    }

    /// Something about the mark is as usual.
    pub fn fits(&self, seen_px: &[Option<[f64; 2]>], mark: usize) -> bool {
        let later = (mark + 1..seen_px.len()).filter_map(|m| {
            let (at, from) = (seen_px[m]?, seen_px[mark]?);
            self.distance_misfit(m, mark, distance(&at, &from))
        });
        self.terms(seen_px, mark).flatten().chain(later).any(|term| term <= FITS)
    }

    /// The misfits of a mark's distances from the earlier marks and the pivot, and of its place.
    fn terms(&self, seen_px: &[Option<[f64; 2]>], mark: usize) -> impl Iterator<Item = Option<f64>> {
        let at = seen_px[mark];
        let distances = anchors(seen_px, mark, self.pivot_px).enumerate().filter_map(move |(k, from)| {
            let length_px = distance(&at?, &from?);
            Some(self.distance_misfit(mark, k, length_px))
        });
        let place = at.map(|at| {
            let [x, y] = [0, 1].map(|axis| self.places_px[mark][axis].misfit(at[axis], self.least_place_sd_px()));
            Some(x? + y?)
        });
        distances.chain(place)
    }

    fn distance_misfit(&self, mark: usize, from: usize, length_px: f64) -> Option<f64> {
        let usual = &self.distances_px[mark][from];
        usual.misfit(length_px, LEAST_SPREAD_PX + LEAST_SPREAD * usual.mean)
    }

    fn least_place_sd_px(&self) -> f64 {
        let longest_px = self.distances_px.iter().flatten().map(|d| d.mean).fold(0.0, f64::max);
        LEAST_SPREAD_PX + LEAST_SPREAD * longest_px
    }
}

/// What a mark's distances are measured from: the earlier marks, then the pivot.
fn anchors(
    seen_px: &[Option<[f64; 2]>],
    mark: usize,
    pivot_px: Option<[f64; 2]>,
) -> impl Iterator<Item = Option<[f64; 2]>> {
    seen_px[..mark].iter().copied().chain([pivot_px])
}

fn distance(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three marks on two links of 100 px, the first fixed.
    fn at(theta1_rad: f64, theta2_rad: f64) -> [Option<[f64; 2]>; 3] {
        let second = [100.0 * theta1_rad.sin(), 100.0 * theta1_rad.cos()];
        let third = [second[0] + 100.0 * theta2_rad.sin(), second[1] + 100.0 * theta2_rad.cos()];
        [Some([0.0, 0.0]), Some(second), Some(third)]
    }

    fn swung() -> Chain {
        let mut chain = Chain::new(3, None);
        for i in 0..200 {
            let phase = f64::from(i) * 0.1;
            chain.learn(&at(0.5 * phase.sin(), 0.6 * (2.6 * phase).cos()));
        }
        chain
    }

    #[test]
    fn exchanged_marks_misfit_wherever_they_are() {
        let chain = swung();
        for i in 0..50 {
            let phase = 0.37 * f64::from(i);
            let [a, b, c] = at(0.7 * phase.cos(), 0.8 * (3.1 * phase).sin());
            let right = chain.misfit(&[a, b, c]);
            for wrong in [[a, c, b], [b, a, c], [c, b, a], [b, c, a], [c, a, b]] {
                assert!(chain.misfit(&wrong) > right + 12.0, "{phase}: {} {right}", chain.misfit(&wrong));
            }
        }
    }

    #[test]
    fn what_was_never_seen_is_neither_usual_nor_unusual() {
        let chain = Chain::new(2, Some([0.0, 0.0]));
        let (near, far) = ([1.0, 1.0], [90.0, 400.0]);
        assert_eq!(chain.misfit(&[Some(near), Some(far)]), chain.misfit(&[Some(far), Some(near)]));
        assert!(!chain.fits(&[Some(near), Some(far)], 0));
    }

    #[test]
    fn nothing_seen_is_no_misfit() {
        assert_eq!(swung().misfit(&[None, None, None]), 0.0);
    }
}
