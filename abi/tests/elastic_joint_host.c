/* Calls elastic_joint.c as a host does and prints what comes back: a refused parameter, then
 * three points of which the last holds a NaN. */
#include "pilum_law.h"

#include <math.h>
#include <stdio.h>

int main(void) {
    const pilum_law *law = pilum_entry(NULL)->law[0];
    char message[80] = "";
    pilum_instance *instance = NULL;

    const double refused[] = {-1.0, 3000.0};
    pilum_status status =
        law->create(law, NULL, 0, refused, 2, &instance, message, sizeof message);
    printf("%d %s\n", (int)status, message);

    const double parameters[] = {1000.0, 3000.0};
    message[0] = 0;
    if (law->create(law, NULL, 0, parameters, 2, &instance, message, sizeof message)) {
        return 1;
    }
    /* The same start for all points; ends component after component; results point after point. */
    const double jump0[] = {0.0, 0.0};
    const double jump1[] = {1e-3, 2e-3, NAN, 1e-3, 2e-3, 0.0};
    const double traction0[] = {-100.0, 0.0};
    double traction1[3][2], tangent[3][4];
    pilum_status outcome[3];
    const pilum_batch batch = {
        .struct_size = sizeof batch,
        .request = PILUM_REQ_FLUX | PILUM_REQ_TANGENT,
        .n_points = 3,
        .first_point = 10,
        .gradient0 = {jump0, 0, 1},
        .gradient1 = {jump1, 1, 3},
        .flux0 = {traction0, 0, 1},
        .flux1 = {traction1[0], 2, 1},
        .tangent = {tangent[0], 4, 1},
        .status = outcome,
        .message = message,
        .message_capacity = sizeof message,
    };
    status = law->integrate(instance, &batch);
    printf("%d %s\n", (int)status, message);
    for (int i = 0; i < 3; i++) {
        printf("%d", (int)outcome[i]);
        if (outcome[i] == PILUM_OK) {
            printf(" %g %g", traction1[i][0], traction1[i][1]);
        }
        printf("\n");
    }
    printf("%g %g %g %g\n", tangent[0][0], tangent[0][1], tangent[0][2], tangent[0][3]);
    law->destroy(instance);
    return 0;
}
