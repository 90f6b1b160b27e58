//! A law that misbehaves on request, compiled once for each way of compiling it.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{CASE, Place, edited};
use std::collections::BTreeMap;
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::Path;
use std::process::Command;
use std::sync::{Mutex, PoisonError};
use tempfile::TempDir;

/// Path of the library in a [`Place`].
pub(crate) fn library() -> String {
    format!("laws/{DLL_PREFIX}troubled{DLL_SUFFIX}")
}

/// A folder with the law, compiled with this definition if it is not empty. `None`, with a remark,
/// where there is no compiler.
pub(crate) fn place(define: &'static str) -> Option<Place> {
    static COMPILED: Mutex<BTreeMap<&str, Vec<u8>>> = Mutex::new(BTreeMap::new());
    let mut compiled = COMPILED.lock().unwrap_or_else(PoisonError::into_inner);
    if !compiled.contains_key(define) {
        compiled.insert(define, compile(define)?);
    }
    let place = Place::new();
    place.write(&library(), &compiled[define]);
    Some(place)
}

/// A folder with the law whose way "elsewhere" calls this C++ or Fortran routine.
pub(crate) fn place_with(compiler: &str, ending: &str, routine: &str) -> Option<Place> {
    let folder = TempDir::new().unwrap();
    let source = folder.path().join("elsewhere").with_extension(ending);
    std::fs::write(&source, routine).unwrap();
    let object = folder.path().join("elsewhere.o");
    let mut command = Command::new(compiler);
    let command = command.args(["-c", "-fPIC", "-o"]).arg(&object);
    let output = tests::needs::output(command.arg(&source))?;
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let of_language = match compiler {
        "c++" => "-lstdc++",
        _ => "-lgfortran",
    };
    let more = [object.to_str().unwrap(), of_language];
    let place = Place::new();
    place.write(&library(), compile_with("TROUBLE_ELSEWHERE", &more)?);
    Some(place)
}

fn compile(define: &str) -> Option<Vec<u8>> {
    compile_with(define, &[])
}

fn compile_with(define: &str, more: &[&str]) -> Option<Vec<u8>> {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("library");
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut compiler = Command::new("cc");
    compiler
        .args(["-shared", "-fPIC", "-fvisibility=hidden", "-o"])
        .arg(&out)
        .args((!define.is_empty()).then(|| format!("-D{define}")))
        .arg("-I")
        .arg(here.join("../abi/include"))
        .arg(here.join("command_line/fixtures/troubled.c"))
        .args(more);
    let output = tests::needs::output(&mut compiler)?;
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    Some(std::fs::read(out).unwrap())
}

/// A driver that leads the law beyond a limit of 1 mm in the third of four increments.
pub(crate) fn driver(how: &str) -> String {
    format!(
        "law = \"troubled\"\nlaw_path = [\"laws\"]\nhypothesis = \"interface_2d\"\n\
         [parameters]\nlimit = 1.0e-3\nhow = \"{how}\"\n\
         [initial]\ntraction = {{ n = -100.0 }}\n\
         [[segment]]\nincrements = 4\ncontrol = {{ t = {{ jump = 2.0e-3 }}, n = {{ jump = 0.0 }} }}\n"
    )
}

/// The case with this law in its layer; the limit is exceeded in the second phase.
pub(crate) fn case(how: &str) -> String {
    let start = CASE.find("[laws.joint.parameters]").unwrap();
    let end = CASE.find("[groups.soil]").unwrap();
    let text = edited(&[
        r#"law = "coulomb_joint" => law = "troubled""#,
        r#"title => law_path = ["laws"]\ntitle"#,
    ]);
    let parameters = &CASE[start..end];
    let own = format!("parameters = {{ limit = 1.0e-6, how = \"{how}\" }}\n\n");
    text.replacen(parameters, &own, 1)
        .replacen("x = 1e-5 }", "x = 1e-3 }", 1)
}

#[test]
fn a_missing_compiler_is_named() {
    for (test, compiler) in [
        ("capsule::a_failed_driver_leaves_its_call", "`cc`"),
        ("libraries::refuses_other_libraries", "`cc`"),
        ("umat::an_elastic_umat_is_the_elastic_law", "`gfortran`"),
    ] {
        tests::needs::assert_named(test, compiler);
    }
}
