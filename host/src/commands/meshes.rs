//! `pilum mesh`: what a mesh has, before or without a run.

use crate::arguments::Mesh;
use crate::output::printing;
use input::{Case, Error, gmsh, mesh};
use mechanics::problem::Analysis;
use results::MeshTable;
use runs::variants;
use std::io;
use std::path::Path;
use text::write::refuse_other;

/// Prints every mesh; one that no case could compute is an error in the end.
pub(super) fn show(asked: &Mesh) -> Result<(), Error> {
    let tables = tables(asked)?;
    if let Some(path) = &asked.draw {
        if tables.len() > 1 {
            let message = "--draw is for one mesh: name one with --variant";
            return Err(Error::usage(message));
        }
        refuse_other(path)?;
    }
    printing(|out| {
        for (number, table) in tables.iter().enumerate() {
            let gap = if number == 0 { "" } else { "\n" };
            out.text(&format!("{gap}{table}"));
            let drawn = asked
                .draw
                .as_ref()
                .filter(|_| !table.mesh.solids.is_empty());
            if let Some(path) = drawn {
                table.draw(path)?;
                out.line(&format!("drawing in {}", path.display()));
            }
        }
        tables
            .iter()
            .try_for_each(|table| refuse(table, &asked.file))
    })
}

fn refuse(table: &MeshTable, path: &Path) -> Result<(), Error> {
    let Some(why) = table.refusal() else {
        return Ok(());
    };
    let source = io::Error::new(io::ErrorKind::InvalidData, why);
    Err(text::Error::unreadable(path, source).into())
}

fn tables(asked: &Mesh) -> Result<Vec<MeshTable>, Error> {
    let path = &asked.file;
    let is_case = path.is_dir() || path.extension().is_some_and(|ending| ending == "toml");
    if is_case {
        let mut cases = Case::load(path)?;
        let variant = asked.variant.as_deref();
        variants::keep(&mut cases, variant, |case| case.variant.clone())?;
        return cases.iter().map(of_case).collect();
    }
    if asked.variant.is_some() {
        let message = format!("--variant is for a case, and {} is none", path.display());
        return Err(Error::usage(message));
    }
    let read = gmsh::overview(path)?;
    Ok(vec![MeshTable {
        title: path.display().to_string(),
        mesh: read.mesh,
        groups: read.groups,
        numbers: read.numbers,
        analysis: Analysis::PlaneStrain,
        notes: read.notes,
    }])
}

fn of_case(case: &Case) -> Result<MeshTable, Error> {
    let variant = case.variant.as_deref();
    let built = mesh::build(&case.source, &case.file);
    let built = built.map_err(|error| variants::of_variant(error, variant))?;
    let of_variant = variant.map_or_else(String::new, |name| format!(", variant `{name}`"));
    let groups = case.file.groups.keys();
    Ok(MeshTable {
        title: format!("{}{of_variant}", case.source.path().display()),
        mesh: built.mesh,
        groups: groups.map(|name| name.get_ref().clone()).collect(),
        numbers: Vec::new(),
        analysis: case.file.analysis,
        notes: built.file.map_or_else(Vec::new, |file| file.notes),
    })
}
