/* rfm: obstacles for fluid simulations, written as R-functions and compiled to machine code.
 *
 * Made from src/bindings/c/src by src/bindings/c/header; do not edit.
 *
 * omega > 0 inside a solid, 0 on its surface, < 0 outside. Lengths are in metres, times in seconds.
 *
 * Handles are opaque. A program, a solid or a mesh may be used by any number of threads at a time; it is freed once,
 * when nobody uses it any more. A solid does not need its program after it was made, nor a mesh its solid. Null handles
 * are no errors of the program: questions about them give NaN or RFM_BAD_ARGUMENT, counts 0, and to free them does
 * nothing.
 *
 * Functions that may fail return RFM_OK or what went wrong. The parameter `error` may be null; otherwise it gets an
 * error object, to be freed with rfm_error_free, or null after RFM_OK. No function throws or ends the process.
 * On x86-64 floating-point exceptions that the host traps end nothing within them, and its way of rounding changes no value,
 * but for rfm_math_*, which generated code calls as it would those of the C library.
 *
 * Texts are UTF-8 and end with a zero byte. Those that functions return belong to the handle that they came from.
 *
 * Columns are given by a pointer to the first number and the distance between two numbers in bytes, so numbers may lie
 * in records: { &p[0].x, &p[0].y, &p[0].z, sizeof p[0] }. Results may lie in the same records as the points, or
 * replace them. Functions with columns run on the calling thread, but for rfm_fluid_surface; results do not depend on
 * how points are divided.
 */

#ifndef RFM_H
#define RFM_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

// Version of this interface. It changes when a program that was compiled with an older header would break.
#define RFM_ABI_VERSION 1

// How a function ended.
typedef enum RfmStatus {
    // It did what it was asked.
    RFM_OK = 0,
    // A pointer is null that must not be, a text is not UTF-8, a number is out of range, or what is asked for cannot be made
    // of what is given, as the mesh of a solid without an end.
    RFM_BAD_ARGUMENT = 1,
    // A file could not be read.
    RFM_FILE = 2,
    // A file has mistakes; the error object lists them.
    RFM_MISTAKES = 3,
    // There is no solid of this name.
    RFM_UNKNOWN_NAME = 4,
    // No machine code can be made here.
    RFM_NO_MACHINE_CODE = 5,
    // A bug of the library. The handles stay usable.
    RFM_INTERNAL = 6,
} RfmStatus;

// How serious a message is.
typedef enum RfmSeverity {
    // The file is accepted, but something about it is odd.
    RFM_WARNING = 0,
    // The file is refused.
    RFM_ERROR = 1,
} RfmSeverity;

// What is known about the extent of a solid.
typedef enum RfmBounds {
    // The solid is empty; there is no box.
    RFM_EMPTY = 0,
    // The solid lies in the box.
    RFM_WITHIN = 1,
    // No box was found.
    RFM_UNBOUNDED = 2,
} RfmBounds;

// Why a function failed.
typedef struct RfmError RfmError;

// A closed triangle mesh. It may be used by any number of threads at a time.
typedef struct RfmMesh RfmMesh;

// A checked file.
typedef struct RfmProgram RfmProgram;

// A compiled obstacle.
typedef struct RfmSolid RfmSolid;

// Points as columns: the first number of each, and the distance between two, bytes.
typedef struct RfmPoints {
    // x coordinates, m.
    const double *x;
    // y coordinates, m.
    const double *y;
    // z coordinates, m.
    const double *z;
    // Distance between two numbers of a column, bytes; 8 if they follow one another.
    ptrdiff_t stride;
} RfmPoints;

// Room for numbers. Where `values` is null, they are not wanted.
typedef struct RfmValues {
    // The first number.
    double *values;
    // Distance between two numbers, bytes.
    ptrdiff_t stride;
} RfmValues;

// Room for vectors as columns.
typedef struct RfmVectors {
    // x components.
    double *x;
    // y components.
    double *y;
    // z components.
    double *z;
    // Distance between two numbers of a column, bytes.
    ptrdiff_t stride;
} RfmVectors;

