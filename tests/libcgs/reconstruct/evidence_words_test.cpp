// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/reconstruct/evidence_words.h"

#include <string>

#include <gtest/gtest.h>

namespace cgs::evidence_words_test {
namespace {

// Of a model with a view per entry of the coverage.
std::string described(TrainedModel trained, const TrainingOptions& options) {
  Scene& scene = trained.model.scene;
  scene.views.resize(trained.priors.coverage.size());
  for (size_t k = 0; k < scene.views.size(); ++k) scene.input.push_back(static_cast<int>(k));
  return description_of(trained, options);
}

TEST(DescriptionOf, SaysWhereTheDepthIsFrom) {
  TrainedModel trained;
  trained.priors.coverage = {{.measured = 1, .completed = 0, .guessed = 0}};
  EXPECT_NE(described(trained, {}).find("is measured by a multi-view plane sweep;"),
            std::string::npos);
  trained.priors.given.kind = DepthKind::Metric;
  EXPECT_NE(described(trained, {}).find("plane sweep and a depth sensor;"), std::string::npos);
  trained.priors.given.kind = DepthKind::Relative;
  trained.priors.coverage = {{.measured = 0.2, .completed = 0, .guessed = 0.8},
                             {.measured = 0.2, .completed = 0.2, .guessed = 0.6},
                             {.measured = 0, .completed = 1, .guessed = 0}};
  EXPECT_NE(described(trained, {})
                .find("70 % guessed from one photograph and fitted to what is measured, 20 % "
                      "measured by a multi-view plane sweep and 10 % filled in from neighbours;"),
            std::string::npos)
      << described(trained, {});
}

TEST(DescriptionOf, SaysWhatWasOptimised) {
  TrainingOptions options;
  TrainedModel trained;
  trained.steps.resize(static_cast<size_t>(options.steps));
  const auto expect = [&](const char* words) {
    EXPECT_NE(described(trained, options).find(words), std::string::npos)
        << words << " is not in: " << described(trained, options);
  };
  expect("; depth, opacity, shape and colour optimised against the photographs in 60 steps");
  options.color_rate = 0;
  options.depth_rate = 0;
  expect("; opacity and shape optimised against");
  options.free_from = 1;
  expect("; opacity optimised against");
  options.coherence.decoder = ResidualDecoder::Conv;
  expect("; depth and opacity optimised against");
  options.conv_depth_rate = options.conv_opacity_rate = 0;
  expect("; not optimised against the photographs");
}

TEST(DescriptionOf, SaysThatNothingVouchesForFreeGaussians) {
  TrainedModel trained;
  trained.steps.resize(30);
  trained.density = DensityReport{.begun_with = 12};
  EXPECT_EQ(described(trained, training_preset("classical"))
                .rfind("classical 3D Gaussian splatting: begun from 12 points measured", 0),
            0u);
  trained.density->is_from_splats = true;
  const std::string words = described(trained, training_preset("classical"));
  EXPECT_NE(words.find("from 12 given splats, free to move apart, so that nothing vouches"),
            std::string::npos)
      << words;
}

// Of one photograph.
std::string covered(const PriorsCoverage& coverage) {
  PriorsReport priors;
  priors.coverage = {coverage};
  Scene scene;
  scene.views.resize(2);
  scene.views[1].name = "left";
  scene.input = {1};
  const std::vector<std::string> words = coverage_words(priors, scene);
  EXPECT_EQ(words.size(), 1u);
  return words[0];
}

TEST(CoverageWords, TellOfSkyAndOfWhatIsEstimatedOrOpen) {
  EXPECT_EQ(covered({.measured = 0.43,
                     .completed = 0.2,
                     .guessed = 0.05,
                     .sky = 0.2,
                     .left_open = 0.12,
                     .estimated = 0.05}),
            "of photograph left, 63 % is measured, 20 % is sky, 5.0 % shows surface that nothing "
            "measured and is estimated from its surroundings and 12 % shows surface of which "
            "nothing is known and stays open");
}

TEST(CoverageWords, LeaveOutWhatThereIsNoneOf) {
  EXPECT_EQ(covered({.measured = 0.9, .completed = 0.1}), "of photograph left, 100 % is measured");
  EXPECT_EQ(covered({.measured = 0.7, .sky = 0.3}),
            "of photograph left, 70 % is measured and 30 % is sky");
  EXPECT_EQ(covered({.measured = 0.5, .left_open = 0.5}),
            "of photograph left, 50 % is measured and 50 % shows surface of which nothing is known "
            "and stays open");
  EXPECT_EQ(covered({.measured = 0.9999, .sky = 0.0001}), "of photograph left, 100 % is measured")
      << "as good as none";
}

}  // namespace
}  // namespace cgs::evidence_words_test
