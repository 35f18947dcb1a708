// SPDX-License-Identifier: GPL-3.0-or-later
// Bias of the path from depth to a measured mesh on solids whose volume and area are known: exact
// depth maps from all around, fused, closed and simplified as `cgs fuse` and `cgs mesh` do.
//
// usage: solid_bias [VOXELS_PER_DIAMETER...]; default 32 64 128
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include <tbb/parallel_for.h>

#include "meshing/edit/simplify.h"
#include "meshing/measure/surface_measures.h"
#include "meshing/surface/watertight.h"
#include "meshing/volume/tsdf.h"
#include "tests/support/depth_scenes.h"

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;

/// A solid of diameter 1 about the origin.
struct ExactSolid {
  std::string name;
  std::function<double(const Vector3d&)> distance;  ///< Never more than the true one outside.
  double volume = 0;
  double area = 0;
};

// Signed distance to a polygon, - inside.
double distance_to(const std::vector<Vector2d>& polygon, const Vector2d& p) {
  double least = 1e30;
  bool inside = false;
  for (size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Vector2d& a = polygon[i];
    const Vector2d e = polygon[j] - a;
    const Vector2d w = p - a;
    const double t = std::clamp(w.dot(e) / e.squaredNorm(), 0.0, 1.0);
    least = std::min(least, (w - t * e).squaredNorm());
    const bool crosses = (a.y() > p.y()) != (polygon[j].y() > p.y());
    if (crosses && p.x() < e.x() * (p.y() - a.y()) / e.y() + a.x()) inside = !inside;
  }
  return (inside ? -1 : 1) * std::sqrt(least);
}

double both(double a, double b) {  // the intersection of two solids at right angles
  return std::min(std::max(a, b), 0.0) + std::hypot(std::max(a, 0.0), std::max(b, 0.0));
}

ExactSolid ball() {
  return {"sphere", [](const Vector3d& p) { return p.norm() - 0.5; }, kPi / 6, kPi};
}

ExactSolid block(const std::string& name, const Vector3d& size) {
  return {name,
          [=](const Vector3d& p) {
            const Vector3d q = p.cwiseAbs() - size / 2;
            return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);
          },
          size.prod(),
          2 * (size.x() * size.y() + size.y() * size.z() + size.z() * size.x())};
}

ExactSolid torus() {
  constexpr double kRing = 0.35;
  constexpr double kTube = 0.15;
  return {
      "torus",
      [](const Vector3d& p) { return std::hypot(std::hypot(p.x(), p.y()) - kRing, p.z()) - kTube; },
      2 * kPi * kPi * kRing * kTube * kTube,
      4 * kPi * kPi * kRing * kTube};
}

ExactSolid cone() {
  constexpr double kHeight = 1;
  const std::vector<Vector2d> profile = {
      {-0.5, -kHeight / 2}, {0.5, -kHeight / 2}, {0, kHeight / 2}};
  return {"cone",
          [=](const Vector3d& p) {
            return distance_to(profile, {std::hypot(p.x(), p.y()), p.z()});
          },
          kPi * 0.25 * kHeight / 3,
          kPi * 0.25 + kPi * 0.5 * std::hypot(0.5, kHeight)};
}

ExactSolid gear() {
  constexpr int kTeeth = 12;
  constexpr double kRoot = 0.38;
  constexpr double kTip = 0.5;
  constexpr double kBore = 0.15;
  constexpr double kThickness = 0.3;
  std::vector<Vector2d> outline;
  for (int tooth = 0; tooth < kTeeth; ++tooth) {
    for (const auto& [radius, at] :
         {std::pair(kRoot, 0.0), {kRoot, 0.4}, {kTip, 0.55}, {kTip, 0.85}}) {
      const double angle = 2 * kPi * (tooth + at) / kTeeth;
      outline.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
    }
  }
  double face = -kPi * kBore * kBore;
  double rim = 2 * kPi * kBore;
  for (size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
    face += (outline[j].x() * outline[i].y() - outline[i].x() * outline[j].y()) / 2;
    rim += (outline[i] - outline[j]).norm();
  }
  return {"gear with bore",
          [=](const Vector3d& p) {
            const Vector2d flat = p.head<2>();
            const double side = std::max(distance_to(outline, flat), kBore - flat.norm());
            return both(side, std::abs(p.z()) - kThickness / 2);
          },
          face * kThickness,
          2 * face + rim * kThickness};
}

