#pragma once

#include <sys/types.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "coupler/base/case_common.hpp"
#include "coupler/base/command_line.hpp"
#include "coupler/base/errors.hpp"
#include "coupler/link/checkpoint_place.hpp"
#include "coupler/link/participant.hpp"

/// The problem that the two toy participants solve: a gas column of length 1 m, closed at x = 0,
/// with a piston on a spring at its other end, swinging in an eigenmode of small amplitude. Exact
/// in the limit of small amplitude: xi(x, t) = A sin(k x) sin(omega t), k = omega / c, where
///   M omega^2 = K + rho c omega cot(omega L / c)
/// is the balance of the piston (spring K, mass M, both per area; the gas pushes outward).
namespace toy {

inline constexpr double rho = 1.0;  ///< kg/m^3
inline constexpr double p0 = 1.0;   ///< Pa, ambient
inline constexpr double gamma = 1.4;
inline constexpr double length = 1.0;      ///< m
inline constexpr double wave_phase = 1.0;  ///< omega L / c
/// Relative amplitude: the neglected terms are of this order, far below the errors measured.
inline constexpr double amplitude = 1e-6;  ///< m

inline double sound_speed() {
  return std::sqrt(gamma * p0 / rho);
}
inline double omega() {
  return wave_phase * sound_speed() / length;
}
inline double spring(double mass) {
  return mass * omega() * omega() - rho * sound_speed() * omega() / std::tan(wave_phase);
}
inline double exact_displacement(double t) {
  return amplitude * std::sin(wave_phase) * std::sin(omega() * t);
}
inline double exact_velocity(double t) {
  return amplitude * std::sin(wave_phase) * omega() * std::cos(omega() * t);
}
/// Gas pressure at the piston minus ambient: -rho c^2 d(xi)/dx at x = L.
inline double exact_overpressure(double t) {
  return -rho * sound_speed() * omega() * amplitude * std::cos(wave_phase) * std::sin(omega() * t);
}

/// Misbehaviour on order, for the fault tests.
struct Fault {
  std::string kind;  ///< empty: none
  std::int64_t window = 0;

  void declare(ocublast::Section& section) {
    section.text("fault", kind, {.help = "misbehaviour of this toy"});
    section.integer("fault_window", window, {.min = 0, .help = "window in which it happens"});
  }
  /// A fault that is not part of the case, so that the run can be resumed without it: the
  /// environment variable OCU_TOY_FAULT_FLOW or _SOLID holds KIND@WINDOW.
  void from_environment(const char* variable) {
    const char* given = std::getenv(variable);
    if (given == nullptr) return;
    const std::string text = given;
    kind = text.substr(0, text.find('@'));
    window = std::stoll(text.substr(text.find('@') + 1));
  }
  [[nodiscard]] bool now(std::uint64_t w) const {
    return !kind.empty() && static_cast<std::int64_t>(w) == window;
  }
  [[nodiscard]] bool is(const char* what, std::uint64_t w) const { return kind == what && now(w); }

  /// Says where it hangs, so that a test need not guess when it does.
  [[noreturn]] void hang(const std::string& where) const {
    std::printf("hangs in %s\n", where.c_str());
    std::fflush(stdout);
    while (true) std::this_thread::sleep_for(std::chrono::hours(1));
  }
  /// Waits for the file that the environment variable OCU_TOY_GO names; puts one with ".here"
  /// beside it to say that it does.
  static void await_go() {
    const char* file = std::getenv("OCU_TOY_GO");
    if (file == nullptr) throw ocublast::CaseError("this fault needs OCU_TOY_GO");
    std::ofstream(std::string(file) + ".here").close();
    while (!std::filesystem::exists(file))
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }

  /// Faults that do not depend on what is computed.
  void happen(std::uint64_t w) const {
    if (is("kill", w)) ::kill(::getpid(), SIGKILL);
    if (is("stop", w)) ::kill(::getpid(), SIGSTOP);
    if (is("exit", w)) std::_Exit(4);
    if (is("hang", w)) hang("window " + std::to_string(w));
    if (is("hold", w)) await_go();
    if (is("late", w)) std::this_thread::sleep_for(std::chrono::milliseconds(300));
    if (is("interrupt", w))
      ::kill(::getppid(), SIGINT);  // as Ctrl-C at the coupler that started this toy
    if (is("abort", w)) throw ocublast::NumericsError("negative density in cell 7");
  }
  /// Dies, freezes or hangs at the first occasion of this name: "start" (before HELLO), "hello"
  /// (before the mesh), "ready" (before READY), "iteration" (the second of a window), "checkpoint",
  /// "farewell".
  void happen_in(const std::string& state) const {
    if (kind == "hang-" + state) hang(state);
    if (kind == "kill-" + state) ::kill(::getpid(), SIGKILL);
    if (kind == "stop-" + state) ::kill(::getpid(), SIGSTOP);
    if (kind == "exit-" + state) std::_Exit(4);
  }
};

/// The piston's face: n x n vertices of a unit square in the plane x = 1 m, and its
/// triangles, which look out of the piston, at the gas (-x).
inline ocublast::link::InterfaceMesh make_face(std::int64_t n) {
  ocublast::link::InterfaceMesh mesh;
  mesh.name = "piston";
  const double step = 1.0 / static_cast<double>(n - 1);
  for (std::int64_t j = 0; j < n; ++j)
    for (std::int64_t i = 0; i < n; ++i)
      mesh.vertices.insert(mesh.vertices.end(),
                           {length, step * static_cast<double>(i), step * static_cast<double>(j)});
  for (std::int64_t j = 0; j + 1 < n; ++j)
    for (std::int64_t i = 0; i + 1 < n; ++i) {
      const auto a = static_cast<std::int32_t>(j * n + i);
      const auto b = static_cast<std::int32_t>(a + n);
      mesh.triangles.insert(mesh.triangles.end(), {a, b, a + 1, a + 1, b, b + 1});
    }
  return mesh;
}

inline void write_doubles(const std::filesystem::path& file, const std::vector<double>& values) {
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(values.data()),
            static_cast<std::streamsize>(values.size() * sizeof(double)));
  out.close();
  if (!out) throw ocublast::LinkError(file.string() + ": cannot be written");
}

inline std::vector<double> read_doubles(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  if (!in) throw ocublast::LinkError(file.string() + ": cannot be read");
  std::vector<double> values(static_cast<std::size_t>(in.tellg()) / sizeof(double));
  in.seekg(0);
  in.read(reinterpret_cast<char*>(values.data()),
          static_cast<std::streamsize>(values.size() * sizeof(double)));
  return values;
}

inline double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace toy
