// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cgs {

/// The stages of a run, in their order.
enum class Stage : uint8_t { Model, Scale, Views, Evaluation, Splats, Mesh, Web, Report };

/// What a stage needs without a picture, and for each pixel of pictures. Measured on the portal
/// capture at 60,000 to 620,000 pixels, of one size and of several; depth, splats and volume on
/// LLFF's fern, depth on 920,000 pixels of a temple, too. Whether colours depend on the direction
/// of view, which takes 36 bytes more of every copy of a Gaussian, is not known yet: these are
/// halfway.
struct MemoryFactors {
  double base = 0;        ///< [bytes]; 0 = the stage holds nothing to speak of.
  double of_pixel = 0;    ///< [bytes per pixel of all input views]
  double of_largest = 0;  ///< [bytes per pixel of the largest picture that is drawn]
  double of_voxel = 0;  ///< [bytes per pixel where all views are as fine as voxels], up to a limit
  double of_fused = 0;  ///< The same on top, where files are held against the fused surface.
};

/// All there is to say of a stage but the work that it does.
struct StageTraits {
  Stage id;
  const char* name;      ///< In files.
  const char* title;     ///< For people.
  MemoryFactors memory;  ///< For memory_plan().
  /// Paths below the folder of the run; one of them absent means that the stage must run. One for
  /// each input view stands where "<input>" does, for each view with a photograph where "<view>"
  /// does, and for each of level_files() where "<level>" does.
  std::vector<const char*> files = {};
  std::vector<const char*> further = {};  ///< What it may write besides, as for named_outputs().
};

inline constexpr size_t kStages = 8;

/// A row for each stage, in their order.
const std::array<StageTraits, kStages>& stage_table();

const StageTraits& traits(Stage stage);

}  // namespace cgs
