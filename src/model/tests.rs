//! The model against known answers: derivatives, frequencies, energy, friction, other formulations of the same motion.

use nalgebra::DMatrix;

use super::integrate::Directions;
use super::*;
use crate::experiment::{
    Coefficient, Effects, Experiment, Hysteresis, Inertia, Law, LawPlace, Model, Rig, SupportFlexibility, SupportMotion,
};

fn experiment(k: f64, c: f64, effects: Effects) -> Experiment {
    let model = Model { k_eq_n_m_per_rad: k, c_eq_n_m_s_per_rad: c, effects, ..Model::default() };
    Experiment { model, ..Experiment::default() }
}

/// A stand as soft beside the weight of a strip as a table is beside that of a rod.
const STAND: SupportFlexibility = SupportFlexibility { compliance_m_per_n: 0.3, frequency_hz: 3.0, damping_ratio: 0.1 };

/// Every effect at once, on three links.
fn everything() -> ForwardModel {
    let effects = Effects {
        hinge_viscous: Some(2e-7),
        hinge_coulomb: Some(1e-6),
        hinge_stiffness: Some(1e-5),
        joint_cubic_stiffness: Some(3e-4),
        joint_hysteretic: Some(Hysteresis { torque_n_m: 3e-6, yield_rad: 0.05 }),
        rest_curl: Some(0.1),
        air_linear: Some(1e-3),
        air_quadratic: Some(2e-3),
        added_mass: Some(3e-4),
        side_force: Some(0.4),
        support_motion: Some(SupportMotion { amplitude_m: 1e-3, frequency_hz: 0.8, phase_rad: 0.3 }),
        support_flexibility: Some(STAND),
        ..Effects::default()
    };
    let mut experiment = experiment(2e-4, 1e-6, effects);
    experiment.model.law = stated_laws();
    experiment.specimen.link_lengths_m = vec![0.06, 0.09, 0.05];
    ForwardModel::of(&experiment).unwrap()
}

/// A law at every place.
fn stated_laws() -> Vec<Law> {
    let named = |name: &str, place: &str, formula: &str| {
        let text = format!(
            "[[model.law]]\nname = \"{name}\"\nplace = \"{place}\"\ntorque_n_m = \"{formula}\"\nparameters.a = {{ start = 0.1 }}\n"
        );
        Experiment::parse(&text, std::path::Path::new("e.toml")).unwrap().model.law.remove(0)
    };
    let of = |place: &str, formula: &str| named(place, place, formula);
    vec![
        of("hinge", "-1e-5 * a * rate * angle ^ 2 * exp(-t) * (1 + 1e3 * load ^ 2)"),
        of("joint", "-1e-5 * a * (max(rate, 0) + sin(angle)) * (1 + 1e3 * load)"),
        Law { joint: Some(2), ..named("lower joint", "joint", "-3e-5 * a * rate * load") },
        of("strip", "-a * wind ^ 3 * t"),
        of("tip", "-1e-2 * a * abs(wind) * wind"),
        of("support", "a * cos(3 * t)"),
    ]
}

fn some_motion(model: &ForwardModel) -> Motion {
    let mut motion = model.motion(0.37, &[0.4, -0.3, 0.8], &[2.0, -3.0, 4.0, 0.3, -0.2, 4e-3, -3e-3]);
    motion.acceleration.copy_from_slice(&[30.0, -50.0, 20.0, 1.0, 2.0, 0.1, -0.2]);
    motion
}

/// The change of the torques when `change` is applied forwards and backwards, over 2 ε.
fn slope(model: &ForwardModel, motion: &Motion, epsilon: f64, change: impl Fn(&mut Motion, f64)) -> Vec<f64> {
    let torque = |step: f64| {
        let mut moved = motion.clone();
        change(&mut moved, step);
        let mut q = vec![0.0; model.rates()];
        model.torque(&moved, &mut q);
        q
    };
    torque(epsilon).iter().zip(torque(-epsilon)).map(|(a, b)| (a - b) / (2.0 * epsilon)).collect()
}

