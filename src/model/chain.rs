//! The chain: n rigid links hung one below the other from a hinge.

use std::ops::Range;

use nalgebra::DMatrix;

use super::{LinkProperty, Motion, Parameter, Partials};
use crate::error::{Error, Result};
use crate::experiment::{Inertia, Link, Specimen};

/// Rigid links, from the hinge down.
///
/// Angles θᵢ are absolute, from the downward vertical, positive towards +x. With cᵢ the distance from the link's pivot to its centre of
/// mass and Iᵢ the inertia about that centre:
///
/// ```text
/// aᵢᵢ = Iᵢ + mᵢcᵢ² + Lᵢ² Σ_{k>i} mₖ
/// aᵢⱼ = Lᵢ (mⱼcⱼ + Lⱼ Σ_{k>j} mₖ)      i < j
/// hᵢ  = mᵢcᵢ + Lᵢ Σ_{k>i} mₖ            gᵢ = g hᵢ
/// ```
///
/// A uniform rod has c = L/2, I = mL²/12 (paper Eq. 33); a lump at the lower node has c = L, I = 0 (paper Eq. 22–25).
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    links: Vec<Link>,
    /// L: the links' lengths, unless they were set.
    next_pivot_m: Vec<f64>,
    /// a, without the cosines.
    inertia_kg_m2: DMatrix<f64>,
    /// h.
    static_moment_kg_m: Vec<f64>,
    /// σ of each joint.
    joint_ratios: Vec<f64>,
    groups: Vec<Range<usize>>,
}

impl Chain {
    /// A chain of these links.
    ///
    /// # Errors
    /// [`Error::Simulation`] when there is no link, or the links' masses leave a direction of motion without inertia.
    pub fn new(links: Vec<Link>) -> Result<Self> {
        if links.is_empty() {
            return Err(Error::Simulation { detail: "the specimen has no link; give specimen.link_lengths_m".into() });
        }
        let n = links.len();
        let next_pivot_m: Vec<f64> = links.iter().map(|link| link.length_m).collect();
        let (inertia_kg_m2, static_moment_kg_m) = coefficients(&links, &next_pivot_m);
        let scaled = DMatrix::from_fn(n, n, |i, j| {
            inertia_kg_m2[(i, j)] / (inertia_kg_m2[(i, i)] * inertia_kg_m2[(j, j)]).sqrt()
        });
        let swings = scaled.iter().all(|v| v.is_finite()) && scaled.symmetric_eigenvalues().min() > 1e-9;
        if !swings {
            return Err(Error::Simulation {
                detail: "a link swings without inertia; give every node below the hinge a mass (specimen.lumps)".into(),
            });
        }
        let (joint_ratios, groups) = (vec![1.0; n - 1], (0..n).map(|i| i..i + 1).collect());
        Ok(Self { links, next_pivot_m, inertia_kg_m2, static_moment_kg_m, joint_ratios, groups })
    }

    /// The strip cut into `pieces` equal rods for each length between marks: with EI/ℓ at every joint it approaches the continuous strip.
    ///
    /// # Errors
    /// As [`Chain::new`]; also for a specimen given as general links, which are rigid.
    pub fn continuous(specimen: &Specimen, pieces: usize) -> Result<Self> {
        if !specimen.links.is_empty() {
            let detail =
                "distributed_flexibility bends a strip, and specimen.links are rigid; give link_lengths_m instead";
            return Err(Error::Simulation { detail: detail.into() });
        }
        let marks = specimen.link_lengths_m.len();
        let cut = |length_m: &f64| std::iter::repeat_n(*length_m / pieces as f64, pieces);
        let strip = Specimen {
            link_lengths_m: specimen.link_lengths_m.iter().flat_map(cut).collect(),
            inertia: Inertia::Rods,
            lumps: None,
            ..specimen.clone()
        };
        let mut chain = Self::of(&strip)?;
        let mark_length_m = specimen.link_lengths_m.iter().sum::<f64>() / marks as f64;
        let own_m = |upper: usize| 0.5 * (strip.link_lengths_m[upper] + strip.link_lengths_m[upper + 1]);
        chain.joint_ratios = (0..chain.count() - 1).map(|upper| mark_length_m / own_m(upper)).collect();
        chain.groups = (0..marks).map(|mark| mark * pieces..(mark + 1) * pieces).collect();
        Ok(chain)
    }

