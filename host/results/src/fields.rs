//! Fields for viewers that read VTK files: `fields.pvd` lists one `fields_<n>.vtu` per time.

use crate::file;
use crate::output_request::{Output, When};
use crate::pressures::Pressure;
use mechanics::Simulation;
use mechanics::element::Kind;
use mechanics::group::Group;
use mechanics::problem::Formulation;
use mechanics::recovery::MeshError;
use mechanics::simulation::Snapshot;
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use text::Error;
use text::digits::{push_count, push_shortest};
use text::write::replace;

/// VTK's number of the kind of cell with this many nodes: quadratic edges (elements without thickness) or solids.
pub(crate) fn cell_type(n_nodes: usize) -> Option<u8> {
    if n_nodes == 3 {
        return Some(21);
    }
    Kind::with_nodes(n_nodes).map(|kind| kind.vtk)
}

/// Fields at the times asked for.
#[derive(Debug)]
pub(crate) struct Fields {
    folder: PathBuf,
    /// There are pressures in pores in the course of the problem.
    has_pressures: bool,
    /// The error of the mesh is a field.
    has_mesh_error: bool,
    /// Files written so far.
    pub(crate) written: Vec<Written>,
}

/// A file of fields.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Written {
    time: f64,
    length: u64,
}

fn file_name(number: usize) -> String {
    format!("fields_{number:05}.vtu")
}

/// Checks that files are there as they were written, by their length alone.
///
/// # Errors
/// The first that is not.
pub(crate) fn check(folder: &Path, written: &[Written]) -> Result<(), Error> {
    for (number, written) in written.iter().enumerate() {
        file::check_length(&folder.join(file_name(number)), written.length)?;
    }
    Ok(())
}

impl Fields {
    /// `None` if fields are not asked for.
    pub(crate) fn create(folder: &Path, wanted: Output, simulation: &Simulation) -> Option<Self> {
        (wanted.fields != When::Never).then(|| Self {
            folder: folder.to_owned(),
            has_pressures: simulation.problem().has_pore_pressure(),
            has_mesh_error: wanted.mesh_error,
            written: Vec::new(),
        })
    }

    pub(crate) fn write(&mut self, time: f64, snapshot: &Snapshot<'_>) -> Result<(), Error> {
        let path = self.folder.join(file_name(self.written.len()));
        let text = unstructured_grid(snapshot, self.has_pressures, self.has_mesh_error);
        replace(&path, &text)?;
        self.written.push(Written {
            time,
            length: text.len() as u64,
        });
        let mut list =
            String::from("<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n");
        for (number, Written { time, .. }) in self.written.iter().enumerate() {
            let _ = writeln!(
                list,
                "<DataSet timestep=\"{time}\" file=\"{}\"/>",
                file_name(number)
            );
        }
        list.push_str("</Collection>\n</VTKFile>\n");
        replace(&self.folder.join("fields.pvd"), list)
    }

    /// The time written last.
    pub(crate) fn last(&self) -> Option<f64> {
        self.written.last().map(|written| written.time)
    }
}

/// Means over the integration points of every element, by name of the quantity; nothing where a group
/// is not active.
fn cell_data(snapshot: &Snapshot<'_>, has_pressures: bool) -> Vec<(String, Vec<f64>)> {
    let mut names: Vec<String> = ["stress_11", "stress_22", "stress_33", "stress_12"]
        .map(str::to_owned)
        .to_vec();
    names.extend(["jump_n", "jump_t", "traction_n", "traction_t"].map(str::to_owned));
    let first_pressure = names.len();
    let pressures: &[Pressure] = if has_pressures { &Pressure::ALL } else { &[] };
    names.extend(pressures.iter().map(|quantity| quantity.name().to_owned()));
    for group in snapshot.groups {
        for variable in &group.law.built.law.formulation().internal_variables {
            if !names.contains(&variable.id) {
                names.push(variable.id.clone());
            }
        }
    }
    let columns = names.iter().enumerate().map(|(number, name)| {
        let mut values = Vec::new();
        for (of, group) in snapshot.groups.iter().enumerate() {
            for element in 0..group.kinematics.n_elements() {
                let points = group.kinematics.points_of(element);
                let n = points.len();
                let pressure = number.checked_sub(first_pressure);
                let pressure = pressure.and_then(|number| pressures.get(number));
                let sum: f64 = points
                    .filter(|_| group.is_active)
                    .map(|point| match number {
                        0..4 => group.global_stress(point).map(|s| s[number]),
                        4..6 => group
                            .jump_and_traction(point)
                            .map(|(jump, _)| jump[number - 4]),
                        6..8 => group.jump_and_traction(point).map(|(_, t)| t[number - 6]),
                        _ => match pressure {
                            Some(quantity) => quantity.at(snapshot, of, point),
                            None => group.internal_variable(point, name),
                        },
                    })
                    .map(Option::unwrap_or_default)
                    .sum();
                values.push(sum / n as f64);
            }
        }
        (name.clone(), values)
    });
    columns.collect()
}

