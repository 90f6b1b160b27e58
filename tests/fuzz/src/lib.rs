//! Fuzz targets: everything that reads what others wrote. Each takes bytes and asserts that they
//! end in a result or in a message, never in a panic or an internal error; libFuzzer adds the limits
//! of time and memory (`run.sh`).
//!
//! The corpus of each target lies in `corpus/`; the test of this crate runs all of it.

mod case;
mod description;
mod driver;
mod incremental;
mod library;
mod ways_in;

use input::{Error, Kind};
use std::sync::OnceLock;
use text::Source;

/// Action of a target on its bytes.
type Target = fn(&[u8]);

/// All targets by name.
pub const TARGETS: [(&str, Target); 9] = [
    ("case", case::read),
    ("driver", driver::read),
    ("incremental", incremental::read),
    ("mesh", mesh),
    ("lock", lock),
    ("sidecar", sidecar),
    ("capsule", capsule),
    ("description", description::read),
    ("library", library::read),
];

/// Runs the target that the environment names in `PILUM_FUZZ`.
///
/// # Panics
/// There is no such target, or it found a fault.
#[expect(clippy::panic, reason = "a fuzzer looks for panics")]
pub fn run(data: &[u8]) {
    static TARGET: OnceLock<Target> = OnceLock::new();
    let target = TARGET.get_or_init(|| {
        let wanted = std::env::var("PILUM_FUZZ").unwrap_or_default();
        let target = TARGETS.iter().find(|(name, _)| *name == wanted);
        match target {
            Some((_, target)) => *target,
            None => panic!("there is no target `{wanted}`; PILUM_FUZZ names it"),
        }
    });
    target(data);
}

/// A text as a file next to those that it may be based on.
fn source(data: &[u8]) -> Option<Source> {
    let text = std::str::from_utf8(data).ok()?;
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/base/input.toml");
    Some(Source::new(path, text))
}

/// The outcome as users see it: an error must have a message that can be shown, and is theirs.
fn shown<T>(outcome: Result<T, Error>) -> Option<T> {
    match outcome {
        Ok(value) => Some(value),
        Err(error) => {
            assert!(error.kind() != Kind::Internal, "an internal error: {error}");
            assert!(!error.shown(true).is_empty(), "an error without a message");
            None
        }
    }
}

/// A mesh has nodes for its elements and elements for its lines, also when it is divided.
fn mesh(data: &[u8]) {
    let mesh = match ways_in::mesh_file(data) {
        Ok(mesh) => mesh,
        Err(message) => return assert!(!message.is_empty(), "an error without a message"),
    };
    for mesh in [mesh.refined(), mesh] {
        let n = mesh.nodes.len();
        let mut nodes = mesh.solids.iter().flat_map(mechanics::mesh::Solid::nodes);
        assert!(nodes.all(|&node| node < n), "an element without a node");
        for line in mesh.lines.values() {
            let sides = line.edges.iter().map(|&edge| mesh.edge(edge)[2]);
            let mut nodes = sides.chain(line.nodes.iter().copied());
            assert!(nodes.all(|node| node < n), "a line without a node");
        }
    }
}

fn lock(data: &[u8]) {
    if let Some(source) = source(data) {
        shown(ways_in::lock(&source));
    }
}

fn sidecar(data: &[u8]) {
    let law = source(data).and_then(|source| shown(ways_in::sidecar(&source)));
    for parameter in law.iter().flat_map(|law| &law.parameters) {
        let bounds = parameter.bounds;
        assert!(
            bounds.lower <= bounds.upper,
            "bounds out of order: {bounds}"
        );
    }
}

/// A capsule that can be read is written as it was read, and replayed without its library.
fn capsule(data: &[u8]) {
    let of_library = source(data).and_then(|source| shown(ways_in::library_capsule(&source)));
    if let Some(capsule) = of_library.flatten() {
        let text = capsule.to_string();
        let again = ways_in::library_capsule(&Source::new("again.toml", text.as_str()));
        let again = again.ok().flatten().map(|again| again.to_string());
        assert_eq!(again, Some(text), "is read back as another");
        return;
    }
    let Some(capsule) = source(data).and_then(|source| shown(ways_in::capsule(source))) else {
        return;
    };
    let text = capsule.to_string();
    let again = ways_in::capsule(Source::new("again.toml", text.as_str()));
    assert!(again.is_ok(), "cannot be read back: {text}");
    assert_eq!(
        again.map(|again| again.to_string()).ok(),
        Some(text),
        "is read back as another"
    );
    shown(ways_in::replay(&capsule, &law::SearchPath::new(&[])));
}

#[cfg(test)]
mod tests {
    use super::TARGETS;
    use std::path::Path;

    #[test]
    fn the_whole_corpus_is_read_or_refused() {
        let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
        for (name, target) in TARGETS {
            let entries = std::fs::read_dir(corpus.join(name)).unwrap();
            let mut n = 0;
            for entry in entries {
                let path = entry.unwrap().path();
                let data = std::fs::read(&path).unwrap();
                let outcome = std::panic::catch_unwind(|| target(&data));
                assert!(outcome.is_ok(), "target {name}, {}", path.display());
                n += 1;
            }
            assert!(n > 0, "target {name} has no corpus");
        }
    }
}