// Turned and moved, so that nothing lies along the voxels.
cgs::test::Shape placed(const ExactSolid& solid) {
  const Eigen::Isometry3d body_from_world =
      (Eigen::Translation3d(0.013, -0.027, 0.019) *
       Eigen::AngleAxisd(0.7, Vector3d(0.3, 0.5, 0.8).normalized()))
          .inverse();
  return [=](const Vector3d& origin, const Vector3d& direction) {
    const Vector3d o = body_from_world * origin;
    const Vector3d d = body_from_world.linear() * direction;
    const double length = d.norm();
    constexpr double kHit = 1e-8;
    const double far = o.norm() + 1;
    double t = std::max(0.0, o.norm() - 1);
    while (t < far) {
      const double step = solid.distance(o + t / length * d);
      if (step < kHit) return t / length;
      t += step;
    }
    return cgs::test::kMiss;
  };
}

// A pixel covers a voxel, as where `cgs fuse` chooses the size of voxels.
std::vector<cgs::TsdfView> views_around(const cgs::test::Shape& shape, double voxel) {
  constexpr size_t kViews = 40;
  constexpr double kDistance = 3;
  constexpr double kStatedSigma = 0.001;  // of the depth, as a good depth camera states
  std::vector<cgs::TsdfView> views(kViews);
  tbb::parallel_for(size_t(0), kViews, [&](size_t i) {
    const double z = 1 - 2 * (double(i) + 0.5) / kViews;
    const double turn = kPi * (3 - std::sqrt(5.0)) * double(i);
    const double r = std::sqrt(1 - z * z);
    const Vector3d eye = kDistance * Vector3d(r * std::cos(turn), z, r * std::sin(turn));
    cgs::Camera camera = cgs::test::camera_at(eye, Vector3d::Zero(), 4);
    camera.fx = camera.fy = kDistance / voxel;
    camera.width = camera.height = static_cast<int>(2.2 / voxel);
    camera.cx = camera.cy = 0.5 * camera.width;
    views[i] = cgs::test::photographed(shape, camera);
    views[i].sigma = cgs::DepthMap(camera.width, camera.height, 0);
    for (size_t k = 0; k < views[i].depth.data.size(); ++k) {
      float& depth = views[i].depth.data[k];
      if (std::isnan(depth)) depth = INFINITY;
      views[i].sigma.data[k] = std::isinf(depth) ? 0 : static_cast<float>(kStatedSigma) * depth;
    }
  });
  return views;
}

double bias(double value, double truth) { return 100 * (value / truth - 1); }

void measure(const ExactSolid& solid, int voxels) {
  const double voxel = 1.0 / voxels;
  auto fused = cgs::fuse(views_around(placed(solid), voxel), {.voxel_size = voxel});
  const cgs::WatertightResult closed = cgs::watertight_surface(fused.volume, {});
  const cgs::SimplifyResult simple =
      cgs::simplify(closed.mesh, {.max_error = voxel / 4, .max_error_inferred = voxel});
  const cgs::Certificate certificate = cgs::certify(simple.mesh);
  cgs::MeasurableMesh mesh;
  mesh.mesh = simple.mesh;
  for (const auto& p : mesh.mesh.vertices) mesh.points.push_back(p.cast<double>());
  const cgs::MeasuredValue volume = cgs::enclosed_volume(mesh);
  const cgs::MeasuredValue area = cgs::surface_area(mesh);
  const auto holds = [](const cgs::MeasuredValue& v, double truth) {
    return std::abs(v.value - truth) <= 2 * v.sigma ? "yes" : "NO";
  };
  std::printf("%-15s %4d  %+7.3f %+7.3f  %+7.3f %+7.3f   %5.2f %-3s  %5.2f %-3s  %-3s %7zu %s\n",
              solid.name.c_str(),
              voxels,
              bias(closed.certificate.volume, solid.volume),
              bias(volume.value, solid.volume),
              bias(closed.certificate.area, solid.area),
              bias(area.value, solid.area),
              200 * volume.sigma / solid.volume,
              holds(volume, solid.volume),
              200 * area.sigma / solid.area,
              holds(area, solid.area),
              certificate.passed() ? "yes" : "NO",
              simple.mesh.faces.size(),
              closed.method.c_str());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    std::vector<int> resolutions;
    for (int i = 1; i < argc; ++i) resolutions.push_back(std::atoi(argv[i]));
    if (resolutions.empty()) resolutions = {32, 64, 128};
    std::printf(
        "bias in %%, of the closed mesh and of it simplified; +- = 2 sigma in %%, does it hold the "
        "truth\n%-15s %4s  %-15s  %-15s   %-9s  %-9s  certified, faces\n",
        "solid",
        "n",
        "volume",
        "area",
        "volume +-",
        "area +-");
    for (const int voxels : resolutions) {
      if (voxels < 8 || voxels > 512) throw std::runtime_error("8 to 512 voxels per diameter");
      for (const ExactSolid& solid : {ball(),
                                      block("cube", Vector3d::Ones()),
                                      torus(),
                                      gear(),
                                      block("thin plate", {1, 1, 0.1}),
                                      cone()}) {
        measure(solid, voxels);
      }
    }
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "solid_bias: %s\n", error.what());
    return 1;
  }
}
