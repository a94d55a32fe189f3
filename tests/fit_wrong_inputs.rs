//! A bank of wrong inputs for `fit`: none is called reproduced, none yields a number that cannot be, and each is told with what is wrong.

use std::fmt::Write;
use std::path::Path;

use freeswing::experiment::Experiment;
use freeswing::fit::{self, Pace, Record, Seen, Verdict, base_parameters};
use freeswing::series::AngleSeries;
use freeswing::synth::Swing;
use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, Normal};
use rayon::prelude::*;

const NOISE_RAD: f64 = 3e-4;
const DURATION_S: f64 = 10.0;
const RATE_HZ: f64 = 30.0;

/// A pendulum of 0.26 m, and a strip of two links.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    One,
    Two,
}

/// What an experiment file says; true unless changed.
#[derive(Debug, Clone)]
struct File {
    kind: Kind,
    lengths_m: Vec<f64>,
    /// Of the one link's, over the true ones.
    com: f64,
    inertia: f64,
    gravity_m_s2: f64,
    release_rad: Vec<f64>,
    stiffness: f64,
    friction: f64,
}

impl File {
    fn of(kind: Kind) -> Self {
        Self {
            kind,
            lengths_m: if kind == Kind::One { vec![0.26] } else { vec![0.1, 0.1] },
            com: 1.0,
            inertia: 1.0,
            gravity_m_s2: 9.80665,
            release_rad: if kind == Kind::One { vec![0.3] } else { vec![0.3, 0.4] },
            stiffness: 2e-4,
            friction: 0.0,
        }
    }

    fn scaled(kind: Kind, factor: f64) -> Self {
        let mut file = Self::of(kind);
        file.lengths_m.iter_mut().for_each(|length| *length *= factor);
        file
    }

    fn text(&self) -> String {
        let specimen = match self.kind {
            Kind::One => {
                let (length, com) = (self.lengths_m[0], self.com);
                format!(
                    "[[specimen.links]]\nlength_m = {length}\nmass_kg = 0.1\ncom_m = {}\ninertia_kg_m2 = {}\n",
                    com * length,
                    2e-4 * self.inertia
                )
            }
            Kind::Two => format!("[specimen]\nmass_kg = 0.3606e-3\nlink_lengths_m = {:?}\n", self.lengths_m),
        };
        let damper = if self.kind == Kind::One { 1e-4 } else { 1e-7 };
        let friction =
            if self.friction > 0.0 { format!("hinge_coulomb = {:e}\n", self.friction) } else { String::new() };
        format!(
            "{specimen}[rig]\ngravity_m_s2 = {}\n[model]\nk_eq_n_m_per_rad = {:e}\nc_eq_n_m_s_per_rad = 1e-6\nrelease_rad = {:?}\n\
             [model.effects]\nhinge_viscous = {damper:e}\n{friction}[render]\nduration_s = {DURATION_S}\n",
            self.gravity_m_s2, self.stiffness, self.release_rad
        )
    }

    fn experiment(&self) -> freeswing::Result<Experiment> {
        Experiment::parse(&self.text(), Path::new("case.toml"))
    }
}

/// Rows of a table: the time, then the angles.
type Rows = Vec<Vec<f64>>;

/// What a rig that is as its file says records.
fn recorded(file: &File, noise_rad: f64, seed: u64) -> Rows {
    let swing = Swing::of(&file.experiment().unwrap()).unwrap();
    let (noise, mut random) = (Normal::new(0.0, noise_rad).unwrap(), StdRng::seed_from_u64(seed));
    let row = |i: usize| {
        let t_s = i as f64 / RATE_HZ;
        let angles = swing.angles_rad(t_s).into_iter().map(|angle| angle + noise.sample(&mut random));
        std::iter::once(t_s).chain(angles).collect()
    };
    (0..(DURATION_S * RATE_HZ) as usize).map(row).collect()
}

