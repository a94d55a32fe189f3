//! The prediction of what was not fitted, before and after.

use super::times;
use crate::report::curves::Curves;
use crate::report::left::{Diagnosed, Left};
use crate::report::plot::{Axis, Band, Ink, Line, Plot, Series, Style};

/// Swings that are looked at first, and how far they stand above the noise.
const SWINGS: f64 = 5.0;
const CLEAR: f64 = 15.0;

/// The models in the diagnosis, as columns call them, for people, with their colours.
fn sides(found: &Diagnosed) -> [(&'static str, String, Ink); 3] {
    let verdict = &found.verdict;
    let names: Vec<&str> = verdict.effects.iter().chain(&verdict.further_effects).map(String::as_str).collect();
    [
        ("base", "base model".to_owned(), Ink::Vermillion),
        (
            "named",
            if names.is_empty() { "with what comes nearest".to_owned() } else { format!("with {}", names.join(", ")) },
            Ink::Blue,
        ),
        ("learnt", "with the law that was learnt".to_owned(), Ink::Green),
    ]
}

/// Where the prediction begins.
fn border_s(curves: &Curves) -> Option<f64> {
    let (stamps, predicted) = (curves.column("t_s")?, curves.column("predicted")?);
    stamps.iter().zip(predicted).find(|(_, p)| **p == Some(1.0)).and_then(|(t, _)| *t)
}

fn in_time(curves: &Curves) -> Plot {
    let border_s = border_s(curves);
    let at = curves.numbers("t_s");
    let last_s = at.last().copied().unwrap_or(0.0);
    Plot {
        x: Axis::of("t", "s"),
        is_time: true,
        bands: border_s
            .iter()
            .map(|t| Band {
                name: "predicted, not fitted".into(),
                ink: Ink::Orange,
                is_across: false,
                ends: [*t, last_s],
            })
            .collect(),
        lines: border_s.iter().map(|t| Line { name: "predicted from here".into(), at: *t }).collect(),
        at,
        ..Plot::default()
    }
}

/// A few swings, the last that stand clear of the noise: there a model has had the longest time to depart.
fn end_of_swing(left: &Left, found: &Diagnosed, curves: &Curves) -> Option<[f64; 2]> {
    let f_hz = left.identified.as_ref()?.modes.iter().filter_map(|m| m.frequency_hz.value).min_by(f64::total_cmp)?;
    let (t_s, angle) = (curves.column("t_s")?, curves.column("theta1_measured_rad")?);
    let clear_rad = CLEAR * found.baseline.noise_rad.first().copied().flatten()?;
    let mut seen =
        t_s.iter().zip(angle).filter(|(_, a)| a.is_some_and(|a| a.abs() > clear_rad)).filter_map(|(t, _)| *t);
    let last_s = seen.next_back()?;
    let first_s = t_s.first().copied().flatten()?;
    Some([last_s - SWINGS / f_hz, last_s]).filter(|[from, _]| *from > first_s)
}

pub(super) fn swing(left: &Left, found: &Diagnosed, curves: &Curves, link: usize) -> Plot {
    let column = |name: &str| curves.column(&format!("theta{link}_{name}")).map(<[_]>::to_vec);
    let mut series = vec![Series {
        name: format!("measured θ{link}"),
        ink: Ink::Ink,
        style: Style::Dots,
        values: column("measured_rad").unwrap_or_default(),
        ..Series::default()
    }];
    series.extend(sides(found).into_iter().filter_map(|(side, name, ink)| {
        Some(Series {
            name,
            ink,
            style: if side == "base" { Style::Dashed } else { Style::Line },
            values: column(&format!("{side}_rad"))?,
            ..Series::default()
        })
    }));
    let first = end_of_swing(left, found, curves);
    let caption = if first.is_some() {
        "The last swings that stand clear of the noise; on the screen a double click shows all."
    } else {
        ""
    };
    Plot {
        id: format!("before-after-{link}"),
        title: format!("θ{link} before and after"),
        alternative: format!("Measured θ{link}, the base model and the model with what was missing, against time"),
        caption: caption.into(),
        x: Axis { first, ..Axis::of("t", "s") },
        y: Axis::of("angle", "rad"),
        series,
        ..in_time(curves)
    }
}

pub(super) fn before_and_after(found: &Diagnosed, curves: &Curves, link: usize) -> Plot {
    let column = |side: &str| curves.column(&format!("theta{link}_{side}_residual_rad")).map(|c| times(c, 1e3));
    let series = sides(found).into_iter().filter_map(|(side, name, ink)| {
        Some(Series { name, ink, style: Style::Dots, values: column(side)?, ..Series::default() })
    });
    let mut plot = in_time(curves);
    let noise = found.baseline.noise_rad.get(link - 1).copied().flatten().unwrap_or(0.0);
    plot.bands.push(Band {
        name: "±2 sd of the noise".into(),
        ink: Ink::Grey,
        is_across: true,
        ends: [-2e3 * noise, 2e3 * noise],
    });
    Plot {
        id: format!("left-{link}"),
        title: format!("What is left of θ{link}, before and after"),
        alternative: format!(
            "Measured less predicted θ{link} against time, by the base model and with what was missing, beside the noise"
        ),
        caption: if plot.lines.is_empty() {
            "Measured less simulated."
        } else {
            "Measured less predicted. Right of the line nothing was fitted."
        }
        .into(),
        y: Axis::of("residual", "mrad"),
        series: series.collect(),
        ..plot
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_border_is_the_first_row_that_was_predicted() {
        assert_eq!(border_s(&Curves::parse("t_s,predicted\n0,0\n1,0\n2,1\n3,1\n")), Some(2.0));
        assert_eq!(border_s(&Curves::parse("t_s,predicted\n0,0\n")), None);
    }
}
