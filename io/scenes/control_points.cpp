// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/control_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string_view>

#include "io/bytes/byte_reader.h"
#include "io/bytes/text_lines.h"

namespace cgs {

namespace {

constexpr std::array<std::string_view, 7> kColumnsNeeded = {
    "name", "x", "y", "z", "view", "px", "py"};
constexpr std::array<std::string_view, 2> kOptional = {"sigma", "role"};
constexpr double kFarthest = 1e12;
constexpr size_t kMostPoints = 10'000;
constexpr size_t kMostPicks = 1'000;  // of a point

std::string_view unquoted(std::string_view field) {
  if (field.size() >= 2 && field.front() == '"' && field.back() == '"') {
    field = field.substr(1, field.size() - 2);
  }
  return field;
}

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = (c >= 'A' && c <= 'Z') ? static_cast<char>(c - 'A' + 'a') : c;
  return out;
}

char separator_of(std::string_view header) {
  for (const char separator : {'\t', ';'}) {
    if (header.find(separator) != std::string_view::npos) return separator;
  }
  return ',';
}

/// A surveyed point while its rows come in.
struct Entry {
  ControlPoint point;
  size_t position_line = 0;  // 0 = not stated yet
  size_t sigma_line = 0;
  size_t role_line = 0;
  size_t first_line = 0;
};

class Table {
 public:
  Table(std::string_view text, const std::filesystem::path& path) : lines_(text, path) {
    read_header();
    while (const auto line = lines_.next_data()) read_row(*line);
  }

  std::vector<ControlPoint> points() const {
    std::vector<ControlPoint> out;
    for (const Entry& entry : entries_) {
      if (entry.position_line == 0) {
        throw BadInput(Defect::Schema,
                       lines_.path(),
                       "line " + std::to_string(entry.first_line) +
                           ": no row states x, y and z of " + quoted(entry.point.name));
      }
      out.push_back(entry.point);
    }
    return out;
  }

 private:
  static std::string quoted(std::string_view text) {
    constexpr size_t kShown = 40;
    return "\"" + printable(std::string(text.substr(0, kShown))) + "\"";
  }

  void read_header() {
    const auto header = lines_.next_data();
    if (!header) throw BadInput(Defect::Empty, lines_.path(), "has no line with names of columns");
    separator_ = separator_of(*header);
    const std::string allowed =
        "; columns are name, x, y, z, view, px, py and, if wanted, sigma and role";
    for (const std::string_view field : fields(*header, separator_)) {
      const std::string column = lower(unquoted(field));
      const bool is_known =
          std::find(kColumnsNeeded.begin(), kColumnsNeeded.end(), column) != kColumnsNeeded.end() ||
          std::find(kOptional.begin(), kOptional.end(), column) != kOptional.end();
      if (!is_known) lines_.fail(Defect::Schema, "unknown column " + quoted(column) + allowed);
      if (!columns_.emplace(column, columns_.size()).second) {
        lines_.fail(Defect::Schema, "column " + quoted(column) + " is there twice");
      }
    }
    for (const std::string_view needed : kColumnsNeeded) {
      if (columns_.contains(std::string(needed))) continue;
      lines_.fail(Defect::Schema, "has no column " + quoted(needed) + allowed);
    }
  }

  // Empty where the table has no such column, or the row ends before it.
  std::string_view cell(const std::string& column) const {
    const auto found = columns_.find(column);
    if (found == columns_.end() || found->second >= cells_.size()) return {};
    return cells_[found->second];
  }

  // All numbers of some columns, or nothing if all are empty.
  template <size_t N>
  std::optional<std::array<double, N>> numbers(const std::array<const char*, N>& names) const {
    std::array<double, N> out{};
    size_t stated = 0;
    std::string list;
    for (size_t i = 0; i < N; ++i) {
      list += std::string(i == 0 ? "" : i + 1 == N ? " and " : ", ") + names.at(i);
      const std::string_view text = cell(names.at(i));
      if (text.empty()) continue;
      out.at(i) = lines_.number(text);
      ++stated;
      if (std::abs(out.at(i)) > kFarthest) {
        lines_.fail(Defect::Value, quoted(text) + " is beyond 1e12");
      }
    }
    if (stated == 0) return std::nullopt;
    if (stated < N) lines_.fail(Defect::Schema, "states only some of " + list);
    return out;
  }

