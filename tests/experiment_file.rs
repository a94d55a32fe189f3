//! `experiment.toml` as people write it: what is missing is asked for, what contradicts itself is said.

use std::path::Path;

use assert_cmd::Command;
use freeswing::experiment::Experiment;

const STRIP: &str = "
[specimen]
name = \"strip\"
mass_kg = 0.3606e-3
length_m = 0.20
width_m = 0.05
thickness_m = 25.4e-6
density_kg_m3 = 1420
young_modulus_pa = 2.5e9
link_lengths_m = [0.10, 0.10]
[rig]
marks = [\"red\", \"red\", \"red\"]
";
const ARMS: &str = "
[[specimen.links]]
length_m = 0.1727
mass_kg = 0.0938
com_m = 0.1086
inertia_kg_m2 = 4.375e-4
[[specimen.links]]
length_m = 0.23
mass_kg = 0.1376
com_m = 0.1168
inertia_kg_m2 = 1.269e-3
";

fn parse(text: &str) -> freeswing::Result<Experiment> {
    Experiment::parse(text, Path::new("rig.toml"))
}

/// The strip with some lines in place of others.
fn strip(changes: &[(&str, &str)]) -> String {
    changes.iter().fold(STRIP.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    })
}

fn missing(text: &str) -> String {
    parse(text).unwrap().missing.expect("nothing is missing")
}

fn refused(text: &str) -> String {
    let error = parse(text).unwrap_err().to_string();
    assert_eq!(error.lines().count(), 1);
    error
}

fn warned(text: &str) -> String {
    let experiment = parse(text).unwrap();
    assert_eq!(experiment.warnings.len(), 1, "{:?}", experiment.warnings);
    experiment.warnings[0].clone()
}

#[test]
fn c_of_a_single_link_damps_its_hinge_and_it_is_released_at_one_angle() {
    let arm = |model: &str| {
        let text = format!(
            "[[specimen.links]]\nlength_m = 0.6\nmass_kg = 0.5\ncom_m = 0.4\ninertia_kg_m2 = 0.01\n[model]\n{model}"
        );
        Experiment::parse(&text, "arm.toml".as_ref()).unwrap().model
    };
    let model = arm("c_eq_n_m_s_per_rad = 0.002\n");
    assert_eq!((model.effects.hinge_viscous, model.release_rad.len()), (Some(0.002), 1));
    assert_eq!(arm("").effects.hinge_viscous, None);
    let both = arm("c_eq_n_m_s_per_rad = 0.002\n[model.effects]\nhinge_viscous = 0.003\n");
    assert_eq!(both.effects.hinge_viscous, Some(0.003));
}

#[test]
fn a_strip_whose_material_is_stated_bends_all_along() {
    let stiffness = |text: &str| parse(text).unwrap().bending_stiffness_n_m2;
    // E w t³/12
    let of_film = 2.5e9 * 0.05 * 25.4e-6_f64.powi(3) / 12.0;
    assert!((stiffness(STRIP).unwrap() / of_film - 1.0).abs() < 1e-12);
    let links = "link_lengths_m = [0.10, 0.10]";
    assert_eq!(stiffness(&strip(&[(links, "link_lengths_m = [0.10, 0.10]\ninertia = \"rods\"")])), None);
    // a stated spring of a piece between two marks says more than a modulus
    let sprung = format!("{STRIP}[model]\nk_eq_n_m_per_rad = 2e-4\n");
    assert!((stiffness(&sprung).unwrap() / 2e-5 - 1.0).abs() < 1e-12);
    // the file's own word is not overwritten
    assert_eq!(stiffness(&format!("{STRIP}[model.effects]\ndistributed_flexibility = 1e-6\n")), None);
    let soft = strip(&[("young_modulus_pa = 2.5e9\n", "inertia = \"strip\"\n")]);
    assert!(missing(&soft).contains("nothing says how stiff it is; give thickness_m and young_modulus_pa"));
    assert!(missing(&format!("[specimen]\ninertia = \"strip\"\n{}", ARMS.trim_start())).contains("which are rigid"));
}

