// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/train/training_options.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <variant>

#include "libcgs/core/error.h"

namespace cgs {

namespace {

struct Field {
  std::string_view name;
  std::variant<int*, float*, double*, std::vector<int>*, ResidualDecoder*, SplatMethod*> value;
};

std::vector<Field> fields_of(TrainingOptions& o) {
  return {{"method", &o.method},
          {"steps", &o.steps},
          {"coarse_until", &o.coarse_until},
          {"free_from", &o.free_from},
          {"sharp_from", &o.sharp_from},
          {"depth_rate", &o.depth_rate},
          {"opacity_rate", &o.opacity_rate},
          {"color_rate", &o.color_rate},
          {"shape_rate", &o.shape_rate},
          {"final_rate", &o.final_rate},
          {"conv_depth_rate", &o.conv_depth_rate},
          {"conv_opacity_rate", &o.conv_opacity_rate},
          {"conv_rise", &o.conv_rise},
          {"l1_weight", &o.l1_weight},
          {"ssim_weight", &o.ssim_weight},
          {"tv_weight", &o.tv_weight},
          {"masked_tv_weight", &o.masked_tv_weight},
          {"tv_to_layers", &o.tv_to_layers},
          {"flow_weight", &o.flow_weight},
          {"prior_weight", &o.prior_weight},
          {"spread_weight", &o.spread_weight},
          {"emptiness_weight", &o.emptiness_weight},
          {"near_opacity_weight", &o.near_opacity_weight},
          {"edge_smooth_weight", &o.edge_smooth_weight},
          {"seen_through_weight", &o.seen_through_weight},
          {"order_weight", &o.order_weight},
          {"patch_depth_weight", &o.patch_depth_weight},
          {"virtual_weight", &o.virtual_weight},
          {"virtual_tv_weight", &o.virtual_tv_weight},
          {"average_decay", &o.average_decay},
          {"depth_bending", &o.depth_bending},
          {"opacity_bending", &o.opacity_bending},
          {"opacity_prior", &o.opacity_prior},
          {"color_prior", &o.color_prior},
          {"l1_levels", &o.l1_levels},
          {"dropout", &o.dropout},
          {"dropout_block", &o.dropout_block},
          {"decoder", &o.coherence.decoder},
          {"depth_spacing", &o.coherence.depth_spacing},
          {"opacity_spacing", &o.coherence.opacity_spacing},
          {"conv_depth_width", &o.coherence.conv_depth_width},
          {"conv_opacity_width", &o.coherence.conv_opacity_width},
          {"conv_depth_gain", &o.coherence.conv_depth_gain},
          {"conv_opacity_gain", &o.coherence.conv_opacity_gain},
          {"max_depth_change", &o.coherence.max_depth_change},
          {"max_logit_change", &o.coherence.max_logit_change},
          {"radius_factor", &o.coherence.radius_factor},
          {"min_radius", &o.coherence.min_radius},
          {"max_radius", &o.coherence.max_radius},
          {"opacity", &o.coherence.opacity},
          {"sh_degree", &o.coherence.sh_degree},
          {"layers_per_ray", &o.coherence.layers_per_ray}};
}

template <typename T>
void parse(std::string_view name, std::string_view text, T& out) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  require(whole, std::string(name).append(" must be a number"), text);
}

void parse(std::string_view name, std::string_view text, std::vector<int>& out) {
  out.clear();
  while (true) {
    const size_t comma = text.find(',');
    parse(name, text.substr(0, comma), out.emplace_back());
    if (comma == std::string_view::npos) return;
    text.remove_prefix(comma + 1);
  }
}

void parse(std::string_view name, std::string_view text, ResidualDecoder& out) {
  require(text == "lattice" || text == "conv",
          std::string(name).append(" must be lattice or conv"),
          text);
  out = text == "conv" ? ResidualDecoder::Conv : ResidualDecoder::Lattice;
}

void parse(std::string_view name, std::string_view text, SplatMethod& out) {
  require(text == "coherent" || text == "classical",
          std::string(name).append(" must be coherent or classical"),
          text);
  out = text == "classical" ? SplatMethod::Classical : SplatMethod::Coherent;
}

template <typename T>
std::string print(T value) {
  std::array<char, 64> text{};
  const auto result = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), result.ptr};
}

std::string print(const std::vector<int>& values) {
  std::string out;
  for (const int value : values) {
    if (!out.empty()) out += ',';
    out += print(value);
  }
  return out;
}

std::string print(ResidualDecoder value) {
  return value == ResidualDecoder::Conv ? "conv" : "lattice";
}

std::string print(SplatMethod value) {
  return value == SplatMethod::Classical ? "classical" : "coherent";
}

void require_fraction(double value, std::string name) {
  require(value >= 0 && value <= 1, name.append(" must be in [0, 1]"), value);
}

void require_weight(double value, std::string name) {
  require(value >= 0 && std::isfinite(value), name.append(" must be >= 0"), value);
}

// What free Gaussians do not have would be asked for in vain.
void require_classical(const TrainingOptions& options) {
  constexpr std::array<std::string_view, 5> kTaken = {
      "steps", "sh_degree", "l1_weight", "ssim_weight", "l1_levels"};
  const auto fields = training_fields(options);
  const auto preset = training_fields(training_preset("classical"));
  for (size_t k = 0; k < fields.size(); ++k) {
    const auto& [name, value] = fields[k];
    const bool is_taken = std::find(kTaken.begin(), kTaken.end(), name) != kTaken.end();
    require(is_taken || value == preset[k].second,
            "method=classical has no " + name + ": it must stay " + preset[k].second,
            value);
  }
  const int degree = options.coherence.sh_degree;
  require(degree >= 0 && degree <= 3, "sh_degree must be 0 ... 3", degree);
}

}  // namespace

