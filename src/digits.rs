//! Numbers as a person reads them.

/// A number with `digits` significant ones, as a power of ten where it is very small or very large.
pub fn number(value: f64, digits: usize) -> String {
    let magnitude = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    if !(-4..6).contains(&magnitude) {
        return format!("{value:.*e}", digits - 1);
    }
    format!("{value:.*}", (digits as i32 - 1 - magnitude).max(0) as usize)
}

/// A number with so many decimals, without a sign where all its digits are zero.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let is_zero = !text.contains(|c: char| ('1'..='9').contains(&c));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_rounds_to_zero_has_no_sign() {
        assert_eq!([fixed(-0.0004, 3), fixed(-0.0006, 3), fixed(2.0, 0)], ["0.000", "-0.001", "2"]);
    }
}
