// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model_training.h"

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

}  // namespace
}  // namespace cgs::model_training_test
