// SPDX-License-Identifier: GPL-3.0-or-later
// Damages a closed mesh in many ways, closes every variant as `cgs filter --op watertight` does,
// and tells by kind of damage how far the results are from the undamaged surface.
//
// usage: damaged_solids MESH [VARIANTS [FOLDER]]; FOLDER receives damaged and closed meshes
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "io/meshes/mesh_file.h"
#include "io/meshes/mesh_ply.h"
#include "meshing/edit/boolean.h"
#include "meshing/edit/repair.h"
#include "meshing/surface/closing.h"
#include "tests/support/damaged_mesh.h"

namespace {

struct Tally {
  size_t variants = 0;
  size_t certified = 0;
  size_t doubtful = 0;  // taken though something spoke against it
  std::map<std::string, size_t> ways;
  std::vector<double> rms, max, volume;
  double seconds = 0;
};

double median(std::vector<double> values) {
  if (values.empty()) return NAN;
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

double worst(const std::vector<double>& values) {
  return values.empty() ? NAN : *std::max_element(values.begin(), values.end());
}

void print(const char* name, const Tally& t) {
  std::string ways;
  for (const auto& [way, count] : t.ways) ways += " " + way + " " + std::to_string(count);
  std::printf("%-19s %4zu %9zu %8zu   %.4f %.4f   %.3f %.3f   %.3f %.3f  %6.1f  %s\n",
              name,
              t.variants,
              t.certified,
              t.doubtful,
              100 * median(t.rms),
              100 * worst(t.rms),
              100 * median(t.max),
              100 * worst(t.max),
              100 * median(t.volume),
              100 * worst(t.volume),
              t.seconds / double(std::max<size_t>(t.variants, 1)),
              ways.c_str());
}

class Trial {
 public:
  Trial(cgs::TriangleMesh whole, std::filesystem::path folder)
      : whole_(std::move(whole)), folder_(std::move(folder)) {
    Eigen::AlignedBox3d box;
    for (const auto& p : whole_.vertices) box.extend(p.cast<double>());
    diagonal_ = box.diagonal().norm();
    volume_ = cgs::certify(whole_).volume;
  }

  void run(cgs::test::Damage damage, uint32_t seed, Tally& tally) {
    const cgs::TriangleMesh broken = cgs::test::damaged(whole_, damage, seed);
    const std::string name = std::to_string(seed) + ".ply";
    if (!folder_.empty()) cgs::write_mesh_ply(folder_ / ("damaged" + name), broken, {});
    ++tally.variants;
    const auto start = std::chrono::steady_clock::now();
    try {
      const cgs::ClosedMesh closed = cgs::closed_mesh(broken);
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
      tally.seconds += took.count();
      if (!folder_.empty()) cgs::write_mesh_ply(folder_ / ("closed" + name), closed.mesh, {});
      const cgs::ClosingAttempt& taken = closed.attempts[closed.taken];
      if (cgs::why_no_solid(closed.mesh).empty()) ++tally.certified;
      if (!taken.reason.empty()) ++tally.doubtful;
      ++tally.ways[taken.way];
      constexpr size_t kSamples = 100'000;
      const cgs::MeshDistance off = cgs::mesh_distance(closed.mesh, whole_, kSamples);
      tally.rms.push_back(std::max(off.accuracy.rms, off.completeness.rms) / diagonal_);
      tally.max.push_back(off.hausdorff() / diagonal_);
      tally.volume.push_back(std::abs(closed.certificate.volume / volume_ - 1));
      std::printf("%3u %-19s %-24s max %.3f %% volume %+.3f %% %.1f s  %s\n",
                  seed,
                  std::string(cgs::test::damage_name(damage)).c_str(),
                  taken.way.c_str(),
                  100 * tally.max.back(),
                  100 * (closed.certificate.volume / volume_ - 1),
                  took.count(),
                  taken.reason.c_str());
    } catch (const std::exception& error) {
      std::printf("%3u %s: %s\n", seed, std::string(damage_name(damage)).c_str(), error.what());
    }
  }

 private:
  cgs::TriangleMesh whole_;
  std::filesystem::path folder_;
  double diagonal_ = 0;
  double volume_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 4) {
    std::fprintf(stderr, "usage: damaged_solids MESH [VARIANTS [FOLDER]]\n");
    return 2;
  }
  try {
    cgs::TriangleMesh bare;
    const cgs::TriangleMesh read = cgs::read_mesh_file(argv[1]).content.mesh;
    bare.vertices = read.vertices;
    bare.faces = read.faces;
    const cgs::TriangleMesh whole = cgs::repaired(bare).mesh;
    const std::string reason = cgs::why_no_solid(whole);
    if (!reason.empty()) throw std::runtime_error(std::string(argv[1]) + " " + reason);
    const std::filesystem::path folder = argc > 3 ? argv[3] : "";
    if (!folder.empty()) std::filesystem::create_directories(folder);
    Trial trial(whole, folder);
    std::map<cgs::test::Damage, Tally> tallies;
    const auto variants =
        static_cast<uint32_t>(argc > 2 ? std::strtoul(argv[2], nullptr, 10) : 100);
    for (uint32_t seed = 0; seed < variants; ++seed) {
      const auto damage = cgs::test::kDamages.at(seed % cgs::test::kDamages.size());
      trial.run(damage, seed, tallies[damage]);
      std::fflush(stdout);
    }
    std::printf(
        "\n%zu faces. Errors: median and worst; distances two-sided, in %% of the diagonal\n"
        "%-19s %4s %9s %8s   %-13s   %-11s   %-11s  %6s\n",
        whole.faces.size(),
        "damage",
        "n",
        "certified",
        "doubtful",
        "rms",
        "max",
        "volume %",
        "s");
    size_t certified = 0;
    for (const auto& [damage, tally] : tallies) {
      print(std::string(damage_name(damage)).c_str(), tally);
      certified += tally.certified;
    }
    return certified == variants ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "damaged_solids: %s\n", error.what());
    return 1;
  }
}
