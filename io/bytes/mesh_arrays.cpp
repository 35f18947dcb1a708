// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/mesh_arrays.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

void require_length(size_t length, size_t expected, const std::string& what) {
  require(length == 0 || length == expected,
          what + " must be empty or " + std::to_string(expected) + " long",
          length);
}

}  // namespace

void require_writable(const TriangleMesh& mesh, std::string_view writer) {
  const std::string prefix = std::string(writer) + ": TriangleMesh.";
  const size_t n = mesh.vertices.size();
  require_length(mesh.normals.size(), n, prefix + "normals");
  require_length(mesh.colors.size(), n, prefix + "colors");
  require_length(mesh.support.size(), n, prefix + "support");
  require_length(mesh.sigma.size(), n, prefix + "sigma");
  require_length(mesh.provenance.size(), mesh.faces.size(), prefix + "provenance");
  for (const Eigen::Vector3f& v : mesh.vertices) {
    require(v.allFinite(), prefix + "vertices must be finite", v.transpose());
  }
  for (const auto& face : mesh.faces) {
    const uint32_t largest = std::max({face[0], face[1], face[2]});
    require(largest < n, prefix + "faces must name vertices below " + std::to_string(n), largest);
  }
  for (const Provenance label : mesh.provenance) {
    require(static_cast<size_t>(label) < kProvenanceCount,
            prefix + "provenance must be a Provenance",
            static_cast<int>(label));
  }
}

void require_printable_solid(const TriangleMesh& mesh,
                             const Frame& frame,
                             std::string_view writer) {
  const std::string prefix = std::string(writer) + ": ";
  require(frame.has_metric_scale(),
          prefix +
              "the scale must be known, or the part would come out in a wrong size; "
              "metres_per_unit must be > 0",
          frame.metres_per_unit);
  require(!mesh.faces.empty() && mesh.faces.size() <= std::numeric_limits<uint32_t>::max(),
          prefix + "number of faces must be 1 to 2^32 - 1",
          mesh.faces.size());
}

Eigen::Vector3d millimetres(const Eigen::Vector3f& point,
                            const Frame& frame,
                            const Eigen::Matrix3d& up_rotation) {
  return 1e3 * frame.metres_per_unit *
         (up_rotation * frame.file_from_internal(point.cast<double>()));
}

std::string origin_in_millimetres(const Frame& frame, const Eigen::Matrix3d& up_rotation) {
  if (frame.file_origin.isZero(0)) return "";
  const Eigen::Vector3d p = 1e3 * frame.metres_per_unit * (up_rotation * frame.file_origin);
  // Micrometres, or nine digits where those would be too many for the header of an STL.
  const bool is_far = !(p.cwiseAbs().maxCoeff() < 1e11);
  std::string out;
  for (const double c : p) {
    std::array<char, 40> text{};
    const auto end = is_far
                         ? std::to_chars(text.begin(), text.end(), c, std::chars_format::general, 9)
                         : std::to_chars(text.begin(), text.end(), c, std::chars_format::fixed, 3);
    out += (out.empty() ? "" : " ") + std::string(text.begin(), end.ptr);
  }
  return out;
}

uint8_t color_byte(float value) {
  if (!(value > 0)) return 0;
  return static_cast<uint8_t>(std::lround(std::min(value, 1.0f) * 255.0f));
}

}  // namespace cgs
