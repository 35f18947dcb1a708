// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/sog.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include <nlohmann/json.hpp>
#include <webp/decode.h>

#include "io/bytes/json_file.h"
#include "io/bytes/zip.h"
#include "io/glb/container.h"
#include "io/glb/gltf_files.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr size_t kChannels = 4;
constexpr int kPaletteColumns = 64;
constexpr uint64_t kMostMetaBytes = uint64_t{16} << 20;

/// Whether JSON is that of SOG; glTF has none of these keys.
bool is_sog_meta(std::string_view bytes) {
  const auto has = [&](std::string_view key) { return bytes.find(key) != std::string_view::npos; };
  return is_gltf_text(bytes) && has("\"means\"") && has("\"quats\"") && has("\"sh0\"");
}

/// meta.json and the images that it names, in an archive or in the folder of meta.json.
class SogParts {
 public:
  SogParts(std::string_view bytes, const std::filesystem::path& path) : path_(path) {
    if (!is_sog_meta(bytes)) {
      archive_.emplace(bytes, path);
      json_ = parse_json(archive_->read("meta.json", kMostMetaBytes), path);
    } else if (bytes.size() <= kMostMetaBytes) {
      json_ = parse_json(bytes, path);
    } else {
      throw LimitError(printable(path) + ": " + std::to_string(bytes.size()) + " bytes of JSON");
    }
  }

  JsonValue meta() const { return {json_, path_}; }
  const nlohmann::json& json() const { return json_; }
  std::string image(const JsonValue& name) const {
    return archive_ ? archive_->read(name.text(), ReadLimits().max_file_bytes)
                    : read_file(place_of(name));
  }
  std::string image_start(const JsonValue& name, size_t most) const {
    return archive_ ? archive_->read_start(name.text(), most)
                    : read_file_start(place_of(name), most);
  }

 private:
  std::filesystem::path place_of(const JsonValue& name) const {
    return resolve_beside(path_, name.text(), name);
  }

  const std::filesystem::path& path_;
  std::optional<ZipArchive> archive_;
  nlohmann::json json_;
};

/// RGBA pixels, one per splat.
class Pixels {
 public:
  Pixels(const std::string& webp, const std::string& name, const std::filesystem::path& path) {
    const ReadLimits limits;
    const auto* const first = reinterpret_cast<const uint8_t*>(webp.data());
    if (webp.starts_with("\x89PNG")) {
      throw BadInput(Defect::Unsupported, path, name + " is PNG; of SOG, only WebP is read");
    }
    if (WebPGetInfo(first, webp.size(), &width, &height) == 0) {
      throw BadInput(Defect::Syntax, path, name + " is no WebP image");
    }
    if (uint64_t(width) * uint64_t(height) > limits.max_pixels) {
      throw LimitError(printable(path) + ": " + name + " has more than 2^28 pixels");
    }
    rgba_.reset(WebPDecodeRGBA(first, webp.size(), &width, &height));
    if (!rgba_) throw BadInput(Defect::Syntax, path, name + " cannot be decoded");
  }

  size_t size() const { return size_t(width) * size_t(height); }
  uint8_t at(size_t pixel, size_t channel) const {
    return rgba_.get()[kChannels * pixel + channel];
  }

  int width = 0;
  int height = 0;

 private:
  struct Free {
    void operator()(uint8_t* pixels) const { WebPFree(pixels); }
  };
  std::unique_ptr<uint8_t, Free> rgba_;
};

JsonValue image_name(const JsonValue& part, size_t number) {
  const JsonValue files = part.at("files");
  if (number >= files.size()) files.fail(Defect::Schema, "names too few images");
  return files.at(number);
}

class SogReader {
 public:
  SogReader(std::string_view bytes, const std::filesystem::path& path)
      : path_(path), parts_(bytes, path) {}

