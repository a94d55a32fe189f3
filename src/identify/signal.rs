//! The measured samples of each link, without the missing ones.

use crate::series::AngleSeries;
use crate::statistics::median_step_s;

/// Longest distance between neighbours, in median steps, that is interpolated across.
pub const BRIDGE_STEPS: f64 = 3.05;
/// Means over runs of samples keep at least so many a cycle: five of its third harmonic.
const VALUES_A_CYCLE: f64 = 16.0;

/// What was measured of one link.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkSamples {
    /// Time stamps.
    pub t_s: Vec<f64>,
    /// Angle at each.
    pub theta_rad: Vec<f64>,
}

impl LinkSamples {
    /// Mean angle.
    pub fn mean_rad(&self) -> f64 {
        self.theta_rad.iter().sum::<f64>() / self.theta_rad.len().max(1) as f64
    }

    /// From the lowest to the highest angle.
    pub fn range_rad(&self) -> f64 {
        let ends = self.theta_rad.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], a| [l.min(*a), h.max(*a)]);
        (ends[1] - ends[0]).max(0.0)
    }

    /// The time each sample stands for, half of that to its neighbours, in median steps: the weights that make a sum an integral. At the
    /// edge of a gap half a step at most is added.
    pub fn cells(&self, step_s: f64) -> Vec<f64> {
        let half = |from: Option<&f64>, to: Option<&f64>| match (from, to) {
            (Some(from), Some(to)) if to - from <= BRIDGE_STEPS * step_s => 0.5 * (to - from) / step_s,
            _ => 0.5,
        };
        let cell = |k: usize| {
            let before = k.checked_sub(1).and_then(|b| self.t_s.get(b));
            half(before, self.t_s.get(k)) + half(self.t_s.get(k), self.t_s.get(k + 1))
        };
        (0..self.t_s.len()).map(cell).collect()
    }

    /// The cubic through the four nearest samples, or `None` in a gap.
    pub fn interpolated(&self, t_s: f64, longest_s: f64) -> Option<f64> {
        let n = self.t_s.len();
        let after = self.t_s.partition_point(|t| *t < t_s);
        if self.t_s.get(after).is_some_and(|t| t - t_s < 1e-6 * longest_s) {
            return Some(self.theta_rad[after]);
        }
        if n == 0 {
            return None;
        }
        if after == 0 || after >= n {
            // the grid's last point may lie a rounding beyond the last sample
            let nearest = after.min(n - 1);
            return ((self.t_s[nearest] - t_s).abs() < 0.2 * longest_s).then(|| self.theta_rad[nearest]);
        }
        if self.t_s[after] - self.t_s[after - 1] > longest_s {
            return None;
        }
        let from = after.saturating_sub(2).min(n.saturating_sub(4));
        let (t, a) = (&self.t_s[from..(from + 4).min(n)], &self.theta_rad[from..(from + 4).min(n)]);
        let weight = |i: usize| (0..t.len()).filter(|j| *j != i).map(|j| (t_s - t[j]) / (t[i] - t[j])).product::<f64>();
        Some((0..t.len()).map(|i| a[i] * weight(i)).sum())
    }

    /// With samples interpolated into gaps of a missing frame or two, so that a sum over the samples does not take gaps for noise.
    fn bridged(&self, step_s: f64) -> Self {
        let mut filled = Self { t_s: Vec::new(), theta_rad: Vec::new() };
        for (k, (t, a)) in self.t_s.iter().zip(&self.theta_rad).enumerate() {
            filled.t_s.push(*t);
            filled.theta_rad.push(*a);
            let Some(next) = self.t_s.get(k + 1) else { break };
            let steps = ((next - t) / step_s).round();
            if next - t <= BRIDGE_STEPS * step_s {
                let between = (1..steps as usize).map(|j| t + (next - t) * j as f64 / steps);
                for (t, a) in between.filter_map(|t| Some((t, self.interpolated(t, BRIDGE_STEPS * step_s)?))) {
                    filled.t_s.push(t);
                    filled.theta_rad.push(a);
                }
            }
        }
        filled
    }
}

/// The samples of every link of a recording, on their true time stamps.
#[derive(Debug, Clone, PartialEq)]
pub struct Signal {
    /// Top to bottom.
    pub links: Vec<LinkSamples>,
    /// First and last time stamp.
    pub span_s: [f64; 2],
    /// Median step between the values of the link that has them farthest apart.
    pub step_s: f64,
}

impl Signal {
    /// The measured values of a table.
    pub fn of(series: &AngleSeries) -> Self {
        let link = |theta: &Vec<Option<f64>>| {
            let (t_s, theta_rad) = series.t_s.iter().zip(theta).filter_map(|(t, a)| Some((*t, (*a)?))).unzip();
            LinkSamples { t_s, theta_rad }
        };
        let ends = [series.t_s.first(), series.t_s.last()].map(|t| t.copied().unwrap_or(0.0));
        let links: Vec<LinkSamples> = series.theta_rad.iter().map(link).collect();
        // rows without a value resolve nothing
        let steps = links.iter().filter_map(|l| median_step_s(&l.t_s));
        Self { step_s: steps.fold(series.step_s(), f64::max), links, span_s: ends }
    }

