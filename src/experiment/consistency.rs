//! What a file must say of a specimen, and what of it cannot be true.
//!
//! Nothing is filled in that only the experimenter knows. What follows from other keys does: the mass from density and measures, the strip's length from its
//! links'. A contradiction that a measured specimen can have (a mark weighs something, a strip goes on beyond its last mark) is a warning; one that it cannot
//! have is an error.

use toml::Table;

use super::{Experiment, Inertia, Link, Specimen};

/// A strip's mass against its measures: marks and tape weigh something, but not as much as the strip.
const MASS_WARNS: f64 = 1.2;
const MASS_FAILS: f64 = 2.0;
/// The links of a strip against its length: rulers err, and a strip goes on beyond its last mark or is held above its hinge.
const LINKS_WARN: [f64; 2] = [0.9, 1.02];
const LINKS_FAIL: [f64; 2] = [0.3, 1.2];
/// The longest specimen (m) that a camera sees swing, and the longest ever hung.
const LONG_M: f64 = 10.0;
const LONGEST_M: f64 = 100.0;
/// A link heavier than a cube of lead of its length is a surprise, a thousand times heavier is in grams.
const LEAD_KG_M3: f64 = 11_340.0;
const GRAMS: f64 = 10.0;
/// A strip wider than it is long is a surprise, one so many times as wide is in millimetres.
const TOO_WIDE: f64 = 10.0;
/// A centre of mass this many lengths away, and a radius of gyration of as many, is a surprise and is another unit.
const FAR: f64 = 2.0;
const TOO_FAR: f64 = 20.0;
/// Densities of solids (kg/m³) and moduli (Pa), from foams up.
const LIGHTEST_KG_M3: f64 = 20.0;
const SOFTEST_PA: f64 = 1e4;
/// Gravity on the ground (m/s²), anywhere; and what a rig may have on a slope or another planet.
const EARTH_M_S2: [f64; 2] = [9.75, 9.85];
const RIG_M_S2: [f64; 2] = [0.5, 30.0];

/// What a key is, and how it is written.
struct Key {
    name: &'static str,
    meaning: &'static str,
    example: &'static str,
}

const MASS: Key = Key { name: "specimen.mass_kg", meaning: "kg, the whole strip", example: "mass_kg = 0.3606e-3" };
const WIDTH: Key = Key { name: "specimen.width_m", meaning: "m, the strip's", example: "width_m = 0.05" };
const LINKS: Key = Key {
    name: "specimen.link_lengths_m",
    meaning: "m, from mark to mark, top to bottom",
    example: "link_lengths_m = [0.10, 0.10]",
};

const LENGTH: Key = Key { name: "specimen.length_m", meaning: "m, the whole strip", example: "length_m = 0.20" };

/// What of the specimen the file does not say, one line; `None` where it says enough.
pub fn missing(file: &Table) -> Option<String> {
    let states = states_of(file);
    lacking(file, !states("link_lengths_m"), LINKS)
}

/// The same where the specimen is a strip without marks: its length is enough.
pub fn missing_of_strip(file: &Table) -> Option<String> {
    let states = states_of(file);
    lacking(file, !states("link_lengths_m") && !states("length_m"), LENGTH)
}

/// Whether the file states a key of the specimen.
fn states_of(file: &Table) -> impl Fn(&str) -> bool {
    let specimen = file.get("specimen").and_then(toml::Value::as_table);
    move |key| specimen.is_some_and(|s| s.contains_key(key))
}

fn lacking(file: &Table, lacks_length: bool, length: Key) -> Option<String> {
    let specimen = file.get("specimen").and_then(toml::Value::as_table);
    let states = |key: &str| specimen.is_some_and(|s| s.contains_key(key));
    if specimen.and_then(|s| s.get("links")?.as_array()).is_some_and(|links| !links.is_empty()) {
        return None;
    }
    let from_measures = ["thickness_m", "density_kg_m3", "width_m"].iter().all(|key| states(key));
    let bends = states("young_modulus_pa") && states("thickness_m");
    let lacks =
        [(!states("mass_kg") && !from_measures, MASS), (!states("width_m") && bends, WIDTH), (lacks_length, length)];
    let lacks: Vec<String> = lacks
        .into_iter()
        .filter_map(|(lacks, key)| {
            lacks.then(|| format!("{} ({}; for example {})", key.name, key.meaning, key.example))
        })
        .collect();
    let links = if specimen.is_some() { "" } else { "; or give general links as [[specimen.links]]" };
    (!lacks.is_empty()).then(|| format!("the specimen is not described; missing: {}{links}", lacks.join(", ")))
}