  RawSplats read() {
    const JsonValue meta = parts_.meta();
    const auto version = meta.find("version");
    if (!version || version->count() != 2) {
      throw BadInput(Defect::Unsupported, path_, "meta.json is not of SOG version 2");
    }
    count_ = static_cast<size_t>(meta.at("count").count());
    if (count_ == 0) throw BadInput(Defect::Empty, path_, "0 splats");
    splats_.format = "SOG 2";
    const auto states = [&](const char* key, const nlohmann::json& value) {
      const auto found = parts_.json().find(key);
      return found != parts_.json().end() && *found == value;
    };
    // The specification has the first, splat-transform writes the second.
    splats_.is_antialiased = states("antialias", true) || states("model", "antialiased");
    const auto harmonics = meta.find("shN");
    if (harmonics) {
      splats_.sh_degree = harmonics->at("bands").count();
      if (splats_.sh_degree < 1 || splats_.sh_degree > 3) {
        harmonics->at("bands").fail(Defect::Schema, "allowed are 1 to 3");
      }
    }
    const Pixels low = image(meta.at("means"), 0, count_);  // before anything is reserved
    splats_.reserve(count_);
    add_positions(meta.at("means"), low);
    add_rotations(meta.at("quats"));
    add_scales(meta.at("scales"));
    add_colors(meta.at("sh0"));
    if (harmonics) add_harmonics(*harmonics);
    return std::move(splats_);
  }

 private:
  Pixels image(const JsonValue& part, size_t number, size_t needed) const {
    const JsonValue name = image_name(part, number);
    const std::string shown = one_line(name.text().substr(0, 60));
    Pixels out(parts_.image(name), shown, path_);
    if (out.size() < needed) {
      throw BadInput(Defect::Count,
                     path_,
                     shown + " has " + std::to_string(out.size()) + " pixels, needed are " +
                         std::to_string(needed));
    }
    return out;
  }

  std::vector<double> numbers(const JsonValue& part, const char* key, size_t count) const {
    const JsonValue list = part.at(key);
    if (list.size() != count)
      list.fail(Defect::Schema, "needs " + std::to_string(count) + " numbers");
    std::vector<double> out;
    for (size_t i = 0; i < count; ++i) out.push_back(list.at(i).number());
    return out;
  }

  std::array<float, 256> codebook(const JsonValue& part) const {
    std::array<float, 256> out{};
    const std::vector<double> values = numbers(part, "codebook", out.size());
    for (size_t i = 0; i < out.size(); ++i) out.at(i) = static_cast<float>(values[i]);
    return out;
  }

  void add_positions(const JsonValue& part, const Pixels& low) {
    const Pixels high = image(part, 1, count_);
    const std::vector<double> mins = numbers(part, "mins", 3);
    const std::vector<double> maxs = numbers(part, "maxs", 3);
    for (size_t i = 0; i < count_; ++i) {
      Eigen::Vector3d p = Eigen::Vector3d::Zero();
      for (size_t k = 0; k < 3; ++k) {
        const int value = low.at(i, k) + 256 * high.at(i, k);
        const double v = mins[k] + (maxs[k] - mins[k]) * value / 65535;
        p[static_cast<int>(k)] = std::copysign(std::expm1(std::abs(v)), v);
      }
      splats_.position.push_back(p);
    }
  }

  void add_rotations(const JsonValue& part) {
    const Pixels pixels = image(part, 0, count_);
    constexpr int kFirstTag = 252;  // the largest entry is w; 253 … 255 = x, y, z
    for (size_t i = 0; i < count_; ++i) {
      const int largest = pixels.at(i, 3) - kFirstTag;
      Eigen::Vector4d q = Eigen::Vector4d::Zero();
      double rest = 1;
      for (int k = 0, channel = 0; k < 4 && largest >= 0; ++k) {
        if (k == largest) continue;
        q[k] = (pixels.at(i, static_cast<size_t>(channel++)) / 127.5 - 1) / std::numbers::sqrt2;
        rest -= q[k] * q[k];
      }
      if (largest >= 0) q[largest] = std::sqrt(std::max(0.0, rest));
      splats_.rotation.emplace_back(q.cast<float>());
    }
  }

