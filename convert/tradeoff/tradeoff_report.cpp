// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/tradeoff/tradeoff_report.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/text/html.h"
#include "convert/text/report_json.h"
#include "convert/tradeoff/pareto.h"
#include "convert/tradeoff/scatter_plot.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/json_file.h"
#include "io/bytes/scene_path.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

/// One of the trades: settings that differ in it, and what each costs and loses.
struct Trade {
  std::string key;
  std::vector<const MeasuredSetting*> settings;
  std::vector<std::string> labels;
  std::vector<CostAndLoss> points;
  std::vector<size_t> front;

  bool on_front(size_t i) const { return std::find(front.begin(), front.end(), i) != front.end(); }
};

template <typename KeyOf, typename PointOf>
Trade trade(const Tradeoff& tradeoff, const char* key, const KeyOf& key_of, const PointOf& point) {
  Trade out;
  out.key = key;
  std::set<std::string> known;
  for (const MeasuredSetting& m : tradeoff.settings) {
    if (!m.failed.empty()) continue;
    const CostAndLoss p = point(m);
    const Setting part = key_of(m.setting);
    if (!std::isfinite(p.loss) || !known.insert(asset_key(part)).second) continue;
    out.settings.push_back(&m);
    out.labels.push_back(label(part));
    out.points.push_back(p);
  }
  out.front = pareto_front(out.points);
  return out;
}

Trade pictures(const Tradeoff& tradeoff) {
  return trade(
      tradeoff,
      "pictures",
      [](const Setting& s) { return Setting{.coarser = s.coarser, .steps = s.steps}; },
      [](const MeasuredSetting& m) {
        return CostAndLoss{m.model.cpu, m.pictures ? -m.pictures->psnr : kNotMeasured};
      });
}

Trade geometry(const Tradeoff& tradeoff) {
  return trade(
      tradeoff,
      "geometry",
      [](Setting s) {
        s.max_error.reset();
        return s;
      },
      [](const MeasuredSetting& m) {
        return CostAndLoss{m.model.cpu + m.mesh.cpu, m.is_ruler ? 0 : m.error()};
      });
}

Trade files(const Tradeoff& tradeoff) {
  return trade(
      tradeoff,
      "files",
      [](const Setting& s) { return s; },
      [](const MeasuredSetting& m) {
        return CostAndLoss{double(m.asset_bytes), m.is_ruler ? 0 : m.asset_and_surface_error()};
      });
}

std::string text_of(const char* format, double value) {
  return std::isfinite(value) ? number(value, format) : "-";
}

std::string unit_of(const Tradeoff& tradeoff) {
  const std::string unit = tradeoff.scene.frame.unit_name();
  return unit == "unknown" ? "units" : unit;
}

// What errors are measured from.
std::string ruler(const Tradeoff& tradeoff) {
  return tradeoff.settings.front().truth ? "the reference" : "\"" + tradeoff.finest + "\"";
}

std::string row(const std::vector<std::string>& cells) {
  std::string out;
  for (size_t i = 0; i < cells.size(); ++i) {
    const size_t width = i == 0 ? 34 : 11;
    const std::string room(width - std::min(width, cells[i].size()), ' ');
    out += i == 0 ? cells[i] + room : " " + room + cells[i];
  }
  return out + "\n";
}

template <typename Cells>
std::string table(const Trade& trade, std::vector<std::string> head, const Cells& cells) {
  head.front() = "  " + head.front();
  std::string out = row(head);
  for (size_t i = 0; i < trade.settings.size(); ++i) {
    std::vector<std::string> line = {(trade.on_front(i) ? "* " : "  ") + trade.labels[i]};
    for (std::string& cell : cells(*trade.settings[i])) line.push_back(std::move(cell));
    out += row(line);
  }
  return out;
}

std::string mebibytes(double bytes) { return text_of("%.3g", bytes / (1 << 20)); }

