// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/photo_response.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "libcgs/core/exposure.h"
#include "tests/support/colored_wall.h"

namespace cgs::priors_photo_response_test {
namespace {

using Eigen::Vector3d;

std::vector<std::string> used(const PhotoResponses& found) {
  std::vector<std::string> out;
  for (const ResponseTerm& term : found.terms) {
    if (term.is_used) out.push_back(term.name);
  }
  return out;
}

// Largest mean difference of a corrected view from the photograph as it was before it was printed,
// both brought to one brightness: that of the reference is free.
double error(const Scene& printed, const Scene& clean, const PhotoResponses& found, size_t v) {
  View view = printed.views[v];
  view.response = found.response[v];
  view.exposure = found.gain[v];
  apply_exposure(view);
  double sum = 0;
  for (size_t i = 0; i < view.image.data.size(); ++i) {
    sum += double{(view.image.data[i] - clean.views[v].image.data[i]).cwiseAbs().mean()};
  }
  return sum / double(view.image.data.size());
}

TEST(PhotoResponses, OfPhotographsAlikeAreNothing) {
  const test::ColoredWall wall;
  const PhotoResponses found = fit_photo_responses(wall.scene, wall.priors);
  EXPECT_TRUE(used(found).empty());
  EXPECT_FALSE(found.is_richer());
  EXPECT_GT(found.samples, 500u);
  for (const PhotoResponse& response : found.response) EXPECT_EQ(response, PhotoResponse{});
  for (const Eigen::Vector3f& gain : found.gain) EXPECT_EQ(gain, Eigen::Vector3f::Ones());
}

TEST(PhotoResponses, AreGainsWhereGainsAreEnough) {
  test::ColoredWall wall;
  test::print(wall.scene.views[0].image, {0.7, 0.8, 0.75}, 1, 0);
  const PhotoResponses found = fit_photo_responses(wall.scene, wall.priors);
  EXPECT_EQ(used(found), std::vector<std::string>{"gain"});
  EXPECT_FALSE(found.is_richer());
  ASSERT_NE(found.reference, 0u);
  EXPECT_NEAR(found.gain[0].x() * 0.7f, 1, 0.02);
}

// A second term of the vignette is not tried where the first does not pay: it has what stands.
TEST(PhotoResponses, StateTheDifferenceThatIsLeftOfTermsThatWereNotTried) {
  test::ColoredWall wall;
  test::print(wall.scene.views[0].image, {0.7, 0.8, 0.75}, 1, 0);
  const std::vector<ResponseTerm> terms = fit_photo_responses(wall.scene, wall.priors).terms;
  ASSERT_EQ(terms.size(), 5u);
  ASSERT_FALSE(terms[2].is_used);
  EXPECT_EQ(terms[3].parameters, 0);
  EXPECT_GT(terms[3].residual, 0);
  EXPECT_NEAR(terms[3].residual, terms[2].residual, 0.02 * terms[2].residual);
}

TEST(PhotoResponses, RecoverGammaAndGain) {
  test::ColoredWall wall;
  const Scene clean = wall.scene;
  test::print(wall.scene.views[0].image, {0.9, 0.8, 0.85}, 0.8, 0);
  test::print(wall.scene.views[2].image, {1, 1.1, 1.05}, 1.25, 0);
  const PhotoResponses found = fit_photo_responses(wall.scene, wall.priors);
  ASSERT_EQ(found.reference, 1u) << "the one in the middle shares the most";
  EXPECT_TRUE(found.is_richer());
  EXPECT_NEAR(found.response[0].gamma, 1 / 0.8, 0.03);
  EXPECT_NEAR(found.response[2].gamma, 1 / 1.25, 0.03);
  EXPECT_EQ(found.response[1].gamma, 1);
  EXPECT_LT(error(wall.scene, clean, found, 0), 0.01);
  EXPECT_LT(error(wall.scene, clean, found, 2), 0.01);
  PhotoResponses gains = found;
  gains.response.assign(3, {});
  EXPECT_GT(error(wall.scene, clean, gains, 0), 0.03) << "gains alone";
}

TEST(PhotoResponses, RecoverTheFallingOffOfTheLight) {
  test::ColoredWall wall;
  for (View& view : wall.scene.views) test::print(view.image, Vector3d::Ones(), 1, 0.3);
  const PhotoResponses found = fit_photo_responses(wall.scene, wall.priors);
  const auto terms = used(found);
  EXPECT_TRUE(std::find(terms.begin(), terms.end(), "vignette") != terms.end());
  for (const PhotoResponse& response : found.response) {
    EXPECT_NEAR(std::exp(response.vignette.sum()), 1 / 0.7, 0.1);
  }
}

TEST(PhotoResponses, RecoverAMixingOfColors) {
  test::ColoredWall wall;
  const Scene clean = wall.scene;
  Eigen::Matrix3d mixed;
  mixed << 0.7, 0.2, 0.1, 0.15, 0.7, 0.15, 0.05, 0.2, 0.75;
  PhotoResponse print;
  print.matrix = mixed;
  apply_response(wall.scene.views[0].image, print);
  const PhotoResponses found = fit_photo_responses(wall.scene, wall.priors);
  ASSERT_EQ(found.reference, 1u);
  EXPECT_LT((found.response[0].matrix * mixed - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(),
            0.05);
  EXPECT_LT(error(wall.scene, clean, found, 0), 0.01);
}

TEST(PhotoResponses, OfAGreyOneAreToldByLuminance) {
  test::ColoredWall wall;
  View& grey = wall.scene.views[1];
  grey.image = in_grey(grey.image);
  grey.response.is_grey = true;
  test::print(grey.image, Vector3d::Constant(0.8), 0.85, 0);
  const PhotoResponses found = fit_photo_responses(wall.scene, wall.priors);
  EXPECT_NE(found.reference, 1u) << "a grey one is no reference for colours";
  EXPECT_NEAR(found.response[1].gamma, 1 / 0.85, 0.04);
  EXPECT_TRUE(found.response[1].is_grey);
  EXPECT_EQ(found.gain[1].x(), found.gain[1].z());
  EXPECT_EQ(found.response[1].matrix, Eigen::Matrix3d::Identity());
}

TEST(PhotoResponses, AreNotLedByWhatAFifthOfTheWallShowsOtherwise) {
  test::ColoredWall wall;
  test::print(wall.scene.views[0].image, {0.9, 0.8, 0.85}, 0.8, 0);
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 32; ++x) wall.scene.views[0].image(x, y) = {0.9f, 0.3f, 0.2f};
  }
  const PhotoResponses found = fit_photo_responses(wall.scene, wall.priors);
  EXPECT_NEAR(found.response[0].gamma, 1 / 0.8, 0.1);
}

TEST(PhotoResponses, OfAViewThatSharesNothingAreNothing) {
  test::ColoredWall wall;
  test::print(wall.scene.views[0].image, {0.9, 0.8, 0.85}, 0.8, 0);
  View& apart = wall.scene.views[2];
  apart.camera.world_from_cam.pretranslate(Vector3d(0, 0, 100));
  test::print(apart.image, Vector3d::Constant(0.5), 1.3, 0.3);
  const PhotoResponses found = fit_photo_responses(wall.scene, wall.priors);
  EXPECT_EQ(found.response[2], PhotoResponse{});
  EXPECT_EQ(found.gain[2], Eigen::Vector3f::Ones());
}

TEST(PhotoResponses, NeedPriorsOfEveryInputView) {
  test::ColoredWall wall;
  wall.priors.pop_back();
  EXPECT_THROW(fit_photo_responses(wall.scene, wall.priors), InvalidInput);
}

}  // namespace
}  // namespace cgs::priors_photo_response_test
