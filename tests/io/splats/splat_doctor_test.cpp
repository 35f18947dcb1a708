// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/splat_doctor.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "io/bytes/significance.h"
#include "libcgs/core/error.h"
#include "tests/support/sample_splats.h"

namespace cgs::splat_doctor_test {
namespace {

/// A healthy file of the sample splats.
RawSplats healthy(int count = 400) {
  const Gaussians g = test::varied_splats(count, 1);
  RawSplats out;
  out.sh_degree = 1;
  out.may_be_linear = true;
  for (size_t i = 0; i < g.size(); ++i) {
    out.position.emplace_back(g.position[i].cast<double>());
    out.log_scale.emplace_back(g.scale[i].array().log());
    out.rotation.push_back(g.rotation[i]);
    out.logit.push_back(std::log(g.opacity[i] / (1 - g.opacity[i])));
  }
  out.sh = g.sh;
  return out;
}

template <typename Damage>
GaussianFile examined(const Damage& damage, int count = 400) {
  RawSplats raw = healthy(count);
  damage(raw);
  return examine_splats(std::move(raw), "a.spz", Frame{});
}

bool warns(const GaussianFile& file, const std::string& text) {
  for (const std::string& warning : file.warnings) {
    if (warning.find(text) != std::string::npos) return true;
  }
  return false;
}

TEST(SplatDoctor, FindsNothingInAHealthyFile) {
  const GaussianFile out = examined([](RawSplats&) {});
  EXPECT_TRUE(out.warnings.empty());
  EXPECT_EQ(out.findings.in_file, 400u);
  EXPECT_EQ(out.findings.dropped(), 0u);
  EXPECT_EQ(out.gaussians.sh, test::varied_splats(400, 1).sh);
}

TEST(SplatDoctor, TellsSplatsThatWereTrainedForSmoothEdges) {
  const auto told = [](const std::vector<std::string>& comments) {
    return warns(examined([&](RawSplats& raw) { raw.comments = comments; }), "antialiased");
  };
  EXPECT_TRUE(told({"Exported from Brush", "SplatRenderMode: mip"}));
  EXPECT_FALSE(told({"Exported from Brush", "SplatRenderMode: default"}));
  EXPECT_TRUE(told({"antialiased 1"}));
  EXPECT_FALSE(told({"antialiased 0"}));
  EXPECT_TRUE(told({"postshot.anti_aliasing=1"}));
  EXPECT_TRUE(told({"  SPLATRENDERMODE:\tMIP "}));
  EXPECT_FALSE(told({"antialiased 1", "SplatRenderMode: default"})) << "the last one counts";
  EXPECT_FALSE(told({"not antialiased 1", "antialiased", "antialiased 10"}));
  EXPECT_TRUE(warns(examined([](RawSplats& raw) { raw.is_antialiased = true; }), "antialiased"));
}

TEST(SplatDoctor, DropsPlacesThatFloatsCannotHoldAgain) {
  const GaussianFile out = examined([](RawSplats& raw) {
    raw.position[0].y() = 3e38;
    raw.position[1].z() = -1e300;
  });
  EXPECT_EQ(out.findings.out_of_range, 2u);
  EXPECT_EQ(out.gaussians.size(), 398u);
}

TEST(SplatDoctor, CountsEveryDefectApart) {
  const GaussianFile out = examined([](RawSplats& raw) {
    raw.position[0].x() = std::numeric_limits<double>::quiet_NaN();
    raw.sh[4 * 1 + 3].y() = std::numeric_limits<float>::infinity();
    for (const size_t i : {2, 3, 4}) raw.rotation[i].setZero();
    raw.logit[5] = -std::numeric_limits<float>::infinity();
    raw.log_scale[6].x() = 300;
    raw.logit[7] = std::numeric_limits<float>::infinity();
    raw.log_scale[8].z() = -std::numeric_limits<float>::infinity();
  });
  EXPECT_EQ(out.findings.not_finite, 2u);
  EXPECT_EQ(out.findings.without_rotation, 3u);
  EXPECT_EQ(out.findings.transparent, 1u);
  EXPECT_EQ(out.findings.out_of_range, 1u);
  EXPECT_EQ(out.findings.clamped, 2u);
  EXPECT_EQ(out.gaussians.size(), 393u);
  EXPECT_TRUE(warns(out, "dropped 7 splats"));
  EXPECT_TRUE(warns(out, "3 without rotation"));
  // The others stay what they were, in their order.
  const Gaussians g = test::varied_splats(400, 1);
  EXPECT_EQ(out.gaussians.position[2], g.position[9]);
  EXPECT_EQ(out.gaussians.rotation[2], g.rotation[9]);
  EXPECT_EQ(out.gaussians.sh[4 * 2 + 3], g.sh[4 * 9 + 3]);
}

// Of a healthy file: 0, 1, … 5, 0, 1, …
std::vector<float> all_labels(size_t count = 400) {
  std::vector<float> out;
  for (size_t i = 0; i < count; ++i) out.push_back(static_cast<float>(i % kProvenanceCount));
  return out;
}

TEST(SplatDoctor, KeepsTheLabelsOfSplatsThatStay) {
  const GaussianFile out = examined([](RawSplats& raw) {
    raw.provenance = all_labels();
    raw.provenance[1] = 17;  // dropped, so that nobody asks
    raw.rotation[1].setZero();
    raw.log_scale[3].x() = 50;  // only too large once it is moved
  });
  EXPECT_EQ(out.findings.dropped(), 2u);
  ASSERT_EQ(out.gaussians.provenance.size(), 398u);
  EXPECT_EQ(out.gaussians.provenance[0], Provenance::Inferred);
  EXPECT_EQ(out.gaussians.provenance[1], Provenance::Observed);
  EXPECT_EQ(out.gaussians.provenance[2], Provenance::Virtual);
  EXPECT_EQ(out.gaussians.provenance[3], Provenance::Estimated);
  EXPECT_FALSE(warns(out, "provenance"));
  EXPECT_TRUE(examined([](RawSplats&) {}).gaussians.provenance.empty());
}

TEST(SplatDoctor, LeavesAllLabelsOutWhereASplatHasNone) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinite = std::numeric_limits<float>::infinity();
  for (const float bad : {nan, infinite, -infinite, -1.0f, 6.0f, 2.5f, 1e30f}) {
    const GaussianFile out = examined([&](RawSplats& raw) {
      raw.provenance = all_labels();
      raw.provenance[7] = raw.provenance[9] = bad;
    });
    EXPECT_TRUE(out.gaussians.provenance.empty()) << bad;
    EXPECT_TRUE(
        warns(out, "provenance of the splats left out: 2 splats without a label from 0 to 5"))
        << bad;
    EXPECT_EQ(out.gaussians.size(), 400u);
  }
}

TEST(SplatDoctor, OpacitiesAreThoseOfDoubleAndNeverOne) {
  const std::vector<float> logits = {
      -1e30f, -88, -17, -16.6f, -12, -8, 0, 3, 4.5f, 8, 12, 16.6f, 17, 88, 1e30f};
  const GaussianFile out = examined([&](RawSplats& raw) {
    for (size_t i = 0; i < logits.size(); ++i) raw.logit[i] = logits[i];
  });
  EXPECT_EQ(out.findings.transparent, 400 - out.gaussians.size());
  const size_t dropped = 400 - out.gaussians.size();  // the first ones: 0 in float
  EXPECT_LE(dropped, 2u);
  for (size_t i = dropped; i < logits.size(); ++i) {
    const double exact = 1 / (1 + std::exp(-double{logits[i]}));
    EXPECT_NEAR(double{out.gaussians.opacity[i - dropped]}, exact, 1e-5 * exact + 1e-30)
        << logits[i];
    EXPECT_LT(out.gaussians.opacity[i - dropped], 1) << logits[i];
  }
}

// Rows that were never written: drawn, they would be opaque balls at the origin.
TEST(SplatDoctor, DropsRowsOfZeros) {
  const GaussianFile out = examined([](RawSplats& raw) {
    const size_t good = raw.size();
    raw.position.resize(5000, Eigen::Vector3d::Zero());
    raw.log_scale.resize(5000, Eigen::Vector3f::Zero());
    raw.rotation.resize(5000, Eigen::Vector4f::Zero());
    raw.logit.resize(5000, 0);
    raw.sh.resize(4 * 5000, Eigen::Vector3f::Zero());
    EXPECT_EQ(good, 400u);
  });
  EXPECT_EQ(out.gaussians.size(), 400u);
  EXPECT_EQ(out.findings.without_rotation, 4600u);
}

// Scales as lengths, opacities as probabilities.
void store_as_they_are(const Gaussians& g, RawSplats& raw) {
  raw.log_scale = g.scale;
  raw.logit = g.opacity;
}

TEST(SplatDoctor, ReadsLengthsAndProbabilitiesAsWhatTheyAre) {
  const Gaussians g = test::varied_splats(3000, 1);
  const GaussianFile out = examined([&](RawSplats& raw) { store_as_they_are(g, raw); }, 3000);
  EXPECT_TRUE(out.findings.linear_scales);
  EXPECT_TRUE(out.findings.linear_opacity);
  for (size_t i = 0; i < g.size(); ++i) {
    EXPECT_NEAR(out.gaussians.scale[i].x(), g.scale[i].x(), 1e-6f);
    EXPECT_NEAR(out.gaussians.opacity[i], g.opacity[i], 1e-6f);
  }
}

TEST(SplatDoctor, ReadsFlatLengthsAndInvisibleProbabilities) {
  const Gaussians g = test::varied_splats(3000, 1);
  const GaussianFile out = examined(
      [&](RawSplats& raw) {
        store_as_they_are(g, raw);
        raw.log_scale[7].z() = 0;
        raw.logit[0] = raw.logit[1] = 0;
      },
      3000);
  EXPECT_TRUE(out.findings.linear_scales);
  EXPECT_EQ(out.findings.transparent, 2u);
  EXPECT_EQ(out.gaussians.size(), 2998u);
  EXPECT_NEAR(out.gaussians.scale[5].x(), g.scale[7].x(), 1e-6f);
  EXPECT_LT(out.gaussians.scale[5].z(), 1e-15f);
}

// A scene so wide that sizes read as logarithms would not cover it often.
TEST(SplatDoctor, TakesScalesForLengthsWhereOpacitiesAreProbabilities) {
  const Gaussians g = test::varied_splats(300, 1);
  const GaussianFile out = examined(
      [&](RawSplats& raw) {
        for (Eigen::Vector3d& p : raw.position) p *= 100;
        store_as_they_are(g, raw);
      },
      300);
  EXPECT_TRUE(out.findings.linear_scales);
  EXPECT_NEAR(out.gaussians.scale[0].x(), g.scale[0].x(), 1e-6f);
}

TEST(SplatDoctor, LeavesWhatIsTooLargeOutOfTheFillRatio) {
  const double usual = examined([](RawSplats&) {}).findings.fill_ratio;
  const GaussianFile out = examined([](RawSplats& raw) { raw.log_scale[3].x() = 200; });
  EXPECT_EQ(out.findings.out_of_range, 1u);
  EXPECT_NEAR(out.findings.fill_ratio, usual, 0.02 * usual);
  EXPECT_FALSE(warns(out, "fill ratio"));
}

TEST(SplatDoctor, DoesNotTakeLargeSplatsForLengths) {
  const GaussianFile out = examined([](RawSplats& raw) {  // a few, as wide as the scene
    raw.position = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}};
    raw.log_scale.assign(3, Eigen::Vector3f(1, 0.5f, 0.5f));
    raw.rotation.resize(3);
    raw.logit.resize(3);
    raw.sh.resize(12);
  });
  EXPECT_FALSE(out.findings.linear_scales);
  EXPECT_FLOAT_EQ(out.gaussians.scale[0].x(), std::exp(1.0f));
  EXPECT_TRUE(warns(out, "read as logarithms"));
}

