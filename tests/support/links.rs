//! Links of pages lead to files and headings that are there.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// All pages in a folder, those that are built or hidden left out.
///
/// # Panics
/// If the folder cannot be read.
#[expect(clippy::unwrap_used, reason = "part of the tests")]
pub fn pages(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        if path.is_dir() {
            if name != "target" && name != "results" && !name.starts_with('.') {
                pages(&path, found);
            }
        } else if path.extension().is_some_and(|suffix| suffix == "md") {
            found.push(path);
        }
    }
}

/// Lines outside of fenced blocks.
fn prose(page: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut is_code = false;
    page.lines().enumerate().filter(move |(_, line)| {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        !is_code && !is_fence
    })
}

/// The anchor of a heading, if no other is called like it.
pub fn anchor(heading: &str) -> String {
    let heading = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = |c: &char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_');
    let anchor: String = heading.chars().filter(kept).collect();
    anchor.replace(' ', "-")
}

/// Anchors of a page's headings, as hosts of repositories make them.
fn anchors(page: &str) -> Vec<String> {
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    prose(page)
        .filter(|(_, line)| line.starts_with('#'))
        .map(|(_, line)| {
            let anchor = anchor(line);
            let before = seen.entry(anchor.clone()).or_default();
            *before += 1;
            match *before {
                1 => anchor,
                n => format!("{anchor}-{}", n - 1),
            }
        })
        .collect()
}

/// Targets of the links of a line.
fn targets(line: &str) -> impl Iterator<Item = &str> {
    line.split("](")
        .skip(1)
        .filter_map(|rest| rest.split_once(')').map(|(target, _)| target))
}

/// How many links the pages below a folder have to others, and those that lead nowhere.
///
/// # Panics
/// If a page cannot be read.
#[expect(clippy::unwrap_used, reason = "part of the tests")]
pub fn followed(folder: &Path) -> (usize, Vec<String>) {
    let mut found = Vec::new();
    pages(folder, &mut found);
    let (mut broken, mut links) = (Vec::new(), 0);
    for path in &found {
        let text = fs::read_to_string(path).unwrap();
        for (number, line) in prose(&text) {
            for target in targets(line) {
                if target.contains("://") || target.contains("mailto:") {
                    continue;
                }
                links += 1;
                let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
                let to = match file {
                    "" => path.clone(),
                    file => path.parent().unwrap().join(file),
                };
                let is_there = match (to.exists(), anchor) {
                    (exists, "") => exists,
                    (exists, anchor) => {
                        exists
                            && anchors(&fs::read_to_string(&to).unwrap())
                                .contains(&anchor.to_owned())
                    }
                };
                if !is_there {
                    broken.push(format!("{}:{}: {target}", path.display(), number + 1));
                }
            }
        }
    }
    (links, broken)
}

#[cfg(test)]
mod tests {
    use super::anchors;

    #[test]
    fn anchors_are_those_of_the_host() {
        let page = "# The paper's figures\n```\n# none\n```\n## A law in C, C++ or Fortran\n## A\n## A\n## `x_y`: E–F\n";
        let wanted = [
            "the-papers-figures",
            "a-law-in-c-c-or-fortran",
            "a",
            "a-1",
            "x_y-ef",
        ];
        assert_eq!(anchors(page), wanted);
    }
}
