// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "io/bytes/scene_path.h"

namespace cgs {

/// The photographs of a scene by the names that other programs give them: those in images/ and in
/// the folder itself.
class PhotographIndex {
 public:
  /// \throws BadInput, LimitError as image_files()
  explicit PhotographIndex(const SceneRoot& root);

  /// The file of a name that may have a folder in front, of Windows too, and may lack its
  /// extension; empty if there is none.
  /// \throws BadInput Ref if another name took that file: one of the two cameras would see what it
  ///         never photographed
  std::filesystem::path take(std::string_view name);

 private:
  std::filesystem::path find(std::string_view name) const;

  std::map<std::string, std::filesystem::path> files_;  // by file name
  std::map<std::string, std::filesystem::path> stems_;  // the first of each
  std::map<std::filesystem::path, std::string> taken_;  // by which name
};

}  // namespace cgs
