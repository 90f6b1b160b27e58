//! Meshes from files of Gmsh: formats 4.0, 4.1 and 2.0 to 2.2, as text or bytes. Physical surfaces are groups,
//! physical curves lines, physical points points.

mod assemble;
mod contents;
mod cursor;
mod format;
mod kind;
mod overview;
mod twins;
mod words;

pub use overview::{Overview, overview};

use crate::Error;
use crate::case::{CaseFile, MeshInput};
use crate::mesh::MeshFile;
use contents::Contents;
use indexmap::IndexMap;
use law::hexadecimal_sha256;
use mechanics::mesh::Mesh;
use mechanics::problem::{Analysis, Formulation};
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::io;
use std::path::{Path, PathBuf};
use text::{Source, Spanned, file};

/// Names that the case takes from the file.
struct Wanted<'c> {
    /// Numbers of groups, by the names of their surfaces.
    groups: HashMap<&'c str, usize>,
    /// Names of lines and points.
    lines: HashSet<&'c str>,
    analysis: Analysis,
    /// Metres in a unit of the file.
    scale: f64,
    /// Whether a case asks; else elements in several groups are in the first of them.
    is_case: bool,
}

impl Wanted<'_> {
    fn name(&self, group: usize) -> &str {
        let mut all = self.groups.iter();
        let found = all.find(|(_, number)| **number == group);
        found.map_or("", |(name, _)| *name)
    }
}

/// Meaning of the names of one kind in a file.
type Counts = IndexMap<String, usize>;

fn refuse_divided_layers(source: &Source, file: &CaseFile) -> Result<(), Error> {
    let mut groups = file.groups.iter();
    let layer = groups.find(|(_, group)| group.get_ref().formulation == Formulation::ThinLayer);
    let Some((name, _)) = layer else {
        return Ok(());
    };
    let message = format!(
        "group `{}` is a thin layer, whose thickness is that of its elements: a mesh from a file is \
         not divided across it",
        name.get_ref()
    );
    Err(source.error(name.span(), message).into())
}

/// Metres in a unit of the file.
fn scale(source: &Source, input: &MeshInput) -> Result<f64, Error> {
    let Some(key) = &input.scale else {
        return Ok(1.0);
    };
    let scale = *key.get_ref();
    if scale > 0.0 && scale.is_finite() {
        return Ok(scale);
    }
    let message = format!("`scale` is {scale}, expected a positive number");
    Err(source.error(key.span(), message).into())
}

/// The mesh of a case that names a file, divided as often as the case says, with notes for the user.
///
/// # Errors
/// [`text::Error::Unreadable`] with the place in the mesh file; [`text::Error::Input`] where the case
/// does not fit it.
pub(crate) fn mesh(
    source: &Source,
    file: &CaseFile,
    written: &Spanned<PathBuf>,
) -> Result<(Mesh, MeshFile), Error> {
    let input = &file.mesh;
    if input.divisions > 0 {
        refuse_divided_layers(source, file)?;
    }
    let scale = scale(source, input)?;
    let folder = source.path_at(&written.span()).parent();
    let path = folder.unwrap_or(Path::new(".")).join(written.get_ref());
    let bytes = match &input.content {
        Some(content) => Cow::Borrowed(&content[..]),
        None => Cow::Owned(file::read_mesh(&path).map_err(|why| {
            let message = format!("cannot read {}: {why}", path.display());
            Error::from(source.error(written.span(), message))
        })?),
    };
    let is_of_arrays = input.content.is_some();
    let wrong = |fault: String| {
        if is_of_arrays {
            return Error::usage(format!("the mesh: {fault}"));
        }
        let why = io::Error::new(io::ErrorKind::InvalidData, fault);
        text::Error::unreadable(&path, why).into()
    };
    let contents = Contents::read(&bytes, is_of_arrays).map_err(wrong)?;
    let wanted = wanted(source, file, scale, &contents, &path)?;
    let assembled = assemble::assemble(&contents, &wanted).map_err(wrong)?;
    let mut mesh = assembled.mesh;
    for _ in 0..input.divisions {
        mesh = mesh.refined();
    }
    let name = path.display().to_string();
    let notes = assembled.notes.into_iter();
    let notes = notes.map(|note| format!("{name}: {note}"));
    let file = MeshFile {
        notes: notes.collect(),
        kept: assembled.kept,
        sha256: hexadecimal_sha256(&bytes),
        path: name,
    };
    Ok((mesh, file))
}

