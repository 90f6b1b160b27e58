//! `output.mesh_error`: the estimated error of the strains against the true one.
//!
//! Goal        effectivity (estimate over true error) near 1, closer on finer meshes.
//! Geometry    hollow sphere with curved sides, thick cylinder; quads and triangles; the cases of the verification
//!             manual.
//! Law         elastic, ν = 0.3 and 0.4999.
//! Asserts     effectivity between 0.5 and 2 with more than two elements between the walls, between 0.9 and 1.1 on
//!             the finest quads; shares of elements add up.
//!
//! The true error is integrated here, with shape functions and a Gauss rule of this file, from the
//! displacements of the nodes and the closed form.

use crate::setup::{Results, elastic, fail, run};
use serde_json::Value;
use std::path::Path;
use tempfile::TempDir;
use tests::case::Silent;

const YOUNG: f64 = 3e4;
const PRESSURE: f64 = 100.0;
/// Points of the Gauss rule with five, and weights.
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// Strains 11, 22, 33, γ12 at (r, z).
type Strains = dyn Fn([f64; 2]) -> [f64; 4];

/// Hollow sphere, radii 1 and 2: displacements f(R) x with f = A + B/R³.
fn sphere(nu: f64) -> Box<Strains> {
    let scale = PRESSURE / (YOUNG * 7.0);
    let (a, b) = (scale * (1.0 - 2.0 * nu), scale * (1.0 + nu) * 4.0);
    Box::new(move |[r, z]| {
        let radius = r.hypot(z);
        let f = a + b / radius.powi(3);
        let slope = -3.0 * b / radius.powi(5);
        [f + slope * r * r, f + slope * z * z, f, 2.0 * slope * r * z]
    })
}

/// Thick cylinder, radii 1 and 2: u = k ((1 − 2ν) r + 4/r).
fn cylinder(nu: f64) -> Box<Strains> {
    let k = PRESSURE / 3.0 * (1.0 + nu) / YOUNG;
    Box::new(move |[r, _]| {
        let (even, odd) = (k * (1.0 - 2.0 * nu), k * 4.0 / (r * r));
        [even - odd, 0.0, even + odd, 0.0]
    })
}

/// Shape functions of an element with 8 or 6 nodes as polynomials, and derivatives by differences that are exact
/// for polynomials of third degree.
fn shape(n: usize, at: [f64; 2]) -> Vec<f64> {
    let [xi, eta] = at;
    if n == 6 {
        let l = [1.0 - xi - eta, xi, eta];
        let corners = l.iter().map(|l| l * (2.0 * l - 1.0));
        return corners
            .chain((0..3).map(|i| 4.0 * l[i] * l[(i + 1) % 3]))
            .collect();
    }
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let corners = corners.map(|[a, b]| {
        let (x, y) = (a * xi, b * eta);
        0.25 * (1.0 + x) * (1.0 + y) * (x + y - 1.0)
    });
    let across = |b: f64| 0.5 * (1.0 - xi * xi) * (1.0 + b * eta);
    let along = |a: f64| 0.5 * (1.0 - eta * eta) * (1.0 + a * xi);
    let middles = [across(-1.0), along(1.0), across(1.0), along(-1.0)];
    corners.into_iter().chain(middles).collect()
}

fn slopes(n: usize, at: [f64; 2]) -> Vec<[f64; 2]> {
    let along = |c: usize| {
        let moved = |by: f64| {
            let mut there = at;
            there[c] += by;
            shape(n, there)
        };
        let (near, far) = ([moved(-0.5), moved(0.5)], [moved(-1.0), moved(1.0)]);
        let of = |i: usize| {
            let (near, far) = (near[1][i] - near[0][i], 0.5 * (far[1][i] - far[0][i]));
            (4.0 * near - far) / 3.0
        };
        (0..n).map(of).collect::<Vec<f64>>()
    };
    let (xi, eta) = (along(0), along(1));
    xi.into_iter().zip(eta).map(|(a, b)| [a, b]).collect()
}

/// Points of an element and their weights.
fn rule(n: usize) -> Vec<([f64; 2], f64)> {
    let pairs = GAUSS
        .iter()
        .flat_map(|a| GAUSS.iter().map(move |b| (*a, *b)));
    pairs
        .map(|((a, v), (b, w))| {
            if n == 8 {
                return ([a, b], v * w);
            }
            let x = 0.5 * (1.0 + a);
            ([x, 0.5 * (1.0 + b) * (1.0 - x)], 0.25 * v * w * (1.0 - x))
        })
        .collect()
}

/// Numbers of an array of a file, by the text before them.
fn numbers(text: &str, before: &str) -> Vec<f64> {
    let (_, rest) = text.split_once(before).unwrap();
    let (_, rest) = rest.split_once('>').unwrap();
    let (inside, _) = rest.split_once('<').unwrap();
    inside
        .split_whitespace()
        .map(|n| n.parse().unwrap())
        .collect()
}

