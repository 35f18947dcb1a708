// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/threemf_model.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <set>
#include <utility>

#include "io/bytes/byte_reader.h"
#include "io/bytes/text_lines.h"
#include "io/bytes/xml_events.h"

namespace cgs {

namespace {

constexpr std::string_view kCore = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02|";
constexpr std::string_view kMaterial =
    "http://schemas.microsoft.com/3dmanufacturing/material/2015/02|";
constexpr std::string_view kPath =
    "http://schemas.microsoft.com/3dmanufacturing/production/2015/06|path";

// Extensions that a model may require: they leave the shape as the core says.
constexpr std::array<std::string_view, 3> kHarmless = {
    "http://schemas.microsoft.com/3dmanufacturing/material/2015/02",
    "http://schemas.microsoft.com/3dmanufacturing/production/2015/06",
    "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07"};

std::string metres_of(const XmlElement& model) {
  static const std::map<std::string_view, const char*> kUnits = {{"micron", "0.000001"},
                                                                 {"millimeter", "0.001"},
                                                                 {"centimeter", "0.01"},
                                                                 {"inch", "0.0254"},
                                                                 {"foot", "0.3048"},
                                                                 {"meter", "1"}};
  const std::string_view unit = model.find("unit").value_or("millimeter");
  const auto known = kUnits.find(unit);
  if (known != kUnits.end()) return known->second;
  model.fail(Defect::Schema, "unit \"" + std::string(unit.substr(0, 40)) + "\" is not known");
}

// Twelve numbers; rows of a matrix that row vectors are multiplied with.
Eigen::Affine3d transform_of(const XmlElement& element) {
  Eigen::Affine3d out = Eigen::Affine3d::Identity();
  if (!element.find("transform")) return out;
  const std::vector<double> values = element.numbers("transform");
  if (values.size() != 12) {
    element.fail(Defect::Schema,
                 "a transform has 12 numbers, this one " + std::to_string(values.size()));
  }
  for (size_t i = 0; i < values.size(); ++i) {
    out(static_cast<int>(i % 3), static_cast<int>(i / 3)) = values[i];
  }
  return out;
}

// "#RRGGBB" or "#RRGGBBAA", whose opacity counts for nothing. \return NaN in it for others
Eigen::Vector3f color_of(std::string_view text) {
  Eigen::Vector3f out = Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
  if (!text.starts_with('#') || (text.size() != 7 && text.size() != 9)) return out;
  for (Eigen::Index c = 0; c < 3; ++c) {
    const std::string_view digits = text.substr(static_cast<size_t>(1 + 2 * c), 2);
    const char* const end = digits.data() + digits.size();
    uint8_t value = 0;
    if (std::from_chars(digits.data(), end, value, 16).ptr == end) {
      out[c] = static_cast<float>(value) / 255.0f;
    }
  }
  return out;
}

// What is too large for any resource stays so.
uint32_t number_of(uint64_t id) {
  return static_cast<uint32_t>(std::min<uint64_t>(id, std::numeric_limits<uint32_t>::max()));
}

ThreeMfType type_of(const XmlElement& object) {
  const std::string_view type = object.find("type").value_or("model");
  if (type == "model") return ThreeMfType::Model;
  if (type == "surface") return ThreeMfType::Surface;
  if (type == "support" || type == "solidsupport" || type == "other") return ThreeMfType::Accessory;
  object.fail(Defect::Schema, "type \"" + std::string(type.substr(0, 40)) + "\" is not known");
}

ThreeMfPlacement placement_of(const XmlElement& element) {
  ThreeMfPlacement out;
  out.part = element.find(kPath).value_or("");
  out.object = element.count("objectid");
  out.transform = transform_of(element);
  return out;
}

/// Gathers a model from the elements of its file.
class ModelReader {
 public:
  ModelReader(const std::filesystem::path& path, size_t entries_before) : path_(path) {
    model_.entries = entries_before;
  }

  ThreeMfModel read(std::string_view xml) {
    const XmlHandlers handlers = {[&](const XmlElement& element) { start(element); },
                                  [&](std::string_view name) { end(name); },
                                  [&](std::string_view text) { add_text(text); },
                                  [&](std::string_view prefix, std::string_view uri) {
                                    if (!has_root_) uris_[std::string(prefix)] = uri;
                                  }};
    read_xml(xml, path_, handlers);
    return std::move(model_);
  }

 private:
  void start(const XmlElement& element) {
    ++depth_;
    std::string_view name = element.name();
    const bool is_core = name.starts_with(kCore);
    if (is_core) name.remove_prefix(kCore.size());
    if (!std::exchange(has_root_, true)) {
      if (!is_core || name != "model") {
        element.fail(Defect::Schema, "expected a <model> of 3MF core 2015/02");
      }
      model_.metres_per_unit = metres_of(element);
      refuse_unknown_extensions(element);
    } else if (is_core) {
      start_core(name, element);
    } else if (name.starts_with(kMaterial)) {
      start_material(name.substr(kMaterial.size()), element);
    }
  }

  // Of the materials extension.
  void start_material(std::string_view name, const XmlElement& element) {
    if (name == "colorgroup") {
      count_entry();
      const uint64_t id = element.count("id");
      refuse_second(element, id);
      colors_ = &model_.colors[id];
    } else if (name == "color" && colors_ != nullptr) {
      colors_->push_back(color_of(element.find("color").value_or("")));
    } else if (name == "texture2dgroup") {
      model_.has_textures = true;
    } else if (name == "compositematerials" || name == "multiproperties") {
      model_.has_mixtures = true;
    }
  }

