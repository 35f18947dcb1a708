// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/request_fields.h"

#include <map>
#include <set>
#include <string>

#include <gtest/gtest.h>

namespace cgs::request_fields_test {
namespace {

// A member that no field keeps would let a run go on with what another request made.
TEST(RequestFields, KeepEveryMemberOfARequestButWhatDecidesNothing) {
  const RunRequest request;
  // All members: with one more, this does not compile until it is named here.
  const auto& [scene,
               output,
               training,
               medium,
               voxel_size,
               max_voxels,
               simplify,
               compression_error,
               glb_encoding,
               texture,
               estimated,
               max_error,
               fill,
               local_origin,
               lods,
               max_size,
               memory_limit,
               overwrite,
               settings_reason] = request;
  const auto& [path,
               options,
               assume_unit,
               up,
               focal,
               each_lens,
               old_photographs,
               refine_poses,
               known_distances,
               marker_size,
               control] = scene;
  const auto& [views, all_views, downscale, chunk, allow_external, depth] = options;
  const auto& [table, unit] = control;
  const std::map<std::string, const void*> members = {
      {"training", &training},
      {"medium", &medium},
      {"voxel_size", &voxel_size},
      {"max_voxels", &max_voxels},
      {"simplify", &simplify},
      {"compression_error", &compression_error},
      {"glb_encoding", &glb_encoding},
      {"texture", &texture},
      {"estimated", &estimated},
      {"max_error", &max_error},
      {"fill", &fill},
      {"local_origin", &local_origin},
      {"lods", &lods},
      {"max_size", &max_size},
      {"scene.path", &path},
      {"scene.assume_unit", &assume_unit},
      {"scene.up", &up},
      {"scene.focal", &focal},
      {"scene.each_lens", &each_lens},
      {"scene.old_photographs", &old_photographs},
      {"scene.refine_poses", &refine_poses},
      {"scene.known_distances", &known_distances},
      {"scene.marker_size", &marker_size},
      {"scene.options.views", &views},
      {"scene.options.all_views", &all_views},
      {"scene.options.downscale", &downscale},
      {"scene.options.chunk", &chunk},
      {"scene.options.allow_external", &allow_external},
      {"scene.options.depth", &depth},
      {"scene.control.file", &table},
      {"scene.control.unit", &unit}};
  // Where and how it is worked.
  const std::set<const void*> decide_nothing = {
      &output, &memory_limit, &overwrite, &settings_reason};
  std::multiset<const void*> kept;
  for (const auto* fields : {&request_fields(), &noted_fields()}) {
    for (const RequestField& field : *fields) {
      if (!field.member) continue;
      kept.insert(field.member(request));
      EXPECT_TRUE(field.read) << field.key << " is not taken back";
      EXPECT_EQ(decide_nothing.count(field.member(request)), 0u) << field.key;
    }
  }
  for (const auto& [name, member] : members) EXPECT_EQ(kept.count(member), 1u) << name;
  EXPECT_EQ(kept.size(), members.size());
}

TEST(RequestFields, KeepEveryMemberOfTheOptionsOfDepth) {
  const RunRequest request;
  const auto& [folder, kind, network, scale] = request.scene.options.depth;
  EXPECT_EQ(noted_fields().back().write(request, {}).size(), 4u)
      << folder << static_cast<int>(kind) << network << scale;
}

TEST(DecidedStages, AreAllForWhatStatesTheScaleOfGivenDepth) {
  RunRequest request;
  const auto plain = decided_stages(request, {});
  EXPECT_EQ(plain.count("up"), 0u) << "ground is looked for across it";
  EXPECT_EQ(plain.at("assume_unit"), "scale");
  EXPECT_EQ(plain.at("max_error"), "mesh");
  EXPECT_EQ(plain.at("lods"), "web");
  EXPECT_EQ(plain.at("views"), "report");
  EXPECT_EQ(plain.count("training"), 0u);
  request.scene.options.depth.network = "network.onnx";
  const auto with_depth = decided_stages(request, {});
  EXPECT_EQ(with_depth.count("up"), 0u);
  for (const char* key : {"assume_unit", "control_points", "stated_scale"}) {
    EXPECT_EQ(plain.at(key), "scale");
    EXPECT_EQ(with_depth.count(key), 0u) << key;
  }
  EXPECT_EQ(plain.size(), with_depth.size() + 3);
}

}  // namespace
}  // namespace cgs::request_fields_test
