//! A mesh file before a case exists: its mesh with all names, and what a case should know.

use super::assemble::{Assembled, assemble};
use super::contents::Contents;
use super::words::{counted, of_two_kinds};
use super::{Counts, Wanted, counts};
use crate::Error;
use mechanics::mesh::Mesh;
use mechanics::problem::Analysis;
use std::collections::HashSet;
use std::io;
use std::path::Path;
use text::file;

/// The least radius in axisymmetry is 0 within this part of the mesh's size.
const NOTHING: f64 = 1e-9;

/// Contents of a mesh file.
#[derive(Clone, Debug, PartialEq)]
pub struct Overview {
    /// The mesh as a case in plane strain would take it: coordinates in units of the file, a group for each physical
    /// surface, a line for each physical curve and point.
    pub mesh: Mesh,
    /// Names of the groups.
    pub groups: Vec<String>,
    /// For each solid element the number in the file.
    pub numbers: Vec<u64>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// Reads a mesh file of which no case says what it needs.
///
/// # Errors
/// [`text::Error::Unreadable`], with the place in the file.
pub fn overview(path: &Path) -> Result<Overview, Error> {
    let bytes = file::read_mesh(path).map_err(|why| text::Error::unreadable(path, why))?;
    of_bytes(&bytes).map_err(|fault| {
        let why = io::Error::new(io::ErrorKind::InvalidData, fault);
        text::Error::unreadable(path, why).into()
    })
}

fn of_bytes(bytes: &[u8]) -> Result<Overview, String> {
    let contents = Contents::read(bytes, false)?;
    let [points, curves, surfaces] = counts(&contents);
    // An element of several surfaces counts for the smallest one.
    let mut by_size: Vec<usize> = (0..surfaces.len()).collect();
    by_size.sort_by_key(|&group| surfaces[group]);
    let names = by_size
        .iter()
        .filter_map(|&group| surfaces.get_index(group));
    let wanted = Wanted {
        groups: names.map(|(name, _)| name.as_str()).zip(0..).collect(),
        lines: HashSet::new(),
        analysis: Analysis::PlaneStrain,
        scale: 1.0,
        is_case: false,
    };
    let Assembled {
        mut mesh,
        kept,
        numbers,
        mut notes,
    } = assemble(&contents, &wanted)?;
    for solid in &mut mesh.solids {
        solid.group = by_size[solid.group];
    }
    notes.extend(off_the_sides(&mesh, &curves));
    notes.extend(two_kinds(&curves, &points));
    notes.extend(across_the_axis(&mesh, kept.len()));
    Ok(Overview {
        mesh,
        groups: surfaces.into_keys().collect(),
        numbers,
        notes,
    })
}

/// Curves of which some edges are no sides of elements.
fn off_the_sides(mesh: &Mesh, curves: &Counts) -> Vec<String> {
    let mut notes = Vec::new();
    for (name, n) in curves {
        let edges = mesh.lines.get(name).map_or(&[][..], |line| &line.edges);
        let middles: HashSet<usize> = edges.iter().map(|&edge| mesh.edge(edge)[2]).collect();
        let missing = n.saturating_sub(middles.len());
        if missing > 0 {
            notes.push(format!(
                "physical curve `{name}` has {missing} of {n} edges that are no sides of elements in a physical \
                 surface: a case with this line is refused, unless they are sides of elements that it leaves out"
            ));
        }
    }
    notes
}

/// Names of both curves and points.
fn two_kinds(curves: &Counts, points: &Counts) -> Option<String> {
    let both = curves.keys().filter(|name| points.contains_key(*name));
    of_two_kinds(both)
}

/// Nodes of the file, the first ones of the mesh, that have no place in an axisymmetric case.
fn across_the_axis(mesh: &Mesh, of_file: usize) -> Option<String> {
    let least = -NOTHING * mesh.longer_side();
    let beyond = || mesh.nodes[..of_file].iter().filter(|node| node[0] < least);
    let [x, y] = *beyond().next()?;
    let nodes = counted(beyond().count(), "node", " has", "s have");
    Some(format!(
        "{nodes} x < 0, the first at ({x}, {y}): a case with axisymmetry is refused, in which x is the radius"
    ))
}
