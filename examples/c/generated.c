/* A particle loop around an obstacle that is source code: no library of rfm is needed, only the file that
 *
 *     rfm build examples/pawn.rfm -o pawn.c --what sign
 *
 * writes, with its header. A thousand balls fall on the pawn; those inside it are put back along the gradient.
 *
 *     cc -O3 -march=native -ffp-contract=off -fno-math-errno -fno-trapping-math generated.c pawn.c -lm */

#include <math.h>
#include <stdio.h>

#include "pawn.h"

enum { COUNT = 1000 };

static double x[COUNT], y[COUNT], z[COUNT], u[COUNT], v[COUNT], w[COUNT];
static double omega[COUNT], gx[COUNT], gy[COUNT], gz[COUNT];

/* A few steps of Newton's method from a point inside to the surface, and a little beyond. */
static void put_back(int i) {
    for (int step = 0; step < 20 && pawn_sign(x[i], y[i], z[i]) >= 0.0; step++) {
        double g[3];
        const double inside = pawn_omega_gradient(x[i], y[i], z[i], g);
        const double square = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
        const double move = 1.05 * inside / square + 1e-9 / sqrt(square);
        if (square == 0.0) break;
        x[i] -= move * g[0];
        y[i] -= move * g[1];
        z[i] -= move * g[2];
    }
}

/* Half of the speed towards the surface is given back. */
static void reflect(int i) {
    const double square = gx[i] * gx[i] + gy[i] * gy[i] + gz[i] * gz[i];
    const double inward = u[i] * gx[i] + v[i] * gy[i] + w[i] * gz[i];
    if (square == 0.0 || inward <= 0.0) return;
    u[i] -= 1.5 * inward / square * gx[i];
    v[i] -= 1.5 * inward / square * gy[i];
    w[i] -= 1.5 * inward / square * gz[i];
}

int main(void) {
    const double dt = 0.001;
    long hits = 0;
    int inside = 0;
    for (int i = 0; i < COUNT; i++) {
        x[i] = 1.0 + i % 10 / 10.0;
        y[i] = 1.0 + i / 10 % 10 / 10.0;
        z[i] = 1.6 + i / 100 / 10.0;
    }
    for (int step = 0; step < 1000; step++) {
        for (int i = 0; i < COUNT; i++) {
            w[i] -= 9.81 * dt;
            x[i] += dt * u[i];
            y[i] += dt * v[i];
            z[i] = fmax(z[i] + dt * w[i], 0.0);
        }
        pawn_omega_gradient_many(COUNT, x, y, z, omega, gx, gy, gz);
        for (int i = 0; i < COUNT; i++) {
            if (omega[i] <= 0.0) continue;
            hits++;
            reflect(i);
            put_back(i);
        }
    }
    pawn_omega_many(COUNT, x, y, z, omega);
    for (int i = 0; i < COUNT; i++) inside += omega[i] > 0.0;
    printf("%s, %d of %d particles inside the pawn\n", hits > 1000 ? "many hits" : "few hits", inside, COUNT);
    return 0;
}