void TrainingOptions::validate() const {
  if (method == SplatMethod::Classical) {
    require_classical(*this);
  } else {
    coherence.validate();
  }
  require(steps >= 0, "steps must be >= 0", steps);
  require_fraction(coarse_until, "coarse_until");
  require_fraction(free_from, "free_from");
  require_fraction(sharp_from, "sharp_from");
  require_fraction(final_rate, "final_rate");
  require_weight(depth_rate, "depth_rate");
  require_weight(opacity_rate, "opacity_rate");
  require_weight(color_rate, "color_rate");
  require_weight(shape_rate, "shape_rate");
  require_weight(conv_depth_rate, "conv_depth_rate");
  require_weight(conv_opacity_rate, "conv_opacity_rate");
  require(conv_rise > 0 && conv_rise <= 1, "conv_rise must be in (0, 1]", conv_rise);
  require_fraction(tv_to_layers, "tv_to_layers");
  require_weight(l1_weight, "l1_weight");
  require_weight(ssim_weight, "ssim_weight");
  require_weight(tv_weight, "tv_weight");
  require_weight(masked_tv_weight, "masked_tv_weight");
  require_weight(flow_weight, "flow_weight");
  require_weight(prior_weight, "prior_weight");
  require_weight(spread_weight, "spread_weight");
  require_weight(emptiness_weight, "emptiness_weight");
  require_weight(near_opacity_weight, "near_opacity_weight");
  require_weight(edge_smooth_weight, "edge_smooth_weight");
  require_weight(seen_through_weight, "seen_through_weight");
  require_weight(order_weight, "order_weight");
  require_weight(patch_depth_weight, "patch_depth_weight");
  require_weight(virtual_weight, "virtual_weight");
  require_weight(virtual_tv_weight, "virtual_tv_weight");
  require(
      average_decay >= 0 && average_decay < 1, "average_decay must be in [0, 1)", average_decay);
  require_weight(depth_bending, "depth_bending");
  require_weight(opacity_bending, "opacity_bending");
  require_weight(opacity_prior, "opacity_prior");
  require_weight(color_prior, "color_prior");
  const bool has_knots = coherence.decoder == ResidualDecoder::Lattice;
  require(has_knots || depth_bending == 0,
          "depth_bending must be 0 with decoder=conv, which has no knots",
          depth_bending);
  require(has_knots || opacity_bending == 0,
          "opacity_bending must be 0 with decoder=conv, which has no knots",
          opacity_bending);
  require(l1_levels >= 1, "l1_levels must be >= 1", l1_levels);
  require(dropout >= 0 && dropout < 1, "dropout must be in [0, 1)", dropout);
  require(dropout_block >= 1, "dropout_block must be >= 1", dropout_block);
}

namespace {

TrainingOptions reference_options() {
  constexpr double kSteps = 13000;       // of one view each
  const double faster = std::sqrt(3.0);  // as a step here is the mean of three views
  TrainingOptions options;
  options.coherence.decoder = ResidualDecoder::Conv;
  options.coherence.radius_factor = 0.6f;
  options.steps = static_cast<int>(kSteps / 3);
  options.coherence.conv_depth_gain = 16;  // 50 units, of which a scene is about three away
  options.coherence.conv_opacity_gain = 100;
  options.conv_depth_rate = 1e-4 * faster;
  options.conv_opacity_rate = 1e-5 * faster;
  options.conv_rise = 1000 / kSteps;
  options.free_from = 8000 / kSteps;
  options.sharp_from = 5000 / kSteps;
  options.color_rate = 0;
  options.coherence.sh_degree = 0;
  options.coherence.layers_per_ray = 1;
  options.shape_rate = 1e-4 * faster;
  options.final_rate = 1;
  options.tv_weight = 5;
  options.tv_to_layers = 1;
  // 0.1 in units of which the extent of a scene has about five, of a mean over three coordinates.
  options.flow_weight = 0.5 / 3;
  options.prior_weight = 0;
  options.opacity_prior = 0;
  options.color_prior = 0;
  return options;
}

TrainingOptions classical_options() {
  TrainingOptions options;
  options.method = SplatMethod::Classical;
  options.steps = 3000;  // of 30 000
  options.coherence.sh_degree = 3;
  options.coherence.layers_per_ray = 1;
  options.l1_levels = 1;
  return options;
}

}  // namespace

TrainingOptions training_preset(std::string_view name) {
  TrainingOptions options;
  if (name == "standard") return options;
  if (name == "draft") {
    options.steps = 20;
    return options;
  }
  if (name == "fine") {
    options.steps = 120;
    return options;
  }
  if (name == "reference") return reference_options();
  if (name == "classical") return classical_options();
  throw InvalidInput("the preset must be draft, standard, fine, reference or classical, but is " +
                     std::string(name));
}

void set_training_field(TrainingOptions& options, std::string_view name, std::string_view value) {
  for (const Field& field : fields_of(options)) {
    if (field.name != name) continue;
    std::visit([&](auto* target) { parse(name, value, *target); }, field.value);
    return;
  }
  throw InvalidInput("there is no training field '" + std::string(name) + "'");
}

std::vector<std::pair<std::string, std::string>> training_fields(const TrainingOptions& options) {
  TrainingOptions copy = options;
  std::vector<std::pair<std::string, std::string>> out;
  for (const Field& field : fields_of(copy)) {
    out.emplace_back(field.name,
                     std::visit([](auto* value) { return print(*value); }, field.value));
  }
  return out;
}

}  // namespace cgs
