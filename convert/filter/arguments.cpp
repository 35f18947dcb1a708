// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/filter/arguments.h"

#include <cmath>
#include <sstream>
#include <utility>

#include "convert/text/length.h"
#include "io/bytes/byte_reader.h"
#include "libcgs/core/error.h"

namespace cgs {

FilterArguments::FilterArguments(std::string operation, std::string usage, const Frame& frame)
    : operation_(std::move(operation)), usage_(std::move(usage)), frame_(frame) {
  const size_t equals = operation_.find('=');
  if (equals == std::string::npos) return;
  size_t begin = equals + 1;
  while (true) {
    const size_t comma = operation_.find(',', begin);
    parts_.push_back(operation_.substr(begin, comma - begin));
    if (comma == std::string::npos) break;
    begin = comma + 1;
  }
}

void FilterArguments::fail(const std::string& what) const {
  throw InvalidInput("--op " + operation_ + ": " + what + "; write " + usage_);
}

std::string FilterArguments::word() {
  if (!more()) fail("something is missing");
  return parts_[next_++];
}

double FilterArguments::finite_number(const std::string& text) const {
  double value = 0;
  if (!parse_number(text, value) || !std::isfinite(value)) fail("'" + text + "' is not a number");
  return value;
}

double FilterArguments::number(double least, double most) {
  const std::string text = word();
  const double value = finite_number(text);
  if (value >= least && value <= most) return value;
  std::ostringstream range;
  range << "'" << text << "' is not in " << least << " ... " << most;
  fail(range.str());
}

size_t FilterArguments::count(size_t least, size_t most) {
  const std::string text = word();
  uint64_t value = 0;
  if (!parse_number(text, value) || value < least || value > most) {
    fail("'" + text + "' is not a whole number in " + std::to_string(least) + " ... " +
         std::to_string(most));
  }
  return value;
}

double FilterArguments::coordinate() {
  const std::string text = word();
  try {
    return parse_coordinate(text, frame_);
  } catch (const InvalidInput& error) {
    fail(error.what());
  }
}

double FilterArguments::length() {
  try {
    return parse_length(word(), frame_) * frame_.scale;
  } catch (const InvalidInput& error) {
    fail(error.what());
  }
}

Eigen::Vector3d FilterArguments::point() {
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  for (double& c : out) c = coordinate();
  return out;
}

Eigen::Vector3d FilterArguments::direction() {
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  for (double& c : out) c = finite_number(word());
  const double length = out.stableNorm();
  if (!(length > 0) || !std::isfinite(length)) fail("a direction must not be zero");
  return out / length;
}

std::filesystem::path FilterArguments::file() {
  std::string name = word();
  while (more()) name += ',' + word();
  if (name.empty()) fail("the name of a file is missing");
  return files_.emplace_back(name);
}

void FilterArguments::finish() const {
  if (more()) fail("'" + parts_[next_] + "' is too much");
}

}  // namespace cgs