/// ∫ |ε − ε_exact|² and ∫ |ε_exact|², both over 2π.
fn of_element(places: &[[f64; 2]], moved: &[[f64; 2]], exact: &Strains) -> [f64; 2] {
    let n = places.len();
    let mut sums = [0.0; 2];
    for (at, weight) in rule(n) {
        let (values, slopes) = (shape(n, at), slopes(n, at));
        let sum = |of: &dyn Fn(usize) -> f64| (0..n).map(of).sum::<f64>();
        let here = [0, 1].map(|c| sum(&|i| values[i] * places[i][c]));
        let [[a, b], [c, d]] =
            [0, 1].map(|k| [0, 1].map(|l| sum(&|i| places[i][k] * slopes[i][l])));
        let determinant = a * d - b * c;
        let gradient = |i: usize| {
            let [xi, eta] = slopes[i];
            [
                (d * xi - c * eta) / determinant,
                (a * eta - b * xi) / determinant,
            ]
        };
        let slope = |k: usize, l: usize| sum(&|i| moved[i][k] * gradient(i)[l]);
        let hoop = sum(&|i| values[i] * moved[i][0]) / here[0];
        let found = [slope(0, 0), slope(1, 1), hoop, slope(0, 1) + slope(1, 0)];
        let exact = exact(here);
        let off = [0, 1, 2, 3].map(|c| found[c] - exact[c]);
        let square = |e: [f64; 4]| e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + 0.5 * e[3] * e[3];
        let weight = weight * determinant * here[0];
        sums[0] += weight * square(off);
        sums[1] += weight * square(exact);
    }
    sums
}

/// The true relative error of a folder's only fields, and the shares that they have for its elements.
fn true_error(folder: &Path, exact: &Strains) -> (f64, Vec<f64>) {
    let text = std::fs::read_to_string(folder.join("fields_00000.vtu")).unwrap();
    let planar = |before: &str| -> Vec<[f64; 2]> {
        let all = numbers(&text, before);
        all.chunks_exact(3).map(|v| [v[0], v[1]]).collect()
    };
    let (places, moved) = (
        planar("<Points><DataArray"),
        planar("Name=\"displacement\""),
    );
    let nodes = numbers(&text, "Name=\"connectivity\"");
    let mut start = 0;
    let mut sums = [0.0; 2];
    for end in numbers(&text, "Name=\"offsets\"") {
        let own = &nodes[start..end as usize];
        start = end as usize;
        let of = |all: &[[f64; 2]]| own.iter().map(|n| all[*n as usize]).collect::<Vec<_>>();
        let [error, strains] = of_element(&of(&places), &of(&moved), exact);
        sums[0] += error;
        sums[1] += strains;
    }
    let shares = numbers(&text, "Name=\"mesh_error\"");
    ((sums[0] / sums[1]).sqrt(), shares)
}

/// Estimated over true error of every variant of a case of the manual that is named.
fn effectivity(case: &str, variants: &[(&str, Box<Strains>)]) -> Vec<f64> {
    let manual = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases/verification");
    let settings = ["output.mesh_error=true", "output.fields=\"phases\""].map(str::to_owned);
    let cases = input::Case::load_with(&manual.join(case), &settings).unwrap();
    let measured = variants.iter().map(|(variant, exact)| {
        let of_name = |case: &&input::Case| case.variant.as_deref() == Some(*variant);
        let case = cases.iter().find(of_name).unwrap();
        let folder = TempDir::new().unwrap();
        runs::run::run(case, folder.path(), &mut Silent::default()).unwrap();
        let summary = std::fs::read_to_string(folder.path().join("summary.json")).unwrap();
        let summary: Value = serde_json::from_str(&summary).unwrap();
        let of_phase = &summary["mesh_error"][0];
        assert_eq!(of_phase["phase"], "press");
        let estimated = of_phase["strains"].as_f64().unwrap();
        let (exact, shares) = true_error(folder.path(), exact);
        let squares: f64 = shares.iter().map(|share| share * share).sum();
        assert!((squares.sqrt() / estimated - 1.0).abs() < 1e-9, "{squares}");
        estimated / exact
    });
    measured.collect()
}

#[test]
fn it_is_the_error_of_a_hollow_sphere() {
    for nu in [0.3, 0.4999] {
        let of = |mesh: &str| format!("{mesh}_nu_{nu}");
        let names = [
            "quads_2",
            "quads_4",
            "quads_8",
            "triangles_4",
            "triangles_8",
        ]
        .map(of);
        let variants = names.each_ref().map(|name| (name.as_str(), sphere(nu)));
        let found = effectivity("thick_sphere/case.toml", &variants);
        let [two, four, eight, coarse, fine] = found[..] else {
            panic!("{found:?}")
        };
        // With two elements between the walls a polynomial of second degree is further off than the
        // strains: more is said than there is.
        assert!((1.0..3.0).contains(&two), "{found:?}");
        for effectivity in [four, eight, coarse, fine] {
            assert!((0.5..2.0).contains(&effectivity), "{found:?}");
        }
        assert!(
            (eight - 1.0).abs() < 0.1 && (fine - 1.0).abs() < 0.1,
            "{found:?}"
        );
    }
}

