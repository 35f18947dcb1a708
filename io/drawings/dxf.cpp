// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/drawings/dxf.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include <Eigen/Geometry>

#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_writer.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

struct Layer {
  const char* name;
  int color;  // of the AutoCAD colour index
  const char* line_type;
};

constexpr Layer kOutline = {"OUTLINE", 9, "CONTINUOUS"};  // light grey, so that dashes show

// By label, the one for drawings without labels and the outline last.
constexpr std::array<Layer, kProvenanceCount + 2> kLayers = {{{"INFERRED", 6, "DASHED"},
                                                              {"SINGLE_VIEW", 4, "CONTINUOUS"},
                                                              {"OBSERVED", 7, "CONTINUOUS"},
                                                              {"INTERPOLATED", 3, "DOT"},
                                                              {"VIRTUAL", 5, "DASHED"},
                                                              {"ESTIMATED", 2, "DASHED"},
                                                              {"SECTION", 7, "CONTINUOUS"},
                                                              kOutline}};

const Layer& layer_of(int label) {
  return kLayers.at(label < 0 ? kProvenanceCount : static_cast<size_t>(label));
}

// Collects pairs of group code and value.
class Groups {
 public:
  Groups& text(int code, std::string_view value) {
    append_number(out_, code);
    out_ += '\n';
    for (const char c : value.substr(0, 250)) {
      out_ += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
    out_ += '\n';
    return *this;
  }
  Groups& number(int code, double value) {
    std::string digits;
    append_number(digits, value);
    return text(code, digits);
  }
  Groups& count(int code, int value) { return text(code, std::to_string(value)); }
  const std::string& all() const { return out_; }

 private:
  std::string out_;
};

int insunits(const std::string& unit) {
  constexpr std::array<std::pair<const char*, int>, 7> kCodes = {
      {{"in", 1}, {"ft", 2}, {"mm", 4}, {"cm", 5}, {"m", 6}, {"km", 7}, {"um", 13}}};
  for (const auto& [name, code] : kCodes) {
    if (unit == name) return code;
  }
  return 0;
}

Eigen::AlignedBox2d bounds(const Drawing& drawing) {
  Eigen::AlignedBox2d box;
  for (const DrawnLine& line : drawing.lines) {
    for (const Eigen::Vector2d& p : line.points) box.extend(p);
  }
  return box;
}

void add_header(Groups& out, const Drawing& drawing, const Eigen::AlignedBox2d& box) {
  out.text(999, "cgs: " + drawing.title).text(999, "unit " + drawing.unit);
  for (const std::string& note : drawing.notes) out.text(999, note);
  out.text(0, "SECTION").text(2, "HEADER");
  out.text(9, "$ACADVER").text(1, "AC1009");
  out.text(9, "$INSUNITS").count(70, insunits(drawing.unit));
  out.text(9, "$EXTMIN").number(10, box.min().x()).number(20, box.min().y()).number(30, 0);
  out.text(9, "$EXTMAX").number(10, box.max().x()).number(20, box.max().y()).number(30, 0);
  out.text(0, "ENDSEC");
}

// Pattern lengths are in units of the drawing; a hundredth of it shows well on paper and screen.
void add_tables(Groups& out, double extent) {
  const double dash = extent / 100;
  out.text(0, "SECTION").text(2, "TABLES");
  out.text(0, "TABLE").text(2, "LTYPE").count(70, 3);
  out.text(0, "LTYPE").text(2, "CONTINUOUS").count(70, 0).text(3, "Solid line").count(72, 65);
  out.count(73, 0).number(40, 0);
  out.text(0, "LTYPE").text(2, "DASHED").count(70, 0).text(3, "_ _ _ _").count(72, 65);
  out.count(73, 2).number(40, 1.5 * dash).number(49, dash).number(49, -0.5 * dash);
  out.text(0, "LTYPE").text(2, "DOT").count(70, 0).text(3, ". . . .").count(72, 65);
  out.count(73, 2).number(40, 0.5 * dash).number(49, 0).number(49, -0.5 * dash);
  out.text(0, "ENDTAB");
  out.text(0, "TABLE").text(2, "LAYER").count(70, static_cast<int>(kLayers.size()));
  for (const Layer& layer : kLayers) {
    out.text(0, "LAYER").text(2, layer.name).count(70, 0).count(62, layer.color);
    out.text(6, layer.line_type);
  }
  out.text(0, "ENDTAB").text(0, "ENDSEC");
}

void add_polyline(Groups& out, const LabelledRun& run, const char* layer) {
  constexpr int kClosed = 1;
  constexpr int kPatternRunsThrough = 128;
  out.text(0, "POLYLINE").text(8, layer).count(66, 1).number(10, 0).number(20, 0).number(30, 0);
  out.count(70, kPatternRunsThrough + (run.closed ? kClosed : 0));
  for (const Eigen::Vector2d& p : run.points) {
    out.text(0, "VERTEX").text(8, layer).number(10, p.x()).number(20, p.y()).number(30, 0);
  }
  out.text(0, "SEQEND").text(8, layer);
}

}  // namespace

std::vector<LabelledRun> labelled_runs(const DrawnLine& line) {
  const size_t count = line.segments();
  const auto label = [&](size_t i) {
    return line.of_segment.empty() ? -1 : static_cast<int>(line.of_segment[i % count]);
  };
  size_t start = 0;  // of a closed line, where the label changes
  if (line.closed) {
    while (start < count && label(start) == label(start + count - 1)) ++start;
    if (start == count) return {{line.points, label(0), true}};
  }
  std::vector<LabelledRun> out;
  for (size_t k = 0; k < count; ++k) {
    const size_t i = (start + k) % count;
    if (out.empty() || out.back().label != label(i)) {
      out.push_back({{line.points[i]}, label(i), false});
    }
    out.back().points.push_back(line.points[(i + 1) % line.points.size()]);
  }
  return out;
}

void write_dxf(const std::filesystem::path& path, const Drawing& drawing) {
  require(!drawing.lines.empty(), "a drawing needs lines, their number", drawing.lines.size());
  const Eigen::AlignedBox2d box = bounds(drawing);
  Groups out;
  add_header(out, drawing, box);
  add_tables(out, box.sizes().maxCoeff());
  out.text(0, "SECTION").text(2, "ENTITIES");
  for (const DrawnLine& line : drawing.lines) {
    if (line.closed && !line.of_segment.empty()) {
      add_polyline(out, {line.points, -1, true}, kOutline.name);
    }
  }
  for (const DrawnLine& line : drawing.lines) {
    for (const LabelledRun& run : labelled_runs(line)) {
      add_polyline(out, run, layer_of(run.label).name);
    }
  }
  out.text(0, "ENDSEC").text(0, "EOF");
  write_file(path, out.all());
}

}  // namespace cgs
