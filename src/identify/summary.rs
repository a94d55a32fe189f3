//! The answer in one line.

use super::Identification;
use super::abrupt::AbruptChange;
use super::damping::Damping;
use super::estimate::Estimate;
use super::mode::Mode;
use crate::series::Measured;

/// An amplitude below this is a small one (judgement: 10°, at which a pendulum swings slower by two parts in a thousand).
const SMALL_RAD: f64 = 0.1745;
/// How the note begins that says why there is no mode.
pub(super) const NOTHING: &str = "no oscillation is identifiable: ";

/// Each mode's frequency and ξ, the strongest first, or why there is none.
pub(super) fn summary(found: &Identification) -> String {
    if found.modes.is_empty() {
        return match found.notes.iter().rev().find(|note| note.starts_with(NOTHING)) {
            Some(reason) => {
                format!("not identifiable: {}", reason.trim_start_matches(NOTHING))
            }
            None => "not identifiable".to_owned(),
        };
    }
    let modes: Vec<String> = found.modes.iter().map(of_mode).collect();
    let missing = found.spectrum.missing_share;
    let gaps = (missing > 0.5).then(|| format!("{:.0} % of the record is missing", 100.0 * missing));
    let doubt = gaps.or_else(|| found.record.doubt()).or_else(|| found.modes.iter().find_map(Mode::doubt));
    let doubts = doubt.map(|doubt| format!(" — {doubt}"));
    let floor = found.floor.iter().filter(|f| f.below).map(|f| format!(" — {}", f.statement));
    let held = found.held_until_s.map(|held_s| {
        format!(" — held still until t = {held_s:.2} s; only what follows is used, as with `--from {held_s:.2}`")
    });
    let rest = found.rests_from_s.map(|rest_s| {
        format!(" — caught, or at rest, from t = {rest_s:.2} s on; only what precedes is used, as with `--until {rest_s:.2}`")
    });
    let changed = (!found.abrupt_changes.is_empty()).then(|| format!(" — {}", changes(found)));
    let part = found.tumbling.iter().map(|t| format!(" — {}", t.statement));
    modes.join("; ")
        + &held.into_iter().chain(rest).chain(changed).chain(part).chain(doubts).chain(floor).collect::<String>()
}

/// When the swing changes at once, and what of it is used.
fn changes(found: &Identification) -> String {
    let one = |change: &AbruptChange| change.statement(found.record.measured);
    let each: Vec<String> = found.abrupt_changes.iter().map(one).collect();
    let [from_s, until_s] = found.used_s;
    // where no part is a swing of its own, all is used
    let is_part = found.abrupt_changes.iter().all(|change| change.t_s <= from_s || change.t_s >= until_s);
    let used = if is_part {
        format!("; only {from_s:.2} to {until_s:.2} s is used, as with `--from {from_s:.2} --until {until_s:.2}`")
    } else {
        String::new()
    };
    format!("{}{used}", each.join("; "))
}

fn of_mode(mode: &Mode) -> String {
    let index: String =
        mode.number.to_string().chars().filter_map(|c| char::from_u32(0x2080 + c.to_digit(10)?)).collect();
    let f = rounded(&mode.frequency_hz, 1.0);
    let damping = match &mode.damping {
        Damping::Identified(xi) => match mode.damping_trend {
            Some(trend) => {
                let [low, high] = [xi.low, xi.high].map(|end| significant(100.0 * end));
                format!("ξ{index} = {low} to {high} % over the record, {}", trend.words())
            }
            None => {
                let at = mode.seen_down_to_rad.map_or(String::new(), |rad| seen_down_to(rad, mode.measured));
                format!("ξ{index} = {} %{at}", rounded(xi, 100.0))
            }
        },
        Damping::NotIdentifiable { reason, .. } => format!("ξ{index} not identifiable ({reason})"),
    };
    let at = mode.frequency_at_amplitude_rad;
    let at = at.map_or(String::new(), |rad| {
        let digits = if mode.measured.shown(rad) < 1.0 { 2 } else { 0 };
        format!(" at an amplitude of {}", mode.measured.show(rad, digits))
    });
    format!("f{index} = {f} Hz{at}, {damping}")
}

/// `value ± half` with two digits of the half width; of an interval that reaches farther to one side, that side.
fn rounded(estimate: &Estimate, factor: f64) -> String {
    let widest = (estimate.high - estimate.value).max(estimate.value - estimate.low);
    let (value, half) = (factor * estimate.value, factor * widest);
    if value.abs() < 1e-4 {
        return format!("{value:.2e} ± {half:.0e}");
    }
    let digits = if half > 0.0 { (1.0 - half.log10().floor()).clamp(0.0, 9.0) as usize } else { 6 };
    format!("{value:.digits$} ± {half:.digits$}")
}

/// Where a constant ξ was seen.
fn seen_down_to(last_rad: f64, measured: Measured) -> String {
    if measured == Measured::Displacement || last_rad < SMALL_RAD {
        return " at small amplitude".to_owned();
    }
    format!(" at amplitudes down to {}", measured.show(last_rad, 0))
}

/// Two significant digits.
fn significant(value: f64) -> String {
    let digits = if value > 0.0 { (1.0 - value.log10().floor()).clamp(0.0, 9.0) as usize } else { 2 };
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_printed_to_two_digits_of_its_uncertainty() {
        let e = Estimate { value: 1.360_04, sd: 0.0002, low: 1.359_64, high: 1.360_44 };
        assert_eq!(rounded(&e, 1.0), "1.36004 ± 0.00040");
        assert_eq!(rounded(&Estimate { value: 0.012, sd: 0.002, low: 0.008, high: 0.016 }, 100.0), "1.20 ± 0.40");
    }
}
