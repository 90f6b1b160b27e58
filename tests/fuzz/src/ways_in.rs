//! What reads files and libraries of others, by their contents: the ways in of `tests/fuzz`.

use input::case::PartInput;
use input::{Case, Driver, Error};
use law::capsule::{Capsule, LibraryCapsule};
use law::inspect::{Inspection, inspect_bytes};
use law::{LawDescription, Opener, Pins, SearchPath, foreign};
use mechanics::Mesh;
use std::path::Path;
use text::Source;
use workshop::replay::repeat;

pub(crate) use law::describe_memory;

/// A case file with all its variants.
///
/// # Errors
/// Those of [`Case::load`].
pub(crate) fn case(source: Source) -> Result<Vec<Case>, Error> {
    Case::of(source)
}

/// Number of elements that a case asks for; of a mesh that is a file, which a text cannot be trusted to
/// name, more than any.
pub(crate) fn elements(case: &Case) -> usize {
    let of = |parts: &Option<text::Spanned<Vec<text::Spanned<PartInput>>>>| {
        let parts = parts.iter().flat_map(text::Spanned::get_ref);
        parts.fold(0, |sum: usize, part| sum.saturating_add(part.get_ref().n))
    };
    let mesh = &case.file.mesh;
    if mesh.file.is_some() {
        return usize::MAX;
    }
    of(&mesh.columns).saturating_mul(of(&mesh.rows))
}

/// The mesh of a case.
///
/// # Errors
/// Those of [`input::mesh::build`].
pub(crate) fn mesh(case: &Case) -> Result<Mesh, Error> {
    Ok(input::mesh::build(&case.source, &case.file)?.mesh)
}

/// A mesh file of Gmsh.
///
/// # Errors
/// The defect.
pub(crate) fn mesh_file(bytes: &[u8]) -> Result<Mesh, String> {
    input::gmsh::whole(bytes)
}

/// A driver file with all its variants.
///
/// # Errors
/// Those of [`Driver::read`].
pub(crate) fn drivers(source: Source) -> Result<Vec<Driver>, Error> {
    Driver::variants(&Opener::default(), source, false)
}

/// Input of the IncrementalDriver: number of increments of its test; material and initial state
/// of as many parameters and variables.
///
/// # Errors
/// Those of [`Driver::read_incremental`].
pub(crate) fn incremental(files: [&Source; 3], n: usize) -> Result<usize, Error> {
    Driver::parse_incremental(files, n)
}

/// A lock file: the number of laws in it.
///
/// # Errors
/// As when the case next to it is read.
pub(crate) fn lock(source: &Source) -> Result<usize, Error> {
    Ok(Pins::of_lock(source)?)
}

/// A capsule.
///
/// # Errors
/// Those of [`Capsule::read`].
pub(crate) fn capsule(source: Source) -> Result<Capsule, Error> {
    Ok(Capsule::of_source(source)?)
}

/// A capsule of what a library does where no law is called, if it is one.
///
/// # Errors
/// Those of [`LibraryCapsule::of_source`].
pub(crate) fn library_capsule(source: &Source) -> Result<Option<LibraryCapsule>, Error> {
    Ok(LibraryCapsule::of_source(source)?)
}

/// Repeats the call of a capsule with the law of this name, wherever the capsule's library is.
/// Returns what is reported.
///
/// # Errors
/// As when a capsule is replayed.
pub(crate) fn replay(capsule: &Capsule, search: &SearchPath) -> Result<String, Error> {
    let law = search.law(capsule.law_id())?;
    let mut said = String::new();
    repeat(capsule, &law, &mut |line| said.push_str(line)).map(|()| said)
}

/// The sidecar of a UMAT.
///
/// # Errors
/// At the place that does not fit.
pub(crate) fn sidecar(source: &Source) -> Result<LawDescription, Error> {
    Ok(foreign::sidecar(source)?)
}

/// What `pilum inspect` says of a library with these bytes.
///
/// # Errors
/// It is no library.
pub(crate) fn inspection(bytes: &[u8]) -> Result<Inspection, Error> {
    Ok(inspect_bytes(Path::new("library"), bytes)?)
}

/// Laws in the manifest of a library, where the search path looks for them.
pub(crate) fn manifest(bytes: &[u8]) -> Option<usize> {
    let cache = object::ReadCache::new(std::io::Cursor::new(bytes));
    let file = object::File::parse(&cache).ok()?;
    law::inspect::manifest(&file).map(|laws| laws.len())
}

/// The behaviours of a library with MFront's generic interface.
///
/// # Errors
/// It is missing.
pub(crate) fn behaviours(bytes: &[u8]) -> Result<Vec<LawDescription>, String> {
    foreign::behaviours(bytes)
}
