// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/measure/orthophoto_files.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "convert/text/report_json.h"
#include "libcgs/core/error.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/temp_dir.h"

namespace cgs::orthophoto_files_test {
namespace {

using Eigen::Vector3d;
using Json = nlohmann::ordered_json;
using test::TempDir;

// A mesh in metres whose points are world coordinates around `place`.
MeasurableMesh placed(MeasurableMesh mesh, const Vector3d& place, double metres_per_unit = 1) {
  mesh.frame.origin = place;
  mesh.frame.metres_per_unit = metres_per_unit;
  return mesh;
}

// z = 0.25 + 0.3 x - 0.17 y over the unit square.
MeasurableMesh tilted_plane() {
  return test::grid_mesh(
      6, 6, [](double s, double t) { return Vector3d(s, t, 0.25 + 0.3 * s - 0.17 * t); });
}

// The six numbers of a world file.
std::vector<double> world_of(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::vector<double> out;
  for (std::string line; std::getline(in, line);) out.push_back(std::stod(line));
  return out;
}

struct Heights {
  int width = 0;
  int height = 0;
  std::vector<double> values;
};

// As Python's imaging library reads them.
Heights heights_of(const std::filesystem::path& path) {
  const std::string list = path.string() + ".txt";
  const std::string command =
      "/usr/bin/python3 -c \"from PIL import Image; i = Image.open('" + path.string() +
      "'); print(i.width, i.height, *[repr(v) for v in i.getdata()])\" > " + list;
  EXPECT_EQ(std::system(command.c_str()), 0) << "needs python3-pil";
  std::ifstream in(list);
  Heights out;
  in >> out.width >> out.height;
  for (std::string word; in >> word;) out.values.push_back(std::stod(word));
  return out;
}

TEST(WriteOrthophoto, PlacesTheMapInTheWorldWhereverThatIs) {
  const TempDir dir;
  const Vector3d far(453210.11, 5411830.49, 212.75);
  const FigureUnit metres{"m", 1, 0};
  const Json out = write_orthophoto(
      {.prefix = dir / "map", .pixel_size = "0.05m"}, placed(tilted_plane(), far), metres);
  const auto world = world_of(dir / "map.tfw");
  ASSERT_EQ(world.size(), 6U);
  EXPECT_EQ(world, world_of(dir / "map.pgw"));
  EXPECT_EQ(world, world_of(dir / "map.provenance.pgw"));
  EXPECT_EQ(world[0], 0.05);
  EXPECT_EQ(world[3], -0.05);
  EXPECT_EQ(world[1] + world[2], 0);
  const Heights heights = heights_of(dir / "map.tif");
  EXPECT_EQ(heights.width, out["width"].get<int>());
  EXPECT_EQ(out["height_zero"], 0);
  size_t known = 0;
  for (int y = 0; y < heights.height; ++y) {
    for (int x = 0; x < heights.width; ++x) {
      // By the world file alone: where is the middle of this pixel, and how high is the plane?
      const double s = world[4] + x * world[0] - far.x();
      const double t = world[5] + y * world[3] - far.y();
      const double found = heights.values[size_t(y) * size_t(heights.width) + size_t(x)];
      if (std::isnan(found)) {
        EXPECT_TRUE(s < 0 || s > 1 || t < 0 || t > 1);
        continue;
      }
      ++known;
      EXPECT_NEAR(found, far.z() + 0.25 + 0.3 * s - 0.17 * t, 2e-5);  // floats of 213
    }
  }
  EXPECT_EQ(known, 400U);
  EXPECT_NEAR(out["covered"].get<double>(),
              400.0 / (double(heights.width) * double(heights.height)),
              1e-12);
}

TEST(WriteOrthophoto, CountsHeightsFromBelowWhereFloatsWouldLoseThem) {
  const TempDir dir;
  const Vector3d far(0, 0, 6.4e6);
  const Json out = write_orthophoto(
      {.prefix = dir / "map", .pixel_size = "1cm"}, placed(tilted_plane(), far), {"m", 1, 0});
  const double zero = out["height_zero"].get<double>();
  EXPECT_NEAR(zero, 6.4e6, 1);
  const auto world = world_of(dir / "map.tfw");
  const Heights heights = heights_of(dir / "map.tif");
  for (int x = 0; x < heights.width; ++x) {
    const double s = world[4] + x * world[0];
    const double t = world[5] + 50 * world[3];
    const double found = heights.values[size_t(50) * size_t(heights.width) + size_t(x)];
    EXPECT_NEAR(zero + found, 6.4e6 + 0.25 + 0.3 * s - 0.17 * t, 1e-6);
  }
}

TEST(WriteOrthophoto, CountsFromThePlaneOfThreePoints) {
  const TempDir dir;
  // The plane z = 0.1 through points that start at (0.2, 0.2), with right along y.
  const MeasurableMesh mesh = placed(tilted_plane(), {0, 0, 0}, 0.001);
  const Json out = write_orthophoto({.prefix = dir / "p",
                                     .plane = {"0.2,0.2,0.1", "0.2,0.9,0.1", "0.1,0.5,0.1"},
                                     .pixel_size = "0.02mm"},
                                    mesh,
                                    {"mm", 1, 0});
  EXPECT_EQ(out["axes"]["right"], Json({0, 1, 0}));
  EXPECT_EQ(out["axes"]["toward"], Json({0, 0, 1}));
  EXPECT_NEAR(out["lowest"].get<double>(), 0.25 - 0.17 - 0.1 + 0.3 * 0.01 + 0.17 * 0.01, 1e-9);
  EXPECT_NEAR(out["corner"][0].get<double>(), -0.2, 0.0200001);  // right runs along y from 0.2
  EXPECT_NEAR(out["corner"][1].get<double>(), 0.2, 0.0200001);   // up runs against x
}

TEST(WriteOrthophoto, TakesUpFromTheMeshUnlessToldOtherwise) {
  const TempDir dir;
  MeasurableMesh mesh = tilted_plane();
  mesh.frame.up = Vector3d(0, 1, 0);
  const FigureUnit units{"units", 1, 0};
  const Json stated = write_orthophoto({.prefix = dir / "a"}, mesh, units);
  EXPECT_EQ(stated["axes"]["toward"], Json({0, 1, 0}));
  const Json told = write_orthophoto({.prefix = dir / "a", .up = {0, 0, 2}}, mesh, units);
  EXPECT_EQ(told["axes"]["toward"], Json({0, 0, 1}));
  const Json unknown = write_orthophoto({.prefix = dir / "a"}, tilted_plane(), units);
  EXPECT_EQ(unknown["axes"]["toward"], Json({0, 0, 1}));
}

TEST(WriteOrthophoto, TellsTheSharesOfTheLabelsItShows) {
  const TempDir dir;
  const MeasurableMesh mesh = test::with_labels(
      placed(tilted_plane(), {0, 0, 0}),
      [](const auto& p) { return p.x() < 0.5 ? Provenance::Observed : Provenance::Inferred; });
  const Json out = write_orthophoto({.prefix = dir / "a/b/map"}, mesh, {"m", 1, 0});
  EXPECT_NEAR(out["observed"].get<double>(), 0.5, 1e-3);
  EXPECT_NEAR(out["inferred"].get<double>(), 0.5, 1e-3);
  EXPECT_EQ(out["interpolated"], 0);
  EXPECT_GE(out["width"].get<int>(), 1000);
  EXPECT_LE(out["width"].get<int>(), 2501);
  for (const Json& file : out["files"]) {
    EXPECT_TRUE(std::filesystem::exists(file.get<std::string>()));
  }
  EXPECT_TRUE(write_orthophoto({.prefix = dir / "m"}, tilted_plane(), {"units", 1, 0})
                  .at("observed")
                  .is_null());
}

TEST(WriteOrthophoto, RefusesAPictureThatMemoryDoesNotHold) {
  const TempDir dir;
  const MeasurableMesh mesh = placed(tilted_plane(), {0, 0, 0});
  const OrthophotoRequest request{.prefix = dir / "map", .pixel_size = "1cm"};
  constexpr size_t kBytes = 42 * 100 * 100;
  try {
    write_orthophoto(request, mesh, {"m", 1, 0}, kBytes / 2);
    ADD_FAILURE() << "takes half of the memory it needs";
  } catch (const LimitError& error) {
    const std::string said = error.what();
    EXPECT_NE(said.find("--pixel-size"), std::string::npos) << said;
    EXPECT_NE(said.find("420.0 kB"), std::string::npos) << said;
  }
  EXPECT_EQ(test::entries(dir.path()), 0);
  write_orthophoto(request, mesh, {"m", 1, 0}, 2 * kBytes);
  EXPECT_EQ(test::entries(dir.path()), 7);
}

TEST(WriteOrthophoto, LeavesBesideThePicturesWhatTheyMean) {
  const TempDir dir;
  MeasurableMesh mesh = test::with_labels(placed(tilted_plane(), {100, 200, 300}, 0.001),
                                          [](const auto&) { return Provenance::Inferred; });
  mesh.frame.scale_source = ScaleSource::KnownDistance;
  const OrthophotoRequest request{.prefix = dir / "p",
                                  .plane = {"0.2,0.2,0.1", "0.2,0.9,0.1", "0.1,0.5,0.1"},
                                  .pixel_size = "0.02mm"};
  Json returned = write_orthophoto(request, mesh, {"mm", 1, 0.01});
  Json told = Json::parse(test::read_bytes(dir / "p.orthophoto.json"));
  EXPECT_EQ(told["files"][0], "p.png");
  EXPECT_EQ(told["files"].size(), returned["files"].size());
  EXPECT_EQ(told["unit"], "mm");
  EXPECT_EQ(told["scale"]["source"], "known distance");
  EXPECT_EQ(told["scale"]["relative_sigma"], 0.01);
  EXPECT_EQ(told["inferred"], 1);
  EXPECT_EQ(told["provenance_colors"]["inferred"], Json({242, 26, 217}));
  // The highest place, by this file alone: the first point of the plane is its zero.
  const std::vector<double> origin = told["origin"];
  EXPECT_NEAR(origin[2] + told["highest"].get<double>(), 300 + 0.25 + 0.3, 0.01);
  EXPECT_EQ(told["schema_version"], kSchemaVersion);
  told.erase("schema_version");
  told.erase("files");
  told.erase("provenance_colors");
  returned.erase("files");
  EXPECT_EQ(told, returned);
  const Json top = write_orthophoto({.prefix = dir / "q"}, mesh, {"mm", 1, 0});
  EXPECT_EQ(top["origin"], Json({0, 0, 0}));
  EXPECT_TRUE(top["scale"]["relative_sigma"].is_null());
}

TEST(WriteOrthophoto, WritesNoPictureWithoutItsScale) {
  const TempDir dir;
  std::filesystem::create_directory(dir / "map.orthophoto.json");
  EXPECT_THROW(write_orthophoto({.prefix = dir / "map", .pixel_size = "1cm"},
                                placed(tilted_plane(), {0, 0, 0}),
                                {"m", 1, 0}),
               IoError);
  EXPECT_EQ(test::entries(dir.path()), 1);
}

TEST(WriteOrthophoto, RefusesWhatCannotBe) {
  const TempDir dir;
  const MeasurableMesh mesh = placed(tilted_plane(), {0, 0, 0});
  const FigureUnit metres{"m", 1, 0};
  EXPECT_THROW(write_orthophoto({.prefix = dir / "a", .side = "inside"}, mesh, metres),
               InvalidInput);
  EXPECT_THROW(write_orthophoto({.prefix = dir / "a", .up = {0, 0, 0}}, mesh, metres),
               InvalidInput);
  EXPECT_THROW(write_orthophoto({.prefix = dir / "a", .pixel_size = "1um"}, mesh, metres),
               LimitError);
  EXPECT_THROW(
      write_orthophoto({.prefix = dir / "a", .plane = {"0,0,0", "1,1,1", "2,2,2"}}, mesh, metres),
      InvalidInput);
  EXPECT_EQ(test::entries(dir.path()), 0);
}

}  // namespace
}  // namespace cgs::orthophoto_files_test
