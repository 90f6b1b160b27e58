//! 9-node quads: cases on a grid or on a file of 8-node quads, on the same quads with a node in the middle.
//!
//! The patch tests run on both kinds (`patch.rs`). Here are the cases whose solution is no constant stress.

use crate::footing::{TRESCA, text};
use crate::setup::{Results, fail, run};
use input::Case;
use mechanics::Mesh;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use tempfile::TempDir;
use tests::case::{column, run_case};
use tests::words::has;
use text::Source;
use toml::Value;

/// A case on a grid as one on a file of 9-node quads, which is written to the folder.
pub(crate) fn on_nine_nodes(case: &str, folder: &Path) -> String {
    let mut case: toml::Table = case.parse().unwrap();
    // The grid as it is before interfaces are inserted in it.
    let mut bare = case.clone();
    let is_solid = |group: &Value| group["formulation"].as_str() != Some("zero_thickness");
    let groups = bare["groups"].as_table_mut().unwrap();
    groups.retain(|_, group| is_solid(group));
    bare.remove("probes");
    let source = Source::new("bare.toml", toml::to_string(&bare).unwrap());
    let posed = Case::of(source).unwrap()[0].pose().unwrap();
    let names: Vec<&str> = posed
        .problem
        .groups
        .iter()
        .map(|g| g.name.as_str())
        .collect();
    let file = folder.join("nine.msh");
    fs::write(&file, mesh_file(&posed.problem.mesh, &names)).unwrap();
    let mut mesh = toml::Table::new();
    mesh.insert("file".to_owned(), file.to_str().unwrap().into());
    case.insert("mesh".to_owned(), mesh.into());
    toml::to_string(&case).unwrap()
}

/// A mesh of 8-node quads as a file of Gmsh, format 2.2, with 9-node quads.
fn mesh_file(mesh: &Mesh, groups: &[&str]) -> String {
    let mut nodes = mesh.nodes.clone();
    let mut names = Vec::new();
    let mut elements = Vec::new();
    for (tag, group) in groups.iter().enumerate() {
        names.push((2, *group));
        for solid in mesh.solids.iter().filter(|solid| solid.group == tag) {
            let mut own = solid.nodes().to_vec();
            own.push(nodes.len());
            nodes.push(middle(own[..8].iter().map(|&node| mesh.nodes[node])));
            elements.push((10, names.len(), own));
        }
    }
    for (name, line) in &mesh.lines {
        let edges = line.edges.iter().map(|&edge| (8, mesh.edge(edge).to_vec()));
        let point = line.nodes.first().filter(|_| line.edges.is_empty());
        let parts: Vec<(i32, Vec<usize>)> =
            edges.chain(point.map(|&node| (15, vec![node]))).collect();
        names.push((parts.first().map_or(1, |part| u8::from(part.0 == 8)), name));
        let tag = names.len();
        elements.extend(parts.into_iter().map(|(kind, own)| (kind, tag, own)));
    }
    let mut file = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n".to_owned();
    let _ = writeln!(file, "$PhysicalNames\n{}", names.len());
    for (tag, (dimension, name)) in names.iter().enumerate() {
        let _ = writeln!(file, "{dimension} {} \"{name}\"", tag + 1);
    }
    let _ = writeln!(file, "$EndPhysicalNames\n$Nodes\n{}", nodes.len());
    for (number, [x, y]) in nodes.iter().enumerate() {
        let _ = writeln!(file, "{} {x:?} {y:?} 0", number + 1);
    }
    let _ = writeln!(file, "$EndNodes\n$Elements\n{}", elements.len());
    for (number, (kind, tag, own)) in elements.iter().enumerate() {
        let own: Vec<String> = own.iter().map(|node| (node + 1).to_string()).collect();
        let _ = writeln!(
            file,
            "{} {kind} 2 {tag} {tag} {}",
            number + 1,
            own.join(" ")
        );
    }
    file + "$EndElements\n"
}

/// The middle of an 8-node quad on its own map: half the middles of its sides, less a quarter of its corners.
fn middle(nodes: impl Iterator<Item = [f64; 2]>) -> [f64; 2] {
    nodes.enumerate().fold([0.0; 2], |sum, (i, at)| {
        let part = if i < 4 { -0.25 } else { 0.5 };
        [0, 1].map(|c| sum[c] + part * at[c])
    })
}

