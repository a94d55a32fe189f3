//! Mode shapes, as a figure and for the drawing that moves.

use crate::report::html;
use crate::report::left::{Identified, Left, Mode};
use crate::report::plot::{Axis, Ink, Plot, Series, Style};

/// Displacement along the specimen in each mode, the largest being one.
pub(super) fn shapes(left: &Left, found: &Identified) -> Plot {
    let links = found.modes.iter().map(|m| m.shape.len()).max().unwrap_or(0);
    let stated = left.link_lengths_m();
    let is_stated = stated.len() == links;
    let lengths = if is_stated { stated } else { vec![1.0; links] };
    let mut at = vec![0.0];
    lengths.iter().for_each(|l| at.push(at[at.len() - 1] + l));
    let series = found.modes.iter().filter(|m| m.shape.len() == links).map(|mode| {
        let mut place = vec![0.0];
        for (link, length) in mode.shape.iter().zip(&lengths) {
            let side = link.ratio_to_first.value.unwrap_or(1.0) * link.phase_to_first_rad.value.unwrap_or(0.0).cos();
            place.push(place[place.len() - 1] + length * side);
        }
        let most = place.iter().fold(f64::MIN_POSITIVE, |most, p: &f64| most.max(p.abs()));
        Series {
            name: format!(
                "mode {}, {} Hz",
                mode.number,
                mode.frequency_hz.value.map_or_else(String::new, |f| format!("{f:.3}"))
            ),
            ink: Ink::number(mode.number - 1),
            style: if mode.number == 2 { Style::Dashed } else { Style::Line },
            values: place.iter().map(|p| Some(p / most)).collect(),
            ..Series::default()
        }
    });
    Plot {
        id: "mode-shapes".into(),
        title: "Mode shapes".into(),
        alternative: "Displacement from hinge to tip in each mode, as a share of the largest".into(),
        caption: "Small displacements; of a link that lags behind the part in phase is drawn.".into(),
        x: Axis::of(
            if is_stated { "distance from the hinge" } else { "links from the hinge" },
            if is_stated { "m" } else { "" },
        ),
        y: Axis { range: Some([-1.1, 1.1]), ..Axis::of("displacement over the largest", "") },
        at,
        series: series.collect(),
        ..Plot::default()
    }
}

/// The modes as `page.js` moves them.
pub fn moving(left: &Left) -> serde_json::Value {
    let modes = left.identified.iter().flat_map(|i| &i.modes);
    let lengths = left.link_lengths_m();
    let of = |mode: &Mode| {
        let link = |k: usize| {
            let link = &mode.shape[k];
            let length = if lengths.len() == mode.shape.len() { lengths[k] } else { 1.0 };
            serde_json::json!({"length": length, "ratio": link.ratio_to_first.value.unwrap_or(1.0), "phase": link.phase_to_first_rad.value.unwrap_or(0.0)})
        };
        serde_json::json!({
            "number": mode.number, "hz": mode.frequency_hz.value, "label": html::interval(&mode.frequency_hz, "Hz"),
            "links": (0..mode.shape.len()).map(link).collect::<Vec<_>>(),
        })
    };
    modes.map(of).collect()
}
