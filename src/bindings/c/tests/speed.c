/* What the interface for C costs: nanoseconds per point of columns in f64 and f32, and of single points, in the order of
 * src/bindings/python/tests/columns.rs, which prints the same for Rust.
 *   gcc -O2 -Isrc/bindings/c/include src/bindings/c/tests/speed.c -LLIBRARIES -lrfm -o speed && ./speed examples/pawn.rfm
 */

#define _POSIX_C_SOURCE 199309L

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "rfm.h"

enum { COUNT = 1000000, ROUNDS = 15, MANY = 2000 };

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e9 + (double)t.tv_nsec;
}

static int smaller(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double x[3][COUNT], omega[COUNT];
static float x32[3][COUNT], omega32[COUNT];

int main(int count, char **arguments) {
    const int steps[3] = {7, 31, 101};
    double times[2][ROUNDS], best = 1e30, sum = 0.0;
    RfmProgram *program = NULL;
    RfmSolid *pawn = NULL;
    if (count != 2 || rfm_load_file(arguments[1], NULL, 0, &program, NULL) != RFM_OK) return 2;
    if (rfm_solid(program, "pawn", &pawn, NULL) != RFM_OK) return 2;
    for (int k = 0; k < 3; k++) {
        for (long i = 0; i < COUNT; i++) {
            x[k][i] = 3.0 * (double)(i * steps[k] % 1009) / 1009.0;
            x32[k][i] = (float)x[k][i];
        }
    }
    RfmPoints points = {x[0], x[1], x[2], sizeof(double)};
    RfmPointsF32 single = {x32[0], x32[1], x32[2], sizeof(float)};
    for (int round = -1; round < ROUNDS; round++) {
        double start = now();
        rfm_omega_many(pawn, COUNT, points, (RfmValues){omega, sizeof(double)}, NULL);
        if (round >= 0) times[0][round] = now() - start;
    }
    for (int round = -1; round < ROUNDS; round++) {
        double start = now();
        rfm_omega_many_f32(pawn, COUNT, single, (RfmValuesF32){omega32, sizeof(float)}, NULL);
        if (round >= 0) times[1][round] = now() - start;
    }
    for (int round = 0; round < 300; round++) {
        double start = now();
        for (int k = 0; k < MANY; k++) sum += rfm_omega(pawn, 1.5, 1.4, k * 1e-5);
        double time = (now() - start) / MANY;
        if (time < best) best = time;
    }
    for (int k = 0; k < 2; k++) {
        qsort(times[k], ROUNDS, sizeof(double), smaller);
        printf("%.3f ", times[k][ROUNDS / 2] / COUNT);
    }
    printf("%.2f\n", best);
    rfm_solid_free(pawn);
    rfm_program_free(program);
    return sum == 0.0;
}
