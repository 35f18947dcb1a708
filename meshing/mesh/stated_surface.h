// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "libcgs/core/measurable_mesh.h"
#include "meshing/mesh/vertex_attributes.h"

namespace cgs {

/// The place of a mesh, or the point of a cloud, nearest to some other place.
struct StatedPlace {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [internal units]
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();    ///< Unit length; 0 = unknown.
  Provenance label = Provenance::Inferred;             ///< Inferred if nothing is stated.
  std::array<VertexShare, 3> shares;                   ///< Of its vertices, the largest first.
};

/// What a mesh or point cloud states, for surfaces that are reconstructed over it. Queries may run
/// in parallel.
///
/// Faces have the label of the mesh. Points of a cloud, which have none, are labelled by their
/// support: Observed from two views on, SingleView for one, else Inferred.
class StatedSurface {
 public:
  /// \throws InvalidInput if there is neither a face of positive area nor a cloud of points
  explicit StatedSurface(const TriangleMesh& mesh);
  ~StatedSurface();
  StatedSurface(const StatedSurface&) = delete;
  StatedSurface& operator=(const StatedSurface&) = delete;

  const TriangleMesh& mesh() const { return input_.mesh; }
  bool is_cloud() const { return input_.mesh.faces.empty(); }
  bool states_provenance() const;
  /// Whether normals tell the outside: not those of a cloud that has none (or none but zeros),
  /// which are estimated.
  bool knows_sides() const { return !is_cloud() || !input_.mesh.normals.empty(); }
  StatedPlace nearest(const Eigen::Vector3d& point) const;

 private:
  struct Search;
  MeasurableMesh input_;
  std::unique_ptr<Search> search_;
};

/// The usual distance between neighbours of a point cloud: the median over its points of the mean
/// distance to their six nearest [internal units].
double point_spacing(const std::vector<Eigen::Vector3f>& points);

/// Appends to a surface of bare vertices and faces what the nearest places of the source state
/// about its vertices; normals come from there, too.
/// \return per vertex how far away that is [internal units]
std::vector<double> take_attributes(TriangleMesh& surface, const StatedSurface& source);

/// How much of a surface lies where nothing is stated [internal units squared].
struct EvidenceTransfer {
  double area = 0;     ///< Of all faces.
  double bridged = 0;  ///< Farther from the source than evidence reaches.
  double behind = 0;   ///< Near the source, but looking the other way: its back, nobody saw it.
};

/// Labels the faces of a surface made over a mesh or cloud, see take_evidence(); its vertices stay
/// as they are. A source that states no provenance leaves none.
EvidenceTransfer take_labels(TriangleMesh& surface, const StatedSurface& source, double reach);

/// Fills all that a surface made over a mesh or cloud states, from the nearest places of that.
///
/// A face takes the weakest label found at its middle and towards its corners, and is Inferred
/// where one of these is farther away than `reach` or looks the other way. Vertices take what the
/// nearest place states; their sigma becomes the root of sigma^2 + distance^2. Vertices without a
/// face that has evidence (if the source has no labels: that is no bridge and looks the same way)
/// have no sigma and support 0. Normals, if the source has some, are made from the faces. What the
/// source does not state, the surface does not state either.
/// \param surface  vertices and faces
/// \param reach    [internal units]
EvidenceTransfer take_evidence(TriangleMesh& surface, const StatedSurface& source, double reach);

}  // namespace cgs