#[test]
fn a_whole_description_has_nothing_to_say() {
    for text in [STRIP, ARMS] {
        let experiment = parse(text).unwrap();
        assert_eq!((&experiment.missing, &experiment.warnings[..]), (&None, &[][..]));
    }
}

#[test]
fn what_is_missing_is_asked_for_by_name_with_unit_and_example() {
    for text in ["", "[rig]\nmirrored = true\n", "[model]\nk_eq_n_m_per_rad = 1e-4\n"] {
        let message = missing(text);
        for part in
            ["specimen.mass_kg (kg, ", "mass_kg = 0.3606e-3", "specimen.link_lengths_m (m, ", "[[specimen.links]]"]
        {
            assert!(message.contains(part), "{part} in {message}");
        }
    }
    let only_mass = missing(&strip(&[("mass_kg = 0.3606e-3\n", ""), ("density_kg_m3 = 1420\n", "")]));
    assert!(only_mass.contains("specimen.mass_kg") && !only_mass.contains("link_lengths_m"), "{only_mass}");
    let only_links = missing(&strip(&[("link_lengths_m = [0.10, 0.10]\n", "")]));
    assert!(only_links.contains("specimen.link_lengths_m") && !only_links.contains("mass_kg"), "{only_links}");
    let only_width = missing(&strip(&[("width_m = 0.05\n", "")]));
    assert!(only_width.contains("specimen.width_m (m, "), "{only_width}");
}

#[test]
fn a_link_that_lacks_a_key_is_asked_for_it() {
    let message = refused(&ARMS.replace("com_m = 0.1168\n", ""));
    assert!(message.contains("`com_m` is missing (m, from the link's pivot to its centre of mass"), "{message}");
}

#[test]
fn what_follows_from_other_keys_need_not_be_said() {
    let light = parse(&strip(&[("mass_kg = 0.3606e-3\n", "")])).unwrap();
    assert!(light.missing.is_none() && (light.specimen.mass_kg / 0.36068e-3 - 1.0).abs() < 1e-4);
    let short = parse("[specimen]\nmass_kg = 1e-3\nlink_lengths_m = [0.3, 0.2]\n").unwrap();
    assert!(short.missing.is_none() && (short.specimen.length_m - 0.5).abs() < 1e-12);
}

#[test]
fn a_specimen_without_a_name_is_called_like_its_file() {
    assert_eq!(parse("[specimen]\nmass_kg = 1e-3\nlink_lengths_m = [0.3]\n").unwrap().specimen.name, "rig");
}

#[test]
fn what_no_specimen_can_be_is_an_error_with_its_numbers() {
    for (text, parts) in [
        (strip(&[("mass_kg = 0.3606e-3", "mass_kg = 0.3606")]), ["0.3606 is 999.8 times", "is the mass in grams"]),
        (strip(&[("thickness_m = 25.4e-6", "thickness_m = 0.0254")]), ["is 0.0009998 times", "3.6068e-1 kg"]),
        (
            strip(&[("length_m = 0.20", "length_m = 0.10")]),
            ["sum to 0.2 m and specimen.length_m = 0.1", "longer than the strip"],
        ),
        (strip(&[("[0.10, 0.10]", "[110, 90]")]), ["link_lengths_m[0] = 110", "millimetres, write 0.11"]),
        (strip(&[("length_m = 0.20", "length_m = 200.0")]), ["specimen.length_m = 200", "millimetres, write 0.2"]),
        (format!("{STRIP}gravity_m_s2 = 980.665\n"), ["gravity_m_s2 = 980.665", "cm/s²"]),
        (strip(&[("width_m", "lumps = [0.25, 0.5, 0.25]\nwidth_m")]), ["specimen.lumps", "write inertia = \"lumps\""]),
        (ARMS.replace("mass_kg = 0.0938", "mass_kg = 938"), ["heavier than a cube of lead", "grams, write 0.938"]),
        (ARMS.replace("length_m = 0.1727", "length_m = 172.7"), ["172.7 m is long", "millimetres, write 0.1727"]),
        (ARMS.replace("com_m = 0.1086", "com_m = 108.6"), ["com_m = 108.6: 628.8 times", "are both in metres?"]),
        (ARMS.replace("inertia_kg_m2 = 4.375e-4", "inertia_kg_m2 = 4375"), ["radius of gyration of 216", "kg·m²?"]),
        (
            format!("[specimen]\nmass_kg = 1.0\n{ARMS}"),
            ["specimen.mass_kg = 1, and [[specimen.links]] make 0.2314", "leave one"],
        ),
    ] {
        let message = refused(&text);
        parts.iter().for_each(|part| assert!(message.contains(part), "{part} in {message}"));
    }
}

