//! The model's own integrator against a library's, equations written out once more: angles and their derivatives.
//!
//! The library runs at tolerances of 1e-11 (state) and 1e-9 (derivatives), which bound its error a step; over thousands of steps that adds up
//! to the differences allowed here: 1e-7 rad, and a millionth of the largest value of each derivative.

mod library;

use freeswing::experiment::Hysteresis;
use freeswing::model::Accuracy;
use library::{Method, Tolerance, TwoRods};

fn agree(what: &str, rods: &TwoRods, method: Method, until_s: f64) {
    let times_s: Vec<f64> = (1..=(30.0 * until_s) as usize).map(|i| i as f64 / 30.0).collect();
    let tolerance = Tolerance { of_state: 1e-11, of_slopes: Some(1e-9) };
    let library = rods.swing(method, tolerance, &times_s).unwrap();
    let own = rods.swing_by_the_model(&Accuracy { step_error_rad: 1e-12, ..Accuracy::default() }, &times_s);
    let (angles_rad, slopes) = own.differences(&library);
    let worst = slopes.into_iter().fold(0.0, f64::max);
    println!("{what}: {angles_rad:.0e} rad; derivatives to {worst:.0e}");
    assert!(angles_rad < 1e-7, "{what}: {angles_rad:e} rad");
    assert!(worst < 1e-6, "{what}: {slopes:?}");
}

fn rods(k: f64, c: f64, hinge: f64) -> TwoRods {
    TwoRods { values: [k, c, hinge, 0.5, 0.7, 0.4, -0.3], air_quadratic: 0.0, hysteresis: None }
}

#[test]
fn a_soft_joint_swings_alike() {
    agree("soft", &rods(2e-4, 2e-6, 1e-6), Method::Tsit45, 10.0);
    agree("soft, another method", &rods(2e-4, 2e-6, 1e-6), Method::Esdirk34, 2.0);
    agree(
        "large",
        &TwoRods { values: [2e-4, 2e-6, 1e-6, 1.8, -1.2, 0.0, 0.0], ..rods(0.0, 0.0, 0.0) },
        Method::Tsit45,
        3.0,
    );
}

#[test]
fn the_joints_of_table_2_swing_alike() {
    agree("Table 2, softest", &rods(0.0251, 2.652e-4, 1e-6), Method::Bdf, 4.0);
    agree("Table 2, stiffest", &rods(0.1162, 4.153e-4, 1e-6), Method::Bdf, 4.0);
}

#[test]
fn a_stiff_joint_swings_alike() {
    agree("K = 1 N m/rad", &rods(1.0, 1e-3, 1e-6), Method::Bdf, 4.0);
}

#[test]
fn quadratic_drag_swings_alike() {
    agree("quadratic drag", &TwoRods { air_quadratic: 2e-2, ..rods(2e-4, 2e-6, 1e-6) }, Method::Tsit45, 10.0);
}

#[test]
fn hysteresis_swings_alike() {
    let hysteresis = Some(Hysteresis { torque_n_m: 3e-6, yield_rad: 0.05 });
    agree("hysteresis", &TwoRods { hysteresis, ..rods(2e-4, 2e-6, 1e-6) }, Method::Tsit45, 10.0);
}
