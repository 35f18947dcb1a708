// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/stage.h"

#include <set>
#include <string>

#include <gtest/gtest.h>

namespace cgs::stage_test {
namespace {

TEST(StageTable, HasARowForEachStageInTheirOrder) {
  for (size_t i = 0; i < kStages; ++i) {
    EXPECT_EQ(static_cast<size_t>(stage_table().at(i).id), i) << stage_table().at(i).name;
    EXPECT_EQ(&traits(stage_table().at(i).id), &stage_table().at(i));
  }
  EXPECT_EQ(stage_table().back().id, Stage::Report) << "the last of the stages";
}

TEST(StageTable, NamesNoTwoStagesAlike) {
  std::set<std::string> names;
  std::set<std::string> titles;
  for (const StageTraits& stage : stage_table()) {
    names.insert(stage.name);
    titles.insert(stage.title);
  }
  EXPECT_EQ(names.size(), kStages);
  EXPECT_EQ(titles.size(), kStages);
}

}  // namespace
}  // namespace cgs::stage_test
