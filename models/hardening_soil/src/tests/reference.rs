//! Against `reference.csv`, which `reference.py` integrates by other means.

use super::{CLAY, DENSE, Lead, Path, law};
use crate::soil::SoilParameters;

/// Name, parameters, stress at the start, segments.
type Reference = (&'static str, SoilParameters, [f64; 3], Vec<[Lead; 3]>);

/// What `reference.py` calls its paths, with their parameters, overconsolidation and segments.
fn paths() -> Vec<Reference> {
    use Lead::{Strain, Stress};
    let free = Stress(0.0);
    let held = |e| [Strain(e), Strain(0.0), Strain(0.0)];
    let ocr = |p: SoilParameters, ocr| SoilParameters { ocr, ..p };
    let isotropic = [100.0; 3];
    vec![
        (
            "drained_overconsolidated",
            ocr(DENSE, 20.0),
            isotropic,
            vec![[Strain(0.03), free, free]],
        ),
        (
            "drained",
            DENSE,
            isotropic,
            vec![[Strain(0.03), free, free]],
        ),
        (
            "drained_clay",
            CLAY,
            isotropic,
            vec![[Strain(0.05), free, free]],
        ),
        (
            "oedometer",
            DENSE,
            [50.0, 20.0, 20.0],
            vec![held(0.008), held(-0.001), held(0.002)],
        ),
        (
            "oedometer_clay",
            CLAY,
            [50.0, 30.0, 30.0],
            vec![held(0.03), held(-0.005), held(0.01)],
        ),
        (
            "undrained",
            DENSE,
            isotropic,
            vec![[Strain(0.01), Strain(-0.005), Strain(-0.005)]],
        ),
        (
            "undrained_clay",
            ocr(CLAY, 1.5),
            [100.0, 60.0, 60.0],
            vec![[Strain(0.03), Strain(-0.015), Strain(-0.015)]],
        ),
        (
            "extension",
            ocr(DENSE, 1.5),
            isotropic,
            vec![[Strain(-0.01), free, free]],
        ),
        (
            "lateral",
            CLAY,
            [100.0, 80.0, 60.0],
            vec![[Strain(0.03), free, Strain(-0.01)]],
        ),
        (
            "plane",
            DENSE,
            [100.0, 70.0, 60.0],
            vec![[Strain(0.02), Strain(0.0), free]],
        ),
    ]
}

/// The largest difference of stresses over the largest stress, and of p_p and γ_ps over theirs, for a number of
/// increments between two points of the reference.
fn error(
    name: &str,
    p: SoilParameters,
    s: [f64; 3],
    segments: &[[Lead; 3]],
    increments: u32,
) -> f64 {
    let law = law(p);
    let mut path = Path::new(&law, s);
    let rows: Vec<Vec<f64>> = include_str!("reference.csv")
        .lines()
        .filter_map(|line| line.strip_prefix(name)?.strip_prefix(','))
        .map(|line| line.split(',').map(|x| x.parse().unwrap()).collect())
        .collect();
    assert!(rows.len() == 1 + 10 * segments.len(), "{name}");
    let mut largest = 0.0_f64;
    for (i, row) in rows.iter().enumerate() {
        if i > 0 {
            path.go(segments[(i - 1) / 10].map(|l| l.times(0.1)), increments);
        }
        let size = row[2..5].iter().fold(0.0_f64, |x, y| x.max(*y));
        let strain = row[5..8].iter().fold(1e-6_f64, |x, y| x.max(y.abs()));
        for c in 0..3 {
            largest = largest.max((path.stress[c] - row[2 + c]).abs() / size);
            largest = largest.max((path.strain[c] - row[5 + c]).abs() / strain);
        }
        largest = largest.max((path.state.p_p / row[8] - 1.0).abs());
        largest = largest.max((path.state.gamma_ps - row[9]).abs() / (row[9] + 1e-6));
    }
    largest
}

/// The reference itself is off by some 1e-4, where its stress meets an edge.
#[test]
fn points_of_another_integration_are_met() {
    for (name, p, s, segments) in paths() {
        for (increments, bound) in [(1, 2e-2), (4, 1e-3), (16, 4e-4)] {
            let error = error(name, p, s, &segments, increments);
            assert!(error < bound, "{name}, {increments}: {error:e}");
        }
    }
}
