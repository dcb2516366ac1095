/* A host whose invalid operations and divisions by zero end it, as those of OpenFOAM and of gfortran's -ffpe-trap do, and
 * that rounds down: the library answers as it does elsewhere, and gives the host its environment back. */

#define _GNU_SOURCE
#include <fenv.h>
#include <math.h>
#include <stdio.h>

#include "rfm.h"

static const char TEXT[] =
    "rfm 1\n"
    "solid cube = box([0, 0, 0], [1, 1, 1])\n"
    "solid tip = cone(1, 1) or torus(2, 0.5)\n"
    "solid pole = z <= 1/(x^2 + y^2) and box([-1, -1, -1], [1, 1, 1])\n";

/* what is no number adds nothing: the sums here are the host's own, and would end it */
static double counted(double number) { return isfinite(number) ? number : 0; }

static double answers(const RfmSolid *solid) {
    double sum = 0, gradient[3];
    for (int k = 0; k < 125; k++) {
        double x = k % 5 * 0.5 - 1, y = k / 5 % 5 * 0.5 - 1, z = k / 25 * 0.5 - 1;
        sum += counted(rfm_omega(solid, x, y, z)) + counted(rfm_gradient(solid, x, y, z, gradient));
        sum += counted(gradient[0]) + counted(gradient[1]) + counted(gradient[2]);
        sum += counted(rfm_sign(solid, x, y, z)) + counted(rfm_contact(solid, x, y, z).distance);
    }
    return sum;
}

int main(void) {
    static const char *const NAMES[] = {"cube", "tip", "pole"};
    RfmProgram *program = NULL;
    int failures = rfm_load_text(TEXT, "traps.rfm", NULL, 0, &program, NULL) != RFM_OK;
    for (int k = 0; k < 3; k++) {
        RfmSolid *solid = NULL;
        failures += rfm_solid(program, NAMES[k], &solid, NULL) != RFM_OK;
        double before = answers(solid);
        feclearexcept(FE_ALL_EXCEPT);
        feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW);
        fesetround(FE_DOWNWARD);
        double after = answers(solid);
        failures += fegetexcept() != (FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW);
        failures += fegetround() != FE_DOWNWARD;
        failures += fetestexcept(FE_DIVBYZERO | FE_INVALID) != 0;
        fedisableexcept(FE_ALL_EXCEPT);
        fesetround(FE_TONEAREST);
        failures += !(after - before < 1e-9 && before - after < 1e-9);
        rfm_solid_free(solid);
    }
    rfm_program_free(program);
    printf(failures == 0 ? "traps of the host ended nothing\n" : "%d failures\n", failures);
    return failures != 0;
}
