// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/disk_plan.h"

#include <system_error>

#include "convert/model/memory_plan.h"

namespace cgs {

namespace {

namespace fs = std::filesystem;

uint64_t bytes_in(const fs::path& folder) {
  uint64_t sum = 0;
  std::error_code error;
  for (fs::recursive_directory_iterator file(folder, error), end; !error && file != end;
       file.increment(error)) {
    std::error_code is_no_file;
    const uint64_t size = fs::file_size(file->path(), is_no_file);
    if (!is_no_file) sum += size;
  }
  return sum;
}

}  // namespace

uint64_t disk_plan(const Scene& scene) {
  // Measured on the portal at three sizes: a drawn view is 36 bytes a pixel, a pixel of an input
  // view becomes a Gaussian, voxels and faces, in each of several files, and pictures of the mesh
  // do not depend on it.
  constexpr double kBase = 12e6;
  constexpr double kOfDrawn = 36;
  constexpr double kOfInput = 330;
  const double input = pixels_of(scene, scene.input);
  const double drawn = input + pixels_of(scene, scene.held_out);
  return static_cast<uint64_t>(kBase + kOfDrawn * drawn + kOfInput * input);
}

std::string little_room_warning(const Scene& scene, const fs::path& folder, uint64_t available) {
  const uint64_t need = disk_plan(scene);
  const uint64_t there = bytes_in(folder);
  if (need <= there || need - there <= available) return "";
  return "the disk of '" + folder.string() + "' has room for " + mebibytes(available) +
         ", and this run writes about " + mebibytes(need - there) +
         "; it will keep what it finished and go on when there is more";
}

std::string little_room_warning(const Scene& scene, const fs::path& folder) {
  std::error_code error;
  const fs::space_info space = fs::space(folder, error);
  return error ? "" : little_room_warning(scene, folder, space.available);
}

}  // namespace cgs
