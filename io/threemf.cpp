// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/threemf.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <numeric>
#include <string>
#include <string_view>
#include <vector>

#include <Model/COM/NMR_DLLInterfaces.h>

#include "io/atomic_file.h"
#include "io/content_uuid.h"
#include "io/mesh_arrays.h"
#include "libcgs/core/error.h"
#include "libcgs/core/provenance_colors.h"

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

std::string description(const TriangleMesh& mesh, const std::string& origin) {
  std::string out = mesh.provenance.empty() ? "What of the surface was observed is not stated."
                                            : shares_by_origin(mesh);
  if (!origin.empty()) out += " Coordinates of the scene: add " + origin + " mm.";
  return out;
}

void set_geometry(NMR::PLib3MFBase* object,
                  const TriangleMesh& mesh,
                  const Frame& frame,
                  const Eigen::Matrix3d& up_rotation) {
  std::vector<NMR::MODELMESHVERTEX> vertices(mesh.vertices.size());
  for (size_t i = 0; i < vertices.size(); ++i) {
    const Eigen::Vector3d p = millimetres(mesh.vertices[i], frame, up_rotation);
    for (int k = 0; k < 3; ++k) vertices[i].m_fPosition[k] = static_cast<float>(p[k]);
  }
  std::vector<NMR::MODELMESHTRIANGLE> triangles(mesh.faces.size());
  for (size_t i = 0; i < triangles.size(); ++i) {
    std::copy(mesh.faces[i].begin(), mesh.faces[i].end(), triangles[i].m_nIndices);
  }
  check(NMR::lib3mf_meshobject_setgeometry(object,
                                           vertices.data(),
                                           static_cast<DWORD>(vertices.size()),
                                           triangles.data(),
                                           static_cast<DWORD>(triangles.size())),
        "take the geometry");
}

void set_materials(NMR::PLib3MFBase* model, NMR::PLib3MFBase* object, const TriangleMesh& mesh) {
  Handle group;
  check(NMR::lib3mf_model_addbasematerialgroup(model, group.out()), "add materials");
  std::array<DWORD, kProvenanceCount> index{};
  for (const Provenance label : kProvenanceOrder) {
    const auto i = static_cast<size_t>(label);
    const auto& [red, green, blue] = kProvenanceColors.at(i);
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
  std::vector<NMR::ModelResourceID> groups(mesh.faces.size(), group_id);
  std::vector<DWORD> materials(mesh.faces.size());
  for (size_t i = 0; i < materials.size(); ++i) {
    materials[i] = index.at(static_cast<size_t>(mesh.provenance[i]));
  }
  Handle properties;
  check(NMR::lib3mf_meshobject_createpropertyhandler(object, properties.out()), "label faces");
  check(NMR::lib3mf_propertyhandler_setbasematerialarray(
            properties.get(), groups.data(), materials.data()),
        "label faces");
  Handle defaults;  // Readers that ignore faces' own properties need one on the object.
  check(NMR::lib3mf_object_createdefaultpropertyhandler(object, defaults.out()),
        "label the object");
  check(NMR::lib3mf_defaultpropertyhandler_setbasematerial(
            defaults.get(), group_id, index.at(static_cast<size_t>(Provenance::Observed))),
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
  for (size_t i = 0; i < mesh.faces.size(); ++i) {
    const auto& f = mesh.faces[i];
    require(f[0] != f[1] && f[1] != f[2] && f[2] != f[0],
            "write_3mf: a face must name three vertices; face",
            i);
  }
  Handle model;
  check(NMR::lib3mf_createmodel(model.out()), "create a model");
  check(NMR::lib3mf_model_setunit(model.get(), NMR::MODELUNIT_MILLIMETER), "set the unit");
  check(NMR::lib3mf_model_addmetadatautf8(model.get(), "Application", "cgs"), "add metadata");
  Handle object;
  check(NMR::lib3mf_model_addmeshobject(model.get(), object.out()), "add a mesh");
  set_geometry(object.get(), mesh, frame, up_rotation);
  if (!mesh.provenance.empty()) set_materials(model.get(), object.get(), mesh);
  const std::string text = description(mesh, origin_in_millimetres(frame, up_rotation));
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
