//! The C header says what the Rust types say: it is generated here, and C and C++ compilers are
//! asked. `PILUM_BLESS=1` rewrites the committed file; `CC` and `CXX` choose the compilers.

use abi::raw;
use abi::version::{LAYOUT, LAYOUT_HASH, MAGIC_BLOCK, SDK};
use object::{Object, ObjectSection};
use std::collections::HashMap;
use std::error::Error;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

type Outcome<T = ()> = Result<T, Box<dyn Error>>;

const ABI: &str = env!("CARGO_MANIFEST_DIR");
const STRICT: [&str; 6] = [
    "-Wall",
    "-Wextra",
    "-Wpedantic",
    "-Wconversion",
    "-Wshadow",
    "-Werror",
];

#[test]
fn the_committed_header_is_the_generated_one() -> Outcome {
    let path = Path::new(ABI).join("include/pilum_law.h");
    let generated = header()?;
    assert!(generated.is_ascii(), "the header must be plain ASCII");
    let mut committed = fs::read_to_string(&path).unwrap_or_default();
    if committed != generated && env::var_os("PILUM_BLESS").is_some_and(|v| v == "1") {
        fs::write(&path, &generated)?;
        committed.clone_from(&generated);
    }
    let differing = (1..)
        .zip(committed.lines())
        .zip(generated.lines())
        .find(|((_, old), new)| old != new);
    assert!(
        committed == generated,
        "abi/include/pilum_law.h differs from the Rust types (first at {differing:?}); \
         rewrite it with: PILUM_BLESS=1 cargo test -p pilum-abi --test header"
    );
    Ok(())
}

#[test]
fn c_and_rust_agree_on_every_field() -> Outcome {
    let Some(cc) = compiler("CC", "cc") else {
        return Ok(());
    };
    let renames = config()?.export.rename;
    let mut expected = Vec::new();
    let mut prints = String::new();
    let mut ask = |name: String, value: u64, expression: String| -> Outcome {
        writeln!(
            prints,
            "    printf(\"%\" PRIu64 \"\\n\", (uint64_t)({expression}));"
        )?;
        expected.push((name, value));
        Ok(())
    };
    for &(name, offset, size) in LAYOUT.iter().copied().flatten() {
        let (rust, field) = name.split_once('.').unwrap_or((name, ""));
        let c = &renames[rust];
        if field.is_empty() {
            ask(format!("sizeof {c}"), size as u64, format!("sizeof({c})"))?;
        } else {
            ask(
                format!("offset of {c}.{field}"),
                offset as u64,
                format!("offsetof({c}, {field})"),
            )?;
            ask(
                format!("size of {c}.{field}"),
                size as u64,
                format!("sizeof((({c} *)0)->{field})"),
            )?;
        }
    }
    let ours = &MAGIC_BLOCK;
    for (field, value) in [
        ("struct_size", ours.struct_size.into()),
        ("magic", ours.magic.into()),
        ("abi_major", ours.abi_major.into()),
        ("abi_minor", ours.abi_minor.into()),
        ("pointer_bytes", ours.pointer_bytes.into()),
        ("real_bytes", ours.real_bytes.into()),
        ("layout_hash", LAYOUT_HASH),
    ] {
        ask(format!("magic.{field}"), value, format!("magic.{field}"))?;
    }
    let program = format!(
        "#include \"pilum_law.h\"\n#include <inttypes.h>\n#include <stdio.h>\n\
         static const pilum_magic_block magic = PILUM_MAGIC_BLOCK(\"{SDK}\");\n\
         int main(void) {{\n{prints}    puts(magic.sdk);\n    return 0;\n}}\n"
    );
    let source = temporary("layout.c");
    fs::write(&source, program)?;
    let binary = temporary(&format!("layout{}", env::consts::EXE_SUFFIX));
    run(compile(&cc, "c11").arg(&source).arg("-o").arg(&binary))?;
    let printed = run(&mut Command::new(&binary))?;
    let mut lines = printed.lines();
    for (name, value) in expected {
        let c: u64 = lines.next().ok_or("too few lines")?.parse()?;
        assert_eq!(c, value, "{name}: C (left) and Rust (right) differ");
    }
    assert_eq!(lines.next(), Some(SDK));
    Ok(())
}