/// Fills in what follows from other keys.
pub fn complete(specimen: &mut Specimen, file: &Table, name: &str) {
    let stated = file.get("specimen").and_then(toml::Value::as_table);
    let states = |key: &str| stated.is_some_and(|s| s.contains_key(key));
    if !states("name") && stated.is_some() {
        name.clone_into(&mut specimen.name);
    }
    if states("link_lengths_m") && !states("length_m") {
        specimen.length_m = specimen.link_lengths_m.iter().sum();
    }
    if states("length_m") && !states("link_lengths_m") {
        specimen.link_lengths_m = vec![specimen.length_m];
    }
    if let (false, Some(mass_kg)) = (states("mass_kg"), measured_mass_kg(specimen).filter(|_| states("width_m"))) {
        specimen.mass_kg = mass_kg;
    }
}

/// The bending stiffness of a strip that bends all along, where [model.effects] does not state it: that of the stated joint spring over a piece between two
/// marks, or that of its material; and one line where nothing says how stiff it is. A specimen of which thickness, density and modulus are stated is such a
/// strip, unless the file says otherwise.
pub fn bending_stiffness_n_m2(experiment: &mut Experiment, file: &Table) -> (Option<f64>, Option<String>) {
    let states = states_of(file);
    let Experiment { specimen, model, .. } = experiment;
    let is_described = ["thickness_m", "density_kg_m3", "young_modulus_pa"].iter().all(|key| states(key));
    if is_described && !["inertia", "lumps", "links"].iter().any(|key| states(key)) {
        specimen.inertia = Inertia::Strip;
    }
    if specimen.inertia != Inertia::Strip || model.effects.distributed_flexibility.is_some() {
        return (None, None);
    }
    if !specimen.links.is_empty() {
        let message =
            "specimen.inertia = \"strip\" stands beside specimen.links, which are rigid; leave one of them out";
        return (None, Some(message.to_owned()));
    }
    let stated = file.get("model").is_some_and(|model| model.get("k_eq_n_m_per_rad").is_some());
    let mark_length_m = specimen.link_lengths_m.iter().sum::<f64>() / specimen.link_lengths_m.len().max(1) as f64;
    let of_joint = Some(model.k_eq_n_m_per_rad * mark_length_m).filter(|stiffness| stated && *stiffness > 0.0);
    let stiffness = of_joint.or_else(|| specimen.bending_stiffness_n_m2());
    let missing = "specimen.inertia = \"strip\": nothing says how stiff it is; give thickness_m and young_modulus_pa, or distributed_flexibility (N m^2) in [model.effects]";
    (stiffness, stiffness.is_none().then(|| missing.to_owned()))
}

/// Density × thickness × width × length.
fn measured_mass_kg(specimen: &Specimen) -> Option<f64> {
    Some(specimen.density_kg_m3? * specimen.thickness_m? * specimen.width_m * specimen.length_m)
}

/// Checks a file against itself: warnings, or an error where no specimen can be so.
pub fn contradictions(experiment: &Experiment, file: &Table) -> Result<Vec<String>, String> {
    let mut warnings = Vec::new();
    let specimen = &experiment.specimen;
    let stated = file.get("specimen").and_then(toml::Value::as_table);
    let states = |key: &str| stated.is_some_and(|s| s.contains_key(key));
    let mut judge = |finding: Option<Finding>| match finding {
        Some(Finding::Surprise(text)) => {
            warnings.push(text);
            Ok(())
        }
        Some(Finding::Impossible(text)) => Err(text),
        None => Ok(()),
    };
    if specimen.links.is_empty() {
        for (i, length_m) in specimen.link_lengths_m.iter().enumerate().filter(|_| states("link_lengths_m")) {
            judge(length(&format!("specimen.link_lengths_m[{i}]"), *length_m))?;
        }
        if states("length_m") {
            judge(length("specimen.length_m", specimen.length_m))?;
        }
        if states("length_m") && states("link_lengths_m") {
            judge(links_against_length(specimen))?;
        }
        judge(material(specimen))?;
        if states("width_m") {
            judge(width(specimen))?;
        }
        if states("mass_kg") && states("width_m") && (states("length_m") || states("link_lengths_m")) {
            judge(mass_against_measures(specimen))?;
        }
        judge(lumps(specimen))?;
    } else {
        for (i, link) in specimen.links.iter().enumerate() {
            of_link(&format!("specimen.links[{i}]"), link).into_iter().try_for_each(|finding| judge(Some(finding)))?;
        }
        judge(strip_beside_links(specimen, &states))?;
    }
    judge(marks(experiment, stated.is_some()))?;
    judge(gravity(experiment.rig.gravity_m_s2))?;
    judge(encoder(experiment))?;
    Ok(warnings)
}

