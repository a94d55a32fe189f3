//! The strip against answers that are known.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::load::{Dead, Follower, Free};
use super::motion::Motion;
use super::*;
use crate::model::modes::{limp_frequency_hz, rigid_frequency_hz};

/// A beam without weight, L = EI = μ = 1.
fn beam() -> Strip {
    Strip::hung(1.0, 1.0, 1.0, 0.0).clamped()
}

fn kapton() -> Strip {
    Strip::hung(0.2, 1.8034e-3, 1.706_985_8e-7, 9.80665)
}

fn at_rest(strip: &Strip, elements: usize, load: &dyn Load) -> Rest {
    Rest::of(strip, &Mesh::uniform(strip.length_m, elements), load).unwrap()
}

/// Legendre's incomplete integrals F and E, by Simpson's rule.
fn elliptic(phi: f64, k: f64) -> [f64; 2] {
    let steps = 4000;
    let h = phi / f64::from(steps);
    let mut sums = [0.0; 2];
    for i in 0..=steps {
        let root = (1.0 - (k * (h * f64::from(i)).sin()).powi(2)).sqrt();
        let weight = if i == 0 || i == steps {
            1.0
        } else if i % 2 == 1 {
            4.0
        } else {
            2.0
        };
        sums[0] += weight / root * h / 3.0;
        sums[1] += weight * root * h / 3.0;
    }
    sums
}

/// Bisshopp and Drucker's cantilever under a force across its free end: for α² = PL²/EI the tip's [deflection, distance along] over L.
fn elastica(alpha: f64) -> [f64; 2] {
    // K(k) − F(φ₁, k) = α with sin φ₁ = 1/(k√2) rises with k
    let of = |k: f64| {
        let (whole, part) = (elliptic(FRAC_PI_2, k), elliptic((0.5f64.sqrt() / k).asin(), k));
        [whole[0] - part[0], whole[1] - part[1]]
    };
    let (mut low, mut high) = (0.5f64.sqrt(), 1.0 - 1e-12);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if of(middle)[0] < alpha { low = middle } else { high = middle }
    }
    let k = 0.5 * (low + high);
    [1.0 - 2.0 * of(k)[1] / alpha, (2.0 * (2.0 * k * k - 1.0)).sqrt() / alpha]
}

#[test]
fn a_cantilever_under_a_tip_force_is_the_elastica() {
    // the table of Bisshopp and Drucker (1945): PL²/EI = 1 and 10
    for (force, deflection, along) in [(1.0, 0.301_72, 0.943_57), (10.0, 0.810_61, 0.445_00)] {
        let exact = elastica(f64::sqrt(force));
        assert!((exact[0] - deflection).abs() < 2e-5 && (exact[1] - along).abs() < 2e-5, "{exact:?}");
        for (elements, tolerance) in [(20, 1e-4), (100, 1e-7)] {
            let rest = at_rest(&beam(), elements, &Dead { tip_n: [force, 0.0], ..Dead::default() });
            let tip = rest.place_m(1.0);
            let error = (tip[0] - exact[0]).abs().max((tip[1] - exact[1]).abs());
            assert!(error < tolerance, "{elements} elements: {tip:?} {exact:?}");
        }
    }
}

#[test]
fn displacements_converge_with_the_fourth_power_of_an_element() {
    let exact = elastica(10.0f64.sqrt());
    let error = |elements: usize| {
        let rest = at_rest(&beam(), elements, &Dead { tip_n: [10.0, 0.0], ..Dead::default() });
        (rest.place_m(1.0)[0] - exact[0]).abs()
    };
    let order = (error(16) / error(32)).log2();
    assert!((order - 4.0).abs() < 0.1, "order {order}");
}

#[test]
fn frequencies_converge_with_the_fourth_power_of_an_element() {
    let hz = |elements: usize| at_rest(&beam(), elements, &Free).vibration().unwrap().frequencies_hz(2);
    let exact = [1.875_104_068_711_961f64, 4.694_091_132_974_175].map(|root| root * root / TAU);
    let (coarse, fine) = (hz(6), hz(12));
    for mode in 0..2 {
        let order = ((coarse[mode] / exact[mode] - 1.0) / (fine[mode] / exact[mode] - 1.0)).log2();
        assert!((order - 4.0).abs() < 0.1, "mode {mode}: order {order}");
    }
}