#[test]
fn partials_are_the_differences_of_the_torques() {
    let model = everything();
    let motion = some_motion(&model);
    let mut partials = Partials::zero(3, 7);
    model.partials(&motion, &mut partials);
    let close = |column: &[f64], exact: Vec<f64>, what: &str| {
        for (row, (a, b)) in column.iter().zip(&exact).enumerate() {
            let unit = if (3..5).contains(&row) { 10.0 } else { 1e-4 };
            assert!((a - b).abs() < 1e-7 * unit, "{what}, row {row}: {a} {b}");
        }
    };
    for j in 0..3 {
        let turned = slope(&model, &motion, 1e-5, |m, e| {
            let mut theta = m.theta_rad.clone();
            theta[j] += e;
            m.place(&theta);
        });
        close(partials.theta.column(j).as_slice(), turned, "θ");
    }
    for j in 0..7 {
        close(partials.rate.column(j).as_slice(), slope(&model, &motion, 1e-5, |m, e| m.rate[j] += e), "rate");
        let sped = slope(&model, &motion, 1e-3, |m, e| m.acceleration[j] += e);
        close(partials.acceleration.column(j).as_slice(), sped, "acceleration");
    }
    close(partials.pivot_velocity.as_slice(), slope(&model, &motion, 1e-5, |m, e| m.pivot_m_s += e), "ẋₚ");
    close(partials.pivot_acceleration.as_slice(), slope(&model, &motion, 1e-3, |m, e| m.pivot_m_s2 += e), "ẍₚ");
}

#[test]
fn a_law_at_one_joint_acts_on_its_two_links_alone() {
    let mut experiment = experiment(0.0, 0.0, Effects::default());
    experiment.specimen.link_lengths_m = vec![0.06, 0.09, 0.05];
    let torques = |laws: Vec<Law>| {
        let model = ForwardModel::of(&Experiment {
            model: Model { law: laws, ..experiment.model.clone() },
            ..experiment.clone()
        });
        let mut motion = model.as_ref().unwrap().motion(0.0, &[0.4, -0.3, 0.8], &[2.0, -3.0, 4.0]);
        motion.acceleration.fill(0.0);
        let mut q = vec![0.0; 3];
        model.unwrap().torque(&motion, &mut q);
        q
    };
    let law = |joint| {
        let text = "[[model.law]]\nname = \"pin\"\nplace = \"joint\"\ntorque_n_m = \"-1e-5 * rate\"\n";
        Law { joint, ..Experiment::parse(text, std::path::Path::new("e.toml")).unwrap().model.law.remove(0) }
    };
    let none = torques(Vec::new());
    let of =
        |joint| -> Vec<f64> { torques(vec![law(joint)]).iter().zip(&none).map(|(with, none)| with - none).collect() };
    let [first, second, both] = [Some(1), Some(2), None].map(of);
    let near = |a: &[f64], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
    assert!(near(&first, [-5e-5, 5e-5, 0.0]) && near(&second, [0.0, 7e-5, -7e-5]), "{first:?} {second:?}");
    assert!(near(&both, [-5e-5, 12e-5, -7e-5]), "{both:?}");
}

#[test]
fn sensitivities_are_the_differences_of_the_torques() {
    let mut model = everything();
    let motion = some_motion(&model);
    let mut partials = Partials::zero(3, 7);
    model.partials(&motion, &mut partials);
    for (parameter, value) in model.parameters() {
        let mut exact = vec![0.0; 7];
        model.sensitivity(parameter, &motion, &partials, &mut exact);
        let epsilon = 1e-5 * value.abs().max(1e-8);
        let mut torque = |value: f64| {
            model.set(parameter, value);
            let mut moved = motion.clone();
            model.set_time(&mut moved, motion.t_s);
            let mut q = vec![0.0; 7];
            model.torque(&moved, &mut q);
            q
        };
        let (above, below) = (torque(value + epsilon), torque(value - epsilon));
        torque(value);
        for row in 0..7 {
            let difference = (above[row] - below[row]) / (2.0 * epsilon);
            let size = exact.iter().fold(1e-12f64, |a, b| a.max(b.abs()));
            assert!(
                (exact[row] - difference).abs() < 1e-5 * size,
                "{parameter}, row {row}: {} {difference}",
                exact[row]
            );
        }
    }
}

