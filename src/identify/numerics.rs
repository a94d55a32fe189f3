//! A step of an ordinary differential equation, and a Jacobian by differences.

use nalgebra::{DMatrix, DVector};

/// The state after a step, by Runge and Kutta's method of the fourth order.
pub(super) fn runge_kutta<const N: usize>(
    state: [f64; N],
    step_s: f64,
    slope: impl Fn([f64; N]) -> [f64; N],
) -> [f64; N] {
    let along = |k: [f64; N], part_s: f64| std::array::from_fn(|i| state[i] + part_s * k[i]);
    let k1 = slope(state);
    let k2 = slope(along(k1, 0.5 * step_s));
    let k3 = slope(along(k2, 0.5 * step_s));
    let k4 = slope(along(k3, step_s));
    std::array::from_fn(|i| state[i] + step_s / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
}

/// Step of parameters of the order of 1.
const STEP: f64 = 1e-5;

/// The derivatives of some values with each parameter, by central differences.
pub(super) fn central_differences(
    parameters: &DVector<f64>,
    values: impl Fn(&DVector<f64>) -> Option<DVector<f64>>,
) -> Option<DMatrix<f64>> {
    let column = |k: usize| {
        let moved = |by: f64| {
            let mut parameters = parameters.clone();
            parameters[k] += by;
            values(&parameters)
        };
        Some((moved(STEP)? - moved(-STEP)?) / (2.0 * STEP))
    };
    let columns: Vec<DVector<f64>> = (0..parameters.len()).map(column).collect::<Option<_>>()?;
    Some(DMatrix::from_columns(&columns))
}
