//! Libraries and hosts of one major version work together, whatever their minors. A library of
//! version 1.0 in today's host, and today's libraries in a host of version 1.0, give the same bits
//! as with equal versions, and keep the contract. Version 1.0 is in `fixtures/contract_1_0`.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{check, compiled_from, folder, library_of};
use abi::Hypothesis;
use host_1_0::{End, LawOf1};
use law::{Moment, Operator, SearchPath, Start, Strided};
use std::path::{Path, PathBuf};

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/contract_1_0")
}

/// The joint in C against the headers of a version.
fn joint_in_c(source: &Path, headers: &Path, folder: &Path) -> Option<PathBuf> {
    let library = compiled_from(source, headers, folder)?;
    let named = folder.join("libcoulomb_joint_c.so");
    std::fs::rename(library, &named).unwrap();
    Some(named)
}

/// The minor version that a library was built against, read from its file.
fn minor(library: &Path) -> u16 {
    law::inspect::inspect(library)
        .unwrap()
        .handshake
        .unwrap()
        .abi[1]
}

/// A path of jumps or strains: loading, unloading, reversal; sizes grow.
fn path(n: usize, size: f64) -> Vec<Vec<f64>> {
    (1..=60)
        .map(|k| {
            let t = f64::from(k) / 6.0;
            let shear = size * t * (0.7 * t).sin();
            let across = -0.1 * size * t * (1.0 - 0.3 * (1.3 * t).cos());
            let mut gradient = vec![0.0; n];
            gradient[0] = across;
            gradient[n - 1] = shear;
            gradient
        })
        .collect()
}

/// The same path in today's host.
fn today(law: &LawOf1<'_>, path: &[Vec<f64>]) -> Vec<End> {
    let hypothesis = Hypothesis::from_code(law.hypothesis).unwrap();
    let n = law.n_components;
    let search = SearchPath::new(&[law.library.parent().unwrap().to_owned()]);
    let built = search.law(law.id).unwrap();
    let built = built.build(hypothesis, law.parameters).unwrap();
    let (mut gradient, mut flux) = (vec![0.0; n], law.flux.to_vec());
    let n_states = built.n_states();
    let mut state = built.initial_state(1, (&flux, Strided::rows(n))).unwrap();
    let mut ends = Vec::new();
    for to in path {
        let mut end = [vec![0.0; n], vec![0.0; n_states], vec![0.0; n * n]];
        let start = Start {
            n_points: 1,
            gradient: (&gradient, Strided::rows(n)),
            gradient_end: (to, Strided::rows(n)),
            flux: (&flux, Strided::rows(n)),
            state: &state,
            time: 0.0,
            time_increment: 1.0,
            moment: Moment::default(),
            sites: &[],
        };
        let [flux1, state1, tangent] = &mut end;
        let into = law::End {
            flux: (flux1, Strided::rows(n)),
            state: state1,
            operator: tangent,
        };
        built.integrate(&start, Operator::Consistent, into).unwrap();
        gradient.clone_from(to);
        flux.clone_from(&end[0]);
        state.clone_from(&end[1]);
        ends.push(end);
    }
    ends
}

fn bits(ends: &[End]) -> Vec<u64> {
    ends.iter()
        .flatten()
        .flatten()
        .map(|x| x.to_bits())
        .collect()
}

/// Both hosts give the same bits along a path on which the law flows, and the library passes the
/// checks of today.
fn serves_both(law: &LawOf1<'_>, built_against: u16, size: f64) {
    assert_eq!(minor(law.library), built_against, "{}", law.id);
    let path = path(law.n_components, size);
    let then = host_1_0::lead(law, &path).unwrap();
    let now = today(law, &path);
    assert_eq!(bits(&then), bits(&now), "{}", law.id);
    // The tangent changes on the way: the path is more than elastic.
    assert!(then.iter().any(|end| end[2] != then[0][2]), "{}", law.id);
    let report = check(law.library, &[]);
    assert_eq!(
        report.with(&["failed", "crashed"]),
        [""; 0],
        "{}",
        report.stdout
    );
    assert_eq!(
        report.check("earlier-hosts-are-served")["outcome"],
        "passed"
    );
    assert_eq!(
        report.check("shorter-batch-is-refused")["outcome"],
        "passed"
    );
}

