// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/training_options.h"

#include <map>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"

namespace cgs::training_options_test {
namespace {

using Member = std::variant<int TrainingOptions::*,
                            double TrainingOptions::*,
                            int CoherenceOptions::*,
                            float CoherenceOptions::*>;

// All fields that are numbers, by their members.
const std::vector<std::pair<std::string, Member>>& numbers() {
  static const std::vector<std::pair<std::string, Member>> kNumbers = {
      {"steps", &TrainingOptions::steps},
      {"coarse_until", &TrainingOptions::coarse_until},
      {"free_from", &TrainingOptions::free_from},
      {"sharp_from", &TrainingOptions::sharp_from},
      {"depth_rate", &TrainingOptions::depth_rate},
      {"opacity_rate", &TrainingOptions::opacity_rate},
      {"color_rate", &TrainingOptions::color_rate},
      {"shape_rate", &TrainingOptions::shape_rate},
      {"final_rate", &TrainingOptions::final_rate},
      {"conv_depth_rate", &TrainingOptions::conv_depth_rate},
      {"conv_opacity_rate", &TrainingOptions::conv_opacity_rate},
      {"conv_rise", &TrainingOptions::conv_rise},
      {"l1_weight", &TrainingOptions::l1_weight},
      {"ssim_weight", &TrainingOptions::ssim_weight},
      {"tv_weight", &TrainingOptions::tv_weight},
      {"masked_tv_weight", &TrainingOptions::masked_tv_weight},
      {"tv_to_layers", &TrainingOptions::tv_to_layers},
      {"flow_weight", &TrainingOptions::flow_weight},
      {"prior_weight", &TrainingOptions::prior_weight},
      {"spread_weight", &TrainingOptions::spread_weight},
      {"emptiness_weight", &TrainingOptions::emptiness_weight},
      {"near_opacity_weight", &TrainingOptions::near_opacity_weight},
      {"edge_smooth_weight", &TrainingOptions::edge_smooth_weight},
      {"seen_through_weight", &TrainingOptions::seen_through_weight},
      {"order_weight", &TrainingOptions::order_weight},
      {"patch_depth_weight", &TrainingOptions::patch_depth_weight},
      {"virtual_weight", &TrainingOptions::virtual_weight},
      {"virtual_tv_weight", &TrainingOptions::virtual_tv_weight},
      {"average_decay", &TrainingOptions::average_decay},
      {"depth_bending", &TrainingOptions::depth_bending},
      {"opacity_bending", &TrainingOptions::opacity_bending},
      {"opacity_prior", &TrainingOptions::opacity_prior},
      {"color_prior", &TrainingOptions::color_prior},
      {"l1_levels", &TrainingOptions::l1_levels},
      {"dropout", &TrainingOptions::dropout},
      {"dropout_block", &TrainingOptions::dropout_block},
      {"conv_depth_width", &CoherenceOptions::conv_depth_width},
      {"conv_opacity_width", &CoherenceOptions::conv_opacity_width},
      {"conv_depth_gain", &CoherenceOptions::conv_depth_gain},
      {"conv_opacity_gain", &CoherenceOptions::conv_opacity_gain},
      {"max_depth_change", &CoherenceOptions::max_depth_change},
      {"max_logit_change", &CoherenceOptions::max_logit_change},
      {"radius_factor", &CoherenceOptions::radius_factor},
      {"min_radius", &CoherenceOptions::min_radius},
      {"max_radius", &CoherenceOptions::max_radius},
      {"opacity", &CoherenceOptions::opacity},
      {"sh_degree", &CoherenceOptions::sh_degree},
      {"layers_per_ray", &CoherenceOptions::layers_per_ray}};
  return kNumbers;
}

template <typename T>
T& at(TrainingOptions& options, T TrainingOptions::*member) {
  return options.*member;
}
template <typename T>
T& at(TrainingOptions& options, T CoherenceOptions::*member) {
  return options.coherence.*member;
}

// No two are alike, and none is what a field is by default; those of fractions are no short
// decimals.
void set_each(TrainingOptions& options) {
  int next = 1000;
  for (const auto& [name, member] : numbers()) {
    ++next;
    std::visit(
        [&](auto which) {
          auto& value = at(options, which);
          value = static_cast<std::decay_t<decltype(value)>>(next + 1.0 / 3);
        },
        member);
  }
  options.method = SplatMethod::Classical;
  options.coherence.decoder = ResidualDecoder::Conv;
  options.coherence.depth_spacing = {40, 10};
  options.coherence.opacity_spacing = {30, 20, 5};
}

TEST(TrainingOptions, EveryFieldSurvivesPrintingAndReading) {
  TrainingOptions options;
  set_each(options);
  TrainingOptions copy;
  for (const auto& [name, value] : training_fields(options)) {
    set_training_field(copy, name, value);
  }
  EXPECT_EQ(training_fields(copy), training_fields(options));
  for (const auto& [name, member] : numbers()) {
    std::visit([&](auto which) { EXPECT_EQ(at(copy, which), at(options, which)) << name; }, member);
  }
  EXPECT_EQ(copy.method, options.method);
  EXPECT_EQ(copy.coherence.decoder, options.coherence.decoder);
  EXPECT_EQ(copy.coherence.depth_spacing, options.coherence.depth_spacing);
  EXPECT_EQ(copy.coherence.opacity_spacing, options.coherence.opacity_spacing);
}

TEST(TrainingOptions, EveryFieldIsCalledByTheNameOfItsMember) {
  TrainingOptions options;
  set_each(options);
  const auto printed = training_fields(options);
  std::map<std::string, std::string> text(printed.begin(), printed.end());
  EXPECT_EQ(text.size(), printed.size()) << "a name comes twice";
  for (const auto& [name, member] : numbers()) {
    ASSERT_EQ(text.count(name), 1u) << name;
    std::visit(
        [&](auto which) {
          const auto value = at(options, which);
          EXPECT_EQ(static_cast<decltype(value)>(std::stod(text[name])), value) << name;
        },
        member);
    text.erase(name);
  }
  EXPECT_EQ(text,
            (std::map<std::string, std::string>{{"method", "classical"},
                                                {"decoder", "conv"},
                                                {"depth_spacing", "40,10"},
                                                {"opacity_spacing", "30,20,5"}}));
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
