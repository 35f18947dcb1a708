// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshing/surface/closing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <utility>

#include <Eigen/Geometry>

#include "libcgs/core/error.h"
#include "libcgs/core/nan.h"
#include "meshing/edit/boolean.h"
#include "meshing/edit/hole_filling.h"
#include "meshing/edit/repair.h"
#include "meshing/edit/simplify.h"
#include "meshing/mesh/components.h"
#include "meshing/mesh/halfedges.h"
#include "meshing/mesh/nearest_surface.h"
#include "meshing/mesh/places.h"
#include "meshing/mesh/self_intersections.h"
#include "meshing/mesh/shells.h"
#include "meshing/mesh/stated_surface.h"
#include "meshing/surface/closed_isosurface.h"
#include "meshing/surface/lidded_volume.h"
#include "meshing/surface/mesh_level_set.h"
#include "meshing/surface/wrapping.h"

namespace cgs {

namespace {

double diagonal_of(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const auto& p : mesh.vertices) box.extend(p.cast<double>());
  return box.isEmpty() ? 0 : box.diagonal().norm();
}

double area_of(const TriangleMesh& mesh) {
  const auto areas = area_by_provenance(mesh);
  return std::accumulate(areas.begin(), areas.end(), 0.0);
}

// A volume so small that it may as well be none: the shape is a sheet.
bool is_flat(double volume, double area) {
  constexpr double kFlat = 1e-3;  // a plate 0.3 % as thick as wide; a ball has 0.094
  return !(std::abs(volume) > kFlat * std::pow(area, 1.5));
}

// Vertices that lie where others do: sheets touch there without hanging together.
std::vector<uint8_t> doubled_vertices(const TriangleMesh& mesh) {
  const std::vector<uint32_t> first = first_at_place(mesh.vertices);
  std::vector<uint8_t> out(first.size(), 0);
  for (uint32_t v = 0; v < first.size(); ++v) {
    if (first[v] != v) out[v] = out[first[v]] = 1;
  }
  return out;
}

// Moves such vertices a little towards their own neighbours, so that the sheets part.
void pull_apart(TriangleMesh& mesh) {
  constexpr float kPull = 0.01f;  // of the way to the neighbours
  const std::vector<uint8_t> doubled = doubled_vertices(mesh);
  std::vector<Eigen::Vector4f> around(mesh.vertices.size(), Eigen::Vector4f::Zero());
  for (const auto& face : mesh.faces) {
    for (size_t k = 0; k < 3; ++k) {
      if (doubled[face.at(k)] == 0) continue;
      for (const size_t other : {k + 1, k + 2}) {
        around[face.at(k)] += mesh.vertices[face.at(other % 3)].homogeneous();
      }
    }
  }
  for (size_t v = 0; v < doubled.size(); ++v) {
    if (doubled[v] == 0 || !(around[v].w() > 0)) continue;
    const Eigen::Vector3f step = kPull * (around[v].hnormalized() - mesh.vertices[v]);
    mesh.vertices[v] += step;
    if (!mesh.sigma.empty()) mesh.sigma[v] = std::hypot(mesh.sigma[v], step.norm());
  }
}

std::vector<uint8_t> open_parts(const TriangleMesh& mesh, const MeshComponents& parts) {
  std::vector<uint8_t> out(parts.area.size(), 0);
  const auto adjacent = halfedges::adjacent_faces(mesh);
  for (uint32_t f = 0; f < adjacent.size(); ++f) {
    for (const uint32_t g : adjacent[f]) {
      if (g == f) out[parts.of_face[f]] = 1;
    }
  }
  return out;
}

enum class Small { Sheets, Anything };

// Without open parts that are small beside the largest; of sheets alone, or whatever they are.
TriangleMesh without_small_open_parts(const TriangleMesh& mesh, Small which) {
  const double share = which == Small::Sheets ? 0.02 : 0.001;  // of the largest part's area
  const MeshComponents parts = components(mesh);
  const std::vector<double> volumes = lidded_volumes(mesh, parts);
  if (volumes.empty()) return mesh;
  const std::vector<uint8_t> open = open_parts(mesh, parts);
  const double largest = *std::max_element(parts.area.begin(), parts.area.end());
  std::vector<uint8_t> keep(mesh.faces.size());
  for (size_t f = 0; f < keep.size(); ++f) {
    const uint32_t part = parts.of_face[f];
    const double area = parts.area[part];
    const bool goes = open[part] != 0 && area < share * largest &&
                      (which == Small::Anything || is_flat(volumes[part], area));
    keep[f] = goes ? 0 : 1;
  }
  return with_faces(mesh, keep);
}

// \param mesh  repaired
TriangleMesh with_sheets_apart(const TriangleMesh& mesh, Small dropped) {
  TriangleMesh out = without_small_open_parts(mesh, dropped);
  if (out.faces.empty()) throw NumericalError("no face with an area is left");
  pull_apart(out);
  return out;
}

TriangleMesh put_right(const TriangleMesh& mesh, Small dropped) {
  return with_sheets_apart(repaired(mesh).mesh, dropped);
}

TriangleMesh filled(const TriangleMesh& mesh) {
  constexpr size_t kLongestRim = 1000;  // of an open scene a wrap is sooner there
  return holes_filled(mesh, std::numeric_limits<double>::max(), {}, kLongestRim).mesh;
}

// Faces that cut others, and those along rims that could not be closed.
std::vector<uint8_t> faces_in_the_way(const TriangleMesh& mesh) {
  std::vector<uint8_t> out(mesh.faces.size(), 0);
  for (const auto& [f, g] : self_intersections(mesh)) out[f] = out[g] = 1;
  const auto adjacent = halfedges::adjacent_faces(mesh);
  for (uint32_t f = 0; f < adjacent.size(); ++f) {
    for (const uint32_t g : adjacent[f]) {
      if (g == f) out[f] = 1;
    }
  }
  return out;
}

TriangleMesh cut_and_filled(TriangleMesh mesh) {
  constexpr int kRounds = 8;
  constexpr double kMost = 0.05;  // of the area, in all rounds together
  double lost = 0;
  const double whole = area_of(mesh);
  for (int round = 0; round < kRounds; ++round) {
    std::vector<uint8_t> drop = faces_in_the_way(mesh);
    if (std::count(drop.begin(), drop.end(), uint8_t(1)) == 0) break;
    for (int ring = 0; ring < round; ++ring) grow_over_vertices(mesh, drop);
    std::vector<uint8_t> keep(drop.size());
    for (size_t f = 0; f < keep.size(); ++f) keep[f] = drop[f] == 0 ? 1 : 0;
    const TriangleMesh rest = put_right(with_faces(mesh, keep), Small::Anything);
    lost += area_of(mesh) - area_of(rest);
    if (lost > kMost * whole) throw NumericalError("too much of the surface would have to go");
    mesh = filled(rest);
  }
  return mesh;
}

std::string percent(double share) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g %%", 100 * share);
  return text.data();
}