  void start_core(std::string_view name, const XmlElement& element) {
    if (name == "vertex") {
      add_vertex(element);
    } else if (name == "triangle") {
      add_triangle(element);
    } else if (name == "component") {
      count_entry();
      inside(element).components.push_back(placement_of(element));
    } else if (name == "object") {
      start_object(element);
    } else if (name == "basematerials") {
      count_entry();
      const uint64_t id = element.count("id");
      refuse_second(element, id);
      names_ = &model_.material_names[id];
      base_colors_ = &model_.colors[id];
    } else if (name == "base" && names_ != nullptr) {
      count_entry();
      names_->emplace_back(element.at("name"));
      base_colors_->push_back(color_of(element.find("displaycolor").value_or("")));
    } else if (name == "item") {
      count_entry();
      model_.build.push_back(placement_of(element));
    } else if (name == "metadata" && depth_ == 2) {  // of the model itself
      const std::string_view key = element.at("name");
      text_ = key == "Application"   ? &model_.application
              : key == "Description" ? &model_.description
                                     : nullptr;
    }
  }

  void end(std::string_view name) {
    --depth_;
    if (name.starts_with(kMaterial) && name.ends_with("|colorgroup")) colors_ = nullptr;
    if (!name.starts_with(kCore)) return;
    name.remove_prefix(kCore.size());
    if (name == "object") object_ = nullptr;
    if (name == "basematerials") names_ = nullptr;
    if (name == "metadata") text_ = nullptr;
  }

  void count_entry() {
    constexpr size_t kMost = 1'000'000;
    if (++model_.entries <= kMost) return;
    throw LimitError(printable(path_) +
                     ": more than 1,000,000 objects, components, items and base materials");
  }

  void add_text(std::string_view text) {
    constexpr size_t kLongest = 65536;
    if (text_ != nullptr && text_->size() + text.size() <= kLongest) *text_ += text;
  }

  void refuse_unknown_extensions(const XmlElement& model) const {
    for (const std::string_view prefix : tokens(model.find("requiredextensions").value_or(""))) {
      const auto uri = uris_.find(std::string(prefix));
      const std::string known = uri == uris_.end() ? "" : uri->second;
      if (std::find(kHarmless.begin(), kHarmless.end(), known) != kHarmless.end()) continue;
      model.fail(Defect::Unsupported,
                 "requires the extension " + std::string(prefix.substr(0, 40)) +
                     (known.empty() ? "" : " (" + known.substr(0, 100) + ")"));
    }
  }

  void refuse_second(const XmlElement& element, uint64_t id) {
    if (ids_.insert(id).second) return;
    element.fail(Defect::Schema, "a second resource has the id " + std::to_string(id));
  }

  void start_object(const XmlElement& element) {
    if (object_ != nullptr) element.fail(Defect::Schema, "stands inside another");
    count_entry();
    const uint64_t id = element.count("id");
    refuse_second(element, id);
    object_ = &model_.objects[id];
    object_->type = type_of(element);
    property_ = {};
    if (!element.find("pid")) return;
    property_.group = number_of(element.count("pid"));
    if (element.find("pindex")) property_.index.fill(number_of(element.count("pindex")));
  }

  ThreeMfObject& inside(const XmlElement& element) const {
    if (object_ == nullptr) element.fail(Defect::Schema, "stands outside of an object");
    return *object_;
  }

  void add_vertex(const XmlElement& element) {
    inside(element).vertices.emplace_back(
        element.measured("x"), element.measured("y"), element.measured("z"));
  }

  void add_triangle(const XmlElement& element) {
    ThreeMfObject& object = inside(element);
    std::array<uint32_t, 3> corners{};
    const std::array<const char*, 3> names = {"v1", "v2", "v3"};
    for (size_t k = 0; k < corners.size(); ++k) {
      const uint64_t corner = element.count(names.at(k));
      if (corner >= object.vertices.size()) {
        element.fail(Defect::Ref,
                     std::string(names.at(k)) + " names vertex " + std::to_string(corner) + " of " +
                         std::to_string(object.vertices.size()));
      }
      corners.at(k) = static_cast<uint32_t>(corner);
    }
    ThreeMfProperty property = property_;
    if (element.find("pid")) property.group = number_of(element.count("pid"));
    if (element.find("p1")) property.index.fill(number_of(element.count("p1")));
    if (element.find("p2")) property.index[1] = number_of(element.count("p2"));
    if (element.find("p3")) property.index[2] = number_of(element.count("p3"));
    object.triangles.push_back(corners);
    object.properties.push_back(property);
  }

  const std::filesystem::path& path_;
  ThreeMfModel model_;
  std::map<std::string, std::string> uris_;  // by prefix
  std::set<uint64_t> ids_;
  bool has_root_ = false;
  int depth_ = 0;                                        // of the element that comes; 1 = the root
  ThreeMfObject* object_ = nullptr;                      // the one whose elements come
  ThreeMfProperty property_;                             // of its triangles that name none
  std::vector<std::string>* names_ = nullptr;            // of the base materials that come
  std::vector<Eigen::Vector3f>* base_colors_ = nullptr;  // of the same, where names_ are
  std::vector<Eigen::Vector3f>* colors_ = nullptr;       // of the group of colours that come
  std::string* text_ = nullptr;                          // the metadata whose text comes
};

}  // namespace

ThreeMfModel parse_threemf_model(std::string_view xml,
                                 const std::filesystem::path& path,
                                 size_t entries_before) {
  return ModelReader(path, entries_before).read(xml);
}

}  // namespace cgs
