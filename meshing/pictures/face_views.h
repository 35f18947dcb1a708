// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "libcgs/core/scene.h"
#include "libcgs/core/triangle_mesh.h"

namespace cgs {

/// How well every view shows every face.
struct FaceScores {
  size_t views = 0;
  std::vector<float> score;  ///< [face * views + view]; 0 = the view does not show the face.

  float operator()(size_t face, size_t view) const { return score[face * views + view]; }
};

/// Scores by resolution and angle: image area per surface area [pixels per internal unit squared]
/// times the cosine between the face normal and the direction to the camera.
///
/// A view shows a face only if all of it is in the picture, at least half a pixel inside, on pixels
/// that are valid; faces the camera at less than 84 degrees; and is occluded nowhere: neither a
/// corner nor a pixel centre of the face lies more than 1.5 pixel footprints behind the nearest
/// surface of the mesh there. Between pixel centres that surface is interpolated, so a face right
/// beside the outline of something nearer counts as occluded. Faces of which no photograph can
/// tell anything, Inferred and Interpolated ones, are shown by no view.
/// \param views   their cameras are in the frame of the mesh; images are not looked at
FaceScores face_scores(const TriangleMesh& mesh, const std::vector<View>& views);

struct FaceViewOptions {
  /// Cost of a seam per pixel of its length: it is accepted where it lets so many pixels of the
  /// photographs be shown e times better. >= 0; 0 = each face takes its best view.
  double seam_cost = 30;

  /// \throws InvalidInput naming the first field out of range.
  void validate() const;
};

/// The view each face takes its colour from.
struct FaceViews {
  std::vector<int> of_face;     ///< Per face an index into the views; -1 = no view shows it.
  double best_seam_length = 0;  ///< Edges between faces of different views if each takes its best
                                ///< view [internal units].
  double seam_length = 0;       ///< The same, as chosen.
};

/// Chooses, of the views that show a face, one for each face, so that
///   sum over faces of area * ln(best score / score) + seam_cost * (total length of the seams)
/// is small: descent over single faces, then over connected regions of one view.
/// Source: energy as in Lempitsky & Ivanov 2007, "Seamless Mosaicing of Image-Based Texture Maps".
FaceViews choose_face_views(const TriangleMesh& mesh,
                            const FaceScores& scores,
                            const FaceViewOptions& options = {});

}  // namespace cgs
