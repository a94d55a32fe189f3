//! The binary picture of a region, or of the whole picture at a coarse scale (Fig. 8 c), and its connected parts.

use std::ops::Range;

use super::centroid::Silhouette;
use super::component::HueAxis;
use super::morphology::{dilate, erode};
use super::plane::Plane;
use super::region::{MARGIN, Region};
use crate::video::Picture;

/// What is above the threshold.
pub struct Mask {
    region: Region,
    bytes: Vec<u8>,
    /// Parts that almost touch are one.
    bridged: bool,
}

impl Mask {
    /// Of one region at the scale of the chroma samples.
    pub fn of(picture: &Picture<'_>, axis: HueAxis, threshold: i16, thin: bool, region: Region) -> Self {
        let mut component = Vec::with_capacity((region.right - region.left) * (region.bottom - region.top));
        for y in region.top..region.bottom {
            axis.row(picture, y, region.left..region.right, &mut component);
        }
        Self::of_component(&component, threshold, thin, region)
    }

    /// Of a whole picture at its scale.
    pub fn of_plane(plane: &Plane, threshold: i16, thin: bool) -> Self {
        let region = plane.extent(threshold, MARGIN);
        Self::of_component(&plane.within(region), threshold, thin, region)
    }

    /// Takes parts up to two samples apart for one: the quadrants of a target touch at a point, in which neither is dark.
    pub fn bridged(self, bridged: bool) -> Self {
        Self { bridged, ..self }
    }

    /// Smooths the component over a plus of five samples against camera noise, compares, and mends the outline:
    /// opening takes away lines of up to two samples (burnt-in graphics), closing heals a mark that one crosses.
    fn of_component(component: &[i16], threshold: i16, thin: bool, region: Region) -> Self {
        let (width, height) = (region.right - region.left, region.bottom - region.top);
        let mut bytes = vec![0u8; width * height];
        // the outermost samples stay outside: the region has a margin
        for y in 1..height.saturating_sub(1) {
            let row = |y: usize| &component[y * width..(y + 1) * width];
            let (above, here, below) = (row(y - 1), row(y), row(y + 1));
            let out = &mut bytes[y * width..(y + 1) * width];
            for x in 1..width.saturating_sub(1) {
                let sides = i32::from(here[x - 1]) + i32::from(here[x + 1]) + i32::from(above[x]) + i32::from(below[x]);
                out[x] = if 4 * i32::from(here[x]) + sides > 8 * i32::from(threshold) { 255 } else { 0 };
            }
        }
        if !thin {
            erode(&mut bytes, width, 1);
            dilate(&mut bytes, width, 3);
            erode(&mut bytes, width, 2);
        }
        Self { region, bytes, bridged: false }
    }

    /// The mask, row by row, 255 inside.
    pub fn rows(&self) -> impl Iterator<Item = (usize, &[u8])> {
        let width = self.region.right - self.region.left;
        self.bytes.chunks(width.max(1)).enumerate().map(|(i, row)| (self.region.top + i, row))
    }

    /// First column of [`Mask::rows`].
    pub fn left(&self) -> usize {
        self.region.left
    }

    /// The connected regions (8 neighbours), from the top down, each with its samples row by row.
    pub fn parts(&self) -> Vec<Part> {
        let width = self.region.right - self.region.left;
        let grown = self.bridged.then(|| {
            let mut grown = self.bytes.clone();
            dilate(&mut grown, width, 1);
            grown
        });
        let runs = Runs::of(grown.as_ref().unwrap_or(&self.bytes), width);
        let (labels, count) = runs.labels();
        let mut parts = vec![Part { points: Vec::new() }; count];
        for (run, label) in runs.runs.iter().zip(labels) {
            let row = &self.bytes[run.row * width..][..width];
            let inside = run.columns.clone().filter(|x| row[*x] > 0);
            parts[label].points.extend(inside.map(|x| [x + self.region.left, run.row + self.region.top]));
        }
        parts
    }
}

