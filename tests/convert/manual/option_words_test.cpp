// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/manual/option_words.h"

#include <map>
#include <tuple>

#include <gtest/gtest.h>

namespace cgs::option_words_test {

namespace {

using Words = std::vector<std::string>;

TEST(OptionWords, ListWhatAnOptionMayBeWhereThatIsClosed) {
  CLI::App app;
  std::string text;
  int number = 0;
  const std::map<std::string, int> names = {{"draco", 0}, {"plain", 1}};
  EXPECT_EQ(closed_values(*app.add_option("--a", text)->check(CLI::IsMember({"in", "out"}))),
            (Words{"in", "out"}));
  EXPECT_EQ(
      closed_values(*app.add_option("--b", number)
                         ->transform(CLI::CheckedTransformer(names).description("draco, plain"))),
      (Words{"draco", "plain"}));
  EXPECT_EQ(closed_values(*app.add_option("--c", number)->check(CLI::Range(0, 5))), Words{});
  EXPECT_EQ(closed_values(*app.add_option("--d", text)), Words{});
}

TEST(OptionWords, TellHowAnOptionIsTyped) {
  CLI::App app;
  std::string text;
  std::vector<double> up;
  std::vector<std::tuple<std::string, std::string, std::string>> distances;
  bool flag = false;
  const CLI::Option* output = app.add_option("-o,--output", text);
  EXPECT_EQ(spellings(*output), (Words{"-o", "--output"}));
  EXPECT_EQ(main_name(*output), "--output");
  EXPECT_EQ(value_words(*output), Words{"TEXT"});
  EXPECT_FALSE(is_repeatable(*output));

  EXPECT_EQ(value_words(*app.add_option("--up", up)->expected(3)),
            (Words{"FLOAT", "FLOAT", "FLOAT"}));
  const CLI::Option* known = app.add_option("--known", distances)->allow_extra_args(false);
  EXPECT_EQ(value_words(*known), (Words{"TEXT", "TEXT", "TEXT"}));
  EXPECT_TRUE(is_repeatable(*known));
  EXPECT_FALSE(takes_value(*app.add_flag("--json", flag)));
  const CLI::Option* scene = app.add_option("scene", text);
  EXPECT_EQ(spellings(*scene), Words{});
  EXPECT_EQ(main_name(*scene), "scene");
}

}  // namespace

}  // namespace cgs::option_words_test
