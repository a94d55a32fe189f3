//! Medians: what is usual, whatever the few exceptions are; and what a p-value is worth.

use std::ops::{Add, Div};

/// The largest probability with which a result of this p-value is no chance, chance being as likely as not before it was seen: 1/(1 + B), B = −e p ln p (T. Sellke,
/// M. J. Bayarri, J. O. Berger, Calibration of p values for testing precise null hypotheses, The American Statistician 55, 2001).
pub fn no_chance(p_value: f64) -> f64 {
    let p_value = p_value.clamp(f64::MIN_POSITIVE, std::f64::consts::E.recip());
    1.0 / (1.0 - std::f64::consts::E * p_value * p_value.ln())
}

/// The middle of the values, of an even number the mean of the two in the middle; `None` of none. The values end up
/// in another order.
pub fn median<T>(values: &mut [T]) -> Option<T>
where
    T: Copy + PartialOrd + Add<Output = T> + Div<Output = T> + From<u8>,
{
    let order = |a: &T, b: &T| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal);
    if values.is_empty() {
        return None;
    }
    let even = values.len().is_multiple_of(2);
    let (below, &mut upper, _) = values.select_nth_unstable_by(values.len() / 2, order);
    let lower = below.iter().copied().max_by(order).filter(|_| even);
    Some(lower.map_or(upper, |lower| (lower + upper) / T::from(2)))
}

/// The usual step between time stamps; `None` where fewer than two are given or time stands still.
pub fn median_step_s(t_s: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = t_s.windows(2).map(|w| w[1] - w[0]).collect();
    median(&mut steps).filter(|step| *step > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle_or_the_mean_of_the_two_in_the_middle() {
        assert_eq!(median(&mut [5.0, 1.0, 3.0]), Some(3.0));
        assert_eq!(median(&mut [4.0f32, 1.0, 9.0, 3.0]), Some(3.5));
        assert_eq!(median::<f64>(&mut []), None);
    }

    #[test]
    fn one_long_gap_does_not_change_the_usual_step() {
        assert_eq!(median_step_s(&[0.0, 0.5, 1.0, 9.0]), Some(0.5));
        assert_eq!(median_step_s(&[1.0, 1.0, 1.0]), None);
        assert_eq!(median_step_s(&[1.0]), None);
    }
}
