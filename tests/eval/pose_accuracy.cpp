// SPDX-License-Identifier: GPL-3.0-or-later
//
// How accurate cameras solved from photographs alone are, beside those given with the data sets.
//
//   pose_accuracy FOLDER [SET]     FOLDER holds the data sets of kSets, each as its authors offer
//                                  it (Strecha, Middlebury, MVImgNet, LLFF); SET = part of a name
//
// Prints per set and source of the focal length (given = of the data set, Exif, solved = unknown,
// each = unknown and of every photograph its own): photographs placed, largest error of the
// cameras' axes, of where their pixels look (a principal point off the centre, which few
// photographs do not tell, turns the axes but hardly the rays) and of the direction between any two
// cameras [degrees], each after the rotation that brings all cameras together best; of the focal
// length [%], the largest standard deviation claimed for one [%]; how far points are from where
// they were seen [pixels, RMS], as solved and for the given cameras: where these do as well, the
// photographs do not tell one from the other; and seconds.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include <glog/logging.h>

#include "io/bytes/text_lines.h"
#include "io/images/exif.h"
#include "io/images/image.h"
#include "io/scenes/scene_reader.h"
#include "io/scenes/view_names.h"
#include "libcgs/core/error.h"
#include "libcgs/poses/ray_meeting.h"
#include "libcgs/poses/reconstruction.h"
#include "tests/support/unposed_photos.h"

