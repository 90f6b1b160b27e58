//! Pages as they are outside of the repository: links lead to where their files lie in the archive, and commands are
//! those of the installed program.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Component, Path, PathBuf};

/// Files of the repository, and where they lie in the archive; both are relative.
pub(crate) type Places = BTreeMap<PathBuf, PathBuf>;

/// Folder of the cases. Commands of pages are run in it, or where its `cases` were copied to.
pub(crate) const SHARED: &str = "share/pilum";

/// The mark of a command that does not work outside of the repository.
const ELSEWHERE: &str = "# in the repository";

/// A page of the repository, as it is in the archive.
pub(crate) fn moved(text: &str, page: &Path, places: &Places, repository: &Path) -> String {
    let mut block = None;
    let mut written = String::new();
    for line in text.split_inclusive('\n') {
        if let Some(language) = line.trim_start().strip_prefix("```") {
            block = block.is_none().then(|| language.trim_end());
            written.push_str(line);
        } else if block == Some("sh") {
            written.push_str(&command(line, places));
        } else if block.is_some() {
            written.push_str(line);
        } else {
            written.push_str(&links(line, page, places, repository));
        }
    }
    written
}

/// A line of the shell. Files that lie elsewhere are named there.
fn command(line: &str, places: &Places) -> String {
    let line = line.replace("cargo run --release -- ", "pilum ");
    let (done, remark) = line.split_once(" #").unwrap_or((&line, ""));
    let mut words: Vec<String> = done.split(' ').map(str::to_owned).collect();
    let mut is_elsewhere = false;
    for word in &mut words {
        let path = word.trim_end();
        let moved = places.get(Path::new(path));
        let moved = moved.and_then(|to| to.strip_prefix(SHARED).ok()?.to_str());
        if let Some(moved) = moved {
            *word = word.replace(path, moved);
        } else {
            let first = path.split('/').next().unwrap_or_default();
            is_elsewhere |= matches!(first, "cargo" | "tests" | "host" | "abi" | "models");
        }
    }
    if is_elsewhere {
        let remark = remark.trim();
        let more = if remark.is_empty() { "" } else { ": " };
        return format!("{}   {ELSEWHERE}{more}{remark}\n", done.trim_end());
    }
    let gap = if remark.is_empty() { "" } else { " #" };
    format!("{}{gap}{remark}", words.join(" "))
}

/// A line with its links. A link to a file that the archive lacks becomes its text.
fn links(line: &str, page: &Path, places: &Places, repository: &Path) -> String {
    let mut written = String::new();
    let mut rest = line;
    while let Some(at) = rest.find("](") {
        let (before, after) = rest.split_at(at);
        let Some((target, after)) = after[2..].split_once(')') else {
            break;
        };
        rest = after;
        let (file, anchor) = target.split_at(target.find('#').unwrap_or(target.len()));
        let folder = page.parent().unwrap_or(page);
        let of_repository = normal(&folder.join(file));
        let from = places.get(page).and_then(|place| place.parent());
        match (from, place(&of_repository, places)) {
            (Some(from), Some(to)) if !file.is_empty() => {
                let to = relative(from, &to);
                let _ = write!(written, "{before}]({}{anchor})", to.display());
            }
            _ if !file.is_empty() && repository.join(&of_repository).exists() => {
                written.push_str(&without_bracket(before));
            }
            _ => written.extend([before, "](", target, ")"]),
        }
    }
    written + rest
}

/// A text without the bracket, or mark of a picture, that was open at its end.
fn without_bracket(text: &str) -> String {
    let mut closed = 0;
    for (at, character) in text.char_indices().rev() {
        match character {
            ']' => closed += 1,
            '[' if closed == 0 => {
                let before = text[..at].trim_end_matches('!');
                return format!("{before}{}", &text[at + 1..]);
            }
            '[' => closed -= 1,
            _ => {}
        }
    }
    text.to_owned()
}

/// Place in the archive of a file or folder of the repository.
fn place(path: &Path, places: &Places) -> Option<PathBuf> {
    if let Some(place) = places.get(path) {
        return Some(place.clone());
    }
    let (inner, place) = places.range(path.to_owned()..).next()?;
    let below = inner.strip_prefix(path).ok()?.components().count();
    place.ancestors().nth(below).map(Path::to_owned)
}

/// A path without `.` and `..`.
fn normal(path: &Path) -> PathBuf {
    let mut normal = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => drop(normal.pop()),
            Component::CurDir => {}
            part => normal.push(part),
        }
    }
    normal
}

/// The way from a folder to a file.
fn relative(from: &Path, to: &Path) -> PathBuf {
    let common = from.components().zip(to.components());
    let common = common.take_while(|(a, b)| a == b).count();
    let up = from.components().skip(common).map(|_| Component::ParentDir);
    up.chain(to.components().skip(common)).collect()
}

#[cfg(test)]
mod tests {
    use super::{Places, command, links};
    use std::path::Path;

    fn places() -> Places {
        let pairs = [
            ("host/docs/a.md", "share/doc/pilum/host/docs/a.md"),
            ("host/README.md", "share/doc/pilum/host/README.md"),
            ("cases/b/README.md", "share/pilum/cases/b/README.md"),
            ("tests/c.f90", "share/pilum/cases/b/c.f90"),
        ];
        pairs.map(|(a, b)| (a.into(), b.into())).into()
    }

    const LEFT: &str = "[w](https://a.b/) [h](#here) a[i](x)";

    #[test]
    fn links_lead_to_where_files_lie() {
        let repository = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
        for (line, moved) in [
            ("[up](../README.md#map) x", "[up](../README.md#map) x"),
            (
                "a [`b`](../../cases/b/README.md), [b](../../cases/b/)",
                "a [`b`](../../../../pilum/cases/b/README.md), [b](../../../../pilum/cases/b)",
            ),
            ("see [the [test]](../../tests/README.md)", "see the [test]"),
            ("![p](../../Cargo.toml) q", "p q"),
            (LEFT, LEFT),
        ] {
            let page = Path::new("host/docs/a.md");
            assert_eq!(links(line, page, &places(), repository), moved);
        }
    }

    #[test]
    fn commands_are_those_of_the_installed_program() {
        for (line, moved) in [
            (
                "cargo run --release -- run cases/b   # x",
                "pilum run cases/b   # x",
            ),
            ("cc -o a tests/c.f90", "cc -o a cases/b/c.f90"),
            (
                "A=1 cargo test   # all",
                "A=1 cargo test   # in the repository: all",
            ),
            ("tests/run.sh", "tests/run.sh   # in the repository"),
        ] {
            assert_eq!(
                command(&format!("{line}\n"), &places()),
                format!("{moved}\n")
            );
        }
    }
}
