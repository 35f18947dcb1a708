// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/render/thin_sheets.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace cgs::thin_sheets_test {
namespace {

/// A camera `height` above (below, if negative) the plane z = 0 that looks straight at it and sees
/// a surface at z = `surface` everywhere.
SheetView view_of(double height, double across, double surface) {
  SheetView out;
  Camera& c = out.camera;
  c.width = c.height = 41;
  c.fx = c.fy = 40;
  c.cx = c.cy = 20.5;
  const double side = height > 0 ? 1 : -1;
  c.world_from_cam.linear() =
      Eigen::Vector3d(1, -side, -side).asDiagonal().toDenseMatrix();  // +z of the camera is down
  c.world_from_cam.translation() = Eigen::Vector3d(across, 0, height);
  out.depth = DepthMap(41, 41, static_cast<float>(std::abs(height - surface)));
  out.normal = NormalMap(41, 41, Eigen::Vector3f(0, 0, static_cast<float>(side)));
  return out;
}

std::vector<DepthMap> thickened(const std::vector<SheetView>& views, size_t& moved) {
  return thickened_sheets(views, 0.3, moved);
}

/// Of what a view sees in the middle, after all.
double surface_of(const SheetView& view, const DepthMap& depth) {
  return view.camera.unproject(20.5, 20.5, double{depth(20, 20)}).z();
}

TEST(ThinSheets, GetTheThicknessAskedFor) {
  for (const double inverted : {0.0, 0.05}) {  // noise may put the front behind the back
    const std::vector<SheetView> views = {view_of(2, 0, -inverted),
                                          view_of(2, 0.1, -inverted),
                                          view_of(-3, 0, inverted),
                                          view_of(-3, 0.1, inverted)};
    size_t moved = 0;
    const std::vector<DepthMap> out = thickened(views, moved);
    EXPECT_GT(moved, 4u * 41 * 41 / 3);
    EXPECT_NEAR(surface_of(views[0], out[0]), 0.15, 1e-4);
    EXPECT_NEAR(surface_of(views[2], out[2]), -0.15, 1e-4);
  }
}

TEST(ThinSheets, LeavesThickPartsAlone) {
  const std::vector<SheetView> views = {
      view_of(2, 0, 0.2), view_of(2, 0.1, 0.2), view_of(-2, 0, -0.2), view_of(-2, 0.1, -0.2)};
  size_t moved = 0;
  const std::vector<DepthMap> out = thickened(views, moved);
  EXPECT_EQ(moved, 0u);
  EXPECT_EQ(out[0].data, views[0].depth.data);
}

TEST(ThinSheets, NeedsTwoWitnessesThatSeeTheBack) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<SheetView> views = {view_of(2, 0, 0), view_of(-2, 0, 0), view_of(-2, 0.1, 0)};
  size_t moved = 0;
  (void)thickened({views[0], views[1]}, moved);
  EXPECT_EQ(moved, 0u);
  for (float& depth : views[2].depth.data) depth = nan;
  (void)thickened(views, moved);
  EXPECT_EQ(moved, 0u);
  // Two more above see the front, not the back.
  (void)thickened({view_of(2, 0, 0), view_of(2, 0.1, 0), view_of(2, 0.2, 0)}, moved);
  EXPECT_EQ(moved, 0u);
}

// What hides the sheet from behind says nothing about it.
TEST(ThinSheets, IsNotMisledByWhatStandsBehind) {
  const std::vector<SheetView> views = {view_of(2, 0, 0), view_of(-3, 0, -1), view_of(-3, 0.1, -1)};
  size_t moved = 0;
  (void)thickened(views, moved);
  EXPECT_EQ(moved, 0u);
}

}  // namespace
}  // namespace cgs::thin_sheets_test
