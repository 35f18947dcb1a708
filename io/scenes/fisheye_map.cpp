// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/fisheye_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

namespace cgs {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kWidest = 60 * kDegree;    // of the picture, from its axis to each side
constexpr double kSteepest = 89 * kDegree;  // of rays that a pinhole can still state

double radial_factor(const std::array<double, 4>& k, double angle) {
  const double s = angle * angle;
  return 1 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3])));
}

Eigen::Vector2d tangential(const std::array<double, 2>& p, const Eigen::Vector2d& q) {
  const double s = q.squaredNorm();
  const double xy = q.x() * q.y();
  return {2 * p[0] * xy + p[1] * (s + 2 * q.x() * q.x()),
          p[0] * (s + 2 * q.y() * q.y()) + 2 * p[1] * xy};
}

double fold_angle(const std::array<double, 4>& k) {
  return std::min(fold_radius(k), 0.5 * std::numbers::pi);
}

// The largest circle around the principal point that the photograph holds, in focal lengths.
double circle_of(const Camera& camera) {
  return std::min(std::min(camera.cx, camera.width - camera.cx) / camera.fx,
                  std::min(camera.cy, camera.height - camera.cy) / camera.fy);
}

}  // namespace

FisheyeMap::FisheyeMap(const Fisheye& fisheye) : lens_(fisheye), fold_(fold_angle(fisheye.k)) {
  const Camera& camera = lens_.photograph;
  const auto end = [&](double radius) {  // of the picture, in focal lengths from the axis
    const double angle = angle_at(std::abs(radius));
    is_cropped_ = is_cropped_ || angle > kWidest;
    return std::copysign(std::tan(std::min(angle, kWidest)), radius);
  };
  constexpr double kCentre = 0.5;  // of the outermost pixels: beyond, there is nothing to sample
  const double left = end((kCentre - camera.cx) / camera.fx);
  const double right = end((camera.width - kCentre - camera.cx) / camera.fx);
  const double top = end((kCentre - camera.cy) / camera.fy);
  const double bottom = end((camera.height - kCentre - camera.cy) / camera.fy);
  const auto pixels = [](double length) {
    constexpr double kMaxSide = 1e9;  // check_fisheye() refuses far smaller ones
    return static_cast<int>(std::lround(std::clamp(length, 0.0, kMaxSide)));
  };
  picture_.fx = camera.fx;
  picture_.fy = camera.fy;
  picture_.width = pixels((right - left) * camera.fx);
  picture_.height = pixels((bottom - top) * camera.fy);
  picture_.cx = -left * camera.fx;
  picture_.cy = -top * camera.fy;
}

FisheyeMap FisheyeMap::resized(int width, int height) const {
  const double across = double(width) / lens_.photograph.width;
  const double down = double(height) / lens_.photograph.height;
  FisheyeMap out = *this;
  out.lens_.photograph = cgs::resized(lens_.photograph, width, height);
  out.lens_.radius *= across;
  out.picture_ = cgs::resized(picture_,
                              std::max(1, int(std::lround(across * picture_.width))),
                              std::max(1, int(std::lround(down * picture_.height))));
  return out;
}

// Of the ray that falls at a radius in focal lengths, tangential terms left out; the fold or 90
// degrees for those that none falls at.
double FisheyeMap::angle_at(double radius) const {
  double low = 0;
  double high = fold_;
  if (!(radius < high * radial_factor(lens_.k, high))) return high;
  for (int i = 0; i < 60; ++i) {  // to the last bit of double
    const double middle = 0.5 * (low + high);
    (middle * radial_factor(lens_.k, middle) < radius ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

bool FisheyeMap::shows(const Eigen::Vector2d& in_photograph) const {
  const Eigen::Vector2d middle(0.5 * lens_.photograph.width, 0.5 * lens_.photograph.height);
  return lens_.radius == 0 || (in_photograph - middle).norm() <= lens_.radius;
}

Eigen::Vector2d FisheyeMap::in_photograph(const Eigen::Vector2d& in_picture) const {
  const Eigen::Vector2d ray = picture_.ray_in_cam(in_picture.x(), in_picture.y()).head<2>();
  const double r = ray.norm();
  const double angle = std::atan(r);
  if (!(angle < fold_)) {
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  const Eigen::Vector2d q = r > 0 ? Eigen::Vector2d(angle / r * ray) : ray;
  const Eigen::Vector2d bent = radial_factor(lens_.k, angle) * q + tangential(lens_.p, q);
  const Camera& camera = lens_.photograph;
  return {camera.fx * bent.x() + camera.cx, camera.fy * bent.y() + camera.cy};
}

std::optional<PicturePoint> FisheyeMap::in_picture(const Eigen::Vector2d& in_photograph) const {
  const Eigen::Vector2d bent =
      lens_.photograph.ray_in_cam(in_photograph.x(), in_photograph.y()).head<2>();
  // The radial part is undone exactly, what remains is small and shrinks with every step.
  Eigen::Vector2d q = bent;
  for (int i = 0; i < 30; ++i) {
    const Eigen::Vector2d radial = bent - tangential(lens_.p, q);
    const double radius = radial.norm();
    const Eigen::Vector2d before = q;
    q = radius > 0 ? Eigen::Vector2d(angle_at(radius) / radius * radial) : radial;
    if (q == before) break;
  }
  const double angle = q.norm();
  if (!(angle < std::min(fold_, kSteepest))) return std::nullopt;
  const Eigen::Vector2d ray = angle > 0 ? Eigen::Vector2d(std::tan(angle) / angle * q) : q;
  PicturePoint out{{picture_.fx * ray.x() + picture_.cx, picture_.fy * ray.y() + picture_.cy}};
  constexpr double kUndone = 0.01;  // [pixels]
  if (!((this->in_photograph(out.at) - in_photograph).norm() <= kUndone)) return std::nullopt;
  const double step = 1e-4;  // [radians]
  const double inner = std::max(0.0, angle - step);
  const auto radius = [&](double a) { return a * radial_factor(lens_.k, a); };
  if (angle == 0) return out;
  const double along = (angle - inner) / (radius(angle) - radius(inner));  // [radians]
  const double across = std::sin(angle) / radius(angle);
  out.stretch = std::max(along, across) / std::cos(angle);
  return out;
}

void check_fisheye(const Fisheye& fisheye, const Refuse& refuse) {
  const Camera& camera = fisheye.photograph;
  check_intrinsics(camera, refuse);
  for (const double k : fisheye.k) check_coefficient(k, refuse);
  for (const double p : fisheye.p) check_coefficient(p, refuse);
  if (!(fisheye.radius >= 0)) refuse(Defect::Value, "the radius of what is shown is below 0");
  const double fold = fold_angle(fisheye.k);
  const double reach = fold * radial_factor(fisheye.k, fold);
  if (fold < kWidest && reach < circle_of(camera)) {
    refuse(Defect::Value,
           "the fisheye lens cannot be undone beyond radius " + std::to_string(reach * camera.fx) +
               " pixels, which is inside the image");
  }
  const Camera picture = FisheyeMap(fisheye).picture();
  if (picture.width < 1 || picture.height < 1) {
    refuse(Defect::Value, "the fisheye photograph shows nothing within 60 degrees of its axis");
  }
  check_intrinsics(picture, refuse);
}

}  // namespace cgs
