// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/pictures/seam_levelling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <tbb/parallel_for.h>

#include "libcgs/core/bilinear.h"
#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/core/texture_corners.h"
#include "meshing/mesh/halfedges.h"
#include "meshing/mesh/projected_faces.h"
#include "meshing/mesh/vertex_faces.h"

namespace cgs {

namespace {

constexpr int kPadding = 8;  // [pixels]; as much as files keep around faces

/// An edge between faces of two photographs.
struct Seam {
  std::array<uint32_t, 2> ends;
  std::array<int, 2> photographs;
  double length = 0;  ///< [internal units]
  /// How much brighter the first of them is along the halves at its ends.
  std::array<Eigen::Vector3d, 2> step;
  /// The same of the surface around the ends: what of it is of light.
  std::array<Eigen::Vector3d, 2> light;
};

Eigen::Vector3d shown_color(const Photograph& photograph, const Eigen::Vector3d& point) {
  const Eigen::Vector3f uvz = photograph.camera.project(point).cast<float>();
  return color_at(photograph.image, uvz.x(), uvz.y()).cast<double>();
}

/// The mean of differences along the half of an edge that begins at `end`.
Eigen::Vector3d step_around(const Photograph& a,
                            const Photograph& b,
                            const Eigen::Vector3d& end,
                            const Eigen::Vector3d& other) {
  constexpr std::array<double, 3> kShares = {0.0, 0.25, 0.5};
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const double share : kShares) {
    const Eigen::Vector3d p = (1 - share) * end + share * other;
    sum += shown_color(a, p) - shown_color(b, p);
  }
  return sum / kShares.size();
}

/// The median of some differences, drawn to 0 as far as their scatter explains it: detail that lies
/// a little off in one photograph is no light.
double light_of(const std::vector<double>& steps) {
  const double middle = median_of(steps);
  constexpr double kOfMedian = 1.2533;  // its standard error over that of the mean
  const double sigma = kOfMedian * robust_deviation(steps) / std::sqrt(double(steps.size()));
  if (std::abs(middle) <= sigma) return 0;
  return middle * (1 - sigma * sigma / (middle * middle));
}

/// How much brighter one photograph is than another on the faces around a vertex.
Eigen::Vector3d light_around(const TriangleMesh& mesh,
                             std::span<const uint32_t> faces,
                             const Photograph& a,
                             const Photograph& b) {
  std::array<std::vector<double>, 3> steps;
  for (const uint32_t f : faces) {
    std::array<Eigen::Vector3f, 3> corner;
    for (size_t k = 0; k < 3; ++k) corner.at(k) = mesh.vertices[mesh.faces[f].at(k)];
    const Eigen::Vector3f middle = (corner[0] + corner[1] + corner[2]) / 3;
    for (const Eigen::Vector3f& c : corner) {
      const Eigen::Vector3d p = (0.5f * (middle + c)).cast<double>();
      const Eigen::Vector3d step = shown_color(a, p) - shown_color(b, p);
      for (size_t k = 0; k < 3; ++k) steps.at(k).push_back(step[Eigen::Index(k)]);
    }
  }
  return {light_of(steps[0]), light_of(steps[1]), light_of(steps[2])};
}

std::vector<Seam> seams_of(const TriangleMesh& mesh, const PhotoTexture& texture) {
  const auto adjacent = halfedges::adjacent_faces(mesh);
  const VertexFaces around = faces_of_vertices(mesh.vertices.size(), mesh.faces);
  std::vector<Seam> out;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t g = adjacent[f].at(k);
      const int a = texture.of_face[f];
      const int b = texture.of_face[g];
      if (g <= f || a < 0 || b < 0 || a == b) continue;
      const std::array<uint32_t, 2> ends = {mesh.faces[f].at(k), mesh.faces[f].at((k + 1) % 3)};
      const Eigen::Vector3d p = mesh.vertices[ends[0]].cast<double>();
      const Eigen::Vector3d q = mesh.vertices[ends[1]].cast<double>();
      const Photograph& first = texture.photographs[static_cast<size_t>(a)];
      const Photograph& second = texture.photographs[static_cast<size_t>(b)];
      out.push_back({ends,
                     {a, b},
                     (q - p).norm(),
                     {step_around(first, second, p, q), step_around(first, second, q, p)},
                     {light_around(mesh, around.of(ends[0]), first, second),
                      light_around(mesh, around.of(ends[1]), first, second)}});
    }
  }
  return out;
}

