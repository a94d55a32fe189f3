//! Wrong inputs to `identify`: each is refused in one line, or answered with the doubt or the reason in the first line, or right all the same; never with an
//! impossible number.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::path::Path;

use freeswing::identify::{Identification, identify};
use freeswing::series::AngleSeries;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use rand_distr::{Distribution, StandardNormal};

/// What a careful colleague would do.
enum Wanted {
    /// Not use the table, and say this.
    Refuses(&'static str),
    /// Give no mode, and say this.
    NoMode(&'static str),
    /// Give numbers with this doubt in the first line.
    Doubts(&'static str),
    /// Give numbers with this among the notes.
    Notes(&'static str),
    /// Give this frequency (Hz) to 1 %.
    Right(f64),
}
use Wanted::{Doubts, NoMode, Notes, Refuses, Right};

const F_HZ: f64 = 1.36;

/// Two rods of a strip in their slowest mode, with a pendulum's loss of frequency, seen with noise.
struct Rows {
    t_s: Vec<f64>,
    theta: [Vec<f64>; 2],
}

fn swing(duration_s: f64, rate_hz: f64) -> Rows {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(12);
    let t_s: Vec<f64> = (0..(duration_s * rate_hz) as usize).map(|k| k as f64 / rate_hz).collect();
    let xi = 0.004;
    let mut phase = 0.0;
    let mut theta = [Vec::new(), Vec::new()];
    for t in &t_s {
        let amplitude = 0.4 * (-xi * TAU * F_HZ * t).exp();
        phase += TAU * F_HZ * (1.0 - amplitude * amplitude / 16.0) / rate_hz;
        for (link, scale) in [1.0, 1.3].into_iter().enumerate() {
            let noise: f64 = StandardNormal.sample(&mut rng);
            theta[link].push(scale * amplitude * phase.cos() + 1e-3 * noise);
        }
    }
    Rows { t_s, theta }
}

impl Rows {
    fn table(&self, row: impl Fn(usize, f64, [f64; 2]) -> String) -> String {
        let mut text = "t_s,theta1_rad,theta2_rad\n".to_owned();
        for (k, t) in self.t_s.iter().enumerate() {
            let _ = writeln!(text, "{}", row(k, *t, [self.theta[0][k], self.theta[1][k]]));
        }
        text
    }

    /// Other times and angles in the same columns.
    fn with(&self, time: impl Fn(usize, f64) -> f64, angle: impl Fn(usize, f64, f64) -> f64) -> String {
        self.table(|k, t, [a, b]| format!("{:.9},{:.9},{:.9}", time(k, t), angle(0, t, a), angle(1, t, b)))
    }

    /// The first angle alone.
    fn first(&self, time: impl Fn(usize, f64) -> f64, angle: impl Fn(f64, f64) -> f64) -> String {
        let mut text = "t_s,theta1_rad\n".to_owned();
        for (k, t) in self.t_s.iter().enumerate() {
            let _ = writeln!(text, "{:.9},{:.9}", time(k, *t), angle(*t, self.theta[0][k]));
        }
        text
    }
}

/// The same noise in each run.
fn noise(k: usize) -> f64 {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(k as u64);
    StandardNormal.sample(&mut rng)
}

fn units() -> Vec<(&'static str, String, Wanted)> {
    let s = swing(25.0, 30.0);
    let same = |_: usize, t: f64| t;
    vec![
        ("degrees in columns named rad", s.with(same, |_, _, a| a.to_degrees()), Refuses("looks like degrees")),
        ("degrees of a swing of 6°", s.with(same, |_, _, a| 0.25 * a.to_degrees()), Refuses("looks like degrees")),
        ("degrees of a swing of 2°", s.with(same, |_, _, a| 0.1 * a.to_degrees()), Doubts("if these are degrees")),
        (
            "one angle in degrees of a swing of 1°",
            s.first(same, |t, _| 1.1 * (-0.03 * t).exp() * (8.5 * t).cos() + 1e-3 * noise((1e4 * t) as usize)),
            Doubts("are the angles in degrees"),
        ),
        (
            "one angle in degrees of a swing of half a degree",
            s.first(same, |t, _| 0.5 * (-0.03 * t).exp() * (8.5 * t).cos() + 1e-3 * noise((1e4 * t) as usize)),
            Notes("the true angles are"),
        ),
        ("milliradians", s.with(same, |_, _, a| 1e3 * a), Refuses("looks like degrees")),
        (
            "a column named deg",
            s.with(same, |_, _, a| a).replace("_rad", "_deg"),
            Refuses("no column `theta1_rad` but `theta1_deg`"),
        ),
        ("milliseconds", s.with(|_, t| 1e3 * t, |_, _, a| a), Doubts("is t_s in milliseconds")),
        ("microseconds", s.with(|_, t| 1e6 * t, |_, _, a| a), Doubts("is t_s in milliseconds")),
        ("nanoseconds since 1970", s.with(|_, t| 1.6e18 + 1e9 * t, |_, _, a| a), Doubts("is t_s in milliseconds")),
        ("minutes", s.with(|_, t| t / 60.0, |_, _, a| a), Doubts("is t_s in minutes?")),
        ("hours", s.with(|_, t| t / 3600.0, |_, _, a| a), Doubts("is t_s in minutes?")),
        ("frame numbers", s.with(|k, _| k as f64, |_, _, a| a), Doubts("is it a frame number?")),
        ("frame numbers from 1", s.with(|k, _| (k + 1) as f64, |_, _, a| a), Doubts("is it a frame number?")),
        ("seconds since 1970", s.with(|_, t| 1.7e9 + t, |_, _, a| a), Right(F_HZ)),
        ("negative times", s.with(|_, t| t - 100.0, |_, _, a| a), Right(F_HZ)),
        ("angles from the upward vertical", s.with(same, |_, _, a| PI + a), Right(F_HZ)),
        (
            "angles from the upward vertical, wrapped",
            s.with(same, |_, _, a| (PI + a).sin().atan2((PI + a).cos())),
            Right(F_HZ),
        ),
        ("angles a full turn off", s.with(same, |_, _, a| a + TAU), Right(F_HZ)),
        ("sines of the angles", s.with(same, |_, _, a| a.sin()), Right(F_HZ)),
        ("angles of the wrong sign", s.with(same, |_, _, a| -a), Right(F_HZ)),
    ]
}

fn columns() -> Vec<(&'static str, String, Wanted)> {
    let s = swing(25.0, 30.0);
    let good = s.table(|_, t, [a, b]| format!("{t:.6},{a:.6},{b:.6}"));
    vec![
        (
            "angles exchanged",
            s.table(|_, t, [a, b]| format!("{t:.6},{b:.6},{a:.6}")),
            Doubts("are the columns exchanged"),
        ),
        (
            "the second angle from link 1",
            s.table(|_, t, [a, b]| format!("{t:.6},{a:.6},{:.6}", b - a)),
            Doubts("measured from link 1"),
        ),
        (
            "time and angle exchanged",
            s.table(|_, t, [a, b]| format!("{a:.6},{t:.6},{b:.6}")),
            Refuses("sort the rows by time"),
        ),
        ("the same column twice", s.table(|_, t, [a, _]| format!("{t:.6},{a:.6},{a:.6}")), Right(F_HZ)),
        ("the time as an angle", s.table(|_, t, [a, _]| format!("{t:.6},{a:.6},{t:.6}")), NoMode("θ2 turns over")),
        (
            "a constant angle",
            s.table(|_, t, [a, _]| format!("{t:.6},{a:.6},0.25")),
            Refuses("theta2_rad stays at 0.25"),
        ),
        ("all zero", s.table(|_, t, _| format!("{t:.6},0,0")), Refuses("theta1_rad stays at 0")),
        ("no header", good.lines().skip(1).collect::<Vec<_>>().join("\n"), Refuses("no header")),
        ("semicolons", good.replace(',', ";"), Refuses("separated by semicolons")),
        ("tabs", good.replace(',', "\t"), Refuses("separated by tabs")),
        (
            "commas in the numbers",
            s.table(|_, t, [a, b]| format!("{t:.3},{a:.6},{b:.6}").replace('.', ",")),
            Refuses("fields where the header names"),
        ),
        ("no time", good.replace("t_s,", "x,"), Refuses("no column `t_s`")),
        ("no first angle", good.replace("theta1_rad", "angle"), Refuses("no column `theta1_rad`")),
        ("a gap in the numbering", good.replace("theta2_rad", "theta3_rad"), Refuses("no column `theta2_rad`")),
        ("two times", good.replace("theta2_rad", "t_s"), Refuses("two columns are called `t_s`")),
        ("units in the fields", good.replace("\n0.100000,", "\n0.1 s,"), Refuses("is not a number")),
        (
            "a second header within",
            good.replace("\n0.500000,", "\nt_s,theta1_rad,theta2_rad\n0.500000,"),
            Refuses("is not a number"),
        ),
        (
            "a comment line",
            good.replace("\n0.500000,", "\n# pause\n0.500000,"),
            Refuses("1 fields where the header names 3"),
        ),
        ("a page of the web", "<html><body>404</body></html>".to_owned(), Refuses("no column `t_s`")),
        ("nothing", String::new(), Refuses("the file is empty")),
        ("a header alone", "t_s,theta1_rad\n".to_owned(), Refuses("holds no row")),
    ]
}

fn rows() -> Vec<(&'static str, String, Wanted)> {
    let s = swing(25.0, 30.0);
    let good = s.table(|_, t, [a, b]| format!("{t:.6},{a:.6},{b:.6}"));
    let first = |rows: usize| good.lines().take(rows + 1).collect::<Vec<_>>().join("\n");
    let every = |step: usize| {
        good.lines()
            .enumerate()
            .filter(|(k, _)| *k == 0 || k % step == 1)
            .map(|(_, l)| l)
            .collect::<Vec<_>>()
            .join("\n")
    };
    vec![
        ("one row", first(1), Refuses("holds one row")),
        ("seven rows", first(7), Refuses("holds 7 rows")),
        ("half a cycle", first(11), NoMode("not identifiable")),
        ("one cycle", first(22), NoMode("not identifiable")),
        ("cut off within a row", good[..good.len() - 12].to_owned(), Refuses("fields where the header names")),
        (
            "not a number",
            good.replace("\n0.100000,", "\n0.100000,NaN,0.1\n0.11,"),
            Refuses("leave a missing value's field empty"),
        ),
        (
            "infinity",
            good.replace("\n0.100000,", "\n0.100000,inf,0.1\n0.11,"),
            Refuses("leave a missing value's field empty"),
        ),
        ("all missing", s.table(|_, t, _| format!("{t:.6},,")), Refuses("has 0 values")),
        ("one angle missing", s.table(|_, t, [a, _]| format!("{t:.6},{a:.6},")), Refuses("theta2_rad has 0 values")),
        (
            "every other value missing",
            s.table(|k, t, [a, b]| if k % 2 == 0 { format!("{t:.6},{a:.6},{b:.6}") } else { format!("{t:.6},,") }),
            Right(F_HZ),
        ),
        (
            "a long gap",
            s.table(
                |_, t, [a, b]| {
                    if (8.0..15.0).contains(&t) { format!("{t:.6},,") } else { format!("{t:.6},{a:.6},{b:.6}") }
                },
            ),
            Right(F_HZ),
        ),
        ("a repeated time", good.replace("\n0.100000,", "\n0.066667,"), Refuses("stands twice")),
        ("a decreasing time", good.replace("\n0.100000,", "\n0.05,"), Refuses("sort the rows by time")),
        (
            "rows in reverse",
            {
                let mut lines: Vec<&str> = good.lines().collect();
                lines[1..].reverse();
                lines.join("\n")
            },
            Refuses("sort the rows by time"),
        ),
        (
            "a pause of an hour",
            s.with(|_, t| if t < 12.0 { t } else { t + 3600.0 }, |_, _, a| a),
            Doubts("of the record is missing"),
        ),
        ("too slow a camera", every(45), NoMode("not identifiable")),
        ("a huge value", good.replace("\n5.000000,", "\n5.000000,1e30,0\n5.01,"), Notes("apart from the neighbours")),
        ("a huge value", good.replace("\n5.000000,", "\n5.000000,1e30,0\n5.01,"), Right(1.36)),
        ("huge values", s.with(|_, t| t, |_, _, a| 1e300 * a), Refuses("looks like degrees")),
        ("tiny values", s.with(|_, t| t, |_, _, a| 1e-9 * a), Refuses("nothing swings")),
    ]
}

fn motions() -> Vec<(&'static str, String, Wanted)> {
    let s = swing(25.0, 30.0);
    let same = |_: usize, t: f64| t;
    let k = |t: f64| (30.0 * t).round() as usize;
    vec![
        ("noise alone", s.first(same, |t, _| 0.01 * noise(k(t))), NoMode("as noise alone gives")),
        ("a ramp", s.first(same, |t, _| 0.01 * t + 1e-4 * noise(k(t))), NoMode("not identifiable")),
        (
            "a step",
            s.first(same, |t, _| if t < 11.0 { 0.0 } else { 0.3 } + 1e-4 * noise(k(t))),
            NoMode("not identifiable"),
        ),
        ("a creep", s.first(same, |t, _| 0.3 * (-t / 3.0).exp() + 1e-4 * noise(k(t))), NoMode("not identifiable")),
        ("one slow bend", s.first(same, |t, _| 0.3 * (t / 8.0).sin() + 1e-4 * noise(k(t))), NoMode("not identifiable")),
        (
            "a swing that dies within a cycle",
            s.first(same, |t, _| 0.3 * (-5.0 * t).exp() * (8.5 * t).cos() + 1e-4 * noise(k(t))),
            NoMode("not identifiable"),
        ),
        ("a swing on a ramp", s.with(same, |_, t, a| a + 0.1 * t), Right(F_HZ)),
        ("a swing on a step", s.with(same, |_, t, a| if t < 11.0 { a } else { a + 0.2 }), Right(F_HZ)),
        ("turning over throughout", s.first(same, |t, _| 7.0 * t), NoMode("turns over")),
        ("turning over, wrapped", s.first(same, |t, _| (7.0 * t).sin().atan2((7.0 * t).cos())), NoMode("turns over")),
        (
            "turning over, then a swing",
            s.first(same, |t, _| if t < 8.0 { 5.0 * t } else { 40.0 + 0.3 * (TAU * F_HZ * (t - 8.0)).sin() }),
            Doubts("--from"),
        ),
        ("swinging wide, then small", s.with(same, |_, t, a| if t < 6.0 { 5.0 * a } else { a }), Doubts("--from")),
        ("steady rotation to and fro", s.first(same, |t, _| 40.0 * (0.9 * t).sin()), Refuses("looks like degrees")),
        (
            "a random walk",
            s.first(same, {
                let mut sum = 0.0;
                let walk: Vec<f64> = (0..750)
                    .map(|k| {
                        sum += 0.01 * noise(k);
                        sum
                    })
                    .collect();
                move |t, _| walk[k(t).min(749)]
            }),
            NoMode("not identifiable"),
        ),
    ]
}

fn numbers_are_possible(found: &Identification) -> Result<(), String> {
    let nyquist_hz = 0.5 / found.record.step_s;
    for mode in &found.modes {
        let frequencies = mode.estimators.iter().filter_map(|e| e.frequency_hz).chain([mode.frequency_hz]);
        for f in frequencies {
            if !(0.0 <= f.low && f.low <= f.value && f.value <= f.high && f.high <= 1.6 * nyquist_hz) {
                return Err(format!("{f:?}"));
            }
        }
        let dampings = mode.estimators.iter().filter_map(|e| e.damping_ratio).chain(mode.damping.interval().copied());
        for xi in dampings {
            if !(-1.0 <= xi.low && xi.low <= xi.high && xi.high <= 1.0) {
                return Err(format!("{xi:?}"));
            }
        }
        if mode.shape.iter().any(|l| !(l.amplitude_rad < 15.0)) {
            return Err(format!("{:?}", mode.shape));
        }
    }
    Ok(())
}

/// What is wrong with an answer.
fn judged(text: &str, wanted: &Wanted) -> Result<(), String> {
    let answer = AngleSeries::parse(text.as_bytes(), Path::new("a.csv")).and_then(|series| identify(&series, None));
    let found = match (answer, wanted) {
        (Err(error), Refuses(says)) => {
            let line = error.to_string();
            return if line.contains(says) && !line.contains('\n') { Ok(()) } else { Err(line) };
        }
        (Err(error), _) => return Err(format!("refused: {error}")),
        (Ok(found), _) => found,
    };
    numbers_are_possible(&found)?;
    let fine = match wanted {
        Refuses(_) => false,
        NoMode(says) => found.modes.is_empty() && found.summary.contains(says),
        Doubts(says) => found.summary.contains(says),
        Notes(says) => found.notes.iter().any(|n| n.contains(says)),
        Right(f_hz) => found.modes.first().is_some_and(|m| (m.frequency_hz.value / f_hz - 1.0).abs() < 0.01),
    };
    if fine { Ok(()) } else { Err(found.summary) }
}

#[test]
fn seventy_wrong_inputs_are_answered_as_a_careful_colleague_would() {
    let cases: Vec<_> = units().into_iter().chain(columns()).chain(rows()).chain(motions()).collect();
    assert!(cases.len() >= 70, "{}", cases.len());
    let wrong: Vec<String> = cases
        .iter()
        .filter_map(|(name, text, wanted)| Some(format!("{name}: {}", judged(text, wanted).err()?)))
        .collect();
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}
