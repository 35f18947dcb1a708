// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/manual/help_footer.h"

#include <gtest/gtest.h>

#include "convert/commands/commands.h"
#include "convert/manual/option_words.h"

namespace cgs::help_footer_test {

namespace {

using Kind = FooterPart::Kind;

TEST(HelpFooter, TellsExamplesFromSentences) {
  const auto parts = footer_parts(
      "Points move to\nthe surface.\n"
      "Example: cgs measure a.ply --unit mm\n"
      "         cgs measure b.ply \\\n"
      "           --unit mm\n"
      "Running it again goes on.");
  ASSERT_EQ(parts.size(), 3u);
  EXPECT_EQ(parts[0].text, "Points move to the surface.");
  EXPECT_EQ(parts[1].kind, Kind::Example);
  EXPECT_EQ(parts[1].lines,
            (std::vector<std::string>{
                "cgs measure a.ply --unit mm", "cgs measure b.ply \\", "  --unit mm"}));
  EXPECT_EQ(parts[2].kind, Kind::Text);
  EXPECT_EQ(parts[2].text, "Running it again goes on.");
}

TEST(HelpFooter, TakesLinesBelowAColonForTerms) {
  const auto parts = footer_parts("Operations:\n  scale=F   Enlarge\n  hull      The hull\nDone.");
  ASSERT_EQ(parts.size(), 2u);
  ASSERT_EQ(parts[0].kind, Kind::Terms);
  EXPECT_EQ(parts[0].text, "Operations:");
  ASSERT_EQ(parts[0].terms.size(), 2u);
  EXPECT_EQ(parts[0].terms[1], (std::pair<std::string, std::string>{"hull", "The hull"}));
  EXPECT_EQ(parts[1].text, "Done.");
}

TEST(HelpFooter, LeavesTheColumnsOfATable) {
  const auto parts = footer_parts("from     to\na, b,\n  c      d\nSo it is.");
  ASSERT_EQ(parts.size(), 2u);
  ASSERT_EQ(parts[0].kind, Kind::Table);
  EXPECT_EQ(parts[0].lines.size(), 3u);
  EXPECT_EQ(parts[1].text, "So it is.");
}

TEST(HelpFooter, EveryCommandHasAnExampleOfItself) {
  const auto app = command_line();
  for (const CLI::App* command : commands_of(*app)) {
    bool has_example = false;
    for (const FooterPart& part : footer_parts(command->get_footer())) {
      if (part.kind != Kind::Example) continue;
      has_example |= part.lines.front().rfind("cgs " + command->get_name() + " ", 0) == 0;
    }
    EXPECT_TRUE(has_example) << command->get_name();
  }
}

}  // namespace

}  // namespace cgs::help_footer_test
