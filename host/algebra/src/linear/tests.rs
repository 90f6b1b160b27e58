use super::*;

fn two_by_two() -> Arc<Pattern> {
    Arc::new(Pattern {
        column_start: vec![0, 2, 4],
        rows: vec![0, 1, 0, 1],
    })
}

#[test]
fn solves_an_unsymmetric_system() {
    let mut solver = LinearSolver::new(&two_by_two(), false, None).unwrap();
    // Columns (4, 1), (2, 3).
    solver.factorise(vec![4.0, 1.0, 2.0, 3.0]).unwrap();
    let x = solver.solve(&[8.0, 7.0]).unwrap();
    assert!((x[0] - 1.0).abs() < 1e-15 && (x[1] - 2.0).abs() < 1e-15);
    let last = solver.set_aside().unwrap();
    solver.factorise(vec![1.0, 0.0, 0.0, 1.0]).unwrap();
    solver.put_back(last, true).unwrap();
    assert_eq!(solver.solve(&[8.0, 7.0]).unwrap(), x);
}

#[test]
fn falls_back_to_full_row_exchanges() {
    // A zero on the diagonal, in a pivot block of its own: rows must be exchanged across.
    let n = 60;
    let mut pattern = Pattern {
        column_start: vec![0],
        rows: Vec::new(),
    };
    let mut values = Vec::new();
    for column in 0..n {
        for row in [column ^ 1, column] {
            pattern.rows.push(row as u32);
            values.push(if row == column { 1e-30 } else { 2.0 });
        }
        let start = pattern.rows.len() - 2;
        if column % 2 == 0 {
            pattern.rows.swap(start, start + 1);
            values.swap(start, start + 1);
        }
        pattern.column_start.push(pattern.rows.len() as u32);
    }
    let mut solver = LinearSolver::new(&Arc::new(pattern), false, None).unwrap();
    solver.factorise(values).unwrap();
    let x = solver.solve(&vec![1.0; n]).unwrap();
    assert!(x.iter().all(|x| (x - 0.5).abs() < 1e-15));
    let last = solver.set_aside().unwrap();
    solver.put_back(last, true).unwrap();
    assert_eq!(solver.solve(&vec![1.0; n]).unwrap(), x);
}

/// Solves with a block of two equations, the Schur complement of [[4, 1, 1], [1, 3, 0],
/// [1, 0, 3]] without its first equation, on the equations 1 and 2 of three; the first one has
/// this pivot and is coupled with equation 1 by 2.
fn beside_a_block(pivot: f64) -> (Vec<f64>, u64) {
    let domain = Pattern {
        column_start: vec![0, 3, 5, 7],
        rows: vec![0, 1, 2, 0, 1, 0, 2],
    };
    let kept = [false, true, true];
    let mut factors = Multifrontal::new(&domain, Kind::Symmetric, &kept, None).unwrap();
    let values = [4.0, 1.0, 1.0, 1.0, 3.0, 1.0, 3.0];
    factors.factorise(&values).unwrap();
    let block = Block::new(vec![1, 2], Dense::SchurOf(Arc::new(factors)));
    let pattern = Pattern {
        column_start: vec![0, 2, 4, 5],
        rows: vec![0, 1, 0, 1, 2],
    };
    let mut solver = LinearSolver::with_block(&Arc::new(pattern), None, block).unwrap();
    solver.factorise(vec![pivot, 2.0, 2.0, 0.5, 0.25]).unwrap();
    // Twice for the solution that is checked and one that need not be.
    let x = solver.solve(&[1.0, 2.0, 3.0]).unwrap();
    assert_eq!(solver.solve(&[1.0, 2.0, 3.0]).unwrap(), x);
    (x, solver.fallbacks)
}

#[test]
fn solves_beside_a_block() {
    for (pivot, fallbacks) in [(5.0, 0), (0.0, 1)] {
        let (x, fallen_back) = beside_a_block(pivot);
        // S = [[3 − 1/4, −1/4], [−1/4, 3 − 1/4]], and the entries beside it.
        let a = [
            [pivot, 2.0, 0.0],
            [2.0, 2.75 + 0.5, -0.25],
            [0.0, -0.25, 2.75 + 0.25],
        ];
        for (row, b) in a.iter().zip([1.0, 2.0, 3.0]) {
            let product: f64 = row.iter().zip(&x).map(|(a, x)| a * x).sum();
            assert!((product - b).abs() < 1e-14, "{pivot:e}: {x:?}");
        }
        assert_eq!(fallen_back, fallbacks);
    }
}

#[test]
fn an_equation_without_entries_is_singular_without_a_fallback() {
    let mut solver = LinearSolver::new(&two_by_two(), false, None).unwrap();
    assert!(solver.factorise(vec![0.0, 0.0, 2.0, 4.0]).is_err());
    assert!(solver.solve(&[1.0, 1.0]).is_err());
    assert_eq!(solver.fallbacks, 0);
    // The next matrix is one again.
    solver.factorise(vec![1.0, 0.0, 0.0, 1.0]).unwrap();
    assert_eq!(solver.solve(&[1.0, 2.0]).unwrap(), [1.0, 2.0]);
}

#[test]
fn refuses_a_singular_system() {
    let mut solver = LinearSolver::new(&two_by_two(), false, None).unwrap();
    let refused =
        solver.factorise(vec![1.0, 2.0, 2.0, 4.0]).is_err() || solver.solve(&[1.0, 1.0]).is_err();
    assert!(refused);
}
