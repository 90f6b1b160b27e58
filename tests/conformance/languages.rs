//! No false alarm on laws in other languages: those of `models/foreign`, and what `pilum new-law`
//! writes, on random paths and on the author's own. Projects in Rust are checked where their guide is
//! followed.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::good::passes;
use crate::program::{check, compiled_from, folder, pilum_in};
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};
use std::process::Command;
use tests::needs::{compiler, output};
use tests::words::words;

/// Builds a law of `models/foreign`. `None`, with a remark, where there is no compiler.
fn foreign(source: &str, folder: &Path) -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let include = root.join("abi/include");
    let (name, suffix) = source.split_once('.').unwrap();
    let (variable, default, options): (_, _, &[&str]) = match suffix {
        "c" => ("CC", "cc", &["-fvisibility=hidden"]),
        "cpp" => ("CXX", "c++", &["-std=c++17", "-fvisibility=hidden"]),
        _ => ("FC", "gfortran", &["-frecursive", "-J."]),
    };
    let library = folder.join(format!("{DLL_PREFIX}{name}_{suffix}{DLL_SUFFIX}"));
    let mut command = Command::new(compiler(variable, default)?);
    command
        .current_dir(folder)
        .args(["-O2", "-shared", "-fPIC"]);
    command.args(options).arg("-I").arg(&include);
    if suffix == "f90" {
        command.arg(include.join("pilum_law.f90"));
    }
    if suffix != "c" && cfg!(target_os = "linux") {
        let map = include.join("exports.map");
        command.arg(format!("-Wl,--version-script={}", map.display()));
    }
    command.arg(root.join("models/foreign").join(source));
    let built = output(command.arg("-lm").arg("-o").arg(&library))?;
    let said = String::from_utf8_lossy(&built.stderr);
    assert!(built.status.success(), "{source}: {said}");
    Some(library)
}

#[test]
fn laws_in_other_languages_pass() {
    for source in
        words("coulomb_joint.c coulomb_joint.cpp coulomb_joint.f90 cam_clay.cpp cam_clay.f90")
    {
        let folder = folder();
        if let Some(library) = foreign(source, folder.path()) {
            // A Fortran library has no manifest, which says nothing of the law.
            passes(&library);
        }
    }
}

/// Neither C nor C++ reserve `y0`, which libm has, too.
#[test]
fn a_law_calls_its_own_functions() {
    let folder = folder();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let law = std::fs::read_to_string(root.join("models/foreign/coulomb_joint.c")).unwrap();
    let own = "#pragma GCC visibility push(default)\ndouble y0(double stiffness);\n\
               double y0(double stiffness) { return stiffness; }\n#pragma GCC visibility pop\n";
    let calls = law.replace(".k_t = p[1]", ".k_t = y0(p[1])");
    assert_ne!(law, calls);
    let source = folder.path().join("own.c");
    std::fs::write(&source, format!("{own}{calls}")).unwrap();
    let include = root.join("abi/include");
    if let Some(library) = compiled_from(&source, &include, folder.path()) {
        let report = check(&library, &["--only", "units-belong-together"]);
        let finding = report.check("units-belong-together");
        assert_eq!(finding["outcome"], "passed", "{finding}");
    }
}

#[test]
fn new_laws_pass_along_their_own_paths_too() {
    for (language, variable, default) in [
        ("c", "CC", "cc"),
        ("cpp", "CXX", "c++"),
        ("fortran", "FC", "gfortran"),
    ] {
        if compiler(variable, default).is_none() || compiler("CC", "cc").is_none() {
            continue;
        }
        for kind in ["interface", "continuum"] {
            let folder = folder();
            let project = folder.path().join("new");
            let arguments = ["new-law", "new", "--language", language, "--kind", kind];
            let written = pilum_in(folder.path(), &arguments);
            assert!(written.status.success(), "{written:?}");
            let mut build = Command::new("sh");
            let built = build.arg("build.sh").current_dir(&project).status();
            assert!(built.unwrap().success(), "{language}");
            let library = project.join(format!("build/{DLL_PREFIX}new{DLL_SUFFIX}"));
            passes(&library);
            let driver = project.join("point.toml");
            let report = check(&library, &["--driver", driver.to_str().unwrap()]);
            let bad = report.with(&["failed", "crashed", "warning"]);
            assert_eq!(bad, [""; 0], "{language}, {kind}: {:#}", report.json);
            assert_eq!(report.code, Some(0), "{}", report.stderr);
        }
    }
}
