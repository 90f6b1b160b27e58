// A cohesive zone in the shape that MFront's generic interface prescribes, written by hand after its specification
// (abi/interoperability.md says why): nothing is shared with the export in abi/bridges/src/mfront.rs.
//
// Mode by mode, w = (<u_n>^2 + u_t^2)^(1/2), W its largest value so far: with damage d = W_f (W - W_0)/(W (W_f - W_0))
// between W_0 and W_f, t = (1 - d) K u; a closed zone carries t_n = K_n u_n. Forces depend on totals only.
#include <algorithm>
#include <cmath>
#include <cstdio>

struct InitialState {
    const double *gradients, *thermodynamic_forces, *mass_density, *material_properties, *internal_state_variables,
        *stored_energy, *dissipated_energy, *external_state_variables;
};
struct State {
    const double *gradients;
    double *thermodynamic_forces;
    const double *mass_density, *material_properties;
    double *internal_state_variables, *stored_energy, *dissipated_energy;
    const double *external_state_variables;
};
struct BehaviourData {
    char *error_message;
    double dt, *K, *rdt, *speed_of_sound;
    InitialState s0;
    State s1;
};
static_assert(sizeof(BehaviourData) == 168, "as the specification says");

#define SYMBOL extern "C" __attribute__((visibility("default")))

SYMBOL const char *const BrittleZone_mfront_ept = "BrittleZone";
SYMBOL const char *const BrittleZone_mfront_interface = "Generic";
SYMBOL const char *const BrittleZone_author = "Nobody in particular";
SYMBOL const char *const BrittleZone_description = "Cohesive zone with linear softening";
SYMBOL const unsigned short BrittleZone_mfront_mkt = 1;
SYMBOL const unsigned short BrittleZone_api_version = 1;
SYMBOL const unsigned short BrittleZone_BehaviourType = 3;
SYMBOL const unsigned short BrittleZone_BehaviourKinematic = 2;
SYMBOL const unsigned short BrittleZone_SymmetryType = 0;
SYMBOL const unsigned short BrittleZone_ElasticSymmetryType = 0;
SYMBOL const unsigned short BrittleZone_nModellingHypotheses = 2;
SYMBOL const char *const BrittleZone_ModellingHypotheses[2] = {"PlaneStrain", "Tridimensional"};
SYMBOL const unsigned short BrittleZone_nGradients = 1;
SYMBOL const char *const BrittleZone_Gradients[1] = {"OpeningDisplacement"};
SYMBOL const int BrittleZone_GradientsTypes[1] = {2};
SYMBOL const unsigned short BrittleZone_nThermodynamicForces = 1;
SYMBOL const char *const BrittleZone_ThermodynamicForces[1] = {"CohesiveForce"};
SYMBOL const int BrittleZone_ThermodynamicForcesTypes[1] = {2};
SYMBOL const unsigned short BrittleZone_nTangentOperatorBlocks = 2;
SYMBOL const char *const BrittleZone_TangentOperatorBlocks[2] = {"CohesiveForce", "OpeningDisplacement"};
SYMBOL const unsigned short BrittleZone_nMaterialProperties = 2;
SYMBOL const char *const BrittleZone_MaterialProperties[2] = {"NormalStiffness", "TangentialStiffness"};
SYMBOL const unsigned short BrittleZone_nInternalStateVariables = 2;
SYMBOL const char *const BrittleZone_InternalStateVariables[2] = {"Damage", "LargestOpening"};
SYMBOL const int BrittleZone_InternalStateVariablesTypes[2] = {0, 0};
SYMBOL const unsigned short BrittleZone_TemperatureRemovedFromExternalStateVariables = 1;
SYMBOL const unsigned short BrittleZone_nExternalStateVariables = 0;
SYMBOL const unsigned short BrittleZone_nParameters = 3;
SYMBOL const char *const BrittleZone_Parameters[3] = {"OnsetOpening", "FinalOpening", "LargestDamageIncrement"};
SYMBOL const int BrittleZone_ParametersTypes[3] = {0, 0, 0};
SYMBOL const double BrittleZone_OnsetOpening_ParameterDefaultValue = 1e-5;
SYMBOL const double BrittleZone_FinalOpening_ParameterDefaultValue = 1e-4;
SYMBOL const double BrittleZone_LargestDamageIncrement_ParameterDefaultValue = 1;
SYMBOL const long double BrittleZone_NormalStiffness_LowerPhysicalBound = 0;
SYMBOL const long double BrittleZone_TangentialStiffness_LowerPhysicalBound = 0;
SYMBOL const long double BrittleZone_TangentialStiffness_UpperBound = 1e9L;
SYMBOL const unsigned short BrittleZone_requiresStiffnessTensor = 0;
SYMBOL const unsigned short BrittleZone_requiresThermalExpansionCoefficientTensor = 0;
SYMBOL const unsigned short BrittleZone_ComputesInternalEnergy = 0;
SYMBOL const unsigned short BrittleZone_ComputesDissipatedEnergy = 0;
SYMBOL const unsigned short BrittleZone_nInitializeFunctions = 0;
SYMBOL const unsigned short BrittleZone_nPostProcessings = 0;

