// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

#include "libcgs/core/photo_texture.h"
#include "libcgs/core/scene.h"
#include "libcgs/core/triangle_mesh.h"
#include "libcgs/priors/view_priors.h"

namespace cgs {

/// What photographs show of a mesh; lengths and areas in units of files.
struct TextureReport {
  struct Shown {
    std::string name;  ///< Of the view.
    size_t faces = 0;
    double area = 0;
    Eigen::Vector3f gain = Eigen::Vector3f::Ones();  ///< Its pixels were multiplied by.
    size_t samples = 0;                              ///< Surface points by which its exposure was
                                                     ///< levelled.
  };
  std::string left_out;  ///< Why there is none, for people; empty = there is one.
  std::vector<Shown> views;
  size_t faces_without_view = 0;  ///< Of seen surface.
  double area_without_view = 0;
  /// Between linear texture coordinates and the projection, at the middles of edges [pixels].
  double largest_stretch = 0;
  double seam_length = 0;
  double seam_length_unsmoothed = 0;
  /// Mean difference of colour across seams before they were levelled, and left after it [of 1].
  double seam_step_unlevelled = 0;
  double seam_step = 0;

  /// Of watertight.obj, where there is one.
  struct Atlas {
    Eigen::Vector2i size = Eigen::Vector2i::Zero();  ///< Width and height [pixels].
    size_t charts = 0;
    double texel = 0;  ///< Of the finest charts, on the surface.
  };
  std::optional<Atlas> atlas;
};

/// {"views": [{"name", "faces", "area", "gain": [r, g, b], "samples"}], "faces_without_view", …};
/// or {"left_out": "why"}
nlohmann::ordered_json texture_to_json(const TextureReport& report, const Frame& frame);

struct PhotographedMesh {
  PhotoTexture texture;  ///< Empty if a photograph is missing.
  TextureReport report;
};

/// Loads the input photographs of a scene, chooses one for every face, and levels their exposure
/// and what differs along their seams.
/// \param scene   in the frame of the mesh
/// \param priors  of its input views: what they call transient is not shown; may be empty
/// \throws Error as load_images()
PhotographedMesh texture_from_photographs(const Scene& scene,
                                          const std::vector<ViewPriors>& priors,
                                          const TriangleMesh& mesh);

/// The size of a pixel on the surface [internal units], of the photograph where it is smallest, by
/// the median over the faces that show it; 0 where none is shown.
double texel_size(const PhotoTexture& texture, const TriangleMesh& mesh);

/// Brings a photograph and its camera to a smaller size.
void reduce(Photograph& photograph, int width, int height);

/// Makes photographs smaller whose pixels cover less of the surface than `texel` [internal units],
/// by the median over the faces that show them, until they cover that; none below 16 pixels.
/// \return the largest share of its width that a photograph in use keeps, 1 if there is none
double coarsen_texture(PhotoTexture& texture, const TriangleMesh& mesh, double texel);

}  // namespace cgs