std::string pictures_text(const Tradeoff& tradeoff) {
  const Trade t = pictures(tradeoff);
  if (t.settings.empty()) return "Pictures: no photograph was held out, so nothing to measure.\n";
  return "Pictures: held-out views, from photographs to model and views\n" +
         table(t,
               {"setting",
                "CPU [s]",
                "wall [s]",
                "peak [MiB]",
                "PSNR [dB]",
                "SSIM",
                "PSNR seen",
                "SSIM seen",
                "model [MiB]"},
               [](const MeasuredSetting& m) -> std::vector<std::string> {
                 const double peak = double(m.model.peak_memory) / (1 << 20);
                 return {text_of("%.1f", m.model.cpu),
                         text_of("%.1f", m.model.wall),
                         m.model.peak_memory == 0 ? "-" : text_of("%.0f", peak),
                         text_of("%.2f", m.pictures->psnr),
                         text_of("%.3f", m.pictures->ssim),
                         text_of("%.2f", m.pictures->psnr_seen),
                         text_of("%.3f", m.pictures->ssim_seen),
                         mebibytes(double(m.model_bytes))};
               });
}

std::string geometry_text(const Tradeoff& tradeoff) {
  const std::string unit = " [" + unit_of(tradeoff) + "]";
  return "Geometry: distance of what was photographed from " + ruler(tradeoff) +
         ", from photographs to meshes\n" +
         table(geometry(tradeoff),
               {"setting",
                "CPU [s]",
                "wall [s]",
                "peak [MiB]",
                "voxel" + unit,
                "95%" + unit,
                "RMS" + unit,
                "max" + unit,
                "faces"},
               [](const MeasuredSetting& m) -> std::vector<std::string> {
                 const double peak =
                     double(std::max(m.model.peak_memory, m.mesh.peak_memory)) / (1 << 20);
                 const SurfaceError unknown = {kNotMeasured, kNotMeasured, kNotMeasured};
                 const SurfaceError e = m.truth ? *m.truth : m.deviation.value_or(unknown);
                 return {text_of("%.1f", m.model.cpu + m.mesh.cpu),
                         text_of("%.1f", m.model.wall + m.mesh.wall),
                         m.mesh.peak_memory == 0 ? "-" : text_of("%.0f", peak),
                         text_of("%.3g", m.voxel),
                         text_of("%.3g", e.p95),
                         text_of("%.3g", e.rms),
                         text_of("%.3g", e.max),
                         std::to_string(m.faces)};
               });
}

std::string files_text(const Tradeoff& tradeoff) {
  const std::string unit = " [" + unit_of(tradeoff) + "]";
  return "Files: asset.glb; its error is that of the surface and what it is off the PLY (95 % "
         "each)\n" +
         table(files(tradeoff),
               {"setting", "glb [MiB]", "error" + unit, "off PLY" + unit, "PLY [MiB]", "CPU [s]"},
               [](const MeasuredSetting& m) -> std::vector<std::string> {
                 return {mebibytes(double(m.asset_bytes)),
                         text_of("%.3g", m.asset_and_surface_error()),
                         text_of("%.2g", m.asset_error),
                         mebibytes(double(m.mesh_bytes)),
                         text_of("%.1f", m.cpu())};
               });
}

std::string figures_line(const MeasuredSetting& m, const std::string& unit) {
  std::string out = text_of("%.3g", m.cpu()) + " s CPU, " + text_of("%.3g", m.wall()) +
                    " s, error " + text_of("%.3g", m.asset_and_surface_error()) + ' ' + unit;
  if (m.pictures) out += ", PSNR " + text_of("%.2f", m.pictures->psnr) + " dB";
  return out + ", asset.glb " + mebibytes(double(m.asset_bytes)) + " MiB";
}

