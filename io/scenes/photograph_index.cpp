// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/photograph_index.h"

#include <algorithm>
#include <array>
#include <tuple>

#include "io/bytes/byte_reader.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace fs = std::filesystem;

namespace {

std::string without_ending(const std::string& name) {
  const fs::path path(name);
  return has_image_extension(path) ? fs::path(path).replace_extension().string() : name;
}

// The folders and the name that a path consists of, folded but for the last.
std::vector<std::string> parts_of(std::string_view name) {
  const std::string text = with_slashes(std::string(name));
  std::vector<std::string> out;
  size_t at = 0;
  while (at <= text.size()) {
    const size_t end = std::min(text.find('/', at), text.size());
    const std::string part = text.substr(at, end - at);
    if (!part.empty() && part != ".") out.push_back(part);
    at = end + 1;
  }
  for (size_t i = 0; i + 1 < out.size(); ++i) out[i] = folded_name(out[i]);
  return out;
}

// How many folders above their names agree.
size_t common_folders(const std::vector<std::string>& a, const std::vector<std::string>& b) {
  size_t count = 0;
  const size_t most = std::min(a.size(), b.size());
  while (count + 1 < most && a[a.size() - 2 - count] == b[b.size() - 2 - count]) ++count;
  return count;
}

}  // namespace

bool holds_no_photographs(const std::string& name) {
  static constexpr std::array<std::string_view, 17> kOthers = {"mask",
                                                               "masks",
                                                               "depth",
                                                               "depths",
                                                               "depth_maps",
                                                               "confidence",
                                                               "sparse",
                                                               "normal",
                                                               "normals",
                                                               "stereo",
                                                               "views",
                                                               "model",
                                                               "web",
                                                               "thumbnails",
                                                               "cameras",
                                                               "mesh",
                                                               "render"};
  constexpr std::string_view kCopies = "images_";  // images_4, of LLFF and nerfstudio
  const std::string folded = folded_name(name);
  return name.starts_with('.') || folded.starts_with(kCopies) ||
         std::find(kOthers.begin(), kOthers.end(), folded) != kOthers.end();
}

PhotographIndex::PhotographIndex(SceneRoot root, std::vector<std::string> folders)
    : root_(std::move(root)) {
  for (size_t rank = 0; rank < folders.size(); ++rank) {
    if (is_folder(root_.folder / folders[rank])) add_folder(folders[rank], folders[rank], rank, 0);
  }
}

void PhotographIndex::add_folder(const std::string& folder,
                                 const std::string& base,
                                 size_t rank,
                                 int depth) {
  constexpr int kDeepest = 6;
  const size_t most = ReadLimits{}.max_views;
  if (depth > 0 && files_.size() > most) return;
  std::vector<fs::path> found;
  try {
    found = image_files(root_, folder);
  } catch (const Error&) {
    if (depth == 0) throw;
    return;  // a folder that nothing names may be a link to anywhere, or hold all a disk does
  }
  for (const fs::path& file : found) add_file(file, folder, base, rank);
  if (depth == kDeepest) return;
  for (const std::string& entry : sorted_entries(root_.folder / folder)) {
    const fs::path path = root_.folder / folder / entry;
    if (!is_folder(path) || holds_no_photographs(entry) || is_present(path / "run.json")) continue;
    add_folder((fs::path(folder) / entry).lexically_normal().string(), base, rank, depth + 1);
  }
}

void PhotographIndex::add_file(const fs::path& file,
                               const std::string& folder,
                               const std::string& base,
                               size_t rank) {
  const fs::path relative = (fs::path(folder) / file.filename()).lexically_normal();
  const size_t index = files_.size();
  if (!known_.emplace(relative, index).second) return;
  const fs::path below = relative.lexically_relative(fs::path(base).lexically_normal());
  File out{file, {}, 0, rank};
  for (const fs::path& part : relative) out.parts.push_back(folded_name(part.string()));
  out.below = static_cast<size_t>(std::distance(below.begin(), below.end()));
  files_.push_back(std::move(out));
  const std::string name = file.filename().string();
  const std::string path = folded_name(below.generic_string());
  names_[name].push_back(index);
  stems_[without_ending(name)].push_back(index);
  folded_names_[folded_name(name)].push_back(index);
  folded_stems_[folded_name(without_ending(name))].push_back(index);
  paths_[path].push_back(index);
  path_stems_[folded_name(without_ending(below.generic_string()))].push_back(index);
}

