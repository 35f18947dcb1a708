// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/depth_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "io/images/exr.h"
#include "io/images/npy.h"
#include "io/images/npz.h"
#include "io/images/pfm.h"
#include "io/scenes/colmap_depth.h"

namespace cgs {

namespace fs = std::filesystem;

namespace {

// What keeps values as they are comes before what may be a picture to look at.
constexpr std::array<const char*, 7> kExtensions = {
    ".exr", ".pfm", ".npy", ".npz", ".tiff", ".tif", ".png"};

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

constexpr float kBeyondAll = 1e9f;  // Blender writes 1e10 for none

// False for what programs write where a ray meets nothing: 0, infinity, or the largest value there
// is in the file's type or in anybody's mind.
bool is_depth(float value, const std::string& extension, int whole_bits) {
  constexpr float kLargestHalf = 65504;  // of 16-bit floats in EXR, which clamp what is more
  constexpr float kLargestWhole = 65535;
  if (!(value > 0 && value < kBeyondAll)) return false;
  if (extension == ".exr" && value == kLargestHalf) return false;
  return whole_bits != 16 || value < kLargestWhole;
}

// Layer and component of a channel, as "ViewLayer.Depth" and "Z".
std::pair<std::string, std::string> layer_of(const std::string& channel) {
  const size_t dot = channel.rfind('.');
  if (dot == std::string::npos) return {"", channel};
  return {channel.substr(0, dot), channel.substr(dot + 1)};
}

// The depth among the channels of a picture of several layers, as Blender writes it: that of a
// layer called Depth in any view layer, else the Z beside colours; not that of positions, normals
// and motion, which have X and Y, too.
std::vector<std::string> layered_depth(const ExrImage& image) {
  std::vector<std::string> named;
  std::vector<std::string> others;
  for (const auto& [channel, values] : image.channels) {
    const auto [layer, component] = layer_of(channel);
    const std::string pass = folded_name(layer_of(layer).second);
    const bool is_depth = pass == "depth" && (component == "Z" || component == "V");
    const bool is_alone =
        image.find(layer + ".X") == nullptr && image.find(layer + ".Y") == nullptr;
    if (is_depth) named.push_back(channel);
    if (!is_depth && component == "Z" && is_alone && pass != "mist") others.push_back(channel);
  }
  return named.empty() ? others : named;
}

// \throws BadInput Schema if there is none, or more than one and nothing says which
const std::vector<float>& depth_channel(const ExrImage& image, const fs::path& path) {
  for (const char* name : {"Z", "depth.Z", "depth.V"}) {
    if (const auto* const values = image.find(name)) return *values;
  }
  const std::vector<std::string> layered = layered_depth(image);
  if (layered.size() == 1) return *image.find(layered.front());
  if (layered.size() > 1) {
    throw BadInput(Defect::Schema,
                   path,
                   "the depth may be that of channel " + printable(layered[0]) + " or " +
                       printable(layered[1]) + "; export one view layer");
  }
  for (const char* name : {"Y", "R"}) {
    if (const auto* const values = image.find(name)) return *values;
  }
  if (image.channels.size() == 1) return image.channels.front().second;
  throw BadInput(Defect::Schema,
                 path,
                 "has none of the channels Z, depth.Z, depth.V, Y and R, nor a layer with depth");
}

Raster<float> from_exr(const fs::path& path, const ReadLimits& limits) {
  const ExrImage image = read_exr(path, limits);
  const std::vector<float>& values = depth_channel(image, path);
  Raster<float> stored;
  stored.width = image.width;
  stored.height = image.height;
  stored.data = values;
  const ExrWindow& shown = image.display;
  if (shown == ExrWindow{0, 0, image.width, image.height}) return stored;
  const uint64_t pixels = uint64_t(shown.width) * uint64_t(shown.height);
  if (pixels > limits.max_pixels) {
    throw LimitError(printable(path) + ": display window of " + std::to_string(pixels) +
                     " pixels, allowed are " + std::to_string(limits.max_pixels));
  }
  Raster<float> out(shown.width, shown.height, kNone);  // what was cropped away is not known
  for (int y = 0; y < stored.height; ++y) {
    for (int x = 0; x < stored.width; ++x) {
      const int64_t u = int64_t(x) - shown.left;
      const int64_t v = int64_t(y) - shown.top;
      if (u < 0 || v < 0 || u >= out.width || v >= out.height) continue;
      out(static_cast<int>(u), static_cast<int>(v)) = stored(x, y);
    }
  }
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

namespace {

// The file of that stem whose format comes first, be it that its name differs in letter case or
// Unicode normal form; empty if there is none.
std::string file_of_stem(const fs::path& folder, const fs::path& stem, bool is_folded = false) {
  std::string out;
  size_t best = kExtensions.size();
  const std::string wanted = is_folded ? folded_name(stem.string()) : stem.string();
  for (const std::string& entry : sorted_entries(folder)) {
    const std::string own = fs::path(entry).stem().string();
    if ((is_folded ? folded_name(own) : own) != wanted) continue;
    const auto* const format =
        std::find(kExtensions.begin(), kExtensions.end(), lower_extension(entry));
    const auto rank = static_cast<size_t>(format - kExtensions.begin());
    if (rank == best && is_folded && best < kExtensions.size()) {
      throw BadInput(Defect::Ref,
                     folder / out,
                     "and " + printable(fs::path(entry)) + " may both be the depth of " +
                         printable(stem) + "; rename one of them");
    }
    if (rank >= best) continue;
    best = rank;
    out = entry;
  }
  return out.empty() && !is_folded ? file_of_stem(folder, stem, true) : out;
}

}  // namespace

fs::path depth_file_of(const SceneRoot& folder, const fs::path& photograph) {
  if (fs::path map = colmap_depth_of(folder, photograph); !map.empty()) return map;
  for (auto first = photograph.begin(); first != photograph.end(); ++first) {
    if (*first == "/" || *first == ".." || *first == ".") continue;
    fs::path within;
    for (auto part = first; std::next(part) != photograph.end(); ++part) within /= *part;
    if (!is_folder(folder.folder / within)) continue;
    const std::string file = file_of_stem(folder.folder / within, photograph.stem());
    if (!file.empty()) return resolve_in_scene(folder, (within / file).string(), folder.folder);
  }
  return {};
}

namespace {

StoredSamples read_values(const fs::path& path, const ReadLimits& limits) {
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
  return out;
}

// Raises all values above 0 where more than a few are below, and not all the same: that would be
// what a program writes for none.
void raise_above_zero(Raster<float>& values) {
  constexpr double kFew = 0.01;
  float lowest = 0;
  float mark = 0;
  float highest = -kBeyondAll;
  bool differ = false;
  size_t negative = 0;
  size_t all = 0;
  for (const float value : values.data) {
    if (!(std::abs(value) < kBeyondAll) || value == 0) continue;
    ++all;
    highest = std::max(highest, value);
    lowest = std::min(lowest, value);
    if (value > 0) continue;
    ++negative;
    if (mark == 0) mark = value;
    differ = differ || value != mark;
  }
  if (!differ || double(negative) < kFew * double(all)) return;
  const float margin = 0.01f * (highest - lowest);
  for (float& value : values.data) {
    if (std::abs(value) < kBeyondAll && value != 0) value += margin - lowest;
  }
}

StoredSamples without_none(StoredSamples samples, const fs::path& path) {
  for (float& value : samples.values.data) {
    if (!is_depth(value, lower_extension(path), samples.whole_bits)) value = kNone;
  }
  return samples;
}

}  // namespace

StoredSamples read_depth_file(const fs::path& path, const ReadLimits& limits) {
  return without_none(read_values(path, limits), path);
}

StoredSamples read_relative_depth_file(const fs::path& path, const ReadLimits& limits) {
  StoredSamples out = read_values(path, limits);
  raise_above_zero(out.values);
  return without_none(std::move(out), path);
}

}  // namespace cgs
