/* The law of models/coulomb_joint in C++; its LAW.md has the equations. */
#include "pilum_law.hpp"

#include <algorithm>
#include <cmath>

class CoulombJoint {
public:
    static constexpr const char *name = "Coulomb joint in C++";
    static constexpr const char *author = "The Pilum authors";
    static constexpr const char *licence = "MIT OR Apache-2.0";
    static constexpr const char *doc = "Linear elasticity, Coulomb friction with constant "
                                       "dilatancy, brittle tensile strength and separation.";
    static constexpr const char *references = "De Gennaro & Frank, Table IV (2)";

    static constexpr pilum_parameter parameters[] = {
        pilum::parameter("normal_stiffness", "K_n", "kPa/m", "Normal stiffness.")
            .above(0.0)
            .usual(1e3, 1e12),
        pilum::parameter("shear_stiffness", "K_t", "kPa/m", "Shear stiffness.")
            .above(0.0)
            .usual(1e3, 1e12),
        pilum::parameter("cohesion", "c", "kPa", "Cohesion, until the joint has opened.")
            .at_least(0.0)
            .usual(0.0, 1e3),
        pilum::parameter("friction_angle", "phi", "deg", "Friction angle.")
            .at_least(0.0)
            .below(90.0)
            .usual(0.0, 50.0),
        pilum::parameter("dilatancy_angle", "psi", "deg", "Dilatancy angle.")
            .at_least(0.0)
            .below(90.0)
            .usual(0.0, 30.0),
        pilum::parameter("tensile_strength", "R_t", "kPa",
                         "Tensile strength, until the joint has opened.")
            .at_least(0.0)
            .usual(0.0, 1e3)
            .otherwise(0.0),
    };

    enum { plastic_slip, plastic_opening, gap, broken };
    static constexpr pilum_variable states[] = {
        pilum::state("plastic_slip", "xi", "m", "Plastic slip, accumulated over both directions."),
        pilum::state("plastic_opening", "[u_n^p]", "m", "Plastic opening by dilatancy."),
        pilum::state("gap", "g", "m",
                     "Opening beyond the position of contact without stress; 0 in contact."),
        pilum::state("broken", "b", "-",
                     "1 once the joint has opened, which breaks its bond; 0 before."),
    };

    static constexpr pilum_formulation formulations[] = {pilum::interface_2d(states)};

    explicit CoulombJoint(const double *p)
        : k_n(p[0]), k_t(p[1]), intact{p[2], p[5], tan_deg(p[3]), tan_deg(p[4])},
          separated{0.0, 0.0, intact.tan_phi, intact.tan_psi} {
        if (p[4] > p[3]) {
            throw pilum::Refusal("dilatancy_angle", std::to_string(p[4]) +
                                                        " deg is above friction_angle = " +
                                                        std::to_string(p[3]) + " deg");
        }
        if (intact.tensile * intact.tan_phi > intact.cohesion * (1.0 + 1e-12)) {
            throw pilum::Refusal("tensile_strength",
                                 std::to_string(p[5]) +
                                     " kPa is above cohesion / tan(friction_angle) = " +
                                     std::to_string(intact.cohesion / intact.tan_phi) + " kPa");
        }
    }

    pilum_status update(const pilum_point &point, pilum_tangent tangent,
                        pilum_response &end) const {
        carry(point, end);
        if (tangent == PILUM_TANGENT_ELASTIC) {
            const double elastic[] = {k_n, 0.0, 0.0, k_t};
            std::copy(elastic, elastic + 4, end.tangent);
        }
        return PILUM_OK;
    }

private:
    struct Strength {
        double cohesion, tensile, tan_phi, tan_psi;
    };
    double k_n, k_t;
    Strength intact, separated;

    static double tan_deg(double angle) { return std::tan(angle * std::acos(-1.0) / 180.0); }

    /* The joint is open at the end: no traction, no stiffness. */
    static void open(double at, pilum_response &end) {
        end.state[gap] = at;
        end.state[broken] = 1.0;
    }