    /// The chain of a specimen: its `links`, or its strip as rods or lumps. The strip's whole mass is carried by the links in proportion
    /// to their lengths; lumps default to those of a uniform strip.
    ///
    /// # Errors
    /// As [`Chain::new`].
    pub fn of(specimen: &Specimen) -> Result<Self> {
        if !specimen.links.is_empty() {
            return Self::new(specimen.links.clone());
        }
        let lengths_m = &specimen.link_lengths_m;
        let total_m: f64 = lengths_m.iter().sum();
        let share = |i: usize| lengths_m.get(i).copied().unwrap_or(0.0) / total_m;
        let lump = |node: usize| match &specimen.lumps {
            Some(lumps) => lumps.get(node).copied().unwrap_or(0.0),
            None => 0.5 * (share(node - 1) + share(node)),
        };
        let link = |(i, &length_m): (usize, &f64)| match specimen.inertia {
            Inertia::Rods | Inertia::Strip => {
                let mass_kg = specimen.mass_kg * share(i);
                Link { length_m, mass_kg, com_m: 0.5 * length_m, inertia_kg_m2: mass_kg * length_m * length_m / 12.0 }
            }
            Inertia::Lumps => {
                Link { length_m, mass_kg: specimen.mass_kg * lump(i + 1), com_m: length_m, inertia_kg_m2: 0.0 }
            }
        };
        Self::new(lengths_m.iter().enumerate().map(link).collect())
    }

    /// The links, top to bottom.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// Number of links.
    pub fn count(&self) -> usize {
        self.links.len()
    }

    /// aᵢⱼ (kg·m²).
    pub fn inertia_kg_m2(&self) -> &DMatrix<f64> {
        &self.inertia_kg_m2
    }

    /// hᵢ (kg·m); gravity's torque on θᵢ is −g hᵢ sin θᵢ.
    pub fn static_moment_kg_m(&self, i: usize) -> f64 {
        self.static_moment_kg_m[i]
    }

    /// Length of a link.
    pub fn length_m(&self, i: usize) -> f64 {
        self.links[i].length_m
    }

    /// Mass of a link and of all below (kg).
    pub fn mass_from_kg(&self, link: usize) -> f64 {
        self.links[link].mass_kg + mass_below_kg(&self.links, link)
    }

    /// kₗ: what the bearing at the upper end of `link` bears of link l's turning (kg·m), see [`bearing`](super::effects::bearing).
    pub fn borne_moment_kg_m(&self, link: usize, l: usize) -> f64 {
        if l < link { self.mass_from_kg(link) * self.next_pivot_m[l] } else { self.static_moment_kg_m[l] }
    }

    /// ∂kₗ/∂(a parameter of a link) (kg).
    pub fn borne_moment_slope_kg(&self, link: usize, l: usize, parameter: Parameter) -> f64 {
        match parameter {
            Parameter::Link(own, of) if usize::from(own) == l => match of {
                LinkProperty::Inertia => 0.0,
                LinkProperty::Com if l < link => 0.0,
                LinkProperty::Com => self.links[l].mass_kg,
                LinkProperty::Length if l < link => self.mass_from_kg(link),
                LinkProperty::Length => mass_below_kg(&self.links, l),
            },
            _ => 0.0,
        }
    }

    /// σ of the joint below link `upper`: the length between marks over the links' own, see [`joint`](super::effects::joint).
    pub fn joint_ratio(&self, upper: usize) -> f64 {
        self.joint_ratios[upper]
    }

    /// The links between each pair of consecutive marks, top to bottom.
    pub fn groups(&self) -> &[Range<usize>] {
        &self.groups
    }

    /// The parameters of the links. Where the last one ends changes nothing.
    pub fn parameters(&self) -> Vec<Parameter> {
        let last = self.count() - 1;
        let of_link = |link: usize| {
            let number = u8::try_from(link).ok();
            let of = [LinkProperty::Inertia, LinkProperty::Com, LinkProperty::Length]
                .into_iter()
                .filter(move |of| *of != LinkProperty::Length || link < last);
            of.filter_map(move |of| number.map(|number| Parameter::Link(number, of)))
        };
        (0..=last).flat_map(of_link).collect()
    }

    /// The value of a parameter of a link.
    pub fn value(&self, parameter: Parameter) -> Option<f64> {
        let Parameter::Link(link, of) = parameter else { return None };
        let link = usize::from(link);
        self.links.get(link).map(|own| match of {
            LinkProperty::Inertia => own.inertia_kg_m2,
            LinkProperty::Com => own.com_m,
            LinkProperty::Length => self.next_pivot_m[link],
        })
    }

    /// Sets a parameter of a link; others are left alone. Marks, and air, stay at the lengths of the file.
    pub fn set(&mut self, parameter: Parameter, value: f64) {
        let Parameter::Link(link, of) = parameter else { return };
        let link = usize::from(link);
        let Some(own) = self.links.get_mut(link) else { return };
        match of {
            LinkProperty::Inertia => own.inertia_kg_m2 = value,
            LinkProperty::Com => own.com_m = value,
            LinkProperty::Length => self.next_pivot_m[link] = value,
        }
        (self.inertia_kg_m2, self.static_moment_kg_m) = coefficients(&self.links, &self.next_pivot_m);
    }

