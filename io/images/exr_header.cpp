// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/exr_header.h"

#include <algorithm>
#include <vector>

namespace cgs {

namespace {

constexpr uint32_t kMagic = 0x01312f76;
constexpr uint32_t kTiled = 0x200;
constexpr uint32_t kDeep = 0x800;
constexpr uint32_t kMultiPart = 0x1000;
constexpr uint8_t kZip = 3;  // methods of compression, by number
constexpr uint8_t kDwab = 9;
constexpr size_t kMaxAttributes = 1024;
constexpr uint32_t kMaxAttributeBytes = uint32_t{1} << 20;
constexpr size_t kMaxAttributeName = 255;

struct Window {
  int32_t min_x = 0;
  int32_t min_y = 0;
  int32_t max_x = -1;
  int32_t max_y = -1;
  int64_t width() const { return int64_t{max_x} - min_x + 1; }
  int64_t height() const { return int64_t{max_y} - min_y + 1; }
};

class ExrScreen {
 public:
  ExrScreen(std::string_view bytes, const std::filesystem::path& path, const ReadLimits& limits)
      : reader_(bytes, path), limits_(limits), size_(bytes.size()) {}

  ExrScreening run() {
    check_version();
    read_attributes();
    check_window();
    if (found_.is_harmless) check_chunks();
    return found_;
  }

 private:
  void check_version() {
    if (reader_.get<uint32_t>("magic number") != kMagic) {
      reader_.fail(Defect::Magic, "expected OpenEXR");
    }
    const auto version = reader_.get<uint32_t>("version");
    if ((version & 0xff) != 2) {
      reader_.fail(Defect::Magic, "OpenEXR version " + std::to_string(version & 0xff));
    }
    if ((version & (kDeep | kMultiPart)) != 0) {
      reader_.fail(Defect::Unsupported, "only images of a single part that are not deep");
    }
    found_.is_harmless = (version & kTiled) == 0;
  }

  void read_attributes() {
    for (size_t count = 0;; ++count) {
      const std::string_view name = reader_.take_c_string(kMaxAttributeName, "attribute name");
      if (name.empty()) break;
      if (count == kMaxAttributes) {
        throw LimitError(printable(reader_.path()) + ": more than " +
                         std::to_string(kMaxAttributes) + " attributes");
      }
      const std::string_view type = reader_.take_c_string(kMaxAttributeName, "attribute type");
      const auto size = reader_.get<uint32_t>("attribute size");
      if (size > kMaxAttributeBytes) {
        throw LimitError(printable(reader_.path()) + ": attribute " + printable(std::string(name)) +
                         " of " + std::to_string(size) + " bytes");
      }
      read_value(name, type, reader_.take(size, "attribute value"));
    }
    if (!has_window_ || !has_compression_ || channels_ == 0) {
      reader_.fail(Defect::Schema, "dataWindow, compression or channels are missing");
    }
  }

  void read_value(std::string_view name, std::string_view type, std::string_view value) {
    ByteReader field(value, reader_.path());
    if (name == "multiView" && value.empty()) reader_.fail(Defect::Syntax, "empty multiView");
    if (name == "dataWindow" && type == "box2i") {
      window_ = field.get<Window>("dataWindow");
      has_window_ = true;
    }
    if (name == "compression" && type == "compression") {
      const auto method = field.get<uint8_t>("compression");
      if (method > kDwab) {
        reader_.fail(
            Defect::Unsupported,
            "compression method " + std::to_string(method) +
                ", allowed are NONE, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA and DWAB");
      }
      found_.is_harmless = found_.is_harmless && method <= kZip;
      is_compressed_ = method > 0;
      lines_per_chunk_ = method == kZip ? 16 : 1;
      has_compression_ = true;
    }
    if (name == "tiles" && type == "tiledesc") {
      const auto width = field.get<uint32_t>("width of tiles");
      tile_pixels_ = uint64_t{width} * field.get<uint32_t>("height of tiles");
    }
    if (name == "channels" && type == "chlist") {
      read_channels(field);
    }
  }

  void read_channels(ByteReader& field) {
    channels_ = 0;
    pixel_bytes_ = 0;
    while (!field.take_c_string(kMaxAttributeName, "channel name").empty()) {
      ++channels_;
      const auto type = field.get<uint32_t>("pixel type");  // unsigned, half, float
      if (type > 2) reader_.fail(Defect::Syntax, "pixel type " + std::to_string(type));
      pixel_bytes_ += type == 1 ? 2 : 4;
      (void)field.take(4, "channel");  // linearity
      const auto x_sampling = field.get<int32_t>("channel sampling");
      const auto y_sampling = field.get<int32_t>("channel sampling");
      if (x_sampling != 1 || y_sampling != 1) {
        reader_.fail(Defect::Unsupported, "subsampled channels");
      }
    }
    if (channels_ == 0) reader_.fail(Defect::Schema, "no channels");
  }

