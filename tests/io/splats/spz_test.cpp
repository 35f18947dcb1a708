// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/spz.h"

#include <cmath>

#include <gtest/gtest.h>
#include <zlib.h>

#include "io/splats/splat_reader.h"
#include "io/splats/spz_reader.h"
#include "libcgs/render/spherical_harmonics.h"
#include "tests/support/full_disk.h"
#include "tests/support/sample_mesh.h"
#include "tests/support/sample_splats.h"

namespace cgs::spz_test {
namespace {

/// The bytes of a gzip file by zlib's own reader.
std::string unzipped(const std::filesystem::path& path) {
  gzFile file = gzopen(path.c_str(), "rb");
  std::string out(size_t{1} << 20, '\0');
  const int n = gzread(file, out.data(), static_cast<unsigned>(out.size()));
  gzclose(file);
  out.resize(static_cast<size_t>(std::max(n, 0)));
  return out;
}

TEST(Spz, ComesBackWithinHalfAStep) {
  const Frame frame = test::centimetre_frame();
  for (const int version : {2, 3}) {
    for (const int degree : {0, 3}) {
      const test::TempDir dir;
      const Gaussians g = test::varied_splats(500, degree);
      const SpzReport report = write_spz(dir / "a.spz", g, frame, {.version = version});
      EXPECT_EQ(report.clamped, 0u);
      EXPECT_EQ(report.bytes, std::filesystem::file_size(dir / "a.spz"));
      Frame back_frame = frame;
      const GaussianFile back = read_splats(dir / "a.spz", back_frame);
      ASSERT_EQ(back.gaussians.size(), g.size());
      const double half = std::ldexp(0.5, -report.fractional_bits) / frame.scale * 1.001 + 1e-7;
      for (size_t i = 0; i < g.size(); ++i) {
        EXPECT_LT((back.gaussians.position[i] - g.position[i]).cwiseAbs().maxCoeff(), half);
        const Eigen::Array3f ratio = back.gaussians.scale[i].array() / g.scale[i].array();
        EXPECT_LT(ratio.log().abs().maxCoeff(), 0.5f / 16 * 1.001f);
        EXPECT_LT(std::abs(back.gaussians.opacity[i] - g.opacity[i]), 0.5f / 255 * 1.001f);
        // Three entries within half a step each; the fourth follows, badly where it is small.
        EXPECT_LT(test::angle_between(back.gaussians.rotation[i], g.rotation[i]),
                  version == 3 ? 0.004 : 0.3);
      }
      for (size_t k = 0; k < g.sh.size(); ++k) {
        const bool constant = k % static_cast<size_t>(g.sh_count()) == 0;
        const float step = constant ? 1 / (255 * 0.15f) : 1.0f / 128;
        EXPECT_LT((back.gaussians.sh[k] - g.sh[k]).cwiseAbs().maxCoeff(), 0.5f * step * 1.001f);
      }
    }
  }
}

// The file is in right-up-back axes: colours must be those of the same splat seen in them.
TEST(Spz, TurnsHarmonicsWithTheAxes) {
  const test::TempDir dir;
  const Gaussians g = test::varied_splats(4, 3);
  write_spz(dir / "a.spz", g, Frame{});
  const std::string bytes = unzipped(dir / "a.spz");
  const size_t at = 16 + 4 * (9 + 1 + 3 + 3 + 4);
  ASSERT_EQ(bytes.size(), at + 4 * 45);
  const Eigen::Vector3f direction = Eigen::Vector3f(0.3f, -0.8f, 0.5f).normalized();
  const Eigen::Vector3f turned(direction.x(), -direction.y(), -direction.z());
  for (size_t i = 0; i < 4; ++i) {
    std::vector<Eigen::Vector3f> in_file = {g.sh[16 * i]};
    for (size_t k = 0; k < 15; ++k) {
      Eigen::Vector3f c = Eigen::Vector3f::Zero();
      for (size_t channel = 0; channel < 3; ++channel) {
        const auto byte = static_cast<uint8_t>(bytes[at + 45 * i + 3 * k + channel]);
        c[static_cast<int>(channel)] = (static_cast<float>(byte) - 128) / 128;
      }
      in_file.push_back(c);
    }
    const Eigen::Vector3f expected = sh_color({g.sh.data() + 16 * i, 16}, 3, direction);
    EXPECT_LT((sh_color(in_file, 3, turned) - expected).norm(), 0.05f);
  }
}

TEST(Spz, StandsUprightWhereAsked) {
  const test::TempDir dir;
  Gaussians g = test::varied_splats(40, 3);
  for (Eigen::Vector3f& c : g.sh) c *= 0.3f;  // turned, none may grow beyond what a byte holds
  const Eigen::Matrix3d y_up = Eigen::Quaterniond(0.4, -0.3, 0.8, 0.1).normalized().matrix();
  write_spz(dir / "a.spz", g, Frame{});
  write_spz(dir / "b.spz", g, Frame{}, {.y_up = y_up});
  const RawSplats usual = parse_spz(test::read_bytes(dir / "a.spz"), dir / "a.spz");
  const RawSplats turned = parse_spz(test::read_bytes(dir / "b.spz"), dir / "b.spz");
  const Eigen::Matrix3d axes = Eigen::Vector3d(1, -1, -1).asDiagonal();
  const Eigen::Matrix3d turn = axes * y_up;  // as it is read
  for (size_t i = 0; i < g.size(); ++i) {
    EXPECT_LT((turned.position[i] - turn * usual.position[i]).norm(), 1e-4);
    const Eigen::Matrix3d shape = turn * test::covariance_of(usual, i) * turn.transpose();
    EXPECT_LT((test::covariance_of(turned, i) - shape).norm(), 0.02 * shape.norm());
    const Eigen::Vector3d d = Eigen::Vector3d(0.3, -0.5, 0.8).normalized();
    const auto shown = [&](const RawSplats& splats, const Eigen::Vector3d& direction) {
      return sh_color({splats.sh.data() + 16 * i, 16}, 3, direction.cast<float>());
    };
    EXPECT_LT((shown(turned, turn * d) - shown(usual, d)).norm(), 0.05f);
  }
  EXPECT_THROW(write_spz(dir / "c.spz", g, Frame{}, {.y_up = 2 * y_up}), InvalidInput);
}

TEST(Spz, FitsTheFractionalBitsToTheScene) {
  const test::TempDir dir;
  const Gaussians g = test::varied_splats(300, 0);
  const auto bits = [&](double scale, double origin) {
    Frame frame;
    frame.scale = scale;
    frame.origin = Eigen::Vector3d::Constant(origin);
    return write_spz(dir / "a.spz", g, frame).fractional_bits;
  };
  EXPECT_EQ(bits(32, 0), 12);
  EXPECT_EQ(bits(12'000, 0), 10);   // beyond +-2048
  EXPECT_EQ(bits(0.0625, 0), 21);   // a step of 2^-16 of the scene
  EXPECT_EQ(bits(64, 100'000), 6);  // coarse, but a thousandth of the scene
  EXPECT_THROW(bits(1, 100'000), InvalidInput);
  EXPECT_THROW(bits(1, 1e9), InvalidInput);
}

// As fine as asked for, whatever the unit, and never coarser than a thousandth of the scene.
TEST(Spz, TellsPlacesApartAsFinelyAsAskedFor) {
  const test::TempDir dir;
  const Gaussians g = test::varied_splats(300, 0);
  const auto written = [&](double finest, double scale) {
    Frame frame;
    frame.scale = scale;
    const SpzReport report = write_spz(dir / "a.spz", g, frame, {.finest = finest});
    const Gaussians back = read_splats(dir / "a.spz", frame).gaussians;
    const double half = std::ldexp(0.5, -report.fractional_bits) / scale * 1.001 + 1e-7;
    for (size_t i = 0; i < g.size(); ++i) {
      EXPECT_LT((back.position[i] - g.position[i]).cwiseAbs().maxCoeff(), half);
    }
    return report;
  };
  EXPECT_EQ(written(1.0 / 4096, 1).fractional_bits, 12);
  EXPECT_EQ(written(1.0 / 4095, 1).fractional_bits, 12);
  EXPECT_EQ(written(1.0 / 4097, 1).fractional_bits, 13);
  EXPECT_EQ(written(1.0 / 4096, 0.25).fractional_bits, 14);
  EXPECT_LT(written(1.0 / 4096, 1).bytes, written(0, 0.0625).bytes);
  EXPECT_EQ(written(1e9, 1).fractional_bits, 11);  // 0.8 across
  EXPECT_THROW(written(-1, 1), InvalidInput);
  EXPECT_THROW(written(NAN, 1), InvalidInput);
}

TEST(Spz, CountsWhatBytesCannotHold) {
  const test::TempDir dir;
  Gaussians g = test::varied_splats(5, 0);
  g.sh[1].x() = 9;
  g.scale[3].y() = 1e-9f;
  EXPECT_EQ(write_spz(dir / "a.spz", g, Frame{}).clamped, 2u);
}

TEST(Spz, SameSplatsGiveTheSameFile) {
  const test::TempDir dir;
  const Gaussians g = test::varied_splats(100, 1);
  write_spz(dir / "a.spz", g, Frame{});
  write_spz(dir / "b.spz", g, Frame{});
  EXPECT_EQ(test::read_bytes(dir / "a.spz"), test::read_bytes(dir / "b.spz"));
  test::expect_every_truncation_is_refused(
      test::read_bytes(dir / "a.spz"), [](const auto& path) { (void)read_splats(path); }, 16);
}

TEST(Spz, NoticesAFullDisk) {
  test::expect_full_disk_is_noticed(
      [](const auto& path) { write_spz(path, test::varied_splats(100, 0), Frame{}); });
}

}  // namespace
}  // namespace cgs::spz_test
