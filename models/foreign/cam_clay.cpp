/* Modified Cam-clay in C++; README.md of this folder has the equations. Inside, compression is
 * positive. */
#include "pilum_law.hpp"

#include <cmath>

class CamClay {
public:
    static constexpr const char *id = "cam_clay_cpp";
    static constexpr const char *version = "0.1.0";
    static constexpr const char *name = "modified Cam-clay in C++";
    static constexpr const char *author = "The Pilum authors";
    static constexpr const char *licence = "MIT OR Apache-2.0";
    static constexpr const char *doc =
        "Elliptic yield surface, associated flow, volumetric hardening; swelling at a stiffness "
        "that grows with the mean stress.";
    static constexpr const char *references =
        "Roscoe & Burland, On the generalized stress-strain behaviour of wet clay, 1968";

    static constexpr const char *shear_choices[] = {"poisson_ratio", "shear_modulus", nullptr};
    static constexpr pilum_parameter parameters[] = {
        pilum::parameter("compression_index", "lambda", "-",
                         "Slope of the normal compression line, void ratio over ln p.")
            .above(0.0)
            .usual(0.05, 0.5),
        pilum::parameter("swelling_index", "kappa", "-",
                         "Slope of the swelling line, void ratio over ln p.")
            .above(0.0)
            .usual(0.005, 0.04),
        pilum::parameter("stress_ratio", "M", "-", "Ratio q / p at critical state.")
            .above(0.0)
            .usual(0.6, 1.5),
        pilum::parameter("void_ratio", "e_0", "-", "Void ratio at the start.")
            .above(0.0)
            .usual(0.4, 2.0),
        pilum::parameter("shear", "-", "-", "What the elastic shear stiffness follows from.")
            .one_of(shear_choices)
            .otherwise(0.0),
        pilum::parameter("poisson_ratio", "nu", "-",
                         "Poisson's ratio, for the choice of that name.")
            .at_least(0.0)
            .below(0.5)
            .otherwise(0.3),
        pilum::parameter("shear_modulus", "G", "kPa",
                         "Elastic shear modulus, needed for the choice of that name.")
            .above(0.0)
            .usual(1e3, 1e5)
            .optional(),
        pilum::parameter("overconsolidation_ratio", "OCR", "-",
                         "Size of the yield surface at the start over that of the one through the "
                         "initial stress; normally consolidated if left out.")
            .at_least(1.0)
            .usual(1.0, 10.0)
            .optional(),
    };

    enum { preconsolidation_pressure, void_ratio };
    static constexpr pilum_variable states[] = {
        pilum::state("preconsolidation_pressure", "p_c", "kPa",
                     "Mean stress at which the yield surface ends."),
        pilum::state("void_ratio", "e", "-", "Void ratio.").output_only(),
    };

    static constexpr pilum_formulation formulations[] = {
        pilum::plane_strain(states), pilum::axisymmetric(states), pilum::three_d(states)};

    explicit CamClay(const double *p)
        : slope{p[0]}, swelling{p[1]}, m{p[2]}, e_0{p[3]}, follows_modulus{p[4] > 0.5},
          nu{p[5]}, modulus{p[6]}, ocr{std::isnan(p[7]) ? 1.0 : p[7]} {
        if (swelling >= slope) {
            throw pilum::Refusal("swelling_index", std::to_string(swelling) +
                                                       " is not below compression_index = " +
                                                       std::to_string(slope));
        }
        if (follows_modulus && std::isnan(modulus)) {
            throw pilum::Refusal("shear_modulus", "the choice `shear_modulus` needs it");
        }
    }

    pilum_status initial_state(uint32_t, const double *flux, double *state,
                               const char *&reason) const {
        const Stress start(flux);
        if (!(start.p > 0.0)) {
            reason = "the initial mean stress is not compressive";
            return PILUM_E_DOMAIN;
        }
        // Eq. (6).
        state[preconsolidation_pressure] =
            ocr * (start.p + start.q * start.q / (m * m * start.p));
        state[void_ratio] = e_0;
        return PILUM_OK;
    }

    // For pilum_differentiate: stiffness changes over a strain of kappa / (1 + e_0).
    double difference_size() const { return swelling / (1.0 + e_0); }

