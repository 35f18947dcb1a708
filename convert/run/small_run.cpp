// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/small_run.h"

#include <algorithm>
#include <filesystem>
#include <vector>

#include "convert/scene/photo_poses.h"
#include "convert/scene/refined_poses.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/scene_path.h"
#include "io/scenes/view_names.h"

namespace cgs {

namespace fs = std::filesystem;

std::string views_of_run(const RunRequest& request, const Scene& scene) {
  const SceneOptions& options = request.scene.options;
  if (options.all_views || !options.views.empty()) return options.views;
  const std::vector<std::string> names = view_names(scene, scene.input);
  const bool are_listable = std::all_of(names.begin(), names.end(), &is_listable);
  return are_listable ? view_list(names) : std::string();
}

RunRequest small_run(const RunRequest& request,
                     const OpenedScene& opened,
                     const char* folder,
                     int downscale) {
  RunRequest out = request;
  out.scene.options.downscale = downscale;
  out.output = request.output / folder;
  out.overwrite = true;
  const fs::path poses = out.output / "model" / kPosesFolder;  // not to be solved for again
  if (opened.poses && opened.poses->is_stored) {
    make_output_folder(poses.parent_path());
    fs::copy(request.output / "model" / kPosesFolder,
             poses,
             fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  } else if (opened.poses) {
    write_photo_poses(poses, *opened.poses);
  }
  if (opened.refined) write_refined_poses(out.output / "model", *opened.refined);
  return out;
}

}  // namespace cgs
