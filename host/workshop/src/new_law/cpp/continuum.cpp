/* my_law: linear elasticity and von Mises plasticity without hardening, for soft clay.
 *
 * (1) sigma* = sigma_0 + D d_eps                          elastic trial
 * (2) q = sqrt(3/2 s:s) <= Y                              s: deviator of sigma
 * (3) sigma = p 1 + Y/q* s*,  d_eps_p = (q* - Y)/(3 G)    radial return
 *
 * Components 11 22 33 12 [13 23], tension positive, shear strains gamma = 2 eps. */
#include "pilum_law.hpp"

#include <cmath>

class Solid {
public:
    static constexpr const char *name = "von Mises plasticity";
    static constexpr const char *author = "unknown";
    static constexpr const char *licence = "unknown";
    static constexpr const char *doc =
        "Linear elasticity and von Mises plasticity without hardening.";
    static constexpr const char *references = "none";

    /* In the order in which the constructor receives them. */
    static constexpr pilum_parameter parameters[] = {
        pilum::parameter("young_modulus", "E", "kPa", "Young's modulus.")
            .above(0.0)
            .usual(1e2, 1e9),
        pilum::parameter("poisson_ratio", "nu", "-", "Poisson's ratio.")
            .above(-1.0)
            .below(0.5)
            .usual(0.0, 0.495),
        pilum::parameter("yield_stress", "Y", "kPa",
                         "Strength in uniaxial compression, twice the undrained shear strength.")
            .above(0.0)
            .usual(1.0, 1e6),
    };

    enum { plastic_strain };
    static constexpr pilum_variable states[] = {
        pilum::state("plastic_strain", "eps_p", "-", "Equivalent plastic strain."),
    };

    static constexpr pilum_formulation formulations[] = {
        pilum::plane_strain(states, PILUM_T_SYMMETRIC),
        pilum::axisymmetric(states, PILUM_T_SYMMETRIC),
        pilum::three_d(states, PILUM_T_SYMMETRIC),
    };

    /* Each value is within its bounds. Throw pilum::Refusal("id", "why") if they do not go together. */
    explicit Solid(const double *p)
        : k(p[0] / (3.0 * (1.0 - 2.0 * p[1]))), g(p[0] / (2.0 * (1.0 + p[1]))), yield(p[2]) {}

    /* One point over one increment. No allocation, no output, nothing remembered between calls. */
    pilum_status update(const pilum_point &point, pilum_tangent tangent, pilum_response &end) const {
        const double *d_eps = point.increment;
        /* (1) */
        double bulk = (k - 2.0 * g / 3.0) * (d_eps[0] + d_eps[1] + d_eps[2]);
        for (uint32_t i = 0; i < point.n; i++) {
            end.flux[i] = point.flux[i] + (i < 3 ? bulk + 2.0 * g * d_eps[i] : g * d_eps[i]);
        }
        double mean = (end.flux[0] + end.flux[1] + end.flux[2]) / 3.0;
        double s[PILUM_MAX_COMPONENTS];
        double square = 0.0;
        for (uint32_t i = 0; i < point.n; i++) {
            s[i] = i < 3 ? end.flux[i] - mean : end.flux[i];
            square += i < 3 ? s[i] * s[i] : 2.0 * s[i] * s[i];
        }
        double q = std::sqrt(1.5 * square);
        end.state[plastic_strain] = point.state[plastic_strain];
        /* (2), (3); what was returned before is within round-off. */
        bool yields = q > yield * (1.0 + 1e-14);
        double scale = yields ? yield / q : 1.0;
        if (yields) {
            end.state[plastic_strain] += (q - yield) / (3.0 * g);
            for (uint32_t i = 0; i < point.n; i++) {
                end.flux[i] = scale * s[i] + (i < 3 ? mean : 0.0);
            }
        }
        if (tangent == PILUM_TANGENT_NONE) {
            return PILUM_OK;
        }
        bool plastic = yields && tangent == PILUM_TANGENT_CONSISTENT;
        double shear = plastic ? scale * g : g;
        for (uint32_t i = 0; i < point.n; i++) {
            for (uint32_t j = 0; j < point.n; j++) {
                double d = i < 3 && j < 3 ? k - 2.0 * shear / 3.0 : 0.0;
                if (i == j) {
                    d += i < 3 ? 2.0 * shear : shear;
                }
                if (plastic) {
                    d -= 3.0 * shear * s[i] * s[j] / (q * q);
                }
                end.tangent[i * point.n + j] = d;
            }
        }
        return PILUM_OK;
    }

private:
    /* Bulk and shear modulus, yield stress, kPa. */
    double k, g, yield;
};

PILUM_EXPORT_LAW(Solid, "my_law", "0.1.0")
