// SPDX-License-Identifier: GPL-3.0-or-later
// The same work in worlds a millionth and a million times as large, and as far away as national and
// geocentric coordinates lie: every cell of scale, place and kind of work must give the result of
// the plain world, scaled and moved in double, or be refused where double cannot hold it.
// Run by hand it prints a row per cell and how many passed.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <openvdb/openvdb.h>

#include "io/images/exr.h"
#include "tests/e2e/extremes/cell.h"
#include "tests/e2e/extremes/closeness.h"
#include "tests/support/glb_file.h"

namespace cgs::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

int passed_cells = 0;
int tried_cells = 0;

class Total : public testing::Environment {
 public:
  void TearDown() override {
    std::printf("extremes cells passed %d / %d\n", passed_cells, tried_cells);
  }
};
const auto* const kTotal = testing::AddGlobalTestEnvironment(new Total);

/// The program refused: nothing is left, and one line says how many bits there are.
class Refused : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

void must_run(const std::string& arguments) {
  const ProgramResult result = run_cgs(arguments + " -q");
  if (result.exit_code == 0) return;
  const bool is_refusal = result.exit_code == 3 &&
                          result.err.find("significant bits") != std::string::npos &&
                          std::count(result.err.begin(), result.err.end(), '\n') == 1;
  if (is_refusal) throw Refused(result.err);
  throw std::runtime_error("exit " + std::to_string(result.exit_code) + ": " + result.err);
}

json json_of(const std::string& arguments) {
  const ProgramResult result = run_cgs(arguments + " -q --json");
  if (result.exit_code != 0) throw std::runtime_error(result.err);
  return json::parse(result.out);
}

std::string text(const char* format, double a, double b = 0) {
  std::array<char, 120> line{};
  std::snprintf(line.data(), line.size(), format, a, b);
  return line.data();
}

const Cell& plain_cell() {
  static const Cell kPlain{1, Eigen::Vector3d::Zero(), "plain"};
  return kPlain;
}

/// A scene and what `cgs train` makes of it in so many steps.
struct Trained {
  TempDir dir;
  fs::path model() const { return dir / "model"; }

  Trained(const Cell& cell, int steps) {
    write_scene(dir / "scene", cell);
    must_run("train " + (dir / "scene").string() + " --views " + kInputViews +
             " --set steps=" + std::to_string(steps) + " -o " + model().string());
  }
};

/// The models of a cell are needed by several kinds of work.
const Trained& trained(const Cell& cell, int steps) {
  static std::map<std::pair<std::string, int>, std::unique_ptr<Trained>> kept;
  std::unique_ptr<Trained>& slot = kept[{cell.name, steps}];
  if (!slot) slot = std::make_unique<Trained>(cell, steps);
  return *slot;
}

// 200 steps of training: in exact cells the losses are those of the plain world to the last bit. In
// others training amplifies what the scale rounds: at this size, by up to some 0.1 dB.
Finding train(const Cell& cell) {
  constexpr int kSteps = 200;
  const Trained& here = trained(cell, kSteps);
  const Trained& plain = trained(plain_cell(), kSteps);
  const auto losses = [](const Trained& t) {
    return json::parse(read_bytes(t.model() / "training.json"))["loss"].get<std::vector<double>>();
  };
  const auto quality = [](const Trained& t) -> double {
    return json_of("evaluate " + t.model().string())["mean"]["psnr"];
  };
  const Points points = read_ply_columns(here.model() / "gaussians.ply").in_world();
  const Points expected = read_ply_columns(plain.model() / "gaussians.ply").in_world();
  if (cell.is_exact()) {
    const bool same = losses(here) == losses(plain) && losses(here).size() == kSteps;
    const double error = largest_error(points, expected, cell);
    const double allowed = cell.move.isZero(0) ? 0 : 1e-6;  // else files round elsewhere
    return {same && error <= allowed ? 0 : NAN,
            (same ? "same losses" : "OTHER losses") + text(", places within %.1e", error)};
  }
  const double decibels = std::abs(quality(here) - quality(plain));
  const double apart = share_apart(plain_points(points, cell), expected, 0.02);
  return {largest(decibels / 0.15, apart / 0.01),
          text("%.4f dB, %.2f %% of places beyond 1 % %", decibels, 100 * apart)};
}

