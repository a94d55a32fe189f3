//! Where the model departs: place, time, amplitude and phase.

use std::collections::BTreeMap;

use super::{Chapter, at};
use crate::report::curves::Curves;
use crate::report::html::paragraph;
use crate::report::left::{Diagnosed, Left};
use crate::report::plot::{Axis, Ink, Map, Plot, Series, Style};

/// Windows of time, of amplitude, and of phase in the maps.
const MAP_CELLS: [usize; 3] = [28, 14, 12];

/// Where the model departs.
pub fn places(left: &Left) -> Chapter {
    let mut chapter = Chapter::new("where", "Where the model departs");
    let Some(found) = &left.diagnosis else { return chapter };
    let location = &found.location;
    if !location.statement.is_empty() {
        chapter.words(paragraph(&location.statement));
    }
    chapter.plot(energy(found));
    chapter.plot(gains(found));
    if let Some(curves) = &left.where_curves {
        let place = location.missing_torque.as_ref().map_or("hinge", |t| t.place.as_str());
        chapter.plot(map(
            curves,
            place,
            &Side { column: "t_s", axis: Axis::of("t", "s"), id: "where-time", along: "time", cells: MAP_CELLS[0] },
        ));
        chapter.plot(map(
            curves,
            place,
            &Side {
                column: "amplitude_rad",
                axis: Axis::of("amplitude", "rad"),
                id: "where-amplitude",
                along: "amplitude",
                cells: MAP_CELLS[1],
            },
        ));
    }
    chapter
}

fn bars(plot: Plot, mut values: Vec<(String, f64)>) -> Plot {
    values.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let ordered: Vec<(f64, usize)> = values.iter().enumerate().map(|(row, (_, v))| (*v, row + 1)).rev().collect();
    Plot {
        y: Axis { label: "place".into(), rows: values.into_iter().map(|v| v.0).collect(), ..Axis::default() },
        at: ordered.iter().map(|p| p.0).collect(),
        series: vec![Series {
            name: plot.x.label.clone(),
            ink: Ink::Blue,
            style: Style::Bars,
            values: ordered.iter().map(|p| Some(p.1 as f64)).collect(),
            ..Series::default()
        }],
        ..plot
    }
}

fn energy(found: &Diagnosed) -> Plot {
    let shares: Vec<(String, f64)> = found
        .location
        .energy_share
        .iter()
        .filter_map(|(place, share)| Some((place.clone(), 1e2 * (*share)?)))
        .collect();
    let said = shares.iter().map(|(place, share)| format!("{place} {share:.0} %")).collect::<Vec<_>>().join(", ");
    let plot = Plot {
        id: "where-energy".into(),
        title: "Where the energy is lost".into(),
        alternative: format!("Share of each place in the energy lost: {said}"),
        caption: "By the likeliest model, the missing effects included.".into(),
        x: Axis { range: Some([0.0, 100.0]), ..Axis::of("share of the energy lost", "%") },
        ..Plot::default()
    };
    bars(plot, shares)
}

fn gains(found: &Diagnosed) -> Plot {
    let mut gains: BTreeMap<String, f64> = BTreeMap::new();
    for unknown in &found.location.unknown {
        let form = if unknown.form == "law" { "any law" } else { "any course in time" };
        let gain = gains.entry(format!("{}: {form}", unknown.place)).or_default();
        *gain = gain.max(unknown.log_likelihood_gain.unwrap_or(0.0));
    }
    let plot = Plot {
        id: "where-place".into(),
        title: "What an unknown torque would still explain, place by place".into(),
        alternative: "Gain in log-likelihood that an unknown torque at each place would bring, beside the likeliest names".into(),
        caption: "How much likelier the recording becomes if, beside the likeliest effects, an unknown torque acts at each place: any course in time, or any law. Near zero: nothing is left there.".into(),
        x: Axis::of("gain in log-likelihood", "nats"),
        ..Plot::default()
    };
    bars(plot, gains.into_iter().collect())
}

/// Along what a map runs.
struct Side {
    column: &'static str,
    axis: Axis,
    id: &'static str,
    along: &'static str,
    cells: usize,
}

/// The mean torque in each cell of time (or amplitude) and phase of the swing.
fn map(curves: &Curves, place: &str, side: &Side) -> Plot {
    let (Some(along), Some(phase), Some(torque)) =
        (curves.column(side.column), curves.column("phase_deg"), curves.column("torque_n_m"))
    else {
        return Plot::default();
    };
    let rows: Vec<(f64, f64, f64)> =
        along.iter().zip(phase).zip(torque).filter_map(|((x, p), t)| Some(((*x)?, (*p)?, (*t)?))).collect();
    let (low, high) =
        rows.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), r| (low.min(r.0), high.max(r.0)));
    if !(high > low) {
        return Plot::default();
    }
    let largest = rows.iter().fold(0.0f64, |most, r| most.max(r.2.abs()));
    let (scale, unit) = match largest {
        l if l < 1e-6 => (1e9, "nN m"),
        l if l < 1e-3 => (1e6, "µN m"),
        _ => (1e3, "mN m"),
    };
    let phases = MAP_CELLS[2];
    let mut sums = vec![vec![(0.0, 0usize); phases]; side.cells];
    for (x, phase_deg, torque) in rows {
        let column = ((x - low) / (high - low) * side.cells as f64) as usize;
        let row = (phase_deg / 360.0 * phases as f64) as usize;
        let cell = &mut sums[column.min(side.cells - 1)][row.min(phases - 1)];
        *cell = (cell.0 + scale * torque, cell.1 + 1);
    }
    let edges =
        |from: f64, to: f64, count: usize| (0..=count).map(|k| from + (to - from) * k as f64 / count as f64).collect();
    Plot {
        id: side.id.into(),
        title: format!("The torque that the base model lacks, {}: {} and phase of the swing", at(place), side.along),
        alternative: format!("Map of the mean missing torque over {} and phase of the swing; blue is negative, vermillion positive", side.along),
        caption: "0° is the turning point on the right, 90° the way back to the left, 180° the left turning point, 270° the way to the right. A torque against the motion – a loss – is \
                  vermillion at 90° and blue at 270°; one that goes with the angle, as a spring does, is blue at 0° and vermillion at 180°.".into(),
        x: side.axis.clone(),
        y: Axis { step: Some(90.0), ..Axis::of("phase of the swing", "°") },
        is_time: side.column == "t_s",
        map: Some(Map {
            name: "mean torque".into(),
            unit,
            x_edges: edges(low, high, side.cells),
            y_edges: edges(0.0, 360.0, phases),
            values: sums.into_iter().map(|column| column.into_iter().map(|(sum, n)| (n > 0).then(|| sum / n as f64)).collect()).collect(),
        }),
        ..Plot::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_gathers_the_torque_by_time_and_phase() {
        let curves =
            Curves::parse("t_s,torque_n_m,amplitude_rad,phase_deg\n0,1e-7,0.5,10\n1,3e-7,0.4,10\n28,-2e-7,0.3,270\n");
        let side = Side { column: "t_s", axis: Axis::of("t", "s"), id: "where-time", along: "time", cells: 28 };
        let map = map(&curves, "hinge", &side).map.unwrap();
        assert_eq!(map.unit, "nN m");
        assert!((map.values[0][0].unwrap() - 100.0).abs() < 1e-9 && (map.values[27][9].unwrap() + 200.0).abs() < 1e-9);
        assert!(map.values[5][5].is_none() && map.x_edges.len() == 29);
    }
}
