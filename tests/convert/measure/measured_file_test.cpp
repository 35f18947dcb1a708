// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/measure/measured_file.h"

#include <gtest/gtest.h>

#include "libcgs/core/error.h"
#include "tests/support/splat_ply.h"
#include "tests/support/temp_dir.h"

namespace cgs::measured_file_test {
namespace {

TEST(ReadMeasured, RefusesSplatsAndSaysWhatMakesAMeshOfThem) {
  const test::TempDir dir;
  test::write_bytes(dir / "splats.ply",
                    test::splat_ply_header("ascii", 1) + "0 0 0 1 1 1 0 -3 -3 -3 1 0 0 0\n");
  try {
    (void)read_measured(dir / "splats.ply", "");
    ADD_FAILURE() << "takes splats for points";
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find("cgs convert"), std::string::npos) << error.what();
  }
}

TEST(ReadMeasured, TakesThePointsOfACloud) {
  const test::TempDir dir;
  test::write_bytes(dir / "cloud.ply",
                    "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
                    "property float z\nend_header\n0 0 0\n1 2 3\n");
  const MeasurableFile found = read_measured(dir / "cloud.ply", "mm");
  EXPECT_EQ(found.content.points.size(), 2U);
  EXPECT_EQ(found.content.frame.metres_per_unit, 0.001);
}

}  // namespace
}  // namespace cgs::measured_file_test