std::string recommendation_text(const TradeoffReport& report) {
  if (report.wants.empty()) return "";
  const Recommendation& r = report.recommendation;
  std::string wants;
  for (const Want& want : report.wants) wants += (wants.empty() ? "" : ", ") + want.text;
  if (!r.best) return "\nFor " + wants + ": nothing was measured that tells.\n";
  const MeasuredSetting& best = report.tradeoff.settings[*r.best];
  const std::string unit = unit_of(report.tradeoff);
  std::string out = "\nFor " + wants + ": ";
  if (!r.unmet.empty()) {
    out += "no setting that was measured does; missed by the nearest:";
    for (const std::string& text : r.unmet) out += ' ' + text;
    out += "\n  ";
  }
  out += label(best.setting) + " (" + figures_line(best, unit) + ")\n  " + best.command + "\n";
  if (!r.next_better) return out + "Nothing that was measured is better.\n";
  const MeasuredSetting& next = report.tradeoff.settings[*r.next_better];
  out += "The next step up, " + label(next.setting) + ", costs " +
         text_of("%+.3g", next.cpu() - best.cpu()) + " s CPU (" +
         text_of("%+.0f", 100 * (next.cpu() / best.cpu() - 1)) + " %) and brings error " +
         text_of("%.3g", best.asset_and_surface_error()) + " -> " +
         text_of("%.3g", next.asset_and_surface_error()) + ' ' + unit;
  if (best.pictures && next.pictures) {
    out += ", PSNR " + text_of("%+.2f", next.pictures->psnr - best.pictures->psnr) + " dB";
  }
  return out + ", asset.glb " + mebibytes(double(best.asset_bytes)) + " -> " +
         mebibytes(double(next.asset_bytes)) + " MiB\n  " + next.command + "\n";
}

std::string notes_text(const Tradeoff& tradeoff) {
  std::string out = "* no other setting is better for less. ";
  if (tradeoff.repeats > 1) {
    out += "The standard setting, " + std::to_string(tradeoff.repeats) + " times: CPU differs by " +
           text_of("%.1f", 100 * tradeoff.noise.cpu) + " %, wall by " +
           text_of("%.1f", 100 * tradeoff.noise.wall) + " %; less than that is no difference.\n";
  } else {
    out += "The standard setting was measured once, so how far times differ is not known.\n";
  }
  if (!tradeoff.settings.front().truth) {
    out +=
        "Distances from the finest setting, \"" + tradeoff.finest +
        "\", tell what a faster one loses, not how true it is, and nothing of the finest itself; "
        "--reference tells.\n";
  }
  for (const MeasuredSetting& m : tradeoff.settings) {
    if (!m.failed.empty()) out += label(m.setting) + " failed: " + m.failed + "\n";
  }
  if (tradeoff.left_out.empty()) return out;
  out += "Left out as time was up (start again to go on):";
  for (const std::string& name : tradeoff.left_out) out += "\n  " + name;
  return out + "\n";
}

ScatterPlot plot(const Trade& trade, std::string title, std::string x_axis, std::string y_axis) {
  ScatterPlot out;
  out.title = std::move(title);
  out.x_axis = std::move(x_axis);
  out.y_axis = std::move(y_axis);
  out.y_is_logarithmic = trade.key != "pictures";
  for (size_t i = 0; i < trade.points.size(); ++i) {
    const CostAndLoss& p = trade.points[i];
    if (out.y_is_logarithmic && !(p.loss > 0)) continue;  // the ruler itself
    out.points.push_back({trade.key == "files" ? p.cost / (1 << 20) : p.cost,
                          out.y_is_logarithmic ? p.loss : -p.loss,
                          trade.labels[i],
                          trade.on_front(i)});
  }
  return out;
}

std::string plots_svg(const Tradeoff& tradeoff) {
  const std::string error = "error against " + ruler(tradeoff) + ", 95 % within";
  const std::string unit = " [" + unit_of(tradeoff) + "]";
  return scatter_svg({plot(pictures(tradeoff),
                           "Pictures: up and left is better",
                           "processor time, photographs to views [s]",
                           "held-out PSNR [dB]"),
                      plot(geometry(tradeoff),
                           "Geometry: down and left is better",
                           "processor time, photographs to meshes [s]",
                           error + unit),
                      plot(files(tradeoff),
                           "Files: down and left is better",
                           "size of asset.glb [MiB]",
                           error + ", and off the PLY" + unit)});
}

Json error_json(const std::optional<SurfaceError>& error) {
  if (!error) return nullptr;
  return {{"rms", error->rms}, {"p95", error->p95}, {"max", error->max}};
}

