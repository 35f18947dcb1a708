// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/pictures/face_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"
#include "meshing/mesh/halfedges.h"
#include "meshing/mesh/projected_faces.h"

namespace cgs {

namespace {

constexpr double kMinCosine = 0.1;
constexpr float kDepthTolerance = 1.5f;  // [pixel footprints]

/// What one view shows of a mesh.
class ViewScorer {
 public:
  ViewScorer(const TriangleMesh& mesh, const View& view)
      : mesh_(mesh),
        view_(view),
        eye_(view.camera.center()),
        faces_(projected_faces(mesh, view.camera)),
        nearest_(nearness_map(mesh, view.camera, faces_)),
        // A footprint at depth z is z / f, which in 1 / z is the share 1 / f.
        footprint_(1 / static_cast<float>(std::min(view.camera.fx, view.camera.fy))) {}

  float score(size_t f) const {
    if (!faces_[f].in_front) return 0;
    const Eigen::Vector3d normal = area_vector(mesh_, mesh_.faces[f]);
    const Eigen::Vector3d to_eye = eye_ - mesh_.vertices[mesh_.faces[f][0]].cast<double>();
    const double cosine = normal.dot(to_eye) / (normal.norm() * to_eye.norm());
    if (!(cosine >= kMinCosine)) return 0;
    const auto slope = static_cast<float>(std::sqrt(std::max(0.0, 1 - cosine * cosine)) / cosine);
    if (!is_clear(faces_[f], slope)) return 0;
    const auto& [a, b, c] = faces_[f].corner;
    const double pixels = std::abs(edge_function<float>(a, b, c.x(), c.y()));
    return static_cast<float>(pixels / normal.norm() * cosine);
  }

 private:
  /// \param slope  of the face [footprints of depth per pixel]
  bool is_clear(const ProjectedFace& face, float slope) const {
    const float behind = 1 + kDepthTolerance * footprint_;
    for (const Eigen::Vector3f& corner : face.corner) {
      const float u = corner.x() - 0.5f;
      const float v = corner.y() - 0.5f;
      const float right = static_cast<float>(nearest_.width - 1);
      const float bottom = static_cast<float>(nearest_.height - 1);
      if (!(u >= 0 && v >= 0 && u <= right && v <= bottom)) return false;
      if (!view_.is_usable(static_cast<int>(corner.x()), static_cast<int>(corner.y())))
        return false;
      const Nearest nearest = nearest_between(u, v);
      const float extra = nearest.is_whole ? 0.0f : slope * footprint_;
      if (corner.z() * (behind + extra) < nearest.nearness) return false;
    }
    bool clear = true;
    for_each_pixel(face,
                   {0, 0, nearest_.width, nearest_.height},
                   [&](int x, int y, const Eigen::Vector3f&, float nearness) {
                     clear = clear && nearness * behind >= nearest_(x, y) && view_.is_usable(x, y);
                   });
    return clear;
  }

  struct Nearest {
    float nearness = 0;
    bool is_whole = true;  ///< No pixel around shows nothing.
  };

  /// Bilinear: exact on planes, as 1 / z is linear in the picture. Pixels that show nothing take
  /// no part, or they would hide that the others show something nearer; what is left is that of a
  /// place up to a pixel away.
  Nearest nearest_between(float u, float v) const {
    const int x = std::min(static_cast<int>(u), nearest_.width - 2);
    const int y = std::min(static_cast<int>(v), nearest_.height - 2);
    float sum = 0;
    float weights = 0;
    Nearest out;
    for (int k = 0; k < 4; ++k) {
      const int i = x + (k & 1);
      const int j = y + (k >> 1);
      if (!nearest_.contains(i, j)) continue;
      if (nearest_(i, j) <= 0) out.is_whole = false;
      if (nearest_(i, j) <= 0) continue;
      const float weight =
          (1 - std::abs(u - static_cast<float>(i))) * (1 - std::abs(v - static_cast<float>(j)));
      sum += weight * nearest_(i, j);
      weights += weight;
    }
    if (weights > 0) out.nearness = sum / weights;
    return out;
  }

