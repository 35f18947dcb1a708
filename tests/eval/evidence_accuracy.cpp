// SPDX-License-Identifier: GPL-3.0-or-later
// How much of what a mesh calls evidence is wrong.
//
// usage: evidence_accuracy RUN_FOLDER [--scene portal|courtyard]
//
//   cgs run captures/church -o out/church && build/release/bin/evidence_accuracy out/church
//
// Without a scene, against photographs that the run did not use: of at most six of them depth is
// measured by plane sweep, with no partners but each other. Where one of them measured surface
// behind a place of mesh/watertight.ply, it looked through that place, which is contradicted. Where
// it measured surface before the place, it says nothing. Places before what no sweep measures, as
// sky and even walls, cannot be tested: the shares tell of the rest.
//
//   build/release/bin/cgs_make_capture out/capture --scene courtyard
//   V=view_01,view_02,view_03
//   build/release/bin/cgs run out/capture --views $V --assume-unit m -o out/run
//
//   build/release/bin/evidence_accuracy out/run --scene courtyard
//
// With a scene, against its truth: the share of the area of both meshes that lies within three
// sigma, at least two voxels, of the true surface.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "convert/measure/measured_file.h"
#include "convert/model/model.h"
#include "convert/run/run_record.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/core/error.h"
#include "libcgs/priors/alignment.h"
#include "libcgs/priors/estimate_priors.h"
#include "libcgs/priors/plane_sweep.h"
#include "meshing/mesh/mesh_distance.h"
#include "samples/capture/courtyard.h"

