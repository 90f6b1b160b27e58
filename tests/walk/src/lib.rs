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
    /// Jump since the start.
    pub jump: [f64; 2],
}

impl<L: InterfaceLaw + Copy> Walker<L> {
    /// A point that carries this traction.
    pub fn new(law: L, traction: [f64; 2]) -> Self {
        let state = law.initial_state(&traction).unwrap();
        Self {
            law,
            traction,
            state,
            jump: [0.0; 2],
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
            jump: self.jump,
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
        self.jump = [0, 1].map(|i| self.jump[i] + jump_increment[i]);
        end.tangent
    }

    /// Slips against a normal spring, `Δσ_n` = stiffness · `Δ[u_n]`: Newton's method with bisection.
    pub fn slip(&mut self, stiffness: f64, slip: f64) {
        let sigma = -self.traction[0];
        let (mut low, mut high) = (-2.0 * slip.abs(), 2.0 * slip.abs());
        let mut opening = 0.0;
        for _ in 0..100 {
            let end = self.respond([opening, slip], Tangent::Consistent).unwrap();
            let residual = -end.traction[0] - sigma - stiffness * opening;
            if residual.abs() < 1e-12 * sigma {
                break;
            }
            if residual > 0.0 {
                low = opening;
            } else {
                high = opening;
            }
            opening += residual / (end.tangent[0][0] + stiffness);
            if !(opening > low && opening < high) {
                opening = 0.5 * (low + high);
            }
        }
        self.step([opening, slip]);
    }

    /// The ends of an increment whose component j differs by −2, −1, 1 and 2 times `by`. `None` where the law fails.
    pub fn around(&self, jump: [f64; 2], j: usize, by: f64) -> Option<[Self; 4]> {
        let ends = [-2.0, -1.0, 1.0, 2.0].map(|times| {
            let mut moved = jump;
            moved[j] += times * by;
            self.respond(moved, Tangent::Consistent).ok()?;
            let mut end = *self;
            end.step(moved);
            Some(end)
        });
        ends.iter()
            .all(Option::is_some)
            .then(|| ends.map(Option::unwrap))
    }

    /// Asserts that column j of a tangent is the fourth-order difference of the ends around it, to `bound` of it and of
    /// `least`.
    ///
    /// # Panics
    /// With both numbers, otherwise.
    #[track_caller]
    pub fn assert_column(
        ends: &[Self; 4],
        by: f64,
        (tangent, j): ([[f64; 2]; 2], usize),
        [least, bound]: [f64; 2],
    ) {
        for i in 0..2 {
            let t = ends.map(|end| end.traction[i]);
            let difference = (t[0] - 8.0 * t[1] + 8.0 * t[2] - t[3]) / (12.0 * by);
            let column = tangent[i][j];
            let off = (difference - column).abs();
            assert!(
                off < bound * (column.abs() + least),
                "({i}, {j}) {difference} {column}"
            );
        }
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

/// Uniform numbers from a linear congruential generator (Knuth's MMIX constants).
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// In [a, b).
    pub fn between(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.unit()
    }

    /// In [a, b), uniform in the logarithm.
    pub fn decades(&mut self, a: f64, b: f64) -> f64 {
        a * (b / a).powf(self.unit())
    }

    /// One of these.
    pub fn one_of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[(self.unit() * choices.len() as f64) as usize]
    }
}

/// Uniform in [a, b), from a seed.
pub fn random(seed: &mut u64, a: f64, b: f64) -> f64 {
    let mut random = Random(*seed);
    let number = random.between(a, b);
    *seed = random.0;
    number
}
