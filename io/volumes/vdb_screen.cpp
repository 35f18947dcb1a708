// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/volumes/vdb_screen.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

namespace cgs {

namespace {

constexpr int64_t kMagic = 0x56444220;
constexpr uint32_t kVersion = 224;
constexpr uint32_t kZip = 1;
constexpr uint32_t kActiveMask = 2;
constexpr uint32_t kBlosc = 4;
constexpr std::string_view kDelayedLoad = "__delayedload";

struct NamedSize {
  std::string_view name;
  size_t bytes;
};

template <size_t N>
std::optional<size_t> size_of(const std::array<NamedSize, N>& table, std::string_view name) {
  const auto found = std::find_if(
      table.begin(), table.end(), [&](const NamedSize& entry) { return entry.name == name; });
  if (found == table.end()) return std::nullopt;
  return found->bytes;
}

constexpr std::array<NamedSize, 7> kTrees = {{{"Tree_float_5_4_3", 4},
                                              {"Tree_double_5_4_3", 8},
                                              {"Tree_int32_5_4_3", 4},
                                              {"Tree_int64_5_4_3", 8},
                                              {"Tree_vec3i_5_4_3", 12},
                                              {"Tree_vec3s_5_4_3", 12},
                                              {"Tree_vec3d_5_4_3", 24}}};

constexpr std::array<NamedSize, 16> kMetadata = {{{"bool", 1},
                                                  {"int32", 4},
                                                  {"int64", 8},
                                                  {"float", 4},
                                                  {"double", 8},
                                                  {"vec2i", 8},
                                                  {"vec2s", 8},
                                                  {"vec2d", 16},
                                                  {"vec3i", 12},
                                                  {"vec3s", 12},
                                                  {"vec3d", 24},
                                                  {"vec4i", 16},
                                                  {"vec4s", 16},
                                                  {"vec4d", 32},
                                                  {"mat4s", 64},
                                                  {"mat4d", 128}}};

/// Maps from index to world space. Those with scales hold five vectors: scale, voxel size and
/// three derived ones, after a translation if they have one.
constexpr std::array<NamedSize, 7> kMaps = {{{"AffineMap", 128},
                                             {"UnitaryMap", 128},
                                             {"TranslationMap", 24},
                                             {"ScaleMap", 120},
                                             {"UniformScaleMap", 120},
                                             {"ScaleTranslateMap", 144},
                                             {"UniformScaleTranslateMap", 144}}};

struct Mask {
  std::string_view bits;
  size_t count() const {
    size_t on = 0;
    for (const char c : bits) on += std::popcount(static_cast<unsigned char>(c));
    return on;
  }
};

class VdbScreen {
 public:
  VdbScreen(std::string_view bytes, const std::filesystem::path& path, const ReadLimits& limits)
      : reader_(bytes, path), limits_(limits) {}

  void run() {
    read_header();
    read_metadata();
    const auto grids = reader_.get<int32_t>("number of grids");
    if (grids == 0) reader_.fail(Defect::Empty, "no grids");
    if (grids < 0) reader_.fail(Defect::Syntax, "number of grids " + std::to_string(grids));
    constexpr uint64_t kSmallestGrid = 3 * 4 + 3 * 8 + 4 + 4 + 4 + 24 + 4 + 4 + 8;
    reader_.expect_records(static_cast<uint64_t>(grids), kSmallestGrid, "grids");
    for (int32_t i = 0; i < grids; ++i) read_grid();
    if (reader_.remaining() > 0) {
      reader_.fail(Defect::Syntax,
                   std::to_string(reader_.remaining()) + " bytes follow the last grid");
    }
  }

  /// Where the type names of tables for delayed loading stand.
  const std::vector<size_t>& delayed_load_types() const { return delayed_load_types_; }

 private:
  void read_header() {
    if (reader_.get<int64_t>("magic number") != kMagic) {
      reader_.fail(Defect::Magic, "expected OpenVDB");
    }
    const auto version = reader_.get<uint32_t>("file version");
    if (version != kVersion) {
      reader_.fail(
          Defect::Unsupported,
          "file version " + std::to_string(version) + ", read is " + std::to_string(kVersion));
    }
    (void)reader_.take(8, "library version");
    if (reader_.get<uint8_t>("offset flag") != 1) {
      reader_.fail(Defect::Unsupported, "a stream without offsets of its grids");
    }
    (void)reader_.take(36, "UUID");
  }

  std::string_view text(std::string_view what, uint64_t longest) {
    const auto length = reader_.get<uint32_t>(what);
    if (length > longest) {
      throw LimitError(printable(reader_.path()) + ": at byte " + std::to_string(reader_.offset()) +
                       ": " + std::string(what) + " of " + std::to_string(length) +
                       " bytes, allowed are " + std::to_string(longest));
    }
    return reader_.take(length, what);
  }

  std::string_view name(std::string_view what) { return text(what, limits_.max_name_bytes); }