  void check_window() {
    if (window_.width() < 1 || window_.height() < 1) {
      reader_.fail(Defect::Syntax, "dataWindow is empty");
    }
    constexpr int32_t kFar = 1 << 30;  // the library adds such numbers in 32 bits
    const auto [low, high] =
        std::minmax({window_.min_x, window_.min_y, window_.max_x, window_.max_y});
    if (low < -kFar || high > kFar) reader_.fail(Defect::Syntax, "dataWindow lies too far away");
    const auto pixels =
        static_cast<uint64_t>(window_.width()) * static_cast<uint64_t>(window_.height());
    if (pixels > limits_.max_pixels) {
      throw LimitError(printable(reader_.path()) + ": " + std::to_string(pixels) +
                       " pixels, allowed are " + std::to_string(limits_.max_pixels));
    }
    const uint64_t most_pixels = std::max(pixels, std::min(tile_pixels_, limits_.max_file_bytes));
    found_.decoded_bytes = channels_ * sizeof(float) * most_pixels;
    if (found_.decoded_bytes > limits_.max_file_bytes) {
      throw LimitError(printable(reader_.path()) + ": its " + std::to_string(channels_) +
                       " channels take " + std::to_string(found_.decoded_bytes) +
                       " bytes, allowed are " + std::to_string(limits_.max_file_bytes));
    }
  }

  /// Every offset must lead to a chunk inside the file, behind the table, and no two to the same.
  void check_chunks() {
    const int64_t chunks = (window_.height() + lines_per_chunk_ - 1) / lines_per_chunk_;
    const auto count = static_cast<size_t>(chunks);
    const std::string_view table = reader_.take(count * 8, "table of chunks");
    const size_t first = reader_.offset();
    ByteReader entries(table, reader_.path());
    std::vector<uint64_t> offsets(count);
    for (uint64_t& offset : offsets) {
      offset = entries.get<uint64_t>("chunk offset");
      if (offset < first) reader_.fail(Defect::Syntax, "a chunk lies in the header");
      if (offset > size_ || size_ - offset < 8) {
        reader_.fail(Defect::Truncated, "a chunk lies behind the end of the file");
      }
    }
    std::sort(offsets.begin(), offsets.end());
    if (std::adjacent_find(offsets.begin(), offsets.end()) != offsets.end()) {
      reader_.fail(Defect::Syntax, "two chunks lie at one place");
    }
    for (const uint64_t offset : offsets) check_chunk(offset);
  }

  void check_chunk(uint64_t offset) {
    ByteReader chunk = reader_at(offset);
    const auto line = chunk.get<int32_t>("first line of a chunk");
    if (line < window_.min_y || line > window_.max_y) {
      reader_.fail(Defect::Syntax, "a chunk is outside the dataWindow");
    }
    const auto size = chunk.get<int32_t>("size of a chunk");
    if (size < 0) reader_.fail(Defect::Syntax, "a chunk has a negative size");
    (void)chunk.take(static_cast<size_t>(size), "pixels of a chunk");
    // The library takes what it does not find from the chunk before.
    const bool is_whole =
        is_compressed_ || static_cast<uint64_t>(size) == pixel_bytes_ * uint64_t(window_.width());
    if (size == 0 || !is_whole) {
      reader_.fail(Defect::Syntax, "a chunk of " + std::to_string(size) + " bytes");
    }
  }

  ByteReader reader_at(uint64_t offset) const {
    ByteReader out = start_;
    (void)out.take(offset, "chunk");
    return out;
  }

  ByteReader reader_;
  const ByteReader start_ = reader_;
  const ReadLimits& limits_;
  size_t size_;
  Window window_;
  ExrScreening found_;
  uint64_t channels_ = 0;
  uint64_t tile_pixels_ = 0;
  uint64_t pixel_bytes_ = 0;  ///< As stored.
  bool is_compressed_ = false;
  int64_t lines_per_chunk_ = 1;
  bool has_window_ = false;
  bool has_compression_ = false;
};

}  // namespace

ExrScreening screen_exr(std::string_view bytes,
                        const std::filesystem::path& path,
                        const ReadLimits& limits) {
  return ExrScreen(bytes, path, limits).run();
}

}  // namespace cgs
