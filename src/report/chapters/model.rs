//! The fitted model beside the measurement.

use super::{Chapter, times};
use crate::identify::signal::Signal;
use crate::identify::spectrum::Spectrum;
use crate::report::curves::Curves;
use crate::report::html::{capitalised, escaped, interval, milli, paragraph, table, value};
use crate::report::left::{FitSide, Fitted, Interval, Left};
use crate::report::plot::{Axis, Band, Ink, Line, Plot, Series, Style};
use crate::series::AngleSeries;

/// The chapter.
pub fn chapter(left: &Left) -> Chapter {
    let mut chapter = Chapter::new("model", "Model against measurement");
    let Some(fit) = &left.fit else { return chapter };
    let Some(first) = fit.recordings.first() else { return chapter };
    let several = fit.recordings.len() > 1;
    if !several {
        chapter.words(paragraph(&capitalised(&first.fitted.statement)));
    }
    chapter.words(parameters(fit));
    for recording in &fit.recordings {
        if several {
            let file = escaped(&recording.file);
            let said = paragraph(&capitalised(&recording.fitted.statement));
            chapter.words(format!("<h3><code>{file}</code></h3>\n{said}"));
        }
        chapter.words(residuals(&recording.fitted));
    }
    if several {
        chapter.words(paragraph(&format!("The figures show the first recording, {}.", first.file)));
    }
    let side = &first.fitted;
    let Some(curves) = left.fit_curves.as_ref().map(|curves| curves.only("recording", 1.0)) else { return chapter };
    for link in 1..=curves.links() {
        chapter.plot(swing(&curves, link));
    }
    chapter.plot(residual(&curves, side));
    chapter.plot(residual_spectrum(&curves, left));
    chapter
}

fn parameters(fit: &Fitted) -> String {
    let rows = fit.parameters.iter().map(|(id, p)| {
        let of = Interval { value: p.value, sd: p.sd, low: p.low95, high: p.high95 };
        let note = if p.determined == Some(false) { "not told from zero" } else { "" };
        vec![
            format!("<code>{}</code>", escaped(id)),
            interval(&of, &p.unit),
            value(p.start, 4, &p.unit),
            note.to_owned(),
        ]
    });
    let coloured = if fit.coloured_residuals {
        "<p class=\"note\">The residuals are correlated in time; the intervals are widened for it.</p>\n"
    } else {
        ""
    };
    let invalid = if fit.intervals_valid == Some(false) {
        "<p class=\"note\">The model does not reproduce the recording: the intervals are not valid, and the values are the best of a wrong model.</p>\n"
    } else {
        ""
    };
    table(&["parameter", "fitted, 95 %", "in the file", ""], rows) + invalid + coloured
}

fn residuals(side: &FitSide) -> String {
    let rows = (0..side.rmse_rad.len()).map(|link| {
        vec![format!("θ{}", link + 1), milli(&side.noise_rad, link, "mrad"), milli(&side.rmse_rad, link, "mrad")]
    });
    table(&["angle", "noise (1 sd)", "left by the model (rms)"], rows)
}

fn swing(curves: &Curves, link: usize) -> Plot {
    let column = |name: &str| curves.column(&format!("theta{link}_{name}_rad")).map(<[_]>::to_vec).unwrap_or_default();
    Plot {
        id: format!("model-{link}"),
        title: format!("θ{link}: measured and simulated"),
        alternative: format!("Measured θ{link} as dots and the fitted model as a line, against time"),
        caption: "The simulation starts once, at the first row, and runs free from there.".into(),
        x: Axis::of("t", "s"),
        y: Axis::of("angle", "rad"),
        is_time: true,
        at: curves.numbers("t_s"),
        series: vec![
            Series {
                name: format!("measured θ{link}"),
                ink: Ink::Ink,
                style: Style::Dots,
                values: column("measured"),
                ..Series::default()
            },
            Series {
                name: format!("simulated θ{link}"),
                ink: Ink::Vermillion,
                style: Style::Line,
                values: column("simulated"),
                ..Series::default()
            },
        ],
        ..Plot::default()
    }
}

