// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/tradeoff/scatter_plot.h"

#include <map>
#include <regex>
#include <string>

#include <gtest/gtest.h>

namespace cgs::scatter_plot_test {
namespace {

struct Text {
  double x = 0;
  double y = 0;
  std::string words;
};

// Labels of points, where the font is as wide as a plain one: 7 pixels a letter.
std::vector<Text> labels_of(const std::string& svg, const std::string& kind) {
  const std::regex pattern(
      "<text x=\"([-0-9.]+)\" y=\"([-0-9.]+)\" text-anchor=\"([a-z]+)\" class=\"(?:" + kind +
      ")\">([^<]*)<");
  std::vector<Text> out;
  for (std::sregex_iterator it(svg.begin(), svg.end(), pattern), end; it != end; ++it) {
    const std::string anchor = (*it)[3];
    Text text{std::stod((*it)[1]), std::stod((*it)[2]), (*it)[4]};
    const double half = 3.5 * double(text.words.size());
    text.x += anchor == "start" ? half : anchor == "end" ? -half : 0;
    out.push_back(text);
  }
  return out;
}

size_t count(const std::string& text, const std::string& part) {
  size_t n = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

ScatterPlot plot() {
  return {"a < b",
          "time [s]",
          "PSNR [dB]",
          false,
          {{1, 20, "draft & fast", true}, {10, 24, "standard", true}, {100, 22, "slow", false}}};
}

TEST(ScatterSvg, DrawsEveryPointAndJoinsTheFront) {
  const std::string svg = scatter_svg({plot()});
  EXPECT_EQ(count(svg, "<circle"), 3u);
  EXPECT_EQ(count(svg, "<circle") - count(svg, "class=\"front\"/>"), 1u);
  EXPECT_EQ(labels_of(svg, "off").size(), 1u);
  EXPECT_EQ(labels_of(svg, "front").size(), 2u);
  EXPECT_NE(svg.find("draft &amp; fast"), std::string::npos);
  EXPECT_NE(svg.find(">time [s]<"), std::string::npos);
  EXPECT_NE(svg.find("prefers-color-scheme: dark"), std::string::npos);
  // Logarithmic x: 10 lies in the middle of 1 and 100, and up is more.
  std::vector<double> xs;
  std::vector<double> ys;
  const std::regex circle("<circle cx=\"([-0-9.]+)\" cy=\"([-0-9.]+)\"");
  for (std::sregex_iterator it(svg.begin(), svg.end(), circle), end; it != end; ++it) {
    xs.push_back(std::stod((*it)[1]));
    ys.push_back(std::stod((*it)[2]));
  }
  EXPECT_NEAR(xs[1], 0.5 * (xs[0] + xs[2]), 0.11);
  EXPECT_NEAR(ys[2], 0.5 * (ys[0] + ys[1]), 0.11);
  EXPECT_GT(ys[0], ys[1]);
}

TEST(ScatterSvg, LabelsOfACrowdDoNotLieOnEachOther) {
  ScatterPlot crowd = plot();
  crowd.y_is_logarithmic = true;
  crowd.points.clear();
  for (int i = 0; i < 20; ++i) {
    crowd.points.push_back(
        {10 + 0.01 * i, 1 + 0.001 * (i % 5), "setting " + std::to_string(i), false});
  }
  crowd.points.push_back({1, 10, "far", true});
  const std::vector<Text> labels = labels_of(scatter_svg({crowd}), "off|front");
  ASSERT_EQ(labels.size(), 21u);
  for (const Text& a : labels) {
    for (const Text& b : labels) {
      if (a.words == b.words) continue;
      const double width = 3.5 * double(a.words.size() + b.words.size());  // half of each
      EXPECT_TRUE(std::abs(a.x - b.x) > width - 1 || std::abs(a.y - b.y) > 12)
          << a.words << " / " << b.words;
    }
  }
}

// However wide the reader's font is.
TEST(ScatterSvg, LabelsToTheRightBeginAndThoseToTheLeftEndBesideTheirPoints) {
  const std::string svg = scatter_svg({plot()});
  const std::regex pattern(
      "<text x=\"([-0-9.]+)\"[^>]*text-anchor=\"(start|end)\" class=\"[a-z]+\">([^<]*)<");
  const std::map<std::string, double> dots = {{"standard", 456}, {"slow", 762.5}};
  size_t found = 0;
  for (std::sregex_iterator it(svg.begin(), svg.end(), pattern), end; it != end; ++it, ++found) {
    const double gap = (*it)[2] == "start" ? 9 : -9;
    EXPECT_NEAR(std::stod((*it)[1]), dots.at((*it)[3]) + gap, 0.11) << (*it)[3];
  }
  EXPECT_EQ(found, 2u);
}

TEST(ScatterSvg, StandsPointsThatAreOneAndPlotsWithoutAny) {
  ScatterPlot one = plot();
  one.points.resize(1);
  ScatterPlot none = plot();
  none.points.clear();
  const std::string svg = scatter_svg({one, none});
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
  EXPECT_NE(svg.find("nothing was measured"), std::string::npos);
}

}  // namespace
}  // namespace cgs::scatter_plot_test
