// SPDX-License-Identifier: GPL-3.0-or-later
//
// How accurate poses solved from photographs alone are, beside the cameras given with them.
//
//   pose_accuracy SCENE [VIEWS [FOCAL]]
//
// SCENE is a scene folder with known cameras, VIEWS what --views takes. FOCAL: "given" uses the
// given focal length, "unknown" (default) solves for it. Prints, after the similarity that brings
// the cameras together best, the largest errors: rotation [degrees], direction between any two
// cameras [degrees], focal length [%], and the time.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>

#include <Eigen/Dense>

#include "io/image.h"
#include "io/scene_reader.h"
#include "libcgs/core/error.h"
#include "libcgs/priors/solve_poses.h"

namespace {

using namespace cgs;

double degrees(double radians) { return radians * 180 / M_PI; }

double angle(const Eigen::Matrix3d& R) { return degrees(Eigen::AngleAxisd(R).angle()); }

std::vector<UnposedPhoto> photographs(const Scene& scene, bool with_focal) {
  std::vector<UnposedPhoto> out;
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    const ColorImage image = read_image(view.image_path);
    UnposedPhoto photo;
    photo.name = view.name;
    photo.width = image.width;
    photo.height = image.height;
    photo.features = detect_features(image);
    if (with_focal) photo.focal = resized(view.camera, image.width, image.height).fx;
    std::printf("%s: %d x %d, %zu features\n",
                view.name.c_str(),
                image.width,
                image.height,
                photo.features.points.size());
    out.push_back(std::move(photo));
  }
  return out;
}

// The rotation that best takes the axes of solved cameras to those of given ones.
Eigen::Matrix3d common_rotation(const std::vector<Eigen::Isometry3d>& solved,
                                const std::vector<Eigen::Isometry3d>& given) {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < solved.size(); ++i) {
    H += given[i].rotation() * solved[i].rotation().transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

void compare(const Scene& scene, const PoseSolution& solution) {
  std::vector<Eigen::Isometry3d> solved;
  std::vector<Eigen::Isometry3d> given;
  double focal_error = 0;
  for (size_t k = 0; k < scene.input.size(); ++k) {
    const SolvedPhoto& photo = solution.photos[k];
    const Camera& camera = scene.views[static_cast<size_t>(scene.input[k])].camera;
    if (!photo.is_placed) continue;
    solved.push_back(photo.camera.world_from_cam);
    given.push_back(camera.world_from_cam);
    const double focal = resized(camera, photo.camera.width, photo.camera.height).fx;
    focal_error = std::max(focal_error, 100 * std::abs(photo.camera.fx / focal - 1));
  }
  const Eigen::Matrix3d align = common_rotation(solved, given);
  double rotation_error = 0;
  double relative_error = 0;
  double direction_error = 0;
  for (size_t i = 0; i < solved.size(); ++i) {
    rotation_error = std::max(
        rotation_error,
        angle(given[i].rotation().transpose() * align * solved[i].rotation()));
    for (size_t j = i + 1; j < solved.size(); ++j) {
      const Eigen::Matrix3d a = given[j].rotation().transpose() * given[i].rotation();
      const Eigen::Matrix3d b = solved[j].rotation().transpose() * solved[i].rotation();
      relative_error = std::max(relative_error, angle(a.transpose() * b));
      const Eigen::Vector3d u = given[j].translation() - given[i].translation();
      const Eigen::Vector3d v = align * (solved[j].translation() - solved[i].translation());
      direction_error =
          std::max(direction_error, degrees(std::atan2(u.cross(v).norm(), u.dot(v))));
    }
  }
  std::printf("placed %zu of %zu, points %zu, rms %.3f px\n", solved.size(), scene.input.size(),
              solution.points.size(), solution.rms);
  std::printf("rotation %.4f deg (relative %.4f), direction %.4f deg, focal %.3f %% (sigma %.3f %%) k1 %.5f\n",
              rotation_error, relative_error, direction_error, focal_error,
              100 * solution.photos[0].focal_sigma, solution.photos[0].k1);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: pose_accuracy SCENE [VIEWS [given|unknown]]\n");
    return 2;
  }
  try {
    const Scene scene = read_scene(argv[1], {.views = argc > 2 ? argv[2] : ""});
    const auto start = std::chrono::steady_clock::now();
    const std::string focal = argc > 3 ? argv[3] : "unknown";
    const std::vector<UnposedPhoto> photos = photographs(scene, focal == "given");
    const auto middle = std::chrono::steady_clock::now();
    const PoseSolution solution = solve_poses(photos);
    const auto end = std::chrono::steady_clock::now();
    compare(scene, solution);
    std::printf("features %.1f s, poses %.1f s\n",
                std::chrono::duration<double>(middle - start).count(),
                std::chrono::duration<double>(end - middle).count());
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return error.exit_code();
  }
  return 0;
}
