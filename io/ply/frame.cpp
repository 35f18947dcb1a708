// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/ply/frame.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "io/bytes/byte_reader.h"
#include "io/bytes/byte_writer.h"
#include "io/bytes/significance.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr std::string_view kEvidence = "evidence ";

/// The values after `key` in the comment that starts with it, if they are `count` finite numbers.
std::optional<Eigen::Vector3d> numbers_after(const std::vector<std::string>& comments,
                                             std::string_view key,
                                             int count) {
  for (const std::string& comment : comments) {
    std::istringstream words(comment);
    std::string word;
    if (!(words >> word) || word != key) continue;
    Eigen::Vector3d out = Eigen::Vector3d::Zero();
    bool good = true;
    for (int i = 0; i < count; ++i) {
      good = good && (words >> word) && parse_number(word, out[i]) && std::isfinite(out[i]);
    }
    if (good) return out;
  }
  return std::nullopt;
}

// "Vertical Axis: z" of nerfstudio, "Vertical axis: 0 -1 0" of Brush.
std::optional<Eigen::Vector3d> vertical_axis(const std::vector<std::string>& comments) {
  constexpr std::string_view kKey = "vertical axis:";
  for (std::string comment : comments) {
    std::transform(comment.begin(), comment.end(), comment.begin(), [](char c) {
      return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    });
    if (!comment.starts_with(kKey)) continue;
    const std::string value = comment.substr(kKey.size());
    const size_t letter = value.find_first_not_of(' ');
    const bool is_letter = letter != std::string::npos && letter + 1 == value.size() &&
                           value[letter] >= 'x' && value[letter] <= 'z';
    if (is_letter) return Eigen::Vector3d::Unit(value[letter] - 'x');
    return numbers_after({"up" + value}, "up", 3);
  }
  return std::nullopt;
}

std::vector<Eigen::Vector3d> moved(std::vector<Eigen::Vector3d> points, const Eigen::Vector3d& by) {
  for (Eigen::Vector3d& p : points) p += by;
  return points;
}

/// Whether double coordinates from the world's zero keep as much of the content as is asked of
/// float ones in a file.
bool is_told_apart_at(const Eigen::Vector3d& file_origin,
                      const std::vector<Eigen::Vector3d>& corners) {
  constexpr double kFewest = 10;  // binary digits
  const std::vector<Eigen::Vector3d> there = moved(corners, file_origin);
  Eigen::AlignedBox3d box(there[0]);
  for (const Eigen::Vector3d& p : there) box.extend(p);
  return corners[0] == corners[1] || significant_bits(box, kDoubleDigits) >= kFewest;
}

ScaleSource scale_source_in(const std::vector<std::string>& comments) {
  for (const ScaleSource source : {ScaleSource::Assumed,
                                   ScaleSource::CameraPoses,
                                   ScaleSource::KnownDistance,
                                   ScaleSource::ControlPoints,
                                   ScaleSource::DepthSensor}) {
    for (const std::string& comment : comments) {
      if (comment == "scale_source " + scale_source_name(source)) return source;
    }
  }
  return ScaleSource::Unknown;
}

}  // namespace

bool is_our_ply(const std::vector<std::string>& comments) {
  return std::find(comments.begin(), comments.end(), kPlyGenerator) != comments.end();
}

std::string ply_evidence_comment(const std::string& evidence) {
  if (evidence.empty()) return "";
  constexpr size_t kLongest = 1000;  // readers that go by lines often have room for 1024 bytes
  std::string words = one_line(evidence);
  if (words.size() > kLongest) {
    size_t end = kLongest;
    while (end > 0 && (words[end] & '\xc0') == '\x80') --end;  // not amid a character
    words = words.substr(0, end) + "...";  // some readers take headers for ASCII
  }
  return "comment " + std::string(kEvidence) + words + "\n";
}

std::string ply_evidence(const std::vector<std::string>& comments) {
  if (!is_our_ply(comments)) return "";
  for (const std::string& comment : comments) {
    if (comment.starts_with(kEvidence)) return comment.substr(kEvidence.size());
  }
  return "";
}

std::string ply_frame_comments(const Frame& frame) { return frame_comments(frame, "comment "); }

std::string frame_comments(const Frame& frame, const std::string& mark) {
  std::string out = mark + "unit " + frame.unit_name() + "\n" + mark + "metres_per_unit ";
  append_number(out, frame.metres_per_unit);
  out += "\n" + mark + "metres_sigma ";
  append_number(out, frame.metres_sigma);
  out += "\n" + mark + "scale_source " + scale_source_name(frame.scale_source);
  const auto append_vector = [&](const char* key, const Eigen::Vector3d& vector) {
    out += "\n" + mark + key;
    for (const double value : vector) {
      out += ' ';
      append_number(out, value);
    }
  };
  append_vector("file_origin", frame.file_origin);
  if (frame.knows_up()) append_vector("up", frame.up);
  return out + "\n";
}

PlyPlacement ply_placement(const std::vector<std::string>& comments,
                           const std::vector<Eigen::Vector3d>& bounds,
                           const std::optional<Frame>& wanted) {
  const auto origin = numbers_after(comments, "file_origin", 3);
  const auto metres = numbers_after(comments, "metres_per_unit", 1);
  const bool has_unit = metres && metres->x() > 0;
  if (wanted) {
    PlyPlacement out{*wanted, origin.value_or(wanted->file_origin), {}};
    if (has_unit && wanted->has_metric_scale() &&
        std::abs(metres->x() / wanted->metres_per_unit - 1) > 1e-9) {
      out.warnings.push_back("the file says its unit is " + std::to_string(metres->x()) +
                             " m, it is read as " + wanted->unit_name());
    }
    return out;
  }
  const bool is_bearable = !origin || is_told_apart_at(*origin, bounds);
  const Eigen::Vector3d file_origin =
      origin && is_bearable ? *origin : Eigen::Vector3d::Zero().eval();
  PlyPlacement out{canonical_frame(moved(bounds, file_origin)), file_origin, {}};
  if (!is_bearable) {
    out.warnings.emplace_back(
        "the file_origin that the file states is ignored: the content is too small for a place so "
        "far away");
  }
  out.frame.file_origin = file_origin_near(out.frame, file_origin);
  auto up = numbers_after(comments, "up", 3);
  if (!up) up = vertical_axis(comments);
  if (up && up->norm() > 0) out.frame.up = up->normalized();
  if (has_unit) {
    out.frame.metres_per_unit = metres->x();
    const auto sigma = numbers_after(comments, "metres_sigma", 1);
    out.frame.metres_sigma = sigma ? sigma->x() : 0;
    out.frame.scale_source = scale_source_in(comments);
  }
  return out;
}

}  // namespace cgs