  void read_row(std::string_view line) {
    cells_ = fields(line, separator_);
    for (std::string_view& field : cells_) field = unquoted(field);
    const auto is_empty = [](std::string_view field) { return field.empty(); };
    if (std::all_of(cells_.begin(), cells_.end(), is_empty)) return;  // as spreadsheets end
    if (cells_.size() > columns_.size()) {
      lines_.fail(Defect::Schema,
                  "has " + std::to_string(cells_.size()) + " fields, the first line " +
                      std::to_string(columns_.size()) + " (decimals take a point)");
    }
    Entry& entry = entry_of(cell("name"));
    const bool has_position = read_position(entry);
    const bool has_pick = read_pick(entry);
    read_sigma(entry);
    read_role(entry);
    if (!has_position && !has_pick) {
      lines_.fail(Defect::Schema, "states neither x, y and z nor view, px and py");
    }
  }

  Entry& entry_of(std::string_view name) {
    if (name.empty()) lines_.fail(Defect::Schema, "has no name");
    if (name.size() > ReadLimits().max_name_bytes) lines_.fail(Defect::Value, "name is too long");
    const auto [found, is_new] = places_.emplace(std::string(name), entries_.size());
    if (is_new) {
      if (entries_.size() == kMostPoints) {
        lines_.fail(Defect::Count, "above " + std::to_string(kMostPoints) + " points");
      }
      entries_.emplace_back();
      entries_.back().point.name = std::string(name);
      entries_.back().first_line = lines_.line_number();
    }
    return entries_[found->second];
  }

  // Notes the line that states something first; others must say the same.
  void agree(bool is_same, const Entry& entry, const std::string& what, size_t& stated_in) const {
    if (stated_in == 0) stated_in = lines_.line_number();
    if (is_same) return;
    lines_.fail(Defect::Mismatch,
                quoted(entry.point.name) + " has another " + what + " than in line " +
                    std::to_string(stated_in));
  }

  bool read_position(Entry& entry) const {
    const auto xyz = numbers<3>({"x", "y", "z"});
    if (!xyz) return false;
    const Eigen::Vector3d position((*xyz)[0], (*xyz)[1], (*xyz)[2]);
    if (entry.position_line == 0) entry.point.position = position;
    agree(entry.point.position == position, entry, "position", entry.position_line);
    return true;
  }

  void read_sigma(Entry& entry) const {
    const std::string_view text = cell("sigma");
    if (text.empty()) return;
    const double sigma = lines_.number(text);
    if (!(sigma >= 0 && sigma <= kFarthest)) {
      lines_.fail(Defect::Value, "sigma " + quoted(text) + " is not within 0 ... 1e12");
    }
    if (entry.sigma_line == 0) entry.point.sigma = sigma;
    agree(entry.point.sigma == sigma, entry, "sigma", entry.sigma_line);
  }

  void read_role(Entry& entry) const {
    const std::string role = lower(cell("role"));
    if (role.empty()) return;
    if (role != "control" && role != "check") {
      lines_.fail(Defect::Value, "role " + quoted(role) + " is neither control nor check");
    }
    const bool is_check = role == "check";
    if (entry.role_line == 0) entry.point.is_check = is_check;
    agree(entry.point.is_check == is_check, entry, "role", entry.role_line);
  }

  bool read_pick(Entry& entry) const {
    const auto at = numbers<2>({"px", "py"});
    const std::string_view view = cell("view");
    if (view.empty() && !at) return false;
    if (view.empty() || !at) lines_.fail(Defect::Schema, "states only some of view, px and py");
    if (entry.point.picks.size() == kMostPicks) {
      lines_.fail(Defect::Count,
                  quoted(entry.point.name) + " has above " + std::to_string(kMostPicks) + " picks");
    }
    for (const ControlPick& other : entry.point.picks) {
      if (other.view != view) continue;
      lines_.fail(Defect::Mismatch,
                  quoted(entry.point.name) + " was picked in view " + quoted(view) +
                      " before, in line " + std::to_string(other.line));
    }
    entry.point.picks.push_back({std::string(view), (*at)[0], (*at)[1], lines_.line_number()});
    return true;
  }

  TextLines lines_;
  char separator_ = ',';
  std::map<std::string, size_t> columns_;
  std::vector<std::string_view> cells_;  // of the row
  std::map<std::string, size_t, std::less<>> places_;
  std::vector<Entry> entries_;
};

}  // namespace

std::vector<ControlPoint> read_control_points(const std::filesystem::path& path) {
  ReadLimits limits;
  limits.max_file_bytes = uint64_t{16} << 20;
  const std::string text = read_file(path, limits);
  refuse_foreign_content(path, text, "a table of control points");
  std::vector<ControlPoint> out = Table(text, path).points();
  if (out.empty()) throw BadInput(Defect::Empty, path, "has no row after the names of the columns");
  return out;
}

}  // namespace cgs
