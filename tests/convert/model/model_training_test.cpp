// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/model_training.h"

#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cgs::model_training_test {
namespace {

TEST(TakeSensorScale, GivesAScaleOnlyWhereThereIsNone) {
  GivenDepthReport given;
  Frame frame;
  take_sensor_scale(given, frame);
  EXPECT_FALSE(frame.has_metric_scale());
  given.metres_per_unit = 0.25;
  given.metres_sigma = 0.001;
  take_sensor_scale(given, frame);
  EXPECT_EQ(frame.metres_per_unit, 0.25);
  EXPECT_EQ(frame.scale_source, ScaleSource::DepthSensor);
  given.metres_per_unit = 3;
  take_sensor_scale(given, frame);
  EXPECT_EQ(frame.metres_per_unit, 0.25);
}

TEST(TrainingToJson, SaysInWordsWhetherAnythingWasOptimised) {
  ModelRequest request;
  TrainedModel trained;
  const auto words = [&] {
    return training_to_json(trained, request)["description"].get<std::string>();
  };
  EXPECT_NE(words().find("not optimised against the photographs"), std::string::npos);
  trained.steps.resize(7);
  trained.steps[2].skipped = 5;
  trained.steps[3].skipped = 1;
  EXPECT_NE(words().find("in 7 steps"), std::string::npos);
  EXPECT_EQ(training_to_json(trained, request)["gradients_not_finite"], 6);
}

TEST(TrainingToJson, RemarksWhereColoursDependOnTheDirection) {
  TrainedModel trained;
  trained.view_dependence = {.difference = 0.02, .explained = 0.05, .share = 0};
  const auto remarks = [&] { return remarks_on_photographs(training_to_json(trained, {})); };
  EXPECT_TRUE(remarks().empty());
  trained.view_dependence = {.difference = 0.05, .explained = 0.67, .share = 0.245};
  EXPECT_EQ(training_to_json(trained, {})["view_dependence"]["explained"], 0.67);
  ASSERT_EQ(remarks().size(), 1u);
  EXPECT_EQ(remarks()[0], "colours of 24 % of the Gaussians change with the direction of view");
  EXPECT_TRUE(remarks_on_photographs({{"exposure", nullptr}}).empty());
}

TEST(TrainingToJson, RemarksOnAPane) {
  TrainedModel trained;
  const auto json = [&] { return training_to_json(trained, {}); };
  EXPECT_TRUE(json()["pane"].is_null());
  EXPECT_EQ(json()["description"].get<std::string>().find("pane"), std::string::npos);
  trained.pane = {.view = "left", .share = 0.121, .opacity = 0.39, .gain = 4.1};
  EXPECT_EQ(json()["pane"]["view"], "left");
  EXPECT_EQ(json()["pane"]["gain_db"], 4.1);
  EXPECT_NE(json()["description"].get<std::string>().find("before them a pane; "),
            std::string::npos);
  const std::vector<std::string> remarks = remarks_on_photographs(json());
  ASSERT_EQ(remarks.size(), 1u);
  EXPECT_EQ(remarks[0],
            "a pane that hides 39 % of what lies behind is before 12 % of view left; it is in no "
            "mesh");
}

// Of a model with a view per entry of the coverage.
std::string described(TrainedModel trained, const ModelRequest& request) {
  Scene& scene = trained.model.scene;
  scene.views.resize(trained.priors.coverage.size());
  for (size_t k = 0; k < scene.views.size(); ++k) scene.input.push_back(static_cast<int>(k));
  return training_to_json(trained, request)["description"].get<std::string>();
}

TEST(TrainingToJson, SaysInWordsWhereTheDepthIsFrom) {
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

TEST(CoverageWords, AreBesideTheFigures) {
  TrainedModel trained;
  trained.model.scene.views.resize(1);
  trained.model.scene.views[0].name = "left";
  trained.model.scene.input = {0};
  trained.priors.coverage = {{.measured = 0.5, .completed = 0.25, .sky = 0.25, .estimated = 0.125}};
  const auto row = training_to_json(trained, {})["depth_of_views"][0];
  EXPECT_EQ(row["view"], "left");
  EXPECT_EQ(row["sky"], 0.25);
  EXPECT_EQ(row["left_open"], 0);
  EXPECT_EQ(row["estimated"], 0.125);
  EXPECT_EQ(row["words"], coverage_words(trained.priors, trained.model.scene)[0]);
}

TEST(TrainingToJson, SaysInWordsWhatWasOptimised) {
  ModelRequest request;
  TrainedModel trained;
  trained.steps.resize(static_cast<size_t>(request.training.steps));
  const auto expect = [&](const char* words) {
    EXPECT_NE(described(trained, request).find(words), std::string::npos)
        << words << " is not in: " << described(trained, request);
  };
  expect("; depth, opacity, shape and colour optimised against the photographs in 60 steps");
  request.training.color_rate = 0;
  request.training.depth_rate = 0;
  expect("; opacity and shape optimised against");
  request.training.free_from = 1;
  expect("; opacity optimised against");
  request.training.coherence.decoder = ResidualDecoder::Conv;
  expect("; depth and opacity optimised against");
  request.training.conv_depth_rate = request.training.conv_opacity_rate = 0;
  expect("; not optimised against the photographs");
}

}  // namespace
}  // namespace cgs::model_training_test