    void carry(const pilum_point &point, pilum_response &end) const {
        double opening = point.increment[0], slip = point.increment[1];
        double start[2] = {point.flux[0], point.flux[1]};
        /* d slip / d jump: slip before the contact re-forms does not act. */
        double by_normal = 0.0, by_tangential = 1.0;
        const Strength *s = point.state[broken] > 0.5 ? &separated : &intact;
        const double wide = point.state[gap];
        std::copy(point.state, point.state + 4, end.state);
        if (wide > 0.0) {
            if (wide + opening >= 0.0) {
                return open(wide + opening, end);
            }
            /* Contact re-forms on the way; the path within the increment is straight. */
            const double fraction = 1.0 + wide / opening;
            by_normal = -slip * wide / (opening * opening);
            by_tangential = fraction;
            start[0] = start[1] = 0.0;
            opening += wide;
            slip *= fraction;
            s = &separated;
        }
        /* Eq. (1). */
        double normal = start[0] + k_n * opening;
        double shear = start[1] + k_t * slip;
        double a = k_n, b = 0.0, c = 0.0, d = k_t;
        /* Eq. (2). */
        const double excess = std::fabs(shear) + normal * s->tan_phi - s->cohesion;
        const double round_off = 4.0 * std::numeric_limits<double>::epsilon() *
                                 (s->cohesion + std::fabs(normal * s->tan_phi));
        if (excess > round_off || normal > s->tensile) {
            /* Eq. (4), (3). */
            const double resistance = k_t + k_n * s->tan_phi * s->tan_psi;
            double d_lambda = std::max(excess, 0.0) / resistance;
            normal -= k_n * s->tan_psi * d_lambda;
            const bool opens = normal > s->tensile || s->cohesion - normal * s->tan_phi < 0.0;
            if (opens) {
                d_lambda = slip_before_opening(*s, start, opening, slip);
            }
            end.state[plastic_slip] += d_lambda;
            end.state[plastic_opening] += s->tan_psi * d_lambda;
            if (opens) {
                return open(std::max(start[0] / k_n + opening - s->tan_psi * d_lambda, 0.0), end);
            }
            const double sign = std::copysign(1.0, shear);
            shear = sign * (s->cohesion - normal * s->tan_phi);
            /* Eq. (5). */
            a = k_n * k_t / resistance;
            b = -sign * a * s->tan_psi;
            c = -sign * a * s->tan_phi;
            d = a * s->tan_phi * s->tan_psi;
        }
        end.state[gap] = 0.0;
        end.flux[0] = normal;
        end.flux[1] = shear;
        end.tangent[0] = a + b * by_normal;
        end.tangent[1] = b * by_tangential;
        end.tangent[2] = c + d * by_normal;
        end.tangent[3] = d * by_tangential;
    }

    /* Slip from the start of the increment to the moment when t_n reaches the tensile strength,
     * Eq. (6): rates are constant before and after yielding. */
    double slip_before_opening(const Strength &s, const double *start, double opening,
                               double slip) const {
        const double normal_rate = k_n * opening, shear_rate = k_t * slip;
        const double opens_elastically =
            start[0] < s.tensile && normal_rate > 0.0 ? (s.tensile - start[0]) / normal_rate : 0.0;
        double yields = std::numeric_limits<double>::infinity(), growth = 0.0;
        for (double sign : {1.0, -1.0}) {
            const double from = sign * start[1] + start[0] * s.tan_phi - s.cohesion;
            const double rate = sign * shear_rate + normal_rate * s.tan_phi;
            const double at = from >= 0.0 ? 0.0 : -from / rate;
            if (rate > 0.0 && at < yields) {
                yields = at;
                growth = rate;
            }
        }
        if (opens_elastically <= yields) {
            return 0.0;
        }
        const double slip_rate = growth / (k_t + k_n * s.tan_phi * s.tan_psi);
        const double opening_rate = normal_rate - k_n * s.tan_psi * slip_rate;
        const double left = s.tensile - start[0] - yields * normal_rate;
        return opening_rate > 0.0 && left > 0.0 ? slip_rate * left / opening_rate : 0.0;
    }
};

PILUM_EXPORT_LAW(CoulombJoint, "coulomb_joint_cpp", "0.1.0")