// Where a path first meets a solid.
typedef struct RfmEntry {
    // The part of the path before the entry, 0 to 1.
    double part;
    // The place, m.
    double point[3];
    // Outward unit normal; the mean of those that meet there.
    double normal[3];
    // False where the path only grazes the surface within rounding errors.
    bool certain;
} RfmEntry;

// Points as columns in single precision: the first number of each, and the distance between two, bytes.
typedef struct RfmPointsF32 {
    // x coordinates, m.
    const float *x;
    // y coordinates, m.
    const float *y;
    // z coordinates, m.
    const float *z;
    // Distance between two numbers of a column, bytes; 4 if they follow one another.
    ptrdiff_t stride;
} RfmPointsF32;

// Room for numbers in single precision. Where `values` is null, they are not wanted.
typedef struct RfmValuesF32 {
    // The first number.
    float *values;
    // Distance between two numbers, bytes.
    ptrdiff_t stride;
} RfmValuesF32;

// Room for vectors as columns in single precision.
typedef struct RfmVectorsF32 {
    // x components.
    float *x;
    // y components.
    float *y;
    // z components.
    float *z;
    // Distance between two numbers of a column, bytes.
    ptrdiff_t stride;
} RfmVectorsF32;

// What became of particles.
typedef struct RfmCollisions {
    // Particles that were inside, or on the surface, and have been put back.
    size_t hits;
    // Particles that are inside without a way out within reach. They were left as they are.
    size_t stuck;
    // Particles whose numbers are not finite, or at which the formula has no value. They were left as they are.
    size_t undefined;
} RfmCollisions;

// A message about a file. Its texts live as long as the error object, or the program, that it comes from.
typedef struct RfmDiagnostic {
    // How serious it is.
    enum RfmSeverity severity;
    // Its code, such as "E0201", which `rfm explain` explains.
    const char *code;
    // What was found.
    const char *message;
    // The file as the caller named it.
    const char *file;
    // The first line, from 1.
    size_t line;
    // The first column in characters, from 1.
    size_t column;
    // What would be accepted; null if nothing is known.
    const char *help;
} RfmDiagnostic;

// A value for a param of a file.
typedef struct RfmParam {
    // Name of the param.
    const char *name;
    // Its value.
    double value;
} RfmParam;

// What a file says of one of its params. Its texts live as long as the program.
typedef struct RfmParamInfo {
    // Name of the param.
    const char *name;
    // Its value, in SI units.
    double value;
    // The least value that the file allows, in SI units; minus infinity if it states no range.
    double low;
    // The greatest one; infinity if the file states no range.
    double high;
    // The unit in which the file writes the value, such as "mm"; null if it writes none.
    const char *unit;
    // The text that the file has behind the param; null if it has none.
    const char *description;
} RfmParamInfo;

// The surface as seen from a point: accurate near a face, an estimate far away. Before an edge or a corner that stands
// out the distance is that of the nearest face's plane: too small by up to 1 - sin(a/2) of it before an edge with the
// angle a of the solid, 29 % at a right angle, more at an acute one; and by more before a corner, 42 % at that of a box.
// Inside, beside an edge that goes in, it may be too long, by up to a half between two balls that overlap.
typedef struct RfmContact {
    // Distance, m, positive outside.
    double distance;
    // Outward unit normal of the nearest face; the mean of two at an edge; zero where there is none.
    double normal[3];
    // Mean curvature, 1/m, positive where the solid is convex.
    double curvature;
} RfmContact;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The version of the interface that the library has: `RFM_ABI_VERSION` of its header.
uint32_t rfm_abi_version(void);

// omega at many points.
enum RfmStatus rfm_omega_many(const struct RfmSolid *solid,
                              size_t count,
                              struct RfmPoints points,
                              struct RfmValues omega,
                              struct RfmError **error);

// omega and its gradient at many points, for the price of the gradient.
enum RfmStatus rfm_gradient_many(const struct RfmSolid *solid,
                                 size_t count,
                                 struct RfmPoints points,
                                 struct RfmValues omega,
                                 struct RfmVectors gradient,
                                 struct RfmError **error);

