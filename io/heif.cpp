// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/heif.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <memory>
#include <stdexcept>

#include <libheif/heif.h>

#include "io/byte_writer.h"
#include "io/isolated.h"

namespace cgs {

namespace {

using Context = std::unique_ptr<heif_context, decltype(&heif_context_free)>;
using Handle = std::unique_ptr<heif_image_handle, decltype(&heif_image_handle_release)>;
using Image = std::unique_ptr<heif_image, decltype(&heif_image_release)>;

void require_ok(const heif_error& error) {
  if (error.code != heif_error_Ok) throw std::runtime_error(std::string("HEIF: ") + error.message);
}

/// A file and its primary image. Lives in a child process.
struct PrimaryImage {
  Context context{nullptr, &heif_context_free};
  Handle handle{nullptr, &heif_image_handle_release};

  explicit PrimaryImage(std::string_view bytes) {
    context.reset(heif_context_alloc());
    heif_context_set_max_decoding_threads(context.get(), 0);  // in this one
    require_ok(heif_context_read_from_memory_without_copy(
        context.get(), bytes.data(), bytes.size(), nullptr));
    heif_image_handle* primary = nullptr;
    require_ok(heif_context_get_primary_image_handle(context.get(), &primary));
    handle.reset(primary);
  }
};

std::string pixels_of(const PrimaryImage& file) {
  heif_image* decoded = nullptr;
  require_ok(heif_decode_image(
      file.handle.get(), &decoded, heif_colorspace_RGB, heif_chroma_interleaved_RGB, nullptr));
  const Image image(decoded, &heif_image_release);
  int stride = 0;
  const uint8_t* const rows =
      heif_image_get_plane_readonly(image.get(), heif_channel_interleaved, &stride);
  if (rows == nullptr) throw std::runtime_error("HEIF: no colours");
  const auto width = static_cast<size_t>(heif_image_get_primary_width(image.get()));
  const auto height = static_cast<size_t>(heif_image_get_primary_height(image.get()));
  std::string out;
  out.reserve(3 * width * height);
  for (size_t y = 0; y < height; ++y) {
    out.append(reinterpret_cast<const char*>(rows) + y * static_cast<size_t>(stride), 3 * width);
  }
  return out;
}

// The first four bytes of the block say how many more lie before the TIFF header.
std::string exif_of(const PrimaryImage& file) {
  heif_item_id id = 0;
  heif_image_handle* const handle = file.handle.get();
  if (heif_image_handle_get_list_of_metadata_block_IDs(handle, "Exif", &id, 1) != 1) return "";
  std::string block(heif_image_handle_get_metadata_size(handle, id), '\0');
  require_ok(heif_image_handle_get_metadata(handle, id, block.data()));
  constexpr size_t kOffset = 4;
  if (block.size() < kOffset) return "";
  uint64_t skipped = 0;
  for (size_t i = 0; i < kOffset; ++i) skipped = skipped << 8 | static_cast<uint8_t>(block[i]);
  if (skipped > block.size() - kOffset) return "";
  return std::string("Exif\0\0", 6) + block.substr(kOffset + static_cast<size_t>(skipped));
}

}  // namespace

bool is_heif(std::string_view bytes) {
  static constexpr std::array<std::string_view, 8> kBrands = {
      "heic", "heix", "heim", "heis", "mif1", "msf1", "avif", "avis"};
  if (bytes.substr(0, 8).substr(std::min<size_t>(4, bytes.size())) != "ftyp") return false;
  return std::find(kBrands.begin(), kBrands.end(), bytes.substr(8, 4)) != kBrands.end();
}

ImageSize heif_size(std::string_view bytes, const std::filesystem::path& path) {
  const std::string answer = run_isolated(
      [&] {
        const PrimaryImage file(bytes);
        std::string out;
        append_bytes(out, int32_t{heif_image_handle_get_width(file.handle.get())});
        append_bytes(out, int32_t{heif_image_handle_get_height(file.handle.get())});
        return out;
      },
      path);
  std::array<int32_t, 2> sides{};
  std::memcpy(sides.data(), answer.data(), std::min(answer.size(), sizeof sides));
  return {sides[0], sides[1]};
}

std::string decode_heif(std::string_view bytes, const std::filesystem::path& path) {
  return run_isolated([&] { return pixels_of(PrimaryImage(bytes)); }, path);
}

std::string heif_exif(std::string_view bytes, const std::filesystem::path& path) {
  return run_isolated([&] { return exif_of(PrimaryImage(bytes)); }, path);
}

}  // namespace cgs
