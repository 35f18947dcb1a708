// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/render.h"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include "libcgs/core/srgb.h"
#include "samples/capture/noise.h"
#include "samples/capture/surface_colour.h"

namespace cgs {

namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using std::numbers::pi;

constexpr int kSkyRays = 24;
constexpr double kSkyReach = 1.2;    // [m]
constexpr int kSamples = 2;          // per pixel and axis
constexpr double kOffGround = 1e-5;  // start of secondary rays above the surface [m]
constexpr float kMirrored = 0.3F;    // share of the light that comes from before a pane

const Vector3d kToSun = Vector3d(-0.50, -0.72, 0.60).normalized();
const Vector3f kSun(1.65F, 1.53F, 1.30F);
const Vector3f kSky(0.62F, 0.70F, 0.84F);
const Vector3f kBounce(0.30F, 0.27F, 0.22F);  // light that comes back from the ground

// Cosine-weighted directions about +z. Source: Hammersley points, Pharr et al., "Physically Based
// Rendering", 3rd ed., 7.4.1, 13.6.3.
std::array<Vector3d, kSkyRays> sky_directions() {
  std::array<Vector3d, kSkyRays> out;
  for (uint32_t i = 0; i < kSkyRays; ++i) {
    uint32_t bits = i;
    double radical = 0;
    for (double digit = 0.5; bits != 0; bits >>= 1U, digit /= 2) radical += digit * (bits & 1U);
    const double r = std::sqrt((i + 0.5) / kSkyRays);
    const double angle = 2 * pi * radical;
    out[i] = {r * std::cos(angle), r * std::sin(angle), std::sqrt(1 - r * r)};
  }
  return out;
}

float to_srgb(float linear) {
  const float x = std::fmin(std::fmax(linear, 0.0F), 1.0F);
  return x <= 0.0031308F ? 12.92F * x : 1.055F * std::pow(x, 1 / 2.4F) - 0.055F;
}

// Standard normal from a counter. Source: Box and Muller, 1958.
float gaussian(uint32_t counter, uint32_t seed) {
  const float u = uniform(2 * counter, seed) + 0x1p-25F;
  const float v = uniform(2 * counter + 1, seed);
  return std::sqrt(-2 * std::log(u)) * std::cos(2 * static_cast<float>(pi) * v);
}

// Whether a ray meets a pane before it has come as far as `t_max`.
bool passes(const GlassPane& pane, const Ray& ray, double t_max) {
  const Vector3d normal = pane.across.cross(pane.up);
  const double t = (pane.corner - ray.origin).dot(normal) / ray.direction.dot(normal);
  if (!(t > ray.t_min && t < t_max)) return false;
  const Vector3d from_corner = ray.origin + t * ray.direction - pane.corner;
  const double u = from_corner.dot(pane.across) / pane.across.squaredNorm();
  const double v = from_corner.dot(pane.up) / pane.up.squaredNorm();
  return u >= 0 && u <= 1 && v >= 0 && v <= 1;
}

struct Shader {
  const PortalScene& scene;
  const std::vector<float>& sky;

  // Linear light that comes along the ray; `spread` is the angle between samples [rad].
  Vector3f operator()(const Ray& ray, double spread) const {
    const auto hit = first_hit(scene.bvh, ray);
    Vector3f light = hit ? from_surface(ray, *hit, spread) : from_beyond(ray.direction);
    const double reach = hit ? hit->t : std::numeric_limits<double>::infinity();
    for (const GlassPane& pane : scene.panes) {
      if (passes(pane, ray, reach)) light = (1 - kMirrored) * light + kMirrored * pane.mirrored;
    }
    return light;
  }

 private:
  Vector3f from_beyond(const Vector3d& direction) const {
    if (!scene.sky) return Vector3f::Zero();
    return scene.sky(direction).unaryExpr([](float level) { return linear_from_srgb(level); });
  }