#[test]
fn it_is_the_error_of_a_thick_cylinder() {
    for nu in [0.3, 0.4999] {
        let names = ["n4", "n8"].map(|mesh| format!("nu_{nu}_{mesh}"));
        let variants = names.each_ref().map(|name| (name.as_str(), cylinder(nu)));
        let mut found = effectivity("thick_cylinder/case.toml", &variants);
        let name = format!("nu_{nu}");
        let triangles = [(name.as_str(), cylinder(nu))];
        found.extend(effectivity("thick_cylinder/triangles.toml", &triangles));
        for effectivity in &found {
            assert!((0.5..2.0).contains(effectivity), "{found:?}");
        }
    }
}

/// Uniform strains in each of two groups, which differ: recovered by group there is no error.
#[test]
fn a_jump_between_groups_is_no_error() {
    let text = format!(
        r#"
analysis = "plane_strain"
supports = [{{ line = "bottom", fixed = ["y"] }}, {{ line = "left", fixed = ["x"] }}, {{ line = "right", fixed = ["x"] }}]
mesh.columns = [{{ n = 3, to = 1.0 }}]
mesh.rows = [{{ n = 3, to = 1.0 }}, {{ n = 3, to = 2.0 }}]
mesh.region = [{{ group = "soft" }}, {{ group = "stiff", y = [1.0, 2.0] }}]
mesh.lines = {{ bottom = {{ y = 0.0 }}, top = {{ y = 2.0 }}, left = {{ x = 0.0 }}, right = {{ x = 1.0 }} }}
[laws]
{}{}
[groups]
soft = {{ formulation = "solid", law = "soft" }}
stiff = {{ formulation = "solid", law = "stiff" }}
[[phase]]
name = "press"
increments = 1
pressure = [{{ line = "top", value = 100.0 }}]
[output]
mesh_error = true
"#,
        elastic("soft", 1e4, 0.3),
        elastic("stiff", 1e6, 0.2)
    );
    let summary = run(&text).summary();
    let of_phase = &summary["mesh_error"][0];
    assert!(of_phase["strains"].as_f64().unwrap() < 1e-9, "{of_phase}");
    assert_eq!(of_phase["groups"][1]["linear"], true);
    // Not asked for, it is not there.
    let summary = run(&text.replacen("mesh_error = true", "", 1)).summary();
    assert!(summary["mesh_error"].is_null());
}

/// A joint, and what is absent, have no estimate: their share is no number that an error could be. A run whose
/// first phase fails says that none was found.
#[test]
fn no_estimate_is_not_taken_for_no_error() {
    let text = r#"
analysis = "plane_strain"
supports = [{ line = "bottom", fixed = ["x", "y"] }]
[mesh]
columns = [{ n = 3, to = 1.0 }]
rows = [{ n = 2, to = 1.0 }, { n = 2, to = 2.0 }]
region = [{ group = "lower" }, { group = "upper", y = [1.0, 2.0] }]
lines = { bottom = { y = 0.0 }, top = { y = 2.0 }, seam = { y = 1.0 } }
[laws]
soil = { law = "elastic", parameters = { young_modulus = 1e4, poisson_ratio = 0.3 } }
joint = { law = "coulomb_joint", parameters = { normal_stiffness = 1e6, shear_stiffness = 1e6, cohesion = 0.0, friction_angle = 20.0, dilatancy_angle = 0.0 } }
[groups]
lower = { formulation = "solid", law = "soil" }
upper = { formulation = "solid", law = "soil" }
seam = { formulation = "zero_thickness", line = "seam", law = "joint" }
[[phase]]
name = "press"
increments = 1
pressure = [{ line = "top", value = 10.0 }]
[output]
mesh_error = true
fields = "phases"
[solver]
max_halvings = 0
"#;
    let finished = run(text);
    let vtu = std::fs::read_to_string(finished.folder().join("fields_00000.vtu")).unwrap();
    let (groups, shares) = (
        numbers(&vtu, "Name=\"group\""),
        numbers(&vtu, "Name=\"mesh_error\""),
    );
    assert_eq!(groups.len(), shares.len());
    for (group, share) in groups.iter().zip(&shares) {
        assert_eq!(*group > 1.0, *share < 0.0, "group {group}: {share}");
    }
    // The upper block has no friction to hold it against a pull.
    let lifted = text.replace("value = 10.0", "value = -10.0");
    let failed = fail(&lifted);
    assert_eq!(failed.error.exit_code(), 2);
    assert_eq!(failed.summary()["mesh_error"], serde_json::json!([]));
}
