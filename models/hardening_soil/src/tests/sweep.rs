//! Random paths from random initial states.

use super::{CLAY, DENSE, Path, law};
use crate::soil::SoilParameters;
use abi::Tangent;

/// Uniform numbers in [0, 1): a 64-bit linear congruential generator (Knuth's constants).
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

#[test]
fn random_paths_succeed() {
    let mut random = Random(1);
    let mut failures = 0;
    let start = std::time::Instant::now();
    let mut slowest = 0.0_f64;
    for n in 0..1000 {
        let p = SoilParameters {
            ocr: random.between(1.0, 4.0),
            ..if n % 2 == 0 { DENSE } else { CLAY }
        };
        let law = law(p);
        let s = random.between(1.0, 300.0);
        let k = random.between(0.4, 2.0);
        let mut path = Path::new(&law, [s, s * k, s * random.between(0.5 * (1.0 + k), k)]);
        for _ in 0..3 {
            let size = 10_f64.powf(random.between(-4.0, -2.0));
            let direction: [f64; 6] = std::array::from_fn(|_| size * random.between(-1.0, 1.0));
            for _ in 0..10 {
                let before = std::time::Instant::now();
                match path.try_update(&direction, Tangent::Consistent) {
                    Ok(end) => path.accept(&direction, &end),
                    Err(failure) => {
                        failures += 1;
                        if failures < 20 {
                            println!("{n} {failure:?} {:?} {direction:?}", path.stress);
                        }
                        break;
                    }
                }
                let took = before.elapsed().as_secs_f64();
                if took > slowest {
                    slowest = took;
                    println!("slow {took:e} {n} {:?} {direction:?}", path.stress);
                }
            }
        }
    }
    println!("{failures} failures, {:?}", start.elapsed());
}
