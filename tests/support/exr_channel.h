// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/images/exr.h"
#include "libcgs/core/error.h"

namespace cgs::test {

/// The values of a channel.
/// \throws BadInput Schema if there is none of that name
inline const std::vector<float>& channel(const ExrImage& image,
                                         const std::string& name,
                                         const std::filesystem::path& path) {
  const std::vector<float>* values = image.find(name);
  if (values == nullptr) throw BadInput(Defect::Schema, path, "has no channel " + name);
  return *values;
}

}  // namespace cgs::test