/// What a user is told.
#[derive(Debug)]
struct Told {
    /// The error, or the verdict and what the pace says.
    text: String,
    warnings: Vec<String>,
    reproduced: bool,
}

/// As the command goes about it.
fn told(file: &File, rows: &Rows) -> Told {
    let refused = |error: freeswing::Error| Told { text: error.to_string(), warnings: Vec::new(), reproduced: false };
    answered(file, rows).unwrap_or_else(refused)
}

fn answered(file: &File, rows: &Rows) -> freeswing::Result<Told> {
    let experiment = file.experiment()?;
    let mut text = String::from("t_s");
    (1..rows[0].len()).for_each(|link| write!(text, ",theta{link}_rad").unwrap());
    for row in rows {
        let fields: Vec<String> = row.iter().map(|v| format!("{v:.9}")).collect();
        write!(text, "\n{}", fields.join(",")).unwrap();
    }
    let series = AngleSeries::parse(text.as_bytes(), Path::new("case.csv"))?;
    let links = file.lengths_m.len();
    let record = Record::of(&series, links)?;
    let seen = Seen::of(&record);
    if let Some(seen) = &seen {
        fit::check_frequency(&record, seen, &experiment)?;
    }
    let pace = seen.as_ref().and_then(|seen| Pace::of(seen, &experiment));
    let fitted = fit::fit(&[record], &experiment, &base_parameters(&experiment, links))?;
    for estimate in &fitted.estimates {
        assert!(estimate.value.is_finite() && !estimate.low.is_nan() && !estimate.high.is_nan(), "{estimate:?}");
    }
    let verdict = Verdict::of_fit(&fitted, 0, 0.8);
    let reproduced = verdict.is_reproduced();
    let pace = pace.filter(|_| !reproduced).and_then(|pace| pace.statement());
    let text = format!("{} {}", verdict.statement(), pace.unwrap_or_default());
    Ok(Told { text, warnings: [experiment.warnings, series.warnings].concat(), reproduced })
}

/// A wrong input, and what has to be among the words (any of the alternatives).
struct Case {
    name: String,
    file: File,
    rows: Rows,
    words: &'static [&'static str],
}

const BY_FACTOR: &[&str] = &["times faster than", "times slower than"];
const DEGREES: &[&str] = &["degrees"];

fn wrong_lengths(cases: &mut Vec<Case>) {
    for (kind, factors) in [
        (Kind::One, &[0.3, 0.42, 0.6, 0.75, 0.9, 1.1, 1.3, 1.7, 2.4, 3.0][..]),
        (Kind::Two, &[0.3, 0.5, 0.7, 0.85, 1.2, 1.5, 2.0, 3.0]),
    ] {
        for (i, factor) in factors.iter().enumerate() {
            let (name, file) = (format!("{kind:?}: lengths × {factor}"), File::scaled(kind, *factor));
            let rows = recorded(&File::of(kind), NOISE_RAD, i as u64);
            cases.push(Case { name, file, rows, words: BY_FACTOR });
        }
        for (unit, factor) in [("mm", 1000.0), ("cm", 100.0), ("inches", 39.37), ("feet", 3.281)] {
            let (name, file) = (format!("{kind:?}: lengths in {unit}"), File::scaled(kind, factor));
            cases.push(Case {
                name,
                file,
                rows: recorded(&File::of(kind), NOISE_RAD, 3),
                words: &["millimetres", "centimetres", "inches", "feet"],
            });
        }
    }
}

