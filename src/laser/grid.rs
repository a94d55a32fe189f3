//! A record on an even grid: the mean of the samples of each cell, and how many they are.

use super::record::LaserRecord;

/// Cells a second: the third mode of a limp strip of 0.2 m, 4.8 Hz, has more than three cells a period.
const RATE_HZ: f64 = 16.0;
/// Most cells; a longer record gets wider ones.
const MOST: f64 = 24_000.0;

/// Beside a gap the samples of a cell may lie so far from its middle, of its width.
const OFF_MIDDLE: f64 = 0.1;

/// Displacements on an even grid.
#[derive(Debug, Clone)]
pub struct Grid {
    /// Middle of the first cell.
    pub start_s: f64,
    /// Width of a cell.
    pub step_s: f64,
    /// Mean displacement of each cell (m) about `origin_m`, 0 where it holds none.
    pub y_m: Vec<f64>,
    /// Samples of each cell.
    pub count: Vec<f64>,
    /// What is subtracted from the displacements.
    pub origin_m: f64,
}

impl Grid {
    /// The means of a record's samples, each led along the local slope to the middle of its cell.
    pub fn of(record: &LaserRecord) -> Self {
        let (first, last) = (record.t_s[0], record.t_s[record.t_s.len() - 1]);
        let sample_s = crate::statistics::median_step_s(&record.t_s).unwrap_or(1.0);
        let samples = (1.0 / (RATE_HZ * sample_s)).round().max(1.0).max(((last - first) / sample_s / MOST).ceil());
        let step_s = samples * sample_s;
        // whole cells alone
        let cells = (((last - first) / sample_s + 1.5) / samples).floor() as usize;
        let start_s = first + 0.5 * (samples - 1.0) * sample_s;
        let mut sums = vec![[0.0; 3]; cells];
        let origin_m = crate::statistics::median(&mut record.y_m.clone()).unwrap_or(0.0);
        for (t, y) in record.t_s.iter().zip(&record.y_m) {
            let cell = ((t - start_s) / step_s).round().max(0.0) as usize;
            if let Some(sum) = sums.get_mut(cell) {
                *sum = [sum[0] + 1.0, sum[1] + t - (start_s + cell as f64 * step_s), sum[2] + y - origin_m];
            }
        }
        let mean = |cell: usize| (sums[cell][0] > 0.0).then(|| sums[cell][2] / sums[cell][0]);
        let slope = |cell: usize| {
            let before = mean(cell.checked_sub(1)?)?;
            let after = (cell + 1 < cells).then(|| mean(cell + 1))??;
            Some((after - before) / (2.0 * step_s))
        };
        // beside a gap there is no slope, so samples to one side of a cell's middle do not stand for it
        let held = |cell: usize| {
            let off_s = sums[cell][1] / sums[cell][0].max(1.0);
            match slope(cell) {
                Some(slope) => mean(cell).map(|mean| mean - slope * off_s),
                None => mean(cell).filter(|_| off_s.abs() < OFF_MIDDLE * step_s),
            }
        };
        let y_m: Vec<Option<f64>> = (0..cells).map(held).collect();
        let count = sums.iter().zip(&y_m).map(|(sum, y)| y.map_or(0.0, |_| sum[0])).collect();
        Self { start_s, step_s, y_m: y_m.into_iter().map(Option::unwrap_or_default).collect(), count, origin_m }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.y_m.len()
    }

    /// Whether there is no cell; never so of a record that was read.
    pub fn is_empty(&self) -> bool {
        self.y_m.is_empty()
    }

    /// Middle of a cell.
    pub fn time_s(&self, cell: usize) -> f64 {
        self.start_s + cell as f64 * self.step_s
    }

    /// Where the grid ends.
    pub fn end_s(&self) -> f64 {
        self.time_s(self.len())
    }

    /// From the first cell to the last.
    pub fn duration_s(&self) -> f64 {
        self.len() as f64 * self.step_s
    }

    /// The cell of a time, within the grid.
    pub fn cell(&self, t_s: f64) -> usize {
        (((t_s - self.start_s) / self.step_s).round().max(0.0) as usize).min(self.len() - 1)
    }

    /// Greatest less least displacement.
    pub fn spread_m(&self) -> f64 {
        let held = || self.y_m.iter().zip(&self.count).filter(|(_, count)| **count > 0.0).map(|(y, _)| *y);
        held().fold(f64::NEG_INFINITY, f64::max) - held().fold(f64::INFINITY, f64::min)
    }

    /// Number of cells that hold samples.
    pub fn held(&self) -> usize {
        self.count.iter().filter(|count| **count > 0.0).count()
    }
}