/// The Fortran module mirrors the structs by hand: asked field by field, and number by number.
#[test]
fn fortran_and_rust_agree_on_every_field() -> Outcome {
    let Some(fc) = compiler("FC", "gfortran") else {
        return Ok(());
    };
    let renames = config()?.export.rename;
    let (mut declared, mut asked, mut expected) = (String::new(), String::new(), Vec::new());
    let mut ask = |name: String, value: i64, expression: String| -> Outcome {
        writeln!(asked, "  print '(i0)', {expression}")?;
        expected.push((name, value));
        Ok(())
    };
    for (number, fields) in LAYOUT.iter().enumerate() {
        let x = format!("x{number}");
        for &(name, offset, size) in *fields {
            let (rust, field) = name.split_once('.').unwrap_or((name, ""));
            let (f, size, offset) = (&renames[rust], size as i64, offset as i64);
            if field.is_empty() {
                writeln!(declared, "  type({f}), target :: {x}")?;
                ask(format!("size of {f}"), size, format!("c_sizeof({x})"))?;
                continue;
            }
            let at = format!("transfer(c_loc({x}%{field}), 0_c_intptr_t)");
            let start = format!("transfer(c_loc({x}), 0_c_intptr_t)");
            ask(
                format!("offset of {f}.{field}"),
                offset,
                format!("{at} - {start}"),
            )?;
            ask(
                format!("size of {f}.{field}"),
                size,
                format!("c_sizeof({x}%{field})"),
            )?;
        }
    }
    let ours = &MAGIC_BLOCK;
    for (field, value) in [
        ("struct_size", ours.struct_size.into()),
        ("magic", ours.magic.into()),
        ("abi_major", ours.abi_major.into()),
        ("abi_minor", ours.abi_minor.into()),
        ("pointer_bytes", ours.pointer_bytes.into()),
        ("real_bytes", ours.real_bytes.into()),
        ("layout_hash", LAYOUT_HASH as i64),
    ] {
        ask(
            format!("magic.{field}"),
            value,
            format!("pilum_magic%{field}"),
        )?;
    }
    let module = Path::new(ABI).join("include/pilum_law.f90");
    // Every number of the header that the module has too.
    let text = fs::read_to_string(&module)?;
    for (name, value) in numbers(&header()?)? {
        if text.contains(&format!(":: {name} =")) {
            ask(name.clone(), value, name)?;
        }
    }
    let numbers = expected
        .iter()
        .filter(|(name, _)| name.starts_with("PILUM_"));
    assert!(
        numbers.count() > 25,
        "the numbers of the header were not found"
    );
    let source = temporary("layout.f90");
    let program =
        format!("program layout\n  use pilum\n  implicit none\n{declared}{asked}end program\n");
    fs::write(&source, program)?;
    let binary = temporary(&format!("layout_fortran{}", env::consts::EXE_SUFFIX));
    run(Command::new(&fc)
        .args([
            "-std=f2018",
            "-Wall",
            "-Wextra",
            "-Wno-unused-dummy-argument",
            "-Werror",
        ])
        .arg("-J")
        .arg(env!("CARGO_TARGET_TMPDIR"))
        .arg(&module)
        .arg(&source)
        .arg("-o")
        .arg(&binary))?;
    let printed = run(&mut Command::new(&binary))?;
    let mut lines = printed.lines();
    for (name, value) in expected {
        let fortran: i64 = lines.next().ok_or("too few lines")?.parse()?;
        assert_eq!(
            fortran, value,
            "{name}: Fortran (left) and Rust (right) differ"
        );
    }
    Ok(())
}

/// Names and values of the whole numbers that a header defines.
fn numbers(header: &str) -> Outcome<Vec<(String, i64)>> {
    let mut found = Vec::new();
    for line in header.lines() {
        let mut words = line.split_whitespace();
        let (Some("#define"), Some(name), Some(value)) = (words.next(), words.next(), words.next())
        else {
            continue;
        };
        let value = match (value, words.next(), words.next()) {
            ("(1u", Some("<<"), Some(bit)) => 1 << bit.trim_end_matches(')').parse::<u32>()?,
            (value, None, None) => match value.trim_matches(['(', ')']).parse() {
                Ok(value) => value,
                Err(_) => continue,
            },
            _ => continue,
        };
        found.push((name.to_owned(), value));
    }
    Ok(found)
}