  void read_metadata() {
    const auto count = reader_.get<uint32_t>("number of metadata");
    reader_.expect_records(count, 12, "metadata");
    for (uint32_t i = 0; i < count; ++i) {
      const std::string_view key = name("metadata name");
      const size_t type_at = reader_.offset() + 4;
      const std::string_view type = name("metadata type");
      if (type == "string") {
        (void)text("metadata", limits_.max_header_bytes);
      } else if (type == kDelayedLoad) {
        (void)reader_.take(reader_.get<uint32_t>("delayed loading"), "delayed loading");
        delayed_load_types_.push_back(type_at);
      } else {
        read_plain_metadata(key, type);
      }
    }
  }

  void read_plain_metadata(std::string_view key, std::string_view type) {
    const std::optional<size_t> size = size_of(kMetadata, type);
    if (!size) {
      reader_.fail(Defect::Unsupported, "metadata of type " + printable(std::string(type)));
    }
    const auto declared = reader_.get<uint32_t>("metadata size");
    if (declared != *size) {
      reader_.fail(Defect::Syntax,
                   "metadata of " + std::to_string(declared) + " bytes, its type has " +
                       std::to_string(*size));
    }
    const std::string_view value = reader_.take(*size, "metadata");
    if (type != "bool") return;
    check_boolean(value[0]);
    if (key == "is_saved_as_half_float" && value[0] != 0) {
      reader_.fail(Defect::Unsupported, "values stored as half floats");
    }
  }

  void check_boolean(char value) const {
    if (value != 0 && value != 1) reader_.fail(Defect::Syntax, "a flag is neither 0 nor 1");
  }

  void read_grid() {
    (void)name("grid name");
    const std::string_view type = name("grid type");
    const std::optional<size_t> bytes = size_of(kTrees, type);
    if (!bytes) reader_.fail(Defect::Unsupported, "grid of type " + printable(std::string(type)));
    value_bytes_ = *bytes;
    if (!name("parent of a grid").empty()) {
      reader_.fail(Defect::Unsupported, "grids that share a tree");
    }
    const auto grid_at = reader_.get<int64_t>("place of a grid");
    const auto blocks_at = reader_.get<int64_t>("place of the values");
    const auto end_at = reader_.get<int64_t>("end of a grid");
    check_place(grid_at, "grid");
    compression_ = reader_.get<uint32_t>("compression");
    const bool is_known = compression_ <= 7 && (compression_ & (kZip | kBlosc)) != (kZip | kBlosc);
    if (!is_known) {
      reader_.fail(Defect::Unsupported, "compression flags " + std::to_string(compression_));
    }
    read_metadata();
    read_transform();
    leaves_ = 0;
    read_root();
    check_place(blocks_at, "block of values");
    for (uint64_t i = 0; i < leaves_; ++i) read_values(512, read_mask(512));
    check_place(end_at, "end of a grid");
  }

  void check_place(int64_t declared, const std::string& what) const {
    if (declared == static_cast<int64_t>(reader_.offset())) return;
    reader_.fail(Defect::Syntax,
                 "the " + what + " should be at byte " + std::to_string(declared) + " and is here");
  }

  void read_transform() {
    const std::string_view type = name("type of a transform");
    const std::optional<size_t> bytes = size_of(kMaps, type);
    if (!bytes) {
      reader_.fail(Defect::Unsupported, "transform of type " + printable(std::string(type)));
    }
    std::vector<double> v(*bytes / sizeof(double));
    for (double& value : v) {
      value = reader_.get<double>("transform");
      if (!std::isfinite(value)) reader_.fail(Defect::Value, "a transform is not finite");
    }
    if (type.find("Scale") == std::string_view::npos) return;
    const size_t first = type.ends_with("TranslateMap") ? 3 : 0;
    for (size_t i = first; i < first + 3; ++i) {
      const double scale = v[i];
      const auto agrees = [](double stored, double expected) {
        return std::abs(stored - expected) <= 1e-9 * std::abs(expected);
      };
      const bool is_good = scale != 0 && agrees(v[i + 3], std::abs(scale)) &&
                           agrees(v[i + 6], 1 / scale) && agrees(v[i + 9], 1 / (scale * scale)) &&
                           agrees(v[i + 12], 0.5 / scale);
      if (!is_good) {
        reader_.fail(Defect::Value, "the scale of a transform is 0 or contradicts its inverse");
      }
    }
  }

  Mask read_mask(size_t values) { return {reader_.take(values / 8, "node mask")}; }