#[test]
fn derivatives_of_the_motion_are_its_differences_across_reversals() {
    let mut model = everything();
    // the hinge of three links would otherwise mostly stick to its rail
    let start = State { theta_rad: vec![0.4, 0.5, 0.3], omega_rad_s: vec![0.1, 0.0, 0.2], hidden: Vec::new() };
    let parameters: Vec<Parameter> = model.parameters().into_iter().map(|(p, _)| p).collect();
    let directions =
        Directions { parameters: parameters.clone(), theta: DMatrix::identity(3, 3), rate: DMatrix::zeros(7, 3) };
    let (accuracy, until_s) = (Accuracy { step_error_rad: 1e-12, ..Accuracy::default() }, 2.0);
    let swing = Trajectory::with(&model, &start, (0.0, until_s), Some(&directions), &accuracy).unwrap();
    let reversals = swing.steps().windows(2).filter(|s| s[0].hinge != s[1].hinge).count();
    assert!(reversals >= 3, "{reversals}");
    let (theta, _) = swing.instant(until_s).unwrap().slopes.unwrap();
    let end = |model: &ForwardModel, start: &State| {
        Trajectory::with(model, start, (0.0, until_s), None, &accuracy).unwrap().at(until_s).theta_rad
    };
    for (column, parameter) in parameters.iter().enumerate() {
        let value = model.value(*parameter).unwrap();
        let epsilon = 1e-4 * value.abs();
        model.set(*parameter, value + epsilon);
        let above = end(&model, &start);
        model.set(*parameter, value - epsilon);
        let below = end(&model, &start);
        model.set(*parameter, value);
        let size = theta.column(column).amax();
        for row in 0..3 {
            let difference = (above[row] - below[row]) / (2.0 * epsilon);
            let exact = theta[(row, column)];
            assert!((exact - difference).abs() < 2e-4 * size, "{parameter}, link {row}: {exact} {difference}");
        }
    }
    for link in 0..3 {
        let moved = |step: f64| {
            let mut start = start.clone();
            start.theta_rad[link] += step;
            end(&model, &start)
        };
        let (above, below) = (moved(1e-5), moved(-1e-5));
        for row in 0..3 {
            let difference = (above[row] - below[row]) / 2e-5;
            let exact = theta[(row, parameters.len() + link)];
            assert!((exact - difference).abs() < 2e-4, "θ of link {link}, link {row}: {exact} {difference}");
        }
    }
}

#[test]
fn two_limp_rods_swing_at_1_3489_and_3_6180_hz() {
    let limp = Experiment {
        rig: Rig { gravity_m_s2: 9.81, ..Rig::default() },
        model: Model { k_eq_n_m_per_rad: 0.0, c_eq_n_m_s_per_rad: 0.0, ..Model::default() },
        ..Experiment::default()
    };
    let model = ForwardModel::of(&limp).unwrap();
    let mut partials = Partials::zero(2, 2);
    model.partials(&model.motion(0.0, &[0.0; 2], &[0.0; 2]), &mut partials);
    let squares = (partials.acceleration.try_inverse().unwrap() * partials.theta).complex_eigenvalues();
    let mut hz: Vec<f64> = squares.iter().map(|l| l.re.sqrt() / std::f64::consts::TAU).collect();
    hz.sort_by(f64::total_cmp);
    assert!((hz[0] - 1.3489).abs() < 5e-5 && (hz[1] - 3.6180).abs() < 5e-5, "{hz:?}");
}

#[test]
fn a_steady_side_force_turns_gravity() {
    let mut windy = Experiment::default();
    windy.model.effects.side_force = Some(1.3);
    let model = ForwardModel::of(&windy).unwrap();
    let rest = (1.3f64 / windy.rig.gravity_m_s2).atan();
    let mut motion = model.motion(0.0, &[rest; 2], &[0.0; 2]);
    model.accelerate(&mut motion).unwrap();
    assert!(motion.acceleration.iter().all(|a| a.abs() < 1e-9));
}

fn energies_j(experiment: &Experiment, release: &[f64], until_s: f64) -> Vec<f64> {
    let model = ForwardModel::of(experiment).unwrap();
    let accuracy = Accuracy { step_error_rad: 1e-12, ..Accuracy::default() };
    let swing = Trajectory::with(&model, &State::at_rest(release), (0.0, until_s), None, &accuracy).unwrap();
    let at = |i: i32| {
        let t_s = until_s * f64::from(i) / 400.0;
        let instant = swing.instant(t_s).unwrap();
        model.energy_j(&model.motion(t_s, &instant.theta_rad, &instant.rate))
    };
    (0..=400).map(at).collect()
}

#[test]
fn energy_is_conserved_without_losses() {
    let stored = Effects {
        hinge_stiffness: Some(1e-5),
        joint_cubic_stiffness: Some(1e-4),
        rest_curl: Some(0.1),
        added_mass: Some(3e-4),
        side_force: Some(0.4),
        ..Effects::default()
    };
    let undamped = SupportFlexibility { damping_ratio: 0.0, ..STAND };
    let on_a_stand = Effects { support_flexibility: Some(undamped), rest_curl: Some(0.1), ..Effects::default() };
    for (effects, release) in [(Effects::default(), [0.9, -0.6]), (stored, [0.5, 0.8]), (on_a_stand, [0.5, 0.8])] {
        let energies = energies_j(&experiment(2e-4, 0.0, effects), &release, 20.0);
        let worst = energies.iter().map(|e| (e / energies[0] - 1.0).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-8, "{worst}");
    }
}