/// The headers for authors, in the strictest form of both languages.
#[test]
fn the_headers_for_authors_compile_strictly() -> Outcome {
    let headers = [
        ("CC", "cc", "c11", "pilum_point.h", "author.c"),
        ("CXX", "c++", "c++17", "pilum_point.h", "author_point.cpp"),
        ("CXX", "c++", "c++17", "pilum_law.hpp", "author.cpp"),
    ];
    for (variable, default, standard, header, name) in headers {
        let Some(compiler) = compiler(variable, default) else {
            continue;
        };
        let source = temporary(name);
        fs::write(
            &source,
            format!("#include \"{header}\"\n#include \"{header}\"\n"),
        )?;
        run(compile(&compiler, standard)
            .arg("-Wno-unused-function")
            .arg("-c")
            .arg(&source)
            .arg("-o")
            .arg(temporary(&format!("{name}.o"))))?;
    }
    Ok(())
}

#[test]
fn the_header_and_its_macros_compile_as_cpp() -> Outcome {
    let Some(cxx) = compiler("CXX", "c++") else {
        return Ok(());
    };
    let source = temporary("library.cpp");
    fs::write(
        &source,
        "#include \"pilum_law.h\"\n#include \"pilum_law.h\"\n\
         const pilum_magic_block pilum_magic = PILUM_MAGIC_BLOCK(\"cpp 1.0\");\n\
         PILUM_MANIFEST(\"pilum 1\\n\");\n\
         static const pilum_plugin plugin = {sizeof(pilum_plugin), 0, nullptr, nullptr};\n\
         const pilum_plugin *pilum_entry(const pilum_host *host) {\n\
             return PILUM_HAS(host, pilum_host, get_extension) ? &plugin : nullptr;\n\
         }\n\
         extern \"C\" double first(const pilum_batch *batch) {\n\
             return PILUM_AT(batch->gradient0, 0, 0);\n\
         }\n",
    )?;
    let library = temporary("cpp_library");
    run(compile(&cxx, "c++11")
        .args(SHARED)
        .arg(&source)
        .arg("-o")
        .arg(&library))?;
    assert_eq!(exports(&library)?, ["pilum_entry", "pilum_magic"]);
    Ok(())
}

#[test]
fn a_law_in_c_exports_the_two_symbols_and_the_manifest() -> Outcome {
    let Some(cc) = compiler("CC", "cc") else {
        return Ok(());
    };
    let library = temporary("elastic_joint");
    run(compile(&cc, "c11")
        .args(SHARED)
        .arg(Path::new(ABI).join("tests/elastic_joint.c"))
        .arg("-o")
        .arg(&library))?;
    assert_eq!(exports(&library)?, ["pilum_entry", "pilum_magic"]);
    let bytes = fs::read(&library)?;
    let file = object::File::parse(&*bytes)?;
    let section = file.section_by_name(".pilum").ok_or("no manifest")?;
    assert_eq!(section.data()?, b"pilum 1\nelastic_joint 1.0\n\0");
    Ok(())
}

/// Three points, strides that differ, one NaN: what a host does, in C.
#[test]
fn a_law_in_c_keeps_the_contract() -> Outcome {
    let Some(cc) = compiler("CC", "cc") else {
        return Ok(());
    };
    let binary = temporary(&format!("host{}", env::consts::EXE_SUFFIX));
    run(compile(&cc, "c11")
        .arg(Path::new(ABI).join("tests/elastic_joint.c"))
        .arg(Path::new(ABI).join("tests/elastic_joint_host.c"))
        .arg("-o")
        .arg(&binary)
        .arg("-lm"))?;
    assert_eq!(
        run(&mut Command::new(&binary))?,
        format!(
            "{} normal_stiffness: must be positive\n\
             {} point 12: a value is not finite\n\
             {} -99 3\n{} -98 6\n{}\n\
             1000 0 0 3000\n",
            raw::PILUM_E_PARAMETER,
            raw::PILUM_E_NUMERIC,
            raw::PILUM_OK,
            raw::PILUM_OK,
            raw::PILUM_E_NUMERIC,
        )
    );
    Ok(())
}

