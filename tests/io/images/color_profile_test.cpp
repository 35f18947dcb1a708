// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/color_profile.h"

#include <array>
#include <cmath>

#include <gtest/gtest.h>
#include <lcms2.h>
#include <opencv2/imgcodecs.hpp>

#include "io/images/image.h"
#include "io/images/png.h"
#include "tests/support/exif_segment.h"
#include "tests/support/heif_file.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"
#include "tests/support/tiff_file.h"

namespace cgs::color_profile_test {
namespace {

// With the curve of sRGB.
std::string profile_of(const cmsCIExyYTRIPLE& primaries) {
  const cmsCIExyY white = {0.3127, 0.3290, 1};
  const std::array<double, 5> srgb = {2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045};
  cmsToneCurve* const curve = cmsBuildParametricToneCurve(nullptr, 4, srgb.data());
  const std::array<cmsToneCurve*, 3> curves = {curve, curve, curve};
  const cmsHPROFILE profile = cmsCreateRGBProfile(&white, &primaries, curves.data());
  cmsUInt32Number size = 0;
  cmsSaveProfileToMem(profile, nullptr, &size);
  std::string out(size, '\0');
  cmsSaveProfileToMem(profile, out.data(), &size);
  cmsCloseProfile(profile);
  cmsFreeToneCurve(curve);
  return out;
}

std::string display_p3() {
  return profile_of({{0.680, 0.320, 1}, {0.265, 0.690, 1}, {0.150, 0.060, 1}});
}

std::string srgb() { return profile_of({{0.640, 0.330, 1}, {0.300, 0.600, 1}, {0.150, 0.060, 1}}); }

double linear(double c) { return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4); }
double coded(double c) { return c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055; }

// By the matrices of the two standards (SMPTE EG 432-1 and IEC 61966-2-1), both with white D65.
Eigen::Vector3d srgb_of_p3(const Eigen::Vector3d& p3) {
  Eigen::Matrix3d xyz_from_p3;
  xyz_from_p3 << 0.4865709, 0.2656677, 0.1982173, 0.2289746, 0.6917385, 0.0792869, 0, 0.0451134,
      1.0439444;
  Eigen::Matrix3d srgb_from_xyz;
  srgb_from_xyz << 3.2404542, -1.5371385, -0.4985314, -0.9692660, 1.8760108, 0.0415560, 0.0556434,
      -0.2040259, 1.0572252;
  const Eigen::Vector3d light = srgb_from_xyz * xyz_from_p3 * p3.unaryExpr(&linear);
  return light.unaryExpr(&coded).cwiseMax(0).cwiseMin(1);
}

TEST(ToSrgb, FollowsTheMatricesOfTheStandards) {
  const std::string profile = display_p3();
  for (const Eigen::Vector3f& color : {Eigen::Vector3f(0.5f, 0.5f, 0.5f),
                                       Eigen::Vector3f(0.8f, 0.6f, 0.5f),
                                       Eigen::Vector3f(0.2f, 0.5f, 0.3f),
                                       Eigen::Vector3f(0.05f, 0.02f, 0.03f),
                                       Eigen::Vector3f(0.9176f, 0.2f, 0.1373f),
                                       Eigen::Vector3f(0, 1, 0)}) {
    ColorImage image(3, 2, color);
    to_srgb(profile, image);
    const Eigen::Vector3d expected = srgb_of_p3(color.cast<double>());
    for (const Eigen::Vector3f& found : image.data) {
      EXPECT_LT((found.cast<double>() - expected).cwiseAbs().maxCoeff(), 1.5 / 255)
          << color.transpose() << " -> " << found.transpose() << ", not " << expected.transpose();
    }
  }
}

TEST(ToSrgb, ChangesNoBitOfWhatIsSrgbNorByWhatIsNoProfile) {
  const std::string good = srgb();
  for (const std::string& profile :
       {good, std::string(), std::string("nothing"), good.substr(0, 100), std::string(500, '\0')}) {
    ColorImage image(2, 1, Eigen::Vector3f(0.3f, 0.7f, 0.1f));
    to_srgb(profile, image);
    EXPECT_EQ(image.data[0], Eigen::Vector3f(0.3f, 0.7f, 0.1f));
  }
}

// Of inks whose mixtures lie on straight lines between the colours of the 16 full ones: no ink is
// white, and each takes its part of the light; black takes all.
std::string ink_profile() {
  const cmsHPROFILE profile = cmsCreateProfilePlaceholder(nullptr);
  cmsSetProfileVersion(profile, 2.1);  // whose tables of 16 bits need no curves
  cmsSetDeviceClass(profile, cmsSigOutputClass);
  cmsSetColorSpace(profile, cmsSigCmykData);
  cmsSetPCS(profile, cmsSigLabData);
  cmsPipeline* const pipeline = cmsPipelineAlloc(nullptr, 4, 3);
  const auto sample = [](const cmsUInt16Number* in, cmsUInt16Number* out, void*) {
    const auto has = [&](int ink) { return in[ink] > 0x7fff; };
    const cmsCIELab lab = {has(3) ? 0.0 : 100.0 - 20 * (has(0) + has(1) + has(2)), 0, 0};
    cmsFloat2LabEncodedV2(out, &lab);
    return 1;
  };
  cmsStage* const table = cmsStageAllocCLut16bit(nullptr, 2, 4, 3, nullptr);
  cmsStageSampleCLut16bit(table, sample, nullptr, 0);
  cmsPipelineInsertStage(pipeline, cmsAT_END, table);
  cmsWriteTag(profile, cmsSigAToB0Tag, pipeline);
  cmsWriteTag(profile, cmsSigAToB1Tag, pipeline);
  cmsPipelineFree(pipeline);
  cmsUInt32Number size = 0;
  cmsSaveProfileToMem(profile, nullptr, &size);
  std::string out(size, '\0');
  cmsSaveProfileToMem(profile, out.data(), &size);
  cmsCloseProfile(profile);
  return out;
}

// The grey of a lightness (CIE 15): the curve of L*, then that of sRGB.
double grey_of(double lightness) { return coded(std::pow((lightness + 16) / 116, 3)); }

TEST(SrgbOfInks, FollowsTheProfile) {
  InkImage inks(5, 1, {});
  inks(1, 0) = {1, 0, 0, 0};
  inks(2, 0) = {1, 1, 0, 0};
  inks(3, 0) = {0.5f, 0, 0, 0};  // half-way: L* = 90
  inks(4, 0) = {0, 0, 0, 1};
  const ColorImage found = srgb_of_inks(ink_profile(), inks);
  const std::array<double, 5> expected = {1, grey_of(80), grey_of(60), grey_of(90), 0};
  for (int i = 0; i < 5; ++i) {
    EXPECT_LT((found(i, 0).array() - float(expected[size_t(i)])).abs().maxCoeff(), 1.5 / 255) << i;
  }
  // No profile, or one of other colours: plain mixing.
  for (const std::string& profile : {std::string(), srgb(), std::string("nothing")}) {
    EXPECT_LT((srgb_of_inks(profile, inks)(2, 0) - Eigen::Vector3f(0, 0, 1)).norm(), 1e-6);
  }
}

TEST(SrgbOfInks, IsAskedByFilesOfInks) {
  const test::TempDir dir;
  const std::string profile = ink_profile();
  test::TiffTag tag{34675, 1, {}};
  for (const char c : profile) tag.values.push_back(static_cast<unsigned char>(c));
  for (const uint32_t bytes : {1U, 2U}) {
    const std::string ink = std::string(bytes, '\xff') + std::string(3 * bytes, '\0');  // cyan
    test::write_bytes(
        dir / "a.tif",
        test::tiff_file(test::with_tags(test::tiff_tags(1, 1, 4, 8 * bytes, 5), {tag}), {ink}));
    EXPECT_LT((read_image(dir / "a.tif")(0, 0).array() - float(grey_of(80))).abs().maxCoeff(),
              1.5 / 255);
    EXPECT_LT(
        (decode_image(test::read_bytes(dir / "a.tif"), "a.tif")(0, 0) - Eigen::Vector3f(0, 1, 1))
            .norm(),
        1e-6);
  }
}

/// Files of one colour that say Display P3.
class ProfileIn : public testing::Test {
 protected:
  void expect_converted(const std::string& name, const std::string& bytes, double error = 1.5) {
    test::write_bytes(dir_ / name, bytes);
    EXPECT_EQ(color_profile(bytes, name), profile_);
    const ColorImage found = read_image(dir_ / name);
    const Eigen::Vector3d expected = srgb_of_p3(kColor.cast<double>());
    EXPECT_LT((found(8, 6).cast<double>() - expected).cwiseAbs().maxCoeff(), error / 255) << name;
    const ColorImage plain = decode_image(bytes, name);
    EXPECT_LT((plain(8, 6) - kColor).cwiseAbs().maxCoeff(), error / 255) << name;
  }
  const Eigen::Vector3f kColor = Eigen::Vector3f(204, 102, 51) / 255.0f;
  const ColorImage picture_ = ColorImage(16, 12, kColor);
  const std::string profile_ = display_p3();
  test::TempDir dir_;
};

TEST_F(ProfileIn, Png) {
  write_png(dir_ / "plain.png", picture_);
  std::string png = test::read_bytes(dir_ / "plain.png");
  constexpr size_t kAfterHeader = 8 + 25;
  png.insert(kAfterHeader,
             test::png_chunk("iCCP", std::string("P3\0\0", 4) + test::deflated(profile_)));
  expect_converted("a.png", png);
}

TEST_F(ProfileIn, JpegInParts) {
  const cv::Mat pixels(12, 16, CV_8UC3, cv::Scalar(51, 102, 204));
  std::vector<unsigned char> coded_bytes;
  cv::imencode(".jpg", pixels, coded_bytes, {cv::IMWRITE_JPEG_QUALITY, 100});
  std::string jpeg(coded_bytes.begin(), coded_bytes.end());
  const auto part = [&](char number, const std::string& data) {
    const std::string body = std::string("ICC_PROFILE\0", 12) + number + '\2' + data;
    return "\xff\xe2" + test::exif_number(uint32_t(body.size()) + 2, 2, true) + body;
  };
  // In any order.
  jpeg.insert(2, part('\2', profile_.substr(200)) + part('\1', profile_.substr(0, 200)));
  expect_converted("a.jpg", jpeg, 2.5);
}

TEST_F(ProfileIn, Heic) {
  expect_converted("a.heic", test::heif(picture_, {.profile = profile_}), 4);
}

TEST_F(ProfileIn, WebpAndTiff) {
  const auto n32 = [](size_t value) { return test::exif_number(uint32_t(value), 4, false); };
  const std::string padding(profile_.size() % 2, '\0');
  const std::string chunks = "WEBPICCP" + n32(profile_.size()) + profile_ + padding;
  EXPECT_EQ(
      color_profile("RIFF" + n32(chunks.size()) + chunks, "a.webp").substr(0, profile_.size()),
      profile_);
  const auto n16 = [](uint32_t value) { return test::exif_number(value, 2, false); };
  const std::string tiff = "II" + n16(42) + n32(8) + n16(1) + n16(34675) + n16(7) +
                           n32(profile_.size()) + n32(26) + n32(0) + profile_;
  EXPECT_EQ(color_profile(tiff, "a.tif"), profile_);
}

// What is cut says nothing here: of the picture its decoder tells.
TEST_F(ProfileIn, FilesThatAreCut) {
  const std::string heic = test::heif(picture_, {.profile = profile_});
  for (const std::string& whole : {test::jpeg(16, 12), test::rgb_png(16, 12), heic}) {
    for (size_t size = 0; size < whole.size(); size += 1 + whole.size() / 50) {
      EXPECT_NO_THROW((void)color_profile(whole.substr(0, size), "cut"));
    }
  }
}

}  // namespace
}  // namespace cgs::color_profile_test