  const TriangleMesh& mesh_;
  const View& view_;
  Eigen::Vector3d eye_;
  std::vector<ProjectedFace> faces_;
  Raster<float> nearest_;
  float footprint_;  // over depth
};

bool may_have_photograph(const TriangleMesh& mesh, size_t f) {
  return mesh.provenance.empty() || was_seen(mesh.provenance[f]);
}

/// The labelling problem, lengths and areas in internal units.
class Labelling {
 public:
  Labelling(const TriangleMesh& mesh, const FaceScores& scores, double seam_cost)
      : scores_(scores), adjacent_(halfedges::adjacent_faces(mesh)), label_(mesh.faces.size(), -1) {
    const size_t n = mesh.faces.size();
    area_.resize(n);
    length_.resize(n);
    best_.resize(n);
    std::vector<float> densities;
    for (size_t f = 0; f < n; ++f) {
      area_[f] = static_cast<float>(face_area(mesh, mesh.faces[f]));
      for (size_t k = 0; k < 3; ++k) {
        const Eigen::Vector3f& p = mesh.vertices[mesh.faces[f].at(k)];
        length_[f].at(k) = (mesh.vertices[mesh.faces[f].at((k + 1) % 3)] - p).norm();
      }
      for (size_t v = 0; v < scores.views; ++v) {
        if (!(scores(f, v) > best_[f])) continue;
        best_[f] = scores(f, v);
        label_[f] = static_cast<int>(v);
      }
      if (label_[f] >= 0) densities.push_back(best_[f]);
    }
    if (densities.empty()) return;
    seam_cost_ = seam_cost / std::sqrt(double{median(densities)});
  }

  double seam_length() const {
    double sum = 0;
    for (size_t f = 0; f < label_.size(); ++f) {
      for (size_t k = 0; k < 3; ++k) {
        const uint32_t g = adjacent_[f].at(k);
        if (g > f && is_seam(label_[f], label_[g])) sum += double{length_[f].at(k)};
      }
    }
    return sum;
  }

  /// \return how many faces changed
  size_t sweep_faces() {
    size_t changed = 0;
    for (size_t f = 0; f < label_.size(); ++f) {
      if (label_[f] < 0) continue;
      int best = label_[f];
      double lowest = face_energy(f, best);
      for (size_t v = 0; v < scores_.views; ++v) {
        const double energy = face_energy(f, static_cast<int>(v));
        if (!(energy < lowest)) continue;
        lowest = energy;
        best = static_cast<int>(v);
      }
      if (best != label_[f]) ++changed;
      label_[f] = best;
    }
    return changed;
  }

  /// Gives connected regions of one view to a neighbouring view where that lowers the energy, the
  /// smallest first: else a large region would be given to the specks in it.
  /// \return how many regions changed
  size_t sweep_regions() {
    size_t changed = 0;
    std::vector<Region> regions;
    std::vector<uint8_t> seen(label_.size(), 0);
    for (uint32_t f = 0; f < label_.size(); ++f) {
      if (seen[f] == 0 && label_[f] >= 0) regions.push_back(region_from(f, seen));
    }
    std::stable_sort(regions.begin(), regions.end(), [](const Region& a, const Region& b) {
      return a.faces.size() < b.faces.size();
    });
    std::vector<uint8_t> moved(label_.size(), 0);
    for (const Region& region : regions) {
      int best = -1;
      double largest = 0;
      for (size_t v = 0; v < scores_.views; ++v) {
        const double gain = region.seam[v] * seam_cost_ - (region.cost[v] - region.own_cost);
        if (!(gain > largest)) continue;
        largest = gain;
        best = static_cast<int>(v);
      }
      if (best < 0 || touches(region, moved)) continue;
      ++changed;
      for (const uint32_t g : region.faces) {
        label_[g] = best;
        moved[g] = 1;
      }
    }
    return changed;
  }

  std::vector<int> take_labels() { return std::move(label_); }