#[test]
fn twenty_elements_give_a_tenth_of_a_percent() {
    let hz =
        |strip: &Strip| Rest::of(strip, &Mesh::of(strip, 20), &Free).unwrap().vibration().unwrap().frequencies_hz(3);
    for (mode, root) in [1.875_104_068_711_961, 4.694_091_132_974_175, 7.854_757_438_237_613].iter().enumerate() {
        let exact = root * root / TAU;
        assert!((hz(&beam())[mode] / exact - 1.0).abs() < 1e-3);
    }
    let limp = Strip { bending_stiffness_n_m2: 0.0, ..kapton() };
    for (mode, found) in hz(&limp).into_iter().enumerate() {
        assert!((found / limp_frequency_hz(mode, 0.2, 9.80665) - 1.0).abs() < 1e-3, "{mode} {found}");
    }
    let rigid = Strip { bending_stiffness_n_m2: 1e3, ..kapton() };
    assert!((hz(&rigid)[0] / rigid_frequency_hz(0.2, 9.80665) - 1.0).abs() < 1e-6);
    // its own weight, small: wL⁴/8EI
    let sagging = Strip { gravity_m_s2: 1e-4, support_angle_rad: FRAC_PI_2, ..beam() };
    let sag = at_rest(&sagging, 20, &Free).place_m(1.0)[1];
    assert!((sag / (1e-4 / 8.0) - 1.0).abs() < 1e-3, "{sag}");
    // a moment at the end rolls it into a circle: here as a curl
    let rolled = Strip { curl_per_m: TAU, ..beam() };
    let tip = at_rest(&rolled, 20, &Free).place_m(1.0);
    assert!(tip[0].hypot(tip[1]) < 1e-3, "{tip:?}");
}

#[test]
fn a_hinged_strip_under_pressure_hangs_straight_at_the_ratio_of_force_to_weight() {
    let strip = kapton();
    let push = Dead { per_length_n_m: [1e-7, 0.0], ..Dead::default() };
    let rest = at_rest(&strip, 20, &push);
    let ratio = 1e-7 / (strip.mass_per_length_kg_m * strip.gravity_m_s2);
    assert!((rest.place_m(0.2)[0] / (0.2 * ratio.atan().sin()) - 1.0).abs() < 1e-10);
    assert!((rest.place_m(0.1)[0] / (0.1 * ratio.atan().sin()) - 1.0).abs() < 1e-10);
}

#[test]
fn a_spring_at_the_hinge_lies_between_hinge_and_clamp() {
    let x_m = |support| {
        let strip = Strip { support, ..kapton() };
        at_rest(&strip, 20, &Dead { per_length_n_m: [1e-6, 0.0], ..Dead::default() }).place_m(0.2)[0]
    };
    let spring = |k| Support::Hinged { stiffness_n_m_per_rad: k };
    let found = [x_m(Support::HINGED), x_m(spring(1e-5)), x_m(spring(1e-4)), x_m(spring(1e3)), x_m(Support::Clamped)];
    assert!(found.windows(2).all(|pair| pair[0] > pair[1]), "{found:?}");
    assert!((found[3] / found[4] - 1.0).abs() < 1e-6, "{found:?}");
}

#[test]
fn a_pressure_that_follows_bends_a_cantilever_as_a_dead_one_while_it_is_small() {
    let tip = |load: &dyn Load| at_rest(&beam(), 20, load).place_m(1.0);
    let dead = |p: f64| Dead { per_length_n_m: [p, 0.0], ..Dead::default() };
    assert!((tip(&Follower(1e-3))[0] / tip(&dead(1e-3))[0] - 1.0).abs() < 1e-6);
    assert!(tip(&Follower(5.0))[1] < tip(&dead(5.0))[1]);
}

#[test]
fn what_nothing_holds_is_refused() {
    let adrift = Strip::hung(1.0, 1.0, 1.0, 0.0);
    let load = Dead { per_length_n_m: [1.0, 0.0], ..Dead::default() };
    let error = Rest::of(&adrift, &Mesh::uniform(1.0, 10), &load).unwrap_err().to_string();
    assert!(error.contains("comes to no rest"), "{error}");
}

#[test]
fn a_rigid_strip_swings_far_as_a_pendulum() {
    let strip = Strip { bending_stiffness_n_m2: 1.0, ..kapton() };
    let rest = at_rest(&strip, 8, &Free);
    let mut motion = Motion::of(&rest, &Free, 1, 0.0).unwrap();
    let release_rad = 1.2;
    motion.coordinates[0] = release_rad / motion_angle(&rest);
    // T = 4K(sin(θ₀/2))/ω: a quarter of it later the strip hangs down
    let quarter_s = elliptic(FRAC_PI_2, (0.5 * release_rad).sin())[0] / (TAU * rigid_frequency_hz(0.2, 9.80665));
    motion.advance(quarter_s).unwrap();
    assert!(motion.x_m(0.2).abs() < 1e-5, "{}", motion.x_m(0.2));
}

/// θ(0) a unit of the first mode.
fn motion_angle(rest: &Rest) -> f64 {
    rest.vibration().unwrap().shapes[(0, 0)]
}

