//! `[[model.law]]`: laws that a file states by a formula.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::finite;
use crate::model::{Expression, LawCoefficient, Parameter};

/// Where a stated law acts, and what its formula is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LawPlace {
    /// A torque on the first link (N·m) from its `angle` (rad), its `rate` (rad/s) and the `load` of the bearing (N).
    Hinge,
    /// A torque on the lower link of every joint (N·m), and back on the upper one, from the bend `angle`, its `rate`, and the `load` of the joint.
    Joint,
    /// A force per length across the strip (N/m) from the speed across itself, `wind` (m/s).
    Strip,
    /// A force across the last link at its lower end (N) from the speed there, `wind` (m/s).
    Tip,
    /// The sideways acceleration of the pivot (m/s²).
    Support,
}

impl LawPlace {
    /// The name in files.
    pub fn id(self) -> &'static str {
        match self {
            Self::Hinge => "hinge",
            Self::Joint => "joint",
            Self::Strip => "strip",
            Self::Tip => "tip",
            Self::Support => "support",
        }
    }

    /// The key of a formula there, in files.
    pub fn key(self) -> &'static str {
        match self {
            Self::Hinge | Self::Joint => "torque_n_m",
            Self::Strip => "force_n_per_m",
            Self::Tip => "force_n",
            Self::Support => "acceleration_m_s2",
        }
    }

    /// The variables of a formula there; the time `t` (s) is the last.
    pub fn variables(self) -> &'static [&'static str] {
        match self {
            Self::Hinge | Self::Joint => &["angle", "rate", "load", "t"],
            Self::Strip | Self::Tip => &["wind", "t"],
            Self::Support => &["t"],
        }
    }

    /// The unit of what a formula gives there.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Hinge | Self::Joint => "N m",
            Self::Strip => "N/m",
            Self::Tip => "N",
            Self::Support => "m/s2",
        }
    }
}

/// A coefficient of a stated law.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coefficient {
    /// Where a fit begins, and the value that `simulate` takes.
    pub start: f64,
    /// Least value that a fit may take.
    #[serde(default)]
    pub min: Option<f64>,
    /// For what is printed.
    #[serde(default = "one")]
    pub unit: String,
}

fn one() -> String {
    "1".to_owned()
}

/// A law stated by a formula.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Law {
    /// What it is called.
    pub name: String,
    /// Where it acts.
    pub place: LawPlace,
    /// Of a law in the joints, the only one at which it acts: 1 is that below the first link.
    #[serde(default)]
    pub joint: Option<usize>,
    /// What it exerts, of the state there and its coefficients.
    #[serde(rename = "torque_n_m", alias = "force_n_per_m", alias = "force_n", alias = "acceleration_m_s2")]
    pub formula: String,
    /// Its coefficients by their names.
    #[serde(default)]
    pub parameters: BTreeMap<String, Coefficient>,
}

impl Law {
    /// The formula, its variables those of the place, then the coefficients in the order of their names.
    ///
    /// # Errors
    /// What is wrong with the formula, in words.
    pub fn expression(&self) -> Result<Expression, String> {
        let names: Vec<&str> =
            self.place.variables().iter().copied().chain(self.parameters.keys().map(String::as_str)).collect();
        Expression::parse(&self.formula, &names)
    }

    /// The coefficients, as a fit knows them.
    pub fn coefficients(&self) -> impl Iterator<Item = (Parameter, &Coefficient)> {
        let of = |name: &str, own: &Coefficient| Parameter::Law(LawCoefficient::new(&self.name, name, &own.unit));
        self.parameters.iter().map(move |(name, own)| (of(name, own), own))
    }

