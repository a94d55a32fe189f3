//! The measured samples of each link, without the missing ones.

use crate::series::AngleSeries;

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
}

/// The samples of every link of a recording, on their true time stamps.
#[derive(Debug, Clone, PartialEq)]
pub struct Signal {
    /// Top to bottom.
    pub links: Vec<LinkSamples>,
    /// First and last time stamp.
    pub span_s: [f64; 2],
    /// Median step between time stamps.
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
        Self { links: series.theta_rad.iter().map(link).collect(), span_s: ends, step_s: series.step_s() }
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

    /// The same time stamps with other values, for example residuals.
    #[must_use]
    pub fn with_values(&self, theta_rad: Vec<Vec<f64>>) -> Self {
        let links = self.links.iter().zip(theta_rad);
        let links = links.map(|(link, theta_rad)| LinkSamples { t_s: link.t_s.clone(), theta_rad }).collect();
        Self { links, span_s: self.span_s, step_s: self.step_s }
    }
}