fs::path PhotographIndex::take(std::string_view name) {
  const std::vector<std::string> parts = parts_of(name);
  if (parts.empty()) return {};
  const std::string& last = parts.back();
  const std::string stem = without_ending(last);
  // "IMG.0012" is a stem; "IMG_0012.tif" may stand for a JPEG made of it.
  const std::array<std::pair<const Places*, std::string>, 6> ways = {{
      {&names_, last},
      {&folded_names_, folded_name(last)},
      {&stems_, last},
      {&folded_stems_, folded_name(last)},
      {&stems_, stem},
      {&folded_stems_, folded_name(stem)},
  }};
  for (const auto& [places, key] : ways) {
    const auto found = places->find(key);
    if (found == places->end()) continue;
    const File& file = files_[chosen(found->second, parts, name)];
    claim(file.path, name, false);
    if (common_folders(parts, file.parts) + 1 < file.below && deeper_++ == 0) {
      deeper_example_ = printable(file.path.lexically_relative(root_.folder));
    }
    return file.path;
  }
  return {};
}

fs::path PhotographIndex::take_path(std::string_view path) {
  const std::string name = fs::path(with_slashes(std::string(path))).lexically_normal().string();
  for (const auto& [places, key] : {std::pair(&paths_, folded_name(name)),
                                    std::pair(&path_stems_, folded_name(without_ending(name)))}) {
    const auto found = places->find(key);
    if (found == places->end()) continue;
    const File& file = files_[chosen(found->second, parts_of(name), path)];
    claim(file.path, path, true);
    return file.path;
  }
  return {};
}

size_t PhotographIndex::chosen(const std::vector<size_t>& files,
                               const std::vector<std::string>& parts,
                               std::string_view name) const {
  const auto merit = [&](size_t i) {
    const File& file = files_[i];
    const size_t common = common_folders(parts, file.parts);
    return std::tuple(common, common + 1 >= file.below, -static_cast<int64_t>(file.rank));
  };
  const size_t best = *std::max_element(
      files.begin(), files.end(), [&](size_t a, size_t b) { return merit(a) < merit(b); });
  for (const size_t other : files) {
    if (other == best || merit(other) != merit(best)) continue;
    throw BadInput(Defect::Ref,
                   files_[best].path,
                   "\"" + printable(fs::path(name)) + "\" may mean this file or " +
                       printable(files_[other].path) + "; rename one of them");
  }
  return best;
}

void PhotographIndex::claim(const fs::path& file, std::string_view name, bool may_repeat) {
  const auto [owner, is_new] = taken_.emplace(file, name);
  if (!is_new && (!may_repeat || owner->second != name)) {
    throw BadInput(Defect::Ref,
                   file,
                   "is the photograph of two cameras, \"" + printable(fs::path(owner->second)) +
                       "\" and \"" + printable(fs::path(name)) +
                       "\"; give every photograph a name of its own");
  }
  const std::string last = fs::path(with_slashes(std::string(name))).filename().string();
  const std::string own = file.filename().string();
  // A label without an ending is how some programs name photographs, and tells nothing new.
  if (own != last && without_ending(own) != last && renamed_++ == 0) {
    renamed_example_ =
        "\"" + printable(fs::path(own)) + "\" for \"" + printable(fs::path(last)) + "\"";
  }
}

std::string name_below(const fs::path& scene, const fs::path& photograph) {
  const fs::path images = photograph.lexically_relative(scene / "images");
  const bool is_within = !images.empty() && *images.begin() != "..";
  return (is_within ? images : photograph.lexically_relative(scene)).lexically_normal().string();
}

std::vector<std::string> PhotographIndex::notes() const {
  const auto counted = [](size_t count) {
    return std::to_string(count) + (count == 1 ? " photograph was" : " photographs were");
  };
  std::vector<std::string> out;
  if (renamed_ > 0) {
    out.push_back(counted(renamed_) +
                  " found under a name of another ending, letter case or Unicode form, as " +
                  renamed_example_);
  }
  if (deeper_ > 0) {
    out.push_back(counted(deeper_) + " found in folders that no name tells, as " + deeper_example_);
  }
  return out;
}

}  // namespace cgs
