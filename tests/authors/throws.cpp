/* A law that throws wherever it can. */
#include "pilum_law.hpp"

#include <stdexcept>

class Throws {
public:
    static constexpr const char *name = "throws";
    static constexpr const char *author = "The Pilum authors";
    static constexpr const char *licence = "MIT OR Apache-2.0";
    static constexpr const char *doc = "Throws.";
    static constexpr const char *references = "none";
    static constexpr pilum_parameter parameters[] = {
        pilum::parameter("strange", "s", "-", "1: refused; 2: a defect; 3: throws later.")};
    static constexpr pilum_variable states[] = {pilum::state("idle", "i", "-", "Not used.")};
    static constexpr pilum_formulation formulations[] = {pilum::interface_2d(states)};

    explicit Throws(const double *p) {
        if (p[0] < 1.5) {
            throw pilum::Refusal("strange", "it is 1");
        }
        if (p[0] < 2.5) {
            throw std::runtime_error("no memory");
        }
    }

    pilum_status update(const pilum_point &, pilum_tangent, pilum_response &) const {
        throw std::out_of_range("out of range");
    }
};

PILUM_EXPORT_LAW(Throws, "throws", "1.0")
