//! What the model lacks: names, proof, the law, and where it acts.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::{Chapter, times};
use crate::diagnose::Effect;
use crate::report::curves::Curves;
use crate::report::html::{escaped, milli, paragraph, table, value, verbatim, verbatim_copyable, with_half};
use crate::report::left::{Diagnosed, Law, Left, Remainder};
use crate::report::plot::{Axis, Band, Ink, Line, Map, Plot, Series, Style};

/// Explanations in the table.
const LISTED: usize = 6;
/// Swings that are looked at first, and how far they stand above the noise.
const SWINGS: f64 = 5.0;
const CLEAR: f64 = 15.0;
/// Effects in the figure.
const FEWEST_NAMES: usize = 3;
const MOST_NAMES: usize = 12;
/// Less probable ones are not worth a row.
const LIKELY: f64 = 1e-3;
/// Windows of time, of amplitude, and of phase in the maps.
const MAP_CELLS: [usize; 3] = [28, 14, 12];

/// The chapter.
pub fn chapter(left: &Left) -> Chapter {
    let mut chapter = Chapter::new("missing", "What the model lacks");
    let Some(found) = &left.diagnosis else { return chapter };
    let verdict = &found.verdict;
    chapter.words(format!("<p class=\"verdict\">{}</p>\n", escaped(&verdict.statement)));
    if let Some(advice) = verdict.to_decide.as_ref().filter(|advice| !advice.is_empty()) {
        let class: Vec<String> = verdict.class.iter().map(|id| words(id)).collect();
        let class = if class.len() > 1 {
            format!("The recording does not tell these apart: {}.", class.join("; "))
        } else {
            String::new()
        };
        chapter.words(format!(
            "<h3>What cannot be told, and the measurement that would tell</h3>\n{}<p class=\"decide\">{}</p>\n",
            if class.is_empty() { class } else { paragraph(&class) },
            escaped(advice)
        ));
    }
    chapter.plot(inclusion(found));
    chapter.words(candidates(found));
    chapter.words(proof(found));
    if let Some(curves) = &left.diagnosis_curves {
        for link in 1..=curves.links() {
            chapter.plot(swing(left, found, curves, link));
        }
        for link in 1..=curves.links() {
            chapter.plot(before_and_after(found, curves, link));
        }
    }
    if let Some(remainder) = &verdict.remainder {
        chapter.words(remains(remainder));
    }
    if let Some(law) = &verdict.law {
        chapter.words(learnt(law));
    }
    chapter.words(limits(found));
    chapter
}

/// An effect in words, with its name in files.
fn words(id: &str) -> String {
    let known = Effect::ALL.into_iter().find(|effect| effect.id() == id);
    known.map_or_else(|| id.to_owned(), |effect| format!("{} ({id})", effect.words()))
}

fn inclusion(found: &Diagnosed) -> Plot {
    let mut names: Vec<(&String, f64)> =
        found.verdict.inclusion.iter().filter_map(|(id, p)| Some((id, (*p)?))).collect();
    names.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(b.0)));
    let likely = names.iter().filter(|(_, p)| *p >= LIKELY).count();
    names.truncate(likely.clamp(FEWEST_NAMES, MOST_NAMES));
    let said = names.iter().take(4).map(|(id, p)| format!("{id} {p:.3}")).collect::<Vec<_>>().join(", ");
    let rows: Vec<String> = names.iter().map(|(id, _)| (*id).clone()).collect();
    // bars are drawn in the order of their length
    let ordered: Vec<(f64, usize)> = names.iter().enumerate().map(|(row, (_, p))| (*p, row + 1)).rev().collect();
    Plot {
        id: "inclusion".into(),
        title: "How probable each effect is".into(),
        alternative: format!("Probability that each effect is at work, the largest: {said}"),
        caption: "Over all sets of names that hold the effect, whatever remains beside them. What is not shown is less probable.".into(),
        x: Axis { range: Some([0.0, 1.0]), ..Axis::of("probability", "") },
        y: Axis { label: "effect".into(), rows, ..Axis::default() },
        at: ordered.iter().map(|p| p.0).collect(),
        series: vec![Series {
            name: "probability".into(),
            ink: Ink::Blue,
            style: Style::Bars,
            values: ordered.iter().map(|p| Some(p.1 as f64)).collect(),
            ..Series::default()
        }],
        ..Plot::default()
    }
}

fn candidates(found: &Diagnosed) -> String {
    let listed = found.candidates.iter().take(LISTED).enumerate();
    let listed = listed.filter(|(k, c)| *k < 2 || c.probability.is_some_and(|p| p >= LIKELY));
    let rows = listed.map(|(_, candidate)| {
        let names = candidate.effects.iter().map(|id| escaped(&words(id))).collect::<Vec<_>>().join("<br>");
        let names = if names.is_empty() { "the base model alone".to_owned() } else { names };
        let coefficients = candidate
            .parameters
            .iter()
            .map(|(id, q)| format!("<code>{}</code> {}", escaped(id), with_half(q.value, q.sd, &q.unit)));
        let coefficients = coefficients.collect::<Vec<_>>().join("<br>");
        let left = (0..candidate.rmse_rad.len())
            .map(|link| milli(&candidate.rmse_rad, link, "mrad"))
            .collect::<Vec<_>>()
            .join(", ");
        vec![names, value(candidate.probability, 3, ""), coefficients, left]
    });
    let unknown = vec!["something not in the table".to_owned(), value(found.verdict.unknown_probability, 3, "")];
    let rows: Vec<Vec<String>> = rows.chain([unknown]).collect();
    "<h3>Explanations that were fitted</h3>\n".to_owned()
        + &table(&["the base model and", "probability", "coefficient ± 1 sd", "left of the angles (rms)"], rows)
}

