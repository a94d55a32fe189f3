//! What every method says of a mode, side by side.

use crate::report::html::list;
use crate::report::left::{Estimator, Mode};
use crate::report::plot::{Axis, Ink, Plot, Series, Style};

/// Why some method gives no number.
pub(super) fn refusals(mode: &Mode) -> String {
    let notes = mode.estimators.iter().filter_map(|e| Some(format!("{}: {}", method(e), e.note.as_ref()?)));
    list("notes", notes.collect::<Vec<_>>())
}

fn method(estimator: &Estimator) -> String {
    match estimator.method.as_str() {
        "half_power" => "half-power bandwidth".to_owned(),
        "decrement" => "logarithmic decrement".to_owned(),
        "sinusoids" => "damped sinusoids".to_owned(),
        "envelope" => "envelope, at small amplitude".to_owned(),
        "modulated" => "slow flow, at small amplitude".to_owned(),
        "spectrum" => "peak of the spectrum".to_owned(),
        other => other.to_owned(),
    }
}

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Quantity {
    Frequency,
    Damping,
}

/// Every method's value with its interval on one axis, the one that is taken among them.
pub(super) fn estimators(mode: &Mode, quantity: Quantity) -> Plot {
    let is_frequency = quantity == Quantity::Frequency;
    let of = |e: &Estimator| if is_frequency { e.frequency_hz } else { e.damping_ratio };
    let taken = if is_frequency { Some(mode.frequency_hz) } else { mode.damping.identified };
    let taken = taken.filter(|t| t.value.is_some());
    let rows: Vec<String> = mode.estimators.iter().map(method).chain(taken.map(|_| "result".to_owned())).collect();
    let mut points: Vec<(f64, usize, Option<[f64; 2]>)> = mode
        .estimators
        .iter()
        .map(of)
        .chain([taken])
        .enumerate()
        .filter_map(|(row, e)| {
            let e = e?;
            Some((e.value?, row + 1, e.low.zip(e.high).map(|(low, high)| [low, high])))
        })
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let agree = if is_frequency { &mode.frequency_consistency } else { &mode.damping_consistency };
    let agree = match agree.as_ref().map(|c| c.agree) {
        Some(true) => "The methods agree.",
        Some(false) => {
            "The methods disagree: no one number describes the record, as each of them weighs amplitudes in its own way."
        }
        None => "",
    };
    let (name, axis) = if is_frequency {
        ("frequency", Axis::of("frequency", "Hz"))
    } else {
        ("damping", Axis::of("damping ratio ξ", ""))
    };
    let said = points
        .iter()
        .map(|(v, row, _)| format!("{} {}", rows[row - 1], crate::digits::number(*v, 5)))
        .collect::<Vec<_>>()
        .join("; ");
    Plot {
        id: format!("estimators-{name}-{}", mode.number),
        title: format!(
            "Every estimate of the {}, mode {}",
            if is_frequency { "frequency" } else { "damping ratio" },
            mode.number
        ),
        alternative: format!("Estimates with 95 % intervals: {said}"),
        caption: format!("{agree} A row without a point gives no number."),
        x: axis,
        y: Axis { label: "method".into(), rows, ..Axis::default() },
        at: points.iter().map(|p| p.0).collect(),
        series: vec![Series {
            name: "estimate".into(),
            ink: Ink::Blue,
            style: Style::Interval,
            values: points.iter().map(|p| Some(p.1 as f64)).collect(),
            ends: points.iter().map(|p| p.2).collect(),
        }],
        ..Plot::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::left::Interval;

    #[test]
    fn the_estimates_stand_on_one_axis_in_the_order_of_the_methods() {
        let one = |value: f64| {
            Some(Interval { value: Some(value), sd: None, low: Some(value - 0.1), high: Some(value + 0.1) })
        };
        let estimator = |method: &str, f| Estimator { method: method.into(), frequency_hz: f, ..Estimator::default() };
        let mode = Mode {
            number: 1,
            frequency_hz: one(1.5).unwrap(),
            estimators: vec![estimator("spectrum", one(2.0)), estimator("half_power", None)],
            ..Mode::default()
        };
        let plot = estimators(&mode, Quantity::Frequency);
        assert_eq!(plot.y.rows, ["peak of the spectrum", "half-power bandwidth", "result"]);
        assert_eq!((plot.at, plot.series[0].values.clone()), (vec![1.5, 2.0], vec![Some(3.0), Some(1.0)]));
    }
}
