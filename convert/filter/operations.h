// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "convert/filter/arguments.h"
#include "convert/filter/state.h"

namespace cgs {

/// An operation that a chain may contain.
struct FilterOperation {
  std::string_view name;
  std::string_view arguments;  ///< "X,Y,Z,RADIUS", in upper case; optional ones in brackets.
  std::string_view help;       ///< One sentence without full stop.
  std::string_view example;    ///< As typed after --op.
  FilterStep (*prepare)(FilterArguments& arguments);  ///< Reads the arguments.

  /// "crop-ball=X,Y,Z,RADIUS"
  std::string syntax() const;
};

/// The operations by what they do; each list is in a file of its own.
std::vector<FilterOperation> placement_operations();
std::vector<FilterOperation> selection_operations();
std::vector<FilterOperation> point_operations();
std::vector<FilterOperation> reconstruction_operations();
std::vector<FilterOperation> surface_operations();
std::vector<FilterOperation> repair_operations();
std::vector<FilterOperation> solid_operations();

/// \throws InvalidInput that names the operation if the state is a point cloud
void require_faces(const FilterState& state, const char* operation);

/// \throws InvalidInput that names the operation if the state has faces
void require_cloud(const FilterState& state, const char* operation);

/// All of them, in the order in which the help lists them.
const std::vector<FilterOperation>& filter_operations();

}  // namespace cgs
