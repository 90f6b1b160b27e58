/* Two laws in one library: one with a choice and no internal variables, in the plane and in space, one without
 * parameters. */
#include "pilum_law.hpp"

class Spring {
public:
    static constexpr const char *id = "spring_cpp", *version = "1.0", *name = "elastic interface";
    static constexpr const char *author = "The Pilum authors", *licence = "MIT OR Apache-2.0";
    static constexpr const char *doc = "Elastic.", *references = "none";
    static constexpr const char *kinds[] = {"soft", "stiff", nullptr};
    static constexpr pilum_parameter parameters[] = {
        pilum::parameter("kind", "-", "-", "How stiff it is.").one_of(kinds).otherwise(0.0),
        pilum::parameter("factor", "f", "-", "Factor on the stiffness; 1 if left out.")
            .above(0.0)
            .usual(0.1, 10.0)
            .optional(),
    };
    static constexpr pilum_formulation formulations[] = {
        pilum::interface_2d(PILUM_T_LINEAR), pilum::interface_3d(PILUM_T_LINEAR)};

    explicit Spring(const double *p)
        : k{(p[0] > 0.5 ? 1e6 : 1e3) * (std::isnan(p[1]) ? 1.0 : p[1])} {}

    pilum_status update(const pilum_point &point, pilum_tangent, pilum_response &end) const {
        for (uint32_t i = 0; i < point.n; i++) {
            end.flux[i] = point.flux[i] + k * point.increment[i];
            end.tangent[(point.n + 1) * i] = k;
        }
        return PILUM_OK;
    }

private:
    double k;
};

class Counter {
public:
    static constexpr const char *id = "counter_cpp", *version = "2.0", *name = "stiff interface";
    static constexpr const char *author = "The Pilum authors", *licence = "MIT OR Apache-2.0";
    static constexpr const char *doc = "Elastic; counts how far it has moved from 7 on.";
    static constexpr const char *references = "none";
    static constexpr pilum_variable states[] = {
        pilum::state("travel", "s", "m", "Sum of all movements.").initially(7.0)};
    static constexpr pilum_formulation formulations[] = {pilum::interface_2d(states)};

    explicit Counter(const double *) {}

    pilum_status update(const pilum_point &point, pilum_tangent, pilum_response &end) const {
        end.state[0] = point.state[0];
        for (uint32_t i = 0; i < 2; i++) {
            end.flux[i] = point.flux[i] + 1e5 * point.increment[i];
            end.tangent[3 * i] = 1e5;
            end.state[0] += std::fabs(point.increment[i]);
        }
        return PILUM_OK;
    }
};

PILUM_EXPORT_LAWS(Spring, Counter)