fn proof(found: &Diagnosed) -> String {
    let Some(heldout) = &found.heldout else { return String::new() };
    let from =
        heldout.from_s.map_or_else(String::new, |s| format!("Fitted before {s:.2} s, predicted from there on. "));
    let rows = (0..heldout.baseline_rmse_rad.len()).map(|link| {
        let mut row = vec![
            format!("θ{}", link + 1),
            milli(&found.baseline.noise_rad, link, "mrad"),
            milli(&heldout.baseline_rmse_rad, link, "mrad"),
            milli(&heldout.named_rmse_rad, link, "mrad"),
        ];
        if found.verdict.law.is_some() {
            row.push(milli(&heldout.augmented_rmse_rad, link, "mrad"));
        }
        row
    });
    let headings =
        ["angle", "noise (1 sd)", "base model leaves", "with the effects named", "with the law that was learnt"];
    let headings = if found.verdict.law.is_some() { &headings[..] } else { &headings[..4] };
    format!(
        "<h3>Proof: the prediction of what was not fitted</h3>\n{}{}",
        paragraph(&format!("{from}Any fit improves with more parameters; a prediction does not.")),
        table(headings, rows)
    )
}

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

fn swing(left: &Left, found: &Diagnosed, curves: &Curves, link: usize) -> Plot {
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
    Plot {
        id: format!("before-after-{link}"),
        title: format!("θ{link} before and after"),
        alternative: format!("Measured θ{link}, the base model and the model with what was missing, against time"),
        caption: "The last swings that stand clear of the noise; on the screen a double click shows all.".into(),
        x: Axis { first: end_of_swing(left, found, curves), ..Axis::of("t", "s") },
        y: Axis::of("angle", "rad"),
        series,
        ..in_time(curves)
    }
}

fn before_and_after(found: &Diagnosed, curves: &Curves, link: usize) -> Plot {
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
        caption: "Measured less predicted. Right of the line nothing was fitted.".into(),
        y: Axis::of("residual", "mrad"),
        series: series.collect(),
        ..plot
    }
}

fn remains(remainder: &Remainder) -> String {
    let place =
        [remainder.place.as_ref().map(|p| at(p)), remainder.phase.as_ref().map(|p| format!("in phase with the {p}"))];
    let place: Vec<String> = place.into_iter().flatten().collect();
    let mut html = "<h3>What remains beside the names</h3>\n".to_owned();
    let rows = (0..remainder.rms_rad.len()).map(|link| {
        vec![
            format!("θ{}", link + 1),
            milli(&remainder.rms_rad, link, "mrad"),
            value(remainder.over_noise.get(link).copied().flatten(), 3, ""),
        ]
    });
    let _ = write!(html, "<p>The probability that it is more than noise is {}", value(remainder.present, 3, ""));
    if !place.is_empty() {
        let _ = write!(html, "; it would act {}", escaped(&place.join(", ")));
    }
    if remainder.frequency_hz.is_some() {
        let _ = write!(html, ", strongest at {}", value(remainder.frequency_hz, 4, "Hz"));
    }
    let _ = writeln!(html, ".</p>");
    html + &table(&["angle", "left (rms)", "over the noise"], rows)
}

fn at(place: &str) -> String {
    match place {
        "hinge" => "at the hinge".to_owned(),
        "joint" => "in the joint".to_owned(),
        "air" => "along the strip, as air does".to_owned(),
        "camera" => "in the camera".to_owned(),
        other => other.to_owned(),
    }
}

fn learnt(law: &Law) -> String {
    let others = law.alternatives.iter().map(|a| format!("<code>{}</code>", escaped(&a.formula))).collect::<Vec<_>>();
    let others = if others.is_empty() {
        String::new()
    } else {
        format!("<p class=\"note\">Nearly as well do: {}</p>\n", others.join("; "))
    };
    format!(
        "<h3>The law that was learnt</h3>\n<p>It acts {}: {} ({})</p>\n{others}<p>For the experiment file:</p>\n{}",
        escaped(&at(&law.place)),
        verbatim_copyable(&law.formula),
        escaped(&law.unit),
        verbatim(&law.toml)
    )
}

fn limits(found: &Diagnosed) -> String {
    if found.detectable.is_empty() {
        return String::new();
    }
    let never = |v: Option<f64>, unit: &str| v.map_or_else(|| "never".to_owned(), |v| value(Some(v), 2, unit));
    let rows = found.detectable.iter().map(|(id, d)| {
        vec![
            escaped(&words(id)),
            never(d.smallest, &d.unit),
            never(d.named_from, &d.unit),
            escaped(&d.confused_with.join(", ")),
        ]
    });
    let rows = table(&["effect", "would have been seen from", "named from", "not told from"], rows);
    format!("<details><summary>What this recording could have shown</summary>\n{rows}</details>\n")
}

/// The map of where the mismatch lives.
pub fn places(left: &Left) -> Chapter {
    let mut chapter = Chapter::new("where", "Where the mismatch lives");
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
        title: "Who takes the energy".into(),
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
        title: "What still gains by an unknown torque, place by place".into(),
        alternative: "Gain in log-likelihood that an unknown torque at each place would bring, beside the likeliest names".into(),
        caption: "How much likelier an unknown course in time, or an unknown law, at each place would make the recording beside the likeliest names. Near zero: nothing is left there.".into(),
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

    #[test]
    fn the_border_is_the_first_row_that_was_predicted() {
        assert_eq!(border_s(&Curves::parse("t_s,predicted\n0,0\n1,0\n2,1\n3,1\n")), Some(2.0));
        assert_eq!(border_s(&Curves::parse("t_s,predicted\n0,0\n")), None);
    }
}