const JOINT: [f64; 6] = [1e6, 4e5, 5.0, 30.0, 10.0, 2.0];

#[test]
fn a_library_in_c_of_version_1_0_works() {
    let folder = folder();
    let source = fixtures().join("coulomb_joint.c");
    let Some(library) = joint_in_c(&source, &fixtures().join("include"), folder.path()) else {
        return;
    };
    let law = LawOf1 {
        library: &library,
        id: "coulomb_joint_c",
        hypothesis: 10,
        n_components: 2,
        parameters: &JOINT,
        flux: &[-20.0, 0.0],
    };
    serves_both(&law, 0, 1e-4);
}

#[test]
fn a_library_in_rust_of_version_1_0_works() {
    let law = LawOf1 {
        library: &library_of("slider_1_0"),
        id: "slider_1_0",
        hypothesis: 10,
        n_components: 2,
        parameters: &[1e6, 4e5, 20.0],
        flux: &[-20.0, 0.0],
    };
    serves_both(&law, 0, 1e-4);
}

#[test]
fn a_library_in_c_of_today_works_in_a_host_of_version_1_0() {
    let folder = folder();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let source = root.join("models/foreign/coulomb_joint.c");
    let Some(library) = joint_in_c(&source, &root.join("abi/include"), folder.path()) else {
        return;
    };
    let law = LawOf1 {
        library: &library,
        id: "coulomb_joint_c",
        hypothesis: 10,
        n_components: 2,
        parameters: &JOINT,
        flux: &[-20.0, 0.0],
    };
    serves_both(&law, 1, 1e-4);
}

/// All values of a law's parameters in declared order, defaults for what is not given.
fn values(id: &str, given: &[(&str, f64)]) -> Vec<f64> {
    let law = SearchPath::new(&[]).law(id).unwrap();
    let parameters = law.description().parameters.iter();
    let value = |p: &law::ParameterDescription| {
        let found = given.iter().find(|(name, _)| *name == p.id);
        found.map_or(p.default.unwrap_or(f64::NAN), |(_, value)| *value)
    };
    parameters.map(value).collect()
}

#[test]
fn libraries_in_rust_of_today_work_in_a_host_of_version_1_0() {
    let sand = [
        ("k_n", 0.86e5),
        ("k_t", 0.37e5),
        ("n", 0.55),
        ("mu_0", 0.0),
        ("mu_p", 0.78),
        ("mu_c0", 0.67),
        ("a", 0.00045),
        ("c_0", 0.05),
        ("t", 0.002),
    ];
    let soil = [
        ("young_modulus", 3e4),
        ("poisson_ratio", 0.3),
        ("cohesion", 5.0),
        ("friction_angle", 30.0),
        ("dilatancy_angle", 5.0),
    ];
    let mepi = LawOf1 {
        library: &library_of("mepi"),
        id: "mepi",
        hypothesis: 10,
        n_components: 2,
        parameters: &values("mepi", &sand),
        flux: &[-100.0, 0.0],
    };
    serves_both(&mepi, 1, 3e-4);
    let mohr_coulomb = LawOf1 {
        library: &library_of("mohr_coulomb"),
        id: "mohr_coulomb",
        hypothesis: 1,
        n_components: 4,
        parameters: &values("mohr_coulomb", &soil),
        flux: &[-50.0, -100.0, -50.0, 0.0],
    };
    serves_both(&mohr_coulomb, 1, 1e-3);
}

/// Under the name of version 1.0 a host of that time compares layouts, and takes grown structs for
/// others: the reason why today's libraries export theirs under another name.
#[test]
fn a_layout_under_the_name_of_version_1_0_would_be_refused() {
    assert!(host_1_0::refuses_layout(abi::layout::LAYOUT));
}
