//! Helpers for C, C++ and Fortran, beyond one law with internal variables: several laws in a library,
//! laws without parameters or internal variables, choices, optional parameters, initial values. Also
//! more internal variables than they have room for.

use crate::compilers::{library, repository};
use crate::program::pilum;
use abi::Hypothesis;
use law::{Opener, Operator, SearchPath, Strided};
use std::process::Command;
use tempfile::TempDir;
use tests::needs::compiler;
use tests::or_skip;
use tests::words::rows_of;

#[test]
fn a_library_holds_several_laws() {
    for suffix in ["cpp", "f90"] {
        let folder = TempDir::new().unwrap();
        let language = if suffix == "cpp" { "cpp" } else { "fortran" };
        let (spring, counter) = (format!("spring_{language}"), format!("counter_{language}"));
        let source = repository(&format!("tests/authors/two_laws.{suffix}"));
        // A library without a manifest is found by its name alone, so it is there under both.
        let Some(file) = library(&source, &spring, folder.path()) else {
            continue;
        };
        let other = file.to_str().unwrap().replace(&spring, &counter);
        std::fs::copy(&file, other).unwrap();
        let search = SearchPath::new(&[folder.path().to_owned()]);
        let law = search.law(&spring).unwrap();
        let kind = &law.description().parameters[0];
        assert_eq!(kind.choices, ["soft", "stiff"]);
        assert_eq!(kind.default, Some(0.0));
        assert!(law.description().parameters[1].optional);
        let built = law
            .build(Hypothesis::Interface2d, &[1.0, f64::NAN])
            .unwrap();
        assert_eq!(built.n_states(), 0);
        let in_space = law.build(Hypothesis::Interface3d, &[0.0, 2.0]).unwrap();
        let (_, stiffness) = in_space.at_rest(&[0.0; 3], &[], Operator::Elastic).unwrap();
        assert_eq!(stiffness, [2e3, 0.0, 0.0, 0.0, 2e3, 0.0, 0.0, 0.0, 2e3]);
        let refused = law.build(Hypothesis::Interface2d, &[0.5, 1.0]).unwrap_err();
        assert!(refused.reason.contains("kind"), "{refused:?}");
        let law = search.law(&counter).unwrap();
        assert!(law.description().parameters.is_empty());
        let built = law.build(Hypothesis::Interface2d, &[]).unwrap();
        let state = built.initial_state(1, (&[0.0; 2], Strided::rows(2)));
        assert_eq!(state.unwrap(), [7.0]);
        pilum(folder.path(), &["check", file.to_str().unwrap()]).ended(0);
    }
}

/// In C++ the initial state receives the number of components; a class written without it compiles as well.
#[test]
fn an_initial_state_in_cpp_knows_its_components() {
    let source = repository("tests/authors/counted.cpp");
    let text = std::fs::read_to_string(&source).unwrap();
    let folder = TempDir::new().unwrap();
    let earlier = folder.path().join("earlier.cpp");
    let without = text
        .replace("uint32_t n, const double *flux", "const double *flux")
        .replace("state[0] = n;", "state[0] = 7;")
        .replace("\"counted\"", "\"earlier\"");
    assert_ne!(text, without);
    std::fs::write(&earlier, without).unwrap();
    for (source, id, expected) in [
        (&source, "counted", [2.0, 3.0]),
        (&earlier, "earlier", [7.0; 2]),
    ] {
        if library(source, id, folder.path()).is_none() {
            return;
        }
        let law = SearchPath::new(&[folder.path().to_owned()])
            .law(id)
            .unwrap();
        let states = [Hypothesis::Interface2d, Hypothesis::Interface3d].map(|hypothesis| {
            let n = hypothesis.components().len();
            let built = law.build(hypothesis, &[]).unwrap();
            built
                .initial_state(1, (&vec![-1.0; n], Strided::rows(n)))
                .unwrap()[0]
        });
        assert_eq!(states.to_vec(), expected, "{id}");
    }
}

/// Classes of one name in two libraries that hide nothing: C++ has the tables of such classes once in a process.
#[test]
fn classes_of_one_name_in_two_libraries_stay_apart() {
    let cxx = or_skip!(compiler("CXX", "c++"));
    let folder = TempDir::new().unwrap();
    let text = std::fs::read_to_string(repository("tests/authors/two_laws.cpp")).unwrap();
    let opener = Opener::default();
    for (id, factor) in [("spring_cpp", "factor"), ("feather", "share")] {
        let changed = text
            .replace("spring_cpp", id)
            .replace("counter_cpp", &format!("counter_{id}"))
            .replace("\"factor\"", &format!("{factor:?}"));
        let source = folder.path().join(format!("{id}.cpp"));
        std::fs::write(&source, changed).unwrap();
        let to = folder.path().join(format!("lib{id}.so"));
        let mut command = Command::new(&cxx);
        command.args(["-std=c++17", "-O1", "-shared", "-fPIC", "-I"]);
        command.arg(repository("abi/include"));
        crate::compilers::run(command.arg(&source).arg("-o").arg(&to));
        let law = opener.open(&to).unwrap().law(id).unwrap();
        assert_eq!(law.description().parameters[1].id, factor);
    }
}

