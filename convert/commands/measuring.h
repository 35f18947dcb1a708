// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/measure/orthophoto_files.h"
#include "convert/text/figures.h"
#include "libcgs/core/measurable_mesh.h"
#include "meshing/mesh/certificate.h"
#include "meshing/mesh/nearest_surface.h"

namespace cgs {

/// Takes figures of one mesh. Each is kept for figures(), and printed at once unless the whole is
/// to be printed as JSON. Points and planes are texts of the command line, in coordinates of the
/// file.
/// \throws InvalidInput for texts that name no point, plane or length, or none on the mesh
class Measuring {
 public:
  using Json = nlohmann::ordered_json;

  /// \param file  whose name drawings state
  Measuring(std::filesystem::path file, MeasurableMesh mesh, FigureUnit unit, bool json)
      : file_(std::move(file)), mesh_(std::move(mesh)), unit_(std::move(unit)), json_(json) {}

  void area();
  void volume();
  void bounds();
  void distance(const std::vector<std::string>& ends);
  void along(const std::vector<std::string>& ends);
  /// Length and enclosed area of a cut.
  /// \param plane     as parse_plane() takes it
  /// \param svg, dxf  drawings of the cut; none if empty
  void section(const std::string& plane,
               const std::filesystem::path& svg,
               const std::filesystem::path& dxf);
  /// \param shape  plane, sphere or cylinder
  void fit(const std::string& shape, const std::string& at, const std::string& radius);
  void orthophoto(const OrthophotoRequest& request);
  void thickness();
  void thickness_at(const std::vector<std::string>& points);
  void thickness_ply(const std::filesystem::path& path);
  void certificate();

  const Json& figures() const { return figures_; }

 private:
  void figure(const std::string& name,
              const MeasuredValue& value,
              const Json& more = Json::object());
  void figure_without_parts(const std::string& name, const MeasuredValue& value, const Json& more);
  void no_figure(const std::string& name, const std::string& reason);
  void say(const std::string& name, const std::string& text) const;
  void say_overlaps(size_t self_intersections, size_t doubled_shells) const;
  void require_inside(const char* option);
  Json surface_shares(const MeasuredValue& area) const;
  SurfacePoint pick(const std::string& text);
  Json point_json(const Eigen::Vector3d& internal) const;
  Json picked_json(const std::string& asked, const SurfacePoint& point) const;
  void say_moved(const Json& from, const Json& to) const;
  const Certificate& certified();
  const NearestSurface& surface();

  std::filesystem::path file_;
  MeasurableMesh mesh_;
  FigureUnit unit_;
  bool json_;
  Json figures_ = Json::object();
  std::optional<Certificate> certificate_;
  std::unique_ptr<NearestSurface> surface_;
};

}  // namespace cgs
