/* What the interface for C promises: values, strides, overlaps, errors, and null handles. Prints what is wrong. */

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "rfm.h"

static int failures = 0;

#define CHECK(condition)                                                        \
    do {                                                                        \
        if (!(condition)) {                                                     \
            printf("%s:%d: %s\n", __FILE__, __LINE__, #condition);              \
            failures++;                                                         \
        }                                                                       \
    } while (0)

enum { COUNT = 1500 };

static int same(double a, double b) { return a == b || (isnan(a) && isnan(b)); }

static RfmSolid *load(const char *path, const char *name) {
    RfmProgram *program = NULL;
    RfmSolid *solid = NULL;
    CHECK(rfm_load_file(path, NULL, 0, &program, NULL) == RFM_OK);
    CHECK(rfm_solid(program, name, &solid, NULL) == RFM_OK);
    rfm_program_free(program);
    return solid;
}

/* `pawn.txt` has lines of x, y, z, omega, gradient, sign and distance by `rfm eval`, with 17 digits */
static void values_are_those_of_the_program(const RfmSolid *pawn, const char *table) {
    FILE *file = fopen(table, "r");
    char line[1024];
    int rows = 0;
    CHECK(file != NULL);
    if (file == NULL) return;
    CHECK(fgets(line, sizeof line, file) != NULL);
    while (fgets(line, sizeof line, file) != NULL) {
        double n[9], g[3];
        char *at = line;
        for (int k = 0; k < 9; k++) {
            n[k] = strtod(at, &at);
            at++;
        }
        CHECK(rfm_omega(pawn, n[0], n[1], n[2]) == n[3]);
        CHECK(rfm_gradient(pawn, n[0], n[1], n[2], g) == n[3]);
        CHECK(g[0] == n[4] && g[1] == n[5] && g[2] == n[6]);
        CHECK(rfm_sign(pawn, n[0], n[1], n[2]) == n[7]);
        /* the program searches for the nearest point; a contact is an estimate, on the same side */
        CHECK((rfm_contact(pawn, n[0], n[1], n[2]).distance > 0) == (n[8] > 0));
        rows++;
    }
    CHECK(rows >= 100);
    fclose(file);
}

static void columns_of_any_stride_have_the_bits_of_points(const RfmSolid *pawn) {
    static double x[COUNT], y[COUNT], z[COUNT], w[COUNT], g[3][COUNT], d[COUNT], n[3][COUNT], c[COUNT], s[COUNT];
    static struct { double x[3], w, g[3]; float f[4]; } p[COUNT];
    static unsigned char bytes[24 * COUNT + 1];
    for (int i = 0; i < COUNT; i++) {
        x[i] = p[i].x[0] = 0.5 + 2.0 * (i * 7 % 1009) / 1009.0;
        y[i] = p[i].x[1] = 0.5 + 2.0 * (i * 31 % 1009) / 1009.0;
        z[i] = p[i].x[2] = 1.5 * (i * 101 % 1009) / 1009.0;
        for (int k = 0; k < 3; k++) {
            p[i].f[k] = (float)p[i].x[k];
            memcpy(bytes + 1 + 24 * i + 8 * k, &p[i].x[k], 8);
        }
    }
    x[3] = p[3].x[0] = NAN;
    memcpy(bytes + 1 + 24 * 3, &x[3], 8);
    RfmPoints columns = {x, y, z, sizeof(double)};
    RfmPoints records = {&p[0].x[0], &p[0].x[1], &p[0].x[2], sizeof p[0]};
    RfmPoints backwards = {&x[COUNT - 1], &y[COUNT - 1], &z[COUNT - 1], -(ptrdiff_t)sizeof(double)};
    RfmPoints unaligned = {(double *)(void *)(bytes + 1), (double *)(void *)(bytes + 9),
                           (double *)(void *)(bytes + 17), 24};
    RfmValues no = {NULL, 0}, values = {w, sizeof(double)}, field = {&p[0].w, sizeof p[0]};
    RfmVectors gradient = {g[0], g[1], g[2], sizeof(double)};
    RfmVectors fields = {&p[0].g[0], &p[0].g[1], &p[0].g[2], sizeof p[0]};
    CHECK(rfm_omega_many(pawn, COUNT, columns, values, NULL) == RFM_OK);
    CHECK(rfm_omega_many(pawn, COUNT, records, field, NULL) == RFM_OK);
    for (int i = 0; i < COUNT; i++) CHECK(same(w[i], rfm_omega(pawn, x[i], y[i], z[i])) && same(w[i], p[i].w));
    CHECK(isnan(w[3]) && !isnan(w[4]));
    CHECK(rfm_omega_many(pawn, COUNT, backwards, (RfmValues){&d[COUNT - 1], -(ptrdiff_t)sizeof(double)}, NULL) == RFM_OK);
    CHECK(rfm_omega_many(pawn, COUNT, unaligned, (RfmValues){c, sizeof(double)}, NULL) == RFM_OK);
    for (int i = 0; i < COUNT; i++) CHECK(same(w[i], d[i]) && same(w[i], c[i]));
    CHECK(rfm_gradient_many(pawn, COUNT, columns, no, gradient, NULL) == RFM_OK);
    CHECK(rfm_gradient_many(pawn, COUNT, records, field, fields, NULL) == RFM_OK);
    for (int i = 0; i < COUNT; i++) {
        double one[3], omega = rfm_gradient(pawn, x[i], y[i], z[i], one);
        CHECK(same(p[i].w, omega));
        for (int k = 0; k < 3; k++) CHECK(same(g[k][i], one[k]) && same(p[i].g[k], one[k]));
    }
    CHECK(rfm_sign_many(pawn, COUNT, records, (RfmValues){s, sizeof(double)}, NULL) == RFM_OK);
    CHECK(rfm_contact_many(pawn, COUNT, columns, (RfmValues){d, sizeof(double)},
                           (RfmVectors){n[0], n[1], n[2], sizeof(double)}, (RfmValues){c, sizeof(double)}, NULL) == RFM_OK);
    for (int i = 0; i < COUNT; i++) {
        RfmContact one = rfm_contact(pawn, x[i], y[i], z[i]);
        CHECK(same(s[i], rfm_sign(pawn, x[i], y[i], z[i])));
        CHECK(same(d[i], one.distance) && same(c[i], one.curvature) && same(n[2][i], one.normal[2]));
    }
    RfmPointsF32 single = {&p[0].f[0], &p[0].f[1], &p[0].f[2], sizeof p[0]};
    CHECK(rfm_omega_many_f32(pawn, COUNT, single, (RfmValuesF32){&p[0].f[3], sizeof p[0]}, NULL) == RFM_OK);
    for (int i = 0; i < COUNT; i++) CHECK(same(p[i].f[3], rfm_omega_f32(pawn, p[i].f[0], p[i].f[1], p[i].f[2])));
    /* in place */
    CHECK(rfm_omega_many(pawn, COUNT, columns, (RfmValues){x, sizeof(double)}, NULL) == RFM_OK);
    for (int i = 0; i < COUNT; i++) CHECK(same(x[i], w[i]));
}

static void mistakes_become_error_objects(const RfmSolid *pawn) {
    RfmError *error = NULL;
    RfmProgram *program = NULL;
    RfmSolid *solid = NULL;
    RfmDiagnostic found;
    double x[4] = {0};
    CHECK(rfm_load_text("rfm 1\nsolid post = spere(1)", "post.rfm", NULL, 0, &program, &error) == RFM_MISTAKES);
    CHECK(program == NULL && rfm_error_status(error) == RFM_MISTAKES && rfm_error_count(error) == 1);
    CHECK(rfm_error_diagnostic(error, 0, &found) && !rfm_error_diagnostic(error, 1, &found));
    CHECK(found.severity == RFM_ERROR && strcmp(found.code, "E0201") == 0 && found.line == 2 && found.column == 14);
    CHECK(strcmp(found.file, "post.rfm") == 0 && strcmp(found.help, "did you mean `sphere`?") == 0);
    CHECK(strstr(rfm_error_message(error), "error[E0201]") != NULL);
    rfm_error_free(error);
    CHECK(rfm_load_file("no/such.rfm", NULL, 0, &program, &error) == RFM_FILE);
    CHECK(strstr(rfm_error_message(error), "no/such.rfm") != NULL && rfm_error_count(error) == 0);
    rfm_error_free(error);
    CHECK(rfm_load_text("rfm 1\nsolid a = sphere(1)\n", "a", NULL, 0, &program, &error) == RFM_OK && error == NULL);
    CHECK(rfm_solid_count(program) == 1 && strcmp(rfm_solid_name(program, 0), "a") == 0);
    CHECK(rfm_solid_name(program, 1) == NULL);
    CHECK(rfm_solid(program, "b", &solid, NULL) == RFM_UNKNOWN_NAME && solid == NULL);
    CHECK(rfm_solid(program, "\xff", &solid, NULL) == RFM_BAD_ARGUMENT);
    CHECK(rfm_solid(program, "a", NULL, NULL) == RFM_BAD_ARGUMENT);
    rfm_program_free(program);
    // a text has no folder, unless it stands for a file
    const char *half = "rfm 1\nimport \"pawn.rfm\" as chess\nsolid half = chess.pawn and z <= 1\n";
    CHECK(rfm_load_text(half, "examples/half.rfm", NULL, 0, &program, NULL) == RFM_MISTAKES);
    // a handle that has been freed is not left where the next one was to come
    CHECK(program == NULL);
    CHECK(rfm_load_text_as(half, "examples/half.rfm", NULL, 0, &program, NULL) == RFM_OK);
    CHECK(rfm_solid_count(program) == 1 && strcmp(rfm_solid_name(program, 0), "half") == 0);
    rfm_program_free(program);
    CHECK(rfm_load_text_as(half, NULL, NULL, 0, &program, NULL) == RFM_BAD_ARGUMENT);
    CHECK(rfm_load_text("rfm 1\nparam r = 1", "p", (RfmParam[]){{"q", 2.0}}, 1, &program, NULL) == RFM_MISTAKES);
    CHECK(rfm_load_text(NULL, "p", NULL, 0, &program, NULL) == RFM_BAD_ARGUMENT);
    CHECK(rfm_load_text("rfm 1", "p", NULL, 3, &program, NULL) == RFM_BAD_ARGUMENT);
    CHECK(rfm_load_text("rfm 1\n@tolerance(1e-30)\nsolid a = sphere(1)", "t", NULL, 0, &program, NULL) == RFM_OK);
    CHECK(rfm_solid(program, "a", &solid, NULL) == RFM_MISTAKES);
    rfm_program_free(program);
    RfmPoints points = {x, x, x, sizeof(double)};
    RfmValues values = {x, sizeof(double)};
    CHECK(rfm_omega_many(NULL, 4, points, values, NULL) == RFM_BAD_ARGUMENT);
    CHECK(rfm_omega_many(pawn, 4, (RfmPoints){x, NULL, x, 8}, values, NULL) == RFM_BAD_ARGUMENT);
    CHECK(rfm_omega_many(pawn, 4, points, (RfmValues){x, 0}, NULL) == RFM_BAD_ARGUMENT);
    CHECK(rfm_omega_many(pawn, SIZE_MAX, points, values, NULL) == RFM_BAD_ARGUMENT);
    CHECK(rfm_omega_many(pawn, 0, (RfmPoints){NULL, NULL, NULL, 0}, (RfmValues){NULL, 0}, NULL) == RFM_OK);
    CHECK(rfm_solid_between(pawn, NAN, 1.0, &solid, NULL) == RFM_BAD_ARGUMENT);
    CHECK(isnan(rfm_omega(NULL, 1, 2, 3)) && isnan(rfm_sign(NULL, 1, 2, 3)) && isnan(rfm_contact(NULL, 1, 2, 3).distance));
    CHECK(!rfm_first_entry(NULL, x, x, NULL) && !rfm_first_entry(pawn, NULL, x, NULL));
    CHECK(rfm_range(pawn, (double[]){1, 1, 1}, (double[]){0, 0, 0}, x, NULL) == RFM_BAD_ARGUMENT);
    rfm_solid_free(NULL);
    rfm_program_free(NULL);
    rfm_error_free(NULL);
}

/* a particle in a corner leaves all three faces, and one near many parts has the answer of all */
static void corners_and_many_parts(void) {
    const char *text =
        "rfm 1\nsolid posts = any i in 0..40: cylinder(0.01, 0.7).move([0.1 + 0.02*i, 0.5, -0.2])\n"
        "solid both = posts or not box([0, 0, 0], [1, 1, 1])";
    RfmProgram *program = NULL;
    RfmSolid *both = NULL, *near = NULL, *none = NULL;
    RfmCollisions found;
    const double low[3] = {0, 0, 0}, high[3] = {1, 1, 1};
    CHECK(rfm_load_text(text, "posts", NULL, 0, &program, NULL) == RFM_OK);
    CHECK(rfm_solid(program, "both", &both, NULL) == RFM_OK);
    CHECK(rfm_solid_within(both, low, high, &near, NULL) == RFM_OK);
    none = near;
    CHECK(rfm_solid_within(both, high, low, &none, NULL) == RFM_BAD_ARGUMENT && none == NULL);
    CHECK(rfm_solid_within(both, NULL, high, &none, NULL) == RFM_BAD_ARGUMENT);
    CHECK(rfm_solid_within(NULL, low, high, &none, NULL) == RFM_BAD_ARGUMENT);
    double x[3][3] = {{-0.001, -0.002, 1.0005}, {0.5, 0.495, 0.3}, {0.5, 0.3, 0.3}};
    double v[3][3] = {{-2, -2, 2}, {0, 3, 0}, {1, 1, 1}};
    RfmVectors places = {&x[0][0], &x[0][1], &x[0][2], sizeof x[0]};
    RfmVectors velocities = {&v[0][0], &v[0][1], &v[0][2], sizeof v[0]};
    CHECK(rfm_omega(near, 0.5, 0.495, 0.3) == rfm_omega(both, 0.5, 0.495, 0.3));
    CHECK(rfm_collide(near, 3, places, velocities, 0.5, 0.0, 0.1, &found, NULL) == RFM_OK);
    CHECK(found.hits == 2 && found.stuck == 0 && found.undefined == 0);
    CHECK(fabs(v[0][0] - 1) < 1e-9 && fabs(v[0][1] - 1) < 1e-9 && fabs(v[0][2] + 1) < 1e-9);
    CHECK(fabs(x[0][0]) < 1e-9 && fabs(x[0][1]) < 1e-9 && fabs(x[0][2] - 1) < 1e-9);
    CHECK(fabs(x[1][1] - 0.49) < 1e-6 && fabs(v[1][1] + 1.5) < 1e-6);
    CHECK(x[2][1] == 0.3 && v[2][0] == 1);
    for (int i = 0; i < 3; i++) CHECK(rfm_omega(both, x[i][0], x[i][1], x[i][2]) < 0.0);
    rfm_solid_free(near);
    rfm_solid_free(both);
    rfm_program_free(program);
}

static void collisions_put_back_and_reflect(void) {
    RfmProgram *program = NULL;
    RfmSolid *floor = NULL, *then = NULL;
    RfmCollisions found;
    /* a floor that rises with 1 m/s */
    CHECK(rfm_load_text("rfm 1\nsolid floor = z <= t", "floor", NULL, 0, &program, NULL) == RFM_OK);
    CHECK(rfm_solid(program, "floor", &floor, NULL) == RFM_OK && rfm_moves(floor));
    CHECK(rfm_solid_between(floor, 2.0, 2.0, &then, NULL) == RFM_OK);
    double x[4][3] = {{0, 0, 1.9}, {0, 0, 2.1}, {0, 0, 1.5}, {0, NAN, 1.9}};
    double v[4][3] = {{3, 0, -1}, {3, 0, -1}, {0, 0, 5}, {0, 0, 0}};
    RfmVectors places = {&x[0][0], &x[0][1], &x[0][2], sizeof x[0]};
    RfmVectors velocities = {&v[0][0], &v[0][1], &v[0][2], sizeof v[0]};
    CHECK(rfm_collide(then, 4, places, velocities, 0.5, 0.25, 0.2, &found, NULL) == RFM_OK);
    CHECK(found.hits == 1 && found.stuck == 1 && found.undefined == 1);
    /* approach of 2 m/s to the floor: half returns, friction takes 0.25 of the change of 3 m/s */
    CHECK(fabs(v[0][2] - 2.0) < 1e-9 && fabs(v[0][0] - 2.25) < 1e-9 && v[0][1] == 0.0);
    CHECK(x[0][2] > 2.0 && x[0][2] < 2.0 + 1e-9 && rfm_omega(then, x[0][0], x[0][1], x[0][2]) < 0.0);
    CHECK(x[1][2] == 2.1 && v[1][2] == -1.0 && x[2][2] == 1.5 && v[2][2] == 5.0);
    CHECK(rfm_collide(then, 4, places, velocities, 1.5, 0.0, 0.2, NULL, NULL) == RFM_BAD_ARGUMENT);
    CHECK(rfm_collide(then, 4, places, velocities, 0.5, -1.0, 0.2, NULL, NULL) == RFM_BAD_ARGUMENT);
    CHECK(rfm_collide(then, 4, places, velocities, 0.5, 0.0, NAN, NULL, NULL) == RFM_BAD_ARGUMENT);
    double w[3];
    rfm_wall_velocity(then, 0, 0, 2, w);
    CHECK(w[0] == 0.0 && w[1] == 0.0 && fabs(w[2] - 1.0) < 1e-12);
    RfmEntry entry;
    CHECK(rfm_first_entry(then, (double[]){0, 0, 3}, (double[]){0, 0, 1}, &entry));
    CHECK(fabs(entry.part - 0.5) < 1e-9 && entry.normal[2] == 1.0 && entry.certain);
    CHECK(!rfm_first_entry(then, (double[]){0, 0, 3}, (double[]){5, 0, 2.5}, &entry));
    double range[2], low[3], high[3];
    CHECK(rfm_range(then, (double[]){0, 0, 0}, (double[]){1, 1, 1}, range, NULL) == RFM_OK && range[0] > 0.0);
    CHECK(rfm_bounds(then, low, high) == RFM_UNBOUNDED);
    rfm_solid_free(then);
    rfm_solid_free(floor);
    rfm_program_free(program);
}

/* params, warnings, and other values for params */
static void programs_tell_of_their_params(void) {
    const char *text =
        "rfm 1\nparam r = 8 mm in 1 mm .. 20 mm \"radius\"\nparam n = 3\nlet unused = 2\nsolid a = sphere(r)\nsolid b = sphere(n)";
    RfmProgram *program = NULL, *then = NULL;
    RfmSolid *solid = NULL;
    RfmError *error = NULL;
    RfmParamInfo param;
    RfmDiagnostic warning;
    CHECK(rfm_load_text(text, "a.rfm", NULL, 0, &program, NULL) == RFM_OK);
    CHECK(rfm_param_count(program) == 2 && rfm_param_count(NULL) == 0);
    CHECK(rfm_param(program, 0, &param) && strcmp(param.name, "r") == 0 && param.value == 0.008);
    CHECK(param.low == 0.001 && param.high == 0.02 && strcmp(param.unit, "mm") == 0);
    CHECK(strcmp(param.description, "radius") == 0);
    CHECK(rfm_param(program, 1, &param) && param.value == 3.0 && param.unit == NULL && param.description == NULL);
    CHECK(param.low == -INFINITY && param.high == INFINITY);
    CHECK(!rfm_param(program, 2, &param) && !rfm_param(NULL, 0, &param) && !rfm_param(program, 0, NULL));
    CHECK(rfm_warning_count(program) == 1 && rfm_warning(program, 0, &warning) && !rfm_warning(program, 1, &warning));
    CHECK(warning.severity == RFM_WARNING && strcmp(warning.code, "W0401") == 0 && warning.line == 4);
    CHECK(rfm_warning_count(NULL) == 0 && !rfm_warning(NULL, 0, &warning));
    const char *settings[] = {"r=1 cm", "n = 2"};
    CHECK(rfm_program_with(program, settings, 2, &then, NULL) == RFM_OK);
    CHECK(rfm_param(then, 0, &param) && param.value == 0.01 && rfm_param(then, 1, &param) && param.value == 2.0);
    CHECK(rfm_param(program, 0, &param) && param.value == 0.008);
    CHECK(rfm_solid(then, "b", &solid, NULL) == RFM_OK && rfm_sign(solid, 1.9, 0, 0) == 1.0 && rfm_sign(solid, 2.1, 0, 0) == -1.0);
    rfm_solid_free(solid);
    rfm_program_free(then);
    CHECK(rfm_program_with(program, (const char *[]){"r=1 kg"}, 1, &then, &error) == RFM_MISTAKES && then == NULL);
    rfm_error_free(error);
    CHECK(rfm_program_with(program, (const char *[]){"r=1 m"}, 1, &then, NULL) == RFM_MISTAKES);
    CHECK(rfm_program_with(program, (const char *[]){"r"}, 1, &then, &error) == RFM_BAD_ARGUMENT);
    CHECK(strcmp(rfm_error_message(error), "`r` is no setting, expected `name=value`") == 0);
    rfm_error_free(error);
    CHECK(rfm_program_with(program, (const char *[]){"r=big"}, 1, &then, NULL) == RFM_BAD_ARGUMENT);
    CHECK(rfm_program_with(program, NULL, 1, &then, NULL) == RFM_BAD_ARGUMENT);
    CHECK(rfm_program_with(NULL, NULL, 0, &then, NULL) == RFM_BAD_ARGUMENT);
    rfm_program_free(program);
    /* a range from 5 to 2 has no members: only both values together are allowed */
    const char *range = "rfm 1\nparam m = 1\nparam n = 2\nsolid s = any i in m..n: sphere(i)";
    CHECK(rfm_load_text(range, "b.rfm", NULL, 0, &program, NULL) == RFM_OK);
    CHECK(rfm_program_with(program, (const char *[]){"m=5"}, 1, &then, NULL) == RFM_MISTAKES);
    CHECK(rfm_program_with(program, (const char *[]){"m=5", "n=6"}, 2, &then, NULL) == RFM_OK);
    CHECK(rfm_solid(then, "s", &solid, NULL) == RFM_OK && rfm_sign(solid, 4.9, 0, 0) == 1.0);
    rfm_solid_free(solid);
    rfm_program_free(then);
    rfm_program_free(program);
}

/* what is asked of one point has the same answer among many */
static void more_questions_about_many_points(void) {
    const char *text = "rfm 1\nsolid rising = sphere(0.5).move([0, 0, t])\nsolid ball = sphere(0.5)";
    RfmProgram *program = NULL;
    RfmSolid *rising = NULL, *ball = NULL;
    double p[3][3] = {{0.7, 0, 0}, {0.1, 0.2, 0.9}, {0, NAN, 0}}, q[3][3] = {{-0.7, 0, 0}, {3, 3, 3}, {0, 0, 0}};
    double v[3][3], c[3], one[3];
    CHECK(rfm_load_text(text, "ball", NULL, 0, &program, NULL) == RFM_OK);
    CHECK(rfm_solid(program, "rising", &rising, NULL) == RFM_OK && rfm_solid(program, "ball", &ball, NULL) == RFM_OK);
    RfmPoints points = {&p[0][0], &p[0][1], &p[0][2], sizeof p[0]}, ends = {&q[0][0], &q[0][1], &q[0][2], sizeof q[0]};
    RfmVectors velocity = {&v[0][0], &v[0][1], &v[0][2], sizeof v[0]};
    CHECK(rfm_wall_velocity_many(rising, 3, points, velocity, NULL) == RFM_OK);
    for (int i = 0; i < 3; i++) {
        rfm_wall_velocity(rising, p[i][0], p[i][1], p[i][2], one);
        for (int k = 0; k < 3; k++) CHECK(same(v[i][k], one[k]));
    }
    CHECK(fabs(v[0][2] - 1.0) < 1e-12);
    CHECK(rfm_clearance_many(ball, 2, points, (RfmValues){c, sizeof(double)}, NULL) == RFM_OK);
    for (int i = 0; i < 2; i++) CHECK(same(c[i], rfm_clearance(ball, p[i][0], p[i][1], p[i][2])));
    CHECK(c[0] <= 0.2 && c[0] > 0.1999 && isnan(rfm_clearance(NULL, 0, 0, 0)));
    RfmEntry entries[3];
    CHECK(rfm_first_entry_many(ball, 3, points, ends, entries, NULL) == RFM_OK);
    CHECK(fabs(entries[0].point[0] - 0.5) < 1e-7 && entries[0].certain && entries[0].normal[0] > 0.999);
    CHECK(isnan(entries[1].part) && isnan(entries[1].point[0]) && entries[1].certain);
    CHECK(isnan(entries[2].part) && !entries[2].certain);
    CHECK(rfm_first_entry_many(ball, 3, points, ends, NULL, NULL) == RFM_BAD_ARGUMENT);
    CHECK(rfm_first_entry_many(ball, 0, points, ends, NULL, NULL) == RFM_OK);
    CHECK(rfm_wall_velocity_many(NULL, 3, points, velocity, NULL) == RFM_BAD_ARGUMENT);
    rfm_solid_free(rising);
    rfm_solid_free(ball);
    rfm_program_free(program);
}

/* six times the volume that triangles enclose */
static double enclosed(const RfmMesh *mesh) {
    const double *p = rfm_mesh_vertices(mesh);
    const uint32_t *corners = rfm_mesh_triangles(mesh);
    double sum = 0;
    for (size_t i = 0; i < rfm_mesh_triangle_count(mesh); i++) {
        const double *a = p + 3 * corners[3 * i], *b = p + 3 * corners[3 * i + 1], *c = p + 3 * corners[3 * i + 2];
        sum += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
    }
    return sum;
}

static void solids_and_fluids_have_meshes(void) {
    enum { SIDE = 10, MANY = SIDE * SIDE * SIDE };
    const char *text = "rfm 1\nsolid brick = box([0, 0, 0], [1, 2, 3])\nsolid floor = z <= 0\nsolid no = sphere(1) and z >= 2";
    RfmProgram *program = NULL;
    RfmSolid *brick = NULL, *floor = NULL, *no = NULL;
    RfmMesh *mesh = NULL;
    RfmError *error = NULL;
    const double low[3] = {0, 0, -1}, high[3] = {1, 1, 1};
    double volume = 0, uncertainty = 0;
    CHECK(rfm_load_text(text, "brick", NULL, 0, &program, NULL) == RFM_OK);
    CHECK(rfm_solid(program, "brick", &brick, NULL) == RFM_OK && rfm_solid(program, "floor", &floor, NULL) == RFM_OK);
    CHECK(rfm_solid(program, "no", &no, NULL) == RFM_OK);
    CHECK(rfm_volume(brick, 96, &volume, &uncertainty, NULL) == RFM_OK);
    CHECK(fabs(volume - 6) < 1e-6 && uncertainty >= 0 && uncertainty < 1e-3);
    CHECK(rfm_volume(floor, 96, &volume, NULL, &error) == RFM_BAD_ARGUMENT);
    CHECK(strstr(rfm_error_message(error), "`floor` could not be proven to end") != NULL);
    CHECK(strstr(rfm_error_message(error), "state the box") == NULL);
    rfm_error_free(error);
    CHECK(rfm_volume(brick, 96, NULL, NULL, NULL) == RFM_BAD_ARGUMENT);
    CHECK(rfm_mesh(brick, 32, NULL, NULL, &mesh, NULL) == RFM_OK);
    CHECK(rfm_mesh_vertex_count(mesh) > 100 && rfm_mesh_triangle_count(mesh) > 200 && fabs(enclosed(mesh) - 36) < 1e-6);
    CHECK(fabs(fabs(rfm_mesh_normals(mesh)[0]) + fabs(rfm_mesh_normals(mesh)[1]) + fabs(rfm_mesh_normals(mesh)[2])) > 0.99);
    rfm_mesh_free(mesh);
    CHECK(rfm_mesh(floor, 16, NULL, NULL, &mesh, &error) == RFM_BAD_ARGUMENT && mesh == NULL);
    CHECK(strstr(rfm_error_message(error), "could not be proven to end anywhere: state the box to mesh") != NULL);
    rfm_error_free(error);
    CHECK(rfm_mesh(floor, 16, low, high, &mesh, NULL) == RFM_OK && fabs(enclosed(mesh) - 6) < 1e-6);
    rfm_mesh_free(mesh);
    CHECK(rfm_mesh(floor, 16, low, NULL, &mesh, NULL) == RFM_BAD_ARGUMENT);
    CHECK(rfm_mesh(no, 16, NULL, NULL, &mesh, NULL) == RFM_OK && rfm_mesh_triangle_count(mesh) == 0);
    rfm_mesh_free(mesh);
    static double p[MANY][3];
    for (int i = 0; i < MANY; i++) {
        p[i][0] = 0.1 * (i % SIDE) + 0.05;
        p[i][1] = 0.1 * (i / SIDE % SIDE) + 0.05;
        p[i][2] = 0.1 * (i / SIDE / SIDE) - 0.95;
    }
    RfmPoints particles = {&p[0][0], &p[0][1], &p[0][2], sizeof p[0]};
    CHECK(rfm_fluid_surface(MANY, particles, 0.1, 0.0, low, high, &mesh, NULL) == RFM_OK);
    CHECK(fabs(enclosed(mesh) / 6 - 1) < 0.05);
    for (size_t i = 0; i < rfm_mesh_vertex_count(mesh); i++) {
        const double *v = rfm_mesh_vertices(mesh) + 3 * i;
        CHECK(v[0] >= 0 && v[0] <= 1 && v[2] >= -1);
    }
    size_t vertices = rfm_mesh_vertex_count(mesh);
    rfm_mesh_free(mesh);
    p[0][1] = NAN;
    CHECK(rfm_fluid_surface(MANY, particles, 0.1, 0.05, NULL, NULL, &mesh, NULL) == RFM_OK);
    CHECK(rfm_mesh_vertex_count(mesh) > 100 && rfm_mesh_vertex_count(mesh) < vertices);
    rfm_mesh_free(mesh);
    CHECK(rfm_fluid_surface(0, particles, 0.1, 0.0, NULL, NULL, &mesh, NULL) == RFM_OK && rfm_mesh_vertex_count(mesh) == 0);
    rfm_mesh_free(mesh);
    CHECK(rfm_fluid_surface(MANY, particles, 0.0, 0.0, NULL, NULL, &mesh, NULL) == RFM_BAD_ARGUMENT && mesh == NULL);
    CHECK(rfm_mesh_vertices(NULL) == NULL && rfm_mesh_triangle_count(NULL) == 0);
    rfm_mesh_free(NULL);
    rfm_solid_free(brick);
    rfm_solid_free(floor);
    rfm_solid_free(no);
    rfm_program_free(program);
}

int main(int count, char **arguments) {
    if (count != 3) return 2;
    RfmSolid *pawn = load(arguments[1], "pawn");
    double low[3], high[3];
    CHECK(rfm_abi_version() == RFM_ABI_VERSION);
    CHECK(rfm_bounds(pawn, low, high) == RFM_WITHIN && fabs(low[0] - 1.0) < 1e-5 && fabs(high[2] - 1.4736) < 1e-3);
    values_are_those_of_the_program(pawn, arguments[2]);
    columns_of_any_stride_have_the_bits_of_points(pawn);
    mistakes_become_error_objects(pawn);
    collisions_put_back_and_reflect();
    corners_and_many_parts();
    programs_tell_of_their_params();
    more_questions_about_many_points();
    solids_and_fluids_have_meshes();
    rfm_solid_free(pawn);
    printf("%d failures\n", failures);
    return failures != 0;
}