// Whether many points are inside (1), on the surface (0) or outside (-1), as rfm_sign; NaN where the formula has no
// value.
enum RfmStatus rfm_sign_many(const struct RfmSolid *solid,
                             size_t count,
                             struct RfmPoints points,
                             struct RfmValues sign,
                             struct RfmError **error);

// The surface as seen from many points, as `rfm_contact`. Results whose pointers are null are not wanted.
enum RfmStatus rfm_contact_many(const struct RfmSolid *solid,
                                size_t count,
                                struct RfmPoints points,
                                struct RfmValues distance,
                                struct RfmVectors normal,
                                struct RfmValues curvature,
                                struct RfmError **error);

// The velocity of the surface near many points, as `rfm_wall_velocity`.
enum RfmStatus rfm_wall_velocity_many(const struct RfmSolid *solid,
                                      size_t count,
                                      struct RfmPoints points,
                                      struct RfmVectors velocity,
                                      struct RfmError **error);

// Radii of balls around many points that are proven not to meet the surface, as `rfm_clearance`. What all points need of
// the solid is found once, so that this is faster than single points.
enum RfmStatus rfm_clearance_many(const struct RfmSolid *solid,
                                  size_t count,
                                  struct RfmPoints points,
                                  struct RfmValues clearance,
                                  struct RfmError **error);

// Where many straight paths first meet the solid, as `rfm_first_entry`. `entries` has room for `count` of them; the
// numbers of a path that does not meet the solid are NaN, and its `certain` is true: that is proven. Of a path from or
// to what is no place nothing is known, and its `certain` is false.
enum RfmStatus rfm_first_entry_many(const struct RfmSolid *solid,
                                    size_t count,
                                    struct RfmPoints from,
                                    struct RfmPoints to,
                                    struct RfmEntry *entries,
                                    struct RfmError **error);

// `rfm_omega_many` in single precision throughout.
enum RfmStatus rfm_omega_many_f32(const struct RfmSolid *solid,
                                  size_t count,
                                  struct RfmPointsF32 points,
                                  struct RfmValuesF32 omega,
                                  struct RfmError **error);

// `rfm_gradient_many` in single precision throughout.
enum RfmStatus rfm_gradient_many_f32(const struct RfmSolid *solid,
                                     size_t count,
                                     struct RfmPointsF32 points,
                                     struct RfmValuesF32 omega,
                                     struct RfmVectorsF32 gradient,
                                     struct RfmError **error);

// `rfm_sign_many` in single precision throughout.
enum RfmStatus rfm_sign_many_f32(const struct RfmSolid *solid,
                                 size_t count,
                                 struct RfmPointsF32 points,
                                 struct RfmValuesF32 sign,
                                 struct RfmError **error);

// `rfm_contact_many` in single precision throughout.
enum RfmStatus rfm_contact_many_f32(const struct RfmSolid *solid,
                                    size_t count,
                                    struct RfmPointsF32 points,
                                    struct RfmValuesF32 distance,
                                    struct RfmVectorsF32 normal,
                                    struct RfmValuesF32 curvature,
                                    struct RfmError **error);

// Puts particles that are inside a solid, or on its surface, back outside, at most `reach` metres away. Those that are not
// deep in it go to the nearest place, others to where the formula's slope leads if that is within reach, otherwise the
// shortest way found along an axis, and if there is none, one found in all directions; each may be farther.
// Reflects their velocities relative to that of the surface: the part `restitution` of the normal speed returns, and the
// tangential speed loses at most `friction` times the change of the normal speed. Particles that stay outside keep their
// bits.
// `collisions` may be null. The first call for a solid of many parts takes longer, because it finds out which of them
// matter where; see rfm_solid_within.
enum RfmStatus rfm_collide(const struct RfmSolid *solid,
                           size_t count,
                           struct RfmVectors positions,
                           struct RfmVectors velocities,
                           double restitution,
                           double friction,
                           double reach,
                           struct RfmCollisions *collisions,
                           struct RfmError **error);