  Vector3f from_surface(const Ray& ray, const RayHit& hit, double spread) const {
    const Vector3d normal = face_normal(scene.mesh, hit.face);
    const Vector3d point = ray.origin + hit.t * ray.direction;
    const double distance = hit.t * ray.direction.norm();
    const double facing = std::abs(normal.dot(ray.direction)) / ray.direction.norm();
    const auto part = static_cast<uint32_t>(scene.part_of_face[hit.face]);
    const Vector3f color = albedo(
        {.position = point.cast<float>(),
         .normal = normal.cast<float>(),
         .material = scene.parts[part].material,
         .part = part,
         .footprint = static_cast<float>(distance * spread / std::sqrt(std::max(facing, 0.04)))});
    const float open = openness(hit, scene.parts[part].material);
    const auto up = static_cast<float>(normal.z());
    Vector3f light = (0.18F + 0.82F * open) * (kSky * (0.62F + 0.38F * up)) +
                     open * kBounce * (0.5F - 0.5F * up);
    const double sun = normal.dot(kToSun);
    const Ray to_sun{.origin = point + kOffGround * normal, .direction = kToSun};
    if (sun > 0 && !any_hit(scene.bvh, to_sun)) light += static_cast<float>(sun) * kSun;
    return scene.exposure * color.cwiseProduct(light);
  }

  // Share of the sky that the surface sees. Of plaster all of it: the few rays per vertex would
  // leave a pattern on a wall that is to have none.
  float openness(const RayHit& hit, Material material) const {
    if (material == Material::Plaster) return 1;
    const auto& face = scene.mesh.faces[hit.face];
    const auto b1 = static_cast<float>(hit.b1);
    const auto b2 = static_cast<float>(hit.b2);
    return (1 - b1 - b2) * sky[face[0]] + b1 * sky[face[1]] + b2 * sky[face[2]];
  }
};

}  // namespace

std::vector<float> sky_visibility(const PortalScene& scene) {
  const auto directions = sky_directions();
  const auto normals = vertex_normals(scene.mesh);
  std::vector<float> sky(normals.size());
  tbb::parallel_for(size_t{0}, normals.size(), [&](size_t v) {
    const Vector3d n = normals[v].cast<double>();
    const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), n);
    Ray ray{.origin = scene.mesh.vertices[v].cast<double>() + 2e-3 * n, .t_max = kSkyReach};
    int open = 0;
    for (const auto& d : directions) {
      ray.direction = turn * d;
      if (!any_hit(scene.bvh, ray)) ++open;
    }
    sky[v] = static_cast<float>(open) / kSkyRays;
  });
  return sky;
}

ColorImage render_view(const PortalScene& scene,
                       const std::vector<float>& sky,
                       const Camera& camera,
                       uint32_t seed,
                       const std::function<Vector3d(double u, double v)>& ray) {
  const Shader shade{scene, sky};
  ColorImage image(camera.width, camera.height, Vector3f::Zero());
  const double spread = 1 / (kSamples * camera.fx);
  tbb::parallel_for(0, camera.height, [&](int y) {
    for (int x = 0; x < camera.width; ++x) {
      Vector3f sum = Vector3f::Zero();
      for (int s = 0; s < kSamples * kSamples; ++s) {
        const int row = s / kSamples;
        const double u = x + (s % kSamples + 0.5) / kSamples;
        const double v = y + (row + 0.5) / kSamples;
        const Vector3d in_cam = ray ? ray(u, v) : camera.ray_in_cam(u, v);
        const Vector3d direction = camera.world_from_cam.linear() * in_cam;
        sum += shade({.origin = camera.center(), .direction = direction}, spread);
      }
      const auto pixel = static_cast<uint32_t>(image.index(x, y));
      for (uint32_t c = 0; c < 3; ++c) {
        const float level = 255 * to_srgb(sum[c] / (kSamples * kSamples));
        const float noisy = level + 0.5F * gaussian(3 * pixel + c, seed);
        image(x, y)[c] = std::round(std::fmin(std::fmax(noisy, 0.0F), 255.0F)) / 255;
      }
    }
  });
  return image;
}

}  // namespace cgs
