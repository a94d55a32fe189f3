//! Displacement over power, as the paper's Fig. 20.

use crate::force::{Force, Row};
use crate::report::plot::{Axis, Ink, Plot, Series, Style};

/// The sweep's first distance: the push of both models, heat, and both.
pub fn of_sweep(force: &Force) -> Plot {
    let rows: Vec<&Row> = force.sweep.iter().filter(|row| row.distance_m == force.sweep[0].distance_m).collect();
    let um = |of: fn(&Row) -> Option<f64>| rows.iter().map(|row| of(row).map(|m| 1e6 * m)).collect::<Vec<_>>();
    let series = |name: &str, ink: Ink, style: Style, of: fn(&Row) -> Option<f64>| Series {
        name: name.to_owned(),
        ink,
        style,
        values: um(of),
        ..Series::default()
    };
    let all = vec![
        series("push, multibody", Ink::Green, Style::Dashed, |row| row.point.multibody_m),
        series("push, strip", Ink::Blue, Style::Line, |row| Some(row.point.strip_m)),
        series("heat", Ink::Vermillion, Style::Line, |row| row.point.heat_m),
        series("push and heat", Ink::Ink, Style::Line, |row| row.point.heat_m.map(|_| row.point.total_m)),
    ];
    let place_mm = 1e3 * force.sweep[0].point.s_m;
    Plot {
        id: "force".to_owned(),
        title: format!("{}, {place_mm:.0} mm below the hinge, lamp at {} m", force.specimen, force.sweep[0].distance_m),
        alternative: "Displacement over the lamp's power, by the push of light and by its heat.".to_owned(),
        x: Axis::of("power", "W"),
        y: Axis::of("displacement", "µm"),
        at: rows.iter().map(|row| row.power_w).collect(),
        series: all.into_iter().filter(|s| s.values.iter().any(Option::is_some)).collect(),
        ..Plot::default()
    }
}
