// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/frame.h"

namespace cgs {

/// The arguments of one operation, "0,0,0,10cm", read from left to right. Every complaint is an
/// InvalidInput that names the operation, the argument and how to write it.
class FilterArguments {
 public:
  /// \param operation  as typed, "crop-box=0,0,0,1,1,1"
  /// \param usage      how to write it, with an example
  /// \param frame      of the input: its unit
  FilterArguments(std::string operation, std::string usage, const Frame& frame);

  bool more() const { return next_ < parts_.size(); }
  /// > 0, with or without unit [world units].
  double length();
  /// Of any sign, with or without unit [world units].
  double coordinate();
  /// Three coordinates [world units].
  Eigen::Vector3d point();
  /// Three numbers, not all zero.
  Eigen::Vector3d direction();
  double number(double least, double most);
  size_t count(size_t least, size_t most);
  std::string word();
  /// All that is left, commas included, as the name of a file to read.
  std::filesystem::path file();
  /// Complains about arguments that nobody took.
  void finish() const;
  [[noreturn]] void fail(const std::string& what) const;

  /// The files named so far.
  const std::vector<std::filesystem::path>& files() const { return files_; }

 private:
  double finite_number(const std::string& text) const;

  std::string operation_;
  std::string usage_;
  const Frame& frame_;
  std::vector<std::string> parts_;
  size_t next_ = 0;
  std::vector<std::filesystem::path> files_;
};

}  // namespace cgs
