// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/view_names.h"

#include <algorithm>
#include <map>
#include <set>

#include "io/bytes/byte_reader.h"
#include "io/bytes/scene_path.h"
#include "libcgs/core/error.h"
#include "libcgs/core/remedy.h"
#include "libcgs/core/utf8.h"

namespace cgs {

namespace {

namespace fs = std::filesystem;

std::string without_extension(const std::string& name) {
  const fs::path path(name);
  return has_image_extension(path) ? fs::path(path).replace_extension().string() : name;
}

// A name that can be printed, stand in JSON and begin the names of output files.
std::string clean_name(std::string_view name) {
  constexpr size_t kLongest = 200;  // bytes; file systems allow 255 with what is appended
  name = name.substr(0, kLongest);
  std::string out;
  while (!name.empty()) {
    const size_t length = shown_sequence(name);
    out += length > 0 ? name.substr(0, length) : "_";
    name.remove_prefix(std::max(length, size_t{1}));
  }
  return out;
}

// Whether a path is `end`, or goes on to it from some folder.
bool ends_with_path(const fs::path& path, const fs::path& end) {
  if (path.empty() || end.empty()) return false;
  auto p = path.end();
  for (auto e = end.end(); e != end.begin();) {
    if (p == path.begin() || *--p != *--e) return false;
  }
  return true;
}

}  // namespace

void name_views(Scene& scene) {
  std::map<std::string, int> uses;
  for (const View& view : scene.views) ++uses[fs::path(without_extension(view.name)).filename()];
  std::set<std::string> taken;
  for (View& view : scene.views) {
    const std::string whole = without_extension(view.name);
    std::string name = fs::path(whole).filename().string();
    if (uses[name] > 1) {
      name = fs::path(whole).lexically_normal().string();
      std::replace(name.begin(), name.end(), '/', '_');
    }
    // Files that differ in nothing but their extension.
    if (taken.contains(name)) name = fs::path(view.name).filename().string();
    name = clean_name(name);
    std::string unique = name;
    for (int i = 2; !taken.insert(unique).second; ++i) unique = name + "_" + std::to_string(i);
    view.name = unique;
  }
}

std::string first_few(const std::vector<std::string>& names) {
  constexpr size_t kShown = 5;
  std::string out;
  for (size_t i = 0; i < std::min(names.size(), kShown); ++i) {
    out += (i > 0 ? ", " : "") + printable(names[i]);
  }
  return names.size() > kShown ? out + ", …" : out;
}

std::vector<int> views_called(const Scene& scene, const std::string& word) {
  std::vector<int> out;
  for (size_t i = 0; i < scene.views.size(); ++i) {
    if (scene.views[i].name == word) return {static_cast<int>(i)};
    if (ends_with_path(scene.views[i].image_path, word)) out.push_back(static_cast<int>(i));
  }
  uint64_t index = 0;
  if (!out.empty() || !parse_number(word, index)) return out;
  if (scene.photographs.empty()) {
    if (index < scene.views.size()) out.push_back(static_cast<int>(index));
    return out;
  }
  for (size_t i = 0; i < scene.views.size() && index < scene.photographs.size(); ++i) {
    if (scene.views[i].image_path.filename() == scene.photographs[index]) {
      out.push_back(static_cast<int>(i));
    }
  }
  return out;
}

int index_of(const Scene& scene, int view) {
  const auto& all = scene.photographs;
  const std::string file = scene.views.at(static_cast<size_t>(view)).image_path.filename().string();
  const auto found = std::find(all.begin(), all.end(), file);
  return found == all.end() ? view : static_cast<int>(found - all.begin());
}

namespace {

// The one view that a word means, or why there is none such.
struct FoundView {
  int index = -1;
  std::string refusal;
};

FoundView found_view(const Scene& scene, const std::string& word) {
  const std::vector<int> found = views_called(scene, word);
  if (found.size() == 1) return {found.front(), ""};
  std::vector<std::string> names;
  if (found.empty()) {
    for (const View& view : scene.views) names.push_back(view.name);
    return {-1,
            "there is no view \"" + printable(word) + "\" among " + std::to_string(names.size()) +
                ": " + first_few(names)};
  }
  for (const int i : found) names.push_back(scene.views[static_cast<size_t>(i)].name);
  return {-1,
          "\"" + printable(word) + "\" is the file of " + std::to_string(names.size()) +
              " views: " + first_few(names)};
}

}  // namespace

int find_view(const Scene& scene, const std::string& word, const std::string& option) {
  const FoundView found = found_view(scene, word);
  if (!found.refusal.empty()) throw InvalidInput(option + ": " + found.refusal);
  return found.index;
}

std::vector<int> select_views(const Scene& scene, const std::string& list) {
  std::vector<int> out;
  size_t at = 0;
  while (at <= list.size()) {
    const size_t end = std::min(list.find(',', at), list.size());
    std::string token = list.substr(at, end - at);
    token.erase(0, token.find_first_not_of(' '));
    token.erase(token.find_last_not_of(' ') + 1);
    const auto [view, refusal] = found_view(scene, token);
    if (!refusal.empty()) throw WithRemedy<InvalidInput>(Remedy::ChosenViews, refusal);
    if (std::find(out.begin(), out.end(), view) != out.end()) {
      const std::string& name = scene.views[static_cast<size_t>(view)].name;
      throw WithRemedy<InvalidInput>(Remedy::ChosenViews,
                                     "view \"" + printable(name) + "\" is named twice");
    }
    out.push_back(view);
    at = end + 1;
  }
  std::sort(out.begin(), out.end());
  return out;
}

bool is_listable(const std::string& name) { return name.find(',') == std::string::npos; }

void require_listable(const std::string& name, const std::string& option) {
  if (is_listable(name)) return;
  throw InvalidInput("photograph " + printable(name) +
                     " has a comma in its name, which ends a name in " + option + "; rename it");
}

std::string view_list(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += (out.empty() ? "" : ",") + name;
  return out;
}

std::vector<std::string> view_names(const Scene& scene, const std::vector<int>& views) {
  std::vector<std::string> out;
  for (const int i : views) out.push_back(scene.views[static_cast<size_t>(i)].name);
  return out;
}

}  // namespace cgs
