// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/e2e/bad_inputs/case.h"
#include "tests/support/scene_files.h"
#include "tests/support/temp_dir.h"

/// Small valid inputs, for the cases to damage. All show the same: three pictures of 32 x 24 pixels
/// whose cameras stand side by side.
namespace cgs::test {

namespace fs = std::filesystem;

inline constexpr int kWidth = 32;
inline constexpr int kHeight = 24;
inline constexpr double kFocal = 30;

/// A picture with texture that moves as if the scene were 1.5 units away.
std::string picture_png(int view);

/// Calls that use the input below `folder`.
Call info_call(const fs::path& folder);    ///< cgs info scene --json
Call train_call(const fs::path& folder);   ///< cgs train scene -q -o out
Call run_call(const fs::path& folder);     ///< cgs run scene -q -o out
Call render_call(const fs::path& folder);  ///< cgs render model -q -o out
Call mesh_call(const fs::path& folder);    ///< cgs mesh volume.vdb -q -o out

/// Holds a lock on a folder until this process ends, as a running program would.
void lock_for_good(const fs::path& path);

/// transforms.json as a document, for a case to change and write.
nlohmann::json transforms();
void write_transforms_scene(const fs::path& folder, const nlohmann::json& document = transforms());

/// Rows of poses_bounds.npy.
std::vector<std::vector<double>> llff_rows(int views = 3);
void write_llff_scene(const fs::path& folder, const std::string& poses = npy_of_rows(llff_rows()));

/// A COLMAP model in bytes.
struct ColmapFiles {
  std::string cameras;
  std::string images;
  std::string points;
};
struct ColmapImageFields {
  uint32_t id = 1;
  std::array<double, 4> rotation = {1, 0, 0, 0};
  std::array<double, 3> translation = {0, 0, 0};
  uint32_t camera = 1;
  std::string name = "0.png";
  uint64_t point_of_keypoint = ~uint64_t{0};
};
std::string colmap_camera(uint32_t id,
                          int32_t model,
                          const std::vector<double>& parameters,
                          uint64_t width = kWidth,
                          uint64_t height = kHeight);
std::string colmap_image(const ColmapImageFields& fields);
std::string colmap_point(const std::array<double, 3>& xyz,
                         const std::vector<std::pair<uint32_t, uint32_t>>& track);
ColmapFiles colmap_files();
void write_colmap_scene(const fs::path& folder, const ColmapFiles& files = colmap_files());
void write_colmap_text_scene(const fs::path& folder);

void write_strecha_scene(const fs::path& folder);

/// A model folder, and a volume fused from it, as the program makes them (once per process).
void write_model_folder(const fs::path& folder);
void write_volume_file(const fs::path& folder);
void write_finished_run(const fs::path& folder);  ///< scene, and out with every asset

/// PLY of Gaussians.
struct SplatPly {
  std::string format = "binary_little_endian";
  std::string before_elements;                                  ///< More header lines.
  std::vector<std::pair<std::string, std::string>> properties;  ///< type, name
  std::vector<std::vector<double>> rows;
  std::string count;  ///< As declared; empty = the number of rows.
  std::string after;  ///< Bytes behind the rows.

  void set(size_t row, const std::string& name, double value);
  void remove(const std::string& name);
  std::string bytes() const;
};
SplatPly splats(int count = 30, int sh_rest = 9);

}  // namespace cgs::test