    /// Adds the derivative of the chain's torques with a parameter of a link. They are linear in a and h, so it is their value for
    ///
    /// ```text
    /// ∂aᵢᵢ/∂Iᵢ = 1
    /// ∂aᵢᵢ/∂cᵢ = 2mᵢcᵢ,  ∂aᵢⱼ/∂cᵢ = Lⱼmᵢ for j < i,  ∂hᵢ/∂cᵢ = mᵢ
    /// ∂aᵢᵢ/∂Lᵢ = 2LᵢM,   ∂aᵢⱼ/∂Lᵢ = LⱼM for j < i, hⱼ for j > i,  ∂hᵢ/∂Lᵢ = M = Σ_{k>i} mₖ
    /// ```
    ///
    /// `field_m_s2` is what acts on every mass, sideways and down.
    pub fn add_sensitivity(&self, parameter: Parameter, field_m_s2: [f64; 2], motion: &Motion, q: &mut [f64]) {
        let Parameter::Link(link, of) = parameter else { return };
        let i = usize::from(link);
        let Some(own) = self.links.get(i) else { return };
        // a mass at an arm that becomes longer
        let (mass_kg, arm_m) = match of {
            LinkProperty::Inertia => {
                q[i] -= motion.acceleration[i];
                return;
            }
            LinkProperty::Com => (own.mass_kg, own.com_m),
            LinkProperty::Length => (mass_below_kg(&self.links, i), self.next_pivot_m[i]),
        };
        let pull_m_s2 = field_m_s2[0] * motion.cos[i] - field_m_s2[1] * motion.sin[i];
        q[i] += mass_kg * (pull_m_s2 - 2.0 * arm_m * motion.acceleration[i]);
        for j in 0..i {
            add_pair(self.next_pivot_m[j] * mass_kg, (i, j), motion, q);
        }
        if of == LinkProperty::Length {
            for j in i + 1..self.count() {
                add_pair(self.static_moment_kg_m[j], (i, j), motion, q);
            }
        }
    }

    /// Adds −Σⱼ aᵢⱼ [cos(θᵢ−θⱼ) θ̈ⱼ + sin(θᵢ−θⱼ) θ̇ⱼ²] − g hᵢ sin θᵢ (N·m): the links' own inertia, and gravity.
    pub fn add_torque(&self, gravity_m_s2: f64, motion: &Motion, q: &mut [f64]) {
        for i in 0..self.count() {
            q[i] -= gravity_m_s2 * self.static_moment_kg_m[i] * motion.sin[i] + self.a(i, i) * motion.acceleration[i];
            for j in 0..i {
                add_pair(self.a(i, j), (i, j), motion, q);
            }
        }
    }

    /// Adds the derivatives of these torques.
    pub fn add_partials(&self, gravity_m_s2: f64, motion: &Motion, partials: &mut Partials) {
        let (rate, acceleration) = (&motion.rate, &motion.acceleration);
        for i in 0..self.count() {
            partials.theta[(i, i)] -= gravity_m_s2 * self.static_moment_kg_m[i] * motion.cos[i];
            partials.acceleration[(i, i)] -= self.a(i, i);
            for j in (0..self.count()).filter(|j| *j != i) {
                let (a, sin, cos) = (self.a(i, j), motion.sin_difference(i, j), motion.cos_difference(i, j));
                let turn = a * (sin * acceleration[j] - cos * rate[j] * rate[j]);
                partials.theta[(i, i)] += turn;
                partials.theta[(i, j)] -= turn;
                partials.rate[(i, j)] -= 2.0 * a * sin * rate[j];
                partials.acceleration[(i, j)] -= a * cos;
            }
        }
    }

    /// ½ΣΣ aᵢⱼ cos(θᵢ−θⱼ) θ̇ᵢθ̇ⱼ + g Σ hᵢ(1 − cos θᵢ): kinetic energy in the pivot's frame, and gravity's from the hanging position (J).
    pub fn energy_j(&self, gravity_m_s2: f64, motion: &Motion) -> f64 {
        let n = self.count();
        let pair = |i: usize, j: usize| self.a(i, j) * motion.cos_difference(i, j) * motion.rate[i] * motion.rate[j];
        let kinetic_j = 0.5 * (0..n).flat_map(|i| (0..n).map(move |j| pair(i, j))).sum::<f64>();
        let height_j = |i: usize| gravity_m_s2 * self.static_moment_kg_m[i] * (1.0 - motion.cos[i]);
        kinetic_j + (0..n).map(height_j).sum::<f64>()
    }