/// Options of a library that hides all but its two symbols and drops what nothing refers to.
const SHARED: &[&str] = if cfg!(target_vendor = "apple") {
    &["-dynamiclib", "-fPIC", "-fvisibility=hidden"]
} else {
    &[
        "-shared",
        "-fPIC",
        "-fvisibility=hidden",
        "-ffunction-sections",
        "-fdata-sections",
        "-Wl,--gc-sections",
    ]
};

fn exports(library: &Path) -> Outcome<Vec<String>> {
    let bytes = fs::read(library)?;
    let mut names = Vec::new();
    for export in object::File::parse(&*bytes)?.exports()? {
        let name = str::from_utf8(export.name())?;
        let mangled = cfg!(target_vendor = "apple");
        names.push(
            name.strip_prefix('_')
                .filter(|_| mangled)
                .unwrap_or(name)
                .to_owned(),
        );
    }
    names.sort();
    Ok(names)
}

/// The program named by the variable, or else `default`; `None`, with a remark, if absent. If
/// `PILUM_REQUIRE_ALL` or `CI` is set, a missing compiler is a failure.
fn compiler(variable: &str, default: &str) -> Option<String> {
    let name = env::var(variable).unwrap_or_else(|_| default.to_owned());
    if Command::new(&name).arg("--version").output().is_ok() {
        return Some(name);
    }
    let required = ["PILUM_REQUIRE_ALL", "CI"];
    assert!(
        required.iter().all(|name| env::var_os(name).is_none()),
        "`{name}` is missing, and {} is set",
        required.join(" or ")
    );
    // Past the capture of the test harness, so that it is seen.
    let _ = writeln!(std::io::stderr(), "SKIPPED: `{name}` is missing");
    note(&name);
    None
}

/// As `tests/support/needs.rs` notes it, for the line at the end of `cargo test`.
#[cfg(unix)]
fn note(name: &str) {
    let program = env::current_exe().unwrap_or_default();
    let Some(built) = program.ancestors().nth(3) else {
        return;
    };
    let (folder, program) = (built.join("tmp/skipped"), program.display());
    let _ = fs::create_dir_all(&folder);
    let starter = std::os::unix::process::parent_id().to_string();
    let mut options = fs::OpenOptions::new();
    if let Ok(mut file) = options.create(true).append(true).open(folder.join(starter)) {
        let test = std::thread::current().name().unwrap_or_default().to_owned();
        let _ = file.write_all(format!("{program} {test}\t`{name}`\n").as_bytes());
    }
}

#[cfg(not(unix))]
fn note(_: &str) {}

/// A test without its compiler passes with a remark, or fails where nothing may be passed over.
#[test]
fn a_missing_compiler_is_named() -> Outcome {
    for (test, variable) in [
        ("c_and_rust_agree_on_every_field", "CC"),
        ("the_header_and_its_macros_compile_as_cpp", "CXX"),
        ("fortran_and_rust_agree_on_every_field", "FC"),
    ] {
        for strict in [false, true] {
            let mut command = Command::new(env::current_exe()?);
            command.args(["--exact", test, "--nocapture"]);
            command.env(variable, "no_such_compiler");
            command.env_remove("CI").env_remove("PILUM_REQUIRE_ALL");
            command.envs(strict.then_some(("PILUM_REQUIRE_ALL", "1")));
            let output = command.output()?;
            let said = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.success(), !strict, "{test}\n{said}");
            assert!(
                said.contains("`no_such_compiler` is missing"),
                "{test}\n{said}"
            );
        }
    }
    Ok(())
}

fn compile(compiler: &str, standard: &str) -> Command {
    let mut command = Command::new(compiler);
    command
        .arg(format!("-std={standard}"))
        .args(STRICT)
        .arg("-I")
        .arg(Path::new(ABI).join("include"));
    command
}

fn run(command: &mut Command) -> Outcome<String> {
    let output = command.output()?;
    if output.status.success() {
        Ok(String::from_utf8(output.stdout)?.replace("\r\n", "\n"))
    } else {
        let errors = String::from_utf8_lossy(&output.stderr);
        Err(format!("{command:?}: {}\n{errors}", output.status).into())
    }
}

