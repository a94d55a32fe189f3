//! A minute's swing of two rods, seen at 30 frames a second, with its derivatives in seven directions (K, C, c of the hinge, both angles and
//! rates at the start): the model's integrator against the library that is its oracle, at equal measured accuracy.
//!
//! Each runs at the loosest tolerance that keeps all angles within 1e-7 rad of a reference (the model's integrator at 1e-14, itself held
//! against the library at 1e-13), the library with each of its methods and with or without control of the derivatives' error; its fastest
//! counts. Then both run in turn.

#[path = "../tests/library/mod.rs"]
mod library;

use std::time::Instant;

use freeswing::model::Accuracy;
use library::{Method, Swing, Tolerance, TwoRods};

const ERROR_RAD: f64 = 1e-7;
const ROUNDS: usize = 9;
/// A setting slower than this is given up.
const PATIENCE_S: f64 = 20.0;

/// A setting that is exact enough.
struct Setting<T> {
    setting: T,
    seconds: f64,
    error_rad: f64,
    /// Largest error of a derivative, as a part of its largest value.
    slope_error: f64,
}

fn main() {
    let times_s: Vec<f64> = (1..=1800).map(|i| f64::from(i) / 30.0).collect();
    let rods =
        |k: f64, c: f64| TwoRods { values: [k, c, 1e-7, 0.5, 0.7, 0.0, 0.0], air_quadratic: 0.0, hysteresis: None };
    let implicit = [Method::Bdf, Method::Esdirk34];
    compare(
        "soft joint, K = 2e-4, C = 1e-6",
        &rods(2e-4, 1e-6),
        &[Method::Tsit45, Method::Bdf, Method::Esdirk34],
        &times_s,
    );
    compare("Table 2, K = 0.0251, C = 2.652e-4", &rods(0.0251, 2.652e-4), &implicit, &times_s);
    compare("stiff joint, K = 1, C = 1e-3", &rods(1.0, 1e-3), &implicit, &times_s);
}

fn compare(name: &str, rods: &TwoRods, methods: &[Method], times_s: &[f64]) {
    let reference = rods.swing_by_the_model(&accuracy(1e-14), times_s);
    let tight = Tolerance { of_state: 1e-13, of_slopes: None };
    match rods.swing(methods[0], tight, times_s) {
        Ok(library) => println!("{name}: references agree to {:.0e} rad", reference.differences(&library).0),
        Err(error) => println!("{name}: the library at 1e-13: {error}"),
    }
    let own = loosest(&reference, &|tolerance| Some(rods.swing_by_the_model(&accuracy(tolerance), times_s)));
    let own = own.expect("the model reaches 1e-7 rad");
    println!(
        "  model {:.1e}: {:.1} ms, {:.0e} rad, derivatives to {:.0e}",
        own.setting,
        1e3 * own.seconds,
        own.error_rad,
        own.slope_error
    );
    let mut fastest: Option<(Method, Setting<Tolerance>)> = None;
    for (method, watched) in methods.iter().flat_map(|method| [(*method, false), (*method, true)]) {
        let with = |of_state: f64| Tolerance { of_state, of_slopes: watched.then_some(1e2 * of_state) };
        let Some(found) = loosest(&reference, &|tolerance| rods.swing(method, with(tolerance), times_s).ok()) else {
            println!("  {method:?}, derivatives watched: {watched}: not within {ERROR_RAD:.0e} rad in {PATIENCE_S} s");
            continue;
        };
        let Setting { setting, seconds, error_rad, slope_error } = found;
        println!(
            "  {method:?} {setting:.1e}, derivatives watched: {watched}: {:.1} ms, {error_rad:.0e} rad, derivatives to {slope_error:.0e}",
            1e3 * seconds
        );
        if fastest.as_ref().is_none_or(|(_, best)| seconds < best.seconds) {
            fastest = Some((method, Setting { setting: with(setting), seconds, error_rad, slope_error }));
        }
    }
    let Some((method, library)) = fastest else { return println!("  the library has no setting that is exact enough") };
    let mut ratios: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let own_s = seconds(|| rods.swing_by_the_model(&accuracy(own.setting), times_s)).0;
            seconds(|| rods.swing(method, library.setting, times_s)).0 / own_s
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    println!(
        "  {method:?} / model: {:.1} ({:.1} to {:.1} in {ROUNDS} rounds)",
        ratios[ROUNDS / 2],
        ratios[0],
        ratios[ROUNDS - 1]
    );
}

fn accuracy(step_error_rad: f64) -> Accuracy {
    Accuracy { step_error_rad, ..Accuracy::default() }
}

/// The loosest tolerance from 1e-5 to 1e-13, in steps of √10, that is exact enough.
fn loosest(reference: &Swing, swing: &dyn Fn(f64) -> Option<Swing>) -> Option<Setting<f64>> {
    for step in 10..=26 {
        let setting = 10f64.powf(-0.5 * f64::from(step));
        let (seconds, swing) = seconds(|| swing(setting));
        if let Some((error_rad, slopes)) = swing.map(|swing| swing.differences(reference))
            && error_rad <= ERROR_RAD
        {
            return Some(Setting { setting, seconds, error_rad, slope_error: slopes.into_iter().fold(0.0, f64::max) });
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
