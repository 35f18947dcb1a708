// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/pane_layers.h"

#include <array>
#include <cmath>
#include <limits>

#include <tbb/parallel_for.h>

#include "libcgs/core/bilinear.h"

namespace cgs {

namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr int kPiece = 16;  // [pixels]

template <typename Work>
void for_each_pixel(int width, int height, const Work& work) {
  tbb::parallel_for(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) work(x, y);
  });
}

Vector3f color_at(const ColorImage& image, const Vector2f& at) {
  return cgs::color_at(image, at.x(), at.y());
}

// How many of the places around a pixel look through the pane, and how many do not. The rim itself
// is not known to the pixel.
struct Around {
  int through = 0;
  int beside = 0;
};

Around around(const MaskMap& through, int x, int y) {
  constexpr int kAside = 6;  // [pixels]
  Around out;
  for (const int dy : {-kAside, 0, kAside}) {
    for (const int dx : {-kAside, 0, kAside}) {
      if (!through.contains(x + dx, y + dy)) continue;
      ++(through(x + dx, y + dy) != 0 ? out.through : out.beside);
    }
  }
  return out;
}

bool is_well_inside(const MaskMap& through, int x, int y) {
  const Around a = around(through, x, y);
  return a.through > 0 && a.beside == 0;
}

bool is_well_beside(const MaskMap& through, const Vector2f& at) {
  if (!is_known(at)) return false;
  return around(through, static_cast<int>(at.x()), static_cast<int>(at.y())).through == 0;
}

// Sums of the regression of contrast through the pane on that beside it.
struct Contrast {
  double products = 0;
  double squares = 0;
  size_t count = 0;

  void add(const Vector3f& through, const Vector3f& beside) {
    if (!is_known(through) || !is_known(beside)) return;
    products += double(through.dot(beside));
    squares += double(beside.squaredNorm());
    ++count;
  }
};

// Differences of pixels (dx, dy) apart.
void add_contrast(const JointSurface& surface,
                  const PanePlaces& places,
                  size_t v,
                  size_t u,
                  Eigen::Vector2i apart,
                  Contrast& sum) {
  const ColorImage& image = surface.views[v]->image;
  const ColorImage& other = surface.views[u]->image;
  const PlaceMap& there = surface.place_in[v][u];
  const auto is_seen_both_ways = [&](int x, int y) {
    return is_well_inside(places.through[v], x, y) &&
           is_well_beside(places.through[u], there(x, y));
  };
  for (int y = 0; y + apart.y() < image.height; ++y) {
    for (int x = 0; x + apart.x() < image.width; ++x) {
      const int x1 = x + apart.x();
      const int y1 = y + apart.y();
      if (!is_seen_both_ways(x, y) || !is_seen_both_ways(x1, y1)) continue;
      sum.add(image(x, y) - image(x1, y1),
              color_at(other, there(x, y)) - color_at(other, there(x1, y1)));
    }
  }
}

// What a view shows less what lies behind the pane, on which all views that see it agree; NaN
// where no other one does, or where it does not look through the pane.
ColorImage left_for_pane(const JointSurface& surface,
                         const PanePlaces& places,
                         float opacity,
                         const std::vector<ColorImage>& photographs,
                         const std::vector<ColorImage>& behind,
                         size_t v) {
  const ColorImage& image = photographs[v];
  // An own view and the mean of the others, of about two of them, each as one voice.
  constexpr float kOwn = 1.0f / 3;
  ColorImage out(image.width, image.height, Vector3f::Constant(std::nanf("")));
  for_each_pixel(image.width, image.height, [&](int x, int y) {
    if (places.through[v](x, y) == 0) return;
    const Vector3f others = mean_of_others(surface, behind, v, x, y);
    const Vector3f mean = kOwn * behind[v](x, y) + (1 - kOwn) * others;
    out(x, y) = image(x, y) - (1 - opacity) * mean;
  });
  return out;
}

// What all views leave for the pane, on its pixels; what none tells stays as it was.
void gather(const PanePlaces& places,
            float opacity,
            const std::vector<ColorImage>& left,
            ColorImage& colors) {
  for_each_pixel(colors.width, colors.height, [&](int x, int y) {
    if (places.extent(x, y) == 0) return;
    Vector3f sum = Vector3f::Zero();
    float count = 0;
    for (size_t v = 0; v < left.size(); ++v) {
      const Vector2f& at = places.in_view[v](x, y);
      if (!is_known(at)) continue;
      const Vector3f shown = color_at(left[v], at);
      if (!is_known(shown)) continue;
      sum += shown;
      ++count;
    }
    if (count > 0) colors(x, y) = (sum / (count * opacity)).cwiseMax(0).cwiseMin(1);
  });
}