    pub(super) fn validate(&self) -> Result<(), String> {
        let wrong = |message: String| format!("model.law \"{}\": {message}", self.name);
        if self.joint.is_some() && self.place != LawPlace::Joint {
            return Err(wrong(format!("joint is for place = \"joint\", and its place is {}", self.place.id())));
        }
        let expression = self.expression().map_err(wrong)?;
        let state = self.place.variables();
        for (index, (name, own)) in self.parameters.iter().enumerate() {
            let key = format!("parameters.{name}.start");
            finite(&key, own.start).map_err(wrong)?;
            if let Some(min) = own.min.filter(|min| !(own.start >= *min)) {
                return Err(wrong(format!("{key} = {} lies below its min = {min}", own.start)));
            }
            if state.contains(&name.as_str()) {
                return Err(wrong(format!("a parameter cannot be called {name}: that is a variable of its place")));
            }
            if !expression.uses(state.len() + index) {
                return Err(wrong(format!("the formula does not use its parameter {name}")));
            }
        }
        Ok(())
    }
}

/// Laws whose joints are there, of a specimen of so many links; `bends` is a strip that does all along, and has none.
pub(super) fn validate_joints(laws: &[Law], links: usize, bends: bool) -> Result<(), String> {
    let joints = if bends { 0 } else { links.saturating_sub(1) };
    let absent = laws.iter().find_map(|law| Some((law, law.joint.filter(|joint| !(1..=joints).contains(joint))?)));
    let Some((law, joint)) = absent else { return Ok(()) };
    let there = match joints {
        0 if bends => "a strip that bends all along has no joints to tell apart".to_owned(),
        0 => "one link has no joint".to_owned(),
        1 => "the only joint is 1".to_owned(),
        more => format!("the joints are 1 to {more}"),
    };
    Err(format!("model.law \"{}\": joint = {joint}: {there}", law.name))
}

/// Laws with different names, each sound.
pub(super) fn validate(laws: &[Law]) -> Result<(), String> {
    for (index, law) in laws.iter().enumerate() {
        if laws[..index].iter().any(|other| other.name == law.name) {
            return Err(format!("two laws of [[model.law]] are called \"{}\"; each needs a name of its own", law.name));
        }
        law.validate()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use crate::experiment::Experiment;

    fn refused(law: &str) -> String {
        let text = format!("[[model.law]]\nname = \"rub\"\nplace = \"hinge\"\n{law}\n");
        Experiment::parse(&text, std::path::Path::new("e.toml")).unwrap_err().to_string()
    }

    #[test]
    fn what_is_wrong_with_a_law_is_said_by_its_name() {
        let of_a = "parameters.a = { start = 1e-7, min = 0.0, unit = \"N m\" }";
        let wrong = refused(&format!("torque_n_m = \"-a * rat\"\n{of_a}"));
        assert!(
            wrong.starts_with("e.toml: model.law \"rub\": \"rat\" in \"-a * rat\" is not known; there are angle"),
            "{wrong}"
        );
        let wrong = refused(&format!("torque_n_m = \"-rate\"\n{of_a}"));
        assert_eq!(wrong, "e.toml: model.law \"rub\": the formula does not use its parameter a");
        let wrong = refused("torque_n_m = \"-a * rate\"\nparameters.a = { start = -1.0, min = 0.0 }");
        assert_eq!(wrong, "e.toml: model.law \"rub\": parameters.a.start = -1 lies below its min = 0");
        let wrong = refused("torque_n_m = \"-t * rate\"\nparameters.t = { start = 1.0 }");
        assert!(wrong.contains("a parameter cannot be called t"), "{wrong}");
    }

    #[test]
    fn a_joint_must_be_there() {
        let refused = |law: &str| {
            let text = format!("[[model.law]]\nname = \"pin\"\ntorque_n_m = \"-rate\"\n{law}\n");
            Experiment::parse(&text, std::path::Path::new("e.toml")).err().map(|wrong| wrong.to_string())
        };
        assert_eq!(refused("place = \"joint\"\njoint = 1"), None);
        let wrong = |law: &str| refused(law).unwrap();
        assert!(wrong("place = \"joint\"\njoint = 2").ends_with("model.law \"pin\": joint = 2: the only joint is 1"));
        assert!(wrong("place = \"joint\"\njoint = 0").ends_with("joint = 0: the only joint is 1"));
        assert!(
            wrong("place = \"hinge\"\njoint = 1").ends_with("joint is for place = \"joint\", and its place is hinge")
        );
    }
}