fn wrong_clocks(cases: &mut Vec<Case>) {
    for kind in [Kind::One, Kind::Two] {
        let rows = recorded(&File::of(kind), NOISE_RAD, 20);
        for (name, factor, words) in [
            ("milliseconds", 1e3, &["milliseconds"][..]),
            ("microseconds", 1e6, &["microseconds"]),
            ("frame numbers", RATE_HZ, &["times slower than"]),
            ("slow motion by 4", 4.0, &["slow motion, played 4 times slower"]),
            ("half the rate", 0.5, BY_FACTOR),
            ("25 for 30 frames per second", 1.2, BY_FACTOR),
            ("3 % off", 1.03, BY_FACTOR),
        ] {
            let rows = rows.iter().map(|row| [&[row[0] * factor], &row[1..]].concat()).collect();
            cases.push(Case { name: format!("{kind:?}: clock, {name}"), file: File::of(kind), rows, words });
        }
        for (name, wrong) in [
            ("drifts", Box::new(|t: f64| t * (1.0 + 0.004 * t)) as Box<dyn Fn(f64) -> f64>),
            ("skips 0.1 s", Box::new(|t: f64| if t > 5.0 { t - 0.098 } else { t })),
        ] {
            // two rows must not share a stamp
            let mut changed: Rows = rows.iter().map(|row| [&[wrong(row[0])], &row[1..]].concat()).collect();
            changed.sort_by(|a, b| a[0].total_cmp(&b[0]));
            cases.push(Case {
                name: format!("{kind:?}: clock {name}"),
                file: File::of(kind),
                rows: changed,
                words: &["not reproduced"],
            });
        }
    }
}

fn wrong_angles(cases: &mut Vec<Case>) {
    for kind in [Kind::One, Kind::Two] {
        for (i, amplitude) in [0.5f64, 1.0, 2.0, 17.0].into_iter().enumerate() {
            let mut truth = File::of(kind);
            truth.release_rad = truth.release_rad.iter().map(|r| r / 0.3 * amplitude.to_radians()).collect();
            let degrees = |row: &Vec<f64>| [vec![row[0]], row[1..].iter().map(|a| a.to_degrees()).collect()].concat();
            let rows = recorded(&truth, 1e-5, 40 + i as u64).iter().map(degrees).collect();
            let words = if amplitude > 0.6 { DEGREES } else { &["not reproduced"] };
            cases.push(Case { name: format!("{kind:?}: {amplitude}° as rad"), file: File::of(kind), rows, words });
        }
    }
    let rows = recorded(&File::of(Kind::Two), NOISE_RAD, 50);
    let changed = |change: &dyn Fn(f64, f64) -> [f64; 2]| -> Rows {
        rows.iter()
            .map(|row| {
                let [a, b] = change(row[1], row[2]);
                vec![row[0], a, b]
            })
            .collect()
    };
    for (name, rows, words) in [
        ("θ2 turned", changed(&|a, b| [a, -b]), &["the sign of one of the angles is turned"][..]),
        ("θ1 turned", changed(&|a, b| [-a, b]), &["the sign of one of the angles is turned"]),
        ("columns swapped", changed(&|a, b| [b, a]), &["the columns look swapped"]),
        ("θ2 from link to link", changed(&|a, b| [a, b - a]), &["from link to link"]),
        ("θ1 twice", changed(&|a, _| [a, a]), &["not reproduced"]),
        (
            "θ2 from the upward vertical",
            changed(&|a, b| [a, b + std::f64::consts::PI]),
            &["counted from the upward vertical"],
        ),
        ("both from a line 3° off", changed(&|a, b| [a + 0.05, b + 0.05]), &["a constant offset of 5", "camera_tilt"]),
    ] {
        cases.push(Case { name: name.to_owned(), file: File::of(Kind::Two), rows, words });
    }
}

