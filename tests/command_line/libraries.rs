//! Law libraries that are missing or invalid.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{CASE, PLUGIN_TROUBLE, Place, refuses_in};
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::Path;
use std::process::Command;
use tests::or_skip;
use tests::words::rows_of;

#[test]
fn says_where_it_looked_for_a_missing_law() {
    refuses_in(
        CASE,
        PLUGIN_TROUBLE,
        r#"
misspelt
  "coulomb_joint" => ^"coulomb_join"
  no library with law `coulomb_join` in
  deps
  did you mean `coulomb_joint`?
  elastic
  PILUM_LAW_PATH
"#,
    );
}

/// A case whose folder of laws holds a library for `strange`, which its soil is made of.
fn place_with(library: &[u8]) -> Place {
    let place = Place::new();
    place.write(&library_name(), library);
    place
}

fn library_name() -> String {
    format!("laws/{DLL_PREFIX}strange{DLL_SUFFIX}")
}

/// Runs the case: plugin trouble, said of this library.
fn refused(place: &Place, says: &[&str]) {
    let text = CASE.replace("\"elastic\"", "\"strange\"");
    let outcome = place
        .run_case(format!("law_path = [\"laws\"]\n{text}"))
        .ended(PLUGIN_TROUBLE);
    for text in [&library_name(), "case.toml:29:7"].iter().chain(says) {
        outcome.shows(text);
    }
    assert_eq!(outcome.stdout, "");
    assert_eq!(place.contents(), ["case.toml", "laws"]);
}

#[test]
fn refuses_files_that_are_no_library() {
    refused(&place_with(b""), &["cannot be loaded"]);
    refused(
        &place_with(b"int main(void) { return 0; }\n"),
        &["cannot be loaded"],
    );
    let garbage: Vec<u8> = b"\x7fELF".iter().copied().chain(0..=255).collect();
    refused(&place_with(&garbage), &["cannot be loaded"]);
}

/// A library compiled from this source. `None`, with a remark, where there is no compiler.
fn compiled(source: &str) -> Option<Place> {
    let place = place_with(b"");
    place.write("source.c", source);
    let include = Path::new(env!("CARGO_MANIFEST_DIR")).join("../abi/include");
    let mut compiler = Command::new("cc");
    compiler
        .args(["-shared", "-fPIC", "-o"])
        .arg(place.path(&library_name()))
        .arg("-I")
        .arg(include)
        .arg(place.path("source.c"));
    let output = tests::needs::output(&mut compiler)?;
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    std::fs::remove_file(place.path("source.c")).unwrap();
    Some(place)
}

/// A library with this handshake block and this end.
fn handshake(block: &str, rest: &str) -> String {
    format!(
        "#include \"pilum_law.h\"\nPILUM_EXPORT const pilum_magic_block pilum_magic = {block};\n\
         {rest}\n"
    )
}

/// The block of a library that can be used, with one field replaced.
fn block(field: &str, value: &str) -> String {
    let fields = [
        ("struct_size", "sizeof(pilum_magic_block)"),
        ("magic", "PILUM_MAGIC"),
        ("abi_major", "PILUM_ABI_MAJOR"),
        ("abi_minor", "PILUM_ABI_MINOR"),
        ("pointer_bytes", "sizeof(void *)"),
        ("real_bytes", "sizeof(double)"),
        ("layout_hash", "PILUM_LAYOUT_HASH"),
    ];
    let written = fields.map(|(name, usual)| {
        let value = if name == field { value } else { usual };
        format!(".{name} = {value}")
    });
    format!("{{ {} }}", written.join(", "))
}

#[test]
fn refuses_other_libraries() {
    let Some(place) = compiled("int nothing;\n") else {
        return;
    };
    refused(&place, &["no symbol `pilum_magic`", "no Pilum law library"]);
}

#[test]
fn names_the_field_of_the_handshake_that_differs() {
    for [field, value, says] in rows_of(
        "
magic | 0x12345678 | `pilum_magic.magic` is 0x12345678, expected 0x50494c4d
magic | 0x4d4c4950 | other endianness
struct_size | 32 | `pilum_magic.struct_size` is 0x20, expected 0x40
abi_major | PILUM_ABI_MAJOR + 1 | `pilum_magic.abi_major` is 0x2, expected 0x1
pointer_bytes | 4 | `pilum_magic.pointer_bytes` is 0x4, expected 0x8
real_bytes | 4 | `pilum_magic.real_bytes` is 0x4, expected 0x8
layout_hash | 1 | `pilum_magic.layout_hash` is 0x1, expected
",
    ) {
        let place = or_skip!(compiled(&handshake(&block(field, value), "")));
        refused(&place, &[says]);
    }
}

#[test]
fn refuses_descriptions_that_cannot_be_used() {
    let entry = |plugin: &str| {
        format!("const pilum_plugin *pilum_entry(const pilum_host *host) {{ {plugin} }}")
    };
    let with_law = |law: &str| {
        format!(
            "static const pilum_law law = {law};\n\
             static const pilum_law *const laws[] = {{ &law }};\n{}",
            entry("static const pilum_plugin p = { sizeof p, 1, laws, 0 }; return &p;")
        )
    };
    let with_plugin = |p: &str| entry(&format!("static const pilum_plugin p = {p}; return &p;"));
    for (rest, says) in [
        (String::new(), "no symbol `pilum_entry`"),
        (entry("return 0;"), "it refuses this host"),
        (with_plugin("{ 8, 0, 0, 0 }"), "`pilum_plugin` is truncated"),
        (with_plugin("{ sizeof p, 0, 0, 0 }"), "it declares 0 laws"),
        (
            with_law("{ .struct_size = 16 }"),
            "law 0: `pilum_law` is truncated",
        ),
        (
            with_law("{ .struct_size = sizeof(pilum_law), .id = \"strange\" }"),
            "is null",
        ),
    ] {
        let place = or_skip!(compiled(&handshake("PILUM_MAGIC_BLOCK(\"test\")", &rest)));
        refused(&place, &[says]);
    }
}

/// A library is found by its name, or by its list of laws; what it holds is another matter.
#[test]
fn refuses_a_library_without_the_law_it_is_named_after() {
    let deps = std::env::current_exe()
        .unwrap()
        .parent()
        .unwrap()
        .to_owned();
    let elastic = deps.join(format!("{DLL_PREFIX}elastic{DLL_SUFFIX}"));
    let place = place_with(&std::fs::read(elastic).unwrap());
    refused(&place, &["has no law `strange`", "there is: elastic"]);
}
