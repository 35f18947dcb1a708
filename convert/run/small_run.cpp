// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/small_run.h"

#include "convert/scene/refined_poses.h"
#include "io/bytes/scene_path.h"

namespace cgs {

namespace fs = std::filesystem;

RunRequest small_run(const RunRequest& request,
                     const OpenedScene& opened,
                     const char* folder,
                     int downscale) {
  RunRequest out = request;
  out.scene.options.downscale = downscale;
  out.output = request.output / folder;
  out.overwrite = true;
  if (opened.poses) {  // not to be solved for again
    make_output_folder(out.output / "model");
    fs::copy(request.output / "model" / kPosesFolder,
             out.output / "model" / kPosesFolder,
             fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  }
  if (opened.refined) write_refined_poses(out.output / "model", *opened.refined);
  return out;
}

}  // namespace cgs