/// More internal variables than there is room for: refused with a hint, and carried once there is.
#[test]
fn many_internal_variables_are_refused_or_carried() {
    let source = repository("tests/authors/many_states.c");
    let cc = or_skip!(compiler("CC", "cc"));
    for (room, says) in [(None, Some("define PILUM_MAX_STATES")), (Some(400), None)] {
        let folder = TempDir::new().unwrap();
        let to = folder.path().join("libmany_states.so");
        let mut command = Command::new(&cc);
        command.args(["-std=c11", "-O2", "-shared", "-fPIC", "-fvisibility=hidden"]);
        command.args(room.map(|n| format!("-DPILUM_MAX_STATES={n}")));
        command.arg("-I").arg(repository("abi/include"));
        crate::compilers::run(command.arg(&source).arg("-o").arg(&to).arg("-lm"));
        let outcome = pilum(folder.path(), &["check", "./libmany_states.so"]);
        assert_eq!(
            outcome.code == Some(0),
            says.is_none(),
            "{}",
            outcome.stdout
        );
        if let Some(says) = says {
            outcome.prints(says);
        }
    }
}

/// What a law frees is not told as kept, though the allocator keeps blocks of many sizes for later.
#[test]
fn freed_blocks_of_many_sizes_are_no_leak() {
    let cc = or_skip!(compiler("CC", "cc"));
    let folder = TempDir::new().unwrap();
    let text = std::fs::read_to_string(repository("tests/authors/many_states.c")).unwrap();
    let blocks = "static size_t calls;
    calls++;
    void *volatile block[7];
    for (size_t i = 0; i < 7; i++) { block[i] = malloc(16 * (calls / 30)); }
    for (size_t i = 0; i < 7; i++) { free(block[i]); }
    *out = malloc(sizeof **out);";
    let changed = text.replace("*out = malloc(sizeof **out);", blocks);
    assert_ne!(changed, text);
    std::fs::write(folder.path().join("blocks.c"), changed).unwrap();
    let mut command = Command::new(cc);
    command.args([
        "-std=c11",
        "-shared",
        "-fPIC",
        "-fvisibility=hidden",
        "-DPILUM_MAX_STATES=400",
    ]);
    command.arg("-I").arg(repository("abi/include"));
    crate::compilers::run(
        command
            .current_dir(folder.path())
            .args(["blocks.c", "-o", "blocks.so"]),
    );
    let only = ["check", "./blocks.so", "--only", "memory-is-freed"];
    pilum(folder.path(), &only).prints("1 checks: 1 passed");
}

/// The same law in C++ does not compile.
#[test]
fn a_class_with_too_many_internal_variables_does_not_compile() {
    let cxx = or_skip!(compiler("CXX", "c++"));
    let text = std::fs::read_to_string(repository("tests/authors/two_laws.cpp")).unwrap();
    for (room, compiles) in [("256", true), ("0", false)] {
        let folder = TempDir::new().unwrap();
        std::fs::write(folder.path().join("two_laws.cpp"), &text).unwrap();
        let mut command = Command::new(&cxx);
        command.args(["-std=c++17", "-fsyntax-only", "-w", "two_laws.cpp", "-I"]);
        command
            .arg(repository("abi/include"))
            .current_dir(folder.path());
        let output = command
            .arg(format!("-DPILUM_MAX_STATES={room}"))
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.success(), compiles, "{said}");
        assert!(compiles || said.contains("more internal variables than PILUM_MAX_STATES"));
    }
}

/// In Fortran the law is refused as soon as it gets parameters.
#[test]
fn too_many_of_anything_in_fortran_is_said() {
    let text = std::fs::read_to_string(repository("tests/authors/two_laws.f90")).unwrap();
    for [statement, says] in rows_of(
        "
call add_state(257, 'x', 'x', '-', 'X.') | not within 1 and MAX_STATES
do k = 1, 300; call add_parameter('x'//achar(97 + mod(k, 26))//achar(97 + k/26), 'x', '-', 'X.'); end do | more parameters than MAX_PARAMETERS
call add_parameter('x', 'x', '-', 'X.', choices=[('a', k=1, 40)]) | more labels of x than MAX_CHOICES
",
    ) {
        let folder = TempDir::new().unwrap();
        let source = folder.path().join("two_laws.f90");
        let changed = text
            .replace(
                "subroutine describe()",
                "subroutine describe()\n    integer :: k",
            )
            .replace(
                "    call add_state(1,",
                &format!("    {statement}\n    call add_state(1,"),
            );
        assert_ne!(changed, text);
        std::fs::write(&source, changed).unwrap();
        let compiler = or_skip!(compiler("FC", "gfortran"));
        let mut command = Command::new(compiler);
        command.args(["-frecursive", "-shared", "-fPIC", "-fvisibility=hidden"]);
        command.arg(repository("abi/include/pilum_law.f90"));
        command.args(["two_laws.f90", "-o", "libtwo_laws.so"]);
        crate::compilers::run(command.current_dir(folder.path()));
        let outcome = pilum(
            folder.path(),
            &["check", "./libtwo_laws.so", "--only=create-works"],
        )
        .ended(3);
        outcome.prints(says);
    }
}
