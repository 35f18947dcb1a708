// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/depth_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "io/colmap_depth.h"
#include "io/exr.h"
#include "io/npy.h"
#include "io/npz.h"
#include "io/pfm.h"

namespace cgs {

namespace fs = std::filesystem;

namespace {

// What keeps values as they are comes before what may be a picture to look at.
constexpr std::array<const char*, 7> kExtensions = {
    ".exr", ".pfm", ".npy", ".npz", ".tiff", ".tif", ".png"};

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

// False for what programs write where a ray meets nothing: 0, infinity, or the largest value there
// is in the file's type or in anybody's mind.
bool is_depth(float value, const std::string& extension, int whole_bits) {
  constexpr float kBeyondAll = 1e9f;     // Blender writes 1e10
  constexpr float kLargestHalf = 65504;  // of 16-bit floats in EXR, which clamp what is more
  constexpr float kLargestWhole = 65535;
  if (!(value > 0 && value < kBeyondAll)) return false;
  if (extension == ".exr" && value == kLargestHalf) return false;
  return whole_bits != 16 || value < kLargestWhole;
}

Raster<float> from_exr(const fs::path& path, const ReadLimits& limits) {
  const ExrImage image = read_exr(path, limits);
  const std::vector<float>* values = nullptr;
  for (const char* name : {"Z", "depth.Z", "depth.V", "Y", "R"}) {
    if (values == nullptr) values = image.find(name);
  }
  if (values == nullptr && image.channels.size() == 1) values = &image.channels.front().second;
  if (values == nullptr) {
    throw BadInput(Defect::Schema, path, "has none of the channels Z, depth.Z, depth.V, Y and R");
  }
  Raster<float> out;
  out.width = image.width;
  out.height = image.height;
  out.data = *values;
  return out;
}

StoredSamples from_array(const NpyArray& array, const fs::path& path, const ReadLimits& limits) {
  const auto sides = picture_sides(array.shape);
  if (!sides) throw BadInput(Defect::Schema, path, "expected an array of height x width values");
  if (array.values.size() > limits.max_pixels) {
    throw LimitError(printable(path) + ": " + std::to_string(array.values.size()) +
                     " pixels, allowed are " + std::to_string(limits.max_pixels));
  }
  Raster<float> values(static_cast<int>((*sides)[1]), static_cast<int>((*sides)[0]), 0);
  std::transform(array.values.begin(), array.values.end(), values.data.begin(), [](double value) {
    return static_cast<float>(value);
  });
  return {std::move(values), array.whole_bits};
}

}  // namespace

bool has_depth_extension(const fs::path& path) {
  if (is_colmap_depth_name(path)) return true;
  const std::string extension = lower_extension(path);
  return std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end();
}

fs::path depth_file_of(const SceneRoot& folder, const fs::path& photograph) {
  if (fs::path map = colmap_depth_of(folder, photograph); !map.empty()) return map;
  for (const std::string extension : kExtensions) {
    const std::string name = photograph.stem().string() + extension;
    if (is_present(folder.folder / name)) return resolve_in_scene(folder, name, folder.folder);
  }
  return {};
}

StoredSamples read_depth_file(const fs::path& path, const ReadLimits& limits) {
  const std::string extension = lower_extension(path);
  StoredSamples out;
  if (extension == ".exr") {
    out.values = from_exr(path, limits);
  } else if (extension == ".pfm") {
    out.values = read_pfm(path, limits);
  } else if (extension == ".npy") {
    out = from_array(read_npy(path, limits), path, limits);
  } else if (is_colmap_depth_name(path)) {
    out.values = read_colmap_depth(path, limits);
  } else if (extension == ".npz") {
    out = from_array(read_npz_depth(path, limits), path, limits);
  } else if (has_depth_extension(path)) {
    out = read_samples(path, limits);
  } else {
    throw BadInput(
        Defect::Unsupported,
        path,
        "no depth file; read are .exr .pfm .npy .npz .tif .tiff .png and .bin of COLMAP");
  }
  for (float& value : out.values.data) {
    if (!is_depth(value, extension, out.whole_bits)) value = kNone;
  }
  return out;
}

}  // namespace cgs
