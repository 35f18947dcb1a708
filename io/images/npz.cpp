// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/npz.h"

#include <string>
#include <vector>

#include "io/bytes/zip.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr std::string_view kEnding = ".npy";
constexpr size_t kStart = 4096;  // NumPy's own headers of plain arrays have 128 bytes

std::vector<std::string> array_files(const ZipArchive& archive) {
  std::vector<std::string> out;
  for (const std::string& name : archive.names()) {
    if (name.ends_with(kEnding)) out.push_back(name);
  }
  return out;
}

std::string array_name(const std::string& file) {
  return file.substr(0, file.size() - kEnding.size());
}

// "conf (480 x 640), K (3 x 3), names (of a type that is not read)"
std::string listed(const ZipArchive& archive, const std::vector<std::string>& files) {
  constexpr size_t kShown = 8;
  std::string out;
  for (size_t i = 0; i < std::min(files.size(), kShown); ++i) {
    const auto array = npy_outline(archive.read_start(files[i], kStart));
    std::string sides;
    for (const size_t n : array.value_or(NpyArray{}).shape) {
      sides += (sides.empty() ? "" : " x ") + std::to_string(n);
    }
    if (sides.empty()) sides = array ? "one number" : "of a type that is not read";
    out += (i > 0 ? ", " : "") + one_line(array_name(files[i]).substr(0, 60)) + " (" + sides + ")";
  }
  return files.size() > kShown ? out + ", …" : out;
}

// The file in the archive that holds the depth.
std::string depth_file(const ZipArchive& archive, const std::filesystem::path& path) {
  const std::vector<std::string> files = array_files(archive);
  if (files.empty()) throw BadInput(Defect::Empty, path, "holds no array");
  if (files.size() == 1) return files[0];
  if (archive.has("depth.npy")) return "depth.npy";
  constexpr size_t kMostArrays = 64;  // that are looked into
  if (files.size() > kMostArrays) {
    throw LimitError(printable(path) + ": holds " + std::to_string(files.size()) +
                     " arrays, none named depth; of so many at most " +
                     std::to_string(kMostArrays) + " are looked into");
  }
  std::vector<std::string> pictures;
  for (const std::string& file : files) {
    const auto array = npy_outline(archive.read_start(file, kStart));
    if (array && picture_sides(array->shape)) pictures.push_back(file);
  }
  if (pictures.size() == 1) return pictures[0];
  throw BadInput(
      Defect::Schema,
      path,
      "expected an array named depth, or only one of height x width numbers; its arrays are " +
          listed(archive, files));
}

}  // namespace

NpyArray read_npz_depth(const std::filesystem::path& path, const ReadLimits& limits) {
  const std::string bytes = read_file(path, limits);
  if (!bytes.starts_with("PK")) {
    refuse_foreign_content(path, bytes, "npz");
    throw BadInput(Defect::Magic, path, "expected a .npz file, a ZIP archive of arrays");
  }
  const ZipArchive archive(bytes, path);
  const std::string file = depth_file(archive, path);
  const auto outline = npy_outline(archive.read_start(file, kStart));
  double pixels = 1;
  for (const size_t side : outline.value_or(NpyArray{}).shape) pixels *= double(side);
  if (pixels > double(limits.max_pixels)) {
    throw LimitError(printable(path / file) + ": more than " + std::to_string(limits.max_pixels) +
                     " values");
  }
  const uint64_t most = limits.max_pixels * sizeof(double) + limits.max_header_bytes;
  return parse_npy(archive.read(file, most), path / file, limits);
}

}  // namespace cgs