    /// From the first time stamp to the last.
    pub fn duration_s(&self) -> f64 {
        self.span_s[1] - self.span_s[0]
    }

    /// Number of values, all links together.
    pub fn values(&self) -> usize {
        self.links.iter().map(|l| l.t_s.len()).sum()
    }

    /// The stretch from one time to another, its end excluded.
    #[must_use]
    pub fn between(&self, from_s: f64, until_s: f64) -> Self {
        let part = |link: &LinkSamples| {
            let from = link.t_s.partition_point(|t| *t < from_s);
            let until = link.t_s.partition_point(|t| *t < until_s).max(from);
            LinkSamples { t_s: link.t_s[from..until].to_vec(), theta_rad: link.theta_rad[from..until].to_vec() }
        };
        Self { links: self.links.iter().map(part).collect(), span_s: [from_s, until_s], step_s: self.step_s }
    }

    /// The stretch from the first sample at or after a time to the end.
    #[must_use]
    pub fn from(&self, from_s: f64) -> Self {
        let mut part = self.between(from_s, f64::INFINITY);
        let first_s = part.links.iter().filter_map(|l| l.t_s.first().copied()).fold(f64::INFINITY, f64::min);
        part.span_s = [if first_s.is_finite() { first_s } else { from_s }, self.span_s[1]];
        part
    }

    /// The stretch from the beginning to a time, the sample there included.
    #[must_use]
    pub fn until(&self, until_s: f64) -> Self {
        let mut part = self.between(f64::NEG_INFINITY, until_s + 0.5 * self.step_s);
        part.span_s = [self.span_s[0], until_s];
        part
    }

    /// With gaps of a missing frame or two filled by interpolation: for sums over the samples, never for least squares.
    #[must_use]
    pub fn bridged(&self) -> Self {
        let links = self.links.iter().map(|l| l.bridged(self.step_s)).collect();
        Self { links, span_s: self.span_s, step_s: self.step_s }
    }

    /// With each link's straight line taken away, weighted by the Hann window, so that an oscillation of a few cycles does not tilt it.
    #[must_use]
    pub fn levelled(&self) -> Self {
        let duration_s = self.duration_s().max(f64::MIN_POSITIVE);
        let level = |link: &LinkSamples| {
            let at = |t: &f64| (t - self.span_s[0]) / duration_s;
            let mut moments = [0.0; 5];
            for (t, a) in link.t_s.iter().zip(&link.theta_rad) {
                let x = at(t);
                let w = 0.5 - 0.5 * (std::f64::consts::TAU * x).cos();
                for (sum, term) in moments.iter_mut().zip([1.0, x, x * x, *a, x * a]) {
                    *sum += w * term;
                }
            }
            let [w, x, xx, a, xa] = moments;
            let slope = (w * xa - x * a) / (w * xx - x * x).max(f64::MIN_POSITIVE);
            let offset = (a - slope * x) / w.max(f64::MIN_POSITIVE);
            link.t_s.iter().zip(&link.theta_rad).map(|(t, a)| a - offset - slope * at(t)).collect()
        };
        self.with_values(self.links.iter().map(level).collect())
    }

    /// Means over runs of samples that are a sixteenth of an oscillation's cycle or less, at the mean of their time stamps; what is left over at a gap is left
    /// out. A run flattens the oscillation, by the mean of cos ω(t − t̄): that is taken out again.
    #[must_use]
    pub fn averaged(&self, omega_rad_s: f64) -> Self {
        let count = ((std::f64::consts::TAU / (omega_rad_s * self.step_s * VALUES_A_CYCLE)) as usize).max(1);
        if count == 1 {
            return self.clone();
        }
        let of_link = |link: &LinkSamples| {
            let middle_rad = link.mean_rad();
            let (mut t_s, mut theta_rad) = (Vec::new(), Vec::new());
            let mut from = 0;
            while let Some(run) = link.t_s.get(from..from + count) {
                if let Some(gap) = run.windows(2).position(|t| t[1] - t[0] > 1.5 * self.step_s) {
                    from += gap + 1;
                    continue;
                }
                let mean = |of: &dyn Fn(usize) -> f64| (from..from + count).map(of).sum::<f64>() / count as f64;
                let mean_s = mean(&|i| link.t_s[i]);
                let flattened = mean(&|i| (omega_rad_s * (link.t_s[i] - mean_s)).cos());
                t_s.push(mean_s);
                theta_rad.push(middle_rad + mean(&|i| link.theta_rad[i] - middle_rad) / flattened);
                from += count;
            }
            LinkSamples { t_s, theta_rad }
        };
        let step_s = count as f64 * self.step_s;
        Self { links: self.links.iter().map(of_link).collect(), span_s: self.span_s, step_s }
    }

    /// The same time stamps with other values, for example residuals.
    #[must_use]
    pub fn with_values(&self, theta_rad: Vec<Vec<f64>>) -> Self {
        let links = self.links.iter().zip(theta_rad);
        let links = links.map(|(link, theta_rad)| LinkSamples { t_s: link.t_s.clone(), theta_rad }).collect();
        Self { links, span_s: self.span_s, step_s: self.step_s }
    }
}
