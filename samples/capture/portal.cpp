// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/capture/portal.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include <Eigen/Geometry>

#include "samples/capture/arch.h"
#include "samples/capture/carving.h"
#include "samples/capture/mason.h"
#include "samples/capture/noise.h"
#include "samples/capture/solids.h"

namespace cgs {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using std::numbers::pi;

constexpr double kHalfWidth = 6.5;  // of wall and ground [m]

// The front is a net of its own; what lies behind it is hidden and stays coarse.
void add_wall(Mason& mason) {
  constexpr double kTop = 7;
  constexpr int kSteps = 48;
  std::vector<Loop> loops;
  for (const auto& station : arch_path(-0.3, kWallRadius, 0.06)) {
    const double c = std::cos(station.angle);
    const double s = std::sin(station.angle);
    const double to_side = std::abs(c) > 1e-9 ? kHalfWidth / std::abs(c) : 1e9;
    const double to_top = s > 1e-9 ? (kTop - kSpringing) / s : 1e9;
    const double outer = std::min(to_side, to_top);
    Loop loop{station.at({kWallRadius, 2.0}), station.at({kWallRadius, 0.2})};
    for (int i = 0; i <= kSteps; ++i) {
      loop.push_back(station.at({kWallRadius + (outer - kWallRadius) * i / kSteps, 0.0}));
    }
    loop.push_back(station.at({outer, 2.0}));
    loops.push_back(loop);
  }
  mason.add_stone("wall", Material::Ashlar, loft(loops, LoftEnds::Capped), 10);
  mason.add_stone(
      "core", Material::Ashlar, box({-2.5, kOrderBack - 0.1, -0.2}, {2.5, 1.95, 5}), 0.3);
}

void add_ground(Mason& mason) {
  mason.add_stone(
      "ground", Material::Paving, box({-kHalfWidth, -8, -0.5}, {kHalfWidth, 1.9, 0}), 0.15);
  for (int i = 0; i < 3; ++i) {
    const double half = 3.0 - 0.22 * i;
    mason.add_stone("step " + std::to_string(i + 1),
                    Material::Paving,
                    box({-half, -1.40 + 0.42 * i, -0.1}, {half, 1.5, 0.16 * (i + 1)}),
                    0.11);
  }
}

void add_arch(Mason& mason) {
  for (int order = 0; order < kOrders; ++order) {
    mason.add_stone("order " + std::to_string(order + 1),
                    Material::Arch,
                    swept(arch_path(-0.1, order_radius(order), 0.025),
                          [order](double along) { return order_section(order, along); }),
                    0.3);
  }
  const double r = kWallRadius;
  mason.add_stone("hood mould",
                  Material::Arch,
                  swept(arch_path(kSpringing, r, 0.03),
                        [r](double) {
                          return std::vector<Vector2d>{{r - 0.01, 0.1},
                                                       {r - 0.01, -0.05},
                                                       {r + 0.05, -0.13},
                                                       {r + 0.15, -0.15},
                                                       {r + 0.20, -0.11},
                                                       {r + 0.20, 0.1}};
                        }),
                  0.08);
  for (uint32_t i = 0; i < 19; ++i) {
    const double angle = pi * (0.04 + 0.92 * i / 18);
    const double size = 0.055 + 0.03 * static_cast<double>(uniform(i, 5));
    const Lathe ball{.profile = {{0.2 * size, -size},
                                 {0.7 * size, -0.7 * size},
                                 {size, 0},
                                 {0.7 * size, 0.7 * size},
                                 {0.2 * size, size}},
                     .sides = 20};
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() << (r + 0.1) * std::cos(angle), -0.16,
        kSpringing + (r + 0.1) * std::sin(angle);
    pose.rotate(Eigen::AngleAxisd(angle, Vector3d::UnitY()));
    mason.add_stone(
        "ball " + std::to_string(i + 1), Material::Carved, moved(lathed(ball), pose), 0.04);
  }
}

void add_columns(Mason& mason) {
  for (int side = -1; side <= 1; side += 2) {
    const std::string which = side < 0 ? " left" : " right";
    for (int order = 0; order < kOrders; ++order) {
      const double x = order_radius(order) + kOrderStep;  // the corner the column stands in
      const double y = order_front(order);
      const auto kind = static_cast<uint32_t>(order + (side < 0 ? 0 : 1));
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      pose.translation() << side * (x - 0.125), y - 0.125, 0;
      std::string place = which;
      place.append(" ").append(std::to_string(order + 1));
      mason.add_stone("column" + place, Material::Carved, moved(column(kind), pose), 0.1);
      const double inner = side * (order_radius(order) - 0.04);
      const double outer = side * (x + 0.06);
      mason.add_stone("impost" + place,
                      Material::Arch,
                      box({std::min(inner, outer), y - 0.30, kSpringing - 0.12},
                          {std::max(inner, outer), kOrderBack, kSpringing}),
                      0.06);
    }
  }
  Lathe pillar{.profile = {}, .sides = 64, .carving = [](double angle, double z) {
                 return 1 + 0.10 * std::sin(4 * angle - 7 * z) + 0.05 * std::sin(23 * z);
               }};
  for (double z = kThreshold - 0.05; z < 2.12; z += 0.03) pillar.profile.emplace_back(0.15, z);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() << 0, 1.20, 0;
  mason.add_stone("middle pillar", Material::Carved, moved(lathed(pillar), pose), 0.1);
}

void add_reliefs(Mason& mason) {
  const double r = order_radius(kOrders - 1);
  const auto height = [r](double x, double z) { return tympanum_height(x, z, r); };
  add_panel(mason,
            "tympanum",
            {{.width = 2 * r + 0.3, .top = r + 0.15, .height = height}, {0, 1.25, kSpringing}},
            Material::Carved);
  const auto frieze = [](double x, double z) { return frieze_height(x, z, 0.40, 3); };
  add_panel(mason,
            "lintel",
            {{.width = 2 * r + 0.3, .top = 0.40, .height = frieze}, {0, 1.15, kSpringing - 0.38}},
            Material::Carved);
  add_panel(
      mason,
      "door",
      {{.width = 2 * r + 0.3, .top = 1.7, .spacing = 0.02, .height = door_height}, {0, 1.42, 0.44}},
      Material::Wood);
  for (int side = -1; side <= 1; side += 2) {
    const std::string which = side < 0 ? " left" : " right";
    const uint32_t seed = side < 0 ? 21 : 57;
    const auto medallion = [seed](double x, double z) {
      return medallion_height(x, z, 0.42, seed);
    };
    add_panel(mason,
              "medallion" + which,
              {{.width = 0.84, .top = 0.84, .height = medallion}, {side * 2.52, 0, 4.08}},
              Material::Carved);
    const auto figure = [seed](double x, double z) { return figure_height(x, z, 1.25, seed); };
    add_panel(mason,
              "figure" + which,
              {{.width = 0.50, .top = 1.25, .height = figure}, {side * 3.42, -0.45, 1.35}},
              Material::Carved);
    const auto band = [seed](double x, double z) { return frieze_height(x, z, 0.46, seed); };
    add_panel(mason,
              "band" + which,
              {{.width = 0.50, .top = 0.46, .height = band}, {side * 3.42, -0.45, 2.85}},
              Material::Carved);
  }
}

void add_buttresses(Mason& mason) {
  for (int side = -1; side <= 1; side += 2) {
    const std::string which = side < 0 ? " left" : " right";
    const auto rectangle = [side](double grow, double front, double z) {
      const double x = side * 3.42;
      return Loop{{x - 0.33 - grow, front, z},
                  {x + 0.33 + grow, front, z},
                  {x + 0.33 + grow, 0.3, z},
                  {x - 0.33 - grow, 0.3, z}};
    };
    mason.add_stone(
        "buttress" + which,
        Material::Ashlar,
        loft({rectangle(0, -0.45, -0.1), rectangle(0, -0.45, 3.7), rectangle(0, -0.05, 4.3)},
             LoftEnds::Capped),
        0.08);
    mason.add_stone(
        "buttress foot" + which,
        Material::Ashlar,
        loft(
            {rectangle(0.12, -0.58, -0.1), rectangle(0.12, -0.58, 0.55), rectangle(0, -0.45, 0.68)},
            LoftEnds::Capped),
        0.08);
    mason.add_stone("string" + which,
                    Material::Arch,
                    loft({rectangle(0.05, -0.51, 2.64),
                          rectangle(0.08, -0.54, 2.70),
                          rectangle(0.08, -0.54, 2.78),
                          rectangle(0, -0.46, 2.84)},
                         LoftEnds::Capped),
                    0.06);
  }
}

void add_cornice(Mason& mason) {
  mason.add_stone(
      "cornice", Material::Ashlar, box({-kHalfWidth, -0.26, 5.12}, {kHalfWidth, 0.2, 5.36}), 0.20);
  for (int i = -14; i <= 14; ++i) {
    const uint32_t h = mixed(static_cast<uint32_t>(i), 17);
    const double x = 0.46 * i + 0.06 * (static_cast<double>(uniform(h, 1)) - 0.5);
    const double low = 4.86 + 0.05 * static_cast<double>(uniform(h, 2));
    const std::string name = "corbel " + std::to_string(i + 15);
    if (h % 3U == 0) {
      mason.add_stone(
          name, Material::Carved, box({x - 0.09, -0.20, low}, {x + 0.09, 0.1, 5.15}), 0.05);
      continue;
    }
    const double lobes = 2 + static_cast<double>(h % 5U);
    Lathe head{.profile = {}, .sides = 40, .carving = [=](double angle, double z) {
                 return 1 + 0.12 * std::sin(lobes * angle + 9 * z);
               }};
    for (int k = 0; k <= 14; ++k) {
      const double t = k / 14.0;
      head.profile.emplace_back(0.05 + 0.10 * std::sqrt(std::sin(0.3 + 1.9 * t)),
                                low + (5.14 - low) * t);
    }
    const Eigen::Isometry3d pose(Eigen::Translation3d(x, -0.06, 0));
    mason.add_stone(name, Material::Carved, moved(lathed(head), pose), 0.08);
  }
}

void add_font(Mason& mason) {
  Lathe font{.profile = {{0.34, -0.05}, {0.34, 0.10}, {0.27, 0.16}, {0.22, 0.24}}, .sides = 96};
  for (double z = 0.26; z < 0.60; z += 0.02) font.profile.emplace_back(0.18, z);
  for (int i = 0; i <= 16; ++i) {
    const double t = i / 16.0;
    font.profile.emplace_back(0.20 + 0.22 * std::sqrt(std::sin(0.5 * pi * t)), 0.62 + 0.38 * t);
  }
  font.profile.insert(font.profile.end(),
                      {{0.44, 1.02},
                       {0.45, 1.08},
                       {0.42, 1.11},
                       {0.37, 1.11},
                       {0.34, 1.05},
                       {0.28, 0.95},
                       {0.1, 0.92}});
  font.carving = [](double angle, double z) {
    if (z < 0.25 || z > 1.0) return 1.0;
    if (z < 0.61) return 1 + 0.09 * std::sin(6 * angle + 16 * z);
    return 1 + 0.05 * std::abs(std::sin(5.5 * angle)) * std::sin(pi * (z - 0.6) / 0.4) +
           0.02 * std::sin(17 * angle + 30 * z);
  };
  const Eigen::Isometry3d pose(Eigen::Translation3d(-1.75, -2.05, 0));
  mason.add_stone("font", Material::Carved, moved(lathed(font), pose), 0.06);
}

// Turned about the vertical by `yaw`, and the local z axis laid to point forward (-y).
Eigen::Isometry3d facing_front(const Vector3d& place, double yaw) {
  Eigen::Isometry3d pose(Eigen::Translation3d{place});
  pose.rotate(Eigen::AngleAxisd(yaw, Vector3d::UnitZ()));
  pose.rotate(Eigen::AngleAxisd(pi / 2, Vector3d::UnitX()));
  return pose;
}

void add_machine_parts(Mason& mason) {
  mason.add_stone("plinth", Material::Ashlar, box({1.05, -2.35, -0.05}, {2.45, -1.65, 0.55}), 0.08);
  const auto add_exact =
      [&](const std::string& name, TriangleMesh mesh, const Eigen::Isometry3d& pose) {
        refine(mesh, 0.06);
        mason.add(name, Material::Painted, moved(mesh, pose));
      };
  const BoredBlock block{
      .size = {0.52, 0.50, 0.36}, .wide_radius = 0.17, .narrow_radius = 0.11, .step_depth = 0.13};
  add_exact("bored block", bored_block(block), facing_front({1.42, -1.86, 0.80}, 0.25));
  add_exact(
      "base plate", box({1.10, -2.31, 0.54}, {1.74, -1.72, 0.60}), Eigen::Isometry3d::Identity());
  const Flange plate{.rim_radius = 0.29,
                     .bore_radius = 0.11,
                     .hole_radius = 0.032,
                     .hole_circle = 0.22,
                     .thickness = 0.06};
  const Eigen::Isometry3d pipe_pose = facing_front({2.08, -1.75, 0.85}, -0.30);
  add_exact("flange", flange(plate), pipe_pose * Eigen::Translation3d(0, 0, 0.34));
  const auto circle = [](double radius, double z) {
    Loop loop;
    for (int i = 0; i < 96; ++i) {
      loop.emplace_back(radius * std::cos(2 * pi * i / 96), radius * std::sin(2 * pi * i / 96), z);
    }
    return loop;
  };
  add_exact("pipe",
            loft({circle(0.15, 0), circle(0.15, 0.36), circle(0.11, 0.36), circle(0.11, 0)},
                 LoftEnds::Joined),
            pipe_pose);
  add_exact("saddle", box({1.98, -2.0, 0.54}, {2.20, -1.75, 0.74}), Eigen::Isometry3d::Identity());
}

void add_ironwork(Mason& mason) {
  for (int side = -1; side <= 1; side += 2) {
    const std::string which = side < 0 ? " left" : " right";
    for (int i = 0; i < 2; ++i) {
      const double z = 0.85 + 0.75 * i;
      const double inner = side * 0.30;
      const double outer = side * 1.35;
      TriangleMesh strap =
          box({std::min(inner, outer), 1.35, z}, {std::max(inner, outer), 1.45, z + 0.07});
      refine(strap, 0.05);
      mason.add("hinge" + which + " " + std::to_string(i + 1), Material::Iron, strap);
    }
    std::vector<Loop> loops;
    for (int i = 0; i < 32; ++i) {
      Loop loop;
      for (int k = 0; k < 10; ++k) {
        const double r = 0.10 + 0.016 * std::cos(2 * pi * k / 10);
        loop.emplace_back(side * 0.38 + r * std::cos(2 * pi * i / 32),
                          1.36 + 0.016 * std::sin(2 * pi * k / 10),
                          1.35 + r * std::sin(2 * pi * i / 32));
      }
      loops.push_back(loop);
    }
    mason.add("ring" + which, Material::Iron, loft(loops, LoftEnds::Joined));
  }
}

}  // namespace