  void add_scales(const JsonValue& part) {
    const Pixels pixels = image(part, 0, count_);
    const std::array<float, 256> book = codebook(part);
    for (size_t i = 0; i < count_; ++i) {
      splats_.log_scale.emplace_back(
          book.at(pixels.at(i, 0)), book.at(pixels.at(i, 1)), book.at(pixels.at(i, 2)));
    }
  }

  void add_colors(const JsonValue& part) {
    const Pixels pixels = image(part, 0, count_);
    const std::array<float, 256> book = codebook(part);
    splats_.sh.assign(count_ * splats_.sh_count(), Eigen::Vector3f::Zero());
    for (size_t i = 0; i < count_; ++i) {
      splats_.sh[i * splats_.sh_count()] = {
          book.at(pixels.at(i, 0)), book.at(pixels.at(i, 1)), book.at(pixels.at(i, 2))};
      splats_.logit.push_back(logit_of_byte(pixels.at(i, 3)));
    }
  }

  void add_harmonics(const JsonValue& part) {
    const std::array<float, 256> book = codebook(part);
    const size_t coefficients = splats_.sh_count() - 1;
    const auto entries = static_cast<size_t>(part.at("count").count());
    const size_t rows = (entries + kPaletteColumns - 1) / kPaletteColumns;
    const Pixels palette = image(part, 0, rows * kPaletteColumns * coefficients);
    const Pixels labels = image(part, 1, count_);
    if (size_t(palette.width) != kPaletteColumns * coefficients) {
      part.fail(Defect::Schema, "the palette is " + std::to_string(palette.width) + " pixels wide");
    }
    for (size_t i = 0; i < count_; ++i) {
      const size_t label = labels.at(i, 0) + 256U * labels.at(i, 1);
      if (label >= entries) {
        throw BadInput(Defect::Ref,
                       path_,
                       "splat " + std::to_string(i) + " names entry " + std::to_string(label) +
                           " of a palette of " + std::to_string(entries));
      }
      for (size_t k = 0; k < coefficients; ++k) {
        const size_t pixel = label * coefficients + k;  // rows of 64 entries follow each other
        splats_.sh[i * splats_.sh_count() + 1 + k] = {book.at(palette.at(pixel, 0)),
                                                      book.at(palette.at(pixel, 1)),
                                                      book.at(palette.at(pixel, 2))};
      }
    }
  }

  const std::filesystem::path& path_;
  SogParts parts_;
  size_t count_ = 0;
  RawSplats splats_;
};

}  // namespace

bool looks_like_sog(std::string_view bytes) {
  return bytes.substr(0, 4) == std::string_view("PK\x03\x04", 4) || is_sog_meta(bytes);
}

SogCount stated_sog_splats(std::string_view bytes, const std::filesystem::path& path) {
  constexpr size_t kImageHeader = 64;  // more than WebP has before the size
  const SogParts parts(bytes, path);
  const JsonValue meta = parts.meta();
  SogCount out;
  const auto count = meta.find("count");
  if (!count) return out;  // as of version 1, which reading it tells
  out.splats = static_cast<uint64_t>(count->count());
  if (const auto harmonics = meta.find("shN")) {
    const auto side = static_cast<uint64_t>(std::min(harmonics->at("bands").count(), 3)) + 1;
    out.harmonics = side * side;
  }
  const std::string start = parts.image_start(image_name(meta.at("means"), 0), kImageHeader);
  int width = 0;
  int height = 0;
  const auto* const first = reinterpret_cast<const uint8_t*>(start.data());
  if (WebPGetInfo(first, start.size(), &width, &height) != 0) {
    out.splats = std::min(out.splats, static_cast<uint64_t>(width) * static_cast<uint64_t>(height));
  }
  return out;
}

RawSplats parse_sog(std::string_view bytes, const std::filesystem::path& path) {
  return SogReader(bytes, path).read();
}

}  // namespace cgs
