// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/next_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "libcgs/core/angle_between.h"
#include "libcgs/core/error.h"
#include "libcgs/core/thinned.h"

namespace cgs {

namespace {

constexpr double kDegree = std::numbers::pi / 180;

void judge(const Model& model, const std::vector<SupportView>& inputs, NextView& view) {
  constexpr int kSide = 160;  // [pixels]; small enough to rank many, large enough to show the open
  const RenderBuffers buffers = render_camera(model, inputs, resized_to_fit(view.camera, kSide));
  size_t open = 0;
  size_t unsure = 0;
  size_t shared = 0;
  for (const Hole hole : buffers.hole.data) {
    open += is_hole(hole) ? 1 : 0;
    unsure += hole == Hole::Estimated ? 1 : 0;
    shared += hole == Hole::None ? 1 : 0;
  }
  const auto all = static_cast<double>(buffers.hole.data.size());
  view.open = double(open) / all;
  view.unsure = double(unsure) / all;
  view.shared = double(shared) / all;
  constexpr double kEnough = 0.4;
  view.worth = (view.open + 0.5 * view.unsure) * std::min(1.0, view.shared / kEnough);
}

// Where it stands, as seen from the nearest input view, around what that looks at.
void place(const Model& model, const Subjects& subjects, NextView& view) {
  const auto nearest = nearest_input(model, subjects, view.camera.center());
  if (!nearest) return;
  view.nearest = nearest->input;
  const Camera& input = input_camera(model, view.nearest);
  const Eigen::Vector3d& around = *subjects[view.nearest];
  const Eigen::Vector3d from = input.center() - around;
  const Eigen::Vector3d to = view.camera.center() - around;
  view.farther = to.norm() / from.norm();
  const Eigen::Vector3d own = input.world_from_cam.rotation().transpose() * to;
  const Eigen::Vector3d before = input.world_from_cam.rotation().transpose() * from;
  // About the axes of its picture; y is down, and z looks away from the camera.
  view.right = std::remainder(std::atan2(own.x(), -own.z()) - std::atan2(before.x(), -before.z()),
                              2 * std::numbers::pi);
  view.higher = std::atan2(-own.y(), std::hypot(own.x(), own.z())) -
                std::atan2(-before.y(), std::hypot(before.x(), before.z()));
}

// An input camera turned around a point, about the axes of its picture.
Camera turned(const Camera& camera, const Eigen::Vector3d& around, double right, double higher) {
  const Eigen::Matrix3d axes = camera.world_from_cam.rotation();
  const Eigen::AngleAxisd aside(-right, axes.col(1));
  const Eigen::AngleAxisd up(-higher, aside * Eigen::Vector3d(axes.col(0)));
  const Eigen::Matrix3d turn = (up * aside).toRotationMatrix();
  Camera out = camera;
  out.world_from_cam.linear() = turn * axes;
  out.world_from_cam.translation() = around + turn * (camera.center() - around);
  return out;
}

}  // namespace

std::vector<NextView> rank_next_views(const Model& model,
                                      std::vector<NextView> candidates,
                                      const Progress& progress) {
  require(!model.priors.empty(),
          "what to photograph next is told by the input views of a model; the number of these",
          model.priors.size());
  const std::vector<SupportView> inputs = support_views(model);
  const Subjects seen = subjects_of(model);
  for (size_t i = 0; i < candidates.size(); ++i) {
    report(progress, double(i) / double(candidates.size()));
    judge(model, inputs, candidates[i]);
    place(model, seen, candidates[i]);
  }
  std::stable_sort(candidates.begin(), candidates.end(), [](const NextView& a, const NextView& b) {
    return a.worth > b.worth;
  });
  return candidates;
}

std::vector<NextView> places_around(const Model& model, size_t most_views) {
  const Subjects seen = subjects_of(model);
  std::vector<size_t> looking;
  for (size_t k = 0; k < seen.size(); ++k) {
    if (seen[k]) looking.push_back(k);
  }
  std::vector<NextView> out;
  for (const size_t k : thinned(looking, most_views)) {
    const auto add = [&](double right, double higher) {
      NextView& view = out.emplace_back();
      view.camera = turned(input_camera(model, k), *seen[k], right * kDegree, higher * kDegree);
    };
    for (const double right : {-45.0, -30.0, -15.0, 15.0, 30.0, 45.0}) add(right, 0);
    for (const double right : {-20.0, 0.0, 20.0}) {
      for (const double higher : {-20.0, 20.0}) add(right, higher);
    }
  }
  if (out.empty()) throw NumericalError("no depth is known around which one could look");
  return out;
}

std::vector<NextView> apart(const Model& model, const std::vector<NextView>& ranked, size_t count) {
  constexpr double kApart = 15 * kDegree;
  const Subjects seen = subjects_of(model);
  std::vector<NextView> out;
  for (const NextView& view : ranked) {
    const Eigen::Vector3d& around = *seen[view.nearest];
    const bool is_new = std::none_of(out.begin(), out.end(), [&](const NextView& before) {
      return angle_between(view.camera.center() - around, before.camera.center() - around) <
             0.99 * kApart;
    });
    if (is_new && view.worth > 0) out.push_back(view);
    if (out.size() == count) break;
  }
  return out;
}

}  // namespace cgs
