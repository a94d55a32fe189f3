//! `freeswing identify` as a user types it: what it prints, what it writes, what it refuses.

use std::fmt::Write as _;
use std::io::Read as _;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use assert_cmd::cargo::CommandCargoExt;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use tempfile::TempDir;

/// A swing of two links, a row every 1/30 s.
fn table(seconds: f64, angle: impl Fn(f64) -> [String; 2]) -> String {
    let mut text = "t_s,theta1_rad,theta2_rad\n".to_owned();
    for row in 0..(30.0 * seconds) as usize {
        let t = row as f64 / 30.0;
        let [a, b] = angle(t);
        let _ = writeln!(text, "{t:.6},{a},{b}");
    }
    text
}

fn swing(t: f64) -> [f64; 2] {
    let a = 0.3 * (-0.04 * t).exp() * (8.5 * t).cos() + 2e-4 * (1000.0 * t * t).sin();
    [a, 1.2 * a + 1e-4 * (777.0 * t * t).cos()]
}

fn good() -> String {
    table(25.0, |t| swing(t).map(|a| format!("{a:.6}")))
}

struct Bench {
    folder: TempDir,
}

impl Bench {
    fn with(text: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.csv"), text).unwrap();
        Self { folder }
    }

    fn run(&self, arguments: &[&str]) -> Output {
        let mut command = Command::cargo_bin("freeswing").unwrap();
        command.current_dir(self.folder.path()).arg("identify").args(arguments).output().unwrap()
    }

    /// One line on standard error, exit code 2, nothing written or printed.
    fn refuses(&self, arguments: &[&str], says: &str) {
        let output = self.run(arguments);
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {error}");
        assert_eq!((error.lines().count(), error.contains(says)), (1, true), "wanted `{says}`, got {error}");
        assert!(output.stdout.is_empty() && !self.folder.path().join("out.json").exists());
    }
}

/// Ten seconds of x = L sin θ, which has a third harmonic that is no mode. Nobody knows what angle it is of: where it decays, that shows how amplitude acts on its
/// frequency; where it does not, the frequency is that at an amplitude.
#[test]
fn a_short_displacement_of_a_wide_swing_tells_its_frequency_at_small_amplitude_where_it_decays() {
    let (printed, json) = of_a_wide_swing(0.05);
    let first = printed.lines().next().unwrap();
    assert!(first.contains("% at small amplitude") && !first.contains("f₂"), "{first}");
    let f = &json["modes"][0]["frequency_hz"];
    let [low, high] = ["low", "high"].map(|end| f[end].as_f64().unwrap() * std::f64::consts::TAU);
    assert!(low < 5.1 && 5.1 < high && high - low < 3e-3, "{f}");
    let (printed, json) = of_a_wide_swing(0.0);
    let first = printed.lines().next().unwrap();
    assert!(first.contains("Hz at an amplitude of 1") && first.contains(" px") && !first.contains("f₂"), "{first}");
    let amplitude_px = json["modes"][0]["frequency_at_amplitude_px"].as_f64().unwrap();
    assert!((100.0..160.0).contains(&amplitude_px), "{amplitude_px}");
}

/// What is printed, and the JSON, of a pendulum of 5.1 rad/s that is let go at 0.6 rad, with this damping of the angular acceleration, 1/s.
fn of_a_wide_swing(damping_per_s: f64) -> (String, serde_json::Value) {
    let (omega, amplitude, length_px) = (5.1_f64, 0.6_f64, 270.0);
    let mut text = "t_s,m1_x_px,displacement_px,displacement_sd_px\n".to_owned();
    let (mut angle, mut rate) = (amplitude, 0.0);
    for row in 0..300 {
        let d = length_px * angle.sin() + 0.03 * (1000.0 * f64::from(row * row)).sin();
        let _ = writeln!(text, "{:.6},{:.4},{d:.4},0.03", f64::from(row) / 30.0, 300.0 + d);
        for _ in 0..100 {
            // half a step of the rate on either side of the angle's (leapfrog)
            let (step_s, push) =
                (1.0 / 3000.0, |angle: f64, rate: f64| -omega * omega * angle.sin() - damping_per_s * rate);
            rate += 0.5 * step_s * push(angle, rate);
            angle += step_s * rate;
            rate += 0.5 * step_s * push(angle, rate);
        }
    }
    let bench = Bench::with(&text);
    let output = bench.run(&["a.csv", "--json", "out.json"]);
    let printed = String::from_utf8(output.stdout).unwrap();
    let json = std::fs::read_to_string(bench.folder.path().join("out.json")).unwrap();
    (printed, serde_json::from_str(&json).unwrap())
}

