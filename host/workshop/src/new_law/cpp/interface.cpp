/* my_law: an elastic interface with Coulomb friction and separation.
 *
 * (1) t_n = K_n ([u_n] + g),  t_t = t_t0 + K_t [u_t]      trial; g: gap at the start
 * (2) t_n > 0: the interface opens, t = 0, g = t_n / K_n
 * (3) |t_t| <= -t_n tan phi, otherwise it slides
 *
 * Tension and opening are positive. */
#include "pilum_law.hpp"

#include <cmath>

class Joint {
public:
    static constexpr const char *name = "interface with Coulomb friction";
    static constexpr const char *author = "unknown";
    static constexpr const char *licence = "unknown";
    static constexpr const char *doc =
        "Linear elasticity, Coulomb friction without dilatancy, separation.";
    static constexpr const char *references = "none";

    /* In the order in which the constructor receives them. */
    static constexpr pilum_parameter parameters[] = {
        pilum::parameter("normal_stiffness", "K_n", "kPa/m", "Stiffness against closing.")
            .above(0.0)
            .usual(1e3, 1e12),
        pilum::parameter("shear_stiffness", "K_t", "kPa/m", "Stiffness against sliding.")
            .above(0.0)
            .usual(1e3, 1e12),
        pilum::parameter("friction_angle", "phi", "deg", "Friction angle.")
            .at_least(0.0)
            .below(90.0)
            .usual(0.0, 50.0),
    };

    enum { plastic_slip, gap };
    static constexpr pilum_variable states[] = {
        pilum::state("plastic_slip", "xi", "m", "Slip, accumulated over both directions."),
        pilum::state("gap", "g", "m", "Opening; 0 in contact."),
    };

    static constexpr pilum_formulation formulations[] = {pilum::interface_2d(states)};

    /* Each value is within its bounds. Throw pilum::Refusal("id", "why") if they do not go together. */
    explicit Joint(const double *p)
        : k_n(p[0]), k_t(p[1]), tan_phi(std::tan(p[2] * std::acos(-1.0) / 180.0)) {}

    /* One point over one increment. No allocation, no output, nothing remembered between calls. */
    pilum_status update(const pilum_point &point, pilum_tangent tangent, pilum_response &end) const {
        /* (1) In contact the traction carries what is known of the past, open the gap does. */
        double normal = point.flux[0] + k_n * (point.state[gap] + point.increment[0]);
        double shear = point.flux[1] + k_t * point.increment[1];
        bool consistent = tangent == PILUM_TANGENT_CONSISTENT;
        end.tangent[0] = k_n;
        end.tangent[3] = k_t;
        end.state[plastic_slip] = point.state[plastic_slip];
        if (normal > 0.0) { /* (2) */
            end.state[gap] = point.state[gap] + point.increment[0] + point.flux[0] / k_n;
            if (consistent) {
                end.tangent[0] = end.tangent[3] = 0.0;
            }
            return PILUM_OK;
        }
        end.flux[0] = normal;
        end.flux[1] = shear;
        double excess = std::fabs(shear) + normal * tan_phi;
        if (excess > 0.0) { /* (3) */
            double sign = std::copysign(1.0, shear);
            end.flux[1] = -sign * normal * tan_phi;
            end.state[plastic_slip] += excess / k_t;
            if (consistent) {
                end.tangent[2] = -sign * k_n * tan_phi;
                end.tangent[3] = 0.0;
            }
        }
        return PILUM_OK;
    }

private:
    double k_n, k_t, tan_phi;
};

PILUM_EXPORT_LAW(Joint, "my_law", "0.1.0")