/// Stands where an element has no estimate: no share is negative, and readers of VTK files in text do not take NaN.
const NO_ESTIMATE: f64 = -1.0;

/// The share of every element in the error of the mesh.
fn mesh_error(snapshot: &Snapshot<'_>) -> (String, Vec<f64>) {
    let found = MeshError::of(snapshot);
    let groups = snapshot.groups.iter().enumerate();
    let values = groups.flat_map(|(number, group)| {
        let elements = 0..group.kinematics.n_elements();
        let found = &found;
        elements.map(move |element| found.of_element(number, element).unwrap_or(NO_ESTIMATE))
    });
    ("mesh_error".to_owned(), values.collect())
}

/// Whole numbers, each with a blank after it.
fn list(values: &[usize]) -> String {
    let mut text = Vec::new();
    for &value in values {
        push_count(&mut text, value);
        text.push(b' ');
    }
    String::from_utf8_lossy(&text).into_owned()
}

/// Numbers, each with a blank after it.
fn reals(values: impl Iterator<Item = f64>) -> String {
    let mut text = Vec::new();
    for value in values {
        push_shortest(&mut text, value);
        text.push(b' ');
    }
    String::from_utf8_lossy(&text).into_owned()
}

/// Arrays of the cells.
#[derive(Default)]
struct Cells {
    connectivity: Vec<usize>,
    offsets: Vec<usize>,
    types: Vec<usize>,
    groups: Vec<usize>,
    active: Vec<usize>,
}

impl Cells {
    fn of(groups: &[Group]) -> Self {
        let mut cells = Self::default();
        for (number, group) in groups.iter().enumerate() {
            for element in 0..group.kinematics.n_elements() {
                let nodes = group.kinematics.nodes(element);
                let is_joint = group.formulation == Formulation::ZeroThickness;
                let shown = if is_joint { &nodes[..3] } else { nodes };
                cells.connectivity.extend(shown);
                cells.offsets.push(cells.connectivity.len());
                let of_nodes = cell_type(shown.len());
                cells.types.push(of_nodes.map_or(0, usize::from));
                cells.groups.push(number);
                cells.active.push(usize::from(group.is_active));
            }
        }
        cells
    }
}

/// The text of a file. Cells stand group by group, as `cell_data` has them.
pub(crate) fn unstructured_grid(
    snapshot: &Snapshot<'_>,
    has_pressures: bool,
    has_mesh_error: bool,
) -> String {
    let mesh = snapshot.mesh;
    let Cells {
        connectivity,
        offsets,
        types,
        groups,
        active,
    } = Cells::of(snapshot.groups);
    let points = reals(mesh.nodes.iter().flat_map(|[x, y]| [*x, *y, 0.0]));
    let pairs = snapshot.displacement.chunks_exact(2);
    let u = reals(pairs.flat_map(|u| [u[0], u[1], 0.0]));
    let connectivity = list(&connectivity);
    let mut cells = String::new();
    let of_mesh = has_mesh_error.then(|| mesh_error(snapshot));
    let data = cell_data(snapshot, has_pressures);
    for (name, values) in data.into_iter().chain(of_mesh) {
        let values = reals(values.into_iter());
        let _ = writeln!(
            cells,
            "<DataArray type=\"Float64\" Name=\"{name}\" format=\"ascii\">{values}</DataArray>"
        );
    }
    format!(
        "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\">\n\
         <UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n\
         <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">{points}\
         </DataArray></Points>\n\
         <Cells>\n<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">{connectivity}\
         </DataArray>\n<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">{}</DataArray>\n\
         <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">{}</DataArray>\n</Cells>\n\
         <PointData Vectors=\"displacement\"><DataArray type=\"Float64\" Name=\"displacement\" \
         NumberOfComponents=\"3\" format=\"ascii\">{u}</DataArray></PointData>\n\
         <CellData>\n<DataArray type=\"Int64\" Name=\"group\" format=\"ascii\">{}</DataArray>\n\
         <DataArray type=\"UInt8\" Name=\"active\" format=\"ascii\">{}</DataArray>\n\
         {cells}</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
        mesh.nodes.len(),
        offsets.len(),
        list(&offsets),
        list(&types),
        list(&groups),
        list(&active),
    )
}
