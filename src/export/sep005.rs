//! SEP 005 of the SDyPy project, *Time series*: a list of channels, each with name, unit, data and times.

use serde::Serialize;

use super::{Column, Values};

/// A channel.
#[derive(Debug, Serialize)]
struct Channel<'c> {
    name: &'c str,
    unit_str: &'static str,
    /// Missing values are null.
    data: Vec<Option<f64>>,
    /// Seconds; a recording's own stamps, which need not be even.
    time: &'c [f64],
}

/// The file; columns of words are left out.
pub fn bytes(columns: &[Column]) -> Vec<u8> {
    let time = columns.iter().find(|column| column.name == "t_s");
    let time = time.map_or(&[][..], |column| match &column.values {
        Values::Numbers(numbers) => numbers,
        Values::Texts(_) => &[],
    });
    let channel = |column: &'_ Column| match &column.values {
        Values::Numbers(numbers) if column.name != "t_s" => Some((column.name.clone(), numbers.clone())),
        _ => None,
    };
    let channels: Vec<(String, Vec<f64>)> = columns.iter().filter_map(channel).collect();
    let channels: Vec<Channel<'_>> = channels
        .iter()
        .map(|(name, numbers)| Channel {
            name,
            unit_str: unit(name),
            data: numbers.iter().map(|value| value.is_finite().then_some(*value)).collect(),
            time,
        })
        .collect();
    // numbers and strings serialise
    serde_json::to_vec_pretty(&channels).unwrap_or_default()
}

/// The unit at the end of a column's name.
fn unit(name: &str) -> &'static str {
    [("_rad_s", "rad/s"), ("_rad", "rad"), ("_px", "px"), ("_mm", "mm"), ("_um", "um"), ("_m", "m"), ("_s", "s")]
        .into_iter()
        .find(|(end, _)| name.ends_with(end))
        .map_or("-", |(_, unit)| unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_channel_has_its_unit_and_the_times() {
        let column =
            |name: &str, values: &[f64]| Column { name: name.to_owned(), values: Values::Numbers(values.to_vec()) };
        let file = bytes(&[column("t_s", &[0.0, 0.1]), column("theta1_rad", &[0.5, f64::NAN])]);
        let read: serde_json::Value = serde_json::from_slice(&file).unwrap();
        let wanted =
            serde_json::json!([{"name": "theta1_rad", "unit_str": "rad", "data": [0.5, null], "time": [0.0, 0.1]}]);
        assert_eq!(read, wanted);
    }
}
