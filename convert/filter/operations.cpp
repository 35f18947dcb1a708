// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/filter/operations.h"

#include "libcgs/core/error.h"

namespace cgs {

std::string FilterOperation::syntax() const {
  std::string out(name);
  if (!arguments.empty() && arguments[0] != '[') out += '=';
  return out.append(arguments);
}

void require_faces(const FilterState& state, const char* operation) {
  if (!state.is_cloud()) return;
  throw InvalidInput(std::string("--op ") + operation + " needs faces, this is a point cloud");
}

void require_cloud(const FilterState& state, const char* operation) {
  if (state.is_cloud()) return;
  throw InvalidInput(std::string("--op ") + operation + " needs a point cloud, this mesh has " +
                     std::to_string(state.mesh.faces.size()) + " faces");
}

const std::vector<FilterOperation>& filter_operations() {
  static const std::vector<FilterOperation> kAll = [] {
    std::vector<FilterOperation> all;
    for (const auto& list : {placement_operations(),
                             selection_operations(),
                             point_operations(),
                             reconstruction_operations(),
                             surface_operations(),
                             repair_operations(),
                             solid_operations()}) {
      all.insert(all.end(), list.begin(), list.end());
    }
    return all;
  }();
  return kAll;
}

}  // namespace cgs