/// What is odd about a file.
enum Finding {
    /// It may be so.
    Surprise(String),
    /// It cannot be so.
    Impossible(String),
}

impl Finding {
    /// A value outside the inner limits is a surprise, outside the outer ones impossible.
    fn of(value: f64, inner: [f64; 2], outer: [f64; 2], text: impl FnOnce() -> String) -> Option<Self> {
        let within = |[low, high]: [f64; 2]| low <= value && value <= high;
        match (within(inner), within(outer)) {
            (true, _) => None,
            (false, true) => Some(Self::Surprise(text())),
            (false, false) => Some(Self::Impossible(text())),
        }
    }
}

fn length(key: &str, length_m: f64) -> Option<Finding> {
    Finding::of(length_m, [0.0, LONG_M], [0.0, LONGEST_M], || {
        let (unit, factor) = if length_m >= LONGEST_M { ("millimetres", 1e-3) } else { ("centimetres", 1e-2) };
        format!(
            "{key} = {length_m}: {length_m} m is long for a specimen before a camera; if it is {unit}, write {}",
            length_m * factor
        )
    })
}

fn links_against_length(specimen: &Specimen) -> Option<Finding> {
    let sum_m: f64 = specimen.link_lengths_m.iter().sum();
    let length_m = specimen.length_m;
    Finding::of(sum_m / length_m, LINKS_WARN, LINKS_FAIL, || {
        let what = if sum_m > length_m {
            "the links are longer than the strip"
        } else {
            "the links, which carry the whole mass, are shorter than the strip"
        };
        format!(
            "specimen.link_lengths_m sum to {} m and specimen.length_m = {length_m}: {what}; measure both again",
            rounded(sum_m)
        )
    })
}

fn material(specimen: &Specimen) -> Option<Finding> {
    let density = specimen.density_kg_m3.and_then(|density| {
        Finding::of(density, [LIGHTEST_KG_M3, 25_000.0], [0.0, 1e6], || {
            format!(
                "specimen.density_kg_m3 = {density}: no solid is so light or so heavy; if it is g/cm³, write {}",
                density * 1e3
            )
        })
    });
    let modulus = specimen.young_modulus_pa.and_then(|modulus| {
        Finding::of(modulus, [SOFTEST_PA, 2e12], [0.0, f64::INFINITY], || {
            format!(
                "specimen.young_modulus_pa = {modulus}: no solid is so soft or so stiff; if it is GPa, write {:e}",
                modulus * 1e9
            )
        })
    });
    let thickness = specimen.thickness_m.and_then(|thickness_m| {
        Finding::of(thickness_m, [0.0, 0.1 * specimen.length_m], [0.0, specimen.length_m], || {
            format!(
                "specimen.thickness_m = {thickness_m}: thick beside a length of {} m; if it is millimetres, write {:.3e}, if µm, {:.3e}",
                specimen.length_m,
                thickness_m * 1e-3,
                thickness_m * 1e-6
            )
        })
    });
    density.or(modulus).or(thickness)
}

fn width(specimen: &Specimen) -> Option<Finding> {
    let Specimen { width_m, length_m, .. } = *specimen;
    Finding::of(width_m, [0.0, length_m], [0.0, TOO_WIDE * length_m], || {
        format!(
            "specimen.width_m = {width_m}: wider than the strip is long ({length_m} m); if it is millimetres, write {}",
            rounded(width_m * 1e-3)
        )
    })
}

fn mass_against_measures(specimen: &Specimen) -> Option<Finding> {
    let measured_kg = measured_mass_kg(specimen)?;
    let ratio = specimen.mass_kg / measured_kg;
    let within = |limit: f64| [1.0 / limit, limit];
    Finding::of(ratio, within(MASS_WARNS), within(MASS_FAILS), || {
        let unit = if (ratio / 1e3 - 1.0).abs() < 0.5 {
            "; is the mass in grams, or the thickness in millimetres?"
        } else {
            "; measure them again"
        };
        format!(
            "specimen.mass_kg = {} is {} times density × thickness × width × length = {} × {} × {} × {} = {:.4e} kg{unit}",
            specimen.mass_kg,
            rounded(ratio),
            specimen.density_kg_m3.unwrap_or(f64::NAN),
            specimen.thickness_m.unwrap_or(f64::NAN),
            specimen.width_m,
            specimen.length_m,
            measured_kg
        )
    })
}

