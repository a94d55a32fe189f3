//! A minute's swing of two rods, seen at 30 frames a second, with its derivatives in seven directions (K, C, c of the hinge, both angles and
//! rates at the start): the model's integrator against the library that is its oracle, at equal measured accuracy.
//!
//! Each runs at the loosest tolerance that keeps all angles within 1e-7 rad of a reference (the model's integrator at 1e-14, itself held
//! against the library at 1e-13), the library with or without control of the derivatives' error, whichever is faster. Then both run in turn;
//! stated is the median of the ratios.

#[path = "../tests/library/mod.rs"]
mod library;

use std::fmt;
use std::time::Instant;

use freeswing::model::Accuracy;
use library::{Method, Swing, Tolerance, TwoRods};

const ERROR_RAD: f64 = 1e-7;
const ROUNDS: usize = 9;
/// A setting slower than this is given up.
const PATIENCE_S: f64 = 20.0;

/// A setting that is exact enough.
struct Setting {
    tolerance: f64,
    seconds: f64,
    error_rad: f64,
    /// Largest error of a derivative, as a part of its largest value.
    slope_error: f64,
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tolerance, seconds, error_rad, slope_error } = self;
        write!(
            f,
            "{:.1} ms at {tolerance:.1e}, within {error_rad:.0e} rad, derivatives within {slope_error:.0e}",
            1e3 * seconds
        )
    }
}

fn main() {
    let times_s: Vec<f64> = (1..=1800).map(|i| f64::from(i) / 30.0).collect();
    for (name, k, c) in [("soft", 2e-4, 1e-6), ("of Table 2", 0.0251, 2.652e-4), ("stiff", 1.0, 1e-3)] {
        let values = [k, c, 1e-7, 0.5, 0.7, 0.0, 0.0];
        println!("{name} joint, K = {k} N m/rad, C = {c} N m s/rad");
        compare(&TwoRods { values, air_quadratic: 0.0, hysteresis: None }, &times_s);
    }
}

fn compare(rods: &TwoRods, times_s: &[f64]) {
    let reference = rods.swing_by_the_model(&accuracy(1e-14), times_s);
    match rods.swing(Method::Bdf, Tolerance { of_state: 1e-13, of_slopes: None }, times_s) {
        Ok(library) => println!("  the references agree to {:.0e} rad", reference.differences(&library).0),
        Err(error) => println!("  no second reference: {error}"),
    }
    let own = loosest(&reference, &|tolerance| Some(rods.swing_by_the_model(&accuracy(tolerance), times_s)));
    let own = own.expect("the model's integrator is exact enough");
    println!("  model:    {own}");
    for method in [Method::Tsit45, Method::Bdf, Method::Esdirk34] {
        let with = |of_state: f64, watched: bool| Tolerance { of_state, of_slopes: watched.then_some(1e2 * of_state) };
        let found = [false, true].map(|watched| {
            let found = loosest(&reference, &|tolerance| rods.swing(method, with(tolerance, watched), times_s).ok());
            found.map(|found| (with(found.tolerance, watched), found))
        });
        let Some((setting, found)) = found.into_iter().flatten().min_by(|a, b| a.1.seconds.total_cmp(&b.1.seconds))
        else {
            println!("  {method:?}: not within {ERROR_RAD:.0e} rad in {PATIENCE_S} s");
            continue;
        };
        let rounds = if found.seconds < 1.0 { ROUNDS } else { 1 };
        let mut ratios: Vec<f64> = (0..rounds)
            .map(|_| {
                let own_s = seconds(|| rods.swing_by_the_model(&accuracy(own.tolerance), times_s)).0;
                seconds(|| rods.swing(method, setting, times_s)).0 / own_s
            })
            .collect();
        ratios.sort_by(f64::total_cmp);
        let (median, least, most) = (ratios[rounds / 2], ratios[0], ratios[rounds - 1]);
        println!("  {:<10}{found}; {median:.1} times the model's ({least:.1} to {most:.1})", format!("{method:?}:"));
    }
}

fn accuracy(step_error_rad: f64) -> Accuracy {
    Accuracy { step_error_rad, ..Accuracy::default() }
}

/// The loosest tolerance from 1e-5 to 1e-13, in steps of √10, that is exact enough.
fn loosest(reference: &Swing, swing: &dyn Fn(f64) -> Option<Swing>) -> Option<Setting> {
    for step in 10..=26 {
        let tolerance = 10f64.powf(-0.5 * f64::from(step));
        let (seconds, swing) = seconds(|| swing(tolerance));
        if let Some((error_rad, slopes)) = swing.map(|swing| swing.differences(reference))
            && error_rad <= ERROR_RAD
        {
            return Some(Setting {
                tolerance,
                seconds,
                error_rad,
                slope_error: slopes.into_iter().fold(0.0, f64::max),
            });
        }
        if seconds > PATIENCE_S {
            return None;
        }
    }
    None
}

fn seconds<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let begun = Instant::now();
    let done = work();
    (begun.elapsed().as_secs_f64(), done)
}
