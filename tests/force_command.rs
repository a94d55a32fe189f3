//! `freeswing force` as a user types it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use assert_cmd::cargo::cargo_bin;
use serde_json::Value;

const FILM: &str = r#"
[specimen]
name = "Kapton 1 mil"
length_m = 0.20
width_m = 0.05
thickness_m = 25.4e-6
density_kg_m3 = 1420
young_modulus_pa = 2.5e9
link_lengths_m = [0.10, 0.10]
reflectivity = { specular = 0.60, diffuse = 0.26, absorbed = 0.14 }
[light]
powers_w = [500.0, 1000.0, 2000.0]
distance_m = 1.0
[heat]
film = "Kapton"
[laser]
resolution_m = 1e-7
range_m = [-1e-3, 1e-3]
"#;

struct Desk(tempfile::TempDir);

impl Desk {
    fn new(config: &str) -> Self {
        let desk = Self(tempfile::tempdir().unwrap());
        std::fs::write(desk.path("film.toml"), config).unwrap();
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn force(&self, more: &[&str]) -> Output {
        let mut command = Command::new(cargo_bin("freeswing"));
        command.current_dir(&self.0).args(["force", "--config", "film.toml"]).args(more).output().unwrap()
    }

    fn json(&self, more: &[&str]) -> Value {
        let output = self.force(&[&["--json", "-"], more].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    }

    /// The one line of an error.
    fn refused(&self, more: &[&str]) -> String {
        let output = self.force(more);
        let line = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{line}");
        assert_eq!(line.lines().count(), 1, "{line}");
        assert!(output.stdout.is_empty());
        line
    }
}

/// What was printed, as one line.
fn unwrapped(output: Output) -> String {
    String::from_utf8(output.stdout).unwrap().split_whitespace().collect::<Vec<_>>().join(" ")
}

fn number(value: &Value, path: &str) -> f64 {
    value.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path} of {value}"))
}

#[test]
fn the_papers_lamp_pushes_by_a_micrometre_and_its_heat_curls_by_more() {
    let force = Desk::new(FILM).json(&[]);
    assert_eq!(force["schema"], "freeswing.force/1");
    assert!((number(&force, "/flux_w_m2") - 318.31).abs() < 0.01);
    assert!((number(&force, "/force_n") / 1.8829e-8 - 1.0).abs() < 1e-3);
    let tip = &force["points"][1];
    assert_eq!(number(tip, "/s_m"), 0.2);
    // a uniform push turns a hinged strip by force over weight
    let expected_m = 0.2 * number(&force, "/force_n") / number(&force, "/weight_n");
    assert!((number(tip, "/strip_m") / expected_m - 1.0).abs() < 1e-6);
    assert!((number(tip, "/multibody_m") / expected_m - 1.0).abs() < 1e-6);
    assert!(number(tip, "/heat_m") > 2.0 * number(tip, "/strip_m"));
    assert!((number(tip, "/total_m") - number(tip, "/strip_m") - number(tip, "/heat_m")).abs() < 1e-15);
    let sweep = force["sweep"].as_array().unwrap();
    assert_eq!(sweep.len(), 3);
    let ratio = number(&sweep[2], "/strip_m") / number(&sweep[0], "/strip_m");
    assert!((ratio - 4.0).abs() < 1e-4, "{ratio}");
}

#[test]
fn the_page_says_which_is_larger_and_shows_the_papers_errors_beside() {
    let desk = Desk::new(FILM);
    let output = desk.force(&["--figure", "force.svg"]);
    let page = unwrapped(output);
    assert!(page.contains("heat is the larger"), "{page}");
    assert!(page.contains("Multibody and strip agree on the push"), "{page}");
    assert!(page.contains("-8.28") && page.contains("+6.48"), "{page}");
    let figure = std::fs::read_to_string(desk.path("force.svg")).unwrap();
    assert!(figure.contains("push, strip") && figure.contains("heat"), "{figure}");
}

#[test]
fn any_point_can_be_asked_for_and_none_off_the_strip() {
    let desk = Desk::new(FILM);
    let points = desk.json(&["--at-m", "0.05,0.15"])["points"].clone();
    let places: Vec<f64> = points.as_array().unwrap().iter().map(|p| number(p, "/s_m")).collect();
    assert_eq!(places, [0.05, 0.1, 0.15, 0.2]);
    // a hinged strip turns as a whole
    assert!((number(&points[0], "/strip_m") / number(&points[3], "/strip_m") - 0.25).abs() < 1e-6);
    assert!(desk.refused(&["--at-m", "0.25"]).contains("--at-m: 0.25 is not on the strip"));
}

#[test]
fn without_heat_only_the_push_is_told() {
    let config = FILM.replace("[heat]\nfilm = \"Kapton\"\n", "");
    let force = Desk::new(&config).json(&[]);
    assert!(force["points"][0]["heat_m"].is_null() && force["heat"].is_null());
    let page = unwrapped(Desk::new(&config).force(&[]));
    assert!(page.contains("Heat is not computed"), "{page}");
}

#[test]
fn a_clamp_says_why_the_chain_is_not_compared() {
    let config = FILM.replace("[light]", "[rig]\nsupport = \"clamped\"\n[light]");
    let desk = Desk::new(&config);
    assert!(desk.json(&[])["points"][1]["multibody_m"].is_null());
    let page = unwrapped(desk.force(&[]));
    assert!(page.contains("the chain of links can only hang from a hinge"), "{page}");
}

#[test]
fn a_displacement_beyond_the_sensor_is_said() {
    let desk = Desk::new(&FILM.replace("range_m = [-1e-3, 1e-3]", "range_m = [-1e-7, 1e-7]"));
    let warning = String::from_utf8(desk.force(&[]).stderr).unwrap();
    assert!(warning.contains("warning") && warning.contains("beyond laser.range_m"), "{warning}");
}

#[test]
fn bad_input_is_one_line_that_names_the_key() {
    let with = |from: &str, to: &str| Desk::new(&FILM.replace(from, to)).refused(&[]);
    assert!(with("[500.0, ", "[-500.0, ").contains("light.powers_w[0] = -500: must be zero or a positive number"));
    assert!(with("specular = 0.60", "specular = 0.90").contains("sum to 1.3; they must sum to 1"));
    assert!(with("absorbed = 0.14", "absorbed = 1.14").contains("reflectivity.absorbed = 1.14"));
    assert!(with("resolution_m", "height_m = 0.3\nresolution_m").contains("laser.height_m = 0.3: not on the strip"));
    assert!(with("[-1e-3, 1e-3]", "[1e-3, -1e-3]").contains("laser.range_m"));
    assert!(with("distance_m = 1.0", "distance_m = 0.0").contains("light.distance_m = 0: must be a positive number"));
    assert!(with("distance_m = 1.0", "").contains("light.distance_m is missing"));
    assert!(with("powers_w = [500.0, 1000.0, 2000.0]", "").contains("light.power_w is missing"));
    assert!(with("[light]\npowers_w = [500.0, 1000.0, 2000.0]\ndistance_m = 1.0", "").contains("[light] is missing"));
    assert!(with("film = \"Kapton\"", "").contains("film.toml: heat.emissivity_front is missing"));
    assert!(with("young_modulus_pa = 2.5e9", "").contains("specimen.thickness_m and specimen.young_modulus_pa"));
    assert!(with("film = \"Kapton\"", "film = \"Teflon\"").contains("Teflon"));
    assert!(with("distance_m = 1.0", "distance_m = 1.0\ndirection_deg = 95.0").contains("light.direction_deg"));
    assert!(with("distance_m = 1.0", "distance_m = 1.0\nwindow = 1.5").contains("light.window"));
    assert!(with("distance_m = 1.0", "distance_m = 1.0\non_s = [5.0, 3.0]").contains("times must rise"));
}

#[test]
fn a_plan_gets_cheaper_with_time_and_with_chopping() {
    let desk = Desk::new(FILM);
    let plan = |time: &str| desk.json(&["--plan", "--damping-ratio", "0.02", "--time-s", time]);
    let (short, long) = (plan("100"), plan("400"));
    let ratio = number(&short, "/steps/relative_interval") / number(&long, "/steps/relative_interval");
    assert!((ratio - 2.0).abs() < 1e-9);
    // √2 of signal over noise, the square wave's 2/π, and the mode's 1/2ξ with its share of the push
    let gain = number(&long, "/gain");
    let most = std::f64::consts::SQRT_2 * 2.0 / std::f64::consts::PI / (2.0 * 0.02);
    assert!(gain > 0.9 * most && gain < 1.15 * most, "{gain} {most}");
    // however easy the wish, a swing has to die away after on and off, and to build up
    let easy = desk.json(&["--plan", "--damping-ratio", "0.02", "--interval", "0.5"]);
    for (way, settlings) in [("steps", 2.0), ("chopped", 1.0)] {
        let of = |key: &str| number(&easy, &format!("/{way}/{key}"));
        assert!(of("shortest_time_s") > settlings * of("settling_s"), "{way}");
    }
    let text = String::from_utf8(desk.force(&["--plan", "--damping-ratio", "0.02"]).stdout).unwrap();
    assert!(text.contains("Chopping") && text.contains("least power"), "{text}");
    assert!(desk.refused(&["--plan"]).contains("--damping-ratio"));
    assert!(desk.refused(&["--plan", "--damping-ratio", "0.02", "--interval", "-1"]).contains("--interval"));
}

#[test]
fn the_trace_swings_about_the_push_and_comes_to_rest_on_it() {
    let config = FILM.replace("[heat]\nfilm = \"Kapton\"\n", "").replace("[light]", "[light]\non_s = [1.0]");
    let desk = Desk::new(&config);
    let output = desk.force(&["--trace", "t.csv", "--duration-s", "60", "--rate-hz", "50", "--damping-ratio", "0.05"]);
    assert!(output.status.success());
    let mut table = csv::Reader::from_path(desk.path("t.csv")).unwrap();
    let rows: Vec<Vec<String>> = table.records().map(|r| r.unwrap().iter().map(str::to_owned).collect()).collect();
    assert_eq!(rows.len(), 3001);
    let um = |row: &[String]| row[5].parse::<f64>().unwrap();
    assert!(rows[..50].iter().all(|row| um(row) == 0.0));
    let still_um = 1e6 * number(&desk.json(&[]), "/points/1/strip_m");
    let highest = rows.iter().map(|row| um(row)).fold(0.0, f64::max);
    assert!(highest > 1.7 * still_um && highest < 2.1 * still_um, "{highest} {still_um}");
    assert!((um(&rows[3000]) / still_um - 1.0).abs() < 1e-3, "{} {still_um}", um(&rows[3000]));
}

#[test]
fn a_chopped_trace_settles_at_the_amplitude_that_the_plan_says() {
    let plan = Desk::new(FILM).json(&["--plan", "--damping-ratio", "0.05"]);
    let (hz, push_m) = (number(&plan, "/first_mode_hz"), number(&plan, "/chopped/push_m"));
    let config = FILM.replace("[light]", &format!("[light]\non_s = [0.0]\nchop_hz = {hz:.9}"));
    let desk = Desk::new(&config);
    desk.force(&["--trace", "t.csv", "--duration-s", "60", "--damping-ratio", "0.05"]);
    let mut table = csv::Reader::from_path(desk.path("t.csv")).unwrap();
    let push_um: Vec<f64> = table.records().map(|r| r.unwrap()[3].parse().unwrap()).skip(5000).collect();
    let (low, high) = push_um.iter().fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(*v), high.max(*v)));
    let amplitude_um = 0.5 * (high - low);
    assert!((amplitude_um / (1e6 * push_m) - 1.0).abs() < 0.03, "{amplitude_um} {push_m:e}");
}

#[test]
fn a_figure_is_svg_and_a_point_above_the_hinge_is_off_the_strip() {
    let desk = Desk::new(FILM);
    assert!(desk.refused(&["--figure", "x.png"]).contains("--figure: x.png: figures are SVG; name it x.svg"));
    let line = desk.refused(&["--at-m", "-0.1"]);
    assert!(line.contains("-0.1") && !line.contains("unexpected"), "{line}");
    assert_eq!(desk.refused(&["--at-m", "-0.1,0.1"]), line);
}

#[test]
fn nothing_is_written_where_something_is_wrong() {
    let desk = Desk::new(&FILM.replace("absorbed = 0.14", "absorbed = 0.5"));
    desk.refused(&["--json", "force.json", "--trace", "t.csv"]);
    let left = |name: &str| Path::exists(&desk.path(name));
    assert!(!left("force.json") && !left("t.csv"));
}