#[test]
fn energy_never_rises_where_every_effect_dissipates() {
    let losses = Effects {
        hinge_viscous: Some(1e-7),
        hinge_coulomb: Some(2e-7),
        joint_hysteretic: Some(Hysteresis { torque_n_m: 1e-6, yield_rad: 0.05 }),
        air_linear: Some(1e-4),
        air_quadratic: Some(2e-3),
        support_flexibility: Some(STAND),
        ..Effects::default()
    };
    let energies = energies_j(&experiment(2e-4, 1e-7, losses), &[0.5, 0.7], 5.0);
    assert!(energies.windows(2).all(|e| e[1] <= e[0] * (1.0 + 1e-10)));
    assert!(energies[400] < 0.9 * energies[0]);
}

#[test]
fn a_pendulum_on_a_stand_swings_as_the_two_oscillators_that_they_are() {
    // (I + mc²) θ̈ + h ẍ + g h θ = 0,  (m_s + M) ẍ + h θ̈ + x/s = 0
    let (mass_kg, length_m, gravity_m_s2) = (0.3, 0.4, 9.81);
    let stand = SupportFlexibility { compliance_m_per_n: 4e-4, frequency_hz: 3.0, damping_ratio: 0.0 };
    let mut one = experiment(0.0, 0.0, Effects { support_flexibility: Some(stand), ..Effects::default() });
    one.rig.gravity_m_s2 = gravity_m_s2;
    one.specimen.mass_kg = mass_kg;
    one.specimen.link_lengths_m = vec![length_m];
    let (inertia, moment) = (mass_kg * length_m * length_m / 3.0, 0.5 * mass_kg * length_m);
    let carried_kg = 1.0 / (4e-4 * (std::f64::consts::TAU * 3.0).powi(2));
    let inertia = DMatrix::from_row_slice(2, 2, &[inertia, moment, moment, carried_kg]);
    let stiffness = DMatrix::from_row_slice(2, 2, &[gravity_m_s2 * moment, 0.0, 0.0, 1.0 / 4e-4]);
    let squares = (inertia.try_inverse().unwrap() * stiffness).complex_eigenvalues();
    let slow_hz = squares.iter().map(|l| l.re.sqrt() / std::f64::consts::TAU).fold(f64::INFINITY, f64::min);
    let model = ForwardModel::of(&one).unwrap();
    // begun in the slow mode, x = hω²/(1/s − (m_s + M)ω²) θ
    let omega = std::f64::consts::TAU * slow_hz;
    let ratio_m = moment * omega * omega / (1.0 / 4e-4 - carried_kg * omega * omega);
    let begun = State::begun(&model, &[1e-4, 1e-4 * ratio_m, 0.0, 0.0]);
    let (accuracy, cycles) = (Accuracy { step_error_rad: 1e-13, ..Accuracy::default() }, 10.0);
    let swing = Trajectory::with(&model, &begun, (0.0, cycles / slow_hz), None, &accuracy).unwrap();
    let after = swing.at(cycles / slow_hz);
    assert!((after.theta_rad[0] - 1e-4).abs() < 1e-9, "{after:?}");
    assert!((after.hidden[0] - 1e-4 * ratio_m).abs() < 1e-3 * 1e-4 * ratio_m, "{after:?}");
    let quarter = swing.at((cycles - 0.25) / slow_hz);
    assert!(quarter.theta_rad[0].abs() < 1e-9, "{quarter:?}");
}

#[test]
fn hysteresis_loses_the_same_in_a_slow_cycle_as_in_a_fast_one() {
    let law = effects::joint::Hysteresis { torque_n_m: 2e-6, yield_rad: 0.05 };
    let chain = Chain::of(&crate::experiment::Specimen::default()).unwrap();
    let work_j = |rate: f64| {
        let (mut motion, mut work_j, steps) = (Motion::zero(2, 1), 0.0, 40_000);
        let dt_s = 3.0 * std::f64::consts::TAU / rate / f64::from(steps);
        for step in 0..steps {
            let t_s = dt_s * f64::from(step);
            motion.place(&[0.0, 0.3 * (rate * t_s).sin()]);
            motion.rate[1] = 0.3 * rate * (rate * t_s).cos();
            let mut q = [0.0; 3];
            effects::Effect::add_torque(&law, &chain, &motion, &mut q);
            motion.rate[2] += q[2] * dt_s;
            if step >= steps / 3 {
                work_j -= q[1] * motion.rate[1] * dt_s;
            }
        }
        work_j / 2.0
    };
    let (slow, fast) = (work_j(1.0), work_j(20.0));
    assert!((slow / fast - 1.0).abs() < 1e-3 && slow > 0.0, "{slow} {fast}");
    // far beyond yield the loop is a parallelogram of height 2T and width 4(A − Δ_y), with rounded corners
    assert!(slow < 4.0 * 2e-6 * 0.3 && slow > 4.0 * 2e-6 * (0.3 - 3.0 * 0.05), "{slow}");
}