#[test]
fn a_displacement_has_a_frequency_and_a_damping_and_sizes_in_pixels() {
    let mut text = "t_s,m1_x_px,displacement_px,displacement_sd_px\n".to_owned();
    for row in 0..750 {
        let t = f64::from(row) / 30.0;
        // a ball on a spring, 60 px, 1.4 Hz, ξ = 0.01
        let d = 60.0 * (-0.01 * 8.8 * t).exp() * (8.8 * t).cos() + 0.05 * (1000.0 * t * t).sin();
        let _ = writeln!(text, "{t:.6},{:.4},{d:.4},0.05", 300.0 + d);
    }
    let bench = Bench::with(&text);
    let output = bench.run(&["a.csv", "--json", "out.json"]);
    let printed = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(printed.contains("the displacement of one mark") && printed.contains(" px"), "{printed}");
    assert!(!printed.contains('°') && !printed.contains('θ') && !printed.contains("rad"), "{printed}");
    let json = std::fs::read_to_string(bench.folder.path().join("out.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let mode = &json["modes"][0];
    let holds = |value: &serde_json::Value, truth: f64| {
        let [low, high] = ["low", "high"].map(|end| value[end].as_f64().unwrap());
        assert!(low <= truth && truth <= high && high - low < 0.2 * truth, "{truth}: {value}");
    };
    // the undamped frequency of a decay at 0.088 /s
    holds(&mode["frequency_hz"], 8.8f64.hypot(0.088) / std::f64::consts::TAU);
    holds(&mode["damping"]["identified"], 0.01);
    let amplitude_px = mode["shape"][0]["amplitude_px"].as_f64().unwrap();
    assert!((10.0..=61.0).contains(&amplitude_px), "{amplitude_px}");
    let noise_px = json["record"]["noise_px"][0].as_f64().unwrap();
    assert!((0.02..0.06).contains(&noise_px), "{noise_px}");
    assert!(json["record"].get("noise_rad").is_none());
}

#[test]
fn the_table_and_the_json_tell_the_same() {
    let bench = Bench::with(&good());
    let config = "[specimen]\nmass_kg = 0.3606e-3\nlink_lengths_m = [0.10, 0.10]\n[rig]\ngravity_m_s2 = 9.80665\n";
    std::fs::write(bench.folder.path().join("e.toml"), config).unwrap();
    let output = bench.run(&["a.csv", "--config", "e.toml", "--json", "out.json"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    for word in
        ["Mode 1", "spectrum", "half power", "decrement", "damped sinusoids", "envelope", "Floor", "K_eq", "N·s/m"]
    {
        assert!(text.contains(word), "{word} in {text}");
    }
    let json = std::fs::read_to_string(bench.folder.path().join("out.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["schema"], "freeswing.identify/1");
    let mode = &json["modes"][0];
    let f = mode["frequency_hz"]["value"].as_f64().unwrap();
    assert!((f * std::f64::consts::TAU - 8.5f64.hypot(0.04)).abs() < 0.002, "{f}");
    assert!((mode["damping"]["identified"]["value"].as_f64().unwrap() * 8.5 / 0.04 - 1.0).abs() < 0.02);
    let methods: Vec<_> =
        mode["estimators"].as_array().unwrap().iter().map(|e| e["method"].as_str().unwrap()).collect();
    assert_eq!(methods, ["spectrum", "half_power", "decrement", "sinusoids", "envelope", "modulated"]);
    let k_eq = json["equivalents"]["k_eq_n_per_m"]["value"].as_f64().unwrap();
    assert!((k_eq / (0.3606e-3 * 8.5 * 8.5) - 1.0).abs() < 1e-3);
}

#[test]
fn json_to_standard_output_stands_alone_and_quiet_is_silent() {
    let bench = Bench::with(&good());
    let output = bench.run(&["a.csv", "--json", "-"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["record"]["source"], "a.csv");
    assert!(bench.run(&["a.csv", "--quiet"]).stdout.is_empty());
}

#[test]
fn the_table_may_come_from_standard_input() {
    let bench = Bench::with("");
    let mut command = assert_cmd::Command::cargo_bin("freeswing").unwrap();
    let output = command.args(["identify", "-"]).write_stdin(good()).output().unwrap();
    assert!(String::from_utf8(output.stdout).unwrap().contains("\nstandard input: 750 rows"));
    bench.refuses(&["a.csv"], "a.csv: the file is empty (0 bytes); record or copy it again");
}

#[test]
fn a_frequency_below_the_floor_is_named_with_what_mends_it() {
    let slow = good().lines().enumerate().fold(String::new(), |mut text, (row, line)| {
        let (t, rest) = line.split_once(',').unwrap();
        let _ = match t.parse::<f64>() {
            Ok(t) if row > 0 => writeln!(text, "{:.6},{rest}", 2.64 * t),
            _ => writeln!(text, "{line}"),
        };
        text
    });
    let bench = Bench::with(&slow);
    std::fs::write(
        bench.folder.path().join("e.toml"),
        "[specimen]\nmass_kg = 0.3606e-3\nlink_lengths_m = [0.10, 0.10]\n",
    )
    .unwrap();
    let text = String::from_utf8(bench.run(&["a.csv", "--config", "e.toml"]).stdout).unwrap();
    assert!(
        text.contains("is below the floor of 1.3400 Hz (the limp strip): time base, length or gravity is wrong"),
        "{text}"
    );
    assert!(text.contains("mended by time × 0.38"), "{text}");
}

#[test]
fn tables_that_are_no_swing_are_refused() {
    let degrees = table(25.0, |t| swing(t).map(|a| format!("{:.4}", a.to_degrees())));
    let still = table(25.0, |t| [format!("{:.6}", swing(t)[0]), "0.25".to_owned()]);
    let cases = [
        (good().replace("\n0.100000,", "\n0.100000,NaN"), "a.csv:5: theta1_rad = `NaN0."),
        (good().replace("\n0.100000,", "\n0.066667,"), "a.csv:5: t_s = 0.066667 stands twice; keep one row an instant"),
        (good().replace("\n0.100000,", "\n0.05,"), "a.csv:5: t_s = 0.05 follows 0.066667; sort the rows by time"),
        (good().lines().take(2).collect::<Vec<_>>().join("\n"), "a.csv: holds one row; a swing needs at least 8"),
        ("t_s,theta1_rad\n".to_owned(), "a.csv: holds no row of numbers; measure the recording again"),
        (degrees, "looks like degrees; multiply by π/180"),
        (still, "a.csv: theta2_rad stays at 0.25: nothing swings; check the marks and the column"),
        (good().replace("theta1_rad", "angle"), "a.csv:1: no column `theta1_rad` among t_s, angle, theta2_rad"),
        (good().replace(',', ";"), "a.csv:1: fields are separated by semicolons"),
        (
            table(1.0, |_| ["nan".to_owned(), String::new()]),
            "a.csv:2: theta1_rad = nan; leave a missing value's field empty",
        ),
        (
            table(1.0, |_| [String::new(), String::new()]),
            "a.csv: theta1_rad has 0 values in 30 rows; at least 8 are needed",
        ),
    ];
    for (text, says) in cases {
        Bench::with(&text).refuses(&["a.csv", "--json", "out.json"], says);
    }
}

#[test]
fn files_and_options_that_cannot_be_used_are_refused() {
    let bench = Bench::with(&good());
    let write = |name: &str, text: &str| std::fs::write(bench.folder.path().join(name), text).unwrap();
    bench.refuses(&["missing.csv"], "missing.csv: cannot be read");
    bench.refuses(&["."], ".: cannot be read");
    bench.refuses(&["a.csv", "--json", "nowhere/out.json"], "nowhere/out.json: cannot be written");
    let unwritable = bench.run(&["a.csv", "--json", "nowhere/out.json"]).stderr;
    assert!(!String::from_utf8_lossy(&unwritable).contains(".freeswing-"), "a temporary file says nothing to a user");
    bench.refuses(&["a.csv", "--json", "a.csv"], "--json: a.csv is an input and would be overwritten");
    bench.refuses(&["a.csv", "--from", "24.9"], "--from, --until: the stretch holds 3 rows; a swing needs at least 8");
    bench.refuses(&["a.csv", "--from", "90"], "the table runs from 0 s to 24.966667 s");
    bench.refuses(&["a.csv", "--from", "90"], "the stretch holds no row; widen it");
    bench.refuses(&["a.csv", "--from", "10", "--until", "5"], "--until: 5 s does not lie after --from 10 s");
    bench.refuses(&["a.csv", "--until", "0.5"], "is shorter than one swing, which takes 0.7");
    write("massless.toml", "[specimen]\nmass_kg = 0\n");
    bench.refuses(&["a.csv", "--config", "massless.toml"], "specimen.mass_kg = 0: must be a positive number");
    write("unknown.toml", "[specimen]\nmass = 1\n");
    bench.refuses(&["a.csv", "--config", "unknown.toml"], "unknown key `mass`; the nearest known one is `mass_kg`");
}

#[test]
fn short_gappy_and_noisy_tables_are_answered_without_a_panic() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    for case in 0..60 {
        let rows = rng.random_range(8..120);
        let mut text = "t_s,theta1_rad,theta2_rad\n".to_owned();
        let mut t = rng.random_range(-5.0..5.0);
        let (gap, noise) = (rng.random_range(0.0..0.6), rng.random_range(0.0..0.5));
        for _ in 0..rows {
            t += 10f64.powf(rng.random_range(-3.0..0.5));
            let field = |rng: &mut Xoshiro256PlusPlus| {
                let value = 0.2 * (7.0 * t).sin() + noise * rng.random_range(-1.0..1.0);
                if rng.random_bool(gap) { String::new() } else { format!("{value:.5}") }
            };
            let _ = writeln!(text, "{t:.6},{},{}", field(&mut rng), field(&mut rng));
        }
        let output = Bench::with(&text).run(&["a.csv"]);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(matches!(output.status.code(), Some(0 | 2)) && !error.contains("panicked"), "{case}: {error}\n{text}");
    }
}

#[test]
fn the_help_shows_examples() {
    let output = Bench::with("").run(&["--help"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("freeswing identify angles.csv --config experiment.toml --json identified.json"));
}

#[test]
fn the_first_line_is_the_answer_and_the_strongest_mode_stands_first() {
    let bench = Bench::with(&good());
    let text = String::from_utf8(bench.run(&["a.csv"]).stdout).unwrap();
    assert!(text.lines().next().unwrap().starts_with("f₁ = 1.352"), "{text}");
    let output = bench.run(&["a.csv", "--json", "out.json"]);
    assert!(output.status.success() && output.stderr.is_empty());
    let json = std::fs::read_to_string(bench.folder.path().join("out.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!(json["summary"].as_str().unwrap().starts_with("f₁ = 1.352"));
    assert_eq!((json["modes"][0]["number"].as_u64(), json["swing_mode"].as_u64()), (Some(1), Some(1)));
    assert!(json["tumbling"].is_null());
}

#[test]
fn an_answer_without_a_mode_is_no_silent_success() {
    let turning = table(25.0, |t| [3.0 * t, 2.0 * t].map(|a| format!("{a:.6}")));
    let bench = Bench::with(&turning);
    let output = bench.run(&["a.csv", "--json", "-"]);
    let warning = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), warning.lines().count()), (Some(0), 1), "{warning}");
    assert!(warning.starts_with("warning: a.csv: not identifiable: θ"), "{warning}");
    assert!(warning.contains("turns over until t = ") && warning.contains("record on until"), "{warning}");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["modes"].as_array().unwrap().len(), 0);
    let output = bench.run(&["a.csv", "--quiet"]);
    assert!(output.stderr.is_empty() && output.stdout.is_empty());
}

#[test]
fn a_recording_is_sent_to_track_and_a_table_to_identify() {
    let bench = Bench::with("");
    let write = |name: &str, bytes: &[u8]| std::fs::write(bench.folder.path().join(name), bytes).unwrap();
    write("swing.mp4", b"\0\0\0\x20ftypisom\0\0\x02\0");
    bench.refuses(&["swing.mp4"], "swing.mp4: is a video; run `track swing.mp4 --out angles.csv` first");
    write("angles.csv", good().as_bytes());
    let mut track = Command::cargo_bin("track").unwrap();
    let output = track.current_dir(bench.folder.path()).args(["angles.csv", "--out", "out.csv"]).output().unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), error.lines().count()), (Some(2), 1), "{error}");
    assert!(error.contains("angles.csv: not a video that can be opened: it is a table of text"), "{error}");
}

#[test]
fn a_figure_is_svg_by_name() {
    let bench = Bench::with(&good());
    let mut diagnose = Command::cargo_bin("freeswing").unwrap();
    diagnose.current_dir(bench.folder.path()).args(["diagnose", "a.csv", "--config", "e.toml", "--figure", "x.png"]);
    let output = diagnose.output().unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), error.lines().count()), (Some(2), 1), "{error}");
    assert!(error.contains("--figure: x.png: figures are SVG; name it x.svg"), "{error}");
}