 private:
  struct Region {
    std::vector<uint32_t> faces;
    std::vector<double> seam;  ///< Length towards each view.
    std::vector<double> cost;  ///< If all of it took each view.
    double own_cost = 0;
  };

  static bool is_seam(int a, int b) { return a >= 0 && b >= 0 && a != b; }

  double cost(size_t f, size_t v) const {
    const float score = scores_(f, v);
    if (!(score > 0)) return std::numeric_limits<double>::infinity();
    return double{area_[f]} * std::log(double{best_[f]} / double{score});
  }

  double face_energy(size_t f, int label) const {
    double energy = cost(f, static_cast<size_t>(label));
    for (size_t k = 0; k < 3; ++k) {
      if (is_seam(label, label_[adjacent_[f].at(k)])) {
        energy += seam_cost_ * double{length_[f].at(k)};
      }
    }
    return energy;
  }

  /// What lies beyond the seams of such a region is no longer what was summed.
  bool touches(const Region& region, const std::vector<uint8_t>& moved) const {
    return std::any_of(region.faces.begin(), region.faces.end(), [&](uint32_t f) {
      return std::any_of(
          adjacent_[f].begin(), adjacent_[f].end(), [&](uint32_t g) { return moved[g] != 0; });
    });
  }

  Region region_from(uint32_t start, std::vector<uint8_t>& seen) const {
    Region out;
    out.seam.assign(scores_.views, 0);
    out.cost.assign(scores_.views, 0);
    out.faces = {start};
    seen[start] = 1;
    const int own = label_[start];
    for (size_t i = 0; i < out.faces.size(); ++i) {
      const uint32_t f = out.faces[i];
      for (size_t v = 0; v < scores_.views; ++v) out.cost[v] += cost(f, v);
      for (size_t k = 0; k < 3; ++k) {
        const uint32_t g = adjacent_[f].at(k);
        if (is_seam(own, label_[g])) {
          out.seam[static_cast<size_t>(label_[g])] += double{length_[f].at(k)};
        }
        if (label_[g] != own || seen[g] != 0) continue;
        seen[g] = 1;
        out.faces.push_back(g);
      }
    }
    out.own_cost = out.cost[static_cast<size_t>(own)];
    return out;
  }

  const FaceScores& scores_;
  std::vector<std::array<uint32_t, 3>> adjacent_;
  std::vector<int> label_;
  std::vector<float> area_;
  std::vector<std::array<float, 3>> length_;  // of the edges of each face
  std::vector<float> best_;                   // score
  double seam_cost_ = 0;                      // [internal units]
};

}  // namespace

FaceScores face_scores(const TriangleMesh& mesh, const std::vector<View>& views) {
  FaceScores out;
  out.views = views.size();
  out.score.assign(mesh.faces.size() * views.size(), 0);
  for (size_t v = 0; v < views.size(); ++v) {
    const ViewScorer scorer(mesh, views[v]);
    tbb::parallel_for(size_t(0), mesh.faces.size(), [&](size_t f) {
      if (may_have_photograph(mesh, f)) out.score[f * out.views + v] = scorer.score(f);
    });
  }
  return out;
}

void FaceViewOptions::validate() const {
  require(seam_cost >= 0 && std::isfinite(seam_cost),
          "FaceViewOptions.seam_cost must be >= 0",
          seam_cost);
}

FaceViews choose_face_views(const TriangleMesh& mesh,
                            const FaceScores& scores,
                            const FaceViewOptions& options) {
  options.validate();
  require(scores.score.size() == mesh.faces.size() * scores.views,
          "choose_face_views: scores must be faces * views long",
          scores.score.size());
  Labelling labelling(mesh, scores, options.seam_cost);
  FaceViews out;
  out.best_seam_length = labelling.seam_length();
  constexpr int kMostRounds = 20;  // both descend, so they end by themselves; this bounds the time
  for (int round = 0; round < kMostRounds; ++round) {
    if (labelling.sweep_faces() + labelling.sweep_regions() == 0) break;
  }
  out.seam_length = labelling.seam_length();
  out.of_face = labelling.take_labels();
  return out;
}

}  // namespace cgs
