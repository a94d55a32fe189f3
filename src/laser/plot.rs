//! The record and its answer as a figure.

use super::analysis::Analysis;
use super::report::Report;
use crate::report::plot::{Axis, Band, Ink, Plot, Series, Style};

/// The record in means over a swing's period, push and effects over it, the lit times as bands.
pub fn plot(analysis: &Analysis, report: &Report) -> Plot {
    let (grid, curves) = (&analysis.grid, &analysis.curves);
    let series = |name: &str, ink: Ink, style: Style, values: &[f64]| Series {
        name: name.into(),
        ink,
        style,
        values: values.iter().zip(&grid.count).map(|(v, count)| (*count > 0.0).then_some(1e6 * v)).collect(),
        ..Series::default()
    };
    let ends = |pair: &[f64]| [pair[0], pair.get(1).copied().unwrap_or(grid.end_s())];
    let bands = analysis.lamp.edges_s.chunks(2).enumerate().map(|(k, pair)| Band {
        name: if k == 0 { "lamp on".into() } else { String::new() },
        ink: Ink::Orange,
        ends: ends(pair),
        ..Band::default()
    });
    Plot {
        id: "laser".into(),
        title: format!(
            "Push of light {:.3} ± {:.3} µm",
            1e6 * report.push_m.value,
            0.5e6 * (report.push_m.interval[1] - report.push_m.interval[0])
        ),
        x: Axis::of("time", "s"),
        y: Axis::of("displacement", "µm"),
        is_time: true,
        at: (0..grid.len()).map(|cell| grid.time_s(cell)).collect(),
        series: vec![
            series("record, mean over a swing", Ink::Ink, Style::Line, &curves.without_swings_m),
            series("push and effects", Ink::Vermillion, Style::Line, &curves.effects_m),
            series("push alone", Ink::Blue, Style::Dashed, &curves.push_m),
        ],
        bands: bands.collect(),
        ..Plot::default()
    }
}
