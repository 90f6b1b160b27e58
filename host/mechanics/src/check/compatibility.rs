//! Whether a state of one problem is one of another: what of both must be the same.

use crate::problem::{ElementGroup, Material, Phase, Problem};
use std::fmt::{self, Write as _};
use std::hash::{DefaultHasher, Hasher as _};

/// Checksums of everything that the states of a problem depend on, compared within one process.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Compatibility {
    mesh: u64,
    /// Analysis, supports and ground water.
    whole: u64,
    groups: Vec<(String, u64)>,
    phases: Vec<(String, u64)>,
}

/// What two problems differ in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Incompatibility {
    /// Nodes, elements or lines.
    Mesh,
    /// Analysis, supports or ground water.
    Whole,
    /// The number of groups, or their names.
    Groups,
    /// A group: its law, the parameters of the law, or other keys.
    Group(String),
    /// A phase up to the one of the state.
    Phase(String),
}

impl Problem {
    /// What its states depend on. How equilibrium is sought is no part of it.
    pub fn likeness(&self) -> Compatibility {
        let whole = format_args!("{:?} {:?} {:?}", self.analysis, self.supports, self.water).sum();
        let of_group = |group: &ElementGroup| (group.name.clone(), sum_of_group(group));
        let of_phase = |phase: &Phase| (phase.name.clone(), sum_of_phase(phase));
        Compatibility {
            mesh: format_args!("{:?}", self.mesh).sum(),
            whole,
            groups: self.groups.iter().map(of_group).collect(),
            phases: self.phases.iter().map(of_phase).collect(),
        }
    }
}

impl Compatibility {
    /// The first difference that keeps a state of one problem, in a phase, from being one of another; `None` if they
    /// are compatible.
    pub fn unlike(&self, other: &Self, phase: usize) -> Option<Incompatibility> {
        if self.mesh != other.mesh {
            return Some(Incompatibility::Mesh);
        }
        let names = |of: &Self| -> Vec<String> { of.groups.iter().map(|g| g.0.clone()).collect() };
        if names(self) != names(other) {
            return Some(Incompatibility::Groups);
        }
        let mut groups = self.groups.iter().zip(&other.groups);
        if let Some((own, _)) = groups.find(|(own, other)| own != other) {
            return Some(Incompatibility::Group(own.0.clone()));
        }
        if self.whole != other.whole {
            return Some(Incompatibility::Whole);
        }
        let up_to = |of: &Self, number: usize| of.phases.get(number).cloned();
        let is_other = |number: &usize| up_to(self, *number) != up_to(other, *number);
        let number = (0..=phase).find(is_other)?;
        let name = up_to(self, number).or_else(|| up_to(other, number));
        Some(Incompatibility::Phase(name.unwrap_or_default().0))
    }
}

impl fmt::Display for Incompatibility {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mesh => write!(f, "another mesh"),
            Self::Whole => write!(f, "another analysis, other supports or other ground water"),
            Self::Groups => write!(f, "other groups"),
            Self::Group(name) => write!(
                f,
                "another group `{name}`: another law, other parameters, or what else is said of it"
            ),
            Self::Phase(name) => write!(f, "another phase `{name}`"),
        }
    }
}

/// Sums up what is written into it.
#[derive(Default)]
struct Sum(DefaultHasher);

impl fmt::Write for Sum {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.write(text.as_bytes());
        Ok(())
    }
}

/// Items with a checksum.
trait Summed {
    fn sum(self) -> u64;
}

impl Summed for fmt::Arguments<'_> {
    fn sum(self) -> u64 {
        let mut sum = Sum::default();
        // Nothing that is written here fails.
        let _ = sum.write_fmt(self);
        sum.0.finish()
    }
}

fn sum_of_group(group: &ElementGroup) -> u64 {
    let ElementGroup {
        name: _,
        formulation,
        material,
        integration,
        normal,
        in_plane,
        initial_stress,
        unit_weight,
        saturated_unit_weight,
        pore_water,
        is_active,
        drainage,
        undrained_poisson_ratio,
    } = group;
    let elements = (formulation, integration, normal, in_plane);
    let ground = (initial_stress, unit_weight, saturated_unit_weight);
    let water = (pore_water, drainage, undrained_poisson_ratio);
    let law = sum_of_material(material);
    format_args!("{law} {elements:?} {ground:?} {water:?} {is_active}").sum()
}

fn sum_of_phase(phase: &Phase) -> u64 {
    let mut rest = phase.clone();
    let materials = std::mem::take(&mut rest.materials).into_iter();
    let materials: Vec<(usize, u64)> = materials
        .map(|(group, material)| (group, sum_of_material(&material)))
        .collect();
    format_args!("{materials:?} {rest:?}").sum()
}

fn sum_of_material(material: &Material) -> u64 {
    let law = &material.built.law;
    let library = law.library();
    let bits: Vec<u64> = law.parameters().iter().map(|p| p.to_bits()).collect();
    format_args!(
        "{} {} {} {:?} {:?} {bits:?} {:?} {:?}",
        law.description().id,
        law.hypothesis().name(),
        library.sha256(),
        library.sidecar_sha256(),
        law.loaded().shear_zone(),
        material.initial,
        material.varying
    )
    .sum()
}
