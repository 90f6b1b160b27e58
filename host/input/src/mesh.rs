//! The mesh of a case: a grid or a file's, and the elements inserted along its lines.

use crate::build::line;
use crate::case::{CaseFile, Ends, MeshInput};
use crate::{Error, gmsh, grid};
use mechanics::mesh::{Along, CannotInsert, Mesh, Reason};
use mechanics::problem::Formulation;
use std::ops::Range;
use text::{Source, Spanned};

/// A mesh, and the file that it came from.
#[derive(Clone, Debug, Default)]
pub struct Built {
    /// The mesh.
    pub mesh: Mesh,
    /// The file, if it is not a grid.
    pub file: Option<MeshFile>,
}

/// The file of a mesh.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MeshFile {
    /// Its path.
    pub path: String,
    /// SHA-256 of its bytes.
    pub sha256: String,
    /// What the user should know of it.
    pub notes: Vec<String>,
    /// Places in the file, from 0, of the mesh's first nodes: all that elements of the case have. Nodes made by
    /// divisions and interfaces come after them.
    pub kept: Vec<usize>,
}

/// The mesh of a case.
///
/// # Errors
/// [`text::Error::Input`] at the key that does not fit; [`text::Error::Unreadable`] with the place in
/// the mesh's file.
pub fn build(source: &Source, file: &CaseFile) -> Result<Built, Error> {
    let MeshInput {
        file: written,
        scale,
        columns,
        rows,
        ..
    } = &file.mesh;
    let mut built = match (written, columns, rows) {
        (Some(written), ..) => {
            if let Some((key, span)) = grid_key(&file.mesh) {
                let message =
                    format!("`{key}` belongs to a grid, and the mesh is that of a `file`");
                return Err(source.error(span, message).into());
            }
            let (mesh, file) = gmsh::mesh(source, file, written)?;
            let file = Some(file);
            Built { mesh, file }
        }
        (None, Some(columns), Some(rows)) => {
            if let Some(scale) = scale {
                let message = "`scale` belongs to a `file`, and the mesh is a grid";
                return Err(source.error(scale.span(), message).into());
            }
            let mesh = grid::grid_mesh(source, file, [columns, rows])?;
            Built { mesh, file: None }
        }
        _ => {
            let place = grid_key(&file.mesh);
            let message = match (columns, rows) {
                (Some(_), None) => "missing key `rows`",
                (None, Some(_)) => "missing key `columns`",
                _ => "the mesh needs `columns` and `rows` of a grid, or a `file`",
            };
            let span = place.map_or(0..0, |(_, span)| span);
            return Err(source.error(span, message).into());
        }
    };
    insert_joints(source, file, &mut built.mesh)?;
    collect_line_nodes(&mut built.mesh);
    Ok(built)
}

/// A key that only a grid has, with its place.
fn grid_key(input: &MeshInput) -> Option<(&'static str, Range<usize>)> {
    let keys = [
        ("columns", input.columns.as_ref().map(Spanned::span)),
        ("rows", input.rows.as_ref().map(Spanned::span)),
        ("origin", input.origin.as_ref().map(Spanned::span)),
        ("region", input.regions.first().map(|r| r.group.span())),
        ("lines", input.lines.keys().next().map(Spanned::span)),
    ];
    let mut keys = keys.into_iter();
    keys.find_map(|(key, span)| span.map(|span| (key, span)))
}

/// Inserts the elements of all zero-thickness groups.
fn insert_joints(source: &Source, file: &CaseFile, mesh: &mut Mesh) -> Result<(), Error> {
    let mut along = Vec::new();
    let mut places = Vec::new();
    for (number, (name, group)) in file.groups.iter().enumerate() {
        let group = group.get_ref();
        match (group.formulation, &group.line) {
            (Formulation::ZeroThickness, Some(key)) => {
                line(mesh, source, key)?;
                let ends = group.ends.as_ref().map_or(Ends::Open, |e| *e.get_ref());
                along.push(Along {
                    line: key.get_ref().clone(),
                    group: number,
                    opens_ends: ends == Ends::Open,
                });
                places.push((name, key));
            }
            (Formulation::ZeroThickness, None) => {
                let message = format!(
                    "group `{}` needs a `line` to be inserted along",
                    name.get_ref()
                );
                return Err(source.error(name.span(), message).into());
            }
            (_, Some(line)) => {
                let message = "`line` only belongs to the formulation `zero_thickness`";
                return Err(source.error(line.span(), message).into());
            }
            (_, None) => {
                if let Some(ends) = &group.ends {
                    let message = "`ends` only belongs to the formulation `zero_thickness`";
                    return Err(source.error(ends.span(), message).into());
                }
            }
        }
    }
    mesh.insert_joints(&along).map_err(|cannot| {
        let (name, key) = places[cannot.number];
        let other = |other: usize| places[other].0.get_ref().as_str();
        let message = format!("group `{}`: {}", name.get_ref(), words(&cannot, other));
        source.error(key.span(), message).into()
    })
}

/// Why elements cannot be inserted along a line. `group` is the name of the group that goes along one
/// of them.
fn words<'n>(cannot: &CannotInsert, group: impl Fn(usize) -> &'n str) -> String {
    let at = cannot
        .at
        .map_or_else(String::new, |[x, y]| format!(" at ({x}, {y})"));
    match cannot.reason {
        None => "the line is a point".to_owned(),
        Some(Reason::OnBoundary) => {
            format!("the line lies on the boundary{at}: nothing to split")
        }
        Some(Reason::TakenBy(other)) => format!(
            "the line has elements of group `{}` already{at}",
            group(other)
        ),
        Some(Reason::NoEdge) => format!("no element has a side on the line{at}"),
        Some(Reason::Overlapping) => {
            format!("elements overlap on the line{at}: it does not have two sides")
        }
    }
}

/// Nodes of every line, after all splitting, in the order of the coordinates: those of the elements
/// that have a side on it. So where a line ends at another one with doubled nodes, it has those on
/// its side.
fn collect_line_nodes(mesh: &mut Mesh) {
    let mut lines = std::mem::take(&mut mesh.lines);
    for line in lines.values_mut() {
        // A point keeps all nodes there, both of a double one.
        if !line.edges.is_empty() {
            let nodes = line.edges.iter().flat_map(|&edge| mesh.edge(edge));
            line.nodes = nodes.collect();
        }
        line.nodes.sort_unstable_by(|&a, &b| {
            let (pa, pb) = (mesh.nodes[a], mesh.nodes[b]);
            pa[0]
                .total_cmp(&pb[0])
                .then(pa[1].total_cmp(&pb[1]))
                .then(a.cmp(&b))
        });
        line.nodes.dedup();
    }
    mesh.lines = lines;
}
