// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/heif.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <stdexcept>

#include <libheif/heif.h>

#include "io/bytes/byte_writer.h"
#include "io/bytes/isolated.h"

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

std::string pixels_of(const PrimaryImage& file, const ImageSize& size) {
  const bool has_alpha = heif_image_handle_has_alpha_channel(file.handle.get()) != 0;
  heif_image* decoded = nullptr;
  require_ok(
      heif_decode_image(file.handle.get(),
                        &decoded,
                        heif_colorspace_RGB,
                        has_alpha ? heif_chroma_interleaved_RGBA : heif_chroma_interleaved_RGB,
                        nullptr));
  const Image image(decoded, &heif_image_release);
  heif_error warning{};
  if (heif_image_get_decoding_warnings(image.get(), 0, &warning, 1) > 0) require_ok(warning);
  int stride = 0;
  const uint8_t* const rows =
      heif_image_get_plane_readonly(image.get(), heif_channel_interleaved, &stride);
  const bool fits = rows != nullptr && heif_image_get_primary_width(image.get()) == size.width &&
                    heif_image_get_primary_height(image.get()) == size.height;
  if (!fits) throw std::runtime_error("HEIF: the image is not of the size that is announced");
  const size_t row_bytes = (has_alpha ? 4 : 3) * static_cast<size_t>(size.width);
  std::string out;
  out.reserve(row_bytes * static_cast<size_t>(size.height));
  for (int y = 0; y < size.height; ++y) {
    const auto* row = reinterpret_cast<const char*>(rows) + std::ptrdiff_t{y} * stride;
    out.append(row, row_bytes);
  }
  return out;
}

// The first four bytes of the block say how many more lie before the TIFF header.
std::string exif_of(const PrimaryImage& file) {
  heif_item_id id = 0;
  heif_image_handle* const handle = file.handle.get();
  if (heif_image_handle_get_list_of_metadata_block_IDs(handle, "Exif", &id, 1) != 1) return "";
  constexpr size_t kOffset = 4;
  constexpr size_t kMostBytes = size_t{1} << 20;
  std::string block(heif_image_handle_get_metadata_size(handle, id), '\0');
  if (block.size() < kOffset || block.size() > kMostBytes) return "";
  if (heif_image_handle_get_metadata(handle, id, block.data()).code != heif_error_Ok) return "";
  uint64_t skipped = 0;
  for (size_t i = 0; i < kOffset; ++i) skipped = skipped << 8 | static_cast<uint8_t>(block[i]);
  if (skipped > block.size() - kOffset) return "";
  return std::string("Exif\0\0", 6) + block.substr(kOffset + static_cast<size_t>(skipped));
}

constexpr char kIsDisplayP3 = 'p';
constexpr char kIsIcc = 'i';

// The first letter says which of both it is; empty for neither.
std::string profile_of(const PrimaryImage& file) {
  const heif_image_handle* const handle = file.handle.get();
  const heif_color_profile_type type = heif_image_handle_get_color_profile_type(handle);
  if (type == heif_color_profile_type_nclx) {
    heif_color_profile_nclx* found = nullptr;
    require_ok(heif_image_handle_get_nclx_color_profile(handle, &found));
    const std::unique_ptr<heif_color_profile_nclx, decltype(&heif_nclx_color_profile_free)> nclx(
        found, &heif_nclx_color_profile_free);
    const bool is_hdr =
        nclx->transfer_characteristics == heif_transfer_characteristic_ITU_R_BT_2100_0_PQ ||
        nclx->transfer_characteristics == heif_transfer_characteristic_ITU_R_BT_2100_0_HLG;
    const bool is_p3 = nclx->color_primaries == heif_color_primaries_SMPTE_EG_432_1;
    return is_p3 && !is_hdr ? std::string(1, kIsDisplayP3) : "";
  }
  constexpr size_t kMostBytes = size_t{4} << 20;
  const size_t size = heif_image_handle_get_raw_color_profile_size(handle);
  if (type == heif_color_profile_type_not_present || size == 0 || size > kMostBytes) return "";
  std::string out(size, '\0');
  require_ok(heif_image_handle_get_raw_color_profile(handle, out.data()));
  return kIsIcc + out;
}

}  // namespace

// Of the box that comes first: the major brand, a version, and brands that it is compatible with.
bool is_heif(std::string_view bytes) {
  static constexpr std::array<std::string_view, 8> kBrands = {
      "heic", "heix", "heim", "heis", "mif1", "msf1", "avif", "avis"};
  constexpr size_t kMajor = 8;
  constexpr size_t kVersion = 12;
  constexpr size_t kMostBytes = 256;
  if (bytes.size() < kVersion || bytes.substr(4, 4) != "ftyp") return false;
  size_t end = 0;
  for (const char c : bytes.substr(0, 4)) end = end << 8 | static_cast<uint8_t>(c);
  end = std::min({std::max(end, kVersion), bytes.size(), kMostBytes});
  for (size_t at = kMajor; at + 4 <= end; at += 4) {
    if (at == kVersion) continue;
    if (std::find(kBrands.begin(), kBrands.end(), bytes.substr(at, 4)) != kBrands.end()) {
      return true;
    }
  }
  return false;
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

std::string decode_heif(std::string_view bytes,
                        const ImageSize& size,
                        const std::filesystem::path& path) {
  // A stream may hold a larger picture than is announced, which must not cost more.
  constexpr size_t kLeast = size_t{256} << 20;
  constexpr size_t kPerPixel = 64;
  IsolationLimits limits;
  limits.memory = kLeast + kPerPixel * static_cast<size_t>(size.width) * size_t(size.height);
  return run_isolated([&] { return pixels_of(PrimaryImage(bytes), size); }, path, limits);
}

std::string heif_exif(std::string_view bytes, const std::filesystem::path& path) {
  return run_isolated([&] { return exif_of(PrimaryImage(bytes)); }, path);
}

HeifProfile heif_profile(std::string_view bytes, const std::filesystem::path& path) {
  const std::string found = run_isolated([&] { return profile_of(PrimaryImage(bytes)); }, path);
  HeifProfile out;
  out.is_display_p3 = found.starts_with(kIsDisplayP3);
  if (found.starts_with(kIsIcc)) out.icc = found.substr(1);
  return out;
}

}  // namespace cgs
