// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "io/bytes/scene_path.h"

namespace cgs {

/// True of folders, by their names, whose pictures are no photographs (masks, depth, results) or
/// smaller copies of them.
bool holds_no_photographs(const std::string& folder_name);

/// The photographs of a scene by the names that other programs give them: those in some folders and
/// below these, but for folders of masks, of depth, of smaller copies and of results.
class PhotographIndex {
 public:
  /// \param folders  of the scene, from the one that counts first; those that are not there are
  ///                 passed over
  /// \throws BadInput, LimitError as image_files()
  explicit PhotographIndex(SceneRoot root, std::vector<std::string> folders = {"images", "."});

  /// The file of a name that may have folders in front, of Windows too, and may lack its ending;
  /// empty if there is none. Of several files of that name the one counts that lies in most of the
  /// folders that are named, else the one directly in a folder of the scene. Names may differ in
  /// letter case, in Unicode normal form, or in their ending, as a JPEG made of a TIFF.
  /// \throws BadInput Ref if another name took that file (one of the two cameras would see what it
  ///         never photographed), or if two files are meant equally well, naming both
  std::filesystem::path take(std::string_view name);

  /// The file of a path below one of the folders, all of which must agree, but for letter case,
  /// Unicode normal form and its ending; empty if there is none.
  /// \throws BadInput Ref as take()
  std::filesystem::path take_path(std::string_view path);

  /// What was found under a name that is not its own, for the notes of a scene; empty if nothing
  /// was.
  std::vector<std::string> notes() const;

 private:
  struct File {
    std::filesystem::path path;
    std::vector<std::string> parts;  // of its path in the scene, folded
    size_t below = 0;                // how many of these are below the folder it was found by
    size_t rank = 0;                 // of that folder
  };
  using Places = std::map<std::string, std::vector<size_t>>;

  void add_folder(const std::string& folder, const std::string& base, size_t rank, int depth);
  void add_file(const std::filesystem::path& file,
                const std::string& folder,
                const std::string& base,
                size_t rank);
  size_t chosen(const std::vector<size_t>& files,
                const std::vector<std::string>& parts,
                std::string_view name) const;
  void claim(const std::filesystem::path& file, std::string_view name, bool may_repeat);

  SceneRoot root_;
  std::vector<File> files_;
  std::map<std::filesystem::path, size_t> known_;
  Places names_;         // by file name
  Places stems_;         // by file name without its ending
  Places folded_names_;  // the same, folded
  Places folded_stems_;
  Places paths_;                                        // by folded path below its folder
  Places path_stems_;                                   // the same without its ending
  std::map<std::filesystem::path, std::string> taken_;  // by which name
  size_t renamed_ = 0;
  std::string renamed_example_;
  size_t deeper_ = 0;
  std::string deeper_example_;
};

/// The name of a photograph as COLMAP would give it: its path below images/ or, elsewhere, below
/// the folder of the scene.
std::string name_below(const std::filesystem::path& scene, const std::filesystem::path& photograph);

}  // namespace cgs