#[test]
fn a_dry_hinge_loses_four_bands_a_cycle_and_then_holds() {
    let mut dry = experiment(0.0, 0.0, Effects { hinge_coulomb: Some(1e-8), ..Effects::default() });
    dry.specimen.link_lengths_m = vec![0.2];
    let model = ForwardModel::of(&dry).unwrap();
    // small enough for a linear pendulum: each half swing ends 2τ/(gh) nearer to the middle
    let band_rad = 1e-8 / (model.gravity_m_s2() * model.chain().static_moment_kg_m(0));
    let release = 20.5 * band_rad;
    let swing = Trajectory::swing(&model, &State::at_rest(&[release]), 0.0, 20.0).unwrap();
    let turns: Vec<f64> =
        swing.steps().windows(2).filter(|s| s[0].hinge != s[1].hinge).map(|s| s[1].theta_rad[0] / band_rad).collect();
    assert!(turns.len() >= 10, "{turns:?}");
    for (turn, expected) in turns.iter().zip([-18.5, 16.5, -14.5, 12.5, -10.5, 8.5, -6.5, 4.5, -2.5, 0.5]) {
        assert!((turn - expected).abs() < 1e-3, "{turns:?}");
    }
    assert_eq!(swing.at(20.0).omega_rad_s[0], 0.0);
    assert!((swing.at(20.0).theta_rad[0] / band_rad - 0.5).abs() < 1e-3);
}

#[test]
fn a_formula_with_the_sign_of_the_rate_at_the_hinge_is_dry_friction() {
    let torque_n_m = 6e-5;
    let effect = experiment(0.0, 0.0, Effects { hinge_coulomb: Some(torque_n_m), ..Effects::default() });
    let formula = |text: &str| {
        let parameters = [("a", torque_n_m, "N m"), ("b", 1e9, "rad/s")]
            .map(|(name, start, unit)| (name.to_owned(), Coefficient { start, min: None, unit: unit.to_owned() }));
        let law = Law {
            name: "own".to_owned(),
            place: LawPlace::Hinge,
            joint: None,
            formula: text.to_owned(),
            parameters: parameters.into(),
        };
        let mut experiment = experiment(0.0, 0.0, Effects::default());
        experiment.model.law = vec![law];
        experiment
    };
    let at_end = |experiment: &Experiment| {
        let model = ForwardModel::of(experiment).unwrap();
        let swing = Trajectory::swing(&model, &State::at_rest(&[0.0, 1.2]), 0.0, 2.0).unwrap();
        assert!(swing.steps().iter().any(|step| step.hinge == Hinge::Sticks));
        swing.at(2.0).theta_rad
    };
    let [stated, fading] = [effect, formula("-a * sign(rate) * exp(-abs(rate) / b)")].map(|own| at_end(&own));
    assert!(stated.iter().zip(&fading).all(|(a, b)| (a - b).abs() < 1e-7), "{stated:?} {fading:?}");
    // at rest nothing moves, and it bears nothing
    let model = ForwardModel::still(&formula("-a * sign(rate)")).unwrap();
    let rest_rad = model.rest_rad(nalgebra::DVector::from_element(2, 0.01), |_, _, _| {}).unwrap();
    assert!(rest_rad.amax() < 1e-12, "{rest_rad}");
}

