// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/model_training.h"

#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cgs::model_training_test {
namespace {

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

TEST(TrainingToJson, HasCoverageWordsBesideTheFigures) {
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

}  // namespace
}  // namespace cgs::model_training_test
