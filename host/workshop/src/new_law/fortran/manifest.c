/* Says which law the library holds, readable without running it; Fortran has no means for that. */
#include "pilum_law.h"

PILUM_MANIFEST("pilum 1\nmy_law 0.1.0\n");