  void read_root() {
    if (reader_.get<int32_t>("number of buffers") != 1) {
      reader_.fail(Defect::Unsupported, "a tree of several buffers");
    }
    (void)reader_.take(value_bytes_, "background");
    const auto tiles = reader_.get<uint32_t>("number of tiles");
    const auto children = reader_.get<uint32_t>("number of nodes");
    reader_.expect_records(tiles, 12 + value_bytes_ + 1, "tiles");
    std::vector<std::array<int32_t, 3>> origins;
    for (uint32_t i = 0; i < tiles; ++i) {
      origins.push_back(read_origin());
      (void)reader_.take(value_bytes_, "tile");
      check_boolean(reader_.get<char>("tile"));
    }
    reader_.expect_records(children, 12 + 2 * (32768 / 8), "nodes");
    for (uint32_t i = 0; i < children; ++i) {
      origins.push_back(read_origin());
      // The library reads values in this order and not in that of the file.
      if (i > 0 && !(origins[origins.size() - 2] < origins.back())) {
        reader_.fail(Defect::Syntax, "the nodes of a tree are not in order");
      }
      read_internal(5);
    }
    std::sort(origins.begin(), origins.end());
    if (std::adjacent_find(origins.begin(), origins.end()) != origins.end()) {
      reader_.fail(Defect::Syntax, "two nodes of a tree lie at one place");
    }
  }

  std::array<int32_t, 3> read_origin() {
    const auto origin = reader_.get<std::array<int32_t, 3>>("place of a node");
    constexpr uint32_t kInside = 4095;
    for (const int32_t x : origin) {
      if ((static_cast<uint32_t>(x) & kInside) != 0) {
        reader_.fail(Defect::Syntax, "a node does not lie on the lattice of nodes");
      }
    }
    return origin;
  }

  /// A node of 2^level values along each axis; below level 5 there is level 4, then the leaves.
  void read_internal(int level) {
    const size_t values = size_t{1} << (3 * level);
    const Mask children = read_mask(values);
    const Mask active = read_mask(values);
    for (size_t i = 0; i < children.bits.size(); ++i) {
      if ((children.bits[i] & active.bits[i]) != 0) {
        reader_.fail(Defect::Syntax, "an entry of a node is a child and a value at once");
      }
    }
    read_values(values, active);
    const size_t count = children.count();
    for (size_t i = 0; i < count; ++i) {
      if (level == 5) {
        read_internal(4);
      } else {
        (void)read_mask(512);
        ++leaves_;
      }
    }
  }

  void read_values(size_t values, const Mask& active) {
    enum : uint8_t { OneInactive = 2, MaskOnly, MaskAndOne, MaskAndTwo, All };
    const auto kind = reader_.get<uint8_t>("kind of a block");
    if (kind > All) reader_.fail(Defect::Syntax, "unknown kind of block " + std::to_string(kind));
    if (kind == OneInactive || kind == MaskAndOne) (void)reader_.take(value_bytes_, "inactive");
    if (kind == MaskAndTwo) (void)reader_.take(2 * value_bytes_, "inactive values");
    if (kind == MaskOnly || kind == MaskAndOne || kind == MaskAndTwo) (void)read_mask(values);
    const bool only_active = (compression_ & kActiveMask) != 0 && kind != All;
    read_block((only_active ? active.count() : values) * value_bytes_);
  }

  void read_block(size_t expected) {
    if ((compression_ & (kZip | kBlosc)) == 0) {
      (void)reader_.take(expected, "values");
      return;
    }
    const auto stored = reader_.get<int64_t>("length of a block");
    if (stored <= 0) {  // not compressed; no overflow, since only the exact negative is allowed
      if (stored != -static_cast<int64_t>(expected)) fail_block(stored, expected);
      (void)reader_.take(expected, "values");
      return;
    }
    const std::string_view block = reader_.take(static_cast<size_t>(stored), "values");
    if ((compression_ & kBlosc) != 0) check_blosc(block, expected);
  }

  void check_blosc(std::string_view block, size_t expected) const {
    ByteReader header(block, reader_.path());
    if (block.size() < 16) fail_block(static_cast<int64_t>(block.size()), expected);
    const auto bytes = header.get<std::array<uint8_t, 4>>("blosc header");
    const auto unpacked = header.get<uint32_t>("blosc header");
    (void)header.get<uint32_t>("blosc header");  // length of its parts
    const auto packed = header.get<uint32_t>("blosc header");
    if (unpacked != expected || packed != block.size()) fail_block(packed, expected);
    constexpr int kLz4 = 1;
    if (bytes[2] >> 5 != kLz4) {
      reader_.fail(Defect::Unsupported,
                   "blosc codec " + std::to_string(bytes[2] >> 5) + ", allowed is LZ4");
    }
  }

  [[noreturn]] void fail_block(int64_t stored, size_t expected) const {
    reader_.fail(Defect::Syntax,
                 "a block states a length of " + std::to_string(stored) + " and should hold " +
                     std::to_string(expected) + " bytes of values");
  }

  ByteReader reader_;
  const ReadLimits& limits_;
  std::vector<size_t> delayed_load_types_;
  size_t value_bytes_ = 0;
  uint32_t compression_ = 0;
  uint64_t leaves_ = 0;
};

}  // namespace

std::vector<size_t> screen_vdb(std::string_view bytes,
                               const std::filesystem::path& path,
                               const ReadLimits& limits) {
  refuse_foreign_content(path, bytes, "OpenVDB");
  VdbScreen screen(bytes, path, limits);
  screen.run();
  return screen.delayed_load_types();
}

}  // namespace cgs
