// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/drawings/svg.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include <Eigen/Geometry>

#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_writer.h"
#include "io/drawings/dxf.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr const char* kStyle = R"(<style>
path { fill: none; stroke: #1d2733; stroke-width: 1.6px; vector-effect: non-scaling-stroke; stroke-linejoin: round; }
.single_view { stroke: #4a7fb5; stroke-width: 1px; }
.interpolated { stroke: #2a7d46; stroke-dasharray: 1.5 3; }
.estimated { stroke: #b08a00; stroke-dasharray: 4 3; }
.inferred { stroke: #c02a8a; stroke-dasharray: 7 4; }
.virtual { stroke: #7a5fb5; stroke-dasharray: 7 2; }
text { font-family: system-ui, sans-serif; fill: #1d2733; }
</style>
)";

// By label, the one for drawings without labels last.
constexpr std::array<const char*, kProvenanceCount + 1> kClasses = {
    "inferred", "single_view", "observed", "interpolated", "virtual", "estimated", "section"};

// Coordinates of the picture: to the lower left corner of the lines, y downwards.
struct Picture {
  Eigen::AlignedBox2d box;
  std::string digits(double value) const {
    // A ten-thousandth of a pixel at the size it is shown.
    const double step = std::pow(10, std::floor(std::log10(extent())) - 7);
    std::array<char, 400> text{};  // of the largest number, which has 309 digits
    const int places = std::clamp(static_cast<int>(-std::log10(step)), 0, 60);
    const auto end =
        std::to_chars(text.begin(), text.end(), value, std::chars_format::fixed, places);
    return {text.begin(), end.ptr};
  }
  double extent() const { return std::max(box.sizes().maxCoeff(), 1e-300); }
  std::string x(double value) const { return digits(value - box.min().x()); }
  std::string y(double value) const { return digits(box.max().y() - value); }
};

std::string path_text(const LabelledRun& run, const Picture& picture) {
  std::string out = "<path class=\"";
  out += run.label < 0 ? kClasses.back() : kClasses.at(static_cast<size_t>(run.label));
  out += "\" d=\"";
  for (size_t i = 0; i < run.points.size(); ++i) {
    out += i == 0 ? "M" : " L";
    out += picture.x(run.points[i].x()) + ' ' + picture.y(run.points[i].y());
  }
  return out + (run.closed ? " Z" : "") + "\"/>\n";
}

// 1, 2 or 5 times a power of ten, about a fifth of the width.
double bar_length(double extent) {
  const double power = std::pow(10, std::floor(std::log10(extent / 5)));
  const double rest = extent / 5 / power;
  return power * (rest >= 5 ? 5 : rest >= 2 ? 2 : 1);
}

std::string number(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.begin(), text.end(), value, std::chars_format::general, 10);
  return {text.begin(), end.ptr};
}

std::string legend(const Drawing& drawing, const Picture& picture, double line_height) {
  const double bottom = picture.box.sizes().y() + 2 * line_height;
  const double bar = bar_length(picture.extent());
  const std::string y = picture.digits(bottom);
  std::string out = "<path d=\"M0 " + y + " L" + picture.digits(bar) + ' ' + y + "\"/>\n";
  double at = bottom;
  const auto line = [&](const std::string& text) {
    at += 1.3 * line_height;
    out += "<text x=\"0\" y=\"" + picture.digits(at) + "\" font-size=\"" +
           picture.digits(line_height) + "\">" + xml_text(text) + "</text>\n";
  };
  line(number(bar) + ' ' + (drawing.unit == "unknown" ? "scene units" : drawing.unit));
  line(drawing.title);
  for (const std::string& note : drawing.notes) line(note);
  line("(0, 0) of this picture is (" + number(picture.box.min().x()) + ", " +
       number(picture.box.max().y()) + ") of the drawing");
  return out;
}

}  // namespace

std::string xml_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '<') {
      out += "&lt;";
    } else if (c == '>') {
      out += "&gt;";
    } else if (c == '&') {
      out += "&amp;";
    } else if (c == '"') {
      out += "&quot;";
    } else {
      out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return out;
}

void write_svg(const std::filesystem::path& path, const Drawing& drawing) {
  require(!drawing.lines.empty(), "a drawing needs lines, their number", drawing.lines.size());
  Picture picture;
  for (const DrawnLine& line : drawing.lines) {
    for (const Eigen::Vector2d& p : line.points) picture.box.extend(p);
  }
  const Eigen::Vector2d size = picture.box.sizes();
  const double line_height = picture.extent() / 45;
  const double margin = 2 * line_height;
  const double width = std::max(size.x(), 0.8 * picture.extent()) + 2 * margin;
  const double height =
      size.y() + 2 * margin + line_height * (5 + 1.3 * static_cast<double>(drawing.notes.size()));
  constexpr double kPixels = 1200;
  std::string out = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + number(kPixels) +
                    "\" height=\"" + number(kPixels * height / width) + "\" viewBox=\"" +
                    picture.digits(-margin) + ' ' + picture.digits(-margin) + ' ' +
                    picture.digits(width) + ' ' + picture.digits(height) + "\">\n";
  out += "<title>" + xml_text(drawing.title) + "</title>\n" + kStyle;
  out += "<rect x=\"" + picture.digits(-margin) + "\" y=\"" + picture.digits(-margin) +
         "\" width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  for (const DrawnLine& line : drawing.lines) {
    for (const LabelledRun& run : labelled_runs(line)) out += path_text(run, picture);
  }
  write_file(path, out + legend(drawing, picture, line_height) + "</svg>\n");
}

}  // namespace cgs