TEST(SplatDoctor, CountsFlyawaysAndKeepsThem) {
  const GaussianFile out = examined([](RawSplats& raw) {
    raw.position[3].x() = 100;
    raw.position[4].z() = -1e6;
  });
  EXPECT_EQ(out.findings.flyaways, 2u);
  EXPECT_EQ(out.gaussians.size(), 400u);
  EXPECT_TRUE(warns(out, "2 splats more than ten times"));
}

// Rounding has put them in one place; their scales, where they have some, say that they were apart.
TEST(SplatDoctor, TakesTheSizeOfSplatsInOnePlaceFromScalesThatDoNotVanish) {
  const auto in_one_place = [](float log_scale) {
    return [=](RawSplats& raw) {
      raw.position.assign(raw.size(), Eigen::Vector3d(4.5e5, 5.4e6, 100));
      raw.log_scale.assign(raw.size(), Eigen::Vector3f::Constant(log_scale));
    };
  };
  EXPECT_THROW(examined(in_one_place(-8)), BadInput);
  const GaussianFile out = examined(in_one_place(-300));
  const float written = std::log(out.gaussians.scale[0].x());
  EXPECT_NO_THROW(examined(in_one_place(written)));
}

// What is read can be written as floats and read again: it is refused at once, not the second time.
TEST(SplatDoctor, JudgesTheSizeOfWhatIsLeft) {
  const auto two_and_a_huge_one = [](float position, float log_scale) {
    return [=](RawSplats& raw) {
      raw.position.assign(3, Eigen::Vector3d(0, 0, position));
      raw.log_scale.assign(3, Eigen::Vector3f::Constant(log_scale));
      raw.log_scale[0].setConstant(1000);
      raw.rotation.resize(3);
      raw.logit.resize(3);
      raw.sh.resize(12);
    };
  };
  EXPECT_THROW(examined(two_and_a_huge_one(1e9f, 0)), BadInput);
  EXPECT_EQ(examined(two_and_a_huge_one(1e9f, 15)).gaussians.size(), 2u);
  RawSplats raw = healthy(3);
  two_and_a_huge_one(1e9f, 0)(raw);
  raw.position[0].setZero();  // is dropped, and with it the extent
  EXPECT_THROW(examine_splats(raw, "a.ply", std::nullopt), BadInput);
}

TEST(SplatDoctor, KeepsApartInFloatsWhatDoublesTellApart) {
  RawSplats raw = healthy(2);
  const Eigen::Vector3d place(1, 2, 3);
  raw.digits = kDoubleDigits;
  raw.position.assign(raw.size(), place);
  raw.log_scale.assign(raw.size(), Eigen::Vector3f::Constant(-20));
  const GaussianFile out = examine_splats(raw, "a.ply", std::nullopt);
  const Eigen::Vector3d read =
      out.frame.world_from_internal(out.gaussians.position[0].cast<double>());
  EXPECT_LT((read - place).norm(), 1e-15);
  EXPECT_LT((place - out.frame.file_origin).norm(), 256 * std::exp(-20.0));
}

TEST(SplatDoctor, RefusesAFileOfNothing) {
  const auto nothing = [](RawSplats& raw) {
    for (auto& q : raw.rotation) q.setZero();
  };
  EXPECT_THROW(examined(nothing), BadInput);
}

}  // namespace
}  // namespace cgs::splat_doctor_test