/// Channels of the views that `cgs render` makes of a model moved to a cell.
struct Rendered {
  std::vector<ExrImage> views;

  explicit Rendered(const Cell& cell) {
    const TempDir dir;
    write_moved_model(trained(plain_cell(), 0).model(), dir / "model", cell);
    must_run("render " + (dir / "model").string() + " --views v12,v08 -o " +
             (dir / "views").string());
    for (const char* name : {"v12.exr", "v08.exr"}) views.push_back(read_exr(dir / "views" / name));
  }
};

// The picture of one and the same model. Sizes are stored as logarithms in float, which a scale
// that is no power of two rounds by a millionth: splats whose alpha lies there at 1/255 may come or
// go, two of them at the worst pixel, each by up to 2.2/255 in linear light.
Finding render(const Cell& cell) {
  static const Rendered plain(plain_cell());
  const Rendered here(cell);
  double colour = 0;
  double mean = 0;
  double depth = 0;
  size_t values = 0;
  for (size_t v = 0; v < here.views.size(); ++v) {
    for (const char* channel : {"R", "G", "B", "A", "Z"}) {
      const std::vector<float>& a = *here.views[v].find(channel);
      const std::vector<float>& b = *plain.views[v].find(channel);
      for (size_t i = 0; i < a.size(); ++i) {
        if (channel[0] == 'Z') {
          const double off = b[i] == 0 ? std::abs(a[i]) : std::abs(a[i] / cell.scale / b[i] - 1);
          depth = largest(depth, off);
        } else {
          colour = largest(colour, std::abs(double(a[i]) - b[i]));
          mean += std::abs(double(a[i]) - b[i]);
          ++values;
        }
      }
    }
  }
  mean /= double(values);
  int exponent = 0;
  const bool is_power_of_two = std::frexp(cell.scale, &exponent) == 0.5;
  const double most = is_power_of_two ? 1.0 / 255 : 2 * 2.2 / 255;
  const double mean_at_most = is_power_of_two ? 1e-5 : 5e-5;
  return {largest(largest(colour / most, mean / mean_at_most), depth / 1e-3),
          text("colour off by %.1e, depth by %.1e", colour, depth)};
}

/// `cgs fuse` and `cgs mesh` of the depth of a cell.
struct Fused {
  TempDir dir;
  fs::path volume() const { return dir / "volume.vdb"; }

  explicit Fused(const Cell& cell) {
    must_run("fuse " + trained(cell, 0).model().string() + " -o " + volume().string());
  }
};

const Fused& fused(const Cell& cell) {
  static std::map<std::string, std::unique_ptr<Fused>> kept;
  std::unique_ptr<Fused>& slot = kept[cell.name];
  if (!slot) slot = std::make_unique<Fused>(cell);
  return *slot;
}

/// What lengths of the file must be divided by.
double stretch_of(const openvdb::FloatGrid& grid) {
  const auto text = grid.getMetadata<openvdb::StringMetadata>("cgs_stretch");
  return text ? std::stod(text->value()) : 1;
}

openvdb::FloatGrid::Ptr distances_in(const fs::path& file) {
  openvdb::initialize();
  openvdb::io::File vdb(file.string());
  vdb.open(false);
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(vdb.readGrid("tsdf"));
  vdb.close();
  return grid;
}

double plain_voxel() {
  static const double kVoxel = distances_in(fused(plain_cell()).volume())->voxelSize().x();
  return kVoxel;
}

/// Vertices and faces of the open surface, in plain units.
struct Surface {
  Points points;
  std::vector<std::array<uint32_t, 3>> faces;

  explicit Surface(const Cell& cell) {
    const TempDir dir;
    must_run("mesh " + fused(cell).volume().string() + " --simplify 0 -o " + dir.path().string());
    const PlyColumns columns = read_ply_columns(dir / "surface.ply");
    points = plain_points(columns.in_world(), cell);
    faces = columns.faces;
  }

  double distance(const Eigen::Vector3d& p) const {
    double best = INFINITY;
    for (const auto& f : faces) {
      best = std::min(best, distance_to_triangle(p, points[f[0]], points[f[1]], points[f[2]]));
    }
    return best;
  }
};

