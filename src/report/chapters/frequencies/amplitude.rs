//! Frequency and damping of a mode against its amplitude.

use crate::report::left::{Interval, Mode, Step};
use crate::report::plot::{Axis, Ink, Plot, Series, Style};

pub(super) fn frequency_against_amplitude(mode: &Mode, alone: bool) -> Plot {
    if mode.envelope.is_none() {
        return Plot::default();
    }
    let law = mode.frequency_law().and_then(|law| Some((law.f0_hz.value?, law.kappa_per_rad2.value?)));
    let mut plot = against_amplitude(mode, |step| step.frequency_hz);
    if let Some((f0_hz, kappa)) = law {
        let values = plot.at.iter().map(|a| Some(f0_hz * (1.0 - kappa * a * a))).collect();
        plot.series.push(Series {
            name: format!("f₀(1 − κA²), κ = {kappa:.4} /rad²{}", if alone { "" } else { ", the other mode at rest" }),
            ink: Ink::Ink,
            style: Style::Dashed,
            values,
            ..Series::default()
        });
    }
    Plot {
        id: format!("frequency-amplitude-{}", mode.number),
        title: format!("Frequency against amplitude, mode {}", mode.number),
        alternative: "Frequency from window to window, with 95 % intervals, against the amplitude of the swing".into(),
        caption: format!(
            "Each point is the step between two windows of a few cycles. A pendulum is slower at large amplitude: κ is 1/16 for one rigid link.{}",
            if alone { "" } else { " The amplitude of the other mode moves the points off the line." }
        ),
        y: Axis::of("frequency", "Hz"),
        ..plot
    }
}

pub(super) fn damping_against_amplitude(mode: &Mode) -> Plot {
    Plot {
        id: format!("damping-amplitude-{}", mode.number),
        title: format!("Damping against amplitude, mode {}", mode.number),
        alternative: "Damping ratio from window to window, with 95 % intervals, against the amplitude of the swing".into(),
        caption: "Level: viscous damping. Rising to the left, as the swing becomes small: dry friction. Rising to the right: drag.".into(),
        y: Axis::of("damping ratio ξ", ""),
        ..against_amplitude(mode, |step| step.damping_ratio)
    }
}

fn against_amplitude(mode: &Mode, of: fn(&Step) -> Interval) -> Plot {
    let steps = mode.envelope.iter().flat_map(|e| &e.steps);
    let mut points: Vec<(f64, Interval)> = steps.filter_map(|s| Some((s.amplitude_rad?, of(s)))).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let series = Series {
        name: format!("mode {}", mode.number),
        ink: Ink::number(mode.number - 1),
        style: Style::Interval,
        values: points.iter().map(|p| p.1.value).collect(),
        ends: points.iter().map(|p| Some([p.1.low?, p.1.high?])).collect(),
    };
    Plot {
        x: Axis::of("amplitude", "rad"),
        at: points.iter().map(|p| p.0).collect(),
        series: vec![series],
        ..Plot::default()
    }
}
