//! Are operators, flags and restrictions what they claim to be?

mod axes;
mod rates;
mod rest;
mod signs;
mod slope;
mod tangent;

pub(super) use axes::{routine_agrees_in_the_plane, tangential_directions_are_alike};
pub(super) use rest::{counts, routine_stays_at_rest};
pub(super) use tangent::ddsdde_matches_differences;

use super::Check;

pub(super) const NEEDS: &[&str] = &[
    "repeatable",
    "independent-of-split",
    "independent-of-request",
    "independent-of-first-instance",
    "results-are-finite",
    "writes-stay-inside",
];

pub(super) const CHECKS: &[Check] = &[
    Check {
        id: "tangent-matches-differences",
        description: "The consistent tangent is the derivative of the update within 10⁻⁴ of the \
                      elastic stiffness, on all paths. Exempt are kinks, where differences to \
                      the two sides disagree, and laws that declare an approximate tangent or \
                      none. A little stiffness where the flux does not change is a warning.",
        needs: NEEDS,
        run: tangent::tangent_matches_differences,
    },
    Check {
        id: "rates-match-differences",
        description: "With PILUM_T_RATES, rates of flux and internal variables are the \
                      derivative of the update in random directions, by parameters too, within \
                      10⁻⁶ of the largest term; kinks are exempt.",
        needs: NEEDS,
        run: rates::rates_match_differences,
    },
    Check {
        id: "tangent-symmetry-as-declared",
        description: "With PILUM_T_SYMMETRIC the consistent tangent is symmetric on random \
                      paths.",
        needs: NEEDS,
        run: tangent::tangent_symmetry_as_declared,
    },
    Check {
        id: "linearity-as-declared",
        description: "With PILUM_T_LINEAR one tangent holds for all states and predicts every \
                      update.",
        needs: NEEDS,
        run: tangent::linearity_as_declared,
    },
    Check {
        id: "zero-increment-changes-nothing",
        description: "After an update, a zero increment keeps flux and internal variables, also \
                      300 times. Exempt: laws that depend on time, counters and rates.",
        needs: NEEDS,
        run: rest::zero_increment_changes_nothing,
    },
    Check {
        id: "initial-states-fit",
        description: "A zero increment keeps initial flux and the internal variables that \
                      `init_state` fits to it (warning, since a law may not carry that flux).",
        needs: NEEDS,
        run: rest::initial_states_fit,
    },
    Check {
        id: "hypotheses-agree",
        description: "Plane strain and axisymmetry give the stresses of 3D (without 3D: each \
                      other's); interfaces in two dimensions those of three.",
        needs: NEEDS,
        run: axes::hypotheses_agree,
    },
    Check {
        id: "tangential-axis-is-arbitrary",
        description: "With the tangential axis of an interface reversed, the traction is \
                      reversed (warning, since the `doc` may say otherwise).",
        needs: NEEDS,
        run: axes::tangential_axis_is_arbitrary,
    },
    Check {
        id: "response-is-isotropic",
        description: "In rotated axes a solid gives rotated stresses; it does not with γ = 2ε \
                      taken for ε. PILUM_T_LOCAL_AXES is exempt (warning, since a law may have \
                      directions).",
        needs: NEEDS,
        run: axes::response_is_isotropic,
    },
    Check {
        id: "compression-is-negative",
        description: "A law carries no more shear under tension than under equal compression \
                      (warning, since some may).",
        needs: NEEDS,
        run: signs::compression_is_negative,
    },
    Check {
        id: "angles-are-degrees",
        description: "Parameters in deg do not repeat after 2π, as radians do, nor after 2π · \
                      π/180.",
        needs: NEEDS,
        run: signs::angles_are_degrees,
    },
    Check {
        id: "plastic-work-is-not-negative",
        description: "With a constant elastic operator, flux times inelastic increment is not \
                      negative; laws that depend on time are exempt (warning, since hardening \
                      may release energy).",
        needs: NEEDS,
        run: signs::plastic_work_is_not_negative,
    },
];

/// Lengths of difference steps, relative to the increment.
const LENGTHS: [f64; 3] = [1e-3, 1e-5, 1e-7];
