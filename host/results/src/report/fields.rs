//! `fields.pvd` and its `*.vtu`: a reader of what this program writes, ASCII arrays, and no more.

use super::budget::Budget;
use super::number_format::{Short, thinned};
use crate::fields::cell_type;
use serde::Serialize;
use std::path::Path;
use std::str::FromStr;

/// Fields of a run on its mesh.
#[derive(Debug, Serialize)]
pub(super) struct Fields {
    /// Coordinates of the nodes, x y x y …
    nodes: Vec<Short>,
    /// Nodes of every cell: eight of a quad, six of a triangle, three of an edge; corners first.
    cells: Vec<Vec<usize>>,
    /// Number of every cell's group.
    group: Vec<usize>,
    /// Names of the groups.
    pub(super) groups: Vec<String>,
    /// Names of the fields, of whatever time.
    pub(super) names: Vec<String>,
    pub(super) times: Vec<Snapshot>,
}

/// The state at one time.
#[derive(Debug, Serialize)]
pub(super) struct Snapshot {
    pub(super) time: Short,
    /// What the page calls it.
    pub(super) label: String,
    /// Numbers of the groups that are not active.
    inactive: Vec<usize>,
    /// x y x y …
    displacement: Vec<Short>,
    /// By field and cell; empty if there is no such field at this time (a law was swapped).
    values: Vec<Vec<Short>>,
}

/// One file.
#[derive(Debug, Default)]
struct Grid {
    nodes: Vec<f64>,
    cells: Vec<Vec<usize>>,
    group: Vec<usize>,
    /// Numbers of the groups that are not active.
    inactive: Vec<usize>,
    displacement: Vec<f64>,
    fields: Vec<(String, Vec<f64>)>,
}

impl Fields {
    /// Reads the fields in a folder, as far as they can be read and the page can hold them.
    pub(super) fn read(folder: &Path, budget: &Budget, notes: &mut Vec<String>) -> Option<Self> {
        let list = list(folder, notes)?;
        let entries = list.split("<DataSet ").skip(1);
        let of_entry = |entry| {
            let time = attribute(entry, "timestep")?.parse().ok()?;
            Some((time, attribute(entry, "file")?))
        };
        let files: Vec<(f64, &str)> = entries.filter_map(of_entry).collect();
        let mut fields: Option<Self> = None;
        let mut shown = vec![true; files.len()];
        for (number, (time, file)) in files.iter().enumerate() {
            if !shown[number] {
                continue;
            }
            let grid = std::fs::read_to_string(folder.join(file))
                .map_err(|error| error.to_string())
                .and_then(|text| Grid::parse(&text));
            let grid = match grid {
                Ok(grid) => grid,
                Err(why) => {
                    notes.push(format!("{file}: {why}; left out"));
                    continue;
                }
            };
            if fields.is_none() {
                let size = grid.nodes.len() + grid.cells.len() * grid.fields.len();
                if grid.size() > budget.mesh {
                    notes.push(too_large(grid.size()));
                    return None;
                }
                let must = |i: usize| i == number;
                let times = thinned(files.len(), budget.fields / size.max(1), must);
                shown = (0..files.len()).map(|i| times.contains(&i)).collect();
                if times.len() < files.len() {
                    notes.push(format!(
                        "fields at {} of {} times are shown; the vtu files have all",
                        times.len(),
                        files.len()
                    ));
                }
            }
            let fields = fields.get_or_insert_with(|| Self::new(&grid));
            match fields.snapshot(*time, &grid) {
                Some(snapshot) => fields.times.push(snapshot),
                None => notes.push(format!("{file}: another mesh; left out")),
            }
        }
        fields.filter(|fields| !fields.times.is_empty())
    }

    /// The fields of one file's text, at a time that is called so; `None` if the page cannot hold them.
    pub(super) fn of_one(
        text: &str,
        (groups, label): (&[String], &str),
        budget: &Budget,
        notes: &mut Vec<String>,
    ) -> Option<Self> {
        let grid = match Grid::parse(text) {
            Ok(grid) => grid,
            Err(why) => {
                notes.push(why);
                return None;
            }
        };
        if grid.size() > budget.mesh {
            notes.push(too_large(grid.size()));
            return None;
        }
        let mut fields = Self::new(&grid);
        let snapshot = fields.snapshot(0.0, &grid)?;
        fields.times.push(snapshot);
        fields.label(groups, |_| label.to_owned());
        Some(fields)
    }

    fn new(grid: &Grid) -> Self {
        Self {
            nodes: grid.nodes.iter().copied().map(Short::from).collect(),
            cells: grid.cells.clone(),
            group: grid.group.clone(),
            groups: Vec::new(),
            names: Vec::new(),
            times: Vec::new(),
        }
    }