double share_beyond(const Surface& from, const Surface& to, double tolerance) {
  const size_t step = std::max<size_t>(1, from.points.size() / 300);
  double apart = 0;
  double tried = 0;
  for (size_t i = 0; i < from.points.size(); i += step, ++tried) {
    if (!(to.distance(from.points[i]) <= tolerance)) ++apart;
  }
  return tried > 0 ? apart / tried : 1;
}

// Volume and surface of the depth of a cell: the same vertices in exact cells, else within half a
// voxel, but for a few where a match of pixels fell the other way.
Finding mesh(const Cell& cell) {
  static const Surface plain(plain_cell());
  const Surface here(cell);
  if (cell.is_exact()) {
    const double error = largest_error(here.points, plain.points, plain_cell());
    return {here.faces == plain.faces ? error / 1e-6 : NAN, text("vertices within %.1e", error)};
  }
  const double apart = std::max(share_beyond(here, plain, 0.5 * plain_voxel()),
                                share_beyond(plain, here, 0.5 * plain_voxel()));
  return {apart / 0.02, text("%.2f %% of the vertices beyond half a voxel", 100 * apart)};
}

// The volume as OpenVDB's own reader places it: distances at the same places of the world.
Finding vdb(const Cell& cell) {
  static const openvdb::FloatGrid::Ptr plain = distances_in(fused(plain_cell()).volume());
  const openvdb::FloatGrid::Ptr here = distances_in(fused(cell).volume());
  const PlyColumns model = read_ply_columns(trained(cell, 0).model() / "gaussians.ply");
  const double stretch = stretch_of(*here);
  size_t tried = 0;
  size_t apart = 0;
  const auto sampler = here->getConstAccessor();
  for (auto value = plain->cbeginValueOn(); value; ++value) {
    const openvdb::Vec3d at = plain->indexToWorld(value.getCoord());
    const Eigen::Vector3d in_file = stretch * (cell.place({at.x(), at.y(), at.z()}) - model.origin);
    const openvdb::Coord nearest = openvdb::Coord::round(
        here->worldToIndex(openvdb::Vec3d(in_file.x(), in_file.y(), in_file.z())));
    ++tried;
    const double distance = sampler.getValue(nearest) / stretch / cell.scale;
    // Grids may lie half a voxel apart along each axis, as origins snap.
    const double allowed = cell.is_exact() ? 1e-6 : 0.9 * plain_voxel();
    if (!sampler.isValueOn(nearest) || !(std::abs(distance - *value) <= allowed)) ++apart;
  }
  const double share = tried > 0 ? double(apart) / double(tried) : 1;
  const double voxel = here->voxelSize().x() / stretch / cell.scale / plain_voxel() - 1;
  return {largest(share / (cell.is_exact() ? 1e-9 : 0.05), std::abs(voxel) / 1e-3),
          text("%.2f %% of the voxels differ, their size by %.1e", 100 * share, voxel)};
}

/// A torus in doubles that `cgs convert` made into another file.
struct Converted {
  TempDir dir;
  fs::path file;
  Eigen::Vector3d origin;  ///< World point of (0, 0, 0) in our files of this torus.

  Converted(const Cell& cell, const std::string& name, const std::string& options = "")
      : file(dir / name) {
    write_torus(dir / "in.ply", cell);
    must_run("convert " + (dir / "in.ply").string() + " " + file.string() + options);
    must_run("convert " + (dir / "in.ply").string() + " " + (dir / "origin.ply").string());
    origin = read_ply_columns(dir / "origin.ply").origin;
  }
};

Finding ply(const Cell& cell) {
  const Converted made(cell, "out.ply");
  const double error = largest_error(read_ply_columns(made.file).in_world(), torus_points(), cell);
  return {error / 1e-6, text("vertices within %.1e", error)};
}