/// Samples side by side in a row of a mask.
struct Run {
    row: usize,
    columns: Range<usize>,
    /// A run of the same region, in the end the region's first.
    parent: usize,
}

/// The runs of a mask from the top down, joined where they touch (Rosenfeld and Pfaltz, J. ACM 13 (1966) 471).
struct Runs {
    runs: Vec<Run>,
}

impl Runs {
    fn of(bytes: &[u8], width: usize) -> Self {
        let mut runs = Self { runs: Vec::new() };
        // of the row above: the first run that may touch the next
        let mut above = 0;
        for (row, bytes) in bytes.chunks_exact(width.max(1)).enumerate() {
            let first = runs.runs.len();
            let mut from = 0;
            while let Some(start) = bytes[from..].iter().position(|b| *b > 0).map(|at| from + at) {
                let end = bytes[start..].iter().position(|b| *b == 0).map_or(width, |at| start + at);
                let own = runs.runs.len();
                runs.runs.push(Run { row, columns: start..end, parent: own });
                while above < first && runs.runs[above].columns.end < start {
                    above += 1;
                }
                for other in above..first {
                    if runs.runs[other].columns.start > end {
                        break;
                    }
                    runs.join(other, own);
                }
                from = end;
            }
            above = first;
        }
        runs
    }

    fn root(&mut self, mut run: usize) -> usize {
        while self.runs[run].parent != run {
            let up = self.runs[run].parent;
            self.runs[run].parent = self.runs[up].parent;
            run = up;
        }
        run
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.runs[a.max(b)].parent = a.min(b);
    }

    /// The region of every run, numbered by their first runs, and how many regions there are.
    fn labels(&self) -> (Vec<usize>, usize) {
        let mut labels: Vec<usize> = Vec::with_capacity(self.runs.len());
        let mut count = 0;
        for (index, run) in self.runs.iter().enumerate() {
            // a parent comes before its runs
            let label = if run.parent == index { count } else { labels[run.parent] };
            count += usize::from(run.parent == index);
            labels.push(label);
        }
        (labels, count)
    }
}

/// Two opposite quadrants have a roundness of 0.5 and a fill of 0.65; a stretched disc is as little round only from 3.7 : 1
/// on, and its fill is 1. The bounds lie half way.
const LEAST_TARGET_ROUNDNESS: f64 = 0.4;
const MOST_TARGET_ROUNDNESS: f64 = 0.75;
const MOST_TARGET_FILL: f64 = 0.82;
/// Of an outline that is a sample off here and there, nearly all samples have their mirror image.
const LEAST_MIRRORED: f64 = 0.8;

/// One connected region: the columns and rows of its samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    pub points: Vec<[usize; 2]>,
}

impl Part {
    /// Mean column and row.
    pub fn centre(&self) -> [f64; 2] {
        let n = self.points.len().max(1) as f64;
        [0, 1].map(|axis| self.points.iter().map(|p| p[axis] as f64).sum::<f64>() / n)
    }

    /// Area over that of a disc with the same second moments: 1 for a disc, 0.95 for a square, 0.8 for an ellipse
    /// of 2 : 1, 0.5 for two opposite quadrants.
    ///
    /// ```text
    /// roundness = A / (2π (μ_xx + μ_yy)),   μ about the centre, the samples' own extent included
    /// ```
    pub fn roundness(&self) -> f64 {
        let [cx, cy] = self.centre();
        let n = self.points.len() as f64;
        let squares: f64 = self.points.iter().map(|p| (p[0] as f64 - cx).powi(2) + (p[1] as f64 - cy).powi(2)).sum();
        n / (std::f64::consts::TAU * (squares / n + 1.0 / 6.0))
    }

    /// How much it looks like a mark, 1 for a disc: [`Part::roundness`], of a target that of the disc which it half fills.
    pub fn shape(&self) -> f64 {
        let roundness = self.roundness();
        if self.is_target() { (2.0 * roundness).min(1.0) } else { roundness }
    }

