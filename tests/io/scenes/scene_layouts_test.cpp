// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/scenes/scene_layouts.h"

#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "io/scenes/cameras_json_scene.h"
#include "io/scenes/colmap.h"
#include "io/scenes/llff.h"
#include "io/scenes/metashape.h"
#include "io/scenes/polycam.h"
#include "io/scenes/realitycapture.h"
#include "io/scenes/rgbd_frames.h"
#include "io/scenes/strecha.h"
#include "io/scenes/transforms_json.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

namespace cgs::scene_layouts_test {
namespace {

using Files = std::vector<std::pair<std::string, std::string>>;  // names and contents

void write(const test::TempDir& dir, const Files& files) {
  for (const auto& [name, content] : files) test::write_bytes(dir / name, content);
}

/// What tells a layout, and who reads it.
struct Kind {
  Files files;
  Scene (*read)(const SceneRoot& root);
};

const std::string kPose = R"({"t_00": 1})";
const std::string kChunk = "<document><chunk><cameras></cameras></chunk></document>";
const std::string kColumns = "#name,x,y,alt,heading,pitch,roll,f\n";
const std::string kCameras = R"([{"img_name": "a"}])";

/// In the order of the table in docs/photographs.md.
std::vector<Kind> kinds() {
  return {{{{"poses_bounds.npy", ""}}, read_llff},
          {{{"transforms.json", "{}"}}, read_transforms_json},
          {{{"sparse/0/cameras.txt", ""}, {"sparse/0/images.txt", ""}}, read_colmap},
          {{{"0000.jpg.camera", ""}}, read_strecha},
          {{{"keyframes/cameras/1.json", kPose}}, read_polycam},
          {{{"frame-000000.pose.txt", ""}}, read_rgbd_frames},
          {{{"cameras.xml", kChunk}}, read_metashape},
          {{{"cameras.csv", kColumns}}, read_realitycapture},
          {{{"cameras.json", kCameras}}, read_cameras_json_scene}};
}

/// Whether a folder is in a layout, by who reads that.
bool is_read_by(const std::filesystem::path& folder, const Kind& kind) {
  const SceneLayout* const layout = layout_of(folder);
  return layout != nullptr && layout->read == kind.read && layout->recognises(folder);
}

TEST(SceneLayouts, OfTwoThatFitTheFirstOfTheTableCounts) {
  const std::vector<Kind> all = kinds();
  for (size_t i = 0; i < all.size(); ++i) {
    for (size_t j = i; j < all.size(); ++j) {
      const test::TempDir dir;
      write(dir, all[j].files);
      EXPECT_TRUE(is_read_by(dir.path(), all[j])) << j;
      write(dir, all[i].files);
      EXPECT_TRUE(is_read_by(dir.path(), all[i])) << i << " before " << j;
    }
  }
}

TEST(SceneLayouts, OfAllTheNextCountsWhenTheFirstIsTakenAway) {
  const test::TempDir dir;
  for (const Kind& kind : kinds()) write(dir, kind.files);
  for (const Kind& kind : kinds()) {
    EXPECT_TRUE(is_read_by(dir.path(), kind)) << kind.files[0].first;
    for (const auto& [name, content] : kind.files) std::filesystem::remove(dir / name);
  }
  EXPECT_EQ(layout_of(dir.path()), nullptr) << "folders are left, and no file";
}

TEST(SceneLayouts, ProgramsPutTheirFilesInSeveralPlaces) {
  for (const Kind& kind : std::vector<Kind>{
           {{{"transforms_train.json", "{}"}}, read_transforms_json},
           {{{"cameras.bin", ""}, {"images.bin", ""}}, read_colmap},
           {{{"sparse/cameras.bin", ""}, {"sparse/images.bin", ""}}, read_colmap},
           {{{"sparse_3/1/cameras.txt", ""}, {"sparse_3/1/images.txt", ""}}, read_colmap},
           {{{"colmap/sparse/0/cameras.bin", ""}, {"colmap/sparse/0/images.bin", ""}}, read_colmap},
           {{{"distorted/sparse/0/cameras.bin", ""}, {"distorted/sparse/0/images.bin", ""}},
            read_colmap},
           {{{"gt_dense_cameras/0000.jpg.camera", ""}}, read_strecha},
           {{{"keyframes/corrected_cameras/1.json", kPose}}, read_polycam},
           {{{"cameras/1.json", kPose}}, read_polycam},
           {{{"seq-01/frame-000000.pose.txt", ""}}, read_rgbd_frames},
           {{{"trajectory.log", ""}, {"color/1.jpg", ""}}, read_rgbd_frames},
           {{{"scene/trajectory.log", ""}, {"rgb/1.jpg", ""}}, read_rgbd_frames},
           {{{"notes.xml", "<notes/>"}, {"Z.XML", kChunk}}, read_metashape},
           {{{"points.csv", "#name,x,y,alt\n"}, {"Z.CSV", "# of a program\n" + kColumns}},
            read_realitycapture},
           {{{"cameras.json", "\xEF\xBB\xBF \n" + kCameras}}, read_cameras_json_scene}}) {
    const test::TempDir dir;
    write(dir, kind.files);
    EXPECT_TRUE(is_read_by(dir.path(), kind)) << kind.files.back().first;
  }
}

TEST(SceneLayouts, OtherFoldersAreInNone) {
  for (const Files& files :
       std::vector<Files>{{},
                          {{"a.jpg", ""}, {"images/b.jpg", ""}, {"README", "transforms.json"}},
                          {{"images/transforms.json", "{}"}},
                          {{"sparse/0/cameras.txt", ""}},
                          {{"sparse/0/cameras.txt", ""}, {"sparse/1/images.txt", ""}},
                          {{"sparse/0/cameras.txt", ""}, {"sparse/0/images.bin", ""}},
                          {{"a/b/0000.jpg.camera", ""}},
                          {{"keyframes/cameras/1.json", "{}"}},
                          {{"trajectory.log", ""}},
                          {{"color/1.jpg", ""}},
                          {{"frame-000000.color.png", ""}, {"camera-intrinsics.txt", ""}},
                          {{"cameras.xml", "<document><chunk></chunk></document>"}},
                          {{"points.csv", "#name,x,y,alt\n"}},
                          {{"cameras.json", R"({"img_name": "a"})"}},
                          {{"cameras.json", "[]"}},
                          {{"cameras.json", ""}}}) {
    const test::TempDir dir;
    write(dir, files);
    EXPECT_EQ(layout_of(dir.path()), nullptr) << (files.empty() ? "empty" : files[0].first);
    EXPECT_EQ(layout_of(dir / "not there"), nullptr);
  }
  const test::TempDir dir;
  test::write_bytes(dir / "transforms.json", "{}");
  EXPECT_EQ(layout_of(dir / "transforms.json"), nullptr) << "a file";
}

// What is damaged is told, and not passed over for what else is there.
TEST(SceneLayouts, ADamagedFileIsOfItsLayoutAllTheSame) {
  const auto defect = [](const test::TempDir& dir) {
    const SceneLayout* const layout = layout_of(dir.path());
    if (layout == nullptr || layout->read != read_transforms_json) return std::string("another");
    return test::defect_of([&] { (void)layout->read({dir.path()}); });
  };
  const test::TempDir dir;
  write(dir, {{"transforms.json", "{"}, {"cameras.json", kCameras}});
  EXPECT_EQ(defect(dir), "SYNTAX");
  const test::TempDir linked;
  write(linked, {{"cameras.json", kCameras}});
  std::filesystem::create_symlink("nowhere", linked / "transforms.json");
  EXPECT_EQ(defect(linked), "OPEN");
}

}  // namespace
}  // namespace cgs::scene_layouts_test
