// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/scene_path.h"

#include <algorithm>
#include <array>
#include <new>
#include <system_error>

#include <unicode/normalizer2.h>
#include <unicode/unistr.h>

#include "io/bytes/byte_reader.h"
#include "libcgs/core/remedy.h"

namespace cgs {

namespace {

namespace fs = std::filesystem;

// But of what macOS hides ("._a.jpg").
bool is_image_name(const fs::path& name) {
  return has_image_extension(name) && !name.native().starts_with('.');
}

bool is_beneath(const fs::path& path, const fs::path& folder) {
  const auto [end, rest] = std::mismatch(folder.begin(), folder.end(), path.begin(), path.end());
  (void)rest;
  return end == folder.end();
}

// "http://…", "file:///…", "data:…": a scheme is letters, then a colon (RFC 3986).
bool looks_like_url(std::string_view name) {
  const size_t colon = name.find(':');
  if (colon == std::string_view::npos || colon < 2) return false;
  const std::string_view scheme = name.substr(0, colon);
  return std::all_of(scheme.begin(),
                     scheme.end(),
                     [](unsigned char c) {
                       return std::isalnum(c) != 0 || c == '+' || c == '-' || c == '.';
                     }) &&
         (name.substr(colon).starts_with("://") || scheme == "file" || scheme == "data");
}

}  // namespace

std::string folder_name(const fs::path& path) {
  std::error_code error;
  const fs::path whole = fs::absolute(path, error).lexically_normal();
  return (whole.has_filename() ? whole : whole.parent_path()).filename().string();
}

fs::path resolve_in_scene(const SceneRoot& root, std::string_view name, const fs::path& named_in) {
  const auto refuse = [&](const std::string& reason) {
    throw BadInput(Defect::Path, named_in, "\"" + printable(fs::path(name)) + "\" " + reason);
  };
  const auto refuse_external = [&](const std::string& reason) {
    throw WithRemedy<BadInput>(Remedy::ExternalFiles,
                               Defect::Path,
                               named_in,
                               "\"" + printable(fs::path(name)) + "\" " + reason +
                                   "; external files can be allowed if you trust the data set");
  };
  if (name.empty()) refuse("is an empty path");
  if (name.find('\0') != std::string_view::npos) refuse("contains a NUL byte");
  if (looks_like_url(name)) refuse("is a URL; only local files are read");
  const fs::path path(name);
  fs::path joined = root.folder / path;  // an absolute path replaces the folder
  if (root.allow_external) return joined;
  if (path.is_absolute()) refuse_external("is an absolute path");
  const fs::path normal = path.lexically_normal();
  if (!normal.empty() && *normal.begin() == "..")
    refuse_external("escapes the folder of the scene");
  std::error_code error;
  const fs::path folder = fs::weakly_canonical(root.folder, error);
  const fs::path target = error ? fs::path() : fs::weakly_canonical(joined, error);
  if (error == std::errc::not_enough_memory) throw std::bad_alloc();
  if (error) refuse("cannot be followed: " + error.message());
  if (!is_beneath(target, folder)) {
    refuse_external("escapes the folder of the scene through a symbolic link");
  }
  return joined;
}

std::optional<fs::path> path_in_scene(const SceneRoot& root, const fs::path& path) {
  const auto below = [](const fs::path& whole, const fs::path& folder) -> std::optional<fs::path> {
    const fs::path out = whole.lexically_relative(folder);
    if (out.empty() || *out.begin() == "..") return std::nullopt;
    return out == "." ? fs::path() : out;
  };
  std::error_code ignored;  // what cannot be followed stays as it is, and is not below
  const fs::path whole = fs::absolute(path, ignored).lexically_normal();
  const fs::path top = fs::absolute(root.folder / "", ignored).lexically_normal().parent_path();
  if (auto out = below(whole, top)) return out;
  const fs::path canonical = fs::weakly_canonical(whole, ignored);
  if (auto out = below(canonical, fs::weakly_canonical(top, ignored))) return out;
  return root.allow_external ? std::optional(whole) : std::nullopt;
}

std::vector<fs::path> companion_folders(const SceneRoot& root,
                                        const fs::path& photographs,
                                        const std::string& name) {
  const std::optional<fs::path> folder = path_in_scene(root, photographs);
  if (!folder) return {};
  std::vector<fs::path> out;
  const auto add = [&](const fs::path& candidate) {
    if (is_folder(root.folder / candidate)) out.push_back(candidate);
  };
  add(*folder / name);
  fs::path within;  // the folder above which they lie, in which the photographs do
  for (fs::path above = *folder; above.has_relative_path();) {
    add(above.parent_path() / name / within);
    within = within.empty() ? above.filename() : above.filename() / within;
    above = above.parent_path();
  }
  return out;
}

std::string with_slashes(std::string name) {
  std::replace(name.begin(), name.end(), '\\', '/');
  return name;
}

bool stays_below(const fs::path& path) {
  return path.is_relative() && std::find(path.begin(), path.end(), "..") == path.end();
}

bool is_present(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(fs::symlink_status(path, ignored));
}

bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

std::string lower_extension(const fs::path& path) {
  std::string out = path.extension().string();
  std::transform(out.begin(), out.end(), out.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return out;
}

std::string folded_name(std::string_view name) {
  const auto is_plain = [](char c) { return static_cast<unsigned char>(c) < 0x80; };
  if (std::all_of(name.begin(), name.end(), is_plain)) {
    std::string out(name);
    for (char& c : out) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return out;
  }
  constexpr char16_t kReplacement = 0xFFFD;  // of what is no UTF-8
  UErrorCode error = U_ZERO_ERROR;
  const icu::Normalizer2* const composed = icu::Normalizer2::getNFCInstance(error);
  icu::UnicodeString text = icu::UnicodeString::fromUTF8(
      icu::StringPiece(name.data(), static_cast<int32_t>(name.size())));
  if (U_FAILURE(error) || text.indexOf(kReplacement) >= 0) return std::string(name);
  text = composed->normalize(composed->normalize(text, error).foldCase(), error);
  std::string out;
  text.toUTF8String(out);
  return U_FAILURE(error) ? std::string(name) : out;
}

bool has_gltf_extension(const fs::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".glb" || extension == ".gltf";
}

bool has_image_extension(const fs::path& path) {
  static constexpr std::array<std::string_view, 11> kKnown = {".png",
                                                              ".jpg",
                                                              ".jpeg",
                                                              ".jpe",
                                                              ".jfif",
                                                              ".tif",
                                                              ".tiff",
                                                              ".webp",
                                                              ".heic",
                                                              ".heif",
                                                              ".avif"};
  return std::find(kKnown.begin(), kKnown.end(), lower_extension(path)) != kKnown.end();
}

std::vector<std::string> sorted_entries(const fs::path& folder) {
  std::vector<std::string> out;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    out.push_back(entry->path().filename().string());
  }
  std::sort(out.begin(), out.end());
  return out;
}

bool holds_images(const fs::path& folder) {
  const std::vector<std::string> names = sorted_entries(folder);
  return std::any_of(names.begin(), names.end(), is_image_name);
}

std::vector<fs::path> image_files(const SceneRoot& root, const std::string& subfolder) {
  const fs::path folder = resolve_in_scene(root, subfolder, root.folder);
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (!is_image_name(entry->path().filename())) continue;
    const fs::path name = fs::path(subfolder) / entry->path().filename();
    files.push_back(resolve_in_scene(root, name.string(), folder));
    if (files.size() > ReadLimits{}.max_views) {
      throw LimitError(printable(folder) + ": more than " + std::to_string(ReadLimits{}.max_views) +
                       " images");
    }
  }
  if (error) throw BadInput(Defect::Open, folder, error.message());
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return a.filename().native() < b.filename().native();
  });
  return files;
}

}  // namespace cgs