static double parameters[3] = {1e-5, 1e-4, 1};

SYMBOL int BrittleZone_setParameter(const char *name, const double value) {
    for (int i = 0; i < 3; ++i) {
        const char *known = BrittleZone_Parameters[i], *given = name;
        while (*known && *known == *given) ++known, ++given;
        if (!*known && !*given) {
            parameters[i] = value;
            return 1;
        }
    }
    return 0;
}

template <int N>
static int integrate(BehaviourData &data) {
    const double request = data.K[0];
    const double w_0 = parameters[0], w_f = parameters[1];
    const double k_n = data.s1.material_properties[0], k_t = data.s1.material_properties[1];
    if (!(data.s0.external_state_variables[0] > 0)) {
        std::snprintf(data.error_message, 512, "the temperature is not above 0 K");
        return -1;
    }
    const bool predicts = request < -0.25;
    const double *u = predicts ? data.s0.gradients : data.s1.gradients;
    double w = u[0] > 0 ? u[0] * u[0] : 0;
    for (int i = 1; i < N; ++i) w += u[i] * u[i];
    w = std::sqrt(w);
    const double largest = std::max(data.s0.internal_state_variables[1], w);
    const double before = data.s0.internal_state_variables[0];
    double damage = before, slope = 0;  // slope: d damage / d w
    if (largest > w_0) {
        const double now = std::min(1.0, w_f * (largest - w_0) / (largest * (w_f - w_0)));
        if (now > damage) {
            damage = now;
            if (w >= largest && damage < 1) slope = w_f * w_0 / (largest * largest * (w_f - w_0));
        }
    }
    if (damage - before > parameters[2]) {
        *data.rdt = std::min(*data.rdt, 0.5);
        std::snprintf(data.error_message, 512, "the damage grows by %g in %.17g", damage - before, data.dt);
        return -1;
    }
    if (!predicts) {
        for (int i = 0; i < N; ++i) {
            const double k = i ? k_t : k_n, whole = i || u[0] > 0 ? 1 - damage : 1;
            data.s1.thermodynamic_forces[i] = whole * k * u[i];
        }
        data.s1.internal_state_variables[0] = damage;
        data.s1.internal_state_variables[1] = largest;
    }
    if (std::abs(request) < 0.25) return 1;
    const bool elastic = std::abs(request) < 1.5;
    for (int i = 0; i < N; ++i)
        for (int j = 0; j < N; ++j) {
            const double k = i ? k_t : k_n, whole = elastic || (!i && u[0] <= 0) ? 1 : 1 - damage;
            double value = i == j ? whole * k : 0;
            const bool opens = i || u[0] > 0, counts = j || u[0] > 0;
            if (!elastic && opens && counts && w > 0) value -= k * u[i] * slope * u[j] / w;
            data.K[N * i + j] = value;
        }
    return 1;
}

SYMBOL int BrittleZone_PlaneStrain(BehaviourData *data) { return integrate<2>(*data); }
SYMBOL int BrittleZone_Tridimensional(BehaviourData *data) { return integrate<3>(*data); }