namespace {

using namespace cgs;
using Eigen::Vector3d;

constexpr double kSigmas = 3;
constexpr double kVoxels = 2;

// A point of the surface that photographs show; all stand for the same area.
struct Spot {
  Vector3d position;
  Vector3d normal;
  double sigma = 0;  // mean of the corners of its face; 0 = no statement
  Provenance label = Provenance::Inferred;
};

struct Tally {
  size_t all = 0;
  size_t tested = 0;
  size_t wrong = 0;
  void operator+=(const Tally& other) {
    all += other.all;
    tested += other.tested;
    wrong += other.wrong;
  }
};
using Tallies = std::array<Tally, kProvenanceCount>;

Tally& tally_of(Tallies& tallies, Provenance label) {
  return tallies.at(static_cast<size_t>(label));
}

// \throws BadInput for a mesh that does not say what was observed
MeasurableMesh read_labelled(const std::filesystem::path& path) {
  MeasurableMesh out = read_measured(path, "").content;
  if (!out.states_provenance()) {
    throw BadInput(Defect::Missing, path, "does not say what was observed");
  }
  return out;
}

// The mesh at other places; `length` is that of an internal unit of its file there.
TriangleMesh placed(const MeasurableMesh& file,
                    const std::function<Vector3d(const Vector3d& in_world)>& place,
                    double length) {
  TriangleMesh out = file.mesh;
  for (size_t v = 0; v < out.vertices.size(); ++v) {
    out.vertices[v] = place(file.frame.world_from_internal(file.points[v])).cast<float>();
  }
  for (float& sigma : out.sigma) sigma *= static_cast<float>(length);
  return out;
}

// World units of the run's files. \throws BadInput
double voxel_size(const std::filesystem::path& run) {
  const std::filesystem::path path = run / "run.json";
  const nlohmann::ordered_json record = read_run_record(path);
  const nlohmann::ordered_json::json_pointer place("/stages/mesh/result/fusion/voxel_size");
  if (!record.is_object() || !record.contains(place)) {
    throw BadInput(Defect::Missing, path, "is no record of a run that made a mesh");
  }
  return record.at(place).get<double>();
}

double mean_sigma(const TriangleMesh& mesh, const std::array<uint32_t, 3>& face) {
  double sum = 0;
  int count = 0;
  for (const uint32_t v : face) {
    if (mesh.sigma.empty() || !std::isfinite(mesh.sigma[v])) continue;
    sum += static_cast<double>(mesh.sigma[v]);
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

// Spread evenly over the faces that photographs show.
std::vector<Spot> shown_spots(const TriangleMesh& mesh) {
  constexpr size_t kSpots = 200'000;
  TriangleMesh shown;
  shown.vertices = mesh.vertices;
  shown.sigma = mesh.sigma;
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    if (!is_shown(mesh.provenance[f])) continue;
    shown.faces.push_back(mesh.faces[f]);
    shown.provenance.push_back(mesh.provenance[f]);
  }
  const SurfaceSamples samples = sample_faces(shown, kSpots);
  std::vector<Spot> out;
  out.reserve(samples.points.size());
  for (size_t i = 0; i < samples.points.size(); ++i) {
    const uint32_t f = samples.faces[i];
    out.push_back({samples.points[i].cast<double>(),
                   area_vector(shown, shown.faces[f]).normalized(),
                   mean_sigma(shown, shown.faces[f]),
                   shown.provenance[f]});
  }
  return out;
}

// A line of the table. The area is in units of the file, squared.
struct Line {
  std::string name;
  double area = 0;
  Tally tally;
};

std::vector<Line> lines(const MeasurableMesh& file, Tallies tallies) {
  std::array<double, kProvenanceCount> areas = area_by_provenance(file.mesh);
  for (double& area : areas) area *= file.frame.scale * file.frame.scale;
  const auto line = [&](Provenance label) {
    return Line{std::string(provenance_name(label)),
                areas.at(static_cast<size_t>(label)),
                tally_of(tallies, label)};
  };
  std::vector<Line> out = {line(Provenance::Observed), line(Provenance::SingleView)};
  Line both{"evidence", out[0].area + out[1].area, out[0].tally};
  both.tally += out[1].tally;
  out.push_back(both);
  out.push_back(line(Provenance::Estimated));
  out.push_back(line(Provenance::Inferred));
  return out;
}

std::string percent(size_t part, size_t whole) {
  if (whole == 0) return "-";
  std::array<char, 16> text{};
  std::snprintf(text.data(),
                text.size(),
                "%.2f %%",
                100 * static_cast<double>(part) / static_cast<double>(whole));
  return text.data();
}

std::string area_heading(const Frame& frame) {
  return frame.has_metric_scale() ? "area [" + frame.unit_name() + "^2]" : "area [units^2]";
}

// A view that the run did not use, and the depth it measured.
struct Witness {
  std::string name;
  Camera camera;
  ViewPriors seen;

  bool has_measured(int x, int y) const {
    return seen.origin.contains(x, y) && seen.origin(x, y) == DepthOrigin::Measured;
  }
  double measured_share() const {
    const auto& origins = seen.origin.data;
    return static_cast<double>(std::count(origins.begin(), origins.end(), DepthOrigin::Measured)) /
           static_cast<double>(origins.size());
  }
};

enum class Verdict { None, Agrees, Contradicts };

// Between four pixels the nearest counts: beside the edge of something near, a witness that looks
// past it has seen no more than that. All in the frame of the model.
Verdict verdict(const Witness& witness, const Spot& spot, double voxel) {
  constexpr double kLeastFacing = 0.2;  // cosine; beyond, a little error is a long way in depth
  constexpr double kOfDepth = 0.02;
  const Vector3d uvz = witness.camera.project(spot.position);
  if (!witness.camera.sees(uvz)) return Verdict::None;
  const Vector3d to_camera = (witness.camera.center() - spot.position).normalized();
  if (!(spot.normal.dot(to_camera) >= kLeastFacing)) return Verdict::None;
  const int x = static_cast<int>(std::floor(uvz.x() - 0.5));
  const int y = static_cast<int>(std::floor(uvz.y() - 0.5));
  double depth = std::numeric_limits<double>::infinity();
  double sigma = 0;
  for (int k = 0; k < 4; ++k) {
    const int u = x + k % 2;
    const int v = y + k / 2;
    if (!witness.has_measured(u, v)) return Verdict::None;
    depth = std::min(depth, static_cast<double>(witness.seen.depth(u, v)));
    sigma = std::max(sigma, static_cast<double>(witness.seen.sigma(u, v)));
  }
  const double margin =
      std::max({kOfDepth * depth, kSigmas * std::hypot(sigma, spot.sigma), kVoxels * voxel});
  if (depth < uvz.z() - margin) return Verdict::None;  // it is hidden there
  return depth > uvz.z() + margin ? Verdict::Contradicts : Verdict::Agrees;
}

Tallies judged(const std::vector<Spot>& spots,
               const std::vector<Witness>& witnesses,
               double voxel) {
  Tallies out{};
  for (const Spot& spot : spots) {
    bool is_tested = false;
    bool is_contradicted = false;
    for (const Witness& witness : witnesses) {
      const Verdict said = verdict(witness, spot, voxel);
      is_tested = is_tested || said != Verdict::None;
      is_contradicted = is_contradicted || said == Verdict::Contradicts;
    }
    tally_of(out, spot.label) += {1, is_tested ? size_t{1} : 0, is_contradicted ? size_t{1} : 0};
  }
  return out;
}

// Views with a photograph that the run did not use: each input view in turn takes the nearest to
// it, so that they see what the mesh shows, and each other's part of it.
std::vector<int> unused_views(const Scene& scene) {
  constexpr size_t kMost = 6;
  std::vector<int> left;
  for (int i = 0; i < static_cast<int>(scene.views.size()); ++i) {
    const bool is_input = std::find(scene.input.begin(), scene.input.end(), i) != scene.input.end();
    if (!is_input && !scene.views[static_cast<size_t>(i)].image_path.empty()) left.push_back(i);
  }
  const auto center = [&](int i) { return scene.views[static_cast<size_t>(i)].camera.center(); };
  std::vector<int> out;
  for (size_t turn = 0; !left.empty() && !scene.input.empty() && out.size() < kMost; ++turn) {
    const Vector3d from = center(scene.input[turn % scene.input.size()]);
    const auto nearest = std::min_element(left.begin(), left.end(), [&](int a, int b) {
      return (center(a) - from).norm() < (center(b) - from).norm();
    });
    out.push_back(*nearest);
    left.erase(nearest);
  }
  std::sort(out.begin(), out.end());
  return out;
}

// What the views `unused` measure together with `partners`, in the frame of the scene.
std::vector<Witness> witnesses_of(Scene scene,
                                  const std::vector<int>& unused,
                                  const std::vector<int>& partners) {
  scene.input = unused;
  scene.input.insert(scene.input.end(), partners.begin(), partners.end());
  load_images(scene, scene.input);
  std::vector<ViewPriors> priors = plane_sweep(scene, {});
  align_depths(scene, priors, AlignmentOptions{});
  std::vector<Witness> out;
  for (size_t k = 0; k < unused.size(); ++k) {
    const View& view = scene.views[static_cast<size_t>(unused[k])];
    out.push_back({view.name, view.camera, std::move(priors[k])});
  }
  return out;
}

// \throws BadInput if there is no photograph but those of input views
std::vector<Witness> find_witnesses(const Scene& scene) {
  const std::vector<int> unused = unused_views(scene);
  if (unused.empty()) {
    throw BadInput(Defect::Empty, scene.folder, "has no photograph but those the run used");
  }
  if (unused.size() > 1) {
    std::vector<Witness> alone = witnesses_of(scene, unused, {});
    const bool has_any = std::any_of(alone.begin(), alone.end(), [](const Witness& witness) {
      return witness.measured_share() >= kLeastMeasured;
    });
    if (has_any) {
      std::printf("depth of unused views, measured from each other alone\n");
      return alone;
    }
  }
  std::printf(
      "depth of unused views, measured from each other AND from input views, as they see too "
      "little "
      "together: it shares errors with the mesh\n");
  return witnesses_of(scene, unused, scene.input);
}

void against_unused_views(const std::filesystem::path& run) {
  const MeasurableMesh file = read_labelled(run / "mesh/watertight.ply");
  const Scene scene = read_model(run / "model").scene;
  const Frame& frame = scene.frame;
  // The model may be in the unit of its cameras and the mesh in metres.
  const bool are_metric = file.frame.has_metric_scale() && frame.has_metric_scale();
  const double units = are_metric ? file.frame.metres_per_unit / frame.metres_per_unit : 1;
  const TriangleMesh mesh = placed(
      file,
      [&](const Vector3d& p) { return frame.internal_from_world(units * p); },
      units * file.frame.scale / frame.scale);
  const std::vector<Witness> witnesses = find_witnesses(scene);
  for (const Witness& witness : witnesses) {
    std::printf("%s  measured %.1f %%\n", witness.name.c_str(), 100 * witness.measured_share());
  }
  const double voxel = voxel_size(run) * units / frame.scale;
  std::printf("%-14s %14s  %9s  %s\n",
              "watertight",
              area_heading(file.frame).c_str(),
              "testable",
              "contradicted");
  for (const Line& line : lines(file, judged(shown_spots(mesh), witnesses, voxel))) {
    const Tally& t = line.tally;
    std::printf("%-14s %14.6g  %9s  %s\n",
                line.name.c_str(),
                line.area,
                percent(t.tested, t.all).c_str(),
                percent(t.wrong, t.tested).c_str());
  }
}

PortalScene scene_named(const std::string& name) {
  if (name == "portal") return portal_scene();
  if (name == "courtyard") return courtyard_scene();
  throw InvalidInput("--scene must be portal or courtyard, but is " + name);
}

// In metres. The truth knows no labels, so that all spots are tested.
Tallies compared(const std::vector<Spot>& spots, const DistanceToMesh& truth, double voxel) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(spots.size());
  for (const Spot& spot : spots) points.push_back(spot.position.cast<float>());
  const std::vector<float> distances = truth.of(points);
  Tallies out{};
  for (size_t i = 0; i < spots.size(); ++i) {
    const double margin = std::max(kSigmas * spots[i].sigma, kVoxels * voxel);
    const bool is_wrong = static_cast<double>(distances[i]) > margin;
    tally_of(out, spots[i].label) += {1, 1, is_wrong ? size_t{1} : 0};
  }
  return out;
}

void against_truth(const std::filesystem::path& run, const std::string& scene) {
  const DistanceToMesh truth(scene_named(scene).mesh);
  for (const std::string name : {"watertight", "surface"}) {
    const MeasurableMesh file = read_labelled(run / "mesh" / (name + ".ply"));
    require(file.frame.has_metric_scale(),
            "the run must know its unit (--assume-unit m): that of mesh/" + name + ".ply must be m",
            file.frame.unit_name());
    const double metres = file.frame.metres_per_unit;
    const TriangleMesh mesh = placed(
        file, [&](const Vector3d& p) { return Vector3d(metres * p); }, metres * file.frame.scale);
    const double voxel = metres * voxel_size(run);
    std::printf("%-14s %14s  within %g sigma, at least %.1f mm, of the truth\n",
                name.c_str(),
                area_heading(file.frame).c_str(),
                kSigmas,
                1e3 * kVoxels * voxel);
    for (const Line& line : lines(file, compared(shown_spots(mesh), truth, voxel))) {
      const Tally& t = line.tally;
      std::printf("%-14s %14.6g  %s\n",
                  line.name.c_str(),
                  line.area,
                  percent(t.tested - t.wrong, t.tested).c_str());
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const bool names_scene = argc == 4 && std::string(argv[2]) == "--scene";
  if (argc != 2 && !names_scene) {
    std::fprintf(stderr, "usage: evidence_accuracy RUN_FOLDER [--scene portal|courtyard]\n");
    return 2;
  }
  try {
    if (names_scene) {
      against_truth(argv[1], argv[3]);
    } else {
      against_unused_views(argv[1]);
    }
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "evidence_accuracy: %s\n", error.what());
    return 1;
  }
}
