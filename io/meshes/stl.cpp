// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/stl.h"

#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <string_view>

#include <Eigen/Geometry>

#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_reader.h"
#include "io/bytes/byte_writer.h"
#include "io/bytes/mesh_arrays.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr size_t kHeader = 80;
constexpr std::string_view kOwn = "cgs binary STL, unit mm";  // must not begin with "solid"

// "62 % seen by photographs", by area.
std::string seen_share(const TriangleMesh& mesh) {
  const auto area = area_by_provenance(mesh);
  const double seen = area[size_t(Provenance::Observed)] + area[size_t(Provenance::SingleView)];
  const double all = std::accumulate(area.begin(), area.end(), 0.0);
  return std::to_string(std::lround(all > 0 ? 100 * seen / all : 0)) + " % seen by photographs";
}

}  // namespace

void write_stl(const std::filesystem::path& path,
               const TriangleMesh& mesh,
               const Frame& frame,
               const Eigen::Matrix3d& up_rotation) {
  require_writable(mesh, "write_stl");
  require_printable_solid(mesh, frame, "write_stl");
  std::string header(kOwn);
  const std::string origin = origin_in_millimetres(frame, up_rotation);
  if (!origin.empty()) header += ", add " + origin;
  const std::string evidence = ", " + seen_share(mesh);
  if (!mesh.provenance.empty() && header.size() + evidence.size() <= kHeader) header += evidence;
  header.resize(kHeader, ' ');
  append_bytes(header, static_cast<uint32_t>(mesh.faces.size()));
  AtomicFile file(path);
  file.write(header);
  std::string record;
  for (const auto& face : mesh.faces) {
    std::array<Eigen::Vector3f, 3> corner;
    for (size_t k = 0; k < 3; ++k) {
      corner.at(k) = millimetres(mesh.vertices[face.at(k)], frame, up_rotation).cast<float>();
    }
    const Eigen::Vector3d a = (corner[1] - corner[0]).cast<double>();
    const Eigen::Vector3d b = (corner[2] - corner[0]).cast<double>();
    const Eigen::Vector3d normal = a.cross(b).stableNormalized();
    record.clear();
    for (const double c : normal) append_bytes(record, static_cast<float>(c));
    for (const Eigen::Vector3f& p : corner) {
      for (const float c : p) append_bytes(record, c);
    }
    append_bytes(record, uint16_t{0});
    file.write(record);
  }
  file.commit();
}

bool is_own_stl(const std::filesystem::path& path) {
  try {
    return read_file_start(path, kOwn.size()) == kOwn;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace cgs