void add_part(PortalScene& scene,
              const std::string& name,
              Material material,
              const TriangleMesh& mesh) {
  auto& all = scene.mesh;
  const auto base = static_cast<uint32_t>(all.vertices.size());
  scene.parts.push_back({name,
                         material,
                         base,
                         static_cast<uint32_t>(mesh.vertices.size()),
                         static_cast<uint32_t>(all.faces.size()),
                         static_cast<uint32_t>(mesh.faces.size())});
  all.vertices.insert(all.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
  for (const auto& f : mesh.faces) all.faces.push_back({f[0] + base, f[1] + base, f[2] + base});
  scene.part_of_face.resize(all.faces.size(), static_cast<uint16_t>(scene.parts.size() - 1));
}

PortalScene portal_scene() {
  PortalScene scene;
  Mason mason(scene);
  add_wall(mason);
  add_ground(mason);
  add_arch(mason);
  add_columns(mason);
  add_reliefs(mason);
  add_buttresses(mason);
  add_cornice(mason);
  add_font(mason);
  add_machine_parts(mason);
  add_ironwork(mason);
  scene.bvh = build_bvh(scene.mesh);
  return scene;
}

TriangleMesh part_mesh(const PortalScene& scene, const PortalPart& part) {
  TriangleMesh mesh;
  const auto vertex = scene.mesh.vertices.begin() + part.first_vertex;
  mesh.vertices.assign(vertex, vertex + part.vertex_count);
  for (uint32_t f = part.first_face; f < part.first_face + part.face_count; ++f) {
    const auto& face = scene.mesh.faces[f];
    mesh.faces.push_back(
        {face[0] - part.first_vertex, face[1] - part.first_vertex, face[2] - part.first_vertex});
  }
  return mesh;
}

}  // namespace cgs
