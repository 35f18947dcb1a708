// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/onnx_input.h"

#include <gtest/gtest.h>

#include "tests/support/onnx_file.h"

namespace cgs::onnx_input_test {
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

TEST(OnnxWeightsDefect, IsLengthOrPlaceOfTheValues) {
  using test::field;
  EXPECT_EQ(onnx_weights_defect(test::onnx_network(384, 256)), "");
  const auto of_weight = [](const std::string& tensor) {
    return onnx_weights_defect(field(7, field(5, tensor)));
  };
  const auto of_constant = [](const std::string& tensor) {
    const std::string attribute = field(1, std::string("value")) + field(5, tensor);
    return onnx_weights_defect(
        field(7, field(1, field(4, std::string("Constant")) + field(5, attribute))));
  };
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_EQ(of_weight(test::tensor("w", {2, 2}, {1, 2, 3, 4})), "");
  EXPECT_EQ(of_weight(test::tensor("w", {}, {1})), "") << "a scalar";
  EXPECT_EQ(of_weight(test::tensor("w", {0}, {})), "");
  EXPECT_TRUE(has(of_weight(test::tensor("w", {2, 3}, {1, 2, 3, 4})), "holds 4 values"));
  EXPECT_TRUE(has(of_weight(test::tensor("w", {2, 3}, {})), "holds 0 values"));
  EXPECT_TRUE(has(of_weight(test::tensor("w", {uint64_t{1} << 63, 2}, {})), "holds 0 values"));
  EXPECT_TRUE(has(of_constant(test::tensor("w", {3}, {1, 2})), "holds 2 values"));
  const std::string elsewhere = test::tensor("w", {3}, {}) + field(14, 1);
  EXPECT_TRUE(has(of_weight(elsewhere), "another file"));
  EXPECT_TRUE(has(of_constant(elsewhere), "another file"));
}

TEST(OnnxWeightsDefect, CountsValuesOfEveryKind) {
  using test::field;
  const auto defect = [](const std::string& tensor) {
    return onnx_weights_defect(field(7, field(5, tensor)));
  };
  const std::string three = field(1, 3);
  EXPECT_EQ(defect(three + field(2, 7) + field(7, test::varint(1) + test::varint(300) + "\x01")),
            "");
  EXPECT_NE(defect(three + field(2, 7) + field(7, test::varint(1) + test::varint(300))), "");
  EXPECT_EQ(defect(three + field(2, 7) + field(7, 5) + field(7, 6) + field(7, 7)), "")
      << "unpacked";
  EXPECT_EQ(defect(three + field(2, 1) + field(4, std::string(12, 'x'))), "");
  EXPECT_NE(defect(three + field(2, 1) + field(4, std::string(11, 'x'))), "");
  EXPECT_EQ(defect(three + field(2, 11) + field(10, std::string(24, 'x'))), "");
  EXPECT_EQ(defect(three + field(2, 10) + field(9, std::string(6, 'x'))), "") << "half";
  EXPECT_NE(defect(three + field(2, 10) + field(9, std::string(7, 'x'))), "");
  EXPECT_EQ(defect(field(1, std::string("\x03\x02")) + field(2, 3) + field(9, std::string(6, 'x'))),
            "")
      << "a packed shape";
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
    (void)onnx_weights_defect(changed);
  }
}

}  // namespace
}  // namespace cgs::onnx_input_test
