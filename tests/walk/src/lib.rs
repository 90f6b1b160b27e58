//! Laws of interfaces led along paths, for their own tests.
#![expect(
    clippy::missing_panics_doc,
    clippy::unwrap_used,
    reason = "part of the tests, which panic to fail"
)]

use abi::{Failure, InterfaceLaw, InterfacePoint, InterfaceResponse, Tangent};

/// A law at one point on a path. Tractions in kPa, jumps in m; tension and opening positive.
#[derive(Clone, Copy, Debug)]
pub struct Walker<L: InterfaceLaw> {
    /// The law.
    pub law: L,
    /// Traction so far, normal first.
    pub traction: [f64; 2],
    /// Internal variables so far.
    pub state: L::State,
}

impl<L: InterfaceLaw + Copy> Walker<L> {
    /// A point that carries this traction.
    pub fn new(law: L, traction: [f64; 2]) -> Self {
        let state = law.initial_state(&traction).unwrap();
        Self {
            law,
            traction,
            state,
        }
    }

    /// The response to an increment of the jump; the point stays where it is.
    ///
    /// # Errors
    /// The law's.
    pub fn respond(
        &self,
        jump_increment: [f64; 2],
        tangent: Tangent,
    ) -> Result<InterfaceResponse<L::State>, Failure> {
        let point = InterfacePoint {
            jump: [0.0; 2],
            jump_increment,
            traction: self.traction,
            state: self.state,
            time: 0.0,
            time_increment: 1.0,
            step_time: 0.0,
        };
        self.law.update(&point, tangent)
    }

    /// Takes an increment. The tangent of it.
    pub fn step(&mut self, jump_increment: [f64; 2]) -> [[f64; 2]; 2] {
        let end = self.respond(jump_increment, Tangent::Consistent).unwrap();
        self.traction = end.traction;
        self.state = end.state;
        end.tangent
    }

    /// The end of a jump in `n` equal increments.
    #[must_use]
    pub fn walk(mut self, jump: [f64; 2], n: u32) -> Self {
        for _ in 0..n {
            self.step(jump.map(|j| j / f64::from(n)));
        }
        self
    }
}

/// A linear congruential generator (Knuth's MMIX constants), uniform in [a, b).
pub fn random(seed: &mut u64, a: f64, b: f64) -> f64 {
    *seed = seed
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    a + (b - a) * (*seed >> 11) as f64 / (1_u64 << 53) as f64
}