#[test]
fn a_torque_that_bends_is_integrated_as_exactly_as_one_that_does_not() {
    let with = |formula: &str| {
        let text = format!(
            "[[specimen.links]]\nlength_m = 0.3\nmass_kg = 2e-3\ncom_m = 0.15\ninertia_kg_m2 = 1.5e-5\n\
             [[model.law]]\nname = \"stop\"\nplace = \"hinge\"\ntorque_n_m = \"{formula}\"\n\
             parameters.a = {{ start = 2e-4 }}\nparameters.b = {{ start = 0.13 }}\n"
        );
        ForwardModel::of(&Experiment::parse_with_specimen(&text, std::path::Path::new("e.toml")).unwrap()).unwrap()
    };
    let error_rad = |formula: &str| {
        let model = with(formula);
        let start = State::released(&model, &[0.35]).unwrap();
        let end = |step_error_rad: f64| {
            let accuracy = Accuracy { step_error_rad, ..Accuracy::default() };
            Trajectory::with(&model, &start, (0.0, 30.0), None, &accuracy).unwrap()
        };
        let (coarse, fine) = (end(3e-6), end(1e-11));
        let instants = (0..900).map(|row| f64::from(row) / 30.0);
        instants.map(|t_s| (coarse.at(t_s).theta_rad[0] - fine.at(t_s).theta_rad[0]).abs()).fold(0.0, f64::max)
    };
    let smooth = error_rad("-a * angle * (1 + b)");
    for bent in [
        "-a * sign(angle) * max(abs(angle) - b, 0)",
        "-a * max(angle - b, 0)",
        "-a * min(angle + b, 0)",
        "-a * angle - a * b * abs(angle)",
        "-a * b * sign(angle)",
        "-a * b * step(angle - 0.02)",
        "-0.01 * a * b * rate * abs(rate)",
        "-0.01 * a * b * rate * step(0.02 - abs(angle))",
    ] {
        let error_rad = error_rad(bent);
        assert!(error_rad < 3.0 * smooth, "{bent}: {error_rad:e}, {smooth:e} without");
    }
}

#[test]
fn friction_in_proportion_to_the_load_goes_with_the_force_that_its_own_acceleration_makes() {
    // one link of mass m, its centre c below the hinge: N² = m² [(g cos θ + c θ̇²)² + (g sin θ + c θ̈)²]
    let (mass_kg, com_m, inertia_kg_m2, radius_m) = (0.2, 0.15, 1.5e-3, 2e-3);
    let text = format!(
        "[[specimen.links]]\nlength_m = 0.3\nmass_kg = {mass_kg}\ncom_m = {com_m}\ninertia_kg_m2 = {inertia_kg_m2}\n\
         [model]\nc_eq_n_m_s_per_rad = 0.0\nrelease_rad = [1.2]\n\
         [[model.law]]\nname = \"rub\"\nplace = \"hinge\"\ntorque_n_m = \"-a * sign(rate) * load\"\n\
         parameters.a = {{ start = {radius_m}, unit = \"m\" }}\n"
    );
    let experiment = Experiment::parse_with_specimen(&text, std::path::Path::new("e.toml")).unwrap();
    let model = ForwardModel::of(&experiment).unwrap();
    let gravity_m_s2 = model.gravity_m_s2();
    let about_hinge_kg_m2 = inertia_kg_m2 + mass_kg * com_m * com_m;
    for (theta, rate) in [(0.9_f64, -2.0_f64), (-0.4, 6.0), (2.9, 1.0)] {
        let mut motion = model.motion(0.0, &[theta], &[rate]);
        model.accelerate(&mut motion).unwrap();
        let along = gravity_m_s2 * theta.cos() + com_m * rate * rate;
        let across = |acceleration: f64| gravity_m_s2 * theta.sin() + com_m * acceleration;
        let balance = |acceleration: f64| {
            let load_n = mass_kg * along.hypot(across(acceleration));
            let torque = -mass_kg * gravity_m_s2 * com_m * theta.sin() - radius_m * load_n * rate.signum();
            torque / about_hinge_kg_m2
        };
        let by_hand = (0..100).fold(0.0, |acceleration, _| balance(acceleration));
        assert!((motion.acceleration[0] / by_hand - 1.0).abs() < 1e-12, "{} {by_hand}", motion.acceleration[0]);
    }
    // it comes to rest, and friction holds it
    let swing = Trajectory::swing(&model, &State::at_rest(&[1.2]), 0.0, 60.0).unwrap();
    assert_eq!(swing.at(60.0).omega_rad_s[0], 0.0);
    let band_rad = radius_m / com_m;
    assert!(swing.at(60.0).theta_rad[0].abs() < 1.01 * band_rad, "{}", swing.at(60.0).theta_rad[0]);
}

