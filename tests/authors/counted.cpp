/* A law that starts from the number of components that it is told. */
#include "pilum_law.hpp"

class Counted {
public:
    static constexpr const char *name = "counted";
    static constexpr const char *author = "The Pilum authors";
    static constexpr const char *licence = "MIT OR Apache-2.0";
    static constexpr const char *doc = "Elastic; knows how many components there are.";
    static constexpr const char *references = "none";
    static constexpr pilum_variable states[] = {
        pilum::state("components", "n", "-", "Number of components.")};
    static constexpr pilum_formulation formulations[] = {pilum::interface_2d(states),
                                                         pilum::interface_3d(states)};

    explicit Counted(const double *) {}

    pilum_status initial_state(uint32_t n, const double *flux, double *state,
                               const char *&reason) const {
        if (flux[0] > 0.0) {
            reason = "it is pulled";
            return PILUM_E_DOMAIN;
        }
        state[0] = n;
        return PILUM_OK;
    }

    pilum_status update(const pilum_point &point, pilum_tangent, pilum_response &end) const {
        end.state[0] = point.state[0];
        for (uint32_t i = 0; i < point.n; i++) {
            end.flux[i] = point.flux[i] + 1e5 * point.increment[i];
            end.tangent[(point.n + 1) * i] = 1e5;
        }
        return PILUM_OK;
    }
};

PILUM_EXPORT_LAW(Counted, "counted", "1.0")