    /// Two opposite quadrants of a disc: hollow, and the same when turned by half a turn.
    pub fn is_target(&self) -> bool {
        (LEAST_TARGET_ROUNDNESS..MOST_TARGET_ROUNDNESS).contains(&self.roundness())
            && self.fill() < MOST_TARGET_FILL
            && self.mirrored_share() > LEAST_MIRRORED
    }

    /// Area over that of the ellipse with the same second moments: 1 for an ellipse, 0.95 for a rectangle, however long,
    /// 0.65 for two opposite quadrants.
    ///
    /// ```text
    /// fill = A / (4π √det μ)
    /// ```
    fn fill(&self) -> f64 {
        let [cx, cy] = self.centre();
        let n = self.points.len() as f64;
        let moment = |f: &dyn Fn(f64, f64) -> f64| {
            self.points.iter().map(|p| f(p[0] as f64 - cx, p[1] as f64 - cy)).sum::<f64>() / n
        };
        let (xx, yy, xy) =
            (moment(&|x, _| x * x) + 1.0 / 12.0, moment(&|_, y| y * y) + 1.0 / 12.0, moment(&|x, y| x * y));
        n / (2.0 * std::f64::consts::TAU * (xx * yy - xy * xy).max(0.0).sqrt())
    }

    /// Share of its samples whose mirror images through its centre belong to it.
    fn mirrored_share(&self) -> f64 {
        let [cx, cy] = self.centre();
        let own: std::collections::HashSet<[i64; 2]> = self.points.iter().map(|p| p.map(|v| v as i64)).collect();
        let mirrored =
            |p: &&[i64; 2]| own.contains(&[(2.0 * cx).round() as i64 - p[0], (2.0 * cy).round() as i64 - p[1]]);
        own.iter().filter(mirrored).count() as f64 / own.len().max(1) as f64
    }

    /// Its samples in the picture.
    pub fn silhouette(&self, picture: &Picture<'_>) -> Silhouette {
        let layout = picture.layout;
        let points_px: Vec<[f64; 2]> =
            self.points.iter().map(|p| layout.chroma_to_luma(p[0] as f64, p[1] as f64).into()).collect();
        silhouette(picture, points_px)
    }

    /// The same from a coarse plane, interpolated to the chroma samples, so that its outline is no coarse staircase.
    pub fn finer_silhouette(&self, picture: &Picture<'_>, plane: &Plane, threshold: i16) -> Silhouette {
        if plane.level == 0 {
            return self.silhouette(picture);
        }
        let layout = picture.layout;
        let (side, threshold) = (1usize << plane.level, f32::from(threshold));
        let bound = |axis: usize, last: usize| {
            let values = || self.points.iter().map(|p| p[axis]);
            values().min().unwrap_or(0).saturating_sub(1)..(values().max().unwrap_or(0) + 2).min(last)
        };
        let (columns, rows) = (bound(0, plane.width), bound(1, plane.height));
        let width = columns.len();
        let mut near = vec![false; width * rows.len()];
        for [x, y] in &self.points {
            for j in (y.saturating_sub(1)..=y + 1).filter(|j| rows.contains(j)) {
                for i in (x.saturating_sub(1)..=x + 1).filter(|i| columns.contains(i)) {
                    near[(j - rows.start) * width + i - columns.start] = true;
                }
            }
        }
        let mut points_px = Vec::new();
        for y in rows.start * side..rows.end * side {
            for x in columns.start * side..columns.end * side {
                let inside = near[(y / side - rows.start) * width + x / side - columns.start];
                if inside && interpolated(plane, x, y) > threshold {
                    points_px.push(layout.chroma_to_luma(x as f64, y as f64).into());
                }
            }
        }
        silhouette(picture, points_px)
    }
}

