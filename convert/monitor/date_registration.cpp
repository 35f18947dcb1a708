// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/monitor/date_registration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <Eigen/Geometry>

#include "io/scenes/scene_reader.h"
#include "libcgs/core/split_mix.h"
#include "libcgs/poses/photo_features.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

namespace {

Registration motion_of(const std::vector<PlacePair>& pairs,
                       const std::vector<size_t>& chosen,
                       bool with_scale) {
  Eigen::Matrix3Xd from(3, static_cast<Eigen::Index>(chosen.size()));
  Eigen::Matrix3Xd to(3, from.cols());
  for (Eigen::Index i = 0; i < from.cols(); ++i) {
    from.col(i) = pairs[chosen[static_cast<size_t>(i)]].from;
    to.col(i) = pairs[chosen[static_cast<size_t>(i)]].to;
  }
  const Eigen::Matrix4d matrix = Eigen::umeyama(from, to, with_scale);
  Registration out;
  out.scale = with_scale ? matrix.col(0).head<3>().norm() : 1;
  out.rotation = matrix.topLeftCorner<3, 3>() / out.scale;
  out.translation = matrix.col(3).head<3>();
  return out;
}

std::vector<size_t> agreeing(const std::vector<PlacePair>& pairs, const Registration& motion) {
  std::vector<size_t> out;
  for (size_t i = 0; i < pairs.size(); ++i) {
    if ((motion.apply(pairs[i].from) - pairs[i].to).norm() <= pairs[i].tolerance) out.push_back(i);
  }
  return out;
}

// A photograph of a model with what was found in it.
struct SearchedPhoto {
  const Model* model = nullptr;
  size_t input = 0;
  PhotoFeatures features;

  /// World place of a feature and its depth [world units]; nothing where it was not measured.
  std::optional<std::pair<Eigen::Vector3d, double>> place(int feature) const {
    const Eigen::Vector2d at = features.points[static_cast<size_t>(feature)];
    const ViewPriors& priors = model->priors[input];
    const int x = static_cast<int>(std::floor(at.x()));
    const int y = static_cast<int>(std::floor(at.y()));
    if (!priors.depth.contains(x, y)) return std::nullopt;
    if (priors.origin(x, y) != DepthOrigin::Measured) return std::nullopt;
    const auto z = double(priors.depth(x, y));
    const Frame& frame = model->scene.frame;
    const Camera& camera = input_camera(*model, input);
    return std::pair(frame.world_from_internal(camera.unproject(at.x(), at.y(), z)),
                     z * frame.scale);
  }
};

// Of a few of the input photographs, evenly spread.
std::vector<SearchedPhoto> searched(Model& model, const Progress& progress) {
  constexpr size_t kMost = 6;
  constexpr FeatureOptions kOptions{.most = 4000};
  std::vector<SearchedPhoto> out;
  const size_t inputs = model.scene.input.size();
  const size_t count = std::min(inputs, kMost);
  for (size_t k = 0; k < count; ++k) {
    report(progress, double(k) / double(count));
    const size_t input = count < 2 ? 0 : k * (inputs - 1) / (count - 1);
    const View view =
        loaded_view(model.scene, model.scene.input[input], true, model.scene.warnings);
    out.push_back({&model, input, detect_features(view.image, view.valid, kOptions)});
  }
  return out;
}

}  // namespace

PlaceFit fit_places(const std::vector<PlacePair>& pairs, bool with_scale) {
  constexpr uint64_t kTriples = 2000;
  if (pairs.size() < 3) return {};
  std::vector<size_t> best;
  for (uint64_t n = 0; n < kTriples; ++n) {
    std::vector<size_t> triple;
    for (uint64_t k = 0; k < 3; ++k) triple.push_back(random_number(3 * n + k) % pairs.size());
    if (triple[0] == triple[1] || triple[1] == triple[2] || triple[0] == triple[2]) continue;
    std::vector<size_t> found = agreeing(pairs, motion_of(pairs, triple, with_scale));
    if (found.size() > best.size()) best = std::move(found);
  }
  if (best.size() < 3) return {};
  PlaceFit out;
  constexpr int kFits = 3;  // with what the fit before it gained
  for (int fit = 0; fit < kFits && best.size() >= 3; ++fit) {
    out = {motion_of(pairs, best, with_scale), best.size()};
    best = agreeing(pairs, out.motion);
  }
  return out;
}

std::vector<PlacePair> places_of_both(Model& earlier, Model& later, const Progress& progress) {
  constexpr double kTolerance = 0.01;  // of the depth
  const std::vector<SearchedPhoto> before = searched(earlier, part_of(progress, 0, 0.2));
  const std::vector<SearchedPhoto> after = searched(later, part_of(progress, 0.2, 0.4));
  std::vector<PlacePair> out;
  for (size_t i = 0; i < after.size(); ++i) {
    report(progress, 0.4 + 0.6 * double(i) / double(after.size()));
    for (const SearchedPhoto& photo : before) {
      for (const FeatureMatch& match : match_features(after[i].features, photo.features)) {
        const auto from = after[i].place(match.a);
        const auto to = photo.place(match.b);
        if (from && to) out.push_back({from->first, to->first, kTolerance * to->second});
      }
    }
  }
  return out;
}

}  // namespace cgs
