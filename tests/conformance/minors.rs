//! Libraries and hosts of one major version work together, whatever their minors. Version 1.1 is made
//! up here: the header of today with a field more at the end of every struct that may grow. A library of that
//! version gives today's host the same bits as one of today, and a host of that version gets the same
//! bits from the libraries of today.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{check, compiled_from, folder, library_of};
use abi::Hypothesis;
use law::{Moment, Operator, SearchPath, Start, Strided};
use std::fs;
use std::path::{Path, PathBuf};
use tests::or_skip;
use tests::words::words;

/// A host of version 1.1 calls the library.
const LATER_HOST: &str = "longer-structs-are-accepted";

fn include() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../abi/include")
}

/// Headers of version 1.1: every struct with a size has one field more, and the layout another hash.
fn later_headers(folder: &Path) -> PathBuf {
    let headers = folder.join("later");
    fs::create_dir(&headers).unwrap();
    for entry in fs::read_dir(include()).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), headers.join(entry.file_name())).unwrap();
    }
    let mut header = fs::read_to_string(include().join("pilum_law.h")).unwrap();
    let mut replace = |old: &str, new: &str| {
        assert_eq!(header.matches(old).count(), 1, "{old}");
        header = header.replacen(old, new, 1);
    };
    for grown in words("parameter variable formulation rates batch host law plugin") {
        let end = format!("}} pilum_{grown};");
        replace(&end, &format!("    uint64_t made_up[3];\n{end}"));
    }
    for condition in ["static_assert", "_Static_assert"] {
        let size = format!(" {condition}(sizeof(type) == (bytes)");
        replace(&size, &format!(" {condition}(sizeof(type) >= (bytes)"));
    }
    replace("#define PILUM_ABI_MINOR 0", "#define PILUM_ABI_MINOR 1");
    replace(
        "#define PILUM_LAYOUT_HASH UINT64_C(0x",
        "#define PILUM_LAYOUT_HASH 1 ^ UINT64_C(0x",
    );
    fs::write(headers.join("pilum_law.h"), header).unwrap();
    headers
}

/// The Coulomb joint in C, compiled with these headers.
fn joint(headers: &Path, folder: &Path) -> Option<PathBuf> {
    let source = include().join("../../models/foreign/coulomb_joint.c");
    let library = compiled_from(&source, headers, folder)?;
    let named = folder.join("libcoulomb_joint_c.so");
    fs::rename(library, &named).unwrap();
    Some(named)
}

/// The minor version that a library was built against, read from its file.
fn minor(library: &Path) -> u16 {
    let inspected = law::inspect::inspect(library).unwrap();
    inspected.handshake.unwrap().abi[1]
}

/// Tractions, internal variables and tangents along a path of jumps that slides, unloads and
/// reverses, as bits.
fn bits(library: &Path) -> Vec<u64> {
    let search = SearchPath::new(&[library.parent().unwrap().to_owned()]);
    let law = search.law("coulomb_joint_c").unwrap();
    let parameters = [1e6, 4e5, 5.0, 30.0, 10.0, 2.0];
    let law = law.build(Hypothesis::Interface2d, &parameters).unwrap();
    let rows = Strided::rows(2);
    let (mut jump, mut traction) = ([0.0; 2], [-20.0, 0.0]);
    let mut state = law.initial_state(1, (&traction, rows)).unwrap();
    let mut bits = Vec::new();
    for step in 1..=60 {
        let t = f64::from(step) / 6.0;
        let to = [
            -1e-5 * t * (1.0 - 0.3 * (1.3 * t).cos()),
            1e-4 * t * (0.7 * t).sin(),
        ];
        let start = Start {
            n_points: 1,
            gradient: (&jump, rows),
            gradient_end: (&to, rows),
            flux: (&traction, rows),
            state: &state,
            time: 0.0,
            time_increment: 1.0,
            moment: Moment::default(),
            sites: &[],
        };
        let (mut traction1, mut state1, mut tangent) = ([0.0; 2], state.clone(), [0.0; 4]);
        let end = law::End {
            flux: (&mut traction1, rows),
            state: &mut state1,
            operator: &mut tangent,
        };
        law.integrate(&start, Operator::Consistent, end).unwrap();
        (jump, traction, state) = (to, traction1, state1);
        let values = traction.iter().chain(&state).chain(&tangent);
        bits.extend(values.map(|value| value.to_bits()));
    }
    bits
}

#[test]
fn a_library_of_a_later_minor_version_gives_the_same_bits() {
    let folders = [folder(), folder()];
    let today = or_skip!(joint(&include(), folders[0].path()));
    let headers = later_headers(folders[1].path());
    let later = or_skip!(joint(&headers, folders[1].path()));
    assert_eq!((minor(&today), minor(&later)), (0, 1));
    let expected = bits(&today);
    assert_eq!(bits(&later), expected);
    // The tangent, in the last four of each point, changes: the path is more than elastic.
    let n = expected.len() / 60;
    let mut points = expected.chunks(n);
    assert!(points.any(|point| point[n - 4..] != expected[n - 4..n]));
    let report = check(&later, &[]);
    assert_eq!(
        report.with(&["failed", "crashed"]),
        [""; 0],
        "{}",
        report.stdout
    );
}

#[test]
fn a_host_of_a_later_minor_version_gets_the_same_bits() {
    let folder = folder();
    let in_c = joint(&include(), folder.path());
    let libraries = ["mepi", "mohr_coulomb"].map(library_of);
    for library in libraries.iter().chain(&in_c) {
        let report = check(library, &["--only", LATER_HOST]);
        assert_eq!(report.check(LATER_HOST)["outcome"], "passed", "{library:?}");
    }
}
