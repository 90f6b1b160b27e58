//! Stresses at all integration points.

use crate::file::Extent;
use crate::output_request::When;
use crate::pressures::Pressure;
use crate::recorder::internal_variables;
use crate::table::{Cell, Table};
use mechanics::simulation::Snapshot;
use mechanics::{Place, Simulation};
use std::path::Path;
use text::Error;

/// `points.csv`: one row per integration point of every active group that has a stress.
#[derive(Debug)]
pub(crate) struct Points {
    pub(crate) table: Table,
    /// Quantities of pore water, if the problem has any.
    pressures: &'static [Pressure],
    /// Internal variables of all laws of these groups, each once.
    variables: Vec<String>,
}

impl Points {
    /// As [`Table::begin`]. `None` if it is not asked for.
    pub(crate) fn begin(
        folder: &Path,
        when: When,
        simulation: &Simulation,
        from: Option<Extent>,
    ) -> Result<Option<Self>, Error> {
        if when == When::Never {
            return Ok(None);
        }
        let variables = internal_variables(simulation, |group| group.global_stress(0).is_some());
        let columns = [
            "phase",
            "increment",
            "group",
            "element",
            "point",
            "x",
            "y",
            "stress_11",
            "stress_22",
            "stress_33",
            "stress_12",
        ];
        let has_pressures = simulation.problem().has_pore_pressure();
        let pressures: &[Pressure] = if has_pressures { &Pressure::ALL } else { &[] };
        let columns = columns
            .into_iter()
            .chain(pressures.iter().map(|quantity| quantity.name()))
            .chain(variables.iter().map(String::as_str));
        let table = Table::begin(folder.join("points.csv"), columns, from)?;
        Ok(Some(Self {
            table,
            pressures,
            variables,
        }))
    }

    pub(crate) fn write(&mut self, place: &Place, snapshot: &Snapshot<'_>) -> Result<(), Error> {
        let groups = snapshot.groups.iter().enumerate();
        for (number, group) in groups.filter(|(_, group)| group.is_active) {
            for point in 0..group.kinematics.n_points() {
                let Some(stress) = group.global_stress(point) else {
                    break;
                };
                let (element, within) = group.kinematics.place_of(point);
                let place = [
                    Cell::Text(&place.phase),
                    Cell::Count(place.increment),
                    Cell::Text(&group.name),
                    Cell::Count(element + 1),
                    Cell::Count(within + 1),
                ];
                let values = group.kinematics.position(point).into_iter().chain(stress);
                let pressures = self
                    .pressures
                    .iter()
                    .map(|quantity| quantity.at(snapshot, number, point));
                let internal = self
                    .variables
                    .iter()
                    .map(|id| group.internal_variable(point, id));
                let numbers = values.map(Some).chain(pressures).chain(internal);
                self.table
                    .row(place.into_iter().chain(numbers.map(Cell::Number)));
            }
        }
        self.table.flush()
    }
}