#[test]
fn a_swing_keeps_its_energy_and_loses_it_as_its_damping_says() {
    let strip = kapton();
    let rest = at_rest(&strip, 20, &Free);
    let mut motion = Motion::of(&rest, &Free, 4, 0.0).unwrap();
    motion.coordinates[0] = 0.6 / motion_angle(&rest);
    let still = Motion::of(&rest, &Free, 4, 0.0).unwrap().energy_j();
    let begin = motion.energy_j() - still;
    motion.advance(5.0).unwrap();
    assert!(((motion.energy_j() - still) / begin - 1.0).abs() < 1e-4, "{}", motion.energy_j() - still);
    let mut damped = Motion::of(&rest, &Free, 4, 0.02).unwrap();
    damped.coordinates[0] = 1e-3 / motion_angle(&rest);
    let hz = rest.vibration().unwrap().frequencies_hz(1)[0];
    let begin = damped.energy_j() - still;
    damped.advance(10.0 / hz).unwrap();
    let expected = (-2.0 * 0.02 * TAU * 10.0).exp();
    assert!(((damped.energy_j() - still) / begin / expected - 1.0).abs() < 0.03, "{}", damped.energy_j() - still);
}

#[test]
fn a_suddenly_pushed_strip_swings_as_the_sum_of_its_modes() {
    let strip = kapton();
    let rest = at_rest(&strip, 20, &Free);
    let push = Dead { per_length_n_m: [1e-6, 0.0], ..Dead::default() };
    let still_m = at_rest(&strip, 20, &push).place_m(0.2)[0];
    let vibration = rest.vibration().unwrap();
    let moved: Vec<_> = (0..rest.mesh.points()).map(|p| rest.seen(&vibration, rest.mesh.s_m(p))).collect();
    let force = |k: usize| -> f64 { moved.iter().enumerate().map(|(p, x)| rest.mesh.weight_m(p) * 1e-6 * x[k]).sum() };
    let tip = rest.seen(&vibration, 0.2);
    let share = |k: usize| tip[k] * force(k) / vibration.squares_rad2_s2[k];
    assert!(((0..30).map(share).sum::<f64>() / still_m - 1.0).abs() < 1e-3);
    let mut motion = Motion::of(&rest, &push, 6, 0.0).unwrap();
    for step in 1..=4 {
        motion.advance(0.1).unwrap();
        let t = 0.1 * f64::from(step);
        let of = |k: usize| share(k) * (1.0 - (vibration.squares_rad2_s2[k].sqrt() * t).cos());
        let expected_m: f64 = (0..6).map(of).sum();
        assert!((motion.x_m(0.2) - expected_m).abs() < 1e-3 * still_m, "{} {expected_m}", motion.x_m(0.2));
    }
}

/// A load of the independent solver's.
struct Whole {
    dead: Dead,
    follower: Follower,
}

impl Load for Whole {
    fn force(&self, s_m: f64, theta_rad: f64) -> LocalForce {
        let (dead, follower) = (self.dead.force(s_m, theta_rad), self.follower.force(s_m, theta_rad));
        let force_n_m = [0, 1].map(|k| dead.force_n_m[k] + follower.force_n_m[k]);
        LocalForce { force_n_m, ..follower }
    }

    fn tip_force_n(&self) -> [f64; 2] {
        self.dead.tip_n
    }

    fn follows(&self) -> bool {
        self.follower.0 != 0.0
    }
}

/// fixtures/strip/solve.py made the file, with scipy's boundary-value solver.
#[test]
fn fifty_loaded_strips_lie_where_an_independent_solver_puts_them() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/strip/golden.csv");
    let mut table = csv::Reader::from_path(path).unwrap();
    let (mut strips, mut worst) = (0, 0.0f64);
    for row in table.records() {
        let v: Vec<f64> = row.unwrap().iter().map(|cell| cell.parse().unwrap()).collect();
        let support =
            if v[5].is_infinite() { Support::Clamped } else { Support::Hinged { stiffness_n_m_per_rad: v[5] } };
        let strip = Strip { curl_per_m: v[4], support, support_angle_rad: v[6], ..Strip::hung(v[0], v[1], v[2], v[3]) };
        let load =
            Whole { dead: Dead { per_length_n_m: [v[7], v[8]], tip_n: [v[10], v[11]] }, follower: Follower(v[9]) };
        let rest = Rest::of(&strip, &Mesh::uniform(strip.length_m, 60), &load).unwrap();
        for (place, expected) in [0.25, 0.5, 0.75, 1.0].into_iter().zip(v[12..].chunks(2)) {
            let found = rest.place_m(place * strip.length_m);
            let off = (0..2).map(|k| (found[k] / strip.length_m - expected[k]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-5, "strip {strips} at {place}: {found:?} {expected:?}, off by {off:e}");
            worst = worst.max(off);
        }
        strips += 1;
    }
    assert_eq!(strips, 50);
    assert!(worst > 0.0, "compared with nothing");
}