// How the function that made the error ended; RFM_OK for null.
enum RfmStatus rfm_error_status(const struct RfmError *error);

// What happened, as `rfm` prints it. It lives as long as the error object; empty for null.
const char *rfm_error_message(const struct RfmError *error);

// The number of messages about a file; 0 for null.
size_t rfm_error_count(const struct RfmError *error);

// Message `index` about a file; false if there are not so many.
bool rfm_error_diagnostic(const struct RfmError *error, size_t index, struct RfmDiagnostic *diagnostic);

// Frees an error object; does nothing with null.
void rfm_error_free(struct RfmError *error);

// The sine, with the bits that solids have.
double rfm_math_sin(double a);

// The sine, with the bits that solids have.
float rfm_math_sinf(float a);

// The cosine, with the bits that solids have.
double rfm_math_cos(double a);

// The cosine, with the bits that solids have.
float rfm_math_cosf(float a);

// The tangent, with the bits that solids have.
double rfm_math_tan(double a);

// The tangent, with the bits that solids have.
float rfm_math_tanf(float a);

// The arc sine, with the bits that solids have.
double rfm_math_asin(double a);

// The arc sine, with the bits that solids have.
float rfm_math_asinf(float a);

// The arc cosine, with the bits that solids have.
double rfm_math_acos(double a);

// The arc cosine, with the bits that solids have.
float rfm_math_acosf(float a);

// The arc tangent, with the bits that solids have.
double rfm_math_atan(double a);

// The arc tangent, with the bits that solids have.
float rfm_math_atanf(float a);

// The exponential, with the bits that solids have.
double rfm_math_exp(double a);

// The exponential, with the bits that solids have.
float rfm_math_expf(float a);

// The natural logarithm, with the bits that solids have.
double rfm_math_log(double a);

// The natural logarithm, with the bits that solids have.
float rfm_math_logf(float a);

// The logarithm to base 2, with the bits that solids have.
double rfm_math_log2(double a);

// The logarithm to base 2, with the bits that solids have.
float rfm_math_log2f(float a);

// The logarithm to base 10, with the bits that solids have.
double rfm_math_log10(double a);

// The logarithm to base 10, with the bits that solids have.
float rfm_math_log10f(float a);

// The hyperbolic sine, with the bits that solids have.
double rfm_math_sinh(double a);

// The hyperbolic sine, with the bits that solids have.
float rfm_math_sinhf(float a);

// The hyperbolic cosine, with the bits that solids have.
double rfm_math_cosh(double a);

// The hyperbolic cosine, with the bits that solids have.
float rfm_math_coshf(float a);

// The hyperbolic tangent, with the bits that solids have.
double rfm_math_tanh(double a);

// The hyperbolic tangent, with the bits that solids have.
float rfm_math_tanhf(float a);

// A to the power b, with the bits that solids have.
double rfm_math_pow(double a, double b);

// A to the power b, with the bits that solids have.
float rfm_math_powf(float a, float b);

// The angle of the point (b, a), with the bits that solids have.
double rfm_math_atan2(double a, double b);

// The angle of the point (b, a), with the bits that solids have.
float rfm_math_atan2f(float a, float b);

// The volume of a solid, m^3, found on meshes with `cells` cells, two thirds and half as many along the longest side (96 do
// for most solids). A solid of which parts are too thin for these is measured along lines that cross it. `uncertainty` is
// how far it may be off, m^3, infinite if that is not known; it may be null. All processors are used.
enum RfmStatus rfm_volume(const struct RfmSolid *solid,
                          size_t cells,
                          double *volume,
                          double *uncertainty,
                          struct RfmError **error);

// A mesh of the surface of a solid, with `cells` cells along the longest side of its bounds, or of the box that is given by
// its lowest and its highest corner, three numbers each: the mesh is closed at its border. Both may be null. Vertices lie
// on edges and corners, too (dual contouring). All processors are used. `mesh` is null after a failure, and has no
// triangles if the solid is empty.
enum RfmStatus rfm_mesh(const struct RfmSolid *solid,
                        size_t cells,
                        const double *low,
                        const double *high,
                        struct RfmMesh **mesh,
                        struct RfmError **error);

