//! The rooms of the host, as `host/README.md` draws them, and as their manifests have them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use tests::words::words;

/// For every room the rooms that it is on.
type Arrows = BTreeMap<String, BTreeSet<String>>;

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn read(path: &str) -> String {
    let path = root().join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|why| panic!("{}: {why}", path.display()))
}

/// Names between backticks.
fn quoted(cell: &str) -> BTreeSet<String> {
    let parts = cell.split('`').skip(1).step_by(2);
    parts.map(str::to_owned).collect()
}

/// The table of `host/README.md`: room, and what it is on.
fn drawn(page: &str) -> Arrows {
    let rows = page
        .lines()
        .skip_while(|line| !line.starts_with("| room | stands on |"))
        .skip(2)
        .take_while(|line| line.starts_with('|'));
    let cells = rows.map(|row| row.split('|').skip(1).map(str::trim).collect::<Vec<_>>());
    cells
        .map(|cells| {
            let room = quoted(cells[0]).pop_first().unwrap();
            (room, quoted(cells[1]))
        })
        .collect()
}

/// Dependencies of a manifest, those for tests and benches left out.
fn dependencies(manifest: &str) -> BTreeSet<String> {
    let manifest: toml::Table = manifest.parse().unwrap();
    let own = manifest.get("dependencies").into_iter();
    let targets = manifest.get("target").and_then(toml::Value::as_table);
    let of_targets = targets.into_iter().flat_map(toml::Table::values);
    let tables = own.chain(of_targets.filter_map(|target| target.get("dependencies")));
    let tables = tables.filter_map(toml::Value::as_table);
    tables.flat_map(|table| table.keys().cloned()).collect()
}

/// The rooms, by their manifests.
fn built() -> Arrows {
    let folders = std::fs::read_dir(root().join("host")).unwrap();
    let mut manifests: BTreeMap<String, String> = folders
        .filter_map(|entry| {
            let name = entry.unwrap().file_name().into_string().unwrap();
            let manifest = std::fs::read_to_string(root().join(format!("host/{name}/Cargo.toml")));
            Some((name, manifest.ok()?))
        })
        .collect();
    manifests.insert("host".to_owned(), read("host/Cargo.toml"));
    let rooms: BTreeSet<String> = manifests.keys().cloned().collect();
    let arrows = manifests.iter().map(|(room, manifest)| {
        let all = dependencies(manifest);
        (room.clone(), all.intersection(&rooms).cloned().collect())
    });
    arrows.collect()
}

#[test]
fn the_drawing_is_what_is_built() {
    assert_eq!(drawn(&read("host/README.md")), built());
}

/// Every row stands below those that it is on: `cargo` forbids a circle, this a row out of place.
#[test]
fn the_table_goes_one_way() {
    let page = read("host/README.md");
    let arrows = drawn(&page);
    assert!(arrows.len() > 8, "{arrows:?}");
    let place = |room: &String| page.find(&format!("\n| `{room}` |")).unwrap();
    for (room, below) in &arrows {
        for other in below {
            assert!(place(other) < place(room), "`{room}` stands on `{other}`");
        }
    }
}

/// The contract is on nothing of ours, and what imitates other programs on the contract alone.
#[test]
fn the_contract_stands_alone() {
    let ours = |manifest: &str| -> BTreeSet<String> {
        let all = dependencies(&read(manifest));
        let mut rooms: BTreeSet<String> = built().into_keys().collect();
        rooms.extend(["abi".to_owned(), "bridges".to_owned()]);
        all.intersection(&rooms).cloned().collect()
    };
    assert!(ours("abi/Cargo.toml").is_empty());
    assert_eq!(ours("abi/bridges/Cargo.toml"), ["abi".to_owned()].into());
}

#[test]
fn an_arrow_that_is_not_drawn_is_found() {
    let mut more = built();
    more.get_mut("algebra").unwrap().insert("input".to_owned());
    assert_ne!(drawn(&read("host/README.md")), more);
    let manifest = "[dependencies]\nlaw.workspace = true\n[target.'cfg(unix)'.dependencies]\n\
                    text.workspace = true\n[dev-dependencies]\ninput.workspace = true\n";
    assert_eq!(
        dependencies(manifest),
        ["law".to_owned(), "text".to_owned()].into()
    );
}

/// Every crate with its features, as `cargo` builds it for these packages. Where crates cannot be had: `None`, with a remark.
fn features(of: &[&str]) -> Option<BTreeSet<String>> {
    let tree = ["tree", "--prefix", "none", "--edges", "normal,build"];
    let arguments = [&tree[..], &["--format", "{p} [{f}]"], of].concat();
    let text = tests::needs::of_cargo(root(), &arguments, "some crate of another build")?;
    let lines = text.lines();
    let lines = lines.map(|line| line.replace(" (*)", "").replace(" (proc-macro)", ""));
    Some(lines.filter(|line| !line.is_empty()).collect())
}

/// A crate that one command builds with other features than another is compiled once for each of them, and all that
/// is on it.
#[test]
fn what_is_built_for_the_program_serves_all() {
    let all = features(&["--workspace"]).unwrap();
    assert!(all.len() > 150, "{}", all.len());
    // With what libFuzzer needs alone.
    let of_libfuzzer =
        words("arbitrary cc find-msvc-tools fuzz jobserver libc libfuzzer-sys shlex");
    let fuzz: [&str; 4] = ["-p", "fuzz", "--features", "libfuzzer"];
    for (part, alone) in [
        (&[][..], &[][..]),
        (&["-p", "pilum-python"], &[]),
        (&fuzz, &of_libfuzzer),
    ] {
        let Some(own) = features(part) else {
            continue;
        };
        let name = |line: &str| line.split(' ').next().unwrap_or_default().to_owned();
        let more = own.difference(&all);
        let more: Vec<&String> = more
            .filter(|line| !alone.contains(&name(line).as_str()))
            .collect();
        assert!(more.is_empty(), "{part:?}: {more:#?}");
    }
}