Json setting_json(const MeasuredSetting& m) {
  Json out = {{"label", label(m.setting)}, {"command", m.command}};
  if (!m.failed.empty()) {
    out["failed"] = m.failed;
    return out;
  }
  for (const auto& [name, cost] :
       {std::pair("model", m.model), std::pair("mesh", m.mesh), std::pair("assets", m.assets)}) {
    out["cost"][name] = {{"cpu", cost.cpu}, {"wall", cost.wall}, {"peak_memory", cost.peak_memory}};
  }
  out["pictures"] = nullptr;
  if (m.pictures) {
    out["pictures"] = {{"psnr", number_or_null(m.pictures->psnr)},
                       {"ssim", number_or_null(m.pictures->ssim)},
                       {"psnr_seen", number_or_null(m.pictures->psnr_seen)},
                       {"ssim_seen", number_or_null(m.pictures->ssim_seen)}};
  }
  out["from_finest"] = error_json(m.deviation);
  out["from_reference"] = error_json(m.truth);
  out["voxel"] = m.voxel;
  out["faces"] = m.faces;
  out["off_mesh"] = m.asset_error;
  out["error"] = number_or_null(m.asset_and_surface_error());
  out["bytes"] = {{"gaussians.ply", m.model_bytes},
                  {"watertight.ply", m.mesh_bytes},
                  {"asset.glb", m.asset_bytes}};
  return out;
}

}  // namespace

Json tradeoff_json(const TradeoffReport& report) {
  const Tradeoff& tradeoff = report.tradeoff;
  Json settings = Json::array();
  for (const MeasuredSetting& m : tradeoff.settings) settings.push_back(setting_json(m));
  Json fronts;
  for (const Trade& t : {pictures(tradeoff), geometry(tradeoff), files(tradeoff)}) {
    fronts[t.key] = Json::array();
    for (const size_t i : t.front) fronts[t.key].push_back(t.labels[i]);
  }
  Json recommendation;
  const Recommendation& r = report.recommendation;
  if (!report.wants.empty() && r.best) {
    const auto name = [&](const std::optional<size_t>& i) -> Json {
      if (!i) return nullptr;
      return label(tradeoff.settings[*i].setting);
    };
    recommendation = {{"setting", name(r.best)},
                      {"command", tradeoff.settings[*r.best].command},
                      {"unmet", r.unmet},
                      {"next_better", name(r.next_better)}};
  }
  Json wants = Json::array();
  for (const Want& want : report.wants) wants.push_back(want.text);
  return {
      {"program", program_version()},
      {"scene", tradeoff.scene.folder.string()},
      {"units", tradeoff.scene.frame.unit_name()},
      {"noise",
       {{"repeats", tradeoff.repeats}, {"cpu", tradeoff.noise.cpu}, {"wall", tradeoff.noise.wall}}},
      {"finest", tradeoff.finest},
      {"settings", settings},
      {"fronts", fronts},
      {"left_out", tradeoff.left_out},
      {"wants", wants},
      {"recommendation", recommendation}};
}

std::string tradeoff_text(const TradeoffReport& report) {
  return pictures_text(report.tradeoff) + "\n" + geometry_text(report.tradeoff) + "\n" +
         files_text(report.tradeoff) + "\n" + notes_text(report.tradeoff) +
         recommendation_text(report);
}

void write_tradeoff(const std::filesystem::path& folder, const TradeoffReport& report) {
  const std::string svg = plots_svg(report.tradeoff);
  const std::string title =
      escaped("Speed against accuracy: " + folder_name(report.tradeoff.scene.folder));
  write_file(folder / "tradeoff.json", json_text(versioned(tradeoff_json(report))) + "\n");
  write_file(folder / "tradeoff.svg", svg);
  write_file(folder / "tradeoff.html",
             "<!doctype html>\n<html lang=en><head><meta charset=utf-8>"
             "<meta name=viewport content=\"width=device-width\"><title>" +
                 title +
                 "</title>\n<style>:root { color-scheme: light dark; } body { font: 15px/1.5 "
                 "system-ui, sans-serif; max-width: 1100px; margin: 2rem auto; padding: 0 1rem; } "
                 "svg { max-width: 100%; height: auto; } pre { overflow-x: auto; font-size: 12px; "
                 "}</style></head><body>\n<h1>" +
                 title + "</h1>\n" + svg + "<pre>" + escaped(tradeoff_text(report)) +
                 "</pre>\n</body></html>\n");
}

}  // namespace cgs
