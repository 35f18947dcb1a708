// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/drawings/dxf.h"

#include <algorithm>
#include <map>
#include <sstream>

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/full_disk.h"

namespace cgs::dxf_test {
namespace {

constexpr Provenance kSeen = Provenance::Observed;
constexpr Provenance kInvented = Provenance::Inferred;

Drawing square(std::vector<Provenance> labels) {
  Drawing out;
  out.unit = "mm";
  out.title = "a\nb";
  out.lines = {{{{5000000.25, 1}, {5000002, 1}, {5000002, 3}, {5000000.25, 3}}, labels, true}};
  return out;
}

// Group codes and values, as any reader of DXF begins.
std::vector<std::pair<int, std::string>> groups(const std::string& bytes) {
  std::istringstream lines(bytes);
  std::vector<std::pair<int, std::string>> out;
  std::string code;
  std::string value;
  while (std::getline(lines, code) && std::getline(lines, value)) {
    out.emplace_back(std::stoi(code), value);
  }
  return out;
}

TEST(LabelledRuns, StartWhereTheLabelChanges) {
  const auto runs = labelled_runs(square({kInvented, kSeen, kSeen, kInvented}).lines[0]);
  ASSERT_EQ(runs.size(), 2U);
  EXPECT_EQ(runs[0].label, 2);
  EXPECT_EQ(runs[0].points.size(), 3U);
  EXPECT_EQ(runs[1].label, 0);
  EXPECT_EQ(runs[1].points.size(), 3U);
  EXPECT_EQ(runs[0].points.back(), runs[1].points.front());
  EXPECT_EQ(runs[1].points.back(), runs[0].points.front());
  const auto whole = labelled_runs(square({kSeen, kSeen, kSeen, kSeen}).lines[0]);
  ASSERT_EQ(whole.size(), 1U);
  EXPECT_TRUE(whole[0].closed);
  EXPECT_EQ(labelled_runs(square({}).lines[0])[0].label, -1);
  const DrawnLine open{{{0, 0}, {1, 0}, {2, 0}}, {kSeen, kInvented}, false};
  EXPECT_EQ(labelled_runs(open).size(), 2U);
}

TEST(WriteDxf, HasWhatReadersLookFor) {
  const test::TempDir dir;
  write_dxf(dir / "a.dxf", square({kInvented, kSeen, kSeen, kInvented}));
  const auto all = groups(test::read_bytes(dir / "a.dxf"));
  std::map<std::string, int> count;
  std::map<std::string, int> vertices_on;
  std::map<std::string, std::string> line_type;
  double largest_x = 0;
  for (size_t i = 0; i < all.size(); ++i) {
    const auto& [code, value] = all[i];
    if (code == 0) ++count[value];
    if (code == 0 && value == "VERTEX") {
      ++vertices_on[all[i + 1].second];
      largest_x = std::max(largest_x, std::stod(all[i + 2].second));
    }
    if (code == 0 && value == "LAYER") line_type[all[i + 1].second] = all[i + 4].second;
    if (value == "$INSUNITS") {
      EXPECT_EQ(all[i + 1].second, "4");
    }
  }
  EXPECT_EQ(count["SECTION"], 3);
  EXPECT_EQ(count["ENDSEC"], 3);
  EXPECT_EQ(count["POLYLINE"], 3);
  EXPECT_EQ(count["SEQEND"], 3);
  EXPECT_EQ(vertices_on["OUTLINE"], 4);
  EXPECT_EQ(vertices_on["OBSERVED"], 3);
  EXPECT_EQ(vertices_on["INFERRED"], 3);
  EXPECT_EQ(line_type["INFERRED"], "DASHED");
  EXPECT_EQ(line_type["OBSERVED"], "CONTINUOUS");
  EXPECT_EQ(largest_x, 5000002);
  EXPECT_EQ(all.back().second, "EOF");
}

TEST(WriteDxf, HasALayerForEveryLabel) {
  const test::TempDir dir;
  const auto layer_of = [&](std::vector<Provenance> labels) {
    write_dxf(dir / "a.dxf", square(std::move(labels)));
    const auto all = groups(test::read_bytes(dir / "a.dxf"));
    auto line = std::find(all.begin(), all.end(), std::pair(0, std::string("POLYLINE")));
    if (std::next(line)->second == "OUTLINE") {
      line = std::find(std::next(line), all.end(), std::pair(0, std::string("POLYLINE")));
    }
    const std::string name = std::next(line)->second;
    const std::pair<int, std::string> defined(2, name);
    EXPECT_NE(std::find(all.begin(), line, defined), line) << name;
    return name;
  };
  EXPECT_EQ(layer_of(std::vector<Provenance>(4, Provenance::Virtual)), "VIRTUAL");
  EXPECT_EQ(layer_of(std::vector<Provenance>(4, Provenance::Estimated)), "ESTIMATED");
  EXPECT_EQ(layer_of({}), "SECTION");
}

TEST(WriteDxf, NeedsALineAndADisk) {
  const test::TempDir dir;
  EXPECT_THROW(write_dxf(dir / "a.dxf", Drawing{}), InvalidInput);
  test::expect_full_disk_is_noticed([](const auto& path) { write_dxf(path, square({})); });
}

// What a hatch needs: one closed polyline around each area, its corners in their order.
TEST(WriteDxf, HasAClosedOutlineOfWhatLabelsCut) {
  const test::TempDir dir;
  Drawing drawing = square({kInvented, kSeen, kSeen, kInvented});
  drawing.lines.push_back(
      {{{5000001, 1.5}, {5000001.5, 2}, {5000001, 2}}, {kSeen, kSeen, kSeen}, true});
  drawing.lines.push_back({{{0, 0}, {1, 0}, {2, 0}}, {kSeen, kInvented}, false});
  write_dxf(dir / "a.dxf", drawing);
  const auto all = groups(test::read_bytes(dir / "a.dxf"));
  std::vector<std::vector<Eigen::Vector2d>> closed;
  size_t lines = 0;
  for (size_t i = 0; i < all.size(); ++i) {
    if (all[i] == std::pair(0, std::string("POLYLINE"))) {
      ++lines;
      const bool is_outline = all[i + 1] == std::pair(8, std::string("OUTLINE"));
      EXPECT_EQ(is_outline, lines <= 2) << "below the others";
      if (!is_outline) break;
      closed.emplace_back();
      const auto flags = std::find_if(all.begin() + static_cast<ptrdiff_t>(i),
                                      all.end(),
                                      [](const auto& group) { return group.first == 70; });
      EXPECT_EQ(std::stoi(flags->second) & 1, 1);
    } else if (all[i] == std::pair(0, std::string("VERTEX"))) {
      closed.back().emplace_back(std::stod(all[i + 2].second), std::stod(all[i + 3].second));
    }
  }
  ASSERT_EQ(closed.size(), 2U);
  EXPECT_EQ(closed[0], drawing.lines[0].points);
  EXPECT_EQ(closed[1], drawing.lines[1].points);
  write_dxf(dir / "b.dxf", square({}));
  const std::string bare = test::read_bytes(dir / "b.dxf");
  const size_t entities = bare.find("ENTITIES");
  EXPECT_EQ(bare.find("OUTLINE", entities), std::string::npos) << "SECTION is closed already";
}

}  // namespace
}  // namespace cgs::dxf_test
