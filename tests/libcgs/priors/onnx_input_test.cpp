// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/onnx_input.h"

#include <gtest/gtest.h>

#include "tests/support/onnx_file.h"

namespace cgs {
namespace {

using Shape = std::vector<int64_t>;

TEST(OnnxInputShape, IsThatOfTheInputThatIsNoWeight) {
  EXPECT_EQ(onnx_input_shape(test::onnx_network(384, 256)), (Shape{1, 3, 256, 384}));
  // Older files list weights among the inputs, before what is put in.
  const std::string graph = test::field(5, test::tensor("w", {1}, {2})) +
                            test::field(11, test::value_info("w", {1})) +
                            test::field(11, test::value_info("x", {1, 3, 8, 9}));
  EXPECT_EQ(onnx_input_shape(test::field(7, graph)), (Shape{1, 3, 8, 9}));
}

TEST(OnnxInputShape, SidesWithANameMayBeAnything) {
  const std::string named = test::field(1, test::field(2, std::string("height")));
  const std::string shape = test::field(1, test::field(1, 1)) + named + named;
  const std::string input =
      test::field(1, std::string("x")) +
      test::field(2, test::field(1, test::field(1, 1) + test::field(2, shape)));
  EXPECT_EQ(onnx_input_shape(test::field(7, test::field(11, input))), (Shape{1, 0, 0}));
}

TEST(OnnxInputShape, SurvivesWhatIsNoNetwork) {
  EXPECT_TRUE(onnx_input_shape("").empty());
  EXPECT_TRUE(onnx_input_shape("no network").empty());
  const std::string good = test::onnx_network(384, 256);
  for (size_t n = 0; n < good.size(); ++n) (void)onnx_input_shape(good.substr(0, n));
  for (size_t n = 0; n < good.size(); ++n) {
    std::string changed = good;
    changed[n] = static_cast<char>(0xff);
    (void)onnx_input_shape(changed);
  }
}

}  // namespace
}  // namespace cgs
