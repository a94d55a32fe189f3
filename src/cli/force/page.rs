//! What `freeswing force` prints.

use std::fmt::Write;

use crate::cli::table::{Table, number, paragraph, setting};
use crate::experiment::Support;
use crate::force::plan::Way;
use crate::force::{Force, Plan, Row, Setup};
use crate::paper::published::MATERIALS;

/// Multibody and strip agree within this where both hold.
const AGREE: f64 = 0.02;

/// All of it.
pub fn force_text(setup: &Setup, force: &Force) -> String {
    let mut text = format!(
        "{}: {} W at {} m, {} W/m² at the strip, a push of {} N ({} of its weight)\n",
        force.specimen,
        setting(force.power_w),
        setting(force.distance_m),
        number(force.flux_w_m2, 4),
        number(force.force_n, 4),
        number(force.force_n / force.weight_n, 2),
    );
    points(force, &mut text);
    if force.sweep.len() > 1 {
        sweep(force, &mut text);
    }
    errors(force, &mut text);
    text.push('\n');
    for statement in statements(setup, force) {
        text.push_str(&paragraph("  – ", &statement));
    }
    text
}

fn um(metres: Option<f64>) -> String {
    metres.map_or_else(|| "–".to_owned(), |m| if m.abs() < 1e-15 { "0".to_owned() } else { number(1e6 * m, 4) })
}

fn points(force: &Force, text: &mut String) {
    let _ = writeln!(text, "\nDisplacement along the light, µm");
    let headings = ["below the hinge", "push, multibody", "push, strip", "heat", "gradient", "layer", "recoil", "all"];
    let mut table = Table::new(headings);
    for p in &force.points {
        table.row([
            format!("{} mm", number(1e3 * p.s_m, 4)),
            um(p.multibody_m),
            um(Some(p.strip_m)),
            um(p.heat_m),
            um(p.gradient_m),
            um(p.coating_m),
            um(p.recoil_m),
            um(Some(p.total_m)),
        ]);
    }
    text.push_str(&table.text());
}

fn sweep(force: &Force, text: &mut String) {
    let place_mm = number(1e3 * force.sweep[0].point.s_m, 4);
    let _ = writeln!(text, "\nBy power and distance, {place_mm} mm below the hinge, µm");
    let mut table =
        Table::new(["power", "distance", "W/m²", "push, N", "film", "push, multibody", "push, strip", "heat", "all"]);
    for row in &force.sweep {
        let p = &row.point;
        table.row([
            format!("{} W", setting(row.power_w)),
            format!("{} m", setting(row.distance_m)),
            number(row.flux_w_m2, 4),
            number(row.force_n, 4),
            row.temperature_k.map_or_else(|| "–".to_owned(), |kelvin| format!("{kelvin:.1} K")),
            um(p.multibody_m),
            um(Some(p.strip_m)),
            um(p.heat_m),
            um(Some(p.total_m)),
        ]);
    }
    text.push_str(&table.text());
}

/// The two models of the push against push and heat together, as the paper's Table 4 has them against its measurement.
fn errors(force: &Force, text: &mut String) {
    if force.heat.is_none() {
        return;
    }
    let _ =
        writeln!(text, "\nWhat a model without heat misses, % of all (the paper's Table 4 where it has the number)");
    let mut table = Table::new(["power", "distance", "multibody", "strip", "paper, multibody", "paper, FE"]);
    for row in &force.sweep {
        let error = |model_m: f64| format!("{:+.2}", 100.0 * (model_m / row.point.total_m - 1.0));
        let [multibody, elements] = published(&force.specimen, row);
        let printed = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |v| format!("{:+.2}", 100.0 * v));
        table.row([
            format!("{} W", setting(row.power_w)),
            format!("{} m", setting(row.distance_m)),
            row.point.multibody_m.map_or_else(|| "–".to_owned(), error),
            error(row.point.strip_m),
            printed(multibody),
            printed(elements),
        ]);
    }
    text.push_str(&table.text());
}

/// The paper's numbers for its own specimens and powers.
fn published(specimen: &str, row: &Row) -> [Option<f64>; 2] {
    let material = MATERIALS.iter().find(|material| material.name.eq_ignore_ascii_case(specimen));
    let power = crate::paper::published::POWERS_W.iter().position(|power_w| *power_w == row.power_w);
    match (material, power) {
        (Some(material), Some(k)) => [Some(material.multibody_error[k]), Some(material.finite_element_error[k])],
        _ => [None, None],
    }
}

fn statements(setup: &Setup, force: &Force) -> Vec<String> {
    let Some(own) = force.points.iter().find(|p| p.s_m == setup.sensor_m()) else { return Vec::new() };
    let mut statements = Vec::new();
    let place_mm = number(1e3 * own.s_m, 4);
    match (own.heat_m, &force.heat) {
        (Some(heat_m), Some(times)) => {
            let ratio = (heat_m / own.strip_m).abs();
            let (larger, factor) = if ratio >= 1.0 { ("heat", ratio) } else { ("the push", 1.0 / ratio) };
            let against = if heat_m * own.strip_m < 0.0 { ", against the push" } else { "" };
            statements.push(format!(
                "{place_mm} mm below the hinge the push moves the strip by {} µm, and heat by {} µm{against}: {larger} is the larger, {} times.",
                um(Some(own.strip_m)),
                um(Some(heat_m)),
                number(factor, 3)
            ));
            statements.push(format!(
                "The gradient through the thickness is established after {} ms, and so is its curl: no record can separate it from the push by time. A layer's curl and the \
                 recoil follow the film's temperature, with a time constant of {} s; the strip swings at {} Hz.",
                number(1e3 * times.through_thickness_s, 2),
                number(times.time_constant_s, 3),
                number(force.first_mode_hz, 4)
            ));
            if !times.assumed.is_empty() {
                statements.push(format!("Typical of the film, not stated in the file: {}.", times.assumed.join(", ")));
            }
            statements.push(
                "Left out: conduction along the strip, its curl across, and light that other things send back."
                    .to_owned(),
            );
        }
        _ => statements.push("Heat is not computed: the file has no [heat].".to_owned()),
    }
    statements.push(models(setup, force, own.multibody_m, own.strip_m));
    statements
}