    /// `None` if the mesh is another one.
    fn snapshot(&mut self, time: f64, grid: &Grid) -> Option<Snapshot> {
        if self.nodes.len() != grid.nodes.len() || self.cells != grid.cells {
            return None;
        }
        for (name, _) in &grid.fields {
            if !self.names.contains(name) {
                self.names.push(name.clone());
                self.times
                    .iter_mut()
                    .for_each(|t| t.values.push(Vec::new()));
            }
        }
        let short = |values: &[f64]| values.iter().copied().map(Short::from).collect();
        let values = self.names.iter().map(|name| {
            let found = grid.fields.iter().find(|(other, _)| other == name);
            found.map(|(_, values)| short(values)).unwrap_or_default()
        });
        Some(Snapshot {
            time: time.into(),
            label: String::new(),
            inactive: grid.inactive.clone(),
            displacement: short(&grid.displacement),
            values: values.collect(),
        })
    }

    /// Names groups and times.
    pub(super) fn label(&mut self, groups: &[String], label: impl Fn(f64) -> String) {
        let n = self.group.iter().max().map_or(0, |last| last + 1);
        self.groups = (0..n)
            .map(|i| groups.get(i).cloned().unwrap_or(format!("group {}", i + 1)))
            .collect();
        for snapshot in &mut self.times {
            snapshot.label = label(snapshot.time.0.unwrap_or_default());
        }
    }
}

fn too_large(size: usize) -> String {
    format!(
        "the fields are not shown: {size} numbers for mesh and one time are too many for this page"
    )
}

impl Grid {
    /// Numbers of the mesh and of the fields.
    fn size(&self) -> usize {
        2 * self.nodes.len() + self.cells.len() * (self.fields.len() + 8)
    }

    fn parse(text: &str) -> Result<Self, String> {
        let part = |name: &str| {
            let start = text.find(&format!("<{name}"))?;
            let length = text[start..].find(&format!("</{name}>"))?;
            Some(&text[start..start + length])
        };
        let part = |name: &str| part(name).ok_or(format!("it has no complete <{name}>"));
        let planar = |values: Vec<f64>| -> Vec<f64> {
            values.chunks_exact(3).flat_map(|v| [v[0], v[1]]).collect()
        };
        let (_, points) = arrays(part("Points")?).next().ok_or("it has no points")?;
        let nodes = planar(numbers(points)?);
        let cells = part("Cells")?;
        let connectivity: Vec<usize> = numbers(named(cells, "connectivity")?)?;
        let offsets: Vec<usize> = numbers(named(cells, "offsets")?)?;
        let displacement = planar(numbers(named(part("PointData")?, "displacement")?)?);
        let data = part("CellData")?;
        let group: Vec<usize> = numbers(named(data, "group")?)?;
        // Results of earlier versions do not tell: there, all were.
        let active: Vec<u8> = match named(data, "active") {
            Ok(values) => numbers(values)?,
            Err(_) => vec![1; group.len()],
        };
        let others = arrays(data).filter(|(name, _)| !["group", "active"].contains(name));
        let field = |(name, values): (&str, &str)| Ok((name.to_owned(), numbers(values)?));
        let fields: Vec<(String, Vec<f64>)> = others.map(field).collect::<Result<_, String>>()?;
        let all = cells_of(&connectivity, &offsets, nodes.len() / 2)?;
        let n = all.len();
        let fits = group.len() == n
            && active.len() == n
            && fields.iter().all(|(_, values)| values.len() == n);
        // A number that is far too large can only come from a broken file.
        if !fits || displacement.len() != nodes.len() || group.iter().any(|&g| g > n) {
            return Err("its arrays have different lengths".to_owned());
        }
        let cells = group.iter().zip(&active).filter(|(_, on)| **on == 0);
        let mut inactive: Vec<usize> = cells.map(|(group, _)| *group).collect();
        inactive.sort_unstable();
        inactive.dedup();
        Ok(Self {
            nodes,
            cells: all,
            group,
            inactive,
            displacement,
            fields,
        })
    }
}

/// The value of an attribute in a tag.
/// The list of the files, if there is one that can be read.
fn list(folder: &Path, notes: &mut Vec<String>) -> Option<String> {
    match std::fs::read_to_string(folder.join("fields.pvd")) {
        Ok(list) => Some(list),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => None,
        Err(error) => {
            notes.push(format!("fields.pvd: {error}"));
            None
        }
    }
}