namespace {

using namespace cgs;

struct Set {
  const char* folder;
  const char* views;
};

constexpr std::array<Set, 10> kSets = {
    {{"strecha_herzjesu_p8", "0,1,2"},
     {"strecha_herzjesu_p8", "3,4,5"},
     {"strecha_herzjesu_p8", "5,6,7"},
     {"strecha_herzjesu_p8", "1,3,5"},
     {"templeSparseRing", "0,1,2"},
     {"templeSparseRing", "8,9,10"},
     {"heritage_ethiopian_head", "DSC_0027,DSC_0028,DSC_0030,DSC_0032"},
     {"mvimgnet_5views/dense", "0,1,2,3,4"},
     {"llff_fern", "1,10,19"},
     {"llff_fern", "5,6,7"}}};

// Rows "name K R t" with P = K [R | t], all row-major; pixel centres at whole numbers.
Scene read_middlebury(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / "templeSR_par.txt";
  const std::string text = read_file(path);
  TextLines lines(text, path);
  (void)lines.next_data();  // the number of rows
  Scene scene;
  while (const auto line = lines.next_data()) {
    const auto parts = tokens(*line);
    std::array<double, 21> p = {};
    for (size_t i = 0; i < p.size(); ++i) p[i] = lines.number(parts.at(i + 1));
    View view;
    view.name = std::filesystem::path(parts[0]).stem();
    view.image_path = folder / parts[0];
    const ImageSize size = image_size(view.image_path);
    view.camera = {.width = size.width,
                   .height = size.height,
                   .fx = p[0],
                   .fy = p[4],
                   .cx = p[2] + 0.5,
                   .cy = p[5] + 0.5};
    using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    Eigen::Isometry3d cam_from_world = Eigen::Isometry3d::Identity();
    cam_from_world.linear() = Eigen::Map<const RowMajor>(p.data() + 9);
    cam_from_world.translation() = Eigen::Map<const Eigen::Vector3d>(p.data() + 18);
    view.camera.world_from_cam = cam_from_world.inverse();
    scene.views.push_back(std::move(view));
  }
  return scene;
}

Scene read_set(const std::filesystem::path& data, const Set& set) {
  const std::filesystem::path folder = data / set.folder;
  if (!std::filesystem::exists(folder / "templeSR_par.txt")) {
    return read_scene(folder, {.views = set.views});
  }
  Scene scene = read_middlebury(folder);
  scene.input = select_views(scene, set.views);
  return scene;
}

struct Photos {
  std::vector<UnposedPhoto> photos;
  std::vector<Camera> given;  // at the size of the files
  double exif_focal = 0;
  double exif_sigma = 0;
};

// from_aside: as cgs does once more where not every photograph found its place.
Photos photos_of(const Scene& scene, bool from_aside) {
  Photos out;
  for (const int i : scene.input) {
    const View& view = scene.views[static_cast<size_t>(i)];
    const ColorImage image = read_image(view.image_path);
    UnposedPhoto photo;
    photo.name = view.name;
    photo.width = image.width;
    photo.height = image.height;
    photo.features = from_aside ? detect_tilted_features(image) : detect_features(image);
    out.photos.push_back(std::move(photo));
    out.given.push_back(resized(view.camera, image.width, image.height));
    const LensHint hint = lens_hint(view.image_path, {image.width, image.height});
    out.exif_focal = hint.focal;
    out.exif_sigma = hint.sigma;
  }
  return out;
}

/// Where a point was seen in each of its photographs.
using Observations = std::vector<SolvedObservation>;

// The observations of the solved points, as lenses without distortion show them.
std::vector<Observations> undistorted(const PoseSolution& solution) {
  std::vector<Observations> out;
  for (const SolvedPoint& point : solution.points) {
    out.push_back(point.track);
    for (SolvedObservation& s : out.back()) {
      const SolvedPhoto& photo = solution.photos[static_cast<size_t>(s.photo)];
      const Eigen::Vector2d centre(photo.camera.cx, photo.camera.cy);
      const Lens lens{photo.camera.fx, photo.k1, centre};
      s.at = centre + photo.camera.fx * direction_at(lens, s.at);
    }
  }
  return out;
}

// RMS distance [pixels] between observations and the points that agree with them best.
// \param cameras  per photograph
double observation_rms(const std::vector<Observations>& seen, const std::vector<Camera>& cameras) {
  double sum = 0;
  size_t count = 0;
  for (const Observations& observations : seen) {
    std::vector<SightRay> rays;
    for (const SolvedObservation& s : observations) {
      rays.push_back(sight_ray(cameras[static_cast<size_t>(s.photo)], s.at, 1));
    }
    const std::optional<RayMeeting> meeting = ray_meeting(rays);
    if (!meeting) continue;
    for (const SolvedObservation& s : observations) {
      const Camera& camera = cameras[static_cast<size_t>(s.photo)];
      sum += (camera.project(meeting->point).head<2>() - s.at).squaredNorm();
      ++count;
    }
  }
  return std::sqrt(sum / static_cast<double>(count));
}

// \return whether every photograph was placed
bool measure(const Set& set,
             const std::string& source,
             std::vector<UnposedPhoto> photos,
             double focal,
             double sigma,
             const std::vector<Camera>& given) {
  for (UnposedPhoto& photo : photos) {
    photo.focal = focal;
    photo.focal_sigma = sigma;
  }
  std::printf("%-24s %-10s %-12s", set.folder, set.views, source.c_str());
  const auto start = std::chrono::steady_clock::now();
  try {
    const PoseSolution solution = solve_poses(photos);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    const std::vector<Observations> seen = undistorted(solution);
    std::vector<Camera> all;
    std::vector<Camera> solved;
    std::vector<Camera> truth;
    double sigma_claimed = 0;
    for (size_t i = 0; i < photos.size(); ++i) {
      all.push_back(solution.photos[i].camera);
      if (!solution.photos[i].is_placed) continue;
      solved.push_back(solution.photos[i].camera);
      truth.push_back(given[i]);
      sigma_claimed = std::max(sigma_claimed, solution.photos[i].focal_sigma);
    }
    const test::PoseErrors errors = test::pose_errors(solved, truth);
    std::printf(" %2zu of %zu %9.3f %9.3f %9.3f %8.2f %8.2f %8.3f %8.3f %7.1f\n",
                solved.size(),
                photos.size(),
                errors.axes,
                errors.rotation,
                errors.direction,
                100 * errors.focal,
                100 * sigma_claimed,
                observation_rms(seen, all),
                observation_rms(seen, given),
                seconds.count());
    std::fflush(stdout);
    return solved.size() == photos.size();
  } catch (const NumericalError& error) {
    std::printf(" refused: %s\n", error.what());
  }
  std::fflush(stdout);
  return false;
}

// \return whether every photograph was placed each time
bool measure_all(const Set& set, const Scene& scene, bool from_aside) {
  const Photos photos = photos_of(scene, from_aside);
  const std::string aside = from_aside ? " aside" : "";
  bool all = measure(set, "given" + aside, photos.photos, photos.given[0].fx, 0, photos.given);
  if (photos.exif_focal > 0) {
    all &= measure(
        set, "Exif" + aside, photos.photos, photos.exif_focal, photos.exif_sigma, photos.given);
  }
  all &= measure(set, "solved" + aside, photos.photos, 0, 0, photos.given);
  std::vector<UnposedPhoto> own = photos.photos;
  for (size_t i = 0; i < own.size(); ++i) own[i].lens = static_cast<int>(i);
  return measure(set, "each" + aside, own, 0, 0, photos.given) && all;
}

int run(const std::filesystem::path& data, const std::string& wanted) {
  std::printf("%-24s %-10s %-12s %7s %9s %9s %9s %8s %8s %8s %8s %7s\n",
              "set",
              "views",
              "focal",
              "placed",
              "axes",
              "rays",
              "direction",
              "focal %",
              "sigma %",
              "own px",
              "given px",
              "s");
  for (const Set& set : kSets) {
    if (std::string(set.folder).find(wanted) == std::string::npos) continue;
    const Scene scene = read_set(data, set);
    if (!measure_all(set, scene, false)) measure_all(set, scene, true);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: pose_accuracy FOLDER [SET]\n");
    return 2;
  }
  FLAGS_minloglevel = google::GLOG_FATAL;  // steps that Ceres tries in vain
  try {
    return run(argv[1], argc > 2 ? argv[2] : "");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