MeasurableMesh measurable(const TriangleMesh& mesh) {
  MeasurableMesh out;
  out.mesh = mesh;
  for (const auto& p : mesh.vertices) out.points.push_back(p.cast<double>());
  return out;
}

/// Which shares of a surface lie farther from that of a solid than some distance.
struct SharesOff {
  double outside = 0, inside = 0;
};

SharesOff shares_off(const TriangleMesh& surface, const TriangleMesh& solid, double distance) {
  constexpr size_t kSamples = 20'000;
  const MeasurableMesh around = measurable(solid);
  const NearestSurface nearest(around);
  const std::vector<Eigen::Vector3f> samples = sample_surface(surface, kSamples);
  size_t outside = 0, inside = 0;
  for (const auto& p : samples) {
    const Eigen::Vector3d at = p.cast<double>();
    const double off = nearest.signed_distance(at, nearest.nearest(at));
    outside += off > distance;
    inside += off < -distance;
  }
  const auto all = static_cast<double>(samples.size());
  return {static_cast<double>(outside) / all, static_cast<double>(inside) / all};
}

class Closing {
 public:
  explicit Closing(const TriangleMesh& input) : input_(input), diagonal_(diagonal_of(input)) {}

  bool repair() {
    return attempt("repair", 0, [&] {
      held_against_ = base_ = repaired(input_).mesh;  // for the other ways, whatever fails here
      return held_against_ = base_ = with_sheets_apart(base_, Small::Sheets);
    });
  }

