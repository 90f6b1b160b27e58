//! The consistent tangent against central differences.

use super::{CLAY, DENSE, Path, law};
use crate::HardeningSoil;
use abi::{Failure, Tangent};

fn check(path: &Path<'_, HardeningSoil>, increment: &[f64; 6]) -> Result<f64, Failure> {
    let end = path.try_update(increment, Tangent::Consistent)?;
    let stiffness = path.try_update(increment, Tangent::Elastic)?.tangent[0][0];
    let differences = abi::differences::tangent(increment, 1e-3, |moved| {
        Ok(path.try_update(moved, Tangent::None)?.stress.map(|s| -s))
    })?;
    let mut largest = 0.0_f64;
    for i in 0..6 {
        for j in 0..6 {
            largest = largest.max((end.tangent[i][j] - differences[i][j]).abs() / stiffness);
        }
    }
    if largest > 1e-5 {
        println!("{increment:?}\n{:.0?}\n{:.0?}", end.tangent, differences);
    }
    Ok(largest)
}

#[test]
fn tangents_are_differences() {
    for p in [DENSE, CLAY] {
        let law = law(p);
        for s in [
            [100.0, 100.0, 100.0],
            [150.0, 100.0, 80.0],
            [200.0, 85.0, 80.0],
        ] {
            for increment in [
                [1e-4, 0.0, 0.0, 0.0, 0.0, 0.0],
                [1e-3, -2e-4, -3e-4, 1e-4, 2e-4, 3e-4],
                [3e-3, -1e-3, -1.5e-3, 1e-4, 2e-4, 3e-4],
                [-3e-4, 1e-4, -1e-4, 1e-4, 2e-4, 3e-4],
                [4e-3, 1e-3, 2e-3, 1e-3, 2e-3, 3e-3],
                [5e-4, 4.5e-4, -1e-3, 1e-5, 2e-5, 3e-5],
            ] {
                let path = Path::new(&law, s);
                assert!(
                    check(&path, &increment).unwrap() < 1e-7,
                    "{s:?} {increment:?}"
                );
            }
        }
    }
}