/// The whole mesh of a file in plane strain: every physical surface is a group, in their order.
///
/// # Errors
/// The defect of the file, and its place.
pub fn whole(bytes: &[u8]) -> Result<Mesh, String> {
    let contents = Contents::read(bytes, false)?;
    let [points, curves, surfaces] = counts(&contents);
    let names = |counts: &'_ Counts| counts.keys().cloned().collect::<Vec<_>>();
    let (surfaces, lines) = (names(&surfaces), [names(&curves), names(&points)].concat());
    let wanted = Wanted {
        groups: surfaces.iter().map(String::as_str).zip(0..).collect(),
        lines: lines.iter().map(String::as_str).collect(),
        analysis: Analysis::PlaneStrain,
        scale: 1.0,
        is_case: true,
    };
    assemble::assemble(&contents, &wanted).map(|assembled| assembled.mesh)
}

/// Names that the case takes from the file; they must exist.
fn wanted<'c>(
    source: &Source,
    file: &'c CaseFile,
    scale: f64,
    contents: &Contents<'_>,
    path: &Path,
) -> Result<Wanted<'c>, Error> {
    let [points, curves, surfaces] = counts(contents);
    let mut wanted = Wanted {
        groups: HashMap::new(),
        lines: HashSet::new(),
        analysis: file.analysis,
        scale,
        is_case: true,
    };
    for (number, (name, group)) in file.groups.iter().enumerate() {
        if group.get_ref().formulation == Formulation::ZeroThickness {
            continue;
        }
        let missing = match surfaces.get(name.get_ref()) {
            None => {
                let hint = known(name.get_ref(), &[(&surfaces, "element", "elements")]);
                Some(("physical surface", hint))
            }
            Some(0) if !contents.cursor.is_of_arrays => {
                let hint = "in format 2.2 `Mesh.SaveAll = 1` writes elements without their groups: \
                            take format 4.1, or `Mesh.SaveAll = 0`";
                Some(("element in the physical surface", hint.to_owned()))
            }
            Some(_) => None,
        };
        if let Some((what, hint)) = missing {
            let message = format!("{} has no {what} `{}`", path.display(), name.get_ref());
            return Err(source.error(name.span(), message).hint(hint).into());
        }
        wanted.groups.insert(name.get_ref(), number);
    }
    for name in file.line_names() {
        let is_curve = curves.contains_key(name.get_ref());
        let is_point = points.contains_key(name.get_ref());
        if !is_curve && !is_point {
            let message = format!("there is no line `{}`", name.get_ref());
            let kinds = [(&curves, "edge", "edges"), (&points, "point", "points")];
            let hint = known(name.get_ref(), &kinds);
            return Err(source.error(name.span(), message).hint(hint).into());
        }
        wanted.lines.insert(name.get_ref());
    }
    Ok(wanted)
}

/// Elements of the physical points, curves and surfaces, by name.
fn counts(contents: &Contents<'_>) -> [Counts; 3] {
    let mut counts = <[Counts; 3]>::default();
    for (dimension, name) in &contents.named {
        if let Some(counts) = counts.get_mut(usize::from(*dimension)) {
            counts.entry(name.clone()).or_default();
        }
    }
    // Elements of one set first: names are looked up once for each.
    let mut sets: IndexMap<(u8, usize), (&contents::Element, usize)> = IndexMap::new();
    for element in &contents.elements {
        let entry = sets.entry(Contents::set_of(element));
        entry.or_insert((element, 0)).1 += 1;
    }
    for ((dimension, _), (element, n)) in sets {
        for name in contents.groups_of(element) {
            if let Some(counts) = counts.get_mut(usize::from(dimension)) {
                *counts.entry(name).or_default() += n;
            }
        }
    }
    counts
}

/// `did you mean …?` and all names with their numbers of elements.
fn known(name: &str, kinds: &[(&Counts, &str, &str)]) -> String {
    let names = kinds.iter().flat_map(|(counts, ..)| counts.keys());
    let names: Vec<&str> = names.map(String::as_str).collect();
    let listed = kinds.iter().flat_map(|(counts, one, many)| {
        counts.iter().map(move |(name, n)| {
            let what = if *n == 1 { one } else { many };
            format!("{name} ({n} {what})")
        })
    });
    let listed: Vec<String> = listed.collect();
    if listed.is_empty() {
        return "the file has none; in Gmsh, `Physical Surface(\"name\") = {1};` names the surface \
                1, and so for curves and points"
            .to_owned();
    }
    let list = listed.join(", ");
    match text::nearest(name, names) {
        Some(near) => format!("did you mean `{near}`? There is: {list}"),
        None => format!("there is: {list}"),
    }
}

#[cfg(test)]
#[path = "gmsh/tests.rs"]
mod tests;
