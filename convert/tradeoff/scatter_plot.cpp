// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/tradeoff/scatter_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>

#include "io/drawings/svg.h"

namespace cgs {

namespace {

using Box = Eigen::AlignedBox2d;
using Eigen::Vector2d;

// All in pixels of the picture.
constexpr double kWidth = 860;
constexpr double kHeight = 430;
constexpr double kLeft = 76;
constexpr double kTop = 46;
constexpr double kRight = 24;
constexpr double kBottom = 58;
constexpr double kFont = 13;
constexpr double kLetter = 7.2;  // mean width of one, of a wide font
constexpr double kBoldLetter = 8.2;
constexpr double kDot = 5;

constexpr const char* kStyle = R"(<style>
svg { --paper: #ffffff; --ink: #1d2733; --line: #d5dae0; --grey: #75808c; --front: #1f6fb5; }
@media (prefers-color-scheme: dark) {
  svg { --paper: #14191f; --ink: #e4e8ec; --line: #333c46; --grey: #8b96a2; --front: #6db4f2; }
}
.paper { fill: var(--paper); } text { fill: var(--ink); stroke: var(--paper); stroke-width: 3px; stroke-linejoin: round; paint-order: stroke; } .grid { stroke: var(--line); }
.stairs { fill: none; stroke: var(--front); stroke-width: 1.6; } .leader { stroke: var(--grey); stroke-width: 0.8; }
circle { fill: var(--grey); stroke: var(--paper); } circle.front { fill: var(--front); }
text.off { fill: var(--grey); } text.front { font-weight: 600; } text.title { font-weight: 600; font-size: 15px; }
</style>
)";

std::string number(double value, const char* format = "%.6g") {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), format, value);  // NOLINT: fixed formats
  return text.data();
}

std::string pixel(double value) { return number(value, "%.1f"); }

std::string text_at(const Vector2d& p, const std::string& text, const std::string& attributes) {
  return "<text x=\"" + pixel(p.x()) + "\" y=\"" + pixel(p.y()) + "\" " + attributes + ">" +
         xml_text(text) + "</text>\n";
}

// Values to pixels along one axis.
struct Axis {
  double low = 0;
  double high = 1;
  bool logarithmic = false;
  double from = 0;  // pixel of low
  double to = 1;

  double pixel_of(double value) const {
    const double t =
        logarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
    return from + t * (to - from);
  }

  std::vector<double> round_numbers(const std::vector<double>& digits) const {
    std::vector<double> out;
    for (double power = std::pow(10, std::floor(std::log10(low))); power <= high; power *= 10) {
      for (const double digit : digits) {
        if (digit * power >= low && digit * power <= high) out.push_back(digit * power);
      }
    }
    return out;
  }

  std::vector<double> ticks() const {
    std::vector<double> out;
    if (logarithmic) {
      const std::vector<double> few = round_numbers({1, 2, 5});
      return few.size() > 3 ? few : round_numbers({1, 1.5, 2, 3, 4, 5, 6, 8});
    }
    const double power = std::pow(10, std::floor(std::log10((high - low) / 5)));
    const double rest = (high - low) / 5 / power;
    const double step = power * (rest > 5 ? 10 : rest > 2 ? 5 : rest > 1 ? 2 : 1);
    for (double k = std::ceil(low / step); k * step <= high; ++k) out.push_back(k * step);
    return out;
  }
};

// An axis that holds all values with room for labels around them.
Axis axis_for(const std::vector<double>& values, bool logarithmic) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  if (logarithmic) {
    const double room = std::max(1.15, std::pow(*most / *least, 0.12));
    return {*least / room, *most * room, true};
  }
  const double room = std::max(0.12 * (*most - *least), std::max(1e-3 * std::abs(*most), 1e-12));
  return {*least - room, *most + room, false};
}

std::string grid(const Axis& x, const Axis& y) {
  std::string out;
  const auto line = [&](double x1, double y1, double x2, double y2) {
    out += "<line class=\"grid\" x1=\"" + pixel(x1) + "\" y1=\"" + pixel(y1) + "\" x2=\"" +
           pixel(x2) + "\" y2=\"" + pixel(y2) + "\"/>\n";
  };
  for (const double value : x.ticks()) {
    const double at = x.pixel_of(value);
    line(at, y.from, at, y.to);
    out += text_at({at, y.from + 18}, number(value), "text-anchor=\"middle\"");
  }
  for (const double value : y.ticks()) {
    const double at = y.pixel_of(value);
    line(x.from, at, x.to, at);
    out += text_at({x.from - 8, at + 4}, number(value), "text-anchor=\"end\"");
  }
  return out;
}

// Where the text of a point goes: as near as there is room, beside dots and other texts.
Box place_label(const Vector2d& point,
                double width,
                const std::vector<Box>& taken,
                const Box& inside) {
  const auto is_free = [&](const Box& box) {
    return inside.contains(box) && std::none_of(taken.begin(), taken.end(), [&](const Box& other) {
             return other.intersects(box);
           });
  };
  constexpr std::array<int, 8> kOrder = {0, 4, 2, 6, 1, 7, 3, 5};  // eighths of a turn
  Box fallback;
  for (double radius = kDot + 4; radius < 160; radius += 7) {
    for (const int eighth : kOrder) {
      const double angle = eighth * std::numbers::pi / 4;
      const Vector2d way(std::cos(angle), -std::sin(angle));
      const Vector2d size(width, kFont);
      const Vector2d middle =
          point + radius * way + 0.5 * size.cwiseProduct(Vector2d(way.x(), way.y()));
      const Box box(middle - 0.5 * size, middle + 0.5 * size);
      if (fallback.isEmpty()) fallback = box;
      if (is_free(box)) return box;
    }
  }
  return fallback;
}

