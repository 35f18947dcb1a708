// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/drawings/svg.h"

#include <regex>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/full_disk.h"

namespace cgs::svg_test {
namespace {

Drawing triangle() {
  Drawing out;
  out.unit = "m";
  out.title = "a < b & \"c\"";
  out.notes = {"one", "two"};
  out.lines = {{{{5000000, 10}, {5000004, 10}, {5000004, 13}},
                {Provenance::Observed, Provenance::Inferred, Provenance::Inferred},
                true}};
  return out;
}

TEST(WriteSvg, DrawsLabelsApartWithYDownwards) {
  const test::TempDir dir;
  write_svg(dir / "a.svg", triangle());
  const std::string text = test::read_bytes(dir / "a.svg");
  std::smatch found;
  ASSERT_TRUE(std::regex_search(text, found, std::regex("class=\"observed\" d=\"M([-0-9. L]+)\"")));
  std::string points = found[1];
  EXPECT_TRUE(std::regex_match(points, std::regex("0\\.0+ 3\\.0+ L4\\.0+ 3\\.0+"))) << points;
  ASSERT_TRUE(std::regex_search(text, found, std::regex("class=\"inferred\" d=\"M([-0-9. L]+)\"")));
  points = found[1];
  EXPECT_TRUE(std::regex_match(points, std::regex("4\\.0+ 3\\.0+ L4\\.0+ 0\\.0+ L0\\.0+ 3\\.0+")))
      << points;
  EXPECT_NE(text.find("a &lt; b &amp; &quot;c&quot;"), std::string::npos);
  EXPECT_NE(text.find("(5000000, 13) of the drawing"), std::string::npos);
  EXPECT_NE(text.find(".inferred { stroke: #c02a8a; stroke-dasharray"), std::string::npos);
}

TEST(WriteSvg, HasAClassForEveryLabel) {
  const test::TempDir dir;
  Drawing drawing = triangle();
  for (const auto& [label, name] :
       {std::pair(Provenance::Virtual, "virtual"), {Provenance::Estimated, "estimated"}}) {
    drawing.lines[0].of_segment.assign(3, label);
    write_svg(dir / "a.svg", drawing);
    const std::string text = test::read_bytes(dir / "a.svg");
    EXPECT_NE(text.find(std::string("class=\"") + name + '"'), std::string::npos);
    EXPECT_NE(text.find(std::string("\n.") + name + " { stroke: "), std::string::npos);
  }
  drawing.lines[0].of_segment.clear();
  write_svg(dir / "a.svg", drawing);
  EXPECT_NE(test::read_bytes(dir / "a.svg").find("class=\"section\""), std::string::npos);
}

TEST(WriteSvg, NeedsALineAndADisk) {
  const test::TempDir dir;
  EXPECT_THROW(write_svg(dir / "a.svg", Drawing{}), InvalidInput);
  test::expect_full_disk_is_noticed([](const auto& path) { write_svg(path, triangle()); });
}

}  // namespace
}  // namespace cgs::svg_test
