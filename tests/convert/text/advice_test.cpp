// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/text/advice.h"

#include <gtest/gtest.h>

#include "libcgs/core/remedy.h"

namespace cgs::advice_test {
namespace {

TEST(WordsOf, NamesTheOptionThatHelps) {
  EXPECT_EQ(words_of(WithRemedy<NumericalError>(Remedy::FocalLength, "state it, in pixels")),
            "state it, in pixels (--focal)");
  EXPECT_EQ(words_of(WithRemedy<BadInput>(Remedy::ExternalFiles, Defect::Path, "a", "is outside")),
            "PATH: a: is outside (--allow-external)");
  EXPECT_EQ(words_of(NumericalError("nothing helps")), "nothing helps");
}

// An error is caught by its own type, whether or not it has a remedy.
TEST(WordsOf, KeepsTheKindOfTheError) {
  try {
    throw WithRemedy<LimitError>(Remedy::PoissonSpacing, "too many faces");
  } catch (const LimitError& error) {
    EXPECT_EQ(error.exit_code(), 4);
    EXPECT_NE(words_of(error).find("--op poisson=SPACING"), std::string::npos);
  }
}

TEST(WordsOf, HasAnOptionForEveryRemedy) {
  for (int i = 1; i <= static_cast<int>(Remedy::NoWater); ++i) {
    const WithRemedy<InvalidInput> error(static_cast<Remedy>(i), "wrong");
    EXPECT_NE(words_of(error).find("--"), std::string::npos) << i;
  }
}

}  // namespace
}  // namespace cgs::advice_test