  bool fill() {
    return attempt("fill-holes", 0, [&] {
      base_ = filled(base_);
      const bool may_be_flat = !self_intersections(base_).empty();  // faces of the patches
      if (may_be_flat) base_ = put_right(base_, Small::Sheets);
      return held_against_ = base_;
    });
  }

  bool cut() {
    return attempt("cut-self-intersections", 0, [&] {
      TriangleMesh made = cut_and_filled(base_);
      (void)reference_volume();  // of the surface before it was cut
      if (!is_closed_mesh(base_) && is_closed_mesh(made)) base_ = made;
      return made;
    });
  }

  bool enclose(double voxel) {
    return attempt("level-set", voxel, [&] {
      if (!is_closed_mesh(base_)) throw NumericalError("holes are left that nothing could fill");
      if (std::isnan(reference_volume())) throw NumericalError("the surface surrounds nothing");
      const openvdb::FloatGrid::Ptr field = enclosing_level_set(base_, voxel);
      TriangleMesh made = closed_isosurface(*field).mesh;
      if (made.faces.empty()) throw NumericalError("nothing is left: it is a sheet");
      const StatedSurface source(base_);
      take_evidence(made, source, 2 * voxel);
      return simplify(made, {.max_error = voxel / 4}).mesh;
    });
  }

  bool wrap(double alpha) {
    constexpr double kUsual = 30;  // as CGAL's default
    return attempt("wrap", alpha, [&] {
      WrappedMesh made = wrapped(base_, {.alpha = alpha, .offset = alpha / kUsual});
      behind_ = made.evidence.behind / made.evidence.area;
      return std::move(made.mesh);
    });
  }

  double diagonal() const { return diagonal_; }

  ClosedMesh result() && {
    if (!best_) {
      std::string reasons;
      for (const ClosingAttempt& a : out_.attempts) reasons += "; " + a.way + ": " + a.reason;
      throw NumericalError("no way leads to a certified mesh" + reasons);
    }
    constexpr size_t kSamples = 100'000;
    out_.mesh = std::move(best_->mesh);
    out_.certificate = best_->certificate;
    out_.taken = best_->attempt;
    out_.inside = best_->inside;
    if (reference_) out_.compared_volume = *reference_;
    out_.deviation = mesh_distance(out_.mesh, input_, kSamples);
    return std::move(out_);
  }

 private:
  struct Candidate {
    TriangleMesh mesh;
    Certificate certificate;
    size_t attempt = 0;
    double objection = 0;
    double inside = 0;  // share of the input
  };

  // \return whether nothing speaks against what was made
  bool attempt(const char* way, double size, const std::function<TriangleMesh()>& make) {
    ClosingAttempt& record = out_.attempts.emplace_back(ClosingAttempt{way, size, {}});
    if (base_.faces.empty() && out_.attempts.size() > 1) {
      record.reason = "there is nothing to close";
      return false;
    }
    try {
      Candidate made{make(), {}, out_.attempts.size() - 1, 0, 0};
      made.certificate = certify(made.mesh);
      settle(made);
      record.reason = why_no_solid(made.certificate);
      if (!record.reason.empty()) return false;
      made.objection = object(made, record.reason);
      if (!best_ || made.objection < best_->objection) best_ = std::move(made);
    } catch (const NumericalError& error) {
      record.reason = error.what();
    } catch (const LimitError& error) {
      record.reason = error.what();
    } catch (const std::logic_error& error) {  // what CGAL throws
      record.reason = error.what();
    } catch (const openvdb::Exception& error) {  // of voxels too small for it
      record.reason = error.what();
    }
    return record.reason.empty();
  }

