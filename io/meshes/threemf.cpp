// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/threemf.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <numeric>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>
#include <Model/COM/NMR_DLLInterfaces.h>

#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_writer.h"
#include "io/bytes/content_uuid.h"
#include "io/bytes/lack_of_memory.h"
#include "io/bytes/mesh_arrays.h"
#include "libcgs/core/error.h"
#include "libcgs/core/provenance.h"

namespace cgs {

namespace {

/// An object of the library, given back on every way out.
class Handle {
 public:
  Handle() = default;
  ~Handle() {
    if (value_ != nullptr) NMR::lib3mf_release(value_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  NMR::PLib3MFBase** out() { return &value_; }
  NMR::PLib3MFBase* get() const { return value_; }

 private:
  NMR::PLib3MFBase* value_ = nullptr;
};

/// Calls into the library cannot fail on a checked mesh, short of memory.
void check(HRESULT result, const char* step) {
  if (result == 0) return;
  throw_if_memory_ran_out();
  throw NumericalError(std::string("write_3mf: lib3mf refused to ") + step + ", code " +
                       std::to_string(static_cast<uint32_t>(result)));
}

/// "Surface by origin: observed 61.2 %, …", by area.
std::string shares_by_origin(const TriangleMesh& mesh) {
  const auto area = area_by_provenance(mesh);
  const double total = std::accumulate(area.begin(), area.end(), 0.0);
  std::string out = "Surface by origin:";
  for (const Provenance label : kProvenanceOrder) {
    std::array<char, 64> text{};
    const double percent = total > 0 ? 100 * area.at(static_cast<size_t>(label)) / total : 0;
    std::snprintf(text.data(), text.size(), " %.1f %%,", percent);
    out += ' ';
    out += provenance_name(label);
    out += text.data();
  }
  out.back() = '.';
  return out;
}

std::string description(const TriangleMesh& mesh, const Frame& frame, const std::string& origin) {
  std::string out = mesh.provenance.empty() ? "What of the surface was observed is not stated."
                                            : shares_by_origin(mesh);
  out += " Scale: " + scale_source_name(frame.scale_source);
  if (frame.metres_sigma > 0) {
    out += ", relative sigma ";
    append_number(out, frame.metres_sigma / frame.metres_per_unit);
  }
  out += ';';
  if (!origin.empty()) out += " Coordinates of the scene: add " + origin + " mm.";
  return out;
}

/// A unit of the format in which six decimals hold a mesh.
struct FileUnit {
  NMR::eModelUnit name;
  double per_millimetre;
};

/// Millimetres, unless the mesh is too small or too far out for them.
/// \throws InvalidInput if no unit holds it
FileUnit file_unit(const Eigen::AlignedBox3d& box) {
  constexpr std::array<FileUnit, 3> kUnits = {{{NMR::MODELUNIT_MILLIMETER, 1},
                                               {NMR::MODELUNIT_MICROMETER, 1e3},
                                               {NMR::MODELUNIT_METER, 1e-3}}};
  constexpr double kStep = 1e-6;
  constexpr double kLeastSteps = 1 << 16;  // across the mesh
  constexpr double kFarthest = 1e9;        // what lib3mf takes
  const double width = box.sizes().maxCoeff();
  const double reach = std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
  for (const FileUnit& unit : kUnits) {
    if (width * unit.per_millimetre < kLeastSteps * kStep) continue;
    if (reach * unit.per_millimetre < kFarthest) return unit;
  }
  std::array<char, 160> text{};
  std::snprintf(
      text.data(),
      text.size(),
      "write_3mf: the mesh is %.3g mm wide and reaches %.3g mm from its origin; 3MF holds "
      "widths from 6.6e-5 mm and 1e12 mm from the origin",
      width,
      reach);
  throw InvalidInput(text.data());
}

/// Faces that are surface: the format forbids those that name a vertex twice.
std::vector<size_t> faces_of_surface(const TriangleMesh& mesh) {
  std::vector<size_t> out;
  out.reserve(mesh.faces.size());
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const auto& [a, b, c] = mesh.faces[f];
    if (a != b && b != c && c != a) out.push_back(f);
  }
  if (out.empty()) throw InvalidInput("write_3mf: every face names a vertex twice");
  return out;
}

/// Whether every edge has two faces that pass it in opposite directions: what the format demands of
/// an object that is a model, where others are surfaces.
bool is_solid(const TriangleMesh& mesh, const std::vector<size_t>& faces) {
  std::vector<uint64_t> up;
  std::vector<uint64_t> down;
  for (const size_t f : faces) {
    for (size_t k = 0; k < 3; ++k) {
      const uint64_t from = mesh.faces[f].at(k);
      const uint64_t to = mesh.faces[f].at((k + 1) % 3);
      (from < to ? up : down).push_back(std::min(from, to) << 32 | std::max(from, to));
    }
  }
  std::sort(up.begin(), up.end());
  std::sort(down.begin(), down.end());
  return up == down && std::adjacent_find(up.begin(), up.end()) == up.end();
}

bool looks_inward(const TriangleMesh& mesh, const std::vector<size_t>& faces) {
  const Eigen::Vector3d from = mesh.vertices[mesh.faces[faces.front()][0]].cast<double>();
  double volume = 0;
  for (const size_t f : faces) {
    std::array<Eigen::Vector3d, 3> p;
    for (size_t k = 0; k < 3; ++k) {
      p.at(k) = mesh.vertices[mesh.faces[f].at(k)].cast<double>() - from;
    }
    volume += p[0].dot(p[1].cross(p[2]));
  }
  return volume < 0;
}

/// Vertices and faces as lib3mf takes them.
struct Geometry {
  std::vector<NMR::MODELMESHVERTEX> vertices;
  std::vector<NMR::MODELMESHTRIANGLE> triangles;
  NMR::eModelUnit unit = NMR::MODELUNIT_MILLIMETER;
  bool is_solid = false;
};

/// Closed surfaces that look inward are turned, as the format demands.
Geometry geometry(const TriangleMesh& mesh,
                  const std::vector<size_t>& faces,
                  const Frame& frame,
                  const Eigen::Matrix3d& up_rotation) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& v : mesh.vertices) box.extend(millimetres(v, frame, up_rotation));
  const FileUnit unit = file_unit(box);
  Geometry out;
  out.unit = unit.name;
  out.is_solid = is_solid(mesh, faces);
  out.vertices.resize(mesh.vertices.size());
  for (size_t i = 0; i < out.vertices.size(); ++i) {
    const Eigen::Vector3d p =
        unit.per_millimetre * millimetres(mesh.vertices[i], frame, up_rotation);
    for (int k = 0; k < 3; ++k) out.vertices[i].m_fPosition[k] = static_cast<float>(p[k]);
  }
  const bool is_inside_out = out.is_solid && looks_inward(mesh, faces);
  out.triangles.resize(faces.size());
  for (size_t i = 0; i < faces.size(); ++i) {
    std::array<uint32_t, 3> face = mesh.faces[faces[i]];
    if (is_inside_out) std::swap(face[1], face[2]);
    std::copy(face.begin(), face.end(), out.triangles[i].m_nIndices);
  }
  return out;
}

// The library takes no const pointers, and changes nothing.
void set_geometry(NMR::PLib3MFBase* object, Geometry& content) {
  check(NMR::lib3mf_meshobject_setgeometry(object,
                                           content.vertices.data(),
                                           static_cast<DWORD>(content.vertices.size()),
                                           content.triangles.data(),
                                           static_cast<DWORD>(content.triangles.size())),
        "take the geometry");
  check(NMR::lib3mf_object_settype(
            object, content.is_solid ? NMR::MODELOBJECTTYPE_MODEL : NMR::MODELOBJECTTYPE_SURFACE),
        "say whether it encloses a volume");
}

void set_materials(NMR::PLib3MFBase* model,
                   NMR::PLib3MFBase* object,
                   const TriangleMesh& mesh,
                   const std::vector<size_t>& faces) {
  Handle group;
  check(NMR::lib3mf_model_addbasematerialgroup(model, group.out()), "add materials");
  std::array<DWORD, kProvenanceCount> index{};
  for (const Provenance label : kProvenanceOrder) {
    const auto i = static_cast<size_t>(label);
    const auto& [red, green, blue] = traits(label).color;
    const std::string name(provenance_name(label));
    check(NMR::lib3mf_basematerial_addmaterialutf8(
              group.get(), name.c_str(), red, green, blue, &index.at(i)),
          "add a material");
    check(NMR::lib3mf_basematerial_setdisplaycolorrgba(
              group.get(), index.at(i), red, green, blue, 255),
          "make a material opaque");
  }
  DWORD group_id = 0;
  check(NMR::lib3mf_resource_getresourceid(group.get(), &group_id), "name the materials");
  std::vector<NMR::ModelResourceID> groups(faces.size(), group_id);
  std::vector<DWORD> materials(faces.size());
  for (size_t i = 0; i < materials.size(); ++i) {
    materials[i] = index.at(static_cast<size_t>(mesh.provenance[faces[i]]));
  }
  Handle properties;
  check(NMR::lib3mf_meshobject_createpropertyhandler(object, properties.out()), "label faces");
  check(NMR::lib3mf_propertyhandler_setbasematerialarray(
            properties.get(), groups.data(), materials.data()),
        "label faces");
  // Readers that ignore faces' own properties need one on the object: what holds of all of it.
  const auto is_weaker = [&](size_t a, size_t b) {
    return evidence_rank(mesh.provenance[a]) < evidence_rank(mesh.provenance[b]);
  };
  const size_t weakest = *std::min_element(faces.begin(), faces.end(), is_weaker);
  Handle defaults;
  check(NMR::lib3mf_object_createdefaultpropertyhandler(object, defaults.out()),
        "label the object");
  check(NMR::lib3mf_defaultpropertyhandler_setbasematerial(
            defaults.get(), group_id, index.at(static_cast<size_t>(mesh.provenance[weakest]))),
        "label the object");
}

/// The library would draw them at random.
void set_uuids(NMR::PLib3MFBase* model,
               NMR::PLib3MFBase* object,
               NMR::PLib3MFBase* item,
               const TriangleMesh& mesh) {
  const std::string_view content(reinterpret_cast<const char*>(mesh.vertices.data()),
                                 mesh.vertices.size() * sizeof(mesh.vertices[0]));
  const auto uuid = [&](const char* purpose) { return content_uuid(content, purpose); };
  check(NMR::lib3mf_object_setuuidutf8(object, uuid("object").c_str()), "name the object");
  check(NMR::lib3mf_builditem_setuuidutf8(item, uuid("item").c_str()), "name the item");
  check(NMR::lib3mf_model_setbuilduuidutf8(model, uuid("build").c_str()), "name the build");
}

/// The file as it grows; the library seeks back to complete zip headers.
struct Buffer {
  std::string bytes;
  size_t position = 0;
};

uint32_t write_to_buffer(const BYTE* data, uint32_t size, void* user) {
  auto& buffer = *static_cast<Buffer*>(user);
  if (buffer.bytes.size() < buffer.position + size) buffer.bytes.resize(buffer.position + size);
  std::copy(data, data + size, buffer.bytes.begin() + static_cast<ptrdiff_t>(buffer.position));
  buffer.position += size;
  return 0;
}

uint32_t seek_in_buffer(uint64_t position, void* user) {
  static_cast<Buffer*>(user)->position = position;
  return 0;
}

}  // namespace

