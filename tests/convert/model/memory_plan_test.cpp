// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/model/memory_plan.h"

#include <cstdio>
#include <cstdlib>
#include <limits>
#include <sstream>

#include <gtest/gtest.h>

#include "convert/text/terminal.h"
#include "io/images/png.h"
#include "libcgs/core/error.h"
#include "libcgs/render/rasterizer.h"
#include "tests/support/temp_dir.h"

namespace cgs::memory_plan_test {
namespace {

Scene scene_of(const std::vector<std::pair<int, int>>& sizes) {
  Scene scene;
  for (const auto& [width, height] : sizes) {
    View view;
    view.camera.width = width;
    view.camera.height = height;
    scene.input.push_back(static_cast<int>(scene.views.size()));
    scene.views.push_back(view);
  }
  return scene;
}
Scene scene_of(size_t views, int width, int height) {
  return scene_of(std::vector<std::pair<int, int>>(views, {width, height}));
}

size_t most(const std::vector<StageMemory>& plan) {
  size_t out = 0;
  for (const StageMemory& stage : plan) out = std::max(out, stage.bytes);
  return out;
}

std::string refusal(const Scene& scene, size_t budget) {
  try {
    check_memory_plan(scene, {}, budget);
  } catch (const LimitError& error) {
    return error.what();
  }
  return "";
}

TEST(MemoryPlan, GrowsWithThePixelsOfTheInputViewsAlone) {
  const Scene scene = scene_of(3, 400, 300);
  Scene more = scene;
  more.views.resize(20);
  more.views.back().camera.width = 100000;
  EXPECT_EQ(memory_plan_text(memory_plan(more)), memory_plan_text(memory_plan(scene)));
  EXPECT_GT(most(memory_plan(scene_of(4, 400, 300))), most(memory_plan(scene)));
  EXPECT_GT(most(memory_plan(scene_of(3, 800, 600))), most(memory_plan(scene)));
}

double of_stage(const Scene& scene, Stage stage) {
  for (const StageMemory& s : memory_plan(scene)) {
    if (s.stage == stage) return double(s.bytes);
  }
  ADD_FAILURE() << "no stage " << traits(stage).title;
  return 0;
}

TEST(MemoryPlan, ASmallPictureBesideLargeOnesGetsTheirVoxels) {
  const Scene fine = scene_of(3, 400, 300);
  const Scene mostly_fine = scene_of({{400, 300}, {200, 150}, {200, 150}});
  const Scene mostly_coarse = scene_of({{280, 214}, {200, 150}, {200, 150}, {200, 150}});
  const Scene coarse = scene_of(4, 200, 150);
  const Stage stage = Stage::Mesh;
  EXPECT_GT(of_stage(mostly_fine, stage), 0.95 * of_stage(fine, stage));
  EXPECT_LT(of_stage(mostly_coarse, stage), 1.05 * of_stage(coarse, stage));
}

TEST(MemoryPlan, TheLargestPictureIsDrawnAsAWhole) {
  const Scene mixed = scene_of({{400, 300}, {200, 150}, {200, 150}});
  const Scene even = scene_of(3, 300, 200);
  EXPECT_GT(of_stage(mixed, Stage::Views), of_stage(even, Stage::Views));
  Scene held_out = even;
  held_out.views.push_back(mixed.views[0]);
  held_out.held_out.push_back(3);
  EXPECT_GT(of_stage(held_out, Stage::Evaluation), of_stage(held_out, Stage::Views));
}

// A photograph is read at its own size, whatever it is worked on at; the report holds all else,
// too.
TEST(MemoryPlan, CountsTheReadingOfLargePhotographs) {
  const test::TempDir dir;
  write_png(dir / "large.png", ColorImage(3000, 2000, Eigen::Vector3f::Zero()));
  const Scene small = scene_of(2, 300, 200);
  Scene large = small;
  large.views[1].image_path = dir / "large.png";
  constexpr double kPhotograph = 3000.0 * 2000 * (3 + 2 * 12);
  EXPECT_NEAR(of_stage(large, Stage::Report) - of_stage(small, Stage::Report), kPhotograph, 2);
  EXPECT_GT(of_stage(large, Stage::Views), kPhotograph);
  large.views[1].camera.width = 3000;
  large.views[1].camera.height = 2000;
  Scene whole = large;
  whole.views[1].image_path.clear();
  EXPECT_EQ(of_stage(large, Stage::Report), of_stage(whole, Stage::Report));
  EXPECT_GT(double(memory_plan(large, {.downscale = 8}).back().bytes), kPhotograph);
  large.input = {0};
  large.held_out = {1};
  large.views[1].camera = small.views[1].camera;
  EXPECT_GT(of_stage(large, Stage::Report), kPhotograph) << "which shows views held out, too";
}

TEST(MemoryPlan, LeavesOutWhatTheUsersVoxelsDecide) {
  const std::string text =
      memory_plan_text(memory_plan(scene_of(3, 400, 300), {.chooses_voxels = false}));
  EXPECT_EQ(text.find("volume"), std::string::npos) << text;
  EXPECT_NE(text.find("depth and Gaussians"), std::string::npos) << text;
}

TEST(FreeOfGroup, IsWhatAContainerMayStillTake) {
  const test::TempDir dir;
  const auto free = [&] { return free_of_group(dir.path(), "memory.max", "memory.current"); };
  const size_t unlimited = std::numeric_limits<size_t>::max();
  EXPECT_EQ(free(), unlimited) << "there are no groups";
  test::write_bytes(dir / "memory.max", "max\n");
  test::write_bytes(dir / "memory.current", "700\n");
  EXPECT_EQ(free(), unlimited);
  test::write_bytes(dir / "memory.max", "1000\n");
  EXPECT_EQ(free(), 300u);
  test::write_bytes(dir / "memory.stat", "anon 500\ninactive_file 150\nactive_file 50\n");
  EXPECT_EQ(free(), 500u);
  test::write_bytes(dir / "memory.max", "400\n");
  EXPECT_EQ(free(), 0u);
}

// Of a service or a container that is not the root of what is mounted.
TEST(FreeOfGroups, IsTheLeastOfTheGroupOfTheProcessAndThoseAboveIt) {
  const test::TempDir dir;
  const auto free = [&](const std::string& of_process) {
    std::istringstream lines(of_process);
    return free_of_groups(dir.path(), lines);
  };
  const size_t unlimited = std::numeric_limits<size_t>::max();
  const auto write = [&](const std::string& group, const char* most, const char* now) {
    test::write_bytes(dir / (group + "memory.max"), most);
    test::write_bytes(dir / (group + "memory.current"), now);
  };
  write("system/", "900\n", "100\n");
  write("system/run/", "max\n", "100\n");
  write("system/run/job/", "1000\n", "100\n");
  EXPECT_EQ(free("0::/\n"), unlimited);
  EXPECT_EQ(free(""), unlimited);
  EXPECT_EQ(free("0::/system/run/job\n"), 800u);
  write("system/run/job/", "500\n", "100\n");
  EXPECT_EQ(free("3:cpuset:/\n0::/system/run/job\n"), 400u);
  EXPECT_EQ(free("0::/elsewhere/job\n"), unlimited) << "a path outside of the container";
  write("", "300\n", "100\n");
  EXPECT_EQ(free("0::/elsewhere/job\n"), 200u);
}

TEST(FreeOfGroups, KnowsTheFirstVersion) {
  const test::TempDir dir;
  const auto free = [&](const std::string& of_process) {
    std::istringstream lines(of_process);
    return free_of_groups(dir.path(), lines);
  };
  test::write_bytes(dir / "memory/slurm/job/memory.limit_in_bytes", "1000\n");
  test::write_bytes(dir / "memory/slurm/job/memory.usage_in_bytes", "700\n");
  test::write_bytes(dir / "memory/slurm/job/memory.stat",
                    "inactive_file 50\nactive_file 0\ntotal_inactive_file 150\n"
                    "total_active_file 100\n");
  EXPECT_EQ(free("9:cpu,memory:/slurm/job/step\n0::/\n"), 550u);
  EXPECT_EQ(free("9:cpu:/slurm/job\n0::/slurm/job\n"), std::numeric_limits<size_t>::max());
}

TEST(MemoryPlan, CountsNetworksWhileTheyAreTrained) {
  const Scene scene = scene_of(3, 400, 300);
  CoherenceOptions networks;
  networks.decoder = ResidualDecoder::Conv;
  CoherenceOptions wider = networks;
  wider.conv_depth_width = 30;
  const auto lattices = memory_plan(scene);
  const auto published = memory_plan(scene, {.coherence = networks});
  const auto wide = memory_plan(scene, {.coherence = wider});
  for (size_t i = 0; i < lattices.size(); ++i) {
    const bool trains = lattices[i].stage == Stage::Model;
    EXPECT_EQ(published[i].bytes > lattices[i].bytes, trains) << traits(lattices[i].stage).title;
    EXPECT_EQ(wide[i].bytes > published[i].bytes, trains) << traits(lattices[i].stage).title;
  }
  const size_t needed = most(published);
  EXPECT_THROW(check_memory_plan(scene, {.coherence = networks}, needed - 1), LimitError);
  EXPECT_NO_THROW(check_memory_plan(scene, {}, needed - 1));
}

TEST(MemoryPlan, CountsCorrespondingPixelsOfNeighbours) {
  const auto added = [](size_t views) {
    const Scene scene = scene_of(views, 400, 300);
    const size_t without = memory_plan(scene).front().bytes;
    return double(memory_plan(scene, {.match_lists = 1}).front().bytes - without) / double(views);
  };
  EXPECT_GE(added(3), 2 * 12.0 * 400 * 300 - 1) << "both other views";
  EXPECT_GT(added(6), 2 * added(3));
  EXPECT_NEAR(added(40), added(20), 1) << "no more than the best eight";
  const Scene scene = scene_of(3, 400, 300);
  TrainingOptions flow;
  flow.flow_weight = 1;
  EXPECT_EQ(match_lists(flow), 1);
  const size_t needed = memory_plan(scene, {.match_lists = 1}).front().bytes;
  EXPECT_THROW(check_training_memory(scene, needed - 1, flow), LimitError);
  EXPECT_NO_THROW(check_training_memory(scene, needed - 1, {}));
  TrainingOptions between;
  between.virtual_weight = 0.1;
  EXPECT_EQ(match_lists(between), 0.5) << "one for both";
  EXPECT_EQ(match_lists({}), 0);
}

TEST(MemoryPlan, CountsWhatFreeGaussiansHold) {
  const Scene scene = scene_of(3, 400, 300);
  const auto coherent = memory_plan(scene);
  const auto free = memory_plan(scene, {.method = SplatMethod::Classical});
  for (size_t i = 0; i < coherent.size(); ++i) {
    EXPECT_EQ(free[i].bytes > coherent[i].bytes, coherent[i].stage == Stage::Model);
  }
  const size_t needed = free.front().bytes;
  EXPECT_THROW(check_training_memory(scene, needed - 1, training_preset("classical")), LimitError);
  EXPECT_NO_THROW(check_training_memory(scene, needed - 1, training_preset("standard")));
}

TEST(MemoryPlan, CountsTheFusedSurfaceWhereFilesAreHeldAgainstIt) {
  const Scene scene = scene_of(3, 400, 300);
  const auto plain = memory_plan(scene);
  const auto sized = memory_plan(scene, {.measured = {.asset = true}});
  const auto near = memory_plan(scene, {.measured = {.meshes = true, .asset = true}});
  for (size_t i = 0; i < plain.size(); ++i) {
    const bool assets = plain[i].stage == Stage::Web;
    const bool meshes = plain[i].stage == Stage::Mesh;
    EXPECT_EQ(sized[i].bytes > plain[i].bytes, assets) << traits(plain[i].stage).title;
    EXPECT_EQ(near[i].bytes > plain[i].bytes, assets || meshes) << traits(plain[i].stage).title;
  }
}

TEST(MemoryPlan, VoxelsThatMustKeepAnErrorGrowWithThePixelsWithoutEnd) {
  const PictureWork exact = {.measured = {.meshes = true, .asset = true}};
  const size_t some = most(memory_plan(scene_of(4, 1000, 500), exact));
  const size_t many = most(memory_plan(scene_of(8, 1000, 500), exact));
  EXPECT_GT(double(many), 1.8 * double(some));
}

TEST(MemoryPlan, RefusesInOneLineThatSaysWhatToLower) {
  const Scene scene = scene_of(3, 504, 378);
  const size_t needed = most(memory_plan(scene));
  EXPECT_NO_THROW(check_memory_plan(scene, {}, needed));
  const std::string message = refusal(scene, needed / 5);
  for (const char* word : {"volume and mesh", "--downscale 4", "--memory-limit"}) {
    EXPECT_NE(message.find(word), std::string::npos) << message;
  }
  EXPECT_NE(refusal(scene, 50 << 20).find("no --downscale makes it fit"), std::string::npos);
}

// What a stage needs without a picture does not shrink with the pictures.
TEST(MemoryPlan, TheAdviceIsEnough) {
  const int sides[] = {504, 2016, 6000};
  for (const int side : sides) {
    const Scene scene = scene_of(3, side, side);
    for (const double share : {0.9, 0.5, 0.3}) {
      const auto budget = static_cast<size_t>(share * double(most(memory_plan(scene))));
      const std::string message = refusal(scene, budget);
      const size_t at = message.find("--downscale ");
      ASSERT_NE(at, std::string::npos) << message;
      const int factor = std::stoi(message.substr(at + 12));
      const Scene smaller = scene_of(3, side / factor, side / factor);
      EXPECT_LE(most(memory_plan(smaller)), budget) << message;
      const Scene larger = scene_of(3, side / (factor - 1), side / (factor - 1));
      EXPECT_GT(most(memory_plan(larger)), budget) << message;
    }
  }
}

TEST(SplatMemoryPlan, NamesTheStageThatDoesNotFitAndWhatToLower) {
  const SplatWork file = {.splats = 5'000'000, .harmonics = 16, .file_bytes = 1'240'000'000};
  const SplatWork pictures = {
      .splats = 5'000'000, .harmonics = 16, .pictures = 40, .picture_pixels = 512 * 512};
  for (const SplatWork& work : {file, pictures}) {
    const auto plan = splat_memory_plan(work);
    ASSERT_EQ(plan.size(), 1u);
    EXPECT_NO_THROW(check_splat_memory_plan(work, plan[0].bytes));
    try {
      check_splat_memory_plan(work, plan[0].bytes - 1);
      ADD_FAILURE() << plan[0].work;
    } catch (const LimitError& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find(plan[0].work), std::string::npos) << message;
      EXPECT_NE(message.find("--memory-limit"), std::string::npos) << message;
      const char* const lower = work.pictures > 0 ? "--virtual-size" : "spherical harmonics";
      EXPECT_NE(message.find(lower), std::string::npos) << message;
    }
  }
}

// Ten thousand splats that each cover a picture of 3840 x 2160 pixels. Drawing is only a part of
// taking pictures: the plan may not be less, but be more.
TEST(SplatMemoryPlan, HoldsWhereEverySplatCoversThePicture) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // a process of its own, for its own peak
  const auto draw_and_end = [] {
    const Camera camera = {
        .width = 3840, .height = 2160, .fx = 2000, .fy = 2000, .cx = 1920, .cy = 1080};
    Gaussians splats;
    for (int i = 0; i < 10'000; ++i) {
      splats.position.emplace_back(0, 0, 2 + 1e-4f * float(i));
      splats.scale.push_back(Eigen::Vector3f::Constant(20));
      splats.rotation.emplace_back(1, 0, 0, 0);
      splats.opacity.push_back(0.5f);
      splats.sh.push_back(Eigen::Vector3f::Zero());
    }
    const RenderBuffers picture = rasterize(splats, camera);
    const std::vector<SplatMemory> plan = splat_memory_plan(
        {.splats = splats.size(), .pictures = 1, .picture_pixels = picture.alpha.data.size()});
    const double ratio = double(plan.back().bytes) / double(peak_memory());
    std::fprintf(stderr, "predicted over actual: %.2f\n", ratio);
    std::_Exit(ratio >= 0.8 ? 0 : 1);
  };
  EXPECT_EXIT(draw_and_end(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace cgs::memory_plan_test