#[test]
fn a_reader_that_has_seen_enough_is_no_failure() {
    let bench = Bench::with(&good());
    for arguments in [vec!["a.csv"], vec!["a.csv", "--json", "-"]] {
        let mut command = Command::cargo_bin("freeswing").unwrap();
        command.current_dir(bench.folder.path()).arg("identify").args(arguments);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(output.stderr.is_empty());
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_command_leaves_no_temporary_file() {
    for signal in ["-INT", "-TERM"] {
        let bench = Bench::with("");
        let names = || -> Vec<_> {
            let entries = std::fs::read_dir(bench.folder.path()).unwrap();
            entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
        };
        let mut command = Command::cargo_bin("freeswing").unwrap();
        command.current_dir(bench.folder.path()).args(["identify", "-", "--json", "out.json"]);
        // standard input stays open: the command waits for its table with the temporary file made
        let mut child = command.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        for _ in 0..3000 {
            if names().iter().any(|n| n.starts_with(".freeswing-")) {
                break;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        assert!(names().iter().any(|n| n.starts_with(".freeswing-")), "{:?}", names());
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        // `wait` would close it, and the command would see an empty table
        let _held_open = child.stdin.take();
        let status = child.wait().unwrap();
        let mut error = String::new();
        child.stderr.take().unwrap().read_to_string(&mut error).unwrap();
        assert_eq!((status.code(), error.as_str()), (Some(2), "error: interrupted; nothing was written\n"));
        assert_eq!(names(), ["a.csv"]);
    }
}
