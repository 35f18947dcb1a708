// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "libcgs/core/camera.h"
#include "libcgs/core/fisheye.h"
#include "libcgs/core/frame.h"
#include "libcgs/core/photo_response.h"
#include "libcgs/core/raster.h"
#include "libcgs/core/water.h"

namespace cgs {

class PhotographCache;

/// What the values of given depth mean; where that is not known, it is judged by how they fit the
/// depth measured from the photographs.
enum class DepthKind : uint8_t {
  Unknown,    ///< One of the following.
  Metric,     ///< z-depth, by a sensor.
  Relative,   ///< z-depth up to scale and offset, as networks guess it.
  Disparity,  ///< Inverse z-depth up to scale and offset, likewise.
};

/// Where the cameras of a scene are from.
enum class SceneKind : uint8_t {
  Unknown,
  Llff,
  TransformsJson,  ///< nerfstudio, NeRF
  Colmap,
  Strecha,
  Polycam,
  RgbdFrames,
  Open3dRgbd,
  Metashape,
  RealityCapture,
  CamerasJson,     ///< cameras.json of 3DGS, beside photographs; or any that states a frame.
  ForeignCameras,  ///< cameras.json of another program, beside its splats: it states no frame.
  Photographs,     ///< Solved for here, from photographs alone.
};

/// As files and people have it: "LLFF", "COLMAP", "photographs"; empty for Unknown. Both kinds of
/// cameras.json have one name.
std::string scene_kind_name(SceneKind kind);

/// The first kind of that name; Unknown for others, as versions to come may have.
SceneKind scene_kind_of(std::string_view name);

/// One photograph and the camera that took it.
struct View {
  std::string name;                  ///< File stem; unique within a scene.
  std::filesystem::path image_path;  ///< Empty if the file is missing.
  std::filesystem::path mask_path;   ///< Says what of it may be used; empty = everything.
  /// How the picture lies in its file, as Exif counts (1 = upright); load_images() turns it. Only
  /// for cameras solved for here: others are calibrated on the pixels as they are stored.
  int orientation = 1;
  Camera camera;  ///< Undistorted, at the size the image is (or will be) used.
  /// Lens distortion k1 k2 p1 p2 k3 (Brown-Conrady, as OpenCV defines it) of the image file, which
  /// load_images() takes out of the pixels; all zero = none.
  std::array<double, 5> distortion = {};
  /// Of a photograph through a fisheye lens, which load_images() turns into what a pinhole camera
  /// would have recorded; `distortion` is then zero. Empty = none.
  std::optional<Fisheye> fisheye;
  /// Factors on the linear light of the photograph, by which load_images() makes it agree with the
  /// other input views.
  Eigen::Vector3f exposure = Eigen::Vector3f::Ones();
  PhotoResponse response;        ///< Of an old photograph; what load_images() does before exposure.
  bool may_have_border = false;  ///< load_images() looks for the border of a print, and masks it.
  ColorImage image;              ///< Empty until loaded; same size as camera.
  MaskMap valid;                 ///< Empty = every pixel; else 1 where the image may be used.
  /// As `valid` says.
  bool is_usable(size_t pixel) const { return valid.empty() || valid.data[pixel] != 0; }
  bool is_usable(int x, int y) const { return valid.empty() || valid(x, y) != 0; }
  std::filesystem::path depth_path;  ///< File with depth from elsewhere; empty = none.
  /// Depth from elsewhere, in metres if it is metric; NaN = none. Empty until loaded, and where
  /// there is none; same size as camera.
  DepthMap given_depth;
  bool depth_states_metres = false;  ///< The file has 16-bit whole numbers, as sensors write them.
  double near = 0;                   ///< Smallest z-depth of the scene seen here; 0 = unknown.
  double far = 0;                    ///< Largest z-depth; 0 = unknown.
};

/// A point known before reconstruction, from structure from motion.
struct SparsePoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::vector<int> views;  ///< Indices into Scene::views that observed it; may be empty.
};

/// Photographs with known cameras, views in the order of their names.
///
/// Readers return it in world coordinates with the identity frame; to_canonical() moves it into
/// its canonical frame, and everything after that works in internal units.
struct Scene {
  SceneKind kind = SceneKind::Unknown;
  std::filesystem::path folder;  ///< What was opened.
  std::vector<View> views;       ///< All of them, sorted by name.
  /// Names of all photographs in their order, where some may have no camera; else empty.
  std::vector<std::string> photographs;
  std::vector<int> input;            ///< Views to reconstruct from.
  std::vector<int> held_out;         ///< Views kept for evaluation.
  std::vector<SparsePoint> points;   ///< May be empty.
  bool has_old_photographs = false;  ///< Their responses are to be told apart, not exposures alone.
  double depth_scale = 0;  ///< Values of depth files per metre; 0 = 1000 where they are whole
                           ///< numbers, else 1.
  DepthKind depth_kind = DepthKind::Unknown;  ///< Of View::given_depth.
  /// World units per unit in which the cameras were stated; 1 unless they were moved since. Depth
  /// in units of the scene is in the stated unit.
  double world_per_stated_unit = 1;
  std::vector<std::string> missing;   ///< Image files that cameras name but the disk lacks.
  std::vector<std::string> warnings;  ///< One line each: what is odd but usable.
  std::vector<std::string> notes;     ///< One line each: what was done that raises no doubt.
  Frame frame;
  /// What photographs show and results do not: load_images() leaves it in, take_out_water() takes
  /// it out. Empty = none.
  std::optional<Water> water = {};
  /// Where load_images() looks before it reads files, and keeps what it made of them; copies of a
  /// scene share it. Empty = nothing is kept.
  std::shared_ptr<PhotographCache> cache = {};
};

/// Where the input cameras stand and what they look at, on their axes [scene units].
/// \throws Error as depth_range()
std::vector<Eigen::Vector3d> subject_points(const Scene& scene);

/// Moves cameras, depth ranges and sparse points of a scene into its canonical frame.
///
/// The frame is taken from the camera centres and, where the depth range or sparse points are
/// known, from the part of the scene they bound.
/// \pre scene.frame is the identity.
void to_canonical(Scene& scene);

/// Median length of the baselines between input views [scene units], of more than a thousand
/// between some of them; 0 for fewer than two.
double median_baseline(const Scene& scene);

/// What depth_range() returns: z-depths [scene units].
struct DepthRange {
  double near = 0;
  double far = 0;
};

/// A depth range that holds everything the input views may show: near and far of the view if it
/// has them, else from sparse points, else from where the optical axes converge.
/// \throws BadInput(Value) if the cameras share one centre (no depth can be measured).
DepthRange depth_range(const Scene& scene, int view);
/// Those of the input views.
std::vector<DepthRange> depth_ranges(const Scene& scene);

}  // namespace cgs