  static void settle(Candidate& made) {
    const Certificate& c = made.certificate;
    if (!c.closed || !c.edge_manifold || !c.vertex_manifold || c.self_intersections > 0) return;
    SettledShells settled = settled_shells(made.mesh);
    if (settled.turned + settled.dropped == 0) return;
    made.mesh = std::move(settled.mesh);
    made.certificate = certify(made.mesh);
  }

  // How much speaks against a certified candidate, and why.
  double object(Candidate& made, std::string& reason) {
    constexpr double kVolume = 0.03;
    constexpr double kOff = 0.005;
    constexpr double kDropped = 0.025;  // of the input, hanging sheets included
    constexpr double kBehind = 0.01;
    constexpr double kFar = 1.0 / 200;  // of the diagonal
    std::vector<std::string> reasons;
    const SharesOff of_input = shares_off(input_, made.mesh, kFar * diagonal_);
    made.inside = of_input.inside;
    const SharesOff off = shares_off(held_against_, made.mesh, kFar * diagonal_);
    const double left_out = std::max(off.outside, of_input.outside);
    if (off.outside > kOff || of_input.outside > kDropped) {
      reasons.push_back("leaves out " + percent(left_out) + " of the surface");
    }
    if (behind_ > kBehind) reasons.push_back("has " + percent(behind_) + " of its area inside");
    const double change = volume_change(made, off.outside + off.inside < kOff);
    if (std::abs(change) > kVolume) {
      reasons.push_back("holds " + percent(std::abs(change)) + (change > 0 ? " more" : " less") +
                        " than the filled surface surrounds");
    }
    for (const std::string& r : reasons) reason += (reason.empty() ? "" : ", ") + r;
    return reasons.empty() ? 0 : left_out + behind_ + std::abs(change);
  }

  // Beside the filled surface. What the first two ways make is that surface, and what passes
  // everywhere near the input surrounds less only where it keeps a cavity.
  double volume_change(const Candidate& made, bool is_near) {
    if (made.attempt < 2) return 0;
    const double volume = reference_volume();
    const double change = std::isnan(volume) ? 0 : made.certificate.volume / volume - 1;
    return is_near && behind_ == 0 ? std::max(0.0, change) : change;
  }

  // What the filled surface surrounds or, where it is open, would with flat lids; NaN for a sheet.
  double reference_volume() {
    if (reference_) return *reference_;
    constexpr double kVoxels = 256;  // along the diagonal
    double volume = kNaN;
    if (is_closed_mesh(base_)) {
      try {
        volume = enclosed_by_level_set(*enclosing_level_set(base_, diagonal_ / kVoxels));
      } catch (const openvdb::Exception&) {  // of voxels too small for it: nothing to hold against
      }
    } else {
      volume = lidded_volume(base_);
    }
    reference_ = is_flat(volume, area_of(base_)) ? kNaN : std::abs(volume);
    return *reference_;
  }

  const TriangleMesh& input_;
  double diagonal_;
  TriangleMesh base_;          // what the next way starts from
  TriangleMesh held_against_;  // repaired and filled, but nothing cut
  std::optional<double> reference_;
  double behind_ = 0;  // share of the last wrap's area that covers the back of the surface
  std::optional<Candidate> best_;
  ClosedMesh out_;
};

}  // namespace

ClosedMesh closed_mesh(const TriangleMesh& mesh, const Progress& progress) {
  require(!mesh.faces.empty(), "the number of faces to close must be > 0", mesh.faces.size());
  Closing closing(mesh);
  bool done = closing.repair();
  report(progress, 0.1);
  done = done || closing.fill();
  report(progress, 0.2);
  done = done || closing.cut();
  report(progress, 0.4);
  for (const double parts : {400.0, 800.0}) {
    done = done || closing.enclose(closing.diagonal() / parts);
  }
  report(progress, 0.6);
  for (const double parts : {100.0, 50.0, 25.0, 12.0}) {
    done = done || closing.wrap(closing.diagonal() / parts);
  }
  report(progress, 0.9);
  return std::move(closing).result();
}

}  // namespace cgs
