//! Can the file be opened, and is it of this contract?

use super::{Check, Found, Subject, failed, skipped, warned};
use law::probe;
use object::{Architecture, BinaryFormat, Object, ObjectKind, ObjectSection};

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "file-is-a-library",
        description: "The file is a shared library for this system and processor. Nothing is run.",
        needs: &[],
        run: file_is_a_library,
    },
    Check {
        id: "library-opens",
        description: "The library opens, and all symbols it needs are found.",
        needs: &["file-is-a-library"],
        run: library_opens,
    },
    Check {
        id: "handshake-is-accepted",
        description: "`pilum_magic` is there and fits this host.",
        needs: &["library-opens"],
        run: handshake_is_accepted,
    },
    Check {
        id: "entry-is-idempotent",
        description: "`pilum_entry` returns the same pointer again, from another thread, and to \
                      a host with a longer description.",
        needs: &["handshake-is-accepted"],
        run: entry_is_idempotent,
    },
    Check {
        id: "exports-are-hidden",
        description: "The library exports only the symbols of the contract, or of UMAT, MFront \
                      or CalculiX; others could disturb other libraries (warning).",
        needs: &["file-is-a-library"],
        run: exports_are_hidden,
    },
    Check {
        id: "manifest-matches",
        description: "A manifest lists the laws of the description with their versions.",
        needs: &["description-is-readable"],
        run: manifest_matches,
    },
];

fn file_is_a_library(subject: &Subject) -> Found {
    let bytes = subject.bytes()?;
    if bytes.is_empty() {
        return Err(failed("the file is empty"));
    }
    let file =
        object::File::parse(&*bytes).map_err(|why| failed(format!("this is no library: {why}")))?;
    let format = if cfg!(target_os = "windows") {
        BinaryFormat::Pe
    } else if cfg!(target_vendor = "apple") {
        BinaryFormat::MachO
    } else {
        BinaryFormat::Elf
    };
    if file.format() != format {
        return Err(failed(format!(
            "the file is of format {:?}, expected {format:?}",
            file.format()
        )));
    }
    let here = match std::env::consts::ARCH {
        "x86_64" => Some(Architecture::X86_64),
        "aarch64" => Some(Architecture::Aarch64),
        _ => None,
    };
    if here.is_some_and(|here| here != file.architecture()) {
        return Err(failed(format!(
            "the library is for {:?}, this machine is {}",
            file.architecture(),
            std::env::consts::ARCH
        )));
    }
    if file.kind() != ObjectKind::Dynamic {
        return Err(failed(format!(
            "the file is of kind {:?}, expected a shared library",
            file.kind()
        )));
    }
    Ok(String::new())
}

fn library_opens(subject: &Subject) -> Found {
    probe::open(&subject.path).map_err(failed)?;
    Ok(String::new())
}

fn handshake_is_accepted(subject: &Subject) -> Found {
    probe::shake_hands(&subject.path).map_err(failed)?;
    Ok(String::new())
}

fn entry_is_idempotent(subject: &Subject) -> Found {
    let [first, second, third] = probe::enter(&subject.path).map_err(failed)?;
    if first == 0 {
        return Err(failed("`pilum_entry` refuses this host: it returned null"));
    }
    if first != second {
        return Err(failed("the second call returned another pointer"));
    }
    if first != third {
        return Err(failed(
            "another thread, with a longer description of the host, got another pointer",
        ));
    }
    Ok(String::new())
}

fn exports_are_hidden(subject: &Subject) -> Found {
    let bytes = subject.bytes()?;
    let file = object::File::parse(&*bytes).map_err(|why| failed(why.to_string()))?;
    let exports = file.exports().map_err(|why| failed(why.to_string()))?;
    // Linkers add marks of their own; the system's laws of names reserve underscores for them.
    let names: Vec<String> = exports
        .iter()
        .map(|export| String::from_utf8_lossy(export.name()).into_owned())
        .collect();
    // MFront marks each behaviour by a symbol; all others of it begin with its name.
    let behaviours: Vec<String> = names
        .iter()
        .filter_map(|name| Some(format!("{}_", name.strip_suffix("_mfront_ept")?)))
        .collect();
    let is_known = |name: &str| {
        let ours = [
            "pilum_magic",
            "pilum_entry",
            "pilum_rust_layout",
            "pilum_rust_layout_1_1",
        ];
        let theirs = ["umat", "umat_", "UMAT", "CALCULIX"];
        ours.contains(&name.trim_start_matches('_'))
            || theirs.contains(&name)
            || behaviours
                .iter()
                .any(|behaviour| name.starts_with(behaviour))
    };
    let others: Vec<String> = names
        .iter()
        .filter(|name| !is_known(name) && !name.starts_with('_'))
        .cloned()
        .collect();
    if others.is_empty() {
        Ok(String::new())
    } else {
        Err(warned(format!(
            "it exports {} symbols more: {}",
            others.len(),
            others[..others.len().min(5)].join(", ")
        )))
    }
}

fn manifest_matches(subject: &Subject) -> Found {
    let bytes = subject.bytes()?;
    let file = object::File::parse(&*bytes).map_err(|why| failed(why.to_string()))?;
    let section = file
        .section_by_name(".pilum")
        .or_else(|| file.section_by_name("__pilum"))
        .ok_or_else(|| skipped("there is no manifest"))?;
    let data = section.data().map_err(|why| failed(why.to_string()))?;
    let text = std::str::from_utf8(data).map_err(|_| failed("the manifest is not UTF-8"))?;
    let mut lines = text.trim_end_matches('\0').lines();
    if lines.next() != Some("pilum 1") {
        return Err(failed("its first line is not `pilum 1`"));
    }
    let listed: Vec<&str> = lines
        .map(str::trim)
        .filter(|line| !line.is_empty())
        .collect();
    let laws = subject.laws()?;
    let described: Vec<String> = laws
        .iter()
        .map(|law| format!("{} {}", law.description().id, law.description().version))
        .collect();
    for line in &described {
        if !listed.contains(&line.as_str()) {
            return Err(failed(format!("it lacks the line `{line}`")));
        }
    }
    for line in listed {
        if !described.iter().any(|law| law == line) {
            return Err(failed(format!(
                "it lists `{line}`, which the description does not know"
            )));
        }
    }
    Ok(String::new())
}