/// A mesh file of format 2.2 with its 8-node quads made quads of 9 nodes.
fn with_middles(file: &str) -> String {
    let mut nodes = BTreeMap::new();
    let (mut out, mut section, mut added) = (Vec::new(), "", Vec::new());
    for line in file.lines() {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match (section, words.as_slice()) {
            (_, [name]) if name.starts_with('$') => section = name,
            ("$Nodes", [number, x, y, _]) => {
                let at = [x, y].map(|value| value.parse::<f64>().unwrap());
                nodes.insert(number.parse::<usize>().unwrap(), at);
            }
            ("$Elements", [_, "16", _, _, _, own @ ..]) => {
                let own = own.iter().map(|node| nodes[&node.parse().unwrap()]);
                let number = nodes.len() + added.len() + 1;
                added.push((number, middle(own)));
                let words = [&words[..1], &["10"], &words[2..]].concat();
                out.push(format!("{} {number}", words.join(" ")));
                continue;
            }
            _ => {}
        }
        out.push(line.to_owned());
    }
    assert_eq!(nodes.len(), *nodes.keys().last().unwrap());
    let begin = out.iter().position(|line| line == "$Nodes").unwrap();
    out[begin + 1] = (nodes.len() + added.len()).to_string();
    let end = out.iter().position(|line| line == "$EndNodes").unwrap();
    let lines = added
        .iter()
        .map(|(number, [x, y])| format!("{number} {x:?} {y:?} 0"));
    out.splice(end..end, lines);
    out.join("\n") + "\n"
}

/// A case of `cases/verification` with its 8-node quads made quads of 9 nodes: a folder with the results of each variant
/// in `out`.
fn verified(case: &str) -> TempDir {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases/verification");
    let folder = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(root.join(case)).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        let text = match path.extension().and_then(|ending| ending.to_str()) {
            Some("msh") => with_middles(&fs::read_to_string(&path).unwrap()),
            Some("toml") => fs::read_to_string(&path).unwrap(),
            _ => continue,
        };
        fs::write(folder.path().join(name), text).unwrap();
    }
    run_case(&folder.path().join("case.toml"), &folder.path().join("out")).unwrap();
    folder
}

/// Displacements of the walls against the closed form, on curved sides, nearly incompressible too: the same bounds as
/// of 8-node quads.
#[test]
fn a_hollow_sphere() {
    let (a, b, p, young) = (1.0_f64, 2.0_f64, 100.0, 3e4);
    let folder = verified("thick_sphere");
    for nu in [0.3, 0.4999] {
        let scale = p * a.powi(3) / (young * (b.powi(3) - a.powi(3)));
        let u = |r: f64| scale * ((1.0 - 2.0 * nu) * r + (1.0 + nu) * b.powi(3) / (2.0 * r * r));
        for (mesh, bound) in [("quads_2", 0.003), ("quads_4", 2e-4), ("quads_8", 2e-5)] {
            let variant = format!("{mesh}_nu_{nu}");
            let table = folder.path().join("out").join(&variant).join("history.csv");
            for (wall, r) in [("inner", a), ("outer", b)] {
                let found = *column(&table, wall).last().unwrap();
                let error = found / u(r) - 1.0;
                assert!(error.abs() < bound, "{variant}, {wall}: {error:.1e}");
            }
        }
    }
}

/// Level ground at rest stays so: to rounding with straight sides, and as 8-node quads with `b_bar` on curved ones.
#[test]
fn level_ground() {
    let folder = verified("level_ground");
    for (mesh, bound) in [("straight_quads", 1e-13), ("wave_quads", 1e-4)] {
        for kind in ["", "_plane", "_b_bar", "_plane_b_bar"] {
            let results = folder.path().join("out").join(format!("{mesh}{kind}"));
            let summary = fs::read_to_string(results.join("summary.json")).unwrap();
            let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
            let out = summary["phases"][0]["out_of_balance"].as_f64().unwrap();
            assert!(out < bound, "{mesh}{kind}: {out:.1e}");
        }
    }
}

/// Prandtl's limit load of Tresca's ground, from above, nearer on the finer mesh.
#[test]
fn a_strip_on_tresca() {
    let errors = [4, 8].map(|n| {
        let folder = tempfile::tempdir().unwrap();
        let integration = "projected";
        let footing = text(crate::footing::Footing {
            n,
            integration,
            ..TRESCA
        });
        let finished = run(&on_nine_nodes(&footing, folder.path()));
        finished.last("pressure") / (2.0 + PI) - 1.0
    });
    let [coarse, fine] = errors;
    assert!(
        0.0 < fine && fine < 0.6 * coarse && fine < 0.03,
        "{errors:?}"
    );
}

/// With 2 × 2 points nothing resists three motions of a 9-node quad: refused, with the key.
#[test]
fn reduced_integration_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let footing = text(crate::footing::Footing { n: 4, ..TRESCA });
    let failed = fail(&on_nine_nodes(&footing, folder.path()));
    let said = failed.error.to_string();
    has(&said, "elements of group `ground` have 9 nodes");
}
