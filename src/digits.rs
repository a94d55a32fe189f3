//! Numbers as a person reads them.

/// A number with `digits` significant ones, as a power of ten where it is very small or very large.
pub fn number(value: f64, digits: usize) -> String {
    let magnitude = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    if !(-4..6).contains(&magnitude) {
        return format!("{value:.*e}", digits - 1);
    }
    format!("{value:.*}", (digits as i32 - 1 - magnitude).max(0) as usize)
}
