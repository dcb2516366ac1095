// A solid that moves, in C++17, with handles that free themselves and errors that are thrown.

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "rfm.h"

struct Free {
    void operator()(RfmProgram *program) const { rfm_program_free(program); }
    void operator()(RfmSolid *solid) const { rfm_solid_free(solid); }
    void operator()(RfmError *error) const { rfm_error_free(error); }
};
using Program = std::unique_ptr<RfmProgram, Free>;
using Solid = std::unique_ptr<RfmSolid, Free>;

static void check(RfmStatus status, RfmError *error) {
    std::unique_ptr<RfmError, Free> owner(error);
    if (status != RFM_OK) throw std::runtime_error(rfm_error_message(error));
}

static Program load(const char *path) {
    RfmProgram *program = nullptr;
    RfmError *error = nullptr;
    RfmStatus status = rfm_load_file(path, nullptr, 0, &program, &error);
    check(status, error);
    return Program(program);
}

static Solid solid(const Program &program, const char *name) {
    RfmSolid *made = nullptr;
    RfmError *error = nullptr;
    RfmStatus status = rfm_solid(program.get(), name, &made, &error);
    check(status, error);
    return Solid(made);
}

static Solid at(const Solid &of, double time) {
    RfmSolid *made = nullptr;
    RfmError *error = nullptr;
    RfmStatus status = rfm_solid_between(of.get(), time, time, &made, &error);
    check(status, error);
    return Solid(made);
}

int main(int count, char **arguments) {
    try {
        Program program = load(count > 1 ? arguments[1] : "examples/gate.rfm");
        Solid gate = solid(program, "gate");
        // two threads ask the same solid, each at its own time
        std::vector<double> heights(2);
        std::vector<std::thread> threads;
        for (std::size_t k = 0; k < 2; k++) {
            threads.emplace_back([&, k] {
                Solid then = at(gate, 2.0 * static_cast<double>(k));
                double low[3], high[3];
                if (rfm_bounds(then.get(), low, high) == RFM_WITHIN) heights[k] = low[2];
            });
        }
        for (auto &thread : threads) thread.join();
        std::printf("the gate %s\n", heights[1] > heights[0] + 1e-6 ? "has risen" : "stands still");
        // single precision, one column after the other
        std::vector<float> x(100, 0.0f), y(100, 0.0f), z(100), omega(100);
        for (std::size_t i = 0; i < 100; i++) z[i] = 0.01f * static_cast<float>(i);
        RfmError *error = nullptr;
        RfmStatus status = rfm_omega_many_f32(gate.get(), 100, {x.data(), y.data(), z.data(), sizeof(float)},
                                              {omega.data(), sizeof(float)}, &error);
        check(status, error);
        int same = 0;
        for (std::size_t i = 0; i < 100; i++) same += omega[i] == rfm_omega_f32(gate.get(), x[i], y[i], z[i]);
        std::printf("%d of 100 values have the bits of single points\n", same);
        load("no/such.rfm");
    } catch (const std::runtime_error &error) {
        std::printf("caught: %s\n", error.what());
        return 0;
    }
    return 1;
}