    pilum_status update(const pilum_point &point, pilum_tangent tangent,
                        pilum_response &end) const {
        const Stress start(point.flux);
        const double p_c0 = point.state[preconsolidation_pressure];
        if (!(start.p > 0.0 && p_c0 > 0.0)) {
            end.reason = "the mean stress is not compressive";
            return PILUM_E_DOMAIN;
        }
        double compression = 0.0, total = 0.0;
        for (int i = 0; i < 3; i++) {
            compression -= point.increment[i];
            total -= point.gradient[i] + point.increment[i];
        }
        const double v = 1.0 + e_0;
        if (std::fabs(compression) * v / swelling > 5.0) {
            end.reason = "the volume changes too much in one increment";
            end.step_factor = 2.0 * swelling / (v * std::fabs(compression));
            return PILUM_CUT_STEP;
        }
        // Eq. (1), (2): the trial stress.
        const double g = shear(start.p);
        const double p_trial = start.p * std::exp(v / swelling * compression);
        double deviator[PILUM_MAX_COMPONENTS], square = 0.0;
        for (uint32_t i = 0; i < point.n; i++) {
            const bool is_normal = i < 3;
            const double strain = point.increment[i] + (is_normal ? compression / 3.0 : 0.0);
            deviator[i] = point.flux[i] + (is_normal ? start.p : 0.0) +
                          (is_normal ? 2.0 : 1.0) * g * strain;
            square += (is_normal ? 1.5 : 3.0) * deviator[i] * deviator[i];
        }
        const double q_trial = std::sqrt(square);
        // Eq. (3), with what round-off leaves of a point on the surface.
        double p = p_trial, p_c = p_c0, ratio = 1.0;
        if (yield(p_trial, q_trial, p_c0) > 1e-13 * p_c0 * p_c0) {
            ratio = flow(g, q_trial, p, p_c);
        }
        for (uint32_t i = 0; i < point.n; i++) {
            end.flux[i] = ratio * deviator[i] - (i < 3 ? p : 0.0);
        }
        end.state[preconsolidation_pressure] = p_c;
        end.state[void_ratio] = e_0 - v * total;
        if (tangent == PILUM_TANGENT_ELASTIC) {
            const double bulk = v * p / swelling, g1 = shear(p);
            for (uint32_t i = 0; i < point.n; i++) {
                for (uint32_t j = 0; j < point.n; j++) {
                    const bool are_normal = i < 3 && j < 3;
                    end.tangent[i * point.n + j] =
                        (are_normal ? bulk - 2.0 / 3.0 * g1 : 0.0) +
                        (i == j ? (i < 3 ? 2.0 * g1 : g1) : 0.0);
                }
            }
        }
        return PILUM_OK;
    }

private:
    // Mean stress, compression positive, and deviatoric stress. Shear components stand behind the
    // three normal ones; those that a hypothesis does not have are passed as zero.
    struct Stress {
        double p, q;
        explicit Stress(const double *flux) : p(-(flux[0] + flux[1] + flux[2]) / 3.0), q(0.0) {
            for (int i = 0; i < 3; i++) {
                const double s = flux[i] + p;
                q += 1.5 * s * s + 3.0 * flux[3 + i] * flux[3 + i];
            }
            q = std::sqrt(q);
        }
    };

    double shear(double p) const {
        const double bulk = (1.0 + e_0) * p / swelling;
        return follows_modulus ? modulus : 1.5 * bulk * (1.0 - 2.0 * nu) / (1.0 + nu);
    }

    // Eq. (3).
    double yield(double p, double q, double p_c) const {
        return q * q / (m * m) + p * (p - p_c);
    }

    // Returns q / q_trial and carries p, p_c from the trial state onto the yield surface. The one
    // unknown is the plastic volumetric strain as the part y of the one that leads to the critical
    // state, Eq. (7); f(0) > 0 > f(1), and the root is found by Newton's method between bounds.
    double flow(double g, double q_trial, double &p, double &p_c) const {
        const double v = 1.0 + e_0, soft = v / swelling, hard = v / (slope - swelling);
        const double p_trial = p, p_c0 = p_c, c = 6.0 * g / (m * m);
        const double x = std::log(2.0 * p_trial / p_c0) / (soft + hard);
        const double p_critical = p_trial * std::exp(-soft * x);
        double below = 0.0, above = 1.0, y = 0.5, ratio = 1.0;
        for (int i = 0; i < 200; i++) {
            const double left = x * (1.0 - y);
            p = p_critical * std::exp(soft * left);
            p_c = 2.0 * p_critical * std::exp(-hard * left);
            // d = (2 p - p_c) / x, also where x vanishes.
            const double d =
                std::fabs(left) > 1e-9
                    ? 2.0 * p_critical * (std::expm1(soft * left) - std::expm1(-hard * left)) / x
                    : 2.0 * p_critical * (soft + hard) * (1.0 - y);
            const double d_slope = -(2.0 * soft * p + hard * p_c);
            ratio = d / (d + c * y);
            const double q = q_trial * ratio;
            const double f = yield(p, q, p_c);
            (f > 0.0 ? below : above) = y;
            const double by_q =
                q_trial * (d_slope * c * y - d * c) / ((d + c * y) * (d + c * y));
            const double slope_f =
                2.0 * q / (m * m) * by_q - soft * x * p * (2.0 * p - p_c) - hard * x * p * p_c;
            double next = y - f / slope_f;
            if (!(next > below && next < above)) {
                next = 0.5 * (below + above);
            }
            if (std::fabs(next - y) <= 1e-16 || above - below <= 1e-16) {
                break;
            }
            y = next;
        }
        return ratio;
    }

    double slope, swelling, m, e_0;
    bool follows_modulus;
    double nu, modulus, ocr;
};

PILUM_EXPORT_LAWS(CamClay)