// The corners of the line that joins the front: everything above and right of it is beaten.
std::vector<Vector2d> stairs(const std::vector<ScatterPlot::Point>& points,
                             const std::vector<Vector2d>& places) {
  std::vector<Vector2d> front;
  for (size_t i = 0; i < points.size(); ++i) {
    if (points[i].on_front) front.push_back(places[i]);
  }
  std::sort(front.begin(), front.end(), [](const auto& a, const auto& b) { return a.x() < b.x(); });
  std::vector<Vector2d> out;
  for (const Vector2d& p : front) {
    if (!out.empty()) out.emplace_back(p.x(), out.back().y());
    out.push_back(p);
  }
  return out;
}

std::string line_through(const std::vector<Vector2d>& corners) {
  std::string out = "<polyline class=\"stairs\" points=\"";
  for (const Vector2d& p : corners)
    out.append(pixel(p.x())).append(",").append(pixel(p.y())) += ' ';
  return out + "\"/>\n";
}

// As near to its point as the box lets it, whatever the width of the font.
std::string label_in(const Box& box,
                     const Vector2d& point,
                     const std::string& label,
                     bool on_front) {
  const bool is_right = box.min().x() > point.x();
  const bool is_left = box.max().x() < point.x();
  const double x = is_right ? box.min().x() : is_left ? box.max().x() : box.center().x();
  const std::string anchor = is_right ? "start" : is_left ? "end" : "middle";
  return text_at({x, box.max().y() - 2},
                 label,
                 "text-anchor=\"" + anchor + "\" class=\"" + (on_front ? "front" : "off") + "\"");
}

std::string labels(const std::vector<ScatterPlot::Point>& points,
                   const std::vector<Vector2d>& places,
                   const std::vector<Vector2d>& corners,
                   const Box& inside) {
  std::vector<Box> taken;
  for (size_t i = 1; i < corners.size(); ++i) {
    taken.emplace_back(corners[i - 1].cwiseMin(corners[i]), corners[i - 1].cwiseMax(corners[i]));
  }
  for (const Vector2d& p : places) {
    taken.emplace_back(p.array() - kDot, p.array() + kDot);
  }
  std::string out;
  for (const bool front : {true, false}) {  // the front has the first choice
    for (size_t i = 0; i < points.size(); ++i) {
      if (points[i].on_front != front) continue;
      const double width = (front ? kBoldLetter : kLetter) * double(points[i].label.size());
      const Box box = place_label(places[i], width, taken, inside);
      taken.push_back(box);
      const Vector2d near = places[i].cwiseMax(box.min()).cwiseMin(box.max());
      if ((near - places[i]).norm() > 2.5 * kDot) {
        out += "<line class=\"leader\" x1=\"" + pixel(places[i].x()) + "\" y1=\"" +
               pixel(places[i].y()) + "\" x2=\"" + pixel(near.x()) + "\" y2=\"" + pixel(near.y()) +
               "\"/>\n";
      }
      out += label_in(box, places[i], points[i].label, front);
    }
  }
  return out;
}

std::string panel(const ScatterPlot& plot) {
  std::string out = text_at({kLeft, 26}, plot.title, "class=\"title\"");
  if (plot.points.empty()) return out + text_at({kLeft, 80}, "nothing was measured", "");
  std::vector<double> xs;
  std::vector<double> ys;
  for (const ScatterPlot::Point& p : plot.points) {
    xs.push_back(p.x);
    ys.push_back(p.y);
  }
  Axis x = axis_for(xs, true);
  Axis y = axis_for(ys, plot.y_is_logarithmic);
  x.from = kLeft;
  x.to = kWidth - kRight;
  y.from = kHeight - kBottom;
  y.to = kTop;
  std::vector<Vector2d> places;
  for (const ScatterPlot::Point& p : plot.points) {
    places.emplace_back(x.pixel_of(p.x), y.pixel_of(p.y));
  }
  const std::vector<Vector2d> corners = stairs(plot.points, places);
  out += grid(x, y) + line_through(corners);
  out += labels(plot.points, places, corners, Box(Vector2d(x.from, y.to), Vector2d(x.to, y.from)));
  for (size_t i = 0; i < places.size(); ++i) {
    out += "<circle cx=\"" + pixel(places[i].x()) + "\" cy=\"" + pixel(places[i].y()) + "\" r=\"" +
           pixel(kDot) + "\"" + (plot.points[i].on_front ? " class=\"front\"" : "") + "/>\n";
  }
  out += text_at({0.5 * (x.from + x.to), kHeight - 14}, plot.x_axis, "text-anchor=\"middle\"");
  const Vector2d beside(20, 0.5 * (y.from + y.to));
  return out + text_at(beside,
                       plot.y_axis,
                       "text-anchor=\"middle\" transform=\"rotate(-90 " + pixel(beside.x()) + ' ' +
                           pixel(beside.y()) + ")\"");
}

}  // namespace

std::string scatter_svg(const std::vector<ScatterPlot>& plots) {
  const std::string width = pixel(kWidth);
  const std::string height = pixel(kHeight * double(plots.size()));
  std::string out = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + width + "\" height=\"" +
                    height + "\" viewBox=\"0 0 " + width + ' ' + height +
                    "\" font-family=\"system-ui, sans-serif\" font-size=\"" + pixel(kFont) +
                    "\">\n" + kStyle + "<rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n";
  for (size_t i = 0; i < plots.size(); ++i) {
    out += "<g transform=\"translate(0 " + pixel(kHeight * double(i)) + ")\">\n" + panel(plots[i]) +
           "</g>\n";
  }
  return out + "</svg>\n";
}

}  // namespace cgs
