// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/training_options.h"

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::training_options_test {
namespace {

TEST(TrainingOptions, EveryFieldSurvivesPrintingAndReading) {
  TrainingOptions options;
  options.steps = 17;
  options.depth_rate = 0.1 + 0.2;
  options.coherence.max_depth_change = 0.7f;
  options.coherence.depth_spacing = {40, 10};
  options.coherence.decoder = ResidualDecoder::Conv;
  TrainingOptions copy;
  for (const auto& [name, value] : training_fields(options)) {
    set_training_field(copy, name, value);
  }
  EXPECT_EQ(training_fields(copy), training_fields(options));
  EXPECT_EQ(copy.depth_rate, options.depth_rate);
  EXPECT_EQ(copy.coherence.depth_spacing, options.coherence.depth_spacing);
}

TEST(TrainingOptions, RefuseUnknownFieldsAndBadValues) {
  TrainingOptions options;
  EXPECT_THROW(set_training_field(options, "stepz", "1"), InvalidInput);
  EXPECT_THROW(set_training_field(options, "steps", "1.5"), InvalidInput);
  EXPECT_THROW(set_training_field(options, "steps", ""), InvalidInput);
  EXPECT_THROW(set_training_field(options, "depth_rate", "fast"), InvalidInput);
  EXPECT_THROW(set_training_field(options, "depth_spacing", "8,"), InvalidInput);
  EXPECT_THROW(set_training_field(options, "decoder", "network"), InvalidInput);
}

TEST(TrainingOptions, ValidateNamesTheFieldOutOfRange) {
  for (const char* setting : {"steps",
                              "dropout",
                              "ssim_weight",
                              "final_rate",
                              "l1_levels",
                              "conv_depth_width",
                              "conv_depth_gain",
                              "conv_opacity_rate",
                              "conv_rise",
                              "opacity_prior",
                              "tv_to_layers",
                              "sh_degree",
                              "layers_per_ray",
                              "color_rate",
                              "color_prior",
                              "average_decay"}) {
    TrainingOptions options;
    set_training_field(options, setting, "-1");
    try {
      options.validate();
      ADD_FAILURE() << setting << " = -1 was accepted";
    } catch (const InvalidInput& error) {
      EXPECT_NE(std::string(error.what()).find(setting), std::string::npos) << error.what();
    }
  }
}

TEST(TrainingOptions, WeightsAreFinite) {
  for (const char* weight : {"l1_weight",
                             "ssim_weight",
                             "tv_weight",
                             "masked_tv_weight",
                             "flow_weight",
                             "prior_weight",
                             "spread_weight",
                             "emptiness_weight",
                             "near_opacity_weight",
                             "edge_smooth_weight",
                             "seen_through_weight",
                             "order_weight",
                             "patch_depth_weight",
                             "virtual_weight",
                             "virtual_tv_weight",
                             "average_decay",
                             "depth_bending",
                             "opacity_bending",
                             "opacity_prior"}) {
    for (const char* value : {"nan", "inf"}) {
      TrainingOptions options;
      set_training_field(options, weight, value);
      EXPECT_THROW(options.validate(), InvalidInput) << weight << " = " << value;
    }
  }
}

TEST(TrainingOptions, NetworksHaveNoKnotsToBend) {
  for (const char* bending : {"depth_bending", "opacity_bending"}) {
    TrainingOptions options;
    set_training_field(options, bending, "1");
    EXPECT_NO_THROW(options.validate()) << bending;
    set_training_field(options, "decoder", "conv");
    EXPECT_THROW(options.validate(), InvalidInput) << bending;
  }
}

TEST(TrainingOptions, FreeGaussiansHaveFewSettings) {
  for (const auto& [name, value] :
       {std::pair("steps", "10"), {"sh_degree", "0"}, {"l1_weight", "1"}, {"l1_levels", "2"}}) {
    TrainingOptions options = training_preset("classical");
    set_training_field(options, name, value);
    EXPECT_NO_THROW(options.validate()) << name;
  }
  for (const auto& [name, value] : {std::pair("dropout", "0.1"),
                                    {"color_rate", "0"},
                                    {"decoder", "conv"},
                                    {"sh_degree", "4"}}) {
    TrainingOptions options = training_preset("classical");
    set_training_field(options, name, value);
    try {
      options.validate();
      ADD_FAILURE() << name << " = " << value << " was accepted";
    } catch (const InvalidInput& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  }
  TrainingOptions options;
  set_training_field(options, "method", "classical");
  EXPECT_THROW(options.validate(), InvalidInput);  // the preset says more than that
  EXPECT_THROW(set_training_field(options, "method", "free"), InvalidInput);
}

TEST(TrainingPreset, EveryNameIsValidAndOthersAreRefused) {
  for (const char* name : {"draft", "standard", "fine", "reference", "classical"}) {
    EXPECT_NO_THROW(training_preset(name).validate()) << name;
  }
  EXPECT_EQ(training_preset("reference").coherence.decoder, ResidualDecoder::Conv);
  EXPECT_THROW(training_preset("fastest"), InvalidInput);
}

}  // namespace
}  // namespace cgs::training_options_test