fn lumps(specimen: &Specimen) -> Option<Finding> {
    (specimen.lumps.is_some() && specimen.inertia != Inertia::Lumps).then(|| {
        let own = if specimen.inertia == Inertia::Strip { "strip" } else { "rods" };
        Finding::Impossible(format!(
            "specimen.lumps stands beside inertia = \"{own}\", which does not use it; write inertia = \"lumps\", or leave lumps out"
        ))
    })
}

fn of_link(key: &str, link: &Link) -> Vec<Finding> {
    let Link { length_m, mass_kg, com_m, inertia_kg_m2 } = *link;
    let cube_kg = LEAD_KG_M3 * length_m.powi(3);
    let mass = Finding::of(mass_kg, [0.0, cube_kg.max(0.1)], [0.0, GRAMS * cube_kg.max(0.1)], || {
        format!(
            "{key}.mass_kg = {mass_kg}: heavier than a cube of lead of its length ({} kg); if it is grams, write {}",
            rounded(cube_kg),
            mass_kg * 1e-3
        )
    });
    let com = Finding::of(com_m, [0.0, FAR * length_m], [0.0, TOO_FAR * length_m], || {
        format!(
            "{key}.com_m = {com_m}: {} times the link's length of {length_m} m; are both in metres?",
            rounded(com_m / length_m)
        )
    });
    let gyration_m = (inertia_kg_m2 / mass_kg).sqrt();
    let inertia = Finding::of(gyration_m, [0.0, FAR * length_m], [0.0, TOO_FAR * length_m], || {
        format!(
            "{key}.inertia_kg_m2 = {inertia_kg_m2} about the centre of mass: a radius of gyration of {} m on a link of {length_m} m; are mass and inertia in kg and kg·m²?",
            rounded(gyration_m)
        )
    });
    [length(&format!("{key}.length_m"), length_m), mass, com, inertia].into_iter().flatten().collect()
}

/// A strip described beside general links, which stand for it: it must be the same.
fn strip_beside_links(specimen: &Specimen, states: &impl Fn(&str) -> bool) -> Option<Finding> {
    let [mass_kg, length_m] =
        specimen.links.iter().fold([0.0, 0.0], |[mass, length], link| [mass + link.mass_kg, length + link.length_m]);
    let differs = |key: &str, value: f64, of_links: f64| {
        (states(key) && (value / of_links - 1.0).abs() > 0.05).then(|| {
            Finding::Impossible(format!(
                "specimen.{key} = {value}, and [[specimen.links]] make {}; leave one of the two out",
                rounded(of_links)
            ))
        })
    };
    differs("mass_kg", specimen.mass_kg, mass_kg)
        .or_else(|| differs("length_m", specimen.length_m, length_m))
        .or_else(|| differs("link_lengths_m", specimen.link_lengths_m.iter().sum(), length_m))
}

fn marks(experiment: &Experiment, states_specimen: bool) -> Option<Finding> {
    let (marks, links) = (experiment.rig.marks.len(), experiment.specimen.lengths_m().len());
    let (wanted, which) = match experiment.rig.pivot_px {
        Some(_) => (links, "with rig.pivot_px one a link"),
        None => (links + 1, "one at the hinge and one a link"),
    };
    (states_specimen && marks > 0 && marks != wanted).then(|| {
        Finding::Surprise(format!(
            "rig.marks names {marks} mark{} for {links} link{}: {wanted} are wanted, {which}",
            if marks == 1 { "" } else { "s" },
            if links == 1 { "" } else { "s" }
        ))
    })
}

fn gravity(gravity_m_s2: f64) -> Option<Finding> {
    Finding::of(gravity_m_s2, EARTH_M_S2, RIG_M_S2, || {
        let unit = if (900.0..1100.0).contains(&gravity_m_s2) { "; if it is cm/s², write 9.81" } else { "" };
        format!("rig.gravity_m_s2 = {gravity_m_s2}: the ground has 9.78 to 9.83 m/s²{unit}")
    })
}

/// The encoders of several joints err each in its own way.
fn encoder(experiment: &Experiment) -> Option<Finding> {
    let links = experiment.specimen.lengths_m().len();
    (experiment.model.effects.encoder_error.is_some() && links > 1).then(|| {
        Finding::Impossible(format!(
            "model.effects.encoder_error: is of specimens of one link, this one has {links}; leave it out"
        ))
    })
}

/// Four significant digits, without zeros at the end.
fn rounded(value: f64) -> String {
    let places = (3 - value.abs().max(1e-12).log10().floor() as i32).clamp(0, 12) as usize;
    let text = format!("{value:.places$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