fn residual(curves: &Curves, side: &FitSide) -> Plot {
    let links = curves.links();
    let series = (1..=links).map(|link| Series {
        name: format!("residual θ{link}"),
        ink: Ink::number(link - 1),
        style: Style::Dots,
        values: times(curves.column(&format!("theta{link}_residual_rad")).unwrap_or_default(), 1e3),
        ..Series::default()
    });
    let noise = side.noise_rad.iter().flatten().fold(0.0, |most: f64, n| most.max(*n));
    Plot {
        id: "residual".into(),
        title: "What the model leaves".into(),
        alternative: "Measured less simulated angle against time, with a band of two standard deviations of the noise"
            .into(),
        caption:
            "Measured less simulated. A model that reproduces the recording leaves points scattered within the band."
                .into(),
        x: Axis::of("t", "s"),
        y: Axis::of("residual", "mrad"),
        is_time: true,
        at: curves.numbers("t_s"),
        series: series.collect(),
        bands: vec![Band {
            name: "±2 sd of the noise".into(),
            ink: Ink::Grey,
            is_across: true,
            ends: [-2e3 * noise, 2e3 * noise],
        }],
        ..Plot::default()
    }
}

/// Spectra of what is left, beside that of the swing.
fn residual_spectrum(curves: &Curves, left: &Left) -> Plot {
    let t_s = curves.numbers("t_s");
    let of = |kind: &str| {
        let theta_rad: Vec<Vec<Option<f64>>> = (1..=curves.links())
            .filter_map(|link| curves.column(&format!("theta{link}_{kind}_rad")).map(<[_]>::to_vec))
            .collect();
        let sd_rad = theta_rad.iter().map(|c| vec![None; c.len()]).collect();
        let series = AngleSeries {
            path: "fit.csv".into(),
            t_s: t_s.clone(),
            theta_rad,
            sd_rad,
            tracked: false,
            warnings: Vec::new(),
        };
        let complete = series
            .theta_rad
            .iter()
            .all(|c| c.len() == t_s.len() && c.iter().flatten().count() > crate::series::FEWEST_ROWS);
        (complete && t_s.len() > crate::series::FEWEST_ROWS).then(|| Spectrum::of(&Signal::of(&series), 0.0))
    };
    let (Some(measured), Some(residual)) = (of("measured"), of("residual")) else { return Plot::default() };
    let first = ((measured.resolution_hz / measured.step_hz) as usize).max(1);
    let count = measured.amplitude_rad.len().min(residual.amplitude_rad.len());
    let values = |of: &Spectrum| {
        of.amplitude_rad.iter().take(count).skip(first).map(|a| Some(1e3 * a).filter(|a| *a > 0.0)).collect()
    };
    let modes = left.identified.iter().flat_map(|i| &i.modes);
    Plot {
        id: "residual-spectrum".into(),
        title: "Spectrum of what the model leaves".into(),
        alternative: "Amplitude spectra of the measured angles and of the residual".into(),
        caption:
            "Peaks that stay in the residual tell at which frequencies the model is wrong; a level residual is noise."
                .into(),
        x: Axis::of("frequency", "Hz"),
        y: Axis { is_logarithmic: true, ..Axis::of("amplitude", "mrad") },
        at: (first..count).map(|k| k as f64 * measured.step_hz).collect(),
        series: vec![
            Series { name: "measured".into(), ink: Ink::Grey, values: values(&measured), ..Series::default() },
            Series { name: "residual".into(), ink: Ink::Vermillion, values: values(&residual), ..Series::default() },
        ],
        lines: modes.filter_map(|m| Some(Line { name: format!("f{}", m.number), at: m.frequency_hz.value? })).collect(),
        ..Plot::default()
    }
}
