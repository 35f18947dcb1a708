// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/files/volume_file.h"

#include <array>
#include <cmath>
#include <map>

#include <nlohmann/json.hpp>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/LevelSetUtil.h>
#include <openvdb/tools/ValueTransformer.h>

#include "convert/text/frame_json.h"
#include "io/bytes/byte_reader.h"
#include "io/volumes/vdb.h"
#include "libcgs/core/error.h"
#include "libcgs/core/srgb.h"

namespace cgs {

namespace {

// A copy of a grid whose transform is moved and scaled; shares no tree with the original if its
// values are lengths, which are scaled too.
template <typename Grid>
typename Grid::Ptr placed(const typename Grid::Ptr& grid,
                          double scale,
                          const Eigen::Vector3d& offset,
                          bool values_are_lengths) {
  typename Grid::Ptr out = values_are_lengths ? grid->deepCopy() : grid->copy();
  out->setTransform(grid->transform().copy());
  out->transform().postScale(scale);
  out->transform().postTranslate(openvdb::Vec3d(offset.x(), offset.y(), offset.z()));
  return out;
}

openvdb::FloatGrid::Ptr scaled_lengths(const openvdb::FloatGrid::Ptr& grid,
                                       double scale,
                                       const Eigen::Vector3d& offset) {
  auto out = placed<openvdb::FloatGrid>(grid, scale, offset, true);
  const auto factor = static_cast<float>(scale);
  openvdb::tools::foreach (
      out->beginValueAll(), [factor](const auto& it) { it.setValue(*it * factor); }, true, false);
  openvdb::tools::changeBackground(out->tree(), grid->background() * factor);
  return out;
}

// For programs that show volumes as clouds: 0 outside, rising to 1 over the depth of the band.
openvdb::FloatGrid::Ptr fog_of(const openvdb::FloatGrid::Ptr& distance,
                               double scale,
                               const Eigen::Vector3d& offset) {
  auto out = placed<openvdb::FloatGrid>(distance, scale, offset, true);
  openvdb::tools::sdfToFogVolume(*out);
  out->setGridClass(openvdb::GRID_FOG_VOLUME);
  return out;
}

constexpr const char* kFrameKey = "cgs_frame";
constexpr const char* kStretchKey = "cgs_stretch";
constexpr const char* kBoundsKey = "cgs_bounds";           // min and max corner [internal units]
constexpr const char* kColorSpaceKey = "cgs_color_space";  // of the grid of colours

template <typename Grid>
typename Grid::Ptr find_grid(const openvdb::GridPtrVec& grids,
                             const std::string& name,
                             const std::filesystem::path& path) {
  for (const auto& grid : grids) {
    if (grid->getName() != name) continue;
    if (auto typed = openvdb::gridPtrCast<Grid>(grid)) return typed;
  }
  throw BadInput(Defect::Schema, path, "has no grid '" + name + "'; was it made by cgs fuse?");
}

Frame frame_of(const openvdb::GridBase& grid, const std::filesystem::path& path) {
  try {
    return frame_from_json(nlohmann::ordered_json::parse(grid.metaValue<std::string>(kFrameKey)));
  } catch (const std::exception&) {
    throw BadInput(
        Defect::Schema, path, "grid 'tsdf' has no readable frame (" + std::string(kFrameKey) + ")");
  }
}

// What lengths must be multiplied by for OpenVDB to take voxels of this edge.
double stretch_for(double voxel_size) {
  constexpr double kSmallest = 1e-4;  // the library wants the cube of it to be above 3e-15
  double stretch = 1;
  while (voxel_size * stretch < kSmallest) stretch *= 1024;
  return stretch;
}

double stretch_of(const openvdb::GridBase& grid, const std::filesystem::path& path) {
  const auto text = grid.getMetadata<openvdb::StringMetadata>(kStretchKey);
  if (!text) return 1;
  double stretch = 0;
  int exponent = 0;
  const bool is_power = parse_number(text->value(), stretch) && std::isfinite(stretch) &&
                        stretch >= 1 && std::frexp(stretch, &exponent) == 0.5;
  if (is_power) return stretch;
  throw BadInput(Defect::Value,
                 path,
                 "is stretched by '" + text->value() + "', which must be a power of two (" +
                     kStretchKey + ")");
}

std::string bounds_text(const Eigen::AlignedBox3d& box) {
  const Eigen::Vector3d& a = box.min();
  const Eigen::Vector3d& b = box.max();
  return nlohmann::ordered_json({a.x(), a.y(), a.z(), b.x(), b.y(), b.z()}).dump();
}

Eigen::AlignedBox3d bounds_of(const openvdb::GridBase& grid, const std::filesystem::path& path) {
  try {
    const auto v = nlohmann::ordered_json::parse(grid.metaValue<std::string>(kBoundsKey))
                       .get<std::array<double, 6>>();
    return {Eigen::Vector3d(v[0], v[1], v[2]), Eigen::Vector3d(v[3], v[4], v[5])};
  } catch (const std::exception&) {
    throw BadInput(Defect::Schema,
                   path,
                   "grid 'tsdf' has no readable bounds (" + std::string(kBoundsKey) + ")");
  }
}

// NaN or infinite distances would end the program in the middle of meshing.
template <typename Grid>
void require_finite(const Grid& grid, const std::filesystem::path& path) {
  bool is_good = openvdb::math::isFinite(grid.background());
  for (auto it = grid.cbeginValueAll(); it && is_good; ++it) {
    is_good = openvdb::math::isFinite(*it);
  }
  if (is_good) return;
  throw BadInput(Defect::Value, path, "grid '" + grid.getName() + "' holds values not finite");
}

// The box must be that of the grids: memory is planned for it.
void check_bounds(const Volume& volume, const std::filesystem::path& path) {
  constexpr double kMostVoxels = 1 << 20;  // along an axis; also the reach of a tree node path
  const Eigen::AlignedBox3d& box = volume.bounds;
  const bool is_box = box.min().allFinite() && box.max().allFinite() && !box.isEmpty();
  const double reach = std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
  if (is_box && reach <= kMostVoxels * volume.voxel_size) return;
  throw BadInput(
      Defect::Value,
      path,
      "the bounds are no box, or reach further than 2^20 voxels (" + std::string(kBoundsKey) + ")");
}

template <typename Grid>
openvdb::GridBase::ConstPtr named(typename Grid::Ptr grid, const char* name) {
  grid->setName(name);
  return grid;
}

// Earlier versions wrote colours as sRGB codes them, and did not say so on the grid.
void decode(openvdb::Vec3SGrid& color) {
  for (auto value = color.beginValueOn(); value; ++value) {
    const openvdb::Vec3f c = *value;
    value.setValue({linear_from_srgb(c.x()), linear_from_srgb(c.y()), linear_from_srgb(c.z())});
  }
}

}  // namespace

void write_volume(const std::filesystem::path& path,
                  const Volume& volume,
                  const Frame& frame,
                  const std::string& evidence) {
  const double stretch = stretch_for(volume.voxel_size * frame.scale);
  const double scale = stretch * frame.scale;
  const Eigen::Vector3d offset = stretch * (frame.origin - frame.file_origin);
  const auto values = [&](const auto& grid) {
    using Grid = typename std::decay_t<decltype(grid)>::element_type;
    return placed<Grid>(grid, scale, offset, false);
  };
  auto tsdf = scaled_lengths(volume.tsdf, scale, offset);
  tsdf->insertMeta(kFrameKey, openvdb::StringMetadata(frame_to_json(frame).dump()));
  const std::string stretch_text = nlohmann::json(stretch).dump();
  if (stretch != 1) tsdf->insertMeta(kStretchKey, openvdb::StringMetadata(stretch_text));
  tsdf->insertMeta(kBoundsKey, openvdb::StringMetadata(bounds_text(volume.bounds)));
  tsdf->setGridClass(openvdb::GRID_UNKNOWN);  // one-sided and open: no valid level set
  const auto color = values(volume.color);
  color->insertMeta(kColorSpaceKey, openvdb::StringMetadata("linear"));
  std::vector<openvdb::GridBase::ConstPtr> grids = {
      named<openvdb::FloatGrid>(tsdf, "tsdf"),
      named<openvdb::FloatGrid>(values(volume.weight), "weight"),
      named<openvdb::Vec3SGrid>(color, "color"),
      named<openvdb::FloatGrid>(values(volume.support), "support"),
      named<openvdb::FloatGrid>(scaled_lengths(volume.sigma, scale, offset), "sigma"),
      named<openvdb::Int32Grid>(values(volume.state), "state")};
  if (volume.surface) {
    auto surface = scaled_lengths(volume.surface, scale, offset);
    surface->setGridClass(openvdb::GRID_LEVEL_SET);
    grids.push_back(named<openvdb::FloatGrid>(surface, "surface"));
  }
  const auto& distance = volume.surface ? volume.surface : volume.tsdf;
  grids.push_back(named<openvdb::FloatGrid>(fog_of(distance, scale, offset), "density"));
  std::map<std::string, std::string> about = {
      {"creator", "cgs"}, {"cgs_units", frame.unit_name()}, {"cgs_evidence", evidence}};
  if (stretch != 1) about[kStretchKey] = stretch_text;
  write_vdb(path, grids, about);
}

std::optional<VolumeStatement> volume_statement(const std::vector<openvdb::GridBase::Ptr>& grids,
                                                const std::filesystem::path& path) {
  for (const auto& grid : grids) {
    if (!grid->getMetadata<openvdb::StringMetadata>(kFrameKey)) continue;
    return VolumeStatement{frame_of(*grid, path), stretch_of(*grid, path)};
  }
  return std::nullopt;
}

VolumeFile read_volume(const std::filesystem::path& path) {
  const openvdb::GridPtrVec grids = read_vdb(path);
  VolumeFile file;
  const auto tsdf = find_grid<openvdb::FloatGrid>(grids, "tsdf", path);
  file.frame = frame_of(*tsdf, path);
  const double scale = 1 / (stretch_of(*tsdf, path) * file.frame.scale);
  const Eigen::Vector3d offset = (file.frame.file_origin - file.frame.origin) / file.frame.scale;
  const auto lengths = [&](const char* name) {
    return scaled_lengths(find_grid<openvdb::FloatGrid>(grids, name, path), scale, offset);
  };
  Volume& volume = file.volume;
  volume.tsdf = scaled_lengths(tsdf, scale, offset);
  volume.sigma = lengths("sigma");
  const auto plain = [&]<typename Grid>(typename Grid::Ptr& target, const char* name) {
    target = placed<Grid>(find_grid<Grid>(grids, name, path), scale, offset, false);
  };
  plain.operator()<openvdb::FloatGrid>(volume.weight, "weight");
  plain.operator()<openvdb::Vec3SGrid>(volume.color, "color");
  if (!volume.color->getMetadata<openvdb::StringMetadata>(kColorSpaceKey)) decode(*volume.color);
  plain.operator()<openvdb::FloatGrid>(volume.support, "support");
  plain.operator()<openvdb::Int32Grid>(volume.state, "state");
  volume.bounds = bounds_of(*tsdf, path);
  volume.voxel_size = static_cast<float>(volume.tsdf->voxelSize().x());
  check_bounds(volume, path);
  require_finite(*volume.tsdf, path);
  require_finite(*volume.weight, path);
  require_finite(*volume.color, path);
  require_finite(*volume.support, path);
  return file;
}

}  // namespace cgs
