// SPDX-License-Identifier: GPL-3.0-or-later
//
// The matrix of bad inputs: each row is written from a valid twin, given to the program or to one
// reader, and must end as stated: with the exit code of its class, one line of complaint, nothing
// left behind, in bounded time and memory, and never by a signal.
#include <cstdio>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "tests/e2e/bad_inputs/case.h"

namespace cgs::test {
namespace {

/// Counts what was tried, for the figures at the end.
struct Figures {
  int tried = 0;
  int right = 0;
  std::map<char, std::pair<int, int>> by_kind;  ///< tried, right
};
Figures& figures() {
  static Figures value;
  return value;
}

class PrintFigures : public testing::Environment {
 public:
  void TearDown() override {
    const Figures& all = figures();
    if (all.tried == 0) return;
    for (const auto& [kind, counts] : all.by_kind) {
      std::printf("bad inputs %c: %d right of %d tried\n", kind, counts.second, counts.first);
    }
    std::printf("bad inputs: %d right of %d tried\n", all.right, all.tried);
  }
};
const testing::Environment* const kPrint = testing::AddGlobalTestEnvironment(new PrintFigures);

void expect_all_right(const Cases& cases) {
  for (const Case& bad : cases) {
    std::string wrong;
    try {
      wrong = verdict(bad);
    } catch (const std::exception& error) {
      wrong = std::string("cannot be made: ") + error.what();
    }
    EXPECT_EQ(wrong, "") << bad.row << ": " << bad.damage;
    auto& counts = figures().by_kind[bad.row[0]];
    ++counts.first;
    ++figures().tried;
    if (!wrong.empty()) continue;
    ++counts.second;
    ++figures().right;
  }
}

TEST(BadInputs, AnyFile) { expect_all_right(general_cases()); }
TEST(BadInputs, Gaussians) { expect_all_right(gaussian_cases()); }
TEST(BadInputs, Colmap) { expect_all_right(colmap_cases()); }
TEST(BadInputs, Arrays) { expect_all_right(array_cases()); }
TEST(BadInputs, Transforms) { expect_all_right(transforms_cases()); }
TEST(BadInputs, Images) { expect_all_right(image_cases()); }
TEST(BadInputs, Surveys) { expect_all_right(survey_cases()); }
TEST(BadInputs, Exr) { expect_all_right(exr_cases()); }
TEST(BadInputs, Volumes) { expect_all_right(volume_cases()); }
TEST(BadInputs, Outputs) { expect_all_right(output_cases()); }
TEST(BadInputs, Meshes) { expect_all_right(mesh_cases()); }
TEST(BadInputs, Depth) { expect_all_right(depth_cases()); }
TEST(BadInputs, Checkpoints) { expect_all_right(checkpoint_cases()); }

// Rows per kind of input, as the matrix numbers them.
TEST(BadInputs, EveryRowIsTried) {
  const std::map<char, int> matrix = {{'G', 17},
                                      {'P', 37},
                                      {'C', 29},
                                      {'L', 4},
                                      {'N', 12},
                                      {'T', 23},
                                      {'I', 16},
                                      {'D', 5},
                                      {'X', 10},
                                      {'B', 16},
                                      {'V', 6},
                                      {'M', 13},
                                      {'K', 5},
                                      {'S', 16},
                                      {'E', 8}};
  std::set<std::string> tried;
  for (const auto& cases : {general_cases,
                            gaussian_cases,
                            colmap_cases,
                            array_cases,
                            transforms_cases,
                            image_cases,
                            survey_cases,
                            exr_cases,
                            volume_cases,
                            output_cases,
                            mesh_cases,
                            depth_cases,
                            checkpoint_cases}) {
    for (const Case& bad : cases()) tried.insert(bad.row);
  }
  size_t rows = 0;
  size_t missing = 0;
  for (const auto& [kind, count] : matrix) {
    for (int i = 1; i <= count; ++i, ++rows) {
      const std::string name = std::string(1, kind) + (i < 10 ? "0" : "") + std::to_string(i);
      EXPECT_EQ(tried.count(name), 1u) << name;
      missing += 1 - tried.count(name);
    }
  }
  std::printf("rows of the matrix: %zu; tried %zu\n", rows, rows - missing);
}

}  // namespace
}  // namespace cgs::test