/// The membrane: half of the sum over faces of the squared slope and of (value / reach)^2, and of
/// the squared remaining steps along seams, as if a strip of membrane lay between the two sides.
class Membrane {
 public:
  explicit Membrane(size_t corners) : right_(Eigen::MatrixX3d::Zero(Eigen::Index(corners), 3)) {}

  /// \param corners  their numbers
  /// \param reach    [internal units]
  void add_face(const TriangleMesh& mesh,
                size_t f,
                const std::array<size_t, 3>& corners,
                double reach) {
    std::array<Eigen::Vector3d, 3> p;
    for (size_t k = 0; k < 3; ++k) p.at(k) = mesh.vertices[mesh.faces[f].at(k)].cast<double>();
    const double area = face_area(mesh, mesh.faces[f]);
    for (size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d a = p.at((k + 1) % 3) - p.at(k);
      const Eigen::Vector3d b = p.at((k + 2) % 3) - p.at(k);
      constexpr double kNotNothing = 1e-9;  // a face without area and neighbours is held, too
      add(corners.at(k), corners.at(k), area / (3 * reach * reach) + kNotNothing);
      // Half the cotangent, of slivers within bounds: obtuse angles would push apart.
      constexpr double kLeast = 0.05;
      constexpr double kMost = 5;
      const double twice_area = a.cross(b).norm();
      const double cotangent = twice_area > 0 ? a.dot(b) / twice_area : kLeast;
      join(corners.at((k + 1) % 3),
           corners.at((k + 2) % 3),
           std::clamp(cotangent / 2, kLeast, kMost));
    }
  }

  /// Draws value(a) - value(b) + step to 0.
  void add_step(size_t a, size_t b, const Eigen::Vector3d& step, double weight) {
    join(a, b, weight);
    right_.row(Eigen::Index(a)) -= weight * step;
    right_.row(Eigen::Index(b)) += weight * step;
  }

  /// \return per corner what is to be added
  Eigen::MatrixX3d solve() const {
    Eigen::SparseMatrix<double> matrix(right_.rows(), right_.rows());
    matrix.setFromTriplets(entries_.begin(), entries_.end());
    // Its graph is that of a surface, of which factors stay sparse: twenty times as fast as
    // conjugate gradients, whose steps must go the way of the reach.
    return Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(right_);
  }

 private:
  void add(size_t row, size_t column, double value) {
    entries_.emplace_back(static_cast<int>(row), static_cast<int>(column), value);
  }
  void join(size_t a, size_t b, double weight) {
    add(a, a, weight);
    add(b, b, weight);
    add(a, b, -weight);
    add(b, a, -weight);
  }

  std::vector<Eigen::Triplet<double>> entries_;
  Eigen::MatrixX3d right_;
};

Eigen::MatrixX3d offsets(const TriangleMesh& mesh,
                         const PhotoTexture& texture,
                         const TextureCorners& corners,
                         const std::vector<Seam>& seams,
                         double pixel,
                         const SeamLevellingOptions& options) {
  Membrane membrane(corners.size());
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const int i = texture.of_face[f];
    if (i < 0) continue;
    const auto& [a, b, c] = mesh.faces[f];
    membrane.add_face(
        mesh, f, {corners(a, i), corners(b, i), corners(c, i)}, options.reach * pixel);
  }
  for (const Seam& seam : seams) {
    for (size_t k = 0; k < 2; ++k) {
      const Eigen::Vector3d& step = seam.light.at(k);
      const double trust = 1 / (1 + step.squaredNorm() / (3 * options.outlier * options.outlier));
      membrane.add_step(corners(seam.ends.at(k), seam.photographs[0]),
                        corners(seam.ends.at(k), seam.photographs[1]),
                        step,
                        trust * seam.length / (2 * options.gap * pixel));
    }
  }
  return membrane.solve();
}

