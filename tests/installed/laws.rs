//! Laws that are built with the installed headers, by pkg-config and by CMake.

use std::fs;
use std::process::Command;
use tests::needs::{assert_named, output};
use tests::place::{Compilers, Place, are_there};
use tests::words::has;

/// A project without its own copy of the contract.
fn bare(place: &Place, language: &str) {
    place.done("", &format!("pilum new-law slider --language {language}"));
    fs::remove_dir_all(place.work().join("slider/include")).unwrap();
    fs::create_dir(place.work().join("slider/build")).unwrap();
}

/// The project's case runs with the library. `pilum check` judges it in other tests.
fn used(place: &Place) {
    place.done("slider", "pilum run case.toml");
}

#[test]
fn pkg_config_finds_the_headers() {
    if output(Command::new("pkg-config").arg("--version")).is_none()
        || !are_there(&[("CC", "cc"), ("FC", "gfortran")])
    {
        return;
    }
    let place = Place::new();
    let prefix = place.prefix.to_str().unwrap();
    let pages = format!("{prefix}/lib/pkgconfig");
    let told = |what: &str| {
        let told = place
            .shell_with(
                "",
                &format!("pkg-config {what} pilum"),
                &[("PKG_CONFIG_PATH", &pages)],
            )
            .ended(0);
        told.stdout.trim().to_owned()
    };
    assert_eq!(told("--modversion"), env!("CARGO_PKG_VERSION"));
    let headers = told("--cflags");
    let (module, exports) = (
        told("--variable=fortran_module"),
        told("--variable=exports"),
    );

    bare(&place, "c");
    place.done(
        "slider",
        &format!(
            "cc -O2 -fPIC -fvisibility=hidden {headers} -shared law.c -o build/libslider.so -lm"
        ),
    );
    used(&place);
    fs::remove_dir_all(place.work().join("slider")).unwrap();
    bare(&place, "fortran");
    place.done(
        "slider",
        &format!(
            "gfortran -O2 -frecursive -ffree-line-length-none -fPIC -J build {headers} -shared \
             -Wl,--version-script={exports} {module} law.f90 manifest.c -o build/libslider.so"
        ),
    );
    used(&place);
}

#[test]
fn cmake_finds_the_package() {
    if output(Command::new("cmake").arg("--version")).is_none() {
        return;
    }
    let cases: [(&str, &str, &str, Compilers); 3] = [
        ("c", "C", "law.c", &[("CC", "cc")]),
        ("cpp", "CXX", "law.cpp", &[("CXX", "c++")]),
        (
            "fortran",
            "C Fortran",
            "law.f90 manifest.c",
            &[("FC", "gfortran"), ("CC", "cc")],
        ),
    ];
    for (language, languages, sources, compilers) in cases {
        if !are_there(compilers) {
            continue;
        }
        let place = Place::new();
        bare(&place, language);
        let project = format!(
            "cmake_minimum_required(VERSION 3.16)\nproject(slider LANGUAGES {languages})\n\
             find_package(pilum 0.1 REQUIRED)\npilum_add_law(slider {sources})\n"
        );
        fs::write(place.work().join("slider/CMakeLists.txt"), project).unwrap();
        // It is found by the program in `PATH`.
        place.done(
            "slider",
            "cmake -S . -B build -DCMAKE_BUILD_TYPE=Release && cmake --build build",
        );
        used(&place);
    }
}

/// A version that is absent is refused by its number.
#[test]
fn cmake_refuses_another_version() {
    if output(Command::new("cmake").arg("--version")).is_none() {
        return;
    }
    let place = Place::new();
    let project = |version: &str| {
        let text = format!(
            "cmake_minimum_required(VERSION 3.16)\nproject(p LANGUAGES NONE)\nfind_package(pilum {version} REQUIRED)\n"
        );
        fs::write(place.work().join("CMakeLists.txt"), text).unwrap();
        place.shell("", "cmake -S . -B build")
    };
    for fits in ["", "0.1", env!("CARGO_PKG_VERSION")] {
        assert_eq!(project(fits).code, Some(0), "{fits}");
    }
    for other in ["0.2", "1.0", "7"] {
        let outcome = project(other);
        assert_ne!(outcome.code, Some(0), "{other}");
        has(&outcome.stderr, "pilum-config.cmake, version: 0.1.0");
    }
}

#[test]
fn what_is_missing_is_named() {
    assert_named("laws::pkg_config_finds_the_headers", "`pkg-config`");
    assert_named("laws::cmake_finds_the_package", "`cmake`");
}