fn temporary(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

fn config() -> Outcome<cbindgen::Config> {
    Ok(cbindgen::Config::from_file(
        Path::new(ABI).join("cbindgen.toml"),
    )?)
}

/// The header as it should be.
fn header() -> Outcome<String> {
    let source = Path::new(ABI).join("src/raw.rs");
    let mut config = config()?;
    let head = config.header.take().ok_or("no header")?;
    let tail = config.trailer.take().ok_or("no trailer")?;
    let renames = config.export.rename.clone();
    let mut generated = Vec::new();
    cbindgen::Builder::new()
        .with_config(config)
        .with_src(&source)
        .generate()?
        .write(&mut generated);
    let generated = String::from_utf8(generated)?;

    // A constant belongs beside the struct it is used in, as in the source.
    let source = fs::read_to_string(source)?;
    let mut items: Vec<&str> = generated.trim().split("\n\n").collect();
    items.sort_by_key(|item| position(item, &source, &renames));
    let mut out = head;
    let mut after_constant = false;
    for item in items {
        let constant = item.contains("#define ");
        if !(constant && after_constant) {
            out.push('\n');
        }
        after_constant = constant;
        out.push_str(&comments(&plain(item, &renames)));
    }
    let sizes: Vec<String> = LAYOUT
        .iter()
        .filter_map(|fields| fields.last())
        .map(|(rust, _, size)| format!("PILUM_SIZE({}, {size});", renames[*rust]))
        .collect();
    out.push('\n');
    out += &tail
        .replace("@LAYOUT_HASH@", &format!("{LAYOUT_HASH:#018x}"))
        .replace("@SIZES@", &sizes.join("\n"));
    Ok(out)
}

/// Where the source declares an item of the header.
fn position(item: &str, source: &str, renames: &HashMap<String, String>) -> Option<usize> {
    let declaration = if let Some((_, define)) = item.split_once("#define ") {
        format!("pub const {}:", define.split(' ').next()?)
    } else {
        let c = item.trim_end_matches(';').rsplit(' ').next()?;
        let (rust, _) = renames.iter().find(|(_, name)| *name == c)?;
        let keyword = if item.contains("typedef struct") {
            "struct"
        } else {
            "type"
        };
        format!("pub {keyword} {rust} ")
    };
    source.find(&declaration)
}

/// An item in C's words: types by their C names, no links, no letters beyond ASCII, and numbers
/// that can be in any expression.
fn plain(item: &str, renames: &HashMap<String, String>) -> String {
    let mut text = item.to_owned();
    for (from, to) in [
        ("[`", "`"),
        ("`]", "`"),
        ("\\[", "["),
        ("\\]", "]"),
        ("∂", "d "),
        ("−∞", "-infinity"),
        ("+∞", "+infinity"),
        ("γ = 2ε", "gamma = 2 epsilon"),
        ("…", "..."),
        ("(1 << ", "(1u << "),
    ] {
        text = text.replace(from, to);
    }
    for (rust, c) in renames {
        text = text
            .replace(&format!("`{rust}`"), &format!("`{c}`"))
            .replace(&format!("`{rust}::"), &format!("`{c}."));
    }
    text = text.replace(
        &format!("PILUM_MAGIC {}", raw::PILUM_MAGIC),
        &format!("PILUM_MAGIC UINT32_C({:#X})", raw::PILUM_MAGIC),
    );
    match text.rsplit_once(" -") {
        Some((define, digits)) if define.contains("#define ") => format!("{define} (-{digits})"),
        _ => text,
    }
}

/// Comments with their delimiters on the lines of the text.
fn comments(item: &str) -> String {
    let mut out = String::new();
    let mut lines = item.lines();
    while let Some(line) = lines.next() {
        let indent = &line[..line.len() - line.trim_start().len()];
        if line.trim() == "/*" {
            let text: Vec<&str> = lines
                .by_ref()
                .take_while(|line| line.trim() != "*/")
                .map(str::trim)
                .collect();
            let text = text.join(&format!("\n{indent} * "));
            for part in [indent, "/* ", &text, " */"] {
                out += part;
            }
        } else {
            out += line;
        }
        out.push('\n');
    }
    out
}
