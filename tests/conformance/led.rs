//! Laws made for other programs, led by the author's own driver.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{Report, check, compiled_from, folder, library_of, refused};
use std::path::{Path, PathBuf};
use tests::or_skip;
use tests::words::has;

/// A routine in C, compiled in this folder. `None`, with a remark, where there is no compiler.
fn routine(kind: &str, name: &str, folder: &Path) -> Option<PathBuf> {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures")
        .join(kind);
    let source = folder.join(format!("{name}.c"));
    let text = std::fs::read_to_string(fixtures.join(format!("{name}.c"))).unwrap();
    // Those of the contract are compiled with hidden symbols.
    std::fs::write(
        &source,
        format!("#pragma GCC visibility push(default)\n{text}"),
    )
    .unwrap();
    compiled_from(&source, &fixtures, folder)
}

/// A driver in this folder, of the library next to it.
fn driver(folder: &Path, head: &str, rest: &str) -> String {
    let file = folder.join("driver.toml");
    let text = format!("{head}hypothesis = \"plane_strain\"\n{rest}");
    std::fs::write(&file, text).unwrap();
    file.to_str().unwrap().to_owned()
}

const PATH: &str =
    "[[segment]]\nincrements = 6\ncontrol = { 11 = { strain = 1e-3 }, 22 = { strain = -2e-3 } }\n";

fn details(report: &Report, id: &str) -> (String, String) {
    let finding = report.check(id);
    let text = |key: &str| finding[key].as_str().unwrap().to_owned();
    (text("outcome"), text("details"))
}

/// A UMAT, with what the driver says of it: parameters, the sidecar elsewhere.
#[test]
fn a_umat_is_led_by_a_driver() {
    let folder = folder();
    let library = or_skip!(routine("umat", "rows", folder.path()));
    let sidecar = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/umat/rows.law.toml");
    let text = std::fs::read_to_string(sidecar).unwrap();
    let head = "law = \"umat_rows\"\nadapter = \"umat\"\nlibrary = \"librows.so\"\nsidecar = \"mine.law.toml\"\n";
    let numbers = "parameters = { stiffness = 1234.0, coupling = 321.0 }\n";
    let driver = driver(folder.path(), head, &format!("{numbers}{PATH}"));
    let mine = folder.path().join("mine.law.toml");
    std::fs::write(&mine, &text).unwrap();
    let right = check(&library, &["--driver", &driver]);
    assert!(
        right.with(&["failed", "crashed"]).is_empty(),
        "{:#}",
        right.json
    );
    let (_, said) = details(&right, "routine-answers");
    assert!(said.contains("plane_strain 1.234e3"), "{said}");
    let (outcome, said) = details(&right, "routine-agrees-in-the-plane");
    assert_eq!(
        (outcome.as_str(), said.as_str()),
        ("passed", "6 increments")
    );
    // The sidecar of the driver is what counts, not one beside the library.
    std::fs::write(&mine, text.replace("tangent_order = \"rows\"", "")).unwrap();
    let wrong = check(&library, &["--driver", &driver]);
    assert_eq!(
        wrong.with(&["failed", "crashed"]),
        ["ddsdde-matches-differences"]
    );
    let (_, said) = details(&wrong, "ddsdde-matches-differences");
    for part in [
        "stiffness = 1234, coupling = 321",
        "`tangent_order` in the sidecar",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    assert_eq!(wrong.code, Some(3));
}

/// A UDSM says nothing of the ranges of its parameters, so a driver has to.
#[test]
fn a_udsm_is_led_by_a_driver_alone() {
    let folder = folder();
    let library = or_skip!(routine("udsm", "skew", folder.path()));
    let words = refused(&["check", library.to_str().unwrap()], 1);
    has(&words, "is a UDSM of PLAXIS");
    has(&words, "`--driver FILE`");
    let led = |order: &str, wrong: &str| {
        let head =
            format!("law = \"model_1\"\nadapter = \"udsm\"\nlibrary = \"libskew.so\"\n{order}");
        let numbers = format!(
            "parameters = {{ young_modulus = 1e4, poisson_ratio = 0.3, skew = 2e3, wrong = {wrong} }}\n"
        );
        let driver = driver(folder.path(), &head, &format!("{numbers}{PATH}"));
        check(&library, &["--driver", &driver])
    };
    let right = led("tangent_order = \"rows\"\n", "0.0");
    assert!(
        right.with(&["failed", "crashed"]).is_empty(),
        "{:#}",
        right.json
    );
    // It keeps the number of the element.
    let (outcome, said) = details(&right, "routine-is-repeatable");
    assert!(
        outcome == "warning" && said.contains("with another iEl: StVar"),
        "{said}"
    );
    let columns = led("", "0.0");
    assert_eq!(
        columns.with(&["failed", "crashed"]),
        ["ddsdde-matches-differences"]
    );
    let (_, said) = details(&columns, "ddsdde-matches-differences");
    let says = "the transpose of D is the derivative of Sig, D is not: its transpose fits: `tangent_order` in the driver";
    assert!(said.contains(says), "{said}");
    // What fails in the first increment leaves nothing to check, which is a failure.
    for (wrong, says) in [
        ("2.0", "leaves Sig with values that are not finite"),
        ("3.0", "writes beyond the end of Sig"),
        ("5.0", "ended its process: exit code 3"),
    ] {
        let report = led("", wrong);
        assert_eq!(
            report.with(&["failed", "crashed"]),
            ["routine-answers"],
            "{wrong}"
        );
        let (_, said) = details(&report, "routine-answers");
        has(&said, "no increment was done");
        has(&said, says);
    }
}

/// A library of the contract that has the symbols of MFront too is checked as what it is.
#[test]
fn a_library_of_the_contract_is_not_led_by_an_adapter() {
    let folder = folder();
    let library = library_of("mohr_coulomb");
    let head = format!("law = \"MohrCoulomb\"\nadapter = \"mfront\"\nlibrary = {library:?}\n");
    let numbers = "parameters = { YoungModulus = 2e4, PoissonRatio = 0.3, Cohesion = 5.0, FrictionAngle = 35.0, \
                   DilatancyAngle = 10.0 }\n";
    let driver = driver(folder.path(), &head, &format!("{numbers}{PATH}"));
    let words = refused(
        &["check", library.to_str().unwrap(), "--driver", &driver],
        1,
    );
    has(&words, "the library keeps the contract too");
    // Without its handshake it is a library of MFront's behaviours.
    let theirs = folder.path().join("libtheirs.so");
    let mut bytes = std::fs::read(&library).unwrap();
    let name = b"pilum_magic";
    let places: Vec<usize> = (0..bytes.len() - name.len())
        .filter(|&at| bytes[at..].starts_with(name))
        .collect();
    for at in places {
        bytes[at] = b'q';
    }
    std::fs::write(&theirs, bytes).unwrap();
    let text = std::fs::read_to_string(&driver).unwrap();
    let text = text.replace(&format!("{library:?}"), &format!("{theirs:?}"));
    std::fs::write(&driver, text).unwrap();
    let report = check(&theirs, &["--driver", &driver]);
    assert!(
        report.with(&["failed", "crashed", "warning"]).is_empty(),
        "{:#}",
        report.json
    );
    let passed = report.with(&["passed"]);
    for id in [
        "ddsdde-matches-differences",
        "response-is-isotropic",
        "routine-is-repeatable",
    ] {
        assert!(
            passed.iter().any(|other| other == id),
            "{id}: {:#}",
            report.json
        );
    }
}
