//! Pressures in the pores, and the total stresses that follow from them.
//!
//! With compression of the water positive and tension of stresses positive, the total stress is σ' − (p + u) δ:
//! p is the pressure of the ground water, u what undrained ground adds to it.

use mechanics::simulation::Snapshot;

/// Total stresses in the order of the stresses.
const TOTAL: [&str; 4] = [
    "total_stress_11",
    "total_stress_22",
    "total_stress_33",
    "total_stress_12",
];

/// A quantity of a point that pore water has a part in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pressure {
    /// Pressure of the ground water, compression positive, kPa.
    Pore,
    /// What undrained ground adds to it, compression positive, kPa.
    Excess,
    /// Total stress 11, 22, 33 or 12 in global axes, tension positive, kPa.
    Total(usize),
}

impl Pressure {
    /// All of them, in the order of the columns.
    pub const ALL: [Self; 6] = [
        Self::Pore,
        Self::Excess,
        Self::Total(0),
        Self::Total(1),
        Self::Total(2),
        Self::Total(3),
    ];

    /// The name in tables, fields and probes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pore => "pore_pressure",
            Self::Excess => "excess_pore_pressure",
            Self::Total(component) => TOTAL[component],
        }
    }

    /// The quantity of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|quantity| quantity.name() == name)
    }

    /// Its value at a point of group number `group`, kPa. `None` for total stresses of elements without
    /// thickness, which have no stress.
    pub(crate) fn at(self, snapshot: &Snapshot<'_>, group: usize, point: usize) -> Option<f64> {
        let of = &snapshot.groups[group];
        let pore = || {
            let at = of.kinematics.position(point);
            snapshot.acting.pore_pressure(group, snapshot.problem, at)
        };
        let excess = || of.excess_pore_pressure(point);
        match self {
            Self::Pore => Some(pore()),
            Self::Excess => Some(excess()),
            Self::Total(component) => {
                let stress = of.global_stress(point)?[component];
                let is_normal = component < 3;
                Some(if is_normal {
                    stress - (pore() + excess())
                } else {
                    stress
                })
            }
        }
    }
}
