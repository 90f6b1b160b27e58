//! Settings that differ from those of a case file.

use super::division::divide;
use super::scheme::{Scheme, Values, short};
use crate::Error;
use input::Case;
use input::material::set_parameters;
use mechanics::Settings as Solver;
use mechanics::problem::{Formulation, Integration};
use toml::Value;

/// A choice of the solver: key and value in the case file.
pub(super) type SolverChoice = (&'static str, &'static str);

/// Equilibrium of forces alone. That differs most where little of it is asked for.
pub(super) const BY_FORCE: SolverChoice = ("convergence", "force");

/// All choices of the solver that a study tries.
pub(super) const SOLVER_CHOICES: [SolverChoice; 15] = [
    ("method", "auto"),
    ("method", "newton"),
    ("method", "modified_newton"),
    ("method", "initial_stress"),
    ("method", "quasi_newton"),
    ("equations", "auto"),
    ("equations", "condensed"),
    ("equations", "sparse"),
    ("line_search", "true"),
    ("line_search", "false"),
    ("control", "auto"),
    ("control", "load"),
    ("control", "viscous"),
    ("convergence", "both"),
    BY_FORCE,
];

/// The solver's settings with one of these choices.
///
/// # Errors
/// [`text::Error::Internal`]: there is no such choice.
pub(super) fn with_choice(solver: &Solver, (key, value): SolverChoice) -> Result<Solver, Error> {
    let value = match value.parse() {
        Ok(yes) => Value::Boolean(yes),
        Err(_) => value.into(),
    };
    let set = toml::Table::try_from(solver).map_err(|error| error.to_string());
    let set = set.and_then(|mut all| {
        all.insert(key.to_owned(), value);
        all.try_into().map_err(|error| error.to_string())
    });
    set.map_err(Error::internal)
}

/// Settings that differ from those of the case file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Settings {
    /// Factor of the increments of every phase.
    pub(super) increments: f64,
    /// Tolerance of the residual; that of the correction keeps its ratio to it.
    pub(super) tolerance: Option<f64>,
    /// The mesh is divided by this.
    pub(super) division: usize,
    /// Integration of thin layers.
    pub(super) integration: Option<Integration>,
    /// Parameters of a law, with words for them.
    pub(super) law: Option<(String, Values, String)>,
    /// A choice of the solver.
    pub(super) solver: Option<SolverChoice>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            increments: 1.0,
            tolerance: None,
            division: 1,
            integration: None,
            law: None,
            solver: None,
        }
    }
}

impl Settings {
    pub(super) fn with_increments(self, increments: f64) -> Self {
        Self { increments, ..self }
    }

    pub(super) fn with_tolerance(self, tolerance: f64) -> Self {
        let tolerance = Some(tolerance);
        Self { tolerance, ..self }
    }

    pub(super) fn divided(self, division: usize) -> Self {
        Self { division, ..self }
    }

    /// With a scheme of the law of this name.
    pub(super) fn with_scheme(self, law: &str, scheme: &Scheme) -> Self {
        let law = Some(scheme.of(law));
        Self { law, ..self }
    }

    pub(super) fn with_solver(self, choice: SolverChoice) -> Self {
        let solver = Some(choice);
        Self { solver, ..self }
    }

    /// In words, as far as they differ from the file.
    pub(super) fn label(&self) -> String {
        let mut words = Vec::new();
        words.extend(self.law.as_ref().map(|(_, _, label)| label.clone()));
        if (self.increments - 1.0).abs() > 0.0 {
            words.push(format!("increments × {}", short(self.increments)));
        }
        words.extend(self.tolerance.map(|t| format!("tolerance {}", short(t))));
        if self.division > 1 {
            words.push(format!("mesh / {}", self.division));
        }
        let integration = self.integration.map(|integration| match integration {
            Integration::Full => "integration full",
            Integration::Reduced => "integration reduced",
            Integration::Projected => "integration projected",
            Integration::BBar => "integration b_bar",
            Integration::Mean => "integration mean",
            Integration::Nodes => "integration nodes",
        });
        words.extend(integration.map(str::to_owned));
        words.extend(self.solver.map(|(key, value)| format!("{key} {value}")));
        if words.is_empty() {
            return "as in the file".to_owned();
        }
        words.join(", ")
    }

    /// The case with these settings.
    ///
    /// # Errors
    /// Those of building the mesh.
    pub(super) fn apply(&self, case: &Case) -> Result<Case, Error> {
        let mut case = case.clone();
        if self.division > 1 {
            divide(&mut case, self.division)?;
        }
        let file = &mut case.file;
        for phase in &mut file.phases {
            let n = *phase.increments.get_ref();
            let scaled = scaled(n, self.increments);
            *phase.increments.get_mut() = scaled;
            let figures = file.figures.iter_mut().filter(|figure| {
                let named = figure.phase.as_ref();
                named.is_none_or(|p| p.get_ref() == phase.name.get_ref())
            });
            for increments in figures.filter_map(|figure| figure.increments()) {
                let moved = |k: &mut usize| *k = (*k * scaled).div_ceil(n);
                increments.iter_mut().for_each(moved);
            }
        }
        if let Some(tolerance) = self.tolerance {
            let solver = file.solver.get_mut();
            let ratio = solver.displacement_tolerance / solver.force_tolerance;
            solver.force_tolerance = tolerance;
            solver.displacement_tolerance = (ratio * tolerance).clamp(1e-14, 1.0);
        }
        if let Some(integration) = self.integration {
            let layers = file.groups.values_mut().map(text::Spanned::get_mut);
            for group in layers.filter(|g| g.formulation == Formulation::ThinLayer) {
                group.integration = Some(text::Spanned::new(0..0, integration));
            }
        }
        if let Some((name, values, _)) = &self.law {
            let laws = file.laws.iter_mut();
            for (_, law) in laws.filter(|(key, _)| key.get_ref() == name) {
                set_parameters(&mut law.get_mut().parameters, values);
            }
        }
        if let Some(choice) = self.solver {
            let solver = file.solver.get_mut();
            *solver = with_choice(solver, choice)?;
        }
        Ok(case)
    }
}

/// A number of increments times a factor. Fewer ones are, where there is such a number nearby,
/// a divisor, so that all their rows stay rows.
fn scaled(n: usize, factor: f64) -> usize {
    let wanted = n as f64 * factor;
    let distance = |d: usize| (d as f64 / wanted).ln().abs();
    if factor < 1.0
        && let Some(divisor) = (1..=n)
            .filter(|d| n.is_multiple_of(*d))
            .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
        && distance(divisor) <= f64::ln(1.6)
    {
        return divisor;
    }
    (wanted.round() as usize).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_choice_of_the_solver_is_one() {
        for choice in SOLVER_CHOICES {
            let solver = with_choice(&Solver::default(), choice).unwrap();
            let set = serde_json::to_value(solver).unwrap();
            let value = set[choice.0].to_string();
            assert_eq!(value.trim_matches('"'), choice.1, "{}", choice.0);
        }
    }

    #[test]
    fn fewer_increments_divide_the_given_ones() {
        let cases = [(50, 0.25, 10), (50, 0.5, 25), (1, 0.25, 1), (37, 0.25, 9)];
        for (n, factor, expected) in cases {
            assert_eq!(scaled(n, factor), expected, "{n} × {factor}");
        }
        assert_eq!(scaled(50, 4.0), 200);
    }
}
