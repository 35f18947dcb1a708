// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/filter/chain.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "convert/filter/operations.h"
#include "convert/text/closest_name.h"
#include "convert/text/figures.h"
#include "io/bytes/mesh_arrays.h"
#include "libcgs/core/error.h"
#include "libcgs/core/remedy.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

const FilterOperation& operation_named(const std::string& typed) {
  std::string name = typed.substr(0, typed.find('='));
  std::replace(name.begin(), name.end(), '_', '-');
  std::vector<std::string> names;
  std::string known;
  for (const FilterOperation& operation : filter_operations()) {
    if (operation.name == name) return operation;
    names.emplace_back(operation.name);
    known += (known.empty() ? "" : ", ") + names.back();
  }
  const std::string meant = closest_name(name, names);
  throw InvalidInput("--op " + typed + ": there is no operation '" + name + "'; " +
                     (meant.empty() ? "" : "did you mean " + meant + "? ") + "known are " + known);
}

/// What is said about a mesh before and after.
struct Tally {
  size_t vertices = 0;
  size_t faces = 0;
  bool states_provenance = false;
  std::array<double, kProvenanceCount> area = {};  // [file units squared]
};

Tally tally(const FilterState& state) {
  Tally out{state.mesh.vertices.size(),
            state.mesh.faces.size(),
            !state.mesh.provenance.empty(),
            area_by_provenance(state.mesh)};
  for (double& a : out.area) a *= state.frame.scale * state.frame.scale;
  return out;
}

Json tally_json(const Tally& tally) {
  Json area = Json::object();
  for (const Provenance label : kProvenanceOrder) {
    area[provenance_key(label)] = tally.area.at(static_cast<size_t>(label));
  }
  if (!tally.states_provenance) area = nullptr;
  return {{"vertices", tally.vertices}, {"faces", tally.faces}, {"area", area}};
}

std::string area_text(double area, const Frame& frame) {
  std::array<char, 64> text{};
  if (frame.has_metric_scale()) area *= frame.metres_per_unit * frame.metres_per_unit;
  std::snprintf(text.data(), text.size(), "%.5g", area);
  return text.data() + std::string(frame.has_metric_scale() ? " m2" : " units2");
}

// "1200 -> 400 faces, 600 -> 200 vertices, observed 1.25 m2 -> 1.2 m2"
std::string change_text(const Tally& before, const Tally& after, const Frame& frame) {
  const auto count = [](size_t a, size_t b, const char* what) {
    return std::to_string(a) + " -> " + std::to_string(b) + what;
  };
  if (before.faces + after.faces == 0) return count(before.vertices, after.vertices, " points");
  std::string out = count(before.faces, after.faces, " faces") + ", " +
                    count(before.vertices, after.vertices, " vertices");
  if (!before.states_provenance && !after.states_provenance) return out;
  const auto observed = static_cast<size_t>(Provenance::Observed);
  return out + ", observed " + area_text(before.area.at(observed), frame) + " -> " +
         area_text(after.area.at(observed), frame);
}

void require_something_left(const PreparedFilter& filter, const Tally& before, const Tally& after) {
  if (after.vertices > 0 && (after.faces > 0 || before.faces == 0)) return;
  throw NumericalError("--op " + filter.text + ": nothing is left of " +
                       std::to_string(before.vertices) + " vertices and " +
                       std::to_string(before.faces) + " faces, so nothing was written");
}

// Libraries complain without knowing which operation they work for.
FilterRemark run_named(const PreparedFilter& filter, FilterState& state, const Progress& progress) {
  try {
    return filter.run(state, progress);
  } catch (const InvalidInput& error) {
    const std::string words = error.what();
    if (words.rfind("--op ", 0) == 0 || remedy_of(error) != Remedy::None) throw;
    throw InvalidInput("--op " + filter.text + ": " + words);
  }
}

}  // namespace

std::vector<PreparedFilter> prepare_filters(const std::vector<std::string>& typed,
                                            const Frame& frame) {
  std::vector<PreparedFilter> out;
  for (const std::string& text : typed) {
    const FilterOperation& operation = operation_named(text);
    const std::string usage = operation.syntax() + ", e.g. " + std::string(operation.example);
    FilterArguments arguments(text, usage, frame);
    FilterStep step = operation.prepare(arguments);
    arguments.finish();
    out.push_back({text, std::move(step), arguments.files()});
  }
  return out;
}

Json run_filters(FilterState& state,
                 const std::vector<PreparedFilter>& filters,
                 Terminal& terminal) {
  Json report = Json::array();
  Tally before = tally(state);
  for (const PreparedFilter& filter : filters) {
    const Progress progress = terminal.begin(one_line(filter.text));
    cgs::report(progress, 0);
    FilterRemark remark = run_named(filter, state, progress);
    const Tally after = tally(state);
    require_something_left(filter, before, after);
    const double seconds = terminal.end(change_text(before, after, state.frame) +
                                        (remark.text.empty() ? "" : "; " + remark.text));
    Json entry = {{"operation", filter.text},
                  {"seconds", seconds},
                  {"remark", remark.text},
                  {"before", tally_json(before)},
                  {"after", tally_json(after)}};
    if (!remark.details.is_null()) entry["details"] = std::move(remark.details);
    report.push_back(std::move(entry));
    before = after;
  }
  return report;
}

std::string filter_help() {
  std::string out = "Operations, done in the order given:\n";
  for (const FilterOperation& operation : filter_operations()) {
    std::string left = "  ";
    left += operation.syntax();
    constexpr size_t kColumn = 42;
    out += left + (left.size() < kColumn ? std::string(kColumn - left.size(), ' ') : "  ");
    out += std::string(operation.help) + ", e.g. " + std::string(operation.example) + "\n";
  }
  return out;
}

}  // namespace cgs
