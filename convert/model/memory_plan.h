// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "convert/model/stage.h"
#include "libcgs/coherence/coherent_gaussians.h"
#include "libcgs/core/scene.h"
#include "libcgs/train/training_options.h"

namespace cgs {

/// Largest memory of the process while a stage of a run works [bytes].
struct StageMemory {
  Stage stage = Stage::Model;
  size_t bytes = 0;
};

/// What a run holds against the fused surface, which it then needs beside it.
struct MeasuredFiles {
  bool meshes = false;  ///< RunRequest::max_error
  bool asset = false;   ///< RunRequest::max_error or max_size
};

/// What a run is asked for that changes how much memory its stages take.
struct PictureWork {
  /// False where the user says how large voxels are: stages that depend on them are then left out
  /// of the plan, and the volume itself refuses what does not fit.
  bool chooses_voxels = true;
  MeasuredFiles measured = {};
  CoherenceOptions coherence = {};  ///< Of the training: networks hold much more than lattices.
  SplatMethod method = SplatMethod::Coherent;  ///< Free Gaussians hold more each.
  double match_lists = 0;                      ///< match_lists() of the training.
  int downscale = 1;                           ///< Divides the sides of the pictures once more.
};

/// How many lists of corresponding pixels a training keeps, per view and neighbour: one of the flow
/// term, and one for both of the views between which virtual ones stand.
double match_lists(const TrainingOptions& training);

/// Predicts what the stages of a run will need, from the sizes of its pictures alone.
///
/// What a stage holds grows with the pixels of the input views: a Gaussian, a few voxels and a few
/// faces come of each. The factors are measured; see docs/reliability.md for how well they hold.
std::vector<StageMemory> memory_plan(const Scene& scene, const PictureWork& work = {});

/// How many pixels these views have together.
double pixels_of(const Scene& scene, const std::vector<int>& views);

/// "410 MiB"
std::string mebibytes(size_t bytes);

/// "depth and Gaussians 410 MiB, views 320 MiB, …"
std::string memory_plan_text(const std::vector<StageMemory>& plan);

/// \throws LimitError naming the stage of memory_plan() that needs most and by how much to scale
///         the pictures down, if it needs more than `budget` [bytes].
void check_memory_plan(const Scene& scene, const PictureWork& work, size_t budget);

/// The same for the training alone, the first stage.
/// \throws LimitError
void check_training_memory(const Scene& scene, size_t budget, const TrainingOptions& training);

/// What `convert` makes of splats that came without cameras.
struct SplatWork {
  uint64_t splats = 0;
  uint64_t harmonics = 1;        ///< RGB coefficients of each.
  uint64_t file_bytes = 0;       ///< 0 = read already.
  uint64_t pictures = 0;         ///< Of virtual cameras; 0 = none are taken.
  uint64_t picture_pixels = 0;   ///< Of each.
  uint64_t read_back_bytes = 0;  ///< Of a file of them that was written; 0 = it is not read.
  bool finds_floaters = false;
};

/// A piece of that work.
struct SplatMemory {
  const char* work;      ///< For people.
  size_t bytes = 0;      ///< Largest memory of the process during it.
  const char* to_lower;  ///< What makes it need less, for people.
};

/// The same for splats: reading, floaters, pictures, reading back. How large voxels will be is
/// known only after the pictures: the volume itself refuses what does not fit.
std::vector<SplatMemory> splat_memory_plan(const SplatWork& work);

/// \throws LimitError naming the work of splat_memory_plan() that needs most and what to lower, if
///         it needs more than `budget` [bytes].
void check_splat_memory_plan(const SplatWork& work, size_t budget);

/// Memory the program may plan for: the user's limit, or 80 % of what is free now, on the machine
/// or within the limit of the container it runs in [bytes].
size_t memory_budget(size_t limit);

/// What a control group may still take: the number in the file `most` less that in `now`, without
/// files that are only cached [bytes]; the largest number if there is no such limit.
/// Source: Linux kernel, admin-guide/cgroup-v2 (memory.max, memory.current) and cgroup-v1/memory.
size_t free_of_group(const std::filesystem::path& folder, const char* most, const char* now);

/// The least of that over the groups that a process is in, of either version, and those above them.
/// \param root        where groups are mounted, /sys/fs/cgroup
/// \param of_process  lines as of /proc/self/cgroup: "0::/PATH", "4:memory:/PATH"
/// Source: Linux manual, cgroups(7).
size_t free_of_groups(const std::filesystem::path& root, std::istream& of_process);

}  // namespace cgs
