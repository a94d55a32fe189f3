//! `freeswing modes` as a user types it.

use std::path::Path;

use assert_cmd::Command;
use predicates::str::contains;

fn modes(config: &Path) -> Command {
    let mut command = Command::cargo_bin("freeswing").unwrap();
    command.arg("modes").arg("--config").arg(config);
    command
}

fn config(text: &str) -> tempfile::NamedTempFile {
    let file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
    std::fs::write(file.path(), text).unwrap();
    file
}

const PAPER_RODS: &str = "[specimen]\nmass_kg = 0.3606e-3\nlink_lengths_m = [0.10, 0.10]\n[rig]\ngravity_m_s2 = 9.81\n[model]\nk_eq_n_m_per_rad = 0.0\nc_eq_n_m_s_per_rad = 0.0\n";

#[test]
fn the_table_shows_the_rods_the_printed_formula_and_the_floor() {
    let output = modes(config(PAPER_RODS).path()).assert().success();
    let text = String::from_utf8(output.get_output().stdout.clone()).unwrap();
    for expected in ["1.3489", "3.6180", "as printed", "ω² = -292.5", "uniform strip, limp          1.3403", "3.0765"]
    {
        assert!(text.contains(expected), "{expected} is missing in\n{text}");
    }
    assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
}

#[test]
fn the_recordings_strips_have_beam_modes() {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("videos/pet5.toml");
    let left_out = "Left out, having no linear part at rest: hinge_coulomb, air_quadratic.";
    modes(&config)
        .assert()
        .success()
        .stdout(contains("beam, clamped, without gravity  1.2912"))
        .stdout(contains(left_out));
}

#[test]
fn overdamped_motions_are_listed_as_such() {
    let stiff = config(
        "[specimen]\nmass_kg = 0.3606e-3\nlink_lengths_m = [0.10, 0.10]\n[model]\nk_eq_n_m_per_rad = 0.0258\nc_eq_n_m_s_per_rad = 2.467e-4\n",
    );
    modes(stiff.path()).assert().success().stdout(contains("overdamped"));
}

#[test]
fn many_links_fit_the_terminal() {
    let lengths = vec!["0.01"; 20].join(", ");
    let chain = config(&format!(
        "[specimen]\nmass_kg = 0.3606e-3\nlink_lengths_m = [{lengths}]\n[model]\nrelease_rad = [0.1]\n"
    ));
    let output = modes(chain.path()).assert().success().stdout(contains("… and "));
    let text = String::from_utf8(output.get_output().stdout.clone()).unwrap();
    assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
}

#[test]
fn one_general_link_is_a_simple_pendulum() {
    let link = "[[specimen.links]]\nlength_m = 0.1727\nmass_kg = 0.0938\ncom_m = 0.1086\ninertia_kg_m2 = 4.375e-4\n";
    // ω² = m g c/(I + m c²)
    let hz = (0.0938f64 * 9.80665 * 0.1086 / (4.375e-4 + 0.0938 * 0.1086 * 0.1086)).sqrt() / std::f64::consts::TAU;
    modes(config(link).path()).assert().success().stdout(contains(format!("{hz:.4}")));
}

#[test]
fn the_json_holds_full_precision() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("modes.json");
    modes(config(PAPER_RODS).path()).arg("--json").arg(&out).assert().success().stdout(contains("1.3489"));
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(&out).unwrap()).unwrap();
    assert_eq!(json["schema"], "freeswing.modes/1");
    assert!((json["chain"]["modes"][0]["frequency_hz"].as_f64().unwrap() - 1.348_880_265_869).abs() < 1e-10);
    assert_eq!(json["two_rods"]["as_printed"][0]["frequency_hz"], serde_json::Value::Null);
    assert_eq!(json["beam"], serde_json::Value::Null);
}

#[test]
fn json_on_standard_output_stands_there_alone() {
    let output = modes(config(PAPER_RODS).path()).args(["--json", "-"]).assert().success();
    let json: serde_json::Value = serde_json::from_slice(&output.get_output().stdout).unwrap();
    assert_eq!(json["gravity_m_s2"], 9.81);
}

#[track_caller]
fn refused(config: &Path, says: &str) {
    let output = modes(config).assert().code(2).stdout("").stderr(contains(says.to_owned()));
    let text = String::from_utf8(output.get_output().stderr.clone()).unwrap();
    assert_eq!(text.lines().count(), 1, "{text}");
}

#[test]
fn bad_configurations_are_one_line_and_exit_code_2() {
    refused(Path::new("nowhere.toml"), "nowhere.toml: cannot be read");
    refused(config("[specimen]\nmass_kg = 0.0\n").path(), "specimen.mass_kg = 0: must be a positive number");
    refused(config("[specimen]\nlenght_m = 0.2\n").path(), "the nearest known one is `length_m`");
    refused(
        config("[specimen]\nmass_kg = 0.3606e-3\nlink_lengths_m = [0.10, 0.10]\ninertia = \"lumps\"\nlumps = [0.5, 0.5, 0.0]\n").path(),
        "a link swings without inertia",
    );
    refused(
        config("[model.effects]\nrest_curl = 40.0\n[specimen]\nmass_kg = 0.3606e-3\nlink_lengths_m = [0.10, 0.10]\n")
            .path(),
        "no stable rest position",
    );
    refused(config("[model.effects]\nhinge_stiffness = nan\n").path(), "must be zero or a positive number");
    refused(config("[model.effects]\nadded_mass = -1.0\n").path(), "must be zero or a positive number");
}
