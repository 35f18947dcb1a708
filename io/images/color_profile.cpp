// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/color_profile.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <map>
#include <memory>
#include <new>
#include <type_traits>
#include <vector>

#include <lcms2.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "io/bytes/byte_reader.h"
#include "io/bytes/compression.h"
#include "io/bytes/lack_of_memory.h"
#include "io/images/heif.h"
#include "io/images/image_chunks.h"
#include "io/images/tiff_directory.h"

namespace cgs {

namespace {

using std::string_view_literals::operator""sv;

constexpr size_t kLargestProfile = size_t{4}
                                   << 20;  // [bytes] printers' have 1 to 2 MB, cameras' less

// In parts of at most 64 KiB, each with its number and how many there are.
std::string of_jpeg(std::string_view bytes, const std::filesystem::path& path) {
  constexpr std::string_view kPartName = "ICC_PROFILE\0"sv;
  constexpr int kApp2 = 0xe2;
  ByteReader file(bytes, path);
  std::map<int, std::string_view> parts;
  size_t total = 0;
  visit_jpeg_segments(file, [&](int marker, std::string_view body) {
    const bool is_part =
        marker == kApp2 && body.starts_with(kPartName) && body.size() >= kPartName.size() + 2;
    if (!is_part) return true;
    const std::string_view part = body.substr(kPartName.size() + 2);
    total += part.size();
    parts.emplace(static_cast<unsigned char>(body[kPartName.size()]), part);
    return total <= kLargestProfile;
  });
  if (total > kLargestProfile) return "";
  std::string out;
  for (const auto& [number, part] : parts) out += part;
  return out;
}

std::string profile_of_png(std::string_view bytes, const std::filesystem::path& path) {
  std::string out;
  visit_png_chunks(bytes, path, [&](std::string_view name, std::string_view body) {
    if (name != "iCCP") return true;
    const size_t end = body.find('\0');  // of the profile's name; then the method: deflate
    if (end == std::string_view::npos || end + 2 > body.size()) return false;
    out = inflate(body.substr(end + 2),
                  DeflateWrapping::Zlib,
                  SizeRange{0, kLargestProfile},
                  path,
                  "PNG colour profile");
    return false;
  });
  return out;
}

std::string profile_of_webp(std::string_view bytes, const std::filesystem::path& path) {
  std::string out;
  visit_webp_chunks(bytes, path, [&](std::string_view name, std::string_view body) {
    if (name == "ICCP") out = body.substr(0, kLargestProfile);
    return out.empty();
  });
  return out;
}

std::string profile_of_tiff(std::string_view bytes, const std::filesystem::path& path) {
  constexpr uint16_t kProfile = 34675;
  const auto field = TiffDirectory(bytes, path).field(kProfile);
  return field && field->bytes.size() <= kLargestProfile ? std::string(field->bytes) : "";
}

struct CloseProfile {
  void operator()(void* profile) const { cmsCloseProfile(profile); }
};
struct DeleteTransform {
  void operator()(void* transform) const { cmsDeleteTransform(transform); }
};
using Profile = std::unique_ptr<void, CloseProfile>;
using Transform = std::unique_ptr<void, DeleteTransform>;

// The library says null to damage and to a lack of memory alike.
template <typename Handle>
Handle made(cmsHANDLE handle) {
  if (handle == nullptr) throw_if_memory_ran_out();
  return Handle(handle);
}

std::string display_p3() {
  const cmsCIExyY white = {0.3127, 0.3290, 1};
  const cmsCIExyYTRIPLE primaries = {{0.680, 0.320, 1}, {0.265, 0.690, 1}, {0.150, 0.060, 1}};
  const std::array<double, 5> srgb = {2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045};
  cmsToneCurve* const curve = cmsBuildParametricToneCurve(nullptr, 4, srgb.data());
  const std::array<cmsToneCurve*, 3> curves = {curve, curve, curve};
  const auto profile = made<Profile>(cmsCreateRGBProfile(&white, &primaries, curves.data()));
  cmsFreeToneCurve(curve);
  cmsUInt32Number size = 0;
  if (!profile || cmsSaveProfileToMem(profile.get(), nullptr, &size) == 0) return "";
  std::string out(size, '\0');
  return cmsSaveProfileToMem(profile.get(), out.data(), &size) != 0 ? out : "";
}

// Whether a transform leaves colours as they are, but for rounding of a profile's tables.
bool is_identity(const Transform& transform) {
  constexpr int kSteps = 5;
  constexpr float kSame = 1.0f / 255;
  for (int i = 0; i < kSteps * kSteps * kSteps; ++i) {
    const Eigen::Vector3i step(i % kSteps, i / kSteps % kSteps, i / kSteps / kSteps);
    const Eigen::Vector3f in = step.cast<float>() / float(kSteps - 1);
    Eigen::Vector3f out;
    cmsDoTransform(transform.get(), in.data(), out.data(), 1);
    if (!((out - in).cwiseAbs().maxCoeff() <= kSame)) return false;
  }
  return true;
}

// Null where there is no profile, or one of another space.
Transform transform_to_srgb(const Profile& from,
                            cmsColorSpaceSignature space,
                            cmsUInt32Number format) {
  if (!from || cmsGetColorSpace(from.get()) != space) return nullptr;
  const auto srgb = made<Profile>(cmsCreate_sRGBProfile());
  if (!srgb) return nullptr;
  return made<Transform>(cmsCreateTransform(from.get(),
                                            format,
                                            srgb.get(),
                                            TYPE_RGB_FLT,
                                            INTENT_RELATIVE_COLORIMETRIC,
                                            cmsFLAGS_NOCACHE));
}

Transform transform_to_srgb(std::string_view bytes,
                            cmsColorSpaceSignature space,
                            cmsUInt32Number format) {
  if (bytes.empty()) return nullptr;
  errno = 0;
  return transform_to_srgb(made<Profile>(cmsOpenProfileFromMem(
                               bytes.data(), static_cast<cmsUInt32Number>(bytes.size()))),
                           space,
                           format);
}

void clamp_colors(Eigen::Vector3f* colors, size_t count) {
  for (size_t i = 0; i < count; ++i) {
    for (float& c : colors[i]) c = c > 0 ? std::min(c, 1.0f) : 0.0f;  // also what is no number
  }
}

// In place.
void transform_colors(const Transform& transform, ColorImage& image) {
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
  tbb::parallel_for(tbb::blocked_range<size_t>(0, image.data.size(), 4096), [&](const auto& range) {
    Eigen::Vector3f* const colors = image.data.data() + range.begin();
    cmsDoTransform(transform.get(),
                   colors->data(),
                   colors->data(),
                   static_cast<cmsUInt32Number>(range.size()));
    clamp_colors(colors, range.size());
  });
}

}  // namespace

std::string color_profile(std::string_view bytes, const std::filesystem::path& path) {
  try {
    if (bytes.starts_with("\xff\xd8")) return of_jpeg(bytes, path);
    if (bytes.starts_with("\x89PNG")) return profile_of_png(bytes, path);
    if (bytes.starts_with("RIFF")) return profile_of_webp(bytes, path);
    if (bytes.starts_with("II") || bytes.starts_with("MM")) return profile_of_tiff(bytes, path);
    if (!is_heif(bytes)) return "";
    const HeifProfile found = heif_profile(bytes, path);
    return found.is_display_p3 ? display_p3() : found.icc;
  } catch (const BadInput&) {
    return "";
  }
}

void to_srgb(std::string_view bytes, ColorImage& image) {
  const Transform transform = transform_to_srgb(bytes, cmsSigRgbData, TYPE_RGB_FLT);
  if (transform && !is_identity(transform)) transform_colors(transform, image);
}

void lab_to_srgb(ColorImage& image) {
  errno = 0;
  const auto transform =
      transform_to_srgb(made<Profile>(cmsCreateLab4Profile(nullptr)), cmsSigLabData, TYPE_Lab_FLT);
  if (!transform) throw std::bad_alloc();  // nothing else can fail
  transform_colors(transform, image);
}

ColorImage srgb_of_inks(std::string_view profile, const InkImage& inks) {
  ColorImage out(inks.width, inks.height, Eigen::Vector3f::Zero());
  const Transform transform = transform_to_srgb(profile, cmsSigCmykData, TYPE_CMYK_FLT);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, out.data.size(), 4096), [&](const auto& range) {
    Eigen::Vector3f* const colors = out.data.data() + range.begin();
    const std::array<float, 4>* const from = inks.data.data() + range.begin();
    if (!transform) {
      for (size_t i = 0; i < range.size(); ++i) {
        const auto& [c, m, y, k] = from[i];
        colors[i] = (1 - k) * Eigen::Vector3f(1 - c, 1 - m, 1 - y);
      }
      return;
    }
    std::vector<std::array<float, 4>> percent(from, from + range.size());  // as lcms counts inks
    for (auto& ink : percent) {
      for (float& amount : ink) amount *= 100;
    }
    cmsDoTransform(transform.get(),
                   percent.data(),
                   colors->data(),
                   static_cast<cmsUInt32Number>(range.size()));
    clamp_colors(colors, range.size());
  });
  return out;
}

}  // namespace cgs