#[test]
fn what_may_yet_be_true_is_a_warning() {
    for (text, part) in [
        (strip(&[("mass_kg = 0.3606e-3", "mass_kg = 0.5e-3")]), "is 1.386 times density × thickness × width × length"),
        (strip(&[("[0.10, 0.10]", "[0.08, 0.08]")]), "sum to 0.16 m and specimen.length_m = 0.2"),
        (strip(&[("\"red\", \"red\", \"red\"", "\"red\", \"red\"")]), "names 2 marks for 2 links: 3 are wanted"),
        (strip(&[("2.5e9", "2.5")]), "young_modulus_pa = 2.5: no solid is so soft"),
        (
            "[specimen]\nlength_m = 0.2\nwidth_m = 0.5\n".to_owned(),
            "width_m = 0.5: wider than the strip is long (0.2 m)",
        ),
        (
            ARMS.replace("length_m = 0.23", "length_m = 23"),
            "23 m is long for a specimen before a camera; if it is centimetres, write 0.23",
        ),
        (format!("{STRIP}gravity_m_s2 = 1.62\n"), "gravity_m_s2 = 1.62: the ground has 9.78 to 9.83"),
    ] {
        let warning = warned(&text);
        assert!(warning.starts_with("rig.toml: ") && warning.contains(part), "{part} in {warning}");
    }
}

#[test]
fn commands_that_need_a_specimen_ask_for_it_and_others_go_on() {
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("rig.toml");
    std::fs::write(&config, "[rig]\ngravity_m_s2 = 9.81\n").unwrap();
    let table = folder.path().join("angles.csv");
    let rows = (0..300).map(|i| format!("{:.4},{:.6}\n", f64::from(i) / 30.0, 0.3 * (f64::from(i) * 0.28).cos()));
    std::fs::write(&table, format!("t_s,theta1_rad\n{}", rows.collect::<String>())).unwrap();
    let [config, table] = [config.to_str().unwrap(), table.to_str().unwrap()];
    let out = folder.path().join("out.csv");
    let out = out.to_str().unwrap();
    for line in [
        &["fit", table, "--config", config][..],
        &["diagnose", table, "--config", config],
        &["simulate", "--config", config, "--out", out],
        &["modes", "--config", config],
        &["render", "--config", config, "--out", "out.mp4"],
    ] {
        let output = Command::cargo_bin("freeswing").unwrap().args(line).output().unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(
            (output.status.code(), output.stdout.len(), error.lines().count()),
            (Some(2), 0, 1),
            "{line:?} {error}"
        );
        assert!(error.contains("specimen.mass_kg (kg, the whole strip; for example mass_kg = 0.3606e-3)"), "{error}");
    }
    let output =
        Command::cargo_bin("freeswing").unwrap().args(["identify", table, "--config", config]).output().unwrap();
    let (text, error) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert!(output.status.success() && text.contains("Mode 1") && !text.contains("Floor"), "{text}");
    assert!(error.contains("going on without the specimen"), "{error}");
}