/// Whether the two models of the push agree, and why not.
fn models(setup: &Setup, force: &Force, multibody_m: Option<f64>, strip_m: f64) -> String {
    let layer_mm = number(1e3 * setup.strip.boundary_layer_m(), 2);
    let Some(multibody_m) = multibody_m else {
        return format!(
            "The strip is clamped, and the chain of links can only hang from a hinge: a clamp bends the strip over {layer_mm} mm below it, of {} mm.",
            number(1e3 * setup.strip.length_m, 4)
        );
    };
    let off = multibody_m / strip_m - 1.0;
    if off.abs() <= AGREE {
        let percent = if off.abs() < 1e-4 { "0.01".to_owned() } else { number(100.0 * off.abs(), 2) };
        return format!("Multibody and strip agree on the push within {percent} %.");
    }
    let why = if setup.strip.curl_per_m != 0.0 {
        "the strip is curled at rest and the chain is straight".to_owned()
    } else if setup.experiment.rig.support == Support::Hinged
        && setup.experiment.rig.support_stiffness_n_m_per_rad > 0.0
    {
        format!(
            "the hinge's spring bends the strip over {layer_mm} mm below it, which the chain's first link cannot follow"
        )
    } else if setup.light.spot_diameter_m.is_some() {
        "a spot bends the strip, and the chain only at its joints".to_owned()
    } else {
        "the chain's joint is stiffer or softer than the strip is in bending".to_owned()
    };
    let more = if off > 0.0 { "more" } else { "less" };
    let percent = number(100.0 * off.abs(), 3);
    format!(
        "The multibody model moves by {percent} % {more} than the strip: {why} ({} N push).",
        number(force.force_n, 3)
    )
}

/// The sensor cannot tell a displacement of the sweep.
pub fn out_of_range(setup: &Setup, force: &Force) -> Option<String> {
    let [low, high] = setup.experiment.laser.as_ref()?.range_m?;
    let row = force.sweep.iter().find(|row| !(low..=high).contains(&row.point.total_m))?;
    Some(format!(
        "at {} W and {} m the strip moves by {} µm, beyond laser.range_m = [{low:e}, {high:e}]",
        setting(row.power_w),
        setting(row.distance_m),
        um(Some(row.point.total_m))
    ))
}

/// What an experiment needs.
pub fn plan_text(plan: &Plan) -> String {
    let mut text = format!(
        "{} W at {} m; a sensor of {} µm a sample at {} Hz; {} s; ξ = {}; first mode {} Hz\n",
        setting(plan.power_w),
        setting(plan.distance_m),
        number(1e6 * plan.noise_m, 3),
        setting(plan.rate_hz),
        setting(plan.time_s),
        number(plan.damping_ratio, 3),
        number(plan.first_mode_hz, 4)
    );
    let percent = number(100.0 * plan.wanted_relative_interval, 3);
    let _ = writeln!(text, "\nTo know the push within ± {percent} % (95 %)");
    let mut table = Table::new(["", "push, µm", "heat / push", "reached, ± %", "least power", "least time"]);
    let mut row = |name: &str, way: &Way| {
        table.row([
            name.to_owned(),
            um(Some(way.push_m)),
            number(way.heat_over_push, 3),
            number(100.0 * way.relative_interval, 3),
            format!("{} W", number(way.smallest_power_w, 3)),
            format!("{} s", number(way.shortest_time_s, 3)),
        ]);
    };
    row("long on, long off", &plan.steps);
    row("chopped at the first mode", &plan.chopped);
    text.push_str(&table.text());
    text.push('\n');
    text.push_str(&paragraph(
        "  – ",
        &format!(
            "Chopping at the strip's own frequency raises signal over noise {} times in the same time. The {} s after each switching are not used, until the swing has built up or died away to a tenth; the least time holds it once for chopping, twice for one on and off.",
            number(plan.gain, 3),
            number(plan.chopped.settling_s, 3)
        ),
    ));
    text.push_str(&paragraph("  – ", &heat_words(plan)));
    text.push_str(&paragraph(
        "  – ",
        "The sensor's white noise alone is counted. Drift, swings from outside and a damping ratio that is not well known come on top; the amplitude of a \
         chopped swing is known no better than the damping.",
    ));
    text
}

fn heat_words(plan: &Plan) -> String {
    let (steps, chopped) = (plan.steps.heat_over_push.abs(), plan.chopped.heat_over_push.abs());
    if steps == 0.0 {
        return "Heat is not computed: the file has no [heat].".to_owned();
    }
    let (long, short) = (number(steps, 3), number(chopped, 3));
    if chopped < 0.9 * steps {
        format!(
            "Heat is {long} times the push when the lamp is long on, and {short} times when it is chopped: a curl hardly drives a mode that hardly bends, and what \
             follows the temperature cannot keep up."
        )
    } else {
        format!(
            "Chopping does not lessen heat ({short} times the push, {long} when the lamp is long on): the curl of the gradient is there at once, and this mode \
             bends."
        )
    }
}