void write_3mf(const std::filesystem::path& path,
               const TriangleMesh& mesh,
               const Frame& frame,
               const Eigen::Matrix3d& up_rotation) {
  require_writable(mesh, "write_3mf");
  require_printable_solid(mesh, frame, "write_3mf");
  const std::vector<size_t> faces = faces_of_surface(mesh);
  Geometry content = geometry(mesh, faces, frame, up_rotation);
  errno = 0;
  Handle model;
  check(NMR::lib3mf_createmodel(model.out()), "create a model");
  check(NMR::lib3mf_model_setunit(model.get(), content.unit), "set the unit");
  check(NMR::lib3mf_model_addmetadatautf8(model.get(), "Application", "cgs"), "add metadata");
  Handle object;
  check(NMR::lib3mf_model_addmeshobject(model.get(), object.out()), "add a mesh");
  set_geometry(object.get(), content);
  if (!mesh.provenance.empty()) set_materials(model.get(), object.get(), mesh, faces);
  const std::string text = description(mesh, frame, origin_in_millimetres(frame, up_rotation));
  check(NMR::lib3mf_model_addmetadatautf8(model.get(), "Description", text.c_str()),
        "add metadata");
  Handle item;
  check(NMR::lib3mf_model_addbuilditem(model.get(), object.get(), nullptr, item.out()), "build");
  set_uuids(model.get(), object.get(), item.get(), mesh);
  Handle writer;
  check(NMR::lib3mf_model_querywriter(model.get(), "3mf", writer.out()), "write");
  Buffer buffer;
  check(NMR::lib3mf_writer_writetocallback(writer.get(),
                                           reinterpret_cast<void*>(&write_to_buffer),
                                           reinterpret_cast<void*>(&seek_in_buffer),
                                           &buffer),
        "write");
  write_file(path, buffer.bytes);
}

}  // namespace cgs
