/* A host whose invalid operations and divisions by zero end it, as those of OpenFOAM and of gfortran's -ffpe-trap do, and
 * that rounds down: the library answers as it does elsewhere, and gives the host its environment back. */

#define _GNU_SOURCE
#include <fenv.h>
#include <stdio.h>
#include <string.h>

#include "rfm.h"

static const char TEXT[] =
    "rfm 1\n"
    "solid cube = box([0, 0, 0], [1, 1, 1])\n"
    "solid tip = cone(1, 1) or torus(2, 0.5)\n"
    "solid pole = z <= 1/(x^2 + y^2) and box([-1, -1, -1], [1, 1, 1])\n";

enum { POINTS = 125, ANSWERS = 7 * POINTS };

/* The host computes them once: in another way of rounding they would be other points. */
static double x[POINTS], y[POINTS], z[POINTS];

static void answer(const RfmSolid *solid, double *to) {
    for (int k = 0; k < POINTS; k++, to += 6) {
        to[0] = rfm_omega(solid, x[k], y[k], z[k]);
        rfm_gradient(solid, x[k], y[k], z[k], to + 1);
        to[4] = rfm_sign(solid, x[k], y[k], z[k]);
        to[5] = rfm_contact(solid, x[k], y[k], z[k]).distance;
    }
    RfmPoints points = {x, y, z, sizeof *x};
    RfmValues omega = {to, sizeof *to};
    rfm_omega_many(solid, POINTS, points, omega, NULL);
}

int main(void) {
    static const char *const NAMES[] = {"cube", "tip", "pole"};
    static double before[ANSWERS], after[ANSWERS];
    RfmProgram *program = NULL;
    for (int k = 0; k < POINTS; k++) {
        x[k] = k % 5 * 0.51 - 1;
        y[k] = k / 5 % 5 * 0.5 - 1;
        z[k] = k / 25 * 0.5 - 1;
    }
    int failures = rfm_load_text(TEXT, "traps.rfm", NULL, 0, &program, NULL) != RFM_OK;
    for (int k = 0; k < 3; k++) {
        RfmSolid *solid = NULL;
        failures += rfm_solid(program, NAMES[k], &solid, NULL) != RFM_OK;
        answer(solid, before);
        feclearexcept(FE_ALL_EXCEPT);
        feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW);
        fesetround(FE_DOWNWARD);
        answer(solid, after);
        failures += fegetexcept() != (FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW);
        failures += fegetround() != FE_DOWNWARD;
        failures += fetestexcept(FE_DIVBYZERO | FE_INVALID) != 0;
        fedisableexcept(FE_ALL_EXCEPT);
        fesetround(FE_TONEAREST);
        failures += memcmp(before, after, sizeof before) != 0;
        rfm_solid_free(solid);
    }
    rfm_program_free(program);
    printf(failures == 0 ? "traps of the host ended nothing\n" : "%d failures\n", failures);
    return failures != 0;
}
