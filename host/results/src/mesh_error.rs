//! The error of the mesh in the strains, as it is written.

use mechanics::recovery::MeshError;
use mechanics::simulation::Snapshot;
use serde::{Deserialize, Serialize};

/// At the end of a phase.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct OfPhase {
    phase: String,
    /// For all groups that have an estimate; none if no group has one, or nothing is strained.
    strains: Option<f64>,
    groups: Vec<OfGroup>,
}

/// For one group.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct OfGroup {
    name: String,
    /// None of an interface, of a layer, of what is absent, of a few elements.
    strains: Option<f64>,
    /// Stresses follow strains by one constant matrix.
    linear: bool,
}

impl OfPhase {
    /// For the state at the end of a phase.
    pub(crate) fn of(phase: &str, snapshot: &Snapshot<'_>) -> Self {
        let found = MeshError::of(snapshot);
        let groups = snapshot.groups.iter().enumerate();
        let groups = groups.map(|(number, group)| OfGroup {
            name: group.name.clone(),
            strains: found.of_group(number),
            linear: group.is_linear(),
        });
        Self {
            phase: phase.to_owned(),
            strains: found.relative(),
            groups: groups.collect(),
        }
    }

    /// In words.
    pub(crate) fn words(&self) -> String {
        let Self { phase, .. } = self;
        let Some(strains) = self.strains else {
            return format!("error of the mesh at the end of phase `{phase}`: no estimate");
        };
        let told = self.groups.iter().filter(|group| group.strains.is_some());
        let each: Vec<String> = told
            .clone()
            .filter_map(|group| Some(format!("{} {}", group.name, percent(group.strains?))))
            .collect();
        let mut words = format!(
            "error of the mesh in the strains, estimated at the end of phase `{phase}`: {} ({})",
            percent(strains),
            each.join(", ")
        );
        if told.clone().any(|group| !group.linear) {
            words += "; of laws that yield: where the mesh is too coarse rather than by how much";
        }
        words
    }
}

fn percent(part: f64) -> String {
    let percent = 100.0 * part;
    if percent >= 0.1 {
        format!("{percent:.1} %")
    } else {
        format!("{percent:.0e} %")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_without_an_estimate_are_not_in_the_words() {
        let group = |name: &str, strains, linear| OfGroup {
            name: name.to_owned(),
            strains,
            linear,
        };
        let mut of = OfPhase {
            phase: "push".to_owned(),
            strains: Some(0.032),
            groups: vec![
                group("soil", Some(0.033), true),
                group("joint", None, false),
            ],
        };
        let head = "error of the mesh in the strains, estimated at the end of phase `push`: 3.2 %";
        assert_eq!(of.words(), format!("{head} (soil 3.3 %)"));
        of.groups[0].linear = false;
        assert!(
            of.words().ends_with("rather than by how much"),
            "{}",
            of.words()
        );
        of.strains = None;
        assert!(of.words().ends_with("no estimate"), "{}", of.words());
    }
}
