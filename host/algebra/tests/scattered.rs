//! Order of elimination and solution where nodes do not lie on a grid.
#![allow(
    clippy::unwrap_used,
    clippy::cast_precision_loss,
    reason = "a test stops at the first fault"
)]

mod meshes;

use algebra::{Kind, LinearSolver, Multifrontal, Pattern};
use meshes::Mesh;
use std::sync::Arc;

/// Operations of the factorisation, with mesh lines or from the pattern alone.
fn operations(mesh: &Mesh, with_lines: bool) -> f64 {
    let (pattern, lines) = (mesh.pattern(), mesh.lines());
    let kept = vec![false; pattern.n()];
    let lines = with_lines.then_some(lines.as_slice());
    let factors = Multifrontal::new(&pattern, Kind::Unsymmetric, &kept, lines);
    factors.unwrap().operations()
}

/// The same triangles cost on shifted nodes without order no more than 1.3 times what they cost on
/// the grid they come from, dissected along its lines.
#[test]
fn scattered_nodes_cost_about_as_much_as_a_grid() {
    for n in [40, 70] {
        let on_grid = operations(&meshes::regular(n), true);
        for with_lines in [true, false] {
            let scattered = operations(&meshes::scattered(n), with_lines);
            assert!(scattered < 1.3 * on_grid, "{n}: {:.2}", scattered / on_grid);
        }
    }
    let on_grid = operations(&meshes::grid(60), true);
    let scattered = operations(&meshes::scattered_quads(60), true);
    assert!(scattered < 1.3 * on_grid, "{:.2}", scattered / on_grid);
}

/// Nested dissection of a plane mesh takes O(n^1.5) operations (George 1973).
#[test]
fn operations_grow_as_those_of_nested_dissection() {
    for mesh in [meshes::scattered, meshes::graded] {
        let (small, large) = (mesh(42), mesh(105));
        let n = |mesh: &Mesh| mesh.positions.len() as f64;
        let operations = |mesh: &Mesh| operations(mesh, true);
        let exponent =
            (operations(&large) / operations(&small)).ln() / (n(&large) / n(&small)).ln();
        assert!(exponent < 1.6, "{exponent:.2}");
    }
}

/// Largest error of a solution whose right-hand side belongs to a known one.
fn error(pattern: &Arc<Pattern>, lines: Option<&[[u32; 2]]>, skew: f64) -> f64 {
    let values = meshes::values(pattern, skew);
    let exact: Vec<f64> = (0..pattern.n())
        .map(|i| ((13 * i) % 7) as f64 - 2.5)
        .collect();
    let mut right = vec![0.0; pattern.n()];
    for column in 0..pattern.n() {
        for at in pattern.places(column) {
            right[pattern.rows[at] as usize] += values[at] * exact[column];
        }
    }
    let mut solver = LinearSolver::new(pattern, skew.abs() < 1e-12, lines).unwrap();
    solver.factorise(values).unwrap();
    let x = solver.solve(&right).unwrap();
    assert_eq!(solver.fallbacks, 0, "the fast method did the work");
    let errors = x.iter().zip(&exact).map(|(x, exact)| (x - exact).abs());
    errors.fold(0.0, f64::max)
}

#[test]
fn solutions_are_right() {
    for mesh in [meshes::scattered(30), meshes::graded(30)] {
        let (pattern, lines) = (Arc::new(mesh.pattern()), mesh.lines());
        for lines in [Some(lines.as_slice()), None] {
            for skew in [0.0, 0.2] {
                let error = error(&pattern, lines, skew);
                assert!(error < 1e-11, "{error:e}");
            }
        }
    }
}

/// Every eliminated unknown is in one front, whatever is kept; condensed and solved, the
/// equations have the solution of the whole.
#[test]
fn condenses_scattered_unknowns() {
    let mesh = meshes::scattered(20);
    let (pattern, lines) = (mesh.pattern(), mesh.lines());
    let kept: Vec<bool> = (0..pattern.n())
        .map(|i| (mesh.positions[i / 2][0] - 0.5).abs() < 0.04)
        .collect();
    let values = meshes::values(&pattern, 0.2);
    let right = vec![1.0; pattern.n()];
    let mut factors = Multifrontal::new(&pattern, Kind::Unsymmetric, &kept, Some(&lines)).unwrap();
    factors.factorise(&values).unwrap();
    let (y, left) = factors.forward(&right, None);
    let n = left.len();
    assert!(n > 40, "a band of nodes is kept: {n}");
    let schur = nalgebra::DMatrix::from_column_slice(n, n, factors.schur());
    let of_kept = schur
        .lu()
        .solve(&nalgebra::DVector::from_vec(left))
        .unwrap();
    let x = factors.backward(&y, of_kept.as_slice(), None);
    let mut residual = right;
    for column in 0..pattern.n() {
        for at in pattern.places(column) {
            residual[pattern.rows[at] as usize] -= values[at] * x[column];
        }
    }
    let largest = residual.iter().fold(0.0_f64, |m, r| m.max(r.abs()));
    assert!(largest < 1e-12, "{largest:e}");
}

#[test]
fn gives_the_same_bits_with_one_thread_and_two() {
    let mesh = meshes::scattered(60);
    let (pattern, lines) = (mesh.pattern(), mesh.lines());
    let kept = vec![false; pattern.n()];
    let values = meshes::values(&pattern, 0.2);
    let solve = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let mut factors =
                Multifrontal::new(&pattern, Kind::Unsymmetric, &kept, Some(&lines)).unwrap();
            factors.factorise(&values).unwrap();
            let (y, kept) = factors.forward(&values[..pattern.n()], None);
            factors.backward(&y, &kept, None)
        })
    };
    assert_eq!(solve(1), solve(2));
}