Finding glb(const Cell& cell) {
  const Converted made(cell, "out.glb");
  const Glb read = parse_glb(read_bytes(made.file));
  Points points;
  for (const GlbPart& part : read.parts) {
    for (const auto& p : part.values.at("POSITION")) {
      points.push_back(cell.plain(in_world(read, p)));
    }
  }
  const double allowed = 2 * 1.01 / 16384 + 1e-6;  // what `--max-error` defaults to
  const double apart = share_apart(points, torus_points(), allowed);
  return {apart > 0 ? NAN : 0, text("%.0f vertices within %.1e", double(points.size()), allowed)};
}

double volume_of(const fs::path& file) {
  return json_of("measure " + file.string() + " --assume-unit m")["figures"]["volume"]["value"];
}

// OBJ and STL, and what `cgs measure` reads in them: volumes are differences of large numbers.
Finding cad(const Cell& cell) {
  const Converted obj(cell, "out.obj");
  const Converted stl(cell, "out.stl", " --assume-unit m --up 0 0 1");
  const double in_obj = largest_error(read_obj_points(obj.file), torus_points(), cell);
  Points corners;
  for (const Eigen::Vector3d& p : read_stl_corners(stl.file)) {
    corners.push_back(cell.plain(p / 1000 + stl.origin));
  }
  const double in_stl = share_apart(corners, torus_points(), 1e-6);
  const double unit = std::pow(cell.scale, 3);
  double volume = 0;
  for (const fs::path& file : {obj.dir / "in.ply", obj.file, stl.file}) {
    volume = largest(volume, std::abs(volume_of(file) / unit / torus_volume() - 1));
  }
  return {largest(in_stl > 0 ? NAN : in_obj / 1e-6, volume / 1e-5),
          text("vertices within %.1e, volume off by %.1e", in_obj, volume)};
}

void try_cell(const Cell& cell, const char* kind, Finding (*work)(const Cell&)) {
  ++tried_cells;
  std::string outcome;
  bool good = false;
  try {
    const Finding found = work(cell);
    good = found.error <= 1 && !cell.is_refused();
    outcome = found.detail + text(" (%.2g of what is allowed)", found.error);
  } catch (const Refused& refusal) {
    good = cell.is_refused();
    outcome = std::string("refused: ") + refusal.what();
    outcome.pop_back();
  } catch (const std::exception& error) {
    outcome = error.what();
  }
  passed_cells += good ? 1 : 0;
  std::printf(
      "%-20s %-6s %s %s\n", cell.name.c_str(), kind, good ? "ok    " : "FAILED", outcome.c_str());
  EXPECT_TRUE(good) << cell.name << " " << kind << ": " << outcome;
}

TEST(Extremes, Train) {
  for (const Cell& cell : cells()) try_cell(cell, "train", train);
}
TEST(Extremes, Render) {
  for (const Cell& cell : cells()) try_cell(cell, "render", render);
}
TEST(Extremes, Mesh) {
  for (const Cell& cell : cells()) try_cell(cell, "mesh", mesh);
}
TEST(Extremes, Vdb) {
  for (const Cell& cell : cells()) try_cell(cell, "vdb", vdb);
}
TEST(Extremes, Ply) {
  for (const Cell& cell : cells()) try_cell(cell, "ply", ply);
}
TEST(Extremes, Glb) {
  for (const Cell& cell : cells()) try_cell(cell, "glb", glb);
}
TEST(Extremes, ObjAndStl) {
  for (const Cell& cell : cells()) try_cell(cell, "cad", cad);
}

// What all cells are held against is right itself: its depth is that of the scene.
TEST(Extremes, PlainWorldShowsTheTrueDepth) {
  const ExrImage prior = read_exr(trained(plain_cell(), 0).model() / "priors/v12.exr");
  const double unit = json::parse(
      read_bytes(trained(plain_cell(), 0).model() / "cameras.json"))[0]["frame"]["scale"];
  const std::vector<float> truth = true_depth_of(12).data;
  std::vector<double> errors;
  for (size_t i = 0; i < truth.size(); ++i) {
    const double z = prior.find("Z")->at(i) * unit;
    if (std::isfinite(z)) errors.push_back(std::abs(z / truth[i] - 1));
  }
  ASSERT_GT(errors.size(), truth.size() / 2);
  std::nth_element(errors.begin(), errors.begin() + long(errors.size() / 2), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.02);  // a pixel is 18 % of the depth
}

}  // namespace
}  // namespace cgs::test