/// Nodes of each cell.
fn cells_of(
    connectivity: &[usize],
    offsets: &[usize],
    n_nodes: usize,
) -> Result<Vec<Vec<usize>>, String> {
    let mut start = 0;
    let mut cells = Vec::new();
    for &end in offsets {
        let cell = connectivity.get(start..end).ok_or("its cells do not fit")?;
        let is_known = cell_type(cell.len()).is_some();
        if !is_known || cell.iter().any(|&node| node >= n_nodes) {
            return Err("a cell is no quadratic quad, triangle or edge of the mesh".to_owned());
        }
        cells.push(cell.to_vec());
        start = end;
    }
    Ok(cells)
}

fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let tag = &tag[..tag.find('>').unwrap_or(tag.len())];
    let (_, rest) = tag.split_once(&format!("{name}=\""))?;
    rest.split_once('"').map(|(value, _)| value)
}

/// Names and contents of the arrays in a part of a file.
fn arrays(part: &str) -> impl Iterator<Item = (&str, &str)> {
    part.split("<DataArray ").skip(1).filter_map(|array| {
        let (_, content) = array.split_once('>')?;
        let (content, _) = content.split_once("</DataArray>")?;
        Some((attribute(array, "Name").unwrap_or_default(), content))
    })
}

fn named<'a>(part: &'a str, name: &str) -> Result<&'a str, String> {
    arrays(part)
        .find(|(found, _)| *found == name)
        .map(|(_, content)| content)
        .ok_or(format!("it has no array {name}"))
}

fn numbers<T: FromStr>(text: &str) -> Result<Vec<T>, String> {
    text.split_ascii_whitespace()
        .map(|word| {
            word.parse()
                .map_err(|_| format!("`{word}` is not a number that belongs there"))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "<VTKFile><UnstructuredGrid><Piece>\n\
        <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">\
        0e0 0e0 0e0 0e0 1e0 0e0 0e0 5e-1 0e0 </DataArray></Points>\n\
        <Cells><DataArray Name=\"connectivity\">0 1 2 </DataArray>\
        <DataArray Name=\"offsets\">3 </DataArray></Cells>\
        <PointData Vectors=\"displacement\"><DataArray Name=\"displacement\">\
        1 2 0 3 4 0 5 6 0</DataArray></PointData>\
        <CellData><DataArray Name=\"group\">0 </DataArray>\
        <DataArray Name=\"traction_n\">-7 </DataArray></CellData></Piece>";

    #[test]
    fn a_grid_is_read() {
        let grid = Grid::parse(TEXT).unwrap();
        assert_eq!(grid.nodes, [0.0, 0.0, 0.0, 1.0, 0.0, 0.5]);
        assert_eq!(grid.cells, [[0, 1, 2]]);
        assert_eq!(grid.displacement, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(grid.fields, [("traction_n".to_owned(), vec![-7.0])]);
    }

    #[test]
    fn cells_of_all_kinds_that_are_written_are_read() {
        let connectivity = "0 1 2 ".repeat(9);
        let mixed = TEXT
            .replace("0 1 2 </DataArray>", &format!("{connectivity}</DataArray>"))
            .replace("3 </DataArray></Cells>", "3 9 17 26</DataArray></Cells>")
            .replace("\"group\">0 ", "\"group\">1 0 0 0 ")
            .replace("-7 ", "-7 -8 -9 -9 ");
        let grid = Grid::parse(&mixed).unwrap();
        let sizes: Vec<usize> = grid.cells.iter().map(Vec::len).collect();
        assert_eq!(sizes, [3, 6, 8, 9]);
        assert!(grid.inactive.is_empty());
        // A kind that is never written.
        let why = Grid::parse(&mixed.replace("3 9 17 26", "3 10 17 26")).unwrap_err();
        assert!(why.contains("no quadratic"), "{why}");
    }

    #[test]
    fn groups_that_are_not_there_are_told_from_fields() {
        let gone = TEXT.replace(
            "<DataArray Name=\"traction_n\">",
            "<DataArray Name=\"active\">0 </DataArray><DataArray Name=\"traction_n\">",
        );
        let grid = Grid::parse(&gone).unwrap();
        assert_eq!(grid.inactive, [0]);
        assert_eq!(grid.fields.len(), 1);
    }

    #[test]
    fn broken_grids_are_refused_with_the_reason() {
        for (from, to, expected) in [
            ("</CellData>", "", "no complete <CellData>"),
            ("0 1 2 ", "0 1 9 ", "of the mesh"),
            ("-7 ", "-7 8 ", "different lengths"),
            (
                "3 </DataArray></Cells>",
                "4 </DataArray></Cells>",
                "do not fit",
            ),
            ("5e-1", "5e-", "`5e-` is not a number"),
        ] {
            let why = Grid::parse(&TEXT.replace(from, to)).unwrap_err();
            assert!(why.contains(expected), "{why}");
        }
        for end in 0..TEXT.len() - 18 {
            assert!(Grid::parse(&TEXT[..end]).is_err());
        }
    }
}
