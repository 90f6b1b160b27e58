//! Parameters that vary from element to element: each has its own law.

use crate::element::Kinematics;
use crate::problem::{Material, Variation};
use law::{BuildFailure, BuiltLaw, Value};
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

/// Laws of the elements of a group, if they are not all the same.
#[derive(Clone, Debug, Default)]
pub(in crate::group) struct Varying {
    /// Each combination of values once.
    laws: Vec<Arc<BuiltLaw>>,
    /// Consecutive points of one law, and which it is.
    pub(in crate::group) runs: Vec<(Range<usize>, usize)>,
}

impl Varying {
    /// The laws of these elements; `None` if their parameters do not vary.
    ///
    /// # Errors
    /// The values of an element do not fit.
    pub(in crate::group) fn new(
        material: &Material,
        kinematics: &dyn Kinematics,
    ) -> Result<Option<Self>, BuildFailure> {
        if material.varying.is_empty() {
            return Ok(None);
        }
        let mut varying = Self::default();
        let mut known: HashMap<Vec<u64>, usize> = HashMap::new();
        for element in 0..kinematics.n_elements() {
            let points = kinematics.points_of(element);
            let heights = points.clone().map(|point| kinematics.position(point)[1]);
            let height = heights.sum::<f64>() / points.len() as f64;
            let values = material
                .varying
                .iter()
                .map(|(_, variation)| match variation {
                    Variation::Height(profile) => profile.at(height),
                    // The law refuses what is no number.
                    Variation::Elements(values) => values.get(element).copied().unwrap_or(f64::NAN),
                });
            let values: Vec<f64> = values.collect();
            let key = values.iter().map(|value| value.to_bits()).collect();
            let number = if let Some(&number) = known.get(&key) {
                number
            } else {
                let built = with_values(material, &values)?;
                varying.laws.push(Arc::new(built));
                known.insert(key, varying.laws.len() - 1);
                varying.laws.len() - 1
            };
            match varying.runs.last_mut() {
                Some((run, of)) if *of == number => run.end = points.end,
                _ => varying.runs.push((points, number)),
            }
        }
        Ok(Some(varying))
    }

    /// A law by its number.
    pub(in crate::group) fn law(&self, number: usize) -> &BuiltLaw {
        &self.laws[number]
    }
}

/// A material's law with other values of the parameters that vary.
fn with_values(material: &Material, values: &[f64]) -> Result<BuiltLaw, BuildFailure> {
    let law = &material.built.law;
    let declared = &law.description().parameters;
    let used = material.built.parameters.iter().zip(declared);
    let given = used.filter_map(|(used, declared)| {
        let varies = material.varying.iter().position(|(id, _)| *id == used.id);
        if varies.is_none() && used.by_default {
            return None;
        }
        let number = varies.map_or(used.value, |number| values[number]);
        let value = match declared.choices.get(number as usize) {
            Some(choice) => Value::Label(choice.clone()),
            None => Value::Number(number),
        };
        Some((used.id.as_str(), value))
    });
    let given: Vec<(&str, Value)> = given.collect();
    law.loaded().with(law.hypothesis(), &given)
}