// The surface of a fluid of `count` particles, each of which stands for a cube with the side `spacing`, m, as
// `rfm render --surface` draws it. A fluid in a box, given by its lowest and its highest corner, three numbers each, goes
// up to a wall that it touches, and never beyond it; both may be null. Particles whose places are not finite are left
// out. `cell` is the size of a cell of the marching cubes, m; where it is 0, it is a quarter of the spacing. All
// processors are used. `mesh` is null after a failure, and has no triangles if there are no particles.
enum RfmStatus rfm_fluid_surface(size_t count,
                                 struct RfmPoints particles,
                                 double spacing,
                                 double cell,
                                 const double *low,
                                 const double *high,
                                 struct RfmMesh **mesh,
                                 struct RfmError **error);

// The number of vertices of a mesh; 0 for null.
size_t rfm_mesh_vertex_count(const struct RfmMesh *mesh);

// The vertices of a mesh, m: x, y and z of each after one another. They live as long as the mesh; null for null.
const double *rfm_mesh_vertices(const struct RfmMesh *mesh);

// The outward unit normals of the vertices, in the same order. They live as long as the mesh; null for null.
const double *rfm_mesh_normals(const struct RfmMesh *mesh);

// The number of triangles of a mesh; 0 for null.
size_t rfm_mesh_triangle_count(const struct RfmMesh *mesh);

// The triangles of a mesh: the numbers of three vertices each, from 0, counter-clockwise as seen from outside. They live as
// long as the mesh; null for null.
const uint32_t *rfm_mesh_triangles(const struct RfmMesh *mesh);

// Frees a mesh; does nothing with null.
void rfm_mesh_free(struct RfmMesh *mesh);

// Reads and checks a file, with values for `count` of its params; `params` may be null if there are none. `program` is
// null after a failure.
enum RfmStatus rfm_load_file(const char *path,
                             const struct RfmParam *params,
                             size_t count,
                             struct RfmProgram **program,
                             struct RfmError **error);

// Checks a text, with values for `count` of its params. Messages show `name` in place of a path. The text may name no other
// files, see `rfm_load_text_as`. `program` is null after a failure.
enum RfmStatus rfm_load_text(const char *text,
                             const char *name,
                             const struct RfmParam *params,
                             size_t count,
                             struct RfmProgram **program,
                             struct RfmError **error);

// Checks a text that stands for the file with a path, which is not read: the text may name other files in its folder and
// below, and messages show `path`. `program` is null after a failure.
enum RfmStatus rfm_load_text_as(const char *text,
                                const char *path,
                                const struct RfmParam *params,
                                size_t count,
                                struct RfmProgram **program,
                                struct RfmError **error);

// The same file with other values for `count` of its params, as a program of its own; those that are not named keep
// theirs. The file is checked with all of them at once. Each is written as `rfm -D` takes it: "r=0.008", or "r=8 mm",
// whose unit must fit the one that the file writes the param in; a number without a unit is in SI units. `then` is null
// after a failure, and is not the place of the handle given.
enum RfmStatus rfm_program_with(const struct RfmProgram *program,
                                const char *const *settings,
                                size_t count,
                                struct RfmProgram **then,
                                struct RfmError **error);

// The number of solids of a program; 0 for null.
size_t rfm_solid_count(const struct RfmProgram *program);

// The name of solid `index` of a program; null if there are not so many.
const char *rfm_solid_name(const struct RfmProgram *program, size_t index);

// The number of params of a program; 0 for null.
size_t rfm_param_count(const struct RfmProgram *program);

// Param `index` of a program, in the order of the file; false if there are not so many.
bool rfm_param(const struct RfmProgram *program, size_t index, struct RfmParamInfo *param);

// The number of messages that do not prevent the use of a program; 0 for null.
size_t rfm_warning_count(const struct RfmProgram *program);

// Message `index` of those that do not prevent the use of a program; false if there are not so many. `rfm check` also
// measures the solids, and may tell of more.
bool rfm_warning(const struct RfmProgram *program,
                 size_t index,
                 struct RfmDiagnostic *warning);