    fn a(&self, i: usize, j: usize) -> f64 {
        self.inertia_kg_m2[(i, j)]
    }
}

/// Subtracts what a coefficient a of two links' common inertia asks of both.
fn add_pair(a: f64, (i, j): (usize, usize), motion: &Motion, q: &mut [f64]) {
    let (sin, cos) = (motion.sin_difference(i, j), motion.cos_difference(i, j));
    q[i] -= a * (cos * motion.acceleration[j] + sin * motion.rate[j] * motion.rate[j]);
    q[j] -= a * (cos * motion.acceleration[i] - sin * motion.rate[i] * motion.rate[i]);
}

fn mass_below_kg(links: &[Link], i: usize) -> f64 {
    links[i + 1..].iter().map(|l| l.mass_kg).sum()
}

/// a and h of some links, the next one's pivot so far below each one's own.
fn coefficients(links: &[Link], next_pivot_m: &[f64]) -> (DMatrix<f64>, Vec<f64>) {
    let n = links.len();
    let static_moment_kg_m: Vec<f64> =
        (0..n).map(|i| links[i].mass_kg * links[i].com_m + next_pivot_m[i] * mass_below_kg(links, i)).collect();
    let inertia_kg_m2 = DMatrix::from_fn(n, n, |i, j| {
        if i == j {
            let Link { mass_kg, com_m, inertia_kg_m2, .. } = links[i];
            inertia_kg_m2 + mass_kg * com_m * com_m + mass_below_kg(links, i) * next_pivot_m[i] * next_pivot_m[i]
        } else {
            next_pivot_m[i.min(j)] * static_moment_kg_m[i.max(j)]
        }
    });
    (inertia_kg_m2, static_moment_kg_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_rods_have_the_coefficients_of_eq_33() {
        let strip = Specimen { mass_kg: 5.0, link_lengths_m: vec![2.0, 3.0], ..Specimen::default() };
        let chain = Chain::of(&strip).unwrap();
        let (m1, m2, l1, l2) = (2.0, 3.0, 2.0, 3.0);
        let a = chain.inertia_kg_m2();
        assert!((a[(0, 0)] - (m1 * l1 * l1 / 3.0 + m2 * l1 * l1)).abs() < 1e-12);
        assert!((a[(0, 1)] - m2 * l1 * l2 / 2.0).abs() < 1e-12 && a[(0, 1)] == a[(1, 0)]);
        assert!((a[(1, 1)] - m2 * l2 * l2 / 3.0).abs() < 1e-12);
        assert!((chain.static_moment_kg_m(0) - l1 * (m1 / 2.0 + m2)).abs() < 1e-12);
        assert!((chain.static_moment_kg_m(1) - m2 * l2 / 2.0).abs() < 1e-12);
    }

    #[test]
    fn lumps_have_the_coefficients_of_eq_22_to_25() {
        let strip = Specimen {
            mass_kg: 4.0,
            link_lengths_m: vec![2.0, 3.0],
            inertia: Inertia::Lumps,
            lumps: Some(vec![0.25, 0.5, 0.25]),
            ..Specimen::default()
        };
        let chain = Chain::of(&strip).unwrap();
        let (m2, m3, l1, l2) = (2.0, 1.0, 2.0, 3.0);
        let a = chain.inertia_kg_m2();
        assert_eq!(a[(0, 0)], (m2 + m3) * l1 * l1);
        assert_eq!(a[(0, 1)], m3 * l1 * l2);
        assert_eq!(a[(1, 1)], m3 * l2 * l2);
        assert_eq!(chain.static_moment_kg_m(0), (m2 + m3) * l1);
        assert_eq!(chain.static_moment_kg_m(1), m3 * l2);
    }

    #[test]
    fn n_equal_rods_have_the_coefficients_of_the_continuous_limit() {
        let (n, mass, length) = (5usize, 0.1, 0.04);
        let strip = Specimen { mass_kg: 0.5, link_lengths_m: vec![length; n], ..Specimen::default() };
        let chain = Chain::of(&strip).unwrap();
        for i in 0..n {
            assert!((chain.static_moment_kg_m(i) - mass * length * (n as f64 - i as f64 - 0.5)).abs() < 1e-15);
            for j in 0..n {
                let offset = if i == j { 2.0 / 3.0 } else { 0.5 };
                let expected = mass * length * length * (n as f64 - i.max(j) as f64 - offset);
                assert!((chain.inertia_kg_m2()[(i, j)] - expected).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn a_massless_tip_is_refused() {
        let strip = Specimen { inertia: Inertia::Lumps, lumps: Some(vec![0.5, 0.5, 0.0]), ..Specimen::default() };
        assert!(Chain::of(&strip).unwrap_err().to_string().contains("without inertia"));
    }
}