// The mean of what the view of the pane shows there: an even part is shared alike.
ColorImage even_colors(const PanePlaces& places, const ColorImage& photograph) {
  Vector3f sum = Vector3f::Zero();
  float count = 0;
  for (size_t i = 0; i < photograph.data.size(); ++i) {
    if (places.extent.data[i] == 0 || !is_known(photograph.data[i])) continue;
    sum += photograph.data[i];
    ++count;
  }
  const Vector3f mean = count > 0 ? Vector3f(sum / count) : Vector3f::Constant(0.5f);
  return {photograph.width, photograph.height, mean};
}

bool is_hidden(size_t v, int x, int y) {
  return (static_cast<int>(v) + x / kPiece + 2 * (y / kPiece)) % 4 == 0;
}

std::vector<ColorImage> with_hidden_pieces(std::vector<ColorImage> photographs) {
  for (size_t v = 0; v < photographs.size(); ++v) {
    ColorImage& image = photographs[v];
    for_each_pixel(image.width, image.height, [&](int x, int y) {
      if (is_hidden(v, x, y)) image(x, y).setConstant(std::nanf(""));
    });
  }
  return photographs;
}

}  // namespace

float contrast_lost(const JointSurface& surface, const PanePlaces& places) {
  constexpr size_t kFewestSamples = 300;
  constexpr int kApart = 8;  // [pixels]: what differs so far is not blurred by looking it up
  Contrast sum;
  for (size_t v = 0; v < surface.count(); ++v) {
    for (size_t u = 0; u < surface.count(); ++u) {
      if (u == v) continue;
      add_contrast(surface, places, v, u, {kApart, 0}, sum);
      add_contrast(surface, places, v, u, {0, kApart}, sum);
    }
  }
  if (sum.count < kFewestSamples || !(sum.squares > 0)) return 0;
  return static_cast<float>(1 - sum.products / sum.squares);
}

ColorImage pane_colors(const JointSurface& surface,
                       const PanePlaces& places,
                       float opacity,
                       const std::vector<ColorImage>& photographs) {
  constexpr int kRounds = 60;
  ColorImage colors = even_colors(places, photographs[places.drawn_from]);
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<ColorImage> behind = without_pane(places, opacity, colors, photographs);
    std::vector<ColorImage> left;
    for (size_t v = 0; v < surface.count(); ++v) {
      left.push_back(left_for_pane(surface, places, opacity, photographs, behind, v));
    }
    gather(places, opacity, left, colors);
  }
  return colors;
}

std::vector<ColorImage> without_pane(const PanePlaces& places,
                                     float opacity,
                                     const ColorImage& colors,
                                     const std::vector<ColorImage>& photographs) {
  std::vector<ColorImage> out = photographs;
  for (size_t v = 0; v < out.size(); ++v) {
    for_each_pixel(out[v].width, out[v].height, [&](int x, int y) {
      if (places.through[v](x, y) == 0) return;
      const Vector3f own = color_at(colors, places.of_view[v](x, y));
      out[v](x, y) = (out[v](x, y) - opacity * own) / (1 - opacity);
    });
  }
  return out;
}

double foretelling_gain(const JointSurface& surface, const PanePlaces& places, float opacity) {
  const std::vector<ColorImage> photographs = usable_photographs(surface);
  const std::vector<ColorImage> known = with_hidden_pieces(photographs);
  const ColorImage colors = pane_colors(surface, places, opacity, known);
  const std::vector<ColorImage> behind = without_pane(places, opacity, colors, known);
  double alone = 0;
  double both = 0;
  for (size_t v = 0; v < surface.count(); ++v) {
    for (int y = 0; y < photographs[v].height; ++y) {
      for (int x = 0; x < photographs[v].width; ++x) {
        if (places.through[v](x, y) == 0 || !is_hidden(v, x, y)) continue;
        const Vector3f& shown = photographs[v](x, y);
        const Vector3f as_surface = mean_of_others(surface, known, v, x, y);
        const Vector3f own = color_at(colors, places.of_view[v](x, y));
        const Vector3f as_both =
            (1 - opacity) * mean_of_others(surface, behind, v, x, y) + opacity * own;
        if (!is_known(shown) || !is_known(as_surface) || !is_known(as_both)) continue;
        alone += double((shown - as_surface).squaredNorm());
        both += double((shown - as_both).squaredNorm());
      }
    }
  }
  return alone > 0 && both > 0 ? 10 * std::log10(alone / both) : 0;
}

}  // namespace cgs
