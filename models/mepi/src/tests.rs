//! The mathematics of the laws, held against truth computed from Eq. (6)-(17) by other means.
#![expect(
    clippy::float_cmp,
    reason = "zeros and unchanged values are compared bit by bit"
)]

mod contact;
mod extremes;
mod paths;
mod scalar_equation;
mod schemes;
mod tangent;
mod truth;

use crate::interface::{Common, SofteningParameters};
use crate::{Mepi, MepiSoftening, State, mepi, mepi_softening};
use abi::substepping::SchemeParameters;
use abi::{Failure, InterfaceLaw, InterfacePoint, InterfaceResponse, Tangent};
use truth::Truth;
use walk::Random;

/// Table IV with the reference pressure that makes it dilate.
const TABLE_4: Common = Common {
    k_n: 0.86e5,
    k_t: 0.37e5,
    n: 0.55,
    mu_0: 0.27,
    mu_p: 0.7,
    mu_c0: 0.46,
    a: 0.008,
    c_0: 40.0,
    t: 2e-3,
    p_0: 100.0,
    sigma_ni: f64::NAN,
};

/// Table II, thickness for L/t = 25.
const TABLE_2: Common = Common {
    k_n: 1e6,
    k_t: 0.5e6,
    n: 0.0,
    mu_0: 0.0,
    mu_p: 0.7,
    mu_c0: 0.4,
    a: 0.008,
    c_0: 19.0,
    t: 4e-4,
    p_0: 100.0,
    sigma_ni: 100.0,
};

/// Default parameters of the scheme.
const IMPLICIT: SchemeParameters = SchemeParameters {
    scheme: 0.0,
    substeps: 10.0,
    scheme_tolerance: 1e-6,
};

/// Table I, Fontainebleau sand, loose.
const FONTAINEBLEAU: mepi_softening::Parameters = mepi_softening::Parameters {
    common: Common {
        k_n: 0.86e5,
        k_t: 0.37e5,
        n: 0.55,
        mu_0: 0.0,
        mu_p: 0.78,
        mu_c0: 0.67,
        a: 0.000_45,
        c_0: 0.05,
        t: 2e-3,
        p_0: 1.0,
        sigma_ni: f64::NAN,
    },
    softening: SofteningParameters {
        mu_r: 0.7,
        a_0: 4.0,
        u_tp: 1.4e-3,
        peak: 0.0,
    },
    scheme: IMPLICIT,
};

/// Table I, silica sand, dense.
const SILICA: mepi_softening::Parameters = mepi_softening::Parameters {
    common: Common {
        k_n: 6e6,
        k_t: 1e6,
        n: 0.0,
        mu_0: 0.0,
        mu_p: 0.81,
        mu_c0: 0.49,
        a: 0.000_06,
        c_0: 0.05,
        t: 6e-3,
        p_0: 1.0,
        sigma_ni: f64::NAN,
    },
    softening: SofteningParameters {
        mu_r: 0.6,
        a_0: 12.0,
        u_tp: 4.3e-4,
        peak: 0.0,
    },
    scheme: IMPLICIT,
};

fn published(p: mepi_softening::Parameters) -> mepi_softening::Parameters {
    let softening = SofteningParameters {
        peak: 1.0,
        ..p.softening
    };
    mepi_softening::Parameters { softening, ..p }
}

fn mepi(common: Common) -> Mepi {
    mepi_by(IMPLICIT, common)
}

fn mepi_by(scheme: SchemeParameters, common: Common) -> Mepi {
    Mepi::new(mepi::Parameters { common, scheme }).unwrap()
}

fn softening(p: mepi_softening::Parameters) -> MepiSoftening {
    MepiSoftening::new(p).unwrap()
}

/// Parameters over many decades.
fn random_parameters(random: &mut Random) -> (Common, SofteningParameters) {
    let mu_p = random.between(0.05, 1.5);
    let common = Common {
        k_n: random.decades(1.0, 1e12),
        k_t: random.decades(1.0, 1e12),
        n: random.unit(),
        mu_0: mu_p * (random.unit() - 0.3).max(0.0),
        mu_p,
        mu_c0: mu_p * random.unit(),
        a: random.decades(1e-6, 1e3),
        c_0: random.decades(1e-6, 1e3),
        t: random.decades(1e-4, 1e-1),
        p_0: if random.unit() < 0.5 { 1.0 } else { 100.0 },
        sigma_ni: f64::NAN,
    };
    let softening = SofteningParameters {
        mu_r: mu_p * random.unit(),
        a_0: random.decades(1e-2, 1e3),
        u_tp: random.decades(1e-6, 1e-1),
        peak: f64::from(u8::from(random.unit() < 0.5)),
    };
    (common, softening)
}

/// One integration point on a path. Compression and contraction positive here, as in the paper.
#[derive(Clone)]
struct Walker<'a, L> {
    law: &'a L,
    traction: [f64; 2],
    state: State,
    /// Relative displacement so far: contraction, slip.
    u: [f64; 2],
    /// Σ (`σ_n` d`[u_n^p]` + τ d`[u_t^p]`).
    dissipation: f64,
}

impl<'a, L: InterfaceLaw<State = State>> Walker<'a, L> {
    fn new(law: &'a L, sigma: f64) -> Self {
        let traction = [-sigma, 0.0];
        Self {
            law,
            traction,
            state: law.initial_state(&traction).unwrap(),
            u: [0.0; 2],
            dissipation: 0.0,
        }
    }

    fn sigma(&self) -> f64 {
        -self.traction[0]
    }

    fn tau(&self) -> f64 {
        self.traction[1]
    }

    /// The response to a further contraction and slip.
    fn respond(&self, du: [f64; 2], tangent: Tangent) -> Result<InterfaceResponse<State>, Failure> {
        let point = InterfacePoint {
            jump: [-self.u[0], self.u[1]],
            jump_increment: [-du[0], du[1]],
            traction: self.traction,
            state: self.state,
            time: 0.0,
            time_increment: 1.0,
            step_time: 0.0,
        };
        self.law.update(&point, tangent)
    }

    /// Contracts and slips.
    fn step(&mut self, du: [f64; 2]) {
        let end = self.respond(du, Tangent::Consistent).unwrap();
        self.u = [self.u[0] + du[0], self.u[1] + du[1]];
        let slip = (end.state.plastic_slip - self.state.plastic_slip) * end.traction[1].abs();
        let normal = end.state.plastic_contraction - self.state.plastic_contraction;
        self.dissipation += slip - normal * end.traction[0];
        self.traction = end.traction;
        self.state = end.state;
    }

    /// Slips against a normal spring: `dσ_n` = −stiffness · d`[u_n]`. 0 is constant normal stress.
    fn slip(&mut self, stiffness: f64, du_t: f64) {
        // The contraction rate is below 1, and so is the opening per slip.
        let (mut low, mut high) = (-du_t.abs(), du_t.abs());
        let mut du_n = 0.0;
        for _ in 0..200 {
            let end = self.respond([du_n, du_t], Tangent::Consistent).unwrap();
            let residual = -end.traction[0] - self.sigma() + stiffness * du_n;
            if residual.abs() <= 1e-13 * self.sigma() || high - low < 1e-16 * du_t.abs() {
                return self.step([du_n, du_t]);
            }
            if residual < 0.0 {
                low = du_n;
            } else {
                high = du_n;
            }
            du_n -= residual / (end.tangent[0][0] + stiffness);
            if !(du_n > low && du_n < high) {
                du_n = 0.5 * (low + high);
            }
        }
        panic!("no equilibrium at {:?} {:?}", self.traction, self.state);
    }
}
