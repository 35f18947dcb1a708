// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/image.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <mutex>
#include <new>
#include <span>
#include <string>
#include <vector>

#include <fcntl.h>
#include <opencv2/imgcodecs.hpp>
#include <unistd.h>

#include "io/bytes/lack_of_memory.h"
#include "io/images/color_profile.h"
#include "io/images/heif.h"
#include "io/images/image_header.h"
#include "io/images/jpeg.h"
#include "io/images/tiff_pixels.h"
#include "libcgs/core/opencv_memory.h"

namespace cgs {

namespace {

bool is_all_usable(const MaskMap& usable) {
  return std::all_of(usable.data.begin(), usable.data.end(), [](uint8_t set) { return set != 0; });
}

ColorImage from_bytes(const ImageHeader& header, const char* samples, int channels) {
  ColorImage image(header.width, header.height, Eigen::Vector3f::Zero());
  const auto* p = reinterpret_cast<const unsigned char*>(samples);
  for (Eigen::Vector3f& color : image.data) {
    color = Eigen::Vector3f(p[0], p[1], p[2]) / 255.0f;
    p += channels;
  }
  return image;
}

ColorImage read_heif(std::string_view bytes,
                     const ImageHeader& header,
                     const std::filesystem::path& path,
                     MaskMap* alpha_mask) {
  const std::string samples = decode_heif(bytes, {header.width, header.height}, path);
  const size_t pixels = size_t(header.width) * size_t(header.height);
  if (samples.size() == 3 * pixels) return from_bytes(header, samples.data(), 3);
  if (samples.size() != 4 * pixels) {
    throw BadInput(Defect::Syntax, path, "the decoded image is not what its header announces");
  }
  constexpr unsigned char kHalf = 128;
  MaskMap usable(header.width, header.height, 1);
  for (size_t i = 0; i < pixels; ++i) {
    usable.data[i] = static_cast<unsigned char>(samples[4 * i + 3]) >= kHalf ? 1 : 0;
  }
  if (alpha_mask != nullptr && !is_all_usable(usable)) *alpha_mask = std::move(usable);
  return from_bytes(header, samples.data(), 4);
}

ColorImage read_jpeg(std::string_view bytes,
                     const ImageHeader& header,
                     std::string_view profile,
                     const std::filesystem::path& path) {
  const JpegPixels pixels = decode_jpeg(bytes, header, path);
  if (pixels.channels == 3) return from_bytes(header, pixels.samples.data(), 3);
  InkImage inks(header.width, header.height, {});
  const auto* p = reinterpret_cast<const unsigned char*>(pixels.samples.data());
  for (auto& ink : inks.data) {
    for (float& amount : ink) amount = float(255 - *p++) / 255.0f;
  }
  return srgb_of_inks(profile, inks);
}

/// Sends standard error nowhere while any of its kind lives: the decoders behind OpenCV print their
/// complaints and offer no way to take them. The first redirects, the last restores, as several
/// threads decode at once.
class Silence {
 public:
  Silence() {
    const std::lock_guard lock(mutex_);
    if (count_++ > 0) return;
    saved_ = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
    const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (saved_ >= 0 && nowhere >= 0) ::dup2(nowhere, STDERR_FILENO);
    if (nowhere >= 0) ::close(nowhere);
  }
  ~Silence() {
    const std::lock_guard lock(mutex_);
    if (--count_ > 0 || saved_ < 0) return;
    ::dup2(saved_, STDERR_FILENO);
    ::close(saved_);
  }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  static inline std::mutex mutex_;
  static inline int count_ = 0;
  static inline int saved_ = -1;
};

// Decoders tell a lack of memory as they tell damage, or abort: throws std::bad_alloc before. What
// small allocations fail in spite of it is seen by errno afterwards.
void ensure_memory_to_decode(const ImageHeader& header) {
  constexpr size_t kBytesPerPixel = 16;  // four channels of 16 bits, and as much to work with
  constexpr size_t kTables = size_t{16} << 20;
  const size_t pixels = size_t(header.width) * size_t(header.height);
  // Called by name, so that no compiler leaves it out. Unwritten memory is only address space.
  ::operator delete(::operator new(kBytesPerPixel* pixels + kTables));
}

cv::Mat decode_with_opencv(std::string_view bytes,
                           const ImageHeader& header,
                           const std::filesystem::path& path) {
  ensure_memory_to_decode(header);
  const cv::Mat buffer(1,
                       static_cast<int>(bytes.size()),
                       CV_8UC1,
                       const_cast<char*>(bytes.data()));  // NOLINT: OpenCV has no const matrix
  const auto refuse = [&](Defect defect, const char* what) {
    throw_if_memory_ran_out();
    throw BadInput(defect, path, what);
  };
  cv::Mat pixels;
  errno = 0;
  try {
    const Silence silence;
    // Unchanged keeps 16 bits and alpha.
    pixels = cv::imdecode(buffer, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& error) {
    throw_if_out_of_memory(error);
    refuse(Defect::Syntax, "the image decoder refused the content");
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception&) {
    refuse(Defect::Syntax, "the image decoder refused the content");
  }
  if (pixels.empty()) refuse(Defect::Truncated, "the pixels are cut or damaged");
  return pixels;
}

std::string read_image_file(const std::filesystem::path& path, const ReadLimits& limits) {
  constexpr uint64_t kDecoderLimit = (uint64_t{1} << 31) - 1;  // OpenCV counts bytes in int
  ReadLimits file_limits = limits;
  file_limits.max_file_bytes = std::min(limits.max_file_bytes, kDecoderLimit);
  return read_file(path, file_limits);
}

cv::Mat decode_as_announced(std::string_view bytes,
                            const ImageHeader& header,
                            const std::filesystem::path& path) {
  cv::Mat pixels = header.orientation == 1
                       ? decode_with_opencv(bytes, header, path)
                       : decode_with_opencv(upright_tiff(bytes, path), header, path);
  if (pixels.cols != header.width || pixels.rows != header.height || pixels.channels() > 4) {
    throw BadInput(Defect::Syntax, path, "the decoded image is not what its header announces");
  }
  return pixels;
}

template <typename T>
Raster<float> first_channel(const cv::Mat& pixels) {
  Raster<float> out(pixels.cols, pixels.rows, 0);
  for (int y = 0; y < out.height; ++y) {
    const T* p = pixels.ptr<T>(y);
    for (int x = 0; x < out.width; ++x, p += pixels.channels()) {
      out(x, y) = static_cast<float>(*p);
    }
  }
  return out;
}

// Copies samples of type T, OpenCV's BGR order, scaled by 1 / full. \return usable pixels
template <typename T>
void convert(const cv::Mat& pixels, double full, ColorImage& image, MaskMap& usable) {
  const int channels = pixels.channels();
  const bool has_alpha = channels == 2 || channels == 4;
  const int blue = 0;
  const int green = channels >= 3 ? 1 : 0;
  const int red = channels >= 3 ? 2 : 0;
  for (int y = 0; y < image.height; ++y) {
    const T* p = pixels.ptr<T>(y);
    for (int x = 0; x < image.width; ++x, p += channels) {
      const auto sample = [&](int c) { return static_cast<float>(double(p[c]) / full); };
      const Eigen::Vector3f color(sample(red), sample(green), sample(blue));
      const bool is_usable = color.allFinite() && (!has_alpha || sample(channels - 1) >= 0.5f);
      usable(x, y) = is_usable ? 1 : 0;
      for (int c = 0; c < 3; ++c) {
        image(x, y)[c] = std::isfinite(color[c]) ? std::clamp(color[c], 0.0f, 1.0f) : 0.0f;
      }
    }
  }
}

ColorImage read_with_opencv(std::string_view bytes,
                            const ImageHeader& header,
                            const std::filesystem::path& path,
                            MaskMap& usable) {
  const cv::Mat pixels = decode_as_announced(bytes, header, path);
  ColorImage image(header.width, header.height, Eigen::Vector3f::Zero());
  switch (pixels.depth()) {
    case CV_8U:
      convert<uint8_t>(pixels, 255, image, usable);
      break;
    case CV_16U:
      convert<uint16_t>(pixels, 65535, image, usable);
      break;
    case CV_32F:
      convert<float>(pixels, 1, image, usable);
      break;
    case CV_64F:
      convert<double>(pixels, 1, image, usable);
      break;
    default:
      throw BadInput(Defect::Unsupported, path, "signed whole-number samples are not read");
  }
  return image;
}

Eigen::Vector3f color_of(const TiffForm& form, std::span<const float> samples) {
  const double full = form.full();
  const auto part = [&](size_t c) { return static_cast<float>(double(samples[c]) / full); };
  switch (form.kind) {
    case TiffForm::Kind::Rgb:
      return {part(0), part(1), part(2)};
    case TiffForm::Kind::White:
      return Eigen::Vector3f::Constant(1 - part(0));
    case TiffForm::Kind::Palette:
      return Eigen::Map<const Eigen::Vector3f>(form.palette[size_t(samples[0])].data());
    case TiffForm::Kind::Lab: {
      // Lightness up to 100; the others with a sign, of 16 bits in parts of 256.
      const auto opponent = [&](float value) {
        return (value <= full / 2 ? value : value - float(full) - 1) / (form.bits == 8 ? 1 : 256);
      };
      return {100 * part(0), opponent(samples[1]), opponent(samples[2])};
    }
    default:
      return Eigen::Vector3f::Constant(part(0));
  }
}

ColorImage read_tiff(const TiffPixels& tiff,
                     const ImageHeader& header,
                     std::string_view profile,
                     MaskMap& usable) {
  const TiffForm& form = tiff.form();
  const bool has_inks = form.kind == TiffForm::Kind::Inks;
  ColorImage image;  // made when the first pixels are there: headers promise much
  InkImage inks;
  const auto within = [](float value) {
    return std::isfinite(value) ? std::clamp(value, 0.0f, 1.0f) : 0.0f;
  };
  tiff.read([&](int x, int y, std::span<const float> row) {
    if (image.empty() && inks.empty()) {
      if (has_inks) inks = InkImage(header.width, header.height, {});
      if (!has_inks) image = ColorImage(header.width, header.height, Eigen::Vector3f::Zero());
    }
    for (; !row.empty(); ++x, row = row.subspan(size_t(form.channels))) {
      float opacity = 1;
      if (form.alpha >= 0) opacity = float(double(row[size_t(form.alpha)]) / form.full());
      bool is_usable = opacity >= 0.5f;
      if (has_inks) {
        for (size_t c = 0; c < 4; ++c) inks(x, y)[c] = within(float(double(row[c]) / form.full()));
      } else {
        Eigen::Vector3f color = color_of(form, row);
        is_usable = is_usable && color.allFinite();
        if (form.is_premultiplied && opacity > 0) color /= opacity;
        if (form.kind != TiffForm::Kind::Lab) color = color.unaryExpr(within).eval();
        image(x, y) = color;
      }
      usable(x, y) = is_usable ? 1 : 0;
    }
  });
  if (form.kind == TiffForm::Kind::Lab) lab_to_srgb(image);
  return has_inks ? srgb_of_inks(profile, inks) : image;
}

StoredSamples samples_of_tiff(const TiffPixels& tiff,
                              const ImageHeader& header,
                              const std::filesystem::path& path) {
  const TiffForm& form = tiff.form();
  const bool is_grey = form.kind == TiffForm::Kind::Grey || form.kind == TiffForm::Kind::White;
  if (!is_grey || form.channels > 2) {
    throw BadInput(Defect::Unsupported, path, "holds colours, expected one value per pixel");
  }
  StoredSamples out;
  if (!form.is_float && form.bits <= 16) out.whole_bits = form.bits <= 8 ? 8 : 16;
  tiff.read([&](int x, int y, std::span<const float> row) {
    if (out.values.empty()) out.values = Raster<float>(header.width, header.height, 0);
    for (size_t i = 0; i < row.size(); i += size_t(form.channels)) out.values(x++, y) = row[i];
  });
  return out;
}

ColorImage decoded(std::string_view bytes,
                   std::string_view profile,
                   const std::filesystem::path& path,
                   MaskMap* alpha_mask,
                   const ReadLimits& limits) {
  const ImageHeader header = parse_image_header(bytes, path, limits);
  check_image_is_whole(bytes, header, path);
  if (alpha_mask != nullptr) *alpha_mask = {};
  if (header.format == ImageFormat::Jpeg) return read_jpeg(bytes, header, profile, path);
  if (header.format == ImageFormat::Heif) return read_heif(bytes, header, path, alpha_mask);
  MaskMap usable(header.width, header.height, 1);
  ColorImage image;
  if (header.format == ImageFormat::Tiff) {
    const TiffPixels tiff(bytes, header, path);
    if (tiff.is_read()) image = read_tiff(tiff, header, profile, usable);
  }
  if (image.empty()) image = read_with_opencv(bytes, header, path, usable);
  if (alpha_mask != nullptr && !is_all_usable(usable)) *alpha_mask = std::move(usable);
  return image;
}

}  // namespace

ImageSize image_size(const std::filesystem::path& path, const ReadLimits& limits) {
  constexpr uint64_t kUsuallyEnough = uint64_t{256} << 10;
  ImageHeader header;
  const std::string start = read_file_start(path, kUsuallyEnough);
  try {
    header = parse_image_header(start, path, limits);
  } catch (const BadInput&) {
    // Large metadata, or a TIFF directory at the end: only the whole file can tell.
    if (start.size() < kUsuallyEnough) throw;
    header = parse_image_header(read_file(path, limits), path, limits);
  }
  return {header.width, header.height};
}

ColorImage read_image(const std::filesystem::path& path,
                      MaskMap* alpha_mask,
                      const ReadLimits& limits) {
  const std::string bytes = read_image_file(path, limits);
  const std::string profile = color_profile(bytes, path);
  ColorImage image = decoded(bytes, profile, path, alpha_mask, limits);
  to_srgb(profile, image);
  return image;
}

ColorImage decode_image(std::string_view bytes,
                        const std::filesystem::path& path,
                        MaskMap* alpha_mask,
                        const ReadLimits& limits) {
  return decoded(bytes, "", path, alpha_mask, limits);
}

StoredSamples read_samples(const std::filesystem::path& path, const ReadLimits& limits) {
  const std::string bytes = read_image_file(path, limits);
  const ImageHeader header = parse_image_header(bytes, path, limits);
  check_image_is_whole(bytes, header, path);
  if (header.format != ImageFormat::Png && header.format != ImageFormat::Tiff) {
    throw BadInput(Defect::Unsupported, path, "only PNG and TIFF keep values as they are");
  }
  if (header.format == ImageFormat::Tiff) {
    const TiffPixels tiff(bytes, header, path);
    if (tiff.is_read()) return samples_of_tiff(tiff, header, path);
  }
  const cv::Mat pixels = decode_as_announced(bytes, header, path);
  if (pixels.channels() > 2) {
    throw BadInput(Defect::Unsupported, path, "holds colours, expected one value per pixel");
  }
  switch (pixels.depth()) {
    case CV_8U:
      return {first_channel<uint8_t>(pixels), 8};
    case CV_16U:
      return {first_channel<uint16_t>(pixels), 16};
    case CV_32F:
      return {first_channel<float>(pixels), 0};
    case CV_64F:
      return {first_channel<double>(pixels), 0};
    default:
      throw BadInput(Defect::Unsupported, path, "signed whole-number samples are not read");
  }
}

}  // namespace cgs