#[test]
fn a_held_hinge_is_let_go_when_the_lower_link_pulls() {
    // the lower link swings beneath a hinge that holds the upper one at first
    let model =
        ForwardModel::of(&experiment(0.0, 0.0, Effects { hinge_coulomb: Some(6e-5), ..Effects::default() })).unwrap();
    let swing = Trajectory::swing(&model, &State::at_rest(&[0.0, 1.2]), 0.0, 2.0).unwrap();
    let states: Vec<Hinge> = swing.steps().iter().map(|s| s.hinge).collect();
    assert!(states.contains(&Hinge::Sticks) && states.iter().any(|s| *s != Hinge::Sticks), "{states:?}");
    for step in swing.steps().iter().filter(|s| s.hinge != Hinge::Sticks) {
        let middle = step.one_rate(0, 0.5);
        assert!(middle * step.hinge.sign() > 0.0, "{middle} while {:?}", step.hinge);
    }
}

#[test]
fn a_pivot_that_moves_slowly_carries_the_chain_with_it() {
    let slow = SupportMotion { amplitude_m: 0.01, frequency_hz: 0.05, phase_rad: 0.0 };
    let moved = experiment(2e-4, 0.0, Effects { support_motion: Some(slow), ..Effects::default() });
    let model = ForwardModel::of(&moved).unwrap();
    let swing = Trajectory::swing(&model, &State::at_rest(&[0.0, 0.0]), 0.0, 10.0).unwrap();
    // Sudden start of the pivot at 3 mm/s: the chain rings by v/√(gL) at most.
    assert!((0..100).all(|i| swing.at(0.1 * f64::from(i)).theta_rad[0].abs() < 0.01));
}

#[test]
fn stiffness_from_0_to_1_n_m_per_rad_takes_few_steps() {
    for (k, c) in [(0.0, 0.0), (2e-4, 2e-6), (0.0251, 2.652e-4), (0.1162, 4.153e-4), (1.0, 1e-3), (1.0, 1.0)] {
        for inertia in [Inertia::Rods, Inertia::Lumps] {
            let mut stiff = experiment(k, c, Effects::default());
            stiff.specimen.inertia = inertia;
            let model = ForwardModel::of(&stiff).unwrap();
            let start = State::at_rest(&[0.5, 0.6]);
            let swing = Trajectory::swing(&model, &start, 0.0, 5.0).unwrap();
            let steps = swing.steps().len();
            assert!(steps < 1000, "K = {k}, C = {c}: {steps} steps");
            let end = swing.at(5.0);
            assert!(end.theta_rad.iter().all(|a| a.abs() < 0.6), "{end:?}");
        }
    }
}

#[test]
fn a_very_stiff_joint_makes_one_rod() {
    let model = ForwardModel::of(&experiment(1.0, 1e-2, Effects::default())).unwrap();
    let mut rigid = experiment(0.0, 0.0, Effects::default());
    rigid.specimen.link_lengths_m = vec![0.2];
    let rod = ForwardModel::of(&rigid).unwrap();
    let two = Trajectory::swing(&model, &State::at_rest(&[0.5, 0.5]), 0.0, 10.0).unwrap();
    let one = Trajectory::swing(&rod, &State::at_rest(&[0.5]), 0.0, 10.0).unwrap();
    for i in 0..100 {
        let t_s = 0.1 * f64::from(i);
        let (two, one) = (two.at(t_s).theta_rad, one.at(t_s).theta_rad[0]);
        assert!((two[0] - one).abs() < 2e-4 && (two[1] - one).abs() < 2e-4, "{t_s}: {two:?} {one}");
    }
}

#[test]
fn the_period_of_one_rod_is_the_elliptic_integral() {
    let mut limp = experiment(0.0, 0.0, Effects::default());
    limp.specimen.link_lengths_m = vec![0.2];
    let model = ForwardModel::of(&limp).unwrap();
    let swing = Trajectory::swing(&model, &State::at_rest(&[1.2]), 0.0, 30.0).unwrap();
    // T = 4 K(sin θ₀/2)/ω₀ with K by the arithmetic–geometric mean
    let (mut a, mut b) = (1.0f64, (0.6f64).cos());
    for _ in 0..8 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    let rate = (1.5 * model.gravity_m_s2() / 0.2).sqrt();
    let period_s = std::f64::consts::TAU / (a * rate);
    for cycle in 1..30 {
        let theta = swing.at(period_s * f64::from(cycle)).theta_rad[0];
        if period_s * f64::from(cycle) < 30.0 {
            assert!((theta - 1.2).abs() < 1e-8, "{cycle}: {theta}");
        }
    }
}

#[test]
fn the_wrong_number_of_angles_is_refused() {
    let model = ForwardModel::of(&Experiment::default()).unwrap();
    let error = Trajectory::swing(&model, &State::at_rest(&[0.5]), 0.0, 1.0).unwrap_err().to_string();
    assert!(error.contains("1 angles for 2 links"), "{error}");
}

