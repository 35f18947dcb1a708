// SPDX-License-Identifier: GPL-3.0-or-later
#include "python/module.h"

#include <glog/logging.h>

#include "convert/text/terminal.h"
#include "libcgs/core/version.h"

namespace {

constexpr const char* kGuide =
    R"(Photographs to Gaussians, volumes and meshes that say what was seen and what was invented.

    scene = cgs.read_scene("photos/portal", views="1,10,19")
    model = cgs.reconstruct(scene, preset="draft")
    picture = model.render(model.cameras["view_04"])  # color, depth, hole ... as arrays
    volume = model.fuse()
    mesh = volume.watertight()
    print(mesh.measure(volume=True))
    mesh.save("portal.ply")

Coordinates and lengths are those of the world: what the files of the scene have, in its unit.
Cameras look along +z, with +x to the right and +y down; pixel (0, 0) is at the top left and its
centre at (0.5, 0.5); depth is along z, NaN where it is unknown. Colours are sRGB-coded, 0 to 1.
Arrays are views of what an object holds, and may be changed in place, unless it says "new" or
"read only".

Long work lets other Python threads run. What takes `progress` calls it, if given, with the name
of the stage and the fraction done, and stops within a moment at Ctrl-C, as does certificate();
measuring, comparing, rendering, reading and saving come to their end first. What is odd but usable
becomes a UserWarning, what cannot be used one of the exceptions below cgs.Error, with the words of
the program. cgs.program has the commands of the program, on files.)";

}  // namespace

PYBIND11_MODULE(cgs, module) {
  FLAGS_minloglevel = google::GLOG_FATAL;  // steps that Ceres tries in vain are no news to a user
  module.doc() = kGuide;
  module.attr("__version__") = cgs::version();
  cgs::add_errors(module);
  cgs::add_cameras(module);
  cgs::add_scenes(module);
  cgs::add_meshes(module);
  cgs::add_splats(module);
  cgs::add_volumes(module);
  cgs::add_models(module);
  cgs::add_program(module);
}