/// The mean along seams once `added` is on the corners.
double mean_step(const std::vector<Seam>& seams,
                 const TextureCorners& corners,
                 const Eigen::MatrixX3d& added) {
  double sum = 0;
  double length = 0;
  for (const Seam& seam : seams) {
    for (size_t k = 0; k < 2; ++k) {
      const auto on = [&](size_t side) {
        return added.row(Eigen::Index(corners(seam.ends.at(k), seam.photographs.at(side))));
      };
      sum += seam.length * (seam.step.at(k).transpose() + on(0) - on(1)).cwiseAbs().mean();
      length += seam.length;
    }
  }
  return sum / length;
}

/// What is added to the pixels of one photograph, and which pixels faces cover.
struct AddedPixels {
  ColorImage color;
  MaskMap known;

  AddedPixels(int width, int height)
      : color(width, height, Eigen::Vector3f::Zero()), known(width, height, 0) {}

  /// Goes on outwards by a pixel: the mean of the neighbours that are known.
  void grow() {
    const MaskMap before = known;
    for (int y = 0; y < known.height; ++y) {
      for (int x = 0; x < known.width; ++x) {
        if (before(x, y) != 0) continue;
        Eigen::Vector3f sum = Eigen::Vector3f::Zero();
        float count = 0;
        for (const auto& [i, j] : {std::pair(x - 1, y), {x + 1, y}, {x, y - 1}, {x, y + 1}}) {
          if (!before.contains(i, j) || before(i, j) == 0) continue;
          sum += color(i, j);
          ++count;
        }
        if (count == 0) continue;
        color(x, y) = sum / count;
        known(x, y) = 1;
      }
    }
  }
};

void add_to_photograph(const TriangleMesh& mesh,
                       const PhotoTexture& texture,
                       int photograph,
                       const TextureCorners& corners,
                       const Eigen::MatrixX3d& added,
                       ColorImage& image) {
  const Camera& camera = texture.photographs[static_cast<size_t>(photograph)].camera;
  AddedPixels pixels(image.width, image.height);
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    if (texture.of_face[f] != photograph) continue;
    std::array<Eigen::Vector3f, 3> corner;
    Eigen::Matrix3f values;
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t v = mesh.faces[f].at(k);
      corner.at(k) = camera.project(mesh.vertices[v].cast<double>()).cast<float>();
      values.col(Eigen::Index(k)) =
          added.row(Eigen::Index(corners(v, photograph))).transpose().cast<float>();
    }
    for_each_pixel<float>(corner,
                          {0, 0, image.width, image.height},
                          [&](int x, int y, const Eigen::Vector3f& weights, float) {
                            pixels.color(x, y) = values * weights;
                            pixels.known(x, y) = 1;
                          });
  }
  for (int i = 0; i < kPadding; ++i) pixels.grow();
  for (size_t p = 0; p < image.data.size(); ++p) {
    if (pixels.known.data[p] == 0) continue;
    image.data[p] = (image.data[p] + pixels.color.data[p]).cwiseMax(0.0f).cwiseMin(1.0f);
  }
}

}  // namespace

void SeamLevellingOptions::validate() const {
  require(reach > 0 && std::isfinite(reach), "SeamLevellingOptions.reach must be > 0", reach);
  require(gap > 0 && std::isfinite(gap), "SeamLevellingOptions.gap must be > 0", gap);
  require(
      outlier > 0 && std::isfinite(outlier), "SeamLevellingOptions.outlier must be > 0", outlier);
}

SeamLevelling level_seams(const TriangleMesh& mesh,
                          PhotoTexture& texture,
                          double pixel,
                          const SeamLevellingOptions& options) {
  options.validate();
  const std::vector<Seam> seams = seams_of(mesh, texture);
  if (seams.empty()) return {};
  require(pixel > 0 && std::isfinite(pixel), "level_seams: pixel must be > 0", pixel);
  const TextureCorners corners(mesh.faces, texture.of_face, mesh.vertices.size());
  const Eigen::MatrixX3d added = offsets(mesh, texture, corners, seams, pixel, options);
  tbb::parallel_for(size_t(0), texture.photographs.size(), [&](size_t i) {
    add_to_photograph(
        mesh, texture, static_cast<int>(i), corners, added, texture.photographs[i].image);
  });
  const Eigen::MatrixX3d none = Eigen::MatrixX3d::Zero(added.rows(), 3);
  return {mean_step(seams, corners, none), mean_step(seams, corners, added)};
}

}  // namespace cgs