// Frees a program; does nothing with null.
void rfm_program_free(struct RfmProgram *program);

// Compiles a solid of a program. `solid` is null after a failure.
enum RfmStatus rfm_solid(const struct RfmProgram *program,
                         const char *name,
                         struct RfmSolid **solid,
                         struct RfmError **error);

// The solid during a stretch of time, s, as a handle of its own: values are those at the end, ranges and bounds hold
// for all of it, and paths of `rfm_first_entry` pass from its beginning to its end. Nothing is compiled again. For a
// single time, both ends are equal. `then` is null after a failure, and is not the place of the handle given.
enum RfmStatus rfm_solid_between(const struct RfmSolid *solid,
                                 double from,
                                 double to,
                                 struct RfmSolid **then,
                                 struct RfmError **error);

// The solid for particles in a box, given by its lowest and its highest corner, three numbers each, as a handle of its
// own. All answers stay the same, but rfm_collide with a solid of many parts that has no bounds, such as a vessel with
// posts in it, is much faster in the box.
enum RfmStatus rfm_solid_within(const struct RfmSolid *solid,
                                const double *low,
                                const double *high,
                                struct RfmSolid **then,
                                struct RfmError **error);

// Whether time occurs in the formula.
bool rfm_moves(const struct RfmSolid *solid);

// The smallest known box around a solid: its lowest and its highest corner, m. They are written only if there is
// one; RFM_UNBOUNDED for null.
enum RfmBounds rfm_bounds(const struct RfmSolid *solid,
                          double *low,
                          double *high);

// The least and the greatest value that omega may have in a box, guaranteed; infinite where nothing is known.
enum RfmStatus rfm_range(const struct RfmSolid *solid,
                         const double *low,
                         const double *high,
                         double *range,
                         struct RfmError **error);

// omega at a point; NaN for null, and where the formula has no value. If the file states a tolerance, it is computed
// by the cheapest program that keeps it.
double rfm_omega(const struct RfmSolid *solid,
                 double x,
                 double y,
                 double z);

// `rfm_omega` in single precision throughout.
float rfm_omega_f32(const struct RfmSolid *solid, float x, float y, float z);

// omega at a point, and its gradient, three numbers, which may be null.
double rfm_gradient(const struct RfmSolid *solid, double x, double y, double z, double *gradient);

// `rfm_gradient` in single precision throughout.
float rfm_gradient_f32(const struct RfmSolid *solid, float x, float y, float z, float *gradient);

// Whether a point is inside (1), on the surface (0) or outside (-1): exactly the logic of the parts, each by the sign of
// its rounded formula. NaN where the formula has no value.
double rfm_sign(const struct RfmSolid *solid,
                double x,
                double y,
                double z);

// The surface as seen from a point; all numbers are NaN for null.
struct RfmContact rfm_contact(const struct RfmSolid *solid, double x, double y, double z);

// The radius of a ball around a point that is proven not to meet the surface, m, as `rfm eval --what clearance`: never more
// than the distance, and mostly within 1e-4 of it; positive inside, too, and finite. It takes a thousand times as long as
// `rfm_contact`. NaN for null.
double rfm_clearance(const struct RfmSolid *solid,
                     double x,
                     double y,
                     double z);

// The velocity of the surface near a point, m/s: three numbers, zero for a solid at rest. Of a solid that moves and turns
// without changing its shape it is the whole velocity, of others the part along the normal.
void rfm_wall_velocity(const struct RfmSolid *solid,
                       double x,
                       double y,
                       double z,
                       double *velocity);

// Where the straight path between two points, three numbers each, first meets the solid. False if it does not: it
// is proven that nothing of the path is in the solid, however thin the solid and long the path. `entry` may be null.
// After an error, for null, or for numbers that are not finite, the answer is false as well.
bool rfm_first_entry(const struct RfmSolid *solid,
                     const double *from,
                     const double *to,
                     struct RfmEntry *entry);

// Frees a solid; does nothing with null.
void rfm_solid_free(struct RfmSolid *solid);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* RFM_H */