fn wrong_specimens(cases: &mut Vec<Case>) {
    for kind in [Kind::One, Kind::Two] {
        let rows = recorded(&File::of(kind), NOISE_RAD, 60);
        for gravity_m_s2 in [1.62, 3.7, 25.0] {
            let file = File { gravity_m_s2, ..File::of(kind) };
            cases.push(Case {
                name: format!("{kind:?}: g = {gravity_m_s2}"),
                file,
                rows: rows.clone(),
                words: &["or gravity is 9."],
            });
        }
        let file =
            File { lengths_m: vec![0.1; if kind == Kind::One { 2 } else { 3 }], kind: Kind::Two, ..File::of(kind) };
        cases.push(Case {
            name: format!("{kind:?}: a link too many"),
            file,
            rows: rows.clone(),
            words: &["describe the specimen as it was filmed"],
        });
        let few = rows[..6].to_vec();
        cases.push(Case {
            name: format!("{kind:?}: six rows"),
            file: File::of(kind),
            rows: few,
            words: &["a swing needs at least 8"],
        });
        for seconds in [0.5, 1.0] {
            let short = rows[..(seconds * RATE_HZ) as usize].to_vec();
            let words = &["the recording holds", "with fewer than 2"];
            cases.push(Case { name: format!("{kind:?}: {seconds} s"), file: File::of(kind), rows: short, words });
        }
        let faint =
            File { release_rad: File::of(kind).release_rad.iter().map(|r| 1e-3 * r).collect(), ..File::of(kind) };
        let faint = recorded(&faint, NOISE_RAD, 61);
        cases.push(Case {
            name: format!("{kind:?}: all noise"),
            file: File::of(kind),
            rows: faint,
            words: &["not judged", "not reproduced"],
        });
    }
    for (name, com, inertia) in
        [("centre of mass halved", 0.5, 1.0), ("centre of mass doubled", 2.0, 1.0), ("inertia × 20", 1.0, 20.0)]
    {
        let file = File { com, inertia, ..File::of(Kind::One) };
        cases.push(Case {
            name: name.to_owned(),
            file,
            rows: recorded(&File::of(Kind::One), NOISE_RAD, 62),
            words: BY_FACTOR,
        });
    }
    let rubs = File { friction: 1e-6, ..File::of(Kind::Two) };
    let rows = recorded(&rubs, NOISE_RAD, 63);
    cases.push(Case {
        name: "friction left out".to_owned(),
        file: File::of(Kind::Two),
        rows,
        words: &["not reproduced"],
    });
    let tumbles = File { release_rad: vec![2.9, 2.2], ..File::of(Kind::Two) };
    let rows = recorded(&tumbles, NOISE_RAD, 64);
    cases.push(Case {
        name: "tumbling, longer".to_owned(),
        file: File::scaled(Kind::Two, 1.3),
        rows,
        words: &["not reproduced"],
    });
}

#[test]
fn no_wrong_input_is_called_reproduced_and_each_is_told() {
    let mut cases = Vec::new();
    wrong_lengths(&mut cases);
    wrong_clocks(&mut cases);
    wrong_angles(&mut cases);
    wrong_specimens(&mut cases);
    assert!(cases.len() >= 70, "{}", cases.len());
    let complaints: Vec<String> = cases
        .par_iter()
        .filter_map(|case| {
            let told = told(&case.file, &case.rows);
            let all = format!("{} {}", told.text, told.warnings.join(" "));
            let fails = told.reproduced
                || !case.words.iter().any(|word| all.contains(word))
                || all.contains("NaN")
                || all.contains("inf ");
            fails.then(|| format!("{}: {}{all}", case.name, if told.reproduced { "REPRODUCED " } else { "" }))
        })
        .collect();
    assert!(complaints.is_empty(), "{} of {}:\n{}", complaints.len(), cases.len(), complaints.join("\n"));
}

#[test]
fn right_inputs_are_reproduced() {
    for kind in [Kind::One, Kind::Two] {
        for seed in 0..3 {
            let told = told(&File::of(kind), &recorded(&File::of(kind), NOISE_RAD, seed));
            assert!(told.reproduced, "{kind:?} {told:?}");
        }
    }
}

#[test]
fn a_spring_that_is_stated_a_hundred_times_off_is_found() {
    for factor in [0.01, 0.1, 0.2, 10.0, 100.0] {
        let mut truth = File::of(Kind::Two);
        truth.stiffness = 1e-3;
        let file = File { stiffness: factor * truth.stiffness, ..truth.clone() };
        let told = told(&file, &recorded(&truth, NOISE_RAD, 5));
        assert!(told.reproduced, "{factor}: {told:?}");
    }
}
