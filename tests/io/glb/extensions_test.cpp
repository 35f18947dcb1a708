// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/extensions.h"

#include <gtest/gtest.h>

#include "io/meshes/glb_reader.h"
#include "tests/support/full_disk.h"
#include "tests/support/triangle_glb.h"

namespace cgs::glb_extensions_test {
namespace {

TEST(GlbExtensions, ThoseThatMayChangeWhatIsShownAreTold) {
  test::TriangleGlb t;
  t.json["extensionsUsed"] = {
      "KHR_materials_clearcoat", "KHR_lights_punctual", "EXT_texture_webp", "EXT_shape_of_things"};
  EXPECT_EQ(parse_glb(t.bytes(), "a.glb").parsed.warnings,
            (std::vector<std::string>{
                "the extension EXT_shape_of_things is not known: what it says of shape or colour "
                "is not read"}));
  t.json["extensionsRequired"] = t.json["extensionsUsed"];
  const std::string bytes = t.bytes();
  EXPECT_EQ(test::defect_of(bytes, [](const auto& path) { (void)read_glb(path); }), "UNSUPPORTED");
  try {
    (void)parse_glb(bytes, "a.glb");
  } catch (const BadInput& error) {
    EXPECT_NE(std::string(error.what()).find("EXT_shape_of_things"), std::string::npos);
  }
}

}  // namespace
}  // namespace cgs::glb_extensions_test
