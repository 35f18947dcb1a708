// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/camera_path.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "libcgs/core/camera_between.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

/// What the input views look at, and from where on the whole.
struct Subject {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d eye = Eigen::Vector3d::Zero();
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  double distance = 0;  ///< Mean one of the input views.
};

Subject subject_of(const Model& model) {
  Subject out;
  const size_t count = model.scene.input.size();
  Eigen::Vector3d image_up = Eigen::Vector3d::Zero();
  size_t with_depth = 0;
  for (size_t k = 0; k < count; ++k) {
    const Camera& camera = input_camera(model, k);
    out.eye += camera.center() / double(count);
    image_up -= camera.world_from_cam.linear().col(1);
    const std::optional<Eigen::Vector3d> seen = looked_at(model, k);
    if (!seen) continue;
    out.centre += *seen;
    ++with_depth;
  }
  if (with_depth == 0) throw NumericalError("no depth is known that a path could look at");
  out.centre /= double(with_depth);
  for (size_t k = 0; k < count; ++k) {
    out.distance += (input_camera(model, k).center() - out.centre).norm() / double(count);
  }
  // Views from all around have their mean inside of the subject.
  const Eigen::Vector3d off = out.eye - out.centre;
  out.eye = off.norm() < 0.5 * out.distance
                ? input_camera(model, 0).center()
                : Eigen::Vector3d(out.centre + out.distance / off.norm() * off);
  out.up = model.scene.frame.up.isZero() ? image_up.normalized() : model.scene.frame.up;
  return out;
}

Camera looking(Camera like,
               const Eigen::Vector3d& from,
               const Eigen::Vector3d& at,
               const Eigen::Vector3d& up) {
  const Eigen::Vector3d forward = (at - from).normalized();
  Eigen::Vector3d right = forward.cross(up);
  if (right.norm() < 1e-6) right = like.world_from_cam.linear().col(0);
  right = (right - right.dot(forward) * forward).normalized();
  Eigen::Matrix3d axes;
  axes << right, forward.cross(right), forward;
  like.world_from_cam.linear() = axes;
  like.world_from_cam.translation() = from;
  return like;
}

Camera on_spiral(const Model& model, const Subject& subject, double turn) {
  const Camera middle = looking(input_camera(model, 0), subject.eye, subject.centre, subject.up);
  const Eigen::Matrix3d axes = middle.world_from_cam.linear();
  Eigen::Vector3d reach = Eigen::Vector3d::Zero();
  for (size_t k = 0; k < model.scene.input.size(); ++k) {
    const Eigen::Vector3d off = axes.transpose() * (input_camera(model, k).center() - subject.eye);
    reach = reach.cwiseMax(off.cwiseAbs());
  }
  constexpr double kWidest = 0.5;  // of the distance; more is an orbit
  reach = reach.cwiseMin(kWidest * subject.distance);
  constexpr double kFlattest = 0.3;  // views often stand in a row, and a line is no spiral
  const double widest = reach.head<2>().maxCoeff();
  const Eigen::Vector3d off(std::max(reach.x(), kFlattest * widest) * std::cos(turn),
                            std::max(reach.y(), kFlattest * widest) * std::sin(turn),
                            kFlattest * widest * std::sin(2 * turn));
  return looking(middle, subject.eye + axes * off, subject.centre, subject.up);
}

Camera on_orbit(const Model& model, const Subject& subject, double turn) {
  const Eigen::AngleAxisd around(turn, subject.up.normalized());
  const Eigen::Vector3d eye = subject.centre + around * (subject.eye - subject.centre);
  return looking(input_camera(model, 0), eye, subject.centre, subject.up);
}

Camera between(const Model& model, double turn) {
  const size_t last = model.scene.input.size() - 1;
  const double place = 0.5 * (1 - std::cos(turn)) * double(last);
  const size_t k = std::min(static_cast<size_t>(place), last > 0 ? last - 1 : 0);
  const double part = place - double(k);
  Camera out = input_camera(model, 0);
  const Camera& next = input_camera(model, std::min(k + 1, last));
  out.world_from_cam = camera_between(input_camera(model, k), next, part).world_from_cam;
  return out;
}

}  // namespace

std::vector<Camera> camera_path(const Model& model, const std::string& name, int frames) {
  constexpr int kMost = 10'000;
  require(frames >= 2 && frames <= kMost, "a path must have 2 to 10000 frames", frames);
  const bool is_known = name == "between" || name == "spiral" || name == "orbit";
  require(is_known, "a path must be between, spiral, orbit or a .json file of cameras", name);
  require(!model.priors.empty(),
          "a path is laid through the input views of a model of train or run; the number of these",
          model.priors.size());
  const Subject subject = name == "between" ? Subject() : subject_of(model);
  std::vector<Camera> out;
  for (int i = 0; i < frames; ++i) {
    const double turn = 2 * std::numbers::pi * i / frames;
    out.push_back(name == "between"  ? between(model, turn)
                  : name == "spiral" ? on_spiral(model, subject, turn)
                                     : on_orbit(model, subject, turn));
  }
  return out;
}

}  // namespace cgs