/// The coarse plane at a chroma sample.
fn interpolated(plane: &Plane, x: usize, y: usize) -> f32 {
    let side = (1usize << plane.level) as f32;
    let split = |at: usize, size: usize| {
        let at = ((at as f32 + 0.5) / side - 0.5).clamp(0.0, size as f32 - 1.0);
        let low = at as usize;
        (low, (low + 1).min(size - 1), at - low as f32)
    };
    let ((left, right, s), (top, bottom, t)) = (split(x, plane.width), split(y, plane.height));
    let value = |x: usize, y: usize| f32::from(plane.values[y * plane.width + x]);
    let row = |y: usize| value(left, y) + s * (value(right, y) - value(left, y));
    row(top) + t * (row(bottom) - row(top))
}

fn silhouette(picture: &Picture<'_>, points_px: Vec<[f64; 2]>) -> Silhouette {
    let layout = picture.layout;
    let half_sample_px = [layout.chroma_shift_x, layout.chroma_shift_y].map(|shift| 0.5 * f64::from(1u32 << shift));
    Silhouette::of(points_px, half_sample_px)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(inside: impl Fn(f64, f64) -> bool) -> Part {
        let at = |v: usize| v as f64 - 30.0;
        let points = (0..61).flat_map(|y| (0..61).map(move |x| [x, y])).filter(|p| inside(at(p[0]), at(p[1])));
        Part { points: points.collect() }
    }

    #[test]
    fn a_disc_is_round_and_a_line_is_not() {
        assert!((part(|x, y| x.hypot(y) < 20.5).roundness() - 1.0).abs() < 0.02);
        assert!((part(|x, y| (x / 2.0).hypot(y) < 12.0).roundness() - 0.8).abs() < 0.03);
        let quadrants = part(|x, y| x.hypot(y) < 20.5 && x * y >= 0.0).roundness();
        // the two lines of samples on the axes belong to it as well
        assert!((quadrants - 0.5).abs() < 0.05, "{quadrants}");
        assert!(part(|x, y| x.hypot(y) < 20.5 && x * y >= 0.0).shape() > 0.9);
        assert!(part(|x, y| x.hypot(y) < 20.5 && (x + y) * (x - y) >= 0.0).is_target());
        let disc_stretched_disc_two_discs: [fn(f64, f64) -> bool; 3] = [
            |x, y| x.hypot(y) < 20.5,
            |x, y| (x / 3.0).hypot(y) < 9.0,
            |x, y| (x - 10.0).hypot(y) < 10.5 || (x + 10.0).hypot(y) < 10.5,
        ];
        assert!(!disc_stretched_disc_two_discs.iter().any(|inside| part(inside).is_target()));
        assert!(part(|x, y| x.abs() < 28.0 && y.abs() < 3.0).roundness() < 0.3);
    }

    fn parts_of(rows: &[&str]) -> Vec<Vec<[usize; 2]>> {
        let bytes: Vec<u8> = rows.iter().flat_map(|row| row.bytes().map(|b| if b == b'#' { 255 } else { 0 })).collect();
        let region = Region { left: 10, top: 20, right: 10 + rows[0].len(), bottom: 20 + rows.len() };
        Mask { region, bytes, bridged: false }.parts().into_iter().map(|part| part.points).collect()
    }

    #[test]
    fn arms_that_meet_below_are_one_part_and_corners_touch() {
        let parts = parts_of(&["#..#..#", "#..#...", "####.#.", "......#"]);
        assert_eq!(parts.len(), 3, "{parts:?}");
        assert_eq!(parts[0].len(), 8);
        assert_eq!(parts[0][..3], [[10, 20], [13, 20], [10, 21]]);
        assert_eq!((&parts[1], &parts[2]), (&vec![[16, 20]], &vec![[15, 22], [16, 23]]));
    }

    #[test]
    fn an_empty_mask_and_an_empty_region_have_no_part() {
        assert!(parts_of(&["....", "...."]).is_empty());
        assert!(parts_of(&[""]).is_empty());
    }
}