#[test]
fn the_pace_of_a_strip_is_that_of_its_two_rods_however_many_it_is_made_of() {
    let pace = |pieces: Option<usize>| {
        let bends = Effects { distributed_flexibility: pieces.map(|_| 1e-5), ..Effects::default() };
        let mut made = experiment(0.0, 0.0, bends);
        made.specimen.inertia = Inertia::Rods;
        made.model.pieces = pieces.unwrap_or(made.model.pieces);
        ForwardModel::of(&made).unwrap().characteristic_rad_s()
    };
    let of_rods = pace(None);
    for pieces in [4, 8, 20] {
        assert!((pace(Some(pieces)) / of_rods - 1.0).abs() < 1e-9, "{pieces}: {} {of_rods}", pace(Some(pieces)));
    }
}

#[test]
fn a_bending_strip_hangs_together_like_its_two_rods() {
    let mut strip = experiment(0.0, 0.0, Effects { distributed_flexibility: Some(1e-2), ..Effects::default() });
    strip.model.release_rad = vec![0.4, 0.4];
    let model = ForwardModel::of(&strip).unwrap();
    assert_eq!((model.chain().count(), model.chain().groups().len()), (16, 2));
    let start = State::released(&model, &strip.model.release_rad).unwrap();
    let swing = Trajectory::swing(&model, &start, 0.0, 2.0).unwrap();
    let mut rigid = experiment(0.0, 0.0, Effects::default());
    rigid.specimen.link_lengths_m = vec![0.2];
    let rod = Trajectory::swing(&ForwardModel::of(&rigid).unwrap(), &State::at_rest(&[0.4]), 0.0, 2.0).unwrap();
    for i in 0..20 {
        let t_s = 0.1 * f64::from(i);
        let seen = observe::chord_angles_rad(model.chain(), &swing.at(t_s).theta_rad);
        let rigid = rod.at(t_s).theta_rad[0];
        assert!((seen[0] - rigid).abs() < 5e-3 && (seen[1] - rigid).abs() < 5e-3, "{t_s}: {seen:?} {rigid}");
    }
}

/// Largest difference of the angles between marks from the first to the fifth second.
fn shapes_differ_by_rad(strip: &Experiment) -> f64 {
    let model = ForwardModel::of(strip).unwrap();
    let whole = ForwardModel::of(strip).unwrap().without_reduction();
    let start = State::released(&model, &strip.model.release_rad).unwrap();
    let accuracy = Accuracy { step_error_rad: 1e-8, ..Accuracy::default() };
    let swing = |model: &ForwardModel| Trajectory::with(model, &start, (0.0, 5.0), None, &accuracy).unwrap();
    let (few, all) = (swing(&model), swing(&whole));
    let chords = |swing: &Trajectory, t_s: f64| observe::chord_angles_rad(model.chain(), &swing.at(t_s).theta_rad);
    let gap = |k: usize| {
        let (a, b) = (chords(&few, k as f64 / 30.0), chords(&all, k as f64 / 30.0));
        (a[0] - b[0]).abs().max((a[1] - b[1]).abs())
    };
    (30..150).map(gap).fold(0.0, f64::max)
}

#[test]
fn few_shapes_move_as_all_links_do() {
    let on = |change: &dyn Fn(&mut Effects)| {
        let mut effects = Effects { distributed_flexibility: Some(5e-6), ..Effects::default() };
        change(&mut effects);
        effects
    };
    let laws = [
        on(&|_| {}),
        on(&|e| e.hinge_stiffness = Some(2e-5)),
        on(&|e| e.hinge_coulomb = Some(2e-7)),
        on(&|e| e.air_quadratic = Some(6e-4)),
        on(&|e| e.added_mass = Some(3e-4)),
        on(&|e| e.rest_curl = Some(0.1)),
        on(&|e| e.joint_cubic_stiffness = Some(1e-4)),
        on(&|e| e.joint_hysteretic = Some(Hysteresis { torque_n_m: 2e-6, yield_rad: 0.05 })),
    ];
    for law in laws {
        // the damper lets die what a start that does not fit the law has rung
        let mut strip = experiment(0.0, 3e-7, law);
        strip.model.release_rad = vec![0.4, 0.5];
        let gap_rad = shapes_differ_by_rad(&strip);
        // a seventh of the least noise; dry friction's jolts are the farthest off
        assert!(gap_rad < 3e-5, "{gap_rad:e} rad: {:?}", strip.model.effects);
    }
}
