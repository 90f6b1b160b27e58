//! Values along interfaces.

use crate::file::Extent;
use crate::output_request::When;
use crate::pressures::Pressure;
use crate::recorder::internal_variables;
use crate::report::{Point, Profiles};
use crate::table::{Cell, Table, push_text};
use mechanics::group::Group;
use mechanics::simulation::Snapshot;
use mechanics::{Place, Simulation};
use std::path::Path;
use text::Error;
use text::digits::{push, push_count};

/// `profile.csv`: one row per integration point of every active thin layer and
/// zero-thickness group.
#[derive(Debug)]
pub(crate) struct Profile {
    pub(crate) table: Table,
    /// There is ground water in the course of the problem.
    has_water: bool,
    /// Internal variables of all laws of these groups, each once.
    variables: Vec<String>,
    /// What is the same in every increment: group, element, point and position of every point, as cells; by
    /// group, as soon as one is written.
    places: Vec<Vec<Vec<u8>>>,
    /// What a report shows of the table; `None` if an earlier run wrote a part of it.
    shown: Option<Profiles>,
}

impl Profile {
    /// As [`Table::begin`]. `None` if it is not asked for or there is no interface.
    pub(crate) fn begin(
        folder: &Path,
        when: When,
        simulation: &Simulation,
        from: Option<Extent>,
    ) -> Result<Option<Self>, Error> {
        let is_interface = |group: &Group| group.jump_and_traction(0).is_some();
        if when == When::Never || !simulation.groups().iter().any(is_interface) {
            return Ok(None);
        }
        let variables = internal_variables(simulation, is_interface);
        let columns = [
            "phase",
            "increment",
            "group",
            "element",
            "point",
            "x",
            "y",
            "s",
            "jump_n",
            "jump_t",
            "traction_n",
            "traction_t",
        ];
        let has_water = simulation.problem().has_water();
        let columns = columns
            .into_iter()
            .chain(has_water.then(|| Pressure::Pore.name()))
            .chain(variables.iter().map(String::as_str));
        let shown = columns.clone().filter(|column| Profiles::shows(column));
        let shown = shown.map(str::to_owned).collect();
        let table = Table::begin(folder.join("profile.csv"), columns, from)?;
        Ok(Some(Self {
            table,
            shown: from.is_none().then(|| Profiles::of_one(shown)),
            has_water,
            variables,
            places: vec![Vec::new(); simulation.groups().len()],
        }))
    }

    pub(crate) fn write(&mut self, place: &Place, snapshot: &Snapshot<'_>) -> Result<(), Error> {
        let mut values = Vec::new();
        let mut n_rows = 0;
        if let Some(shown) = &mut self.shown {
            shown.begin(&place.phase);
        }
        let groups = snapshot.groups.iter().enumerate();
        for (number, group) in groups.filter(|(_, group)| group.is_active) {
            if self.places[number].is_empty() && group.jump_and_traction(0).is_some() {
                let points = 0..group.kinematics.n_points();
                self.places[number] = points.map(|point| cells_of(group, point)).collect();
            }
            for (point, cells) in self.places[number].iter().enumerate() {
                let Some((jump, traction)) = group.jump_and_traction(point) else {
                    break;
                };
                let place = [
                    Cell::Text(&place.phase),
                    Cell::Count(place.increment),
                    Cell::Written(cells),
                ];
                let of_point = [jump[0], jump[1], traction[0], traction[1]].map(Some);
                let pressure = self
                    .has_water
                    .then(|| Pressure::Pore.at(snapshot, number, point));
                let internal = self
                    .variables
                    .iter()
                    .map(|id| group.internal_variable(point, id));
                let first = values.len();
                values.extend(of_point.into_iter().chain(pressure).chain(internal));
                let numbers = values[first..].iter().copied().map(Cell::Number);
                self.table.row(place.into_iter().chain(numbers));
                n_rows += 1;
                if let Some(shown) = self.shown.as_mut().filter(|shown| shown.wants_points()) {
                    shown.add_point(Some(point_of(group, point)));
                }
            }
        }
        self.table.flush()?;
        if let Some(shown) = &mut self.shown {
            let numbers = values.iter().map(|value| value.unwrap_or(f64::NAN));
            shown.end(place.increment, n_rows, numbers.collect());
        }
        Ok(())
    }

    /// Excerpt of the table for a report, with the table's length; later rows are not in it.
    pub(crate) fn shown(&mut self) -> Option<(u64, Profiles)> {
        let shown = self.shown.take()?;
        Some((self.table.length(), shown))
    }
}

/// A point as a report knows it.
fn point_of(group: &Group, point: usize) -> Point {
    let position = group.kinematics.position(point);
    let (element, _) = group.kinematics.place_of(point);
    Point {
        group: group.name.clone(),
        element: element + 1,
        s: along(group, element, position),
        position,
    }
}

/// Place along an interface.
fn along(group: &Group, element: usize, [x, y]: [f64; 2]) -> f64 {
    let along = group.kinematics.axes(element).along;
    along[0] * x + along[1] * y
}

/// What is the same in every row of a point: its group, its element, its number there, where it is.
fn cells_of(group: &Group, point: usize) -> Vec<u8> {
    let [x, y] = group.kinematics.position(point);
    let (element, within) = group.kinematics.place_of(point);
    let s = along(group, element, [x, y]);
    let mut cells = Vec::new();
    push_text(&mut cells, &group.name);
    for count in [element + 1, within + 1] {
        cells.push(b',');
        push_count(&mut cells, count);
    }
    for value in [x, y, s] {
        cells.push(b',');
        push(&mut cells, value);
    }
    cells
}
