//! The recording with its overlay, the angles, and the audit of the time stamps.

use super::{Chapter, Part, times};
use crate::report::html::{copyable, escaped, paragraph, table, value};
use crate::report::left::{Left, Track};
use crate::report::plot::{Axis, Ink, Plot, Series, Style};
use crate::series::AngleSeries;

/// Time stamps are no more exact than that: what is less is rounding.
const ROUNDING_S: f64 = 1e-9;

/// The chapter.
pub fn chapter(left: &Left) -> Chapter {
    let mut chapter = Chapter::new("recording", "Recording");
    if left.overlay_bytes.is_some() {
        chapter.parts.push(Part::Film);
    }
    if let Some(angles) = &left.angles {
        chapter.plot(swing(angles));
    }
    if let Some(track) = left.track.as_ref().filter(|t| t.time_stamps.frames > 0) {
        chapter.words(audit(track));
    }
    if let Some(angles) = &left.angles {
        chapter.plot(steps(angles));
    }
    chapter
}

fn swing(angles: &AngleSeries) -> Plot {
    let series = |(link, values): (usize, &Vec<Option<f64>>)| Series {
        name: format!("θ{}", link + 1),
        ink: Ink::number(link),
        style: if link == 1 { Style::Dashed } else { Style::Line },
        values: values.clone(),
        ..Series::default()
    };
    Plot {
        id: "angles".into(),
        title: "Angles as measured".into(),
        alternative: format!("{} against time, {} rows over {:.2} s", names(angles.links()), angles.len(), angles.duration_s()),
        caption: "Angle of each link from the downward vertical. A click moves the recording to that frame; drag to enlarge, double-click to see all.".into(),
        x: Axis::of("t", "s"),
        y: Axis::of("angle", "rad"),
        is_time: true,
        at: angles.t_s.clone(),
        series: angles.theta_rad.iter().enumerate().map(series).collect(),
        ..Plot::default()
    }
}

/// `θ1, θ2`.
fn names(links: usize) -> String {
    (1..=links).map(|k| format!("θ{k}")).collect::<Vec<_>>().join(", ")
}

fn steps(angles: &AngleSeries) -> Plot {
    let usual_ms = 1e3 * angles.step_s();
    let (mut low, mut high) = (0.9 * usual_ms, 1.1 * usual_ms);
    for step in angles.t_s.windows(2).map(|w| 1e3 * (w[1] - w[0])) {
        (low, high) = (low.min(0.95 * step), high.max(1.05 * step));
    }
    let steps = std::iter::once(None).chain(angles.t_s.windows(2).map(|w| Some(w[1] - w[0])));
    Plot {
        id: "time-steps".into(),
        title: "Time from frame to frame".into(),
        alternative: "Step between neighbouring time stamps against time; missing frames stand above the rest".into(),
        caption: "From the time stamps of the file, not from a frame rate. A missing frame doubles its step.".into(),
        x: Axis::of("t", "s"),
        y: Axis { range: Some([low, high]), ..Axis::of("step", "ms") },
        is_time: true,
        at: angles.t_s.clone(),
        series: vec![Series {
            name: "step".into(),
            ink: Ink::Blue,
            style: Style::Dots,
            values: times(&steps.collect::<Vec<_>>(), 1e3),
            ..Series::default()
        }],
        ..Plot::default()
    }
}

fn audit(track: &Track) -> String {
    let stamps = &track.time_stamps;
    let repeated = stamps.repeated_or_backward_frames.len();
    let rates = stamps.real_rate_hz.zip(stamps.nominal_rate_hz);
    let rate = match rates {
        Some((real, stated)) if !stamps.varies() && ((real - stated) / stated).abs() > 2e-3 => {
            "The file states another rate than its time stamps have."
        }
        _ => "",
    };
    let found = if stamps.varies() {
        format!(
            "The frame rate varies; whether frames are missing, the stamps do not tell. {repeated} repeat a time stamp or run backwards."
        )
    } else if stamps.missing_frames == 0 && repeated == 0 {
        "No frame is missing and none repeats.".to_owned()
    } else {
        format!(
            "{} frames are missing in {} gaps; {repeated} repeat a time stamp or run backwards.",
            stamps.missing_frames, stamps.gap_count
        )
    };
    let milli = |s: f64| value(Some(1e3 * s), 4, "ms");
    let rows = [
        ("frames", copyable(&stamps.frames.to_string(), "")),
        ("from, to", format!("{} … {}", value(Some(stamps.first_s), 5, "s"), value(Some(stamps.last_s), 5, "s"))),
        ("frame rate by the time stamps", value(stamps.real_rate_hz, 6, "Hz")),
        ("frame rate that the file states", value(stamps.nominal_rate_hz, 6, "Hz")),
        ("step: median", milli(stamps.median_step_s)),
        ("step: shortest, longest", format!("{}, {}", milli(stamps.shortest_step_s), milli(stamps.longest_step_s))),
        ("scatter of the steps (1 sd)", milli(if stamps.jitter_sd_s < ROUNDING_S { 0.0 } else { stamps.jitter_sd_s })),
        (
            "picture",
            escaped(&format!("{} × {} px, {}", track.video.width_px, track.video.height_px, track.video.codec)),
        ),
    ];
    let noise = track.angles.iter().enumerate().map(|(k, a)| {
        vec![
            format!("standard deviation of θ{}, median of all frames", k + 1),
            value(a.noise_rad.map(|n| 1e3 * n), 3, "mrad"),
        ]
    });
    let rows = rows.into_iter().map(|(what, number)| vec![what.to_owned(), number]).chain(noise);
    format!("<h3>Time stamps</h3>\n{}{}", paragraph(&format!("{found} {rate}")), table(&["quantity", "value"], rows))
}
