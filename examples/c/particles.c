/* A particle loop of your own around a compiled obstacle, in C99: a thousand balls fall on a pawn. With -lrfm it needs
 * nothing but include/rfm.h; src/bindings/c/tests/run compiles and runs it. */

#include <stdio.h>
#include <stdlib.h>

#include "rfm.h"

enum { COUNT = 1000 };

/* the records of the program stay as they are: columns are given by the size of a record */
typedef struct {
    double x[3];
    double v[3];
    double omega;
    int id;
} Particle;

/* by address, because C may look at the second argument before it calls the function of the first */
static void stop(RfmStatus status, RfmError **error) {
    if (status != RFM_OK) {
        fprintf(stderr, "%s\n", rfm_error_message(*error));
        rfm_error_free(*error);
        exit(EXIT_FAILURE);
    }
}

int main(int count, char **arguments) {
    const RfmParam params[] = {{"cx", 1.25}};
    const double dt = 0.001;
    RfmError *error = NULL;
    RfmProgram *program = NULL;
    RfmSolid *pawn = NULL;
    RfmCollisions collisions;
    RfmPoints points;
    RfmVectors places, velocities;
    RfmValues values;
    size_t hits = 0;
    int inside = 0;
    static Particle p[COUNT];

    stop(rfm_load_file(count > 1 ? arguments[1] : "examples/pawn.rfm", params, 1, &program, &error), &error);
    stop(rfm_solid(program, "pawn", &pawn, &error), &error);
    rfm_program_free(program);

    for (int i = 0; i < COUNT; i++) {
        p[i].x[0] = 0.75 + i % 10 / 10.0;
        p[i].x[1] = 1.0 + i / 10 % 10 / 10.0;
        p[i].x[2] = 1.6 + i / 100 / 10.0;
        p[i].id = i;
    }
    points = (RfmPoints){&p[0].x[0], &p[0].x[1], &p[0].x[2], sizeof p[0]};
    places = (RfmVectors){&p[0].x[0], &p[0].x[1], &p[0].x[2], sizeof p[0]};
    velocities = (RfmVectors){&p[0].v[0], &p[0].v[1], &p[0].v[2], sizeof p[0]};
    values = (RfmValues){&p[0].omega, sizeof p[0]};

    for (int step = 0; step < 1000; step++) {
        for (int i = 0; i < COUNT; i++) {
            p[i].v[2] -= 9.81 * dt;
            for (int axis = 0; axis < 3; axis++) p[i].x[axis] += dt * p[i].v[axis];
            if (p[i].x[2] < 0.0) p[i].x[2] = 0.0;
        }
        stop(rfm_collide(pawn, COUNT, places, velocities, 0.5, 0.0, 0.5, &collisions, &error), &error);
        hits += collisions.hits;
    }
    stop(rfm_omega_many(pawn, COUNT, points, values, &error), &error);
    for (int i = 0; i < COUNT; i++) inside += p[i].omega > 0.0;
    printf("%s, %d of %d particles inside the pawn\n", hits > 1000 ? "many hits" : "few hits", inside, COUNT);
    rfm_solid_free(pawn);
    return EXIT_SUCCESS;
}
