//! Analysis and factorisation where nodes do not lie on a grid, by number of unknowns: items are
//! unknowns. Wall-clock time. `operations` prints what orders cost, instead of timing them; `again`
//! SIZE COUNT factorises 8-node quads on a grid COUNT times, for profilers.
#![allow(
    clippy::expect_used,
    clippy::print_stdout,
    reason = "a bench stops at the first fault, and prints"
)]

#[path = "../tests/meshes/mod.rs"]
mod meshes;

use algebra::{Kind, Multifrontal, Pattern};
use divan::Bencher;
use divan::counter::ItemsCount;
use meshes::Mesh;
use std::time::Instant;

/// Cells along a side: 12 800 to 200 000 unknowns of triangles.
const SIZES: [usize; 5] = [40, 56, 80, 112, 158];

/// Makes a mesh with this number of cells along a side.
type Make = fn(usize) -> Mesh;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let again = arguments.iter().position(|argument| argument == "again");
    if let Some(at) = again {
        let number = |at: usize| arguments.get(at)?.parse().ok();
        let (size, count) = (number(at + 1), number(at + 2));
        repeat(size.unwrap_or(40), count.unwrap_or(100));
    } else if arguments.iter().any(|argument| argument == "operations") {
        operations();
    } else {
        divan::main();
    }
}

fn analysed(pattern: &Pattern, lines: Option<&[[u32; 2]]>) -> Multifrontal {
    let kept = vec![false; pattern.n()];
    Multifrontal::new(pattern, Kind::Unsymmetric, &kept, lines).expect("a sound pattern")
}

/// A table: unknowns, operations, and seconds of the best of three.
fn operations() {
    println!("mesh,unknowns,lines,operations,analysis (s),factorisation (s)");
    let meshes: [(&str, Make); 5] = [
        ("8-node grid", meshes::grid),
        ("triangles on a grid", meshes::regular),
        ("scattered triangles", meshes::scattered),
        ("scattered 8-node quads", meshes::scattered_quads),
        ("graded triangles", meshes::graded),
    ];
    for (name, make) in meshes {
        for size in SIZES {
            let mesh = make(size);
            let (pattern, lines) = (mesh.pattern(), mesh.lines());
            let values = meshes::values(&pattern, 0.0);
            for with_lines in [true, false] {
                let lines = with_lines.then_some(lines.as_slice());
                let mut factors = analysed(&pattern, lines);
                let mut best = [f64::INFINITY; 2];
                for _ in 0..3 {
                    let start = Instant::now();
                    factors = analysed(&pattern, lines);
                    best[0] = best[0].min(start.elapsed().as_secs_f64());
                    let start = Instant::now();
                    factors.factorise(&values).expect("a regular matrix");
                    best[1] = best[1].min(start.elapsed().as_secs_f64());
                }
                let (n, operations) = (pattern.n(), factors.operations());
                let [analysis, factorisation] = best;
                println!(
                    "{name},{n},{with_lines},{operations:.3e},{analysis:.3},{factorisation:.3}"
                );
            }
        }
    }
}

/// Factorises and solves again and again; the last line says what one took.
fn repeat(size: usize, count: usize) {
    let mesh = meshes::grid(size);
    let pattern = mesh.pattern();
    let values = meshes::values(&pattern, 0.0);
    let mut factors = analysed(&pattern, Some(&mesh.lines()));
    let right: Vec<f64> = (0..pattern.n()).map(|i| ((13 * i) % 7) as f64).collect();
    let mut seconds = [Vec::new(), Vec::new()];
    for _ in 0..count {
        let start = Instant::now();
        factors.factorise(&values).expect("a regular matrix");
        seconds[0].push(start.elapsed().as_secs_f64());
        let start = Instant::now();
        let (y, kept) = factors.forward(&right, None);
        std::hint::black_box(factors.backward(&y, &kept, None));
        seconds[1].push(start.elapsed().as_secs_f64());
    }
    let [factorisation, solution] = seconds.map(|mut of| {
        of.sort_by(f64::total_cmp);
        (1e3 * of[0], 1e3 * of[count / 2])
    });
    println!(
        "{} unknowns, {:.3e} operations; ms, least and median: factorisation {:.2} {:.2}, solution {:.2} {:.2}",
        pattern.n(),
        factors.operations(),
        factorisation.0,
        factorisation.1,
        solution.0,
        solution.1
    );
}

/// Order and supernodes, mesh lines given.
#[divan::bench(args = SIZES, sample_size = 1, sample_count = 5)]
fn analysis(bencher: Bencher<'_, '_>, size: usize) {
    let mesh = meshes::scattered(size);
    let (pattern, lines) = (mesh.pattern(), mesh.lines());
    bencher
        .counter(ItemsCount::new(pattern.n()))
        .bench_local(|| analysed(&pattern, Some(&lines)));
}

fn factorise(bencher: Bencher<'_, '_>, mesh: &Mesh) {
    let pattern = mesh.pattern();
    let values = meshes::values(&pattern, 0.0);
    let mut factors = analysed(&pattern, Some(&mesh.lines()));
    bencher
        .counter(ItemsCount::new(pattern.n()))
        .bench_local(|| factors.factorise(&values).expect("a regular matrix"));
}

/// L U on shifted nodes numbered at random.
#[divan::bench(args = SIZES, sample_size = 1, sample_count = 5)]
fn scattered(bencher: Bencher<'_, '_>, size: usize) {
    factorise(bencher, &meshes::scattered(size));
}

/// L U on nodes that are close together in a corner.
#[divan::bench(args = SIZES, sample_size = 1, sample_count = 5)]
fn graded(bencher: Bencher<'_, '_>, size: usize) {
    factorise(bencher, &meshes::graded(size));
}

/// L U of the same triangles on a grid.
#[divan::bench(args = SIZES, sample_size = 1, sample_count = 5)]
fn regular(bencher: Bencher<'_, '_>, size: usize) {
    factorise(bencher, &meshes::regular(size));
}
